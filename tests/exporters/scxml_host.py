"""A host for exported SCXML documents: it integrates the flows, and asks a tool for the states."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Protocol

from gms_fsm import Trace
from gms_fsm.charts.nesting import spelled
from gms_fsm.language import Node, evaluate, parse_value
from gms_fsm.systems.models import Model

__all__ = ["PythonStateMachine", "Tool", "moved_by", "run", "switches_of"]

Switch = tuple[float, str, str]  # when, from which state, to which
NAMES = ("exp", "log", "sqrt", "sin", "cos", "tanh", "atan", "asinh", "pow", "floor")
MATH = SimpleNamespace(**{name: getattr(math, name) for name in NAMES}, abs=abs, min=min, max=max)
MATH.sign = lambda u: float((u > 0) - (u < 0))


class Tool(Protocol):
    """A program that has loaded a document."""

    def step(self, values: Mapping[str, float]) -> tuple[str, Mapping[str, Any]]:
        """Send ``values`` and ``step``; return the state, and the data model."""


class PythonStateMachine:
    """The package python-statemachine."""

    def __init__(self, path: Path) -> None:
        from statemachine.io import load

        self.machine: Any = load(path, trusted=True)(SimpleNamespace(Math=MATH))

    def step(self, values: Mapping[str, float]) -> tuple[str, Mapping[str, Any]]:
        """Send ``values`` and ``step``; return the state, and the data model."""
        self.machine.send("values", **values)
        self.machine.send("step")
        (state,) = (each for each in self.machine.configuration if not each.states)
        return state.id, vars(self.machine.model)

    def close(self) -> None:
        """It has no process of its own."""


def moved_by(text: str) -> Callable[[float], float]:
    """Return a velocity."""
    tree = parse_value(text, ["t"])
    return lambda t: float(evaluate(tree, {"t": t}))


def switches_of(trace: Trace, element: int) -> list[Switch]:
    """Return the switches of one element of a run."""
    return [
        (float(each.t), str(each.source), str(each.target))
        for each in trace.transitions
        if each.element == element
    ]


def run(
    tool: Tool,
    model: Model,
    element: int,
    velocity: Callable[[float], float],
    t_end: float,
    step: float,
) -> list[Switch]:
    """Step one element by Euler's method; the tool says in which state it is, and what it sets."""
    chart, curve = model.chart, model.stribeck
    numbers = {
        name: float(value if not hasattr(value, "__len__") else value[element])
        for name, value in model.values.items()
    }
    # The tool keeps histories by itself.
    kept = chart.nesting.histories
    variables = {name: chart.initial.get(name, 0.0) for name in chart.variables if name not in kept}
    paths = {spelled(each.name): each.name for each in chart.states}
    state, t, x, count, found = chart.default_state.name, 0.0, 0.0, 0, list[Switch]()
    while True:
        outside = {"t": t, "x": x, "v": velocity(t)}
        if curve is not None:
            outside["s"] = float(model.weights[element] * curve(outside["v"]))
        known = {name: outside[name] for name in {*chart.inputs, *chart.velocities}}
        entered, given = tool.step({**known, **variables})
        after = paths[entered]
        if after != state:
            found.append((t, state, after))
        state, variables = after, {name: float(given[name]) for name in variables}
        if t >= t_end:
            return found
        count += 1
        t_new = min(count * step, t_end)
        now = {**numbers, **known, **variables}
        for name, tree in chart.lets.items():
            now[name] = _value(tree, now)
        rates = {name: _value(chart.flows[state, name], now) for name in variables}
        variables = {name: variables[name] + (t_new - t) * rates[name] for name in variables}
        t, x = t_new, x + (t_new - t) * outside["v"]


def _value(tree: Node, values: Mapping[str, float]) -> float:
    return float(evaluate(tree, values))
