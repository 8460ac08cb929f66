#!/usr/bin/env python3
"""Runs the whole chain as a newcomer does, and has its results judged by other people's readers.

    check_chain.py WORKDIR

Needs `biplane`, `biplane-onboard` and `biplane-mock` on PATH, gltf-validator on NODE_PATH, and the packages
of requirements.txt beside the Python that runs it. Takes seven minutes."""

import filecmp
import json
import shutil
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import RIGS, fresh_folder, output_of, run, run_check, simulate
from lib.verdict import Tally, require

DEMO_WITHIN_S = 180


class Chain:
    """One folder of drives and what is made of them."""

    def __init__(self, work):
        self.work = work
        self.tally = Tally()

    def demo(self):
        """Serial bytes in, model out, in under three minutes; its recording and its exports open
        elsewhere."""
        demo = self.work / "demo"
        start = time.monotonic()
        run("biplane", "demo", "-o", demo)
        took_s = int(time.monotonic() - start)
        require(took_s < DEMO_WITHIN_S, f"the demo took {took_s} s")
        self.tally.ok(f"demo in {took_s} s")
        run_check(
            "accuracy/check_figures.py",
            demo / "model",
            demo / "compare.json",
            "--least-reduction",
            97.5,
            "--largest-rms-m",
            0.012,
            "--most-polygons-a-face",
            2,
            "--least-gain",
            3,
            "--most-blocked",
            0.5,
        )
        self.tally.ok("figures of the demo")
        run_check("recording/check_recording.py", demo / "run.mcap")
        self.tally.ok("recording opens in rosbags and mcap-ros2-support")
        self.check_valid(demo / "model")
        self.tally.ok(
            "the demo's model.glb passes the glTF validator; cjio reads model.city.json, "
            "every polygon is valid for GEOS"
        )

    def check_valid(self, model):
        run_check("formats/check_gltf.js", model / "model.glb")
        run_check("formats/check_cityjson.py", model / "model.city.json")

    def drive(self, world, rig):
        """A drive as bytes, replayed, modeled; the recording opens elsewhere too."""
        work = self.work
        capture, truth = work / f"{world}.capture.mcap", work / f"{world}.truth"
        simulate(world, capture, truth, RIGS / f"{rig}.toml", 7)
        run("biplane-onboard", "replay", capture, "-o", work / f"{world}.run.mcap")
        run_check("recording/check_recording.py", work / f"{world}.run.mcap")
        run("biplane", "build", work / f"{world}.run.mcap", "-o", work / f"{world}.model", "--formats", "all")
        self.tally.ok(f"{world}: simulated, replayed, read by others, modeled")

    def check_exports(self, model, least_doors, *words):
        model = self.work / model
        for level in ("lod1", "lod2"):
            run_check("formats/check_gltf.js", model / f"model.{level}.glb")
        run_check("formats/check_dxf.py", model, "--least-doors", least_doors)
        # A mesh has no drive, and so no rooms.
        building = model / "building.json"
        if building.exists() and json.loads(building.read_text())["rooms"]:
            run_check("formats/check_building.py", model, "--doors", least_doors)
        else:
            run_check("formats/check_ifc.py", model, "--least-doors", least_doors)
        run_check("formats/check_las.py", model, *words)
        run("biplane", "export", model, "--formats", "mcap")
        run_check("formats/check_viewer_file.py", model)
        self.tally.ok(f"{model}: plan, storeys and points open elsewhere, as many as there should be")

    def judge(self, world, model, *targets):
        """A model against its world's truth."""
        model, truth = self.work / model, self.work / f"{world}.truth/surfaces.ply"
        compared = model.with_name(f"{model.name}.compare.json")
        compared.write_text(output_of("biplane", "compare", model, "--truth", truth, "--json"))
        run_check("accuracy/check_figures.py", model, compared, *targets)
        self.check_valid(model)
        run_check("accuracy/check_facing.py", model, "--most-away", 0.5)
        self.tally.ok(f"{model}: as small and as true as it should be, valid, faces the laser")

    def borders(self, world, *bounds):
        """Are borders straight, and openings rectangles?"""
        run_check("chain/check_borders.py", self.work / f"{world}.model", *bounds)
        self.tally.ok(f"{world}: borders without spikes and combs")

    def worlds(self):
        """The paper's experiments among them: its corridor, and a building from outside over ground that
        shakes the robot by 0.15 degrees."""
        self.drive("corridor", "paper")
        self.check_exports("corridor.model", 6)
        self.judge(
            "corridor",
            "corridor.model",
            "--least-reduction",
            99,
            "--largest-rms-m",
            0.010,
            "--most-polygons-a-face",
            2,
            "--least-gain",
            3,
            "--most-blocked",
            0.5,
        )
        self.borders(
            "corridor", "--spikes", 4, "--ratio", 1.02, "--small", 5, "--corners", 2, "--openings", 80
        )
        self.drive("office", "paper")
        self.check_exports("office.model", 12)
        run_check("chain/check_aligned.py", self.work / "office.run.mcap", self.work / "office.aligned")
        self.tally.ok("office: walls of a model that lies askew come along x and y")
        self.judge(
            "office",
            "office.model",
            "--least-reduction",
            97.5,
            "--largest-rms-m",
            0.02,
            "--most-blocked",
            0.5,
        )
        self.borders("office", "--spikes", 4, "--ratio", 1.02, "--small", 5, "--corners", 2)
        self.drive("building", "outdoor")
        self.check_exports("building.model", 0)
        self.judge(
            "building",
            "building.model",
            "--least-reduction",
            93,
            "--largest-rms-m",
            0.02,
            "--most-blocked",
            1,
        )
        self.borders(
            "building", "--spikes", 8, "--ratio", 1.02, "--small", 15, "--corners", 50, "--holes", 90
        )
        truth = self.work / "building.truth/surfaces.ply"
        shares = ("--least", 75, "--least-ifc", 80)
        run_check("worlds/check_facade.py", self.work / "building.model", "--truth", truth, *shares)
        self.tally.ok("building: windows of the facades are holes, and IfcWindows")
        run(
            "biplane",
            "build",
            self.work / "building.run.mcap",
            "--poses",
            self.work / "building.truth/poses.tum",
            "-o",
            self.work / "building.true",
        )
        self.judge(
            "building",
            "building.true",
            "--least-reduction",
            93,
            "--largest-rms-m",
            0.016,
            "--most-blocked",
            1,
        )

    def meshes(self):
        """The meshes of these drives, and a drawn one, as somebody else's."""
        work = self.work
        for world in ("corridor", "office", "building"):
            run("biplane", "compact", work / f"{world}.model/raw.ply", "-o", work / f"{world}.compact")
            self.check_valid(work / f"{world}.compact")
        drawn = work / "drawn.compact"
        run("biplane", "compact", work / "corridor.truth/surfaces.ply", "-o", drawn, "--formats", "all")
        self.check_valid(drawn)
        self.check_exports("drawn.compact", 1, "--timeless")
        self.tally.ok("compact: every polygon valid, every model.glb passes")

    def office_again(self):
        """The same bytes replayed again, its points in their millions, its poses against the truth."""
        work, office = self.work, self.work / "office.run.mcap"
        run("biplane-onboard", "replay", work / "office.capture.mcap", "-o", work / "again.run.mcap")
        same = filecmp.cmp(office, work / "again.run.mcap", shallow=False)
        require(same, "two replays of the same bytes give different recordings")
        self.tally.ok("two replays of the same bytes give the same bytes")
        # docs/planes.md: ten million points of such a drive.
        run_check(
            "timing/measure_planes_speed.py",
            shutil.which("biplane"),
            work / "office.model/points.ply",
            "--flat",
            "--sizes",
            100_000,
            10_000_000,
            "--threads",
            2,
            "--most-s",
            60,
            "--most-mb",
            4000,
            "--most-growth",
            1.2,
        )
        self.tally.ok("ten million points in a minute and 4 GB")
        run("biplane", "traj", office, "-o", work / "office.tum")
        run_check(
            "accuracy/check_evaluate.py", "trajectory", work / "office.tum", work / "office.truth/poses.tum"
        )
        self.tally.ok("pose errors are those that evo computes")

    def calibration(self):
        """docs/calibration.md: a vertical laser that sits elsewhere than its rig says, found from a drive."""
        run_check("accuracy/check_calibration.py", self.work / "calibration")
        self.tally.ok(
            "calibrate finds the vertical laser's place and delay, and says what the drive does not tell"
        )


def main():
    require(len(sys.argv) == 2, __doc__)
    chain = Chain(fresh_folder(sys.argv[1]))
    chain.demo()
    chain.worlds()
    chain.meshes()
    chain.office_again()
    chain.calibration()
    chain.tally.end()


main()
