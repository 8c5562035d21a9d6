"""A run that cannot continue says what happened and what to try, and keeps its results so far.

Before a run every argument is checked: the message has the value and the rule. During a run the
error carries the rows and transitions up to that point in ``.trace``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.integrate

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    Prescribed,
    Slider,
    State,
    Stribeck,
    Trace,
    simulate,
)
from gms_fsm.errors import ChartError, GMSError, ParameterError
from gms_fsm.traces.failures import LivelockError, NotFiniteError, SimulationError, StepSizeError
from tests.corpus import BOTH_WAYS, SELF_LOOP, flow_of, go
from tests.helpers import FASTEST, open_loop, pulled_mass, stick_slip

CURVE = Stribeck(1.0, 1.5, 1e-3)


# --------------------------------------------------------------------------- before the run
def _wrong(argument: str, value: Any, *words: str) -> Any:
    return pytest.param({argument: value}, words, id=f"{argument}={value!r}"[:40])


ARGUMENTS = [
    _wrong("t_end", 0.0, "t_end is 0.0", "t_start is 0.0", "later"),
    _wrong("t_end", -1.0, "t_end is -1.0", "later"),
    _wrong("t_end", float("nan"), "t_end is nan", "finite"),
    _wrong("t_end", float("inf"), "t_end is inf", "finite"),
    _wrong("t_end", "long", "t_end is 'long'", "a number"),
    _wrong("t_end", None, "t_end is None", "a number"),
    _wrong("t_start", 1.0, "t_start is 1.0", "later"),
    _wrong("t_start", "now", "t_start is 'now'", "a number"),
    _wrong("method", "rk5", "'rk5'", "euler", "heun", "rk4", "bs23", "dp45", "OdeSolver"),
    _wrong("method", 5, "method is 5", "dp45", "OdeSolver"),
    _wrong("method", None, "method is None", "dp45"),
    _wrong("method", dict, "dict", "OdeSolver"),
    _wrong("method", "rk4", "'rk4'", "step=", "'dp45'"),
    _wrong("method", "heun", "'heun'", "step=", "'dp45'"),
    _wrong("method", "euler", "'euler'", "step=", "'dp45'"),
    _wrong("step", 0, "step is 0.0", "> 0"),
    _wrong("step", -0.1, "step is -0.1", "> 0"),
    _wrong("step", float("nan"), "step is nan", "finite"),
    _wrong("step", "big", "step is 'big'", "a number"),
    _wrong("rtol", 0, "rtol is 0.0", "> 0"),
    _wrong("rtol", -1e-6, "rtol is -1e-06", "> 0"),
    _wrong("rtol", "fine", "rtol is 'fine'", "a number"),
    _wrong("atol", 0, "atol is 0.0", "> 0"),
    _wrong("atol", float("nan"), "atol is nan", "finite"),
    _wrong("max_step", 0, "max_step is 0", "> 0"),
    _wrong("max_step", -1, "max_step is -1", "> 0"),
    _wrong("max_step", float("nan"), "max_step is nan"),
    _wrong("max_step", "x", "max_step is 'x'"),
    _wrong("max_step", None, "max_step is None"),
    _wrong("events", "never", "events is 'never'", "'located'", "'step'"),
    _wrong("events", None, "events is None", "'located'", "'step'"),
    _wrong("events", "step", "events='step'", "step=", "max_step"),
    _wrong("engine", "turbo", "engine is 'turbo'", "'machines'", "'ifelse'"),
    _wrong("t_eval", [], "t_eval"),
    _wrong("t_eval", [0.0, 2.0], "t_eval", "2.0", "t_end = 1.0"),
    _wrong("t_eval", [-0.5, 0.5], "t_eval", "-0.5", "t_start = 0.0"),
    _wrong("t_eval", [0.1, 0.5, 0.2], "t_eval[1] = 0.5", "t_eval[2] = 0.2", "increase"),
    _wrong("t_eval", [0.1, 0.5, 0.5], "t_eval[1] = 0.5", "t_eval[2] = 0.5", "increase"),
    _wrong("t_eval", [0.1, float("nan")], "t_eval", "finite"),
    _wrong("t_eval", 0.5, "t_eval", "flat list"),
    _wrong("t_eval", [[0.1, 0.2]], "t_eval", "flat list"),
    _wrong("t_eval", ["a"], "t_eval", "a"),
    _wrong("t_eval", "often", "t_eval", "often"),
    _wrong("initial", {"q": [1]}, "'q'", "'x', 'z', 'states'"),
    _wrong("initial", {"z": [1.0]}, "initial['z'] has 1 entries", "4 elements"),
    _wrong("initial", {"z": [1.0] * 5}, "initial['z'] has 5 entries", "4 elements"),
    _wrong("initial", {"z": 1.0}, "initial['z'] has shape ()"),
    _wrong("initial", {"z": [[0.0] * 4]}, "initial['z'] has shape (1, 4)"),
    _wrong("initial", {"z": [0, 0, float("nan"), 0]}, "initial['z'][2]", "nan", "finite"),
    _wrong("initial", {"z": ["a"] * 4}, "initial['z']", "numbers"),
    _wrong("initial", {"v": 1.0}, "'v' = 1.0", "prescribes the velocity"),
    _wrong("initial", {"x": "far"}, "initial['x'] is 'far'", "a number"),
    _wrong("initial", {"states": "stick"}, "initial['states'] is 'stick'", "4 state names"),
    _wrong("initial", {"states": ["stick"] * 3}, "initial['states']", "4 state names"),
    _wrong("initial", {"states": None}, "initial['states'] is None", "4 state names"),
    _wrong("initial", {"states": 4}, "initial['states'] is 4", "4 state names"),
    _wrong("initial", {"states": ["stick"] * 3 + ["glue"]}, "'glue'", "'stick', 'slip'"),
    _wrong("initial", {"states": [0, 0, 0, 0]}, "'0'", "'stick', 'slip'"),
    _wrong("initial", 5, "initial", "5"),
    _wrong("initial", [1.0] * 4, "initial"),
]


@pytest.mark.parametrize(("changes", "words"), ARGUMENTS)
def test_a_wrong_argument_is_refused_with_its_value_and_rule(
    changes: dict[str, Any], words: tuple[str, ...]
) -> None:
    arguments = {"t_end": 1.0, **changes}
    with pytest.raises((ParameterError, ChartError)) as caught:
        simulate(stick_slip("signed"), Prescribed("0.2"), **arguments)
    for word in words:
        assert word in str(caught.value)
    assert not isinstance(caught.value, SimulationError)


@pytest.mark.parametrize("argument", ["step", "max_step"])
def test_steps_below_the_resolution_of_the_clock_are_refused(argument: str) -> None:
    class TooMany(Exception):
        pass

    def watch(_: object) -> None:
        calls.append(0)
        if len(calls) > 20:
            raise TooMany("it would never end")

    calls: list[int] = []
    # Ten ticks of the clock, so that counting through them ends.
    with pytest.raises(GMSError, match=rf"{argument}|resolution of the clock"):
        simulate(
            stick_slip("signed"),
            Prescribed("0.2"),
            1.0 + 1e-14,
            t_start=1.0,
            progress=watch,
            **{argument: 1e-20},
        )


# --------------------------------------------------------------------------- during the run
def _failed(error: type[SimulationError], *args: Any, **options: Any) -> SimulationError:
    with pytest.raises(error) as caught:
        simulate(*args, **options)
    assert isinstance(caught.value.trace, Trace)
    assert "kept" in str(caught.value)
    return caught.value


@pytest.mark.parametrize("rows", [None, [0.0, 1.0, 5.0, 7.0, 20.0]], ids=["steps", "t_eval"])
def test_guards_that_hold_both_ways_are_a_livelock(rows: Any) -> None:
    error = _failed(LivelockError, BOTH_WAYS, Prescribed("0.15"), 20.0, t_eval=rows)
    t = 1.0 / 0.15  # s = 1 away from v = 0: element 2 is the first on its threshold
    for word in [
        "element 2 at t = 6.66666666",
        "switched 100 times",
        "stick",
        "slip",
        "z = 1,",
        "s = 1,",
    ] + ["v = 0.15", "that of break_away, [abs(z) >= s and abs(v) <= v_c]", "exclude each other"]:
        assert word in str(error)
    trace = error.trace
    if rows is None:
        assert trace.t[-1] == pytest.approx(t, abs=1e-9)
        assert trace.z[0].tolist() == [0.0, 0.0]
        assert trace.microstep[-1] >= 99
    else:
        assert trace.t.tolist() == [0.0, 1.0, 5.0]
    np.testing.assert_allclose(trace.z[:, 0], 0.15 * trace.t, atol=1e-9)
    assert 99 <= len(trace.transitions) <= 101
    assert set(trace.transitions.element.tolist()) == {1}
    np.testing.assert_allclose(trace.transitions.t, t, atol=1e-9)


def test_with_events_at_steps_the_same_chart_flips_but_time_advances() -> None:
    trace = simulate(BOTH_WAYS, Prescribed("0.15"), 8.0, events="step", step=0.01)
    assert trace.t[-1] == 8.0
    assert len(trace.transitions) > 50


def test_a_self_loop_whose_guard_stays_true_is_a_livelock() -> None:
    error = _failed(LivelockError, SELF_LOOP, Prescribed("0.5"), 5.0)
    for word in ("element 2", "'again'", "from stick to stick", "z >= s"):
        assert word in str(error)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"method": "bs23", "rtol": 1e-4},
        {"events": "step", "max_step": 0.05},
        {"method": scipy.integrate.RK45, "atol": 1e-9},
        {"method": scipy.integrate.Radau, "rtol": 1e-4, "atol": 1e-9},
    ],
    ids=["dp45", "bs23", "events by step", "scipy RK45", "scipy Radau"],
)
@pytest.mark.parametrize("rows", [None, [0.0, 0.5, 0.9, 1.5, 2.0]], ids=["steps", "t_eval"])
def test_a_flow_that_escapes_to_infinity_is_a_step_size_error(
    options: dict[str, Any], rows: Any
) -> None:
    # z' = z^2, z(0) = 1: z = 1/(1 - t) diverges at t = 1.
    error = _failed(
        SimulationError,
        flow_of("z * z"),
        Prescribed("0"),
        2.0,
        t_eval=rows,
        initial={"z": [0.1, 1.0]},
        **options,
    )
    assert isinstance(error, StepSizeError | NotFiniteError)
    trace = error.trace
    if isinstance(error, StepSizeError):
        for word in ("step size", "Radau", "rtol", "t = 1.0"):
            assert word in str(error)
    if rows is None:
        assert 0.99 < trace.t[-1] < 1.001
    else:
        assert trace.t.tolist() == [0.0, 0.5, 0.9]
    early = trace.t < 0.95
    np.testing.assert_allclose(trace.z[early, 1], 1 / (1 - trace.t[early]), rtol=2e-2)


@pytest.mark.parametrize("guard", ["0 / (z - z) > 0", "sqrt(-1 - z) > 0", "z - z < 0 / (z - z)"])
def test_a_guard_that_cannot_be_computed_is_a_simulation_error(guard: str) -> None:
    model = go(guard)
    error = _failed(SimulationError, model, Prescribed("0.1"), 1.0)
    assert len(error.trace) <= 1
    assert "compares NaN" in str(error)


def test_an_output_that_is_infinite_is_shown_as_infinite() -> None:
    chart = Chart("loud", ("v",), ("z",), (), (State("on", {"z": "v"}),), (), {"F": "1 / (1 - z)"})
    model = ChartModel(chart, {}, n=1, stribeck=CURVE)
    trace = simulate(model, Prescribed("1"), 2.0, initial={"z": [1.0]})
    assert np.isinf(trace.F[0])
    assert np.isfinite(trace.F[1:]).all()


@pytest.mark.slow
def test_transitions_before_the_failure_are_kept() -> None:
    model = stick_slip("signed")
    record = (np.linspace(0, 35, 3501), 0.2 * np.sin(2 * np.pi * np.linspace(0, 35, 3501) / 20))
    error = _failed(SimulationError, model, Prescribed(record), 61.0)
    whole = simulate(model, Prescribed(record), 35.0)
    assert len(whole.transitions) > 8
    np.testing.assert_array_equal(error.trace.transitions, whole.transitions)
    np.testing.assert_array_equal(error.trace.F, whole.F)
    assert error.trace.settings["t_end"] == 61.0
    assert error.trace.sample([10.0]).z.shape == (1, 4)


def test_an_exception_from_the_progress_callback_is_passed_on() -> None:
    class Enough(Exception):
        pass

    seen: list[float] = []

    def watch(moment: Any) -> None:
        seen.append(moment.t)
        if moment.t > 10.0:
            raise Enough

    with pytest.raises(Enough):
        simulate(stick_slip("signed"), open_loop(), 61.0, progress=watch)
    assert seen == sorted(seen)
    assert seen[-2] <= 10.0 < seen[-1]


@pytest.mark.slow
def test_a_run_at_extreme_parameters_ends_or_fails_with_a_message() -> None:
    for k in (1e-8, 1e8):
        parameters = GMSParameters(
            [k], [0.0], [1.0], sigma_2=0.0, stribeck=Stribeck(1e-6, 1e6, 1e-9), v_c=1e-12
        )
        try:
            trace = simulate(
                GMS(parameters, law="signed"),
                Slider(1e-3, "sin(50*t)"),
                0.05,
                max_step=1e-2,
                engine=FASTEST,
            )
        except SimulationError as error:
            trace = error.trace
        assert np.isfinite(trace.F).all()


def test_initial_states_and_positions_are_the_first_row() -> None:
    model, rig = pulled_mass()
    trace = simulate(
        model,
        rig,
        0.1,
        initial={"x": 0.5, "v": 0.01, "z": [0, 0.001, 0.002, 0.003], "states": ["slip"] * 4},
    )
    assert (trace.x[0], trace.v[0]) == (0.5, 0.01)
    assert trace.z[0].tolist() == [0, 0.001, 0.002, 0.003]
    assert trace.states[0].tolist() == ["slip"] * 4


@pytest.mark.parametrize(
    "velocity", ["0.1*sqrt(3 - t)", "0.1*exp(-t)*sqrt(3 - t)", "exp(800*(t - 2.9))"]
)
def test_a_trial_step_outside_the_domain_does_not_end_the_run(velocity: str) -> None:
    """Python's sqrt, / and exp raise where IEEE arithmetic has no number; the run goes up to it."""
    with pytest.raises(SimulationError) as caught:
        simulate(stick_slip("published"), Prescribed(velocity), 10.0)
    end = 3.0 if "3 - t" in velocity else 2.9 + 709.8 / 800  # exp(709.8) overflows
    assert caught.value.trace.t[-1] == pytest.approx(end, abs=0.15 if "exp" in velocity else 1e-4)


def test_a_flow_that_is_not_finite_is_named_with_its_element() -> None:
    error = _failed(
        NotFiniteError, flow_of("v / (z - 1)"), Prescribed("1"), 2.0, initial={"z": [0.0, 1.0]}
    )
    assert "the flow of z in state on, [v / (z - 1)], is not finite in element 2" in str(error)


@pytest.mark.parametrize(
    ("model", "rig", "words"),
    [
        ("GMS", Prescribed("0"), ["model is 'GMS'", "GMS(parameters, law='signed')"]),
        (BOTH_WAYS, "0.1*t", ["rig is '0.1*t'", "Prescribed('0.1*sin(t)')"]),
        (Prescribed("0"), BOTH_WAYS, ["model is Prescribed("]),
    ],
    ids=["text for a model", "text for a rig", "the wrong way round"],
)
def test_arguments_that_are_not_a_model_or_a_rig_are_refused(
    model: Any, rig: Any, words: list[str]
) -> None:
    with pytest.raises(ParameterError) as caught:
        simulate(model, rig, 1.0)
    for word in words:
        assert word in str(caught.value)
