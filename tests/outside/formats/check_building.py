#!/usr/bin/env python3
"""Reads the building of a model's IFC with ifcopenshell and its kernel, and building.json beside it.

Its validator (with the express rules) finds nothing; every body is closed and as large as the quantities say;
spaces, walls, doors and windows are there, related as architects' programs expect, and named as in
building.json; whatever is assumed or inferred says so.

    check_building.py MODEL_FOLDER [--rooms N] [--doors N] [--windows N]

Needs ifcopenshell, numpy, pytest."""

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.validate
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.verdict import require

EVIDENCE = "Biplane_Evidence"
# Lengths are written with four decimals.
VOLUME_M3 = 0.002
AREA_M2 = 0.002


def kernel(element, openings_cut=False):
    """Vertices and triangles of an element's body, as the kernel makes them."""
    settings = ifcopenshell.geom.settings()
    settings.set("disable-opening-subtractions", not openings_cut)
    shape = ifcopenshell.geom.create_shape(settings, element)
    vertices = np.array(shape.geometry.verts).reshape(-1, 3)
    return vertices, np.array(shape.geometry.faces).reshape(-1, 3)


def volume(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return abs(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6


def is_closed(vertices, faces):
    """Every edge is used as often in one direction as in the other."""
    _, same = np.unique(np.round(vertices, 6), axis=0, return_inverse=True)
    same = same.reshape(-1)
    edges = Counter()
    for a, b, c in same[faces]:
        for p, q in ((a, b), (b, c), (c, a)):
            edges[(p, q)] += 1
            edges[(q, p)] -= 1
    return not any(edges.values())


def check_valid(model):
    log = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(model, log, express_rules=True)
    require(not log.statements, f"ifcopenshell's validator finds {log.statements[:5]}")


def quantity(element, name):
    sets = ifcopenshell.util.element.get_psets(element, qtos_only=True)
    return next((values[name] for values in sets.values() if name in values), None)


def near(found, stated, tolerance, what):
    away = abs(found - stated)
    require(away <= tolerance + 1e-4 * abs(stated), f"{what}: {stated} is stated, the kernel has {found}")


def check_spaces(model):
    spaces = model.by_type("IfcSpace")
    require(spaces, "there is no space")
    for space in spaces:
        vertices, faces = kernel(space)
        require(is_closed(vertices, faces), f"{space.Name} is open")
        near(volume(vertices, faces), quantity(space, "NetVolume"), VOLUME_M3, f"volume of {space.Name}")
        height = np.ptp(vertices[:, 2])
        near(height, quantity(space, "Height"), 1e-3, f"height of {space.Name}")
        area = volume(vertices, faces) / height
        near(area, quantity(space, "NetFloorArea"), AREA_M2, f"area of {space.Name}")
        parent = ifcopenshell.util.element.get_aggregate(space)
        require(parent and parent.is_a("IfcBuildingStorey"), f"{space.Name} is in no storey")
        kinds = {bound.RelatedBuildingElement.is_a() for bound in space.BoundedBy}
        require({"IfcWall", "IfcSlab"} <= kinds, f"{space.Name} is bounded by {kinds}")


def check_walls(model):
    walls = model.by_type("IfcWall")
    require(walls, "there is no wall")
    for wall in walls:
        vertices, faces = kernel(wall)
        require(is_closed(vertices, faces), f"{wall.Name} is open")
        names = [shape.RepresentationIdentifier for shape in wall.Representation.Representations]
        require(names == ["Axis", "Body"], f"{wall.Name} has {names}")
        evidence = ifcopenshell.util.element.get_pset(wall, EVIDENCE)
        thickness, known = quantity(wall, "Width"), evidence["ThicknessFrom"] != "unknown"
        require((thickness is not None) == known, f"{wall.Name}: width {thickness}, {evidence}")
        material = ifcopenshell.util.element.get_material(wall)
        require((material is not None) == known, f"{wall.Name}: {material}, {evidence}")
        if not known:
            require("AssumedDepth" in evidence, f"{wall.Name} does not say that its depth is assumed")
            continue
        require(abs(material.ForLayerSet.MaterialLayers[0].LayerThickness - thickness) < 1e-6, wall.Name)
        near(volume(vertices, faces), quantity(wall, "GrossVolume"), VOLUME_M3, f"volume of {wall.Name}")
        cut = kernel(wall, openings_cut=True)
        require(is_closed(*cut), f"{wall.Name} with its openings is open")
        near(volume(*cut), quantity(wall, "NetVolume"), VOLUME_M3, f"net volume of {wall.Name}")


def check_fillings(model):
    """Doors and windows fill openings of their own size in walls, and have a body in them."""
    for element in model.by_type("IfcDoor") + model.by_type("IfcWindow"):
        require(element.FillsVoids, f"{element} fills nothing")
        opening = element.FillsVoids[0].RelatingOpeningElement
        require(opening.VoidsElements[0].RelatingBuildingElement.is_a("IfcWall"), f"{opening} is in no wall")
        require(not opening.ContainedInStructure, f"{opening} is in a storey, not in a wall alone")
        vertices, faces = kernel(opening)
        require(is_closed(vertices, faces), f"{opening} is open")
        wide, deep, high = np.ptp(vertices, axis=0)
        near(wide, element.OverallWidth, 1e-3, f"width of {element.Name}")
        near(high, element.OverallHeight, 1e-3, f"height of {element.Name}")
        body, triangles = kernel(element)
        require(is_closed(body, triangles), f"{element.Name} is open")
        require((np.ptp(body, axis=0)[[0, 2]] <= [wide + 1e-3, high + 1e-3]).all(), f"{element.Name}")


def check_names(model, building):
    """The same names as in building.json."""
    kinds = {"rooms": ["IfcSpace"], "walls": ["IfcWall"], "openings": ["IfcOpeningElement"]}
    for key, entities in kinds.items():
        named = sorted(thing["id"] for thing in building[key])
        found = sorted(element.Name for kind in entities for element in model.by_type(kind))
        require(named == found, f"{key}: building.json has {named}, model.ifc {found}")
    storeys = {storey.Name for storey in model.by_type("IfcBuildingStorey")}
    own = {storey["id"] for storey in building["storeys"]}
    require(own <= storeys, f"storeys: building.json has {own}, model.ifc {storeys}")
    for space in [*model.by_type("IfcSpace"), *model.by_type("IfcBuildingStorey")]:
        require(space.LongName, f"{space.Name} has no LongName")


def check_honesty(model):
    """Everything of the building says how it is known."""
    for kind in ("IfcSpace", "IfcWall", "IfcSlab", "IfcCovering", "IfcDoor", "IfcWindow"):
        for element in model.by_type(kind):
            evidence = ifcopenshell.util.element.get_pset(element, EVIDENCE)
            require(evidence and "Source" in evidence, f"{element} does not say how it is known")
    slabs = [ifcopenshell.util.element.get_pset(slab, EVIDENCE) for slab in model.by_type("IfcSlab")]
    require(slabs and all(slab["Source"] == "inferred" for slab in slabs), f"no laser saw the floor: {slabs}")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    for name in ("rooms", "doors", "windows"):
        parser.add_argument(f"--{name}", type=int, default=0, help=f"the least number of {name}")
    words = parser.parse_args()
    model = ifcopenshell.open(words.folder / "model.ifc")
    building = json.loads((words.folder / "building.json").read_text())
    check_valid(model)
    check_spaces(model)
    check_walls(model)
    check_fillings(model)
    check_names(model, building)
    check_honesty(model)
    counts = {
        "rooms": len(model.by_type("IfcSpace")),
        "doors": len(model.by_type("IfcDoor")),
        "windows": len(model.by_type("IfcWindow")),
    }
    for name, count in counts.items():
        expected = getattr(words, name)
        require(count >= expected, f"{count} {name}, at least {expected} are expected")
    print(f"model.ifc: {counts}, {len(model.by_type('IfcWall'))} walls, all bodies closed, quantities right")


if __name__ == "__main__":
    main()
