#!/usr/bin/env python3
"""How well are height, roll and pitch of simulated drives found, and does a flat floor stay flat to the bit?

    check_sixdof.py DIR [--world WORLD]... [--path PATH] [--seeds N] [--rig RIG.toml] [--ate M] [--height M]
                    [--tilt DEG] [--flat] [--planar] [--hold LEAST MOST] [--first SEED] [--each]
                    [--rise M] [--sigmas N]

Simulates each world with N seeds, replays the bytes, optimizes, and compares the optimized poses with the
truth: RMS over the way after the best motion in the plane (x, y, heading); heights and tilts as they are.
`within` is the share of heights, rolls and pitches whose error is below three stated standard deviations;
`inside` the shares of x, y, z, roll, pitch and heading in their 95 % intervals, which `--hold` bounds.
`rise` is the error of the height from the drive's start to its end (levels of decks), which `--rise` bounds,
in meters and in stated standard deviations, which `--sigmas` bounds.
Limits hold for the worst seed, or for the median with `--median`; `--flat` wants height, roll and pitch of
all poses to be 0 to the bit. `--each` prints every drive. Needs `biplane`, `biplane-onboard`, `biplane-mock`
on PATH, numpy, rosbags."""

import argparse
import sys
from pathlib import Path

from rosbags.highlevel import AnyReader

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import np
from lib.programs import fresh_folder, run
from lib.verdict import require

# Half of a 95 % interval, in standard deviations.
INTERVAL_95 = 1.96
PARTS = ("ate_m", "worst_m", "z_m", "worst_z_m", "roll_deg", "pitch_deg", "rise_m", "rise_sigmas")


def angles(quaternions):
    """Roll, pitch and heading of quaternions (x, y, z, w), radians."""
    x, y, z, w = np.asarray(quaternions).T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.stack([roll, pitch, yaw], axis=1)


def optimized(recording):
    """Stamps (s), x, y, z, roll, pitch, heading and covariances of the poses of a recording."""
    stamps, poses, covariances = [], [], []
    with AnyReader([recording]) as reader:
        of_pose = [connection for connection in reader.connections if connection.topic == "/pose"]
        for connection, _, raw in reader.messages(connections=of_pose):
            message = reader.deserialize(raw, connection.msgtype)
            stamp, pose = message.header.stamp, message.pose.pose
            at, turn = pose.position, pose.orientation
            stamps.append(stamp.sec + stamp.nanosec * 1e-9)
            poses.append([at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w])
            covariances.append(np.reshape(message.pose.covariance, (6, 6)))
    poses = np.array(poses)
    return np.array(stamps), np.hstack([poses[:, :3], angles(poses[:, 3:])]), np.array(covariances)


def true_poses(path, stamps):
    """The truth at some stamps."""
    rows = np.loadtxt(path)
    parts = np.hstack([rows[:, 1:4], angles(rows[:, 4:8])])
    parts[:, 5] = np.unwrap(parts[:, 5])
    return np.stack([np.interp(stamps, rows[:, 0], part) for part in parts.T], axis=1)


def wrapped(off):
    """Differences with the heading between -pi and pi."""
    off = off.copy()
    off[:, 5] = (off[:, 5] + np.pi) % (2 * np.pi) - np.pi
    return off


def position_errors(found, truth):
    """Distances on the floor plan after the best motion in the plane, meters."""
    a, b = found[:, :2] - found[:, :2].mean(0), truth[:, :2] - truth[:, :2].mean(0)
    turn = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    sin, cos = np.sin(turn), np.cos(turn)
    return np.hypot(*(a @ np.array([[cos, sin], [-sin, cos]]) - b).T)


