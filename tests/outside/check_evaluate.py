#!/usr/bin/env python3
"""`biplane evaluate` against other people's programs: the same figures.

    check_evaluate.py trajectory ESTIMATE.tum TRUTH.tum        evo: ATE with and without alignment, RPE over frames and metres
    check_evaluate.py relations TOOL.py TRAJ.txt RELATIONS     a metricEvaluator in Python, also with every 4th pose only
"""
import importlib.util
import json
import pathlib
import subprocess
import sys
import tempfile


def biplane(*words):
    return json.loads(subprocess.run(["biplane", "evaluate", *words, "--json"], check=True, stdout=subprocess.PIPE).stdout)


def compare(name, ours, theirs, tolerance):
    """Figures by name: each within the tolerance, in proportion where they are large."""
    assert theirs, name
    for key, value in theirs.items():
        assert abs(ours[key] - value) <= tolerance * max(1.0, abs(value)), (name, key, ours[key], value)
    print(f"ok: {name}: " + ", ".join(f"{key} {ours[key]:.6f}" for key in theirs))


def check_trajectory(estimate, truth):
    from evo.core import metrics, sync
    from evo.tools import file_interface

    kinds = {"translation_m": metrics.PoseRelation.translation_part, "rotation_deg": metrics.PoseRelation.rotation_angle_deg}
    keys = ("rmse", "mean", "median", "std", "min", "max")

    def theirs(metric, align):
        pair = sync.associate_trajectories(file_interface.read_tum_trajectory_file(truth),
                                           file_interface.read_tum_trajectory_file(estimate), max_diff=0.01)
        if align:
            pair[1].align(pair[0])
        metric.process_data(pair)
        figures = metric.get_all_statistics()
        return {key: float(figures[key]) for key in keys}

    for align, words in ((True, []), (False, ["--no-align"])):
        ours = biplane("trajectory", estimate, truth, *words)
        for kind, relation in kinds.items():
            compare(f"ATE {kind}, {'aligned' if align else 'as it is'}", ours["absolute"][kind], theirs(metrics.APE(relation), align), 1e-6)
    deltas = {"1f": (1, metrics.Unit.frames), "40f": (40, metrics.Unit.frames),
              "1m": (1.0, metrics.Unit.meters), "0.3m": (0.3, metrics.Unit.meters)}
    for word, (delta, unit) in deltas.items():
        ours = biplane("trajectory", estimate, truth, "--delta", word)["relative"][0]["errors"]
        for kind, relation in kinds.items():
            compare(f"RPE {kind} over {word}", ours[kind], theirs(metrics.RPE(relation, delta, unit), False), 1e-6)


def check_relations(tool, trajectory, relations):
    spec = importlib.util.spec_from_file_location("tool", tool)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    wanted = module.load_rel(relations)
    with tempfile.TemporaryDirectory() as folder:
        thinned = pathlib.Path(folder) / "thinned.txt"
        thinned.write_text("".join(pathlib.Path(trajectory).read_text().splitlines(keepends=True)[::4]))
        # Between poses the tool rounds stamps to doubles (some 100 ns), which shows once it interpolates.
        for name, path, gap, tolerance in (("all", trajectory, "inf", 1e-9), ("up to 20 s", trajectory, "20", 1e-9),
                                           ("every 4th pose", thinned, "inf", 1e-7)):
            chosen = [r for r in wanted if abs(r[1] - r[0]) <= float(gap)]
            errors, _ = module.evaluate(chosen, module.load_traj(path))
            ours = biplane("relations", str(path), relations, *(["--max-gap", gap] if gap != "inf" else []))
            assert ours["relations"] == len(errors), (ours["relations"], len(errors))
            for index, kind in ((0, "translation_m"), (1, "rotation_deg")):
                for key, power in ((kind, 1), (kind + "2", 2)):
                    figures = dict(zip(("mean", "std", "max"), module.stats([e[index] ** power for e in errors])))
                    compare(f"{name}: {key}", ours[key], figures, tolerance)


{"trajectory": check_trajectory, "relations": check_relations}[sys.argv[1]](*sys.argv[2:])
