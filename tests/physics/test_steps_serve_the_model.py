"""A step does not switch inside, split what fires together, stop without need or lose bits."""

from __future__ import annotations

import math

import numpy as np
import pytest

import integrators
from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    Prescribed,
    PulledSlider,
    Record,
    State,
    Stribeck,
    simulate,
)
from gms_fsm.charts.registry import registered
from gms_fsm.lowering.program import lower
from gms_fsm.run.machines import IfElse
from integrators import advance
from tests.corpus import trace as run_of
from tests.helpers import FASTEST, FIG4_SINE, event_sequence, one_element, pulled_mass, stick_slip


# --------------------------------------------------------------------------- frozen states
@pytest.mark.parametrize("method", ["dp45", "rk4"])
def test_the_flow_sees_one_mode_per_step(method: str) -> None:
    """Every call of the flow between two firings has the same modes."""
    program = lower(*pulled_mass())
    modes: list[tuple[int, ...]] = []

    def flow(t, y, mode, held, p, dy):
        modes.append(tuple(mode))
        program.ieee["flow"](t, y, mode, held, p, dy)

    functions = {name: program.ieee[name] for name in ("flow_live", "arm", "margins", "normal")}
    shared = ("p", "held", "strict", "relations", "surfaces")
    equations = integrators.Equations(
        flow=flow, **functions, **{name: getattr(program, name) for name in shared}
    )
    step = 0.0501 if method == "rk4" else None
    y = [0.0] * program.layout.y.size
    options = integrators.LoopOptions(
        integrators.METHODS[method], step, 1e-6, [1e-9] * len(y), math.inf, 1.0, 100_000, True, None
    )
    arcs = firings = 0
    for event in integrators.run(equations, IfElse(program), 0.0, y, [0] * 4, 21.0, options):
        firings += isinstance(event, integrators.Firing)
        if isinstance(event, integrators.Arc):
            arcs += 1
            assert set(modes) <= {event.mode[:4]}  # followed by the surfaces' flags
        if not isinstance(event, integrators.Stop):
            modes.clear()
    assert firings > 10
    assert arcs > firings / 4


