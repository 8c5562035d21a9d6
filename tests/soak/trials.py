"""Random runs at default tolerances against a reference: is the sequence of switches the same?

``python -m tests.soak.trials --family pulled --count 500 --seed 1`` prints each run that is wrong
or fails; ``--witness yes`` checks the reference instead.

Families, all of one to six elements, thresholds as shares/k or free:

``pulled``      the pulled mass of the tests, every parameter spread over decades
``forced``      a mass under a force of sines or ramps
``sines``       a prescribed velocity of sines, occasionally of ramps
``literature``  k 1e5..1e7 N/m, thresholds of micrometres, v_c 1e-7..1e-5 m/s, 0.5..100 kg

Part of each family has the published law and is counted separately. A trial is a pure function of
(family, seed, index). The formulas in t come from a small pool, because each new text has to be
compiled; the model is drawn around them, which amounts to the same.

The judge
---------
The reference is our own engine at rtol 1e-12 and an atol far below thresholds and v_c
(`tests.soak.witness` checks it). A default run is *right* if its sequence of (element, edge) is the
reference's. It is *wrong* only if the run is well conditioned: the reference keeps its sequence
at rtol 1e-11, and also when every parameter is changed by a relative 1e-5, up or down at random,
four times over; and no gap between switches of two elements changes by half of itself meanwhile.
Why 1e-5: the default rtol is 1e-6 per step, and a run has ten to a hundred steps between two
switches, so the solver may move a switch as far as such a change does. A run that differs and keeps
its sequence only under changes of 1e-6 is *close*: no verdict, but listed. So is one that differs
where the reference has a switch that no run of that rtol can decide: two elements that switch
within 1e-6 of the time of each other, or an arrest with |z| nearer to s than 1e-6 of it, as in
steady slip, where z tends to s and the parameters do not matter. All else is *ill*: counted, not
judged.

Switching times and the state at the end are not judged.
"""

from __future__ import annotations

import math
import zlib
from argparse import Namespace
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gms_fsm import GMS, GMSParameters, Prescribed, PulledSlider, Slider, Stribeck, Trace, simulate
from gms_fsm.errors import GMSError
from gms_fsm.traces.failures import SimulationError
from tests.soak.trying import Seen, examine
from tests.soak.witness import witness

FAMILIES = ("pulled", "forced", "sines", "literature")
# Text, amplitude, angular frequency (rad/s).
FORCES = (
    ("2.9*sin(4.7*t)", 2.9, 4.7),
    ("12*sin(1.7*t) + 5*sin(4.3*t + 0.5)", 15.0, 1.7),
    ("0.9*sin(9*t)", 0.9, 9.0),
    ("0.02*sin(83*t) + 0.01*cos(31*t)", 0.025, 83.0),
    ("300*sin(0.6*t)", 300.0, 0.6),
)
SPEEDS = (
    ("0.2*sin(2*pi*t/20)", 0.2, 0.314),
    ("1e-3*sin(7*t) + 4e-4*sin(17.9*t + 0.6)", 1.2e-3, 7.0),
    ("2e-5*sin(1.3*t) + 8e-6", 2e-5, 1.3),
    ("0.05*cos(40*t)", 0.05, 40.0),
    ("3*sin(2*t)*sin(0.37*t)", 3.0, 2.0),
)
PUBLISHED = 0.15  # fraction
WORK = 2e4  # t_end in units of the fastest time; a reference then takes at most a second
CALLS = 40  # of progress until a run is abandoned; the compiled engine calls every 20,000 steps
NUDGES, NUDGE, SMALL_NUDGE = 4, 1e-5, 1e-6
RTOL = 1e-6  # of the runs under test


