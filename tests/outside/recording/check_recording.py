#!/usr/bin/env python3
"""Reads a recording or capture with other people's programs, and says what they found.

    check_recording.py RUN.mcap [--expect TOPIC=COUNT ...] [--slack SECONDS]

Needs rosbags, mcap-ros2-support. Every message is decoded twice: by rosbags (with the schemas in the file)
and by mcap_ros2. Checked: profile, types by topic, counts (both readers, statistics, --expect), that encoding
what rosbags decoded gives the same bytes, that both decoders agree on values, QoS, stamps within the file's
span, log times in order, zstd chunks that span less than a second. One line a topic; exit 1 on any mismatch.
"""

import argparse
import sys
import warnings
from collections import Counter
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path

import numpy
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader
from rosbags.highlevel import AnyReader

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # mcap_ros2.reader announces a change of its own on import
    from mcap_ros2.reader import read_ros2_messages

SCAN = "sensor_msgs/msg/LaserScan"
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
TF = "tf2_msgs/msg/TFMessage"
TYPES = {
    "/scan/horizontal": SCAN,
    "/scan/vertical": SCAN,
    "/odom": "nav_msgs/msg/Odometry",
    "/pose": POSE,
    "/pose/vertical": POSE,
    "/pose_incremental": POSE,
    "/tf": TF,
    "/tf_static": TF,
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}
SERIAL = "std_msgs/msg/UInt8MultiArray"
NS = 1_000_000_000
# Values are compared between the two decoders for the first messages of each topic only: the second one is
# slow.
COMPARED = 25


@dataclass
class Topic:
    """What was seen of one topic."""

    type: str = ""
    rosbags: int = 0
    mcap_ros2: int = 0
    stamps: list = field(default_factory=list)
    first: list = field(default_factory=list)
    bytes: int = 0


problems = Counter()


def problem(text):
    """Notes a mismatch; says each only once."""
    problems[text] += 1
    if problems[text] == 1:
        print(f"MISMATCH: {text}", file=sys.stderr)


def stamp_of(message):
    """The stamp of a message in ns: its header's, or that of its first transform; None where it has none."""
    if hasattr(message, "transforms"):
        message = message.transforms[0] if len(message.transforms) else None
    header = getattr(message, "header", None)
    return None if header is None else header.stamp.sec * NS + header.stamp.nanosec


def same(ours, theirs):
    """Whether two decoders found the same values."""
    if is_dataclass(ours):
        names = [f.name for f in fields(ours) if f.name != "__msgtype__" and not f.name.isupper()]
        return all(same(getattr(ours, name), getattr(theirs, name)) for name in names)
    if isinstance(ours, numpy.ndarray):
        theirs = numpy.frombuffer(theirs, ours.dtype) if isinstance(theirs, bytes) else numpy.asarray(theirs)
        return numpy.array_equal(ours, theirs.astype(ours.dtype), equal_nan=ours.dtype.kind == "f")
    if isinstance(ours, list):
        return len(ours) == len(theirs) and all(same(a, b) for a, b in zip(ours, theirs))
    if isinstance(ours, int) and isinstance(theirs, bytes):  # `byte` fields
        return ours == theirs[0]
    return ours == theirs or (ours != ours and theirs != theirs)


def check_qos(connection):
    """The delivery that ROS 2 would play the topic with."""
    profiles = connection.ext.offered_qos_profiles
    if len(profiles) != 1:
        problem(f"{connection.topic}: {len(profiles)} QoS profiles, 1 expected")
        return
    kept = profiles[0].durability.name == "TRANSIENT_LOCAL"
    if kept != (connection.topic == "/tf_static"):
        problem(f"{connection.topic}: durability {profiles[0].durability.name}")


