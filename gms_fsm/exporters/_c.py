"""The engine as C99: header and source of one friction, or of a system.

The steps are `integrators.runners.stepping.step_to`, translated; there is no rule in this module.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from string import Template
from typing import Any

from gms_fsm._version import __version__
from gms_fsm.charts.nesting import spelled
from gms_fsm.exporters._adapting import (
    PLACES,
    STEPS,
    check_first_call,
    step_arguments,
    translate,
    word_of,
)
from gms_fsm.exporters._names import identifier
from gms_fsm.exporters._quantities import Quantity, outputs_of, parameters_of
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.c import C_WORDS
from gms_fsm.foundation.text import visible
from gms_fsm.run.problem import LATEST, Problem
from gms_fsm.run.stepped.failing import FAILURES
from gms_fsm.run.stepped.memory import MOST_IN_EXPORTS
from integrators.loop import TOO_MANY_STEPS
from integrators.machine_code.c99 import number_text
from integrators.machine_code.front_end.translate import Translator
from integrators.machine_code.layout import BlockLayout, MemoryBlock
from integrators.machine_code.readable.c_records import CBlock, records_text
from integrators.machine_code.readable.possible import BlockStart
from integrators.machine_code.readable.simplified import simplified
from integrators.machine_code.tuning import INLINE

FIELDS = ("t", "switches", "logged", "engine", "before")  # of the struct
# Numbers of the block that the functions beside the engine write.
GIVEN = (
    "sample.end", "sample.resumed", "sample.switches", "buffers.plan.max_steps",
    "buffers.plan.control.time_scale", "sample.inputs",
)  # fmt: skip
TEMPLATES = Path(__file__).parent / "_templates"
TAKES = ("initial", "t_start", "settings")  # what the engine uses
WORDS = C_WORDS | {*FIELDS, "INFINITY", "NAN", "NULL"}
BAD_ARGUMENT = -1
PARAMETERS = "Names of the parameters; of one per element, add the number of the element, from 0."


@dataclass(frozen=True)
class CEngine:
    """C99 text, and what it defines.

    Parameters
    ----------
    name : str
        Prefix of all names.
    header, source : str
        Contents of ``name.h`` and ``name.c``.
    inputs : tuple of str
        Of each call its value at the start and at the end is given.
    outputs, parameters : tuple of Quantity
        Fields of the struct, and enumerators for ``name_get`` and ``name_set``.
    states : mapping of str to int
        Names of the states; with several contacts these begin with the contact's.
    edges : mapping of str to str
        Names of the edges; those of the enumerators, which tell several sources apart, come first.
    """

    name: str
    header: str
    source: str
    inputs: tuple[str, ...]
    outputs: tuple[Quantity, ...]
    parameters: tuple[Quantity, ...]
    states: Mapping[str, int]
    edges: Mapping[str, str]

    @functools.cached_property
    def lines(self) -> str:
        """The arguments that are the inputs, in a prototype."""
        return "".join(f"double {each}0, double {each}1, " for each in self.inputs)


def engine_of(subject: Subject) -> CEngine:
    """Return the engine of what is exported."""
    start, alone = subject.start, subject.alone
    check_first_call(subject, WORDS)
    states: dict[str, int] = {}
    edges: dict[str, str] = {}
    for bank in start.program.layout.banks:
        chart = start.system.contact(bank.name).chart
        owner = "" if alone else f"{bank.name}_"
        states |= {f"{owner}{spelled(each.name)}": k for k, each in enumerate(chart.states)}
        for edge in chart.transitions:  # one for each source
            source = f"_from_{spelled(edge.source)}" if len(edge.sources) > 1 else ""
            edges[f"{owner}{edge.name}{source}"] = f"{owner}{edge.name}"
    for each in (*states, *edges):
        identifier(each, (), f"state or edge {each!r}")
    outputs, parameters = outputs_of(start, alone, WORDS), parameters_of(start, alone, WORDS)
    made = CEngine(subject.name, "", "", subject.inputs, outputs, parameters, states, edges)
    text = _Text(made, start, subject.title)
    source = text.source()
    return replace(made, header=text.header(), source=source)


class _Text:
    """Writes header and source."""

    def __init__(self, made: CEngine, start: Problem, title: str) -> None:
        self.made, self.start, self.title, self.name = made, start, title, made.name
        self.arguments, self.layout = step_arguments(start)
        parts, outer = {"p": ("shared", "own", "inputs")}, ("functions", "buffers")
        self.block = CBlock(f"{self.name}_engine", self.layout, parts, outer)

    def header(self) -> str:
        """Return the header, with the members of the engine that its text reads."""
        name, made = self.name, self.made
        fields = [
            _field(each, "int64_t" if each.place == "mode" else "double") for each in made.outputs
        ]
        codes = [f"    {name}_{kind} = {code}," for code, kind in _codes()]
        places = [
            f"    {name}_parameter_{each.name} = {word_of(self.layout, each)},{_comment(each)}"
            for each in made.parameters
        ]
        edges = [f"    {name}_edge_{each} = {k}," for k, each in enumerate(made.edges)]
        states = [f"    {name}_state_{each} = {k}," for each, k in made.states.items()]
        return filled(
            "c/engine.h",
            name=name,
            guard=f"{name.upper()}_H",
            title=safe(self.title),
            version=__version__,
            inputs=", ".join(made.inputs) or "none",
            fields="\n".join(fields),
            log_length=MOST_IN_EXPORTS,
            engine=self.block.declared(),
            max_steps=self.start.options.max_steps,
            bad_argument=BAD_ARGUMENT,
            codes=_closed(codes),
            parameters=_enumeration(PARAMETERS, places),
            states=_closed(states),
            edges=_enumeration("Edges.", edges),
            t_start=repr(self.start.t_start),
            both="".join(f" {each}0, {each}1:" for each in made.inputs),
            lines=made.lines,
        )

    # ------------------------------------------------------------------ source
    def source(self) -> str:
        """Return the source."""
        name, made, place = self.name, self.made, self.layout.offset
        text = self.block.text
        engine, shown = self._translated(), self._shown()
        given = [
            f"    {text(place('sample.inputs') + 2 * k + j)} = {each}{j};"
            for k, each in enumerate(made.inputs)
            for j in (0, 1)
        ]
        found, put = [], []
        for first, length in self._spans():
            test = f"    if (parameter >= {first} && parameter < {first + length})\n        "
            number = text(first, index=f"parameter - {first}" if first else "parameter")
            found.append(f"{test}return &{number};")
            put.append(f"{test}{number} = value;")
        messages = [
            f'    case {name}_{kind}: return "{_REASONS[code]}";' for code, kind in _codes()
        ]
        edges = [
            f'    case {name}_edge_{each}: return "{text}";' for each, text in made.edges.items()
        ]
        return filled(
            "c/engine.c",
            name=name,
            title=safe(self.title),
            version=__version__,
            engine=engine,
            clock=text(place("buffers.now.t")),
            shown=shown,
            most=text(place("buffers.plan.max_steps")),
            lines=made.lines,
            names="".join(f"{each}0, {each}1, " for each in made.inputs),
            unless_numbers="".join(
                f"!is_number({each}{k}) || " for each in made.inputs for k in (0, 1)
            ),
            latest=repr(LATEST),
            end=text(place("sample.end")),
            given="\n".join(given),
            resumed=text(place("sample.resumed")),
            switches=text(place("sample.switches")),
            found="\n".join(found) or "    (void)block;\n    (void)parameter;",
            set="\n".join(put),
            time_scale=text(place("buffers.plan.control.time_scale")),
            log_t=text(place("sample.t"), index="k"),
            log_element=text(place("sample.machine"), index="k"),
            log_edge=text(place("sample.edge"), index="k"),
            edge_names="\n".join(edges),
            messages="\n".join(messages),
            image=_image(self.block, self.arguments),  # of the members that all these use
        )

    def _translated(self) -> str:
        """Return the functions of the integrator and of the system, as far as they are used."""
        translator, layout = Translator(INLINE), self.layout
        translate(translator, layout, STEPS)
        start = start_of(layout, self.arguments)
        place = layout.offset
        given = {8 * place(each) for each in GIVEN}
        given |= {8 * word_of(layout, each) for each in self.made.parameters}
        kept = {8 * word_of(layout, each) for each in self.made.outputs}
        kept |= {8 * place(each) for each in ("buffers.now.t", "sample.switches")}
        module = simplified(translator.module, start, given, kept)
        public = ("init", "advance", "advance_to", "get", "set", "switch", "edge", "message")
        own = [f"{self.name}_{each}" for each in (*public, "state", "engine")]
        return records_text(module, self.block, [*own, "show", "is_number", "place_of", "LATEST"])

    def _shown(self) -> str:
        lines = []
        for each in self.made.outputs:
            first = word_of(self.layout, each)
            if each.length is None:
                lines.append(f"    s->{each.name} = {self.block.text(first)};")
            else:
                loop = f"for (int k = 0; k < {each.length}; k++)"
                value = self.block.text(first, index="k")
                lines.append(f"    {loop}\n        s->{each.name}[k] = {value};")
        return "\n".join(lines)

    def _spans(self) -> list[tuple[int, int]]:
        """Return where parameters are: first word and length, joined where they touch."""
        spans: list[tuple[int, int]] = []
        own = self.layout.offset(PLACES["own"])
        for first, length in sorted(
            (word_of(self.layout, p), p.length or 1) for p in self.made.parameters
        ):
            if spans and sum(spans[-1]) == first and first != own:
                spans[-1] = spans[-1][0], spans[-1][1] + length
            else:
                spans.append((first, length))
        return spans


def start_of(layout: BlockLayout, arguments: Any) -> BlockStart:
    """Return what is in a block at the start."""
    words = MemoryBlock(layout, arguments).numbers()
    numbers = [each.offset for each in layout.numbers]
    numbers += [each.offset for each in layout.arrays if each.shape == ()]
    rows = {u.offset: math.prod(u.shape) for u in layout.arrays if u.shape and u.kind != "b"}
    return BlockStart(
        {8 * k: words[k] for k in numbers},
        {8 * k: words[k : k + count] for k, count in rows.items()},
    )


def _image(block: CBlock, arguments: Any) -> str:
    """Return C text that sets all members of a block that are used and not zero at the start."""
    lines = []
    for k, value in MemoryBlock(block.layout, arguments).set_words():
        if isinstance(value, list):
            member = block.place(8 * k, "b")
            true = (
                [8 * k + j - member.offset for j, each in enumerate(value) if each]
                if member
                else []
            )
            pairs = [(member, str(each), "true") for each in true]
        else:
            kind = "f" if isinstance(value, float) else "i"
            member = block.place(8 * k, kind)
            number = number_text(value) if isinstance(value, float) else str(value)
            pairs = [(member, str(k - member.offset // 8), number)] if member else []
        lines += [
            f"    {block.entry(member, at, 'block')} = {text};"
            for member, at, text in pairs
            if member and member.path in block.used
        ]
    return "\n".join(lines)


_REASONS = {code: reason for code, (_, reason) in FAILURES.items()}
_REASONS[TOO_MANY_STEPS] = "the call needs more steps than max_steps"
_KINDS = {
    "LIVELOCK": "LivelockError",
    "STEP_TOO_SMALL": "StepSizeError",
    "TOO_MANY_STEPS": "StepLimitError",
    "NOT_FINITE": "NotFiniteError",
    "NOT_UNIQUE": "NotUniqueError",
}


def _codes() -> list[tuple[int, str]]:
    """Return the error codes with their names."""
    found: list[tuple[int, str]] = []
    for code, (kind, _) in FAILURES.items():
        name = next(each for each, error in _KINDS.items() if error == kind.__name__)
        used = [each for _, each in found]
        found.append((code, f"{name}_OF_A_COMPARISON" if name in used else name))
    return found


def filled(template: str, **holes: object) -> str:
    """Return a template of this folder with its holes filled."""
    text = (TEMPLATES / template).read_text(encoding="utf-8")
    return Template(text).substitute(holes)


def _field(each: Quantity, kind: str) -> str:
    length = "" if each.length is None else f"[{each.length}]"
    return f"    {kind} {each.name}{length};{_comment(each)}"


def _comment(each: Quantity) -> str:
    return f" /* {safe(each.about)} */" if each.about else ""


def safe(text: str) -> str:
    """Return a text that does not end a comment."""
    return visible(text).replace("*/", "* /").replace("/*", "/ *")


def _enumeration(about: str, lines: Sequence[str]) -> str:
    """Return an enumeration; nothing if it would be empty, which C does not have."""
    return f"\n/* {about} */\nenum {{\n{_closed(lines)}\n}};\n" if lines else ""


def _closed(lines: Sequence[str]) -> str:
    """Return the lines of an enumeration, without the last comma."""
    *before, last = lines
    code, mark, comment = last.partition(" /*")
    return "\n".join([*before, code.rstrip(",") + mark + comment])
