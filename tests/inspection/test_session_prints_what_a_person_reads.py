"""A session, its rows and its explanations print as the text of the debugger."""

from __future__ import annotations

import io

import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.debugger import Debugger
from gms_fsm.errors import SessionError
from gms_fsm.session.explain import explain
from gms_fsm.session.session import Fired, Session
from tests.app.test_debugger_on_a_model_of_ones_own import contact
from tests.helpers import FIG4_SINE, stick_slip


def _both() -> tuple[Session, Debugger]:
    session = Session(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)
    return session, Debugger(session, "", io.StringIO(), io.StringIO())


def _one_line(text: str) -> str:
    """Undo the line wrapping."""
    return " ".join(text.split())


def test_why_prints_the_text_of_the_debugger() -> None:
    session, debugger = _both()
    for _ in range(20):
        for element in range(4):
            said = debugger.reply(f"why {element + 1}").partition("\nfor the edges that leave")[0]
            assert _one_line(str(session.why(element))) == _one_line(said)
            for each in session.why(element):
                verdict, *detail = str(each).split("\n")
                assert _one_line(verdict) in _one_line(said)
                assert "\n".join(detail) in said
        session.next_transition()


def test_so_does_explain_on_a_trace() -> None:
    trace = simulate(stick_slip("published"), Prescribed(FIG4_SINE), 30.0)
    session = Session(stick_slip("published"), Prescribed(FIG4_SINE), 30.0)
    session.goto(30.0)
    assert str(explain(trace, -1, 1)) == str(session.why(1))


def test_the_first_element_is_the_default() -> None:
    session, _ = _both()
    assert session.why() == session.why(0)
    assert session.why().element == 0


def test_a_row_prints_the_text_of_the_debugger() -> None:
    session, debugger = _both()
    for command in ("step", "next", "next", "until z1 > 0.1", "prev", "goto 25", "prev"):
        assert debugger.reply(command) == str(session.here)


def test_a_firing_is_readable() -> None:
    session, _ = _both()
    assert session.here.fired is None
    here = session.next_transition()
    assert here.fired == Fired(0, "break_away_forward", "stick", "slip")
    assert str(here.fired) == "element 1: stick -> slip by break_away_forward"
    assert session.back().fired is None
    located = session.until("t > 6")
    assert located.located
    assert located.fired is None


def test_a_session_is_a_line() -> None:
    session, _ = _both()
    title = "GMS, 4 elements, published law; prescribed velocity, to t = 100 s"
    assert repr(session) == f"<Session: {title}; at t = 0 s>"
    session.goto(25.0)
    session.poke({"z": {0: 0.0}})
    assert repr(session) == f"<Session: {title}; at t = 24.9999735 s, branch 1>"


def test_one_edge_alone() -> None:
    session, _ = _both()
    (backward,) = session.why(1, "break_away_backward")
    assert backward == session.why(1)[1]
    assert backward.priority == 2
    assert len(session.why(1)) == 2


@pytest.mark.parametrize(
    ("edge", "said"),
    [
        ("arest", "no edge 'arest'; there are break_away_forward, break_away_backward, arrest"),
        ("arrest", "arrest leaves slip; element 1 is in stick"),
    ],
)
def test_an_unknown_edge(edge: str, said: str) -> None:
    session, _ = _both()
    with pytest.raises(SessionError, match=said):
        session.why(0, edge)


def test_on_a_firing_both_states_have_their_edges() -> None:
    session = Session(contact(), Prescribed("0.2*sin(t)"), 8.0)
    session.next_transition()
    old, new = session.why(0, "break_away"), session.why(0, "let_go")
    assert (old.left, old[0].fired, old[0].past) == ("static", True, True)
    assert (new.left, new[0].fired, new[0].past) == ("", False, False)
    assert new.state == old.state == "rising"
    with pytest.raises(SessionError, match="arrest leaves kinetic; element 1 is in rising"):
        session.why(0, "arrest")


def test_another_variable_comes_back_from_a_file(tmp_path: object) -> None:
    session = Session(contact(2), Prescribed("0.2*sin(t)"), 8.0)
    session.goto(1.0)
    session.poke({"z": {1: 0.01}, "w": {0: 0.3, 1: 0.4}}, state={1: "rising"})
    session.step(5)
    loaded = Session.load(session.save(f"{tmp_path}/own.json"))
    assert loaded.here == session.here
    assert loaded.branch.edits == session.branch.edits
    assert loaded.watch("w2") == session.watch("w2")
