"""Break-away: the force at which a contact lets go, over the force rate, and under vibration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ParameterError
from gms_fsm.phenomena._bench import BenchMotion
from gms_fsm.phenomena.limits import LIMITS, percent
from gms_fsm.phenomena.results import Curve, MeasuredNumber, Phenomenon, PhenomenonResult, Verdict

if TYPE_CHECKING:
    from gms_fsm.phenomena.specimens import Specimen

RATES = (0.1 / 1.5, 0.2, 2 / 3, 2.0, 20 / 3, 50 / 1.5)  # of the force, in F_s per s
TRAVEL = 10.0  # in F_s / sigma_0: a slider that has moved so far has broken away
LONGEST = 8.0  # in F_s: where the search for the break-away ends
BIAS = 0.5  # of the break-away force
MOST = 0.75  # of the break-away force: largest amplitude
VIBRATION, GROWTH = 2 * math.pi * 10.0, 15.0  # rad/s; s until the largest amplitude


@dataclass(frozen=True, eq=False)
class Pulled:
    """A slider pulled until it has broken away.

    Parameters
    ----------
    force : float
        Largest friction force until then, N.
    t, F : ndarray
        Time [s] and friction force [N] until then.
    """

    force: float
    t: FloatArray
    F: FloatArray


def pulled(specimen: Specimen, rate: float) -> Pulled:
    """Pull a slider through the soft spring until it has broken away."""
    bench = specimen.bench
    speed = rate / bench.stiffness
    motion = BenchMotion(spring=bench.stiffness, velocity=((0.0, speed), (1.0, speed)))
    reach = 1.2 * bench.F_s
    while reach <= LONGEST * bench.F_s:
        trace = specimen.run(motion, reach / rate + 0.2)
        gone = np.flatnonzero(trace.x > TRAVEL * bench.bristle)
        if gone.size:
            before = slice(0, int(gone[0]) + 1)
            return Pulled(float(trace.F[before].max()), trace.t[before], trace.F[before])
        reach *= 2.0
    raise ParameterError(
        f"it did not break away: at {0.5 * reach:.3g} N it has moved by "
        f"{float(trace.x[-1]):.3g} m, and {TRAVEL * bench.bristle:.3g} m count as break-away",
        advice="give the bench the scales of this model: F_s, sigma_0",
    )


def _break_away(specimen: Specimen) -> PhenomenonResult:
    rates = np.array(RATES) * specimen.bench.F_s
    forces = np.array([specimen.break_away, *(pulled(specimen, r).force for r in rates[1:])])
    fall = float(forces[0] - forces[-1])
    limit = LIMITS["break-away.fall"].value * forces[0]
    verdict: Verdict = (
        "shows" if fall > limit else "shows wrongly" if fall < -limit else "does not show"
    )
    said = {
        "shows": "the break-away force falls with the force rate",
        "does not show": "the break-away force does not depend on the force rate",
        "shows wrongly": "the break-away force rises with the force rate",
    }[verdict]
    numbers = (
        MeasuredNumber("fall of the break-away force", fall, "N"),
        *(
            MeasuredNumber(f"break-away force at {rate:.3g} N/s", float(force), "N")
            for rate, force in zip(rates, forces, strict=True)
        ),
    )
    return PhenomenonResult(verdict, numbers, said, (Curve("", rates, forces),))


def _vibration(specimen: Specimen) -> PhenomenonResult:
    bench, force = specimen.bench, specimen.break_away
    bias, growth = BIAS * force, MOST * force / GROWTH
    motion = BenchMotion(
        force=((0.0, 0.0), (0.5, bias), (1.0, bias)), growth=growth, omega=VIBRATION
    )
    trace = specimen.run(motion, GROWTH)
    gone = np.flatnonzero(trace.x > TRAVEL * bench.bristle)
    end = int(gone[0]) if gone.size else len(trace) - 1
    at = float(trace.t[end])
    ratio = (bias + growth * at) / force
    curve = Curve("", growth * trace.t[: end + 1] / force, 1e6 * trace.x[: end + 1])
    if not gone.size:
        verdict: Verdict = "does not show"
        said = "it is not released, although the peak force is far above the break-away force"
    elif ratio < LIMITS["vibration.early"].value:
        verdict, said = (
            "shows wrongly",
            "it creeps away although the break-away force is not reached",
        )
    else:
        verdict, said = "shows", "it is released when the peak force reaches the break-away force"
    numbers = (
        MeasuredNumber("peak force at the release over break-away force", ratio, "1"),
        MeasuredNumber("amplitude at the release", growth * at, "N"),
        MeasuredNumber("bias", bias, "N"),
    )
    return PhenomenonResult(verdict, numbers, said, (curve,))


PHENOMENA = (
    Phenomenon(
        "break-away",
        "Break-away force over the force rate",
        "break-away force falls with rate",
        "A spring of 2 N/m pulls the slider at rates from 0.1 to 50 N/s. Measured is the largest "
        "friction force before the slider has moved by 10 F_s / sigma_0; the number is its fall "
        "from the slowest to the fastest rate.",
        ("force rate [N/s]", "break-away force [N]"),
        _break_away,
        log=True,
        shows_if=f"> {percent('break-away.fall')} of that at the slowest",
    ),
    Phenomenon(
        "vibration",
        "Release by vibration",
        "released by vibration: peak / break-away force",
        "Under a bias of half the break-away force, a vibration of 10 Hz grows by 5 % of the "
        "break-away force per second. Measured is the peak force (bias plus amplitude) when the "
        "slider has moved by 10 F_s / sigma_0, over the break-away force.",
        ("amplitude of the vibration / break-away force [–]", "$x$ [µm]"),
        _vibration,
        decimals=2,
        shows_if=f"≥ {LIMITS['vibration.early'].value:g}",
    ),
)
