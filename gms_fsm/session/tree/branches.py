"""The branches of a session: a tree of runs that differ in numbers, law or poked values.

A branch is computed row by row where it is walked, and whole where its trace is asked for. This
module has no user interface.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.errors import SessionError, shown
from gms_fsm.foundation.arguments import checked_integer, checked_kind
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import Settings
from gms_fsm.session.results import BranchComparison, compared
from gms_fsm.session.tree.branch import Branch, BranchRow, Continuation
from gms_fsm.session.tree.export import save_scenario
from gms_fsm.session.tree.poking import Edits, initial_with
from gms_fsm.systems.mounted import Mounted
from gms_fsm.systems.numbers import NamedNumber, number_of, numbers_of, with_law, with_numbers
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.trace import Trace

__all__ = ["Fork", "Poke", "Tree"]


@dataclass(frozen=True, eq=False)
class Poke:
    """Values changed at a point of a run.

    Parameters
    ----------
    t : float
        When, s.
    microstep : int or None
        After which row of this time, as a trace counts; None for the last.
    edits : Edits
        What changes; as text, ``z1 = 0.2``.
    """

    t: float
    microstep: int | None
    edits: Edits


@dataclass(frozen=True)
class Fork:
    """What a branch is: the run of its parent with changes.

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
    def changes(self) -> str:
        """What differs from the parent, such as ``F_s = 1.8, z1 = 0.2``."""
        parts = [] if self.law is None else [f"{self.law} law"]
        parts += [f"{name} = {value:.6g}" for name, value in self.values.items()]
        return ", ".join(parts if self.poke is None else [*parts, str(self.poke.edits)])

    @property
    def text(self) -> str:
        """The same, and when: ``F_s = 1.8, z1 = 0.2 at 25 s``."""
        return self.changes + ("" if self.poke is None else f" at {self.poke.t:.6g} s")


