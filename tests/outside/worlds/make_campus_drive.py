#!/usr/bin/env python3
"""A drive of 2 km over a campus, as somebody else's robot would have logged it, with its truth.

    make_campus_drive.py NAME --seed N [--odometry O] [--beams N] [--relief M] [--shake DEG] [--people N]
                         [--part FROM TO] [--drive N]

Writes NAME.log, NAME.truth and NAME.relations as `make_large_building.py` does, with the same odometry and
people. Roads over 250 m by 170 m lie between buildings, parks and parking lots; trees, hedges, lamps and
parked cars stand along them. A sixth of the cars leaves in the middle of the drive, and another sixth comes.
In a hedge each beam ends somewhere else, 12 cm deep in the mean. Glass loses beams, edges mix them. Needs
numpy.

relief  the ground rises and falls by about so many meters over 150 m, and beams of the laser, 45 cm above it,
        end on it or pass over hedges and cars; 0: flat
shake   standard deviation of pitch and roll, degrees"""

import argparse
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from accuracy.make_large_building import Odometry, People, write_drive
from lib import np

COLUMNS, ROWS, SPACE_M = 5, 4, (62.0, 56.0)
STEP_M, STEP_S, WAY_M = 0.14, 0.2, 2000.0
LONGEST_M, NO_RETURN_M, NOISE_M, LASER_M, GROUND_NOISE_M = 80.0, 81.83, 0.015, 0.45, 0.15
HARD, LEAVES, GLASS = 0, 1, 2
LEAVES_M, GLASS_LOST, MIXED = 0.12, 0.5, 0.15
ALWAYS, UNTIL_HALF, FROM_HALF = (0, 1), (0, 0.5), (0.5, 1)


class Ground:
    """Heights, a sum of four waves."""

    def __init__(self, random, relief_m):
        self.waves = []
        for _ in range(4):
            length, turn = random.uniform(45, 150), random.uniform(0, math.tau)
            height = relief_m * random.uniform(0.3, 1.0) * length / 150
            per_m = math.tau / length
            self.waves.append((height, per_m * math.cos(turn), per_m * math.sin(turn), random.uniform(0, 6)))

    def height(self, x, y):
        return sum(height * np.sin(kx * x + ky * y + phase) for height, kx, ky, phase in self.waves)

    def slope(self, x, y):
        waves = [(height * math.cos(kx * x + ky * y + phase), kx, ky) for height, kx, ky, phase in self.waves]
        return sum(rise * kx for rise, kx, _ in waves), sum(rise * ky for rise, _, ky in waves)


