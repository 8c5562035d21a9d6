"""Random systems of locks, impacts, gears and samplers against an exact reference.

``python -m tests.soak.exact_systems --count 1000 --seed 1`` prints each system that goes wrong with
the first difference, then those that are ill-conditioned, and totals.

A trial is a pure function of (seed, index, shapes). Its *shape* - bodies, springs, loads, contacts,
motions, controllers - is one of `shapes` many; its numbers and initial values are its own.
`tests.soak.exact_reference` computes what is right, from numbers alone.

A difference counts only where the answer does not hang on the last digits. Where it does, the
reference itself finds other transitions, or much later ones, after a change of all numbers by a
millionth part or less; such a system is listed as ill-conditioned.
"""

from __future__ import annotations

import math
from argparse import Namespace
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gms_fsm import GMS, Body, Contact, GMSParameters, Sampled, Stribeck, System, Trace
from gms_fsm.charts import CHARTS
from tests.helpers import FASTEST
from tests.soak import exact_reference
from tests.soak.exact_reference import Controller, Endless, Plain, Run, Touch, Undecided, perturbed
from tests.soak.trying import Dice, Seen, examine, outcome, shaped

SHAPES = 60
T_END = 3.0  # s
MOST_STEPS = 60_000  # a run of these takes a few hundred to a few thousand
RTOL = 1e-6
TIME = 1.0  # s: times may differ by this times rtol, the end by this part of 1 and itself ...
STATE = 10.0
WITHIN = 30.0  # ... and both by what a change of all numbers by this part, times rtol, changes
PARTS = (1e-7, 1e-8, 1e-6)  # if a change by such a part changes a transition, the answer is open
SEEDS = (1, 2, 3)
CHAOS = 1e4  # s: nor is it decided if a time moves by more than this, times the part


@dataclass(frozen=True, eq=False)
class Trial:
    """A system, its initial values, and the same as numbers."""

    system: System
    initial: dict[str, Any]
    plain: Plain


# --------------------------------------------------------------------------- what is drawn
KINDS = (*("stiction",) * 3, *("end-stop",) * 3, *("backlash",) * 2, "dog-clutch", *("gms",) * 2)
LOCKS = ("stiction", "stiction", "stiction", "end-stop", "dog-clutch")
RATIOS = (2.0, 3.0, 0.5, -1.5)
PERIODS = (0.01, 0.02, 0.05, 0.03, 0.0125, 0.007, 0.035)


def _values(dice: Dice, kind: str, x: float) -> dict[str, Any]:
    """Draw the numbers of a contact that starts at x."""
    if kind == "stiction":
        F_c = dice.spread(0.1, 2.0)
        F_s = F_c * dice.numbers.choice((1.0, dice.even(1.0, 1.8)))
        return {"F_c": F_c, "F_s": F_s, "b": dice.numbers.choice((0.0, dice.even(0.0, 0.3)))}
    if kind == "end-stop":
        x_s, v_r = max(x, 0.0) + dice.spread(0.02, 0.6), dice.spread(1e-3, 3e-2)
        return {"x_s": x_s, "e": dice.even(0.0, 0.9), "v_r": v_r}
    if kind == "backlash":
        d = dice.numbers.choice((0.0, dice.even(0.0, 1.0)))
        return {"k": dice.spread(20.0, 500.0), "d": d, "gap": abs(x) + dice.spread(1e-3, 0.1)}
    if kind == "dog-clutch":
        return {"t_on": dice.even(0.1, 1.0), "t_off": dice.even(1.1, 4.0)}
    n = dice.one_of(1, 2, 3)
    return {
        "k": dice.spreads(n, 5.0, 100.0),
        "sigma": [dice.numbers.choice((0.0, each)) for each in dice.spreads(n, 1e-2, 0.3)],
        "C": dice.spreads(n, 1e-2, 0.5),
        "weights": dice.spreads(n, 2e-3, 0.05),
        "sigma_2": dice.even(0.0, 0.3),
        "v_c": dice.spread(1e-6, 1e-3),
        "F_c": dice.spread(0.3, 1.5),
    }


