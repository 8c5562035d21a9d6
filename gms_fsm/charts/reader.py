"""Reads the texts of a chart into trees, and says what each text may name."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from gms_fsm.charts.nesting import AGE, Level, joined
from gms_fsm.charts.parts import event_name
from gms_fsm.errors import ChartError, ExpressionError, Part
from gms_fsm.language import (
    LASTING,
    MATLAB_LIKE,
    Both,
    Condition,
    Name,
    Number,
    Relation,
    Value,
    names_in,
    parse_condition,
    parse_value,
    renamed,
    spell,
)
from gms_fsm.language.normal import chosen, renamed_in

if TYPE_CHECKING:
    from gms_fsm.charts.chart import Chart
    from gms_fsm.charts.parts import State, Transition


class ChartReader:
    """Reads the texts of a chart whose names have been checked.

    Parameters
    ----------
    chart : Chart
        Its texts.
    """

    def __init__(self, chart: Chart) -> None:
        self.chart, self.here = chart, Part(f"chart {chart.name!r}")
        self.lets: dict[str, Value] = {}
        self.known = dict.fromkeys(
            [*chart.inputs, *chart.velocities, *chart.variables, *chart.parameter_names]
        )
        # A chart's own name goes before that of an acceleration.
        declared = {*self.known, *chart.let}
        self.late = [
            each for each in (*chart.force_names, *chart.rate_names) if each not in declared
        ]
        self.taken = declared | {each.name for each in chart.states}
        self.taken |= {each.name for each in chart.transitions}
        self.ages: set[str] = set()  # the variables that texts read
        # By age and text the variable that is how long a condition has held, and the condition.
        self.lasting: dict[tuple[str, str], tuple[str, Condition]] = {}

    def trees(self) -> dict[str, Any]:
        """Return what the chart keeps, by its name."""
        chart, here = self.chart, self.here
        self.only_forces(chart.outputs, here.of("outputs", "outputs"))
        self.only_forces(chart.contact_outputs, here.of("contact_outputs", "contact_outputs"))
        for name, text in chart.let.items():
            self.lets[name] = self.value(
                text, self.known_now, here.of(f"let {name!r}", "let", name)
            )
        flows: dict[tuple[str, str], Value] = {}
        forces: dict[tuple[str, str], Value | None] = {}
        assignments: dict[tuple[str, str], dict[str, Value]] = {}
        for level in chart.nesting.levels.values():
            owner = self.state(level)
            self.only(level.state.flow, chart.variables, owner.of("flow", "flow"))
            self.only_forces(level.state.outputs, owner.of("outputs", "outputs"))
            for kind, texts in (("entry", level.state.entry), ("exit", level.state.exit)):
                found = self.assignments(texts, owner.of(kind, kind), level.age)
                assignments[kind, level.path] = found
        readable = {variable: self.forces_for(variable) for variable in chart.variables}
        for state in chart.states:
            for variable, names in readable.items():
                flows[state.name, variable] = self.flow(state, variable, names)
            for force in chart.force_names:
                forces[state.name, force] = self.force(state, force)
        guards: dict[str, Condition] = {}
        for i, edge in enumerate(chart.nesting.transitions):
            owner = here.of(f"edge {edge.name!r}", "transitions", i)
            age = self.age_of(edge, owner)
            guard = self.guard(edge.guard, owner.of("guard", "guard"), age)
            guard = _awaiting(edge.event, guard) if edge.event else guard
            for name, conditions, _ in chart.nesting.entries(edge):
                guards[name] = joined(guard, conditions)
            assignments["action", edge.name] = {
                **self.assignments(edge.actions, owner.of("action", "actions"), age),
                **{event_name(each): Number(1.0) for each in edge.emit},
            }
        totals = {
            force: self.total(chart.contact_outputs[force], force)
            for force in chart.force_names
            if force in chart.contact_outputs
        }
        hidden = self.hidden(flows, assignments)
        return {
            "variables": (*chart.variables, *hidden),
            "hidden": hidden,
            "durations": dict(self.lasting.values()),
            "lets": self.lets,
            "flows": flows,
            "forces": forces,
            "assignments": assignments,
            "guards": guards,
            "totals": totals,
        }

    def forces_for(self, variable: str) -> list[str]:
        """Return the forces that the flow of a variable can read: wear and heat need them.

        They must not follow from that rate, and no state may be locked, which would hold any force.
        """
        chart, rate = self.chart, f"d{variable}"
        texts = [*chart.outputs.values(), *chart.contact_outputs.values()]
        texts += [text for state in chart.states for text in state.outputs.values()]
        if chart.locks or any(re.search(rf"\b{re.escape(rate)}\b", str(text)) for text in texts):
            return []
        return [name for name in chart.force_names if name in self.late]

    @property
    def known_now(self) -> list[str]:
        """The names that can be used, with the expressions read so far."""
        return [*self.known, *self.lets]

    def hidden(
        self,
        flows: dict[tuple[str, str], Value],
        assignments: dict[tuple[str, str], dict[str, Value]],
    ) -> tuple[str, ...]:
        """Add the variables that no text declares: times in states, and histories."""
        levels = self.chart.nesting.levels.values()
        found = dict.fromkeys(level.age for level in levels if level.age in self.ages)
        for level in levels:
            if level.age in found:
                assignments["entry", level.path][level.age] = Number(0.0)
            if level.state.history:
                found[level.last] = None
                for number, inside in enumerate(level.inside()):
                    assignments["entry", inside][level.last] = Number(float(number))
        for (age, _), (name, _) in self.lasting.items():
            for level in levels:
                if level.age == age:
                    assignments["entry", level.path][name] = Number(0.0)
        for state in self.chart.states:
            chain = self.chart.nesting.levels[state.name].chain
            running = {self.chart.nesting.levels[path].age for path in chain}
            for name in found:
                flows[state.name, name] = Number(1.0 if name in running else 0.0)
            for (age, _), (name, condition) in self.lasting.items():
                rate = chosen(condition, Number(1.0), Number(0.0))
                flows[state.name, name] = rate if age in running else Number(0.0)
        return (*found, *(name for name, _ in self.lasting.values()))

    def state(self, level: Level) -> Part:
        """Return what errors call a state."""
        return self.here.of(f"state {level.path!r}", *level.key)

    def flow(self, state: State, variable: str, forces: Sequence[str]) -> Value:
        """Read a flow in a state, which can read some forces."""
        level = self.chart.nesting.giver("flow", state.name, variable)
        if level is None:
            return Number(0.0)
        part = self.state(level).of(f"flow of {variable!r}", "flow", variable)
        return self.value(level.state.flow[variable], [*self.known_now, *forces], part, level.age)

    def force(self, state: State, force: str) -> Value | None:
        """Read a force in a state; None where the state is locked."""
        owner = self.state(self.chart.nesting.levels[state.name])
        if state.locked:
            if force in state.outputs:
                raise ChartError(
                    f"it is locked, and gives an output {force!r}",
                    place=owner.words,
                    advice=f"leave it out: {force} is what holds the contact",
                    key=(*owner.key, "outputs", force),
                )
            return None
        giver = self.chart.nesting.giver("outputs", state.name, force)
        texts = self.chart.outputs if giver is None else giver.state.outputs
        if force not in texts:
            raise ChartError(
                f"no output {force!r}",
                place=owner.words,
                advice=f"give one, here or in the chart's outputs, for example {{{force!r}: '0'}}",
                key=owner.key,
            )
        rates = [f"d{variable}" for variable in self.chart.variables]
        whose, age = (self.here, AGE) if giver is None else (self.state(giver), giver.age)
        part = whose.of(f"output {force!r}", "outputs", force)
        return self.value(texts[force], [*self.known_now, *rates], part, age)

    def age_of(self, edge: Transition, owner: Part) -> str:
        """Return the variable that age means to an edge: the time in the state that it leaves."""
        ages = dict.fromkeys(self.chart.nesting.levels[each].age for each in edge.sources)
        texts = [edge.guard, *edge.actions.values()]
        if len(ages) > 1 and any(_age(text) for text in texts):
            raise ChartError(
                f"it reads the age of {' and of '.join(map(repr, edge.sources))}",
                place=owner.words,
                advice="write an edge for each of them",
                key=owner.key,
            )
        return next(iter(ages))

    def total(self, text: str, force: str) -> Value:
        """Read the force of a contact over the sum of its elements' forces."""
        chart = self.chart
        owner = self.here.of(f"contact_outputs {force!r}", "contact_outputs", force)
        shared = [each.name for each in chart.parameters if not each.per_element]
        names = [*dict.fromkeys([*chart.inputs, *chart.velocities]), *shared, *self.lets]
        tree = self.value(text, [*names, force], owner)
        for name in sorted(names_in(tree) & {*self.lets}):
            for read in sorted(self.inside(name) - {*names}):
                raise ChartError(
                    f"it reads {name!r}, which reads {read!r} of each element",
                    place=owner.words,
                    advice="a contact has one force; use what all its elements share",
                    key=owner.key,
                )
        return tree

    def inside(self, let: str) -> frozenset[str]:
        """Return the names that a let is made from, but for other lets."""
        found = names_in(self.lets[let])
        return frozenset(
            name for each in found for name in (self.inside(each) if each in self.lets else {each})
        )

    def guard(self, text: str, owner: Part, age: str) -> Condition:
        """Read a guard."""
        try:
            tree = parse_condition(text, [*self.known_now, *self.late, *_age(text)])
        except ExpressionError as error:
            raise error.at(owner) from None
        return renamed_in(tree, self.timed(tree, age, owner))

    def timed(self, tree: Value | Condition, age: str, owner: Part) -> dict[str, Value]:
        """Return what the times in a text mean: that in a state, and those of conditions there."""
        found: dict[str, Value] = {}
        for name in sorted(names_in(tree)):
            if name == AGE:
                self.ages.add(age)
                found[name] = Name(age)
            elif name.startswith(LASTING):
                found[name] = Name(self.duration(name[len(LASTING) : -1], age, owner))
        return found

    def duration(self, text: str, age: str, owner: Part) -> str:
        """Return the variable that is how long a condition has held in the state of an age."""
        if (age, text) not in self.lasting:
            try:
                condition = parse_condition(text, self.known_now)
            except ExpressionError as error:
                raise error.at(owner.of("duration")) from None
            taken = {name for name, _ in self.lasting.values()} | self.taken
            names = (f"{age.removesuffix(AGE)}duration{k or ''}" for k in itertools.count())
            self.lasting[age, text] = next(n for n in names if n not in taken), condition
        return self.lasting[age, text][0]

    def assignments(self, texts: Mapping[str, str], owner: Part, age: str) -> dict[str, Value]:
        """Read assignments to variables and velocities."""
        self.only(texts, (*self.chart.variables, *self.chart.velocities), owner)
        names = [*self.known_now, *self.late]
        return {
            name: self.value(text, names, Part(f"{owner.words} {name!r}", (*owner.key, name)), age)
            for name, text in texts.items()
        }

    def value(self, text: str, names: Iterable[str], owner: Part, age: str = AGE) -> Value:
        """Read a value."""
        names = [*names, *_age(text)]
        try:
            tree = parse_value(text, names)
        except ExpressionError as error:
            self.refuse_loop(text, names, owner)
            raise error.at(owner) from None
        return renamed(tree, self.timed(tree, age, owner))

    def refuse_loop(self, text: str, names: list[str], owner: Part) -> None:
        """Refuse F and a where they would depend on themselves."""
        try:
            tree = parse_value(text, [*names, *self.late])
        except ExpressionError:
            return
        for name in sorted(names_in(tree) & {*self.late}):
            late = f"guards and actions can read {', '.join(self.late)}"
            if owner.key[:1] == ("let",):
                reason = f"it reads {name!r}, and flows and forces, which could read it, cannot"
                advice = f"write it out where it is needed: {late}"
            else:
                reason = f"it reads {name!r}, which follows from it (an algebraic loop)"
                advice = f"{late}; a flow or a force that needs them needs a variable in between"
            raise ChartError(reason, place=owner.words, advice=advice, key=owner.key)

    def only(self, texts: Mapping[str, str], allowed: tuple[str, ...], owner: Part) -> None:
        """Refuse texts for anything but the allowed variables."""
        for name in texts:
            if name not in allowed:
                raise ChartError(
                    f"{name!r} is not a variable",
                    place=owner.words,
                    advice=f"variables: {', '.join(map(repr, self.chart.variables)) or 'none'}",
                    key=(*owner.key, name),
                )

    def only_forces(self, texts: Mapping[str, str], owner: Part) -> None:
        """Refuse forces that the chart does not have."""
        for name, text in texts.items():
            if name not in self.chart.force_names:
                forces = ", ".join(map(repr, self.chart.force_names))
                hint = (
                    "; the chart of a Supervisor, whose outputs have any names, has "
                    "velocities=(), in a file velocities = []"
                )
                raise ChartError(
                    f"it has {name!r}",
                    place=owner.words,
                    advice=f"its forces are {forces}{hint * (len(self.chart.velocities) == 1)}",
                    key=(*owner.key, name),
                )
            if hasattr(text, "keys"):
                raise ChartError(
                    f"output {name!r} is {text!r}",
                    place=self.here.words,
                    advice="it is one text for all states; where the force differs by state, give "
                    "it there: State('forward', outputs={'F': 'F_c'})",
                )


def called(durations: Mapping[str, Condition]) -> dict[str, Value]:
    """Return what pictures call the times for which conditions have held."""
    return {
        name: Name(f"{LASTING}{spell(condition, MATLAB_LIKE)})")
        for name, condition in durations.items()
    }


def _awaiting(event: str, guard: Condition) -> Condition:
    """Return a guard that holds only at its event."""
    arrived = Relation(">", Name(event_name(event)), Number(0.5))
    match guard:
        case Both(parts):
            return Both((arrived, *parts)) if parts else arrived
    return Both((arrived, guard))


def _age(text: object) -> list[str]:
    """Return the name of the age where a text seems to read it; else messages would offer it."""
    words = (AGE, "after", "every", "duration")
    return [AGE] if isinstance(text, str) and any(word in text for word in words) else []
