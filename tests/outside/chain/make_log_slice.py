#!/usr/bin/env python3
"""Writes the first laser lines of a CARMEN log in which the robot drives.

make_log_slice.py LOG COUNT OUT"""

import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.verdict import require

STANDS_WITHIN_M = 1.0


def place(line):
    """Where the robot's odometry has it: x and y of the pose before the stamps."""
    return [float(word) for word in line.split()[-9:-7]]


def main(log, count, out):
    with open(log) as text:
        lines = [line for line in text if line.startswith("FLASER")]
    start = place(lines[0])
    first = next(i for i, line in enumerate(lines) if math.dist(place(line), start) > STANDS_WITHIN_M)
    chosen = lines[first : first + count]
    require(len(chosen) == count, f"{log} holds only {len(chosen)} scans after its first meter")
    Path(out).write_text("".join(chosen))


require(len(sys.argv) == 4, __doc__)
main(sys.argv[1], int(sys.argv[2]), sys.argv[3])
