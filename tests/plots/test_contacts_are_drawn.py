"""Figures, panels, live charts and replay pages draw the run of one contact of a system."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gms_fsm.errors import ParameterError
from gms_fsm.inspection.explain import explain
from gms_fsm.systems.system import System
from gms_fsm.traces.trace import Trace
from plots import LiveChart, replay, statechart
from tests.plots.stored import column, data_of, integers, log, same
from tests.plots.systems_to_draw import BALL, BLOCKS, END_STOP, PULLED, STICTION, run

pytest.importorskip("matplotlib", reason="figures need the extra 'plots'")

from plots import _elements, figures, panels  # after the skip
from plots._matplotlib import Axes, Figure

FIGURES = ("overview", "ribbons_figure", "cascade_figure", "phase")
LAGS = {"lag_between_ticks", "lag_over_period", "lag_over_time"}
OTHERS = {"cascade_window", "difference", "has_threshold", "residual", "shown", "slip_bar", *LAGS}
OF_AN_ELEMENT = {"landscape", "pins", "race"}
UNFOLDED = {"Unfolded", "unfolded", "unfolded_force", "unfolded_states"}
OTHERS |= {"arrows", "lettered", "stribeck", *OF_AN_ELEMENT, *UNFOLDED}
PANELS = tuple(sorted({*panels.__all__} - OTHERS))


@pytest.fixture
def ax() -> Axes:
    """Return empty axes."""
    return Figure().subplots()


def stored(trace: Trace) -> dict[str, Any]:
    """Return the data of the only run of a replay page."""
    pytest.importorskip("uplot", reason="a page needs the extra 'replay'")
    (only,) = data_of(replay(trace).html)["runs"]
    return dict(only)


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES)
@pytest.mark.parametrize(
    ("system", "contact"), [(PULLED, "pad"), (BALL, "floor"), (BLOCKS, "pad2")]
)
def test_every_figure_takes_a_contact(name: str, system: System, contact: str) -> None:
    figure = getattr(figures, name)(run(system).contact(contact))
    assert figure.get_suptitle().startswith(f"{contact}: ")


@pytest.mark.parametrize("name", PANELS)
def test_every_panel_takes_a_contact(name: str, ax: Axes) -> None:
    assert getattr(panels, name)(ax, run(BLOCKS).contact("pad2"))


@pytest.mark.parametrize(
    ("system", "contact"), [(PULLED, "pad"), (BALL, "floor"), (BLOCKS, "pad2")]
)
def test_landscape_and_micro_steps_take_a_contact(system: System, contact: str) -> None:
    trace = run(system).contact(contact)
    t = trace.transitions.t
    for figure in (
        figures.landscape(trace, 0, row=len(trace) // 2),
        figures.unfold(trace, float(t[0]), float(t[min(4, t.size - 1)])),
    ):
        assert figure.get_suptitle().startswith(f"{contact}: ")


@pytest.mark.parametrize("name", ["deflections", "ratio"])
def test_a_chart_without_variables_has_no_deflection(name: str, ax: Axes) -> None:
    (note,) = getattr(panels, name)(ax, run(PULLED))
    assert note.get_text() == "no deflection:\nthis chart has no variables"


def test_a_chart_without_variables_has_no_schematic(ax: Axes) -> None:
    with pytest.raises(ParameterError, match=r"this chart has no variables; draw the chart with"):
        _elements.elements_at(ax, run(PULLED))


def test_the_picture_of_a_run_counts_bounces() -> None:
    trace = run(BALL)
    bounces = int((trace.transitions.edge == "bounce").sum())
    assert bounces > 3
    assert f"taken {bounces} times" in statechart(END_STOP, counts=trace).source


def test_a_live_chart_marks_guards_that_read_the_force() -> None:
    """At the release F is above F_s; just before it, and while the mass moves, it is not."""
    trace = run(PULLED)
    shown, (first, *_) = LiveChart(trace), np.flatnonzero(trace.microstep > 0)
    (look,) = shown.look(int(first))
    assert (look.fired, look.source, look.marks["release_forward"]) == (
        "release_forward",
        "stuck",
        (True,),
    )
    (before,) = shown.look(int(first) - 2)
    assert before.marks == {"release_forward": (False,), "release_backward": (False,)}


@pytest.mark.slow
@pytest.mark.parametrize("contact", ["pad1", "pad2"])
def test_a_firing_belongs_to_its_own_contact(contact: str) -> None:
    """A row made by another contact's firing is not taken for one of this contact."""
    trace = run(BLOCKS).contact(contact)
    made = [
        row
        for row in np.flatnonzero(trace.microstep > 0).tolist()
        if any(edge.past for edge in explain(trace, row, 0))
    ]
    assert len(made) == len(trace.transitions) < (trace.microstep > 0).sum()
    assert [LiveChart(trace).look(row)[0].fired for row in made] == trace.transitions.edge.tolist()
    page = stored(trace)
    rows, _, _, made_rows = log(page["contacts"][0])
    assert made_rows.all()
    assert column(page, page["t"])[rows].tolist() == trace.transitions.t.tolist()


def test_a_page_of_a_chart_without_variables_has_no_plot_of_elements() -> None:
    (contact,) = stored(run(PULLED))["contacts"]
    assert contact["variables"] == []
    assert {edge["name"] for edge in contact["edges"]} == {e.name for e in STICTION.transitions}


@pytest.mark.slow
def test_a_page_shows_the_force_that_guards_read() -> None:
    """F is stored bit for bit where guards read it."""
    trace = run(PULLED)
    page = stored(trace)
    own = integers(page["between"]) == 0
    F = column(page, page["contacts"][0]["values"]["F"]["all"])[own]
    assert same(F, trace.F[integers(page["number"])[own]])
