#!/usr/bin/env python3
"""Holds `biplane evaluate` against other people's programs: the same figures.

    check_evaluate.py trajectory ESTIMATE.tum TRUTH.tum
    check_evaluate.py relations TOOL.py TRAJ.txt RELATIONS

The first by evo: ATE with and without alignment, RPE over frames and meters. The second by a metricEvaluator
in Python, also with every 4th pose only: TOOL.py has functions `load_rel`, `load_traj`, `evaluate` and
`stats`. Needs evo for the first, `biplane` on PATH for both."""

import importlib.util
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from lib.programs import json_of
from lib.verdict import require

SAME_AS_EVO, SAME_AS_TOOL = 1e-6, 1e-9
# Between poses the tool rounds stamps to doubles (some 100 ns), which shows once it interpolates.
SAME_BETWEEN_POSES = 1e-7


def evaluated(*words):
    return json_of("biplane", "evaluate", *words, "--json")


def compare(name, ours, theirs, tolerance):
    """Figures by name: each within the tolerance, in proportion where they are large."""
    require(theirs, f"{name}: there is nothing to compare with")
    for key, value in theirs.items():
        near = abs(ours[key] - value) <= tolerance * max(1.0, abs(value))
        require(near, f"{name}: {key} is {ours[key]}, by another program {value}")
    print(f"ok: {name}: " + ", ".join(f"{key} {ours[key]:.6f}" for key in theirs))


def check_trajectory(estimate, truth):
    from evo.core import metrics, sync
    from evo.tools import file_interface

    relation = metrics.PoseRelation
    kinds = {"translation_m": relation.translation_part, "rotation_deg": relation.rotation_angle_deg}
    keys = ("rmse", "mean", "median", "std", "min", "max")

    def theirs(metric, align):
        read = file_interface.read_tum_trajectory_file
        pair = sync.associate_trajectories(read(truth), read(estimate), max_diff=0.01)
        if align:
            pair[1].align(pair[0])
        metric.process_data(pair)
        figures = metric.get_all_statistics()
        return {key: float(figures[key]) for key in keys}

    for align, words in ((True, []), (False, ["--no-align"])):
        ours = evaluated("trajectory", truth, estimate, *words)["absolute"]
        for kind, relation in kinds.items():
            name = f"ATE {kind}, {'aligned' if align else 'as it is'}"
            compare(name, ours[kind], theirs(metrics.APE(relation), align), SAME_AS_EVO)
    units = metrics.Unit
    deltas = {
        "1f": (1, units.frames),
        "40f": (40, units.frames),
        "1m": (1.0, units.meters),
        "0.3m": (0.3, units.meters),
    }
    for word, (delta, unit) in deltas.items():
        ours = evaluated("trajectory", truth, estimate, "--delta", word)["relative"][0]["errors"]
        for kind, relation in kinds.items():
            name = f"RPE {kind} over {word}"
            compare(name, ours[kind], theirs(metrics.RPE(relation, delta, unit), False), SAME_AS_EVO)


def module_of(path):
    spec = importlib.util.spec_from_file_location("tool", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def check_relations(tool, trajectory, relations):
    module = module_of(tool)
    wanted = module.load_rel(relations)
    with tempfile.TemporaryDirectory() as folder:
        thinned = Path(folder) / "thinned.txt"
        thinned.write_text("".join(Path(trajectory).read_text().splitlines(keepends=True)[::4]))
        for name, path, gap, tolerance in (
            ("all", trajectory, "inf", SAME_AS_TOOL),
            ("up to 20 s", trajectory, "20", SAME_AS_TOOL),
            ("every 4th pose", thinned, "inf", SAME_BETWEEN_POSES),
        ):
            chosen = [r for r in wanted if abs(r[1] - r[0]) <= float(gap)]
            errors, _ = module.evaluate(chosen, module.load_traj(path))
            ours = evaluated("relations", relations, path, *(["--max-gap", gap] if gap != "inf" else []))
            require(
                ours["relations"] == len(errors), f"{name}: {ours['relations']} relations, not {len(errors)}"
            )
            for index, kind in ((0, "translation_m"), (1, "rotation_deg")):
                for key, power in ((kind, 1), (kind + "2", 2)):
                    theirs = module.stats([e[index] ** power for e in errors])
                    compare(f"{name}: {key}", ours[key], dict(zip(("mean", "std", "max"), theirs)), tolerance)


checks = {"trajectory": check_trajectory, "relations": check_relations}
require(len(sys.argv) > 2 and sys.argv[1] in checks, __doc__)
checks[sys.argv[1]](*sys.argv[2:])
