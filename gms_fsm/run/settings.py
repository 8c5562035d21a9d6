"""Integration settings: one object shared by runs, sessions, sweeps and scenario files."""

from __future__ import annotations

import dataclasses
import math
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

import integrators
from gms_fsm.charts.parameters import FloatArray, checked_array, checked_scalar
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import meant, one_of, refusing
from gms_fsm.foundation.equality import are_same
from gms_fsm.lowering.scales import Tolerance

MOST_STEPS = 1_000_000  # default limit for a run
ENGINES = ("machines", "ifelse", "compiled")
EVENTS = ("located", "step", "held")
OUTPUTS = ("all", "t_eval", "end")


class RunOptions(TypedDict, total=False):
    """The fields of `Settings` except the engine, as arguments of `simulate`."""

    method: str | type[Any]
    step: float | None
    rtol: float
    atol: Tolerance
    max_step: float
    max_steps: int
    events: str
    output: str | None
    t_eval: ArrayLike | None


class SettingOptions(RunOptions, total=False):
    """The fields of `Settings`, as arguments of `Session` and `sweep`."""

    engine: str


@refusing()
@dataclass(frozen=True, kw_only=True, eq=False)
class Settings:
    """How to integrate, which engine evaluates the guards, and what to record.

    Parameters
    ----------
    method : {"dp45", "bs23", "rk4", "heun", "euler"} or OdeSolver class
        dp45 and bs23 choose their own steps, the others need `step`. Any
        `scipy.integrate.OdeSolver` class (Radau, BDF, LSODA ...) for stiff cases.
    step : float, optional
        Length of fixed steps [s], the last one cut to t_end; at a located crossing a step is cut,
        and the next one returns to the grid. A SciPy class goes from grid point to grid point.
    rtol : float
        Relative tolerance of adaptive steps; the error is that of the worst component.
    atol : float or mapping, optional
        Absolute tolerance of all components, or by name: ``x`` [m], ``v`` [m/s], the chart's
        variables, each a number or one per element. Omitted values are derived from the model's own
        scales (`gms_fsm.lowering.scales`): a tenth of rtol times the smallest deflection at which a
        guard changes, or times v_c. A component for which the chart has no scale is measured
        relative to its largest value so far. The values used are in ``Trace.settings``.
    max_step : float
        Longest adaptive step, s. Not needed for accuracy.
    max_steps : int
        Maximum number of attempted steps, besides four for each tick of a sampler or of a contact
        with a period; a run that needs more ends in a `StepLimitError`.
    events : {"located", "step", "held"}
        ``"located"`` finds the exact point of each switch. ``"step"`` evaluates the guards once at
        the end of a step, at most one edge per element, like an if-else in a block diagram: it
        misses switches and is here to demonstrate that. It needs `step` or a finite `max_step`.
        ``"held"`` evaluates the guards at ticks `step` apart and holds what the chart gives out
        (rates and force) between them, as a chart with a sample time does in a block diagram; the
        motion between two ticks is integrated with steps of its own.
    engine : {"machines", "ifelse", "compiled"}
        What evaluates the guards: the `transitions` machines, the generated if-else text, or that
        text as machine code (extra ``fast``). The results are the same to the last bit.
    output : {"all", "t_eval", "end"}, optional
        Rows to record: every accepted step, the times in `t_eval`, or only the state at the end.
        The transition log is always complete. Defaults to ``"t_eval"`` if that is given, else
        ``"all"``.
    t_eval : array_like, shape (m,), optional
        Requested times [s], increasing; the trace then has exactly these rows. Otherwise it has all
        accepted steps and micro-steps.

    Raises
    ------
    ParameterError
        If a field violates its rule, or two contradict each other.

    Examples
    --------
    >>> Settings(method="rk4", step=1e-3).method
    'rk4'
    >>> Settings(method="rk4")
    Traceback (most recent call last):
    ...
    gms_fsm.errors.ParameterError: method 'rk4' has no error estimate; give step=..., or use \
'dp45' or 'bs23'
    """

    method: str | type[Any] = "dp45"
    step: float | None = None
    rtol: float = 1e-6
    atol: Tolerance = None
    max_step: float = math.inf
    max_steps: int = MOST_STEPS
    events: str = "located"
    engine: str = "machines"
    output: str | None = None
    t_eval: ArrayLike | None = None

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Settings):
            return NotImplemented
        mine, its = self.t_eval, other.t_eval
        same = mine is its if mine is None or its is None else np.array_equal(mine, its)
        return same and {**vars(self), "t_eval": 0} == {**vars(other), "t_eval": 0}

    __hash__ = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        put = object.__setattr__
        self._check_method()
        put(self, "rtol", checked_scalar("rtol", self.rtol, "> 0"))
        if self.step is not None:
            put(self, "step", checked_scalar("step", self.step, "> 0"))
        if self.max_step != math.inf:
            put(self, "max_step", checked_scalar("max_step", self.max_step, "> 0"))
        if isinstance(self.atol, Mapping):
            put(self, "atol", dict(self.atol))  # the names are checked against the model later
        elif self.atol is not None:
            put(self, "atol", checked_scalar("atol", self.atol, "> 0"))
        _check_count(self.max_steps)
        one_of("events", self.events, EVENTS)
        if self.events == "step" and self.step is None and not math.isfinite(self.max_step):
            raise ParameterError(
                "events='step' checks the guards once per step: give step=... or a finite max_step",
                key=("events",),
            )
        if self.events == "held" and self.step is None:
            raise ParameterError(
                "events='held' evaluates the chart at ticks",
                advice="give their distance, step=...",
                key=("events",),
            )
        if self.t_eval is not None:
            put(self, "t_eval", _increasing(self.t_eval))
        put(self, "output", self._output())

    def _check_method(self) -> None:
        method = self.method
        if not isinstance(self.engine, str) or self.engine not in ENGINES:
            raise ParameterError(
                f"it must be {', '.join(map(repr, ENGINES))}, or an ElementMachines",
                place="engine",
                value=self.engine,
            )
        if isinstance(method, str):
            if method not in integrators.METHODS:
                raise ParameterError(
                    f"it must be {', '.join(map(repr, integrators.METHODS))}, or a class such as "
                    "scipy.integrate.RK45, without quotes",
                    place="method",
                    value=method,
                )
            steps = None if self.events == "held" else self.step
            if steps is None and not integrators.METHODS[method].adaptive:
                raise ParameterError(
                    f"method {method!r} has no error estimate",
                    advice="give step=..., or use 'dp45' or 'bs23'",
                    key=("method",),
                )
        elif not (isinstance(method, type) and hasattr(method, "TOO_SMALL_STEP")):
            raise ParameterError(
                f"it must be a name ({', '.join(integrators.METHODS)}) or a "
                "scipy.integrate.OdeSolver class",
                place="method",
                value=method,
            )
        elif self.engine == "compiled":
            raise ParameterError(
                f"engine 'compiled' runs the built-in methods ({', '.join(integrators.METHODS)}), "
                f"not {method.__name__}",
                advice="use engine='machines' for SciPy's solvers",
                key=("engine",),
            )

    def _output(self) -> str:
        if self.output is None:
            return "all" if self.t_eval is None else "t_eval"
        one_of("output", self.output, OUTPUTS)
        if (self.output == "t_eval") != (self.t_eval is not None):
            raise ParameterError(
                "output='t_eval' needs t_eval=..., the times of the rows"
                if self.t_eval is None
                else f"output is {self.output!r}, but t_eval requests rows at given times; leave "
                "one of them out"
            )
        return self.output

    @property
    def held_period(self) -> float | None:
        """The period of outputs that are held, s."""
        return self.step if self.events == "held" else None

    @classmethod
    def of(
        cls, settings: Settings | None, whose: str, **options: Unpack[SettingOptions]
    ) -> Settings:
        """Return settings with some fields replaced.

        Parameters
        ----------
        settings : Settings or None
            The settings to start from; the defaults if None.
        whose : str
            The function that was given the options, for messages.
        **options
            Fields by name.

        Returns
        -------
        Settings
            Checked again.

        Raises
        ------
        ParameterError
            If there is no such field, or one violates its rule.

        Examples
        --------
        >>> Settings.of(Settings(rtol=1e-8), "simulate", engine="ifelse").rtol
        1e-08
        >>> Settings.of(None, "simulate", rtoll=1e-8)
        Traceback (most recent call last):
        ...
        gms_fsm.errors.ParameterError: simulate takes no argument 'rtoll'; did you mean 'rtol'?
        """
        if not (settings is None or isinstance(settings, Settings)):
            raise ParameterError(
                "it must be a Settings, for example Settings(rtol=1e-8)",
                place="settings",
                value=settings,
            )
        fields = cls.__dataclass_fields__
        for name in options:
            if name not in fields:
                hint = meant(name, [*fields, "t_end", "t_start"]) or f"it takes {', '.join(fields)}"
                raise ParameterError(f"{whose} takes no argument {name!r}", advice=hint.strip())
        if settings is None:
            return cls(**options)
        if "t_eval" in options and "output" not in options:
            options["output"] = None
        return dataclasses.replace(settings, **options)

    @property
    def method_name(self) -> str:
        """The method's name, also for a class."""
        return self.method if isinstance(self.method, str) else self.method.__name__


