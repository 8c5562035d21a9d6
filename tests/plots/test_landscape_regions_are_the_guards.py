"""The region under the dot of a landscape has the truth that the run saw, at random rows."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from gms_fsm import ChartModel, Prescribed, PulledSlider, Stribeck, Trace, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.inspection.explain import explain
from gms_fsm.language import clauses
from plots._plane import Plane
from tests.helpers import FASTEST, pulled_mass
from tests.zoo.zoo_cases import karnopp, modelica

ROWS = 1000

FADING = Chart(  # the threshold fades with the speed: exp in a named expression
    "fading",
    inputs=("v", "x", "t"),
    variables=("z", "w"),
    parameters=("z_0", "v_f", "v_c"),
    let={"share": "0.2 + 0.8 * exp(-abs(v) / v_f)", "limit": "z_0 * share / (1 + w)"},
    states=(
        State("stick", flow={"z": "v"}),
        State("slip", flow={"z": "0.1 * (sgn(v) - z / limit)", "w": "abs(v)"}),
    ),
    transitions=(
        Transition("go", "stick", "slip", guard="abs(z) >= limit and v * z > 0"),
        Transition("stop", "slip", "stick", guard="abs(v) <= v_c or not t < 1e3"),
        Transition("lost", "slip", "stick", guard="1 / x < -1e9"),
    ),
    outputs={"F": "z"},
)


def gms() -> Trace:
    return simulate(*pulled_mass(), 60.0, engine=FASTEST)


def forces() -> Trace:
    return karnopp().run()


def load() -> Trace:
    return modelica().run()


def fading() -> Trace:
    model = ChartModel(FADING, {"z_0": 0.1, "v_f": 0.2, "v_c": 1e-4}, n=1)
    return simulate(model, Prescribed("0.3*sin(2*pi*t/5)"), 40.0)


def elasto() -> Trace:
    values = {"sigma_0": 1e3, "sigma_1": 10.0, "z_ba": 7e-4}
    model = ChartModel(
        CHARTS["elasto-plastic"], values, stribeck=Stribeck(1.0, 1.5, 0.05, 1.7), sigma_2=0.4
    )
    return simulate(model, PulledSlider(1.0, 2.0, 0.1), 40.0, engine=FASTEST)


@pytest.mark.slow
@pytest.mark.parametrize("run", [gms, forces, load, fading, elasto], ids=lambda run: run.__name__)
def test_random_rows(run: Callable[[], Trace]) -> None:
    trace = run()
    random = np.random.default_rng(18)
    seen: set[tuple[str, bool]] = set()
    for row in random.integers(0, len(trace), ROWS).tolist():
        element = int(random.integers(0, trace.n))
        plane = Plane.of(trace, row, element)
        why = explain(trace, row, element)
        assert [each.edge.name for each in why] == [edge.name for edge in plane.edges]
        for each in why:
            guard = plane.chart.guards[each.edge.name]
            assert plane.truths(guard, *plane.here) == each.holds, (row, element, each)
            parts = clauses(guard)
            told = [bool(plane.truths(part, *plane.here)) for part in parts]
            assert told == [clause.holds for clause in each.clauses], (row, element, each)
            seen |= {(each.edge.name, each.holds)}
    assert len({name for name, _ in seen}) >= 2
    assert {truth for _, truth in seen} == {True, False}


def test_elsewhere_named_expressions_and_s_are_computed_again() -> None:
    """At other points of the plane, limits are those of that velocity; w is held."""
    trace = fading()
    plane = Plane.of(trace, int(np.flatnonzero(trace.states[:, 0] == "stick")[-1]), 0)
    guard = plane.chart.guards["go"]
    w = plane.held["w"]
    assert w > 0.1
    for v in (1e-3, 0.1, 0.3, 2.0):
        limit = 0.1 * (0.2 + 0.8 * math.exp(-v / 0.2)) / (1 + w)
        assert plane.truths(guard, v, [0.999 * limit, 1.001 * limit]).tolist() == [False, True]
    trace = gms()
    plane = Plane.of(trace, 100, 2)
    guard, model = plane.chart.guards["break_away_forward"], trace.model
    for v in (1e-3, 0.05, 1.0):
        s = model.weights[2] * (1 + 0.5 * math.exp(-((v / 0.05) ** 2)))
        assert plane.truths(guard, v, [0.999 * s, 1.001 * s]).tolist() == [False, True]