class Campus:
    """Walls (x, y, x, y, height, kind, from, until) and round things (x, y, radius, height, kind)."""

    def __init__(self, random):
        self.random, self.walls, self.rounds = random, [], []
        jitter = random.uniform(-9, 9, (COLUMNS, ROWS, 2))
        self.crossings = {
            (column, row): np.array([column * SPACE_M[0], row * SPACE_M[1]]) + jitter[column, row]
            for column in range(COLUMNS)
            for row in range(ROWS)
        }
        for column in range(-1, COLUMNS):
            for row in range(-1, ROWS):
                self.block(column, row)
        for column, row in self.crossings:
            for other in ((column + 1, row), (column, row + 1)):
                if other in self.crossings:
                    self.roadside(self.crossings[column, row], self.crossings[other])

    def line(self, a, b, height, kind=HARD, there=ALWAYS):
        self.walls.append((*a, *b, height, kind, *there))

    def area(self, column, row):
        """Lower and upper corner of a block between roads, and whether it has roads all around."""
        places = ((column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1))
        is_inner = all(place in self.crossings for place in places)
        if is_inner:
            corners = [self.crossings[place] for place in places]
        else:
            corners = [np.array([at * space for at, space in zip(place, SPACE_M)]) for place in places]
        low = np.max([corners[0], [corners[3][0], corners[1][1]]], axis=0)
        high = np.min([corners[2], [corners[1][0], corners[3][1]]], axis=0)
        return (low, high) if is_inner else (low + 10, high - 10)

    def block(self, column, row):
        random = self.random
        low, high = self.area(column, row)
        kind = random.choice(["building", "park", "cars"], p=(0.6, 0.25, 0.15))
        back = random.uniform(5, 13, 4)
        low, high = low + back[:2], high - back[2:]
        if (high - low).min() < 8:
            kind = "park"
        if kind == "building":
            self.building(low, high, random.uniform(-0.12, 0.12))
            if random.random() < 0.4:
                wing = low + (high - low) * random.uniform(0.2, 0.6, 2)
                self.building(wing, np.minimum(wing + random.uniform(8, 30, 2), high + 3), 0)
        elif kind == "park":
            size_m2 = max(0, np.prod(high - low))
            for _ in range(random.poisson(size_m2 / 60)):
                self.tree(random.uniform(low, high))
            for _ in range(random.poisson(size_m2 / 200)):
                self.rounds.append((*random.uniform(low, high), random.uniform(0.4, 1.2), 1.2, LEAVES))
        else:
            for y in np.arange(low[1], high[1], 11):
                for x in np.arange(low[0], high[0], 2.6):
                    if random.random() < 0.6:
                        self.car(np.array([x, y]), math.pi / 2)

    def car(self, at, turn):
        turn += self.random.normal(0, 0.03)
        there = [ALWAYS, ALWAYS, ALWAYS, ALWAYS, UNTIL_HALF, FROM_HALF][self.random.integers(6)]
        along = np.array([math.cos(turn), math.sin(turn)])
        across = np.array([-along[1], along[0]])
        middle = at + self.random.normal(0, 0.15, 2)
        half = self.random.uniform(3.8, 4.8) / 2
        corners = [
            middle + one * half * along + other * 1.75 / 2 * across
            for one, other in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
        for number in range(4):
            self.line(corners[number], corners[(number + 1) % 4], 1.3, HARD, there)

    def tree(self, at):
        radius = self.random.choice([0.06, 0.12, 0.2, 0.35]) * self.random.uniform(0.8, 1.2)
        self.rounds.append((*at, radius, 9, HARD))

    def building(self, low, high, turn):
        turned = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        middle, half = (low + high) / 2, (high - low) / 2
        corners = [middle + turned @ (half * side) for side in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        is_bare = self.random.random() < 0.3
        for number in range(4):
            self.facade(corners[number], corners[(number + 1) % 4], is_bare)

    def facade(self, a, b, is_bare):
        """A wall with pilasters, doors set back and bays."""
        random, length = self.random, math.dist(a, b)
        if length < 1:
            return
        along = (b - a) / length
        out = np.array([along[1], -along[0]])
        kind = GLASS if random.random() < 0.15 else HARD
        at = 0.0
        while at < length:
            stop = min(length, at + (random.uniform(10, 30) if is_bare else random.uniform(2, 9)))
            self.line(a + along * at, a + along * stop, 8, kind)
            at = stop
            if at > length - 4:
                continue
            long, deep = [
                (0.4, random.uniform(0.1, 0.3)),
                (1.3, -random.uniform(0.25, 0.5)),
                (random.uniform(2, 3.5), random.uniform(0.5, 1.2)),
            ][random.integers(3)]
            one, other = a + along * at, a + along * (at + long)
            self.line(one, one + out * deep, 8)
            self.line(one + out * deep, other + out * deep, 8, kind)
            self.line(other + out * deep, other, 8)
            at += long

    def roadside(self, a, b):
        random, length = self.random, math.dist(a, b)
        along = (b - a) / length
        for side in (-1, 1):
            out = side * np.array([-along[1], along[0]])
            what = random.choice(
                ["trees", "hedge", "cars", "lamps", "nothing"], p=(0.35, 0.2, 0.2, 0.1, 0.15)
            )
            at, off = random.uniform(6, 12), random.uniform(3.2, 5)
            while at < length - 7 and what != "nothing":
                at += self.beside(what, a + along * at + out * off, along, out, length - 7 - at)

    def beside(self, what, place, along, out, left):
        """What stands beside the road; how far on the next one stands."""
        random = self.random
        if what == "trees":
            if random.random() < 0.85:
                self.tree(place + random.normal(0, 0.3, 2))
            return random.uniform(7, 12)
        if what == "hedge":
            long = min(random.uniform(6, 25), left)
            for deep in (0, 0.9 * out):
                self.line(place + deep, place + along * long + deep, 1.1, LEAVES)
            return long + random.uniform(2, 8)
        if what == "cars":
            if random.random() < 0.75:
                self.car(place, math.atan2(along[1], along[0]))
            return 5.6
        self.rounds.append((*place, 0.08, 5, HARD))
        return random.uniform(18, 25)


def way(random, crossings):
    """The crossings in order: never back at once, roads that are new first."""
    driven, at, before = {}, (0, 0), None
    found, length = [at], 0.0
    while length < WAY_M:
        near = ((at[0] + 1, at[1]), (at[0] - 1, at[1]), (at[0], at[1] + 1), (at[0], at[1] - 1))
        ahead = [place for place in near if place in crossings and place != before]
        times = [driven.get(frozenset((at, place)), 0) + 0.9 * random.random() for place in ahead]
        after = ahead[times.index(min(times))]
        driven[frozenset((at, after))] = driven.get(frozenset((at, after)), 0) + 1
        length += math.dist(crossings[at], crossings[after])
        before, at = at, after
        found.append(at)
    return found


def poses(random, crossings):
    """Positions and headings, on some side of each road, rounded at crossings."""
    corners = [crossings[place] for place in way(random, crossings)]
    points = []
    for a, b in zip(corners[:-1], corners[1:]):
        length = math.dist(a, b)
        along = (b - a) / length
        side = random.uniform(-1.6, 1.6) * np.array([-along[1], along[0]])
        points += [a + along * at + side for at in np.arange(5, length - 5, STEP_M)]
    dense = [points[0]]
    for point in points[1:]:
        last, gap = dense[-1], math.dist(dense[-1], point)
        count = int(gap / STEP_M) if gap > 1.5 * STEP_M else 0
        dense += [last + (point - last) * (number / count) for number in range(1, count)]
        dense.append(point)
    padded = np.pad(np.array(dense), ((20, 20), (0, 0)), "edge")
    smooth = np.column_stack([np.convolve(axis, np.ones(41) / 41, "valid") for axis in padded.T])[21:-21]
    count = np.arange(len(smooth))
    smooth += 0.15 * np.column_stack([np.sin(count / 47), np.cos(count / 61)])
    ahead = np.gradient(smooth, axis=0)
    return smooth, np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0])) + 0.03 * np.sin(count / 11)


