"""The plan of a program: what is computed where, and from what, before any text is written.

`plan_of` derives it from the chart, the shape of the model and the rig; it contains no parameter
values. Printers write it as text (`gms_fsm.lowering._python`) and make no further decisions.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from gms_fsm.charts.chart import Chart
from gms_fsm.language import (
    Call,
    Comparison,
    Condition,
    Name,
    Negative,
    Number,
    Value,
    comparisons,
    derivative,
    names_in,
    parse_value,
    renamed,
    rough_points,
    split,
    substitute,
    turning_inside,
)
from gms_fsm.language._functions import ROUGH
from gms_fsm.lowering._names import DIP, Names, names_of
from gms_fsm.lowering.layout import Layout, Places
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Corners, Formula, Signal

__all__ = ["Edge", "Flow", "Gradient", "Input", "Plan", "RoughCall", "StateFlow"]
__all__ += ["both_sides", "plan_of"]


@dataclass(frozen=True)
class RoughCall:
    """A call with a corner or a jump, computed before the expression that contains it.

    Parameters
    ----------
    name : str
        The name of its value.
    call : Call
        The call; its arguments may refer to other rough calls.
    turning : Value
        The value whose sign selects the branch.
    """

    name: str
    call: Call
    turning: Value


@dataclass(frozen=True)
class StateFlow:
    """The computations for an element in one state.

    Parameters
    ----------
    state : str
        The state.
    calls : tuple of RoughCall
        The element's own calls, in order of computation.
    rates : mapping of str to Value
        The rate of each variable, without rough calls.
    force : Value or None
        F_i if it depends on the state, without rough calls.
    """

    state: str
    calls: tuple[RoughCall, ...]
    rates: Mapping[str, Value]
    force: Value | None


@dataclass(frozen=True)
class Flow:
    """The computation of all rates and forces.

    Parameters
    ----------
    calls : tuple of RoughCall
        Those shared by all elements, in order of computation.
    states : tuple of StateFlow
        One for each state.
    force : Value or None
        F_i if it is the same text in all states; None also if no force is needed.
    acceleration : Value or None
        dv/dt, without rough calls; None if v is prescribed or dv/dt is not needed.
    """

    calls: tuple[RoughCall, ...]
    states: tuple[StateFlow, ...]
    force: Value | None
    acceleration: Value | None

    @property
    def by_state(self) -> bool:
        """Whether the force is computed separately for each state."""
        return any(each.force is not None for each in self.states)


@dataclass(frozen=True)
class Edge:
    """An edge of the chart.

    Parameters
    ----------
    name, source, target : str
        As in the chart.
    guard : Condition
        The condition for taking the edge.
    steps : tuple of (str, Value)
        The assignments to variables, in order of computation.
    """

    name: str
    source: str
    target: str
    guard: Condition
    steps: tuple[tuple[str, Value], ...]


@dataclass(frozen=True)
class Gradient:
    """The derivatives of a surface's defining value, where they are not identically zero.

    Parameters
    ----------
    surface : Value
        The value that is zero on the surface.
    by_state : mapping of str to Value
        With respect to x and to the chart's variables.
    by_v, by_s, by_t : Value or None
        With respect to velocity, threshold and time.
    by_signal : mapping of str to Value
        With respect to the rig's signals.
    """

    surface: Value
    by_state: Mapping[str, Value]
    by_v: Value | None
    by_s: Value | None
    by_t: Value | None
    by_signal: Mapping[str, Value]

    @property
    def by_speed(self) -> bool:
        """Whether the value depends on the velocity in any way."""
        return self.by_v is not None or self.by_s is not None


@dataclass(frozen=True)
class Input:
    """A signal: a formula, a table of corners, or a Python function.

    Parameters
    ----------
    name : str
        As in the rig.
    calls : tuple of RoughCall
        Those in the formula, in order of computation.
    formula : Value or None
        Without rough calls.
    slope : Value or None
        Derivative of the formula with respect to t, if it has one.
    tabled : bool
        Whether it is a table of corners.
    """

    name: str
    calls: tuple[RoughCall, ...] = ()
    formula: Value | None = None
    slope: Value | None = None
    tabled: bool = False


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything that a program computes.

    Parameters
    ----------
    title : str
        Chart and rig, for the heading.
    names : Names
        The names used in the text.
    layout : Layout
        The layout of all arrays.
    tables : Places
        Places of the times and the values of each table of corners.
    curve : Value or None
        The Stribeck curve S(v).
    curve_slope : Value or None
        Its derivative with respect to v.
    threshold : bool
        Whether the chart uses s.
    inputs : tuple of Input
        The signals, in the rig's order.
    edges : tuple of Edge
        In the chart's order.
    held : Places
        The values whose signs are frozen.
    surfaces : Places
        Those of them on which the motion can slide.
    relations : Places
        The comparisons that may be watched.
    always : tuple of Comparison
        Those watched in every state.
    rough : mapping of str to tuple of Value
        By state, the values whose signs select corners and jumps there.
    flow : Flow
        For the rates dy/dt.
    observed : Flow
        For the observed quantities.
    gradients : tuple of Gradient
        One for each entry of `surfaces`, in the same order.
    """

    title: str
    names: Names
    layout: Layout
    tables: Places[tuple[str, str]]
    curve: Value | None
    curve_slope: Value | None
    threshold: bool
    inputs: tuple[Input, ...]
    edges: tuple[Edge, ...]
    held: Places[Value]
    surfaces: Places[Value]
    relations: Places[Comparison]
    always: tuple[Comparison, ...]
    rough: Mapping[str, tuple[Value, ...]]
    flow: Flow
    observed: Flow
    gradients: tuple[Gradient, ...]

    @property
    def prescribed(self) -> bool:
        """Whether the velocity is prescribed."""
        return "v" not in self.layout.y.shared

    @property
    def variables(self) -> tuple[str, ...]:
        """The chart's variables."""
        return self.layout.y.own

    def leaving(self, state: str) -> tuple[Edge, ...]:
        """Return the edges that leave a state, highest priority first."""
        return tuple(edge for edge in self.edges if edge.source == state)


