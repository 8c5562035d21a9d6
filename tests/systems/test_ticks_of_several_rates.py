"""Ticks at one instant as decimal numbers are one: what is listed later sees the new values."""

from __future__ import annotations

import itertools
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gms_fsm import simulate
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.fmi.model import both_of
from gms_fsm.run.printed import printed
from gms_fsm.run.problem import Problem
from gms_fsm.run.ticks import Clock, clocks_of, ticks_of
from gms_fsm.systems.system import Body, Contact, Sampled, System
from integrators.loop import Buffers
from integrators.runners.stepping import Clocks, next_tick, restart
from tests.helpers import stick_slip

Clocking = tuple[tuple[float, float], ...]  # of each its period and offset
SEVERAL: dict[str, Clocking] = {
    "ten of one": ((1e-4, 0.0), (1e-3, 0.0)),
    "66 of one": ((5e-5, 0.0), (3.3e-3, 0.0), (5e-4, 0.0)),
    "offsets": ((2e-4, 1e-4), (7e-4, 3e-4), (1e-3, 5e-4)),
    "no short decimals": ((1 / 3000, 0.0), (1 / 1000, 0.0)),
    "on average three": ((0.1, 0.0), (0.3, 0.0)),
}
LISTED = [
    pytest.param(clocks, order, id=f"{name} {order}")
    for name, clocks in SEVERAL.items()
    for order in (range(len(clocks)), range(len(clocks))[::-1])
]


def decimal(number: float) -> Fraction:
    """Return a number as it is written."""
    return Fraction(repr(number))


def instants(period: float, offset: float, t_end: float) -> list[float]:
    """Return the doubles nearest to the ticks before a time."""
    ticks = (decimal(offset) + k * decimal(period) for k in itertools.count())
    return [*itertools.takewhile(lambda t: t < t_end, map(float, ticks))]


def counting(clocks: Clocking, order: Sequence[int]) -> System:
    """Samplers that count their ticks, and keep how often each other one had ticked."""
    return System(
        "counters",
        bodies=(Body("slide", velocity="0.2 * cos(3 * t)"),),
        contacts=(Contact("pad", stick_slip("signed")),),
        sampled=[
            Sampled(
                f"c{i}",
                period=clocks[i][0],
                offset=clocks[i][1],
                updates={f"n{i}": f"n{i} + 1", **{f"n{i}{j}": f"n{j}" for j in order if j != i}},
            )
            for i in order
        ],
    )


@pytest.mark.parametrize(("clocks", "order"), LISTED)
def test_every_tick_sees_what_is_listed_before_it_at_the_same_instant(
    clocks: Clocking, order: Sequence[int]
) -> None:
    t_end = 10 * clocks[1][0]
    trace = simulate(counting(clocks, order), t_end, engine="ifelse")
    ticks = [instants(*each, t_end) for each in clocks]
    last = {t: row for row, t in enumerate(trace.t.tolist())}
    rows = [[last[t] for t in own] for own in ticks]
    for i, j in itertools.permutations(order, 2):
        # At its own tick a later sampler has not ticked yet.
        before = bisect_right if order.index(j) < order.index(i) else bisect_left
        assert trace.value(f"n{i}")[rows[i]].tolist() == [*range(1, len(rows[i]) + 1)]
        assert trace.value(f"n{i}{j}")[rows[i]].tolist() == [before(ticks[j], t) for t in ticks[i]]


# --------------------------------------------------------------------------- times
def decimals(most: int, least: int = 1) -> st.SearchStrategy[float]:
    """Decimal numbers with up to six digits after the point."""
    return st.builds(lambda m, k: m / 10**k, st.integers(least, most), st.integers(0, 6))


CLOCKS = st.lists(
    st.builds(Clock, st.just("c"), decimals(9999), decimals(9999, 0), st.booleans()),
    min_size=1,
    max_size=4,
).map(tuple)
STARTS = decimals(99_999, -99_999) | st.floats(-1e6, 1e6)


def exactly(
    clocks: tuple[Clock, ...], origin: float, t_start: float, t_end: float
) -> dict[float, int]:
    """Return what ticks when, by fractions."""
    found: dict[float, int] = {}
    for k, (_, period, offset, sampler) in enumerate(clocks):
        tick, start = decimal(origin) + decimal(offset), decimal(t_start)
        tick += max(0, (start - tick) // decimal(period)) * decimal(period)
        while float(tick) < t_end:
            done = sampler and origin < t_start == float(tick)
            if float(tick) >= t_start and not done:
                found[float(tick)] = found.get(float(tick), 0) | 1 << k
            tick += decimal(period)
    return dict(sorted(found.items()))


@settings(suppress_health_check=[HealthCheck.too_slow])  # on a busy machine
@given(CLOCKS, STARTS, st.integers(0, 30), st.integers(1, 30), st.booleans())
def test_a_tick_is_the_double_nearest_to_its_time_also_in_a_run_that_goes_on(
    clocks: tuple[Clock, ...], origin: float, before: int, after: int, goes_on: bool
) -> None:
    slowest = min(each.period for each in clocks)
    on_tick = float(decimal(origin) + before * decimal(slowest) + decimal(clocks[0].offset))
    t_start = on_tick if goes_on else origin
    t_end = t_start + after * slowest
    ticks = ticks_of(clocks, origin, t_start, t_end)
    found = dict(zip(ticks.times.tolist(), ticks.bits.tolist(), strict=True))
    assert found == exactly(clocks, origin, t_start, t_end)
    assert list(found) == sorted(found)


def stepped(b: Buffers, clocks: Clocks, count: int) -> list[tuple[float, int]]:
    """Return the first ticks of a run without an end."""
    found = []
    if b.plan.jumps[0] < b.now.t:  # none yet
        next_tick(b.plan, clocks)
    for _ in range(count):
        found.append((b.plan.jumps[0], b.plan.ticks[0]))
        next_tick(b.plan, clocks)
    return found


@pytest.mark.parametrize("t_start", [0.0, -0.7, 123.4])
@pytest.mark.parametrize("name", [each for each in SEVERAL if "short" not in each])
def test_an_fmu_ticks_when_a_run_does(name: str, t_start: float) -> None:
    system = counting(SEVERAL[name], tuple(range(len(SEVERAL[name]))))
    both = both_of(Subject.of(system, "fmu2"))
    both.buffers.now.t = t_start
    restart(both.buffers, both.sample.clocks)
    found = stepped(both.buffers, both.sample.clocks, 200)
    ticks = ticks_of(clocks_of(system), t_start, t_start, found[-1][0] + 1e-9)
    assert found == list(zip(ticks.times.tolist(), ticks.bits.tolist(), strict=True))


def test_the_printed_program_ticks_when_a_run_does() -> None:
    start = Problem.of(counting(SEVERAL["66 of one"], (0, 1, 2)), None, 0.17, t_start=0.1)
    names: dict[str, Any] = {}
    exec(printed(start), names)
    found: list[tuple[float, int]] = []
    names["tick"] = lambda bits, t, y, mode, p: found.append((t, bits))
    names["_run"](0.17, 10)
    assert found == list(zip(start.program.ticks.times, start.program.ticks.bits, strict=True))
