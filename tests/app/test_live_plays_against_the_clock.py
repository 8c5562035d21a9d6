"""``run --live --pace`` shows a run at the speed asked for; the run is the same as without."""

from __future__ import annotations

import io
import itertools
import re
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.app.live import BETWEEN_FRAMES, LiveView
from gms_fsm.run.simulate import Moment
from tests.helpers import FASTEST, FIG4_SINE, ROOT, open_loop, stick_slip
from tests.scenario_files import CommandLine

FIG_4 = str(ROOT / "scenarios" / "paper_fig4_stick_slip.toml")
END = 12.0  # s


class Clock:
    """A clock that advances only while somebody sleeps, and a little at each reading."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        self.now += 1e-6
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.now += seconds


class Watched(LiveView):
    """Notes the time of the clock and of the run at each look."""

    clock: Clock

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.looks: list[tuple[float, float, dict[str, Any]]] = []

    def _see(self, moment: Moment) -> None:
        self.looks.append((self.clock.now, moment.t, moment.values))
        super()._see(moment)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr("gms_fsm.app.live.time", made)
    monkeypatch.setattr(Watched, "clock", made, raising=False)
    return made


def played(pace: float, engine: str = "machines", *, terminal: bool = True) -> tuple[Any, Any, str]:
    """Play the run of Fig. 4 and return view, trace and what was printed."""
    out = io.StringIO()
    console = Console(file=out, width=100, force_terminal=terminal)
    with Watched(console, 0.0, END, detail=True, pace=pace) as view:
        trace = run(engine, progress=view)
    return view, trace, out.getvalue()


def run(engine: str, **options: Any) -> Trace:
    return simulate(stick_slip("published"), open_loop(), END, engine=engine, **options)


@pytest.mark.parametrize(("engine", "pace"), [("machines", 4.0), (FASTEST, 1.0)])
def test_each_frame_shows_the_time_of_the_clock(engine: str, pace: float, clock: Clock) -> None:
    view, _, _ = played(pace, engine)
    begin = view.looks[0][0]
    assert view.looks[-1][1] == END
    assert view.looks[-1][0] - begin == pytest.approx(END / pace, abs=0.01)
    for now, t, _ in view.looks:
        assert t == pytest.approx(pace * (now - begin), abs=pace * 0.01)
    times = [now for now, _, _ in view.looks]
    assert max(b - a for a, b in itertools.pairwise(times)) < 1.01 * BETWEEN_FRAMES


def test_between_rows_values_are_interpolated(clock: Clock) -> None:
    view, trace, _ = played(4.0, FASTEST)
    # At the time of a transition a row made by an earlier micro-step may be shown.
    looks = [(t, values) for _, t, values in view.looks if t not in trace.transitions.t]
    expected = trace.sample([t for t, _ in looks])
    assert [values["F"] for _, values in looks] == pytest.approx(list(expected.F), abs=1e-6)
    assert [values["v"] for _, values in looks] == pytest.approx(list(expected.v), abs=1e-9)


def test_the_run_is_the_same(clock: Clock) -> None:
    _, trace, _ = played(4.0)
    plain = run("machines")
    assert trace.t.tolist() == plain.t.tolist()
    assert trace.F.tolist() == plain.F.tolist()


def test_the_last_transitions_and_the_curves_are_shown(clock: Clock) -> None:
    _, trace, text = played(4.0)
    last = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)[-3000:]
    for record in trace.transitions[-5:]:
        assert f"t = {record.t:.9g} s  element {record.element + 1}: " in last
    assert f"last transitions ({len(trace.transitions)} so far)" in last
    assert re.search(r"\nv [▁▂▃▄▅▆▇█]+ -?[\d.]+ [mµ]?m/s to -?[\d.]+ [mµ]?m/s", last)
    assert re.search(r"\nF [▁▂▃▄▅▆▇█]+ -?[\d.]+ m?N to -?[\d.]+ m?N", last)
    assert "4 simulated seconds per second" in last


def test_without_a_terminal_each_transition_is_one_plain_line(clock: Clock) -> None:
    _, trace, text = played(4.0, FASTEST, terminal=False)
    assert "\x1b" not in text
    times = re.findall(r"^t = (\S+) s  element (\d): (\w+) -> (\w+) by (\w+)$", text, re.MULTILINE)
    log = trace.transitions
    assert len(times) == len(log)
    for found, record in zip(times, log, strict=True):
        assert found[0] == f"{record.t:.9g}"
        assert found[1:] == (str(record.element + 1), record.source, record.target, record.edge)
    lines = re.findall(r"^t = (\S+) m?s: v = \S+ \S+, F = \S+ m?N, \d \w+", text, re.MULTILINE)
    assert len(lines) == pytest.approx(END / 4.0, abs=2)  # one per second of the clock


def test_a_run_that_is_computed_too_slowly_does_not_rush_later(clock: Clock) -> None:
    out = io.StringIO()
    with Watched(Console(file=out, width=100), 0.0, END, detail=True, pace=4.0) as view:
        first = True

        def slow(moment: Moment) -> None:
            nonlocal first
            clock.now += 20.0 * first
            view(moment)
            first = False

        begin = clock.now
        run("machines", progress=slow)
    assert clock.now - begin == pytest.approx(20.0 + END / 4.0, abs=0.1)


def test_ctrl_c_keeps_what_was_computed(
    gms_fsm: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    slept = 0

    def pressed(_: float) -> None:
        nonlocal slept
        slept += 1
        if slept == 3:
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
        (["--live", "--pace", "-2"], "-2 is not a positive number"),
        (["--live", "--pace", "nan"], "nan is not a positive number"),
        (["--live", "--pace", "fast"], "parse string as a number"),
    ],
)
def test_a_mistake_is_one_message(options: list[str], said: str, gms_fsm: CommandLine) -> None:
    done = gms_fsm("run", FIG_4, *options)
    assert done.code == 2
    assert said in " ".join(done.err.replace("│", "").split())
    assert "Traceback" not in done.err
