"""A pulse that fills a small part of a run is found, wherever it lies, without a maximum step.

A step is judged by its few stages. A formula at rest lets the steps grow, and one of them jumped
over the whole pulse: x was 0.010 m instead of 0.060 m.
"""

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, Slider, State, simulate
from gms_fsm.language import parse_value
from gms_fsm.lowering.pulses import waking_times
from tests.helpers import pulled_mass

SPRING = ChartModel(
    Chart(
        "spring and damper",
        inputs=("v", "x"),
        variables=("z",),
        parameters=("k",),
        states=(State("on", flow={"z": "v"}),),
        transitions=(),
        outputs={"F": "k * z + 0.5 * v"},
    ),
    {"k": 1.0},
)


@pytest.mark.slow
@pytest.mark.parametrize(("share", "place"), [(0.02, 0.137), (0.005, 0.9123), (0.001, 0.5)])
def test_the_pulse_is_found_wherever_it_is(share, place):
    t_end, push = 100.0, 1.0
    width = share * t_end / 4.0
    text = f"{push / width} * exp(-((t - {place * t_end}) / {width})**2)"
    free, watched = (
        simulate(SPRING, Slider(1.0, text), t_end, engine="ifelse", **more)
        for more in ({}, {"max_step": width / 4.0, "rtol": 1e-9})
    )
    assert np.abs(watched.x).max() > 0.5
    assert free.x[-1] == pytest.approx(watched.x[-1], abs=1e-4)


def test_a_bank_of_elements_moves_as_far_as_with_small_steps():
    model, _ = pulled_mass()
    text = "8 * exp(-((t - 37.7) / 0.15)**2)"
    free = simulate(model, Slider(1.0, text), 60.0)
    watched = simulate(model, Slider(1.0, text), 60.0, max_step=0.01)
    assert len(free.transitions) == len(watched.transitions) > 0
    assert free.x[-1] == pytest.approx(watched.x[-1], abs=1e-7)


@pytest.mark.parametrize("text", ["sin(t)", "0.2*t", "3", "1e-5*exp(t/5)", "sqrt(3 - t)"])
def test_formulas_that_never_rest_get_no_knots(text):
    """Their runs are bit for bit the same as without this."""
    assert waking_times(parse_value(text, ["t"]), 0.0, 10.0) == ()


def test_several_pulses_are_all_marked():
    text = "exp(-((t - 2) / 0.02)**2) - exp(-((t - 7) / 0.01)**2)"
    times = np.array(waking_times(parse_value(text, ["t"]), 0.0, 10.0))
    for place, width in ((2.0, 0.02), (7.0, 0.01)):
        inside = times[np.abs(times - place) < 5 * width]
        assert inside.size >= 8
        assert inside.min() < place - 2 * width < place + 2 * width < inside.max()


def test_a_velocity_pulse_is_found_too():
    model, _ = pulled_mass()
    text = "0.5 * exp(-((t - 31.234) / 0.1)**2)"
    assert simulate(model, Prescribed(text), 60.0).x[-1] == pytest.approx(
        0.5 * 0.1 * np.sqrt(np.pi), rel=1e-5
    )
