"""The machine code of runs, and what they have in common: what moves, the method, and the sizes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gms_fsm.gradients.directions import Directions
from gms_fsm.gradients.following import LANES, TABLEAU, TangentRun, as_columns
from gms_fsm.lowering import compiling as compiled
from gms_fsm.lowering.printing.counting import Counting
from gms_fsm.lowering.program import equations, machines_of
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.following import following_of
from integrators import hybrid
from integrators.runners.columns import Recorded
from integrators.sliding import Functions

if TYPE_CHECKING:
    from integrators.runners.compiled import RecordArguments

_known: dict[Any, compiled.ReadyCode] = {}


def tangents_of(start: Problem, wanted: Directions) -> TangentRun:
    """Return what a run has besides its own numbers, if it is differentiated."""
    times = (start.last,) if start.output == "end" else start.options.times
    lanes, same = LANES if wanted.count > 1 else 1, start.options.method is TABLEAU
    return TangentRun(start.program, wanted, len(start.y), times, lanes, start.options.rtol, same)


def ready_code(
    start: Problem, counting: Counting | None, tangents: TangentRun | None
) -> compiled.ReadyCode:
    """Return what a run has in common with others: what moves, the method, and the sizes."""
    program = start.program
    flow = "flow" if start.options.located else "flow_live"
    text, lanes = ("", 0) if tangents is None else (tangents.texts["text"], tangents.lanes)
    key = id(program.functions), flow, start.options.method, counting is not None, text
    if (ready := _known.get(key)) is None:
        if len(_known) >= compiled.MOST_ENGINES:
            _known.clear()
        run = example_of(start, counting)._replace(more=following_of(start))
        if tangents is not None:
            functions, machines = tangents.traced(run.functions, run.machines, as_columns)
            run = run._replace(functions=functions, machines=machines)
        engine = compiled.engine(program, run, counting, text, lanes)
        _known[key] = ready = compiled.ReadyCode(engine, run, program.functions)
    return ready


def example_of(start: Problem, counting: Counting | None = None) -> RecordArguments:
    """Return the arguments of `integrators.runners.columns.record`, with columns that may grow."""
    from integrators.runners.compiled import example

    program, layout = start.program, start.program.layout
    flow = "flow" if start.options.located else "flow_live"
    made = compiled.functions(program)
    p: Any = compiled.packed(program.p)
    return example(
        Functions(made[flow], made["arm"], made["margins"], made["normal"], made["follow"], p),
        machines_of(made),
        hybrid.buffers(
            equations(program), start.t_start, start.y, start.mode, start.last, start.options, 0
        ),
        layout.observed.size,
        Recorded(*map(_integers, layout.recorded)),
        layout.modes,
        None if counting is None else compiled.count_of(program, counting),
    )


def _integers(numbers: Any) -> Any:
    return np.array(numbers, dtype=np.int64)
