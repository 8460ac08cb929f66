#!/usr/bin/env python3
"""How far does the matcher's trajectory get from a log's relations when a parameter or the input is odd?

    check_robustness.py LOG RELATIONS OUT.csv [--jobs N] [--only REGEX] [--short] [--matcher NAME]

Needs `biplane` and `biplane-onboard` on PATH; plain Python. 152 runs, with --short a few of them in a quarter
of a minute.

Each row of OUT.csv (and of the table OUT.md) is one run of `biplane-onboard replay`: every parameter of the
default matcher halved and doubled (`biplane-onboard parameters`; counts are rounded up; values that the
parameter's range does not hold are cut to it, and the table says so), and the log itself degraded by
rewriting its CARMEN text: scans left out, odometry scaled, stalled, jumping or missing, stamps sorted. The
error is that of all relations (metric of Kuemmerle et al. 2009); a relation's pose whose scan was left out is
found between the poses before and after with the log's own odometry. Exit code 1 when a run misses its
target."""

import argparse
import bisect
import concurrent.futures
import math
import os
import random
import re
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.planar import moved, read_numbers, seen_from
from lib.programs import json_of, run

TARGET_M, TARGET_WITHOUT_ODOMETRY_M = 0.05, 0.10
SHORT = (
    "as it is",
    "without odometry",
    "every 4th scan",
    "1 % of scans dropped",
    "odometry's distances x 0.9",
    "stamps sorted",
    "map.cell_m x 2",
)


class Scan:
    """A line of the log: ranges, odometry [x, y, theta], stamp."""

    def __init__(self, line):
        words = line.split()
        self.ranges = words[2 : 2 + int(words[1])]
        rest = words[2 + len(self.ranges) :]
        self.odometry = [float(word) for word in rest[3:6]]
        self.stamp, self.host = rest[6], rest[7]

    def text(self):
        ranges = " ".join(self.ranges)
        if self.odometry is None:  # CARMEN's message of a laser that knows no robot
            stamps = f"{self.stamp} {self.host} {self.stamp}"
            return f"RAWLASER1 0 0 0 0 0 0 0 {len(self.ranges)} {ranges} 0 {stamps}\n"
        pose = " ".join(f"{value:.6f}" for value in self.odometry)
        return f"FLASER {len(self.ranges)} {ranges} {pose} {pose} {self.stamp} {self.host} {self.stamp}\n"


def with_steps(scans, change):
    """New odometry out of the old one's steps; `change` gets number and step."""
    pose, last = list(scans[0].odometry), scans[0].odometry
    for number, scan in enumerate(scans):
        step = seen_from(last, scan.odometry)
        last = scan.odometry
        pose = moved(pose, change(number, step))
        scan.odometry = pose
    return scans


def scaled(distance, turn):
    return lambda scans: with_steps(scans, lambda _, s: [s[0] * distance, s[1] * distance, s[2] * turn])


def stalls_and_jumps(scans):
    """Each minute stands still for 10 s, then goes on from there; half a minute later it jumps 0.5 m aside
    and 0.3 rad."""
    start, jumped = float(scans[0].stamp), set()

    def change(number, step):
        minute, second = divmod(float(scans[number].stamp) - start, 60.0)
        if 20.0 <= second < 30.0:
            return [0.0, 0.0, 0.0]
        if second >= 50.0 and minute not in jumped:
            jumped.add(minute)
            return [step[0], step[1] + 0.5, step[2] + 0.3]
        return step

    return with_steps(scans, change)


def without_odometry(scans):
    for scan in scans:
        scan.odometry = None
    return scans


def standing(scans):
    for scan in scans:
        scan.odometry = [0.0, 0.0, 0.0]
    return scans


def dropped(scans):
    chance = random.Random(4)
    return [scan for scan in scans if chance.random() >= 0.01]


