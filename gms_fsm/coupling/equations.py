"""Friction as equations with events, for another solver that locates events.

Between two events everything is smooth: the states are frozen, and so is every sign. The solver
integrates `FrictionEquations.derivatives` beside its own equations, stops where
`FrictionEquations.truth` changes, and asks for the new states with `FrictionEquations.settle`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm.charts.parameters import FloatArray, as_numbers, checked_array, checked_scalar
from gms_fsm.coupling.driven import Driven
from gms_fsm.coupling.stepping import ElementSwitch
from gms_fsm.errors import ChartError, ParameterError
from gms_fsm.foundation.arguments import refusing
from gms_fsm.lowering.program import equations
from gms_fsm.run.machines import IfElse
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact
from integrators import hybrid
from integrators.crossings import watched
from integrators.loop import FIRED, FIRING, PAUSED, run_to_event
from integrators.steps import ArcMotion


@refusing(quick=("derivatives", "force", "margins", "truth"))
class FrictionEquations:
    """One friction as equations with events.

    The caller has the masses, and gives the velocity v of the contact with every call. The
    friction's own state is a vector y: its position, then the variables of its elements.

    Parameters
    ----------
    model_or_contact : Model or Contact
        What rubs: friction with one velocity and without locks. The force of a locked state is
        whatever keeps v = 0, which only the owner of the masses knows.
    t : float
        s: when it starts.
    initial : mapping, optional
        As for `gms_fsm.simulate`: any of ``x`` [m], the chart's variables and ``states``.

    Attributes
    ----------
    size : int
        Length of y.
    initial : ndarray, shape (size,)
        y at the start.
    switches : tuple of ElementSwitch
        The edges taken in the last call of `settle`.

    Raises
    ------
    ParameterError
        If the friction needs more than a velocity, or an argument violates its rule.

    Notes
    -----
    An event is a point where `truth` differs from what it was after the last `settle`. Go just past
    it, so that the comparison has really changed (bisect on `truth`, and take the right end): a
    root of a margin may lie a rounding error before it, and then nothing fires.

    A chart whose force jumps where v changes its sign makes such a loop chatter at v = 0.
    `gms_fsm.adapters.scipy.solve_ivp` and `gms_fsm.simulate` slide along v = 0 instead.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> friction = FrictionEquations(GMS(GMSParameters.paper("stick-slip"), law="signed"))
    >>> y = friction.settle(0.0, friction.initial, 0.1)
    >>> friction.states, len(friction.switches)
    (('stick', 'stick', 'stick', 'stick'), 0)
    >>> before, y[1:] = friction.truth(0.0, y, 0.1), 0.5  # m, beyond the thresholds
    >>> friction.truth(0.0, y, 0.1) == before
    False
    >>> y = friction.settle(0.0, y, 0.1)
    >>> friction.switches[0]
    ElementSwitch(t=0.0, element=0, edge='break_away_forward')
    """

    def __init__(
        self,
        model_or_contact: Model | Contact,
        *,
        t: float = 0.0,
        initial: Mapping[str, Any] | None = None,
    ) -> None:
        self._driven = driven = Driven.of([model_or_contact], t, initial, several=False)
        program = driven.program
        self.size = len(driven.own)
        self.initial: FloatArray = np.array(driven.initial)
        self.switches: tuple[ElementSwitch, ...] = ()
        self._mode = list(driven.start.mode)
        self._held = [0.0] * program.held
        self._watch = [0] * len(program.strict)
        self._above = watched(program.strict, program.layout.y.size).above
        self._active: list[int] | None = None  # until the first settle

    @property
    def states(self) -> tuple[str, ...]:
        """The names of the elements' states."""
        return self._driven.states(self._mode)[0]

    # ------------------------------------------------------------------ between two events
    def derivatives(self, t: float, y: ArrayLike, v: float) -> FloatArray:
        """Return dy/dt.

        Parameters
        ----------
        t : float
            s.
        y : array_like, shape (size,)
            The friction's own state.
        v : float
            Velocity of the contact, m/s.

        Returns
        -------
        ndarray, shape (size,)
            With the states and signs of the last `settle`.

        Raises
        ------
        ParameterError
            If y has another length, or before the first `settle`.
        """
        program, (t, full) = self._driven.program, self._read(t, y, v)
        dy = [0.0] * len(full)
        program.ieee["flow"](t, full, self._mode, self._held, program.p, dy)
        return np.array([dy[k] for k in self._driven.own])

    def force(self, t: float, y: ArrayLike, v: float) -> float:
        """Return the force with which the contact resists the motion, N.

        Parameters
        ----------
        t, y, v
            As in `derivatives`.

        Returns
        -------
        float
            With the states and signs of the last `settle`.

        Raises
        ------
        ParameterError
            As in `derivatives`.
        """
        program, (t, full) = self._driven.program, self._read(t, y, v)
        seen = [0.0] * program.layout.observed.size
        program.ieee["observe"](t, full, self._mode, self._held, program.p, seen)
        return seen[self._driven.forces[0]]

    def margins(self, t: float, y: ArrayLike, v: float) -> FloatArray:
        """Return the watched comparisons as numbers that change sign where the comparison does.

        Parameters
        ----------
        t, y, v
            As in `derivatives`.

        Returns
        -------
        ndarray
            Those that can change a state; each `settle` chooses them again.

        Raises
        ------
        ParameterError
            As in `derivatives`.
        """
        return np.array(self._margins(t, y, v))

    def truth(self, t: float, y: ArrayLike, v: float) -> tuple[bool, ...]:
        """Return which of the watched comparisons hold.

        Parameters
        ----------
        t, y, v
            As in `derivatives`.

        Returns
        -------
        tuple of bool
            In the order of `margins`; an event is where this changes.

        Raises
        ------
        ParameterError
            As in `derivatives`.
        """
        found = self._margins(t, y, v)
        assert self._active is not None  # _margins has looked
        return tuple(u > self._above[r] for u, r in zip(found, self._active, strict=True))

    def _margins(self, t: float, y: ArrayLike, v: float) -> list[float]:
        program, (t, full) = self._driven.program, self._read(t, y, v)
        out = [0.0] * len(self._watch)
        program.ieee["margins"](t, full, self._mode, program.p, self._watch, out)
        return [out[r] for r in self._active or ()]

    def _read(self, t: float, y: ArrayLike, v: float) -> tuple[float, list[float]]:
        """Return the time and the program's state vector."""
        # NaN passes: a solver's trial step may overflow, and the solver then tries a smaller one.
        if self._active is None:
            raise ParameterError(
                "which comparisons are watched is not known before the first settle",
                place="FrictionEquations",
                advice="call y = friction.settle(t, friction.initial, v) at the start",
            )
        t, v, state = _number("t", t), _number("v", v), as_numbers("y", y)
        if state.shape != (self.size,):
            raise ParameterError(
                f"y has the shape {state.shape}", advice=f"it must be ({self.size},)"
            )
        return t, self._driven.full(state.tolist(), (v,))

    # ------------------------------------------------------------------ at an event
    def settle(self, t: float, y: ArrayLike, v: float) -> FloatArray:
        """Take all edges that are enabled, until none is.

        Parameters
        ----------
        t, y, v
            As in `derivatives`, finite.

        Returns
        -------
        ndarray, shape (size,)
            y afterwards: an edge may assign something.

        Raises
        ------
        ParameterError
            If a number is not finite or y has another length; nothing has changed then.
        ChartError
            If edges are enabled without end, or assign NaN; nothing has changed then.
        """
        t, v = checked_scalar("t", t, "finite"), checked_scalar("v", v, "finite")
        own = checked_array("y", y, self.size, "finite").tolist()
        driven, program = self._driven, self._driven.program
        made = equations(program)
        b = hybrid.buffers(
            made, t, driven.full(own, (v,)), self._mode, t, driven.start.options, capacity=1
        )
        b.now.pause = t
        functions, switch = made.functions(located=True), IfElse(program)
        taken: list[ElementSwitch] = []
        motion = ArcMotion(functions.flow, functions.margins, functions.p, functions.follow)
        while (event := run_to_event(functions, switch, motion, b, 1)) != PAUSED:
            if event == FIRED:
                machine, edge = b.memory.machine, b.memory.edge
                taken.append(ElementSwitch(t, machine, driven.edge(edge)))
            elif event != FIRING:
                last = taken[-1]
                raise ChartError(
                    f"edges are enabled without end, {last.edge!r} of element {last.element + 1} "
                    "among them",
                    place=f"t = {t!r} s",
                    advice="prove() finds such guards",
                )
        full, mode = b.now.y, b.now.mode
        if not all(map(math.isfinite, full)):
            raise ChartError(
                f"an edge assigns NaN or infinity: y is {[full[k] for k in driven.own]}",
                place=f"t = {t!r} s",
                advice=f"look at the actions of {', '.join({each.edge for each in taken})}",
            )
        self._mode, self.switches = mode, tuple(taken)
        self._held, self._watch = [0.0] * program.held, [0] * len(self._watch)  # copies share none
        program.ieee["arm"](t, full, mode, program.p, self._held, self._watch)
        self._active = [r for r, why in enumerate(self._watch) if why]
        return np.array([full[k] for k in driven.own])


def _number(name: str, value: Any) -> float:
    try:
        if isinstance(value, str):  # float("0.1") is a number
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise ParameterError("it must be a number", place=name, value=value) from None
