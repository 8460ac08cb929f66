#!/usr/bin/env python3
"""How far does the matcher's trajectory get from a log's relations when a parameter or the input is odd?

    check_robustness.py LOG RELATIONS OUT.csv [--jobs N] [--only REGEX] [--short] [--matcher NAME]

Needs `biplane` and `biplane-onboard` on PATH; plain Python. With --short a few settings in half a minute.

Each row of OUT.csv (and of the table OUT.md) is the median of three runs of `biplane-onboard replay`, the
second and third without another 1 % of the scans, since one run is chance: every parameter of the default
matcher halved and doubled (`biplane-onboard parameters`; counts are rounded up; values that the parameter's
range does not hold are cut to it, and the table says so), and the log itself degraded by rewriting its CARMEN
text: scans left out, odometry scaled, stalled, jumping or missing, stamps sorted. The error is that of all
relations (metric of Kuemmerle et al. 2009); a relation's pose whose scan was left out is found between the
poses before and after with the log's own odometry. Exit code 1 when a run misses its
target."""

import argparse
import concurrent.futures
import math
import os
import re
import statistics
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.carmen_log import (
    Track,
    dropped,
    read_log,
    scaled,
    score,
    stalls_and_jumps,
    standing,
    without_odometry,
)
from lib.planar import read_numbers
from lib.programs import json_of, run

# The target of the median of a setting's runs, and of the worst.
TARGET_M, TARGET_WITHOUT_ODOMETRY_M, LARGEST_M = 0.05, 0.10, 0.10
SHORT = (
    "as it is",
    "without odometry",
    "every 4th scan",
    "1 % of scans dropped",
    "odometry's distances x 0.9",
    "stamps sorted",
    "map.cell_m x 2",
    "align.range_noise_m x 2",
)


LOGS = {
    "as it is": lambda scans: scans,
    "every 2nd scan": lambda scans: scans[::2],
    "every 4th scan": lambda scans: scans[::4],
    "odometry's distances x 0.9": scaled(0.9, 1.0),
    "odometry's distances x 1.1": scaled(1.1, 1.0),
    "odometry's distances and turns x 0.9": scaled(0.9, 0.9),
    "odometry's distances and turns x 1.1": scaled(1.1, 1.1),
    "1 % of scans dropped": dropped(0.01, 4),
    "stamps sorted": lambda scans: sorted(scans, key=lambda scan: float(scan.stamp)),
    "odometry stalls and jumps": stalls_and_jumps,
    "without odometry": without_odometry,
    "odometry stands still throughout": standing,
}
WITHOUT = ("without odometry", "odometry stands still throughout")


def parameters(matcher):
    """(setting, words of --set) of every parameter of the matcher, halved and doubled."""
    for entry in json_of("biplane-onboard", "parameters", "--json"):
        if entry["name"].startswith({"map": "gradient.", "gradient": "map."}[matcher]):
            continue
        for factor, word in ((0.5, "/ 2"), (2.0, "x 2")):
            wanted = entry["default"] * factor
            wanted = math.ceil(wanted) if entry["whole"] else wanted
            value = min(max(wanted, entry["least"]), entry["most"])
            name = f"{entry['name']} {word}" + ("" if value == wanted else f" (its limit, {value:g})")
            yield name, f"{entry['name']}={value:.9g}"


def one_run(number, imported, words, work, relations, odometry):
    recording, track = f"{work}/{number}.mcap", f"{work}/{number}.track"
    run("biplane-onboard", "replay", imported, "-o", recording, *words, capture_output=True)
    run("biplane", "traj", recording, "--format", "xytheta", "-o", track, capture_output=True)
    rows = read_numbers(track)
    os.remove(recording)
    os.remove(track)
    return score(rows, relations, odometry)


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("log")
    parser.add_argument("relations")
    parser.add_argument("out", type=Path)
    parser.add_argument("--runs", type=int, default=3, help="of each setting")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", default="", metavar="REGEX", help="settings whose name it matches")
    parser.add_argument("--short", action="store_true", help="a few settings only")
    parser.add_argument("--matcher", default="map", choices=("map", "gradient"))
    return parser.parse_args()


def run_all(args, settings):
    """Name, median translation and rotation error and largest translation error of every setting."""
    original = read_log(args.log)
    odometry = Track([[float(scan.stamp), *scan.odometry] for scan in original])
    relations = read_numbers(args.relations)
    with tempfile.TemporaryDirectory() as work, concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        imported = {}
        for name in dict.fromkeys(log for _, log, _ in settings):
            for seed in range(args.runs):
                imported[name, seed] = import_log(args.log, name, seed, f"{work}/log{len(imported)}")
        runs = [
            [
                pool.submit(
                    one_run,
                    f"{number}.{seed}",
                    imported[log, seed],
                    ["--matcher", args.matcher, *words],
                    work,
                    relations,
                    odometry,
                )
                for seed in range(args.runs)
            ]
            for number, (_, log, words) in enumerate(settings)
        ]
        return [(name, *figures(futures)) for (name, _, _), futures in zip(settings, runs)]


def import_log(path, name, seed, file):
    """The altered log as a recording; from the second run on without another 1 % of its scans."""
    thin = dropped(0.01 if seed else 0.0, seed)
    with open(file, "w") as text:
        text.writelines(scan.text() for scan in LOGS[name](thin(read_log(path))))
    run("biplane", "import", "carmen", file, "-o", f"{file}.mcap", capture_output=True)
    return f"{file}.mcap"


def figures(futures):
    """Median translation and rotation error of some runs, and the largest translation error."""
    errors = [future.result() for future in futures]
    return [*(statistics.median(column) for column in zip(*errors)), max(error[0] for error in errors)]


def write_tables(out, results):
    rows = [
        f"{name},{error_m:.4f},{error_deg:.3f},{most_m:.4f}\n" for name, error_m, error_deg, most_m in results
    ]
    out.write_text("".join(["setting,translation_m,rotation_deg,largest_translation_m\n", *rows]))
    head = "| setting | translation (m) | rotation (deg) | largest (m) |\n|---|---|---|---|\n"
    rows = [
        f"| {name} | {error_m:.4f} | {error_deg:.2f} | {most_m:.4f} |\n"
        for name, error_m, error_deg, most_m in results
    ]
    out.with_suffix(".md").write_text("".join([head, *rows]))


def main():
    args = arguments()
    settings = [(name, name, []) for name in LOGS]
    settings += [(name, "as it is", ["--set", words]) for name, words in parameters(args.matcher)]
    settings = [s for s in settings if re.search(args.only, s[0]) and (not args.short or s[0] in SHORT)]
    results = run_all(args, settings)
    write_tables(args.out, results)
    missed = 0
    for name, error_m, error_deg, most_m in results:
        target_m = TARGET_WITHOUT_ODOMETRY_M if name in WITHOUT else TARGET_M
        has_missed = error_m > target_m or most_m > LARGEST_M
        missed += has_missed
        remark = "  MISSED" if has_missed else ""
        print(f"{error_m:8.4f} m {error_deg:7.3f} deg, largest {most_m:8.4f} m  {name}{remark}")
    worst = max(results, key=lambda row: row[1])
    print(
        f"{len(results)} runs, {missed} miss their target "
        f"({TARGET_M} m, without odometry {TARGET_WITHOUT_ODOMETRY_M} m; none over {LARGEST_M} m); "
        f"the worst: {worst[0]}, {worst[1]:.4f} m"
    )
    sys.exit(1 if missed else 0)


main()
