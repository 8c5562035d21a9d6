"""Claim: the measured curve at steady speeds is the text of the Stribeck curve, plus sigma_2 v."""

from __future__ import annotations

import numpy as np
import pytest

from tests.phenomena.cases import BENCH, CURVE, known


@pytest.mark.slow
def test_lugre_and_gms() -> None:
    for model in ("lugre", "gms-signed"):
        (curve,) = known().cell(model, "stribeck").curves
        v = 1e-3 * curve.x
        assert v[0] == pytest.approx(1e-5, rel=1e-3)
        assert v[-1] == pytest.approx(0.1, rel=1e-3)
        assert np.abs(curve.y - CURVE(v) - BENCH.sigma_2 * v).max() < 1e-5
