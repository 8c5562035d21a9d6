"""Which quantity is not finite where a run ended, and the components of the state there."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import chain

import numpy as np

from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.nesting import output_text
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.arguments import some_of
from gms_fsm.foundation.quantities import named_numbers
from gms_fsm.language import names_in, parse_value, values_of
from gms_fsm.lowering.observing import armed, rate
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.moment import scope_of
from gms_fsm.systems.signals import Formula
from gms_fsm.traces.scope import FORCE, parameter_values
from integrators import HybridError

AFTER = np.concatenate([[0.0], np.logspace(-15.0, -2.0, 40)])  # s, as far as one step may look


def state_there(start: Problem, error: HybridError) -> str:
    """Return the components of the state by the names that the user gave them."""
    layout = start.program.layout
    values = zip(layout.y, error.y, strict=True)
    return some_of(
        named_numbers({f"{layout.label(name)}{'' if i is None else i + 1}": value})
        for (name, i), value in values
    )


def culprit(start: Problem, error: HybridError) -> str:
    """Return the sentence that names what is not finite."""
    found = chain(
        _updates(start, error),
        _signals(start, error.t + AFTER[:1]),
        _contacts(start, error),
        _rates(start, error),
        _signals(start, error.t + AFTER),
        ["a signal or a flow is not finite here or just after"],
    )
    return next(found)


def _updates(start: Problem, error: HybridError) -> Iterator[str]:
    y = start.program.layout.y.named(error.y)
    for each in start.system.sampled:
        for name, text in each.updates.items():
            if not math.isfinite(y[name]):
                yield f"the update of {name} in sampled {each.name!r}, [{text}], is not finite here"


def _contacts(start: Problem, error: HybridError) -> Iterator[str]:
    y = start.program.layout.y.named(error.y)
    for bank in start.program.layout.banks:
        chart = start.system.contact(bank.name).chart
        scope = scope_of(start, error.t, error.y, error.mode, bank.name)
        whose = f" of {bank.name}" if start.what.named else ""
        if chart.velocities and not math.isfinite(scope.v):
            yield f"the velocity v{whose} is not finite here"
        states = {state.name: state for state in chart.states}
        for i, name in enumerate(scope.states):
            place = start.what.element(bank.name, i)
            for variable in chart.variables:
                if not math.isfinite(y[bank.of(variable)][i]):
                    texts = some_of(f"[{text}]" for text in _assigned(chart, variable))
                    yield f"{variable} of {place} is not finite here; assigned to it: {texts}"
            known = states[name].locked or not chart.velocities  # a lock gives what is asked
            F = 0.0 if known else scope.each(FORCE)[i]
            if not math.isfinite(F):
                values = parameter_values(scope.model, i)
                yield f"the force of {place} {_infinite_force(chart, states[name], F, values)}"
            for variable in chart.variables:
                if not math.isfinite(scope.each(f"d{variable}")[i]):
                    text = states[name].flow.get(variable, "0")
                    yield (
                        f"the flow of {variable} in state {name}, [{text}], is not finite in "
                        f"{place} here"
                    )


def _infinite_force(chart: Chart, state: State, F: float, values: Mapping[str, float]) -> str:
    """Say which text of a force is not finite, with the numbers that it reads."""
    text = output_text(chart.nesting, chart.outputs, state.name, "F")
    tree = chart.forces[state.name, "F"]
    read = names_in(tree) & values.keys() if tree is not None else ()
    numbers = named_numbers({name: values[name] for name in sorted(read)})
    known = f"({F:g}{f', with {numbers}' if numbers else ''})"
    return f"in state {state.name}, [{text}], is not finite {known} here"


def _assigned(chart: Chart, variable: str) -> Iterator[str]:
    """Yield the texts that are assigned to a variable."""
    for texts in (
        *(edge.actions for edge in chart.transitions),
        *(each for state in chart.states for each in (state.entry, state.exit)),
    ):
        if variable in texts:
            yield texts[variable]


def _rates(start: Problem, error: HybridError) -> Iterator[str]:
    program, (t, y, mode) = start.program, (error.t, error.y, error.mode)
    rates = program.layout.y.named(rate(program, t, y, mode, armed(program, t, y, mode)))
    for name, text in start.system.flow.items():
        if not math.isfinite(rates[name]):
            yield f"the flow of {name}, [{text}], is not finite here"
    for body in start.system.bodies if start.what.named else ():
        if not body.driven and not math.isfinite(rates[body.v]):
            yield (
                f"the acceleration of body {body.name!r}, with the force [{body.force}], is not "
                "finite here"
            )


def _signals(start: Problem, times: FloatArray) -> Iterator[str]:
    numbers = start.system.numbers
    for name, signal in start.system.signals.items():
        text = signal.text if isinstance(signal, Formula) else signal
        if not isinstance(text, str):
            continue
        values = values_of(parse_value(text, ["t", *numbers]), {"t": times, **numbers})
        for i in np.flatnonzero(~np.isfinite(np.broadcast_to(values, times.shape)))[:1]:
            yield f"signal {name!r}, [{text}], is not finite at t = {times[i]:.9g} s"
