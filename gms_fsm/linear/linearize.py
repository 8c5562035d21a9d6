"""A run at one instant as a linear system."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind, refusing, unknown
from gms_fsm.gradients.directions import Directions
from gms_fsm.gradients.linear import Linear
from gms_fsm.language import evaluate, parse_value
from gms_fsm.lowering.observing import armed
from gms_fsm.lowering.program import Program, lower
from gms_fsm.systems.given import several
from gms_fsm.systems.numbers import column_name
from gms_fsm.systems.reading.values import numbers_of
from gms_fsm.systems.signals import Corners, Formula, Function
from gms_fsm.systems.system import System
from gms_fsm.traces.between import between
from gms_fsm.traces.rows import merged
from gms_fsm.traces.trace import Trace

__all__ = ["LinearSystem", "linearize"]

EXACT = 1e-12  # of a row: what is left of it is rounding


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """A linear system ``dx/dt = A x + B u``, ``y = C x + D u`` of deviations from an instant.

    Iteration gives A, B, C, D: ``scipy.signal.StateSpace(*linear)``.

    Parameters
    ----------
    A, B, C, D : ndarray
        The matrices.
    states, inputs, outputs : tuple of str
        What the rows and columns are called.
    units : mapping of str to str
        Units of states and outputs, where they are known.
    pattern : mapping of str to tuple of str
        For each contact the states of its elements, which are frozen.
    t : float
        s: the instant.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    units: dict[str, str]
    pattern: dict[str, tuple[str, ...]]
    t: float

    def __iter__(self) -> Iterator[FloatArray]:
        return iter((self.A, self.B, self.C, self.D))

    @property
    def poles(self) -> Any:
        """The eigenvalues of A, 1/s."""
        return np.linalg.eigvals(self.A)


@refusing()
def linearize(trace: Trace, t: float, *, inputs: str | Sequence[str] | None = None) -> LinearSystem:
    """Return a run at one instant as a linear system, with the states of all elements as they are.

    The derivatives are exact: those of the texts that run, not differences. What a lock holds, and
    deflections that only repeat a position, such as those of sticking elements, are expressed by
    the other states and left out. Sampled values are held, so they are inputs, not states.

    Parameters
    ----------
    trace : Trace
        The run; all its contacts count.
    t : float
        s: the instant. Between rows the state is interpolated; at a switch it is that after it.
    inputs : str or sequence of str, optional
        Names of signals, sampled values and numbers of the system. By default all signals and
        sampled values that act on a state or on an output.

    Returns
    -------
    LinearSystem
        Its outputs are positions, velocities, further states and the forces of the contacts.

    Raises
    ------
    ParameterError
        If t is outside the run, an input is unknown, a contact has a period, or the motion slides
        between two states of a chart.

    Notes
    -----
    At a corner of a text the derivative is that on the side of the instant. An input that gives a
    body its velocity acts with its value only, not with its own derivative.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Slider, simulate
    >>> model = GMS(GMSParameters.paper("non-drifting"), law="signed")
    >>> linear = linearize(simulate(model, Slider(1.0, "0.1*t"), 1.0), 1.0)
    >>> linear.states, linear.inputs, linear.A.round(2).tolist(), linear.B.tolist()
    (('x', 'v'), ('F_a',), [[0.0, 1.0], [-111.1, -16.1]], [[0.0], [1.0]])
    """
    checked_kind("trace", trace, Trace, "a trace, as simulate returns it")
    t = checked_scalar("t", t, "finite")
    y, mode = _state(trace, t)
    system = trace.what.system
    for contact in system.machines:
        if contact.period is not None:
            raise ParameterError(
                f"it has a period of {contact.period!r} s, so its force is held",
                place=f"contact {contact.name!r}",
                advice="leave the period out for this question",
            )
    known = _inputs(system)
    chosen = known if inputs is None else several(inputs, str, "inputs")
    for name in chosen:
        if name not in known and name not in system.numbers:
            raise unknown("input", name, [*known, *system.numbers], place="inputs")
    made = _Seeded.of(system, t, y, mode, chosen)
    found = made.reduced()
    if inputs is None:
        acts = np.any(found.B, axis=0) | np.any(found.D, axis=0)
        kept = [k for k in range(len(chosen)) if acts[k]]
        found = replace(
            found, B=found.B[:, kept], D=found.D[:, kept], inputs=tuple(chosen[k] for k in kept)
        )
    return found


