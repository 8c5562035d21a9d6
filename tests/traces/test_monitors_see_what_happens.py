"""Monitors find chattering and livelock in the log, and the points where invariants break.

Times are checked against closed forms, verdicts at rows against single evaluations, and
invalid monitors are rejected before the run begins.
"""

from __future__ import annotations

import functools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    Prescribed,
    Slider,
    State,
    Stribeck,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.charts.broken import BROKEN
from gms_fsm.language import parse_condition
from gms_fsm.session.explain import holds, values_at
from gms_fsm.systems.mounted import mounted_alone
from gms_fsm.traces.failures import LivelockError, SimulationError
from gms_fsm.traces.monitors import Chattering, CoverageMonitor, Invariant, Passivity, checked
from gms_fsm.traces.verdicts import ChatteringVerdict, InvariantVerdict
from tests.helpers import (
    FIG4_SINE,
    FunctionBelt,
    banging,
    one_element,
    pulled_mass,
    stick_slip,
)

SLOWING = Prescribed("0.2*cos(2*pi*t/20)")


def memoryless(weights: list[float]) -> ChartModel:
    """Guards that negate each other: on z = s both flows push into the other state."""
    return ChartModel(
        BROKEN["memoryless"].chart,
        {"k": 1.0, "sigma": 0.1, "C": 0.1, "v_c": 1e-6},
        n=len(weights),
        stribeck=Stribeck(1.0, 1.5, 0.05),
        weights=np.array(weights),
    )


def blinking(phase: str, t_end: float, monitor: Chattering) -> Trace:
    """Run an element that switches on and off once per 0.1 s of a phase, at known times."""
    chart = Chart(
        "blinker",
        inputs=("t",),
        variables=("z",),
        states=(State("off", flow={"z": "0"}), State("on", flow={"z": "0"})),
        transitions=(
            Transition("rise", "off", "on", guard=f"sin(20*pi*({phase})) > 0"),
            Transition("fall", "on", "off", guard=f"sin(20*pi*({phase})) < 0"),
        ),
        outputs={"F": "z"},
    )
    model = ChartModel(chart, {})
    return simulate(model, Prescribed("0"), t_end, monitors=[monitor], max_step=0.01)


def chattering(trace: Trace) -> ChatteringVerdict:
    found = trace.monitors["chattering"]
    assert isinstance(found, ChatteringVerdict)
    return found


def invariant(trace: Trace, text: str) -> InvariantVerdict:
    found = trace.monitors[text]
    assert isinstance(found, InvariantVerdict)
    assert found.condition == text
    return found


# --------------------------------------------------------------------------- chattering
def test_memoryless_guards_chatter() -> None:
    """Slow enough to make progress, too fast to be intended: a gap of a thousandth."""
    trace = simulate(banging(1e-3), Prescribed("1"), 1.2, monitors=["chattering"])
    found = chattering(trace)
    assert not found.ok
    assert not found.livelock
    (episode,) = found.episodes
    log = trace.transitions
    taken = log[log.edge == "fall"]
    assert (episode.element, episode.edge, episode.back) == (0, "fall", ("rise",))
    assert episode.count == len(taken) > 50
    assert (episode.t_first, episode.t_last) == (taken.t[0], taken.t[-1])
    assert episode.values == {"z": taken.z[0], "v": taken.v[0]}
    for part in (
        "element 1 took fall, and back rise,",
        f"{episode.count} times in ",
        "from t = 1 s",
        "z = 1",
        "[z >= 1]",
        "[z <= 1 - gap]",
        "leave a gap between them",
    ):
        assert part in found.text


@pytest.mark.parametrize(("within", "ok"), [(0.3999, True), (0.4001, False)])
def test_firings_are_counted_within_the_time_window(within: float, ok: bool) -> None:
    """Five rises of a blinker of 0.1 s take 0.4 s."""
    trace = blinking("t", 2.02, Chattering(times=5, within=within))
    assert chattering(trace).ok == ok
    if not ok:
        (episode,) = chattering(trace).episodes
        assert episode.edge in ("rise", "fall")
        assert episode.count == 20 + (episode.edge == "rise")
        assert episode.t_last - episode.t_first == pytest.approx(0.1 * (episode.count - 1))


def test_the_longest_episode_is_reported() -> None:
    """Fast for half a second, slow, fast for a second: the second interval is reported."""
    trace = blinking("min(t, 0.5) + max(0, min(t - 5, 1))", 8.0, Chattering(4, 0.35))
    (episode,) = chattering(trace).episodes
    assert episode.t_first == pytest.approx(5.0, abs=0.11)
    assert episode.count in (9, 10, 11)


