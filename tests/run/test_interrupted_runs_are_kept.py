"""Ctrl-C loses no run, whenever it occurs, and the command line writes what there is to disk.

That `.trace` of the KeyboardInterrupt is the beginning of the run, in every engine, is in
tests/laws/test_the_beginning_does_not_know_the_end.py.
"""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.app.report import run_scenario
from gms_fsm.app.scenario import load_scenario
from gms_fsm.run.recording.recording import Recorder, _Columns
from tests.helpers import ROOT, pulled_mass, stick_slip
from tests.scenario_files import OPEN_LOOP

pytestmark = pytest.mark.slow

OPTIONS = {"all": {}, "t_eval": {"t_eval": np.linspace(0, 8, 111)}}


def begins(whole: Trace, part: Trace) -> None:
    """Assert that a part is complete in itself and equals the beginning of the whole run."""
    count = len(part)
    for name in ("t", "microstep", "x", "v", "z", "F", "states"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[:count], name)
    fired = len(part.transitions)
    assert part.transitions.tolist() == whole.transitions[:fired].tolist()


@pytest.mark.parametrize("call", [1, 8, 1001])
def test_ctrl_c_within_a_step_keeps_the_previous_steps(call: int) -> None:
    """No arc has ended yet: a run that takes an hour for its first 500 steps is not lost."""
    calls = itertools.count(1)

    def velocity(t: float) -> float:
        if next(calls) == call:
            signal.raise_signal(signal.SIGINT)
        return 0.001

    whole = simulate(stick_slip("signed"), Prescribed(lambda t: 0.001), 3.0, max_step=0.01)
    with pytest.raises(KeyboardInterrupt) as caught:
        simulate(stick_slip("signed"), Prescribed(velocity), 3.0, max_step=0.01)
    part: Trace = caught.value.trace  # type: ignore[attr-defined]
    count = len(part)
    assert count >= call // 8 - 1  # evaluations per step
    np.testing.assert_array_equal(part.rows.y, whole.rows.y[:count])


@pytest.mark.every(2)
@pytest.mark.parametrize("options", OPTIONS)
def test_ctrl_c_between_any_two_lines_of_the_recorder_leaves_a_complete_trace(
    options: str, tmp_path: Path
) -> None:
    whole = simulate(*pulled_mass(), 8.0, **OPTIONS[options])
    codes = {Recorder.take.__code__, _Columns.add.__code__}
    struck = 0
    for line in itertools.chain(range(1, 60), range(100, 400, 37)):
        lines = itertools.count(1)

        def strike(frame: FrameType, event: str, _: object, line=line, lines=lines) -> Any:
            if frame.f_code not in codes:
                return None
            if event == "line" and next(lines) == line:
                raise KeyboardInterrupt
            return strike

        before = sys.gettrace()
        sys.settrace(strike)
        try:
            simulate(*pulled_mass(), 8.0, **OPTIONS[options])
        except KeyboardInterrupt as error:
            if not hasattr(error, "trace"):  # before the run
                continue
            part: Trace = error.trace
            struck += 1
        else:
            break
        finally:
            sys.settrace(before)
        if len(part):
            begins(whole, Trace.load(part.save(tmp_path / "part.npz")))
    assert struck > 30


# --------------------------------------------------------------------------- the command line
LONG = OPEN_LOOP.replace("t_end = 1.0", "t_end = 1e8\nmax_steps = 1_000_000_000")


def test_the_command_line_keeps_the_results_and_says_so(tmp_path: Path) -> None:
    scenario = _file(tmp_path, LONG)
    command = [sys.executable, "-m", "gms_fsm", "run", str(scenario)]
    command += ["-o", "out", "--checkpoint", "--set", "run.engine=machines"]
    child = subprocess.Popen(
        command,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ours may ignore it
    )
    while not (tmp_path / "out" / "run.checkpoint").exists():
        time.sleep(0.01)
    time.sleep(0.3)
    child.send_signal(signal.SIGINT)
    out, err = child.communicate()
    assert child.returncode == 130
    assert out == ""
    assert err.startswith("note: interrupted at t = ")
    assert err.endswith("s; the run so far is in out/partial.npz\n")
    part = Trace.load(tmp_path / "out" / "partial.npz")
    assert len(part) > 10
    assert not (tmp_path / "out" / "trace.npz").exists()


def _file(folder: Path, text: str) -> Path:
    path = folder / "long.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize("rows", [None, 0])
def test_before_the_first_row_nothing_is_written(
    rows: int | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def at_once(*_: object, **__: object) -> None:
        error = KeyboardInterrupt()
        if rows is not None:
            error.trace = ()  # type: ignore[attr-defined]
        raise error

    monkeypatch.setattr("gms_fsm.app.scenario.simulate", at_once)
    with pytest.raises(KeyboardInterrupt, match="before the first row"):
        run_scenario(load_scenario(_file(tmp_path, LONG)), tmp_path / "out")
    assert list((tmp_path / "out").iterdir()) == []


def test_ctrl_c_while_figures_are_drawn_does_not_lose_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def struck(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("gms_fsm.app.report.summary_text", struck)
    with pytest.raises(KeyboardInterrupt, match=r"interrupted; the run is in .*trace\.npz"):
        run_scenario(load_scenario(_file(tmp_path, OPEN_LOOP)), tmp_path / "out")
    assert len(Trace.load(tmp_path / "out" / "trace.npz")) > 1