def _motion(dice: Dice, free: int, belts: int) -> dict[int, float]:
    """Choose what a contact is mounted on."""
    i = dice.one_of(*range(free))
    j = dice.one_of(*(b for b in range(free) if b != i))
    kinds = ("ground", "ground", "between", "between", "geared", *("belt",) * (2 * belts))
    match dice.one_of(*kinds):
        case "ground":
            return {i: 1.0}
        case "between":
            return {i: 1.0, j: -1.0}
        case "geared":
            return {i: 1.0, j: -dice.one_of(*RATIOS)}
        case _:
            return {i: 1.0, free: -1.0}


def _plain(dice: Dice) -> Plain:
    """Draw a system as numbers."""
    free, belts = dice.one_of(2, 2, 3, 4), dice.one_of(0, 0, 0, 1)
    springs, loads = [], []
    for i in range(free):
        if dice.one_of(True, False):
            springs.append((i, -1, dice.spread(0.5, 100.0), dice.even(0.0, 1.0)))
        if i and dice.one_of(True, True, False):
            springs.append((i, i - 1, dice.spread(0.5, 100.0), dice.even(0.0, 1.0)))
    for _ in range(free):
        kind = dice.one_of("nothing", "sine", "sine", "ramp", "constant", "all")
        A, w, phi = dice.spread(0.5, 8.0), dice.even(0.5, 8.0), dice.even(-3.0, 3.0)
        phi = dice.numbers.choice((0.0, phi, phi))
        B, C = dice.even(-3.0, 3.0), dice.even(-3.0, 3.0)
        sine, constant, ramp = (kind in (name, "all") for name in ("sine", "constant", "ramp"))
        loads.append((A if sine else 0.0, w, phi, B if constant else 0.0, C if ramp else 0.0))
    corners = []
    if belts:
        times = [0.0, *sorted(dice.even(0.2, T_END - 0.2) for _ in range(dice.one_of(1, 2, 3)))]
        times.append(T_END + 1.0)
        corners.append([(t, dice.even(-0.6, 0.6)) for t in times])
        if dice.one_of(True, False):  # a constant speed
            corners[0] = [(t, corners[0][0][1]) for t in times]
    kinds = dice.one_of(KINDS, KINDS, KINDS, LOCKS)
    resting = dice.numbers.random() < (0.7 if kinds is LOCKS else 0.4)
    x = [0.0 if resting else dice.even(-0.05, 0.05) for _ in range(free)]
    v = [0.0 if resting else dice.even(-1.0, 1.0) for _ in range(free)]
    controllers = [
        _controller(dice, number, dice.one_of(*range(free)))
        for number in range(dice.one_of(0, 0, 1, 2))
    ]
    speeds = [*v, *(each[0][1] for each in corners)]
    touches = []
    for c in range(dice.one_of(1, 2, 2, 3, 3)):
        kind, row = dice.one_of(*kinds), _motion(dice, free, belts)
        places = [*x, *(0.0 for _ in corners)]
        at = sum(coefficient * places[b] for b, coefficient in row.items())
        speed = sum(coefficient * speeds[b] for b, coefficient in row.items())
        values = _values(dice, kind, at)
        state = {"end-stop": "free", "backlash": "apart", "dog-clutch": "open", "gms": "stick"}
        moving = "stuck" if speed == 0.0 else "forward" if speed > 0.0 else "backward"
        name = f"{kind.replace('-', '_')}_{c}"
        touches.append(Touch(name, kind, row, values, state.get(kind, moving)))
    masses = dice.spreads(free, 0.2, 5.0)
    return Plain(masses, springs, loads, corners, controllers, touches, x, v, T_END)


