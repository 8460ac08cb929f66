"""A simulated drive, replayed from its serial bytes and by way of bags of rosbags: poses and model."""

import numpy as np
from rosbags.rosbag1 import Writer as BagWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as FolderWriter
from rosbags.typesys import Stores

from lib import bags
from lib.programs import json_of, run, simulate
from lib.verdict import require

TOPICS = {"scan/horizontal": "/scan", "scan/vertical": "/scan_up", "odom": "/odom", "tf_static": "/tf_static"}
# The bag's stamps are rounded to nothing and its ranges are floats as ours: the rest is the order in which
# odometry comes, by receipt live, by stamp imported.
POSES_WITHIN_M = 0.01
# Points a scan, a share of them; and scans that are kept.
POINTS_WITHIN = 0.001
KEPT_WITHIN = 1
# How much farther from the truth the model by way of a bag may be: to the truth, and what it misses of it.
FARTHER = {"to_truth": 1.2, "from_truth": 1.05}


def with_seq(message, store):
    """The same message with ROS 1's header."""
    header = store.types["std_msgs/msg/Header"]
    time = store.types["builtin_interfaces/msg/Time"]

    def changed(part):
        name = part.__msgtype__
        if name == "std_msgs/msg/Header":
            stamp = time(sec=part.stamp.sec, nanosec=part.stamp.nanosec)
            return header(seq=0, stamp=stamp, frame_id=part.frame_id)
        values = {}
        for field in part.__dataclass_fields__:
            value = getattr(part, field)
            if field == "__msgtype__":
                continue
            if isinstance(value, list):
                value = [changed(one) for one in value]
            elif hasattr(value, "__msgtype__"):
                value = changed(value)
            values[field] = value
        return store.types[name](**values)

    return changed(message)


def write_ros1(path, rows, compression=None):
    store = bags.types(Stores.ROS1_NOETIC)
    writer = BagWriter(path)
    if compression:
        writer.set_compression(compression)
    with writer:
        connections = {}
        for time_ns, topic, message in rows:
            name = message.__msgtype__
            if topic not in connections:
                latching = int(topic == "/tf_static")
                connections[topic] = writer.add_connection(topic, name, typestore=store, latching=latching)
            raw = store.serialize_ros1(with_seq(message, store), name)
            writer.write(connections[topic], time_ns, raw)


def write_ros2(path, rows, plugin, mode=None):
    store = bags.types(Stores.ROS2_JAZZY)
    writer = FolderWriter(path, version=9, storage_plugin=plugin)
    if mode:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for time_ns, topic, message in rows:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=store)
            writer.write(connections[topic], time_ns, store.serialize_cdr(message, message.__msgtype__))


def rows_of(recording):
    """Messages of a replayed drive under other names, received some milliseconds after their stamps."""
    rows = []
    for topic, message in bags.messages(recording, *TOPICS):
        header = message.transforms[0].header if topic == "tf_static" else message.header
        late_ns = {"scan/horizontal": 21_000_000, "scan/vertical": 34_000_000}.get(topic, 3_000_000)
        rows.append((bags.stamp_ns(header) + late_ns, TOPICS[topic], message))
    return sorted(rows, key=lambda row: row[0])


def write_all(work, rows):
    """The drive as bags of five kinds, and one cut in two."""
    kinds = BagWriter.CompressionFormat
    write_ros1(work / "plain.bag", rows)
    write_ros1(work / "bz2.bag", rows, kinds.BZ2)
    write_ros1(work / "lz4.bag", rows, kinds.LZ4)
    write_ros2(work / "sqlite3", rows, StoragePlugin.SQLITE3)
    write_ros2(work / "packed_file", rows, StoragePlugin.SQLITE3, CompressionMode.FILE)
    write_ros2(work / "packed_message", rows, StoragePlugin.SQLITE3, CompressionMode.MESSAGE)
    write_ros2(work / "mcap", rows, StoragePlugin.MCAP)
    half = len(rows) // 2
    write_ros1(work / "first.bag", rows[:half])
    write_ros1(work / "second.bag", rows[half:])
    single = ["plain.bag", "bz2.bag", "lz4.bag", "sqlite3", "packed_file", "packed_message", "mcap"]
    return [[work / name] for name in single] + [[work / "second.bag", work / "first.bag"]]


