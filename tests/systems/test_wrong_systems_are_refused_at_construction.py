"""A system or chart that cannot run is refused when it is constructed, with one clear error."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from gms_fsm import (
    Body,
    Chart,
    ChartError,
    ChartModel,
    Contact,
    ExpressionError,
    GMSError,
    ParameterError,
    Prescribed,
    Sampled,
    Spring,
    State,
    System,
    Transition,
    simulate,
)
from tests.systems_cases import DRY, STICTION

WELD = Chart("weld", states=(State("held", locked=True),))
MASS = Body("mass", inertia=1.0)


def system(*, body: Body = MASS, v: str = "v", **more: Any) -> System:
    contact = Contact("pad", STICTION, DRY, v=v)
    return System("one", **{"bodies": (body,), "contacts": (contact,), **more})


def one_state(**parts: Any) -> Chart:
    return Chart("c", variables=("z",), states=(State("on", **parts),))


WELDS = (Contact("a", WELD), Contact("b", WELD))
REFUSED: dict[str, tuple[Callable[[], object], type[GMSError], str]] = {
    "v squared": (lambda: system(v="v * v"), ParameterError, r"'v \* v' is not linear"),
    "v with an offset": (lambda: system(v="v + 1"), ParameterError, "is not linear"),
    "name in v": (lambda: system(v="w"), ExpressionError, "contact 'pad', v, .*unknown name 'w'"),
    "name in a force": (
        lambda: system(body=Body("mass", inertia=1.0, force="K * x")),
        ExpressionError,
        "body 'mass', force, .*unknown name 'K'",
    ),
    "name in a flow": (lambda: system(flow={"i": "u"}), ExpressionError, "unknown name 'u'"),
    "force of a contact": (
        lambda: system(body=Body("mass", inertia=1.0, force="F")),
        ExpressionError,
        "unknown name 'F'",
    ),
    "zero inertia": (
        lambda: system(body=Body("mass", inertia="J"), numbers={"J": 0.0}),
        ParameterError,
        "body 'mass': the inertia 'J' is not positive",
    ),
    "negative inertia": (
        lambda: system(body=Body("mass", inertia=-1.0)),
        ParameterError,
        r"body 'mass': the inertia -1\.0 is not positive",
    ),
    "negative inertia by numbers": (
        lambda: system(body=Body("mass", inertia="a - b"), numbers={"a": 1.0, "b": 2.0}),
        ParameterError,
        "body 'mass': the inertia 'a - b' is not positive",
    ),
    "a stiffness that a number makes negative": (
        lambda: system(springs=(Spring("s", "mass", k="a"),), numbers={"a": -1.0}),
        ParameterError,
        "spring 's', k is 'a'; the stiffness must be >= 0",
    ),
    "a spring at no body": (
        lambda: system(springs=(Spring("s", "mas", k=1.0),)),
        ParameterError,
        "spring 's': there is no body 'mas'; did you mean 'mass'",
    ),
    "a spring with one end": (
        lambda: Spring("s", "mass", "mass", k=1.0),
        ParameterError,
        "spring 's': both its ends are 'mass'",
    ),
    "F in a flow": (
        lambda: one_state(flow={"z": "F"}, outputs={"F": "z"}),
        ChartError,
        "flow of 'z': it reads 'F', .*algebraic loop",
    ),
    "a in a force": (lambda: one_state(outputs={"F": "2 * a"}), ChartError, "algebraic loop"),
    "a missing force": (
        lambda: Chart("c", states=(State("on", outputs={"F": "1"}), State("off"))),
        ChartError,
        "state 'off': no output 'F'",
    ),
    "a bank of locks": (
        lambda: ChartModel(STICTION, DRY, n=2),
        ParameterError,
        "n is 2, and the chart has a locked state",
    ),
    "locks that repeat": (
        lambda: system(contacts=WELDS),
        ParameterError,
        "'a', 'b' are always locked",
    ),
    "a name in an update": (
        lambda: system(sampled=(Sampled("pid", period=1e-3, updates={"u": "k * x"}),)),
        ExpressionError,
        "sampled 'pid', 'u', column 1: unknown name 'k'",
    ),
    "a force in an update": (
        lambda: system(sampled=(Sampled("pid", period=1e-3, updates={"u": "2 * F"}),)),
        ExpressionError,
        "sampled 'pid', 'u', column 5: unknown name 'F'",
    ),
    "a number called period": (
        lambda: system(
            sampled=(Sampled("pid", period=1e-3, updates={"u": "x / period"}),),
            numbers={"period": 2.0},
        ),
        ParameterError,
        "the name 'period' is used twice",
    ),
    "a driven body alone": (
        lambda: system(body=Body("mass", velocity="1")),
        ParameterError,
        "only driven bodies move it",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused(name: str) -> None:
    make, kind, words = REFUSED[name]
    with pytest.raises(GMSError, match=words) as caught:
        make()
    assert type(caught.value) is kind


def test_one_lock_that_always_holds_is_fine_and_so_are_two_that_may() -> None:
    system(contacts=WELDS[:1])
    system(contacts=(*WELDS[:1], Contact("pad", STICTION, DRY)))


def test_a_chart_that_locks_needs_a_rig_that_gives_way() -> None:
    with pytest.raises(ParameterError, match="a Slider or a PulledSlider"):
        simulate(ChartModel(STICTION, DRY), Prescribed("0.1"), 1.0)


def test_several_sources_may_lead_to_a_lock() -> None:
    """The same chart, right."""
    Chart(
        "c",
        states=(
            State("on", outputs={"F": "1"}),
            State("off", outputs={"F": "0"}),
            State("held", locked=True),
        ),
        transitions=(Transition("hold", ("on", "off"), "held", guard="v < 0"),),
    )


def test_a_run_cannot_start_locked_and_moving() -> None:
    with pytest.raises(ParameterError, match=r"'pad' starts in state 'stuck', .* with v = 0.3;"):
        simulate(system(), 1.0, initial={"v": 0.3})
    trace = simulate(system(), 1.0, initial={"v": 0.3, "pad.states": ["forward"]})
    assert trace.transitions.edge.tolist() == ["arrest_forward"]
