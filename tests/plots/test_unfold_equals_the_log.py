"""Unfolded micro-steps have the order, the forces and the states of the transition log."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    Prescribed,
    State,
    Stribeck,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.errors import ParameterError

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.text import Annotation

from plots import figures, panels
from tests.helpers import FASTEST, FIG4_SINE, bank, pulled_mass, stick_slip
from tests.plots.systems_to_draw import BLOCKS
from tests.plots.systems_to_draw import run as of_system

Part = tuple[Trace, float, float]


def pulled() -> Part:
    """The pulled mass: a set of arrests at one time, then arrests and break-aways one by one."""
    return simulate(*pulled_mass(), 30.0, engine=FASTEST), 17.5, 21.5


def milliseconds() -> Part:
    """Four break-aways within 17 ms."""
    return simulate(stick_slip("published"), Prescribed(FIG4_SINE), 25.0), 20.1, 20.2


def alike(n: int, v: str, **numbers: Any) -> Trace:
    """Elements that break away at one time."""
    given = {"k": 1.0, "sigma": 0.0, "C": 0.1} | numbers
    lists = {name: np.broadcast_to(value, n) for name, value in given.items()}
    curve = Stribeck(1.0, 1.5, 0.05)
    parameters = GMSParameters(sigma_2=0.4, stribeck=curve, v_c=1e-6, **lists)
    return simulate(GMS(parameters, law="signed"), Prescribed(v), 2.0)


def twenty() -> Part:
    numbers = {"k": np.linspace(10, 40, 20), "sigma": 0.1, "C": 0.02, "weights": 0.01}
    return alike(20, "0.2", **numbers), 0.0, 2.0


def contact() -> Part:
    """One of two contacts of a system."""
    trace = of_system(BLOCKS).contact("pad2")
    return trace, float(trace.t[0]), float(trace.t[-1])


@pytest.mark.parametrize(
    ("make", "instants", "firings"),
    [(pulled, 7, 10), (milliseconds, 4, 4), (twenty, 1, 20), (contact, None, None)],
)
def test_stairs_are_the_forces_of_the_log_and_columns_have_its_order(
    make: Callable[[], Part], instants: int | None, firings: int | None
) -> None:
    trace, t0, t1 = make()
    log = trace.transitions[(trace.transitions.t >= t0) & (trace.transitions.t <= t1)]
    part = panels.unfolded(trace, t0, t1)
    assert instants is None or (part.times.size, log.size) == (instants, firings)
    ax = Figure(figsize=(10, 4)).subplots()
    drawn = panels.unfolded_force(ax, part)
    stairs = [each for each in drawn if isinstance(each, Line2D)][: part.times.size]
    factor = {"$F$ [N]": 1.0, "$F$ [mN]": 1e3}[ax.get_ylabel()]
    assert part.times.tolist() == np.unique(log.t).tolist()
    for t, line in zip(part.times, stairs, strict=True):
        mine = log[log.t == t]
        levels = np.asarray(line.get_ydata())[::2] / factor  # one per column
        np.testing.assert_allclose(levels[1:], mine.F_after, rtol=1e-15)
        np.testing.assert_allclose(levels[:-1], mine.F_before, rtol=1e-15)
    fired = [each for each in part.columns if each.edge]
    assert [(each.element, each.edge) for each in fired] == list(
        zip(log.element.tolist(), log.edge.tolist(), strict=True)
    )
    assert [float(part.times[each.instant]) for each in fired] == log.t.tolist()
    assert (np.diff([each.left for each in part.columns]) > 0.999).all()
    for each in part.columns:  # the states are those of the rows of the run
        rows = (trace.t == part.times[each.instant]) & (trace.microstep == each.step)
        assert each.modes == tuple(trace.modes[np.flatnonzero(rows)[-1]].tolist())
    if make is contact:  # far from zero, with few digits
        return
    # Written values tell before from after.
    texts = [each.get_text() for each in drawn if isinstance(each, Annotation)]
    for text, each in zip(texts, part.columns, strict=True):
        assert float(text.replace("−", "-")) == pytest.approx(each.F, rel=6e-3)
    for k in range(part.times.size):
        own = [t for t, each in zip(texts, part.columns, strict=True) if each.instant == k]
        assert len(set(own)) == len(own)


def test_frames_and_names_show_who_fired() -> None:
    trace, t0, t1 = milliseconds()
    figure = figures.unfold(trace, t0, t1)
    ax = figure.axes[1]
    frames = [each for each in ax.patches if isinstance(each, Rectangle) and each.get_zorder() == 5]
    log = trace.transitions[(trace.transitions.t >= t0) & (trace.transitions.t <= t1)]
    assert [int(each.get_y()) for each in frames] == log.element.tolist()
    texts = [each.get_text() for each in ax.texts if isinstance(each, Annotation)]
    edges = [text.replace("\n", "") for text in texts if text.startswith("break")]
    assert edges == log.edge.tolist()
    gaps = [f"+{each:.4g} ms" for each in 1e3 * np.diff(log.t)]
    assert [text for text in texts if text[0] in "t+"] == [f"t = {log.t[0]:.9g} s", *gaps]
    assert "17.16 ms" in figure.get_suptitle()


def test_firings_of_others_are_one_column() -> None:
    trace = simulate(stick_slip("signed"), Prescribed("0.2"), 3.0)
    log, t = trace.transitions, float(trace.transitions.t[0])
    part = panels.unfolded(trace, t, t, elements=[0, 2])
    firings = [(each.step, each.element) for each in part.columns]
    assert firings == [(0, -1), (1, 0), (2, -1), (3, 2)]
    assert [each.F for each in part.columns[2:]] == [log.F_before[2], log.F_after[2]]
    figure = figures.unfold(trace, t, t, elements=[0, 2])
    assert "others" in [each.get_text() for each in figure.axes[1].texts]


def test_too_many_columns_name_a_window_that_works_or_say_to_choose_elements() -> None:
    trace = simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 60.0)
    with pytest.raises(
        ParameterError, match=r"there are \d+ columns from 0 to 60 s; at most 24"
    ) as error:
        figures.unfold(trace, 0.0, 60.0)
    t0, t1 = ast.literal_eval(error.value.advice.removeprefix("choose the window "))
    assert 20 <= len(panels.unfolded(trace, t0, t1).columns) <= 24
    trace = alike(30, "1")
    with pytest.raises(ParameterError, match="31 columns are at t = "):
        figures.unfold(trace, 0.0, 2.0)
    assert len(panels.unfolded(trace, 0.0, 2.0, elements=[0, 1, 2]).columns) == 4
    trace = simulate(stick_slip("signed"), Prescribed("0"), 1.0)
    with pytest.raises(ParameterError, match="the run has no transitions"):
        figures.unfold(trace, 0.0, 1.0)


def test_elements_that_stay_and_short_names() -> None:
    trace = simulate(bank(4), Prescribed("0.3"), 0.3)
    assert len(trace.transitions) == 1
    figures.unfold(trace, 0.0, 0.3)
    edges = (
        Transition("go", "a", "b", guard="x >= 0.1"),
        Transition("on", "b", "a", guard="x < 0"),
    )
    chart = Chart("own", ("v", "x"), (), (), (State("a"), State("b")), edges, {"F": "0*v"})
    run = simulate(ChartModel(chart, {}), Prescribed("0.2*cos(t)"), 5.0)
    texts = {text.get_text() for ax in figures.unfold(run, 0.0, 5.0).axes for text in ax.texts}
    assert {"go", "on"} <= texts
