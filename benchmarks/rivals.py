"""The same two runs as users of other tools would write them: SciPy, SUNDIALS, PathSim.

All three share the equations and guards below in plain NumPy; each has its own way to stop at an
event and to continue. None of them handles the traps that gms-fsm knows about.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

__all__ = ["OPEN_LOOP", "PULLED_MASS", "RIVALS", "Case", "Outcome"]

STICK, SLIP = 0, 1
EDGES = ("break_away_forward", "break_away_backward", "arrest")
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """One of the two runs; the signed law. y is (x, v, z1 ... zn), in open loop (x, z1 ... zn).

    Parameters
    ----------
    title, t_end, transitions
        Name, length [s], and the correct number of transitions.
    k, sigma, C, w : ndarray, shape (n,)
        N/m, Ns/m, m/s and m/N.
    sigma_2, F_c, F_s, v_s, v_c : float
        SI units.
    signal : str
        The prescribed velocity; empty for the pulled mass (1 kg, 2 N/m, 0.1 m/s).
    """

    title: str
    t_end: float
    transitions: int
    k: Array
    sigma: Array
    C: Array
    w: Array
    sigma_2: float
    F_c: float
    F_s: float
    v_s: float
    v_c: float = 1e-6
    signal: str = ""

    @property
    def first(self) -> int:
        """The index of the first z in y."""
        return 1 if self.signal else 2

    def start(self) -> Array:
        """Return the state at rest."""
        return np.zeros(self.first + self.k.size)

    def velocity(self, t: float, y: Array) -> float:
        """Return v, m/s."""
        return 0.2 * np.sin(2 * np.pi * t / 20) if self.signal else y[1]

    def threshold(self, v: float) -> Array:
        """Return s, shape (n,), m."""
        return self.w * (self.F_c + (self.F_s - self.F_c) * np.exp(-((v / self.v_s) ** 2)))

    def slope(self, t: float, y: Array, slips: NDArray[np.bool_], sign: float) -> Array:
        """Return dy/dt with the states frozen and sgn(v) held."""
        v, z = self.velocity(t, y), y[self.first :]
        dz = np.where(slips, self.C * (sign - z / self.threshold(v)), v)
        if self.signal:
            return np.concatenate(([v], dz))
        F = self.k @ z + self.sigma @ dz + self.sigma_2 * v
        return np.concatenate(([v, 2.0 * (0.1 * t - y[0]) - F], dz))

    def edges(self, t: float, y: Array, slips: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return the enabled edge of each element, or -1."""
        v, z = self.velocity(t, y), y[self.first :]
        s = self.threshold(v)
        away = np.where((z >= s) & (v > self.v_c), 0, np.where((z <= -s) & (v < -self.v_c), 1, -1))
        return np.where(slips, np.where((abs(v) <= self.v_c) & (abs(z) < s), 2, -1), away)


PULLED_MASS = Case(
    "Pulled mass, 60 s",
    60.0,
    72,
    np.array([40.0, 30.0, 20.0, 10.0]),
    np.array([0.4, 0.3, 0.2, 0.1]),
    np.full(4, 0.02),
    1 / (4 * np.array([40.0, 30.0, 20.0, 10.0])),
    sigma_2=0.4,
    F_c=1.0,
    F_s=1.5,
    v_s=0.05,
)
OPEN_LOOP = Case(
    "Open loop, 61 s",
    61.0,
    48,
    np.full(4, 0.7),
    np.array([0.3, 0.4, 0.5, 0.6]),
    np.array([0.1, 0.05, 0.025, 1e-4]),
    np.ones(4),
    sigma_2=0.1,
    F_c=0.4,
    F_s=1.5,
    v_s=1e-3,
    signal="0.2*sin(2*pi*t/20)",
)


@dataclass(frozen=True, eq=False)
class Outcome:
    """The result of a run.

    Attributes
    ----------
    t : ndarray, shape (m,), s
        Times of the transitions.
    element : ndarray of int, shape (m,)
        From 0.
    edge : list of str
        Names of the edges.
    z : ndarray, shape (rows, n), m
        At the requested times; if there are none, one row, the end state.
    """

    t: Array
    element: NDArray[np.int64]
    edge: list[str]
    z: Array


