"""`describing_function` is the first harmonic: closed forms, and what it says of hunting."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    State,
    System,
    describing_function,
    simulate,
)
from gms_fsm.charts import CHARTS
from tests.helpers import FASTEST


def friction(force: str, **numbers: float) -> ChartModel:
    """A friction without states."""
    chart = Chart("one", parameters=tuple(numbers), states=(State("on"),), outputs={"F": force})
    return ChartModel(chart, numbers)


def test_coulomb_friction_is_four_over_pi() -> None:
    A, w = np.array([1e-6, 1e-3, 2.0]), [0.1, 30.0]
    found = describing_function(friction("F_c * sgn(v)", F_c=2.0), A, w)
    expected = np.repeat(4 * 2.0 / (np.pi * A)[:, None], 2, axis=1)
    np.testing.assert_allclose(found.imag, expected, rtol=1e-6)
    np.testing.assert_allclose(found.real / expected, 0.0, atol=1e-6)


def test_a_damper_and_a_square_law() -> None:
    w = np.array([1.0, 7.0])
    np.testing.assert_allclose(
        describing_function(friction("b * v", b=3.0), 0.1, w), [3j * w], rtol=1e-6, atol=1e-6
    )
    A = 0.1
    expected = 8 / (3 * np.pi) * A * w**2  # of v |v|, for v = A w cos(w t), over A
    found = describing_function(friction("v * abs(v)"), A, w)[0]
    np.testing.assert_allclose(found, 1j * expected, rtol=1e-5, atol=1e-6)


def test_one_element_of_maxwell_slip_is_the_classic_hysteresis() -> None:
    k, F = 100.0, 1.0
    model = ChartModel(CHARTS["maxwell-slip"], {"k": k, "F_c": F})
    A = np.array([0.005, 0.02, 0.1])
    found = describing_function(model, A, 2.0)[:, 0]
    slip, theta = F / k, np.arccos(np.clip(1 - 2 * F / k / A, -1, 1))
    real = np.where(slip < A, k / np.pi * (theta - np.sin(2 * theta) / 2), k)
    imag = np.where(slip < A, 4 * F / (np.pi * A) * (1 - slip / A), 0.0)
    np.testing.assert_allclose(found.real, real, rtol=1e-4)
    np.testing.assert_allclose(found.imag, imag, rtol=1e-4, atol=1e-3)


GAINS = {"m": 1.0, "k_p": 400.0, "k_d": 40.0}
K_I = 4000.0


def hunting(F_s: float, **more: object) -> System:
    """A table with stiction under PD; its integral force comes from outside or is its own."""
    pad = Contact("guide", CHARTS["stiction"], {"F_c": 1.0, "F_s": F_s, "b": 0.0})
    body = Body("table", inertia="m", force="i - k_p * x - k_d * v")
    return System("hunting", bodies=(body,), contacts=(pad,), **more)  # type: ignore[arg-type]


def simulated_period() -> float:
    closed = hunting(1.5, numbers={**GAINS, "k_i": K_I}, flow={"i": "-k_i * x"})
    log = simulate(closed, 30.0, initial={"x": 1e-3}, engine=FASTEST).transitions
    released = log.t[log.edge == "release_forward"]
    assert abs(released[-1] - 2 * released[-2] + released[-3]) < 1e-6
    return float(released[-1] - released[-2])


def test_an_independent_loop_has_the_same_hunting_period() -> None:
    m, k_p, k_d = GAINS.values()
    t, y, sign, released = 0.0, [1e-3, 0.0, 0.0], 0.0, []
    while t < 30.0:
        if sign == 0.0:
            rates = lambda t, y: [0.0, 0.0, -K_I * y[0]]  # noqa: E731
            event = lambda t, y: abs(y[2] - k_p * y[0]) - 1.5  # noqa: E731
        else:
            rates = lambda t, y, s=sign: [  # noqa: E731
                y[1], (y[2] - k_p * y[0] - k_d * y[1] - s) / m, -K_I * y[0]
            ]  # fmt: skip
            event = lambda t, y, s=sign: s * y[1]  # noqa: E731
            event.direction = -1
        event.terminal = True
        found = solve_ivp(rates, (t, 30.0), y, events=event, rtol=1e-9, atol=1e-12, max_step=0.05)
        t, y = float(found.t[-1]), found.y[:, -1].tolist()
        if found.status == 1 and sign == 0.0:
            sign = float(np.sign(y[2] - k_p * y[0]))
            released += [t] * (sign > 0)
            y[1] = sign * 1e-12
        else:
            assert abs(y[2] - k_p * y[0]) < 1.5
            sign, y[1] = 0.0, 0.0
    assert released[-1] - released[-2] == pytest.approx(simulated_period(), abs=1e-6)


def balance(F_s: float, w: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Return how far the loop is from an oscillation: 0 where N k_i / (j w) = -1."""
    open_loop = hunting(F_s, numbers={**GAINS, "i": 0.0})
    N = describing_function(
        open_loop, level, w, input="i", output="x", initial={"x": -(F_s - 1.0) / 800.0}
    )
    found: np.ndarray = np.abs(N * K_I / (1j * w) + 1.0)
    return found


@pytest.mark.slow
def test_hunting_is_predicted_with_stiction_and_not_without() -> None:
    w = np.linspace(2.2, 3.0, 9)
    with_stiction = balance(1.5, w, np.array([1.27, 1.28, 1.29, 1.3, 1.31]))
    at = np.unravel_index(np.nanargmin(with_stiction), with_stiction.shape)
    assert with_stiction[at] < 0.03
    assert 2 * np.pi / w[at[1]] == pytest.approx(simulated_period(), rel=0.15)
    slow = np.array([0.5, 1.5, 2.6, 3.5])
    assert np.nanmin(balance(1.0, slow, np.array([1.02, 1.1, 1.3, 2.0]))) > 0.3
    still = hunting(1.0, numbers={**GAINS, "k_i": K_I}, flow={"i": "-k_i * x"})
    run = simulate(still, 60.0, initial={"x": 1e-3}, engine=FASTEST)
    assert np.abs(run.x[-1]) < 1e-5


def test_what_never_repeats_is_nan() -> None:
    loose = System(
        "loose", bodies=(Body("mass", inertia=1.0, force="u"),), numbers={"u": 1.0},
        contacts=(Contact("pad", friction("0 * v").chart, {}),),
    )  # fmt: skip
    assert np.isnan(describing_function(loose, 1.0, 2.0, input="u", output="x")).all()
