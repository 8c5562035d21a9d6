"""Lesson 4: with s(v) unsigned for v < 0 the model creates energy; the signed law hardly does.

The heat is computed in a second way, as the sum of the heat of the sliders and the dampers.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import Trace
from gms_fsm.app.lessons import l4_sign_of_s as lesson
from tests.lesson_checks import check_figure, check_lines


@pytest.fixture(scope="module")
def result() -> lesson.Result:
    return lesson.run()


@pytest.mark.slow
def test_both_laws_agree_for_forward_motion(result: lesson.Result) -> None:
    times = np.linspace(0.0, 12.49, 500)
    np.testing.assert_allclose(
        result.published.sample(times).z, result.signed.sample(times).z, rtol=0, atol=1e-9
    )


@pytest.mark.slow
def test_z_diverges_as_the_eigenvalue_predicts(result: lesson.Result) -> None:
    """After its break-away at -s: z = s + (z0 - s) exp(+C t / s), until the Stribeck dip."""
    log = result.published.transitions
    first = log[(log.element == 0) & (log.edge == "break_away_backward")][0]
    t = np.linspace(first.t, 24.8, 50)  # |v| > 6.1 v_s
    s, C = 0.4, 0.1
    expected = s + (first.z - s) * np.exp(C * (t - first.t) / s)
    np.testing.assert_allclose(result.published.sample(t).z[:, 0], expected, rtol=0, atol=1e-4)
    assert expected[-1] < -2


def test_signed_z_stays_at_its_threshold(result: lesson.Result) -> None:
    # In the dip s rises to 1.5 m for some 0.05 s, and z follows by 0.1 m/s at most.
    assert 0.4 <= np.abs(result.signed.z).max() < 0.41
    assert result.published.z.min() < -3


def dissipated(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
    """Return the heat by sliders, k z (v - dz), and by dampers, sigma dz v + sigma_2 v^2."""
    fine, p = trace.refined(lesson.POINTS), lesson.PARAMETERS
    sliders = (p.k * fine.z * (fine.v[:, None] - fine.dz)).sum(axis=1)
    dampers = (p.sigma * fine.dz * fine.v[:, None]).sum(axis=1) + p.sigma_2 * fine.v**2
    power = sliders + dampers
    heat = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(fine.t))])
    return fine.t, heat


@pytest.mark.slow
@pytest.mark.parametrize("law", ["published", "signed"])
def test_the_balance_closes(result: lesson.Result, law: str) -> None:
    balance = getattr(result, f"{law}_energy")
    t, heat = dissipated(getattr(result, law))
    np.testing.assert_array_equal(t, balance.t)
    np.testing.assert_allclose(balance.heat, heat, rtol=0, atol=1e-3)


def test_heat_vanishes_under_the_published_law(result: lesson.Result) -> None:
    assert result.vanished[0] > 10
    energy = result.published_energy
    assert energy.stored[-1] > energy.work[-1]  # more than was ever supplied
    assert energy.heat.min() < -1


def test_the_signed_law_creates_a_little_only_in_the_stribeck_dip(result: lesson.Result) -> None:
    assert 0 < result.vanished[1] < 0.01
    assert result.outside_dip[1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
def test_lines_and_picture(result: lesson.Result) -> None:
    check_lines(result)
    check_figure(lesson, result)
