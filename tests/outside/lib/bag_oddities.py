"""Bags that are damaged, lie or say too little: a sentence, an exit code, no panic, bounded memory."""

import os
import resource
import sqlite3
import struct
import subprocess
import time

import numpy as np
from rosbags.rosbag2 import StoragePlugin
from rosbags.typesys import Stores

from lib import bags
from lib.bag_drive import write_ros1, write_ros2
from lib.verdict import require

MAX_MEMORY_MB, MAX_S = 300, 60
START_NS = 1_700_000_000_000_000_000
STORE = bags.types(Stores.ROS2_JAZZY)


def kind(name):
    return STORE.types[name]


def header(time_ns, frame):
    time = kind("builtin_interfaces/msg/Time")(sec=time_ns // 10**9, nanosec=time_ns % 10**9)
    return kind("std_msgs/msg/Header")(stamp=time, frame_id=frame)


def scan(time_ns, frame, count=91, **fields):
    values = {
        "angle_min": -np.pi / 2,
        "angle_max": np.pi / 2,
        "angle_increment": np.pi / max(count - 1, 1),
        "time_increment": 1e-5,
        "scan_time": 0.1,
        "range_min": 0.1,
        "range_max": 30.0,
        "ranges": np.full(count, 2.5, np.float32),
        "intensities": np.zeros(0, np.float32),
    }
    return kind("sensor_msgs/msg/LaserScan")(header=header(time_ns, frame), **(values | fields))


def transform(time_ns, parent, child, place=(0, 0, 0), turn=(0, 0, 0, 1)):
    vector = kind("geometry_msgs/msg/Vector3")(x=float(place[0]), y=float(place[1]), z=float(place[2]))
    quaternion = kind("geometry_msgs/msg/Quaternion")(**dict(zip("xyzw", map(float, turn), strict=True)))
    moved = kind("geometry_msgs/msg/Transform")(translation=vector, rotation=quaternion)
    one = kind("geometry_msgs/msg/TransformStamped")
    stamped = one(header=header(time_ns, parent), child_frame_id=child, transform=moved)
    return kind("tf2_msgs/msg/TFMessage")(transforms=[stamped])


UP = (0, -(0.5**0.5), 0, 0.5**0.5)


def drive(scans=20, **fields):
    """Two lasers that stand still, and where they sit."""
    rows = [
        (START_NS, "/tf_static", transform(0, "base_link", "flat", (0.2, 0, 0.3))),
        (START_NS, "/tf_static", transform(0, "base_link", "up", (0, 0, 0.5), UP)),
    ]
    for number in range(scans):
        at = START_NS + number * 100_000_000
        rows.append((at + 20_000_000, "/scan", scan(at, "flat", **fields)))
        rows.append((at + 30_000_000, "/scan_up", scan(at + 5_000_000, "up")))
    return rows


def odometry(time_ns):
    """A base that stands still."""
    point = kind("geometry_msgs/msg/Point")(x=0.0, y=0.0, z=0.0)
    pose = kind("geometry_msgs/msg/Pose")(
        position=point, orientation=kind("geometry_msgs/msg/Quaternion")(x=0.0, y=0.0, z=0.0, w=1.0)
    )
    still = kind("geometry_msgs/msg/Vector3")(x=0.0, y=0.0, z=0.0)
    twist = kind("geometry_msgs/msg/Twist")(linear=still, angular=still)
    return kind("nav_msgs/msg/Odometry")(
        header=header(time_ns, "odom"),
        child_frame_id="base_link",
        pose=kind("geometry_msgs/msg/PoseWithCovariance")(pose=pose, covariance=np.zeros(36)),
        twist=kind("geometry_msgs/msg/TwistWithCovariance")(twist=twist, covariance=np.zeros(36)),
    )


def echoes(time_ns, frame, count=91):
    """A scan of two echoes a beam, the nearer first; each tenth beam has none."""
    echo = kind("sensor_msgs/msg/LaserEcho")
    single = scan(time_ns, frame, count)
    fields = {name: getattr(single, name) for name in single.__dataclass_fields__ if name != "__msgtype__"}
    ranges = [echo(echoes=np.array([] if i % 10 == 0 else [2.5, 4.0], np.float32)) for i in range(count)]
    fields |= {"ranges": ranges, "intensities": []}
    return kind("sensor_msgs/msg/MultiEchoLaserScan")(**fields)


def inertial(time_ns):
    """An inertial unit that stands still."""
    zero, one = np.zeros(9), kind("geometry_msgs/msg/Vector3")
    return kind("sensor_msgs/msg/Imu")(
        header=header(time_ns, "imu_link"),
        orientation=kind("geometry_msgs/msg/Quaternion")(x=0.0, y=0.0, z=0.0, w=1.0),
        orientation_covariance=zero,
        angular_velocity=one(x=0.0, y=0.0, z=0.0),
        angular_velocity_covariance=zero,
        linear_acceleration=one(x=0.0, y=0.0, z=9.81),
        linear_acceleration_covariance=zero,
    )


def backpack(scans=20):
    """Topics, types and frames of Cartographer's 2D backpack (Deutsches Museum), by its documentation."""
    rows = []
    for number in range(scans):
        at = START_NS + number * 25_000_000
        rows.append((at + 20_000_000, "horizontal_laser_2d", echoes(at, "horizontal_laser_link")))
        rows.append((at + 22_000_000, "vertical_laser_2d", echoes(at + 2_000_000, "vertical_laser_link")))
        rows += [(at + ms * 10**6, "imu", inertial(at + ms * 10**6)) for ms in (23, 24)]
    return rows


class Oddities:
    """A folder of odd bags, and what is expected of each."""

    def __init__(self, work, tally):
        self.work, self.tally = work, tally

    def ends(self, name, code, words, *options, paths=None):
        """Imports a bag: exit code, words that are said, memory and time."""
        paths = paths or [self.work / name]
        output = self.work / f"{name}.out.mcap"
        line = ["biplane", "import", "bag", *map(str, paths), "-o", str(output), *options]
        begun = time.monotonic()
        done = subprocess.run(line, text=True, capture_output=True, preexec_fn=limited)
        took_s = time.monotonic() - begun
        said = done.stdout + done.stderr
        require(done.returncode == code, f"{name}: exit code {done.returncode}, expected {code}: {said}")
        require("panicked" not in said, f"{name}: {said}")
        require(words in said, f"{name}: {words!r} is not said: {said}")
        require(took_s < MAX_S, f"{name} took {took_s:.0f} s")
        require(output.exists() == (code in (0, 3)), f"{name}: an output where none belongs, or none")
        self.tally.ok(f"{name}: exit code {code}, {words!r}, {took_s:.1f} s")

    def bag(self, name, rows):
        write_ros1(self.work / name, rows)
        return bytearray((self.work / name).read_bytes())

    def save(self, name, data):
        (self.work / name).write_bytes(data)

    def containers(self):
        """What is wrong with a file as such."""
        whole = self.bag("whole.bag", drive())
        self.ends("whole.bag", 0, "20 horizontal and 20 vertical scans")
        self.save("cut.bag", whole[: len(whole) // 2])
        self.ends("cut.bag", 3, "cut off")
        self.save("header_only.bag", whole[:13])
        self.ends("header_only.bag", 1, "there is no message")
        self.save("empty.bag", b"")
        self.ends("empty.bag", 1, "is empty")
        self.save("text.bag", b"no bag at all\n")
        self.ends("text.bag", 1, "expected a ROS 1 bag")
        self.save("old.bag", b"#ROSBAG V1.2\n" + whole[13:])
        self.ends("old.bag", 1, "rosbag migrate")
        place = whole.index(b"index_pos=") + 10
        self.save("index_lies.bag", whole[:place] + struct.pack("<Q", 2**60) + whole[place + 8 :])
        self.ends("index_lies.bag", 0, "20 horizontal")
        self.save("no_connections.bag", whole.replace(b"op=\x07", b"op=\x09"))
        self.ends("no_connections.bag", 1, "not defined")
        place = whole.index(b"size=") + 5
        self.save("chunk_lies.bag", whole[:place] + struct.pack("<I", 2**32 - 1) + whole[place + 4 :])
        self.ends("chunk_lies.bag", 3, "announced")
        md5 = b"90c7ef2dc6895d81024acba2ac42f369"
        self.save("other_layout.bag", whole.replace(md5, md5[::-1]))
        self.ends("other_layout.bag", 1, "its definition has the sum")
        self.ends("missing.bag", 1, "does not exist")
        (self.work / "folder").mkdir()
        self.ends("folder", 1, "holds no .db3 and no .mcap file")

    def claims(self):
        """Lengths that promise what is not there."""
        whole = (self.work / "whole.bag").read_bytes()
        with open(self.work / "sparse.bag", "wb") as file:
            file.write(whole[:4117] + struct.pack("<I", 2**31))
            file.truncate(10 * 2**30)
        self.ends("sparse.bag", 1, "no laser scan")
        chunk = (
            struct.pack("<I", 41)
            + b"\x04\0\0\0op=\x05\x10\0\0\0compression=none\x09\0\0\0size=\xff\xff\xff\xff"
        )
        with open(self.work / "sparse_chunk.bag", "wb") as file:
            file.write(whole[: 13 + 4096] + chunk + struct.pack("<I", 2**32 - 1))
            file.truncate(10 * 2**30)
        self.ends("sparse_chunk.bag", 1, "no header of a record")
        with open(self.work / "sparse.db3", "wb") as file:
            file.write(b"SQLite format 3\0" + struct.pack(">H", 4096) + bytes(84) + b"\x0d\0\0\xff\xff")
            file.truncate(10 * 2**30)
        self.ends("sparse.db3", 1, "tables cannot be read")
        with open(self.work / "sparse.mcap", "wb") as file:
            file.write(b"\x89MCAP0\r\n" + b"\x01" + struct.pack("<Q", 8) + bytes(8))
            file.truncate(10 * 2**30)
        self.ends("sparse.mcap", 1, "zeros where a record should be")

    def databases(self):
        write_ros2(self.work / "db", drive(), StoragePlugin.SQLITE3)
        path = self.work / "db/db.db3"
        whole = path.read_bytes()
        self.ends("db", 0, "20 horizontal")
        self.save("lone.db3", whole)
        self.ends("lone.db3", 0, "20 horizontal")
        self.save("cut.db3", whole[: len(whole) * 2 // 3])
        self.ends("cut.db3", 3, "rows are lost")
        circle = bytearray(whole)
        for page in range(1, len(whole) // 4096):
            if circle[page * 4096] == 5:
                circle[page * 4096 + 8 : page * 4096 + 12] = struct.pack(">I", page + 1)
        self.save("circle.db3", circle)
        self.ends("circle.db3", 3, "circle")
        other = sqlite3.connect(self.work / "other.db3")
        other.execute("CREATE TABLE things(id INTEGER)")
        other.commit()
        other.close()
        self.ends("other.db3", 1, "without a table `topics`")
        self.live_log(path)

    def live_log(self, path):
        """A recorder that was killed leaves the newest rows in a log beside the file."""
        folder = self.work / "killed"
        folder.mkdir()
        source = sqlite3.connect(path)
        child = os.fork()
        if child == 0:
            made = sqlite3.connect(folder / "killed_0.db3")
            made.execute("PRAGMA journal_mode=WAL")
            made.execute("PRAGMA wal_autocheckpoint=0")
            for line in source.iterdump():
                if line not in ("BEGIN TRANSACTION;", "COMMIT;"):
                    made.execute(line)
            made.commit()
            os._exit(0)
        os.waitpid(child, 0)
        require((folder / "killed_0.db3-wal").stat().st_size > 10_000, "no log was left")
        self.ends("killed", 0, "20 horizontal and 20 vertical")

    def chunks(self):
        """MCAP of one chunk, as rosbags writes it, and of one a second, as an import writes it."""
        write_ros2(self.work / "one_chunk", drive(), StoragePlugin.MCAP)
        whole = (self.work / "one_chunk/one_chunk.mcap").read_bytes()
        self.save("cut_chunk.mcap", whole[: len(whole) // 2])
        self.ends("cut_chunk.mcap", 1, "biplane recover")
        self.bag("long.bag", drive(scans=100))
        self.ends("long.bag", 0, "100 horizontal")
        whole = (self.work / "long.bag.out.mcap").read_bytes()
        self.save("cut.mcap", whole[: len(whole) // 2])
        self.ends("cut.mcap", 3, "what follows is lost")
        flipped = bytearray(whole)
        flipped[len(flipped) // 2] ^= 0x55
        self.save("flipped.mcap", flipped)
        self.ends("flipped.mcap", 3, "what follows is lost")

    def contents(self):
        """What is wrong with what is in it."""
        self.bag("no_scans.bag", drive(scans=0))
        self.ends("no_scans.bag", 1, "no laser scan")
        self.bag("no_beams.bag", [row for row in drive(count=0, angle_increment=0.0) if row[1] != "/scan_up"])
        self.ends("no_beams.bag", 1, "scans without beams")
        one = [row for row in drive() if row[1] == "/scan"]
        self.bag("one_laser.bag", one)
        self.ends("one_laser.bag", 0, "is taken to be at the base's origin")
        self.bag("one_standing.bag", [row for row in drive() if row[1] != "/scan"])
        self.ends("one_standing.bag", 2, "no laser is known to lie flat")
        self.bag("no_mounts.bag", [row for row in drive() if row[1] != "/tf_static"])
        self.ends("no_mounts.bag", 2, "no transform to it")
        mounts = ("--horizontal", "/scan", "--vertical", "/scan_up", "--mount-vertical", "0,0,0.5,0,-90,0")
        self.ends("no_mounts.bag", 0, "20 horizontal and 20 vertical scans", *mounts)
        nowhere = (float("nan"), 0, 0)
        rows = [*drive()[2:], (START_NS, "/tf_static", transform(0, "base_link", "flat", nowhere))]
        self.bag("nan_transform.bag", sorted(rows, key=lambda row: row[0]))
        self.ends("nan_transform.bag", 2, "no transform to it")
        rows = drive()
        rows[0] = (START_NS, "/tf_static", transform(0, "base_link", "flat", turn=(0, 0, 0, 0)))
        self.bag("no_rotation.bag", rows)
        self.ends("no_rotation.bag", 2, "no laser is known to lie flat")
        twin = [(at + 1000, "/scan2", message) for at, topic, message in drive() if topic == "/scan"]
        self.bag("twins.bag", sorted(drive() + twin, key=lambda row: row[0]))
        self.ends("twins.bag", 2, "several lasers lie flat")
        (self.work / "twins.bag.out.mcap").unlink(missing_ok=True)
        self.ends("twins.bag", 0, "20 horizontal", "--horizontal", "scan2")
        unstamped = [row for row in drive() if row[1] == "/tf_static"]
        unstamped += [(at, topic, scan(0, "flat")) for at, topic, _ in drive() if topic == "/scan"]
        self.bag("unstamped.bag", unstamped)
        self.ends("unstamped.bag", 0, "the time of receipt is taken")
        shared = [(at, topic.replace("_up", ""), message) for at, topic, message in drive()]
        self.bag("shared_topic.bag", shared)
        self.ends("shared_topic.bag", 0, "20 horizontal and 20 vertical scans")
        clocks = [
            (at, "/odom", odometry(at + 100 * 10**9)) for at in range(START_NS, START_NS + 2 * 10**9, 10**8)
        ]
        self.bag("clocks.bag", sorted(drive() + clocks, key=lambda row: row[0]))
        self.ends("clocks.bag", 2, "-100.")
        self.ends("clocks.bag", 0, "20 odometry messages", "--stamps", "receipt")
        self.ends(
            "overlap", 1, "merge them first", paths=[self.work / "whole.bag", self.work / "one_laser.bag"]
        )

    def layouts(self):
        """Bags of robots that are known by their topics."""
        self.bag("backpack.bag", backpack())
        self.ends("backpack.bag", 0, "20 horizontal and 20 vertical scans")
        (self.work / "backpack.bag.out.mcap").unlink()
        self.ends("backpack.bag", 0, "mounts as in its backpack_2d.urdf")
        made = self.work / "backpack.bag.out.mcap"
        for topic in ("scan/horizontal", "scan/vertical"):
            found = [message for _, message in bags.messages(made, topic)]
            require(len(found) == 20, f"backpack: {len(found)} scans in {topic}")
            first = np.asarray(found[0].ranges)
            require(np.isinf(first[::10]).all(), f"backpack: {topic}: beams without echoes are {first[::10]}")
            near = np.delete(first, np.arange(0, len(first), 10))
            require((near == 2.5).all(), f"backpack: {topic}: the first echo is not taken: {near[:5]}")
        samples = sum(1 for _ in bags.messages(made, "imu"))
        require(samples == 40, f"backpack: {samples} samples of the inertial unit")
        mounts = {
            one.child_frame_id: one.transform
            for _, message in bags.messages(made, "tf_static")
            for one in message.transforms
        }
        for frame, place in {
            "laser_horizontal": (0.1007, 0.0, 0.0558),
            "laser_vertical": (0.1007, 0.0, 0.1814),
        }.items():
            at = mounts[frame].translation
            require(np.allclose((at.x, at.y, at.z), place), f"backpack: {frame} is at {at}")
        self.tally.ok("backpack: first echoes, inertial samples and mounts of its documentation")


def limited():
    """A process with so little memory for itself."""
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_MB << 20, MAX_MEMORY_MB << 20))


def check(work, tally):
    odd = Oddities(work, tally)
    odd.containers()
    odd.claims()
    odd.databases()
    odd.chunks()
    odd.contents()
    odd.layouts()
