"""A landscape draws regions, clauses, path and dot of the row, and the race its margins.

The region under the dot has the truth that the run saw, at random rows.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import ChartModel, Prescribed, Trace, prove, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.charts.broken import BROKEN
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import ParameterError
from gms_fsm.language import clauses
from gms_fsm.session.explain import explain

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.quiver import Quiver
from matplotlib.text import Annotation

from plots import figures, panels
from plots.panels.guards.line_names import LineNames, NamedLine
from plots.panels.guards.racing import held_back_by
from plots.views.plane import Plane, linear_threshold, plane_axes
from tests.helpers import FASTEST, one_element, pulled_mass, stick_slip, wear
from tests.helpers import open_loop as sine
from tests.zoo.zoo_cases import elasto_plastic, karnopp, modelica

MM = 1e3


@pytest.fixture(scope="module")
def run() -> Trace:
    return simulate(*pulled_mass(), 20.0, engine=FASTEST)


def row_of(run: Trace, edge: str, element: int) -> int:
    """Return the row made by the first firing of an edge by an element."""
    log = run.transitions
    record = log[(log.edge == edge) & (log.element == element)][0]
    rows = np.flatnonzero((run.t == record.t) & (run.states[:, element] == record.target))
    return int(rows[0])


def regions(drawn: list[object]) -> dict[str, QuadContourSet]:
    found = {a.get_label(): a for a in drawn if isinstance(a, QuadContourSet) and a.filled}
    return {name: each for name, each in found.items() if not name.startswith("_")}


def test_the_axes_are_the_velocity_and_the_first_quantity_that_guards_read() -> None:
    names = ("gms-signed", "stiction", "backlash", "dog-clutch", "modelica", "planar-coulomb")
    known = {name: CHARTS[name] for name in names if name in CHARTS}
    found = {name: plane_axes(chart) for name, chart in known.items()}
    expected = {
        "stiction": ("v", "F"),
        "backlash": ("v", "x"),
        "dog-clutch": ("v", "t"),
        "modelica": ("v", "N"),
        "planar-coulomb": ("v", "h"),
    }
    assert found.items() >= expected.items()
    assert plane_axes(stick_slip("signed").chart) == ("v", "z")
    assert plane_axes(CHARTS["prandtl-tomlinson"]) is None


def test_the_axis_is_linear_a_decade_below_v_c() -> None:
    run = simulate(one_element("signed", v_c=1e-3), sine(), 1.0)
    assert linear_threshold(Plane.of(run, 0, 0), 0.2) == pytest.approx(1e-4)
    plane = Plane.of(elasto_plastic().run(), 10, 0)  # without a turn the largest speed decides
    assert linear_threshold(plane, 0.06) == pytest.approx(1e-5)


def test_dot_path_ranges_and_arrows_are_those_of_the_row(run: Trace) -> None:
    row = row_of(run, "break_away_forward", 2) - 40
    ax = Figure().subplots()
    drawn = panels.landscape(ax, run, 2, row=row)
    here = run.v[row], MM * run.z[row, 2]
    (dot,) = (each for each in drawn if getattr(each, "get_marker", lambda: "")() == "o")
    assert dot.get_xydata()[0] == pytest.approx(here)  # type: ignore[attr-defined]
    assert ax.get_ylabel() == "$z$ [mm]"
    low, high = ax.get_ylim()
    assert low < -MM * run.s[:, 2].max() < MM * run.s[:, 2].max() < high
    assert ax.get_xlim()[1] > np.abs(run.v).max()
    path = next(each for each in drawn if getattr(each, "get_label", str)() == "before")
    points = path.get_xydata()  # type: ignore[attr-defined]
    assert points[~np.isnan(points[:, 0])][-1] == pytest.approx(here)
    # While sticking dz/dt = v: arrows point up for v > 0, down for v < 0; all with dv/dt.
    (flow,) = (each for each in drawn if isinstance(each, Quiver))
    assert (np.sign(flow.V) == np.sign(flow.X)).all()  # type: ignore[attr-defined]
    slope = (run.v[row + 1] - run.v[row - 1]) / (run.t[row + 1] - run.t[row - 1])
    assert (np.sign(flow.U) == np.sign(slope)).all()  # type: ignore[attr-defined]


def test_regions_end_where_the_guard_turns(run: Trace) -> None:
    """A little outside the clauses the region is left, a little inside it is not."""
    row = row_of(run, "arrest", 0) - 3
    ax = Figure().subplots()
    found = regions(panels.landscape(ax, run, 0, row=row))
    assert list(found) == ["arrest"]
    s = MM * float(run.model.weights[0]) * 1.5
    (path,) = found["arrest"].get_paths()
    for v, z, inside in (
        (0.0, 0.0, True),
        (0.9e-6, 0.97 * s, True),
        (-0.9e-6, -0.97 * s, True),
        (1.2e-6, 0.0, False),
        (0.0, 1.03 * s, False),
    ):
        assert path.contains_point((v, z)) == inside, (v, z)


@pytest.mark.slow
def test_a_row_made_by_a_firing_shows_the_row_before(run: Trace) -> None:
    row = row_of(run, "break_away_forward", 1)
    figure = figures.landscape(run, 1, row=row)
    assert figure.axes[0].get_title(loc="left") == "guards that leave stick"
    texts = [text.get_text() for text in figure.texts[1:]]
    assert f"Row {row} was made by break_away_forward; shown is row {row - 1} before it" in texts[0]
    lanes = [text.get_text() for text in figure.axes[1].texts]
    assert "fired" in lanes
    assert all(text[0] == "✓" for text in lanes if text.endswith(("z >= s", " v > v_c")))
    title = figures.landscape(run, 0, t=5.0).get_suptitle()  # the last row at or before a time
    row = int(np.flatnonzero(run.t <= 5.0)[-1])
    assert title.endswith(f"$t$ = {run.t[row]:.6g} s, row {row}")


@pytest.mark.slow
def test_the_axis_of_v_has_the_unit_of_the_margins(run: Trace) -> None:
    row = row_of(run, "break_away_forward", 1) - 30
    left, right = figures.landscape(run, 1, row=row).axes
    amounts = [text.get_text().split() for text in right.texts]
    units = {words[-1] for words in amounts if words and words[-1].endswith("m/s")}
    (unit,) = units
    assert left.get_xlabel().startswith(f"$v$ [{unit}], linear below ")
    (linear,) = re.findall(r"10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)$", left.get_xlabel())
    power = int(linear.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")))
    shift = {"m/s": 0, "mm/s": -3, "µm/s": -6}[unit]
    assert left.xaxis.get_transform().linthresh == pytest.approx(10.0 ** (power + shift))


def test_bars_are_relative_margins_and_what_holds_an_edge_back_is_bold(run: Trace) -> None:
    row = row_of(run, "break_away_forward", 3) - 30
    drawn = panels.race(Figure().subplots(), run, 3, row=row)
    bars = [each for each in drawn if isinstance(each, Rectangle) and each.get_x() == 0.0]
    told = [clause for each in explain(run, row, 3) for clause in each.clauses]
    assert len(bars) == len(told)
    for bar, clause in zip(bars, told, strict=True):
        size = max(abs(clause.left), abs(clause.right))
        expected = float(np.clip(clause.margin / size, -1, 1))
        assert bar.get_width() == pytest.approx(expected)
        assert (bar.get_facecolor()[:3] != (1.0, 1.0, 1.0)) == clause.holds
    bold = [a.get_text() for a in drawn if getattr(a, "get_weight", str)() == "bold"]
    assert "✗  z >= s" in bold
    assert not [text for text in bold if text.startswith("✓")]
    # In slip at speed, |v| <= v_c is far from true, and |z| < s false by little.
    slips = np.flatnonzero((run.states[:, 0] == "slip") & (run.v > 0)).tolist()
    told = (explain(run, row, 0)[0] for row in slips)
    back = held_back_by(next(each for each in told if not any(c.holds for c in each.clauses)))
    assert back is not None
    assert back.text == "|v| <= v_c"


@pytest.mark.matrix
@pytest.mark.slow
def test_compound_clauses_have_a_mark_only_and_captions_say_what_is_held() -> None:
    trace = simulate(wear(), sine(), 30.0)
    row = int(np.flatnonzero(trace.states[:, 1] == "creep")[2])
    drawn = panels.race(Figure().subplots(), trace, 1, row=row)
    texts = [each.get_text() for each in drawn if hasattr(each, "get_text")]
    compound = [text for text in texts if "||" in text or "!" in text]
    assert len(compound) == 2
    assert all(text[0] in "✓✗" for text in compound)
    trace = modelica().run()
    row = int(np.flatnonzero(trace.states[:, 0] == "stuck")[2])
    said = " ".join(text.get_text().strip() for text in figures.landscape(trace, 0, row=row).texts)
    held = f"Held as at the row: F = {trace.F[row]:.4g} N. Computed at every point: load, F_0."
    assert held.replace("-", "−") in said


def test_no_look_of_a_line_has_two_meanings(run: Trace) -> None:
    figure = figures.landscape(run, 2, row=row_of(run, "break_away_forward", 2) - 40)
    legend = figure.axes[0].get_legend()
    assert legend is not None
    looks = {
        text.get_text(): (line.get_color(), line.get_linestyle(), line.get_linewidth())
        for line, text in zip(legend.get_lines(), legend.get_texts(), strict=True)
    }
    assert [*looks] == ["border", "path before", "after", "$±s(v)$"]
    assert len({*looks.values()}) == 4


def test_a_caption_stands_under_the_race_where_there_is_room(run: Trace) -> None:
    figure = figures.landscape(run, 2, row=row_of(run, "break_away_forward", 2) - 40)
    left, right = (ax.get_position() for ax in figure.axes)
    caption = [text.get_position() for text in figure.texts if text.get_text() != ""][1:]
    assert all(x > left.x1 and y < right.y0 for x, y in caption)


def test_names_of_one_line_stand_side_by_side_and_those_without_a_place_are_left_out() -> None:
    figure = Figure()
    names = LineNames(figure.subplots())
    line = np.array([[0.0, 0.5], [1.0, 0.5]])
    names.lines += [NamedLine(f"line {k}", "black", (line,)) for k in range(60)]
    placed = names.placed(FigureCanvasAgg(figure).get_renderer())
    boxes = [text.get_window_extent() for text in placed]
    assert 4 <= len(placed) < 60
    assert not any(b.overlaps(a) for k, b in enumerate(boxes) for a in boxes[:k])


def test_names_are_off_all_lines() -> None:
    figure = Figure()
    ax = figure.subplots()
    names, even = LineNames(ax), np.linspace(0.0, 1.0, 2000)
    level, upright = (
        np.column_stack(each) for each in ((even, 0.3 + 0 * even), (0.6 + 0 * even, even))
    )
    wave = np.column_stack((even, 0.7 + 0.2 * np.sin(9.0 * even)))
    lines = {"level": level, "upright": upright, "wave": wave}
    names.lines += [NamedLine(name, "black", (line,)) for name, line in lines.items()]
    placed = names.placed(FigureCanvasAgg(figure).get_renderer())
    assert [text.get_text() for text in placed] == [*lines]
    for text in placed:
        box = text.get_window_extent()
        assert not any(box.count_contains(ax.transData.transform(each)) for each in lines.values())


@pytest.mark.slow
def test_counterexamples_are_pins() -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: proof)")
    trace = simulate(stick_slip("published"), sine(), 10.0)
    report = prove(trace.model.chart)
    figure = figures.landscape(trace, 0, checks=report)
    (finding,) = (each for each in report.findings if {"v", "z"} <= each.counterexample.keys())
    (pin,) = (each for each in figure.axes[0].lines if each.get_marker() == "D")
    assert pin.get_ydata() == [finding.counterexample["z"]]  # type: ignore[comparison-overlap]
    numbers = [a.get_text() for a in figure.axes[0].texts if isinstance(a, Annotation)]
    assert numbers == ["1"]
    lines = [text.get_text() for text in figure.texts]
    assert any(line.startswith("1  stability refuted, slip: ") for line in lines)
    with pytest.raises(ParameterError, match="is the report of the chart"):
        figures.landscape(trace, 0, checks=prove(BROKEN["overlap"].chart))


def test_forces_are_drawn_where_there_are_no_variables() -> None:
    trace = karnopp().run()
    row = int(np.flatnonzero((trace.states[:, 0] == "stuck") & (np.abs(trace.F) > 0.7))[0])
    ax = Figure().subplots()
    found = regions(panels.landscape(ax, trace, 0, row=row))
    assert ax.get_ylabel() == "$F$ [N]"
    lowest = {name: min(p.vertices[:, 1].min() for p in c.get_paths()) for name, c in found.items()}
    assert lowest["release_forward"] == pytest.approx(1.5, abs=0.02)  # F_s


# --------------------------------------------------------------------------- truths
ROWS = 300

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


def fading() -> Trace:
    model = ChartModel(FADING, {"z_0": 0.1, "v_f": 0.2, "v_c": 1e-4}, n=1)
    return simulate(model, Prescribed("0.3*sin(2*pi*t/5)"), 40.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gms", "karnopp", "modelica", "fading"])
def test_regions_have_the_truths_of_the_run_at_random_rows(name: str) -> None:
    makers = {"gms": gms, "fading": fading, "karnopp": karnopp().run, "modelica": modelica().run}
    trace = makers[name]()
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


def texts_of_the_race(trace: Trace, row: int) -> list[str]:
    drawn = panels.race(Figure().subplots(), trace, 0, row=row)
    return [each.get_text() for each in drawn if hasattr(each, "get_text")]


@pytest.mark.slow
def test_a_race_says_what_precedes_and_what_cannot_be_computed() -> None:
    chart = Chart(
        "own",
        inputs=("v", "x"),
        states=(State("a"), State("b"), State("c")),
        transitions=(
            Transition("first", "a", "b", guard="x >= 0.1 and v > 0"),
            Transition("second", "a", "b", guard="x >= 0.1"),
            Transition("third", "a", "b", guard="1 / x < -1e9"),
            Transition("on", "b", "c", guard="v >= 0"),
        ),
        outputs={"F": "0*v"},
    )
    trace = simulate(ChartModel(chart, {}), Prescribed("0.2*cos(t)"), 3.0)
    at = np.flatnonzero(trace.t == trace.transitions.t[0])
    assert {"fires", "preceded by first"} <= {*texts_of_the_race(trace, int(at[0]))}
    assert "cannot be computed" in texts_of_the_race(trace, 0)
    assert texts_of_the_race(trace, -1) == ["no edge leaves c"]
    # The row between the two firings has no second time.
    figure = figures.landscape(trace, 0, row=int(at[1]))
    assert figure.axes[0].get_title(loc="left") == "guards that leave a"
    figure = figures.landscape(trace, 0, row=int(at[2]))
    assert figure.axes[0].get_title(loc="left") == "guards that leave b"


@pytest.mark.slow
def test_without_findings_and_without_the_signal(tmp_path: Path) -> None:
    pytest.importorskip("z3")
    trace = simulate(stick_slip("signed"), Prescribed(lambda t: 0.2), 3.0)
    loaded = Trace.load(trace.save(tmp_path / "run.npz"))
    figure = figures.landscape(loaded, 0, checks=prove(trace.model.chart))
    assert any("No finding of the checks" in text.get_text() for text in figure.texts)
