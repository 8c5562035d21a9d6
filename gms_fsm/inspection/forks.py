"""A tree of runs that differ in numbers, law or poked values, each computed whole.

A session steps through a run row by row; here every branch is run to its end, by the fastest engine
there is, so that it can be computed again whenever a number is adjusted. This module has no user
interface.
"""

from __future__ import annotations

import importlib.util
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from gms_fsm._arguments import checked_integer
from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.errors import SessionError, shown
from gms_fsm.inspection._arguments import checked_settings
from gms_fsm.inspection._branch import Row
from gms_fsm.inspection._export import save_scenario
from gms_fsm.inspection._poking import Edits, initial_with
from gms_fsm.inspection._results import BranchComparison, compared
from gms_fsm.run._compiled_run import CompiledRun
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.run.simulate import Run
from gms_fsm.run.start import Start
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted, arguments_of, mounted
from gms_fsm.systems.numbers import Number, number_of, numbers_of, with_law, with_numbers
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.system import System
from gms_fsm.traces._between import interpolated
from gms_fsm.traces._views import steps_of
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.trace import Trace

__all__ = ["Fork", "Forks", "Poke"]

KEPT = 64  # runs; older ones are computed again when they are asked for


@dataclass(frozen=True, eq=False)
class Poke:
    """Values changed at a point of a run.

    Parameters
    ----------
    t : float
        When, s.
    microstep : int or None
        After which row of this time; None for the last.
    edits : Edits
        What changes; as text, ``z1 = 0.2``.
    """

    t: float
    microstep: int | None
    edits: Edits


@dataclass(frozen=True)
class Fork:
    """A branch: the run of its parent with changes.

    Parameters
    ----------
    name : str
        For people.
    parent : int or None
        Number of the branch that it comes from; None for the first.
    values : mapping of str to float
        Numbers that differ from those of the parent, from the start of the run on.
    law : str or None
        The slip law, if it differs from that of the parent.
    poke : Poke or None
        The values changed in it.
    """

    name: str
    parent: int | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    law: str | None = None
    poke: Poke | None = None

    @property
    def text(self) -> str:
        """What differs from the parent, such as ``F_s = 1.8, z1 = 0.2 at 25 s``."""
        parts = [f"{name} = {value:.6g}" for name, value in self.values.items()]
        if self.law is not None:
            parts.insert(0, f"{self.law} law")
        if self.poke is not None:
            parts.append(f"{self.poke.edits} at {self.poke.t:.6g} s")
        return ", ".join(parts)


@dataclass(frozen=True, eq=False)
class _Ran:
    """A run, and for each firing in its log the number of the row that it made."""

    start: Start
    trace: Trace
    made: NDArray[np.int64]
    failure: SimulationError | None


