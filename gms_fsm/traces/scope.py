"""The values of names in a run, for guards, watches, monitors, `until` and replay pages.

A scope has one row of a run as numbers, or all rows as arrays. Names number elements from 1.

guards       of one element: ``t, x, v, s``, its variables and parameters
watches      ``t, x, v, F``; ``s``, the Stribeck curve at v; ``z1``, ``s1``, ``F1`` ... of one
             element; ``state(1)``; for a model of one element its variables also without a number
invariants   as watches, but ``s``, variables and parameters without a number are those of each
             element, and the condition must hold for all elements
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm.lowering._observing import observe
from gms_fsm.lowering.layout import Layout
from gms_fsm.lowering.program import Program
from gms_fsm.systems.models import Model
from gms_fsm.traces.trace import Trace

__all__ = ["GuardValues", "Scope", "invariant_names", "parameter_values", "watch_names"]

FORCE = "F_elements"  # the observed quantity that F1, F2 ... refer to


def watch_names(model: Model) -> list[str]:
    """Return the names allowed in conditions and watches over a run.

    Parameters
    ----------
    model : Model
        The simulated model.

    Returns
    -------
    list of str
        Without ``state(1)``, which is built into the expression language.

    Examples
    --------
    >>> from gms_fsm import LuGre, Stribeck
    >>> watch_names(LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3)))
    ['t', 'x', 'v', 'F', 's', 'z', 'z1', 's1', 'F1']
    """
    bare = model.chart.variables if model.n == 1 else ()
    return ["t", "x", "v", "F", *_curve(model), *bare, *_numbered(model)]


def invariant_names(model: Model) -> list[str]:
    """Return the names allowed in an invariant.

    Parameters
    ----------
    model : Model
        The simulated model.

    Returns
    -------
    list of str
        Without ``state`` and ``state(1)``.
    """
    chart = model.chart
    own = (*_curve(model), *chart.variables, *chart.parameter_names)
    return ["t", "x", "v", "F", *own, *_numbered(model)]


def parameter_values(model: Model, element: int) -> dict[str, float]:
    """Return the parameter values of an element.

    Parameters
    ----------
    model : Model
        The simulated model.
    element : int
        Index, from 0.

    Returns
    -------
    dict of str to float
        Values by parameter name.
    """
    return {
        name: float(value if isinstance(value, float | int) else value[element])
        for name, value in model.values.items()
    }


def _curve(model: Model) -> tuple[str, ...]:
    return () if model.stribeck is None else ("s",)


def _numbered(model: Model) -> Mapping[str, tuple[str, int]]:
    """Return the numbered names, each with its quantity and element."""
    return _all_numbered((*model.chart.variables, *_curve(model)), model.n)


@functools.lru_cache(maxsize=64)  # `until` calls this for every state it tests
def _all_numbered(names: tuple[str, ...], n: int) -> Mapping[str, tuple[str, int]]:
    quantities = {name: name for name in names} | {"F": FORCE}
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
    layout : Layout
        Places of the values.
    t : float or ndarray, shape (rows,)
        Time, s.
    y : sequence of float, or ndarray, shape (places, rows)
        The state vector.
    seen : mapping of str to float, sequence of float, or ndarrays of shape (rows,) or (n, rows)
        ``v, F``; ``s`` and ``F_elements``, one per element; during a run also the rates.
    mode : sequence of int, or ndarray, shape (modes, rows)
        Modes of the elements and the surfaces.

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
    layout: Layout
    t: Any
    y: Any
    seen: Mapping[str, Any]
    mode: Any

    @classmethod
    def of(
        cls, model: Model, program: Program, t: float, y: list[float], mode: Sequence[int]
    ) -> Scope:
        """Return the scope of the present state of a run.

        Parameters
        ----------
        model : Model
            The simulated model.
        program : Program
            Its generated program.
        t : float
            Time, s.
        y : list of float, shape (m,)
            State.
        mode : sequence of int, shape (modes,)
            Modes of the elements and the surfaces.

        Returns
        -------
        Scope
            With numbers as values.
        """
        layout = program.layout
        seen = layout.observed.named(observe(program, t, y, mode))
        return cls(model, layout, t, y, seen, mode)

    @classmethod
    def at(cls, trace: Trace, row: int) -> Scope:
        """Return the scope of one row of a finished run.

        Parameters
        ----------
        trace : Trace
            The run.
        row : int
            Row index; negative counts from the end.

        Returns
        -------
        Scope
            With numbers as values, identical to those seen by the run.
        """
        seen = {
            "v": float(trace.v[row]),
            "F": float(trace.F[row]),
            "s": trace.s[row].tolist(),
            FORCE: trace.F_elements[row].tolist(),
        }
        rows, layout = trace.rows, trace.program.layout
        y, mode = rows.y[row].tolist(), rows.mode[row].tolist()
        return cls(trace.model, layout, float(rows.t[row]), y, seen, mode)

    @classmethod
    def over(cls, trace: Trace) -> Scope:
        """Return the scope of all rows of a finished run.

        Parameters
        ----------
        trace : Trace
            The run.

        Returns
        -------
        Scope
            With arrays as values, whose last axis is the row.
        """
        seen = {"v": trace.v, "F": trace.F, "s": trace.s.T, FORCE: trace.F_elements.T}
        rows, layout = trace.rows, trace.program.layout
        return cls(trace.model, layout, rows.t, rows.y.T, seen, rows.mode.T)

    # ------------------------------------------------------------------ single quantities
    @property
    def x(self) -> Any:
        """Position, m."""
        return self.y[self.layout.y.index("x")]

    @property
    def v(self) -> Any:
        """Velocity, m/s."""
        return self.seen["v"]

    @property
    def F(self) -> Any:
        """Friction force, N."""
        return self.seen["F"]

    @property
    def z(self) -> Any:
        """The chart's first variable, one per element."""
        return self.each(self.layout.variable)

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
        active = self.mode[self.layout.elements]
        if isinstance(active, np.ndarray):
            return np.array(names)[active]
        return [names[mode] for mode in active]

    def each(self, name: str) -> Any:
        """Return a quantity of all elements.

        Parameters
        ----------
        name : str
            A variable of the chart, or one of `seen`.

        Returns
        -------
        sequence of float, or ndarray, shape (n, rows)
            One per element.
        """
        if name in self.layout.y.own:
            return self.y[self.layout.y.block(name)]
        return self.seen[name]

    # ------------------------------------------------------------------ by name
    def guards(self, element: int) -> dict[str, Any]:
        """Return the values of the names allowed in guards of an element.

        Parameters
        ----------
        element : int
            Index, from 0.

        Returns
        -------
        dict of str to float, or to ndarray, shape (rows,)
            Values by name.
        """
        values = {"t": self.t, "x": self.x, "v": self.v, "s": self.s[element]}
        for name in self.layout.y.own:
            values[name] = self.each(name)[element]
        return values | parameter_values(self.model, element)

    def watches(self) -> dict[str, Any]:
        """Return the values of the names allowed in watches, and the states.

        Returns
        -------
        dict of str to float, or to ndarray, shape (rows,)
            Values by name. State names are under ``state(1)``, for a single element also under
            ``state(0)``.
        """
        values = self._shared() | self._single() | self._numbered_states()
        if self.model.stribeck is not None:
            values["s"] = self.curve
        if self.model.n == 1:
            values |= {name: self.each(name)[0] for name in self.layout.y.own}
            values["state(0)"] = self.states[0]  # the value of `state`
        return values

    def invariants(self, *, states: bool = False) -> dict[str, Any]:
        """Return the values of the names allowed in invariants; only for scopes over arrays.

        Parameters
        ----------
        states : bool
            Whether to add the states.

        Returns
        -------
        dict of str to ndarray, shape (n, rows), (n, 1), (rows,) or ()
            Values by name. State names are under ``state(1)``, those of each element under
            ``state(0)``.
        """
        own = {name: self.each(name) for name in (*self.layout.y.own, *_curve(self.model))}
        for name, value in self.model.values.items():
            own[name] = value if np.ndim(value) == 0 else np.asarray(value)[:, np.newaxis]
        # A name defined by the chart takes precedence over a numbered one.
        values = self._single() | own | self._shared()
        if states:
            values |= self._numbered_states() | {"state(0)": self.states}
        return values

    def _shared(self) -> dict[str, Any]:
        return {"t": self.t, "x": self.x, "v": self.v, "F": self.F}

    def _single(self) -> dict[str, Any]:
        """Return the quantities of single elements under their numbered names."""
        quantities = {name: self.each(name) for name in (*self.layout.y.own, "s", FORCE)}
        names = _numbered(self.model).items()
        return {name: quantities[quantity][i] for name, (quantity, i) in names}

    def _numbered_states(self) -> dict[str, Any]:
        return {f"state({i + 1})": state for i, state in enumerate(self.states)}


class GuardValues:
    """Fast update of the values that guards can name, for all elements.

    The same values as `Scope.guards`, without the parameters, which do not change.

    Parameters
    ----------
    layout : Layout
        Places of the values.
    """

    def __init__(self, layout: Layout) -> None:
        y, seen = layout.y, layout.observed
        self._x, self._v = y.index("x"), seen.index("v")
        self._own = [
            (seen.index("s", i), [(name, y.index(name, i)) for name in y.own])
            for i in range(layout.n)
        ]

    def put(
        self, t: float, y: Sequence[float], seen: Sequence[float], into: Sequence[dict[str, Any]]
    ) -> None:
        """Store the current values in one mapping per element.

        Parameters
        ----------
        t : float
            Time, s.
        y, seen : sequence of float
            State vector, and the quantities observed of it, by place.
        into : sequence of dict, length n
            Modified in place.
        """
        x, v = y[self._x], seen[self._v]
        for values, (threshold, variables) in zip(into, self._own, strict=True):
            values["t"], values["x"], values["v"], values["s"] = t, x, v, seen[threshold]
            for name, place in variables:
                values[name] = y[place]
