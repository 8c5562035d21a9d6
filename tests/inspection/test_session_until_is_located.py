"""`until` stops where its condition next becomes true, located between the rows."""

from __future__ import annotations

import math

import pytest
from scipy.optimize import brentq

from gms_fsm import Prescribed
from gms_fsm.errors import ExpressionError
from gms_fsm.session.session import Session
from tests.helpers import one_element, pulled_mass, stick_slip


def _stuck(**options: float) -> Session:
    """One element that sticks: z = x = 0.1 (1 - cos t), v = 0.1 sin t."""
    return Session(one_element("signed"), Prescribed("0.1*sin(t)"), 6.0, **options)


@pytest.mark.parametrize("level", [0.003, 0.05, 0.1, 0.1999])
@pytest.mark.parametrize("name", ["z1", "x"])
def test_a_crossing_of_a_closed_form(level: float, name: str) -> None:
    here = _stuck(max_step=0.01).until(f"{name} > {level}")
    exact = brentq(lambda t: 0.1 * (1 - math.cos(t)) - level, 0.0, math.pi, xtol=1e-15)
    slope = 0.1 * math.sin(exact)
    assert here.located
    assert here.t == pytest.approx(exact, abs=1e-11 / slope)
    assert (here.z[0] if name == "z1" else here.x) == pytest.approx(level, rel=1e-12)


def test_a_velocity_is_located_to_the_clock() -> None:
    here = _stuck().until("v < -0.05")
    assert here.t == pytest.approx(math.pi + math.asin(0.5), abs=1e-13)
    assert here.v < -0.05 <= here.v + 1e-15


def test_it_stops_just_after_the_crossing_never_before() -> None:
    session = _stuck()
    here = session.until("z1 > 0.1")
    assert session.watch("z1") > 0.1
    assert session.at(here.row + 1).t > here.t


@pytest.mark.slow
def test_true_already_must_first_become_false() -> None:
    session = _stuck(max_step=0.01)
    first = session.until("v > 0.05")
    assert first.t == pytest.approx(math.asin(0.5), abs=1e-12)
    assert session.until("v > 0.05").t == 6.0  # the sine comes back after 6.8 s only
    session.goto(0.0)
    assert session.until("t > 1").t == pytest.approx(1.0, abs=1e-15)


def test_a_second_condition_starts_from_the_located_place() -> None:
    session = _stuck()
    first = session.until("z1 > 0.05")
    second = session.until("z1 > 0.0501")
    assert second.t - first.t == pytest.approx(0.0001 / first.v, rel=1e-3)
    assert session.back().row == second.row
    assert not session.here.located


def test_a_condition_that_never_holds_ends_at_the_end_of_the_run() -> None:
    session = _stuck()
    here = session.until("z1 > 5")
    assert (here.t, here.located, session.branch.ended) == (6.0, False, True)


@pytest.mark.slow
def test_a_state_becomes_true_on_the_row_of_its_firing() -> None:
    model, rig = pulled_mass()
    session = Session(model, rig, 60.0)
    here = session.until("state(3) == slip")
    fired = next(r for r in session.branch.log() if r[1] == 2)
    assert (here.t, here.states[2], here.located) == (fired[0], "slip", False)
    later = session.until("state(1) == slip and state(2) == stick")
    assert later.states[:2] == ("slip", "stick")
    assert later.t > here.t


def test_what_cannot_be_computed_is_not_true() -> None:
    session = _stuck()
    assert session.until("sqrt(x - 0.05) > 0").x > 0.05


@pytest.mark.parametrize(
    "text",
    ["z9 > 0", "z1", "state(1) == slide", "z1 == 0.1", "", "__import__('os')", "state(9) == slip"],
)
def test_an_invalid_condition_is_rejected_without_moving(text: str) -> None:
    session = Session(stick_slip("signed"), Prescribed("0.1"), 1.0)
    with pytest.raises(ExpressionError):
        session.until(text)
    assert session.here.row == 0
