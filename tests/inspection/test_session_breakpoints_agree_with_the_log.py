"""Breakpoints of every kind stop where the transition log and the raw guards say."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.errors import ExpressionError, SessionError
from gms_fsm.session.explain import explain
from gms_fsm.session.session import Session
from tests.helpers import FIG4_SINE, stick_slip

EDGES = ("break_away_forward", "break_away_backward", "arrest")


def _session() -> Session:
    return Session(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)


@cache
def _trace() -> Trace:
    return simulate(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)


def _stops(session: Session) -> list[int]:
    rows = []
    while True:
        here, point = session.proceed()
        if point is None:
            return rows
        rows.append(here.row)


def _fired() -> list[tuple[int, Any]]:
    """Rows made by firings, with the record of the log."""
    trace = _trace()
    rows = [row for row in range(len(trace)) if trace.microstep[row] > 0]
    return list(zip(rows, trace.transitions, strict=True))


@pytest.mark.parametrize("element", [None, 0, 1, 3])
@pytest.mark.parametrize("edge", EDGES)
def test_fires(edge: str, element: int | None) -> None:
    session = _session()
    session.break_on("fires", edge, element)
    assert _stops(session) == [
        row for row, r in _fired() if r.edge == edge and element in (None, r.element)
    ]


@pytest.mark.parametrize("element", [None, 2])
@pytest.mark.parametrize("state", ["stick", "slip"])
@pytest.mark.parametrize("kind", ["enter", "leave"])
def test_enter_and_leave(kind: str, state: str, element: int | None) -> None:
    session = _session()
    session.break_on(kind, state, element)
    end = "target" if kind == "enter" else "source"
    assert _stops(session) == [
        row for row, r in _fired() if r[end] == state and element in (None, r.element)
    ]


@pytest.mark.parametrize("element", range(4))
@pytest.mark.parametrize("edge", EDGES)
def test_valid_is_where_the_raw_guard_becomes_true(edge: str, element: int) -> None:
    trace, session = _trace(), _session()
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
    assert _stops(session) == expected


def test_tested_stops_before_every_firing_and_at_stops_that_fire_nothing() -> None:
    session = _session()
    session.break_on("tested", "break_away_backward", 1)
    rows, trace = _stops(session), _trace()
    assert rows == sorted(set(rows))
    assert all(trace.states[row, 1] == "stick" for row in rows)
    for row, r in _fired():
        if r.element == 1 and r.edge == "break_away_backward":
            assert row - 1 in rows
    assert len(rows) < len(trace) / 2  # a step that ended by itself asks nobody


def test_a_condition_narrows_and_hits_counts() -> None:
    session, trace = _session(), _trace()
    point = session.break_on("fires", "arrest", condition="z1 < 0 and state(2) == stick", hits=3)
    rows = [
        row
        for row, r in _fired()
        if r.edge == "arrest" and trace.z[row, 0] < 0 and trace.states[row, 1] == "stick"
    ]
    assert len(rows) > 3
    assert _stops(session) == rows[2:]
    assert point.seen == len(rows)


def test_several_breakpoints_stop_at_whichever_comes_first() -> None:
    session = _session()
    first = session.break_on("fires", "arrest", 2)
    second = session.break_on("leave", "stick", 0)
    found = []
    while (stop := session.proceed())[1] is not None:
        found.append((stop[0].row, stop[1]))
    assert [row for row, _ in found] == [
        row
        for row, r in _fired()
        if (r.edge, r.element) == ("arrest", 2) or (r.source, r.element) == ("stick", 0)
    ]
    assert {id(point) for _, point in found} == {id(first), id(second)}


def test_without_breakpoints_it_goes_to_the_end() -> None:
    here, point = _session().proceed()
    assert (here.t, point) == (100.0, None)


def test_after_going_back_the_same_breakpoint_stops_at_the_same_row() -> None:
    session = _session()
    session.break_on("fires", "break_away_backward", 1)
    first = session.proceed()[0]
    session.back(10)
    assert session.proceed()[0] == first


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        (("fired", "arrest"), SessionError, "tested, valid, fires, enter, leave"),
        (("fires", "arest"), SessionError, "break_away_forward, break_away_backward, arrest"),
        (("fires", "slip"), SessionError, "no edge 'slip'"),
        (("enter", "arrest"), SessionError, "stick, slip"),
        (("fires", "arrest", 4), SessionError, "no element 4; there are 0 to 3"),
        (("fires", "arrest", -1), SessionError, "no element -1"),
        (("fires", "arrest", None, "z9 > 0"), ExpressionError, "z9"),
        (("fires", "arrest", None, "", 0), SessionError, "at least 1"),
    ],
)
def test_a_wrong_breakpoint_is_refused(arguments: Any, error: type[Exception], said: str) -> None:
    session = _session()
    with pytest.raises(error, match=said):
        session.break_on(*arguments)
    assert session.breakpoints == []


def test_the_explanation_at_a_breakpoint_is_that_of_the_trace() -> None:
    session = _session()
    session.break_on("fires", "break_away_backward", 1)
    here, _ = session.proceed()
    assert session.why(1) == explain(_trace(), here.row, 1)
