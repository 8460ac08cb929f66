#!/usr/bin/env python3
"""A model in tiles on a real Slurm: two nodes of one machine, of which one is killed in the middle.

    check_cluster.py WORKDIR       with our programs on PATH, as root, with Debian's slurm-wlm and munge

First drives of which all is one tile: what `tiles merge` writes must be what `biplane build` writes, rooms,
round things and every format. Then the script of `biplane tiles script` is submitted as it is printed. One
node is killed while a tile runs on it; the other finishes all tiles and the model, whose bytes must be those
of the same tiles run one after the other here. Then a tile is taken away: the merge must refuse, and sbatch
with the words that it prints must make it whole again."""

import json
import shutil
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import fresh_folder, outcome_of, output_of, run, simulate
from lib.slurm import Cluster
from lib.verdict import require

TIMED = {"summary.json", "report.html"}


def record(work, world="office", recording="run.mcap"):
    simulate(world, "bytes.mcap", "truth", cwd=work)
    run("biplane-onboard", "replay", "bytes.mcap", "-o", recording, cwd=work)
    for name in ("bytes.mcap", "truth"):
        path = work / name
        shutil.rmtree(path) if path.is_dir() else path.unlink()


def one_tile(work, world, least):
    """In one tile a drive becomes what it becomes without tiles, of which there is at least so much."""
    recording, whole, tiles, merged = (f"{world}.{part}" for part in ("mcap", "whole", "tiles", "merged"))
    record(work, world, recording)
    words = ["--formats", "all", "--no-report"]
    run("biplane", "--quiet", "build", recording, "-o", whole, *words, cwd=work)
    count = output_of("biplane", "--quiet", "tiles", "plan", recording, "-o", tiles, cwd=work)
    require(count.split() in (["1", "tile"], ["1", "tiles"]), count)
    run("biplane", "--quiet", "tiles", "run", tiles, "--index", 0, cwd=work)
    run("biplane", "--quiet", "tiles", "merge", tiles, "-o", merged, *words, cwd=work)
    compare(work / whole, work / merged)
    for (name, key), number in least.items():
        found = len(json.loads((work / merged / name).read_text())[key])
        require(found >= number, f"{world}: {found} {key}")
    for name in (whole, tiles, merged):
        shutil.rmtree(work / name)


def plan(work, folder):
    """How many tiles there are."""
    words = ["--size", 6, "--no-optimize"]
    return int(output_of("biplane", "tiles", "plan", "run.mcap", "-o", folder, *words, cwd=work).split()[0])


def files(model):
    found = (path for path in model.rglob("*") if path.is_file() and path.name not in TIMED)
    return {str(path.relative_to(model)): path.read_bytes() for path in found}


def one_after_the_other(work):
    count = plan(work, "here")
    for index in reversed(range(count)):
        run("biplane", "tiles", "run", "here", "--index", index, cwd=work)
    run("biplane", "tiles", "merge", "here", "-o", "here.model", cwd=work)
    return count


def on_cluster(work, count):
    require(plan(work, "there") == count, "another number of tiles")
    script = work / "tiles.sh"
    script.write_text(output_of("biplane", "tiles", "script", "there", cwd=work))
    with Cluster(work / "slurm", ["n1", "n2"]) as cluster:
        began = time.monotonic()
        require("Submitted batch job" in cluster.said("sbatch", str(script)), "sbatch refused the script")
        cluster.wait(lambda: "n2" in cluster.said("squeue", "-h", "-t", "running", "-o", "%N"), 30)
        cluster.kill("n2")
        model = work / "there" / "model"
        cluster.wait((model / "summary.json").exists, 90)
        print(f"{count} tiles on two nodes, one killed: model after {time.monotonic() - began:.0f} s")
        compare(work / "here.model", model)
        again(work, cluster, script)


def compare(one, other):
    one, other = files(one), files(other)
    require(one.keys() == other.keys(), f"{one.keys() ^ other.keys()}")
    different = [name for name in one if one[name] != other[name]]
    require(not different, f"other bytes: {different}")
    print(f"{len(one)} files have the same bytes")


def again(work, cluster, script):
    (work / "there" / "tiles" / "00001.found").unlink()
    merge = ["biplane", "--quiet", "tiles", "merge", "there", "-o", "other.model"]
    code, said = outcome_of(*merge, cwd=work)
    words = said.split()[0]
    require((code, words) == (1, "--array=1"), said)
    cluster.said("sbatch", words, "--export=ALL,BIPLANE_MERGE=no", str(script))
    cluster.wait((work / "there" / "tiles" / "00001.found").exists, 40)
    run(*merge, cwd=work)
    compare(work / "here.model", work / "other.model")


def main(work):
    one_tile(work, "office", {("building.json", "rooms"): 1, ("building.json", "walls"): 1})
    one_tile(work, "hall", {("shapes.json", "cylinders"): 1})
    record(work)
    on_cluster(work, one_after_the_other(work))


require(len(sys.argv) == 2, __doc__)
main(fresh_folder(sys.argv[1]))
