"""A parameter that violates its rule is refused; the message names it, its value and the rule.

Valid parameters match the paper: Table I to the last digit, shares of friction that add up in
steady slip. Their arrays cannot be changed afterwards.
"""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    Parameter,
    Prescribed,
    PulledSlider,
    State,
    Stribeck,
    simulate,
)
from tests.refusals import STRIBECK, bank, lugre, own_model, shares


def test_values_on_the_boundary_are_allowed() -> None:
    assert Stribeck(1, 1, 1e-3)(0.0) == 1.0
    assert bank(sigma=(0, 0), C=(0, 0), sigma_2=0).sigma.tolist() == [0, 0]
    assert lugre(sigma_1=0, sigma_2=0).sigma_1 == 0
    assert PulledSlider(1, 1, 0).speed == 0
    only_q = Chart("q", ("v",), ("z",), ("q",), (State("a", {"z": "v"}),), (), {"F": "q * z"})
    assert only_q.parameters == (Parameter("q"),)  # a plain name may be any number
    assert ChartModel(only_q, {"q": [-1e300, 0.0]}, n=2).n == 2


def test_published_law_without_a_dip_warns_and_the_signed_one_does_not() -> None:
    flat = bank(stribeck=Stribeck(1, 1, 1e-3))
    with pytest.warns(UserWarning, match="never arrests.*law='signed'"):
        GMS(flat, law="published")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        GMS(flat, law="signed")
        GMS(bank(), law="published")


def test_the_curve_is_eq_2() -> None:
    with pytest.MonkeyPatch.context() as patch:  # it evaluates its text
        patch.setattr(Stribeck, "text", "F_c + v_s * v")
        assert float(STRIBECK(2.0)) == 1.002
    for v in (0.0, 1e-4, -1e-3, 2e-3, -0.5):
        assert float(STRIBECK(v)) == pytest.approx(
            1.0 + 0.5 * math.exp(-((v / 1e-3) ** 2)), rel=1e-15
        )
    assert STRIBECK(np.array([[0.0, 1.0]])).shape == (1, 2)
    assert STRIBECK(STRIBECK.dip) - STRIBECK.F_c < 1e-16


def test_the_curve_equals_what_a_run_computes_to_the_bit() -> None:
    trace = simulate(GMS(bank(), law="signed"), Prescribed("2e-3*sin(t)"), 7.0)
    assert len(np.unique(trace.s[:, 0])) > 10
    assert (STRIBECK(trace.v) == trace.s[:, 0]).all()


def test_table_one_is_exact() -> None:
    a, b = (GMSParameters.paper(column) for column in ("non-drifting", "stick-slip"))
    assert a.k.tolist() == [100, 10, 1, 0.1]
    assert a.sigma.tolist() == [10, 0.1, 1, 1]
    assert a.C.tolist() == [1, 1, 1, 1]
    assert (a.sigma_2, a.v_c) == (4, 1e-6)
    assert a.stribeck == Stribeck(F_c=1, F_s=1.5, v_s=1e-3)
    assert b.k.tolist() == [0.7, 0.7, 0.7, 0.7]
    assert b.sigma.tolist() == [0.3, 0.4, 0.5, 0.6]
    assert b.C.tolist() == [0.1, 0.05, 0.025, 1e-4]
    assert (b.sigma_2, b.v_c) == (0.1, 1e-6)
    assert b.stribeck == Stribeck(F_c=0.4, F_s=1.5, v_s=1e-3)
    for column in (a, b):
        assert column.n == 4
        assert column.weights.tolist() == [1, 1, 1, 1]


def test_shares_give_weights_and_rates() -> None:
    alpha, k = np.array([0.1, 0.2, 0.3, 0.4]), np.array([40.0, 30.0, 20.0, 10.0])
    p = shares(alpha=alpha, k=k, C=2.0)
    assert p.weights.tolist() == (alpha / k).tolist()
    assert p.C.tolist() == (alpha * 2.0 / k).tolist()
    assert p.sigma.tolist() == [0, 0, 0, 0]
    assert p.sigma_2 == 0
    assert shares(alpha=alpha, k=k, sigma=[1, 2, 3, 4], sigma_2=5).sigma.tolist() == [1, 2, 3, 4]


@pytest.mark.parametrize("v", [0.05, -0.05])
def test_in_steady_slip_the_shares_carry_the_whole_friction(v: float) -> None:
    model = GMS(shares(alpha=[0.1, 0.2, 0.3, 0.4], k=[40.0, 30.0, 20.0, 10.0]), law="signed")
    trace = simulate(model, Prescribed(v), 30.0)
    assert (trace.states[-1] == "slip").all()
    force = float(np.sum(model.parameters.k * trace.z[-1]))
    assert force == pytest.approx(math.copysign(float(STRIBECK(v)), v), abs=1e-6)
    assert trace.F[-1] == pytest.approx(force, abs=1e-6)


def test_nothing_can_be_changed_afterwards() -> None:
    k = np.array([40.0, 10.0])
    p = bank(k=k)
    k[0] = 1.0
    assert p.k.tolist() == [40, 10]
    for name in ("k", "sigma", "C", "weights"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(p, name)[0] = 1.0
    with pytest.raises(AttributeError):
        p.v_c = 1.0  # type: ignore[misc]
    with pytest.raises(AttributeError):
        STRIBECK.F_c = 2.0  # type: ignore[misc]
    weights = np.array([1.0, 2.0])
    model = own_model({"k": weights}, weights=weights)
    weights[0] = 9.0
    assert model.weights.tolist() == [1, 2]
    assert np.asarray(model.values["k"]).tolist() == [1, 2]
    with pytest.raises(ValueError, match="read-only"):
        model.weights[0] = 3.0


def test_other_weights_change_nothing_else() -> None:
    p = bank(weights=(1, 2))
    q = p.with_weights([3, 4])
    assert q.weights.tolist() == [3, 4]
    assert p.weights.tolist() == [1, 2]
    for name in ("k", "sigma", "C", "sigma_2", "stribeck", "v_c"):
        assert np.array_equal(getattr(p, name), getattr(q, name))
