"""A fit ends: a proposal costs its budget of steps and no more, and Ctrl-C keeps the best."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, ParameterError, Record, State, StepLimitError, fit
from gms_fsm.identification.problem import runs, task
from tests.identification.records import FREE, TRUTH, bank, fitted, rubbed

pytest.importorskip("llvmlite", reason="fits take long without machine code")

pytestmark = pytest.mark.slow


def _lag(rate: float, **options: Any) -> Any:
    """Fit a model that needs steps of 1 / rate, in truth 5."""
    flow = State("on", flow={"z": "rate * (v - z)"})
    chart = Chart("stiff", ("v",), ("z",), ("k", "rate"), (flow,), (), {"F": "k * z"})
    t = np.linspace(0.0, 4.0, 401)
    v = np.sin(2.0 * t)
    # dz/dt = 5 (v - z) with v = sin(2 t), from rest
    z = (25.0 * v + 10.0 * (np.exp(-5.0 * t) - np.cos(2.0 * t))) / 29.0
    record = Record.from_arrays(time=t, velocity=v, force=3.0 * z, name="lag")
    return fit(record, ChartModel(chart, {"k": 1.0, "rate": rate}), free=("k", "rate"), **options)


@pytest.mark.matrix
def test_a_proposal_costs_its_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """What fails with others in machine code is run again alone, for the reason."""
    lost = 0
    own = runs.Driver.run

    def watched(self: Any, subject: Any, course: Any) -> Any:
        nonlocal lost
        searching = self.rtol == task.COARSE_RTOL
        assert self.start(subject, course).options.max_steps == (3000 if searching else 30_000)
        try:
            return own(self, subject, course)
        except StepLimitError:
            lost += 1
            raise

    monkeypatch.setattr(runs.Driver, "run", watched)
    # At the start a run takes some 1,700 steps; a few times stiffer, more than the budget.
    found = _lag(1e3, most_steps=3000, bounds={"rate": (1e-2, 1e9)})
    assert found["rate"].value == pytest.approx(5.0, rel=0.01)
    assert lost > 0, "no proposal was ever lost, so this tested nothing"


@pytest.mark.matrix
def test_what_ran_in_the_search_runs_at_the_end_or_it_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """412 steps are enough for the search; the runs at the end, more exact, need some 460."""
    assert _lag(5.0, most_steps=430, search="local")["rate"].value == pytest.approx(5.0, rel=1e-4)
    monkeypatch.setattr(task, "FINE_BUDGETS", 1)
    with pytest.raises(ParameterError, match=r"ran on few rows, and not on all.*larger most_steps"):
        _lag(5.0, most_steps=430, search="local")
    with pytest.raises(ParameterError, match=r"no proposal could be run.*most_steps"):
        _lag(5.0, most_steps=1)


def test_interrupt_keeps_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    called = 0
    own = runs.ThreadPool.map

    def interrupted(self: Any, call: Any, given: Any) -> Any:
        nonlocal called
        called += 1
        if called == 3:
            raise KeyboardInterrupt
        return own(self, call, given)

    monkeypatch.setattr(runs.ThreadPool, "map", interrupted)
    found = fit(rubbed(3.0), bank([1e4], [4e-5]), free=FREE)
    assert found.stopped == "The search was interrupted: this is the best so far."
    assert found.stopped in str(found)
    assert found.training["r2"] > 0.9


def test_an_interrupt_while_intervals_are_made_keeps_the_values(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def interrupted(*_: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules[fit.__module__], "assessed", interrupted)
    found = fitted(rubbed(3.0), TRUTH, ["k"])
    assert found["k1"].value == pytest.approx(2e4, rel=0.01)
    assert found.stopped.startswith("Interrupted before the intervals were known")
    assert not found["k1"].told
    assert np.isfinite(found.effective_rows)
    assert str(found)


def test_a_better_point_met_while_intervals_are_made_is_searched_from(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Here all searches before find nothing but the start."""
    polish, calls = task.Task.polish, list[Any]()

    def later(self: Any, u: Any, best: Any, pool: Any) -> None:
        if calls:
            polish(self, u, best, pool)
        calls.append(u)

    monkeypatch.setattr(task, "_local", lambda given, _, best, __: best.take([given.start_point()]))
    monkeypatch.setattr(task.Task, "polish", later)
    found = fitted(rubbed(), bank([2e4, 5e3], [4.7e-5, 9.5e-5]), ["weights"])
    assert found["weights1"].value == pytest.approx(5e-5, rel=1e-3)


PROGRAM = """
from gms_fsm import fit
from gms_fsm.identification.problem import runs
from tests.identification.records import START, rubbed
own, called = runs.ThreadPool.map, []
def watched(*given):
    called.append(given)
    if len(called) == 3:
        print("searching", flush=True)
    return own(*given)
runs.ThreadPool.map = watched
record = rubbed(3.0)
found = fit(record, START, free=("k", "weights", "C"), search="hops")
print("stopped:", bool(found.stopped), found.training["r2"] > 0.5)
"""


@pytest.mark.matrix
def test_ctrl_c_in_a_program() -> None:
    running = subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        stdout=subprocess.PIPE,
        text=True,
        cwd=os.getcwd(),
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert running.stdout is not None
    assert running.stdout.readline() == "searching\n"
    running.send_signal(signal.SIGINT)
    said, _ = running.communicate()
    assert said == "stopped: True True\n"
    assert running.returncode == 0
