"""The plain form as C99: a struct, and a function that is called once a step."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from gms_fsm.errors import ParameterError
from gms_fsm.exporters._element import Element
from gms_fsm.exporters._element_parts import Constant
from gms_fsm.exporters._plain_form import (
    ByState,
    Declare,
    Enter,
    Guards,
    Plain,
    Set,
    Statement,
    plain_form,
)
from gms_fsm.exporters._subject import Subject
from gms_fsm.language import C99, ELEMENTARY, FUNCTIONS, NAMESPACE, Name, Node, spell
from integrators.machine_code.c99 import c99_text
from integrators.machine_code.translate import Translator
from integrators.machine_code.tree import Local
from integrators.machine_code.values import NumberValue

__all__ = ["C_WORDS", "plain_c", "plain_c_notes"]

# Keywords of C99 (6.4.1) and C11 to C23, of C++ where a header may be included, and names of
# math.h that compilers know by themselves.
C_WORDS = frozenset(
    re.findall(
        r"\w+",
        """
    auto break case char const continue default do double else enum extern float for goto if inline
    int long register restrict return short signed sizeof static struct switch typedef union
    unsigned void volatile while _Bool _Complex _Imaginary _Alignas _Alignof _Atomic _Generic
    _Noreturn _Static_assert _Thread_local alignas alignof bool constexpr false nullptr
    static_assert thread_local true typeof typeof_unqual
    and and_eq asm bitand bitor catch char8_t char16_t char32_t class co_await co_return co_yield
    compl concept const_cast consteval constinit decltype delete dynamic_cast explicit export friend
    mutable namespace new noexcept not not_eq operator or or_eq private protected public
    reinterpret_cast requires static_cast template this throw try typeid typename using virtual
    wchar_t xor xor_eq main
    """,
    )
)
OWN = {name: 2 if name == "pow" else 1 for name in ELEMENTARY}  # arguments
HELPERS = {
    "sgn": "(double u)\n{\n    return u > 0.0 ? 1.0 : u < 0.0 ? -1.0 : 0.0;\n}",
    "min": "(double a, double b)\n{\n    return b < a ? b : a;\n}",
    "max": "(double a, double b)\n{\n    return b > a ? b : a;\n}",
}


def plain_c(subject: Subject) -> dict[str, str]:
    """Return the plain form of a friction: ``<name>_plain.h`` and ``<name>_plain.c``.

    Parameters
    ----------
    subject : Subject
        One friction, whose velocity is an input.

    Returns
    -------
    dict of str to str
        Contents by file name.

    Raises
    ------
    ParameterError
        If it cannot be expressed; what is in the way is named.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> files = plain_c(Subject.of(model, "c99", name="gms"))
    >>> "else if (z <= -s && v < -v_c)" in files["gms_plain.c"]
    True
    """
    printer = _Printer(subject)
    return {f"{subject.name}_plain.h": printer.header(), f"{subject.name}_plain.c": printer.code()}


def plain_c_notes(subject: Subject) -> str:
    """Return what a README says about the files of `plain_c`.

    Parameters
    ----------
    subject : Subject
        As for `plain_c`.

    Returns
    -------
    str
        Plain text.
    """
    name = subject.name
    return f"""\
{name}_plain.h, {name}_plain.c: the plain form, for a microcontroller.

    {name}_plain friction;
    {name}_plain_start(&friction);
    F = {name}_plain_step(&friction, v, dt);    /* once a step */

Each call looks at every guard once, returns the force, and then takes one explicit Euler step of
length dt with this velocity. There is no heap and no global variable; exp, sin and the like are in
the file itself and have the same bits on every platform. Compile it with any C99 compiler, such as

    gcc -std=c99 -O2 -ffp-contract=off -c {name}_plain.c

With these options the numbers are those of
simulate(model, Prescribed(record), t_end, method="euler", step=dt, events="step"), to the last bit.
All of them are double.

