"""Every branch is bit for bit the run from there: a poke, other numbers, another law.

A poke changes only what it names, in a new branch that leaves its parent unchanged.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Body, Contact, Prescribed, Sampled, Session, SessionError, System, simulate
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts import CHARTS
from gms_fsm.errors import OutputError
from gms_fsm.session.tree.branches import Tree
from gms_fsm.session.tree.poking import Edits
from gms_fsm.systems.models import with_values
from gms_fsm.systems.rigs import with_numbers
from gms_fsm.traces.views import steps_of
from tests.helpers import FASTEST, FIG4_SINE, pulled_mass, same_bits, stick_slip
from tests.inspection.sessions import a_system, fig4, locked, pulled

FIG4 = Prescribed(FIG4_SINE)
PUBLISHED = stick_slip("published")
PAD = {"F_c": 1.0, "F_s": 1.5, "b": 0.1}


def tree_of(*what: Any, **options: Any) -> Tree:
    return Session(*what, **{"engine": FASTEST, **options}).tree


def fig4_tree() -> Tree:
    return tree_of(PUBLISHED, FIG4, 40.0)


def pushed(**more: object) -> System:
    return System(
        "pushed",
        bodies=(Body("mass", inertia="m", force="u", x="x_m", v="v_m"),),
        contacts=(Contact("pad", CHARTS["stiction"], PAD, v="v_m"),),
        numbers={"m": 1.0},
        **{"signals": {"u": "2 * sin(t)"}, **more},  # type: ignore[arg-type]
    )


# --------------------------------------------------------------------------- pokes of a walk
def test_a_poke_changes_what_it_names() -> None:
    session = pulled()
    before = session.goto(10.0)
    assert session.poke({"z": {1: -0.003}}, v=-0.2, state={2: "slip"}) == 1
    here = session.here
    assert (here.t, here.x, here.v) == (before.t, before.x, -0.2)
    assert here.z == (before.z[0], -0.003, *before.z[2:])
    assert here.states == (*before.states[:2], "slip", before.states[3])
    assert session.branch.edits == Edits({"z": {1: -0.003}}, -0.2, {2: "slip"})
    assert (here.row, session.branch.parent, session.branch.fork) == (before.row + 1, 0, before.row)
    assert session.back() == before


@pytest.mark.matrix
@pytest.mark.slow
def test_branches_of_branches_have_the_pasts_of_all() -> None:
    session = fig4()
    for t, element in ((30.0, 0), (60.0, 1), (20.0, 2)):  # the last in the past of all
        session.goto(t)
        session.poke({"z": {element: 0.1}})
    session.goto(100.0)
    with pytest.raises(SessionError, match="the end of the run"):
        session.poke({"z": {0: 0.1}})
    assert [branch.parent for branch in session.branches] == [None, 0, 1, 2]
    first, *_, last = session.branches
    assert all(last.raw(row) == first.raw(row) for row in range(last.fork + 1))
    for branch in session.branches:
        rows = branch.firing_rows(len(branch))
        assert [branch.raw(row)[0] for row in rows] == [record[0] for record in branch.log()]
        assert all(branch.raw(row)[1] > 0 for row in rows)


def test_between_rows_the_past_ends_where_it_was_poked() -> None:
    session = Session(stick_slip("published"), Prescribed(FIG4_SINE), 100.0, rtol=1e-8)
    place = session.until("z1 > 0.123")
    assert place.located
    session.poke({"z": {0: 0.0}})
    assert (session.here.t, session.here.z) == (place.t, (0.0, *place.z[1:]))
    session.step()
    first, second = (branch.trace() for branch in session.branches)
    times = [place.t - d for d in (0.3, 0.1, 0.01)]
    assert first.sample(times).z[:, 0] == pytest.approx(second.sample(times).z[:, 0], abs=1e-6)
    session.back()
    before = session.back()
    # z1 was 0.123 just before the poke: nothing leads from the last row to 0 but the poke.
    assert (before.t, before.z) == (place.t, place.z)
    session.goto(place.t - 0.5)
    assert session.until("z1 < 0.05").t >= place.t  # no value that never was


def test_every_firing_after_a_poke_amid_a_cascade_has_the_row_that_it_made() -> None:
    session = Session(stick_slip("signed"), FIG4, 10.0)
    session.next_transition()
    session.next_transition()  # two of four break-aways at one time
    session.poke({"z": {3: 0.1}})  # the fourth element will not break away there
    session.goto(10.0)
    trace = session.branch.trace()
    assert (np.diff(trace.t) >= 0).all()
    rows: dict[tuple[float, int], int] = {}
    for row, key in enumerate(zip(trace.t, trace.microstep, strict=True)):
        rows.setdefault(key, row)  # the poked row has the number of the row that was poked
    assert len(trace.transitions) > 3
    for record, step in zip(trace.transitions, steps_of(trace), strict=True):
        made = rows[record.t, step]
        assert trace.states[made, record.element] == record.target
        assert trace.states[made - 1, record.element] == record.source


@pytest.mark.slow
def test_branches_are_compared_at_their_ends() -> None:
    session = fig4(60.0)
    session.goto(25.0)
    session.poke({"z": {0: -1.4}})
    same, found, back = (session.compare(*pair) for pair in ((0, 0), (0, 1), (1, 0)))
    assert (same.z, same.F, same.first_difference) == (0.0, 0.0, None)
    assert (found.branches, found.t) == ((0, 1), 60.0)
    assert "until t = 60 s" in str(found)
    logs = [branch.trace().transitions for branch in session.branches]
    assert found.transitions == tuple(map(len, logs))
    first = next(
        (a.t, b.t) for a, b in zip(*logs, strict=False) if a.tolist()[:3] != b.tolist()[:3]
    )
    assert found.first_difference == min(first)
    assert found.z > 0.8
    assert (back.z, back.F, back.first_difference) == (found.z, found.F, found.first_difference)


# --------------------------------------------------------------------------- systems
def test_a_poke_of_a_system_changes_what_it_names_and_no_tick() -> None:
    session = a_system()
    before = session.goto(1.02)
    z = before.contact("bank").z
    edits = {"one.x": 0.1, "u": 0.3, "bank.z": {1: 0.2}, "bank.z4": 0.1}
    session.poke(edits, state={"bank 3": "slip"})
    here = session.here
    assert (here.body("one").x, here.values["u"]) == (0.1, 0.3)
    assert here.contact("bank").z == (z[0], 0.2, z[2], 0.1)
    assert here.contact("bank").states[2] == "slip"
    assert here.body("two") == before.body("two")
    assert str(session.branch.edits) == (
        "q1 = 0.1, u = 0.3, bank.z2 = 0.2, bank.z4 = 0.1, state of bank 3 = slip"
    )
    assert session.reaches("count > 21.5")
    assert (session.here.t, session.here.located) == (pytest.approx(1.05, abs=1e-12), False)
    assert (count := session.here.values["count"]) == 22.0
    session.poke({"two.x": 0.0})  # at its tick a sampler does not tick again
    session.goto(session.here.t + 0.01)
    assert session.here.values["count"] == count


@pytest.mark.slow
def test_a_comparison_names_bodies_and_contacts() -> None:
    session = a_system(0.6)
    session.goto(0.3)
    session.poke({"one.x": 0.1})
    found = session.compare()
    assert list(found.differences) == ["q1", "q2", "pad.F", "bank.z", "bank.F"]
    first, second = (branch.trace().sample([0.5]) for branch in session.branches)
    assert found.differences["q1"] >= abs(first.body("one").x - second.body("one").x)[0] > 0
    session = locked()
    session.goto(8.0)
    session.poke({"v": 0.3})
    assert list(session.compare().differences) == ["x", "pad.F"]  # it has no variables


@pytest.mark.slow
def test_ticks_stay_where_they_are() -> None:
    sampled = (Sampled("ramp", period=0.3, updates={"u": "u + 0.3"}),)
    session = Session(pushed(signals={}, sampled=sampled), 4.0)
    session.until("t > 2")
    session.poke({"mass.x": 0.5})
    session.branch.complete()
    tree = tree_of(pushed(signals={}, sampled=sampled), 4.0)
    tree.poke({"mass.x": 0.5}, t=session.branches[1].raw(session.branches[1].fork + 1).t)
    same_bits(tree.trace(), session.branch.trace())


def test_numbers_and_pokes_of_a_system() -> None:
    tree = tree_of(pushed(), 4.0)
    tree.set({"numbers.m": 2.0, "pad.F_s": 1.9})
    pad = Contact("pad", CHARTS["stiction"], {**PAD, "F_s": 1.9}, v="v_m")
    expected = simulate(replace(pushed(), numbers={"m": 2.0}, contacts=(pad,)), 4.0)
    same_bits(tree.trace(), expected)
    tree.poke({"mass.x": 0.1}, t=3.0)
    trace = tree.trace()
    before, after = trace.body("mass").x[trace.t == 3.0]
    assert after == 0.1
    moved = trace.body("mass").x[-1] - expected.body("mass").x[-1]  # nothing depends on x
    assert moved == pytest.approx(after - before, rel=1e-4)


# --------------------------------------------------------------------------- forks
@pytest.mark.slow
def test_numbers_of_model_rig_and_element_and_the_law() -> None:
    model, rig = pulled_mass()
    tree = tree_of(model, rig, 20.0)
    assert "k" not in tree.numbers()  # the elements differ
    tree.set({"F_s": 1.8, "stiffness": 3.0, "k2": 33.0})
    other = with_values(model, {"F_s": 1.8, "k": [40, 33, 20, 10]})
    same_bits(tree.trace(), simulate(other, with_numbers(rig, {"stiffness": 3.0}), 20.0))
    session = Session(PUBLISHED, FIG4, 30.0)
    session.fork(values={"F_s": 1.7}, law="signed")
    assert (session.here.row, session.tree.forks[1].text) == (0, "signed law, F_s = 1.7")
    session.goto(30.0)
    expected = simulate(with_values(stick_slip("signed"), {"F_s": 1.7}), FIG4, 30.0)
    same_bits(session.branch.trace(), expected)
    same_bits(session.tree.trace(0), simulate(PUBLISHED, FIG4, 30.0))


def test_the_later_change_holds() -> None:
    tree = fig4_tree()
    for values in ({"k": 0.8}, {f"k{i}": 0.9 for i in range(1, 5)}, {"k": 0.7}):
        tree.set(values)
        (wanted,) = set(values.values())
        assert tree.trace().model.values["k"].tolist() == [wanted] * 4
    assert tree.fork(values={"k": 1.0}) == 1
    tree.set({"k3": 0.9})
    assert tree.trace().model.values["k"].tolist() == [1.0, 1.0, 0.9, 1.0]
    assert tree.trace(0).model.values["k"].tolist() == [0.7] * 4


@pytest.mark.parametrize("steps", [30, 75, 77])  # also amid the micro-steps of a cascade
def test_a_poke_at_a_row_is_that_of_a_walk(steps: int) -> None:
    session = fig4(40.0)
    here = session.step(steps)
    session.poke({"z": {0: -0.4}}, state={1: "slip"})
    session.branch.complete()
    tree = fig4_tree()
    tree.poke({"z": {0: -0.4}}, state={1: "slip"}, t=here.t, microstep=here.microstep)
    same_bits(tree.trace(), session.branch.trace())
    assert tree.compare(0, 1) == session.compare()


def test_branches_follow_their_parents() -> None:
    tree = fig4_tree()
    first = tree.poke({"z": {0: -1.4}}, t=25.0)
    second = tree.poke({"z": {1: 0.0}}, t=30.0)
    tree.set({"F_s": 1.7}, 0)
    assert [tree.numbers(each)["F_s"].value for each in (first, second)] == [1.7, 1.7]
    alone = tree_of(with_values(PUBLISHED, {"F_s": 1.7}), FIG4, 40.0)
    alone.poke({"z": {0: -1.4}}, t=25.0)
    alone.poke({"z": {1: 0.0}}, t=30.0)
    same_bits(tree.trace(second), alone.trace(2))
    # A poke before that of the parent takes its place.
    tree.current = first
    early = tree.poke({"z": {1: 0.0}}, t=10.0)
    tree.current = 0
    other = tree.poke({"z": {1: 0.0}}, t=10.0)
    same_bits(tree.trace(early), tree.trace(other))
    assert tree.beginning(first) == 25.0
    tree.set({"F_s": 1.8}, first)
    assert tree.beginning(first) == 0.0
    assert tree.forks[first].text == "F_s = 1.8, z1 = -1.4 at 25 s"
    alone = tree_of(with_values(PUBLISHED, {"F_s": 1.8}), FIG4, 40.0)
    alone.poke({"z": {0: -1.4}}, t=25.0)
    same_bits(tree.trace(first), alone.trace())


def test_a_failed_run_is_kept() -> None:
    tree = tree_of(PUBLISHED, FIG4, 40.0, max_steps=60)
    assert "60" in str(tree.failure())
    assert 0 < tree.trace().t[-1] < 40.0


@pytest.mark.parametrize("branch", [0, 1])
def test_an_exported_branch_runs_the_same(branch: int, tmp_path: Path) -> None:
    model, rig = pulled_mass()
    tree = tree_of(model, rig, 20.0, rtol=1e-8)
    tree.set({"F_s": 1.6})
    tree.poke({"z": {0: 0.0}}, v=0.01, t=9.0)
    loaded = load_scenario(tree.save_scenario(tmp_path / "branch.toml", branch))
    again, here = loaded.simulate(), tree.trace(branch)
    assert loaded.title == tree.forks[branch].name
    begin = 9.0 if branch else 0.0
    assert again.t[0] == begin
    part = again.t > begin
    np.testing.assert_array_equal(again.t[part], here.t[here.t > begin])
    np.testing.assert_array_equal(again.z[part], here.z[here.t > begin])
    drawn = tree_of(PUBLISHED, Prescribed(lambda t: 0.1 * t), 3.0, engine="ifelse")
    with pytest.raises(OutputError, match="Python function"):
        drawn.save_scenario(tmp_path / "one.toml")


def test_names_and_deleting() -> None:
    tree = fig4_tree()
    before = tree.trace()
    tree.poke({"z": {0: -1.4}}, t=25.0)
    tree.fork(values={"F_s": 1.7})
    tree.rename(1, " poked ")
    assert [each.name for each in tree.forks.values()] == ["original", "poked", "F_s = 1.7"]
    with pytest.raises(SessionError, match="delete 2 first"):
        tree.delete(1)
    tree.delete(2)
    assert tree.current == 1
    tree.delete(1)
    assert (list(tree.forks), tree.current) == ([0], 0)
    assert tree.trace() is before
    assert tree.fork() == 3  # numbers are not used again


def test_in_a_system_values_of_all_elements_are_a_list_and_that_of_the_only_one_a_number() -> None:
    belts = [Body(name, velocity="0.1", x=f"x_{name}", v=f"v_{name}") for name in ("one", "two")]
    spring = Contact("spring", CHARTS["maxwell-slip"], {"k": 10.0, "F_c": 1.0}, v="v_one")
    system = System("belts", bodies=belts, contacts=(spring, Contact("bank", PUBLISHED, v="v_two")))
    session = Session(system, 1.0)
    session.poke({"spring.z": 0.05, "bank.z": [0.1, 0.2, 0.3, 0.4]})
    assert session.here.contact("spring").z == (0.05,)
    assert session.here.contact("bank").z == (0.1, 0.2, 0.3, 0.4)


def test_a_file_of_a_branch_keeps_method_and_events(tmp_path: Path) -> None:
    tree = tree_of(PUBLISHED, Prescribed("0.1"), 1.0, method="rk4", step=0.01, events="step")
    loaded = load_scenario(tree.save_scenario(tmp_path / "one.toml"))
    given = {name: loaded.arguments[name] for name in ("method", "step", "events")}
    assert given == {"method": "rk4", "step": 0.01, "events": "step"}
