"""A sweep on a Dask cluster of processes survives a killed worker: every result arrives once."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gms_fsm import sweep
from gms_fsm.sweep import _Collected
from tests.helpers import pulled_mass

distributed = pytest.importorskip("distributed", reason="needs the extra cluster")

RUNS = 192


def sets() -> dict[str, Any]:
    k = pulled_mass()[0].values["k"] * np.random.default_rng(5).uniform(0.8, 1.2, (RUNS, 4))
    return {"k": k, "weights": 1 / (4 * k)}


@pytest.fixture
def cluster() -> Iterator[Any]:
    """Two worker processes of one thread each."""
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
        silence_logs=logging.CRITICAL,
    ) as made:  # fmt: skip
        yield made


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_killed_worker_costs_no_result(cluster: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    model, rig = pulled_mass()
    arrived: list[int] = []
    killed: list[int] = []
    take = _Collected.take

    def taken(self: _Collected, chunk: range, results: Any) -> None:
        arrived.extend(chunk)
        take(self, chunk, results)
        if not killed and len(arrived) >= RUNS // 4:  # in mid-run
            killed.append(cluster.workers[0].process.pid)
            os.kill(killed[0], signal.SIGKILL)

    monkeypatch.setattr(_Collected, "take", taken)
    with distributed.Client(cluster) as client:
        workers = set(client.run(os.getpid).values())
        assert len(workers) == 2
        assert os.getpid() not in workers
        far = sweep(model, rig, 12.0, sets(), executor=client.get_executor(), engine="machines")
        assert killed[0] in workers
        assert killed[0] not in client.run(os.getpid).values()
    assert len(arrived) < 2 * RUNS
    assert sorted(arrived) == list(range(RUNS))  # every result, exactly once
    monkeypatch.undo()
    here = sweep(model, rig, 12.0, sets(), engine="machines")
    assert set(far.outcome) == {"ok"}
    for name in ("t", "x", "v", "F", "z", "states"):
        np.testing.assert_array_equal(getattr(far, name), getattr(here, name))
    assert far.transitions.tolist() == here.transitions.tolist()
