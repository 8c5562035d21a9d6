"""The data of a replay page are the rows, values, states and log of the run, and only data.

No browser is needed here; what the page computes from them is the claim of
`test_a_replay_page_shows_the_run.py`.
"""

from __future__ import annotations

import html
import importlib.util
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Stribeck, Trace, simulate
from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.errors import OutputError, ParameterError, TraceFileError
from gms_fsm.language import InState
from gms_fsm.systems.models import ChartModel, LuGre
from gms_fsm.traces.failures import SimulationError
from gms_fsm.verification.prove import prove
from plots.page import _rows, chart
from plots.page._trees import tree_of
from plots.page.replay import replay, replay_html, write_replay
from tests.helpers import FASTEST, FIG4_SINE, bank, pulled_mass, stick_slip
from tests.plots.stored import column, data_of, integers, log, modes, same

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(importlib.util.find_spec("uplot") is None, reason="needs uplot-python"),
]


@cache
def fig4(law: str) -> Trace:
    return simulate(stick_slip(law), Prescribed(FIG4_SINE), 100.0)


def run_of(trace: Trace, **options: Any) -> dict[str, Any]:
    """Return the data of the only run of a page."""
    (only,) = data_of(replay_html(trace, **options))["runs"]
    return dict(only)


def test_rows_have_the_numbers_the_bits_and_the_states_of_the_trace() -> None:
    trace = fig4("published")
    run = run_of(trace)
    (contact,) = run["contacts"]
    own = integers(run["between"]) == 0
    number = integers(run["number"])[own]
    assert set(np.flatnonzero(np.isin(trace.t, trace.transitions.t))) <= set(number)
    assert (integers(run["microstep"])[own] == trace.microstep[number]).all()
    values = contact["values"]
    for name, wanted in (("t", trace.t), ("v", trace.v), ("x", trace.x)):
        assert same(column(run, values[name]["all"])[own], wanted[number]), name
    for i in range(trace.n):
        assert same(column(run, values["z"]["by"][i])[own], trace.z[number, i])
        assert same(column(run, values["s"]["by"][i])[own], trace.s[number, i])
        forces = column(run, contact["forces"][i])[own]
        assert forces == pytest.approx(trace.F_elements[number, i], rel=1e-6, abs=1e-12)
    assert column(run, values["F"]["all"])[own] == pytest.approx(trace.F[number], rel=1e-6)
    assert (modes(contact, run["rows"])[own] == trace.modes[number]).all()


def test_the_log_is_complete_and_points_at_the_rows_that_firings_made() -> None:
    trace = fig4("signed")
    run = run_of(trace)
    (contact,) = run["contacts"]
    rows, elements, edges, made = log(contact)
    assert len(rows) == len(trace.transitions) == 64
    assert made.all()
    states = modes(contact, run["rows"])
    names = contact["states"]
    for row, element, edge, record in zip(rows, elements, edges, trace.transitions, strict=True):
        assert column(run, run["t"])[row] == record.t
        assert (element, contact["edges"][edge]["name"]) == (record.element, record.edge)
        assert names[states[row, element]] == record.target
        assert names[states[row - 1, element]] == record.source


def test_the_page_of_fig_4_is_small_and_complete() -> None:
    page = replay_html(fig4("published"), title="Fig. 4")
    assert len(page.encode()) < 520_000
    assert "Permission is hereby granted" in page
    assert "Leon Sorokin" in page
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//""", page)
    assert "{{" not in re.sub(r"<script>.*?</script>", "", page, flags=re.S)


@pytest.mark.matrix
def test_800_000_rows_with_30_000_transitions_fit_into_5_megabytes() -> None:
    trace = simulate(*pulled_mass(), 23_100.0, engine=FASTEST)
    assert len(trace) > 800_000
    page = replay_html(trace)
    assert len(page.encode()) < 5_000_000
    (run,) = data_of(page)["runs"]
    assert len(log(run["contacts"][0])[0]) == len(trace.transitions) > 30_000
    number = integers(run["number"])
    assert same(column(run, run["t"]), trace.t[number])
    assert set(np.flatnonzero(np.isin(trace.t, trace.transitions.t))) <= set(number)
    # Between the instants the page has what can be seen: in 100 intervals the extremes of the run.
    v = column(run, run["contacts"][0]["values"]["v"]["all"])
    for low in np.linspace(0.0, 22_000.0, 100):
        inside, shown = ((t >= low) & (t < low + 220.0) for t in (trace.t, trace.t[number]))
        assert v[shown].max() > 0.99 * trace.v[inside].max()
        assert v[shown].min() <= 0.99 * trace.v[inside].min()


