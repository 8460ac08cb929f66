#!/usr/bin/env python3
"""How much of a facade lies as strips beside the rest of it?

    measure_strips.py MODEL --truth SURFACES.ply [--facade M2] [--max COUNT] [--max-area PERCENT] [--each]
                      [--json]

MODEL is a folder of `biplane build` with model.json; SURFACES.ply the true surfaces, in the frame `map` of
its recording. A facade is a true upright plane with a piece of M2 (20) square meters or more. Polygons are
tried at points spread over them. A point belongs to a facade when the polygon is parallel to it within 3
degrees and looks the same way, and no other such surface is nearer: ledges, panes and pilasters are left
out, because the truth has them there, as far before the *main* plane of the facade, the one with most of
its area. What lies 1 to 15 cm before or behind the main plane is a *strip*. Near an edge of what stands
there, such as an opening, a pilaster or a downpipe, a beam meets two surfaces and is reported between them:
what lies within 15 cm of one is counted as *edges*, the rest as *strips*. Counted are polygons with 0.05 m2
of a kind. For each model: facades, their surface, strips and edges with their area and its share, how far
strips lie beside the main plane, and how far main planes are from the truth (root mean square over the
area). `--each` lists both. Needs numpy and shapely. Exit code 1 when a bound is missed."""

import argparse
import json
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.ops import unary_union

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import ply
from lib.verdict import fail

UPRIGHT, PARALLEL = 0.1, np.cos(np.radians(3))
# A strip lies so far from the main plane of its facade.
BESIDE_M = (0.01, 0.15)
# Polygons of a facade are within this of it.
NEAR_M = 0.20
# Another true surface counts where it is, and this far around it: its borders are as inexact.
AROUND_M = 0.10
# A beam is as wide as this where it meets a facade, 0.8 degrees at 10 m, and may meet both sides of an edge.
# What stands so far before or behind a facade has edges that count.
EDGE_M, EDGE_DEPTH_M = 0.15, 0.50
# Triangles of a facade lie so near to its plane.
FLAT_M = 0.001
# Polygons with less of a kind are not counted.
MIN_M2 = 0.05


class Surface:
    """One upright plane of the truth with all of its area."""

    def __init__(self, normal, offset_m, corners):
        self.normal, self.offset_m = normal, offset_m
        self.along = np.array([-normal[1], normal[0], 0.0]) / np.hypot(normal[0], normal[1])
        flat = self.flat(corners)
        self.shape = unary_union([Polygon(one).buffer(0.001) for one in flat])
        pieces = getattr(self.shape, "geoms", [self.shape])
        self.largest_m2 = max(piece.area for piece in pieces)
        self.around = self.shape.buffer(AROUND_M)
        shapely.prepare(self.around)

    def flat(self, points):
        """Coordinates along the plane and up."""
        return np.stack([points @ self.along, points[..., 2]], axis=-1)

    def off_m(self, points):
        """Signed distances."""
        return points @ self.normal - self.offset_m


class Truth:
    """All triangles of the truth, and its upright planes."""

    def __init__(self, path):
        corners = ply.triangles(path)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(normals, axis=1)
        keep = areas > 1e-9
        self.corners, normals = corners[keep], normals[keep] / areas[keep, None]
        planes = defaultdict(list)
        for index in np.flatnonzero(np.abs(normals[:, 2]) < UPRIGHT):
            offset_m = normals[index] @ self.corners[index, 0]
            planes[(*np.round(normals[index], 2) + 0.0, round(offset_m, 2))].append(index)
        self.surfaces = [
            Surface(normals[of[0]], normals[of[0]] @ self.corners[of[0], 0], self.corners[of])
            for of in planes.values()
        ]


