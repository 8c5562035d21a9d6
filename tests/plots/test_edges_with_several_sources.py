"""An edge that leaves several states is drawn, painted, counted and replayed once per source."""

from __future__ import annotations

import pytest

from gms_fsm import simulate
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.systems.system import Body, Contact, System
from gms_fsm.traces.trace import Trace
from plots import LiveChart, mermaid, statechart
from plots.page._rows import page_rows
from plots.page._run import stored_run
from tests.plots.stored import integers

RESET = Chart(
    "reset",
    inputs=("v", "t"),
    states=tuple(State(name, outputs={"F": "0"}) for name in ("low", "high", "off")),
    transitions=(
        Transition("up", "low", "high", guard="t >= 1"),
        Transition("stop", ("low", "high"), "off", guard="t >= 2"),
    ),
)


@pytest.fixture(scope="module")
def trace() -> Trace:
    """Return a run in which low is left by the edge up, and high by the edge stop."""
    bodies, contacts = (Body("mass", inertia=1.0),), (Contact("pad", RESET),)
    return simulate(System("reset", bodies=bodies, contacts=contacts), 3.0)


def test_each_source_has_its_own_line() -> None:
    source = statechart(RESET).source
    for state, priority in (("low", 2), ("high", 1)):
        guard = f'"element1-guard-stop-from-{state}"'
        assert f'"element1-state-{state}" -> {guard}' in source
        assert f'{guard} -> "element1-state-off"' in source
        (drawn,) = (line for line in source.splitlines() if line.strip().startswith(f"{guard} ["))
        assert f"<B>{priority}</B>" in drawn
    assert "element1-guard-up-from" not in source
    assert [line.split(" : ")[0].strip() for line in mermaid(RESET).splitlines()[-3:]] == [
        "s1_low --> s2_high",
        "s1_low --> s3_off",
        "s2_high --> s3_off",
    ]


def test_only_the_line_that_was_taken_is_painted(trace: Trace) -> None:
    svg = LiveChart(trace).frame(-1)
    fired = [line.split('"')[1] for line in svg.split("<g ") if "fired" in line]
    assert sorted(fired) == [
        "element1-edge-stop-from-high-1",
        "element1-edge-stop-from-high-2",
        "element1-guard-stop-from-high",
    ]


def test_only_the_line_that_was_taken_is_counted(trace: Trace) -> None:
    source = statechart(RESET, counts=trace).source
    assert source.count("taken once") == 2
    assert source.count("never taken") == 1


def test_a_page_shows_the_edge_of_the_state_that_was_left(trace: Trace) -> None:
    (contact,) = stored_run(page_rows(trace), [0], [])["contacts"]
    names = [(edge["name"], contact["states"][edge["source"]]) for edge in contact["edges"]]
    edges = integers(contact["log"][2])
    assert [names[edge] for edge in edges] == [("up", "low"), ("stop", "high")]
