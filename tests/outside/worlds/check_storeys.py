#!/usr/bin/env python3
"""Two drives, each through a plan of its own, are two storeys of one building.

    check_storeys.py [--plans LOWER UPPER] [--seed N] [--floor M] [--work DIR]

Needs the three programs on PATH, and ifcopenshell, shapely, numpy, scipy. Each plan (worlds/plans.toml) is
driven through by `biplane-mock simulate`. `biplane build --no-optimize --floor-z UPPER=M` of both recordings
has to find in each storey what a build of its recording alone finds: the same rooms, walls and openings, M
higher; and inferred floors at both heights. model.ifc has two storeys at their heights, each with its own
spaces and walls. `compare --model-storey` takes each by itself."""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import ifcopenshell
import shapely

from lib.programs import json_of, run, run_check
from lib.verdict import Tally, require

# Areas of rooms, shares of the smaller one; heights and widths, meters.
SAME_SHARE, SAME_M = 0.01, 0.03


def recorded(plan, seed, work):
    """A drive through a plan, as a recording."""
    folder = work / plan
    folder.mkdir(parents=True, exist_ok=True)
    run_check("worlds/make_plan_world.py", plan, "--seed", str(seed), "-o", str(folder))
    quiet = {"capture_output": True}
    world, path = folder / plan / "world.obj", folder / plan / "path.toml"
    words = ["--world", world, "--path", path, "--seed", seed, "-o", folder / "bytes.mcap"]
    run("biplane-mock", "simulate", *words, "--truth", folder / "truth", "--force", **quiet)
    run("biplane-onboard", "replay", folder / "bytes.mcap", "-o", folder / "run.mcap", "--force", **quiet)
    return folder / "run.mcap"


def built(recordings, folder, *words):
    """A build: building.json, and the inferred surfaces of model.json."""
    words = [*recordings, "-o", folder, "--force", "--no-report", "--formats", "ifc,cityjson,dxf", *words]
    run("biplane", "build", *words, capture_output=True)
    model = json.loads((folder / "model.json").read_text())["model"]
    return json.loads((folder / "building.json").read_text()), model.get("inferred", [])


def own(things, storey):
    return [thing for thing in things if thing["id"].split("-")[0] == storey]


def same_rooms(alone, joint, up_m):
    """Every room has one in the other building that is the same, at its height."""
    require(len(alone) == len(joint), f"{len(joint)} rooms, alone {len(alone)}")
    for a in alone:
        area = shapely.Polygon(a["outline_m"])
        shared = [area.intersection(shapely.Polygon(b["outline_m"])).area for b in joint]
        best = joint[shared.index(max(shared))]
        off = abs(best["area_m2"] - a["area_m2"]) / a["area_m2"]
        require(
            off < SAME_SHARE and max(shared) > (1 - SAME_SHARE) * area.area, f"{best['id']} is no {a['id']}"
        )
        for key in ("floor_z_m", "ceiling_z_m"):
            require(abs(best[key] - up_m - a[key]) < SAME_M, f"{best['id']}: {key} is {best[key]}")


def check_storey(tally, alone, joint, storey, up_m):
    building, _ = alone
    rooms = own(joint["rooms"], storey)
    same_rooms(building["rooms"], rooms, up_m)
    for key in ("walls", "openings"):
        counts = len(building[key]), len(own(joint[key], storey))
        require(abs(counts[0] - counts[1]) <= 1, f"{storey}: {counts[1]} {key}, alone {counts[0]}")
    for opening in own(joint["openings"], storey):
        require(opening["center_m"][2] > up_m, f"{opening['id']} is under its floor")
    tally.ok(f"{storey}: {len(rooms)} rooms at {up_m} m, as in a build of its own recording")


def check_compared(tally, folder, alone, storey, rooms):
    """`compare` of a storey with what its recording alone gives; a model of two storeys is asked which."""
    words = ["biplane", "compare", folder, "--building", alone]
    found = json_of(*words, "--model-storey", storey, "--json")["rooms"]["as_drawn"]
    require(found["true"] == found["model"] == found["matched"] == rooms, f"{storey}: {found}")
    asked = subprocess.run(words, capture_output=True, text=True, check=False)
    require(asked.returncode == 1 and "S1, S2" in asked.stderr, f"not asked for the storey: {asked}")
    tally.ok(f"{storey}: compared by itself, {rooms} of {rooms} rooms are the same")


def check_ifc(tally, path, floors_m, joint):
    model = ifcopenshell.open(path)
    storeys = sorted(model.by_type("IfcBuildingStorey"), key=lambda storey: storey.Elevation)
    heights = [storey.Elevation for storey in storeys]
    require(
        len(heights) == 2 and all(abs(a - b) < 1e-6 for a, b in zip(heights, floors_m)),
        f"storeys at {heights}",
    )
    for number, storey in enumerate(storeys):
        name = f"S{number + 1}"
        spaces = [space.Name for whole in storey.IsDecomposedBy for space in whole.RelatedObjects]
        wanted = [room["id"] for room in own(joint["rooms"], name)]
        require(sorted(spaces) == wanted, f"{name} has {spaces}, expected {wanted}")
        held = [thing for rel in storey.ContainsElements for thing in rel.RelatedElements]
        walls = sorted(thing.Name for thing in held if thing.is_a("IfcWall"))
        require(
            walls == sorted(wall["id"] for wall in own(joint["walls"], name)), f"{name} has the walls {walls}"
        )
    tally.ok("model.ifc has two storeys with their own spaces and walls")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--plans", nargs=2, default=["two-rooms", "heights"])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--floor", type=float, default=3.6)
    parser.add_argument("--work", type=Path)
    options = parser.parse_args()
    work = options.work or Path(tempfile.mkdtemp(prefix="storeys-"))
    runs = [recorded(plan, options.seed, work) for plan in options.plans]
    alone = [built([each], work / f"alone-{number}", "--no-optimize") for number, each in enumerate(runs)]
    words = ["--no-optimize", "--floor-z", f"{runs[1]}={options.floor}"]
    joint, inferred = built(runs, work / "joint", *words)
    tally = Tally()
    floors_m = [0.0, options.floor]
    require([storey["floor_z_m"] for storey in joint["storeys"]] == floors_m, f"storeys: {joint['storeys']}")
    for number, floor_m in enumerate(floors_m):
        check_storey(tally, alone[number], joint, f"S{number + 1}", floor_m)
        rooms = len(alone[number][0]["rooms"])
        path = work / f"alone-{number}/building.json"
        check_compared(tally, work / "joint", path, f"S{number + 1}", rooms)
    floors = {surface["offset_m"] for surface in inferred if surface["kind"] == "floor"}
    require(floors == set(floors_m), f"inferred floors at {floors}")
    bases = [surface for surface in inferred if surface["kind"] == "wall_base"]
    low = {surface["part_of"][:2]: min(p[2] for p in surface["outer_m"]) for surface in bases}
    require(low.keys() == {"S1", "S2"}, f"bases of {low.keys()}")
    require(
        all(abs(low[f"S{k + 1}"] - floor) < 0.02 for k, floor in enumerate(floors_m)), f"bases from {low}"
    )
    tally.ok("floors and bases of walls are inferred in both")
    check_ifc(tally, work / "joint/model.ifc", floors_m, joint)
    run_check("formats/check_building.py", work / "joint")
    run_check("formats/check_cityjson.py", work / "joint/model.city.json")
    run_check("formats/check_dxf.py", work / "joint")
    tally.end()


if __name__ == "__main__":
    main()
