"""`integrators.loop.record` as machine code: the very same functions, through numba.

The system's functions come in as addresses of functions with fixed signatures, so that the loop is
compiled once per machine and cached on disk, whatever it integrates.
"""

from __future__ import annotations

import contextlib
import functools
import gc
import hashlib
import sys
import tempfile
import threading
import time
import typing
from collections.abc import Callable, Mapping
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np

from integrators import advance, crossings, loop, sliding, step_size, steps

__all__ = [
    "SIGNATURES",
    "arrays",
    "cache_folder",
    "compiled",
    "digest",
    "for_each_row",
    "record",
    "usable_inside",
]

# Every function that `record` reaches. Those of a step are inlined: a call hands on ten arrays,
# which takes as long as their work does.
_OF_A_STEP: tuple[Callable[..., Any], ...] = (
    advance.put_row, advance.tick_at, advance.raise_floor, crossings.any_changed,
    crossings.copy_margins, crossings.first_change,
    crossings.nothing_near, crossings._bracket, crossings._is_quiet, crossings._search,
    step_size.error_norm, step_size.next_factor, step_size.retry_factor,
    steps.fit_dense, steps.interpolate, steps.take_step, steps.weigh,
)  # fmt: skip
_OF_AN_ARC: tuple[Callable[..., Any], ...] = (
    advance.advance, loop.active_relations, loop.go_on, loop._begin_arc, loop._count_anew, loop._listed,
    loop._look_at_clock,
    loop._no_progress, loop._often_changed, loop._put_modes, loop._rearm, loop._undefined,
    sliding._sign, sliding._solve, sliding.look, sliding.seize, sliding.flow_on, sliding.margins_on,
    sliding.slope_on, step_size.starting_step,
)  # fmt: skip
_ARRAYS: Mapping[Any, tuple[type[Any], int]] = {
    list[float]: (np.float64, 1),
    tuple[float, ...]: (np.float64, 1),
    list[int]: (np.int64, 1),
    list[bool]: (np.bool_, 1),
    list[list[float]]: (np.float64, 2),
    tuple[tuple[float, ...], ...]: (np.float64, 2),
    list[list[int]]: (np.int64, 2),
}
# Of the functions a system is made of: letters for float, Vector, list[int], int and p.
SIGNATURES: Mapping[str, str] = {
    "flow": "fVIVPV",
    "flow_live": "fVIVPV",
    "arm": "fVIPVI",
    "margins": "fVIPIV",
    "normal": "ifVIPV",
    "switch": "fVIPI",
    "act": "iifVIP",
    "observe": "fVIVPV",
}
# IEEE arithmetic: x / 0 is inf or NaN as it is for our Python (see gms_fsm.generated). And no
# counting of references, which is atomic and took half of the time: nothing is allocated here, all
# arrays belong to the caller.
_OPTIONS: Mapping[str, Any] = {"error_model": "numpy", "_nrt": False}
_hints: Callable[[type], Mapping[str, Any]] = functools.cache(typing.get_type_hints)


def arrays(record: Any) -> Any:
    """Return a named tuple of lists as the same named tuple of arrays.

    Parameters
    ----------
    record : NamedTuple
        Of lists, numbers and named tuples.

    Returns
    -------
    NamedTuple
        Lists of lists are padded with zeros to a table.

    Examples
    --------
    >>> from integrators.steps import coefficients
    >>> from integrators.tableaux import HEUN
    >>> arrays(coefficients(HEUN)).A.tolist()
    [[0.0], [1.0]]
    """
    hints = _hints(type(record))
    return type(record)(*(_array(value, hints[name]) for name, value in record._asdict().items()))


def _array(value: Any, hint: Any) -> Any:
    if hint not in _ARRAYS:
        return arrays(value) if hasattr(value, "_fields") else value
    dtype, dimensions = _ARRAYS[hint]
    if dimensions == 1:
        return np.array(value, dtype=dtype)
    table = np.zeros((len(value), max(map(len, value), default=0)), dtype=dtype)
    for row, numbers in zip(table, value, strict=True):
        row[: len(numbers)] = numbers
    return table


