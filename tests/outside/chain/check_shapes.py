#!/usr/bin/env python3
"""Are the round things of simulated halls and streets found, and nothing else?

    check_shapes.py DIR [--worlds hall,pillars] [--rigs paper,fast] [--seeds N] [--min-f1 F] [--flat]

Each seed is another plan of the world and another noise. shapes.json of the build is held against truth.json
of the simulator. A cylinder is found when its axis runs within 10 cm of the true one and its radius differs
by no more than a quarter; the figures are of those. `pillars` has nothing round: whatever has more than 100
points is false. With --flat, polygons are counted against the true flat faces. Only the standard library."""

import argparse
import json
import math
import statistics
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import RIGS, run, simulate
from lib.verdict import Tally, require

NEAR_M, RADIUS_SHARE, FALSE_POINTS = 0.10, 0.25, 100
WITHOUT_TRUTH = "pillars"


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def length(a):
    return math.sqrt(dot(a, a))


def off_axis(point, start, direction):
    """Distance of a point from an axis, and its place along it."""
    off = minus(point, start)
    along = dot(off, direction)
    return length(minus(off, [along * x for x in direction])), along


class Found:
    """A cylinder of shapes.json."""

    def __init__(self, figures):
        self.figures = figures
        self.radius = figures["radius_m"]
        self.direction = figures["axis_direction"]
        self.ends = [
            [p + figures[end] * d for p, d in zip(figures["axis_point_m"], self.direction)]
            for end in ("seen_from_m", "seen_to_m")
        ]


def errors(found, true):
    """Axis (m), direction (degrees) and radius (m) against a true cylinder; None when it is another one."""
    span = minus(true["axis_to_m"], true["axis_from_m"])
    direction = [x / length(span) for x in span]
    middle = [(a + b) / 2 for a, b in zip(*found.ends)]
    off, along = off_axis(middle, true["axis_from_m"], direction)
    angle = math.degrees(math.acos(min(1.0, abs(dot(direction, found.direction)))))
    radius = abs(found.radius - true["radius_m"])
    same_side = found.figures["seen_from"] == true["seen_from"]
    inside = -0.3 <= along <= length(span) + 0.3
    near = off <= max(NEAR_M, 0.1 * true["radius_m"]) and radius <= RADIUS_SHARE * true["radius_m"]
    return (off, angle, radius) if same_side and inside and near and angle < 10 else None


def score(found, truth):
    """Pairs with their errors, and what is left on both sides."""
    pairs, left = [], list(truth)
    false = []
    for one in sorted(found, key=lambda f: -f.figures["points"]):
        near = [(errors(one, true), true) for true in left]
        near = [(error, true) for error, true in near if error]
        if near:
            error, true = min(near, key=lambda pair: pair[0][0])
            left.remove(true)
            pairs.append((one, true, error))
        else:
            false.append(one)
    return pairs, left, false


def flat_faces(folder):
    """How many planes the truth has."""
    data = (folder / "surfaces.ply").read_bytes()
    head, body = data.split(b"end_header\n", 1)
    lines = head.decode().splitlines()
    vertices = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    faces = next(int(line.split()[2]) for line in lines if line.startswith("element face"))
    size = 24 if any("double x" in line for line in lines) else 12
    planes, at = set(), vertices * size
    for _ in range(faces):
        planes.add(int.from_bytes(body[at + 13 : at + 17], "little", signed=True))
        at += 17
    return len(planes - {-1})


def drive(folder, world, rig, seed):
    """A drive through a plan of a world, recorded and built."""
    plan = world if seed == 1 or world in ("corridor", "office", "building") else f"{world}-{seed}"
    name = f"{plan}.{rig}.{seed}"
    capture, truth, recording, model = (folder / f"{name}.{end}" for end in ("cap", "truth", "mcap", "model"))
    if not recording.exists():
        simulate(plan, capture, truth, rig=RIGS / f"{rig}.toml", seed=seed)
        run("biplane-onboard", "replay", capture, "-o", recording, capture_output=True)
        capture.unlink()
    quiet = {"capture_output": True}
    run("biplane", "build", recording, "-o", model, "--formats", "none", "--no-report", "--force", **quiet)
    return truth, model


