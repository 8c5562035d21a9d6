"""What an export that steps is made of: its block of memory, and the functions on it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

from gms_fsm.errors import ParameterError
from gms_fsm.exporters._names import identifier
from gms_fsm.exporters._quantities import Quantity
from gms_fsm.exporters._subject import Subject
from gms_fsm.language import names_in, spell
from gms_fsm.lowering.adapting import Adapting, adapt
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.following import adapting_of
from gms_fsm.run.stepped.memory import MOST_IN_EXPORTS, arguments_of
from integrators.machine_code.front_end.translate import Translator
from integrators.machine_code.layout import BlockLayout
from integrators.runners.compiled import is_known
from integrators.runners.stepping import step_to

# The functions, and the parts of the block that are their arguments.
STEPS: Mapping[str, tuple[Any, str]] = {
    "step": (step_to, "functions machines buffers sample"),
    "adapt": (adapt, "functions buffers sample.seen buffers.sliding.live adapting"),
}
PLACES: Mapping[str, str] = {
    "y": "buffers.now.y",
    "mode": "buffers.now.mode",
    "seen": "sample.seen",
    "shared": "functions.p.0",
    "own": "functions.p.1",
}


class ExportArguments(NamedTuple):
    """The arguments of both functions."""

    functions: Any
    machines: Any
    buffers: Any
    sample: Any
    adapting: Adapting


def step_arguments(start: Problem) -> tuple[ExportArguments, BlockLayout]:
    """Return the contents of the block at a start, and where everything is in it."""
    step: tuple[Any, Any, Any, Any] = arguments_of(start, most=MOST_IN_EXPORTS)
    made = ExportArguments(*step, adapting_of(start))
    return made, BlockLayout(made, is_known)


def translate(
    translator: Translator,
    layout: BlockLayout,
    entries: Mapping[str, tuple[Any, str]],
    prefix: str = "",
) -> list[str]:
    """Translate functions on the block, and return their names."""
    for name, (function, parts) in entries.items():
        translator.entry(f"{prefix}{name}", function, [layout.part(each) for each in parts.split()])
    return [*entries]


def word_of(layout: BlockLayout, each: Quantity) -> int:
    """Return the first word of a quantity in the block."""
    return layout.offset(PLACES[each.place]) + each.index


def check_first_call(subject: Subject, words: Collection[str]) -> None:
    """Refuse inputs that the language cannot name, and initial values that depend on them."""
    start = subject.start
    for contact in start.system.machines:
        chart = contact.chart
        given = {*chart.inputs, *chart.velocities, *chart.declared} - {*chart.variables}
        given -= {*chart.parameter_names}
        for name, tree in chart.assigned():
            read = set(names_in(tree))
            while (
                more := {u for each in read & {*chart.lets} for u in names_in(chart.lets[each])}
                - read
            ):
                read |= more
            if late := sorted(read & given):
                raise ParameterError(
                    f"its default state begins with {name} = {spell(tree)}, and {late[0]} is known "
                    "only in the first call",
                    place=f"contact {contact.name!r}",
                    advice="give the initial value of the variable as a number",
                )
    for each in subject.inputs:
        identifier(each, words, f"input {each!r}")
