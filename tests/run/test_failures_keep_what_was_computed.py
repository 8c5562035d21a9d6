"""A run that cannot continue says what happened and what to try, and keeps its results so far.

That all engines say and keep the same is in tests/laws/test_engines_agree.py; wrong arguments are
rows of tests/refusals.py.
"""

from __future__ import annotations

from dataclasses import replace
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
    Transition,
    simulate,
)
from gms_fsm.errors import GMSError
from gms_fsm.run.simulate import Moment
from gms_fsm.systems.parts import Body, Contact, Sampled
from gms_fsm.systems.springs import Spring
from gms_fsm.systems.system import System
from gms_fsm.traces.failures import LivelockError, NotFiniteError, SimulationError, StepLimitError
from tests.corpus import BOTH_WAYS, Run, flow_of, go, outcome
from tests.helpers import FASTEST, stick_slip
from tests.systems_cases import DRY, STICTION

SAID = {
    "livelock": [
        "element 2 at t = 6.66666666", "switched 100 times", "stick", "slip", "z = 1,", "s = 1,",
        "v = 0.15", "that of break_away, [abs(z) >= s and abs(v) <= v_c]", "exclude each other",
    ],
    "self-loop": ["element 2", "'again'", "from stick to stick", "z >= s"],
    "blow-up": ["step size", "Radau", "rtol", "t = 1.0"],
    "too many steps": ["max_steps = 300 steps"],
    "both sides lead away": ["it starts at v = 0, from where the flows on both sides lead away"],
    "a guard of NaN": ["compares NaN", "(x = 0, z1 = 0, z2 = 0)"],
    "an action of NaN": ["z of element 1 is not finite here", "assigned to it: [1 / (z - z)]"],
    "root of a negative": ["signal 'v', [0.1*sqrt(3 - t)], is not finite at t = 3 s"],
}  # fmt: skip


@pytest.mark.every(2)
@pytest.mark.parametrize("name", SAID)
def test_what_a_failure_says(name: str) -> None:
    for word in SAID[name]:
        assert word in outcome(name)[1]


def test_what_a_livelock_keeps() -> None:
    """Up to the switch that repeats, and a hundred of its firings."""
    trace, t = outcome("livelock")[0], 1.0 / 0.15
    assert trace is not None
    assert trace.t[-1] == pytest.approx(t, abs=1e-9)
    assert trace.microstep[-1] >= 99
    np.testing.assert_allclose(trace.z[:, 0], 0.15 * trace.t, atol=1e-9)
    assert len(trace.transitions) == 100
    assert set(trace.transitions.element.tolist()) == {1}
    np.testing.assert_allclose(trace.transitions.t, t, atol=1e-9)


def test_with_events_at_steps_the_same_chart_flips_but_time_advances() -> None:
    trace = simulate(BOTH_WAYS, Prescribed("0.15"), 8.0, events="step", step=0.01)
    assert trace.t[-1] == 8.0
    assert len(trace.transitions) > 50


@pytest.mark.parametrize("method", [None, scipy.integrate.RK45, scipy.integrate.Radau])
@pytest.mark.parametrize("rows", [None, [0.0, 0.5, 0.9, 1.5, 2.0]], ids=["steps", "t_eval"])
def test_a_flow_that_escapes_to_infinity_is_kept_up_to_there(method: Any, rows: Any) -> None:
    """z' = z^2, z(0) = 1: z = 1/(1 - t) diverges at t = 1."""
    how = {"initial": {"z": [0.1, 1.0]}, "t_eval": rows, "rtol": 1e-4}
    how |= {"method": method, "atol": 1e-9} if method else {}
    trace, said = Run((flow_of("z * z"), Prescribed("0")), 2.0, how).outcome()
    assert trace is not None
    assert said.startswith(("StepSizeError", "NotFiniteError"))
    if rows is None:
        assert 0.99 < trace.t[-1] < 1.001
    else:
        assert trace.t.tolist() == [0.0, 0.5, 0.9]
    early = trace.t < 0.95
    np.testing.assert_allclose(trace.z[early, 1], 1 / (1 - trace.t[early]), rtol=2e-2)


@pytest.mark.parametrize("guard", ["0 / (z - z) > 0", "sqrt(-1 - z) > 0", "z - z < 0 / (z - z)"])
def test_a_guard_that_cannot_be_computed_is_a_simulation_error(guard: str) -> None:
    trace, said = Run((go(guard), Prescribed("0.1")), 1.0).outcome()
    assert trace is not None
    assert len(trace) <= 1
    assert "compares NaN" in said


def test_a_flow_that_is_not_finite_is_named_with_its_element() -> None:
    how = {"initial": {"z": [0.0, 1.0]}}
    _, said = Run((flow_of("v / (z - 1)"), Prescribed("1")), 2.0, how).outcome()
    assert "the flow of z in state on, [v / (z - 1)], is not finite in element 2" in said


def test_an_output_that_is_infinite_is_shown_as_infinite() -> None:
    chart = Chart("loud", ("v",), ("z",), (), (State("on", {"z": "v"}),), (), {"F": "1 / (1 - z)"})
    trace = simulate(ChartModel(chart, {}), Prescribed("1"), 2.0, initial={"z": [1.0]})
    assert np.isinf(trace.F[0])
    assert np.isfinite(trace.F[1:]).all()


