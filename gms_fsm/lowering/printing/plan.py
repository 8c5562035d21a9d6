"""The plan of a program: what is computed where, and from what, before any text is written.

`plan_of` makes it from a system that has been read; it contains no numbers of the user's. Printers
(`gms_fsm.lowering.printing.python`) only write it down and make no further decisions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

from gms_fsm.language import (
    Binary,
    Call,
    Comparison,
    Name,
    Negative,
    Number,
    Requirement,
    Value,
    comparisons,
    derivative,
    names_in,
    rough_points,
    split,
    substitute,
    turning_inside,
)
from gms_fsm.language.functions import ROUGH
from gms_fsm.language.tree import walk
from gms_fsm.lowering.layout import SystemLayout, sizes_of
from gms_fsm.lowering.places import ElementPlaces, Places
from gms_fsm.lowering.printing.names import QuantityNames, names_of
from gms_fsm.systems.reading.assembly import ONE, Assembly, Bank, of
from gms_fsm.systems.signals import Corners, Function


@dataclass(frozen=True)
class RoughCall:
    """A call with a corner or a jump, computed before the expression that contains it.

    Parameters
    ----------
    name : str
        Name of its value.
    call : Call
        The call; its arguments may name other rough calls.
    turning : Value
        The value whose sign decides.
    """

    name: str
    call: Call
    turning: Value


@dataclass(frozen=True)
class Computed:
    """A value without rough calls, and the calls to be computed before it, in order.

    Parameters
    ----------
    tree : Value
        Names stand for its rough calls.
    calls : tuple of RoughCall
        Those.
    """

    tree: Value
    calls: tuple[RoughCall, ...] = ()


@dataclass(frozen=True)
class StateFlow:
    """The rates and the forces of an element in one state.

    Parameters
    ----------
    state : str
        Its name.
    rates : mapping of str to Computed
        By variable.
    forces : mapping of str to Computed
        By force; empty where the state is locked, and where they are the same in all states.
    locked : bool
        Whether it locks the contact.
    """

    state: str
    rates: Mapping[str, Computed]
    forces: Mapping[str, Computed]
    locked: bool


@dataclass(frozen=True, eq=False)
class BankPlan:
    """What is computed for a contact.

    Parameters
    ----------
    bank : Bank
        The contact.
    states : tuple of StateFlow
        One for each state.
    common : mapping of str to Value
        Forces of an element that are the same text in all states.
    totals : mapping of str to Computed
        Forces of the contact that are not just the sum.
    moves : bool
        Whether its force acts on a free body.
    """

    bank: Bank
    states: tuple[StateFlow, ...]
    common: Mapping[str, Value]
    totals: Mapping[str, Computed]
    moves: bool


@dataclass(frozen=True)
class Pair:
    """Two edges of a chart, there and back, whose guards are the two sides of one surface.

    Parameters
    ----------
    bank : int
        The contact.
    relation, back : Comparison
        Of the edge there, and of the edge back. The margin of the first is zero on the surface.
    upper, lower : str
        The states where that margin is positive, and negative.
    rise, fall : str
        The edges from the lower state to the upper one, and back.
    """

    bank: int
    relation: Comparison
    back: Comparison
    upper: str
    lower: str
    rise: str
    fall: str

    @property
    def value(self) -> Value:
        """The value that is zero on the surface."""
        left, right = self.relation.left, self.relation.right
        return left if right == Number(0.0) else Binary("-", left, right)


@dataclass(frozen=True)
class Gradient:
    """The nonzero derivatives of the value that is zero on a surface.

    Parameters
    ----------
    surface : Value or Pair
        The value, or the two edges that meet where it is zero.
    value : Value
        The value.
    by_state : mapping of str to Value
        With respect to components of the state vector.
    by_t : Value or None
        With respect to the time.
    by_signal : mapping of str to Value
        With respect to signals that are tables.
    """

    surface: Value | Pair
    value: Value
    by_state: Mapping[str, Value]
    by_t: Value | None
    by_signal: Mapping[str, Value]


@dataclass(frozen=True, eq=False)
class ProgramPlan:
    """Everything that a program computes.

    Parameters
    ----------
    title : str
        Names the charts and the system.
    read : Assembly
        The system, read.
    names : QuantityNames
        The names in the text.
    layout : SystemLayout
        The layout of all arrays.
    tables : Places
        The places of the times and values of each table of corners.
    definitions : mapping of str to Computed
        Of the quantities computed from others, without signals that are not formulas; in order.
    banks : tuple of BankPlan
        The contacts.
    accelerations : mapping of str to Computed
        By free body: (force - the forces of its contacts) / inertia.
    flow : mapping of str to Computed
        Rates of the further states.
    held : Places
        The values whose signs are held.
    surfaces : Places
        Those among them on which the motion can slide, and the pairs of edges on whose surface it
        can.
    relations : Places
        The comparisons that may be watched.
    always : tuple of Comparison
        Those watched in every state.
    rough : tuple of mapping of str to tuple of Value
        For each contact, by state, the values whose signs decide corners and jumps.
    gradients : tuple of Gradient
        One for each value on whose surface the motion can slide, in the order of `surfaces`.
    steps : tuple of Value
        Values that grow steadily with the time, at whole numbers of which a comparison jumps.
    """

    title: str
    read: Assembly
    names: QuantityNames
    layout: SystemLayout
    tables: Places[tuple[str, str]]
    definitions: Mapping[str, Computed]
    banks: tuple[BankPlan, ...]
    accelerations: Mapping[str, Computed]
    flow: Mapping[str, Computed]
    held: Places[Value]
    surfaces: Places[Value | Pair]
    relations: Places[Comparison]
    always: tuple[Comparison, ...]
    rough: tuple[Mapping[str, tuple[Value, ...]], ...]
    gradients: tuple[Gradient, ...]
    steps: tuple[Value, ...]


def plan_of(read: Assembly) -> ProgramPlan:
    """Plan the program of a system.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> from gms_fsm.systems.reading.assembly import assembled
    >>> from gms_fsm.systems.system import system_of
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> plan = plan_of(assembled(system_of(model, Prescribed("0.1*t"))))
    >>> plan.held.shared, [edge.name for edge in plan.banks[0].bank.edges]
    ((Name(id='v'),), ['break_away_forward', 'break_away_backward', 'arrest'])
    """
    names = names_of(read)
    accelerations = {body.name: _acceleration(read, body.name) for body in read.free}
    outer = _outer_rough(read, accelerations)
    rough = tuple(_rough(read, bank) for bank in read.banks)
    found = [*outer, *(u for each in rough for row in each.values() for u in row)]
    held = _parted(dict.fromkeys(found), read)
    surfaces: Places[Value | Pair] = Places(
        tuple(u for u in held.shared if _can_be_slid_on(u, read)),
        tuple(
            ElementPlaces(
                (*(u for u in block.names if _can_be_slid_on(u, read)), *_pairs(bank, read)),
                block.n,
                block.size,
            )
            for bank, block in zip(read.banks, held.blocks, strict=True)
        ),
    )
    landmarks = [r for bank in read.banks if _reads_curve(bank) for r in _landmarks(bank)]
    always = [relation for u in outer for relation in both_sides(u)] + landmarks
    smoothing = _Smoothing(held, names)
    relations = _relations(read, held, landmarks)
    charts = " and ".join(dict.fromkeys(bank.chart.name for bank in read.banks))
    return ProgramPlan(
        title=f"{charts}, {read.system.name}",
        read=read,
        names=names,
        layout=SystemLayout.of(read, surfaces.size),
        tables=Places(
            tuple(
                (name, column)
                for name, signal in read.system.signals.items()
                if isinstance(signal, Corners)
                for column in ("times", "values")
            ),
            (),
        ),
        definitions={
            each.name: smoothing(each.tree) for each in read.definitions if each.tree is not None
        },
        banks=tuple(_bank(read, bank, smoothing) for bank in read.banks),
        accelerations={name: smoothing(tree) for name, tree in accelerations.items()},
        flow={name: smoothing(tree) for name, tree in read.flow.items()},
        held=held,
        surfaces=surfaces,
        relations=relations,
        always=tuple(dict.fromkeys(always)),
        rough=rough,
        gradients=tuple(
            replace(gradient_of(u.value if isinstance(u, Pair) else u, read), surface=u)
            for u in (*surfaces.shared, *surfaces.own)
        ),
        steps=tuple(dict.fromkeys(_steps([*relations.shared, *relations.own], read))),
    )


# --------------------------------------------------------------------------- corners and jumps
class _Smoothing:
    """Removes rough calls from values."""

    def __init__(self, held: Places[Value], names: QuantityNames) -> None:
        self.taken, self.labels = names.taken, _labels(held, names)
        self.turning = {
            f"{function}_{label}": u for u, label in self.labels.items() for function in ROUGH
        }
        self.named: dict[Call, str] = {}

    def __call__(self, value: Value) -> Computed:
        """Return a value with its rough calls replaced by names, and these calls in order."""
        smooth, calls = substitute(value, self.name_of)
        return Computed(
            smooth,
            tuple(RoughCall(name, call, self.turning[name]) for name, call in calls.items()),
        )

    def name_of(self, turning: Value, call: Call) -> str | None:
        """Return the name of a rough call, None if its sign is not held."""
        if turning not in self.labels:
            return None
        if call not in self.named:
            # max(v, 2) and max(v - 2, 0) turn at the same place but are not equal.
            first = name = f"{call.function}_{self.labels[turning]}"
            number = 2
            while name in self.named.values() or (
                name != first and (name in self.taken or name in self.turning)
            ):
                name, number = f"{first}_{number}", number + 1
            self.named[call], self.turning[name] = name, turning
        return self.named[call]


def _labels(held: Places[Value], names: QuantityNames) -> dict[Value, str]:
    """Return the label of each held sign, used in the names of its rough calls."""
    labels: dict[Value, str] = {}
    for number, u in enumerate([*held.shared, *held.own]):
        label = names.local[u.id] if isinstance(u, Name) else str(number)
        while label in labels.values() or any(
            f"{function}_{label}" in names.taken for function in ROUGH
        ):
            label += "_"
        labels[u] = label
    return labels


def _acceleration(read: Assembly, body: str) -> Value:
    """Return the acceleration of a free body: its product is there sooner than a quotient."""
    tree = read.forces[body]
    for bank in read.banks:
        for force, row in zip(bank.forces, bank.jacobian, strict=False):  # a supervisor has none
            if body in row:
                tree = Binary("-", tree, times(row[body], Name(force)))
    return Binary("*", tree, Binary("/", Number(1.0), read.inertias[body]))


def times(coefficient: Value, value: Value) -> Value:
    """Return a product; 1 is left out."""
    return value if coefficient == ONE else Binary("*", coefficient, value)


def _outer_rough(read: Assembly, accelerations: Mapping[str, Value]) -> tuple[Value, ...]:
    """Return where the bodies, a signal or another shared quantity has a corner or a jump."""
    late = {name for bank in read.banks for name in bank.forces}
    trees = [each.tree for each in read.definitions if each.bank is None and each.tree is not None]
    trees += [*accelerations.values(), *read.flow.values()]
    trees += [tree for bank in read.banks for tree in bank.totals.values() if not bank.periodic]
    # A sign of a force itself stays live: it is known only with the flow.
    return tuple(u for tree in trees for u in rough_points(tree) if not names_in(u) & late)


def _rough(read: Assembly, bank: Bank) -> Mapping[str, tuple[Value, ...]]:
    """Return by state where a flow or a force has a corner or a jump: the driver stops there."""
    found: dict[str, tuple[Value, ...]] = {}
    for state in bank.states:
        if bank.periodic:  # what it gives out is held, whatever the signs are meanwhile
            found[state] = ()
            continue
        trees = [bank.flows[state, name] for name in bank.variables]
        trees += [tree for name in bank.forces if (tree := _force(bank, state, name)) is not None]
        needed = read.closure(name for tree in trees for name in names_in(tree))
        inside = [
            each.tree
            for each in read.definitions
            if each.bank == bank.index and each.name in needed and each.tree is not None
        ]
        found[state] = tuple(
            dict.fromkeys(u for tree in (*inside, *trees) for u in rough_points(tree))
        )
    return found


def _force(bank: Bank, state: str, force: str) -> Value | None:
    """Return an element's force in a state; inside its rough calls, the rates become the flows."""
    tree = bank.outputs[state, force]
    rates = {bank.rate(name): bank.flows[state, name] for name in bank.variables}
    return None if tree is None else turning_inside(tree, rates)


