"""Why a run cannot continue: errors that carry the time, the state and the modes."""

from __future__ import annotations

from collections.abc import Sequence

from integrators import advance as kernel
from integrators import loop
from integrators.crossings import listed
from integrators.loop import MOST_SWITCHES, Buffers
from integrators.steps import Vector


class HybridError(Exception):
    """The run cannot continue; carries the time, state and modes."""

    def __init__(self, message: str, t: float, y: Vector, mode: Sequence[int]) -> None:
        super().__init__(message)
        self.t = t
        self.y = list(y)
        self.mode = tuple(mode)


class Livelock(HybridError):
    """Switches without progress in time, of one machine or of one relation."""

    def __init__(
        self,
        t: float,
        y: Vector,
        mode: Sequence[int],
        machine: int | None,
        times: int,
        relations: list[str],
    ) -> None:
        super().__init__(f"{times} switches without progress", t, y, mode)
        self.machine = machine
        self.times = times
        self.relations = relations


class Refused(HybridError):
    """An edge would take a velocity that has jumped, or a lock that was moved cannot let go."""

    def __init__(
        self, t: float, y: Vector, mode: Sequence[int], machine: int, edge: int | None
    ) -> None:
        super().__init__("a velocity has jumped", t, y, mode)
        self.machine, self.edge = machine, edge


class Entangled(HybridError):
    """Machines slide on surfaces that bear on each other: the motion is not unique."""

    def __init__(self, t: float, y: Vector, mode: Sequence[int], surfaces: list[int]) -> None:
        super().__init__("several surfaces attract at once", t, y, mode)
        self.surfaces = surfaces


class StepTooSmall(HybridError):
    """Error control requires steps below the clock's resolution."""


class NotFinite(HybridError):
    """The flow returned NaN or infinity."""


class TooManySteps(HybridError):
    """The maximum number of steps was reached before the end."""


def modes_of(b: Buffers) -> tuple[int, ...]:
    """Return the mode of each machine, then for each surface whether the motion slides on it.

    Parameters
    ----------
    b : Buffers
        The buffers of a run.

    Returns
    -------
    tuple of int
        The modes stored with rows.
    """
    return (*b.now.mode, *b.sliding.flags)


def failure(event: int, b: Buffers, relations: list[str]) -> HybridError:
    """Return the error for an event that ends a run.

    Parameters
    ----------
    event : int
        The value returned by `integrators.loop.run_to_event`.
    b : Buffers
        The buffers of the run.
    relations : list of str
        Their names.

    Returns
    -------
    HybridError
        The error to raise.
    """
    memory = b.memory
    scene = b.now.t, b.now.y, modes_of(b)
    if event == kernel.TOO_SMALL:
        return StepTooSmall("step size below the clock's resolution", *scene)
    if event == loop.TOO_MANY_STEPS:
        return TooManySteps(f"the maximum of {b.plan.max_steps} steps was reached", *scene)
    if event == loop.REFUSED:
        edge = memory.edge
        return Refused(*scene, memory.machine, edge if edge >= 0 else None)
    if event == loop.MACHINE_LIVELOCK:
        machine = memory.machine
        return Livelock(*scene, machine, memory.switches[machine], [])
    if event == loop.RELATION_LIVELOCK:
        # A relation in a guard may have changed once more than its machine has switched.
        machine = max(range(len(b.now.mode)), key=lambda i: memory.switches[i])
        if memory.switches[machine] >= MOST_SWITCHES // 2:
            return Livelock(*scene, machine, memory.switches[machine], [])
        names = [*relations, *["the pull onto a surface"] * (len(memory.changes) - len(relations))]
        often = [name for r, name in enumerate(names) if memory.changes[r] >= MOST_SWITCHES]
        return Livelock(*scene, None, MOST_SWITCHES, often)
    if event == loop.ENTANGLED:
        return Entangled(*scene, sorted(map(int, b.sliding.which[: b.sliding.count])))
    w = listed(b.relations, memory.active)
    undefined = [
        name for r, name in enumerate(relations) if r in w.active and w.start[r] != w.start[r]
    ]
    text = f"{undefined[0]} compares NaN" if undefined else "NaN or infinity"
    return NotFinite(text, *scene)
