#!/usr/bin/env python3
"""The figures of a build against targets:  check_figures.py MODEL COMPARE.json [--least-reduction PERCENT] ...

MODEL is a folder of `biplane build`, COMPARE.json what `biplane compare MODEL --json` says of it. Distances are those of the whole model
to the truth, or with no truth to the raw points."""
import argparse
import json
import pathlib

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("model", type=pathlib.Path)
parser.add_argument("compare", type=pathlib.Path)
parser.add_argument("--least-reduction", type=float, metavar="PERCENT", default=0.0)
parser.add_argument("--largest-rms-m", type=float, metavar="METRES", default=float("inf"))
parser.add_argument("--most-polygons-a-face", type=float, metavar="N", default=float("inf"), help="polygons for each face of the truth that was seen")
parser.add_argument("--least-gain", type=float, metavar="FACTOR", default=0.0, help="how many times farther off the truth simplification by others is")
parser.add_argument("--most-blocked", type=float, metavar="PERCENT", default=100.0, help="rays that the model stops before what they hit")
args = parser.parse_args()
summary, compare = json.loads((args.model / "summary.json").read_text()), json.loads(args.compare.read_text())
for key in ("raw_points", "raw_triangles", "planes", "polygons", "holes", "leftover_triangles"):
    assert isinstance(summary[key], int), (key, summary[key])
after = summary["polygons"] + summary["leftover_triangles"]
reduction = 100 * (1 - after / summary["raw_triangles"])
assert abs(reduction - summary["reduction_percent"]) < 0.01, (reduction, summary["reduction_percent"])
model, qslim = compare["model"], compare["qslim"]
# The simplification ends a little above what it is asked for where nothing more can go.
assert model["polygons"] == summary["polygons"] and qslim["surfaces"] <= 1.2 * after + 10, (model["polygons"], qslim["surfaces"], after)
rms_m, gain = model["to_truth"]["rms_m"], qslim["to_truth"]["rms_m"] / model["to_truth"]["rms_m"]
a_face = summary["polygons"] / compare["true_faces_seen"] if compare["true_faces_seen"] else 0.0
blocked = model["rays"]["percent"]
print(f"{summary['raw_points']} points, {summary['raw_triangles']} triangles -> {summary['polygons']} polygons with {summary['holes']} holes "
      f"+ {summary['leftover_triangles']} triangles: {reduction:.1f} % fewer, {100 * rms_m:.2f} cm RMS to {compare['reference']} (simplified by others "
      f"{gain:.1f} times as far), {a_face:.1f} polygons a face seen, {blocked:.2f} % of the rays blocked")
assert reduction >= args.least_reduction, f"less than {args.least_reduction} % fewer surfaces"
assert rms_m < args.largest_rms_m, f"not within {args.largest_rms_m} m of the truth"
assert a_face <= args.most_polygons_a_face, f"more than {args.most_polygons_a_face} polygons a face"
assert gain >= args.least_gain, f"simplification by others is less than {args.least_gain} times as far off"
assert blocked < args.most_blocked, f"not less than {args.most_blocked} % of the rays blocked"
