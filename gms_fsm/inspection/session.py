"""The step-by-step core: stop a run at a guard, see why, go back, change a value, compare.

No user interface here. A session holds branches; a branch is a run under way, row by row, with a
cursor. Rows once computed are kept, so going back and forward shows the same bits. A poke makes a
new branch from the row under the cursor; the branch it came from stays as it is. A run that cannot
go on is no exception here but an outcome of its branch.
"""

from __future__ import annotations

import json
import signal
import threading
from bisect import bisect_left
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from gms_fsm._files import written_whole
from gms_fsm.errors import ExpressionError, ParameterError, SessionError, TraceFileError, shown, why
from gms_fsm.inspection.explain import Why, explain_state, holds
from gms_fsm.language.expression import Condition, Value, evaluate, parse_condition, parse_value
from gms_fsm.run.simulate import Run
from gms_fsm.run.start import Start
from gms_fsm.systems.models import Model, parameter_names
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Function
from gms_fsm.traces._header import Header
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.trace import Rows, Trace, interpolated, log_of
from integrators import Firing, Stop

__all__ = ["Branch", "Breakpoint", "Comparison", "Fired", "Here", "Session"]

Kind = Literal["tested", "valid", "fires", "enter", "leave"]
KINDS: tuple[Kind, ...] = ("tested", "valid", "fires", "enter", "leave")
LOOKS = 16  # places between two rows at which a condition is tried
HALVINGS = 60
Row: TypeAlias = tuple[float, int, list[float], tuple[int, ...]]  # time, micro-step, y, modes


@dataclass(frozen=True)
class Fired:
    """The firing that made a row.

    Parameters
    ----------
    element : int
        Counted from 0.
    edge, source, target : str
        The edge taken, the state it left and the state it entered.
    """

    element: int
    edge: str
    source: str
    target: str

    def __str__(self) -> str:
        return f"element {self.element + 1}: {self.source} -> {self.target} by {self.edge}"


@dataclass(frozen=True)
class Here:
    """One row of a branch; printed, it is what the debugger says after a move.

    Parameters
    ----------
    row : int
        Its number in the branch.
    t, x, v, F : float
        s, m, m/s, N.
    microstep : int
        0 before the firings of this time.
    z, s, F_elements : tuple of float
        m, m, N; one an element (z is the chart's first variable).
    states : tuple of str
        Active states.
    located : bool
        Whether it lies between rows, where a condition became true.
    fired : Fired or None
        The firing that made it, if one did.
    """

    row: int
    t: float
    microstep: int
    x: float
    v: float
    F: float
    z: tuple[float, ...]
    s: tuple[float, ...]
    F_elements: tuple[float, ...]
    states: tuple[str, ...]
    located: bool
    fired: Fired | None

    def __str__(self) -> str:
        place = f"between rows {self.row} and {self.row + 1}" if self.located else f"row {self.row}"
        step = f", micro-step {self.microstep}" if self.microstep else ""
        fired = "" if self.fired is None else f"\n  {self.fired}"
        return f"{place}, t = {self.t:.9g} s{step}: v = {self.v:.6g} m/s, F = {self.F:.6g} N{fired}"


@dataclass
class Breakpoint:
    """Where `Session.proceed` stops.

    Parameters
    ----------
    kind : {"tested", "valid", "fires", "enter", "leave"}
        Guard of an edge asked, guard becoming true, edge taken; state entered or left.
    name : str
        The edge's or the state's name.
    element : int or None
        Counted from 0; None for all.
    condition : str
        Must hold too; empty for none.
    hits : int
        Stop at this hit, and at every one after it.
    seen : int
        Hits so far.
    """

    kind: Kind
    name: str
    element: int | None = None
    condition: str = ""
    hits: int = 1
    seen: int = 0


