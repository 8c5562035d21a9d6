"""The force of a Maxwell-slip bank gives back its stiffnesses and thresholds, and n elements."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import GMS, Record, initial_bank
from gms_fsm.identification.bank import stop_operators, thresholds

RATE, TRAVEL = 100.0, 2e-3


def motion(seed: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """A sine, or strokes between random reversals; both cover the travel."""
    if seed is None:
        t = np.arange(3000) / RATE
        return t, 0.5 * TRAVEL * np.sin(t)
    turns = np.random.default_rng(seed).uniform(-1.0, 1.0, 40)
    turns[:3] = 1.0, -1.0, 1.0
    t = np.arange(4000) / RATE
    return t, 0.5 * TRAVEL * np.interp(t, np.arange(40), turns)


def made(
    k: list[float], r: list[float], offset: float = 0.0, seed: int | None = None
) -> tuple[Record, np.ndarray]:
    t, x = motion(seed)
    force = stop_operators(x, r) @ np.array(k) + offset
    return Record.from_arrays(time=t, position=x, force=force), force


def forces(model: GMS, record: Record) -> np.ndarray:
    r = model.weights * model.stribeck.F_c
    return stop_operators(record.columns["position"], r) @ model.parameters.k


def test_stop_operators_are_the_definition_step_by_step() -> None:
    _, x = motion(seed=1)
    r = np.array([1e-4, 4e-4])
    z, rows = np.zeros(2), []
    for step in np.diff(x, prepend=x[0]):
        z = np.clip(z + step, -r, r)
        rows.append(z)
    np.testing.assert_array_equal(stop_operators(x, r), rows)


@pytest.mark.parametrize("seed", [None, 3])
@pytest.mark.parametrize("places", [[20], [12, 40], [5, 18, 30, 45]])
def test_thresholds_on_the_grid_are_exact(places: list[int], seed: int | None) -> None:
    x = motion(seed)[1]
    r = thresholds(float(np.ptp(x)))[places]
    k = 1e4 / np.arange(1.0, len(places) + 1)
    record, force = made(k.tolist(), r.tolist(), 0.3, seed)
    model = initial_bank(record, len(places), smoothing=0.0)
    np.testing.assert_allclose(model.parameters.k, k, rtol=1e-6)
    np.testing.assert_allclose(model.weights * model.stribeck.F_c, r, rtol=1e-6)
    np.testing.assert_allclose(forces(model, record) + 0.3, force, atol=1e-6 * np.ptp(force))


@pytest.mark.parametrize("seed", range(4))
def test_other_thresholds_are_nearly_exact(seed: int) -> None:
    rng = np.random.default_rng(seed)
    r = np.sort(rng.uniform(0.03, 0.9, 3)) * 0.5 * TRAVEL
    k = rng.uniform(0.2, 1.0, 3) * 1e4
    record, force = made(k.tolist(), r.tolist(), -0.5, seed)
    late = slice(len(force) // 4, None)
    error = (forces(initial_bank(record, 3, smoothing=0.0), record) - 0.5 - force)[late]
    r2 = 1.0 - error.var() / force[late].var()
    assert r2 > 0.999, f"seed {seed}: thresholds {r.tolist()}, stiffnesses {k.tolist()}: R2 {r2}"


@pytest.mark.parametrize("n", [1, 7, 60])
def test_there_are_exactly_n_elements(n: int) -> None:
    record, _ = made([2e4, 1e4, 5e3], [1e-4, 3e-4, 6e-4])
    model = initial_bank(record, n, smoothing=0.0)
    r, k = model.weights * model.stribeck.F_c, model.parameters.k
    assert (model.n, r.size, k.size) == (n, n, n)
    assert (np.diff(r) >= 0.0).all()
    assert model.stribeck.F_c == pytest.approx(k @ r, rel=1e-12)
    # Al-Bender: C_i = alpha_i C / k_i with alpha_i = k_i r_i / F_c.
    np.testing.assert_allclose(model.parameters.C / r, model.parameters.C[0] / r[0], rtol=1e-9)


@pytest.mark.parametrize("n", [3, 60])
def test_halves_of_elements_keep_the_sums(n: int) -> None:
    record, _ = made([2e4, 1e4, 5e3], [1e-4, 3e-4, 6e-4])
    model = initial_bank(record, n, smoothing=0.0)
    assert model.parameters.k.sum() == pytest.approx(3.5e4, rel=1e-6)
    assert model.stribeck.F_c == pytest.approx(2.0 + 3.0 + 3.0, rel=1e-6)


def test_several_records_make_one_bank() -> None:
    parts = [made([2e4, 1e4], [1e-4, 6e-4], 0.2, seed)[0] for seed in (None, 4)]
    model = initial_bank(parts, 2, smoothing=0.0)
    np.testing.assert_allclose(model.parameters.k, [2e4, 1e4], rtol=1e-3)
    np.testing.assert_allclose(model.weights * model.stribeck.F_c, [1e-4, 6e-4], rtol=1e-3)


def test_many_rows_give_the_bank_of_few() -> None:
    """Rows are thinned, and the reversals stay."""
    t = np.arange(30_000) / 1000.0
    x = 0.5 * TRAVEL * np.sin(t)
    force = stop_operators(x, [1e-4, 3e-4]) @ np.array([2e4, 1e4])
    model = initial_bank(Record.from_arrays(time=t, position=x, force=force), 2, smoothing=0.0)
    np.testing.assert_allclose(model.parameters.k, [2e4, 1e4], rtol=1e-4)
    np.testing.assert_allclose(model.weights * model.stribeck.F_c, [1e-4, 3e-4], rtol=1e-4)


@pytest.mark.parametrize(("length", "load"), [(2.0**-40, 2.0**60), (2.0**30, 2.0**-40)])
def test_other_units_give_the_same_bank(length: float, load: float) -> None:
    record, force = made([2e4, 1e4, 3e3], [1e-4, 3e-4, 7e-4], 0.1, seed=2)
    t, x = record.columns["time"], record.columns["position"]
    other = Record.from_arrays(time=t, position=length * x, force=load * force)
    for n in (2, 5):
        one, two = (initial_bank(each, n).parameters for each in (record, other))
        np.testing.assert_allclose(two.k, load / length * one.k, rtol=1e-6)
        np.testing.assert_allclose(two.weights, length / load * one.weights, rtol=1e-6)


def test_an_unknown_state_at_the_start_does_no_harm() -> None:
    t, x = motion()
    force = stop_operators(np.r_[-0.5 * TRAVEL, x], [1e-4, 8e-4])[1:] @ np.array([2e4, 1e4])
    model = initial_bank(Record.from_arrays(time=t, position=x, force=force), 2, smoothing=0.0)
    np.testing.assert_allclose(model.parameters.k, [2e4, 1e4], rtol=1e-6)


def test_forces_outside_the_training_rows_are_not_read() -> None:
    record, force = made([2e4, 1e4], [1e-4, 3e-4])
    t = record.columns["time"]
    spoilt = np.where((t >= 5.0) & (t < 20.0), force, 7.0)
    other = Record.from_arrays(time=t, position=record.columns["position"], force=spoilt)
    one, two = (initial_bank(each, 2, train=(5.0, 20.0)) for each in (record, other))
    np.testing.assert_array_equal(one.parameters.k, two.parameters.k)
    np.testing.assert_array_equal(one.weights, two.weights)


def test_the_law_and_the_arrest_velocity_are_those_given() -> None:
    record, _ = made([2e4], [1e-4])
    model = initial_bank(record, 1, law="published", v_c=3e-6)
    assert (model.law, model.parameters.v_c) == ("published", 3e-6)
