"""Parameters taken as linear do not move the elements, and the force is affine in them: all charts.

The charts' texts say which are; here runs of every included chart are the judge.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    Parameter,
    Prescribed,
    State,
    System,
    simulate,
)
from gms_fsm.charts.registry import registered
from gms_fsm.identification.candidates import BEHIND_BACKLASH, STIFFER_ONE_WAY
from gms_fsm.identification.play_bank import SPRING_WITH_PLAY
from gms_fsm.identification.problem.linear import linear_names
from gms_fsm.systems.models import demonstration, with_values
from gms_fsm.systems.mounted import mounted_alone
from gms_fsm.systems.numbers import value_in
from tests.helpers import matrix

RIG = Prescribed("0.1 * sin(3 * t) * exp(0.1 * t)")
CASES = [
    (name, law)
    for name, entry in registered().items()
    if not entry.chart(entry.laws[0] if entry.laws else "").locks
    and len(entry.chart(entry.laws[0] if entry.laws else "").velocities) == 1
    for law in (entry.laws or ("",))
]
KEPT = [("gms", "signed"), ("maxwell-slip", ""), ("elasto-plastic", ""), ("dahl", "")]


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize(("name", "law"), matrix(CASES, KEPT))
@pytest.mark.filterwarnings("ignore:published law")
def test_force_is_affine_in_them(name: str, law: str) -> None:
    model = demonstration(registered()[name], law)
    options: dict[str, Any] = {"t_eval": np.linspace(0.0, 2.0, 41), "atol": 1e-9, "rtol": 1e-8}
    options["engine"] = "ifelse"
    at = simulate(model, RIG, 2.0, **options)
    for each in linear_names(mounted_alone(model)):
        start = np.asarray(value_in(mounted_alone(model), each))
        step = np.maximum(np.abs(start), 0.1)
        runs = [
            simulate(with_values(model, {each: start + k * step}), RIG, 2.0, **options)
            for k in (1.0, 2.0)
        ]
        assert all(np.array_equal(run.states, at.states) for run in runs), each
        assert all(run.z == pytest.approx(at.z, abs=1e-7, nan_ok=True) for run in runs), each
        size = max(1.0, float(np.abs(runs[1].F).max()))
        assert pytest.approx(runs[0].F - at.F, abs=1e-9 * size) == runs[1].F - runs[0].F, each


def test_what_the_elements_feel_is_searched() -> None:
    expected = {"gms": {"k", "sigma"}, "maxwell-slip": set(), "backlash": set()}
    models = {name: demonstration(registered()[name], _law(name)) for name in expected}
    backlash = {"k": 3.0, "b": 1.0, "g": 0.2, "r": 0.3, "ratio": 1.5, "rho": 0.0, "v_s": 1.0}
    models |= {"behind": ChartModel(BEHIND_BACKLASH, backlash)}
    models |= {"stiffer": ChartModel(STIFFER_ONE_WAY, {"k": 3.0, "b": -1.0, "z_c": 0.4})}
    play = {"k_f": 1.0, "k_b": 1.0, "d_f": 1.0, "d_b": 1.0, "g": 0.1, "z_c": 0.4, "v_s": 1.0}
    models |= {"play": ChartModel(SPRING_WITH_PLAY, play)}
    expected |= {"play": {"k_f", "k_b", "d_f", "d_b"}}
    for name, model in models.items():
        linear = {*linear_names(mounted_alone(model))} - {"sigma_2"}
        assert linear == expected.get(name, {"k", "b"}), name


def _law(name: str) -> str:
    return "signed" if name == "gms" else ""


def _own(force: str, flow: str = "v", let: dict[str, str] | None = None) -> ChartModel:
    state, outputs = State("stick", flow={"z": flow}), {"F": force}
    chart = Chart("own", ("v",), ("z",), ("k", "b", "c"), (state,), (), outputs, let=let or {})
    return ChartModel(chart, {"k": 1.0, "b": 1.0, "c": 1.0})


@pytest.mark.parametrize(
    ("force", "flow", "let", "linear"),
    [
        ("k * z + b * abs(z) + c", "v", {}, {"k", "b", "c"}),
        ("k * z * b + c", "v", {}, {"b", "c"}),  # of a product, one is searched
        ("k**2 * z + b * c", "v", {}, {"c"}),
        ("k * z + c", "v / b", {}, {"k", "c"}),
        ("K * z + c", "v", {"K": "k * (1 + b)"}, {"b", "c"}),
        ("k * z + c", "K", {"L": "b + 1", "K": "v * L"}, {"k", "c"}),
        ("abs(k * z) + b * c", "v", {}, {"c"}),
    ],
)
def test_own_charts(force: str, flow: str, let: dict[str, str], linear: set[str]) -> None:
    assert {*linear_names(mounted_alone(_own(force, flow, let)))} - {"sigma_2"} == linear


@pytest.mark.parametrize(
    ("total", "linear"), [("b * F + c", {"k"}), ("F + v", {"k", "b", "c"}), ("F * F", set())]
)
def test_a_total_of_the_forces(total: str, linear: set[str]) -> None:
    state = State("stick", flow={"z": "v"}, outputs={"F": "k * z + b + c"})
    shared = [Parameter(name, per_element=False) for name in "bc"]
    chart = Chart("own", ("v",), ("z",), ("k", *shared), (state,), contact_outputs={"F": total})
    model = ChartModel(chart, {"k": 1.0, "b": 1.0, "c": 1.0})
    assert {*linear_names(mounted_alone(model))} - {"sigma_2"} == linear


def test_a_free_body_leaves_none() -> None:
    contact = Contact("pad", _own("k * z"), v="v")
    driven = System(
        "driven", bodies=(Body("b", velocity="w"),), contacts=(contact,), signals={"w": "sin(t)"}
    )
    free = System("free", bodies=(Body("b", inertia=1.0, force="sin(t)"),), contacts=(contact,))
    assert "pad.k" in linear_names(mounted_alone(driven))
    assert linear_names(mounted_alone(free)) == ()