def read_with_rosbags(path, topics):
    """Decodes every message with rosbags; gives the file's first and last log time in ns."""
    with AnyReader([path]) as reader:
        for connection in reader.connections:
            expected = SERIAL if connection.topic.startswith("/serial/") else TYPES.get(connection.topic)
            if connection.msgtype != expected:
                problem(f"{connection.topic}: type {connection.msgtype}, {expected} expected")
            check_qos(connection)
            topics[connection.topic] = Topic(connection.msgtype)
        for connection, _, raw in reader.messages():
            topic = topics[connection.topic]
            message = reader.deserialize(raw, connection.msgtype)
            if bytes(reader.typestore.serialize_cdr(message, connection.msgtype)) != bytes(raw):
                problem(f"{connection.topic}: rosbags encodes what it decoded to other bytes")
            topic.rosbags += 1
            topic.bytes += len(raw)
            if (stamp := stamp_of(message)) is not None:
                topic.stamps.append(stamp)
            if len(topic.first) < COMPARED:
                topic.first.append(message)
        for connection in reader.connections:
            if connection.msgcount != topics[connection.topic].rosbags:
                problem(f"{connection.topic}: statistics say {connection.msgcount} messages")
        return reader.start_time, reader.end_time


def read_with_mcap_ros2(path, topics):
    """Decodes every message with mcap_ros2 and compares the first of each topic."""
    for item in read_ros2_messages(str(path), log_time_order=False):
        name = item.channel.topic
        if name not in topics:
            problem(f"{name}: not seen by rosbags")
            continue
        topic = topics[name]
        if topic.mcap_ros2 < len(topic.first) and not same(topic.first[topic.mcap_ros2], item.ros_msg):
            problem(f"{name}: message {topic.mcap_ros2} differs between the two decoders")
        topic.mcap_ros2 += 1


def check_container(path):
    """The file itself: profile, chunks, order of log times, attachments."""
    with path.open("rb") as stream:
        reader = make_reader(stream)
        header, summary = reader.get_header(), reader.get_summary()
        attachments = [attachment.name for attachment in reader.iter_attachments()]
    if header.profile != "ros2":
        problem(f"profile is {header.profile!r}")
    if summary is None or summary.statistics is None:
        problem("no summary or no statistics")
    last = 0
    with path.open("rb") as stream:
        for record in StreamReader(stream, validate_crcs=True).records:
            if isinstance(record, Message):
                if record.log_time < last:
                    problem("log times decrease")
                last = max(last, record.log_time)
    with path.open("rb") as stream:
        for record in StreamReader(stream, emit_chunks=True).records:
            if isinstance(record, Chunk):
                if record.compression != "zstd":
                    problem(f"chunk compression is {record.compression!r}")
                if record.message_end_time - record.message_start_time > NS:
                    problem("a chunk spans more than a second")
    print(f"{path.name}: profile {header.profile}, written by {header.library}, attachments {attachments}")


def report(name, topic, span, slack_ns):
    """One line a topic; notes counts that differ and stamps that cannot be."""
    if topic.rosbags != topic.mcap_ros2:
        problem(f"{name}: rosbags read {topic.rosbags} messages, mcap_ros2 {topic.mcap_ros2}")
    line = f"{name:<24} {topic.type:<44} {topic.rosbags:>8} messages {topic.bytes:>11} bytes"
    stamps = topic.stamps
    if stamps:
        outside = sum(not span[0] - slack_ns <= stamp <= span[1] + slack_ns for stamp in stamps)
        if outside:
            problem(f"{name}: {outside} of {len(stamps)} stamps outside the file's span")
        back = sum(b < a for a, b in zip(stamps, stamps[1:]))
        length = (max(stamps) - min(stamps)) / NS
        line += f"  stamps {min(stamps) / NS:.3f} + {length:.3f} s, {back} back"
    print(line)


def main():
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("file", type=Path)
    arguments.add_argument("--expect", nargs="*", default=[], action="extend", metavar="TOPIC=COUNT")
    arguments.add_argument(
        "--slack", type=float, default=2.0, help="how far stamps may lie outside the file's span, in s"
    )
    options = arguments.parse_args()
    topics = {}
    check_container(options.file)
    span = read_with_rosbags(options.file, topics)
    read_with_mcap_ros2(options.file, topics)
    for name in sorted(topics):
        report(name, topics[name], span, int(options.slack * NS))
    for expectation in options.expect:
        name, _, count = expectation.rpartition("=")
        found = topics[name].rosbags if name in topics else 0
        if found != int(count):
            problem(f"{name}: {found} messages, {count} expected")
    total = sum(topic.rosbags for topic in topics.values())
    verdict = f"{sum(problems.values())} mismatches" if problems else "all as it should be"
    print(f"{total} messages on {len(topics)} topics in {(span[1] - span[0]) / NS:.3f} s: {verdict}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
