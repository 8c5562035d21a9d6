"""The frictions of many joints, advanced together by somebody else's loop."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm._arguments import listed
from gms_fsm.charts.parameters import FloatArray, checked_array, checked_scalar
from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.run._joint import (
    Alone,
    Asked,
    Joint,
    Last,
    Switch,
    check_inputs,
    content_of,
    later,
    line_of,
    made_again,
    numbers_of,
    stepper_kind,
    too_late,
    too_short,
)
from gms_fsm.run._steppable import start_of
from gms_fsm.run._stepper import Machine, Plain, Stepper, machine_code
from gms_fsm.run.start import LATEST, Start
from gms_fsm.run.stepping import Snapshot
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

__all__ = ["FrictionBank"]


class FrictionBank:
    """The frictions of m joints, as `FrictionState` does it for one.

    Joints whose models differ in numbers only are advanced by one call of machine code. One thread
    at a time may call it, as with `FrictionState`.

    Parameters
    ----------
    models : sequence of Model or Contact
        One per joint.
    t : float
        s: the beginning.
    initial : mapping or sequence of mapping, optional
        As for `FrictionState`, for all joints or one per joint.
    rtol : float
        Relative tolerance.
    engine : {"compiled", "ifelse"}, optional
        As for `FrictionState`.

    Raises
    ------
    ParameterError
        If a joint cannot be stepped, or an argument violates its rule.

    Examples
    --------
    >>> from gms_fsm import GMS, FrictionBank, GMSParameters
    >>> bank = FrictionBank([GMS(GMSParameters.paper("stick-slip"), law="signed")] * 3)
    >>> bank.advance([0.0, 0.0, 0.0], [0.02, 0.0, -0.02], 0.5).round(6)
    array([ 0.052,  0.   , -0.052])
    """

    def __init__(
        self,
        models: Iterable[Model | Contact],
        *,
        t: float = 0.0,
        initial: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
        rtol: float = 1e-6,
        engine: str | None = None,
    ) -> None:
        kind = stepper_kind(engine)
        given = listed("models", models, "a sequence of models or contacts")
        if not given:
            raise ParameterError("it has no entries", place="models", advice="give one per joint")
        firsts: list[Any] = [initial] * len(given)
        if initial is not None and not isinstance(initial, Mapping):
            firsts = listed("initial", initial, "a mapping, or one per joint")
            if len(firsts) != len(given):
                raise ParameterError(
                    f"it has {len(firsts)} entries", place="initial", advice=f"give {len(given)}"
                )
        asked = [Asked(t, first, rtol) for first in firsts]
        starts = []
        for i, each in enumerate(given):
            try:
                starts.append(start_of(each, *asked[i]))
            except GMSError as error:
                raise error.inside(f"models[{i}]") from None
        self._groups: list[_Apart | _Together] = []
        joints: dict[int, Joint] = {}
        for places in _alike(starts) if kind is Machine else [[*range(len(given))]]:
            memory = _memory(starts[places[0]], len(places)) if kind is Machine else None
            for row, i in enumerate(places):
                stepper: Stepper = (
                    Plain(starts[i])
                    if memory is None
                    else Machine(starts[i], (memory[0, row], memory[1, row]))
                )
                joints[i] = Joint(given[i], asked[i], starts[i], stepper)
            mine = [joints[i] for i in places]
            self._groups.append(
                _Apart(places, mine) if memory is None else _Together(places, mine, memory)
            )
        self._joints = [joints[i] for i in range(len(given))]
        self._inputs = sorted({name for joint in self._joints for name in joint.inputs})
        self._t = starts[0].t_start
        self._alone = Alone()
        self._last: _Sample | None = None

    def __len__(self) -> int:
        return len(self._joints)

    def __repr__(self) -> str:
        return f"<FrictionBank of {len(self)} joints at t = {self._t!r} s>"

    @property
    def inputs(self) -> tuple[str, ...]:
        """What contacts need to be given besides their velocities."""
        return tuple(self._inputs)

    # ------------------------------------------------------------------ steps
    def advance(
        self, v0: ArrayLike, v1: ArrayLike, dt: float, **inputs: tuple[ArrayLike, ArrayLike]
    ) -> FloatArray:
        """Advance all joints by a sample; see `FrictionState.advance`.

        Parameters
        ----------
        v0, v1 : array_like, shape (m,)
            m/s: at the beginning and at the end.
        dt : float
            s, >= 0.
        **inputs : (array_like, array_like)
            Further inputs of contacts at the beginning and at the end, each a number or of shape
            (m,). Joints without that input do not read it.

        Returns
        -------
        ndarray, shape (m,)
            N: the forces at the end.

        Raises
        ------
        ParameterError
            If a number is not finite, an array has another length, an input is missing, or the
            clock does not resolve dt.
        SimulationError
            If a joint cannot continue. In both cases all joints are as they were before.
        """
        time = checked_scalar("dt", dt, ">= 0")
        with self._alone:
            end = self._t + time
            if end == self._t and time > 0.0:
                raise too_short(time, end)
            return self._commit(self._checked(v0, v1, end, inputs))

    def advance_to(
        self, v0: ArrayLike, v1: ArrayLike, t: float, **inputs: tuple[ArrayLike, ArrayLike]
    ) -> FloatArray:
        """Advance all joints to a time; see `advance`.

        Parameters
        ----------
        v0, v1, **inputs
            As in `advance`.
        t : float
            s: not before the present time.

        Returns
        -------
        ndarray, shape (m,)
            N: the forces at the end.

        Raises
        ------
        ParameterError, SimulationError
            As in `advance`, or if t is before the present time.
        """
        with self._alone:
            return self._commit(self._checked(v0, v1, later(t, self._t), inputs))

    def peek(
        self, v0: ArrayLike, v1: ArrayLike, dt: float, **inputs: tuple[ArrayLike, ArrayLike]
    ) -> FloatArray:
        """Return what `advance` would return, and stay.

        Parameters
        ----------
        v0, v1, dt, **inputs
            As in `advance`. With dt = 0 these are the forces at v1, now.

        Returns
        -------
        ndarray, shape (m,)
            N: the forces at the end.

        Raises
        ------
        ParameterError, SimulationError
            As in `advance`.
        """
        time = checked_scalar("dt", dt, ">= 0")
        with self._alone:
            sample = self._checked(v0, v1, self._t + time, inputs)
            before = [group.copy() for group in self._groups]
            try:
                return self._step(sample)
            finally:
                for group, copy in zip(self._groups, before, strict=True):
                    group.take(copy)

    def _commit(self, sample: _Sample) -> FloatArray:
        for group in self._groups:
            group.keep()
        now, last = self._t, self._last
        try:
            force = self._step(sample)
            self._t, self._last = sample.t, sample
        except BaseException:  # Ctrl-C, too
            for group in self._groups:
                group.undo()
            self._t, self._last = now, last
            raise
        return force

    def _step(self, sample: _Sample) -> FloatArray:
        force = np.empty(len(self))
        for group in self._groups:
            force[group.places] = group.step(sample)
        return force

    def _checked(
        self, v0: ArrayLike, v1: ArrayLike, t: float, inputs: Mapping[str, Any]
    ) -> _Sample:
        if t > LATEST:
            raise too_late("t", t)
        if inputs or self._inputs:
            check_inputs(inputs, self._inputs)
        lines = {}
        for name, given in inputs.items():
            start, end = (
                self._row(name, np.full(len(self), u) if np.ndim(u) == 0 else u)
                for u in line_of(name, given)
            )
            lines[name] = start, end
        return _Sample(self._t, t, self._row("v0", v0), self._row("v1", v1), lines)

    def _row(self, name: str, given: ArrayLike) -> FloatArray:
        """Return a copy with one finite number per joint."""
        if type(given) is np.ndarray and given.dtype == np.float64 and given.shape == (len(self),):
            copy: FloatArray = given.copy()
            if np.isfinite(copy).all():
                return copy
        made = checked_array(name, given, None, "finite")
        if made.size != len(self):
            raise ParameterError(
                f"it has {made.size} entries", place=name, advice=f"give {len(self)}, one per joint"
            )
        return made

    # ------------------------------------------------------------------ what it found
    @property
    def t(self) -> float:
        """The present time, s."""
        return self._t

    @property
    def states(self) -> tuple[tuple[str, ...], ...]:
        """Of each joint the states of its elements."""
        return tuple(joint.states for joint in self._joints)

    @property
    def variables(self) -> tuple[dict[str, FloatArray], ...]:
        """Of each joint the chart's variables."""
        return tuple(joint.variables for joint in self._joints)

    @property
    def switches(self) -> tuple[tuple[Switch, ...], ...]:
        """Of each joint the edges taken in the last sample."""
        return tuple(joint.switches for joint in self._joints)

    @property
    def mean_force(self) -> FloatArray:
        """Of each joint the mean of its force over the last sample, N, shape (m,)."""
        with self._alone:
            return np.array([joint.mean_force for joint in self._informed()])

    @property
    def dF_dv(self) -> FloatArray:
        """How each force depends on its velocity at the last end, Ns/m, shape (m,)."""
        with self._alone:
            return np.array([joint.dF_dv for joint in self._informed()])

    def _informed(self) -> list[Joint]:
        """Return the joints; each knows the last sample, and the state before it."""
        for group in self._groups:
            group.inform()
        for i, joint in enumerate(self._joints):
            joint.t = self._t
            joint.last = None if self._last is None else self._last.of(i, joint.inputs)
        return self._joints

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make a copy: memory of machine code is not copied."""
        joints, first = self._joints, self._joints[0]
        arguments = {
            "t": first.asked.t,
            "initial": [joint.asked.initial for joint in joints],
            "rtol": first.asked.rtol,
            "engine": first.engine,
        }
        return made_again, (
            type(self),
            [joint.given for joint in joints],
            arguments,
            self.to_array(),
        )

    # ------------------------------------------------------------------ going back
    def snapshot(self) -> Snapshot:
        """Return the present state, to return to it with `restore`.

        Returns
        -------
        Snapshot
            For this bank, or another one of the same models and engine.
        """
        with self._alone:
            return Snapshot(self._t, self._identity, [group.copy() for group in self._groups])

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot.

        Parameters
        ----------
        snapshot : Snapshot
            From `snapshot`, of this bank or another one of the same models and engine.

        Raises
        ------
        ParameterError
            If it is of other models; the state stays as it was.
        """
        content = content_of(snapshot, Snapshot, self._identity)
        with self._alone:
            for group, copy in zip(self._groups, content, strict=True):
                group.take(copy)
            self._moved_to(snapshot.t)

    @functools.cached_property
    def _identity(self) -> tuple[str, str]:
        stamps, engines = zip(*(joint.identity for joint in self._joints), strict=True)
        return repr(("bank", stamps)), engines[0]

    def to_array(self) -> FloatArray:
        """Return the present state as finite numbers; see `FrictionState.to_array`.

        Returns
        -------
        ndarray, shape (k,)
            Those of the joints, one after the other.
        """
        with self._alone:
            return np.concatenate([joint.to_array() for joint in self._joints])

    def from_array(self, array: ArrayLike) -> None:
        """Return to what `to_array` returned, also of another bank of the same models.

        Parameters
        ----------
        array : array_like, shape (k,)
            All of its numbers as they were.

        Raises
        ------
        ParameterError
            If it cannot be such an array; the state stays as it was.
        """
        sizes = [joint.length for joint in self._joints]
        given = numbers_of(array, sum(sizes))
        parts = np.split(given, np.cumsum(sizes)[:-1])
        with self._alone:
            before = self.snapshot()
            try:
                for joint, part in zip(self._joints, parts, strict=True):
                    joint.from_array(part)
                if len({joint.t for joint in self._joints}) > 1:
                    raise ParameterError("its joints are at different times", place="array")
            except ParameterError:
                self.restore(before)
                raise
            self._moved_to(self._joints[0].t)

    def _moved_to(self, t: float) -> None:
        self._t, self._last = t, None
        for joint in self._joints:
            joint.moved_to(t)


