#!/usr/bin/env python3
"""points.las and points.laz read by laspy against points.ply: as many points, at the same places, with the same planes, in the order of time.

  check_las.py MODEL_FOLDER [--timeless]      --timeless: of a mesh, whose vertices have no time
"""
import argparse
import pathlib

import laspy
import numpy as np

parser = argparse.ArgumentParser()
parser.add_argument("folder", type=pathlib.Path)
parser.add_argument("--timeless", action="store_true")
args = parser.parse_args()

TYPES = {"float": "<f4", "double": "<f8", "int": "<i4"}
bytes_of = (args.folder / "points.ply").read_bytes()
head, _, data = bytes_of.partition(b"end_header\n")
words = [line.split() for line in head.decode().splitlines()]
start = words.index(next(line for line in words if line[:2] == ["element", "vertex"]))
properties = []
for line in words[start + 1:]:
    if line[0] != "property":
        break
    properties.append((line[2], TYPES[line[1]]))
points = np.frombuffer(data, dtype=properties, count=int(words[start][2]))

for name in ("points.las", "points.laz"):
    las = laspy.read(args.folder / name)
    assert len(las.points) == len(points), (len(las.points), len(points))
    assert np.array_equal(las["plane"], points["plane"]), "planes differ"
    away = max(float(np.abs(np.asarray(las[axis]) - points[axis]).max()) for axis in "xyz")
    assert away < 6e-5, f"{name} is up to {away} m off points.ply"
    assert np.array_equal(las.classification == 6, points["plane"] >= 0)
    assert las.header.global_encoding.gps_time_type == laspy.header.GpsTimeType.STANDARD
    if args.timeless:
        assert "scan" not in las.point_format.extra_dimension_names and not np.any(las.gps_time)
        continue
    assert np.array_equal(las["scan"], points["scan"]) and np.array_equal(las["beam"], points["beam"])
    firsts = las.gps_time[np.unique(las["scan"], return_index=True)[1]]
    assert np.all(np.diff(firsts) > 0), "scans are not in the order of time"
    within = las.gps_time - firsts[np.searchsorted(np.unique(las["scan"]), las["scan"])]
    # Beams of several turns interleave, so a scan's first point need not be its earliest.
    assert np.abs(within).max() < 0.06, "a scan is no longer than four turns of the mirror"
print(f"{args.folder}/points.las, .laz: {len(points)} points, {len(np.unique(points['plane']))} planes, "
      f"places within {1000 * away:.3f} mm")
