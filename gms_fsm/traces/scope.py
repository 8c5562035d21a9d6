"""The values of names in a run, for guards, watches, monitors, `until` and replay pages.

A scope has one row of a run as numbers, or all rows as arrays. Names number elements from 1.

guards       of one element: ``t, x, v, s``, its variables and parameters; at one row also the
             other inputs, named expressions, forces and accelerations that its chart reads
watches      ``t, x, v, F``; ``s``, the Stribeck curve at v; ``z1``, ``s1``, ``F1`` ... of one
             element; ``state(1)``; for a model of one element its variables also without a number
invariants   as watches, but ``s``, variables and parameters without a number are those of each
             element, and the condition must hold for all elements
"""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.reader import called
from gms_fsm.errors import SignalError
from gms_fsm.foundation.quantities import per_second
from gms_fsm.language import MATLAB_LIKE, Condition, names_in, spell
from gms_fsm.language.normal import renamed_in
from gms_fsm.lowering.layout import BankPlaces, SystemLayout
from gms_fsm.lowering.observing import observe
from gms_fsm.lowering.program import Program
from gms_fsm.systems.models import Model
from gms_fsm.traces.trace import Trace

FORCE = "F_elements"  # the observed quantity that F1, F2 ... refer to


def watch_names(model: Model) -> list[str]:
    """Return the names allowed in conditions and watches over a run.

    Examples
    --------
    >>> from gms_fsm import LuGre, Stribeck
    >>> watch_names(LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3)))
    ['t', 'x', 'v', 'F', 's', 'z', 'z1', 's1', 'F1']
    """
    bare = model.chart.variables if model.n == 1 else ()
    return ["t", *_moving(model.chart), *_curve(model), *bare, *_numbered(model)]


def invariant_names(model: Model) -> list[str]:
    """Return the names allowed in an invariant."""
    chart = model.chart
    own = (*_curve(model), *chart.variables, *chart.parameter_names)
    return ["t", *_moving(chart), *own, *_numbered(model)]


def unit_of(chart: Chart, name: str) -> str:
    """Return the unit of a name in guards; empty if it is unknown."""
    known = {"t": "s", "age": "s"} | dict.fromkeys(chart.durations, "s")
    if chart.velocities:
        speed = per_second(chart.length)
        known |= dict.fromkeys(chart.force_names, chart.force) | {"x": chart.length}
        known |= dict.fromkeys(chart.velocities, speed)
        known |= dict.fromkeys(chart.rate_names, per_second(speed))
    return chart.unit(name) or known.get(name, "")


def clause_text(chart: Chart, part: Condition) -> str:
    """Return a clause of a guard as charts show it."""
    return spell(renamed_in(part, called(chart.durations)), MATLAB_LIKE)


def clause_unit(chart: Chart, part: Condition) -> str:
    """Return the unit of both sides of a comparison: that of its names, if all agree.

    Empty if they do not determine it.
    """
    units = {unit_of(chart, name) for name in names_in(part)} - {""}
    plain = not set(spell(part, MATLAB_LIKE)) & set("*/^()")
    return units.pop() if plain and len(units) == 1 else ""


def parameter_values(model: Model, element: int) -> dict[str, float]:
    """Return the parameter values of an element."""
    return {
        name: float(value if isinstance(value, float | int) else value[element])
        for name, value in model.values.items()
    }


def _moving(chart: Chart) -> tuple[str, ...]:
    """Return the names of what moves and what holds it; a supervisor has neither."""
    return ("x", "v", "F") if chart.velocities else ()


def _curve(model: Model) -> tuple[str, ...]:
    return () if model.stribeck is None else ("s",)


def _numbered(model: Model) -> Mapping[str, tuple[str, int]]:
    """Return the numbered names, each with its quantity and element."""
    chart = model.chart
    return _all_numbered((*chart.variables, *_curve(model)), bool(chart.velocities), model.n)


@functools.lru_cache(maxsize=64)  # `until` calls this for every state it tests
def _all_numbered(names: tuple[str, ...], moves: bool, n: int) -> Mapping[str, tuple[str, int]]:
    quantities = {name: name for name in names} | ({"F": FORCE} if moves else {})
    return {
        f"{name}{i + 1}": (quantity, i) for name, quantity in quantities.items() for i in range(n)
    }


