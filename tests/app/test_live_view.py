"""The live view shows a run at the speed asked for, in ten frames a second; the run is the same."""

from __future__ import annotations

import io
import itertools
import re
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.app.live import BETWEEN_FRAMES, CURVE, LiveView
from gms_fsm.errors import OutputError
from gms_fsm.foundation.quantities import Scale, quantity, scale_of
from gms_fsm.run.simulate import Moment
from tests.helpers import FASTEST, FIG4_SINE, ROOT, open_loop, pulled_mass, stick_slip
from tests.scenario_files import CommandLine

FIG_4 = str(ROOT / "gms_fsm/scenarios" / "paper_fig4_stick_slip.toml")
END = 12.0  # s


class Clock:
    """Advances while somebody sleeps, and by a tick at each reading."""

    def __init__(self) -> None:
        self.now, self.tick = 1000.0, 1e-6

    def monotonic(self) -> float:
        self.now += self.tick
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.now += seconds


class Watched(LiveView):
    """Counts calls and frames, and notes the time of the clock and of the run at each look."""

    asked = drawn = 0
    clock: Clock
    takes = 0.0  # a frame, s

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.looks: list[tuple[float, float, dict[str, Any]]] = []

    def _see(self, moment: Moment) -> None:
        self.looks.append((self.clock.now, moment.t, moment.values))
        super()._see(moment)

    def __call__(self, moment: Moment) -> None:
        self.asked += 1
        super().__call__(moment)

    def show(self, moment: Moment) -> None:
        self.drawn += 1
        super().show(moment)
        self.clock.now += self.takes


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr("gms_fsm.app.live.time", made)
    monkeypatch.setattr(Watched, "clock", made, raising=False)
    return made


def console(terminal: bool = True) -> Console:
    return Console(record=True, file=io.StringIO(), width=100, force_terminal=terminal)


def run(engine: str = "machines", **options: Any) -> Trace:
    return simulate(stick_slip("published"), open_loop(), END, engine=engine, **options)


def played(
    pace: float, engine: str = "machines", *, terminal: bool = True
) -> tuple[Watched, Trace, str]:
    """Play the run of Fig. 4 and return view, trace and what was printed."""
    screen = console(terminal)
    with Watched(screen, 0.0, END, detail=True, pace=pace) as view:
        trace = run(engine, progress=view)
    return view, trace, screen.file.getvalue()  # type: ignore[attr-defined]


# --------------------------------------------------------------------------- against the clock
@pytest.mark.slow
@pytest.mark.parametrize(("engine", "pace"), [("machines", 4.0), (FASTEST, 1.0)])
def test_each_frame_shows_the_time_of_the_clock(engine: str, pace: float, clock: Clock) -> None:
    view, trace, text = played(pace, engine)
    begin = view.looks[0][0]
    assert view.looks[-1][1] == END
    assert view.looks[-1][0] - begin == pytest.approx(END / pace, abs=0.01)
    for now, t, _ in view.looks:
        assert t == pytest.approx(pace * (now - begin), abs=pace * 0.01)
    times = [now for now, _, _ in view.looks]
    assert max(b - a for a, b in itertools.pairwise(times)) < 1.01 * BETWEEN_FRAMES
    # Between rows values are interpolated; at a transition an earlier micro-step may be shown.
    looks = [(t, values) for _, t, values in view.looks if t not in trace.transitions.t]
    expected = trace.sample([t for t, _ in looks])
    assert [values["F"] for _, values in looks] == pytest.approx(list(expected.F), abs=1e-6)
    assert [values["v"] for _, values in looks] == pytest.approx(list(expected.v), abs=1e-9)
    plain = run(engine)
    assert (trace.t.tolist(), trace.F.tolist()) == (plain.t.tolist(), plain.F.tolist())
    last = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)[-3000:]
    for record in trace.transitions[-5:]:
        assert f"t = {record.t:.9g} s  element {record.element + 1}: " in last
    assert f"last transitions ({len(trace.transitions)} so far)" in last
    assert f"simulated seconds per second: {pace:g}" in last
    assert re.search(r"\nv [▁▂▃▄▅▆▇█]+ -?[\d.]+ to -?[\d.]+ mm/s", last)
    assert re.search(r"\nF [▁▂▃▄▅▆▇█]+ -?[\d.]+ to -?[\d.]+ N", last)


@pytest.mark.slow
def test_without_a_terminal_each_transition_is_one_plain_line(clock: Clock) -> None:
    _, trace, text = played(4.0, FASTEST, terminal=False)
    assert "\x1b" not in text
    times = re.findall(r"^t = (\S+) s  element (\d): (\w+) -> (\w+) by (\w+)$", text, re.MULTILINE)
    assert times == [
        (f"{record.t:.9g}", str(record.element + 1), record.source, record.target, record.edge)
        for record in trace.transitions
    ]
    lines = re.findall(r"^t = (\S+) s: v = \S+ \S+, F = \S+ m?N, \d \w+", text, re.MULTILINE)
    assert len(lines) == pytest.approx(END / 4.0, abs=2)  # one per second of the clock


