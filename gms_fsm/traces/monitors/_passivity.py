"""The passivity monitor: whether an element gave back more energy than it had taken."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import SignalError
from gms_fsm.language import MATLAB_LIKE, Binary, Name, Value, evaluate, spell
from gms_fsm.systems.models import Model
from gms_fsm.traces.between import slopes
from gms_fsm.traces.monitors._kinds import Passivity, elements_text
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import PassivityVerdict


def passivity(monitor: Passivity, trace: Trace) -> PassivityVerdict:
    spring = _spring(trace.model)
    if spring is None or _held(trace):
        return PassivityVerdict(True, f"not applicable: {_why_not(trace)}", False)
    k, sigma = spring
    t, z = trace.t, trace.z
    with np.errstate(all="ignore"):  # the run may have grown without bound
        lost, doubt = _lost(trace, k, sigma)
        wound = 0.5 * k * np.diff(z**2, axis=0)
        endless = np.flatnonzero(~np.isfinite(lost + wound + doubt).all(axis=1))
        end = int(endless[0]) if endless.size else len(lost)
        lost, wound, doubt = lost[:end], wound[:end], doubt[:end]
    turnover = np.abs(lost + wound).sum(axis=0)
    # The solver knows z only to its absolute tolerance.
    allowed: Any = trace.settings["atol"]
    layout, first = trace.program.layout, trace.places.of(_z(trace))
    allowed = allowed[layout.label(first)] if isinstance(allowed, Mapping) else allowed
    blur = k * np.abs(z[: end + 1]).max(axis=0, initial=0.0) * np.asarray(allowed or 0.0)
    tolerance = monitor.tolerance * turnover + doubt.sum(axis=0) + blur
    n = trace.n
    heat = np.concatenate([np.zeros((1, n)), lost.cumsum(axis=0)])
    times = t if t.size else np.array([trace.settings["t_start"]], dtype=np.float64)
    lowest, element = heat.argmin(axis=0), np.arange(n)
    deficit = heat[0] - heat[lowest, element]  # 0.0 at the start
    fall = np.maximum.accumulate(heat, axis=0) - heat
    until = fall.argmax(axis=0)
    since = [int(heat[: until[i] + 1, i].argmax()) for i in range(n)]
    made = fall[until, element]
    verdict = PassivityVerdict(
        ok=bool((deficit <= tolerance).all()),
        text="",
        applicable=True,
        taken=tuple((lost + wound).sum(axis=0).tolist()),
        stored=tuple(wound.sum(axis=0).tolist()),
        deficit=tuple(deficit.tolist()),
        t_deficit=tuple(times[lowest].tolist()),
        made=tuple(made.tolist()),
        made_from=tuple(times[since].tolist()),
        made_until=tuple(times[until].tolist()),
        tolerance=tuple(tolerance.tolist()),
    )
    parts = _sentences(verdict, trace, lost)
    if endless.size:
        parts.append(f"values are not finite after t = {t[end]:.6g} s")
    if (doubt.sum(axis=0) > 0.01 * turnover).any():
        parts.append(
            "the rows are too far apart for these sums: keep every step (output='all'), or use "
            "shorter steps"
        )
    return replace(verdict, text="; ".join(parts))


def _held(trace: Trace) -> bool:
    """Return whether the contact has a period, so that its force is not that of its variables."""
    return getattr(trace.model, "period", None) is not None or trace.settings["events"] == "held"


def _why_not(trace: Trace) -> str:
    """Say why the energy of a contact cannot be computed."""
    chart, spring = trace.model.chart, "a spring force k * z [+ sigma * dz]"
    if len(chart.velocities) > 1:
        along = " and ".join(chart.velocities)
        return f"the contact moves by {along}, and only {spring} along one velocity is checked"
    forces = [spell(tree, MATLAB_LIKE) for tree in _forces(trace.model) if tree is not None]
    if not forces:
        return f"F is what holds the contact, not {spring}"
    if len(forces) > 1:
        return f"F depends on the state ({' or '.join(forces)}), and only {spring} is checked"
    if _spring(trace.model) is not None:
        return f"the contact has a period, and F is held between ticks, so it is not {spring}"
    return f"F = {forces[0]} is not {spring}"


def _forces(model: Model) -> list[Value | None]:
    """Return the different forces of an element over its states; None for that of a locked one."""
    states = model.chart.states
    found = (model.chart.forces.get((state.name, "F")) for state in states)  # none of a supervisor
    return list(dict.fromkeys(found))


def _spring(model: Model) -> tuple[FloatArray, FloatArray] | None:
    """Return stiffness and damping of each element, shape (n,), if its force has no other terms."""
    forces, values = _forces(model), model.values
    if len(forces) != 1 or not model.chart.variables:
        return None
    z = model.chart.variables[0]
    match forces[0]:
        case Binary("+", Binary("*", Name(k), Name(bristle)), Binary("*", Name(sigma), Name(rate))):
            known = rate == f"d{z}" and sigma in values
        case Binary("*", Name(k), Name(bristle)):
            sigma, known = "", True
        case _:
            return None
    if not known or bristle != z or k not in values:
        return None
    return np.full(model.n, values[k]), np.full(model.n, values.get(sigma, 0.0))


# Between two rows x and z are the cubics of `Trace.sample`. The heat
# integral of F_i v - k z dz = k z (v - dz) + sigma dz v is then a polynomial of degree 5 in
# time, for which three Gauss points are exact.
GAUSS = ((0.5 - math.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + math.sqrt(0.15), 5 / 18))


def _lost(trace: Trace, k: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the heat produced between adjacent rows, shape (rows - 1, n), and its uncertainty."""
    t, x, v = trace.t[:, np.newaxis], trace.x[:, np.newaxis], trace.v[:, np.newaxis]
    h, z, dz = np.diff(t, axis=0), trace.z, trace.dz
    lost, doubt = _heat(k, sigma, h, x[:-1], x[1:], z[:-1], z[1:], v[:-1], v[1:], dz[:-1], dz[1:])
    # At a stop the rates of a row may be those of the far side. Where this matters, recompute them
    # from inside the interval.
    counts = (doubt > 1e-7 * np.abs(lost).sum(axis=0)).any(axis=1) & (h[:, 0] > 0.0)
    left = np.flatnonzero(counts)
    if left.size and trace.settings["events"] == "located":
        try:
            rates = np.array([_rates(trace, row) for row in left.tolist()])
        except SignalError:  # a trace from a file has lost a signal that was a Python function
            return lost, doubt
        right, places = left + 1, trace.program.layout.y
        v0, v1 = np.moveaxis(_velocity(trace, rates)[:, :, np.newaxis], 1, 0)
        dz0, dz1 = np.moveaxis(rates[:, :, places.block(trace.places.of(_z(trace)))], 1, 0)
        lost[left], doubt[left] = _heat(
            k, sigma, h[left], x[left], x[right], z[left], z[right], v0, v1, dz0, dz1
        )
    return lost, doubt


