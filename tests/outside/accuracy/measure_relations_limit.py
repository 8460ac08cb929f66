#!/usr/bin/env python3
"""How much of the relations error (Kuemmerle et al. 2009) is the relations' own, below any trajectory?

    measure_relations_limit.py TRAJ RELATIONS LOG

TRAJ: lines "t x y theta" (`biplane traj --format xytheta`); RELATIONS: lines "t1 t2 x y z roll pitch yaw";
LOG: the CARMEN log that both come from. Prints, for docs/loops.md:

bursts     scans of the log that share 10 ms with another while the odometry moved on: a stamp there names
           one of several scans.
off        relations that TRAJ misses by more than 5 cm, how many of them name a burst, and what they add to
           the mean.
best scan  the mean if each of those named, of all scans within 0.6 s of its two stamps, the two that suit it
           best. This is better than any right choice; the same freedom for all other relations is printed
           beside it, to show how much of it is freedom alone.
triangles  three relations between the same three stamps should close; what is left, divided by the root of 3,
           is the error of one.
point      the point of the robot, ahead and to the left of the pose in TRAJ, that the relations suit best as
           where they were measured, and the mean with it. Where it is not the pose itself, relations and
           trajectory have other frames on the robot.

Plain Python."""

import bisect
import collections
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.planar import moved, read_numbers, seen_from
from lib.verdict import require

BURST_S, FAR_M, AROUND_S = 0.010, 0.05, 0.6
# Relations that are off by so much count half when the point is sought, meters.
SCALE_M, ROUNDS = 0.05, 20


def error(found, relation):
    """Meters and degrees between a relative pose and a relation."""
    turn = math.remainder(found[2] - relation[7], 2 * math.pi)
    return math.hypot(found[0] - relation[2], found[1] - relation[3]), abs(math.degrees(turn))


def mean(values):
    values = list(values)
    return sum(values) / len(values) if values else 0.0


def bursts(log):
    """Stamps of scans that share 10 ms with another one that saw the base elsewhere (1 cm or 0.5 degrees)."""
    scans = []
    with open(log) as lines:
        for line in lines:
            if line.startswith("FLASER"):
                words = line.split()
                scans.append((float(words[-3]), [float(word) for word in words[-6:-3]]))
    scans.sort(key=lambda scan: scan[0])
    found = set()
    for (t1, one), (t2, other) in zip(scans, scans[1:]):
        if t2 - t1 < BURST_S and (
            math.dist(one[:2], other[:2]) > 0.01
            or abs(math.remainder(one[2] - other[2], 2 * math.pi)) > 0.009
        ):
            found |= {round(t1, 6), round(t2, 6)}
    return scans, found


class Poses:
    """The trajectory, by time."""

    def __init__(self, path):
        self.rows = sorted(read_numbers(path))
        self.times = [row[0] for row in self.rows]

    def nearest(self, time):
        at = bisect.bisect_left(self.times, time)
        return min(self.rows[max(at - 1, 0) : at + 1], key=lambda row: abs(row[0] - time))[1:4]

    def around(self, time):
        rows = self.rows[
            bisect.bisect_left(self.times, time - AROUND_S) : bisect.bisect_right(self.times, time + AROUND_S)
        ]
        return [row[1:4] for row in rows] or [self.nearest(time)]

    def best(self, relation):
        pairs = (
            seen_from(one, other) for one in self.around(relation[0]) for other in self.around(relation[1])
        )
        return min(error(pair, relation) for pair in pairs)


def triangles(relations):
    """What is left when three relations between three stamps are put after each other: meters and degrees."""
    known = {}
    for relation in relations:
        step = (relation[2], relation[3], relation[7])
        known[relation[0], relation[1]] = step
        known[relation[1], relation[0]] = seen_from(step, (0.0, 0.0, 0.0))
    beside = collections.defaultdict(set)
    for one, other in known:
        beside[one].add(other)
    for one in sorted(beside):
        for two in sorted(other for other in beside[one] if other > one):
            for three in sorted(other for other in beside[one] & beside[two] if other > two):
                left = seen_from(known[one, three], moved(known[one, two], known[two, three]))
                yield math.hypot(*left[:2]), abs(math.degrees(left[2]))


