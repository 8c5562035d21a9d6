"""The text of a program is linear in the number of contacts, for chains, trees and small loops.

It does not nest deeper with them: what translates it is recursive, and 200 bodies must run.
"""

from __future__ import annotations

import ast
import re
from collections import Counter

import pytest

from benchmarks.bodies import DRY, KINDS, NUMBERS, bodies
from gms_fsm import Contact, System
from gms_fsm.charts import CHARTS
from gms_fsm.lowering.program import lower

LOOPS = "pairs on the ground that rub on each other"  # more locks than velocities


def _system(kind: str, n: int) -> System:
    if kind != LOOPS:
        return bodies(kind, n)
    ground = bodies("on the ground", 2 * n)
    rub = [
        Contact(f"r{i}", CHARTS["stiction"], DRY, v=f"v{2 * i} - v{2 * i + 1}") for i in range(n)
    ]
    contacts = [*ground.contacts, *rub]
    return System(kind, bodies=ground.bodies, contacts=contacts, numbers=NUMBERS)


def _lines(kind: str, n: int) -> Counter[str]:
    """Count the lines of each function."""
    found: Counter[str] = Counter()
    for part in re.split(r"^def ", lower(_system(kind, n)).source, flags=re.MULTILINE)[1:]:
        found[part.partition("(")[0]] = len(part.splitlines())
    return found


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*KINDS, LOOPS])
def test_twice_as_many_contacts_add_twice_as_many_lines(kind: str) -> None:
    few, more, most = (_lines(kind, n) for n in (3, 5, 9))
    assert few["flow"] > 3 * 10
    for name in few:
        assert most[name] - more[name] <= 2.1 * (more[name] - few[name]), name


def _depth(source: str) -> int:
    """Return how deep a text is nested; an elif is in the else of the branch before it."""
    deepest, waiting = 0, [(ast.parse(source), 0)]
    while waiting:
        node, depth = waiting.pop()
        deepest = max(deepest, depth)
        waiting += [(each, depth + 1) for each in ast.iter_child_nodes(node)]
    return deepest


@pytest.mark.slow
def test_many_contacts_do_not_nest_deeper_than_fifty() -> None:
    fifty, many = (_depth(lower(bodies("chain", n)).source) for n in (50, 120))
    assert many <= fifty + 2
