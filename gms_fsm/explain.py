"""Why an edge fired or did not: its guard, clause by clause, on a stored row.

Computed on demand from the row with the chart's own trees, so it is what the run itself saw.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from gms_fsm.chart import Chart, Transition
from gms_fsm.expression import MATLAB_LIKE, Condition, Relation, clauses, evaluate, spell
from gms_fsm.trace import Trace

__all__ = ["Clause", "Explanation", "explain", "explain_state", "holds", "values_at"]


@dataclass(frozen=True)
class Clause:
    """One part of a guard that has to hold.

    Parameters
    ----------
    text : str
        As the chart shows it.
    holds : bool
        Whether it is true.
    left, right : float
        Both sides of a comparison; NaN for a compound clause, or one that cannot be computed.
    margin : float
        How far it is on the true side (negative: on the false side); NaN for a compound clause.
    computable : bool
        False where it has no value (1/0); it then counts as false.
    """

    text: str
    holds: bool
    left: float
    right: float
    margin: float
    computable: bool = True


@dataclass(frozen=True)
class Explanation:
    """One edge that could be taken from the state an element is in (or has just left).

    Parameters
    ----------
    edge : Transition
        The edge.
    priority : int
        1 is asked first.
    clauses : tuple of Clause
        The guard's parts.
    holds : bool
        Whether the whole guard is true.
    fired : bool
        Whether it is the edge that was taken to reach this row.
    """

    edge: Transition
    priority: int
    clauses: tuple[Clause, ...]
    holds: bool
    fired: bool


def values_at(trace: Trace, row: int, element: int) -> dict[str, float]:
    """Return every value a guard of an element can name, at a row.

    Parameters
    ----------
    trace : Trace
        A run.
    row : int
        Row index.
    element : int
        Counted from 0.

    Returns
    -------
    dict of str to float
        t, x, v, s, the variables and the parameters.
    """
    values = {
        "t": float(trace.t[row]),
        "x": float(trace.x[row]),
        "v": float(trace.v[row]),
        "s": float(trace.s[row, element]),
    }
    for name in trace.model.chart.variables:
        values[name] = float(trace.variable(name)[row, element])
    for name, value in trace.model.values.items():
        values[name] = float(value if isinstance(value, float | int) else value[element])
    return values


def explain(trace: Trace, row: int, element: int) -> list[Explanation]:
    """Explain the edges of an element at a row, highest priority first.

    On a row that a firing of this element made, the edges are those of the state it left, with the
    values before the firing, and the edge taken is marked.

    Parameters
    ----------
    trace : Trace
        A run.
    row : int
        Row index; negative counts from the end.
    element : int
        Counted from 0.

    Returns
    -------
    list of Explanation
        One an edge; empty if the state has none.

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
    if not -len(trace) <= row < len(trace) or not 0 <= element < trace.n:
        raise IndexError(
            f"row {row}, element {element}: the trace has {len(trace)} rows, {trace.n} elements"
        )
    row %= len(trace)
    chart, modes = trace.model.chart, trace.rows.mode[:, element]
    fired = _edge_taken(trace, row, element)
    before = row - 1 if fired else row
    state = chart.states[int(modes[before])]
    values = values_at(trace, before, element)
    return explain_state(chart, state.name, values, fired)


def explain_state(
    chart: Chart, state: str, values: Mapping[str, float], fired: str = ""
) -> list[Explanation]:
    """Explain the edges that leave a state.

    Parameters
    ----------
    chart : Chart
        The chart.
    state : str
        A state's name.
    values : mapping of str to float
        A number for every name its guards use.
    fired : str
        The edge that was taken, if any.

    Returns
    -------
    list of Explanation
        Highest priority first.
    """
    found = []
    for priority, (_, edge) in enumerate(chart.leaving(state), start=1):
        guard = chart.guards[edge.name]
        found.append(
            Explanation(
                edge,
                priority,
                tuple(_clause(part, values) for part in clauses(guard)),
                holds(guard, values),
                edge.name == fired,
            )
        )
    return found


def _edge_taken(trace: Trace, row: int, element: int) -> str:
    """Return the edge whose firing made this row, or an empty text."""
    microstep = int(trace.microstep[row])
    if microstep == 0:
        return ""
    log = trace.transitions[trace.transitions.t == trace.t[row]]
    taken = log[microstep - 1]
    return str(taken.edge) if taken.element == element else ""


def _clause(part: Condition, values: Mapping[str, float]) -> Clause:
    text = spell(part, MATLAB_LIKE)
    try:
        truth = bool(evaluate(part, values))
        if not isinstance(part, Relation):
            return Clause(text, truth, math.nan, math.nan, math.nan)
        left, right = evaluate(part.left, values), evaluate(part.right, values)
    except (ArithmeticError, ValueError):
        return Clause(text, False, math.nan, math.nan, math.nan, computable=False)
    margin = left - right if part.op in (">", ">=") else right - left
    return Clause(text, truth, left, right, margin)


def holds(condition: Condition, values: Mapping[str, float]) -> bool:
    """Return a condition's truth; what cannot be computed (1/0) is not true.

    Parameters
    ----------
    condition : Condition
        A guard or a part of one.
    values : mapping of str to float
        A number for every name.

    Returns
    -------
    bool
        Its truth.
    """
    try:
        return bool(evaluate(condition, values))
    except (ArithmeticError, ValueError):
        return False