def test_a_livelock_is_reported_with_the_partial_trace() -> None:
    with pytest.raises(LivelockError) as caught:
        simulate(memoryless([0.5]), SLOWING, 30.0, monitors=["chattering", "coverage"])
    found = chattering(caught.value.trace)
    assert found.livelock
    assert not found.ok
    assert found.text.startswith(f"livelock: {caught.value}")
    assert found.episodes[0].count >= 49
    assert found.episodes[0].t_last - found.episodes[0].t_first < 1e-9
    assert caught.value.trace.monitors["coverage"].ok


def test_a_livelock_of_a_surface_has_no_edge() -> None:
    chart = Chart("free", ("v",), ("z",), ("k",), (State("on", {"z": "0"}),), (), {"F": "k * z"})
    model = ChartModel(chart, {"k": 0.0})
    with pytest.raises(LivelockError) as caught:
        simulate(model, FunctionBelt(), 5.0, initial={"v": 1.0}, monitors=["chattering"])
    found = chattering(caught.value.trace)
    assert (found.ok, found.livelock, found.episodes) == (False, True, ())


def test_a_slide_is_not_a_livelock() -> None:
    model = one_element("published", F_c=1.0, F_s=1.5, v_s=0.05, C=0.1, sigma=5.0, k=1.0)
    start = {"z": [-2.5], "states": ["slip"], "v": 0.05}
    trace = simulate(model, Slider(1.0, -2.4), 5.0, initial=start, monitors=["chattering"])
    assert len(trace.sliding) == 1
    assert chattering(trace).ok
    assert chattering(trace).text == "no element took an edge 20 times within 0.1 s"


# --------------------------------------------------------------------------- invariants


@pytest.mark.parametrize("times", [None, [0.0, 1.0, 2.0]])
def test_the_first_break_in_stick_is_located(times: list[float] | None) -> None:
    """z = v t crosses 0.1 m at 0.5 s, between two rows."""
    trace = simulate(
        stick_slip("signed"), Prescribed(0.2), 2.0, monitors=["z <= 0.1"], t_eval=times
    )
    found = invariant(trace, "z <= 0.1")
    assert not found.ok
    assert found.t == pytest.approx(0.5, abs=1e-12)
    assert found.element == 0
    assert found.state == "stick"
    assert found.values["z"] > 0.1
    assert found.values == {"z": pytest.approx(0.1)}
    assert found.t_last == trace.t[-1]
    assert 0 < found.broken < found.rows
    for part in ("first broken at t = 0.5 s", "element 1 in stick", "(z = 0.1)", "goto 0.5"):
        assert part in found.text


def test_the_first_break_in_slip_is_located() -> None:
    """z = s (1 - exp(-C t / s)) crosses s / 2 at t = s/C ln 2."""
    model = one_element("signed", F_c=1.0, F_s=1.5, v_s=1e-3, C=0.1, sigma=0.0)
    trace = simulate(
        model,
        Prescribed(0.2),
        20.0,
        monitors=["z <= 0.5*s"],
        rtol=1e-9,
        atol=1e-12,
        initial={"states": ["slip"]},
    )
    found = invariant(trace, "z <= 0.5*s")
    assert found.t == pytest.approx(10.0 * math.log(2.0), abs=1e-6)
    assert found.values["s"] == 1.0


def test_the_element_is_named_but_not_if_it_is_about_the_whole() -> None:
    """The second element has the smallest threshold; a name of one element or of F is the whole."""
    texts = ["z <= 0.3*s", "F <= 0.6 and z2 < 9"]
    trace = simulate(memoryless([1.0, 0.5, 2.0]), Prescribed(0.2), 4.0, monitors=texts)
    found, whole = (invariant(trace, text) for text in texts)
    assert found.element == 1
    assert found.t == pytest.approx(0.15 / 0.2, rel=1e-4)
    assert "element 2 in stick" in found.text
    assert (whole.element, whole.state) == (None, "")
    assert set(whole.values) == {"F", "z2"}


def test_a_break_at_an_edge_is_on_the_row_after_it() -> None:
    """The force steps by sigma (dz - v) at a break-away: there is nothing between the two rows."""
    model = one_element("signed", F_c=1.0, F_s=1.0, sigma=1.0, C=0.1)
    trace = simulate(model, Prescribed(0.2), 8.0, monitors=["F >= 1.1 or z < 0.95"])
    found = invariant(trace, "F >= 1.1 or z < 0.95")
    assert found.t == trace.transitions.t[0]
    assert found.values["F"] == trace.transitions.F_after[0]


