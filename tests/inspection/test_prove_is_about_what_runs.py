"""What is proved of a model or a system holds for what runs: elements, ticks, order, neighbours.

Each verdict stands beside a run that shows the same.
"""

from __future__ import annotations

import argparse
from typing import Any

import pytest

pytest.importorskip("z3", reason="needs z3 (extra: check)")

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    LivelockError,
    Prescribed,
    Slider,
    State,
    System,
    Transition,
    prove,
    simulate,
)
from gms_fsm.verification.prove import Check
from tests.helpers import one_element
from tests.soak import verdicts

OFF_ON = (State("off", outputs={"F": "0"}), State("on", outputs={"F": "1"}))


def switch(up: str, down: str, **changes: Any) -> Chart:
    """Two states, off and on, with forces of 0 and 1 N."""
    edges = (Transition("up", "off", "on", guard=up), Transition("down", "on", "off", guard=down))
    return Chart("switch", **{"states": OFF_ON, "transitions": edges, **changes})


def statuses(report: Any, check: Check) -> set[str]:
    return {finding.status for finding in report.of(check)}


# --------------------------------------------------------------------------- elements
FORCED = switch("F < 1", "F > 1.5")


def test_two_elements_livelock_where_one_does_not() -> None:
    """F is their sum: 0, and 2 once both are on."""
    assert statuses(prove(ChartModel(FORCED, {}, n=1)), "livelock") == {"proved"}
    two = ChartModel(FORCED, {}, n=2)
    (finding,) = prove(two).of("livelock")
    assert (finding.status, finding.where) == ("refuted", ("off", "off", "up", "down"))
    with pytest.raises(LivelockError):
        simulate(two, Prescribed(0.1), 1.0)


def test_a_guard_that_one_element_never_meets_is_met_by_two() -> None:
    alone, both = (prove(ChartModel(FORCED, {}, n=n)) for n in (1, 2))
    told = [{f.where: f.status for f in report.of("reachability")} for report in (alone, both)]
    assert [each["down",] for each in told] == ["refuted", "proved"]
    assert "F is the sum over 2 elements, R that of the other element" in str(both)


def test_the_example_of_several_elements_begins_a_livelock() -> None:
    states = (State("off", {"z": "v"}, outputs={"F": "z"}), State("on", outputs={"F": "0"}))
    model = ChartModel(switch("F > 3", "F < 1", states=states, variables=("z",)), {}, n=3)
    (finding,) = prove(model).of("livelock")
    point = finding.counterexample
    start = {"z": [point[name] for name in ("z", "z2", "z3")], "states": finding.where[:3]}
    assert sum(start["z"]) > 3
    with pytest.raises(LivelockError):
        simulate(model, Prescribed(0.0), 1.0, initial=start)


def test_more_elements_than_are_followed_are_not_decided() -> None:
    report = prove(ChartModel(FORCED, {}, n=9))
    assert statuses(report, "livelock") == {"undecided"}
    assert "there are 8" in str(report)


# --------------------------------------------------------------------------- time
def test_a_sampled_valve_does_not_livelock() -> None:
    valve = switch("True", "True")
    (finding,) = prove(valve).refuted
    assert finding.check == "livelock"
    contact = Contact("valve", valve, period=0.1)
    system = System("sampled", bodies=(Body("body", inertia=1.0),), contacts=(contact,))
    for what in (contact, system):
        assert prove(what).refuted == ()
    assert len(simulate(system, 1.0).transitions) == 10


@pytest.mark.parametrize("late_first", [True, False])
def test_an_edge_behind_a_shorter_stay_is_never_taken(late_first: bool) -> None:
    late, soon = (Transition(f"after_{T}", "off", "on", guard=f"after({T})") for T in (2, 1))
    back = Transition("back", "on", "off", guard="after(1)")
    chart = switch("", "", transitions=((late, soon) if late_first else (soon, late)) + (back,))
    (dead,) = prove(chart).refuted
    assert (dead.check, dead.where) == ("reachability", ("after_2",))
    assert "after_1 ends each stay in off before" in dead.text
    taken = simulate(ChartModel(chart, {}), Prescribed(0.1), 9.0).transitions.edge
    assert "after_2" not in taken.tolist()
    # At ticks of 3 s both are due at once, and the first of them is taken.
    sampled = prove(Contact("slow", chart, period=3.0)).refuted
    assert ["after_2" in each.where for each in sampled] == [True] * (not late_first)


