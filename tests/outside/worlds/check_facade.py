#!/usr/bin/env python3
"""How many windows of a building seen from outside does a model have?

    check_facade.py MODEL... --truth SURFACES.ply [--beams N] [--least PERCENT] [--least-ifc PERCENT] [--json]

MODEL is a folder of `biplane build` with model.json, points.ply and model.ifc; SURFACES.ply the true
surfaces, in the frame `map` of its recording. A true window is an upright rectangle, half a meter to three
meters wide and high, that lies 5 to 40 cm behind a larger surface which surrounds it. It counts when N beams
(200) ended on it. It is found as *holes* when a hole of an upright polygon lies where it is, center and size
within 15 cm, and as *ifc* when an IfcWindow does. *false* are IfcWindows of the model where no true one is,
seen or not. Needs numpy and ifcopenshell. Exit code 1 when a share is lower than asked."""

import argparse
import json
import sys
from collections import defaultdict
from pathlib import Path

import ifcopenshell
import ifcopenshell.geom
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import ply
from lib.verdict import fail

UPRIGHT, SIDES_M, DEPTH_M = 0.1, (0.5, 3.0), (0.05, 0.40)
# A surface surrounds a window that is so far around it.
AROUND_M = 0.05
# What is found may lie this far from the truth, and is this much wider or higher at most.
OFF_M, ACROSS_M = 0.15, 0.45
# A beam ends on a window so near to its plane.
ON_M = 0.12


class Rectangle:
    """An upright rectangle: middle, horizontal direction, normal, width and height."""

    def __init__(self, points, normal):
        self.normal = np.array([normal[0], normal[1], 0.0]) / np.hypot(normal[0], normal[1])
        self.along = np.array([-self.normal[1], self.normal[0], 0.0])
        low = np.array([(points @ self.along).min(), points[:, 2].min()])
        high = np.array([(points @ self.along).max(), points[:, 2].max()])
        self.size = high - low
        u, z = (low + high) / 2
        depth = (points @ self.normal).mean()
        self.middle = u * self.along + np.array([0, 0, z]) + depth * self.normal

    def is_like(self, other):
        """Whether another one is the same within the tolerances."""
        away = other.middle - self.middle
        return (
            abs(abs(self.normal @ other.normal) - 1) < 0.02
            and abs(away @ self.normal) < ACROSS_M
            and abs(away @ self.along) < OFF_M
            and abs(away[2]) < OFF_M
            and (np.abs(self.size - other.size) < OFF_M).all()
        )


class Surface:
    """All triangles of one upright plane that hang together or not."""

    def __init__(self, normal, offset_m, corners):
        self.normal, self.offset_m, self.corners = normal, offset_m, corners

    def covers(self, point):
        """Whether the foot of a point is on one of the triangles."""
        along = np.array([-self.normal[1], self.normal[0], 0.0])
        flat = np.stack([self.corners @ along, self.corners[..., 2]], axis=-1)
        at = np.array([point @ along, point[2]])
        a, b, c = (flat[:, k] - at for k in range(3))

        def turn(p, q):
            return p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]

        turns = np.stack([turn(a, b), turn(b, c), turn(c, a)])
        return bool(((turns >= 0).all(axis=0) | (turns <= 0).all(axis=0)).any())


def pieces(triangles):
    """Groups of triangles that share edges."""
    parent = list(range(len(triangles)))

    def root(k):
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    owner = {}
    for index, triangle in enumerate(triangles):
        names = [tuple(np.round(corner * 1000).astype(int)) for corner in triangle]
        for k in range(3):
            edge = tuple(sorted((names[k], names[(k + 1) % 3])))
            parent[root(index)] = root(owner.setdefault(edge, index))
    groups = defaultdict(list)
    for index in range(len(triangles)):
        groups[root(index)].append(index)
    return groups.values()


