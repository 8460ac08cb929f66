#!/usr/bin/env python3
"""Does `biplane-mock simulate --world FILE.ifc` drive through the building that the file describes?

    check_ifc_world.py FILE.ifc [--storey N] [--work DIR]

Needs `biplane-mock` on PATH, ifcopenshell, numpy, scipy and shapely. The judge is ifcopenshell's kernel: it
makes bodies of the same elements. Points all over the surfaces of either must lie on the other's, the
surfaces must be as large, and the truth must state the same rooms, walls and openings, wherever the drive
starts. Exit code 1 and a sentence when not."""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parent))

import truth
from make_ifc_world import read as read_world

from lib.ply import read, xyz
from lib.programs import run
from lib.verdict import Tally, require

# Distance of the points on surfaces, how near each must have one of the other's, and how many may not: thin
# slivers are cut differently.
SAMPLE_M, NEAR_M, ODD_SHARE = 0.04, 0.05, 0.002
SAME_M, SAME_AREA = 0.002, 0.005


def samples(triangles):
    """Points on triangles, and the area of all."""
    sides = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=2).max(axis=1)
    points = []
    for (a, b, c), side in zip(triangles, sides):
        steps = int(np.ceil(side / SAMPLE_M))
        i, j = np.meshgrid(np.arange(steps + 1) / steps, np.arange(steps + 1) / steps)
        keep = i + j <= 1 + 1e-9
        points.append(a + i[keep][:, None] * (b - a) + j[keep][:, None] * (c - a))
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.concatenate(points), np.linalg.norm(normals, axis=1).sum() / 2


def same(own, other, keys, tolerance):
    """Whether things of two lists are the same, in whatever order: by the numbers under these keys."""

    def numbers(thing):
        return np.array([thing[key] for key in keys])

    own, other = (sorted(map(numbers, things), key=tuple) for things in (own, other))
    return len(own) == len(other) and all(np.abs(a - b).max() <= tolerance for a, b in zip(own, other))


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("file", type=Path)
    parser.add_argument("--storey", type=int, default=0)
    parser.add_argument("--work", type=Path)
    options = parser.parse_args()
    work = options.work or Path(tempfile.mkdtemp(prefix="ifc-world-"))
    tally = Tally()
    words = ["--world", options.file, "--storey", options.storey, "--doors", "open", "--force"]
    run("biplane-mock", "simulate", *words, "-o", work / "bytes.mcap", "--truth", work / "truth")
    own_truth = json.loads((work / "truth/truth.json").read_text())
    world = read_world(options.file, options.storey, True)

    surfaces = read(work / "truth/surfaces.ply")
    corners = next(name for name in surfaces["face"].dtype.names if name.startswith("vertex_ind"))
    own = xyz(surfaces["vertex"])[surfaces["face"][corners]]
    # The frame of the truth is where the drive starts: its largest room is laid on the file's.
    objects = [body for body in world.objects if not body[0].startswith("IfcDoor")]
    other = np.concatenate([vertices[faces] for _, vertices, faces in objects])
    other = other - [0, 0, world.floor_z_m]
    rooms = [(room["area_m2"], np.array(room["outline_m"])) for room in own_truth["rooms"]]
    motion = rigid(rooms, [(room[1].area, np.array(room[1].exterior.coords)[:-1]) for room in world.rooms])
    flat = other[..., :2] @ motion[0].T + motion[1]
    other = np.concatenate([flat, other[..., 2:]], axis=2)

    (own_points, own_area), (other_points, other_area) = samples(own), samples(other)
    require(
        abs(own_area / other_area - 1) < SAME_AREA,
        f"surfaces of {own_area:.1f} m2, ifcopenshell's have {other_area:.1f} m2",
    )
    tally.ok(
        f"{len(objects)} elements, {own_area:.1f} m2 of surface; ifcopenshell's have {other_area:.1f} m2"
    )
    for name, points, tree in (
        ("own", own_points, other_points),
        ("ifcopenshell's", other_points, own_points),
    ):
        apart, _ = cKDTree(tree).query(points)
        odd = (apart > NEAR_M).mean()
        require(odd <= ODD_SHARE, f"{100 * odd:.2f} % of {name} surfaces lie up to {apart.max():.2f} m away")
        tally.ok(f"{name} surfaces lie on the other's but for {100 * odd:.3f} %")

    expected = truth.truth_json(world, [[0, 0], [1, 0]], [])
    keys = {
        "rooms": ["area_m2", "ceiling_z_m"],
        "walls": ["thickness_m", "height_m"],
        "openings": ["width_m", "height_m", "sill_m"],
    }
    for what, names in keys.items():
        tolerance = 0.03 if what == "rooms" else SAME_M
        # Where a glazed front ends above is a matter of what counts as a part of it.
        found, wanted = (
            [thing for thing in those[what] if thing.get("kind") != "curtain"]
            for those in (own_truth, expected)
        )
        require(
            same(found, wanted, names, tolerance),
            f"{what} differ: {[[thing[key] for key in names] for thing in found]} and "
            f"{[[thing[key] for key in names] for thing in wanted]}",
        )
        tally.ok(f"{len(wanted)} {what} as ifcopenshell's bodies have them")
    tally.end()


def rigid(own, other):
    """The motion of the plane that lays the other's largest room on the own one of that area."""
    area, ring = max(other, key=lambda room: room[0])
    _, target = min(own, key=lambda room: abs(room[0] - area))
    require(len(ring) == len(target), f"the largest room has {len(target)} corners, not {len(ring)}")
    best = None
    for shift in range(len(ring)):
        for turned in (ring, ring[::-1]):
            moved = np.roll(turned, shift, axis=0)
            a, b = moved - moved.mean(axis=0), target - target.mean(axis=0)
            u, _, v = np.linalg.svd(a.T @ b)
            rotation = (u @ np.diag([1, np.sign(np.linalg.det(u @ v))]) @ v).T
            off = target.mean(axis=0) - rotation @ moved.mean(axis=0)
            error = np.abs(moved @ rotation.T + off - target).max()
            if best is None or error < best[0]:
                best = (error, rotation, off)
    require(best[0] < 0.01, f"the largest room's corners are {best[0]:.3f} m off")
    return best[1:]


if __name__ == "__main__":
    main()
