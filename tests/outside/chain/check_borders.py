#!/usr/bin/env python3
"""Are the borders of a model's polygons straight, and its openings rectangles?

    check_borders.py MODEL... [--spikes N] [--ratio R] [--small PERCENT] [--corners N] [--openings PERCENT]
                     [--holes PERCENT] [--json]

Reads model.json and building.json of each folder; needs numpy and shapely, which is the judge. For each
model: *spikes*, corners that turn by more than 120 degrees, per 100 m of border; *ratio*, the length of all
borders over their length simplified within 10 cm; *small*, polygons under 0.05 m2, percent; *over 30*,
polygons with more corners; *thin*, polygons that no disc of 5 cm fits into; *openings*, how many of the doors
and windows of building.json are rectangles in the faces of their wall: what the polygons of a face leave open
there fills 97 % of its rectangle; *holes*, how many holes of upright polygons, 50 cm wide and high, do, which
are windows where a building is seen from outside. What the model infers around openings is part of the faces
there, and counts nowhere else. The bounds hold for every model. Exit code 1 when one is
missed."""

import argparse
import json
import sys
from pathlib import Path

from shapely import box
from shapely.geometry import LinearRing, Point, Polygon
from shapely.ops import unary_union

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import np
from lib.verdict import fail

SPIKE_DEG, SIMPLIFIED_M, SMALL_M2, CORNERS, THIN_M = 120, 0.10, 0.05, 30, 0.05
# A hole is a window's when it is at least this wide and high.
WINDOW_M, UPRIGHT = 0.5, 0.1
# A face is one of a wall when it lies this near to its side and looks away from its middle. What is open is
# looked for this far around an opening.
BESIDE_M, ALONG, AROUND_M, FILLED = 0.04, 0.99, 0.25, 0.97
# What is left open between two faces that touch is narrower than this.
HAIR_M = 0.002
# The lower border of what was seen of a wall is this ragged.
UNSEEN_M = 0.10
# A face of which less than this share lies around an opening says nothing of it.
LEAST_WALL = 0.2


def frame(normal):
    """Two directions in a plane: level where it allows that, and up."""
    level = np.array([-normal[1], normal[0], 0.0])
    level = np.array([1.0, 0, 0]) - normal[0] * normal if np.linalg.norm(level) < 0.1 else level
    level /= np.linalg.norm(level)
    return np.array([level, np.cross(normal, level)])


class Face:
    """One polygon in the coordinates of its plane."""

    def __init__(self, polygon, plane):
        self.normal, self.offset_m = np.array(plane["normal"]), plane["offset_m"]
        self.axes = frame(self.normal)
        rings = [np.array(ring) @ self.axes.T for ring in (polygon["outer_m"], *polygon["holes_m"])]
        self.rings = [ring for ring in rings if len(ring) >= 3]
        self.shape = Polygon(self.rings[0], self.rings[1:])


def spikes(ring):
    """Corners at which the way turns by more than 120 degrees."""
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    cosine = (before * after).sum(axis=1) / (np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1))
    return int((cosine < np.cos(np.radians(SPIKE_DEG))).sum())


def left_open(opening, wall, faces, inferred, side):
    """What the faces on one side of a wall leave open at an opening; None where those that were seen say
    nothing."""
    (ax, ay), (bx, by) = wall["axis_m"]
    along = np.array([bx - ax, by - ay, 0.0]) / np.hypot(bx - ax, by - ay)
    normal = side * np.array([along[1], -along[0], 0.0])
    center = np.array(opening["center_m"])
    half, high = opening["width_m"] / 2, opening["height_m"] / 2
    floor_m = center[2] - high - opening["sill_m"]

    def is_of_wall(face):
        away_m = face.offset_m - face.normal @ center - wall["drawn_thickness_m"] / 2
        return face.normal @ normal > ALONG and abs(away_m) <= BESIDE_M

    near = [face for face in faces if is_of_wall(face)]
    if not near:
        return None
    x, z = near[0].axes @ center
    reach_x, reach_z = half + AROUND_M, high + AROUND_M
    around = box(x - reach_x, max(z - reach_z, floor_m), x + reach_x, z + reach_z)
    whole = unary_union([face.shape for face in near])
    # The lasers see no wall under 0.45 m.
    around = around.intersection(box(x - reach_x, whole.bounds[1] + UNSEEN_M, x + reach_x, z + reach_z))
    covered = whole.intersection(around)
    if not covered.area or covered.area < LEAST_WALL * (around.area - 4 * half * high):
        return None
    covered = unary_union(
        [covered, *(face.shape.intersection(around) for face in inferred if is_of_wall(face))]
    )
    left = around.difference(covered)
    left = left.buffer(-HAIR_M / 2, join_style="mitre").buffer(HAIR_M / 2, join_style="mitre")
    pieces = [piece for piece in getattr(left, "geoms", [left]) if piece.contains(Point(x, z))]
    return pieces[0] if pieces else Polygon()


