"""The memory of joints, and what advances it: machine code, or the same functions in Python."""

from __future__ import annotations

import functools
import importlib.util
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gms_fsm.lowering import compiling as compiled
from gms_fsm.lowering.program import equations, machines_of
from gms_fsm.run.machines import IfElse
from gms_fsm.run.problem import LATEST, Problem
from gms_fsm.run.ticks import EXACT, clocks_of, in_units
from gms_fsm.systems.signals import Corners
from integrators import hybrid
from integrators.loop import Buffers, Machines
from integrators.machine_code.records import numbers_in, numbers_of, put_numbers
from integrators.runners import states
from integrators.runners.stepping import (
    Clocks,
    Sample,
    ShortCall,
    restart,
    short_call,
    step_to,
)
from integrators.sliding import Functions

if TYPE_CHECKING:
    from integrators.machine_code.layout import BlockLayout
    from integrators.runners.compiled import CompiledStepper as MachineCode

# In the log of a sample; when it is full, it is emptied and the sample goes on. Each state that is
# kept has one; exports keep none.
MOST_SWITCHES, MOST_IN_EXPORTS = 16, 64
# Of a block what need not be kept: numbers of the model, and what each step writes before it reads.
FIXED = "functions.p.0", "functions.p.1"
SCRATCH = "buffers.relations.end", "buffers.relations.search.", "buffers.scratch."
SAMPLED, LOGGED = tuple(numbers_of(Sample)), ("t", "machine", "edge")
PLANNED, ORIGIN = ("jumps", "before_jumps", "ticks"), ("begin", "units")


class JointMemory(NamedTuple):
    """What the loop keeps of one joint, and what advances it alone (see `step_to`)."""

    buffers: Buffers
    tables: Any  # the straight lines: of each input its times, then its values
    sample: Sample
    run: Callable[[], int]

    def state(self) -> dict[str, Any]:
        """Return what makes up its state: numbers, and the arrays (or lists) themselves."""
        return {**states.state_of(self.buffers), **self._inputs()}

    def put(self, state: Mapping[str, Sequence[Any]]) -> None:
        """Return to a state, or to parts of it; see `integrators.runners.states.put_state`."""
        states.put_state(self.buffers, state)
        for name, place in self._inputs().items():
            if name in state:
                place[:] = state[name]

    def whole(self) -> dict[str, Any]:
        """Return all that a sample changes: `state`, the log, what ticks next, what was seen."""
        sample, plan = self.sample, self.buffers.plan
        return {
            **self.state(),
            **{f"times {k}": self.tables[2 * k] for k in range(sample.given)},
            **{f"log {name}": getattr(sample, name) for name in LOGGED},
            **{name: getattr(plan, name) for name in PLANNED},
            "made": sample.clocks.made,
            "seen": sample.seen,
            "origin": numbers_in(sample.clocks, ORIGIN),
            "sample": numbers_in(sample, SAMPLED),
        }

    def put_whole(self, state: Mapping[str, Sequence[Any]]) -> None:
        """Return to what `whole` returned."""
        self.put(state)
        put_numbers(self.sample, SAMPLED, state["sample"])
        put_numbers(self.sample.clocks, ORIGIN, state["origin"])
        for name, place in self.whole().items():
            if name not in ("sample", "origin"):
                place[:] = state[name]

    def _inputs(self) -> dict[str, Any]:
        return {f"input {k}": self.tables[2 * k + 1] for k in range(self.sample.given)}


class ShortCalls(NamedTuple):
    """Calls for one joint with one input, which return the force; see `advance_by`."""

    given: Any  # the numbers of a `ShortSample`
    advance: Callable[[], float]
    peek: Callable[[], float]
    record: ShortCall
    kept: tuple[Any, ...] = ()  # states


def no_short_calls() -> ShortCalls:
    """Return calls of which each needs a closer look."""
    return ShortCalls([0.0] * 4, lambda: math.inf, lambda: math.inf, short_call(0))


def fast() -> bool:
    """Return whether machine code can be made here."""
    return all(map(importlib.util.find_spec, ("llvmlite", "platformdirs")))


