"""Candidates for joints: a bristle whose limit is a formula of load, torque or temperature.

All are one chart with another limit: ``dz = v - sigma_0 |v| z / limit``, ``F = sigma_0 z + drag``.
A candidate is tried if the records give the inputs that it reads: ``N`` a load, ``T`` a temperature
(K), ``M`` the torque of the motor and ``E`` that from outside.

References
----------
M. Duclusaud, G. Passault, V. Padois, O. Ly, "Extended Friction Models for the Physics Simulation of
Servo Actuators" (2024), arXiv:2410.08650: the forms M1 to M6, here with a bristle in place of a
stopping torque that is cut off.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.parameters import Parameter
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.charts.zoo.bristles.bouc_wen import BOUC_WEN
from gms_fsm.charts.zoo.bristles.dahl import DAHL
from gms_fsm.identification.bank import initial_bank
from gms_fsm.identification.candidates import Candidate, FitStart
from gms_fsm.records.motion import usual_speed
from gms_fsm.records.record import Record
from gms_fsm.systems.models import ChartModel, LuGre

__all__ = ["JOINTS", "joint_chart"]

T_0 = 293.15  # K, at which the viscous friction is b
DIP = "exp(-abs(v / v_s)**alpha)"
GEAR, GEAR_DIP = "abs(mu_e * E - mu_m * M)", "abs(nu_e * E - nu_m * M)"
# The torque that drives decides whose square counts, and only where the two oppose each other.
AGAINST = "0.25 * (1 - sgn(E) * sgn(M))"
OVER = "sgn(abs(M) - abs(E))"
SQUARE = f"{AGAINST} * (q_e * E**2 * (1 + {OVER}) + q_m * M**2 * (1 - {OVER}))"

PARAMETERS: Mapping[str, Parameter] = {
    each.name: each
    for each in (
        Parameter("sigma_0", "N/m", "> 0", meaning="bristle stiffness"),
        Parameter("b", "Ns/m", ">= 0", meaning="viscous friction"),
        Parameter("F_0", "N", "> 0", meaning="friction without load"),
        Parameter("F_d", "N", ">= 0", meaning="what is added at low speed"),
        Parameter("F_f", "N", "> 0", meaning="friction forward"),
        Parameter("F_b", "N", "> 0", meaning="friction backward"),
        Parameter("mu", "1", ">= 0", meaning="friction per load"),
        Parameter("nu", "1", ">= 0", meaning="friction per load added at low speed"),
        Parameter("mu_m", "1", ">= 0", meaning="friction per torque of the motor"),
        Parameter("mu_e", "1", ">= 0", meaning="friction per torque from outside"),
        Parameter("nu_m", "1", ">= 0", meaning="the same at low speed, of the motor"),
        Parameter("nu_e", "1", ">= 0", meaning="the same at low speed, from outside"),
        Parameter("q_m", "1/N", ">= 0", meaning="friction per squared torque of the motor"),
        Parameter("q_e", "1/N", ">= 0", meaning="friction per squared torque from outside"),
        Parameter("v_s", "m/s", "> 0", meaning="Stribeck velocity"),
        Parameter("alpha", "1", "> 0", meaning="Stribeck exponent"),
        Parameter("v_t", "m/s", "> 0", meaning="speed at which the force turns over"),
        Parameter("beta", "1/K", ">= 0", meaning="fall of the viscous friction per kelvin"),
    )
}


@dataclass(frozen=True)
class _Form:
    """A row of the table of candidates."""

    name: str
    reason: str
    limit: str  # of the bristle, N
    inputs: tuple[str, ...] = ()
    drag: str = "b * v"
    static: bool = False  # without a bristle

    @property
    def chart(self) -> Chart:
        return joint_chart(self.name, self.limit, self.inputs, self.drag, static=self.static)


def joint_chart(
    name: str, limit: str, inputs: Sequence[str], drag: str = "b * v", *, static: bool = False
) -> Chart:
    """Return the chart of a bristle with a limit; its parameters are those that the texts name.

    Parameters
    ----------
    name : str
        Its name.
    limit, drag : str
        The friction in steady sliding, N, and what is added to it, over v and the inputs.
    inputs : sequence of str
        What the texts read besides v.
    static : bool
        Whether there is no bristle: the force then turns over within the speed v_t.

    Returns
    -------
    Chart
        With the variable z, or none.

    Examples
    --------
    >>> joint_chart("gear", "F_0 + mu * abs(N)", ["N"]).parameter_names
    ('sigma_0', 'b', 'F_0', 'mu')
    """
    force = f"({limit}) * tanh(v / v_t) + {drag}" if static else f"sigma_0 * z + {drag}"
    words = {*re.findall(r"[A-Za-z]\w*", f"{limit} {force}")}
    found = tuple(each for key, each in PARAMETERS.items() if key in words)
    if static:
        state = State("sliding", outputs={"F": force})
        return Chart(
            name, inputs=("v", *inputs), parameters=found, states=(state,), reference="chosen by us"
        )
    return Chart(
        name,
        inputs=("v", *inputs),
        variables=("z",),
        parameters=found,
        let={"limit": limit},
        states=(State("bristle", flow={"z": "v - sigma_0 * abs(v) * z / limit"}),),
        outputs={"F": force},
        reference="chosen by us",
    )


FORMS = (
    _Form("static", "a curve of the speed, without memory", f"F_0 + F_d * {DIP}", static=True),
    _Form("Coulomb, viscous (M1)", "the least that servos have", "F_0"),
    _Form("Stribeck (M2)", "friction that falls with speed", f"F_0 + F_d * {DIP}"),
    _Form(
        "asymmetric",
        "seals and gears rarely are the same both ways",
        "0.5 * (F_f + F_b) + 0.5 * (F_f - F_b) * sgn(v)",
    ),
    _Form("load (M3)", "friction that grows with a load", "F_0 + mu * abs(N)", ("N",)),
    _Form(
        "load, Stribeck (M4)",
        "the same, and more at low speed",
        f"F_0 + mu * abs(N) + (F_d + nu * abs(N)) * {DIP}",
        ("N",),
    ),
    _Form(
        "load and temperature",
        "a lubricant whose viscosity falls as it warms",
        f"F_0 + mu * abs(N) + F_d * {DIP}",
        ("N", "T"),
        f"b * exp(-beta * (T - {T_0})) * v",
    ),
    _Form(
        "gear loss",
        "a loss in proportion to the torque through the gear",
        "mu_m * abs(M) + F_0",
        ("M",),
    ),
    _Form(
        "directional load (M5)",
        "motor and load press on the teeth differently",
        f"F_0 + {GEAR} + (F_d + {GEAR_DIP}) * {DIP}",
        ("M", "E"),
    ),
    _Form(
        "directional, quadratic (M6)",
        "the same, and squares where motor and load oppose each other",
        f"F_0 + {GEAR} + (F_d + {GEAR_DIP} + {SQUARE}) * {DIP}",
        ("M", "E"),
    ),
)


# --------------------------------------------------------------------------- starts
def _numbers(records: Sequence[Record], smoothing: float | None) -> tuple[float, float, float]:
    """Return stiffness and plateau force of one spring, and the median speed in motion."""
    bank = initial_bank(records, 1, smoothing=smoothing)
    middle = usual_speed(np.concatenate([each.motion(smoothing).velocity for each in records]))
    return float(bank.parameters.k[0]), bank.stribeck.F_c, middle


def _started(form: _Form, records: Sequence[Record], smoothing: float | None) -> FitStart:
    k, F_c, middle = _numbers(records, smoothing)
    loads = {
        name: float(np.mean(np.abs(np.concatenate([each.inputs[name] for each in records]))))
        for name in form.inputs
    }
    load = max((size for name, size in loads.items() if name != "T"), default=1.0) or 1.0
    every = {
        **dict.fromkeys(("F_0", "F_f", "F_b"), 0.5 * F_c if form.inputs else F_c),
        **dict.fromkeys(("mu", "mu_m", "mu_e"), 0.5 * F_c / load),
        **dict.fromkeys(("nu", "nu_m", "nu_e"), 0.1 * F_c / load),
        **dict.fromkeys(("q_m", "q_e"), 0.01 * F_c / load**2),
        "F_d": 0.1 * F_c,
        "sigma_0": k,
        "b": 0.1 * F_c / middle,
        "v_s": 0.5 * middle,
        "alpha": 1.5,
        "v_t": 0.05 * middle,
        "beta": 0.02,
    }
    chart = form.chart
    values = {name: every[name] for name in chart.parameter_names}
    bounds = {
        "v_s": (0.02 * middle, 20.0 * middle),
        "v_t": (1e-3 * middle, middle),
        "alpha": (0.5, 4.0),
        "beta": (1e-4, 0.5),
    }
    model = ChartModel(chart, values, inputs={name: name for name in form.inputs})
    own = {name: pair for name, pair in bounds.items() if name in values}
    return FitStart(model, tuple(values), bounds=own)


def dahl(records: Sequence[Record], smoothing: float | None) -> FitStart:
    """Return Dahl's model, from the spring that fits best."""
    k, F_c, _ = _numbers(records, smoothing)
    return FitStart(ChartModel(DAHL, {"sigma_0": k, "F_c": F_c}), ("sigma_0", "F_c"))


