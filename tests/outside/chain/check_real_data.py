#!/usr/bin/env python3
"""Runs real recordings through everything that they have data for.

    check_real_data.py DATA WORKDIR

The Intel Research Lab through import, replay, traj and map; a slice of it as telegrams through the mock laser
and `record`; ACES and MIT CSAIL through import, replay, map and optimize; a real building's mesh driven
through. DATA has `carmen/*.log`, `relations/intel.relations`, `relations/intel_pairs.txt` and
`models/institute.obj`; beside it stands `tools/relations_eval.py`, the relations metric (Kuemmerle et al.
2009) of another program. Needs the three programs on PATH, gltf-validator on NODE_PATH, and the packages of
requirements.txt beside the Python that runs it. Takes seven minutes."""

import re
import sys
import time
import xml.etree.ElementTree
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.mock_rig import MockRig, rig_text
from lib.programs import RIGS, WORLDS, fresh_folder, json_of, output_of, run, run_check
from lib.verdict import Tally, require

INTEL_S, INTEL_SCANS = 2691, 13631
LEAST_TIMES_REAL_TIME = 20
# Of all relations while driving: better than any incremental matcher that we know of (0.0295 m, 0.49 deg).
DRIVING_M, DRIVING_DEG = 0.029, 0.46
# With loops closed (docs/loops.md). What the stamps of this log allow is 0.0236 m and 0.41 deg. One run is
# chance: eight are between 0.0240 and 0.0248 m, and their median counts below.
CLOSED_M, CLOSED_DEG = 0.0250, 0.42
LEAST_LOOPS, MOST_MEMORY_BYTES = 300, 3e8
# The map of optimized poses has not more bits than that of the poses while driving.
MOST_ENTROPY = 1.003
# Three runs of each log. Of six, ACES had 79,789 to 84,438 bits (median 82,374), MIT CSAIL 97,373 to 98,350.
MAPS = {
    "aces": ("--optimized-median", 84_000, "--optimized-worst", 87_000),
    "mit_csail": ("--optimized-median", 98_500, "--optimized-worst", 99_500),
}
# docs/matching.md: medians 0.0247 and 0.0418 m; 0.1 m is a blunder.
ENSEMBLES = {
    "intel": ("--median", 0.026, "--worst", 0.1, "--optimized-median", 0.0243, "--optimized-worst", 0.025),
    "fr079": ("--median", 0.043, "--worst", 0.05, "--optimized-median", 0.042, "--optimized-worst", 0.042),
}
SLICE_SCANS, SLICE_S, LEAST_SLICE_SCANS = 150, 34, 100
# A slow line carries 180 degrees at 1 degree; the log has no vertical laser.
SLICE_LASER = ("baud = 38400", "mount = { x = 0.0, y = 0.0, z = 0.0, roll = 0.0, pitch = 0.0, yaw = 0.0 }")


