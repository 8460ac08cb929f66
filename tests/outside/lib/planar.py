"""Poses in the plane, as (x, y, theta) in meters and radians, and the text files that hold them."""

import math


def seen_from(a, b):
    """Pose b in the frame of pose a."""
    dx, dy, (sin, cos) = b[0] - a[0], b[1] - a[1], (math.sin(a[2]), math.cos(a[2]))
    return cos * dx + sin * dy, cos * dy - sin * dx, math.remainder(b[2] - a[2], math.tau)


def moved(a, step):
    """Pose a after a step that is told in its own frame."""
    sin, cos = math.sin(a[2]), math.cos(a[2])
    return (
        a[0] + cos * step[0] - sin * step[1],
        a[1] + sin * step[0] + cos * step[1],
        math.remainder(a[2] + step[2], math.tau),
    )


def read_numbers(path):
    """The leading eight numbers, or fewer, of each line that is no comment: trajectories "t x y theta" and
    relations "t1 t2 x y z roll pitch yaw"."""
    with open(path) as lines:
        return [
            tuple(float(word) for word in line.split()[:8])
            for line in lines
            if line.strip() and not line.startswith("#")
        ]