def _controller(dice: Dice, number: int, body: int) -> Controller:
    """Draw a controller that measures the velocity, or takes the difference of positions."""
    u, period = f"u{number}", dice.one_of(*PERIODS)
    k_p, k_d, r = dice.spread(0.5, 50.0), dice.even(0.0, 2.0), dice.even(-0.3, 0.3)
    if dice.one_of(True, False):
        law = {f"x{body}": -k_p, f"v{body}": -k_d, "1": k_p * r}
        if number and dice.one_of(True, False):
            law["u0"] = dice.even(-0.5, 0.5)  # a cascade: the order of ticks at one time counts
        return Controller(period, [(u, law)], u, body)
    e, last = f"e{number}", f"last{number}"
    differing = {e: k_p + k_d / period, last: -k_d / period}
    updates = [(e, {f"x{body}": -1.0, "1": r}), (u, differing), (last, {e: 1.0})]
    return Controller(period, updates, u, body)


# --------------------------------------------------------------------------- as a system
def as_system(plain: Plain) -> tuple[System, dict[str, Any]]:
    """Return a plain system as texts with numbers, and its initial values."""
    free = len(plain.masses)
    numbers: dict[str, float] = {}
    forces = ["0"] * free

    def number(name: str, value: float) -> str:
        numbers[name] = value
        return name

    for i, (A, w, phi, B, C) in enumerate(plain.loads):
        if A:
            wave = f"sin({number(f'w{i}', w)} * t + {number(f'p{i}', phi)})"
            forces[i] += f" + {number(f'A{i}', A)} * {wave}"
        forces[i] += f" + {number(f'B{i}', B)}" if B else ""
        forces[i] += f" + {number(f'C{i}', C)} * t" if C else ""
    for n, (i, j, k, d) in enumerate(plain.springs):
        x, v = (f"({a}{i} - {a}{j})" if j >= 0 else f"{a}{i}" for a in "xv")
        pull = f"({number(f'k{n}', k)} * {x} + {number(f'd{n}', d)} * {v})"
        forces[i] += f" - {pull}"
        if j >= 0:
            forces[j] += f" + {pull}"
    sampled = []
    for n, each in enumerate(plain.controllers):
        forces[each.body] += f" + {each.acts}"
        updates = {
            name: " + ".join(
                number(f"g{n}_{name}_{key}", value) + ("" if key == "1" else f" * {key}")
                for key, value in formula.items()
            )
            for name, formula in each.updates
        }
        sampled.append(Sampled(f"sampler{n}", period=each.period, updates=updates))
    bodies = [
        Body(f"b{i}", inertia=number(f"m{i}", m), force=forces[i], x=f"x{i}", v=f"v{i}")
        for i, m in enumerate(plain.masses)
    ]
    initial: dict[str, Any] = {}
    for i in range(free):
        initial |= {f"b{i}.x": plain.x[i], f"b{i}.v": plain.v[i]}
    signals: dict[str, Any] = {}
    for i, corners in enumerate(plain.belts, start=free):
        bodies.append(Body(f"b{i}", velocity=f"v{i}", x=f"x{i}", v=f"v{i}"))
        signals[f"v{i}"] = list(corners)
    contacts = []
    for touch in plain.touches:
        contacts.append(_contact(touch))
        initial[f"{touch.name}.states"] = [touch.state] * touch.elements
    system = System("random", bodies=bodies, contacts=contacts, numbers=numbers, signals=signals,
                    sampled=sampled)  # fmt: skip
    return system, initial


def _contact(touch: Touch) -> Contact:
    """Return a contact as users write it."""
    text = ""
    for b, coefficient in touch.row.items():
        size = "" if abs(coefficient) == 1.0 else f"{abs(coefficient):g} * "
        text += (" - " if coefficient < 0 else " + " if text else "") + f"{size}v{b}"
    v = touch.values
    if touch.kind != "gms":
        return Contact(touch.name, CHARTS[touch.kind], v, v=text)
    curve = Stribeck(v["F_c"], v["F_c"], 0.1)  # flat, for a motion that is linear
    own = {name: v[name] for name in ("k", "sigma", "C", "sigma_2", "v_c", "weights")}
    given = GMSParameters(**own, stribeck=curve)
    return Contact(touch.name, GMS(given, law="signed"), v=text)


def trial(seed: int, index: int, shapes: int = SHAPES) -> Trial:
    """Return a trial; the same arguments give the same one."""

    def draw(dice: Dice) -> Trial:
        plain = _plain(dice)
        return Trial(*as_system(plain), plain)

    found, _ = shaped(draw, seed, index, shapes, digits=4)
    return found  # type: ignore[no-any-return]