@pytest.mark.slow
@pytest.mark.parametrize("k", [1e-8, 1e8])
def test_a_run_at_extreme_parameters_ends_or_fails_with_a_message(k: float) -> None:
    curve = Stribeck(1e-6, 1e6, 1e-9)
    parameters = GMSParameters([k], [0.0], [1.0], sigma_2=0.0, stribeck=curve, v_c=1e-12)
    subject, how = (GMS(parameters, law="signed"), Slider(1e-3, "sin(50*t)")), {"max_step": 1e-2}
    trace, _ = Run(subject, 0.05, how).outcome(engine=FASTEST)
    assert trace is not None
    assert np.isfinite(trace.F).all()


@pytest.mark.parametrize(
    "velocity", ["0.1*sqrt(3 - t)", "0.1*exp(-t)*sqrt(3 - t)", "exp(800*(t - 2.9))"]
)
def test_a_trial_step_outside_the_domain_does_not_end_the_run(velocity: str) -> None:
    """Python's sqrt, / and exp raise where IEEE arithmetic has no number; the run goes up to it."""
    with pytest.raises(SimulationError) as caught:
        simulate(stick_slip("published"), Prescribed(velocity), 10.0)
    end = 3.0 if "3 - t" in velocity else 2.9 + 709.8 / 800  # exp(709.8) overflows
    assert caught.value.trace.t[-1] == pytest.approx(end, abs=0.15 if "exp" in velocity else 1e-4)


@pytest.mark.parametrize("argument", ["step", "max_step"])
def test_steps_below_the_resolution_of_the_clock_are_refused(argument: str) -> None:
    """In a run of ten ticks of the clock, so that counting through them would end."""
    seen: list[object] = []
    how = {"t_start": 1.0, "progress": seen.append, argument: 1e-20}
    with pytest.raises(GMSError, match=rf"{argument}|resolution of the clock"):
        simulate(stick_slip("signed"), Prescribed("0.2"), 1.0 + 1e-14, **how)
    assert len(seen) < 20


@pytest.mark.parametrize("method", [scipy.integrate.Radau, scipy.integrate.BDF])
def test_no_stiff_method_is_advised_where_one_is_used(method: Any) -> None:
    how = {"initial": {"z": [1.0, 1.0]}, "method": method, "atol": 1e-9}
    for steps, kind in ((100, "StepLimitError"), (10**6, "StepSizeError")):
        run = Run((flow_of("z * z"), Prescribed("0")), 2.0, how | {"max_steps": steps})
        said = run.outcome()[1]
        assert said.startswith(kind)
        assert "a larger rtol" in said
        assert "stiff" not in said


# --------------------------------------------------------------------------- several contacts
def _system(back: str) -> System:
    """Two bodies; the second has a chart that switches at v = 0.2, and back."""
    chart = Chart(
        "loop",
        states=(State("p", outputs={"F": "0"}), State("q", outputs={"F": "0"})),
        transitions=(Transition("go", "p", "q", "v > 0.2"), Transition("back", "q", "p", back)),
    )
    return System(
        "two",
        bodies=(
            Body("a", inertia=1.0, force="0.5", x="x1", v="v1"),
            Body("b", inertia=1.0, force="1", x="x2", v="v2"),
        ),
        contacts=(Contact("pad", STICTION, DRY, v="v1"), Contact("loop", chart, v="v2", n=2)),
    )


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"sampled": (Sampled("pid", period=0.1, updates={"e": "x2", "u": "k / e"}),)},
            "the update of u in sampled 'pid', [k / e], is not finite here "
            "(x1 = 0, v1 = 0, x2 = 0, v2 = 0, e = 0, u = inf)",
        ),
        (
            {"flow": {"i": "k / (i - i)"}},
            "the flow of i, [k / (i - i)], is not finite here (x1 = 0, v1 = 0, x2 = 0, v2 = 0, ",
        ),
        (
            {"springs": (Spring("shaft", "a", "b", k="k", rest="r"),), "signals": {"r": "k / t"}},
            "signal 'r', [k / t], is not finite at t = 0 s",
        ),
        (
            {
                "bodies": (
                    Body("a", inertia=1.0, x="x1", v="v1"),
                    Body("b", inertia=1.0, force="k / (x2 - x2)", x="x2", v="v2"),
                )
            },
            "the acceleration of body 'b', with the force [k / (x2 - x2)], is not finite here",
        ),
    ],
)
def test_what_is_not_finite_in_a_system_is_named_with_its_text(
    changes: dict[str, Any], said: str
) -> None:
    system = replace(_system("v > 0.1"), numbers={"k": 2.0}, **changes)
    for engine in ("ifelse", FASTEST):
        with pytest.raises(NotFiniteError) as caught:
            simulate(system, 1.0, engine=engine)
        assert said in str(caught.value)


@pytest.mark.parametrize("engine", ["machines", "ifelse"])
def test_a_failure_names_the_contact_and_its_element(engine: str) -> None:
    with pytest.raises(LivelockError, match=r"^loop 1 at t = 0\.2") as caught:
        simulate(_system("v > 0.1"), 1.0, engine=engine)
    assert "[v > 0.1] and that of go, [v > 0.2], hold together" in str(caught.value)
    with pytest.raises(StepLimitError, match="max_steps = 3"):
        simulate(_system("v > 9"), 1.0, engine=engine, max_steps=3)


def test_a_moment_has_the_values_of_each_contact() -> None:
    seen: list[Moment] = []
    simulate(_system("v > 9"), 1.0, engine="ifelse", progress=seen.append)
    last = seen[-1]
    assert last.states == ["stuck", "q", "q"]
    assert last.values["pad.F"] == pytest.approx(0.5)
    assert last.values["loop.v"] == pytest.approx(last.t)
