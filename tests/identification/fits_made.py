"""A small fit that takes a second, and variations of it, for what shows fits."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from gms_fsm import GMS, Fit, GMSParameters, Record, Stribeck, fit
from gms_fsm.identification.result import Estimate

PERIOD = 2.0  # s


def model(k: tuple[float, ...] = (8e3, 4e3)) -> GMS:
    """Return a bank from which a search starts."""
    parameters = GMSParameters.from_shares(
        [0.6, 0.4], list(k), C=20.0, stribeck=Stribeck(F_c=2.0, F_s=2.1, v_s=1e-3), v_c=1e-6
    )
    return GMS(parameters, law="signed")


def record(name: str = "rig", seed: int = 0, amplitude: float = 5e-4) -> Record:
    """Return six cycles of two Maxwell slip elements with noise of 0.05 N."""
    t = np.arange(600) * 0.02
    x = amplitude * np.sin(2 * np.pi * t / PERIOD)
    z, force = np.zeros(2), np.zeros(t.size)
    limit = np.array([1.2 / 1e4, 0.8 / 5e3])
    for row, dx in enumerate(np.diff(x), start=1):
        z = np.clip(z + dx, -limit, limit)
        force[row] = np.array([1e4, 5e3]) @ z
    noise = np.random.default_rng(seed).standard_normal(t.size)
    return Record.from_arrays(time=t, position=x, force=force + 0.05 * noise + 0.05, name=name)


@functools.cache
def small() -> Fit:
    """Return a fit with held-out rows and a repeatability floor."""
    return fit(
        record(),
        model(),
        free=["k", "weights", "C"],
        tied=["C"],
        train=(0.0, 8.0),
        test=(8.0, 12.0),
        cycles=PERIOD,
        search="local",
        progress=False,
    )


@functools.cache
def two_records() -> Fit:
    """Return a fit of two records, the second with less travel."""
    records = [record("long", 1), record("short", 2, 2e-4)]
    return fit(records, model(), free=["k"], search="local", progress=False)


def with_table(count: int) -> Fit:
    """Return the small fit with other parameters in its table: some told, some open."""
    kinds = [
        (1e4, 9.9e3, 1.01e4, ""),
        (1.0, 0.2, 5.0, ""),
        (2.0, 0.0, np.inf, "cannot be told: no influence on this record"),
        (-0.01, -0.05, 0.03, ""),
        (3.0, 3.0, 3.3, "at its bound"),
    ]
    rows = (
        Estimate(f"parameter_{i}", *kinds[i % len(kinds)][:3], "Ns/m", kinds[i % len(kinds)][3])
        for i in range(count)
    )
    return replace(small(), assessed=replace(small().assessed, table=tuple(rows)))


def without_test() -> Fit:
    """Return the small fit as if no rows had been held out."""
    task = small().task
    return replace(small(), task=replace(task, options=replace(task.options, test=None)))
