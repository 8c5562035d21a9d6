"""How a run begins, what it records and how exactly: settings, initial values, requested rows.

One `Settings` object means the same to simulate, sessions and sweeps. A run starts with the entry
of the default state, as a Stateflow chart does. With ``events="held"`` the chart is asked at ticks,
and what it gives out is held between them: it lags by the sample time.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    FrictionState,
    Prescribed,
    Session,
    Settings,
    State,
    Trace,
    Transition,
    simulate,
    sweep,
)
from gms_fsm.run.settings import SettingOptions
from tests.corpus import ENGINES, STARTED, each, run, trace
from tests.helpers import FASTEST, non_drifting, open_loop, other_parts, same_bits, stick_slip

SUBJECT = stick_slip("signed"), open_loop()
FIXED = Settings(method="rk4", step=0.01, rtol=1e-4, max_steps=5000, engine="ifelse")


# --------------------------------------------------------------------------- settings
@pytest.mark.slow
def test_simulate_a_session_and_a_sweep_run_alike(tmp_path: Path) -> None:
    fields = {each.name for each in dataclasses.fields(Settings)}
    assert set(get_type_hints(SettingOptions)) == fields, "the arguments are the fields"
    whole = simulate(*SUBJECT, 12.0, settings=FIXED)
    assert whole.settings["method"] == "rk4"
    session = Session(*SUBJECT, 12.0, settings=FIXED)
    session.branch.complete()
    assert other_parts(session.branch.trace(), whole) == []
    swept = sweep(*SUBJECT, 12.0, {"F_s": [1.5]}, settings=FIXED)
    np.testing.assert_array_equal(swept.z[0], whole.z[-1])
    assert len(whole.transitions) == swept.transition_count[0] > 0
    later = Session(*SUBJECT, 6.0, settings=FIXED, t_start=0.5)
    again = Session.load(later.save(tmp_path / "session.json"))
    assert (again.settings, again.t_start) == (FIXED, 0.5)


@pytest.mark.parametrize("options", [{"step": 0.02}, {"method": "heun"}, {"engine": "machines"}])
def test_an_option_overrides_the_settings(options: dict[str, Any]) -> None:
    one = simulate(*SUBJECT, 6.0, settings=FIXED, **options)
    other = simulate(*SUBJECT, 6.0, settings=dataclasses.replace(FIXED, **options))
    assert other_parts(one, other) == []
    assert one.settings == other.settings
    assert one.settings[next(iter(options))] == next(iter(options.values()))


def test_requested_rows_may_follow_settings_that_keep_all() -> None:
    found = simulate(*SUBJECT, 6.0, settings=FIXED, t_eval=[1.0, 2.5])
    assert found.t.tolist() == [1.0, 2.5]


# --------------------------------------------------------------------------- the start
ENTERED = ChartModel(
    Chart(
        "set at the start",
        inputs=("v", "t"),
        variables=("z", "w"),
        parameters=("k",),
        states=(
            State("first", flow={"z": "v"}, entry={"z": "k * v + t", "w": "2 * z"}),
            State("other", flow={"z": "v"}),
        ),
        transitions=(Transition("back", "other", "first", guard="z > 100"),),
        outputs={"F": "k * z"},
    ),
    {"k": [1.0, 3.0]},
    n=2,
)
STEADY = Prescribed("0.5 + 0 * t")


@pytest.mark.parametrize("engine", ENGINES)
def test_every_element_enters_with_its_own_numbers(engine: Any) -> None:
    """What is given stays, and is what later steps see; another state is not entered."""
    for initial, z, w in (
        ({}, [2.5, 3.5], [5.0, 7.0]),
        ({"z": [0.25, 0.5]}, [0.25, 0.5], [0.5, 1.0]),
        ({"states": ["other", "first"]}, [0.0, 3.5], [0.0, 7.0]),
    ):
        begun = simulate(ENTERED, STEADY, 3.0, t_start=2.0, engine=engine, initial=initial)
        assert begun.z[0].tolist() == z
        assert begun.variable("w")[0].tolist() == w


@pytest.mark.parametrize("engine", ENGINES)
def test_variables_start_where_their_chart_says_unless_the_run_says_else(engine: Any) -> None:
    states = (State("first", {"z": "v"}, entry={"w": "2 * z"}),)
    model = ChartModel(
        Chart("begun", ("v",), ("z", "w"), (), states, (), {"F": "z"}, initial={"z": 0.25}), {}, n=2
    )
    for initial, z in (({}, [0.25, 0.25]), ({"z": [1.0, 2.0]}, [1.0, 2.0])):
        begun = simulate(model, STEADY, 1.0, engine=engine, initial=initial)
        assert begun.z[0].tolist() == z
        assert begun.variable("w")[0].tolist() == [2 * each for each in z]
    assert FrictionState(model).variables["z"].tolist() == [0.25, 0.25]


@pytest.mark.slow
def test_a_compiled_sweep_enters_with_the_numbers_of_each_run() -> None:
    k = np.linspace(1.0, 2.0, 130)  # two runs per task, which share their buffers
    found = sweep(ENTERED, STEADY, 0.1, {"k": k}, engine=FASTEST, progress=False)
    np.testing.assert_allclose(found.z[:, 0] - found.z[0, 0], 0.5 * (k - 1.0), rtol=1e-9)


def test_initial_states_and_positions_are_the_first_row() -> None:
    begun = trace("started")
    assert (begun.x[0], begun.v[0]) == (STARTED["x"], STARTED["v"])
    assert begun.z[0].tolist() == STARTED["z"]
    assert begun.states[0].tolist() == STARTED["states"]


# --------------------------------------------------------------------------- requested rows
@each(["open loop", "open loop, published", "pulled mass", "fig. 3, slipping"])
def test_rows_between_steps_are_as_accurate_as_the_steps(name: str) -> None:
    """Dense output: rows inside steps are as close to a run at rtol 1e-12 as its steps are."""
    t_end = min(run(name).t_end, 20.0)
    times = np.linspace(0, t_end, 1501)
    how = {"engine": FASTEST, "t_eval": times}
    found = simulate(*run(name).subject, t_end, **how)
    exact = simulate(*run(name).subject, t_end, **how, rtol=1e-12, atol=1e-15)
    # Rows within the error of an event's time may be on its other side.
    near = np.abs(times[:, None] - exact.transitions.t).min(axis=1) < 1e-4
    assert near.mean() < 0.1
    assert np.abs(found.z - exact.z)[~near].max() < 5e-5
    np.testing.assert_array_equal(found.states[~near], exact.states[~near])


def test_the_end_can_be_saved_and_sampled(tmp_path: Path) -> None:
    end = run("open loop")(output="end", engine=FASTEST)
    for name in ("end.npz", "end.csv"):
        same_bits(end, Trace.load(end.save(tmp_path / name)))
    assert end.sample([31.0]).z.tolist() == end.z.tolist()
    with pytest.raises(ValueError, match="outside the run"):
        end.sample([15.0])


def test_a_transition_at_the_end_is_in_the_last_row() -> None:
    """t_end on a transition: the row at t_end comes after the firing."""
    states = State("early", {"z": "1"}), State("late", {"z": "0"})
    go = Transition("go", "early", "late", guard="t >= 2")
    chart = Chart("by the clock", ("t",), ("z",), ("k",), states, (go,), {"F": "k * z"})
    model, rig = ChartModel(chart, {"k": 1.0}, n=2), Prescribed("0.1")
    full, few = (simulate(model, rig, 2.0, t_eval=rows) for rows in (None, [0.0, 2.0]))
    assert full.transitions.t.tolist() == few.transitions.t.tolist() == [2.0, 2.0]
    assert few.states[-1].tolist() == full.states[-1].tolist() == ["late"] * 2


@pytest.mark.parametrize("events", ["located", "step"])
@pytest.mark.parametrize("output", [{}, {"output": "end"}, {"t_eval": [0.0, 45.0]}])
def test_a_long_compiled_run_checks_for_ctrl_c(events: Any, output: dict[str, Any]) -> None:
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    seen: list[float] = []
    how = {"engine": "compiled", "method": "euler", "step": 1e-3, "events": events, **output}
    rig = Prescribed("0.2")
    simulate(SUBJECT[0], rig, 45.0, progress=lambda moment: seen.append(moment.t), **how)
    assert seen, "45,000 steps without checking for Ctrl-C"
    assert seen == sorted(seen)


# --------------------------------------------------------------------------- held outputs
@pytest.mark.slow
def test_held_outputs_lag_in_proportion_to_the_sample_time() -> None:
    (model, rig), times = non_drifting("published"), np.linspace(0.0, 2.0, 401)
    how = {"t_eval": times, "engine": FASTEST}
    exact = simulate(model, rig, 2.0, rtol=1e-9, **how)
    force, place = [], []
    for h in (2e-3, 1e-3, 5e-4):
        held = simulate(model, rig, 2.0, events="held", step=h, **how)
        force.append(np.abs(held.F - exact.F).max())
        place.append(np.abs(held.x - exact.x).max())
    np.testing.assert_allclose(np.array(force[:-1]) / force[1:], 2.0, rtol=0.05)
    np.testing.assert_allclose(np.array(place[:-1]) / place[1:], 2.0, rtol=0.05)
    assert force[1] == pytest.approx(1.7e-4, rel=0.2)
    assert place[1] == pytest.approx(2.3e-6, rel=0.2)


def test_held_outputs_and_states_change_at_ticks_only() -> None:
    held = simulate(*SUBJECT, 61.0, events="held", step=0.25, engine="ifelse")
    ticks = np.arange(12) * 0.25
    for start, end in zip(ticks, [*ticks[1:], 3.0], strict=True):
        inside = (held.t > start) & (held.t < end)
        assert inside.sum() > 0
        assert np.ptp(held.F[inside]) == 0.0
        assert np.ptp(held.dz[inside], axis=0).max() == 0.0
    log = held.transitions
    assert len(log) > 20
    assert (log.t % 0.25 == 0.0).all()
    pairs = list(zip(log.t.tolist(), log.element.tolist(), strict=True))
    assert len(set(pairs)) == len(pairs), "each fires once"
