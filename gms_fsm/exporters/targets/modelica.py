"""Format ``modelica``: a model whose switches are events."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping

from gms_fsm.exporters._names import check_functions, identifier
from gms_fsm.exporters._readme import about_friction
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.element import NamedFriction
from gms_fsm.exporters.plain.parts import Constant, Leaving
from gms_fsm.exporters.plain.walker import indented
from gms_fsm.exporters.plain.whole import WholeSystem
from gms_fsm.formats import Format, register
from gms_fsm.foundation.text import visible
from gms_fsm.language import (
    MODELICA,
    Both,
    Condition,
    Either,
    Node,
    Number,
    Requirement,
    Split,
    Value,
    renamed,
    spell,
    split,
)

__all__ = ["WORDS", "modelica"]

# Keywords of the Modelica language 3.6 (2.3.3), its built-in types, functions and operators, and
# its standard library, which a model of that name would hide.
WORDS = frozenset(
    re.findall(
        r"\w+",
        """
        algorithm and annotation block break class connect connector constant constrainedby der
        discrete each else elseif elsewhen encapsulated end enumeration equation expandable extends
        external false final flow for function if import impure in initial inner input loop model
        not operator or outer output package parameter partial protected public pure record
        redeclare replaceable return stream then true type when while within
        Boolean Clock ExternalObject Integer Real StateSelect String time
        abs acos actualStream array asin assert atan atan2 backSample cardinality cat ceil change
        cos cosh cross delay diagonal div edge exp fill firstTick floor getInstanceName hold
        homotopy identity inStream integer interval linspace log log10 matrix max min mod ndims
        noClock noEvent ones outerProduct pre previous product reinit rem rooted sample scalar
        semiLinear shiftSample sign sin sinh size skew smooth spatialDistribution sqrt subSample sum
        superSample symmetric tan tanh terminal terminate transpose vector zeros Modelica
        """,
    )
)


FLANGES = {"Translational": ("s", "f"), "Rotational": ("phi", "tau")}


def modelica(subject: Subject) -> dict[str, str]:
    """Return a friction, or a whole system, as a Modelica model.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> text = modelica(Subject.of(model, "modelica", name="gms"))["gms.mo"]
    >>> "when pre(state) == 1 and z >= s and v > v_c then" in text
    True
    """
    name = subject.name
    if not subject.alone:
        whole = ModelOfSystem(subject)
        return {f"{name}.mo": whole.text(), f"README-{name}-modelica.md": whole.readme()}
    printer = ModelOfElements(subject)
    return {
        f"{name}.mo": printer.text(),
        f"{name}_flanges.mo": printer.flanges(),
        f"README-{name}-modelica.md": printer.readme(),
    }


class ModelOfElements:
    """Prints a friction as a model of its elements."""

    def __init__(self, subject: Subject) -> None:
        self.name = identifier(subject.name, WORDS, f"name {subject.name!r}")
        self.element = element = NamedFriction.of(subject, WORDS, time=False)
        element.check_name(self.name)
        # A class of its own: Rumoca 0.10 counts equations of arrays of nested classes twice.
        self.kind, self.one = f"{self.name}_element", element.free("element")
        self.part = element.free("F_i")
        self.starts = {e.name: element.free(f"{e.name}_start") for e in element.variables}
        used = [state.flow_names | state.guard_names for state in element.states]
        every = frozenset[str]().union(*used)
        self.own_lets = element.needed(every, per_element=True)
        self.shared_lets = element.needed(every | element.total.names, per_element=False)
        self.inside = every.union(*(each.value.names for each in self.own_lets))
        total = f"sum({self.one}.{self.part})" if element.n > 1 else f"{self.one}.{self.part}"
        self.texts = {"t": "time"}
        self.total = {"t": "time", "F": total}
        check_functions(element.trees, MODELICA, f"chart {subject.title!r}", "Modelica")

    def spell(self, node: Node) -> str:
        return spell(node, MODELICA, self.texts)

    # ------------------------------------------------------------------ the whole
    def text(self) -> str:
        element = self.element
        constants = [self.constant(each) for each in element.constants]
        lines = [*self.one_element(), "", f"model {self.name} {_string(element.title)}"]
        lines += _inside([f"input Real {name}{_comment(about)};" for name, about in element.inputs])
        lines += _inside([f'output Real F "{element.force}: friction force";', *constants])
        if element.position:
            start = MODELICA.number(element.position_start)
            declared = f"Real {element.position}(start = {start}, fixed = true)"
            lines += _inside([f'{declared} "{element.length}: position";'])
        size = f"[{element.n}]" if element.n > 1 else ""
        lines += _inside([f"{self.kind} {self.one}{size}({self.given()});"])
        lines += ["protected"] * bool(self.shared_lets)
        lines += _inside(f"Real {e.name}{_comment(e.about)};" for e in self.shared_lets)
        lines += ["equation", *_inside(self.equations())]
        return "\n".join([*lines, f"end {self.name};"]) + "\n"

    def flanges(self) -> str:
        """Return the friction between two flanges: translational, and rotational."""
        (velocity, _), *others = self.element.inputs
        lines = list[str]()
        for kind, (s, f) in FLANGES.items():
            own = f"{self.name}_{kind.lower()}"
            lines += [f"model {own} {_string(f'{self.element.title}, between two flanges')}"]
            ends = [f"Modelica.Mechanics.{kind}.Interfaces.Flange_{u} flange_{u};" for u in "ab"]
            ends += [f"input Real {name}{_comment(about)};" for name, about in others]
            lines += _inside([*ends, f"Real {s}_rel;", f"{self.name} friction;"])
            body = [
                f"{s}_rel = flange_b.{s} - flange_a.{s};",
                f"friction.{velocity} = der({s}_rel);",
                *(f"friction.{name} = {name};" for name, _ in others),
                f"flange_b.{f} = friction.F;",
                f"flange_a.{f} = -friction.F;",
            ]
            lines += ["equation", *_inside(body), f"end {own};", ""]
        return "\n".join(lines)

    def constant(self, constant: Constant) -> str:
        value, number = constant.value, MODELICA.number
        if isinstance(value, tuple):
            numbers = ", ".join(map(number, value))
            text = f"{constant.name}[{len(value)}] = {{{numbers}}}"
        else:
            text = f"{constant.name} = {number(value)}"
        return f"parameter Real {text}{_comment(constant.about)};"

    def passed(self) -> list[str]:
        """Return what elements are given as inputs: those of the friction, and what is shared."""
        names = [name for name, _ in self.element.inputs]
        names += [self.element.position] * bool(self.element.position)
        names += [each.name for each in self.shared_lets]
        return [name for name in names if name in self.inside]

    def given(self) -> str:
        """Return the numbers that elements are given."""
        several = self.element.n > 1
        found = [f"{'each ' * several}{name} = {name}" for name in self.passed()]
        for each in self.element.constants:
            if each.name in self.inside:
                word = "each " if several and not isinstance(each.value, tuple) else ""
                found.append(f"{word}{each.name} = {each.name}")
        number = MODELICA.number
        for variable in self.element.variables:
            numbers = list(map(number, variable.start))
            text = f"{{{', '.join(numbers)}}}" if several else numbers[0]
            found.append(f"{self.starts[variable.name]} = {text}")
        if len(self.element.states) > 1:
            states = [str(index + 1) for index in self.element.start]
            found.append(f"state_start = {'{' + ', '.join(states) + '}' if several else states[0]}")
        return ", ".join(found)

    def equations(self) -> list[str]:
        element = self.element
        lines = [f"{each.name} = {self.spell(each.value.tree)};" for each in self.shared_lets]
        if element.position:
            lines.append(f"der({element.position}) = {element.inputs[0][0]};")
        return [*lines, f"F = {spell(element.total.tree, MODELICA, self.total)};"]

    # ------------------------------------------------------------------ one element
    def one_element(self) -> list[str]:
        element = self.element
        lines = [f'model {self.kind} "One element of {self.name}"']
        inner = [f"input Real {name};" for name in self.passed()]
        inner.append(f'output Real {self.part} "{element.force}: force of the element";')
        inner += [
            f"parameter Real {each.name}{_comment(each.about)};"
            for each in element.constants
            if each.name in self.inside
        ]
        for variable in element.variables:
            start = self.starts[variable.name]
            inner.append(f"parameter Real {start} = 0.0;")
            declared = f"Real {variable.name}(start = {start}, fixed = true)"
            inner.append(f"{declared}{_comment(variable.about)};")
        if len(element.states) > 1:
            names = ", ".join(f"{k} {each.name}" for k, each in enumerate(element.states, 1))
            inner.append("parameter Integer state_start = 1;")
            inner.append(f'Integer state(start = state_start, fixed = true) "{names}";')
        rates = [each for each in element.variables if self.reads(each.rate)]
        protected = [f"Real {each.name}{_comment(each.about)};" for each in self.own_lets]
        protected += [f"Real {each.rate};" for each in rates]
        lines += _inside(inner)
        lines += ["protected", *_inside(protected)] if protected else []
        body = [f"{each.name} = {self.spell(each.value.tree)};" for each in self.own_lets]
        for each in element.variables:
            flow = self.by_state([state.rates[each.name].tree for state in element.states])
            if each in rates:
                body += [f"{each.rate} = {flow};", f"der({each.name}) = {each.rate};"]
            else:
                body.append(f"der({each.name}) = {flow};")
        force = self.by_state([state.force.tree for state in element.states])
        body += [f"{self.part} = {force};", *self.switches()]
        return [*lines, "equation", *_inside(body), f"end {self.kind};"]

    def reads(self, rate: str) -> bool:
        return any(rate in state.force.names for state in self.element.states)

    def by_state(self, trees: list[Value]) -> str:
        """Spell a value that depends on the state."""
        if len(dict.fromkeys(trees)) == 1:
            return self.spell(trees[0])
        text = ""
        for number, tree in enumerate(trees[:-1], 1):
            text += f"{'else' * bool(text)}if state == {number} then {self.spell(tree)} "
        return f"{text}else {self.spell(trees[-1])}"

    def switches(self) -> list[str]:
        """Spell the edges: the first one whose guard becomes true."""
        lines, word, several = list[str](), "when", len(self.element.states) > 1
        for number, state in enumerate(self.element.states, 1):
            for edge in state.edges:
                source = f"pre(state) == {number} and " if several else ""
                lines.append(f"{word} {source}{self.guard(edge.guard)} then  // {edge.name}")
                lines += _inside([f"state = {edge.target + 1};"] * several + self.resets(edge))
                word = "elsewhen"
        return [*lines, "end when;"] if lines else []

    def guard(self, condition: Condition) -> str:
        """Spell a guard by comparisons without abs: a narrow window is then not stepped over."""
        text = self.spell(_joined(split(condition)))
        return f"({text})" if " or " in text else text

    def resets(self, edge: Leaving) -> list[str]:
        """Spell assignments, all over the values before the edge."""
        now: dict[str, Value] = {}
        for name, tree in edge.steps:
            now[name] = renamed(tree, now)
        before = {each.name: f"pre({each.name})" for each in self.element.variables}
        texts: Mapping[str, str] = self.texts | before
        return [f"reinit({name}, {spell(tree, MODELICA, texts)});" for name, tree in now.items()]

    # ------------------------------------------------------------------ for people
    def readme(self) -> str:
        name = self.name
        wires = "".join(f" friction.{each} = ...;" for each, _ in self.element.inputs[1:])
        return f"""\
