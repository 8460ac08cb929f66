"""Meshes that are no building, and files that are no mesh, given to `biplane compact`."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from lib import ply as plain_ply
from lib.programs import OUTSIDE
from odd_input.files import obj, ply
from odd_input.shapes import CUBE, SIDES, ball, flat, pipe, random, room, woven
from odd_input.trials import expect, fails, run

SQUARE = np.array([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], float)
QUAD = [[0, 1, 2, 3]]


def area(points, faces):
    a, b, c = (np.asarray(points, float)[np.asarray(faces)[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def compact(name, polygons=None, covers=None, left=None, says=""):
    """Runs `compact`; number of polygons and leftover triangles within bounds, and the model's area as a
    share of the mesh's."""
    code, text = run(name, "compact", name, "-o", "out.model", "--force")
    expect(name, code == 0, f"exit code {code}: {text.strip()[-200:]}")
    if code != 0:
        return
    expect(name, says in text, f"does not say `{says}`: {text.strip()[-200:]}")
    out = Path("out.model")
    summary = json.loads((out / "summary.json").read_text())
    for key, bounds in (("polygons", polygons), ("leftover_triangles", left)):
        expect(
            name,
            bounds is None or bounds[0] <= summary[key] <= bounds[1],
            f"{summary[key]} {key}, expected {bounds}",
        )
    formats = OUTSIDE / "formats"
    for checker in (
        ["node", formats / "check_gltf.js", out / "model.glb"],
        [sys.executable, formats / "check_cityjson.py", out / "model.city.json", "--empty"],
    ):
        done = subprocess.run(list(map(str, checker)), capture_output=True, text=True)
        expect(name, done.returncode == 0, f"{checker[1].name}: {(done.stdout + done.stderr).strip()[-300:]}")
    if covers:
        share = area(*read_mesh(out / "model.ply")) / area(*read_mesh(out / "raw.ply"))
        expect(name, covers[0] <= share <= covers[1], f"covers {share:.3f} of the surface")


def read_mesh(path):
    """Vertices and triangles of a PLY as `biplane` writes them."""
    rows = plain_ply.read(path)
    return plain_ply.xyz(rows["vertex"]), rows["face"]["vertex_indices"].astype(np.int64)


def meshes():
    one_face()
    units()
    non_manifold()
    curved()


def one_face():
    """Faces with few, many, concave, crossing and no corners."""
    compact(obj("triangle.obj", SQUARE, [[0, 1, 2]]), (1, 1), (0.99, 1.01))
    compact(obj("pieces.obj", SQUARE, [[0, 1], [0], [0, 1, 2]]), (1, 1), (0.99, 1.01))
    turn = np.linspace(0, 2 * np.pi, 50, endpoint=False)
    compact(
        obj("many_corners.obj", np.c_[np.cos(turn), np.sin(turn), 0 * turn], [list(range(50))]),
        (1, 1),
        (0.98, 1.01),
    )
    compact(
        ply("many_corners.ply", np.c_[np.cos(turn), np.sin(turn), 0 * turn], faces=[list(range(50))]),
        (1, 1),
        (0.98, 1.01),
    )
    compact(
        obj("concave.obj", [[0, 0, 0], [4, 0, 0], [4, 4, 0], [2, 0.5, 0], [0, 4, 0]], [[3, 4, 0, 1, 2]]),
        (1, 1),
        (0.99, 1.01),
    )
    compact(obj("bow.obj", [[0, 0, 0], [2, 2, 0], [2, 0, 0], [0, 2, 0]], QUAD), (0, 2))
    on_a_line = np.c_[np.arange(300), np.zeros((300, 2))]
    compact(obj("no_area.obj", on_a_line, [[k, k + 1, k + 2] for k in range(298)]), (0, 0))


