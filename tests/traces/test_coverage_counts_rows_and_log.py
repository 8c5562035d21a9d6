"""Coverage equals a count made row by row, firing by firing: of one run and of several together.

The count below evaluates one guard at one row for one element, as the debugger does, and knows
nothing of arrays.
"""

from __future__ import annotations

import math
import multiprocessing
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    Coverage,
    Prescribed,
    State,
    Stribeck,
    Trace,
    Transition,
    coverage,
    simulate,
    sweep,
)
from gms_fsm.language import Relation, evaluate
from gms_fsm.language.tree import walk
from gms_fsm.systems.mounted import mounted
from gms_fsm.systems.numbers import varied
from gms_fsm.traces.coverage.counting import FiredEdges, LogCounts, of_log
from gms_fsm.traces.coverage.counts import ChartCoverage
from gms_fsm.traces.scope import Scope
from tests import supervisor_cases, systems_cases
from tests.helpers import FASTEST, FIG4_SINE, stick_slip

GUARDED = Chart(
    "three states and every kind of guard",
    variables=("z",),
    parameters=("a",),
    states=(State("rest", flow={"z": "v"}), State("left"), State("right", flow={"z": "-z"})),
    transitions=(
        Transition("go_left", "rest", "left", guard="v < -a and (z > 0.02 or z < -0.02)"),
        Transition("go_right", "rest", "right", guard="v > a and not (z > 0.1 and v < 2 * a)"),
        Transition("home", ("left", "right"), "rest", guard="abs(v) <= a or z > 9"),
        Transition("over", "left", "right", guard="v > 3 and v > 3 * a"),
        Transition("always", "right", "left", guard="z < -0.5 and True"),
    ),
    outputs={"F": "0"},
)


LONG = Chart(
    "guards of many comparisons",
    states=(State("a"), State("b")),
    transitions=(
        Transition("go", "a", "b", guard=" and ".join(f"v > {0.01 * i}" for i in range(12))),
        Transition("back", "b", "a", guard=" or ".join(f"v < {-0.01 * i}" for i in range(70))),
    ),
    outputs={"F": "0"},
)


def many_comparisons() -> Trace:
    return simulate(ChartModel(LONG, {}, n=2), Prescribed("0.2*sin(t)"), 9.0)


def several_states() -> Trace:
    model = ChartModel(GUARDED, {"a": [0.05, 0.1, 0.19]}, n=3)
    return simulate(model, Prescribed("0.2*sin(t)"), 9.0)


def of_elements(law: str, v: str, t_end: float, **options: Any) -> Callable[[], Trace]:
    return lambda: simulate(stick_slip(law), Prescribed(v), t_end, engine=FASTEST, **options)


RUNS: dict[str, Callable[[], Trace]] = {
    "several states": several_states,
    "many comparisons": many_comparisons,
    "four elements": of_elements("signed", FIG4_SINE, 30.0),
    "one direction": of_elements("published", "0.2", 2.3),
    "requested rows": of_elements("signed", FIG4_SINE, 30.0, t_eval=[0.0, 11.0, 30.0]),
    "a system of two contacts": lambda: systems_cases.two_blocks().run(),
    "a thermostat": lambda: supervisor_cases.thermostat().run(),
    "lights with times and events": lambda: supervisor_cases.crossing().run(),
}


def truth(part: Relation, values: dict[str, Any]) -> str:
    try:
        return str(int(evaluate(part, values)))
    except (ArithmeticError, ValueError):
        return "0"


def check(found: ChartCoverage, *views: Trace) -> None:
    """Compare with a count over the rows and firings of the views of some runs."""
    chart, n = found.chart, found.n
    rows, entries, taken = Counter[Any](), Counter[Any](), Counter[Any]()
    asked, closest = Counter[Any](), dict[Any, float]()
    for view in views:
        whole = view.whole()
        for i in range(n):
            entries[str(whole.states[0, i]), i] += 1
        for record in view.transitions:
            entries[str(record.target), int(record.element)] += 1
            taken[str(record.edge), str(record.source), int(record.element)] += 1
        for row in range(len(whole)):
            scope = Scope.at(whole, row)
            for i in range(n):
                state, values = scope.states[i], scope.guards(i)
                rows[state, i] += 1
                for edge in chart.transitions:
                    if edge.source != state:
                        continue
                    tree = chart.guards[edge.name]
                    parts = [each for each in walk(tree) if isinstance(each, Relation)]
                    parts = [*dict.fromkeys(parts)]
                    vector = "".join(truth(part, values) for part in parts)
                    asked[edge.name, state, vector, i] += 1
                    for number, part in enumerate(parts):
                        key = edge.name, state, vector, number
                        margin = abs(evaluate(part.left, values) - evaluate(part.right, values))
                        if vector[number] == "1":
                            margin = 0.0
                        closest[key] = min(closest.get(key, math.inf), margin)
    for each in found.states:
        assert list(each.rows) == [rows[each.name, i] for i in range(n)]
        assert list(each.entries) == [entries[each.name, i] for i in range(n)]
    for edge in found.edges:
        assert list(edge.taken) == [taken[edge.edge, edge.source, i] for i in range(n)]
        mine = {key: count for key, count in asked.items() if key[:2] == (edge.edge, edge.source)}
        assert {*edge.asked} == {vector for _, _, vector, _ in mine}
        for vector, counts in edge.asked.items():
            assert list(counts) == [
                mine.get((edge.edge, edge.source, vector, i), 0) for i in range(n)
            ]
        if any(edge.taken):
            assert edge.closest == {}
            continue
        for vector, margins in edge.closest.items():
            assert list(margins) == [
                closest[edge.edge, edge.source, vector, number] for number in range(len(vector))
            ]


