#!/usr/bin/env python3
"""Do the flat surfaces of a build face the sensor that saw them?  check_facing.py MODEL [--most-away PERCENT]

For each triangle of planes.ply the points of points.ply nearest to it that lie on its plane: were they seen from the side that its
normal points to? Judged by area; a wall that was seen from both sides can face only one. Needs numpy, scipy."""
import argparse
import pathlib

import numpy as np
from scipy.spatial import cKDTree

NEAREST, REACH_M, SAMPLES = 8, 0.5, 20_000
TYPES = {"float": "<f4", "double": "<f8", "int": "<i4", "uint": "<u4", "uchar": "u1"}


def read(path):
    """The elements of a binary PLY whose lists are triangles, each as an array with a field a property."""
    with open(path, "rb") as file:
        elements, line = [], []
        while line != ["end_header"]:
            line = file.readline().decode().split()
            if line[0] == "element":
                elements.append((line[1], int(line[2]), []))
            elif line[:2] == ["property", "list"]:
                elements[-1][2].extend([("corners", "u1"), (line[-1], TYPES[line[3]], 3)])
            elif line[0] == "property":
                elements[-1][2].append((line[2], TYPES[line[1]]))
        return {name: np.frombuffer(file.read(count * np.dtype(fields).itemsize), fields, count) for name, count, fields in elements}


def xyz(rows):
    return np.stack([rows[axis].astype(float) for axis in "xyz"], axis=1)


parser = argparse.ArgumentParser()
parser.add_argument("model", type=pathlib.Path)
parser.add_argument("--most-away", type=float, default=1.0, metavar="PERCENT")
args = parser.parse_args()
cloud, planes = read(args.model / "points.ply"), read(args.model / "planes.ply")
points, origins = xyz(cloud["vertex"]), xyz(cloud["scan"])[cloud["vertex"]["scan"]]
corners = xyz(planes["vertex"])[planes["face"]["vertex_indices"]]
normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
areas = np.linalg.norm(normals, axis=1) / 2
rng = np.random.default_rng(1)
chosen = rng.choice(len(areas), SAMPLES, p=areas / areas.sum())
shares = rng.dirichlet([1, 1, 1], SAMPLES)
places = np.einsum("sk,skx->sx", shares, corners[chosen])
towards = away = 0
for plane in np.unique(planes["face"]["plane"]):
    own = np.flatnonzero(cloud["vertex"]["plane"] == plane)
    samples = np.flatnonzero(planes["face"]["plane"][chosen] == plane)
    if len(own) == 0 or len(samples) == 0:
        continue
    far, near = cKDTree(points[own]).query(places[samples], k=min(NEAREST, len(own)))
    far, near = far.reshape(len(samples), -1), near.reshape(len(samples), -1)
    seen_from = origins[own[near]] - places[samples][:, None]
    sides = np.where(far < REACH_M, np.sign(np.einsum("snx,sx->sn", seen_from, normals[chosen[samples]])), 0).sum(axis=1)
    towards, away = towards + int((sides > 0).sum()), away + int((sides < 0).sum())
percent = 100 * away / (towards + away)
print(f"{args.model}: {percent:.2f} % of the surface faces away from the sensor ({towards + away} of {SAMPLES} samples have points of their plane near by)")
assert towards + away > SAMPLES / 2, "hardly any sample has points near by"
assert percent <= args.most_away, f"more than {args.most_away} %"
