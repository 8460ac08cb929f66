#!/usr/bin/env python3
"""Reads a CityJSON file with cjio; projects every surface on its own plane and has GEOS judge it. Solids are
closed and have an inside.

    check_cityjson.py MODEL.city.json [--empty]      --empty: there may be no surface

Needs cjio, numpy, shapely."""

import argparse
import json
import subprocess
import sys
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
from shapely import Polygon, is_valid_reason

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.verdict import require

FLAT_WITHIN_M = 0.005


def check_by_cjio(path):
    words = [sys.executable, "-m", "cjio.cjio", path, "info"]
    info = subprocess.run(words, capture_output=True, text=True)
    require(info.returncode == 0, f"cjio refuses {path}: {info.stdout}{info.stderr}")


def check_surface(name, rings, vertices):
    """Judges one surface; returns how far it is from flat, in meters."""
    points = vertices[rings[0]]
    center = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - center)
    flat = [[tuple((vertices[i] - center) @ axes[:2].T) for i in ring] for ring in rings]
    polygon = Polygon(flat[0], flat[1:])
    require(polygon.is_valid, f"{name}: {is_valid_reason(polygon)}")
    return max(abs(float((vertices[i] - center) @ axes[2])) for ring in rings for i in ring)


def surfaces_of(name, geometry, vertices):
    """The surfaces of a geometry, each a list of rings."""
    if geometry["type"] == "MultiSurface":
        return geometry["boundaries"]
    require(geometry["type"] == "Solid", f"{name} is a {geometry['type']}")
    (shell,) = geometry["boundaries"]
    edges, volume_m3 = Counter(), 0.0
    for ring in (ring for rings in shell for ring in rings):
        edges.update(pairwise([*ring, ring[0]]))
        for b, c in pairwise(ring[1:]):
            volume_m3 += np.dot(vertices[ring[0]], np.cross(vertices[b], vertices[c])) / 6
    odd = [edge for edge, count in edges.items() if count != 1 or edges[edge[::-1]] != 1]
    require(not odd, f"{name}: {len(odd)} edges are not shared by two surfaces that run against each other")
    require(volume_m3 > 0, f"{name} is turned inside out: {volume_m3} m3")
    return shell


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("model", type=Path)
    parser.add_argument("--empty", action="store_true")
    args = parser.parse_args()
    check_by_cjio(args.model)
    model = json.loads(args.model.read_text())
    kind = (model["type"], model["version"])
    require(kind == ("CityJSON", "2.0"), f"{args.model} says that it is {kind}")
    scale, shift = np.array(model["transform"]["scale"]), np.array(model["transform"]["translate"])
    vertices = np.array(model["vertices"], dtype=float).reshape(-1, 3) * scale + shift
    holes, away_m = 0, []
    for name, thing in model["CityObjects"].items():
        for geometry in thing.get("geometry", []):
            for rings in surfaces_of(name, geometry, vertices):
                away_m.append(check_surface(f"{name}, surface {len(away_m)}", rings, vertices))
                holes += len(rings) - 1
    require(away_m or args.empty, f"{args.model} has no surface")
    worst_m = max(away_m, default=0.0)
    require(worst_m < FLAT_WITHIN_M, f"a surface is not flat: {worst_m:.4f} m")
    print(
        f"{args.model}: {len(away_m)} surfaces, {holes} holes, all valid, flat within {1000 * worst_m:.2f} mm"
    )


main()
