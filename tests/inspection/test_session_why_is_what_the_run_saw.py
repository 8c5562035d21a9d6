"""`why` equals explain() on the trace and the guards evaluated by hand, on every row."""

from __future__ import annotations

import math

import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.errors import SessionError
from gms_fsm.session.explain import explain
from gms_fsm.session.session import Session
from tests.helpers import FIG4_SINE, pulled_mass, stick_slip


@pytest.mark.slow
@pytest.mark.parametrize("case", ["Fig. 4", "pulled mass"])
def test_every_row_and_element(case: str) -> None:
    model, rig = pulled_mass()
    t_end = 20.0
    if case == "Fig. 4":
        model, rig, t_end = stick_slip("published"), Prescribed(FIG4_SINE), 100.0  # type: ignore[assignment]
    session, trace = Session(model, rig, t_end), simulate(model, rig, t_end)
    for row in range(len(trace)):
        for element in range(model.n):
            assert session.why(element) == explain(trace, row, element)
        session.step()
    assert session.branch.ended


def test_clauses_are_the_guard_by_hand() -> None:
    session = Session(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)
    here = session.goto(25.0)
    (arrest,) = session.why(0)
    slow, inside = arrest.clauses
    assert (slow.text, inside.text) == ("|v| <= v_c", "|z| < s")
    assert (slow.left, slow.right, slow.holds) == (abs(here.v), 1e-6, abs(here.v) <= 1e-6)
    assert (inside.left, inside.right) == (abs(here.z[0]), here.s[0])
    assert inside.margin == here.s[0] - abs(here.z[0]) < 0
    assert not inside.holds
    assert inside.margin == pytest.approx(-0.776, abs=5e-4)


def test_at_a_located_place_it_uses_the_values_there() -> None:
    session = Session(stick_slip("signed"), Prescribed("0.1*sin(t)"), 5.0)
    session.until("z1 > 0.05")
    forward, backward = session.why(0)
    assert forward.clauses[0].left == pytest.approx(0.05, rel=1e-12)
    assert (backward.clauses[0].text, backward.clauses[0].holds) == ("z <= -s", False)
    assert not any(math.isnan(c.margin) for c in forward.clauses)


@pytest.mark.parametrize("element", [-1, 4])
def test_no_such_element(element: int) -> None:
    session = Session(stick_slip("signed"), Prescribed("0.1"), 5.0)
    with pytest.raises(SessionError, match=f"no element {element}; there are 0 to 3"):
        session.why(element)
