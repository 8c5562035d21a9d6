"""What differs from run to run besides numbers, by name: initial values, periods, signals."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray, Parameter, checked_scalar
from gms_fsm.errors import GMSError, ParameterError, cut
from gms_fsm.gradients.directions import INITIAL, initial_places
from gms_fsm.language import names_in, numbers_named, parse_value, rough_points
from gms_fsm.lowering.pulses import waking_times
from gms_fsm.run._swept import LONGEST
from gms_fsm.run.problem import Problem
from gms_fsm.systems.mounted import Mounted, mounted
from gms_fsm.systems.numbers import NUMBERS, known_in
from gms_fsm.systems.parts import Sampled
from gms_fsm.systems.signals import Formula, as_signal
from gms_fsm.systems.system import System

PERIOD = ".period"
SIGNALS = "signals"  # the owner of those of a system
WORD = re.compile(r"(?<![\w.])period\b")


def periods_of(what: Mounted) -> dict[str, tuple[Parameter, int]]:
    """Return the periods of all that ticks in a system, as `known_in` does its numbers."""
    parts: Any = (*what.system.sampled, *what.system.machines) if what.named else ()
    return {
        f"{each.name}{PERIOD}": (Parameter("period", "s", rule="> 0"), 0)
        for each in parts
        if each.period is not None
    }


def initial_size(start: Problem, name: str) -> int:
    """Return how many elements have an initial value; 0 if it is one number."""
    places = initial_places(start.program, name, "parameters")
    layout, plain = start.program.layout, name.removeprefix(INITIAL)
    return len(places) if layout.keys.get(plain) in layout.y.own else 0


def with_periods(what: Mounted, periods: Mapping[str, float]) -> Mounted:
    """Return a system whose parts tick with other periods; a `ParameterError` if one is not > 0.

    What texts call ``period`` is a number of the system there, so all have one program.
    """
    if not periods:
        return what
    system, numbers = what.system, dict(what.system.numbers)

    def other(part: Any) -> Any:
        name = f"{part.name}{PERIOD}"
        if name not in periods:
            return part
        period = checked_scalar(name, periods[name], "> 0")
        if not isinstance(part, Sampled):
            return part.replaced(period=period)
        number = f"{part.name}__period"
        updates = {each: WORD.sub(number, text) for each, text in part.updates.items()}
        if updates != part.updates:
            numbers[number] = period
        return replace(part, period=period, updates=updates)

    kinds = "sampled", "contacts", "supervisors"
    parts: Any = {kind: tuple(map(other, getattr(system, kind))) for kind in kinds}
    return mounted(replace(system, **parts, numbers=numbers))


def with_initial(start: Problem, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the initial values of a run: those of the start, and others over them."""
    layout = start.program.layout
    found: dict[str, Any] = {}
    changed: dict[str, FloatArray] = {}
    for name, value in given.items():
        places = initial_places(start.program, name, "parameters")
        home = next(each for each, _ in layout.y if {*places} <= {*layout.y.all_of(each)})
        every = layout.y.all_of(home)
        if home not in changed:
            changed[home] = np.array([start.y[k] for k in every])
        changed[home][[k - every[0] for k in places]] = value
    for key, value in start.initial.items():
        if layout.keys.get(key) not in changed:
            found[key] = value
    for home, values in changed.items():
        key = next(key for key, place in layout.keys.items() if place == home)
        found[key] = values if home in layout.y.own else float(values[0])
    return found


def signals_of(what: Mounted) -> dict[str, str]:
    """Return the signals by the names that a sweep has for them: of a system, inputs too."""
    system = what.system
    own = (*system.signals, *system.open) if what.named else what.rig.signals
    known = known_in(what)
    return {each: name for name in own if (each := what.of(SIGNALS, name)) not in known}


def signals_given(what: Mounted, parameters: Any) -> dict[str, NDArray[Any]]:
    """Return of each signal that differs those of all runs; texts of a system are read later."""
    found: dict[str, NDArray[Any]] = {}
    for name in signals_of(what) if hasattr(parameters, "keys") else ():
        if name not in parameters:
            continue
        here, given = f"parameters[{name!r}]", parameters[name]
        several = [] if isinstance(given, str) or not np.iterable(given) else [*given]
        if not several:
            raise ParameterError(
                "it must be a list, one signal for each run", place=here, value=given
            )
        found[name] = np.empty(len(several), dtype=object)
        for k, each in enumerate(several):
            try:
                text = what.named and isinstance(each, str)
                found[name][k] = each if text else as_signal(each)
            except GMSError as error:
                raise error.inside(f"{here}[{k}]") from None
    return found


def with_signals(what: Mounted, given: Mapping[str, Any]) -> Mounted:
    """Return the same with other signals, by their names in a sweep."""
    if not given:
        return what
    names = signals_of(what)
    return what.driven({**what.rig.signals, **{names[each]: u for each, u in given.items()}})


def as_numbers(
    what: Mounted, signals: Mapping[str, NDArray[Any]], span: tuple[float, float]
) -> tuple[Mounted, dict[str, dict[str, NDArray[Any]]]]:
    """Return the same with numbers in texts that differ in numbers only, and those of all runs.

    All runs are one program then. Bodies that move as given begin with another velocity.
    """
    names, found = signals_of(what), dict[str, dict[str, NDArray[Any]]]()
    system = what.system
    for name, texts in signals.items():
        if any(body.driven for body in system.bodies):
            break
        if not all(isinstance(each, str) and _is_smooth(each, system, span) for each in texts):
            continue
        pairs = [numbers_named(text, f"{names[name]}__at") for text in texts]
        pattern, first = pairs[0]
        if first and len({text for text, _ in pairs}) == 1:
            found[name] = {
                f"{NUMBERS}.{own}": np.array([float(numbers[own]) for _, numbers in pairs])
                for own in first
            }
            numbers = {own: float(text) for own, text in first.items()}
            given: Any = {**system.signals, names[name]: pattern}
            system = replace(system, signals=given, numbers={**system.numbers, **numbers})
    return (mounted(system) if found else what), found


def _is_smooth(text: str, system: System, span: tuple[float, float]) -> bool:
    """Return whether steps need not be told where a signal bends, jumps or wakes."""
    try:
        tree = parse_value(text, ["t", *system.numbers])
    except GMSError:
        return False  # its run says so
    rests = names_in(tree) <= {"t"} and waking_times(tree, *span)
    return not rough_points(tree) and not rests


def shown_values(values: NDArray[Any]) -> NDArray[Any]:
    """Return what a result says of a parameter: numbers, or of signals their texts."""
    if values.dtype != object:
        return values
    texts = [each.text if isinstance(each, Formula) else each for each in values]
    runs = enumerate(texts)
    return np.array([cut(u, LONGEST) if isinstance(u, str) else f"signal {k}" for k, u in runs])
