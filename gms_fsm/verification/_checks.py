"""The checks of a chart that need no locked state, described in `gms_fsm.verification.prove`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, islice, product
from typing import Any, TypeAlias

from gms_fsm.charts.chart import Chart, Transition
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
from gms_fsm.verification._prover import (
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
from gms_fsm.verification._subject import ChartSubject
from gms_fsm.verification.findings import Finding

MOST_CYCLES = 200  # cycles; a friction chart has a handful
MOST_WAYS = 64  # alternatives per guard


# --------------------------------------------------------------------------- determinism
def determinism(prover: Prover) -> Iterator[Finding]:
    """Check that edges of one state exclude each other, or that their order decides."""
    chart = prover.chart
    for state in chart.states:
        edges = [edge for _, edge in chart.leaving(state.name)]
        if len(edges) < 2:
            yield Finding("determinism", "proved", (state.name,), "fewer than two edges leave it")
        for pair in combinations(edges, 2):
            where = (state.name, *(edge.name for edge in pair))
            yield prover.settle("determinism", where, _at_once, pair)


def _at_once(prover: Prover, pair: Sequence[Transition]) -> Answer:
    reading, first = Reading(), pair[0].name
    guards = [prover.subject.guard(edge) for edge in pair]
    formulas = [reading.truth(guard, prover.still) for guard in guards]
    prover.defined(reading)
    point = prover.example(names_of(*guards), *formulas, *prover.at_rest(pair[0].source))
    if point is None:
        return Answer("proved", "never enabled at the same time")
    if _arrests(prover, pair[0]) and _is_hidden(prover, pair[1], pair[:1]):
        return Answer("proved", f"{pair[1].name} is taken only where the velocity jumps")
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


def _all_around(prover: Prover, cycle: tuple[Transition, ...]) -> Answer:
    subject = prover.subject
    assigned = frozenset(
        name
        for edge in cycle
        for name in (*(name for name, _ in subject.assigned(edge)), *subject.landed(edge))
    )

    def around(passes: int) -> tuple[list[Any], Duals]:
        reading, here = Reading(), dict(prover.still)
        formulas = prover.at_rest(cycle[0].source)
        for edge in cycle * passes:
            formulas.append(reading.truth(subject.guard(edge), here))
            here = after(prover, reading, edge, here)
        prover.defined(reading)
        return formulas, here

    once, end = around(1)
    if prover.find(*once) is None:
        return Answer("proved", "never all enabled at one point")
    closed = [end[name].value == prover.symbols[name] for name in sorted(assigned)]
    names = names_of(*(tree for edge in cycle for tree in subject.trees(edge))) | assigned
    point = prover.example(names, *once, *closed)
    if point is not None:
        text = "all are enabled at one point: endless switching"
        return refuted(text, point, _comes_back(subject, cycle, point))
    if prover.find(*around(2)[0]) is None:
        return Answer("proved", "the assignments end it before a second pass")
    return Answer("undecided", "each pass assigns different values; only two passes were followed")


def after(prover: Prover, reading: Reading, edge: Transition, here: Duals) -> dict[str, Dual]:
    """Return the values after an edge; F and a are those before it."""
    subject = prover.subject
    before = subject.before[edge.source, edge.name].items()
    held = {name: reading.value(tree, here) for name, tree in before}
    there = dict(here)
    for name, tree in subject.assigned(edge):
        there[name] = reading.value(tree, {**there, **held})
    zero = prover.z3.RealVal(0)
    return there | dict.fromkeys(subject.landed(edge), Dual(zero, zero))


def _comes_back(
    subject: ChartSubject, cycle: Sequence[Transition], point: Mapping[str, float]
) -> bool:
    """Return whether the cycle also returns to the same point in floats."""
    here = dict(point)
    for edge in cycle:
        if not enabled([subject.guard(edge)], here):
            return False
        before = subject.before[edge.source, edge.name].items()
        held = {name: evaluate(tree, here) for name, tree in before}
        for name, tree in subject.assigned(edge):
            here[name] = evaluate(tree, {**here, **held})
        here |= dict.fromkeys(subject.landed(edge), 0.0)
    return here == point


# --------------------------------------------------------------------------- reachability
def reachability(prover: Prover) -> Iterator[Finding]:
    """Check that every state can be entered and left, and every guard can hold."""
    chart = prover.chart
    guards = {
        (edge.source, edge.name): prover.settle(
            "reachability",
            (edge.name,) if len(edge.sources) == 1 else (edge.source, edge.name),
            _can_hold,
            edge,
        )
        for edge in chart.transitions
    }
    found = [(edge, guards[edge.source, edge.name].status) for edge in chart.transitions]
    possible = [edge for edge, status in found if status != "refuted"]
    certain = [edge for edge, status in found if status == "proved"]
    entered = _entered(chart, certain), _entered(chart, possible)
    left = {edge.source for edge in certain}, {edge.source for edge in possible}
    for state in chart.states:
        yield _in_graph(state.name, *entered, "it can be entered", "no chain of edges leads to it")
        if len(chart.states) > 1:
            yield _in_graph(state.name, *left, "it can be left", "no edge leaves it")
    yield from guards.values()


def _can_hold(prover: Prover, edge: Transition) -> Answer:
    subject, reading = prover.subject, Reading()
    formulas = [reading.truth(subject.guard(edge), prover.still), *prover.at_rest(edge.source)]
    prover.defined(reading)
    if prover.find(*formulas) is None:
        return Answer("refuted", f"its guard can never hold: {shown(subject.guard(edge))}")
    # Where the velocity has jumped, arrests are not taken.
    earlier = [each for each in _earlier(prover, edge) if not _arrests(prover, each)]
    if _is_hidden(prover, edge, earlier):
        names = ", ".join(each.name for each in earlier)
        text = f"never taken: wherever its guard holds, an earlier edge takes precedence ({names})"
        return Answer("refuted", text)
    return Answer("proved", "its guard can hold")


def _arrests(prover: Prover, edge: Transition) -> bool:
    """Return whether an edge locks the contact where its velocity passes 0."""
    return any(
        prover.chart.transitions[number].name == edge.name for number in prover.chart.arrests
    )


def _earlier(prover: Prover, edge: Transition) -> list[Transition]:
    """Return the edges that leave the same state with precedence."""
    leaving = [each for _, each in prover.chart.leaving(edge.source)]
    return leaving[: [each.name for each in leaving].index(edge.name)]


def _is_hidden(prover: Prover, edge: Transition, earlier: Sequence[Transition]) -> bool:
    """Return whether one of these edges is enabled wherever another one is."""
    subject, reading = prover.subject, Reading()
    formulas = [reading.truth(subject.guard(edge), prover.still), *prover.at_rest(edge.source)]
    formulas += [reading.truth(Not(subject.guard(each)), prover.still) for each in earlier]
    prover.defined(reading)
    return prover.find(*formulas) is None


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
    subject, z3 = prover.subject, prover.z3
    for edge in (there, back):
        arrests = [each for each in _earlier(prover, edge) if _arrests(prover, each)]
        if arrests and _is_hidden(prover, edge, arrests):
            text = f"{edge.name} is taken only where the velocity jumps: {arrests[0].name} has "
            return Answer("proved", f"{text}precedence")
    jumps = subject.assigned(there) or subject.assigned(back)
    guards = [subject.guard(edge) for edge in (there, back)]
    resting = prover.at_rest(there.source, back.source)
    of_flows, of_guards = Reading(), Reading()
    moved = [moving(prover, of_flows, edge.source, prover.still) for edge in (there, back)]
    at_break = z3.Or([u == 0 for u in of_flows.breaks])
    strict, loose = [], []
    for pair in product(*(ways(split(guard)) for guard in guards)):
        if not _at_one_time(prover, [*pair[0], *pair[1]]):
            continue
        if jumps:
            raise Undecided("an edge assigns variables; the flow after a jump is not followed")
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
    names = moving_names(prover, guards, (there.source, back.source))
    point = prover.example(names, z3.Or(strict), *resting, *(u != 0 for u in breaks))
    if point is not None:
        place = _surface(guards[0], point)
        text = f"on {place} each flow pushes into the other's guard: endless switching"
        return refuted(text, point)
    if of_guards.breaks:
        raise Undecided("a value jumps in a guard")
    if prover.find(z3.Or(loose), *resting) is not None:
        raise Undecided("not decided to first order: a flow jumps, or a margin stays at zero")
    return Answer("proved", "there is no surface on which both flows push into the other's guard")


Ways: TypeAlias = list[tuple[Requirement, ...]]


def ways(parts: Split) -> Ways:
    """Return the alternatives under which a split condition holds."""
    if isinstance(parts, Requirement):
        return [(parts,)]
    word, inner = parts
    found = [ways(part) for part in inner]
    if word == "either":
        return [way for some in found for way in some]
    if math.prod(map(len, found)) > MOST_WAYS:
        raise Undecided(f"a guard has more than {MOST_WAYS} alternatives")
    return [tuple(part for way in some for part in way) for some in product(*found)]


def _at_one_time(prover: Prover, parts: Sequence[Requirement]) -> bool:
    """Return whether the comparisons of inputs alone allow both guards.

    Inputs are the same in both states, so both guards must allow them at one time: ``v > v_c`` in
    one and ``abs(v) <= v_c`` in the other is not chattering, though both are about to change at
    v_c.
    """
    variables = {*prover.subject.variables}
    alike = [part.relation for part in parts if not names_in(part.relation) & variables]
    reading = Reading()
    formulas = [reading.truth(relation, prover.still) for relation in alike]
    prover.defined(reading)
    return prover.find(*formulas) is not None


def moving(prover: Prover, reading: Reading, state: str, here: Duals) -> Duals:
    """Return every name with its rate of change in a state, at some values of the names."""
    subject = prover.subject
    rates = {name: prover.rates[f"d{name}/dt"] for name in subject.inputs}
    if "t" in rates:
        rates["t"] = prover.z3.RealVal(1)
    if subject.mobility:
        rates[subject.mobility] = prover.z3.RealVal(0)
    if "x" in rates and (velocity := _velocity(subject)):
        rates["x"] = here[velocity].value
    for name in subject.variables:
        rates[name] = reading.value(subject.flows[state, name], here).value
    return {**here, **{name: Dual(here[name].value, rate) for name, rate in rates.items()}}


def _velocity(subject: ChartSubject) -> str:
    """Return the name of the rate of x; empty if the chart has none."""
    v = subject.chart.velocities[0]
    return v if v in (*subject.inputs, *subject.variables) else ""


def moving_names(
    prover: Prover, guards: Sequence[Condition], states: Sequence[str]
) -> frozenset[str]:
    """Return what decides how guards change in states: their names, rates, and the flows."""
    subject = prover.subject
    flows = [subject.flows[state, name] for state in states for name in subject.variables]
    names = names_of(*guards, *flows)
    steady = {"t", "x", subject.mobility}
    names |= {f"d{name}/dt" for name in names_of(*guards) & {*subject.inputs} - steady}
    return names | (names & {"x"} and frozenset({_velocity(subject)}))


def _surface(guard: Condition, point: Mapping[str, float]) -> str:
    """Describe the surface of a guard on which a point lies."""
    for part in (part.comparison for way in ways(split(guard)) for part in way):
        if evaluate(part.left, point) == evaluate(part.right, point):
            return f"{shown(part.left)} = {shown(part.right)}"
    return f"the surface of {shown(guard)}"


# --------------------------------------------------------------------------- stability
def stability(prover: Prover) -> Iterator[Finding]:
    """Check that no state has an unstable equilibrium."""
    chart = prover.chart
    if not chart.variables:
        yield Finding("stability", "proved", (), "it has no variables")
    for state in chart.states:
        for variable in chart.variables:
            flow = prover.subject.flows[state.name, variable]
            signs = ("v = 0",) if state.locked else ("v > 0", "v < 0", "v = 0")
            for sign in signs if "v" in names_in(flow) else ("",):
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
    names = sorted(names_in(flow) & {*prover.subject.inputs, *chart.parameter_names} - {"v"})
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
