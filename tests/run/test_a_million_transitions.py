"""A run's memory is its transition log: under 1,000 bytes per transition, and none for its steps.

With ``output="end"`` nothing else grows, however long the run. This test runs twenty thousand
transitions; tests/soak runs a million and checks what the operating system reports.
"""

from __future__ import annotations

import gc
import importlib.util
import subprocess
import sys
import time
import tracemalloc
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Trace, simulate
from integrators import elementary
from integrators.runners import quick
from tests.helpers import ROOT, matrix, open_loop, stick_slip

pytestmark = pytest.mark.slow

BYTES_A_FIRING = 1000
PERIOD, EACH_PERIOD = 20.0, 16  # of the sine [s]; four elements, four transitions each
compiled = pytest.param(
    "compiled",
    6_000,
    marks=pytest.mark.skipif(not importlib.util.find_spec("llvmlite"), reason="needs extra fast"),
)


def run(engine: str, transitions: int, **options: float) -> Trace:
    """Run enough periods for at least the given number of transitions; keep only the end."""
    periods = -(-transitions // EACH_PERIOD) + 1
    return simulate(
        stick_slip("signed"),
        open_loop(),
        periods * PERIOD + 1.0,
        engine=engine,
        output="end",
        **options,
    )


def load_once(engine: str) -> None:
    """Load what a long run needs; its memory does not count."""
    run(engine, EACH_PERIOD)
    quick.scalar(elementary.exp, 1)


def peak(engine: str, transitions: int, **options: float) -> tuple[int, Trace]:
    """Return the peak memory [bytes] of Python and NumPy, and the run."""
    gc.collect()
    gc.freeze()  # beside the many objects of other tests, garbage of the run would wait for long
    tracemalloc.start()
    try:
        trace = run(engine, transitions, **options)
        return tracemalloc.get_traced_memory()[1], trace
    finally:
        tracemalloc.stop()
        gc.unfreeze()


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("engine", "transitions"),
    matrix([compiled, ("ifelse", 200), ("machines", 200)], [compiled, ("ifelse", 200)]),
)
def test_memory_grows_with_the_log_only(engine: str, transitions: int) -> None:
    load_once(engine)
    few, first = peak(engine, transitions // 4)
    many, second = peak(engine, transitions)
    assert len(second.transitions) >= transitions
    assert len(second) == 1
    more = len(second.transitions) - len(first.transitions)
    assert (many - few) / more < BYTES_A_FIRING


@pytest.mark.matrix
@pytest.mark.parametrize("engine", [pytest.param("compiled", marks=compiled.marks), "ifelse"])
def test_ten_times_the_steps_take_no_more_memory(engine: str) -> None:
    load_once(engine)
    few, first = peak(engine, 16)
    many, second = peak(engine, 16, max_step=0.05)  # a thousand steps, a few times more
    assert len(first.transitions) == len(second.transitions)
    assert many < few + 100_000


@pytest.mark.parametrize(("engine", "transitions"), [compiled, ("ifelse", 1000)])
def test_every_period_equals_the_last(engine: str, transitions: int) -> None:
    """Late transitions are as accurate as early ones: same order, same phase, same values."""
    log = run(engine, transitions).transitions
    first, last = log[EACH_PERIOD : 2 * EACH_PERIOD], log[-EACH_PERIOD:]
    assert first.edge.tolist() == last.edge.tolist()
    assert first.element.tolist() == last.element.tolist()
    for name, most in (("z", 1e-4), ("F_before", 1e-3)):
        np.testing.assert_allclose(first[name], last[name], rtol=0, atol=most)
    phase = np.sort((last.t - first.t + PERIOD / 2) % PERIOD - PERIOD / 2)
    assert np.abs(phase).max() < 1e-3


# --------------------------------------------------------------------------- in a separate process
@dataclass(frozen=True)
class Figures:
    """Resources used by a run."""

    transitions: int
    seconds: float
    peak: int  # bytes, of the whole process


def in_a_child(engine: str, transitions: int) -> Figures:
    """Run in a separate process and query the operating system for its resources."""
    code = f"from {__name__} import measured; measured({engine!r}, {transitions})"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True
    )
    count, seconds, most = done.stdout.split()
    return Figures(int(count), float(seconds), int(most))


def measured(engine: str, transitions: int) -> None:
    """Run, then print transitions, seconds and the peak of memory in bytes."""
    load_once(engine)
    began = time.perf_counter()
    trace = run(engine, transitions)
    seconds = time.perf_counter() - began
    with Path("/proc/self/status").open() as file:  # of the child, not of its parent
        (line,) = [line for line in file if line.startswith("VmHWM")]
    print(len(trace.transitions), seconds, 1024 * int(line.split()[1]))


@pytest.mark.matrix  # tests/soak asks it of a million
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc")
def test_the_operating_system_reports_the_same() -> None:
    few, many = in_a_child("ifelse", 64), in_a_child("ifelse", 800)
    assert many.transitions >= 800
    # Memory comes in pages and heaps in larger blocks: a megabyte is within the noise.
    assert many.peak - few.peak < BYTES_A_FIRING * many.transitions + 2**21