def _state(trace: Trace, t: float) -> tuple[list[float], list[int]]:
    """Return the state vector and the modes at a time."""
    table = merged(trace.rows, trace.stops)
    if not float(table.t[0]) <= t <= float(table.t[-1]):
        raise ParameterError(
            f"the run goes from {float(table.t[0])!r} to {float(table.t[-1])!r} s",
            place="t",
            value=t,
        )
    left = np.searchsorted(table.t, [t], "right") - 1
    y = between(trace.program, table, left, np.array([t]))[0]
    return y.tolist(), table.mode[int(left[0])].tolist()


def _inputs(system: System) -> tuple[str, ...]:
    """Return what comes from outside the smooth equations: signals, then sampled values."""
    return (*system.signals, *(name for each in system.sampled for name in each.updates))


def _level(system: System, name: str) -> str:
    """Return a name that is free, for the number that a signal is at one instant."""
    while (name := f"{name}_") in system.names:
        pass
    return name


def _value(system: System, name: str, t: float) -> float:
    """Return a signal at a time."""
    match signal := system.signals[name]:
        case str():
            tree = parse_value(signal, ["t", *system.numbers])
            return float(evaluate(tree, {**system.numbers, "t": t}))
        case Formula(tree=tree):
            return float(evaluate(tree, {"t": t}))
        case Function(call=call):
            return float(call(t))
        case Corners(times=times, values=values):
            at = np.searchsorted(times, t, "right") - 1
            past = at + 1 >= times.size or times[at] == t  # after a jump, and where it is held
            return float(values[at] if past and at >= 0 else np.interp(t, times, values))
    raise AssertionError(signal)


