#!/usr/bin/env python3
"""How far off are the poses of a drive out of a house, round it, and in again?

    measure_round_a_house.py HOUSE.ifc WORKDIR [--seeds N] [--rig RIG]     with our programs on PATH

Through living room and hall of house.ifc of the data, out of its front door, round its walls at 1.7 m, and
back. Outside one wall is all that the horizontal laser sees, and at the door it sees nothing. Each seed is
another noise. Prints the error of positions against the truth (RMS, largest), as recorded and after
`biplane optimize`. It judges nothing: docs/loops.md quotes it."""

import argparse
import statistics
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import RIGS, json_of, run

# In the frame of the file, meters.
INSIDE = [(-6.0, 1.5), (0.0, 1.8), (1.0, -0.13), (2.8, -0.13), (3.89, -0.8)]
ROUND = [(3.89, -3.0), (-9.5, -3.0), (-9.5, 6.5), (8.2, 6.5), (8.2, -3.0), (3.89, -3.0)]
# Runs that end further off are blunders.
BLUNDER_M = 0.3


def error(truth, recording):
    found = json_of("biplane", "evaluate", "trajectory", truth / "poses.tum", recording, "--json")
    found = found["absolute"]["translation_m"]
    return found["rmse"], found["max"]


def drive(work, house, seed, rig):
    """The errors of one drive, as recorded and optimized."""
    path, capture, truth = work / "path.toml", work / "bytes.mcap", work / "truth"
    corners = ", ".join(f"[{x}, {y}]" for x, y in [*INSIDE, *ROUND, *INSIDE[::-1]])
    path.write_text(f"corner_m = 0.4\nwaypoints_m = [{corners}]\n")
    words = ["--world", house, "--doors", "open", "--path", path, "--seed", seed, "--force"]
    words += ["--rig", RIGS / f"{rig}.toml"] if rig else []
    run("biplane-mock", "simulate", *words, "-o", capture, "--truth", truth)
    recording, optimized = work / f"{seed}.mcap", work / f"{seed}.opt.mcap"
    for file in (recording, optimized):
        file.unlink(missing_ok=True)
    run("biplane-onboard", "--quiet", "replay", capture, "-o", recording)
    run("biplane", "optimize", recording, "-o", optimized, "--quiet")
    return error(truth, recording), error(truth, optimized)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("house", type=Path)
    parser.add_argument("work", type=Path)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--rig")
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    rows = [drive(args.work, args.house, seed, args.rig) for seed in range(1, args.seeds + 1)]
    for seed, (recorded, optimized) in enumerate(rows, 1):
        print(f"seed {seed}: recorded {recorded[0]:.3f}, largest {recorded[1]:.3f} m", end="; ")
        print(f"optimized {optimized[0]:.3f}, largest {optimized[1]:.3f} m")
    for name, errors in zip(("recorded", "optimized"), zip(*rows, strict=True), strict=True):
        rms = [rms for rms, _ in errors]
        blunders = sum(rms > BLUNDER_M for rms in rms)
        print(f"{name}: median {statistics.median(rms):.3f}, worst {max(rms):.3f} m, blunders {blunders}")


if __name__ == "__main__":
    main()
