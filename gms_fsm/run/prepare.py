"""prepare(): a run made ready, to be repeated with other numbers in microseconds."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import Bound, bounds_of
from gms_fsm.foundation.arguments import later, refusing, unknown
from gms_fsm.language import Value, names_in
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording.compiled_run import CompiledRun
from gms_fsm.run.recording.repeated import Place, RepeatedRun
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.run.simulate import Run
from gms_fsm.systems import rigs
from gms_fsm.systems.given import is_positive
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted, arguments_of, mounted
from gms_fsm.systems.numbers import joined, known_in, label_in, numbers_of, varied
from gms_fsm.systems.reading.values import numbers_of as values_of_system
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Function
from gms_fsm.systems.springs import field_of
from gms_fsm.systems.system import System
from gms_fsm.traces.trace import Trace

__all__ = ["Prepared", "RunEnd", "prepare"]

MOST_SPARE = 4  # runs that wait to be repeated


class RunEnd(NamedTuple):
    """How a run ended.

    Parameters
    ----------
    t : float
        s.
    y : tuple of float
        The state; `Prepared.names` has the names of its components.
    states : tuple of str
        Active state of each element, of a system contact after contact.
    transitions : int
        How often an edge fired.
    """

    t: float
    y: tuple[float, ...]
    states: tuple[str, ...]
    transitions: int


@refusing(rig="prepare(model, rig, t_end), or prepare(system, t_end)")
def prepare(
    model: Model | System,
    rig: Rig | float,
    t_end: float | None = None,
    *,
    t_start: float = 0.0,
    initial: Mapping[str, Any] | None = None,
    settings: Settings | None = None,
    **options: Unpack[SettingOptions],
) -> Prepared:
    """Make a run ready that will be repeated with other numbers; ``prepare(system, t_end)``.

    Parameters
    ----------
    model, rig, t_end, t_start, initial
        As in `simulate`.
    settings : Settings, optional
        How to integrate and what to record; if omitted, ``engine="compiled"``, which needs the
        extra ``fast``.
    **options
        Fields of `Settings` by name, which override those of `settings`.

    Returns
    -------
    Prepared
        To be called with numbers by name.

    Raises
    ------
    ParameterError
        If an argument violates its rule.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, PulledSlider
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> pulled = prepare(model, PulledSlider(1.0, 2.0, 0.1), 20.0, engine="machines")
    >>> [len(pulled(F_s=F_s).transitions) for F_s in (1.2, 1.8)]
    [12, 4]
    >>> pulled.end({"F_s": 1.2, "k2": 3.0}).states[0]
    'slip'
    """
    if settings is None:
        options = {"engine": "compiled", **options}
    chosen = Settings.of(settings, "prepare", **options)
    on, end = arguments_of("prepare", model, rig, t_end)
    what = mounted(model, on, chosen.held_period)
    start = Problem.on(what, end, chosen, t_start=t_start, initial=initial)
    return Prepared(start)


@dataclass(frozen=True, eq=False, repr=False)
class Prepared:
    """A run with everything done that does not depend on its numbers; `prepare` makes it.

    Call it with numbers by name, as `sweep` names them and ``k2`` for one element, in a mapping or
    as keywords; what is not given is as at the beginning. What follows from the numbers, such as
    tolerances and initial values of charts, is computed anew. Results have the bits of `simulate`.

    Parameters
    ----------
    start : Problem
        The run with its first numbers.
    """

    start: Problem

    def __repr__(self) -> str:
        return f"<Prepared: {self.start.what.title}, {self.start.t_end:g} s>"

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the components of `RunEnd.y`; that of a variable stands once per element."""
        layout = self.start.program.layout
        return tuple(layout.label(name) for name, _ in layout.y)

    def __call__(self, numbers: Mapping[str, ArrayLike] | None = None, /, **more: Any) -> Trace:
        """Run with these numbers.

        Parameters
        ----------
        numbers : mapping of str to float or array_like of shape (n,), optional
            By name: ``{"gear.F_s": 1.2}``.
        **more
            Further ones, whose names allow it: ``F_s=1.2``.

        Returns
        -------
        Trace
            As from `simulate`. Rows and log are copied at once, all else is made when it is read.

        Raises
        ------
        ParameterError
            If there is no such number, or its rule is violated.
        SimulationError
            As from `simulate`.
        """
        given = {**numbers, **more} if numbers else more
        run = self._all.run(given)
        if run is None:
            return self._alone(given, self.start.chosen)
        contents = run.taken()
        self._all.take_back(run)
        initial = self.start.initial
        made: Trace = later(Trace, lambda: self._with(given).trace(*contents()), initial=initial)
        return made

    def end(self, numbers: Mapping[str, ArrayLike] | None = None, /, **more: Any) -> RunEnd:
        """Run with these numbers, and return only how it ended.

        Parameters
        ----------
        numbers, **more
            As for a call.

        Returns
        -------
        RunEnd
            Time, state, active states, and how often an edge fired.

        Raises
        ------
        ParameterError, SimulationError
            As for a call.
        """
        given = {**numbers, **more} if numbers else more
        run = self._ends.run(given)
        if run is None:
            trace = self._alone(given, self._ends.start.chosen)
            rows, count = trace.rows, len(trace.firings)
            return self._end(float(rows.t[-1]), rows.y[-1].tolist(), rows.mode[-1].tolist(), count)
        b: Any = run.columns.buffers
        found = self._end(b.now.t, b.now.y.tolist(), b.now.mode.tolist(), run.columns.log.firings)
        self._ends.take_back(run)
        return found

    # ------------------------------------------------------------------ parts
    def _end(self, t: float, y: list[float], mode: list[int], transitions: int) -> RunEnd:
        states = tuple(names[k] for names, k in zip(self._states, mode, strict=False))
        return RunEnd(t, tuple(y), states, transitions)

    @functools.cached_property
    def _states(self) -> list[list[str]]:
        """The names of the states of each element."""
        return [
            [state.name for state in contact.chart.states]
            for contact in self.start.system.machines
            for _ in range(contact.n)
        ]

    @functools.cached_property
    def _all(self) -> _Runs:
        return _Runs(self.start)

    @functools.cached_property
    def _ends(self) -> _Runs:
        chosen = replace(self.start.chosen, output="end", t_eval=None)
        return _Runs(self._again(self.start.what, chosen))

    def _again(self, what: Mounted, chosen: Settings) -> Problem:
        start = self.start
        return Problem.on(what, start.t_end, chosen, t_start=start.t_start, initial=start.initial)

    def _with(self, given: Mapping[str, Any]) -> Problem:
        """Return the problem with other numbers; a `ParameterError` if one breaks its rule."""
        return self.start.with_numbers(_varied(self.start.what, given))

    def _alone(self, given: Mapping[str, Any], chosen: Settings) -> Trace:
        """Run as `simulate` does, from new: numbers that change the program, and errors."""
        start = self._again(_varied(self.start.what, given), chosen)
        run = CompiledRun(start) if chosen.engine == "compiled" else Run(start)
        while run.advance():
            pass
        return run.recorder.trace()