@dataclass(frozen=True, eq=False)
class _Seeded:
    """The rates and outputs at an instant, with their derivatives by y and by the inputs."""

    system: System
    program: Program
    t: float
    mode: list[int]
    chosen: tuple[str, ...]
    y: FloatArray  # what determines y: locked velocities follow from others
    dy: FloatArray
    seen: FloatArray

    @classmethod
    def of(
        cls, given: System, t: float, y: list[float], mode: list[int], chosen: tuple[str, ...]
    ) -> _Seeded:
        """Differentiate the rates and outputs by the state and by the inputs."""
        level = {name: _level(given, name) for name in given.signals}
        system = replace(
            given,
            signals=dict(level),
            numbers={**given.numbers, **dict.fromkeys(level.values(), 1.0)},
        )
        program = lower(system)
        names, places = [*numbers_of(system)[0]], program.layout.y
        for name, number in level.items():
            program.p[0][names.index(number)] = _value(given, name, t)
        size, seeds = places.size, places.size + len(chosen)
        start, moved = np.eye(size, seeds), {}
        for j, name in enumerate(chosen, size):
            number = level.get(name, name)
            if number in system.numbers:
                moved[names.index(number)] = np.eye(seeds)[j]
            else:
                start[places.index(name)] = np.eye(seeds)[j]
        seeded = (*map(str, range(size)), *chosen)
        linear = Linear(program, Directions(seeded, moved, {}, start, np.ones(seeds)))
        still, point, signs = np.zeros(seeds), list(y), armed(program, t, y, mode)
        _, fixed = linear.call("follow", (t, point, mode, signs, program.p), still, start)
        _, dy = linear.flow(t, point, mode, signs, still, fixed)
        seen = linear.observe(t, point, mode, fixed)
        active = np.flatnonzero(mode[program.layout.slides]).tolist()
        if active:
            if min(program.surfaces.sign[c] for c in active) < 0:
                raise ParameterError(
                    "the motion slides between two states of a chart",
                    place="t",
                    value=t,
                    advice="choose an instant at which it does not",
                )
            # What lies on a surface, as what a lock holds, is one state less for each.
            n = linear.along(t, point, mode, signs, still, fixed).N
            place = [int(np.argmax(np.abs(row))) for row in n]
            onto = np.eye(size)
            onto[place] = 0.0
            onto[place] = -np.linalg.solve(n[:, place], n @ onto)
            fixed = onto @ fixed
            dy, seen = (_through(each, fixed, size) for each in (dy, seen))
        return cls(system, program, t, mode, chosen, fixed, dy, seen)

    # ------------------------------------------------------------------ what is left out
    def reduced(self) -> LinearSystem:
        """Return the matrices over states that do not repeat each other."""
        layout, system = self.program.layout, self.system
        size, more = layout.y.size, len(self.chosen)
        full = self._held_positions()
        own = {bank.of(name) for bank in layout.banks for name in bank.variables}
        places = [(name, i) for name, i in layout.y]
        moving = [*(b.x for b in system.bodies), *(b.v for b in system.bodies if not b.driven)]
        named = {*moving, *system.flow, *own}
        candidates = [k for k, (name, _) in enumerate(places) if name in named]
        free = [k for k in candidates if full[k, k] == 1.0 and np.count_nonzero(full[k]) == 1]
        rates = _through(self.dy, full, size)
        lasting = {*system.flow, *(body.v for body in system.bodies)}
        kept = [k for k in free if places[k][0] in lasting]
        basis: list[int] = []  # positions first, so that deflections are expressed by them
        for k in sorted((k for k in free if k not in kept), key=lambda k: places[k][0] in own):
            share = _shares(rates[k], rates[basis])
            if share is None or (places[k][0] not in own and np.any(rates[k])):
                basis.append(k)
            else:
                full[k] = share @ full[basis]
        kept = sorted(kept + basis)
        rates, seen = (_through(each, full, size) for each in (self.dy, self.seen))
        columns = [*kept, *range(size, size + more)]
        labels = {k: self._label(*places[k]) for k in candidates}
        outputs = self._outputs(full, seen)
        rows = np.array([row for _, _, row in outputs]).reshape(-1, size + more)
        units = {self._label(*places[k]): self._unit(places[k][0]) for k in kept}
        units |= {name: unit for name, unit, _ in outputs}
        A_B, C_D = rates[np.ix_(kept, columns)], rows[:, columns]
        size = len(kept)
        return LinearSystem(
            A=A_B[:, :size],
            B=A_B[:, size:],
            C=C_D[:, :size],
            D=C_D[:, size:],
            states=tuple(labels[k] for k in kept),
            inputs=self.chosen,
            outputs=tuple(name for name, _, _ in outputs),
            units={name: unit for name, unit in units.items() if unit},
            pattern={
                bank.name: tuple(
                    system.contact(bank.name).chart.states[i].name for i in self.mode[bank.elements]
                )
                for bank in layout.banks
            },
            t=self.t,
        )

    def _held_positions(self) -> FloatArray:
        """Return what y is, with the positions of bodies that are held as their velocities are."""
        full = np.array(self.y)
        at, size = self.program.layout.y.index, self.program.layout.y.size
        bodies = [body for body in self.system.bodies if not body.driven]
        for body in bodies:
            row = self.y[at(body.v)]
            unit = np.zeros_like(row)
            unit[at(body.v)] = 1.0
            if not np.array_equal(row, unit) and not np.any(row[size:]):
                full[at(body.x)] = 0.0
                for other in bodies:
                    full[at(body.x), at(other.x)] = row[at(other.v)]
        return full

    def _label(self, name: str, element: int | None) -> str:
        label = self.program.layout.label(name)
        n = 1 if element is None else len(self.program.layout.y.all_of(name))
        return label if n == 1 or element is None else column_name(label, element)

    def _unit(self, name: str) -> str:
        for body in self.system.bodies:
            if name in (body.x, body.v):
                return body.unit if name == body.x else f"{body.unit}/s"
        owner, _, own = name.rpartition(".")
        return self.system.contact(owner).chart.unit(own) if owner else ""

    def _outputs(self, full: FloatArray, seen: FloatArray) -> list[tuple[str, str, FloatArray]]:
        """Return name, unit and row of each output."""
        layout, system = self.program.layout, self.system
        moved = [u for body in system.bodies if not body.driven for u in (body.x, body.v)]
        found = [
            (name, self._unit(name), full[layout.y.index(name)]) for name in (*moved, *system.flow)
        ]
        for contact in system.contacts:
            for force in contact.chart.force_names:
                name = f"{contact.name}.{force}"
                unit = contact.chart.unit(force) or "N"
                found.append((layout.label(name), unit, seen[layout.observed.index(name)]))
        return found


def _through(rows: FloatArray, full: FloatArray, size: int) -> FloatArray:
    """Return derivatives with y replaced by what determines it; those by inputs are added."""
    found: FloatArray = rows[:, :size] @ full
    found[:, size:] += rows[:, size:]
    return found


def _shares(row: FloatArray, others: FloatArray) -> FloatArray | None:
    """Return how a row consists of others; None if it does not."""
    if not np.any(row):
        return np.zeros(len(others))
    if not len(others):
        return None
    shares: Any = np.linalg.lstsq(others.T, row, rcond=None)[0]
    left = np.abs(shares @ others - row).max()
    if left > EXACT * np.abs(row).max():
        return None
    found: FloatArray = np.where(np.abs(shares) < EXACT * np.abs(shares).max(), 0.0, shares)
    return found
