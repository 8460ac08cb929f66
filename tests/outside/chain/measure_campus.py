#!/usr/bin/env python3
"""A campus of several simulated buildings, built whole and in tiles: the same bytes.

    measure_campus.py WORKDIR [--columns N] [--rows N]       with our programs on PATH

Writes a world of buildings with twelve furnished rooms each and a drive through all of them, records it with
the fast rig, builds it by `biplane build` and by `biplane tiles`, and compares all files but those that hold
times. It wants more than ten million points, from which on both search in squares: fewer are refused.
Needs 3 GB of memory and 2 GB of disk, and some minutes; no step of the gate runs it."""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import RIGS, fresh_folder, json_of, output_of, run
from lib.verdict import require

# Rooms of a building, side of a room and width of a door, height of rooms and of doors, way between two
# buildings, thickness of walls; meters.
ROOMS, SIDE_M, DOOR_M, HEIGHT_M, LINTEL_M, GAP_M, WALL_M = (4, 3), 10.0, 1.2, 3.0, 2.1, 13.0, 0.15
LEAST_POINTS = 10_000_000
SPEED_M_S = 0.8
TIMED = {"summary.json", "report.html"}


class World:
    """An OBJ file in the making."""

    def __init__(self):
        self.corners, self.faces = [], []

    def quad(self, *corners):
        first = len(self.corners) + 1
        self.corners += corners
        self.faces.append([first, first + 1, first + 2, first + 3])

    def wall(self, start, end, low=0.0, high=HEIGHT_M):
        self.quad((*start, low), (*end, low), (*end, high), (*start, high))

    def wall_with_door(self, start, along):
        """A wall of the length of a room, with a door in its middle."""
        at = [[start[k] + along[k] * t for k in range(2)] for t in (0, (SIDE_M - DOOR_M) / 2)]
        at += [[start[k] + along[k] * t for k in range(2)] for t in ((SIDE_M + DOOR_M) / 2, SIDE_M)]
        self.wall(at[0], at[1])
        self.wall(at[2], at[3])
        self.wall(at[1], at[2], LINTEL_M)

    def box(self, x, y, height):
        around = [(x, y), (x + 1.2, y), (x + 1.2, y + 0.6), (x, y + 0.6)]
        for k in range(4):
            self.wall(around[k], around[(k + 1) % 4], 0.0, height)
        self.quad(*((*corner, height) for corner in around))

    def building(self, x, y):
        columns, rows = ROOMS
        corners = [(x, y), (x + columns * SIDE_M, y)]
        corners += [(corner[0], y + rows * SIDE_M) for corner in reversed(corners)]
        for height in (0.0, HEIGHT_M):
            self.quad(*((*corner, height) for corner in corners))
        for column in range(columns):
            for row in range(rows):
                left, low = x + column * SIDE_M, y + row * SIDE_M
                self.box(
                    left + 1.5, low + 1.0 + 0.5 * ((column + row) % 3), 0.8 + 0.3 * ((column + 2 * row) % 3)
                )
        for column in range(columns + 1):
            for row in range(rows):
                left, low = x + column * SIDE_M, y + row * SIDE_M
                self.two_faces((left, low), (0, 1), row == 0 or column not in (0, columns))
        for row in range(rows + 1):
            for column in range(columns):
                left, low = x + column * SIDE_M, y + row * SIDE_M
                self.two_faces((left, low), (1, 0), row not in (0, rows))

    def two_faces(self, start, along, has_door):
        """Both faces of a wall of the length of a room."""
        for off in (0.0, WALL_M):
            corner = (start[0] + along[1] * off, start[1] + along[0] * off)
            if has_door:
                self.wall_with_door(corner, along)
            else:
                self.wall(corner, (corner[0] + along[0] * SIDE_M, corner[1] + along[1] * SIDE_M))

    def text(self):
        lines = [f"v {x:g} {y:g} {z:g}" for x, y, z in self.corners]
        for number, (a, b, c, d) in enumerate(self.faces):
            lines += [f"o face{number}", f"f {a} {b} {c}", f"f {a} {c} {d}"]
        return "\n".join(lines) + "\n"


