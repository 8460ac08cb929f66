"""Files of other kinds than recordings, mutated: their bytes, their lines, or their numbers."""

import random
import re
from pathlib import Path

import numpy as np
from pypcd4 import Encoding

from lib.programs import RIGS
from odd_input.files import e57, las, obj, pcd, ply, ptx, xyz
from odd_input.shapes import flat, room, woven

NUMBERS = [b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e39", b"-1", b"0", b"1e-320", b"4294967296"]
WORDS = [
    *NUMBERS,
    b"18446744073709551616",
    b"-9223372036854775809",
    b"",
    b"x",
    b"\xff\xfe",
    b"\x00",
    b"9" * 400,
]
SAMPLE = 2000


def mutated_bytes(dice, content):
    """Bits, bytes, stretches."""
    changed = bytearray(content)
    for _ in range(dice.choice([1, 1, 3, 20])):
        at = dice.randrange(len(changed) + 1)
        end = min(len(changed), at + dice.choice([1, 4, 100, 4096]))
        kind = dice.randrange(7)
        if kind == 0:
            del changed[at:]
        elif kind == 1:
            del changed[at:end]
        elif kind == 2:
            changed[at:at] = changed[at:end]
        elif kind == 3:
            changed[at:end] = dice.randbytes(end - at)
        elif kind == 4:
            changed[at:end] = bytes([dice.choice([0, 0xFF])]) * (end - at)
        elif kind == 5:
            other = dice.randrange(len(changed) + 1)
            changed[at:end] = changed[other : other + end - at]
        elif at < len(changed):
            changed[at] ^= 1 << dice.randrange(8)
    return bytes(changed)


def mutated_text(dice, content):
    """Numbers and words, lines, and now and then any bytes."""
    kind = dice.randrange(4)
    if kind == 0:
        return mutated_bytes(dice, content)
    lines = content.split(b"\n")
    if kind == 1:
        at = dice.randrange(len(lines))
        lines[at : at + dice.choice([1, 5])] = dice.choice([[], [lines[at]] * 3, [b""], [dice.choice(WORDS)]])
        return b"\n".join(lines)
    # One place of a line, in this line alone or in every line like it.
    at = dice.randrange(len(lines))
    words = list(re.finditer(rb"[-+.\w]+", lines[at]))
    if not words:
        return b"\n".join(lines)
    place, value = dice.randrange(len(words)), dice.choice(WORDS if kind == 2 else NUMBERS)
    share = dice.choice([0.0, 0.1, 1.0])
    for k, line in enumerate(lines):
        found = list(re.finditer(rb"[-+.\w]+", line))
        is_like = len(found) == len(words) and dice.random() < share
        if k == at or is_like:
            word = found[place]
            lines[k] = line[: word.start()] + value + line[word.end() :]
    return b"\n".join(lines)


def mutated_header(dice, content):
    """The words before the binary part of a PLY, or of a LAS the numbers that say where what is."""
    if content[:4] == b"LASF":
        changed = bytearray(content)
        at = dice.randrange(90, min(375, len(changed) - 8))
        size = dice.choice([1, 2, 4, 8])
        changed[at : at + size] = dice.choice([b"\xff", b"\x00", b"\x7f", dice.randbytes(1)]) * size
        return bytes(changed)
    head, end, body = content.partition(b"end_header\n")
    return mutated_text(dice, head) + end + body if end else mutated_bytes(dice, content)


def mutated_numbers(dice, content):
    """Coordinates of a binary PLY that are no place."""
    head, end, body = content.partition(b"end_header\n")
    values = np.frombuffer(body[: len(body) // 4 * 4], "<f4").copy()
    if not end or len(values) == 0:
        return mutated_bytes(dice, content)
    odd = np.float32(dice.choice([np.nan, np.inf, -np.inf, 1e38, -1e38, 1e-40, 0]))
    values[dice.randrange(len(values)) :: dice.choice([1, 3, 50, len(values)])] = odd
    return head + end + values.tobytes() + body[len(values) * 4 :]


def words_of_ply(points, faces):
    """An ASCII PLY of triangles."""
    head = ["ply", "format ascii 1.0", f"element vertex {len(points)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [f"{x:.4f} {y:.4f} {z:.4f}" for x, y, z in points]
    rows += [" ".join(map(str, (3, *face))) for face in faces]
    return "\n".join([*head, *rows, ""]).encode()


def carmen_log(dice):
    """Lines of each kind, of a robot that drives ahead."""
    lines = ["# CARMEN Logfile", "PARAM robot_front_laser_max 81.9"]
    for k in range(60):
        ranges = " ".join(f"{dice.uniform(1, 8):.2f}" for _ in range(180))
        place, stamp = f"{0.1 * k:.3f} 0.0 0.0", f"{100 + 0.2 * k:.3f} host {0.2 * k:.3f}"
        lines.append(f"ODOM {place} 0.1 0.0 0.0 {stamp}")
        lines.append(f"FLASER 180 {ranges} {place} {place} {stamp}")
        if k % 10 == 0:
            lines.append(f"RAWLASER1 0 -1.57 3.14 0.01745 81.9 0.01 0 180 {ranges} 0 {stamp}")
            lines.append(
                f"ROBOTLASER1 0 -1.57 3.14 0.01745 81.9 0.01 0 180 {ranges} 0 {place} {place} "
                f"0.1 0.0 0.5 0.5 100.0 {stamp}"
            )
    return "\n".join([*lines, ""]).encode()


def base_shapes(work):
    """What is mutated: kind, name, content and the mutations that fit it. `work` holds the base recording."""
    points = room(SAMPLE)
    grid, triangles = flat(30, 20, 0.1, 0.005), woven(30, 20)

    def written(make, name, *words, **options):
        path = work / name
        make(path, *words, **options)
        return path.read_bytes()

    beams = {"scan": np.arange(len(points)) // 100, "beam": np.arange(len(points)) % 100}
    binary = [mutated_bytes, mutated_header, mutated_numbers]
    packed, text = [mutated_bytes, mutated_header], [mutated_text]
    return [
        ("cloud", "room.ply", written(ply, "room.ply", points, columns=beams), binary),
        ("cloud", "room.las", written(las, "room.las", points), packed),
        ("cloud", "room.laz", written(las, "room.laz", points, version="1.4", form=6), packed),
        ("cloud", "room.e57", written(e57, "room.e57", points, 2), [mutated_bytes]),
        (
            "cloud",
            "room.pcd",
            written(pcd, "room.pcd", points, Encoding.BINARY_COMPRESSED),
            [mutated_bytes, mutated_text],
        ),
        ("cloud", "room.ptx", written(ptx, "room.ptx", points), text),
        ("cloud", "room.xyz", written(xyz, "room.xyz", points), text),
        ("mesh", "floor.ply", written(ply, "floor.ply", grid, faces=triangles), binary),
        ("mesh", "words.ply", words_of_ply(grid, triangles), text),
        ("mesh", "floor.obj", written(obj, "floor.obj", grid, triangles), text),
        ("log", "drive.log", carmen_log(random.Random(1)), text),
        ("poses", "posed.tum", (work / "posed.tum").read_bytes(), text),
        ("rig", "rig.toml", Path(RIGS / "paper.toml").read_bytes(), text),
    ]


def mutated_shape(seed, shapes):
    """Kind, name and content of one file."""
    dice = random.Random(seed)
    kind, name, content, mutations = shapes[seed % len(shapes)]
    for _ in range(dice.choice([1, 1, 2])):
        content = dice.choice(mutations)(dice, content) or b"\n"
    return kind, name, content
