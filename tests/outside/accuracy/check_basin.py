#!/usr/bin/env python3
"""Does the basin of convergence hold its targets?

    check_basin.py BASIN.json BASIN.csv      as `biplane-onboard basin` writes them

The shares are counted again from the table of all starts. Plain Python."""

import csv
import json
import math
import sys
from collections import defaultdict
from pathlib import Path
from statistics import median

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.verdict import require

PAIRS, STARTS_A_PAIR = 80, 52
HEADINGS_DEG = list(range(-30, 31, 5))
LEAST_SUCCESS, MOST_GROSS, LARGEST_SPREAD, MOST_CPU_US = 92.0, 0.5, 5.0, 300.0
# A start that lies on a limit may be rounded to its other side in the table.
ROUNDED = 0.2


def share(starts, which):
    """Percent of the starts that are so."""
    return 100.0 * sum(start[which] for start in starts) / len(starts)


def judged(start):
    """Whether the alignment found its place, and whether it was grossly off."""
    error_m, error_deg = float(start["error_m"]), math.degrees(float(start["error_rad"]))
    return error_m <= 0.02 and error_deg <= 0.5, error_m > 0.10 or error_deg > 2.0


def main():
    require(len(sys.argv) == 3, __doc__)
    told = json.loads(Path(sys.argv[1]).read_text())["all"]
    with open(sys.argv[2]) as table:
        starts = list(csv.DictReader(table))
    at_heading = defaultdict(list)
    for start in starts:
        at_heading[round(math.degrees(float(start["start_theta_rad"])))].append(judged(start))
    everything = [start for heading in at_heading.values() for start in heading]
    success, gross = share(everything, 0), share(everything, 1)
    by_heading = {heading: share(these, 0) for heading, these in sorted(at_heading.items())}
    least, most = min(by_heading.values()), max(by_heading.values())
    cpu_us = median(float(start["cpu_us"]) for start in starts)

    require(len(starts) == PAIRS * STARTS_A_PAIR, f"{len(starts)} starts, expected {PAIRS * STARTS_A_PAIR}")
    require(list(by_heading) == HEADINGS_DEG, f"starts at {list(by_heading)} degrees")
    near = abs(told["success_percent"] - success) < ROUNDED and abs(told["gross_percent"] - gross) < ROUNDED
    require(near, f"told are {told}, the table has {success:.2f} and {gross:.2f} %")
    require(success >= LEAST_SUCCESS and gross <= MOST_GROSS, f"success {success:.2f} %, gross {gross:.2f} %")
    require(most - least < LARGEST_SPREAD, f"the success depends on the heading: {by_heading}")
    require(cpu_us <= MOST_CPU_US, f"{cpu_us:.0f} us an alignment")
    print(
        f"success {success:.2f} %, gross {gross:.2f} %, {least:.1f} to {most:.1f} % by heading, "
        f"{cpu_us:.0f} us an alignment"
    )


main()
