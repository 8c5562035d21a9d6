"""On random charts every counterexample is real, and no point contradicts a proof.

Counterexamples are inserted into the guards and flows of the chart; proofs are tested at every
point of a grid that contains the numbers in the guards, and at random points. The grid consists of
short binary fractions, for which floats compute these guards exactly.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import pytest

pytest.importorskip("z3", reason="needs z3 (extra: check)")

from hypothesis import given, settings

from gms_fsm import Chart, Finding, Report, Transition, prove
from gms_fsm.language import Value, evaluate, parse_value
from tests.strategies import pairs_on_a_surface, provable_charts

pytestmark = pytest.mark.slow

numbers = pytest.mark.parametrize("number", [24, pytest.param(80, marks=pytest.mark.matrix)])
STEP = 2.0**-20  # s
PASSES = 20
NAMES = ("z", "v", "s", "v_c")
SIGNED = (-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0)
POSITIVE = (0.5, 1.0, 2.0)  # s and v_c: the domain
GRID = [
    dict(zip(NAMES, point, strict=True)) for point in product(SIGNED, SIGNED, POSITIVE, POSITIVE)
]
DICE = random.Random(3)
GRID += [
    {
        "z": DICE.randint(-64, 64) / 16,
        "v": DICE.randint(-64, 64) / 16,
        "s": DICE.randint(1, 64) / 16,
        "v_c": DICE.randint(1, 64) / 16,
    }
    for _ in range(500)
]


# --------------------------------------------------------------------------- what a point shows
def edges_of(chart: Chart, where: Sequence[str]) -> list[Transition]:
    by_name = {edge.name: edge for edge in chart.transitions}
    return [by_name[name] for name in where if name in by_name]


def passes(
    chart: Chart, cycle: Sequence[Transition], point: Mapping[str, float]
) -> Iterator[dict[str, float]]:
    """Go around the cycle while its edges are taken; yield the values after each pass."""
    here = dict(point)
    while True:
        for edge in cycle:
            if not taken(chart, edge.name, here):
                return
            for name, tree in chart.assignments["action", edge.name].items():
                here[name] = float(evaluate(tree, here))
        yield dict(here)


def goes_on(chart: Chart, cycle: Sequence[Transition], point: Mapping[str, float]) -> bool:
    return sum(1 for _ in zip(range(PASSES), passes(chart, cycle, point), strict=False)) == PASSES


def shown(chart: Chart, finding: Finding, point: Mapping[str, float]) -> bool:
    """Return whether a point contradicts a statement."""
    edges = edges_of(chart, finding.where)
    if finding.check == "determinism":
        return len(edges) == 2 and all(evaluate(chart.guards[e.name], point) for e in edges)
    if finding.check == "livelock":
        return bool(edges) and goes_on(chart, edges, point)
    raise AssertionError(finding.check)


def after(chart: Chart, state: str, point: Mapping[str, float]) -> dict[str, float]:
    rates = {"z": float(evaluate(chart.flows[state, "z"], point))}
    rates |= {name: point.get(f"d{name}/dt", 0.0) for name in chart.inputs}
    return {name: value + STEP * rates.get(name, 0.0) for name, value in point.items()}


def in_domain(point: Mapping[str, float]) -> bool:
    return point.get("s", 1.0) > 0 and point.get("v_c", 1.0) > 0


def taken(chart: Chart, name: str, point: Mapping[str, float]) -> bool:
    """Return whether a machine in the source state of an edge takes it at a point."""
    (edge,) = edges_of(chart, [name])
    for _, each in chart.leaving(edge.source):
        if evaluate(chart.guards[each.name], point):
            return each.name == name
    return False


SHOWN = ("refuted", "settled by order")  # statuses that come with a point


def count_of(found: Report, seen: Counter[tuple[str, str]]) -> None:
    for finding in found.findings:
        seen[finding.check, finding.status] += 1
        assert bool(finding.counterexample) <= (finding.status in SHOWN)


@numbers
def test_refutations_are_confirmed_and_proofs_are_not_contradicted(number: int) -> None:
    seen: Counter[tuple[str, str]] = Counter()

    @settings(max_examples=number, deadline=None, derandomize=True)
    @given(provable_charts())
    def attack(chart: Chart) -> None:
        found = prove(chart, ["s > 0", "v_c > 0"])
        count_of(found, seen)
        for finding in found.findings:
            if finding.check in ("determinism", "livelock"):
                if finding.status in SHOWN:
                    assert (finding.status == "refuted") == (finding.check == "livelock")
                    assert in_domain(finding.counterexample), finding
                    assert shown(chart, finding, finding.counterexample), finding
                elif finding.status == "proved":
                    broken = [point for point in GRID if shown(chart, finding, point)]
                    assert not broken, (finding, broken[0])
            if finding.check == "reachability" and "never hold" in finding.text:
                guard = chart.guards[finding.where[0]]
                assert not any(evaluate(guard, point) for point in GRID), finding
            if finding.check == "reachability" and "never taken" in finding.text:
                seen["hidden", finding.status] += 1
                assert not any(taken(chart, finding.where[0], point) for point in GRID), finding

    attack()
    shown_as = {"determinism": "settled by order", "livelock": "refuted"}
    for check, status in shown_as.items():
        assert min(seen[check, "proved"], seen[check, status]) >= number // 8, seen
    assert seen["hidden", "refuted"] >= number // 16, seen


# --------------------------------------------------------------------------- on a surface
RATES = list(product((-1.0, -0.25, 0.0, 0.75), (-1.0, 0.0, 0.25)))


def on_surface(surface: Value) -> Iterator[dict[str, float]]:
    for point in GRID[:: len(SIGNED)]:
        if point["v"] != 0:  # a flow may jump there
            z = float(evaluate(surface, point))
            yield from ({**point, "z": z, "ds/dt": ds, "dv/dt": dv} for ds, dv in RATES)


def pushed(chart: Chart, surface: Value, point: Mapping[str, float]) -> bool:
    """Return whether each flow leads from the surface into the guard that leaves its state."""
    moments = [after(chart, name, point) for name in ("first", "second")]
    sides = [moment["z"] - evaluate(surface, moment) for moment in moments]
    return (
        point["z"] == evaluate(surface, point)
        and sides[0] * sides[1] < 0
        and all(
            evaluate(chart.guards[edge], moment)
            for edge, moment in zip(("go", "back"), moments, strict=True)
        )
    )


@numbers
def test_chattering_is_confirmed_by_a_short_step_of_each_flow(number: int) -> None:
    seen: Counter[tuple[str, str]] = Counter()

    @settings(max_examples=number, deadline=None, derandomize=True)
    @given(pairs_on_a_surface())
    def attack(chart: Chart) -> None:
        found = prove(chart, ["s > 0", "v_c > 0"])
        count_of(found, seen)
        (finding,) = found.of("chattering")
        surface = parse_value(chart.name, NAMES)
        if finding.status == "refuted":
            example = finding.counterexample
            assert in_domain(example)
            assert pushed(chart, surface, {"v": 1.0, "s": 1.0, "v_c": 1.0, **example}), finding
        elif finding.status == "proved":
            broken = [p for p in on_surface(surface) if pushed(chart, surface, p)]
            assert not broken, (finding, broken[0])

    attack()
    assert min(seen["chattering", status] for status in ("proved", "refuted")) >= number // 8, seen
