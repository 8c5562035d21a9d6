"""A parameter that violates its rule is refused; the message names it, its value and the rule.

Valid parameters match the paper: Table I to the last digit, shares of friction that add up in
steady slip. Their arrays cannot be changed afterwards.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    LuGre,
    Parameter,
    Prescribed,
    PulledSlider,
    Slider,
    State,
    Stribeck,
    simulate,
)
from gms_fsm.charts import gms_element
from gms_fsm.errors import ChartError, GMSError, ParameterError

CURVE = Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3)
NAN, INF = math.nan, math.inf


def stribeck(F_c: Any = 1.0, F_s: Any = 1.5, v_s: Any = 1e-3) -> Stribeck:
    return Stribeck(F_c, F_s, v_s)


def bank(k: Any = (40, 10), sigma: Any = (1, 2), C: Any = (0.1, 0.2), **rest: Any) -> GMSParameters:
    given: dict[str, Any] = {"sigma_2": 0.4, "stribeck": CURVE, "v_c": 1e-6}
    return GMSParameters(k, sigma, C, **{**given, **rest})


def shares(alpha: Any = (0.5, 0.5), k: Any = (40, 10), **rest: Any) -> GMSParameters:
    given: dict[str, Any] = {"C": 2.0, "stribeck": CURVE, "v_c": 1e-6}
    return GMSParameters.from_shares(alpha, k, **{**given, **rest})


def lugre(**changes: Any) -> LuGre:
    given: dict[str, Any] = {"sigma_0": 1e3, "sigma_1": 31.6, "sigma_2": 4.0, "stribeck": CURVE}
    return LuGre(**{**given, **changes})


def own(values: Any = None, *, chart: Any = None, **changes: Any) -> ChartModel:
    given: dict[str, Any] = {"n": 2, "stribeck": CURVE}
    values = {"k": 1.0, "sigma": 0.0, "C": 1.0, "v_c": 1e-6, **(values or {})}
    return ChartModel(chart or gms_element("signed"), values, **{**given, **changes})


WANTS_U = Chart("u", ("v", "u"), ("z",), (), (State("a", {"z": "u"}),), (), {"F": "z"})
RULED = (
    Parameter("a", "1", ">= 0 and < 2"),
    Parameter("b", "1", "> a"),
    Parameter("c", "m", "< a", meaning="height"),
    Parameter("d", "m", "<=c"),
)


def ruled(**changes: Any) -> ChartModel:
    made = Chart("r", ("v",), ("z",), RULED, (State("a_", {"z": "v"}),), (), {"F": "z"})
    return ChartModel(made, {"a": 1, "b": 2, "c": 0.5, "d": 0.25, **changes}, n=2)


ONLY_Q = Chart("q", ("v",), ("z",), ("q",), (State("a", {"z": "v"}),), (), {"F": "q * z"})


def with_parameters(made: Callable[[], tuple[Parameter | str, ...]]) -> Chart:
    return Chart("r", ("v",), ("z",), made(), (State("a", {"z": "v"}),), (), {"F": "z"})


BROKEN: list[tuple[Callable[..., object], dict[str, Any], list[str]]] = [
    # the curve
    (stribeck, {"F_c": 0}, ["F_c is 0.0", "> 0"]),
    (stribeck, {"F_c": -1}, ["F_c is -1.0", "> 0"]),
    (stribeck, {"F_c": NAN}, ["F_c is nan", "finite"]),
    (stribeck, {"F_s": INF}, ["F_s is inf", "finite"]),
    (stribeck, {"F_s": 0.5}, ["F_s is 0.5", "F_c is 1.0", "F_s >= F_c"]),
    (stribeck, {"v_s": 0}, ["v_s is 0.0", "> 0"]),
    (stribeck, {"v_s": "fast"}, ["v_s is 'fast'", "a number"]),
    (stribeck, {"v_s": None}, ["v_s is None", "a number"]),
    (stribeck, {"F_c": [1, 2]}, ["F_c is [1, 2]", "a number"]),
    # the bank
    (bank, {"k": (40, 0)}, ["k[1] (element 2) is 0.0", "> 0"]),
    (bank, {"k": (-40, 1)}, ["k[0] (element 1) is -40.0", "> 0"]),
    (bank, {"k": (NAN, 1)}, ["k[0] (element 1) is nan", "finite"]),
    (bank, {"k": 40}, ["k has shape ()", "a flat list of numbers"]),
    (bank, {"k": []}, ["k has shape (0,)", "a flat list of numbers"]),
    (bank, {"k": [[1, 2]]}, ["k has shape (1, 2)", "a flat list of numbers"]),
    (bank, {"k": ("a", "b")}, ["k is ('a', 'b')", "numbers"]),
    (bank, {"k": [[1], [1, 2]]}, ["k is [[1], [1, 2]]", "numbers"]),
    (bank, {"k": None}, ["k"]),
    (bank, {"sigma": (1, -2)}, ["sigma[1] (element 2) is -2.0", ">= 0"]),
    (bank, {"sigma": (1, 2, 3)}, ["sigma has 3 entries", "2"]),
    (bank, {"sigma": 1}, ["sigma has shape ()"]),
    (bank, {"C": (1,)}, ["C has 1 entries", "2"]),
    (bank, {"C": (0.1, INF)}, ["C[1] (element 2) is inf", "finite"]),
    (bank, {"C": (-0.1, 1)}, ["C[0] (element 1) is -0.1", ">= 0"]),
    (bank, {"weights": (1, 0)}, ["weights[1] (element 2) is 0.0", "> 0"]),
    (bank, {"weights": (1, 1, 1)}, ["weights has 3 entries", "2"]),
    (bank, {"sigma_2": -1}, ["sigma_2 is -1.0", ">= 0"]),
    (bank, {"v_c": 0}, ["v_c is 0.0", "> 0"]),
    (bank, {"v_c": "slow"}, ["v_c is 'slow'", "a number"]),
    (bank, {"stribeck": 1.0}, ["stribeck is 1.0", "must be a Stribeck"]),
    (bank, {"stribeck": None}, ["stribeck is None", "must be a Stribeck"]),
    # shares
    (shares, {"alpha": (0.5, 0.4)}, ["alpha: the shares add up to 0.9", "add up to 1"]),
    (shares, {"alpha": (1.0, 0.0)}, ["alpha[1] (element 2) is 0.0", "> 0"]),
    (shares, {"alpha": (1.5, -0.5)}, ["alpha[1] (element 2) is -0.5", "> 0"]),
    (shares, {"alpha": (1.0,)}, ["alpha has 1 entries", "2"]),
    (shares, {"k": (0, 1)}, ["k[0] (element 1) is 0.0", "> 0"]),
    (shares, {"C": -1}, ["C is -1.0", ">= 0"]),
    (shares, {"C": NAN}, ["C is nan", "finite"]),
    (shares, {"sigma": (1, 2, 3)}, ["sigma has 3 entries", "2"]),
    (shares, {"sigma_2": -1}, ["sigma_2 is -1.0", ">= 0"]),
    # LuGre
    (lugre, {"sigma_0": 0}, ["sigma_0 is 0.0", "> 0"]),
    (lugre, {"sigma_1": -1}, ["sigma_1 is -1.0", ">= 0"]),
    (lugre, {"sigma_2": NAN}, ["sigma_2 is nan", "finite"]),
    (lugre, {"stribeck": 3}, ["stribeck is 3", "Stribeck"]),
    # user-defined chart
    (own, {"n": 0}, ["n is 0", "at least 1"]),
    (own, {"n": -1}, ["n is -1", "at least 1"]),
    (own, {"n": 2.5}, ["n is 2.5"]),
    (own, {"n": "two"}, ["n is 'two'"]),
    (own, {"values": {"q": 1.0}}, ["unknown: ['q']"]),
    (own, {"values": {"k": NAN}}, ["k is nan", "finite"]),
    (own, {"values": {"k": "stiff"}}, ["k is 'stiff'", "a number"]),
    (own, {"values": {"k": "100"}}, ["k is '100'", "a number"]),
    (own, {"values": {"k": None}}, ["k is None", "a number"]),
    (own, {"values": {"k": [1, 2, 3]}}, ["k has 3 entries", "2"]),
    (own, {"values": {"k": [1, INF]}}, ["k[1] (element 2) is inf", "finite"]),
    (own, {"values": {"k": 0.0}}, ["k is 0.0", "> 0"]),
    (own, {"values": {"sigma": [0, -1]}}, ["sigma[1] (element 2) is -1.0", ">= 0"]),
    (own, {"values": {"v_c": [1e-6, 1e-6]}}, ["v_c is [1e-06, 1e-06]", "one for all elements"]),
    (own, {"values": {"k": [[1], [1, 2]]}}, ["k is [[1], [1, 2]]", "a list of numbers"]),
    (own, {"sigma_2": -1}, ["sigma_2 is -1.0", ">= 0"]),
    (own, {"weights": (1, -1)}, ["weights[1] (element 2) is -1.0", "> 0"]),
    (own, {"weights": (1,)}, ["weights has 1 entries", "2"]),
    (own, {"stribeck": None}, ["has the input s", "stribeck is None", "Stribeck(F_c, F_s, v_s)"]),
    (own, {"chart": WANTS_U}, ["'u'", "t, x, v, s"]),
    # rules that name other parameters
    (ruled, {"a": 3}, ["a is 3.0; it must be < 2"]),
    (ruled, {"a": -1}, ["a is -1.0; it must be >= 0"]),
    (ruled, {"b": 0.5}, ["b is 0.5, a is 1.0; b must be greater than a (b > a)"]),
    (ruled, {"c": 1}, ["c is 1.0, a is 1.0; height must be less than a (c < a)"]),
    (ruled, {"d": 2}, ["d is 2.0, c is 0.5; d must be at most the height (d <= c)"]),
    (ruled, {"b": [2, 1]}, ["b[1] (element 2) is 1.0, a[1] (element 2) is 1.0", "(b > a)"]),
    (ruled, {"a": [1, 1.5], "b": [2, 1]}, ["b[1] (element 2) is 1.0, a[1] (element 2) is 1.5"]),
    # the model and the rigs
    (GMS, {"parameters": {}, "law": "signed"}, ["parameters is {}", "GMSParameters"]),
    (Slider, {"mass": 0, "force": "t"}, ["mass is 0.0", "> 0"]),
    (Slider, {"mass": "heavy", "force": "t"}, ["mass is 'heavy'", "a number"]),
    (Slider, {"mass": INF, "force": "t"}, ["mass is inf", "finite"]),
    (PulledSlider, {"mass": -1, "stiffness": 1, "speed": 1}, ["mass is -1.0", "> 0"]),
    (PulledSlider, {"mass": 1, "stiffness": 0, "speed": 1}, ["stiffness is 0.0", "> 0"]),
    (PulledSlider, {"mass": 1, "stiffness": 1, "speed": NAN}, ["speed is nan", "finite"]),
    (GMSParameters.paper, {"column": "slow"}, ["'slow'", "'non-drifting'", "'stick-slip'"]),
    (GMSParameters.paper, {"column": None}, ["None", "'non-drifting'", "'stick-slip'"]),
]


@pytest.mark.parametrize(("build", "changes", "words"), BROKEN)
def test_the_message_names_parameter_value_and_rule(
    build: Callable[..., object], changes: dict[str, Any], words: list[str]
) -> None:
    with pytest.raises(ParameterError) as caught:
        build(**changes)
    assert isinstance(caught.value, GMSError)
    assert isinstance(caught.value, ValueError)
    for word in words:
        assert word in str(caught.value)


def test_a_missing_value_of_a_chart_is_named() -> None:
    with pytest.raises(ParameterError, match=r"missing values: \['C', 'v_c'\], unknown: none"):
        ChartModel(gms_element("signed"), {"k": 1, "sigma": 0}, n=1, stribeck=CURVE)


def test_a_wrong_length_does_not_blame_a_parameter_the_chart_lacks() -> None:
    with pytest.raises(ParameterError, match=r"q has 3 entries") as caught:
        ChartModel(ONLY_Q, {"q": np.ones(3)}, n=2, stribeck=CURVE)
    assert "2" in str(caught.value)
    assert "k has" not in str(caught.value)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        (("k", {"rule": "positive"}), "parameter 'k', rule 'positive': 'positive' is not a bound"),
        (("k", {"rule": "> "}), "'>' is not a bound"),
        (("k", {"rule": "> 0 and"}), "is not a bound"),
        (("k", {"rule": "== 0"}), "'== 0' is not a bound"),
        (("k", {"rule": "> 1e999"}), "is not a bound"),
        (("k", {"rule": "> 0", "assumed": "0 <"}), "rule '0 <'"),
        (("k", {"rule": 0}), "parameter 'k': rule is 0, not a text"),
        (("k", {"rule": "> q"}), "chart 'r', parameter 'k': its rule names 'q'.* there are 'h'"),
        (("k", {"rule": "> k"}), "its rule names 'k', which is not another parameter"),
    ],
)
def test_an_invalid_rule_is_refused(parameters: tuple[str, dict[str, Any]], words: str) -> None:
    name, changes = parameters
    with pytest.raises(ChartError, match=words):
        with_parameters(lambda: (Parameter(name, **changes), "h"))


def test_a_plain_name_is_short_for_a_parameter_that_may_be_any_number() -> None:
    assert ONLY_Q.parameters == (Parameter("q"),)
    assert ONLY_Q.unit("q") == ""
    assert ChartModel(ONLY_Q, {"q": [-1e300, 0.0]}, n=2).n == 2


def test_values_on_the_boundary_are_allowed() -> None:
    assert Stribeck(1, 1, 1e-3)(0.0) == 1.0
    assert bank(sigma=(0, 0), C=(0, 0), sigma_2=0).sigma.tolist() == [0, 0]
    assert lugre(sigma_1=0, sigma_2=0).sigma_1 == 0
    assert PulledSlider(1, 1, 0).speed == 0


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
        assert float(CURVE(2.0)) == 1.002
    for v in (0.0, 1e-4, -1e-3, 2e-3, -0.5):
        assert float(CURVE(v)) == pytest.approx(1.0 + 0.5 * math.exp(-((v / 1e-3) ** 2)), rel=1e-15)
    assert CURVE(np.array([[0.0, 1.0]])).shape == (1, 2)
    assert CURVE(CURVE.dip) - CURVE.F_c < 1e-16


def test_the_curve_equals_what_a_run_computes_to_the_bit() -> None:
    trace = simulate(GMS(bank(), law="signed"), Prescribed("2e-3*sin(t)"), 7.0)
    assert len(np.unique(trace.s[:, 0])) > 10
    assert (CURVE(trace.v) == trace.s[:, 0]).all()


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
    p = shares(alpha, k, C=2.0)
    assert p.weights.tolist() == (alpha / k).tolist()
    assert p.C.tolist() == (alpha * 2.0 / k).tolist()
    assert p.sigma.tolist() == [0, 0, 0, 0]
    assert p.sigma_2 == 0
    assert shares(alpha, k, sigma=[1, 2, 3, 4], sigma_2=5).sigma.tolist() == [1, 2, 3, 4]


@pytest.mark.parametrize("v", [0.05, -0.05])
def test_in_steady_slip_the_shares_carry_the_whole_friction(v: float) -> None:
    model = GMS(shares([0.1, 0.2, 0.3, 0.4], [40.0, 30.0, 20.0, 10.0]), law="signed")
    trace = simulate(model, Prescribed(v), 30.0)
    assert (trace.states[-1] == "slip").all()
    force = float(np.sum(model.parameters.k * trace.z[-1]))
    assert force == pytest.approx(math.copysign(float(CURVE(v)), v), abs=1e-6)
    assert trace.F[-1] == pytest.approx(force, abs=1e-6)


def test_nothing_can_be_changed_afterwards() -> None:
    k = np.array([40.0, 10.0])
    p = bank(k)
    k[0] = 1.0
    assert p.k.tolist() == [40, 10]
    for name in ("k", "sigma", "C", "weights"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(p, name)[0] = 1.0
    with pytest.raises(AttributeError):
        p.v_c = 1.0  # type: ignore[misc]
    with pytest.raises(AttributeError):
        CURVE.F_c = 2.0  # type: ignore[misc]
    weights = np.array([1.0, 2.0])
    model = own({"k": weights}, weights=weights)
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
