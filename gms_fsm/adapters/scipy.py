"""Friction in equations for SciPy: `solve_ivp` with events and restarts done for the user."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import scipy.integrate
from numpy.typing import ArrayLike

import integrators
from gms_fsm.charts.parameters import FloatArray, checked_array, checked_scalar
from gms_fsm.errors import ParameterError, shown
from gms_fsm.lowering.program import equations
from gms_fsm.run._driven import Driven
from gms_fsm.run.machines import IfElse
from gms_fsm.run.settings import MOST_STEPS
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact
from integrators import Arc, Firing, Functions, Held, HybridError, Livelock, NotFinite, Tableau, hybrid, look

__all__ = ["Carried", "Solution", "Switch", "solve_ivp"]

Friction: TypeAlias = Model | Contact
Velocity: TypeAlias = int | Sequence[int] | Callable[[FloatArray], ArrayLike]
METHODS = ("RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA")  # of SciPy
OURS = tuple(name for name, tableau in integrators.METHODS.items() if tableau.adaptive)
NUDGE = 1e-6  # of a component of y, to see how the velocities depend on it


class Switch(NamedTuple):
    """An edge taken by an element.

    Parameters
    ----------
    t : float
        s.
    contact : str
        The friction's name: that of a contact; a model is called ``friction``, and of several
        ``friction1`` and so on.
    element : int
        Counted from 0.
    edge : str
        Its name in the chart.
    """

    t: float
    contact: str
    element: int
    edge: str


@dataclass(frozen=True, eq=False)
class Carried:
    """The frictions at the end of a call of `solve_ivp`, to begin the next one with.

    Parameters
    ----------
    driven : Driven
        The frictions.
    y : tuple of float
        Their own state.
    mode : tuple of int
        The states of their elements.
    several : bool
        Whether they were given as a sequence.
    """

    driven: Driven = field(repr=False)
    y: tuple[float, ...]
    mode: tuple[int, ...]
    several: bool

    @property
    def states(self) -> dict[str, tuple[str, ...]]:
        """By friction the names of its elements' states."""
        banks = self.driven.program.layout.banks
        return dict(zip((b.name for b in banks), self.driven.states(self.mode), strict=True))


@dataclass(frozen=True, eq=False)
class Solution:
    """What `solve_ivp` returns.

    Parameters
    ----------
    t : ndarray, shape (rows,)
        s.
    y : ndarray, shape (n, rows)
        The caller's state.
    F : ndarray, shape (rows,) or (m, rows)
        Force of the friction, N; of several frictions one row each. At a switch it is the force
        just before it.
    switches : tuple of Switch
        All edges taken, in order.
    friction : Carried
        The frictions at the end: pass it on as `friction` to go on.
    nfev : int
        Number of calls of `fun`.
    success : bool
        Whether the end was reached.
    message : str
        Why not, otherwise.
    """

    t: FloatArray
    y: FloatArray
    F: FloatArray
    switches: tuple[Switch, ...] = field(repr=False)
    friction: Carried = field(repr=False)
    nfev: int
    success: bool
    message: str