# --------------------------------------------------------------------------- at one instant
@pytest.mark.parametrize("law", ["signed", "published"])
def test_what_breaks_away_together_fires_as_one_set(law: str) -> None:
    """Fig. 4: all four at t = 4.91 s, in element order, as micro-steps with one-sided forces."""
    trace = simulate(stick_slip(law), Prescribed(FIG4_SINE), 6.0)
    assert event_sequence(trace) == [(i, "break_away_forward") for i in range(4)]
    t = trace.transitions.t
    assert (t == t[0]).all()
    rows = np.flatnonzero(trace.t == t[0])
    np.testing.assert_array_equal(rows, np.arange(rows[0], rows[0] + 5))
    np.testing.assert_array_equal(trace.microstep[rows], np.arange(5))
    for m, row in enumerate(rows):
        assert trace.states[row].tolist() == ["slip"] * m + ["stick"] * (4 - m)
    # z and x do not move; F steps by sigma_i (dz_slip - v), one element after the other.
    assert np.ptp(trace.z[rows], axis=0).tolist() == [0.0] * 4
    dz_slip = np.array([0.1, 0.05, 0.025, 1e-4]) * (1 - trace.z[rows[0]] / trace.s[rows[0]])
    steps = np.array([0.3, 0.4, 0.5, 0.6]) * (dz_slip - trace.v[rows[0]])
    np.testing.assert_allclose(np.diff(trace.F[rows]), steps, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(trace.transitions.F_before, trace.F[rows[:-1]])
    np.testing.assert_array_equal(trace.transitions.F_after, trace.F[rows[1:]])
    assert trace.microstep[rows[-1] + 1] == 0
    assert (trace.microstep[: rows[0]] == 0).all()


def test_at_the_start_of_a_run_too() -> None:
    start = {"z": [0.4, 0.1, 0.5, 0.4]}
    trace = simulate(stick_slip("signed"), Prescribed(0.2), 1.0, initial=start)
    assert event_sequence(trace) == [(i, "break_away_forward") for i in (0, 2, 3)]
    assert trace.t[:4].tolist() == [0.0] * 4
    assert trace.microstep[:5].tolist() == [0, 1, 2, 3, 0]
    assert trace.states[0].tolist() == ["stick"] * 4


# --------------------------------------------------------------------------- no stop without need
@pytest.mark.slow
@pytest.mark.parametrize(("law", "amplitude"), [("signed", 0.1), ("published", 5e-3)])
def test_sticking_makes_no_stops_at_reversals(law: str, amplitude: float) -> None:
    """20 waves below break-away: v passes v_c, 0 and -v_c 40 times and nothing stops there."""
    rig = Prescribed(f"{amplitude}*sin(2*pi*t + 0.3)")
    trace = simulate(stick_slip(law), rig, 20.0, t_eval=[20.0])
    assert len(trace.transitions) == 0
    # Landmarks of s(v) may be stops; the smallest is a considerable fraction of v_s = 1e-3 m/s.
    stop_v = amplitude * np.sin(2 * np.pi * trace.stops.t[1:] + 0.3)
    assert np.abs(stop_v).min(initial=np.inf) > 10e-6


@pytest.mark.parametrize("law", ["signed", "published"])
@pytest.mark.parametrize("z0", [0.3, 1.0, 1.8])
def test_settling_on_the_threshold_makes_no_stop(law: str, z0: float) -> None:
    """Constant v, C T / s = 200: z reaches s to the last bit; no stop, and few steps."""
    model, start = one_element(law, C=1.0), {"z": [z0], "states": ["slip"]}
    trace = simulate(model, Prescribed(0.4), 200.0, t_eval=[200.0], initial=start)
    assert trace.z[-1, 0] == pytest.approx(1.0, abs=1e-6)
    assert len(trace.stops) == 2  # the start and the end
    rows = simulate(model, Prescribed(0.4), 200.0, initial=start)
    assert len(rows) < 250  # explicit steps are limited by stability, not by stops


def test_a_threshold_that_moves_is_not_followed() -> None:
    """v wobbles inside the dip, and s with it; z crosses s twice per wave without a stop."""
    rig, T = Prescribed("0.05 + 0.03*sin(3*t)"), 40.0
    start, times = {"z": [1.2], "states": ["slip"]}, np.linspace(0.0, T, 2001)
    trace = simulate(one_element("signed", C=1.0), rig, T, t_eval=times, initial=start)
    assert np.count_nonzero(np.diff((trace.z >= trace.s)[:, 0])) > 30
    # Stops at landmarks of v are fine; none of them is where z meets s.
    v = 0.05 + 0.03 * np.sin(3 * trace.stops.t[1:])
    gap = trace.stops.y[1:, 1] - trace.model.stribeck(v)
    assert np.abs(gap).min(initial=np.inf) > 1e-6
    assert len(trace.transitions) == 0


def test_slipping_for_an_hour_costs_few_steps() -> None:
    """3,600 s at constant speed: the number of stops does not grow with time."""
    trace = simulate(one_element("signed", C=1e-3), Prescribed(0.1), 3600.0, t_eval=[3600.0])
    assert len(trace.transitions) == 1
    assert len(trace.stops) == 4  # the start, the break-away before and after, the end


@pytest.mark.slow
def test_of_many_elements_each_switch_costs_one_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps are aimed at the next of 2,000 break-aways; times and bits are those of other runs."""
    n = 2000
    w, share = np.linspace(0.0025, 0.0175, n), np.full(n, 1 / n)
    curve = Stribeck(1.0, 1.5, 0.05)
    friction = GMSParameters(share / w, share, np.full(n, 0.02), sigma_2=0.4, v_c=1e-6, weights=w,
                             stribeck=curve)  # fmt: skip
    bank, rig, t_end = GMS(friction, law="signed"), PulledSlider(1.0, 2.0, 0.1), 2.52
    tried, take_step = [], advance.take_step

    def counted(motion, method, now, t_new, scratch):
        tried.append(now.t)
        take_step(motion, method, now, t_new, scratch)

    with monkeypatch.context() as patch:
        patch.setattr(advance, "take_step", counted)
        trace = simulate(bank, rig, t_end, engine="ifelse")
    t = trace.transitions.t
    assert event_sequence(trace) == [(i, "break_away_forward") for i in range(7)]
    assert sum(begun >= t[0] for begun in tried) <= t.size + 2
    fine = simulate(bank, rig, t_end, engine=FASTEST, rtol=1e-9)
    np.testing.assert_allclose(t, fine.transitions.t, rtol=0, atol=1e-7)
    assert simulate(bank, rig, t_end, engine=FASTEST).transitions.t.tolist() == t.tolist()


def test_a_sign_that_turns_does_not_shorten_the_steps() -> None:
    """Adaptive runs stop once at the reversal of a slipping element, whose flow jumps there."""
    model, start = one_element("signed", F_s=1.0, v_s=1e-3, C=0.3), {"z": [3.0], "states": ["slip"]}
    for method in ("dp45", "bs23"):
        trace = simulate(model, Prescribed("0.4*cos(pi*t/2)"), 2.0, initial=start, method=method)
        assert len(trace.transitions) == 0
        assert len(trace) < 200


@pytest.mark.parametrize(("period", "rows"), [(2.5, 801), (2.0, 401), (1.0, 1001), (4.0, 801)])
def test_a_crossing_a_few_ticks_before_a_sample_is_no_reason_to_give_up(
    period: float, rows: int
) -> None:
    """A velocity made from positions is about 1e-17 m/s at the turning points, not 0.

    Its sign changes just before the sample, and what is left is too short for a usual first step.
    """
    t = np.linspace(0.0, 20.0, rows)
    x = 1e-3 * np.sin(2.0 * np.pi * t / period)
    v = Record.from_arrays(time=t, position=x).motion().velocity
    model = ChartModel(registered()["maxwell-slip"].chart(""), {"k": 1e4, "F_c": 1.0})
    run = simulate(model, Prescribed((t, v)), 20.0, engine=FASTEST, t_eval=t)
    turns = sum(edge.startswith("turn") for edge in run.transitions.edge)
    assert turns == round(20.0 / (0.5 * period))  # one for each turning point
    assert np.abs(run.F).max() == pytest.approx(1.0, abs=1e-9)


# --------------------------------------------------------------------------- bits
def test_powers_are_products_to_the_last_bit() -> None:
    """Of the C library ``x**3`` is not ``x*x*x`` for many x: two engines would disagree."""
    chart = Chart(
        "cube", ("v",), ("z",), ("k",), (State("only", {"z": "v"}),), (), {"F": "k * z**3 + z**2"}
    )
    model = ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.5, 1e-3))
    trace = simulate(model, Prescribed("0.7*sin(t)+0.3"), 30.0, t_eval=np.linspace(0, 30, 3001))
    z = trace.z[:, 0].tolist()
    assert trace.F.tolist() == [1.0 * (u * u * u) + u * u for u in z]
    assert sum(u**3 != u * u * u for u in z) > 10


def test_sums_run_in_element_order() -> None:
    """F is ((F_1 + F_2) + F_3) + ... + sigma_2 v; another order gives other bits."""
    trace = run_of("pulled mass")
    forward, backward = np.zeros(len(trace)), np.zeros(len(trace))
    for i in range(trace.n):
        forward = forward + trace.F_elements[:, i]
        backward = backward + trace.F_elements[:, trace.n - 1 - i]
    np.testing.assert_array_equal(trace.F, forward + 0.4 * trace.v)
    assert (backward + 0.4 * trace.v != trace.F).any()
