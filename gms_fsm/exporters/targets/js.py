"""JavaScript: the engine itself as a module, for node and for browsers.

A system becomes a function that runs it; one friction a class whose inputs the caller moves.
"""

from __future__ import annotations

import inspect
import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from gms_fsm._version import __version__
from gms_fsm.errors import ParameterError
from gms_fsm.exporters._adapting import (
    STEPS,
    check_first_call,
    step_arguments,
    translate,
    word_of,
)
from gms_fsm.exporters._c import filled
from gms_fsm.exporters._quantities import Quantity, outputs_of, parameters_of
from gms_fsm.exporters._subject import Subject
from gms_fsm.formats import Format, register
from gms_fsm.foundation.text import visible
from gms_fsm.lowering.adapting import OF_A_RUN, Adapting, adapt
from gms_fsm.lowering.compiling import packed
from gms_fsm.lowering.program import equations
from gms_fsm.run.problem import LATEST, Problem
from gms_fsm.run.recording.following import adapting_of
from gms_fsm.run.recording.ready_code import example_of
from gms_fsm.run.stepped.failing import FAILURES
from gms_fsm.systems.signals import Function
from integrators import hybrid, loop
from integrators.machine_code.front_end.translate import Translator
from integrators.machine_code.front_end.values import NumberValue
from integrators.machine_code.layout import BlockLayout, MemoryBlock, OuterArray
from integrators.machine_code.script.javascript import javascript_text, script_number, tables_of
from integrators.machine_code.tree import Const, Local
from integrators.machine_code.tuning import INLINE
from integrators.runners import columns
from integrators.runners.compiled import RECORD, is_known
from integrators.runners.observing import observe_rows
from integrators.runners.stepping import FULL_LOG

GROWING = {
    "buffers.out.rows_t": "rows_t",
    "buffers.out.rows_y": "rows_y",
    "log.rows_microstep": "rows_microstep",
    "log.rows_mode": "rows_mode",
    "log.t": "log_t",
    "log.machine": "log_machine",
    "log.edge": "log_edge",
    "log.numbers": "log_numbers",
    "more.table": "table",
    "more.shown": "shown",
}
OBSERVED = (
    "functions machines.observe buffers.now.held buffers.sliding buffers.out.rows_t "
    "buffers.out.rows_y log.rows_mode log.seen more.table"
)


class WholeRun(NamedTuple):
    """What further entries of a run need: `more` of its arguments."""

    adapting: Adapting
    table: Any  # observed values of the rows


def js(subject: Subject) -> dict[str, str]:
    """Return a module, its types and a README."""
    name = subject.name
    made = _Friction(subject) if subject.alone else RunModule(subject)
    return {
        f"{name}.mjs": made.module(),
        f"{name}.d.mts": made.types(),
        f"README-{name}-js.md": made.readme(),
    }