def solve_ivp(
    fun: Callable[[float, FloatArray, Any], ArrayLike],
    t_span: Sequence[float],
    y0: ArrayLike,
    friction: Friction | Sequence[Friction] | Carried,
    velocity: Velocity,
    *,
    method: str | type[scipy.integrate.OdeSolver] = "RK45",
    rtol: float = 1e-6,
    atol: ArrayLike | None = None,
    max_step: float = math.inf,
    max_steps: int = MOST_STEPS,
    t_eval: ArrayLike | None = None,
    initial: Mapping[str, Any] | None = None,
) -> Solution:
    """Solve the equations of somebody's own machine with friction in it.

    Like `scipy.integrate.solve_ivp`. Each switch of an element is located, the solver is restarted
    there, and states are frozen between switches.

    Parameters
    ----------
    fun : callable
        ``fun(t, y, F) -> dy/dt`` with the friction force F [N], which resists the motion; of
        several frictions an array, shape (m,).
    t_span : (float, float)
        s: start and end.
    y0 : array_like, shape (n,)
        The caller's state at the start.
    friction : Model, Contact, sequence of them, or Carried
        What rubs. To go on from an earlier call, for example after each tick of a controller, pass
        its ``solution.friction``.
    velocity : int, sequence of int, or callable
        Which component of y is the velocity of the contact [m/s], or ``velocity(y)``; of several
        frictions one each. It must be continuous.
    method : str or type
        ``"RK23"``, ``"RK45"``, ``"DOP853"``, ``"Radau"``, ``"BDF"``, ``"LSODA"``, any other
        `scipy.integrate.OdeSolver` class, or ``"dp45"`` or ``"bs23"`` of gms-fsm.
    rtol : float
        Relative tolerance.
    atol : float or array_like, shape (n,), optional
        Absolute tolerance of the caller's state. By default the smallest one that `simulate` uses
        for this friction (a tenth of rtol times its smallest deflection or velocity), which suits
        positions in m and velocities in m/s; give your own for other quantities.
    max_step : float
        s.
    max_steps : int
        Maximum number of steps.
    t_eval : array_like, optional
        Times of the rows [s]; all steps if omitted.
    initial : mapping, optional
        Initial values of the friction, as for `gms_fsm.simulate`: ``z`` [m], ``states``, ``x`` [m].
        Of several frictions with their names: ``"friction1.z"``, ``"x_friction1"``.

    Returns
    -------
    Solution
        With ``t``, ``y``, ``F``, ``switches`` and ``friction``. If a solver gives up, ``success``
        is False and the rows up to there are kept, as in SciPy.

    Raises
    ------
    ParameterError
        If an argument violates its rule, or a friction cannot be run by a velocity alone (see
        `gms_fsm.FrictionEquations`).

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> def mass(t, y, F):  # 1 kg, pulled through a spring of 2 N/m at 0.1 m/s
    ...     x, v = y
    ...     return [v, 2.0 * (0.1 * t - x) - F]
    >>> solution = solve_ivp(mass, (0.0, 20.0), [0.0, 0.0], model, velocity=1)
    >>> solution.success, len(solution.switches), solution.switches[0].edge
    (True, 4, 'break_away_forward')
    """
    carried = _carried(friction, t_span, initial)
    driven = carried.driven
    y = checked_array("y0", y0, None, "finite")
    start, end = _span(t_span)
    solver, tolerances = _method(method), _tolerances(driven, rtol, atol, len(y))
    host = _Host(fun, _velocities(velocity, len(y), carried), carried, len(y))
    host.check(start, y)
    options = integrators.Options(
        method=solver,
        step=None,
        rtol=checked_scalar("rtol", rtol, "> 0"),
        atol=tolerances,
        max_step=max_step if max_step == math.inf else checked_scalar("max_step", max_step, "> 0"),
        time_scale=driven.start.options.time_scale,
        max_steps=_count(max_steps),
        located=True,
        times=None if t_eval is None else _wanted(t_eval, start, end),
    )
    return host.solution([*y.tolist(), *carried.y], list(carried.mode), start, end, options)


