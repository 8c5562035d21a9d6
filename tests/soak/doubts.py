"""Runs with a doubt planted in them, clean ones, and models of the zoo with extreme numbers.

Each is made from a seed: ``python -m tests.soak.doubts --count 400``.
"""

from __future__ import annotations

import math
import random
from argparse import Namespace
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    Prescribed,
    PulledSlider,
    Slider,
    State,
    Stribeck,
    System,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.charts.registry import registered
from gms_fsm.errors import GMSError
from gms_fsm.traces.failures import SimulationError
from tests.soak.trying import Seen, examine

CREEP = State("low", flow={"z": "v"})
TOUCH = Chart(
    "touch",
    inputs=("v",),
    variables=("z",),
    parameters=("k", "b"),
    states=(CREEP, State("high", flow={"z": "v"})),
    transitions=(
        Transition("up", "low", "high", guard="z >= b"),
        Transition("down", "high", "low", guard="z <= -10*b"),
    ),
    outputs={"F": "k*z"},
)
BREAKS = Chart(  # whoever switches first lowers the force that all of them read
    "breaks",
    inputs=("v",),
    variables=("z",),
    parameters=("k", "F_b"),
    states=(
        State("stick", flow={"z": "v"}),
        State("slip", flow={"z": "v"}, outputs={"F": "0.3*k*z"}),
    ),
    transitions=(Transition("go", "stick", "slip", guard="F >= F_b"),),
    outputs={"F": "k*z"},
)
COULOMB = Chart(
    "coulomb",
    inputs=("v", "N"),
    parameters=("mu",),
    states=(State("on"),),
    outputs={"F": "mu*N*sgn(v)"},
)


def bank(r: random.Random) -> GMS:
    """Return a bank of one to four elements, in newtons and micrometres."""
    n = r.randint(1, 4)
    shares = [r.uniform(0.5, 1.5) for _ in range(n)]
    alpha = [u / sum(shares) for u in shares]
    F_c = r.uniform(0.5, 3.0)
    p = GMSParameters.from_shares(
        [*alpha[:-1], 1.0 - sum(alpha[:-1])],
        [10.0 ** r.uniform(3.0, 6.0) for _ in range(n)],
        C=r.uniform(10.0, 200.0),
        sigma_2=0.1,
        stribeck=Stribeck(F_c, F_c * r.uniform(1.05, 1.6), 10.0 ** r.uniform(-3.0, -1.0)),
        v_c=1e-6,
    )
    return GMS(p, law="signed")


def clean(r: random.Random) -> Trace:
    """Return a run without a doubt: two sines, or a pulled mass."""
    model = bank(r)
    if r.random() < 0.5:
        A, w = 10.0 ** r.uniform(-2.5, 0.0), r.uniform(0.5, 5.0)
        velocity = f"{A}*sin({w}*t) + {0.3 * A}*sin({2.3 * w}*t)"
        return simulate(model, Prescribed(velocity), r.uniform(6.0, 20.0) / w)
    mass, stiffness = r.uniform(0.2, 3.0), 10.0 ** r.uniform(2.0, 4.0)
    pulled = PulledSlider(mass, stiffness, 10.0 ** r.uniform(-2.5, -0.5))
    return simulate(model, pulled, r.uniform(1.0, 3.0))


def grazing(r: random.Random) -> Trace:
    """Return a run whose deflection turns where the guard becomes true, within the tolerances."""
    b, w = 10.0 ** r.uniform(-6.0, 0.0), 10.0 ** r.uniform(-1.0, 2.0)
    X = b * (1.0 + r.choice([-1, 1]) * 10.0 ** r.uniform(-10.0, -7.5))
    motion = Prescribed(f"{X * w!r}*cos({w!r}*t)")
    return simulate(ChartModel(TOUCH, {"k": 1e3, "b": b}), motion, r.uniform(4.0, 12.0) / w)


def tie(r: random.Random) -> Trace:
    """Return a run of equal elements, the first of which keeps the others from switching."""
    n = r.randint(2, 5)
    model = ChartModel(BREAKS, {"k": [1e3] * n, "F_b": r.uniform(0.5, 2.0)}, n=n)
    return simulate(model, Prescribed(r.uniform(1e-3, 1e-2)), 3.0)