# {visible(self.element.title)} as a Modelica model

- {name}.mo: the model `{name}`, and `{self.kind}`, of which it is made; no library is needed
- {name}_flanges.mo: the same between two flanges of the Modelica Standard Library,
  `{name}_translational` and `{name}_rotational`

## How to run it

Load {name}.mo into a Modelica tool, and use the model in another one:

    model Test
      {name} friction;
    equation
      friction.v = 0.1 * sin(time);{wires}
    end Test;

It has been simulated by Rumoca (`pip install rumoca`), in Python:

    import rumoca
    model = rumoca.Session().loads(text_of_both_models, model="Test")
    config = rumoca.SimConfig(rtol=1e-9, atol=1e-14)
    result = model.simulate((0.0, 10.0), dt=0.01, config=config)
    result["friction.F"]

Deflections are small: in every tool, choose an absolute tolerance far below them. pymoca has parsed
the text; no other tool has run it.

## What it computes

{about_friction(self.element)}
Guards are conditions of when-clauses, so the tool locates the switches; corners and jumps of the
flow are if-expressions, which it locates too.

## What it does not do

A when-clause sees its condition become true. A guard that is true at the very beginning is taken
only after it has been false.
"""


class ModelOfSystem:
    """Prints a system as one model, around those of the frictions of its contacts."""

    def __init__(self, subject: Subject) -> None:
        self.name = identifier(subject.name, WORDS, f"name {subject.name!r}")
        self.whole = whole = WholeSystem.of(subject, WORDS)
        self.frictions = {each.name: ModelOfElements(each.friction) for each in whole.contacts}
        self.texts = {"t": "time"} | {each.force: f"{each.name}.F" for each in whole.contacts}
        trees: list[Node] = [tree for row in whole.rates.values() for tree in row]
        trees += [tree for _, tree in whole.definitions]
        trees += [tree for rows in whole.updates.values() for tree in rows.values()]
        check_functions(trees, MODELICA, f"system {subject.title!r}", "Modelica")

    def spell(self, node: Node) -> str:
        return spell(node, MODELICA, self.texts)

    def text(self) -> str:
        whole, number = self.whole, MODELICA.number
        models = [each.text() for each in self.frictions.values()]
        lines = [f"model {self.name} {_string(whole.subject.title)}"]
        lines += _inside(f"input Real {name};" for name in whole.inputs)
        lines += _inside(f"parameter Real {k} = {number(v)};" for k, v in whole.numbers.items())
        for name, value in whole.start.items():
            kind = "" if name in whole.rates else "discrete "
            lines += _inside([f"{kind}Real {name}(start = {number(value)}, fixed = true);"])
        lines += _inside(f"Real {name};" for name, _ in whole.definitions)
        lines += _inside(f"{each.name} {contact};" for contact, each in self.frictions.items())
        lines += ["equation", *_inside(self.equations()), f"end {self.name};", ""]
        return "\n".join([*models, *lines])

    def equations(self) -> Iterator[str]:
        whole = self.whole
        for name, tree in whole.definitions:
            yield f"{name} = {self.spell(tree)};"
        for name, (mass, rate) in whole.rates.items():
            times = "" if mass == Number(1.0) else f"({self.spell(mass)}) * "
            yield f"{times}der({name}) = {self.spell(rate)};"
        for each in whole.contacts:
            for name, tree in each.inputs:
                yield f"{each.name}.{name} = {self.spell(tree)};"
        for sampler in whole.samplers:
            first = whole.subject.t_start + sampler.offset
            yield f"when sample({first!r}, {sampler.period!r}) then  // {sampler.name}"
            texts, updates = {**self.texts, "period": repr(sampler.period)}, sampler.updates
            texts |= {name: f"pre({name})" for name in updates}
            for name, tree in whole.updates[sampler.name].items():  # they see those before them
                yield f"  {name} = {spell(tree, MODELICA, texts)};"
                texts[name] = name
            yield "end when;"

    def readme(self) -> str:
        name = self.name
        models = "".join(
            f"- `{each.name}` in it: the friction of the contact `{contact}`\n"
            for contact, each in self.frictions.items()
        )
        inputs = ", ".join(f"`{each}`" for each in self.whole.inputs)
        return f"""\