class _Module(ABC):
    """What both kinds of modules have in common."""

    face: str  # the template of what a user calls
    error_fields = ""
    errors = ""
    switch_fields = ""

    def __init__(self, subject: Subject, start: Problem, arguments: Any, alone: bool) -> None:
        self.subject, self.start, self.arguments = subject, start, arguments
        self.layout = BlockLayout(arguments, is_known)
        self.outputs = outputs_of(start, alone, ())
        self.numbers = parameters_of(start, alone, ())

    # ------------------------------------------------------------------ what differs
    @abstractmethod
    def entries(self, translator: Translator) -> list[str]:
        """Translate the entries, and return their names."""

    @abstractmethod
    def holes(self) -> dict[str, object]:
        """Return what the template of the face needs."""

    def columns(self) -> Mapping[str, tuple[Any, ...]]:
        """Return the contents of columns by the paths to them; of those that grow nothing."""
        return {}

    @abstractmethod
    def output(self, each: Quantity) -> dict[str, Any]:
        """Return where an output is."""

    @abstractmethod
    def example(self) -> str:
        """Return a program that uses the module."""

    # ------------------------------------------------------------------ files
    def module(self) -> str:
        """Return the module."""
        translator = Translator(INLINE)
        entries = self.entries(translator)
        code = javascript_text(translator.module)
        _, tables = tables_of(translator.module)
        image, true = self.image()
        return filled(
            "js/js.mjs",
            name=self.subject.name,
            title=visible(self.subject.title),
            version=__version__,
            tables=_folded(map(script_number, tables)),
            words=self.layout.words,
            image=_folded(f"[{k}, {value}]" for k, value in image),
            true_bytes=_folded(map(str, true)),
            columns=self._columns(),
            code="\n".join(f"    {line}".rstrip() for line in code.splitlines()),
            entries=", ".join(entries),
            time_scale=self.layout.offset("buffers.plan.control.time_scale"),
            numbers=_table({each.name: self._number(each) for each in self.numbers}),
            outputs=_table({each.name: self.output(each) for each in self.outputs}),
            failures=_table(self.failures()),
            states=_table(
                {
                    contact.name: [state.name for state in contact.chart.states]
                    for contact in self.start.system.machines
                }
            ),
            edges=_rows(self._edges()),
            face=filled(f"js/{self.face}.mjs", **self.holes()),
        )

    def types(self) -> str:
        """Return the module's types."""
        lines = [
            f"    {each.name}?: number{' | readonly number[]' if each.length else ''};{_note(each)}"
            for each in self.numbers
        ]
        return filled(
            "js/js.d.mts",
            name=self.subject.name,
            version=__version__,
            numbers="\n".join(lines),
            error_fields=self.error_fields,
            switch_fields=self.switch_fields,
            types=filled(f"js/{self.face}.d.mts", **self._face_types()),
        )

    def readme(self) -> str:
        """Return what a user reads first."""
        settings = self.subject.settings
        shown = [each.shown for each in self.numbers]
        return filled(
            "js/js.md",
            name=self.subject.name,
            title=visible(self.subject.title),
            example=self.example(),
            errors=self.errors,
            method=settings.method_name,
            rtol=repr(settings.rtol),
            numbers="\n".join(shown) or "- none",
        )

    # ------------------------------------------------------------------ parts
    def _face_types(self) -> dict[str, object]:
        kind = "Float64Array" if self.face == "js_run" else "number"
        lines = []
        for each in self.outputs:
            one = "Int32Array" if each.place == "mode" and self.face == "js_run" else kind
            many = "" if each.length is None else "readonly "
            lines.append(
                f"    readonly {each.name}: {many}{one}{'[]' if many else ''};{_note(each)}"
            )
        return {"outputs": "\n".join(lines)}

    def image(self) -> tuple[list[tuple[int, str]], list[int]]:
        """Return the words that are not zero at the start, and the bytes that are true."""
        return _image(MemoryBlock(self.layout, self.arguments))

    def _columns(self) -> str:
        return _inside(_table(self.growing()))

    def growing(self) -> dict[str, dict[str, Any]]:
        """Return where the block has the columns outside it, and what is in them at first."""
        contents, found = self.columns(), dict[str, dict[str, Any]]()
        paths = self.layout.column_offsets
        for path, (offset, lengths, width) in paths.items():
            data: Any = np.asarray(contents.get(path, ()), dtype=np.float64)
            wide = width or (data.shape[1] if data.ndim == 2 else 1)
            found[GROWING.get(path, path)] = {
                "offset": offset,
                "lengths": lengths,
                "width": wide,
                "rows": data.shape[0],
                "data": data.ravel().tolist(),
            }
        return found

    def _number(self, each: Quantity) -> dict[str, Any]:
        value = each.values[0] if each.length is None else list(each.values)
        place = word_of(self.layout, each)
        known = {"place": place, "unit": each.unit, "meaning": each.meaning, "value": value}
        return known if each.length is None else {**known, "length": each.length}

    def failures(self) -> dict[str, str]:
        """Return what the codes of calls that cannot go on mean."""
        return {str(code): reason for code, (_, reason) in FAILURES.items()}

    def _edges(self) -> list[dict[str, str]]:
        return [
            {
                "contact": contact.name,
                "edge": edge.name,
                "source": edge.source,
                "target": edge.target,
            }
            for contact in self.start.system.machines
            for edge in contact.chart.transitions
        ]


