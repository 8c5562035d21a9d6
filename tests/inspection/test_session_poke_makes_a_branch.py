"""A poke changes only what it names, in a new branch that leaves its parent unchanged."""

from __future__ import annotations

from typing import Any

import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.errors import ChartError, ParameterError, SessionError
from gms_fsm.session.session import Session
from gms_fsm.session.tree.poking import Edits
from tests.helpers import FIG4_SINE, open_loop, pulled_mass, stick_slip


def _open_loop() -> Session:
    return Session(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)


def _pulled() -> Session:
    model, rig = pulled_mass()
    return Session(model, rig, 20.0)


def test_position_velocity_and_the_other_elements_are_kept() -> None:
    session = _pulled()
    before = session.goto(10.0)
    assert session.poke({"z": {1: -0.003}}) == 1
    here = session.here
    assert (here.t, here.x, here.v, here.states) == (before.t, before.x, before.v, before.states)
    assert here.z == (before.z[0], -0.003, *before.z[2:])
    assert (here.row, session.branch.parent, session.branch.fork) == (before.row + 1, 0, before.row)
    assert session.back() == before


def test_velocity_and_state() -> None:
    session = _pulled()
    before = session.goto(3.0)
    session.poke(v=-0.2, state={2: "slip"})
    here = session.here
    assert (here.v, here.x, here.z) == (-0.2, before.x, before.z)
    assert here.states == ("stick", "stick", "slip", "stick")
    assert session.branch.edits == Edits({}, -0.2, {2: "slip"})


def test_the_branch_is_the_run_from_there() -> None:
    session = _open_loop()
    here = session.goto(30.0)
    session.poke({"z": {0: 0.1}})
    session.goto(100.0)
    initial = {"x": here.x, "z": [0.1, *here.z[1:]], "states": list(here.states)}
    alone = simulate(session.model, session.rig, 100.0, t_start=here.t, initial=initial)
    own = session.branch.trace()
    assert own.z[here.row + 1 :].tolist() == alone.z.tolist()
    assert own.t[here.row + 1 :].tolist() == alone.t.tolist()


def test_the_parent_is_kept_and_can_continue() -> None:
    session = _open_loop()
    session.goto(30.0)
    parent = session.branch
    rows = [parent.raw(row) for row in range(len(parent))]
    session.poke({"z": {0: 0.1}})
    session.goto(100.0)
    assert [parent.raw(row) for row in range(len(parent))] == rows
    assert session.switch(0).row == parent.cursor
    session.goto(100.0)
    whole = simulate(session.model, session.rig, 100.0)
    assert parent.trace().z.tolist() == whole.z.tolist()


def test_a_branch_of_a_branch_has_both_pasts() -> None:
    session = _open_loop()
    session.goto(30.0)
    session.poke({"z": {0: 0.1}})
    session.goto(60.0)
    session.poke({"z": {1: 0.2}})
    session.goto(20.0)  # in the past shared by all
    session.poke({"z": {2: 0.1}})
    session.goto(100.0)
    assert [branch.parent for branch in session.branches] == [None, 0, 1, 2]
    last = session.branches[-1]
    first = session.branches[0]
    assert all(last.raw(row) == first.raw(row) for row in range(last.fork + 1))
    for branch in session.branches:
        rows = branch.firing_rows(len(branch))
        assert [branch.raw(row)[0] for row in rows] == [record[0] for record in branch.log()]
        assert all(branch.raw(row)[1] > 0 for row in rows)


def test_between_rows_the_past_ends_where_it_was_poked() -> None:
    session = _open_loop()
    place = session.until("z1 > 0.123")
    assert place.located
    session.poke({"z": {0: 0.0}})
    assert session.here.t == place.t
    assert session.here.z == (0.0, *place.z[1:])
    before = session.back()
    # z1 was 0.123 just before the poke: nothing leads from the last row to 0 but the poke.
    assert (before.t, before.z) == (place.t, place.z)
    assert session.branches[0].between is not None


def test_between_rows_until_sees_no_value_that_never_was() -> None:
    session = _open_loop()
    place = session.until("z1 > 0.123")
    session.poke({"z": {0: 0.0}})
    session.goto(place.t - 0.5)
    assert session.until("z1 < 0.05").z[0] in (0.0, pytest.approx(0.05))
    assert session.here.t >= place.t


