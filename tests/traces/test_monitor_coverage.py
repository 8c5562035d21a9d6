"""Coverage counts what the log and the rows show: states, edges, and clauses true and false.

Clauses count only where they are evaluated: in the source state of the edge.
"""

from __future__ import annotations

from typing import Any

import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    Prescribed,
    State,
    Stribeck,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.session.explain import explain
from gms_fsm.traces.verdicts import CoverageVerdict
from tests.helpers import FIG4_SINE, one_element, stick_slip


def coverage(trace: Trace) -> CoverageVerdict:
    found = trace.monitors["coverage"]
    assert isinstance(found, CoverageVerdict)
    return found


def run(*arguments: Any, **options: Any) -> Trace:
    return simulate(*arguments, monitors="coverage", **options)


def test_motion_in_both_directions_covers_the_gms_chart() -> None:
    trace = run(stick_slip("signed"), Prescribed(FIG4_SINE), 50.0)
    found = coverage(trace)
    assert found.ok
    assert found.never == ()
    assert found.states == {"stick": (True,) * 4, "slip": (True,) * 4}
    log = trace.transitions
    for edge, taken in found.edges.items():
        assert list(taken) == [
            int(((log.element == i) & (log.edge == edge)).sum()) for i in range(4)
        ]
    assert [clause.text for clause in found.clauses] == [
        "z >= s",
        "v > v_c",
        "z <= -s",
        "v < -v_c",
        "|v| <= v_c",
        "|z| < s",
    ]
    assert found.text == ("states 2 of 2, edges 3 of 3, clauses true 6 of 6, clauses false 6 of 6")


def test_motion_in_one_direction_does_not() -> None:
    found = coverage(run(stick_slip("signed"), Prescribed(0.2), 3.0))
    assert not found.ok
    assert found.never == (
        "edge break_away_backward",
        "edge arrest",
        "v > v_c of break_away_forward false",
        "z <= -s of break_away_backward true",
        "v < -v_c of break_away_backward true",
        "|v| <= v_c of arrest true",
        "|z| < s of arrest true",
    )
    assert "never: edge break_away_backward, edge arrest, " in found.text
    assert "a longer run, motion in both directions" in found.text
    shorter = coverage(run(stick_slip("signed"), Prescribed(0.2), 1.0))
    assert shorter.states == {"stick": (True,) * 4, "slip": (False,) * 4}
    arrest = [clause for clause in shorter.clauses if clause.edge == "arrest"]
    assert not any(any(clause.true + clause.false) for clause in arrest)


@pytest.mark.parametrize("t_eval", [None, [0.0, 20.0, 50.0]])
def test_clauses_are_those_of_the_explanations(t_eval: list[float] | None) -> None:
    """Row by row, element by element, as reported by `explain`."""
    trace = run(stick_slip("published"), Prescribed(FIG4_SINE), 50.0, t_eval=t_eval)
    found, whole = coverage(trace), trace.whole()
    seen: set[tuple[str, str, int, bool]] = set()
    for row in range(len(whole)):
        for i in range(whole.n):
            for edge in explain(whole, row, i):
                seen |= {(edge.edge.name, c.text, i, c.holds) for c in edge.clauses}
    for clause in found.clauses:
        for i in range(whole.n):
            assert clause.true[i] == ((clause.edge, clause.text, i, True) in seen)
            assert clause.false[i] == ((clause.edge, clause.text, i, False) in seen)


def test_a_clause_that_cannot_be_computed_is_false() -> None:
    """As in the guards themselves: 1/z at z = 0 does not hold."""
    chart = Chart(
        "reciprocal",
        inputs=("v",),
        variables=("z",),
        parameters=("k",),
        states=(State("a", flow={"z": "v"}), State("b", flow={"z": "v"})),
        transitions=(Transition("go", "a", "b", guard="1 / z < 2 and z > 0"),),
        outputs={"F": "k * z"},
    )
    model = ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.0, 1.0))
    found = coverage(run(model, Prescribed(0.0), 1.0))
    assert found.clauses[0].true == (False,)
    assert found.clauses[0].false == (True,)
    assert not found.edges["go"][0]


def test_an_event_missed_between_steps_is_missed_here_too() -> None:
    model = one_element("signed", v_s=1e-3)
    rig, step = Prescribed("0.2*sin(2*pi*t/20)"), {"method": "rk4", "step": 1.0001e-2}
    looked = coverage(run(model, rig, 19.0, events="step", **step))
    located = coverage(run(model, rig, 19.0))
    assert located.edges["arrest"] == (1,)
    assert looked.edges["arrest"] == (0,)
    assert "edge arrest" in looked.never


def test_an_edge_that_leaves_several_states_counts_once_for_each() -> None:
    chart = Chart(
        "two ways home",
        states=(State("rest"), State("left"), State("right")),
        transitions=(
            Transition("go_left", "rest", "left", guard="v < -0.1"),
            Transition("go_right", "rest", "right", guard="v > 0.1"),
            Transition("home", ("left", "right"), "rest", guard="abs(v) <= 0.1"),
        ),
        outputs={"F": "0"},
    )
    found = coverage(run(ChartModel(chart, {}), Prescribed("0.2*sin(t)"), 4.0))  # v > 0 until pi
    assert found.edges == {
        "go_left": (1,), "go_right": (1,), "home from left": (0,), "home from right": (1,)
    }  # fmt: skip
    assert "edges 3 of 4" in found.text
    assert found.never == ("edge home from left", "|v| <= 0.1 of home from left true")
