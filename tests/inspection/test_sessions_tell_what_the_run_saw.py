"""Rows, firings and explanations are those of the trace, and print as the debugger's text."""

from __future__ import annotations

import io

import pytest

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    Prescribed,
    Session,
    State,
    System,
    Transition,
    simulate,
)
from gms_fsm.charts import CHARTS
from gms_fsm.debugger import Debugger
from gms_fsm.errors import SessionError
from gms_fsm.session.explain import Clause, explain
from gms_fsm.session.session import Fired
from gms_fsm.traces.scope import clause_unit
from tests.corpus import HEALS
from tests.helpers import pulled_mass
from tests.inspection.sessions import a_system, debugger, fig4, locked, pulled, pushed, warming
from tests.systems_cases import DRY


def plain(text: object) -> str:
    """Return a text as a terminal without drawing characters shows it."""
    return str(text).replace("µ", "u")


def one_line(text: str) -> str:
    """Undo the line wrapping."""
    return " ".join(text.split())


@pytest.mark.slow
def test_why_is_explain_on_the_trace_at_every_row() -> None:
    session, trace = pulled(11.0), simulate(*pulled_mass(), 11.0)
    for row in range(len(trace)):
        for element in range(4):
            assert session.why(element) == explain(trace, row, element)
        session.step()
    assert session.branch.ended


def test_clauses_are_the_guard_by_hand() -> None:
    session = fig4()
    here = session.goto(25.0)
    (arrest,) = session.why(0)
    slow, inside = arrest.clauses
    assert (slow.text, inside.text) == ("|v| <= v_c", "|z| < s")
    assert (slow.left, slow.right, slow.holds) == (abs(here.v), 1e-6, abs(here.v) <= 1e-6)
    assert (inside.left, inside.right) == (abs(here.z[0]), here.s[0])
    assert inside.margin == here.s[0] - abs(here.z[0]) == pytest.approx(-0.776, abs=5e-4)
    assert not inside.holds


def test_it_prints_the_text_of_the_debugger() -> None:
    session = fig4()
    asked = debugger(session)
    for command in ("step", "next", "next", "until z1 > 0.1", "prev", "goto 25", "prev"):
        assert asked.reply(command) == plain(session.here)
        for element in range(4):
            said = asked.reply(f"why {element + 1}").partition("\nfor the edges that leave")[0]
            assert one_line(plain(session.why(element))) == one_line(said)
    title = "GMS, 4 elements, published law; prescribed velocity, to t = 100 s"
    assert repr(session) == f"<Session: {title}; at t = {session.here.t:.9g} s>"
    assert session.why() == session.why(0)


def test_a_firing_names_its_edge_and_its_contact() -> None:
    session = fig4()
    assert session.here.fired is None
    here = session.next_transition()
    assert here.fired == Fired(0, "break_away_forward", "stick", "slip")
    assert str(here.fired) == "element 1: stick -> slip by break_away_forward"
    assert session.back().fired is None
    session = a_system()
    here = session.next_transition()
    assert here.fired is not None
    assert (here.fired.contact, here.fired.element) == ("pad", 0)
    assert str(here).splitlines()[1] == "  pad 1: stuck -> forward by release_forward"


def test_one_edge_alone_and_on_a_firing_those_of_both_states() -> None:
    session = fig4()
    (backward,) = session.why(1, "break_away_backward")
    assert backward == session.why(1)[1]
    assert (backward.priority, len(session.why(1))) == (2, 2)
    session = warming()
    session.next_transition()
    old, new = session.why(0, "break_away"), session.why(0, "let_go")
    assert (old.left, old[0].fired, old[0].past) == ("static", True, True)
    assert (new.left, new[0].fired, new[0].past) == ("", False, False)
    assert new.state == old.state == "rising"
    with pytest.raises(SessionError, match="arrest leaves kinetic; element 1 is in rising"):
        session.why(0, "arrest")


# --------------------------------------------------------------------------- systems
def test_a_row_has_bodies_contacts_and_values() -> None:
    session = a_system()
    here, trace = session.goto(1.01), simulate(pushed(), 2.0)
    for name in ("one", "two"):
        body = trace.body(name)
        assert (here.body(name).x, here.body(name).v) == (body.x[here.row], body.v[here.row])
    for name in ("pad", "bank"):
        contact = trace.contact(name)
        assert contact.F[here.row] == here.contact(name).F
        assert here.contact(name).states == tuple(contact.states[here.row])
    assert here.values == {name: trace.value(name)[here.row] for name in ("i", "u", "count")}


def test_why_of_a_locked_element_shows_the_force_that_holds_it() -> None:
    session = locked()
    t = session.goto(5.0).t
    forward = session.why("pad 1")[0]
    assert forward.clauses[0].left == pytest.approx(2.0 * 0.1 * t, rel=1e-12)  # K V t
    assert forward.clauses[0].right == DRY["F_s"]
    assert str(session.why()).startswith("pad 1 is in stuck at t = ")
    assert session.why() == session.why("pad") == session.why("pad 1")


def test_why_shows_the_time_in_the_state_which_only_a_poke_of_the_state_begins_anew() -> None:
    chart = Chart(
        "timed",
        parameters=("T",),
        states=(State("free", outputs={"F": "0"}), State("braked", outputs={"F": "0.5"})),
        transitions=(
            Transition("brake", "free", "braked", guard="after(T) and v > 0"),
            Transition("open", "braked", "free", guard="after(2 * T)"),
        ),
    )
    body = Body("mass", inertia=1.0, force="1")
    contact = Contact("c", chart, {"T": 0.25})
    session = Session(System("timed", bodies=(body,), contacts=(contact,)), 3)
    t = session.goto(0.2).t
    (brake,) = session.why("c")
    assert (brake.clauses[0].text, brake.clauses[0].left) == ("after(T)", pytest.approx(t))
    session.poke({"mass.v": 1.0})
    assert session.next_transition().t == pytest.approx(0.25)
    session.switch(0)
    session.poke(state={"c": "braked"})
    assert session.next_transition().t == pytest.approx(t + 0.5)


