"""One contact or many, advanced together: the stepping of `FrictionState` and `FrictionBank`."""

from __future__ import annotations

import functools
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import FloatArray, checked_array, checked_scalar
from gms_fsm.coupling.joint import Asked, ElementSwitch, Joint, Line
from gms_fsm.coupling.steppable import start_of
from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.run.problem import LATEST
from gms_fsm.run.stepped.going_back import Alone, Snapshot, content_of, in_use
from gms_fsm.run.stepped.memory import (
    BlockMemory,
    BlocksMemory,
    ListMemory,
    fast,
    machine_code,
    no_short_calls,
)
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

# Whether one thread at a time runs Python, and another one goes on only where a call has returned.
ONE_AT_A_TIME: bool = getattr(sys, "_is_gil_enabled", lambda: True)()
CHANGE = 1e-4  # of the last velocity, for a derivative by differences
Lost = dict[Joint, list[ElementSwitch]]  # switches that did not fit into the log of a sample
# When it began, v0, v1, further inputs, lost switches, and the state before it.
LastSample = tuple[float, Any, Any, Mapping[str, Line], Lost, Any]


class JointGroup:
    """Joints in one memory, advanced by one call; of one joint, all values are numbers."""

    def __init__(
        self, joints: Sequence[Joint], memory: BlockMemory | BlocksMemory | ListMemory, places: Any
    ) -> None:
        self.joints, self.places, self.short = joints, places, memory.short
        self.copy, self.take, self.free = memory.copy, memory.take, memory.free
        self._run, self._sample = memory.run, memory.sample
        lines: Sequence[Any] = memory.lines
        self.v, *others = lines
        self._others = [*zip(joints[0].inputs, others, strict=False)]
        self._entering = joints[0].enters

    def step(
        self,
        v0: Any,
        v1: Any,
        t: float,
        inputs: Mapping[str, Line],
        lost: Lost,
        now: float,
        *,
        mean: bool = False,
    ) -> Any:
        """Advance to t; return the forces there, or their integrals over the sample."""
        if inputs:
            for name, line in self._others:
                line[0], line[1] = inputs[name]
        if self._entering:
            self._enter(t, {**inputs, "v": (v0, v1)})
        v, sample = self.v, self._sample
        sample.end, v[0], v[1] = t, v0, v1
        if mean:
            sample.mean = True
        if self._run():
            for joint in self.joints:
                if more := joint.finish(now):
                    lost[joint] = more
        return sample.impulse if mean else sample.force

    def _enter(self, t: float, lines: Mapping[str, Line]) -> None:
        for row, joint in enumerate(self.joints):
            joint.enter(t, lines if len(self.joints) == 1 else _lines_of(lines, row))


class JointGroups:
    """Groups of joints, advanced one after the other; all values are arrays, one item a joint."""

    def __init__(self, groups: Sequence[JointGroup]) -> None:
        self.groups = groups
        self._size = sum(len(group.joints) for group in groups)

    def step(
        self,
        v0: Any,
        v1: Any,
        t: float,
        inputs: Mapping[str, Line],
        lost: Lost,
        now: float,
        *,
        mean: bool = False,
    ) -> FloatArray:
        """Advance to t; return the forces there, or their integrals over the sample."""
        found, lines = np.empty(self._size), {**inputs, "v": (v0, v1)}
        for group in self.groups:
            own = _lines_of(lines, group.places)
            v0, v1 = own.pop("v")
            found[group.places] = group.step(v0, v1, t, own, lost, now, mean=mean)
        return found

    def copy(self) -> Any:
        """Return the present state."""
        return [group.copy() for group in self.groups]

    def take(self, copy: Any) -> None:
        """Return to what `copy` returned."""
        for group, each in zip(self.groups, copy, strict=True):
            group.take(each)

    def free(self, copy: Any) -> None:
        """Let the memory of a copy serve again."""
        for group, each in zip(self.groups, copy, strict=True):
            group.free(each)


def _lines_of(lines: Mapping[str, Line], places: Any) -> dict[str, Line]:
    """Return the inputs of one of the joints, by its number, or of some, by a list of numbers."""
    own = float if isinstance(places, int) else np.asarray
    return {name: (own(u[places]), own(w[places])) for name, (u, w) in lines.items()}