@dataclass(frozen=True, eq=False)
class Trial:
    """A run, and how to repeat it."""

    family: str
    seed: int
    index: int
    model: GMS
    rig: Prescribed | Slider | PulledSlider
    t_end: float

    @property
    def again(self) -> str:
        """The arguments that repeat it."""
        return f"--family {self.family} --seed {self.seed} --index {self.index}"

    @property
    def atol(self) -> float:
        """Tolerance of the reference: far below everything compared, in m and m/s."""
        p = self.model.parameters
        return float(1e-10 * min(np.min(p.weights) * p.stribeck.F_c, p.v_c))

    def __str__(self) -> str:
        p, rig = self.model.parameters, self.rig
        if isinstance(rig, PulledSlider):
            rigged = f"PulledSlider({rig.mass!r}, {rig.stiffness!r}, {rig.speed!r})"
        else:
            given = rig.velocity if isinstance(rig, Prescribed) else rig.force
            mass = "" if isinstance(rig, Prescribed) else f"{rig.mass!r}, "
            rigged = f"{type(rig).__name__}({mass}{given!r})"
        return (
            f"GMS(GMSParameters({p.k.tolist()}, {p.sigma.tolist()}, {p.C.tolist()}, "
            f"sigma_2={p.sigma_2!r}, stribeck={p.stribeck!r}, v_c={p.v_c!r}, "
            f"weights={p.weights.tolist()}), law={self.model.law!r}), {rigged}, {self.t_end!r}"
        )


# --------------------------------------------------------------------------- drawing
class Draw:
    """A source of numbers."""

    def __init__(self, *key: int) -> None:
        self.source = np.random.default_rng(key)

    def decades(self, low: float, high: float, size: int | None = None) -> Any:
        """Return 10**u, u between low and high; NumPy's powers of arrays differ by processor."""
        u = self.source.uniform(low, high, size)
        return 10.0**u if size is None else np.array([10.0**each for each in u.tolist()])

    def chance(self, share: float) -> bool:
        """Return True with this probability."""
        return bool(self.source.random() < share)

    def one_of(self, choices: Sequence[Any]) -> Any:
        """Return one of them."""
        return choices[int(self.source.integers(len(choices)))]


def trial(family: str, seed: int, index: int) -> Trial:
    """Return one run of a family."""
    draw = Draw(zlib.crc32(family.encode()), seed, index)
    law = "published" if draw.chance(PUBLISHED) else "signed"
    made = {"pulled": pulled, "forced": forced, "sines": sines, "literature": literature}[family]
    return Trial(family, seed, index, *made(draw, law))


def _model(
    law: Any, k: Any, sigma: Any, C: Any, sigma_2: float, curve: Stribeck, v_c: float, weights: Any
) -> GMS:
    parameters = GMSParameters(
        k, sigma, C, sigma_2=sigma_2, stribeck=curve, v_c=v_c, weights=weights
    )
    return GMS(parameters, law=law)


def _elements(draw: Draw, k_total: float) -> tuple[Any, Any]:
    """Return stiffness and weights of one to six elements."""
    n = int(draw.source.integers(1, 7))
    k = draw.decades(-0.7, 0.7, n)
    k *= k_total / k.sum()
    shares = np.full(n, 1 / n) if draw.chance(0.2) else draw.source.dirichlet(np.full(n, 3.0))
    weights = shares / k
    return k, weights if draw.chance(0.7) else weights * draw.decades(-0.5, 0.5, n)


def _curve(draw: Draw, F_c: float, v_s: float, most: float = 0.3) -> Stribeck:
    return Stribeck(F_c, F_c * (1 + draw.decades(-1.3, most)), v_s)


def _fastest(model: GMS, mass: float, stiffness: float = 0.0) -> float:
    """Return the fastest rate of a model on a mass, 1/s."""
    p = model.parameters
    rates = [
        math.sqrt((p.k.sum() + stiffness) / mass),
        (p.sigma.sum() + p.sigma_2) / mass,
        np.max(p.C / (p.weights * p.stribeck.F_c)),
    ]
    return float(max(rates))


def _ramps(draw: Draw, amplitude: float, omega: float) -> tuple[list[tuple[float, float]], float]:
    """Return ramps back and forth, and their end."""
    count = int(draw.source.integers(3, 10))
    times = np.cumsum(draw.source.uniform(0.3, 1.0, count)) * math.pi / omega
    sides = (-1.0) ** np.arange(count) * draw.one_of([1, -1])
    values = amplitude * sides * draw.source.uniform(0.2, 1.0, count)
    corners = [(0.0, 0.0), *zip(times.tolist(), values.tolist(), strict=True)]
    return corners, float(times[-1])


def _driven(draw: Draw, pool: Sequence[Any], law: str) -> tuple[Any, float, float, float]:
    """Return a signal, its amplitude and angular frequency, and an end."""
    if draw.chance(0.3):
        amplitude, omega = draw.decades(-2, 2), draw.decades(-1, 2)
        corners, end = _ramps(draw, amplitude, omega)
        return corners, amplitude, omega, end
    text, amplitude, omega = draw.one_of(pool if law == "signed" else pool[:2])
    cycles = draw.source.uniform(1.5, 5.0)  # about four switches of an element in each
    return text, amplitude, omega, cycles * 2 * math.pi / omega


