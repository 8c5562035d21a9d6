"""The debugger answers scripts with the approved transcript, each answer in lines of 80 columns.

``python -m tests.app.test_debugger_transcripts`` runs the commands of the transcript anew.
"""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable
from contextlib import chdir
from pathlib import Path

import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, Transition, simulate
from gms_fsm.app.scenario import load_scenario, run_debugger
from gms_fsm.session.session import Session
from tests.helpers import ROOT, pulled_mass
from tests.inspection.sessions import a_system, both_ways, debugger, fig4, locked, warming

APPROVED = Path(__file__).with_name("debugger.approved.txt")
SCENARIOS = ROOT / "gms_fsm/scenarios"
FIG_4 = "paper_fig4_stick_slip"
PROMPT = ">>> "


def talk(scenario: str, *commands: str, overrides: tuple[str, ...] = ()) -> str:
    """Return all that is printed while commands are given to a scenario."""
    loaded = load_scenario(SCENARIOS / f"{scenario}.toml", overrides)
    out = io.StringIO()
    script = io.StringIO("".join(f"{command}\n" for command in commands))
    code = run_debugger(loaded, script, out)
    assert code == ("\nerror: " in out.getvalue())
    return out.getvalue()


def answers(scenario: str, *commands: str) -> list[str]:
    """Return the answer to each command."""
    parts = talk(scenario, *commands, "quit").split("\n(t=")
    return [part.partition("\n")[2] for part in parts[1 : len(commands) + 1]]


def _wide() -> Chart:
    names = ("a", "b", "c", "d")
    flows = dict.fromkeys(names, "v")
    edges = [Transition(f"e{i}", "on", "off", guard=f"a > {i} and b > 9") for i in range(1, 5)]
    states = (State("on", flows), State("off", flows))
    return Chart("wide", ("v",), names, ("k",), states, tuple(edges), {"F": "k * a"})


def _element(*edges: Transition, states: tuple[str, ...]) -> Chart:
    parts = tuple(State(name, {"z": "v"}) for name in states)
    return Chart("element", ("v",), ("z",), ("k",), parts, edges, {"F": "k * z"})


def _of(chart: Chart, n: int = 1, rig: str = "0.1", t_start: float = 0.0) -> Session:
    model = ChartModel(chart, {"k": 1.0}, n=n, stribeck=Stribeck(1.0, 1.0, 1.0))
    return Session(model, Prescribed(rig), 2.0, t_start=t_start)


CASES = (Transition("go", "on", "ON", guard="z > 1"), Transition("Go", "ON", "on", guard="z < 0"))
BAD = Transition("go", "on", "off", guard="0 / (z - z) > 0")
SESSIONS: dict[str, Callable[[], Session]] = {
    "fig 4": fig4,
    "pulled mass": lambda: Session(*pulled_mass(), 20.0),
    "a chart of one's own": warming,
    "two elements of it": lambda: warming(2),
    "a spring": lambda: _of(_element(states=("on",)), 2, t_start=1.0),
    "many edges": lambda: _of(_wide(), 2),
    "cases": lambda: _of(_element(*CASES, states=("on", "ON"))),
    "a livelock": lambda: Session(both_ways(), Prescribed("0.15"), 20.0),
    "a guard without a value": lambda: _of(_element(BAD, states=("on", "off")), rig="1"),
    "a system": a_system,
    "a lock": locked,
}


def sections() -> dict[str, str]:
    """Return the approved transcript of each script by its title."""
    parts = APPROVED.read_text(encoding="utf-8").split("=== ")[1:]
    return {title: said for title, _, said in (part.partition("\n") for part in parts)}


def played(title: str, said: str) -> str:
    """Return the transcript of the commands of a transcript, given anew."""
    made = debugger(SESSIONS[title.partition(":")[0]]())
    lines = []
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        for line in said.splitlines():
            if line.startswith(PROMPT):
                lines += [line, *made.reply(line.removeprefix(PROMPT)).splitlines()]
    return "\n".join(lines) + "\n"


@pytest.mark.slow
@pytest.mark.parametrize("title", sections())
def test_a_script_is_answered_as_approved(title: str) -> None:
    said = sections()[title]
    assert played(title, said) == said
    for line in said.splitlines():
        assert len(line) <= 80
        assert line.isascii()


def test_fig_4_story_from_its_greeting() -> None:
    said = talk(FIG_4, "break fires break_away_backward element 2", "continue", "why 2", "quit")
    head = """\
Stick-slip (paper, Fig. 4)
GMS, 4 elements, published law; prescribed velocity, to t = 100 s
help lists the commands, where shows everything, quit exits.
(t=0.0000 s) break fires break_away_backward element 2
breakpoint 1: fires break_away_backward, element 2
(t=0.0000 s) continue
"""
    assert said.startswith(head)
    assert said.endswith("for the edges that leave slip: step, then why 2\n(t=20.1407 s) quit\n")


def test_why_element_1_does_not_arrest_is_known_within_five_commands() -> None:
    for commands in (("goto 25", "why 1"), ("u t >= 25", "why")):
        said = talk(FIG_4, *commands)
        assert "element 1 is in slip" in said
        assert "arrest does not fire: |z| < s is false by 0.776 m." in said
        assert said.endswith("(t=25.0000 s) \n")  # the end of input is a quiet quit
    signed = talk(FIG_4, "goto 25", "why 1", overrides=("model.law=signed",))
    assert "element 1 is in stick" in signed


def test_every_transition_of_the_log_is_shown() -> None:
    loaded = load_scenario(SCENARIOS / f"{FIG_4}.toml")
    log = simulate(loaded.model, loaded.rig, **loaded.arguments).transitions
    *said, end, shown = answers(FIG_4, *["next"] * (len(log) + 1), "log 1000")
    for record, text in zip(log, said, strict=True):
        assert f"t = {record.t:.9g} s, micro-step " in text
        by = f"{record.source} -> {record.target} by {record.edge}"
        assert f"element {record.element + 1}: {by}" in text
    assert "end of the run" in end
    assert len(shown.splitlines()) == len(log)


if __name__ == "__main__":
    parts = (f"=== {title}\n{played(title, said)}" for title, said in sections().items())
    APPROVED.write_text("".join([*parts]), encoding="utf-8")
