"""Observed quantities of a state: velocity, force, thresholds, rates; on a surface, its sigma.

The modes of a row are the states of the elements, followed by one flag per surface of the program
that says whether the motion slides on it (`integrators.sliding`). While sliding, a sign is replaced
by a number from -1 to 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.lowering.program import Program
from integrators import Functions, Held, arm_on, look, sliding_scratch, slope_on

__all__ = ["armed", "observe", "rate", "sigmas"]


def observe(program: Program, t: float, y: list[float], mode: Sequence[int]) -> list[float]:
    """Return the observed quantities of a state, by place (`gms_fsm.lowering.layout`).

    Parameters
    ----------
    program : Program
        The program of the run.
    t : float
        s.
    y : list of float, shape (m,)
        State.
    mode : sequence of int, shape (n,) or (n + surfaces,)
        The modes of a row.

    Returns
    -------
    list of float
        In the layout of ``program.layout.observed``.
    """
    out = [0.0] * program.layout.observed.size
    if not any(mode[program.layout.slides]):
        program.ieee["observe"](t, y, mode, program.live, program.p, out)
    else:
        on = _sliding(program, mode, [0.0] * program.held)
        look(program.ieee["observe"], on, t, y, list(mode), out)
    return out


def sigmas(program: Program, t: float, y: list[float], mode: Sequence[int]) -> list[float]:
    """Return for each surface the sigma that replaces its sign.

    Parameters
    ----------
    program, t, y, mode
        As in `observe`.

    Returns
    -------
    list of float
        From -1 to 1; NaN for a surface on which the motion does not slide.
    """
    found = [math.nan] * program.layout.surfaces
    if any(mode[program.layout.slides]):
        on = _sliding(program, mode, armed(program, t, y, mode))
        slope_on(on, t, y, list(mode), [0.0] * program.layout.y.size)
        for c in range(on.sliding.which[-1]):
            found[on.sliding.which[c]] = min(max(on.sliding.sigma[c], -1.0), 1.0)
    return found


def armed(program: Program, t: float, y: list[float], mode: Sequence[int]) -> list[float]:
    """Return the signs that an arc starting from a state would freeze.

    Parameters
    ----------
    program, t, y, mode
        As in `observe`.

    Returns
    -------
    list of float
        -1, 0 or 1; for sliding surfaces this is not yet their sigma.
    """
    held = [0.0] * program.held
    watch = [0] * len(program.strict)
    arm_on(_sliding(program, mode, held), t, y, list(mode), watch)
    return held


def rate(
    program: Program, t: float, y: list[float], mode: Sequence[int], held: list[float]
) -> FloatArray:
    """Return dy/dt with frozen signs.

    Parameters
    ----------
    program, t, y, mode
        As in `observe`.
    held : list of float
        The frozen signs; those of sliding surfaces are computed here.

    Returns
    -------
    ndarray, shape (m,)
        The derivative.
    """
    dy = [0.0] * program.layout.y.size
    if not any(mode[program.layout.slides]):
        program.ieee["flow"](t, y, mode, held, program.p, dy)
    else:
        slope_on(_sliding(program, mode, held), t, y, list(mode), dy)
    return np.array(dy)


def _sliding(program: Program, mode: Sequence[int], held: list[float]) -> Held:
    """Return the program restricted to the surfaces that a row slides on."""
    names = ("flow", "arm", "margins", "normal", "follow")
    flow, arm, margins, normal, follow = (program.ieee[name] for name in names)
    functions = Functions(flow, arm, margins, normal, follow, program.p)
    sliding = sliding_scratch(
        program.surfaces,
        program.layout.y.size,
        program.held,
        len(program.strict),
        program.layout.observed.size,
        mode[program.layout.slides],
    )
    return Held(functions, held, sliding)
