#!/usr/bin/env python3
"""Laps round one office: what hours cost, and what is gained by seeing everything again.

    measure_laps.py WORKDIR [--laps N ...]       with our programs on PATH

Drives the corridor of the simulated office N times (50 m and some two minutes a lap), builds on one thread
without the report, and prints a row for each: minutes driven, processor seconds of the stage `optimize` and
of all others, the costliest stage, peak memory, planes and polygons, and how far the model lies from the
true surfaces. Recordings made before are used again. It judges nothing: docs/hours.md quotes it."""

import argparse
import os
import shutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import json_of, run

# The corners of the office's corridor, meters, and the speed, m/s.
START, CORNERS = (10.0, 6.2), [(23.8, 6.2), (23.8, 13.8), (6.2, 13.8), (6.2, 6.2)]
SPEED_M_S = 0.4
HEAD = ["laps", "min", "optimize, s", "rest, s", "most of it, s", "MB", "10^6 points (again)"]
HEAD += ["planes, polygons", "RMS of planes, mm"]
LAPS = [1, 4, 10, 16, 20, 40]


def record(work, laps):
    """The recording of so many laps."""
    name = work / f"laps-{laps}"
    recording = name.with_suffix(".mcap")
    if recording.exists():
        return recording
    corners = "\n".join(f"  [{x}, {y}]," for x, y in [START, *CORNERS * laps, (16.0, 6.2)])
    path = name.with_suffix(".toml")
    path.write_text(f"speed_m_s = {SPEED_M_S}\nwaypoints_m = [\n{corners}\n]\n")
    capture = work / f"laps-{laps}.bytes.mcap"
    words = ["--world", "office", "--path", path, "-o", capture, "--truth", truth(work, laps), "--force"]
    run("biplane-mock", "simulate", *words)
    run("biplane-onboard", "--quiet", "replay", capture, "-o", recording)
    capture.unlink()
    return recording


def truth(work, laps):
    return work / f"laps-{laps}.truth"


def minutes_of(trajectory):
    lines = [line for line in trajectory.read_text().splitlines() if not line.startswith("#")]
    return (float(lines[-1].split()[0]) - float(lines[0].split()[0])) / 60


def row(work, laps):
    model = work / f"laps-{laps}.model"
    recording = record(work, laps)
    shutil.rmtree(model, ignore_errors=True)
    words = ["--no-report", "--threads", 1, "--formats", "ply", "--json"]
    summary = json_of("biplane", "--quiet", "build", recording, "-o", model, *words)
    seconds = {stage["stage"]: stage["cpu_s"] for stage in summary["stages"]}
    optimize = seconds.pop("optimize")
    costliest = max(seconds, key=seconds.get)
    off = json_of("biplane", "compare", model, "--truth", truth(work, laps) / "surfaces.ply", "--json")
    cells = [
        laps,
        f"{minutes_of(model / 'trajectory.tum'):.0f}",
        f"{optimize:.1f}",
        f"{sum(seconds.values()):.1f}",
        f"{costliest} {seconds[costliest]:.1f}",
        f"{summary['peak_memory_bytes'] / 1e6:.0f}",
        f"{summary['raw_points'] / 1e6:.2f} ({summary['revisited_points'] / summary['raw_points']:.0%})",
        f"{summary['planes']}, {summary['polygons']}",
        f"{1e3 * off['planes']['to_truth']['rms_m']:.1f}",
    ]
    shutil.rmtree(model)
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("work", type=Path)
    parser.add_argument("--laps", type=int, nargs="+", default=LAPS)
    words = parser.parse_args()
    os.makedirs(words.work, exist_ok=True)
    print(f"| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}")
    for laps in words.laps:
        row(words.work, laps)


main()
