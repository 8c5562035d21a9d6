"""Of several kinds of models, choose() returns the one that made the records."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    ChartModel,
    Fit,
    GMSParameters,
    Prescribed,
    Record,
    Stribeck,
    choose,
    simulate,
)
from gms_fsm.identification.candidates import (
    BEHIND_BACKLASH,
    Candidate,
    behind_backlash,
    gms,
    stiffer_one_way,
)
from gms_fsm.identification.choose import period_of
from gms_fsm.systems.models import Model
from tests.helpers import FASTEST

pytest.importorskip("llvmlite", reason="fits take long without machine code")

PERIOD, CYCLES, NOISE = 2.0, 6, 0.01
KINDS = [
    Candidate("plain", "", partial(gms, n=1)),
    Candidate("stiffer", "", partial(stiffer_one_way, n=1)),
    Candidate("backlash", "", partial(behind_backlash, n=1)),
]
PLAIN = GMS(
    GMSParameters(
        k=[5e3], sigma=[0.0], C=[0.5], sigma_2=5.0, weights=[2e-4], v_c=1e-6,
        stribeck=Stribeck(1.0, 1.2, 2e-3),
    ),
    law="signed",
)  # fmt: skip
BACKLASH = ChartModel(
    BEHIND_BACKLASH,
    {"k": 5e3, "b": 1e3, "g": 1e-4, "r": 2e-4, "ratio": 1.3, "rho": 0.1, "v_s": 2e-3},
)


def made(model: Model, size: float = 1e-3, seed: int = 0) -> Record:
    t = np.linspace(0.0, PERIOD * CYCLES, 60 * CYCLES + 1)
    v = size * 2.0 * np.pi / PERIOD * np.cos(2.0 * np.pi * t / PERIOD)
    run = simulate(model, Prescribed((t, v)), float(t[-1]), t_eval=t, engine=FASTEST)
    noise = NOISE * np.random.default_rng(seed).standard_normal(t.size)
    return Record.from_arrays(time=t, velocity=v, force=run.F + 0.1 + noise, name=f"{size:g} m")


@pytest.fixture(scope="module")
def found() -> Fit:
    return choose(made(BACKLASH), candidates=KINDS, train=(0.0, 10.0), test=(10.0, 20.0))


def test_backlash_is_found_in_the_cycles_left_out(found: Fit) -> None:
    assert found.choice is not None
    assert found.choice.chosen == "backlash"
    rows = {row.name: row for row in found.choice.rows}
    assert list(rows) == ["plain", "stiffer", "backlash"]
    assert rows["backlash"].rmse < 1.5 * NOISE
    assert min(rows["plain"].rmse, rows["stiffer"].rmse) > 3.0 * NOISE
    assert rows["backlash"].bic == min(row.bic for row in found.choice.rows)
    assert rows["backlash"].free == len(found.table)
    assert found["g1"].value == pytest.approx(1e-4, rel=0.05)
    assert found["ratio"].value == pytest.approx(1.3, rel=0.05)
    assert found.held_out is not None
    assert found.held_out["rmse"] < 1.2 * NOISE


def test_the_simplest_kind_is_found_leaving_records_out() -> None:
    records = [made(PLAIN, size, seed) for seed, size in enumerate((1e-3, 5e-4, 2e-3))]
    springs = {f"{n}": (gms(records, None, n=n).model, ["k", "weights"]) for n in (2, 1)}
    found = choose(records, candidates=springs)
    assert found.choice is not None
    assert found.choice.chosen == "1"  # two fit as well, with more unknowns


@pytest.mark.parametrize("period", [0.7, 4.0])
def test_the_period_of_a_motion(period: float) -> None:
    t = np.arange(0.0, 20.0 * period, period / 57.0)
    x = np.sin(2 * np.pi * t / period) + 0.3 * np.sin(6 * np.pi * t / period)
    assert period_of(t, x) == pytest.approx(period, rel=0.02)
    assert period_of(t, t) is None
    assert period_of(t, np.zeros(t.size)) is None
