"""Format ``st``: the plain form as IEC 61131-3 structured text, a function block for a PLC."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from gms_fsm.errors import ParameterError
from gms_fsm.exporters._names import check_functions, identifier
from gms_fsm.exporters._readme import about_friction
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.c import limits_of
from gms_fsm.exporters.plain.element import NamedFriction
from gms_fsm.exporters.plain.form import PlainForm, declared, plain_form
from gms_fsm.exporters.plain.parts import Constant
from gms_fsm.exporters.plain.walker import Forms, Walker, indented
from gms_fsm.formats import Format, register
from gms_fsm.foundation.text import visible
from gms_fsm.language import STRUCTURED_TEXT

__all__ = ["WORDS", "structured_text"]

# Keywords and elementary types of IEC 61131-3 (third edition), standard functions and function
# blocks. The letters of instruction lists and of action qualifiers (S, R, N ...) are names in
# structured text.
WORDS = frozenset(
    re.findall(
        r"\w+",
        """
    ABS ABSTRACT ACOS ACTION ADD AND ANY ANY_BIT ANY_DATE ANY_DERIVED ANY_ELEMENTARY ANY_INT
    ANY_MAGNITUDE ANY_NUM ANY_REAL ANY_STRING ARRAY ASIN AT ATAN ATAN2 BOOL BY BYTE CASE CHAR CLASS
    CONCAT CONFIGURATION CONSTANT CONTINUE COS CTD CTU CTUD DATE DATE_AND_TIME DELETE DINT DIV DO DT
    DWORD ELSE ELSIF END_ACTION END_CASE END_CLASS END_CONFIGURATION END_FOR END_FUNCTION
    END_FUNCTION_BLOCK END_IF END_INTERFACE END_METHOD END_NAMESPACE END_PROGRAM END_PROPERTY
    END_REPEAT END_RESOURCE END_STEP END_STRUCT END_TRANSITION END_TYPE END_UNION END_VAR END_WHILE
    EN ENO EQ EXIT EXP EXPT EXTENDS FALSE FINAL FIND FOR FROM FUNCTION FUNCTION_BLOCK F_EDGE F_TRIG
    GE GOTO GT IF IMPLEMENTS INITIAL_STEP INSERT INT INTERFACE INTERNAL INTERVAL LDATE
    LDATE_AND_TIME LDT LE LEFT LEN LIMIT LINT LN LOG LREAL LT LTIME LTIME_OF_DAY LTOD LWORD MAX
    METHOD MID MIN MOD MOVE MUL MUX NAMESPACE NE NON_RETAIN NOT NULL OF ON OR OVERLAP OVERRIDE
    POINTER PRIORITY PRIVATE PROGRAM PROPERTY PROTECTED PUBLIC READ_ONLY READ_WRITE REAL REF
    REFERENCE REF_TO REPEAT REPLACE RESOURCE RETAIN RETURN RIGHT ROL ROR RS R_EDGE R_TRIG SEL SHL
    SHR SIN SINGLE SINT SQRT SR STEP STRING STRUCT SUB SUPER TAN TASK THEN THIS TIME TIME_OF_DAY TO
    TOD TOF TON TP TRANSITION TRUE TRUNC TYPE UDINT UINT ULINT UNION UNTIL USING USINT VAR
    VAR_ACCESS VAR_CONFIG VAR_EXTERNAL VAR_GLOBAL VAR_INPUT VAR_IN_OUT VAR_OUTPUT VAR_TEMP WCHAR
    WHILE WITH WORD WSTRING XOR
    """,
    )
)
FUNCTION = """\
FUNCTION {name} : LREAL
VAR_INPUT
    u : LREAL;
END_VAR
{body}
END_FUNCTION

"""
# Functions that the standard does not have; {0} is the name, {1} that of the block.
# From 2**52 on there is nothing behind the point; below, the sum rounds to the even one of two.
DEFINED = {
    "sgn": """\
IF u > 0.0 THEN
    {0} := 1.0;
ELSIF u < 0.0 THEN
    {0} := -1.0;
ELSE
    {0} := 0.0;
END_IF;""",
    "floor": """\
{0} := {1}_round(u);
IF {1}_round(u) > u THEN
    {0} := {1}_round(u) - 1.0;
END_IF;""",
    "round": """\
{0} := u;
IF u >= 0.0 AND u < 4503599627370496.0 THEN
    {0} := (u + 4503599627370496.0) - 4503599627370496.0;
ELSIF u < 0.0 AND u > -4503599627370496.0 THEN
    {0} := 4503599627370496.0 - (4503599627370496.0 - u);
