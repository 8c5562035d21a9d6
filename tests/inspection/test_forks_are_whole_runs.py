"""Every branch of a tree of runs is bit for bit the run that `simulate` or a session would make."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Body,
    Contact,
    ParameterError,
    Prescribed,
    Sampled,
    Session,
    SessionError,
    System,
    Trace,
    simulate,
)
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts import CHARTS
from gms_fsm.errors import OutputError
from gms_fsm.session.tree.branches import Tree
from gms_fsm.systems.models import with_values
from gms_fsm.systems.rigs import with_numbers
from tests.helpers import FASTEST, FIG4_SINE, pulled_mass, stick_slip

FIG4 = Prescribed(FIG4_SINE)
PAD = {"F_c": 1.0, "F_s": 1.5, "b": 0.1}


def tree_of(*what: Any, **options: Any) -> Tree:
    return Session(*what, **{"engine": FASTEST, **options}).tree


def fig4() -> Tree:
    return tree_of(stick_slip("published"), FIG4, 40.0)


def pushed(**more: object) -> System:
    return System(
        "pushed",
        bodies=(Body("mass", inertia="m", force="u", x="x_m", v="v_m"),),
        contacts=(Contact("pad", CHARTS["stiction"], PAD, v="v_m"),),
        numbers={"m": 1.0},
        **{"signals": {"u": "2 * sin(t)"}, **more},  # type: ignore[arg-type]
    )


def assert_same(a: Trace, b: Trace) -> None:
    for name in ("t", "x", "v", "F", "z", "modes"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    for name in ("t", "element", "edge", "F_after"):
        np.testing.assert_array_equal(a.transitions[name], b.transitions[name], err_msg=name)


def test_numbers_of_model_and_rig() -> None:
    model, rig = pulled_mass()
    tree = tree_of(model, rig, 20.0)
    tree.set({"F_s": 1.8, "stiffness": 3.0})
    expected = simulate(
        with_values(model, {"F_s": 1.8}), with_numbers(rig, {"stiffness": 3.0}), 20.0
    )
    assert_same(tree.trace(), expected)


def test_number_of_one_element() -> None:
    model, rig = pulled_mass()
    tree = tree_of(model, rig, 20.0)
    assert "k" not in tree.numbers()  # the elements differ
    tree.set({"k2": 33.0})
    assert_same(tree.trace(), simulate(with_values(model, {"k": [40, 33, 20, 10]}), rig, 20.0))
    tree = fig4()
    tree.set({"k": 0.8})
    tree.set({"k3": 0.9})
    assert tree.numbers()["k3"].value == 0.9
    assert [tree.numbers()[f"k{i}"].value for i in (1, 2, 4)] == [0.8, 0.8, 0.8]


def test_the_later_change_holds() -> None:
    tree = fig4()
    tree.set({"k": 0.8})
    tree.set({f"k{i}": 0.9 for i in range(1, 5)})
    assert tree.trace().model.values["k"].tolist() == [0.9] * 4
    tree.set({"k": 0.7})
    assert tree.trace().model.values["k"].tolist() == [0.7] * 4
    assert tree.fork(values={"k": 1.0}) == 1
    assert tree.trace(1).model.values["k"].tolist() == [1.0] * 4


def test_law() -> None:
    tree = fig4()
    assert tree.fork(law="signed") == 1
    assert_same(tree.trace(1), simulate(stick_slip("signed"), FIG4, 40.0))
    assert tree.forks[1].text == "signed law"
    assert_same(tree.trace(0), simulate(stick_slip("published"), FIG4, 40.0))


@pytest.mark.parametrize("steps", [30, 75, 77])  # also amid the micro-steps of a cascade
def test_poke_at_a_row(steps: int) -> None:
    session = Session(stick_slip("published"), FIG4, 40.0)
    here = session.step(steps)
    session.poke({"z": {0: -0.4}}, state={1: "slip"})
    session.branch.complete()
    tree = fig4()
    tree.poke({"z": {0: -0.4}}, state={1: "slip"}, t=here.t, microstep=here.microstep)
    assert_same(tree.trace(), session.branch.trace())
    comparison = session.compare()
    assert tree.compare(0, 1) == comparison


def test_poke_between_rows() -> None:
    session = Session(stick_slip("published"), FIG4, 40.0)
    session.until("t > 17.25")
    session.poke({"z": {2: 0.1}})
    session.branch.complete()
    tree = fig4()
    tree.poke({"z": {2: 0.1}}, t=session.branches[1].raw(session.branches[1].fork + 1).t)
    assert_same(tree.trace(), session.branch.trace())


def test_microsteps_go_on_after_a_poke() -> None:
    """So that every firing in the log still has its row."""
    tree = fig4()
    log = tree.trace(0).transitions
    at = float(log.t[log.t > 24.9][0])
    tree.poke({"z": {0: -1.4}}, t=at, microstep=1)
    trace = tree.trace()
    steps = trace.microstep[trace.t == at].tolist()
    assert steps == [0, 1, 1, *range(2, 2 + steps.count(0) + len(steps) - 4)]
    assert max(steps) == (trace.transitions.t == at).sum()


def test_branches_follow_their_parents() -> None:
    tree = fig4()
    first = tree.poke({"z": {0: -1.4}}, t=25.0)
    second = tree.poke({"z": {1: 0.0}}, t=30.0)
    tree.set({"F_s": 1.7}, 0)
    for number in (first, second):
        assert tree.numbers(number)["F_s"].value == 1.7
    alone = tree_of(with_values(stick_slip("published"), {"F_s": 1.7}), FIG4, 40.0)
    alone.poke({"z": {0: -1.4}}, t=25.0)
    alone.poke({"z": {1: 0.0}}, t=30.0)
    assert_same(tree.trace(second), alone.trace(2))
    # A poke before that of the parent takes its place.
    tree.current = first
    early = tree.poke({"z": {1: 0.0}}, t=10.0)
    tree.current = 0
    other = tree.poke({"z": {1: 0.0}}, t=10.0)
    assert_same(tree.trace(early), tree.trace(other))


def test_where_a_branch_begins() -> None:
    tree = fig4()
    tree.poke({"z": {0: -1.4}}, t=25.0)
    assert tree.beginning(1) == 25.0
    tree.set({"F_s": 1.7}, 1)
    assert tree.beginning(1) == 0.0
    assert tree.forks[1].text == "F_s = 1.7, z1 = -1.4 at 25 s"


def test_a_system() -> None:
    tree = tree_of(pushed(), 4.0)
    tree.set({"numbers.m": 2.0, "pad.F_s": 1.9})
    pad = Contact("pad", CHARTS["stiction"], {**PAD, "F_s": 1.9}, v="v_m")
    expected = simulate(replace(pushed(), numbers={"m": 2.0}, contacts=(pad,)), 4.0)
    assert_same(tree.trace(), expected)
    tree.poke({"mass.x": 0.1}, t=3.0)
    trace = tree.trace()
    before, after = trace.body("mass").x[trace.t == 3.0]
    assert after == 0.1
    moved = trace.body("mass").x[-1] - expected.body("mass").x[-1]  # nothing depends on x
    assert moved == pytest.approx(after - before, rel=1e-4)
    with pytest.raises(ParameterError, match="only a GMS model has a slip law"):
        tree.fork(law="signed")


def test_ticks_stay_where_they_are() -> None:
    sampled = (Sampled("ramp", period=0.3, updates={"u": "u + 0.3"}),)
    tree = tree_of(pushed(signals={}, sampled=sampled), 4.0)
    session = Session(pushed(signals={}, sampled=sampled), 4.0)
    session.until("t > 2")
    session.poke({"mass.x": 0.5})
    session.branch.complete()
    tree.poke({"mass.x": 0.5}, t=session.branches[1].raw(session.branches[1].fork + 1).t)
    assert_same(tree.trace(), session.branch.trace())
    with pytest.raises(SessionError, match="ticks"):
        tree.save_scenario("never.toml")


def test_a_failed_run_is_kept() -> None:
    tree = tree_of(stick_slip("published"), FIG4, 40.0, max_steps=60)
    assert "60" in str(tree.failure())
    assert 0 < tree.trace().t[-1] < 40.0
    with pytest.raises(SessionError, match="before the poke"):
        tree.poke({"z": {0: 0.0}}, t=39.0)
    assert list(tree.forks) == [0]


@pytest.mark.parametrize("branch", [0, 1])
def test_an_exported_branch_runs_the_same(branch: int, tmp_path: Path) -> None:
    model, rig = pulled_mass()
    tree = tree_of(model, rig, 20.0, rtol=1e-8)
    tree.set({"F_s": 1.6})
    tree.poke({"z": {0: 0.0}}, v=0.01, t=9.0)
    path = tree.save_scenario(tmp_path / "branch.toml", branch)
    loaded = load_scenario(path)
    again, here = loaded.simulate(), tree.trace(branch)
    assert loaded.title == tree.forks[branch].name
    begin = 9.0 if branch else 0.0
    assert again.t[0] == begin
    part = again.t > begin
    np.testing.assert_array_equal(again.t[part], here.t[here.t > begin])
    np.testing.assert_array_equal(again.z[part], here.z[here.t > begin])


def test_exporting_what_a_file_cannot_hold(tmp_path: Path) -> None:
    tree = tree_of(stick_slip("signed"), Prescribed(lambda t: 0.1 * t), 3.0, engine="ifelse")
    with pytest.raises(OutputError, match="Python function"):
        tree.save_scenario(tmp_path / "one.toml")
    with pytest.raises(OutputError, match=r"\.toml"):
        fig4().save_scenario(tmp_path / "one.json")


def test_names_and_deleting() -> None:
    tree = fig4()
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
    assert tree.fork() == 3  # numbers are not used again
    with pytest.raises(SessionError, match="the original run"):
        tree.delete(0)
    with pytest.raises(SessionError, match="no branch 7"):
        tree.trace(7)
    with pytest.raises(SessionError, match="name"):
        tree.rename(0, " ")


def test_wrong_values_change_nothing() -> None:
    tree = fig4()
    before = tree.trace()
    for values, match in (
        ({"F_s": -1.0}, "F_s"),
        ({"q": 1.0}, "no number 'q'"),
        ({"sigma": 1.0}, "name that of one element"),
    ):
        with pytest.raises(ParameterError, match=match):
            tree.set(values)
    with pytest.raises(ParameterError, match="law"):
        tree.fork(law="signd")
    for t in (-1.0, 40.0):
        with pytest.raises(SessionError, match="no poke"):
            tree.poke({"z": {0: 0.0}}, t=t)
    with pytest.raises(SessionError, match="nothing to poke"):
        tree.poke(t=5.0)
    assert list(tree.forks) == [0]
    assert tree.forks[0].values == {}
    assert tree.trace() is before