What it does not do: switches are seen at the next step, not where they happen, so the result is of
first order in dt; a velocity that passes through a narrow guard between two steps is not noticed.
"""


class _Printer:
    """Prints the plain form of a friction."""

    def __init__(self, subject: Subject) -> None:
        words = {*C_WORDS, *FUNCTIONS, "fabs"}
        self.element = Element.of(subject, words)
        self.form: Plain = plain_form(self.element)
        self.name = f"{subject.name}_plain"
        self.refuse_own_names()
        own = {name: f"{self.name}_{name}({{all}})" for name in (*OWN, *HELPERS)}
        self.dialect = replace(C99, functions={**own, **C99.functions})
        # The machine's own names give way to those of the chart.
        self.me = self.element.free("friction")
        # One element needs no arrays and no loop.
        self.i = self.element.free("i") if self.element.n > 1 else ""
        self.at = f"[{self.i}]" if self.i else ""
        element = self.element
        numbers = {c.name for c in element.constants if isinstance(c.value, tuple)}
        self.texts = {name: f"{name}{self.at}" for name in numbers}
        if element.position:
            self.texts[element.position] = f"{self.me}->{element.position}"

    def refuse_own_names(self) -> None:
        """Refuse a quantity that would hide what the text defines."""
        for name in (*(each for each, _ in self.element.inputs), *self.element.names):
            if name == self.name or name.startswith(f"{self.name}_"):
                raise ParameterError(
                    f"names that begin with {self.name!r} are those of the text itself",
                    place=f"chart {self.element.title!r}, name {name!r}",
                    advice="give it another name, or the files (--name)",
                )

    def state(self, index: int) -> str:
        # As written: stick and Stick are two states.
        return f"{self.name}_state_{self.element.states[index].name}"

    # ------------------------------------------------------------------ the header
    def header(self) -> str:
        element, guard = self.element, self.element.free(f"{self.name.upper()}_H")
        several = len(element.states) > 1
        names = [self.state(index) for index in range(len(element.states))]
        size = f"[{element.n}]" if self.i else ""
        fields = [f"    double {each.name}{size};{_note(each.about)}"
                  for each in element.variables]  # fmt: skip
        if element.position:
            fields.append(f"    double {element.position};  /* m: position */")
        if several:
            fields.append(f"    enum {self.name}_state state{size};")
        lines = [
            f"/* {_plain_text(element.title)}: the plain form, once a step. */",
            f"#ifndef {guard}",
            f"#define {guard}",
            "",
            "#ifdef __cplusplus",
            'extern "C" {',
            "#endif",
            "",
        ]
        if several:
            lines += [f"enum {self.name}_state {{ {', '.join(names)} }};", ""]
        lines += [
            f"typedef struct {self.name} {{",
            *(fields or ["    char unused;  /* this friction has no memory */"]),
            f"}} {self.name};",
            "",
            f"void {self.name}_start({self.name} *{self.me});",
            "",
            "/* One step: the force at its beginning [N]. */",
            f"{self.signature()};",
            "",
            "#ifdef __cplusplus",
            "}",
            "#endif",
            "#endif",
        ]
        return "\n".join(lines) + "\n"

    def signature(self) -> str:
        inputs = [name for name, _ in self.element.inputs]
        arguments = ", ".join(f"double {name}" for name in (*inputs, self.form.dt))
        return f"double {self.name}_step({self.name} *{self.me}, {arguments})"

    # ------------------------------------------------------------------ the code
    def code(self) -> str:
        body = self.step()
        start = self.start()
        text = "\n".join([*start, *body])
        lines = [
            f"/* {_plain_text(self.element.title)}: the plain form, once a step. */",
        ]
        if self.element.reference:
            lines.append(f"/* {_plain_text(self.element.reference)} */")
        used = [name for name in OWN if f"{self.name}_{name}(" in text]
        if used:
            lines.append(self.elementary(used))
        elif any(f"{each.split('(')[0]}(" in text for each in C99.functions.values()):
            lines += ["#include <math.h>", ""]
        lines += [f'#include "{self.name}.h"']
        for name, helper in HELPERS.items():
            if f"{self.name}_{name}(" in text:
                lines += ["", f"static double {self.name}_{name}{helper}"]
        return "\n".join([*lines, "", *start, "", *body]) + "\n"

    def elementary(self, names: Iterable[str]) -> str:
        """Return the functions that are the same on every platform."""
        translator = Translator()
        for name in names:
            numbers = [NumberValue(Local("f", each)) for each in "xy"[: OWN[name]]]
            translator.entry(f"{self.name}_{name}", NAMESPACE[name], numbers)
        return c99_text(translator.module, [self.name, *self.element.names], hidden=True)

    def start(self) -> list[str]:
        element, lines = self.element, list[str]()
        for each in element.variables:
            for i, value in enumerate(each.start):
                at = f"[{i}]" if self.i else ""
                lines.append(f"    {self.me}->{each.name}{at} = {self.dialect.number(value)};")
        if element.position:
            start = self.dialect.number(element.position_start)
            lines.append(f"    {self.me}->{element.position} = {start};")
        if len(element.states) > 1:
            for i, index in enumerate(element.start):
                at = f"[{i}]" if self.i else ""
                lines.append(f"    {self.me}->state{at} = {self.state(index)};")
        lines = lines or [f"    {self.me}->unused = 0;"]
        return [f"void {self.name}_start({self.name} *{self.me})", "{", *lines, "}"]

    def step(self) -> list[str]:
        element, form = self.element, self.form
        elements = [*self.statements(form.guards), *self.statements(form.flows)]
        loads = [f"double {each.name} = {self.me}->{each.name}{self.at};"
                 for each in element.variables]  # fmt: skip
        stores = [
            f"{self.me}->{each.name}{self.at} = {self.spell(each.tree)};" for each in form.updates
        ]
        inner = [*loads, *elements, f"{form.force} += {form.part};", *stores]
        body = [*map(self.constant, element.constants)]
        body += [f"double {form.force} = 0.0;", "", *self.statements(form.shared)]
        if self.i:
            body += [f"for (int {self.i} = 0; {self.i} < {element.n}; {self.i}++) {{"]
            body += [*_indented(inner), "}"]
        else:
            body += inner
        total = element.total.tree
        body += [f"{form.force} = {self.spell(total)};"] if total != Name(form.force) else []
        if element.position:
            place = f"{self.me}->{element.position}"
            velocity = element.inputs[0][0]
            body.append(f"{place} = {place} + {form.dt} * {velocity};")
        body.append(f"return {form.force};")
        text = "\n".join(body)
        unused = [
            f"(void){name};"
            for name in (self.me, *(name for name, _ in element.inputs), form.dt)
            if not re.search(rf"(?<!\w){name}(?!\w)", text)
        ]
        return [self.signature(), "{", *_indented([*unused, *body]), "}"]

    def constant(self, constant: Constant) -> str:
        number, value = self.dialect.number, constant.value
        if isinstance(value, tuple):
            numbers = ", ".join(map(number, value))
            text = f"{constant.name}[{len(value)}] = {{{numbers}}}"
        else:
            text = f"{constant.name} = {number(value)}"
        return f"static const double {text};{_note(constant.about)}"

    # ------------------------------------------------------------------ statements
    def spell(self, tree: Node) -> str:
        return spell(tree, self.dialect, self.texts)

    def statements(self, found: Sequence[Statement]) -> list[str]:
        return [line for each in found for line in self.statement(each)]

    def statement(self, statement: Statement) -> Iterator[str]:
        match statement:
            case Set(name, tree, note, new):
                kind = "const double " if new else ""
                yield f"{kind}{name} = {self.spell(tree)};{_note(note)}"
            case Declare(names):
                if names:
                    yield f"double {', '.join(names)};"
            case Enter(state):
                yield f"{self.me}->state{self.at} = {self.state(state)};"
            case Guards(edges):
                word = "if"
                for edge, taken in edges:
                    yield f"{word} ({self.spell(edge.guard)}) {{  /* {edge.name} */"
                    yield from _indented(self.statements(taken))
                    word = "} else if"
                yield "}"
            case ByState(branches):
                yield from self.by_state(branches)

    def by_state(self, branches: Sequence[Sequence[Statement]]) -> Iterator[str]:
        if len(branches) == 1:
            yield from self.statements(branches[0])
            return
        yield f"switch ({self.me}->state{self.at}) {{"
        for index, branch in enumerate(branches):
            last = index == len(branches) - 1
            scope = any(isinstance(each, Set) and each.new for each in branch)
            yield f"case {self.state(index)}:{' {' if scope and not last else ''}"
            if last:
                yield f"default:{' {' if scope else ''}"
            yield from _indented([*self.statements(branch), "break;"])
            if scope:
                yield "}"
        yield "}"


def _indented(lines: Iterable[str]) -> list[str]:
    return [f"    {line}" if line else "" for line in lines]


def _note(text: str) -> str:
    return f"  /* {_plain_text(text)} */" if text else ""


def _plain_text(text: str) -> str:
    """Return a text that may stand in a comment."""
    return re.sub(r"\s+", " ", text.replace("*/", "* /").replace("/*", "/ *").replace("\\", "/"))