def plan_of(model: Model, rig: Rig) -> Plan:
    """Plan the program of a model on a rig.

    Parameters
    ----------
    model, rig
        The model and the rig; only the shapes of their numbers matter.

    Returns
    -------
    Plan
        Input for a printer.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> plan = plan_of(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.1*t"))
    >>> plan.held.shared, [edge.name for edge in plan.leaving("slip")]
    ((Name(id='v'),), ['arrest'])
    """
    chart = model.chart
    curve = None
    if model.stribeck is not None:
        curve = parse_value(model.stribeck.text, ["F_c", "F_s", "v_s", "v"])
    names = names_of(model, rig)
    acceleration = _acceleration(rig, names)
    forces = {state.name: _force(chart, state.name) for state in chart.states}
    rig_rough = _rig_rough(rig, acceleration)
    rough = {state: _rough(chart, state, force) for state, force in forces.items()}
    found = [*rig_rough, *(u for each in rough.values() for u in each)]
    held = _partitioned(found, names, model.n)
    surfaces = Places(
        tuple(u for u in held.shared if _can_be_slid_on(u, chart, rig, names)),
        tuple(u for u in held.own if _can_be_slid_on(u, chart, rig, names)),
        model.n,
    )
    always = [relation for u in rig_rough for relation in both_sides(u)]
    always += _landmarks() if "s" in chart.inputs else []
    smoothing = _Smoothing(held, names)
    return Plan(
        title=f"{chart.name}, {rig.title}",
        names=names,
        layout=Layout.of(model, rig, surfaces.size),
        tables=_tables(rig.signals, model.n),
        curve=curve,
        curve_slope=None if curve is None else derivative(curve, "v"),
        threshold="s" in chart.inputs,
        inputs=tuple(_input(name, each, smoothing) for name, each in rig.signals.items()),
        edges=_edges(chart),
        held=held,
        surfaces=surfaces,
        relations=_relations(chart, held, names),
        always=tuple(dict.fromkeys(always)),
        rough=rough,
        flow=_flow(chart, forces if acceleration is not None else {}, acceleration, smoothing),
        observed=_flow(chart, forces, None, smoothing),
        gradients=tuple(_gradient(u, chart, rig, names) for u in (*surfaces.shared, *surfaces.own)),
    )


