#!/usr/bin/env python3
"""Recorders killed and disks filled for real, and what is left compared with what the mock devices sent.

    check_crash.py WORKDIR [--kills N] [--bad-files N] [--seed S] [--at-once K]

Needs `biplane-onboard`, `biplane-mock`, `biplane` on PATH and the package mcap; takes two minutes with 30
kills and 60 files.

Each kill: a mock rig on pseudo-terminals, `biplane-onboard record` in parts, SIGKILL at a seeded moment:
anywhere, right behind the order for the next part, or while the recording is finished. `salvage` must leave
whole parts (read by the Python `mcap` reader, all checksums), each topic's numbers without a gap, and every
scan that the mock sent until a second before.

Bad files: a recording damaged by seed, and files that are none, given to every program that reads recordings:
exit code 1 and one line, or the whole output; nothing half made.

Disks: a small tmpfs (root only) that comes near its end, and one that is filled at once by
somebody else."""

import argparse
import concurrent.futures
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from mcap.reader import make_reader

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.mock_rig import MockRig
from lib.programs import fresh_folder, output_of, run, simulate
from lib.verdict import fail, leave_out, require

PROMISED_S = 1.0
# A scan of 181 values takes 97 ms at 38400 Bd, and is in no program before; an adapter's delay, a busy
# machine.
ON_THE_LINE_S = 0.25
NEAR_S = 0.012


class Rig(MockRig):
    """Mock devices in a folder of their own, and a recorder that reads them."""

    def __init__(self, folder):
        super().__init__(fresh_folder(folder), "--world", "corridor", "--truth", folder / "truth")

    def record(self, output, *words):
        command = ["biplane-onboard", "record", "--rig", self.rig, "--output", output, "--raw", *words]
        with open(self.folder / "record.log", "ab") as log:
            return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def said(self):
        return (self.folder / "record.log").read_text()

    def truth(self):
        """When each horizontal scan that was sent was taken, s."""
        self.stop()
        with open(self.folder / "truth/scans_horizontal.txt") as lines:
            return [float(line.split()[0]) for line in lines if line[0].isdigit()]


def salvage(folder):
    start = time.monotonic()
    done = subprocess.run(["biplane-onboard", "salvage", folder], capture_output=True, text=True)
    require(done.returncode in (0, 3), f"salvage ended with {done.returncode}: {done.stderr}")
    left = [path.name for path in folder.iterdir() if path.suffix not in (".mcap", ".damaged")]
    require(not left, f"salvage left {left} behind")
    return time.monotonic() - start, done.stderr.strip()


def read(paths):
    """Stamps of the horizontal scans, s, and the last log time; every topic's numbers go on without a gap."""
    stamps, numbers, last = [], {}, 0
    for path in paths:
        with open(path, "rb") as file:
            for _, channel, message in make_reader(file, validate_crcs=True).iter_messages(
                log_time_order=False
            ):
                if channel.topic == "/tf_static":
                    continue
                expected = numbers.get(channel.topic, 0)
                found = message.sequence
                require(found == expected, f"{path.name}: {channel.topic} {found}, expected {expected}")
                numbers[channel.topic] = expected + 1
                last = max(last, message.log_time / 1e9)
                if channel.topic == "/scan/horizontal":
                    stamps.append(message.publish_time / 1e9)
    return stamps, last


def parts(folder):
    """The parts of a recording in their order; the first has no number."""

    def number(path):
        return int((re.search(r"_(\d+)\.mcap$", path.name) or [0, 0])[1])

    return sorted((path for path in folder.iterdir() if path.suffix == ".mcap"), key=number)


def assert_nothing_lost(stamps, truth, until):
    """Every scan sent until then was recorded, from the first one on."""
    require(stamps, "no scan at all")
    due = [t for t in truth if stamps[0] + NEAR_S < t <= until]
    near, missing = 0, []
    for t in due:
        while near + 1 < len(stamps) and stamps[near + 1] <= t + NEAR_S:
            near += 1
        if abs(stamps[near] - t) > NEAR_S:
            missing.append(t)
    if missing:
        fail(f"{len(missing)} of {len(due)} scans lost, the last {until - missing[-1]:.2f} s before")
    return len(due)


