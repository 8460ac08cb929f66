#!/usr/bin/env python3
"""Laps round one office: what hours cost, and what is gained by seeing everything again.

    measure_laps.py WORKDIR [--laps N ...] [--speed M_S] [--rig RIG]     with our programs on PATH

Drives the corridor of the simulated office N times (50 m, some two minutes a lap at 0.4 m/s), builds on
one thread without the report, and prints a row for each: minutes driven, processor seconds of the stage
`optimize` and of all others, the costliest stage, peak memory, planes and polygons, and how far the model
lies from the true surfaces. Recordings made before are used again. It judges nothing: docs/hours.md quotes
it."""

import argparse
import os
import shutil
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import RIGS, json_of, run

# The corners of the office's corridor, meters.
START, CORNERS = (10.0, 6.2), [(23.8, 6.2), (23.8, 13.8), (6.2, 13.8), (6.2, 6.2)]
HEAD = ["laps", "min", "optimize, s", "rest, s", "most of it, s", "MB", "10^6 points (again)"]
HEAD += ["planes, polygons", "RMS of planes, mm"]
LAPS = [1, 4, 10, 16, 20, 40]


def record(work, laps, speed_m_s, rig):
    """The recording of so many laps, and its truth."""
    name = f"laps-{laps}-{speed_m_s:g}-{rig or 'default'}"
    recording, truth = work / f"{name}.mcap", work / f"{name}.truth"
    if recording.exists():
        return recording, truth
    corners = "\n".join(f"  [{x}, {y}]," for x, y in [START, *CORNERS * laps, (16.0, 6.2)])
    path = work / f"{name}.toml"
    path.write_text(f"speed_m_s = {speed_m_s}\nwaypoints_m = [\n{corners}\n]\n")
    capture = work / f"{name}.bytes.mcap"
    words = ["--world", "office", "--path", path, "-o", capture, "--truth", truth, "--force"]
    words += ["--rig", RIGS / f"{rig}.toml"] if rig else []
    run("biplane-mock", "simulate", *words)
    run("biplane-onboard", "--quiet", "replay", capture, "-o", recording)
    capture.unlink()
    return recording, truth


def minutes_of(trajectory):
    lines = [line for line in trajectory.read_text().splitlines() if not line.startswith("#")]
    return (float(lines[-1].split()[0]) - float(lines[0].split()[0])) / 60


def row(work, laps, speed_m_s, rig):
    model = work / f"laps-{laps}.model"
    recording, truth = record(work, laps, speed_m_s, rig)
    shutil.rmtree(model, ignore_errors=True)
    words = ["--no-report", "--threads", 1, "--formats", "ply", "--json"]
    summary = json_of("biplane", "--quiet", "build", recording, "-o", model, *words)
    seconds = {stage["stage"]: stage["cpu_s"] for stage in summary["stages"]}
    optimize = seconds.pop("optimize")
    costliest = max(seconds, key=seconds.get)
    off = json_of("biplane", "compare", model, "--truth", truth / "surfaces.ply", "--json")
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
    parser.add_argument("--speed", type=float, default=0.4, metavar="M_S")
    parser.add_argument("--rig", default="", help="one of hil-fixtures/rigs; left out: the default rig")
    words = parser.parse_args()
    os.makedirs(words.work, exist_ok=True)
    print(f"| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}")
    for laps in words.laps:
        row(words.work, laps, words.speed, words.rig)


main()
