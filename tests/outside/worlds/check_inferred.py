#!/usr/bin/env python3
"""Is what a model infers there in the world that was driven through?

    check_inferred.py [--wrong SHARE] [--within M] MODEL[=TRUTH.ply]...

MODEL is a folder of `biplane build`, TRUTH.ply the true surfaces that `biplane-mock simulate` wrote, by
default truth/surfaces.ply beside MODEL, as check_buildings.py --work has it. On the inferred surfaces of
model.json places are looked at every 5 cm: one is wrong that is farther than --within (0.05) from every true
surface of its kind, level for floors and upright for walls. A line for each model, with areas in square
meters and the share that is wrong, and the share of all models. Exit code 1 when
that is larger than --wrong (0.02). Needs numpy, shapely."""

import argparse
import json
import sys
from pathlib import Path

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import ply
from lib.verdict import fail, require

STEP_M = 0.05
# Normals closer to the vertical than this cosine are those of level surfaces.
LEVEL_COSINE = 0.9
# What may be inferred, and its column.
KINDS = {"floor": "floor", "wall_base": "base", "opening_surround": "surround"}
# Places at a time: a matrix of places by triangles.
SLICE = 400


def places_on(surface):
    """Places on an inferred surface, each for a square of STEP_M; less for one that is smaller."""
    normal = np.array(surface["normal"])
    level = np.array([-normal[1], normal[0], 0.0])
    u = level / np.linalg.norm(level) if np.linalg.norm(level) > 0.1 else np.array([1.0, 0.0, 0.0])
    v = np.cross(normal, u)
    flat = [np.array(ring) @ np.array([u, v]).T for ring in [surface["outer_m"], *surface["holes_m"]]]
    area = shapely.Polygon(flat[0], flat[1:])
    require(area.is_valid, f"an inferred surface of {surface['part_of']} is not valid")
    low, high = flat[0].min(axis=0), flat[0].max(axis=0)
    steps = [
        np.arange(a + STEP_M / 2, b, STEP_M) if b - a > STEP_M else [(a + b) / 2] for a, b in zip(low, high)
    ]
    at = np.stack(np.meshgrid(*steps), -1).reshape(-1, 2)
    at = at[shapely.contains_xy(area, at[:, 0], at[:, 1])]
    return at @ np.array([u, v]) + surface["offset_m"] * normal, area.area


def distances(places, corners):
    """From each place to the nearest of some triangles (Ericson 2004, 5.1.5, for all at once)."""
    best = np.full(len(places), np.inf)
    if len(corners) == 0:
        return best
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    ab, ac = b - a, c - a
    normal = np.cross(ab, ac)
    keep = np.linalg.norm(normal, axis=1) > 1e-12
    a, b, c, ab, ac, normal = (x[keep] for x in (a, b, c, ab, ac, normal))
    unit = normal / np.linalg.norm(normal, axis=1)[:, None]
    for first in range(0, len(places), SLICE):
        p = places[first : first + SLICE, None]
        off = ((p - a) * unit).sum(-1)
        foot = p - off[..., None] * unit
        inside = np.ones(off.shape, bool)
        edge = np.full(off.shape, np.inf)
        for start, end in ((a, b), (b, c), (c, a)):
            way = end - start
            inside &= (np.cross(way, foot - start) * unit).sum(-1) >= 0
            share = np.clip(((p - start) * way).sum(-1) / (way * way).sum(-1), 0, 1)
            edge = np.minimum(edge, np.linalg.norm(p - start - share[..., None] * way, axis=-1))
        best[first : first + SLICE] = np.where(inside, abs(off), edge).min(axis=1)
    return best


def judge(model, truth, within_m):
    """Areas of floors, wall bases and surrounds of openings of a model, and how much of each is wrong."""
    file = json.loads((model / "model.json").read_text())
    require(file["shift_m"] == [0, 0, 0], f"{model} is far from zero")
    corners = ply.triangles(truth)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    is_level = abs(normals[:, 2]) > LEVEL_COSINE * np.linalg.norm(normals, axis=1)
    sums = {kind: np.zeros(2) for kind in KINDS}
    for surface in file["model"].get("inferred", []):
        places, area_m2 = places_on(surface)
        if len(places) == 0:
            continue
        alike = corners[is_level == (surface["kind"] == "floor")]
        low, high = places.min(axis=0) - within_m, places.max(axis=0) + within_m
        near = (alike.max(axis=1) >= low).all(axis=1) & (alike.min(axis=1) <= high).all(axis=1)
        wrong = distances(places, alike[near]) > within_m
        sums[surface["kind"]] += [area_m2, area_m2 * wrong.mean()]
    return sums


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pairs", nargs="+", metavar="MODEL[=TRUTH.ply]")
    parser.add_argument("--wrong", type=float, default=0.02)
    parser.add_argument("--within", type=float, default=0.05)
    options = parser.parse_args()
    whole = {}
    print(f"{'':<30}" + "".join(f"{name:>9}{'wrong':>9}" for name in KINDS.values()))
    for pair in options.pairs:
        model, _, truth = pair.partition("=")
        model = Path(model)
        truth = Path(truth) if truth else model.parent / "truth/surfaces.ply"
        sums = judge(model, truth, options.within)
        for kind, values in sums.items():
            whole[kind] = whole.get(kind, 0) + values
        line(str(model)[-29:], sums)
    line("all", whole)
    area, wrong = sum(whole.values())
    require(area > 0, "nothing is inferred")
    if wrong > options.wrong * area:
        fail(f"{wrong / area:.4f} of what is inferred is wrong, expected {options.wrong} at most")


def line(name, sums):
    cells = (f"{area:>9.2f}{wrong / area if area else 0:>9.4f}" for area, wrong in sums.values())
    print(f"{name:<30}" + "".join(cells), flush=True)


if __name__ == "__main__":
    main()
