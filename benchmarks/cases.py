"""What the benchmarks run with gms-fsm. The numbers of the first two cases are in rivals.py."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from rivals import EDGES, OPEN_LOOP, PULLED_MASS, Array, Case

from gms_fsm import (
    GMS,
    Body,
    Contact,
    GMSParameters,
    Prescribed,
    PulledSlider,
    Sampled,
    Stribeck,
    System,
    Trace,
)
from gms_fsm.charts import CHARTS

__all__ = ["PROBLEMS", "Problem", "bank", "model_and_rig", "pulled", "servo", "stiction"]

# Timed is what a run takes after many like it, not the first one; older commits have no other.
with contextlib.suppress(ImportError):
    from integrators.machine_code import calls

    calls.AT_ONCE = 0.0
    from gms_fsm.run.repeated import again

    again.WORTH_IT = 1

RELEASES = ("release_forward", "release_backward", "arrest_forward", "arrest_backward")


def model_and_rig(case: Case, law: Any = "signed") -> tuple[GMS, Any]:
    """Return a case of rivals.py as a model and a rig."""
    parameters = GMSParameters(
        case.k,
        case.sigma,
        case.C,
        sigma_2=case.sigma_2,
        v_c=case.v_c,
        weights=case.w,
        stribeck=Stribeck(case.F_c, case.F_s, case.v_s),
    )
    rig = Prescribed(case.signal) if case.signal else PulledSlider(1.0, 2.0, 0.1)
    return GMS(parameters, law=law), rig


def pulled(law: Any = "signed") -> tuple[GMS, Any]:
    """Return the pulled mass."""
    return model_and_rig(PULLED_MASS, law)


def servo() -> tuple[System]:
    """Return the servo of the README and of gms_fsm/scenarios/servo.toml."""
    friction = GMSParameters.from_shares(
        [0.4, 0.3, 0.2, 0.1],
        [4e4, 3e4, 2e4, 1e4],
        C=20.0,
        stribeck=Stribeck(F_c=1.0, F_s=1.5, v_s=1e-3),
        v_c=1e-6,
    )
    shaft = "k_s * (x_m - x_l) + d_s * (v_m - v_l)"
    pid = {
        "e": "ref - x_m",
        "u": "k_p * e + I + k_d * (e - e_before) / period",
        "I": "I + k_i * period * e",
        "e_before": "e",
    }
    system = System(
        "servo",
        bodies=(
            Body("motor", inertia="m_m", force=f"u - ({shaft})", x="x_m", v="v_m"),
            Body("load", inertia="m_l", force=shaft, x="x_l", v="v_l"),
        ),
        contacts=(Contact("bearing", GMS(friction, law="signed"), v="v_l"),),
        numbers={"m_m": 0.5, "m_l": 1.0, "k_s": 2e4, "d_s": 5.0, "ref": 2e-3}
        | {"k_p": 400.0, "k_d": 40.0, "k_i": 500.0},
        sampled=(Sampled("pid", period=1e-3, updates=pid),),
    )
    return (system,)


def stiction() -> tuple[System]:
    """Return a pulled mass with Coulomb friction and stiction."""
    system = System(
        "pulled mass with stiction",
        bodies=(Body("mass", inertia="m", force="K * (V * t - x)"),),
        contacts=(Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.1}),),
        numbers={"m": 1.0, "K": 2.0, "V": 0.1},
    )
    return (system,)


def bank(n: int, spread: bool) -> GMS:
    """Return the pulled mass's bank with n equal shares; thresholds equal or spread 1 : 7."""
    w = np.linspace(0.0025, 0.0175, n) if spread and n > 1 else np.full(n, 0.01)
    share = np.full(n, 1 / n)
    parameters = GMSParameters(
        share / w,
        share,
        np.full(n, 0.02),
        sigma_2=0.4,
        v_c=1e-6,
        weights=w,
        stribeck=Stribeck(1.0, 1.5, 0.05),
    )
    return GMS(parameters, law="signed")


@dataclass(frozen=True, eq=False)
class Problem:
    """A run that has a C loop of its own.

    Parameters
    ----------
    title : str
        For headings; the part before the comma also for docs/performance.md.
    t_end : float
        s.
    transitions : int
        Their correct number.
    build : callable
        Returns a model and a rig, or a system.
    source, define : str
        The file of the C loop, and what is defined.
    columns : int
        Numbers in a row of the C loop.
    kept : slice
        The columns that are compared, m.
    edges : tuple of str
        The edges, by their numbers in the C loop.
    compared : callable
        Returns the same of a trace, shape (rows, columns), and the friction.
    case : Case, optional
        For other tools.
    """

    title: str
    t_end: float
    transitions: int
    build: Callable[[], tuple[Any, ...]]
    source: str
    define: str
    columns: int
    kept: slice
    edges: tuple[str, ...]
    compared: Callable[[Trace], tuple[Array, Array]]
    case: Case | None = None


def _elements(trace: Trace) -> tuple[Array, Array]:
    return trace.z, trace.F


def _bearing(trace: Trace) -> tuple[Array, Array]:
    return _elements(trace.contact("bearing"))


def _position(trace: Trace) -> tuple[Array, Array]:
    return trace.body("mass").x[:, None], trace.contact("pad").F


def _with_elements(case: Case, define: str) -> Problem:
    return Problem(case.title, case.t_end, case.transitions, lambda: model_and_rig(case),
                   "c_loop.c", define, 8, slice(3, 7), EDGES, _elements, case)  # fmt: skip


PROBLEMS = {
    "pulled": _with_elements(PULLED_MASS, ""),
    "open": _with_elements(OPEN_LOOP, "OPEN_LOOP"),
    "servo": Problem("Servo, sampled PID, 0.2 s", 0.2, 24, servo, "c_loop.c", "SERVO", 11,
                     slice(3, 7), EDGES, _bearing),
    "stiction": Problem("Mass with stiction, 600 s", 600.0, 164, stiction, "c_stiction.c", "", 4,
                        slice(1, 2), RELEASES, _position),
}  # fmt: skip
