"""What carries out the steps of a `FrictionState`: machine code, or the same in Python."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gms_fsm.lowering import _compiled as compiled
from gms_fsm.lowering.program import equations
from gms_fsm.run._ticks import EXACT, clocks_of, in_units
from gms_fsm.run.machines import IfElse
from gms_fsm.run.start import Start
from gms_fsm.systems.signals import Corners
from integrators import hybrid, states
from integrators.loop import Buffers, Machines
from integrators.machine_code.records import numbers_in, numbers_of, put_numbers
from integrators.sliding import Functions
from integrators.stepping import Clocks, Sample, restart, step_to

if TYPE_CHECKING:
    from integrators.compiled import CompiledStepper as MachineCode

__all__ = [
    "Machine",
    "Plain",
    "Stepper",
    "arguments_of",
    "fast",
    "machine_code",
    "prepared",
    "put_state",
    "state_of",
]

MOST_SWITCHES = 64  # in the log of a sample; when it is full, it is emptied and the sample goes on
SAMPLED, LOGGED = tuple(numbers_of(Sample)), ("t", "machine", "edge")


class Stepper(Protocol):
    """A state that can be advanced by a sample, and put back."""

    buffers: Buffers
    tables: Any  # the straight lines: of each input its times, then its values
    sample: Sample

    def run(self) -> int:
        """Advance; see `integrators.stepping.step_to`."""

    def keep(self) -> None:
        """Keep the present state for `back`."""

    def back(self) -> None:
        """Return to the state that was kept last."""

    def undo(self) -> None:
        """Return to the state that was kept last, and keep again what was kept before it."""

    def copy(self) -> Any:
        """Return the present state."""

    def take(self, copy: Any) -> None:
        """Return to what `copy` returned, here or in a stepper of the same system."""


def fast() -> bool:
    """Return whether machine code can be made here."""
    return all(map(importlib.util.find_spec, ("llvmlite", "platformdirs")))


def state_of(stepper: Stepper) -> dict[str, Any]:
    """Return what makes up a state: numbers, and the arrays (or lists) themselves.

    Parameters
    ----------
    stepper : Stepper
        Between two samples.

    Returns
    -------
    dict
        As `integrators.states.state_of`, and the values of the inputs.
    """
    inputs = {f"input {k}": stepper.tables[2 * k + 1] for k in range(len(stepper.sample.inputs))}
    return {**states.state_of(stepper.buffers), **inputs}


def put_state(stepper: Stepper, state: Mapping[str, Sequence[Any]]) -> None:
    """Return to a state, or to parts of it; see `integrators.states.put_state`."""
    states.put_state(stepper.buffers, state)
    for k in range(len(stepper.sample.inputs)):
        if f"input {k}" in state:
            stepper.tables[2 * k + 1][:] = state[f"input {k}"]


# --------------------------------------------------------------------------- in Python
class Plain:
    """The steps as Python functions on lists.

    Parameters
    ----------
    start : Start
        The system, with its inputs as corner tables.
    """

    def __init__(self, start: Start) -> None:
        program = start.program
        made = equations(program)
        switch = IfElse(program)
        self.functions = made.functions(located=True)
        observe = program.ieee["observe"]
        self.machines = Machines(switch.ask, switch.act, switch.tick, switch.jolts, observe)
        self.buffers, self.sample = prepared(start)
        _, _, self.tables = self.functions.p
        self._kept = self._before = self.copy()

    def run(self) -> int:
        """Advance; see `integrators.stepping.step_to`."""
        return step_to(self.functions, self.machines, self.buffers, self.sample)

    def keep(self) -> None:
        """Keep the present state for `back`."""
        self._before, self._kept = self._kept, self.copy()

    def back(self) -> None:
        """Return to the state that was kept last."""
        self.take(self._kept)

    def undo(self) -> None:
        """Return to the state that was kept last, and keep again what was kept before it."""
        self.back()
        self._kept = self._before

    def copy(self) -> dict[str, list[Any]]:
        """Return the present state."""
        log = {f"log {name}": getattr(self.sample, name) for name in LOGGED}
        state = {**state_of(self), **log, "sample": numbers_in(self.sample, SAMPLED)}
        return {name: list(place) for name, place in state.items()}

    def take(self, copy: Mapping[str, list[Any]]) -> None:
        """Return to what `copy` returned."""
        put_state(self, copy)
        put_numbers(self.sample, SAMPLED, copy["sample"])
        for name in LOGGED:
            getattr(self.sample, name)[:] = copy[f"log {name}"]


def prepared(start: Start) -> tuple[Buffers, Sample]:
    """Return the buffers of a run without an end, and its first sample.

    Parameters
    ----------
    start : Start
        The system, with its inputs as corner tables.

    Returns
    -------
    (Buffers, Sample)
        Made of lists. The only knot is the end of the sample; what ticks goes on forever.
    """
    program, layout = start.program, start.program.layout
    made, size = equations(program), layout.y.size
    b = hybrid.buffers(
        made, start.t_start, start.y, start.mode, math.inf, start.options, capacity=1
    )
    clocks = _clocks(start)
    two = [0.0] * 2 if clocks.made else []
    plan = b.plan._replace(
        jumps=[*two], before_jumps=[*two], ticks=[0] * len(two), knots=[start.t_start]
    )
    b = b._replace(plan=plan)
    restart(b, clocks)
    lines = [each for each in start.system.signals.values() if isinstance(each, Corners)]
    sample = Sample(
        end=start.t_start,
        wanted=layout.observed.index(layout.banks[0].of("F")),
        mean=False,
        resumed=False,
        switches=0,
        code=0,
        force=0.0,
        impulse=0.0,
        inputs=[[0.0, 0.0] for _ in lines or (None,)],
        seen=[0.0] * layout.observed.size,
        t=[0.0] * MOST_SWITCHES,
        machine=[0] * MOST_SWITCHES,
        edge=[0] * MOST_SWITCHES,
        before=[0.0] * size,
        middle=[0.0] * size,
        slope=[0.0] * size,
        clocks=clocks,
    )
    return b, sample


def _clocks(start: Start) -> Clocks:
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
class Machine:
    """The steps as machine code on a block of memory.

    Parameters
    ----------
    start : Start
        The system, with its inputs as corner tables.
    memory : (ndarray of int, ndarray of int), optional
        For the block, and for the state that is kept; its own if omitted.

    Attributes
    ----------
    kept : ndarray of int
        The state that was kept last.
    """

    def __init__(
        self, start: Start, memory: tuple[NDArray[np.int64], NDArray[np.int64]] | None = None
    ) -> None:
        from integrators.machine_code.layout import MemoryBlock

        self.code = machine_code(start)
        arguments = arguments_of(start)
        self.block = MemoryBlock(
            self.code.layout, arguments, words=None if memory is None else memory[0]
        )
        self.block.update(self.block.contents)  # numbers; there are no columns
        contents = self.block.contents
        self.buffers, self.sample = contents.buffers, contents.sample
        _, _, self.tables = contents.functions.p
        self._one, self._address = self.code.one, self.block.address
        self._words = self.block.words
        self.kept = np.empty_like(self._words) if memory is None else memory[1]
        self._before = np.empty_like(self._words)
        self.kept[:] = self._words

    def run(self) -> int:
        """Advance; see `integrators.stepping.step_to`."""
        result: int = self._one(self._address)
        return result

    def keep(self) -> None:
        """Keep the present state for `back`."""
        self._before, self.kept = self.kept, self._before
        self.kept[:] = self._words

    def back(self) -> None:
        """Return to the state that was kept last."""
        self._words[:] = self.kept

    def undo(self) -> None:
        """Return to the state that was kept last, and keep again what was kept before it."""
        self.back()
        self._before, self.kept = self.kept, self._before

    def copy(self) -> Any:
        """Return the present state."""
        return self._words.copy()

    def take(self, copy: Any) -> None:
        """Return to what `copy` returned."""
        self._words[:] = copy


_known: dict[int, tuple[MachineCode, Any]] = {}


def machine_code(start: Start) -> MachineCode:
    """Return the steps of a system as machine code.

    Parameters
    ----------
    start : Start
        The system.

    Returns
    -------
    integrators.compiled.CompiledStepper
        The same one for systems that differ in numbers only.

    Raises
    ------
    MissingExtraError
        If llvmlite is not installed.
    """
    from integrators import compiled as machine

    compiled.check_llvmlite()
    program = start.program
    key = id(program.functions)
    made = _known.get(key, (None, None))[0]
    if made is None:
        if len(_known) >= compiled.MOST_ENGINES:
            _known.clear()
        made = machine.stepper(
            compiled.text_of(program), arguments_of(start), compiled.store(), compiled.notify
        )
        _known[key] = made, program.functions  # kept, so that their `id` stays theirs
    return made


def arguments_of(start: Start) -> Any:
    """Return the arguments of `integrators.stepping.step_to`, made of lists.

    Parameters
    ----------
    start : Start
        The system, with its inputs as corner tables.

    Returns
    -------
    integrators.compiled.StepArguments
        An example for `integrators.machine_code.layout.BlockLayout`.
    """
    from integrators.compiled import StepArguments

    made = compiled.functions(start.program)
    p: Any = compiled.packed(start.program.p)
    return StepArguments(
        Functions(made["flow"], made["arm"], made["margins"], made["normal"], made["follow"], p),
        Machines(made["switch"], made["act"], made["tick"], made["jolts"], made["observe"]),
        *prepared(start),
    )
