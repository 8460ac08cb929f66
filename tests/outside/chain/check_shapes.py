#!/usr/bin/env python3
"""Are the round things of simulated halls and streets found, and nothing else?

    check_shapes.py DIR [--worlds hall,pillars] [--rigs paper,fast] [--seeds N] [--min-f1 F] [--flat]
        [--planes]

Each seed is another plan of the world and another noise. shapes.json of the build is held against truth.json
of the simulator. A cylinder is found when its axis runs within 10 cm of the true one and its radius differs
by no more than a quarter; the figures are of those. First the map is laid upon the truth by the poses of
the drive, as `biplane evaluate trajectory` does: where a whole map lies is not what this asks.
`pillars` has nothing round, `corridor` and `office` have
two and six things of which drives see little: there nothing of more than 100 points may be false, and what is
found is counted. With --flat, polygons are counted against the true flat faces.
With --planes, F of the planes with and without round things, of points whose true surface is known, and the
time that round things take. At the end a table. Only the standard library."""

import argparse
import array
import bisect
import json
import math
import statistics
import struct
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import RIGS, json_of, run, simulate
from lib.verdict import Tally, require

# A pose is compared with the true one that is nearest in time, within so many seconds.
MAX_APART_S = 0.01
NEAR_M, RADIUS_SHARE, FALSE_POINTS = 0.10, 0.25, 100
FEW_ROUND = ("pillars", "corridor", "office")
# A point is on the true surface that is nearest, when that is no further away; so many points are asked.
NEAR_SURFACE_M, ASKED = 0.08, 6000


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


def places_of(path):
    """Time, x and y of each pose of a trajectory."""
    return [[float(word) for word in line.split()[:3]] for line in path.read_text().splitlines()]


class Laid:
    """The turn and the shift that lay a map upon the truth, by least squares over the poses."""

    def __init__(self, truth_folder, model):
        truth = places_of(truth_folder / "poses.tum")
        times = [time for time, *_ in truth]
        pairs = []
        for time, *place in places_of(model / "trajectory.tum"):
            after = bisect.bisect(times, time)
            near = min(truth[max(0, after - 1) : after + 1], key=lambda pose: abs(pose[0] - time))
            if abs(near[0] - time) <= MAX_APART_S:
                pairs.append((complex(*place), complex(*near[1:])))
        require(len(pairs) > 1, f"{model}: no poses at the times of the truth")
        found, true = (sum(side) / len(pairs) for side in zip(*pairs))
        turn = sum((b - true) * (a - found).conjugate() for a, b in pairs)
        self.turn = turn / abs(turn)
        self.shift = true - self.turn * found

    def direction(self, v):
        """A direction of the map, in the truth."""
        turned = self.turn * complex(v[0], v[1])
        return [turned.real, turned.imag, v[2]]

    def point(self, p):
        """A point of the map, in the truth."""
        x, y, z = self.direction(p)
        return [x + self.shift.real, y + self.shift.imag, z]


