"""Tolerances to begin with where no scale is known: what rounding leaves of the largest motion."""

from __future__ import annotations

from collections.abc import Sequence

from gms_fsm.errors import SignalError
from gms_fsm.lowering.program import Program


def floor_of(
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
    floor, layout = [*atol], program.layout
    if min(atol, default=1.0) > 0.0:
        return None
    held, watch = [0.0] * program.held, [0] * len(program.strict)
    dy, seen = [0.0] * layout.y.size, [0.0] * layout.observed.size
    scratch = held, program.live, watch, dy, seen
    try:
        program.adaptive.functions["raise_floor"](
            [*span], [*y], [*layout.not_sliding(mode)], program.p, *scratch, [*atol], floor
        )
    except SignalError:  # of a user's own function
        return [*atol]
    return floor if floor != atol else None
