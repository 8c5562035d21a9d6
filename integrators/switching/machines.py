"""The machines of a system, as the loop asks them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from integrators.steps import Vector, moves_alone


class Switching(Protocol):
    """The interface of the machines to the loop."""

    def ask(
        self, t: float, y: Vector, mode: list[int], p: Any, jolt: list[int], edges: list[int]
    ) -> None:
        """Fill the first enabled edge of each machine, -1 for none, -2 - edge if it is refused.

        An edge across a machine's surface that stands in `edges` is not asked for.
        """

    def act(self, edge: int, machine: int, t: float, y: Vector, mode: list[int], p: Any) -> None:
        """Take an edge: update mode, and y if the edge assigns something."""

    def tick(self, bits: int, t: float, y: Vector, mode: list[int], p: Any) -> None:
        """Update what ticks: samplers, and what discrete machines give out."""

    def jolts(
        self,
        t: float,
        y: Vector,
        mode: list[int],
        p: Any,
        floor: Vector,
        mark: int,
        was: Vector,
        jolt: list[int],
    ) -> None:
        """Store velocities; if mark is 1, mark machines whose velocities differ from the stored."""


def happens_alone(event: int, on: Any, b: Any) -> bool:  # noqa: ARG001 (as others have them)
    """Go on: nothing else is told of events, and needs room."""
    return True


class Machines(NamedTuple):
    """A `Switching` made of functions, and functions that observe a run."""

    ask: Callable[..., Any]
    act: Callable[..., Any]
    tick: Callable[..., Any]
    jolts: Callable[..., Any]
    observe: Callable[..., Any]  # observe(t, y, mode, signs, p, seen)
    moved: Callable[..., Any] = moves_alone  # after each step, as in `ArcMotion`
    noted: Callable[..., Any] = happens_alone  # noted(event, on, b): whether there is room for more
