#!/usr/bin/env python3
"""A world for `biplane-mock simulate` of a storey of an IFC file, a drive through its rooms, and the truth.

    make_ifc_world.py FILE.ifc [--storey N] [--doors open|closed] [--seed N] -o DIR

Geometry is ifcopenshell's. Writes DIR/world.obj (an object for each element, its name begins with its class),
DIR/path.toml (a drive through all rooms that a robot of 0.28 m radius reaches) and DIR/truth.json (rooms,
walls, doors and windows in the schema of `building.json`, frame `map` of that drive). Storeys count from 0,
the lowest. Rooms are the storey's spaces; a room's ceiling is what is over it, not the top of its space."""

import argparse
import json
import sys
from pathlib import Path

import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.util.element
import ifcopenshell.util.unit
import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).parent))

import drive
import truth

NO_SURFACES = ("IfcSpace", "IfcOpeningElement", "IfcAnnotation", "IfcGrid", "IfcVirtualElement", "IfcSite")


class Bodies:
    """Meshes of elements in meters, in the file's own frame."""

    def __init__(self):
        self.settings = ifcopenshell.geom.settings()
        self.settings.set("use-world-coords", True)

    def of(self, product):
        if not product.Representation:
            return None
        try:
            geometry = ifcopenshell.geom.create_shape(self.settings, product).geometry
        except RuntimeError:
            return None
        vertices = np.array(geometry.verts).reshape(-1, 3)
        faces = np.array(geometry.faces).reshape(-1, 3)
        return (vertices, faces) if len(faces) else None


def storey_of(element):
    """The storey that an element is contained in, through what it is a part of."""
    container = ifcopenshell.util.element.get_container(element)
    while container is not None and not container.is_a("IfcBuildingStorey"):
        container = ifcopenshell.util.element.get_aggregate(container)
    return container


def ceiling_over(objects, polygon, floor_z):
    """The median height of what is over points of a room."""
    low_x, low_y, high_x, high_y = polygon.bounds
    grid = np.stack(np.meshgrid(np.linspace(low_x, high_x, 9), np.linspace(low_y, high_y, 9)), -1).reshape(
        -1, 2
    )
    points = grid[shapely.contains_xy(polygon, grid[:, 0], grid[:, 1])]
    lowest = np.full(len(points), np.inf)
    for name, vertices, faces in objects:
        if name.startswith("IfcFurn") or vertices[:, 2].max() < floor_z + 1.5:
            continue
        corners = vertices[faces]
        for a, b, c in corners:
            if max(a[2], b[2], c[2]) < floor_z + 1.5:
                continue
            matrix = np.array([b - a, c - a])[:, :2].T
            if abs(np.linalg.det(matrix)) < 1e-9:
                continue
            s, t = np.linalg.solve(matrix, (points - a[:2]).T)
            z = a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2])
            over = (s >= 0) & (t >= 0) & (s + t <= 1) & (z > floor_z + 1.5)
            lowest[over] = np.minimum(lowest[over], z[over])
    seen = lowest[np.isfinite(lowest)]
    return float(np.median(seen)) if len(seen) else floor_z + 2.5


