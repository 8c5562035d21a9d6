"""A program's functions compiled to machine code from the same generated text (extra ``fast``)."""

from __future__ import annotations

import functools
import importlib.util
import math
import os
import re
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm._extras import missing
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.errors import SignalError
from gms_fsm.language import sgn
from gms_fsm.lowering._generated import load
from gms_fsm.lowering._store import Store
from gms_fsm.lowering.program import Arguments, Program
from gms_fsm.systems.signals import piecewise_linear, piecewise_slope

__all__ = ["check_numba", "machine_code", "notify", "observe_rows", "packed", "store"]

Packed = tuple[FloatArray, FloatArray, FloatArray]
_lock = threading.RLock()  # a sweep may compile from several threads


def check_numba() -> None:
    """Raise an error unless numba is installed.

    Raises
    ------
    MissingExtraError
        With advice on how to install it.
    """
    for module in ("numba", "platformdirs"):
        if importlib.util.find_spec(module) is None:
            raise missing(module, "fast")


def packed(p: Arguments) -> Packed:
    """Return a program's arguments as arrays.

    Parameters
    ----------
    p : tuple of lists
        ``Program.p``.

    Returns
    -------
    tuple of ndarray
        Shared numbers (m,), own parameters (rows, n), corner tables (2 tables, corners). Shorter
        rows are padded by repeating their last entry: elements that no contact has, corners that
        change no value.

    Examples
    --------
    >>> packed(([2.0], [[1.0, 1.0]], []))[1].shape
    (1, 2)
    """
    shared, own, tables = p
    return np.array(shared, dtype=np.float64), _table(own), _table(tables)


def _table(rows: list[list[float]]) -> FloatArray:
    length = max(map(len, rows), default=0)
    padded = [row + row[-1:] * (length - len(row)) for row in rows]
    return np.array(padded, dtype=np.float64).reshape(len(rows), length)


def machine_code(program: Program, *names: str) -> list[Any]:
    """Return some of a program's functions, compiled to machine code.

    Parameters
    ----------
    program : Program
        From `gms_fsm.lowering.program.lower`.
    *names : str
        For example ``"flow"``.

    Returns
    -------
    list of callable
        Functions that take the arrays from `packed`.

    Raises
    ------
    MissingExtraError
        If numba is not installed.
    SignalError
        If numba cannot compile a Python function used as a signal.
    """
    check_numba()
    with _lock:
        given = tuple(program.callables.items())
        return [_machine_code(program.source, given, name) for name in names]


@functools.lru_cache(maxsize=512)
def _machine_code(
    source: str, callables: tuple[tuple[str, Callable[[float], float]], ...], name: str
) -> Any:
    from integrators import compiled

    function = _loaded(source, callables)[name]
    # The linker identifies machine code loaded from disk by its function's name alone: without a
    # unique name, the flow of one program would be run in place of another's.
    stamp = compiled.digest(sgn, piecewise_linear, _loaded.__wrapped__, text=source)
    function.__qualname__ = f"{name}_{stamp}"
    # A user's function may change while its text stays the same: such code is not cached.
    return compiled.compiled(name, function, None if callables else store())


@functools.lru_cache(maxsize=64)
def _loaded(
    source: str, callables: tuple[tuple[str, Callable[[float], float]], ...]
) -> dict[str, Any]:
    """Load a text together with the functions that machine code can call."""
    from integrators import compiled

    for helper in (sgn, piecewise_linear, piecewise_slope):
        compiled.usable_inside(helper)
    # The name of an existing module: numba imports it when it loads machine code from disk.
    names: dict[str, Any] = {
        "piecewise_linear": piecewise_linear,
        "piecewise_slope": piecewise_slope,
        "pow": _power(),
        "nan": math.nan,
        "__name__": __name__,
    }
    for name, call in callables:
        names[f"{name}_signal"] = _compiled_signal(name, call)
    return load("compiled program", source, names)


@functools.cache
def _power() -> Any:
    """Return ``pow`` of the C library, which `math.pow` calls.

    Otherwise LLVM would turn 8**z into exp2 and z**0.5 into sqrt, which differ in the last bits.
    """
    from numba import types
    from numba.core.cgutils import ir
    from numba.extending import intrinsic

    def call(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        number = ir.DoubleType()
        declared = builder.module.globals.get("pow") or ir.Function(
            builder.module, ir.FunctionType(number, [number, number]), "pow"
        )
        declared.attributes.add("nobuiltin")
        return builder.call(declared, arguments)

    def power(_typing: Any, _base: Any, _exponent: Any) -> Any:
        return types.float64(types.float64, types.float64), call

    return intrinsic(power)


@functools.cache
def store() -> Store | None:
    """Return the cache for machine code, or None if no cache can be used.

    It is in the platform's folder for caches, or in NUMBA_CACHE_DIR.

    Returns
    -------
    Store or None
        Ready for use.
    """
    from platformdirs import user_cache_path

    given = os.environ.get("NUMBA_CACHE_DIR")
    return Store.at((Path(given) if given else user_cache_path("gms-fsm")) / "machine-code")


def notify(text: str) -> None:
    """Print a message about a slow step to stderr.

    Parameters
    ----------
    text : str
        What is being compiled, or how long that took.
    """
    print(f"gms-fsm: {text}", file=sys.stderr)


def _compiled_signal(name: str, call: Callable[[float], float]) -> Any:
    import numba

    jit = numba.njit(
        numba.types.float64(numba.types.float64), error_model="numpy", boundscheck=True
    )
    try:
        return jit(getattr(call, "py_func", call))
    except Exception as error:  # numba raises many kinds, including TypeError and its own
        lines = (re.sub(r"\x1b\[\d*m", "", line).strip() for line in str(error).splitlines())
        reason = next((u for u in lines if u and not u.startswith("Failed in nopython mode")), "")
        raise SignalError(
            f"numba cannot compile the function ({type(error).__name__}: {reason})",
            place=f"signal {name!r}",
            advice="use engine='machines', or give the signal as an expression in t or as "
            "arrays (times, values)",
        ) from None


def observe_rows(
    program: Program, t: FloatArray, y: FloatArray, mode: NDArray[np.int64]
) -> FloatArray:
    """Return the result of `observe` for many rows, with all signs evaluated live.

    Parameters
    ----------
    program : Program
        The program.
    t, y, mode : ndarray, shapes (rows,), (rows, m), (rows, n)
        The rows.

    Returns
    -------
    ndarray, shape (rows, observed)
        Bit for bit the same as the readable engine.
    """
    from integrators import compiled

    table = np.empty((t.size, program.layout.observed.size))
    [observe] = machine_code(program, "observe")
    compiled.for_each_row(
        observe,
        (np.ascontiguousarray(t), np.ascontiguousarray(y), np.ascontiguousarray(mode)),
        np.array(program.live),
        packed(program.p),
        table,
        store(),
    )
    return table