def repelling(r: random.Random) -> Trace:
    """Return a run that is held at v = 0 by a friction which changes its sign."""
    t, N, mu = r.uniform(0.3, 1.5), r.uniform(1.0, 5.0), r.uniform(0.2, 1.0)
    load = [(0.0, N), (t, N), (t, -N), (t + 5.0, -N)]
    force = f"{0.5 * r.random() * mu * N}*sin(3*t)"
    system = System(
        "held",
        bodies=(Body("block", inertia=r.uniform(0.1, 5.0), force=force),),
        contacts=(Contact("pad", COULOMB, {"mu": mu}, inputs={"N": "N"}),),
        signals={"N": load},
    )
    return simulate(system, t + 0.5)


def pulse(r: random.Random) -> Trace:
    """Return a run with a pulse that its steps pass over."""
    start, width, height = r.uniform(1.0, 9.0), r.uniform(0.005, 0.05), r.uniform(20.0, 100.0)

    def force(t: float) -> float:
        return height if start < t < start + width else 0.0

    return simulate(bank(r), Slider(1.0, force), 10.0)


def growing(r: random.Random) -> Trace:
    """Return a run in which the published law slips backward for a while."""
    p = GMSParameters.paper("stick-slip")
    period = r.uniform(35.0, 70.0)
    motion = Prescribed(f"{r.uniform(0.1, 0.2)}*sin({2.0 * math.pi / period}*t)")
    return simulate(GMS(p, law="published"), motion, 2.0 * period)


PLANTED: Mapping[str, Callable[[random.Random], Trace]] = {
    "grazing": grazing,
    "tie": tie,
    "not unique": repelling,
    "sampling": pulse,
    "growth": growing,
}


DECADES = 3.0  # up and down
MOST_STEPS = 20_000


def extreme(r: random.Random) -> tuple[str, Trace | None]:
    """Run a model of the zoo with numbers over six decades; what refuses them returns no trace."""
    each = r.choice([each for each in registered().values() if not each.wrong])
    shown = each.demonstration
    scale = {name: 10.0 ** r.uniform(-DECADES, DECADES) for name in shown.values}
    values = {name: np.multiply(scale[name], value) for name, value in shown.values.items()}
    values = {name: float(u) if u.ndim == 0 else u for name, u in values.items()}
    law = r.choice(each.laws or ("",))
    try:
        model = ChartModel(
            each.chart(law),
            values,
            n=shown.n,
            stribeck=shown.stribeck,
            sigma_2=shown.sigma_2,
            weights=shown.weights,
            inputs=shown.inputs,
        )
        A, w = 10.0 ** r.uniform(-6.0, 1.0), 10.0 ** r.uniform(-1.0, 2.0)
        rig = r.choice([Prescribed(f"{A}*sin({w}*t)"), Slider(1.0, f"{A}*sin({w}*t)")])
        return each.name, simulate(model, rig, 12.0 / w, max_steps=MOST_STEPS)
    except SimulationError as error:
        return f"{each.name}: {type(error).__name__}", None
    except GMSError:
        return f"{each.name} refused", None


def fault_of(trace: Trace) -> str:
    """Return what is wrong with a run: a row that is not finite, without a finding."""
    columns = [trace.v, trace.x, trace.z, *(trace.seen[trace.places.of(name)] for name in ("F",))]
    given = [u for u in columns if not np.isnan(u).all()]  # a chart may have no variable
    if all(np.isfinite(u).all() for u in given) or trace.trust().of("not finite"):
        return ""
    return f"{trace!r} has values that are not finite, and no finding says so"


def look(given: Namespace, index: int) -> Iterator[Seen]:
    """Look at one run of each kind."""
    again = f"--index {index}"
    for kind, make in PLANTED.items():
        found = make(random.Random(f"{given.seed}:{index}")).trust()
        fault = "" if found.of(kind) and found.warnings else f"{kind} is not found: {found}"
        yield Seen(again, {f"planted: {kind}": 1}, fault, shown=(found,))
    found = clean(random.Random(f"{given.seed}:{index}")).trust()
    yield Seen(again, {"clean": 1}, str(found) if found.warnings else "", shown=(found,))
    name, trace = extreme(random.Random(f"{given.seed}:{index}"))
    fault = "" if trace is None else fault_of(trace)
    ended = "extreme: to the end" if trace is not None else "extreme: error"
    yield Seen(again, {ended: 1}, fault, shown=(name,))


if __name__ == "__main__":
    examine("doubts", "Are planted doubts found, and no others?", look, count=200)
