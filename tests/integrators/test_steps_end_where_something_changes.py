"""Steps end on corners and jumps, on pulses between their stages, and see what moves at rest.

Once a run with `F = "F_c * sgn(v)"` reached t = 0.015 of 5 s; a pulse was jumped over, and x was
0.010 m instead of 0.060 m; and a guard v > 0 was taken for true on the surface v = 0 itself.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    FrictionState,
    Prescribed,
    Slider,
    State,
    System,
    Transition,
    simulate,
)
from gms_fsm.language import parse_value
from gms_fsm.lowering.program import lower
from gms_fsm.lowering.pulses import waking_times
from gms_fsm.systems.signals import as_signal
from tests.corpus import ENGINES
from tests.helpers import FASTEST, one_element, other_parts, pulled_mass


def force(text: str, **parameters: float) -> ChartModel:
    chart = Chart(
        "a force",
        inputs=("v", "x", "t"),
        variables=("z",),
        parameters=tuple(parameters),
        states=(State("on", flow={"z": "v"}),),
        outputs={"F": text},
    )
    return ChartModel(chart, parameters)


# --------------------------------------------------------------------------- corners
class Buffer:
    """A mass that meets a spring at x = gap; the chart has its own parameter `gap`."""

    title = "mass and buffer"
    acceleration = "(push - stiffness * max(x - gap, 0) - F) / mass"

    def __init__(self) -> None:
        self.signals = {"push": as_signal("0")}
        self.numbers = {"mass": 1.0, "stiffness": 100.0, "gap": 0.5}


def test_steps_end_exactly_on_a_buffer_in_a_rigs_equation() -> None:
    """Free flight at 1 m/s, half a swing of 10 rad/s in the spring, flight back."""
    model = force("0 * gap", gap=7.0)
    trace = simulate(model, Buffer(), 2.0, initial={"v": 1.0}, rtol=1e-9)
    assert np.abs(trace.t - 0.5).min() < 1e-12
    assert np.abs(trace.t - (0.5 + np.pi / 10)).min() < 1e-8
    assert trace.v[-1] == pytest.approx(-1.0, abs=1e-8)
    assert trace.x[-1] == pytest.approx(0.5 - (2.0 - 0.5 - np.pi / 10), abs=1e-8)


@pytest.mark.parametrize(
    "text", ["c * abs(x - 0.3)", "c * max(x, 0.3)", "min(c * z, 0.3)", "c * abs(dz - 0.5 * x)"]
)
def test_corners_of_an_output_are_rows(text: str) -> None:
    model, rig, start = force(text, c=1.0), Slider(1.0, "2"), {"v": 0.1}
    trace = simulate(model, rig, 1.0, initial=start, engine="machines")
    assert "0.3" not in text or np.abs(trace.x - 0.3).min() < 1e-14
    assert other_parts(trace, simulate(model, rig, 1.0, initial=start, engine="ifelse")) == []


def test_in_open_loop_the_jump_of_a_force_is_a_row() -> None:
    trace = simulate(force("c * sgn(v)", c=2.0), Prescribed("cos(t)"), 3.0)
    (row,) = np.flatnonzero(np.diff(np.sign(trace.F)) < 0)
    assert trace.t[row + 1] == pytest.approx(np.pi / 2, abs=1e-12)


def test_names_of_chart_and_rig_are_kept_separate() -> None:
    """A chart's own mass is not the rig's, neither in a corner of one nor of the other."""
    model = force("abs(z - mass)", mass=0.4)
    assert "z - mass_" in lower(model, Slider(2.0, "1")).source
    trace = simulate(model, Slider(2.0, "1"), 2.0)
    assert np.abs(trace.x - 0.4).min() < 1e-13


# With the sign at the corner frozen through the step, abs(u) would become negative beyond it, where
# a root is not defined: text, the same in Python, and the corners.
ROOTS = {
    "sqrt(abs(cos(t)))": (lambda t: math.sqrt(abs(math.cos(t))), np.pi / 2 + np.pi * np.arange(3)),
    "abs(sin(t))**0.5": (lambda t: math.sqrt(abs(math.sin(t))), np.pi * np.arange(1, 4)),
    "max(0, sin(t))**1.5": (lambda t: max(0.0, math.sin(t)) ** 1.5, np.pi * np.arange(1, 4)),
    "sqrt(2 - min(2, t)) - 1": (lambda t: math.sqrt(2.0 - min(2.0, t)) - 1.0, [2.0]),
    "sqrt(abs(abs(t - 3) - 1))": (
        lambda t: math.sqrt(abs(abs(t - 3.0) - 1.0)), [2.0, 3.0, 4.0],
    ),
}  # fmt: skip


@pytest.mark.parametrize("text", ROOTS)
def test_over_a_corner_under_a_root_z_is_the_integral_of_v(text: str) -> None:
    v, corners = ROOTS[text]
    model = one_element("signed", F_c=100.0, F_s=100.0, v_s=1.0)  # it never breaks away
    trace = simulate(model, Prescribed(text), 10.0, rtol=1e-8, atol=1e-10)
    expected = sum(quad(v, a, b)[0] for a, b in pairwise([0.0, *corners, 10.0]))
    assert trace.z[-1, 0] == pytest.approx(expected, abs=1e-5)


# --------------------------------------------------------------------------- jumps of a signal
def test_at_a_jump_the_left_value_is_used_before_and_the_right_value_after() -> None:
    """Stick integrates v exactly, so a step in v leaves no error at all, whatever the step."""
    rig = Prescribed([(0, 0.1), (1.05, 0.1), (1.05, -0.3), (3, -0.3)])
    for options in ({}, {"method": "rk4", "step": 0.2}, {"method": "euler", "step": 0.2}):
        trace = simulate(one_element("signed", F_s=9, F_c=9), rig, 2.0, **options)
        assert trace.z[-1, 0] == pytest.approx(0.1 * 1.05 - 0.3 * 0.95, abs=1e-14)
        assert trace.v[np.abs(trace.t - 1.05) < 1e-12].tolist() == [0.1, -0.3]
    wanted = simulate(one_element("signed"), rig, 2.0, t_eval=[0.5, 1.05, 2.0])
    assert wanted.v.tolist() == [0.1, -0.3, -0.3]  # right-continuous


@pytest.mark.parametrize("engine", ENGINES)
def test_what_the_value_before_a_jump_switches_is_switched(engine: str) -> None:
    """v falls to 0 and jumps to 0.9 at t = 1.5: the chart halts, and starts again."""
    chart = Chart(
        "halts at rest",
        inputs=("v",),
        variables=("z",),
        states=(State("go", flow={"z": "v"}), State("rest", flow={"z": "v / 2"})),
        transitions=(Transition("halt", "go", "rest", guard="v <= 0"),
                     Transition("start", "rest", "go", guard="v > 0")),
        outputs={"F": "z + v / 10"},
    )  # fmt: skip
    model = ChartModel(chart, {})
    trace = simulate(model, Prescribed(([0, 1.5, 1.5, 3], [1, 0, 0.9, 0.9])), 3.0, engine=engine)
    log = [(float(each.t), str(each.edge), float(each.v)) for each in trace.transitions]
    assert log == [(1.5, "halt", 0.0), (1.5, "start", 0.9)]
    assert trace.v[np.abs(trace.t - 1.5) < 1e-12].tolist() == [0.0, 0.9, 0.9, 0.9]
    friction = FrictionState(model, engine=None if engine == FASTEST else "ifelse")
    friction.advance(1.0, 0.0, 1.5)
    assert [each.edge for each in friction.switches] == ["halt"]
    assert friction.advance(0.9, 0.9, 1.5) == trace.F[-1]


# --------------------------------------------------------------------------- pulses
@pytest.mark.slow
@pytest.mark.parametrize(("share", "place"), [(0.02, 0.137), (0.005, 0.9123), (0.001, 0.5)])
def test_a_pulse_is_found_wherever_it_is(share: float, place: float) -> None:
    t_end, push = 100.0, 1.0
    width = share * t_end / 4.0
    text = f"{push / width} * exp(-((t - {place * t_end}) / {width})**2)"
    spring = force("k * z + 0.5 * v", k=1.0)
    free, watched = (
        simulate(spring, Slider(1.0, text), t_end, **more)
        for more in ({}, {"max_step": width / 4.0, "rtol": 1e-9})
    )
    assert np.abs(watched.x).max() > 0.5
    assert free.x[-1] == pytest.approx(watched.x[-1], abs=1e-4)


def test_a_velocity_pulse_is_found_too() -> None:
    text = "0.5 * exp(-((t - 31.234) / 0.1)**2)"
    trace = simulate(pulled_mass()[0], Prescribed(text), 60.0)
    assert trace.x[-1] == pytest.approx(0.5 * 0.1 * np.sqrt(np.pi), rel=1e-5)


def test_several_pulses_are_marked_and_what_never_rests_is_not() -> None:
    text = "exp(-((t - 2) / 0.02)**2) - exp(-((t - 7) / 0.01)**2)"
    times = np.array(waking_times(parse_value(text, ["t"]), 0.0, 10.0))
    for place, width in ((2.0, 0.02), (7.0, 0.01)):
        inside = times[np.abs(times - place) < 5 * width]
        assert inside.size >= 8
        assert inside.min() < place - 2 * width < place + 2 * width < inside.max()
    for text in ("sin(t)", "0.2*t", "3", "1e-5*exp(t/5)", "sqrt(3 - t)"):
        assert waking_times(parse_value(text, ["t"]), 0.0, 10.0) == ()


# --------------------------------------------------------------------------- at rest
def edges_of(
    states: tuple[State, ...], edges: tuple[Transition, ...], force: str, t_end: float, N: str = "1"
) -> Any:
    chart = Chart("chart", ("v", "N"), states=states, transitions=edges)
    body = Body("body", inertia=1.0, force=force)
    one = System("one", bodies=(body,), contacts=(Contact("pad", chart, {}, inputs={"N": N}),))
    return simulate(one, t_end, engine="ifelse").transitions


@pytest.mark.parametrize("w", [0.03, 1.0, 3.0, 50.0])
def test_a_held_contact_sees_every_period_of_its_load(w: float) -> None:
    """N < 0 once per period; the load of the lock is 0 throughout: no error for the step size."""
    log = edges_of(
        (State("stuck", locked=True), State("free", outputs={"F": "0"})),
        (
            Transition("lift", "stuck", "free", guard="N < 0"),
            Transition("engage", "free", "stuck", guard="N > 0"),
        ),
        "0",
        (2 * math.pi * 20) / w,
        N=f"0.9 + sin({w} * t)",
    )
    assert log.edge.tolist() == ["lift", "engage"] * 20
    first = (math.pi + math.asin(0.9)) / w
    assert log.t[::2] == pytest.approx([first + 2 * math.pi * k / w for k in range(20)], rel=1e-9)


@pytest.mark.parametrize("force", ["0.5", "0.5 * abs(v)", "0.5 * N + abs(v) * v"])
def test_a_guard_on_a_surface_of_the_flow_fires(force: str) -> None:
    """The contact is released at t = 1 with v = 0, and v > 0 holds from there on."""
    moving = (State(name, outputs={"F": force}) for name in ("start", "forward"))
    log = edges_of(
        (State("stuck", locked=True), *moving),
        (
            Transition("release", "stuck", "start", guard="F > 1"),
            Transition("move", "start", "forward", guard="v > 0"),
        ),
        "t",
        2.0,
    )
    assert log.edge.tolist() == ["release", "move"]
    assert log.t == pytest.approx([1.0, 1.0], abs=1e-9)