def judge(folder, world, rig, seed):
    """The figures of one drive."""
    truth_folder, model = drive(folder, world, rig, seed)
    truth = json.loads((truth_folder / "truth.json").read_text())["cylinders"]
    found = [Found(one) for one in json.loads((model / "shapes.json").read_text())["cylinders"]]
    pairs, missed, false = score(found, truth)
    polygons = json.loads((model / "summary.json").read_text())["polygons"]
    fine = [p for p in pairs if p[2][2] <= max(0.01, 0.05 * p[1]["radius_m"])]
    placed = [p for p in pairs if p[2][0] <= 0.015 and p[2][1] <= 1.0]
    f1 = 2 * len(pairs) / max(1, 2 * len(pairs) + len(missed) + len(false))
    print(
        f"{world} {rig} {seed}: {len(pairs)} of {len(truth)} found, {len(false)} false, F1 {f1:.3f}; "
        f"radius good {len(fine)}, axis good {len(placed)}; {polygons} polygons, "
        f"{flat_faces(truth_folder)} true faces",
        flush=True,
    )
    for one, true, (off, angle, radius) in pairs:
        if "-v" in sys.argv:
            print(
                f"   {true['kind']} as {one.figures['kind']}: r {true['radius_m']:.3f}, "
                f"off {100 * radius:.1f} cm; "
                f"axis {100 * off:.1f} cm, {angle:.2f} deg; {one.figures['points']} points"
            )
    for true in missed:
        at = [round(v, 2) for v in true["axis_from_m"]]
        print(f"   missed: {true['kind']} of {true['radius_m']:.3f} m at {at}")
    for one in false:
        at = [round(v, 2) for v in one.ends[0]]
        f = one.figures
        print(
            f"   false: {f['kind']} of {one.radius:.3f} m at {at}, {f['points']} points, "
            f"arc {f['seen_arc_deg']}"
        )
    return {
        "f1": f1,
        "pairs": len(pairs),
        "fine": len(fine),
        "placed": len(placed),
        "false": sum(one.figures["points"] > FALSE_POINTS for one in false),
        "polygons": polygons / flat_faces(truth_folder),
    }


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--worlds", default="hall,pillars")
    parser.add_argument("--rigs", default="fast,paper")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--min-f1", type=float, default=0.8, help="of the worst drive with round things")
    parser.add_argument("--flat", action="store_true", help="polygons are bounded by 1.5 times the faces")
    parser.add_argument("-v", action="store_true", help="a line for each thing")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    tally = Tally()
    for world in args.worlds.split(","):
        for rig in args.rigs.split(","):
            seeds = range(args.first, args.first + args.seeds)
            all_figures = [judge(args.folder, world, rig, seed) for seed in seeds]
            worst = min(f["f1"] for f in all_figures)
            pairs = sum(f["pairs"] for f in all_figures)
            false = sum(f["false"] for f in all_figures)
            if world == WITHOUT_TRUTH:
                require(false == 0, f"{world} with the {rig} rig: {false} false cylinders")
                tally.ok(f"{world}, {rig} rig: nothing round in {len(all_figures)} drives")
                continue
            print(
                f"{world}, {rig} rig, {len(all_figures)} drives: F1 median "
                f"{statistics.median(f['f1'] for f in all_figures):.3f}, worst {worst:.3f}; radius good "
                f"{100 * sum(f['fine'] for f in all_figures) / max(1, pairs):.0f} %, axis good "
                f"{100 * sum(f['placed'] for f in all_figures) / max(1, pairs):.0f} %, {false} false; "
                f"polygons per "
                f"face up to {max(f['polygons'] for f in all_figures):.2f}"
            )
            require(worst >= args.min_f1, f"{world}, {rig} rig: F1 {worst:.3f} below {args.min_f1}")
            faces = max(f["polygons"] for f in all_figures)
            require(not args.flat or faces <= 1.5, f"{faces:.2f} polygons for each true face")
            tally.ok(f"{world}, {rig} rig: F1 at least {args.min_f1}")
    tally.end()


main()
