"""Claim: the first transition named is the first one that differs in the logs of both runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    Prescribed,
    Sampled,
    State,
    Supervisor,
    System,
    Trace,
    Transition,
    diff,
    simulate,
)
from gms_fsm.charts import CHARTS
from tests.helpers import FIG4_SINE, pulled_mass

PAPER = GMSParameters.paper("stick-slip")
RIG = Prescribed(FIG4_SINE)


def ran(parameters: GMSParameters = PAPER, t_end: float = 40.0, **options: object) -> Trace:
    model = GMS(parameters, law="signed")
    return simulate(model, RIG, t_end, engine="ifelse", **options)  # type: ignore[arg-type]


def stiffer(*, last: float = 1.0, all_: float = 1.0) -> GMSParameters:
    weights = np.asarray(PAPER.weights) * np.array([1.0, 1.0, 1.0, last])
    return replace(PAPER, k=np.asarray(PAPER.k) * all_, weights=weights)


def first_by_hand(one: Trace, other: Trace, within: float) -> int | None:
    """Return the number of the first transition that differs, from 1, by walking both logs."""
    end = min(one.t[-1], other.t[-1])
    number = 0
    logs = [[each for each in run.transitions if each.t <= end] for run in (one, other)]
    for a, b in zip(*logs, strict=False):
        number += 1
        if (a.element, a.edge) != (b.element, b.edge) or abs(a.t - b.t) > within:
            return number
    return None if len(logs[0]) == len(logs[1]) else number + 1


@pytest.mark.parametrize("factor", [1.5, 0.7, 1.01, 1.3])
def test_runs_with_other_numbers_name_the_first_different_transition(factor: float) -> None:
    one, other = ran(), ran(stiffer(last=factor))
    found = diff(one, other).runs
    assert found is not None
    assert found.number is not None
    assert found.number == first_by_hand(one, other, found.within)
    assert f"same chart, other numbers: first difference at transition {found.number}" in str(found)


def test_the_time_is_that_of_the_earlier_run() -> None:
    one, other = ran(), ran(stiffer(last=1.5))
    found = diff(one, other).runs
    assert found is not None
    assert found.number is not None
    times = [run.transitions.t[found.number - 1] for run in (one, other)]
    assert found.t == min(times)


def test_a_run_is_equal_to_itself() -> None:
    found = diff(ran(), ran())
    assert found.verdict == "equal"
    assert found.runs is not None
    assert (found.runs.number, found.runs.within, set(found.runs.largest.values())) == (
        None,
        0.0,
        {0.0},
    )


def test_a_saved_run_is_equal_to_the_run(tmp_path: Path) -> None:
    one = ran(t_end=5.0)
    assert diff(one, Trace.load(one.save(tmp_path / "one.npz"))).verdict == "equal"


def test_finer_tolerances_are_no_difference() -> None:
    found = diff(ran(), ran(rtol=1e-8))
    assert found.verdict == "equivalent"
    assert [each.name for each in found.changes] == ["rtol", "atol"]


def test_events_at_the_ends_of_long_steps_are_a_setting_that_differs() -> None:
    found = diff(ran(), ran(method="euler", step=0.1, events="step"))
    assert {"method", "step", "events"} <= {each.name for each in found.changes}


def test_a_shorter_run_is_compared_until_its_end() -> None:
    found = diff(ran(), ran(t_end=20.0))
    assert found.runs is not None
    assert (found.runs.t_end, found.runs.number) == (20.0, None)


def test_values_count_even_where_no_transition_differs() -> None:
    found = diff(ran(t_end=1.0), ran(stiffer(all_=1.5), t_end=1.0))
    assert found.verdict == "different"
    assert found.runs is not None
    assert found.runs.number is None
    assert found.runs.largest["F"] > 0.0


def test_the_largest_difference_is_that_of_the_samples_until_then() -> None:
    one, other = ran(), ran(stiffer(last=1.5))
    found = diff(one, other).runs
    assert found is not None
    assert found.t is not None
    times = np.linspace(0.0, found.t, 2000)
    largest = np.abs(one.sample(times).F - other.sample(times).F).max()
    assert found.largest["F"] == pytest.approx(largest, rel=1e-12)


def sticky(stick: str, edge: str, limit: float) -> ChartModel:
    chart = Chart(
        stick,
        variables=("z",),
        parameters=("c",),
        states=(State(stick, {"z": "v"}), State("slip")),
        transitions=(
            Transition(edge, stick, "slip", "z > c"),
            Transition("back", "slip", stick, "v < 0", {"z": "0"}),
        ),
        outputs={"F": "z"},
    )
    return ChartModel(chart, {"c": limit})


def test_other_names_are_no_difference_of_runs() -> None:
    runs = [
        simulate(sticky(*names, 0.01), RIG, 30.0, engine="ifelse")
        for names in (("stick", "go"), ("held", "leaves"))
    ]
    found = diff(*runs)
    assert found.verdict == "equivalent"
    assert str(found.runs).startswith("equivalent charts, same numbers")


def test_models_that_differ_are_moved_until_their_runs_differ() -> None:
    found = diff(GMS(PAPER, law="signed"), GMS(PAPER, law="published"))
    assert found.runs is not None
    assert found.runs.number is not None
    model = {law: GMS(PAPER, law=law) for law in ("signed", "published")}  # type: ignore[arg-type]
    one, other = (
        simulate(each, Prescribed(found.runs.motion), 4 * np.pi, engine="ifelse")
        for each in model.values()
    )
    assert found.runs.number == first_by_hand(one, other, found.runs.within)


def test_models_with_other_numbers_are_different() -> None:
    found = diff(sticky("stick", "go", 0.01), sticky("stick", "go", 0.02))
    assert found.verdict == "different"
    assert [(each.part, each.name) for each in found.changes] == [("number", "c")]


def test_a_renamed_number_is_the_same_number() -> None:
    other = Chart("renamed", ("v",), ("z",), ("K",), (State("one", {"z": "v"}),), (),
                  {"F": "K * z"})  # fmt: skip
    one = Chart("named", ("v",), ("z",), ("k",), (State("one", {"z": "v"}),), (), {"F": "k * z"})
    found = diff(ChartModel(one, {"k": 2.0}), ChartModel(other, {"K": 2.0}))
    assert found.verdict == "equivalent"


def test_runs_of_a_system_name_the_contact() -> None:
    from gms_fsm.systems.system import system_of

    model, rig = pulled_mass()
    one = simulate(system_of(model, rig), 20.0, engine="ifelse")
    assert diff(one, one).verdict == "equal"
    faster = replace(rig, speed=2 * rig.speed)
    other = simulate(system_of(model, faster), 20.0, engine="ifelse")
    found = diff(one, other)
    assert found.runs is not None
    assert found.runs.fired[0].split(" at ")[0].endswith("of friction 1")


def test_runs_of_other_lengths_agree_within_their_tolerances() -> None:
    found = diff(ran(t_end=20.0), ran(t_end=20.0 + 1 / 3))
    assert found.runs is not None
    assert found.runs.within > 0.0
    assert str(found).splitlines()[1:3] == [
        "  ~ setting t_end: 20 -> 20.3333333",
        "equivalent: the runs agree until t = 20 s as well as their tolerances tell",
    ]


def test_a_run_that_a_condition_ended_is_not_called_equal() -> None:
    found = diff(ran(t_end=20.0), ran(t_end=20.0, until="t > 15"))
    assert found.summary.startswith("equivalent: the runs agree until t = 15")


def test_other_rows_of_the_same_run_are_no_difference() -> None:
    found = diff(ran(), ran(t_eval=[0.0, 7.0, 40.0]))
    assert (found.verdict, found.runs is not None and found.runs.beyond) == ("equal", ())


IDLE = Supervisor("idle", Chart("idle", inputs=(), velocities=(), states=(State("one"),)))


def alone(**more: Any) -> Trace:
    return simulate(System("s", supervisors=(IDLE,), **more), 1.0)


def differing(one: Trace, other: Trace) -> tuple[str, ...]:
    found = diff(one, other)
    assert found.verdict == "different"
    assert found.runs is not None
    return found.runs.beyond


def test_further_states_are_compared() -> None:
    runs = [alone(flow={"q": rate}) for rate in ("1", "2")]
    assert differing(*runs) == ("q",)


def test_sampled_values_are_compared() -> None:
    runs = [alone(sampled=(Sampled("A", period=0.1, updates={"u": u}),)) for u in ("u + 1", "2")]
    assert differing(*runs) == ("u",)


def test_a_tick_at_the_end_of_the_shorter_run_is_no_difference() -> None:
    sampler = Sampled("A", period=0.1, updates={"u": "u + 1"})
    system = System("s", supervisors=(IDLE,), sampled=(sampler,))
    assert diff(simulate(system, 1.0), simulate(system, 1.5)).verdict == "equivalent"


def test_free_bodies_are_compared() -> None:
    runs = [alone(bodies=(Body("m", inertia=1.0, force=force),)) for force in ("1", "2")]
    assert differing(*runs) == ("x", "v")


def supervised(rate: str, output: str) -> Trace:
    state = State("one", {"z": rate}, outputs={"u": output})
    chart = Chart("clock", variables=("z",), inputs=(), velocities=(), states=(state,))
    return simulate(System("s", supervisors=(Supervisor("clock", chart),)), 1.0)


def test_variables_of_supervisors_are_compared() -> None:
    assert differing(supervised("1", "0"), supervised("2", "0")) == ("z",)


def test_outputs_of_supervisors_are_compared() -> None:
    assert differing(supervised("1", "0"), supervised("1", "z")) == ("u",)


def test_states_are_compared() -> None:
    states = (State("one"), State("two"))
    system = System(
        "s", supervisors=(Supervisor("idle", Chart("i", inputs=(), velocities=(), states=states)),)
    )
    runs = [simulate(system, 1.0, initial={"states": [name]}) for name in ("one", "two")]
    assert differing(*runs) == ("state",)


def test_runs_without_a_common_time_are_undecided() -> None:
    system = System("s", supervisors=(IDLE,))
    runs = [simulate(system, start + 1.0, t_start=start) for start in (0.0, 5.0)]
    assert diff(*runs).verdict == "undecided"


def test_a_renamed_contact_makes_no_difference_of_runs() -> None:
    one, other = (
        System(
            "s",
            bodies=(Body("mass", inertia=1.0, force="5 * sin(t)"),),
            contacts=(Contact(name, CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0}),),
        )
        for name in ("pad", "shoe")
    )
    assert diff(simulate(one, 5.0), simulate(other, 5.0)).verdict == "equivalent"
