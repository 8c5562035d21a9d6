"""A program's functions compiled to machine code from the same generated text (extra ``fast``)."""

from __future__ import annotations

import functools
import importlib.util
import os
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.foundation.extras import missing
from gms_fsm.foundation.store import CodeFolder
from gms_fsm.foundation.text import visible
from gms_fsm.language.functions import sgn
from gms_fsm.lowering.adapting import OF_A_RUN, adapt, stamp_of
from gms_fsm.lowering.generated import SIGNALS, load
from gms_fsm.lowering.observing import on_surfaces
from gms_fsm.lowering.printing.counting import Counting
from gms_fsm.lowering.program import Arguments, Program, guarded
from gms_fsm.systems.signals import first_after, piecewise_linear, piecewise_slope

if TYPE_CHECKING:
    from integrators.machine_code.layout import MemoryBlock
    from integrators.machine_code.objects import Library
    from integrators.runners.compiled import CompiledFunction, RecordArguments

OF_MANY = "functions machines buffers log more.adapting more.repeats"
Packed = tuple[FloatArray, FloatArray, FloatArray]
MOST_ENGINES = 256  # in memory
MOST_SPARE = 4  # blocks that are kept for further calls
_lock = threading.RLock()  # a sweep may compile from several threads


def check_llvmlite() -> None:
    """Raise an error unless llvmlite is installed."""
    for module in ("llvmlite", "platformdirs"):
        if importlib.util.find_spec(module) is None:
            raise missing(module, "fast")


def packed(p: Arguments) -> Packed:
    """Return a program's arguments as arrays.

    Examples
    --------
    >>> packed(([2.0], [[1.0, 1.0]], []))[1].shape
    (1, 2)
    """
    shared, own, tables = p
    return np.array(shared, dtype=np.float64), _table(own), _table(tables)


def put_numbers(p: Arguments, shared: FloatArray, own: FloatArray) -> None:
    """Write the numbers of a program's arguments into arrays."""
    shared[...] = p[0]
    if p[1]:
        own[...] = _padded(p[1])


def _table(rows: list[list[float]]) -> FloatArray:
    return np.array(_padded(rows), dtype=np.float64).reshape(len(rows), -1 if rows else 0)


def _padded(rows: list[list[float]]) -> list[list[float]]:
    """Return rows as long as the longest one, with the last number of each again."""
    lengths = {*map(len, rows)}
    if len(lengths) < 2:
        return rows
    return [row + row[-1:] * (max(lengths) - len(row)) for row in rows]


def plan_in_block(plan: Any, places: Any) -> Any:
    """Return a plan whose lists are arrays, those inside the block in their places."""
    places.control.atol[:], places.discrete[:] = plan.control.atol, plan.discrete
    places.kinds[:] = plan.kinds
    jumps = len(plan.jumps) > 0
    places.relaxing[:] = plan.relaxing
    return plan._replace(
        kinds=places.kinds,
        control=plan.control._replace(atol=places.control.atol),
        discrete=places.discrete,
        relaxing=places.relaxing,
        jumps=plan.jumps if jumps else places.jumps,
        before_jumps=plan.before_jumps if jumps else places.before_jumps,
        ticks=plan.ticks if jumps else places.ticks,
        knots=np.array(plan.knots, dtype=np.float64) if plan.knots else places.knots,
    )


def engine(
    program: Program,
    run: RecordArguments,
    counting: Counting | None = None,
    tangents: str = "",
    lanes: int = 0,
) -> CompiledFunction:
    """Return the loop of a program as machine code, which may count its rows, or have tangents.

    Its further functions `adapt` and `repeat` let everything follow from other numbers; with
    tangents there is no `repeat`. Their text says how they are computed, several side by side.
    """
    from integrators.runners import compiled
    from integrators.runners.repeating import repeat

    check_llvmlite()
    text = text_of(program, tangents if counting is None else counting.source)
    if tangents:
        more = [compiled.EntryPoint("adapt", adapt, f"functions.p.{OF_A_RUN}")]
    else:
        more = [
            compiled.EntryPoint("adapt", adapt, OF_A_RUN),
            compiled.EntryPoint("repeat", repeat, OF_MANY, ("start", "count", "steps")),
        ]
    with _lock:
        stamp = functools.partial(stamp_of, program.plan)
        calls = _calls(program)
        return compiled.engine(text, run, calls, store(), notify, more, stamp, lanes > 1)


def with_more(engine: CompiledFunction, *, alone: bool = False) -> Library:
    """Return the machine code of an engine with its further functions, or these alone."""
    with _lock:
        return engine.beside if alone else engine.extended