class Forks:
    """A tree of runs: ``Forks(model, rig, t_end)``, or ``Forks(system, t_end)``.

    Parameters
    ----------
    model, rig, t_end, t_start, initial, settings, **options
        As for `gms_fsm.Session`. By default the engine is ``"compiled"`` if llvmlite is installed,
        else ``"ifelse"``.

    Attributes
    ----------
    branches : dict of int to Fork
        By number; 0 is the original run. Numbers are not used again.
    current : int
        Number of the branch that `set`, `poke` and `fork` change or begin from.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> forks = Forks(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...               Prescribed("0.15*sin(2*pi*t/25)"), 30.0)
    >>> forks.poke({"z": {0: -1.4}}, t=25.0)
    1
    >>> forks.branches[1].text
    'z1 = -1.4 at 25 s'
    >>> forks.fork(0, law="signed")
    2
    >>> print(forks.compare(0, 2))  # doctest: +ELLIPSIS
    branches 0 and 2 until t = 30 s: ...
    """

    def __init__(
        self,
        model: Model | System,
        rig: Rig | float,
        t_end: float | None = None,
        *,
        t_start: float = 0.0,
        initial: Mapping[str, Any] | None = None,
        settings: Settings | None = None,
        **options: Unpack[SettingOptions],
    ) -> None:
        if settings is None and "engine" not in options:
            fast = importlib.util.find_spec("llvmlite") is not None
            options["engine"] = "compiled" if fast else "ifelse"
        self.settings = checked_settings(settings, options)
        on, self.t_end = arguments_of("Forks", model, rig, t_end)
        self.subject = mounted(model, on, self.settings.held_period)
        self.t_start, self.initial = t_start, initial
        self.branches: dict[int, Fork] = {0: Fork("original")}
        self.current, self._next = 0, 1
        self._ran: OrderedDict[Any, _Ran] = OrderedDict()
        self.trace(0)  # errors in the arguments belong here

    # ------------------------------------------------------------------ what runs
    def made_of(self, branch: int | None = None) -> Mounted:
        """Return model and rig of a branch, by default the current one."""
        number = self._checked(branch)
        law, values = self._given(number)
        lawful = self.subject if law is None else with_law(self.subject, law)
        return with_numbers(lawful, values)

    def numbers(self, branch: int | None = None) -> dict[str, Number]:
        """Return the numbers of a branch that `set` can change, by name."""
        return numbers_of(self.made_of(branch))

    def number(self, name: str, branch: int | None = None) -> Number:
        """Return one of them; raise `ParameterError` if there is none of this name."""
        return number_of(self.made_of(branch), name)

    def trace(self, branch: int | None = None) -> Trace:
        """Return the run of a branch; what there is of it, if it failed.

        Parameters
        ----------
        branch : int, optional
            Its number; by default the current one.

        Returns
        -------
        Trace
            From the start of the original run on.

        Raises
        ------
        SessionError
            If there is no such branch, or its poke is after the end of its parent.
        ParameterError
            If a value violates its rule.
        """
        return self._run_of(self._checked(branch)).trace

    def failure(self, branch: int | None = None) -> SimulationError | None:
        """Return why a branch could not run to its end, or None."""
        return self._run_of(self._checked(branch)).failure

    def start(self, branch: int | None = None) -> Start:
        """Return the last part of a branch, ready to start: from its latest poke on."""
        return self._run_of(self._checked(branch)).start

    def beginning(self, branch: int) -> float:
        """Return the time from which a branch can differ from its parent, s."""
        fork = self.branches[self._checked(branch)]
        whole = fork.poke is None or fork.values or fork.law is not None
        return self.t_start if whole or fork.poke is None else fork.poke.t

    # ------------------------------------------------------------------ changes
    def set(self, values: Mapping[str, float], branch: int | None = None) -> None:
        """Change numbers of a branch, from its start on; branches that come from it follow.

        Parameters
        ----------
        values : mapping of str to float
            By a name from `numbers`.
        branch : int, optional
            Its number; by default the current one.

        Raises
        ------
        ParameterError
            If there is no such number, or a value violates its rule; nothing is changed then.
        """
        number = self._checked(branch)
        self._try(number, replace(self.branches[number], values=self._merged(number, values)))

    def fork(
        self,
        parent: int | None = None,
        *,
        values: Mapping[str, float] | None = None,
        law: str | None = None,
        name: str = "",
    ) -> int:
        """Begin a branch with other numbers, or another slip law, from the start of the run on.

        Parameters
        ----------
        parent : int, optional
            Number of the branch to begin from; by default the current one.
        values : mapping of str to float, optional
            By a name from `numbers`.
        law : {"published", "signed"}, optional
            Of a GMS model.
        name : str, optional
            By default what differs from the parent.

        Returns
        -------
        int
            Its number; it becomes the current one.

        Raises
        ------
        ParameterError
            If there is no such number or law, or a value violates its rule.
        """
        number = self._checked(parent)
        if law is not None:
            with_law(self.subject, law)
        own = self._own_values(number, values or {})
        return self._added(Fork(name, number, own, law))

    def poke(
        self,
        variables: Mapping[str, Any] | None = None,
        v: float | None = None,
        state: Mapping[Any, str] | None = None,
        *,
        t: float,
        microstep: int | None = None,
        parent: int | None = None,
        name: str = "",
    ) -> int:
        """Begin a branch in which values change at one time.

        Parameters
        ----------
        variables, v, state
            The changes, as for `gms_fsm.Session.poke`.
        t : float
            When, s: after the rows of this time, or between two rows.
        microstep : int, optional
            After the row of this time with this micro-step, if there is one.
        parent : int, optional
            Number of the branch to begin from; by default the current one.
        name : str, optional
            By default what is changed.

        Returns
        -------
        int
            Its number; it becomes the current one.

        Raises
        ------
        SessionError
            If there is nothing to change, no such variable or element, or the time is not before
            the end of the run.
        ParameterError, ChartError
            If a value violates its rule, or a locked contact would move.
        """
        number, t = self._checked(parent), checked_scalar("t", t, "finite")
        if not self.t_start <= t < self.t_end:
            raise SessionError(
                f"there is no poke at t = {t!r} s",
                advice=f"give a time from {self.t_start:g} s to before {self.t_end:g} s",
            )
        edits = Edits.of(self.start(number), variables, v, state)
        return self._added(Fork(name, number, poke=Poke(t, microstep, edits)))

    def rename(self, branch: int, name: str) -> None:
        """Give a branch another name."""
        number = self._checked(branch)
        if not isinstance(name, str) or not name.strip():
            raise SessionError("it must be a text", place="name", value=name)
        self.branches[number] = replace(self.branches[number], name=name.strip())

    def delete(self, branch: int) -> None:
        """Remove a branch; its parent becomes the current one if it was.

        Parameters
        ----------
        branch : int
            Its number.

        Raises
        ------
        SessionError
            If it is the original run, or other branches come from it.
        """
        number = self._checked(branch)
        parent = self.branches[number].parent
        if parent is None:
            raise SessionError("the original run cannot be deleted")
        heirs = [str(k) for k, each in self.branches.items() if each.parent == number]
        if heirs:
            raise SessionError(
                f"other branches come from branch {number}",
                advice=f"delete {', '.join(heirs)} first",
            )
        del self.branches[number]
        if self.current == number:
            self.current = parent

    # ------------------------------------------------------------------ results
    def compare(self, a: int, b: int) -> BranchComparison:
        """Compare two branches.

        Parameters
        ----------
        a, b : int
            Their numbers.

        Returns
        -------
        BranchComparison
            As of `gms_fsm.Session.compare`.
        """
        return compared((a, b), self.trace(a), self.trace(b))

    def save_scenario(self, path: str | Path, branch: int | None = None) -> Path:
        """Write a branch as a scenario file for ``gms-fsm run`` and ``gms-fsm debug``.

        The file has the tables of a system, with the values of the branch. That of a poked branch
        begins at its latest poke, with the whole state.

        Parameters
        ----------
        path : str or Path
            The file; its ending must be ``.toml``.
        branch : int, optional
            By default the current one.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        SessionError
            If the branch is poked and has ticks, which would be counted from another time.
        OutputError
            If a signal is a Python function, or the file cannot be written.
        """
        number = self._checked(branch)
        fork, start = self.branches[number], self.start(number)
        if len(start.program.ticks) and self._pokes(number):
            raise SessionError(
                "a scenario that begins at a poke would count its ticks from there",
                advice="export a branch that is not poked",
            )
        return save_scenario(path, start, fork.name, fork.text)

    # ------------------------------------------------------------------ computing
    def _checked(self, branch: int | None) -> int:
        number = self.current if branch is None else branch
        if checked_integer("branch", number, None, SessionError) not in self.branches:
            known = ", ".join(map(str, self.branches))
            raise SessionError(f"no branch {shown(number)}", advice=f"there are {known}")
        return number

    def _own_values(self, number: int, values: Mapping[str, float]) -> dict[str, float]:
        subject = self.made_of(number)
        for name in values:
            number_of(subject, name)
        return {name: checked_scalar(name, value, "finite") for name, value in values.items()}

    def _merged(self, number: int, values: Mapping[str, float]) -> dict[str, float]:
        return {**self.branches[number].values, **self._own_values(number, values)}

    def _added(self, fork: Fork) -> int:
        number = self._next
        self._try(number, replace(fork, name=fork.name.strip() or fork.text or f"branch {number}"))
        self._next, self.current = number + 1, number
        return number

    def _try(self, number: int, fork: Fork) -> None:
        """Put a branch in its place and run it; if it cannot start, all is as before."""
        before = self.branches.get(number)
        self.branches[number] = fork
        try:
            self._run_of(number)
        except BaseException:
            if before is None:
                del self.branches[number]
            else:
                self.branches[number] = before
            raise

    def _given(self, number: int) -> tuple[str | None, dict[str, float]]:
        """Return law and numbers that differ from those of the original run."""
        fork = self.branches[number]
        law, values = (None, {}) if fork.parent is None else self._given(fork.parent)
        return fork.law or law, {**values, **fork.values}

    def _pokes(self, number: int) -> tuple[Poke, ...]:
        """Return the pokes of a branch: of its parent's, those before its own."""
        fork = self.branches[number]
        before = () if fork.parent is None else self._pokes(fork.parent)
        if fork.poke is None:
            return before
        return (*(each for each in before if each.t <= fork.poke.t), fork.poke)

    def _run_of(self, number: int) -> _Ran:
        law, values = self._given(number)
        return self._run(law, tuple(sorted(values.items())), self._pokes(number))

    def _run(
        self, law: str | None, values: tuple[tuple[str, float], ...], pokes: tuple[Poke, ...]
    ) -> _Ran:
        key = law, values, pokes
        if key not in self._ran:
            if pokes:
                found = self._poked(self._run(law, values, pokes[:-1]), pokes[-1])
            else:
                subject = self.subject if law is None else with_law(self.subject, law)
                changed = with_numbers(subject, dict(values))
                found = self._from(changed, self.t_start, self.initial)
            self._ran[key] = found
            while len(self._ran) > KEPT:
                self._ran.popitem(last=False)
        self._ran.move_to_end(key)
        return self._ran[key]

    def _from(self, subject: Mounted, t: float, initial: Mapping[str, Any] | None) -> _Ran:
        options: Any = {"t_start": t, "initial": initial}
        if t != self.t_start or initial is not self.initial:
            options["ticks_from"] = self.t_start
        start = Start.on(subject, self.t_end, self.settings, **options)
        compiled = self.settings.engine == "compiled"
        run: CompiledRun | Run = CompiledRun(start) if compiled else Run(start)
        failure: SimulationError | None = None
        try:
            while run.advance():
                pass
            trace = run.recorder.trace()
        except SimulationError as error:
            failure, trace = error.with_traceback(None), error.trace
        return _Ran(start, trace, _made(trace), failure)

    def _poked(self, before: _Ran, poke: Poke) -> _Ran:
        """Return a run that goes on from a point of another with edits."""
        place, here = _place(before, poke)
        was = before.start
        after = self._from(was.what, here.t, initial_with(poke.edits, was, here))
        shared = before.trace.rows.at(slice(place + 1))
        if here.t != shared.t[-1]:  # between two rows: the point is a row of this branch
            own = [here.t], [0], [here.y], [here.mode]
            shared = _joined(shared, Rows(*map(np.array, own)))
        early = before.made <= place
        log = before.trace.firings.at(early).followed_by(after.trace.firings)
        new = after.trace.rows
        # Micro-steps count the firings at one time, also those before the poke.
        more = np.where(new.t == here.t, here.microstep, 0)
        rows = _joined(shared, replace(new, microstep=new.microstep + more))
        made = np.concatenate([before.made[early], after.made + len(shared)])
        return _Ran(after.start, after.start.trace(rows, rows, log), made, after.failure)


