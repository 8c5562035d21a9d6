"""Of several kinds of models, choose() returns the one that made the records.

The charts of candidates give the force of their definition, and never make energy. The oracle is a
play operator with two thresholds, followed by a dead zone, written by hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import pytest

from gms_fsm import ChartModel, GMSError, ParameterError, Prescribed, Record, choose, simulate
from gms_fsm.identification.candidates import (
    BEHIND_BACKLASH,
    STIFFER_ONE_WAY,
    Candidate,
    FitStart,
    behind_backlash,
    gms,
    stiffer_one_way,
)
from gms_fsm.identification.folds import period_of
from gms_fsm.systems.models import Model
from tests.helpers import FASTEST
from tests.identification.records import FREE, bank, noise, rubbed

TURNS = np.array([0.0, 1.0, -1.0, 0.4, -0.3, 0.8, -1.2, 1.2, -1.2])


def play(x: np.ndarray, forward: float, backward: float) -> np.ndarray:
    """z <- min(forward, max(-backward, z + dx))."""
    z, found = 0.0, [0.0]
    for step in np.diff(x):
        z = min(forward, max(-backward, z + step))
        found.append(z)
    return np.array(found)


def forces(model: ChartModel, turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions at 50 times a stroke, at constant speeds between turns, and the forces."""
    speeds = np.diff(turns)
    t = np.linspace(0.0, speeds.size, 50 * speeds.size + 1)
    steps = [(i + end, float(v)) for i, v in enumerate(speeds) for end in (0.0, 1.0 - 1e-9)]
    corners = [(0.0, float(speeds[0])), *steps[1:-1], (float(speeds.size), float(speeds[-1]))]
    run = simulate(model, Prescribed(corners), float(t[-1]), t_eval=t, engine="ifelse", rtol=1e-10)
    return np.interp(t, np.arange(turns.size), turns), run.F


def backlash(**given: float) -> ChartModel:
    values = {"k": 3.0, "b": 1.0, "g": 0.2, "r": 0.3, "ratio": 1.5, "rho": 0.0, "v_s": 1.0}
    return ChartModel(BEHIND_BACKLASH, values | given)


@pytest.mark.parametrize(("ratio", "b"), [(0.5, -2.0), (1.0, 0.0), (1.5, 1.0)])
def test_behind_backlash_is_a_dead_zone_behind_two_thresholds(ratio: float, b: float) -> None:
    x, found = forces(backlash(ratio=ratio, b=b), TURNS)
    z = play(x, 0.2 + 0.3, 0.2 + ratio * 0.3)
    stretch = np.sign(z) * np.maximum(np.abs(z) - 0.2, 0.0)
    np.testing.assert_allclose(found, 3.0 * stretch + b * np.abs(stretch), atol=1e-6)
    assert (forces(backlash(), np.array([0.0, 0.19, -0.19, 0.1]))[1] == 0.0).all()  # in the gap


@pytest.mark.parametrize(("sign", "speed"), [(1.0, 0.1), (-1.0, 1.0), (1.0, 5.0)])
def test_thresholds_rise_at_rest_by_rho(sign: float, speed: float) -> None:
    run = simulate(backlash(rho=0.4), Prescribed(str(sign * speed)), 2.0 / speed, engine="ifelse")
    threshold = 0.3 * (1.0 if sign > 0 else 1.5) * (1.0 + 0.4 * np.exp(-(speed**2)))
    assert run.F[-1] == pytest.approx(sign * (3.0 + sign) * threshold, rel=1e-12)


