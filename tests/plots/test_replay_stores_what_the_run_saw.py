"""The data of a replay page are the values, truths and margins of the run, and they are only data.

No browser is needed here; `test_replay_page_in_a_browser.py` drives the page.
"""

from __future__ import annotations

import html
import importlib.util
import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import MissingExtraError, OutputError, ParameterError, TraceFileError
from gms_fsm.inspection.explain import explain
from gms_fsm.systems.models import ChartModel, LuGre
from gms_fsm.traces.failures import SimulationError
from plots import _replay_chart
from plots.replay import replay, replay_html, write_replay
from tests.helpers import FIG4_SINE, pulled_mass, stick_slip

uplot = pytest.mark.skipif(
    importlib.util.find_spec("uplot") is None, reason="needs the package uplot-python"
)


@cache
def fig4(law: str) -> Trace:
    return simulate(stick_slip(law), Prescribed(FIG4_SINE), 100.0)


def data_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert found is not None
    return dict(json.loads(found[1]))


def column(run: dict[str, Any], number: int) -> np.ndarray:
    """Return a column at all rows of the page."""
    values = np.array([float(u) for u in run["pool"][number]])
    return np.broadcast_to(values, len(run["microstep"])) if values.size == 1 else values


@pytest.mark.slow
@uplot
@pytest.mark.parametrize("law", ["published", "signed"])
def test_every_row_of_a_transition_is_there_and_explained_as_the_run_explains_it(law: str) -> None:
    trace = fig4(law)
    (run,) = data_of(replay_html(trace))["runs"]
    times, steps = column(run, run["names"]["t"]), np.array(run["microstep"])
    instants = np.flatnonzero(np.isin(trace.t, trace.t[trace.microstep > 0]))
    assert instants.size > 80
    for row in instants:
        (here,) = np.flatnonzero((times == trace.t[row]) & (steps == trace.microstep[row]))[-1:]
        for i in range(trace.n):
            assert run["states"][run["mode"][i][here]] == trace.states[row, i]
            who, edge = run["fired"].get(str(here), (-1, -1))
            asked = here - 1 if who == i else here
            told = {e.edge.name: e for e in explain(trace, int(row), i)}
            assert {e for e, x in told.items() if x.fired} == (
                {run["edges"][edge]["name"]} if who == i else set()
            )
            for k, entry in enumerate(run["edges"]):
                leaves = run["mode"][i][asked] == entry["source"]
                assert leaves == (entry["name"] in told)
                if not leaves:
                    continue
                for c, clause in enumerate(told[entry["name"]].clauses):
                    assert entry["clauses"][c] == clause.text
                    assert run["truth"][i][k][c][asked] == "01"[clause.holds]
                    for number, value in zip(
                        run["sides"][i][k][c],
                        (clause.left, clause.right, clause.margin),
                        strict=True,
                    ):
                        stored = float(column(run, number)[asked])
                        assert stored == pytest.approx(value, rel=1e-6, abs=0.0)


@pytest.mark.slow
@uplot
def test_the_log_is_complete_and_points_at_the_rows_that_firings_made() -> None:
    trace = fig4("signed")
    page = data_of(replay_html(trace))
    (run,) = page["runs"]
    assert len(run["log"]) == len(trace.transitions) == 64
    for entry, record in zip(run["log"], trace.transitions, strict=True):
        assert entry["t"] == record.t == column(run, run["names"]["t"])[entry["row"]]
        assert entry["text"].startswith(f"element {record.element + 1} {record.source} → ")
        assert run["mode"][record.element][entry["row"]] == run["states"].index(record.target)
        assert run["mode"][record.element][entry["row"] - 1] == run["states"].index(record.source)
    assert page["events"] == sorted({entry["frame"] for entry in run["log"]})


