#!/usr/bin/env python3
"""Reads a model's DXF with ezdxf and audits it: no error, nothing to repair; what is in it agrees with the
model's other files.

    check_dxf.py MODEL_FOLDER [--least-doors N] [--no-plan]

Needs ezdxf."""

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

import ezdxf

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.verdict import require


def check_audit(drawing):
    audit = drawing.audit()
    found = [str(entry.message) for entry in [*audit.errors, *audit.fixes]]
    require(not found, f"ezdxf finds {found[:5]}")
    require(drawing.header["$INSUNITS"] == 6, "the drawing is not in meters")


def check_faces(entities, summary):
    """As many faces as the model has; returns their number."""
    leftovers = entities["3DFACE", "LEFTOVERS"]
    faces = entities["3DFACE", "SURFACES"] + entities["3DFACE", "INFERRED"] + leftovers
    told = summary["model_triangles"], summary["leftover_triangles"]
    require((faces, leftovers) == told, f"{faces} faces, {leftovers} of leftovers; summary.json has {told}")
    return faces


def check_names(path, space):
    """Each thing of `building.json` that the plan shows has its name in it."""
    if path.exists():
        building = json.loads(path.read_text())
        texts = {text.dxf.text for text in space.query("TEXT")}
        missing = {one["id"] for key in ("rooms", "openings") for one in building[key]} - texts
        require(not missing, f"names that the plan lacks: {sorted(missing)}")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--least-doors", type=int, default=0)
    parser.add_argument("--no-plan", action="store_true")
    args = parser.parse_args()
    drawing = ezdxf.readfile(args.folder / "model.dxf")
    check_audit(drawing)
    space = drawing.modelspace()
    entities = Counter((e.dxftype(), e.dxf.layer.rsplit("-", 1)[-1]) for e in space)
    faces = check_faces(entities, json.loads((args.folder / "summary.json").read_text()))

    sizes = [t.dxf.text for t in space.query("TEXT") if t.dxf.text[0].isdigit()]
    windows = sum(t.dxf.text.startswith("sill") for t in space.query("TEXT"))
    walls, doors = entities["LINE", "WALLS"], len(sizes) - windows
    length_m = sum(e.dxf.start.distance(e.dxf.end) for e in space.query('LINE[layer ? ".*WALLS"]'))
    if args.no_plan:
        require(walls == 0 and drawing.layers.get("SURFACES").is_on(), "there is a plan without a floor")
    else:
        require(walls > 3 and length_m > 5, f"the plan has {walls} walls of {length_m:.1f} m")
        check_names(args.folder / "building.json", space)
        require(doors >= args.least_doors, f"the plan has {doors} doors, wanted {args.least_doors}: {sizes}")
    print(
        f"{args.folder}/model.dxf: no errors, {walls} walls of {length_m:.1f} m, {doors} doors and passages, "
        f"{windows} windows, {faces} faces"
    )


main()
