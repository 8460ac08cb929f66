#!/usr/bin/env python3
"""Are the scans of RECORDED scans of ORIGINAL, range by range, in order?  same_scans.py ORIGINAL RECORDED --least N

A device streams for a while before the drive starts and after it ends, and on a slow line it leaves scans out; so each
recorded scan must equal an original one at or after the one before it. No-return beams are +inf in both."""
import argparse

from mcap_ros2.reader import read_ros2_messages


def scans(path):
    return [tuple(round(r, 3) for r in m.ros_msg.ranges)
            for m in read_ros2_messages(path, topics=["/scan/horizontal"])]


parser = argparse.ArgumentParser()
parser.add_argument("original")
parser.add_argument("recorded")
parser.add_argument("--least", type=int, required=True)
args = parser.parse_args()
original, recorded = scans(args.original), scans(args.recorded)
position, used = 0, set()
for number, scan in enumerate(recorded):
    # An LMS sends 181 values for 180 degrees; the log holds 180 of them.
    wanted = [i for i in range(position, len(original)) if original[i][:180] == scan[:len(original[i][:180])]]
    assert wanted, f"recorded scan {number} is no scan of the original at or after number {position}"
    position = wanted[0]
    used.add(position)
print(f"{len(recorded)} recorded scans, {len(used)} different ones of {len(original)}, all unchanged and in order")
assert len(used) >= args.least, f"only {len(used)} different scans, {args.least} expected"
