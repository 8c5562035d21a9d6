"""The names used in the trees of a program's plan and in its text."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gms_fsm.charts.chart import RESERVED, SUPPLIED, Chart
from gms_fsm.errors import ParameterError
from gms_fsm.language import Binary, Name, Node, names_in, product_power
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig

__all__ = ["DIP", "Names", "computed_names", "names_of"]

DIP = "v dip"  # not an identifier, so no chart can have a name like it
# Names used by the text itself, in addition to those reserved for every chart.
TEXT = {"F_i", "len", "range", "piecewise_linear", "piecewise_slope", "v_dip"}
TEXT |= {"surface", "j", "dS", "nan"}
MODEL = {"F_c", "F_s", "v_s", "sigma_2"}  # numbers of a model other than its chart's parameters


@dataclass(frozen=True, eq=False)
class Names:
    """The names of quantities in the text.

    Parameters
    ----------
    shared : tuple of str
        Numbers shared by all elements, in the order of the program's arguments.
    own : tuple of str
        Numbers with one value per element, in the order of the program's arguments.
    local : mapping of str to str
        For a name in the trees, its name in the text, if that differs or belongs to the chart.
    rig : mapping of str to Name
        For the rig's signals and numbers, their names in the trees: a chart may use the same ones.
    taken : frozenset of str
        All names that are already in use.
    states, edges : mapping of str to str
        Constants for the states and for the edges, in the chart's order.
    """

    shared: tuple[str, ...]
    own: tuple[str, ...]
    local: Mapping[str, str]
    rig: Mapping[str, Name]
    taken: frozenset[str]
    states: Mapping[str, str]
    edges: Mapping[str, str]

    @cached_property
    def texts(self) -> Mapping[str, str]:
        """The spelling of each name from the trees inside the loop over the elements."""
        own = {*self.own}
        return {
            name: f"{local}[i]" if local in own else local for name, local in self.local.items()
        }

    @cached_property
    def plain(self) -> Mapping[str, str]:
        """The spelling of the rig's names in messages."""
        return {apart.id: name for name, apart in self.rig.items()}

    def read_by(self, *nodes: Node) -> frozenset[str]:
        """Return the names that trees read, as spelled in the text."""
        return frozenset(
            self.local.get(name, name) for node in nodes for name in computed_names(node)
        )

    def is_shared(self, node: Node) -> bool:
        """Return whether a tree of the chart has the same value for all elements."""
        return all(
            name in ("t", "x", "v") or name in self.plain or self.local.get(name) in self.shared
            for name in names_in(node)
        )


def computed_names(node: Node) -> frozenset[str]:
    """Return the names that the value of a tree depends on: ``u**0`` is 1 whatever u is.

    Parameters
    ----------
    node : Node
        A value or a condition.

    Returns
    -------
    frozenset of str
        The same as `names_in` otherwise.

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


def names_of(model: Model, rig: Rig) -> Names:
    """Choose names for everything that the program of a model on a rig reads.

    Parameters
    ----------
    model, rig
        The model and the rig; only the shapes of their numbers matter.

    Returns
    -------
    Names
        Free of clashes.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Slider
    >>> names = names_of(GMS(GMSParameters.paper("stick-slip"), law="signed"), Slider(1.0, "t"))
    >>> names.shared, names.own
    (('F_c', 'F_s', 'v_s', 'v_dip', 'sigma_2', 'mass', 'v_c'), ('weight', 'k', 'sigma', 'C'))
    """
    chart = model.chart
    shared = [] if model.stribeck is None else ["F_c", "F_s", "v_s", "v_dip"]
    shared += ["sigma_2", *rig.numbers]
    own = ["weight"]
    _check_rig(rig, chart)
    taken = set(shared) | set(rig.signals) | {f"{name}_signal" for name in rig.signals}
    taken |= TEXT
    # A chart may use names of the rig: the rig's are kept separate.
    apart = {name: Name(f"rig {name}") for name in (*rig.signals, *rig.numbers)}
    local = {DIP: "v_dip"} | {each.id: name for name, each in apart.items()}
    # A chart may call its own parameter F_c or mass: it gets a different name in the text.
    chart_names = (*chart.variables, *chart.parameter_names)
    for name in chart_names:
        found = name
        while found in taken or (found != name and found in chart_names):
            found += "_"
        taken.add(found)
        local[name] = found
    for name in chart.parameter_names:
        (shared if np.ndim(model.values[name]) == 0 else own).append(local[name])
    local |= {f"d{name}": f"d{local[name]}" for name in chart.variables}
    # STICK is the most readable, but a state called c must not become the parameter C, nor the
    # edge Home the state home.
    constants = {*taken, *RESERVED}
    return Names(
        shared=tuple(shared),
        own=tuple(own),
        local=local,
        rig=apart,
        taken=frozenset(taken),
        states={state.name: _constant(state.name, constants) for state in chart.states},
        edges={edge.name: _constant(edge.name, constants) for edge in chart.transitions},
    )


def _check_rig(rig: Rig, chart: Chart) -> None:
    """Refuse names of a rig that have another meaning in the text.

    The chart itself refuses its own names in the same way; the velocity of a prescribed motion is
    v.
    """
    forbidden = {*RESERVED, *SUPPLIED, *MODEL, *TEXT} | {f"d{name}" for name in chart.variables}
    velocity = {"v"} if rig.acceleration is None else set()
    for kind, names in (("number", rig.numbers), ("signal", set(rig.signals) - velocity)):
        for name in sorted({*names} & forbidden):
            raise ParameterError(
                f"the {kind} {name!r} has a name that the generated program uses itself",
                place=f"rig {rig.title!r}",
                advice=f"rename it, for example to '{name}_rig'",
            )


def _constant(name: str, taken: set[str]) -> str:
    """Return a constant for a name and reserve it."""
    constant = name.upper()
    while constant in taken or not constant.isidentifier():
        constant += "_"
    taken.add(constant)
    return constant
