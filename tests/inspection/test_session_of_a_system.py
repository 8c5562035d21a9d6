"""A session of a system walks the bits of simulate() and names elements by their contacts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Body, Chart, Contact, Sampled, State, System, Transition, simulate
from gms_fsm.errors import ExpressionError, ParameterError, SessionError
from gms_fsm.session.session import Session
from tests.helpers import same_bits, stick_slip
from tests.systems_cases import CASES, DRY, STICTION

SAMPLED = Sampled("pid", period=0.05, updates={"u": "4 * (0.5 - q1)", "count": "count + 1"})


def pushed(period: float | None = None) -> System:
    """A mass with stiction that a sampled controller pushes, and a GMS bank on a second mass."""
    return System(
        "pushed mass",
        bodies=(
            Body("one", inertia="m", force="u - k * (q1 - q2)", x="q1", v="w1"),
            Body("two", inertia=2.0, force="k * (q1 - q2) + i", x="q2", v="w2"),
        ),
        contacts=(
            Contact("pad", STICTION, {"F_c": 0.2, "F_s": 0.3, "b": 0.1}, v="w1", period=period),
            Contact("bank", stick_slip("signed"), v="w2"),
        ),
        numbers={"m": 1.0, "k": 2.0},
        signals={"r": "0.1 * sin(t)"},
        flow={"i": "r - i"},
        sampled=(SAMPLED,),
    )


def _session(t_end: float = 2.0, period: float | None = None) -> Session:
    return Session(pushed(period), t_end)


@pytest.mark.parametrize(
    ("system", "options"),
    [
        (pushed(), {}),
        (pushed(0.1), {"engine": "ifelse"}),
        (CASES["servo"]().system, {"engine": "ifelse", "rtol": 1e-4}),
    ],
)
def test_a_walk_has_the_bits_of_a_run(system: System, options: dict[str, Any]) -> None:
    session = Session(system, 1.0, **options)
    session.goto(0.7)
    session.back(5)
    session.next_transition()
    session.branch.complete()
    same_bits(session.branch.trace(), simulate(system, 1.0, **options))


def test_a_row_has_bodies_contacts_and_values() -> None:
    session = _session()
    here, trace = session.goto(1.01), simulate(pushed(), 2.0)
    row = here.row
    for name in ("one", "two"):
        body = trace.body(name)
        assert (here.body(name).x, here.body(name).v) == (body.x[row], body.v[row])
    for name in ("pad", "bank"):
        contact = trace.contact(name)
        assert contact.F[row] == here.contact(name).F
        assert here.contact(name).states == tuple(contact.states[row])
    assert here.values == {name: trace.value(name)[row] for name in ("i", "u", "count")}
    with pytest.raises(SessionError, match=r"contacts 'pad', 'bank'; say which one: .*'pad'"):
        _ = here.F
    with pytest.raises(SessionError, match="no contact 'gear'; there are 'pad', 'bank'"):
        here.contact("gear")


def test_a_firing_names_its_contact() -> None:
    session = _session()
    here = session.next_transition()
    assert here.fired is not None
    assert (here.fired.contact, here.fired.element) == ("pad", 0)
    assert str(here).splitlines()[1] == "  pad 1: stuck -> forward by release_forward"


def test_why_of_a_locked_element_shows_the_force_that_holds_it() -> None:
    system, values = CASES["pulled_mass"]().system, {"K": 2.0, "V": 0.1}
    session = Session(system, 10.0)
    t = session.goto(5.0).t
    forward = session.why("pad 1")[0]
    assert forward.clauses[0].left == pytest.approx(values["K"] * values["V"] * t, rel=1e-12)
    assert forward.clauses[0].right == DRY["F_s"]
    assert str(session.why()).startswith("pad 1 is in stuck at t = ")
    assert session.why() == session.why("pad") == session.why("pad 1")


def _timed() -> Session:
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
    return Session(System("timed", bodies=(body,), contacts=(Contact("c", chart, {"T": 0.25}),)), 3)


def test_why_shows_the_time_in_the_state() -> None:
    session = _timed()
    session.goto(0.1)
    (brake,) = session.why("c")
    age = brake.clauses[0]
    assert (age.text, age.left) == ("after(T)", pytest.approx(session.here.t))


def test_a_poke_keeps_the_time_in_the_state_unless_it_changes_the_state() -> None:
    session = _timed()
    t = session.goto(0.2).t
    session.poke({"mass.v": 1.0})
    assert session.next_transition().t == pytest.approx(0.25)
    session.switch(0)
    session.poke(state={"c": "braked"})
    assert session.next_transition().t == pytest.approx(t + 0.5)


def test_a_poke_changes_what_it_names_and_no_tick() -> None:
    session = _session()
    before = session.goto(1.02)
    session.poke(
        {"one.x": 0.1, "u": 0.3, "bank.z": {1: 0.2}, "bank.z4": 0.1}, state={"bank 3": "slip"}
    )
    here = session.here
    assert (here.body("one").x, here.values["u"]) == (0.1, 0.3)
    assert here.contact("bank").z == (
        *before.contact("bank").z[:1],
        0.2,
        before.contact("bank").z[2],
        0.1,
    )
    assert here.contact("bank").states[2] == "slip"
    assert here.body("two") == before.body("two")
    assert str(session.branch.edits) == (
        "q1 = 0.1, u = 0.3, bank.z2 = 0.2, bank.z4 = 0.1, state of bank 3 = slip"
    )
    assert session.reaches("count > 21.5")
    assert (session.here.t, session.here.located) == (pytest.approx(1.05, abs=1e-12), False)
    assert session.here.values["count"] == 22.0


def test_at_its_tick_a_sampler_does_not_tick_again() -> None:
    session = _session()
    session.reaches("count > 10.5")
    count, t = session.here.values["count"], session.here.t
    session.poke({"two.x": 0.0})
    session.goto(t + 0.01)
    assert session.here.values["count"] == count


def test_a_contact_with_a_period_says_when_it_is_asked() -> None:
    session = _session(period=0.1)
    session.goto(0.05)
    why = session.why("pad")
    assert why.tick == 0.1
    assert "evaluated at ticks only, the next time at t = 0.1 s" in str(why)
    session.break_on("tested", "arrest_forward", "pad")
    here, _ = session.proceed()
    assert (here.t, session.why("pad").tick) == (0.1, None)


@pytest.mark.parametrize(
    ("poked", "said"),
    [
        ({"variables": {"m": 2.0}}, "m is a number; to change it, make another system"),
        ({"variables": {"r": 2.0}}, "r is a signal"),
        ({"variables": {"pad.F_c": 2.0}}, "pad.F_c is a parameter"),
        ({"variables": {"load.x": 2.0}}, "'load.x' cannot be poked; there are q1, w1"),
        ({"variables": {"bank.z": 1.0}}, "give 4 values, or some by element"),
        ({"variables": {"bank.z": {4: 1.0}}}, "bank.z of no element 4; there are 0 to 3"),
        ({"v": 1.0}, "'v' cannot be poked"),
        ({"state": {0: "stuck"}}, "element 0 names no contact; write, for example, 'pad 1'"),
        ({"state": {"bank": "slip"}}, "contact 'bank' has 4 elements; write 'bank 1' to 'bank 4'"),
        (
            {"variables": {"w1": 0.1}},
            "'pad' starts in state 'stuck', which holds v at 0, with v = ",
        ),
    ],
)
def test_what_cannot_be_poked(poked: dict[str, Any], said: str) -> None:
    session = _session()
    with pytest.raises((SessionError, ParameterError), match=said):
        session.poke(**poked)
    assert len(session.branches) == 1


def test_conditions_use_the_names_of_the_system_and_of_its_contacts() -> None:
    session = _session()
    assert session.reaches("pad.state == forward and bank.state(2) == stick and w1 > 0.05")
    here = session.here
    assert here.body("one").v == pytest.approx(0.05)
    assert (
        session.watch("pad.F + bank.F1")
        == here.contact("pad").F + here.contact("bank").F_elements[0]
    )
    assert session.watch("r") == 0.1 * np.sin(here.t)
    for text, said in (
        ("F > 1", "unknown name 'F'; write pad.F"),
        ("bank.z > 1", "unknown name 'bank.z'; for element 1 write bank.z1"),
        ("state(1) == stuck", r"state needs its owner; allowed: for example pad.state\(1\)"),
        ("bank.state == slip", r"bank.state needs a number"),
    ):
        with pytest.raises(ExpressionError, match=said):
            session.parse(text)


def test_breakpoints_of_one_contact_and_of_all() -> None:
    session = _session(6.0)
    session.break_on("enter", "slip", "bank 2")
    session.break_on("fires", "arrest_forward", "pad")
    log = simulate(pushed(), 6.0).transitions
    wanted = [
        each.t
        for each in log
        if (each.contact, each.element, each.target) == ("bank", 1, "slip")
        or (each.contact, each.edge) == ("pad", "arrest_forward")
    ]
    found = []
    while (stop := session.proceed())[1] is not None:
        found.append(stop[0].t)
    assert found == wanted
    assert wanted
    with pytest.raises(SessionError, match="no edge 'arrest'; there are release_forward"):
        session.break_on("fires", "arrest", "pad")
    with pytest.raises(SessionError, match="no element 'gear 1'; write, for example, 'pad 1'"):
        session.break_on("fires", "arrest", "gear 1")


def test_a_session_of_a_system_comes_back_from_its_file(tmp_path: Path) -> None:
    session = _session(0.6, period=0.1)
    session.goto(0.22)
    session.poke({"one.x": 0.1, "bank.z": {1: 0.2}}, state={"bank 3": "slip"})
    session.goto(0.33)
    session.break_on("fires", "arrest", "bank 2", "pad.F > 0")
    session.watches.append("pad.F")
    loaded = Session.load(session.save(tmp_path / "walk.json"))
    assert (loaded.here, loaded.breakpoints) == (session.here, session.breakpoints)
    assert [str(branch.edits) for branch in loaded.branches] == [
        str(branch.edits) for branch in session.branches
    ]
    assert str(loaded.compare()) == str(session.compare())
    again = loaded.save(tmp_path / "again.json")
    assert again.read_text() == (tmp_path / "walk.json").read_text()


@pytest.mark.slow
def test_a_comparison_names_bodies_and_contacts() -> None:
    session = _session(0.6)
    session.goto(0.3)
    session.poke({"one.x": 0.1})
    found = session.compare()
    assert list(found.differences) == ["q1", "q2", "pad.F", "bank.z", "bank.F"]
    first, second = (branch.trace().sample([0.5]) for branch in session.branches)
    assert found.differences["q1"] >= abs(first.body("one").x - second.body("one").x)[0] > 0


def test_without_variables_a_comparison_shows_the_force() -> None:
    session = Session(CASES["pulled_mass"]().system, 12.0)
    session.goto(8.0)
    session.poke({"v": 0.3})
    assert list(session.compare().differences) == ["x", "pad.F"]


def test_a_system_has_no_rig() -> None:
    with pytest.raises(ParameterError, match=r"a system has no rig.*Session\(system, t_end\)"):
        Session(pushed(), None, 2.0)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match=r"Session\(model, rig, t_end\), or Session"):
        Session(stick_slip("signed"), 2.0)
