#!/usr/bin/env python3
"""The first N laser lines of a CARMEN log, in which the robot drives: slice_log.py LOG N OUT"""
import sys

log, count, out = sys.argv[1], int(sys.argv[2]), sys.argv[3]
lines = [line for line in open(log) if line.startswith("FLASER")]
# Skip the standstill at the start: take scans from the first metre of odometry on.
start = [float(word) for word in lines[0].split()[-9:-7]]
first = next(i for i, line in enumerate(lines)
             if sum((float(a) - b) ** 2 for a, b in zip(line.split()[-9:-7], start)) > 1.0)
chosen = lines[first:first + count]
assert len(chosen) == count, f"{log} holds only {len(chosen)} scans after its first metre"
open(out, "w").writelines(chosen)
