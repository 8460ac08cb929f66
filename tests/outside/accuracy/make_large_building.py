#!/usr/bin/env python3
"""A drive of 1.6 km through a large building, as somebody else's robot would have logged it, with its truth.

    make_large_building.py NAME --seed N [--plan P] [--structure S] [--odometry O] [--people N]
                           [--glass SHARE] [--range M] [--hours H] [--irregular] [--part FROM TO] [--drive N]

Writes NAME.log (CARMEN: 180 beams of 1.5 cm noise; odometry 1 % long, 2 % in turning and 0.3 degrees a meter
off), NAME.truth (lines "t x y theta") and NAME.relations (lines "t1 t2 x y z roll pitch yaw", pose 2 seen
from pose 1: places 2.8 m apart on the way, and places passed again within 1.5 m). The building is 250 m by
110 m: six corridors of 2.6 m with niches, pillars and rooms, driven through twice with other turns. For
`biplane import carmen`, `biplane-onboard replay`, `biplane optimize` and `biplane evaluate`. Needs numpy.

plan       grid: as above. nested: 1.9 km, once around all (700 m) before anything is seen again, then rings
           within. late: up and down the long corridors; the first place seen again comes after 900 m.
structure  varied: something every 2 to 7 m. bare: every 15 to 45 m. repeating: the same door every 4 m and
           pillar every 8 m everywhere, and a room every 30 to 60 m. twins: all long corridors alike, and all
           short ones.
odometry   fair: as above. worn: 5 % long, 1 to 2 degrees a meter off, with slips of up to 15 degrees and
           counters that stand still.
"""

import argparse
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import np

HALF_WIDTH_M = 1.3
# Where corridors lie, and crossings (column, row) in the order of the way.
PLANS = {
    "grid": (
        (0, 90, 170, 250),
        (0, 60, 110),
        [
            (0, 0),
            (1, 0),
            (2, 0),
            (3, 0),
            (3, 1),
            (3, 2),
            (2, 2),
            (1, 2),
            (0, 2),
            (0, 1),
            (0, 0),
            (1, 0),
            (1, 1),
            (2, 1),
            (2, 0),
            (3, 0),
            (3, 1),
            (2, 1),
            (2, 2),
            (1, 2),
            (1, 1),
            (0, 1),
            (0, 0),
        ],
    ),
    "nested": (
        (0, 60, 150, 250),
        (0, 50, 100),
        [
            (0, 0),
            (3, 0),
            (3, 2),
            (0, 2),
            (0, 0),
            (1, 0),
            (1, 2),
            (2, 2),
            (2, 0),
            (3, 0),
            (3, 1),
            (0, 1),
            (0, 0),
            (1, 0),
            (1, 1),
            (2, 1),
            (2, 2),
        ],
    ),
    "late": (
        (0, 60, 150, 250),
        (0, 50, 100),
        [
            (0, 0),
            (3, 0),
            (3, 1),
            (0, 1),
            (0, 2),
            (3, 2),
            (3, 0),
            (1, 0),
            (1, 2),
            (2, 2),
            (2, 0),
            (0, 0),
            (0, 1),
            (1, 1),
        ],
    ),
}
STEP_M, STEP_S = 0.14, 0.2
NO_RETURN_M, NOISE_M = 81.83, 0.015
ANGLES = np.radians(np.arange(180) - 90.0)


class Varied:
    """What a wall has along it: where the next thing comes, its kind, length and depth."""

    def __init__(self, random):
        self.random = random

    def plain_m(self, at):
        return self.random.uniform(2, 7)

    def thing(self, at):
        kind, long = self.random.integers(0, 4), self.random.uniform(0.9, 1.3)
        if kind == 3:
            return 0.4, -0.25
        return long, self.random.choice([0.12, 0.2, 0.3]) if kind < 2 else self.random.uniform(2.5, 5)


class Bare(Varied):
    def plain_m(self, at):
        return self.random.uniform(15, 45)


class Repeating(Varied):
    """Doors at multiples of 4 m, pillars between every second pair, now and then a room instead of a door."""

    def __init__(self, random):
        super().__init__(random)
        self.room = random.uniform(30, 60)

    def plain_m(self, at):
        return 2 - at % 2 if at % 2 else 2

    def thing(self, at):
        if round(at) % 8 == 2:
            return 0.4, -0.25
        if round(at) % 4 != 0:
            return 0.5, 0
        self.room -= 4
        if self.room < 0:
            self.room = self.random.uniform(30, 60)
            return self.random.uniform(0.9, 1.3), self.random.uniform(2.5, 5)
        return 1.0, 0.15