class Face:
    """One polygon of the model: its plane, area, and points spread over it."""

    def __init__(self, polygon, plane):
        self.plane, self.normal, self.offset_m = (
            polygon["plane"],
            np.array(plane["normal"]),
            plane["offset_m"],
        )
        along = np.array([-self.normal[1], self.normal[0], 0.0]) / np.hypot(*self.normal[:2])
        up = np.cross(self.normal, along)
        axes = np.array([along, up])
        rings = [np.array(ring) @ axes.T for ring in (polygon["outer_m"], *polygon["holes_m"])]
        shape = Polygon(rings[0], rings[1:]).buffer(0)
        self.area_m2 = shape.area
        (x0, y0, x1, y1), step_m = shape.bounds, max(0.05, np.sqrt(shape.area / 400))
        x, y = np.meshgrid(np.arange(x0 + step_m / 2, x1, step_m), np.arange(y0 + step_m / 2, y1, step_m))
        inside = shapely.contains_xy(shape, x, y)
        flat = np.stack([x[inside], y[inside]], axis=1)
        if not len(flat):
            flat = np.array([shape.representative_point().coords[0]])
        self.samples = flat @ axes + self.offset_m * self.normal


def is_beside(other, surface):
    """Whether a true surface is parallel to a facade, before or behind it."""
    away_m = other.offset_m - surface.offset_m
    return other.normal @ surface.normal > PARALLEL and FLAT_M < abs(away_m) < EDGE_DEPTH_M


def edges_of(surface, corners):
    """What lies near an edge of a facade, or near what stands before or behind it."""
    off_m = surface.off_m(corners)
    is_near = (off_m.min(axis=1) < EDGE_DEPTH_M) & (off_m.max(axis=1) > -EDGE_DEPTH_M)
    others = surface.flat(corners[is_near & (np.abs(off_m).max(axis=1) > FLAT_M)])
    # Seen from the front what stands across the facade is a line.
    lines = shapely.linestrings(others[:, [0, 1, 2, 0]])
    near = unary_union([*shapely.buffer(lines, EDGE_M), surface.shape.boundary.buffer(EDGE_M)])
    filled = unary_union([near, *shapely.buffer(shapely.polygons(others), 0)])
    shapely.prepare(filled)
    return filled


class Facade:
    """What a model has of one facade."""

    def __init__(self, index, truth, faces):
        self.index, self.surface = index, truth.surfaces[index]
        self.beside = [other for other in truth.surfaces if is_beside(other, self.surface)]
        self.edges = edges_of(self.surface, truth.corners)
        parallel = [face for face in faces if face.normal @ self.surface.normal > PARALLEL]
        near = [(face, np.abs(self.surface.off_m(face.samples)) < NEAR_M) for face in parallel]
        by_plane = defaultdict(float)
        for face, on in near:
            by_plane[face.plane] += face.area_m2 * (on & self.covers(face)).mean()
        self.main = None
        if max(by_plane.values(), default=0.0) > 0:
            plane = max(by_plane, key=lambda plane: (by_plane[plane], -plane))
            self.main = next(face for face in parallel if face.plane == plane)
            # Pairs of a polygon and which of its points are on the facade.
            self.faces = [(face, self.belongs(face)) for face in parallel]

    def covers(self, face):
        """Which points of a polygon are before or behind the facade."""
        return shapely.contains_xy(self.surface.around, *self.surface.flat(face.samples).T)

    def off_m(self, face):
        """How far the points of a polygon are before the main plane: all of a model may lie off the truth."""
        return face.samples @ self.main.normal - self.main.offset_m

    def belongs(self, face):
        """Which points of a polygon belong to the facade, and to nothing else that is there."""
        off_m, at = self.off_m(face), self.surface.flat(face.samples)
        own = (np.abs(off_m) < NEAR_M) & self.covers(face)
        for other in self.beside:
            is_nearer = np.abs(off_m - (other.offset_m - self.surface.offset_m)) < np.abs(off_m)
            if (own & is_nearer).any():
                own &= ~(is_nearer & shapely.contains_xy(other.around, at[:, 0], at[:, 1]))
        return own

    def area_m2(self):
        """How large its surface is in the model."""
        return sum(face.area_m2 * on.mean() for face, on in self.faces)

    def main_squares(self):
        """Area and mean squared distance from the truth of each polygon of the main plane."""
        own = [(face, on) for face, on in self.faces if face.plane == self.main.plane and on.any()]
        squares = [(self.surface.off_m(face.samples[on]) ** 2).mean() for face, on in own]
        return [(face.area_m2 * on.mean(), square) for (face, on), square in zip(own, squares, strict=True)]

    def strips(self):
        """What lies beside the main plane."""
        for face, on in self.faces:
            off_m = self.off_m(face)
            beside = on & (np.abs(off_m) >= BESIDE_M[0]) & (np.abs(off_m) <= BESIDE_M[1])
            if face.plane == self.main.plane or not beside.any():
                continue
            at = self.surface.flat(face.samples)
            at_edge = shapely.contains_xy(self.edges, at[:, 0], at[:, 1])
            for kind, which in (("edges", beside & at_edge), ("strips", beside & ~at_edge)):
                area_m2 = face.area_m2 * which.mean()
                if area_m2 >= MIN_M2:
                    yield {
                        "kind": kind,
                        "facade": self.index,
                        "area_m2": area_m2,
                        "off_m": float(off_m[which].mean()),
                        "true_off_m": float(self.surface.off_m(face.samples[which]).mean()),
                        "u_m": [float(at[which, 0].min()), float(at[which, 0].max())],
                        "z_m": [float(at[which, 1].min()), float(at[which, 1].max())],
                    }


