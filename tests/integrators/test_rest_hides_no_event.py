"""While nothing moves, or while a body leaves v = 0, no guard is missed.

A contact that is held has no error for the step size to follow: steps grew over whole periods of
its load. And a guard v > 0 was taken for true on the surface v = 0 itself, where a corner of the
force was: it never fired.
"""

from __future__ import annotations

import math
from typing import Any

import pytest

from gms_fsm import Body, Chart, Contact, State, System, Transition, simulate


def run(states: tuple[State, ...], edges: tuple[Transition, ...], **system: Any) -> Any:
    chart = Chart("chart", ("v", "N"), states=states, transitions=edges)
    contact = Contact("pad", chart, {}, inputs={"N": system.pop("N", "1")})
    body = Body("body", inertia=1.0, force=system.pop("force"))
    one = System("one", bodies=(body,), contacts=(contact,))
    return simulate(one, system.pop("t_end"), engine="ifelse")


@pytest.mark.parametrize("w", [0.03, 1.0, 3.0, 50.0])
def test_a_held_contact_sees_every_period_of_its_load(w: float) -> None:
    """N < 0 once per period; the load of the lock is 0 throughout."""
    log = run(
        (State("stuck", locked=True), State("free", outputs={"F": "0"})),
        (
            Transition("lift", "stuck", "free", guard="N < 0"),
            Transition("engage", "free", "stuck", guard="N > 0"),
        ),
        N=f"0.9 + sin({w} * t)",
        force="0",
        t_end=(2 * math.pi * 20) / w,
    ).transitions
    assert log.edge.tolist() == ["lift", "engage"] * 20
    first = (math.pi + math.asin(0.9)) / w
    assert log.t[::2] == pytest.approx([first + 2 * math.pi * k / w for k in range(20)], rel=1e-9)


@pytest.mark.parametrize("force", ["0.5", "0.5 * abs(v)", "0.5 * N + abs(v) * v"])
def test_a_guard_on_a_surface_of_the_flow_fires(force: str) -> None:
    """The contact is released at t = 1 with v = 0, and v > 0 holds from there on."""
    log = run(
        (
            State("stuck", locked=True),
            State("start", outputs={"F": force}),
            State("forward", outputs={"F": force}),
        ),
        (
            Transition("release", "stuck", "start", guard="F > 1"),
            Transition("move", "start", "forward", guard="v > 0"),
        ),
        force="t",
        t_end=2.0,
    ).transitions
    assert log.edge.tolist() == ["release", "move"]
    assert log.t == pytest.approx([1.0, 1.0], abs=1e-9)
