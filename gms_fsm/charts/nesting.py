"""A chart as it is written: states inside states, and what becomes of them.

All readers see the innermost states only, the leaves, and edges between these. An edge that leaves
a composite state leaves every leaf inside it, after the edges of the states inside, as in SCXML.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from gms_fsm.charts.parts import State, Transition, check_size
from gms_fsm.errors import ChartError
from gms_fsm.language import Both, Condition, Name, Number, Relation, spell

AGE = "age"  # s since the state was entered; a variable of every chart that reads it


def spelled(path: str) -> str:
    """Return the name of a state where a language has no dots.

    Examples
    --------
    >>> spelled("slip.forward")
    'slip__forward'
    """
    return path.replace(".", "__")


def is_age(name: str) -> bool:
    """Return whether a variable is the time in a state."""
    return name == AGE or name.endswith(f"__{AGE}")


@dataclass(frozen=True)
class Level:
    """A state as it is written, at its place.

    Parameters
    ----------
    state : State
        Without the names of the states around it.
    chain : tuple of str
        The paths of the states around it, the outermost first, and its own.
    key : tuple of str or int
        Where it is written, for errors.
    """

    state: State
    chain: tuple[str, ...]
    key: tuple[str | int, ...]

    @property
    def path(self) -> str:
        """What it is called: ``slip.forward``."""
        return self.chain[-1]

    @property
    def age(self) -> str:
        """The variable that is the time since it was entered."""
        return f"{spelled(self.path)}__{AGE}" if self.state.states else AGE

    @property
    def last(self) -> str:
        """The variable that is the number of the state inside it that was entered last."""
        return f"{spelled(self.path)}__history"

    def texts(self, given: Mapping[str, str]) -> dict[str, str]:
        """Return texts as they read elsewhere, where age is that of another state."""
        return {
            name: re.sub(rf"\b{AGE}\b", self.age, text) if isinstance(text, str) else text
            for name, text in given.items()
        }

    def inside(self) -> list[str]:
        """Return the paths of the states directly inside, the initial one first."""
        names = sorted(
            (each.name for each in self.state.states), key=lambda name: name != self.state.initial
        )
        return [f"{self.path}.{name}" for name in names]

    def was(self, number: int) -> tuple[Condition, ...]:
        """Return the conditions for a state inside to be the one that was entered last."""
        above = Relation(">", Name(self.last), Number(number - 0.5))
        below = Relation("<", Name(self.last), Number(number + 0.5))
        final = number == len(self.state.states) - 1
        return (*([above] if number else []), *([] if final else [below]))


def _levels(states: tuple[State, ...], chain: tuple[str, ...] = ()) -> Iterator[Level]:
    for i, state in enumerate(states):
        own = (*chain, f"{chain[-1]}.{state.name}" if chain else state.name)
        yield Level(state, own, ("states", i))
        for each in _levels(state.states, own):
            yield replace(each, key=("states", i, *each.key))


@dataclass(frozen=True)
class Nesting:
    """The states and edges of a chart as they are written."""

    states: tuple[State, ...]
    transitions: tuple[Transition, ...]

    @cached_property
    def levels(self) -> dict[str, Level]:
        """All states by their paths, outer ones before those inside."""
        return {level.path: level for level in _levels(self.states)}

    @cached_property
    def composite(self) -> tuple[Level, ...]:
        """The states with states inside."""
        return tuple(level for level in self.levels.values() if level.state.states)

    @property
    def histories(self) -> tuple[str, ...]:
        """The variables that are histories."""
        return tuple(level.last for level in self.composite if level.state.history)

    def leaves_of(self, path: str) -> list[str]:
        """Return the paths of the innermost states in a state, or of itself."""
        if not self.levels[path].state.states:
            return [path]
        return [
            level.path
            for level in self.levels.values()
            if path in level.chain and not level.state.states
        ]

    def ways(self, path: str) -> list[tuple[tuple[Condition, ...], str]]:
        """Return the leaves that are entered with a state, each with conditions on histories."""
        level = self.levels[path]
        if not level.state.states:
            return [((), path)]
        inside = level.inside()
        if not level.state.history:
            return self.ways(inside[0])
        return [
            ((*(level.was(number) if len(inside) > 1 else ()), *conditions), leaf)
            for number, each in enumerate(inside)
            for conditions, leaf in self.ways(each)
        ]

    def entries(self, edge: Transition) -> list[tuple[str, tuple[Condition, ...], str]]:
        """Return what an edge becomes for each leaf that it can enter: name, conditions, leaf."""
        return [
            (
                f"{edge.name}__{spelled(leaf.removeprefix(f'{edge.target}.'))}"
                if number
                else edge.name,
                conditions,
                leaf,
            )
            for number, (conditions, leaf) in enumerate(self.ways(edge.target))
        ]

    def begins(self) -> tuple[tuple[str, str], ...]:
        """Return whose assignments the start of a run performs."""
        first = self.ways(self.states[0].name)[0][1]
        return tuple(("entry", path) for path in self.levels[first].chain)

    def remembered(self, level: Level, leaf: str, before: float = 0.0) -> float:
        """Return a history in a leaf, which outside of its state is as before."""
        chain = self.levels[leaf].chain
        inside = [k for k, each in enumerate(level.inside()) if each in chain]
        return float(inside[0]) if inside else before

    def moved(self, name: str, value: float, old: str, new: str) -> float:
        """Return a variable that no text declares, after a leaf has been put in another's place."""
        for level in self.composite:
            if name == level.last:
                return self.remembered(level, new, value)
            if name == level.age and level.path in self.levels[old].chain:
                return value if level.path in self.levels[new].chain else 0.0
        return 0.0

    def giver(self, kind: str, leaf: str, name: str) -> Level | None:
        """Return the innermost state that gives a text, of its flow or outputs, for a leaf."""
        around = (self.levels[path] for path in reversed(self.levels[leaf].chain))
        return next((level for level in around if name in getattr(level.state, kind)), None)

    # ------------------------------------------------------------------ what readers see
    def leaves(self) -> tuple[State, ...]:
        """Return the innermost states with what they inherit, the default state first."""
        first = self.ways(self.states[0].name)[0][1]
        found = [self._leaf(level) for level in self.levels.values() if not level.state.states]
        return tuple(sorted(found, key=lambda state: state.name != first))

    def _leaf(self, level: Level) -> State:
        if len(level.chain) == 1:
            return level.state
        flow: dict[str, str] = {}
        outputs: dict[str, str] = {}
        locked = False
        for path in level.chain:
            around = self.levels[path]
            flow |= around.texts(around.state.flow)
            locked |= around.state.locked
            outputs = {
                **({} if around.state.locked else outputs),
                **around.texts(around.state.outputs),
            }
        return replace(level.state, name=level.path, flow=flow, outputs=outputs, locked=locked)

    def rows(self) -> tuple[Transition, ...]:
        """Return an edge for each leaf that an edge leaves, those of inner states first."""
        written = [
            (self.levels[source], edge) for edge in self.transitions for source in edge.sources
        ]
        if self.composite:
            written.sort(key=lambda each: -len(each[0].chain))
        found: dict[tuple[str, str], Transition] = {}
        for level, edge in written:
            for leaf in self.leaves_of(level.path):
                for name, conditions, target in self.entries(edge):
                    if (leaf, name) not in found:  # else an inner state has it, too
                        texts = [f"({edge.guard})", *map(spell, conditions)]
                        row = replace(edge, name=name, source=leaf, target=target)
                        for each, value in (
                            ("guard", " and ".join(texts) if conditions else edge.guard),
                            ("performs", self._performed(level, edge, leaf, target)),
                        ):
                            object.__setattr__(row, each, value)
                        found[leaf, name] = row
        sources: dict[str, list[str]] = {}
        for leaf, name in found:
            sources.setdefault(name, []).append(leaf)
        for row in found.values():
            object.__setattr__(row, "sources", tuple(sources[row.name]))
        return tuple(found.values())

    def _performed(
        self, source: Level, edge: Transition, leaf: str, target: str
    ) -> tuple[tuple[str, str], ...]:
        """Return whose assignments an edge performs: it leaves what is not around both its ends."""
        around = {*source.chain[:-1]} & {*self.levels[edge.target].chain[:-1]}
        left = [path for path in self.levels[leaf].chain if path not in around]
        entered = [path for path in self.levels[target].chain if path not in around]
        return (
            *(("exit", path) for path in reversed(left)),
            ("action", edge.name),
            *(("entry", path) for path in entered),
        )


