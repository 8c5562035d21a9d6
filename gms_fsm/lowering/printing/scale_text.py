"""The scales of a chart as text: a function of its numbers, printed from its guards and flows.

The text is of the subset that `integrators.machine_code` translates, so an export computes its
tolerances anew when a number changes, as Python does.
"""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.equality import ByIdentity
from gms_fsm.language import (
    Binary,
    Number,
    Value,
    comparisons,
    derivative,
    names_in,
    renamed,
    spell,
    split,
)

INF = math.inf
# A velocity in a guard is a window to pass through, not a typical size of motion: its weight.
# With rtol = 1e-6 the velocity is then accurate to 1e-5 v_c; coarser, creep just below v_c is off.
WINDOW = 1e2


# --------------------------------------------------------------------------- what the text calls
def sign_from_above(u: float) -> float:
    """Return the sign of u with sgn(0) = 1: the slope of abs(z) at 0 is 1."""
    return 1.0 if u >= 0.0 else -1.0


def number_or_0(u: float) -> float:
    """Return a number, or 0 if it is not finite."""
    return u if u - u == 0.0 else 0.0


def divided(a: float, b: float) -> float:
    """Return |a / b|, or 0 if it is undefined."""
    return number_or_0(abs(a / b)) if b != 0.0 else 0.0


def reach(height: float, slope: float) -> float:
    """Return where a margin is zero."""
    return abs(height / slope) if slope != 0.0 else 0.0


def reach_bent(height: float, slope: float, bend: float) -> float:
    """Return where a margin is zero; by its bend if it is flat at rest, as v**2 + w**2 - e**2."""
    return abs(height / slope) if slope != 0.0 else math.sqrt(divided(2.0 * height, bend))


def nearer(least: float, u: float) -> float:
    """Return the smaller of two numbers, if the second is above 0."""
    return u if 0.0 < u < least else least


def known(least: float) -> float:
    """Return the smallest number found, or 0 if there was none."""
    return least if least < INF else 0.0


HELPERS: Mapping[str, object] = {
    "sign_from_above": sign_from_above, "number_or_0": number_or_0, "divided": divided,
    "reach": reach, "reach_bent": reach_bent, "nearer": nearer, "known": known, "inf": INF,
}  # fmt: skip


# --------------------------------------------------------------------------- derived from a chart
@dataclass(frozen=True, eq=False)
class _Sizes:
    """Texts of a chart's parameters; the numbers are places in `at_rest` and `paces`."""

    at_rest: Sequence[str]  # all at rest in the origin
    paces: Sequence[str]  # rates of the variables: negative where one relaxes
    relaxes: Mapping[str, Sequence[int]]  # by state, the places of constant rates in `paces`
    reach: Mapping[str, Sequence[tuple[int, ...]]]  # margins of guards, slopes and bends
    stiffness: Mapping[str, Sequence[int]]  # slopes of the forces
    follows: Mapping[str, Sequence[int]]  # slope of a variable with respect to x, by state


@functools.lru_cache(maxsize=64)
def _sizes(key: ByIdentity[Chart]) -> _Sizes:
    chart = key.it
    states = tuple(dict.fromkeys(("x", "v", *chart.velocities, *chart.variables)))
    rates = [f"d{name}" for name in chart.variables]
    others = [name for name in (*chart.inputs, *chart.velocities) if name != "s"]
    late = {*chart.force_names, *chart.rate_names} - {*chart.parameter_names}
    zero_at_rest = ("t", *states, *rates, *others, *sorted(late))
    rest: dict[str, Value] = dict.fromkeys(zero_at_rest, Number(0.0))
    lets: dict[str, Value] = {}
    for name, tree in chart.lets.items():
        lets[name] = renamed(tree, lets)
    places: dict[str, int] = {}

    def place(tree: Value) -> int:
        return places.setdefault(_spelled(renamed(tree, rest)), len(places))

    guards = chart.guards.values()
    pairs = dict.fromkeys(c for guard in guards for c in comparisons(split(guard)))
    margins = [
        margin
        for each in pairs
        if not names_in(margin := renamed(Binary("-", each.left, each.right), lets)) & late
    ]
    forces = dict.fromkeys(renamed(tree, lets) for tree in chart.forces.values() if tree)
    flows = {key: renamed(tree, lets) for key, tree in chart.flows.items()}
    reach = {
        name: [
            tuple(place(tree) for tree in (margin, slope, derivative(slope, name)) if tree)
            for margin in margins
            if name in names_in(margin) and (slope := derivative(margin, name)) is not None
        ]
        for name in states
    }
    stiffness = {
        name: [place(slope) for force in forces if (slope := derivative(force, name)) is not None]
        for name in chart.variables
    }
    follows = {
        name: [
            place(rate)
            for state in chart.states
            if (rate := derivative(flows[state.name, name], "v")) is not None
        ]
        for name in chart.variables
    }
    moving = {name: zero for name, zero in rest.items() if name != "v"}
    paces: dict[str, int] = {}
    relaxes: dict[str, list[int]] = {state.name: [] for state in chart.states}
    for (state, name), flow in flows.items():
        if (rate := derivative(flow, name)) is not None:
            k = paces.setdefault(_spelled(renamed(rate, moving)), len(paces))
            if all(derivative(rate, each) == Number(0.0) for each in zero_at_rest):
                relaxes[state].append(k)
    return _Sizes(
        [*places],
        [*paces],
        relaxes,
        reach,
        stiffness,
        {name: row for name, row in follows.items() if row},
    )


