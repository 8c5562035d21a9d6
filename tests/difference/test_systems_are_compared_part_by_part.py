"""Claim: of systems charts are compared by meaning, numbers by value, the rest by its texts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from gms_fsm import (
    Body,
    Chart,
    Contact,
    Sampled,
    Spring,
    State,
    Supervisor,
    System,
    diff,
    simulate,
)
from gms_fsm.app._own_files import own_file
from gms_fsm.charts import CHARTS
from gms_fsm.scenarios import shipped

WITH_DATA = {"tribometer"}  # needs a record of others
VALUES = {"F_c": 1.0, "F_s": 1.5, "b": 0.0}


def system(
    force: str = "2 * t", m: float = 1.0, *, contacts: tuple[str, ...] = ("pad",), **more: Any
) -> System:
    """Return a mass on one or more pads."""
    pads = tuple(
        Contact(name, more.get("chart", CHARTS["stiction"]), more.get("values", VALUES),
                period=more.get("period"))
        for name in contacts
    )  # fmt: skip
    mass = Body("mass", inertia="m", force=force)
    return System("one", bodies=(mass,), contacts=pads, numbers={"m": m})


@pytest.mark.parametrize("name", sorted(set(shipped()) - WITH_DATA))
def test_a_shipped_system_is_equal_to_itself(name: str) -> None:
    own = own_file(name)
    assert own is not None
    assert own.system is not None
    assert diff(own.system, own.system).verdict == "equal"


@pytest.mark.parametrize(
    ("other", "verdict", "part"),
    [
        (system(m=2.0), "different", "number"),
        (system(values=VALUES | {"F_s": 2.0}), "different", "number"),
        (system(period=0.01), "different", "period of"),
        (system(contacts=("shoe", "other")), "different", "contact"),
        (system("t * 2"), "undecided", "body"),
    ],
    ids=["number", "parameter", "period", "contacts", "text"],
)
def test_what_differs_decides(other: System, verdict: str, part: str) -> None:
    found = diff(system(), other)
    assert found.verdict == verdict
    assert part in {each.part for each in found.changes}


def test_a_contact_may_have_another_name_if_it_is_the_only_one() -> None:
    found = diff(system(), system(contacts=("shoe",)))
    assert str(found).splitlines()[1:] == [
        "  = contact pad is called shoe",
        "equivalent: only names differ",
    ]


def test_of_several_contacts_a_change_names_its_own() -> None:
    two = system(contacts=("pad", "shoe"))
    changed = two.contacts[1].with_values({"F_s": 2.0})
    found = diff(two, replace(two, contacts=(two.contacts[0], changed)))
    assert [(each.part, each.name) for each in found.changes] == [("number", "shoe.F_s")]


IDLE = Supervisor("idle", Chart("idle", inputs=(), velocities=(), states=(State("one"),)))
FIRST = Sampled("A", period=0.1, updates={"u": "u + 1"})
SECOND = Sampled("B", period=0.1, updates={"z": "10 * u"})


def sampled(*parts: Sampled, **more: Any) -> System:
    return System("s", supervisors=(IDLE,), sampled=parts, **more)


def test_the_order_of_samplers_is_not_called_equal() -> None:
    found = diff(sampled(FIRST, SECOND), sampled(SECOND, FIRST))
    assert str(found).splitlines()[1:] == [
        "  ~ order of sampled: A, B -> B, A",
        "undecided: the order may make a difference: order of sampled",
    ]


def test_runs_prove_that_the_order_of_samplers_makes_a_difference() -> None:
    runs = [simulate(sampled(*each), 1.0) for each in ((FIRST, SECOND), (SECOND, FIRST))]
    assert diff(*runs).verdict == "different"


@pytest.mark.parametrize("kind", ["contacts", "bodies", "springs", "supervisors"])
def test_another_order_of_parts_is_not_called_equal(kind: str) -> None:
    bodies = tuple(Body(n, inertia=1.0, x=f"x_{n}", v=f"v_{n}") for n in ("p", "q"))
    parts: dict[str, tuple[Any, ...]] = {
        "bodies": bodies,
        "contacts": tuple(
            Contact(f"on_{n}", CHARTS["stiction"], VALUES, v=f"v_{n}") for n in ("p", "q")
        ),
        "springs": tuple(Spring(f"to_{n}", n, k=1.0) for n in ("p", "q")),
        "supervisors": (IDLE, Supervisor("other", IDLE.chart)),
    }
    one = System("s", **parts)
    found = diff(one, System("s", **(parts | {kind: parts[kind][::-1]})))
    assert found.verdict == "undecided"
    assert [(each.part, each.name) for each in found.changes] == [("order of", kind)]


def test_a_system_with_another_name_only_is_equivalent() -> None:
    found = diff(system(), replace(system(), name="two"))
    assert str(found).splitlines()[1:] == [
        "  = system one is called two",
        "equivalent: only names differ",
    ]


def test_a_signal_is_shown_by_its_text() -> None:
    one, other = (sampled(FIRST, signals={"w": text}) for text in ("sin(t)", "cos(t)"))
    assert "  ~ signal w: sin(t) -> cos(t)" in str(diff(one, other)).splitlines()


def test_a_spring_is_shown_by_what_differs() -> None:
    one, other = (
        replace(system(), springs=(Spring("pulled", "mass", k=k, rest="t"),)) for k in (1.0, 2.0)
    )
    assert "  ~ spring pulled: k: 1 -> k: 2" in str(diff(one, other)).splitlines()


def test_a_sampler_is_shown_by_the_updates_that_differ() -> None:
    one, other = (
        sampled(Sampled("A", period=0.1, updates={"u": "u + 1", "w": text})) for text in "12"
    )
    line = "  ~ sampler A: updates: w = 1 -> updates: w = 2"
    assert line in str(diff(one, other)).splitlines()


def test_numbers_that_differ_look_different() -> None:
    found = diff(system(m=1.0), system(m=1.0 + 2**-52))
    assert "  ~ number numbers.m: 1 -> 1.0000000000000002" in str(found).splitlines()
