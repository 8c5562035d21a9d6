"""A run with located events finds every switch without a prescribed step.

Evaluating the guards only at step ends (``events="step"``) does not: which ones it finds is luck.
"""

from collections import Counter

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from tests.helpers import FIG4_SINE, event_sequence, open_loop, pulled_mass, stick_slip

COUNT = {"signed": 48, "published": 39}
LAWS = list(COUNT)
TIGHT = {"rtol": 1e-12, "atol": 1e-15}
T = 61.0
TIMES = np.linspace(0.0, T, 3001)


@pytest.fixture(scope="module", params=LAWS)
def law(request):
    return request.param


@pytest.fixture(scope="module")
def reference(law):
    """The run at rtol 1e-12."""
    return simulate(stick_slip(law), open_loop(), T, t_eval=TIMES, **TIGHT)


def test_default_run_finds_all_of_them_in_place(law, reference):
    """Default tolerances: the same switches, times and z close to those of the tight run."""
    trace = simulate(stick_slip(law), open_loop(), T, t_eval=TIMES)
    assert len(trace.transitions) == COUNT[law]
    assert event_sequence(trace) == event_sequence(reference)
    # Under the published law z grows without bound while v < 0, and errors with it.
    time_bound, z_bound = {"signed": (5e-5, 2e-5), "published": (1e-4, 1e-4)}[law]
    assert np.abs(trace.transitions.t - reference.transitions.t).max() < time_bound
    assert np.abs(trace.z - reference.z).max() < z_bound


@pytest.mark.slow
def test_rk4_with_a_step_that_does_not_divide_the_period_finds_them_too(law, reference):
    """Fixed steps of 1.0001 ms, cut at each crossing."""
    trace = simulate(stick_slip(law), open_loop(), T, method="rk4", step=1.0001e-3)
    assert event_sequence(trace) == event_sequence(reference)
    assert np.abs(trace.transitions.t - reference.transitions.t).max() < 1e-8


@pytest.mark.slow
def test_evaluating_guards_at_step_ends_loses_most_switches(law, reference):
    """With a step of 1.003 ms no sample falls into |v| <= v_c: 4 switches, z wrong by 0.5 m."""
    trace = simulate(
        stick_slip(law), open_loop(), T, method="rk4", step=1.003e-3, events="step", t_eval=TIMES
    )
    assert len(trace.transitions) == 4
    assert np.abs(trace.z - reference.z).max() > 0.5


@pytest.mark.slow
def test_evaluating_guards_at_step_ends_is_luck(law, reference):
    """With a step of 1.0001 ms all are found, because the grid happens to land on v = 0.

    10 s are 9999.0001 of those steps, so each reversal has a sample within 6 steps/10,000, where
    |v| < v_c; the same rule finds 4 switches with 1.003 ms and all with 1.0001 ms.
    """
    h = 1.0001e-3
    reversals = np.arange(10.0, T, 10.0)
    nearest = np.round(reversals / h) * h
    assert np.abs(0.2 * np.sin(2 * np.pi * nearest / 20)).max() < 1e-6
    other = np.round(reversals / 1.003e-3) * 1.003e-3
    assert np.abs(0.2 * np.sin(2 * np.pi * other / 20)).min() > 1e-6
    trace = simulate(stick_slip(law), open_loop(), T, method="rk4", step=h, events="step")
    assert len(trace.transitions) == COUNT[law]


@pytest.mark.slow
def test_pulled_mass():
    """The stick-slip rig: 72 transitions, 34 of them arrests, and the known range of v."""
    model, rig = pulled_mass()
    trace = simulate(model, rig, 60.0)
    assert Counter(trace.transitions.edge.tolist()) == {"break_away_forward": 38, "arrest": 34}
    tight = simulate(model, rig, 60.0, **TIGHT)
    assert event_sequence(trace) == event_sequence(tight)
    assert trace.v.min() == pytest.approx(-0.024, abs=1e-3)
    assert trace.v.max() == pytest.approx(0.360, abs=1e-3)


def log_of(trace, edge, after, before):
    """Return {element counted from 1: time} of an edge within a time window."""
    log = trace.transitions
    chosen = log[(log.edge == edge) & (log.t > after) & (log.t < before)]
    return dict(zip((chosen.element + 1).tolist(), chosen.t.tolist(), strict=True))


def test_fig_4_published():
    """The signal of Fig. 4 under eq. (1) as printed: where it splits, and how far z goes."""
    trace = simulate(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)
    first = log_of(trace, "break_away_forward", 0, 12)
    assert list(first) == [1, 2, 3, 4]
    assert list(first.values()) == pytest.approx([4.91] * 4, abs=5e-3)
    arrests = log_of(trace, "arrest", 0, 20)
    assert list(arrests) == [1, 2, 3, 4]
    assert list(arrests.values()) == pytest.approx([12.5] * 4, abs=1e-4)
    backward = log_of(trace, "break_away_backward", 12, 25)
    assert list(backward) == [4, 3, 2, 1]
    assert all(20.13 < t < 20.15 for t in backward.values())
    again = log_of(trace, "break_away_forward", 25, 37.5)
    assert list(again) == [4, 3]
    assert list(again.values()) == pytest.approx([32.64, 35.04], abs=5e-3)
    # Element 1 slipped on through the reversal at 25 s: |z| >= s, so it could not arrest.
    assert list(log_of(trace, "arrest", 20, 30)) == [2, 3, 4]
    lowest = trace.z.min(axis=0)
    assert lowest == pytest.approx([-3.1, -2.3, -0.68, -0.40], abs=0.05)
    assert trace.z[-1, [0, 2, 3]] == pytest.approx([-3.076, -0.683, -0.401], abs=2e-3)


def test_fig_4_signed():
    """Under the signed law nothing splits: every wave has the same four switches at each place."""
    trace = simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 99.0)
    for number, after in enumerate((0, 12.6, 25.1, 37.6, 50.1, 62.6, 75.1, 87.6)):
        edge = "break_away_backward" if number % 2 else "break_away_forward"
        found = log_of(trace, edge, after, after + 12.3)
        assert sorted(found) == [1, 2, 3, 4]
        assert max(found.values()) - min(found.values()) < 0.02
    assert np.abs(trace.z[-1]).max() < 0.45
    assert np.ptp(trace.z[-1]) < 3e-3
