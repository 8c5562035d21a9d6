"""Tolerances to begin with where no scale is known: what rounding leaves of the largest motion."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence

from gms_fsm.errors import SignalError
from gms_fsm.language import evaluate
from gms_fsm.lowering._locks import ENDLESS
from gms_fsm.lowering._observing import armed, observe, rate
from gms_fsm.lowering.program import Program
from gms_fsm.systems.signals import Function
from gms_fsm.systems.system import System

__all__ = ["floor_of"]

LOOKS = (0.0, 0.13, 0.5, 1.0)  # parts of a run at which its forces are looked at
ROUNDED = 1e-15  # of the largest motion: a few units in its last place


def floor_of(
    system: System,
    program: Program,
    atol: list[float],
    span: tuple[float, float],
    y: list[float],
    mode: Sequence[int],
) -> list[float] | None:
    """Return the tolerances that a run begins with, None if every motion has a scale of its own.

    The forces over the masses, for the whole run, give the largest motion there can be. What locks
    leave of a motion that they hold lies below its rounding, and is no scale.
    """
    places, bodies = program.layout.y, system.shape.assembly.free
    scaleless = [name for each in bodies for name in (each.x, each.v) if name in places.shared]
    scaleless = [name for name in scaleless if atol[places.index(name)] == 0.0]
    if not scaleless:
        return None
    start, end = span
    # A user's own function is not asked ahead of time.
    asked = any(isinstance(each, Function) for each in system.signals.values())
    looks = [start + part * (end - start) for part in LOOKS[: 1 if asked else None]]
    most = max(_fastest(system, program, t, y, mode) for t in looks)
    speeds = {each.v for each in bodies}
    floor = [*atol]
    for name in scaleless:
        floor[places.index(name)] = ROUNDED * most * (end - start) ** (1 if name in speeds else 2)
    return floor


def _fastest(
    system: System, program: Program, t: float, y: list[float], mode: Sequence[int]
) -> float:
    """Return the largest acceleration, with those that locked contacts hold back."""
    read, layout = system.shape.assembly, program.layout
    modes = layout.not_sliding(mode)
    found = [0.0]
    with contextlib.suppress(SignalError):
        seen = observe(program, t, y, modes)
        slopes = rate(program, t, y, modes, armed(program, t, y, modes))
        for body in read.free:
            inertia = float(evaluate(read.inertias[body.name], system.numbers))
            found.append(abs(float(slopes[layout.y.index(body.v)])))
            for bank in read.banks:
                for force, row in zip(bank.forces, bank.jacobian, strict=True):
                    if body.name in row:
                        ratio = float(evaluate(row[body.name], system.numbers))
                        found.append(abs(seen[layout.observed.index(force)] * ratio / inertia))
    # Where locks contradict each other a force has no limit: it is no motion that there can be.
    return max(each for each in found if each < math.sqrt(ENDLESS))