# {visible(self.whole.subject.title)} as a Modelica model

- {name}.mo: the model `{name}` of the whole system; no library is needed
{models}
{f"Inputs: {inputs}." if inputs else "It has no inputs."} Bodies, springs and numbers are its
equations and parameters; samplers are when-clauses.

## How to run it

Load {name}.mo into a Modelica tool and simulate `{name}`. Rumoca has run such models:

    import rumoca
    model = rumoca.Session().loads(open("{name}.mo").read(), model="{name}")
    config = rumoca.SimConfig(rtol=1e-9, atol=1e-14)
    result = model.simulate((0.0, 1.0), dt=0.001, config=config)

Deflections are small: in every tool, choose an absolute tolerance far below them.

## What it does not do

A when-clause sees its condition become true. A guard that is true at the very beginning is taken
only after it has been false.
"""


def _joined(part: Split) -> Condition:
    """Return a split condition as a condition again."""
    if isinstance(part, Requirement):
        return part.relation
    word, parts = part
    operands = tuple(map(_joined, parts))
    return Both(operands) if word == "both" else Either(operands)


def _string(text: str) -> str:
    clean = visible(text).replace("\\", "/").replace('"', "'")
    return f'"{clean}"'


def _inside(lines: Iterable[str]) -> list[str]:
    return indented(lines, "  ")


def _comment(text: str) -> str:
    return f" {_string(text)}" if text else ""


register(
    Format(
        "modelica",
        "friction",
        "a Modelica model with events",
        "gms-fsm",
        modelica,
        words=WORDS,
        takes=("initial", "t_start"),
        whole=True,
    )
)
