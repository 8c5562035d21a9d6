"""The numbers of the lessons: closed forms, SciPy, and what each lesson says of its runs."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from gms_fsm import GMS, measure_phenomena
from gms_fsm.app.lessons import LESSONS, Result
from gms_fsm.app.lessons.basics import l0_first_chart as l0
from gms_fsm.app.lessons.basics import l1_hysteresis as l1
from gms_fsm.app.lessons.basics import l3_missed_window as l3
from gms_fsm.app.lessons.basics import l5_how_many as l5
from gms_fsm.app.lessons.basics import l6_stick_slip as l6
from gms_fsm.app.lessons.engine.notebooks import composed
from gms_fsm.app.lessons.practice import l7_frictional_lag as l7
from gms_fsm.app.lessons.practice import l8_chart_or_ifelse as l8
from gms_fsm.app.lessons.practice import l9_contacts as l9
from gms_fsm.app.lessons.practice import l10_which_model as l10
from gms_fsm.app.lessons.practice import l11_what_a_record_tells as l11
from gms_fsm.app.lessons.practice import l12_what_runs_have_not_tried as l12
from gms_fsm.app.lessons.practice import l13_violin as l13
from gms_fsm.phenomena.specimens import bench_bank
from tests.helpers import FASTEST

pytestmark = pytest.mark.slow  # they share the runs
Ran = Callable[[int], Result]
approx = pytest.approx


def close(found: Any, expected: Any, atol: float = 0.0, rtol: float = 0.0) -> None:
    np.testing.assert_allclose(found, expected, rtol=rtol, atol=atol)


# ------------------------------------------------------------------ 0: a first chart
def test_a_light_hears_every_second_press(ran: Ran) -> None:
    r, green, presses = ran(0), 0.0, [14.0 * k for k in range(1, 7)]
    warned = []
    for press in presses:
        if press > green:
            warned.append(press)
            green = press + 3.0 + 12.0
    close(l0.times(r.lights, "press"), presses)
    close(l0.times(r.lights, "warn"), warned)
    close(l0.times(r.lights, "halt"), np.add(warned, 3.0), rtol=1e-14)
    assert (r.heard, r.presses, r.red_to_red) == (len(warned), len(presses), 28.0)


def test_the_light_of_the_page_is_the_one_that_runs() -> None:
    (written,) = (text for _, text in composed(0) if "Transition(" in text)
    names: dict[str, Any] = {}
    exec(written, names)
    assert names["light"] == l0.LIGHT


def test_a_room_warms_and_cools_between_two_exponentials(ran: Ran) -> None:
    r = ran(0)
    cool, heat = 600.0 * math.log(21.0 / 19.0), 600.0 * math.log(11.0 / 9.0)
    first = 600.0 * math.log(20.0 / 19.0)
    close(r.on, first + (cool + heat) * np.arange(r.on.size), rtol=1e-8)
    close(r.off, first + heat + (cool + heat) * np.arange(r.off.size), rtol=1e-8)
    close([r.low, r.high, r.cycle], [19.0, 21.0, cool + heat], rtol=1e-8)
    assert r.heater_at_20 == "either"
    warming = r.u[r.there] == 1.0
    assert (np.diff(r.T)[r.there] > 0.0).tolist() == warming.tolist()


def test_a_mass_on_one_bristle_slips_when_scipy_says(ran: Ran) -> None:
    r, v_c, slipping, t, y = ran(0), 1e-6, False, 0.0, np.zeros(3)
    found: dict[bool, list[float]] = {True: [], False: []}

    def s(v: float) -> float:
        return float(1.0 + 0.5 * math.exp(-((v / 0.05) ** 2))) / l0.K

    def flow(t: float, y: Any, slipping: bool) -> list[float]:
        _, v, z = y
        bend = l0.C * (math.copysign(1.0, v) - z / s(v)) if slipping else v
        friction = l0.K * z + l0.SIGMA * bend + 0.4 * v
        return [v, 2.0 * (0.1 * t - y[0]) - friction, bend]

    def breaks(t: float, y: Any, _: bool) -> float:
        return float(y[2] - s(y[1]))

    def rests(t: float, y: Any, _: bool) -> float:
        return float(y[1] - v_c)

    for event, direction in ((breaks, 1.0), (rests, -1.0)):
        vars(event).update(terminal=True, direction=direction)
    while t < 40.0:
        event = rests if slipping else breaks
        done = solve_ivp(
            flow, (t, 40.0), y, "DOP853", events=event, args=(slipping,), rtol=1e-10, atol=1e-13
        )
        t, y = done.t[-1], done.y[:, -1]
        if done.status == 1:
            assert abs(y[2]) < s(y[1]) or not slipping  # the other half of the guard
            found[slipping].append(t)
            slipping = not slipping
    close(r.slips, found[False], rtol=1e-5)
    close(r.arrests, found[True], rtol=1e-5)
    close(r.bent, s(0.002), rtol=1e-3)


# ------------------------------------------------------------------ 1: pre-sliding hysteresis
def test_the_bank_is_a_row_of_stops_that_closes_its_loops(ran: Ran) -> None:
    """Springs that slip at s_i = 0.25/k_i; within |v| <= v_c a reversal is late by 1 nm."""
    r, s, late = ran(1), 0.25 / l1.K, 1e-9
    fine = r.gms.refined(4000)
    z, F = np.zeros(4), []
    for step in np.diff(fine.x, prepend=0.0):
        z = np.clip(z + step, -s, s)
        F.append(l1.K @ z)
    close(fine.F, F, atol=l1.K.sum() * late)
    assert r.masing_error < l1.K.sum() * late
    close(r.let_go, s, atol=late)
    close(r.gms.sample(r.turn_times).x, l1.TURNS, atol=1e-12)
    close(r.gms.sample(r.back).x, l1.TURNS[[2, 0]], atol=1e-12)
    assert abs(r.misses).max() < 1e-6
    beyond_A = r.gms.sample(np.linspace(r.back[1], r.turn_times[-1] - l1.RAMP, 50))
    close(beyond_A.F, l1.first_loading(beyond_A.x), atol=1e-4)  # the inner loops are forgotten
    # An element that slips at s dissipates 4 k s (a - s) in a loop of amplitude a > s.
    A, B, C, D, _ = l1.TURNS
    loops = [(4 * l1.K * s * np.maximum(a / 2 - s, 0.0)).sum() for a in (A - B, C - D)]
    assert r.loss == approx(sum(loops), rel=1e-3)


def test_lugre_misses_the_old_points_as_its_exponentials_predict(ran: Ran) -> None:
    """With F_s = F_c and no damping the bristle is rate-independent: dz/dx = 1 -+ sigma_0 z/F_c."""

    def stroke(F: float, way: float) -> float:
        end = math.copysign(1.0, way)
        return end + (F - end) * math.exp(-l1.K.sum() * abs(way))

    F = [0.0]
    for here, there in itertools.pairwise([0.0, *l1.TURNS]):
        F.append(stroke(F[-1], there - here))
    expected = [stroke(F[4], l1.TURNS[i] - l1.TURNS[3]) - F[i + 1] for i in (2, 0)]
    close(ran(1).lugre_misses, expected, atol=1e-5)
    assert abs(ran(1).lugre_misses[0]) > 0.05


# ------------------------------------------------------------------ 2: drift
def test_lugre_drifts_and_gms_does_not_with_springs_only_or_after_a_slip(ran: Ran) -> None:
    """Table I is an oscillator: mean 0.25/K, amplitude 0.1/|K - m w^2 + i c w|; nothing slips."""
    r, K, w = ran(2), 111.1, 4 * math.pi
    amplitude = 0.1 / abs(K - w * w + 1j * (12.1 + 4.0) * w)
    close(r.ranges[1], (0.25 / K - amplitude, 0.25 / K + amplitude), atol=1e-6)
    assert r.drifts[0] > 1e-4
    assert r.plastic[0] > 5e-3  # agrees with SciPy: tests/phenomena
    assert abs(r.drifts[1:]).max() < 1e-9
    assert r.switches == 0
    assert np.abs(r.springs.z / r.springs.s).max() < 0.01  # far from any threshold
    log = r.slipping.transitions
    assert log.edge.tolist() == ["break_away_forward", "arrest"]
    assert log.element.tolist() == [0, 0]
    assert log.z[0] == approx(log.s[0], rel=1e-9)
    lasting = (r.slipping.x - r.slipping.z[:, 0])[r.slipping.t > log.t[1]]
    assert lasting.min() > 1e-3
    assert np.ptp(lasting) < 1e-9  # a spring again


# ------------------------------------------------------------------ 3: the missed window
@pytest.mark.matrix
def test_the_switches_found_once_per_step_follow_from_the_grid(ran: Ran) -> None:
    """Four break-aways; then at a reversal that is hit four arrests, and until 61 s four more."""
    r = ran(3)
    for step, count, met in zip(l3.STEPS, r.counts, r.met, strict=True):
        hit = [
            turn
            for turn in range(10, 61, 10)
            for ticks in [step * (round(turn / step) + np.arange(-1, 2))]
            if np.abs(0.2 * np.sin(math.pi * ticks / 10)).min() <= 1e-6
        ]
        assert met == len(hit)
        assert count == 4 + 4 * len(hit) + 4 * sum(turn < 60 for turn in hit), step
    assert (max(r.counts), min(r.counts)) == (48, 4)


def test_located_finds_all_and_a_missed_one_slips_with_the_wrong_sign(ran: Ran) -> None:
    r = ran(3)
    assert (r.found, r.total) == (4, 48)
    arrests = r.located.transitions.t[r.located.transitions.edge == "arrest"].reshape(6, 4)
    early = 1e-6 / (0.2 * math.pi / 10)  # v = A sin(w t) falls to v_c at t_r - v_c / (A w)
    close(arrests - l3.REVERSALS[:, None], -early, atol=1e-11)
    assert r.window == approx(2 * early, rel=1e-9)
    assert r.arrest_error < 1e-11
    assert 0 < r.late <= l3.STEP
    # From 10 to 20 s element 1 goes from +s to -s as exp(-C t / s) instead of sticking.
    expected = -0.4 + 0.8 * math.exp(-0.1 * 10 / 0.4)
    assert r.once.z[r.once.t == 20.0, 0] == approx(expected, abs=0.01)
    assert r.located.z[r.located.t == 20.0, 0] == approx(-0.4, abs=0.01)
    assert r.z_error > 0.5
    assert r.F_error > 1.0


# ------------------------------------------------------------------ 4: the sign of s(v)
def test_laws_agree_forward_and_diverge_backward_as_the_eigenvalue_predicts(ran: Ran) -> None:
    r, times = ran(4), np.linspace(0.0, 12.49, 500)
    close(r.published.sample(times).z, r.signed.sample(times).z, atol=1e-9)
    # After its break-away at -s: z = s + (z0 - s) exp(+C t / s), until the Stribeck dip.
    log = r.published.transitions
    first = log[(log.element == 0) & (log.edge == "break_away_backward")][0]
    t = np.linspace(first.t, 24.8, 50)  # |v| > 6.1 v_s
    expected = 0.4 + (first.z - 0.4) * np.exp(0.1 * (t - first.t) / 0.4)
    close(r.published.sample(t).z[:, 0], expected, atol=1e-4)
    assert expected[-1] < -2
    assert r.published.z.min() < -3
    # In the dip s rises to 1.5 m for some 0.05 s, and z follows by 0.1 m/s at most.
    assert 0.4 <= r.largest < 0.41


def test_heat_vanishes_under_the_published_law_and_in_the_stribeck_dip(ran: Ran) -> None:
    r = ran(4)
    assert r.vanished[0] > 10
    assert r.stores[0] > r.works[0]  # more than was ever supplied
    assert r.published_energy.heat.min() < -1
    assert 0 < r.vanished[1] < 0.01
    assert r.outside_dip[1] == approx(0.0, abs=1e-9)


# ------------------------------------------------------------------ 5: how many elements
def test_the_first_loading_is_a_chain_of_chords_and_a_loop_is_masings(ran: Ran) -> None:
    r, a, f = ran(5), l5.SMALL, l5.parabola
    close(r.errors, l5.F_c / (4 * np.array(l5.COUNTS) ** 2), rtol=1e-3)
    for n, loss in zip(l5.COUNTS, r.losses, strict=True):
        fine, corners = r.loadings[n].refined(2000), l5.X * np.arange(n + 1) / n
        close(fine.F, np.interp(fine.x, corners, f(corners)), atol=1e-6)
        p = l5.bank(n).parameters
        s = p.weights * l5.F_c
        expected = (4 * p.k * s * np.maximum(a - s, 0.0)).sum()
        assert loss == approx(expected, rel=1e-3, abs=1e-10)
    assert abs(r.losses[:2]).max() < 1e-10  # one and two elements: a line, no loop
    assert 0.85 < r.shares[2] < 0.9 < 0.97 < r.shares[3] < 0.98
    # Between the rising branch -F_a + 2 f((a + x)/2) and the falling F_a - 2 f((a - x)/2).
    area, _ = quad(lambda x: float(2 * (f((a + x) / 2) + f((a - x) / 2) - f(a))), -a, a)
    assert area == approx(l5.smooth_loss(a), rel=1e-9)


# ------------------------------------------------------------------ 6: stick-slip
def test_a_wait_is_a_length_over_the_speed_and_a_slip_is_not(ran: Ran) -> None:
    r = ran(6)
    assert Counter(r.portrait.transitions.edge.tolist()) == {"break_away_forward": 38, "arrest": 34}
    assert (r.slowest, r.fastest) == approx((-0.024, 0.36), abs=2e-3)
    lengths = r.lengths[:-1]  # at the highest speed it hardly comes to rest
    assert np.ptp(lengths) < 0.06 * lengths.mean()
    assert (np.diff(r.waits + r.slips) < 0).all()
    # Between oscillations of the free mass on its spring, half a period and a whole one.
    free = 2 * np.pi * np.sqrt(l6.MASS / l6.STIFFNESS)
    assert 0.5 * free < r.slips.min() < r.slips.max() < min(1.2 * free, 1.5 * r.slips.min())
    for cycle in r.cycles:
        assert cycle.pull_at_slip == approx(l6.F_s, rel=0.04)
        assert cycle.pull_at_stop < l6.F_c
        # K (V wait - creep) = rise of the pull; the mass creeps below the lowest threshold.
        stretched = (cycle.pull_at_slip - cycle.pull_at_stop) / l6.STIFFNESS
        assert -0.01 < cycle.V * cycle.wait - stretched < l6.F_s / 4 / l6.K.min()


def test_over_a_cycle_pull_and_friction_balance(ran: Ran) -> None:
    """Momentum is the same at both ends of a cycle: the mean of pull minus friction is zero."""
    trace = ran(6).portrait
    log = trace.transitions
    ends = log.t[(log.element == 3) & (log.edge == "break_away_forward")][-2:]
    fine = trace.sample(np.linspace(*ends, 20_001))
    net = l6.STIFFNESS * (l6.SPEED * fine.t - fine.x) - fine.F
    assert abs(np.mean(0.5 * (net[1:] + net[:-1]))) < 1e-3
    assert np.abs(net).max() > 0.2


def test_without_falling_friction_or_pulled_fast_it_keeps_sliding(ran: Ran) -> None:
    assert set(ran(6).rests.values()) == {0}
    trace = l6.pulled(l6.bank(), l6.TOO_FAST)
    assert trace.v[-1] == approx(l6.TOO_FAST, abs=2e-3)
    assert trace.F[-1] == approx(l6.F_c + l6.SIGMA_2 * l6.TOO_FAST, abs=2e-3)


# ------------------------------------------------------------------ 7: frictional lag
def stribeck(v):
    return 1.0 + 0.5 * np.exp(-((v / 1e-3) ** 2))


def test_the_loop_widens_up_to_C_over_s_and_closes_above(ran: Ran) -> None:
    """F = s - (s/C) ds/dt for slow changes: width 2 (s/C) |s'(v)| w SWING at the mean speed."""
    r, v = ran(7), 1.5e-3
    slope = 0.5 * 2 * v / 1e-6 * math.exp(-((v / 1e-3) ** 2))
    assert r.widths[0] == approx(2 * stribeck(v) / l7.C * slope * 1e-3, rel=0.02)
    widest = int(r.widths.argmax())
    assert 0.7 < r.widest * 1.2 / l7.C < 1.3
    assert (np.diff(r.widths[: widest + 1]) > 0).all()
    assert (np.diff(r.widths[widest:]) < 0).all()
    assert 0 < r.widths[-1] < 0.2 * r.widths[widest]