class Found:
    """A cylinder of shapes.json, laid upon the truth."""

    def __init__(self, figures, laid):
        self.figures = figures
        self.radius = figures["radius_m"]
        self.direction = laid.direction(figures["axis_direction"])
        self.ends = [
            [p + figures[end] * d for p, d in zip(laid.point(figures["axis_point_m"]), self.direction)]
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


def true_surfaces(folder):
    """The triangles of the truth: three corners and the number of the plane, -1 for round ones."""
    head, body = (folder / "surfaces.ply").read_bytes().split(b"end_header\n", 1)
    lines = head.decode().splitlines()
    vertices = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    faces = next(int(line.split()[2]) for line in lines if line.startswith("element face"))
    corners = list(struct.iter_unpack("<3f", body[: 12 * vertices]))
    rows = struct.iter_unpack("<B3ii", body[12 * vertices : 12 * vertices + 17 * faces])
    return [([corners[k] for k in row[1:4]], row[4]) for row in rows]


def flat_faces(folder):
    """How many planes the truth has."""
    return len({plane for _, plane in true_surfaces(folder)} - {-1})


def near_triangle(p, corners, reach):
    """Distance from a point to a triangle's plane where its foot is in the triangle, or near it."""
    a, b, c = corners
    u, v, w = minus(b, a), minus(c, a), minus(p, a)
    uu, uv, vv, wu, wv = dot(u, u), dot(u, v), dot(v, v), dot(w, u), dot(w, v)
    area2 = uu * vv - uv * uv
    if area2 <= 0:
        return math.inf
    s, t = (wu * vv - wv * uv) / area2, (wv * uu - wu * uv) / area2
    margin = reach * math.sqrt(max(uu, vv) / area2)
    if min(s, t) < -margin or s + t > 1 + margin:
        return math.inf
    foot = [a[k] + s * u[k] + t * v[k] for k in range(3)]
    return length(minus(p, foot))


def true_plane(p, surfaces):
    """The plane on which a point is in truth; -1 for round things, None for nothing near."""
    best, label = NEAR_SURFACE_M, None
    for low, high, corners, plane in surfaces:
        if all(low[k] <= p[k] <= high[k] for k in range(3)):
            off = near_triangle(p, corners, 0.02)
            if off < best:
                best, label = off, plane
    return label


def plane_f(truth_of, labels):
    """F of points: good are those on the true plane that most of their plane's points are on."""
    votes = {}
    for number, truth in truth_of.items():
        if labels[number] >= 0:
            votes.setdefault(labels[number], {}).setdefault(truth, []).append(number)
    most = {plane: max(by.items(), key=lambda item: len(item[1])) for plane, by in votes.items()}
    good = sum(len(points) for truth, points in most.values() if truth is not None and truth >= 0)
    labeled = sum(len(points) for by in votes.values() for points in by.values())
    true = sum(truth is not None and truth >= 0 for truth in truth_of.values())
    return 2 * good / max(1, labeled + true)


def planes_of(truth_folder, model):
    """F of planes with and without the search for round things, and what that takes on top of the planes."""
    cloud = model / "points.ply"
    labels, share = {}, 0.0
    for words in ([], ["--no-shapes"]):
        folder = model / ("planes" + "".join(words))
        report = json_of("biplane", "planes", cloud, "-o", folder, "--force", "--json", *words)
        labels[not words] = array.array("i", (folder / "labels.bin").read_bytes())
        if not words:
            share = report["shapes_cpu_s"] / max(1e-9, report["cpu_s"])
    count = len(labels[True])
    head, body = cloud.read_bytes().split(b"end_header\n", 1)
    size = 24
    surfaces = []
    for corners, plane in true_surfaces(truth_folder):
        low = [min(c[k] for c in corners) - NEAR_SURFACE_M for k in range(3)]
        high = [max(c[k] for c in corners) + NEAR_SURFACE_M for k in range(3)]
        surfaces.append((low, high, corners, plane))
    asked = range(0, count, max(1, count // ASKED))
    truth_of = {k: true_plane(struct.unpack_from("<3f", body, size * k), surfaces) for k in asked}
    return plane_f(truth_of, labels[True]), plane_f(truth_of, labels[False]), share


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


def judge(folder, world, rig, seed, with_planes):
    """The figures of one drive."""
    truth_folder, model = drive(folder, world, rig, seed)
    truth = json.loads((truth_folder / "truth.json").read_text()).get("cylinders", [])
    laid = Laid(truth_folder, model)
    found = [Found(one, laid) for one in json.loads((model / "shapes.json").read_text())["cylinders"]]
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
    planes = planes_of(truth_folder, model) if with_planes else None
    if planes:
        with_rounds, without, share = planes
        print(
            f"   F of planes {with_rounds:.3f}, {without:.3f} without round things; "
            f"these take {100 * share:.0f} % on top",
            flush=True,
        )
    return {
        "planes": planes,
        "f1": f1,
        "pairs": len(pairs),
        "true": len(truth),
        "fine": len(fine),
        "placed": len(placed),
        "false": sum(one.figures["points"] > FALSE_POINTS for one in false),
        "polygons": polygons / flat_faces(truth_folder),
    }


HEAD = (
    "| world | rig | drives | F1, median | worst | radius good | axis good | false | polygons a face, median "
    "| worst | planes' F lost, worst | time on top, median |\n" + 12 * "|---" + "|"
)


def row_of(world, rig, all_figures):
    """A line of the table that docs/shapes.md has."""
    of = {key: [f[key] for f in all_figures] for key in all_figures[0]}
    share = [f"{100 * sum(of[key]) / max(1, sum(of['pairs'])):.0f} %" for key in ("fine", "placed")]
    lost, time = "-", "-"
    if all(of["planes"]):
        lost = f"{100 * max(1 - with_rounds / without for with_rounds, without, _ in of['planes']):.1f} %"
        time = f"{100 * statistics.median(share for *_, share in of['planes']):.0f} %"
    cells = [
        world,
        rig,
        len(all_figures),
        f"{statistics.median(of['f1']):.3f}",
        f"{min(of['f1']):.3f}",
        *share,
    ]
    cells += [
        sum(of["false"]),
        f"{statistics.median(of['polygons']):.2f}",
        f"{max(of['polygons']):.2f}",
        lost,
        time,
    ]
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


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
    parser.add_argument("--planes", action="store_true", help="F of planes too, and times")
    parser.add_argument("-v", action="store_true", help="a line for each thing")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    tally, table = Tally(), []
    for world in args.worlds.split(","):
        for rig in args.rigs.split(","):
            seeds = range(args.first, args.first + args.seeds)
            all_figures = [judge(args.folder, world, rig, seed, args.planes) for seed in seeds]
            worst = min(f["f1"] for f in all_figures)
            false = sum(f["false"] for f in all_figures)
            if world in FEW_ROUND:
                require(false == 0, f"{world} with the {rig} rig: {false} false cylinders")
                found, true = (sum(f[key] for f in all_figures) for key in ("pairs", "true"))
                drives = f"{found} of {true} found in {len(all_figures)} drives"
                tally.ok(f"{world}, {rig} rig: {drives}, none false")
                continue
            table.append(row_of(world, rig, all_figures))
            require(worst >= args.min_f1, f"{world}, {rig} rig: F1 {worst:.3f} below {args.min_f1}")
            faces = max(f["polygons"] for f in all_figures)
            require(not args.flat or faces <= 1.5, f"{faces:.2f} polygons for each true face")
            tally.ok(f"{world}, {rig} rig: F1 at least {args.min_f1}")
    if table:
        print("\n".join([HEAD, *table]))
    tally.end()


main()
