"""The truth of a storey in the schema of `building.json`, and worlds as OBJ files with named objects."""

import math
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon

# Walls this far apart from a door's middle at most belong to it.
BESIDE_WALL_M = 0.25


@dataclass
class World:
    """Named meshes, and what they are: in the world's own frame, meters."""

    objects: list  # (name, vertices, faces)
    floor_z_m: float
    rooms: list  # (name, shapely polygon, ceiling height over the origin)
    walls: list  # (name, footprint polygon, axis ((x, y), (x, y)), thickness, height, kind)
    openings: list  # (name, kind, wall's index, box polygon, low z, high z)
    without_objects: list = field(default_factory=list)
    ways: list = field(default_factory=list)  # polygons of doors that are open
    columns: list = field(default_factory=list)  # x, y, width of square ones


def write_obj(path, objects):
    """Objects by name, one after the other."""
    lines, count = [], 1
    for name, vertices, faces in objects:
        lines.append(f"o {name}")
        lines += [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in vertices]
        lines += [f"f {a} {b} {c}" for a, b, c in np.asarray(faces) + count]
        count += len(vertices)
    path.write_text("\n".join(lines) + "\n")


def in_band(objects, low_z, high_z, step_m=0.02):
    """Points on all surfaces between two heights, x and y."""
    out = []
    for _, vertices, faces in objects:
        corners = np.asarray(vertices)[np.asarray(faces)]
        z = corners[:, :, 2]
        for a, b, c in corners[(z.min(axis=1) < high_z) & (z.max(axis=1) > low_z)]:
            # Sides are sampled across the longest one, so that slivers stay cheap.
            n = max(1, math.ceil(np.linalg.norm(b - a) / step_m), math.ceil(np.linalg.norm(c - a) / step_m))
            i, j = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
            keep = i + j <= 1 + 1e-9
            points = a + i[keep][:, None] * (b - a) + j[keep][:, None] * (c - a)
            out.append(points[(points[:, 2] > low_z) & (points[:, 2] < high_z)][:, :2])
    return np.concatenate(out) if out else np.zeros((0, 2))


def strip(polygon):
    """Axis and thickness of a long footprint: of its least rectangle."""
    corners = np.array(polygon.minimum_rotated_rectangle.exterior.coords)[:4]
    if np.linalg.norm(corners[1] - corners[0]) < np.linalg.norm(corners[2] - corners[1]):
        corners = np.roll(corners, -1, axis=0)
    a, b = (corners[0] + corners[3]) / 2, (corners[1] + corners[2]) / 2
    return (tuple(a), tuple(b)), float(np.linalg.norm(corners[2] - corners[1]))


def opening_sizes(wall_axis, box):
    """Width along the wall and the middle."""
    a, b = map(np.array, wall_axis)
    along = (b - a) / np.linalg.norm(b - a)
    s = (np.array(box.exterior.coords) - a) @ along
    t = (np.array(box.exterior.coords) - a) @ np.array([-along[1], along[0]])
    middle = a + along * (s.min() + s.max()) / 2 + np.array([-along[1], along[0]]) * (t.min() + t.max()) / 2
    return float(s.max() - s.min()), middle, np.array([-along[1], along[0]])


def rooms_beside(rooms, middle, across, reach_m):
    """Ids of the rooms on both sides of an opening."""
    found = []
    for side in (1, -1):
        probe = Point(*(middle + side * across * reach_m))
        found += [f"R{k + 1:02}" for k, room in enumerate(rooms) if room[1].contains(probe)][:1]
    return found


def moved(points, start, heading_rad):
    """x and y as seen from a start."""
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    p = np.asarray(points, float) - start
    return [[round(float(x * cos + y * sin), 4), round(float(-x * sin + y * cos), 4)] for x, y in p]


def truth_json(world, waypoints, entered):
    """The schema of `building.json` in frame `map`: the drive's start, looking at its second waypoint."""
    start, ahead = np.array(waypoints[0]), np.array(waypoints[1])
    heading = math.atan2(*(ahead - start)[::-1])

    def at(points):
        return moved(points, start, heading)

    def ring(line):
        return at(np.array(line.coords)[:-1])

    floor = world.floor_z_m
    rooms = [
        {
            "id": f"R{k + 1:02}",
            "storey": "S1",
            "name": name,
            "outline_m": ring(polygon.exterior),
            "holes_m": [ring(hole) for hole in polygon.interiors],
            "floor_z_m": 0.0,
            "ceiling_z_m": round(ceiling - floor, 4),
            "area_m2": round(polygon.area, 4),
            "closed": True,
            "entered": k in entered,
        }
        for k, (name, polygon, ceiling) in enumerate(world.rooms)
    ]
    walls = [
        {
            "id": f"W{k + 1:02}",
            "storey": "S1",
            "name": name,
            "kind": kind,
            "axis_m": at(axis),
            "outline_m": ring(footprint.exterior),
            "thickness_m": round(thickness, 4),
            "height_m": round(height, 4),
            "rooms": [
                f"R{n + 1:02}"
                for n, room in enumerate(world.rooms)
                if beside_m(footprint, room[1], thickness) > 0.3
            ],
        }
        for k, (name, footprint, axis, thickness, height, kind) in enumerate(world.walls)
    ]
    openings = []
    for k, (name, kind, wall, box, low_z, high_z) in enumerate(world.openings):
        width, middle, across = opening_sizes(world.walls[wall][2], box)
        openings.append(
            {
                "id": f"O{k + 1:02}",
                "kind": kind,
                "name": name,
                "wall": f"W{wall + 1:02}",
                "center_m": at([middle])[0] + [round((low_z + high_z) / 2 - floor, 4)],
                "width_m": round(width, 4),
                "height_m": round(high_z - low_z, 4),
                "sill_m": round(low_z - floor, 4),
                "shut": name == "shut",
                "rooms": rooms_beside(world.rooms, middle, across, world.walls[wall][3] / 2 + 0.15),
            }
        )
    ceiling = max((room["ceiling_z_m"] for room in rooms), default=0.0)
    return {
        "frame": "map",
        "map_from_world": {"x_m": start[0], "y_m": start[1], "z_m": floor, "heading_rad": heading},
        "storeys": [{"id": "S1", "floor_z_m": 0.0, "ceiling_z_m": ceiling}],
        "rooms": rooms,
        "walls": walls,
        "openings": openings,
        "columns": [{"center_m": at([(x, y)])[0], "width_m": width} for x, y, width in world.columns],
    }


def beside_m(footprint, room, thickness_m):
    """Length of a room's border that runs along a wall."""
    return room.exterior.intersection(footprint.buffer(max(0.03, 0.1 * thickness_m))).length


def footprint_of(vertices, faces):
    """What a body covers, seen from above."""
    corners = np.asarray(vertices)[np.asarray(faces)][:, :, :2]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    flat = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) > 1e-6
    pieces = [Polygon(c).buffer(1e-4) for c in corners[flat]]
    whole = shapely.unary_union(pieces).buffer(-1e-4)
    if whole.geom_type == "MultiPolygon":
        whole = max(whole.geoms, key=lambda piece: piece.area)
    return whole.simplify(1e-3)


def line(a, b):
    return LineString([a, b])