@dataclass(frozen=True, eq=False)
class Scope:
    """The values of a run by name.

    Parameters
    ----------
    model : Model
        The simulated model.
    layout : SystemLayout
        Places of the values.
    t : float or ndarray, shape (rows,)
        Time, s.
    y : sequence of float, or ndarray, shape (places, rows)
        The state vector.
    seen : mapping of str to float, sequence of float, or ndarrays of shape (rows,) or (n, rows)
        ``v, F``; ``s`` and ``F_elements``, one per element; during a run also the rates.
    places : BankPlaces
        Where the quantities of the contact are.
    mode : sequence of int, or ndarray, shape (modes, rows)
        Modes of the elements and the surfaces.
    read : mapping of str to float or list of float, optional
        At one row, what else guards can read; a list has one value per element.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 1.0)
    >>> here, run = Scope.at(trace, -1), Scope.over(trace)
    >>> round(here.guards(0)["z"], 9), round(here.watches()["z1"], 9), here.states
    (0.2, 0.2, ['stick', 'stick', 'stick', 'stick'])
    >>> run.watches()["z1"].shape, run.invariants()["z"].shape
    ((7,), (4, 7))
    """

    model: Model
    layout: SystemLayout
    t: Any
    y: Any
    seen: Mapping[str, Any]
    mode: Any
    places: BankPlaces
    read: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        model: Model,
        program: Program,
        t: float,
        y: list[float],
        mode: Sequence[int],
        contact: str = "",
        observed: Mapping[str, Any] | None = None,
    ) -> Scope:
        """Return the scope of the present state of a run."""
        layout = program.layout
        places = layout.contact(contact)
        if observed is None:
            observed = layout.observed.named(observe(program, t, y, mode))
        seen = places.plain(observed)
        return cls(model, layout, t, y, seen, mode, places, _read(program, places, t, y, mode))

    @classmethod
    def at(cls, trace: Trace, row: int) -> Scope:
        """Return the scope of one row of a finished run."""
        seen = {
            trace.places.velocity: float(trace.v[row]),
            "F": float(trace.F[row]),
            "x": float(trace.x[row]),
            "s": trace.s[row].tolist(),
            FORCE: trace.F_elements[row].tolist(),
        }
        rows, program, places = trace.rows, trace.program, trace.places
        t, y, mode = float(rows.t[row]), rows.y[row].tolist(), rows.mode[row].tolist()
        read = _read(program, places, t, y, mode)
        return cls(trace.model, program.layout, t, y, seen, mode, places, read)

    @classmethod
    def over(cls, trace: Trace) -> Scope:
        """Return the scope of all rows of a finished run."""
        seen = {"F": trace.F, "x": trace.x, "s": trace.s.T, FORCE: trace.F_elements.T}
        for name in (*trace.model.chart.velocities, *trace.model.chart.force_names):
            seen[name] = trace.seen[trace.places.of(name)]
        rows, layout = trace.rows, trace.program.layout
        return cls(trace.model, layout, rows.t, rows.y.T, seen, rows.mode.T, trace.places)

    # ------------------------------------------------------------------ single quantities
    @property
    def x(self) -> Any:
        """Position, m."""
        position = self.places.position
        if not position:
            return math.nan
        if position in self.layout.y.shared:
            return self.y[self.layout.y.index(position)]
        return self.seen["x"]

    @property
    def v(self) -> Any:
        """Velocity, m/s."""
        return self.seen.get(self.places.velocity, math.nan)

    @property
    def F(self) -> Any:
        """Friction force, N."""
        return self.seen.get("F", math.nan)

    @property
    def z(self) -> Any:
        """The chart's first variable, one per element."""
        variables = self.places.variables
        return self.each(variables[0]) if variables else [math.nan] * self.places.n

    @property
    def s(self) -> Any:
        """Thresholds, m, one per element; NaN where the model has no Stribeck curve."""
        return self.each("s")

    @property
    def curve(self) -> Any:
        """The Stribeck curve at v, N; NaN where the model has none."""
        return self.s[0] / float(self.model.weights[0])

    @functools.cached_property
    def states(self) -> Any:
        """Names of the active states, one per element."""
        names = [state.name for state in self.model.chart.states]
        active = self.mode[self.places.elements]
        if isinstance(active, np.ndarray):
            return np.array(names)[active]
        return [names[mode] for mode in active]

    def each(self, name: str) -> Any:
        """Return a quantity of all elements."""
        bank = self.places
        if name in bank.variables:
            return self.y[self.layout.y.block(bank.of(name))]
        return self.seen.get(name, [math.nan] * bank.n)  # a supervisor has no force

    # ------------------------------------------------------------------ by name
    def guards(self, element: int) -> dict[str, Any]:
        """Return the values of the names allowed in guards of an element."""
        values = {name: u for name, u in self._shared().items() if name != "F"}
        values["s"] = self.s[element]
        for name, value in self.read.items():
            values[name] = value[element] if isinstance(value, list) else value
        for name in self.places.variables:
            values[name] = self.each(name)[element]
        for name in self.layout.events:
            values[name] = self.y[self.layout.y.index(name)]
        return values | parameter_values(self.model, element)

    def watches(self) -> dict[str, Any]:
        """Return the values of the names allowed in watches, and the states."""
        values = self._shared() | self._single() | self._numbered_states()
        if self.model.stribeck is not None:
            values["s"] = self.curve
        if self.model.n == 1:
            values |= {name: self.each(name)[0] for name in self.places.variables}
            values["state(0)"] = self.states[0]  # the value of `state`
        return values

    def invariants(self, *, states: bool = False) -> dict[str, Any]:
        """Return the values of the names allowed in invariants; only for scopes over arrays."""
        own = {name: self.each(name) for name in (*self.places.variables, *_curve(self.model))}
        for name, value in self.model.values.items():
            own[name] = value if np.ndim(value) == 0 else np.asarray(value)[:, np.newaxis]
        # A name defined by the chart takes precedence over a numbered one.
        values = self._single() | own | self._shared()
        if states:
            values |= self._numbered_states() | {"state(0)": self.states}
        return values

    def _shared(self) -> dict[str, Any]:
        moving = {name: getattr(self, name) for name in _moving(self.model.chart)}
        return {"t": self.t, **moving}

    def _single(self) -> dict[str, Any]:
        """Return the quantities of single elements under their numbered names."""
        quantities = {name: self.each(name) for name in (*self.places.variables, "s", FORCE)}
        names = _numbered(self.model).items()
        return {name: quantities[quantity][i] for name, (quantity, i) in names}

    def _numbered_states(self) -> dict[str, Any]:
        return {f"state({i + 1})": state for i, state in enumerate(self.states)}


