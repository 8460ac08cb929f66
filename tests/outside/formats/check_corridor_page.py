#!/usr/bin/env python3
"""Opens report.html and tileset.json of the paper's corridor in a browser, and the reports of other builds
that are named and there.

    check_corridor_page.py WORKDIR [REPORT.html...]

Needs `biplane`, `biplane-onboard` and `biplane-mock` on PATH, playwright-core, gltf-validator, three and
3d-tiles-renderer on NODE_PATH, and Chromium."""

import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import RIGS, fresh_folder, run, run_check, simulate
from lib.verdict import require


def main(work, reports):
    capture, recording, model = work / "capture.mcap", work / "corridor.mcap", work / "model"
    simulate("corridor", capture, work / "truth", RIGS / "paper.toml", 7)
    run("biplane-onboard", "replay", capture, "-o", recording)
    run("biplane", "build", recording, "-o", model)
    run(
        "biplane",
        "compare",
        model,
        "--truth",
        work / "truth/surfaces.ply",
        "--report",
        model / "report.html",
        "--force",
        stdout=subprocess.DEVNULL,
    )
    run_check("formats/check_page.js", model / "report.html", work / "pictures")
    run("biplane", "--quiet", "export", model, "--formats", "3dtiles,glb", "--force")
    run_check("formats/check_tileset.js", model)
    for report in filter(Path.is_file, reports):
        run_check("formats/check_page.js", report)


require(len(sys.argv) > 1, __doc__)
main(fresh_folder(sys.argv[1]), [Path(name) for name in sys.argv[2:]])
