"""Which numbers a run can be repeated with, without making its system anew, and where they are."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import TINY, Bound, fixed_bounds, relative_bounds
from gms_fsm.foundation.arguments import unknown
from gms_fsm.gradients.directions import Directions
from gms_fsm.language import Name, Value, names_in
from gms_fsm.run.problem import Problem
from gms_fsm.run.repeated.block import Place, RepeatedRun
from gms_fsm.systems import rigs
from gms_fsm.systems.given import is_positive
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import joined, known_in, label_in, numbers_of, varied
from gms_fsm.systems.reading.values import CURVE
from gms_fsm.systems.reading.values import numbers_of as values_of_system
from gms_fsm.systems.signals import Function
from gms_fsm.systems.springs import field_of

MOST_SPARE = 4  # runs that wait to be repeated
POSITIVE = fixed_bounds(f"> {TINY}")
EXACT = 2**53  # whole numbers that are floats


def with_given(what: Mounted, given: Mapping[str, Any]) -> Mounted:
    """Return the same with other numbers, whole parameters or those of single elements."""
    whole, parts = known_in(what), dict[str, Any]()
    single = {} if {*given} <= {*whole} else numbers_of(what)
    for name, value in given.items():
        if name in whole:
            parts[name] = value
        elif name in single:
            one = single[name]
            parts |= joined(varied(what, parts), [(one.whole, one.element, value)])
        else:
            raise unknown("number", name, {**whole, **single})
    return varied(what, parts)


def problem_with(start: Problem, given: Mapping[str, Any]) -> Problem:
    """Return a problem with other numbers; a `ParameterError` if one breaks its rule."""
    return start.with_numbers(with_given(start.what, given)) if given else start


# --------------------------------------------------------------------------- numbers in a block
@dataclass(frozen=True, eq=False)
class KnownNumber:
    """A number whose rules can be checked in the block, without making the system anew."""

    place: Place  # where it is
    n: int  # number of elements that may differ; 0 if there is one for all
    bounds: tuple[Bound, ...]  # those of its rule that are numbers
    pairs: list[tuple[Place, int, Place]]  # which must be above (1) or below (-1) others
    inertias: tuple[Value, ...] = ()  # those of bodies that read it
    nonzero: bool = False  # whether 0 is another program

    def takes(self, value: Any) -> bool:
        """Return whether a value fulfils the rule, as far as numbers alone decide."""
        if isinstance(value, int) and abs(value) > EXACT:
            return False
        if not isinstance(value, float | int):
            if not (isinstance(value, np.ndarray) and value.dtype == float):
                return False
            each = self.n > 0 and value.shape == (self.n,)
            if not (each or value.shape == ()) or not np.isfinite(value).all():
                return False
            return all(bound.holds(value, bound.limit).all() for bound in self.bounds)
        if self.nonzero and value == 0.0:
            return False
        return math.isfinite(value) and all(u.holds(value, u.limit) for u in self.bounds)

    def takes_each(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return for each run whether its values fulfil the rule, as far as numbers decide."""
        good: NDArray[np.bool_] = np.isfinite(values)
        for bound in self.bounds:
            good &= bound.holds(values, bound.limit)
        if self.nonzero:
            good &= values != 0.0
        each: NDArray[np.bool_] = np.all(good.reshape(len(values), -1), axis=1)
        return each

    def fits(self, run: RepeatedRun) -> bool:
        """Return whether it is certain that it fits the other numbers."""
        for one, side, other in self.pairs:
            apart = side * (run.value(one) - run.value(other))
            if not (apart > 0.0 if isinstance(apart, float) else (apart > 0.0).all()):
                return False
        return True


class NumberCells(NamedTuple):
    """The numbers of many runs, one by one."""

    certain: NDArray[np.bool_]  # which runs need no further check
    places: list[Place]
    values: NDArray[np.float64]  # (runs, places)