@pytest.mark.parametrize("name", RUNS)
def test_it_counts_what_is_there(name: str) -> None:
    trace = RUNS[name]()
    found = coverage(trace)
    assert found.runs == 1
    for contact, part in found.parts.items():
        check(part, trace.contact(contact) if contact else trace)
        assert (part.runs, part.watched) == (1, 1)


def test_the_sum_is_that_of_all_rows_together() -> None:
    runs = [RUNS[name]() for name in ("four elements", "requested rows")]
    runs.append(simulate(stick_slip("signed"), Prescribed("-0.1"), 2.0))
    check(coverage(runs).contact(), *runs)
    check((coverage(runs[0]) + coverage(runs[1:])).contact(), *runs)


def test_all_that_a_system_has_is_counted_by_name() -> None:
    found = coverage(RUNS["a system of two contacts"]())
    assert [*found.parts] == [each.name for each in systems_cases.two_blocks().system.contacts]
    assert found.scores["edges"].of == 12


def test_a_run_without_rows_is_known_by_its_log() -> None:
    whole = simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 30.0)
    brief = simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 30.0, output="end")
    found, all_of_it = coverage(brief), coverage(whole)
    assert [*found.scores] == ["states", "edges"]
    assert (found.contact().runs, found.contact().watched) == (1, 0)
    for a, b in zip(found.contact().edges, all_of_it.contact().edges, strict=True):
        assert a.taken == b.taken
    for c, d in zip(found.contact().states, all_of_it.contact().states, strict=True):
        assert c.entries == d.entries
    assert "no run kept rows" in found.text
    assert "1 of 2 runs kept rows" in (found + all_of_it).text


def test_a_run_that_ends_at_its_first_row_has_this_row() -> None:
    trace = simulate(stick_slip("signed"), Prescribed("0.2"), 3.0)
    first = replace(trace, rows=trace.rows.at(slice(1)), stops=trace.rows.at(slice(1)))
    found = coverage(replace(first, firings=trace.firings.at(slice(0)))).contact()
    assert found.watched == 1
    check(found, replace(first, firings=trace.firings.at(slice(0))))


def test_what_cannot_be_computed_has_no_margin() -> None:
    chart = Chart(
        "reciprocal",
        variables=("z",),
        states=(State("a", flow={"z": "v"}), State("b", flow={"z": "v"})),
        transitions=(Transition("go", "a", "b", guard="1 / z < -2"),),
        outputs={"F": "z"},
    )
    found = coverage(simulate(ChartModel(chart, {}), Prescribed(0.0), 1.0))
    (edge,) = found.contact().edges
    assert edge.closest == {"0": (math.inf,)}
    assert "`1 / z < -2` was never true" in found.text
    assert "closest" not in found.text


def test_runs_with_more_elements_add_to_those_with_fewer() -> None:
    models = [
        ChartModel(GUARDED, {"a": [0.05] * n}, n=n, stribeck=Stribeck(1.0, 1.5, 0.1))
        for n in (1, 3)
    ]
    one, three = (coverage(simulate(each, Prescribed("0.2*sin(t)"), 9.0)) for each in models)
    both = one + three
    assert both == three + one
    assert both.contact().n == 3
    rest = both.contact().states[0].rows
    assert rest[1:] == three.contact().states[0].rows[1:]
    assert rest[0] == one.contact().states[0].rows[0] + three.contact().states[0].rows[0]


SWEPT = {"F_s": [1.3, 1.5, 1.7]}


def _runs() -> list[Trace]:
    values = ({"F_s": each} for each in SWEPT["F_s"])
    rig = Prescribed(FIG4_SINE)
    whats = (varied(mounted(stick_slip("signed"), rig), each) for each in values)
    return [simulate(each.model, each.rig, 30.0, engine=FASTEST) for each in whats]


