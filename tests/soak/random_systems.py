"""Random systems give equal bits in all engines: machines, if-else text, machine code.

``python -m tests.soak.random_systems --count 500 --seed 1`` prints each system whose runs differ.

A trial is a pure function of (seed, index, shapes). Its *shape* - bodies, contacts and their
charts, controllers, signals, method - is one of `shapes` many; its numbers, initial values and
tolerances are its own. A run that cannot continue must do so in all engines with the same words,
and with the same rows until then.
"""

from __future__ import annotations

import math
from argparse import Namespace
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    LuGre,
    Sampled,
    State,
    Stribeck,
    System,
    Trace,
    Transition,
)
from gms_fsm.charts import CHARTS
from tests.helpers import other_parts
from tests.soak.trying import Dice, Seen, examine, outcome, shaped

SHAPES = 60
MOST_STEPS = 3000  # of a run; some of these systems chatter
T_END = 3.0  # s
ENGINES = ("ifelse", "machines", "compiled")


@dataclass(frozen=True, eq=False)
class Trial:
    """A system and how to run it."""

    system: System
    how: dict[str, Any]
    kinds: tuple[str, ...]


# --------------------------------------------------------------------------- what is drawn
def _curve(dice: Dice) -> Stribeck:
    F_c = dice.spread(0.2, 1.0)
    return Stribeck(F_c, F_c * dice.even(1.0, 2.0), dice.spread(1e-3, 0.2))


def _bank(dice: Dice) -> GMS:
    n = dice.one_of(1, 2, 3, 4, 6)
    parameters = GMSParameters(
        dice.spreads(n, 5.0, 100.0),
        dice.spreads(n, 1e-2, 1.0),
        dice.spreads(n, 1e-2, 0.5),
        sigma_2=dice.even(0.0, 0.5),
        v_c=dice.spread(1e-7, 1e-3),
        weights=dice.spreads(n, 2e-3, 0.05),
        stribeck=_curve(dice),
    )
    return GMS(parameters, law=dice.one_of("signed", "signed", "published"))


FLOWS = (
    "v", "0", "-z", "a * (sgn(v) - z / s)", "a * v * cos(z)", "tanh(v) - z", "v - abs(v) * z / s",
    "min(v, a) - b * z", "max(-a, v) * exp(-abs(z))",
)  # fmt: skip
CLAUSES = (
    "z >= a * s", "z <= -a * s", "abs(z) < b * s", "abs(z) >= s", "abs(v) <= c", "v > c",
    "v < -c", "z * v > 0", "sin(4 * t) > b", "not (z < a * s)",
)  # fmt: skip
ACTIONS: tuple[dict[str, str], ...] = ({}, {}, {}, {"z": "b * z"}, {"z": "0"})


def _own(dice: Dice) -> ChartModel:
    """A bank of elements of a random chart."""
    names = ("rest", "go", "turn")[: dice.one_of(2, 3)]
    pairs = [(one, other) for one in names for other in names if one != other]
    chart = Chart(
        "random",
        ("v", "s", "t"),
        ("z",),
        ("k", "a", "b", "c"),
        [State(name, {"z": dice.one_of(*FLOWS)}, entry=dice.one_of(*ACTIONS)) for name in names],
        [
            Transition(
                f"e{i}",
                *dice.one_of(*pairs),
                dice.one_of(" and ", " or ").join(
                    dice.one_of(*CLAUSES) for _ in range(dice.one_of(1, 2, 2, 3))
                ),
                actions=dice.one_of(*ACTIONS),
            )
            for i in range(dice.one_of(2, 3, 4))
        ],
        {"F": "k * z + 0.1 * dz"},
    )
    n = dice.one_of(1, 2, 3)
    values = {
        "k": np.array(dice.spreads(n, 1.0, 50.0)),
        "a": dice.even(0.2, 1.0),
        "b": dice.even(0.0, 0.9),
        "c": dice.spread(1e-6, 0.1),
    }
    weights = np.array(dice.spreads(n, 5e-3, 0.2))
    return ChartModel(chart, values, n=n, stribeck=_curve(dice), weights=weights)


