"""Arrows of a phase portrait point along increasing time; the dot is at its row."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Trace, simulate
from gms_fsm.errors import ParameterError

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.axes import Axes
from matplotlib.text import Annotation

from plots import figures, panels
from tests.helpers import FASTEST, open_loop, pulled_mass, stick_slip


def arrows_of(ax: Axes) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return tails and tips of the arrows, in pixels."""
    found = [each for each in ax.texts if isinstance(each, Annotation) and each.arrow_patch]
    return [(ax.transData.transform(each.xyann), ax.transData.transform(each.xy)) for each in found]


def times_of(ax: Axes, t: np.ndarray, path: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return the times at which a path passes within a pixel of a point."""
    return np.asarray(t[np.hypot(*(ax.transData.transform(path) - point).T) < 1.0])


@pytest.fixture(scope="module")
def once() -> Trace:
    """Half a cycle: no point of the path is passed twice."""
    return simulate(stick_slip("signed"), open_loop(), 14.0)


@pytest.mark.parametrize("panel", [0, 1], ids=["x", "v"])
def test_tips_are_later_than_tails(once: Trace, panel: int) -> None:
    figure = figures.phase(once)
    ax = figure.axes[panel]
    fine = once.refined(20_000)
    path = np.column_stack([(fine.x - fine.x[0], fine.v)[panel], fine.F])
    found = arrows_of(ax)
    assert len(found) >= 5
    checked = 0
    for tail, tip in found:
        before, after = (times_of(ax, fine.t, path, point) for point in (tail, tip))
        if before.size and after.size and max(np.ptp(before), np.ptp(after)) < 1.0:
            assert after.mean() > before.mean()
            checked += 1
    assert checked >= 4


def test_arrows_are_evenly_spaced(once: Trace) -> None:
    ax = figures.phase(once).axes[0]
    tips = np.array([tip for _, tip in arrows_of(ax)]) / ax.figure.dpi  # type: ignore[operator]
    away = np.hypot(*np.diff(tips, axis=0).T)
    assert (away < 1.11).all()  # a chord is shorter than the path
    assert np.median(away) > 0.8


def test_a_path_that_repeats_itself_does_not_pile_up_arrows() -> None:
    run = simulate(*pulled_mass(), 60.0, engine=FASTEST)
    for ax in figures.phase(run).axes[:2]:
        tips = np.array([tip for _, tip in arrows_of(ax)]) / ax.figure.dpi  # type: ignore[operator]
        apart = np.hypot(*(tips[:, None] - tips).transpose(2, 0, 1)) + 9 * np.eye(len(tips))
        assert apart.min() > 0.2
        assert 10 < len(tips) < 60


def test_the_dot_is_at_the_row(once: Trace) -> None:
    for row in (40, -1, None):
        figure = figures.phase(once, row=row)
        place = -1 if row is None else row
        for ax, values in zip(figure.axes, (once.x - once.x[0], once.v), strict=False):
            (dot,) = (line for line in ax.lines if line.get_marker() == "o")
            assert dot.get_xydata()[0] == pytest.approx([values[place], once.F[place]])
        assert f"t = {once.t[place]:.9g} s" in figure.get_suptitle()


def test_the_default_row_is_in_the_window(once: Trace) -> None:
    figure = figures.phase(once, window=(2.0, 6.0))
    row = int(np.flatnonzero(once.t <= 6.0)[-1])
    assert f"dot at t = {once.t[row]:.9g} s" in figure.get_suptitle()
    with pytest.raises(
        ParameterError, match=r"row 0 is at t = 0 s, outside the window \(2.0, 6.0\)"
    ):
        figures.phase(once, row=0, window=(2.0, 6.0))


def test_both_panels_have_one_colour_bar(once: Trace) -> None:
    figure = figures.phase(once, elements=[0, 1])
    assert len(figure.axes) == 3
    assert figure.axes[2].get_ylabel() == "elements in slip"
    for ax in figure.axes[:2]:
        assert set(ax.collections[0].get_array()) == {0, 1, 2}


def test_a_path_without_length_has_no_arrows() -> None:
    run = simulate(stick_slip("signed"), open_loop(), 1.0, t_eval=[1.0])
    ax = figures.phase(run).axes[0]
    assert arrows_of(ax) == []
    assert panels.portrait(ax, run, bar=False)
