"""Each line of the table of constructs is true: a yes runs, and a no is refused by name."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from transitions import Machine
from transitions.extensions.asyncio import AsyncMachine

from gms_fsm import (
    Chart,
    ChartModel,
    GMSError,
    Parameter,
    Prescribed,
    State,
    Supervisor,
    System,
    Trace,
    simulate,
)
from gms_fsm import Transition as Edge
from gms_fsm.charts import timetable
from gms_fsm.traces.failures import LivelockError
from tests.helpers import ROOT

PAGE = (ROOT / "docs" / "comparison.md").read_text(encoding="utf-8")
TABLE = PAGE.partition("## Constructs of state charts")[2].partition("\n## ")[0]
ROWS = [[cell.strip() for cell in row.split("|")[1:-1]] for row in TABLE.splitlines() if "|" in row]
LINES = {row[0]: row[4] for row in ROWS[2:]}
A, B, C = State("a"), State("b"), State("c")
OUTER = State("b", states=(State("x"), State("y")))


def chart(*parts: State | Edge, **more: Any) -> Chart:
    """Return a chart of two states, or of those given."""
    states = [each for each in parts if isinstance(each, State)] or [A, B]
    edges = [each for each in parts if isinstance(each, Edge)]
    whole: dict[str, Any] = {"inputs": ("v", "t"), "variables": ("n",), "outputs": {"F": "n"}}
    return Chart("one", states=states, transitions=edges, **{**whole, **more})


def run(*parts: State | Edge, values: dict[str, float] | None = None, **more: Any) -> Trace:
    """Run it for 2 s at v = 1 m/s."""
    model = ChartModel(chart(*parts, **more), values or {})
    return simulate(model, Prescribed("1 + 0 * t"), 2.0, engine="ifelse")


def taken(trace: Trace) -> list[str]:
    """Return the edges, in their order."""
    return trace.transitions.edge.tolist()


def last(trace: Trace) -> float:
    """Return the variable at the end."""
    return float(trace.variable("n")[-1, 0])


def document(inside: str, data: str = "", **texts: Any) -> Chart:
    """Return the chart of a document with the state a."""
    state = inside if inside.startswith("<state") else f'<state id="a">{inside}</state>'
    path = Path("own.scxml")
    path.write_text(f'<scxml xmlns="http://www.w3.org/2005/07/scxml">{data}{state}</scxml>')
    return Chart.from_scxml(path, **{"outputs": {"F": "0"}, **texts})


def go(guard: str = "True", actions: dict[str, str] | None = None, name: str = "go") -> Edge:
    """Return an edge from a to b."""
    return Edge(name, "a", "b", guard, actions)


# --------------------------------------------------------------------------- what there is
def first() -> None:
    assert run(B, A).states[0].tolist() == ["b"]


def condition() -> None:
    assert run(go("t > 1.25")).transitions.t.tolist() == [pytest.approx(1.25, abs=1e-9)]


def always() -> None:
    assert run(go()).transitions.t.tolist() == [0.0]


def priority() -> None:
    assert taken(run(go(name="one"), go(name="two"))) == ["one"]


def in_a_row() -> None:
    found = run(A, B, C, go("t > 1"), Edge("on", "b", "c", "True"))
    assert taken(found) == ["go", "on"]
    assert len({*found.transitions.t.tolist()}) == 1
    with pytest.raises(LivelockError):
        run(go(), Edge("back", "b", "a", "True"))


def actions() -> None:
    assert last(run(go("t > 1", {"n": "n + 3"}))) == 3


def entry_and_exit() -> None:
    parts = State("a", exit={"n": "n + 1"}), State("b", entry={"n": "10 * n"})
    assert last(run(*parts, go("t > 1", {"n": "n + 4"}))) == 50


def nested() -> None:
    assert run(A, OUTER, go("t > 1")).states[-1].tolist() == ["b.x"]


def outer_edges() -> None:
    found = run(OUTER, A, Edge("outer", "b", "a", "t > 1"), Edge("inner", "b.x", "b.y", "t > 1"))
    assert taken(found) == ["inner", "outer"]


def shared() -> None:
    inside = State("x", flow={"n": "2 * v"}), State("y")
    outer = State("b", flow={"n": "v"}, states=inside)
    assert last(run(outer, Edge("on", "b.x", "b.y", "t > 1"))) == pytest.approx(3.0)


def outer_time() -> None:
    inner = Edge("inner", "b.x", "b.y", "t > 0.5")
    found = run(OUTER, A, inner, Edge("outer", "b", "a", "after(0.75)"))
    assert found.transitions.t[1] == pytest.approx(0.75, abs=1e-9)


def histories() -> None:
    edges = (
        Edge("inner", "b.x", "b.y", "t > 0.2"),
        Edge("out", "b", "a", "t > 0.5 and t < 0.6"),
        Edge("back", "a", "b", "after(0.2)"),
    )
    for history, entered in ((True, "b.y"), (False, "b.x")):
        states = replace(OUTER, history=history), A
        assert run(*states, *edges).transitions.target[2] == entered


def while_active() -> None:
    assert last(run(State("a", flow={"n": "v"}))) == pytest.approx(2.0)


def outputs() -> None:
    assert run(State("a", outputs={"F": "7"}), B).F[0] == 7


def time_in_a_state() -> None:
    assert run(go("after(0.75)")).transitions.t.tolist() == [pytest.approx(0.75, abs=1e-9)]
    later = '<onentry><send event="e" delay="750ms"/></onentry><transition event="e" target="b"/>'
    found = document(f'<state id="a">{later}</state><state id="b"/>')
    assert found.transitions[0].guard == "after(0.75)"


def time_of_a_condition() -> None:
    guard = "duration(abs(v) < 2) >= 0.75"
    assert run(go(guard)).transitions.t.tolist() == [pytest.approx(0.75, abs=1e-9)]


def at_given_times() -> None:
    hand = Supervisor("hand", timetable({"oil": (0.25, 0.75)}))
    log = simulate(System("by hand", supervisors=(hand,)), 1.0).transitions
    assert log.t.tolist() == [0.25, 0.75]


def data() -> None:
    given = '<datamodel><data id="n" expr="3"/></datamodel>'
    edge = '<transition cond="v &gt; 0" target="b"><assign location="n" expr="n + 1"/></transition>'
    found = document(f'<state id="a">{edge}</state><state id="b"/>', given)
    assert found.initial == {"n": 3.0}
    assert last(run(State("a"), initial={"n": 3.0})) == 3


def constants() -> None:
    given: dict[str, Any] = {"parameters": (Parameter("k", "N", "> 0"),), "outputs": {"F": "k"}}
    assert run(A, **given, values={"k": 2.0}).F[0] == 2
    with pytest.raises(GMSError, match=r"k is -2\.0; it must be > 0"):
        run(A, **given, values={"k": -2.0})


def named() -> None:
    assert run(A, let={"f": "2 * v"}, outputs={"F": "f"}).F[0] == 2


def final() -> None:
    found = document('<state id="a"><transition target="b"/></state><final id="b"/>')
    assert found.leaving("b") == ()


def without_target() -> None:
    edge = '<transition cond="n &lt; 3"><assign location="n" expr="n + 1"/></transition>'
    found = document(edge, '<datamodel><data id="n" expr="0"/></datamodel>')
    assert [(each.source, each.target) for each in found.transitions] == [("a", "a")]
    assert last(run(A, Edge("on", "a", "a", "n < 3", {"n": "n + 1"}))) == 3


def log() -> None:
    with pytest.warns(UserWarning, match="<log> is left out.*state 'a', onentry"):
        assert document("<onentry><log expr='1'/></onentry>") == document("")
    assert len(run(go()).transitions) == 1


def wildcards() -> None:
    machine = Machine(states=["a", "b"], initial="a", transitions=[["go", "*", "b"]])
    found = Chart.from_transitions(machine, outputs={"F": "0"}, guards={"go": "v > 1"})
    assert found.transitions[0].sources == ("a", "b")


# --------------------------------------------------------------------------- what there is not
def machine_with(**more: Any) -> Chart:
    """Return the chart of a machine."""
    return Chart.from_transitions(AsyncMachine(states=["a"], initial="a", **more))


INNER = '<transition cond="v &gt; 1"/><onentry><assign location="n" expr="1"/></onentry>'
YES: dict[str, Callable[[], object]] = {
    "states, a first one": first,
    "edges with a condition": condition,
    "edges without a condition": always,
    "priority": priority,
    "several edges in a row": in_a_row,
    "actions of an edge": actions,
    "entry and exit": entry_and_exit,
    "states in states": nested,
    "edges of an outer state": outer_edges,
    "what states inside share": shared,
    "time in an outer state": outer_time,
    "histories": histories,
    "while a state is active": while_active,
    "outputs of a state": outputs,
    "time in a state": time_in_a_state,
    "time for which a condition has held": time_of_a_condition,
    "events at given times": at_given_times,
    "data with a value at the start": data,
    "constants": constants,
    "named expressions": named,
    "final states": final,
    "edges without a target": without_target,
    "log": log,
    "wildcards of states": wildcards,
}
NO: dict[str, tuple[str, Callable[[], object]]] = {
    "condition actions": ("guard, column 10", lambda: chart(go("t > 1 {n = 1}"))),
    "events sent later to others": (
        "<send>",
        lambda: document('<onentry><send delay="1s"/></onentry>'),
    ),
    "the same with entry or exit": ("performs exit and entry of 'a'", lambda: document(INNER)),
    "deep histories": ("history is 'deep'", lambda: replace(OUTER, history="deep")),  # type: ignore[arg-type]
    "parallel states": ("<parallel>", lambda: document('<state id="a"/><parallel id="b"/>')),
    "several targets": ("'a b'", lambda: document('<transition target="a b"/>')),
    "junctions": ("'junction' is not a state", lambda: chart(Edge("go", "a", "junction", "True"))),
    "scripts, loops": ("<foreach>", lambda: document("<onexit><foreach/></onexit>")),
    "if in actions": ("<if>", lambda: document("<onexit><if cond='v'/></onexit>")),
    "functions of the host": ("guard", lambda: chart(go(lambda t: t > 1))),  # type: ignore[arg-type]
    "actors": ("<invoke>", lambda: document("<invoke/>")),
    "asynchronous actions": ("AsyncMachine", machine_with),
}


def test_every_line_has_its_test() -> None:
    assert {name for name, here in LINES.items() if here == "yes"} == {*YES}
    assert {name for name, here in LINES.items() if here == "no"} == {*NO}
    assert {*LINES.values()} == {"yes", "no"}


@pytest.mark.parametrize("name", YES)
def test_a_yes_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    YES[name]()


@pytest.mark.parametrize("name", NO)
def test_a_no_is_refused_by_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said, call = NO[name]
    with pytest.raises(GMSError, match=re.escape(said)):
        call()
