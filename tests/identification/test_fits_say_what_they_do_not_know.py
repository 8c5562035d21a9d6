"""A fit names what the record does not determine, and the direction in which it is blind."""

from __future__ import annotations

import functools
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Fit, Record, State
from gms_fsm.errors import GMSError
from gms_fsm.identification.certainty.assess import _searched_slopes
from tests.identification.records import bank, fitted, measured, plain, sine

pytest.importorskip("llvmlite", reason="fits take long without machine code")

pytestmark = pytest.mark.slow


@functools.cache
def never_slipping() -> Fit:
    record = measured(bank([2e4, 5e3], [5e-5, 1e-2]), sine(2e-4, 2.0, 4.0), seed=1)
    return fitted(record, bank([1e4, 1e4], [4e-5, 2e-2]))


def test_an_element_that_never_slips_shows_its_stiffness_only() -> None:
    found = never_slipping()
    assert found.never_slipped == (2,)
    assert found.open == ("weights2",)
    assert found["weights2"].note == "cannot be told: no influence on this record"
    assert found["k2"].low < 5e3 < found["k2"].high
    assert "weights2 cannot be told" in found.weakest
    assert any("without influence" in note for note in found.notes)
    profile = found.profile("weights2", restarts=False)
    assert profile.open
    assert str(profile).startswith("weights2: 95 % interval any above ")


@pytest.mark.parametrize("rows", [(0.0, 8.0), (3.0, 6.0)])
def test_slip_before_the_training_rows_does_not_count(rows: tuple[float, float]) -> None:
    """One wide stroke, then narrow ones, in which the second element sticks."""
    truth = bank([2e4, 5e3], [5e-5, 3e-4])
    t = np.arange(800) * 0.01
    x = np.where(t < 2.0, 1e-3, 1.5e-4) * np.sin(np.pi * t)
    record = measured(truth, Record.from_arrays(time=t, position=x), seed=1)
    found = fitted(record, truth, ("k",), train=rows, begin="relaxed")
    assert found.never_slipped == (() if rows[0] == 0.0 else (2,))


def test_a_product_is_told_and_its_factors_are_not() -> None:
    """Thresholds are weights times the curve: its scale and that of the weights are one number."""
    record = measured(bank([2e4], [5e-5]), sine(2e-4, 2.0, 4.0), seed=2)
    found = fitted(record, bank([1e4], [4e-5]), ("k", "weights", "F_c", "F_s"))
    assert {"weights1", "F_c"} <= {*found.open}
    assert found["k1"].told
    direction = found.weakest.split("The weakest direction:")[1]
    assert "weights1" in direction
    assert "F_c" in direction


def test_what_is_told_is_said_and_profile_and_bootstrap_agree_with_it() -> None:
    found = plain()
    assert found.open == ()
    assert found.weakest.startswith("All parameters are determined.")
    assert found["k1"].low < 2e4 < found["k1"].high
    assert found.effective_rows == pytest.approx(found.training["rows"], rel=0.3)  # white noise
    half = 0.5 * (found["k1"].high - found["k1"].low)
    profile = found.profile("k1", restarts=False)
    assert profile.low < found["k1"].value < profile.high
    assert 0.5 * (profile.high - profile.low) == pytest.approx(half, rel=0.4)
    assert profile.rise.min() == 0.0
    drawn = found.bootstrap(draws=12, restarts=False, seed=1)
    low, high = drawn.interval("k1", 0.68)
    assert 0.5 * (high - low) == pytest.approx(half / 1.96, rel=0.6)
    assert drawn.draws.shape == (12, len(found.table))


def test_profiles_stay_within_bounds() -> None:
    record = measured(bank([2e4], [5e-5]), sine(2e-4, 2.0, 3.0))
    found = fitted(record, bank([3e4], [5e-5]), ["k"], bounds={"k": (1.9998e4, 1e5)})
    assert 1.9998e4 < found["k1"].value < 2.001e4  # and the interval would begin at 1.9992e4
    profile = found.profile("k1", restarts=False)
    assert profile.low == profile.values.min() == 1.9998e4
    assert profile.rise.min() == 0.0


@pytest.mark.matrix
def test_a_parameter_of_either_sign_has_a_profile() -> None:
    on = State("on", flow={"z": "v"}, outputs={"F": "k * z + b * v"})
    model = ChartModel(Chart("spring", ("v",), ("z",), ("k", "b"), (on,)), {"k": -1e4, "b": 0.0})
    found = fitted(measured(model, sine(2e-4, 2.0, 3.0)), model, ["k", "b"])
    assert found.never_slipped == ()
    for name in ("k", "b"):
        profile = found.profile(name, restarts=False)
        assert found[name].low < found[name].value < found[name].high
        assert profile.low == pytest.approx(found[name].low, rel=0.1, abs=0.2)
        assert profile.high == pytest.approx(found[name].high, rel=0.1, abs=0.2)


@pytest.mark.matrix
def test_of_a_product_alone_nothing_is_told() -> None:
    on = State("on", flow={"z": "v"}, outputs={"F": "k * b * z"})
    model = ChartModel(Chart("spring", ("v",), ("z",), ("k", "b"), (on,)), {"k": 100.0, "b": 100.0})
    found = fitted(measured(model, sine(2e-4, 2.0, 3.0)), model, ["k", "b"], nuisance=())
    assert found.open == ("k", "b")
    assert found.weakest.startswith("No parameter is determined by this record.")


def test_a_slope_is_taken_on_the_side_that_runs() -> None:
    found = plain()

    def slopes(lost: int, step: float = 1e-4) -> Any:
        gone = GMSError("lost")

        def run(call: Any, given: Any) -> Any:
            sides = enumerate(given, 1)
            return [[gone] * len(part) if side == lost else call(part) for side, part in sides]

        steps = np.full(found.point.u.size, step)
        pool: Any = SimpleNamespace(workers=2, map=run)
        return _searched_slopes(found.task.fine, found.point, steps, pool)

    both = slopes(0)
    for lost in (1, 2):
        assert np.linalg.norm(slopes(lost) - both) < 1e-3 * np.linalg.norm(both)
    assert not slopes(0, 1e3).any(), "no side runs, so nothing is known"


@pytest.mark.matrix
def test_the_stribeck_exponent_is_searched_across_two() -> None:
    """An exponent of 2 gives another text of the curve, and so another program."""
    record = measured(bank([2e4], [5e-5], F_s=1.5), sine(4e-4, 2.0, 4.0), 0.005, 4)
    start = bank([1.5e4], [5e-5], F_s=1.5)
    found = fitted(record, start, ("k", "delta"), bounds={"delta": (0.5, 5.0)})
    assert found["delta"].low < 2.0 < found["delta"].high
    assert found["k1"].low < 2e4 < found["k1"].high


@pytest.mark.parametrize("start", [8e-5, 2.3e-4])
def test_a_search_that_ends_at_the_edge_of_slipping_is_not_sure(start: float) -> None:
    """The element never slips; any threshold beyond the stroke fits as well, from any start."""
    truth = bank([2e4, 5e3], [5e-5, 2e-4], F_s=1.001)
    record = measured(truth, sine(1.6e-4, 2.0, 4.0), seed=2)
    found = fitted(record, bank([2e4, 5e3], [5e-5, start], F_s=1.001))
    assert not found["weights2"].told
    assert found["weights1"].told