def wall(things, fixed, low, high, vertical, side, crossings):
    """One side of a corridor, open where others cross, with what stands along it."""
    lines = []

    def line(a, off_a, b, off_b):
        one, other = fixed + side * (HALF_WIDTH_M + off_a), fixed + side * (HALF_WIDTH_M + off_b)
        lines.append((one, a, other, b) if vertical else (a, one, b, other))

    gaps = [crossing + turn * HALF_WIDTH_M for crossing in sorted(crossings) for turn in (-1, 1)]
    ends = [low, *gaps, high]
    for start, end in zip(ends[::2], ends[1::2]):
        at = start
        while at < end:
            stop = min(end, at + things.plain_m(at))
            line(at, 0, stop, 0)
            at = stop
            if at + 1.2 >= end - 0.5:
                continue
            long, deep = things.thing(at)
            line(at, 0, at, deep)
            line(at, deep, at + long, deep)
            line(at + long, deep, at + long, 0)
            at += long
    return lines


def building(random, plan, structure, seed):
    """All walls, a row (x, y, x, y) each."""
    columns, rows, _ = PLANS[plan]
    kind = {"bare": Bare, "repeating": Repeating}.get(structure, Varied)
    every = kind(random)

    def things(vertical, side):
        return Varied(np.random.default_rng([seed, vertical, side + 1])) if structure == "twins" else every

    lines = []
    left, right = columns[0] - HALF_WIDTH_M, columns[-1] + HALF_WIDTH_M
    for row in rows:
        for side in (-1, 1):
            crossed = row < rows[-1] if side > 0 else row > rows[0]
            lines += wall(things(False, side), row, left, right, False, side, columns if crossed else ())
        lines += [(x, row - HALF_WIDTH_M, x, row + HALF_WIDTH_M) for x in (left, right)]
    for column in columns:
        for side in (-1, 1):
            for low, high in zip(rows[:-1], rows[1:]):
                lines += wall(
                    things(True, side), column, low + HALF_WIDTH_M, high - HALF_WIDTH_M, True, side, ()
                )
    return np.array(lines)


def poses(plan):
    """The way, rounded at corners, not quite straight: positions and headings."""
    columns, rows, way = PLANS[plan]
    corners = [(columns[column], rows[row]) for column, row in way]
    points = []
    for a, b in zip(corners[:-1], corners[1:]):
        steps = int(math.dist(a, b) / STEP_M)
        points += [np.add(a, np.subtract(b, a) * step / steps) for step in range(steps)]
    padded = np.pad(np.array(points + [corners[-1]]), ((4, 4), (0, 0)), "edge")
    smooth = np.column_stack([np.convolve(axis, np.ones(9) / 9, "valid") for axis in padded.T])
    count = np.arange(len(smooth))
    smooth += 0.12 * np.column_stack([np.sin(count / 37), np.cos(count / 53)])
    ahead = np.gradient(smooth, axis=0)
    return smooth, np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0])) + 0.03 * np.sin(count / 11)