# ------------------------------------------------------------------ 8: chart or if-else
@pytest.mark.matrix
def test_a_late_switch_leaves_a_spike_and_a_residual(ran: Ran) -> None:
    """sum sigma_i (dz_slip - v), with dz_slip = 0 at z = s; t* from the cosine of the motion."""
    r, w = ran(8), 2 * math.pi / 25
    t = math.acos(1 - 0.4 * w / 0.15) / w  # x = 0.15 (1 - cos w t) / w reaches s = F_c = 0.4
    assert r.first == approx(t, abs=1e-6)
    assert r.spike == approx((0.3 + 0.4 + 0.5 + 0.6) * 0.15 * math.sin(w * t), rel=1e-3)
    assert ((r.late > 0) & (r.late <= l8.STEPS)).all()
    close(r.left, l8.predicted(r.late, r.chart), rtol=0.01)
    rough = r.chart.transitions[0].v * r.late * 4 * 0.7  # the excess deflection of all springs
    assert ((0.9 * rough < r.left) & (r.left < rough)).all()
    assert l8.PAPER_STEP < r.late_for_the_papers < 4e-3
    assert r.before < 1e-5
    assert 2e-5 < r.after < 5e-4
    assert set(r.ifelse_once.transitions.edge) == {"break_away_forward"}  # arrests are missed
    assert r.diverged > 1.0
    # With the same driver, whichever it is, chart and if-else are identical.
    assert (r.differ[0], r.differ_once[0], r.differ_held[0]) == (0, 0, 0)
    assert r.differ_once[1] > 300_000
    assert r.differ_held[1] > 100_000


