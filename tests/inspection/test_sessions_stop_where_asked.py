"""Breakpoints stop where the log and the guards say; `until` where its condition becomes true."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.session.explain import explain
from gms_fsm.session.session import Session
from tests.helpers import FIG4_SINE, one_element, stick_slip
from tests.inspection.sessions import a_system, fig4, pulled
from tests.systems_cases import CASES


@cache
def whole() -> Trace:
    return simulate(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)


def stops(session: Session) -> list[tuple[int, Any]]:
    """Rows at which a session stops, and the breakpoints."""
    found = []
    while (stop := session.proceed())[1] is not None:
        found.append((stop[0].row, stop[1]))
    return found


def fired() -> list[tuple[int, Any]]:
    """Rows made by firings, with the record of the log."""
    rows = [row for row in range(len(whole())) if whole().microstep[row] > 0]
    return list(zip(rows, whole().transitions, strict=True))


# --------------------------------------------------------------------------- breakpoints
@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "name", "element"),
    [
        ("fires", "arrest", None),
        ("fires", "break_away_backward", 0),
        ("enter", "slip", None),
        ("enter", "stick", 2),
        ("leave", "stick", None),
        ("leave", "slip", 2),
    ],
)
def test_it_stops_where_the_log_says(kind: str, name: str, element: int | None) -> None:
    column = {"fires": "edge", "enter": "target", "leave": "source"}[kind]
    rows = [row for row, r in fired() if r[column] == name and element in (None, r.element)]
    session = fig4()
    session.break_on(kind, name, element)
    assert [row for row, _ in stops(session)] == rows
    session.goto(0.0)
    here, _ = session.proceed()
    assert here.row == rows[0]
    shown = element or 0
    assert session.why(shown) == explain(whole(), here.row, shown)


@pytest.mark.parametrize("element", [0, 3])
@pytest.mark.parametrize("edge", ["break_away_forward", "break_away_backward", "arrest"])
def test_valid_is_where_the_raw_guard_becomes_true(edge: str, element: int) -> None:
    trace, session = whole(), fig4()
    session.break_on("valid", edge, element)

    def holds(row: int) -> bool:
        z, s, v = trace.z[row, element], trace.s[row, element], trace.v[row]
        source = "slip" if edge == "arrest" else "stick"
        guard = {
            "break_away_forward": z >= s and v > 1e-6,
            "break_away_backward": z <= -s and v < -1e-6,
            "arrest": abs(v) <= 1e-6 and abs(z) < s,
        }[edge]
        return bool(trace.states[row, element] == source and guard)

    expected = [row for row in range(1, len(trace)) if holds(row) and not holds(row - 1)]
    assert expected
    assert [row for row, _ in stops(session)] == expected


def test_tested_stops_before_every_firing_and_at_stops_that_fire_nothing() -> None:
    session, trace = fig4(), whole()
    session.break_on("tested", "break_away_backward", 1)
    rows = [row for row, _ in stops(session)]
    assert rows == sorted(set(rows))
    assert all(trace.states[row, 1] == "stick" for row in rows)
    for row, r in fired():
        if r.element == 1 and r.edge == "break_away_backward":
            assert row - 1 in rows
    assert len(rows) < len(trace) / 2  # a step that ended by itself asks nobody


def test_a_condition_narrows_hits_count_and_the_first_of_several_stops() -> None:
    session, trace = fig4(), whole()
    point = session.break_on("fires", "arrest", condition="z1 < 0 and state(2) == stick", hits=3)
    rows = [
        row
        for row, r in fired()
        if r.edge == "arrest" and trace.z[row, 0] < 0 and trace.states[row, 1] == "stick"
    ]
    assert [row for row, _ in stops(session)] == rows[2:] != []
    assert point.seen == len(rows)
    session = fig4()
    points = session.break_on("fires", "arrest", 2), session.break_on("leave", "stick", 0)
    assert stops(session) == [
        (row, points[r.edge != "arrest"])
        for row, r in fired()
        if (r.edge, r.element) == ("arrest", 2) or (r.source, r.element) == ("stick", 0)
    ]


@pytest.mark.slow
def test_breakpoints_of_one_contact_leave_out_those_of_others_with_the_same_names() -> None:
    case = CASES["two_blocks"]()
    session = Session(case.system, 20.0, initial=case.initial)
    session.break_on("enter", "stuck", "pad2")
    log = simulate(case.system, 20.0, initial=case.initial).transitions
    assert {*log.contact[log.target == "stuck"]} == {"pad1", "pad2"}
    wanted = log.t[(log.target == "stuck") & (log.contact == "pad2")].tolist()
    assert [session.at(row).t for row, _ in stops(session)] == wanted


def test_changes_stops_at_every_row_that_differs_from_the_one_before() -> None:
    trace = whole()
    seen = {
        "state(2)": trace.states[:, 1],
        "sgn(v)": np.sign(trace.v),
        "z1 > 0.3 and v > 0": (trace.z[:, 0] > 0.3) & (trace.v > 0),
    }
    for text, values in seen.items():
        session = fig4()
        session.break_on("changes", text)
        rows = [row for row in range(1, len(trace)) if values[row] != values[row - 1]]
        assert [row for row, _ in stops(session)] == rows != []


def test_changes_takes_a_state_of_a_contact_and_a_condition() -> None:
    session = a_system()
    session.break_on("changes", "pad.state", condition="pad.state == forward")
    here, point = session.proceed()
    assert point is not None
    assert (here.fired.edge, here.contact("pad").states) == ("release_forward", ("forward",))


def test_back_is_at_the_breakpoints_that_were_passed_and_counts_no_hit() -> None:
    session = fig4()
    point = session.break_on("fires", "arrest", hits=3)
    rows = [row for row, r in fired() if r.edge == "arrest"]
    session.goto(100.0)
    back = []
    while (stop := session.proceed(back=True))[1] is not None:
        back.append(stop[0].row)
    assert back == rows[::-1]
    assert (point.seen, session.here.row) == (0, 0)


# --------------------------------------------------------------------------- until
def stuck(**options: float) -> Session:
    """One element that sticks: z = x = 0.1 (1 - cos t), v = 0.1 sin t."""
    return Session(one_element("signed"), Prescribed("0.1*sin(t)"), 6.0, **options)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "level"), [("z1", 0.003), ("z1", 0.1999), ("x", 0.05)])
def test_a_crossing_of_a_closed_form(name: str, level: float) -> None:
    session = stuck(max_step=0.01)
    here = session.until(f"{name} > {level}")
    exact = brentq(lambda t: 0.1 * (1 - math.cos(t)) - level, 0.0, math.pi, xtol=1e-15)
    assert here.located
    assert here.t == pytest.approx(exact, abs=1e-11 / (0.1 * math.sin(exact)))
    assert (here.z[0] if name == "z1" else here.x) == pytest.approx(level, rel=1e-12)
    assert session.watch(name) > level  # just after it, never before
    assert session.at(here.row + 1).t > here.t
    assert session.why(0)[0].clauses[0].left == here.z[0]  # the values there


def test_a_velocity_is_located_to_the_clock() -> None:
    here = stuck().until("v < -0.05")
    assert here.t == pytest.approx(math.pi + math.asin(0.5), abs=1e-13)
    assert here.v < -0.05 <= here.v + 1e-15


def test_it_goes_on_from_a_located_place() -> None:
    session = stuck()
    first = session.until("z1 > 0.05")
    second = session.until("z1 > 0.0501")
    assert second.t - first.t == pytest.approx(0.0001 / first.v, rel=1e-3)
    assert session.back().row == second.row
    assert not session.here.located


def test_true_already_must_first_become_false() -> None:
    session = stuck(max_step=0.1)
    assert session.until("v > 0.05").t == pytest.approx(math.asin(0.5), abs=1e-12)
    end = session.until("v > 0.05")  # the sine comes back after 6.8 s only
    assert (end.t, end.located, session.branch.ended) == (6.0, False, True)
    session.goto(0.0)
    assert session.until("t > 1").t == pytest.approx(1.0, abs=1e-15)
    session.goto(0.0)
    assert session.until("sqrt(x - 0.05) > 0").x > 0.05  # what cannot be computed is not true


@pytest.mark.slow
def test_a_state_becomes_true_on_the_row_of_its_firing() -> None:
    session = pulled()
    here = session.until("state(3) == slip")
    fired = next(r for r in session.branch.log() if r[1] == 2)
    assert (here.t, here.states[2], here.located) == (fired[0], "slip", False)


def test_conditions_use_the_names_of_a_system_and_of_its_contacts() -> None:
    session = a_system()
    assert session.reaches("pad.state == forward and bank.state(2) == stick and w1 > 0.05")
    here = session.here
    assert here.body("one").v == pytest.approx(0.05)
    F = here.contact("pad").F + here.contact("bank").F_elements[0]
    assert session.watch("pad.F + bank.F1") == F
    assert session.watch("r") == 0.1 * math.sin(here.t)


# --------------------------------------------------------------------------- back until
@pytest.mark.parametrize(("name", "level"), [("z1", 0.003), ("z1", 0.1999), ("x", 0.05)])
def test_the_last_point_of_a_closed_form(name: str, level: float) -> None:
    session = stuck(max_step=0.005)
    session.goto(6.0)
    here = session.until(f"{name} < {level}", back=True)  # 0.1 (1 - cos t) falls after pi
    rising = brentq(lambda t: 0.1 * (1 - math.cos(t)) - level, 0.0, math.pi, xtol=1e-15)
    exact = rising if here.t < math.pi else 2 * math.pi - rising
    assert here.t == pytest.approx(exact, abs=1e-10)
    assert here.located
    assert session.watch(name) < level  # the last point at which it was true


def test_back_finds_what_until_found_to_the_width_of_the_clock() -> None:
    session = stuck()
    there = session.until("v < -0.05")
    session.goto(6.0)
    last = session.until("v > -0.05", back=True)
    assert last.t < there.t
    assert there.t - last.t < 1e-14
    assert session.at(last.row).t <= last.t < session.at(last.row + 1).t


def test_back_a_condition_that_is_true_must_first_become_false() -> None:
    session = stuck(max_step=0.1)
    session.goto(2.0)
    assert not session.reaches("v > 0.05", back=True)  # true here since 0.52 s, and never before
    assert (session.here.row, session.here.located) == (0, False)
    assert not session.reaches("v > 0.05", back=True)  # there is nothing before the start


def test_back_goes_on_from_a_located_place() -> None:
    session = stuck()
    session.goto(3.0)
    later = session.until("z1 < 0.0501", back=True)
    earlier = session.until("z1 < 0.05", back=True)
    assert later.t - earlier.t == pytest.approx(0.0001 / earlier.v, rel=1e-3)


def test_back_a_state_was_last_before_the_micro_step_that_left_it() -> None:
    session = fig4()
    session.goto(13.0)
    here = session.until("state(2) == slip", back=True)
    row, left = next((row, r) for row, r in fired() if r.element == 1 and r.edge == "arrest")
    assert (here.row, here.located, here.t) == (row - 1, False, left.t)


def test_back_nothing_is_between_the_rows_of_a_jump() -> None:
    session = a_system()
    session.goto(0.32)
    here = session.until("count < 6.5", back=True)  # the tick at 0.3 s makes it 7
    assert (here.located, session.at(here.row + 1).values["count"]) == (False, 7.0)
