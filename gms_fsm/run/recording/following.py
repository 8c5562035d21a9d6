"""What machine code needs to let everything follow from the numbers of a run."""

from __future__ import annotations

from typing import Any

from gms_fsm.lowering.adapting import FUNCTIONS, Adapting, bind, text_of
from gms_fsm.lowering.compiling import functions
from gms_fsm.run.problem import Problem


def adapting_of(start: Problem) -> Adapting:
    """Return the functions that follow a start's numbers, and what they need."""
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