def test_a_window_shows_that_part_of_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    trace = fig4("signed")
    run = run_of(trace, window=(20.0, 40.0))
    t = column(run, run["t"])
    assert (t.min() >= 20.0) & (t.max() <= 40.0)
    inside = trace.transitions[(trace.transitions.t >= 20.0) & (trace.transitions.t <= 40.0)]
    assert len(log(run["contacts"][0])[0]) == len(inside) > 0
    own = integers(run["between"]) == 0
    assert same(t[own], trace.t[integers(run["number"])[own]])
    monkeypatch.setattr(_rows, "MOST_AT_TRANSITIONS", 50)
    with pytest.raises(ParameterError, match="give a shorter window"):
        replay_html(trace)
    assert replay_html(trace, window=(0.0, 10.0))


def test_long_runs_at_requested_times_keep_all_transitions() -> None:
    trace = simulate(*pulled_mass(), 60.0, t_eval=np.linspace(0.0, 60.0, 20_001))
    assert (trace.microstep == 0).all()
    run = run_of(trace)
    rows, _, _, made = log(run["contacts"][0])
    assert len(rows) == len(trace.transitions) == 72
    assert made.all()
    assert run["rows"] < 3000
    own = integers(run["between"]) == 0
    assert same(column(run, run["t"])[own], trace.t[integers(run["number"])[own]])


def test_rows_of_a_loaded_trace_are_not_duplicated(tmp_path: Path) -> None:
    model, rig = stick_slip("signed"), Prescribed(FIG4_SINE)
    trace = simulate(model, rig, 100.0, t_eval=np.linspace(0.0, 100.0, 201))
    run = run_of(Trace.load(trace.save(tmp_path / "run.npz")))
    assert log(run["contacts"][0])[3].all()
    steps = integers(run["microstep"])
    keys = list(zip(column(run, run["t"]).tolist(), steps.tolist(), strict=True))
    assert keys == sorted(keys)
    assert sum(steps) == sum(fig4("signed").microstep)
    # A signal that is not in the file leaves the rows as they are.
    trace = simulate(model, Prescribed(lambda t: 0.2), 3.0)
    run = run_of(Trace.load(trace.save(tmp_path / "run.npz")))
    assert run["rows"] == len(trace)
    assert not integers(run["between"]).any()


def test_counterexamples_are_pinned_where_they_have_a_place() -> None:
    pytest.importorskip("z3")
    report = prove(GMS_ELEMENT["published"])
    run = run_of(fig4("published"), checks=report)
    pins = run["contacts"][0]["plane"]["pins"]
    wanted = [f for f in report.findings if {"v", "z"} <= f.counterexample.keys()]
    assert [pin["text"] for pin in pins] == [f.text for f in wanted]
    assert [pin["at"] for pin in pins] == [
        [f.counterexample["v"], f.counterexample["z"]] for f in wanted
    ]
    assert len(pins) > 0
    with pytest.raises(ParameterError, match="checks has a Report of another chart"):
        replay_html(fig4("signed"), checks=report)


def test_hostile_names_stay_texts_and_nan_and_infinities_are_stored() -> None:
    evil = "</script><script>document.title='owned'</script><!-- \u2028"
    trace = fig4("signed")
    stored = {name: np.array(values) for name, values in trace.seen.items()}
    stored["friction.F"][:3] = np.nan, np.inf, -np.inf
    stored["friction.v"][5] = np.nan
    page = replay_html(replace(trace, stored=stored), title=evil, names=[evil])
    assert "owned" not in re.sub(r'(?s)<script type="application/json".*?</script>', "", page)
    assert page.count("</script>") == 3
    assert data_of(page)["title"] == evil.replace("\u2028", " ")
    (run,) = data_of(page)["runs"]
    values = run["contacts"][0]["values"]
    assert same(column(run, values["F"]["all"])[:3], np.array([np.nan, np.inf, -np.inf]))
    assert np.isnan(column(run, values["v"]["all"])[5])


