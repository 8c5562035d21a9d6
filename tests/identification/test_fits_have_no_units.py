"""A fit is the same at every scale: forces in MN, strokes in nm, cycles of hours."""

from __future__ import annotations

import pytest

from gms_fsm import GMS, Record, Stribeck, fit
from tests.identification.records import bank, measured, sine

pytest.importorskip("llvmlite", reason="fits take long without machine code")

TRUTH, START = bank([2e4, 5e3], [5e-5, 1e-4]), bank([1e4, 1e4], [4e-5, 9e-5])


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
@pytest.mark.parametrize(
    ("force", "length", "time"), [(1e6, 1.0, 1.0), (1.0, 1e-6, 1.0), (1e-3, 1e3, 3600.0)]
)
def test_scale(force: float, length: float, time: float) -> None:
    record = measured(TRUTH, sine(3e-4, 2.0, 3.0), 0.01, 0)
    columns = record.columns
    other = Record.from_arrays(
        time=columns["time"] * time,
        velocity=columns["velocity"] * length / time,
        force=columns["force"] * force,
    )
    free = ("k", "weights", "F_s")
    plain = fit(record, START, free=free, search="local")
    scaled = fit(other, _scaled(START, force, length, time), free=free, search="local")
    units = dict.fromkeys(("k1", "k2"), force / length)
    units |= dict.fromkeys(("weights1", "weights2"), length / force)
    units |= dict.fromkeys(("F_s", "offset"), force)
    for one, two in zip(plain.table, scaled.table, strict=True):
        assert two.name == one.name
        assert two.told == one.told, one
        width = (one.high - one.low) * units[one.name]
        assert two.value == pytest.approx(one.value * units[one.name], abs=0.02 * width), one
        if one.told:
            assert two.high - two.low == pytest.approx(width, rel=0.2), one
