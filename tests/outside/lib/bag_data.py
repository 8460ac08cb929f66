"""The bags of a folder: each is imported, and held against another reader and against its truth."""

import json

import numpy as np

from lib import bags
from lib.programs import outcome_of, run
from lib.verdict import require

# A mount out of a chain of transforms, in m and of a quaternion.
MOUNT_WITHIN = 1e-6
# Poses while driving against the truth, in m: rooms of some 8 m, noise of 10 mm, 2 to 5 s.
POSES_WITHIN_M = 0.03
# Beams whose time is guessed, and stamps of other moments: at 0.5 m/s by up to 40 ms.
ODD_POSES_WITHIN_M = 0.06
ODD_TIMES = ("ros1_odd_scan",)
# What a reader refuses that needs an index.
WITHOUT_INDEX = ("ros1_odd_unindexed",)
REAL = "rms_1xxx_lms_1xx_movement_off"


def path_of(folder, name):
    return next(path for path in (folder / f"{name}.bag", folder / name) if path.exists())


def aligned_error_m(made, truth):
    """The largest distance of poses from the truth's at the same stamps, both begun at the first."""

    def from_first(rows):
        angle = 2 * np.arctan2(rows[0, 6], rows[0, 7])
        cos, sin = np.cos(angle), np.sin(angle)
        return (rows[:, 1:3] - rows[0, 1:3]) @ np.array([[cos, -sin], [sin, cos]])

    times = np.round(truth[:, 0], 6)
    rows = [np.argmin(np.abs(times - time)) for time in made[:, 0]]
    apart = np.abs(times[rows] - made[:, 0]).max()
    require(apart < 2e-6, f"a pose {apart} s from any stamp of the truth")
    return np.linalg.norm(from_first(made) - from_first(truth[rows]), axis=1).max()


def check_mounts(name, recording, facts):
    found = bags.mounts(recording)
    for laser, frame in zip(facts["lasers"], ("laser_horizontal", "laser_vertical"), strict=True):
        place, turn = found[frame]
        off = np.abs(place - laser["base_from_laser_xyz"]).max()
        turned = 1 - abs(np.dot(turn, laser["base_from_laser_quat_xyzw"]))
        require(
            off < MOUNT_WITHIN and turned < MOUNT_WITHIN,
            f"{name}: {frame} is {off} m, {turned} off its place",
        )


def check_one(folder, work, facts):
    """One bag with truth; returns what it was measured by."""
    name = facts["name"]
    (work / name).mkdir()
    bag, recording, posed = path_of(folder, name), work / f"{name}.mcap", work / name / "run.mcap"
    code, said = outcome_of("biplane", "import", "bag", bag, "-o", recording)
    expected = 3 if facts["unindexed"] else 0
    require(code == expected, f"{name}: exit code {code}, expected {expected}: {said}")
    if name not in WITHOUT_INDEX:
        for laser, ours in zip(facts["lasers"], ("scan/horizontal", "scan/vertical"), strict=True):
            wrong = bags.difference(bag, recording, laser["topic"], ours, laser["time_increment"])
            require(wrong is None, f"{name}, {laser['topic']}: {wrong}")
        if "topic" in facts["odom"]:
            wrong = bags.poses_differ(bag, recording, facts["odom_topic"], "odom")
            require(wrong is None, f"{name}, odometry: {wrong}")
        if facts["imu"]:
            wrong = bags.inertia_differs(bag, recording, facts["imu"])
            require(wrong is None, f"{name}, inertial unit: {wrong}")
    check_mounts(name, recording, facts)
    run("biplane-onboard", "replay", recording, "-o", posed, capture_output=True)
    run("biplane", "traj", posed, "-o", work / f"{name}.tum", capture_output=True)
    made, truth = (bags.trajectory(path) for path in (work / f"{name}.tum", folder / "truth" / f"{name}.tum"))
    error_m = aligned_error_m(made, truth)
    within_m = ODD_POSES_WITHIN_M if name in ODD_TIMES else POSES_WITHIN_M
    require(error_m < within_m, f"{name}: poses up to {error_m:.3f} m off the truth, {within_m} allowed")
    return len(made), error_m


def check(folder, work, tally):
    for truth in sorted((folder / "truth").glob("*.json")):
        facts = json.loads(truth.read_text())
        count, error_m = check_one(folder, work, facts)
        what = "" if facts["name"] in WITHOUT_INDEX else "scans as another reader finds them, "
        tally.ok(f"{facts['name']}: {what}mounts, {count} poses within {1000 * error_m:.0f} mm of the truth")
    one_drive = [work / f"{name}.mcap" for name in ("ros1_none", "ros1_lz4", "ros1_bz2")]
    first = [bags.scans(path, "scan/horizontal") for path in one_drive]
    require(
        len({len(scans) for scans in first}) == 1, "the same messages packed in three ways make three drives"
    )
    models = same_models(folder, work)
    tally.ok(f"the same model from {models} bags of one drive, byte for byte")
    bag, recording = path_of(folder, REAL), work / "real.mcap"
    code, said = outcome_of("biplane", "import", "bag", bag, "-o", recording)
    require(code == 0 and "no odometry" in said, f"the real bag: exit code {code}: {said}")
    wrong = bags.difference(bag, recording, "sick_lms_1xx/scan", "scan/horizontal")
    require(wrong is None, f"the real bag: {wrong}")
    tally.ok("the real bag of a standing LMS 1xx, scan for scan")


def same_models(folder, work):
    """Builds all bags of one drive and compares what comes out."""
    kinds, models = ("ros1_none", "ros1_lz4", "ros1_bz2", "ros2_sqlite3", "ros2_mcap"), {}
    for name in kinds:
        model = work / f"{name}.model"
        run("biplane", "build", work / name / "run.mcap", "-o", model, capture_output=True)
        models[name] = (model / "model.ply").read_bytes()
    # rosbags draws the stamps of a ROS 1 and of a ROS 2 bag from the same drive, the same to the bit.
    require(
        len(set(models.values())) == 1, f"other models: {[len(model) for model in models.values()]} bytes"
    )
    return len(kinds)