def measured(folder, world, seed, args):
    """The errors of one drive."""
    folder = fresh_folder(folder / f"{world}-{seed}")
    capture, recording, better = (folder / name for name in ("c.mcap", "run.mcap", "opt.mcap"))
    words = ["--path", args.path] if args.path else []
    drive = ["--world", world, "--seed", seed, "-o", capture, "--truth", folder / "truth", *words]
    run("biplane-mock", "simulate", *drive, *(["--rig", args.rig] if args.rig else []))
    run("biplane-onboard", "replay", capture, "-o", recording, stdout=-3, stderr=-3)
    run("biplane", "--quiet", "optimize", recording, "-o", better, *(["--planar"] if args.planar else []))
    stamps, found, covariances = optimized(better)
    truth = true_poses(folder / "truth/trajectory.tum", stamps)
    flat, off = position_errors(found, truth), found - truth
    rms = [np.sqrt(np.mean(np.square(part))) for part in off.T]
    sigmas = np.sqrt(np.maximum(np.einsum("nii->ni", covariances), 1e-18))
    rise = abs(off[-1, 2] - off[0, 2])
    errors = dict(
        zip(
            PARTS,
            [np.sqrt(np.mean(flat**2)), flat.max(), rms[2], np.abs(off[:, 2]).max()]
            + [np.degrees(rms[3]), np.degrees(rms[4]), rise, rise / sigmas[-1, 2]],
            strict=True,
        )
    )
    errors["within"] = np.mean(np.abs(off[:, 2:5]) < 3 * sigmas[:, 2:5])
    errors["inside"] = np.mean(np.abs(wrapped(off)) < INTERVAL_95 * sigmas, axis=0)
    errors["is_flat"] = not np.any(found[:, 2:5])
    if args.each:
        words = ", ".join(f"{part} {errors[part]:.4f}" for part in PARTS)
        print(f"{world} {seed}: {words}, within {errors['within']:.2f}{', flat' * errors['is_flat']}")
    return errors


def judge(world, drives, args):
    """Prints the errors of all seeds and holds them against the limits."""
    over = np.median if args.median else np.max
    text = ", ".join(f"{part} {over([drive[part] for drive in drives]):.4f}" for part in PARTS)
    within = np.mean([drive["within"] for drive in drives])
    print(
        f"{world}, {len(drives)} seeds, {'median' if args.median else 'worst'}: {text}, within {within:.2f}"
    )
    inside = np.mean([drive["inside"] for drive in drives], axis=0)
    print(f"{world}: inside {', '.join(f'{share:.3f}' for share in inside)}")
    if args.hold:
        low, high = args.hold
        held = np.all((inside >= low) & (inside <= high))
        require(held, f"{world}: 95 % intervals hold {inside}, {low} to {high} is wanted")
    tilt = {"tilt_deg": [max(drive["roll_deg"], drive["pitch_deg"]) for drive in drives]}
    limits = {"ate_m": args.ate, "z_m": args.height, "tilt_deg": args.tilt}
    limits |= {"rise_m": args.rise, "rise_sigmas": args.sigmas}
    for name, limit in limits.items():
        values = tilt.get(name) or [drive[name] for drive in drives]
        if limit is not None:
            require(over(values) <= limit, f"{world}: {name} {over(values):.4f}, at most {limit} is wanted")
    if args.flat:
        require(all(drive["is_flat"] for drive in drives), f"{world}: the floor is not flat to the bit")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, metavar="DIR")
    parser.add_argument("--world", action="append", metavar="WORLD")
    parser.add_argument("--path")
    parser.add_argument("--rig", type=Path)
    parser.add_argument("--seeds", type=int, default=1, metavar="N")
    parser.add_argument("--ate", type=float, metavar="M")
    parser.add_argument("--height", type=float, metavar="M")
    parser.add_argument("--tilt", type=float, metavar="DEG")
    parser.add_argument("--hold", type=float, nargs=2, metavar=("LEAST", "MOST"))
    parser.add_argument("--first", type=int, default=1, metavar="SEED")
    parser.add_argument("--rise", type=float, metavar="M")
    parser.add_argument("--sigmas", type=float, metavar="N")
    for switch in ("flat", "planar", "median", "each"):
        parser.add_argument(f"--{switch}", action="store_true")
    args = parser.parse_args()
    for world in args.world or ["ramp-up"]:
        drives = [
            measured(args.folder, world, seed, args) for seed in range(args.first, args.first + args.seeds)
        ]
        judge(world, drives, args)


if __name__ == "__main__":
    main()
