"""A chart as the checks read it: named expressions expanded, F and a written out.

The checks see a chart alone, without bodies. For a chart that reads F or a, locks the contact, or
sets its velocity, two free quantities stand for the rest of the system: H, the force that would
hold v where it is, and W > 0, the inverse of the inertia that the contact feels. Then
``a = (H - F) W`` while the contact moves, and ``F = H``, ``a = 0``, ``v = 0`` while it is locked;
v is a variable whose rate is a. With several elements, F is the sum over them: R, the force of
the others, is one that their states give. A model's viscous force is part of F.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.nesting import AGE
from gms_fsm.charts.reader import called
from gms_fsm.language import (
    Binary,
    Condition,
    Either,
    Name,
    Number,
    Relation,
    Value,
    names_in,
    renamed,
)
from gms_fsm.language.normal import renamed_in
from gms_fsm.verification.facts import ContactFacts

ZERO = Number(0.0)


@dataclass(frozen=True, eq=False)
class ChartSubject:
    """A chart as the checks read it.

    Parameters
    ----------
    chart : Chart
        The chart.
    moves : bool
        Whether F, a or a velocity takes part, so that H and W stand for the rest of the system.
    inputs, variables : tuple of str
        The chart's, with H and W, and with the velocities as variables, where it moves.
    guards : mapping of (str, str) to Condition
        By source and name of an edge.
    steps : mapping of (str, str) to tuple of (str, Value)
        Assignments of an edge, in order; they may name F and a.
    before : mapping of (str, str) to mapping of str to Value
        For an edge, F and a before its assignments, where these read them.
    flows : mapping of (str, str) to Value
        By state and variable.
    load, mobility : str
        What H and W are called here; empty if it does not move.
    rest : mapping of str to str
        By force, what the force of the other elements is called; empty if there are none, or if it
        does not move.
    shared : bool
        Whether edges depend on the force at the same instant, beside its effect on the motion.
    own : mapping of str to mapping of str to Value
        By state and force, that of one element.
    assumed : tuple of str
        Conditions that hold by construction.
    facts : ContactFacts
        What was read.
    """

    chart: Chart
    moves: bool
    inputs: tuple[str, ...]
    variables: tuple[str, ...]
    guards: Mapping[tuple[str, str], Condition]
    steps: Mapping[tuple[str, str], tuple[tuple[str, Value], ...]]
    before: Mapping[tuple[str, str], Mapping[str, Value]]
    flows: Mapping[tuple[str, str], Value]
    load: str
    mobility: str
    rest: Mapping[str, str]
    shared: bool
    own: Mapping[str, Mapping[str, Value]]
    assumed: tuple[str, ...]
    facts: ContactFacts

    def guard(self, edge: Transition) -> Condition:
        """Return the guard of an edge."""
        return self.guards[edge.source, edge.name]

    def assigned(self, edge: Transition) -> tuple[tuple[str, Value], ...]:
        """Return the assignments of an edge."""
        return self.steps[edge.source, edge.name]

    def landed(self, edge: Transition) -> tuple[str, ...]:
        """Return the velocities that an edge sets to 0, because it enters a locked state."""
        return self.chart.velocities if self.locked(edge.target) else ()

    def trees(self, edge: Transition) -> list[Value | Condition]:
        """Return all that an edge reads."""
        before = self.before[edge.source, edge.name].values()
        return [self.guard(edge), *(tree for _, tree in self.assigned(edge)), *before]

    def locked(self, state: str) -> bool:
        """Return whether a state locks the contact."""
        return self.chart.states[self.chart.state_index(state)].locked

    def waits(self, state: str) -> list[tuple[Transition, Value]]:
        """Return the edges that end a stay in a state by its length alone, and that length."""
        found = []
        for _, edge in self.chart.leaving(state):
            guard = self.guard(edge)
            for part in guard.operands if isinstance(guard, Either) else (guard,):
                match part:
                    case Relation(">=" | ">", Name(name), length) if name == AGE:
                        constant = names_in(length) <= {*self.chart.parameter_names}
                        if constant and not self.arrests(edge):
                            found.append((edge, length))
        return found

    def arrests(self, edge: Transition) -> bool:
        """Return whether an edge locks the contact where its velocity passes 0."""
        edges = (self.chart.transitions[number] for number in self.chart.arrests)
        return any((each.source, each.name) == (edge.source, edge.name) for each in edges)

    @property
    def elements(self) -> tuple[str, ...]:
        """The names of which every element has its own: variables, parameters, the threshold."""
        own = [each.name for each in self.chart.parameters if each.per_element]
        curved = ["s"] if self.facts.curved and "s" in self.inputs else []
        return (*own, *curved, *self.chart.variables)

    @property
    def about(self) -> tuple[str, ...]:
        """What the statements are about, line by line."""
        facts, v, H, W = self.facts, next(iter(self.chart.velocities), ""), self.load, self.mobility
        lines = [
            "over the reals, not floats; over points, not trajectories",
            "inputs and their rates (ds/dt, dv/dt) are free, but equal in both states of a switch",
        ]
        if self.moves:
            held = f", F = {H} and a = {v} = 0 while it is locked" * self.chart.locks
            lines.append(f"{H}, the force that would hold {v}, is free")
            lines.append(f"a = ({H} - F) {W} while the contact moves{held}")
        if self.rest:
            others = "the other element" if facts.n == 2 else f"the other {facts.n - 1} elements"
            own = [f"; {name}2 is the {name} of element 2" for name in self.elements[-1:]]
            lines.append(f"F is the sum over {facts.n} elements, {self.rest['F']} that of {others}")
            lines[-1] += "".join(own)
        if facts.period is not None:
            lines.append(f"machines are asked once at each tick, every {facts.period:g} s")
        return tuple(lines)

    @property
    def used(self) -> frozenset[str]:
        """The names that its guards, flows and assignments read."""
        edges = (tree for edge in self.chart.transitions for tree in self.trees(edge))
        return frozenset[str]().union(*map(names_in, [*edges, *self.flows.values()]))


def subject_of(facts: ContactFacts) -> ChartSubject:
    """Return a chart as the checks read it.

    Examples
    --------
    >>> from gms_fsm.charts import CHARTS
    >>> from gms_fsm.language import spell
    >>> read = subject_of(ContactFacts(CHARTS["stiction"]))
    >>> spell(read.guards["stuck", "release_forward"]), spell(read.flows["forward", "v"])
    ('H > F_s', '(H - (F_c + b * v)) * W')
    """
    chart = facts.chart
    # How long conditions have held is not followed: a check that needs it is undecided.
    lets: dict[str, Value] = called(chart.durations)
    variables = tuple(name for name in chart.variables if name not in lets)
    for name, tree in chart.lets.items():
        lets[name] = renamed(tree, lets)
    declared = {*chart.inputs, *chart.velocities, *chart.variables, *chart.parameter_names, *lets}
    late = [name for name in (*chart.force_names, *chart.rate_names) if name not in declared]
    steps = _steps(chart, lets)
    guards = {name: renamed_in(tree, lets) for name, tree in chart.guards.items()}
    read = _names(guards.values()) | _names(tree for row in steps.values() for _, tree in row)
    driven = bool(read & {*late}) or chart.locks or chart.sets_velocity
    moves = driven or (facts.free and bool(read & {"x", *chart.velocities}))
    moves = moves and bool(chart.velocities)  # a supervisor does not
    load, mobility = _fresh("H", declared), _fresh("W", declared)
    flows = {key: renamed(chart.flows[key], lets) for key in chart.flows if key[1] in variables}
    rest = {
        force: _fresh(force_name("R", chart, force), declared)
        for force in chart.force_names
        if moves and facts.n > 1
    }
    viscous = _fresh("sigma_2", declared) if moves and facts.viscous else ""
    own: dict[str, dict[str, Value]] = {}
    values: dict[str, dict[str, Value]] = {}
    for state in chart.states:
        inside = lets | _rates(chart, flows, state.name)
        own[state.name] = {
            name: renamed(given, inside)
            for name in chart.force_names
            if (given := chart.forces[state.name, name]) is not None
        }
        found = values[state.name] = {
            force: _total(chart, force, own[state.name].get(force), inside, (load, rest, viscous))
            for force in chart.force_names
        }
        if state.locked:
            found |= {name: ZERO for name in chart.rate_names if name in late}
    for state in chart.states if moves else ():
        rates = _accelerations(chart, state, values[state.name]["F"], load, mobility)
        flows |= {(state.name, velocity): rate for velocity, rate in rates.items()}
        if len(rates) == 1 and chart.rate_names[0] in late:
            values[state.name] |= dict.fromkeys(chart.rate_names, *rates.values())
    inputs = [name for name in chart.inputs if not (moves and name in chart.velocities)]
    if moves:
        loads = [force_name(load, chart, force) for force in chart.force_names]
        inputs += [*loads, mobility, *rest.values(), *([viscous] if viscous else [])]
    else:
        named = read | _names(flows.values())
        inputs += [name for name in chart.velocities if name in named and name not in inputs]
    return ChartSubject(
        chart=chart,
        moves=moves,
        inputs=tuple(inputs),
        variables=(*variables, *(chart.velocities if moves else ())),
        guards={
            (edge.source, edge.name): renamed_in(guards[edge.name], values[edge.source])
            for edge in chart.transitions
        },
        steps=steps,
        before={
            (edge.source, edge.name): {
                name: tree
                for name, tree in values[edge.source].items()
                if name in _names(step for _, step in steps[edge.source, edge.name])
            }
            for edge in chart.transitions
        },
        flows=flows,
        load=load if moves else "",
        mobility=mobility if moves else "",
        rest=rest,
        shared=driven,
        own=own,
        assumed=(
            *([f"{mobility} > 0"] if moves else []),
            *([f"{viscous} >= 0"] if viscous else []),
            *(f"{name} >= 0" for name in chart.hidden if name in variables),
        ),
        facts=facts,
    )


def _steps(
    chart: Chart, lets: Mapping[str, Value]
) -> dict[tuple[str, str], tuple[tuple[str, Value], ...]]:
    return {
        (edge.source, edge.name): tuple(
            (name, renamed(tree, lets))
            for name, tree in chart.assigned(edge)
            if name not in chart.durations
        )
        for edge in chart.transitions
    }


def _total(
    chart: Chart,
    force: str,
    own: Value | None,
    inside: Mapping[str, Value],
    called: tuple[str, Mapping[str, str], str],
) -> Value:
    """Return the force of a contact, given that of one element; None stands for a lock.

    `called` are the names of the load, of the forces of the others, and of viscous friction.
    """
    load, rest, viscous = called
    if own is None:
        return Name(force_name(load, chart, force))
    total = Binary("+", own, Name(rest[force])) if rest else own
    if force in chart.totals:
        total = renamed(chart.totals[force], {**inside, force: total})
    if viscous and force == chart.force_names[0]:
        total = Binary("+", total, Binary("*", Name(viscous), Name(chart.velocities[0])))
    return total


def _accelerations(
    chart: Chart, state: State, force: Value, load: str, mobility: str
) -> dict[str, Value]:
    """Return the rate of each velocity; several are coupled, which is not encoded."""
    if state.locked:
        return dict.fromkeys(chart.velocities, ZERO)
    if len(chart.velocities) > 1:
        return {v: Name(rate) for v, rate in zip(chart.velocities, chart.rate_names, strict=True)}
    net = Binary("-", Name(load), force)
    return {chart.velocities[0]: Binary("*", net, Name(mobility))}


def _names(trees: Iterable[Value | Condition]) -> frozenset[str]:
    return frozenset[str]().union(*map(names_in, trees))


def _fresh(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    return name


def force_name(name: str, chart: Chart, force: str) -> str:
    """Return a name for a force as F is named for it: H_w, as F_w is."""
    return name + force.removeprefix(chart.force_names[0])


def _rates(chart: Chart, flows: Mapping[tuple[str, str], Value], state: str) -> dict[str, Value]:
    return {f"d{name}": flows[state, name] for name in chart.variables if (state, name) in flows}
