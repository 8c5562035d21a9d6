"""Every panel draws the numbers of the run with units, and respects window, elements and log.

State ribbons equal the transition log, span by span. The cascade shows every step of F with its two
one-sided values. Arrows of a phase portrait point along increasing time.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import SimulationError, Trace, simulate

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Annotation

from gms_fsm import Chart, ChartModel, LuGre, Prescribed, State, Stribeck, Transition
from plots import figures, panels
from plots.panels.micro_steps.cascades import RESOLVED
from plots.panels.parts.selection import MOST_ROWS, scaled
from plots.systems.elements import elements_figure
from tests.corpus import relay
from tests.helpers import (
    FASTEST,
    FIG4_SINE,
    bank,
    non_drifting,
    open_loop,
    pulled_mass,
    stick_slip,
)
from tests.plots.systems_to_draw import BLOCKS, PULLED
from tests.plots.systems_to_draw import run as system_run


@pytest.fixture(scope="module")
def run() -> Trace:
    return simulate(stick_slip("signed"), open_loop(), 60.0)


@pytest.fixture(scope="module")
def pulled() -> Trace:
    return simulate(*pulled_mass(), 60.0, engine=FASTEST)


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


@pytest.mark.slow
def test_lines_over_time_contain_every_row_in_units_that_fit(run: Trace, ax: Axes) -> None:
    (line,) = panels.velocity(ax, run)
    assert holds_all(*drawn(line), run.t, 1e3 * run.v)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$t$ [s]", "$v$ [mm/s]")
    whole, first, third = panels.force(ax, run, elements=[0, 2])
    assert holds_all(*drawn(whole), run.t, run.F)
    assert ax.get_ylabel() == "$F$ [N]"
    assert holds_all(*drawn(third), run.t, run.F_elements[:, 2])
    assert [first.get_label(), third.get_label()] == ["$F_{1}$", "$F_{3}$"]
    *elements, up, down = panels.ratio(ax, run)
    assert [set(np.ravel(drawn(line)[1])) for line in (up, down)] == [{1.0}, {-1.0}]
    for i, line in enumerate(elements):
        assert holds_all(*drawn(line), run.t, (run.z / run.s)[:, i])
    lines = panels.deflections(ax, run)
    assert len({line.get_color() for line in lines}) == 4
    assert len({line.get_linestyle() for line in lines}) == 4
    slow = simulate(stick_slip("signed"), Prescribed("2e-5*sin(t)"), 3.0)
    (line,) = panels.velocity(ax, slow)
    assert ax.get_ylabel() == "$v$ [µm/s]"
    assert drawn(line)[1].max() == pytest.approx(20.0, rel=1e-3)


@pytest.mark.parametrize("panel", [panels.deflections, panels.ratio, panels.margins])
def test_elements_are_chosen_and_counted_from_one(run: Trace, ax: Axes, panel: object) -> None:
    panel(ax, run, window=(1.0, 9.0), elements=[2, 0])
    labels = ax.get_legend_handles_labels()[1]
    assert [label.strip("$z_E{}") for label in labels] == ["3", "1"]
    x, _ = drawn(ax.lines[0])
    assert (x[0], x[-1]) == (1.0, 9.0) == tuple(ax.get_xlim())


@pytest.mark.slow
def test_charts_without_edges_variables_or_s_have_no_threshold_and_say_so(ax: Axes) -> None:
    model = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
    lugre = simulate(model, non_drifting("signed")[1], 5.0)
    assert len(panels.ratio(ax, lugre)) == 1
    assert ax.get_ylabel() == "$z / s(v)$ [µm/N]"
    (note,) = panels.margins(ax, lugre)
    assert "no threshold:\nthis chart has no edges" in note.get_text()
    for panel in (panels.deflections, panels.ratio):
        (note,) = panel(ax, system_run(PULLED))
        assert note.get_text() == "no deflection:\nthis chart has no variables"
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
    assert ax.get_ylabel() == "$d$"  # it may not be a deflection in metres
    (line,) = panels.deflections(Figure().subplots(), trace)
    assert line.get_label() == "d1"
    (note,) = panels.margins(ax, trace)
    assert "no threshold:\nthis chart has no input s" in note.get_text()


def test_a_window_is_smooth_and_exact_and_axes_may_be_logarithmic(run: Trace, ax: Axes) -> None:
    (line,) = panels.velocity(ax, run, window=(15.0, 15.001))
    t, v = drawn(line)
    assert t.size >= 1000
    np.testing.assert_allclose(v, 200 * np.sin(2 * np.pi * t / 20), atol=1e-9)
    (line,) = panels.velocity(ax, run, log=True)
    assert (ax.get_yscale(), ax.get_ylabel()) == ("log", "$|v|$ [mm/s]")
    assert (drawn(line)[1] >= 0).all()
    for panel in (panels.portrait, panels.stribeck):
        for log in (True, False):
            other = Figure().subplots()
            panel(other, run, log=log)
            assert other.get_xscale() == ("log" if log else "linear")


@pytest.mark.slow
def test_portrait_and_hysteresis_count_slipping_elements(run: Trace, ax: Axes) -> None:
    (pieces,) = panels.portrait(ax, run)
    points = np.concatenate([path.vertices for path in pieces.get_paths()])
    assert holds_all(points[:, 0], points[:, 1], 1e3 * run.v, run.F)
    assert set(pieces.get_array()) == {0, 1, 2, 3, 4}
    assert ax.get_xlabel() == "$v$ [mm/s]"
    assert ax.figure.axes[1].get_ylabel() == "elements in slip"
    (pieces,) = panels.portrait(ax, run, elements=[3], bar=False)
    assert set(pieces.get_array()) == {0, 1}
    # At the first row of each piece, the count is that of the row.
    part = panels.shown(run)
    starts = {
        tuple(path.vertices[0]): n
        for path, n in zip(pieces.get_paths(), pieces.get_array(), strict=True)
    }
    slips = part.states[:, 3] == "slip"
    rows = {(v, F): int(s) for v, F, s in zip(1e3 * part.v, part.F, slips, strict=True)}
    assert all(rows[point] == n for point, n in starts.items() if point in rows)

    ax = Figure().subplots()
    (line,) = panels.hysteresis(ax, run)
    assert holds_all(*drawn(line), run.x - run.x[0], run.F)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$x$ [m]", "$F$ [N]")
    first, second = panels.hysteresis(ax, run, [("up", 5.0), ("rest", np.inf)])
    assert [first.get_label(), second.get_label()] == ["up", "rest"]
    (pieces,) = panels.hysteresis(ax, run, slipping=True)
    assert set(pieces.get_array()) == {0, 1, 2, 3, 4}


def test_stribeck_curve_and_measured_points(run: Trace, ax: Axes) -> None:
    v, F = np.array([-0.01, 0.02]), np.array([-0.5, 0.45])
    s, viscous, steady, points = panels.stribeck(ax, run, (v, F))
    model = run.model
    x, y = drawn(s)
    speed = 1e-3 * x
    np.testing.assert_allclose(y, model.stribeck(speed))
    np.testing.assert_allclose(drawn(viscous)[1], model.stribeck(speed) + model.sigma_2 * speed)
    np.testing.assert_array_equal(drawn(points), np.abs([1e3 * v, F]))
    assert drawn(steady)[0].size > 0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$|v|$ [mm/s]", "$|F|$ [N]")


def test_of_many_points_of_a_difference_the_envelope_is_drawn() -> None:
    times = np.linspace(0.0, 10.0, 5000)
    values = 2.0 + np.sin(200 * times)
    ax = Figure().subplots()
    band, line = panels.difference(ax, times, values)
    assert (ax.get_yscale(), ax.get_ylabel()) == ("log", "|difference of $F$| [N]")
    assert band.get_label() == "lowest to highest in each 1/500 of the time"
    for place, high in zip(*(each.tolist() for each in drawn(line)), strict=True):
        assert values[np.abs(times - place) < 0.0099].max() <= high <= values.max()
    assert band.get_paths()[0].vertices[:, 1].min() == values.min()
    (few,) = panels.difference(Figure().subplots(), times[:900], values[:900])
    np.testing.assert_array_equal(drawn(few)[1], values[:900])


@pytest.mark.slow
def test_thinned_rows_keep_extremes_and_switches_and_a_requested_grid_gets_them() -> None:
    times = np.linspace(0.0, 100.0, 30_000)
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
    run = simulate(*pulled_mass(), 20.0, t_eval=[0.0, 10.0, 20.0])
    part = panels.shown(run)
    assert len(part) > 2000
    assert np.isin(run.transitions.t, part.t).all()
    assert np.isin(run.transitions.F_before, part.F).all()


# --------------------------------------------------------------------------- ribbons
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
def test_ribbons_equal_the_log(run: Trace, pulled: Trace) -> None:
    sparse = simulate(*pulled_mass(), 60.0, t_eval=np.linspace(0.0, 60.0, 7))
    for trace, window, elements in (
        (run, None, None),
        (pulled, (14.0, 31.0), [2, 0]),
        (sparse, None, [2, 0]),
    ):
        ax = Figure().subplots()
        found = spans_of(panels.ribbons(ax, trace, window=window, elements=elements))
        chosen, limits = elements or range(4), window or (0.0, 60.0)
        expected = [
            [(a, b) for name, a, b in by_hand(trace, i, *limits) if name == state]
            for i in chosen
            for state in ("stick", "slip")
        ]
        assert [len(spans) for spans in found] == [len(spans) for spans in expected]
        for mine, wanted in zip(found, expected, strict=True):
            np.testing.assert_allclose(mine, wanted, rtol=0, atol=1e-12)
        labels = [label.get_text() for label in ax.get_yticklabels()]
        assert labels == [f"E{i + 1}" for i in chosen]
    stick, slip = panels.ribbons(ax, run)[:2]
    assert (bool(stick.get_hatch()), bool(slip.get_hatch())) == (False, True)
    still = simulate(stick_slip("signed"), open_loop(), 0.5)  # one span per element
    assert spans_of(panels.ribbons(Figure().subplots(), still)) == [[(0.0, 0.5)], []] * 4


# --------------------------------------------------------------------------- cascades
def in_window(run: Trace, window: tuple[float, float] | None) -> np.recarray:
    assert window is not None
    log = run.transitions
    return log[(log.t >= window[0]) & (log.t <= window[1])]


def labels(artists: list[object]) -> list[str]:
    return [a.get_text() for a in artists if isinstance(a, Annotation)]


def test_the_first_resolvable_cascade_has_the_one_sided_values_of_the_log(run: Trace) -> None:
    window = panels.cascade_window(run)
    log = in_window(run, window)
    assert log.element.tolist() == [3, 2, 1, 0]
    assert window[0] == pytest.approx(15.83, abs=0.02)
    assert np.ptp(log.t) > RESOLVED
    artists = panels.cascade(Figure().subplots(), run)
    line, before, after = artists[:3]
    for dots, values in ((before, log.F_before), (after, log.F_after)):
        np.testing.assert_array_equal(drawn(dots), (log.t, values))
        assert holds_all(*drawn(line), log.t, values)
    lines = [a for a in artists[3:] if isinstance(a, Line2D)]
    assert [a.get_xdata()[0] for a in lines] == log.t.tolist()
    assert labels(artists) == ["E4", "E3", "E2", "E1"]
    assert labels(panels.cascade(Figure().subplots(), run, elements=[0, 2])) == ["E3", "E1"]
    # Break-aways at one instant share a label.
    first = float(run.transitions.t[0])
    artists = panels.cascade(Figure().subplots(), run, around=first)
    assert labels(artists) == ["E1 E2 E3 E4"]
    np.testing.assert_array_equal(drawn(artists[1])[1], run.transitions.F_before[:4])


def test_margins_meet_zero_where_the_element_breaks_away(run: Trace, ax: Axes) -> None:
    artists = panels.margins(ax, run)
    assert "10$^3$" in ax.get_ylabel()
    window = panels.cascade_window(run)
    part, log = panels.shown(run, window), in_window(run, window)
    for i, line in enumerate(artists[:4]):
        t, margin = drawn(line)
        np.testing.assert_array_equal(t, part.t)
        np.testing.assert_allclose(margin, 1e3 * (1 - np.abs(part.z / part.s)[:, i]))
    for i, dots in enumerate(artists[5:9]):
        assert dots.get_xdata() == log.t[log.element == i]
        assert dots.get_ydata() == pytest.approx(0.0, abs=1e-9)


def test_windows_of_cascades_are_wide_narrow_or_none(pulled: Trace, ax: Axes) -> None:
    first = pulled.transitions.t[0]
    assert panels.cascade_window(pulled) == pytest.approx((first - 0.01, first + 0.01))
    wide = panels.cascade_window(pulled, within=4.0)  # slow break-aways are one cascade
    assert in_window(pulled, wide).element.tolist() == [0, 1, 2, 3]
    still = simulate(stick_slip("signed"), open_loop(), 0.5)
    assert panels.cascade_window(still) is None
    _, before, after = panels.cascade(ax, still)
    assert before.get_xdata().size == after.get_xdata().size == 0
    assert ax.get_xlim() == (0.0, 0.5)


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


@pytest.mark.slow
def test_tips_of_arrows_are_later_than_tails(once: Trace) -> None:
    figure, fine = figures.phase(once), once.refined(5_000)
    for ax, across in zip(figure.axes[:2], (fine.x - fine.x[0], 1e3 * fine.v), strict=True):
        path, found = np.column_stack([across, fine.F]), arrows_of(ax)
        assert len(found) >= 5
        checked = 0
        for tail, tip in found:
            before, after = (times_of(ax, fine.t, path, point) for point in (tail, tip))
            if before.size and after.size and max(np.ptp(before), np.ptp(after)) < 1.0:
                assert after.mean() > before.mean()
                checked += 1
        assert checked >= 4
    run = simulate(stick_slip("signed"), open_loop(), 1.0, t_eval=[1.0])  # without length
    assert arrows_of(figures.phase(run).axes[0]) == []


@pytest.mark.slow
def test_the_dot_is_at_the_row_and_both_panels_have_one_colour_bar(once: Trace) -> None:
    in_window = int(np.flatnonzero(once.t <= 6.0)[-1])
    for row, window, place in ((30, None, 30), (None, None, -1), (None, (2.0, 6.0), in_window)):
        figure = figures.phase(once, row=row, window=window, elements=[0, 1])
        far = 1.0 if window is None else 1e3  # in the window x stays below a metre
        for ax, values in zip(figure.axes, (far * once.x, 1e3 * once.v), strict=False):
            (dot,) = (line for line in ax.lines if line.get_marker() == "o")
            assert dot.get_xydata()[0] == pytest.approx([values[place], once.F[place]])
            if window is None:
                assert set(ax.collections[0].get_array()) == {0, 1, 2}
        assert f"$t$ = {once.t[place]:.6g} s" in figure.get_suptitle()
        assert len(figure.axes) == 3
        assert figure.axes[2].get_ylabel() == "elements in slip"
    first = once.transitions[0]
    row = int(np.flatnonzero(once.t == first.t)[-1])
    said = figures.phase(once, row=row).get_suptitle()
    alone = (once.transitions.t == first.t).sum() == 1
    assert said.endswith(f" s: E{first.element + 1} {first.edge}" if alone else " s")


# --------------------------------------------------------------------------- contacts of systems
@pytest.mark.matrix
@pytest.mark.slow
def test_every_figure_takes_a_contact() -> None:
    trace = system_run(BLOCKS).contact("pad2")
    t = trace.transitions.t
    for figure in (
        *(make(trace) for make in (figures.overview, figures.ribbons_figure, figures.phase)),
        figures.cascade_figure(trace),
        figures.landscape(trace, 0, row=len(trace) // 2),
        figures.unfold(trace, float(t[0]), float(t[min(4, t.size - 1)])),
    ):
        assert figure.get_suptitle().startswith("pad2: ")


@pytest.mark.slow
def test_what_is_crowded_is_counted(ax: Axes) -> None:
    many = simulate(bank(30), Prescribed("0.3"), 2.0)
    assert len(panels.marks(ax, many)) > len(many.transitions) == 30
    narrow = Figure((1.0, 1.0)).subplots()
    panels.marks(narrow, many)
    assert any(text.get_text().endswith(" switches") for text in narrow.texts)
    fast = simulate(bank(2), Prescribed("6*cos(20*t)"), 10.0)
    assert np.bincount(fast.transitions.element).min() > 40
    picture, *_ = panels.heat(ax, fast)
    assert picture.get_array().shape[0] == 2


def test_what_stands_still_or_is_not_chosen_is_not_drawn(ax: Axes) -> None:
    chart = Chart(
        "own", variables=("z",), states=(State("only", flow={"z": "v"}),), outputs={"F": "z"}
    )
    rest = simulate(ChartModel(chart, {}), Prescribed("0"), 2.0)
    (lines,) = panels.portrait(ax, rest)
    assert panels.arrows(ax, lines) == []
    elements_figure(rest, -1, 1, "")
    slid = simulate(relay(n=2), Prescribed("0"), 3.0)
    assert len(slid.sliding) == 2
    one = len(panels.ribbons(ax, slid, elements=[1]))
    assert one < len(panels.ribbons(ax, slid, elements=[0, 1]))
    assert scaled(np.array([1e-20]), "m") == (1.0, "m")


def test_a_run_of_one_instant_has_no_axis_of_time(ax: Axes) -> None:
    with pytest.raises(SimulationError) as stopped:
        simulate(stick_slip("signed"), Prescribed("0.1*sqrt(-t)"), 5.0)
    assert stopped.value.trace is not None
    panels.velocity(ax, stopped.value.trace)
    assert ax.get_xlabel() == "$t$ [s]"