class RunModule(_Module):
    """A system, from its start to its end."""

    face = "js_run"
    error_fields = """
    /** What had been computed before a run could not go on. */
    readonly run?: Run;
"""
    errors = " What had been\ncomputed before a run could not go on is its `run`."
    switch_fields = """\
    /** Its first variable, the velocity and the threshold before it. */
    readonly z: number;
    readonly v: number;
    readonly s: number;
    readonly F_before: number;
    readonly F_after: number;
"""

    def __init__(self, subject: Subject) -> None:
        given, t_end = subject.system, subject.t_end
        for name, signal in given.signals.items():
            if isinstance(signal, Function):
                raise ParameterError(
                    f"it is a Python function{_home(signal.call)}, which cannot be printed",
                    place=f"signal {name!r}",
                    advice="give it as an expression in t, or as a record",
                )
        if t_end is None:
            raise ParameterError(
                "a run needs its end", place="t_end", advice="for example t_end=10.0 (s)"
            )
        start = Problem.of(
            given, None, t_end, subject.settings, t_start=subject.t_start, initial=subject.initial
        )
        if not isinstance(start.chosen.method, str) or start.output == "end":
            raise ParameterError(
                "only the methods of gms-fsm can be printed, and their rows",
                place="settings",
                advice='leave method and output out, or choose method="dp45"',
            )
        whole = example_of(start)._replace(more=self.more(start))
        super().__init__(subject, start, whole, alone=False)

    def more(self, start: Problem) -> tuple[Any, ...]:
        """Return what further entries need."""
        return WholeRun(adapting_of(start), OuterArray("f", start.program.layout.observed.size))

    def entries(self, translator: Translator) -> list[str]:
        """Translate the run, what follows from its numbers, and what is observed of its rows."""
        part = self.layout.part
        run = [part(each) for each in RECORD.split()]
        names = "steps", "pause", "start", "count"
        steps, pause, start, count = (NumberValue(Local("i", each)) for each in names)
        translator.entry("record", columns.record, [*run, steps, pause])
        translator.entry("adapt", adapt, [part(each) for each in OF_A_RUN.split()])
        seen = [part(each) for each in OBSERVED.split()]
        translator.entry("show", observe_rows, [*seen, start, NumberValue(Const("i", 0)), count])
        return ["record", "adapt", "show"]

    def columns(self) -> Mapping[str, tuple[Any, ...]]:
        """Return the plan of the run, the times of requested rows, and the tables of signals."""
        start = self.start
        plan = hybrid.plan_of(
            equations(start.program), start.t_start, start.last, start.options, len(start.mode)
        )
        found: dict[str, Any] = {
            f"buffers.plan.{each}": getattr(plan, each)
            for each in ("jumps", "before_jumps", "ticks", "knots")
        }
        times = start.options.times
        found["buffers.out.times"] = () if times is None else times
        found["functions.p.2"] = packed(start.program.p)[2]
        return found

    def output(self, each: Quantity) -> dict[str, Any]:
        """Return the column of an output."""
        known = {"place": each.place, "index": each.index}
        return known if each.length is None else {**known, "length": each.length}

    def holes(self) -> dict[str, object]:
        """Return codes, sizes, and places in the block."""
        start, place, layout = self.start, self.layout.offset, self.start.program.layout
        return {
            "ROWS": loop.ROWS,
            "DONE": loop.DONE,
            "FIRING": loop.FIRING,
            "modes": layout.modes,
            "size": layout.y.size,
            "observed": layout.observed.size,
            "clock": place("buffers.now.t"),
            "machine": place("buffers.memory.machine"),
            "livelock": loop.MACHINE_LIVELOCK,
            "row": place("buffers.out.row"),
            "firings": place("log.firings"),
            "t_start": repr(start.t_start),
            "t_end": repr(start.t_end),
            "times": "undefined" if start.options.times is None else len(start.options.times),
            "first_elements": _table({bank.name: bank.first for bank in layout.banks}),
            "elements": json.dumps(self.elements()),
        }

    def elements(self) -> list[str]:
        """Return what the elements are called in messages."""
        banks = self.start.program.layout.banks
        return [
            f"element {i + 1}" + (f" of {bank.name}" if len(banks) > 1 else "")
            for bank in banks
            for i in range(bank.n)
        ]

    def failures(self) -> dict[str, str]:
        """Return what the codes of runs that cannot go on mean."""
        steps = f"it needs more than {self.start.options.max_steps:,} steps"
        return {**super().failures(), str(loop.TOO_MANY_STEPS): steps}

    def example(self) -> str:
        """Return a program that runs the module."""
        name, first = self.subject.name, self.outputs[0].name
        change = f"{{ {self.numbers[0].name}: ... }}" if self.numbers else "{}"
        return f"""\
    import {{ run }} from "./{name}.mjs";

    const {{ t, outputs, log }} = run();
    console.log(t.at(-1), outputs.{first}.at(-1), log.length);

`run({change})` runs it with other numbers. `outputs` has a column for each
quantity, one entry per row; of one per element it is an array of columns. `log` has the switches.
A run begins at {self.start.t_start!r} s and ends at {self.start.t_end!r} s."""


