"""Characteristic sizes of a model, from which its default tolerances are derived.

A component's scale is the smallest size at which something in the model changes: the deflection at
which a guard turns true (w F_c for a GMS element), the deflection that carries the Coulomb friction
alone (F_c / k), the velocities v_c and v_s. Scales depend only on the model, never on rig, signal
or duration, so that a run in other units, or on another rig, is as accurate.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import as_floats
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.language import (
    Binary,
    Number,
    Value,
    comparisons,
    derivative,
    evaluate,
    names_in,
    renamed,
    spell,
    split,
)
from gms_fsm.lowering._generated import load
from gms_fsm.lowering.layout import held_of
from gms_fsm.systems._assembly import CURVE_LOAD, Bank, of
from gms_fsm.systems._texts import ByIdentity
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import LEAST_LOAD, Contact, System

__all__ = ["Scales", "Setting", "SystemScales", "Tolerance", "scales_of", "scales_of_system"]

Tolerance: TypeAlias = float | Mapping[str, ArrayLike] | None  # absolute, as given
Setting: TypeAlias = str | float | Mapping[str, float | list[float]] | None  # of a run, as stored

# The default absolute tolerance is rtol times the scale times this: near zero, a component is as
# accurate as at a tenth of its scale.
SHARE = 0.1
# A velocity in a guard is a window to pass through, not a typical size of motion: its weight.
# With rtol = 1e-6 the velocity is then accurate to 1e-5 v_c; coarser, creep just below v_c is off.
WINDOW = 1e2


@dataclass(frozen=True)
class Scales:
    """Scales of a model's components; 0 for one without a scale.

    Parameters
    ----------
    x, v : float
        m and m/s.
    variables : mapping of str to tuple of float
        For each variable of the chart, one per element.
    speed : float
        m/s: the smallest speed in a guard, v_c for a GMS element.
    time : float
        s: relaxation time of the fastest flow, s / C for a slipping GMS element.
    relaxing : tuple of tuple of float
        s: for each element in each state of the chart, the relaxation time of the fastest variable
        whose rate is constant, again s / C where a GMS element slips; 0 if there is none.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> scales_of(GMS(GMSParameters.paper("stick-slip"), law="signed")).variables["z"]
    (0.4, 0.4, 0.4, 0.4)
    """

    x: float
    v: float
    variables: Mapping[str, tuple[float, ...]]
    speed: float
    time: float
    relaxing: tuple[tuple[float, ...], ...]

    def tolerances(self, rtol: float) -> dict[str, list[float]]:
        """Return the default absolute tolerances by name, one per element for variables.

        Parameters
        ----------
        rtol : float
            Relative tolerance.

        Returns
        -------
        dict of str to list of float
            0 for a component without a scale.
        """
        scales = {"x": (self.x,), "v": (self.v,), **self.variables}
        return {name: [SHARE * rtol * u for u in row] for name, row in scales.items()}


def scales_of(model: Model | Contact, N: float = 1.0) -> Scales:
    """Return the scales of a model, or of a contact.

    Parameters
    ----------
    model : Model or Contact
        Any of them.
    N : float
        What its curve is multiplied by; 0 if that is not known.

    Returns
    -------
    Scales
        Derived from its guards, its force and its curve.
    """
    if isinstance(model, Contact) and model.model is not None:
        model = model.model
    curve, n = None, model.n
    thresholds = [0.0] * n
    if not isinstance(model, Contact) and "s" in model.chart.inputs:
        curve = model.stribeck
    if curve is not None:
        thresholds = as_floats(model.weights * (curve.F_c * N))
    numbers = [
        as_floats(np.asarray(value)) if np.ndim(value) else [float(value)] * n
        for value in model.values.values()
    ]
    elements = tuple(zip(thresholds, *numbers, strict=True))
    return _scales_of(ByIdentity(model.chart), elements, curve, N)


@functools.lru_cache(maxsize=32)
def _scales_of(
    key: ByIdentity[Chart],
    elements: tuple[tuple[float, ...], ...],
    curve: Stribeck | None,
    N: float,
) -> Scales:
    chart = key.it
    sizes = _sizes(key)
    found: dict[str, list[float]] = {name: [] for name in sizes.reach}
    lengths: list[float] = []
    for values in elements:
        at_rest = sizes.at_rest(values)
        for name, row in found.items():
            reaches = [_reach(at_rest, *margin) for margin in sizes.reach[name]]
            if curve is not None:
                reaches += [
                    abs(curve.F_c * N / at_rest[k])
                    for k in sizes.stiffness.get(name, ())
                    if at_rest[k]
                ]
            row.append(_least(reaches))
        for name, follows in sizes.follows.items():
            most = max(abs(at_rest[k]) for k in follows)
            lengths.append(_divided(found[name][-1], most))
    speeds = [u for name in chart.velocities for u in found[name]]
    windows = [WINDOW * u for u in speeds]
    v = [*windows, curve.v_s] if curve is not None else windows
    least_x = _least([*found["x"], *lengths])
    least_v = _least(v)
    speed = least_v if curve is None else curve.v_s
    paces = [sizes.paces((speed, *values)) for values in elements]
    fastest = max((abs(rate) for rates in paces for rate in rates), default=0.0)
    time = _divided(1.0, fastest) or _divided(least_x, speed)
    relaxing = tuple(
        tuple(
            _divided(1.0, min([0.0, *(rates[k] for k in sizes.relaxes[state.name])]))
            for state in chart.states
        )
        for rates in paces
    )
    variables = {name: tuple(found[name]) for name in chart.variables}
    slowest = _least(speeds)
    return Scales(least_x, least_v, variables, slowest, time, relaxing)


@dataclass(frozen=True)
class SystemScales:
    """Scales of a system's components; 0 for one without a scale.

    Parameters
    ----------
    sizes : mapping of str to list of float
        By name in the layout; one per element for variables.
    time : float
        s: relaxation time of the fastest flow; 0 if there is none.
    relaxing : list of list of float
        s: as in `Scales`, for each element of each contact.
    """

    sizes: Mapping[str, list[float]]
    time: float
    relaxing: list[list[float]]

    def tolerances(self, rtol: float) -> dict[str, list[float]]:
        """Return the default absolute tolerances by name, as `Scales.tolerances` does."""
        return {name: [SHARE * rtol * u for u in row] for name, row in self.sizes.items()}


def scales_of_system(system: System) -> SystemScales:
    """Return the scales of a system.

    Parameters
    ----------
    system : System
        What runs.

    Returns
    -------
    SystemScales
        Those of its contacts; a body's are the smallest of the contacts it takes part in.
    """
    banks = list(zip(system.shape.assembly.banks, system.contacts, strict=True))
    sizes: dict[str, list[float]] = {}
    times: list[float] = []
    relaxing: list[list[float]] = []
    moved: dict[str, tuple[list[float], list[float]]] = {b.name: ([], []) for b in system.bodies}
    for bank, contact in banks:
        scales = scales_of(contact, _load(bank, system))
        times.append(scales.time)
        relaxing += [list(row) for row in scales.relaxing]
        for name, plain in zip(bank.variables, bank.chart.variables, strict=True):
            sizes[name] = [*scales.variables[plain]]
        for row in bank.jacobian:
            for body, coefficient in row.items():
                ratio = _constant(coefficient, system)
                moved[body][0].append(_divided(scales.x, ratio))
                moved[body][1].append(_divided(scales.v, ratio))
    for each in system.bodies:
        for name, found in zip((each.x, each.v), moved[each.name], strict=True):
            sizes[name] = [_least(found)]
    for bank, contact in banks:
        if bank.periodic:
            sizes |= {name: [0.0] * contact.n for name in held_of(bank)}
            sizes |= {bank.held(force): [0.0] for force in bank.forces}
    for name in (*system.flow, *(u for sampler in system.sampled for u in sampler.updates)):
        sizes[name] = [0.0]
    return SystemScales(sizes, _least(times), relaxing)


def _load(bank: Bank, system: System) -> float:
    """Return what the curve of a contact is multiplied by at rest; 0 if that is not known."""
    read = system.shape.assembly
    if (given := read.defined.get(of(bank.name, CURVE_LOAD))) is None:
        return 1.0
    assert given.tree is not None
    tree, states = read.expanded(given.tree), {"t", *(u for b in system.bodies for u in (b.x, b.v))}
    N = _constant(renamed(tree, dict.fromkeys(states, Number(0.0))), system)
    return N if N > LEAST_LOAD else 0.0


def _constant(tree: Value, system: System) -> float:
    """Return the value of a coefficient; 0 if it cannot be computed."""
    if isinstance(tree, Number):
        return tree.value
    try:
        return float(evaluate(tree, system.numbers))
    except (ArithmeticError, ValueError, KeyError):
        return 0.0


# --------------------------------------------------------------------------- derived from a chart
@dataclass(frozen=True, eq=False)
class _Numbers:
    """Values of the threshold s and the parameters of a chart, 0 where one is undefined."""

    title: str
    arguments: str
    texts: Sequence[str]

    @functools.cached_property
    def _together(self) -> Callable[..., tuple[float, ...]]:
        return self._loaded("".join(f"{text}, " for text in self.texts))

    @functools.cached_property
    def _one_by_one(self) -> list[Callable[..., tuple[float, ...]]]:
        return [self._loaded(f"{text}, ") for text in self.texts]

    def _loaded(self, values: str) -> Callable[..., tuple[float, ...]]:
        text = f"def numbers({self.arguments}):\n    return ({values})\n"
        made: Callable[..., tuple[float, ...]] = load(self.title, text, {"sgn": _sign_from_above})[
            "numbers"
        ]
        return made

    def __call__(self, values: Sequence[float]) -> list[float]:
        try:
            found: Sequence[float] = self._together(*values)
        except (ArithmeticError, ValueError):
            found = [_number(each, values) for each in self._one_by_one]
        return [number if math.isfinite(number) else 0.0 for number in found]


@dataclass(frozen=True, eq=False)
class _Sizes:
    """Functions of a chart's parameters; the numbers are places in `at_rest`."""

    at_rest: _Numbers  # all at rest in the origin
    paces: _Numbers  # rates of the variables: negative where one relaxes
    relaxes: Mapping[str, Sequence[int]]  # by state, the places of constant rates in `paces`
    reach: Mapping[str, Sequence[tuple[int, ...]]]  # margins of guards, slopes and bends
    stiffness: Mapping[str, Sequence[int]]  # slopes of the forces
    follows: Mapping[str, Sequence[int]]  # slope of a variable with respect to x, by state