class RepeatedRuns:
    """Runs that wait to be repeated, and where the numbers are in them."""

    def __init__(self, start: Problem, wanted: Directions | None = None) -> None:
        self.start, self.wanted, self.repeatable = start, wanted, is_repeatable(start)
        self.spare = list[RepeatedRun]()

    @functools.cached_property
    def known(self) -> dict[str, KnownNumber] | None:
        """The numbers that can be put into a block; None if no run can be repeated."""
        return known_numbers(self.start) if self.repeatable else None

    def run(self, given: Mapping[str, Any]) -> RepeatedRun | None:
        """Return a run with these numbers at its end; None if it cannot be a repeated one."""
        known = self.known
        if known is None:
            return None
        puts, found = list[tuple[Place, Any]](), list[KnownNumber]()
        for name, value in given.items():
            one = known.get(name)
            if one is None or not one.takes(value):
                return None
            puts.append((one.place, value))
            found.append(one)
        run = self.waiting()
        run.put(puts)
        if all(one.fits(run) for one in found) and self._move(given, found):
            run.follow()
            if run.run(lambda: problem_with(self.start, given)):
                return run
        self.take_back(run)
        return None

    def waiting(self) -> RepeatedRun:
        """Return a run that nobody else has."""
        try:
            return self.spare.pop()
        except IndexError:
            return RepeatedRun(self.start, wanted=self.wanted)

    def cells(self, given: Mapping[str, NDArray[np.float64]]) -> NumberCells | None:
        """Return the numbers of many runs, shapes as for a sweep; None if some cannot be put."""
        known = self.known
        if known is None or not {*given} <= {*known}:
            return None
        found = {name: known[name] for name in given}
        runs = len(next(iter(given.values())))
        certain = np.ones(runs, dtype=bool)
        places, columns = list[Place](), list[NDArray[np.float64]]()
        for name, one in found.items():
            certain &= one.takes_each(given[name])
            parts = [one.place._replace(element=i) for i in range(one.n)] or [one.place]
            places += parts
            columns.extend(np.broadcast_to(given[name].T, (len(parts), runs)))
        at = {one.place: given[name].reshape(runs, -1) for name, one in found.items()}
        for one in found.values():
            for above, side, below in one.pairs:
                apart = at.get(above, self._now(above)) - at.get(below, self._now(below))
                certain &= (side * apart > 0.0).all(axis=1)
        if any(one.inertias for one in found.values()):
            for run in np.flatnonzero(certain).tolist():
                row = {name: values[run] for name, values in given.items()}
                certain[run] = self._move(row, [*found.values()])
        return NumberCells(certain, places, np.ascontiguousarray(np.stack(columns, axis=1)))

    def _now(self, place: Place) -> NDArray[np.float64]:
        """Return the number of the start, or those of its elements, as of one run."""
        shared, own, _ = self.start.program.p
        return np.atleast_2d(own[place.row] if place.own else [shared[place.row]])

    def take_back(self, run: RepeatedRun) -> None:
        """Keep a run that has been read."""
        if len(self.spare) < MOST_SPARE:
            self.spare.append(run)

    def _move(self, given: Mapping[str, Any], found: list[KnownNumber]) -> bool:
        """Return whether all bodies still have inertias that are positive."""
        inertias = [tree for one in found for tree in one.inertias]
        if not inertias:
            return True
        system = self.start.system
        numbers = dict(system.numbers)
        numbers |= {label_in(self.start.what, name): value for name, value in given.items()}
        return all(is_positive(tree, numbers) for tree in inertias)


def is_repeatable(start: Problem) -> bool:
    """Return whether another run differs in nothing but what is in its block."""
    system, program = start.system, start.program
    if start.chosen.engine != "compiled" or program.plan.steps or start.last < start.t_end:
        return False
    if any(isinstance(each, Function) for each in system.signals.values()):
        return False
    # Of inputs a run does not look ahead for the scale of a motion that has none of its own.
    if system.inputs and min(start.options.atol, default=1.0) == 0.0:
        return False
    states = zip(system.machines, program.layout.banks, strict=True)
    locked = any(
        contact.chart.states[k].locked
        for contact, bank in states
        for k in start.mode[bank.elements]
    )
    # Whatever the ratios, a lock of bodies at rest has no velocity.
    place = program.layout.y.index
    rest = all(not body.driven and start.y[place(body.v)] == 0.0 for body in system.bodies)
    return rest or not locked


def known_numbers(start: Problem) -> dict[str, KnownNumber]:
    """Return the numbers that a repeated run can have, by name."""
    what, system, names = start.what, start.system, known_in(start.what)
    shared, own = values_of_system(system)
    places = {label: Place(k, own=False) for k, label in enumerate(shared)}
    places |= {label: Place(k, own=True) for k, label in enumerate(own)}
    careful, inertias = _careful(what), system.assembly.inertias.values() if what.named else ()
    found: dict[str, KnownNumber] = {}
    for name, (parameter, n) in names.items():
        label = label_in(what, name)
        # An exponent of 2 is another program.
        if label in places and label not in careful and not label.endswith(f"{CURVE}delta"):
            mass = POSITIVE if Name(label) in inertias else ()
            found[name] = KnownNumber(
                places[label],
                n,
                (*fixed_bounds(parameter.rule), *mass),
                [],
                tuple(u for u in inertias if label in names_in(u) and u != Name(label)),
                nonzero=label in system.numbers,
            )
    for name, (parameter, _) in names.items():
        for bound in relative_bounds(parameter.rule):
            other = f"{name.removesuffix(parameter.name)}{bound.limit}"
            if {name, other} <= {*found}:
                side = 1 if bound.op[0] == ">" else -1
                pair = found[name].place, side, found[other].place
                found[name].pairs.append(pair)
                found[other].pairs.append(pair)
            else:
                found.pop(name, None)
                found.pop(other, None)
    for name, one in numbers_of(what).items():
        if one.element is not None and one.whole in found and name not in names:
            whole = found[one.whole]
            found[name] = replace(whole, place=whole.place._replace(element=one.element), n=0)
    return found


def _careful(what: Mounted) -> set[str]:
    """Return the numbers with which a system must be checked as a whole, by their labels."""
    system = what.system
    found = {name for name, value in system.numbers.items() if value == 0.0}  # another program
    if not what.named:
        own = type(what.rig).__module__ != rigs.__name__  # it may have checks of its own
        return found | {*system.numbers} if own else found
    fields = [field_of(system, i, name) for i in range(len(system.springs)) for name in ("k", "d")]
    locks = [
        ratio
        for bank in system.assembly.banks
        if all(state.locked for state in bank.chart.states)
        for row in bank.jacobian
        for ratio in row.values()
    ]
    return found.union(*map(names_in, (*fields, *locks)))
