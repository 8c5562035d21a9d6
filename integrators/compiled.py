"""`integrators.columns.record` as machine code: the very same functions, compiled by numba.

The system's functions are passed as addresses of functions with fixed signatures, so that the loop
is compiled once per machine and cached, whatever it integrates.
"""

from __future__ import annotations

import functools
import gc
import hashlib
import pickle
import sys
import threading
import time
import typing
from collections.abc import Callable, Mapping
from types import CodeType
from typing import Any, Protocol

import numpy as np

from integrators import advance, columns, crossings, loop, sliding, step_size, steps
from integrators.loop import Machines
from integrators.sliding import Functions

__all__ = [
    "SIGNATURES",
    "Store",
    "arrays",
    "compiled",
    "digest",
    "edition",
    "for_each_row",
    "record",
    "usable_inside",
]

# Every function that `record` reaches. Those within a step are inlined: a call passes ten arrays,
# which takes as long as their work does.
_OF_A_STEP: tuple[Callable[..., Any], ...] = (
    advance._next_end,
    advance._assess_step,
    advance._put_wanted,
    advance.limit_after,
    advance.next_on_grid,
    advance.put_row,
    advance.raise_floor,
    advance.tick_at,
    crossings._bracket,
    crossings._is_quiet,
    crossings._probe,
    crossings._search,
    crossings.any_changed,
    crossings.copy_margins,
    crossings.first_change,
    crossings.is_quiet_step,
    sliding.flow_on,
    sliding.margins_on,
    step_size.error_norm,
    step_size.next_factor,
    step_size.retry_factor,
    steps.fit_dense,
    steps.interpolate,
    steps.take_step,
    steps.weighted_sum,
)
# The phases of the loop are inlined too, and the writing of events: each is called from one place.
_OF_AN_EVENT: tuple[Callable[..., Any], ...] = (
    loop._begin_arc,
    loop._choose_stop,
    loop._end_arc,
    loop._finish,
    loop._fired,
    loop._flowed,
    columns._is_full,
    loop._held,
    loop._jump,
    loop._make_due,
    loop._only_due,
    loop._pick,
    columns._put_firing,
    columns._put_stop,
    loop._start,
    loop._steps_ahead,
)
_OF_AN_ARC: tuple[Callable[..., Any], ...] = (
    advance.advance,
    crossings.listed,
    crossings.longest_next,  # of few arcs; inlined, it slows every step down by a third
    loop._reset_counts,
    loop._list,
    loop._reset_if_advanced,
    loop._no_progress,
    loop._often_changed,
    columns._put_modes,
    loop._rearm,
    loop._undefined,
    loop.run_to_event,
    sliding._sign,
    sliding._solve,
    sliding.look,
    sliding.seize,
    sliding.slope_on,
    step_size.scaled_size,
    step_size.starting_step,
)
_INLINED = (*_OF_A_STEP, *_OF_AN_EVENT)
_ARRAYS: Mapping[Any, tuple[type[Any], int]] = {
    list[float]: (np.float64, 1),
    tuple[float, ...]: (np.float64, 1),
    list[int]: (np.int64, 1),
    list[bool]: (np.bool_, 1),
    list[list[float]]: (np.float64, 2),
    tuple[tuple[float, ...], ...]: (np.float64, 2),
    list[list[int]]: (np.int64, 2),
}
# The functions that make up a system: letters for float, Vector, list[int], int and p.
SIGNATURES: Mapping[str, str] = {
    "flow": "fVIVPV",
    "flow_live": "fVIVPV",
    "arm": "fVIPVI",
    "margins": "fVIPIV",
    "normal": "ifVIPV",
    "switch": "fVIPI",
    "act": "iifVIP",
    "tick": "ifVIP",
    "observe": "fVIVPV",
}
# IEEE arithmetic: x / 0 is inf or NaN, as in our Python (together with the caller's numbers that do
# not raise). No reference counting either, which is atomic and took half of the time: nothing is
# allocated here, and all arrays belong to the caller.
_OPTIONS: Mapping[str, Any] = {"error_model": "numpy", "_nrt": False}


def arrays(record: Any) -> Any:
    """Return a named tuple of lists as the same named tuple of arrays.

    Parameters
    ----------
    record : NamedTuple
        Contains lists, numbers and named tuples.

    Returns
    -------
    NamedTuple
        Lists of lists are padded with zeros to form a table.

    Examples
    --------
    >>> from integrators.steps import coefficients
    >>> from integrators.tableaux import HEUN
    >>> arrays(coefficients(HEUN)).A.tolist()
    [[0.0], [1.0]]
    """
    return _constant(record) if isinstance(record, steps.Coefficients) else _converted(record)


def _converted(record: Any) -> Any:
    kind: Any = type(record)
    kinds = _kinds(kind)
    return kind._make(_array(u, array) for u, array in zip(record, kinds, strict=True))


@functools.cache
def _kinds(record: Any) -> tuple[tuple[type[Any], int] | None, ...]:
    """Return what array each field of a named tuple becomes; None if it is no list."""
    hints = typing.get_type_hints(record)
    return tuple(_ARRAYS.get(hints[name]) for name in record._fields)


