"""The debugger shows bodies, contacts, signals and sampled values; elements belong to contacts."""

from __future__ import annotations

import io
from collections.abc import Callable

import pytest

from gms_fsm.debugger import COMMANDS, Debugger, help_of, view
from gms_fsm.session.session import Session
from tests.inspection.sessions import pushed
from tests.systems_cases import CASES


def made(period: float | None = None) -> Debugger:
    return Debugger(Session(pushed(period), 2.0), "", io.StringIO(), io.StringIO())


def pulled() -> Debugger:
    session = Session(CASES["pulled_mass"]().system, 12.0)
    return Debugger(session, "", io.StringIO(), io.StringIO())


def test_where_shows_everything_in_80_columns() -> None:
    debugger = made()
    debugger.reply("goto 1.02")
    said = debugger.reply("where").splitlines()
    here = debugger.session.here
    assert max(map(len, said)) <= 80
    assert said[1].startswith(f"one  q1 = {here.body('one').x:.6g}, w1 = ")
    assert said[3].startswith(f"further states: i = {here.values['i']:.6g}")
    assert said[4].endswith("count = 21; next tick at t = 1.05 s")
    assert said[5].startswith("signals: r = 0.0841471")
    assert "pad: Coulomb friction with stiction" in said
    assert "bank: GMS, 4 elements, signed law" in said
    ribbons = [line.split()[:2] for line in said if line.startswith((" pad", " bank"))]
    assert ribbons == [["pad", "1"], *(["bank", str(i)] for i in range(1, 5))]


def test_the_view_is_plain_data() -> None:
    debugger = made()
    debugger.reply("goto 1.02")
    seen = view(debugger.session)
    assert [body.name for body in seen.bodies] == ["one", "two"]
    assert [each.title for each in seen.values] == ["further states", "sampled pid", "signals"]
    assert [contact.name for contact in seen.contacts] == ["pad", "bank"]
    assert len(seen.elements) == 5


@pytest.mark.parametrize("name", ["why", "print", "watch", "element", "until", "break", "poke"])
@pytest.mark.parametrize("which", [pulled, made])
def test_help_has_examples_of_this_system(name: str, which: Callable[[], Debugger]) -> None:
    debugger = which()
    text = debugger.reply(f"help {name}")
    assert "{" not in text
    for example in help_of(name, debugger.session).examples:
        assert f"example: {example}" in text
        if not example.startswith("until"):  # to the end
            assert "error:" not in debugger.reply(example), example


@pytest.mark.parametrize("which", [pulled, made])
def test_every_command_has_help(which: Callable[[], Debugger]) -> None:
    session = which().session
    for name in COMMANDS:
        assert "{" not in str(help_of(name, session))
        assert help_of(name, session).examples


def test_completion_offers_names_of_the_system() -> None:
    words = made().commands.words
    assert "bank 2" in words("why", "why ")
    assert "bank.state(2)" in words("until", "until ")
    assert {"q1=", "u=", "bank.z4=", "bank.state4=", "pad.state1="} <= {*words("poke", "poke ")}
    assert "r=" not in words("poke", "poke ")
