"""limit_cycle finds the periodic motions that closed forms and long runs have."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gms_fsm import Belt, Body, ChartModel, Contact, PulledSlider, System, limit_cycle, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.errors import ParameterError
from tests.helpers import FASTEST, pulled_mass

pytestmark = pytest.mark.slow
F_C, F_S, K, V, M = 1.0, 1.5, 2.0, 0.1, 1.0
PAD = ChartModel(CHARTS["stiction"], {"F_c": F_C, "F_s": F_S, "b": 0.0})


def hunting() -> System:
    """A mass held by a PID controller, with stiction: the integral grows until it breaks away."""
    return System(
        "hunting",
        bodies=(Body("mass", inertia="m", force="-k_p * x - k_d * v - k_i * i"),),
        contacts=(Contact("pad", CHARTS["stiction"], {"F_c": 0.5, "F_s": 1.5, "b": 0.0}),),
        flow={"i": "x"},
        numbers={"m": 1.0, "k_p": 10.0, "k_d": 6.0, "k_i": 8.0},
    )


@pytest.mark.parametrize("rig", [Belt(M, K, V), PulledSlider(M, K, V)], ids=["belt", "pulled"])
def test_stick_slip_has_the_period_of_the_closed_form(rig):
    w = math.sqrt(K / M)
    drop = (F_S - F_C) / (K * V)
    period = 2.0 * drop + 2.0 / w * (math.pi - math.atan(drop * w))
    cycle = limit_cycle(PAD, rig, near=simulate(PAD, rig, 40.0, engine=FASTEST))
    assert abs(cycle.period / period - 1.0) < 1e-8
    assert np.abs(cycle.multipliers).max() < 1e-8
    assert cycle.stable
    assert cycle.residual < 1e-10
    assert cycle.iterations <= 8
    # It slips while it sticks nowhere else: over as much belt as has passed.
    assert cycle.energy.contacts["friction"] == pytest.approx(F_C * V * period, rel=1e-10)
    assert abs(cycle.energy.missing) < 1e-10 * cycle.energy.put_in
    assert sorted(edge.split("_")[0] for edge in cycle.trace.transitions.edge) == [
        "arrest",
        "release",
    ]


def test_multipliers_are_those_of_differences():
    near = simulate(*pulled_mass(), 60.0, engine=FASTEST)
    cycle = limit_cycle(*pulled_mass(), near=near)
    assert cycle.residual < 1e-10
    start, end = float(cycle.trace.t[0]), float(cycle.trace.t[-1])
    layout = cycle.trace.program.layout
    states = cycle.trace.states[0].tolist()
    names = ["x", "v", *(f"z{i + 1}" for i in range(4))]
    assert layout.y.size == len(names)

    def after(y):
        run = simulate(
            *pulled_mass(),
            end,
            t_start=start,
            initial={"x": y[0], "v": y[1], "z": y[2:], "states": states},
            engine=FASTEST,
            rtol=1e-12,
        )
        return run.rows.y[-1]

    sizes = np.abs(cycle.trace.rows.y).max(axis=0)
    M = np.empty((6, 6))
    for j in range(6):
        step = np.zeros(6)
        step[j] = 1e-6 * sizes[j]
        M[:, j] = (after(cycle.states + step) - after(cycle.states - step)) / (2.0 * step[j])
    found = np.linalg.eigvals(M)
    found = np.delete(found, np.argmin(np.abs(found - 1.0)))  # that of a shift along the cycle
    found = found[np.argsort(-np.abs(found))]
    assert np.abs(np.abs(found) - np.abs(cycle.multipliers)).max() < 1e-6


def test_hunting_of_a_controller_is_that_of_a_long_run():
    near = simulate(hunting(), 300.0, initial={"mass.x": 1.0}, engine=FASTEST, rtol=1e-10)
    cycle = limit_cycle(hunting(), near=near)
    log = near.transitions
    assert abs((log.t[-1] - log.t[-5]) / cycle.period - 1.0) < 1e-8
    assert sorted(cycle.trace.transitions.edge) == sorted(log.edge[-4:])
    assert cycle.stable
    assert not cycle.driven


@pytest.mark.parametrize(
    ("chart", "numbers"),
    [
        ("stiction", {"F_c": 0.5, "F_s": 0.7, "b": 0.2}),
        ("end-stop", {"x_s": 0.05, "e": 0.6, "v_r": 1e-3}),
    ],
)
def test_a_driven_motion_keeps_the_period_it_is_given(chart, numbers):
    pushed = System(
        "pushed",
        bodies=(Body("mass", inertia=1.0, force="3 * sin(2 * pi * t) - 20 * x - v"),),
        contacts=(Contact("pad", CHARTS[chart], numbers),),
    )
    cycle = limit_cycle(pushed, period=1.0)
    assert cycle.driven
    assert cycle.period == 1.0
    assert cycle.stable
    assert abs(cycle.energy.missing) < 1e-9 * cycle.energy.put_in
    x = cycle.trace.body("mass").x
    assert abs(x[-1] - x[0]) < 1e-9 * np.abs(x).max()


def test_a_state_of_rest_is_no_cycle():
    pad = ChartModel(CHARTS["stiction"], {"F_c": F_C, "F_s": F_S, "b": 0.1})
    near = simulate(pad, Belt(M, K, 2.0), 700.0, rtol=1e-9, engine=FASTEST)
    with pytest.raises(ParameterError, match="nothing moves"):
        limit_cycle(pad, Belt(M, K, 2.0), near=near, period=4.44)


@pytest.mark.parametrize("section", ["v > -0.05", "v < -0.1", "v < 0"])
def test_a_section_says_where_a_cycle_begins(section):
    near = simulate(PAD, Belt(M, K, V), 40.0, engine=FASTEST)
    cycle = limit_cycle(PAD, Belt(M, K, V), near=near, section=section)
    anywhere = limit_cycle(PAD, Belt(M, K, V), near=near)
    assert cycle.period == pytest.approx(anywhere.period, rel=1e-9)
    assert cycle.trace.v[0] == pytest.approx(float(section.split()[-1]), abs=1e-9)
    assert cycle.trace.v[-1] == pytest.approx(cycle.trace.v[0], abs=1e-8)
    assert cycle.states[1] == cycle.trace.rows.y[0, 1]
