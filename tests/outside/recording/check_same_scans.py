#!/usr/bin/env python3
"""Are the scans of a recording scans of another one, range by range, in order?

    check_same_scans.py ORIGINAL RECORDED --least N

A device streams for a while before the drive starts and after it ends, and on a slow line it leaves scans
out; so each recorded scan must equal an original one at or after the one before it. No-return beams are +inf
in both. Needs mcap-ros2-support."""

import argparse
import sys
from pathlib import Path

from mcap_ros2.reader import read_ros2_messages

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.verdict import require


def scans(path):
    messages = read_ros2_messages(path, topics=["/scan/horizontal"])
    return [tuple(round(r, 3) for r in message.ros_msg.ranges) for message in messages]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("original")
    parser.add_argument("recorded")
    parser.add_argument("--least", type=int, required=True)
    args = parser.parse_args()
    original, recorded = scans(args.original), scans(args.recorded)
    position, used = 0, set()
    for number, scan in enumerate(recorded):
        # An LMS sends 181 values for 180 degrees; the log holds 180 of them.
        later = range(position, len(original))
        same = next((i for i in later if original[i][:180] == scan[: len(original[i][:180])]), None)
        require(
            same is not None,
            f"recorded scan {number} is no scan of the original at or after number {position}",
        )
        position = same
        used.add(position)
    print(
        f"{len(recorded)} recorded scans, {len(used)} different ones of {len(original)}, "
        "all unchanged and in order"
    )
    require(len(used) >= args.least, f"only {len(used)} different scans, {args.least} expected")


main()