def test_held_outputs_explain_the_papers_residuals_within_a_factor_of_10(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On the ramp the held force is off by half a step's rise of the applied 0.25 N/s."""
    monkeypatch.setattr(l8, "ENGINES", (FASTEST, FASTEST))  # which have equal bits
    r = LESSONS[8].run()
    for size, papers in zip((*r.pushed_largest, r.early), (1e-4, 1e-4, 1e-3), strict=True):
        assert papers / 10 < size < 10 * papers
    assert r.held.largest[0] == approx(0.25, abs=0.01)  # the spike, as located
    assert [lag.period for lag in r.pushed] == [2e-3, 1e-3, 5e-4]
    sizes = np.array([lag.largest for lag in r.pushed])
    close(sizes[:-1] / sizes[1:], 2.0, rtol=0.03)
    for lag in r.pushed:
        settled = lag.during((1.5, 2.0))
        close(settled.force, 0.25 * lag.period / 2, rtol=0.01)
        close(settled.before, -0.25 * lag.period / 2, rtol=0.01)


# ------------------------------------------------------------------ 9: contacts
def test_a_stuck_mass_rests_exactly_and_a_bank_creeps(ran: Ran) -> None:
    r = ran(9)
    assert r.rows >= 10
    assert set(r.speeds_while_stuck.tolist()) == {0.0}
    assert set(r.stiction.x[r.stiction.t <= r.released].tolist()) == {0.0}
    assert r.released == approx(1.5 / (2.0 * 0.1), abs=1e-9)
    assert l9.pulled().bodies == l9.pulled(bristles=True).bodies  # only the contact is exchanged
    t, x = r.crept
    assert l9.STIFFNESS * (l9.SPEED * t - x) == approx(1.5, rel=0.05)
    assert x > 0.01


def test_the_load_stands_still_in_the_dead_time(ran: Ran) -> None:
    r = ran(9)
    assert len(r.dead) == 3
    close(np.diff(r.dead), 2 * 0.02 / 0.05 + 0.4 / 200.0, rtol=1e-9)
    t, w = r.turned.t, r.turned.body("load").v
    for begin, end in r.dead:
        assert set(w[(t >= begin) & (t <= end)].tolist()) == {0.0}
    gear = r.turned.contact("gear")  # the flank lets go before the gap opens
    row = np.flatnonzero(gear.t == r.dead[0, 0])[-1]
    assert gear.x[row] == approx(0.02 + 0.4 * 0.05 / 200.0, rel=1e-9)


def test_shafts_have_a_common_speed_once_the_clutch_closes(ran: Ran) -> None:
    trace = ran(9).closed
    one, two = (trace.body(name).v for name in ("one", "two"))
    closed = trace.states[:, 0] == "engaged"
    assert trace.transitions.t.tolist() == approx([1.0], abs=1e-15)  # within a tick
    assert closed.any()
    assert (one[closed] == two[closed]).all()
    close(one[closed], 10 / 3, rtol=1e-15)
    close(ran(9).spin, 10.0, rtol=1e-15)


# ------------------------------------------------------------------ 10: which model
SHOWN = {  # "+" shows, "-" does not show, "!" shows wrongly; in the order of PHENOMENA
    "stiction": "--+-+",
    "lugre": "+-!++",
    "elasto-plastic": "+-+++",
    "gms-signed": "+++++",
    "gms-published": "+-++!",
}
LOOP = "width of the inner loop at F = 0"


@pytest.mark.matrix
def test_verdicts_follow_from_numbers_far_from_their_limits(ran: Ran) -> None:
    r, signs = ran(10), {"shows": "+", "does not show": "-", "shows wrongly": "!"}
    assert r.states == dict(zip(l10.MODELS, (0, 1, 1, 4, 4), strict=True))
    assert (r.limits["drift"], r.limits["lag"]) == approx((0.015, 7.5))  # µm, mN
    for model in l10.MODELS:
        verdicts = (r.table.cell(model, name).verdict for name in l10.PHENOMENA)
        assert "".join(signs[each] for each in verdicts) == SHOWN[model]
        drift, fall, made, gap = (
            r.number(model, name) for name in ("drift", "break-away", "passivity", "memory")
        )
        lag = r.number(model, "lag", "width of the loop at 25 rad/s")
        assert (drift > 100 * 0.015) if model == "lugre" else (abs(drift) < 0.01 * 0.015)
        assert (lag > 4 * 7.5) == (r.states[model] > 0)
        assert (fall < 1e-6) if model == "stiction" else (fall > 10 * r.limits["break-away"])
        assert (made > 1.0) if model == "gms-published" else (made == 0.0)  # mJ
        assert (gap > 30) if model in ("lugre", "elasto-plastic") else (gap < 0.01)  # %
    loops = {model: r.number(model, "memory", LOOP) for model in l10.MODELS}  # µm
    assert loops["gms-signed"] > 10  # without a loop no gap is no memory
    assert (loops["stiction"], loops["gms-published"]) == approx((0.0, 0.0), abs=1e-3)
    taken = r.number("gms-published", "passivity", "energy taken in all cycles")
    assert taken == approx(-r.number("gms-published", "passivity"), rel=1e-3)  # more than it takes
    slow = r.number("lugre", "break-away", "break-away force at 0.1 N/s")
    assert slow == approx(l10.BENCH.F_s, rel=0.01)


def test_the_smallest_model_that_will_do(ran: Ran) -> None:
    for wanted, model in (
        ([], "stiction"),
        (["drift"], "stiction"),
        (["drift", "lag"], "elasto-plastic"),
        (["break-away"], "elasto-plastic"),  # not LuGre, which drifts
        (["memory"], "gms-signed"),
        (l10.PHENOMENA, "gms-signed"),
        (["stick-slip"], ""),  # not measured here
    ):
        assert ran(10).choice(wanted) == model, wanted
    one = GMS(bench_bank(l10.BENCH, 1), law="signed")
    found = measure_phenomena({"one": one}, ["memory"]).cell("one", "memory")
    assert (found.verdict, found.said) == ("does not show", "there is no inner loop")
    for model, trace in ran(10).nested.items():  # the replayed runs are those of the table
        curve = ran(10).table.cell(model, "memory").curves[0]
        np.testing.assert_array_equal(1e6 * trace.x, curve.x, strict=True)


# ------------------------------------------------------------------ 11: what a record can tell
@pytest.mark.matrix
def test_an_excellent_fit_does_not_know_a_threshold_that_is_not_reached(ran: Ran) -> None:
    r = ran(11)
    slipped = [{*trace.transitions.element.tolist()} for trace in r.replayed.values()]
    assert slipped == [{0}, {0, 1}]
    assert r.on_sine.training["r2"] > 0.9995
    assert r.on_sine.open == ("weights2",)
    assert r.on_sine.never_slipped == (2,)
    assert r.on_sine["weights2"].value == approx(l11.START[3])  # where it began
    assert r.unseen == 0.0
    truth = l11.force(l11.bank(l11.TRUTH), l11.sine())
    for factor, seen in ((1.01, False), (0.99, True)):
        numbers = [*l11.TRUTH[:3], factor * r.least]
        assert (abs(l11.force(l11.bank(numbers), l11.sine()) - truth).max() > 1e-3) == seen


@pytest.mark.parametrize(
    ("amplitude", "second", "opened"),
    [
        (220e-6, 200e-6, ("weights2",)),
        (260e-6, 200e-6, ()),
        (300e-6, 300e-6, ()),  # there it never slips; looking for the interval finds the way
    ],
)
def test_it_is_the_amplitude_and_not_the_start(
    amplitude: float, second: float, opened: tuple[str, ...]
) -> None:
    """Element 2 slips at a reversal beyond F_s / F_c times 200 µm."""
    pytest.importorskip("llvmlite", reason="fits take long without machine code")
    record = l11.recorded(l11.sine(amplitude), 0.0, 1)
    found = l11.fitted(record, l11.bank([*l11.START[:3], second]))
    assert found.open == opened
    if not opened:
        assert found.training["rmse"] == approx(l11.NOISE, rel=0.05)
        assert found["weights2"].low < l11.TRUTH[3] < found["weights2"].high


def test_intervals_hold_the_truth_and_rows_are_not_counted(ran: Ran) -> None:
    r, a = ran(11), l11.CORRELATION
    assert r.designed.open == r.designed.never_slipped == ()
    assert r.hits == 4
    found = {
        kind: [r.values[kind][name] for name in l11.NAMES] for kind in ("designed", "correlated")
    }
    close([each.value for each in found["designed"]], l11.TRUTH, rtol=0.005)
    for each, true in zip(found["correlated"], l11.TRUTH, strict=True):
        assert each.low < true < each.high
    assert r.designed.effective_rows == approx(r.rows, rel=0.1)
    assert r.correlated.effective_rows == approx(r.rows * (1 - a) / (1 + a), rel=0.5)
    assert r.correlated.training["rmse"] == approx(l11.NOISE, rel=0.15)
    # With independent noise the textbook is right; with correlated noise it is too short.
    tabled = [0.5 * (each.high - each.low) / each.value for each in found["designed"]]
    close(tabled, 1.96 * r.designed.training["rmse"] * r.unit, rtol=0.25)
    assert r.too_short == approx(np.sqrt((1 + a) / (1 - a)), rel=0.3)
    assert 0.2 < r.coverage[0] < 0.6
    assert 0.93 <= r.coverage[1] <= 1.0
    # Repeated records need no fit: the derivatives at the truth predict what it finds.
    off = np.linalg.pinv(r.slopes) @ l11.noise(r.rows, a, 3)
    close(np.log([each.value for each in found["correlated"]] / l11.TRUTH), off[:4], atol=5e-4)


@pytest.mark.parametrize("correlation", [0.0, l11.CORRELATION])
def test_noise_has_the_size_and_the_correlation_it_is_said_to_have(correlation: float) -> None:
    made = l11.noise(200_000, correlation, 0)
    assert np.std(made) == approx(l11.NOISE, rel=0.03)
    assert np.corrcoef(made[1:], made[:-1])[0, 1] == approx(correlation, abs=0.01)


def test_only_the_product_of_scale_and_weights_is_told(ran: Ran) -> None:
    r, motion = ran(11), l11.sine(4e-4)
    one, other = (l11.moved(l11.bank(l11.TRUTH, scale), motion).F for scale in (1.0, 4.0))
    close(other, one, rtol=1e-9, atol=1e-12)
    (low, w_low), (high, w_high) = r.found
    assert high > 2.0 * low
    assert low * w_low == approx(high * w_high, rel=1e-4)
    for each in r.products:
        assert {"weights1", "weights2", "F_c"} <= {*each.open}
        assert each["k1"].told
    assert r.weakest.endswith(" N")
    assert all(name in r.weakest for name in ("F_c", "weights1", "weights2"))


# ------------------------------------------------------------------ 12: what runs have not tried
@pytest.mark.matrix
def test_runs_by_hand_take_all_edges_and_miss_a_lost_sign(ran: Ran) -> None:
    r = ran(12)
    assert (r.edges_taken, r.with_third, r.runs_that_differ) == (2, 3, 0)
    waved = r.traces["to and fro"]
    at = waved.transitions.v[waved.transitions.edge == l12.EDGE]
    close(at, -0.1, atol=0.005)  # as the page says
    edge = r.counts.edge(l12.EDGE, "stick")
    assert {vector for vector in edge.asked if vector[0] == "1"} == {"11"}  # v was never asked
    assert (r.decided, r.undecided) == (1, 3)


def test_generated_motions_see_what_the_copy_does(ran: Ran) -> None:
    r = ran(12)
    assert r.generated.unreached == ()
    assert {each.percent for each in r.generated.coverage.scores.values()} == {100.0}
    assert 0 < r.telling < r.motions
    assert (r.v, r.slips_at_rest) == (-l12.V_C, "copy")


@pytest.mark.parametrize("share", [-3.0, -1.001, -1.0, 0.0, 0.999, 1.0, 3.0])
def test_only_between_the_two_speeds_the_copy_slips_alone(share: float) -> None:
    original, copy = (len(each.transitions) for each in l12.begun(share * l12.V_C).values())
    assert bool(original) == (share < -1.0)
    assert bool(copy) == (share < 1.0)


# ------------------------------------------------------------------ 13: the violin
def test_what_the_bow_puts_in_is_what_the_damping_takes(ran: Ran) -> None:
    r = ran(13)
    damped = l13.DAMPING * r.v**2
    close(np.sum(0.5 * (damped[1:] + damped[:-1]) * np.diff(r.fine.t)), r.sound, rtol=0.01)
    assert r.cycle.stable
    assert r.pitches == sorted(r.pitches, reverse=True)
