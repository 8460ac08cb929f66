#!/usr/bin/env python3
"""The figures of a demo against the targets:  check_summary.py DEMO --least-reduction PERCENT --largest-rms-m METRES"""
import argparse
import json
import pathlib

parser = argparse.ArgumentParser()
parser.add_argument("demo", type=pathlib.Path)
parser.add_argument("--least-reduction", type=float, required=True)
parser.add_argument("--largest-rms-m", type=float, required=True)
args = parser.parse_args()
summary = json.loads((args.demo / "model/summary.json").read_text())
for key in ("raw_points", "raw_triangles", "planes", "polygons", "holes", "leftover_triangles"):
    assert isinstance(summary[key], int), (key, summary[key])
after = summary["polygons"] + summary["leftover_triangles"]
reduction = 100 * (1 - after / summary["raw_triangles"])
assert abs(reduction - summary["reduction_percent"]) < 0.01, (reduction, summary["reduction_percent"])
assert reduction >= args.least_reduction, f"only {reduction:.1f} % fewer surfaces"
compare = json.loads((args.demo / "compare.json").read_text())
rms_m = compare["model"]["to_truth"]["rms_m"]
assert rms_m < args.largest_rms_m, f"the model lies {rms_m:.4f} m RMS off the truth"
print(f"{summary['raw_points']} points, {summary['raw_triangles']} triangles -> {summary['polygons']} polygons with "
      f"{summary['holes']} holes + {summary['leftover_triangles']} triangles: {reduction:.1f} % fewer, {100 * rms_m:.2f} cm RMS to the truth")