@dataclass(frozen=True)
class Comparison:
    """Two branches against each other; printed, the debugger's text.

    Parameters
    ----------
    branches : tuple of int
        Their numbers.
    t : float
        Until when, s (the shorter of the two).
    transitions : tuple of int
        How many each has until then.
    first_difference : float or None
        Time of the first transition that differs, s; None if none does.
    variable : str
        The chart's first.
    z, F : float
        Largest differences of this variable and of the friction force [N] on common times.
    """

    branches: tuple[int, int]
    t: float
    transitions: tuple[int, int]
    first_difference: float | None
    variable: str
    z: float
    F: float

    def __str__(self) -> str:
        (a, b), (p, q) = self.branches, self.transitions
        z = f"{self.variable} {self.z:.3g}{' m' if self.variable == 'z' else ''}"
        return (
            f"branches {a} and {b} until t = {self.t:.9g} s: {p} and {q} transitions\n"
            + (
                "  the same transitions\n"
                if self.first_difference is None
                else f"  first different transition at t = {self.first_difference:.9g} s\n"
            )
            + f"  largest difference: {z}, F {self.F:.3g} N"
        )


class Branch:
    """A run under way, row by row, behind an unchanged part of its parent.

    Parameters
    ----------
    run : Run
        From where the branch begins.
    parent : int or None
        Number of the branch it was poked from.
    fork : int
        The parent's row under the cursor then; rows 0 to fork are shared.
    shared : Branch or None
        The parent itself.
    edits : mapping
        What was poked.
    begin : row or None
        The place of the poke, as `raw` has it, if it was between two rows: a row of this branch.
    """

    def __init__(
        self,
        run: Run,
        parent: int | None = None,
        fork: int = -1,
        shared: Branch | None = None,
        edits: Mapping[str, Any] | None = None,
        begin: Row | None = None,
    ) -> None:
        self.run, self.parent, self.fork, self.shared = run, parent, fork, shared
        self.edits, self.begin = dict(edits or {}), begin
        self.outcome = ""  # "" while it goes on, "end", or the message of what stopped it
        self.cursor = 0
        self.between: tuple[float, list[float]] | None = None  # a located place behind the cursor
        self.offset = fork + 1 + (begin is not None)
        self.stops: set[int] = set()  # rows at which the machines were asked
        self.firings: list[int] = []  # rows made by firings, own part
        self.pull()

    # ------------------------------------------------------------------ rows
    def __len__(self) -> int:
        return self.offset + len(self.run.recorder.rows.t)

    def pull(self) -> bool:
        """Compute at least one more row; return whether there is one."""
        before = len(self)
        with _unbroken():
            while not self.outcome and len(self) == before:
                try:
                    if not self.run.advance():
                        self.outcome = "end"
                    elif isinstance(self.run.event, Stop):
                        self.stops.add(len(self) - 1)
                    elif isinstance(self.run.event, Firing):
                        self.firings.append(len(self) - 1)
                except SimulationError as error:
                    self.outcome = str(error)
        return len(self) > before

    def complete(self) -> None:
        """Compute all rows up to the end, or to where the run cannot go on."""
        while self.pull():
            pass

    def raw(self, row: int) -> Row:
        """Return time, micro-step, state and modes of a row."""
        if row <= self.fork:
            assert self.shared is not None
            return self.shared.raw(row)
        if row < self.offset:
            assert self.begin is not None
            return self.begin
        rows, i = self.run.recorder.rows, row - self.offset
        return rows.t[i], rows.microstep[i], rows.y[i], rows.mode[i]

    def log(self) -> list[tuple[Any, ...]]:
        """Return all firings so far, the shared part included."""
        before: list[tuple[Any, ...]] = []
        if self.shared is not None:
            before = [self.shared.record(row) for row in self.shared.firing_rows(self.fork + 1)]
        return before + self.run.recorder.log

    def firing_rows(self, end: int) -> list[int]:
        """Return the rows before `end` that firings made."""
        before = [] if self.shared is None else self.shared.firing_rows(min(end, self.fork + 1))
        return before + self.firings[: bisect_left(self.firings, end)]

    def record(self, row: int) -> tuple[Any, ...]:
        """Return the log's record of the firing that made a row."""
        if row <= self.fork:
            assert self.shared is not None
            return self.shared.record(row)
        return self.run.recorder.log[bisect_left(self.firings, row)]

    def fired(self, row: int) -> Fired | None:
        """Return the firing that made a row, None if none did."""
        if row not in self.firing_rows(row + 1)[-1:]:
            return None
        _, element, edge, source, target = self.record(row)[:5]
        return Fired(int(element), str(edge), str(source), str(target))

    def trace(self) -> Trace:
        """Return the branch so far as a trace."""
        raw = [self.raw(row) for row in range(len(self))]
        recorder = self.run.recorder
        modes = recorder.start.program.modes
        rows = Rows(
            np.array([r[0] for r in raw]),
            np.array([r[1] for r in raw], dtype=np.int64),
            np.array([r[2] for r in raw]),
            np.array([r[3] for r in raw], dtype=np.int64).reshape(len(raw), modes),
        )
        return Trace(
            rows,
            rows,
            log_of(self.log()),
            recorder.start.model,
            recorder.start.rig,
            recorder.start.settings,
        )


