"""Why an edge fired or not: its guard, clause by clause, at a stored row.

Computed on demand from the row, with the trees of the chart, so the values are those the run saw.
Printed, an explanation is the text of the debugger, in which elements are numbered from 1.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.foundation.display import displayed, short_repr
from gms_fsm.foundation.quantities import Scale, scale_of, trimmed
from gms_fsm.language import (
    Condition,
    Relation,
    awaited,
    clauses,
    evaluate,
)
from gms_fsm.traces.scope import Scope, clause_text, clause_unit
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.views import steps_of

__all__ = [
    "Clause",
    "Explanation",
    "Why",
    "explain",
    "explain_state",
    "holds",
    "values_at",
]

ROUNDING = 1e-8  # relative to both sides; a smaller margin is due to the clock and floats
NOTHING = 1e-12  # in SI units: the same where a side is zero


@dataclass(frozen=True)
class Clause:
    """One clause of a guard.

    Parameters
    ----------
    text : str
        The clause as shown in the chart.
    holds : bool
        Whether the clause is true.
    left, right : float
        Values of both sides of a comparison; NaN for a compound clause, or if they cannot be
        computed.
    margin : float
        Distance on the true side (negative on the false side); NaN for a compound clause.
    computable : bool
        False if the clause has no value (1/0); it then counts as false.
    unit : str
        Unit of the margin, if the units of the names determine it; else empty.
    event : str
        The event that the clause waits for, which has no margin; empty for any other clause.
    """

    text: str
    holds: bool
    left: float
    right: float
    margin: float
    computable: bool = True
    unit: str = ""
    event: str = ""

    @property
    def scale(self) -> Scale:
        """The unit in which both sides and the margin are written: that of the larger side."""
        return scale_of((self.left, self.right), self.unit)

    @property
    def relative(self) -> float:
        """Margin over the larger side; 0 if it is due to rounding, NaN where the margin is."""
        if math.isinf(self.margin):
            return math.copysign(1.0, self.margin)
        larger = max(abs(self.left), abs(self.right))
        if abs(self.margin) <= (ROUNDING * larger if self.left and self.right else NOTHING):
            return 0.0
        return self.margin / larger


@displayed("html")
@short_repr
@dataclass(frozen=True)
class Explanation:
    """One edge that leaves the state of an element, or the state it has just left.

    Parameters
    ----------
    edge : Transition
        The edge.
    priority : int
        Order of evaluation; 1 is the first.
    clauses : tuple of Clause
        The clauses of the guard.
    holds : bool
        Whether the whole guard is true.
    taken : str
        The edge taken from this state: the one that led to this row, else the first whose guard is
        true; empty for none.
    past : bool
        Whether it led to this row; the values are then those before the firing.
    tick : float or None
        Of a contact with a period, away from its ticks: time of the next one, s (infinite after
        the last). The guard is evaluated only then.

    Examples
    --------
    >>> from gms_fsm.charts import gms_element
    >>> values = {"z": 0.5, "s": 1.0, "v": 0.2, "v_c": 1e-6, "k": 1.0, "sigma": 0.0, "C": 1.0}
    >>> forward, _ = explain_state(gms_element("signed"), "stick", values)
    >>> print(forward)
    break_away_forward does not fire: z >= s is false by 0.5 m.
      1 break_away_forward: stick -> slip
        false  z >= s   left 0.5        right 1          margin -0.5 m
        true   v > v_c  left 200        right 0.001      margin +200 mm/s
    """

    edge: Transition
    priority: int
    clauses: tuple[Clause, ...]
    holds: bool
    taken: str = ""
    past: bool = False
    tick: float | None = None

    @property
    def fired(self) -> bool:
        """Whether this edge was taken to reach the row."""
        return self.past and self.taken == self.edge.name

    @property
    def verdict(self) -> str:
        """One sentence on why this edge fires or not."""
        return _verdict(self)

    def __str__(self) -> str:
        return f"{self.verdict}\n{_detail(self)}"


@displayed("html")
@short_repr
@dataclass(frozen=True)
class Why:
    """Why an element switches or does not: a sequence of `Explanation`, highest priority first.

    Parameters
    ----------
    element : int
        Element index, from 0.
    t : float
        Time, s.
    state : str
        State of the element.
    left : str
        State it has just left, if the edges are those of that state; else empty.
    edges : tuple of Explanation
        The explanations; empty if no edge leaves the state.
    sigma : mapping of str to float
        The signs held between -1 and 1, keyed by the quantity that is zero.
    contact : str
        The contact, in the run of a system; else empty.
    tick : float or None
        As in `Explanation`.
    doubts : tuple of str
        What `gms_fsm.Trace.trust` finds about this element from this time to the next.
    """

    element: int
    t: float
    state: str
    left: str
    edges: tuple[Explanation, ...]
    sigma: Mapping[str, float] = field(default_factory=dict)
    contact: str = ""
    tick: float | None = None
    doubts: tuple[str, ...] = field(default=(), compare=False)

    def __iter__(self) -> Iterator[Explanation]:
        return iter(self.edges)

    def __len__(self) -> int:
        return len(self.edges)

    def __getitem__(self, index: int) -> Explanation:
        return self.edges[index]

    @property
    def heading(self) -> tuple[str, ...]:
        """Lines on the element: its state, what it has just left, what holds it, its next tick."""
        who = f"{self.contact or 'element'} {self.element + 1}"
        lines = [f"{who} is in {self.state} at t = {self.t:.9g} s"]
        if self.left:
            lines.append(f"it has just left {self.left}; the values are those before the firing")
        lines += [f"held on {name} = 0, σ = {u:.2g}" for name, u in self.sigma.items()]
        if self.tick is not None and self.edges:
            when = f"at t = {self.tick:.9g} s" if math.isfinite(self.tick) else "after the run"
            lines.append(f"its guards are evaluated at ticks only, the next time {when}")
        if not self.edges:
            lines.append("no edge leaves this state")
        lines += self.doubts
        return tuple(lines)

    def __str__(self) -> str:
        return "\n".join([*self.heading, *map(_verdict, self.edges), *map(_detail, self.edges)])


def values_at(trace: Trace, row: int, element: int) -> dict[str, float]:
    """Return the values of all names allowed in guards of an element, at a row.

    Parameters
    ----------
    trace : Trace
        The run.
    row : int
        Row index.
    element : int
        Element index, from 0.

    Returns
    -------
    dict of str to float
        t, x, v, s, the variables and the parameters, by name.
    """
    return Scope.at(trace, row).guards(element)


def explain(trace: Trace, row: int, element: int) -> Why:
    """Explain the edges of an element at a row, highest priority first.

    On a row made by a firing of this element, the edges are those of the state it left, with the
    values before the firing, and the edge taken is marked.

    Parameters
    ----------
    trace : Trace
        The run.
    row : int
        Row index; negative counts from the end.
    element : int
        Element index, from 0.

    Returns
    -------
    Why
        One `Explanation` per edge; printed, the text of the debugger.

    Raises
    ------
    IndexError
        If there is no such row or element.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 1.0)
    >>> forward = explain(trace, -1, 0)[0]
    >>> forward.edge.name, [(c.text, c.holds, round(c.margin, 3)) for c in forward.clauses]
    ('break_away_forward', [('z >= s', False, -0.2), ('v > v_c', True, 0.2)])
    """
    why = explain_alone(trace, row, element)
    later = int(np.searchsorted(trace.t, why.t, side="right"))
    until = float(trace.t[later]) if later < len(trace) else math.inf
    doubts = tuple(
        str(each)
        for each in trace.trust()
        if each.element == element and any(why.t <= time < until for time in each.times)
    )
    return replace(why, doubts=doubts)


def explain_alone(trace: Trace, row: int, element: int) -> Why:
    """Explain the edges as `explain` does, but without the doubts: they concern a whole run."""
    if not -len(trace) <= row < len(trace) or not 0 <= element < trace.n:
        raise IndexError(
            f"row {row}, element {element}: the trace has {len(trace)} rows, {trace.n} elements"
        )
    row %= len(trace)
    chart, modes = trace.model.chart, trace.modes[:, element]
    fired = _edge_taken(trace, row, element)
    before = row - 1 if fired else row
    now, source = (chart.states[int(modes[r])].name for r in (row, before))
    edges = explain_state(chart, source, values_at(trace, before, element), fired)
    left = source if fired else ""
    contact = trace.what.whose(trace.places.name)
    t, sigma = float(trace.t[row]), trace.sigma(row)
    return Why(element, t, now, left, tuple(edges), sigma, contact)


def explain_state(
    chart: Chart,
    state: str,
    values: Mapping[str, float],
    fired: str = "",
    tick: float | None = None,
) -> list[Explanation]:
    """Explain the edges that leave a state.

    Parameters
    ----------
    chart : Chart
        The chart.
    state : str
        Name of the state.
    values : mapping of str to float
        A value for every name in its guards.
    fired : str
        The edge that was taken, if any.
    tick : float, optional
        As in `Explanation`.

    Returns
    -------
    list of Explanation
        Highest priority first.
    """
    leaving = [edge for _, edge in chart.leaving(state)]
    true = {edge.name: holds(chart.guards[edge.name], values) for edge in leaving}
    taken = fired or next((name for name, truth in true.items() if truth), "")
    return [
        Explanation(
            edge,
            priority,
            tuple(_clause(chart, part, values) for part in clauses(chart.guards[edge.name])),
            true[edge.name],
            taken,
            bool(fired),
            tick,
        )
        for priority, edge in enumerate(leaving, start=1)
    ]


def _edge_taken(trace: Trace, row: int, element: int) -> str:
    """Return the edge whose firing made this row, or an empty text."""
    microstep = int(trace.microstep[row])
    if microstep == 0 or _only_slides(trace, row):
        return ""
    log = trace.transitions
    made = log[(log.t == trace.t[row]) & (steps_of(trace) == microstep) & (log.element == element)]
    return str(made.edge[0]) if made.size else ""


def _only_slides(trace: Trace, row: int) -> bool:
    """Return whether a row differs from the previous one only in the surfaces slid on."""
    same = row > 0 and trace.t[row - 1] == trace.t[row]
    return same and bool(trace.microstep[row - 1] == trace.microstep[row])


def _clause(chart: Chart, part: Condition, values: Mapping[str, float]) -> Clause:
    text = clause_text(chart, part)
    try:
        truth = bool(evaluate(part, values))
        event = awaited(part)
        if event or not isinstance(part, Relation):
            return Clause(text, truth, math.nan, math.nan, math.nan, event=event)
        left, right = evaluate(part.left, values), evaluate(part.right, values)
    except (ArithmeticError, ValueError):
        return Clause(text, False, math.nan, math.nan, math.nan, computable=False)
    margin = left - right if part.op in (">", ">=") else right - left
    return Clause(text, truth, left, right, margin, unit=clause_unit(chart, part))


def holds(condition: Condition, values: Mapping[str, float]) -> bool:
    """Return the truth of a condition; one that cannot be computed (1/0) is not true.

    Parameters
    ----------
    condition : Condition
        A guard or a part of one.
    values : mapping of str to float
        A value for every name.

    Returns
    -------
    bool
        Whether the condition is true.
    """
    try:
        return bool(evaluate(condition, values))
    except (ArithmeticError, ValueError):
        return False


# --------------------------------------------------------------------------- in words
def _verdict(each: Explanation) -> str:
    """Return one sentence on why an edge fires or not."""
    name = each.edge.name
    if each.fired:
        return f"{name} fired here: every clause was true."
    if each.holds:
        if each.taken != name:
            return f"{name} does not fire: its guard is true, but {each.taken} takes precedence."
        if each.tick is not None:
            return f"{name} fires at the next tick if its guard is then still true."
        return f"{name} fires next: every clause is true."
    parts = [_missing(clause) for clause in each.clauses if not clause.holds]
    return f"{name} {'did' if each.past else 'does'} not fire: {' and '.join(parts)}."


def _missing(clause: Clause) -> str:
    """Return what a clause that does not hold lacks."""
    if clause.event:
        return f"it waits for the event {clause.event}"
    by = "" if math.isnan(clause.margin) else f" by {_amount(clause, signed=False)}"
    return f"{clause.text} is false{by}"


def _detail(each: Explanation) -> str:
    """Return the guard of an edge, one line per clause."""
    wide = max(len(clause.text) for clause in each.clauses)
    edge, sends = each.edge, f", sends {', '.join(each.edge.emit)}" if each.edge.emit else ""
    lines = [f"  {each.priority} {edge.name}: {edge.source} -> {edge.target}{sends}"]
    for clause in each.clauses:
        truth = "true " if clause.holds else "false"
        lines.append(f"    {truth}  {clause.text:<{wide}}{_sides(clause)}".rstrip())
    return "\n".join(lines)


def _sides(clause: Clause) -> str:
    if not clause.computable:
        return "  cannot be computed here"
    if math.isnan(clause.margin):  # compound: no two sides
        return ""
    left, right = (trimmed(clause.scale.number(u, 5)) for u in (clause.left, clause.right))
    return f"  left {left:<10} right {right:<10} margin {_amount(clause, signed=True)}"


def _amount(clause: Clause, *, signed: bool) -> str:
    if clause.relative == 0.0:
        return f"{clause.scale.text(0.0)} (rounding)"
    sign = "+" if signed and clause.margin > 0.0 else ""
    return sign + trimmed(clause.scale.text(clause.margin if signed else abs(clause.margin), 3))
