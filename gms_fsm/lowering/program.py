"""The generated program: a chart on a rig, lowered to if-else text to read and step through.

This is the paper's Fig. 2c derived from its Fig. 2b: one reader of the chart, with no rules of its
own. The text contains no values chosen by the user; parameters arrive as arguments, so that one
text serves every parameter set and every number of elements, in Python and compiled.

The functions of a program
--------------------------
``flow``       dy/dt with every state and every sign frozen (located crossings)
``flow_live``  the same with sgn, abs, min, max evaluated live (guards checked once per step)
``switch``     for each element the first edge whose guard holds, or -1; not the one in ``out`` if
               a motion can slide between two states
``act``        take an edge: its assignments and the new state
``follow``     set the velocities in y that locked contacts determine
``jolts``      store the velocities of contacts that lock, and mark those that have jumped
``observe``    v, F, and per element s, F_i, dz; signs as given or live
``normal``     the gradient of a surface that a motion can slide on (see `integrators.sliding`)
``arm``        the comparisons to watch until the next stop, and the signs to freeze
``margins``    the watched comparisons as numbers that change sign where the comparison does

How ``arm`` chooses: a guard that is false stays false as long as one false comparison in it (in
each arm, for ``or``) stays false. The first one in the text is the witness; when it turns true, the
integrator stops, evaluates the guards, and arms again. So nothing is watched that cannot change a
state: not z - s while slipping toward it, not v_c while sticking below s.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import integrators
from gms_fsm.charts.parameters import as_floats
from gms_fsm.errors import ParameterError, SignalError, shown
from gms_fsm.foundation.equality import ByIdentity
from gms_fsm.language import (
    Binary,
    Call,
    Comparison,
    Requirement,
    Value,
    names_in,
    rough_points,
    spell,
)
from gms_fsm.lowering.adapting import Adaptive, adaptive
from gms_fsm.lowering.generated import SIGNALS, CarefulText, ieee, load, quickened
from gms_fsm.lowering.layout import SystemLayout
from gms_fsm.lowering.printing.plan import Pair, ProgramPlan, both_sides, plan_of
from gms_fsm.lowering.printing.python import FUNCTIONS, python
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import mounted
from gms_fsm.systems.reading.assembly import Bank, ContactEdge
from gms_fsm.systems.reading.values import own_in, shared_in
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import (
    Corners,
    Formula,
    Function,
    Signal,
)
from gms_fsm.systems.system import System
from integrators import LIVE
from integrators.switching.jolts import CHANGES_FORCES, EVENT, IMPULSE, MOST_EVENTS, TICK
from integrators.switching.machines import Machines

Arguments = tuple[list[float], list[list[float]], list[list[float]]]


@dataclass(frozen=True, eq=False)
class Program:
    """A model on a rig as generated functions and the arrays they take.

    Parameters
    ----------
    source : str
        The text of all functions.
    functions : mapping of str to callable
        By name; see the module docstring.
    ieee : mapping of str to callable
        The same functions, yielding inf and NaN where Python would raise.
    callables : mapping of str to callable
        The Python functions used as signals, by the signal's name.
    p : tuple
        (shared numbers, one list per own parameter, times and values of each corner table): an
        argument of all functions.
    layout : SystemLayout
        The layout of the state vector, of the output of ``observe`` and of the modes.
    plan : ProgramPlan
        What the text was printed from.
    held : int
        Number of frozen signs.
    strict : list of bool
        For each relation, whether its margin must be positive (or may be zero) for it to be true.
    relations : list of str
        Each relation in words, for messages.
    surfaces : integrators.Surfaces
        The surfaces on which the motion can slide.
    surface_names : list of str
        The value that is zero on each; with the states of a machine below it and above it.
    knots, jumps : list of float
        Times [s] where a signal has a corner, and where it jumps.
    ticks : integrators.Ticks
        What ticks when: the samplers, then the contacts with a period.
    discrete : list of int
        For each machine the bit of its contact if this has a period, else 0.
    kinds : list of int
        For each edge what matters to others, as bits; see `integrators.Equations`.
    events : int
        The bit of a tick that forgets events; 0 if there are none.
    lasting : int
        The bit of a tick that ends the times of conditions that have ceased; 0 if there are none.
    velocities : int
        Number of velocities that locks may hold or impulses set; 0 if nothing locks.
    leaps : bool
        Whether a given velocity among these may jump at a crossing.
    """

    source: str
    functions: Mapping[str, Callable[..., Any]]
    ieee: Mapping[str, Callable[..., Any]]
    callables: Mapping[str, Callable[[float], float]]
    p: Arguments
    layout: SystemLayout
    plan: ProgramPlan = field(repr=False)
    held: int
    strict: list[bool]
    relations: list[str]
    surfaces: integrators.Surfaces
    surface_names: list[str]
    knots: list[float]
    jumps: list[float]
    discrete: list[int]
    kinds: list[int]
    velocities: int
    leaps: bool
    events: int = 0
    lasting: int = 0
    ticks: integrators.Ticks = field(default_factory=integrators.Ticks.none)

    @property
    def calm(self) -> list[int]:
        """The argument that says that no velocity has jumped."""
        return [0] * self.layout.n

    @property
    def adaptive(self) -> Adaptive:
        """The functions of what follows from the numbers."""
        return _adaptive(*map(ByIdentity, (self.plan, self.ieee, self.callables)))

    @property
    def live(self) -> list[float]:
        """The argument that makes every sign be evaluated live."""
        return [LIVE] * self.held


def lower(system: System | Model, rig: Rig | None = None) -> Program:
    """Generate the program of a system, or of a model on a rig.

    Parameters
    ----------
    system : System or Model
        What runs.
    rig : Rig, optional
        The rig that a model is mounted on.

    Returns
    -------
    Program
        Text, functions and arrays.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> program = lower(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.1*t"))
    >>> "if z >= s and v > v_c:" in program.source
    True
    """
    system = mounted(system, rig).system
    refuse_functions(system)
    if system.open:
        raise ParameterError(
            f"its inputs {', '.join(system.open)} are not given",
            place=f"system {system.name!r}",
            advice=f"simulate(system, t_end, inputs={{{system.open[0]!r}: ...}}), or "
            "system.with_inputs(...); SystemState takes them sample by sample",
        )
    shape = _ProgramShape(structure(system), system)
    corners = [s for s in system.signals.values() if isinstance(s, Corners)]
    return dataclasses.replace(
        _lowered(shape),
        p=arguments(system),
        knots=sorted({float(t) for s in corners for t in s.times}),
        jumps=sorted({float(t) for s in corners for t in s.jumps}),
    )


def refuse_functions(model_or_system: object) -> None:
    """Refuse controllers that are Python functions; models have none."""
    for sampler in getattr(model_or_system, "controllers", ()):
        raise ParameterError(
            "it is a Python function, which cannot be written as text",
            place=f"sampled {sampler.name!r}",
            advice="write its updates as texts; simulate and Session call it as it is",
        )


def structure(system: System) -> tuple[Any, ...]:
    """Return everything that the text of a system depends on, in hashable form.

    A Stribeck exponent of 2, and a number that is 0, give another text than others.
    """
    spelled = tuple(map(_spelling, system.signals.values()))
    # A ratio that is 1 or 0 is left out of no text; an inertia that is not positive is refused.
    zeros = tuple([name for name, value in system.numbers.items() if value == 0.0])
    sizes = tuple([contact.n for contact in system.machines])
    return id(system.shape), sizes, spelled, zeros


def _spelling(signal: Signal | str) -> str | int | None:
    """Return the part of a signal that the text depends on, in hashable form.

    Callables are identified by `id`, which stays valid because the cache keeps the system alive:
    callables that compare equal need not return the same, and some cannot be hashed.
    """
    match signal:
        case str():
            return f"numbers {signal}"
        case Formula(text=text):
            return text
        case Function(call=call):
            return id(call)
    return None


@dataclass(frozen=True)
class _ProgramShape:
    """Everything that the text depends on, with a system of that shape."""

    key: tuple[Any, ...]
    system: System = field(compare=False)


@functools.lru_cache(maxsize=64)
def _lowered(shape: _ProgramShape) -> Program:
    """Generate the text for all systems of one shape, without their numbers."""
    system = shape.system
    plan = plan_of(system.assembly)
    source = python(plan)
    callables = {
        name: signal.call for name, signal in system.signals.items() if isinstance(signal, Function)
    }
    names = _names(callables)
    namespace = quickened(load(plan.title, source, names))
    careful = CarefulText(plan.title, source, names)
    return Program(
        source=source,
        functions={name: namespace[name] for name in FUNCTIONS},
        ieee={name: ieee(namespace[name], careful[name]) for name in FUNCTIONS},
        callables=callables,
        p=([], [], []),
        layout=plan.layout,
        plan=plan,
        held=plan.held.size,
        strict=[relation.strict for relation, _ in plan.relations],
        relations=_relation_names(plan),
        surfaces=_surface_table(plan),
        surface_names=_surface_names(plan),
        knots=[],
        jumps=[],
        events=plan.read.events_bit,
        lasting=plan.read.lasting_bit,
        discrete=[bit for bank in plan.read.banks for bit in [plan.read.bit(bank)] * bank.n],
        **_jolts(plan),
    )


@functools.lru_cache(maxsize=64)
def _adaptive(
    plan: ByIdentity[ProgramPlan],
    functions: ByIdentity[Mapping[str, Callable[..., Any]]],
    callables: ByIdentity[Mapping[str, Callable[[float], float]]],
) -> Adaptive:
    return adaptive(plan.it, {**functions.it, **_names(callables.it)})


def _names(callables: Mapping[str, Callable[[float], float]]) -> dict[str, Any]:
    """Return what the text calls for the values of signals."""
    signals = {f"{name}_signal": guarded(name, call) for name, call in callables.items()}
    return {**SIGNALS, **signals}


def _jolts(plan: ProgramPlan) -> dict[str, Any]:
    """Return what a run has to know about impulses, and about velocities that jump."""
    read = plan.read
    events = read.system.events
    if len(events) > MOST_EVENTS:
        raise ParameterError(
            f"its charts wait for {len(events)} events",
            place=f"system {read.system.name!r}",
            advice=f"at most {MOST_EVENTS} are told apart; let edges read a number instead",
        )
    kinds = [_kind(events, bank, edge) for bank in read.banks for edge in bank.edges]
    held = [bank for bank in read.banks if bank.chart.locks or bank.chart.sets_velocity]
    velocities = [name for bank in held for name in bank.velocities]
    if not any(bank.chart.locks for bank in held):
        velocities = []
    given = {body.v for body in read.system.bodies if body.driven}
    behind = read.closure(read.closure(velocities) & given)
    trees = [read.defined[name].tree for name in behind if name in read.defined]
    return {
        "kinds": kinds if any(kinds) else [],
        "velocities": len(velocities),
        "leaps": any(tree is not None and bool([*rough_points(tree)]) for tree in trees),
    }


def _kind(events: Sequence[str], bank: Bank, edge: ContactEdge) -> int:
    """Return what matters to others about an edge, as bits."""
    kind = TICK if bank.periodic else 0
    if bank.is_impulse(edge):
        kind |= IMPULSE
    elif edge.source in bank.locked and not edge.locks:
        kind |= CHANGES_FORCES
    for k, event in enumerate(events):
        if event in names_in(edge.guard):
            kind |= EVENT << k
    return kind


def arguments(system: System) -> Arguments:
    """Return the numbers of a system in the form that its program's functions take."""
    tables = [
        as_floats(column)
        for s in system.signals.values()
        if isinstance(s, Corners)
        for column in (s.times, s.values)
    ]
    shared = [value for _, _, value in shared_in(system)]
    return shared, [as_floats(values) for _, _, values in own_in(system)], tables


def machines_of(functions: Mapping[str, Any]) -> Machines:
    """Return the machines of a program as functions, in one of their forms."""
    names = "switch", "act", "tick", "jolts", "observe"
    return Machines(*(functions[name] for name in names))


def equations(program: Program) -> integrators.Equations:
    """Return a program in the form that the integrators take."""
    functions = program.ieee
    return integrators.Equations(
        flow=functions["flow"],
        flow_live=functions["flow_live"],
        arm=functions["arm"],
        margins=functions["margins"],
        normal=functions["normal"],
        p=program.p,
        held=program.held,
        strict=program.strict,
        relations=program.relations,
        surfaces=program.surfaces,
        knots=program.knots,
        jumps=program.jumps,
        ticks=program.ticks,
        discrete=program.discrete,
        seen=program.layout.observed.size,
        follow=functions["follow"],
        kinds=program.kinds,
        velocities=program.velocities,
        leaps=program.leaps,
        events=program.events,
        lasting=program.lasting,
    )


def guarded(name: str, call: Callable[[float], float]) -> Callable[[float], float]:
    """Return a signal's function with errors that name the signal.

    Examples
    --------
    >>> guarded("v", lambda t: 1 / t)(0.0)
    Traceback (most recent call last):
    gms_fsm.errors.SignalError: signal 'v': the function raised ZeroDivisionError at t = 0.0 s: ...
    """

    def sampled(t: float) -> float:
        try:
            given = call(t)
        except Exception as error:
            raise SignalError(
                f"signal {name!r}: the function raised {type(error).__name__} at t = {t!r} s: "
                f"{error}"
            ) from error
        try:
            return float(given)
        except (TypeError, ValueError, OverflowError):
            raise SignalError(
                f"signal {name!r}: the function returned {shown(given)} at t = {t!r} s",
                advice="it must return one number",
            ) from None

    return sampled


# --------------------------------------------------------------------------- from the plan
def _relation_names(plan: ProgramPlan) -> list[str]:
    """Return each relation in words."""
    return [
        _in_words(relation, plan) + _of_element(plan, Binary("-", relation.left, relation.right), i)
        for relation, i in plan.relations
    ]


def _in_words(relation: Comparison, plan: ProgramPlan) -> str:
    if isinstance(relation.left, Call) and relation.left.function == "tooth":
        return f"{_zero_in_words(relation.left, plan)} = 0"
    return spell(Requirement(relation, True).relation, rename=plan.names.plain)


def _zero_in_words(u: Value, plan: ProgramPlan) -> str:
    match u:
        case Call("tooth", (inside,)):  # not a word of the language
            return f"mod({spell(inside, rename=plan.names.plain)}, 1)"
    return spell(u, rename=plan.names.plain)


def _surface_names(plan: ProgramPlan) -> list[str]:
    """Return the value that is zero on each surface, in words."""
    return [
        _zero_in_words(u, plan) + _of_element(plan, u, i)
        if not isinstance(u, Pair)
        else f"{spell(u.value, rename=plan.names.plain)} ({u.lower}, {u.upper})"
        + _of_contact(plan, u.bank, i)
        for u, i in plan.surfaces
    ]


def _of_element(plan: ProgramPlan, tree: Value, element: int | None) -> str:
    """Name an element, counted from 1 in texts; nothing where there is only one value."""
    bank = plan.read.bank_of(tree)
    return "" if bank is None else _of_contact(plan, bank, element)


def _of_contact(plan: ProgramPlan, bank: int, element: int | None) -> str:
    """Name an element of a contact."""
    if element is None:
        return ""
    whose = "" if len(plan.banks) == 1 else f" of {plan.banks[bank].bank.name}"
    return f" of element {element + 1}{whose}"


def _surface_table(plan: ProgramPlan) -> integrators.Surfaces:
    """Return the places of the surfaces' signs and relations, or of their machines."""
    table = integrators.Surfaces([], [], [], [], [], [], [], [])
    for u, i in plan.surfaces:
        if not isinstance(u, Pair):
            above, at_least = both_sides(u)
            sign, machine = plan.held.index(u, i or 0), [-1, 0, 0, -1, -1]
        else:
            (above, at_least), sign = (u.relation, u.back), -1
            places, bank = plan.layout.banks[u.bank], plan.banks[u.bank].bank
            edges = [edge.name for edge in bank.edges]
            machine = [
                places.first + (i or 0),
                *(bank.states.index(state) for state in (u.upper, u.lower)),
                *(places.first_edge + edges.index(edge) for edge in (u.rise, u.fall)),
            ]
        relations = (plan.relations.index(each, i or 0) for each in (above, at_least))
        for column, value in zip(table, (sign, *relations, *machine), strict=True):
            column.append(value)
    if all(machine < 0 for machine in table.machine):
        return table._replace(upper=[], lower=[], rise=[], fall=[])
    return table
