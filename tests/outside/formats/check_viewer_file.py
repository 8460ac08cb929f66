#!/usr/bin/env python3
"""Reads model.mcap as viewers of robots do, and holds it against the other files of its folder.

    check_viewer_file.py MODEL_DIR

Messages are decoded twice: by the definitions that the file carries (mcap-ros2-support), and by those of
ROS 2 Humble (rosbags). Both have to agree. The model's triangles, the points, the map and the way have to be
those of model.ply, points.ply, map.pgm and trajectory.tum. docs/model-layout.json has to name every topic and
every namespace of the file, with settings for the types that these have."""

import argparse
import json
import math
import pathlib
import re
import sys

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_typestore

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))

from lib.programs import ROOT
from lib.verdict import require

MOST_POINTS = 1_000_000
TRIANGLE_LIST, LINE_STRIP = 11, 4
LAYOUT = ROOT / "docs/model-layout.json"
# What the 3D panel of Foxglove has a setting for, by the type of a topic.
SETTING_OF = {
    "visualization_msgs/msg/MarkerArray": "namespaces",
    "sensor_msgs/msg/PointCloud2": "pointSize",
    "nav_msgs/msg/OccupancyGrid": "frameLocked",
}


def messages(path):
    """Of each topic the message by the file's own definitions, and by Humble's."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    found = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        require(reader.get_header().profile == "ros2", f"the profile is {reader.get_header().profile}")
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            require(channel.topic not in found, f"{channel.topic} has two messages")
            check_setting(channel.topic, schema.name)
            found[channel.topic] = (decoded, store.deserialize_cdr(message.data, schema.name))
    return found


def layout_topics():
    """What the layout's 3D panel has for each topic."""
    layout = json.loads(LAYOUT.read_text())
    panel = layout["configById"][layout["layout"]]
    require(panel["followTf"] == "map", "the layout does not stand in map")
    return panel["topics"]


def check_setting(topic, type_name):
    settings = layout_topics().get(topic)
    require(settings is not None, f"the layout has no {topic}")
    setting = SETTING_OF[type_name]
    require(setting in settings, f"the layout has no {setting} for {topic}, which is a {type_name}")


def check_namespaces(own):
    known = set(layout_topics()["/model"]["namespaces"])
    used = {marker.ns for marker in own.markers}
    require(used <= known, f"the layout has no namespace {', '.join(sorted(used - known))}")


def counts(path):
    """How many of each element a PLY file has."""
    with path.open("rb") as file:
        head = file.read(1 << 16).split(b"end_header\n")[0].decode("ascii")
    return {name: int(number) for name, number in re.findall(r"element (\w+) (\d+)", head)}


def as_array(points):
    return np.array([(point.x, point.y, point.z) for point in points])


def check_model(folder, own, humble):
    require(len(own.markers) == len(humble.markers) > 0, "no markers, or as many as read")
    triangles, names = 0, set()
    for mine, theirs in zip(own.markers, humble.markers, strict=True):
        name = f"{theirs.ns} {theirs.id}"
        same = (mine.ns, mine.id, mine.type) == (theirs.ns, theirs.id, theirs.type)
        same &= np.array_equal(as_array(mine.points), as_array(theirs.points))
        require(same, f"{name} differs by whose definitions it is read")
        require(mine.header.frame_id == theirs.header.frame_id == "map", f"{name} is not in map")
        plain = theirs.color.a == 1 and theirs.pose.orientation.w == 1 and theirs.text == ""
        require(plain, f"{name} is not drawn as it is")
        require(name not in names, f"two markers are {name}")
        names.add(name)
        if mine.type == TRIANGLE_LIST:
            require(len(mine.points) % 3 == 0, f"{name} ends within a triangle")
            triangles += len(mine.points) // 3
        else:
            require(mine.type == LINE_STRIP and mine.ns == "way", f"{name} is of type {mine.type}")
    expected = counts(folder / "model.ply")["face"]
    require(triangles == expected, f"{triangles} triangles, model.ply has {expected}")
    return triangles


def check_way(folder, own):
    path = folder / "trajectory.tum"
    way = [marker for marker in own.markers if marker.ns == "way"]
    if not path.exists():
        require(not way, "a way of a mesh")
        return
    poses = np.atleast_2d(np.loadtxt(path))[:, 1:4]
    drawn = np.concatenate([as_array(marker.points) for marker in way])
    same = drawn.shape == poses.shape and np.allclose(drawn, poses, atol=1e-6)
    require(same, "the way is not that of trajectory.tum")


def check_points(folder, own, humble):
    count = counts(folder / "points.ply")["vertex"]
    expected = math.ceil(count / max(1, math.ceil(count / MOST_POINTS)))
    require(own.width == humble.width == expected, f"{own.width} points for {expected}")
    fields = [field.name for field in own.fields]
    require(fields == ["x", "y", "z"] and own.point_step == 12, f"points have {fields}")
    points = np.frombuffer(bytes(humble.data), "<f4").reshape(-1, 3)
    require(len(points) == expected and np.isfinite(points).all(), "points that are no numbers")
    return expected


def check_map(folder, own, humble):
    magic, size, white, pixels = (folder / "map.pgm").read_bytes().split(b"\n", 3)
    columns, rows = map(int, size.split())
    require((magic, white) == (b"P5", b"255"), "map.pgm is none")
    require((own.info.width, own.info.height) == (columns, rows), "the map has another size")
    image = np.frombuffer(pixels, np.uint8).reshape(rows, columns)[::-1].ravel()
    cells = np.array(humble.data, dtype=np.int8)
    same = np.array_equal(cells == 100, image == 0) and np.array_equal(cells == 0, image == 254)
    require(same, "the map differs from map.pgm")
    text = (folder / "map.yaml").read_text()
    origin = [float(word) for word in re.search(r"origin: \[(.*)\]", text).group(1).split(",")]
    resolution = float(re.search(r"resolution: (.*)", text).group(1))
    corner = own.info.origin.position
    same = math.isclose(own.info.resolution, resolution, rel_tol=1e-6)
    require(same and np.allclose([corner.x, corner.y], origin[:2]), "the map lies elsewhere")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=pathlib.Path)
    folder = parser.parse_args().folder
    found = messages(folder / "model.mcap")
    triangles = check_model(folder, *found["/model"])
    check_way(folder, found["/model"][0])
    check_namespaces(found["/model"][0])
    points = check_points(folder, *found["/points"]) if "/points" in found else 0
    for topic, name in (("/points", "points.ply"), ("/map", "map.pgm")):
        require((topic in found) == (folder / name).exists(), f"{topic} does not follow {name}")
    if len(found) == len(SETTING_OF):
        require(set(layout_topics()) == set(found), "the layout names topics that the file does not have")
    if "/map" in found:
        check_map(folder, *found["/map"])
    print(f"{folder}/model.mcap: {triangles} triangles, {points} points, {', '.join(sorted(found))}")


if __name__ == "__main__":
    main()
