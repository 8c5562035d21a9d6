"""The energy that goes through a run: what is put in, and where friction and dampers take it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.language import evaluate, names_in, parse_value, values_of
from gms_fsm.lowering.observing import armed, rate
from gms_fsm.traces.impulses import impulses_of
from gms_fsm.traces.rows import Rows, merged
from gms_fsm.traces.system_scope import SystemScope
from gms_fsm.traces.trace import Trace
from integrators import METHODS

METHOD = METHODS["dp45"]


@dataclass(frozen=True)
class EnergyBalance:
    """What becomes of the energy of a motion that returns to where it began.

    Parameters
    ----------
    put_in : float
        J: the work of the forces on the bodies, and of what drives bodies and moves the ends of
        springs.
    contacts, dampers : dict of str to float
        J: what each contact takes, with its impulses, and what the damper of each spring takes. On
        a `gms_fsm.Belt` motions are those over the belt, also for the damper.

    Examples
    --------
    >>> EnergyBalance(0.3, {"pad": 0.2}, {"shaft": 0.1}).missing < 1e-16
    True
    """

    put_in: float
    contacts: dict[str, float]
    dampers: dict[str, float]

    @property
    def dissipated(self) -> float:
        """J: what contacts and dampers take together."""
        return math.fsum((*self.contacts.values(), *self.dampers.values()))

    @property
    def missing(self) -> float:
        """J: what is put in and not dissipated; 0 but for the error of the run."""
        return self.put_in - self.dissipated


def balance_of(trace: Trace) -> EnergyBalance:
    """Integrate the powers of a run."""
    system, numbers = trace.what.system, dict(trace.what.system.numbers)
    read, bodies = system.assembly, {body.name: body for body in system.bodies}
    fine, weights = _stages(trace)
    scope = SystemScope.over(fine)

    def integral(power: Any) -> float:
        return math.fsum(weights * power)

    def speed(body: str) -> FloatArray:
        return np.asarray(scope.value(bodies[body].v))

    contacts, dampers = {}, {}
    power: Any = np.zeros(weights.size)
    for name, force in read.forces.items():
        power = power + speed(name) * values_of(
            force, {each: scope.value(each) for each in ("t", *names_in(force))}
        )
    for bank in read.banks:
        seen, chart = scope.contacts[bank.name].seen, bank.chart
        taken: Any = 0.0
        for v, F, row in zip(chart.velocities, chart.force_names, bank.jacobian, strict=False):
            taken = taken + seen[F] * seen[v]
            for body, share in row.items():
                if bodies[body].driven:
                    power = power + seen[F] * evaluate(share, numbers) * speed(body)
        if chart.velocities:
            contacts[bank.name] = integral(taken)
    for each in system.springs:
        d, ratio = (
            evaluate(parse_value(str(u), [*numbers]), numbers) for u in (each.d, each.ratio)
        )
        if d:
            other = 0.0 if each.second is None else ratio * speed(each.second)
            lost = d * (speed(each.first) - other) ** 2
            power, dampers[each.name] = power + lost, integral(lost)
    for hit in impulses_of(trace):
        contacts[str(hit.carrier)] += float(hit.energy)
    return EnergyBalance(integral(power), contacts, dampers)


def _stages(trace: Trace) -> tuple[Trace, FloatArray]:
    """Return a run at the stages of steps from row to row, and their weights in an integral.

    They integrate a power as accurately as a step does its state, an interpolation does not.
    """
    program, table = trace.program, merged(trace.rows, trace.stops)
    t, y, place, weights = [], [], [], []
    for k in np.flatnonzero(np.diff(table.t) > 0.0).tolist():
        start, end, mode = float(table.t[k]), float(table.t[k + 1]), table.mode[k].tolist()
        h, middle = end - start, 0.5 * (table.y[k] + table.y[k + 1])
        held = armed(program, 0.5 * (start + end), middle.tolist(), mode)
        slopes: list[FloatArray] = []
        for row, share, at in zip(METHOD.A, METHOD.B, METHOD.C, strict=True):
            inner = table.y[k] + h * sum((a * f for a, f in zip(row, slopes, strict=False)), 0.0)
            t.append(min(start + at * h, end))
            slopes.append(rate(program, t[-1], inner.tolist(), mode, held))
            y.append(inner)
            place.append(k)
            weights.append(share * h)
    rows = Rows(np.array(t), np.zeros(len(t), dtype=np.int64), np.array(y), table.mode[place])
    return replace(trace, rows=rows, stops=rows, stored={}), np.array(weights)
