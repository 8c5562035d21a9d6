"""The state machines and the generated if-else text give identical runs, to the last bit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gms_fsm import GMS, GMSParameters, LuGre, Prescribed, PulledSlider, Slider, Stribeck, simulate
from tests.helpers import (
    FIG3_FORCE,
    FIG4_SINE,
    non_drifting,
    open_loop,
    pulled_mass,
    same_bits,
    stick_slip,
)


def both(model, rig, t_end, **options):
    """Run both engines and compare; return one trace."""
    machines, ifelse = (
        simulate(model, rig, t_end, engine=engine, **options) for engine in ("machines", "ifelse")
    )
    same_bits(machines, ifelse)
    assert np.abs(machines.F - ifelse.F).max() == 0.0
    return machines


FIXED = {"method": "rk4", "step": 5.003e-3}


OPTIONS = {
    "dp45": {},
    "tight": {"rtol": 1e-10, "atol": 1e-13},
    "bs23": {"method": "bs23"},
    "rk4": FIXED,
    "rk4 by step": FIXED | {"events": "step"},
    "dp45 by step": {"events": "step", "max_step": 1e-2},
    "t_eval": {"t_eval": np.linspace(0, 31, 501)},
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "options"),
    [
        ("signed", "dp45"),
        ("signed", "tight"),
        ("signed", "bs23"),
        ("signed", "rk4 by step"),
        ("published", "dp45"),
        ("published", "rk4"),
        ("published", "dp45 by step"),
        ("published", "t_eval"),
    ],
)
def test_open_loop(law, options):
    """Table I, stick-slip, 31 s; each law with each kind of step."""
    trace = both(stick_slip(law), open_loop(), 31.0, **OPTIONS[options])
    assert len(trace.transitions) >= 4


@pytest.mark.parametrize("law", ["signed", "published"])
def test_fig_4(law):
    """The paper's open-loop experiment."""
    assert len(both(stick_slip(law), Prescribed(FIG4_SINE), 100.0).transitions) > 30


@pytest.mark.slow
@pytest.mark.parametrize("slipping", [False, True])
@pytest.mark.parametrize("law", ["signed", "published"])
def test_fig_3(law, slipping):
    """The paper's closed-loop experiment, and the one in which element 1 slips."""
    model, rig = non_drifting(law, slipping=slipping)
    assert (len(both(model, rig, 30.0).transitions) > 0) == slipping


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"method": "bs23"}, FIXED, FIXED | {"events": "step"}])
def test_pulled_mass(options):
    """Stick-slip in closed loop."""
    assert len(both(*pulled_mass(), 30.0, **options).transitions) > 10


@pytest.mark.parametrize("rig", [Prescribed("1e-3*(1.5+cos(10*t))"), Slider(1.0, FIG3_FORCE)])
def test_lugre(rig):
    """The benchmark has no edges; both engines run its flow."""
    model = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4.0, stribeck=Stribeck(1.0, 1.5, 1e-3))
    assert len(both(model, rig, 6.0)) > 20


@st.composite
def models(draw):
    n = draw(st.integers(1, 5))

    def numbers(low, high):
        return draw(st.lists(st.floats(low, high), min_size=n, max_size=n))

    F_c = draw(st.floats(0.1, 1.0))
    parameters = GMSParameters(
        numbers(1, 50),
        numbers(0, 0.5),
        numbers(0.005, 0.5),
        sigma_2=draw(st.floats(0.05, 1)),
        stribeck=Stribeck(F_c, F_c * draw(st.floats(1.01, 3)), draw(st.floats(0.01, 0.2))),
        v_c=draw(st.floats(1e-7, 1e-4)),
        weights=numbers(5e-3, 5e-2),
    )
    return GMS(parameters, law=draw(st.sampled_from(["signed", "published"])))


@pytest.mark.slow
@settings(max_examples=40, deadline=None, derandomize=True)
@given(models(), st.floats(0.05, 1.0), st.floats(0.5, 5.0))
def test_random_parameters_open_loop(model, amplitude, period):
    """Any bank under a sine."""
    both(model, Prescribed(f"{amplitude!r}*sin(2*pi*t/{period!r})"), 1.6 * period, rtol=1e-5)


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@given(models().filter(lambda m: m.law == "signed"), st.floats(0.5, 5.0))
def test_random_parameters_closed_loop(model, stiffness):
    """Any bank under a pulled mass."""
    both(model, PulledSlider(1.0, stiffness, 0.1), 5.0, rtol=1e-5)