def _labels(held: Places[Value], names: Names) -> dict[Value, str]:
    """Return, for each frozen sign, the label used to name its rough calls."""
    labels: dict[Value, str] = {}
    for number, u in enumerate([*held.shared, *held.own]):
        label = u.id if isinstance(u, Name) and u.id.isidentifier() else str(number)
        while label in labels.values() or any(
            f"{function}_{label}" in names.taken for function in ROUGH
        ):
            label += "_"
        labels[u] = label
    return labels


# --------------------------------------------------------------------------- corners and jumps
class _Smoothing:
    """Replaces the rough calls in values by names."""

    def __init__(self, held: Places[Value], names: Names) -> None:
        self.held, self.labels, self.taken = held, _labels(held, names), names.taken
        self.turning = {
            f"{function}_{label}": u for u, label in self.labels.items() for function in ROUGH
        }
        self.named: dict[Call, str] = {}

    def __call__(self, value: Value) -> tuple[Value, tuple[RoughCall, ...]]:
        """Return a value with its rough calls replaced by names, and these calls in order."""
        smooth, calls = substitute(value, self.name_of)
        return smooth, tuple(
            RoughCall(name, call, self.turning[name]) for name, call in calls.items()
        )

    def name_of(self, turning: Value, call: Call) -> str | None:
        """Return the name of a rough call, or None if its sign is not frozen."""
        if turning not in self.labels:
            return None
        if call not in self.named:
            # max(v, 2) and max(v - 2, 0) turn at the same place, but are not the same.
            first = name = f"{call.function}_{self.labels[turning]}"
            number = 2
            while name in self.named.values() or (
                name != first and (name in self.taken or name in self.turning)
            ):
                name, number = f"{first}_{number}", number + 1
            self.named[call], self.turning[name] = name, turning
        return self.named[call]


def _acceleration(rig: Rig, names: Names) -> Value | None:
    if rig.acceleration is None:
        return None
    return renamed(parse_value(rig.acceleration, ["t", "x", "v", "F", *names.rig]), names.rig)


def _force(chart: Chart, state: str) -> Value:
    """Return the force in a state, with the rates in its rough calls replaced by the flows."""
    rates = {f"d{name}": chart.flows[state, name] for name in chart.variables}
    return turning_inside(chart.forces["F"], rates)


def _rig_rough(rig: Rig, acceleration: Value | None) -> tuple[Value, ...]:
    """Return the values at whose zeros the rig or a signal has a corner or a jump."""
    found: list[Value] = []
    for signal in rig.signals.values():
        if isinstance(signal, Formula):
            found += rough_points(signal.tree)
    if acceleration is not None:
        # A sign of F itself is evaluated live: F is known only together with the flow.
        found += [u for u in rough_points(acceleration) if "F" not in names_in(u)]
    return tuple(found)


def _rough(chart: Chart, state: str, force: Value) -> tuple[Value, ...]:
    """Return the values at whose zeros a flow or the force has a corner or a jump."""
    trees = [*(chart.flows[state, name] for name in chart.variables), force]
    return tuple(dict.fromkeys(u for tree in trees for u in rough_points(tree)))


def _partitioned(found: Iterable[Value], names: Names, n: int) -> Places[Value]:
    """Split values into those shared by all elements and those of one element."""
    shared = {u: names.is_shared(u) for u in found}
    return Places(
        tuple(u for u in shared if shared[u]), tuple(u for u in shared if not shared[u]), n
    )


def _can_be_slid_on(u: Value, chart: Chart, rig: Rig, names: Names) -> bool:
    """Return whether u depends on the state, and only in ways that have a derivative."""
    read, prescribed = names_in(u), rig.acceleration is None
    if "s" in read:
        read |= {"v"}
    states = {"x", *chart.variables, *([] if prescribed else ["v"])}
    signals = {name for name in rig.signals if names.rig[name].id in read}
    if prescribed and "v" in read:
        signals |= {"v"}
    return (
        bool(read & states)
        and all(derivative(u, name) is not None for name in read)
        and all(_has_slope(rig.signals[name]) for name in signals)
    )


def _has_slope(signal: Signal) -> bool:
    if isinstance(signal, Formula):
        return derivative(signal.tree, "t") is not None
    return isinstance(signal, Corners)


