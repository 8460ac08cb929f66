#!/usr/bin/env python3
"""How long planes take: points a second, peak memory and growth, beside another library if wanted.

    measure_planes_speed.py BIPLANE POINTS.ply [--sizes 100000 1000000 10000000] [--threads 1 2] [--flat]
                            [--open3d] [--most-s S] [--most-mb MB] [--most-growth X]

POINTS.ply is what `biplane build` wrote of a recording, for example one of `biplane-mock simulate`. It is
repeated side by side, or cut after a scan, to the sizes asked for. With --flat the points lose their scans.
Prints a table in Markdown: seconds of the extraction alone and of the whole process (reading, and writing 20
bytes a point, included), and the process's peak memory; then how processor time grows: the exponent of the
points between the smallest and the largest cloud. With --open3d (needs the package open3d) also what its
`detect_planar_patches` takes for the same points on one thread, up to a million of them: its normals, which
it needs, stand apart. Exit code 1 when a whole process takes longer than S seconds or more memory than MB, or
the exponent is more than X. Needs numpy."""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import np, ply
from lib.programs import peak_memory_mb
from lib.verdict import fail, require

LARGEST_FOR_OPEN3D = 1_000_000


def sized(points, size, flat):
    """The points repeated side by side until there are `size`."""
    names = ["x", "y", "z"] + (
        [] if flat else [name for name in ("scan", "beam") if name in points.dtype.names]
    )
    out = np.empty(size, [(name, "<f4" if name in "xyz" else "<i4") for name in names])
    width = float(np.ceil(points["x"].max() - points["x"].min())) + 2.0
    scans = int(points["scan"].max()) + 1 if "scan" in names else 0
    for copy, start in enumerate(range(0, size, len(points))):
        part = points[: min(len(points), size - start)]
        for name in names:
            out[name][start : start + len(part)] = part[name]
        out["x"][start : start + len(part)] += copy * width
        if scans:
            out["scan"][start : start + len(part)] += copy * scans
    return out


def run(biplane, cloud, out, threads):
    """What planes.json says, and the whole process's processor time, wall time and peak memory."""
    start, peak_mb = time.monotonic(), 0.0
    words = [biplane, "planes", cloud, "-o", out, "--threads", str(threads), "--force"]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    while not (done := os.wait4(process.pid, os.WNOHANG))[0]:
        peak_mb = max(peak_mb, peak_memory_mb(process.pid))
        time.sleep(0.005)
    process.returncode = os.waitstatus_to_exitcode(done[1])
    require(process.returncode == 0, f"{biplane} planes {cloud}: exit code {process.returncode}")
    told = json.loads((Path(out) / "planes.json").read_text())
    return told, done[2].ru_utime + done[2].ru_stime, time.monotonic() - start, peak_mb


PEER = """
import json, sys, time
import numpy, open3d
points = open3d.utility.Vector3dVector(numpy.load(sys.argv[1]))
cloud = open3d.geometry.PointCloud(points)
near = open3d.geometry.KDTreeSearchParamKNN(knn=30)
start = time.process_time()
cloud.estimate_normals(near)
between = time.process_time()
found = cloud.detect_planar_patches(
    normal_variance_threshold_deg=60, coplanarity_deg=75, outlier_ratio=0.75, min_plane_edge_length=0,
    min_num_points=0, search_param=near,
)
print(json.dumps([between - start, time.process_time() - between, len(found)]))
"""


def run_open3d(points, scratch):
    """Processor time of Open3D's normals and of its planes, and how many planes."""
    path = f"{scratch}/points.npy"
    np.save(path, np.stack([points[axis].astype(float) for axis in "xyz"], axis=1))
    one_thread = {**os.environ, "OMP_NUM_THREADS": "1"}
    return json.loads(subprocess.check_output([sys.executable, "-c", PEER, path], env=one_thread))


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("biplane")
    parser.add_argument("points")
    parser.add_argument("--sizes", type=int, nargs="+", default=[100_000, 1_000_000, 10_000_000])
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--flat", action="store_true")
    parser.add_argument("--open3d", action="store_true")
    parser.add_argument("--most-s", type=float, default=math.inf)
    parser.add_argument("--most-mb", type=float, default=math.inf)
    parser.add_argument("--most-growth", type=float, default=math.inf)
    return parser.parse_args()


def row(*cells):
    print("| " + " | ".join(map(str, cells)) + " |", flush=True)


def head(*cells):
    row(*cells)
    print("|---" * len(cells) + "|")


class Measured:
    """Processor seconds by size and threads, what another library took, and what was too slow or too
    large."""

    def __init__(self, args):
        self.args = args
        self.taken, self.peers, self.slow = {}, [], []

    def size(self, points, size, scratch):
        args, cloud, labels = self.args, f"{scratch}/cloud.ply", set()
        part = sized(points, size, args.flat)
        ply.write_points(cloud, part)
        for threads in args.threads:
            told, cpu_s, wall_s, peak_mb = run(args.biplane, cloud, f"{scratch}/out", threads)
            labels.add((Path(scratch) / "out/labels.bin").read_bytes())
            alone_s = self.taken[size, threads] = told["cpu_s"]
            row(
                f"{size:,}",
                threads,
                f"{alone_s:.2f}",
                f"{told['wall_s']:.2f}",
                f"{size / max(alone_s, 1e-9):,.0f}",
                f"{cpu_s:.2f}",
                f"{wall_s:.2f}",
                f"{peak_mb:.0f}",
                len(told["planes"]),
            )
            if wall_s > args.most_s or peak_mb > args.most_mb:
                self.slow.append(f"{size} points: {wall_s:.1f} s, {peak_mb:.0f} MB")
        require(len(labels) == 1, "labels differ with the number of threads")
        if args.open3d and size <= LARGEST_FOR_OPEN3D:
            normals_s, planes_s, count = run_open3d(part, scratch)
            ours_s = self.taken[size, args.threads[0]]
            ratios = f"{planes_s / ours_s:.1f}", f"{(normals_s + planes_s) / ours_s:.1f}"
            self.peers.append((f"{size:,}", f"{normals_s:.2f}", f"{planes_s:.2f}", count, *ratios))

    def growth(self, threads):
        """How processor time grows with the points."""
        small, large = min(self.args.sizes), max(self.args.sizes)
        exponent = math.log(self.taken[large, threads] / self.taken[small, threads]) / math.log(large / small)
        plural = "s" * (threads > 1)
        print(
            f"\n{threads} thread{plural}: processor time grows with the points to the power of {exponent:.2f}"
        )
        if exponent > self.args.most_growth:
            self.slow.append(f"grows with the power of {exponent:.2f}")


def main():
    args = arguments()
    points = ply.vertices(args.points)
    measured = Measured(args)
    head(
        "points",
        "threads",
        "CPU, s",
        "wall, s",
        "points / CPU s",
        "whole process: CPU, s",
        "wall, s",
        "peak, MB",
        "planes",
    )
    with tempfile.TemporaryDirectory() as scratch:
        for size in args.sizes:
            measured.size(points, size, scratch)
    for threads in args.threads if len(args.sizes) > 1 else []:
        measured.growth(threads)
    if measured.peers:
        print()
        head(
            "points",
            "Open3D: normals, s",
            "planes, s",
            "planes found",
            "planes / ours",
            "with normals / ours",
        )
        for peer in measured.peers:
            row(*peer)
    if measured.slow:
        fail("too slow or too large: " + "; ".join(measured.slow))


main()
