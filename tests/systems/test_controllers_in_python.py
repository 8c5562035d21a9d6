"""A controller that is a Python function is called at its ticks; what it did is then a record."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Body,
    Contact,
    OutputError,
    ParameterError,
    Sampled,
    Session,
    SignalEndError,
    SignalError,
    SimulationError,
    System,
    describing_function,
    export,
    simulate,
)
from gms_fsm.charts import CHARTS
from gms_fsm.run.stepped.plant import Plant
from tests.adapters.loops import PERIOD, PID
from tests.exporters.frictions import servo
from tests.helpers import FASTEST, other_parts

DRY = {"F_c": 1.0, "F_s": 1.5, "b": 0.5}


class Watcher:
    """A controller that keeps what it is called with."""

    def __init__(self, gain: float = 9.0) -> None:
        self.gain, self.seen = gain, list[tuple[float, ...]]()

    def __call__(self, t: float, x: float, v: float, r: float, w: float) -> float:
        self.seen.append((t, x, v, r))
        return self.gain * (r - x) - v


def sled(*sampled: Sampled, **more: Any) -> System:
    """A mass on a dry contact, pushed by u and a sine."""
    given: dict[str, Any] = {"signals": {"r": "sin(t)"}, **more}
    return System(
        "sled",
        bodies=(Body("sled", inertia=1.0, force="u + sin(5 * t)"),),
        contacts=(Contact("pad", CHARTS["stiction"], DRY),),
        flow={"w": "r - w"},
        sampled=sampled,
        **given,
    )


def controlled(function: Any, **more: Any) -> System:
    return sled(Sampled("pd", period=0.1, updates=function, outputs=("u",)), **more)


@pytest.mark.every(2)
@pytest.mark.parametrize("engine", sorted({"ifelse", FASTEST}))
@pytest.mark.parametrize("r", ["sin(t)", ([0.0, 1.05, 3.0], [0.0, 1.0, -1.0])])
def test_it_sees_what_the_run_has_at_its_ticks(engine: str, r: Any) -> None:
    watcher = Watcher()
    trace = simulate(controlled(watcher, signals={"r": r}), 2.0, engine=engine)
    t, x, v, _ = map(np.array, zip(*watcher.seen, strict=True))
    assert t.tolist() == [round(0.1 * k, 1) for k in range(20)]
    rows = np.searchsorted(trace.rows.t, np.nextafter(t, -np.inf))
    body = trace.body("sled")
    # Whether u jumps is known after the call; where texts read the time the last bits hang on it.
    np.testing.assert_allclose(x, body.x[rows], rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(v, body.v[rows], rtol=1e-13, atol=1e-15)
    assert len(trace.transitions) > 2


@pytest.mark.slow
def test_a_pid_in_python_is_that_of_the_scenario() -> None:
    pid = Sampled("pid", period=PERIOD, updates=PID().__call__, outputs=("u",))
    one, other = (
        simulate(each, 0.2, engine="ifelse") for each in (replace(servo(), sampled=(pid,)), servo())
    )
    assert len(one.transitions) == len(other.transitions) == 30
    end = other.body("load").x[-1]  # rtol, for the steps differ: they begin anew at every call
    assert one.body("load").x[-1] == pytest.approx(end, rel=1e-6)


def test_the_run_is_played_again_without_a_call() -> None:
    watcher = Watcher()
    trace = simulate(controlled(watcher), 2.0)
    calls = len(watcher.seen)
    again = simulate(trace.what.system, 2.0)
    assert other_parts(trace, again) == []
    assert "u" in trace.what.system.signals
    assert len(watcher.seen) == calls == 20


def test_the_trace_has_what_it_returned_and_the_other_signals() -> None:
    watcher = Watcher()
    trace = simulate(controlled(watcher), 2.0, t_eval=[0.05, 0.55, 1.95])
    returned = [9.0 * (r - x) - v for _, x, v, r in watcher.seen]
    assert trace.value("u").tolist() == [returned[k] for k in (0, 5, 19)]
    np.testing.assert_allclose(trace.value("r"), np.sin(trace.t), rtol=1e-15)


def test_parameters_with_defaults_need_no_value() -> None:
    def given(x: float, gain: float = 3.0, v: float = 7.0) -> np.ndarray:
        assert (gain, v) != (3.0, 7.0)
        return np.array(gain * (1.0 - x))

    trace = simulate(controlled(given), 0.05)
    assert trace.value("u").tolist()[-1] == 3.0


def test_a_session_calls_it_once() -> None:
    watcher = Watcher()
    session = Session(controlled(watcher), 2.0)
    assert len(watcher.seen) == 20
    session.goto(2.0)
    session.back(30)
    session.goto(2.0)
    assert other_parts(session.branch.trace(), simulate(controlled(Watcher()), 2.0)) == []
    assert len(watcher.seen) == 20


def test_rates_offsets_and_several_outputs() -> None:
    told: list[tuple[str, float]] = []

    def slow(t: float) -> tuple[float, float]:
        told.append(("slow", t))
        return t, -t

    def fast(t: float, goal: float, u: float) -> float:
        told.append(("fast", goal))
        return u + 1.0

    system = sled(
        Sampled("slow", period=0.2, updates=slow, outputs=("goal", "other"), offset=0.1),
        Sampled("fast", period=0.1, updates=fast, outputs=("u",), initial={"u": 0.5}),
    )
    trace = simulate(system, 0.45)
    assert told == [("fast", 0.0), ("slow", 0.1), ("fast", 0.1), ("fast", 0.1), ("slow", 0.3),
                    ("fast", 0.3), ("fast", 0.3)]  # fmt: skip
    assert trace.what.system.signals["u"].values.tolist()[-1] == 5.5


def test_a_run_that_stops_keeps_what_was_before() -> None:
    watcher = Watcher(gain=1e3)
    with pytest.raises(SimulationError) as caught:
        simulate(controlled(watcher), 2.0, max_steps=40)
    assert 0.0 < caught.value.trace.t[-1] < 2.0


def test_what_repeats_runs_refuses_functions() -> None:
    system = controlled(lambda x: -x, inputs=("w_ref",))
    with pytest.raises(ParameterError, match="sampled 'pd': it is a Python function"):
        describing_function(system, 1.0, 1.0, input="w_ref", output="x")
    with pytest.raises(ParameterError, match="sampled 'pd': it is a Python function"):
        simulate(controlled(lambda x: -x), 1.0, sensitivities=("initial.x",))


WRONG: dict[str, Any] = {
    "unknown name": (ParameterError, lambda y: y),
    "any names": (ParameterError, lambda **values: 1.0),
    "no number": (SignalError, lambda t: "fast"),
    "a word for a number": (SignalError, lambda t: "1.0"),
    "two numbers": (SignalError, lambda t: (1.0, 2.0)),
    "not finite": (SignalError, lambda t: float("nan")),
    "error": (SignalError, lambda t: 1.0 / t),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_function_is_refused_by_name(name: str) -> None:
    kind, function = WRONG[name]
    with pytest.raises(kind, match="sampled 'pd'"):
        simulate(controlled(function), 1.0)


def test_where_a_text_is_needed_it_is_refused_by_name(tmp_path: Any) -> None:
    system = controlled(Watcher())
    with pytest.raises(ParameterError, match="sampled 'pd': it is a Python function"):
        export(system, "c99", tmp_path)
    with pytest.raises(OutputError, match="sampled 'pd' is a Python function"):
        system.save(tmp_path / "sled.toml")
    for outputs, updates in (((), Watcher()), (("u",), {"u": "1"})):
        with pytest.raises(ParameterError, match="outputs"):
            Sampled("pd", period=0.1, updates=updates, outputs=outputs)
    assert replace(system, name="other").controllers == system.controllers


def test_where_stepping_fails_the_record_ends_and_nothing_is_made_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    commit = Plant.commit

    def fails(plant: Plant, t: float, *lines: Any) -> None:
        if t > 0.55:
            raise SimulationError("it cannot continue", None)  # type: ignore[arg-type]
        commit(plant, t, *lines)

    whole = simulate(controlled(Watcher()), 0.5)
    monkeypatch.setattr(Plant, "commit", fails)
    with pytest.raises(SignalEndError) as caught:
        simulate(controlled(Watcher()), 2.0)
    assert caught.value.trace.t[-1] == pytest.approx(0.6)
    part = caught.value.trace
    now, before = (np.interp(0.45, each.t, each.body("sled").x) for each in (part, whole))
    assert now == pytest.approx(before, rel=1e-3)
