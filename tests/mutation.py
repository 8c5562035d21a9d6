"""Mutation testing: apply one small change to a module at a time, then run the tests near it.

``python tests/mutation.py [module ...] [--sample 60] [--seed 8] [--budget seconds]``, with
``pip install -e ".[dev,mutation]"``. cosmic-ray makes the mutants; a copy of the repository is
mutated, never the repository itself. Each mutant has a forked process, so that numpy and scipy are
imported only once. Survivors are printed as diffs.
"""

import argparse
import difflib
import os
import random
import shutil
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PATIENCE = 4  # times the unchanged module's processor time: beyond this a mutant hangs
# Bit shifts of floats and the like fail at once and would only inflate the score.
_SIGNS = ("Eq", "NotEq", "Lt", "LtE", "Gt", "GtE")
OPERATORS = (
    [f"ReplaceComparisonOperator_{a}_{b}" for a in _SIGNS for b in _SIGNS if a != b]
    + [f"ReplaceBinaryOperator_{a}" for a in ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul")]
    + ["ReplaceUnaryOperator_Delete_USub", "ReplaceUnaryOperator_Delete_Not", "AddNot"]
    + ["ReplaceAndWithOr", "ReplaceOrWithAnd", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue"]
    + ["ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ExceptionReplacer"]
    + ["NumberReplacer", "ZeroIterationForLoop"]
)
PHYSICS = [
    "physics/test_closed_forms",
    "integrators/test_steps_end_where_something_changes",
    "physics/test_steps_serve_the_model",
    "physics/test_no_switch_is_lost",
]
NEAR = {  # module: its tests, those that detect most first
    "gms_fsm/charts/chart.py": [
        "charts/test_chart_refuses_contradictions",
        "test_refusals",
        "charts/test_edges_by_time_and_from_several_states",
        "charts/test_named_expressions_mean_what_they_stand_for",
        "charts/test_chart_files_round_trip",
        "charts/test_gms_chart_is_the_papers",
        "systems/test_locks_and_impacts",
        "run/test_own_machines",
    ],
    "gms_fsm/run/machines.py": [
        "laws/test_engines_agree",
        "run/test_own_machines",
        "systems/test_locks_and_impacts",
        "laws/test_files_give_back_what_was_saved",
        "charts/test_gms_chart_is_the_papers",
    ],
    "integrators/advance.py": [
        "laws/test_the_bits_are_the_approved_ones",
        "integrators/test_steps_and_stops",
        "integrators/test_the_first_change_is_found",
        *PHYSICS,
        "lowering/test_tolerances_come_from_the_model",
        "integrators/test_convergence_orders",
    ],
    "integrators/crossings.py": [
        "laws/test_the_bits_are_the_approved_ones",
        "integrators/test_the_first_change_is_found",
        "integrators/test_steps_and_stops",
        *PHYSICS,
    ],
    "integrators/loop.py": [
        "laws/test_the_bits_are_the_approved_ones",
        "laws/test_locked_contacts_do_not_move",
        "run/test_failures_keep_what_was_computed",
        "run/test_every_run_ends",
        "systems/test_locks_and_impacts",
        "systems/test_times_and_events",
        "run/test_system_state",
        "integrators/test_steps_and_stops",
        "physics/test_sliding_follows_filippov",
        *PHYSICS,
    ],
    "integrators/sliding.py": [
        "laws/test_the_bits_are_the_approved_ones",
        "physics/test_sliding_follows_filippov",
        "integrators/test_steps_and_stops",
        *PHYSICS,
    ],
    "integrators/switching/sliding_bounds.py": [
        "laws/test_the_bits_are_the_approved_ones",
        "physics/test_sliding_follows_filippov",
        "systems/test_supervisors_see_and_are_seen",
        "run/test_every_run_ends",
    ],
    "integrators/switching/jolts.py": [
        "laws/test_the_bits_are_the_approved_ones",
        "systems/test_locks_and_impacts",
        "systems/test_times_and_events",
    ],
    "integrators/step_size.py": [
        "laws/test_the_bits_are_the_approved_ones",
        "integrators/test_steps_and_stops",
        "lowering/test_tolerances_come_from_the_model",
        *PHYSICS,
        "integrators/test_convergence_orders",
    ],
}
LANGUAGE = [
    "tree", "functions", "normal", "_read", "_fold", "_powers", "_print", "_evaluate",
    "_derivative",
]  # fmt: skip
NEAR |= {
    f"gms_fsm/language/{name}.py": [
        "language/test_trees_have_one_reading",
        "language/test_printed_text_is_exact",
        "language/test_what_is_refused",
        "language/test_derivatives_are_slopes",
        "language/test_expression_evaluates_like_python",
        "charts/test_gms_chart_is_the_papers",
    ]
    for name in LANGUAGE
}


def mutants(source):
    """Return all (operator, occurrence, line) except those inside a message that is raised."""
    from cosmic_ray.ast import ast_nodes, get_ast  # from an extra that the tests do not need
    from cosmic_ray.plugins import get_operator

    tree = get_ast(source)
    lines = source.splitlines()
    found = []
    for name in OPERATORS:
        operator, occurrence = get_operator("core/" + name)(), 0
        for node in ast_nodes(tree):
            for (line, _), _ in operator.mutation_positions(node):
                if not lines[line - 1].lstrip().startswith(("f'", 'f"', "'", '"')):
                    found.append((name, occurrence, line))
                occurrence += 1
    return found


def run_tests(arguments, limit=None):
    """Return passed, failed or timeout, and the seconds, of a forked run in the working folder."""
    child = os.fork()
    if child == 0:
        if limit:
            import resource

            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, 1)
            os.dup2(null, 2)
            resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        import pytest

        os._exit(int(pytest.main(arguments)) != 0)
    _, status, used = os.wait4(child, 0)
    seconds = used.ru_utime + used.ru_stime
    if os.WIFSIGNALED(status):
        return "timeout", seconds
    return "failed" if status else "passed", seconds


def _put(path, source):
    path.write_text(source, encoding="utf-8")
    for stale in path.parent.glob(f"__pycache__/{path.stem}.*"):
        stale.unlink()  # bytecode of a text that may be as long and as old


def measure(module, sample, seed, budget):
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    path = Path(module)
    source = path.read_text(encoding="utf-8")
    every = mutants(source)
    chosen = list(every)
    random.Random(f"{seed} {module}").shuffle(chosen)  # a smaller sample is a prefix of a larger
    tests = [f"tests/{name}.py" for name in NEAR[module]] + [module]  # its examples
    options = ["-x", "-q", "--no-header", "-p", "no:cacheprovider", "--hypothesis-seed=0"]
    options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]  # of what is imported here
    rounds = [options + tests[:1], options + tests[1:]]
    if module.startswith("integrators"):  # whole runs: after the first file, the short ones
        rounds[1] += ["-m", "not slow and not matrix"]
    limits = []
    for arguments in rounds:
        outcome, seconds = run_tests(arguments)
        if outcome != "passed":
            sys.exit(f"{module}: the tests do not pass on the module as it is")
        limits.append(1 + int(PATIENCE * seconds))
    counts, start = {"failed": 0, "timeout": 0, "passed": 0}, time.monotonic()
    for name, occurrence, line in chosen[:sample]:
        if time.monotonic() - start > budget:
            break
        mutated = mutate_code(source, get_operator("core/" + name)(), occurrence)
        _put(path, mutated)
        for arguments, limit in zip(rounds, limits, strict=True):
            outcome, _ = run_tests(arguments, limit)
            if outcome != "passed":
                break
        counts[outcome] += 1
        if outcome == "passed":
            print(f"SURVIVED {module}:{line} {name} {occurrence}")
            pair = source.splitlines(), mutated.splitlines()
            print("\n".join(list(difflib.unified_diff(*pair, lineterm="", n=0))[2:]), flush=True)
    _put(path, source)
    killed = counts["failed"] + counts["timeout"]
    print(
        f"{module}: {sum(counts.values())} of {len(every)} mutants, {killed} killed "
        f"({counts['timeout']} hung), {counts['passed']} survived, "
        f"{time.monotonic() - start:.0f} s",
        flush=True,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("modules", nargs="*", default=list(NEAR))
    parser.add_argument("--sample", type=int, default=60, help="mutants of a module")
    parser.add_argument("--seed", type=int, default=8)
    parser.add_argument("--budget", type=float, default=float("inf"), help="seconds a module")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for part in ("gms_fsm", "integrators", "plots", "tests", "pyproject.toml"):
            copy = shutil.copytree if (ROOT / part).is_dir() else shutil.copy
            copy(ROOT / part, Path(folder, part))
        os.chdir(folder)
        sys.path[0] = os.environ["PYTHONPATH"] = folder
        os.environ["XDG_CACHE_HOME"] = folder
        import hypothesis
        import pydantic  # noqa: F401
        import pytest  # noqa: F401
        import scipy.integrate
        import scipy.linalg
        import scipy.optimize  # noqa: F401
        import transitions  # noqa: F401
        import typer  # noqa: F401

        sys.modules["llvmlite"] = None  # type: ignore[assignment]  # it compiles each mutant anew

        # Neither shrink nor store the examples on which a mutant fails.
        phases = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
        hypothesis.settings.register_profile(
            "mutation", phases=phases, database=None, max_examples=40
        )
        hypothesis.settings.load_profile("mutation")
        for module in asked.modules:
            measure(module, asked.sample, asked.seed, asked.budget)


if __name__ == "__main__":
    main()
