#!/usr/bin/env python3
"""Does the live view show other people's clients what is recorded, and does it leave the recording alone?

    check_live_view.py WORKDIR [SECONDS]        12 s for each recording by default, Linux

1. A replay at ten times its speed, watched (`websockets`): channels, schemas and messages decode
   (`mcap-ros2-support`, `rosbags`), the bytes are those in the file, and the file is byte for byte the one of
   a replay that nobody watches.
2. The same, watched by the parts that Foxglove and Lichtblick are made of (foxglove_client.js).
3. Asked for by pages in a real browser (live_origins.js): strangers' pages are turned away, also where their
   name means this machine; programs' and named ones are let in.
4. Recordings from mock devices at the highest rate, by turns without a live view, with viewers (one that
   takes all, one that takes nothing, a crowd that comes and goes), and again: nothing dropped, and the delay
   of poses not worse than without.

Needs biplane-mock, biplane-onboard, node and Chromium, the packages of foxglove_client.js and playwright-core
on NODE_PATH, and websockets, mcap-ros2-support and rosbags. Takes 90 s. Exit code 1 when something is
wrong."""

import argparse
import asyncio
import contextlib
import filecmp
import json
import os
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

from mcap.reader import make_reader
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.mock_rig import MockRig, rig_text
from lib.programs import fresh_folder, output_of, simulate
from lib.verdict import fail

TOPICS = {
    "/scan/horizontal": "sensor_msgs/msg/LaserScan",
    "/scan/vertical": "sensor_msgs/msg/LaserScan",
    "/odom": "nav_msgs/msg/Odometry",
    "/pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/pose/vertical": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/points": "sensor_msgs/msg/PointCloud2",
}
MADE = {"/map", "/points"}
# Delays below are as good as none on a machine with other work: twice a delay under this is no finding.
# Milliseconds.
DELAY_FLOOR_MS = 2.0
HIGHEST_RATE = ("baud = 500000",)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


async def reach(port, protocol):
    url = f"ws://127.0.0.1:{port}"
    for _ in range(200):
        with contextlib.suppress(OSError):
            return await connect(url, subprotocols=[protocol], max_size=None, max_queue=None)
        await asyncio.sleep(0.05)
    return fail("nobody serves")


class Viewer:
    """Takes all of all channels until the server closes."""

    def __init__(self, port, protocol="foxglove.sdk.v1"):
        self.port, self.protocol = port, protocol
        self.texts, self.channels, self.messages, self.times, self.reason = [], {}, [], [], None

    async def watch(self):
        viewer = await reach(self.port, self.protocol)
        if viewer.subprotocol != self.protocol:
            fail(f"asked for {self.protocol}, got {viewer.subprotocol}")
        try:
            async for frame in viewer:
                await self.take(viewer, frame)
        except ConnectionClosed:
            pass
        self.reason = (viewer.close_code, viewer.close_reason)

    async def take(self, viewer, frame):
        if isinstance(frame, str):
            text = json.loads(frame)
            self.texts.append(text)
            if text["op"] == "advertise":
                self.channels = {channel["id"]: channel for channel in text["channels"]}
                wishes = [{"id": 1000 + number, "channelId": number} for number in self.channels]
                await viewer.send(json.dumps({"op": "subscribe", "subscriptions": wishes}))
        elif frame[0] == 1:
            number, log_time = struct.unpack_from("<IQ", frame, 1)
            self.messages.append((self.channels[number - 1000]["topic"], log_time, frame[13:]))
        elif frame[0] == 2:
            self.times.append(struct.unpack_from("<Q", frame, 1)[0])
        else:
            fail(f"unknown opcode {frame[0]}")

    def of(self, topic):
        return [(time, payload) for other, time, payload in self.messages if other == topic]


def recorded(path):
    """(topic, payload) -> how often, and the schemas, of a recording by the reference reader."""
    messages, schemas = {}, {}
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            messages.setdefault(channel.topic, []).append(message.data)
            schemas[channel.topic] = (schema.name, schema.data.decode())
    return messages, schemas