# --------------------------------------------------------------------------- the cache on disk
def digest(*functions: Callable[..., Any], text: str = "") -> str:
    """Return a short name for what some functions do.

    Of their code as it was loaded, not of their files: these may have been replaced under a running
    program, which would then keep its old code under the new name.

    Parameters
    ----------
    *functions : callable
        Python functions.
    text : str
        What else counts.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    stamp = hashlib.sha256(text.encode())
    codes = [function.__code__ for function in functions]
    while codes:
        code = codes.pop()
        codes += [u for u in code.co_consts if isinstance(u, CodeType)]
        constants = [u for u in code.co_consts if not isinstance(u, CodeType)]
        stamp.update(repr((code.co_code, code.co_names, code.co_varnames, constants)).encode())
    return stamp.hexdigest()[:16]


def cache_folder(base: Path) -> Path | None:
    """Return the folder to keep compiled code in, or None if it cannot be written.

    Parameters
    ----------
    base : Path
        Its parent. The folder's name changes with this package's source and with the versions of
        Python and numba.

    Returns
    -------
    Path or None
        An existing folder.
    """
    import numba

    functions: list[Callable[..., Any]] = [loop.record, _machine_code, *_OF_A_STEP, *_OF_AN_ARC]
    modules = (steps, step_size, crossings, advance, sliding, loop)
    constants = [
        (name, value if isinstance(value, int | float) else getattr(value, "_fields", None))
        for module in modules
        for name, value in vars(module).items()
    ]
    parts = sys.version, numba.__version__, _OPTIONS, SIGNATURES, constants
    folder = base / digest(*functions, text=repr(parts))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return None


_lock = threading.RLock()  # of numba's settings, and so that nothing is compiled twice


def _machine_code(signature: Any, function: Callable[..., Any], folder: Path | None) -> Any:
    """Compile a function, or load what was kept of it in a folder."""
    import numba

    jit = functools.partial(numba.njit, signature, nogil=True, **_OPTIONS)
    config = numba.config
    with _lock:
        before = config.CACHE_DIR, config.LOOP_VECTORIZE
        # Vectorized loops cost a fifth at n = 4, and gain only where n is in the hundreds.
        config.CACHE_DIR, config.LOOP_VECTORIZE = str(folder or ""), 0
        collecting = gc.isenabled()
        gc.disable()  # compiling makes objects by the million and no garbage worth looking for
        try:
            return jit(cache=folder is not None)(function)
        except Exception:  # a damaged file, a full disk: it only costs time, and not for ever
            _forget(function, folder)
            return jit()(function)
        finally:
            config.CACHE_DIR, config.LOOP_VECTORIZE = before
            if collecting:
                gc.enable()


def _forget(function: Callable[..., Any], folder: Path | None) -> None:
    """Remove what was kept of a function, so that the next program keeps it anew."""
    stem = Path(function.__code__.co_filename).stem
    with contextlib.suppress(OSError):
        for file in folder.rglob(f"{stem}.{function.__qualname__}-*.nb?") if folder else ():
            file.unlink(missing_ok=True)


# --------------------------------------------------------------------------- compiling
def usable_inside(function: Callable[..., Any], *, inlined: bool = False) -> None:
    """Let compiled code call a Python function by its name.

    Parameters
    ----------
    function : callable
        Of plain loops over numbers and arrays.
    inlined : bool
        Whether its code is copied into that of its callers.
    """
    from numba.extending import register_jitable

    register_jitable(**_OPTIONS, forceinline=inlined)(function)


@functools.cache
def _types() -> Mapping[str, Any]:
    from numba import types

    vector, ints, table = types.float64[::1], types.int64[::1], types.float64[:, ::1]
    return {
        "f": types.float64,
        "i": types.int64,
        "V": vector,
        "I": ints,
        "P": types.Tuple((vector, table, table)),
    }


def _signature(letters: str) -> Any:
    from numba import types

    return types.void(*(_types()[letter] for letter in letters))


def compiled(name: str, function: Callable[..., None], folder: Path | None) -> Any:
    """Return a system's function as machine code.

    Parameters
    ----------
    name : str
        A key of `SIGNATURES`.
    function : callable
        Its text lies in a file if it is to be kept.
    folder : Path, optional
        Where to keep it.

    Returns
    -------
    callable
        With the fixed signature.
    """
    return _machine_code(_signature(SIGNATURES[name]), function, folder)


def record(arguments: tuple[Any, ...], folder: Path | None) -> int:
    """Call `integrators.loop.record` as machine code; it releases the GIL.

    Parameters
    ----------
    arguments : tuple
        Its arguments: compiled functions, arrays and numbers.
    folder : Path, optional
        Where to keep the machine code.

    Returns
    -------
    int
        What it returns.
    """
    machine_code: Callable[..., int] = _record(arguments, folder)
    return machine_code(*arguments)


_compiled_record: list[Any] = []


def _record(arguments: tuple[Any, ...], folder: Path | None) -> Any:
    if _compiled_record:
        return _compiled_record[0]
    with _lock:
        if not _compiled_record:
            _compiled_record.append(_compile_record(arguments, folder))
        return _compiled_record[0]


def _compile_record(arguments: tuple[Any, ...], folder: Path | None) -> Any:
    import numba

    names = ("flow", "arm", "margins", "normal", "switch", "act", "observe")
    functions = [numba.types.FunctionType(_signature(SIGNATURES[name])) for name in names]
    others = [numba.typeof(argument) for argument in arguments[len(names) :]]
    for helper in (*_OF_A_STEP, *_OF_AN_ARC):
        usable_inside(helper, inlined=helper in _OF_A_STEP)
    known = folder is not None and any(folder.rglob("loop.record-*.nbi"))
    if not known:
        print("gms-fsm: compiling the engine, once on this machine ...", file=sys.stderr)
    start = time.perf_counter()
    result = _machine_code(numba.types.int64(*functions, *others), loop.record, folder)
    if not known:
        print(f"gms-fsm: compiled in {time.perf_counter() - start:.1f} s", file=sys.stderr)
    return result


def _each_row(observe: Any, t: Any, y: Any, mode: Any, live: Any, p: Any, table: Any) -> None:
    for row in range(len(t)):
        observe(t[row], y[row], mode[row], live, p, table[row])


@functools.cache
def _compiled_each_row(folder: Path | None) -> Any:
    import numba

    kind = _types()
    observe = numba.types.FunctionType(_signature(SIGNATURES["observe"]))
    table, modes = numba.types.float64[:, ::1], numba.types.int64[:, ::1]
    signature = numba.types.void(observe, kind["V"], table, modes, kind["V"], kind["P"], table)
    return _machine_code(signature, _each_row, folder)


def for_each_row(
    observe: Any, t: Any, y: Any, mode: Any, live: Any, p: Any, table: Any, folder: Path | None
) -> None:
    """Call a compiled ``observe`` for many rows.

    Parameters
    ----------
    observe : callable
        From `compiled`.
    t, y, mode : ndarray, shapes (rows,), (rows, m), (rows, n)
        The rows.
    live : ndarray, shape (signs,)
        `integrators.sliding.LIVE` for each sign.
    p : tuple of ndarray
        Parameters.
    table : ndarray, shape (rows, width)
        Filled.
    folder : Path, optional
        Where to keep the machine code.
    """
    _compiled_each_row(folder)(observe, t, y, mode, live, p, table)
