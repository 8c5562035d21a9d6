"""Stepping through a run: stop at a guard, see why, go back, change a value, compare.

A session has a tree of branches; a branch is a run computed row by row, with a cursor. A poke makes
a new branch from the row under the cursor, a fork one with other numbers from the start.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Unpack

from gms_fsm.errors import SessionError
from gms_fsm.foundation.arguments import checked_path, pointing, refusing
from gms_fsm.foundation.display import displayed
from gms_fsm.language import Condition
from gms_fsm.run.problem import Problem
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.run.stepped.controlled import controlled
from gms_fsm.session import _breakpoints, _conditions, _session_file
from gms_fsm.session._breakpoints import KINDS, Breakpoint
from gms_fsm.session._conditions import holds_at
from gms_fsm.session.arguments import check_row, checked_settings
from gms_fsm.session.elements import machine_of, title_of
from gms_fsm.session.explain import Why
from gms_fsm.session.here import here_at, why_at
from gms_fsm.session.results import BranchComparison, Fired, Here
from gms_fsm.session.tree import walker
from gms_fsm.session.tree.branch import Branch
from gms_fsm.session.tree.branches import Tree
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import arguments_of, mounted
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.system import System
from gms_fsm.traces.system_scope import names_of

__all__ = ["KINDS", "Branch", "BranchComparison", "Breakpoint", "Fired", "Here", "Session"]


@refusing(SessionError, rig="Session(model, rig, t_end), or Session(system, t_end)")
@pointing({"send": 'session.poke({"hot": 1}), where hot is the event'})
@displayed("html")
class Session:
    """A simulation to step through: ``Session(model, rig, t_end)``, or ``Session(system, t_end)``.

    Parameters
    ----------
    model, rig, t_end, t_start, initial, settings, **options
        As for `gms_fsm.simulate`, without ``t_eval``: there is a row at every step.

    Attributes
    ----------
    made_of : tuple
        Model, rig and t_end; the rig of a system is None.
    tree : Tree
        The branches: what each is, their numbers, whole traces and files.
    breakpoints : list of Breakpoint
        Breakpoints at which `proceed` stops.
    watches : list of str
        Expressions shown by a user interface.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> session = Session(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...                   Prescribed("0.15*sin(2*pi*t/25)"), 100.0)

    A move returns the row at which it stopped. Elements count from 0 in Python, from 1 in texts.

    >>> here = session.next_transition()
    >>> round(here.t, 3), here.fired.element, here.fired.edge, here.states[0]
    (4.913, 0, 'break_away_forward', 'slip')
    >>> print(here)
    row 11, t = 4.91276068 s, micro-step 1: v = 141.608 mm/s, F = 1.34657 N
      element 1: stick -> slip by break_away_forward

    In a system elements are named in text, counted from 1: ``why("gear 1")``.
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
        self.settings = checked_settings(settings, options)
        on, end = arguments_of("Session", model, rig, t_end)
        model = controlled(model, end, self.settings, t_start=t_start, initial=initial)
        self.made_of = model, on, end
        what = mounted(model, on, self.settings.held_period)
        self.tree = Tree(what, end, t_start, initial, self.settings)
        len(self.branch)  # makes its first row: errors in the arguments belong here
        self.breakpoints: list[Breakpoint] = []
        self.watches: list[str] = []

    def __repr__(self) -> str:
        branch = f", branch {self.current}" if self.current else ""
        return f"<Session: {self.title}; at t = {self.here.t:.9g} s{branch}>"

    # ------------------------------------------------------------------ what runs
    @property
    def start(self) -> Problem:
        """The run of the current branch, ready to start: its system, program and settings."""
        return self.branch.start

    @property
    def t_start(self) -> float:
        """Start of the run, s."""
        return self.tree.t_start

    @property
    def t_end(self) -> float:
        """End of the run, s."""
        return self.made_of[-1]

    @property
    def system(self) -> System:
        """The system that runs; of a model on a rig the one it is lowered to."""
        return self.start.system

    @property
    def model(self) -> Model:
        """The model; of a system its contact, if it has one only."""
        return self.start.model

    @property
    def rig(self) -> Rig:
        """The rig; of a system what moves its contacts."""
        return self.start.rig

    @property
    def title(self) -> str:
        """One line on what runs, and until when."""
        return f"{title_of(self.start)}, to t = {self.t_end:g} s"

    # ------------------------------------------------------------------ where we are
    @property
    def branches(self) -> list[Branch]:
        """All branches: the first is the original run; each poke and each fork adds one."""
        return [self.tree.branch(number) for number in self.tree.forks]

    @property
    def current(self) -> int:
        """Number of the current branch."""
        return self.tree.current

    @property
    def branch(self) -> Branch:
        """The current branch."""
        return self.tree.branch()

    @property
    def here(self) -> Here:
        """The row under the cursor."""
        return self.at(self.branch.cursor)

    def at(self, row: int) -> Here:
        """Return a computed row.

        Parameters
        ----------
        row : int
            Row number; for the cursor row, the result is the located point after it, if any.

        Returns
        -------
        Here
            The row.
        """
        check_row(row, len(self.branch))
        return here_at(self.branch, row)

    def step(self, count: int = 1) -> Here:
        """Go forward by rows (each micro-step is a row).

        Parameters
        ----------
        count : int
            Number of rows.

        Returns
        -------
        Here
            The row reached: the last row if the run ended before.
        """
        walker.step(self.branch, count)
        return self.here

    def back(self, count: int = 1) -> Here:
        """Go back by a number of rows, and return the row reached."""
        walker.back(self.branch, count)
        return self.here

    def next_transition(self) -> Here:
        """Go forward to the next firing (or the end)."""
        walker.next_firing(self.branch)
        return self.here

    def prev_transition(self) -> Here:
        """Go back to the previous firing (or the start)."""
        walker.previous_firing(self.branch)
        return self.here

    def goto(self, t: float) -> Here:
        """Go to the last row at or before a time.

        Parameters
        ----------
        t : float
            Time, s; not before the start.

        Returns
        -------
        Here
            The row.

        Raises
        ------
        SessionError
            If the time is before the start, or is not a number.
        """
        walker.goto(self.branch, t)
        return self.here

    @property
    def names(self) -> list[str]:
        """Names allowed in conditions and watches, with elements numbered from 1.

        Variables of a single element need no number. In a system: its names, and ``gear.F``.
        """
        return names_of(self.start.what)

    def parse(self, text: str) -> Condition:
        """Parse a condition such as ``"z1 > 0.3 and state(2) == slip"``.

        Parameters
        ----------
        text : str
            Numbers may have units. ``s`` is the Stribeck curve at v, ``s1`` the threshold of
            element 1. In a system: ``"x_l > 0.1 and gear.state(1) == left"``.

        Returns
        -------
        Condition
            The parsed and checked condition.

        Raises
        ------
        ExpressionError
            If it cannot be parsed; the message names the column and what is allowed.
        """
        return _conditions.read(self.start, text)

    def values(self) -> dict[str, Any]:
        """Return the values at the cursor of all names allowed in conditions."""
        return self.branch.watches(self.branch.here)

    def watch(self, text: str) -> float:
        """Return the value of an expression at the cursor.

        Parameters
        ----------
        text : str
            For example ``"z1 / s1"``.

        Returns
        -------
        float
            Its value.

        Raises
        ------
        ExpressionError
            If it cannot be parsed.
        SessionError
            If it cannot be computed here, for example because of a division by zero.
        """
        return _conditions.value_of(self.start, text, self.values())

    def until(self, condition: str, *, back: bool = False) -> Here:
        """Go as `reaches` does, and return the point reached, or the end or start of the run."""
        self.reaches(condition, back=back)
        return self.here

    def reaches(self, condition: str, *, back: bool = False) -> bool:
        """Go forward to the next point where a condition becomes true, located between rows.

        Parameters
        ----------
        condition : str
            See `parse`. If it is already true, it must first become false.
        back : bool
            Go back instead, to the last point before this one where the condition was true.

        Returns
        -------
        bool
            False if the end of the run was reached, or going back its start.

        Examples
        --------
        >>> from gms_fsm import GMS, GMSParameters, Prescribed
        >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
        >>> session = Session(model, Prescribed("0.15*sin(2*pi*t/25)"), 20.0)
        >>> session.reaches("v < -0.1"), round(session.here.t, 3)
        (True, 15.403)
        >>> session.reaches("t > 1"), session.here.t  # it is, and stays so
        (False, 20.0)
        >>> session.reaches("v > 0.1", back=True), round(session.here.t, 3)  # the last time
        (True, 9.597)
        """
        tree, branch = self.parse(condition), self.branch
        walk = walker.reached if back else walker.reaches
        return walk(branch, lambda row: holds_at(tree, branch, row))

    # ------------------------------------------------------------------ breakpoints
    def break_on(
        self,
        kind: str,
        name: str,
        element: int | str | None = None,
        condition: str = "",
        hits: int = 1,
    ) -> Breakpoint:
        """Set a breakpoint.

        Parameters
        ----------
        kind : {"tested", "valid", "fires", "enter", "leave", "changes"}
            See `Breakpoint`.
        name : str
            An edge (tested, valid, fires), a state (enter, leave) or an expression (changes).
        element : int or str, optional
            Element index, from 0; in a system ``"gear 1"``, or ``"gear"`` for all elements of the
            contact. All elements if omitted.
        condition : str, optional
            Additional condition that must hold.
        hits : int
            Number of the first hit at which to stop.

        Returns
        -------
        Breakpoint
            The breakpoint, which is also appended to `breakpoints`.

        Raises
        ------
        SessionError
            If kind, name, element or hits is invalid.
        ExpressionError
            If the condition cannot be parsed.
        """
        found = _breakpoints.new_breakpoint(self.start, kind, name, element, condition, hits)
        self.breakpoints.append(found)
        return found

    def proceed(self, *, back: bool = False) -> tuple[Here, Breakpoint | None]:
        """Go forward to the next breakpoint that hits, or the end; or back, without counting hits.

        Returns
        -------
        (Here, Breakpoint or None)
            The row reached and the breakpoint; None at the end of the run, or at its start.
        """
        points = [(each, _breakpoints.hitting(each, self.branch)) for each in self.breakpoints]
        for row in (walker.backward if back else walker.forward)(self.branch):
            for point, hits in points:
                if hits(row):
                    point.seen += not back
                    if back or point.seen >= point.hits:
                        return self.here, point
        return self.here, None

    def why(self, element: int | str = 0, edge: str = "") -> Why:
        """Explain the edges of an element at the cursor, clause by clause.

        On a row where it fired, these are the edges of the state it left; the edge taken is marked.

        Parameters
        ----------
        element : int or str
            Element index, from 0; in a system the text ``"gear 1"``, counted from 1.
        edge : str, optional
            Explain only this edge; all if omitted. On a row where the element fired, the edge may
            also leave the state that was entered.

        Returns
        -------
        Why
            One `Explanation` per edge, highest priority first; printed, the text of the debugger.

        Raises
        ------
        SessionError
            If there is no such element or edge, or the edge leaves a different state.

        Examples
        --------
        >>> from gms_fsm import GMS, GMSParameters, Prescribed
        >>> model = GMS(GMSParameters.paper("stick-slip"), law="published")
        >>> session = Session(model, Prescribed("0.15*sin(2*pi*t/25)"), 30.0)
        >>> here = session.goto(25.0)
        >>> print(session.why())
        element 1 is in slip at t = 24.9999735 s
        arrest does not fire: |z| < s is false by 0.776 m.
          1 arrest: slip -> stick
            true   |v| <= v_c  left 1          right 1          margin 0 µm/s (rounding)
            false  |z| < s     left 2.2762     right 1.5        margin -0.776 m
        >>> session.why()[0].clauses[1].holds
        False
        """
        return why_at(self.branch, machine_of(element, self.start), edge)

    # ------------------------------------------------------------------ branches
    @refusing(SessionError, 'give variables in one mapping: {"z": {0: 0.1}}')
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
        """Change values at the cursor and continue in a new branch; the present one is kept.

        Ticks of samplers and of contacts with a period stay where they are.

        Parameters
        ----------
        variables : mapping of str to float, or to mapping of int to float, optional
            New values of the variables of the chart, by element index, from 0:
            ``{"z": {0: 0.1}, "w": {1: 2.0}}``. In a system by the names of ``initial``:
            ``{"load.x": 0.1, "gear.z": {0: 0.1}, "u": 0.0}``; ``{"overheat": 1}`` sends an event.
        v : float, optional
            New velocity, m/s; not allowed if the velocity is prescribed.
        state : mapping of int or str to str, optional
            New states by element; in a system ``{"gear 1": "left"}``. The time in the state is
            then 0.
        t : float, optional
            When, s, if not at the cursor: after the rows of this time, or between two rows.
        microstep : int, optional
            After the row of time t with this micro-step, if there is one.
        name : str, optional
            By default what is changed.

        Returns
        -------
        int
            Number of the new branch, which becomes the current one.

        Raises
        ------
        SessionError
            If there is nothing to change, no such variable or element, or this is not before the
            end of the run.
        ParameterError, ChartError
            If a value violates its rule, or a locked contact would move.

        Examples
        --------
        >>> from gms_fsm import GMS, GMSParameters, Prescribed
        >>> model = GMS(GMSParameters.paper("stick-slip"), law="published")
        >>> session = Session(model, Prescribed("0.15*sin(2*pi*t/25)"), 30.0)
        >>> here = session.goto(25.0)
        >>> session.poke({"z": {0: -1.4, 1: 0.0}}, state={3: "slip"})
        1
        >>> session.here.z[:2], session.here.states[3]
        ((-1.4, 0.0), 'slip')
        """
        return self.tree.poke(variables, v, state, t=t, microstep=microstep, name=name)

    def fork(
        self, *, values: Mapping[str, float] | None = None, law: str | None = None, name: str = ""
    ) -> int:
        """Begin a branch of the current one with other numbers or law, from the start of the run.

        Parameters
        ----------
        values : mapping of str to float, optional
            By name, as ``tree.numbers()`` has them: ``"F_s"``, ``"k2"``, ``"gear.F_s"``.
        law : {"published", "signed"}, optional
            Of a GMS model.
        name : str, optional
            By default what differs.

        Returns
        -------
        int
            Number of the new branch, which becomes the current one.

        Raises
        ------
        ParameterError
            If there is no such number or law, or a value violates its rule.

        Examples
        --------
        >>> from gms_fsm import GMS, GMSParameters, Prescribed
        >>> model = GMS(GMSParameters.paper("stick-slip"), law="published")
        >>> session = Session(model, Prescribed("0.15*sin(2*pi*t/25)"), 30.0)
        >>> session.fork(values={"F_s": 1.7}), session.tree.forks[1].text
        (1, 'F_s = 1.7')
        """
        return self.tree.fork(values=values, law=law, name=name)

    def switch(self, branch: int) -> Here:
        """Make the branch of this number the current one, and return the row at its cursor."""
        self.tree.current = self.tree.checked(branch)
        return self.here

    def compare(self, a: int | None = None, b: int | None = None) -> BranchComparison:
        """Compute two branches to their ends and compare them.

        Parameters
        ----------
        a, b : int, optional
            Branch numbers; by default the parent of the current branch, and the current branch.

        Returns
        -------
        BranchComparison
            Transitions (of which times two clock ticks apart are the same), and largest differences
            of the first variable and F; of a system those of every body and contact.

        Raises
        ------
        SessionError
            If there is no such branch, or nothing was poked.

        Examples
        --------
        >>> from gms_fsm import GMS, GMSParameters, Prescribed
        >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
        >>> session = Session(model, Prescribed("0.15*sin(2*pi*t/25)"), 30.0)
        >>> here = session.goto(6.0)
        >>> session.poke({"z": {0: -0.2}})
        1
        >>> print(session.compare())
        branches 0 and 1 until t = 30 s: 16 and 16 transitions
          first different transition at t = 19.3374771 s
          largest difference: z 599 mm, F 374 mN
        """
        return self.tree.compare(a, b)

    def save(self, path: str | Path) -> Path:
        """Write the session: the system, the pokes, cursors, breakpoints and watches.

        Rows are not written; loading computes them again, bit-identical on the same machine.

        Parameters
        ----------
        path : str or Path
            A JSON file.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        SessionError
            If a signal is a Python function, the method a class, or the engine custom machines.
        OutputError
            If the file cannot be written.
        """
        return _session_file.write(checked_path("path", path), self)

    @classmethod
    def load(cls, path: str | Path) -> Session:
        """Read a session written by `save` and compute its rows again.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Session
            With the same branches and cursors.

        Raises
        ------
        TraceFileError
            If the file is missing, damaged or not a session file.
        """
        path = checked_path("path", path)
        with _session_file.blamed(path):
            return _session_file.read(path, cls)
