"""Friction in equations for SciPy: `solve_ivp` with events and restarts done for the user."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
import scipy.integrate
from numpy.typing import ArrayLike, NDArray

import integrators
from gms_fsm.adapters._scipy_located import Located
from gms_fsm.adapters._scipy_parts import (
    Caller,
    Carried,
    ContactSwitch,
    Solution,
    SteppedFriction,
    numbers,
)
from gms_fsm.adapters._scipy_sampled import Solver, sampled, samples
from gms_fsm.charts.parameters import FloatArray, checked_array, checked_scalar
from gms_fsm.coupling.bank import FrictionBank
from gms_fsm.coupling.driven import Driven
from gms_fsm.coupling.stepping import FrictionState
from gms_fsm.errors import ParameterError, shown
from gms_fsm.foundation.arguments import checked_integer
from gms_fsm.lowering.scales import scales_of
from gms_fsm.run.settings import MOST_STEPS
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact
from integrators import Tableau

__all__ = ["Carried", "ContactSwitch", "Solution", "SteppedFriction", "solve_ivp"]

Friction: TypeAlias = Model | Contact
Given: TypeAlias = Friction | Sequence[Friction] | Carried | SteppedFriction
Velocity: TypeAlias = (
    int | Sequence[int] | NDArray[np.integer[Any]] | Callable[[FloatArray], ArrayLike]
)
METHODS = ("RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA")  # of SciPy
OURS = tuple(name for name, tableau in integrators.METHODS.items() if tableau.adaptive)


def solve_ivp(
    fun: Callable[[float, FloatArray, Any], ArrayLike],
    t_span: Sequence[float],
    y0: ArrayLike,
    friction: Given,
    velocity: Velocity,
    *,
    method: str | type[scipy.integrate.OdeSolver] = "RK45",
    rtol: float = 1e-6,
    atol: ArrayLike | None = None,
    max_step: float = math.inf,
    max_steps: int = MOST_STEPS,
    t_eval: ArrayLike | None = None,
    sample: float | None = None,
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
    friction : Model, Contact, sequence of them, Carried or SteppedFriction
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
    sample : float, optional
        s: instead of locating the switches in the combined equations, let `gms_fsm.FrictionState`
        step from sample to sample. Within one, `fun` sees the force that results if the velocity
        goes to its present value on a straight line. Rows are the samples. For `fun` that must not
        be interrupted at switches; the result depends on the length of the sample.
    initial : mapping, optional
        Initial values of the friction, as for `gms_fsm.simulate`: ``z`` [m], ``states``, ``x`` [m].
        Of several frictions with their names: ``"friction1.z"``, ``"x_friction1"``; with samples,
        as for `gms_fsm.FrictionBank`.

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
    start, end = _span(t_span)
    y = checked_array("y0", y0, None, "finite")
    rtol = checked_scalar("rtol", rtol, "> 0")
    solver, limit = _method(method), _longest(max_step)
    if sample is not None:
        sample = checked_scalar("sample", sample, "> 0")
        stepped = _stepped(friction, start, initial, rtol)
        caller = Caller(fun, _velocities(velocity, len(y), stepped), stepped.several, len(y))
        caller.check(start, y, len(stepped.names))
        scales = [u for each in stepped.given for u in _all_tolerances(each, rtol)]
        how = Solver(
            _of_scipy(solver, t_eval),
            rtol,
            _of_host(scales, atol, len(y)),
            limit,
            checked_integer("max_steps", max_steps, 1),
        )
        return sampled(caller, stepped, y, samples(start, end, sample), how)
    carried = _carried(friction, start, initial)
    caller = Caller(fun, _velocities(velocity, len(y), carried), carried.several, len(y))
    caller.check(start, y, len(carried.names))
    driven = carried.driven
    options = integrators.LoopOptions(
        method=solver,
        step=None,
        rtol=rtol,
        atol=_tolerances(driven, rtol, atol, len(y)),
        max_step=limit,
        time_scale=driven.start.options.time_scale,
        max_steps=checked_integer("max_steps", max_steps, 1),
        located=True,
        times=None if t_eval is None else _wanted(t_eval, start, end),
    )
    return Located(caller, carried).solution(y, start, end, options)


# --------------------------------------------------------------------------- arguments
def _carried(given: Given, start: float, initial: Mapping[str, Any] | None) -> Carried:
    if isinstance(given, SteppedFriction):
        raise ParameterError(
            "it is from a call with sample=...", place="friction", advice="give sample=... again"
        )
    if isinstance(given, Carried):
        _has_its_state(initial)
        return given
    several = isinstance(given, Sequence)
    driven = Driven.of(_listed(given), start, initial, several=several)
    return Carried(driven, tuple(driven.initial), tuple(driven.start.mode), several)


def _stepped(
    given: Given, start: float, initial: Mapping[str, Any] | None, rtol: float
) -> SteppedFriction:
    if isinstance(given, Carried):
        raise ParameterError(
            "it is from a call without sample=...", place="friction", advice="leave it out again"
        )
    if isinstance(given, SteppedFriction):
        _has_its_state(initial)
        now = given.snapshot.t
        if now != start:
            raise ParameterError(
                f"t_span begins at {start!r} s, but the friction has come to {now!r} s",
                advice="begin there: t_span = (solution.t[-1], ...)",
            )
        given.stepper.restore(given.snapshot)
        return given
    frictions = _listed(given)
    stepper: FrictionState | FrictionBank
    if isinstance(given, Sequence):
        stepper = FrictionBank(frictions, t=start, initial=initial, rtol=rtol)
    else:
        stepper = FrictionState(frictions[0], t=start, initial=initial, rtol=rtol)
    if stepper.inputs:
        raise ParameterError(
            f"its texts name {', '.join(map(repr, stepper.inputs))}, which nobody gives here",
            place="friction",
            advice="give the contact formulas in t (inputs=...), or use FrictionState yourself",
        )
    made = SteppedFriction(stepper, stepper.snapshot(), tuple(frictions))
    if len({*made.names}) < len(frictions):
        raise ParameterError(
            f"they are called {', '.join(map(repr, made.names))}",
            place="friction",
            advice="every name must be unique",
        )
    return made


def _listed(given: Friction | Sequence[Friction]) -> list[Friction]:
    frictions: list[Friction] = list(given) if isinstance(given, Sequence) else [given]
    if not frictions:
        raise ParameterError("it is empty", place="friction", advice="give at least one")
    return frictions


def _has_its_state(initial: Mapping[str, Any] | None) -> None:
    if initial is not None:
        raise ParameterError(
            "it goes on from an earlier call, so it has its state",
            place="friction",
            advice="leave out initial=...",
        )


def _span(t_span: Sequence[float]) -> tuple[float, float]:
    start, end = checked_array("t_span", t_span, 2, "finite").tolist()
    if not end > start:
        raise ParameterError(
            f"t_span ends at {end!r} s and begins at {start!r} s", advice="the end must be later"
        )
    return start, end


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
        "it is no method",
        place="method",
        value=method,
        advice=f"use {known}, or an OdeSolver class",
    )


def _longest(max_step: float) -> float:
    return max_step if max_step == math.inf else checked_scalar("max_step", max_step, "> 0")


def _tolerances(driven: Driven, rtol: float, atol: ArrayLike | None, n: int) -> list[float]:
    """Return the absolute tolerance of each component of the combined state, all > 0."""
    found = driven.tolerances(rtol)
    host = _of_host(found, atol, n)
    least = min((u for u in found if u > 0.0), default=min(host))
    return [*host, *(u or least for u in found[: len(driven.own)])]


def _of_host(found: Iterable[float], atol: ArrayLike | None, n: int) -> list[float]:
    """Return the absolute tolerances of the caller's state, given those of the frictions."""
    if atol is None:
        least = min((u for u in found if u > 0.0), default=None)
        if least is None:
            raise ParameterError(
                "the friction's chart gives no scale",
                place="atol",
                value=None,
                advice="give one, for example atol=1e-9",
            )
        return [least] * n
    if np.ndim(atol) == 0:
        return [checked_scalar("atol", atol, "> 0")] * n
    several: list[float] = checked_array("atol", atol, n, "> 0").tolist()
    return several


