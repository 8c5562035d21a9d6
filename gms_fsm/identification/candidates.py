"""The models that `choose` tries: each with the reason why, and a start from the records.

They were fixed, with these reasons, before any held-out row was looked at. What can be solved for
enters the force linearly; the rest is bounded by what a record can show (thresholds by its travel,
speeds by its own), because a parameter at an absurd value may fit the training rows and fail on
others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import FloatArray, Parameter
from gms_fsm.charts.zoo.bristles.maxwell_slip import MAXWELL_SLIP
from gms_fsm.identification.bank import initial_bank
from gms_fsm.identification.play_bank import SPRING_WITH_PLAY
from gms_fsm.identification.play_bank import play_bank as solved_bank
from gms_fsm.records.motion import usual_speed
from gms_fsm.records.record import Record
from gms_fsm.systems.models import GMS, ChartModel, Model
from gms_fsm.systems.system import System

__all__ = ["BEHIND_BACKLASH", "CANDIDATES", "STIFFER_ONE_WAY", "Build", "Candidate", "FitStart"]

FINEST = 1e-3  # smallest threshold and gap, as a share of the travel
# C as multiples of the median speed: slip settles within a threshold of travel, or at once.
SLOWEST_SLIP, FASTEST_SLIP = 1.0, 300.0
NARROWEST = 0.05  # v_s as a multiple of the median speed: narrower is seen in a few rows only
STICTION = 2.0  # most of F_s over F_c, and of the threshold at rest over that in motion
GAP = 0.1  # start of the half gap, as a share of the element's threshold
STIFFNESS = Parameter("k", "N/m", "> 0", meaning="mean stiffness of the two directions")
BIAS = Parameter("b", "N/m", meaning="stiffness added forward, taken away backward")

# It switches as a Maxwell-slip element does; its threshold is a parameter of its own.
STIFFER_ONE_WAY = Chart(
    name="Maxwell-slip element, stiffer one way",
    variables=MAXWELL_SLIP.variables,
    parameters=(STIFFNESS, BIAS, Parameter("z_c", "m", "> 0", meaning="threshold")),
    states=MAXWELL_SLIP.states,
    transitions=MAXWELL_SLIP.transitions,
    outputs={"F": "k * z + b * abs(z)"},
    reference="chosen by us",
)

# In slip the force follows the threshold without a flow of its own: z is set when slip ends.
BEHIND_BACKLASH = Chart(
    name="Slipping spring behind backlash",
    inputs=("v",),
    variables=("z",),
    parameters=(
        STIFFNESS,
        BIAS,
        Parameter("g", "m", "> 0", meaning="half of the gap"),
        Parameter("r", "m", "> 0", meaning="threshold beyond the gap, forward"),
        Parameter("ratio", "1", "> 0", per_element=False, meaning="backward threshold / forward"),
        Parameter("rho", "1", ">= 0", per_element=False, meaning="rise of thresholds at rest"),
        Parameter("v_s", "m/s", "> 0", per_element=False, meaning="Stribeck velocity"),
    ),
    let={"s_forward": "r * (1 + rho * exp(-(v / v_s)**2))", "s_backward": "ratio * s_forward"},
    states=(
        State("free", flow={"z": "v"}, outputs={"F": "0"}),
        State("pressed_forward", flow={"z": "v"}, outputs={"F": "(k + b) * (z - g)"}),
        State("pressed_backward", flow={"z": "v"}, outputs={"F": "(k - b) * (z + g)"}),
        State("slip_forward", exit={"z": "g + s_forward"}, outputs={"F": "(k + b) * s_forward"}),
        State(
            "slip_backward", exit={"z": "-g - s_backward"}, outputs={"F": "-(k - b) * s_backward"}
        ),
    ),
    transitions=(
        Transition("touch_forward", "free", "pressed_forward", guard="z >= g"),
        Transition("touch_backward", "free", "pressed_backward", guard="z <= -g"),
        Transition("part_forward", "pressed_forward", "free", guard="z < g"),
        Transition("part_backward", "pressed_backward", "free", guard="z > -g"),
        Transition(
            "break_away_forward",
            "pressed_forward",
            "slip_forward",
            guard="z >= g + s_forward and v > 0",
        ),
        Transition(
            "break_away_backward",
            "pressed_backward",
            "slip_backward",
            guard="z <= -g - s_backward and v < 0",
        ),
        Transition("turn_backward", "slip_forward", "pressed_forward", guard="v < 0"),
        Transition("turn_forward", "slip_backward", "pressed_backward", guard="v > 0"),
    ),
    outputs={},
    reference="chosen by us",
)


@dataclass(frozen=True, eq=False)
class FitStart:
    """What a candidate gives `fit`: a model with start values, and what to find.

    Parameters
    ----------
    model : Model or System
        With start values.
    free : tuple of str
        What to find.
    tied : tuple of str
        Free parameters of which all elements get one value.
    bounds : mapping of str to (float, float)
        Lowest and highest values.
    """

    model: Model | System
    free: tuple[str, ...]
    tied: tuple[str, ...] = ()
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)


Build = Callable[[Sequence[Record], float | None], FitStart]


@dataclass(frozen=True)
class Candidate:
    """A kind of model that `choose` tries.

    Parameters
    ----------
    name : str
        For tables.
    reason : str
        Why it is tried.
    build : callable
        Makes the `FitStart` from records, of which it may read the force at the selected rows only,
        and the time constant of the motion's smoothing spline.
    inputs : tuple of str
        What it reads of the records besides their motion.

    Examples
    --------
    >>> [each.name for each in CANDIDATES if each.name.startswith("GMS")][:3]
    ['GMS 1', 'GMS 2', 'GMS 4']
    """

    name: str
    reason: str
    build: Build
    inputs: tuple[str, ...] = ()


# --------------------------------------------------------------------------- starts
@dataclass(frozen=True)
class _Seen:
    """What the motion of the records allows to be seen."""

    travel: float  # m
    speed: float  # median in motion, m/s
    fastest: float  # but for a hundredth of the rows, m/s

    @classmethod
    def in_records(cls, records: Sequence[Record], smoothing: float | None) -> _Seen:
        motions = [record.motion(smoothing) for record in records]
        velocity = np.concatenate([motion.velocity for motion in motions])
        travel = max(float(np.ptp(motion.position)) for motion in motions)
        return cls(travel, usual_speed(velocity), float(np.quantile(np.abs(velocity), 0.99)))

    @property
    def slip(self) -> tuple[float, float]:
        """Bounds of C, m/s."""
        return SLOWEST_SLIP * self.speed, FASTEST_SLIP * self.speed

    @property
    def dip(self) -> tuple[float, float]:
        """Bounds of v_s, m/s."""
        return NARROWEST * self.speed, self.fastest


def gms(records: Sequence[Record], smoothing: float | None, *, n: int) -> FitStart:
    """Return a bank of GMS elements, signed law, with one C and a bounded Stribeck curve.

    F_c is held: only its products with the weights can be told.
    """
    seen = _Seen.in_records(records, smoothing)
    bank = initial_bank(records, n, smoothing=smoothing)
    given = bank.parameters
    slip = seen.slip
    model = GMS(
        replace(given, C=np.full(n, np.clip(np.median(given.C), *slip))),
        law="signed",
    )
    F_c = given.stribeck.F_c
    return FitStart(
        model,
        ("k", "weights", "C", "F_s", "v_s", "sigma_2"),
        tied=("C",),
        bounds={
            "weights": (FINEST * seen.travel / F_c, 0.5 * seen.travel / F_c),
            "C": slip,
            "F_s": (F_c, STICTION * F_c),
            "v_s": seen.dip,
        },
    )


def stiffer_one_way(records: Sequence[Record], smoothing: float | None, *, n: int) -> FitStart:
    """Return a Maxwell-slip bank whose springs may be stiffer in one direction."""
    seen = _Seen.in_records(records, smoothing)
    bank = initial_bank(records, n, smoothing=smoothing)
    values = {
        "k": bank.parameters.k,
        "b": np.zeros(n),
        "z_c": bank.weights * bank.stribeck.F_c,
    }
    return FitStart(
        ChartModel(STIFFER_ONE_WAY, values, n=n),
        ("k", "b", "z_c", "sigma_2"),
        bounds={"z_c": (FINEST * seen.travel, seen.travel)},
    )


def behind_backlash(records: Sequence[Record], smoothing: float | None, *, n: int) -> FitStart:
    """Return slipping springs behind gaps, at first a tenth of each threshold to either side."""
    seen = _Seen.in_records(records, smoothing)
    bank = initial_bank(records, n, smoothing=smoothing)
    r = bank.weights * bank.stribeck.F_c
    values: dict[str, float | FloatArray] = {
        "k": bank.parameters.k,
        "b": np.zeros(n),
        "g": GAP * r,
        "r": (1.0 - GAP) * r,
        "ratio": 1.0,
        "rho": 0.05,
        "v_s": 0.5 * seen.speed,
    }
    return FitStart(
        ChartModel(BEHIND_BACKLASH, values, n=n),
        ("k", "b", "g", "r", "ratio", "rho", "v_s", "sigma_2"),
        bounds={
            "g": (FINEST * seen.travel, 0.5 * seen.travel),
            "r": (FINEST * seen.travel, seen.travel),
            "ratio": (0.2, 5.0),
            "rho": (1e-3, STICTION - 1.0),
            "v_s": seen.dip,
        },
    )


def play_bank(records: Sequence[Record], smoothing: float | None) -> FitStart:
    """Return the terms that least squares on a grid of thresholds and gaps needs."""
    bank = solved_bank(records, smoothing)
    model = ChartModel(SPRING_WITH_PLAY, bank.values, n=len(bank.z_c), sigma_2=bank.sigma_2)
    return FitStart(model, bank.used)


# --------------------------------------------------------------------------- the list
CANDIDATES: tuple[Candidate, ...] = (
    Candidate("GMS 1", "one spring that slips: the least that has hysteresis", partial(gms, n=1)),
    Candidate("GMS 2", "pre-sliding in two slopes", partial(gms, n=2)),
    Candidate("GMS 4", "a rounded pre-sliding curve, inner loops", partial(gms, n=4)),
    Candidate(
        "GMS 1, stiffer one way",
        "guides and grips rarely are the same in both directions",
        partial(stiffer_one_way, n=1),
    ),
    Candidate(
        "GMS 2, stiffer one way",
        "the same with a second slope, or a spring that never slips",
        partial(stiffer_one_way, n=2),
    ),
    Candidate(
        "GMS 3, stiffer one way",
        "the same with a rounded pre-sliding curve",
        partial(stiffer_one_way, n=3),
    ),
    Candidate(
        "behind backlash 1",
        "play in the drive: no force in the gap, other thresholds forward than backward, "
        "thresholds that fall with speed",
        partial(behind_backlash, n=1),
    ),
    Candidate(
        "behind backlash 2",
        "the same with two flanks, or one flank and one spring without play",
        partial(behind_backlash, n=2),
    ),
    Candidate(
        "play bank",
        "many springs with gaps, each flank of its own, thresholds that fall with speed",
        play_bank,
    ),
)
