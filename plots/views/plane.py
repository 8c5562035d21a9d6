"""The plane of a velocity and one more quantity, in which guards are regions.

Which two names span it, where its logarithmic axis becomes linear, and what is true at its points
is decided here for all pictures: `plots.landscape` and the replay page.

At the points of a plane the velocity and the second quantity vary. Named expressions (`let`) and
the threshold s(v) are computed again from their texts; everything else is as at the row.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.errors import ParameterError
from gms_fsm.language import (
    Binary,
    Comparison,
    Condition,
    Name,
    Node,
    Number,
    Relation,
    Value,
    comparisons,
    names_in,
    parse_value,
    renamed,
    split,
    truths,
    values_of,
)
from gms_fsm.language.normal import renamed_in
from gms_fsm.language.tree import walk
from gms_fsm.session.explain import Why, explain_alone, values_at
from gms_fsm.systems.system import loaded
from gms_fsm.traces.trace import Trace

Floats = NDArray[np.float64]
FALLBACK = 1e-3  # of the largest speed, where no guard turns at a speed
SEARCHED = np.geomspace(1e-15, 1e6, 1200)  # distances from 0 at which guards are compared


# --------------------------------------------------------------------------- which plane
def plane_axes(chart: Chart) -> tuple[str, str] | None:
    """Return the two names that span the plane of a chart.

    Examples
    --------
    >>> from gms_fsm.charts import CHARTS
    >>> [plane_axes(CHARTS[name]) for name in ("lugre", "stiction", "prandtl-tomlinson")]
    [('v', 'z'), ('v', 'F'), None]
    """
    if not chart.velocities:
        return None
    velocity = chart.velocities[0]
    if chart.variables:
        return velocity, chart.variables[0]
    lets = _expanded(chart, {})
    known = {velocity, *chart.parameter_names}
    for guard in chart.guards.values():
        for node in walk(renamed_in(guard, lets)):
            if isinstance(node, Name) and node.id not in known:
                return velocity, node.id
    return None


def checked_axes(chart: Chart) -> tuple[str, str]:
    """Return the names that span the plane of a chart."""
    found = plane_axes(chart)
    if found is None:
        raise ParameterError(
            "it has no variables, and its guards read nothing but the velocity, so there is no "
            "plane to draw",
            place=f"chart {chart.name!r}",
            advice="draw the force with plots.phase, or the chart with plots.statechart",
        )
    return found


def _expanded(chart: Chart, start: Mapping[str, Value]) -> dict[str, Value]:
    """Return the named expressions of a chart, without each other's names."""
    found = dict(start)
    for name, tree in chart.lets.items():
        found[name] = renamed(tree, found)
    return found