def modeled(work, recording):
    """A recording's poses, and the account of the model made of it."""
    run("biplane", "traj", recording, "-o", work / "poses.tum", capture_output=True)
    run("biplane", "build", recording, "-o", work / "model", capture_output=True)
    summary = json_of("cat", work / "model/summary.json")
    return bags.trajectory(work / "poses.tum"), summary, (work / "model/model.ply").read_bytes()


def errors_m(model, truth):
    """Distance of a model to the truth and of the truth to the model, RMS."""
    found = json_of("biplane", "compare", model, "--truth", truth / "surfaces.ply", "--json")["model"]
    return {way: found[way]["rms_m"] for way in FARTHER}


def check(work, tally):
    direct = work / "direct"
    direct.mkdir()
    capture = work / "capture.mcap"
    truth = work / "truth"
    simulate("corridor", capture, truth, capture_output=True)
    run("biplane-onboard", "replay", capture, "-o", direct / "run.mcap", capture_output=True)
    poses, summary, _ = modeled(direct, direct / "run.mcap")
    imported, models = {}, {}
    for given in write_all(work, rows_of(direct / "run.mcap")):
        folder = work / f"of_{given[0].stem}"
        folder.mkdir()
        unposed, posed = folder / "bag.mcap", folder / "run.mcap"
        run("biplane", "import", "bag", *given, "-o", unposed, capture_output=True)
        if len(given) == 1:
            for topic, ours in (("/scan", "scan/horizontal"), ("/scan_up", "scan/vertical")):
                wrong = bags.difference(given[0], unposed, topic, ours)
                require(wrong is None, f"{given[0].name}, {topic}: {wrong}")
        run("biplane-onboard", "replay", unposed, "-o", posed, capture_output=True)
        if not imported:
            imported[posed] = modeled(folder, posed)
        models[given[0].name] = list(bags.messages(posed, "pose"))
    again, made, _ = next(iter(imported.values()))
    rows = np.searchsorted(np.round(poses[:, 0], 6), np.round(again[:, 0], 6) - 1e-6)
    apart_m = np.linalg.norm(again[:, 1:3] - poses[np.minimum(rows, len(poses) - 1), 1:3], axis=1).max()
    require(
        apart_m < POSES_WITHIN_M, f"poses by way of a bag are up to {apart_m:.4f} m off those of the bytes"
    )
    tally.ok(
        f"{len(again)} poses by way of a bag within {1000 * apart_m:.1f} mm of those of the serial bytes"
    )
    # Which scans of a robot that stands are left out is a matter of a millimeter; what the others see is not.
    kept = [of["scans"]["vertical"] - of["scans"]["vertical_still"] for of in (made, summary)]
    require(abs(kept[0] - kept[1]) <= KEPT_WITHIN, f"{kept[0]} scans by way of a bag, {kept[1]} without")
    points = [of["raw_points"] / scans for of, scans in zip((made, summary), kept)]
    off = abs(points[0] - points[1]) / points[1]
    require(off <= POINTS_WITHIN, f"{points[0]:.2f} points a scan by way of a bag, {points[1]:.2f} without")
    folder = next(iter(imported)).parent
    by_bag, by_bytes = (errors_m(model, truth) for model in (folder / "model", direct / "model"))
    for way, factor in FARTHER.items():
        require(
            by_bag[way] <= factor * by_bytes[way],
            f"{way}: {by_bag[way]:.4f} m by way of a bag, {by_bytes[way]:.4f} m of the bytes",
        )
    tally.ok(
        f"model of {made['raw_points']} points {1000 * by_bag['to_truth']:.1f} mm RMS from the truth, "
        f"from the bytes {1000 * by_bytes['to_truth']:.1f}"
    )
    first, *others = models.values()
    same = all(same_poses(first, other) for other in others)
    require(same, "bags of one drive give other poses")
    tally.ok(f"the same poses, to the bit, from {len(models)} ways to keep one drive")


def same_poses(a, b):
    numbers = [
        [(bags.stamp_ns(m.header), m.pose.pose.position.x, m.pose.pose.orientation.z) for _, m in one]
        for one in (a, b)
    ]
    return numbers[0] == numbers[1]
