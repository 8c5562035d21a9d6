"""Synthetic records whose truth is known, and one fit of them that answers many questions."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from scipy.signal import lfilter

from gms_fsm import GMS, Fit, GMSParameters, Prescribed, Record, Stribeck, fit, simulate
from gms_fsm.systems.models import Model
from tests.helpers import FASTEST


def noise(seed: int, rows: int, correlation: float = 0.0) -> Any:
    """Return noise of unit variance; with a correlation from row to row, that of AR(1)."""
    white = np.random.default_rng(seed).standard_normal(rows)
    if not correlation:
        return white
    return lfilter([np.sqrt(1.0 - correlation**2)], [1.0, -correlation], white)


def bank(k: Any, weights: Any, **given: Any) -> GMS:
    """Return a GMS bank under the signed law with thresholds ``weights`` at F_c = 1 N."""
    n = len(k)
    numbers: dict[str, Any] = {"C": np.full(n, 5e-4), "sigma_2": 0.0, "v_c": 5e-6}
    curve = Stribeck(1.0, given.pop("F_s", 1.2), given.pop("v_s", 2e-4))
    return GMS(
        GMSParameters(k, np.zeros(n), weights=weights, stribeck=curve, **(numbers | given)),
        law="signed",
    )


def measured(model: Model, motion: Record, sd: float = 0.01, seed: int = 0) -> Record:
    """Return the record of a model moved like another record, with noise in its force."""
    t, v = motion.columns["time"], motion.motion().velocity
    options = {"t_start": float(t[0]), "t_eval": t, "rtol": 1e-9, "engine": FASTEST}
    run = simulate(model, Prescribed((t, v)), float(t[-1]), **options)
    return Record.from_arrays(
        time=t, velocity=v, force=run.F + sd * noise(seed, t.size), name="synthetic"
    )


def sine(amplitude: float, period: float, cycles: float, rate: float = 200.0) -> Record:
    """Return a motion that begins at rest in the middle: a sine with a growing start."""
    t = np.arange(round(cycles * period * rate) + 1) / rate
    w = 2.0 * np.pi / period
    grow = np.minimum(t / period, 1.0)
    x = amplitude * grow * np.sin(w * t)
    return Record.from_arrays(time=t, position=x, velocity=np.gradient(x, t), name="sine")


TRUTH, START = bank([2e4, 5e3], [5e-5, 1e-4]), bank([1e4, 1e4], [4e-5, 9e-5])
FREE: Any = ("k", "weights")
NOISE = 0.01  # N


@functools.cache
def rubbed(cycles: float = 6.0) -> Record:
    """Return a record of two elements; both slip."""
    return measured(TRUTH, sine(3e-4, 2.0, cycles), NOISE)


def fitted(record: Any, model: Any = START, free: Any = FREE, **more: Any) -> Fit:
    """Fit from a start that is near."""
    return fit(record, model, free=free, **{"search": "local"} | more)


@functools.cache
def plain() -> Fit:
    """Return the fit of four cycles of the record; two are held out."""
    return fitted(rubbed(), train=(0, 8), test=(8, 12))