def read(path, storey, doors_open):
    """The world of an IFC file."""
    file = ifcopenshell.open(path)
    storeys = sorted(file.by_type("IfcBuildingStorey"), key=lambda each: each.Elevation or 0.0)
    if not 0 <= storey < len(storeys):
        sys.exit(f"storey {storey}: the file has {len(storeys)}, counted from 0")
    chosen, bodies = storeys[storey], Bodies()
    objects = []
    for product in file.by_type("IfcProduct"):
        if product.is_a() not in NO_SURFACES and (body := bodies.of(product)):
            objects.append((f"{product.is_a()}_{product.GlobalId.replace('$', '-')}", *body))
    spaces = [s for s in file.by_type("IfcSpace") if ifcopenshell.util.element.get_aggregate(s) == chosen]
    shapes = [(space, bodies.of(space)) for space in spaces]
    shapes = [(space, body) for space, body in shapes if body]
    if not shapes:
        sys.exit(f"storey {storey} ({chosen.Name}) has no spaces")
    floor_z = float(np.median([body[0][:, 2].min() for _, body in shapes]))
    rooms = []
    for space, body in shapes:
        polygon = truth.footprint_of(*body)
        name = " ".join(filter(None, (space.Name, space.LongName)))
        rooms.append((name, polygon, ceiling_over(objects, polygon, floor_z)))
    walls, openings, ways = [], [], []
    for wall in file.by_type("IfcWall"):
        if storey_of(wall) == chosen and (body := bodies.of(wall)):
            footprint = truth.footprint_of(*body)
            axis, thickness = truth.strip(footprint)
            height = float(np.ptp(body[0][:, 2]))
            walls.append((wall.Name or "", footprint, axis, thickness, height, "wall"))
            openings += [(len(walls) - 1, voids.RelatedOpeningElement) for voids in wall.HasOpenings]
    for part in file.by_type("IfcCurtainWall"):
        parts = [bodies.of(each) for each in ifcopenshell.util.element.get_decomposition(part)]
        parts = [body for body in [*parts, bodies.of(part)] if body]
        if storey_of(part) == chosen and parts:
            height = float(np.ptp(np.concatenate([vertices[:, 2] for vertices, _ in parts])))
            parts = [truth.footprint_of(*body) for body in parts]
            axis, thickness = truth.strip(shapely.unary_union(parts).convex_hull)
            footprint = truth.line(*axis).buffer(thickness / 2, cap_style="flat")
            walls.append((part.Name or "", footprint, axis, thickness, height, "curtain"))
    found = [as_opening(bodies, wall, opening) for wall, opening in openings]
    found = [opening for opening in found if opening and opening[5] > floor_z + 0.3]
    if doors_open:
        ways = [opening[3] for opening in found if opening[1] != "window"]
    else:
        ways = [opening[3] for opening in found if opening[1] == "passage"]
    gone = ["IfcDoor"] if doors_open else []
    return truth.World(objects, floor_z, rooms, walls, found, gone, ways)


def as_opening(bodies, wall, opening):
    """Kind, box and heights of an opening: what fills it says what it is."""
    body = bodies.of(opening)
    if not body:
        return None
    fills = [fill.RelatedBuildingElement for fill in opening.HasFillings]
    kinds = {"IfcDoor": "door", "IfcWindow": "window"}
    kind = next((kinds[fill.is_a()] for fill in fills if fill.is_a() in kinds), "passage")
    low_z, high_z = float(body[0][:, 2].min()), float(body[0][:, 2].max())
    box = truth.footprint_of(*body)
    name = next((fill.Name for fill in fills if fill.Name), opening.Name) or ""
    return (name, kind, wall, box, low_z, high_z)


def write(world, folder, seed):
    """The three files, and what was planned."""
    low, high = (world.floor_z_m + z for z in drive.OBSTACLE_BAND_M)
    objects = [o for o in world.objects if not any(o[0].startswith(gone) for gone in world.without_objects)]
    polygons = [room[1] for room in world.rooms]
    waypoints, entered, least = drive.plan(polygons, world.ways, truth.in_band(objects, low, high), seed)
    folder.mkdir(parents=True, exist_ok=True)
    truth.write_obj(folder / "world.obj", world.objects)
    (folder / "path.toml").write_text(drive.path_toml(waypoints, world.floor_z_m, world.without_objects))
    text = json.dumps(truth.truth_json(world, waypoints, entered), indent=1)
    (folder / "truth.json").write_text(text + "\n")
    length = sum(np.linalg.norm(np.subtract(a, b)) for a, b in zip(waypoints, waypoints[1:]))
    print(
        f"{folder}: {len(world.objects)} objects, {len(entered)} of {len(polygons)} rooms entered, "
        f"{length:.0f} m, {least:.2f} m to the sides at least"
    )


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path)
    parser.add_argument("--storey", type=int, default=0)
    parser.add_argument("--doors", choices=["open", "closed"], default="closed")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    write(read(options.file, options.storey, options.doors == "open"), options.output, options.seed)


if __name__ == "__main__":
    main()