def _parted(found: Iterable[Value], read: Assembly) -> Places[Value]:
    """Split values into those with one value and those with one per element of a contact."""
    owners = {u: read.bank_of(u) for u in found}
    sizes = sizes_of(read.banks)
    return Places(
        tuple(u for u in owners if owners[u] is None),
        tuple(
            ElementPlaces(tuple(u for u in owners if owners[u] == bank.index), bank.n, size)
            for bank, size in zip(read.banks, sizes, strict=True)
        ),
    )


def _can_be_slid_on(u: Value, read: Assembly) -> bool:
    """Tell whether u depends on the state, through quantities that have a derivative."""
    expanded = read.expanded(u)
    names = moving(expanded, read)
    signals = read.system.signals
    return (
        not any(isinstance(signals.get(name), Function) for name in names_in(expanded))
        and bool({*names} - {"t", *signals})
        and all(derivative(expanded, name) is not None for name in names)
    )


def _pairs(bank: Bank, read: Assembly) -> Iterator[Pair]:
    """Find the edges there and back, without actions, that meet on one surface.

    The machine would switch without end where the flows of both states lead onto it. Locks are left
    out: to enter one takes an impulse. So are forces, which jump with the state, and states that
    are arrested: their other edges are for velocities that jump.
    """
    locked = {*bank.locked, *(edge.source for edge in bank.edges if edge.arrests)}
    late = {name for each in read.banks for name in (*each.forces, *each.rates)}
    late |= {each.rate(name) for each in read.banks for name in each.variables}
    edges = [
        (edge, part)
        for edge in (() if bank.periodic else bank.edges)
        if not edge.steps and edge.source != edge.target and edge.source not in locked
        if edge.target not in locked and isinstance(part := split(edge.guard), Requirement)
    ]
    for (edge, there), (other, back) in combinations(edges, 2):
        if (edge.source, edge.target) != (other.target, other.source):
            continue
        one, two = _difference(there.comparison), _difference(back.comparison)
        if two not in (one, one[::-1]) or (there.holds == back.holds) != (two == one[::-1]):
            continue  # not one margin, of which one edge needs the positive side, one the negative
        if there.relation.op in (">=", "<=") and back.relation.op in (">=", "<="):
            continue  # on the surface itself both hold
        rise, fall = (edge, other) if there.holds else (other, edge)
        pair = Pair(
            bank.index,
            there.comparison,
            back.comparison,
            rise.target,
            fall.target,
            rise.name,
            fall.name,
        )
        if _can_be_slid_on(pair.value, read) and not names_in(read.expanded(pair.value)) & late:
            yield pair


