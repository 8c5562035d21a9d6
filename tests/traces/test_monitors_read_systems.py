"""Monitors of a system name their contact; each says in one sentence why it does not apply."""

from __future__ import annotations

import pytest

from gms_fsm import Body, Chart, Contact, Prescribed, State, System, Trace, Transition, simulate
from gms_fsm.systems.mounted import mounted
from gms_fsm.traces.failures import LivelockError
from gms_fsm.traces.monitors import CoverageMonitor, Invariant, Passivity, checked, examine
from gms_fsm.traces.verdicts import ChatteringVerdict, CoverageVerdict, PassivityVerdict
from tests.helpers import stick_slip
from tests.systems_cases import CASES, DRY, STICTION


def mixed(v: str = "w2") -> System:
    """A pulled mass with stiction, and a second mass on a GMS bank."""
    return System(
        "mixed",
        bodies=(
            Body("one", inertia=1.0, force="2 * (0.1 * t - q1)", x="q1", v="w1"),
            Body("two", inertia=1.0, force="sin(t)", x="q2", v="w2"),
        ),
        contacts=(
            Contact("pad", STICTION, DRY, v="w1"),
            Contact("bank", stick_slip("signed"), v=v),
        ),
    )


def run(monitors: list[str], t_end: float = 9.0) -> Trace:
    return simulate(mixed(), t_end, monitors=monitors, engine="ifelse")


KINDS = ("chattering", "passivity", "coverage")


def test_one_contact_is_chosen_by_text_or_field_and_all_stands_for_each() -> None:
    every = checked(["all"], mounted(mixed()))
    assert list(every) == [f"{c}: {kind}" for c in ("pad", "bank") for kind in KINDS]
    found = checked(["bank: all", CoverageMonitor("pad"), "pad: F < 2"], mounted(mixed()))
    assert [*found] == [
        *(f"bank: {kind}" for kind in KINDS),
        "pad: coverage",
        "pad: F < 2",
    ]
    assert found["pad: F < 2"] == Invariant("F < 2", "pad")
    assert found["bank: passivity"] == Passivity(contact="bank")


def test_with_one_contact_names_are_as_for_a_model() -> None:
    case = CASES["pulled_mass"]()
    trace = simulate(case.system, 9.0, monitors=["all", "abs(F) <= 1.5", "x < 0.4"])
    assert list(trace.monitors) == [*KINDS, "abs(F) <= 1.5", "x < 0.4"]
    assert trace.monitors["x < 0.4"].ok is False


def test_an_invariant_of_the_system_is_located() -> None:
    found = run(["q1 + bank.F < 1 and pad.state == stuck"]).monitors
    (verdict,) = found.values()
    assert not verdict.ok
    assert verdict.text.startswith("first broken at t = ")
    pulled = run(["pad.F <= 1.2"]).monitors["pad.F <= 1.2"]
    # F = K V t while stuck, with K V = 0.2 N/s
    assert getattr(pulled, "t", None) == pytest.approx(6.0, abs=1e-9)


def test_numbers_of_an_invariant_may_have_units() -> None:
    texts = ["pad.F <= 1200 mN", "pad: F <= 1200 mN", "abs(bank.v) < 50 mm/s or t < 3 min"]
    pad, own, bank = run(texts).monitors.values()
    assert getattr(pad, "t", None) == getattr(own, "t", None) == pytest.approx(6.0, abs=1e-9)
    assert bank.ok


def test_clauses_of_locked_states_are_covered() -> None:
    verdict = run(["pad: coverage"]).monitors["pad: coverage"]
    assert isinstance(verdict, CoverageVerdict)
    seen = {(clause.edge, clause.text): (clause.true, clause.false) for clause in verdict.clauses}
    assert seen["release_forward", "F > F_s"] == ((True,), (True,))
    assert seen["release_backward", "F < -F_s"] == ((False,), (True,))
    assert verdict.edges["release_forward"] == (1,)


@pytest.mark.parametrize(
    ("case", "said"),
    [
        (
            "puck",
            "the contact moves by v and w, and only a spring force k * z [+ sigma * dz] along",
        ),
        ("pulled_mass", "F depends on the state (F_c + b * v or -F_c + b * v), and only a spring"),
        ("gear_box", "F = 0 is not a spring force k * z [+ sigma * dz]"),
    ],
)
def test_where_passivity_does_not_apply_it_says_why(case: str, said: str) -> None:
    chosen = CASES[case]()
    trace = simulate(chosen.system, 0.2, initial=dict(chosen.initial), engine="ifelse")
    verdict = examine(trace, "passivity")["passivity"]
    assert isinstance(verdict, PassivityVerdict)
    assert (verdict.ok, verdict.applicable) == (True, False)
    assert verdict.text.startswith(f"not applicable: {said}")


def test_a_held_force_is_no_spring_force() -> None:
    trace = simulate(stick_slip("signed"), Prescribed("0.1"), 1.0, events="held", step=0.01)
    assert examine(trace, "passivity")["passivity"].text == (
        "not applicable: the contact has a period, and F is held between ticks, so it is not a "
        "spring force k * z [+ sigma * dz]"
    )


TO_AND_FRO = Chart(
    "to and fro",
    inputs=("x",),
    states=(State("a", outputs={"F": "0"}), State("b", outputs={"F": "0"})),
    transitions=(
        Transition("go", "a", "b", guard="x > 0.1"),
        Transition("back", "b", "a", guard="x > 0.05"),
    ),
)


def test_a_livelock_is_that_of_its_contact() -> None:
    contacts = (Contact("pad", STICTION, DRY, v="w"), Contact("c", TO_AND_FRO, v="v"))
    bodies = (Body("m", inertia=1.0, force="1"), Body("n", inertia=1.0, x="y", v="w"))
    system = System("s", bodies=bodies, contacts=contacts)
    with pytest.raises(
        LivelockError, match=r"c 1 at t = 0\.447.*last by 'back' from b to a"
    ) as got:
        simulate(system, 2.0, monitors=["chattering"], engine="ifelse")
    found = got.value.trace.monitors
    assert [verdict.ok for verdict in found.values()] == [True, False]
    verdict = found["c: chattering"]
    assert isinstance(verdict, ChatteringVerdict)
    assert verdict.livelock
    # A chart without variables: the episode has the velocity alone.
    assert list(verdict.episodes[0].values) == ["v"]
