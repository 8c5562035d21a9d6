"""Every panel draws the numbers of the run with units, and respects window, elements and log.

State ribbons equal the transition log, span by span. The cascade shows every step of F with its two
one-sided values. Arrows of a phase portrait point along increasing time.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Trace, simulate

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation, Text

from gms_fsm import Chart, ChartModel, LuGre, Prescribed, State, Stribeck, Transition
from plots import figures, panels
from plots.panels.micro_steps.cascades import RESOLVED
from plots.panels.parts.selection import MOST_ROWS
from tests.helpers import (
    FASTEST,
    FIG4_SINE,
    non_drifting,
    open_loop,
    pulled_mass,
    stick_slip,
)
from tests.plots.systems_to_draw import BALL, BLOCKS, PULLED
from tests.plots.systems_to_draw import run as system_run


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
    times = np.linspace(0.0, 100.0, 20_000)
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


# --------------------------------------------------------------------------- ribbons
RIBBONS = {
    "sine": lambda: simulate(stick_slip("published"), open_loop(), 60.0),
    "pulled mass": lambda: simulate(*pulled_mass(), 60.0, engine=FASTEST),
    "wanted rows": lambda: simulate(*pulled_mass(), 60.0, t_eval=np.linspace(0.0, 60.0, 7)),
}


def by_hand(run: Trace, i: int, t0: float, t1: float) -> list[tuple[str, float, float]]:
    """Return the states of element i over time, read from the log in the simplest way."""
    spans, name, since = [], "stick", 0.0
    for record in run.transitions:
        if record.element == i:
            spans.append((name, since, float(record.t)))
            name, since = str(record.target), float(record.t)
    spans.append((name, since, float(run.t[-1])))
    cut = [(name, max(a, t0), min(b, t1)) for name, a, b in spans]
    return [span for span in cut if span[2] > span[1]]


def spans_of(artists: list[object]) -> list[list[tuple[float, float]]]:
    collections = [a for a in artists if isinstance(a, PolyCollection)]
    return [
        [(p.vertices[:, 0].min(), p.vertices[:, 0].max()) for p in c.get_paths()]
        for c in collections
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "window", "elements"),
    [
        ("sine", None, None),
        ("sine", (14.0, 31.0), [2, 0]),
        ("pulled mass", (14.0, 31.0), None),
        ("wanted rows", None, [2, 0]),
    ],
)
def test_ribbons_equal_the_log(
    name: str, window: tuple[float, float] | None, elements: list[int] | None, ax: Axes
) -> None:
    run = RIBBONS[name]()
    drawn = spans_of(panels.ribbons(ax, run, window=window, elements=elements))
    limits = window or (0.0, 60.0)
    chosen = range(4) if elements is None else elements
    expected = [
        [(a, b) for name, a, b in by_hand(run, i, *limits) if name == state]
        for i in chosen
        for state in ("stick", "slip")
    ]
    assert [len(spans) for spans in drawn] == [len(spans) for spans in expected]
    for mine, wanted in zip(drawn, expected, strict=True):
        np.testing.assert_allclose(mine, wanted, rtol=0, atol=1e-12)
    assert [label.get_text() for label in ax.get_yticklabels()] == [f"E{i + 1}" for i in chosen]
    assert ax.get_xlabel() == "t [s]"
    still = simulate(stick_slip("signed"), open_loop(), 0.5)  # one span per element
    assert spans_of(panels.ribbons(Figure().subplots(), still)) == [[(0.0, 0.5)], []] * 4


def test_slip_is_hatched_and_stick_is_not(run: Trace) -> None:
    stick, slip = panels.ribbons(Figure().subplots(), run)[:2]
    assert (stick.get_hatch() or "") == ""
    assert slip.get_hatch()


def test_names_are_drawn_only_where_they_fit(run: Trace) -> None:
    def shown_names(axes: Axes) -> list[str]:
        canvas.draw()
        renderer = canvas.get_renderer()
        names = [a for a in axes.texts if a.get_text() in ("stick", "slip")]
        for name in names:
            if name.fits(renderer):  # type: ignore[attr-defined]
                a, b = axes.transData.transform([(t, 0) for t in name.span])[:, 0]  # type: ignore[attr-defined]
                box = Text.get_window_extent(name, renderer)
                assert a <= box.x0
                assert box.x1 <= b
        return [a.get_text() for a in names if a.fits(renderer)]  # type: ignore[attr-defined]

    wide, narrow = Figure(figsize=(16, 3)), Figure(figsize=(1.2, 3))
    counts = []
    for figure in (wide, narrow):
        canvas = FigureCanvasAgg(figure)
        ax = figure.subplots()
        panels.ribbons(ax, run)
        counts.append(len(shown_names(ax)))
    assert counts[0] > 16
    assert counts[1] < counts[0]


# --------------------------------------------------------------------------- cascades
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
    run = simulate(*pulled_mass(), 60.0, engine=FASTEST)
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


# --------------------------------------------------------------------------- phase portraits
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
    fine = once.refined(5_000)
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
    for row in (40, None):
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


# --------------------------------------------------------------------------- contacts of systems
@pytest.mark.slow
@pytest.mark.parametrize(
    ("system", "contact"),
    [
        pytest.param(PULLED, "pad", marks=pytest.mark.matrix),
        pytest.param(BALL, "floor", marks=pytest.mark.matrix),
        (BLOCKS, "pad2"),
    ],
)
def test_every_figure_takes_a_contact(system: object, contact: str) -> None:
    trace = system_run(system).contact(contact)  # type: ignore[arg-type]
    t = trace.transitions.t
    for figure in (
        *(make(trace) for make in (figures.overview, figures.ribbons_figure, figures.phase)),
        figures.cascade_figure(trace),
        figures.landscape(trace, 0, row=len(trace) // 2),
        figures.unfold(trace, float(t[0]), float(t[min(4, t.size - 1)])),
    ):
        assert figure.get_suptitle().startswith(f"{contact}: ")


@pytest.mark.parametrize("name", ["deflections", "ratio"])
def test_a_chart_without_variables_has_no_deflection(name: str, ax: Axes) -> None:
    (note,) = getattr(panels, name)(ax, system_run(PULLED))
    assert note.get_text() == "no deflection:\nthis chart has no variables"