END_IF;""",
}
FORMS = Forms(
    assign="{0} := {1};",
    new="{0} := {1};",
    load="{0} := {1};",
    declare="",
    first="IF {0} THEN",
    then="ELSIF {0} THEN",
    other="ELSE",
    end="END_IF;",
    loop="FOR {0} := 1 TO {1} DO",
    end_loop="END_FOR;",
    comment="(* {0} *)",
    marks={"*)": "* )", "(*": "( *"},
    nothing=";",
)


class _Keywords(frozenset[str]):
    """Words that are the same in capitals and in small letters."""

    def __contains__(self, word: object) -> bool:
        return isinstance(word, str) and super().__contains__(word.upper())


def structured_text(subject: Subject) -> dict[str, str]:
    """Return the plain form of a friction as a function block.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> text = structured_text(Subject.of(model, "st", name="gms"))["gms.st"]
    >>> "ELSIF z_i <= -s AND v < -v_c THEN" in text
    True
    """
    printer = StructuredText(subject)
    return {f"{subject.name}.st": printer.text(), f"README-{subject.name}-st.md": printer.readme()}


class StructuredText:
    """Prints the plain form of a friction."""

    def __init__(self, subject: Subject) -> None:
        name = subject.name
        identifier(name.upper(), WORDS, f"name {name!r}")
        self.name, element = name, NamedFriction.of(subject, WORDS, cases=False)
        own = [f"{name}_{each}" for each in (*DEFINED, "sample")]
        for each in (name, *own):
            element.check_name(each, cases=False)
        element = element.reserved(name, *own)
        self.form: PlainForm = plain_form(element, "cycle")
        self.element = element.reserved(self.form.dt, self.form.part)
        self.force = self.take("force")  # F would be the same as a chart's f
        defined = {each: f"{name}_{each}({{0}})" for each in DEFINED}
        functions = {**STRUCTURED_TEXT.functions, **defined}
        self.dialect = replace(STRUCTURED_TEXT, functions=functions)
        place = f"chart {subject.title!r}"
        check_functions(element.trees, self.dialect, place, "structured text")
        # One element needs no arrays and no loop.
        self.i = self.take("i") if element.n > 1 else ""
        at = f"[{self.i}]" if self.i else ""
        self.now = {each.name: self.take(f"{each.name}_i") for each in element.variables if at}
        self.state = self.take("state")
        paths = [each.name.replace("__", "_").upper() for each in element.states]
        self.states = [self.take(f"STATE_{path}") for path in paths]
        self.walker = Walker(
            FORMS,
            self.dialect,
            {
                **{c.name: f"{c.name}{at}" for c in element.constants if c.several},
                **self.now,
                self.form.force: self.force,
            },
            [each.name for each in element.states],
            test=lambda k: f"{self.state}{at} = {self.states[k]}",
            enter=lambda k: f"{self.state}{at} := {self.states[k]};",
            count=element.n,
            index=self.i,
            memory={name: f"{name}{at}" for name in self.now},
        )
        names = [*element.names, *self.states, *(each for each, _ in element.inputs), name]
        for each in names:
            if "__" in each or each.endswith("_"):
                raise ParameterError(
                    "structured text has no names with two underscores in a row or one at the end",
                    place=f"chart {subject.title!r}, name {each!r}",
                    advice="give it another name",
                )

    def take(self, name: str) -> str:
        """Return a name that nothing else has, and is not given again."""
        new = self.element.free(name)
        self.element = self.element.reserved(new)
        return new

    # ------------------------------------------------------------------ the text
    def text(self) -> str:
        element, name = self.element, self.name
        body, told = self.walker.lines(self.form.step), f"{element.force}: friction force"
        inputs = [*element.inputs, (self.form.dt, "s: since the last call")]
        lines = [
            f"(* {FORMS.clean(element.title)}: the plain form, to be called once a cycle. *)",
            f"FUNCTION_BLOCK {name}",
            *_block("VAR_INPUT", (f"{each} : LREAL;{FORMS.note(about)}" for each, about in inputs)),
            *_block("VAR_OUTPUT", [f"{self.force} : LREAL;  (* {told} *)"]),
            *_block("VAR CONSTANT", self.constants()),
            *_block("VAR", self.memory()),
            *_block("VAR", self.locals()),
            *body,
            "END_FUNCTION_BLOCK",
            "",
            *self.sample(),
        ]
        text = "\n".join(lines) + "\n"
        for each, defined in DEFINED.items():  # later ones call earlier ones
            if f"{name}_{each}(" in text:
                own = f"{name}_{each}"
                text = FUNCTION.format(name=own, body=defined.format(own, name)) + text
        return text

    def sample(self) -> Iterator[str]:
        """Return the block of a sample in which the velocity goes on a straight line."""
        element, cycle = self.element, self.form.dt
        v0, v1, step, before, begin = map(element.free, ("v0", "v1", "friction", "before", "begin"))
        (v, _), *others = element.inputs
        unit = f"{element.length}/s: velocity"
        velocities = [(v0, f"{unit} at the last call"), (v1, f"{unit} now")]
        inputs = [*velocities, *others, (cycle, "s: since the last call")]

        def call(velocity: str, passed: str, length: str) -> str:
            now = {"t": f"t + {passed}"} if passed else {}
            given = "".join(f", {each} := {now.get(each, each)}" for each, _ in others)
            return f"{step}({v} := {velocity}{given}, {cycle} := {length});"

        yield "(* One sample, in which the velocity goes from v0 to v1 on a straight line: the"
        yield "   force at its end. A change of direction is found, in at most four steps. Limits:"
        *first, last = map(FORMS.clean, limits_of(element))
        yield from (f"   - {each};" for each in first)
        yield f"   - {last}. *)"
        yield f"FUNCTION_BLOCK {self.name}_sample"
        yield from _block(
            "VAR_INPUT", (f"{each} : LREAL;{FORMS.note(about)}" for each, about in inputs)
        )
        force = f"{self.force} : LREAL;  (* {element.force}: friction force *)"
        yield from _block("VAR_OUTPUT", [force])
        locals_ = [f"{step} : {self.name};", f"{before} : LREAL;", f"{begin} : LREAL;"]
        yield from _block("VAR", locals_)
        yield f"{before} := 0.0;"
        yield f"{begin} := {v0};"
        yield f"IF ({v0} < 0.0 AND {v1} > 0.0) OR ({v0} > 0.0 AND {v1} < 0.0) THEN"
        yield f"    {before} := {cycle} * ({v0} / ({v0} - {v1}));"
        yield f"    {call(f'0.5 * {v0}', '', before)}"
        yield f"    {call('0.0', before, '0.0')}"
        yield f"    {begin} := 0.0;"
        yield "END_IF;"
        yield call(f"0.5 * ({begin} + {v1})", before, f"{cycle} - {before}")
        yield call(v1, cycle, "0.0")
        yield f"{self.force} := {step}.{self.force};"
        yield "END_FUNCTION_BLOCK"

    def constants(self) -> Iterator[str]:
        yield from map(self.constant, self.element.constants)
        if len(self.element.states) > 1:
            for index, name in enumerate(self.states):
                yield f"{name} : INT := {index};"

    def constant(self, constant: Constant) -> str:
        value = constant.value
        if isinstance(value, tuple):
            return f"{constant.name} : {self.array('LREAL', value)};{FORMS.note(constant.about)}"
        number = self.dialect.number(value)
        return f"{constant.name} : LREAL := {number};{FORMS.note(constant.about)}"

    def array(self, kind: str, values: Sequence[float | int]) -> str:
        number = self.dialect.number
        texts = [number(each) if isinstance(each, float) else str(each) for each in values]
        if len(values) == 1:
            return f"{kind} := {texts[0]}"
        return f"ARRAY [1..{len(values)}] OF {kind} := [{', '.join(texts)}]"

    def memory(self) -> Iterator[str]:
        """Declare what is kept from call to call."""
        element = self.element
        for each in element.variables:
            yield f"{each.name} : {self.array('LREAL', each.start)};{FORMS.note(each.about)}"
        if element.position:
            start = self.dialect.number(element.position_start)
            yield f"{element.position} : LREAL := {start};  (* m: position *)"
        if len(element.states) > 1:
            yield f"{self.state} : {self.array('INT', element.start)};"

    def locals(self) -> Iterator[str]:
        """Declare what is computed in every call."""
        if self.i:
            yield f"{self.i} : INT;"
        names = [each for each in declared(self.form.step) if each != self.form.force]
        for name in (*self.now.values(), *names):
            yield f"{name} : LREAL;"

    # ------------------------------------------------------------------ for people
    def readme(self) -> str:
        name, element = self.name, self.element
        inputs = "".join(f", {each} := ..." for each, _ in element.inputs[1:])
        text = self.text()
        own = [f"{name}_{each}" for each in DEFINED if f"{name}_{each}(" in text]
        functions = f", and the function{'s' * (len(own) > 1)} {', '.join(own)}" if own else ""
        return f"""\