def test_between_rows_comparing_shows_a_difference_only_after_the_poke() -> None:
    session = _open_loop()
    place = session.until("z1 > 0.123")
    session.poke({"z": {0: 0.0}})
    session.step()
    first, second = (branch.trace() for branch in session.branches)
    times = [place.t - d for d in (0.3, 0.1, 0.01)]
    assert first.sample(times).z[:, 0] == pytest.approx(second.sample(times).z[:, 0], abs=1e-6)


@pytest.mark.slow
def test_compare() -> None:
    session = _open_loop()
    session.goto(25.0)
    session.poke({"z": {0: -1.4}})
    same = session.compare(0, 0)
    assert (same.z, same.F, same.first_difference) == (0.0, 0.0, None)
    for number in (0, 1):
        session.switch(number)
        session.goto(100.0)
    found = session.compare(0, 1)
    assert found.t == 100.0
    logs = [branch.trace().transitions for branch in session.branches]
    assert found.transitions == tuple(map(len, logs))
    first = next(
        (a.t, b.t) for a, b in zip(*logs, strict=False) if a.tolist()[:3] != b.tolist()[:3]
    )
    assert found.first_difference == min(first)
    assert found.z > 0.8
    back = session.compare(1, 0)
    assert (back.z, back.F, back.first_difference) == (found.z, found.F, found.first_difference)


@pytest.mark.parametrize(
    ("edits", "error", "said"),
    [
        ({}, SessionError, "nothing to poke"),
        ({"variables": {}}, SessionError, "nothing to poke"),
        ({"variables": {"z": {}}, "state": {}}, SessionError, "nothing to poke"),
        ({"variables": {"z": {4: 0.1}}}, SessionError, "no element 4; there are 0 to 3"),
        ({"variables": {"w": {0: 0.1}}}, SessionError, "no variable 'w'; there are z"),
        ({"variables": {0: 0.1}}, SessionError, "no variable 0; there are z"),
        ({"variables": {"z": 0.1}}, SessionError, r"z is 0\.1; give its values by element"),
        ({"state": {-1: "slip"}}, SessionError, "no element -1"),
        ({"variables": {"z": {0: float("nan")}}}, ParameterError, "finite"),
        ({"variables": {"z": {0: float("inf")}}}, ParameterError, "finite"),
        ({"state": {0: "slipp"}}, ChartError, "'stick', 'slip'"),
        ({"v": 0.1}, ParameterError, "prescribes the velocity"),
    ],
)
def test_an_invalid_poke_is_rejected_and_makes_no_branch(
    edits: Any, error: type[Exception], said: str
) -> None:
    session = _open_loop()
    with pytest.raises(error, match=said):
        session.poke(**edits)
    assert (len(session.branches), session.current) == (1, 0)


def test_at_the_end_a_poke_is_rejected() -> None:
    session = _open_loop()
    session.goto(100.0)
    with pytest.raises(SessionError, match="the end of the run"):
        session.poke({"z": {0: 0.1}})


@pytest.mark.parametrize("branch", [-1, 1])
def test_no_such_branch(branch: int) -> None:
    session = _open_loop()
    for ask in (session.switch, lambda n: session.compare(0, n)):
        with pytest.raises(SessionError, match="no branch"):
            ask(branch)


@pytest.mark.parametrize(
    ("poked", "words"),
    [
        ({"variables": "z"}, "variables is 'z'; give a mapping"),
        ({"state": "slip"}, "state is 'slip'; give a mapping"),
        ({"variables": {"F_s": {0: 2.0}}}, "F_s is a parameter; to change it, make another"),
    ],
)
def test_the_message_says_why_something_cannot_be_poked(poked: dict[str, Any], words: str) -> None:
    session = Session(stick_slip("signed"), open_loop(), 5.0)
    with pytest.raises(SessionError) as caught:
        session.poke(**poked)
    assert words in str(caught.value)


def test_both_are_computed_to_their_ends_before_they_are_compared() -> None:
    session = Session(stick_slip("signed"), open_loop(), 30.0)
    session.goto(6.0)
    session.poke({"z": {0: -0.2}})
    found = session.compare()
    assert (found.branches, found.t) == ((0, 1), 30.0)
    assert "until t = 30 s" in str(found)
    with pytest.raises(SessionError, match="branch 0 has no parent"):
        session.compare(b=0)
