"""A sweep on a Dask cluster of processes survives a killed worker: every result arrives once.

A run that kills its worker each time gives a row that says so, and so does one that cannot be sent.
"""

from __future__ import annotations

import logging
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, sweep
from gms_fsm.run.repeated.collected import Collected
from tests.helpers import needs, pulled_mass, stick_slip

pytestmark = pytest.mark.slow

needs("dask", "distributed", reason="needs the extra cluster")

RUNS = 64


def sets(runs: int = RUNS) -> dict[str, Any]:
    k = pulled_mass()[0].values["k"] * np.random.default_rng(5).uniform(0.8, 1.2, (runs, 4))
    return {"k": k, "weights": 1 / (4 * k)}


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Two worker processes of one thread each, which are started again when they are killed."""
    import dask
    import distributed

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            dashboard_address=":0",
            silence_logs=logging.CRITICAL,
        ) as made,
    ):
        yield made


def client_of(cluster: Any) -> Any:
    from distributed import Client

    return Client(cluster)


quiet = pytest.mark.filterwarnings(
    "ignore::DeprecationWarning",
    "ignore::ResourceWarning",
    "ignore::pytest.PytestUnraisableExceptionWarning",
)


@pytest.mark.matrix
@quiet
def test_a_killed_worker_costs_no_result(cluster: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    model, rig = pulled_mass()
    arrived: list[int] = []
    killed: list[int] = []
    take = Collected.take

    def taken(self: Collected, chunk: range, results: Any) -> None:
        arrived.extend(chunk)
        take(self, chunk, results)
        if not killed and len(arrived) >= RUNS // 4:  # part of the way through
            killed.append(cluster.workers[0].process.pid)
            os.kill(killed[0], signal.SIGKILL)

    monkeypatch.setattr(Collected, "take", taken)
    with client_of(cluster) as client:
        workers = set(client.run(os.getpid).values())
        assert len(workers) == 2
        assert os.getpid() not in workers
        far = sweep(model, rig, 6.0, sets(), executor=client.get_executor(), engine="ifelse")
        assert killed[0] in workers
        assert killed[0] not in client.run(os.getpid).values()
    assert len(arrived) < 2 * RUNS
    assert sorted(arrived) == list(range(RUNS))  # every result, exactly once
    monkeypatch.undo()
    here = sweep(model, rig, 6.0, sets(), engine="ifelse")
    assert set(far.outcome) == {"ok"}
    for name in ("t", "x", "v", "F", "z", "states"):
        np.testing.assert_array_equal(getattr(far, name), getattr(here, name))
    assert far.transitions.tolist() == here.transitions.tolist()


class Deadly(Executor):
    """Replaces the third task by one that ends its worker."""

    def __init__(self, cluster: Executor) -> None:
        self.cluster, self.count = cluster, 0

    def submit(self, function: Callable[..., Any], /, *a: Any, **b: Any) -> Future[Any]:
        self.count += 1
        if self.count == 3:
            return self.cluster.submit(os._exit, 3)
        return self.cluster.submit(function, *a, **b)


@pytest.mark.matrix
@quiet
def test_a_run_that_kills_every_worker_is_a_row_that_says_so(cluster: Any) -> None:
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    model, rig = pulled_mass()
    here = sweep(model, rig, 6.0, sets(8), engine="ifelse")
    with client_of(cluster) as client:
        executor = client.get_executor()
        far = sweep(model, rig, 6.0, sets(8), executor=Deadly(executor))
        again = sweep(model, rig, 6.0, sets(8), executor=executor)
    lost = far.outcome != "ok"
    assert lost[2]
    assert lost.sum() < 4, "pending runs next to it may be lost with it, but no more"
    assert set(far.outcome[lost]) == {"KilledWorker"}
    assert all("the worker failed" in text for text in far.message[lost])
    assert np.isnan(far.F[lost]).all()
    np.testing.assert_array_equal(far.F[~lost], here.F[~lost])
    assert set(again.outcome) == {"ok"}
    np.testing.assert_array_equal(again.F, here.F)  # compiled over there, not here
    assert again.transitions.tolist() == here.transitions.tolist()


@pytest.mark.matrix
@quiet
def test_a_signal_that_cannot_be_sent_is_a_row_that_says_so(cluster: Any) -> None:
    lock = threading.Lock()

    def velocity(t: float) -> float:
        with lock:
            return 0.1 * t

    model, values = stick_slip("signed"), {"F_s": np.linspace(1.5, 1.9, 130)}
    with client_of(cluster) as client:
        executor = client.get_executor()
        lost = sweep(model, Prescribed(velocity), 3.0, values, executor=executor, engine="ifelse")
        found = sweep(model, Prescribed("0.1*t"), 3.0, values, executor=executor, engine="ifelse")
    assert set(lost.outcome) == {"NotSent"}
    assert len(lost) == 130
    assert np.isnan(lost.F).all()
    for text in set(lost.message):
        assert text.startswith("the run could not be sent to a worker (TypeError: ")
        assert text.endswith(
            "give signals as expressions in t or as arrays, or use threads (executor=None)"
        )
    assert set(found.outcome) == {"ok"}, "the cluster is not affected"