def _joined(first: Rows, second: Rows) -> Rows:
    pairs = zip(vars(first).values(), vars(second).values(), strict=True)
    return Rows(*(np.concatenate(pair) for pair in pairs))


def _made(trace: Trace) -> NDArray[np.int64]:
    """Return the number of the row that each firing of a run made."""
    low = np.searchsorted(trace.t, trace.firings.t, side="left")
    high = np.searchsorted(trace.t, trace.firings.t, side="right")
    spans = zip(low.tolist(), high.tolist(), steps_of(trace).tolist(), strict=True)
    rows = [a + int(np.searchsorted(trace.microstep[a:b], step)) for a, b, step in spans]
    return np.array(rows, dtype=np.int64)


def _place(ran: _Ran, poke: Poke) -> tuple[int, Row]:
    """Return the last row before a poke, and the point at which it is made."""
    rows = ran.trace.rows
    if poke.t > rows.t[-1]:
        raise SessionError(
            f"the run ends at t = {rows.t[-1]:g} s, before the poke", advice="poke it earlier"
        )
    last = int(np.searchsorted(rows.t, poke.t, side="right")) - 1
    if rows.t[last] == poke.t:
        same = np.flatnonzero((rows.t == poke.t) & (rows.microstep == poke.microstep))
        at = int(same[-1]) if same.size else last
        y, mode = rows.y[at].tolist(), tuple(rows.mode[at].tolist())
        return at, Row(poke.t, int(rows.microstep[at]), y, mode)
    mode = tuple(rows.mode[last].tolist())
    ends = float(rows.t[last]), rows.y[last], float(rows.t[last + 1]), rows.y[last + 1]
    y = interpolated(ran.start.program, list(mode), *ends, poke.t).tolist()
    return last, Row(poke.t, 0, y, mode)