# --------------------------------------------------------------------------- comparing
Sequences = Mapping[tuple[str, int], list[tuple[str, float]]]


def run(trial: Trial, **how: Any) -> tuple[Trace | None, str]:
    """Return the trace, also of a run that stops, and how it failed."""
    how = {"engine": FASTEST, "max_steps": MOST_STEPS, "output": "end"} | how
    return outcome(trial.system, trial.plain.t_end, initial=trial.initial, **how)


def sequences(firings: Sequence[tuple[float, str, int, str]], t_end: float) -> Sequences:
    """Return the transitions of each machine, without those at the very end."""
    found: dict[tuple[str, int], list[tuple[str, float]]] = defaultdict(list)
    for t, contact, element, edge in firings:
        if t < t_end - 1e-5:
            found[contact, element].append((edge, t))
    return found


def _firings(trace: Trace) -> list[tuple[float, str, int, str]]:
    log = trace.transitions
    assert trace.system is not None
    only = [trace.system.contacts[0].name] * len(log)
    contacts = log["contact"].tolist() if "contact" in log.dtype.names else only
    columns = (log[name].tolist() for name in ("t", "element", "edge"))
    return [(t, c, e, edge) for c, t, e, edge in zip(contacts, *columns, strict=True)]


@dataclass(frozen=True)
class Difference:
    """How far two runs are apart: in what they do, or how much in times and at the end."""

    what: str = ""  # the first difference in the sequence
    t: float = math.inf
    times: float = 0.0
    states: float = 0.0


def difference(mine: Sequences, right: Sequences, ends: Sequence[Sequence[float]]) -> Difference:
    """Compare the sequence of each machine, and the ends."""
    first, times = Difference(), 0.0
    for machine in sorted(mine.keys() | right.keys()):
        ours, theirs = mine.get(machine, []), right.get(machine, [])
        for k in range(max(len(ours), len(theirs))):
            a = ours[k] if k < len(ours) else ("nothing", math.inf)
            b = theirs[k] if k < len(theirs) else ("nothing", math.inf)
            gap = abs(a[1] - b[1])
            if a[0] != b[0] or gap > 1e-2:
                t = min(a[1], b[1])
                if t < first.t:
                    contact, element = machine
                    what = f"{contact}.{element}, transition {k + 1}: {a}, right is {b}"
                    first = Difference(what, t)
                break
            times = max(times, gap)
    if first.what:
        return Difference(first.what, first.t, times, math.inf)
    scale = [1.0 + abs(b) for b in ends[1]]
    states = max(abs(a - b) / s for a, b, s in zip(*ends, scale, strict=True))
    return Difference(times=times, states=states)


def _end_of_reference(run: Run, plain: Plain) -> list[float]:
    free = len(plain.masses)
    return [*run.x, *run.v[:free], *(each for z in run.z.values() for each in z)]


def _end_of_trace(trace: Trace, plain: Plain) -> list[float]:
    columns = trace.columns()
    bodies, free = len(plain.masses) + len(plain.belts), len(plain.masses)
    names = [f"x{b}" for b in range(bodies)] + [f"v{b}" for b in range(free)]
    names += [
        f"{each.name}.z{e + 1}"
        for each in plain.touches
        if each.kind == "gms"
        for e in range(each.elements)
    ]
    return [float(columns[name][-1]) for name in names]


@dataclass(frozen=True)
class Verdict:
    """What became of a trial."""

    kind: str  # right, ill-conditioned, wrong times, wrong sequence, wrong end, failed, no answer
    what: str = ""
    transitions: int = 0
    t: float = math.inf