def decode(viewer):
    """Every message by its own schema, by two decoders; returns maps and clouds."""
    maps, clouds = [], []
    decoders, factory, counts = {}, DecoderFactory(), {}
    stores = {}
    for number, channel in viewer.channels.items():
        text, encoding = channel["schema"].encode(), channel["schemaEncoding"]
        schema = Schema(id=number, name=channel["schemaName"], encoding=encoding, data=text)
        decoders[channel["topic"]] = factory.decoder_for(channel["encoding"], schema)
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(channel["schema"], channel["schemaName"]))
        standard = get_typestore(Stores.ROS2_HUMBLE)
        name = channel["schemaName"]
        if store.fielddefs[name] != standard.fielddefs[name] or store.hash_rihs01(
            name
        ) != standard.hash_rihs01(name):
            fail(f"{channel['topic']}: the schema is not that of ROS 2's {name}")
        stores[channel["topic"]] = (store, name)
    for topic, _, payload in viewer.messages:
        counts[topic] = counts.get(topic, 0) + 1
        message = decoders[topic](payload)
        store, name = stores[topic]
        again = store.deserialize_cdr(payload, name)
        if bytes(store.serialize_cdr(again, name)) != payload:
            fail(f"{topic}: rosbags writes other bytes")
        if topic == "/map":
            maps.append(message)
        if topic == "/points":
            clouds.append(again)
    return counts, maps, clouds


