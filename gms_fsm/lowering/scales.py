"""Characteristic sizes of a model, from which its default tolerances are derived.

A component's scale is the smallest size at which something in the model changes: the deflection at
which a guard turns true (w F_c for a GMS element), the deflection that carries the Coulomb friction
alone (F_c / k), the velocities v_c and v_s. Scales depend only on the model, never on rig, signal
or duration, so that a run in other units, or on another rig, is as accurate.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.parameters import as_floats
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.foundation.equality import ByIdentity
from gms_fsm.lowering.adapting import SHARE
from gms_fsm.lowering.generated import CarefulText, ieee, load
from gms_fsm.lowering.printing.scale_text import HELPERS, scale_text
from gms_fsm.lowering.program import Program
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

__all__ = ["Scales", "Setting", "SystemScales", "Tolerance", "scales_of", "scales_of_system"]

Tolerance: TypeAlias = float | Mapping[str, ArrayLike] | None  # absolute, as given
Setting: TypeAlias = str | float | Mapping[str, float | list[float]] | None  # of a run, as stored


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
    if not isinstance(model, Contact) and "s" in model.chart.inputs:
        curve = model.stribeck
    weights = [0.0] * n if curve is None else as_floats(model.weights)
    numbers = [
        as_floats(np.asarray(value)) if np.ndim(value) else [float(value)] * n
        for value in model.values.values()
    ]
    elements = tuple(zip(weights, *numbers, strict=True))
    return _scales_of(ByIdentity(model.chart), elements, curve, N)


@functools.lru_cache(maxsize=32)
def _scales_of(
    key: ByIdentity[Chart],
    elements: tuple[tuple[float, ...], ...],
    curve: Stribeck | None,
    N: float,
) -> Scales:
    chart, n, states = key.it, len(elements), len(key.it.states)
    sizes, relaxing = [0.0] * (n * len(chart.variables)), [0.0] * (n * states)
    weights, *numbers = ([float(u) for u in row] for row in zip(*elements, strict=True))
    F_c, v_s = (0.0, 0.0) if curve is None else (curve.F_c, curve.v_s)
    function = _function(key, curve is not None)
    x, v, speed, time = map(
        float, function(n, N, F_c, v_s, weights, *numbers, 0, sizes, 0, states, relaxing)
    )
    rows = np.reshape(sizes, (len(chart.variables), n)).tolist()
    relaxation = np.reshape(relaxing, (n, states)).tolist()
    variables = dict(zip(chart.variables, map(tuple, rows), strict=True))
    return Scales(x, v, variables, speed, time, tuple(map(tuple, relaxation)))


@functools.lru_cache(maxsize=64)
def _function(key: ByIdentity[Chart], curved: bool) -> Callable[..., Any]:
    """Return the function that finds the scales of a chart, all parameters as arrays."""
    every = frozenset(key.it.parameter_names)
    source = "\n".join(scale_text(key.it, "scale", every, curved=curved)) + "\n"
    title = f"scales of {key.it.name}"
    fast, careful = load(title, source, HELPERS), CarefulText(title, source, HELPERS)
    return ieee(fast["scale"], careful["scale"])


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


def scales_of_system(program: Program) -> SystemScales:
    """Return the scales of a system.

    Parameters
    ----------
    program : Program
        With the system's numbers.

    Returns
    -------
    SystemScales
        Those of its contacts; a body's are the smallest of the contacts it takes part in.
    """
    layout = program.layout
    widths = [len(bank.states) for bank in program.plan.read.banks for _ in range(bank.n)]
    most = max(widths, default=0)
    sizes, times, relaxing = [0.0] * layout.y.size, [0.0], [0.0] * (most * len(widths))
    program.adaptive.functions["scale"](program.p, sizes, times, relaxing)
    names = (*layout.y.shared, *layout.y.own)
    by_element = np.reshape(relaxing, (len(widths), most)).tolist()
    return SystemScales(
        {name: [sizes[k] for k in layout.y.all_of(name)] for name in names},
        times[0],
        [row[:width] for row, width in zip(by_element, widths, strict=True)],
    )