class Joints:
    """Contacts at one time, and their last sample.

    A `FrictionState` is the bank of one: what is given and returned are numbers instead of arrays.
    """

    def __init__(
        self,
        given: Sequence[Model | Contact],
        asked: Sequence[Asked],
        engine: str | None,
        *,
        several: bool,
    ) -> None:
        self.engine = checked_engine(engine)
        compiled = self.engine == "compiled"
        starts = []
        for i, each in enumerate(given):
            try:
                starts.append(start_of(each, *asked[i]))
            except GMSError as error:
                raise error.inside(f"models[{i}]") if several else error from None
        alike: dict[Any, list[int]] = {}  # joints that share their machine code share a call
        for i, start in enumerate(starts):
            key = machine_code(start) if compiled else i
            alike.setdefault(key, []).append(i)
        groups, joints = [], dict[int, Joint]()
        for places in alike.values():
            many = BlocksMemory if len(places) > 1 else BlockMemory
            memory = (many if compiled else ListMemory)([starts[i] for i in places])
            for i, own in zip(places, memory.each, strict=True):
                name = f"joint {i}" if several else ""
                joints[i] = Joint(given[i], asked[i], starts[i], own, name)
            mine = [joints[i] for i in places]
            groups.append(JointGroup(mine, memory, places if len(places) > 1 else places[0]))
        self.each = [joints[i] for i in range(len(given))]
        self._first: Any = self.each[0].memory.sample
        self._v = groups[0].v
        self.inputs = tuple(sorted({name for joint in self.each for name in joint.inputs}))
        together: JointGroup | JointGroups = JointGroups(groups)
        if len(groups) == 1 and several == (len(given) > 1):  # all values as they come
            together = groups[0]
        self._step = together.step
        self._copy, self._take, self._free = together.copy, together.take, together.free
        self._several = several
        self.short = groups[0].short if groups[0] is together else no_short_calls()
        self.alone = Alone()
        if self.inputs or self.each[0].enters or not ONE_AT_A_TIME:
            self.alone.inside = 1  # no short calls
        self._found: LastSample | None = None  # unless the last call was a short one
        self._at: float | None = None  # the time, while a call tries others

    # ------------------------------------------------------------------ samples
    @property
    def t(self) -> float:
        """The present time."""
        end: float = self._first.end
        return end if self._at is None else self._at

    def advance(
        self, v0: Any, v1: Any, dt: float, inputs: Mapping[str, Line], t: Any = None
    ) -> Any:
        """Advance by a sample, or (dt is NaN) to t; if that fails everything is as before."""
        alone = self.alone
        if not alone.acquire(False):  # as `with alone`, in half of the time
            raise in_use()
        alone.inside += 1
        try:
            now = self._first.end
            end = now + dt
            if not now < end < LATEST:
                end = end_of(now, dt) if dt == dt else end_at(now, t)
            before, found, self._at = self._copy(), self._found, now
            lost: Lost = {}
            try:
                force = self._step(v0, v1, end, inputs, lost, now)
            except BaseException:  # Ctrl-C, too
                self._take(before)
                raise
            self._found, self.short.record.last = (now, v0, v1, inputs, lost, before), False
            if found is not None:
                self._free(found[5])
            return force
        finally:
            self._at = None
            alone.inside -= 1
            alone.leave()

    def peek(self, v0: Any, v1: Any, dt: float, inputs: Mapping[str, Line]) -> Any:
        """Return the forces at the end of a sample, and stay."""
        with self.alone:
            now = self._first.end
            end = _in_reach(now + dt)
            before, self._at = self._copy(), now
            try:
                return self._step(v0, v1, end, inputs, {}, now)
            finally:
                self._take(before)
                self._free(before)
                self._at = None

    def send(self, event: str) -> None:
        """Let an event wait for the next sample of all joints that wait for it."""
        known = dict.fromkeys(name for joint in self.each for name in joint.events)
        if not isinstance(event, str) or event not in known:
            raise unknown("event", event, known)
        with self.alone:
            for joint in self.each:
                if event in joint.events:
                    joint.send(event)

    # ------------------------------------------------------------------ what it found
    @property
    def switches(self) -> list[tuple[ElementSwitch, ...]]:
        """Of each joint the edges taken in the last sample."""
        recent = None if self.short.record.last else self._found
        lost: Lost = {} if recent is None else recent[4]
        return [(*lost.get(joint, ()), *joint.logged) for joint in self.each]

    @property
    def mean_force(self) -> Any:
        """The mean of the force over the last sample."""
        with self.alone:
            (begin, _, v1, *_), end = self._sample(), self.t
            if begin == end:
                return self._again(v1)
            return self._again(v1, mean=True) / (end - begin)

    @property
    def dF_dv(self) -> Any:
        """The derivative of the last force with respect to the velocity there."""
        with self.alone:
            _, v0, v1, *_ = self._sample()
            larger = np.maximum if self._several else max
            change = CHANGE * larger(larger(abs(v0), abs(v1)), self._speed)
            return (self._again(v1 + change) - self._again(v1 - change)) / (2.0 * change)

    @functools.cached_property
    def _speed(self) -> Any:
        """A small speed, m/s."""
        speeds = [joint.speed for joint in self.each]
        return np.array(speeds) if self._several else speeds[0]

    def _sample(self) -> LastSample:
        """Return the last sample."""
        record, v = self.short.record, self._v
        if record.last:
            before = self.short.kept[record.row]
            self._found, record.last = (record.begin, v[0], v[1], {}, {}, before), False
        if self._found is None:
            raise ParameterError("there is no last sample", advice="call advance first")
        return self._found

    def _again(self, v1: Any, *, mean: bool = False) -> Any:
        """Return the force, or its integral, had the last velocity been v1."""
        _, v0, _, inputs, _, before = self._sample()
        end, now = self.t, self._copy()
        self._at = end
        try:
            self._take(before)
            return self._step(v0, v1, end, inputs, {}, end, mean=mean)
        finally:
            self._take(now)
            self._at = None

    # ------------------------------------------------------------------ going back
    def snapshot(self) -> Snapshot:
        """Return the present state."""
        with self.alone:
            return Snapshot(self.t, self._identity, self._copy())

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot of the same frictions."""
        content = content_of(snapshot, Snapshot, self._identity)
        with self.alone:
            self._take(content)
            self._moved_to(snapshot.t)

    @functools.cached_property
    def _identity(self) -> tuple[str, str]:
        """What states can be exchanged with: the same numbers, and the same engine."""
        stamps = tuple(joint.stamp for joint in self.each)
        return repr(("bank", stamps)) if self._several else stamps[0], self.engine

    def to_array(self) -> FloatArray:
        """Return the present state as finite numbers."""
        with self.alone:
            return np.concatenate([joint.numbers for joint in self.each])

    def from_array(self, array: ArrayLike) -> None:
        """Return to what `to_array` returned."""
        sizes = [joint.size for joint in self.each]
        given = checked_array("array", array, None, "finite")
        if given.size != sum(sizes):
            raise ParameterError(
                f"it has {given.size} numbers", place="array", advice=f"it must have {sum(sizes)}"
            )
        with self.alone:
            parts = zip(self.each, np.split(given, np.cumsum(sizes)[:-1]), strict=True)
            times, states = zip(*(joint.checked(part) for joint, part in parts), strict=True)
            if len({*times}) > 1:
                raise ParameterError("its joints are at different times", place="array")
            for joint, state in zip(self.each, states, strict=True):
                joint.write(state)
            self._moved_to(times[0])

    def _moved_to(self, t: float) -> None:
        """Forget the last sample: the memory has been given another state."""
        self._found, self.short.record.last = None, False
        for joint in self.each:
            joint.forget(t)


def made_again(kind: Any, given: Any, arguments: Mapping[str, Any], array: FloatArray) -> Any:
    """Return a copy of a `FrictionState` or a `FrictionBank`, also in another process."""
    new = kind(given, **arguments)
    new.from_array(array)
    return new


# --------------------------------------------------------------------------- arguments
def checked_engine(engine: object) -> str:
    """Return the name of an engine; None is machine code, where it can be made."""
    if engine is None:
        return "compiled" if fast() else "ifelse"
    if not isinstance(engine, str) or engine not in ("compiled", "ifelse"):
        raise ParameterError("it must be 'compiled' or 'ifelse'", place="engine", value=engine)
    return engine


def end_of(now: float, dt: float) -> float:
    """Return the end of a sample; the clock must resolve it."""
    end = now + dt
    if end == now and dt > 0.0:
        raise ParameterError(
            f"it is below the resolution of the clock at t = {now!r} s",
            place="dt",
            value=dt,
            advice="start at a smaller t=...",
        )
    return _in_reach(end)


def end_at(now: float, t: Any) -> float:
    """Return the end of a sample that is given as a time."""
    end = checked_scalar("t", t, "finite")
    if end < now:
        raise ParameterError(
            f"it is before the present time {now!r} s",
            place="t",
            value=end,
            advice="restore a snapshot to go back",
        )
    return _in_reach(end)


def _in_reach(t: float) -> float:
    """Return the end of a sample, unless the clock cannot resolve it."""
    if t > LATEST:
        raise ParameterError("it is too large", place="t", value=t, advice=f"at most {LATEST:g} s")
    return t


def input_lines(given: Mapping[str, Any], known: Iterable[str], checked: Any) -> dict[str, Line]:
    """Return further inputs at the start and at the end of a sample, or refuse them.

    They must be exactly the known ones; checked(name, value) returns a value, or refuses it.
    """
    names = sorted(known)
    if sorted(given) != names:
        raise ParameterError(
            f"the further inputs given are {', '.join(sorted(given)) or 'none'}",
            advice=f"give {', '.join(f'{name}=(start, end)' for name in names)}"
            if names
            else "this friction has no inputs but its velocity",
        )
    return {name: _pair(name, each, checked) for name, each in given.items()}


def _pair(name: str, given: Any, checked: Any) -> Line:
    flat = isinstance(given, np.ndarray) and given.ndim == 0
    if isinstance(given, tuple | list | np.ndarray) and not flat and len(given) == 2:
        return checked(name, given[0]), checked(name, given[1])
    raise ParameterError(
        "it must be a pair, its value at the start and at the end of the sample",
        place=name,
        value=given,
    )