# --------------------------------------------------------------------------- the points
@dataclass(frozen=True, eq=False)
class Plane:
    """What the guards of an element see at the points of a plane through a row.

    Parameters
    ----------
    chart : Chart
        The chart of the element.
    names : (str, str)
        What spans the plane: a velocity and a second quantity.
    state : str
        The state whose edges are asked: the active one; on a row made by a firing of this element,
        the one it left.
    row : int
        The row whose values are held: on a row made by a firing of this element, the row before.
    why : Why
        The explanation of the row.
    values : mapping of str to float
        The values at that row.
    inner : mapping of str to Value
        What is computed again at each point: named expressions, and s(v).

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 1.0)
    >>> plane = Plane.of(trace, -1, 0)
    >>> plane.names, plane.state, [edge.name for edge in plane.edges]
    (('v', 'z'), 'stick', ['break_away_forward', 'break_away_backward'])
    >>> forward = plane.chart.guards["break_away_forward"]
    >>> plane.truths(forward, 0.2, [0.3, 0.5]).tolist()  # s(0.2) is 0.4
    [False, True]
    """

    chart: Chart
    names: tuple[str, str]
    state: str
    row: int
    why: Why
    values: Mapping[str, float]
    inner: Mapping[str, Value]

    @classmethod
    def of(cls, trace: Trace, row: int, element: int) -> Plane:
        """Return the plane of an element at a row."""
        chart = trace.model.chart
        names = checked_axes(chart)
        why = explain_alone(trace, row, element)
        row = row % len(trace) - bool(why.left)
        start: dict[str, Value] = {}
        # Under a load s is that of the row, also at other velocities.
        if trace.model.stribeck is not None and "s" in chart.inputs and not loaded(trace.model):
            start["s"] = _threshold(trace.model.stribeck, trace.model.weights[element], names[0])
        return cls(
            chart,
            names,
            why.left or why.state,
            row,
            why,
            values_at(trace, row, element),
            _expanded(chart, start),
        )

    @property
    def edges(self) -> tuple[Transition, ...]:
        """The edges that leave the state, highest priority first."""
        return tuple(edge for _, edge in self.chart.leaving(self.state))

    @property
    def here(self) -> tuple[float, float]:
        """The point of the row: the velocity and the second quantity."""
        return self.values[self.names[0]], self.values[self.names[1]]

    @property
    def _read(self) -> frozenset[str]:
        """The names in the edges and the flow of the state, and in what these read in turn."""
        trees: list[Node] = [self.chart.guards[edge.name] for edge in self.edges]
        flow = self.chart.flows.get((self.state, self.names[1]))
        trees += [] if flow is None else [flow]
        read = frozenset[str]().union(*map(names_in, trees))
        for name in reversed([*self.chart.lets]):
            read |= names_in(self.chart.lets[name]) if name in read else frozenset()
        return read

    @property
    def again(self) -> list[str]:
        """Which named expressions the state reads, and s, that are computed at every point."""
        return [
            name
            for name, tree in self.inner.items()
            if name in self._read and names_in(tree) & {*self.names}
        ]

    @property
    def held(self) -> dict[str, float]:
        """What the edges and the flow of the state read besides, by name, as at the row."""
        known = {*self.names, *self.chart.parameter_names, *self.inner}
        return {
            name: self.values[name] for name in sorted(self._read - known) if name in self.values
        }

    @property
    def threshold(self) -> Value | None:
        """The curve s(v), if a guard compares the second quantity with it."""
        wanted = {"s", self.names[1]}
        parts = [each for tree in self.chart.guards.values() for each in comparisons(split(tree))]
        compared = any(wanted <= names_in(each.left) | names_in(each.right) for each in parts)
        return self.inner.get("s") if compared else None

    # ------------------------------------------------------------------ evaluation
    def expanded(self, condition: Condition) -> Condition:
        """Return a condition in which only names that vary or are held are left."""
        return renamed_in(condition, self.inner)

    def expanded_value(self, tree: Value) -> Value:
        """Return a value in which only names that vary or are held are left."""
        return renamed(tree, self.inner)

    def truths(self, condition: Condition, v: ArrayLike, z: ArrayLike) -> NDArray[np.bool_]:
        """Return where a guard or clause is true."""
        shape = np.broadcast_shapes(np.shape(v), np.shape(z))
        return truths(self.expanded(condition), self._columns(v, z), shape)

    def numbers(self, tree: Value, v: ArrayLike, z: ArrayLike) -> Floats | None:
        """Return the values of a tree at points; None if it reads what the row does not give."""
        expanded, columns = self.expanded_value(tree), self._columns(v, z)
        if not names_in(expanded) <= columns.keys():
            return None
        shape = np.broadcast_shapes(np.shape(v), np.shape(z))
        known = {name: columns[name] for name in names_in(expanded)}
        return np.broadcast_to(values_of(expanded, known), shape)

    def margin(self, comparison: Comparison | Relation, v: ArrayLike, z: ArrayLike) -> Floats:
        """Return left - right of a comparison at points; NaN where it cannot be computed."""
        left, right = (self.numbers(each, v, z) for each in (comparison.left, comparison.right))
        assert left is not None  # guards read nothing else
        assert right is not None
        with np.errstate(invalid="ignore"):
            return left - right

    def _columns(self, v: ArrayLike, z: ArrayLike) -> dict[str, ArrayLike]:
        return {**self.values, self.names[0]: v, self.names[1]: z}

    def atoms(self, edges: Iterable[Transition]) -> tuple[Comparison, ...]:
        """Return the different comparisons in the guards of some edges."""
        found = (comparisons(split(self.chart.guards[edge.name])) for edge in edges)
        return tuple(dict.fromkeys(each for parts in found for each in parts))

    def reads(self, comparison: Comparison | Relation) -> frozenset[str]:
        """Return the names that a comparison depends on."""
        sides = (comparison.left, comparison.right)
        return frozenset[str]().union(*(names_in(self.expanded_value(side)) for side in sides))


def _threshold(curve: Stribeck, weight: float, velocity: str) -> Value:
    """Return the text w s(v) of an element as a tree over the velocity."""
    tree = parse_value(curve.text, ("v", *curve.numbers))
    known: dict[str, Value] = {name: Number(number) for name, number in curve.numbers.items()}
    return Binary("*", Number(float(weight)), renamed(tree, known | {"v": Name(velocity)}))


# --------------------------------------------------------------------------- its axes
def turning_points(plane: Plane, edges: Iterable[Transition], axis: int, at: float = 0.0) -> Floats:
    """Return where comparisons of guards turn along one axis of the plane."""
    own, other = plane.names[axis], plane.names[1 - axis]
    found: list[float] = []
    for each in plane.atoms(edges):
        reads = plane.reads(each)
        if own not in reads or (axis == 0 and other in reads):
            continue
        for sign in (1.0, -1.0):
            points = (sign * SEARCHED, at) if axis == 0 else (at, sign * SEARCHED)
            above = plane.margin(each, *points) > 0
            turned = np.flatnonzero(above[1:] != above[:-1])
            found += (sign * np.sqrt(SEARCHED[turned] * SEARCHED[turned + 1])).tolist()
    return np.array(found)


def linear_threshold(plane: Plane, largest: float) -> float:
    """Return the speed below which the axis of the velocity is linear.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 1.0)
    >>> linear_threshold(Plane.of(trace, -1, 0), 0.2)  # v_c is 1e-6
    1e-07
    """
    turns = np.abs(turning_points(plane, plane.chart.transitions, 0))
    if turns.size:
        return 10.0 ** math.floor(math.log10(turns.min()) - 0.7)
    top = FALLBACK * largest if largest > 0 else FALLBACK
    return 10.0 ** math.floor(math.log10(top))