def _varied(what: Mounted, given: Mapping[str, Any]) -> Mounted:
    """Return the same with other numbers, whole parameters or those of single elements."""
    whole, single = known_in(what), numbers_of(what)
    parts: dict[str, Any] = {}
    for name, value in given.items():
        if name in whole:
            parts[name] = value
        elif name in single:
            one = single[name]
            parts |= joined(varied(what, parts), [(one.whole, one.element, value)])
        else:
            raise unknown("number", name, {**whole, **single})
    return varied(what, parts)


# --------------------------------------------------------------------------- numbers in a block
@dataclass(frozen=True, eq=False)
class _Known:
    """A number whose rules can be checked in the block, without making the system anew.

    Parameters
    ----------
    place : Place
        Where it is.
    n : int
        Number of elements that may differ; 0 if there is one for all.
    bounds : tuple of Bound
        Those of its rule that are numbers.
    pairs : list of (Place, int, Place)
        Which numbers must be above others, this one among them: 1, or below: -1.
    inertias : tuple of Value
        Those of bodies that read it.
    nonzero : bool
        Whether 0 is another program.
    """

    place: Place
    n: int
    bounds: tuple[Bound, ...]
    pairs: list[tuple[Place, int, Place]]
    inertias: tuple[Value, ...] = ()
    nonzero: bool = False

    def takes(self, value: Any) -> bool:
        """Return whether a value fulfils the rule, as far as numbers alone decide."""
        if not isinstance(value, float | int):
            if not (isinstance(value, np.ndarray) and value.dtype == float):
                return False
            if value.shape not in ((), (self.n,)) or not np.isfinite(value).all():
                return False
            return all(bound.holds(value, bound.limit).all() for bound in self.bounds)
        if self.nonzero and value == 0.0:
            return False
        return math.isfinite(value) and all(u.holds(value, u.limit) for u in self.bounds)

    def fits(self, run: RepeatedRun) -> bool:
        """Return whether it is certain that it fits the other numbers."""
        for one, side, other in self.pairs:
            apart = side * (run.value(one) - run.value(other))
            if not (apart > 0.0 if isinstance(apart, float) else (apart > 0.0).all()):
                return False
        return True


