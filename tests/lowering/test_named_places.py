"""Places have names: only `gms_fsm.lowering.layout` and `places` compute where something stands.

The state vector, what a run observes, modes and log are subscripted by what the layout returns,
never by arithmetic on the number of elements, a first place or a position. Found on the syntax
tree.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.bodies import bodies
from gms_fsm import Chart, ChartModel, Prescribed, Slider, State
from gms_fsm.errors import ParameterError
from gms_fsm.lowering.layout import SystemLayout
from gms_fsm.lowering.log_columns import CONTACT, LOG_NUMBERS, LOG_TEXTS, LogRecord
from gms_fsm.lowering.places import ElementPlaces, Places
from gms_fsm.lowering.program import lower
from gms_fsm.systems.reading.assembly import assembled
from gms_fsm.systems.system import system_of
from tests.helpers import ROOT, pulled_mass, stick_slip

HOMES = {Path("gms_fsm/lowering/layout.py"), Path("gms_fsm/lowering/places.py")}
SOURCES = [
    path.relative_to(ROOT)
    for package in ("gms_fsm", "plots")
    for path in sorted((ROOT / package).rglob("*.py"))
]
SIZES, POSITIONS = {"n", "first"}, {"i", "j"}  # what places are computed from
LAID_OUT = {"y", "dy", "y_before", "seen", "observed", "mode"}  # arrays with named places
# The same in generated text.
PRINTED = re.compile(r"\* n\b|\+ [ni]\b|\b(y|dy|out|mode)\[\d")

# Not about the layout: the code as it stands, by file, and why.
ALLOWED = {
    "gms_fsm/app/lessons/basics/l3_missed_window.py": {
        # The first firings of a log, as many as there are elements.
        "once.transitions.t[:MODEL.n]",
        "located.transitions.t[:MODEL.n]",
    },
    "gms_fsm/records/_selection.py": {"kept[:first]"},  # rows of a measured record
    "gms_fsm/lowering/pulses.py": {"rests[first:last]"},  # samples of a signal
    # The tables of counts, whose layout stands there alone.
    "gms_fsm/lowering/printing/counting.py": {"first + n * own.counts"},
    # In the vector of the MATLAB text, which has its own layout.
    "gms_fsm/exporters/targets/matlab.py": {"first + n", "n * len(order) + 1"},
    "plots/systems/elements.py": {  # lengths on paper
        "ROW * n + 0.15",
        "ROW * n + 0.3",
        "0.5 * ROW * n + 0.3",
        "0.5 * ROW * n - 0.3",
        "ROW * n - 0.1",
    },
}


def _words(node: ast.AST) -> set[str]:
    """Return the names in code; of ``model.n`` only ``n``."""
    owners = {id(sub.value) for sub in ast.walk(node) if isinstance(sub, ast.Attribute)}
    return {
        sub.id if isinstance(sub, ast.Name) else sub.attr.lstrip("_")
        for sub in ast.walk(node)
        if isinstance(sub, ast.Name | ast.Attribute) and id(sub) not in owners
    }


def _sums(node: ast.AST, *kinds: type[ast.operator]) -> list[ast.BinOp]:
    return [b for b in ast.walk(node) if isinstance(b, ast.BinOp) and isinstance(b.op, kinds)]


def _is_place(index: ast.expr) -> bool:
    """Tell whether an index is computed from sizes."""
    bounds = [b for s in ast.walk(index) if isinstance(s, ast.Slice) for b in (s.lower, s.upper)]
    behind = [b for b in _sums(index, ast.Add) if isinstance(b.left, ast.Constant)]  # 2 + i
    return bool(
        any(_words(each) & SIZES for each in _sums(index, ast.Add, ast.Sub))
        or any(_words(each) & (SIZES | POSITIONS) for each in (*_sums(index, ast.Mult), *behind))
        or any(isinstance(b, ast.Name | ast.Attribute) and _words(b) & SIZES for b in bounds if b)
    )


def _is_number(index: ast.expr) -> bool:
    """Tell whether an index is a number, or the position of an element and some more."""
    if isinstance(index, ast.Tuple):  # rows first, then places
        return any(_is_number(each) for each in index.elts[1:])
    if isinstance(index, ast.Constant):
        return isinstance(index.value, int)
    return any(_words(each) & POSITIONS for each in _sums(index, ast.Add, ast.Sub))


def _adds_blocks(node: ast.BinOp) -> bool:
    """Tell whether a sum has a multiple of n in it, or is one of sizes alone."""
    sides = (node.left, node.right)
    multiples = [
        side for side in sides for product in _sums(side, ast.Mult) if "n" in _words(product)
    ]
    return bool(multiples) or all(
        isinstance(side, ast.Name | ast.Attribute) and _words(side) & SIZES for side in sides
    )


def _found(text: str, *, printed: bool = True) -> Iterator[str]:
    """Yield the code of every place that is computed in a source text."""
    tree = ast.parse(text)
    documents = {
        id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)
    }  # docstrings may explain
    for node in ast.walk(tree):
        match node:
            case ast.Subscript(slice=index) if _is_place(index):
                yield ast.unparse(node)
            case ast.Subscript(value=ast.Name(name), slice=index) if name in LAID_OUT:
                if _is_number(index):
                    yield ast.unparse(node)
            case ast.Subscript(value=ast.Attribute(attr=name), slice=ast.Tuple() as index) if (
                name in LAID_OUT and _is_number(index)
            ):
                yield ast.unparse(node)
            case ast.BinOp(op=ast.Add() | ast.Sub()) if _adds_blocks(node):
                yield ast.unparse(node)
            case ast.Constant(value=str(words)) if printed and id(node) not in documents:
                if PRINTED.search(words):
                    yield words


# What once computed places: of a variable, a block, a table's columns, what is observed, states ...
FOUND = (
    "y[first + j * n + i]", "y[first : first + n]", "k = self._first + names.index(name) * self.n",
    "table[:, 2 + n : 2 + 2 * n]", "seen[2 + i]", "before[2 + i]", "seen[1]", "y[0]",
    "self.rows.y[:, 0]", "seen[2 + 2 * model.n :]", "rates[j * model.n + i]",
    "rows.mode[:, : self.n]", "mode[program.n :]", "(variable, program.first + j * n)",
    "first = -n * len(variables); y[first:][:n]", "(1 if prescribed else 2) + n * len(variables)",
    "slice(first, first + trace.n)", "y[i + 1]", 'f"{base} + {row} * n + i"', 'f"y[{base} + i]"',
    'line = "v = y[1]"',
)  # fmt: skip
FINE = (
    "y[places.index('z', i)]", "y[layout.y.block('z')]", "mode[i]", "times[i + 1]",
    "rows.y[row - 1]", "rows.y[0]", "first.t_last - first.t_first", "cells[i : i + 3]",
    "values[f'{name}{i + 1}']", "'''Blocks of n: first + j * n + i.'''", "range(n)", "n * [0.0]",
)  # fmt: skip


def test_the_search_finds_what_it_looks_for_and_leaves_the_rest_alone() -> None:
    assert [code for code in FOUND if not list(_found(code))] == []
    assert [code for code in FINE if list(_found(code))] == []


@pytest.mark.slow
def test_no_place_is_computed_outside_the_layout() -> None:
    wrong = {}
    for path in SOURCES:
        text = (ROOT / path).read_text(encoding="utf-8")
        found = set(_found(text, printed="lowering" in path.parts))
        if path in HOMES:
            assert found != set()
        elif found != ALLOWED.get(path.as_posix(), set()):
            wrong[path.as_posix()] = found
    assert wrong == {}
    assert {Path(name) for name in ALLOWED} <= set(SOURCES)


# --------------------------------------------------------------------------- the layout itself
@pytest.mark.parametrize("n", [1, 2, 5])
@pytest.mark.parametrize("rig", [Prescribed("0.1"), Slider(1.0, "1")])
def test_every_place_has_one_name(rig: Prescribed | Slider, n: int) -> None:
    flow = {"z": "v", "w": "-w"}
    chart = Chart("two", ("v",), ("z", "w"), (), (State("only", flow),), (), {"F": "z + w"})
    model = ChartModel(chart, {}, n=n)
    layout = SystemLayout.of(assembled(system_of(model, rig)), surfaces=3)
    for places in (layout.y, layout.observed):
        numbers = [places.index(name, i or 0) for name, i in places]
        assert numbers == list(range(places.size))
        assert places.joined(places.named(numbers)) == numbers
        for name in (*places.shared, *places.own):
            assert list(places.all_of(name)) == [k for k, (u, _) in enumerate(places) if u == name]
    modes = list(range(layout.modes))
    assert modes[layout.elements] + modes[layout.slides] == modes
    assert len(modes[layout.slides]) == 3
    assert layout.not_sliding([7] * n) == (*[7] * n, 0, 0, 0)


@pytest.mark.parametrize("n", [1, 2, 5])
@pytest.mark.parametrize("shared", [(), ("x",), ("x", "v")])
@pytest.mark.parametrize("others", [None, 1, 4])
def test_texts_name_the_same_places(shared: tuple[str, ...], n: int, others: int | None) -> None:
    blocks = [ElementPlaces(("z", "w", "u"), n)]
    if others is not None:
        blocks = [
            ElementPlaces(("a",), others, "m"),
            ElementPlaces[str]((), 2, "k"),
            *blocks,
            ElementPlaces(("b",), 3, "l"),
        ]
    places = Places(shared, tuple(blocks))
    sizes = {block.size: block.n for block in blocks}
    for place, (name, i) in enumerate(places):
        assert eval(places.text(name), {**sizes, "i": i}) == place
        used = {size: sizes[size] for size in places.sizes(name)}
        assert i is not None or places.start_text(name) == str(place)
        assert eval(places.text(name), {**used, "i": i}) == place
        if i is not None:
            first, end = (eval(places.start_text(name, k), dict(sizes)) for k in (0, 1))
            assert first + i == place
            assert first <= place < end
    with pytest.raises(KeyError):
        places.sizes("nowhere")
    assert eval(places.size_text(), dict(sizes)) == places.size
    assert eval(places.size_text(2), dict(sizes)) == places.size + 2


def test_one_of_several_contacts_is_named() -> None:
    layout = lower(bodies("chain", 2)).layout
    assert layout.contact("c1").name == "c1"
    with pytest.raises(
        ParameterError, match=r"the contacts c0, c1; say which one: \.contact\('c0'\)"
    ):
        layout.contact()


def test_machine_code_finds_what_it_writes_into_the_log() -> None:
    """`integrators.runners.columns.record` is told where the numbers of a firing are."""
    layout = lower(stick_slip("signed"), pulled_mass()[1]).layout
    own, seen = layout.recorded
    names = list(layout.y)
    assert [names[place] for place in own] == [("friction.z", i) for i in range(4)]
    observed = [name for name, _ in layout.observed]
    assert [observed[place] for place in seen[3]] == ["friction.v", "friction.s", "friction.F"]
    assert seen[3][1] == layout.observed.index("friction.s", 3)
    assert LOG_NUMBERS == ("z", "v", "s", "F_before", "F_after")
    assert LogRecord._fields == ("t", "element", *LOG_TEXTS, *LOG_NUMBERS, CONTACT)
