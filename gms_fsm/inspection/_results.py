"""Results of a session: data with fields, which print as the text of the debugger."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gms_fsm.traces.trace import Trace

__all__ = ["BranchComparison", "Fired", "Here", "compared"]

SAMPLES = 2000  # number of common times at which two branches are compared


@dataclass(frozen=True)
class Fired:
    """The firing that made a row.

    Parameters
    ----------
    element : int
        Element index, from 0.
    edge, source, target : str
        The edge taken, the state left and the state entered.
    """

    element: int
    edge: str
    source: str
    target: str

    def __str__(self) -> str:
        return f"element {self.element + 1}: {self.source} -> {self.target} by {self.edge}"


@dataclass(frozen=True)
class Here:
    """One row of a branch; printed, the text of the debugger after a move.

    Parameters
    ----------
    row : int
        Row number in the branch.
    t, x, v, F : float
        Time, s; position, m; velocity, m/s; friction force, N.
    microstep : int
        Micro-step; 0 before the firings at this time.
    z, s, F_elements : tuple of float
        One per element: first variable of the chart, m; threshold, m; force, N.
    states : tuple of str
        Active states, one per element.
    located : bool
        Whether this is a point between rows, where a condition became true.
    fired : Fired or None
        The firing that made the row, if any.
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


@dataclass(frozen=True)
class BranchComparison:
    """A comparison of two branches; printed, the text of the debugger.

    Parameters
    ----------
    branches : tuple of int
        Numbers of the branches.
    t : float
        End of the compared time, s (that of the shorter branch).
    transitions : tuple of int
        Number of transitions of each branch until then.
    first_difference : float or None
        Time of the first transition that differs, s, or None.
    variable : str
        First variable of the chart.
    z, F : float
        Largest differences of this variable and of the friction force [N] at common times.
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


def compared(numbers: tuple[int, int], first: Trace, second: Trace) -> BranchComparison:
    """Compare two branches that have been computed to their ends.

    Parameters
    ----------
    numbers : tuple of int
        Numbers of the branches.
    first, second : Trace
        Traces of the same model.

    Returns
    -------
    BranchComparison
        Transitions, and largest differences of the first variable and F.
    """
    t = min(float(first.t[-1]), float(second.t[-1]))
    logs = [trace.transitions[trace.transitions.t <= t] for trace in (first, second)]
    differs = None
    for p, q in zip(*logs, strict=False):
        if (p.t, p.element, p.edge) != (q.t, q.element, q.edge):
            differs = float(min(p.t, q.t))
            break
    else:
        shorter, longer = sorted(logs, key=len)
        if len(longer) > len(shorter):
            differs = float(longer.t[len(shorter)])
    times = np.linspace(float(first.t[0]), t, SAMPLES)
    p, q = first.sample(times), second.sample(times)
    return BranchComparison(
        numbers,
        t,
        (len(logs[0]), len(logs[1])),
        differs,
        first.model.chart.variables[0],
        float(np.abs(p.z - q.z).max()),
        float(np.abs(p.F - q.F).max()),
    )
