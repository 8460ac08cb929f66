#!/usr/bin/env python3
"""Do people who walk along with the robot drag its pose along a corridor?

    check_people.py [--seeds N] [--structure bare|furnished]... [--people N]... [--json] [--worst M]
                    [--median M]

Needs `biplane` and `biplane-onboard` on PATH, and numpy. A corridor of 40 m by 2.6 m, driven through once.
Two to seven people keep the robot company: ahead, behind and beside it, on two legs, nearly at its pace; one
in three walks some other way. The odometry is 0.2 % long and drifts 0.3 degrees a meter, so what it misses by
itself is a few centimeters. Printed for each structure and number of people: the mean distance of the
matched way from the true one as seen from the start, median and worst of the seeds (20). Exit code 1 when a
given limit, in meters, is missed."""

import argparse
import concurrent.futures
import json
import math
import os
import statistics
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import np
from lib.planar import read_numbers, seen_from
from lib.programs import run

LENGTH_M, HALF_WIDTH_M = 40.0, 1.3
ANGLES = np.radians(np.arange(181) - 90.0)
NOISE_M = 0.01
LEG_M, STRIDE_M, SWING_M = 0.07, 1.3, 0.18


def corridor(random, structure):
    """All walls, a row (x, y, x, y) each."""
    walls = [
        (-2, -HALF_WIDTH_M, -2, HALF_WIDTH_M),
        (LENGTH_M + 4, -HALF_WIDTH_M, LENGTH_M + 4, HALF_WIDTH_M),
    ]
    for side in (-1, 1):
        at, end = -2.0, LENGTH_M + 4
        while at < end:
            stop = min(end, at + (random.uniform(2, 6) if structure == "furnished" else end - at))
            y = side * HALF_WIDTH_M
            walls.append((at, y, stop, y))
            at = stop
            if at >= end - 1.5:
                continue
            long, deep = random.uniform(0.4, 1.2), random.choice([-0.35, -0.2, 0.15, 0.3])
            walls += [(at, y, at, y + side * deep), (at, y + side * deep, at + long, y + side * deep)]
            walls += [(at + long, y + side * deep, at + long, y)]
            at += long
    return np.array(walls)


class Walker:
    """Somebody on two legs, who keeps near the robot or walks by."""

    def __init__(self, random):
        self.goes_along = random.random() < 0.67
        self.ahead_m = random.uniform(-1, 4) if self.goes_along else random.uniform(5, 35)
        self.beside_m = random.uniform(-1.0, 1.0)
        self.pace = random.uniform(-0.02, 0.02) if self.goes_along else random.choice([-2.2, -1.8, -0.5, 0.4])
        self.sway = random.uniform(0.05, 0.25), random.uniform(0.1, 0.4), random.uniform(0, 6.28)
        self.wide_m = random.uniform(0.2, 0.3)

    def legs(self, time_s, robot):
        """Middles of both legs; none where the robot is."""
        swing_m, rate, phase = self.sway
        ahead_m = self.ahead_m + self.pace * time_s + swing_m * math.sin(rate * time_s + phase)
        x, y = robot[0] + ahead_m, self.beside_m
        swing = SWING_M * math.sin(math.tau * x / STRIDE_M)
        if math.hypot(x - robot[0], y - robot[1]) < 0.6:
            return []
        return [(x + swing, y + self.wide_m / 2), (x - swing, y - self.wide_m / 2)]


def ranges_m(random, walls, legs, pose, longest_m):
    """One scan: the nearest wall or leg of each beam."""
    x, y, heading = pose
    dx, dy = np.cos(ANGLES + heading)[:, None], np.sin(ANGLES + heading)[:, None]
    (ex, ey), (wx, wy) = (walls[:, 2:] - walls[:, :2]).T, (walls[:, :2] - (x, y)).T
    across = dx * ey - dy * ex
    with np.errstate(all="ignore"):
        found, along = (wx * ey - wy * ex) / across, (wx * dy - wy * dx) / across
        found = np.where((found > 0) & (along >= -1e-9) & (along <= 1 + 1e-9), found, np.inf).min(1)
        if legs:
            lx, ly = (np.array(legs) - (x, y)).T
            near, off = dx * lx + dy * ly, dx * ly - dy * lx
            leg = near - np.sqrt(LEG_M**2 - off**2)
            found = np.minimum(found, np.where((near > 0) & ~np.isnan(leg), leg, np.inf).min(1))
    found = found + random.normal(0, NOISE_M, len(ANGLES))
    return np.where(found > longest_m, 81.83, found)


