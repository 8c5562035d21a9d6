"""The charts of candidates give the force of their definition, and never make energy.

The oracle is a play operator with two thresholds, followed by a dead zone, written by hand.
"""

from __future__ import annotations

import numpy as np
import pytest

from gms_fsm import ChartModel, Prescribed, simulate
from gms_fsm.identification.candidates import BEHIND_BACKLASH, STIFFER_ONE_WAY
from gms_fsm.identification.problem.linear import linear_names
from gms_fsm.systems.mounted import mounted_alone

TURNS = np.array([0.0, 1.0, -1.0, 0.4, -0.3, 0.8, -1.2, 1.2, -1.2])


def motion(turns: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[tuple[float, float]]]:
    """Positions at 50 times a stroke; the velocity is constant between turns."""
    speeds = np.diff(turns)
    t = np.linspace(0.0, speeds.size, 50 * speeds.size + 1)
    x = np.interp(t, np.arange(turns.size), turns)
    steps = [(i + end, float(v)) for i, v in enumerate(speeds) for end in (0.0, 1.0 - 1e-9)]
    return t, x, [(0.0, float(speeds[0])), *steps[1:-1], (float(speeds.size), float(speeds[-1]))]


def play(x: np.ndarray, forward: float, backward: float) -> np.ndarray:
    """z <- min(forward, max(-backward, z + dx))."""
    z, found = 0.0, [0.0]
    for step in np.diff(x):
        z = min(forward, max(-backward, z + step))
        found.append(z)
    return np.array(found)


def forces(model: ChartModel, turns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    t, x, corners = motion(turns)
    run = simulate(model, Prescribed(corners), float(t[-1]), t_eval=t, engine="ifelse", rtol=1e-10)
    return x, run.F


def backlash(**given: float) -> ChartModel:
    values = {"k": 3.0, "b": 1.0, "g": 0.2, "r": 0.3, "ratio": 1.5, "rho": 0.0, "v_s": 1.0}
    return ChartModel(BEHIND_BACKLASH, values | given)


@pytest.mark.parametrize(("ratio", "b"), [(0.5, -2.0), (1.0, 0.0), (1.5, 1.0), (0.5, 1.0)])
def test_behind_backlash_is_a_dead_zone_behind_two_thresholds(ratio: float, b: float) -> None:
    x, found = forces(backlash(ratio=ratio, b=b), TURNS)
    z = play(x, 0.2 + 0.3, 0.2 + ratio * 0.3)
    stretch = np.sign(z) * np.maximum(np.abs(z) - 0.2, 0.0)
    np.testing.assert_allclose(found, 3.0 * stretch + b * np.abs(stretch), atol=1e-6)


def test_no_force_in_the_gap() -> None:
    _x, found = forces(backlash(), np.array([0.0, 0.19, -0.19, 0.1]))
    assert (found == 0.0).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_thresholds_rise_at_rest_by_rho(sign: float) -> None:
    for speed in (0.1, 1.0, 5.0):
        model = backlash(rho=0.4)
        t_end = 2.0 / speed
        run = simulate(model, Prescribed(str(sign * speed)), t_end, engine="ifelse")
        threshold = 0.3 * (1.0 if sign > 0 else 1.5) * (1.0 + 0.4 * np.exp(-(speed**2)))
        assert run.F[-1] == pytest.approx(sign * (3.0 + sign) * threshold, rel=1e-12)


def test_stiffer_one_way_is_a_bent_spring_behind_a_threshold() -> None:
    model = ChartModel(STIFFER_ONE_WAY, {"k": 3.0, "b": -1.0, "z_c": 0.4})
    x, found = forces(model, TURNS)
    z = play(x, 0.4, 0.4)
    np.testing.assert_allclose(found, 3.0 * z - np.abs(z), atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_a_closed_cycle_never_gives_energy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    k, g, r, ratio = rng.uniform(0.1, 1.0, 4).tolist()
    model = backlash(k=k, b=rng.uniform(-1, 1) * k, g=g, r=r, ratio=ratio)
    turns = np.concatenate([[0.0], np.tile(rng.uniform(0.2, 3.0, 2) * [1, -1], 3)])
    x, found = forces(model, turns)
    last = slice(-101, None)  # the two strokes of a settled cycle
    assert x[-1] == pytest.approx(x[-101])
    work = np.trapezoid(found[last], x[last])
    assert work >= -1e-3 * np.abs(found).max(), (
        f"python -m pytest {__file__} -k 'never_gives_energy and {seed}'"
    )


@pytest.mark.parametrize("chart", [BEHIND_BACKLASH, STIFFER_ONE_WAY])
def test_stiffnesses_are_solved_for_and_not_searched(chart: object) -> None:
    model = backlash() if chart is BEHIND_BACKLASH else None
    model = model or ChartModel(STIFFER_ONE_WAY, {"k": 3.0, "b": -1.0, "z_c": 0.4})
    assert linear_names(mounted_alone(model)) == ("k", "b", "sigma_2")
