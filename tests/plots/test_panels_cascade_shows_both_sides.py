"""The cascade shows every step of F with its two one-sided values, in the order of slipping."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Trace, simulate

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation

from plots import panels
from plots.panels._cascades import RESOLVED
from tests.helpers import open_loop, pulled_mass, stick_slip


@pytest.fixture(scope="module")
def run() -> Trace:
    return simulate(stick_slip("signed"), open_loop(), 60.0)


def in_window(run: Trace, window: tuple[float, float]) -> np.recarray:
    log = run.transitions
    return log[(log.t >= window[0]) & (log.t <= window[1])]


def labels(artists: list[object]) -> list[str]:
    return [a.get_text() for a in artists if isinstance(a, Annotation)]


def test_the_first_resolvable_cascade_is_found(run: Trace) -> None:
    window = panels.cascade_window(run)
    assert window is not None
    log = in_window(run, window)
    assert log.element.tolist() == [3, 2, 1, 0]
    assert window[0] == pytest.approx(15.83, abs=0.02)
    assert np.ptp(log.t) > RESOLVED


def test_dots_are_the_one_sided_values(run: Trace) -> None:
    drawn = panels.cascade(Figure().subplots(), run)
    line, before, after = drawn[:3]
    window = panels.cascade_window(run)
    assert window is not None
    log = in_window(run, window)
    for dots, values in ((before, log.F_before), (after, log.F_after)):
        assert isinstance(dots, Line2D)
        np.testing.assert_array_equal(dots.get_xdata(), log.t)
        np.testing.assert_array_equal(dots.get_ydata(), values)
    curve = set(zip(line.get_xdata(), line.get_ydata(), strict=True))  # type: ignore[attr-defined]
    for values in (log.F_before, log.F_after):
        assert set(zip(log.t.tolist(), values.tolist(), strict=True)) <= curve
    lines = [a for a in drawn[3:] if isinstance(a, Line2D)]
    assert [a.get_xdata()[0] for a in lines] == log.t.tolist()
    assert labels(drawn) == ["E4", "E3", "E2", "E1"]


def test_a_subset_marks_its_own_steps_only(run: Trace) -> None:
    assert labels(panels.cascade(Figure().subplots(), run, elements=[0, 2])) == ["E3", "E1"]


def test_break_aways_at_one_instant_share_a_label(run: Trace) -> None:
    first = float(run.transitions.t[0])
    drawn = panels.cascade(Figure().subplots(), run, around=first)
    assert labels(drawn) == ["E1 E2 E3 E4"]
    np.testing.assert_array_equal(drawn[1].get_ydata(), run.transitions.F_before[:4])  # type: ignore[attr-defined]


def test_within_makes_slow_break_aways_one_cascade() -> None:
    model, rig = pulled_mass()
    run = simulate(model, rig, 60.0)
    single = panels.cascade_window(run)
    assert single == pytest.approx((run.transitions.t[0] - 0.01, run.transitions.t[0] + 0.01))
    wide = panels.cascade_window(run, within=4.0)
    assert wide is not None
    assert in_window(run, wide).element.tolist() == [0, 1, 2, 3]


def test_margins_meet_zero_where_the_element_breaks_away(run: Trace) -> None:
    ax = Figure().subplots()
    drawn = panels.margins(ax, run)
    assert "10$^3$" in ax.get_ylabel()
    window = panels.cascade_window(run)
    assert window is not None
    part = panels.shown(run, window)
    for i, line in enumerate(drawn[:4]):
        np.testing.assert_array_equal(line.get_xdata(), part.t)  # type: ignore[attr-defined]
        np.testing.assert_allclose(
            line.get_ydata(),
            1e3 * (1 - np.abs(part.z / part.s)[:, i]),  # type: ignore[attr-defined]
        )
    for i, dots in enumerate(drawn[5:9]):
        mine = in_window(run, window)
        assert dots.get_xdata() == mine.t[mine.element == i]  # type: ignore[attr-defined]
        assert dots.get_ydata() == pytest.approx(0.0, abs=1e-9)  # type: ignore[attr-defined]


def test_a_run_without_break_aways_has_no_cascade() -> None:
    run = simulate(stick_slip("signed"), open_loop(), 0.5)
    assert panels.cascade_window(run) is None
    ax = Figure().subplots()
    _, before, after = panels.cascade(ax, run)
    assert before.get_xdata().size == after.get_xdata().size == 0  # type: ignore[attr-defined]
    assert ax.get_xlim() == (0.0, 0.5)


def test_a_nanosecond_reads_as_one(run: Trace) -> None:
    t = float(run.transitions.t[0])
    ax = Figure().subplots()
    panels.cascade(ax, run, window=(t - 1e-9, t + 1e-9))
    assert ax.get_xlabel().endswith("s [ns]")
    assert all(len(label.get_text()) <= 5 for label in ax.get_xticklabels())