class _Friction(_Module):
    """One friction, whose inputs the caller moves."""

    face = "js_friction"

    def __init__(self, subject: Subject) -> None:
        check_first_call(subject, ())
        super().__init__(subject, subject.start, step_arguments(subject.start)[0], alone=True)

    def entries(self, translator: Translator) -> list[str]:
        """Translate a step, and what follows from the numbers."""
        return translate(translator, self.layout, STEPS)

    def output(self, each: Quantity) -> dict[str, Any]:
        """Return the words of an output."""
        known = {"place": word_of(self.layout, each)}
        return known if each.length is None else {**known, "length": each.length}

    def holes(self) -> dict[str, object]:
        """Return places in the block."""
        place = self.layout.offset
        return {
            "t_start": repr(self.start.t_start),
            "latest": repr(LATEST),
            "full_log": FULL_LOG,
            "clock": place("buffers.now.t"),
            "end": place("sample.end"),
            "given": place("sample.inputs"),
            "resumed": place("sample.resumed"),
            "switches": place("sample.switches"),
            "log_t": place("sample.t"),
            "log_element": place("sample.machine"),
            "log_edge": place("sample.edge"),
            "inputs": ", ".join(self.subject.inputs),
            "input_names": json.dumps(self.subject.inputs),
        }

    def _face_types(self) -> dict[str, object]:
        inputs = [f"    readonly {each}: number;" for each in self.subject.inputs]
        return {**super()._face_types(), "inputs": "\n".join(inputs)}

    def example(self) -> str:
        """Return a program that moves the friction."""
        name = self.subject.name
        slow, fast = (
            "{ " + ", ".join(f"{each}: {u}" for each in self.subject.inputs) + " }"
            for u in ("0.0", "0.01")
        )
        return f"""\
    import {{ Friction }} from "./{name}.mjs";

    const friction = new Friction();
    const {{ F }} = friction.advance({slow}, {fast}, 0.001);
    console.log(friction.t, F, friction.log);

During a call each input runs on a straight line, from its value at the start to that at the end;
then the time has advanced by the third argument. `log` has the switches of the last call."""


def _home(call: Any) -> str:
    """Return where a function is defined, as ``name at file:line``."""
    code = getattr(inspect.unwrap(call), "__code__", None)
    name = getattr(call, "__name__", type(call).__name__)
    return f" ({name})" if code is None else f" ({code.co_filename}:{code.co_firstlineno}, {name})"


def _image(block: MemoryBlock) -> tuple[list[tuple[int, str]], list[int]]:
    """Return the words that are not zero, and the bytes that are true."""
    words, true = list[tuple[int, str]](), list[int]()
    for k, value in block.set_words():
        if isinstance(value, list):
            true += [8 * k + j for j, each in enumerate(value) if each]
        else:
            words.append((k, script_number(value) if isinstance(value, float) else str(value)))
    return words, true


def _value(value: Any) -> str:
    if isinstance(value, float):
        return script_number(value)
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key}: {_value(each)}" for key, each in value.items()) + " }"
    return json.dumps(value)


def _table(rows: Mapping[str, Any]) -> str:
    """Return an object with one entry a line."""
    lines = [f"    {json.dumps(key)}: {_value(value)}," for key, value in rows.items()]
    return "\n".join(["{", *lines, "}"]) if lines else "{}"


def _rows(rows: Iterable[Any]) -> str:
    return "\n".join(["[", *(f"    {_value(each)}," for each in rows), "]"])


def _inside(text: str) -> str:
    return text.removeprefix("{").removesuffix("}")


def _folded(parts: Iterable[str]) -> str:
    """Return parts with commas, in lines that are not too long."""
    lines, line = list[str](), ""
    for each in parts:
        if len(line) + len(each) > 96:
            lines.append(line)
            line = ""
        line += f"{each}, "
    return "\n    ".join([*lines, line]).rstrip().removesuffix(",")


def _note(each: Quantity) -> str:
    return f" // {visible(each.about)}" if each.about else ""


register(
    Format(
        "js",
        "friction",
        "a JavaScript module: runs of a system, or one friction step by step",
        "gms-fsm",
        js,
        takes=("initial", "t_start", "settings", "t_end"),
        whole=True,
    )
)
