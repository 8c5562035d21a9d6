"""A whole system in a loop of one's own: it is given its inputs, and steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Unpack

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.coupling.joints import checked_engine, end_at, end_of
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind, refusing
from gms_fsm.run.problem import LATEST
from gms_fsm.run.settings import RunOptions, Settings
from gms_fsm.run.stepped.going_back import Snapshot, in_use
from gms_fsm.run.stepped.plant import Plant, SystemSwitch
from gms_fsm.systems.system import System

__all__ = ["SystemState", "SystemSwitch"]


@refusing(quick=("advance", "advance_to", "peek", "value"))
class SystemState:
    """A system, advanced by a loop that gives its inputs.

    In each sample an input is held, or a straight line; every switch within is located. The result
    is that of `simulate` with the same inputs as records, to the last bit. The tick of a sampler at
    the end of a sample belongs to the next one, which may bring other inputs; so does a switch just
    there, if the system has locks. One thread at a time may call it.

    Parameters
    ----------
    system : System
        With ``inputs=(...)``; its own signals are expressions in t, or constants.
    t : float
        s: the beginning.
    t_end : float, optional
        s: the end of the run whose bits are wanted. Before it begins, `simulate` looks for where a
        formula in t rests and then moves, up to its end; the steps then meet these times, too.
    initial : mapping, optional
        As for `gms_fsm.simulate`.
    settings : Settings, optional
        How to integrate; a method of gms-fsm that locates switches.
    engine : {"compiled", "ifelse"}, optional
        As for `gms_fsm.FrictionState`.
    **options
        Fields of `Settings` by name, such as ``rtol``.

    Raises
    ------
    ParameterError
        If it cannot be stepped, or an argument violates its rule.

    Notes
    -----
    A run ends its last step before an input jumps one clock tick earlier. If texts read the time, a
    sample that turns out to end so is therefore advanced again when the next one begins; its last
    bits may change then.

    Examples
    --------
    >>> from gms_fsm import Body, Contact, System, simulate
    >>> from gms_fsm.charts import CHARTS
    >>> pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0})
    >>> sled = System("sled", bodies=(Body("sled", inertia=2.0, force="u"),), contacts=(pad,),
    ...               inputs=("u",))
    >>> state = SystemState(sled)
    >>> state.advance(1.0, u=(0.0, 2.0))
    >>> state.switches[0].edge, state.value("sled.v") == state.value("v")
    ('release_forward', True)
    >>> trace = simulate(sled, 1.0, inputs={"u": ([0, 1], [0, 2])})
    >>> float(trace.body("sled").v[-1]) == state.value("v")
    True
    """

    def __init__(
        self,
        system: System,
        *,
        t: float = 0.0,
        t_end: float | None = None,
        initial: Mapping[str, Any] | None = None,
        settings: Settings | None = None,
        engine: str | None = None,
        **options: Unpack[RunOptions],
    ) -> None:
        checked_kind("system", system, System, "a System")
        chosen = Settings.of(settings, "SystemState", **options)
        end = None if t_end is None else checked_scalar("t_end", t_end, "finite")
        self._plant = Plant(system, t, initial, chosen, checked_engine(engine), end)
        self._names = system.inputs

    def __repr__(self) -> str:
        return f"<SystemState of {self.system!r} at t = {self.t!r} s>"

    @property
    def system(self) -> System:
        """The system, as given."""
        return self._plant.system

    @property
    def inputs(self) -> tuple[str, ...]:
        """What each call needs to be given."""
        return self._names

    # ------------------------------------------------------------------ steps
    def advance(self, dt: float, **inputs: Any) -> None:
        """Advance by a sample.

        Parameters
        ----------
        dt : float
            s, >= 0. With 0 the inputs jump to their values, and what that switches does.
        **inputs : float or (float, float)
            Each input: held, or its values at the start and at the end of a straight line. If it
            does not start where the last sample ended, it jumps.

        Raises
        ------
        ParameterError
            If a number is not finite, an input is missing, the clock does not resolve dt, or
            another thread's call is under way.
        SimulationError
            If it cannot continue. In both cases the system is as it was before.
        """
        plant = self._plant
        if not plant.alone.acquire(False):  # as `with`, in a third of the time
            raise in_use()
        try:
            plant.commit(self._end(dt), *self._lines(inputs))
        finally:
            plant.alone.leave()

    def advance_to(self, t: float, **inputs: Any) -> None:
        """Advance to a time; see `advance`.

        Parameters
        ----------
        t : float
            s: not before the present time.
        **inputs
            As in `advance`.

        Raises
        ------
        ParameterError, SimulationError
            As in `advance`, or if t is before the present time.
        """
        plant = self._plant
        with plant.alone:
            plant.commit(end_at(plant.t, t), *self._lines(inputs))

    def peek(self, dt: float, *names: str, **inputs: Any) -> tuple[float, ...]:
        """Return values that there would be after a sample, and stay.

        Parameters
        ----------
        dt : float
            As in `advance`.
        *names : str
            As in `value`.
        **inputs
            As in `advance`.

        Returns
        -------
        tuple of float
            One for each name.

        Raises
        ------
        ParameterError, SimulationError
            As in `advance` and `value`.
        """
        plant = self._plant
        with plant.alone:
            return tuple(plant.peek(self._end(dt), *self._lines(inputs), names))

    def send(self, event: str) -> None:
        """Send an event: edges that wait for it are asked at the beginning of the next sample.

        Parameters
        ----------
        event : str
            One that a chart waits for.

        Raises
        ------
        ParameterError
            If there is no such event.
        """
        with self._plant.alone:
            self._plant.send(event)

    def _end(self, dt: Any) -> float:
        """Return the end of a sample."""
        now = self._plant.t
        if type(dt) is float and now < (end := now + dt) < LATEST:
            return end
        return end_of(now, checked_scalar("dt", dt, ">= 0"))

    def _lines(self, inputs: Mapping[str, Any]) -> tuple[list[float], list[float]]:
        """Return the inputs at the start and at the end of a sample, or refuse them."""
        names, held = self._names, [*inputs.values()]
        if (*inputs,) != names:
            held = [inputs[name] for name in self._checked(inputs)]
        for given in held:
            if type(given) is not float or given - given != 0.0:  # not finite
                lines = [*map(_line, names, held)]
                return [start for start, _ in lines], [end for _, end in lines]
        return held, held

    def _checked(self, inputs: Mapping[str, Any]) -> tuple[str, ...]:
        """Return the names of all inputs if these are given, in any order."""
        names = self._names
        if {*inputs} == {*names}:
            return names
        raise ParameterError(
            f"the inputs given are {', '.join(sorted(inputs)) or 'none'}",
            place=f"system {self.system.name!r}",
            advice=f"give {', '.join(f'{name}=...' for name in names)}"
            if names
            else 'it has none: System(..., inputs=("u",)) names them',
        )

    # ------------------------------------------------------------------ what it found
    @property
    def t(self) -> float:
        """The present time, s."""
        return self._plant.t

    def value(self, name: str) -> float:
        """Return the present value of a name.

        Parameters
        ----------
        name : str
            Any that a condition over a run may read: ``x`` of a body, ``"load.v"``,
            ``"pad.F"``, ``"pad.z1"``, a flow, a sampled value, an input, a number, a let.

        Returns
        -------
        float
            Just before what happens at this time.

        Raises
        ------
        ParameterError
            If there is no such name.
        """
        return self._plant.value(name)

    @property
    def names(self) -> tuple[str, ...]:
        """The names that `value` knows."""
        return tuple(self._plant.names)

    @property
    def states(self) -> dict[str, tuple[str, ...]]:
        """Of each contact and supervisor the state of each element."""
        return self._plant.states

    @property
    def switches(self) -> tuple[SystemSwitch, ...]:
        """The edges taken in the last sample."""
        plant = self._plant
        return (*plant.lost, *(each for each in plant.logged if each not in plant.told))

    # ------------------------------------------------------------------ going back
    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make a copy: memory of machine code is not copied."""
        plant = self._plant
        with plant.alone:
            given = (plant.system, plant.t_start, plant.t_end, plant.initial, plant.settings)
            return _made_again, (*given, plant.engine, plant.packed())

    def snapshot(self) -> Snapshot:
        """Return the present state, to return to it with `restore`.

        Returns
        -------
        Snapshot
            For this system, or another one with the same numbers and engine.
        """
        with self._plant.alone:
            return self._plant.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot.

        Parameters
        ----------
        snapshot : Snapshot
            From `snapshot`, of this system or another one with the same numbers and engine.

        Raises
        ------
        ParameterError
            If it is of another system; the state stays as it was.
        """
        with self._plant.alone:
            self._plant.restore(snapshot)


def _made_again(
    system: System,
    t: float,
    t_end: float | None,
    initial: Any,
    settings: Settings,
    engine: str,
    packed: Any,
) -> SystemState:
    """Return a copy of a `SystemState`, also in another process."""
    new = SystemState(system, t=t, t_end=t_end, initial=initial, settings=settings, engine=engine)
    new._plant.unpack(packed)
    return new


def _line(name: str, given: Any) -> tuple[float, float]:
    """Return an input at the start and at the end of a sample, or refuse it."""
    if isinstance(given, tuple | list) and len(given) == 2:
        return checked_scalar(name, given[0], "finite"), checked_scalar(name, given[1], "finite")
    if isinstance(given, tuple | list):
        raise ParameterError(
            "it must be a number, or a pair: its value at the start and at the end",
            place=name,
            value=given,
        )
    held = checked_scalar(name, given, "finite")
    return held, held
