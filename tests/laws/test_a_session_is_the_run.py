"""A session that walks to the end has made the run of `simulate`, and shows its rows on the way."""

from __future__ import annotations

from random import Random

from gms_fsm import Session, Trace
from tests.corpus import FAILING, FEW, each, outcome, run
from tests.helpers import other_parts


def whole_of(name: str) -> Trace | None:
    """Return all rows of a run."""
    return outcome(name)[0] if "t_eval" not in run(name).how else run(name).outcome(t_eval=None)[0]


def session_of(name: str, **more: object) -> Session:
    how = {key: u for key, u in run(name).how.items() if key != "t_eval"}
    return Session(*run(name).subject, run(name).t_end, **{**how, **more})


@each(FEW)
def test_to_the_end(name: str) -> None:
    session = session_of(name)
    session.goto(run(name).t_end)
    assert session.branch.ended
    assert other_parts(session.branch.trace(), whole_of(name)) == []


@each(FAILING)
def test_a_failure_is_an_outcome(name: str) -> None:
    session = session_of(name)
    session.goto(run(name).t_end)
    _, said = outcome(name)
    assert not session.branch.ended
    assert str(session.branch.failure) == said.partition(": ")[2]
    assert other_parts(session.branch.trace(), whole_of(name)) == []


@each(FEW)
def test_wherever_it_goes_it_shows_the_rows_of_the_run(name: str) -> None:
    """Steps, backward too, to transitions and to times, at random; repeat with the same name."""
    session, dice, whole = session_of(name, engine="ifelse"), Random(name), whole_of(name)
    assert whole is not None
    start, t_end = whole.t[0], run(name).t_end
    moves = {
        "step": lambda: session.step(dice.randint(1, 40)),
        "back": lambda: session.back(dice.randint(1, 40)),
        "next": session.next_transition,
        "previous": session.prev_transition,
        "goto": lambda: session.goto(dice.uniform(start, t_end)),
    }
    for move in dice.choices([*moves], k=25):
        moves[move]()
        here = session.branch
        row = here.raw(here.cursor)
        assert [row[0], list(row[2])] == [whole.t[here.cursor], whole.rows.y[here.cursor].tolist()]
