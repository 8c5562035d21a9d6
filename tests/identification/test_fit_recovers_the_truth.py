"""A fit finds the numbers that made a record, from a start that knows nothing of them."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Fit, Record, excite, fit, initial_bank
from gms_fsm.systems.models import with_values
from tests.identification.fits_made import small
from tests.identification.records import bank, measured

pytest.importorskip("llvmlite", reason="fits take long without machine code")

K, W = [2.5e4, 6e3], [2e-5, 9e-5]
FREE = ("k", "weights", "C", "F_s", "v_s", "sigma_2")
TRUE = {"k1": K[0], "k2": K[1], "weights1": W[0], "weights2": W[1], "C": 5e-4}
TRUE |= {"F_s": 1.2, "v_s": 2e-4, "sigma_2": 80.0, "offset": 0.0}


def _record(seed: int) -> Record:
    motion = excite(3e-4, [1e-4, 5e-4, 2e-3], rate=100.0)
    return measured(bank(K, W, sigma_2=80.0), motion, 0.02, seed)


def _start(record: Record) -> object:
    found = initial_bank(record, 2)
    weights = found.weights * found.stribeck.F_c
    return with_values(found, {"weights": weights, "F_c": 1.0, "F_s": 1.05, "v_c": 5e-6})


def _fit(seed: int, **options: object) -> Fit:
    record = _record(seed)
    return fit(record, _start(record), free=FREE, tied=("C",), **options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_truth_is_within_three_standard_deviations() -> None:
    found = _fit(seed=3)
    assert found.training["rmse"] == pytest.approx(0.02, rel=0.03)
    for each in found.table:
        assert each.told, each
        half = 0.5 * (each.high - each.low)
        assert abs(each.value - TRUE[each.name]) < 1.6 * half, each  # 3 of 1.96
    assert not found.open
    assert found.weakest.startswith("All parameters are determined.")


@pytest.mark.slow
def test_equal_arguments_give_equal_results() -> None:
    one, two = small(), small.__wrapped__()
    assert [each.value for each in one.table] == [each.value for each in two.table]
    assert np.array_equal(one.covariance, two.covariance)
    assert one.runs == two.runs


def test_force_without_noise_is_reproduced() -> None:
    truth = bank(K, W, sigma_2=80.0)
    record = measured(truth, excite(3e-4, [1e-4, 1e-3], rate=50.0), 0.0, 0)
    start = with_values(truth, {"k": [1e4, 1e4], "sigma_2": 0.0})
    found = fit(record, start, free=("k", "sigma_2"), search="local")
    assert [found[name].value for name in ("k1", "k2")] == pytest.approx(K, rel=1e-5)
    assert found["sigma_2"].value == pytest.approx(80.0, rel=1e-4)
    assert found.predict(record) == pytest.approx(record.columns["force"], abs=1e-4)
    assert found.score(record)["r2"] > 1.0 - 1e-8