class RealData:
    """The recordings, and a folder for what is made of them."""

    def __init__(self, data, work):
        self.data, self.work = data, work
        self.log = data / "carmen/intel.log"
        self.relations = data / "relations/intel.relations"
        self.tool = data.parent / "tools/relations_eval.py"
        self.run_file, self.track = work / "intel.run.mcap", work / "intel.txt"
        self.tally = Tally()

    def check_relations(self, recording, track, limit_m, limit_deg):
        """The relations error of a recording's poses, by another program."""
        run("biplane", "traj", recording, "--format", "xytheta", "-o", track)
        text = output_of(sys.executable, self.tool, self.relations, track)
        print(text, end="")
        track.with_suffix(".report").write_text(text)
        found = [re.search(rf"abs {kind}\S*\s+(\S+)", text) for kind in ("trans", "rot")]
        require(all(found), "the relations metric says no error")
        error_m, error_deg = (float(match.group(1)) for match in found)
        near = error_m < limit_m and error_deg < limit_deg
        require(near, f"relations error too large: {error_m} m, {error_deg} deg")

    def check_scans(self, recording, *topics):
        """As many messages of each topic as the log has scans."""
        expected = [word for topic in topics for word in ("--expect", f"{topic}={INTEL_SCANS}")]
        run_check("recording/check_recording.py", recording, *expected)

    def intel_while_driving(self):
        """All of Intel, incrementally."""
        imported = self.work / "intel.mcap"
        run("biplane", "import", "carmen", self.log, "-o", imported)
        start = time.monotonic()
        run("biplane-onboard", "replay", imported, "-o", self.run_file)
        took_s = time.monotonic() - start
        quick = took_s < INTEL_S / LEAST_TIMES_REAL_TIME
        require(
            quick,
            f"replay of Intel's {INTEL_S} s took {took_s:.1f} s: under {LEAST_TIMES_REAL_TIME} x real time",
        )
        self.tally.ok(f"intel.log replayed in {1000 * took_s:.0f} ms")
        self.check_scans(self.run_file, "/scan/horizontal", "/pose", "/odom")
        self.tally.ok(f"no scan of {INTEL_SCANS} lost")
        self.check_relations(self.run_file, self.track, DRIVING_M, DRIVING_DEG)
        self.tally.ok(f"relations error below {DRIVING_M} m and {DRIVING_DEG} deg")
        run_check("accuracy/check_evaluate.py", "relations", self.tool, self.track, self.relations)
        self.tally.ok("evaluate relations gives the figures of another program")

    def intel_with_loops_closed(self):
        closed = self.work / "intel.opt.mcap"
        account = json_of(
            "biplane", "--quiet", "optimize", self.run_file, "-o", closed, "--threads", 1, "--json"
        )
        self.check_relations(closed, self.work / "intel.opt.txt", CLOSED_M, CLOSED_DEG)
        require(account["loops"] > LEAST_LOOPS, f"only {account['loops']} loops")
        require(
            account["peak_memory_bytes"] < MOST_MEMORY_BYTES,
            f"{account['peak_memory_bytes']} bytes of memory",
        )
        self.check_scans(closed, "/scan/horizontal", "/pose", "/pose_incremental", "/odom")
        self.tally.ok(f"loops closed: relations error below {CLOSED_M} m and {CLOSED_DEG} deg")

    def basin(self):
        """One scan found in another alone."""
        pairs, table, told = (
            self.data / "relations/intel_pairs.txt",
            self.work / "basin.csv",
            self.work / "basin.json",
        )
        told.write_text(
            output_of("biplane-onboard", "basin", self.work / "intel.mcap", pairs, "-o", table, "--json")
        )
        run_check("accuracy/check_basin.py", told, table)
        self.tally.ok("one scan is found in one other from 10 cm and 30 degrees off")

    def figures(self):
        """The figures of docs/matching.md, its robustness, and the map."""
        work, errors = self.work, self.work / "errors.csv"
        run("biplane", "evaluate", "relations", self.relations, self.run_file, "--per-relation", errors)
        run("biplane", "plot", "basin", work / "basin.csv", "-o", work / "basin.svg")
        run("biplane", "plot", "relations", errors, "-o", work / "errors.svg")
        for name in ("basin.svg", "errors.svg"):
            xml.etree.ElementTree.parse(work / name)
        self.tally.ok("figures are well-formed")
        run_check(
            "accuracy/check_robustness.py", self.log, self.relations, work / "robustness.csv", "--short"
        )
        self.tally.ok(
            "relations error at most 0.05 m with scans left out, odometry scaled, stamps sorted "
            "and a parameter doubled"
        )
        run("biplane", "map", self.run_file, "-o", work / "intel")
        self.tally.ok("map of Intel")

    def ensembles(self):
        """Not one run but eight, each with another 1 % of the scans left out: no blunder in any."""
        for name, limits in ENSEMBLES.items():
            log, relations = self.data / f"carmen/{name}.log", self.data / f"relations/{name}.relations"
            run_check("accuracy/check_ensemble.py", log, relations, "--optimize", *limits)
        log, relations = self.data / "carmen/fr079.log", self.data / "relations/fr079.relations"
        for change in ("jumps", "stalled", "none"):
            limits = ("--runs", 2, "--worst", 0.06)
            run_check("accuracy/check_ensemble.py", log, relations, "--odometry", change, *limits)
        self.tally.ok("no blunder in eight runs of Intel and of Freiburg 079, nor with altered odometry")
        limits = ("--optimize", "--odometry", "carried", "--runs", 4, "--optimized-worst", 0.06)
        run_check("accuracy/check_ensemble.py", self.log, self.relations, *limits)
        self.tally.ok("a robot that is carried three times is found again in four runs of Intel")

    def other_log(self, name):
        work = self.work
        driven = work / f"{name}.run.mcap"
        run("biplane", "import", "carmen", self.data / f"carmen/{name}.log", "-o", work / f"{name}.mcap")
        run("biplane-onboard", "replay", work / f"{name}.mcap", "-o", driven)
        run("biplane", "map", driven, "-o", work / name)
        self.tally.ok(f"{name} through import, replay and map")
        log = self.data / f"carmen/{name}.log"
        limits = ("--optimized-share", MOST_ENTROPY, *MAPS[name])
        run_check("accuracy/check_ensemble.py", log, "--runs", 3, "--optimize", *limits)
        self.tally.ok(f"{name}: few bits of the map with loops closed, in copies of the log as well")

    def readme(self):
        given = (self.log, self.relations)
        run_check("chain/check_readme.py", self.work / "readme", "Your own recordings", *given)
        self.tally.ok("README's commands for other people's recordings")

    def slice_through_a_mock_laser(self):
        """The same real ranges as telegrams, served by a mock laser over a pseudo-terminal at real rate."""
        work = self.work
        log, imported, capture = work / "slice.log", work / "slice.mcap", work / "slice.capture.mcap"
        run_check("chain/make_log_slice.py", self.log, SLICE_SCANS, log)
        run("biplane", "import", "carmen", log, "-o", imported)
        run("biplane-mock", "encode", imported, "-o", capture)
        folder = work / "slice"
        rig = rig_text(folder / "ports", vertical=False, laser_lines=SLICE_LASER)
        recorded = folder / "run.mcap"
        with MockRig(folder, "--capture", capture, rig=rig) as devices:
            run(
                "biplane-onboard", "record", "--rig", devices.rig, "-o", recorded, "--duration", f"{SLICE_S}s"
            )
        run_check("recording/check_same_scans.py", imported, recorded, "--least", LEAST_SLICE_SCANS)
        self.tally.ok("real ranges over a pseudo-terminal arrive unchanged")

    def institute(self):
        """A real institute building: driven through, and as a drawing."""
        work, drawing = self.work, self.data / "models/institute.obj"
        capture, recording, truth = (
            work / "institute.capture.mcap",
            work / "institute.run.mcap",
            work / "institute.truth",
        )
        model, compared = work / "institute", work / "institute.compare.json"
        run(
            "biplane-mock",
            "simulate",
            "--world",
            drawing,
            "--path",
            WORLDS / "institute.toml",
            "--rig",
            RIGS / "fast.toml",
            "--seed",
            3,
            "-o",
            capture,
            "--truth",
            truth,
        )
        run("biplane-onboard", "replay", capture, "-o", recording)
        run("biplane", "build", recording, "-o", model)
        compared.write_text(
            output_of("biplane", "compare", model, "--truth", truth / "surfaces.ply", "--json")
        )
        run_check(
            "accuracy/check_figures.py",
            model,
            compared,
            "--least-reduction",
            97.5,
            "--largest-rms-m",
            0.03,
            "--most-blocked",
            0.5,
        )
        self.check_valid(model)
        run_check("accuracy/check_facing.py", model, "--most-away", 0.5)
        self.tally.ok("institute.obj driven, recorded, modeled; its doors stay open")
        run("biplane", "compact", drawing, "-o", work / "institute.compact")
        self.check_valid(work / "institute.compact")
        self.tally.ok("institute.obj as a drawing: every polygon valid")

    def check_valid(self, model):
        run_check("formats/check_gltf.js", model / "model.glb")
        run_check("formats/check_cityjson.py", model / "model.city.json")


def main():
    require(len(sys.argv) == 3, __doc__)
    checks = RealData(Path(sys.argv[1]).resolve(), fresh_folder(sys.argv[2]))
    checks.intel_while_driving()
    checks.intel_with_loops_closed()
    checks.basin()
    checks.figures()
    checks.ensembles()
    checks.other_log("aces")
    checks.other_log("mit_csail")
    checks.readme()
    checks.slice_through_a_mock_laser()
    checks.institute()
    checks.tally.end()


main()
