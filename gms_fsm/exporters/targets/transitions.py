"""The format ``transitions``: a Python file of its own, for the package of that name.

The file has the chart as data at its top, from which `Chart.from_transitions` builds an equal
chart; then a class of elements whose methods are the guards, flows and forces; then a loop of fixed
steps. All of it is printed from the checked trees of the chart.
"""

from __future__ import annotations

import keyword
import math
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from pprint import pformat
from typing import Any

from gms_fsm._version import __version__
from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.nesting import spelled
from gms_fsm.charts.parameters import Parameter
from gms_fsm.coupling.steppable import other_inputs
from gms_fsm.errors import ParameterError
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.alone import (
    check_moved_from_outside,
    element_numbers,
    fields_of,
    slow_velocity,
)
from gms_fsm.formats import Format, register
from gms_fsm.foundation.text import visible
from gms_fsm.language import ELEMENTARY, NAMESPACE, Condition, Node, Value, parse_value, sgn, spell
from gms_fsm.language.normal import renamed
from gms_fsm.lowering.generated import bare, elementary_text
from gms_fsm.systems.system import LEAST_LOAD, LOAD, Contact, loaded

__all__: list[str] = []

TITLE = "a transitions file"
# A module of this name would hide one that the file imports, or could not be imported.
WORDS = frozenset({*keyword.kwlist, *sys.stdlib_module_names, "transitions"})


def _write(subject: Subject) -> dict[str, str]:
    chart, name = subject.chart, subject.name
    check_moved_from_outside(chart, chart.force_names, TITLE)
    if len(chart.velocities) > 1:
        raise ParameterError(
            f"it has the velocities {', '.join(chart.velocities)}, and the loop of {TITLE} has one",
            place=f"chart {chart.name!r}",
            advice="export it as scxml",
        )
    contact = subject.numbers
    source = "\n".join(_program(chart, contact))
    return {
        f"{name}.py": _head(chart) + _imports(source) + source,
        f"README-{name}-transitions.md": _readme(name, chart, contact),
    }


def _head(chart: Chart) -> str:
    return (
        f"# {visible(chart.name)}: elements as models of one transitions.Machine.\n"
        f"# Written by gms-fsm {__version__}; needs only the package transitions.\n"
    )


def _imports(source: str) -> str:
    """Return the imports of a program, and the functions of the language that it uses."""
    used = [each for each in NAMESPACE if re.search(rf"(?<![\w.]){each}\(", source)]
    ours = [each for each in used if each in ELEMENTARY]
    borrowed = ["sin", *(each for each in used if each not in ours and hasattr(math, each))]
    lines = ["", "import sys", f"from math import {', '.join(borrowed)}", ""]
    nested = "NestedMachine" in source
    lines += [f"from transitions{'.extensions.nesting' * nested} import {MACHINES[nested]}", ""]
    if "sgn" in used:
        lines += ["", bare(sgn)]
    lines += [elementary_text(ours)] if ours else []
    return "\n".join(lines) + "\n"


# --------------------------------------------------------------------------- the chart as data
def _data(chart: Chart) -> dict[str, Any]:
    """Return the chart as what stands at the top of the file, by name."""
    edges = {edge.name: edge for edge in chart.transitions}
    # A machine has no histories: there each edge has one of the innermost states as target.
    levels, plain = chart.nesting.levels, not chart.nesting.histories
    if plain:
        edges = {edge.name: edges[edge.name] for edge in chart.nesting.transitions}
    return {
        "NAME": chart.name,
        "REFERENCE": chart.reference,
        "INPUTS": chart.inputs,
        "VELOCITIES": chart.velocities,
        "VARIABLES": tuple(name for name in chart.variables if name not in chart.hidden),
        "PARAMETERS": tuple(_parameter(chart.declared[name]) for name in chart.parameter_names),
        "LET": dict(chart.let),
        "STATES": tuple(_state(state) for state in chart.nesting.states),
        "TRANSITIONS": tuple(
            {
                "trigger": edge.name,
                "source": _sources(chart, edge),
                "dest": spelled(_written(chart, edge).target if plain else edge.target),
                "conditions": f"_guard_{edge.name}",
            }
            for edge in edges.values()
        ),
        "FLOWS": _filled({name: each.state.flow for name, each in levels.items()}),
        "GUARDS": {edge.name: edge.guard for edge in edges.values()},
        "ENTRY": _filled({name: each.state.entry for name, each in levels.items()}),
        "EXIT": _filled({name: each.state.exit for name, each in levels.items()}),
        "ACTIONS": _filled({edge.name: dict(edge.actions) for edge in edges.values()}),
        "OUTPUTS": dict(chart.outputs),
        "STATE_OUTPUTS": _filled({name: each.state.outputs for name, each in levels.items()}),
        "CONTACT_OUTPUTS": dict(chart.contact_outputs),
        "INITIAL": dict(chart.initial),
        **(_nested(chart) if chart.nesting.composite else {}),
    }