@functools.lru_cache(maxsize=64)
def _sizes(key: ByIdentity[Chart]) -> _Sizes:
    chart = key.it
    states = tuple(dict.fromkeys(("x", "v", *chart.velocities, *chart.variables)))
    rates = [f"d{name}" for name in chart.variables]
    others = [name for name in (*chart.inputs, *chart.velocities) if name != "s"]
    zero_at_rest = ("t", *states, *rates, *others)
    rest: dict[str, Value] = dict.fromkeys(zero_at_rest, Number(0.0))
    lets: dict[str, Value] = {}
    for name, tree in chart.lets.items():
        lets[name] = renamed(tree, lets)
    title, arguments = f"scale in {chart.name}", ", ".join(("s", *chart.parameter_names))
    places: dict[str, int] = {}

    def place(tree: Value) -> int:
        return places.setdefault(spell(renamed(tree, rest)), len(places))

    guards = chart.guards.values()
    late = {*chart.force_names, *chart.rate_names} - {*chart.parameter_names}
    pairs = dict.fromkeys(c for guard in guards for c in comparisons(split(guard)))
    margins = [
        margin
        for each in pairs
        if not names_in(margin := renamed(Binary("-", each.left, each.right), lets)) & late
    ]
    forces = dict.fromkeys(renamed(tree, lets) for tree in chart.forces.values() if tree)
    flows = {key: renamed(tree, lets) for key, tree in chart.flows.items()}
    reach = {
        name: [
            tuple(place(tree) for tree in (margin, slope, derivative(slope, name)) if tree)
            for margin in margins
            if name in names_in(margin) and (slope := derivative(margin, name)) is not None
        ]
        for name in states
    }
    stiffness = {
        name: [place(slope) for force in forces if (slope := derivative(force, name)) is not None]
        for name in chart.variables
    }
    follows = {
        name: [
            place(rate)
            for state in chart.states
            if (rate := derivative(flows[state.name, name], "v")) is not None
        ]
        for name in chart.variables
    }
    moving = {name: zero for name, zero in rest.items() if name != "v"}
    paces: dict[str, int] = {}
    relaxes: dict[str, list[int]] = {state.name: [] for state in chart.states}
    for (state, name), flow in flows.items():
        if (rate := derivative(flow, name)) is not None:
            k = paces.setdefault(spell(renamed(rate, moving)), len(paces))
            if all(derivative(rate, each) == Number(0.0) for each in zero_at_rest):
                relaxes[state].append(k)
    return _Sizes(
        _Numbers(title, arguments, [*places]),
        _Numbers(title, f"v, {arguments}", [*paces]),
        relaxes,
        reach,
        stiffness,
        {name: row for name, row in follows.items() if row},
    )