def test_stiffer_one_way_is_a_bent_spring_behind_a_threshold() -> None:
    x, found = forces(ChartModel(STIFFER_ONE_WAY, {"k": 3.0, "b": -1.0, "z_c": 0.4}), TURNS)
    z = play(x, 0.4, 0.4)
    np.testing.assert_allclose(found, 3.0 * z - np.abs(z), atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_a_closed_cycle_never_gives_energy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    k, g, r, ratio = rng.uniform(0.1, 1.0, 4).tolist()
    model = backlash(k=k, b=rng.uniform(-1, 1) * k, g=g, r=r, ratio=ratio)
    x, found = forces(
        model, np.concatenate([[0.0], np.tile(rng.uniform(0.2, 3.0, 2) * [1, -1], 3)])
    )
    last = slice(-101, None)  # the two strokes of a settled cycle
    assert x[-1] == pytest.approx(x[-101])
    assert np.trapezoid(found[last], x[last]) >= -1e-3 * np.abs(found).max()


# --------------------------------------------------------------------------- the choice
PERIOD, NOISE = 2.0, 0.01


def made(model: Model, cycles: int, size: float = 1e-3, seed: int = 0) -> Record:
    t = np.linspace(0.0, PERIOD * cycles, 40 * cycles + 1)
    v = size * 2.0 * np.pi / PERIOD * np.cos(2.0 * np.pi * t / PERIOD)
    run = simulate(model, Prescribed((t, v)), float(t[-1]), t_eval=t, engine=FASTEST)
    force = run.F + 0.1 + NOISE * noise(seed, t.size)
    return Record.from_arrays(time=t, velocity=v, force=force, name=f"{size:g} m")


@pytest.mark.matrix
@pytest.mark.slow
def test_backlash_is_found_in_the_cycles_left_out() -> None:
    pytest.importorskip("llvmlite", reason="fits take long without machine code")
    truth = backlash(k=5e3, b=1e3, g=1e-4, r=2e-4, ratio=1.3, rho=0.1, v_s=2e-3)
    makers: dict[str, Any] = {"plain": gms, "stiffer": stiffer_one_way, "backlash": behind_backlash}
    kinds = [Candidate(name, "", partial(make, n=1)) for name, make in makers.items()]
    found = choose(made(truth, 5), candidates=kinds, train=(0.0, 6.0), test=(6.0, 10.0))
    assert found.choice is not None
    assert found.choice.chosen == "backlash"
    rows = {row.name: row for row in found.choice.rows}
    assert list(rows) == list(makers)
    assert rows["backlash"].rmse < 1.5 * NOISE
    assert min(rows["plain"].rmse, rows["stiffer"].rmse) > 3.0 * NOISE
    assert rows["backlash"].bic == min(row.bic for row in found.choice.rows)
    assert rows["backlash"].free >= len(found.table)
    assert not found.open  # sigma_2 cannot be told, and is gone
    assert found["g1"].value == pytest.approx(1e-4, rel=0.05)
    assert found["ratio"].value == pytest.approx(1.3, rel=0.05)
    assert found.held_out is not None
    assert found.held_out["rmse"] < 1.2 * NOISE


@pytest.mark.matrix
@pytest.mark.slow
def test_the_simplest_kind_is_found_leaving_records_out() -> None:
    pytest.importorskip("llvmlite", reason="fits take long without machine code")
    plain = bank([5e3], [2e-4], C=[0.5], sigma_2=5.0, v_s=2e-3, v_c=1e-6)
    records = [made(plain, 3, size, seed) for seed, size in enumerate((1e-3, 5e-4, 2e-3))]
    springs = {f"{n}": (gms(records, None, n=n).model, FREE) for n in (2, 1)}
    found = choose(records, candidates=springs)
    assert found.choice is not None
    assert found.choice.chosen == "1"  # two fit as well, with more unknowns


@pytest.mark.matrix
@pytest.mark.slow
def test_a_candidate_that_fails_is_noted_and_an_interrupt_keeps_those_compared() -> None:
    pytest.importorskip("llvmlite", reason="fits take long without machine code")

    def failing(_: Sequence[Record], __: float | None) -> FitStart:
        raise GMSError("it has no spring")

    def interrupted(_: Sequence[Record], __: float | None) -> FitStart:
        raise KeyboardInterrupt

    last = Candidate("never", "", interrupted)
    kinds = [Candidate("bad", "", failing), ("one", bank([2e4], [8e-5]), FREE), last]
    found = choose(rubbed(), candidates=kinds, cycles=2.0)
    assert found.choice is not None
    bad, one = found.choice.rows
    assert (bad.name, bad.note) == ("bad", "it has no spring")
    assert np.isnan(bad.rmse)
    assert (one.name, one.note, found.choice.chosen) == ("one", "", "one")
    assert "interrupted: 2 of 3 candidates" in found.stopped
    with pytest.raises(KeyboardInterrupt):
        choose(rubbed(), candidates=[last], cycles=2.0)
    with pytest.raises(ParameterError, match=r"candidate 'bad': free: there is no parameter"):
        choose(rubbed(), candidates={"bad": (bank([2e4], [8e-5]), ["wieghts"])}, cycles=2.0)


@pytest.mark.parametrize("period", [0.7, 4.0])
def test_the_period_of_a_motion(period: float) -> None:
    t = np.arange(0.0, 20.0 * period, period / 57.0)
    x = np.sin(2 * np.pi * t / period) + 0.3 * np.sin(6 * np.pi * t / period)
    assert period_of(t, x) == pytest.approx(period, rel=0.02)
    assert period_of(t, t) is None
    assert period_of(t, np.zeros(t.size)) is None