def measure(folder, truth, min_m2):
    """The figures of one model, and its strips."""
    model = json.loads((folder / "model.json").read_text())["model"]
    planes = model["planes"]
    upright = [p for p in model["polygons"] if abs(planes[p["plane"]]["normal"][2]) < UPRIGHT]
    faces = [Face(polygon, planes[polygon["plane"]]) for polygon in upright]
    large = [index for index, surface in enumerate(truth.surfaces) if surface.largest_m2 >= min_m2]
    facades = [Facade(index, truth, faces) for index in large]
    facades = [facade for facade in facades if facade.main]
    each = [strip for facade in facades for strip in facade.strips()]
    total_m2 = sum(facade.area_m2() for facade in facades)
    squares = np.array([pair for facade in facades for pair in facade.main_squares()]).reshape(-1, 2)
    figures = {"facades": len(facades), "surface_m2": total_m2}
    for kind in ("strips", "edges"):
        own = [one for one in each if one["kind"] == kind]
        area_m2 = sum(one["area_m2"] for one in own)
        beside_m = sum(abs(one["off_m"]) * one["area_m2"] for one in own) / max(area_m2, 1e-9)
        share = 100 * area_m2 / max(total_m2, 1e-9)
        figures |= {kind: len(own), f"{kind}_m2": area_m2, f"{kind}_share": share}
        figures[f"{kind}_beside_cm"] = 100 * beside_m
    figures["main_rms_cm"] = 100 * float(np.sqrt(squares.prod(axis=1).sum() / max(squares[:, 0].sum(), 1e-9)))
    return figures, each


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", type=Path, metavar="MODEL")
    parser.add_argument("--truth", type=Path, required=True)
    parser.add_argument("--facade", type=float, default=20.0)
    parser.add_argument("--max", type=int)
    parser.add_argument("--max-area", type=float)
    parser.add_argument("--each", action="store_true")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    figures, strips = measure(options.model, Truth(options.truth), options.facade)
    if options.json:
        print(json.dumps({"model": str(options.model), **figures, "each": strips}))
    else:
        print(f"{options.model}: " + ", ".join(f"{name} {value:.4g}" for name, value in figures.items()))
    if options.each and not options.json:
        for one in sorted(strips, key=lambda strip: -strip["area_m2"]):
            (u0, u1), (z0, z1) = one["u_m"], one["z_m"]
            print(
                f"  {one['kind']}, facade {one['facade']}: {one['area_m2']:.2f} m2, "
                f"{100 * one['off_m']:+.1f} cm beside, {100 * one['true_off_m']:+.1f} cm off the truth, "
                f"along {u0:.1f} to {u1:.1f} m, up {z0:.1f} to {z1:.1f} m"
            )
    if options.max is not None and figures["strips"] > options.max:
        fail(f"{figures['strips']} strips, expected {options.max} or fewer")
    share = figures["strips_share"]
    if options.max_area is not None and share > options.max_area:
        fail(f"strips are {share:.2f} % of the facades, expected {options.max_area:g} or less")


if __name__ == "__main__":
    main()
