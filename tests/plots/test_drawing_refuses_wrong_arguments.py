"""What pictures, panels, films, pages and widgets refuse: each with its argument and its value.

A row is a call, the argument that is wrong, and the values that are refused.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.charts import LUGRE
from gms_fsm.charts.chart import Chart, State
from gms_fsm.errors import ParameterError
from gms_fsm.systems.models import ChartModel

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

import plots
from plots import LiveChart, block_diagram, figures, live_statechart, panels, statechart
from plots.handouts.page import handout_figure
from plots.page.replay import replay_html
from plots.panels.parts.selection import PartOptions
from plots.style import ramp
from plots.style.matplotlib import Axes, Figure
from plots.style.presets import Preset
from plots.systems import elements
from plots.systems.mechanism import schematic_figure
from tests.helpers import open_loop, stick_slip
from tests.identification.fits_made import small, two_records
from tests.plots.systems_to_draw import BLOCKS, STICTION
from tests.plots.systems_to_draw import run as system_run
from tests.supervisor_cases import crossing
from tests.zoo.zoo_cases import prandtl_tomlinson

NAN = math.nan
WINDOWS = [(3.0, 1.0), (-1.0, 2.0), (1.0, 11.0), (1, 2, 3), 5.0, ("a", 2), (NAN, 2.0)]
ELEMENTS = [[], [4], [-1], [0, 0], [1.0], [True], "01", 2]
ROWS = [10_000, -10_000, 1.5, True, None]
TIMES = [-1.0, 10.5, NAN, "x"]

Call = Callable[[Any], object]


@cache
def run() -> Trace:
    return simulate(stick_slip("signed"), open_loop(), 10.0)


def ax() -> Axes:
    return Figure().subplots()


def panels_with(argument: str) -> dict[str, Callable[..., object]]:
    """Return all panels that take an argument, and otherwise need only Axes and Trace."""
    found = {}
    for name in panels.__all__:
        taken = dict(inspect.signature(getattr(panels, name)).parameters)
        shared = PartOptions.__annotations__ if taken.pop("part", None) else {}
        needed = [each for each, how in taken.items() if how.default is how.empty]
        if needed == ["ax", "trace"] and argument in {*taken, *shared}:
            found[name] = getattr(panels, name)
    return found


def shifted(**options: Any) -> object:
    return plots.explore(stick_slip("signed"), Prescribed("0.2"), 3.0, **options)


REFUSED: list[tuple[str, Call, str, list[Any]]] = [
    *((name, lambda w, p=panel: p(ax(), run(), window=w), "window", WINDOWS)
      for name, panel in panels_with("window").items()),
    *((name, lambda w, p=panel: p(ax(), run(), elements=w), "elements", ELEMENTS)
      for name, panel in panels_with("elements").items()),
    ("landscape", lambda w: plots.landscape(run(), 0, window=w), "window", WINDOWS),
    ("phase", lambda w: plots.phase(run(), window=w), "window", WINDOWS),
    ("unfold", lambda w: plots.unfold(run(), *w), "window", [(2.0, 1.0), (1.0, 19.0), ("a", 2.0)]),
    ("replay", lambda w: replay_html(run(), window=w), "window", [*WINDOWS, "all"]),
    ("notes of a replay", lambda w: replay_html(run(), notes=w), "notes", [["a"], "a", None]),
    ("ribbons_figure", lambda w: figures.ribbons_figure(run(), w), "around", TIMES),
    ("cascade_window", lambda w: panels.cascade_window(run(), within=w), "within",
     [0.0, -1.0, NAN, "x"]),
    ("stribeck", lambda w: panels.stribeck(ax(), run(), w), "measured",
     [([1.0], [1.0, 2.0]), ([], []), ([1.0], [NAN]), (["a"], [1.0]), 3.0]),
    ("difference", lambda w: panels.difference(ax(), np.zeros(3), np.zeros(3), w), "floor", [0.0]),
    ("save", lambda w: figures.save(Figure(), w), "path", ["a.bmp"]),
    ("schematic of a row", lambda w: elements.elements_at(ax(), run(), w), "row", ROWS),
    ("schematic", lambda w: schematic_figure(elements=w), "elements", [0, 13, 2.0, True]),
    ("schematic of a system", plots.schematic, "system", ["scenario.toml"]),
    ("landscape of an element", lambda w: plots.landscape(run(), w), "element",
     [4, -1, 1.0, True, None, "E1"]),
    ("landscape of a row", lambda w: plots.landscape(run(), 0, row=w), "row", ROWS),
    ("landscape at a time", lambda w: plots.landscape(run(), 0, t=w), "t", TIMES),
    ("landscape with a report", lambda w: plots.landscape(run(), 0, checks=w), "checks",
     ["report", 1, []]),
    ("phase of a row", lambda w: plots.phase(run(), row=w), "row", ROWS[:-1]),
    ("live chart", lambda w: LiveChart(run(), w), "elements", [[4], 5]),
    ("live chart", lambda w: LiveChart(run(), notation=w), "notation", ["latex"]),
    ("live chart", lambda w: LiveChart(run(), theme=w), "theme", ["grey"]),
    ("live chart at a time", lambda w: LiveChart(run()).at(w), "t", [-0.1, 45.1, NAN, math.inf]),
    *((f"statechart, {name}", lambda w, n=name: statechart(LUGRE, **{n: w}), name, ["other"])
      for name in ("notation", "direction", "theme", "form")),
    ("statechart", statechart, "chart", ["gms"]),
    ("statechart", lambda w: statechart(LUGRE, w), "elements",
     [[], [0, 0], [-1], None, 0, -3, 1.5]),
    ("statechart with counts", lambda w: statechart(run().model.chart, w, counts=run()),
     "elements", [5]),
    ("block diagram", block_diagram, "elements", [0, -1, 2.5, True, "1"]),
    ("fit", lambda w: figures.fit_figure(small(), w), "which", [1, True]),
    ("fit", lambda w: figures.fit_figure(small(), window=w), "window",
     [(3.0, 2.0), (20.0, 30.0), 2.0]),
    ("fit", figures.fit_figure, "fit", ["fit"]),
    ("profiles", figures.profiles_figure, "fit", ["fit"]),
    ("preset", lambda w: plots.preset(w).__enter__(), "preset", ["a4"]),
    ("own preset", lambda w: Preset("x", w, None, 9.0, 7.0, 1.0, 100.0), "width", [-1.0]),
    ("own preset", lambda w: Preset("x", None, None, 9.0, w, 1.0, 100.0), "smallest", [10.0]),
    *((f"slider {wrong}", lambda w: shifted(sliders={"F_s": w}), "sliders['F_s']", [wrong])
      for wrong in ((2.0, 3.0), (3.0, 1.0), 2.0)),
    ("sliders", lambda w: shifted(sliders=w), "sliders", [["F_s"]]),
    *((f"film, {name}", lambda w, n=name: plots.animate(run(), **({"path": "a.gif"} | {n: w})),
       name, wrongs)
      for name, wrongs in {"path": ["run.avi"], "seconds": [0.05, NAN], "frames": [1, 2.5, True],
                           "fps": [0, 51, NAN], "theme": ["grey"], "notation": ["tex"],
                           "elements": [[7]]}.items()),
]  # fmt: skip


SLOW = ("fit", "profiles", "landscape")


@pytest.mark.every(2)
@pytest.mark.parametrize(
    ("call", "argument", "wrongs"),
    [
        pytest.param(*row, id=f"{name}: {row[1]}", marks=[pytest.mark.slow] * (name in SLOW))
        for name, *row in REFUSED
    ],
)
def test_an_argument_is_refused_by_its_name_and_value(
    call: Call, argument: str, wrongs: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "slider" in argument:
        pytest.importorskip("anywidget", reason="the widget needs the extra 'jupyter'")
    monkeypatch.chdir(tmp_path)
    for wrong in wrongs:
        with pytest.raises(ParameterError) as error:
            call(wrong)
        assert str(error.value).startswith(f"{argument} is {wrong!r}"), str(error.value)
    assert not list(tmp_path.iterdir())


def sheet_of(force: str, rate: str = "v", states: int = 1) -> Figure:
    """Return the handout of a chart without edges."""
    every = [State(f"state_of_a_long_name_{i}", flow={"z": rate}) for i in range(states)]
    chart = Chart("own", variables=("z",), states=every, outputs={"F": force})
    model = ChartModel(chart, {})
    moved = rate == "v" and force != "0*z"
    return handout_figure(simulate(model, Prescribed("0.1*cos(t)"), 7.0) if moved else model)


LATE = np.array([20.0, 30.0])


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: figures.Measured(np.zeros(2), np.zeros(2), np.zeros(3)), "equally long"),
        (lambda: figures.Measured(np.array([1.0, 0.0]), LATE, LATE), "goes backward"),
        (lambda: panels.difference(ax(), np.zeros(3), np.zeros(2)),
         r"shape \(3,\), the difference \(2,\)"),
        (lambda: figures.figure_3(run(), run(), run(), np.zeros(2), title=""),
         r"force has shape \(2,\)"),
        (lambda: plots.landscape(run(), 0, row=3, t=1.0), r"row is 3 and t is 1\.0; give one"),
        (lambda: plots.phase(run(), row=0, window=(2.0, 6.0)), r"row 0 is at t = 0 s, outside"),
        (lambda: plots.landscape(prandtl_tomlinson().run(), 0), "no variables, and its guards"),
        (lambda: elements.elements_at(ax(), system_run(BLOCKS).contact("pad1")),
         "this chart has no variables; draw the chart with"),
        (lambda: live_statechart(run()), "row is None and t is None; give exactly one"),
        (lambda: live_statechart(run(), row=0, t=0.0), "give exactly one"),
        (lambda: statechart(LUGRE, counts=run()), "counts is a run of the chart 'GMS element, sig"),
        (lambda: plots.unfold(run(), 0.1, 1.0), r"no transition from 0.1 to 1 s; the nearest one"),
        (lambda: figures.profiles_figure(two_records()), r"no open profile.*fit\.profile\(name\)"),
        (lambda: replay_html(run(), run(), names=["one"]), r"2 run\(s\) but names = \['one'\]"),
        *((partial(replay_html, run(), notes={when: "a"}),
           f"notes is {when}; a note begins at a time of the run, from 0 to 10 s, or at an edge")
          for when in (10.5, NAN, None)),
        (lambda: replay_html(run(), notes={"arest": "a"}), "there is no edge 'arest'"),
        (lambda: replay_html(run(), notes={0.0: 5}),
         r"notes\[0\.0\] is 5; it must be a text"),
        (lambda: handout_figure(1), "model is 1; give a model"),  # type: ignore[arg-type]
        pytest.param(lambda: sheet_of("0*z"), "no sine between .* gives a loop of own; give",
                     marks=pytest.mark.slow),
        (lambda: sheet_of("z", "1/(z - z)"), "no sine between"),
        pytest.param(lambda: sheet_of(" + ".join(f"{i} * z" for i in range(1000, 1050))),
                     "an equation is wider than an A4 page", marks=pytest.mark.slow),
        pytest.param(lambda: sheet_of("z", states=80), "own does not fit on one A4 page",
                     marks=pytest.mark.slow),
        (lambda: ramp("heat", 0), "count is 0; a ramp has at least one step"),
        (lambda: shifted(sliders={"q": (0.0, 1.0)}), "there is no number 'q'"),
        (lambda: shifted(sliders={"F_s": (1.0, math.inf)}), r"sliders\['F_s'\] is inf; it must be"),
        (lambda: plots.animate(run(), "a.gif", seconds=3.0, frames=60), "give only one of them"),
        (lambda: plots.animate(run(), "a.gif", t_end=46.0), r"t_end is 46\.0 s; .* 0 to 10 s"),
        (lambda: plots.animate(run(), "a.gif", t_start=5.0, t_end=5.0), r"t_start is 5\.0 s and"),
    ],
)  # fmt: skip
def test_what_does_not_go_together_is_refused(call: Callable[[], object], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        call()


def test_a_row_outside_is_an_index_error() -> None:
    for row in (len(run()), -len(run()) - 1):
        with pytest.raises(IndexError, match=f"row {row}: the trace has"):
            LiveChart(run()).look(row)


# --------------------------------------------------------------------------- several contacts
OF_AN_ELEMENT = ("landscape", "race", "pins")
WITHOUT_A_TRACE = {"difference", "residual", "slip_bar", "has_threshold", "lettered", "arrows"}
WITHOUT_A_TRACE |= {"lag_between_ticks", "lag_over_period", "lag_over_time", "cascade_window"}
WITHOUT_A_TRACE |= {"shown", "Unfolded", "unfolded", "unfolded_force", "unfolded_states"}
OF_A_TRACE = sorted({*panels.__all__} - WITHOUT_A_TRACE - {*OF_AN_ELEMENT})
DRAWN: dict[str, Call] = {
    "LiveChart": LiveChart,
    "live_statechart": partial(live_statechart, row=0),
    "animate": partial(plots.animate, path="run.gif"),
    "statechart": lambda trace: statechart(STICTION, counts=trace),
    "schematic": partial(elements.elements_at, ax()),
    "cascade_window": panels.cascade_window,
    "shown": panels.shown,
    **{name: partial(getattr(panels, name), ax()) for name in OF_A_TRACE},
    **{name: getattr(figures, name) for name in ("overview", "ribbons_figure", "cascade_figure")},
    "landscape": partial(figures.landscape, element=0),
    "landscape, panel": partial(panels.landscape, ax(), element=0),
    "race": partial(panels.race, ax(), element=0),
    "pins": partial(panels.pins, ax(), element=0, checks=None),
    "unfold": partial(figures.unfold, t0=0.0, t1=1.0),
    "phase": figures.phase,
}


def test_a_run_of_several_contacts_says_to_choose_one() -> None:
    said = (
        r"^system 'two blocks on a belt' has the contacts 'pad1', 'pad2'; "
        r"say which one: trace.contact\('pad1'\)$"
    )
    for call in DRAWN.values():
        with pytest.raises(ParameterError, match=said):
            call(system_run(BLOCKS))
    first, second = (system_run(BLOCKS).contact(name) for name in ("pad1", "pad2"))
    assert first.contact("pad2").transitions.t.tolist() == second.transitions.t.tolist()
    for name in set(OF_A_TRACE) - {"stribeck"}:  # and every panel takes it; it has no curve
        assert getattr(panels, name)(ax(), second)


def test_supervisors_alone_are_refused_with_what_shows_them() -> None:
    case = crossing()
    trace = case.run()
    for name in ("overview", "landscape", "unfold", "phase", "animate"):
        with pytest.raises(ParameterError, match=r"no force to draw.* by plots\.replay$"):
            DRAWN[name](trace.supervisor("main"))
    for each in (trace, trace.supervisor("main")):
        assert each._repr_png_() is None  # a notebook shows their text
        assert each._repr_html_() is None
    with pytest.raises(ParameterError, match="has no bodies to draw"):
        plots.schematic(case.system)


def test_pictures_of_runs_need_a_trace() -> None:
    wrong = "run.npz"
    calls: dict[str, Call] = {"replay": plots.replay, "schematic_figure": schematic_figure}
    for name in ("overview", "ribbons_figure", "cascade_figure", "landscape", "unfold", "phase",
                 "animate", "velocity"):  # fmt: skip
        calls[name] = DRAWN[name]
    for name, call in calls.items():
        with pytest.raises(ParameterError) as error:
            call(wrong)
        said = str(error.value)
        assert said.startswith(f"trace is {wrong!r}"[:20]), name
        assert said.endswith("; it must be a Trace, from simulate(...) or Trace.load(path)"), name
