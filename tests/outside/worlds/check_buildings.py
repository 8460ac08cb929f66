#!/usr/bin/env python3
"""Are rooms, walls, doors and windows found in simulated drives through known buildings?

    check_buildings.py [--ifc FILE.ifc[:STOREY]]... [--set develop|gate] [--plan NAME]... [--seeds N]
                       [--rig RIG.toml] [--work DIR] [--json] [--rooms F1] [--area SHARE] [--doors F1]
                       [--windows F1] [--inner SHARE] [--thickness M] [--walls RATIO] [--size M]

Needs the three programs on PATH, and shapely, numpy, scipy for the plans (worlds/plans.toml). For each
building and seed: `biplane-mock simulate` (of IFC files, doors open), `biplane-onboard replay`, `biplane
build`, `biplane compare --building` with the truth. A table: a line for each building, the worst of its
seeds, and the mean of all. Rooms are those with open plans merged. Bounds, where they are given, hold for
the mean of all but --area, --thickness and --size, which hold for the median of all. Exit code 1 when one
is missed."""

import argparse
import json
import statistics
import sys
import tempfile
import tomllib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import OUTSIDE, json_of, run, run_check
from lib.verdict import fail

PLANS = OUTSIDE / "worlds/plans.toml"
COLUMNS = {
    "rooms": ("rooms F1", lambda f: f["rooms"]["merged"]["f1"]),
    "area": ("area", lambda f: f["rooms"]["area_error"]["median"]),
    "doors": ("doors F1", lambda f: f["openings"]["doors"]["f1"]),
    "windows": ("windows F1", lambda f: f["openings"]["windows"]["f1"]),
    "inner": ("inner walls", lambda f: share(f["walls"]["found_inner"], f["walls"]["true_inner"])),
    "traced": ("traced", lambda f: share(f["walls"]["traced"], f["walls"]["true"])),
    "thickness": ("thickness", lambda f: f["walls"]["thickness_error_m"]["median"]),
    "wrong": ("wrong", lambda f: f["walls"]["thickness_wrong"]),
    "walls": ("walls/true", lambda f: f["walls"]["model_per_true"]),
    "size": ("width", lambda f: f["openings"]["width_error_m"]["median"]),
    "complete": ("complete", lambda f: f["surfaces"]["completeness"]),
    "correct": ("correct", lambda f: f["surfaces"]["correctness"]),
}
# What is better when it is larger; of all else the smaller is better.
LARGER = ("rooms", "doors", "windows", "inner", "traced", "complete", "correct")
MEDIANS = ("area", "thickness", "size")


def share(part, whole):
    return part / whole if whole else None


def drive(name, seed, options, work):
    """One drive through one building: the figures of the comparison."""
    folder = work / f"{name}-{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    rig = ["--rig", options.rig] if options.rig else []
    words = ["--seed", seed, "-o", folder / "bytes.mcap", "--truth", folder / "truth", "--force", *rig]
    if name in options.files:
        path, storey = options.files[name]
        truth = folder / "truth/truth.json"
        words += ["--world", path, "--storey", storey, "--doors", "open"]
    else:
        run_check("worlds/make_plan_world.py", name, "--seed", str(seed), "-o", str(folder))
        truth = folder / name / "truth.json"
        words += ["--world", folder / name / "world.obj", "--path", folder / name / "path.toml"]
    quiet = {"capture_output": True}
    run("biplane-mock", "simulate", *words, **quiet)
    run("biplane-onboard", "replay", folder / "bytes.mcap", "-o", folder / "run.mcap", "--force", **quiet)
    run("biplane", "build", folder / "run.mcap", "-o", folder / "model", "--force", **quiet)
    return json_of("biplane", "compare", folder / "model", "--building", truth, "--json")


def worst(key, values):
    known = [value for value in values if value is not None]
    return (min if key in LARGER else max)(known, default=None)


def mean(key, values):
    known = [value for value in values if value is not None]
    return (statistics.median if key in MEDIANS else statistics.fmean)(known) if known else None


def line(name, row):
    cells = (f"{'-':>11}" if value is None else f"{value:>11.3f}" for value in row.values())
    print(f"{name:<18}" + "".join(cells), flush=True)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--ifc", action="append", default=[])
    parser.add_argument("--set", choices=["develop", "gate"])
    parser.add_argument("--plan", action="append", default=[])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--rig", type=Path)
    parser.add_argument("--work", type=Path)
    parser.add_argument("--json", action="store_true")
    for bound in ("rooms", "area", "doors", "windows", "inner", "thickness", "walls", "size"):
        parser.add_argument(f"--{bound}", type=float)
    options = parser.parse_args()
    files = (text.rpartition(":") if text[-1].isdigit() else (text, ":", "0") for text in options.ifc)
    options.files = {Path(path).stem: (path, int(storey)) for path, _, storey in files}
    plans = tomllib.loads(PLANS.read_text())
    names = [*options.files, *options.plan, *(n for n, plan in plans.items() if plan["set"] == options.set)]
    work = options.work or Path(tempfile.mkdtemp(prefix="buildings-"))
    figures = {
        name: [drive(name, seed + 1, options, work) for seed in range(options.seeds)] for name in names
    }
    if options.json:
        print(json.dumps(figures, indent=1))
    else:
        print(f"{'':<18}" + "".join(f"{title:>11}" for title, _ in COLUMNS.values()))
        for name, runs in figures.items():
            line(name, {key: worst(key, map(of, runs)) for key, (_, of) in COLUMNS.items()})
    every = [run_ for runs in figures.values() for run_ in runs]
    whole = {key: mean(key, [of(run_) for run_ in every]) for key, (_, of) in COLUMNS.items()}
    line("all", whole)
    for key in COLUMNS:
        bound, value = getattr(options, key, None), whole[key]
        if bound is not None and (value is None or (value < bound if key in LARGER else value > bound)):
            fail(f"{COLUMNS[key][0]} of all buildings: {value}, expected {bound} or better")


if __name__ == "__main__":
    main()
