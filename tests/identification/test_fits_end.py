"""A fit ends: a proposal costs its budget of steps and no more, and Ctrl-C keeps the best."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, ParameterError, Record, State, StepLimitError, fit
from gms_fsm.identification.problem import runs, task
from tests.identification.records import bank, measured, sine

pytest.importorskip("llvmlite", reason="fits take long without machine code")


def _stiff(rate: float) -> ChartModel:
    """Return a model that needs steps of 1 / rate."""
    chart = Chart(
        "stiff",
        ("v",),
        ("z",),
        ("k", "rate"),
        (State("on", flow={"z": "rate * (v - z)"}),),
        (),
        {"F": "k * z"},
    )
    return ChartModel(chart, {"k": 1.0, "rate": rate})


def _lag() -> Record:
    t = np.linspace(0.0, 4.0, 401)
    v = np.sin(2.0 * t)
    # dz/dt = 5 (v - z) with v = sin(2 t), from rest
    z = (25.0 * v + 10.0 * (np.exp(-5.0 * t) - np.cos(2.0 * t))) / 29.0
    return Record.from_arrays(time=t, velocity=v, force=3.0 * z, name="lag")


def test_a_proposal_costs_its_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    lost = 0
    own = runs.Driver.run

    def watched(self: Any, subject: Any, course: Any) -> Any:
        nonlocal lost
        start = self.start(subject, course)
        searching = self.rtol == task.COARSE_RTOL
        assert start.options.max_steps == (3000 if searching else 30_000)
        try:
            return own(self, subject, course)
        except StepLimitError:
            lost += 1
            raise

    monkeypatch.setattr(runs.Driver, "run", watched)
    # At the start a run takes some 1,700 steps; a few times stiffer, more than the budget.
    found = fit(
        _lag(), _stiff(1e3), free=("k", "rate"), most_steps=3000, bounds={"rate": (1e-2, 1e9)}
    )
    assert found["rate"].value == pytest.approx(5.0, rel=0.01)
    assert lost > 0, "no proposal was ever lost, so this tested nothing"


@pytest.mark.parametrize("most_steps", [430, 470])  # 412 is enough for the search alone
def test_what_ran_in_the_search_runs_at_the_end(most_steps: int) -> None:
    """The runs at the end, with smaller tolerances, need some 460 steps."""
    free = ("k", "rate")
    found = fit(_lag(), _stiff(5.0), free=free, most_steps=most_steps, search="local")
    assert found["rate"].value == pytest.approx(5.0, rel=1e-4)


def test_what_does_not_run_at_the_end_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(task, "FINE_BUDGETS", 1)
    with pytest.raises(ParameterError, match=r"ran on few rows, and not on all.*larger most_steps"):
        fit(_lag(), _stiff(5.0), free=("k", "rate"), most_steps=430, search="local")


def test_nothing_that_runs_is_said_so() -> None:
    with pytest.raises(ParameterError, match=r"no proposal could be run.*most_steps"):
        fit(_lag(), _stiff(5.0), free=("k", "rate"), most_steps=1)


def test_interrupt_keeps_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    record = measured(bank([2e4], [5e-5]), sine(2e-4, 1.0, 3.0), 0.01, 0)
    called = 0
    own = runs.ThreadPool.map

    def interrupted(self: Any, call: Any, given: Any) -> Any:
        nonlocal called
        called += 1
        if called == 3:
            raise KeyboardInterrupt
        return own(self, call, given)

    monkeypatch.setattr(runs.ThreadPool, "map", interrupted)
    found = fit(record, bank([1e4], [4e-5]), free=("k", "weights"))
    assert found.stopped == "The search was interrupted: this is the best so far."
    assert found.stopped in str(found)
    assert np.isfinite(found["k1"].value)
    assert found.training["r2"] > 0.9


PROGRAM = """
import sys
from gms_fsm import fit
from tests.identification.records import bank, measured, sine
record = measured(bank([2e4, 5e3], [5e-5, 1e-4]), sine(4e-4, 2.0, 40.0), 0.01, 0)
print("ready", flush=True)
start = bank([1e4, 1e4], [4e-5, 8e-5])
found = fit(record, start, free=("k", "weights", "C", "F_s", "v_s", "sigma_2"), search="hops")
print("stopped:", bool(found.stopped), found.training["r2"] > 0.5)
"""


@pytest.mark.slow
def test_ctrl_c_in_a_program() -> None:
    running = subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        stdout=subprocess.PIPE,
        text=True,
        cwd=os.getcwd(),
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert running.stdout is not None
    assert running.stdout.readline() == "ready\n"
    time.sleep(3.0)  # compiled, and in the middle of the search
    running.send_signal(signal.SIGINT)
    said, _ = running.communicate()
    assert said == "stopped: True True\n"
    assert running.returncode == 0