def is_rectangle(shape):
    """Whether a shape fills its upright rectangle."""
    if shape.is_empty:
        return False
    x0, y0, x1, y1 = shape.bounds
    return shape.area >= FILLED * (x1 - x0) * (y1 - y0)


def windows(faces):
    """The holes of upright faces that are as large as a window."""
    upright = (face for face in faces if abs(face.normal[2]) < UPRIGHT)
    holes = (ring for face in upright for ring in face.rings[1:])
    return [Polygon(hole) for hole in holes if (np.ptp(hole, axis=0) >= WINDOW_M).all()]


def measure(folder):
    """The figures of one model."""
    model = json.loads((folder / "model.json").read_text())["model"]
    faces = [Face(polygon, model["planes"][polygon["plane"]]) for polygon in model["polygons"]]
    rings = [ring for face in faces for ring in face.rings]
    length_m = sum(LinearRing(ring).length for ring in rings)
    simplified_m = sum(LinearRing(ring).simplify(SIMPLIFIED_M).length for ring in rings)
    building = json.loads((folder / "building.json").read_text())
    walls = {wall["id"]: wall for wall in building["walls"]}
    inferred = [Face(one, one) for one in model.get("inferred", []) if one["kind"] == "opening_surround"]
    sides = [(opening, side) for opening in building["openings"] for side in (1, -1)]
    shapes = [left_open(opening, walls[opening["wall"]], faces, inferred, side) for opening, side in sides]
    verdicts = [is_rectangle(shape) for shape in shapes if shape is not None]
    holes = [is_rectangle(hole) for hole in windows(faces)]
    return {
        "polygons": len(faces),
        "border_m": length_m,
        "spikes": 100 * sum(map(spikes, rings)) / max(length_m, 1e-9),
        "ratio": length_m / max(simplified_m, 1e-9),
        "small": 100 * np.mean([face.shape.area < SMALL_M2 for face in faces]),
        "corners": sum(sum(map(len, face.rings)) > CORNERS for face in faces),
        "thin": sum(face.shape.buffer(-THIN_M / 2).is_empty for face in faces),
        "openings": 100 * float(np.mean(verdicts)) if verdicts else None,
        "sides": len(verdicts),
        "holes": 100 * float(np.mean(holes)) if holes else None,
    }


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="+", type=Path, metavar="MODEL")
    parser.add_argument("--json", action="store_true")
    bounds = {"spikes": 1, "ratio": 1, "small": 1, "corners": 1, "openings": -1, "holes": -1}
    for name in bounds:
        parser.add_argument(f"--{name}", type=float)
    options = parser.parse_args()
    figures = {str(folder): measure(folder) for folder in options.models}
    if options.json:
        print(json.dumps(figures, indent=1))
    for folder, found in figures.items():
        if not options.json:
            rows = (
                f"{name} {'-' if value is None else format(value, '.4g')}" for name, value in found.items()
            )
            print(f"{folder}: {', '.join(rows)}")
        for name, sign in bounds.items():
            bound, value = getattr(options, name), found[name]
            if bound is not None and value is not None and sign * value > sign * bound:
                fail(f"{folder}: {name} {value:.4g}, expected {bound:g} or better")


if __name__ == "__main__":
    main()