class Scanner:
    """A laser on a robot that leans with the ground and shakes."""

    def __init__(self, random, campus, ground, beams, shake_rad):
        self.random, self.ground, self.shake_rad = random, ground, shake_rad
        self.walls, self.rounds = np.array(campus.walls), np.array(campus.rounds)
        self.angles = np.radians(np.arange(180) - 90.0)
        if beams > 180:
            self.angles = np.linspace(-math.pi / 2, math.pi / 2, beams)
        self.looked_at, self.lean = None, np.zeros(2)

    def look_around(self, at):
        """What is near, once each 8 m."""
        if self.looked_at is not None and math.dist(at, self.looked_at) <= 8:
            return
        self.looked_at, walls = at, self.walls
        middle = (walls[:, :2] + walls[:, 2:4]) / 2
        half = np.hypot(*(walls[:, 2:4] - walls[:, :2]).T) / 2
        self.near_walls = walls[np.hypot(*(middle - at).T) - half < LONGEST_M + 9]
        self.near_rounds = self.rounds[np.hypot(*(self.rounds[:, :2] - at).T) < LONGEST_M + 9]

    def meets(self, at, directions, progress, people):
        """What the beams meet in the plane: beam, distance, height and kind of each thing, near or far."""
        (dx, dy), walls, rounds = directions, self.near_walls, self.near_rounds
        walls = walls[(walls[:, 6] <= progress) & (progress < walls[:, 7] + 1e-9)]
        if len(people):
            walls = np.vstack([walls, people])
        (ex, ey), (wx, wy) = (walls[:, 2:4] - walls[:, :2]).T, (walls[:, :2] - at).T
        (cx, cy) = (rounds[:, :2] - at).T
        with np.errstate(all="ignore"):
            across = dx[:, None] * ey - dy[:, None] * ex
            far = (wx * ey - wy * ex) / across
            along = (wx * dy[:, None] - wy * dx[:, None]) / across
            off_squared = rounds[:, 2] ** 2 - (dx[:, None] * cy - dy[:, None] * cx) ** 2
            round_far = dx[:, None] * cx + dy[:, None] * cy - np.sqrt(off_squared)
        is_on_wall, is_on_round = (along >= 0) & (along <= 1), off_squared > 0
        for is_on, away, height, kind in (
            (is_on_wall, far, walls[:, 4], walls[:, 5]),
            (is_on_round, round_far, rounds[:, 3], rounds[:, 4]),
        ):
            beam, thing = np.nonzero(is_on & (away > 0.05) & (away < LONGEST_M))
            yield beam, away[beam, thing], height[thing], kind[thing]

    def to_ground(self, at, directions, rise, laser_z):
        """How far each beam is from the ground along it; infinite where it never meets it."""
        steps = np.arange(1.0, LONGEST_M + 1, 1.0)
        x, y = (start + steps * direction[:, None] for start, direction in zip(at, directions))
        above = laser_z + steps * rise[:, None] - self.ground.height(x, y)
        first = (above < 0).argmax(1)
        before = np.take_along_axis(above, np.maximum(first - 1, 0)[:, None], 1)[:, 0]
        under = np.take_along_axis(above, first[:, None], 1)[:, 0]
        far = steps[first] - np.where(first > 0, under / np.minimum(under - before, -1e-9), 0)
        far = far + self.random.normal(0, GROUND_NOISE_M, len(far))
        return np.where((above < 0).any(1) & (far > 0.3), far, np.inf)

    def scan(self, at, heading, progress, people):
        random = self.random
        self.look_around(at)
        fresh = random.normal(0, self.shake_rad * math.sqrt(1 - 0.75**2), 2)
        self.lean = 0.75 * self.lean + fresh
        directions = np.cos(self.angles + heading), np.sin(self.angles + heading)
        rise = sum(slope * direction for slope, direction in zip(self.ground.slope(*at), directions))
        rise = rise + np.cos(self.angles) * self.lean[0] + np.sin(self.angles) * self.lean[1]
        laser_z = self.ground.height(*at) + LASER_M
        ranges, kinds = np.full(len(rise), np.inf), np.zeros(len(rise))
        for beam, far, height, kind in self.meets(at, directions, progress, people):
            x, y = (start + far * direction[beam] for start, direction in zip(at, directions))
            above = laser_z + far * rise[beam] - self.ground.height(x, y)
            # Of several things that a beam meets the nearest one comes last.
            order = np.lexsort((-far, beam))
            order = order[((above >= 0) & (above <= height))[order]]
            order = order[far[order] < ranges[beam[order]]]
            ranges[beam[order]], kinds[beam[order]] = far[order], kind[order]
        ground = self.to_ground(at, directions, rise, laser_z)
        kinds[ground < ranges] = HARD
        ranges = np.minimum(ranges, ground)
        return self.measured(ranges * np.sqrt(1 + rise**2), kinds)

    def measured(self, ranges, kinds):
        """With noise, in leaves, lost in glass and mixed at edges."""
        random = self.random
        ranges = ranges + random.normal(0, NOISE_M, len(ranges))
        is_leaf = kinds == LEAVES
        ranges[is_leaf] += random.exponential(LEAVES_M, is_leaf.sum())
        ranges[(kinds == GLASS) & (random.random(len(ranges)) < GLASS_LOST)] = np.inf
        with np.errstate(all="ignore"):
            is_edge = np.abs(np.diff(ranges)) > 0.3
        is_edge &= np.isfinite(ranges[:-1]) & np.isfinite(ranges[1:])
        mixed = np.nonzero(is_edge & (random.random(len(is_edge)) < MIXED))[0]
        share = random.random(len(mixed))
        ranges[mixed] = share * ranges[mixed] + (1 - share) * ranges[mixed + 1]
        return np.where(ranges < LONGEST_M, ranges, NO_RETURN_M)


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("name")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--odometry", choices=["fair", "worn"], default="fair")
    parser.add_argument("--beams", type=int, choices=[180, 361], default=180)
    parser.add_argument("--relief", type=float, default=0.2, metavar="M")
    parser.add_argument("--shake", type=float, default=0.15, metavar="DEG")
    parser.add_argument("--people", type=int, default=0, help="so many at a time near the robot")
    parser.add_argument("--part", type=float, nargs=2, default=(0, 1), metavar=("FROM", "TO"))
    parser.add_argument("--drive", type=int, default=0, help="other noise on the same campus")
    return parser.parse_args()


def main():
    args = arguments()
    random = np.random.default_rng(args.seed)
    campus, ground = Campus(random), Ground(random, args.relief)
    positions, headings = poses(random, campus.crossings)
    random = np.random.default_rng([args.seed, 100 + args.drive])
    draw = np.random.default_rng([args.seed, args.drive, 77])
    part = slice(*(int(share * len(positions)) for share in args.part))
    positions, headings = positions[part], headings[part]
    times = 1_000_000 + 100_000 * args.drive + STEP_S * np.arange(len(positions))
    people, odometry = People(draw, args.people, positions), Odometry(random, args.odometry == "worn", draw)
    scanner = Scanner(random, campus, ground, args.beams, math.radians(args.shake))

    def ranges(number):
        boxes = people.lines(number) if args.people else []
        walkers = [(*box, 1.7, HARD, *ALWAYS) for box in boxes]
        return scanner.scan(positions[number], headings[number], number / len(positions), walkers)

    write_drive(args.name, (positions, headings, times), odometry, ranges)


if __name__ == "__main__":
    main()
