#!/usr/bin/env python3
"""How good are the poses of a log when a few of its scans are missing, each time others?

    check_ensemble.py LOG [RELATIONS | --truth TRUTH] [--runs N] [--optimize] [--odometry CHANGE]
                      [--set NAME=VALUE]... [--json] [--worst LIMIT] [--median LIMIT]
                      [--optimized-median LIMIT] [--optimized-worst LIMIT] [--optimized-share LIMIT]

Needs `biplane` and `biplane-onboard` on PATH; plain Python. One run on one log is chance: a scan more or
less sends a matcher another way. So the log is run N times (8), the first time whole, then each time with
another 1 % of its scans left out. The error is the mean over all relations (metric of Kuemmerle et al. 2009);
one over 0.1 m is a blunder. With the truth (`make_large_building.py`) it is the root mean square of the
positions. Without either the bits of the map count (`evaluate map`): sharp maps of right poses have few.
Odometry can be altered: `signs` (its sign is wrong when the robot drives backward), `scaled-0.8`,
`scaled-1.2`, `stalled` (5 s a minute), `jumps` (a meter ahead or back each half a minute), `standing` (no
wheel ever turns), `none`. Or the robot is `carried` for 20 s three times: no scans, and odometry that stands.
Exit code 1 when a given limit is missed: of meters or bits, or of the share of what was while driving that
each run has when its loops are closed."""

import argparse
import concurrent.futures
import json
import os
import statistics
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.carmen_log import (
    Track,
    carried,
    dropped,
    jumps,
    read_log,
    scaled,
    score,
    signs_wrong_backward,
    stalled,
    standing,
    without_odometry,
)
from lib.planar import read_numbers
from lib.programs import json_of, run

BLUNDER_M = 0.1
SHARE_LEFT_OUT = 0.01
CHANGES = {
    "signs": signs_wrong_backward,
    "scaled-0.8": scaled(0.8, 1.0),
    "scaled-1.2": scaled(1.2, 1.0),
    "stalled": stalled,
    "jumps": jumps,
    "none": without_odometry,
    "standing": standing,
    "carried": carried,
}


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("log", type=Path)
    parser.add_argument("relations", nargs="?")
    parser.add_argument("--truth", help="true poses instead of relations: position errors")
    parser.add_argument("--runs", type=int, default=8)
    parser.add_argument("--optimize", action="store_true", help="close loops too")
    parser.add_argument("--odometry", choices=tuple(CHANGES))
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--json", action="store_true")
    for limit in ("median", "worst", "optimized-median", "optimized-worst", "optimized-share"):
        parser.add_argument(f"--{limit}", type=float, metavar="LIMIT")
    return parser.parse_args()


def log_of_run(path, number, change):
    """The text of the log: its scans thinned from the second run on, and its odometry altered."""
    leave_out = dropped(SHARE_LEFT_OUT if number else 0.0, number)
    if change:
        return "".join(scan.text() for scan in CHANGES[change](leave_out(read_log(path))))
    lines = path.read_text(errors="replace").splitlines(keepends=True)
    scans = [i for i, line in enumerate(lines) if line.startswith("FLASER")]
    gone = set(scans) - set(leave_out(scans))
    return "".join(line for i, line in enumerate(lines) if i not in gone)


class RelationsError:
    """Judges a recording by its poses: the mean error of all relations, in meters and degrees."""

    unit, decimals = "m", 4

    def __init__(self, log, relations):
        self.odometry = Track([[float(scan.stamp), *scan.odometry] for scan in read_log(log)])
        self.relations = read_numbers(relations)

    def of(self, recording):
        track = f"{recording}.txt"
        run("biplane", "traj", recording, "--format", "xytheta", "-o", track, capture_output=True)
        return score(read_numbers(track), self.relations, self.odometry)

    def summary(self, errors):
        meters = [error[0] for error in errors]
        return {
            "median_m": statistics.median(meters),
            "worst_m": max(meters),
            "median_deg": statistics.median(error[1] for error in errors),
            "blunders": sum(error > BLUNDER_M for error in meters) / len(meters),
            "runs_m": meters,
        }