def pulled(draw: Draw, law: Any) -> tuple[GMS, PulledSlider, float]:
    """Draw around the pulled mass."""
    F_c, mass, k_total = draw.decades(-1, 1), draw.decades(-1, 1), draw.decades(0.5, 3)
    stiffness = k_total * draw.decades(-2.5, -0.5)
    omega = math.sqrt(stiffness / mass)
    speed = F_c / (mass * omega) * draw.decades(-2, 0)
    k, weights = _elements(draw, k_total)
    curve = _curve(draw, F_c, speed * draw.decades(-1.3, 0.7))
    sigma = 2 * np.sqrt(k * mass) * draw.decades(-2, -0.3, k.size)
    C = weights * F_c * omega * draw.decades(-0.7, 1.5, k.size)
    sigma_2, v_c = mass * omega * draw.decades(-2, 0), speed * draw.decades(-6, -3)
    model = _model(law, k, sigma, C, sigma_2, curve, v_c, weights)
    return model, *_pulled(PulledSlider(mass, stiffness, speed), model)


def _pulled(rig: PulledSlider, model: GMS) -> tuple[PulledSlider, float]:
    """Return a rig fast enough to slip within the allowed work, and an end."""
    curve = model.stribeck
    longest = WORK / _fastest(model, rig.mass, rig.stiffness)
    rig = replace(rig, speed=max(rig.speed, 3 * curve.F_s / (rig.stiffness * longest)))
    load = rig.stiffness * rig.speed  # N/s
    period = 2 * (curve.F_s - curve.F_c) / load + 2 * math.pi * math.sqrt(rig.mass / rig.stiffness)
    cycles = min(10.0, max(3.0, 20.0 / model.n))
    return rig, min(longest, 1.2 * curve.F_s / load + cycles * period)


def forced(draw: Draw, law: Any) -> tuple[GMS, Slider, float]:
    """Draw a mass under a force."""
    mass = draw.decades(-1, 1)
    force, amplitude, omega, end = _driven(draw, FORCES, law)
    speed = amplitude / (mass * omega)
    k, weights = _elements(draw, mass * (omega * draw.decades(0.3, 1.8)) ** 2)
    F_c = amplitude * draw.source.uniform(0.2, 0.9)
    curve = _curve(draw, F_c, speed * draw.decades(-2.5, -0.3), most=0.0)
    sigma = 2 * np.sqrt(k * mass) * draw.decades(-2, -0.3, k.size)
    C = weights * F_c * omega * draw.decades(-0.5, 2, k.size)
    sigma_2, v_c = mass * omega * draw.decades(-2, 0), speed * draw.decades(-7, -3.5)
    model = _model(law, k, sigma, C, sigma_2, curve, v_c, weights)
    return model, Slider(mass, force), min(end, WORK / _fastest(model, mass))


def sines(draw: Draw, law: Any) -> tuple[GMS, Prescribed, float]:
    """Draw a bank under a prescribed velocity."""
    velocity, speed, omega, end = _driven(draw, SPEEDS, law)
    F_c = draw.decades(-1, 1)
    k, weights = _elements(draw, F_c * omega / speed * draw.decades(0.0, 2.0))
    curve = _curve(draw, F_c, speed * draw.decades(-2.5, -0.3))
    sigma = draw.decades(-2, 0, k.size) * k / omega
    C = weights * F_c * omega * draw.decades(-0.5, 2, k.size)
    sigma_2, v_c = F_c / speed * draw.decades(-2, 0), speed * draw.decades(-7, -3.5)
    model = _model(law, k, sigma, C, sigma_2, curve, v_c, weights)
    return model, Prescribed(velocity), end