@pytest.mark.slow
@uplot
@pytest.mark.parametrize("law", ["published", "signed"])
def test_a_breakpoint_stops_before_every_firing(law: str) -> None:
    (run,) = data_of(replay_html(fig4(law)))["runs"]
    for entry in run["log"]:
        # The guard became true at the latest on the row where it was evaluated.
        stops = run["stops"][entry["element"]][entry["edge"]]
        mode = run["mode"][entry["element"]]
        stop = max(row for row in stops if row < entry["row"])
        assert set(mode[stop : entry["row"]]) == {run["edges"][entry["edge"]]["source"]}


@pytest.mark.slow
@uplot
def test_the_page_of_fig_4_is_small_and_complete() -> None:
    page = replay_html(fig4("published"), title="Fig. 4")
    assert len(page.encode()) < 1_000_000
    assert "Permission is hereby granted" in page
    assert "Leon Sorokin" in page
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//""", page)
    assert "{{" not in re.sub(r"<script>.*?</script>", "", page, flags=re.S)


@pytest.mark.slow
@uplot
def test_long_runs_are_thinned_but_keep_all_transitions() -> None:
    trace = simulate(*pulled_mass(), 60.0, t_eval=np.linspace(0.0, 60.0, 20_001))
    assert (trace.microstep == 0).all()
    (run,) = data_of(replay_html(trace))["runs"]
    assert len(run["log"]) == len(trace.transitions) == 72
    assert all(entry["made"] for entry in run["log"])
    assert len(run["microstep"]) < 1600


@pytest.mark.slow
@uplot
def test_requested_times_of_a_loaded_trace_are_not_duplicated(tmp_path: Path) -> None:
    model, rig = stick_slip("signed"), Prescribed(FIG4_SINE)
    trace = simulate(model, rig, 100.0, t_eval=np.linspace(0.0, 100.0, 201))
    fresh = data_of(replay_html(trace))
    loaded = data_of(replay_html(Trace.load(trace.save(tmp_path / "run.npz"))))
    for page in (fresh, loaded):
        (run,) = page["runs"]
        assert all(entry["made"] for entry in run["log"])
        keys = list(zip(page["frames"]["t"], run["microstep"], strict=True))
        assert keys == sorted(keys)
        assert sum(run["microstep"]) == sum(fig4("signed").microstep)


@uplot
def test_a_signal_that_is_not_in_the_file_leaves_the_rows_as_they_are(tmp_path: Path) -> None:
    trace = simulate(stick_slip("signed"), Prescribed(lambda t: 0.2), 3.0)
    (run,) = data_of(replay_html(Trace.load(trace.save(tmp_path / "run.npz"))))["runs"]
    assert len(run["microstep"]) == len(trace)
    assert not any(run["between"])


@pytest.mark.slow
@uplot
def test_two_runs_share_one_time_and_micro_steps_stand_side_by_side() -> None:
    page = data_of(replay_html(fig4("published"), fig4("signed")))
    first, second = page["runs"]
    times = np.array(page["frames"]["t"])
    assert (np.diff(times) >= 0).all()
    for run, rows, own in zip(
        (first, second), page["frames"]["rows"], page["frames"]["own"], strict=True
    ):
        shown = [row for row, mine in zip(rows, own, strict=True) if mine]
        assert shown == list(range(len(run["microstep"])))
        assert (column(run, run["names"]["t"])[rows] <= times).all()
    (begin,) = {run["log"][0]["frame"] for run in (first, second)}
    for step in range(4):  # the first break-aways are the same under both laws
        rows = [page["frames"]["rows"][k][begin + step] for k in (0, 1)]
        assert [run["microstep"][row] for run, row in zip((first, second), rows, strict=True)] == [
            step + 1,
            step + 1,
        ]


@uplot
def test_a_hostile_name_stays_a_text() -> None:
    evil = "</script><script>document.title='owned'</script><!-- \u2028"
    chart = Chart(
        name=evil,
        inputs=("v", "s"),
        variables=("z",),
        parameters=("k",),
        states=(State("only", flow={"z": "v"}),),
        transitions=(),
        outputs={"F": "k * z"},
    )
    model = ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1, 1.5, 0.1))
    trace = simulate(model, Prescribed("0.1"), 1.0)
    page = replay_html(trace, title=evil)
    assert "owned" not in re.sub(r'(?s)<script type="application/json".*?</script>', "", page)
    assert page.count("</script>") == 3
    assert data_of(page)["title"] == evil