def check_scene(maps, clouds):
    """Map and points are those of the corridor: walls 2.2 m apart, a ceiling at 2.6 m or so, and both
    grow."""
    last = maps[-1]
    if last.header.frame_id != "map" or len(last.data) != last.info.width * last.info.height:
        fail("the map is none")
    walls, free = sum(cell > 60 for cell in last.data), sum(0 <= cell < 40 for cell in last.data)
    if not set(last.data) <= set(range(-1, 101)) or walls < 100 or free < 1000:
        fail("the map has no walls or nothing free")
    sizes = [sum(cell >= 0 for cell in one.data) for one in maps]
    if sizes[-1] <= sizes[0]:
        fail(f"the map does not grow: {sizes}")
    points = []
    for cloud in clouds:
        fields = [(field.name, field.offset, field.datatype, field.count) for field in cloud.fields]
        steps = cloud.point_step, cloud.row_step
        if fields != [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1)] or steps != (12, 12 * cloud.width):
            fail(f"the points' fields are {fields}")
        points += struct.iter_unpack("<3f", bytes(cloud.data))
    cubes = {tuple(int(coordinate // 0.05) for coordinate in point) for point in points}
    if len(clouds) < 3 or len(points) < 3000 or len(cubes) < 0.99 * len(points):
        fail(f"{len(clouds)} increments, {len(points)} points in {len(cubes)} cubes")
    heights = [z for _, _, z in points]
    if not -0.3 < min(heights) < 0.6 or not 2.0 < max(heights) < 4.0:
        fail(f"points from {min(heights)} to {max(heights)} m above the floor")
    return len(points), sizes


def recorded_bytes(work):
    """A drive through the corridor, as the bytes of its devices."""
    capture, rig = work / "capture.mcap", work / "rig.toml"
    rig.write_text(rig_text("/none", laser_lines=HIGHEST_RATE))
    simulate("corridor", capture, work / "truth", rig, capture_output=True)
    return capture


def watched_replay(capture, output, port):
    """The words of a replay at ten times its speed, with a live view on a port."""
    return [
        "biplane-onboard",
        "--quiet",
        "replay",
        capture,
        "-o",
        output,
        "--live",
        str(port),
        "--speed",
        "10",
    ]


async def watch_replay(work, capture, protocol):
    port, output = free_port(), work / f"{protocol}.mcap"
    words = watched_replay(capture, output, port)
    replay = await asyncio.create_subprocess_exec(*words, "--json", stdout=subprocess.PIPE)
    viewer = Viewer(port, protocol)
    await viewer.watch()
    account = json.loads((await replay.communicate())[0])
    if replay.returncode != 0:
        fail(f"replay: exit code {replay.returncode}")
    return viewer, account, output


def check_offer(viewer, schemas):
    """Greeting, channels and their schemas, time, and the end."""
    if viewer.texts[0]["op"] != "serverInfo" or "time" not in viewer.texts[0]["capabilities"]:
        fail(f"the first text is {viewer.texts[0]}")
    offered = {channel["topic"]: channel["schemaName"] for channel in viewer.channels.values()}
    if offered != TOPICS:
        fail(f"offered are {offered}")
    for channel in viewer.channels.values():
        topic = channel["topic"]
        if topic not in MADE and (channel["schemaName"], channel["schema"]) != schemas[topic]:
            fail(f"{topic} has another schema in the file")
    if viewer.times != sorted(viewer.times) or len(viewer.times) < 20:
        fail("time does not go on")
    if viewer.reason != (1001, "the run is over"):
        fail(f"closed with {viewer.reason}")


def check_bytes(viewer, messages, live):
    """What was shown is what was written; returns how many messages were left out."""
    left_out = live["left_out"] + live["missed"]
    for topic in set(TOPICS) - MADE:
        shown, written = [payload for _, payload in viewer.of(topic)], messages[topic]
        # It came when the run had begun: what it saw is the file's end, all of it.
        is_end = shown == written[len(written) - len(shown) :]
        if (left_out == 0 and not is_end) or not set(shown) <= set(written):
            fail(f"{topic}: other bytes than in the file")
        if topic not in ["/tf_static", "/diagnostics"] and len(shown) < 0.8 * len(written):
            fail(f"{topic}: {len(shown)} of {len(written)} messages shown, {live}")
    return left_out


def check_replay(work):
    capture = recorded_bytes(work)
    plain = work / "plain.mcap"
    output_of("biplane-onboard", "--quiet", "replay", capture, "-o", plain, "--json")
    messages, schemas = recorded(plain)
    for protocol in ["foxglove.sdk.v1", "foxglove.websocket.v1"]:
        viewer, account, output = asyncio.run(watch_replay(work, capture, protocol))
        if not filecmp.cmp(plain, output, shallow=False):
            fail("a replay that is watched writes another file")
        check_offer(viewer, schemas)
        counts, maps, clouds = decode(viewer)
        points, sizes = check_scene(maps, clouds)
        left_out = check_bytes(viewer, messages, account["live"])
        print(
            f"ok: {protocol}: {sum(counts.values())} messages of {len(counts)} topics as in the file, "
            f"{points} points, a map of {sizes[0]} to {sizes[-1]} known cells; left out {left_out}"
        )


async def watch_by_reference(work, capture):
    port = free_port()
    replay = await asyncio.create_subprocess_exec(*watched_replay(capture, work / "reference.mcap", port))
    script = Path(__file__).with_name("foxglove_client.js")
    client = await asyncio.create_subprocess_exec(
        "node", script, f"ws://127.0.0.1:{port}", stdout=subprocess.PIPE
    )
    output = (await client.communicate())[0]
    if await replay.wait() or client.returncode:
        fail(f"the reference client ended with {client.returncode}")
    return json.loads(output)


def check_reference(work):
    seen = asyncio.run(watch_by_reference(work, work / "capture.mcap"))
    if set(seen["counts"]) != set(TOPICS) or min(seen["counts"].values()) < 1 or seen["points"] < 3000:
        fail(f"the reference client saw {seen}")
    messages = sum(seen["counts"].values())
    print(f"ok: @foxglove/ws-protocol: {seen['name']}, {messages} messages decoded, {seen['points']} points")


def serve_long(work, name, port, *words):
    """A replay that is served for as long as nobody ends it, at a hundredth of its speed."""
    command = watched_replay(work / "capture.mcap", work / name, port)
    return subprocess.Popen([*command[:-1], "0.01", *words], stderr=subprocess.DEVNULL)


def wait_for(port):
    for _ in range(200):
        with socket.socket() as asked:
            if asked.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.05)
    fail(f"nothing is served at {port}")


def check_browser(work):
    """Pages of several origins, in Chromium, ask for two views: one for all, one that names a friend."""
    ports = [free_port(), free_port()]
    script = Path(__file__).with_name("live_origins.js")
    browser = subprocess.Popen(
        ["node", script, *map(str, ports)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    friend = f"http://friend.example:{browser.stdout.readline().strip()}"
    views = [
        serve_long(work, "strangers.mcap", ports[0]),
        serve_long(work, "friends.mcap", ports[1], "--allow-origin", friend),
    ]
    for port in ports:
        wait_for(port)
    said, _ = browser.communicate("\n", timeout=120)
    for view in views:
        view.terminate()
        view.wait()
    if browser.returncode:
        fail(f"pages in a browser: {said}")
    print(f"ok: Chromium: {said.strip()}")


async def crowd(port, over):
    """Comes and goes, fifty at a time: some say nothing, some nonsense."""
    while not over.is_set():
        sockets = []
        for number in range(50):
            with contextlib.suppress(OSError):
                sockets.append(socket.create_connection(("127.0.0.1", port), timeout=1))
                if number % 2:
                    sockets[-1].sendall(b"GET / HTTP/1.1\r\n" + bytes([number]) * 500)
        await asyncio.sleep(0.5)
        for one in sockets:
            one.close()


async def sleeper(port):
    """Subscribes to everything and never reads."""
    stream = socket.socket()
    stream.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    for _ in range(200):
        try:
            stream.connect(("127.0.0.1", port))
            break
        except OSError:
            await asyncio.sleep(0.05)
    stream.sendall(
        b"GET / HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        b"Sec-WebSocket-Version: 13\r\n"
        b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
    )
    await asyncio.sleep(0.5)  # nothing may be said before the answer
    wishes = [{"id": number, "channelId": number} for number in range(1, 11)]
    text = json.dumps({"op": "subscribe", "subscriptions": wishes}).encode()
    stream.sendall(struct.pack(">BBH4x", 0x81, 0x80 | 126, len(text)) + text)
    return stream


async def watched(process, port):
    over = asyncio.Event()
    asleep = await sleeper(port)
    viewer = Viewer(port)
    others = asyncio.create_task(crowd(port, over))
    await viewer.watch()
    over.set()
    await others
    output = (await process.communicate())[0]
    asleep.close()
    return viewer, output


async def record(folder, seconds, live):
    """Records from mock devices, with viewers or without; the account, the viewer, the recording."""
    rig, output = rig_text(folder / "ports", laser_lines=HIGHEST_RATE), folder / "run.mcap"
    with MockRig(folder, "--world", "office", "--rig", folder / "rig.toml", rig=rig) as devices:
        port = free_port()
        words = ["record", "--rig", devices.rig, "-o", output, "--json", "--duration", f"{seconds}s"]
        words += ["--live", str(port)] if live else []
        process = await asyncio.create_subprocess_exec(
            "biplane-onboard", "--quiet", *words, stdout=subprocess.PIPE
        )
        viewer, text = await watched(process, port) if live else (None, (await process.communicate())[0])
    if process.returncode != 0:
        fail(f"record: exit code {process.returncode}")
    return json.loads(text), viewer, output


def check_recordings(work, seconds):
    delays = {False: [], True: []}
    for number, live in enumerate([False, True, True, False]):
        account, viewer, output = asyncio.run(record(work / f"record-{number}", seconds, live))
        if account["dropped"] or account["damaged"] or account["lost"]:
            fail(f"live {live}: {account}")
        spread = account["pose_delays"]["from_last_byte_ms"]
        delays[live].append(spread)
        words = ""
        if live:
            messages, _ = recorded(output)
            for topic in set(TOPICS) - MADE - {"/diagnostics"}:
                if not {payload for _, payload in viewer.of(topic)} <= set(messages[topic]):
                    fail(f"{topic}: other bytes than in the file")
            scans = len(viewer.of("/scan/horizontal"))
            if account["live"]["refused"] < 50 or scans < 0.8 * len(messages["/scan/horizontal"]):
                fail(f"{scans} of {len(messages['/scan/horizontal'])} scans shown; {account['live']}")
            words = f"; {scans} of {account['scans_horizontal']} scans shown, {account['live']}"
        print(
            f"live view {'on ' if live else 'off'}: last byte to pose in the file p50 {spread['p50']:.2f}, "
            f"p99 {spread['p99']:.2f}, p99.9 {spread['p99_9']:.2f} ms{words}"
        )
    for quantile, allowed in [("p50", 1.5), ("p99", 2.0)]:
        off, on = (min(spread[quantile] for spread in delays[live]) for live in [False, True])
        if max(on, DELAY_FLOOR_MS) > allowed * max(off, DELAY_FLOOR_MS):
            fail(f"{quantile}: {on:.2f} ms with viewers, {off:.2f} ms without")
        ratio = on / max(off, 1e-3)
        print(
            f"ok: {quantile} of the delays: {on:.2f} ms with viewers, {off:.2f} ms without, ratio {ratio:.2f}"
        )


def check_taken():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        words = ["biplane-onboard", "record", "--rig", "rig.toml", "-o", "never.mcap", "--live", str(port)]
        done = subprocess.run(words, capture_output=True, text=True)
        refused = done.returncode == 1 and f"127.0.0.1:{port}" in done.stderr
        if not refused or Path("never.mcap.active").exists():
            fail(f"a port that is taken: exit code {done.returncode}, {done.stderr}")
    print(f"ok: {done.stderr.strip()}")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("work")
    parser.add_argument("seconds", type=int, nargs="?", default=12)
    options = parser.parse_args()
    work = fresh_folder(options.work)
    check_replay(work)
    check_reference(work)
    check_browser(work)
    os.chdir(work)
    check_taken()
    check_recordings(work, options.seconds)


main()