@functools.lru_cache(maxsize=32)
def _constant(method: steps.Coefficients) -> Any:
    """Return the arrays of a method, which no run writes to."""
    return _converted(method)


def _array(value: Any, kind: tuple[type[Any], int] | None) -> Any:
    if kind is None:
        return arrays(value) if hasattr(value, "_fields") else value
    dtype, dimensions = kind
    if dimensions == 1:
        return np.array(value, dtype=dtype)
    table = np.zeros((len(value), max(map(len, value), default=0)), dtype=dtype)
    for row, numbers in zip(table, value, strict=True):
        row[: len(numbers)] = numbers
    return table


# --------------------------------------------------------------------------- caching
class Store(Protocol):
    """A cache for machine code. It must return exactly what was stored: wrong bits crash."""

    def __hash__(self) -> int: ...

    def get(self, name: str) -> bytes | None:
        """Return the content stored under a name, or None."""

    def put(self, name: str, content: bytes) -> None:
        """Store content under a name, if possible."""


def digest(*functions: Callable[..., Any], text: str = "") -> str:
    """Return a hash of what some functions do.

    It is computed from their code as loaded, not from their files: these may have been replaced
    under a running program, which would then store its old code under the new name.

    Parameters
    ----------
    *functions : callable
        Python functions.
    text : str
        Further text that affects the result.

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


def edition() -> str:
    """Return a hash of what the loop computes, whatever system it runs.

    Returns
    -------
    str
        It changes with the loop's source and with the version of Python.

    Examples
    --------
    >>> len(edition())
    16
    """
    functions: list[Callable[..., Any]] = [columns.record, *_INLINED, *_OF_AN_ARC]
    modules = (steps, step_size, crossings, advance, sliding, loop, columns)
    constants = [
        (name, value if isinstance(value, int | float) else getattr(value, "_fields", None))
        for module in modules
        for name, value in vars(module).items()
    ]
    return digest(*functions, text=repr((sys.version, constants)))


_lock = threading.RLock()  # for numba's settings, and to compile nothing twice


class _VerifiedCache:
    """Replaces numba's own cache, which loads files without verifying them."""

    cache_path = None

    def __init__(
        self, function: Callable[..., Any], store: Store | None, on_miss: Callable[[], None]
    ) -> None:
        self.function, self.store, self.on_miss = function, store, on_miss
        self.missed = False

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return a cached result, or None to have it compiled."""
        from numba.core.compiler import CompileResult

        target.refresh()
        kept = None if self.store is None else self.store.get(self._name(signature, target))
        if kept is not None:
            try:
                return CompileResult._rebuild(target, *pickle.loads(kept))
            except Exception:  # stored by a numba that differs in more than its version number
                pass
        self.missed = True
        self.on_miss()
        return None

    def save_overload(self, signature: Any, result: Any) -> None:
        """Store a result."""
        from numba.core.serialize import dumps

        if self.store is not None:
            name = self._name(signature, result.target_context)
            self.store.put(name, dumps(result._reduce()))

    def _name(self, signature: Any, target: Any) -> str:
        import numba

        # Includes the processor: a folder may be shared between machines.
        what = signature, target.codegen().magic_tuple(), numba.__version__, _OPTIONS
        function = self.function
        text = repr((what, edition(), function.__module__, function.__qualname__))
        return f"{function.__qualname__}-{digest(function, text=text)}"


def _silent() -> None:
    """Do nothing."""


def _machine_code(
    signature: Any,
    function: Callable[..., Any],
    store: Store | None,
    on_miss: Callable[[], None] = _silent,
) -> Any:
    """Compile a function, or load its cached code from a store."""
    import numba

    config = numba.config
    with _lock:
        before = config.LOOP_VECTORIZE
        # Vectorized loops cost a fifth at n = 4, and pay off only if n is in the hundreds.
        config.LOOP_VECTORIZE = 0
        collecting = gc.isenabled()
        gc.disable()  # compiling creates millions of objects and hardly any cyclic garbage
        try:
            dispatcher = numba.njit(nogil=True, **_OPTIONS)(function)
            dispatcher._cache = _VerifiedCache(function, store, on_miss)
            dispatcher.compile(signature)
            dispatcher.disable_compile()
            return dispatcher
        finally:
            config.LOOP_VECTORIZE = before
            if collecting:
                gc.enable()


# --------------------------------------------------------------------------- compiling
def usable_inside(function: Callable[..., Any], *, inlined: bool = False) -> None:
    """Make a Python function callable by name from compiled code.

    Parameters
    ----------
    function : callable
        Contains plain loops over numbers and arrays.
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


def compiled(name: str, function: Callable[..., None], store: Store | None) -> Any:
    """Return a system's function compiled to machine code.

    Parameters
    ----------
    name : str
        A key of `SIGNATURES`.
    function : callable
        Its qualified name must be unique: the linker identifies it by nothing else.
    store : Store, optional
        The cache for its machine code.

    Returns
    -------
    callable
        A function with the fixed signature.
    """
    return _machine_code(_signature(SIGNATURES[name]), function, store)


