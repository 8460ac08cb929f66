#!/usr/bin/env python3
"""CityJSON read by cjio; every surface projected on its own plane and judged by GEOS.

  check_cityjson.py MODEL.city.json [--empty]      --empty: there may be no surface
"""
import json
import subprocess
import sys

import numpy as np
from shapely import Polygon, is_valid_reason

path = sys.argv[1]
cjio = [sys.executable, "-m", "cjio.cjio"]
info = subprocess.run([*cjio, path, "info"], capture_output=True, text=True)
assert info.returncode == 0, info.stdout + info.stderr
model = json.load(open(path))
assert model["type"] == "CityJSON" and model["version"] == "2.0", (model["type"], model["version"])
scale, shift = np.array(model["transform"]["scale"]), np.array(model["transform"]["translate"])
vertices = np.array(model["vertices"], dtype=float).reshape(-1, 3) * scale + shift
surfaces = holes = 0
worst_m = 0.0
for name, thing in model["CityObjects"].items():
    for geometry in thing["geometry"]:
        assert geometry["type"] == "MultiSurface", geometry["type"]
        for rings in geometry["boundaries"]:
            points = vertices[rings[0]]
            centre = points.mean(axis=0)
            _, _, axes = np.linalg.svd(points - centre)
            flat = [[tuple((vertices[i] - centre) @ axes[:2].T) for i in ring] for ring in rings]
            worst_m = max([worst_m] + [abs(float((vertices[i] - centre) @ axes[2])) for ring in rings for i in ring])
            polygon = Polygon(flat[0], flat[1:])
            assert polygon.is_valid, f"{name}, surface {surfaces}: {is_valid_reason(polygon)}"
            surfaces += 1
            holes += len(rings) - 1
assert surfaces > 0 or "--empty" in sys.argv[2:], "no surface"
assert worst_m < 0.005, f"a surface is not flat: {worst_m:.4f} m"
print(f"{path}: {surfaces} surfaces, {holes} holes, all valid, flat within {1000 * worst_m:.2f} mm")