def verdict(trial: Trial, *, rtol: float = RTOL, engine: str = FASTEST) -> Verdict:
    """Compare a run with the reference."""
    plain = trial.plain
    try:
        reference = exact_reference.simulate(plain)
    except (Undecided, Endless) as error:
        _, failure = run(trial, rtol=rtol, engine=engine)
        return Verdict("no answer", f"{error}; {failure or 'the run came to its end'}")
    right, end = sequences(reference.firings, plain.t_end), _end_of_reference(reference, plain)
    count = len(reference.firings)
    found, failure = _found(trial, right, end, rtol=rtol, engine=engine)
    limits = TIME * rtol, STATE * rtol
    if not found.what and found.times <= limits[0] and found.states <= limits[1]:
        return Verdict("right", transitions=count)
    why, times, states = conditioning(plain, right, end)
    if not failure:
        why = why or "; ".join(f"t = {t!r}: {note}" for t, note in reference.notes if t < found.t)
    if why:
        return Verdict("ill-conditioned", f"{why}; {_said(found)}", count, found.t)
    limits = limits[0] + times * rtol, limits[1] + states * rtol
    if not found.what and found.times <= limits[0] and found.states <= limits[1]:
        return Verdict("right", transitions=count)
    kind = "wrong times" if found.times > limits[0] else "wrong end"
    kind = "failed" if failure else "wrong sequence" if found.what else kind
    said = (
        _said(found)
        if found.what
        else f"{_said(found)}; allowed {limits[0]:.2g} s, {limits[1]:.2g}"
    )
    closer, _ = _found(trial, right, end, rtol=1e-3 * rtol, engine=engine)
    if not closer.what and closer.times <= limits[0] and closer.states <= limits[1]:
        said += f"; right with rtol {1e-3 * rtol:g}"
    return Verdict(kind, said, count, found.t)


def _found(
    trial: Trial, right: Sequences, end: Sequence[float], **how: Any
) -> tuple[Difference, str]:
    """Return how a run differs, and how it failed."""
    trace, failure = run(trial, **how)
    if failure:
        return Difference(failure, math.nan), failure
    assert trace is not None
    mine = sequences(_firings(trace), trial.plain.t_end)
    return difference(mine, right, (_end_of_trace(trace, trial.plain), end)), ""


def _said(found: Difference) -> str:
    return found.what or f"times differ by {found.times:.2g} s, ends by {found.states:.2g}"


def conditioning(plain: Plain, right: Sequences, end: Sequence[float]) -> tuple[str, float, float]:
    """Return why a system is ill-conditioned, or how far times and the end may differ, per rtol."""
    times = states = 0.0
    for part in PARTS:
        for seed in SEEDS:
            moved = perturbed(plain, part, seed)
            try:
                other = exact_reference.simulate(moved)
            except (Undecided, Endless) as error:
                return f"with changes of {part:g}: {error}", 0.0, 0.0
            theirs = sequences(other.firings, plain.t_end)
            found = difference(theirs, right, (_end_of_reference(other, moved), end))
            if found.what:
                return f"changes of {part:g} change the transitions, {found.what}", 0.0, 0.0
            if found.times > CHAOS * part:
                return f"changes of {part:g} change times by {found.times:.2g} s", 0.0, 0.0
            times = max(times, found.times / part * WITHIN)
            states = max(states, found.states / part * WITHIN)
    return "", times, states


def look(given: Namespace, index: int) -> Iterator[Seen]:
    """Judge one system."""
    one = trial(given.seed, index, given.shapes)
    found = verdict(one)
    counts = Counter(each.kind for each in one.plain.touches)
    counts.update({found.kind: 1, "transitions": found.transitions})
    said = f"{found.kind}: {found.what}"
    open_ = found.kind in ("ill-conditioned", "no answer")
    shown: list[Any] = []
    if given.index is not None:
        trace, failure = run(one)
        shown = [one.plain, one.system.numbers, one.initial, failure, found, "the run:"]
        shown += [] if trace is None else _firings(trace)[:200]
        try:
            shown += ["the reference:", *exact_reference.simulate(one.plain).firings[:200]]
        except (Undecided, Endless) as error:
            shown.append(error)
    again = f"--shapes {given.shapes} --index {index}"
    wrong = found.kind != "right" and not open_
    yield Seen(again, counts, said if wrong else "", said if open_ else "", shown)


if __name__ == "__main__":
    examine("exact_systems", "Random systems against an exact reference", look,
            count=1000, shapes=SHAPES)  # fmt: skip
