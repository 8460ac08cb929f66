#!/usr/bin/env python3
"""Worlds of our own plans for `biplane-mock simulate`, each with a drive through its rooms and its truth.

    make_plan_world.py [NAME...] [--set develop|gate] [--plans FILE.toml] [--seed N] -o DIR

Writes DIR/NAME/{world.obj,path.toml,truth.json} as make_ifc_world.py does, for the plans named, or all of a
set.

A plan (plans.toml; meters, floor at z = 0): `outer_m` are the inner faces of the outer wall, counter-
clockwise; `walls` are axes with thickness, x1 y1 x2 y2 t; `arcs` are curved walls, x y radius from to
(degrees) t; `splits` part a room by use, with no wall; `heights_m` are ceilings of the rooms at a place, x y
z. `openings` are kind, wall ("o0" an edge of `outer_m`, "w0" a wall, "a0" an arc), place of the middle along
it, width, height, sill. A door is open, a `shut` one has a leaf, a window a pane unless `glass` is "unseen".
`furniture` are boxes x1 y1 x2 y2 z1 z2, `columns` are square, x y width. The solid is cut into layers between
all heights that occur; its surface is made of the layers' borders and of what differs from one layer to the
next, so it is closed."""

import argparse
import sys
import tomllib
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon, box

sys.path.insert(0, str(Path(__file__).parent))

import truth
from make_ifc_world import write

ROOF_M, LEAF_M, GRID_M = 0.3, 0.04, 1e-6
ARC_STEP_DEG = 3.0


class Wall:
    """A straight or curved wall: what it covers, and boxes through it."""

    def __init__(self, kind, line, thickness, footprint):
        self.kind, self.line, self.thickness, self.footprint = kind, line, thickness, footprint

    def frame(self, along):
        a, b = (np.array(self.line.interpolate(along + d).coords[0]) for d in (-1e-3, 1e-3))
        return (a + b) / 2, (b - a) / np.linalg.norm(b - a)

    def box(self, along, width, inner=-0.5, outer=0.5):
        """A box through the wall, or between two shares of its thickness to the left."""
        middle, u = self.frame(along)
        v = np.array([-u[1], u[0]]) * self.thickness
        corners = [(-1, inner), (1, inner), (1, outer), (-1, outer)]
        return Polygon([middle + s * u * width / 2 + t * v for s, t in corners])

    @property
    def axis(self):
        return self.line.coords[0], self.line.coords[-1]


def outer_walls(ring, thickness):
    whole = Polygon(ring).buffer(thickness, join_style="mitre").difference(Polygon(ring))
    walls = {}
    corners = np.array(ring, float)
    for k, (a, b) in enumerate(zip(corners, np.roll(corners, -1, axis=0))):
        u = (b - a) / np.linalg.norm(b - a)
        out = np.array([u[1], -u[0]]) * thickness
        axis = LineString([a + out / 2, b + out / 2])
        walls[f"o{k}"] = Wall("wall", axis, thickness, Polygon([a, b, b + out, a + out]))
    return walls, whole


def inner_walls(plan, inside):
    """Walls and arcs; ends that lie on another wall's axis reach to that wall's far face."""
    walls, solids = {}, []
    rows = plan.get("walls", [])
    lines = [LineString([(x1, y1), (x2, y2)]) for x1, y1, x2, y2, _ in rows]
    for k, (line, row) in enumerate(zip(lines, rows)):
        a, b = map(np.array, line.coords)
        u = (b - a) / np.linalg.norm(b - a)
        ends = []
        for end, sign in ((a, -1), (b, 1)):
            near = [
                r[4] for other, r in zip(lines, rows) if r is not row and other.distance(Point(end)) < 0.01
            ]
            ends.append(end + sign * u * max(near, default=0.3) / 2)
        solids.append(LineString(ends).buffer(row[4] / 2, cap_style="flat").intersection(inside))
        footprint = line.buffer(row[4] / 2, cap_style="flat").intersection(inside)
        walls[f"w{k}"] = Wall("wall", line, row[4], footprint)
    for k, (x, y, radius, start, end, thickness) in enumerate(plan.get("arcs", [])):
        angles = np.radians(np.linspace(start, end, round((end - start) / ARC_STEP_DEG) + 1))
        line = LineString(np.stack([x + radius * np.cos(angles), y + radius * np.sin(angles)], 1))
        footprint = line.buffer(thickness / 2, cap_style="square", join_style="mitre").intersection(inside)
        walls[f"a{k}"] = Wall("curved", line, thickness, footprint)
        solids.append(footprint)
    return walls, shapely.unary_union(solids)


def rooms_of(plan, inside, solid):
    """Polygons and heights of the rooms, split by use where the plan says so."""
    lines = [LineString([(x1, y1), (x2, y2)]).buffer(1e-5) for x1, y1, x2, y2 in plan.get("splits", [])]
    free = inside.difference(shapely.union_all([solid, *lines]), grid_size=GRID_M)
    pieces = [piece for piece in getattr(free, "geoms", [free]) if piece.area > 0.05]
    pieces.sort(key=lambda piece: (round(piece.centroid.x, 3), round(piece.centroid.y, 3)))
    rooms = []
    for piece in pieces:
        heights = [z for x, y, z in plan.get("heights_m", []) if piece.contains(Point(x, y))]
        rooms.append((piece, (heights or [plan.get("height_m", 2.5)])[0]))
    return rooms