def one_kill(work, seed):
    dice = random.Random(seed)
    rig = Rig(work / f"kill-{seed}")
    folder = rig.folder / "run"
    folder.mkdir()
    recorder = rig.record(folder / "run.mcap", "--rotate-minutes", "60")
    end = time.monotonic() + 60
    while not any(path.stat().st_size > 20_000 for path in folder.iterdir()):
        require(recorder.poll() is None and time.monotonic() < end, f"it does not record: {rig.said()}")
        time.sleep(0.02)
    kind = ("anywhere", "next part", "finishing")[seed % 3]
    for _ in range(dice.randrange(4)):
        time.sleep(dice.uniform(0.2, 2.0))
        recorder.send_signal(signal.SIGUSR1)
    time.sleep(dice.uniform(0.5, 4.0))
    stopped = None
    if kind == "next part":
        recorder.send_signal(signal.SIGUSR1)
        time.sleep(dice.uniform(0.0, 0.05))
    if kind == "finishing":
        stopped = time.time()
        recorder.send_signal(signal.SIGINT)
        time.sleep(dice.uniform(0.0, 0.4))
    recorder.kill()
    killed = stopped or time.time()
    recorder.wait()
    truth = rig.truth()
    took, _ = salvage(folder)
    stamps, last = read(parts(folder))
    count = assert_nothing_lost(stamps, truth, killed - PROMISED_S - ON_THE_LINE_S)
    shutil.rmtree(rig.folder)
    return kind, count, max(0.0, killed - last), took


def kills(work, args):
    rows = {}
    with concurrent.futures.ThreadPoolExecutor(args.at_once) as pool:
        seeds = range(args.seed, args.seed + args.kills)
        for kind, count, lost, took in pool.map(lambda seed: one_kill(work, seed), seeds):
            rows.setdefault(kind, []).append((count, lost, took))
    for kind, row in sorted(rows.items()):
        scans, lost, took = sum(r[0] for r in row), max(r[1] for r in row), max(r[2] for r in row)
        print(
            f"| killed: {kind} | {len(row)} | {scans} scans, all | at most {lost:.2f} s "
            f"| {took * 1e3:.0f} ms |"
        )


KINDS = (
    "cut",
    "zeros behind",
    "random bytes behind",
    "bits flipped",
    "huge number",
    "stretch lost",
    "no recording",
)
NO_RECORDINGS = (b"", b"PARAM robot 1\n", b"PK\x03\x04" + bytes(900), bytes(70_000))


def damaged(whole, dice):
    """A recording's bytes with one kind of damage, in words."""
    place = dice.randrange(20, len(whole) - 20)
    kind = dice.choice(KINDS)
    if kind == "cut":
        return kind, whole[:place]
    if kind == "zeros behind":
        return kind, whole[:place] + bytes(dice.randrange(1, 9000))
    if kind == "random bytes behind":
        return kind, whole[:place] + dice.randbytes(dice.randrange(1, 9000))
    if kind == "stretch lost":
        return kind, whole[:place] + whole[place + dice.randrange(1, 9000) :]
    if kind == "no recording":
        return kind, dice.choice((*NO_RECORDINGS, dice.randbytes(9000)))
    changed = bytearray(whole)
    if kind == "huge number":
        changed[place : place + 8] = dice.choice((2**64 - 1, 2**63, 2**40, 2**31)).to_bytes(8, "little")
    else:
        for _ in range(dice.randrange(1, 9)):
            changed[dice.randrange(len(changed))] ^= 1 << dice.randrange(8)
    return kind, bytes(changed)


PROGRAMS = {
    "biplane info": ["biplane", "info", "bad.mcap"],
    "biplane traj": ["biplane", "traj", "bad.mcap", "-o", "out"],
    "biplane map": ["biplane", "map", "bad.mcap", "-o", "out"],
    "biplane optimize": ["biplane", "optimize", "bad.mcap", "-o", "out"],
    "biplane build": ["biplane", "build", "bad.mcap", "-o", "out"],
    "biplane recover": ["biplane", "recover", "bad.mcap", "-o", "out"],
    "biplane-onboard replay": ["biplane-onboard", "replay", "bad.mcap", "-o", "out"],
}


def one_bad_file(work, whole, seed):
    kind, content = damaged(whole, random.Random(seed))
    codes = []
    for name, words in PROGRAMS.items():
        folder = fresh_folder(work / f"bad-{seed}")
        (folder / "bad.mcap").write_bytes(content)
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=60)
        context = f"seed {seed}, {kind}: {name}: {done.returncode}: {done.stderr}"
        require(done.returncode in (0, 1, 3) and "panicked" not in done.stderr, context)
        require((folder / "bad.mcap").read_bytes() == content, f"{context}: it changed the file")
        left = [path.name for path in folder.iterdir() if path.name != "bad.mcap"]
        said = [line for line in done.stderr.splitlines() if line.startswith(name.split()[0] + ": ")]
        if done.returncode == 1:
            require(not left and len(said) == 1, f"{context}: left {left}")
        codes.append((name, done.returncode))
        shutil.rmtree(folder)
    return kind, codes


