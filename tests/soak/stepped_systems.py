"""Systems that step sample by sample have the bits of `simulate` with the same inputs as records.

``python -m tests.soak.stepped_systems --count 200 --seed 1`` prints each system that differs.

The systems are those of `random_systems`, with a force, and often the velocity of a belt, as
inputs. Samples are even or not and meet ticks or not; inputs are held, ramps, or jump. On the way a
state is looked ahead of, restored, and copied.
"""

from __future__ import annotations

import contextlib
import math
import pickle
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from gms_fsm import SystemState
from gms_fsm.errors import GMSError
from gms_fsm.systems.system import System
from gms_fsm.traces.failures import LivelockError, StepLimitError
from tests.soak.random_systems import SHAPES, _system
from tests.soak.trying import Dice, Seen, examine, outcome, shaped

ENGINES = ("ifelse", "compiled")
MOST = 20_000  # steps
UNLIKE = LivelockError, StepLimitError  # counted over the whole run, or over a sample
Samples = list[tuple[float, dict[str, tuple[float, float]]]]  # end, and each input at both ends


def _drawn(dice: Dice) -> tuple[System, dict[str, Any]]:
    """A system of `random_systems` with inputs, and settings."""
    system = _system(dice)
    names, bodies = ["f"], []
    for body in system.bodies:
        if body.driven and dice.one_of(True, True, False):
            body = replace(body, velocity="w")
            names.append("w")
        elif body.name == "b0":
            force = f"{body.force} + {dice.one_of('0', 'sin(7 * t)', '0.5 * floor(4 * t)')}"
            body = replace(body, force=force)
        bodies.append(body)
    system = replace(system, bodies=bodies, signals={}, inputs=names)
    method = dice.one_of("dp45", "dp45", "dp45", "bs23", "rk4")
    how: dict[str, Any] = {"max_steps": MOST, "method": method}
    if method == "rk4":
        how["step"] = dice.spread(3e-3, 3e-2)
    else:
        how["rtol"] = dice.spread(1e-9, 1e-3)
    return system, how


def samples(dice: Dice, names: list[str], t_start: float) -> Samples:
    """Return random samples; inputs jump at the start of some."""
    found: Samples = []
    t, count = t_start, int(dice.even(30, 80))
    dt = dice.numbers.choice([0.01, 0.02, 0.03])
    even = dice.numbers.random() < 0.6
    mood = dice.numbers.choice(["held", "ramps", "both"])
    now = dict.fromkeys(names, 0.0)
    for k in range(1, count):
        t = round(t_start + k * dt, 6) if even else t + dice.spread(1e-3, 0.1)
        lines = {}
        for name in names:
            size = 4.0 if name == "f" else 0.3
            start = now[name]
            chance = dice.numbers.random()
            if mood == "held" or (mood == "both" and chance < 0.5):
                start = start if chance < 0.1 else dice.even(-size, size)
                end = start
            else:
                end = dice.even(-size, size)
            lines[name] = start, end
            now[name] = end
        found.append((t, lines))
    return found


def recorded(steps: Samples, name: str, t_start: float) -> Any:
    """Return an input as a record; where it does not jump it has one corner."""
    times, values = [t_start], [steps[0][1][name][0]]
    for k, (t, lines) in enumerate(steps):
        times.append(t)
        values.append(lines[name][1])
        if k + 1 < len(steps) and steps[k + 1][1][name][0] != lines[name][1]:
            times.append(t)
            values.append(steps[k + 1][1][name][0])
    return np.array(times), np.array(values)


def differences(
    system: System, how: dict[str, Any], steps: Samples, engine: str, dice: Dice
) -> tuple[str, int]:
    """Return what differs from `simulate`, and the number of switches."""
    inputs = {name: recorded(steps, name, 0.0) for name in system.inputs}
    trace, failed = outcome(system, steps[-1][0], inputs=inputs, engine="ifelse", **how)
    if trace is None or failed.startswith(tuple(each.__name__ for each in UNLIKE)):
        return "", 0
    log: list[tuple[float, str, int, str]] = []
    seen: list[tuple[float, list[float]]] = []
    error, sees = "", False
    try:
        state = SystemState(system, engine=engine, **how)
        sees = state._plant._sees_ends  # then a sample before a jump is not over
        chance = dice.numbers.random
        for t, lines in steps:
            with contextlib.suppress(GMSError):  # what is tried may be too much for a lock
                if chance() < 0.05:
                    before = state.snapshot()
                    try:
                        state.advance(dice.spread(1e-3, 0.1), **dict.fromkeys(system.inputs, 1.5))
                    finally:
                        state.restore(before)
                if chance() < 0.05:
                    state.peek(dice.spread(1e-3, 0.1), "t", **dict.fromkeys(system.inputs, -1.5))
            if chance() < 0.02:
                state = pickle.loads(pickle.dumps(state))
            state.advance_to(t, **lines)
            log += [tuple(each) for each in state.switches]
            y = [float(u) for u in state._plant.memory.buffers.now.y]
            seen.append((t, y))
    except GMSError as caught:
        error = f"{type(caught).__name__}: {caught}"
    if bool(error) != bool(failed):
        return f"{engine}: {error!r} and not {failed!r}", 0
    wanted = [
        (float(row.t), str(row.contact), int(row.element), str(row.edge))
        for row in trace.transitions
    ]
    upto = seen[-1][0] if seen else 0.0
    ours, theirs = ([each for each in part if each[0] < upto] for part in (log, wanted))
    if [each[1:] for each in ours] != [each[1:] for each in theirs]:
        return f"{engine}: {len(ours)} switches, not {len(theirs)}, or others", 0
    late = max((abs(a[0] - b[0]) for a, b in zip(ours, theirs, strict=True)), default=0.0)
    if late > (64.0 * math.ulp(upto) if sees else 0.0):
        return f"{engine}: a switch is {late} s late", 0
    times, switched = trace.rows.t, {each[0] for each in (*log, *wanted)}
    for k, (t, y) in enumerate(seen[:-1]):  # a run knows that its end is one, and stops there
        row = int(np.searchsorted(times, np.nextafter(t, -np.inf)))
        jumps = sees and any(steps[k][1][u][1] != steps[k + 1][1][u][0] for u in system.inputs)
        if jumps or switched & {t, float(np.nextafter(t, -np.inf))} or row >= len(times):
            continue
        if not np.array_equal(trace.rows.y[row], y):
            return f"{engine}: the state at {t!r}", len(ours)
    return "", len(ours)


def look(given: Namespace, index: int) -> Iterator[Seen]:
    """Compare one system."""
    (system, how), dice = shaped(_drawn, given.seed, index, given.shapes)
    steps = samples(dice, [*system.inputs], 0.0)
    engines = ENGINES if given.engines == "both" else (given.engines,)
    found = [differences(system, how, steps, engine, dice) for engine in engines]
    wrong = "; ".join(text for text, _ in found if text)
    counts = {
        "switches": found[0][1],
        "ramps": sum(a != b for _, u in steps for a, b in u.values()),
    }
    again = f"--shapes {given.shapes} --index {index}"
    yield Seen(again, counts, wrong, shown=(system, how, steps))


if __name__ == "__main__":
    examine(
        "stepped_systems", "The bits of simulate?", look, count=200, shapes=SHAPES, engines="both"
    )
