"""Which states and names of two charts stand for each other: by name, else by what they do.

What no name matches gets a colour: what is written of it, in which other names have colours too.
Equal colours are matched, the finest first.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.nesting import Level
from gms_fsm.charts.parts import SUPPLIED
from gms_fsm.language import names_in
from gms_fsm.verification.sameness.canonical import canonical
from gms_fsm.verification.sameness.meaning import ChartMeaning, meaning_of

# How far around a name its colour looks, and whether at texts or only at the names in them.
DEPTHS = ((3, True), (2, True), (1, True), (3, False), (2, False), (1, False), (0, False))
MOST_WAYS = 24  # in which what is alike may be matched
Pairs: TypeAlias = dict[str, str]
Alike: TypeAlias = tuple[str, list[str], list[str]]  # of a kind, in both charts
KINDS = ("state", "variable", "parameter", "input")


@dataclass(frozen=True)
class Matching:
    """What of one chart stands for what of another.

    Parameters
    ----------
    states, variables, parameters, inputs : mapping of str to str
        From the first chart to the second; the states are the innermost ones.
    levels : mapping of str to str
        The states, with those around them that have the same states inside.
    names : mapping of str to str
        Every name of the first chart's texts, in the second; one that has no counterpart ends with
        a prime, which no name has.
    loose : frozenset of str
        Names, in the second chart, whose counterpart is not known for certain: histories, and how
        long conditions have held.
    guessed : tuple of str
        What could be matched in too many ways, and was in the order of declaration.
    """

    states: Mapping[str, str]
    variables: Mapping[str, str]
    parameters: Mapping[str, str]
    inputs: Mapping[str, str]
    levels: Mapping[str, str]
    names: Mapping[str, str]
    loose: frozenset[str]
    guessed: tuple[str, ...] = ()


def _parts(chart: Chart) -> dict[str, list[str]]:
    """Return what has a name, kind by kind."""
    return {
        "state": [state.name for state in chart.states],
        "variable": [name for name in chart.variables if name not in chart.hidden],
        "parameter": [*chart.parameter_names],
        "input": [
            name for name in chart.inputs if name not in SUPPLIED and name not in chart.velocities
        ],
    }


def matchings(a: Chart, b: Chart) -> Iterator[Matching]:
    """Yield the ways in which states and names of two charts stand for each other.

    The first one is in the order of declaration, where several are alike. If there are more than
    `MOST_WAYS` it is the only one.

    Examples
    --------
    >>> from gms_fsm import Chart, State
    >>> one = Chart("one", variables=("z",), states=(State("stick", {"z": "v"}),),
    ...             outputs={"F": "2 * z"})
    >>> other = Chart("other", variables=("q",), states=(State("held", {"q": "v"}),),
    ...               outputs={"F": "2 * q"})
    >>> (found,) = matchings(one, other)
    >>> dict(found.states), dict(found.variables)
    ({'stick': 'held'}, {'z': 'q'})
    """
    said = meaning_of(a), meaning_of(b)
    own, other = _parts(a), _parts(b)
    pairs: dict[str, Pairs] = {
        kind: {name: name for name in own[kind] if name in other[kind]} for kind in KINDS
    }
    fixed = dict(zip(a.velocities, b.velocities, strict=False))
    fixed |= dict(zip(a.force_names, b.force_names, strict=False)) if a.velocities else {}
    fixed |= dict(zip(a.rate_names, b.rate_names, strict=False))
    declared = {*a.variables, *a.parameter_names}  # these go before an acceleration
    fixed = {name: its for name, its in fixed.items() if name not in declared}
    alike: list[Alike] = []
    for several, near in itertools.product((False, True), DEPTHS):
        while _step(said, (own, other), pairs, fixed, near, alike if several else None):
            pass
    guessed = tuple(name for _, mine, _ in alike for name in mine)
    ways = math.prod(math.factorial(len(mine)) for _, mine, _ in alike)
    orders = itertools.product(*(itertools.permutations(its) for _, _, its in alike))
    for order in orders if ways <= MOST_WAYS else itertools.islice(orders, 1):
        for (kind, mine, _), its in zip(alike, order, strict=True):
            pairs[kind] = pairs[kind] | dict(zip(mine, its, strict=True))
        yield _matching(said, pairs, fixed, guessed if ways > MOST_WAYS else ())


def _step(
    said: tuple[ChartMeaning, ChartMeaning],
    parts: tuple[dict[str, list[str]], dict[str, list[str]]],
    pairs: dict[str, Pairs],
    fixed: Pairs,
    near: tuple[int, bool],
    alike: list[Alike] | None,
) -> bool:
    """Match what has the same colour in both charts; return whether anything was.

    Several of one colour are matched only if they are noted.
    """
    left = {kind: [n for n in parts[0][kind] if n not in pairs[kind]] for kind in KINDS}
    right = {kind: [n for n in parts[1][kind] if n not in pairs[kind].values()] for kind in KINDS}
    if not any(left[kind] and right[kind] for kind in KINDS):
        return False
    known = {name: f"={other}" for name, other in fixed.items()}
    known |= {n: f"={other}" for kind in KINDS[1:] for n, other in pairs[kind].items()}
    first = _colours(said[0], known, pairs["state"], left, *near)
    known = {each: f"={each}" for each in fixed.values()}
    known |= {n: f"={n}" for kind in KINDS[1:] for n in pairs[kind].values()}
    second = _colours(said[1], known, {n: n for n in pairs["state"].values()}, right, *near)
    found = False
    for kind in KINDS:
        groups: dict[str, tuple[list[str], list[str]]] = defaultdict(lambda: ([], []))
        for side, (names, colours) in enumerate(((left, first), (right, second))):
            for name in names[kind]:
                groups[colours[kind, name]][side].append(name)
        for mine, its in groups.values():
            if len(mine) != len(its) or not mine or (alike is None and len(mine) > 1):
                continue
            pairs[kind] |= dict(zip(mine, its, strict=True))
            found = True
            if alike is not None and len(mine) > 1:
                alike.append((kind, mine, its))
    return found


def _colours(
    said: ChartMeaning,
    known: Pairs,
    states: Pairs,
    left: Mapping[str, list[str]],
    depth: int,
    exact: bool,
) -> dict[tuple[str, str], str]:
    """Return the colours of what is left, by kind and name."""
    chart = said.chart
    colour: dict[tuple[str, str], str] = {}
    kind_of = {name: kind for kind in KINDS[1:] for name in left[kind]}
    for name in left["state"]:
        state = chart.states[chart.state_index(name)]
        colour["state", name] = f"state {state.locked} {name == chart.default_state.name}"
    for kind in KINDS[1:]:
        for name in left[kind]:
            colour[kind, name] = kind
    for each in chart.parameters:
        if ("parameter", each.name) in colour:
            bounds = [bound.op for bound in each.bounds]
            colour["parameter", each.name] = f"parameter {each.unit} {bounds} {each.per_element}"
    for name, value in chart.initial.items():
        if ("variable", name) in colour:
            colour["variable", name] = f"variable {value}"

    def of_state(name: str) -> str:
        return f"={states[name]}" if name in states else colour["state", name]

    def of_name(name: str) -> str:
        return known.get(name) or (colour[kind_of[name], name] if name in kind_of else f"={name}")

    texts = [(place, tree, names_in(tree)) for place, tree in said.texts()]
    for _ in range(depth):
        seen: dict[tuple[str, str], list[str]] = {key: [] for key in colour}
        for place, tree, names in texts:
            kind, *owners = place
            count = {"flow": 1, "force": 1, "guard": 2, "action": 2}.get(kind, 0)
            ends, written = owners[:count], owners[count:]
            role = [kind, *map(of_state, ends), *map(of_name, written)]
            text = canonical(tree, of_name) if exact else sorted({of_name(n) for n in names})
            for number, end in enumerate(ends):
                if ("state", end) in seen:
                    seen["state", end].append(f"{number} {role} {text}")
            for name in {*names, *written}:
                if name in kind_of:
                    called = {n: of_name(n) for n in names} | {name: "*"}
                    own = canonical(tree, called.__getitem__) if exact else sorted(called.values())
                    mark = [each == name for each in written]
                    seen[kind_of[name], name].append(f"{role} {mark} {own}")
        colour = {key: _hashed(colour[key], sorted(lines)) for key, lines in seen.items()}
    return colour


def _hashed(*parts: object) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def _composite(a: Chart, b: Chart, states: Pairs) -> list[tuple[Level, Level]]:
    """Match states with states inside: by name, else those that have the same inside."""
    mine, its = ({level.path: level for level in chart.nesting.composite} for chart in (a, b))
    found = [(level, its[path]) for path, level in mine.items() if path in its]
    groups: dict[frozenset[str], list[Level]] = defaultdict(list)
    for path, level in its.items():
        if path not in mine:
            groups[frozenset(b.nesting.leaves_of(path))].append(level)
    for path, level in mine.items():
        inside = frozenset(states.get(name, "") for name in a.nesting.leaves_of(path))
        if path not in its and groups[inside]:
            found.append((level, groups[inside].pop(0)))  # the outermost first
    return found


def _matching(
    said: tuple[ChartMeaning, ChartMeaning],
    pairs: Mapping[str, Pairs],
    fixed: Pairs,
    guessed: tuple[str, ...],
) -> Matching:
    """Return a matching with the names of what no text declares: ages, histories, durations."""
    a, b = said[0].chart, said[1].chart
    names = dict(fixed) | {n: other for kind in KINDS[1:] for n, other in pairs[kind].items()}
    for name in (*a.inputs, *a.variables, *a.parameter_names):
        if name not in names:
            names[name] = name if name in SUPPLIED and name in b.inputs else f"{name}'"
    loose = set[str]()
    names |= {"age": "age"} if "age" in a.hidden else {}
    around = {"": ""}  # prefixes of hidden names
    levels = dict(pairs["state"])
    composite = _composite(a, b, pairs["state"])
    for one, other in composite:
        levels[one.path] = other.path
        names[one.age], names[one.last] = other.age, other.last
        around[one.age.removesuffix("age")] = other.age.removesuffix("age")
    for one, other in composite:  # a history is a number of a state inside
        if [levels.get(path) for path in one.inside()] != other.inside():
            loose.add(other.last)
    conditions = {
        (name.rpartition("duration")[0], canonical(tree)): name
        for name, tree in b.durations.items()
    }
    for name, tree in meaning_of(a, names).durations.items():
        before = name.removesuffix("'").rpartition("duration")[0]
        key = around.get(before, "'"), canonical(tree)
        names[name.removesuffix("'")] = conditions.get(key, name)
    loose |= {names[n] for n in (*a.nesting.histories, *a.durations) if names[n].endswith("'")}
    loose |= {*b.durations} - {names[n] for n in a.durations}
    return Matching(
        pairs["state"],
        pairs["variable"],
        pairs["parameter"],
        pairs["input"],
        levels,
        names,
        frozenset(loose),
        guessed,
    )
