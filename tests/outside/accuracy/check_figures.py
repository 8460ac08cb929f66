#!/usr/bin/env python3
"""Holds the figures of a build against targets.

    check_figures.py MODEL COMPARE.json [--least-reduction PERCENT] ...

MODEL is a folder of `biplane build`, COMPARE.json what `biplane compare MODEL --json` says of it. Distances
are those of the whole model to the truth, or with no truth to the raw points."""

import argparse
import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.verdict import require

COUNTS = ("raw_points", "raw_triangles", "planes", "polygons", "holes", "leftover_triangles")


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", type=Path)
    parser.add_argument("compare", type=Path)
    parser.add_argument("--least-reduction", type=float, metavar="PERCENT", default=0.0)
    parser.add_argument("--largest-rms-m", type=float, metavar="METERS", default=float("inf"))
    parser.add_argument(
        "--most-polygons-a-face",
        type=float,
        metavar="N",
        default=float("inf"),
        help="polygons for each face of the truth that was seen",
    )
    parser.add_argument(
        "--least-gain",
        type=float,
        metavar="FACTOR",
        default=0.0,
        help="how many times farther off the truth simplification by others is",
    )
    parser.add_argument(
        "--most-blocked",
        type=float,
        metavar="PERCENT",
        default=100.0,
        help="rays that the model stops before what they hit",
    )
    return parser.parse_args()


def reduction_of(summary):
    """Percent fewer surfaces, counted again from the counts, which are to be there."""
    for key in COUNTS:
        require(isinstance(summary[key], int), f"{key} in summary.json is {summary[key]}")
    after = summary["polygons"] + summary["leftover_triangles"]
    percent = 100 * (1 - after / summary["raw_triangles"])
    told = summary["reduction_percent"]
    require(abs(percent - told) < 0.01, f"{percent} % fewer surfaces, summary.json has {told}")
    return percent, after


def main():
    args = arguments()
    summary, compare = (json.loads(path.read_text()) for path in (args.model / "summary.json", args.compare))
    reduction, after = reduction_of(summary)
    model, qslim = compare["model"], compare["qslim"]
    require(
        model["polygons"] == summary["polygons"],
        f"{model['polygons']} polygons compared, {summary['polygons']} made",
    )
    # The simplification ends a little above what it is asked for where nothing more can go.
    require(
        qslim["surfaces"] <= 1.2 * after + 10,
        f"simplification by others left {qslim['surfaces']}, asked for {after}",
    )
    rms_m, gain = model["to_truth"]["rms_m"], qslim["to_truth"]["rms_m"] / model["to_truth"]["rms_m"]
    a_face = summary["polygons"] / compare["true_faces_seen"] if compare["true_faces_seen"] else 0.0
    blocked = model["rays"]["percent"]
    print(
        f"{summary['raw_points']} points, {summary['raw_triangles']} triangles -> "
        f"{summary['polygons']} polygons with {summary['holes']} holes "
        f"+ {summary['leftover_triangles']} triangles: {reduction:.1f} % fewer, "
        f"{100 * rms_m:.2f} cm RMS to {compare['reference']} (simplified by others {gain:.1f} times as far), "
        f"{a_face:.1f} polygons a face seen, {blocked:.2f} % of the rays blocked"
    )
    require(reduction >= args.least_reduction, f"less than {args.least_reduction} % fewer surfaces")
    require(rms_m < args.largest_rms_m, f"not within {args.largest_rms_m} m of the truth")
    require(a_face <= args.most_polygons_a_face, f"more than {args.most_polygons_a_face} polygons a face")
    require(
        gain >= args.least_gain, f"simplification by others is less than {args.least_gain} times as far off"
    )
    require(blocked < args.most_blocked, f"not less than {args.most_blocked} % of the rays blocked")


main()