class PositionError:
    """Judges a recording by its positions: their root mean square, laid on the truth, in meters."""

    unit, decimals = "m", 3

    def __init__(self, truth):
        self.truth = truth

    def of(self, recording):
        found = json_of("biplane", "evaluate", "trajectory", self.truth, recording, "--json")
        return found["absolute"]["translation_m"]["rmse"]

    def summary(self, errors):
        return {"median_m": statistics.median(errors), "worst_m": max(errors), "runs_m": errors}


class MapBits:
    """Judges a recording by the bits of its map."""

    unit, decimals = "bits", 0

    def of(self, recording):
        return json_of("biplane", "evaluate", "map", recording, "--json")["total_bits"]

    def summary(self, bits):
        return {"median_bits": statistics.median(bits), "worst_bits": max(bits), "runs_bits": bits}


def judge_of(args):
    if args.truth:
        return PositionError(args.truth)
    return RelationsError(args.log, args.relations) if args.relations else MapBits()


def one_run(args, number, judge):
    """What the judge finds as recorded, and optimized when that is asked for."""
    with tempfile.TemporaryDirectory() as work:
        log, imported, posed = (f"{work}/{name}" for name in ("a.log", "imported.mcap", "posed.mcap"))
        Path(log).write_text(log_of_run(args.log, number, args.odometry))
        run("biplane", "import", "carmen", log, "-o", imported, capture_output=True)
        settings = [word for setting in args.set for word in ("--set", setting)]
        run("biplane-onboard", "replay", imported, "-o", posed, *settings, capture_output=True)
        found = {"incremental": judge.of(posed)}
        if args.optimize:
            closed = f"{work}/closed.mcap"
            run("biplane", "optimize", posed, "-o", closed, "--threads", 1, capture_output=True)
            found["optimized"] = judge.of(closed)
        return found


def row(judge, spread):
    """One line of a printed summary."""
    unit, decimals = judge.unit, judge.decimals
    words = [f"median {spread[f'median_{unit}']:.{decimals}f} {unit}"]
    if "median_deg" in spread:
        words.append(f"{spread['median_deg']:.2f} deg")
    words.append(f"worst {spread[f'worst_{unit}']:.{decimals}f} {unit}")
    if "blunders" in spread:
        words.append(f"blunders {spread['blunders']:.0%}")
    runs = " ".join(f"{value:.{max(decimals - 1, 0)}f}" for value in spread[f"runs_{unit}"])
    return f"{', '.join(words)}  {runs}"


def main():
    args = arguments()
    judge = judge_of(args)
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        runs = list(pool.map(lambda i: one_run(args, i, judge), range(args.runs)))
    found = {kind: judge.summary([run[kind] for run in runs]) for kind in runs[0]}
    if args.json:
        print(json.dumps(found))
    missed = False
    for kind, spread in found.items():
        limits = {"incremental": (args.median, args.worst)}.get(
            kind, (args.optimized_median, args.optimized_worst)
        )
        reached = (spread[f"median_{judge.unit}"], spread[f"worst_{judge.unit}"])
        over = any(limit is not None and value > limit for value, limit in zip(reached, limits))
        missed |= over
        if not args.json:
            name = f"{args.log.stem} {args.odometry or ''} {kind}"
            print(f"{name}: {row(judge, spread)}{'  MISSED' if over else ''}")
    if args.optimized_share is not None:
        kinds = (found[kind][f"runs_{judge.unit}"] for kind in ("optimized", "incremental"))
        share = max(optimized / incremental for optimized, incremental in zip(*kinds))
        missed |= share > args.optimized_share
        print(f"at most {share:.3f} of what it was while driving, allowed {args.optimized_share}")
    sys.exit(1 if missed else 0)


main()