def units():
    """Sizes from that of a room to those of another unit, and places far from the origin."""
    for size in (1.0, 30.0, 1000.0):
        compact(obj("square.obj", size * SQUARE, QUAD), (1, 1), (0.99, 1.01), (0, 0))
        compact(obj("cube.obj", size * CUBE, SIDES), (6, 6), (0.99, 1.01), (0, 0))
    for size in (1e-9, 1e-4, 3e4, 1e8, 1e20):
        compact(obj("cube.obj", size * CUBE, SIDES), (0, 6), says="in another unit?")
    compact(obj("cube_utm.obj", 5 * CUBE + [6e6, 5e6, 100], SIDES), (6, 6), (0.99, 1.01), (0, 0))
    for numbers in ("<f8", ">f8"):
        compact(
            ply("cube_utm.ply", 5 * CUBE + [6e6, 5e6, 100], numbers, faces=SIDES),
            (6, 6),
            (0.99, 1.01),
            (0, 0),
        )


def non_manifold():
    """Three walls at an edge, every side three times, two cubes at a corner and at an edge."""
    wall = [[0, 0, 0], [0, 0, 3], [4, 0, 0], [4, 0, 3], [-4, 0, 0], [-4, 0, 3], [0, 4, 0], [0, 4, 3]]
    compact(obj("fin.obj", wall, [[0, 2, 3, 1], [0, 4, 5, 1], [0, 6, 7, 1]]), (2, 3), (0.99, 1.01), (0, 0))
    compact(obj("thrice.obj", 5 * CUBE, SIDES + [side[::-1] for side in SIDES] + SIDES), (6, 6), None, (0, 0))
    for move in ([5, 5, 5], [5, 5, 0]):
        both = np.vstack([5 * CUBE, 5 * CUBE + move])
        compact(
            obj("two.obj", both, SIDES + [[k + 8 for k in side] for side in SIDES]),
            (6, 12),
            (0.98, 1.02),
            (0, 0),
        )


def curved():
    """A large flat thing in small triangles, curved walls, and triangles by chance."""
    compact(obj("floor.obj", flat(300, 300, 0.03, 0.02), woven(300, 300)), (1, 3), (0.5, 1.01), (0, 0))
    for radius, noise, most in ((0.3, 0.003, 40), (1, 0.01, 60), (3, 0.02, 100)):
        compact(obj("pipe.obj", *pipe(radius, 3, 0.03, noise)), (0, most), (0.3, 1.1))
    for radius, noise, most in ((0.3, 0.003, 60), (1, 0.01, 160)):
        compact(obj("ball.obj", *ball(radius, 0.03, noise)), (0, most), (0.2, 1.1))
    triangles = np.arange(900).reshape(300, 3)
    compact(obj("soup.obj", random.uniform(0, 5, (900, 3)), triangles))


def claiming_much(header):
    return header.replace("element face 1", "element face 4000000000")


def broken_meshes():
    corner = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    fails(obj("none.obj", [], []), "no triangle", command="compact")
    fails(obj("beyond.obj", corner, [[0, 1, 3]]), "refers to vertex `4`", command="compact")
    fails(obj("zero.obj", corner, [[-1, 0, 1]]), "refers to vertex `0`", command="compact")
    fails(obj("much.obj", corner, [], "f 1 2 99999999999999999999\n"), "refers to vertex", command="compact")
    fails(
        obj("nan.obj", [[0, 0, 0], [4, 0, np.nan], [4, 3, 0]], [[0, 1, 2]]), "no triangle", command="compact"
    )
    fails(obj("short.obj", corner, [], "v 1 2\n"), "expected `v X Y Z`", command="compact")
    fails(ply("beyond.ply", corner, faces=[[0, 1, 7]]), "refers to vertex 7", command="compact")
    fails(ply("below.ply", corner, faces=[[0, 1, -1]]), "refers to vertex", command="compact")
    fails(ply("points.ply", room(6000)), "no triangle", command="compact")
    boast = ply("boast.ply", corner, faces=[[0, 1, 2]], header=claiming_much)
    fails(boast, "ends inside face 1 of 4000000000", command="compact")
    Path("noise.obj").write_bytes(bytes(range(256)) * 100)
    fails("noise.obj", "no triangle", command="compact")
    Path("long.obj").write_text("v " + "1" * 10_000_000)
    fails("long.obj", "line 1 of the OBJ file", command="compact")
