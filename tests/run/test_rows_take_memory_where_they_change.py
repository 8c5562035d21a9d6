"""Claim: rows of many elements take memory where something changes, and read as whole rows do."""

from __future__ import annotations

import pickle
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, Trace, simulate
from gms_fsm.run._checkpoint import Checkpointer
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording import compiled_run
from gms_fsm.run.recording.compiled_run import CompiledRun
from gms_fsm.traces import observed
from gms_fsm.traces.rows import PackedTable
from integrators.machine_code import calls

pytest.importorskip("llvmlite", reason="needs the extra fast")
pytestmark = pytest.mark.slow

RIG = Prescribed("1e-3")


def one_by_one(n: int) -> GMS:
    """Return elements that break away one after the other."""
    shares, even = np.linspace(0.5, 1.5, n), np.ones(n)
    numbers = GMSParameters(
        k=100.0 * shares,
        sigma=0.0 * even,
        C=0.1 * even,
        weights=shares / n,
        sigma_2=0.0,
        v_c=1e-6,
        stribeck=Stribeck(1.0, 1.5, 1e-3),
    )
    return GMS(numbers, law="signed")


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pack all runs, in blocks of 16 rows."""
    for name in ("LARGE", "WIDE"):
        monkeypatch.setattr(compiled_run, name, 1)
    monkeypatch.setattr(observed, "AT_ONCE", 1)


def equal(one: Trace, other: Trace) -> None:
    """Assert that two runs have the same rows, bit for bit."""
    for name in ("t", "microstep", "y", "mode"):
        assert getattr(one.rows, name).tobytes() == getattr(other.rows, name).tobytes()
    assert one.F.tobytes() == other.F.tobytes()
    assert one.F_elements.tobytes() == other.F_elements.tobytes()
    assert one.transitions.tobytes() == other.transitions.tobytes()


@pytest.mark.matrix
def test_two_thousand_elements_one_by_one_take_less_than_60_MB(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    model = one_by_one(2000)
    monkeypatch.setattr(calls, "AT_ONCE", 0.0)
    for _ in range(2):  # the first loads what is compiled at once, the second the better code
        simulate(model, RIG, 1e-3, engine="compiled")
    tracemalloc.start()
    try:
        trace = simulate(model, RIG, 40.0, engine="compiled")
        assert np.isfinite(trace.F).all()
        kept, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(trace.transitions) == 2000
    assert len(trace) * 2 * 2000 * 8 > 150e6  # what whole rows take
    assert kept < 25e6
    assert most < 60e6


def test_packed_rows_are_the_rows(small: None, monkeypatch: pytest.MonkeyPatch) -> None:
    model = one_by_one(40)
    packed = simulate(model, RIG, 2000.0, engine="compiled")
    assert isinstance(packed.rows.y, PackedTable)
    assert len(packed.rows.y.blocks) > 3
    monkeypatch.setattr(compiled_run, "WIDE", 256)
    whole = simulate(model, RIG, 2000.0, engine="compiled")
    assert isinstance(whole.rows.y, np.ndarray)
    equal(packed, whole)
    y, rows = whole.rows.y, np.array([40, 3, 3, -1])
    for key in (5, -1, np.int64(7), slice(3, 60, 7), rows, y[:, 0] > 0, slice(0, 0)):
        for columns in (slice(None), 2, slice(1, 4), np.array([3, 0])):
            found = packed.rows.y[key, columns]
            assert np.array_equal(found, y[key][..., columns])
        assert np.array_equal(packed.rows.y[key], y[key])
    equal(pickle.loads(pickle.dumps(packed)), whole)


def test_a_packed_run_can_be_looked_at_and_resumed(small: None, tmp_path: Path) -> None:
    start = Problem.of(one_by_one(40), RIG, 2000.0)
    run, seen = CompiledRun(start, None), []
    while run.advance():
        seen.append(run.recorder.trace())
        before, after = run.recorder.around(seen[-1].t[len(seen[-1]) // 3])
        assert after is None or before[0] <= after[0]
        if len(seen) == 5:
            Checkpointer(run, tmp_path / "run.checkpoint", 0.0)
    whole = run.recorder.trace()
    assert len(seen) > 5
    for part in seen:
        assert part.rows.y.tobytes() == whole.rows.y[: len(part)].tobytes()
    again = CompiledRun(start, None)
    Checkpointer(again, tmp_path / "run.checkpoint", 0.0)
    while again.advance():
        pass
    equal(again.recorder.trace(), whole)
