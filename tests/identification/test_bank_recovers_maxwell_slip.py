"""The force of a Maxwell-slip bank gives back its stiffnesses and thresholds, and n elements."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import GMS, Prescribed, Record, initial_bank, simulate
from gms_fsm.identification.bank import stop_operators, thresholds
from gms_fsm.records import tribometer
from tests.helpers import FASTEST
from tests.scenario_files import data_folder

TRAVEL = 2e-3
K, R = [2e4, 1e4, 5e3], [1e-4, 3e-4, 6e-4]


def motion(seed: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """A sine, or strokes between random reversals; both cover the travel."""
    if seed is None:
        t = np.arange(3000) / 100.0
        return t, 0.5 * TRAVEL * np.sin(t)
    turns = np.random.default_rng(seed).uniform(-1.0, 1.0, 40)
    turns[:3] = 1.0, -1.0, 1.0
    t = np.arange(4000) / 100.0
    return t, 0.5 * TRAVEL * np.interp(t, np.arange(40), turns)


def made(k: list[float], r: list[float], offset: float = 0.0, seed: int | None = None) -> Record:
    t, x = motion(seed)
    force = stop_operators(x, r) @ np.array(k) + offset
    return Record.from_arrays(time=t, position=x, force=force)


def of(model: GMS) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffnesses and thresholds."""
    return model.parameters.k, model.weights * model.stribeck.F_c


def test_stop_operators_are_the_definition_step_by_step() -> None:
    _, x = motion(seed=1)
    r = np.array([1e-4, 4e-4])
    z, rows = np.zeros(2), []
    for step in np.diff(x, prepend=x[0]):
        z = np.clip(z + step, -r, r)
        rows.append(z)
    np.testing.assert_array_equal(stop_operators(x, r), rows)


@pytest.mark.parametrize(("places", "seed"), [([20], 3), ([5, 18, 30, 45], None)])
def test_thresholds_on_the_grid_are_exact(places: list[int], seed: int | None) -> None:
    r = thresholds(float(np.ptp(motion(seed)[1])))[places]
    k = 1e4 / np.arange(1.0, len(places) + 1)
    model = initial_bank(made(k.tolist(), r.tolist(), 0.3, seed), len(places), smoothing=0.0)
    np.testing.assert_allclose(of(model)[0], k, rtol=1e-6)
    np.testing.assert_allclose(of(model)[1], r, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_other_thresholds_are_nearly_exact(seed: int) -> None:
    rng = np.random.default_rng(seed)
    r = np.sort(rng.uniform(0.03, 0.9, 3)) * 0.5 * TRAVEL
    record = made((rng.uniform(0.2, 1.0, 3) * 1e4).tolist(), r.tolist(), -0.5, seed)
    k, found = of(initial_bank(record, 3, smoothing=0.0))
    force = record.columns["force"]
    error = stop_operators(record.columns["position"], found) @ k - 0.5 - force
    late = slice(len(force) // 4, None)
    assert 1.0 - error[late].var() / force[late].var() > 0.999, f"seed {seed}"


@pytest.mark.parametrize("n", [1, 7, 60])
def test_there_are_exactly_n_elements_which_keep_the_sums(n: int) -> None:
    model = initial_bank(made(K, R), n, smoothing=0.0)
    k, r = of(model)
    assert (model.n, r.size, k.size) == (n, n, n)
    assert (np.diff(r) >= 0.0).all()
    assert model.stribeck.F_c == pytest.approx(k @ r, rel=1e-12)
    # Al-Bender: C_i = alpha_i C / k_i with alpha_i = k_i r_i / F_c.
    np.testing.assert_allclose(model.parameters.C / r, model.parameters.C[0] / r[0], rtol=1e-9)
    if n > 1:
        assert k.sum() == pytest.approx(3.5e4, rel=1e-6)
        assert model.stribeck.F_c == pytest.approx(2.0 + 3.0 + 3.0, rel=1e-6)


def _begun_before() -> Record:
    t, x = motion()
    force = stop_operators(np.r_[-0.5 * TRAVEL, x], R[::2])[1:] @ np.array(K[:2])
    return Record.from_arrays(time=t, position=x, force=force)


def _fine() -> Record:
    t = np.arange(30_000) / 1000.0
    x = 0.5 * TRAVEL * np.sin(t)
    return Record.from_arrays(time=t, position=x, force=stop_operators(x, R[::2]) @ K[:2])


RECORDS = {
    "several": lambda: [made(K[:2], R[::2], 0.2, seed) for seed in (None, 4)],
    "many rows, which are thinned": _fine,
    "an unknown state at the start": _begun_before,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", RECORDS)
def test_other_records_of_it_give_the_same_bank(name: str) -> None:
    k, r = of(initial_bank(RECORDS[name](), 2, smoothing=0.0))
    np.testing.assert_allclose(k, K[:2], rtol=1e-3)
    np.testing.assert_allclose(r, R[::2], rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("length", "load"), [(2.0**-40, 2.0**60), (2.0**30, 2.0**-40)])
def test_other_units_give_the_same_bank(length: float, load: float) -> None:
    record = made(K, R, 0.1, seed=2)
    t, x, force = (record.columns[each] for each in ("time", "position", "force"))
    other = Record.from_arrays(time=t, position=length * x, force=load * force)
    one, two = (initial_bank(each, 5).parameters for each in (record, other))
    np.testing.assert_allclose(two.k, load / length * one.k, rtol=1e-6)
    np.testing.assert_allclose(two.weights, length / load * one.weights, rtol=1e-6)


def test_forces_outside_the_training_rows_are_not_read() -> None:
    record = made(K[:2], R[:2])
    t, force = record.columns["time"], record.columns["force"]
    spoilt = np.where((t >= 5.0) & (t < 20.0), force, 7.0)
    other = Record.from_arrays(time=t, position=record.columns["position"], force=spoilt)
    one, two = (initial_bank(each, 2, train=(5.0, 20.0)) for each in (record, other))
    np.testing.assert_array_equal(of(one), of(two))


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 15])
def test_a_bank_of_the_tribometer_explains_its_training_rows(n: int) -> None:
    """Run as it is, at least 99.5 % of them."""
    record = tribometer(data_folder())
    motion = record.motion()
    rows = motion.time < 100.0
    t = motion.time[rows]
    model = initial_bank(record, n, train=(20.0, 100.0))
    rig = Prescribed((motion.time, motion.velocity))
    run = simulate(model, rig, 100.0, t_start=float(t[0]), t_eval=t, engine=FASTEST)
    measured = record.columns["force"][rows]
    error = (measured - np.interp(t, run.t, run.F))[t >= 20.0]
    assert 1.0 - np.var(error) / np.var(measured[t >= 20.0]) >= 0.995  # with an offset
