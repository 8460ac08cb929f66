#!/usr/bin/env python3
"""Runs README's commands as a newcomer pastes them: those of a section, in its order, in an empty folder.

    check_readme.py WORKDIR SECTION [FILE...]      with the three programs on PATH; the FILEs are there before
    the first command

Blocks that build the programs or install them (cargo) are left out: who runs this has done it. Fails when a
command does."""

import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import ROOT, fresh_folder
from lib.verdict import require


def commands_of(section):
    """The blocks of shell commands below a heading of README."""
    text = re.search(rf"^## {re.escape(section)}\n(.*?)^## ", (ROOT / "README.md").read_text(), re.S | re.M)
    require(text, f"README has no section {section}")
    return [
        block
        for block in re.findall(r"^```sh\n(.*?)^```", text.group(1), re.S | re.M)
        if "cargo " not in block
    ]


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
    print(f"{count} commands of README, {section}: done as written")


require(len(sys.argv) > 2, __doc__)
main(fresh_folder(sys.argv[1]), sys.argv[2], sys.argv[3:])