class _Sample(NamedTuple):
    """A sample of all joints, one entry per joint."""

    begin: float  # s
    t: float  # s, at its end
    v0: FloatArray  # m/s, shape (m,)
    v1: FloatArray
    inputs: Mapping[str, tuple[FloatArray, FloatArray]]

    def of(self, i: int, names: Iterable[str]) -> Last:
        """Return the sample of one joint."""
        own = {name: (float(self.inputs[name][0][i]), float(self.inputs[name][1][i]))
               for name in names}  # fmt: skip
        return Last(float(self.v0[i]), float(self.v1[i]), self.t, own)


class _Apart:
    """Joints that are advanced one by one."""

    def __init__(self, places: list[int], joints: list[Joint]) -> None:
        self.places, self.joints = places, joints
        self._more: list[list[Switch]] = []

    def step(self, sample: _Sample) -> list[float]:
        """Advance, and return the forces."""
        found = []
        for i, joint in zip(self.places, self.joints, strict=True):
            joint.t = sample.begin
            try:
                found.append(joint.run(*sample.of(i, joint.inputs)))
            except GMSError as error:
                raise error.inside(f"joint {i}") from None
        return found

    def keep(self) -> None:
        """Keep the present state for `undo`."""
        self._more = [joint.more for joint in self.joints]
        for joint in self.joints:
            joint.stepper.keep()

    def undo(self) -> None:
        """Return to the state that was kept last, and keep again what was kept before it."""
        for joint, more in zip(self.joints, self._more, strict=True):
            joint.stepper.undo()
            joint.more = more

    def inform(self) -> None:
        """Give each joint the state that was kept: it has it."""

    def copy(self) -> Any:
        """Return the present state."""
        return [(joint.stepper.copy(), joint.more) for joint in self.joints]

    def take(self, copy: Any) -> None:
        """Return to what `copy` returned."""
        for joint, (each, more) in zip(self.joints, copy, strict=True):
            joint.stepper.take(each)
            joint.more = more


