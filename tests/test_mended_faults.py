"""Faults that were mended once and that no law, table or closed form would notice."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    Prescribed,
    Record,
    Slider,
    State,
    Stribeck,
    Transition,
    simulate,
)
from gms_fsm.charts import CHARTS
from tests.helpers import FASTEST


def test_an_edge_at_the_beginning_of_a_slide_is_shown_as_the_log_has_it() -> None:
    """Its row is of neither the arc before nor of the slide."""
    chart = Chart(
        "dry friction that remembers a rest",
        inputs=("v",),
        parameters=("F_c",),
        states=(State("moving"), State("stopped")),
        transitions=(Transition("stop", "moving", "stopped", guard="v <= 0"),),
        outputs={"F": "F_c * sgn(v)"},
    )
    trace = simulate(ChartModel(chart, {"F_c": 1.0}), Slider(1.0, "0.2"), 3.0, initial={"v": 1.0})
    (record,) = trace.transitions
    row = int(np.argmax(trace.states[:, 0] == "stopped"))
    assert trace.t[row] == record.t == trace.sliding.t_start[0]
    assert (record.F_before, record.F_after) == (trace.F[row - 1], trace.F[row])


@pytest.mark.parametrize("engine", sorted({"ifelse", FASTEST}))
def test_the_row_before_a_slide_is_of_the_arc_before(engine: str) -> None:
    chart = Chart("dry friction", ("v",), (), ("F_c",), (State("on"),), (), {"F": "F_c * sgn(v)"})
    model = ChartModel(chart, {"F_c": 1.0})
    how: Any = {"engine": engine, "initial": {"v": 1.0}, "max_step": 0.1}
    trace = simulate(model, Slider(1.0, "0.2"), 3.0, **how)
    row = int(np.argmax(trace.rows.mode[:, -1]))
    assert trace.F[row - 1 : row + 1] == pytest.approx([1.0, 0.2])


def test_v_is_zero_in_a_slide_also_where_a_step_ends_beyond_it() -> None:
    """Steps far too long for these bristles end where no sign holds the mass at rest."""
    parameters = GMSParameters(
        [17.3, 41.8, 4.16, 33.5],
        [0.292, 1.0, 0.18, 0.133],
        [0.416, 0.187, 0.279, 0.199],
        sigma_2=0.191,
        stribeck=Stribeck(0.154, 0.462, 0.035),
        v_c=1e-4,
        weights=[0.0492, 0.277, 0.0315, 0.0492],
    )
    model = GMS(parameters, law="published")
    trace = simulate(model, Slider(0.452, "9*cos(t)"), 6.0, method="euler", step=0.02)
    slides = trace.rows.mode[:, trace.n :].any(axis=1)
    assert slides.sum() > 10
    np.testing.assert_allclose(trace.v[slides], 0.0, rtol=0.0, atol=1e-14)


def test_a_crossing_a_few_ticks_before_a_corner_ends_no_run() -> None:
    """A velocity made from positions turns at 1e-17 m/s, and not at the sample's 0."""
    t = np.linspace(0.0, 20.0, 801)
    v = Record.from_arrays(time=t, position=1e-3 * np.sin(0.8 * np.pi * t)).motion().velocity
    model = ChartModel(CHARTS["maxwell-slip"], {"k": 1e4, "F_c": 1.0})
    run = simulate(model, Prescribed((t, v)), 20.0, engine="ifelse", t_eval=t)
    assert sum(edge.startswith("turn") for edge in run.transitions.edge) == 16
    assert np.abs(run.F).max() == pytest.approx(1.0, abs=1e-9)
