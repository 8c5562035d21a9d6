"""What impulses took from the bodies, and which contacts carried them, from the rows of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gms_fsm.language import evaluate
from gms_fsm.lowering.observing import observe
from gms_fsm.lowering.printing.names import ENDLESS
from gms_fsm.systems.reading.assembly import Bank, of

if TYPE_CHECKING:
    from gms_fsm.traces.trace import Trace


FIELDS = ("t", "microstep", "contact", "edge", "carrier", "velocity", "P", "energy")
NONE = 1e-12  # of the largest impulse: less is rounding


def impulses_of(trace: Trace) -> np.recarray:
    """Return what impulses took: a record for each contact that carried a part of one.

    ``t``, ``microstep``, ``contact`` and ``edge`` of the impulse, then the ``carrier``, its
    ``velocity``, the impulse ``P`` [N s] on it and the ``energy`` [J] that it took from the bodies.
    The impulses P solve M dw = -J' P over the contact whose edge fired and the locks that carry;
    the energy is P times the mean of the velocities before and after. With ``output="end"`` there
    are none.
    """
    system = trace.what.system
    read, layout, stops = system.assembly, trace.program.layout, trace.stops
    firings = trace.firings if trace.every is None else trace.every
    free = [layout.y.index(body.v) for body in read.free]
    edges = [(bank, edge) for bank in read.banks for edge in bank.edges]
    numbers = dict(system.numbers)
    found: list[tuple[float, int, str, str, str, str, float, float]] = []
    step, last = 0, np.nan
    for t, code in zip(firings.t.tolist(), firings.edge.tolist(), strict=True):
        step, last = (step + 1 if t == last else 1), t
        bank, edge = edges[code]
        if not bank.is_impulse(edge):
            continue
        row = int(np.searchsorted(stops.t, t))
        row += int(np.flatnonzero(stops.microstep[row:] == step)[0])
        carriers = [bank] + [
            each for each in read.banks if each is not bank and _carries(trace, each, row)
        ]
        places = [(each, q) for each in carriers for q in range(len(each.velocities))]
        J = [
            [
                evaluate(each.jacobian[q][body.name], numbers)
                if body.name in each.jacobian[q]
                else 0
                for body in read.free
            ]
            for each, q in places
        ]
        M = [evaluate(read.inertias[body.name], numbers) for body in read.free]
        change = -np.array(M) * (stops.y[row] - stops.y[row - 1])[free]
        P, *_ = np.linalg.lstsq(np.array(J, dtype=float).T, change, rcond=None)
        before, after = (
            observe(trace.program, t, stops.y[k].tolist(), stops.mode[k].tolist())
            for k in (row - 1, row)
        )
        for (each, q), p in zip(places, P.tolist(), strict=True):
            v = each.chart.velocities[q]
            place = layout.observed.index(of(each.name, v))
            if abs(p) > NONE * np.abs(P).max():
                energy = 0.5 * p * (before[place] + after[place])
                found.append((t, step, bank.name, edge.name, each.name, v, p, energy))
    if trace.which:
        found = [each for each in found if trace.which in (each[2], each[4])]
    kinds = ["f8", "i8", "U64", "U64", "U64", "U64", "f8", "f8"]
    return np.array(found, dtype=[*zip(FIELDS, kinds, strict=True)]).view(np.recarray)


def _carries(trace: Trace, bank: Bank, row: int) -> bool:
    """Return whether a contact is locked and does not let go of a force without limit."""
    stops, program = trace.stops, trace.program
    t, y, modes = float(stops.t[row]), stops.y[row].tolist(), stops.mode[row].tolist()
    state = bank.states[modes[program.layout.contact(bank.name).first]]
    if state not in bank.locked:
        return False
    chart, layout, shown = bank.chart, program.layout, [0.0] * program.layout.shown.size
    program.ieee["values"](t, y, modes, program.p, program.calm, shown)
    named = {**layout.y.named(y), **layout.shown.named(shown), **bank.contact.values}
    values = {"t": t} | {
        name.removeprefix(of(bank.name, "")): np.ravel(value)[0] for name, value in named.items()
    }
    guards = [chart.guards[edge.name] for _, edge in chart.leaving(state)]
    return not all(
        any(evaluate(guard, values | dict.fromkeys(chart.force_names, F)) for guard in guards)
        for F in (-ENDLESS, ENDLESS)
    )
