#!/usr/bin/env python3
"""Does the basin of convergence hold its targets? The shares are counted again from the table of all starts.

  check_basin.py BASIN.json BASIN.csv"""
import csv
import json
import math
import sys
from collections import defaultdict
from statistics import median

said = json.load(open(sys.argv[1]))
starts = list(csv.DictReader(open(sys.argv[2])))
at_heading = defaultdict(list)
for start in starts:
    error_m, error_deg = float(start["error_m"]), math.degrees(float(start["error_rad"]))
    succeeded, gross = error_m <= 0.02 and error_deg <= 0.5, error_m > 0.10 or error_deg > 2.0
    at_heading[round(math.degrees(float(start["start_theta_rad"])))].append((succeeded, gross))
everything = [start for heading in at_heading.values() for start in heading]
share = lambda these, which: 100.0 * sum(start[which] for start in these) / len(these)
success, gross = share(everything, 0), share(everything, 1)
by_heading = {heading: share(these, 0) for heading, these in sorted(at_heading.items())}
cpu_us = median(float(start["cpu_us"]) for start in starts)

assert len(starts) == 80 * 52 and sorted(by_heading) == list(range(-30, 31, 5)), (len(starts), by_heading)
# A start that lies on a limit may be rounded to its other side in the table.
assert abs(said["all"]["success_percent"] - success) < 0.2 and abs(said["all"]["gross_percent"] - gross) < 0.2, (said["all"], success, gross)
assert success >= 92.0 and gross <= 0.5, f"success {success:.2f} %, gross {gross:.2f} %"
assert max(by_heading.values()) - min(by_heading.values()) < 5.0, f"not flat: {by_heading}"
assert cpu_us <= 300.0, f"{cpu_us:.0f} us an alignment"
print(f"success {success:.2f} %, gross {gross:.2f} %, {min(by_heading.values()):.1f} to {max(by_heading.values()):.1f} % by heading, {cpu_us:.0f} us an alignment")