def bad_files(work, args):
    base = fresh_folder(work / "base")
    quiet = {"cwd": base, "capture_output": True}
    simulate("corridor", "c.mcap", "truth", **quiet)
    run("biplane-onboard", "replay", "c.mcap", "-o", "whole.mcap", **quiet)
    whole = (base / "whole.mcap").read_bytes()
    trials, refused = 0, 0
    with concurrent.futures.ThreadPoolExecutor(args.at_once) as pool:
        seeds = range(args.seed, args.seed + args.bad_files)
        for _, codes in pool.map(lambda seed: one_bad_file(work, whole, seed), seeds):
            trials += len(codes)
            refused += sum(code == 1 for _, code in codes)
    kept = f"{refused} refused in one line, no panic, nothing half made"
    print(f"| bad files to {len(PROGRAMS)} programs | {trials} | {kept} | - | - |")


def free(folder):
    stat = os.statvfs(folder)
    return stat.f_bavail * stat.f_frsize


def fill(folder, name, leave):
    """A file of somebody else's that leaves so many bytes."""
    with open(folder / name, "wb") as file:
        while free(folder) > leave:
            try:
                file.write(bytes(min(1 << 16, max(4096, free(folder) - leave))))
                file.flush()
            except OSError:
                break


def full_disks(work):
    disk = work / "disk"
    disk.mkdir(parents=True, exist_ok=True)
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=64m", "tmpfs", disk], capture_output=True
    ).returncode:
        leave_out("full disks (no right to mount)")
        return
    try:
        nearly_full(work, disk)
        full_at_once(work, disk)
    finally:
        subprocess.run(["umount", "-l", disk], check=True)


def nearly_full(work, disk):
    fill(disk, "somebody", 50_150_000)
    rig = Rig(work / "nearly-full")
    code = rig.record(disk / "run.mcap").wait(timeout=120)
    rig.truth()
    require(code == 3 and "CUT SHORT" in rig.said(), f"a disk nearly full: exit code {code}: {rig.said()}")
    names = sorted(path.name for path in disk.iterdir())
    require(names == ["run.mcap", "somebody"], f"on a disk nearly full it left {names}")
    output_of("biplane", "info", disk / "run.mcap")
    with open(disk / "run.mcap", "rb") as file:
        messages = make_reader(file).iter_messages(["/diagnostics"])
        warned = [message.log_time for _, _, message in messages if b"little room left" in message.data]
    require(warned, "no warning before the disk was full")
    print(f"| disk nearly full | 1 | a whole file, exit code 3, {len(warned)} warnings before | 0 | - |")
    (disk / "run.mcap").unlink()
    (disk / "somebody").unlink()


def full_at_once(work, disk):
    rig = Rig(work / "full")
    folder = disk / "runs"
    folder.mkdir()
    recorder = rig.record(f"{folder}/")
    time.sleep(8)
    filled = time.time()
    fill(disk, "somebody", 0)
    code = recorder.wait(timeout=60)
    truth = rig.truth()
    said = rig.said()
    require(code in (1, 3), f"a disk that is full at once: exit code {code}: {said}")
    lines = [line for line in said.splitlines() if "disk full" in line or "CUT SHORT" in line]
    require(len(lines) == 1, f"it does not say once that the disk is full: {said}")
    (disk / "somebody").unlink()
    took, _ = salvage(folder)
    stamps, last = read(parts(folder))
    count = assert_nothing_lost(stamps, truth, filled - PROMISED_S - ON_THE_LINE_S)
    kept, lost_s = f"{count} scans, all; exit code {code}: {lines[0].strip()}", max(0, filled - last)
    print(f"| disk full at once | 1 | {kept} | {lost_s:.2f} s | {took * 1e3:.0f} ms |")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("work", type=Path)
    parser.add_argument("--kills", type=int, default=12)
    parser.add_argument("--bad-files", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--at-once", type=int, default=3)
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    work = args.work.resolve()
    bad_files(work, args)
    kills(work, args)
    full_disks(work)


main()