# --------------------------------------------------------------------------- in Python
class ListMemory:
    """Of one joint, in lists; its steps are Python functions.

    Calling `run` advances it; see `step_to`.
    """

    def __init__(self, starts: Sequence[Problem], *, waits: bool = False) -> None:
        (start,) = starts
        program = start.program
        switch, observe = IfElse(program), program.ieee["observe"]
        functions = equations(program).functions(located=True)
        machines = Machines(switch.ask, switch.act, switch.tick, switch.jolts, observe)
        buffers, self.sample = prepared(start, waits=waits)
        self.run = functools.partial(step_to, functions, machines, buffers, self.sample)
        self.each = (JointMemory(buffers, functions.p[2], self.sample, self.run),)
        self.lines, self.short = self.sample.inputs, no_short_calls()

    def copy(self) -> Any:
        """Return the present state."""
        return {name: list(place) for name, place in self.each[0].whole().items()}

    def take(self, copy: Any) -> None:
        """Return to what `copy` returned."""
        self.each[0].put_whole(copy)

    def free(self, copy: Any) -> None:
        """Let the memory of a copy serve again: here it need not."""


def prepared(
    start: Problem, *, waits: bool = False, most: int = MOST_SWITCHES
) -> tuple[Buffers, Sample]:
    """Return the buffers of a run without an end, and its first sample."""
    program, layout = start.program, start.program.layout
    made, size = equations(program), layout.y.size
    b = hybrid.buffers(
        made, start.t_start, start.y, start.mode, math.inf, start.options, capacity=1
    )
    clocks = _clocks(start)
    two = [0.0] * 2 if clocks.made or waits else []
    plan = b.plan._replace(
        jumps=[*two], before_jumps=[*two], ticks=[0] * len(two), knots=[start.t_start]
    )
    b = b._replace(plan=plan)
    restart(b, clocks)
    lines = [each for each in start.system.signals.values() if isinstance(each, Corners)]
    sample = Sample(
        end=start.t_start,
        until=-LATEST,
        given=len(start.system.inputs) if waits else len(lines),
        waits=False,
        jumps=False,
        wanted=layout.recorded[1][0][2],  # its force
        mean=False,
        resumed=False,
        switches=0,
        code=0,
        force=0.0,
        impulse=0.0,
        inputs=[[0.0, 0.0] for _ in lines or (None,)],
        events=[layout.y.index(name) for name in layout.events],
        seen=[0.0] * layout.observed.size,
        t=[0.0] * most,
        machine=[0] * most,
        edge=[0] * most,
        before=[0.0] * size,
        middle=[0.0] * size,
        slope=[0.0] * size,
        clocks=clocks,
    )
    return b, sample


def _clocks(start: Problem) -> Clocks:
    """Return what ticks, in units that make periods whole numbers if doubles can hold these."""
    ticking = clocks_of(start.system)
    units = in_units(ticking)
    exact = units.largest < EXACT
    return Clocks(
        per_second=float(units.per_second) if exact else 1.0,
        begin=0.0,
        units=0.0,
        period=[*map(float, units.period)] if exact else [each.period for each in ticking],
        offset=[*map(float, units.first)] if exact else [each.offset for each in ticking],
        made=[0 for _ in ticking],
    )


# --------------------------------------------------------------------------- machine code
class BlockMemory:
    """Of one joint: a block for machine code, and what short calls need.

    Calling `run` advances it; see `step_to`.
    """

    def __init__(self, starts: Sequence[Problem], *, waits: bool = False) -> None:
        from integrators.runners.compiled import ShortArguments

        (start,) = starts
        code = machine_code(start, waits=waits)
        size, arguments = code.layout.words, arguments_of(start, waits=waits)
        layout = code.layout
        if not waits:
            layout = code.short
            arguments = ShortArguments._make((*arguments, short_call(size, LATEST)))
        words: Any = np.zeros(layout.words, dtype=np.int64)
        address, made, joint = _joint(code, layout, arguments, words)
        self.each, self.run, self.sample = (joint,), joint.run, joint.sample
        lines: Any = self.sample.inputs
        # A memoryview is read, written and copied in half the time of an array.
        self._state = memoryview(words[:size]).cast("B")
        self.copy, self.lines = self._state.tobytes, [memoryview(line) for line in lines]
        self.short = no_short_calls()
        if not waits:
            record, given = made.short, np.frombuffer(made.short.given)
            self.short = ShortCalls(
                memoryview(given),  # type: ignore[arg-type]
                functools.partial(code.advance, address),
                functools.partial(code.peek, address),
                record,
                tuple(memoryview(each).cast("B") for each in (record.even, record.odd)),
            )

    def take(self, copy: Any) -> None:
        """Return to what `copy` returned."""
        self._state[:] = copy

    def free(self, copy: Any) -> None:
        """Let the memory of a copy serve again: here it need not."""


