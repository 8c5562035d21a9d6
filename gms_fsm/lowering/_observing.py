"""What is seen of a state: velocity, force, thresholds, rates; along a surface with its sigma.

A row's modes are those of the elements, then for each surface of the program whether the motion
slides on it (`integrators.sliding`). There a sign is a number from -1 to 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.lowering.program import Program
from integrators import Functions, Held, look, room_to_slide, slope_on

__all__ = ["armed", "observe", "rate", "sigmas"]


def observe(program: Program, t: float, y: list[float], mode: Sequence[int]) -> list[float]:
    """Return what a run observes of a state, by place (`gms_fsm.lowering.layout`).

    Parameters
    ----------
    program : Program
        Of the run.
    t : float
        s.
    y : list of float, shape (m,)
        State.
    mode : sequence of int, shape (n,) or (n + surfaces,)
        Of a row.

    Returns
    -------
    list of float
        At the places of ``program.layout.observed``.
    """
    out = [0.0] * program.layout.observed.size
    if not any(mode[program.layout.slides]):
        program.ieee["observe"](t, y, mode, program.live, program.p, out)
    else:
        on = _sliding(program, mode, [0.0] * program.held)
        look(program.ieee["observe"], on, t, y, list(mode), out)
    return out


def sigmas(program: Program, t: float, y: list[float], mode: Sequence[int]) -> list[float]:
    """Return for each surface the sigma in place of its sign.

    Parameters
    ----------
    program, t, y, mode
        As in `observe`.

    Returns
    -------
    list of float
        From -1 to 1; NaN for a surface that is not slid on.
    """
    found = [math.nan] * program.layout.surfaces
    if any(mode[program.layout.slides]):
        on = _sliding(program, mode, armed(program, t, y, mode))
        slope_on(on, t, y, list(mode), [0.0] * program.layout.y.size)
        for c in range(on.sliding.which[-1]):
            found[on.sliding.which[c]] = min(max(on.sliding.sigma[c], -1.0), 1.0)
    return found


def armed(program: Program, t: float, y: list[float], mode: Sequence[int]) -> list[float]:
    """Return the signs that an arc from a state would hold.

    Parameters
    ----------
    program, t, y, mode
        As in `observe`.

    Returns
    -------
    list of float
        -1, 0 or 1; of the surfaces slid on not yet their sigmas.
    """
    held = [0.0] * program.held
    program.ieee["arm"](t, y, mode, program.p, held, [0] * len(program.strict))
    return held


def rate(
    program: Program, t: float, y: list[float], mode: Sequence[int], held: list[float]
) -> FloatArray:
    """Return dy/dt with the signs held.

    Parameters
    ----------
    program, t, y, mode
        As in `observe`.
    held : list of float
        The signs; those of surfaces that are slid on are found here.

    Returns
    -------
    ndarray, shape (m,)
        The slope.
    """
    dy = [0.0] * program.layout.y.size
    if not any(mode[program.layout.slides]):
        program.ieee["flow"](t, y, mode, held, program.p, dy)
    else:
        slope_on(_sliding(program, mode, held), t, y, list(mode), dy)
    return np.array(dy)


def _sliding(program: Program, mode: Sequence[int], held: list[float]) -> Held:
    """Return the program on the surfaces that a row is on."""
    names = ("flow", "arm", "margins", "normal")
    flow, arm, margins, normal = (program.ieee[name] for name in names)
    sliding = room_to_slide(
        program.surfaces,
        program.layout.y.size,
        program.held,
        len(program.strict),
        program.layout.observed.size,
        mode[program.layout.slides],
    )
    return Held(Functions(flow, arm, margins, normal, program.p), held, sliding)
