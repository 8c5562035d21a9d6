"""Sliding: frictional lag, the Stribeck curve, stick-slip, and the energy of a cycle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.phenomena._bench import Bench, BenchMotion
from gms_fsm.phenomena.limits import LIMITS, percent
from gms_fsm.phenomena.results import Curve, MeasuredNumber, Phenomenon, PhenomenonResult, Verdict

if TYPE_CHECKING:
    from gms_fsm.phenomena.specimens import Specimen

MEAN, SWING = 1.5, 1.0  # in v_s
OMEGAS = (1.0, 10.0, 25.0)  # rad/s
SETTLED = 1.0  # s
# s before sliding, as some models have a friction that grows with the time at rest. The drive then
# creeps by 10 nm: at v = 0 itself rate-and-state friction is too stiff to be run.
REST, CREEP = 10.0, 1e-6  # s, in v_s
SPEEDS = (100.0, 30.0, 10.0, 5.0, 3.0, 2.0, 1.5, 1.0, 0.7, 0.5, 0.3, 0.1, 0.03, 0.01)  # in v_s
TRAVEL, SHORTEST = 20.0, 0.5  # of each speed: F_s / sigma_0, and s
PULLED = 40.0  # s
STUCK = 0.02  # of the drive's speed
# Corners of the velocity in a cycle, ms and v_s: slow backward, fast forward, at rest.
CYCLE = ((0, 0), (10, -1), (100, -1), (110, 0), (115, 5), (130, 5), (135, 0), (150, 0))
CYCLES = 3


def _stiff(bench: Bench, **options: object) -> BenchMotion:
    spring, damper = bench.stiff
    return BenchMotion(spring=spring, damper=damper, **options)  # type: ignore[arg-type]


def _lag(specimen: Specimen) -> PhenomenonResult:
    bench = specimen.bench
    mean = MEAN * bench.v_s
    widths, curves = [], []
    for omega in OMEGAS:
        period = 2 * math.pi / omega
        end = period * (math.ceil((REST + SETTLED) / period) + 1)
        times = np.linspace(end - period, end, 401)  # from top speed to top speed
        creep = CREEP * bench.v_s
        base = ((0.0, creep), (REST, creep), (REST + 0.01, mean), (REST + 1.0, mean))
        motion = _stiff(bench, velocity=base, swing=SWING / MEAN, omega=omega)
        trace = specimen.run(motion, end, times)
        slower, faster = slice(0, 201), slice(200, 401)
        down = float(np.interp(-mean, -trace.v[slower], trace.F[slower]))
        up = float(np.interp(mean, trace.v[faster], trace.F[faster]))
        widths.append(up - down)
        curves.append(Curve(f"{omega:g} rad/s", 1e3 * trace.v, trace.F))
    enough = LIMITS["lag.width"].value * bench.F_s
    verdict: Verdict
    if widths[-1] < -enough:
        verdict, said = "shows wrongly", "there is less friction while the speed rises"
    elif widths[-1] > enough and widths[-1] > widths[0]:
        verdict, said = "shows", "there is more friction while the speed rises, more so when faster"
    else:
        verdict, said = "does not show", "friction depends on the present speed only"
    order = (2, 0, 1)
    numbers = tuple(
        MeasuredNumber(f"width of the loop at {OMEGAS[k]:g} rad/s", 1e3 * widths[k], "mN")
        for k in order
    )
    return PhenomenonResult(verdict, numbers, said, tuple(curves))


def _stribeck(specimen: Specimen) -> PhenomenonResult:
    bench = specimen.bench
    speeds = np.array(SPEEDS) * bench.v_s
    creep = CREEP * bench.v_s
    corners: list[tuple[float, float]] = [(0.0, creep), (REST, creep)]
    ends, t = [], REST
    for speed in speeds.tolist():
        corners.append((t + 0.1 * SHORTEST, speed))
        t += 0.1 * SHORTEST + max(SHORTEST, TRAVEL * bench.bristle / speed)
        corners.append((t, speed))
        ends.append(t)
    trace = specimen.run(_stiff(bench, velocity=corners), ends[-1], np.array(ends))
    v, F = trace.v[::-1], trace.F[::-1]
    lowest = int(F.argmin())
    fall = float(F[0] - F[lowest])
    if fall > LIMITS["stribeck.fall"].value * F[0]:
        verdict: Verdict = "shows"
        said = f"friction falls with the speed, to its minimum at {1e3 * v[lowest]:.3g} mm/s"
    else:
        verdict, said = "does not show", "friction does not fall with the speed"
    numbers = (
        MeasuredNumber("fall of the friction", fall, "N"),
        MeasuredNumber(f"friction at {1e3 * v[0]:.3g} mm/s", float(F[0]), "N"),
        MeasuredNumber("least friction", float(F[lowest]), "N"),
        MeasuredNumber(f"friction at {1e3 * v[-1]:.3g} mm/s", float(F[-1]), "N"),
    )
    return PhenomenonResult(verdict, numbers, said, (Curve("", 1e3 * v, F),))


def _stick_slip(specimen: Specimen) -> PhenomenonResult:
    bench = specimen.bench
    motion = BenchMotion(spring=bench.stiffness, velocity=((0.0, bench.speed), (1.0, bench.speed)))
    trace = specimen.run(motion, PULLED).refined(4000)
    t, pull = trace.t, bench.stiffness * (bench.speed * trace.t - trace.x)
    cycle = _last_cycle(t, trace.v, bench.speed)
    last = (t >= cycle[0]) & (t <= cycle[1]) if cycle else t >= 0.5 * PULLED
    amplitude = float(0.5 * np.ptp(pull[last]))
    still = np.abs(trace.v) <= STUCK * bench.speed
    stuck = _share(t[last], still[last])
    period = cycle[1] - cycle[0] if cycle else 0.0
    limit, instead = LIMITS["stick-slip.amplitude"].value * bench.F_s, ""
    if amplitude <= limit:
        verdict: Verdict = "does not show"
        said = "it slides steadily"
    elif stuck <= LIMITS["stick-slip.stuck"].value:
        verdict, said, instead = "does not show", "it oscillates and never sticks", "never sticks"
    else:
        verdict, said = "shows", "it sticks and slips in a limit cycle"
    numbers = (
        MeasuredNumber("amplitude of the spring force", amplitude, "N"),
        MeasuredNumber("period", period, "s"),
        MeasuredNumber("share of the period in stick", stuck, "1"),
    )
    return PhenomenonResult(verdict, numbers, said, (Curve("", t, pull),), instead)


def _last_cycle(t: FloatArray, v: FloatArray, speed: float) -> tuple[float, float] | None:
    """Return the last two times at which a slider overtakes its drive."""
    rises = np.flatnonzero((v[:-1] < speed) & (v[1:] >= speed))
    if rises.size < 2:
        return None
    share = (speed - v[rises]) / (v[rises + 1] - v[rises])
    times = t[rises] + share * (t[rises + 1] - t[rises])
    return float(times[-2]), float(times[-1])


def _share(t: FloatArray, true: NDArray[np.bool_]) -> float:
    """Return the share of the time in which something is true at both ends of a step."""
    steps = np.diff(t)
    return float(steps[true[:-1] & true[1:]].sum() / steps.sum())


def _passivity(specimen: Specimen) -> PhenomenonResult:
    bench = specimen.bench
    length = 1e-3 * CYCLE[-1][0]
    corners = [(0.0, 0.0)] + [
        (k * length + 1e-3 * t, share * bench.v_s) for k in range(CYCLES) for t, share in CYCLE[1:]
    ]
    trace = specimen.run(_stiff(bench, velocity=corners), CYCLES * length).refined(6000)
    steps, power = np.diff(trace.t), trace.F * trace.v
    given = np.concatenate([[0.0], np.cumsum(0.5 * steps * (power[:-1] + power[1:]))])
    made = float(max(0.0, -given.min()))
    exchanged = float(np.sum(0.5 * steps * np.abs(power[:-1] + power[1:])))
    if made > LIMITS["passivity.made"].value * exchanged:
        verdict: Verdict = "shows wrongly"
        said = "it gives back more energy than it has taken: it makes energy"
    else:
        verdict, said = "shows", "it never gives back more energy than it has taken"
    numbers = (
        MeasuredNumber("energy made", 1e3 * made, "mJ"),
        MeasuredNumber("energy taken in all cycles", 1e3 * float(given[-1]), "mJ"),
        MeasuredNumber("energy exchanged", 1e3 * exchanged, "mJ"),
        MeasuredNumber("largest friction force", float(np.abs(trace.F).max()), "N"),
    )
    return PhenomenonResult(verdict, numbers, said, (Curve("", 1e3 * trace.t, 1e3 * given),))


PHENOMENA = (
    Phenomenon(
        "lag",
        "Frictional lag",
        "frictional lag: width at 25 rad/s",
        "After 10 s at rest the speed is 1e-3 (1.5 + cos w t) m/s. Measured is the friction while "
        "the speed rises minus that while it falls, at the mean speed, for w = 1, 10 and 25 rad/s.",
        ("$v$ [mm/s]", "friction [N]"),
        _lag,
        decimals=1,
        shows_if=f"> {percent('lag.width')} of $F_s$",
    ),
    Phenomenon(
        "stribeck",
        "Friction at steady speed",
        "Stribeck curve: fall of friction",
        "After 10 s at rest the slider moves at fourteen constant speeds from 0.1 m/s down to 1e-5 "
        "m/s. Measured is the fall of the friction from the lowest speed to its minimum.",
        ("$v$ [mm/s]", "friction [N]"),
        _stribeck,
        log=True,
        shows_if=f"> {percent('stribeck.fall')} of that at the lowest speed",
    ),
    Phenomenon(
        "stick-slip",
        "Mass pulled through a spring",
        "stick-slip: amplitude",
        "A spring of 2 N/m, whose end moves at 0.1 m/s, pulls the slider of 1 kg for 40 s. "
        "Measured are the period and the amplitude of the spring force in the last cycle, and "
        "the share of the period in stick.",
        ("$t$ [s]", "spring force [N]"),
        _stick_slip,
        shows_if=f"> {percent('stick-slip.amplitude')} of $F_s$, and sticks",
    ),
    Phenomenon(
        "passivity",
        "Energy taken in three cycles",
        "passive: energy made",
        "The slider moves three times backward slowly (1e-3 m/s, 0.1 s) and forward fast "
        "(5e-3 m/s, 0.02 s), from rest without stored energy. Measured is the energy that it has "
        "given back at any time beyond what it had taken before.",
        ("$t$ [ms]", "energy taken [mJ]"),
        _passivity,
        decimals=2,
        shows_if=f"≤ {percent('passivity.made')} of what is exchanged",
    ),
)
