"""Which numbers and initial values a run is differentiated by, by their names."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.gradients.tangents import ActiveNumbers
from gms_fsm.lowering.program import Program
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import column_name, label_in, number_in, numbers_of

INITIAL = "initial."


@dataclass(frozen=True)
class Directions:
    """Directions in which the numbers and the initial state change.

    Parameters
    ----------
    names : tuple of str
        As the user gave them.
    shared, own : mapping
        For each number that changes, by its place, what it changes by in each direction: shape
        (directions,), or (elements, directions).
    y : ndarray, shape (m, directions)
        Change of the initial state.
    scales : ndarray, shape (directions,)
        How much a number changes at most, for tolerances.
    """

    names: tuple[str, ...]
    shared: dict[int, FloatArray]
    own: dict[int, FloatArray]
    y: FloatArray
    scales: FloatArray

    @cached_property
    def places(self) -> ActiveNumbers:
        """Which numbers change."""
        return ActiveNumbers(frozenset(self.shared), frozenset(self.own))

    @cached_property
    def moves(self) -> FloatArray:
        """What the state changes by, then each shared number, then those of the elements."""
        rows = [self.y, *(row[None] for row in self.shared.values()), *self.own.values()]
        return np.concatenate(rows)

    @property
    def count(self) -> int:
        """Number of directions."""
        return len(self.names)


def directions_of(
    what: Mounted, program: Program, y: list[float], names: Iterable[str]
) -> Directions:
    """Return directions by the names of numbers, as in a sweep, and ``initial.v``."""
    try:
        given = (names,) if isinstance(names, str) else tuple(names)
        hash(given)
    except TypeError:
        raise ParameterError(
            "it must be names, for example ('F_s', 'initial.v')",
            place="sensitivities",
            value=names,
        ) from None
    if not given:
        raise ParameterError("it names nothing", place="sensitivities", value=names)
    if len({*given}) < len(given):
        raise ParameterError("a name stands there twice", place="sensitivities", value=given)
    shared, own, numbers = program.plan.names.shared, program.plan.names.own, numbers_of(what)
    start = np.zeros((len(y), len(given)))
    changes: dict[int, np.ndarray] = {}
    rows: dict[int, np.ndarray] = {}
    for c, name in enumerate(given):
        if isinstance(name, str) and name.startswith(INITIAL):
            places = initial_places(program, name, "sensitivities")
            start[places, c] = 1.0
            continue
        number = number_in(numbers, name)
        label = label_in(what, number.whole)
        place = shared.index(label) if label in shared else -1
        read = f"shared[{place}]" in program.source
        if label not in (*shared, *own) or (number.value == 0.0 and place >= 0 and not read):
            raise ParameterError(
                f"with this value {name!r} is a part of the program's text, not one of its numbers",
                place="sensitivities",
                value=name,
                advice="leave it out, or give it another value",
            )
        if place >= 0:
            row = changes.setdefault(place, np.zeros(len(given)))
            row[c] = 1.0
            continue
        k = own.index(label)
        table = rows.setdefault(k, np.zeros((len(program.p[1][k]), len(given))))
        table[slice(None) if number.element is None else number.element, c] = 1.0
    made = Directions(given, changes, rows, start, np.ones(len(given)))
    return replace(made, scales=scales_of(made, program.p, y))


def scales_of(directions: Directions, p: Any, y: Any) -> FloatArray:
    """Return how large what changes in each direction is; 1 if it is 0."""
    shared, own, _ = p
    values = [y, [shared[k] for k in directions.shared]]
    values += [own[k][: len(rows)] for k, rows in directions.own.items()]
    scales: FloatArray = np.abs(directions.moves * np.concatenate(values)[:, None]).max(
        axis=0, initial=0.0
    )
    scales[scales == 0.0] = 1.0
    return scales


def initial_places(program: Program, name: str, place: str) -> list[int]:
    """Return the places of an initial value, such as ``initial.z2``, in the state vector."""
    layout, plain = program.layout, name.removeprefix(INITIAL)
    known: dict[str, list[int]] = {}
    for key, here in layout.keys.items():
        places = [*layout.y.all_of(here)]
        known[key] = places
        if here in layout.y.own:
            known |= {column_name(key, i): [k] for i, k in enumerate(places)}
    if plain not in known:
        raise unknown("initial value", plain, known, place=place)
    return known[plain]
