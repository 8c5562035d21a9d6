"""Under a load N a threshold is that of the row: nothing shows the curve without the load."""

from __future__ import annotations

import functools

import pytest

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.figure import Figure
from matplotlib.text import Text

from gms_fsm import GMS, Body, Contact, GMSParameters, ParameterError, System, simulate
from gms_fsm.traces.trace import Trace
from plots import panels
from plots.handouts.page import handout_figure
from plots.page.replay import page_data
from plots.views.plane import Plane


@functools.cache
def pad() -> Trace:
    contact = Contact(
        "pad", GMS(GMSParameters.paper("stick-slip"), law="signed"), v="v", inputs={"N": "2 + t"}
    )
    body = Body("body", velocity="v")
    moved = System("moved", bodies=(body,), contacts=(contact,), signals={"v": "0.2"})
    return simulate(moved, 1.0).contact("pad")


def test_landscape() -> None:
    plane, s = Plane.of(pad(), 0, 0), pad().s[0, 0]
    guard = plane.chart.guards["break_away_forward"]
    assert plane.truths(guard, 0.1, [0.99 * s, 1.01 * s]).tolist() == [False, True]


def test_replay_page() -> None:
    data, _ = page_data([pad()], draw=lambda chart, elements: "")
    (contact,) = data["runs"][0]["contacts"]
    assert contact["curve"] is None


@pytest.mark.slow
def test_handout() -> None:
    found = handout_figure(pad().model).findobj(Text)
    texts = [each.get_text() for each in found]
    assert any(text.startswith("$s_{i} = w_{i}") and text.endswith("N$") for text in texts)


def test_stribeck_panel() -> None:
    with pytest.raises(ParameterError, match="thresholds follow a load"):
        panels.stribeck(Figure().subplots(), pad())