# --------------------------------------------------------------------------- order
def test_a_cycle_behind_an_earlier_edge_is_no_livelock() -> None:
    states = (*OFF_ON, State("broken", outputs={"F": "0"}))
    edges = (
        Transition("breaks", "off", "broken", guard="v > 0"),
        Transition("up", "off", "on", guard="v > 1"),
        Transition("down", "on", "off", guard="v > 1"),
    )
    chart = switch("", "", states=states, transitions=edges)
    assert statuses(prove(chart), "livelock") == {"proved"}
    assert len(simulate(ChartModel(chart, {}), Prescribed(2.0), 1.0).transitions) == 1
    swapped = switch("", "", states=states, transitions=(*edges[1:], edges[0]))
    assert statuses(prove(swapped), "livelock") == {"refuted"}


def test_cycles_that_end_one_by_one_but_not_by_turns_livelock() -> None:
    edges = (
        Transition("down", "off", "off", guard="z > 0", actions={"z": "-1"}),
        Transition("up", "off", "off", guard="z < 0", actions={"z": "1"}),
    )
    chart = switch("", "", variables=("z",), states=OFF_ON[:1], transitions=edges)
    *alone, together = prove(chart).of("livelock")
    assert [finding.status for finding in alone] == ["proved", "proved"]
    assert (together.status, together.where) == ("refuted", ("off", "down", "up"))
    with pytest.raises(LivelockError):
        simulate(ChartModel(chart, {}), Prescribed(0.0), 1.0, initial={"z": [1.0]})


# --------------------------------------------------------------------------- the rest of a system
LOW_HIGH = switch(
    "a > 1.5",
    "a < -1.5",
    states=(State("off", outputs={"F": "-1"}), State("on", outputs={"F": "1"})),
)


OF_1_KG = ("W >= 1", "W <= 1")


def system(*names: str) -> System:
    contacts = tuple(Contact(name, LOW_HIGH) for name in names)
    return System("one body", bodies=(Body("body", inertia=1.0),), contacts=contacts)


def test_two_contacts_on_one_body_are_not_proved_free_of_livelock() -> None:
    assert statuses(prove(system("one"), OF_1_KG), "livelock") == {"proved"}
    assert len(simulate(system("one"), 1.0).transitions) == 0
    told = prove(system("one", "two"), OF_1_KG, contact="two").of("livelock")
    assert [(f.status, f.text) for f in told if f.status != "proved"] == [
        ("undecided", "switches of other contacts at the same instant are not followed")
    ]
    with pytest.raises(LivelockError):
        simulate(system("one", "two"), 1.0)


def test_an_input_that_jumps_with_an_impulse_is_not_held_through_a_cycle() -> None:
    """u follows the body that the impulse of the chart itself turns round."""
    edges = (
        Transition("down", "off", "off", guard="u > 0 and v > 0", actions={"v": "-v"}),
        Transition("up", "off", "off", guard="u < 0 and v < 0", actions={"v": "-v"}),
    )
    chart = Chart("turning", ("u", "v"), (), (), OFF_ON[:1], edges)
    contact = Contact("c", chart, inputs={"u": "v"})
    turning = System("one body", bodies=(Body("b", inertia=1.0),), contacts=(contact,))
    told = prove(turning).of("livelock")
    assert [f.text for f in told if f.status == "undecided"] == [
        "jumps of inputs at the same instant are not followed"
    ]
    with pytest.raises(LivelockError):
        simulate(turning, 1.0, initial={"v": 1.0})


def test_a_neighbour_on_another_body_changes_nothing() -> None:
    apart = System(
        "two bodies",
        bodies=(Body("a", inertia=1.0, x="x_a", v="v_a"), Body("b", inertia=1.0, x="x_b", v="v_b")),
        contacts=(Contact("one", LOW_HIGH, v="v_a"), Contact("two", LOW_HIGH, v="v_b")),
    )
    assert prove(apart, contact="one").findings == prove(system("one")).findings


