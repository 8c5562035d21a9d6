"""Describing functions: the first harmonic of what switches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.coupling.steppable import alone
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind, refusing, unknown
from gms_fsm.lowering.program import refuse_functions
from gms_fsm.run.settings import Settings
from gms_fsm.run.simulate import simulate
from gms_fsm.run.stepped.memory import fast
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Body, Contact, System

__all__ = ["describing_function"]

REPEATS = 1e-3  # of the first harmonic: two periods differ by less
CYCLES = (4, 16, 64)  # periods that are tried
AMPLITUDE, OMEGA, SINE, COSINE = "wave_A", "wave_w", "wave_sin", "wave_cos"


@refusing()
def describing_function(
    friction_or_system: Model | Contact | System,
    amplitude: ArrayLike,
    omega: ArrayLike,
    *,
    input: str = "",  # noqa: A002
    output: str = "",
    initial: Mapping[str, Any] | None = None,
    rtol: float = 1e-6,
) -> NDArray[np.complex128]:
    """Return the first harmonic of the answer to a sine, divided by that sine.

    A friction is moved as x = A sin(w t) and answers with its force: the real part is a stiffness,
    the imaginary part w times a damping. Of a system, one signal or number becomes a sine, and any
    of its values is the answer. Each point is a run with located switches, whose Fourier integrals
    are states of the run, until two periods are equal.

    Parameters
    ----------
    friction_or_system : Model, Contact or System
        What answers.
    amplitude : array_like, shape (m,)
        Of the sine, > 0: m for a friction.
    omega : array_like, shape (k,)
        rad/s, > 0.
    input, output : str
        Of a system: the name of a signal or number, which is replaced by the sine (a number is its
        mean), and a text over what its texts can read, such as ``"x_l"`` or ``"pad.F"``.
    initial, rtol
        As for `gms_fsm.simulate`.

    Returns
    -------
    ndarray of complex, shape (m, k)
        N/m for a friction. NaN where the answer does not repeat after 64 periods.

    Raises
    ------
    ParameterError, ExpressionError
        If an argument violates its rule, or the friction locks: give the system it acts in.

    Examples
    --------
    >>> from gms_fsm import Chart, ChartModel, State
    >>> coulomb = Chart("Coulomb", parameters=("F_c",), states=(State("on"),),
    ...                 outputs={"F": "F_c * sgn(v)"})
    >>> N = describing_function(ChartModel(coulomb, {"F_c": 2.0}), [0.1], [3.0])
    >>> print(f"{abs(N[0, 0]):.4f} N/m, 4 F_c / (pi A) = {4 * 2.0 / (np.pi * 0.1):.4f} N/m")
    25.4648 N/m, 4 F_c / (pi A) = 25.4648 N/m
    """
    amplitudes, omegas = _positive("amplitude", amplitude), _positive("omega", omega)
    system = _driven(friction_or_system, input, output)
    found = np.full((amplitudes.size, omegas.size), np.nan, dtype=np.complex128)
    for i, A in enumerate(amplitudes.tolist()):
        for k, w in enumerate(omegas.tolist()):
            now = replace(system, numbers={**system.numbers, AMPLITUDE: A, OMEGA: w})
            found[i, k] = _harmonic(now, w, initial, rtol) / A
    return found


def _positive(name: str, given: ArrayLike) -> FloatArray:
    values = np.atleast_1d(np.asarray(given, dtype=object)).ravel()
    return np.array([checked_scalar(name, each, "> 0") for each in values])


def _driven(what: Any, given: str, output: str) -> System:
    """Return a system with the sine as an input, and the Fourier integrals as states."""
    sine = f"{AMPLITUDE} * sin({OMEGA} * t)"
    none = {AMPLITUDE: 1.0, OMEGA: 1.0}
    if not hasattr(what, "bodies"):
        if given or output:
            raise ParameterError(
                "a friction is moved, and answers with its force",
                place="input" if given else "output",
                value=given or output,
                advice="leave it out, or give a system",
            )
        contact = alone(what)
        body = Body("body", velocity=f"{AMPLITUDE} * {OMEGA} * cos({OMEGA} * t)")
        force = _products(f"{contact.name}.F")
        return System("sine", bodies=(body,), contacts=(contact,), numbers=none, flow=force)
    for name, text in (("input", given), ("output", output)):
        checked_kind(name, text, str, "a text")
        if not text:
            raise ParameterError(
                "a system needs it", place=name, advice='for example input="u", output="x"'
            )
    refuse_functions(what)  # they would go on from one run to the next
    numbers = dict(what.numbers)
    if given not in numbers and given not in what.given:
        raise unknown("input", given, [*what.given, *numbers])
    mean = numbers.pop(given, 0.0)
    system: System = replace(
        what,
        signals={**what.signals, given: f"{mean!r} + {sine}"},
        numbers={**numbers, **none},
        flow={**what.flow, **_products(output)},
    )
    return system


def _products(output: str) -> dict[str, str]:
    return {
        SINE: f"({output}) * sin({OMEGA} * t)",
        COSINE: f"({output}) * cos({OMEGA} * t)",
    }


def _harmonic(system: System, w: float, initial: Any, rtol: float) -> complex:
    """Return the first harmonic of the last period, or NaN."""
    period = 2.0 * math.pi / w
    engine = "compiled" if fast() else "ifelse"
    for cycles in CYCLES:
        times = period * np.arange(cycles + 1)
        chosen = Settings(t_eval=times, rtol=rtol, engine=engine)
        trace = simulate(system, float(times[-1]), settings=chosen, initial=initial)
        sums = trace.value(SINE) + 1j * trace.value(COSINE)
        before, last = np.diff(sums)[-2:] * (w / math.pi)
        if abs(last - before) <= REPEATS * max(abs(last), abs(before)):
            return complex(last)
    return complex(math.nan, math.nan)
