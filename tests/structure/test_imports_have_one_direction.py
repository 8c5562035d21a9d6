"""Claim: no module imports upwards and nothing is in a circle, imports inside functions included.

The rooms and their order are those of the import contracts. Imports for type checkers only do not
count, and a name that the façade hands on counts as an import of its home.
"""

from __future__ import annotations

import ast
import functools
import tomllib
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import gms_fsm
from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.foundation import display
from tests.helpers import ROOT

PACKAGES = ("gms_fsm", "integrators", "plots")
FACADE = "gms_fsm"  # it imports nothing of a room but by name, when the name is asked for
HANDED_ON = {"gms_fsm._neighbours", "gms_fsm._version"}  # modules that import nothing of ours

Graph = Mapping[str, set[str]]


def imported(tree: ast.AST, modules: frozenset[str]) -> Iterator[str]:
    """Yield the modules that a syntax tree imports."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            for each in node.orelse:
                yield from imported(ast.Module([each], []), modules)
            continue
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names if each.name in modules)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "imports are absolute"
            yield from (_named(str(node.module), each.name, modules) for each in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).endswith("import_module"):
            yield from (each.value for each in node.args if isinstance(each, ast.Constant))
        yield from imported(node, modules)


def _named(module: str, name: str, modules: frozenset[str]) -> str:
    if f"{module}.{name}" in modules:
        return f"{module}.{name}"
    if module == FACADE and name in gms_fsm.__all__:
        return f"{FACADE}.{gms_fsm._HOME[name]}"
    return module


@functools.cache
def graph() -> Graph:
    """Return which modules each module of the packages imports."""
    paths = {_name(path): path for each in PACKAGES for path in (ROOT / each).rglob("*.py")}
    modules = frozenset(paths)
    found = {
        name: set(imported(ast.parse(path.read_text(encoding="utf-8")), modules)) & modules
        for name, path in paths.items()
    }
    assert sum(map(len, found.values())) > 2000
    return found


def _name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def circle(arrows: Graph) -> list[str]:
    """Return a circle, or an empty list."""
    try:
        TopologicalSorter(arrows).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


@functools.cache
def floors() -> Mapping[str, int]:
    """Return the floor of each room, from the import contract of all of them; 0 is the lowest."""
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    layers = tool["importlinter"]["contracts"][0]["layers"]
    return {
        room.strip(): floor
        for floor, rooms in enumerate(reversed(layers))
        for room in rooms.split("|")
    }


def room(module: str) -> str:
    """Return the room of a module: a package of gms_fsm, a module there, or a whole package."""
    parts = module.split(".")
    return ".".join(parts[: 2 if parts[0] == "gms_fsm" else 1])


def between_rooms() -> Graph:
    arrows: dict[str, set[str]] = {}
    for module, others in graph().items():
        arrows.setdefault(room(module), set()).update(map(room, others))
    return {each: others - {each} for each, others in arrows.items()}


def test_every_room_has_its_floor() -> None:
    assert {*between_rooms()} - {FACADE, *HANDED_ON} == {*floors()}
    assert max(floors(), key=lambda each: floors()[each]) == "gms_fsm.app"


def test_no_import_leads_upwards() -> None:
    upwards = [
        f"{module} -> {other}"
        for module, others in graph().items()
        for other in others
        if room(module) != room(other)
        and floors().get(room(module), 99) <= floors().get(room(other), -1)
    ]
    assert upwards == []


def test_rooms_are_in_no_circle() -> None:
    assert circle(between_rooms()) == []


def test_modules_are_in_no_circle() -> None:
    assert circle(graph()) == []


def test_no_contract_ignores_an_import() -> None:
    assert "ignore_imports" not in (ROOT / "pyproject.toml").read_text(encoding="utf-8")


def test_what_draws_is_found_by_its_declaration() -> None:
    group = tomllib.loads(display.PROJECT.read_text(encoding="utf-8"))["project"]["entry-points"]
    for name, declared in group[display.GROUP].items():
        found = display.asked(name)
        assert f"{found.__module__}:{found.__name__}" == declared


def test_without_what_draws_a_notebook_shows_the_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(display, "asked", display.asked.__wrapped__)
    monkeypatch.setattr(display, "_declared", lambda: iter(()))
    assert GMS_ELEMENT["signed"]._repr_svg_() is None  # type: ignore[attr-defined]


def test_the_walk_sees_imports_in_functions_and_skips_those_for_types() -> None:
    text = """
if TYPE_CHECKING:
    from plots import film
else:
    import plots.style
from gms_fsm import simulate
def draw():
    from plots import figures, overview
    import_module("integrators.loop")
"""
    modules = frozenset({"plots", "plots.figures", "plots.film", "plots.style"})
    assert [*imported(ast.parse(text), modules)] == [
        "plots.style",
        "gms_fsm.run.simulate",
        "plots.figures",
        "plots",
        "integrators.loop",
    ]
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) in (["b", "c", "b"], ["c", "b", "c"])