def _nested(chart: Chart) -> dict[str, Any]:
    """Return what the loop needs to know of states in states."""
    return {
        "DEFAULT": spelled(chart.default_state.name),
        "START": _methods(chart.nesting.begins()),
        "EDGES": {
            spelled(state.name): {
                edge.name: _methods(edge.performs) for _, edge in chart.leaving(state.name)
            }
            for state in chart.states
        },
    }


def _methods(performed: Iterable[tuple[str, str]]) -> tuple[str, ...]:
    return tuple(f"_{kind}_{spelled(owner)}" for kind, owner in performed)


def _state(state: State) -> str | dict[str, Any]:
    """Return a state as transitions takes it."""
    if not state.states:
        return state.name
    inside = [_state(each) for each in state.states]
    return {"name": state.name, "initial": state.initial, "children": inside}


def _sources(chart: Chart, edge: Transition) -> str | list[str]:
    """Return the states that an edge is written to leave."""
    names = [spelled(each) for each in _written(chart, edge).sources]
    return names[0] if len(names) == 1 else names


def _written(chart: Chart, edge: Transition) -> Transition:
    """Return an edge as it is written."""
    name = dict(edge.performs)["action"]
    return next(each for each in chart.nesting.transitions if each.name == name)


def _parameter(given: Parameter) -> str | dict[str, Any]:
    """Return a plain name, or the fields that differ from their defaults."""
    told = fields_of(given)
    return {"name": given.name, **told} if told else given.name


def _filled(texts: Mapping[str, Mapping[str, str]]) -> dict[str, dict[str, str]]:
    return {spelled(name): dict(each) for name, each in texts.items() if each}


def _numbers(contact: Contact | None) -> dict[str, Any]:
    """Return the numbers of the elements, and of what they share."""
    if contact is None:
        return {"VALUES": None, "WEIGHTS": None}
    found: dict[str, Any] = {
        "VALUES": tuple(element_numbers(contact)),
        "WEIGHTS": tuple(float(each) for each in contact.weights),
    }
    if contact.stribeck is not None:
        found["STRIBECK"] = {name: float(u) for name, u in contact.stribeck.numbers.items()}
    if contact.model is not None:
        found["SIGMA_2"] = float(contact.sigma_2)
    return found


# --------------------------------------------------------------------------- the program
def _program(chart: Chart, contact: Contact | None) -> Iterator[str]:
    yield "# The chart. gms_fsm.Chart.from_transitions reads these names."
    for name, value in _data(chart).items():
        yield _assigned(name, value)
    yield ""
    if contact is None:
        asked = dict.fromkeys(chart.parameter_names, 0.0)
        yield f"# The numbers of each element: fill them in, for example ({asked!r},)"
    else:
        yield "# The numbers of each element, and of what they share."
    for name, value in _numbers(contact).items():
        yield _assigned(name, value)
    yield from ("", "")
    yield from _element(chart, contact)
    yield from _inputs(chart, contact)
    yield from _total(chart, contact)
    yield _loop() if chart.nesting.composite else LOOP
    others = [] if contact is None else other_inputs(contact)
    if contact is None:
        others = [name for name in chart.inputs if name not in ("t", "x", "v", *chart.velocities)]
    given = "".join(f', "{name}": 0.0' for name in others)
    velocity = "0.15 * sin(2 * pi * t / 25)" if contact is None else slow_velocity(contact)
    moved = spell(parse_value(velocity, ["t"]))
    shown = DEMONSTRATION.replace("LENGTH", chart.length).replace("TORQUE", chart.force)
    yield shown.replace("VELOCITY", moved).replace("OTHERS", given)