# --------------------------------------------------------------------------- comparisons
def both_sides(u: Value) -> tuple[Comparison, Comparison]:
    """Return the comparisons of a value with zero: strictly above it, and at or above it."""
    zero = Number(0.0)
    return Comparison(u, zero, strict=True), Comparison(u, zero, strict=False)


def _landmarks() -> list[Comparison]:
    """Return the speeds where s(v) starts to change fast: a large step could jump over the dip."""
    v, dip = Name("v"), Name(DIP)
    # Mirror images of each other, so that a mirrored run stops at mirrored points.
    return [Comparison(v, dip, strict=True), Comparison(Negative(dip), v, strict=True)]


def _relations(chart: Chart, held: Places[Value], names: Names) -> Places[Comparison]:
    """Lay out all comparisons that may be watched."""
    wanted: list[Comparison] = []
    for edge in chart.transitions:
        wanted += comparisons(split(chart.guards[edge.name]))
    for u in (*held.shared, *held.own):
        wanted += both_sides(u)
    if "s" in chart.inputs:
        wanted += _landmarks()
    found = dict.fromkeys(wanted)
    shared = {r: names.is_shared(r.left) and names.is_shared(r.right) for r in found}
    return Places(
        tuple(r for r in found if shared[r]), tuple(r for r in found if not shared[r]), held.n
    )


# --------------------------------------------------------------------------- what is computed
def _tables(signals: Mapping[str, Signal], n: int) -> Places[tuple[str, str]]:
    tabled = [name for name, signal in signals.items() if isinstance(signal, Corners)]
    return Places(tuple((name, column) for name in tabled for column in ("times", "values")), (), n)


def _input(name: str, signal: Signal, smoothing: _Smoothing) -> Input:
    if isinstance(signal, Formula):
        smooth, calls = smoothing(signal.tree)
        return Input(name, calls, smooth, derivative(signal.tree, "t"))
    return Input(name, tabled=isinstance(signal, Corners))


def _edges(chart: Chart) -> tuple[Edge, ...]:
    return tuple(
        Edge(
            name=edge.name,
            source=edge.source,
            target=edge.target,
            guard=chart.guards[edge.name],
            # Stateflow's order: exit of the source, action of the edge, entry of the target.
            steps=(
                *chart.assignments["exit", edge.source].items(),
                *chart.assignments["action", edge.name].items(),
                *chart.assignments["entry", edge.target].items(),
            ),
        )
        for edge in chart.transitions
    )


def _flow(
    chart: Chart, forces: Mapping[str, Value], acceleration: Value | None, smoothing: _Smoothing
) -> Flow:
    """Plan the rates, and the forces if there are any."""
    # With corners in it, the force differs from state to state.
    by_state = any(rough_points(force) for force in forces.values())
    shared: dict[str, RoughCall] = {}
    states = []
    for state in chart.states:
        own: dict[str, RoughCall] = {}
        trees = {name: chart.flows[state.name, name] for name in chart.variables}
        smooth = {}
        for name, tree in (trees | ({"F": forces[state.name]} if by_state else {})).items():
            smooth[name], calls = smoothing(tree)
            for call in calls:
                kept = shared if call.turning in smoothing.held.shared else own
                kept.setdefault(call.name, call)
        force = smooth.pop("F", None)
        states.append(StateFlow(state.name, tuple(own.values()), smooth, force))
    if acceleration is not None:
        acceleration, calls = smoothing(acceleration)
        shared |= {call.name: call for call in calls}
    common = chart.forces["F"] if forces and not by_state else None
    return Flow(tuple(shared.values()), tuple(states), common, acceleration)


def _gradient(u: Value, chart: Chart, rig: Rig, names: Names) -> Gradient:
    read = names_in(u)
    signals = {name: names.rig[name].id for name in rig.signals if names.rig[name].id in read}
    return Gradient(
        surface=u,
        by_state={name: _known(u, name) for name in ("x", *chart.variables) if name in read},
        by_v=_known(u, "v") if "v" in read else None,
        by_s=_known(u, "s") if "s" in read else None,
        by_t=_known(u, "t") if "t" in read else None,
        by_signal={name: _known(u, apart) for name, apart in signals.items()},
    )


def _known(value: Value, name: str) -> Value:
    """Return a derivative that is known to exist: surfaces without one cannot be slid on."""
    found = derivative(value, name)
    assert found is not None
    return found