def _read(
    program: Program, places: BankPlaces, t: float, y: list[float], mode: Sequence[int]
) -> dict[str, Any]:
    """Return what guards of a contact can read besides ``t, x, v, s``, variables, parameters."""
    shown, start = program.layout.shown, places.of("")
    known = {places.of(name) for name in ("x", places.velocity) if places.velocity}
    names = {name for name in (*shown.shared, *shown.own) if name.startswith(start)} - known
    if names <= {places.of("s")}:
        return {}
    out = [0.0] * shown.size
    program.ieee["values"](t, y, mode, program.p, program.calm, out)
    every = shown.named(out)
    return {name.removeprefix(start): every[name] for name in names}


def guard_columns(trace: Trace, names: Iterable[str]) -> dict[str, Any]:
    """Return the values of names in guards at all rows."""
    wanted, columns = set(names), Scope.over(trace).invariants()
    events = {*trace.program.layout.events} & wanted
    columns |= {name: trace.rows.y[:, trace.program.layout.y.index(name)] for name in events}
    found = {name: columns[name] for name in wanted & columns.keys()}
    program, rows, places = trace.program, trace.rows, trace.places
    if missing := sorted(wanted - columns.keys()):
        shown = program.layout.shown
        table = np.full((len(rows), shown.size), np.nan)
        modes = rows.mode.tolist()
        for row, (t, y) in enumerate(zip(rows.t.tolist(), rows.y.tolist(), strict=True)):
            out = [0.0] * shown.size
            with contextlib.suppress(SignalError):  # a Python function failed, or is lost
                program.ieee["values"](t, y, modes[row], program.p, program.calm, out)
                table[row] = out
        every = shown.named(table.T)
        found |= {name: every[places.of(name)] for name in missing}
    return found


class GuardValues:
    """Fast update of the values that guards can name, for all elements.

    The same values as `Scope.guards`, without the parameters, which do not change.

    Parameters
    ----------
    layout : SystemLayout
        Places of the values.
    """

    def __init__(self, layout: SystemLayout) -> None:
        y, shown = layout.y, layout.shown
        self._places: list[list[tuple[str, int]]] = []  # for each element, among those shown
        self._variables: list[list[tuple[str, int]]] = []  # and in the state vector
        for bank in layout.banks:
            start = bank.of("")
            names = [name for name in (*shown.shared, *shown.own) if name.startswith(start)]
            for i in range(bank.n):
                self._places.append(
                    [(name.removeprefix(start), shown.index(name, i)) for name in names]
                )
                own = [(name, y.index(bank.of(name), i)) for name in bank.variables]
                self._variables.append(own + [(name, y.index(name)) for name in layout.events])

    def put(
        self, t: float, y: Sequence[float], shown: Sequence[float], into: Sequence[dict[str, Any]]
    ) -> None:
        """Store the current values in one mapping per element."""
        rows = zip(into, self._places, self._variables, strict=True)
        for values, places, variables in rows:
            values["t"] = t
            for name, place in places:
                values[name] = shown[place]
            for name, place in variables:
                values[name] = y[place]
