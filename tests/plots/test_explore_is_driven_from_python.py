"""What the widget's controls do is done from Python too, and the browser is sent what changed."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    MissingExtraError,
    Prescribed,
    State,
    System,
)
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts import CHARTS
from gms_fsm.errors import SessionError
from tests.helpers import FIG4_SINE, stick_slip

pytest.importorskip("anywidget", reason="the widget needs the extra 'jupyter'")
pytest.importorskip("uplot", reason="the widget needs the extra 'jupyter'")

import plots
from plots.widget.explorer import Explorer


@pytest.fixture
def widget() -> Explorer:
    rig = Prescribed(FIG4_SINE)
    ranges = {"F_s": (0.5, 3.0), "v_c": (1e-9, 1e-3)}
    return plots.explore(stick_slip("published"), rig, 30.0, sliders=ranges)


def ask(widget: Explorer, **request: object) -> dict[str, object]:
    """Send a request as the browser does, and return the panel."""
    number = int(str(widget.panel["done"] or 0)) + 1
    widget.request = {**request, "id": str(number)}
    assert widget.panel["done"] == str(number)
    return dict(widget.panel)


def test_set_runs_again(widget: Explorer, tmp_path: Path) -> None:
    assert [each["log"] for each in widget.panel["sliders"]] == [False, True]  # over two decades
    before = widget.runs
    widget.set(F_s=1.8)
    assert widget.values == {"F_s": 1.8, "v_c": 1e-6}
    assert widget.runs != before
    assert [each["value"] for each in widget.panel["sliders"]] == [1.8, 1e-6]
    widget.set({"sigma_2": 0.2})  # without a slider
    assert widget.trace().model.sigma_2 == 0.2
    path = widget.export(tmp_path / "one.toml")
    assert load_scenario(path).simulate().t[-1] == 30.0


def test_poke_fork_and_compare(widget: Explorer) -> None:
    assert widget.poke({"z": {0: -1.4}}, t=25.0) == 1
    assert (widget.shown, widget.current) == ((0, 1), 1)
    assert len(widget.runs["runs"]) == 2
    widget.show(0)
    assert widget.fork(law="signed", name="other law") == 2
    comparison = widget.compare(0, 1)
    assert comparison.first_difference == pytest.approx(25.0)
    assert widget.shown == (0, 1)
    assert [each["name"] for each in widget.panel["branches"]][2] == "other law"
    assert widget.panel["law"] == "published"
    widget.show(2)
    assert widget.panel["law"] == "signed"
    widget.delete(2)
    assert widget.shown == (0,)
    assert set(widget.branches) == {0, 1}


def test_requests_of_the_browser(widget: Explorer) -> None:
    ask(widget, do="set", values={"F_s": 1.7})
    assert widget.values["F_s"] == 1.7
    panel = ask(
        widget, do="poke", contact="", what="z", element=1, value=0.3, t=20.0, microstep=None
    )
    assert panel["shown"] == [0, 1]
    assert widget.branches[1].text == "z2 = 0.3 at 20 s"
    ask(widget, do="poke", contact="", what="", element=0, value="slip", t=21.0, microstep=None)
    assert widget.branches[2].text == "state 1 = slip at 21 s"
    ask(widget, do="rename", branch=2, name="slips")
    assert widget.branches[2].name == "slips"
    panel = ask(widget, do="export", branch=2)
    assert 'title = "slips"' in panel["file"]["text"]  # type: ignore[index]
    assert ask(widget, do="show", branch=0)["file"] is None


def test_a_request_that_cannot_be_met_is_answered(widget: Explorer) -> None:
    runs = widget.runs
    panel = ask(widget, do="set", values={"F_s": -1.0})
    assert "F_s" in str(panel["said"])
    assert widget.runs is runs
    assert panel["sliders"][0]["value"] == 1.5  # type: ignore[index]
    assert "original" in str(ask(widget, do="delete", branch=0)["said"])
    assert "explode" in str(ask(widget, do="explode")["said"])
    assert ask(widget, do="set", values={"F_s": 1.6})["said"] == ""


def test_a_failed_run_says_why() -> None:
    rig = Prescribed(FIG4_SINE)
    ranges = {"F_s": (0.5, 3.0)}
    widget = plots.explore(stick_slip("published"), rig, 30.0, sliders=ranges, max_steps=60)
    assert "60" in widget.panel["failed"]
    assert widget.runs["runs"][0]["rows"] > 0


def test_a_branch_that_cannot_be_made_any_more_is_not_shown() -> None:
    """Its parent now ends before the poke."""
    chart = Chart(
        "root", inputs=("v",), variables=("z",), parameters=("g",),
        states=(State("only", flow={"z": "v * g * sqrt(sgn(0.5 - z))"}, outputs={"F": "z"}),),
    )  # fmt: skip
    model = ChartModel(chart, {"g": 1.0})
    widget = plots.explore(model, Prescribed("0.1"), 3.0, sliders={"g": (0.5, 20.0)})
    widget.poke({"z": {0: 0.0}}, t=2.0)
    widget.show(0)
    widget.set(g=10.0)
    panel = ask(widget, do="show", branch=1)
    assert "before the poke" in str(panel["said"])
    assert (widget.shown, widget.current) == ((0,), 0)


def test_a_system() -> None:
    pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.1}, v="v_m")
    mass = Body("mass", inertia="m", force="2 * sin(t)", x="x_m", v="v_m")
    system = System("pushed", bodies=(mass,), contacts=(pad,), numbers={"m": 1.0})
    ranges = {"numbers.m": (0.5, 2.0), "pad.F_s": (1.0, 1.9)}
    widget = plots.explore(system, 4.0, sliders=ranges)
    ask(widget, do="set", values={"numbers.m": 1.5})
    ask(widget, do="poke", contact="", what="x_m", element=-1, value=0.1, t=1.0, microstep=None)
    assert widget.panel["said"] == ""
    assert widget.branches[1].text == "x_m = 0.1 at 1 s"
    ask(widget, do="poke", contact="pad", what="", element=0, value="forward", t=3.0, microstep=0)
    assert widget.panel["laws"] == []
    assert widget.panel["pokes"]["others"] == [["x_m", "m"], ["v_m", "m/s"]]


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(MissingExtraError, match=r"gms-fsm\[jupyter\]"):
        plots.explore(stick_slip("signed"), Prescribed("0.2"), 3.0, sliders={})


def test_a_branch_is_not_compared_with_itself(widget: Explorer) -> None:
    with pytest.raises(SessionError, match="give two branches"):
        widget.compare(0, 0)


def test_an_empty_request_is_no_request(widget: Explorer) -> None:
    before = ask(widget, do="goto", t=1.0)
    widget.request = {}
    assert widget.panel == before
