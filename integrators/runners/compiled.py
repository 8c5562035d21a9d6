"""`integrators.runners.columns.record` as machine code: the same functions, translated.

Each system gets machine code of its own: its functions are known while translating, and so are the
lengths of all arrays, unless they are long. An object is compiled once and stored.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import hashlib
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from integrators.loop import Buffers, Machines
from integrators.machine_code import objects
from integrators.machine_code.calls import CompiledFunction
from integrators.machine_code.front_end.translate import Translator
from integrators.machine_code.front_end.values import ArrayValue, NumberValue
from integrators.machine_code.lanes import MOST_WRITTEN_OUT
from integrators.machine_code.layout import BlockLayout, OuterArray, parts_of
from integrators.machine_code.llvm import llvm_text
from integrators.machine_code.objects import Library, has_wide_vectors, target_name
from integrators.machine_code.tree import Const, Local, OuterEntry
from integrators.machine_code.tuning import APART, HOT, INLINE
from integrators.runners import columns, observing, stepping
from integrators.runners.columns import LogColumns, Recorded, RowTally, counts_nothing
from integrators.runners.edition import edition
from integrators.runners.stepping import Sample, ShortCall
from integrators.sliding import Functions, Held, Sliding
from integrators.steps import Coefficients

__all__ = [
    "CodeStore",
    "CompiledFunction",
    "CompiledStepper",
    "EntryPoint",
    "RecordArguments",
    "StepArguments",
    "engine",
    "example",
    "is_known",
    "observer",
    "stepper",
]

_compiling = threading.RLock()  # runs may be in several threads
# Arrays longer than this are not inside the block, and their lengths are variables.
LONGEST_INSIDE = 64 + 8


class RecordArguments(NamedTuple):
    """The arguments of `integrators.runners.columns.record`, without the last two, and more."""

    functions: Functions
    machines: Machines
    buffers: Buffers
    log: LogColumns
    recorded: Recorded
    tally: RowTally
    more: Any = ()  # what further entries need


class EntryPoint(NamedTuple):
    """A function that can be called from outside, by the name of its entry.

    Parameters
    ----------
    name : str
        Of the entry.
    function : callable
        A function of the subset.
    parts : str
        The parts of the block that are its first arguments, as in `BlockLayout.part`; all if empty.
    extra : tuple of str or int
        Integers that are passed besides the block, by name, and those that are known.
    vectors : bool
        Whether it computes numbers side by side.
    words : tuple of int
        So many words at the beginning of the block are a further argument.
    """

    name: str
    function: Callable[..., Any]
    parts: str = ""
    extra: tuple[str | int, ...] = ()
    vectors: bool = False
    words: tuple[int, ...] = ()


RECORD = "functions machines buffers log recorded tally"
FREE = "observe functions.p sliding t y mode seen table"
STEP = "functions machines buffers sample"


class StepArguments(NamedTuple):
    """The arguments of `integrators.runners.stepping.step_to`."""

    functions: Functions
    machines: Machines
    buffers: Buffers
    sample: Sample


class ShortArguments(NamedTuple):
    """The arguments of `integrators.runners.stepping.advance_by`, without the last one."""

    functions: Functions
    machines: Machines
    buffers: Buffers
    sample: Sample
    short: ShortCall


class ObserveArguments(NamedTuple):
    """The arguments of `integrators.runners.observing.observe_rows`, without the last three.

    Those of `observe_free` are among them.
    """

    functions: Functions
    observe: Callable[..., Any]
    held: Any
    sliding: Sliding
    t: Any
    y: Any
    mode: Any
    seen: Any
    table: Any


class CodeStore(Protocol):
    """A cache for machine code. It must return exactly what was stored: wrong bits crash."""

    def get(self, name: str) -> bytes | None:
        """Return the content stored under a name, or None."""

    def put(self, name: str, content: bytes) -> None:
        """Store content under a name, if possible."""


# --------------------------------------------------------------------------- engines
def is_known(part: Any) -> bool:
    """Return whether a part of some arguments takes no room in a block.

    Parameters
    ----------
    part : object
        A function, a named tuple, a list ...

    Returns
    -------
    bool
        True for functions and the coefficients of a method, which are known while translating.
    """
    return callable(part) or isinstance(part, Coefficients | OuterEntry)


def _made(
    text: str,
    arguments: Any,
    entries: Sequence[EntryPoint],
    calls: Sequence[Callable[[float], float]],
    store: CodeStore | None,
    notify: Callable[[str], None],
) -> CompiledFunction:
    """Return an engine from the store, or compile it; it calls the first entry."""
    layout = BlockLayout(arguments, is_known, inside=_longest(arguments) <= LONGEST_INSIDE)
    name = _name(text, arguments, layout, entries)

    def code(at_once: bool) -> tuple[bytes, bool]:
        if at_once and (store is None or store.get(name) is None):
            quick = f"{name}-at-once"
            return _object(quick, layout, entries, store, notify, at_once=True), True
        return _object(name, layout, entries, store, notify), False

    passed = [each for each in entries[0].extra if isinstance(each, str)]
    return CompiledFunction(layout, code, calls, len(passed))


def _name(text: str, arguments: Any, layout: BlockLayout, entries: Sequence[EntryPoint]) -> str:
    """Return the name of machine code: a hash of everything that it depends on."""
    # Which of the functions in the text are called, and the coefficients.
    fixed = [
        getattr(part, "__name__", part) for part in parts_of(arguments, is_known) if is_known(part)
    ]
    named = [(name, function.__name__, *rest) for name, function, *rest in entries]
    what = edition(), named, text, layout.key(), fixed, target_name()
    called = entries[0].function.__name__
    return f"{called}-{hashlib.sha256(repr(what).encode()).hexdigest()[:24]}"


def _object(
    name: str,
    layout: BlockLayout,
    entries: Sequence[EntryPoint],
    store: CodeStore | None,
    notify: Callable[[str], None],
    *,
    each: int = 0,
    at_once: bool = False,
) -> bytes:
    """Return machine code from the store, or compile it."""
    with _compiling:
        content = None if store is None else store.get(name)
        if content is not None:
            return content
        started = time.perf_counter()
        notify("compiling, once for each chart and method ...")
        with _no_collections():
            made, hot = _written(layout, entries, each)
        vectors = entries[0].vectors
        content = (
            objects.compiled_at_once(made)
            if at_once
            else objects.compiled(made, hot, vectors=vectors)
        )
        if store is not None:
            store.put(name, content)
        notify(f"compiled in {time.perf_counter() - started:.1f} s")
    return content


def _written(
    layout: BlockLayout, entries: Sequence[EntryPoint], each: int
) -> tuple[str, set[str] | None]:
    """Return the text of functions on a block, and the names of the hot ones; no tree stays.

    If the entry itself is hot, all are.
    """
    translator = translated(layout, entries, each=each)
    hot = {name for name, own in translator.origins.items() if own in HOT}
    return llvm_text(translator.module), None if entries[0].function.__name__ in HOT else hot


@contextlib.contextmanager
def _no_collections() -> Iterator[None]:
    """Let nobody look for garbage: all trees of a translation stay, and to walk them takes long."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def translated(layout: BlockLayout, entries: Sequence[EntryPoint], *, each: int = 0) -> Translator:
    """Return functions on a block; ``each`` calls the first one for blocks of so many words."""
    translator = Translator(INLINE, APART)
    translator.module.words = layout.words if has_wide_vectors() else 0
    made = [
        translator.entry(
            entry.name,
            entry.function,
            [
                *map(layout.part, entry.parts.split() or layout.value.fields),
                *(
                    NumberValue(Local("i", extra) if isinstance(extra, str) else Const("i", extra))
                    for extra in entry.extra
                ),
                *(ArrayValue("i", (Const("i", n),), Local("p", "block")) for n in entry.words),
            ],
        )
        for entry in entries
    ]
    if each:
        translator.for_each("each", made[0], each)
    return translator


