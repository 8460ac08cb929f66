"""Logs of CARMEN as text: read, altered, written; and how far a trajectory is from the relations of its log.

A relation is `t1 t2 x y z roll pitch yaw` (metric of Kuemmerle et al. 2009). Meters, radians, seconds."""

import bisect
import math
import random

from lib.planar import moved, seen_from


class Scan:
    """A line of the log: ranges, odometry [x, y, theta], stamp."""

    def __init__(self, line):
        words = line.split()
        self.ranges = words[2 : 2 + int(words[1])]
        rest = words[2 + len(self.ranges) :]
        self.odometry = [float(word) for word in rest[3:6]]
        self.stamp, self.host = rest[6], rest[7]

    def text(self):
        ranges = " ".join(self.ranges)
        if self.odometry is None:  # CARMEN's message of a laser that knows no robot
            stamps = f"{self.stamp} {self.host} {self.stamp}"
            return f"RAWLASER1 0 0 0 0 0 0 0 {len(self.ranges)} {ranges} 0 {stamps}\n"
        pose = " ".join(f"{value:.6f}" for value in self.odometry)
        return f"FLASER {len(self.ranges)} {ranges} {pose} {pose} {self.stamp} {self.host} {self.stamp}\n"


def with_steps(scans, change):
    """New odometry out of the old one's steps; `change` gets number and step."""
    pose, last = list(scans[0].odometry), scans[0].odometry
    for number, scan in enumerate(scans):
        step = seen_from(last, scan.odometry)
        last = scan.odometry
        pose = moved(pose, change(number, step))
        scan.odometry = pose
    return scans


def scaled(distance, turn):
    return lambda scans: with_steps(scans, lambda _, s: [s[0] * distance, s[1] * distance, s[2] * turn])


def stalls_and_jumps(scans):
    """Each minute stands still for 10 s, then goes on from there; half a minute later it jumps 0.5 m aside
    and 0.3 rad."""
    start, jumped = float(scans[0].stamp), set()

    def change(number, step):
        minute, second = divmod(float(scans[number].stamp) - start, 60.0)
        if 20.0 <= second < 30.0:
            return [0.0, 0.0, 0.0]
        if second >= 50.0 and minute not in jumped:
            jumped.add(minute)
            return [step[0], step[1] + 0.5, step[2] + 0.3]
        return step

    return with_steps(scans, change)


def signs_wrong_backward(scans):
    """Counts every step forward, as a base does whose encoders know no sign."""
    return with_steps(scans, lambda _, step: [abs(step[0]), step[1], step[2]])


def stalled(scans):
    """Each minute stands still for 5 s, then goes on from there."""
    start = float(scans[0].stamp)

    def change(number, step):
        second = (float(scans[number].stamp) - start) % 60.0
        return [0.0, 0.0, 0.0] if 20.0 <= second < 25.0 else step

    return with_steps(scans, change)


def jumps(scans):
    """Each half a minute jumps a meter ahead, the next time back."""
    start, done = float(scans[0].stamp), 0

    def change(number, step):
        nonlocal done
        due = int((float(scans[number].stamp) - start) / 30.0)
        if due <= done:
            return step
        done = due
        return [step[0] + (1.0 if due % 2 else -1.0), step[1], step[2]]

    return with_steps(scans, change)


def carried(scans):
    """Carries the robot for 20 s, three times between a tenth and four fifths of the log: it sees nothing and
    its odometry stands. When depends on how many scans there are."""
    first, last = float(scans[0].stamp), float(scans[-1].stamp)
    chance = random.Random(len(scans))
    starts = [first + (last - first) * chance.uniform(0.1, 0.8) for _ in range(3)]
    lifted = [any(start <= float(scan.stamp) < start + 20.0 for start in starts) for scan in scans]

    def change(number, step):
        return [0.0, 0.0, 0.0] if lifted[number] or lifted[max(number - 1, 0)] else step

    with_steps(scans, change)
    return [scan for scan, is_lifted in zip(scans, lifted) if not is_lifted]


def without_odometry(scans):
    for scan in scans:
        scan.odometry = None
    return scans


def standing(scans):
    for scan in scans:
        scan.odometry = [0.0, 0.0, 0.0]
    return scans


def dropped(share, seed):
    """Leaves so many of the scans out."""

    def change(scans):
        chance = random.Random(seed)
        return [scan for scan in scans if chance.random() >= share]

    return change


def read_log(path):
    with open(path) as lines:
        return [Scan(line) for line in lines if line.startswith("FLASER")]


class Track:
    """A trajectory, by time: rows of t, x, y, theta."""

    def __init__(self, rows):
        self.rows = sorted(rows)
        self.stamps = [row[0] for row in self.rows]

    def nearest(self, stamp):
        i = bisect.bisect_left(self.stamps, stamp)
        return min(
            (j for j in (i - 1, i) if 0 <= j < len(self.stamps)), key=lambda j: abs(self.stamps[j] - stamp)
        )

    def at(self, stamp, odometry):
        """The pose at a stamp. Where its scan was left out: the log's own odometry from the pose before, led
        to the pose after."""
        i = bisect.bisect_left(self.stamps, stamp)
        if i == len(self.rows) or self.stamps[i] == stamp or i == 0:
            return self.rows[min(i, len(self.rows) - 1)][1:]
        before, after = self.rows[i - 1], self.rows[i]
        here, start, end = (odometry.rows[odometry.nearest(t)][1:] for t in (stamp, before[0], after[0]))
        forth, back = moved(before[1:], seen_from(start, here)), moved(after[1:], seen_from(end, here))
        share = (stamp - before[0]) / (after[0] - before[0])
        return moved(forth, [share * value for value in seen_from(forth, back)])


def score(rows, relations, odometry):
    track = Track(rows)
    errors = []
    for first, second, x, y, z, _, _, yaw in relations:
        step = seen_from(track.at(first, odometry), track.at(second, odometry))
        turn = math.degrees(abs(math.remainder(step[2] - yaw, math.tau)))
        errors.append((math.sqrt((step[0] - x) ** 2 + (step[1] - y) ** 2 + z**2), turn))
    return [sum(column) / len(errors) for column in zip(*errors)]
