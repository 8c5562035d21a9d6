"""Machine code called with a block: compiled at once, and anew if much time is spent in it."""

from __future__ import annotations

import ctypes
import functools
import math
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from integrators.machine_code.layout import BlockLayout, MemoryBlock
from integrators.machine_code.objects import Library

# What is compiled at once runs three times as long as what is compiled in ten times the time. Once
# so much has been spent in it (s), it is replaced: the bits are the same.
AT_ONCE = 0.5


@dataclass(eq=False)
class _Call:
    """A call of machine code, and the first error in a function that it calls."""

    block: MemoryBlock
    error: BaseException | None = None
    copy: list[Any] = field(default_factory=list)  # the block's contents then


@dataclass(eq=False)
class CompiledFunction:
    """Machine code with the layout of its arguments.

    Parameters
    ----------
    layout : BlockLayout
        Of the block.
    code : callable
        ``code(at_once)`` returns an object with `entry`, and whether it was compiled at once, which
        it may be only if that is asked for.
    calls : sequence of callable
        The functions of the host program that it calls.
    extra : int
        Number of integers that are passed besides the block.
    more : callable, optional
        Returns an object with further functions on the same block, which may call `entry`.
    """

    layout: BlockLayout
    code: Callable[[bool], tuple[bytes, bool]]
    calls: Sequence[Callable[[float], float]]
    extra: int
    more: Callable[[], bytes] | None = None
    _function: Any = None
    _slow: bool = False  # whether it was compiled at once
    _spent: float = 0.0  # s, in what was compiled at once
    _kept: list[Any] = field(default_factory=list)  # other threads may still be in the former one
    _now: threading.local = field(default_factory=threading.local)  # `call`: of each thread
    _lock: threading.RLock = field(default_factory=threading.RLock)

    @functools.cached_property
    def extended(self) -> Library:
        """Machine code with the further functions, made when they are wanted first."""
        with self._lock:
            self._load(at_once=False)
            library: Library = self._kept[-1][0]
            if self.more is not None:
                library.add(self.more(), ["entry"])
            return library

    @functools.cached_property
    def beside(self) -> Library:
        """The further functions alone, which then may not call `entry`."""
        assert self.more is not None
        with self._lock:
            return Library(self.more())

    def _load(self, *, at_once: bool) -> None:
        """Load what there is no function of yet, or what takes less time."""
        with self._lock:
            if self._function is not None and (at_once or not self._slow):
                return
            content, self._slow = self.code(at_once)
            library = Library(content)
            integers = [ctypes.c_int64] * self.extra
            kind = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, *integers)
            table = library.variable("callbacks") if self.calls else 0
            thunks: list[Any] = []
            if table:
                thunk = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)
                thunks = [thunk(self._guarded(call)) for call in self.calls]
                places = (ctypes.c_void_p * len(self.calls)).from_address(table)
                for k, each in enumerate(thunks):
                    places[k] = ctypes.cast(each, ctypes.c_void_p).value
            self._kept.append((library, thunks))
            self._function = kind(library.address("entry"))

    def _guarded(self, call: Callable[[float], float]) -> Callable[[float], float]:
        """Return a function that never raises: machine code could not pass it on."""
        now = self._now

        def value(t: float) -> float:
            try:
                if now.call.error is None:
                    return float(call(t))
            except BaseException as error:
                now.call.error, now.call.copy = error, now.call.block.copy()
            return math.nan

        return value

    def __call__(self, block: MemoryBlock, *integers: int) -> int:
        """Call the machine code; this releases the GIL."""
        if self._function is None:
            self._load(at_once=True)
        elif self._slow and self._spent > AT_ONCE:
            self._load(at_once=False)
        now = self._now
        outer, now.call = getattr(now, "call", None), _Call(block)
        started = time.perf_counter() if self._slow else 0.0
        try:
            result: int = self._function(block.address, *integers)
            if now.call.error is not None:
                block.restore(now.call.copy)
                raise now.call.error
        finally:
            now.call = outer
            if self._slow:
                self._spent += time.perf_counter() - started
        return result
