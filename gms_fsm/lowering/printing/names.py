"""The names of a program's text: what each quantity of a system is called there."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from gms_fsm.charts.nesting import spelled
from gms_fsm.language import Binary, Name, Node, product_power
from gms_fsm.lowering.layout import sizes_of
from gms_fsm.systems.reading.assembly import Assembly, Bank
from integrators import FOR_A_GUARD, FOR_A_SIGN, JUMPED, LET_GO, WAITING

# A force without limit, in units of an impulse; squared it is still finite.
ENDLESS = 1e100
# The loop's numbers: whose velocity has jumped, and why a comparison is watched.
MARKS = {"JUMPED": JUMPED, "LET_GO": LET_GO, "ENDLESS": ENDLESS}
REASONS = {"FOR_A_SIGN": FOR_A_SIGN, "FOR_A_GUARD": FOR_A_GUARD, "WAITING": WAITING}
# Names that the text uses itself. What a user calls like one of them is called otherwise there.
TEXT = frozenset(
    {"dS", "dy", "edge", "first_after", "held", "i", "j", "len", "machine", "mode", "n", "nan"}
    | {"out", "own", "p"}
    | {"piecewise_linear", "piecewise_slope", "range", "shared", "surface", "tables", "watch", "y"}
    | {"abs", "exp", "log", "sqrt", "sgn", "min", "max", "sin", "cos", "tanh", "atan", "asinh"}
    | {"floor", "round", "tooth", "noise", "pow", "pi", "F_i", "t", "jolt", "least", "mark", "skip"}
    | {"found", "was", *MARKS, *REASONS}
)


@dataclass(frozen=True, eq=False)
class QuantityNames:
    """The names of quantities in the text.

    Parameters
    ----------
    shared : tuple of str
        Numbers with one value, by their names in the trees, in the order of the arguments.
    own : tuple of str
        Numbers with one value per element, likewise.
    local : mapping of str to str
        For each name in the trees its name in the text.
    taken : frozenset of str
        All names in use.
    states, edges : tuple of (mapping, tuple)
        For each contact the constants of its states, by name, and of its edges, in order.
    plain : mapping of str to str
        For each name in the trees what it is called in messages.
    """

    shared: tuple[str, ...]
    own: tuple[str, ...]
    local: Mapping[str, str]
    taken: frozenset[str]
    states: tuple[Mapping[str, str], ...]
    edges: tuple[tuple[str, ...], ...]
    plain: Mapping[str, str]

    @cached_property
    def texts(self) -> Mapping[str, str]:
        """The spelling of each name from the trees."""
        own = {*self.own}
        return {name: f"{local}[i]" if name in own else local for name, local in self.local.items()}


def computed_names(node: Node) -> frozenset[str]:
    """Return the names whose values a tree is computed from: ``u**0`` is 1 whatever u is.

    Examples
    --------
    >>> from gms_fsm.language import parse_value
    >>> computed_names(parse_value("k + v**0", ["k", "v"]))
    frozenset({'k'})
    """
    match node:
        case Name(name):
            return frozenset({name})
        case Binary("**", base, exponent) if product_power(base, exponent) == 0:
            return frozenset()
    return frozenset[str]().union(*(computed_names(part) for part in node.parts))


def names_of(read: Assembly) -> QuantityNames:
    """Choose the names of a system's program.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Slider
    >>> from gms_fsm.systems.reading.assembly import assembled
    >>> from gms_fsm.systems.system import system_of
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> names = names_of(assembled(system_of(model, Slider(1.0, "t"))))
    >>> [names.local[name] for name in (*names.shared, *names.own)]
    ['F_c', 'F_s', 'v_s', 'v_dip', 'v_flat', 'sigma_2', 'mass', 'v_c', 'weight', 'k', 'sigma', 'C']
    """
    system, choice = read.system, _Choice(len(read.banks) == 1)
    choice.taken |= {*sizes_of(read.banks), *_names_of_locks(read)}
    choice.taken |= {f"{name}_signal" for name in system.signals}
    local: dict[str, str] = {"t": "t"}
    plain: dict[str, str] = {}
    for name in system.names:
        if name != "t" and "." not in name:
            local[name] = choice.free(name)
    for name in system.events:
        local[name] = choice.free(name)
    for each in read.definitions:
        if each.counts is not None:
            local[each.name] = choice.free(re.sub(r"\W+", "_", each.name).strip("_"))
    for body in system.bodies:
        local[f"{body.name} a"] = choice.free(f"a_{body.name}")
    for bank in read.banks:
        for name in model_names(bank, read):
            local[name] = choice.of(bank, _short(name))
    for bank in read.banks:
        for name in every_name(bank, read):
            if name not in local:
                local[name] = choice.of(bank, name.split(".", 1)[1])
        for force in bank.forces if bank.periodic else ():
            local[bank.held(force)] = choice.of(bank, f"held_{force.split('.', 1)[1]}")
        for name in (*bank.variables, *bank.velocities):
            plain[name] = name.split(".", 1)[-1] if choice.alone else name
    plain |= {name: name.split(".", 1)[1] for name in local if choice.alone and "." in name}
    states, edges = [], []
    for bank in read.banks:
        states.append({state: choice.constant(bank, state) for state in bank.states})
    for bank in read.banks:
        several = [edge.name for edge in bank.edges]
        edges.append(
            tuple(
                choice.constant(
                    bank,
                    edge.name
                    if several.count(edge.name) == 1
                    else f"{edge.name}_from_{edge.source}",
                )
                for edge in bank.edges
            )
        )
    return QuantityNames(
        shared=tuple(read.shared),
        own=tuple(read.own),
        local=local,
        taken=frozenset(choice.taken),
        states=tuple(states),
        edges=tuple(edges),
        plain=plain,
    )


def _names_of_locks(read: Assembly) -> set[str]:
    """Return the names in the equations of locks: a row for each velocity that can be set."""
    setting = [bank for bank in read.banks if bank.chart.locks or bank.chart.sets_velocity]
    rows = range(sum(len(bank.velocities) for bank in setting))
    each = ("D", "W", "g", "goal", "hold", "keep", "l", "q", "set", "w")
    names = {f"{name}_{r}" for r in rows for name in each} | {
        f"L_{r}_{s}" for r in rows for s in rows
    }
    names |= {f"e_{r}_{j}" for r in rows for j in range(len(read.system.bodies))}
    return names | {"again", "best", "hit", "moved", "moves", "reach", "u"} if rows else names


_SHORT = {
    "curve S": "S",
    "curve v dip": "v_dip",
    "curve v flat": "v_flat",
    "threshold weight": "weight",
}


def _short(name: str) -> str:
    """Return what a number of a model is called: the last word."""
    inside = name.split(".", 1)[1]
    return _SHORT.get(inside, inside.split()[-1])


def model_names(bank: Bank, read: Assembly) -> list[str]:
    """Return what a contact has from its model, and its forces; a chart's names give way."""
    every = [*read.shared, *read.own, *read.defined]
    return [
        *(name for name in every if name.startswith(f"{bank.name}.") and " " in name),
        *bank.forces,
        *bank.rates,
    ]


def every_name(bank: Bank, read: Assembly) -> list[str]:
    """Return the names of a contact."""
    every = [*bank.variables, *read.shared, *read.own, *read.defined]
    rates = [bank.rate(name) for name in bank.variables]
    return [name for name in (*every, *rates) if name.startswith(f"{bank.name}.")]


class _Choice:
    """Chooses names that are not taken."""

    def __init__(self, alone: bool) -> None:
        self.alone, self.taken = alone, {*TEXT}

    def free(self, name: str) -> str:
        """Return a name, with as many _ after it as it needs."""
        while name in self.taken:
            name += "_"
        self.taken.add(name)
        return name

    def of(self, bank: Bank, name: str) -> str:
        """Return the name of a contact's quantity; with several contacts it has theirs in it."""
        return self.free(name if self.alone else f"{bank.name}_{name}")

    def constant(self, bank: Bank, name: str) -> str:
        """Return a constant for a name."""
        found = spelled(name if self.alone else f"{bank.name}_{name}").upper()
        while found in self.taken or not found.isidentifier():
            found += "_"
        self.taken.add(found)
        return found