def _thresholds(dice: Dice) -> dict[str, float]:
    F_c = dice.spread(0.1, 2.0)
    return {"F_c": F_c, "F_s": F_c * dice.even(1.0, 1.8)}


MODELS: dict[str, Callable[[Dice], Any]] = {
    "gms": _bank,
    "own": _own,
    "lugre": lambda dice: LuGre(
        sigma_0=dice.spread(50.0, 1e3),
        sigma_1=dice.spread(0.1, 10.0),
        sigma_2=dice.even(0.0, 0.5),
        stribeck=_curve(dice),
    ),
}
VALUES: dict[str, Callable[[Dice], dict[str, Any]]] = {
    "stiction": lambda dice: {**_thresholds(dice), "b": dice.even(0.0, 0.3)},
    "karnopp": lambda dice: {
        **_thresholds(dice),
        "sigma_2": dice.even(0.0, 0.5),
        "D": dice.spread(1e-5, 1e-2),
    },
    "backlash": lambda dice: {
        "k": dice.spread(20.0, 500.0),
        "d": dice.even(0.0, 1.0),
        "gap": dice.spread(1e-3, 0.1),
    },
    "end-stop": lambda dice: {
        "x_s": dice.spread(0.02, 1.0),
        "e": dice.even(0.0, 0.9),
        "v_r": dice.spread(1e-3, 1e-1),
    },
    "dog-clutch": lambda dice: {"t_on": dice.even(0.1, 1.0), "t_off": dice.even(1.1, 4.0)},
    "dahl": lambda dice: {"sigma_0": dice.spread(20.0, 1e3), "F_c": dice.spread(0.1, 2.0)},
    "prandtl-tomlinson": lambda dice: {
        "F_0": dice.spread(0.1, 2.0),
        "a_0": dice.spread(0.02, 0.5),
        "c": dice.even(0.1, 4.0),
    },
}
KINDS = ("gms", "gms", "gms", "own", "own", "stiction", "stiction", *MODELS, *VALUES)


def _contact(dice: Dice, name: str, kind: str, x: str, v: str) -> Contact:
    """A contact of a kind on one relative motion."""
    given = (MODELS[kind](dice),) if kind in MODELS else (CHARTS[kind], VALUES[kind](dice))
    chart = getattr(given[0], "chart", given[0])
    return Contact(name, *given, v=v, inputs={"x": x} if "x" in chart.inputs else {})


def _signal(dice: Dice) -> tuple[Any, dict[str, float]]:
    """A formula, a record or a function, and the numbers that a formula names."""
    A, w = dice.spread(0.5, 8.0), dice.even(0.5, 8.0)
    match dice.one_of("sine", "sine", "ramps", "record", "function"):
        case "sine":
            return "A * sin(w * t)", {"A": A, "w": w}
        case "ramps":
            return "min(A * t, max(A - w * t, -A)) + A / 5 * cos(9 * t)", {"A": A, "w": w}
        case "record":
            times = np.linspace(0.0, T_END + 0.1, 12)
            return (times, [dice.even(-A, A) for _ in times]), {}
        case _:
            return lambda t: A * math.cos(w * t) + 0.1 * A, {}