def joined(guard: Condition, more: tuple[Condition, ...]) -> Condition:
    """Return a guard with further conditions."""
    if not more:
        return guard
    return Both((*(guard.operands if isinstance(guard, Both) else (guard,)), *more))


def written_guard(guard: Condition, nesting: Nesting, edge: Transition) -> Condition:
    """Return the guard of an edge as it is written, without conditions on histories."""
    more = len(nesting.entries(edge)[0][1])
    if not more or not isinstance(guard, Both):
        return guard
    own = guard.operands[:-more]
    return own[0] if len(own) == 1 else Both(own)


def output_text(nesting: Nesting, outputs: Mapping[str, str], state: str, name: str) -> str:
    """Return the text of an output in a state: of the state, of one around it, or of the chart."""
    level = nesting.giver("outputs", state, name)
    return outputs.get(name, "") if level is None else level.state.outputs[name]


def check_paths(nesting: Nesting, owner: dict[str, str], here: str) -> None:
    """Refuse states whose names, or those of their hidden variables, something else has."""
    for level in nesting.levels.values():
        own = [spelled(level.path)] if len(level.chain) > 1 else []
        for name in (*own, *((level.age, level.last) if level.state.states else ())):
            take_name(name, owner, f"state {level.path!r}", here, level.key)


