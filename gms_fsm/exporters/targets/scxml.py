"""The format ``scxml``: a W3C SCXML document for one element of a chart.

States, transitions in the order of their priority, conditions and assignments are SCXML; flows,
forces and units are kept beside them in a namespace of their own. The host integrates the flows: it
sends the event ``values`` with what comes from outside, then ``step``, at which one transition is
taken. Transitions without an event would be taken at once, on values of the last step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from xml.etree import ElementTree as ET

from gms_fsm._version import __version__
from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.charts.files.scxml import (
    OURS,
    SCXML,
    STEP,
    VALUES,
    assignments,
    conditions,
    written_out,
)
from gms_fsm.charts.nesting import spelled
from gms_fsm.errors import ParameterError
from gms_fsm.exporters._names import check_functions, identifier
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.alone import (
    check_moved_from_outside,
    element_numbers,
    fields_of,
)
from gms_fsm.formats import Format, register
from gms_fsm.foundation.text import referenced, visible
from gms_fsm.language import ECMASCRIPT, names_in
from gms_fsm.systems.system import LEAST_LOAD, Contact, loaded

__all__: list[str] = []

ECMASCRIPT_WORDS = """
await break case catch class const continue debugger default delete do else enum export extends
false finally for function if implements import in instanceof interface let new null package private
protected public return static super switch this throw true try typeof undefined var void while with
yield Infinity NaN Math In
"""
WORDS = frozenset(ECMASCRIPT_WORDS.split())
# What the package python-statemachine keeps for itself: there a condition cannot read these.
KEPT = ("event_data", "machine", "event", "model", "transition", "state", "source", "target")
Pairs = Mapping[str, str]


def _write(subject: Subject) -> dict[str, str]:
    chart, name = subject.chart, subject.name
    check_moved_from_outside(chart, (), "SCXML")
    for each in _names(chart):
        identifier(each, WORDS, f"chart {chart.name!r}, name {each!r}")
    _check_characters(chart)
    assigned = [tree for each in chart.assignments.values() for tree in each.values()]
    read = {name for tree in (*assigned, *chart.guards.values()) for name in names_in(tree)}
    lets = [tree for name, tree in written_out(chart.lets).items() if name in read]
    trees = (*chart.guards.values(), *assigned, *lets)
    check_functions(trees, ECMASCRIPT, f"chart {chart.name!r}", "ECMAScript")
    contact = subject.numbers
    numbers = [{}] if contact is None else element_numbers(contact)
    files = {
        f"{name}_{i}.scxml" if len(numbers) > 1 else f"{name}.scxml": _document(name, chart, row)
        for i, row in enumerate(numbers, start=1)
    }
    return {**files, f"README-{name}-scxml.md": _readme([*files], chart, contact)}


def _names(chart: Chart) -> list[str]:
    """Return the names that conditions can read."""
    names = [*_outside(chart), *chart.parameter_names]
    return [*dict.fromkeys(names), *map(spelled, chart.nesting.levels)]


def _check_characters(chart: Chart) -> None:
    """Refuse what no XML document can contain."""
    told = [("name", chart.name), ("reference", chart.reference)]
    told += [(f"parameter {each.name!r}", each.meaning) for each in chart.parameters]
    for place, text in told:
        wrong = [c for c in text if (c < " " and c not in "\t\n\r") or "\ud800" <= c <= "\udfff"]
        if wrong or "\ufffe" in text or "\uffff" in text:
            raise ParameterError(
                f"it has the character {(wrong or ['U+FFFE or U+FFFF'])[0]!r}, which no XML "
                "document can contain",
                place=f"chart {chart.name!r}: {place}",
                advice="leave it out",
            )


# --------------------------------------------------------------------------- the document
def _document(name: str, chart: Chart, numbers: Mapping[str, float]) -> str:
    root = ET.Element(
        "scxml",
        {
            "xmlns": SCXML,
            "xmlns:gms": OURS,
            "version": "1.0",
            "name": name,
            "datamodel": "ecmascript",
            "initial": spelled(chart.nesting.states[0].name),
        },
    )
    _own_parts(root, chart)
    _data(root, chart, numbers)
    write = _States(chart)
    for state in chart.nesting.states:
        write.state(root, state.name)
    ET.indent(root, "  ")
    head = f'<?xml version="1.0" encoding="UTF-8"?>\n<!-- Written by gms-fsm {__version__}. -->\n'
    return head + referenced(ET.tostring(root, encoding="unicode")) + "\n"


def _outside(chart: Chart) -> dict[str, str]:
    """Return what the host gives at every step: names, each with its kind."""
    kinds = dict.fromkeys(chart.inputs, "input") | dict.fromkeys(chart.velocities, "velocity")
    kinds |= dict.fromkeys(chart.variables, "variable")
    return {name: kind for name, kind in kinds.items() if name not in chart.nesting.histories}


def _own_parts(root: ET.Element, chart: Chart) -> None:
    """Write what SCXML has no word for."""
    own = ET.SubElement(root, "gms:chart", {"name": chart.name, "reference": chart.reference})
    for kind, names in (
        ("input", chart.inputs),
        ("velocity", chart.velocities),
        ("variable", [each for each in chart.variables if each not in chart.hidden]),
    ):
        for name in names:
            unit = chart.unit(name)
            more = {"unit": unit} if unit else {}
            ET.SubElement(own, "gms:quantity", {"kind": kind, "name": name, **more})
    for each in (chart.declared[name] for name in chart.parameter_names):
        told = fields_of(each).items()
        fields = {key: "false" if value is False else str(value) for key, value in told}
        ET.SubElement(own, "gms:parameter", {"name": each.name, **fields})
    for tag, texts in (
        ("let", chart.let),
        ("force", chart.outputs),
        ("total", chart.contact_outputs),
    ):
        for name, text in texts.items():
            ET.SubElement(own, f"gms:{tag}", {"name": name, "text": text})


def _data(root: ET.Element, chart: Chart, numbers: Mapping[str, float]) -> None:
    model = ET.SubElement(root, "datamodel")
    for name in chart.parameter_names:
        value = {"expr": repr(numbers[name])} if name in numbers else {}
        ET.SubElement(model, "data", {"id": name, **value})
    for name in _outside(chart):
        ET.SubElement(model, "data", {"id": name, "expr": repr(chart.initial.get(name, 0.0))})


@dataclass(frozen=True)
class _States:
    """Writes the states of a chart."""

    chart: Chart

    @cached_property
    def texts(self) -> Mapping[str, str]:
        """The guards as conditions, by edge."""
        return conditions(self.chart)

    @cached_property
    def leaving(self) -> Mapping[str, list[tuple[int, Transition]]]:
        """The edges by the state that they are written to leave, with their places in order."""
        edges = self.chart.nesting.transitions
        found: dict[str, list[tuple[int, Transition]]] = {}
        rows = ((source, edge) for edge in edges for source in edge.sources)
        for order, (source, edge) in enumerate(rows):
            found.setdefault(source, []).append((order, edge))
        return found

    def state(self, root: ET.Element, path: str) -> None:
        """Write a state, with the states inside."""
        chart, level = self.chart, self.chart.nesting.levels[path]
        given, inside = level.state, level.inside()
        own = ET.SubElement(root, "state", {"id": spelled(path)})
        if level.chain[1:]:
            own.set("gms:name", given.name)
        if inside:
            own.set("initial", level.last if given.history else spelled(inside[0]))
        for tag, texts in (("flow", given.flow), ("force", given.outputs)):
            for each, text in texts.items():
                ET.SubElement(own, f"gms:{tag}", {"name": each, "text": text})
        for tag, kind, texts in (("onentry", "entry", given.entry), ("onexit", "exit", given.exit)):
            if expressions := assignments(chart, kind, path):
                self.assign(ET.SubElement(own, tag), expressions, texts)
        if given.history:
            history = ET.SubElement(own, "history", {"id": level.last, "type": "shallow"})
            ET.SubElement(history, "transition", {"target": spelled(inside[0])})
        for state in given.states:
            self.state(own, f"{path}.{state.name}")
        if not level.chain[1:]:
            values = ET.SubElement(own, "transition", {"event": VALUES})
            for name in _outside(chart):
                ET.SubElement(values, "assign", {"location": name, "expr": f"_event.data.{name}"})
        for order, edge in self.leaving.get(path, ()):
            row = {"event": STEP, "cond": self.texts[edge.name], "target": spelled(edge.target)}
            row |= {"gms:name": edge.name, "gms:order": str(order), "gms:guard": edge.guard}
            at = ET.SubElement(own, "transition", row)
            self.assign(at, assignments(chart, "action", edge.name), edge.actions)

    def assign(self, parent: ET.Element, expressions: Pairs, texts: Pairs) -> None:
        """Write assignments; one without a text of the chart is the reset of a timer."""
        for name, expression in expressions.items():
            kept = {"gms:text": texts[name]} if name in texts else {}
            ET.SubElement(parent, "assign", {"location": name, "expr": expression, **kept})


# --------------------------------------------------------------------------- for people
def _readme(files: list[str], chart: Chart, contact: Contact | None) -> str:
    outside = _outside(chart)
    values = ", ".join(f"{name}=0.0" for name in outside)
    numbers = (
        "The chart has no numbers: set every <data> without expr before the first step."
        if contact is None
        else f"Numbers: those of {visible(contact.title)}, one document for each element."
    )
    curve = ""
    if contact is not None and contact.stribeck is not None:
        given = ", ".join(f"{name} = {value!r}" for name, value in contact.stribeck.numbers.items())
        load = f" * max({contact.load}, {LEAST_LOAD!r})" if loaded(contact) else ""
        curve = (
            f"\nThe host computes s = weight * ({contact.stribeck.text}){load} with {given}, "
            f"weights {[float(each) for each in contact.weights]!r}."
        )
    kept = [name for name in _names(chart) if name in KEPT]
    warning = (
        f"\n- python-statemachine keeps the names {', '.join(kept)} for itself." if kept else ""
    )
    return f"""\