def _spelled(tree: Value) -> str:
    """Spell a value at rest, or the limit that it has as all grow from rest."""
    rename = {name: f"its_{name}" for name in names_in(tree)}
    return re.sub(r"\bsgn\(", "sign_from_above(", spell(tree, rename=rename))


def scale_text(chart: Chart, name: str, own: frozenset[str], *, curved: bool) -> list[str]:
    """Return a function of the numbers of a chart that finds its scales.

    Its arguments: the number of elements, the load N, F_c and v_s of the curve, the weights, the
    parameters (those in `own` as arrays), where the elements and their states begin in `sizes` and
    `relaxing`, and the number of states there. It returns the scales x and v, the slowest speed in
    a guard and the fastest time.
    """
    sizes = _sizes(ByIdentity(chart))
    parameters = [f"{'all' if each in own else 'its'}_{each}" for each in chart.parameter_names]
    arguments = ["_n", "_N", "_F_c", "_v_s", "_weight", *parameters]
    arguments += ["_first", "_sizes", "_base", "_states", "_relaxing"]
    found = [*sizes.reach]
    numbers = ["its_s = _weight[_i] * (_F_c * _N)" if curved else "its_s = 0.0"]
    numbers += [f"its_{each} = all_{each}[_i]" for each in chart.parameter_names if each in own]
    first = [f"_r{k} = number_or_0({text})" for k, text in enumerate(sizes.at_rest)]
    for k, each in enumerate(found):
        first.append(f"_u{k} = inf")
        for margin in sizes.reach[each]:
            places = ", ".join(f"_r{j}" for j in margin)
            word = "reach" if len(margin) == 2 else "reach_bent"
            first.append(f"_u{k} = nearer(_u{k}, {word}({places}))")
        for j in sizes.stiffness.get(each, ()) if curved else ():
            first.append(f"_u{k} = nearer(_u{k}, reach(_F_c * _N, _r{j}))")
        first.append(f"_u{k} = known(_u{k})")
    for k, each in enumerate(chart.variables):
        place = " + ".join(["_first", *["_n"] * k, "_i"])
        first.append(f"_sizes[{place}] = _u{found.index(each)}")
    first.append(f"_x = nearer(_x, _u{found.index('x')})")
    for each, follows in sizes.follows.items():
        first.append("_most = 0.0")
        first += [f"_most = max(_most, abs(_r{j}))" for j in follows]
        first.append(f"_x = nearer(_x, divided(_u{found.index(each)}, _most))")
    for each in chart.velocities:
        first.append(f"_slowest = nearer(_slowest, _u{found.index(each)})")
        first.append(f"_v = nearer(_v, {WINDOW} * _u{found.index(each)})")
    second = [f"_p{k} = number_or_0({text})" for k, text in enumerate(sizes.paces)]
    second += [f"_fastest = max(_fastest, abs(_p{k}))" for k in range(len(sizes.paces))]
    for k, state in enumerate(chart.states):
        rates = "".join(f", _p{j}" for j in sizes.relaxes[state.name])
        text = f"min(0.0{rates})" if rates else "0.0"
        second.append(f"_relaxing[_base + _states * _i + {k}] = divided(1.0, {text})")
    lines = [f"{each} = inf" for each in ("_x", "_v", "_slowest")]
    lines += ["for _i in range(_n):", *(f"    {each}" for each in (*numbers, *first))]
    lines += ["_v = known(nearer(_v, _v_s))" if curved else "_v = known(_v)", "_x = known(_x)"]
    lines += ["its_v = _v_s" if curved else "its_v = _v", "_fastest = 0.0"]
    lines += ["for _i in range(_n):", *(f"    {each}" for each in (*numbers, *second))]
    lines += [
        "_time = divided(1.0, _fastest)",
        "if _time == 0.0:",
        "    _time = divided(_x, its_v)",
    ]
    lines.append("return _x, _v, known(_slowest), _time")
    return [f"def {name}({', '.join(arguments)}):", *(f"    {each}" for each in lines)]