def _longest(arguments: Any) -> int:
    """Return the largest length of a list."""
    lengths = [0]
    for part in parts_of(arguments, is_known):
        if isinstance(part, np.ndarray):
            lengths += part.shape
        elif isinstance(part, list):
            lengths.append(
                max(len(part), len(part[0]) if part and isinstance(part[0], list) else 0)
            )
    return max(lengths)


def engine(
    text: str,
    arguments: RecordArguments,
    calls: Sequence[Callable[[float], float]],
    store: CodeStore | None,
    notify: Callable[[str], None],
    more: Sequence[EntryPoint] = (),
    text_of_more: Callable[[], str] = str,
    vectors: bool = False,
) -> CompiledFunction:
    """Return `integrators.runners.columns.record` as machine code for one system.

    Parameters
    ----------
    text : str
        Changes with the system's functions.
    arguments : RecordArguments
        From `example`, with those functions.
    calls : sequence of callable
        The functions that `integrators.machine_code.front_end.translate.HostFunction` stands for.
    store : CodeStore, optional
        The cache for machine code.
    notify : callable
        Called with a text before the system is compiled, which takes a while, and afterwards.
    more : sequence of EntryPoint
        Further functions on the same block, an object of their own, which is made when
        `CompiledFunction.extended` is asked for. As `OuterEntry`, ``"entry"`` is this engine.
    text_of_more : callable, optional
        Returns a text that changes with them.
    vectors : bool
        Whether the system's functions compute numbers side by side.

    Returns
    -------
    CompiledFunction
        To be called with a block, the largest number of steps, and whether to pause.
    """
    vectors = vectors or len(arguments.buffers.now.y) > MOST_WRITTEN_OUT
    record = EntryPoint("entry", columns.record, RECORD, ("steps", "pause"), vectors)
    made = _made(text, arguments, [record], calls, store, notify)
    if more:

        def further() -> bytes:
            name = _name(f"{text} {text_of_more()}", arguments, made.layout, more)
            return _object(name, made.layout, more, store, notify)

        made.more = further
    return made


