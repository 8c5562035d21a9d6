"""What machine code depends on besides a system: the loop, how it is translated, and Python."""

from __future__ import annotations

import functools
import hashlib
import sys
from collections.abc import Callable
from types import CodeType, FunctionType
from typing import Any

from integrators import advance, crossings, elementary, loop, sliding, step_size, steps
from integrators.machine_code import layout as layouts
from integrators.machine_code import llvm, objects, records, tree, whole_numbers
from integrators.machine_code.front_end import (
    bindings,
    expressions,
    passing,
    sources,
    statements,
    translate,
    values,
    work,
)
from integrators.machine_code.tuning import APART, HOT, INLINE, KEEPING
from integrators.runners import columns, observing, repeating, stepping
from integrators.switching import jolts, sliding_bounds
from integrators.tangents import motion
from integrators.tangents import run as tangent_run
from integrators.tangents import switches as tangent_switches

# What is translated: the loop, and what it calls.
LOOPS = (
    elementary, whole_numbers, steps, step_size, crossings, advance, sliding, sliding_bounds, jolts,
    loop, columns, stepping, observing, repeating, motion, tangent_switches, tangent_run,
)  # fmt: skip


def digest(*functions: Callable[..., Any], text: str = "") -> str:
    """Return a hash of what some functions do.

    It is computed from their code as loaded, not from their files: these may have been replaced
    under a running program, which would then store its old code under the new name.
    """
    stamp = hashlib.sha256(text.encode())
    codes = [function.__code__ for function in functions]
    while codes:
        code = codes.pop()
        codes += [u for u in code.co_consts if isinstance(u, CodeType)]
        constants = [u for u in code.co_consts if not isinstance(u, CodeType)]
        stamp.update(repr((code.co_code, code.co_names, code.co_varnames, constants)).encode())
    return stamp.hexdigest()[:16]


@functools.cache
def edition() -> str:
    """Return a hash of what the loop computes, whatever system it runs."""
    front = (sources, work, bindings, passing, expressions, statements, translate)
    tools = (*front, values, tree, records, layouts, llvm, objects)
    functions: list[Callable[..., Any]] = []
    constants: list[tuple[str, Any]] = []
    for module in (*LOOPS, *tools):
        for name, found in vars(module).items():
            value = getattr(found, "__wrapped__", found)  # inside a cache
            if isinstance(value, FunctionType) and value.__module__ == module.__name__:
                functions.append(value)
            elif isinstance(value, type) and value.__module__ == module.__name__:
                members = vars(value).values()
                functions += [each for each in members if isinstance(each, FunctionType)]
            number = isinstance(value, int | float | str) or _is_table(value)
            if number and not name.startswith("__"):
                constants.append((name, value))
            elif isinstance(value, dict) and {*map(type, value.values())} in ({str}, {bool}):
                constants.append((name, sorted(value.values())))  # an empty one is filled later
            else:
                constants.append((name, getattr(value, "__match_args__", None)))
    return digest(
        *functions,
        text=repr(
            (sys.version, constants, sorted(INLINE.items()), *map(sorted, (HOT, KEEPING)), APART)
        ),
    )


def _is_table(value: Any) -> bool:
    """Return whether a value is a tuple of floats, or of such tuples."""
    if not isinstance(value, tuple) or hasattr(value, "_fields"):
        return isinstance(value, float)
    return bool(value) and all(map(_is_table, value))
