"""Charts that lock, or read F and a, are proved or refuted; each counterexample is real.

A point that refutes is followed by a short step, and by a run of the same chart.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest

pytest.importorskip("z3", reason="needs z3 (extra: check)")

from gms_fsm import (
    Chart,
    ChartModel,
    Finding,
    LivelockError,
    Parameter,
    PulledSlider,
    Slider,
    State,
    Transition,
    prove,
    simulate,
)
from gms_fsm.charts import CHARTS
from gms_fsm.verification.prove import Check, default_domain

NEW = ("stiction", "backlash", "end-stop", "dog-clutch")
STICTION = CHARTS["stiction"]
NUMBERS = {"F_c": 1.0, "F_s": 1.5, "b": 0.0}


def only(chart: Chart, check: Check, domain: tuple[str, ...] | None = None) -> list[Finding]:
    """Return the refuted findings, which belong to this check."""
    found = prove(chart, domain).refuted
    assert {finding.check for finding in found} == {check}
    return list(found)


# --------------------------------------------------------------------------- the charts that ship
@pytest.mark.parametrize("name", NEW)
def test_the_charts_that_ship_are_proved(name: str) -> None:
    report = prove(CHARTS[name])
    assert {finding.status for finding in report.findings} == {"proved"}
    assert report.of("release")


@pytest.mark.slow
def test_the_assumptions_are_the_rules_and_the_inertia() -> None:
    assert prove(CHARTS["lugre"]).of("release") == ()  # it has no locks
    assert default_domain(STICTION) == ("F_c > 0", "F_s >= F_c", "b >= 0")
    assert prove(STICTION).domain == ("F_c > 0", "F_s >= F_c", "b >= 0", "W > 0")
    assert "a = (H - F) W while the contact moves" in str(prove(STICTION))


@pytest.mark.slow
def test_the_force_of_a_locked_state_is_the_load() -> None:
    """F > F_s holds in the locked state only where the load H is larger than F_s."""
    double = replace(
        STICTION,
        transitions=(
            Transition("first", "stuck", "forward", guard="F > F_s"),
            Transition("second", "stuck", "backward", guard="F > 2 * F_s"),
            Transition("back", ("forward", "backward"), "stuck", guard="v < 0 and F < 0"),
        ),
    )
    (settled,) = prove(double).settled
    point = settled.counterexample
    assert point["H"] > 2 * point["F_s"]
    hidden = [f for f in prove(double).refuted if f.where == ("second",)]
    assert "earlier edge takes precedence (first)" in hidden[0].text


# --------------------------------------------------------------------------- release
def acceleration(chart: Chart, state: str, point: Mapping[str, float]) -> float:
    """Return (H - F) W at v = 0, where the force of the state is +-F_c."""
    sign = {"forward": 1.0, "backward": -1.0}[state]
    return (point["H"] - sign * point["F_c"]) * point["W"]


@pytest.mark.slow
def test_a_stiction_below_coulomb_friction_is_pushed_back_at_once() -> None:
    domain = ("F_c > 0", "F_s > 0", "b >= 0")
    found = only(STICTION, "release", domain)
    assert [f.where for f in found] == [
        ("stuck", "release_forward", "forward", "arrest_forward"),
        ("stuck", "release_backward", "backward", "arrest_backward"),
    ]
    for finding, sign in zip(found, (1, -1), strict=True):
        point = finding.counterexample
        assert sign * point["H"] > point["F_s"]  # it lets go
        assert sign * acceleration(STICTION, finding.where[2], point) < 0  # and is pushed back
        assert point["v"] == 0


@pytest.mark.slow
def test_a_run_at_the_counterexample_switches_without_end() -> None:
    rule = Parameter("F_s", "N", "> 0", per_element=False)
    loose = replace(
        STICTION,
        parameters=tuple(rule if p.name == "F_s" else p for p in STICTION.parameters),
    )
    (finding, _) = only(loose, "release")
    point = finding.counterexample
    numbers = {name: point[name] for name in ("F_c", "F_s")} | {"b": 0.0}
    with pytest.raises(LivelockError):
        simulate(ChartModel(loose, numbers), Slider(1 / point["W"], repr(point["H"])), 1.0)


def test_a_stop_that_lets_go_while_pushed_is_refuted() -> None:
    stop = CHARTS["end-stop"]
    early = replace(
        stop,
        transitions=(
            *stop.transitions[:2],
            Transition("lift", "rest", "free", guard="F < 1"),
        ),
    )
    (finding,) = only(early, "release")
    assert finding.where == ("rest", "lift", "free", "settle")
    point = finding.counterexample
    assert 0 < point["H"] < 1  # still pushed against the stop
    assert point["x"] >= point["x_s"]


def test_a_jump_at_rest_is_left_undecided() -> None:
    """sgn(v) is 0 at v = 0 only, so the force just after the release is not that at the point."""
    jumping = Chart(
        "one moving state",
        parameters=STICTION.parameters,
        states=(State("stuck", locked=True), State("moving", outputs={"F": "F_c * sgn(v)"})),
        transitions=(
            Transition("go", "stuck", "moving", guard="abs(F) > F_s"),
            Transition("hold", "moving", "stuck", guard="v < 0"),
        ),
    )
    (finding,) = prove(jumping).of("release")
    assert finding.status == "undecided"


# --------------------------------------------------------------------------- the other checks
def test_an_impact_without_loss_of_direction_livelocks() -> None:
    stop = CHARTS["end-stop"]
    wrong = replace(
        stop,
        transitions=(
            Transition("bounce", "free", "free", guard="x >= x_s and v > v_r", actions={"v": "v"}),
            *stop.transitions[1:],
        ),
    )
    (finding,) = only(wrong, "livelock")
    assert finding.where == ("free", "bounce")
    point = finding.counterexample
    assert point["x"] >= point["x_s"]
    assert point["v"] > point["v_r"]


@pytest.mark.slow
def test_closed_guards_on_the_lock_livelock_at_rest() -> None:
    """With v <= 0 a contact that has just let go, at v = 0, is locked again: at one point."""
    closed = replace(
        STICTION,
        transitions=(
            *STICTION.transitions[:2],
            Transition("arrest_forward", "forward", "stuck", guard="v <= 0"),
            STICTION.transitions[3],
        ),
    )
    report = prove(closed)
    assert {f.check for f in report.refuted} == {"livelock", "release"}
    (finding,) = [f for f in report.refuted if f.check == "livelock"]
    assert finding.counterexample["H"] > finding.counterexample["F_s"]
    assert finding.counterexample["v"] == 0
    with pytest.raises(LivelockError):
        simulate(ChartModel(closed, NUMBERS), PulledSlider(1.0, 2.0, 0.1), 20.0)


def test_a_flank_that_pulls_chatters() -> None:
    """Contact by position alone, with a force that pulls: both flows lead back to the surface."""
    pulling = Chart(
        "gap with adhesion",
        inputs=("x", "v"),
        parameters=(Parameter("F_a", "N", "> 0"), Parameter("F_b", "N", "> 0")),
        states=(State("out", outputs={"F": "F_a"}), State("in_", outputs={"F": "-F_b"})),
        transitions=(
            Transition("slow", "in_", "out", guard="v > 0 and a > 0"),
            Transition("fast", "out", "in_", guard="v < 0 and a < 0"),
        ),
    )
    (finding,) = only(pulling, "chattering")
    point = finding.counterexample
    assert point["v"] == 0
    assert (point["H"] - point["F_a"]) * point["W"] < 0 < (point["H"] + point["F_b"]) * point["W"]


@pytest.mark.slow
def test_named_expressions_are_expanded() -> None:
    named = replace(
        STICTION,
        let={"limit": "F_s + 0 * v", "slack": "limit - F"[:5]},
        transitions=(
            Transition("release_forward", "stuck", "forward", guard="F > slack"),
            *STICTION.transitions[1:],
        ),
    )
    assert {f.status for f in prove(named).findings} == {"proved"}


def test_time_in_a_state_ends_a_cycle() -> None:
    """after(T) cannot hold again at once: the time in the state starts anew."""

    def pulsing(guard: str) -> Chart:
        return Chart(
            "pulse",
            parameters=(Parameter("T", "s", "> 0"),),
            states=(State("off", outputs={"F": "0"}), State("on", outputs={"F": "1"})),
            transitions=(
                Transition("rise", "off", "on", guard=guard),
                Transition("fall", "on", "off", guard=guard),
            ),
        )

    assert {f.status for f in prove(pulsing("after(T)")).of("livelock")} == {"proved"}
    assert {f.status for f in prove(pulsing("True")).of("livelock")} == {"refuted"}


def test_several_velocities_leave_the_acceleration_undecided() -> None:
    planar = Chart(
        "planar",
        inputs=(),
        velocities=("v", "w"),
        parameters=(Parameter("F_s", "N", "> 0"),),
        states=(
            State("stuck", locked=True),
            State("moving", outputs={"F": "F_s * v", "F_w": "F_s * w"}),
        ),
        transitions=(
            Transition("go", "stuck", "moving", guard="F**2 + F_w**2 > F_s**2"),
            Transition("hold", "moving", "stuck", guard="v**2 + w**2 < 1 and a < 0"),
        ),
    )
    report = prove(planar)
    assert report.refuted == ()
    assert "several velocities" in report.of("release")[0].text
    assert {f.status for f in report.findings if f.where == ("go",)} == {"proved"}


def test_an_edge_that_locks_from_one_state_is_no_arrest_from_another() -> None:
    """From `a`, which is locked, `lock` hides `hidden`: no velocity passes 0 there."""
    chart = Chart(
        "two locks",
        inputs=("v",),
        parameters=("F_c",),
        states=(
            State("a", locked=True),
            State("b", locked=True),
            State("slip", outputs={"F": "F_c"}),
        ),
        transitions=(
            Transition("lock", ("slip", "a"), "b", "v >= 0"),
            Transition("hidden", "a", "slip", "v >= 0"),
        ),
    )
    (found,) = (each for each in prove(chart).of("reachability") if each.where == ("hidden",))
    assert found.status == "refuted"
    assert "(lock)" in found.text
