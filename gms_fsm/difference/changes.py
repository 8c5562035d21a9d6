"""What two charts differ in, part by part: texts are compared in the names of the second."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.charts.reader import called
from gms_fsm.difference.result import PartChange
from gms_fsm.difference.wording import both
from gms_fsm.language import MATLAB_LIKE, Condition, Name, Value, renamed, spell
from gms_fsm.language.normal import renamed_in
from gms_fsm.verification.sameness.matching import Matching

FIELDS = {"unit": "unit", "rule": "rule", "per_element": "per_element", "meaning": "meaning",
          "assumed": "assumption"}  # fmt: skip


@dataclass(frozen=True)
class ChartPair:
    """Two charts, and what of one stands for what of the other.

    Parameters
    ----------
    a, b : Chart
        The charts.
    found : Matching
        Their states and names.
    """

    a: Chart
    b: Chart
    found: Matching

    @cached_property
    def names(self) -> dict[str, Value]:
        """The names of the second chart for those of the first."""
        new = dict(self.found.names) | {
            f"d{old}": f"d{its}" for old, its in self.found.variables.items()
        }
        return {old: Name(its) for old, its in new.items()}

    # ------------------------------------------------------------------ edges
    @cached_property
    def edges(self) -> dict[str, str]:
        """The edges that stand for each other, by name, else by what they do."""
        mine = {edge.name: edge for edge in self.a.nesting.transitions}
        its = {edge.name: edge for edge in self.b.nesting.transitions}
        pairs = {name: name for name in mine if name in its}
        for key in (self._whole, self._ends, self._guarded):
            groups: dict[object, tuple[list[str], list[str]]] = defaultdict(lambda: ([], []))
            for side, edges, taken in ((0, mine, {*pairs}), (1, its, {*pairs.values()})):
                for name, edge in edges.items():
                    if name not in taken:
                        groups[key(edge, side == 0)][side].append(name)
            for left, right in groups.values():
                if len(left) == len(right):
                    pairs |= dict(zip(left, right, strict=True))
        return pairs

    def _whole(self, edge: Transition, first: bool) -> object:
        return *self._guarded(edge, first), self._state(edge.target, first)

    def _ends(self, edge: Transition, first: bool) -> object:
        return self.sources(edge, first), self._state(edge.target, first)

    def _guarded(self, edge: Transition, first: bool) -> tuple[object, ...]:
        return self.sources(edge, first), self.guard(edge.name, first)

    def sources(self, edge: Transition, first: bool) -> frozenset[str]:
        """Return the states that an edge leaves, as the second chart calls them."""
        return frozenset(self._state(each, first) for each in edge.sources)

    def _state(self, path: str, first: bool) -> str:
        return self.found.levels.get(path, f"{path}'") if first else path

    def guard(self, edge: str, first: bool) -> str:
        """Return a guard in the names of the second chart."""
        return self.text((self.a if first else self.b).guards[edge], first)

    def text(self, tree: Value | Condition | None, first: bool) -> str:
        """Return a tree in the names of the second chart; empty for none."""
        if tree is None:
            return ""
        if first and isinstance(tree, Value):
            return spell(renamed(tree, self.names), MATLAB_LIKE)
        return spell(renamed_in(tree, self.names) if first else tree, MATLAB_LIKE)  # type: ignore[arg-type]

    def same(self, one: Value | None, other: Value | None) -> bool:
        """Return whether two values have the same text."""
        return self.text(one, True) == self.text(other, False)


def shown(chart: Chart, tree: Value | None, missing: str = "") -> str:
    """Return a value as a chart shows it."""
    return missing if tree is None else spell(renamed(tree, called(chart.durations)), MATLAB_LIKE)


def changes_of(pair: ChartPair) -> tuple[PartChange, ...]:
    """Return what two charts differ in.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT
    >>> from gms_fsm.verification.sameness.matching import matchings
    >>> one, other = GMS_ELEMENT["published"], GMS_ELEMENT["signed"]
    >>> (found,) = matchings(one, other)
    >>> print(*changes_of(ChartPair(one, other, found)))
    ~ flow of z in state slip: sgn(v) * C * (1 - z / s) -> C * (sgn(v) - z / s)
    """
    return (
        *_names(pair),
        *_parameters(pair),
        *_states(pair),
        *_values(pair),
        *_edges(pair),
        *_order(pair),
    )


def _names(pair: ChartPair) -> Iterator[PartChange]:
    """Yield what is added, removed or renamed, but for edges."""
    a, b, found = pair.a, pair.b, pair.found
    inputs = dict(found.inputs) | dict(zip(a.velocities, b.velocities, strict=False))
    inputs |= {name: name for name in a.inputs if name in b.inputs}
    declared = [[n for n in chart.variables if n not in chart.hidden] for chart in (a, b)]
    rows: tuple[tuple[str, Mapping[str, str], Sequence[str], Sequence[str]], ...] = (
        ("state", found.levels, list(a.nesting.levels), list(b.nesting.levels)),
        ("input", inputs, [*a.inputs, *a.velocities], [*b.inputs, *b.velocities]),
        ("variable", found.variables, declared[0], declared[1]),
        ("parameter", found.parameters, [*a.parameter_names], [*b.parameter_names]),
        ("let", {n: n for n in a.let if n in b.let}, [*a.let], [*b.let]),
    )
    for row in rows:
        yield from _named(*row)


def _named(
    part: str, pairs: Mapping[str, str], own: Sequence[str], other: Sequence[str]
) -> Iterator[PartChange]:
    for name in dict.fromkeys(own):
        if name not in pairs:
            yield PartChange("removed", part, name)
        elif pairs[name] != name:
            yield PartChange("renamed", part, name, name, pairs[name])
    for name in dict.fromkeys(other):
        if name not in pairs.values():
            yield PartChange("added", part, name)


def _parameters(pair: ChartPair) -> Iterator[PartChange]:
    """Yield changed fields of parameters, initial values and named expressions."""
    a, b, found = pair.a, pair.b, pair.found
    for each in (a.declared[name] for name in a.parameter_names):
        other = b.declared.get(found.parameters.get(each.name, ""))
        for field, word in FIELDS.items() if other is not None else ():
            one, its = str(getattr(each, field)), str(getattr(other, field))
            written = " ".join(found.parameters.get(part, part) for part in one.split(" "))
            if (written if field in ("rule", "assumed") else one) != its:
                yield PartChange("changed", f"{word} of parameter", each.name, one, its)
    for name, its in found.variables.items():
        start, other_start = a.initial.get(name, 0.0), b.initial.get(its, 0.0)
        if start != other_start:
            yield PartChange("changed", "initial value of", name, *both(start, other_start))
    for name in a.let:
        if name in b.let and not pair.same(a.lets[name], b.lets[name]):
            yield PartChange("changed", "let", name, a.let[name], b.let[name])


def _states(pair: ChartPair) -> Iterator[PartChange]:
    """Yield what is said of states: the default one, locks, histories."""
    a, b, found = pair.a, pair.b, pair.found
    if found.states.get(a.default_state.name) != b.default_state.name:
        yield PartChange("changed", "default", "state", a.default_state.name, b.default_state.name)
    for path, its in found.levels.items():
        one, other = a.nesting.levels[path].state, b.nesting.levels[its].state
        leaf = path in found.states
        if leaf:
            one, other = a.states[a.state_index(path)], b.states[b.state_index(its)]
        for field in ("locked",) if leaf else ("history",):
            before, after = getattr(one, field), getattr(other, field)
            if before != after:
                yield PartChange("changed", f"{field} of state", path, str(before), str(after))
        if not leaf:
            inside = found.levels.get(f"{path}.{one.initial}")
            if inside != f"{its}.{other.initial}":
                yield PartChange("changed", "initial state of", path, one.initial, other.initial)


def _values(pair: ChartPair) -> Iterator[PartChange]:
    """Yield changed flows, outputs, entries and exits."""
    a, b, found = pair.a, pair.b, pair.found
    for name, its in found.variables.items():
        rows = [
            (state, a.flows[state, name], b.flows[other, its])
            for state, other in found.states.items()
        ]
        yield from _grouped(pair, f"flow of {name}", rows)
    for force, its in zip(a.force_names, b.force_names, strict=False):
        some = [
            (state, a.forces.get((state, force)), b.forces.get((other, its)))
            for state, other in found.states.items()
        ]
        yield from _grouped(pair, f"output {force}", some)
        if not pair.same(a.totals.get(force), b.totals.get(its)):
            texts = shown(a, a.totals.get(force)), shown(b, b.totals.get(its))
            yield PartChange("changed", "contact output", force, *texts)
    for kind in ("entry", "exit"):
        for path, other in found.levels.items():
            yield from _assigned(pair, f"{kind} of state", path, (kind, path), (kind, other))


def _grouped(
    pair: ChartPair, part: str, rows: Sequence[tuple[str, Value | None, Value | None]]
) -> Iterator[PartChange]:
    """Yield what differs in some states, each change once."""
    groups: dict[tuple[str, str], list[str]] = {}
    for state, one, other in rows:
        if not pair.same(one, other):
            texts = shown(pair.a, one, "locked"), shown(pair.b, other, "locked")
            groups.setdefault(texts, []).append(state)
    for (before, after), states in groups.items():
        where = f"in state{'s' * (len(states) > 1)} {', '.join(states)}"
        yield PartChange("changed", part, where, before, after)


def _assigned(
    pair: ChartPair, part: str, name: str, mine: tuple[str, str], its: tuple[str, str]
) -> Iterator[PartChange]:
    """Yield changed assignments of a state or an edge, but for those that no text has."""
    a, b = pair.a, pair.b
    texts: list[str] = []
    plain: list[str] = []
    for chart, key, first in ((a, mine, True), (b, its, False)):
        own = [
            (each, tree)
            for each, tree in chart.assignments.get(key, {}).items()
            if each not in chart.hidden
        ]
        texts.append(", ".join(f"{n} := {shown(chart, tree)}" for n, tree in own))
        names: Callable[[str], str] = (
            (lambda n: pair.found.names.get(n, n)) if first else (lambda n: n)
        )
        plain.append(", ".join(f"{names(n)} := {pair.text(tree, first)}" for n, tree in own))
    if plain[0] != plain[1]:
        yield PartChange("changed", part, name, *texts)


# --------------------------------------------------------------------------- edges
def described(chart: Chart, edge: Transition) -> str:
    """Return an edge in one line: its ends, what it waits for and its guard."""
    event = f" on {edge.event}" if edge.event else ""
    return f"{', '.join(edge.sources)} -> {edge.target}{event} [{chart.guard_text(edge.name)}]"


def _edges(pair: ChartPair) -> Iterator[PartChange]:
    a, b, pairs = pair.a, pair.b, pair.edges
    mine = {edge.name: edge for edge in a.nesting.transitions}
    its = {edge.name: edge for edge in b.nesting.transitions}
    for name, edge in mine.items():
        if name not in pairs:
            yield PartChange("removed", "edge", name, described(a, edge))
            continue
        other = its[pairs[name]]
        if other.name != name:
            yield PartChange("renamed", "edge", name, name, other.name)
        if pair.sources(edge, True) != pair.sources(other, False):
            texts = ", ".join(edge.sources), ", ".join(other.sources)
            yield PartChange("changed", "source of edge", name, *texts)
        if pair.found.levels.get(edge.target) != other.target:
            yield PartChange("changed", "target of edge", name, edge.target, other.target)
        if pair.guard(name, True) != pair.guard(other.name, False):
            guards = a.guard_text(name), b.guard_text(other.name)
            yield PartChange("changed", "guard of edge", name, *guards)
        yield from _assigned(pair, "action of edge", name, ("action", name), ("action", other.name))
        if edge.impulse != other.impulse:
            texts = both(edge.impulse, other.impulse)
            yield PartChange("changed", "impulse of edge", name, *texts)
    for name, edge in its.items():
        if name not in pairs.values():
            yield PartChange("added", "edge", name, "", described(b, edge))


def _order(pair: ChartPair) -> Iterator[PartChange]:
    """Yield states whose edges have another order, those alike once."""
    found: dict[tuple[str, str], list[str]] = {}
    for state, its in pair.found.states.items():
        one = [edge.name for _, edge in pair.a.leaving(state)]
        other = [edge.name for _, edge in pair.b.leaving(its)]
        known = {n: pair.edges.get(n, n) for n in one if pair.edges.get(n, n) in other}
        before = [name for name in one if name in known]
        after = [name for name in other if name in known.values()]
        if [known[name] for name in before] != after:
            found.setdefault((", ".join(before), ", ".join(after)), []).append(state)
    for (first, second), states in found.items():
        yield PartChange("changed", "order of edges leaving", ", ".join(states), first, second)
