"""The step-by-step core: stop a run at a guard, see why, go back, change a value, compare.

No user interface here. A session holds branches; a branch is a run under way, row by row, with a
cursor. A poke makes a new branch from the row under the cursor; the branch it came from stays as it
is.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Unpack

from gms_fsm._arguments import checked_path
from gms_fsm.errors import SessionError
from gms_fsm.inspection import _breakpoints, _conditions, _session_file, _walker
from gms_fsm.inspection._asked import check_branch, check_element, check_row, checked_settings
from gms_fsm.inspection._branch import Branch
from gms_fsm.inspection._breakpoints import KINDS, Breakpoint
from gms_fsm.inspection._conditions import holds_at
from gms_fsm.inspection._here import here_at, why_at
from gms_fsm.inspection._poking import Edits, initial_with
from gms_fsm.inspection._session_file import BranchRecord, SessionRecord
from gms_fsm.inspection._told import Comparison, Fired, Here, compared
from gms_fsm.inspection.explain import Why
from gms_fsm.language import Condition
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.run.simulate import Run
from gms_fsm.run.start import Start
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.traces.scope import watch_names

__all__ = ["KINDS", "Branch", "Breakpoint", "Comparison", "Fired", "Here", "Session"]


class Session:
    """A simulation one can walk through.

    Parameters
    ----------
    model, rig, t_end, t_start, initial, settings, **options
        As for `gms_fsm.simulate`; there is a row at every step, so no ``t_eval``.

    Attributes
    ----------
    branches : list of Branch
        The first is the run itself; each poke adds one.
    current : int
        Number of the branch that is walked.
    breakpoints : list of Breakpoint
        Where `proceed` stops.
    watches : list of str
        Expressions shown by a user interface.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> session = Session(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...                   Prescribed("0.15*sin(2*pi*t/25)"), 100.0)
    >>> session
    <Session: GMS, 4 elements, published law; prescribed velocity, to t = 100 s; at t = 0 s>

    A move returns where it stopped: fields to compute with, and printed, a line to read. Elements
    count from 0 here, and from 1 in all that is printed and in conditions.

    >>> here = session.next_transition()
    >>> round(here.t, 3), here.fired.element, here.fired.edge, here.states[0]
    (4.913, 0, 'break_away_forward', 'slip')
    >>> print(here)
    row 12, t = 4.91276067 s, micro-step 1: v = 0.141608 m/s, F = 1.34657 N
      element 1: stick -> slip by break_away_forward
    """

    def __init__(
        self,
        model: Model,
        rig: Rig,
        t_end: float,
        *,
        t_start: float = 0.0,
        initial: Mapping[str, Any] | None = None,
        settings: Settings | None = None,
        **options: Unpack[SettingOptions],
    ) -> None:
        self.settings = checked_settings(settings, options)
        self.model, self.rig, self.t_end = model, rig, t_end
        self.t_start, self.initial = t_start, initial
        self.branches = [Branch(self._run(t_start, initial))]
        self.current = 0
        self.breakpoints: list[Breakpoint] = []
        self.watches: list[str] = []

    def _run(self, t_start: float, initial: Mapping[str, Any] | None) -> Run:
        """Return a run of this model from other values."""
        return Run(
            Start.of(
                self.model,
                self.rig,
                self.t_end,
                self.settings,
                t_start=t_start,
                initial=initial,
                rows_at_once=1,
            )
        )

    def __repr__(self) -> str:
        branch = f", branch {self.current}" if self.current else ""
        return (
            f"<Session: {self.model.title}; {self.rig.title}, to t = {self.t_end:g} s; "
            f"at t = {self.here.t:.9g} s{branch}>"
        )

    # ------------------------------------------------------------------ where we are
    @property
    def branch(self) -> Branch:
        """The branch that is walked."""
        return self.branches[self.current]

    @property
    def here(self) -> Here:
        """The row under the cursor."""
        return self.at(self.branch.cursor)

    def at(self, row: int) -> Here:
        """Return a row that has been computed.

        Parameters
        ----------
        row : int
            Its number; the row under the cursor may be a located place behind it.

        Returns
        -------
        Here
            The row.
        """
        check_row(row, len(self.branch))
        return here_at(self.branch, row)

    # ------------------------------------------------------------------ walking
    def step(self, count: int = 1) -> Here:
        """Go forward by rows (micro-steps are rows of their own).

        Parameters
        ----------
        count : int
            How many.

        Returns
        -------
        Here
            Where it stopped: the last row if the run ended before.
        """
        _walker.step(self.branch, count)
        return self.here

    def back(self, count: int = 1) -> Here:
        """Go back by rows.

        Parameters
        ----------
        count : int
            How many.

        Returns
        -------
        Here
            Where it stopped.
        """
        _walker.back(self.branch, count)
        return self.here

    def next_transition(self) -> Here:
        """Go forward to the next firing (or the end)."""
        _walker.next_firing(self.branch)
        return self.here

    def prev_transition(self) -> Here:
        """Go back to the firing before (or the start)."""
        _walker.previous_firing(self.branch)
        return self.here

    def goto(self, t: float) -> Here:
        """Go to the last row at or before a time.

        Parameters
        ----------
        t : float
            s, not before the start.

        Returns
        -------
        Here
            The row.

        Raises
        ------
        SessionError
            If the time lies before the start, or is no number.
        """
        _walker.goto(self.branch, t)
        return self.here

    # ------------------------------------------------------------------ conditions
    @property
    def names(self) -> list[str]:
        """What conditions and watches can name; elements counted from 1.

        A single element's variables need no number.
        """
        return watch_names(self.model)

    def parse(self, text: str) -> Condition:
        """Read a condition such as ``"z1 > 0.3 and state(2) == slip"``.

        Parameters
        ----------
        text : str
            In the expression language; ``s`` is the Stribeck curve at v, ``s1`` element 1's
            threshold.

        Returns
        -------
        Condition
            Checked.

        Raises
        ------
        ExpressionError
            With column and what is allowed.
        """
        return _conditions.read(self.model, text)

    def values(self) -> dict[str, Any]:
        """Return a value for every name of a condition, at the cursor."""
        return self.branch.scope(self.branch.here).watches()

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
            If it cannot be read.
        SessionError
            If it cannot be computed here (a division by zero).
        """
        return _conditions.value_of(self.model, text, self.values())

    def until(self, condition: str) -> Here:
        """Go forward to where a condition next becomes true, located between the rows.

        Parameters
        ----------
        condition : str
            See `parse`. If it is true already it must first become false.

        Returns
        -------
        Here
            The place (``located`` is set if it lies between rows), or the end of the run.
        """
        self.reaches(condition)
        return self.here

    def reaches(self, condition: str) -> bool:
        """Go forward as `until` does, and say whether the condition became true.

        Parameters
        ----------
        condition : str
            See `parse`. If it is true already it must first become false.

        Returns
        -------
        bool
            False at the end of the run.

        Examples
        --------
        >>> from gms_fsm import GMS, GMSParameters, Prescribed
        >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
        >>> session = Session(model, Prescribed("0.15*sin(2*pi*t/25)"), 20.0)
        >>> session.reaches("v < -0.1"), round(session.here.t, 3)
        (True, 15.403)
        >>> session.reaches("t > 1"), session.here.t  # it is, and stays so
        (False, 20.0)
        """
        tree = self.parse(condition)
        return _walker.reaches(self.branch, lambda row: holds_at(tree, self.branch, row))

    # ------------------------------------------------------------------ breakpoints
    def break_on(
        self, kind: str, name: str, element: int | None = None, condition: str = "", hits: int = 1
    ) -> Breakpoint:
        """Set a breakpoint.

        Parameters
        ----------
        kind : {"tested", "valid", "fires", "enter", "leave"}
            See `Breakpoint`.
        name : str
            An edge (tested, valid, fires) or a state (enter, leave).
        element : int, optional
            Counted from 0; all when left out.
        condition : str, optional
            Must hold too.
        hits : int
            Stop from this hit on.

        Returns
        -------
        Breakpoint
            Also in `breakpoints`.

        Raises
        ------
        SessionError
            If kind, name, element or hits do not exist.
        ExpressionError
            If the condition cannot be read.
        """
        chart = self.model.chart
        found = _breakpoints.new_breakpoint(chart, kind, name, element, condition, hits)
        if element is not None:
            check_element(element, self.model)
        if condition:
            self.parse(condition)
        self.breakpoints.append(found)
        return found

    def proceed(self) -> tuple[Here, Breakpoint | None]:
        """Go forward to the next breakpoint that hits, or the end.

        Returns
        -------
        (Here, Breakpoint or None)
            Where, and which; None at the end of the run.
        """
        for row in _walker.forward(self.branch):
            for point in self.breakpoints:
                if _breakpoints.hits(point, self.model, self.branch, row):
                    point.seen += 1
                    if point.seen >= point.hits:
                        return self.here, point
        return self.here, None

    def why(self, element: int = 0, edge: str = "") -> Why:
        """Explain the edges of an element at the cursor, clause by clause.

        On a row where it fired: the edges of the state it left, with the edge taken marked.

        Parameters
        ----------
        element : int
            Counted from 0.
        edge : str, optional
            Explain this edge alone; all when left out. On a row where the element fired it may
            also leave the state that was entered.

        Returns
        -------
        Why
            An `Explanation` an edge, highest priority first; printed, the debugger's text.

        Raises
        ------
        SessionError
            If there is no such element or edge, or the edge leaves another state.

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
            true   |v| <= v_c  left 1e-06       right 1e-06       margin 0 (rounding)
            false  |z| < s     left 2.2762      right 1.5         margin -0.776 m
        >>> session.why()[0].clauses[1].holds
        False
        """
        check_element(element, self.model)
        return why_at(self.branch, element, edge)

    # ------------------------------------------------------------------ branches
    def poke(
        self,
        variables: Mapping[str, Mapping[int, float]] | None = None,
        v: float | None = None,
        state: Mapping[int, str] | None = None,
    ) -> int:
        """Change values at the cursor and go on in a new branch; the present one stays.

        Parameters
        ----------
        variables : mapping of str to mapping of int to float, optional
            New values of the chart's variables, each by element, counted from 0:
            ``{"z": {0: 0.1}, "w": {1: 2.0}}``.
        v : float, optional
            New velocity, m/s; not with a prescribed one.
        state : mapping of int to str, optional
            New states by element.

        Returns
        -------
        int
            Number of the new branch, which is now the current one.

        Raises
        ------
        SessionError
            If there is nothing to change, no such variable or element, or the run is at its end.
        ParameterError, ChartError
            If a value breaks its rule.

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
        edits = Edits.of(self.model, variables, v, state)
        branch, here = self.branch, self.branch.here
        if not here.t < self.t_end:
            raise SessionError(f"t = {here.t!r} s is the end of the run", advice="go back first")
        prescribed = self.rig.acceleration is None
        initial = initial_with(edits, branch.scope(here), prescribed=prescribed)
        run = self._run(here.t, initial)
        new = Branch(run, self.current, branch.cursor, branch, edits, branch.between)
        new.cursor = new.offset
        self.branches.append(new)
        self.current = len(self.branches) - 1
        return self.current

    def switch(self, branch: int) -> Here:
        """Walk another branch, from where its cursor is.

        Parameters
        ----------
        branch : int
            Its number.

        Returns
        -------
        Here
            The row under its cursor.

        Raises
        ------
        SessionError
            If there is no such branch.
        """
        check_branch(branch, len(self.branches))
        self.current = branch
        return self.here

    def compare(self, a: int | None = None, b: int | None = None) -> Comparison:
        """Compute two branches to their ends and compare them.

        Parameters
        ----------
        a, b : int, optional
            Branch numbers; when left out the branch that this one was poked from, and this one.

        Returns
        -------
        Comparison
            Transitions, and largest differences of the first variable and F.

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
          first different transition at t = 12.4999735 s
          largest difference: z 0.599 m, F 0.375 N
        """
        for number in (a, b):
            if number is not None:
                check_branch(number, len(self.branches))
        b = self.current if b is None else b
        a = self.branches[b].parent if a is None else a
        if a is None:
            raise SessionError(f"branch {b} has no parent", advice="name two branches")
        for number in (a, b):
            self.branches[number].complete()
        return compared((a, b), self.branches[a].trace(), self.branches[b].trace())

    # ------------------------------------------------------------------ files
    def save(self, path: str | Path) -> Path:
        """Write the session: what runs, the pokes, cursors, breakpoints and watches.

        Rows are not written; loading computes them again, to the same bits on the same machine.

        Parameters
        ----------
        path : str or Path
            A JSON file.

        Returns
        -------
        Path
            The file, written whole.

        Raises
        ------
        SessionError
            If a signal is a Python function, the method a class, or the engine your own machines.
        OutputError
            If the rig is of a class of your own, or the file cannot be written.
        """
        record = SessionRecord(
            self.model,
            self.rig,
            self.t_end,
            _session_file.options_of(self.settings, self.t_start, self.initial),
            [BranchRecord.of(branch) for branch in self.branches],
            self.current,
            self.breakpoints,
            self.watches,
        )
        return _session_file.write(checked_path("path", path), record)

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
            With all branches and cursors where they were.

        Raises
        ------
        TraceFileError
            If the file is missing, damaged or something else.
        """
        path = checked_path("path", path)
        with _session_file.blamed(path):
            return cls._of(_session_file.read(path))

    @classmethod
    def _of(cls, record: SessionRecord) -> Session:
        """Walk to every place of a session again."""
        session = cls(record.model, record.rig, record.t_end, **record.options)
        for branch in record.branches:
            if branch.edits is not None:
                assert branch.parent is not None
                session.switch(branch.parent)
                _walker.walk_to(session.branch, branch.fork, branch.begin)
                session.poke(branch.edits.variables, branch.edits.v, branch.edits.state)
        for number, branch in enumerate(record.branches):
            session.switch(number)
            _walker.walk_to(session.branch, branch.cursor, branch.between)
        session.switch(record.current)
        for point in record.breakpoints:
            found = session.break_on(
                point.kind, point.name, point.element, point.condition, point.hits
            )
            found.seen = point.seen
        session.watches = list(record.watches)
        return session