def _velocities(
    velocity: Velocity, n: int, frictions: Carried | SteppedFriction
) -> Callable[[FloatArray], list[float]]:
    """Return the velocities of the frictions as a function of the caller's state."""
    m, several = len(frictions.names), frictions.several
    if callable(velocity):

        def called(y: FloatArray) -> list[float]:
            v = numbers("velocity", velocity(y))
            if v.shape != ((m,) if several else ()):
                raise ParameterError(
                    f"velocity(y) has the shape {v.shape}",
                    advice=f"it must be ({m},)" if several else "it must be one number",
                )
            return [float(u) for u in np.atleast_1d(v)]

        return called
    places: Any = velocity.tolist() if isinstance(velocity, np.ndarray | np.integer) else velocity
    given: Sequence[Any] = places if isinstance(places, Sequence) else [places]
    if len(given) != m or isinstance(places, Sequence) != several:
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


def _all_tolerances(friction: Friction, rtol: float) -> list[float]:
    return [u for row in scales_of(friction).tolerances(rtol).values() for u in row]


def _of_scipy(solver: Tableau | type[Any], t_eval: ArrayLike | None) -> type[Any]:
    if isinstance(solver, Tableau):
        raise ParameterError(
            "sample=... takes the methods of SciPy only",
            place="method",
            value=solver.name,
            advice=f"use one of {', '.join(METHODS)}",
        )
    if t_eval is not None:
        raise ParameterError("the rows are the samples", place="t_eval", advice="leave it out")
    return solver