class _Runs:
    """Runs that wait to be repeated, and where the numbers are in them."""

    def __init__(self, start: Problem) -> None:
        self.start = start
        self.known = _known(start) if _is_repeatable(start) else None
        self.spare = list[RepeatedRun]()

    def run(self, given: Mapping[str, Any]) -> RepeatedRun | None:
        """Return a run with these numbers at its end; None if it cannot be a repeated one."""
        known = self.known
        if known is None:
            return None
        puts, found = list[tuple[Place, Any]](), list[_Known]()
        for name, value in given.items():
            one = known.get(name)
            if one is None or not one.takes(value):
                return None
            puts.append((one.place, value))
            found.append(one)
        try:
            run = self.spare.pop()
        except IndexError:
            run = RepeatedRun(self.start)
        run.put(puts)
        if all(one.fits(run) for one in found) and self._move(given, found):
            run.follow()
            if run.run(lambda: self._with(given)):
                return run
        self.take_back(run)
        return None

    def take_back(self, run: RepeatedRun) -> None:
        """Keep a run that has been read."""
        if len(self.spare) < MOST_SPARE:
            self.spare.append(run)

    def _move(self, given: Mapping[str, Any], found: list[_Known]) -> bool:
        """Return whether all bodies still have inertias that are positive."""
        inertias = [tree for one in found for tree in one.inertias]
        if not inertias:
            return True
        system = self.start.system
        numbers = dict(system.numbers)
        numbers |= {label_in(self.start.what, name): value for name, value in given.items()}
        return all(is_positive(tree, numbers) for tree in inertias)

    def _with(self, given: Mapping[str, Any]) -> Problem:
        return self.start.with_numbers(_varied(self.start.what, given))


def _is_repeatable(start: Problem) -> bool:
    """Return whether another run differs in nothing but what is in its block."""
    system, program = start.system, start.program
    if start.chosen.engine != "compiled" or program.plan.steps or start.last < start.t_end:
        return False
    if any(isinstance(each, Function) for each in system.signals.values()):
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


def _known(start: Problem) -> dict[str, _Known]:
    """Return the numbers that a repeated run can have, by name."""
    what, system, names = start.what, start.system, known_in(start.what)
    shared, own = values_of_system(system)
    places = {label: Place(k, own=False) for k, label in enumerate(shared)}
    places |= {label: Place(k, own=True) for k, label in enumerate(own)}
    careful, inertias = _careful(what), system.assembly.inertias.values() if what.named else ()
    found: dict[str, _Known] = {}
    for name, (parameter, n) in names.items():
        label = label_in(what, name)
        if label in places and label not in careful:
            found[name] = _Known(
                places[label],
                n,
                tuple(u for u in bounds_of(parameter.rule) if not isinstance(u.limit, str)),
                [],
                tuple(tree for tree in inertias if label in names_in(tree)),
                nonzero=label in system.numbers,
            )
    for name, (parameter, _) in names.items():
        for bound in bounds_of(parameter.rule):
            if isinstance(bound.limit, str):
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
        if one.element is not None and one.whole in found:
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