class BlocksMemory:
    """Of joints that differ in numbers only: blocks one after the other, for machine code.

    Calling `run` advances all; it returns not 0 if `step_to` does for one of them. In `lines` and
    `sample`, an item is an array of one number per joint.
    """

    def __init__(self, starts: Sequence[Problem]) -> None:
        code, count = machine_code(starts[0]), len(starts)
        words: Any = np.zeros((count, code.layout.words), dtype=np.int64)
        made = [
            _joint(code, code.layout, arguments_of(start), row)
            for start, row in zip(starts, words, strict=True)
        ]
        self.each, self.short = [joint for _, _, joint in made], no_short_calls()
        self.run = functools.partial(code.each, made[0][0], count)
        self.lines = [_across(words, line) for line in self.each[0].sample.inputs]
        self.sample = SamplesAcross(words, code.layout.offset)
        self._parts = [words[:, part] for part in _changing(code.layout)]
        self._rooms = list[list[Any]]()

    def copy(self) -> Any:
        """Return the present state, in memory that is free if there is some."""
        made = self._rooms.pop() if self._rooms else [*map(np.empty_like, self._parts)]
        for room, part in zip(made, self._parts, strict=True):
            room[...] = part
        return made

    def take(self, copy: Any) -> None:
        """Return to what `copy` returned."""
        for room, part in zip(copy, self._parts, strict=True):
            part[...] = room

    def free(self, copy: Any) -> None:
        """Let the memory of a copy serve again: to find so much takes longer than to copy."""
        self._rooms.append(copy)


def _joint(
    code: MachineCode, layout: BlockLayout, arguments: Any, words: Any
) -> tuple[int, Any, JointMemory]:
    """Return the address of a block, its contents, and these as those of a joint."""
    from integrators.machine_code.layout import MemoryBlock

    block = MemoryBlock(layout, arguments, words=words)
    made = block.contents
    block.update(made)  # numbers; there are no columns
    run = functools.partial(code.one, block.address)
    return block.address, made, JointMemory(made.buffers, made.functions.p[2], made.sample, run)


def _changing(layout: BlockLayout) -> list[slice]:
    """Return the words of a block that are to be kept."""
    places = sorted((first, name) for name, first in layout.offsets.items())
    stops = [*(first for first, _ in places[1:]), layout.words]
    found: list[slice] = []
    for (first, name), stop in zip(places, stops, strict=True):
        if not name.startswith((*FIXED, *SCRATCH)):
            joined = bool(found) and found[-1].stop == first
            found.append(slice(found.pop().start if joined else first, stop))
    return found


class SamplesAcross:
    """The numbers of samples in blocks one after the other: arrays, assigned as a whole."""

    def __init__(self, blocks: NDArray[np.int64], offset: Callable[[str], int]) -> None:
        words = {"f": blocks.view(np.float64), "i": blocks}
        kinds = numbers_of(Sample).items()
        vars(self)["columns"] = {name: words[k][:, offset(f"sample.{name}")] for name, k in kinds}

    def __getattr__(self, name: str) -> Any:
        return vars(self)["columns"][name].copy()

    def __setattr__(self, name: str, value: Any) -> None:
        vars(self)["columns"][name][...] = value


def _across(blocks: Any, array: Any) -> Any:
    """Return a view of an array in the first block and those in its place in the other blocks."""
    place = (array.ctypes.data - blocks.ctypes.data) // blocks.itemsize
    return blocks.view(array.dtype)[:, place : place + array.size].T


_known: dict[Any, tuple[MachineCode, Any]] = {}


def machine_code(start: Problem, *, waits: bool = False) -> MachineCode:
    """Return the steps of a system as machine code."""
    from integrators.runners import compiled as machine

    compiled.check_llvmlite()
    program = start.program
    key = id(program.functions), id(start.options.method), waits
    made = _known.get(key, (None, None))[0]
    if made is None:
        if len(_known) >= compiled.MOST_ENGINES:
            _known.clear()
        made = machine.stepper(
            compiled.text_of(program),
            arguments_of(start, waits=waits),
            compiled.store(),
            compiled.notify,
        )
        _known[key] = made, program.functions  # kept, so that their `id` stays theirs
    return made


def arguments_of(start: Problem, *, waits: bool = False, most: int = MOST_SWITCHES) -> Any:
    """Return the arguments of `integrators.runners.stepping.step_to`, made of lists."""
    from integrators.runners.compiled import StepArguments

    made = compiled.functions(start.program)
    p: Any = compiled.packed(start.program.p)
    return StepArguments(
        Functions(made["flow"], made["arm"], made["margins"], made["normal"], made["follow"], p),
        machines_of(made),
        *prepared(start, waits=waits, most=most),
    )
