"""The live view shows states, |z|/s, v and F, and draws at most ten frames per second."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import pytest
from rich.console import Console

from gms_fsm import simulate
from gms_fsm.app.live import BETWEEN_FRAMES, CURVE, LiveView
from gms_fsm.foundation.quantities import quantity
from gms_fsm.run.simulate import Moment
from tests.helpers import open_loop, pulled_mass, stick_slip


class Clock:
    """A clock that advances by a fixed time whenever it is read."""

    def __init__(self, tick: float) -> None:
        self.now, self.tick, self.reads = 100.0, tick, 0

    def __call__(self) -> float:
        self.reads += 1
        self.now += self.tick
        return self.now


def screen() -> Console:
    return Console(record=True, file=io.StringIO(), width=120, force_terminal=True)


class Counted(LiveView):
    """Counts calls and frames."""

    asked = drawn = 0

    def __call__(self, moment: Moment) -> None:
        self.asked += 1
        super().__call__(moment)

    def show(self, moment: Moment) -> None:
        self.drawn += 1
        super().show(moment)


def run_with(view: Callable[[Moment], object], t_end: float = 20.0) -> None:
    model, rig = pulled_mass()
    simulate(model, rig, t_end, progress=view)


@pytest.mark.parametrize(("tick", "detail"), [(1e-4, True), (1e-2, False), (1.0, True)])
def test_frames_are_bounded_by_the_elapsed_time(
    tick: float, detail: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = Clock(tick)
    monkeypatch.setattr("gms_fsm.app.live.time.monotonic", clock)
    view = Counted(screen(), 0.0, 20.0, detail=detail)
    begin = clock.now
    run_with(view)
    elapsed = clock.now - begin
    assert view.asked > 40
    assert 1 <= view.drawn <= elapsed / BETWEEN_FRAMES + 1
    assert view.drawn <= view.asked


def test_a_stopped_clock_gives_one_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(0.0)
    monkeypatch.setattr("gms_fsm.app.live.time.monotonic", clock)
    view = Counted(screen(), 0.0, 20.0, detail=True)
    run_with(view)
    assert view.asked > 40
    assert view.drawn == 1


def test_a_frame_that_takes_long_does_not_call_for_the_next(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The pause is counted from the end of a frame; otherwise a slow terminal slows the run."""
    clock = Clock(0.02)
    monkeypatch.setattr("gms_fsm.app.live.time.monotonic", clock)

    class Slow(Counted):
        def show(self, moment: Moment) -> None:
            super().show(moment)
            clock.now += 5.0

    view = Slow(screen(), 0.0, 20.0, detail=True)
    begin = clock.now
    run_with(view)
    drawing = 5.0 * view.drawn
    assert 1 < view.drawn <= (clock.now - begin - drawing) / BETWEEN_FRAMES + 1


def test_between_frames_nothing_of_the_moment_is_computed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = Clock(0.0)
    monkeypatch.setattr("gms_fsm.app.live.time.monotonic", clock)
    view = LiveView(screen(), 0.0, 20.0, detail=True)
    computed = 0
    original: Any = Moment.values.fget  # type: ignore[attr-defined]

    def values(moment: Moment) -> dict[str, Any]:
        nonlocal computed
        computed += 1
        result: dict[str, Any] = original(moment)
        return result

    monkeypatch.setattr(Moment, "values", property(values))
    run_with(view)
    assert computed <= 1 + CURVE  # one picture with its curves


# --------------------------------------------------------------------------- what is shown
class Last:
    """Draws the table of the last moment before a time."""

    def __init__(self, until: float) -> None:
        self.until, self.text, self.seen = until, "", {}
        self.states: list[str] = []
        self.t = 0.0

    def __call__(self, moment: Moment) -> None:
        if moment.t > self.until:
            return
        console = screen()
        console.print(*LiveView(console, 0.0, 10.0, detail=True).tables(moment))
        self.text, self.seen, self.states = console.export_text(), moment.values, moment.states
        self.t = moment.t


def last_table(until: float) -> Last:
    last = Last(until)
    simulate(stick_slip("signed"), open_loop(), until, max_step=0.05, progress=last)
    return last


@pytest.mark.parametrize("until", [0.5, 3.9, 6.0, 11.0])
def test_the_table_shows_state_bar_ratio_v_and_F(until: float) -> None:
    last = last_table(until)
    lines = last.text.splitlines()
    title = lines[0]
    assert f"t = {quantity(last.t, 's', digits=5)}" in title
    assert f" {quantity(last.seen['v'], 'm/s')} " in title
    assert f" {quantity(last.seen['F'], 'N')} " in title
    for i, state in enumerate(last.states):
        line = next(line for line in lines if f"E{i + 1}" in line)
        assert state in line.lower()
        ratio = abs(last.seen["z"][i]) / last.seen["s"][i]
        assert f"{ratio:.3f}" in line
        assert f" {quantity(last.seen['z'][i], 'm')} " in line
        assert line.count("█") == min(20, round(20 * ratio))
        assert line.count("█") + line.count("░") == 20


@pytest.mark.parametrize("detail", [True, False])
def test_without_live_there_is_a_bar_only(detail: bool) -> None:
    console = screen()
    model, rig = pulled_mass()
    with LiveView(console, 0.0, 5.0, detail=detail) as view:
        simulate(model, rig, 5.0, progress=view)
    text = console.export_text()
    assert ("|z|/s" in text) is detail
    assert ("E1" in text) is detail
    assert "t =" in text


def test_the_bar_shows_the_time_of_the_run_not_since_its_start() -> None:
    console = screen()
    with LiveView(console, 100.0, 101.0, detail=True) as view:
        simulate(stick_slip("signed"), open_loop(), 101.0, t_start=100.0, progress=view)
    times = [
        float(line.partition("t =")[2].split()[0])
        for line in console.export_text().splitlines()
        if "t =" in line
    ]
    assert times
    assert all(100.0 <= time <= 101.0 for time in times), times
