"""A fork is walked like any branch, by every engine, and a session file keeps all branches."""

from __future__ import annotations

from pathlib import Path

import pytest

from gms_fsm import Body, Contact, Prescribed, Session, System, simulate
from gms_fsm.debugger import Debugger
from gms_fsm.systems.models import with_values
from tests.helpers import FASTEST, FIG4_SINE, same_bits, stick_slip

FIG4 = Prescribed(FIG4_SINE)


def forked(**options: str) -> Session:
    """Return a session with each kind of branch, one of them deleted."""
    session = Session(stick_slip("published"), FIG4, 30.0, **options)  # type: ignore[arg-type]
    session.goto(10.0)
    session.poke({"z": {0: 0.1}}, name="pushed")
    session.fork(values={"F_s": 1.7})
    session.switch(0)
    session.fork(law="signed")
    session.tree.delete(3)
    session.fork(law="signed", values={"k2": 0.8})
    session.poke({"z": {1: 0.0}}, t=20.0)
    session.tree.set({"F_s": 1.6})
    session.poke({"z": {2: 0.0}}, t=25.0)
    return session


def test_a_fork_is_walked() -> None:
    session = Session(stick_slip("published"), FIG4, 30.0)
    session.fork(values={"F_s": 1.7}, law="signed")
    assert session.here.row == 0
    assert session.model.title.endswith("signed law")
    session.goto(30.0)
    expected = simulate(with_values(stick_slip("signed"), {"F_s": 1.7}), FIG4, 30.0)
    same_bits(session.branch.trace(), expected)
    assert session.switch(0).row == 0


@pytest.mark.slow
def test_walked_and_whole_branches_are_the_same() -> None:
    for fast, walked in zip(
        forked(engine=FASTEST).branches, forked(engine="machines").branches, strict=True
    ):
        walked.complete()
        same_bits(fast.whole.trace, walked.trace())
        assert walked.whole.failure is None


@pytest.mark.slow
def test_a_file_keeps_them(tmp_path: Path) -> None:
    session = forked(engine=FASTEST)
    session.goto(12.0)
    path = session.save(tmp_path / "a.json")
    loaded = Session.load(path)
    assert loaded.save(tmp_path / "b.json").read_text() == path.read_text()
    assert list(loaded.tree.forks) == [0, 1, 2, 3, 4, 5]  # numbered anew
    texts = [[each.name, each.text] for each in session.tree.forks.values()]
    assert [[each.name, each.text] for each in loaded.tree.forks.values()] == texts
    assert loaded.here == session.here
    for a, b in zip(session.branches, loaded.branches, strict=True):
        assert (a.fork, a.cursor) == (b.fork, b.cursor)
        same_bits(a.whole.trace, b.whole.trace)


def test_a_file_keeps_forks_of_a_system_with_another_law(tmp_path: Path) -> None:
    mass = Body("mass", inertia="1.0", force="2 * sin(t)")
    session = Session(
        System("one", bodies=(mass,), contacts=(Contact("pad", stick_slip("published")),)), 3.0
    )
    session.fork(law="signed")
    session.goto(1.0)
    session.poke({"pad.z": {0: 0.1}})
    path = session.save(tmp_path / "a.json")
    loaded = Session.load(path)
    for a, b in zip(session.branches, loaded.branches, strict=True):
        same_bits(a.whole.trace, b.whole.trace)
    assert loaded.system.contact("pad").title == session.system.contact("pad").title
    assert loaded.save(tmp_path / "b.json").read_text() == path.read_text()
    loaded.switch(1)
    loaded.fork(law="published")  # from what was read
    same_bits(loaded.tree.trace(), session.tree.trace(0))


def test_the_debugger_shows_them() -> None:
    said = Debugger(forked(engine=FASTEST)).reply("branches")
    assert "from branch 0 at t = 0 s: signed law, k2 = 0.8" in said
    assert "from branch 4 at t = 0 s: F_s = 1.6, z2 = 0" in said
    assert "no branch 3; there are 0, 1, 2, 4, 5, 6" in Debugger(forked()).reply("branch 3")
