#!/usr/bin/env python3
"""Hard buildings and campuses through import, replay, optimize and evaluate, and the loops against the truth.

    measure_large_buildings.py WORKDIR [NAME...] [--mixed FIRST LAST | --campus FIRST LAST] [--visits]
                               [--jobs N] [--gate]

Prints a row for each building: position error (root mean square, m) and relations error (mean, m and degrees)
before and after, the loops believed and how many of them are wrong, processor time of import, replay and
optimize, and the memory of optimize. A loop is wrong when its pose is off by more than ten of its own
standard deviations (at least 3 cm each way). With --gate ends with 1 when one is, or when a building's
position error is larger than its bound. Recordings made before are used again. Needs `biplane` and
`biplane-onboard` on PATH, and numpy.

--mixed   buildings and drives drawn at random instead, one for each seed from FIRST to LAST
--campus  the same of drives outdoors, by `make_campus_drive.py`
--visits  each building is visited twice: the first 60 % of the way, and on another day the last 60 %, with
          other noise. Both recordings are optimized together. The position error before is that of the
          visits each by itself (the larger one), the one after that of both in one frame, or again of each
          by itself when they stay apart."""

import argparse
import concurrent.futures
import csv
import json
import math
import os
import random
import statistics
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import np
from lib.carmen_log import Track
from lib.planar import read_numbers, seen_from
from lib.programs import json_of, run_check
from lib.verdict import fail

# Options of make_large_building.py, and the largest position error (m) after optimize, where a bound makes
# sense.
BUILDINGS = {
    "nested": ("--plan nested --seed 3", 0.3),
    "nested bare": ("--plan nested --structure bare --seed 4", None),
    "nested bare worn": ("--plan nested --structure bare --odometry worn --seed 5", None),
    "nested repeating worn": ("--plan nested --structure repeating --odometry worn --seed 6", 0.3),
    "nested twins worn": ("--plan nested --structure twins --odometry worn --seed 7", 0.3),
    "late worn": ("--plan late --odometry worn --seed 8", 0.3),
    "late bare worn people": ("--plan late --structure bare --odometry worn --people 6 --seed 9", None),
    "grid repeating": ("--plan grid --structure repeating --seed 10", 0.3),
    "grid twins worn people": ("--plan grid --structure twins --odometry worn --people 6 --seed 11", None),
    "nested worn glass 50 m irregular": (
        "--plan nested --odometry worn --glass 0.3 --range 50 --irregular --seed 12",
        0.5,
    ),
    "two hours": (
        "--plan nested --structure bare --odometry worn --people 4 --hours 2 --irregular --seed 13",
        None,
    ),
    "late repeating worn people irregular": (
        "--plan late --structure repeating --odometry worn --people 6 --irregular --seed 14",
        None,
    ),
    "late twins 50 m": ("--plan late --structure twins --range 50 --seed 15", 0.3),
}
VISITS = (("--part", 0, 0.6, "--drive", 1), ("--part", 0.4, 1, "--drive", 2))
BLUNDER_M = 0.1
MAKERS = ("accuracy/make_large_building.py", "worlds/make_campus_drive.py")


def mixed(seed):
    """A building and a drive drawn at random: title and options of make_large_building.py."""
    draw = random.Random(seed)
    options = {
        "plan": draw.choice(["grid", "nested", "late"]),
        "structure": draw.choice(["varied", "bare", "repeating", "twins"]),
        "odometry": draw.choice(["fair", "worn", "worn"]),
        "people": draw.choice([0, 0, 4, 6]),
        "glass": draw.choice([0, 0, 0, 0.3]),
        "range": draw.choice([79, 79, 79, 50]),
    }
    irregular = " --irregular" if draw.random() < 1 / 3 else ""
    words = " ".join(f"--{name} {value}" for name, value in options.items()) + irregular
    title = f"{seed} " + " ".join(str(value) for value in options.values()) + irregular.replace(" --", " ")
    return title, (f"{words} --seed {seed}", None)


def campus(seed):
    """A campus and a drive drawn at random: title and options of make_campus_drive.py."""
    draw = random.Random(seed)
    options = {
        "relief": draw.choice([0, 0.15, 0.3]),
        "shake": draw.choice([0, 0.1, 0.2]),
        "odometry": draw.choice(["fair", "worn"]),
        "beams": draw.choice([180, 180, 361]),
        "people": draw.choice([0, 0, 4]),
    }
    words = " ".join(f"--{name} {value}" for name, value in options.items())
    title = f"{seed} campus " + " ".join(str(value) for value in options.values())
    return title, (f"{words} --seed {seed}", None)


def timed(*words):
    """Runs a program; its output and processor seconds."""
    words = [str(word) for word in words]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode not in (0, 3):
        fail(f"`{' '.join(words)}` ended with exit code {process.returncode}")
    return output, usage.ru_utime + usage.ru_stime


def position_error(recording, truth):
    """Root mean square (m)."""
    found = json_of("biplane", "evaluate", "trajectory", truth, recording, "--json")
    return found["absolute"]["translation_m"]["rmse"]


def figures(recording, name):
    """Position error (m) and relations error (mean, m and degrees)."""
    relations = json_of("biplane", "evaluate", "relations", name + ".relations", recording, "--json")
    return (
        position_error(recording, name + ".truth"),
        relations["translation_m"]["mean"],
        relations["rotation_deg"]["mean"],
    )