def literature(draw: Draw, law: Any) -> tuple[GMS, PulledSlider | Slider, float]:
    """Draw numbers as published for machine tools: stiff, light thresholds."""
    mass = draw.decades(-0.3, 2)
    k, weights = _elements(draw, draw.decades(5, 7))
    sigma = 2 * np.sqrt(k * mass) * draw.decades(-3, 0) * draw.decades(-0.5, 0, k.size)
    is_pulled = draw.chance(0.5)
    if is_pulled:
        F_c = draw.decades(0, 1)
    else:
        force, amplitude, _, end = _driven(draw, FORCES[:3], law)
        F_c = amplitude * draw.source.uniform(0.4, 1.0)
    curve = _curve(draw, F_c, draw.decades(-4, -2), most=-0.3)
    # Slow attraction as published (m/s), or a rate of the threshold.
    C = (
        draw.decades(-5.3, -2.5, k.size)
        if draw.chance(0.5)
        else weights * F_c * draw.decades(0.5, 3, k.size)
    )
    sigma_2, v_c = draw.decades(0, 2.5), draw.decades(-7, -5)
    model = _model(law, k, sigma, C, sigma_2, curve, v_c, weights)
    if is_pulled:
        rig = PulledSlider(mass, draw.decades(2.5, 4.5), draw.decades(-3.5, -2))
        return model, *_pulled(rig, model)
    return model, Slider(mass, force), min(end, WORK / _fastest(model, mass))


