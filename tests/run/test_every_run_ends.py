"""A run that makes no progress ends in an error that says why, with everything computed so far.

Before, chattering a little slower than the clock's resolution recorded millions of rows; a stiff
run was silent for a minute; one trial set of parameters kept a fit busy indefinitely.
"""

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
from gms_fsm.traces.failures import LivelockError, StepLimitError
from tests.helpers import FASTEST, ROOT, banging, pulled_mass, stick_slip
from tests.systems.test_sampled_controllers_tick_exactly import servo

ENGINES = ["machines", "ifelse", "compiled"]


def stiff(C: float) -> GMS:
    """One element whose deflection relaxes at the rate C / s."""
    p = GMSParameters(
        [4e6], [0], [C], sigma_2=250, stribeck=Stribeck(8, 9.5, 5e-4), v_c=7.3e-7, weights=[1 / 4e6]
    )
    return GMS(p, law="signed")


def needs(engine):
    if engine == "compiled":
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    return engine


@pytest.mark.parametrize("gap", [1e-9, 1e-8, 1e-7])
def test_chattering_below_the_tolerance_is_a_livelock(gap):
    """The state moves by less than the integrator resolves, a switch every 1e-9 of the time."""
    with pytest.raises(LivelockError, match="chattering") as caught:
        simulate(banging(gap), Prescribed("1"), 10.0, engine=FASTEST)
    assert len(caught.value.trace.transitions) < 2000


def test_fast_switching_that_makes_progress_is_not_a_livelock():
    """Some thousand switches a second, each by a step well above the tolerance."""
    trace = simulate(banging(1e-3), Prescribed("1"), 2.0, engine=FASTEST)
    assert len(trace.transitions) == 1000


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_switching_by_the_clock_is_not_a_livelock(engine):
    """Guards of t alone, while nothing moves at all."""
    chart = Chart(
        "blinker",
        inputs=("t",),
        variables=("z",),
        parameters=("w",),
        states=(State("on", flow={"z": "0"}), State("off", flow={"z": "0"})),
        transitions=(
            Transition("a", "on", "off", guard="sin(w * t) < 0"),
            Transition("b", "off", "on", guard="sin(w * t) > 0"),
        ),
        outputs={"F": "z"},
    )
    w = 2.0 * np.pi * 1000.0
    trace = simulate(
        ChartModel(chart, {"w": w}), Prescribed("0"), 0.5, engine=needs(engine), max_step=1e-4
    )
    assert len(trace.transitions) == pytest.approx(1000, abs=2)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_steps_of_a_run_are_limited(engine):
    model, rig = pulled_mass()
    with pytest.raises(StepLimitError, match="max_steps = 300 steps") as caught:
        simulate(model, rig, 60.0, engine=needs(engine), max_steps=300)
    part = caught.value.trace
    assert 0.0 < part.t[-1] < 60.0
    whole = simulate(model, rig, 60.0, engine=engine)
    count = int(np.searchsorted(whole.t, part.t[-1], side="right"))
    assert 100 < count < 400
    assert np.array_equal(whole.z[: count - 1], part.z[: count - 1])
    assert len(simulate(model, rig, 60.0, engine=engine, max_steps=100_000)) == len(whole)


def test_scipys_steps_are_limited_too():
    model, rig = pulled_mass()
    with pytest.raises(StepLimitError, match="max_steps = 50 steps"):
        simulate(model, rig, 60.0, method=Radau, max_steps=50)


@pytest.mark.parametrize("most", [700, 1300])
def test_the_limit_ends_every_engine_at_the_same_row(most):
    model, rig = stick_slip("signed"), Slider(1.0, "3*sin(2*t) + 0.5*sin(31*t)")
    how, ends = {"max_steps": most, "method": "bs23", "rtol": 1e-7}, []
    for engine in ("ifelse", needs("compiled")):
        with pytest.raises(StepLimitError) as caught:
            simulate(model, rig, 600.0, engine=engine, **how)
        trace = caught.value.trace
        assert len(trace) < most  # some were attempted in vain
        ends.append((len(trace), trace.t[-1]))
    assert ends[0] == ends[1]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_stiff_run_is_reported_after_a_few_thousand_steps(engine):
    """A rate of 1e8 /s allows steps of 4e-8 s: 3e8 of them for ten seconds."""
    with pytest.raises(
        StepLimitError, match=r"stiff: the flow has a rate of 8\.\d*e\+07 /s"
    ) as caught:
        simulate(stiff(200.0), Prescribed("1e-3*sin(t)"), 10.0, engine=needs(engine))
    for part in ("Radau", "max_steps is 1000000", "kept in .trace"):
        assert part in str(caught.value)
    assert len(caught.value.trace) < 30_000


def test_an_implicit_method_has_no_difficulty_with_it():
    trace = simulate(stiff(200.0), Prescribed("1e-3*sin(t)"), 10.0, method=Radau)
    assert len(trace.transitions) > 4
    assert len(trace) < 1000


def test_a_mildly_stiff_run_that_can_end_ends():
    trace = simulate(stiff(0.02), Prescribed("1e-3*sin(t)"), 2.0, engine="ifelse")
    assert trace.t[-1] == 2.0
    assert len(trace) > 5000


@pytest.mark.parametrize("engine", ["ifelse", "compiled"])
@pytest.mark.parametrize("output", [{"output": "end"}, {"t_eval": [5.0]}])
def test_the_verdict_is_the_same_with_any_output(output, engine):
    with pytest.raises(StepLimitError, match="stiff: the flow has a rate"):
        simulate(stiff(200.0), Prescribed("1e-3*sin(t)"), 10.0, engine=needs(engine), **output)


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
@pytest.mark.parametrize("output", ["all", "end"])
@pytest.mark.parametrize("C", [1e5, 1e6])
def test_a_run_that_is_stiff_at_first_and_then_rests_ends(C, output):
    """Nearly all steps are taken in the first seconds: 450,000 with C = 1e6."""
    trace = simulate(positioned(C), 40.0, engine=needs("compiled"), output=output)
    assert trace.t[-1] == 40.0
    assert len(trace.transitions) == 120


@pytest.mark.slow
def test_ticks_do_not_count_as_steps():
    """500,000 ticks take a million steps, which is the default limit."""
    trace = simulate(servo(), 500.0, engine=needs("compiled"), output="end")
    assert trace.t[-1] == 500.0
    with pytest.raises(
        StepLimitError, match="max_steps = 1 steps, besides 4 for each of 100 ticks"
    ):
        simulate(servo(), 0.1, engine="ifelse", max_steps=1, max_step=1e-4)


def test_a_session_ends_with_the_same_message():
    session = Session(stiff(200.0), Prescribed("1e-3*sin(t)"), 10.0, engine="ifelse")
    session.proceed()
    assert session.branch.failure.reason.startswith("stiff: the flow has a rate")


def test_a_scenario_takes_the_limit():

    from gms_fsm.app.scenario import load_scenario

    path = ROOT / "scenarios" / "pulled_mass.toml"
    assert load_scenario(path, ["run.max_steps=777"]).arguments["max_steps"] == 777
