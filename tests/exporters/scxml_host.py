"""A host for exported SCXML documents: it integrates the flows, and asks a tool for the states."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Protocol

from gms_fsm import Chart
from gms_fsm.language import evaluate
from gms_fsm.systems.models import Model

MATH = SimpleNamespace(
    abs=abs,
    min=min,
    max=max,
    exp=math.exp,
    log=math.log,
    sqrt=math.sqrt,
    sin=math.sin,
    cos=math.cos,
    tanh=math.tanh,
    atan=math.atan,
    asinh=math.asinh,
    pow=math.pow,
    sign=lambda u: float((u > 0) - (u < 0)),
)


class Tool(Protocol):
    """A program that has loaded a document."""

    def step(self, values: Mapping[str, float]) -> tuple[str, Mapping[str, float]]:
        """Send ``values`` and ``step``; return the state, and the variables."""


class PythonStateMachine:
    """The package python-statemachine."""

    def __init__(self, path: Path) -> None:
        from statemachine.io import load

        self.machine: Any = load(path, trusted=True)(SimpleNamespace(Math=MATH))

    def step(self, values: Mapping[str, float]) -> tuple[str, Mapping[str, float]]:
        """Send ``values`` and ``step``; return the state, and the variables."""
        self.machine.send("values", **values)
        self.machine.send("step")
        (state,) = self.machine.configuration
        return state.id, vars(self.machine.model)


def run(
    tool: Tool, model: Model, element: int, velocity: Callable[[float], float], t_end: float, step: float
) -> list[tuple[float, str, str]]:
    """Step one element by Euler's method; return when it went from which state to which."""
    chart: Chart = model.chart
    lets = chart.lets
    numbers = {
        name: float(value if not hasattr(value, "__len__") else value[element])
        for name, value in model.values.items()
    }
    variables = dict.fromkeys(chart.variables, 0.0)
    state, x, t, count, found = chart.default_state.name, 0.0, 0.0, 0, []
    for name, tree in chart.assignments["entry", state].items():
        variables[name] = _value(tree, lets, {**numbers, **variables, "v": velocity(0.0)})
    while True:
        outside = {"t": t, "x": x, "v": velocity(t)}
        if model.stribeck is not None:
            outside["s"] = float(model.weights[element] * model.stribeck(outside["v"]))
        known = {name: outside[name] for name in {*chart.inputs, *chart.velocities}}
        after, given = tool.step({**known, **variables})
        if after != state:
            found.append((t, state, after))
        state, variables = after, {name: given[name] for name in variables}
        if t >= t_end:
            return found
        count += 1
        t_new = min(count * step, t_end)
        now = {**numbers, **known, **variables}
        rates = {
            name: _value(chart.flows[state, name], lets, now) for name in variables
        }
        variables = {name: variables[name] + (t_new - t) * rates[name] for name in variables}
        x += (t_new - t) * outside["v"]
        t = t_new


def _value(tree: Any, lets: Mapping[str, Any], values: Mapping[str, float]) -> float:
    known = dict(values)
    for name, each in lets.items():
        known[name] = evaluate(each, known)
    return evaluate(tree, known)
