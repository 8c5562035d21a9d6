"""Observed quantities of a state: velocity, force, thresholds, rates; on a surface, its sigma.

The modes of a row are the states of the elements, followed by one flag per surface of the program
that says whether the motion slides on it (`integrators.sliding`). While sliding, a sign is replaced
by a number from -1 to 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.lowering.program import Program
from integrators import Functions, Held, arm_on, look, sliding_scratch, slope_on


def observe(program: Program, t: float, y: list[float], mode: Sequence[int]) -> list[float]:
    """Return the observed quantities of a state, by place (`gms_fsm.lowering.layout`)."""
    out = [0.0] * program.layout.observed.size
    if not any(mode[program.layout.slides]):
        program.ieee["observe"](t, y, mode, program.live, program.p, out)
    else:
        look(program.ieee["observe"], _on(program, mode), t, y, list(mode), out)
    return out


def sigmas(program: Program, t: float, y: list[float], mode: Sequence[int]) -> list[float]:
    """Return for each surface the sigma that replaces its sign."""
    found = [math.nan] * program.layout.surfaces
    if any(mode[program.layout.slides]):
        on = _on(program, mode)._replace(held=armed(program, t, y, mode))
        slope_on(on, t, y, list(mode), [0.0] * program.layout.y.size)
        for c in range(on.sliding.count):
            found[on.sliding.which[c]] = min(max(on.sliding.sigma[c], -1.0), 1.0)
    return found


def armed(program: Program, t: float, y: list[float], mode: Sequence[int]) -> list[float]:
    """Return the signs that an arc starting from a state would freeze."""
    if not any(mode[program.layout.slides]):
        held = [0.0] * program.held
        program.ieee["arm"](t, y, mode, program.p, held, [0] * len(program.strict))
        return held
    on = _on(program, mode)
    arm_on(on, t, y, list(mode), on.sliding.watch)
    return on.held


def rate(
    program: Program, t: float, y: list[float], mode: Sequence[int], held: list[float]
) -> FloatArray:
    """Return dy/dt with frozen signs."""
    dy = [0.0] * program.layout.y.size
    if not any(mode[program.layout.slides]):
        program.ieee["flow"](t, y, mode, held, program.p, dy)
    else:
        slope_on(_on(program, mode)._replace(held=held), t, y, list(mode), dy)
    return np.array(dy)


def on_surfaces(
    program: Program, made: Mapping[str, Any], p: Any, flags: Sequence[int] = ()
) -> Held:
    """Return the functions of a program, and what it slides on, with scratch space of their own."""
    functions = Functions(
        made["flow"], made["arm"], made["margins"], made["normal"], made["follow"], p
    )
    sliding = sliding_scratch(
        program.surfaces,
        program.layout.y.size,
        program.held,
        len(program.strict),
        program.layout.observed.size,
        flags,
    )
    return Held(functions, [0.0] * program.held, sliding)


def _on(program: Program, mode: Sequence[int]) -> Held:
    """Return the program on the surfaces that a row slides on."""
    return on_surfaces(program, program.ieee, program.p, mode[program.layout.slides])
