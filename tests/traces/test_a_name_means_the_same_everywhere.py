"""Claim: a name means the same in guards, watches, invariants, machines and replay pages.

`gms_fsm.traces.scope` gives the values of one row as numbers and of all rows as arrays.
"""

from __future__ import annotations

import importlib.util
import json
import re

import numpy as np
import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    ElementMachines,
    Prescribed,
    Session,
    Slider,
    State,
    Stribeck,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.language import names_in, parse_value
from gms_fsm.run.settings import Settings
from gms_fsm.session.explain import values_at
from gms_fsm.traces.scope import Scope, invariant_names, watch_names
from tests.helpers import pulled_mass, stick_slip

TWO = Chart(
    "two variables",
    inputs=("v", "s", "x"),
    variables=("z", "w"),
    parameters=("k", "c"),
    states=(
        State("stick", {"z": "v", "w": "c"}),
        State("slip", {"z": "v - v*abs(z)/s", "w": "-w"}),
    ),
    transitions=(
        Transition("lets_go", "stick", "slip", "z >= s", {"w": "w + z"}),
        Transition("holds", "slip", "stick", "v < 0 and z > 0"),
    ),
    outputs={"F": "k * z + c * dz"},
)
BARE = Chart(
    "without a curve", ("v",), ("q",), ("k",), (State("only", {"q": "v"}),), (), {"F": "k * q"}
)


def two(n: int) -> ChartModel:
    values = {"k": np.arange(1.0, n + 1.0), "c": 0.5}
    return ChartModel(TWO, values, n=n, stribeck=Stribeck(0.05, 0.07, 0.1))


CASES = {
    "gms": (stick_slip("signed"), Prescribed("0.2*sin(t)")),
    "pulled": pulled_mass(),
    "two variables": (two(3), Slider(0.5, "2*sin(t)")),
    "one element": (two(1), Prescribed("0.7*sin(t)")),
    "no curve": (ChartModel(BARE, {"k": 2.0}, n=2), Prescribed("0.1")),
}


@pytest.fixture(scope="module", params=CASES)
def trace(request: pytest.FixtureRequest) -> Trace:
    return simulate(*CASES[request.param], 8.0)


def test_the_values_are_those_of_the_trace(trace: Trace) -> None:
    watches = Scope.over(trace).watches()
    columns = {"t": trace.t, "x": trace.x, "v": trace.v, "F": trace.F}
    for i in range(trace.n):
        blocks = {name: trace.variable(name) for name in trace.model.chart.variables}
        blocks["F"] = trace.F_elements
        if trace.model.stribeck is not None:
            blocks["s"] = trace.s
        columns |= {f"{name}{i + 1}": block[:, i] for name, block in blocks.items()}
        columns[f"state({i + 1})"] = trace.states[:, i]
    for name, column in columns.items():
        np.testing.assert_array_equal(watches[name], column, name)
    if trace.model.stribeck is not None:
        np.testing.assert_allclose(watches["s"], trace.model.stribeck(trace.v), rtol=1e-15)


def test_one_row_agrees_with_all_rows(trace: Trace) -> None:
    run = Scope.over(trace)
    for row in range(0, len(trace), 5):
        here = Scope.at(trace, row)
        for ours, all_rows in ((here.watches(), run.watches()), (here.guards(0), run.guards(0))):
            assert ours.keys() == all_rows.keys()
            for name, value in ours.items():
                np.testing.assert_equal(value, np.broadcast_to(all_rows[name], len(trace))[row])


def test_one_row_is_plain_numbers(trace: Trace) -> None:
    """NumPy numbers do not raise where Python numbers do: 1/0 would be true or false."""
    here = Scope.at(trace, -1)
    for values in (here.guards(0), here.watches()):
        assert {type(value) for value in values.values()} <= {float, str}


def test_there_is_a_value_for_every_name_and_nothing_else(trace: Trace) -> None:
    model, run = trace.model, Scope.over(trace)
    states = {f"state({i + 1})" for i in range(trace.n)}
    bare = {"state(0)"} if trace.n == 1 else set()
    assert set(run.watches()) == set(watch_names(model)) | states | bare
    assert set(run.invariants()) == set(invariant_names(model))
    with_states = set(run.invariants(states=True)) - set(run.invariants())
    assert with_states == states | {"state(0)"}
    assert set(run.guards(0)) == {"t", "x", "v", "s", *model.chart.variables, *model.values}


def test_an_invariant_sees_what_guards_see(trace: Trace) -> None:
    columns = Scope.over(trace).invariants()
    shape = trace.n, len(trace)
    for row in range(0, len(trace), 7):
        for i in range(trace.n):
            values = values_at(trace, row, i)
            for name in {*columns} & {*values}:
                assert np.broadcast_to(columns[name], shape)[i, row] == values[name], name


def test_machines_show_the_values_of_guards() -> None:
    """At every firing, a callback sees the values of its element that `explain` reports later."""
    model, rig = CASES["two variables"]
    machines, seen = ElementMachines(model), []
    machines.machine.on_enter_slip(
        lambda event: seen.append({name: getattr(event.model, name) for name in NAMES})
    )
    trace = simulate(model, rig, 8.0, engine=machines)
    rows = [row for row in range(len(trace)) if trace.microstep[row] > 0]
    entered = [
        (row, record.element)
        for row, record in zip(rows, trace.transitions, strict=True)
        if record.target == "slip"
    ]
    assert len(entered) == len(seen) > 3
    for (row, element), values in zip(entered, seen, strict=True):
        # All guards of a set are evaluated before any of its edges is taken.
        before = row - int(trace.microstep[row])
        assert values == values_at(trace, before, element)


NAMES = ("t", "x", "v", "s", "z", "w", "k", "c")


@pytest.mark.parametrize("case", CASES)
def test_a_session_takes_the_same_names(case: str) -> None:
    model, rig = CASES[case]
    session = Session(model, rig, 8.0)
    assert session.names == watch_names(model)
    session.step(9)
    trace = session.branch.trace()
    expected = Scope.at(trace, session.branch.cursor).watches()
    assert session.values() == expected
    for name in session.names:
        assert session.watch(name) == expected[name]
        assert names_in(parse_value(name, session.names)) == {name}


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("uplot") is None, reason="needs uplot-python")
@pytest.mark.parametrize("case", ["gms", "one element"])
def test_a_page_takes_the_same_names(case: str) -> None:
    from plots.page.replay import replay_html

    model, rig = CASES[case]
    page = replay_html(simulate(model, rig, 8.0))
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert found is not None
    (run,) = json.loads(found[1])["runs"]
    assert list(run["names"]) == watch_names(model)


def test_names_that_a_run_does_not_have() -> None:
    trace = simulate(*CASES["gms"], 1.0)
    assert trace.value("F").tolist() == trace.F.tolist()
    assert len(trace.seen) == len([*trace.seen])
    with pytest.raises(KeyError, match="nothing"):
        trace.seen["nothing"]
    assert repr(trace.transitions[None]).startswith("array(")
    assert Settings() != 3