def drive(seed, structure, people, name):
    """Writes NAME.log; the true poses, a row (t, x, y, theta) each."""
    random = np.random.default_rng([seed, people, structure == "bare"])
    walls, walkers = corridor(random, structure), [Walker(random) for _ in range(people)]
    speed, gap_s = random.uniform(0.4, 0.8), random.choice([0.1, 0.2])
    longest_m = random.choice([30.0, 79.0])
    truth, odometry, traveled_m, time_s = [], [0.0, 0.0, 0.0], 0.0, 0.0
    last = None
    with open(name, "w") as log:
        while traveled_m < LENGTH_M:
            heading = 0.05 * math.sin(traveled_m / 3)
            pose = (traveled_m, 0.15 * (1 - math.cos(traveled_m / 3)), heading)
            if last:
                step = seen_from(last, pose)
                ahead = step[0] * 1.002 * (1 + random.normal(0, 0.02))
                turn = step[2] + math.radians(0.3) * step[0] + random.normal(0, 0.001)
                odometry = [
                    odometry[0] + ahead * math.cos(odometry[2]),
                    odometry[1] + ahead * math.sin(odometry[2]),
                    odometry[2] + turn,
                ]
            last = pose
            legs = [leg for walker in walkers for leg in walker.legs(time_s, pose)]
            seen = " ".join(f"{r:.2f}" for r in ranges_m(random, walls, legs, pose, longest_m))
            counted = " ".join(f"{value:.6f}" for value in odometry)
            log.write(f"FLASER 181 {seen} {counted} {counted} {1e6 + time_s:.6f} sim {time_s:.6f}\n")
            truth.append((1e6 + time_s, *pose))
            traveled_m += speed * gap_s * min(1.0, 0.2 + time_s / 2)
            time_s += gap_s
    return truth


def error_m(seed, structure, people):
    """Mean distance from the true way, as seen from the start."""
    with tempfile.TemporaryDirectory() as work:
        log, imported, posed, track = (f"{work}/{name}" for name in ("a.log", "i.mcap", "p.mcap", "track"))
        truth = drive(seed, structure, people, log)
        run("biplane", "import", "carmen", log, "-o", imported, capture_output=True)
        run("biplane-onboard", "replay", imported, "-o", posed, capture_output=True)
        run("biplane", "traj", posed, "--format", "xytheta", "-o", track, capture_output=True)
        found = read_numbers(track)
        true = {round(row[0], 3): row[1:] for row in truth}
        start, begin = found[0][1:], true[round(found[0][0], 3)]
        off = [
            math.dist(seen_from(start, row[1:])[:2], seen_from(begin, true[round(row[0], 3)])[:2])
            for row in found
        ]
        return sum(off) / len(off)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--structure", choices=("bare", "furnished"), action="append")
    parser.add_argument("--people", type=int, action="append")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--median", type=float, metavar="M")
    parser.add_argument("--worst", type=float, metavar="M")
    args = parser.parse_args()
    rows, missed = [], False
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for structure in args.structure or ("furnished", "bare"):
            for people in args.people or (0, 2, 4, 7):
                jobs = [pool.submit(error_m, seed, structure, people) for seed in range(args.seeds)]
                errors = [job.result() for job in jobs]
                row = {"structure": structure, "people": people, "runs_m": errors}
                row |= {"median_m": statistics.median(errors), "worst_m": max(errors)}
                rows.append(row)
                missed |= args.median is not None and row["median_m"] > args.median
                missed |= args.worst is not None and row["worst_m"] > args.worst
                if not args.json:
                    runs = " ".join(f"{error:.3f}" for error in errors)
                    print(
                        f"{structure}, {people} people: median {row['median_m']:.3f} m, "
                        f"worst {row['worst_m']:.3f} m  {runs}",
                        flush=True,
                    )
    if args.json:
        print(json.dumps(rows))
    sys.exit(1 if missed else 0)


main()