@pytest.mark.slow
@uplot
def test_nan_and_infinities_are_distinguished() -> None:
    trace = fig4("signed")
    stored = {name: np.array(values) for name, values in trace.seen.items()}
    stored["friction.F"][:3] = np.nan, np.inf, -np.inf
    stored["friction.v"][5] = np.nan
    (run,) = data_of(replay_html(replace(trace, stored=stored)))["runs"]
    assert run["pool"][run["names"]["F"]][:3] == ["NaN", "Infinity", "-Infinity"]
    assert [run["pool"][side][5] for side in run["sides"][0][0][1][::2]] == ["NaN", "NaN"]
    assert run["truth"][0][0][1][5] == "0"  # a comparison with no number does not hold


@pytest.mark.slow
@uplot
def test_a_failed_run_has_a_page() -> None:
    with pytest.raises(SimulationError) as stopped:
        simulate(stick_slip("signed"), Prescribed("0.1*sqrt(2 - t)"), 5.0)
    (run,) = data_of(replay_html(stopped.value.trace))["runs"]
    assert len(run["microstep"]) >= len(stopped.value.trace)


def test_without_uplot_the_message_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"gms-fsm\[replay\]"):
        replay_html(fig4("signed"))


@pytest.mark.slow
@uplot
def test_a_page_in_a_missing_folder_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot write"):
        write_replay(tmp_path / "none" / "page.html", fig4("signed"))


@pytest.mark.slow
@uplot
def test_two_runs_of_one_model_are_distinguished_by_their_names() -> None:
    coarse, fine = fig4("signed"), fig4("signed")
    runs = data_of(replay_html(coarse, fine, names=["coarse", "fine"]))["runs"]
    assert [run["title"].partition(":")[0] for run in runs] == ["coarse", "fine"]
    assert [run["title"].partition(": ")[2] for run in runs] == [
        run["title"] for run in data_of(replay_html(coarse, fine))["runs"]
    ]
    with pytest.raises(ParameterError, match=r"2 run\(s\) but names = \['one'\]"):
        replay_html(coarse, fine, names=["one"])


@pytest.mark.slow
@uplot
def test_a_log_with_an_edge_of_another_chart_is_rejected() -> None:
    trace = fig4("signed")
    log = trace.transitions.copy()
    log.edge[0] = "warp"
    with pytest.raises(TraceFileError, match="'warp'"):
        replay_html(replace(trace, transitions=log))


@pytest.mark.slow
@uplot
def test_a_chart_without_edges_and_a_model_of_many_elements_have_pages() -> None:
    rig = Prescribed(FIG4_SINE)
    lugre = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=0.4, stribeck=Stribeck(1, 1.5, 0.05))
    (run,) = data_of(replay_html(simulate(lugre, rig, 10.0)))["runs"]
    assert run["edges"] == run["log"] == run["inner"]["bounds"] == []
    chart = GMS_ELEMENT["signed"]
    values = {"k": 1.0, "sigma": 0.0, "C": 0.02, "v_c": 1e-6}
    bank = ChartModel(chart, values, n=9, stribeck=Stribeck(1, 1.5, 0.05))
    page = replay_html(simulate(bank, rig, 10.0))
    assert page.count('class="node state"') == 2  # one chart, which shows the chosen element
    assert len(data_of(page)["runs"][0]["mode"]) == 9


@pytest.mark.slow
@uplot
def test_without_graphviz_the_page_has_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_replay_chart, "drawn", lambda graph, form: None)
    assert "No chart: Graphviz" in replay_html(fig4("signed"))


@pytest.mark.slow
@uplot
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
