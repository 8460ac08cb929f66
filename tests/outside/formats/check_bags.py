#!/usr/bin/env python3
"""Imports bags and holds each recording against what another reader (rosbags) finds in the bag.

    check_bags.py made WORKDIR           a simulated drive, written as bags of five kinds
    check_bags.py data FOLDER WORKDIR    the bags of a folder, with their truth in FOLDER/truth
    check_bags.py odd WORKDIR            bags that are damaged, lie or say too little

Scan for scan: stamps to the nanosecond, measured ranges and directions to the bit; what the bag writes for
"nothing seen" or below the shortest range is no range in the recording either. Odometry and inertial samples:
count, stamps, values. `made`: poses and model as from the serial bytes. Needs the three programs on PATH and
rosbags, numpy beside the Python that runs it."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import bag_data, bag_drive, bag_oddities
from lib.programs import fresh_folder
from lib.verdict import Tally, fail


def main():
    words = sys.argv[1:]
    tally = Tally()
    match words:
        case ["made", work]:
            bag_drive.check(fresh_folder(work), tally)
        case ["data", folder, work]:
            bag_data.check(Path(folder), fresh_folder(work), tally)
        case ["odd", work]:
            bag_oddities.check(fresh_folder(work), tally)
        case _:
            fail(__doc__)
    tally.end()


main()