@dataclass(eq=False)
class CompiledStepper:
    """Machine code that advances one block by a sample, or many of them.

    Parameters
    ----------
    layout : BlockLayout
        Of a block, which contains all its arrays.
    short : BlockLayout
        Of a block for `advance_by` and `peek_by`; it begins as the other one.
    library : Library
        Contains `entry`, `each`, `advance_by` and `peek_by`.
    """

    layout: BlockLayout
    short: BlockLayout
    library: Library

    def __post_init__(self) -> None:
        # They take microseconds: to release the GIL would take a tenth of them.
        one = ctypes.PYFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)
        self.one = one(self.library.address("entry"))
        force = ctypes.PYFUNCTYPE(ctypes.c_double, ctypes.c_void_p)
        self.advance = force(self.library.address("advance_by"))
        self.peek = force(self.library.address("peek_by"))
        each = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)
        self.each = each(self.library.address("each"))


def stepper(
    text: str, arguments: StepArguments, store: CodeStore | None, notify: Callable[[str], None]
) -> CompiledStepper:
    """Return the functions of `integrators.runners.stepping` as machine code for one system.

    Parameters
    ----------
    text, store, notify
        As in `engine`.
    arguments : StepArguments
        Made of lists, with the system's functions; these call no functions of the host program.

    Returns
    -------
    CompiledStepper
        ``one(address)`` returns what `step_to` returns; ``each(address, count)`` calls it for many
        blocks, one after the other in memory, and returns the sum of what it returns.
        ``advance(address)`` and ``peek(address)`` return what `advance_by` and `peek_by` return.
    """
    layout = BlockLayout(arguments, is_known)
    whole = ShortArguments(*arguments, stepping.short_call(layout.words))
    short = BlockLayout(whole, is_known)
    entries = [
        EntryPoint("entry", stepping.step_to, STEP),
        EntryPoint("advance_by", stepping.advance_by, f"{STEP} short", words=(layout.words,)),
        EntryPoint("peek_by", stepping.peek_by, f"{STEP} short", words=(layout.words,)),
    ]
    name = _name(text, whole, short, entries)
    library = Library(_object(name, short, entries, store, notify, each=layout.words))
    return CompiledStepper(layout, short, library)


