#!/usr/bin/env python3
"""Gives clouds, meshes and recordings that are no building, and files that lie, to `biplane`: a clear result
or a clear error each.

    check_odd_input.py WORKDIR

Every run ends within a minute, in less than 1.5 GB, without a panic, with exit code 0, 1 or 2. What `planes`
calls a plane is flat within the noise; what `compact` writes passes the validators, covers about as much
surface as the mesh has, and lies on it. Needs `biplane` on PATH, gltf-validator on NODE_PATH, and numpy,
shapely, cjio, laspy with lazrs, pye57, pypcd4. Takes three minutes."""

import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.verdict import require
from odd_input.clouds import broken_clouds, clouds
from odd_input.meshes import broken_meshes, meshes
from odd_input.trials import fails, trials

RECORDINGS = {
    "empty.mcap": b"",
    "words.mcap": b"hello world\n" * 99,
    "magic.mcap": b"\x89MCAP0\r\n",
    "cut.mcap": b"\x89MCAP0\r\n" + bytes(range(256)) * 9,
    "boast.mcap": b"\x89MCAP0\r\n\x01" + b"\xff" * 7 + b"\x7f",
}


def broken_recordings():
    for name, content in RECORDINGS.items():
        Path(name).write_bytes(content)
        fails(name, name, command="build")


def main(work):
    work.mkdir(parents=True, exist_ok=True)
    os.chdir(work)
    for part in (clouds, broken_clouds, meshes, broken_meshes, broken_recordings):
        start, before = time.monotonic(), trials.runs
        part()
        took_s = time.monotonic() - start
        print(f"{part.__name__.replace('_', ' ')}: {trials.runs - before} runs in {took_s:.0f} s", flush=True)
    for fault in trials.faults:
        print(f"FAULT: {fault}", file=sys.stderr)
    print(f"{trials.runs} runs, {len(trials.faults)} faults")
    sys.exit(1 if trials.faults else 0)


require(len(sys.argv) == 2, __doc__)
main(Path(sys.argv[1]))
