"""A session that walks to the end has made the run of `simulate`, and shows its rows on the way."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

from gms_fsm import Session, Trace
from tests.corpus import FAILING, FEW, each, outcome, run
from tests.helpers import other_parts


def whole_of(name: str) -> Trace | None:
    """Return all rows of a run."""
    return outcome(name)[0] if "t_eval" not in run(name).how else run(name).outcome(t_eval=None)[0]


def session_of(name: str, **more: object) -> Session:
    how = {key: u for key, u in run(name).how.items() if key != "t_eval"}
    return Session(*run(name).subject, run(name).t_end, **{**how, **more})


@pytest.mark.every(2)
@each(FEW)
def test_to_the_end(name: str) -> None:
    session = session_of(name)
    session.goto(run(name).t_end)
    assert session.branch.ended
    assert other_parts(session.branch.trace(), whole_of(name)) == []


@pytest.mark.every(3)
@each(FAILING)
def test_a_failure_is_an_outcome(name: str) -> None:
    session = session_of(name)
    session.goto(run(name).t_end)
    _, said = outcome(name)
    assert not session.branch.ended
    assert str(session.branch.failure) == said.partition(": ")[2]
    assert other_parts(session.branch.trace(), whole_of(name)) == []


@pytest.mark.every(2)
@each(FEW)
def test_wherever_it_goes_it_shows_the_rows_of_the_run(name: str) -> None:
    """Steps, backward too, to transitions and to times, at random; repeat with the same name."""
    session, dice, whole = session_of(name, engine="ifelse"), Random(name), whole_of(name)
    assert whole is not None
    start, t_end, last = whole.t[0], run(name).t_end, len(whole) - 1
    fired, row = [0, *np.flatnonzero(whole.microstep), last], 0
    for move in dice.choices(["step", "back", "next", "previous", "goto"], k=25):
        far, t = dice.randint(1, 40), dice.uniform(start, t_end)
        match move:
            case "step":
                session.step(far)
                row = min(row + far, last)
            case "back":
                session.back(far)
                row = max(row - far, 0)
            case "next":
                session.next_transition()
                row = next((each for each in fired if each > row), last)
            case "previous":
                session.prev_transition()
                row = max((each for each in fired[:-1] if each < row), default=0)
            case "goto":
                session.goto(t)
                row = int(np.searchsorted(whole.t, t, side="right")) - 1
        here = session.branch
        assert here.cursor == row, move
        found = here.raw(row)
        assert [found[0], list(found[2])] == [whole.t[row], whole.rows.y[row].tolist()]
