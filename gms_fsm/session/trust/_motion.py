"""How the motion went on: slides, places without a unique answer, impulses, growth by itself."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.quantities import in_words
from gms_fsm.language import derivative, names_in, values_of
from gms_fsm.lowering.observing import on_surfaces
from gms_fsm.session.trust._gathering import Gathering
from gms_fsm.session.trust._path import Track
from gms_fsm.traces.scope import guard_columns
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import Doubt
from integrators import slope_on

CURE = "; with the signed law it does not"  # of the published one
CLEARLY = 1e-9  # not just by rounding
GROWN, MUCH = 1.1, 2.0  # times: an error that grows by more is worth a note, a warning


def slides(path: Track) -> Iterator[Doubt]:
    """Yield a note for each surface that the motion slid on."""
    found = path.trace.sliding
    for name in dict.fromkeys(found.surface.tolist()):
        mine = found[found.surface == name]
        seconds = float((mine.t_end - mine.t_start).sum())
        often = f"{len(mine)} times, {in_words(seconds, 's', 4)} in total, first"
        often = often if len(mine) > 1 else f"for {in_words(seconds, 's', 4)}, first"
        t = float(mine.t_start[0])
        yield Doubt(
            "sliding",
            "note",
            f"held on {name} = 0 {often} at t = {t:.6g} s: a sliding mode between two signs or two "
            "states (Filippov)",
            tuple(mine.t_start.tolist()),
        )


def not_unique(path: Track) -> Iterator[Doubt]:
    """Yield places from where the flows on both sides of v = 0 lead away."""
    program, rows, found = path.program, path.rows, Gathering()
    surfaces = program.surfaces
    for k in range(program.layout.surfaces):
        if surfaces.machine[k] >= 0:
            continue
        flags = rows.mode[:, program.layout.slides][:, k]
        at_once = rows.t[1:] == rows.t[:-1]
        left = (flags[1:] == 0) & (flags[:-1] == 1)
        on = path.margins[:, surfaces.above[k]] == 0.0
        for row in (np.flatnonzero(left | (at_once & on[1:])) + 1).tolist():
            t, y, mode = path.at(row)
            if flags[row] or not _repels(path, k, t, y, mode):
                continue
            name = program.surface_names[k]
            text = (
                f"at {name} = 0 the flow leads away on both sides, {{when}}: the model does not "
                "say to which, and this run took one"
            )
            found.add("not unique", k, t, text)
    yield from found.doubts()


def _repels(path: Track, k: int, t: float, y: list[float], mode: list[int]) -> bool:
    program = path.program
    flags = [int(each == k) for each in range(program.layout.surfaces)]
    on = on_surfaces(program, program.ieee, program.p, flags)
    program.ieee["arm"](t, y, mode, program.p, on.held, [0] * len(program.strict))
    slope, sliding = [0.0] * len(y), on.sliding
    slope_on(on, t, y, list(mode), slope)
    half, g = sliding.halves[0], sliding.normals[0]
    size = sum(abs(g[j]) * (abs(slope[j]) + abs(half[j])) for j in range(len(y)))
    return sliding.gains[0] > CLEARLY * size and abs(sliding.sigma[0]) < 1.0 - CLEARLY


def impulses(path: Track) -> Iterator[Doubt]:
    """Yield a note for each contact whose edges take momentum on purpose."""
    found = path.trace.impulses
    for contact in dict.fromkeys(found.contact.tolist()):
        mine = found[found.contact == contact]
        edges = " and ".join(dict.fromkeys(mine.edge.tolist()))
        times = sorted({*mine.t.tolist()})
        whose, energy = path.trace.what.whose(contact), in_words(float(mine.energy.sum()), "J", 3)
        yield Doubt(
            "impulse",
            "note",
            f"{edges}{f' of {whose}' * bool(whose)} take {energy} in total from the bodies by "
            f"impulses, as the chart says, {len(times)} times, first at t = {times[0]:.9g} s",
            tuple(times),
            whose,
        )


def growth(trace: Trace) -> Iterator[Doubt]:
    """Yield the stretches in which a variable of one contact grows by itself.

    There the derivative of its flow by itself is positive: an error is multiplied by exp of its
    integral. So does the published law once an element slips backward.
    """
    chart, t, mode = trace.model.chart, trace.t, trace.modes.T
    if len(t) < 2:
        return
    for name in chart.variables:
        rates = np.zeros(mode.shape)
        for number, state in enumerate(chart.states):
            if (flow := chart.flows.get((state.name, name))) is None:
                continue
            slope = derivative(flow, name)
            if slope is None or not names_in(slope) or not (inside := mode == number).any():
                continue
            try:
                columns = guard_columns(trace, names_in(slope))
            except (KeyError, ParameterError):
                continue  # it reads what is not kept
            values = np.broadcast_to(values_of(slope, columns), mode.shape)
            rates[inside] = values[inside]
        for i in range(trace.n):
            yield from _grown(trace, name, i, rates[i])


def _grown(trace: Trace, name: str, i: int, rate: np.ndarray) -> Iterator[Doubt]:
    t, mode = trace.t, trace.modes[:, i]
    on = (mode[1:] == mode[:-1]) & (np.minimum(rate[1:], rate[:-1]) > 0.0)
    steps = np.where(on, 0.5 * (rate[1:] + rate[:-1]) * np.diff(t), 0.0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on, [0]]).astype(int)))
    grown = [(float(steps[a:b].sum()), int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    grown = [each for each in grown if each[0] > math.log(GROWN)]
    if not grown:
        return
    most, first = max(grown), grown[0][1]
    state = trace.model.chart.states[int(mode[first])].name
    whose = trace.which
    often = f"{len(grown)} times, " if len(grown) > 1 else ""
    yield Doubt(
        "growth",
        "warning" if most[0] > math.log(MUCH) else "note",
        f"in {state} an error in {name} of {trace.subject.element(trace.places.name, i)} grows by "
        f"itself, {often}first from t = {t[first]:.6g} s on, by up to "
        f"{math.exp(min(most[0], 700.0)):.3g} times (t = {t[most[1]]:.6g} to {t[most[2]]:.6g} s)"
        f"{CURE if trace.model.chart == GMS_ELEMENT['published'] else ''}",
        tuple(float(t[a]) for _, a, _ in grown),
        whose,
        i,
    )
