"""prepare(): a run made ready, to be repeated with other numbers in microseconds."""

from __future__ import annotations

import copy
import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.foundation.arguments import later, refusing
from gms_fsm.gradients.directions import Directions
from gms_fsm.run.problem import Problem
from gms_fsm.run.repeated.numbers import RepeatedRuns, problem_with, with_given
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.run.simulate import asked_for, simulated
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted, arguments_of, mounted
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.system import System
from gms_fsm.traces.trace import Trace

__all__ = ["Prepared", "RunEnd", "prepare"]


class RunEnd(NamedTuple):
    """How a run ended.

    Parameters
    ----------
    t : float
        s.
    y : tuple of float
        The state, in SI units; `Prepared.names` has the names of its components.
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
    sensitivities: Iterable[str] = (),
    **options: Unpack[SettingOptions],
) -> Prepared:
    """Make a run ready that will be repeated with other numbers; ``prepare(system, t_end)``.

    Parameters
    ----------
    model, rig, t_end, t_start, initial, sensitivities
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
    >>> [round(float(pulled(mass=mass).v.max()), 3) for mass in (0.5, 2.0)]
    [0.183, 0.165]
    >>> pulled.end({"F_s": 1.2, "k2": 3.0}).states[0]
    'slip'
    """
    if settings is None:
        options = {"engine": "compiled", **options}
    chosen = Settings.of(settings, "prepare", **options)
    on, end = arguments_of("prepare", model, rig, t_end)
    what = mounted(model, on, chosen.held_period)
    start = Problem.on(what, end, chosen, t_start=t_start, initial=initial)
    return Prepared(start, asked_for(start, sensitivities))


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
    wanted : Directions, optional
        By what its traces are differentiated.
    """

    start: Problem
    wanted: Directions | None = None

    def __repr__(self) -> str:
        return f"<Prepared: {self.start.what.title}, {self.start.t_end:g} s>"

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the components of `RunEnd.y`; that of a variable stands once per element."""
        layout = self.start.program.layout
        return tuple(layout.label(name) for name, _ in layout.y)

    def __call__(self, numbers: Mapping[str, ArrayLike] | None = None, /, **more: Any) -> Trace:
        """Run with these numbers, in a mapping or as keywords where their names allow it.

        Rows and log are copied at once, all else of the trace is made when it is read. Numbers that
        do not exist or violate their rules, and runs that fail, raise what `simulate` raises.
        """
        given = _own({**numbers, **more} if numbers else more)
        start, run = self.start, self._all.run(given)
        if run is None:
            return self._alone(given, start.chosen, self.wanted)
        contents = run.taken()
        slopes = run.columns.derived()
        self._all.take_back(run)
        made: Trace = later(
            Trace,
            lambda: problem_with(start, given).trace(*contents(), slopes),
            initial=start.initial,
            derived=slopes,
        )
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
        given = _own({**numbers, **more} if numbers else more)
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
    def _all(self) -> RepeatedRuns:
        return RepeatedRuns(self.start, self.wanted)

    @functools.cached_property
    def _ends(self) -> RepeatedRuns:
        chosen = replace(self.start.chosen, output="end", t_eval=None)
        return RepeatedRuns(self._again(self.start.what, chosen))

    def _again(self, what: Mounted, chosen: Settings) -> Problem:
        start = self.start
        return Problem.on(what, start.t_end, chosen, t_start=start.t_start, initial=start.initial)

    def _alone(
        self, given: Mapping[str, Any], chosen: Settings, wanted: Directions | None = None
    ) -> Trace:
        """Run as `simulate` does, from new: numbers that change the program, and errors."""
        start = self._again(with_given(self.start.what, given), chosen)
        return simulated(start, wanted=None if wanted is None else asked_for(start, wanted.names))


def _own(given: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return numbers that nobody else changes."""
    for value in given.values():
        if isinstance(value, np.ndarray | list):
            return copy.deepcopy(dict(given))
    return given