def through(x, y):
    """The way through a building's rooms: up and down its columns, from the first of the lowest row to the
    last."""
    columns, rows = ROOMS
    order = []
    for column in range(columns):
        up = [(column, row) for row in range(rows)]
        order += reversed(up) if column % 2 else up
    return [(x + (column + 0.5) * SIDE_M, y + (row + 0.5) * SIDE_M) for column, row in order]


def campus(work, columns, rows):
    """World and path: rows of buildings, driven from left to right and, one row higher, back again."""
    world, way = World(), []
    step = [ROOMS[0] * SIDE_M + GAP_M, ROOMS[1] * SIDE_M + GAP_M]
    for row in range(rows):
        of_row = []
        for column in range(columns):
            x, y = column * step[0], row * step[1]
            world.building(x, y)
            of_row.append(through(x, y))
        if row % 2:
            of_row = [list(reversed(part)) for part in reversed(of_row)]
        way += [point for part in of_row for point in part]
        if row + 1 < rows:
            x, y = way[-1]
            out = x + SIDE_M / 2 + GAP_M / 2 if row % 2 == 0 else x - SIDE_M / 2 - GAP_M / 2
            way += [(out, y), (out, y + step[1])]
    (work / "campus.obj").write_text(world.text())
    points = "".join(f"  [{x:g}, {y:g}],\n" for x, y in way)
    (work / "campus.toml").write_text(f"speed_m_s = {SPEED_M_S}\nwaypoints_m = [\n{points}]\n")


def record(work):
    words = ["--world", "campus.obj", "--path", "campus.toml", "--rig", RIGS / "fast.toml"]
    run("biplane-mock", "simulate", *words, "-o", "bytes.mcap", "--truth", "truth", cwd=work)
    run("biplane-onboard", "--quiet", "replay", "bytes.mcap", "-o", "run.mcap", cwd=work)
    (work / "bytes.mcap").unlink()


def same_bytes(one, other):
    names = sorted(str(path.relative_to(one)) for path in one.rglob("*") if path.is_file())
    require(
        names == sorted(str(path.relative_to(other)) for path in other.rglob("*") if path.is_file()), "names"
    )
    names = [name for name in names if name not in TIMED]
    different = [name for name in names if (one / name).read_bytes() != (other / name).read_bytes()]
    require(not different, f"other bytes: {different}")
    return len(names)


def told(name, summary, seconds):
    cost = f"{summary['cpu_s']:.0f} s of processors, {summary['peak_memory_bytes'] / 1e6:.0f} MB"
    counts = f"{summary['raw_points']} points, {summary['planes']} planes, {summary['polygons']} polygons"
    print(f"{name}: {counts}; {cost}, {seconds:.0f} s", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("work", type=Path)
    parser.add_argument("--columns", type=int, default=3)
    parser.add_argument("--rows", type=int, default=2)
    words = parser.parse_args()
    work = fresh_folder(words.work)
    campus(work, words.columns, words.rows)
    record(work)
    target = ["--no-report", "--formats", "ply", "--json"]
    began = time.monotonic()
    whole = json_of(
        "biplane", "--quiet", "build", "run.mcap", "-o", "whole", "--no-optimize", *target, cwd=work
    )
    told("whole", whole, time.monotonic() - began)
    require(whole["raw_points"] - whole["revisited_points"] >= LEAST_POINTS, "too few points to be divided")
    plan = ["tiles", "plan", "run.mcap", "-o", "tiles", "--no-optimize"]
    count = int(output_of("biplane", "--quiet", *plan, cwd=work).split()[0])
    for index in reversed(range(count)):
        run("biplane", "--quiet", "tiles", "run", "tiles", "--index", index, cwd=work)
    began = time.monotonic()
    merged = json_of("biplane", "--quiet", "tiles", "merge", "tiles", "-o", "merged", *target, cwd=work)
    told(f"{count} tiles, merge", merged, time.monotonic() - began)
    print(f"{same_bytes(work / 'whole', work / 'merged')} files have the same bytes")


main()