class _Host:
    """The caller's equations and the frictions as one set of equations.

    The state vector is the caller's, followed by that of the frictions.
    """

    def __init__(
        self,
        fun: Callable[[float, FloatArray, Any], ArrayLike],
        velocities: Callable[[FloatArray], list[float]],
        carried: Carried,
        n: int,
    ) -> None:
        self.fun, self.velocities, self.carried, self.n = fun, velocities, carried, n
        self.driven = driven = carried.driven
        self.program = program = driven.program
        self.nfev = 0
        self._rates = [0.0] * program.layout.y.size
        self._seen = [0.0] * program.layout.observed.size
        self._gradient = [0.0] * (program.layout.y.size + 1)
        self._act = IfElse(program).act
        self.tick = IfElse(program).tick

    def check(self, t: float, y: FloatArray) -> None:
        """Call the caller's functions once, for clear errors."""
        v = self.velocities(y)
        if not all(map(math.isfinite, v)):
            raise ParameterError("it must be finite", place="velocity(y0)", value=v)
        self._called(t, y, self._force([0.0] * len(self.driven.forces)))

    def _force(self, forces: list[float]) -> Any:
        return np.array(forces) if self.carried.several else forces[0]

    def _called(self, t: float, y: FloatArray, force: Any) -> list[float]:
        self.nfev += 1
        dy = np.asarray(self.fun(t, y, force), dtype=np.float64)
        if dy.shape != (self.n,):
            raise ParameterError(
                f"fun returns the shape {dy.shape}, but y0 has {self.n} components"
            )
        found: list[float] = dy.tolist()
        return found

    def _full(self, y: Sequence[float]) -> list[float]:
        return self.driven.full(y[self.n :], self.velocities(np.array(y[: self.n])))

    # ------------------------------------------------------------------ as integrators.Equations
    def equations(self) -> integrators.Equations:
        """Return both as one."""
        whole = equations(self.program)
        return integrators.Equations(
            flow=self.flow,
            flow_live=self.flow,  # for runs without located crossings only
            arm=self.arm,
            margins=self.margins,
            normal=self.normal,
            p=whole.p,
            held=whole.held,
            strict=whole.strict,
            relations=whole.relations,
            surfaces=whole.surfaces,
            seen=whole.seen,
        )

    def flow(
        self, t: float, y: list[float], mode: list[int], held: list[float], p: Any, dy: list[float]
    ) -> None:
        host, rates, seen = np.array(y[: self.n]), self._rates, self._seen
        full = self.driven.full(y[self.n :], self.velocities(host))
        self.program.ieee["flow"](t, full, mode, held, p, rates)
        self.program.ieee["observe"](t, full, mode, held, p, seen)
        force = self._force([seen[k] for k in self.driven.forces])
        dy[: self.n] = self._called(t, host, force)
        dy[self.n :] = [rates[k] for k in self.driven.own]

    def arm(
        self,
        t: float,
        y: list[float],
        mode: list[int],
        p: Any,
        held: list[float],
        watch: list[int],
    ) -> None:
        self.program.ieee["arm"](t, self._full(y), mode, p, held, watch)

    def margins(
        self, t: float, y: list[float], mode: list[int], p: Any, watch: list[int], out: list[float]
    ) -> None:
        self.program.ieee["margins"](t, self._full(y), mode, p, watch, out)

    def normal(
        self, surface: int, t: float, y: list[float], mode: list[int], p: Any, out: list[float]
    ) -> None:
        gradient, host = self._gradient, np.array(y[: self.n])
        self.program.ieee["normal"](surface, t, self._full(y), mode, p, gradient)
        for j, slopes in enumerate(self._slopes(host)):
            out[j] = math.fsum(
                gradient[k] * slope
                for k, slope in zip(self.driven.velocities, slopes, strict=True)
            )
        own = [gradient[k] for k in self.driven.own]
        out[self.n : self.n + len(own) + 1] = [*own, gradient[-1]]

    def _slopes(self, host: FloatArray) -> Iterator[list[float]]:
        """Yield for each component of the caller's state how the velocities depend on it."""
        for j in range(self.n):
            step = NUDGE * (abs(host[j]) or 1.0)
            after, before = host.copy(), host.copy()
            after[j], before[j] = host[j] + step, host[j] - step
            width = after[j] - before[j]
            pairs = zip(self.velocities(after), self.velocities(before), strict=True)
            yield [float((b - a) / width) for b, a in pairs]

    def observe(
        self, t: float, y: list[float], mode: list[int], signs: list[float], p: Any, out: Any
    ) -> None:
        self.program.ieee["observe"](t, self._full(y), mode, signs, p, out)

    # ------------------------------------------------------------------ as integrators.Switch
    def ask(self, t: float, y: list[float], mode: list[int], p: Any, edges: list[int]) -> None:
        self.program.ieee["switch"](t, self._full(y), mode, p, edges)

    def act(
        self, edge: int, machine: int, t: float, y: list[float], mode: list[int], p: Any
    ) -> None:
        full = self._full(y)
        self._act(edge, machine, t, full, mode, p)
        y[self.n :] = [full[k] for k in self.driven.own]

    # ------------------------------------------------------------------ running
    def solution(
        self, y: list[float], mode: list[int], start: float, end: float, options: Any
    ) -> Solution:
        """Run, and collect rows and switches."""
        t: list[float] = []
        rows: list[list[float]] = []
        modes: list[tuple[int, ...]] = []
        switches: list[Switch] = []
        whole = self.equations()
        b = hybrid.buffers(whole, start, y, mode, end, options)
        message = ""
        try:
            for event in hybrid.events(whole, self, b, options):
                if isinstance(event, Arc):
                    t += event.t
                    rows += event.y
                    modes += [event.mode] * len(event.t)
                elif isinstance(event, Firing):
                    place, edge = self.driven.place(event.machine), self.driven.edge(event.edge)
                    switches.append(Switch(event.t, *place, edge))
        except HybridError as error:
            message = f"it stopped at t = {error.t!r} s: {error}; {_advice(error)}"
        nfev = self.nfev
        forces = [
            self._observed(whole, b, *row) for row in zip(t, rows, modes, strict=True)
        ]
        table = np.array(forces).reshape(-1, len(self.driven.forces)).T
        states = np.array(rows).reshape(len(t), len(y)).T
        return Solution(
            t=np.array(t),
            y=states[: self.n],
            F=table if self.carried.several else table[0],
            switches=tuple(switches),
            friction=Carried(
                self.driven, tuple(b.now.y[self.n :]), tuple(b.now.mode), self.carried.several
            ),
            nfev=nfev,
            success=not message,
            message=message or "the end was reached",
        )

    def _observed(
        self, whole: integrators.Equations, b: Any, t: float, y: list[float], mode: tuple[int, ...]
    ) -> list[float]:
        """Return the forces at a row; on a surface with the sigmas there."""
        layout = self.program.layout
        out = [0.0] * layout.observed.size
        sliding = integrators.sliding_scratch(
            whole.surfaces, len(y), whole.held, len(whole.strict), whole.seen, mode[layout.slides]
        )
        functions = Functions(whole.flow, whole.arm, whole.margins, whole.normal, whole.p)
        look(
            self.observe,
            Held(functions, [0.0] * whole.held, sliding),
            t,
            y,
            list(mode[layout.elements]),
            out,
        )
        return [out[k] for k in self.driven.forces]


