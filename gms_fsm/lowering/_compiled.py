"""A program's functions as machine code, from the same generated text (extra ``fast``)."""

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

__all__ = ["check_numba", "machine_code", "observe_rows", "packed", "store", "tell"]

Packed = tuple[FloatArray, FloatArray, FloatArray]
_lock = threading.RLock()  # a sweep asks from several threads


def check_numba() -> None:
    """Raise unless numba is there.

    Raises
    ------
    MissingExtraError
        With what to do.
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
        Shared numbers (m,), own parameters (rows, n), corner tables (2 tables, corners). Tables
        shorter than the longest repeat their last corner, which changes no value.

    Examples
    --------
    >>> packed(([2.0], [[1.0, 1.0]], []))[1].shape
    (1, 2)
    """
    shared, own, tables = p
    length = max(map(len, tables), default=0)
    padded = [row + row[-1:] * (length - len(row)) for row in tables]
    return (
        np.array(shared, dtype=np.float64),
        np.array(own, dtype=np.float64),
        np.array(padded, dtype=np.float64).reshape(len(tables), length),
    )


def machine_code(program: Program, name: str) -> Any:
    """Return one of a program's functions as machine code.

    Parameters
    ----------
    program : Program
        From `gms_fsm.lowering.program.lower`.
    name : str
        Such as ``"flow"``.

    Returns
    -------
    callable
        Over the arrays of `packed`.

    Raises
    ------
    MissingExtraError
        If numba is not installed.
    SignalError
        If numba cannot compile a Python function that is a signal.
    """
    check_numba()
    with _lock:
        return _machine_code(program.source, tuple(program.callables.items()), name)


@functools.lru_cache(maxsize=512)
def _machine_code(
    source: str, callables: tuple[tuple[str, Callable[[float], float]], ...], name: str
) -> Any:
    from integrators import compiled

    function = _loaded(source, callables)[name]
    # The linker knows machine code from disk by its function's name alone: without a name of its
    # own the flow of one program would be run in place of another's.
    stamp = compiled.digest(sgn, piecewise_linear, _loaded.__wrapped__, text=source)
    function.__qualname__ = f"{name}_{stamp}"
    # A user's function may change without its text changing: such code is not kept.
    return compiled.compiled(name, function, None if callables else store())


@functools.lru_cache(maxsize=64)
def _loaded(
    source: str, callables: tuple[tuple[str, Callable[[float], float]], ...]
) -> dict[str, Any]:
    """Load a text with what machine code can call."""
    from integrators import compiled

    for helper in (sgn, piecewise_linear, piecewise_slope):
        compiled.usable_inside(helper)
    # The name of a module that exists: numba imports it when it loads machine code from disk.
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
    """Return ``pow`` of the C library, which `math.pow` is.

    Left to itself LLVM makes 8**z an exp2 and z**0.5 a sqrt, whose last bits are others.
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
    """Return where machine code is kept, None where nothing can be.

    It is the platform's folder for caches, or NUMBA_CACHE_DIR.

    Returns
    -------
    Store or None
        Ready.
    """
    from platformdirs import user_cache_path

    given = os.environ.get("NUMBA_CACHE_DIR")
    return Store.at((Path(given) if given else user_cache_path("gms-fsm")) / "machine-code")


def tell(text: str) -> None:
    """Say what takes so long.

    Parameters
    ----------
    text : str
        What machine code is made of, or how long that took.
    """
    print(f"gms-fsm: {text}", file=sys.stderr)


def _compiled_signal(name: str, call: Callable[[float], float]) -> Any:
    import numba

    jit = numba.njit(
        numba.types.float64(numba.types.float64), error_model="numpy", boundscheck=True
    )
    try:
        return jit(getattr(call, "py_func", call))
    except Exception as error:  # numba raises many kinds, TypeError and its own among them
        lines = (re.sub(r"\x1b\[\d*m", "", line).strip() for line in str(error).splitlines())
        reason = next((u for u in lines if u and not u.startswith("Failed in nopython mode")), "")
        raise SignalError(
            f"numba cannot compile the function ({type(error).__name__}: {reason})",
            place=f"signal {name!r}",
            advice="use engine='machines', or give the signal as an expression of t or as "
            "arrays (times, values)",
        ) from None


def observe_rows(
    program: Program, t: FloatArray, y: FloatArray, mode: NDArray[np.int64]
) -> FloatArray:
    """Return what `observe` says of many rows, all signs as they are seen.

    Parameters
    ----------
    program : Program
        The program.
    t, y, mode : ndarray, shapes (rows,), (rows, m), (rows, n)
        The rows.

    Returns
    -------
    ndarray, shape (rows, observed)
        Bit for bit as the readable engine.
    """
    from integrators import compiled

    table = np.empty((t.size, program.layout.observed.size))
    compiled.for_each_row(
        machine_code(program, "observe"),
        (np.ascontiguousarray(t), np.ascontiguousarray(y), np.ascontiguousarray(mode)),
        np.array(program.live),
        packed(program.p),
        table,
        store(),
    )
    return table