def _system(dice: Dice) -> System:
    """Bodies in a row with springs between them, contacts on the ground and between them."""
    count = dice.one_of(1, 1, 2, 3)
    signal, numbers = _signal(dice)
    forces = ["f", "0", "0"][:count]
    for i in range(count):
        numbers |= {f"m{i}": dice.spread(0.2, 5.0), f"k{i}": dice.spread(0.5, 100.0)}
        numbers[f"d{i}"] = dice.even(0.0, 1.0)
        if i:
            spring = f"k{i} * (x{i} - x{i - 1}) + d{i} * (v{i} - v{i - 1})"
            forces[i - 1] += f" + {spring}"
            forces[i] += f" - ({spring})"
        elif dice.one_of(True, False):
            forces[0] += " - k0 * x0 - d0 * v0"
    motions = [(f"x{i}", f"v{i}") for i in range(count)]
    motions += [(f"x{i} - x{i - 1}", f"v{i} - v{i - 1}") for i in range(1, count)]
    bodies, flow, sampled = [], {}, []
    if dice.one_of(True, False, False):
        numbers["V"] = dice.even(-0.5, 0.5)
        bodies.append(Body("belt", velocity=dice.one_of("V", "V * cos(3 * t)"), x="x_b", v="v_b"))
        motions.append(("x0 - x_b", "v0 - v_b"))
    if dice.one_of(True, False, False):
        numbers["tau"] = dice.spread(0.02, 1.0)
        flow = {"i": "(f - i) / tau"}
        forces[0] += " + i"
    if dice.one_of(True, False, False):
        numbers |= {"k_p": dice.spread(0.5, 50.0), "k_d": dice.even(0.0, 2.0)}
        updates = {"e": "-x0", "u": "k_p * e + k_d * (e - last) / period", "last": "e"}
        sampled = [Sampled("pd", period=dice.one_of(0.01, 0.05, 0.03), updates=updates)]
        forces[0] += " + u"
    bodies += [
        Body(f"b{i}", inertia=f"m{i}", force=force, x=f"x{i}", v=f"v{i}")
        for i, force in enumerate(forces)
    ]
    kinds = [dice.one_of(*KINDS) for _ in range(dice.one_of(1, 1, 2, 3))]
    contacts = [
        _contact(dice, f"{kind.replace('-', '_')}_{i}", kind, *dice.one_of(*motions))
        for i, kind in enumerate(kinds)
    ]
    return System("random", bodies=bodies, contacts=contacts, signals={"f": signal},
                  numbers=numbers, flow=flow, sampled=sampled)  # fmt: skip


def _options(dice: Dice, system: System) -> dict[str, Any]:
    """Method, tolerances, what is recorded, where it starts."""
    how: dict[str, Any] = {"max_steps": MOST_STEPS}
    method = dice.one_of("dp45", "dp45", "dp45", "bs23", "rk4", "heun")
    how["method"] = method
    if method in ("rk4", "heun"):
        how["step"] = dice.spread(3e-3, 3e-2)
        how["events"] = dice.numbers.choice(("located", "located", "step"))
    else:
        how["rtol"] = dice.spread(1e-9, 1e-3)
        if dice.numbers.random() < 0.3:
            how["max_step"] = dice.spread(0.02, 1.0)
    if dice.numbers.random() < 0.3:
        how["t_eval"] = np.linspace(0.0, T_END, 50)
    free = [body for body in system.bodies if not body.driven]
    if not any(state.locked for each in system.contacts for state in each.chart.states[:1]):
        how["initial"] = {body.v: dice.even(-0.3, 0.3) for body in free}
    return how


def trial(seed: int, index: int, shapes: int = SHAPES) -> Trial:
    """Return a trial; the same arguments give the same one."""
    system, dice = shaped(_system, seed, index, shapes)
    kinds = tuple(each.name.rpartition("_")[0] for each in system.contacts)
    return Trial(system, _options(dice, system), kinds)


# --------------------------------------------------------------------------- comparing
def differences(trial: Trial, engines: tuple[str, ...] = ENGINES) -> tuple[list[str], Trace | None]:
    """Return what differs from the first engine, and its trace."""
    trace, end = outcome(trial.system, T_END, engine=engines[0], **trial.how)
    found = []
    for engine in engines[1:]:
        other, its_end = outcome(trial.system, T_END, engine=engine, **trial.how)
        if its_end != end:
            found.append(f"{engine}: {its_end!r} and not {end!r}")
        if parts := other_parts(trace, other):
            found.append(f"{engine}: {', '.join(parts[:6])}")
    return found, trace


def look(given: Namespace, index: int) -> Iterator[Seen]:
    """Compare the engines on one system."""
    one = trial(given.seed, index, given.shapes)
    differ, trace = differences(one)
    counts = Counter(one.kinds)
    if trace is not None:
        counts["transitions"] = len(trace.transitions)
        counts["to the end"] = bool((trace.t[-1:] == T_END).any())
    again = f"--shapes {given.shapes} --index {index}"
    yield Seen(again, counts, "; ".join(differ), shown=(one.system, one.how, trace))


if __name__ == "__main__":
    examine("random_systems", "Equal bits in all engines?", look, count=500, shapes=SHAPES)
