#!/usr/bin/env python3
"""Builds a model that lies askew in its frame and exports it with --align-walls. The walls have to lie along
x and y, and what the files say of their turn has to lead back to the frame.

    check_aligned.py RUN.mcap WORKDIR      with biplane on PATH

Drawings are read with ezdxf, buildings with ifcopenshell, its validator and its geometry kernel."""

import argparse
import json
import math
import shutil
import sys
from pathlib import Path

import ezdxf
import ifcopenshell
import ifcopenshell.geom
import ifcopenshell.validate
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import output_of, run
from lib.verdict import require

# How the model is laid into its frame, degrees.
ASKEW_DEG = 17.0
# Lines this near to an axis lie along it, degrees.
ALONG_DEG = 1.0
# Coordinates are written with four decimals.
SAME_M = 1e-3


def lay_askew(source, target):
    """A trajectory in the TUM form, turned about the start."""
    half, cos, sin = (f(math.radians(ASKEW_DEG) / k) for f, k in ((float, 2), (math.cos, 1), (math.sin, 1)))
    rows = []
    for row in np.loadtxt(source, dtype=str):
        x, y, z, qx, qy, qz, qw = map(float, row[1:])
        a, b = math.cos(half), math.sin(half)
        # The turn's quaternion (0, 0, b, a) before the pose's.
        turned = (a * qx - b * qy, a * qy + b * qx, a * qz + b * qw, a * qw - b * qz)
        rows.append((row[0], cos * x - sin * y, sin * x + cos * y, z, *turned))
    target.write_text("".join(" ".join(map(str, row)) + "\n" for row in rows))


def walls_of(folder):
    """Ends of the lines of walls in the drawing, in the file's order."""
    space = ezdxf.readfile(folder / "model.dxf").modelspace()
    lines = space.query('LINE[layer ? ".*WALLS"]')
    return np.array([[(end.x, end.y) for end in (line.dxf.start, line.dxf.end)] for line in lines])


def share_along_axes(walls):
    way = walls[:, 1] - walls[:, 0]
    length = np.hypot(*way.T)
    off_deg = (np.degrees(np.arctan2(way[:, 1], way[:, 0])) + 45) % 90 - 45
    return length[np.abs(off_deg) < ALONG_DEG].sum() / length.sum()


def bodies_of(folder):
    """The building and the world coordinates of each of its elements by identifier."""
    model = ifcopenshell.open(str(folder / "model.ifc"))
    log = ifcopenshell.validate.json_logger()
    ifcopenshell.validate.validate(model, log, express_rules=True)
    require(not log.statements, f"ifcopenshell's validator finds {log.statements[:5]}")
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    found = []
    for element in model.by_type("IfcProduct"):
        if element.Representation and not element.is_a("IfcOpeningElement"):
            shape = ifcopenshell.geom.create_shape(settings, element)
            found.append((element.Name, np.array(shape.geometry.verts).reshape(-1, 3)))
    return model, found


def check_buildings(askew, aligned):
    _, wanted = bodies_of(askew)
    model, found = bodies_of(aligned)
    (conversion,) = model.by_type("IfcMapConversion")
    require(conversion.TargetCRS.Name == "map", f"the file is in {conversion.TargetCRS.Name}")
    cos, sin = conversion.XAxisAbscissa, conversion.XAxisOrdinate
    to_map = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    offset = np.array([conversion.Eastings, conversion.Northings, conversion.OrthogonalHeight])
    require(len(found) == len(wanted) > 10, f"{len(found)} bodies, {len(wanted)} before")
    for (name, vertices), (same, before) in zip(found, wanted, strict=True):
        require(name == same and vertices.shape == before.shape, f"{name} was {same}")
        # The kernel may order the corners of a body otherwise.
        gaps = np.linalg.norm((vertices @ to_map.T + offset)[:, None] - before[None], axis=2)
        require(max(gaps.min(0).max(), gaps.min(1).max()) < SAME_M, f"{name} lies elsewhere in map")
    return len(found)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path)
    parser.add_argument("work", type=Path)
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    straight, askew_poses = args.work / "straight.tum", args.work / "askew.tum"
    askew, aligned = args.work / "askew", args.work / "aligned"
    run("biplane", "traj", args.recording, "-o", straight, "--force")
    lay_askew(straight, askew_poses)
    build = ("biplane", "build", args.recording, "--poses", askew_poses, "-o", askew)
    run(*build, "--formats", "dxf,ifc", "--no-report", "--force")
    shutil.rmtree(aligned, ignore_errors=True)
    shutil.copytree(askew, aligned)
    export = ("biplane", "export", aligned, "--formats", "dxf,ifc", "--align-walls", "--force", "--json")
    turned_deg = json.loads(output_of(*export))["turned_deg"]
    require(abs(turned_deg + ASKEW_DEG) < 1, f"turned by {turned_deg:.3f} degrees, askew by {ASKEW_DEG}")

    before, after = walls_of(askew), walls_of(aligned)
    shares = share_along_axes(before), share_along_axes(after)
    require(shares[0] < 0.1 and shares[1] > 0.9, f"along the axes lay {shares[0]:.2f}, then {shares[1]:.2f}")
    cos, sin = math.cos(math.radians(turned_deg)), math.sin(math.radians(turned_deg))
    gap_m = np.abs(before @ np.array([[cos, -sin], [sin, cos]]).T - after).max()
    require(gap_m < SAME_M, f"lines of the drawing lie {gap_m:.4f} m elsewhere")
    bodies = check_buildings(askew, aligned)
    print(
        f"{aligned}: turned by {turned_deg:.3f} degrees, {100 * shares[1]:.0f} % of the walls' lines along x "
        f"and y (before: {100 * shares[0]:.0f} %), {bodies} bodies where they were in map"
    )


if __name__ == "__main__":
    main()