class Tree:
    """The branches of a session, which has it as ``session.tree``.

    Parameters
    ----------
    subject : Mounted
        What runs.
    t_end, t_start, initial, settings
        As for `gms_fsm.Session`.

    Attributes
    ----------
    forks : dict of int to Fork
        What each branch is, by number; 0 is the original run. Numbers are not used again.
    current : int
        Number of the branch that `set`, `poke` and `fork` change or begin from.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, Session
    >>> tree = Session(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...                Prescribed("0.15*sin(2*pi*t/25)"), 30.0).tree
    >>> tree.poke({"z": {0: -1.4}}, t=25.0)
    1
    >>> tree.forks[1].text
    'z1 = -1.4 at 25 s'
    >>> tree.current = 0
    >>> tree.fork(law="signed")
    2
    >>> print(tree.compare(0, 2))  # doctest: +ELLIPSIS
    branches 0 and 2 until t = 30 s: ...
    """

    def __init__(
        self,
        subject: Mounted,
        t_end: float,
        t_start: float,
        initial: Mapping[str, Any] | None,
        settings: Settings,
    ) -> None:
        self.subject, self.settings = subject, settings
        self.t_start, self.t_end, self.initial = t_start, t_end, initial
        self.forks: dict[int, Fork] = {0: Fork("original")}
        self.current, self._next = 0, 1
        self._branches: dict[int, Branch] = {}  # made when they are asked for
        self.branch(0)  # errors in the arguments belong here

    # ------------------------------------------------------------------ what runs
    def checked(self, branch: int | None) -> int:
        """Return the number of a branch, by default the current one; refuse one there is not."""
        number = self.current if branch is None else branch
        if checked_integer("branch", number, None, SessionError) not in self.forks:
            numbers, last = list(self.forks), max(self.forks)
            known = f"0 to {last}" if len(numbers) == last + 1 else ", ".join(map(str, numbers))
            there = f"there are {known}" if last else "there is only branch 0; poke makes another"
            raise SessionError(f"no branch {shown(number)}", advice=there)
        return number

    def branch(self, branch: int | None = None) -> Branch:
        """Return a branch to walk, by default the current one.

        Parameters
        ----------
        branch : int, optional
            Its number.

        Returns
        -------
        Branch
            Its rows, with a cursor.

        Raises
        ------
        SessionError
            If there is no such branch, or its poke is after the end of its parent.
        ParameterError
            If a value violates its rule.
        """
        number = self.checked(branch)
        if number not in self._branches:
            self._branches[number] = self._made(number, self._course(number, {}, None))
        return self._branches[number]

    def made_of(self, branch: int | None = None) -> Mounted:
        """Return model and rig, or the system, of a branch, by default of the current one."""
        return self._subject(*self._given(self.checked(branch)))

    def numbers(self, branch: int | None = None) -> dict[str, NamedNumber]:
        """Return the numbers of a branch that `set` can change, by name."""
        return numbers_of(self.made_of(branch))

    def number(self, name: str, branch: int | None = None) -> NamedNumber:
        """Return one of them; raise `ParameterError` if there is none of this name."""
        return number_of(self.made_of(branch), name)

    def trace(self, branch: int | None = None) -> Trace:
        """Return the whole run of a branch, from the start of the original run on.

        Of a branch that cannot continue it is what there is.
        """
        return self.branch(branch).whole.trace

    def failure(self, branch: int | None = None) -> SimulationError | None:
        """Return why a branch could not run to its end, or None."""
        return self.branch(branch).whole.failure

    def beginning(self, branch: int) -> float:
        """Return the time from which a branch can differ from its parent, s."""
        fork = self.forks[self.checked(branch)]
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
        number = self.checked(branch)
        fork = self.forks[number]
        own = _then(fork.values, self._own_values(number, values))
        self._put(number, replace(fork, values=own))

    def fork(
        self,
        *,
        values: Mapping[str, float] | None = None,
        law: str | None = None,
        name: str = "",
    ) -> int:
        """Begin a branch of the current one; see `gms_fsm.Session.fork`."""
        if law is not None:
            with_law(self.subject, checked_kind("law", law, str, "a text"))
        own = self._own_values(self.current, {} if values is None else values)
        return self._added(Fork(name, self.current, own, law))

    def poke(
        self,
        variables: Mapping[str, Any] | None = None,
        v: float | None = None,
        state: Mapping[Any, str] | None = None,
        *,
        t: float | None = None,
        microstep: int | None = None,
        name: str = "",
    ) -> int:
        """Begin a branch of the current one in which values change at one time.

        See `gms_fsm.Session.poke`.
        """
        past = self.branch()
        if t is None:
            edits = Edits.of(past.start, variables, v, state)
            here, between = past.here, past.between is not None
            row, step = past.cursor, None if between else past.counted(past.cursor)
            if not here.t < self.t_end:
                raise SessionError(
                    f"t = {here.t!r} s is the end of the run", advice="go back first"
                )
        else:
            t = checked_scalar("t", t, "finite")
            if not self.t_start <= t < self.t_end:
                raise SessionError(
                    f"there is no poke at t = {t!r} s",
                    advice=f"give a time from {self.t_start:g} s to before {self.t_end:g} s",
                )
            edits, step = Edits.of(past.start, variables, v, state), microstep
            row, here, between = past.found(t, microstep)
        fork = Fork(name, self.current, poke=Poke(here.t, step, edits))
        return self._added(fork, self._poked(past, edits, row, here, between))

    def rename(self, branch: int, name: str) -> None:
        """Give a branch another name."""
        number = self.checked(branch)
        if not isinstance(name, str) or not name.strip():
            raise SessionError("it must be a text", place="name", value=name)
        self.forks[number] = replace(self.forks[number], name=name.strip())

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
        number = self.checked(branch)
        parent = self.forks[number].parent
        if parent is None:
            raise SessionError("the original run cannot be deleted")
        heirs = [str(k) for k, each in self.forks.items() if each.parent == number]
        if heirs:
            raise SessionError(
                f"other branches come from branch {number}",
                advice=f"delete {', '.join(heirs)} first",
            )
        del self.forks[number]
        self._branches.pop(number, None)
        if self.current == number:
            self.current = parent

    # ------------------------------------------------------------------ results
    def compare(self, a: int | None = None, b: int | None = None) -> BranchComparison:
        """Compare two branches, by default the current one with its parent.

        See `gms_fsm.Session.compare`.
        """
        b = self.checked(b)
        a = self.forks[b].parent if a is None else self.checked(a)
        if a is None:
            raise SessionError(f"branch {b} has no parent", advice="give two branch numbers")
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
        number = self.checked(branch)
        fork, made = self.forks[number], self.branch(number)
        if len(made.start.program.ticks) and made.past is not None:
            raise SessionError(
                "a scenario that begins at a poke would count its ticks from there",
                advice="export a branch that is not poked",
            )
        return save_scenario(path, made.start, fork.name, fork.text)

    # ------------------------------------------------------------------ making
    def _own_values(self, number: int, values: Mapping[str, float]) -> dict[str, float]:
        subject = self.made_of(number)
        for name in checked_kind("values", values, Mapping, "a mapping, such as {'F_s': 1.8}"):
            number_of(subject, name)
        return {name: checked_scalar(name, value, "finite") for name, value in values.items()}

    def _added(self, fork: Fork, course: Continuation | None = None) -> int:
        number = self._next
        own = checked_kind("name", fork.name, str, "a text").strip()
        name = own or fork.text or f"branch {number}"
        self._put(number, replace(fork, name=name), course)
        self._next, self.current = number + 1, number
        return number

    def _put(self, number: int, fork: Fork, course: Continuation | None = None) -> None:
        """Put a branch in its place and make it; if it cannot start, all is as before."""
        before = dict(self.forks), dict(self._branches)
        self.forks[number] = fork
        try:
            self._branches = {k: each for k, each in before[1].items() if not self._of(k, number)}
            made = self._course(number, {}, None) if course is None else course
            self._branches[number] = self._made(number, made)
        except BaseException:
            self.forks, self._branches = before
            raise

    def _of(self, branch: int | None, number: int) -> bool:
        """Return whether a branch is another one, or comes from it."""
        while branch is not None and branch != number:
            branch = self.forks[branch].parent
        return branch is not None

    def _given(self, number: int) -> tuple[str | None, dict[str, float]]:
        """Return law and numbers that differ from those of the original run."""
        fork = self.forks[number]
        law, values = (None, {}) if fork.parent is None else self._given(fork.parent)
        return fork.law or law, _then(values, fork.values)

    def _subject(self, law: str | None, values: Mapping[str, float]) -> Mounted:
        return with_numbers(self.subject if law is None else with_law(self.subject, law), values)

    def _made(self, number: int, course: Continuation) -> Branch:
        fork = self.forks[number]
        return Branch(course, fork.parent, None if fork.poke is None else fork.poke.edits)

    def _course(self, number: int, values: Mapping[str, float], law: str | None) -> Continuation:
        """Return how a branch runs, with further numbers, or another law, from its start on."""
        fork = self.forks[number]
        values, law = _then(fork.values, values), law or fork.law
        if fork.parent is None:
            return Continuation(self._start(self._subject(law, values), self.t_start, self.initial))
        if fork.poke is None:
            return self._course(fork.parent, values, law)
        same, poke = not values and law is None, fork.poke
        past = self.branch(fork.parent) if same else Branch(self._course(fork.parent, values, law))
        return self._poked(past, poke.edits, *past.found(poke.t, poke.microstep))

    def _poked(
        self, past: Branch, edits: Edits, row: int, here: BranchRow, between: bool
    ) -> Continuation:
        was = past.start
        start = self._start(was.what, here.t, initial_with(edits, was, here))
        return Continuation(start, past, row, here if between else None)

    def _start(self, subject: Mounted, t: float, initial: Mapping[str, Any] | None) -> Problem:
        options: Any = {"t_start": t, "initial": initial, "ticks_from": self.t_start}
        return Problem.on(subject, self.t_end, self.settings, rows_at_once=1, **options)


def _then(before: Mapping[str, float], after: Mapping[str, float]) -> dict[str, float]:
    """Return values in the order of their changes: that of all elements replaces those of one."""
    return {name: each for name, each in before.items() if name not in after} | {**after}