class Session:
    """A simulation one can walk through.

    Parameters
    ----------
    model, rig, t_end, **options
        As for `gms_fsm.simulate` (without ``t_eval`` and ``progress``).

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

    def __init__(self, model: Model, rig: Rig, t_end: float, **options: Any) -> None:
        for name in ("t_eval", "progress"):
            if name in options:
                raise ParameterError(f"{name} does not go with a session: it stops at every row")
        if "monitors" in options:
            raise ParameterError(
                "monitors look at a finished run: "
                "gms_fsm.traces.monitors.examine(session.branch.trace(), ...)"
            )
        if not isinstance(options.get("engine", ""), str):
            raise ParameterError(
                "engine: every branch of a session makes machines of its own; use 'machines' or "
                "'ifelse'"
            )
        self.model, self.rig, self.t_end, self.options = model, rig, t_end, dict(options)
        self.branches = [Branch(Run(Start.of(model, rig, t_end, rows_at_once=1, **options)))]
        self.current = 0
        self.breakpoints: list[Breakpoint] = []
        self.watches: list[str] = []

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
        branch = self.branch
        t, microstep, y, mode = branch.raw(row)
        located = row == branch.cursor and branch.between is not None
        if located:
            assert branch.between is not None
            (t, y), microstep = branch.between, 0
        return self._here(row, t, microstep, y, mode, located)

    def _here(
        self,
        row: int,
        t: float,
        microstep: int,
        y: list[float],
        mode: tuple[int, ...],
        located: bool = False,
    ) -> Here:
        recorder, n = self.branch.run.recorder, self.model.n
        seen = recorder.observe(t, y, mode)
        first = recorder.start.program.first
        names = [state.name for state in self.model.chart.states]
        return Here(
            row,
            t,
            microstep,
            y[0],
            seen[0],
            seen[1],
            tuple(y[first : first + n]),
            tuple(seen[2 : 2 + n]),
            tuple(seen[2 + n : 2 + 2 * n]),
            tuple(names[m] for m in mode[:n]),
            located,
            None if located else self.branch.fired(row),
        )

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
        branch = self.branch
        if count < 0:
            raise SessionError(f"count is {count}; it must be at least 0")
        branch.between = None
        for _ in range(count):
            if branch.cursor + 1 >= len(branch) and not branch.pull():
                break
            branch.cursor += 1
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
        branch = self.branch
        if count < 0:
            raise SessionError(f"count is {count}; it must be at least 0")
        if branch.between is not None and count > 0:  # from a located place to the row before it
            branch.between, count = None, count - 1
        branch.cursor = max(0, branch.cursor - count)
        return self.here

    def _forward(self) -> Iterator[int]:
        """Walk forward; yield each new row's number."""
        branch = self.branch
        while True:
            before = branch.cursor
            self.step()
            if branch.cursor == before:
                return
            yield branch.cursor

    def next_transition(self) -> Here:
        """Go forward to the next firing (or the end)."""
        for row in self._forward():
            if self.branch.raw(row)[1] > 0:
                break
        return self.here

    def prev_transition(self) -> Here:
        """Go back to the firing before (or the start)."""
        branch = self.branch
        row = branch.cursor - (branch.between is None)
        branch.between = None
        while row > 0 and branch.raw(row)[1] == 0:
            row -= 1
        branch.cursor = max(row, 0)
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
        branch = self.branch
        start = branch.raw(0)[0]
        if not t >= start:
            raise SessionError(f"t = {shown(t)} s lies before the start, {start!r} s")
        branch.between = None
        while branch.raw(len(branch) - 1)[0] <= t and branch.pull():
            pass
        low, high = 0, len(branch)
        while high - low > 1:  # rows are in time order
            middle = (low + high) // 2
            low, high = (middle, high) if branch.raw(middle)[0] <= t else (low, middle)
        branch.cursor = low
        return self.here

    # ------------------------------------------------------------------ conditions
    @property
    def names(self) -> list[str]:
        """What conditions and watches can name; elements counted from 1.

        A single element's variables need no number.
        """
        elements, variables = range(1, self.model.n + 1), self.model.chart.variables
        bare = variables if self.model.n == 1 else ()
        threshold = () if self.model.stribeck is None else ("s",)
        numbered = (f"{name}{i}" for name in (*variables, *threshold, "F") for i in elements)
        return ["t", "x", "v", "F", *threshold, *bare, *numbered]

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
        states = [state.name for state in self.model.chart.states]
        n = self.model.n
        with self._numbered():
            return parse_condition(text, self.names, states, n, own_state=n == 1)

    @contextmanager
    def _numbered(self) -> Iterator[None]:
        """Say of a variable without an element's number that it needs one."""
        try:
            yield
        except ExpressionError as error:
            for name in self.model.chart.variables:
                if error.reason == f"unknown name {name!r}":
                    reason = f"{error.reason}; for element 1 write {name}1"
                    raise ExpressionError(reason, error.text, error.column, error.allowed) from None
            raise

    def values(self, here: Here | None = None) -> dict[str, Any]:
        """Return a value for every name of a condition, at the cursor if not said otherwise."""
        here = self.here if here is None else here
        y = self._state_of(here)
        found: dict[str, Any] = {
            "t": here.t,
            "x": here.x,
            "v": here.v,
            "F": here.F,
            "s": here.s[0] / float(self.model.weights[0]),
        }
        n, first = self.model.n, self.branch.run.recorder.start.program.first
        for i in range(n):
            for j, name in enumerate(self.model.chart.variables):
                found[f"{name}{i + 1}"] = y[first + j * n + i]
            found |= {
                f"s{i + 1}": here.s[i],
                f"F{i + 1}": here.F_elements[i],
                f"state({i + 1})": here.states[i],
            }
        if n == 1:
            found |= {name: found[f"{name}1"] for name in self.model.chart.variables}
            found["state(0)"] = here.states[0]  # what `state == name` asks for
        return found

    def _state_of(self, here: Here) -> list[float]:
        if here.located and self.branch.between is not None:
            return self.branch.between[1]
        return self.branch.raw(here.row)[2]

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
        with self._numbered():
            tree: Value = parse_value(text, self.names)
        try:
            return float(evaluate(tree, self.values()))
        except (ArithmeticError, ValueError) as error:
            raise SessionError(f"{text!r} cannot be computed here: {error}") from None

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
        tree, branch = self.parse(condition), self.branch
        truth = self._holds(tree, self.here)
        begin = branch.between  # a second `until` starts from a located place
        while True:
            row = branch.cursor
            if row + 1 >= len(branch) and not branch.pull():
                branch.between = None
                branch.cursor = len(branch) - 1
                return False
            place, truth = self._first_true(tree, row, begin, truth)
            begin = None
            if place is not None:
                branch.between = place
                return True
            branch.between = None
            branch.cursor = row + 1
            now = self._holds(tree, self.here)
            if now and not truth:
                return True
            truth = now

    def _holds(self, tree: Condition, here: Here) -> bool:
        return holds(tree, self.values(here))

    def _first_true(
        self, tree: Condition, row: int, begin: tuple[float, list[float]] | None, truth: bool
    ) -> tuple[tuple[float, list[float]] | None, bool]:
        """Look between a row and the next for the place where the tree becomes true."""
        branch = self.branch
        t0, _, y0, mode = branch.raw(row)
        t1, microstep, y1, _ = branch.raw(row + 1)
        start = t0 if begin is None else begin[0]
        if microstep > 0 or t1 <= start:
            return None, truth
        program = branch.run.recorder.start.program
        a, b = np.array(y0), np.array(y1)

        def place(t: float) -> tuple[float, list[float]]:
            y = interpolated(program, list(mode), t0, a, t1, b, t)
            return t, [float(u) for u in y]

        def true_at(t: float) -> bool:
            branch.between = place(t)
            found = self._holds(tree, self._here(row, t, 0, branch.between[1], mode, True))
            branch.between = None
            return found

        low = start
        for look in range(1, LOOKS):
            t = start + (t1 - start) * look / LOOKS
            now = true_at(t)
            if now and not truth:
                high = t
                for _ in range(HALVINGS):
                    middle = 0.5 * (low + high)
                    if not low < middle < high:
                        break
                    low, high = (low, middle) if true_at(middle) else (middle, high)
                return place(high), True
            low, truth = t, now
        # The next row itself is looked at by the caller; the last stretch is searched here.
        at_end = self._holds(tree, self._here(row + 1, *branch.raw(row + 1)))
        if at_end and not truth:
            high = t1
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                if not low < middle < high:
                    break
                low, high = (low, middle) if true_at(middle) else (middle, high)
            if high < t1:
                return place(high), True
        return None, truth

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
        if kind not in KINDS:
            raise SessionError(f"breakpoint kind {kind!r}; it must be one of {', '.join(KINDS)}")
        edges, states = [e.name for e in chart.transitions], [s.name for s in chart.states]
        known, what = (states, "state") if kind in ("enter", "leave") else (edges, "edge")
        if name not in known:
            raise SessionError(f"no {what} {name!r}; there are {', '.join(known) or 'none'}")
        if element is not None:
            self._check_element(element)
        if hits < 1:
            raise SessionError(f"hits is {hits}; it must be at least 1")
        if condition:
            self.parse(condition)
        found = Breakpoint(kind, name, element, condition, hits)
        self.breakpoints.append(found)
        return found

    def proceed(self) -> tuple[Here, Breakpoint | None]:
        """Go forward to the next breakpoint that hits, or the end.

        Returns
        -------
        (Here, Breakpoint or None)
            Where, and which; None at the end of the run.
        """
        for row in self._forward():
            for point in self.breakpoints:
                if self._hits(point, row):
                    point.seen += 1
                    if point.seen >= point.hits:
                        return self.here, point
        return self.here, None

    def _hits(self, point: Breakpoint, row: int) -> bool:
        elements = range(self.model.n) if point.element is None else (point.element,)
        if not any(self._happens(point, row, i) for i in elements):
            return False
        return not point.condition or self._holds(self.parse(point.condition), self.at(row))

    def _happens(self, point: Breakpoint, row: int, i: int) -> bool:
        chart, branch = self.model.chart, self.branch
        before, now = branch.raw(row - 1), branch.raw(row)
        if point.kind in ("fires", "enter", "leave"):
            fired = branch.fired(row)
            if fired is None or fired.element != i:
                return False
            names = {"fires": fired.edge, "enter": fired.target, "leave": fired.source}
            return names[point.kind] == point.name
        source = chart.state_index(self._source(point.name))
        if now[3][i] != source:
            return False
        if point.kind == "tested":
            # The driver asks where an arc ends, and again after every firing. That a row was
            # such a place is known when the next one is computed.
            if row + 1 >= len(branch):
                branch.pull()
            return row in branch.stops or now[1] > 0
        guard = chart.guards[point.name]
        held = before[3][i] == source and holds(guard, self._guard_values(row - 1, i))
        return not held and holds(guard, self._guard_values(row, i))

    def _guard_values(self, row: int, i: int) -> dict[str, float]:
        here = self.at(row)
        y, n = self._state_of(here), self.model.n
        first = self.branch.run.recorder.start.program.first
        values = {"t": here.t, "x": here.x, "v": here.v, "s": here.s[i]}
        values |= {name: y[first + j * n + i] for j, name in enumerate(self.model.chart.variables)}
        for name, value in self.model.values.items():
            values[name] = float(value if isinstance(value, float | int) else value[i])
        return values

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
        self._check_element(element)
        chart, here, row = self.model.chart, self.here, self.branch.cursor
        state, left, taken = here.states[element], "", ""
        source = self._source(edge) if edge else ""
        fired = here.fired
        if fired and fired.element == element and source in ("", fired.source):
            left, taken, row = fired.source, fired.edge, row - 1
        asked = left or state
        if source not in ("", asked):
            raise SessionError(f"{edge} leaves {source}; element {element + 1} is in {state}")
        found = explain_state(chart, asked, self._guard_values(row, element), taken)
        edges = tuple(each for each in found if edge in ("", each.edge.name))
        return Why(element, here.t, state, left, edges)

    def _source(self, edge: str) -> str:
        """Return the state that an edge leaves."""
        sources = {each.name: each.source for each in self.model.chart.transitions}
        if edge not in sources:
            raise SessionError(f"no edge {edge!r}; there are {', '.join(sources) or 'none'}")
        return sources[edge]

    def _check_element(self, element: int) -> None:
        whole = isinstance(element, int | np.integer) and not isinstance(element, bool)
        if not whole or not 0 <= element < self.model.n:
            said = shown(element)
            if said in [repr(edge.name) for edge in self.model.chart.transitions]:
                said += f" (an edge is asked for by edge={said})"
            raise SessionError(
                f"no element {said}; there are 0 to {self.model.n - 1} (counted from 0 in Python, "
                "from 1 in text)"
            )

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
        here, chart, n = self.here, self.model.chart, self.model.n
        for what, given in (("variables", variables), ("state", state)):
            if given is not None and not isinstance(given, Mapping):
                raise SessionError(
                    f"{what} is {shown(given)}; give a mapping, for example "
                    "variables={'z': {0: 0.1}} or state={0: 'slip'}"
                )
        variables, state = dict(variables or {}), dict(state or {})
        for name, values in variables.items():
            if name in parameter_names(self.model):
                raise SessionError(
                    f"{name} is a parameter; for another value make another model and session"
                )
            if name not in chart.variables:
                raise SessionError(f"no variable {name!r}; there are {', '.join(chart.variables)}")
            if not isinstance(values, Mapping):
                raise SessionError(
                    f"{name} is {shown(values)}; give its values by element, for example "
                    f"{{{name!r}: {{0: 0.1}}}}"
                )
        if not (any(variables.values()) or state or v is not None):
            raise SessionError("nothing to poke; give variables, v or state")
        for element in (*(i for values in variables.values() for i in values), *state):
            self._check_element(element)
        if not here.t < self.t_end:
            raise SessionError(f"t = {here.t!r} s is the end of the run; go back first")
        y, first = self._state_of(here), self.branch.run.recorder.start.program.first
        initial: dict[str, Any] = {"x": here.x}
        for j, name in enumerate(chart.variables):
            initial[name] = list(y[first + j * n : first + (j + 1) * n])
            for element, value in variables.get(name, {}).items():
                initial[name][element] = value
        initial["states"] = [state.get(i, name) for i, name in enumerate(here.states)]
        if v is not None:
            initial["v"] = v
        elif self.rig.acceleration is not None:
            initial["v"] = here.v
        options = {**self.options, "t_start": here.t, "initial": initial}
        run = Run(Start.of(self.model, self.rig, self.t_end, rows_at_once=1, **options))
        edits = {
            "variables": {name: dict(values) for name, values in variables.items()},
            "v": v,
            "state": state,
        }
        fork = self.branch.cursor
        begin = (here.t, 0, list(y), self.branch.raw(fork)[3]) if here.located else None
        branch = Branch(run, self.current, fork, self.branch, edits, begin)
        branch.cursor = branch.offset
        self.branches.append(branch)
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
        if not 0 <= branch < len(self.branches):
            raise SessionError(f"no branch {branch}; there are 0 to {len(self.branches) - 1}")
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
        b = self.current if b is None else b
        a = self.branches[b].parent if a is None and 0 <= b < len(self.branches) else a
        if a is None:
            raise SessionError(f"branch {b} has no parent; name two branches")
        for number in (a, b):
            if not 0 <= number < len(self.branches):
                raise SessionError(f"no branch {number}; there are 0 to {len(self.branches) - 1}")
            self.branches[number].complete()
        first, second = self.branches[a].trace(), self.branches[b].trace()
        t = min(float(first.t[-1]), float(second.t[-1]))
        logs = [trace.transitions[trace.transitions.t <= t] for trace in (first, second)]
        differs = None
        for p, q in zip(*logs, strict=False):
            if (p.t, p.element, p.edge) != (q.t, q.element, q.edge):
                differs = float(min(p.t, q.t))
                break
        else:
            shorter = min(len(logs[0]), len(logs[1]))
            longer = max(logs, key=len)
            if len(longer) > shorter:
                differs = float(longer.t[shorter])
        start = float(first.t[0])
        times = np.linspace(start, t, 2000)
        p, q = first.sample(times), second.sample(times)
        return Comparison(
            (a, b),
            t,
            (len(logs[0]), len(logs[1])),
            differs,
            self.model.chart.variables[0],
            float(np.abs(p.z - q.z).max()),
            float(np.abs(p.F - q.F).max()),
        )

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
        if any(isinstance(signal, Function) for signal in self.rig.signals.values()):
            raise SessionError("a signal is a Python function, which a file cannot hold")
        for name, value in self.options.items():
            if not isinstance(value, str | int | float | dict | type(None)):
                raise SessionError(f"the option {name} = {value!r} cannot be written to a file")
        data = {
            "format": "gms-fsm session 1",
            "header": json.loads(Header.of(self.model, self.rig, {}).model_dump_json()),
            "t_end": self.t_end,
            "options": {k: _plain(v) for k, v in self.options.items()},
            "branches": [
                {
                    "parent": b.parent,
                    "fork": b.fork,
                    "edits": b.edits,
                    "cursor": b.cursor,
                    "from": None if b.begin is None else b.begin[0],
                    "between": None if b.between is None else b.between[0],
                }
                for b in self.branches
            ],
            "current": self.current,
            "breakpoints": [asdict(point) for point in self.breakpoints],
            "watches": self.watches,
        }
        text = json.dumps(data, indent=1).encode()
        return written_whole(Path(path), lambda file: file.write(text))

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
        path = Path(path)
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            if data["format"] != "gms-fsm session 1":
                raise ValueError(f"format is {data['format']!r}")
            header = Header.model_validate(data["header"])
            session = cls(header.to_model(), header.to_rig(), data["t_end"], **data["options"])
            for number, record in enumerate(data["branches"]):
                if number > 0:
                    session.switch(int(record["parent"]))
                    session._walk_to(int(record["fork"]), record["from"])
                    edits = record["edits"]
                    session.poke(
                        {name: _by_number(values) for name, values in edits["variables"].items()},
                        edits["v"],
                        _by_number(edits["state"]),
                    )
            for number, record in enumerate(data["branches"]):
                session.switch(number)
                session._walk_to(int(record["cursor"]), record["between"])
            session.switch(int(data["current"]))
            for record in data["breakpoints"]:
                seen = int(record.pop("seen", 0))
                session.break_on(**record).seen = seen
            session.watches = [str(text) for text in data["watches"]]
            return session
        except FileNotFoundError:
            raise TraceFileError(f"{path}: no such file; check its name and the folder") from None
        except Exception as error:  # whatever a damaged file provokes, it is the file's fault
            raise TraceFileError(f"{path}: not a session file, or damaged ({why(error)})") from None

    def _walk_to(self, row: int, between: float | None) -> None:
        branch = self.branch
        while row + (between is not None) >= len(branch) and branch.pull():
            pass
        branch.cursor, branch.between = min(row, len(branch) - 1), None
        if between is not None:
            t0, _, y0, mode = branch.raw(branch.cursor)
            t1, _, y1, _ = branch.raw(branch.cursor + 1)
            program = branch.run.recorder.start.program
            y = interpolated(program, list(mode), t0, np.array(y0), t1, np.array(y1), between)
            branch.between = (between, [float(u) for u in y])


@contextmanager
def _unbroken() -> Iterator[None]:
    """Hold Ctrl-C back until the row is complete: a run that is broken off cannot go on."""
    usual = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(usual):
        yield
        return
    pressed: list[tuple[int, Any]] = []
    signal.signal(signal.SIGINT, lambda *event: pressed.append(event))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, usual)
    if pressed:
        usual(*pressed[0])


def _by_number(values: Mapping[str, Any]) -> dict[int, Any]:
    """Return values by element with numbers for keys, which JSON makes texts."""
    return {int(element): value for element, value in values.items()}


def _plain(value: Any) -> Any:
    """Return arrays inside an option as lists."""
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
