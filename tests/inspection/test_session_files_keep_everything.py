"""A session comes back from its file with its branches, cursors, breakpoints and watches."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from gms_fsm import Body, Contact, Prescribed, Session, Slider, System
from gms_fsm.debugger import Debugger
from tests.helpers import FASTEST, FIG4_SINE, same_bits, stick_slip
from tests.inspection.sessions import a_system, fig4, pulled, warming


def walked() -> Session:
    """Pokes at rows and between them."""
    session = pulled(12.0)
    session.goto(5.0)
    session.poke({"z": {1: -0.003}}, v=0.05, state={2: "slip"})
    session.goto(8.0)
    session.until("t > 8.7")
    session.poke({"z": {0: 0.001}})
    session.until("t > 9.3")
    session.switch(1)
    session.break_on("fires", "arrest", 1, "z1 > 0", 2)
    session.break_on("leave", "slip")
    session.break_on("changes", "sgn(v)", condition="z1 > 0")
    session.watches.append("z1 / s1")
    return session


def forked(engine: str = FASTEST) -> Session:
    """Each kind of branch, one of them deleted."""
    session = Session(stick_slip("published"), Prescribed(FIG4_SINE), 30.0, engine=engine)
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
    session.goto(12.0)
    return session


def two_variables() -> Session:
    session = warming(2)
    session.goto(1.0)
    session.poke({"z": {1: 0.01}, "w": {0: 0.3, 1: 0.4}}, state={1: "rising"})
    session.step(5)
    session.watches.append("w2")
    return session


class Cart:
    title, acceleration = "cart", "(2 * F_a - F) / mass"
    numbers = {"mass": 1.0}  # noqa: RUF012
    signals = Slider(1.0, "0.2 * t").signals


def own_rig() -> Session:
    session = Session(stick_slip("signed"), Cart(), 6.0)
    session.goto(5.0)
    return session


def poked_system() -> Session:
    session = a_system(0.6, period=0.1)
    session.goto(0.22)
    session.poke({"one.x": 0.1, "bank.z": {1: 0.2}}, state={"bank 3": "slip"})
    session.goto(0.33)
    session.break_on("fires", "arrest", "bank 2", "pad.F > 0")
    session.watches.append("pad.F")
    return session


def another_law() -> Session:
    mass = Body("mass", inertia="1.0", force="2 * sin(t)")
    contacts = (Contact("pad", stick_slip("published")),)
    session = Session(System("one", bodies=(mass,), contacts=contacts), 3.0)
    session.fork(law="signed")
    session.goto(1.0)
    session.poke({"pad.z": {0: 0.1}})
    return session


@pytest.mark.slow
@pytest.mark.parametrize(
    "made", [walked, forked, two_variables, own_rig, poked_system, another_law]
)
def test_everything_is_restored(made: Callable[[], Session], tmp_path: Path) -> None:
    session = made()
    path = session.save(tmp_path / "walk.json")
    loaded = Session.load(path)
    assert loaded.save(tmp_path / "again.json").read_text() == path.read_text()
    assert (loaded.here, loaded.breakpoints) == (session.here, session.breakpoints)
    assert loaded.watches == session.watches
    texts = [[(each.name, each.text) for each in s.tree.forks.values()] for s in (session, loaded)]
    assert texts[0] == texts[1]
    assert [*loaded.tree.forks] == [*range(len(session.branches))]  # numbered anew
    for a, b in zip(session.branches, loaded.branches, strict=True):
        assert (a.fork, a.cursor, a.edits) == (b.fork, b.cursor, b.edits)
        a.complete()
        b.complete()
        same_bits(a.trace(), b.trace())
    if made is another_law:
        loaded.switch(1)
        loaded.fork(law="published")  # from what was read
        same_bits(loaded.tree.trace(), session.tree.trace(0))


@pytest.mark.slow
def test_whole_branches_are_those_that_are_walked_and_the_debugger_lists_them() -> None:
    session = forked()
    for fast, slow in zip(session.branches, forked("machines").branches, strict=True):
        slow.complete()
        same_bits(fast.whole.trace, slow.trace())
        assert slow.whole.failure is None
    said = Debugger(session).reply("branches")
    assert "from branch 0 at t = 0 s: signed law, k2 = 0.8" in said
    assert "from branch 4 at t = 0 s: F_s = 1.6, z2 = 0" in said
    assert "no branch 3; there are 0, 1, 2, 4, 5, 6" in Debugger(session).reply("branch 3")


def test_the_name_of_the_original_run_is_kept(tmp_path: Path) -> None:
    session = fig4(1.0)
    session.tree.rename(0, "first")
    loaded = Session.load(session.save(tmp_path / "walk.json"))
    assert [each.name for each in loaded.tree.forks.values()] == ["first"]
