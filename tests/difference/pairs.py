"""Random pairs of charts: the same written differently, and mutants that do something else."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

from gms_fsm import Chart, Parameter, State, Transition
from gms_fsm.language import (
    Binary,
    Both,
    Condition,
    Either,
    Negative,
    Not,
    Number,
    Relation,
    Value,
    evaluate,
    parse_condition,
    parse_value,
    spell,
)

__all__ = ["MUTATIONS", "Pair", "disguised", "equivalent_pair", "mutant_pair"]

LEFT = ("z", "abs(z)", "v", "abs(v)", "z * v", "z + v", "w", "sgn(v) * z", "z - w", "F", "a")
RIGHT = ("s", "-s", "v_c", "-v_c", "0", "1", "0.5 * s", "s + v_c", "-0.5", "k * w")
FLOWS = ("v", "0", "1 - z / s", "sgn(v) - z / s", "-v", "abs(v)", "z * v", "k * v", "v - w")
SLOW = ("0", "z - w", "abs(v) - w", "k * z", "-w")
FORCES = ("k * z", "k * z + v_c * dz", "z + w", "k * (z - w)")
ACTIONS: tuple[dict[str, str], ...] = ({}, {}, {}, {"z": "0"}, {"z": "-z"}, {"w": "z + 1"})
OPPOSITE = {"<": ">", ">": "<", "<=": ">=", ">=": "<="}
COMPLEMENT = {"<": ">=", ">": "<=", "<=": ">", ">=": "<"}
INPUTS = ("v", "s")
Rewrite: TypeAlias = Callable[[Value | Condition], str]


@dataclass(frozen=True)
class Pair:
    """Two charts, and how the second was made of the first."""

    a: Chart
    b: Chart
    how: str


# --------------------------------------------------------------------------- a chart
def _clause(dice: random.Random) -> str:
    text = f"{dice.choice(LEFT)} {dice.choice(('<', '<=', '>', '>='))} {dice.choice(RIGHT)}"
    return dice.choice((text, text, f"not {text}", f"({text} or {dice.choice(LEFT)} > 0.5)"))


def made(seed: int) -> Chart:
    """Return a chart of two or three states, two variables, two parameters."""
    dice = random.Random(seed)
    names = ["rest", "go", "turn"][: dice.choice((2, 3))]
    edges = []
    for i in range(dice.randint(2, 6)):
        source, target = dice.sample(names, 2)
        guard = " and ".join(_clause(dice) for _ in range(dice.choice((1, 2, 2, 3))))
        if dice.random() < 0.2:
            guard = f"after(0.5) and {guard}"
        emit = ("ping",) if dice.random() < 0.1 else ()
        event = "pong" if dice.random() < 0.1 else ""
        edges.append(
            Transition(f"e{i}", source, target, guard, dice.choice(ACTIONS), event=event, emit=emit)
        )
    if dice.random() < 0.5:  # two edges that are never enabled at once
        edges += [
            Transition("up", names[0], names[1], "z > s", {"w": "0"}),
            Transition("down", names[0], names[-1], "z < -s"),
        ]
    states = [
        State(
            name,
            {"z": dice.choice(FLOWS), "w": dice.choice(SLOW)},
            entry={"w": "0.5 * w"} if dice.random() < 0.2 else {},
            outputs={"F": dice.choice(FORCES)} if dice.random() < 0.3 else {},
        )
        for name in names
    ]
    units = dice.choice((("N/m", "m/s"), ("", "")))
    return Chart(
        f"random {seed}",
        INPUTS,
        ("z", "w"),
        [Parameter(name, unit, "> 0") for name, unit in (("k", units[0]), ("v_c", units[1]))],
        states,
        edges,
        {"F": dice.choice(FORCES)},
        initial={"z": dice.choice((0.0, 0.25))},
    )


# --------------------------------------------------------------------------- written anew
def _known(chart: Chart) -> list[str]:
    rates = [f"d{name}" for name in chart.variables]
    return [*INPUTS, *chart.variables, *chart.parameter_names, "F", "a", *rates, "age"]


def _remade(
    chart: Chart,
    *,
    value: Rewrite = spell,
    guard: Rewrite = spell,
    called: Mapping[str, str] | None = None,
    order: Callable[[list[Transition]], list[Transition]] = list,
    states: Callable[[list[State]], list[State]] = list,
) -> Chart:
    """Return a chart whose texts are written by functions, with other names."""
    new, known = called or {}, _known(chart)

    def name(old: str) -> str:
        return new.get(old, old)

    def text(given: str) -> str:
        return value(parse_value(given, known))

    def texts(given: Mapping[str, str]) -> dict[str, str]:
        return {name(each): text(one) for each, one in given.items()}

    made_states = [
        State(name(s.name), texts(s.flow), texts(s.entry), texts(s.exit), texts(s.outputs))
        for s in states([*chart.nesting.states])
    ]
    edges = [
        Transition(
            name(e.name),
            name(e.source),
            name(e.target),
            guard(parse_condition(e.guard, known)),
            texts(e.actions),
            event=e.event,
            emit=e.emit,
        )
        for e in order([*chart.nesting.transitions])
    ]
    return Chart(
        chart.name,
        chart.inputs,
        [name(each) for each in chart.variables if each not in chart.hidden],
        [replace(each, name=name(each.name)) for each in chart.parameters],
        made_states,
        edges,
        texts(chart.outputs),
        initial={name(each): u for each, u in chart.initial.items()},
    )


def _turned(dice: random.Random, called: Mapping[str, str]) -> tuple[Rewrite, Rewrite]:
    """Return functions that write values and guards differently, with the same meaning."""

    def value(tree: Value) -> Value:
        match tree:
            case Binary("+" | "*" as op, a, b):
                a, b = value(a), value(b)
                return Binary(op, b, a) if dice.random() < 0.5 else Binary(op, a, b)
            case Binary("-", a, b) if dice.random() < 0.3:
                return Binary("+", Negative(value(b)), value(a))
            case Binary(op, a, b):
                return Binary(op, value(a), value(b))
            case Negative(a):
                return Negative(value(a))
        return tree

    def truth(tree: Condition) -> Condition:
        match tree:
            case Relation(op, a, b):
                here = dice.random()
                if here < 0.3:
                    return Relation(OPPOSITE[op], value(b), value(a))
                if here < 0.5:
                    return Not(Relation(COMPLEMENT[op], value(a), value(b)))
                if here < 0.6:
                    return Relation(op, Binary("-", value(a), value(b)), Number(0.0))
                return Relation(op, value(a), value(b))
            case Not(Both(parts)):
                return Either(tuple(Not(truth(each)) for each in parts))
            case Not(Either(parts)):
                return Both(tuple(Not(truth(each)) for each in parts))
            case Not(Relation(op, a, b)) if dice.random() < 0.5:
                return truth(Relation(COMPLEMENT[op], a, b))
            case Not(operand):
                return Not(truth(operand))
            case Both(parts):
                some = [truth(each) for each in parts]
                dice.shuffle(some)
                if some and dice.random() < 0.3:
                    return Not(Either(tuple(Not(each) for each in some)))
                return Both(tuple(some))
            case Either(parts):
                return Either(tuple(truth(each) for each in reversed(parts)))
        return tree

    def write(change: Callable[..., Value | Condition]) -> Rewrite:
        every = {**called, **{f"d{old}": f"d{new}" for old, new in called.items()}}
        return lambda tree: spell(change(tree), rename=every)

    return write(value), write(truth)


def disguised(chart: Chart, dice: random.Random) -> Chart:
    """Return a chart that does the same: renamed, reordered, written differently."""
    names = ["z", "w", "k", "v_c", *(s.name for s in chart.states)]
    names += list(dict.fromkeys(e.name for e in chart.transitions))
    called = {name: f"{name[0]}x{i}" for i, name in enumerate(names) if dice.random() < 0.6}
    value, guard = _turned(dice, called)

    def order(edges: list[Transition]) -> list[Transition]:
        mine = {e.name: [o for o in edges if o.source == e.source] for e in edges}
        found = list(edges)
        for i in range(len(found) - 1):  # neighbours of different states, or never both enabled
            one, other = found[i], found[i + 1]
            apart = {one.name, other.name} == {"up", "down"}
            if (other not in mine[one.name] or apart) and dice.random() < 0.5:
                found[i : i + 2] = [other, one]
        return found

    def states(given: list[State]) -> list[State]:
        rest = given[1:]
        dice.shuffle(rest)
        return [given[0], *rest]

    return _remade(chart, value=value, guard=guard, called=called, order=order, states=states)


def equivalent_pair(seed: int) -> Pair:
    """Return a chart and the same in other words."""
    dice = random.Random(f"same {seed}")
    chart = made(seed)
    return Pair(chart, disguised(chart, dice), "disguised")


# --------------------------------------------------------------------------- mutants
def _edge_changed(chart: Chart, dice: random.Random, change: Callable[..., Transition]) -> Chart:
    edges = [*chart.nesting.transitions]
    place = dice.randrange(len(edges))
    edges[place] = change(edges[place])
    return _with(chart, edges=edges)


def _with(
    chart: Chart, *, edges: list[Transition] | None = None, states: list[State] | None = None
) -> Chart:
    return Chart(
        chart.name,
        chart.inputs,
        ("z", "w"),
        chart.parameters,
        [*chart.nesting.states] if states is None else states,
        [*chart.nesting.transitions] if edges is None else edges,
        chart.outputs,
        initial=chart.initial,
    )


def _guarded(edge: Transition, guard: str) -> Transition:
    return Transition(
        edge.name, edge.source, edge.target, guard, edge.actions, event=edge.event, emit=edge.emit
    )


def _operator(chart: Chart, dice: random.Random) -> Chart:
    def change(edge: Transition) -> Transition:
        words = edge.guard.split(" ")
        places = [i for i, word in enumerate(words) if word in OPPOSITE]
        place = dice.choice(places)
        words[place] = dice.choice([op for op in OPPOSITE if op != words[place]])
        return _guarded(edge, " ".join(words))

    return _edge_changed(chart, dice, change)


def _constant(chart: Chart, dice: random.Random) -> Chart:
    def change(edge: Transition) -> Transition:
        return _guarded(edge, f"{edge.guard} and z < {dice.choice((3, 0.75))}")

    return _edge_changed(chart, dice, change)


def _dropped(chart: Chart, dice: random.Random) -> Chart:
    def change(edge: Transition) -> Transition:
        parts = edge.guard.split(" and ")
        parts.pop(dice.randrange(len(parts)))
        return _guarded(edge, " and ".join(parts) or "True")

    return _edge_changed(chart, dice, change)


def _target(chart: Chart, dice: random.Random) -> Chart:
    names = [state.name for state in chart.states]

    def change(edge: Transition) -> Transition:
        other = dice.choice([name for name in names if name != edge.target])
        return replace_target(edge, other)

    return _edge_changed(chart, dice, change)


def replace_target(edge: Transition, target: str) -> Transition:
    """Return an edge that enters another state."""
    return Transition(
        edge.name, edge.source, target, edge.guard, edge.actions, event=edge.event, emit=edge.emit
    )


def _swapped(chart: Chart, dice: random.Random) -> Chart:
    edges = [*chart.nesting.transitions]
    i, k = sorted(dice.sample(range(len(edges)), 2))
    edges[i], edges[k] = edges[k], edges[i]
    return _with(chart, edges=edges)


def _flow(chart: Chart, dice: random.Random) -> Chart:
    states = [*chart.nesting.states]
    place = dice.randrange(len(states))
    old = states[place]
    flow = {**old.flow, "z": f"{old.flow['z']} + {dice.choice(('0.001', 'w', 's'))}"}
    states[place] = State(old.name, flow, old.entry, old.exit, old.outputs)
    return _with(chart, states=states)


def _action(chart: Chart, dice: random.Random) -> Chart:
    def change(edge: Transition) -> Transition:
        actions = {**edge.actions, "z": "z + 1"}
        return Transition(
            edge.name, edge.source, edge.target, edge.guard, actions, event=edge.event,
            emit=edge.emit,
        )  # fmt: skip

    return _edge_changed(chart, dice, change)


def _emitted(chart: Chart, dice: random.Random) -> Chart:
    def change(edge: Transition) -> Transition:
        emit = () if edge.emit else ("ping",)
        return Transition(
            edge.name, edge.source, edge.target, edge.guard, edge.actions, event=edge.event,
            emit=emit,
        )  # fmt: skip

    return _edge_changed(chart, dice, change)


MUTATIONS: Mapping[str, Callable[[Chart, random.Random], Chart]] = {
    "operator": _operator,
    "constant": _constant,
    "dropped clause": _dropped,
    "target": _target,
    "swapped edges": _swapped,
    "flow": _flow,
    "action": _action,
    "emitted event": _emitted,
}


def _point(dice: random.Random) -> dict[str, float]:
    simple = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
    point = {name: dice.choice((1, -1)) * dice.choice(simple) for name in ("z", "w", "v", "F", "a")}
    point |= {name: dice.choice(simple[1:]) for name in ("s", "k", "v_c")}
    return point | {"age": dice.choice(simple), "event__pong": dice.choice((0.0, 1.0))}


def _does(chart: Chart, state: str, point: Mapping[str, float]) -> object:
    """Return what a chart does in a state at a point, evaluated in floats."""
    rates = {name: evaluate(chart.flows[state, name], point) for name in ("z", "w")}
    tree = chart.forces[state, "F"]
    assert tree is not None
    force = evaluate(tree, {**point, **{f"d{name}": u for name, u in rates.items()}})
    for _, edge in chart.leaving(state):
        if evaluate(chart.guards[edge.name], point):
            after = dict(point)
            for name, value in chart.assigned(edge):
                after[name] = evaluate(value, after)
            kept = {name: after[name] for name in ("z", "w")}
            return rates, force, edge.target, kept, sorted(edge.emit)
    return rates, force, None


def differs(a: Chart, b: Chart, dice: random.Random) -> bool:
    """Return whether two charts with the same names do something else at some point."""
    states = [state.name for state in a.states]
    return any(
        _does(a, state, point) != _does(b, state, point)
        for point in (_point(dice) for _ in range(300))
        for state in states
    )


def mutant_pair(seed: int) -> Pair:
    """Return a chart and a mutant of it that does something else, as points show.

    Half of the mutants are disguised.
    """
    dice = random.Random(f"mutant {seed}")
    chart = made(seed)
    while True:
        how = dice.choice([*MUTATIONS])
        mutant = MUTATIONS[how](chart, dice)
        if differs(chart, mutant, dice):
            break
    if dice.random() < 0.5:
        return Pair(chart, disguised(mutant, dice), f"{how}, disguised")
    return Pair(chart, mutant, how)