def schedule(random, positions, headings, hours, irregular):
    """When the scans were taken: positions and headings (some twice, where the robot stood; some left out)
    and times."""
    chosen = np.arange(len(positions))
    if hours:
        stands = np.ones(len(chosen), dtype=int)
        for place in random.integers(0, len(chosen), 20):
            stands[place] += random.integers(50, 250)
        chosen = np.repeat(chosen, stands)
    step_s = hours * 3600 / len(chosen) if hours else STEP_S
    times = step_s * np.arange(len(chosen))
    if irregular:
        times = times + random.uniform(-0.45, 0.45, len(times)) * step_s
        kept = random.random(len(chosen)) > 0.05
        for gap in random.integers(0, len(chosen), len(chosen) // 800):
            kept[gap : gap + random.integers(4, 12)] = False
        kept[0] = True
        chosen, times = chosen[kept], times[kept]
    return positions[chosen], headings[chosen], times


class People:
    """People who walk along the way near the robot: boxes of 0.35 m."""

    def __init__(self, random, count, positions):
        self.random, self.positions = random, positions
        self.walkers = [self.someone() for _ in range(count)]

    def someone(self):
        return [
            self.random.uniform(-60, 90),
            self.random.uniform(-0.9, 0.9),
            self.random.choice([-2.7, -1.8, -1, 0.7, -0.3]),
        ]

    def lines(self, number):
        found = []
        for index, (ahead, beside, speed) in enumerate(self.walkers):
            self.walkers[index][0] += speed
            place = number + int(ahead)
            if abs(ahead) > 100 or not 0 <= place < len(self.positions) - 1:
                self.walkers[index] = self.someone()
                continue
            at, way = self.positions[place], self.positions[place + 1] - self.positions[place]
            across = np.array([-way[1], way[0]]) / max(np.hypot(*way), 1e-9)
            x, y = at + beside * across
            if np.hypot(*(self.positions[number] - (x, y))) < 0.5:
                continue
            r = 0.175
            found += [
                (x - r, y - r, x + r, y - r),
                (x + r, y - r, x + r, y + r),
                (x + r, y + r, x - r, y + r),
                (x - r, y + r, x - r, y - r),
            ]
        return np.array(found).reshape(-1, 4)


def scan(random, walls, at, heading, longest_m, glass=None):
    """Ranges of one scan. `glass` draws which beams go missing at which walls."""
    middle, half = (walls[:, :2] + walls[:, 2:]) / 2, np.hypot(*(walls[:, 2:] - walls[:, :2]).T) / 2
    is_near = np.hypot(*(middle - at).T) - half < longest_m + 1
    near = walls[is_near]
    dx, dy = np.cos(ANGLES + heading)[:, None], np.sin(ANGLES + heading)[:, None]
    (ex, ey), (wx, wy) = (near[:, 2:] - near[:, :2]).T, (near[:, :2] - at).T
    across = dx * ey - dy * ex
    with np.errstate(all="ignore"):
        ranges, along = (wx * ey - wy * ex) / across, (wx * dy - wy * dx) / across
        ranges = np.where((ranges > 0) & (along >= -1e-9) & (along <= 1 + 1e-9), ranges, np.inf)
    hit, ranges = ranges.argmin(1), ranges.min(1)
    ranges += random.normal(0, NOISE_M, len(ANGLES))
    if glass is not None:
        draw, is_glass = glass
        is_glass = np.pad(is_glass, (0, len(walls) - len(is_glass)))
        ranges[is_glass[is_near][hit] & (draw.random(len(ANGLES)) < 0.7)] = np.inf
    return np.where(ranges > longest_m, NO_RETURN_M if longest_m > 50 else longest_m, ranges)


class Odometry:
    """Counts of the wheels, added up."""

    def __init__(self, random, worn, rare):
        self.random, self.worn, self.rare = random, worn, rare
        self.x, self.y, self.turned, self.still = 0.0, 0.0, 0.0, 0
        self.drift = rare.choice([-1, 1]) * rare.uniform(1, 2)

    def move(self, moved, before, heading):
        random = self.random
        ahead = (
            (math.cos(before) * moved[0] + math.sin(before) * moved[1])
            * (1.05 if self.worn else 1.01)
            * (1 + random.normal(0, 0.03))
        )
        left = -math.sin(before) * moved[0] + math.cos(before) * moved[1] + random.normal(0, 0.002)
        drift = math.radians(self.drift if self.worn else 0.3) * abs(ahead) + random.normal(0, 0.003)
        turn = (heading - before) * 1.02 + drift
        if self.worn and (moved != 0).any():
            turn += math.radians(self.rare.uniform(-15, 15)) if self.rare.random() < 0.001 else 0
            self.still = 5 if self.rare.random() < 0.0005 else self.still - 1
            if self.still > 0:
                return
        self.x += math.cos(self.turned) * ahead - math.sin(self.turned) * left
        self.y += math.sin(self.turned) * ahead + math.cos(self.turned) * left
        self.turned += turn


def relations(positions, headings, times):
    """Pairs of scans: 20 apart, and passed again."""
    cells = {}
    moved = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(positions, axis=0).T))])
    last, kept = -10.0, -10.0
    for number, at in enumerate(positions):
        key = tuple(int(value) for value in at // 1.5)
        if moved[number] - kept > 0.5:
            kept = moved[number]
            cells.setdefault(key, []).append(number)
        if moved[number] - last < 2.8:
            continue
        last = moved[number]
        behind = int(np.searchsorted(moved, last - 2.8))
        pairs = [behind] if behind < number and last > 2.8 else []
        old = [
            other
            for dx in (-1, 0, 1)
            for dy in (-1, 0, 1)
            for other in cells.get((key[0] + dx, key[1] + dy), [])
        ]
        away = {other: math.dist(at, positions[other]) for other in old if last - moved[other] > 20}
        pairs += sorted((other for other in away if away[other] < 1.5), key=away.get)[:1]
        for other in pairs:
            (x, y), turn = positions[number] - positions[other], headings[other]
            ahead, left = math.cos(turn) * x + math.sin(turn) * y, -math.sin(turn) * x + math.cos(turn) * y
            yield (
                times[other],
                times[number],
                ahead,
                left,
                math.remainder(headings[number] - turn, 2 * math.pi),
            )


def write_drive(name, way, odometry, ranges):
    """NAME.log, NAME.truth and NAME.relations of a way (positions, headings and times); `ranges` gives those
    of a scan by its number."""
    positions, headings, times = way
    with open(name + ".log", "w") as log, open(name + ".truth", "w") as truth:
        for number, (at, heading, time_s) in enumerate(zip(positions, headings, times)):
            if number:
                odometry.move(at - positions[number - 1], headings[number - 1], heading)
            counted = f"{odometry.x:.6f} {odometry.y:.6f} {math.remainder(odometry.turned, 2 * math.pi):.6f}"
            seen = [f"{value:.2f}" for value in ranges(number)]
            log.write(
                f"FLASER {len(seen)} {' '.join(seen)} {counted} {counted} {time_s:.6f} sim {time_s:.6f}\n"
            )
            truth.write(f"{time_s:.6f} {at[0]:.6f} {at[1]:.6f} {math.remainder(heading, 2 * math.pi):.9f}\n")
    with open(name + ".relations", "w") as out:
        for one, other, ahead, left, turn in relations(positions, headings, times):
            out.write(f"{one:.6f} {other:.6f} {ahead:.6f} {left:.6f} 0 0 0 {turn:.9f}\n")


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("name")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--plan", choices=list(PLANS), default="grid")
    parser.add_argument("--structure", choices=["varied", "bare", "repeating", "twins"], default="varied")
    parser.add_argument("--odometry", choices=["fair", "worn"], default="fair")
    parser.add_argument("--people", type=int, default=0, help="so many at a time near the robot")
    parser.add_argument(
        "--glass", type=float, default=0, help="share of the walls that lose 70 %% of their beams"
    )
    parser.add_argument("--range", type=float, default=79, dest="longest_m", help="longest range in meters")
    parser.add_argument(
        "--hours", type=float, default=0, help="how long it takes, with pauses; 0: a scan every 0.2 s"
    )
    parser.add_argument("--irregular", action="store_true", help="stamps jitter, scans are lost")
    parser.add_argument(
        "--part",
        type=float,
        nargs=2,
        default=(0, 1),
        metavar=("FROM", "TO"),
        help="only this share of the way",
    )
    parser.add_argument("--drive", type=int, default=0, help="other noise in the same building")
    return parser.parse_args()


def main():
    args = arguments()
    random = np.random.default_rng(args.seed)
    walls, (positions, headings) = building(random, args.plan, args.structure, args.seed), poses(args.plan)
    if args.drive:
        random = np.random.default_rng([args.seed, 100 + args.drive])
    draw = np.random.default_rng([args.seed, args.drive, 77])
    part = slice(*(int(share * len(positions)) for share in args.part))
    positions, headings, times = schedule(draw, positions[part], headings[part], args.hours, args.irregular)
    times = times + 1_000_000 + 100_000 * args.drive
    people = People(draw, args.people, positions)
    glass = (
        (draw, np.random.default_rng([args.seed, 78]).random(len(walls)) < args.glass) if args.glass else None
    )
    odometry = Odometry(random, args.odometry == "worn", draw)

    def ranges(number):
        seen = np.vstack([walls, people.lines(number)]) if args.people else walls
        return scan(random, seen, positions[number], headings[number], args.longest_m, glass)

    write_drive(args.name, (positions, headings, times), odometry, ranges)


if __name__ == "__main__":
    main()
