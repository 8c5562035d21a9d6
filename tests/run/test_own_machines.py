"""A user's own machines: callbacks look on, and the chart remains the only source of switching.

That every firing calls them once, with the same values in both engines, is in
tests/laws/test_own_machines_see_every_firing.py.
"""

from __future__ import annotations

import copy
import functools
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest
from transitions import Machine
from transitions.extensions import (
    GraphMachine,
    HierarchicalGraphMachine,
    HierarchicalMachine,
    LockedMachine,
)
from transitions.extensions.asyncio import AsyncMachine
from transitions.extensions.markup import MarkupMachine

from gms_fsm import (
    Chart,
    ChartModel,
    Element,
    ElementMachines,
    ParameterError,
    Prescribed,
    State,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.errors import ChartError
from gms_fsm.language import parse_condition
from gms_fsm.run.machines import Guard
from gms_fsm.traces.failures import CallbackError, LivelockError
from tests.corpus import ENGINES, ORDER, run
from tests.helpers import open_loop, other_parts, pulled_mass, stick_slip
from tests.laws.test_own_machines_see_every_firing import watched
from tests.systems_cases import servo, two_blocks

MODEL = stick_slip("signed")
called = pytest.mark.parametrize("engine", sorted({*ENGINES} - {"ifelse"}))
STARTED = {"states": ["stick", "slip", "slip", "stick"], "z": [0.0, 0.1, 0.2, 0.3]}


def ran(machines: ElementMachines, engine: str = "machines", **options: Any) -> Trace:
    """Run the open loop with machines of one's own: 16 firings in 20 s."""
    return simulate(MODEL, open_loop(), 20.0, engine=engine, machines=machines, **options)


# --------------------------------------------------------------------------- elements and guards
def test_an_element_has_its_index_and_its_parameters_as_floats() -> None:
    elements = ElementMachines(MODEL).elements
    assert [e.index for e in elements] == [0, 1, 2, 3]
    assert [e.k for e in elements] == MODEL.parameters.k.tolist()  # type: ignore[attr-defined]
    assert {type(e.k) for e in elements} == {float} == {type(elements[0].v_c)}  # type: ignore[attr-defined]


def test_a_guard_shows_its_text_and_accepts_an_event_or_an_element() -> None:
    guard = Guard("leave", parse_condition("z >= s", "zs"))
    assert repr(guard) == "<guard z >= s>"
    for z, truth in ((0.9, False), (1.0, True)):
        element = Element()
        element.z, element.s = z, 1.0
        assert guard.holds(element) is guard(SimpleNamespace(model=element)) is truth


def test_an_element_shows_the_values_of_the_moment() -> None:
    """x is that of the row, v, s and z are those before the firing, in the log."""
    seen: list[tuple[Any, ...]] = []

    class Looking(Element):
        def on_enter_slip(self, event: Any) -> None:
            assert event.model is self
            seen.append((self.t, self.v, self.s, self.z, self.index, self.x))

    model, rig = pulled_mass()
    trace = simulate(model, rig, 20.0, engine=ElementMachines(model, Looking))
    log = trace.transitions[trace.transitions.target == "slip"]
    assert {index for *_, index, _ in seen} == {0, 1, 2, 3}
    for (*scene, x), row in zip(seen, log, strict=True):
        assert scene == [row.t, row.v, row.s, row.z, row.element]
        assert x == trace.x[trace.t == row.t][0]


@called
def test_the_second_firing_at_one_time_sees_what_the_first_assigned(engine: str) -> None:
    states = tuple(State(name, {"z": "0"}) for name in "abc")
    one = Transition("one", "a", "b", "t >= 1", actions={"z": "10 * z"})
    chart = Chart(
        "chain", ("t",), ("z",), (), states, (one, Transition("two", "b", "c", "z > 5")), {"F": "z"}
    )
    model, calls = ChartModel(chart, {}, n=3), list[tuple[Any, ...]]()
    machines = watched(model, calls)
    how = {"initial": {"z": [1.0, 0.1, 2.0]}, "engine": engine, "machines": machines}
    simulate(model, Prescribed("0"), 2.0, **how)
    exits = [(call[2], call[3], float(call[9])) for call in calls if call[0] == "on_exit"]
    assert exits == [
        ("one", 0, 1.0), ("one", 1, 0.1), ("one", 2, 2.0), ("two", 0, 10.0), ("two", 2, 20.0),
    ]  # fmt: skip
    assert [e.state for e in machines.elements] == ["c", "b", "c"]


@called
def test_all_variables_are_shown(engine: str) -> None:
    model, calls = ChartModel(ORDER, {}, n=2), list[tuple[Any, ...]]()
    how = {"initial": {"z": [2.0, 3.0], "w": [4.0, 5.0]}, "engine": engine}
    simulate(model, Prescribed("0"), 2.0, machines=watched(model, calls), **how)
    before = [call[-2:] for call in calls if call[0] == "before_state_change"]
    assert before == [("2.0", "4.0"), ("3.0", "5.0")]


@pytest.mark.slow
@called
def test_more_firings_than_the_columns_hold_at_first(engine: str) -> None:
    model, calls = pulled_mass()[0], list[tuple[Any, ...]]()
    machines = watched(model, calls)
    trace = simulate(model, Prescribed("0.3*sin(20*t)"), 25.0, engine=engine, machines=machines)
    assert len(calls) == 6 * len(trace.transitions) > 6 * 512


def test_what_a_guard_reads_is_set_or_shown_by_a_run() -> None:
    machines = ElementMachines(MODEL)
    element: Any = machines.elements[1]
    with pytest.raises(AttributeError, match=r"element 2 has no 'z' before a run: run first"):
        element.may_break_away_forward()
    with pytest.raises(AttributeError, match="'Element' object has no attribute 'y'"):
        _ = element.y
    for z, truth in ((0.9, False), (1.0, True)):
        element.z, element.s, element.v = z, 1.0, 0.1
        assert element.may_break_away_forward() is truth
    ran(machines)
    assert element.may_break_away_forward() is False


class Slipping(Element):
    """An element that counts its slips; a class that can be pickled."""

    slips = 0

    def on_enter_slip(self, event: Any) -> None:
        self.slips += 1


@called
@pytest.mark.parametrize("first", [0.0, 7.0])
@pytest.mark.parametrize("again", [copy.deepcopy, lambda it: pickle.loads(pickle.dumps(it))])
def test_a_copy_is_a_machine_of_its_own(engine: str, first: float, again: Any) -> None:
    machines = ElementMachines(MODEL, Slipping)
    if first:
        simulate(MODEL, open_loop(), first, engine=engine, machines=machines)
    before = [(each.state, each.slips) for each in machines.elements]  # type: ignore[attr-defined]
    other = again(machines)
    assert other_parts(ran(other, engine), ran(ElementMachines(MODEL))) == []
    assert [(each.state, each.slips) for each in machines.elements] == before  # type: ignore[attr-defined]
    pairs = zip(other.elements, before, strict=True)
    assert [each.slips - earlier for each, (_, earlier) in pairs] == [2] * 4


# --------------------------------------------------------------------------- other machines
QUEUED = functools.partial(Machine, queued=True)
DRAWN = functools.partial(GraphMachine, graph_engine="mermaid", show_conditions=True)
OTHERS = [QUEUED, LockedMachine, MarkupMachine, DRAWN, HierarchicalMachine]


@pytest.mark.parametrize("kind", OTHERS, ids=str)
def test_any_class_of_machines_sees_the_same_firings(kind: Any) -> None:
    seen: list[list[tuple[Any, ...]]] = []
    for each in (Machine, kind):
        machines = ElementMachines(MODEL, machine=each)
        calls: list[tuple[Any, ...]] = []
        machines.machine.after_state_change = [
            lambda event, calls=calls: calls.append((event.model.t, event.event.name))
        ]
        simulate(MODEL, Prescribed("0.2"), 3.0, engine=machines)
        assert [element.state for element in machines.elements] == ["slip"] * 4
        seen.append(calls)
    assert seen[0] == seen[1] != []


@pytest.mark.parametrize(
    "kind", [DRAWN, functools.partial(HierarchicalGraphMachine, **DRAWN.keywords)]
)
def test_the_graph_of_an_element_shows_guards_and_its_state(kind: Any) -> None:
    machines = ElementMachines(MODEL, machine=kind)
    simulate(MODEL, Prescribed("0.1"), 0.5, engine=machines, initial=STARTED)
    graphs = [element.get_graph().source for element in machines.elements]  # type: ignore[attr-defined]
    assert all("abs(v) <= v_c and abs(z) < s" in graph for graph in graphs)
    active = [[name for name in ("stick", "slip") if f"Class {name} s_active" in g] for g in graphs]
    assert active == [[each] for each in STARTED["states"]]


@called
def test_a_queue_hides_no_interference(engine: str) -> None:
    machines = ElementMachines(MODEL, machine=QUEUED)
    machines.machine.prepare_event = [lambda event: setattr(event.model, "v", 0.0)]
    with pytest.raises(CallbackError, match="a callback set v of element 1"):
        ran(machines, engine)
    machines = ElementMachines(
        MODEL, machine=functools.partial(QUEUED, ignore_invalid_triggers=True)
    )
    with pytest.raises(CallbackError, match="a callback changed the element's values before"):
        ran(machines, progress=lambda _: setattr(machines.elements[0], "state", "slip"))
    machines = ElementMachines(MODEL, machine=QUEUED)
    machines.machine.on_enter_slip(lambda event: event.model.break_away_forward())
    with pytest.raises(CallbackError, match="a callback changed a state"):
        ran(machines, engine)


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        (AsyncMachine, "the triggers of an AsyncMachine are awaited"),
        (list, "a class of the package transitions"),
        (functools.partial(Machine, model_attribute="mode"), "the state of an element in 'mode'"),
    ],
)
def test_what_is_no_machine_of_this_kind_is_refused(kind: Any, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        ElementMachines(MODEL, machine=kind)


# --------------------------------------------------------------------------- callbacks
@called
def test_the_order_at_one_firing_is_that_of_transitions(engine: str) -> None:
    machines, order = ElementMachines(MODEL), list[tuple[str, str]]()
    note = order.append
    for edge in machines.machine.get_transitions():
        for kind in ("prepare", "before", "after"):
            edge.add_callback(kind, lambda event, kind=kind: note((kind, event.model.state)))
    for state in ("stick", "slip"):
        for kind in ("exit", "enter"):
            register = getattr(machines.machine, f"on_{kind}_{state}")
            register(lambda event, kind=kind: note((kind, event.model.state)))
    simulate(MODEL, Prescribed("0.2"), 3.0, engine=engine, machines=machines)
    one = [("prepare", "stick"), ("before", "stick"), ("exit", "stick"), ("enter", "slip")]
    assert order == [*one, ("after", "slip")] * 4


@called
@pytest.mark.parametrize("place", ["prepare", "before", "after"])
def test_callbacks_of_an_edge_run_only_when_it_fires(engine: str, place: str) -> None:
    machines, times = ElementMachines(MODEL), list[float]()
    (edge,) = machines.machine.get_transitions("arrest", "slip", "stick")
    edge.add_callback(place, lambda event: times.append(event.model.t))
    log = ran(machines, engine).transitions
    assert times == log.t[log.edge == "arrest"].tolist() != []


@called
def test_elements_keep_what_their_class_adds(engine: str) -> None:
    @dataclass(eq=False)
    class Counting(Element):
        hits: int = 0
        k: float = -1.0  # a parameter's name: the model decides

        def on_enter_slip(self, event: Any) -> None:
            self.hits += 1

        def on_exit_slip(self, event: Any) -> None:
            self.hits += 100

    machines = ElementMachines(MODEL, Counting)
    assert other_parts(ran(machines, engine), ran(ElementMachines(MODEL))) == []
    assert [element.hits for element in machines.elements] == [202] * 4  # type: ignore[attr-defined]
    assert [e.k for e in machines.elements] == MODEL.parameters.k.tolist()  # type: ignore[attr-defined]


@called
def test_machines_start_again_in_the_states_that_are_given(engine: str) -> None:
    calls: list[tuple[Any, ...]] = []
    machines = watched(MODEL, calls)
    for t_end in (7.0, 3.0):
        trace = simulate(MODEL, open_loop(), t_end, engine=engine, machines=machines)
        assert [e.state for e in machines.elements] == trace.states[-1].tolist()
    calls.clear()
    short = simulate(MODEL, Prescribed("0.1"), 0.5, engine=machines, initial=STARTED)
    assert short.states[0].tolist() == STARTED["states"]
    assert calls == [], "setting the initial state is not a firing"


@called
@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_error_in_a_callback_reaches_the_user_unchanged(
    engine: str, error: type[BaseException]
) -> None:
    machines, times = ElementMachines(MODEL), list[float]()

    def fail(event: Any) -> None:
        times.append(event.model.t)
        if len(times) == 3:
            raise error("mine")

    machines.machine.on_enter_slip(fail)
    with pytest.raises(error, match="mine") as caught:
        ran(machines, engine)
    assert type(caught.value) is error
    log = ran(ElementMachines(MODEL), engine).transitions
    assert len(log) == 16, "the next run is not disturbed"
    assert times == log.t[log.target == "slip"][:3].tolist()


def test_callbacks_run_up_to_a_livelock_too() -> None:
    (model, rig), seen = run("livelock").subject, []
    for engine in sorted({*ENGINES} - {"ifelse"}):
        calls: list[tuple[Any, ...]] = []
        machines = watched(model, calls)
        with pytest.raises(LivelockError) as caught:
            simulate(model, rig, 20.0, engine=engine, machines=machines)
        assert len(calls) == 6 * len(caught.value.trace.transitions) == 600
        seen.append((calls, str(caught.value), [e.state for e in machines.elements]))
    assert all(each == seen[0] for each in seen)


# --------------------------------------------------------------------------- they only look
@called
@pytest.mark.parametrize("name", ["k", "v_c", "index"])
def test_parameters_of_an_element_are_read_only(engine: str, name: str) -> None:
    machines = ElementMachines(MODEL)
    before = getattr(machines.elements[0], name)
    machines.machine.on_enter_slip(lambda event: setattr(event.model, name, 0.5))
    said = rf"element 1: {name} is set to 0.5, .* read-only.*with_values.*variable of the chart"
    with pytest.raises(ParameterError, match=said):
        ran(machines, engine)
    with pytest.raises(ParameterError, match=f"element 2: {name} is set to 1"):
        setattr(machines.elements[1], name, 1.0)  # before a run, too
    assert getattr(machines.elements[0], name) == before


def put(where: Callable[[Any], Any], state: str) -> Callable[[Any], None]:
    return lambda event: setattr(where(event), "state", state)


@called
@pytest.mark.parametrize(
    ("force", "said"),
    [
        (put(lambda event: event.model, "stick"), "element 1 into state 'stick', but the chart"),
        (
            put(lambda event: event.machine.models[3], "slip"),
            "element 4 into state 'slip', but the chart",
        ),
        (put(lambda event: event.model, "nowhere"), "element 1 into state 'nowhere', but the"),
        (lambda event: event.machine.set_state("stick", event.model), "in 'slip'"),
        (lambda event: event.model.break_away_forward(), "a callback changed a state .*from state"),
    ],
)
def test_a_forced_state_is_an_error_that_keeps_the_run_so_far(
    engine: str, force: Callable[[Any], None], said: str
) -> None:
    whole, machines = ran(ElementMachines(MODEL)), ElementMachines(MODEL)
    first = whole.transitions[0]
    machines.machine.on_enter_slip(force)
    with pytest.raises(CallbackError, match=said) as caught:
        ran(machines, engine)
    place = f"element 1, edge 'break_away_forward' at t = {float(first.t)!r} s"
    assert str(caught.value).startswith(place)
    trace = caught.value.trace
    assert len(trace.transitions) == 0, "the edge was not taken"
    assert trace.t.tolist() == whole.t[: len(trace)].tolist()
    assert trace.t[-1] == first.t


def test_a_state_forced_between_firings_is_detected_at_the_next_one() -> None:
    machines = ElementMachines(MODEL)
    said = r"changed a state .*break_away_forward from state slip"
    with pytest.raises(CallbackError, match=said):
        ran(machines, progress=lambda _: setattr(machines.elements[0], "state", "slip"))


@called
@pytest.mark.parametrize("place", ["prepare_event", "after_state_change"])
def test_values_of_the_run_may_not_be_set(engine: str, place: str) -> None:
    """Also not those of another element; before and after a run they are anybody's."""
    machines = ElementMachines(MODEL)
    machines.elements[3].z = 7.0
    setattr(machines.machine, place, [lambda event: setattr(machines.elements[3], "z", 1e9)])
    said = (
        r"element 1, edge 'break_away_forward' at t = .* set z of element 4 to 1000000000.0; "
        "callbacks may only read; write the assignment into the chart: actions of the edge"
    )
    with pytest.raises(CallbackError, match=said) as caught:
        ran(machines, engine)
    assert len(caught.value.trace) > 1
    machines.elements[3].z = 7.0


@called
def test_values_may_not_change_before_the_guard(engine: str) -> None:
    machines = ElementMachines(MODEL)
    machines.machine.prepare_event = [lambda event: vars(event.model).update(v=0.0)]
    said = r"element 1, edge 'break_away_forward' at t = .*changed the element's values.*only read"
    with pytest.raises(CallbackError, match=said) as caught:
        ran(machines, engine)
    assert len(caught.value.trace) > 1


# --------------------------------------------------------------------------- the chart decides
def with_condition(machine: Any, *, target: bool) -> None:
    """Give an edge a condition of one's own."""
    (edge,) = machine.get_transitions("arrest", "slip", "stick")
    edge.conditions.append(type(edge.conditions[0])(lambda event: False, target=target))


def arrest(machine: Any) -> Any:
    return machine.get_transitions("arrest", "slip")[0]


def own_guard(machine: Any) -> None:
    """Repeat an edge with its own guard."""
    guard = arrest(machine).conditions[0].func
    machine.add_transition("arrest", "slip", "stick", conditions=guard)


def leaving(machine: Any) -> Any:
    return machine.get_transitions(MODEL.chart.leaving("stick")[0][1].name, "stick")[0]


CHANGES: list[Callable[[Any], Any]] = [
    lambda machine: machine.add_transition("arrest", "slip", "stick"),
    lambda machine: machine.add_transition("arrest", "slip", "slip"),
    lambda machine: machine.add_transition("fly", "slip", "stick"),
    own_guard,
    lambda machine: machine.add_transition(
        "arrest", "stick", "stick", conditions=arrest(machine).conditions[0].func
    ),
    lambda machine: machine.remove_transition("arrest", "slip", "stick"),
    lambda machine: arrest(machine).conditions.clear(),
    lambda machine: with_condition(machine, target=True),
    lambda machine: with_condition(machine, target=False),
    lambda machine: setattr(arrest(machine), "dest", "slip"),
    lambda machine: setattr(leaving(machine), "dest", "stick"),
]


@pytest.mark.parametrize("change", CHANGES)
def test_a_machine_that_was_changed_is_refused(change: Callable[[Any], Any]) -> None:
    machines = ElementMachines(MODEL)
    assert [len(row) for row in machines.table(MODEL.chart)] == [2, 1]
    change(machines.machine)
    for engine in sorted({*ENGINES} - {"ifelse"}):
        with pytest.raises(ChartError):
            ran(machines, engine)


@pytest.mark.parametrize("engine", ["machines", "ifelse"])
@pytest.mark.parametrize("first", ["fly", "dive"])
def test_of_two_edges_enabled_at_once_the_earlier_is_taken(engine: Any, first: str) -> None:
    edges = {name: Transition(name, "stick", name + "s", "z >= 0.1") for name in ("fly", "dive")}
    states = tuple(State(name, {"z": "v"}) for name in ("stick", "flys", "dives"))
    order = edges.pop(first), *edges.values()
    model = ChartModel(Chart("forked", ("v",), ("z",), (), states, order, {"F": "z"}), {})
    log = simulate(model, Prescribed("0.2"), 1.0, engine=engine).transitions
    assert log.edge.tolist() == [first]


# --------------------------------------------------------------------------- systems
@called
def test_machines_of_one_contact_are_enough(engine: str) -> None:
    case, seen = servo(), list[str]()
    mine = ElementMachines(case.system.contact("gear"))
    mine.machine.on_enter_right(lambda event: seen.append(event.model.state))
    trace = simulate(case.system, 1.0, engine=engine, machines={"gear": mine})
    gear = trace.contact("gear").transitions
    assert seen == ["right"] * int((gear.target == "right").sum()) != []


@called
def test_a_callback_that_interferes_is_named_with_its_contact(engine: str) -> None:
    case = two_blocks()
    mine = ElementMachines(case.system.contact("pad2"))
    mine.machine.after_state_change = put(lambda event: event.model, "backward")
    said = r"contact 'pad2', element 1, edge .*: a callback put contact 'pad2', element 1 into"
    with pytest.raises(CallbackError, match=said):
        simulate(case.system, 20.0, initial=case.initial, engine=engine, machines={"pad2": mine})