def _difference(comparison: Comparison) -> tuple[Value, Value]:
    """Return the two values whose difference is the margin of a comparison."""
    zero = Number(0.0)
    match comparison:
        case Comparison(Binary("-", a, b), right=right) if right == zero:
            return a, b
        case Comparison(left=left, right=Binary("-", a, b)) if left == zero:
            return b, a
    return comparison.left, comparison.right


def moving(expanded: Value, read: Assembly) -> tuple[str, ...]:
    """Return the names in an expanded value that change while the motion flows."""
    system, order = read.system, dict[str, None]()
    for body in system.bodies:
        order[body.x] = order[body.v] = None
    order |= dict.fromkeys(system.flow)
    order |= dict.fromkeys(name for bank in read.banks for name in bank.variables)
    order |= {name: None for name in system.signals if isinstance(system.signals[name], Corners)}
    order["t"] = None
    return tuple(name for name in order if name in names_in(expanded))


# --------------------------------------------------------------------------- comparisons
def both_sides(u: Value) -> tuple[Comparison, Comparison]:
    """Return the comparisons of a value with zero: u > 0 and u >= 0."""
    zero = Number(0.0)
    return Comparison(u, zero, strict=True), Comparison(u, zero, strict=False)


def _reads_curve(bank: Bank) -> bool:
    return bool(bank.threshold) and "s" in bank.chart.inputs and not bank.periodic


