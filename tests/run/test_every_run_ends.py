"""A run that makes no progress ends in an error that says why, with everything computed so far.

Before, chattering a little slower than the clock's resolution recorded millions of rows; a stiff
run was silent for a minute; one trial set of parameters kept a fit busy indefinitely.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from scipy.integrate import Radau

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    Prescribed,
    Session,
    Slider,
    State,
    Stribeck,
    System,
    Transition,
    simulate,
)
from gms_fsm.app.scenario import load_scenario
from gms_fsm.traces.failures import LivelockError, StepLimitError
from tests.corpus import ENGINES
from tests.helpers import FASTEST, ROOT, banging, pulled_mass, stick_slip
from tests.systems.test_sampled_controllers_tick_exactly import servo
from tests.traces.test_monitors_see_what_happens import SLOWING, memoryless

BOTH = sorted({"ifelse", FASTEST})
SLOW = Prescribed("1e-3*sin(t)")


# --------------------------------------------------------------------------- chattering
@pytest.mark.parametrize("gap", [1e-9, 1e-8, 1e-7])
def test_chattering_below_the_tolerance_is_a_livelock(gap: float) -> None:
    """The state moves by less than the integrator resolves, a switch every 1e-9 of the time."""
    with pytest.raises(LivelockError, match="chattering") as caught:
        simulate(banging(gap), Prescribed("1"), 10.0, engine=FASTEST)
    assert len(caught.value.trace.transitions) < 2000


def test_fast_switching_that_makes_progress_is_not_a_livelock() -> None:
    """Some thousand switches a second, each by a step well above the tolerance."""
    trace = simulate(banging(1e-3), Prescribed("1"), 2.0, engine=FASTEST)
    assert len(trace.transitions) == 1000


@pytest.mark.slow
@pytest.mark.parametrize("engine", BOTH)
def test_switching_by_the_clock_is_not_a_livelock(engine: str) -> None:
    """Guards of t alone, while nothing moves at all."""
    states = State("on", flow={"z": "0"}), State("off", flow={"z": "0"})
    edges = (
        Transition("a", "on", "off", guard="sin(w * t) < 0"),
        Transition("b", "off", "on", guard="sin(w * t) > 0"),
    )
    model = ChartModel(
        Chart("blinker", ("t",), ("z",), ("w",), states, edges, {"F": "z"}), {"w": 2000.0 * np.pi}
    )
    trace = simulate(model, Prescribed("0"), 0.2, engine=engine, max_step=1e-4)
    assert len(trace.transitions) == pytest.approx(400, abs=2)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("weights", "element", "t"), [([0.5], 1, 2.8799), ([0.5, 0.4], 2, 2.1626)])
def test_guards_without_memory_name_the_element_that_chatters(
    weights: list[float], element: int, t: float, engine: Any
) -> None:
    """Two that chatter together advance the clock by a few ticks: the run would never end."""
    with pytest.raises(LivelockError) as caught:
        simulate(memoryless(weights), SLOWING, 10.0, engine=engine)
    text, trace = str(caught.value), caught.value.trace
    log = trace.transitions[trace.transitions.element == element - 1]
    assert trace.t[-1] == pytest.approx(t, abs=1e-4)
    assert 50 <= len(log) <= 100
    assert 0.0 < log.t[-1] - log.t[0] < 1e-8
    for part in (
        f"switched {len(log)} times in ",
        f"element {element} at t = {t}",
        "chattering",
        f"last by '{log.edge[-1]}' from {log.source[-1]} to {log.target[-1]}",
        "by a gap",
    ):
        assert part in text
    assert not re.search("sliding mode|shrink", text)


def test_earlier_switches_are_not_counted() -> None:
    """At the start it arrests, seconds before it chatters."""
    with pytest.raises(LivelockError) as caught:
        simulate(memoryless([0.5]), SLOWING, 10.0, initial={"states": ["slip"]})
    log = caught.value.trace.transitions
    assert log.t[0] == 0.0
    assert f"switched {len(log) - 1} times in {log.t[-1] - log.t[1]:.3g} s" in str(caught.value)


# --------------------------------------------------------------------------- bounces
GRAVITY, THROWN = 9.81, 2.0  # m/s^2 towards the stop, m/s away from it
HIT = "x >= 0 and v > 0"


def bounced(*edges: Transition, e: float) -> LivelockError:
    """Throw a ball away from a rigid stop at x = 0 that has restitution and no state of rest."""
    names = {name for edge in edges for name in edge.source.split()}
    states = tuple(State(name, outputs={"F": "0"}) for name in sorted(names))
    chart = Chart("ball", ("x", "v"), parameters=("e",), states=states, transitions=edges)
    model, rig = ChartModel(chart, {"e": e}), Slider(1.0, str(GRAVITY))
    with pytest.raises(LivelockError) as caught:
        simulate(model, rig, 100.0, initial={"v": -THROWN}, engine="ifelse")
    return caught.value


@pytest.mark.parametrize("e", [0.005, 0.2, 0.5, 0.95])
def test_the_factor_is_the_restitution_and_the_end_the_sum_of_all_flights(e: float) -> None:
    """It used to say that the flows on both sides of the guard push back."""
    error = bounced(Transition("bounce", "free", "free", HIT, actions={"v": "-e * v"}), e=e)
    said = r"each to ([\d.e-]+) of the one before, and end at t = ([\d.]+) s"
    ((factor, end),) = re.findall(said, str(error))
    assert float(factor) == pytest.approx(e, rel=1e-4)
    assert float(end) == pytest.approx(2.0 * THROWN / GRAVITY / (1.0 - e), rel=1e-8)
    assert "a state of rest is missing" in error.reason
    assert "locked state" in error.advice
    assert "rest speed" in error.advice
    assert error.place == "element 1"
    assert "push back" not in str(error)


def test_two_restitutions_in_turn_are_one_sequence() -> None:
    """A stop that is hard and soft in turn: every second interval is 0.36 of the one before."""
    hard = Transition("hard", "a", "b", HIT, actions={"v": "-e * v"})
    error = bounced(hard, Transition("soft", "b", "a", HIT, actions={"v": "-0.9 * v"}), e=0.4)
    end = 2.0 * THROWN / GRAVITY * (1.0 + 0.4) / (1.0 - 0.4 * 0.9)
    assert "each to 0.6 of the one before" in str(error)
    assert f"end at t = {end:.9g}" in str(error)


# --------------------------------------------------------------------------- too many steps
@pytest.mark.slow
def test_the_steps_of_a_run_are_limited() -> None:
    """Every engine ends at the same row: tests/laws/test_engines_agree.py."""
    model, rig = pulled_mass()
    with pytest.raises(StepLimitError, match="max_steps = 300 steps") as caught:
        simulate(model, rig, 60.0, max_steps=300)
    part, whole = caught.value.trace, simulate(model, rig, 60.0)
    count = int(np.searchsorted(whole.t, part.t[-1], side="right"))
    assert 100 < count < 400
    assert np.array_equal(whole.z[: count - 1], part.z[: count - 1])
    assert len(simulate(model, rig, 60.0, max_steps=100_000)) == len(whole)
    with pytest.raises(StepLimitError, match="max_steps = 50 steps"):
        simulate(model, rig, 60.0, method=Radau, max_steps=50)


def test_attempts_in_vain_count_too_in_every_engine() -> None:
    model, rig = stick_slip("signed"), Slider(1.0, "3*sin(2*t) + 3*tanh(200*sin(9*t))")
    ends = []
    for engine in BOTH:
        how = {"max_steps": 700, "method": "bs23", "rtol": 1e-7, "engine": engine}
        with pytest.raises(StepLimitError) as caught:
            simulate(model, rig, 600.0, **how)
        ends.append((len(caught.value.trace), caught.value.trace.t[-1]))
        assert len(caught.value.trace) < 700
    assert ends[0] == ends[-1]


def stiff(C: float) -> GMS:
    """One element whose deflection relaxes at the rate C / s."""
    curve = Stribeck(8, 9.5, 5e-4)
    parameters = GMSParameters(
        [4e6], [0], [C], sigma_2=250, stribeck=curve, v_c=7.3e-7, weights=[1 / 4e6]
    )
    return GMS(parameters, law="signed")


@pytest.mark.every(3)
@pytest.mark.slow
@pytest.mark.parametrize("output", [{}, {"output": "end"}, {"t_eval": [5.0]}])
@pytest.mark.parametrize("engine", BOTH)
def test_a_stiff_run_is_reported_after_a_few_thousand_steps(
    engine: Any, output: dict[str, Any]
) -> None:
    """A rate of 1e8 /s allows steps of 4e-8 s: 3e8 of them for ten seconds."""
    with pytest.raises(
        StepLimitError, match=r"stiff: the flow has a rate of 8\.\d*e\+07 /s"
    ) as caught:
        simulate(stiff(200.0), SLOW, 10.0, engine=engine, **output)
    for part in ("Radau", "max_steps is 1000000", "kept in .trace"):
        assert part in str(caught.value)
    assert len(caught.value.trace) < 30_000


def test_an_implicit_method_has_no_difficulty_with_it() -> None:
    trace = simulate(stiff(200.0), SLOW, 10.0, method=Radau)
    assert len(trace.transitions) > 4
    assert len(trace) < 1000


def test_a_mildly_stiff_run_that_can_end_ends() -> None:
    trace = simulate(stiff(0.02), SLOW, 2.0, engine=FASTEST)
    assert trace.t[-1] == 2.0
    assert len(trace) > 5000


@pytest.mark.slow
def test_a_session_ends_with_the_same_message_and_a_scenario_takes_the_limit() -> None:
    session = Session(stiff(200.0), SLOW, 10.0, engine=FASTEST)
    session.proceed()
    assert session.branch.failure.reason.startswith("stiff: the flow has a rate")
    path = ROOT / "gms_fsm/scenarios" / "pulled_mass.toml"
    assert load_scenario(path, ["run.max_steps=777"]).arguments["max_steps"] == 777


def positioned(C: float) -> System:
    """A mass that a PID controller moves by 2 mm in a second, and that then hunts rarely."""
    k, share = np.array([4e4, 3e4, 2e4, 1e4]), np.array([0.4, 0.3, 0.2, 0.1])
    curve = Stribeck(1.0, 1.5, 1e-3)
    bank = GMSParameters(
        k, np.zeros(4), C * share / k, v_c=1e-6, weights=share / k, sigma_2=0.0, stribeck=curve
    )
    return System(
        "positioned",
        bodies=(Body("m", inertia=1.0, force="400 * (2e-3 - x) + 500 * I - 40 * v", x="x", v="v"),),
        contacts=(Contact("friction", GMS(bank, law="signed"), v="v"),),
        flow={"I": "2e-3 - x"},
    )


@pytest.mark.slow
@pytest.mark.parametrize(("C", "output"), [(1e6, "all"), (1e5, "end")])
def test_a_run_that_is_stiff_at_first_and_then_rests_ends(C: float, output: Any) -> None:
    """Nearly all steps are taken in the first seconds: 450,000 with C = 1e6."""
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    trace = simulate(positioned(C), 40.0, engine="compiled", output=output)
    assert trace.t[-1] == 40.0
    assert len(trace.transitions) == 120


@pytest.mark.matrix
@pytest.mark.slow
def test_ticks_do_not_count_as_steps() -> None:
    """500,000 ticks take a million steps, which is the default limit."""
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    trace = simulate(servo(), 500.0, engine="compiled", output="end")
    assert trace.t[-1] == 500.0
    said = "max_steps = 1 steps, besides 4 for each of 100 ticks"
    with pytest.raises(StepLimitError, match=said):
        simulate(servo(), 0.1, engine="ifelse", max_steps=1, max_step=1e-4)
