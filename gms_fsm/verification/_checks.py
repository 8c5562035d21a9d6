"""The checks of a chart that need no locked state, described in `gms_fsm.verification.prove`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, islice
from typing import Any

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.language import (
    Value,
    names_in,
    parse_value,
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
from gms_fsm.verification._switching import (
    after,
    by_turns,
    changed,
    earlier,
    endless,
    follow_impulses,
    interrupted,
    is_hidden,
    may_change,
    others,
    others_switch,
    read_by,
    untaken,
)
from gms_fsm.verification.findings import Finding

MOST_CYCLES = 200  # cycles; a friction chart has a handful


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
    point = prover.example(names_of(*guards), *formulas, *prover.within(pair[0].source))
    if point is None:
        return Answer("proved", "never enabled at the same time")
    if prover.subject.arrests(pair[0]) and is_hidden(prover, pair[1], pair[:1]):
        return Answer("proved", f"{pair[1].name} is taken only where the velocity jumps")
    text = f"both are enabled at the same time; the machine takes the earlier, {first}"
    return by_example("settled by order", text, point, enabled(guards, point))


# --------------------------------------------------------------------------- livelock
def livelock(prover: Prover) -> Iterator[Finding]:
    """Check that no cycle of edges is enabled at one point."""
    if prover.subject.facts.period is not None:
        yield Finding("livelock", "proved", (), "a machine takes at most one edge at each tick")
        return
    cycles = list(islice(_cycles(prover.chart), MOST_CYCLES + 1))
    if not cycles:
        yield Finding("livelock", "proved", (), "the edges form no cycle")
        return
    passable: list[tuple[Transition, ...]] = []
    found = []
    # Elements that share a force switch together, so that no one of them can be followed alone.
    shared = prover.subject.rest and prover.subject.shared
    for cycle in cycles[:MOST_CYCLES] if not shared else ():
        where = tuple(name for edge in cycle for name in (edge.source, edge.name))
        found.append(prover.settle("livelock", where, _all_around, cycle, passable))
    yield from found
    if len(cycles) > MOST_CYCLES:
        text = f"more than {MOST_CYCLES} cycles; the others were not checked"
        yield Finding("livelock", "undecided", (), text)
    elif not any(each.status == "refuted" for each in found) and (
        may_change(prover) or _crossed(passable, cycles)
    ):
        yield prover.settle("livelock", (), _at_one_instant, cycles)


def _crossed(
    passable: Sequence[tuple[Transition, ...]], cycles: Sequence[tuple[Transition, ...]]
) -> bool:
    """Return whether a cycle that can be passed shares a state with another one."""
    states = [{edge.source for edge in cycle} for cycle in cycles]
    return any(
        sum(bool({edge.source for edge in cycle} & other) for other in states) > 1
        for cycle in passable
    )


def _at_one_instant(prover: Prover, cycles: Sequence[tuple[Transition, ...]]) -> Answer:
    """Follow what cycles do by turns, several elements together, or beside other contacts."""
    facts, several = prover.subject.facts, may_change(prover)
    if several and (answer := interrupted(prover, cycles)) is not None:
        return answer
    if several and others_switch(prover):
        return Answer("undecided", f"{others(prover)} at the same instant are not followed")
    return by_turns(prover, facts.n if several else 1)


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


def _all_around(
    prover: Prover, cycle: tuple[Transition, ...], passable: list[tuple[Transition, ...]]
) -> Answer:
    """Search for a point at which a cycle is taken, again and again; others stay as they are.

    A cycle that can be passed at least once is added to `passable`.
    """
    subject = prover.subject
    assigned = changed(subject, cycle)

    def around(passes: int, certain: bool | None) -> tuple[list[Any], Duals]:
        reading, here = Reading(), dict(prover.still)
        formulas = prover.within(cycle[0].source)
        for edge in cycle * passes:
            formulas.append(reading.truth(subject.guard(edge), here))
            if certain is not None:
                formulas += untaken(prover, edge, here, certain)
            here = after(prover, reading, edge, here)
        prover.defined(reading)
        return formulas, here

    if prover.find(*around(1, certain=None)[0]) is None:
        return Answer("proved", "never all enabled at one point")
    if prover.find(*around(1, certain=True)[0]) is None:
        text = "never all taken at one point: an earlier edge takes precedence"
        return Answer("proved", text)
    passable.append(cycle)
    once, end = around(1, certain=False)
    closed = [end[name].value == prover.symbols[name] for name in sorted(assigned)]
    names = read_by(subject, cycle) | assigned
    point = prover.example(names, *once, *closed)
    if point is not None:
        follow_impulses(subject, cycle)
        text = "all are enabled at one point: endless switching"
        return refuted(text, point, endless(subject, [cycle[0].source], [point]))
    if prover.find(*around(2, certain=True)[0]) is None:
        return Answer("proved", "the assignments end it before a second pass")
    if prover.find(*once) is None:
        raise Undecided("an earlier arrest ends it, except where the velocity jumps")
    return Answer("undecided", "each pass assigns different values; only two passes were followed")


# --------------------------------------------------------------------------- reachability
def reachability(prover: Prover) -> Iterator[Finding]:
    """Check that every state can be entered and left, and every guard can hold."""
    chart = prover.chart
    guards = {
        (edge.source, edge.name): prover.settle(
            "reachability",
            (edge.name,) if len(edge.sources) == 1 else (edge.source, edge.name),
            can_hold,
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


def can_hold(prover: Prover, edge: Transition) -> Answer:
    """Return whether an edge can ever be taken."""
    subject, reading = prover.subject, Reading()
    formulas = [
        reading.truth(subject.guard(edge), prover.still),
        *prover.within(edge.source, waits=False),
    ]
    prover.defined(reading)
    if prover.find(*formulas) is None:
        return Answer("refuted", f"its guard can never hold: {shown(subject.guard(edge))}")
    formulas += prover.within(edge.source)
    if prover.find(*formulas) is None:
        waits = [each.name for each, _ in subject.waits(edge.source) if each.name != edge.name]
        first = ", ".join(dict.fromkeys(waits))
        return Answer("refuted", f"never taken: {first} ends each stay in {edge.source} before")
    prover.apart(names_of(subject.guard(edge)))
    # Where the velocity has jumped, arrests are not taken.
    before = [each for each in earlier(subject, edge) if not subject.arrests(each)]
    if is_hidden(prover, edge, before):
        names = ", ".join(each.name for each in before)
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


# --------------------------------------------------------------------------- stability
def stability(prover: Prover) -> Iterator[Finding]:
    """Check that no state has an unstable equilibrium."""
    chart = prover.chart
    variables = [name for name in chart.variables if name in prover.subject.variables]
    if not variables:
        yield Finding("stability", "proved", (), "it has no variables")
    for state in chart.states:
        for variable in variables:
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