@dataclass(eq=False)
class Log:
    """Switches the elements and logs the switches."""

    case: Case
    slips: NDArray[np.bool_] = field(init=False)
    fired: list[tuple[float, int, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.slips = np.zeros(self.case.k.size, dtype=bool)

    def switch(self, t: float, y: Array) -> None:
        """Take every enabled edge."""
        edges = self.case.edges(t, y, self.slips)
        for i in np.flatnonzero(edges >= 0):
            self.fired.append((float(t), int(i), EDGES[edges[i]]))
            self.slips[i] = not self.slips[i]

    def outcome(self, z: Array, y: Array) -> Outcome:
        """Return the result, with the rows z or the end state y."""
        t, element, edge = zip(*self.fired, strict=True)
        z = z if len(z) else y[None, self.case.first :]
        return Outcome(np.array(t), np.array(element), list(edge), z)


def scipy_by_hand(
    case: Case, times: Array, rtol: float = 1e-6, atol: float = 1e-9, max_step: float = np.inf
) -> Outcome:
    """Run solve_ivp(RK45) arc by arc, with a terminal event function for every guard."""
    log, t, y, z = Log(case), 0.0, case.start(), np.empty((times.size, case.k.size))
    row = 0
    while t < case.t_end:
        sign, slips = np.sign(case.velocity(t, y)), log.slips
        events: list[Callable[..., float]] = []
        for i in np.flatnonzero(~slips):
            for side in (1, -1):
                events.append(
                    lambda t, y, i=i, side=side: (
                        y[case.first + i] - side * case.threshold(case.velocity(t, y))[i]
                    )
                )
        if slips.any():
            for c in (case.v_c, -case.v_c, 0.0):
                events.append(lambda t, y, c=c: case.velocity(t, y) - c)
        for event in events:
            event.terminal = True  # type: ignore[attr-defined]
        arc = solve_ivp(
            lambda t, y, slips=slips, sign=sign: case.slope(t, y, slips, sign),
            (t, case.t_end),
            y,
            method="RK45",
            rtol=rtol,
            atol=atol,
            events=events,
            dense_output=times.size > 0,
            max_step=max_step,
        )
        t, y = arc.t[-1], arc.y[:, -1]
        upto = np.searchsorted(times, t, side="right")
        if upto > row:
            z[row:upto] = arc.sol(times[row:upto])[case.first :].T
            row = upto
        if arc.status == 1:  # the guard may still be false at the root: step past it
            t, y = t + 1e-12, y + 1e-12 * case.slope(t, y, slips, sign)
        log.switch(t, y)
    return log.outcome(z, y)


def sundials(case: Case, times: Array, rtol: float = 1e-6, atol: float = 1e-9) -> Outcome:
    """Run CVODE (scikit-sundae): Adams, one root function for every guard, restarted at each."""
    from sksundae.cvode import CVODE

    n, log, sign = case.k.size, Log(case), 0.0

    def slope(t: float, y: Array, dy: Array) -> None:
        dy[:] = case.slope(t, y, log.slips, sign)

    def roots(t: float, y: Array, out: Array) -> None:
        v = case.velocity(t, y)
        z, s = y[case.first :], case.threshold(v)
        out[:n] = np.where(log.slips, 1.0, z - s)
        out[n : 2 * n] = np.where(log.slips, 1.0, z + s)
        out[2 * n :] = (v - case.v_c, v + case.v_c, v) if log.slips.any() else 1.0

    solver = CVODE(
        slope,
        method="Adams",
        rtol=rtol,
        atol=atol,
        eventsfn=roots,
        num_events=2 * n + 3,
        max_num_steps=100_000,
    )
    t, y, z, row = 0.0, case.start(), np.empty((times.size, n)), 0
    while t < case.t_end:
        sign = np.sign(case.velocity(t, y))
        ahead = times[row:][times[row:] > t]
        span = np.concatenate(([t], ahead)) if ahead.size > 1 else np.array([t, case.t_end])
        arc = solver.solve(span, y)
        t, y = arc.t[-1], arc.y[-1]
        upto = np.searchsorted(times, t, side="right")
        place = np.searchsorted(arc.t, times[row:upto])
        z[row:upto] = arc.y[place, case.first :]
        row = upto
        log.switch(t, y)
    return log.outcome(z, y)


def pathsim(case: Case, times: Array, rtol: float = 1e-6, atol: float = 1e-9) -> Outcome:
    """Run PathSim: an ODE block, zero-crossing events that switch it, a sampling Scope."""
    from pathsim import Connection, Simulation
    from pathsim.blocks import ODE, Scope
    from pathsim.events import ZeroCrossing
    from pathsim.solvers import RKDP54

    n, log = case.k.size, Log(case)

    def slope(y: Array, _: Array, t: float) -> Array:
        return case.slope(t, y, log.slips, np.sign(case.velocity(t, y)))

    bank = ODE(slope, case.start())

    def margin(i: int, side: int) -> Callable[[float], float]:
        def z_minus_s(t: float) -> float:
            y = bank.engine.state
            return y[case.first + i] - side * case.threshold(case.velocity(t, y))[i]

        return z_minus_s

    def speed(c: float) -> Callable[[float], float]:
        return lambda t: case.velocity(t, bank.engine.state) - c

    def switch(t: float) -> None:
        log.switch(t, bank.engine.state)
        for j, event in enumerate(events):
            watched = log.slips.any() if j >= 2 * n else not log.slips[j // 2]
            event.on() if watched else event.off()

    functions = [margin(i, side) for i in range(n) for side in (1, -1)]
    functions += [speed(c) for c in (case.v_c, -case.v_c, 0.0)]
    events = [ZeroCrossing(f, switch, tolerance=1e-10) for f in functions]
    scope = Scope(sampling_period=times[1] - times[0] if times.size else None)
    wires = [Connection(bank[j], scope[j]) for j in range(case.first + n)]
    simulation = Simulation(
        [bank, scope],
        wires,
        events,
        dt=1e-3,
        Solver=RKDP54,
        log=False,
        tolerance_lte_rel=rtol,
        tolerance_lte_abs=atol,
    )
    switch(0.0)
    simulation.run(case.t_end)
    t, y = scope.read()
    place = np.searchsorted(t, times - 1e-9).clip(max=t.size - 1)
    return log.outcome(y[case.first :, place].T, y[:, -1])


RIVALS: dict[str, Callable[[Case, Array], Outcome]] = {
    "solve_ivp(RK45, events), by hand": scipy_by_hand,
    "... with max_step=0.02": partial(scipy_by_hand, max_step=0.02),
    "CVODE Adams with roots (scikit-sundae)": sundials,
    "PathSim, ODE block with events": pathsim,
}