def test_a_contact_with_a_period_says_when_it_is_asked() -> None:
    session = a_system(period=0.1)
    session.goto(0.05)
    why = session.why("pad")
    assert why.tick == 0.1
    assert "evaluated at ticks only, the next time at t = 0.1 s" in str(why)
    session.break_on("tested", "arrest_forward", "pad")
    here, _ = session.proceed()
    assert (here.t, session.why("pad").tick) == (0.1, None)


def test_a_row_that_is_missing_has_no_explanation() -> None:
    trace = fig4(1.0).tree.trace()
    for row, element in ((len(trace), 0), (0, 4), (0, -1)):
        with pytest.raises(IndexError, match=r"the trace has \d+ rows, 4 elements"):
            explain(trace, row, element)


def test_margins_are_relative_to_the_larger_side() -> None:
    assert Clause("a > b", True, 4.0, 1.0, 3.0).relative == 0.75
    assert Clause("a > b", False, 1.0, float("inf"), -float("inf")).relative == -1.0


def torn() -> Session:
    """Edges that are true together, of two comparisons, or of what cannot be computed."""
    chart = Chart(
        "torn",
        inputs=("v",),
        variables=("z",),
        states=(State("on", {"z": "v"}), State("off", {"z": "0"}), State("out", {"z": "0"})),
        transitions=(
            Transition("leave", "on", "off", guard="z > 0.1 or v > 9"),
            Transition("flee", "on", "out", guard="z > 0.1"),
            Transition("back", "off", "on", guard="1 / (z - z) > 1"),
        ),
        outputs={"F": "z"},
    )
    return Session(ChartModel(chart, {}), Prescribed("0.1"), 2.0)


def test_what_has_no_margin_is_said_in_words() -> None:
    session = torn()
    said = str(session.why(0))
    assert "leave does not fire: z > 0.1 || v > 9 is false." in said
    session.next_transition()
    session.back()
    said = one_line(str(session.why(0)))
    assert "flee does not fire: its guard is true, but leave takes precedence." in said
    session.goto(1.5)
    assert "cannot be computed here" in str(session.why(0))
    assert session.here.F_elements == (session.here.F,)


def test_of_many_contacts_a_row_shows_the_one_that_fired() -> None:
    names = "abcde"
    bodies = [Body(f"body_{each}", inertia=1.0, force="1", x=f"x_{each}", v=f"v_{each}")
              for each in names]  # fmt: skip
    pads = [Contact(f"pad_{each}", CHARTS["stiction"], DRY, v=f"v_{each}") for each in names]
    session = Session(System("many", bodies=bodies, contacts=pads), 1.0)
    assert "pad_" not in str(session.here)
    session.step(2)
    assert str(session.here).count("\n") <= 2


def test_answers_on_what_is_not_there() -> None:
    asked = debugger(fig4())
    assert "no contact 'pad'; the contacts are none" in asked.reply("poke pad.state1=slip")
    assert "'1 2' is not an element" in asked.reply("element 1 2")
    assert "F_s is a parameter, which stays" in asked.reply("poke F_s=2")
    asked = debugger(a_system())
    assert "no contact 'gear'; the contacts are pad, bank" in asked.reply("poke gear.state1=slip")
    session = fig4()
    session.watches.append("1 / z1")
    assert "watch 1: 1 / z1 = " in debugger(session).reply("watch")


def test_a_breakpoint_on_an_edge_looks_at_the_contacts_that_have_it() -> None:
    session = a_system()
    session.break_on("valid", "arrest")  # of the bank only
    assert debugger(session).reply("continue").startswith("no breakpoint was hit")


def test_an_interrupt_at_the_prompt_ends_nothing() -> None:
    class Script(io.StringIO):
        pressed = False

        def readline(self, *_: object) -> str:
            if self.pressed:
                return "quit\n"
            self.pressed = True
            raise KeyboardInterrupt

    out = io.StringIO()
    assert Debugger(fig4(), "", Script(), out).run() == 0
    assert "quit exits\n" in out.getvalue()


def test_a_clause_about_forces_has_their_unit() -> None:
    inputs = ("v", "N")
    states = (State("on"), State("off"))
    edges = (
        Transition("lift", "on", "off", guard="N <= 0"),
        Transition("let_go", "on", "off", guard="F > 2"),
    )
    chart = Chart("pad", inputs=inputs, states=states, transitions=edges, outputs={"F": "0.5 * N"})
    for edge in chart.guards.values():
        assert clause_unit(chart, edge) == "N"


def test_how_long_a_condition_has_held_is_asked_as_the_chart_shows_it() -> None:
    (clause,) = Session(HEALS, pulled_mass()[1], 0.4).why(0, "heal").edges[0].clauses
    assert (clause.text, clause.margin, clause.unit) == ("duration(|v| < 0.3) >= T", -0.1, "s")


def test_what_the_chart_makes_cannot_be_poked_without_a_number_either() -> None:
    made = debugger(Session(HEALS, pulled_mass()[1], 0.4))
    assert "duration is made by the chart" in made.reply("poke duration=0.2")
