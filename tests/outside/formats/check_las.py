#!/usr/bin/env python3
"""Reads points.las and points.laz with laspy and holds them against points.ply: as many points, at the same
places, with the same planes, in the order of time.

    check_las.py MODEL_FOLDER [--timeless]      --timeless: of a mesh, whose vertices have no time

Needs laspy with lazrs, numpy."""

import argparse
import sys
from pathlib import Path

import laspy
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import ply
from lib.verdict import require

# Coordinates are whole multiples of 0.1 mm.
PLACES_WITHIN_M = 6e-5
# Beams of several turns interleave, so a scan's first point need not be its earliest; a scan takes four turns
# of the mirror at most.
LONGEST_SCAN_S = 0.06
BUILDING = 6


def check_points(name, las, points):
    """Number, planes, places and classes; returns how far the places are off, in meters."""
    require(len(las.points) == len(points), f"{name} has {len(las.points)} points, points.ply {len(points)}")
    require(np.array_equal(las["plane"], points["plane"]), f"{name} has other planes than points.ply")
    away_m = max(float(np.abs(np.asarray(las[axis]) - points[axis]).max()) for axis in "xyz")
    require(away_m < PLACES_WITHIN_M, f"{name} is up to {away_m} m off points.ply")
    is_building = las.classification == BUILDING
    require(
        np.array_equal(is_building, points["plane"] >= 0),
        f"{name}: the class building is not for points of planes",
    )
    return away_m


def check_times(name, las, points):
    """Scans and beams are those of points.ply, in the order of time."""
    for field in ("scan", "beam"):
        require(np.array_equal(las[field], points[field]), f"{name}: {field} is not as in points.ply")
    scans, starts = np.unique(las["scan"], return_index=True)
    firsts = las.gps_time[starts]
    require(np.all(np.diff(firsts) > 0), f"{name}: scans are not in the order of time")
    within_s = las.gps_time - firsts[np.searchsorted(scans, las["scan"])]
    require(
        np.abs(within_s).max() < LONGEST_SCAN_S, f"{name}: a scan is longer than four turns of the mirror"
    )


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--timeless", action="store_true")
    args = parser.parse_args()
    points = ply.vertices(args.folder / "points.ply")
    away_m = 0.0
    for name in ("points.las", "points.laz"):
        las = laspy.read(args.folder / name)
        away_m = check_points(name, las, points)
        kind = las.header.global_encoding.gps_time_type
        require(kind == laspy.header.GpsTimeType.STANDARD, f"{name}: its times are {kind}")
        if args.timeless:
            has_scans = "scan" in las.point_format.extra_dimension_names
            require(not has_scans and not np.any(las.gps_time), f"{name}: points of a mesh have a time")
        else:
            check_times(name, las, points)
    print(
        f"{args.folder}/points.las, .laz: {len(points)} points, {len(np.unique(points['plane']))} planes, "
        f"places within {1000 * away_m:.3f} mm"
    )


main()