# {visible(chart.name)} as SCXML

Written by gms-fsm {__version__}, format scxml.

Files: {", ".join(files)} (W3C SCXML 1.0, data model ecmascript).
{numbers}{curve}

How it is stepped. The host sends the event "values" with {", ".join(outside)}, then the event
"step": the first transition whose condition holds is taken, one for each event. It then reads the
state and the variables ({", ".join(chart.variables) or "none"}), integrates the flows, and repeats.

Run in Python

    pip install python-statemachine

    import math
    from pathlib import Path
    from types import SimpleNamespace

    from statemachine.io import load

    Math = SimpleNamespace(
        abs=abs, min=min, max=max, exp=math.exp, log=math.log, sqrt=math.sqrt, sin=math.sin,
        cos=math.cos, tanh=math.tanh, atan=math.atan, asinh=math.asinh, pow=math.pow,
        floor=math.floor, sign=lambda u: float((u > 0) - (u < 0)),
    )
    machine = load(Path("{files[0]}"), trusted=True)(SimpleNamespace(Math=Math))
    machine.send("values", {values})
    machine.send("step")
    print([state.id for state in machine.configuration], vars(machine.model))

What it does not express
- Flows, forces, units and rules are texts in the namespace {OURS}: other tools keep or
  ignore them. `gms_fsm.Chart.from_scxml("{files[0]}")` reads the whole chart from it.
- Several transitions in a row at one time need several events "step".
- A choice, if(c, a, b), is written as a sum: both a and b must be finite.
- Locked contacts, impulses, forces and accelerations in guards cannot be written.{warning}
"""


register(
    Format("scxml", "friction", "W3C SCXML document of an element", "gms-fsm", _write, words=WORDS)
)
