#!/usr/bin/env python3
"""Do the covariances in `/pose` hold the poses' errors, as recorded and optimized?

    check_covariances.py [--seeds N] [--first SEED] [--world W:RIG]... [--json] [--least SHARE] [--most SHARE]

Needs `biplane`, `biplane-onboard` and `biplane-mock` on PATH, numpy and mcap. Simulated drives (office with
the rigs planar and fast, building with the rig outdoor; any other as WORLD:RIG). The error of a pose is that
in the frame of the first pose, which is exact by definition; its covariance is turned into that frame.
Printed for each world, as recorded and optimized: the share of poses whose error lies within the ellipse
that should hold 95 % of them, of the position (2 numbers) and of all three numbers, the mean squared errors
normalized by the covariance (2 and 1 where it is right) of the position and of the heading, and root mean
squares.
`--least` and `--most` bound the share of positions of all optimized drives together; exit code 1 when they
are missed."""

import argparse
import concurrent.futures
import json
import math
import os
import struct
import sys
import tempfile
from pathlib import Path

from mcap.reader import make_reader

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import np
from lib.planar import read_numbers
from lib.programs import RIGS, run
from lib.verdict import require

WORLDS = ["office:planar", "office:fast", "building:outdoor"]
# Chi-square quantiles of 95 % by degrees of freedom.
WITHIN = {2: 5.991, 3: 7.815}
# x, y and heading in the six numbers of a covariance.
PLANAR = np.ix_([0, 1, 5], [0, 1, 5])


def poses(recording):
    """Stamp (s), pose (x, y, theta) and covariance of each message on /pose."""
    with open(recording, "rb") as file:
        for _, _, message in make_reader(file).iter_messages(topics=["/pose"]):
            # CDR: stamp, frame_id, then doubles aligned to 8 bytes behind the header of 4.
            seconds, nanoseconds, length = struct.unpack_from("<iII", message.data, 4)
            start = 4 + (12 + length + 7) // 8 * 8
            numbers = struct.unpack_from("<43d", message.data, start)
            x, y, _, _, _, qz, qw = numbers[:7]
            covariance = np.array(numbers[7:]).reshape(6, 6)[PLANAR]
            yield seconds + 1e-9 * nanoseconds, (x, y, 2 * math.atan2(qz, qw)), covariance


def truth_of(path):
    """Where the base was, by time (s)."""
    rows = np.array(read_numbers(path))
    heading = np.unwrap(2 * np.arctan2(rows[:, 6], rows[:, 7]))
    return lambda time_s: [np.interp(time_s, rows[:, 0], of) for of in (rows[:, 1], rows[:, 2], heading)]


def seen_from(a, b):
    cos, sin = math.cos(a[2]), math.sin(a[2])
    dx, dy = b[0] - a[0], b[1] - a[1]
    return np.array([cos * dx + sin * dy, cos * dy - sin * dx, b[2] - a[2]])


def errors(recording, truth):
    """Errors and covariances in the frame of the first pose, but for that one."""
    (begin_s, first, _), *rest = poses(recording)
    cos, sin = math.cos(first[2]), math.sin(first[2])
    turn = np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
    found, covariances = [], []
    for time_s, pose, covariance in rest:
        off = seen_from(first, pose) - seen_from(truth(begin_s), truth(time_s))
        off[2] = math.remainder(off[2], math.tau)
        found.append(off)
        covariances.append(turn @ covariance @ turn.T)
    return np.array(found), np.array(covariances)


def drive(world, seed):
    """Errors and covariances of a drive, as recorded and optimized."""
    name, rig = world.split(":")
    with tempfile.TemporaryDirectory() as work:
        capture, posed, closed, truth = (f"{work}/{name}" for name in ("c.mcap", "r.mcap", "o.mcap", "truth"))
        where = ["--world", name, "--rig", RIGS / f"{rig}.toml", "--seed", seed]
        run("biplane-mock", "simulate", *where, "-o", capture, "--truth", truth, capture_output=True)
        run("biplane-onboard", "replay", capture, "-o", posed, capture_output=True)
        run("biplane", "optimize", posed, "-o", closed, "--threads", 1, capture_output=True)
        true = truth_of(f"{truth}/poses.tum")
        return errors(posed, true), errors(closed, true)


def figures(drives):
    """What is printed of some drives."""
    off = np.concatenate([errors for errors, _ in drives])
    covariance = np.concatenate([covariances for _, covariances in drives])

    def squared(count):
        part = off[:, :count]
        return np.einsum("ni,nij,nj->n", part, np.linalg.inv(covariance[:, :count, :count]), part)

    return {
        "within_position": float(np.mean(squared(2) < WITHIN[2])),
        "within_pose": float(np.mean(squared(3) < WITHIN[3])),
        "normalized_position": float(np.mean(squared(2))),
        "normalized_heading": float(np.mean(off[:, 2] ** 2 / covariance[:, 2, 2])),
        "rms_m": float(np.sqrt(np.mean(np.sum(off[:, :2] ** 2, 1)))),
        "rms_deg": math.degrees(np.sqrt(np.mean(off[:, 2] ** 2))),
    }


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--world", action="append", metavar="W:RIG")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--least", type=float, default=0.0, metavar="SHARE")
    parser.add_argument("--most", type=float, default=1.0, metavar="SHARE")
    args = parser.parse_args()
    seeds = range(args.first, args.first + args.seeds)
    found, optimized = {}, []
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        for world in args.world or WORLDS:
            drives = list(pool.map(lambda seed, world=world: drive(world, seed), seeds))
            optimized += [closed for _, closed in drives]
            for kind, of in zip(("recorded", "optimized"), zip(*drives)):
                found[f"{world} {kind}"] = figures(of)
    found["all optimized"] = figures(optimized)
    if args.json:
        print(json.dumps(found))
    else:
        for name, row in found.items():
            print(f"{name}: " + ", ".join(f"{key} {value:.4f}" for key, value in row.items()))
    share = found["all optimized"]["within_position"]
    require(args.least <= share <= args.most, f"{share:.1%} of the positions are in their ellipse of 95 %")


main()
