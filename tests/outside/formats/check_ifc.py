#!/usr/bin/env python3
"""Reads a model's IFC with ifcopenshell: its validator finds nothing, every element has geometry, doors and
windows have closed bodies in openings of their size, and counts are the model's.

    check_ifc.py MODEL_FOLDER [--least-doors N]

Needs ifcopenshell, numpy."""

import argparse
import json
import sys
from pathlib import Path

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.util.placement
import ifcopenshell.validate
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from formats.check_building import is_closed, kernel
from lib.verdict import require

SURFACES = ["IfcWall", "IfcSlab", "IfcCovering", "IfcBuildingElementProxy"]
QUANTITIES = "Qto_OpeningElementBaseQuantities"
# An opening lies beside its wall by no more than a leaf is thick.
LEAF_M = 0.2

# Read as any program reads, which cuts openings that have a shape: ours have none, the surfaces are cut
# already.
settings = ifcopenshell.geom.settings()
settings.set("use-world-coords", True)


def check_valid(model):
    log = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(model, log, express_rules=True)
    require(not log.statements, f"ifcopenshell's validator finds {log.statements[:5]}")


def holes_of(mesh):
    """Holes of a connected flat mesh: one less Euler's number (vertices - edges + triangles)."""
    places = mesh.Coordinates.CoordList
    corners = [[places[corner - 1] for corner in triangle] for triangle in mesh.CoordIndex]
    edges = {frozenset(edge) for a, b, c in corners for edge in ((a, b), (b, c), (c, a))}
    return 1 - (len({corner for triangle in corners for corner in triangle}) - len(edges) + len(corners))


def check_counts(model, summary):
    """Polygons, holes and leftover triangles as summary.json has them; returns the polygons that had to be
    triangles."""
    fine = {
        item
        for element in model.by_type("IfcBuildingElementProxy")
        if element.Name == "leftovers"
        for item in element.Representation.Representations[0].Items
    }
    ragged = set(model.by_type("IfcTriangulatedFaceSet")) - fine
    holes = sum(len(face.InnerCoordIndices) for face in model.by_type("IfcIndexedPolygonalFaceWithVoids"))
    found = {
        "polygons": len(model.by_type("IfcIndexedPolygonalFace")) + len(ragged),
        "holes": holes + sum(holes_of(mesh) for mesh in ragged),
        "leftover_triangles": sum(len(mesh.CoordIndex) for mesh in fine),
    }
    for key, count in found.items():
        require(count == summary[key], f"{count} {key}; summary.json has {summary[key]}")
    return ragged


def vertices_of(element):
    geometry = ifcopenshell.geom.create_shape(settings, element).geometry
    return np.array(geometry.verts).reshape(-1, 3), np.array(geometry.faces).reshape(-1, 3)


def check_areas(model):
    """Geometry can be made of every surface, and has the area that is written; returns the largest difference
    in square meters."""
    worst_m2 = 0.0
    for element in (element for kind in SURFACES for element in model.by_type(kind)):
        vertices, faces = vertices_of(element)
        corners = vertices[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area_m2 = np.linalg.norm(normals, axis=1).sum() / 2
        values = ifcopenshell.util.element.get_pset(element, "Biplane_Surface")
        if values:
            away_m2 = abs(area_m2 - values["Area"])
            require(away_m2 < 0.002 + 0.001 * values["Area"], f"{element} has {area_m2} m2, not {values}")
            worst_m2 = max(worst_m2, away_m2)
        require(element.ContainedInStructure, f"{element} is in no storey")
    return worst_m2


def check_fillings(model):
    """Doors and windows fill openings of their own size, and have a body in them. A leaf is the surface that
    was seen; frames are closed."""
    for element in model.by_type("IfcDoor") + model.by_type("IfcWindow"):
        require(element.FillsVoids, f"{element} fills nothing")
        opening = element.FillsVoids[0].RelatingOpeningElement
        require(opening.VoidsElements, f"{opening} is in no wall")
        size = ifcopenshell.util.element.get_pset(opening, QUANTITIES)
        own = (element.OverallWidth, element.OverallHeight)
        require((size["Width"], size["Height"]) == own, f"{element} fills an opening of {size}")
        body, triangles = kernel(element)
        if element.Representation.Representations[0].RepresentationType == "SweptSolid":
            require(is_closed(body, triangles), f"{element} is open")
            wide, _, high = np.ptp(body, axis=0)
            require(np.allclose([wide, high], own, atol=1e-3), f"{element} has a body of {wide} x {high} m")


def check_openings(model):
    """An opening lies in its wall: not far beside it, and below its upper edge. A laser may see no wall near
    the floor."""
    for opening in model.by_type("IfcOpeningElement"):
        at = ifcopenshell.util.placement.get_local_placement(opening.ObjectPlacement)
        size = ifcopenshell.util.element.get_pset(opening, QUANTITIES)
        sides = (-size["Width"] / 2, size["Width"] / 2)
        wall, _ = vertices_of(opening.VoidsElements[0].RelatingBuildingElement)
        corners = np.array([(at @ [x, 0, z, 1])[:3] for x in sides for z in (0, size["Height"])])
        beside = np.maximum(wall.min(axis=0) - corners, corners - wall.max(axis=0))
        lies_in = (beside[:, :2] < LEAF_M).all() and (beside[1::2, 2] < 0).all()
        require(lies_in, f"{opening} with corners {corners} is not in its wall")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--least-doors", type=int, default=0)
    args = parser.parse_args()
    path = args.folder / "model.ifc"
    model = ifcopenshell.open(path)
    check_valid(model)
    ragged = check_counts(model, json.loads((args.folder / "summary.json").read_text()))
    worst_m2 = check_areas(model)
    counts = {
        kind: len(model.by_type(kind)) for kind in [*SURFACES, "IfcDoor", "IfcWindow", "IfcBuildingStorey"]
    }
    require(counts["IfcDoor"] >= args.least_doors, f"wanted {args.least_doors} doors: {counts}")
    check_fillings(model)
    check_openings(model)
    print(
        f"{path}: valid, geometry of every element (areas within {worst_m2:.4f} m2), "
        f"{len(ragged)} of triangles, {counts}"
    )


main()