@pytest.mark.matrix
@pytest.mark.every(2)
@pytest.mark.parametrize("t_eval", [None, [0.0, 12.0, 30.0]])
def test_a_sweep_counts_as_its_runs_do(t_eval: list[float] | None) -> None:
    given: Any = (stick_slip("signed"), Prescribed(FIG4_SINE), 30.0, SWEPT)
    options: Any = {"engine": FASTEST} | ({} if t_eval is None else {"t_eval": t_eval})
    plain, full = sweep(*given, **options), sweep(*given, coverage=True, **options)
    alone = coverage(_runs())
    log = coverage(plain).contact()
    assert (log.runs, log.watched) == (3, 0)
    for a, b in zip(log.edges, alone.contact().edges, strict=True):
        assert a.taken == b.taken
    for c, d in zip(log.states, alone.contact().states, strict=True):
        assert c.entries == d.entries
    if t_eval is None:
        assert coverage(full) == alone
    assert coverage(full).scores == alone.scores
    for name in ("t", "x", "v", "F", "z"):  # the same runs, to the last bit
        assert getattr(plain, name).tobytes() == getattr(full, name).tobytes()
    assert plain.transitions.tobytes() == full.transitions.tobytes()


@pytest.mark.parametrize("engine", [FASTEST, "ifelse"])
def test_a_sweep_keeps_no_rows_to_count(engine: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(trace: Trace) -> None:
        raise AssertionError("counted from rows")

    monkeypatch.setattr("gms_fsm.run.repeated.collected.of_trace", none)
    given: Any = (stick_slip("signed"), Prescribed(FIG4_SINE), 30.0, SWEPT)
    assert coverage(sweep(*given, engine=engine, coverage=True)) == coverage(_runs())


@pytest.mark.parametrize(
    ("chart", "velocity"), [(LONG, "0.2*sin(t)"), (GUARDED, lambda t: 0.2 * math.sin(t))]
)
def test_what_cannot_be_counted_as_it_comes_is_counted_from_rows(
    chart: Chart, velocity: Any
) -> None:
    """Guards of many comparisons, and what reads functions of the user's."""
    values = dict.fromkeys(chart.parameter_names, 0.05)
    given = ChartModel(chart, values, n=2), Prescribed(velocity), 9.0
    found = sweep(*given, {"sigma_2": [0.0, 1.0]}, engine=FASTEST, coverage=True)
    one = coverage(simulate(*given, engine=FASTEST))
    assert found.outcome.tolist() == ["ok"] * 2
    assert coverage(found) == one + one


@pytest.mark.matrix
@pytest.mark.slow
def test_workers_and_files_count_as_one(tmp_path: Path) -> None:
    given: Any = (stick_slip("signed"), Prescribed(FIG4_SINE), 30.0)
    numbers = np.linspace(1.3, 1.7, 200)  # several tasks
    whole = coverage(sweep(*given, {"F_s": numbers}, engine=FASTEST, coverage=True))
    parts = []
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        for k in range(3):
            some = {"F_s": numbers[k::3]}
            swept = sweep(*given, some, executor=pool, engine=FASTEST, coverage=True)
            parts.append(coverage(swept).save(tmp_path / f"{k}.json"))
    assert Coverage.merged(Coverage.load(part) for part in reversed(parts)) == whole
    assert whole.contact().watched == whole.runs == 200


def test_a_sweep_of_a_system_counts_each_contact() -> None:
    case = systems_cases.two_blocks()
    options: Any = {"engine": FASTEST, "initial": dict(case.initial)}
    values = {"numbers.V": [0.1, 0.05]}
    plain = sweep(case.system, 20.0, values, **options)
    full = sweep(case.system, 20.0, values, coverage=True, **options)
    found, log = coverage(full), coverage(plain)
    assert [*found.parts] == [*log.parts] == [each.name for each in case.system.contacts]
    for name, part in found.parts.items():
        assert [each.taken for each in part.edges] == [each.taken for each in log.parts[name].edges]
        assert [each.entries for each in part.states] == [
            each.entries for each in log.parts[name].states
        ]
    name = case.system.contacts[0].name
    assert coverage(full.contact(name)).parts == {name: found.parts[name]}


def test_a_run_that_cannot_start_is_no_run() -> None:
    found = coverage(
        sweep(
            stick_slip("signed"), Prescribed("0.2"), 3.0, {"v_c": [1e-6, -1.0]}, engine="machines"
        )
    )
    assert found.runs == 1
    assert found.contact().states[0].entries == (1, 1, 1, 1)


@pytest.mark.slow
def test_the_log_of_a_thousand_runs_is_counted_in_a_tenth_of_their_time() -> None:
    """It takes about a hundredth."""
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    model, values = stick_slip("signed"), {"F_s": np.linspace(1.2, 2.0, 1000)}
    sweep(model, Prescribed(FIG4_SINE), 100.0, {"F_s": [1.5]})  # compiles
    begin = time.perf_counter()
    result = sweep(model, Prescribed(FIG4_SINE), 100.0, values)
    took, log = time.perf_counter() - begin, result.transitions
    states = [state.name for state in model.chart.states]
    last = np.vectorize(states.index)(result.states)
    begin = time.perf_counter()
    found = of_log(
        model.chart,
        LogCounts.of(model.chart, FiredEdges(log["run"], log["element"], log["edge"], last)),
    )
    assert time.perf_counter() - begin < 0.1 * took
    assert found == coverage(result).contact()
    assert found.runs == 1000