def _advice(error: HybridError) -> str:
    """Say what to do where the solver gives up."""
    if isinstance(error, NotFinite):
        return "fun, velocity or the friction gives NaN or infinity there"
    if isinstance(error, Livelock):
        return "states keep switching without progress: prove() finds such guards"
    return "try a stiff method ('Radau'), or a larger rtol and atol"


# --------------------------------------------------------------------------- arguments
def _carried(
    friction: Friction | Sequence[Friction] | Carried,
    t_span: Sequence[float],
    initial: Mapping[str, Any] | None,
) -> Carried:
    if isinstance(friction, Carried):
        if initial is not None:
            raise ParameterError(
                "it goes on from an earlier call, so it has its state",
                place="friction",
                advice="leave out initial=...",
            )
        return friction
    several = isinstance(friction, Sequence)
    frictions: list[Friction] = list(friction) if isinstance(friction, Sequence) else [friction]
    if not frictions:
        raise ParameterError("it is empty", place="friction", advice="give at least one")
    driven = Driven.of(frictions, _span(t_span)[0], initial)
    return Carried(driven, tuple(driven.initial), tuple(driven.start.mode), several)


def _span(t_span: Sequence[float]) -> tuple[float, float]:
    start, end = checked_array("t_span", t_span, 2, "finite").tolist()
    if not end > start:
        raise ParameterError(
            f"t_span ends at {end!r} s and begins at {start!r} s", advice="the end must be later"
        )
    return start, end