def _assigned(name: str, value: Any) -> str:
    text = pformat(value, width=100 - len(name) - 3, sort_dicts=False)
    return f"{name} = " + text.replace("\n", "\n" + " " * (len(name) + 3))


class ElementPrinter:
    """Prints trees over the attributes of an element."""

    def __init__(self, chart: Chart) -> None:
        names = [*chart.inputs, *chart.velocities, *chart.variables, *chart.parameter_names]
        self.names = {name: f"self.{name}" for name in (*chart.force_names, *names)}
        self.names |= {name: f"self._let_{name}()" for name in chart.lets}

    def __call__(self, tree: Node) -> str:
        return spell(tree, rename=self.names)

    def function(self, name: str, tree: Value | Condition, comment: str = "") -> list[str]:
        return [f"    def {name}(self):{comment}", f"        return {self(tree)}", ""]

    def rows(self, name: str, trees: Mapping[str, Value]) -> list[str]:
        items = ", ".join(f'"{each}": {self(tree)}' for each, tree in trees.items())
        return [f"    def {name}(self):", f"        return {{{items}}}", ""]


def _element(chart: Chart, contact: Contact | None) -> Iterator[str]:
    text = ElementPrinter(chart)
    yield "class Element:"
    yield '    """One element: the model object of the machine. Its state is `state`."""'
    yield ""
    yield "    def __init__(self, numbers, weight):"
    yield "        vars(self).update(numbers)"
    yield "        self._weight = weight"
    starts = {name: chart.initial.get(name, 0.0) for name in chart.variables}
    yield f"        vars(self).update({starts!r})"
    yield ""
    if contact is not None and contact.stribeck is not None:
        curve = parse_value(contact.stribeck.text, [*contact.stribeck.numbers, "v"])
        named = {name: f'STRIBECK["{name}"]' for name in contact.stribeck.numbers}
        moved = f"self.{chart.velocities[0]}"
        yield "    def _threshold(self):"
        strength = spell(curve, rename={**named, "v": moved})
        if loaded(contact):
            strength = f"({strength}) * max(self.{LOAD}, {LEAST_LOAD!r})"
        yield f"        return self._weight * ({strength})"
        yield ""
    for name, tree in chart.lets.items():
        yield from text.function(f"_let_{name}", tree)
    for edge, guard in chart.guards.items():
        yield from text.function(f"_guard_{edge}", guard)
    for (kind, owner), assignments in chart.assignments.items():
        if assignments:
            yield f"    def _{kind}_{spelled(owner)}(self):"
            yield from (f"        self.{name} = {text(each)}" for name, each in assignments.items())
            yield ""
    for state in chart.states:
        flows = {name: chart.flows[state.name, name] for name in chart.variables}
        yield from text.rows(f"_flow_{spelled(state.name)}", flows)
        rates = {f"d{name}": tree for name, tree in flows.items()}
        force = chart.forces[state.name, "F"]
        assert force is not None  # a locked state was refused
        yield from text.function(f"_force_{spelled(state.name)}", renamed(force, rates))
    yield ""


def _inputs(chart: Chart, contact: Contact | None) -> Iterator[str]:
    """Write what the record and the position mean to an element."""
    means = {name: f'given["{name}"]' for name in chart.inputs if name != "s" or contact is None}
    means |= dict.fromkeys(chart.velocities[:1], 'given["v"]')
    if contact is not None:
        own = [*dict.fromkeys(["t", "x", "v", *other_inputs(contact)])]
        named = {name: f'given["{name}"]' for name in own}
        for name, bound in contact.inputs.items():
            tree = parse_value(bound if isinstance(bound, str) else repr(float(bound)), own)
            means[name] = spell(tree, rename=named)
        if "s" in chart.inputs and contact.stribeck is None:
            means.setdefault("s", 'given["s"]')
    items = ", ".join(f'"{name}": {each}' for name, each in means.items())
    yield "def inputs(given):"
    yield '    """Return what the chart reads from outside, from t, x, v and the record."""'
    yield f"    return {{{items}}}"
    yield from ("", "")


