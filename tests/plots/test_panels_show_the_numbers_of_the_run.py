"""Every panel draws the numbers of the run with units, and respects window, elements and log."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Trace, simulate

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gms_fsm import Chart, ChartModel, LuGre, Prescribed, State, Stribeck, Transition
from plots import figures, panels
from plots.panels._shown import MOST_ROWS
from tests.helpers import FIG4_SINE, non_drifting, open_loop, pulled_mass, stick_slip


@pytest.fixture(scope="module")
def run() -> Trace:
    return simulate(stick_slip("signed"), open_loop(), 60.0)


@pytest.fixture(scope="module")
def lugre() -> Trace:
    model = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
    return simulate(model, non_drifting("signed")[1], 5.0)


@pytest.fixture
def ax() -> Axes:
    return Figure().subplots()


def drawn(line: object) -> tuple[np.ndarray, np.ndarray]:
    assert isinstance(line, Line2D)
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


def holds_all(x: np.ndarray, y: np.ndarray, xs: np.ndarray, ys: np.ndarray) -> bool:
    """Return whether every point (xs, ys) is among (x, y)."""
    return set(zip(xs.tolist(), ys.tolist(), strict=True)) <= set(
        zip(x.tolist(), y.tolist(), strict=True)
    )


def test_velocity_and_force_contain_every_row(run: Trace, ax: Axes) -> None:
    (line,) = panels.velocity(ax, run)
    assert holds_all(*drawn(line), run.t, run.v)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("t [s]", "v [m/s]")
    (line,) = panels.force(ax, run)
    assert holds_all(*drawn(line), run.t, run.F)
    assert ax.get_ylabel() == "F [N]"
    _, first, third = panels.force(ax, run, elements=[0, 2])
    assert holds_all(*drawn(third), run.t, run.F_elements[:, 2])
    assert [first.get_label(), third.get_label()] == ["$F_{1}$", "$F_{3}$"]


def test_units_fit_the_values(ax: Axes) -> None:
    slow = simulate(stick_slip("signed"), Prescribed("2e-5*sin(t)"), 3.0)
    (line,) = panels.velocity(ax, slow)
    assert ax.get_ylabel() == "v [µm/s]"
    assert drawn(line)[1].max() == pytest.approx(20.0, rel=1e-3)


def test_ratio_has_lines_at_plus_and_minus_one(run: Trace, ax: Axes) -> None:
    *elements, up, down = panels.ratio(ax, run)
    assert [set(np.ravel(drawn(line)[1])) for line in (up, down)] == [{1.0}, {-1.0}]
    for i, line in enumerate(elements):
        assert holds_all(*drawn(line), run.t, (run.z / run.s)[:, i])
    assert "z / s(v) [" in ax.get_ylabel()


def test_lugre_has_no_threshold(lugre: Trace, ax: Axes) -> None:
    assert len(panels.ratio(ax, lugre)) == 1
    assert ax.get_ylabel() == "z / s(v) [mm/N]"
    (note,) = panels.margins(ax, lugre)
    assert "no threshold:\nthis chart has no edges" in note.get_text()


@pytest.mark.slow
def test_a_chart_without_s_has_no_threshold_line(ax: Axes) -> None:
    stop = Chart(
        "stop",
        ("v",),
        ("d",),
        ("k",),
        (State("free", {"d": "v"}), State("blocked", {"d": "0"})),
        (Transition("stop", "free", "blocked", guard="d >= 0.5"),),
        {"F": "k * d"},
    )
    trace = simulate(ChartModel(stop, {"k": 2.0}), Prescribed("0.4"), 2.0)
    (line,) = panels.ratio(ax, trace)
    assert drawn(line)[1].max() == pytest.approx(0.5)
    assert ax.get_ylabel() == "d"  # it may not be a deflection in metres
    (line,) = panels.deflections(Figure().subplots(), trace)
    assert line.get_label() == "d1"
    beside = figures.compare_laws({"one": trace, "two": trace})
    assert not any("s(v)" in text.get_text() for text in beside.axes[0].texts)
    (note,) = panels.margins(ax, trace)
    assert "no threshold:\nthis chart has no input s" in note.get_text()
    names = [text.get_text() for a in figures.ribbons_figure(trace).axes for text in a.texts]
    assert not any("threshold ratio" in name for name in names)


@pytest.mark.parametrize("panel", [panels.deflections, panels.ratio, panels.margins])
def test_elements_are_chosen_and_counted_from_one(run: Trace, ax: Axes, panel: object) -> None:
    panel(ax, run, window=(1.0, 9.0), elements=[2, 0])
    labels = ax.get_legend_handles_labels()[1]
    assert [label.strip("$z_E{}") for label in labels] == ["3", "1"]
    x, _ = drawn(ax.lines[0])
    assert (x[0], x[-1]) == (1.0, 9.0) == tuple(ax.get_xlim())


def test_looks_of_elements_differ(run: Trace, ax: Axes) -> None:
    lines = panels.deflections(ax, run)
    assert len({line.get_color() for line in lines}) == 4
    assert len({line.get_linestyle() for line in lines}) == 4


def test_a_window_is_smooth_and_exact(run: Trace, ax: Axes) -> None:
    (line,) = panels.velocity(ax, run, window=(15.0, 15.001))
    t, v = drawn(line)
    assert t.size >= 1000
    np.testing.assert_allclose(v, 0.2 * np.sin(2 * np.pi * t / 20), atol=1e-12)


def test_logarithmic_axes(run: Trace, ax: Axes) -> None:
    (line,) = panels.velocity(ax, run, log=True)
    assert ax.get_yscale() == "log"
    assert ax.get_ylabel() == "|v| [m/s]"
    assert (drawn(line)[1] >= 0).all()
    for panel, scale in ((panels.portrait, "log"), (panels.stribeck, "log")):
        other = Figure().subplots()
        panel(other, run, log=True)
        assert other.get_xscale() == scale
        other = Figure().subplots()
        panel(other, run, log=False)
        assert other.get_xscale() == "linear"


def test_portrait_counts_slipping_elements(run: Trace, ax: Axes) -> None:
    (pieces,) = panels.portrait(ax, run)
    points = np.concatenate([path.vertices for path in pieces.get_paths()])
    assert holds_all(points[:, 0], points[:, 1], run.v, run.F)
    assert set(pieces.get_array()) == {0, 1, 2, 3, 4}
    assert ax.get_xlabel() == "v [m/s]"
    bar = ax.figure.axes[1]
    assert bar.get_ylabel() == "elements in slip"
    (pieces,) = panels.portrait(ax, run, elements=[3], bar=False)
    assert set(pieces.get_array()) == {0, 1}
    # At the first row of each piece, the count is that of the row.
    part = panels.shown(run)
    starts = {
        tuple(path.vertices[0]): n
        for path, n in zip(pieces.get_paths(), pieces.get_array(), strict=True)
    }
    slips = part.states[:, 3] == "slip"
    rows = {(v, F): int(s) for v, F, s in zip(part.v, part.F, slips, strict=True)}
    assert all(rows[point] == n for point, n in starts.items() if point in rows)


@pytest.mark.slow
def test_hysteresis_in_phases_and_by_slipping(run: Trace, ax: Axes) -> None:
    (line,) = panels.hysteresis(ax, run)
    assert holds_all(*drawn(line), run.x - run.x[0], run.F)
    first, second = panels.hysteresis(ax, run, [("up", 5.0), ("rest", np.inf)])
    assert [first.get_label(), second.get_label()] == ["up", "rest"]
    (pieces,) = panels.hysteresis(ax, run, slipping=True)
    assert set(pieces.get_array()) == {0, 1, 2, 3, 4}
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [m]", "F [N]")


def test_stribeck_curve_and_measured_points(run: Trace, ax: Axes) -> None:
    v, F = np.array([-0.01, 0.02]), np.array([-0.5, 0.45])
    s, viscous, steady, points = panels.stribeck(ax, run, (v, F))
    model = run.model
    x, y = drawn(s)
    np.testing.assert_allclose(y, model.stribeck(x))
    np.testing.assert_allclose(drawn(viscous)[1], model.stribeck(x) + model.sigma_2 * x)
    np.testing.assert_array_equal(drawn(points), np.abs([v, F]))
    assert drawn(steady)[0].size > 0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("|v| [m/s]", "|F| [N]")


def test_residual_against_a_run_and_a_measurement(run: Trace, ax: Axes) -> None:
    other = simulate(stick_slip("published"), open_loop(), 60.0)
    band, line = panels.residual(ax, run, other)
    t, highest = drawn(line)
    width = float(t[1] - t[0])
    for place, high in list(zip(t.tolist(), highest.tolist(), strict=True))[1:-1:40]:
        part = np.linspace(place - width / 2, place + width / 2, 9)[1:-1]
        expected = np.abs(run.sample(part).F - other.sample(part).F)
        assert expected.max() <= 1.05 * high + 1e-9
    assert band.get_paths()[0].vertices[:, 1].max() == highest.max()
    assert (ax.get_yscale(), ax.get_ylabel()) == ("log", "|difference of F| [N]")
    times = np.linspace(2.0, 8.0, 50)
    measured = figures.Measured(times, times, run.sample(times).F + 0.25)
    ax = Figure().subplots()
    (line,) = panels.residual(ax, run, measured, log=False)
    np.testing.assert_allclose(drawn(line)[1], -0.25)
    assert ax.get_yscale() == "linear"


def test_a_difference_of_many_points_is_its_envelope() -> None:
    times = np.linspace(0.0, 10.0, 5000)
    values = 2.0 + np.sin(200 * times)
    band, line = panels.difference(Figure().subplots(), times, values, log=True)
    t, highest = drawn(line)
    for place, high in zip(t.tolist(), highest.tolist(), strict=True):
        inside = np.abs(times - place) < 0.0099
        assert values[inside].max() <= high <= values.max()
    low, high = (f(band.get_paths()[0].vertices[:, 1]) for f in (np.min, np.max))
    assert (low, high) == (values.min(), values.max())
    (few,) = panels.difference(Figure().subplots(), times[:900], values[:900])
    np.testing.assert_array_equal(drawn(few)[1], values[:900])


@pytest.mark.slow
def test_a_long_run_is_thinned_but_keeps_extremes_and_switches() -> None:
    times = np.linspace(0.0, 100.0, 60_000)
    run = simulate(stick_slip("published"), Prescribed(FIG4_SINE), 100.0, t_eval=times)
    part = panels.shown(run)
    assert len(part) <= MOST_ROWS
    for name in ("v", "F", "x"):
        whole, kept = getattr(run, name), getattr(part, name)
        assert (kept.min(), kept.max()) == (whole.min(), whole.max())
    switched = np.flatnonzero((np.diff(run.rows.mode, axis=0) != 0).any(axis=1))
    for rows in (switched, switched + 1):
        assert np.isin(run.t[rows], part.t).all()
    assert len(panels.shown(run, (10.0, 10.5))) < 3000


def test_rows_of_a_requested_grid_include_the_switches() -> None:
    model, rig = pulled_mass()
    run = simulate(model, rig, 20.0, t_eval=[0.0, 10.0, 20.0])
    part = panels.shown(run)
    assert len(part) > 2000
    assert np.isin(run.transitions.t, part.t).all()
    assert np.isin(run.transitions.F_before, part.F).all()
