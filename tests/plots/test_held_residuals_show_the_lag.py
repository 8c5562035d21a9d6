"""The figure of held outputs shows the differences it is given: signs, units, sample times."""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm.app.paper.held import Lag

pytest.importorskip("matplotlib", reason="figures need the extra 'plots'")

from plots import figures


def lag(period: float) -> Lag:
    t = np.arange(round(6.0 / period)) * period
    size = np.where(t < 2.0, 0.1, -0.5) * period  # N
    return Lag(period, t, size, -size, 1e-2 * size)


def test_each_panel_shows_its_numbers() -> None:
    lags = [lag(h) for h in (2e-3, 1e-3, 5e-4)]
    sheet = figures.held_residuals(
        lags, (1e-4, 1e-6), title="held", phases={"ramp": (0.0, 2.0), "rest": (2.0, 6.0)}
    )
    force, place, between, period = sheet.axes
    for each, line in zip(lags, force.lines, strict=False):
        np.testing.assert_allclose(line.get_ydata(), 1e3 * each.force)
    for each, line in zip(lags, place.lines, strict=False):
        np.testing.assert_allclose(line.get_ydata(), 1e6 * each.place)
    np.testing.assert_allclose(between.lines[0].get_ydata()[:4], [0.2, -0.2, 0.2, -0.2])
    marks = {line.get_label(): np.asarray(line.get_ydata()) for line in period.lines}
    np.testing.assert_allclose(marks["F, ramp"], [2.0, 1.0, 0.5])
    np.testing.assert_allclose(marks["x, rest"], [10.0, 5.0, 2.5])
    assert all("[" in text for ax in sheet.axes for text in (ax.get_xlabel(), ax.get_ylabel()))
    shown = [text.get_text() for text in sheet.legends[0].get_texts()]
    assert shown == ["h = 2 ms", "h = 1 ms", "h = 0.5 ms", "the paper's residual"]