def layers(inside, outline, rooms, boxes, things):
    """Heights, and the solid between each two of them."""
    top = max(height for _, height in rooms) + ROOF_M
    heights = {0.0, top, *(height for _, height in rooms)}
    heights |= {z for _, low, high in boxes + things for z in (low, high)}
    heights = sorted(z for z in heights if 0 <= z <= top)
    solids = []
    for low, high in zip(heights, heights[1:]):
        z = (low + high) / 2
        free = [room.buffer(1e-4, join_style="mitre") for room, height in rooms if height > z]
        free = shapely.union_all(free).buffer(-1e-4, join_style="mitre")
        open_ = shapely.union_all([polygon for polygon, a, b in boxes if a < z < b])
        taken = shapely.union_all([polygon for polygon, a, b in things if a < z < b])
        solid = outline.difference(free.union(open_, grid_size=GRID_M), grid_size=GRID_M)
        solids.append(solid.union(taken.intersection(inside), grid_size=GRID_M))
    return heights, [outline, *solids, Polygon()]


def surface(heights, solids):
    """The border of the layers: upright faces, and level ones where a layer differs from the next."""
    vertices, faces = [], []

    def add(corners):
        faces.append([len(vertices) + k for k in range(3)])
        vertices.extend(corners)

    for k, (low, high) in enumerate(zip(heights, heights[1:])):
        for line in shapely.get_parts(shapely.segmentize(solids[k + 1].boundary, 50.0)):
            for (ax, ay), (bx, by) in zip(line.coords, line.coords[1:]):
                add([(ax, ay, low), (bx, by, low), (bx, by, high)])
                add([(ax, ay, low), (bx, by, high), (ax, ay, high)])
    for z, below, above in zip(heights, solids, solids[1:]):
        level = below.symmetric_difference(above, grid_size=GRID_M)
        for triangle in shapely.get_parts(shapely.constrained_delaunay_triangles(level)):
            if triangle.area > 1e-8:
                add([(x, y, z) for x, y in triangle.exterior.coords[:3]])
    return np.array(vertices), np.array(faces)


def sheet(polygon, low, high):
    """A pane: the middle line of a box, upright."""
    (a, b), _ = truth.strip(polygon)
    corners = np.array([(*a, low), (*b, low), (*b, high), (*a, high)])
    return corners, np.array([(0, 1, 2), (0, 2, 3)])


def build(plan):
    """The world of a plan."""
    inside = Polygon(plan["outer_m"])
    walls, ring = outer_walls(plan["outer_m"], plan["outer_thickness_m"])
    inner, solid = inner_walls(plan, inside)
    walls |= inner
    names = list(walls)
    rooms = rooms_of(plan, inside, solid)
    openings, boxes, ways, panes, leaves = [], [], [], [], []
    for kind, name, along, width, height, *sill in plan["openings"]:
        wall, low = walls[name], sill[0] if sill else 0.0
        # A curved wall bulges out of a straight box.
        reach = 0.8 if wall.kind == "curved" else 0.5
        hole = wall.box(along, width, -reach, reach)
        boxes.append((hole, low, low + height))
        front = wall.box(along, width, -0.7, 0.7).buffer(-0.01)
        if blocked := [
            other for other, w in walls.items() if other != name and w.footprint.intersects(front)
        ]:
            sys.exit(f"opening {kind} at {along} of {name} meets {', '.join(blocked)}")
        shown = {"shut": "door"}.get(kind, kind)
        openings.append((kind, shown, names.index(name), wall.box(along, width), low, low + height))
        if kind in ("door", "passage"):
            ways.append(hole)
        elif kind == "shut":
            leaves.append(
                (
                    wall.box(along, width, -LEAF_M / wall.thickness / 2, LEAF_M / wall.thickness / 2),
                    low,
                    low + height,
                )
            )
        elif plan.get("glass") != "unseen":
            panes.append(sheet(wall.box(along, width, -0.25, -0.1), low, low + height))
    things = [(box(x1, y1, x2, y2), low, high) for x1, y1, x2, y2, low, high in plan.get("furniture", [])]
    columns = [
        (x, y, w, max(h for r, h in rooms if r.intersects(Point(x, y).buffer(w))))
        for x, y, w in plan.get("columns", [])
    ]
    things += [(box(x - w / 2, y - w / 2, x + w / 2, y + w / 2), 0.0, height) for x, y, w, height in columns]
    outline = inside.union(ring).buffer(0)
    objects = [("IfcBuilding_plan", *surface(*layers(inside, outline, rooms, boxes, things + leaves)))]
    objects += [(f"IfcWindow_{k}", *pane) for k, pane in enumerate(panes)]
    top = max(height for _, height in rooms)
    listed = [(name, w.footprint, w.axis, w.thickness, top, w.kind) for name, w in walls.items()]
    named = [(f"room {k + 1}", room, height) for k, (room, height) in enumerate(rooms)]
    world = truth.World(objects, 0.0, named, listed, openings, [], ways)
    world.columns = [(x, y, w) for x, y, w, _ in columns]
    return world


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*")
    parser.add_argument("--set", choices=["develop", "gate"])
    parser.add_argument("--plans", type=Path, default=Path(__file__).with_name("plans.toml"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", type=Path, required=True)
    options = parser.parse_args()
    plans = tomllib.loads(options.plans.read_text())
    for name, plan in plans.items():
        if name in options.names or (not options.names and options.set in (None, plan["set"])):
            write(build(plan), options.output / name, options.seed)


if __name__ == "__main__":
    main()