def test_a_free_body_chatters_where_a_driven_one_does_not() -> None:
    states = (State("off", outputs={"F": "-1"}), State("on", outputs={"F": "1"}))
    chart = switch("v > 0 and x > -1", "v <= 0", states=states, inputs=("x", "v"))
    model, rig = ChartModel(chart, {}), Slider(1.0, "0")
    assert statuses(prove(chart), "chattering") == {"proved"}  # v is as given
    on_a_body = System("free", bodies=(Body("b", inertia=1.0),), contacts=(Contact("c", model),))
    (finding,) = prove(on_a_body).of("chattering")
    assert finding.status == "refuted"
    assert finding.counterexample["v"] == 0
    with pytest.raises(LivelockError):
        simulate(model, rig, 1.0)


def test_forces_that_bend_a_path_back_from_both_sides_are_not_decided() -> None:
    """At x = 0 and v = 0 both flows touch the surface, and each acceleration leads across it."""
    states = (State("off", outputs={"F": "-1"}), State("on", outputs={"F": "1"}))
    model = ChartModel(switch("x > 0", "x <= 0", states=states, inputs=("x",)), {})
    on_a_body = System("free", bodies=(Body("b", inertia=1.0),), contacts=(Contact("c", model),))
    (finding,) = prove(on_a_body).of("chattering")
    assert (finding.status, "first order" in finding.text) == ("undecided", True)
    with pytest.raises(LivelockError):
        simulate(model, Slider(1.0, "0"), 1.0)


def test_the_model_s_viscous_force_is_part_of_f() -> None:
    read = prove(one_element("signed")).domain
    assert "sigma_2 >= 0" not in read  # its guards do not read F
    guarded = switch("F > 1", "F < 0")
    damped = ChartModel(guarded, {}, sigma_2=0.5)
    assert "sigma_2 >= 0" in prove(damped).domain
    told = {f.where: f.status for f in prove(damped).of("reachability")}
    assert told["up",] == "proved"  # by sigma_2 v, though the state gives 0


# --------------------------------------------------------------------------- Zeno
def ball(action: str, guard: str = "x >= 0 and v > 0") -> Chart:
    bounce = Transition("bounce", "free", "free", guard=guard, actions={"v": action})
    return Chart(
        "ball", ("x", "v"), (), ("e",), (State("free"),), (bounce,), {"F": "0"}
    )  # fmt: skip


def test_a_bouncing_ball_without_a_state_of_rest_is_refuted() -> None:
    report = prove(ball("-e * v"), ["0 < e", "e < 1"])
    (finding,) = report.refuted
    assert (finding.check, finding.where) == ("zeno", ("free", "bounce"))
    point = finding.counterexample
    rig = Slider(1.0 / point["W"], repr(point["H"]))
    start = {"x": point["x"], "v": point["v"]}
    with pytest.raises(LivelockError, match="Zeno"):
        simulate(ChartModel(ball("-e * v"), {"e": point["e"]}), rig, 20.0, initial=start)


@pytest.mark.parametrize(
    ("action", "guard", "status"),
    [
        ("-e * v", "x >= 0 and v > 0.1", "proved"),  # a rest speed
        ("-e * v", "x >= sin(v) and v > 0", "undecided"),
        ("-v", "x >= 0 and v > 0", "undecided"),  # it loses nothing
        ("-e * v ** 3", "x >= 0 and v > 0", "undecided"),
    ],
)
def test_what_is_no_such_ball_is_not_called_one(action: str, guard: str, status: str) -> None:
    (finding,) = prove(ball(action, guard), ["0 < e", "e < 1"]).of("zeno")
    assert finding.status == status


def test_charts_without_impacts_are_not_asked() -> None:
    assert prove(GMS(one_element("signed").parameters, law="signed").chart).of("zeno") == ()


# --------------------------------------------------------------------------- at random
@pytest.mark.every(3)
@pytest.mark.slow
@pytest.mark.parametrize("index", range(15))
def test_random_systems_do_not_contradict_their_verdicts(index: int) -> None:
    (seen,) = verdicts.look(argparse.Namespace(seed=2), 10 * index)
    assert not seen.finding, seen.finding
