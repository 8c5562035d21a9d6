"""With a custom chart the debugger uses its names of variables, states and edges."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, Transition
from gms_fsm.app.scenario import scenario_to_debug
from gms_fsm.debugger import COMMANDS, Debugger, help_of
from gms_fsm.session.session import Session
from tests.helpers import ROOT, stick_slip

SCENARIOS = ROOT / "scenarios"


def contact(n: int = 1) -> ChartModel:
    """Three states, two variables; w decays while the contact moves."""
    chart = Chart(
        "warming contact",
        ("v", "s"),
        ("z", "w"),
        ("k", "tau"),
        (
            State("static", {"z": "v", "w": "0"}),
            State("rising", {"z": "v", "w": "(1 - w) / tau"}),
            State("kinetic", {"z": "0", "w": "-w / tau"}),
        ),
        (
            Transition("break_away", "static", "rising", guard="abs(z) >= s"),
            Transition("let_go", "rising", "kinetic", guard="w > 0.5"),
            Transition("arrest", "kinetic", "static", guard="abs(v) <= 0.01", actions={"z": "0"}),
        ),
        {"F": "k * z"},
    )
    values = {"k": 1.0, "tau": 1.0}
    return ChartModel(chart, values, n=n, stribeck=Stribeck(0.1, 0.2, 0.1), weights=[1.0] * n)


def session_on(session: Session) -> Debugger:
    """Return a debugger that reads and prints nothing."""
    return Debugger(session, "", io.StringIO(), io.StringIO())


def own(n: int = 1, t_end: float = 8.0) -> Debugger:
    """Return a debugger on that contact, moved back and forth."""
    return session_on(Session(contact(n), Prescribed("0.2*sin(t)"), t_end))


@pytest.mark.parametrize("title", ["", "My contact"])
def test_it_greets_without_a_scenario(title: str) -> None:
    out = io.StringIO()
    made = Debugger(own().session, title, io.StringIO("next\nquit\n"), out)
    assert made.run() == 0
    said = out.getvalue().splitlines()
    assert said[: bool(title)] == [title] * bool(title)
    assert said[bool(title) :][:3] == [
        "warming contact; prescribed velocity, to t = 8 s",
        "help lists the commands, where shows everything, quit exits.",
        "(t=0.0000 s) next",
    ]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_examples_of_this_session(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    made = own(3, 0.7)
    for line in ("watch x", "b arrest", "poke w1=0.1", "run", "save mine.json"):
        assert "error" not in made.reply(line)
    text = made.reply(f"help {name}")
    assert "slip" not in text
    assert "{" not in text
    examples = help_of(name, made.session).examples
    assert examples
    for example in examples:
        assert f"example: {example}" in text
        if name != "plot":
            made.reply("goto 0.1")
            assert "error:" not in made.reply(example)


def test_a_single_element_is_completed_without_its_number() -> None:
    assert own(2).completedefault("w", "poke w", 5, 6) == ["w1=", "w2="]


def test_a_scenario_is_read() -> None:
    path = SCENARIOS / "paper_fig4_stick_slip.toml"
    loaded = scenario_to_debug(path, ["model.law=signed"])
    assert loaded.model.title == stick_slip("signed").title