def _landmarks(bank: Bank) -> list[Comparison]:
    """Return where s(v) starts to change fast: a large step would miss the whole dip."""
    v, dip = Name(bank.velocities[0]), Name(of(bank.name, "curve v dip"))
    # Mirror images of each other, so that a mirrored run stops at mirrored places.
    return [Comparison(v, dip, strict=True), Comparison(Negative(dip), v, strict=True)]


def _relations(
    read: Assembly, held: Places[Value], landmarks: list[Comparison]
) -> Places[Comparison]:
    """Lay out all comparisons that may be watched."""
    wanted: list[Comparison] = []
    for bank in read.banks:
        for edge in bank.edges if not bank.periodic else ():
            wanted += comparisons(split(edge.guard))
    for u in (*held.shared, *held.own):
        wanted += both_sides(u)
    found = dict.fromkeys([*wanted, *landmarks])
    owners = {r: read.bank_of(Binary("-", r.left, r.right)) for r in found}
    sizes = sizes_of(read.banks)
    return Places(
        tuple(r for r in found if owners[r] is None),
        tuple(
            ElementPlaces(tuple(r for r in found if owners[r] == bank.index), bank.n, size)
            for bank, size in zip(read.banks, sizes, strict=True)
        ),
    )


def _steps(relations: Iterable[Comparison], read: Assembly) -> Iterator[Value]:
    """Find floor and round of values that grow steadily with the time."""
    numbers = {*read.shared, *read.own}
    for side in (side for each in relations for side in (each.left, each.right)):
        for part in walk(read.expanded(side)):
            if isinstance(part, Call) and part.function in ("floor", "round", "tooth"):
                (u,) = part.arguments
                slope = derivative(u, "t")
                if "t" in names_in(u) <= numbers | {"t"} and slope and "t" not in names_in(slope):
                    yield Binary("+", u, Number(0.5)) if part.function == "round" else u