def _velocity(trace: Trace, rates: FloatArray) -> FloatArray:
    """Return the velocity of the contact, given the rates of the state vector on the last axis."""
    system = trace.what.system
    index = [contact.name for contact in system.machines].index(trace.places.name)
    row = system.assembly.banks[index].jacobian[0]
    total = np.zeros(rates.shape[:-1])
    for body in system.bodies:
        if body.name in row:
            place = trace.program.layout.y.index(body.x)
            total = total + evaluate(row[body.name], dict(system.numbers)) * rates[..., place]
    return total


def _z(trace: Trace) -> str:
    return trace.model.chart.variables[0]


def _heat(
    k: FloatArray,
    sigma: FloatArray,
    h: FloatArray,
    x0: FloatArray,
    x1: FloatArray,
    z0: FloatArray,
    z1: FloatArray,
    v0: FloatArray,
    v1: FloatArray,
    dz0: FloatArray,
    dz1: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    inverse = np.divide(1.0, h, out=np.zeros_like(h), where=h > 0.0)
    rise_x, rise_z = x1 - x0, z1 - z0
    bend_x, bend_z = h * v0 - rise_x, h * dz0 - rise_z
    twist_x, twist_z = rise_x - h * v1 - bend_x, rise_z - h * dz1 - bend_z
    heat = np.zeros_like(rise_z)
    for theta, weight in GAUSS:
        a, b = 1 - 2 * theta, theta * (2 - 3 * theta)
        moved = rise_x + a * bend_x + b * twist_x
        wound = rise_z + a * bend_z + b * twist_z
        z = z0 + theta * (rise_z + (1 - theta) * (bend_z + theta * twist_z))
        heat += weight * (k * z * (moved - wound) + sigma * wound * moved * inverse)
    ends = [k * z * (v - dz) + sigma * dz * v for z, v, dz in ((z0, v0, dz0), (z1, v1, dz1))]
    # The trapezoid rule has an error of O(h^3); its square over the heat is O(h^5), as here.
    rough = np.abs(heat - 0.5 * h * (ends[0] + ends[1]))
    size = np.maximum(np.abs(heat), 0.5 * h * (np.abs(ends[0]) + np.abs(ends[1])))
    share = np.divide(rough, size, out=np.zeros_like(rough), where=size > 0.0)
    return heat, rough * np.minimum(1.0, share)


def _rates(trace: Trace, row: int) -> tuple[FloatArray, FloatArray]:
    """Return the one-sided slopes at a row and the next, seen from between them."""
    rows = trace.rows
    return slopes(
        trace.program,
        rows.mode[row].tolist(),
        float(rows.t[row]),
        rows.y[row],
        float(rows.t[row + 1]),
        rows.y[row + 1],
    )


def _sentences(verdict: PassivityVerdict, trace: Trace, lost: FloatArray) -> list[str]:
    """Describe the energies in words."""
    chart, tolerance = trace.model.chart, verdict.tolerance
    over = [i for i in range(trace.n) if verdict.deficit[i] > tolerance[i]]
    made = [i for i in range(trace.n) if verdict.made[i] > tolerance[i]]
    parts = [
        f"no element gave back more energy than it had taken (tolerance {max(tolerance):.2g} J)"
    ]
    if over:
        i = max(over, key=lambda i: verdict.deficit[i])
        others = f" ({elements_text(j for j in over if j != i)} too)" if over[1:] else ""
        parts = [
            f"{elements_text([i])}{others} had created {verdict.deficit[i]:.6g} J by "
            f"t = {verdict.t_deficit[i]:.6g} s (tolerance {tolerance[i]:.2g} J)"
        ]
    if made:
        i = max(made, key=lambda i: verdict.made[i])
        state = chart.states[int(trace.modes[int(lost[:, i].argmin()), i])]
        z = _z(trace)
        parts.append(
            f"the most energy created between two times: {elements_text([i])}, "
            f"{verdict.made[i]:.6g} J from t = {verdict.made_from[i]:.6g} to "
            f"{verdict.made_until[i]:.6g} s, mostly in {state.name}, where "
            f"d{z} = {state.flow.get(z, '0')} moves {z} differently from the motion"
        )
    if over and chart == GMS_ELEMENT["published"]:
        parts.append(
            "the published law does this whenever an element slips backward; try law='signed'"
        )
    return parts
