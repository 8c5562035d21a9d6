"""The five checks of a chart, described in `gms_fsm.inspection.prove`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, islice, product
from typing import Any, TypeAlias

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.inspection._findings import Finding
from gms_fsm.inspection._prover import (
    Answer,
    Dual,
    Duals,
    GaveUp,
    Prover,
    Reading,
    Undecided,
    by_example,
    enabled,
    names_of,
    refuted,
    shown,
)
from gms_fsm.language import (
    Condition,
    Not,
    Requirement,
    Split,
    Value,
    evaluate,
    names_in,
    parse_value,
    split,
)

__all__ = ["chattering", "determinism", "livelock", "reachability", "stability"]

MOST_CYCLES = 200  # cycles; a friction chart has a handful
MOST_WAYS = 64  # alternatives per guard


# --------------------------------------------------------------------------- determinism
def determinism(prover: Prover) -> Iterator[Finding]:
    """Check that edges of one state exclude each other, or that their order decides."""
    chart = prover.chart
    for state in chart.states:
        edges = [edge.name for _, edge in chart.leaving(state.name)]
        if len(edges) < 2:
            yield Finding("determinism", "proved", (state.name,), "fewer than two edges leave it")
        for pair in combinations(edges, 2):
            guards = [chart.guards[edge] for edge in pair]
            yield prover.settle("determinism", (state.name, *pair), _at_once, guards, pair[0])


def _at_once(prover: Prover, guards: Sequence[Condition], first: str) -> Answer:
    reading = Reading()
    formulas = [reading.truth(guard, prover.still) for guard in guards]
    prover.defined(reading)
    point = prover.example(names_of(*guards), *formulas)
    if point is None:
        return Answer("proved", "never enabled at the same time")
    text = f"both are enabled at the same time; the machine takes the earlier, {first}"
    return by_example("settled by order", text, point, enabled(guards, point))


# --------------------------------------------------------------------------- livelock
def livelock(prover: Prover) -> Iterator[Finding]:
    """Check that no cycle of edges is enabled at one point."""
    cycles = list(islice(_cycles(prover.chart), MOST_CYCLES + 1))
    if not cycles:
        yield Finding("livelock", "proved", (), "the edges form no cycle")
    for cycle in cycles[:MOST_CYCLES]:
        where = tuple(name for edge in cycle for name in (edge.source, edge.name))
        yield prover.settle("livelock", where, _all_around, cycle)
    if len(cycles) > MOST_CYCLES:
        text = f"more than {MOST_CYCLES} cycles; the others were not checked"
        yield Finding("livelock", "undecided", (), text)


def _cycles(chart: Chart) -> Iterator[tuple[Transition, ...]]:
    """Yield every cycle of edges that passes no state twice."""

    def extend(path: tuple[Transition, ...], first: int) -> Iterator[tuple[Transition, ...]]:
        passed = {chart.state_index(edge.source) for edge in path}
        for _, edge in chart.leaving(path[-1].target if path else chart.states[first].name):
            target = chart.state_index(edge.target)
            if target == first:
                yield (*path, edge)
            elif target > first and target not in passed:  # each cycle once, from its first state
                yield from extend((*path, edge), first)

    for first in range(len(chart.states)):
        yield from extend((), first)


def _assigned(chart: Chart, edge: Transition) -> list[tuple[str, Value]]:
    """Return the assignments of an edge in the order of execution."""
    places = (("exit", edge.source), ("action", edge.name), ("entry", edge.target))
    return [item for place in places for item in chart.assignments[place].items()]


def _all_around(prover: Prover, cycle: tuple[Transition, ...]) -> Answer:
    chart = prover.chart
    steps = [step for edge in cycle for step in _assigned(chart, edge)]
    assigned = frozenset(name for name, _ in steps)
    guards = [chart.guards[edge.name] for edge in cycle]

    def around(passes: int) -> tuple[list[Any], Duals]:
        reading, formulas, here = Reading(), [], dict(prover.still)
        for edge in cycle * passes:
            formulas.append(reading.truth(chart.guards[edge.name], here))
            for name, tree in _assigned(chart, edge):
                here[name] = reading.value(tree, here)
        prover.defined(reading)
        return formulas, here

    once, end = around(1)
    if prover.find(*once) is None:
        return Answer("proved", "never all enabled at one point")
    closed = [end[name].value == prover.symbols[name] for name in sorted(assigned)]
    names = names_of(*guards, *(tree for _, tree in steps)) | assigned
    point = prover.example(names, *once, *closed)
    if point is not None:
        text = "all are enabled at one point: endless switching"
        return refuted(text, point, _comes_back(chart, cycle, point))
    if prover.find(*around(2)[0]) is None:
        return Answer("proved", "the assignments end it before a second pass")
    return Answer("undecided", "each pass assigns different values; only two passes were followed")


def _comes_back(chart: Chart, cycle: Sequence[Transition], point: Mapping[str, float]) -> bool:
    """Return whether the cycle also returns to the same point in floats."""
    here = dict(point)
    for edge in cycle:
        if not enabled([chart.guards[edge.name]], here):
            return False
        for name, tree in _assigned(chart, edge):
            here[name] = evaluate(tree, here)
    return here == point


# --------------------------------------------------------------------------- reachability
def reachability(prover: Prover) -> Iterator[Finding]:
    """Check that every state can be entered and left, and every guard can hold."""
    chart = prover.chart
    guards = {
        edge.name: prover.settle("reachability", (edge.name,), _can_hold, edge)
        for edge in chart.transitions
    }
    possible = [e for e in chart.transitions if guards[e.name].status != "refuted"]
    certain = [e for e in possible if guards[e.name].status == "proved"]
    entered = _entered(chart, certain), _entered(chart, possible)
    left = {edge.source for edge in certain}, {edge.source for edge in possible}
    for state in chart.states:
        yield _in_graph(state.name, *entered, "it can be entered", "no chain of edges leads to it")
        if len(chart.states) > 1:
            yield _in_graph(state.name, *left, "it can be left", "no edge leaves it")
    yield from guards.values()


def _can_hold(prover: Prover, edge: Transition) -> Answer:
    chart, reading = prover.chart, Reading()
    formula = reading.truth(chart.guards[edge.name], prover.still)
    prover.defined(reading)
    if prover.find(formula) is None:
        return Answer("refuted", f"its guard can never hold: {shown(chart.guards[edge.name])}")
    earlier = []
    for _, other in chart.leaving(edge.source):
        if other.name == edge.name:
            break
        earlier.append(other.name)
    hidden = [reading.truth(Not(chart.guards[name]), prover.still) for name in earlier]
    prover.defined(reading)
    if prover.find(formula, *hidden) is None:
        names = ", ".join(earlier)
        text = f"never taken: wherever its guard holds, an earlier edge takes precedence ({names})"
        return Answer("refuted", text)
    return Answer("proved", "its guard can hold")


def _entered(chart: Chart, edges: Sequence[Transition]) -> set[str]:
    found = {chart.default_state.name}
    while fresh := {e.target for e in edges if e.source in found} - found:
        found |= fresh
    return found


def _in_graph(state: str, certain: set[str], possible: set[str], yes: str, no: str) -> Finding:
    if state in certain:
        return Finding("reachability", "proved", (state,), yes)
    if state in possible:
        text = f"perhaps {no}: a guard is undecided"
        return Finding("reachability", "undecided", (state,), text)
    return Finding("reachability", "refuted", (state,), no)


# --------------------------------------------------------------------------- chattering
def chattering(prover: Prover) -> Iterator[Finding]:
    """Check that no two flows push toward each other across a guard surface."""
    pairs = [
        (there, back)
        for there, back in combinations(prover.chart.transitions, 2)
        if there.source == back.target != there.target == back.source
    ]
    if not pairs:
        yield Finding("chattering", "proved", (), "no two states have edges in both directions")
    for there, back in pairs:
        where = (there.source, there.name, back.source, back.name)
        yield prover.settle("chattering", where, _pushed, there, back)


def _pushed(prover: Prover, there: Transition, back: Transition) -> Answer:
    """Search for a point at which each flow pushes into the guard that leaves its state.

    A comparison is on its surface where its margin is zero. Each guard needs one such comparison,
    whose margin grows under its own flow and falls under the other; its other margins must be
    positive, or zero and growing. A margin at rest at zero, or a point where a flow jumps, is not
    decided to first order.
    """
    chart, z3 = prover.chart, prover.z3
    if _assigned(chart, there) or _assigned(chart, back):
        raise Undecided("an edge assigns variables; the flow after a jump is not followed")
    guards = [chart.guards[edge.name] for edge in (there, back)]
    of_flows, of_guards = Reading(), Reading()
    moved = [_moved(prover, of_flows, edge.source) for edge in (there, back)]
    at_break = z3.Or([u == 0 for u in of_flows.breaks])
    strict, loose = [], []
    for pair in product(*(_ways(split(guard)) for guard in guards)):
        if not _at_one_time(prover, [*pair[0], *pair[1]]):
            continue
        crossed, touched, growing, not_falling, reached = [], [], [], [], []
        for way, own, other in zip(pair, moved, reversed(moved), strict=True):
            here = [of_guards.margin(part, own) for part in way]
            across = [of_guards.margin(part, other).slope for part in way]
            turning = zip(here, across, strict=True)
            crossed.append(z3.Or([z3.And(m.value == 0, m.slope > 0, n < 0) for m, n in turning]))
            touched.append(z3.Or([m.value == 0 for m in here]))
            growing += [z3.Or(m.value > 0, z3.And(m.value == 0, m.slope > 0)) for m in here]
            not_falling += [z3.Or(m.value > 0, z3.And(m.value == 0, m.slope >= 0)) for m in here]
            reached += [m.value >= 0 for m in here]
        strict.append(z3.And(*crossed, *growing))
        loose += [z3.And(*crossed, *not_falling), z3.And(at_break, *touched, *reached)]
    if not strict:
        return Answer("proved", "their guards never become true at the same place and time")
    breaks = [*of_flows.breaks, *of_guards.breaks]
    prover.defined(of_flows)
    prover.defined(of_guards)
    flows = [chart.flows[edge.source, x] for edge in (there, back) for x in chart.variables]
    names = names_of(*guards, *flows)
    names |= {f"d{name}/dt" for name in names_of(*guards) & {*chart.inputs} - {"t", "x"}}
    names |= names & {"x"} and {"v"} & {*chart.inputs}
    point = prover.example(names, z3.Or(strict), *(u != 0 for u in breaks))
    if point is not None:
        place = _surface(guards[0], point)
        text = f"on {place} each flow pushes into the other's guard: endless switching"
        return refuted(text, point)
    if of_guards.breaks:
        raise Undecided("sgn jumps in a guard")
    if prover.find(z3.Or(loose)) is not None:
        raise Undecided("not decided to first order: a flow jumps, or a margin stays at zero")
    return Answer("proved", "there is no surface on which both flows push into the other's guard")


Ways: TypeAlias = list[tuple[Requirement, ...]]


def _ways(parts: Split) -> Ways:
    """Return the alternatives under which a split condition holds."""
    if isinstance(parts, Requirement):
        return [(parts,)]
    word, inner = parts
    ways = [_ways(part) for part in inner]
    if word == "either":
        return [way for some in ways for way in some]
    if math.prod(map(len, ways)) > MOST_WAYS:
        raise Undecided(f"a guard has more than {MOST_WAYS} alternatives")
    return [tuple(part for way in some for part in way) for some in product(*ways)]


def _at_one_time(prover: Prover, parts: Sequence[Requirement]) -> bool:
    """Return whether the comparisons of inputs alone allow both guards.

    Inputs are the same in both states, so both guards must allow them at one time: ``v > v_c`` in
    one and ``abs(v) <= v_c`` in the other is not chattering, though both are about to change at
    v_c.
    """
    variables = {*prover.chart.variables}
    alike = [part.relation for part in parts if not names_in(part.relation) & variables]
    reading = Reading()
    formulas = [reading.truth(relation, prover.still) for relation in alike]
    prover.defined(reading)
    return prover.find(*formulas) is not None


def _moved(prover: Prover, reading: Reading, state: str) -> Duals:
    """Return every name with its rate of change in a state."""
    chart, symbols = prover.chart, prover.symbols
    rates = {name: prover.rates[f"d{name}/dt"] for name in chart.inputs}
    if "t" in rates:
        rates["t"] = prover.z3.RealVal(1)
    if {"x", "v"} <= {*rates}:
        rates["x"] = symbols["v"]
    for name in chart.variables:
        rates[name] = reading.value(chart.flows[state, name], prover.still).value
    return {**prover.still, **{name: Dual(symbols[name], rate) for name, rate in rates.items()}}


def _surface(guard: Condition, point: Mapping[str, float]) -> str:
    """Describe the surface of a guard on which a point lies."""
    for part in (part.comparison for way in _ways(split(guard)) for part in way):
        if evaluate(part.left, point) == evaluate(part.right, point):
            return f"{shown(part.left)} = {shown(part.right)}"
    return f"the surface of {shown(guard)}"


# --------------------------------------------------------------------------- stability
def stability(prover: Prover) -> Iterator[Finding]:
    """Check that no state has an unstable equilibrium."""
    chart = prover.chart
    for state in chart.states:
        for variable in chart.variables:
            flow = chart.flows[state.name, variable]
            by_sign = "v" in names_in(flow) & {*chart.inputs}
            for sign in ("v > 0", "v < 0", "v = 0") if by_sign else ("",):
                yield prover.settle(
                    "stability",
                    (state.name,),
                    _equilibrium,
                    flow,
                    variable,
                    sign,
                    case=f"{variable} for {sign}" if sign else variable,
                )


def _equilibrium(prover: Prover, flow: Value, variable: str, sign: str) -> Answer:
    if others := sorted(names_in(flow) & {*prover.chart.variables} - {variable}):
        raise Undecided(f"the flow also depends on {', '.join(others)}")
    case = []
    if sign:
        v = prover.symbols["v"]
        case = [{"v > 0": v > 0, "v < 0": v < 0, "v = 0": v == 0}[sign]]

    def at(place: Any) -> Dual:
        reading, one = Reading(), prover.z3.RealVal(1)
        value = reading.value(flow, {**prover.still, variable: Dual(place, one)})
        prover.defined(reading, *case)
        return value

    here, elsewhere = prover.symbols[variable], prover.z3.Real(f"{variable}'")
    rate, slope = at(here).value, at(here).slope
    if prover.find(*case, at(elsewhere).value != rate + slope * (elsewhere - here)) is not None:
        raise Undecided(f"the flow is not linear in {variable}")
    point = prover.example(names_in(flow) | {variable}, *case, rate == 0, slope > 0)
    if point is not None:
        place = _place(prover, flow, variable, case)
        return refuted(f"unstable: {variable} moves away from {place}", point)
    if prover.find(*case, rate == 0) is None:
        return Answer("proved", f"no equilibrium: d{variable}/dt is never 0")
    if prover.find(*case, slope >= 0) is None:
        return Answer("proved", f"stable: {_place(prover, flow, variable, case)} attracts")
    if prover.find(*case, rate != 0) is None:
        return Answer("proved", f"neutral: {variable} stays where it is")
    return Answer("proved", "no equilibrium is unstable; some are neutral")


def _place(prover: Prover, flow: Value, variable: str, case: Sequence[Any]) -> str:
    """Describe the equilibrium of a flow, if a short text can."""
    chart = prover.chart
    names = sorted(names_in(flow) & {*chart.inputs, *chart.parameter_names} - {"v"})
    simple = ["0", *names, *(f"{a} / {b}" for a in names for b in names if a != b)]
    for text in (sign + text for text in simple for sign in ("", "-")):
        reading = Reading()
        try:
            place = reading.value(parse_value(text, names), prover.still)
            rate = reading.value(flow, {**prover.still, variable: place}).value
            prover.defined(reading, *case)
            if prover.find(*case, rate != 0) is None:
                return f"{variable} = {text}"
        except GaveUp:
            break
        except Undecided:
            continue
    return "its equilibrium"
