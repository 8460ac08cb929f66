#!/usr/bin/env python3
"""Runs README's commands as a newcomer pastes them: those of a section, in its order, in an empty folder.

    check_readme.py WORKDIR SECTION [FILE...]      with the three programs on PATH; the FILEs are there before
    the first command

Blocks that build the programs or install them (cargo) are left out: who runs this has done it. Fails when a
command does, and when a figure of "Five minutes" is not what its command prints."""

import json
import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import ROOT, fresh_folder, json_of
from lib.verdict import require


def commands_of(section):
    """The blocks of shell commands below a heading of README."""
    return [
        block
        for block in re.findall(r"^```sh\n(.*?)^```", text_of(section), re.S | re.M)
        if "cargo " not in block
    ]


def text_of(section):
    """Everything below a heading of README."""
    text = re.search(rf"^## {re.escape(section)}\n(.*?)^## ", (ROOT / "README.md").read_text(), re.S | re.M)
    require(text, f"README has no section {section}")
    return text.group(1)


def check_figure(name, written, measured, share):
    """A figure of README is the measured one, within a share of it."""
    near = abs(float(written) - measured) <= share * measured
    require(near, f"README says {name} {written}, it is {measured:.4g}")


def check_bound(name, written, measured):
    """A bound of README holds, and is no more than twice what it bounds."""
    holds = measured <= float(written) <= 2 * measured
    require(holds, f"README says {name} within {written}, it is {measured:.4g}")


def check_model_line(text, work):
    """The line that `build` ends with."""
    pattern = (
        r"`(\d+) points?, (\d+) triangles? -> (\d+) polygons? with \d+ holes? on (\d+) planes? "
        r"\+ (\d+) triangles?"
    )
    line = re.search(pattern, text)
    require(line, "README shows no last line of build")
    summary = json.loads((work / "model/summary.json").read_text())
    names = ("raw_points", "raw_triangles", "polygons", "planes", "leftover_triangles")
    # Counts of surfaces change with the version, those of points hardly.
    shares = (0.01, 0.01, 0.15, 0.15, 0.4)
    for name, written, share in zip(names, line.groups(), shares):
        check_figure(name, written, summary[name], share)


def check_errors(text, work):
    """Surfaces and poses against the truth, in centimeters."""
    errors = r"within ([\d.]+) cm RMS \(the raw mesh: ([\d.]+) cm\), recorded poses within ([\d.]+) cm"
    found = re.search(errors, text)
    require(found, "README names no errors of model and poses")
    compared = json_of("biplane", "compare", work / "model", "--truth", work / "truth/surfaces.ply", "--json")
    words = ("biplane", "evaluate", "trajectory", work / "truth/poses.tum", work / "office.mcap", "--json")
    surfaces = [compared[name]["to_truth"]["rms_m"] for name in ("model", "raw")]
    measured = (*surfaces, json_of(*words)["absolute"]["translation_m"]["rmse"])
    for name, written, value_m in zip(("surfaces", "raw mesh", "poses"), found.groups(), measured):
        check_bound(f"{name}, cm:", written, 100 * value_m)


def main(work, section, files):
    blocks = commands_of(section)
    require(blocks, f"README has no commands under {section}")
    for file in map(Path, files):
        (work / file.name).symlink_to(file.resolve())
    words, quiet = ["bash", "-eu"], {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    done = subprocess.run(words, input="".join(blocks), cwd=work, text=True, **quiet)
    print(done.stderr, end="")
    require(done.returncode == 0, f"a command of README failed under {section}")
    count = sum(block.count("\n") for block in blocks)
    if section == "Five minutes":
        check_model_line(text_of(section), work)
        check_errors(text_of(section), work)
    print(f"{count} commands of README, {section}: done as written")


require(len(sys.argv) > 2, __doc__)
main(fresh_folder(sys.argv[1]), sys.argv[2], sys.argv[3:])
