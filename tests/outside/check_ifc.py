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
import ifcopenshell.util.placement
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
polygons = len(faces) + len(ragged)
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

# Read as any program reads, which cuts openings that have a shape: ours have none, the surfaces are cut already.
settings = ifcopenshell.geom.settings()
settings.set("use-world-coords", True)
kinds = ["IfcWall", "IfcSlab", "IfcCovering", "IfcBuildingElementProxy"]
counts = {kind: len(model.by_type(kind)) for kind in [*kinds, "IfcDoor", "IfcWindow", "IfcBuildingStorey"]}
worst = 0.0
for element in (element for kind in kinds for element in model.by_type(kind)):
    shape = ifcopenshell.geom.create_shape(settings, element)
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
    size = ifcopenshell.util.element.get_pset(
        element.FillsVoids[0].RelatingOpeningElement, "Qto_OpeningElementBaseQuantities"
    )
    assert (size["Width"], size["Height"]) == (element.OverallWidth, element.OverallHeight), (element, size)
for opening in openings:
    at = ifcopenshell.util.placement.get_local_placement(opening.ObjectPlacement)
    size = ifcopenshell.util.element.get_pset(opening, "Qto_OpeningElementBaseQuantities")
    shape = ifcopenshell.geom.create_shape(settings, opening.VoidsElements[0].RelatingBuildingElement)
    wall = np.array(shape.geometry.verts).reshape(-1, 3)
    # It lies in its wall: beside it by no more than a leaf is thick, and below its upper edge. A laser may see no wall near the floor.
    corners = np.array([(at @ [x, 0, z, 1])[:3] for x in (0, size["Width"]) for z in (0, size["Height"])])
    beside = np.maximum(wall.min(axis=0) - corners, corners - wall.max(axis=0))
    assert (beside[:, :2] < 0.2).all() and (beside[1::2, 2] < 0).all(), (opening, corners)
print(f"{path}: valid, geometry of every element (areas within {worst:.4f} m2), {len(ragged)} of triangles, {counts}")