# --------------------------------------------------------------------------- running
class TooLong(Exception):
    """A run takes more steps than a trial may."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """The result of a run: its switches, its end (x, v, z), or the class of its error."""

    sequence: tuple[tuple[int, str], ...]
    t: Any
    end: Any
    failed: str
    nearest: float = math.inf  # smallest ||z| / s - 1| at an arrest


def run(trial: Trial, engine: str = "compiled", **options: float) -> Outcome:
    """Run a trial with the defaults, or with options of `simulate`."""
    calls, failed = 0, ""

    def patience(_: object) -> None:
        nonlocal calls
        calls += 1
        if engine == "compiled" and calls > CALLS:
            raise TooLong

    trace: Trace | None = None
    try:
        trace = simulate(
            trial.model,
            trial.rig,
            trial.t_end,
            engine=engine,
            output="end",
            progress=patience,
            **options,
        )
    except SimulationError as error:
        trace, failed = error.trace, type(error).__name__
    except (GMSError, TooLong) as error:
        failed = type(error).__name__
    if trace is None:
        return Outcome((), np.empty(0), np.empty(0), failed)
    log = trace.transitions
    sequence = tuple(zip(log.element.tolist(), log.edge.tolist(), strict=True))
    end = np.array([trace.x[-1], trace.v[-1], *trace.z[-1]])
    arrests = log[log.edge == "arrest"]
    nearest = float(np.min(np.abs(np.abs(arrests.z) / arrests.s - 1.0), initial=math.inf))
    return Outcome(sequence, np.array(log.t), end, failed, nearest)


def reference(trial: Trial, engine: str = "compiled", rtol: float = 1e-12) -> Outcome:
    """Run a trial as accurately as our own engine can."""
    return run(trial, engine, rtol=rtol, atol=trial.atol)


def nudged(trial: Trial, number: int, size: float) -> Trial:
    """Return a trial with every parameter changed by a relative `size`, up or down."""
    draw = Draw(zlib.crc32(trial.family.encode()), trial.seed, trial.index, number + 1)

    def near(value: Any) -> Any:
        signs = draw.source.choice([1.0, -1.0], np.shape(value))
        return value * (1 + size * signs)

    p, rig = trial.model.parameters, trial.rig
    F_c, rise = near(p.stribeck.F_c), near(p.stribeck.F_s - p.stribeck.F_c)
    curve = Stribeck(F_c, F_c + rise, near(p.stribeck.v_s))
    numbers = (near(p.k), near(p.sigma), near(p.C), near(p.sigma_2))
    model = _model(trial.model.law, *numbers, curve, near(p.v_c), near(p.weights))
    if isinstance(rig, PulledSlider):
        rig = PulledSlider(near(rig.mass), near(rig.stiffness), near(rig.speed))
    elif isinstance(rig, Slider):
        rig = Slider(near(rig.mass), rig.force)
    return replace(trial, model=model, rig=rig)


# --------------------------------------------------------------------------- judging
def is_steady(trial: Trial, exact: Outcome, size: float, engine: str = "compiled") -> bool:
    """Return whether the reference keeps its sequence and gaps under changes of that size."""
    others = [reference(trial, engine, rtol=1e-11)]
    others += [reference(nudged(trial, i, size), engine) for i in range(NUDGES)]
    elements = np.array([element for element, _ in exact.sequence])
    between = elements[1:] != elements[:-1]
    gaps = np.diff(exact.t)[between]
    for other in others:
        if other.failed or other.sequence != exact.sequence:
            return False
        if np.any(np.abs(np.diff(other.t)[between] - gaps) > 0.5 * gaps):
            return False
    return True


def is_undecided(exact: Outcome) -> bool:
    """Return whether a switch of the reference depends on less than the default rtol."""
    elements = np.array([element for element, _ in exact.sequence])
    gaps = np.diff(exact.t)[elements[1:] != elements[:-1]]
    times = exact.t[1:][elements[1:] != elements[:-1]]
    return exact.nearest < RTOL or bool(np.any((gaps > 0.0) & (gaps < RTOL * times)))


@dataclass(frozen=True, eq=False)
class Judged:
    """A verdict, and the runs that it is about."""

    trial: Trial
    verdict: str  # right, wrong, close, ill, failed, reference failed
    default: Outcome
    exact: Outcome


def judge(trial: Trial, engine: str = "compiled", **options: float) -> Judged:
    """Compare a run with the defaults (or with options, to test the judge) with the reference."""
    default, exact = run(trial, engine, **options), reference(trial, engine)
    same = default.sequence == exact.sequence
    if exact.failed or default.failed:
        verdict = "reference failed" if exact.failed else "failed"
    elif is_steady(trial, exact, NUDGE, engine):
        verdict = "right" if same else "close" if is_undecided(exact) else "wrong"
    else:
        close = not same and is_steady(trial, exact, SMALL_NUDGE, engine)
        verdict = "close" if close else "ill"
    return Judged(trial, verdict, default, exact)


def is_finding(judged: Judged) -> bool:
    """Return whether a verdict is a fault: a wrong sequence, or a run that cannot continue."""
    failed = judged.default.failed or judged.exact.failed
    return judged.verdict == "wrong" or (bool(failed) and judged.trial.model.law == "signed")


def said(judged: Judged) -> str:
    """Return a line about a run that is not right, and the arguments that repeat it."""
    default, exact = judged.default, judged.exact
    what = f"{judged.verdict}: {len(default.sequence)} switches, the reference has "
    what += f"{len(exact.sequence)}"
    if default.failed or exact.failed:
        what += f"; default: {default.failed or 'ends'}, reference: {exact.failed or 'ends'}"
    else:
        pairs = list(zip(default.sequence, exact.sequence, strict=False))
        first = next((i for i, (a, b) in enumerate(pairs) if a != b), len(pairs))
        for name, outcome in (("ours", default), ("reference", exact)):
            if first < len(outcome.sequence):
                element, edge = outcome.sequence[first]
                what += f"; {name}: element {element} {edge} at {outcome.t[first]:.9g} s"
    return f"{what} ({judged.trial.model.law} law)\n  {judged.trial.again}"


def witnessed(trial: Trial, engine: str = "compiled") -> str:
    """Return how the reference differs from the witness; empty if it does not."""
    exact = reference(trial, engine)
    seen = witness(trial.model, trial.rig, trial.t_end)
    if exact.failed:
        return f"the reference fails ({exact.failed}), the witness slides {seen.sliding[:3]}"
    if exact.sequence != tuple((element, edge) for _, element, edge in seen.transitions):
        return f"{len(exact.sequence)} switches, the witness has {len(seen.transitions)}"
    late = np.max(np.abs(exact.t - [t for t, _, _ in seen.transitions]), initial=0.0)
    return "" if late < 1e-8 * trial.t_end else f"a switch is {late:.2g} s late"


def look(given: Namespace, index: int) -> Iterator[Seen]:
    """Judge one run of each requested family, or its reference."""
    for family in (given.family,) if given.family else FAMILIES:
        one = trial(family, given.seed, index)
        again = f"--family {family} --index {index}"
        if given.witness:
            yield Seen(again, {family: 1}, witnessed(one), shown=[one])
            continue
        judged = judge(one)
        shown = [one, said(judged)]
        for outcome in (judged.default, judged.exact):
            shown += [outcome.failed, outcome.end, *zip(outcome.t, outcome.sequence, strict=True)]
        counts = Counter([f"{family}, {one.model.law}, {judged.verdict}"])
        counts["switches"] = len(judged.exact.sequence)
        finding = said(judged) if is_finding(judged) else ""
        open_ = judged.verdict not in ("right", "ill")
        yield Seen(again, counts, finding, said(judged) if open_ else "", shown)


if __name__ == "__main__":
    examine("trials", "Random runs against a reference", look, count=100, family="", witness="")
