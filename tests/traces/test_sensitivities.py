"""What a trace says of its derivatives: by name, at rows, at ties, and where a switch grazes."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    LuGre,
    Prescribed,
    PulledSlider,
    State,
    Stribeck,
    Transition,
    simulate,
)
from gms_fsm.traces.trace import Trace
from tests.helpers import pulled_mass, stick_slip


def touching(height: float, guard: str = "z > h") -> Trace:
    """A variable that rises to 0.5 at t = 1, and a guard at some height."""
    chart = Chart(
        "touches",
        inputs=("v",),
        variables=("z",),
        parameters=("h", "k"),
        states=(State("below", flow={"z": "v"}), State("above", flow={"z": "2 * v"})),
        transitions=(Transition("reach", "below", "above", guard=guard),),
        outputs={"F": "k * z"},
    )
    model = ChartModel(chart, {"h": height, "k": 2.0})
    return simulate(
        model, Prescribed([(0, 1), (1, 0), (2, -1)]), 1.5, sensitivities=("h", "k", "initial.z")
    )


def test_a_crossing_has_the_derivative_of_its_root():
    trace = touching(0.375)
    t = 0.5  # t - t**2/2 = 0.375
    assert trace.sensitivity("transitions", "h") == pytest.approx([1.0 / (1.0 - t)])
    assert trace.sensitivity("transitions", "initial.z") == pytest.approx([-1.0 / (1.0 - t)])
    # behind it z = h + 2 (z1(t) - h), with z1 the way without the switch
    assert trace.sensitivity("z", "h")[-1] == pytest.approx([-1.0])
    assert trace.sensitivity("z", "initial.z")[-1] == pytest.approx([2.0])
    assert trace.sensitivity("F", "k")[-1] == pytest.approx(trace.z[-1, 0])


@pytest.mark.parametrize("guard", ["max(h - z, 0) <= 0", "max(z - h, 0) > 0"])
def test_what_is_flat_on_one_side_of_its_zero_has_the_derivative_of_the_other(guard):
    trace, plain = touching(0.375, guard), touching(0.375)
    for of, to in (("transitions", "h"), ("z", "initial.z")):
        one, other = (each.sensitivity(of, to)[-1] for each in (trace, plain))
        assert one == pytest.approx(other, rel=1e-7)
    assert trace.trust().of("sensitivity") == ()


def test_a_grazing_switch_has_none_and_says_so():
    trace = touching(0.5 - 1e-11)
    assert len(trace.transitions) == 1
    assert np.isnan(trace.sensitivity("z", "h")[-1]).all()
    (found,) = trace.trust().of("sensitivity")
    assert found.severity == "warning"
    assert found.t == pytest.approx(1.0, abs=1e-5)
    assert "z > h" in found.text


def test_a_rate_whose_slope_is_infinite_is_found():
    curve = Stribeck(1.0, 1.5, 0.1, delta=0.7)
    model = LuGre(sigma_0=1e3, sigma_1=10.0, sigma_2=0.4, stribeck=curve)
    trace = simulate(model, PulledSlider(1.0, 2.0, 0.1), 0.5, sensitivities=("stiffness",))
    assert np.isnan(trace.sensitivity("z", "stiffness")[-1]).all()
    (found,) = trace.trust().of("sensitivity")
    assert found.severity == "warning"
    assert "slope" in found.text


def test_elements_that_switch_by_one_guard_on_v_have_a_derivative():
    trace = simulate(
        stick_slip("signed"), Prescribed("0.2*sin(2*pi*t/20)"), 13.0, sensitivities=("v_c", "C1")
    )
    arrests = trace.transitions.edge == "arrest"
    assert arrests.sum() == 4
    slopes = trace.sensitivity("transitions", "v_c")[arrests]
    np.testing.assert_allclose(slopes, -1.0 / (0.2 * 2 * np.pi / 20), rtol=1e-6)
    assert trace.trust().of("sensitivity") == ()


def in_turn(**values: float) -> Trace:
    """Two guards at one height; whichever comes first decides what the other one leads to."""
    chart = Chart(
        "in turn",
        inputs=("v",),
        variables=("z",),
        parameters=("h", "g"),
        states=tuple(
            State(name, flow={"z": f"{rate} * v"})
            for name, rate in (("low", 1), ("after_h", 2), ("after_g", 5), ("both", 3))
        ),
        transitions=(
            Transition("h_first", "low", "after_h", guard="z > h"),
            Transition("g_first", "low", "after_g", guard="z > g"),
            Transition("g_then", "after_h", "both", guard="z > g"),
            Transition("h_then", "after_g", "both", guard="z > h"),
        ),
        outputs={"F": "z"},
    )
    model = ChartModel(chart, {"h": 1.0, "g": 1.0} | values)
    return simulate(model, Prescribed("t"), 2.0, rtol=1e-12, sensitivities=("h", "g"))


@pytest.mark.parametrize(("name", "side"), [("h", -1e-6), ("g", 1e-6)])
def test_a_tie_that_does_not_commute_has_the_derivative_of_the_side_it_went(name, side):
    trace, beside, beyond = in_turn(), in_turn(**{name: 1 + side}), in_turn(**{name: 1 - side})
    (found,) = trace.trust().of("sensitivity")
    assert "follow each other as they did" in found.text
    slope = trace.sensitivity("z", name)[-1]
    assert slope == pytest.approx((beside.z[-1] - trace.z[-1]) / side, rel=1e-5)
    assert abs((beyond.z[-1] - trace.z[-1]) / -side - slope) > 1.0
    times = trace.sensitivity("transitions", name)
    moved = (beside.transitions.t - trace.transitions.t) / side
    np.testing.assert_allclose(times, moved, rtol=1e-5, atol=1e-8)


def test_requested_rows_have_the_derivatives_of_all_rows():
    model, rig = pulled_mass()
    names = ("F_s", "initial.v")
    every = simulate(model, rig, 6.0, rtol=1e-9, sensitivities=names)
    some = simulate(model, rig, 6.0, rtol=1e-9, sensitivities=names, t_eval=every.t[5:-5:40])
    at = np.searchsorted(every.t, some.t, "right") - 1
    for of in ("z", "F", "v"):
        one, other = (trace.sensitivity(of, "F_s") for trace in (some, every))
        np.testing.assert_allclose(one, other[at], atol=1e-6 * np.abs(other).max())
    end = simulate(model, rig, 6.0, rtol=1e-9, sensitivities=names, output="end")
    np.testing.assert_allclose(
        end.sensitivity("v", "F_s"), every.sensitivity("v", "F_s")[-1:], 1e-6
    )


def test_they_travel_with_a_trace():
    trace = touching(0.375)
    again = pickle.loads(pickle.dumps(trace))
    assert np.array_equal(again.sensitivity("F", "h"), trace.sensitivity("F", "h"))
