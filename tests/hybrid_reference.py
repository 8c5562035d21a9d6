"""An independent loop for systems that switch: SciPy's DOP853, one arc after another.

Nothing of the package is used. A case gives the flow for each combination of modes, and for each
mode the edges that leave it, each as a function that is positive where the edge is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

MOST = 500  # switches
Point = Callable[[float, Any], float]
Modes = tuple[str, ...]


class Switch(NamedTuple):
    """A switch of one contact."""

    t: float
    contact: int
    source: str
    target: str


@dataclass(frozen=True)
class Way:
    """An edge of a contact: taken where `when` is positive; `then` changes the state."""

    contact: int
    target: str
    when: Point
    then: Callable[[float, Any], Any] = lambda _, y: y


def reference(
    flow: Callable[[Modes], Callable[[float, Any], Any]],
    ways: Callable[[Modes], Sequence[Way]],
    y: Sequence[float],
    modes: Modes,
    t_end: float,
    *,
    max_step: float = 0.02,
    rtol: float = 1e-12,
    atol: float = 1e-14,
) -> tuple[list[Switch], np.ndarray]:
    """Return all switches before t_end, and the final state."""
    t, here, log = 0.0, np.array(y, dtype=float), list[Switch]()

    def take(way: Way) -> None:
        nonlocal modes, here
        log.append(Switch(t, way.contact, modes[way.contact], way.target))
        modes = (*modes[: way.contact], way.target, *modes[way.contact + 1 :])
        here = np.array(way.then(t, here), dtype=float)

    while t < t_end:
        assert len(log) < MOST, f"{MOST} switches before {t} s"
        for _ in range(50):  # edges that are open at once, such as a release on arrival
            open_ones = [way for way in ways(modes) if way.when(t, here) > 0.0]
            if not open_ones:
                break
            take(open_ones[0])
        else:
            raise AssertionError(f"endless switching at {t} s in {modes}")
        edges = ways(modes)
        events = []
        for way in edges:
            event: Any = lambda t, y, way=way: way.when(t, y)  # noqa: E731  # takes attributes
            event.terminal, event.direction = True, 1.0
            events.append(event)
        found = solve_ivp(
            flow(modes),
            (t, t_end),
            here,
            method="DOP853",
            rtol=rtol,
            atol=atol,
            events=events,
            max_step=max_step,
        )
        assert found.success, found.message
        t, here = float(found.t[-1]), found.y[:, -1]
        if found.status == 1:
            first = next(i for i, times in enumerate(found.t_events) if len(times))
            take(edges[first])
    return log, here