def _check_count(max_steps: object) -> None:
    if isinstance(max_steps, bool) or not isinstance(max_steps, int) or max_steps < 1:
        raise ParameterError(
            "it must be an integer, at least 1 step", place="max_steps", value=max_steps
        )


_latest = weakref.ref[FloatArray](np.empty(0))  # times that were found to increase, while in use


def _increasing(t_eval: ArrayLike) -> FloatArray:
    global _latest
    known = _latest()
    if known is not None and known.flags.writeable:
        known = None  # somebody may have changed them
    if known is not None and isinstance(t_eval, np.ndarray) and are_same(t_eval, known):
        return known
    if isinstance(t_eval, float | int):
        raise ParameterError(
            "it must be the times of the rows",
            place="t_eval",
            value=t_eval,
            advice="such as numpy.linspace(0.0, t_end, 100) for 100 of them",
        )
    wanted = checked_array("t_eval", t_eval, None, "finite")
    wrong = np.flatnonzero(wanted[1:] <= wanted[:-1])
    if wrong.size:
        i = int(wrong[0])
        raise ParameterError(
            f"t_eval[{i}] = {wanted[i]} is not before t_eval[{i + 1}] = {wanted[i + 1]}",
            advice="times must increase",
        )
    _latest = weakref.ref(wanted)
    return wanted