def _total(chart: Chart, contact: Contact | None) -> Iterator[str]:
    """Write the force of the contact over the sum of its elements' forces."""
    names = {**ElementPrinter(chart).names, "F": "F"}
    named = {name: each.replace("self.", "first.") for name, each in names.items()}
    total = spell(chart.totals["F"], rename=named) if "F" in chart.totals else "F"
    if contact is not None and contact.model is not None:
        total += f" + SIGMA_2 * first.{chart.velocities[0]}"
    yield "def force(elements):"
    yield f'    """Return the force of the contact [{chart.force}]."""'
    yield "    F, first = 0.0, elements[0]"
    yield "    for each in elements:"
    yield '        F += getattr(each, f"_force_{each.state}")()'
    yield f"    return {total}"
    yield from ("", "")


LOOP = '''\
def nothing():
    """Do what a state or an edge without assignments does."""


def machine_of(elements):
    """Return a machine of elements; the order of TRANSITIONS is the order of their priority."""
    return Machine(
        model=elements,
        states=list(STATES),
        transitions=[dict(each) for each in TRANSITIONS],
        initial=STATES[0],
        auto_transitions=False,
    )


def elements_of(values, weights=None):
    """Return elements with their numbers."""
    if values is None:
        raise SystemExit("This chart has no numbers: fill in VALUES, one mapping for each element.")
    return [Element(*each) for each in zip(values, weights or [1.0] * len(values))]


def show(elements, t, x, record):
    """Give the present values to all elements."""
    given = {**record(t), "t": t, "x": x}
    for each in elements:
        vars(each).update(inputs(given))
        if hasattr(each, "_threshold"):
            each.s = each._threshold()
    total = force(elements)
    for each in elements:
        each.F = total
    return given["v"], total


def switch(machine, element):
    """Take the first edge whose guard holds; return its name, or None."""
    source = element.state
    for edge in machine.get_triggers(source):
        if element.trigger(edge):
            for part in (f"_exit_{source}", f"_action_{edge}", f"_entry_{element.state}"):
                getattr(element, part, nothing)()
            return edge
    return None


def run(record, t_end, step, values=VALUES, weights=WEIGHTS, t=0.0, x=0.0, **variables):
    """Step the elements: guards once a step, at most one edge each; then Euler's method.

    `record(t)` returns a mapping with the velocity "v" and whatever else comes from outside.
    Yields (t, v, F, states, edges taken); edges are None for elements that stay.
    """
    elements = elements_of(values, weights)
    machine = machine_of(elements)
    start, count = t, 0
    for each in elements:
        vars(each).update(variables)
    show(elements, t, x, record)
    for each in elements:
        getattr(each, f"_entry_{STATES[0]}", nothing)()
    while True:
        show(elements, t, x, record)
        edges = [switch(machine, each) for each in elements]
        v, total = show(elements, t, x, record)
        yield t, v, total, [each.state for each in elements], edges
        if t >= t_end:
            return
        count += 1
        after = start + count * step
        if after + 1e-12 * abs(t_end) >= t_end:  # no sliver of a step before the end
            after = t_end
        h = after - t
        rates = [getattr(each, f"_flow_{each.state}")() for each in elements]
        for each, row in zip(elements, rates):
            for name, rate in row.items():
                setattr(each, name, getattr(each, name) + h * rate)
        t, x = after, x + h * v

'''
MACHINES = ("Machine", "HierarchicalMachine, NestedState")
NESTED_MACHINE = '''\
class InnerState(NestedState):
    """A state whose path has no dots."""

    separator = "__"


class NestedMachine(HierarchicalMachine):
    """A machine of states in states."""

    state_cls = InnerState


'''
NESTED_SWITCH = '''\
def switch(machine, element):
    """Take the first edge whose guard holds, of inner states first; return its name, or None."""
    for edge, parts in EDGES[element.state].items():
        if element.trigger(edge):
            for part in parts:
                getattr(element, part, nothing)()
            return edge
    return None
'''