def take_name(
    name: str, owner: dict[str, str], what: str, here: str, key: tuple[str | int, ...]
) -> None:
    """Note what has a name; refuse one that something else has."""
    if name in owner:
        raise ChartError(
            f"the name {name!r} is used twice ({owner[name]} and {what})",
            place=here,
            advice="every name must be unique",
            key=key,
        )
    owner[name] = what


def check_ends(nesting: Nesting, owner: dict[str, str], here: str) -> None:
    """Refuse edges that leave or enter what is not a state, or take an impulse for nothing."""
    known = nesting.levels
    for i, edge in enumerate(nesting.transitions):
        for end, state in (
            *(("source", each) for each in edge.sources),
            ("target", edge.target),
        ):
            if state not in known:
                raise ChartError(
                    f"{end} {state!r} is not a state",
                    place=f"{here}, edge {edge.name!r}",
                    advice=f"states: {', '.join(map(repr, known))}",
                    key=("transitions", i, end),
                )
        for name, *_ in nesting.entries(edge)[1:]:  # one for each state that a history enters
            take_name(name, owner, f"edge {edge.name!r}", here, ("transitions", i, "name"))
    leaves = nesting.leaves()
    rows = (
        len(nesting.leaves_of(source)) * len(nesting.ways(edge.target))
        for edge in nesting.transitions
        for source in edge.sources
    )
    check_size(len(leaves), sum(rows), here)
    locked = {leaf.name for leaf in leaves if leaf.locked}
    for i, edge in enumerate(nesting.transitions):
        if edge.impulse and not {leaf for *_, leaf in nesting.entries(edge)} <= locked:
            raise ChartError(
                f"it takes an impulse, but its target {edge.target!r} is not locked",
                place=f"{here}, edge {edge.name!r}",
                advice="leave impulse out; an action that sets the velocity is an impulse too",
                key=("transitions", i, "impulse"),
            )