def lugre(records: Sequence[Record], smoothing: float | None) -> FitStart:
    """Return the LuGre model, from the spring that fits best."""
    k, F_c, middle = _numbers(records, smoothing)
    curve = Stribeck(F_c, 1.05 * F_c, 0.5 * middle)
    return FitStart(
        LuGre(sigma_0=k, sigma_1=0.0, sigma_2=0.0, stribeck=curve),
        ("sigma_0", "sigma_2", "F_c", "F_s", "v_s"),
        bounds={"v_s": (0.05 * middle, 20.0 * middle)},
    )


def bouc_wen(records: Sequence[Record], smoothing: float | None) -> FitStart:
    """Return the Bouc-Wen model, from the spring that fits best."""
    k, F_c, _ = _numbers(records, smoothing)
    values = {"k": k, "alpha": 0.01, "D": F_c / k, "A": 1.0, "beta": 0.5, "gamma": 0.5, "p": 2.0}
    return FitStart(
        ChartModel(BOUC_WEN, values),
        ("k", "alpha", "D", "gamma", "p"),
        bounds={"alpha": (1e-6, 0.5), "gamma": (-0.5, 0.499), "p": (1.0, 10.0)},
    )


JOINTS: tuple[Candidate, ...] = (
    *(Candidate(form.name, form.reason, partial(_started, form), form.inputs) for form in FORMS),
    Candidate("Dahl", "one bristle, Coulomb friction", dahl),
    Candidate("LuGre", "one bristle, a Stribeck curve", lugre),
    Candidate("Bouc-Wen", "hysteresis with a shape of its own", bouc_wen),
)


def joint_candidates(records: Sequence[Record]) -> tuple[Candidate, ...]:
    """Return the candidates whose inputs all of the records give."""
    given: set[Any] = set.intersection(*({*each.inputs} for each in records))
    return tuple(each for each in JOINTS if {*each.inputs} <= given)
