"""What an export needs in order to follow its numbers: tolerances, scales, initial values."""

from __future__ import annotations

from typing import Any

from gms_fsm.lowering._compiled import functions
from gms_fsm.lowering.adapting import FUNCTIONS, Adapting, bind, text_of
from gms_fsm.run.start import Start

__all__ = ["ADAPTED", "adapting_of"]

# The arguments of `gms_fsm.lowering.adapting.adapt` in the block of an export that steps.
ADAPTED = "functions buffers sample.seen buffers.sliding.live adapting"


def adapting_of(start: Start) -> Adapting:
    """Return the functions that follow a start's numbers, and what they need.

    Parameters
    ----------
    start : Start
        What is exported.

    Returns
    -------
    Adapting
        Made of lists.
    """
    program = start.program
    made = bind(text_of(program.plan), functions(program))
    y, given = start.before_entry()
    own: Any = {name: made[name] for name in FUNCTIONS}
    return Adapting(
        **own,
        chosen=start.chosen_tolerances(),
        y=y,
        given=given,
        span=[start.t_start, start.last],
        sizes=[0.0] * len(y),
        times=[0.0],
    )
