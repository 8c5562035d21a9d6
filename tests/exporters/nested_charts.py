"""Random charts with states in states, and a host that steps their SCXML documents."""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

from gms_fsm import Chart, ChartModel, Prescribed, State, Trace, Transition, simulate
from gms_fsm.charts.nesting import spelled
from gms_fsm.language import evaluate
from tests.exporters.scxml_host import Tool, moved_by

__all__ = ["VELOCITY", "made", "run_of", "seen_by"]

VELOCITY = "sin(3 * t) + 0.5 * sin(7.1 * t)"
STEP, COUNT = 0.05, 80
Seen = list[tuple[str, float]]  # the state, and the variable n, after each step


def made(seed: int) -> ChartModel:
    """Return a chart of up to three levels; each entry, exit and action leaves its mark in n."""
    rng = random.Random(seed)
    marks = iter(range(1, 1000))
    states = tuple(_state(rng, f"s{i}", 3, marks) for i in range(rng.randint(2, 3)))
    paths = [path for state in states for path in _paths(state)]
    edges = tuple(
        Transition(
            f"e{i}",
            rng.sample(paths, 1 + (rng.random() < 0.1)),
            rng.choice(paths),
            guard=f"v {rng.choice('<>')} {rng.uniform(-0.8, 0.8):.2f} and x >= 0",
            actions=_mark(rng, marks),
        )
        for i in range(3 * len(paths) // 2 + 2)
    )
    timed = tuple(
        Transition(
            edge.name,
            edge.source,
            edge.target,
            f"after({rng.uniform(0.04, 0.6):.2f}) and {edge.guard}",
            edge.actions,
        )
        for edge in edges
    )
    chart = Chart(
        f"random chart {seed}",
        inputs=("x", "v"),
        variables=("n",),
        states=states,
        transitions=timed,
        outputs={"F": "v"},
    )
    return ChartModel(chart, {})


def _state(rng: random.Random, name: str, levels: int, marks: Iterator[int]) -> State:
    inside: tuple[State, ...] = ()
    if levels > 1 and rng.random() < 0.6:
        inside = tuple(
            _state(rng, f"{name}{'abc'[i]}", levels - 1, marks) for i in range(rng.randint(1, 3))
        )
    return State(
        name,
        flow={"n": rng.choice(("-n", "age", "v - n"))} if rng.random() < 0.5 else {},
        entry=_mark(rng, marks),
        exit=_mark(rng, marks),
        states=inside,
        initial=rng.choice(inside).name if inside else "",
        history=bool(inside) and rng.random() < 0.5,
    )


def _mark(rng: random.Random, marks: Iterator[int]) -> dict[str, str]:
    return {"n": f"0.5 * n + {next(marks)}"} if rng.random() < 0.7 else {}


def _paths(state: State, around: str = "") -> Iterator[str]:
    yield around + state.name
    for each in state.states:
        yield from _paths(each, f"{around}{state.name}.")


def run_of(model: ChartModel) -> tuple[Seen, Trace]:
    """Return what a run with Euler's method sees at its steps, and the run."""
    how: Any = {"method": "euler", "step": STEP, "events": "step", "engine": "ifelse"}
    trace = simulate(model, Prescribed(VELOCITY), STEP * COUNT, **how)
    last = {
        float(t): (str(state), float(n))
        for t, state, n in zip(trace.t, trace.states[:, 0], trace.variable("n")[:, 0], strict=True)
    }
    return [*last.values()], trace


def seen_by(tool: Tool, model: ChartModel) -> Seen:
    """Step a document as `run_of` steps the chart."""
    chart, velocity, found = model.chart, moved_by(VELOCITY), Seen()
    paths = {spelled(each.name): each.name for each in chart.states}
    values = {each: 0.0 for each in chart.variables if each not in chart.nesting.histories}
    t = x = 0.0
    values["n"] = _entered(chart)
    while True:
        known = {"x": x, "v": velocity(t)}
        entered, given = tool.step({**known, **values})
        state, values = paths[entered], {name: float(given[name]) for name in values}
        found.append((state, values["n"]))
        if len(found) > COUNT:
            return found
        later = min(len(found) * STEP, STEP * COUNT)
        rates = {
            name: float(evaluate(chart.flows[state, name], {**known, **values})) for name in values
        }
        values = {name: values[name] + (later - t) * rates[name] for name in values}
        t, x = later, x + (later - t) * known["v"]


def _entered(chart: Chart) -> float:
    """Return n after the entry of the default states."""
    n = 0.0
    for name, tree in chart.assigned():
        n = float(evaluate(tree, {"n": n})) if name == "n" else n
    return n