def _sign_from_above(u: float) -> float:
    """Return the sign of u with sgn(0) = 1: the slope of abs(z) at 0 is 1."""
    return 1.0 if u >= 0.0 else -1.0


def _number(function: Callable[..., tuple[float, ...]], values: Sequence[float]) -> float:
    """Evaluate a value at rest; 0 if it has none."""
    try:
        return function(*values)[0]
    except (ArithmeticError, ValueError):
        return 0.0


def _reach(numbers: Sequence[float], height: int, slope: int, bend: int | None = None) -> float:
    """Return where a margin is zero; by its bend if it is flat at rest, as v**2 + w**2 - e**2."""
    if steepness := numbers[slope]:
        return abs(numbers[height] / steepness)
    return 0.0 if bend is None else math.sqrt(_divided(2.0 * numbers[height], numbers[bend]))


def _least(numbers: Iterable[float]) -> float:
    """Return the smallest number above 0; 0 if there is none."""
    least = math.inf
    for number in numbers:
        if 0.0 < number < least:
            least = number
    return least if least < math.inf else 0.0


def _divided(a: float, b: float) -> float:
    """Return |a / b|, or 0 if it is undefined."""
    quotient = abs(a / b) if b else 0.0
    return quotient if math.isfinite(quotient) else 0.0
