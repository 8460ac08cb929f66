#!/usr/bin/env python3
"""Does `biplane calibrate` find a vertical laser that sits elsewhere and is later than the rig says?

    check_calibration.py WORKDIR [DRIVES]      with `biplane`, `biplane-onboard`, `biplane-mock` on PATH

Simulated drives, judged by numpy's own arithmetic and the simulator's truth; takes 10 s. With DRIVES as many
more on each path, lobby and loop, of rigs by chance: what is told must be true within its own standard
deviations."""

import json
import sys
import tomllib
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import np
from lib.programs import RIGS, fresh_folder, output_of
from lib.verdict import require

# Place in meters, turns in degrees, milliseconds; seeds.
CASES = [
    ({"x": 0.08, "y": -0.02, "z": 0.45, "roll": 1.0, "pitch": -88.5, "yaw": -3.0}, 30.0, 1),
    ({"x": 0.02, "y": 0.02, "z": 0.45, "roll": 0.0, "pitch": -91.5, "yaw": 2.0}, -40.0, 2),
]
USUAL = {"x": 0.05, "y": 0.0, "z": 0.45, "roll": 0.0, "pitch": -90.0, "yaw": 0.0}
PAPER = (RIGS / "paper.toml").read_text()
UNITS = {"x": 1e3, "y": 1e3, "about_x": 1, "about_y": 1, "about_z": 1, "delay_ms": 1}
# Beyond so many standard deviations something told is not true.
SURELY = 3.0
# What a drive through the lobby tells at least so well.
WITHIN_M, WITHIN_DEG, WITHIN_MS, WAY_WITHIN = 0.01, 0.3, 5.0, 0.005


def rotation(mount):
    roll, pitch, yaw = (np.radians(mount[key]) for key in ("roll", "pitch", "yaw"))
    about_x = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    about_y = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    about_z = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def words(mount):
    return "mount = { " + ", ".join(f"{key} = {value}" for key, value in mount.items()) + " }"


def calibrated(work, path, mount, delay_ms, seed):
    """What is said of a drive by a rig that is otherwise than its file says, and the corrected rig."""
    require(words(USUAL) in PAPER, "rigs/paper.toml has another vertical mount")
    fresh_folder(work)
    (work / "usual.toml").write_text(PAPER)
    (work / "true.toml").write_text(PAPER.replace(words(USUAL), f"{words(mount)}\ndelay_ms = {delay_ms}"))
    output_of(
        "biplane-mock",
        "simulate",
        "--world",
        "office",
        "--path",
        path,
        "--rig",
        work / "true.toml",
        "--seed",
        seed,
        "-o",
        work / "capture.mcap",
        "--truth",
        work / "truth",
    )
    output_of(
        "biplane-onboard",
        "replay",
        work / "capture.mcap",
        "--rig",
        work / "usual.toml",
        "-o",
        work / "run.mcap",
    )
    said = json.loads(
        output_of("biplane", "calibrate", work / "run.mcap", "-o", work / "found.toml", "--json")
    )
    output_of("biplane-onboard", "check-config", "--rig", work / "found.toml")
    return said, tomllib.loads((work / "found.toml").read_text())


def check(work, mount, delay_ms, seed):
    said, found = calibrated(work, "lobby", mount, delay_ms, seed)
    at = found["vertical"]["mount"]
    off_m = np.hypot(at["x"] - mount["x"], at["y"] - mount["y"])
    turn = rotation(at) @ rotation(mount).T
    off_deg = np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))
    off_ms = abs(found["vertical"]["delay_ms"] - delay_ms)
    # A base of the simulator counts 1 % too much.
    off_way = abs(found["base"]["metres_per_tick"] * 1.01 / 0.001 - 1)
    observed = {row["name"] for row in said["rows"] if row["observed"]}
    print(
        f"seed {seed}: {off_m * 1e3:.1f} mm, {off_deg:.3f} deg, {off_ms:.2f} ms, "
        f"way {off_way * 100:.2f} % off; observed {sorted(observed)}"
    )
    near = off_m < WITHIN_M and off_deg < WITHIN_DEG and off_ms < WITHIN_MS and off_way < WAY_WITHIN
    require(near, f"seed {seed}: what was found is too far off")
    wanted = {"x", "y", "about_x", "about_y", "about_z", "delay_ms"}
    require(wanted <= observed and "z" not in observed, f"seed {seed}: observed are {sorted(observed)}")


def errors(work, path, seed):
    """Of a rig by chance: each row's error, its standard deviation, and whether it was observed."""
    chance = np.random.default_rng(seed)
    mount = {
        "x": 0.05 + chance.uniform(-0.03, 0.03),
        "y": chance.uniform(-0.03, 0.03),
        "z": 0.45,
        "roll": chance.uniform(-2, 2),
        "pitch": -90 + chance.uniform(-2, 2),
        "yaw": chance.uniform(-2, 2),
    }
    delay_ms = round(chance.uniform(-40, 40), 1)
    said, _ = calibrated(work, path, mount, delay_ms, seed)
    turn = rotation(mount) @ rotation(USUAL).T
    about = np.degrees([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    true = {
        "x": mount["x"] - USUAL["x"],
        "y": mount["y"],
        "about_x": about[0],
        "about_y": about[1],
        "about_z": about[2],
        "delay_ms": delay_ms,
    }
    rows = {row["name"]: row for row in said["rows"]}
    off = {name: rows[name]["correction"] - true[name] for name in true}
    return {
        name: (off[name] * UNITS[name], rows[name]["sigma"] * UNITS[name], rows[name]["observed"])
        for name in true
    }


def drives(base, path, count):
    all_of = [errors(base / f"{path}{seed}", path, seed) for seed in range(1, count + 1)]
    print(f"{path}, {count} drives: rms and largest error; the same in standard deviations; observed in")
    for name in UNITS:
        off, sigma, observed = (np.array(column) for column in zip(*(drive[name] for drive in all_of)))
        shares = np.abs(off / sigma)
        rms, rms_share = np.sqrt(np.mean(off**2)), np.sqrt(np.mean(shares**2))
        largest, largest_share = np.abs(off).max(), shares.max()
        print(f"  {name:9} {rms:.3f} {largest:.3f}   {rms_share:.2f} {largest_share:.2f}   {observed.sum()}")
        require(
            largest_share < SURELY, f"{path}: {name} is off by {largest_share:.1f} of its standard deviations"
        )


def main():
    require(len(sys.argv) > 1, __doc__)
    base = Path(sys.argv[1])
    for mount, delay_ms, seed in CASES:
        check(base / str(seed), mount, delay_ms, seed)
    if len(sys.argv) > 2:
        drives(base, "lobby", int(sys.argv[2]))
        drives(base, "loop", int(sys.argv[2]))


main()