class _Together:
    """Joints whose blocks lie one after the other in memory."""

    def __init__(self, places: list[int], joints: list[Joint], memory: NDArray[np.int64]) -> None:
        self.places, self.joints = places, joints
        self._words, self._kept, self._before = memory
        self._floats = self._words.view(np.float64)
        first: Any = joints[0].stepper
        self._each, self._address = first.code.each, first.block.address
        place = first.code.layout.offset
        self._end, self._force = place("sample.end"), place("sample.force")
        self._resumed, self._code = place("sample.resumed"), place("sample.code")
        self._names = ("v", *joints[0].inputs)
        self._lines = [place("sample.inputs") + 2 * k for k in range(len(self._names))]
        self._entering = joints[0].enters
        self._full: list[int] = []  # rows of those with switches that did not fit into the log
        self._more: list[tuple[int, list[Switch]]] = []  # theirs, of the kept state

    def step(self, sample: _Sample) -> FloatArray:
        """Advance, and return the forces."""
        floats, words, places = self._floats, self._words, self.places
        given = {"v": (sample.v0, sample.v1), **sample.inputs}
        for name, line in zip(self._names, self._lines, strict=True):
            start, end = given[name]
            floats[:, line], floats[:, line + 1] = start[places], end[places]
        floats[:, self._end] = sample.t
        words[:, self._resumed] = 0
        if self._entering:
            for i, joint in zip(places, self.joints, strict=True):
                joint.enter(sample.of(i, joint.inputs))
        self._forget()
        if self._each(self._address, len(places)):
            for row in np.flatnonzero(words[:, self._code]).tolist():
                self.joints[row].t = sample.begin
                try:
                    self.joints[row].finish(int(words[row, self._code]))
                    self._full.append(row)
                except GMSError as error:
                    raise error.inside(f"joint {places[row]}") from None
        force: FloatArray = floats[:, self._force]
        return force

    def keep(self) -> None:
        """Keep the present state for `undo`."""
        self._before, self._kept = self._kept, self._before
        self._kept[...] = self._words
        self._more = self._not_logged()

    def undo(self) -> None:
        """Return to the state that was kept last, and keep again what was kept before it."""
        self.take((self._kept, self._more))
        self._before, self._kept = self._kept, self._before

    def inform(self) -> None:
        """Give each joint the state that was kept."""
        for joint, kept in zip(self.joints, self._kept, strict=True):
            stepper: Any = joint.stepper
            stepper.kept = kept

    def copy(self) -> Any:
        """Return the present state."""
        return self._words.copy(), self._not_logged()

    def take(self, copy: Any) -> None:
        """Return to what `copy` returned, here or in a bank of the same models."""
        self._words[...], full = copy
        self._forget()
        for row, more in full:
            self.joints[row].more = more
            self._full.append(row)

    def _not_logged(self) -> list[tuple[int, list[Switch]]]:
        """Return the switches that did not fit into the log."""
        return [(row, self.joints[row].more) for row in self._full]

    def _forget(self) -> None:
        for row in self._full:
            self.joints[row].more = []
        self._full = []


def _alike(starts: Sequence[Start]) -> list[list[int]]:
    """Return the places of starts that share their machine code."""
    codes = [machine_code(start) for start in starts]  # all in memory: their `id` differ
    groups: dict[int, list[int]] = {}
    for i, code in enumerate(codes):
        groups.setdefault(id(code), []).append(i)
    return list(groups.values())


def _memory(start: Start, count: int) -> NDArray[np.int64]:
    """Return memory for blocks, for what is kept of them, and for what was kept before."""
    return np.zeros((3, count, machine_code(start).layout.words), dtype=np.int64)
