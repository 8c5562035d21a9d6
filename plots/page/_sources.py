"""Where a live page finds the values of a run: in the rows that its engine computes, by name.

A replay page has columns of values; a live page has in their places recipes: a list whose first
part says what kind it is, such as ``["seen", 3]``, the fourth of the observed values of a row.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gms_fsm.exporters.live import LiveEngine, floats_text
from gms_fsm.language import Name, Value, names_in
from gms_fsm.systems.signals import Corners
from gms_fsm.traces.trace import Trace
from plots.page._run import views_of
from plots.page._trees import tree_of

CURVE, WEIGHT = "curve ", "threshold weight"  # of numbers of a program


class RecipePool:
    """The recipes of a run; equal ones are stored once."""

    def __init__(self) -> None:
        self.recipes: list[list[Any]] = []

    def add(self, *recipe: Any) -> int:
        """Store a recipe and return its number."""
        if [*recipe] not in self.recipes:
            self.recipes.append([*recipe])
        return self.recipes.index([*recipe])


def live_run(stored: Mapping[str, Any], trace: Trace, engine: LiveEngine) -> dict[str, Any]:
    """Return the data of a run with recipes in place of its columns, rows and log."""
    pool, views = RecipePool(), views_of(trace)
    contacts = [
        _contact(each, view, pool, engine)
        for each, view in zip(stored["contacts"], views, strict=True)
    ]
    found = {"title": stored["title"], "t": pool.add("t"), "contacts": contacts, "system": None}
    if trace.subject.named:
        terms = _Terms(trace, pool, engine)
        found["system"] = _system(stored["system"], trace, terms)
        found["names"] = {name: terms.watched(name) for name in stored["names"]}
        found["terms"] = terms.known  # what trees read
    else:
        found["names"] = {name: _of_view(views[0], pool, engine, name) for name in stored["names"]}
    return {**found, "pool": pool.recipes}


def _contact(
    stored: Mapping[str, Any], view: Trace, pool: RecipePool, engine: LiveEngine
) -> dict[str, Any]:
    bank, layout = view.places, view.program.layout
    values: dict[str, Any] = {}
    for name in stored["values"]:
        if name.startswith("#"):
            continue  # elementary functions have the bits of Python here: the tree is computed
        own = name in bank.variables or name == "s" or bank.of(name) in layout.shown.own
        if own:
            values[name] = {"by": [_column(view, pool, name, i) for i in range(view.n)]}
        else:
            values[name] = {"all": _column(view, pool, name)}
    force = bank.of("F_elements")
    forces = [
        pool.add("seen", layout.observed.index(force, i) if force in layout.observed.own else -1)
        for i in range(view.n)
    ]
    words = {
        name.removeprefix(bank.of("")): word
        for name, word in engine.words.items()
        if name.startswith(bank.of(""))
    }
    parameters = {
        name: [words[name], view.n if isinstance(value, list) else 0]
        for name, value in stored["parameters"].items()
        if name in words
    }
    curve = {
        name: words[f"{CURVE}{name}"]
        for name in (stored["curve"] or {"numbers": ()})["numbers"]
        if f"{CURVE}{name}" in words
    }
    dropped = ("switches", "log", "initial")
    kept = {key: each for key, each in stored.items() if key not in dropped}
    states = [state.name for state in view.model.chart.states]
    order = [(edge["name"], states[edge["source"]]) for edge in stored["edges"]]
    mine = layout.edges[bank.first_edge : bank.first_edge + len(order)]
    more = {
        "edgeNumbers": [order.index((name, source)) for name, source, _ in mine],
        "words": {"parameters": parameters, "curve": curve, "weights": words[WEIGHT]},
    }
    return {**kept, **more, "values": values, "forces": forces}


def _column(view: Trace, pool: RecipePool, name: str, element: int | None = None) -> int:
    """Return the recipe of what guards of a contact read, or plots of it show."""
    bank, layout = view.places, view.program.layout
    each = () if element is None else (element,)
    if name == "t":
        return pool.add("t")
    whole = bank.position if name == "x" else bank.of(name)
    for kind, places in (("y", layout.y), ("seen", layout.observed), ("shown", layout.shown)):
        if whole in places.shared or whole in places.own:
            return pool.add(kind, places.index(whole, *each))
    return pool.add("y", layout.y.index(name))  # an event


def _of_view(view: Trace, pool: RecipePool, engine: LiveEngine, name: str) -> int:
    """Return the recipe of a name in conditions: z1 is z of the first element."""
    bank, layout = view.places, view.program.layout
    if name == "s":  # the curve
        first = pool.add("seen", layout.observed.index(bank.of("s"), 0))
        return pool.add("over", first, engine.words[bank.of(WEIGHT)])
    quantities = {each: each for each in (*bank.variables, "s")} | {"F": "F_elements"}
    for plain, quantity in quantities.items():
        number = name.removeprefix(plain)
        if name.startswith(plain) and number.isdigit() and 1 <= int(number) <= view.n:
            return _column(view, pool, quantity, int(number) - 1)
    return _column(view, pool, name, 0 if name in bank.variables else None)


class _Terms:
    """The names of a system."""

    def __init__(self, trace: Trace, pool: RecipePool, engine: LiveEngine) -> None:
        self.trace, self.pool, self.engine = trace, pool, engine
        self.system, self.layout = trace.what.system, trace.program.layout
        self.views = {name: trace.contact(name) for name in trace.what.machines}
        self.given = {each.name: each for each in self.system.assembly.definitions}
        self.known: dict[str, int] = {}

    def watched(self, name: str) -> int:
        """Return the recipe of a name in conditions."""
        if name in self.system.names:
            return self.term(name)
        owner, _, own = name.rpartition(".")
        view = self.views[owner] if owner else next(iter(self.views.values()))
        return _of_view(view, self.pool, self.engine, own)

    def term(self, name: str) -> int:
        """Return the recipe of a name in texts of the system."""
        if name not in self.known:
            self.known[name] = self._found(name)
        return self.known[name]

    def _found(self, name: str) -> int:
        pool, system = self.pool, self.system
        if name == "t":
            return pool.add("t")
        if name in system.numbers:
            word = self.engine.words.get(name)
            value = system.numbers[name]
            return pool.add("constant", value) if word is None else pool.add("word", word)
        driven = any(body.driven and body.v == name for body in system.bodies)
        if name in system.signals or driven:
            signal = self.given[name].signal
            if isinstance(signal, Corners):
                return pool.add("corners", *map(floats_text, (signal.times, signal.values)))
            tree = self.given[name].tree
            assert tree is not None
            return self.computed(tree)
        if name in system.let:
            return self.computed(system.assembly.expanded(Name(name)))
        if name not in self.layout.y.shared:
            return pool.add("seen", self.layout.observed.index(name))
        return pool.add("y", self.layout.y.index(name))

    def computed(self, tree: Value) -> int:
        """Return the recipe of a tree, and see to what it reads."""
        for name in names_in(tree):
            self.term(name)
        return self.pool.add("tree", tree_of(tree))


def _system(stored: Mapping[str, Any], trace: Trace, terms: _Terms) -> dict[str, Any]:
    """Return the motion of bodies and further values, with recipes."""
    bodies = [
        {"name": body.name, "unit": body.unit, "x": terms.term(body.x), "v": terms.term(body.v)}
        for body in trace.what.system.bodies
    ]
    values = [{**each, "column": terms.term(each["name"])} for each in stored["values"]]
    return {**stored, "bodies": bodies, "values": values}