# --------------------------------------------------------------------------- what is computed
def _bank(read: Assembly, bank: Bank, smoothing: _Smoothing) -> BankPlan:
    """Plan the rates and the forces of a contact."""
    forces = {
        (state, name): _force(bank, state, name) for state in bank.states for name in bank.forces
    }
    # With corners in it, or in what it is made from, a force is computed state by state.
    common = {}
    for name in bank.forces:
        texts = [bank.outputs[state, name] for state in bank.states]
        first = texts[0]
        same = first is not None and all(each == first for each in texts)
        if same and not any(rough_points(forces[state, name] or ONE) for state in bank.states):
            assert first is not None
            common[name] = first
    states = []
    for state in bank.chart.states:
        kept = {}
        for name in bank.forces:
            tree = forces[state.name, name]
            if tree is not None and name not in common:
                kept[name] = smoothing(tree)
        rates = {name: smoothing(bank.flows[state.name, name]) for name in bank.variables}
        states.append(StateFlow(state.name, rates, kept, state.locked))
    free = {body.name for body in read.free}
    return BankPlan(
        bank,
        tuple(states),
        common,
        {name: smoothing(tree) for name, tree in bank.totals.items()},
        any(free & {*row} for row in bank.jacobian) or bool(_read_elsewhere(read) & {*bank.forces}),
    )


def _read_elsewhere(read: Assembly) -> frozenset[str]:
    """Return what smooth texts read, but for what a machine reads of itself."""
    trees = [*read.forces.values(), *read.flow.values()]
    trees += [each.tree for each in read.definitions if each.tree is not None]
    found = read.closure(name for tree in trees for name in names_in(tree))
    flows = (tree for bank in read.banks for tree in bank.flows.values())
    found |= read.closure(name for tree in flows for name in names_in(tree))
    return found.union(*read.inputs)


def gradient_of(u: Value, read: Assembly) -> Gradient:
    """Return the rate of a value: its slopes by what moves."""
    expanded, signals = read.expanded(u), read.system.signals
    slopes = {name: derivative(expanded, name) for name in moving(expanded, read)}
    known = {name: slope for name, slope in slopes.items() if slope is not None}
    return Gradient(
        surface=u,
        value=u,
        by_state={name: each for name, each in known.items() if name not in ("t", *signals)},
        by_t=known.get("t"),
        by_signal={name: each for name, each in known.items() if name in signals},
    )