def _count(max_steps: int) -> int:
    if isinstance(max_steps, bool) or not isinstance(max_steps, int) or max_steps < 1:
        raise ParameterError("it must be an integer, at least 1", place="max_steps", value=max_steps)
    return max_steps


def _wanted(t_eval: ArrayLike, start: float, end: float) -> list[float]:
    times = checked_array("t_eval", t_eval, None, "finite")
    if (np.diff(times) <= 0.0).any() or times[0] < start or times[-1] > end:
        raise ParameterError(
            "its times must increase and lie within t_span", place="t_eval", value=times
        )
    found: list[float] = times.tolist()
    return found


def _method(method: str | type[Any]) -> Tableau | type[Any]:
    if isinstance(method, str) and method in OURS:
        return integrators.METHODS[method]
    if isinstance(method, str) and method in METHODS:
        solver: type[Any] = getattr(scipy.integrate, method)
        return solver
    if isinstance(method, type) and issubclass(method, scipy.integrate.OdeSolver):
        return method
    known = ", ".join(map(repr, (*METHODS, *OURS)))
    raise ParameterError(
        "it is no method", place="method", value=method, advice=f"use {known}, or an OdeSolver class"
    )


def _tolerances(driven: Driven, rtol: float, atol: ArrayLike | None, n: int) -> list[float]:
    """Return the absolute tolerance of each component of the combined state, all > 0."""
    found = driven.tolerances(checked_scalar("rtol", rtol, "> 0"))
    least = min((u for u in found if u > 0.0), default=None)
    own = found[: len(driven.own)]
    if atol is None:
        if least is None:
            raise ParameterError(
                "the friction's chart gives no scale",
                place="atol",
                value=None,
                advice="give one, for example atol=1e-9",
            )
        host = [least] * n
    elif np.ndim(atol) == 0:
        host = [checked_scalar("atol", atol, "> 0")] * n
    else:
        host = checked_array("atol", atol, n, "> 0").tolist()
    return [*host, *(u or least or min(host) for u in own)]


def _velocities(
    velocity: Velocity, n: int, carried: Carried
) -> Callable[[FloatArray], list[float]]:
    """Return the velocities of the frictions as a function of the caller's state."""
    m = len(carried.driven.forces)
    if callable(velocity):

        def called(y: FloatArray) -> list[float]:
            v = np.asarray(velocity(y), dtype=np.float64)
            if v.shape != ((m,) if carried.several else ()):
                raise ParameterError(
                    f"velocity(y) has the shape {v.shape}",
                    advice=f"it must be ({m},)" if carried.several else "it must be one number",
                )
            return [float(u) for u in np.atleast_1d(v)]

        return called
    given = velocity if isinstance(velocity, Sequence) else [velocity]
    if len(given) != m or isinstance(velocity, Sequence) != carried.several:
        raise ParameterError(
            f"there {'is 1 friction' if m == 1 else f'are {m} frictions'}",
            place="velocity",
            value=velocity,
            advice="give one component of y for each, or a function of y",
        )
    for place in given:
        if isinstance(place, bool) or not isinstance(place, int) or not -n <= place < n:
            raise ParameterError(
                f"velocity has {shown(place)}, which is no component of y0",
                advice=f"they are 0 to {n - 1}",
            )

    def picked(y: FloatArray) -> list[float]:
        return [float(y[place]) for place in given]

    return picked