def _loop() -> str:
    """Return the loop for states in states."""
    before, switch, after = re.split(r"(def switch.*?return None\n)", LOOP, flags=re.DOTALL)
    assert switch
    before = before.replace("return Machine(", "return NestedMachine(")
    before = before.replace("initial=STATES[0]", "initial=DEFAULT")
    entry = 'getattr(each, f"_entry_{STATES[0]}", nothing)()\n'
    for_each = "for part in START:\n            getattr(each, part, nothing)()\n"
    return NESTED_MACHINE + before + NESTED_SWITCH + after.replace(entry, for_each)


DEMONSTRATION = '''\
def record(t):
    """Return the record of the demonstration: a velocity [LENGTH/s] that turns back slowly."""
    return {"v": VELOCITYOTHERS}


def main(t_end=25.0, step=1e-3):
    """Print the switches of a demonstration."""
    switches, t, total = 0, 0.0, 0.0
    for t, v, total, states, edges in run(record, t_end, step):
        for i, edge in enumerate(edges):
            if edge is not None:
                switches += 1
                moved = f"t = {t:.6g} s  v = {v:.4g} LENGTH/s"
                print(f"{moved}  element {i + 1}: {edge} -> {states[i]}")
    print(f"{switches} switches; F = {total:.6g} TORQUE at t = {t:.6g} s")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
'''


# --------------------------------------------------------------------------- for people
AGAIN = """\
Build the chart again

    import {name} as file
    from gms_fsm import Chart
    chart = Chart.from_transitions(
        file.machine_of([]), name=file.NAME, reference=file.REFERENCE, inputs=file.INPUTS,
        velocities=file.VELOCITIES, variables=file.VARIABLES, parameters=file.PARAMETERS,
        let=file.LET, flows=file.FLOWS, guards=file.GUARDS, entry=file.ENTRY, exit=file.EXIT,
        actions=file.ACTIONS, outputs=file.OUTPUTS, state_outputs=file.STATE_OUTPUTS,
        contact_outputs=file.CONTACT_OUTPUTS, initial=file.INITIAL,
    )

"""


def _readme(name: str, chart: Chart, contact: Contact | None) -> str:
    states = ", ".join(state.name for state in chart.states)
    numbers = (
        "none: fill in VALUES, one mapping for each element"
        if contact is None
        else f"those of {visible(contact.title)}, {contact.n} element{'s' * (contact.n != 1)}"
    )
    again = "" if chart.nesting.histories else AGAIN.format(name=name)
    return f"""\
# {visible(chart.name)} as a transitions machine

Written by gms-fsm {__version__}, format transitions.

Files
- {name}.py: the chart as data, a class of elements, a machine, a loop of fixed steps.

Run

    pip install "transitions>=0.9.3,<0.10"
    python {name}.py              # 25 s in steps of 1 ms; prints the switches
    python {name}.py 5 1e-4       # 5 s in steps of 0.1 ms

Use it from a program

    import {name}
    for t, v, F, states, edges in {name}.run({name}.record, t_end=25.0, step=1e-3):
        ...

{again}States: {states}
Parameters: {", ".join(chart.parameter_names) or "none"}
Numbers: {numbers}

What it does not do
- Switches are not located: the guards are evaluated once a step, at most one edge for each element,
  and the flow is integrated by Euler's method. It equals gms-fsm with method="euler",
  events="step" and the same step. A stiff chart needs a short step.
- The rules of parameters (see PARAMETERS) are not checked.
- Locked contacts, impulses, accelerations and several velocities cannot be written.
"""


register(
    Format(
        "transitions",
        "friction",
        "Python for the package transitions",
        "gms-fsm",
        _write,
        words=WORDS,
    )
)