def wrong(loops, truth):
    """Loops believed, and those of them that are wrong."""
    truth = Track(read_numbers(truth))
    counts = [0, 0]
    with open(loops) as table:
        for row in csv.DictReader(table):
            if row.pop("believed") != "1":
                continue
            value = {key: float(text) for key, text in row.items()}
            # Stamps are written with more digits here than there.
            one, other = (truth.rows[truth.nearest(value[end])][1:] for end in ("t1", "t2"))
            x, y, theta = seen_from(one, other)
            off = np.array([value["x"] - x, value["y"] - y, math.remainder(value["theta"] - theta, math.tau)])
            xx, xy, xt, yy, yt, tt = (value[key] for key in ("ixx", "ixy", "ixt", "iyy", "iyt", "itt"))
            counts[0] += 1
            counts[1] += int(off @ np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]]) @ off > 100)
    return counts


def replayed(name, options):
    """Makes the drive unless it is there, and replays it. The seconds of import and replay."""
    if not os.path.exists(name + ".relations"):
        # A building has no relief.
        run_check(MAKERS["--relief" in options], name, *options)
    log, imported, posed = (f"{name}.{ending}" for ending in ("log", "mcap", "run.mcap"))
    _, importing = timed("biplane", "--quiet", "import", "carmen", log, "-o", imported, "--force")
    _, replaying = timed("biplane-onboard", "--quiet", "replay", imported, "-o", posed, "--force")
    return importing, replaying


def optimized(name, recordings):
    """What `optimize` says, and its seconds."""
    said, seconds = timed(
        *("biplane", "--quiet", "optimize", *recordings, "-o", name + ".opt.mcap"),
        *("--loops", name + ".loops.csv", "--json", "--threads", 1, "--force"),
    )
    return json.loads(said), seconds


def one_drive(name, options):
    """Position, relations in meters and in degrees, before and after; what was said, seconds, the truth."""
    importing, replaying = replayed(name, options)
    said, optimizing = optimized(name, [name + ".run.mcap"])
    before, after = figures(name + ".run.mcap", name), figures(name + ".opt.mcap", name)
    return list(zip(before, after)), said, (importing, replaying, optimizing), name + ".truth"


def two_visits(name, options):
    """The same of two visits, with positions alone."""
    visits = [f"{name}.visit{number}" for number in (1, 2)]
    seconds = [replayed(visit, [*options, *part]) for visit, part in zip(visits, VISITS)]
    said, optimizing = optimized(name, [visit + ".run.mcap" for visit in visits])
    truth = name + ".visits.truth"
    Path(truth).write_text("".join(Path(visit + ".truth").read_text() for visit in visits))
    before = max(position_error(visit + ".run.mcap", visit + ".truth") for visit in visits)
    outputs = sorted({recording["output"] for recording in said["recordings"]})
    after = max(position_error(output, truth) for output in outputs)
    return [(before, after)], said, (*(sum(step) for step in zip(*seconds)), optimizing), truth


def building(args, title, options, bound):
    """Prints a row. Position error before and after, loops and wrong loops, whether it is as it should be."""
    name = os.path.join(args.work, title.replace(" ", "_"))
    errors, said, seconds, truth = (two_visits if args.visits else one_drive)(name, options.split())
    loops, false = wrong(name + ".loops.csv", truth)
    cells = [title]
    cells += [f"{one:.{digits}f} -> {other:.{digits}f}" for (one, other), digits in zip(errors, (2, 3, 2))]
    if args.visits:
        cells.append("joined" if all(recording["joined"] for recording in said["recordings"]) else "apart")
    cells += [loops, false, " + ".join(f"{step:.1f}" for step in seconds)]
    cells += [f"{said['peak_memory_bytes'] / 1e6:.0f}"]
    print("| " + " | ".join(str(cell) for cell in cells) + " |", flush=True)
    return errors[0], loops, false, false == 0 and (bound is None or errors[0][1] < bound)


def summary(rows):
    """One line about all rows."""
    after = [row[0][1] for row in rows]
    return (
        f"{len(rows)} drives: position error median {statistics.median(after):.3f} m, "
        f"mean {statistics.mean(after):.3f} m, worst {max(after):.3f} m, "
        f"over {BLUNDER_M} m {sum(error > BLUNDER_M for error in after)}; "
        f"loops {sum(row[1] for row in rows)}, wrong {sum(row[2] for row in rows)}"
    )


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("work")
    parser.add_argument("titles", nargs="*", metavar="NAME", help="; ".join(BUILDINGS))
    drawn = parser.add_mutually_exclusive_group()
    drawn.add_argument("--mixed", type=int, nargs=2, metavar=("FIRST", "LAST"))
    drawn.add_argument("--campus", type=int, nargs=2, metavar=("FIRST", "LAST"))
    parser.add_argument("--visits", action="store_true")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--gate", action="store_true")
    args = parser.parse_args()
    os.makedirs(args.work, exist_ok=True)
    head = ["building", "position (m)"]
    head += ["recordings"] if args.visits else ["relations (m)", "(deg)"]
    head += ["loops", "wrong", "processor time (s)", "MB"]
    print(f"| {' | '.join(head)} |\n{'|---' * len(head)}|", flush=True)
    if args.mixed or args.campus:
        draw, (first, last) = (mixed, args.mixed) if args.mixed else (campus, args.campus)
        wanted = dict(draw(seed) for seed in range(first, last + 1))
    else:
        wanted = {title: BUILDINGS[title] for title in args.titles or BUILDINGS}
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        rows = list(pool.map(lambda item: building(args, item[0], *item[1]), wanted.items()))
    print(summary(rows))
    sys.exit(1 if args.gate and not all(row[3] for row in rows) else 0)


main()