def record(arguments: tuple[Any, ...], store: Store | None, notify: Callable[[str], None]) -> int:
    """Call `integrators.columns.record` as machine code; this releases the GIL.

    Parameters
    ----------
    arguments : tuple
        The function's arguments: named tuples of compiled functions, of arrays and numbers.
    store : Store, optional
        The cache for the machine code.
    notify : callable
        Called with a text before the loop is compiled, which takes a while, and afterwards.

    Returns
    -------
    int
        The result of `integrators.columns.record`.
    """
    functions, machines, *others = arguments
    addresses: list[Any] = [_address(function) for function in (*functions[:4], *machines)]
    flow, arm, margins, normal, *switch = addresses
    at = Functions(flow, arm, margins, normal, functions.p), Machines(*switch)
    machine_code: Callable[..., int] = _record((*at, *others), store, notify)
    return machine_code(*at, *others)


@functools.lru_cache(maxsize=1024)
def _address(function: Any) -> int:
    """Return the address of a compiled function's machine code."""
    (code,) = function.overloads.values()
    address: int = code.library.get_pointer_to_function(code.fndesc.llvm_func_name)
    return address


def _function_at(signature: Any) -> Any:
    """Return an intrinsic that turns an address into a function, in machine code.

    If functions were passed directly, numba would unpickle their types at every call: 27 us each.
    """
    from numba import types
    from numba.core import cgutils
    from numba.extending import intrinsic

    kind = types.FunctionType(signature)

    def make(context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        function = cgutils.create_struct_proxy(kind)(context, builder)
        function.jit_addr = builder.inttoptr(arguments[0], function.jit_addr.type)
        return function._getvalue()

    def function_at(_typing: Any, _address: Any) -> Any:
        return kind(types.int64), make

    return intrinsic(function_at)


_compiled_record: list[Any] = []


def _record(arguments: tuple[Any, ...], store: Store | None, notify: Callable[[str], None]) -> Any:
    if _compiled_record:
        return _compiled_record[0]
    with _lock:
        if not _compiled_record:
            _compiled_record.append(_compile_record(arguments, store, notify))
        return _compiled_record[0]


def _compile_record(
    arguments: tuple[Any, ...], store: Store | None, notify: Callable[[str], None]
) -> Any:
    import numba

    for helper in (*_INLINED, *_OF_AN_ARC):
        usable_inside(helper, inlined=helper in _INLINED)
    names = ("flow", "arm", "margins", "normal", "switch", "act", "tick", "observe")
    at_flow, at_arm, at_margins, at_normal, at_switch, at_act, at_tick, at_observe = (
        _function_at(_signature(SIGNATURES[name])) for name in names
    )
    run = numba.njit(inline="always", **_OPTIONS)(columns.record)  # otherwise it is compiled twice

    def record(
        at: Any, machines: Any, b: Any, log: Any, recorded: Any, most_steps: Any, pause: Any
    ) -> Any:
        functions = Functions(
            at_flow(at.flow), at_arm(at.arm), at_margins(at.margins), at_normal(at.normal), at.p
        )
        switch = Machines(
            at_switch(machines.ask),
            at_act(machines.act),
            at_tick(machines.tick),
            at_observe(machines.observe),
        )
        return run(functions, switch, b, log, recorded, most_steps, pause)

    record.__qualname__ = "record"  # the name in the cache
    start = time.perf_counter()
    result = _machine_code(
        numba.types.int64(*map(numba.typeof, arguments)),
        record,
        store,
        lambda: notify("compiling the engine, once on this machine ..."),
    )
    if result._cache.missed:
        notify(f"compiled in {time.perf_counter() - start:.1f} s")
    return result


def _each_row(observe: Any, t: Any, y: Any, mode: Any, live: Any, p: Any, table: Any) -> None:
    for row in range(len(t)):
        observe(t[row], y[row], mode[row], live, p, table[row])


@functools.cache
def _compiled_each_row(store: Store | None) -> Any:
    import numba

    kind = _types()
    observe = numba.types.FunctionType(_signature(SIGNATURES["observe"]))
    table, modes = numba.types.float64[:, ::1], numba.types.int64[:, ::1]
    signature = numba.types.void(observe, kind["V"], table, modes, kind["V"], kind["P"], table)
    return _machine_code(signature, _each_row, store)


def for_each_row(
    observe: Any, rows: tuple[Any, Any, Any], live: Any, p: Any, table: Any, store: Store | None
) -> None:
    """Call a compiled ``observe`` for many rows.

    Parameters
    ----------
    observe : callable
        From `compiled`.
    rows : tuple of ndarray, shapes (rows,), (rows, m), (rows, n)
        Times, states and modes.
    live : ndarray, shape (signs,)
        `integrators.sliding.LIVE` for each sign.
    p : tuple of ndarray
        Parameters.
    table : ndarray, shape (rows, width)
        Filled with the results.
    store : Store, optional
        The cache for the machine code.
    """
    _compiled_each_row(store)(observe, *rows, live, p, table)
