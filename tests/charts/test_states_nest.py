"""States nest as in SCXML: what they inherit, in which order edges leave and enter, histories.

Random nested charts against an SCXML interpreter are in `tests/exporters`, engines in `tests/laws`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    ElementMachines,
    Parameter,
    Prescribed,
    Slider,
    State,
    Supervisor,
    System,
    Trace,
    Transition,
    prove,
    simulate,
)
from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.errors import ChartError
from gms_fsm.session.session import Session
from tests.corpus import ENGINES, LIGHT, trace
from tests.exporters.nested_charts import VELOCITY, made
from tests.helpers import other_parts, stick_slip

LIGHTS = LIGHT.chart
SINE = "0.15 * sin(2 * pi * t / 25)"


def marked(*edges: Transition, **outer: Any) -> Chart:
    """Return a chart in which what is entered and left writes its digit behind those of n."""

    def state(name: str, digit: int, *inside: State, **more: Any) -> State:
        entry, exit_ = ({"n": f"10 * n + {digit + k}"} for k in (0, 1))
        return State(name, entry=entry, exit=exit_, states=inside, **more)

    inner = state("b", 3, state("x", 5), state("y", 7))
    states = (State("off"), state("a", 1, inner, State("c"), **outer))
    return Chart("digits", variables=("n",), states=states, transitions=edges, outputs={"F": "v"})


def digits(chart: Chart, state: str = "off", t_end: float = 1.0) -> int:
    """Return what a run has written."""
    initial = {"states": [state]}
    one = simulate(ChartModel(chart, {}), Prescribed("0"), t_end, initial=initial)
    return int(one.variable("n")[-1, 0])


def composite() -> ChartModel:
    """Return the GMS element with two states of slip in one that has their flow and arrest."""
    flat, law = stick_slip("signed"), GMS_ELEMENT["signed"]
    forward, backward, arrest = law.transitions
    stick, slip = law.states
    chart = Chart(
        "GMS element with two slips",
        law.inputs,
        law.variables,
        law.parameters,
        (stick, State("slip", slip.flow, states=(State("forward"), State("backward")))),
        (
            Transition(forward.name, "stick", "slip.forward", forward.guard),
            Transition(backward.name, "stick", "slip.backward", backward.guard),
            Transition(arrest.name, "slip", "stick", arrest.guard),
        ),
        law.outputs,
    )
    return ChartModel(
        chart,
        flat.values,
        n=flat.n,
        stribeck=flat.stribeck,
        sigma_2=flat.sigma_2,
        weights=flat.weights,
    )


# --------------------------------------------------------------------------- order
def test_an_edge_leaves_inner_states_first_and_enters_them_last() -> None:
    assert digits(marked(Transition("in_", "off", "a.b.y", "after(0.5)"))) == 137
    out = marked(Transition("out", "a", "off", "after(0.5)", {"n": "10 * n + 9"}))
    assert digits(out, "a.b.x") == 6429


def test_an_edge_between_siblings_does_not_leave_what_is_around_both() -> None:
    assert digits(marked(Transition("go", "a.b.x", "a.b.y", "after(0.5)")), "a.b.x") == 67
    assert digits(marked(Transition("go", "a.b", "a.c", "after(0.5)")), "a.b.x") == 64


def test_an_edge_of_a_composite_state_to_itself_or_inside_leaves_it_and_enters_it() -> None:
    assert digits(marked(Transition("again", "a.b", "a.b", "after(0.7)")), "a.b.y") == 8435
    assert digits(marked(Transition("again", "a.b", "a.b.y", "after(0.7)")), "a.b.y") == 8437


def test_edges_of_inner_states_go_before_those_of_outer_ones() -> None:
    outer = Transition("outer", "a", "off", "after(0.5)")
    inner = Transition("inner", "a.b.x", "a.b.y", "after(0.5)")
    edges = marked(outer, inner).leaving("a.b.x")
    assert [edge.name for _, edge in edges] == ["inner", "outer"]
    assert [edge.name for _, edge in marked(outer).leaving("a.c")] == ["outer"]


def test_edges_from_several_states_perform_the_exit_of_the_one_they_leave() -> None:
    either = marked(Transition("either", ("a.b.x", "a.c"), "off", "after(0.5)"))
    assert digits(either, "a.b.x") == 642
    assert digits(either, "a.c") == 2


# --------------------------------------------------------------------------- what is inherited
def test_flow_outputs_and_locks_are_inherited_and_inner_ones_win() -> None:
    own = State("own", {"z": "2"}, outputs={"F": "1"})
    chart = Chart(
        "inherits",
        variables=("z", "w"),
        states=(
            State("out", {"z": "1", "w": "v"}, outputs={"F": "z"}, states=(own, State("as_out"))),
            State("held", locked=True, states=(State("left"), State("right"))),
        ),
        transitions=(),
    )
    first, second, *held = chart.states
    assert (first.flow, first.outputs) == ({"z": "2", "w": "v"}, {"F": "1"})
    assert (second.flow, second.outputs) == ({"z": "1", "w": "v"}, {"F": "z"})
    assert [each.name for each in held if each.locked] == ["held.left", "held.right"]


def test_the_age_of_an_outer_state_goes_on_while_inner_ones_change() -> None:
    """The closed form: all lights go out 1.5 s after the first came on, whatever was lit."""
    assert LIGHTS.states[1].flow == {"u": "on__age"}
    log = trace("states in states").transitions
    assert [*zip(log.t.round(9), log.edge, log.target, strict=True)][:6] == [
        (0.3, "again", "on.go.green"),
        (0.6, "slow", "on.go.amber"),
        (0.75, "stop", "on.red"),
        (1.14, "start", "on.go.green"),
        (1.44, "slow", "on.go.amber"),
        (1.59, "stop", "on.red"),
    ]
    assert log.t[log.edge == "fails"][0] == pytest.approx(1.8, abs=1e-12)


# --------------------------------------------------------------------------- histories
def test_a_history_enters_the_state_that_was_active_last_and_in_it_the_initial_one() -> None:
    log = trace("states in states").transitions
    before, after = (
        log.source[log.edge == "fails"],
        log.target[np.flatnonzero(log.edge == "fails") + 1],
    )
    assert len(before) >= 2
    assert before[0] == after[0] == "on.red"
    first = marked(
        Transition("out", "a", "off", "after(0.2)"),
        Transition("back", "off", "a", "after(0.2)"),
        history=True,
    )
    for state, entered in (("a.b.y", "a.b.x"), ("a.c", "a.c")):
        one = simulate(ChartModel(first, {}), Prescribed("0"), 0.5, initial={"states": [state]})
        assert str(one.states[-1, 0]) == entered


# --------------------------------------------------------------------------- readers
@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 8])
def test_engines_agree_on_random_nested_charts(seed: int) -> None:
    first, *others = (
        simulate(made(seed), Prescribed(VELOCITY), 4.0, engine=engine) for engine in ENGINES
    )
    assert all(other_parts(each, first) == [] for each in others)
    assert len(first.transitions) > 5


def test_a_composite_gms_element_has_the_switches_and_the_bits_of_the_flat_one() -> None:
    flat, nested = (
        simulate(each, Prescribed(SINE), 25.0) for each in (stick_slip("signed"), composite())
    )
    states = [name.partition(".")[0] for name in nested.transitions.target.tolist()]
    assert states == flat.transitions.target.tolist()
    assert nested.transitions.t.tolist() == flat.transitions.t.tolist()
    assert nested.F.tobytes() == flat.F.tobytes()
    assert {"slip.forward", "slip.backward"} <= {*nested.transitions.target.tolist()}


def test_a_brake_that_locks_while_it_is_closed_has_the_bits_of_the_flat_one() -> None:
    """One edge of the composite state releases it, whether it slips or holds the body."""
    free = Parameter("mu", "1", "> 0")
    inner = (
        State("stuck", locked=True),
        State("forward", outputs={"F": "mu * N"}),
        State("backward", outputs={"F": "-mu * N"}),
    )
    edges = (
        ("catch_forward", "open", "forward", "N > 0.6 and v > 0"),
        ("catch_backward", "open", "backward", "N > 0.6 and v <= 0"),
        ("stop_forward", "forward", "stuck", "v < 0"),
        ("stop_backward", "backward", "stuck", "v > 0"),
        ("go_forward", "stuck", "forward", "F > 1.2 * mu * N"),
        ("go_backward", "stuck", "backward", "F < -1.2 * mu * N"),
    )
    nested_names = {each.name: f"closed.{each.name}" for each in inner} | {"open": "open"}
    charts = []
    for names, states, closed in (
        (nested_names, (State("closed", states=inner),), "closed"),
        ({name: name for name in nested_names}, inner, ("stuck", "forward", "backward")),
    ):
        rows = [Transition(name, names[a], names[b], guard) for name, a, b, guard in edges]
        rows.append(Transition("release", closed, "open", "N <= 0.6"))
        first = State("open", outputs={"F": "0.1 * v"})
        charts.append(Chart("brake", ("v", "N"), (), (free,), (first, *states), rows))
    nested, flat = (
        simulate(
            ChartModel(chart, {"mu": 2.0}, inputs={"N": "1 + 3 * sin(2 * t)"}),
            Slider(1.0, "2 * sin(1.3 * t)"),
            20.0,
        )
        for chart in charts
    )
    assert {"release", "go_forward", "stop_backward"} <= {*nested.transitions.edge.tolist()}
    assert {*nested.transitions.source[nested.transitions.edge == "release"].tolist()} >= {
        "closed.stuck",
        "closed.forward",
    }
    assert nested.rows.y.tobytes() == flat.rows.y.tobytes()
    assert nested.F.tobytes() == flat.F.tobytes()


def test_what_is_proved_of_the_flat_element_is_proved_of_the_composite_one() -> None:
    pytest.importorskip("z3", reason="proofs need z3")
    flat, nested = (prove(each) for each in (GMS_ELEMENT["signed"], composite().chart))
    assert not flat.refuted
    assert not nested.refuted
    assert len(nested.settled) >= len(flat.settled)


def test_charts_and_runs_keep_nested_states_in_files(tmp_path: Path) -> None:
    path = LIGHTS.save(tmp_path / "light.toml")
    assert Chart.load(path) == LIGHTS
    assert path.read_text().count("[[state.state.state]]") == 2
    for chart in (made(seed).chart for seed in range(20)):
        assert Chart.load(chart.save(tmp_path / "any.toml")) == chart
        (tmp_path / "any.toml").unlink()
    one = trace("states in states")
    for name in ("run.npz", "run.csv"):
        again = Trace.load(one.save(tmp_path / name))
        assert again.model.chart == LIGHTS
        assert again.states.tolist() == one.states.tolist()


def test_machines_spell_paths_without_dots() -> None:
    machines = ElementMachines(LIGHT)
    entered: list[str] = []
    machines.machine.on_enter_on__red(lambda event: entered.append(event.model.state))
    simulate(LIGHT, Prescribed("0"), 1.0, engine=machines)
    assert entered == ["on__red"]
    assert str(machines.elements[0].state) == "on__red"


# --------------------------------------------------------------------------- sessions
def test_breakpoints_conditions_and_pokes_take_composite_states() -> None:
    session = Session(LIGHT, Prescribed("0"), 6.0)
    session.break_on("enter", "on")
    session.break_on("leave", "on.go")
    stops = []
    while (stop := session.proceed())[1] is not None:
        stops.append((round(float(stop[0].t), 9), stop[1].name))
    assert stops[:4] == [(0.3, "on"), (0.75, "on.go"), (1.59, "on.go"), (2.1, "on")]
    found = Session(LIGHT, Prescribed("0"), 6.0)
    found.until("state(1) == on.go and t > 1")
    assert float(found.here.t) == pytest.approx(1.14, abs=1e-9)
    found.poke(state={0: "on.red"})
    assert str(found.here.states[0]) == "on.red"


def test_supervisors_see_composite_states() -> None:
    """The watch is on just while the light is green or amber."""
    watch = Chart(
        "watch",
        velocities=(),
        inputs=("b",),
        states=(State("off"), State("on")),
        transitions=(
            Transition("begins", "off", "on", "b > 0.5"),
            Transition("ends", "on", "off", "b < 0.5"),
        ),
        outputs={"u": "b"},
    )
    seen = Supervisor("watch", watch, {}, inputs={"b": "is_in(pad.on.go)"})
    body, pad = Body("body", velocity="0 * t"), Contact("pad", LIGHT)
    one = simulate(System("seen", bodies=(body,), contacts=(pad,), supervisors=(seen,)), 3.0)
    log = one.transitions
    own = log[log.contact == "watch"]
    assert own.edge.tolist() == ["begins", "ends"] * 3
    assert own.t.tolist() == pytest.approx([0.3, 0.75, 1.14, 1.59, 2.49, 2.94])


def test_a_state_is_named_with_those_around_it() -> None:
    with pytest.raises(ChartError, match=r"'red' is not a state; states: 'off', 'on', 'on\.red'"):
        Chart(
            "c",
            states=LIGHTS.nesting.states,
            variables=LIGHTS.variables[:2],
            transitions=(Transition("go", "red", "off", "v > 0"),),
        )