def about(point, pair):
    """The relative pose of two poses, of a point that the robot carries."""
    ahead, left = point
    one, other = (moved(pose, (ahead, left, 0.0)) for pose in pair)
    return seen_from(one, other)


def best_point(pairs, relations):
    """The point that suits the relations best: least squares, each weighted by Cauchy's weights."""
    point = (0.0, 0.0)
    for _ in range(ROUNDS):
        held = right_x = right_y = 0.0
        for pair, relation in zip(pairs, relations):
            found = about(point, pair)
            off = relation[2] - found[0], relation[3] - found[1]
            weight = 1.0 / (1.0 + (math.hypot(*off) / SCALE_M) ** 2)
            # A point moves what is seen by how far the turn moves it.
            cos, sin = math.cos(found[2]) - 1.0, math.sin(found[2])
            held += weight * (cos * cos + sin * sin)
            right_x += weight * (cos * off[0] + sin * off[1])
            right_y += weight * (cos * off[1] - sin * off[0])
        point = point[0] + right_x / max(held, 1e-9), point[1] + right_y / max(held, 1e-9)
    return point


def means(errors, chosen):
    """Mean of the chosen errors, in words."""
    kept = [e for e, c in zip(errors, chosen) if c]
    return f"{mean(e[0] for e in kept):.4f} m, {mean(e[1] for e in kept):.3f} deg"


def main():
    require(len(sys.argv) == 4, __doc__)
    poses, relations = Poses(sys.argv[1]), read_numbers(sys.argv[2])
    scans, in_bursts = bursts(sys.argv[3])
    errors = [error(seen_from(poses.nearest(r[0]), poses.nearest(r[1])), r) for r in relations]
    named = [any(round(stamp, 6) in in_bursts for stamp in r[:2]) for r in relations]
    far = [e[0] > FAR_M for e in errors]
    near = [not f for f in far]
    best = [poses.best(r) for r in relations]
    count = len(relations)
    print(f"relations  {count}: mean {means(errors, [True] * count)}")
    print(f"bursts     {len(in_bursts)} of {len(scans)} scans; named by {sum(named)} relations")
    print(f"  named     mean {means(errors, named)}")
    print(f"  not named mean {means(errors, [not n for n in named])}")
    add = sum(e[0] for e, f in zip(errors, far) if f) / count
    both = sum(f and n for f, n in zip(far, named))
    print(
        f"off        {sum(far)} by more than {FAR_M} m, {both} of them name a burst; "
        f"they add {add:.4f} m to the mean"
    )
    print(f"  others   mean {means(errors, near)}")
    mixed = [b if f else e for e, b, f in zip(errors, best, far)]
    print(f"best scan  of those off: mean of all {means(mixed, [True] * count)}")
    as_named, freely = (mean(e[0] for e, n in zip(column, near) if n) for column in (errors, best))
    print(f"  others   {as_named:.4f} m as named, {freely:.4f} m with the same freedom")
    left = list(triangles(relations))
    open_m, open_deg = mean(t[0] for t in left), mean(t[1] for t in left)
    print(
        f"triangles  {len(left)}: close to {open_m:.4f} m, {open_deg:.3f} deg; "
        f"one relation {open_m / math.sqrt(3):.4f} m, {open_deg / math.sqrt(3):.3f} deg"
    )
    pairs = [(poses.nearest(r[0]), poses.nearest(r[1])) for r in relations]
    point = best_point(pairs, relations)
    moved_errors = [error(about(point, pair), r) for pair, r in zip(pairs, relations)]
    with_it = means(moved_errors, [True] * count)
    print(f"point      {point[0]:.3f} m ahead, {point[1]:.3f} m to the left: mean {with_it}")


main()
