"""The coverage of a session is that of all its branches, also at the debugger's prompt."""

from __future__ import annotations

import io

from gms_fsm import Coverage, Prescribed, Session, coverage
from gms_fsm.debugger import Debugger
from tests.helpers import FIG4_SINE, stick_slip


def session() -> Session:
    found = Session(stick_slip("signed"), Prescribed(FIG4_SINE), 30.0)
    found.goto(6.0)
    found.poke({"z": {0: -0.2}})
    found.fork(values={"F_s": 1.7})
    return found


def test_all_branches_count_from_the_start() -> None:
    given = session()
    each = [coverage(given.tree.trace(branch)) for branch in given.tree.forks]
    assert len(each) == 3
    assert coverage(given) == Coverage.merged(each)
    assert coverage(given).runs == 3


def test_a_state_that_an_element_was_put_into_counts_as_seen() -> None:
    slow = Session(stick_slip("signed"), Prescribed("0.01"), 1.0)
    slow.poke(state={0: "slip"}, t=0.5)
    slip = coverage(slow).contact().states[1]
    assert (slip.entries, slip.seen) == ((0,) * 4, (True, False, False, False))


def test_the_debugger_shows_it() -> None:
    out = io.StringIO()
    Debugger(session(), "a session", io.StringIO("coverage\nquit\n"), out).run()
    assert str(coverage(session())) in out.getvalue()