# {visible(element.title)} as structured text (IEC 61131-3)

- {name}.st: the function blocks {name} and {name}_sample{functions}

## How to run it

Import {name}.st into the project of a PLC, declare an instance, and call it once in every cycle of
a task with a fixed interval:

    VAR friction : {name}_sample; END_VAR
    friction(v0 := before, v1 := velocity{inputs}, {self.form.dt} := 0.001);
    force := friction.{self.force};
    before := velocity;

The compiler matiec 0.1 (`iec2c`) has translated it, and the result has run; blark has parsed it.
No PLC has run it.

## What it computes

{about_friction(element)}
During a call of {name}_sample the velocity goes from v0 to v1 on a straight line; the force is that
at its end. It takes at most four steps, so its time is bounded; where the velocity changes its sign
a step ends, and the guards are looked at there. A step, the function block {name}, looks at every
guard once, gives the force, and takes one explicit Euler step of length {self.form.dt} [s] with its
velocity. The steps have the numbers of
simulate(model, Prescribed(record), t_end, method="euler", step=..., events="step").

## What it does not do

Other switches are seen at the next step, not where they happen, so the result is of first order in
the cycle time. {name} by itself does not notice that the velocity has passed through a guard.
AND and OR may evaluate both sides.
"""


def _block(head: str, lines: Iterable[str]) -> list[str]:
    inner = indented(lines)
    return [head, *inner, "END_VAR"] if inner else []


register(
    Format(
        "st",
        "friction",
        "IEC 61131-3 structured text for a PLC, the plain form",
        "gms-fsm",
        structured_text,
        words=_Keywords(WORDS),
        takes=("initial", "t_start"),
    )
)
