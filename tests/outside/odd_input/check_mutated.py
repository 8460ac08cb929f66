#!/usr/bin/env python3
"""Gives mutated files to every command that reads such files: a result or a clear error each.

    check_mutated.py WORKDIR [--recordings 1000] [--shapes 1000] [--first 1]

Recordings are mutated in two ways. Bytes are flipped, cut, moved and repeated; or messages, attachments
and channels are changed and written again with checksums that are right. Shapes are clouds, meshes, logs,
trajectories and rigs. Every run has 2 GB of address space and 20 s. It is a fault when a run panics, is
ended by a signal, takes longer, fails without a sentence, leaves something behind when it fails, or nothing
when it does not.

The number of a file is its seed: `--first 17 --recordings 1` makes one again. Files with faults stay in
WORKDIR/faults. Needs `biplane`, `biplane-onboard` and `biplane-mock` on PATH, and numpy, laspy with lazrs,
pye57, pypcd4 and mcap. A thousand of each take three minutes on two busy cores."""

import argparse
import os
import resource
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import fresh_folder, run
from lib.verdict import require
from odd_input.mutated_files import base_shapes, mutated_shape
from odd_input.mutated_recordings import Recording, mutated_recording

ADDRESS_SPACE_BYTES = 2 << 30
LONGEST_S = 20
AT_ONCE = 2
SAID_TO_STAY = "keeps what there was"
# A stretch of the drive that has a few scans of everything.
BASE_S = 5.0

# Words of a command, and the name of what it writes; IN is the file.
OF_RECORDINGS = [
    ("biplane info IN", None),
    ("biplane traj IN -o out", "out"),
    ("biplane map IN -o out", "out.pgm"),
    ("biplane optimize IN -o out", "out"),
    ("biplane build IN -o out", "out"),
    ("biplane calibrate IN", None),
    ("biplane evaluate map IN", None),
    ("biplane recover IN -o out", "out"),
    ("biplane-onboard replay IN -o out", "out"),
]
OF_SHAPES = {
    "cloud": [("biplane planes IN -o out", "out")],
    "mesh": [("biplane compact IN -o out", "out")],
    "log": [("biplane import carmen IN -o out", "out")],
    "poses": [
        ("biplane evaluate trajectory ../posed.tum IN", None),
        ("biplane build ../posed.mcap --poses IN -o out", "out"),
    ],
    "rig": [("biplane-onboard replay ../posed.mcap --rig IN -o out", "out")],
}


def outcome_in(folder, words, output):
    """Runs one command in a folder that holds its input alone: its exit code, and what is wrong with it."""
    before = set(os.listdir(folder))
    start = time.monotonic()
    try:
        done = subprocess.run(
            words, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, timeout=LONGEST_S
        )
    except subprocess.TimeoutExpired:
        return None, f"not done after {LONGEST_S} s"
    code, said = done.returncode, done.stderr.decode(errors="replace")
    end = f"exit code {code} after {time.monotonic() - start:.1f} s: {said.strip()[-400:]}"
    made = set(os.listdir(folder)) - before
    sentences = [line for line in said.splitlines() if line.startswith(("biplane", "error:"))]
    if code not in (0, 1, 2, 3) or "panicked" in said:
        return code, end
    if code in (0, 3) and output and output not in made:
        return code, f"nothing written, {end}"
    # A replay without any pose has failed; the scans that it has recorded stay, and it says so.
    if code in (1, 2) and made and SAID_TO_STAY not in said:
        return code, f"{sorted(made)} left, {end}"
    if code in (1, 2) and not sentences:
        return code, f"no sentence, {end}"
    return code, None


def try_file(work, name, content, commands):
    """Gives one file to commands: their exit codes and their faults."""
    codes, faults = [], []
    folder = work / f"run-{name}"
    for command, output in commands:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        (folder / name).write_bytes(content)
        words = [name if word == "IN" else word for word in command.split()]
        code, fault = outcome_in(folder, words, output)
        codes.append(code)
        if fault:
            (work / "faults").mkdir(exist_ok=True)
            (work / "faults" / name).write_bytes(content)
            faults.append(f"{name}: {' '.join(words)}: {fault}")
    shutil.rmtree(folder, ignore_errors=True)
    return codes, faults


def make_bases(work):
    """A short posed recording, the capture that it was made of, and its trajectory."""
    capture, whole, posed = work / "capture.mcap", work / "whole.mcap", work / "posed.mcap"
    run("biplane-mock", "simulate", "--world", "corridor", "-o", capture, stderr=subprocess.DEVNULL)
    run("biplane-onboard", "--quiet", "replay", capture, "-o", whole)
    recordings = [Recording.read(path, BASE_S) for path in (whole, capture)]
    posed.write_bytes(recordings[0].written())
    run("biplane", "--quiet", "traj", posed, "-o", work / "posed.tum")
    # What is not mutated goes through everything, or nothing would be tried. It is too short to calibrate by.
    commands = [row for row in OF_RECORDINGS if "calibrate" not in row[0]]
    codes, faults = try_file(work, "base.mcap", posed.read_bytes(), commands)
    require(set(codes) == {0} and not faults, f"the file that is mutated: {codes} {faults}")
    return recordings


def of_recordings(work, seeds, recordings):
    for seed in seeds:
        content = mutated_recording(seed, recordings[seed % 8 in (3, 6)])
        yield f"mutated-{seed}.mcap", content, OF_RECORDINGS


def of_shapes(work, seeds):
    shapes = base_shapes(work)
    for seed in seeds:
        kind, name, content = mutated_shape(seed, shapes)
        yield f"mutated-{seed}-{name}", content, OF_SHAPES[kind]


def judge(title, work, trials):
    """Tries all, some at a time; their faults."""
    start, files, codes, faults = time.monotonic(), 0, [], []
    with ThreadPoolExecutor(AT_ONCE) as pool:
        tried = [pool.submit(try_file, work, *trial) for trial in trials]
        for one in tried:
            files += 1
            codes += one.result()[0]
            faults += one.result()[1]
    took_s = time.monotonic() - start
    done, lossy = codes.count(0), codes.count(3)
    print(
        f"{title}: {files} files, {len(codes)} runs in {took_s:.0f} s: {done} gave a result, "
        f"{lossy} one with a loss, {len(codes) - done - lossy} an error; {len(faults)} faults",
        flush=True,
    )
    return faults


def main(args):
    work = fresh_folder(args.work)
    # Inherited by what is run here.
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE_BYTES, ADDRESS_SPACE_BYTES))
    recordings = make_bases(work)
    seeds = range(args.first, args.first + args.recordings)
    faults = judge("recordings", work, of_recordings(work, seeds, recordings))
    seeds = range(args.first, args.first + args.shapes)
    faults += judge("clouds, meshes, logs, trajectories, rigs", work, of_shapes(work, seeds))
    for fault in faults:
        print(f"FAULT: {fault}", file=sys.stderr)
    sys.exit(1 if faults else 0)


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
parser.add_argument("work", type=Path, metavar="WORKDIR")
parser.add_argument("--recordings", type=int, default=1000)
parser.add_argument("--shapes", type=int, default=1000)
parser.add_argument("--first", type=int, default=1)
main(parser.parse_args())
