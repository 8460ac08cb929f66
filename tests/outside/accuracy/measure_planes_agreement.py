#!/usr/bin/env python3
"""How far the fast search for planes agrees with the paper's own, and on what they do not.

    measure_planes_agreement.py BIPLANE POINTS.ply [POINTS.ply ...] [--points 80000] [--seed 0]

Each POINTS.ply is what `biplane build` wrote of a recording, or any other point cloud as a binary PLY. Of
larger clouds a stretch from the middle is taken: the paper's search takes minutes for a hundred thousand
points. It runs with its own limits, and with an epsilon that follows the noise: (1.15 sigma)^2, sigma as the
fast search found it. Prints a table in Markdown. Planes of the two belong together pair by pair, largest
common part first, as in `biplane planes --against`. The fast search joins what lies in one plane beyond gaps,
which the paper's does not: so it is also compared with its planes cut where gaps are wider than delta. Where
points disagree, the table says how: they are on no plane there or here; the plane is in several pieces there
or here; or they are near a border. Needs numpy."""

import argparse
import json
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib import np, ply
from lib.programs import run

COLUMNS = (
    "cloud",
    "points",
    "noise, cm",
    "epsilon, cm2",
    "planes here, there",
    "agreed, planes cut at gaps, %",
    "agreed, %",
    "free there",
    "free here",
    "split there",
    "split here",
    "border",
)


def write(path, points):
    names = [name for name in ("x", "y", "z", "scan", "beam") if name in points.dtype.names]
    out = np.empty(len(points), [(name, "<f4" if name in "xyz" else "<i4") for name in names])
    for name in names:
        out[name] = points[name]
    ply.write_points(path, out)


def search(biplane, cloud, out, *words):
    run(biplane, "planes", cloud, "-o", out, "--force", *words, capture_output=True)
    return np.fromfile(out / "labels.bin", "<i4"), json.loads((out / "planes.json").read_text())


def cut_at_gaps(points, labels, delta_m=0.3):
    """The labels with every plane in as many pieces as it has beyond gaps: cells of half a delta that touch
    hang together."""
    cells = np.floor(np.stack([points[name] for name in "xyz"], 1) / (0.5 * delta_m)).astype(np.int64)
    around = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)]
    out, pieces = np.full(len(labels), -1), 0
    for label in np.unique(labels[labels >= 0]):
        members = np.flatnonzero(labels == label)
        of_cell, which = np.unique(cells[members], axis=0, return_inverse=True)
        number = {tuple(cell): k for k, cell in enumerate(of_cell)}
        piece = np.full(len(of_cell), -1)
        for start in range(len(of_cell)):
            open_cells = [start] if piece[start] < 0 else []
            pieces += len(open_cells)
            piece[open_cells] = pieces
            while open_cells:
                x, y, z = of_cell[open_cells.pop()]
                near = [number.get((x + i, y + j, z + k), -1) for i, j, k in around]
                fresh = [k for k in near if k >= 0 and piece[k] < 0]
                piece[fresh] = pieces
                open_cells += fresh
        out[members] = piece[which.ravel()]
    return out


def largest_parts(labels, others):
    """For each plane of the one search, the plane of the other that has most of its points; -1 for none."""
    parts = {}
    for label in np.unique(labels[labels >= 0]):
        within = others[(labels == label) & (others >= 0)]
        parts[label] = np.bincount(within).argmax() if len(within) else -1
    return parts


def compare(ours, theirs):
    """Shares of the points in percent: agreed, and the kinds of disagreement."""
    pairs, counts = np.unique(np.stack([ours, theirs], 1), axis=0, return_counts=True)
    of_ours, of_theirs = {}, {}
    for order in np.argsort(-counts, kind="stable"):
        a, b = pairs[order]
        if a >= 0 and b >= 0 and a not in of_ours and b not in of_theirs:
            of_ours[a], of_theirs[b] = b, a
    within_theirs, within_ours = largest_parts(ours, theirs), largest_parts(theirs, ours)
    kinds = dict.fromkeys(["agreed", "free there", "free here", "split there", "split here", "border"], 0)
    for (a, b), count in zip(pairs, counts):
        if (a < 0 and b < 0) or (a >= 0 and of_ours.get(a) == b):
            kind = "agreed"
        elif b < 0:
            kind = "free there"
        elif a < 0:
            kind = "free here"
        elif within_ours[b] == a:
            kind = "split there"
        elif within_theirs[a] == b:
            kind = "split here"
        else:
            kind = "border"
        kinds[kind] += count
    return {kind: 100 * count / len(ours) for kind, count in kinds.items()}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("biplane")
    parser.add_argument("points", nargs="+")
    parser.add_argument("--points", dest="most", type=int, default=80_000)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    print(f"| {' | '.join(COLUMNS)} |\n{'|---' * len(COLUMNS)}|")
    for path in map(Path, args.points):
        points = ply.vertices(path)
        start = max(0, (len(points) - args.most) // 2)
        points = points[start : start + args.most]
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            write(folder / "cloud.ply", points)
            ours, told = search(args.biplane, folder / "cloud.ply", folder / "fast")
            sigma_m = told["sigma_m"]
            for epsilon_m2 in (2.8e-4, (1.15 * sigma_m) ** 2):
                words = ["--method", "paper", "--seed", str(args.seed), "--epsilon", f"{epsilon_m2:.7f}"]
                theirs, _ = search(args.biplane, folder / "cloud.ply", folder / "paper", *words)
                kinds = {
                    "pieces": compare(cut_at_gaps(points, ours), theirs)["agreed"],
                    **compare(ours, theirs),
                }
                name = path.parent.name if path.stem == "points" else path.stem
                planes = f"{ours.max() + 1}, {theirs.max() + 1}"
                cells = [name, len(points), f"{100 * sigma_m:.1f}", f"{1e4 * epsilon_m2:.1f}", planes]
                cells += [f"{share:.1f}" for share in kinds.values()]
                print("| " + " | ".join(map(str, cells)) + " |", flush=True)


if __name__ == "__main__":
    main()
