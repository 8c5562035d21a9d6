"""Functions of `integrators.elementary` as machine code, for programs that are interpreted.

The bits are the same. The first use takes a fifth of a second (llvmlite is imported, the function
compiled), so it comes when about that much has been spent without.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np

FREE = 100_000  # calls of about a microsecond before a function is compiled


def scalar(function: Callable[..., float], count: int) -> Callable[..., float]:
    """Return a function as machine code; the same function if llvmlite is not installed.

    Examples
    --------
    >>> from integrators.elementary import exp
    >>> scalar(exp, 1)(0.3) == exp(0.3)
    True
    """
    if find_spec("llvmlite") is None:
        return function
    library, *_ = _library(function, count)
    # A function that ends after nanoseconds need not release the GIL.
    made: Callable[..., float] = ctypes.PYFUNCTYPE(ctypes.c_double, *[ctypes.c_double] * count)(
        library.address("scalar")
    )
    return made


def each(function: Callable[..., float], *arguments: Any) -> Any:
    """Return a function of each entry of some arrays.

    Examples
    --------
    >>> from integrators.elementary import exp, power
    >>> each(exp, np.array([0.0, 1.0])).tolist()
    [1.0, 2.718281828459045]
    """
    rows = np.broadcast_arrays(*(np.asarray(each, dtype=np.float64) for each in arguments))
    if rows[0].size < FREE or find_spec("llvmlite") is None:
        found = np.frompyfunc(function, len(rows), 1)(*rows)
        return np.asarray(found, dtype=np.float64) if rows[0].ndim else np.float64(found)
    _, loop = _library(function, len(rows))
    out = np.empty(rows[0].shape)
    dense = [*map(np.ascontiguousarray, rows), out]
    first, *others = (row.ctypes.data for row in dense)
    loop(first, out.size, *others)  # in the order in which the loop's parameters appear
    return out


@functools.cache
def _library(function: Callable[..., float], count: int) -> tuple[Any, Callable[..., None]]:
    """Return machine code that must be kept, and its loop over arrays."""
    from integrators.machine_code.front_end.translate import Translator
    from integrators.machine_code.front_end.values import ArrayValue, FixedValue, NumberValue
    from integrators.machine_code.llvm import llvm_text
    from integrators.machine_code.objects import Library, compiled
    from integrators.machine_code.tree import Local

    n = Local("i", "n")
    rows = [ArrayValue("f", (n,), Local("p", f"row{k}")) for k in range(count + 1)]
    translator = Translator()
    translator.entry("scalar", function, [NumberValue(Local("f", f"x{k}")) for k in range(count)])
    translator.entry("loop", _of_one if count == 1 else _of_two, [FixedValue(function), *rows])
    library = Library(compiled(llvm_text(translator.module)))
    kind = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64, *[ctypes.c_void_p] * count)
    return library, kind(library.address("loop"))


def _of_one(function: Callable[[float], float], x: Any, out: Any) -> None:
    for k in range(len(out)):
        out[k] = function(x[k])


def _of_two(function: Callable[[float, float], float], x: Any, y: Any, out: Any) -> None:
    for k in range(len(out)):
        out[k] = function(x[k], y[k])
