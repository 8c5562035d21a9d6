"""An imported chart goes through the states of the machine or document that it came from.

Random nested ones, stepped by the packages transitions and python-statemachine: with inner edges
before outer ones, conditions, entries and exits whose order shows in what they assign.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from transitions.extensions import HierarchicalMachine

from gms_fsm import Chart
from gms_fsm.charts.nesting import spelled
from gms_fsm.language import evaluate

EVENTS = ("go", "turn", "rest")


class Nested:
    """A random tree of states, whose entries and exits read what others assign."""

    def __init__(self, chance: random.Random) -> None:
        self.chance, self.inside, self.around = chance, dict[str, list[str]](), dict[str, str]()
        self.first: dict[str, str | None] = {}
        names = iter("abcdefghijklmnop")
        self.tops = [next(names) for _ in range(3)]
        level = [name for name in self.tops[1:] if chance.random() < 0.8]
        for _ in range(2):
            for outer in level:
                self.inside[outer] = [next(names) for _ in range(chance.choice([1, 2, 2]))]
                self.around |= dict.fromkeys(self.inside[outer], outer)
            inner = [name for outer in level for name in self.inside[outer]]
            level = [name for name in inner if chance.random() < 0.3]
        self.names = [*self.tops, *self.around]
        self.edges = [
            (chance.choice(EVENTS), *chance.choices(self.names, k=2), chance.random() < 0.5)
            for _ in range(chance.randint(4, 12))
        ]

    def path(self, name: str) -> list[str]:
        """Return a state with those around it, the outermost first."""
        return [*self.path(self.around[name]), name] if name in self.around else [name]

    def texts(self, kind: str, name: str) -> dict[str, str]:
        """Return what entering or leaving a state assigns."""
        read = "".join(f" + {kind}_{each}" for each in self.others(name))
        return {f"{kind}_{name}": f"{kind}_{name} + 1{read}"}

    def assigned(self, kind: str, name: str, values: dict[str, float]) -> dict[str, float]:
        """Return the same as numbers."""
        read = [name, *self.others(name)]
        return {f"{kind}_{name}": 1.0 + sum(values[f"{kind}_{each}"] for each in read)}

    def others(self, name: str) -> list[str]:
        """Return the states directly around and inside of a state."""
        return [*self.path(name)[-2:-1], *self.inside.get(name, [])]

    @property
    def variables(self) -> list[str]:
        """Return all that is assigned."""
        return [f"{kind}_{name}" for kind in ("n", "x") for name in self.names]

    def steps(self) -> Iterator[tuple[str, float]]:
        """Yield events, with the number that conditions read."""
        for _ in range(30):
            yield self.chance.choice(EVENTS), float(self.chance.randint(0, 4))


def stepped(chart: Chart, state: str, values: dict[str, float]) -> str:
    """Take the first edge whose guard holds, and return the state then."""
    for _, edge in chart.leaving(state):
        if evaluate(chart.guards[edge.name], values):
            for name, tree in chart.assigned(edge):
                values[name] = float(evaluate(tree, values))
            return edge.target
    return state


Send = Callable[[str, float], tuple[str, dict[str, float]]]


def compared(nested: Nested, chart: Chart, values: dict[str, float], send: Send) -> int:
    """Send events to both; compare states and values after each, and count the changes."""
    state, changes = chart.default_state.name, 0
    for event, big in nested.steps():
        known = values | {"k": float(EVENTS.index(event)), "big": big}
        state = stepped(chart, state, known)
        before, values = values, {name: known[name] for name in values}
        found, theirs = send(event, big)
        assert spelled(state) == found
        assert values == {name: theirs[name] for name in values}
        changes += values != before
    return changes


def given(nested: Nested, **more: Any) -> dict[str, Any]:
    """Return the texts beside: an event has come while k is its number."""
    guards = {event: f"k > {i - 0.5} and k < {i + 0.5}" for i, event in enumerate(EVENTS)}
    known = {each[0] for each in nested.edges}
    return {
        "inputs": ("v", "k", "big"),
        "variables": nested.variables,
        "outputs": {"F": "0"},
        "guards": {event: guard for event, guard in guards.items() if event in known},
        **more,
    }


# --------------------------------------------------------------------------- transitions
class Counting:
    """A model whose methods assign what the texts say."""

    def __init__(self, nested: Nested) -> None:
        self.values = dict.fromkeys(nested.variables, 0.0)
        self.big = 0.0
        for kind in ("n", "x"):
            for name in nested.names:
                setattr(self, f"do_{kind}_{name}", lambda k=kind, n=name: self.do(nested, k, n))

    def do(self, nested: Nested, kind: str, name: str) -> None:
        """Assign what entering or leaving a state does."""
        self.values |= nested.assigned(kind, name, self.values)

    def large(self) -> bool:
        """Return whether the condition holds."""
        return self.big > 2


def machine_of(nested: Nested, model: Counting) -> Any:
    """Return the machine; some of its states with parts have no initial one."""

    def state(name: str) -> dict[str, Any]:
        found: dict[str, Any] = {"name": name}
        found |= {f"on_{way}": f"do_{kind}_{name}" for way, kind in (("enter", "n"), ("exit", "x"))}
        if name in nested.inside:
            found["children"] = [state(each) for each in nested.inside[name]]
            if nested.chance.random() < 0.7:
                found["initial"] = nested.chance.choice(nested.inside[name])
        return found

    machine = HierarchicalMachine(
        model,
        states=[state(name) for name in nested.tops],
        initial=nested.tops[0],
        ignore_invalid_triggers=True,
    )
    for event, source, target, conditional in nested.edges:
        ends = ["_".join(nested.path(each)) for each in (source, target)]
        machine.add_transition(event, *ends, conditions=["large"] * conditional)
    return machine


@pytest.mark.slow
def test_random_hierarchical_machines() -> None:
    changes = 0
    for seed in range(100):
        nested = Nested(random.Random(seed))
        model = Counting(nested)
        machine = machine_of(nested, model)
        callbacks: dict[str, Any] = {"large": "big > 2"} if any(e[3] for e in nested.edges) else {}
        callbacks |= {f"do_{each}": nested.texts(*each.split("_")) for each in nested.variables}
        chart = Chart.from_transitions(machine, **given(nested, callbacks=callbacks))

        def send(event: str, big: float, model: Any = model) -> tuple[str, dict[str, float]]:
            model.big = big
            if hasattr(model, event):
                getattr(model, event)()
            return "__".join(model.state.split("_")), model.values

        changes += compared(nested, chart, dict.fromkeys(nested.variables, 0.0), send)
    assert changes > 500


# --------------------------------------------------------------------------- SCXML
def document_of(nested: Nested) -> str:
    """Return a document, with initial states in all ways in which they can be written."""
    chance = nested.chance

    def assign(kind: str, name: str) -> str:
        texts = nested.texts(kind, name).items()
        return "".join(f'<assign location="{each}" expr="{text}"/>' for each, text in texts)

    def state(name: str) -> str:
        parts = nested.inside.get(name, [])
        first, way = chance.choice(parts or [""]), chance.randint(0, 2)
        attribute = f' initial="{first}"' if parts and way == 1 else ""
        inner = f'<initial><transition target="{first}"/></initial>' if parts and way == 2 else ""
        inner += f"<onentry>{assign('n', name)}</onentry><onexit>{assign('x', name)}</onexit>"
        for event, source, target, conditional in nested.edges:
            if source == name:
                inside = name in nested.path(target)[:-1]
                kind = ' type="internal"' if inside and chance.random() < 0.5 else ""
                cond = ' cond="big &gt; 2"' if conditional else ""
                inner += f'<transition event="{event}" target="{target}"{cond}{kind}/>'
        if name in nested.tops:
            inner += '<transition event="values"><assign location="big" expr="_event.data.big"/>'
            inner += "</transition>"
        return f'<state id="{name}"{attribute}>{inner}{"".join(map(state, parts))}</state>'

    data = "".join(f'<data id="{each}" expr="0"/>' for each in ("big", *nested.variables))
    head = '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" initial="a">'
    return f"{head}<datamodel>{data}</datamodel>{''.join(map(state, nested.tops))}</scxml>"


@pytest.mark.matrix
@pytest.mark.slow
def test_random_nested_documents(tmp_path: Path) -> None:
    from statemachine.io import load

    changes, path = 0, tmp_path / "own.scxml"
    for seed in range(60):
        nested = Nested(random.Random(seed))
        path.write_text(document_of(nested), encoding="utf-8")
        theirs: Any = load(path, trusted=True)(SimpleNamespace())
        texts = given(nested)
        for event in texts["guards"]:  # the only edge's guard replaces its condition
            kinds = {each[2:] for each in nested.edges if each[0] == event}
            texts["guards"][event] += " and big > 2" * (len(kinds) == 1 and kinds.pop()[1])
        chart = Chart.from_scxml(path, **texts)
        start = dict.fromkeys(nested.variables, 0.0) | {f"n_{nested.tops[0]}": 1.0}

        def innermost(machine: Any, nested: Nested = nested) -> str:
            return "__".join(max((nested.path(each.id) for each in machine.configuration), key=len))

        def send(event: str, big: float, machine: Any = theirs) -> tuple[str, dict[str, float]]:
            machine.send("values", big=big)
            machine.send(event)
            return innermost(machine), vars(machine.model)

        changes += compared(nested, chart, start, send)
    assert changes > 300
