"""A fit is the same at every scale: forces in MN, strokes in nm, cycles of hours."""

from __future__ import annotations

import functools

import pytest

from gms_fsm import GMS, Fit, Record, Stribeck, fit
from tests.identification.records import bank, measured, sine

pytest.importorskip("llvmlite", reason="fits take long without machine code")

TRUTH, START, FREE = bank([2e4], [5e-5]), bank([1e4], [4e-5]), ("k", "weights", "F_s")


def _record() -> Record:
    return measured(TRUTH, sine(3e-4, 2.0, 3.0), 0.01, 0)


@functools.cache
def _plain() -> Fit:
    return fit(_record(), START, free=FREE, search="local")


def _scaled(model: GMS, force: float, length: float, time: float) -> GMS:
    """Return a model of which forces, lengths and times are so many times as large."""
    p, curve = model.parameters, model.stribeck
    speed = length / time
    return GMS(
        p.replaced(
            k=p.k * force / length,
            C=p.C * speed,
            v_c=p.v_c * speed,
            weights=p.weights * length / force,
            stribeck=Stribeck(curve.F_c * force, curve.F_s * force, curve.v_s * speed),
        ),
        law="signed",
    )


@pytest.mark.slow
@pytest.mark.parametrize(("force", "length", "time"), [(1e6, 1e-6, 1.0), (1e-3, 1e3, 3600.0)])
def test_scale(force: float, length: float, time: float) -> None:
    columns = _record().columns
    other = Record.from_arrays(
        time=columns["time"] * time,
        velocity=columns["velocity"] * length / time,
        force=columns["force"] * force,
    )
    plain = _plain()
    scaled = fit(other, _scaled(START, force, length, time), free=FREE, search="local")
    units = {"k1": force / length}
    units |= {"weights1": length / force}
    units |= dict.fromkeys(("F_s", "offset"), force)
    for one, two in zip(plain.table, scaled.table, strict=True):
        assert two.name == one.name
        assert two.told == one.told, one
        width = (one.high - one.low) * units[one.name]
        assert two.value == pytest.approx(one.value * units[one.name], abs=0.02 * width), one
        if one.told:
            assert two.high - two.low == pytest.approx(width, rel=0.2), one
