"""Running programs: the three of Biplane from PATH, others of this folder, and those of other people."""

import json
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

from lib.verdict import fail

OUTSIDE = Path(__file__).resolve().parents[1]
ROOT = OUTSIDE.parents[1]
RIGS = ROOT / "hil-fixtures/rigs"
WORLDS = ROOT / "hil-fixtures/worlds"


def run(*words, **options):
    """Runs a program to its end; fails with what it said last when its exit code is not 0."""
    words = [str(word) for word in words]
    sys.stdout.flush()
    try:
        done = subprocess.run(words, text=True, **options)
    except FileNotFoundError:
        fail(f"{words[0]} is not there")
    if done.returncode != 0:
        said = "".join(text for text in (done.stdout, done.stderr) if text)[-2000:].strip()
        fail(f"`{' '.join(words)}` ended with exit code {done.returncode}. {said}")
    return done


def output_of(*words, **options):
    """What a program that ends well writes to its standard output."""
    return run(*words, stdout=subprocess.PIPE, **options).stdout


def json_of(*words, **options):
    """The same, read as JSON."""
    return json.loads(output_of(*words, **options))


def outcome_of(*words, **options):
    """Exit code and everything that was said, of a program that may fail."""
    words = [str(word) for word in words]
    done = subprocess.run(words, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options)
    return done.returncode, done.stdout


def run_check(name, *words):
    """Runs another program of this folder, named by its path: with this Python, node or as it is."""
    interpreters = {".py": [sys.executable], ".js": ["node"], ".sh": []}
    path = OUTSIDE / name
    run(*interpreters[path.suffix], path, *words)


def fresh_folder(path):
    """An empty folder, as an absolute path; what was there goes."""
    folder = Path(path).resolve()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def wait_until(condition, seconds, otherwise):
    """Waits until the condition holds, or fails with a sentence."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            fail(otherwise)
        time.sleep(0.05)


def peak_memory_mb(pid):
    """The most memory that a living process has had resident, in MiB; 0 when it is gone. The kernel's own
    count: `ru_maxrss` of a child would include what this process had when it forked."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0.0
    peak = re.search(r"VmHWM:\s+(\d+) kB", status)
    return int(peak.group(1)) / 1024 if peak else 0.0


def simulate(world, capture, truth, rig=None, seed=1, **options):
    """A simulated drive through a world: its serial bytes, and the truth of it."""
    words = ["--world", world, "--seed", seed, "-o", capture, "--truth", truth]
    run("biplane-mock", "simulate", *words, *(["--rig", rig] if rig else []), **options)
