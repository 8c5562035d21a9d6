"""A small fit that takes a second, and variations of it, for what shows fits."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from gms_fsm import GMS, Fit, GMSParameters, Record, Stribeck, fit
from gms_fsm.identification.certainty.profile import Profile
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


def with_profiles(count: int) -> Fit:
    """Return the small fit with so many parameters that cannot be told, over many ranges."""
    kinds = [  # name, unit, meaning, lowest and highest value
        ("v_c", "m/s", "arrest velocity", 1e-9, 1e-5),
        ("k", "N/m", "stiffness", 1e4, 3e4),
        ("delta", "1", "Stribeck exponent", 1.0, 12.0),
        ("offset", "N", "", -0.03, 0.02),
        ("v_s", "m/s", "Stribeck velocity", 1e-4, 8e-4),
    ]
    rows, profiles = [], []
    for i in range(count):
        kind, unit, meaning, low, high = kinds[i % len(kinds)]
        values = np.geomspace(low, high, 11) if low > 0.0 else np.linspace(low, high, 11)
        rise = 10.0 * np.linspace(-1.0, 1.0, 11) ** 2
        name = f"{kind}{i}"
        profiles.append(Profile(name, unit, values, rise, float(values[2]), float(values[8])))
        value = float(values[5])
        rows.append(Estimate(name, value, low, high, unit, "cannot be told", meaning))
    made = replace(small().assessed, table=tuple(rows), open_profiles=tuple(profiles))
    return replace(small(), assessed=made)


def without_test() -> Fit:
    """Return the small fit as if no rows had been held out."""
    task = small().task
    return replace(small(), task=replace(task, options=replace(task.options, test=None)))
