"""Derivatives of runs, compared with central differences of much more accurate runs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from gms_fsm import Trace
from gms_fsm.errors import GMSError
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import Settings
from gms_fsm.run.simulate import simulated
from gms_fsm.systems.mounted import mounted
from gms_fsm.systems.numbers import number_of, numbers_of, with_numbers
from tests.corpus import Run
from tests.helpers import FASTEST

RATIO = 4.0  # of one step to the next
STEPS = tuple(1e-2 * RATIO**-k for k in range(6))  # of the number itself
SMALL = 1e-2  # of the natural size of a derivative: below it errors are absolute


@dataclass(frozen=True)
class Compared:
    """One derivative beside differences.

    Parameters
    ----------
    name : str
        By what.
    error, noise : float
        Of the worst component of the final state and the times of all switches, relative to it; and
        how far apart two extrapolations of differences are, in the worst component of theirs.
    late : float
        Error of the worst time of a switch.
    known : bool
        Whether the derivative is a number, and there are differences: the same switches on both
        sides.
    """

    name: str
    error: float
    noise: float
    late: float
    known: bool


def names_of(run: Run, most: int) -> list[str]:
    """Return numbers of a run that are not 0, evenly chosen, and an initial value."""
    start = problem(run, 1e-6)
    names = [
        name
        for name, each in numbers_of(start.what).items()
        if each.value != 0.0 and not name.endswith("delta")  # an exponent may be text
    ]
    chosen = [names[k] for k in np.unique(np.linspace(0, len(names) - 1, most).astype(int))]
    layout = start.program.layout
    free = [key for key, name in layout.keys.items() if name in layout.y.shared]
    return [*chosen, f"initial.{(free or list(layout.keys))[0]}"]


def problem(run: Run, rtol: float, numbers: Any = None) -> Problem:
    """Return the start of a run, with other numbers, without anything that it only shows."""
    how = {k: u for k, u in run.how.items() if k in ("t_start", "initial")}
    what = mounted(*run.subject)
    what = what if numbers is None else with_numbers(what, numbers)
    return Problem.on(what, run.t_end, Settings(rtol=rtol, engine=FASTEST), **how)


def compared(run: Run, names: Iterable[str], rtol: float = 1e-10) -> tuple[Trace, list[Compared]]:
    """Return a run with sensitivities, and what these are beside differences."""
    names = list(names)
    how = {k: u for k, u in run.how.items() if k in ("t_start", "initial")}
    trace = replace(run, how=how)(rtol=rtol, engine=FASTEST, sensitivities=names)
    return trace, [_one(run, trace, c, name) for c, name in enumerate(names)]


def _one(run: Run, trace: Trace, c: int, name: str) -> Compared:
    assert trace.derived is not None
    followed = trace.derived.followed
    got = np.concatenate([followed.end[:, c], followed.times[:, c]])
    size = _size(run, name)
    found = []
    for step in STEPS:
        try:
            up, down = (_end(run, trace, name, sign * step * size) for sign in (1.0, -1.0))
        except GMSError:
            continue
        if up is not None and down is not None:
            found.append((up - down) / (2.0 * step * size))
    if len(found) < 3 or np.isnan(got).any():
        return Compared(name, np.inf, np.inf, np.inf, known=False)
    natural = [np.abs(trace.rows.y).max(axis=0), np.full(len(trace.firings), run.t_end)]
    scale = np.maximum(np.abs(found[-1]), SMALL * np.concatenate(natural) / size + 1e-300)
    # Two noisy ones may agree by chance in one component, not in all of them.
    noise, best = np.inf, found[-1]
    for order in range(1, len(found)):  # Richardson: without squares, then fourth powers, ...
        found = [v + (v - u) / (RATIO ** (2 * order) - 1.0) for u, v in pairwise(found)]
        for u, v in pairwise(found):
            apart = float((np.abs(v - u) / scale).max())
            noise, best = (apart, v) if apart < noise else (noise, best)
    error = np.abs(got - best) / scale
    late = error[trace.rows.y.shape[1] :].max(initial=0.0)
    return Compared(name, float(error.max()), noise, float(late), known=True)


def _size(run: Run, name: str) -> float:
    start = problem(run, 1e-6)
    if name.startswith("initial."):
        places = start.program.layout.y.all_of(start.program.layout.keys[name[8:]])
        return max(abs(start.y[k]) for k in places) or 1.0
    return abs(number_of(start.what, name).value)


def _end(run: Run, trace: Trace, name: str, change: float) -> Any:
    """Return the final state and the times of the switches; None if these are others."""
    if name.startswith("initial."):
        start = problem(run, 1e-12)
        y = list(start.y)
        for k in start.program.layout.y.all_of(start.program.layout.keys[name[8:]]):
            y[k] += change
        start = replace(start, y=y)
    else:
        value = number_of(mounted(*run.subject), name).value
        start = problem(run, 1e-12, {name: value + change})
    other = simulated(start)
    same = np.array_equal(other.firings.edge, trace.firings.edge)
    if not (same and np.array_equal(other.firings.machine, trace.firings.machine)):
        return None
    return np.concatenate([other.rows.y[-1], other.firings.t])
