"""The Stribeck curve with an exponent and a load: text, numbers, files, sweeps and stops."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import ChartModel, LuGre, Prescribed, Stribeck, System, simulate, sweep
from gms_fsm.charts import CHARTS
from gms_fsm.charts.stribeck import stribeck_text
from gms_fsm.language import evaluate, parse_value
from gms_fsm.systems.models import with_values
from tests.helpers import FASTEST

NUMBERS = {"F_c": 1.0, "F_s": 1.5, "v_s": 1e-3}
V = np.linspace(-5e-3, 5e-3, 41)


def lugre(delta: float = 2.0) -> LuGre:
    curve = Stribeck(**NUMBERS, delta=delta)
    return LuGre(sigma_0=1e4, sigma_1=10.0, sigma_2=0.4, stribeck=curve)


def test_the_default_is_the_curve_of_the_paper_to_the_last_character() -> None:
    text = "F_c + (F_s - F_c) * exp(-(v / v_s)**2)"
    assert Stribeck(1.0, 1.5, 1e-3).text == text == stribeck_text() == stribeck_text(delta="2.0")
    assert Stribeck(1.0, 1.5, 1e-3).dip == 6.1 * 1e-3
    assert "delta" not in Stribeck(1.0, 1.5, 1e-3).numbers


@pytest.mark.parametrize("delta", [0.5, 1.0, 1.5, 3.0])
def test_another_exponent(delta: float) -> None:
    curve = Stribeck(**NUMBERS, delta=delta)
    wanted = 1.0 + 0.5 * np.exp(-((np.abs(V) / 1e-3) ** delta))
    assert curve(V) == pytest.approx(wanted, rel=1e-15)
    assert curve(curve.dip) - 1.0 < 1e-15 < curve(0.5 * curve.dip) - 1.0


@pytest.mark.parametrize("stops", [False, True])
def test_a_load_is_a_factor(stops: bool) -> None:
    text = stribeck_text(delta="delta", load="(N / 10)**n", stops=stops)
    names = {**NUMBERS, "delta": 1.5, "N": 20.0, "n": 0.7, "v": -2e-3}
    value = evaluate(parse_value(text, names), names)
    assert value == pytest.approx(2**0.7 * (1.0 + 0.5 * np.exp(-(2**1.5))), rel=1e-14)


def test_a_curve_that_falls_without_bound_is_nowhere_flat() -> None:
    assert Stribeck(1e-300, 1e300, 1e-3).flat == np.inf


def test_a_sweep_passes_the_gaussian() -> None:
    given, rig = [1.0, 2.0, 3.0], Prescribed("2e-3*sin(t)")
    swept = sweep(lugre(), rig, 6.0, {"delta": given}, engine=FASTEST)
    for i, delta in enumerate(given):
        assert swept.F[i] == simulate(lugre(delta), rig, 6.0).F[-1]
    assert with_values(lugre(), {"delta": 1.0}).stribeck.delta == 1.0


def test_files_keep_the_exponent(tmp_path: Path) -> None:
    from gms_fsm import Body, Contact

    model = ChartModel(
        CHARTS["lugre"], {"sigma_0": 1e4, "sigma_1": 0.0}, stribeck=Stribeck(**NUMBERS, delta=1.0)
    )
    for given in (model, lugre(1.0)):
        pad = Contact("pad", given)
        system = System("one", bodies=(Body("body", inertia=1.0),), contacts=(pad,))
        path = system.save(tmp_path / f"{type(given).__name__}.toml")
        assert System.load(path).contact("pad").stribeck == given.stribeck
    plain = System("one", bodies=(Body("body", inertia=1.0),), contacts=(Contact("pad", lugre()),))
    assert "delta" not in plain.save(tmp_path / "plain.toml").read_text()