def text_of(program: Program, more: str = "") -> str:
    """Return what machine code depends on: a program's text, more text, and what these call."""
    from integrators.runners.edition import digest

    return digest(sgn, first_after, piecewise_linear, piecewise_slope, text=program.source + more)


def _calls(program: Program) -> list[Callable[[float], float]]:
    """Return the signals that are Python functions, by number."""
    return [guarded(name, call) for name, call in program.callables.items()]


def functions(program: Program) -> Mapping[str, Any]:
    """Return a program's functions in the form that is translated to machine code."""
    return _loaded(program.plan.title, program.source, tuple(program.callables))


def count_of(program: Program, counting: Counting) -> Callable[..., Any]:
    """Return the function that counts rows, in the form that is translated to machine code."""
    callables = tuple(program.callables)
    made: Callable[..., Any] = _loaded("counted rows", counting.source, callables)["count"]
    return made


@functools.lru_cache(maxsize=64)
def _loaded(title: str, source: str, callables: tuple[str, ...]) -> dict[str, Any]:
    from integrators.machine_code.front_end.translate import HostFunction

    names: dict[str, Any] = {**SIGNALS, "__name__": __name__}
    names |= {f"{name}_signal": HostFunction(k) for k, name in enumerate(callables)}
    return load(title, source, names)


@functools.cache
def store() -> CodeFolder | None:
    """Return the cache for machine code, or None if no cache can be used.

    It is in the platform's folder for caches, or in GMS_FSM_CACHE.
    """
    from platformdirs import user_cache_path

    given = os.environ.get("GMS_FSM_CACHE")
    return CodeFolder.at((Path(given) if given else user_cache_path("gms-fsm")) / "machine-code")


def notify(text: str) -> None:
    """Print a message about a slow step to stderr, if somebody waits there."""
    if sys.stderr.isatty():
        print(visible(f"gms-fsm: {text}"), file=sys.stderr)


def observe_rows(
    program: Program, t: FloatArray, y: FloatArray, mode: NDArray[np.int64], kept: range
) -> FloatArray:
    """Return some results of `observe` for many rows, with all signs evaluated live."""
    made = _observer(program, kept)
    block = made.block()
    put_numbers(program.p, *block.contents.functions.p[:2])
    table = np.empty((t.size, len(kept)))
    columns = {"t": t, "y": y, "mode": mode, "table": table}
    if program.p[2]:
        columns["functions.p.2"] = _table(program.p[2])
    for name, column in columns.items():
        block.place(name, np.ascontiguousarray(column))
    done = made.engine(block, t.size)
    if done < t.size:
        _observer(program, kept, slides=True).engine(block, done, t.size)
    made.take_back(block)
    return table


@dataclass(frozen=True)
class ReadyCode:
    """What calls of one kind have in common: machine code, and a block as it is at the beginning.

    Parameters
    ----------
    engine : CompiledFunction
        The machine code.
    example : named tuple
        Of its arguments.
    functions : mapping
        Of the program; kept, so that their `id` stays theirs.
    """

    engine: CompiledFunction
    example: Any
    functions: Any
    _spare: list[MemoryBlock] = field(default_factory=list)  # of calls that have ended

    @functools.cached_property
    def _first(self) -> MemoryBlock:
        from integrators.machine_code.layout import MemoryBlock

        first = MemoryBlock(self.engine.layout, self.example)
        first.update(first.contents)
        return first

    def block(self) -> MemoryBlock:
        """Return a block of its own for a call."""
        from integrators.machine_code.layout import MemoryBlock

        try:
            return self._spare.pop()
        except IndexError:
            return MemoryBlock(self.engine.layout, self.example, self._first)

    def take_back(self, block: MemoryBlock) -> None:
        """Keep a block that nothing refers to any more for the next call."""
        if len(self._spare) < MOST_SPARE:
            block.become(self._first)  # and refer to no columns
            self._spare.append(block)


_observers: dict[tuple[int, range, bool], ReadyCode] = {}


def _observer(program: Program, kept: range, *, slides: bool = False) -> ReadyCode:
    from integrators.runners import compiled

    layout, key = program.layout, (id(program.functions), kept, slides)
    with _lock:
        if (ready := _observers.get(key)) is None:
            check_llvmlite()
            if len(_observers) >= MOST_ENGINES:
                _observers.clear()
            made = compiled.observer(
                text_of(program),
                functions(program)["observe"],
                on_surfaces(program, functions(program), packed(program.p)),
                (layout.y.size, layout.modes, layout.observed.size),
                kept,
                slides,
                _calls(program),
                store(),
                notify,
            )
            _observers[key] = ready = ReadyCode(*made, program.functions)
        return ready