def test_failed_runs_charts_without_edges_and_models_of_many_elements_have_pages() -> None:
    with pytest.raises(SimulationError) as stopped:
        simulate(stick_slip("signed"), Prescribed("0.1*sqrt(2 - t)"), 5.0)
    assert run_of(stopped.value.trace)["rows"] >= len(stopped.value.trace)
    rig = Prescribed(FIG4_SINE)
    lugre = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=0.4, stribeck=Stribeck(1, 1.5, 0.05))
    (contact,) = run_of(simulate(lugre, rig, 10.0))["contacts"]
    assert contact["edges"] == []
    assert len(log(contact)[0]) == 0
    page = replay_html(simulate(bank(9), rig, 10.0))
    assert page.count('class="node state"') == 2  # one chart, which shows the chosen element
    assert data_of(page)["runs"][0]["contacts"][0]["n"] == 9


def test_what_cannot_be_written_or_drawn_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trace = fig4("signed")
    with pytest.raises(OutputError, match="cannot write"):
        write_replay(tmp_path / "none" / "page.html", trace)
    layout = trace.program.layout
    other = replace(layout, edges=tuple(("warp", *ends) for _, *ends in layout.edges))
    with pytest.raises(TraceFileError, match="'warp'"):
        replay_html(replace(trace, firings=replace(trace.firings, layout=other)))
    monkeypatch.setattr(chart, "drawn", lambda graph, form: None)
    assert "No chart: Graphviz" in replay_html(trace)


def test_two_runs_of_one_model_are_distinguished_by_their_names() -> None:
    trace = fig4("signed")
    runs = data_of(replay_html(trace, trace, names=["coarse", "fine"]))["runs"]
    assert [run["title"].partition(":")[0] for run in runs] == ["coarse", "fine"]


def test_the_page_of_a_scenario_has_its_title() -> None:
    model, titles = fig4("signed").model.title, ("Sine", "Sine", "Ramp", "")
    one, other, third, none = (replace(fig4("signed"), heading=each) for each in titles)
    pairs = (
        ((one, other), "Sine"),
        ((one, third), "Sine and Ramp"),
        ((one, none), f"Sine and {model}"),
    )
    for runs, expected in pairs:
        assert data_of(replay_html(*runs))["title"] == expected
    figures = pytest.importorskip("plots.figures", exc_type=ImportError)
    assert figures.overview(one).get_suptitle() == f"Sine: {model}"


def test_a_notebook_shows_it_in_a_sandbox(tmp_path: Path) -> None:
    shown = replay(fig4("signed"))
    frame = shown._repr_html_()
    assert 'sandbox="allow-scripts"' in frame
    assert "allow-same-origin" not in frame
    inside = re.search(r'srcdoc="([^"]*)"', frame)
    assert inside is not None
    assert html.unescape(inside[1]) == shown.html
    path = write_replay(tmp_path / "page.html", fig4("signed"))
    assert path.read_text(encoding="utf-8") == shown.html  # the same run gives the same page


def test_powers_are_stored_and_charts_without_a_plane_and_runs_of_one_instant_have_pages() -> None:
    edges = (Transition("go", "a", "b", guard="abs(v)**p >= exp(-v)"),)
    states = State("a"), State("b")
    chart = Chart("own", parameters=("p",), states=states, transitions=edges, outputs={"F": "v"})
    (contact,) = run_of(simulate(ChartModel(chart, {"p": 1.5}), Prescribed("t"), 3.0))["contacts"]
    assert contact["plane"] is None
    (clause,) = contact["edges"][0]["clauses"]
    assert [each[0] for each in clause["tree"][1:]] == ["stored", "stored"]
    with pytest.raises(SimulationError) as stopped:
        simulate(stick_slip("signed"), Prescribed("0.1*sqrt(-t)"), 5.0)
    assert run_of(stopped.value.trace)["rows"] == 1
    assert tree_of(InState(0, "slip")) == ["state", 0, "slip"]


def test_a_name_that_a_title_begins_with_is_not_said_twice() -> None:
    trace = fig4("signed")
    for name in ("other", trace.title[:8]):
        assert run_of(trace, names=[name])["title"].count(name) == 1


def test_a_page_says_how_it_is_shown() -> None:
    with pytest.raises(AttributeError, match=r"a Replay has no 'show'; write page\.save\("):
        replay(fig4("signed")).show()  # type: ignore[attr-defined]