def example(functions: Functions, machines: Machines, b: Buffers, observed: int, recorded: Recorded,
            modes: int, count: Callable[..., Any] | None = None) -> RecordArguments:  # fmt: skip
    """Return the arguments of `integrators.runners.columns.record`, with columns that may grow.

    Parameters
    ----------
    functions, machines
        Python functions, with arrays as parameters.
    b : Buffers
        From `integrators.hybrid.buffers`.
    observed : int
        Number of observed values.
    recorded : Recorded
        Where the numbers are that the log stores.
    modes : int
        Number of modes that are stored with a row.
    count : callable, optional
        ``count(t, y, mode, p, counts, near)``, to count rows instead of keeping them.

    Returns
    -------
    RecordArguments
        An example for `integrators.machine_code.layout.BlockLayout`.
    """
    size = len(b.now.y)
    column: Any = OuterArray
    plan = b.plan._replace(jumps=column(), before_jumps=column(), ticks=column("i"), knots=column())
    out = replace(b.out, times=column(), rows_t=column(), rows_y=column("f", size))
    log = LogColumns(
        firings=0,
        stops=0,
        t=column(),
        machine=column("i"),
        edge=column("i"),
        numbers=column("f", 5),
        seen=[0.0] * observed,
        rows_microstep=column("i"),
        rows_mode=column("i", modes),
        stops_t=column(),
        stops_microstep=column("i"),
        stops_y=column("f", size),
        stops_mode=column("i", modes),
    )
    p: Any = functions.p
    shared, own, _ = p
    functions = functions._replace(p=(shared, own, OuterArray(table=True)))
    tally = RowTally(counts_nothing, [], [])
    if count is not None:
        tally = RowTally(count, column("i"), column())
    return RecordArguments(
        functions, machines, b._replace(plan=plan, out=out), log, recorded, tally
    )


def observer(
    text: str,
    observe: Callable[..., Any],
    on: Held,
    widths: tuple[int, int, int],
    kept: range,
    slides: bool,
    calls: Sequence[Callable[[float], float]],
    store: CodeStore | None,
    notify: Callable[[str], None],
) -> tuple[CompiledFunction, ObserveArguments]:
    """Return `observe_rows` of `integrators.runners.observing` as machine code for one system.

    Parameters
    ----------
    text, calls, store, notify
        As in `engine`.
    observe : callable
        ``observe(t, y, mode, signs, p, out)``.
    on : Held
        The system's functions, with arrays as parameters, and scratch space.
    widths : (int, int, int)
        Number of states, of modes of a row and of observed values.
    kept : range
        Which of these are kept.
    slides : bool
        Whether rows slide on surfaces; otherwise it is `observe_free`, which stops at the first
        that does.

    Returns
    -------
    CompiledFunction
        To be called with a block, with the first row if they slide, and with the number of rows.
    ObserveArguments
        The example that its block begins with.
    """
    p: Any = on.functions.p
    shared, own, _ = p
    size, modes, seen = widths
    table: Any = OuterArray(table=True)
    rows = ObserveArguments(
        functions=on.functions._replace(p=(shared, own, table)),
        observe=observe,
        held=on.held,
        sliding=on.sliding,
        t=OuterArray(),
        y=OuterArray("f", size),
        mode=OuterArray("i", modes),
        seen=[0.0] * seen,
        table=OuterArray("f", len(kept)),
    )
    if slides:
        entry = EntryPoint("entry", observing.observe_rows, "", (kept.start, "first", "count"))
    else:
        entry = EntryPoint("entry", observing.observe_free, FREE, (kept.start, "count"), True)
    return _made(text, rows, [entry], calls, store, notify), rows
