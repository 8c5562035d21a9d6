"""The plain form as C99: a struct, and a function that is called once a step."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

from gms_fsm.errors import ParameterError
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.element import NamedFriction
from gms_fsm.exporters.plain.form import plain_form
from gms_fsm.exporters.plain.parts import Constant
from gms_fsm.exporters.plain.walker import Forms, Walker, indented
from gms_fsm.language import ARGUMENTS, C99, FUNCTIONS, NAMESPACE
from integrators.machine_code.front_end.translate import Translator
from integrators.machine_code.front_end.values import NumberValue
from integrators.machine_code.readable.c_records import records_text
from integrators.machine_code.readable.possible import BlockStart
from integrators.machine_code.readable.simplified import simplified
from integrators.machine_code.tree import Local

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
HELPERS = {
    "sgn": "(double u)\n{\n    return u > 0.0 ? 1.0 : u < 0.0 ? -1.0 : 0.0;\n}",
    "min": "(double a, double b)\n{\n    return b < a ? b : a;\n}",
    "max": "(double a, double b)\n{\n    return b > a ? b : a;\n}",
}
FORMS = Forms(
    assign="{0} = {1};",
    new="const double {0} = {1};",
    load="double {0} = {1};",
    declare="double {0};",
    first="if ({0}) {{",
    then="}} else if ({0}) {{",
    other="}} else {{",
    end="}",
    loop="for (int {0} = 0; {0} < {1}; {0}++) {{",
    end_loop="}",
    comment="/* {0} */",
    marks={"*/": "* /", "/*": "/ *", "\\": "/"},
)


def plain_c(subject: Subject) -> dict[str, str]:
    """Return the plain form of a friction: ``<name>_plain.h`` and ``<name>_plain.c``.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> files = plain_c(Subject.of(model, "c99", name="gms"))
    >>> "else if (z <= -s && v < -v_c)" in files["gms_plain.c"]
    True
    """
    printer = PlainC(subject)
    return {f"{subject.name}_plain.h": printer.header(), f"{subject.name}_plain.c": printer.code()}


def plain_c_notes(subject: Subject) -> str:
    """Return what a README says about the files of `plain_c`."""
    name = subject.name
    return f"""\
{name}_plain.h, {name}_plain.c: the plain form, for a microcontroller.

    {name}_plain friction;
    {name}_plain_start(&friction);
    F = {name}_plain_sample(&friction, v0, v1, dt);    /* once a sample */

During a sample the velocity goes from v0 to v1 on a straight line; the force is that at its end. A
call takes at most four steps, so its time is bounded. Where the velocity changes its sign a step
ends, and the guards are looked at there: an arrest is found although no sample has that velocity.
The limits are in the header.

A step, {name}_plain_step(&friction, v, dt), can also be called by itself: it looks at every guard
once, returns the force, and then takes one explicit Euler step of length dt with this velocity.
There is no heap and no global variable; exp, sin and the like are in the file itself and have the
same bits on every platform. Compile it with any C99 compiler, such as

    gcc -std=c99 -O2 -ffp-contract=off -c {name}_plain.c

With these options the numbers of single steps are those of
simulate(model, Prescribed(record), t_end, method="euler", step=dt, events="step"), to the last bit.
All of them are double.

