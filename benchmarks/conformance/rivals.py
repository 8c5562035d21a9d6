"""The same equations in SciPy and PathSim, as their documentation suggests.

Both get the equations of `automata.py`: a function for the rates, and for each comparison in a
guard an event function that rises through zero just after it has become true. At an event all edges
that are enabled are taken, then the solver starts again. What differs is how an event is found.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.conformance.automata import Affine, Mechanism
from benchmarks.conformance.cases import CASES, FLOATS

RTOL, ATOL = 1e-9, 1e-12
PAST = 2e-12  # at a root itself the comparison may still be false
LEFT = 1e-10  # s
PARTS = 1000  # of a run, the largest step: a guard that is true twice in a step is missed
LOCATED = 1e-12  # PathSim's tolerance of an event
MOST_EVENTS, MOST_EVALUATIONS = 2000, 200_000
INEXPRESSIBLE = {
    "friction-on-a-prescribed-motion": "there is nothing to integrate",
    "inertial-stuck": "the stuck bearing and the rod would both hold a prescribed motion",
}


class Endless(Exception):
    """The bound on events or on evaluations was reached."""


class Inexpressible(Exception):
    """There is no documented way to write this case."""


Found = tuple[list[tuple[float, str, int, str]], dict[str, float]]
Tool = Callable[[str], Found]
Key = tuple[int, str, int]  # a comparison: contact, edge, place in its guard


class Floats:
    """A mechanism as functions of t and y for its present states."""

    def __init__(self, m: Mechanism) -> None:
        self.m, self.left, self.events = m, MOST_EVALUATIONS, 0
        self.hidden = [] if m.known else [(m.place[name], line) for name, line in m.corners.items()]
        self.matrix = np.empty(0)
        self.rows: dict[Key, np.ndarray] = {}

    def row(self, function: Affine) -> list[float]:
        """Return the coefficients of an affine function."""
        return [float(function.get(name, 0.0)) for name in self.m.names]

    def prepare(self) -> None:
        """Read the equations of the present states."""
        m = self.m
        self.matrix = np.array([self.row(rate) for rate in m.dynamics(m.modes)[0]])
        self.rows, seen = {}, set()
        for i, e, conditions in m.edges(m.modes):
            for k, (function, _) in enumerate(conditions):
                row = np.array(self.row(function))
                if row.tobytes() not in seen:
                    seen.add(row.tobytes())
                    self.rows[i, e.name, k] = row

    def bounded(self) -> None:
        """Count an event; raise if there are too many."""
        self.events += 1
        if self.events > MOST_EVENTS:
            raise Endless

    def full(self, t: float, y: Any) -> Any:
        """Return y with the values of formulas."""
        if not self.hidden:
            return y
        y = np.array(y)
        for place, line in self.hidden:
            y[place] = self.m.at(line, t)
        return y

    def rates(self, t: float, y: Any) -> Any:
        """Return dy/dt."""
        self.left -= 1
        if self.left < 0:
            raise Endless
        return self.matrix @ self.full(t, y)

    def margin(self, key: Key, t: float, y: Any) -> float:
        """Return the margin of a comparison; negative while nothing asks for it."""
        return float(self.rows[key] @ self.full(t, y)) - PAST if key in self.rows else -1.0

    def settle(self, t: float, y: Any) -> None:
        """Take what is enabled."""
        self.m.y = [float(u) for u in self.full(t, y)]
        self.m.y[self.m.place["t"]] = t
        try:
            self.m.settle()
        except RuntimeError:
            raise Endless from None
        self.prepare()

    def settled(self, t: float, y: Any) -> float:
        """Take what is enabled and leave the root, at which SciPy would find the event again."""
        self.settle(t, y)
        taken = -1
        while taken != len(self.m.log):
            self.bounded()
            taken, t = len(self.m.log), t + LEFT
            self.settle(t, self.m.y + LEFT * self.rates(t, self.m.y))
        return t

    def corner(self, t: float, y: Any) -> None:
        """Go past a corner of a signal."""
        self.m.y = [float(u) for u in y]
        self.m.enter(t)
        self.settle(t, self.m.y)

    def found(self) -> Found:
        """Return the switches and the end states."""
        log = [(float(each.t), each.contact, each.element, each.edge) for each in self.m.log]
        return log, {name: float(value) for name, value in self.m.end().items()}


def _built(name: str) -> Floats:
    build = CASES[name].build
    if name in INEXPRESSIBLE or build is None:
        raise Inexpressible(INEXPRESSIBLE.get(name, ""))
    run = Floats(build(FLOATS))
    run.settle(0.0, run.m.y)
    return run


# --------------------------------------------------------------------------- SciPy
def scipy(name: str) -> Found:
    """Run solve_ivp (RK45) from event to event: terminal events, restart."""
    from scipy.integrate import solve_ivp

    case = CASES[name]
    how: dict[str, Any] = {"rtol": RTOL, "atol": ATOL, "max_step": case.t_end / PARTS}
    if name == "rates":
        return [], _ticked()
    if case.plain is not None:
        plain, left = case.plain, [MOST_EVALUATIONS]
        arc = solve_ivp(_counted(plain, left), (0.0, case.t_end), list(case.start.values()), **how)
        return [], dict(zip(case.start, map(float, arc.y[:, -1]), strict=True))
    run = _built(name)
    m, t = run.m, 0.0
    while t < case.t_end:
        knots = [float(knot) for knot in m.knots if knot > t and m.known]
        stop, events = min([case.t_end, *knots]), []
        for key in run.rows:
            event: Any = lambda t, y, key=key: run.margin(key, t, y)  # noqa: E731  # gets attributes
            event.terminal, event.direction = True, 1.0
            events.append(event)
        arc = solve_ivp(run.rates, (t, stop), m.y, events=events, **how)
        t, y = float(arc.t[-1]), arc.y[:, -1]
        run.bounded()
        if arc.status == 1:
            t = run.settled(t, y)
        elif t in knots:
            run.corner(t, y)
        else:
            m.y = y.tolist()
    return run.found()


def _counted(plain: Callable[[float, Any], Any], left: list[int]) -> Callable[[float, Any], Any]:
    def rates(t: float, y: Any) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise Endless
        return plain(t, y)

    return rates


PERIODS = (5e-5, 5e-4, 3.3e-3)


class Counters:
    """The three samplers of the case `rates`."""

    def __init__(self) -> None:
        self.fast, self.slow, self.wrong = 0, [0, 0], [0, 0]

    def tick(self, which: int) -> None:
        """Tick one sampler; the slow ones read the fast one."""
        if which == 0:
            self.fast += 1
            return
        each, ratio = which - 1, (10, 66)[which - 1]
        self.wrong[each] += abs(self.fast - ratio * self.slow[each] - 1)
        self.slow[each] += 1

    def end(self) -> dict[str, float]:
        """Return the end states by name."""
        found = {"fast_count": float(self.fast)}
        for each in (0, 1):
            found[f"wrong_{each + 1}"] = float(self.wrong[each])
            found[f"count_{each + 1}"] = float(self.slow[each])
        return found


def _ticked() -> dict[str, float]:
    """Run the samplers at the times k * period, between which a user would call solve_ivp."""
    counters, t_end = Counters(), CASES["rates"].t_end
    ticks = [
        (k * period, which)
        for which, period in enumerate(PERIODS)
        for k in range(math.floor(t_end / period) + 1)
    ]
    for _, which in sorted(ticks):
        counters.tick(which)
    return counters.end()


# --------------------------------------------------------------------------- PathSim
def pathsim(name: str) -> Found:
    """Run an ODE block (RKDP54) with one ZeroCrossingUp event for each edge."""
    from pathsim import Simulation
    from pathsim.blocks import ODE
    from pathsim.events import Schedule, ScheduleList, ZeroCrossingUp
    from pathsim.solvers import RKDP54

    case = CASES[name]
    how: dict[str, Any] = {
        "Solver": RKDP54,
        "log": False,
        "tolerance_lte_rel": RTOL,
        "tolerance_lte_abs": ATOL,
        "dt_max": case.t_end / PARTS,
    }
    if name == "rates":
        counters = Counters()
        clocks = [
            Schedule(t_period=period, func_act=lambda _, which=which: counters.tick(which))
            for which, period in enumerate(PERIODS)
        ]
        idle = ODE(lambda y, _u, _t: 0.0 * y, np.zeros(1))
        Simulation([idle], [], clocks, **how).run(case.t_end)
        return [], counters.end()
    if case.plain is not None:
        rates = _counted(case.plain, [MOST_EVALUATIONS])
        block = ODE(lambda y, _u, t: np.array(rates(t, y)), np.array(list(case.start.values())))
        Simulation([block], [], [], **how).run(case.t_end)
        return [], dict(zip(case.start, map(float, block.engine.get()), strict=True))
    run = _built(name)
    m = run.m
    block = ODE(lambda y, _u, t: run.rates(t, y), np.array(m.y, dtype=float))

    def act(t: float) -> None:
        run.bounded()
        run.settle(t, block.engine.get())
        block.engine.set(np.array(m.y))

    def corner(_: float) -> None:
        run.corner(next(knots), block.engine.get())
        block.engine.set(np.array(m.y))

    events: list[Any] = [
        ZeroCrossingUp(
            lambda t, key=key: run.margin(key, t, block.engine.get()), act, tolerance=LOCATED
        )
        for i, c in enumerate(m.contacts)
        for e in c.edges
        for key in [(i, e.name, k) for k in range(len(e.when))]
    ]
    times = [float(knot) for knot in m.knots if m.known and knot < case.t_end]
    knots = iter(times)
    if times:
        events.append(ScheduleList(times, corner))
    Simulation([block], [], events, **how).run(case.t_end)
    m.y = block.engine.get().tolist()
    return run.found()


TOOLS: dict[str, Tool] = {"scipy": scipy, "pathsim": pathsim}
