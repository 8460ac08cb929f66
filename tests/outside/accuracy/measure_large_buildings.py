#!/usr/bin/env python3
"""Hard buildings through import, replay, optimize and evaluate, and the loops against the truth.

    measure_large_buildings.py WORKDIR [NAME...] [--gate]

Prints a row for each building: position error (root mean square, m) and relations error (mean, m and degrees)
before and after, the loops believed and how many of them are wrong, processor time of import, replay and
optimize, and the memory of optimize. A loop is wrong when its pose is off by more than ten of its own
standard deviations (at least 3 cm each way). With --gate ends with 1 when one is, or when a building's
position error is larger than its bound. Recordings made before are used again. Needs `biplane` and
`biplane-onboard` on PATH, and numpy."""

import argparse
import csv
import json
import math
import os
import resource
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import np
from lib.carmen_log import Track
from lib.planar import read_numbers, seen_from
from lib.programs import json_of, output_of, run_check

# Options of make_large_building.py, and the largest position error (m) after optimize, where a bound makes
# sense.
BUILDINGS = {
    "nested": ("--plan nested --seed 3", 0.3),
    "nested bare": ("--plan nested --structure bare --seed 4", None),
    "nested bare worn": ("--plan nested --structure bare --odometry worn --seed 5", None),
    "nested repeating worn": ("--plan nested --structure repeating --odometry worn --seed 6", 0.3),
    "nested twins worn": ("--plan nested --structure twins --odometry worn --seed 7", 0.3),
    "late worn": ("--plan late --odometry worn --seed 8", 0.3),
    "late bare worn people": ("--plan late --structure bare --odometry worn --people 6 --seed 9", None),
    "grid repeating": ("--plan grid --structure repeating --seed 10", 0.3),
    "grid twins worn people": ("--plan grid --structure twins --odometry worn --people 6 --seed 11", None),
    "nested worn glass 50 m irregular": (
        "--plan nested --odometry worn --glass 0.3 --range 50 --irregular --seed 12",
        0.5,
    ),
    "two hours": (
        "--plan nested --structure bare --odometry worn --people 4 --hours 2 --irregular --seed 13",
        None,
    ),
    "late repeating worn people irregular": (
        "--plan late --structure repeating --odometry worn --people 6 --irregular --seed 14",
        None,
    ),
    "late twins 50 m": ("--plan late --structure twins --range 50 --seed 15", 0.3),
}


def timed(*words):
    """Runs a program; its output and processor seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    output = output_of(*words)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return output, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def figures(recording, name):
    """Position error (m) and relations error (m, degrees)."""
    ate = json_of("biplane", "evaluate", "trajectory", name + ".truth", recording, "--json")
    relations = json_of("biplane", "evaluate", "relations", name + ".relations", recording, "--json")
    return (
        ate["absolute"]["translation_m"]["rmse"],
        relations["translation_m"]["mean"],
        relations["rotation_deg"]["mean"],
    )


def wrong(name):
    """Loops believed, and those of them that are wrong."""
    truth = Track(read_numbers(name + ".truth"))
    counts = [0, 0]
    with open(name + ".loops.csv") as table:
        for row in csv.DictReader(table):
            if row.pop("believed") != "1":
                continue
            value = {key: float(text) for key, text in row.items()}
            # Stamps are written with more digits here than there.
            one, other = (truth.rows[truth.nearest(value[end])][1:] for end in ("t1", "t2"))
            x, y, theta = seen_from(one, other)
            off = np.array([value["x"] - x, value["y"] - y, math.remainder(value["theta"] - theta, math.tau)])
            xx, xy, xt, yy, yt, tt = (value[key] for key in ("ixx", "ixy", "ixt", "iyy", "iyt", "itt"))
            counts[0] += 1
            counts[1] += int(off @ np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]]) @ off > 100)
    return counts


def building(work, title):
    """One row; whether it is as it should be."""
    options, bound = BUILDINGS[title]
    name = os.path.join(work, title.replace(" ", "_"))
    if not os.path.exists(name + ".relations"):
        run_check("accuracy/make_large_building.py", name, *options.split())
    _, importing = timed(
        "biplane", "--quiet", "import", "carmen", name + ".log", "-o", name + ".mcap", "--force"
    )
    _, replaying = timed(
        "biplane-onboard", "--quiet", "replay", name + ".mcap", "-o", name + ".run.mcap", "--force"
    )
    told, optimizing = timed(
        "biplane",
        "--quiet",
        "optimize",
        name + ".run.mcap",
        "-o",
        name + ".opt.mcap",
        "--loops",
        name + ".loops.csv",
        "--json",
        "--threads",
        1,
        "--force",
    )
    before, after = figures(name + ".run.mcap", name), figures(name + ".opt.mcap", name)
    loops, false = wrong(name)
    errors = [
        f"{one:.{digits}f} -> {other:.{digits}f}" for one, other, digits in zip(before, after, (2, 3, 2))
    ]
    times, memory_mb = (
        f"{importing:.1f} + {replaying:.1f} + {optimizing:.1f}",
        json.loads(told)["peak_memory_bytes"] / 1e6,
    )
    cells = [title, *errors, loops, false, times, f"{memory_mb:.0f}"]
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)
    return false == 0 and (bound is None or after[0] < bound)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("work")
    parser.add_argument("titles", nargs="*", metavar="NAME", help="; ".join(BUILDINGS))
    parser.add_argument("--gate", action="store_true")
    args = parser.parse_args()
    os.makedirs(args.work, exist_ok=True)
    head = (
        "building",
        "position (m)",
        "relations (m)",
        "(deg)",
        "loops",
        "wrong",
        "processor time (s)",
        "MB",
    )
    print(f"| {' | '.join(head)} |\n{'|---' * len(head)}|")
    good = [building(args.work, title) for title in args.titles or BUILDINGS]
    sys.exit(1 if args.gate and not all(good) else 0)


main()
