"""Claim: no import leads upwards or in a circle, and each name, module and folder has its room.

Imports inside functions count, those for type checkers only do not, and a name that the façade
hands on counts as an import of its home. The rooms and their order are those of the import
contracts.
"""

from __future__ import annotations

import ast
import functools
import tomllib
from collections import defaultdict
from collections.abc import Iterator, Mapping
from graphlib import CycleError, TopologicalSorter
from typing import Any

import pytest

import gms_fsm
from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.foundation import display
from tests.helpers import ROOT
from tests.structure.source import PACKAGES, sources

FACADE = "gms_fsm"  # it imports nothing of a room but by name, when the name is asked for
HANDED_ON = {"gms_fsm._neighbours", "gms_fsm._version"}  # modules that import nothing of ours
MOST = 12  # files in a folder
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
CONTRACTS: list[dict[str, Any]] = PROJECT["tool"]["importlinter"]["contracts"]

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
    modules = frozenset(sources())
    found = {name: {*imported(each.tree, modules)} & modules for name, each in sources().items()}
    assert sum(map(len, found.values())) > 2000
    return found


def circle(arrows: Graph) -> list[str]:
    """Return a circle, or an empty list."""
    try:
        TopologicalSorter(arrows).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def floors(contract: Mapping[str, Any]) -> Mapping[str, int]:
    """Return the floor of each room of a contract; 0 is the lowest."""
    layers = contract["layers"]
    (container,) = contract.get("containers", [""])
    return {
        f"{container}.{room.strip()}".lstrip("."): floor
        for floor, rooms in enumerate(reversed(layers))
        for room in rooms.split("|")
    }


def room(module: str) -> str:
    """Return the room of a module: a package of gms_fsm, a module there, or a whole package."""
    parts = module.split(".")
    return ".".join(parts[: 2 if parts[0] == "gms_fsm" else 1])


@pytest.mark.slow
def test_no_import_leads_upwards_or_in_a_circle() -> None:
    rooms, between = floors(CONTRACTS[0]), defaultdict[str, set[str]](set)
    upwards = []
    for module, others in graph().items():
        between[room(module)] |= {room(other) for other in others} - {room(module)}
        upwards += [
            f"{module} -> {other}"
            for other in others
            if room(module) != room(other)
            and rooms.get(room(module), 99) <= rooms.get(room(other), -1)
        ]
    assert {*between} - {FACADE, *HANDED_ON} == {*rooms}  # every room has its floor
    assert upwards == []
    assert circle(between) == []
    assert circle(graph()) == []


@pytest.mark.slow
@pytest.mark.parametrize("contract", CONTRACTS[1:], ids=lambda each: each["name"])
def test_a_room_with_floors_of_its_own(contract: dict[str, Any]) -> None:
    inner = floors(contract)

    def part(module: str) -> str:
        return ".".join(module.split(".")[:3])

    upwards = [
        f"{module} -> {other}"
        for module, others in graph().items()
        for other in others
        if part(module) != part(other) and inner.get(part(module), 99) <= inner.get(part(other), -1)
    ]
    assert {*inner} <= {part(module) for module in graph()}
    assert upwards == []


def test_no_contract_ignores_an_import() -> None:
    assert not [each for each in CONTRACTS if "ignore_imports" in each]


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


@pytest.mark.slow
def test_what_draws_is_found_by_its_declaration() -> None:
    for name, declared in PROJECT["project"]["entry-points"][display.GROUP].items():
        found = display.asked(name)
        assert f"{found.__module__}:{found.__name__}" == declared


def test_without_what_draws_a_notebook_shows_the_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(display, "asked", display.asked.__wrapped__)
    monkeypatch.setattr(display, "_declared", lambda: iter(()))
    assert GMS_ELEMENT["signed"]._repr_svg_() is None  # type: ignore[attr-defined]


# --------------------------------------------------------------------------- names
@pytest.mark.slow
def test_no_class_name_stands_twice() -> None:
    found = defaultdict(list)
    for name, source in sources().items():
        for node in source.nodes:
            if isinstance(node, ast.ClassDef):
                found[node.name].append(name)
    assert {name: places for name, places in found.items() if len(places) > 1} == {}


@pytest.mark.slow
def test_a_private_module_is_imported_in_its_own_room_only() -> None:
    wrong = set()
    for name, source in sources().items():
        here = name if source.is_package else name.rpartition(".")[0]
        for node in source.nodes:
            if isinstance(node, ast.ImportFrom) and node.module:
                for each in node.names:
                    parts = f"{node.module}.{each.name}".split(".")
                    private = [i for i, part in enumerate(parts[:-1]) if part[0] == "_"]
                    if f"{node.module}.{each.name}" in sources() and each.name[0] == "_":
                        private.append(len(parts) - 1)
                    owner = ".".join(parts[: min(private)]) if private else ""
                    if owner in sources() and not f"{here}.".startswith(f"{owner}."):
                        wrong.add(f"{name} imports {node.module}.{each.name}")
    assert wrong == set()


def test_no_folder_has_more_than_12_files() -> None:
    folders = [path for each in PACKAGES for path in (ROOT / each, *(ROOT / each).rglob("*/"))]
    counts = {
        str(folder.relative_to(ROOT)): sum(
            each.is_file() and each.suffix != ".toml"  # the scenarios are data
            for each in folder.iterdir()
        )
        for folder in folders
        if folder.name != "__pycache__"
    }
    assert {name: count for name, count in counts.items() if count > MOST} == {}