LOGS = {
    "as it is": lambda scans: scans,
    "every 2nd scan": lambda scans: scans[::2],
    "every 4th scan": lambda scans: scans[::4],
    "odometry's distances x 0.9": scaled(0.9, 1.0),
    "odometry's distances x 1.1": scaled(1.1, 1.0),
    "odometry's distances and turns x 0.9": scaled(0.9, 0.9),
    "odometry's distances and turns x 1.1": scaled(1.1, 1.1),
    "1 % of scans dropped": dropped,
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


class Track:
    """A trajectory, by time: rows of t, x, y, theta."""

    def __init__(self, rows):
        self.rows = sorted(rows)
        self.stamps = [row[0] for row in self.rows]

    def nearest(self, stamp):
        i = bisect.bisect_left(self.stamps, stamp)
        return min(
            (j for j in (i - 1, i) if 0 <= j < len(self.stamps)), key=lambda j: abs(self.stamps[j] - stamp)
        )

    def at(self, stamp, odometry):
        """The pose at a stamp. Where its scan was left out: the log's own odometry from the pose before, led
        to the pose after."""
        i = bisect.bisect_left(self.stamps, stamp)
        if i == len(self.rows) or self.stamps[i] == stamp or i == 0:
            return self.rows[min(i, len(self.rows) - 1)][1:]
        before, after = self.rows[i - 1], self.rows[i]
        here, start, end = (odometry.rows[odometry.nearest(t)][1:] for t in (stamp, before[0], after[0]))
        forth, back = moved(before[1:], seen_from(start, here)), moved(after[1:], seen_from(end, here))
        share = (stamp - before[0]) / (after[0] - before[0])
        return moved(forth, [share * value for value in seen_from(forth, back)])


def score(rows, relations, odometry):
    track = Track(rows)
    errors = []
    for first, second, x, y, z, _, _, yaw in relations:
        step = seen_from(track.at(first, odometry), track.at(second, odometry))
        turn = math.degrees(abs(math.remainder(step[2] - yaw, math.tau)))
        errors.append((math.sqrt((step[0] - x) ** 2 + (step[1] - y) ** 2 + z**2), turn))
    return [sum(column) / len(errors) for column in zip(*errors)]


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
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only", default="", metavar="REGEX", help="settings whose name it matches")
    parser.add_argument("--short", action="store_true", help="a few settings only")
    parser.add_argument("--matcher", default="map", choices=("map", "gradient"))
    return parser.parse_args()


def read_log(path):
    with open(path) as lines:
        return [Scan(line) for line in lines if line.startswith("FLASER")]


def run_all(args, settings):
    """Name, translation and rotation error of every setting."""
    original = read_log(args.log)
    odometry = Track([[float(scan.stamp), *scan.odometry] for scan in original])
    relations = read_numbers(args.relations)
    with tempfile.TemporaryDirectory() as work, concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        imported = {}
        for number, name in enumerate(dict.fromkeys(log for _, log, _ in settings)):
            imported[name] = f"{work}/log{number}.mcap"
            with open(f"{work}/log", "w") as text:
                text.writelines(scan.text() for scan in LOGS[name](read_log(args.log)))
            words = ["import", "carmen", f"{work}/log", "-o", imported[name], "--force"]
            run("biplane", *words, capture_output=True)
        runs = [
            pool.submit(
                one_run, number, imported[log], ["--matcher", args.matcher, *words], work, relations, odometry
            )
            for number, (_, log, words) in enumerate(settings)
        ]
        return [(name, *future.result()) for (name, _, _), future in zip(settings, runs)]


def write_tables(out, results):
    rows = [f"{name},{error_m:.4f},{error_deg:.3f}\n" for name, error_m, error_deg in results]
    out.write_text("".join(["setting,translation_m,rotation_deg\n", *rows]))
    head = "| setting | translation (m) | rotation (deg) |\n|---|---|---|\n"
    rows = [f"| {name} | {error_m:.4f} | {error_deg:.2f} |\n" for name, error_m, error_deg in results]
    out.with_suffix(".md").write_text("".join([head, *rows]))


def main():
    args = arguments()
    settings = [(name, name, []) for name in LOGS]
    settings += [(name, "as it is", ["--set", words]) for name, words in parameters(args.matcher)]
    settings = [s for s in settings if re.search(args.only, s[0]) and (not args.short or s[0] in SHORT)]
    results = run_all(args, settings)
    write_tables(args.out, results)
    missed = 0
    for name, error_m, error_deg in results:
        has_missed = error_m > (TARGET_WITHOUT_ODOMETRY_M if name in WITHOUT else TARGET_M)
        missed += has_missed
        print(f"{error_m:8.4f} m {error_deg:7.3f} deg  {name}{'  MISSED' if has_missed else ''}")
    worst = max(results, key=lambda row: row[1])
    print(
        f"{len(results)} runs, {missed} miss their target "
        f"({TARGET_M} m, without odometry {TARGET_WITHOUT_ODOMETRY_M} m); "
        f"the worst: {worst[0]}, {worst[1]:.4f} m"
    )
    sys.exit(1 if missed else 0)


main()
