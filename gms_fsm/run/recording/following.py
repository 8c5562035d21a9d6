"""What machine code needs to let everything follow from the numbers of a run, and to repeat it."""

from __future__ import annotations

from typing import Any, NamedTuple

from gms_fsm.lowering.adapting import FUNCTIONS, Adapting, adapt, bind, text_of
from gms_fsm.lowering.compiling import functions
from gms_fsm.run.problem import Problem
from integrators.runners.repeating import Repeats


class Following(NamedTuple):
    """What is in the block of a run besides the arguments of `record`."""

    adapting: Adapting
    repeats: Repeats


def following_of(start: Problem) -> Following:
    """Return it for a start, with columns that any number of runs may have."""
    from integrators.machine_code.layout import OuterArray
    from integrators.machine_code.tree import OuterEntry

    column: Any = OuterArray
    entry: Any = OuterEntry("entry")
    layout = start.program.layout
    width = 1 + layout.y.size + layout.observed.size
    repeats = Repeats(
        entry,
        adapt,
        words=column("i"),
        floats=column(),
        first=column("i"),
        scale=[0],
        rows=column("i"),
        columns=column("i"),
        values=column(table=True),
        end=column("f", width),
        mode=column("i", layout.modes),
        counts=column("i", 2),
        kept=column("i"),
        cells=column("i", 3),
        passes=column("i"),
        steps=column(),
        table=column(table=True),
    )
    return Following(adapting_of(start), repeats)


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