def test_invariants_can_test_states() -> None:
    model = one_element("signed", F_c=1.0, F_s=1.0, sigma=1.0, C=0.1)
    texts = ["state == stick", "state(1) != slip", "state == slip or abs(z) <= (1 + 1e-12)*s"]
    trace = simulate(model, Prescribed(0.2), 8.0, monitors=texts)
    own, first, both = (invariant(trace, text) for text in texts)
    assert own.t == first.t == trace.transitions.t[0]
    assert (own.element, own.state, first.element) == (0, "slip", None)
    assert both.ok


CONDITIONS = (
    "z <= 0.999*s or state == slip",
    "exp(-z) < 0.9 and v > 0",
    "1 / (v - 0.15) > z / s",
    "sqrt(z) <= 0.7",
    "(z / s)**2 < 1",
    "z**0.5 < 0.6",
    "z**-1 > k",
    "max(z, v) > min(s, 0.1)",
    "not sin(t) * cos(x) > tanh(z)",
    "exp(1000 * t) > 1",
    "sgn(z - s) < sigma",
    "abs(F) < 1",
    "z1 < z2 or F3 > s4",
    "v <= v_c or -1 < F < C * 10",
    "z**9 < s",
    "1 / z**2 > s",
)


@functools.cache
def watched() -> Trace:
    """Return a run with all these conditions."""
    monitors = list(CONDITIONS)
    return simulate(stick_slip("published"), Prescribed(FIG4_SINE), 30.0, monitors=monitors)


@pytest.mark.parametrize("text", CONDITIONS)
def test_the_verdict_at_a_row_depends_only_on_that_row(text: str) -> None:
    trace = watched()
    found = invariant(trace, text)
    model, n = trace.model, trace.n
    names = ["t", "x", "v", "F", "s", "z", *model.chart.parameter_names]
    names += [f"{name}{i + 1}" for name in ("z", "s", "F") for i in range(n)]
    tree = parse_condition(text, names, ["stick", "slip"], n, own_state=True)
    broken = []
    for row in range(len(trace)):
        values: dict[str, Any] = {"F": trace.F[row]}
        for i in range(n):
            values |= {
                f"z{i + 1}": trace.z[row, i],
                f"s{i + 1}": trace.s[row, i],
                f"F{i + 1}": trace.F_elements[row, i],
            }
        broken.append(
            not all(
                holds(tree, values_at(trace, row, i) | values | {"state(0)": trace.states[row, i]})
                for i in range(n)
            )
        )
    assert found.broken == sum(broken)
    if any(broken):
        first = broken.index(True)
        assert found.t is not None
        assert trace.t[max(0, first - 1)] <= found.t <= trace.t[first]


# --------------------------------------------------------------------------- asking for them
def test_all_means_these_three() -> None:
    model = stick_slip("signed")
    what = mounted_alone(model)
    assert list(checked("all", what)) == ["chattering", "passivity", "coverage"]
    assert checked(["z <= s", CoverageMonitor()], what) == {
        "z <= s": Invariant("z <= s"),
        "coverage": CoverageMonitor(),
    }
    assert checked("passivity", what) == {"passivity": Passivity()}
    assert checked(Chattering(3, 0.5), what) == {"chattering": Chattering(3, 0.5)}


def test_the_log_can_be_monitored_without_rows() -> None:
    trace = simulate(*pulled_mass(), 20.0, output="end", monitors=[Chattering(2, 30.0)])
    assert chattering(trace).episodes


# --------------------------------------------------------------------------- where they are kept


def test_values_that_are_not_finite_survive_a_file(tmp_path: Path) -> None:
    found = InvariantVerdict(
        False, "broken", "z < 1", 2, 1, 0.5, 0, "slip", {"z": math.inf, "s": -math.inf}, 1.0
    )
    trace = simulate(stick_slip("signed"), Prescribed(0.2), 1.0).with_monitors({"z < 1": found})
    for ending in ("npz", "csv"):
        read = Trace.load(trace.save(tmp_path / f"run.{ending}"))
        assert read.monitors == {"z < 1": found}


def test_a_run_that_fails_is_monitored_too() -> None:
    """The velocity has no value after 0.5 s."""
    monitors = ["all", "z <= 0.1"]
    with pytest.raises(SimulationError) as caught:
        simulate(stick_slip("signed"), Prescribed("sqrt(0.5 - t)"), 2.0, monitors=monitors)
    trace = caught.value.trace
    assert 0.3 < trace.t[-1] <= 0.5
    assert list(trace.monitors) == ["chattering", "passivity", "coverage", "z <= 0.1"]
    assert not invariant(trace, "z <= 0.1").ok
    assert chattering(trace).ok
