"""`mean_force` and `dF_dv` are those of the last sample: exact where a closed form is known."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from gms_fsm import GMS, Chart, ChartModel, FrictionState, GMSParameters, State, Stribeck
from gms_fsm.errors import ParameterError
from tests.helpers import FASTEST

ENGINES = ["ifelse"] if FASTEST == "ifelse" else ["compiled", "ifelse"]
K, SIGMA, SIGMA_2 = 1e4, 3.0, 0.5


def one_element(**changed: float) -> GMS:
    numbers = {"F_c": 1.0, "F_s": 1.0, "v_s": 1e-3, "sigma": SIGMA, **changed}
    return GMS(
        GMSParameters.from_shares(
            [1.0], [K], C=100.0, sigma=[numbers["sigma"]], sigma_2=SIGMA_2, v_c=1e-9,
            stribeck=Stribeck(numbers["F_c"], numbers["F_s"], numbers["v_s"]),
        ),
        law="signed",
    )  # fmt: skip


@pytest.mark.parametrize("engine", ENGINES)
def test_while_it_sticks(engine: str) -> None:
    """z is a parabola, so the mean force is exact."""
    v0, v1, dt = 0.01, -0.02, 1e-3
    friction = FrictionState(one_element(), engine=engine)
    friction.advance(v0, v1, dt)
    mean = K * dt * (v0 / 3 + v1 / 6) + (SIGMA + SIGMA_2) * (v0 + v1) / 2
    assert friction.mean_force == pytest.approx(mean, rel=1e-12)
    assert friction.dF_dv == pytest.approx(K * dt / 2 + SIGMA + SIGMA_2, rel=1e-8)
    assert friction.mean_force == pytest.approx(mean, rel=1e-12)  # asking changes nothing


@pytest.mark.parametrize("engine", ENGINES)
def test_across_a_switch(engine: str) -> None:
    """Without bristle damping: F = k z up to the threshold, then F_c, which it never leaves."""
    v, dt = 0.01, 0.05
    friction = FrictionState(one_element(sigma=0.0), engine=engine)
    friction.advance(v, v, dt)
    assert [switch.edge for switch in friction.switches] == ["break_away_forward"]
    t_1 = 1.0 / (K * v)  # where k v t is F_c
    mean = ((K * v * t_1**2) / 2 + (dt - t_1)) / dt + SIGMA_2 * v
    assert friction.mean_force == pytest.approx(mean, rel=1e-9)
    assert friction.dF_dv == pytest.approx(SIGMA_2, rel=1e-6)


def test_means_of_short_samples_are_those_of_a_long_one() -> None:
    """The impulse is the same, whatever the samples: with Stribeck curve, and switches."""
    model = one_element(F_s=1.6)
    long, short = FrictionState(model, rtol=1e-10), FrictionState(model, rtol=1e-10)
    long.advance(0.0, 0.01, 0.1)
    edges = np.linspace(0.0, 0.01, 101)
    means = []
    for v0, v1 in itertools.pairwise(edges):
        short.advance(v0, v1, 1e-3)
        means.append(short.mean_force)
    assert np.mean(means) == pytest.approx(long.mean_force, rel=1e-7)


def test_the_slope_is_that_of_the_force() -> None:
    model, (v0, v1, dt) = one_element(F_s=1.6), (1e-3, 8e-3, 0.05)
    friction = FrictionState(model)
    before = friction.snapshot()
    friction.advance(v0, v1, dt)
    slope = friction.dF_dv
    assert friction.switches
    friction.restore(before)
    small = 1e-5
    difference = friction.peek(v0, v1 + small, dt) - friction.peek(v0, v1 - small, dt)
    assert slope == pytest.approx(difference / (2 * small), rel=1e-3)


def test_before_the_first_sample() -> None:
    friction = FrictionState(one_element())
    for name in ("mean_force", "dF_dv"):
        with pytest.raises(ParameterError, match="there is no last sample; call advance first"):
            getattr(friction, name)
    assert friction.switches == ()
    friction.advance(0.0, 0.1, 0.0)
    assert friction.mean_force == friction.peek(0.1, 0.1, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_the_first_sample_of_a_chart_with_an_entry(engine: str) -> None:
    """The entry sees the first velocity, also when the sample is repeated for its mean."""
    chart = Chart(
        "entered", inputs=("v",), variables=("z",), parameters=("k",),
        states=(State("only", entry={"z": "z + v"}, flow={"z": "v"}, outputs={"F": "k * z"}),),
    )  # fmt: skip
    friction = FrictionState(ChartModel(chart, {"k": 3.0}), engine=engine)
    friction.advance(0.5, 0.1, 0.02)
    mean = 3.0 * (0.5 + 0.02 * (0.5 / 3 + 0.1 / 6))
    assert friction.mean_force == pytest.approx(mean, rel=1e-12)
    assert friction.dF_dv == pytest.approx(3.0 * 0.02 / 2, rel=1e-6)
