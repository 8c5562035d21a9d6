"""Lesson 2: LuGre drifts under a shaken load; GMS does not, with springs only and with real slip.

Compared with SciPy for LuGre, and the closed form of the linear oscillator for Table I.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gms_fsm.app.lessons import l2_drift as lesson
from tests.lesson_checks import check_figure, check_lines


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


def F_a(t: float) -> float:
    ramps = min(0.25 * t, max(0.25, 0.75 - 0.125 * t))
    return ramps + (0.1 * math.sin(4 * math.pi * (t - 4)) if t > 4 else 0.0)


@pytest.mark.slow
def test_lugre_drifts_as_in_scipy(result: lesson.Result) -> None:
    def flow(t, y):
        _, v, z = y
        s = 1.0 + 0.5 * math.exp(-((v / 1e-3) ** 2))
        dz = v - 1e3 * abs(v) * z / s
        return [v, F_a(t) - (1e3 * z + 31.6 * dz + 4.0 * v), dz]

    # In pieces: the force has corners at 2 and 4 s.
    y = np.zeros(3)
    x = {}
    for begin, end in ((0.0, 2.0), (2.0, 4.0), (4.0, 30.0)):
        run = solve_ivp(flow, (begin, end), y, method="LSODA", rtol=1e-9, atol=1e-12, max_step=0.01)
        y = run.y[:, -1]
        x[end] = y[0]
    assert x[30.0] > 5e-3
    np.testing.assert_allclose(
        result.lugre.sample([2.0, 30.0]).x, [x[2.0], x[30.0]], rtol=0, atol=1e-6
    )
    assert result.drifts[0] > 1e-4
    assert result.plastic[0] == pytest.approx(x[30.0] - y[2], abs=1e-6)


def test_table_I_is_a_linear_oscillator(result: lesson.Result) -> None:
    """m x'' + c x' + K x = F_a: mean 0.25/K, amplitude 0.1/|K - m w^2 + i c w|; nothing slips."""
    K, c, w = 111.1, 12.1 + 4.0, 4 * math.pi
    amplitude = 0.1 / abs(K - w * w + 1j * c * w)
    x = result.springs.sample(np.linspace(lesson.STEADY, lesson.END, 4001)).x
    assert x.max() == pytest.approx(0.25 / K + amplitude, abs=1e-6)
    assert x.min() == pytest.approx(0.25 / K - amplitude, abs=1e-6)
    assert abs(result.drifts[1]) < 1e-9
    assert len(result.springs.transitions) == 0
    assert np.abs(result.springs.z / result.springs.s).max() < 0.01  # far from any threshold


def test_an_element_slips_and_then_nothing_drifts(result: lesson.Result) -> None:
    log = result.slipping.transitions
    assert log.edge.tolist() == ["break_away_forward", "arrest"]
    assert log.element.tolist() == [0, 0]
    assert log.z[0] == pytest.approx(log.s[0], rel=1e-9)
    assert abs(result.drifts[2]) < 1e-9
    after = result.slipping.t > log.t[1]
    lasting = (result.slipping.x - result.slipping.z[:, 0])[after]
    assert lasting.min() > 1e-2
    assert np.ptp(lasting) < 1e-9  # a spring again


@pytest.mark.slow
def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    check_figure(lesson, result)
