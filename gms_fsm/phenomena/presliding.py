"""Pre-sliding: hysteresis, nonlocal memory, and rest under bias and ripple."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.phenomena._bench import BenchMotion, ForcePath, path
from gms_fsm.phenomena.limits import LIMITS, percent
from gms_fsm.phenomena.results import Curve, MeasuredNumber, Phenomenon, PhenomenonResult, Verdict

if TYPE_CHECKING:
    from gms_fsm.phenomena.specimens import Specimen
    from gms_fsm.traces.trace import Trace

# Forces in units of the break-away force, rates in units of it per s.
RATE = 0.095
OUTER = (0.95, -0.95, 0.95)
HOLD = 5.0  # s
NESTED = (0.95, -0.8, 0.8, -0.8, 0.95)
SLIDING = 20.0  # in F_s / sigma_0: a longer stroke is not pre-sliding
AWAY, NO_LOOP = "slides away", "no loop"
BIAS_RAMP = ((0.0, 0.0), (2.0, 0.6), (4.0, 0.3), (5.0, 0.3))
RIPPLE, FREQUENCY = 0.1, 2.0  # Hz
PER_PERIOD = 50  # samples
PERIODS = (20, 40)  # of the ripple; the drift is measured between their means


def _at(force: float, F: FloatArray, x: FloatArray) -> float:
    """Return where a branch, on which F is applied monotonically, crosses a force."""
    order = np.argsort(F, kind="stable")
    return float(np.interp(force, F[order], x[order]))


def work(force: FloatArray, x: FloatArray) -> float:
    """Return the work of a force along a branch, J."""
    return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(x)))


def _slid_away(
    specimen: Specimen, way: ForcePath, trace: Trace, verdict: Verdict
) -> PhenomenonResult:
    """Return the result of a slider that slides away, up to there: how far it gets says nothing."""
    limit = SLIDING * specimen.bench.bristle
    x, applied = trace.x, way.force(trace.t)
    moved = np.maximum.accumulate(x) - np.minimum.accumulate(x)
    end = int(np.argmax(moved > limit))
    numbers = (
        MeasuredNumber("force at which it slides away", float(applied[end - 1]), "N"),
        MeasuredNumber("stroke up to which it would be pre-sliding", 1e6 * limit, "µm"),
    )
    curves = (Curve("", 1e6 * x[:end], applied[:end]),)
    said = "it slides away although the break-away force is not reached"
    return PhenomenonResult(verdict, numbers, said, curves, AWAY)


def _hysteresis(specimen: Specimen) -> PhenomenonResult:
    force = specimen.break_away
    way = path(RATE * force, [each * force for each in OUTER], HOLD)
    trace = specimen.run(BenchMotion(force=way.corners), float(way.ends[-1]), way.times)
    x = dict(zip(trace.t.tolist(), trace.x.tolist(), strict=True))
    applied = way.force(trace.t)
    down, up = (np.array([x[t] for t in branch.tolist()]) for branch in way.branches[1:])
    load, back = (way.force(branch) for branch in way.branches[1:])
    width = _at(0.0, load, down) - _at(0.0, back, up)
    stroke = float(max(down.max(), up.max()) - min(down.min(), up.min()))
    loss = work(load, down) + work(back, up)
    share = abs(width) / stroke if stroke > 0.0 else 0.0
    if stroke > SLIDING * specimen.bench.bristle:
        return _slid_away(specimen, way, trace, "shows wrongly")
    if share <= LIMITS["hysteresis.width"].value:
        verdict: Verdict = "does not show"
        said = "force and displacement are on one line" if stroke > 0.0 else "it does not move"
    elif width < 0.0:
        verdict, said = "shows wrongly", "the loop is run through the wrong way: it makes energy"
    else:
        verdict, said = "shows", "unloading does not follow the line of loading"
    numbers = (
        MeasuredNumber("width of the loop at F = 0", 1e6 * width, "µm"),
        MeasuredNumber("stroke", 1e6 * stroke, "µm"),
        MeasuredNumber("width over stroke", share, "1"),
        MeasuredNumber("energy lost per cycle", 1e6 * loss, "µJ"),
    )
    curves = (Curve("", 1e6 * trace.x, applied),)
    return PhenomenonResult(verdict, numbers, said, curves)


def nested(specimen: Specimen) -> tuple[ForcePath, Trace]:
    """Return the force with nested reversals, and the run under it."""
    force = specimen.break_away
    way = path(RATE * force, [each * force for each in NESTED], HOLD, smooth=True)
    trace: Trace = specimen.run(BenchMotion(force=way.corners), float(way.ends[-1]), way.times)
    return way, trace


def _memory(specimen: Specimen) -> PhenomenonResult:
    way, trace = nested(specimen)
    x = dict(zip(trace.t.tolist(), trace.x.tolist(), strict=True))
    outer, inner, top, inner_again, outer_again = (x[t] for t in way.ends.tolist())
    stroke = top - inner
    gaps = (inner_again - inner, outer_again - outer)
    gap = max(gaps, key=abs)
    up, down = (np.array([x[t] for t in branch.tolist()]) for branch in way.branches[2:4])
    rising, falling = (way.force(branch) for branch in way.branches[2:4])
    width = _at(0.0, falling, down) - _at(0.0, rising, up)
    open_by, wide = (abs(u / stroke) if stroke else 0.0 for u in (gap, width))
    instead = ""
    if abs(stroke) > SLIDING * specimen.bench.bristle:
        return _slid_away(specimen, way, trace, "does not show")
    if wide <= LIMITS["memory.width"].value and open_by <= LIMITS["memory.gap"].value:
        verdict: Verdict = "does not show"
        instead = NO_LOOP
        said = "there is no inner loop" if stroke > 0.0 else "it does not move"
    elif open_by > LIMITS["memory.gap"].value:
        verdict, said = "does not show", "the inner loop does not close: it forgets where it turned"
    else:
        verdict, said = "shows", "the inner loops close where they began"
    numbers = (
        MeasuredNumber("gap of the inner loops over their stroke", 100.0 * open_by, "%"),
        MeasuredNumber("gap", 1e6 * abs(gap), "µm"),
        MeasuredNumber("stroke of the inner loop", 1e6 * stroke, "µm"),
        MeasuredNumber("width of the inner loop at F = 0", 1e6 * width, "µm"),
    )
    curves = (Curve("", 1e6 * trace.x, way.force(trace.t)),)
    return PhenomenonResult(verdict, numbers, said, curves, instead)


def _drift(specimen: Specimen) -> PhenomenonResult:
    bench, force = specimen.bench, specimen.break_away
    start = BIAS_RAMP[2][0]
    motion = BenchMotion(
        force=[(t, share * force) for t, share in BIAS_RAMP],
        vibration=RIPPLE * force,
        start=start,
        omega=2 * math.pi * FREQUENCY,
    )
    end = start + PERIODS[1] / FREQUENCY
    trace = specimen.run(
        motion, end, np.linspace(0.0, end, round(PER_PERIOD * FREQUENCY * end) + 1)
    )
    begin = round(PER_PERIOD * FREQUENCY * start)
    means = [
        float(trace.x[begin + (k - 1) * PER_PERIOD : begin + k * PER_PERIOD].mean())
        for k in PERIODS
    ]
    drift = (means[1] - means[0]) / (PERIODS[1] - PERIODS[0])
    verdict: Verdict = (
        "shows" if abs(drift) <= LIMITS["drift.rate"].value * bench.bristle else "shows wrongly"
    )
    said = "it stays in place" if verdict == "shows" else "it drifts, far below break-away"
    numbers = (
        MeasuredNumber("drift per period", 1e6 * drift, "µm"),
        MeasuredNumber("drift rate", 1e6 * drift * FREQUENCY, "µm/s"),
    )
    return PhenomenonResult(verdict, numbers, said, (Curve("", trace.t, 1e6 * trace.x),))


PHENOMENA = (
    Phenomenon(
        "hysteresis",
        "Pre-sliding hysteresis",
        "pre-sliding hysteresis",
        "The force goes to +0.95, -0.95 and +0.95 of the break-away force, with holds of 5 s. "
        "Measured is the width of the last loop at F = 0.",
        ("$x$ [µm]", "applied force [N]"),
        _hysteresis,
        decimals=1,
        shows_if=f"> {percent('hysteresis.width')} of the stroke",
    ),
    Phenomenon(
        "memory",
        "Nonlocal memory: nested reversals of the force",
        "nonlocal memory: gap of inner loops",
        "The force goes smoothly to 0.95, -0.8, 0.8, -0.8 and 0.95 of the break-away force. A "
        "contact that remembers where it turned is then back at the same places. Measured is the "
        "larger of the two gaps, over the stroke of the inner loop.",
        ("$x$ [µm]", "applied force [N]"),
        _memory,
        decimals=1,
        shows_if=f"≤ {percent('memory.gap')}, of a loop",
    ),
    Phenomenon(
        "drift",
        "Rest under bias and ripple",
        "rests under bias and ripple: drift per period",
        "The force rises to 0.6 of the break-away force, falls to 0.3, and then has a ripple of "
        "0.1 at 2 Hz. Measured is how far the mean of a period moves from period 20 to 40, per "
        "period.",
        ("$t$ [s]", "$x$ [µm]"),
        _drift,
        shows_if=rf"≤ {percent('drift.rate')} of $F_s/\sigma_0$",
    ),
)
