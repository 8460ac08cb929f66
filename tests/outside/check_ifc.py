#!/usr/bin/env python3
"""A model's IFC read by ifcopenshell: its validator finds nothing, geometry can be made of every element, and counts are the model's.

  check_ifc.py MODEL_FOLDER [--least-doors N]
"""
import argparse
import json
import logging
import pathlib

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.validate
import numpy as np

parser = argparse.ArgumentParser()
parser.add_argument("folder", type=pathlib.Path)
parser.add_argument("--least-doors", type=int, default=0)
args = parser.parse_args()

path = args.folder / "model.ifc"
model = ifcopenshell.open(path)
log = ifcopenshell.validate.json_logger()
ifcopenshell.validate.validate(model, log, express_rules=True)
assert not log.statements, log.statements[:5]

summary = json.loads((args.folder / "summary.json").read_text())
faces = model.by_type("IfcIndexedPolygonalFace")
fine = {
    item
    for element in model.by_type("IfcBuildingElementProxy")
    if element.Name == "fine structure"
    for item in element.Representation.Representations[0].Items
}
ragged = set(model.by_type("IfcTriangulatedFaceSet")) - fine
openings = model.by_type("IfcOpeningElement")
polygons = len(faces) + len(ragged) - len(openings)
assert polygons == summary["polygons"], (polygons, summary["polygons"])


def holes_of(mesh):
    """Holes of a connected flat mesh: one less Euler's number (vertices - edges + triangles)."""
    corners = [[mesh.Coordinates.CoordList[corner - 1] for corner in triangle] for triangle in mesh.CoordIndex]
    edges = {frozenset(edge) for a, b, c in corners for edge in ((a, b), (b, c), (c, a))}
    return 1 - (len({corner for triangle in corners for corner in triangle}) - len(edges) + len(corners))


holes = sum(len(face.InnerCoordIndices) for face in model.by_type("IfcIndexedPolygonalFaceWithVoids"))
holes += sum(holes_of(mesh) for mesh in ragged)
assert holes == summary["holes"], (holes, summary["holes"])
triangles = sum(len(mesh.CoordIndex) for mesh in fine)
assert triangles == summary["leftover_triangles"], (triangles, summary["leftover_triangles"])

# Our openings are of identifier Reference: the standard says that they are cut out of the body already. ifcopenshell cuts all the same,
# which does nothing to a polygon and breaks triangles, so walls of triangles are read without.
as_usual, uncut = ifcopenshell.geom.settings(), ifcopenshell.geom.settings()
for settings in (as_usual, uncut):
    settings.set("use-world-coords", True)
uncut.set("disable-opening-subtractions", True)
kinds = ["IfcWall", "IfcSlab", "IfcCovering", "IfcBuildingElementProxy"]
counts = {kind: len(model.by_type(kind)) for kind in [*kinds, "IfcDoor", "IfcWindow", "IfcBuildingStorey"]}
worst = 0.0
for element in (element for kind in kinds for element in model.by_type(kind)):
    is_ragged = element.Representation.Representations[0].Items[0] in ragged
    shape = ifcopenshell.geom.create_shape(uncut if is_ragged else as_usual, element)
    corners = np.array(shape.geometry.verts).reshape(-1, 3)[np.array(shape.geometry.faces).reshape(-1, 3)]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    values = ifcopenshell.util.element.get_pset(element, "Biplane_Surface")
    if values:
        assert abs(area - values["Area"]) < 0.002 + 0.001 * values["Area"], (element, area, values)
        worst = max(worst, abs(area - values["Area"]))
    assert element.ContainedInStructure, element
assert counts["IfcDoor"] >= args.least_doors, counts
for element in model.by_type("IfcDoor") + model.by_type("IfcWindow"):
    assert element.FillsVoids and element.FillsVoids[0].RelatingOpeningElement.VoidsElements, element
print(f"{path}: valid, geometry of every element (areas within {worst:.4f} m2), {len(ragged)} of triangles, {counts}")
