"""A run that cannot continue is an outcome: inspect it, step back, poke it and continue."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, Transition, simulate
from gms_fsm.charts import gms_element
from gms_fsm.errors import ParameterError, SessionError
from gms_fsm.session.session import Session
from gms_fsm.traces.failures import LivelockError, SimulationError
from tests.helpers import stick_slip


def both_ways() -> ChartModel:
    """Element 2 breaks away at z = 1 and is arrested there immediately, again and again."""
    law = gms_element("signed")
    edges = (
        Transition("go", "stick", "slip", guard="z >= s and v > v_c"),
        Transition("stay", "slip", "stick", guard="z >= s"),
    )
    chart = Chart(
        "broken", law.inputs, law.variables, law.parameters, law.states, edges, law.outputs
    )
    values = {"k": 1.0, "sigma": 0.1, "C": 0.1, "v_c": 1e-6}
    return ChartModel(chart, values, n=2, weights=[2.0, 1.0], stribeck=Stribeck(1.0, 1.5, 1e-3))


def test_a_livelock_can_be_inspected_stepped_back_from_and_poked() -> None:
    model, rig = both_ways(), Prescribed("0.15")
    with pytest.raises(LivelockError) as caught:
        simulate(model, rig, 20.0)
    session = Session(model, rig, 20.0)
    here = session.goto(20.0)
    assert str(session.branch.failure) == str(caught.value)
    assert "element 2 at t = 6.6" in str(session.branch.failure)
    assert "switched 100 times" in str(session.branch.failure)
    assert here.t == pytest.approx(1.0 / 0.15)
    assert here.microstep >= 99
    same = caught.value.trace
    assert [
        session.branch.raw(row)[2] for row in range(len(session.branch))
    ] == same.rows.y.tolist()
    assert session.why(1)[0].fired
    assert session.step() == here  # it stays there
    assert session.prev_transition().microstep == here.microstep - 1
    while session.here.microstep:
        session.back()
    assert session.here.states == ("stick", "stick")
    session.poke({"z": {1: 0.0}})
    assert session.goto(10.0).t > here.t
    assert session.branch.failure is None
    assert not session.branch.ended
    assert "switched 100 times" in str(session.branches[0].failure)
    assert session.goto(20.0).t == pytest.approx(2.0 / 0.15)  # it gets there a second time
    assert "switched 100 times" in str(session.branch.failure)


def test_a_record_that_ends_too_early() -> None:
    t = np.linspace(0, 5, 501)
    session = Session(stick_slip("signed"), Prescribed((t, 0.1 * np.sin(t))), 9.0)
    assert session.goto(9.0).t == 5.0
    assert isinstance(session.branch.failure, SimulationError)
    assert session.branch.failure.t == 5.0
    assert session.back(3).t < 5.0


@pytest.mark.parametrize("guard", ["0 / (z - z) > 0", "sqrt(-1 - z) > 0"])
def test_a_run_that_cannot_even_start_has_its_first_row(guard: str) -> None:
    chart = Chart(
        "bad",
        ("v",),
        ("z",),
        ("k",),
        (State("on", {"z": "v"}), State("off", {"z": "0"})),
        (Transition("go", "on", "off", guard=guard),),
        {"F": "k * z"},
    )
    session = Session(
        ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.5, 0.1)), Prescribed("1"), 1.0
    )
    assert session.goto(1.0).row == 0
    assert isinstance(session.branch.failure, SimulationError)
    assert session.step().t == 0.0


def test_a_flow_that_is_not_finite() -> None:
    chart = Chart(
        "singular", ("v",), ("z",), ("k",), (State("on", {"z": "z * z"}),), (), {"F": "k * z"}
    )
    model = ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.5, 0.1))
    session = Session(model, Prescribed("0"), 2.0, initial={"z": [1.0]})
    here = session.goto(2.0)
    assert 0.99 < here.t < 1.001
    with pytest.raises(SimulationError) as caught:
        simulate(model, Prescribed("0"), 2.0, initial={"z": [1.0]})
    assert str(session.branch.failure) == str(caught.value)
    session.goto(0.5)
    session.poke({"z": {0: -1.0}})
    assert session.goto(2.0).t == 2.0
    assert session.branch.ended


@pytest.mark.parametrize("option", [{"t_eval": [0.0, 1.0]}, {"progress": print}, {"engine": None}])
def test_options_that_a_session_does_not_support(option: Any) -> None:
    with pytest.raises(ParameterError, match="session"):
        Session(stick_slip("signed"), Prescribed("0.1"), 1.0, **option)


@pytest.mark.parametrize("count", [-1, -5])
def test_a_negative_count_is_rejected(count: int) -> None:
    session = Session(stick_slip("signed"), Prescribed("0.1"), 1.0)
    session.step(3)
    for walk in (session.step, session.back):
        with pytest.raises(SessionError):
            walk(count)
    assert session.here.row == 3


@pytest.mark.parametrize("t", [-1.0, float("nan")])
def test_a_time_before_the_start_is_rejected(t: float) -> None:
    with pytest.raises(SessionError, match="before the start"):
        Session(stick_slip("signed"), Prescribed("0.1"), 1.0).goto(t)


@pytest.mark.parametrize("text", ["1 / x", "sqrt(-1 - x)"])
def test_a_watch_that_cannot_be_computed_says_so(text: str) -> None:
    with pytest.raises(SessionError, match="cannot be computed here"):
        Session(stick_slip("signed"), Prescribed("0.1"), 1.0).watch(text)