@pytest.mark.slow
def test_a_run_that_is_computed_too_slowly_does_not_rush_later(clock: Clock) -> None:
    with Watched(console(terminal=False), 0.0, END, detail=True, pace=4.0) as view:
        waits = iter([20.0])

        def slow(moment: Moment) -> None:
            clock.now += next(waits, 0.0)
            view(moment)

        begin = clock.now
        run(progress=slow)
    assert clock.now - begin == pytest.approx(20.0 + END / 4.0, abs=0.1)


@pytest.mark.slow
def test_ctrl_c_keeps_what_was_computed(
    gms_fsm: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slept = itertools.count(1)

    def pressed(_: float) -> None:
        if next(slept) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr("gms_fsm.app.live.time.sleep", pressed)
    done = gms_fsm("run", FIG_4, "-o", "out", "--live", "--pace", "0.1")
    assert done.code == 130
    assert "the run so far is in out/partial.npz" in done.err.replace("\\", "/")
    kept = Trace.load(tmp_path / "out" / "partial.npz")
    whole = simulate(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)
    assert kept.t.tolist() == whole.t[: len(kept)].tolist()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--pace", "0.1"], "it is an option of --live"),
        (["--live", "--pace", "0"], "0 is not a positive number"),
        (["--live", "--pace", "nan"], "nan is not a positive number"),
        (["--live", "--pace", "fast"], "parse string as a number"),
    ],
)
def test_a_mistake_is_one_message(options: list[str], said: str, gms_fsm: CommandLine) -> None:
    done = gms_fsm("run", FIG_4, *options)
    assert done.code == 2
    assert said in " ".join(done.err.replace("│", "").split())
    assert "Traceback" not in done.err


# --------------------------------------------------------------------------- cheap
@pytest.mark.slow
@pytest.mark.parametrize(
    ("tick", "takes"),
    [(0.0, 0.0), (1e-2, 0.0), (1.0, 0.0), (0.02, 5.0)],  # a slow terminal slows no run
)
def test_frames_are_bounded_by_the_time_between_them(
    tick: float, takes: float, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    computed, original = [], Moment.values.fget  # type: ignore[attr-defined]

    def values(moment: Moment) -> Any:
        computed.append(moment.t)
        return original(moment)

    monkeypatch.setattr(Moment, "values", property(values))
    clock.tick, begin = tick, clock.now
    view = Watched(console(), 0.0, 20.0, detail=True)
    view.takes = takes
    simulate(*pulled_mass(), 20.0, progress=view)
    assert view.asked > 40
    elapsed = clock.now - begin - takes * view.drawn
    assert 1 <= view.drawn <= elapsed / BETWEEN_FRAMES + 1
    if not tick:  # one picture with its curves; between frames nothing is computed
        assert len(computed) <= 2 + CURVE


# --------------------------------------------------------------------------- what is shown
@pytest.mark.parametrize("until", [0.5, 6.0, 11.0])
def test_the_table_shows_state_bar_ratio_v_and_F(until: float) -> None:
    last: list[tuple[float, str, dict[str, Any], list[str]]] = []

    def note(moment: Moment) -> None:
        screen = console()
        screen.print(*LiveView(screen, 0.0, 10.0, detail=True).tables(moment))
        last[:] = [(moment.t, screen.export_text(), moment.values, moment.states)]

    simulate(stick_slip("signed"), open_loop(), until, max_step=0.05, progress=note)
    ((t, text, seen, states),) = last
    lines = text.splitlines()
    for part in (f"t = {Scale(0, 's').text(t, 5)} ", quantity(seen["v"], "m/s")):
        assert part in lines[0]
    assert f" {quantity(seen['F'], 'N')} " in lines[0]
    for i, state in enumerate(states):
        line = next(line for line in lines if f"E{i + 1}" in line)
        assert state in line.lower()
        ratio = abs(seen["z"][i]) / seen["s"][i]
        assert f"{ratio:.3f}" in line
        assert f" {scale_of(seen['z'], 'm').text(seen['z'][i])} " in line
        assert line.count("█") == min(20, round(20 * ratio))
        assert line.count("█") + line.count("░") == 20


@pytest.mark.parametrize("detail", [True, False])
def test_the_bar_shows_the_time_of_the_run(detail: bool) -> None:
    screen = console()
    with LiveView(screen, 100.0, 101.0, detail=detail) as view:
        simulate(stick_slip("signed"), open_loop(), 101.0, t_start=100.0, progress=view)
    text = screen.export_text()
    assert ("|z|/s" in text) is detail
    times = re.findall(r"t = (\S+)", text)
    assert times
    assert all(100.0 <= float(each) <= 101.0 for each in times), times


def test_a_run_that_does_not_begin_has_no_bar() -> None:
    screen = console()
    with pytest.raises(OutputError), LiveView(screen, 0.0, 1.0, detail=False):
        raise OutputError("cannot make the folder")
    assert screen.file.getvalue() == ""  # type: ignore[attr-defined]