def true_windows(path):
    """The windows of the true surfaces."""
    corners = ply.triangles(path)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    keep = areas > 1e-9
    corners, normals, areas = corners[keep], normals[keep] / areas[keep, None], areas[keep] / 2
    upright = np.abs(normals[:, 2]) < UPRIGHT
    planes = defaultdict(list)
    for index in np.flatnonzero(upright):
        offset_m = normals[index] @ corners[index, 0]
        planes[(*np.round(normals[index], 2) + 0.0, round(offset_m, 2))].append(index)
    surfaces = [
        Surface(normals[of[0]], normals[of[0]] @ corners[of[0], 0], corners[of]) for of in planes.values()
    ]
    windows = []
    for of in planes.values():
        for group in pieces(corners[of]):
            own = [of[k] for k in group]
            found = Rectangle(corners[own].reshape(-1, 3), normals[own[0]])
            is_full = abs(areas[own].sum() - found.size.prod()) < 0.02
            is_large = ((found.size > SIDES_M[0]) & (found.size < SIDES_M[1])).all()
            if is_full and is_large and any(surrounds(surface, found) for surface in surfaces):
                windows.append(found)
    return windows


def surrounds(surface, window):
    """Whether a surface before a window is there on all four sides of it, and not in its middle."""
    before_m = surface.offset_m - surface.normal @ window.middle
    if surface.normal @ window.normal < 0.999 or not DEPTH_M[0] < before_m < DEPTH_M[1]:
        return False
    half = window.size / 2 + AROUND_M
    up = np.array([0, 0, 1.0])
    around = [side * half[0] * window.along for side in (-1, 1)] + [side * half[1] * up for side in (-1, 1)]
    return not surface.covers(window.middle) and all(surface.covers(window.middle + off) for off in around)


def holes(folder):
    """The holes of the upright polygons of a model."""
    model = json.loads((folder / "model.json").read_text())["model"]
    found = []
    for polygon in model["polygons"]:
        normal = model["planes"][polygon["plane"]]["normal"]
        if abs(normal[2]) < UPRIGHT:
            found.extend(Rectangle(np.array(ring), normal) for ring in polygon["holes_m"])
    return found


def ifc_windows(folder):
    """The openings that the IfcWindows of a model fill."""
    file = ifcopenshell.open(folder / "model.ifc")
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    # A window in a wall without depth is a profile: curves.
    settings.set("dimensionality", ifcopenshell.ifcopenshell_wrapper.CURVES_SURFACES_AND_SOLIDS)
    found = []
    for window in file.by_type("IfcWindow"):
        shape = ifcopenshell.geom.create_shape(settings, window)
        points = np.array(shape.geometry.verts).reshape(-1, 3)
        # A frame is thinnest across its wall.
        flat = points[:, :2] - points[:, :2].mean(axis=0)
        across = np.linalg.eigh(flat.T @ flat)[1][:, 0]
        found.append(Rectangle(points, across))
    return found


def measure(folder, windows, least_beams):
    """The figures of one model."""
    points = ply.xyz(ply.vertices(folder / "points.ply"))

    def beams(window):
        away = points - window.middle
        on = (np.abs(away @ window.along) < window.size[0] / 2) & (np.abs(away[:, 2]) < window.size[1] / 2)
        return int((on & (np.abs(away @ window.normal) < ON_M)).sum())

    seen = [window for window in windows if beams(window) >= least_beams]
    as_holes, as_ifc = holes(folder), ifc_windows(folder)

    def share(found):
        return 100 * sum(any(window.is_like(one) for one in found) for window in seen) / max(len(seen), 1)

    wrong = sum(not any(window.is_like(one) for window in windows) for one in as_ifc)
    return {
        "windows": len(windows),
        "seen": len(seen),
        "holes": round(share(as_holes), 1),
        "ifc": round(share(as_ifc), 1),
        "false": wrong,
    }


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--truth", type=Path, required=True)
    parser.add_argument("--beams", type=int, default=200)
    parser.add_argument("--least", type=float, default=0)
    parser.add_argument("--least-ifc", type=float, default=0)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    windows = true_windows(options.truth)
    for folder in options.models:
        figures = measure(folder, windows, options.beams)
        if options.json:
            print(json.dumps({"model": folder.name, **figures}))
        else:
            print(f"{folder.name}: " + ", ".join(f"{name} {value}" for name, value in figures.items()))
        if not figures["seen"]:
            fail(f"{folder.name}: no window that {options.beams} beams hit")
        for name, least in (("holes", options.least), ("ifc", options.least_ifc)):
            if figures[name] < least:
                fail(f"{folder.name}: {name} {figures[name]}, and {least} are asked")


if __name__ == "__main__":
    main()
