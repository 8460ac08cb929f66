#!/usr/bin/env python3
"""Do the flat surfaces of a build face the sensor that saw them?

    check_facing.py MODEL [--most-away PERCENT]

For each triangle of planes.ply the points of points.ply nearest to it that lie on its plane: were they seen
from the side that its normal points to? Judged by area; a wall that was seen from both sides can face only
one. Needs numpy, scipy."""

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import ply
from lib.verdict import require

NEAREST, REACH_M, SAMPLES = 8, 0.5, 20_000


def sampled(planes):
    """Places by chance on all triangles, their unit-less normals and their planes."""
    corners = ply.xyz(planes["vertex"])[planes["face"]["vertex_indices"]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2
    rng = np.random.default_rng(1)
    chosen = rng.choice(len(areas), SAMPLES, p=areas / areas.sum())
    shares = rng.dirichlet([1, 1, 1], SAMPLES)
    places = np.einsum("sk,skx->sx", shares, corners[chosen])
    return places, normals[chosen], planes["face"]["plane"][chosen]


def facing(model):
    """How many samples face the sensor, and how many face away."""
    cloud, planes = ply.read(model / "points.ply"), ply.read(model / "planes.ply")
    points, origins = ply.xyz(cloud["vertex"]), ply.xyz(cloud["scan"])[cloud["vertex"]["scan"]]
    places, normals, plane_of = sampled(planes)
    towards = away = 0
    for plane in np.unique(planes["face"]["plane"]):
        own = np.flatnonzero(cloud["vertex"]["plane"] == plane)
        samples = np.flatnonzero(plane_of == plane)
        if len(own) == 0 or len(samples) == 0:
            continue
        far, near = cKDTree(points[own]).query(places[samples], k=min(NEAREST, len(own)))
        far, near = far.reshape(len(samples), -1), near.reshape(len(samples), -1)
        seen_from = origins[own[near]] - places[samples][:, None]
        votes = np.sign(np.einsum("snx,sx->sn", seen_from, normals[samples]))
        sides = np.where(far < REACH_M, votes, 0).sum(axis=1)
        towards, away = towards + int((sides > 0).sum()), away + int((sides < 0).sum())
    return towards, away


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", type=Path)
    parser.add_argument("--most-away", type=float, default=1.0, metavar="PERCENT")
    args = parser.parse_args()
    towards, away = facing(args.model)
    judged = towards + away
    percent = 100 * away / judged
    print(
        f"{args.model}: {percent:.2f} % of the surface faces away from the sensor "
        f"({judged} of {SAMPLES} samples have points of their plane near by)"
    )
    require(judged > SAMPLES / 2, "hardly any sample has points near by")
    require(percent <= args.most_away, f"more than {args.most_away} % of the surface faces away")


main()
