#!/usr/bin/env python3
"""Reads a CityJSON file with cjio; projects every surface on its own plane and has GEOS judge it.

    check_cityjson.py MODEL.city.json [--empty]      --empty: there may be no surface

Needs cjio, numpy, shapely."""

import argparse
import json
import subprocess
import sys
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
    """Judges one surface; returns how far it is from flat, in metres."""
    points = vertices[rings[0]]
    centre = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - centre)
    flat = [[tuple((vertices[i] - centre) @ axes[:2].T) for i in ring] for ring in rings]
    polygon = Polygon(flat[0], flat[1:])
    require(polygon.is_valid, f"{name}: {is_valid_reason(polygon)}")
    return max(abs(float((vertices[i] - centre) @ axes[2])) for ring in rings for i in ring)


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
        for geometry in thing["geometry"]:
            require(geometry["type"] == "MultiSurface", f"{name} is a {geometry['type']}")
            for rings in geometry["boundaries"]:
                away_m.append(check_surface(f"{name}, surface {len(away_m)}", rings, vertices))
                holes += len(rings) - 1
    require(away_m or args.empty, f"{args.model} has no surface")
    worst_m = max(away_m, default=0.0)
    require(worst_m < FLAT_WITHIN_M, f"a surface is not flat: {worst_m:.4f} m")
    print(
        f"{args.model}: {len(away_m)} surfaces, {holes} holes, all valid, flat within {1000 * worst_m:.2f} mm"
    )


main()