What it does not do: other switches are seen at the next step, not where they happen, so the result
is of first order in dt. A single step does not notice that the velocity has passed through a guard.
"""


def limits_of(element: NamedFriction) -> list[str]:
    """Return within which limits a sample finds every arrest, in sentences."""
    found = [
        "the velocity is linear in the sample, other inputs are constant",
        "an element switches once in the sample at most, and once more after a change of direction",
        "guards are looked at where steps end: while an element sticks, |v| * dt is small beside "
        "the deflection at which it breaks away",
        "dt times the fastest rate at which a variable relaxes is at most 0.1",
    ]
    scale = next((c for c in element.constants if c.about.endswith("Stribeck velocity")), None)
    if scale is not None and not isinstance(scale.value, tuple):
        unit = scale.about.partition(":")[0]
        found.insert(1, f"|v1 - v0| is at most {scale.name} = {scale.value!r} {unit}")
    return found


class PlainC:
    """Prints the plain form of a friction."""

    def __init__(self, subject: Subject) -> None:
        words = {*C_WORDS, *FUNCTIONS, "fabs"}
        self.element = NamedFriction.of(subject, words)
        self.form = plain_form(self.element)
        self.name = f"{subject.name}_plain"
        self.refuse_own_names()
        own = {name: f"{self.name}_{name}({{all}})" for name in (*ARGUMENTS, *HELPERS)}
        # The machine's own names give way to those of the chart.
        element, self.me = self.element, self.element.free("friction")
        # One element needs no arrays and no loop.
        self.i = element.free("i") if element.n > 1 else ""
        self.ends = element.free("v0"), element.free("v1")
        self.at = f"[{self.i}]" if self.i else ""
        texts = {c.name: f"{c.name}{self.at}" for c in element.constants if c.several}
        if element.position:
            texts[element.position] = f"{self.me}->{element.position}"
        self.walker = Walker(
            FORMS,
            replace(C99, functions={**own, **C99.functions}),
            texts,
            [each.name for each in element.states],
            test=lambda k: f"{self.me}->state{self.at} == {self.state(k)}",
            enter=lambda k: f"{self.me}->state{self.at} = {self.state(k)};",
            count=element.n,
            index=self.i,
            memory={e.name: f"{self.me}->{e.name}{self.at}" for e in element.variables},
        )

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
        fields = [
            f"    double {each.name}{size};{FORMS.note(each.about)}" for each in element.variables
        ]
        if element.position:
            fields.append(f"    double {element.position};  /* {self.element.length}: position */")
        if several:
            fields.append(f"    enum {self.name}_state state{size};")
        lines = [
            f"/* {FORMS.clean(element.title)}: the plain form, once a step. */",
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
            "/* One step with a constant velocity:",
            f" * the force at its beginning [{self.element.force}]. */",
            f"{self.signature()};",
            "",
            "/* One sample, in which the velocity goes from v0 to v1 on a straight line: the force",
            f" * at its end [{self.element.force}]. A change of direction is found, in at most",
            " * four steps. Limits:",
            *(f" * - {FORMS.clean(each)};" for each in limits_of(element)[:-1]),
            f" * - {FORMS.clean(limits_of(element)[-1])}. */",
            f"{self.sample_signature()};",
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

    def sample_signature(self) -> str:
        start, end = self.ends
        others = [name for name, _ in self.element.inputs[1:]]
        arguments = ", ".join(f"double {name}" for name in (start, end, *others, self.form.dt))
        return f"double {self.name}_sample({self.name} *{self.me}, {arguments})"

    # ------------------------------------------------------------------ the code
    def code(self) -> str:
        body = self.step()
        start = self.start()
        text = "\n".join([*start, *body])
        lines = [
            f"/* {FORMS.clean(self.element.title)}: the plain form, once a step. */",
        ]
        if self.element.reference:
            lines.append(f"/* {FORMS.clean(self.element.reference)} */")
        used = [name for name in ARGUMENTS if f"{self.name}_{name}(" in text]
        if used:
            lines.append(self.elementary(used).rstrip())
            lines.append("")
        elif "fabs(" in text or "sqrt(" in text:
            lines += ["#include <math.h>", ""]
        lines += [f'#include "{self.name}.h"']
        for name, helper in HELPERS.items():
            if f"{self.name}_{name}(" in text:
                lines += ["", f"static double {self.name}_{name}{helper}"]
        return "\n".join([*lines, "", *start, "", *body, "", *self.sample()]) + "\n"

    def elementary(self, names: Iterable[str]) -> str:
        """Return the functions that are the same on every platform."""
        translator = Translator()
        for name in names:
            numbers = [NumberValue(Local("f", each)) for each in "xy"[: ARGUMENTS[name]]]
            translator.entry(f"{self.name}_{name}", NAMESPACE[name], numbers)
        module = simplified(translator.module, BlockStart({}, {}), (), ())
        return records_text(module, taken=[self.name, *self.element.names])

    def start(self) -> list[str]:
        element, number, lines = self.element, C99.number, list[str]()
        for each in element.variables:
            for i, value in enumerate(each.start):
                at = f"[{i}]" if self.i else ""
                lines.append(f"{self.me}->{each.name}{at} = {number(value)};")
        if element.position:
            lines.append(f"{self.me}->{element.position} = {number(element.position_start)};")
        if len(element.states) > 1:
            for i, index in enumerate(element.start):
                at = f"[{i}]" if self.i else ""
                lines.append(f"{self.me}->state{at} = {self.state(index)};")
        lines = lines or [f"{self.me}->unused = 0;"]
        return [f"void {self.name}_start({self.name} *{self.me})", "{", *indented(lines), "}"]

    def step(self) -> list[str]:
        element, form = self.element, self.form
        body = [*map(self.constant, element.constants), *self.walker.lines(form.step)]
        body.append(f"return {form.force};")
        text = "\n".join(body)
        unused = [
            f"(void){name};"
            for name in (self.me, *(name for name, _ in element.inputs), form.dt)
            if not re.search(rf"(?<!\w){name}(?!\w)", text)
        ]
        return [self.signature(), "{", *indented([*unused, *body]), "}"]

    def sample(self) -> list[str]:
        (v0, v1), dt, before = self.ends, self.form.dt, self.element.free("before")
        reads = [name for name, _ in self.element.inputs[1:]]

        def step(v: str, passed: str, length: str) -> str:
            now = {"t": f"t + {passed}"} if passed else {}
            given = "".join(f", {now.get(name, name)}" for name in reads)
            return f"{self.name}_step({self.me}, {v}{given}, {length});"

        lines = [
            f"double {before} = 0.0;  /* until the velocity changes its sign */",
            f"if (({v0} < 0.0 && {v1} > 0.0) || ({v0} > 0.0 && {v1} < 0.0)) {{",
            f"    {before} = {dt} * ({v0} / ({v0} - {v1}));",
            f"    {step(f'0.5 * {v0}', '', before)}",
            f"    {step('0.0', before, '0.0')}",
            f"    {v0} = 0.0;",
            "}",
            step(f"0.5 * ({v0} + {v1})", before, f"{dt} - {before}"),
            f"return {step(v1, dt, '0.0')}",
        ]
        return [self.sample_signature(), "{", *indented(lines), "}"]

    def constant(self, constant: Constant) -> str:
        number, value = C99.number, constant.value
        if isinstance(value, tuple):
            numbers = ", ".join(map(number, value))
            text = f"{constant.name}[{len(value)}] = {{{numbers}}}"
        else:
            text = f"{constant.name} = {number(value)}"
        return f"static const double {text};{FORMS.note(constant.about)}"
