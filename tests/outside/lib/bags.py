"""Bags as another reader (rosbags) sees them, and as an import should have made recordings of them."""

import struct
from pathlib import Path

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

# So near to its longest range a driver writes "nothing seen"; see docs/recording.md.
LIMIT_M = np.float32(1e-3)


def types(store):
    """A store of types with the one of ROS 1 that rosbags leaves out."""
    found = get_typestore(store)
    if store == Stores.ROS1_NOETIC:
        tf = get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", "tf2_msgs/msg/TFMessage")
        found.register(tf)
    return found


def stamp_ns(header):
    return header.stamp.sec * 10**9 + header.stamp.nanosec


def messages(path, *topics):
    """Messages of these topics (without a leading slash), in the bag's order."""
    store = Stores.ROS1_NOETIC if path.suffix == ".bag" else Stores.ROS2_JAZZY
    with AnyReader([path], default_typestore=types(store)) as reader:
        chosen = [one for one in reader.connections if one.topic.lstrip("/") in topics]
        for connection, _, raw in reader.messages(connections=chosen) if chosen else ():
            yield connection.topic.lstrip("/"), reader.deserialize(raw, connection.msgtype)


def first_echoes(message):
    """Ranges of a scan; of several echoes the first, of none infinity."""
    if not hasattr(message.ranges, "dtype"):
        first = [beam.echoes[0] if len(beam.echoes) else np.inf for beam in message.ranges]
        return np.array(first, np.float32)
    return np.asarray(message.ranges, np.float32)


def expected_ranges(message):
    """What a recording holds of a scan's ranges, by the rule of docs/recording.md."""
    ranges = first_echoes(message)
    near = np.float32(message.range_min if message.range_min > 0 else 0.02)
    far = np.float32(message.range_max if message.range_max > near else 100.0) - LIMIT_M
    with np.errstate(invalid="ignore"):
        return np.where(
            ranges >= far, np.float32(np.inf), np.where(ranges >= near, ranges, np.float32(np.nan))
        )


def scans(path, topic):
    """Scans with beams by stamp: no message twice, in the order of stamps."""
    found = {}
    for _, message in messages(path, topic.lstrip("/")):
        if len(message.ranges):
            found.setdefault((stamp_ns(message.header), expected_ranges(message).tobytes()), message)
    return [found[key] for key in sorted(found)]


def difference(bag, recording, topic, ours, gives_times=True):
    """Why the scans of a recording are not those of a bag; nothing when they are."""
    expected = scans(bag, topic)
    made = [message for _, message in messages(recording, ours.lstrip("/"))]
    if len(expected) != len(made):
        return f"{len(made)} scans, the bag has {len(expected)}"
    for number, (a, b) in enumerate(zip(expected, made, strict=True)):
        if stamp_ns(a.header) != stamp_ns(b.header):
            return f"scan {number}: stamp {stamp_ns(b.header)}, the bag's is {stamp_ns(a.header)}"
        if expected_ranges(a).tobytes() != np.asarray(b.ranges, np.float32).tobytes():
            return f"scan {number} has other ranges"
        fields = ["angle_min", "angle_max", "angle_increment"] + ["time_increment"] * gives_times
        for field in fields:
            if struct.pack("<f", getattr(a, field)) != struct.pack("<f", getattr(b, field)):
                return f"scan {number}: {field} {getattr(b, field)}, the bag's is {getattr(a, field)}"
    return None


def poses_differ(bag, recording, topic, ours):
    """The same of odometry: the first number that differs."""
    key = stamp_ns
    expected = sorted(
        (message for _, message in messages(bag, topic.lstrip("/"))), key=lambda m: key(m.header)
    )
    made = [message for _, message in messages(recording, ours.lstrip("/"))]
    if len(expected) != len(made):
        return f"{len(made)} messages, the bag has {len(expected)}"
    for a, b in zip(expected, made, strict=True):
        pairs = [(stamp_ns(a.header), stamp_ns(b.header))]
        for field in ("position", "orientation"):
            one, other = getattr(a.pose.pose, field), getattr(b.pose.pose, field)
            pairs += [(getattr(one, axis), getattr(other, axis)) for axis in vars(one) if axis in "xyzw"]
        if any(x != y for x, y in pairs):
            return f"pose at {stamp_ns(a.header)} differs: {pairs}"
    return None


def inertia_differs(bag, recording, topic):
    """The same of an inertial unit."""
    expected = sorted((m for _, m in messages(bag, topic.lstrip("/"))), key=lambda m: stamp_ns(m.header))
    made = [message for _, message in messages(recording, "imu")]
    if len(expected) != len(made):
        return f"{len(made)} samples, the bag has {len(expected)}"
    for a, b in zip(expected, made, strict=True):
        pairs = [(stamp_ns(a.header), stamp_ns(b.header))]
        for field in ("angular_velocity", "linear_acceleration", "orientation"):
            one, other = getattr(a, field), getattr(b, field)
            pairs += [(getattr(one, axis), getattr(other, axis)) for axis in vars(one) if axis in "xyzw"]
        if any(x != y for x, y in pairs):
            return f"sample at {stamp_ns(a.header)} differs"
    return None


def mounts(recording):
    """Translations and quaternions of the lasers of a recording, by frame."""
    found = {}
    for _, message in messages(recording, "tf_static"):
        for one in message.transforms:
            t, q = one.transform.translation, one.transform.rotation
            found[one.child_frame_id] = (np.array([t.x, t.y, t.z]), np.array([q.x, q.y, q.z, q.w]))
    return found


def trajectory(path):
    """Poses of a TUM file: time, then x, y, z and a quaternion."""
    return np.loadtxt(Path(path), ndmin=2)
