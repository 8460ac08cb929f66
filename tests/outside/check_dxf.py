#!/usr/bin/env python3
"""A model's DXF read by ezdxf and audited: no error, nothing to repair; what is in it against the model's other files.

  check_dxf.py MODEL_FOLDER [--least-doors N] [--no-plan]
"""
import argparse
import json
import pathlib
from collections import Counter

import ezdxf

parser = argparse.ArgumentParser()
parser.add_argument("folder", type=pathlib.Path)
parser.add_argument("--least-doors", type=int, default=0)
parser.add_argument("--no-plan", action="store_true")
args = parser.parse_args()

drawing = ezdxf.readfile(args.folder / "model.dxf")
audit = drawing.audit()
found = [str(entry.message) for entry in [*audit.errors, *audit.fixes]]
assert not found, found[:5]
assert drawing.header["$INSUNITS"] == 6, "not in metres"
entities = Counter((e.dxftype(), e.dxf.layer.rsplit("-", 1)[-1]) for e in drawing.modelspace())
summary = json.loads((args.folder / "summary.json").read_text())
faces = entities["3DFACE", "SURFACES"] + entities["3DFACE", "LEFTOVERS"]
assert faces == summary["model_triangles"], (faces, summary["model_triangles"])
assert entities["3DFACE", "LEFTOVERS"] == summary["leftover_triangles"]

sizes = [t.dxf.text for t in drawing.modelspace().query("TEXT") if t.dxf.text[0].isdigit()]
windows = sum(t.dxf.text.startswith("sill") for t in drawing.modelspace().query("TEXT"))
walls = entities["LINE", "WALLS"]
length_m = sum(e.dxf.start.distance(e.dxf.end) for e in drawing.modelspace().query('LINE[layer ? ".*WALLS"]'))
if args.no_plan:
    assert walls == 0 and drawing.layers.get("SURFACES").is_on(), "a plan without a floor"
else:
    assert walls > 3 and length_m > 5, (walls, length_m)
    assert len(sizes) - windows >= args.least_doors, sizes
print(f"{args.folder}/model.dxf: no errors, {walls} walls of {length_m:.1f} m, {len(sizes) - windows} doors and passages, "
      f"{windows} windows, {faces} faces")
