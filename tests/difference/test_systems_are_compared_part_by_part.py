"""Claim: of systems charts are compared by meaning, numbers by value, the rest by its texts."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from gms_fsm import Body, Contact, System, diff
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
    assert diff(system(), system(contacts=("shoe",))).verdict == "equal"


def test_of_several_contacts_a_change_names_its_own() -> None:
    two = system(contacts=("pad", "shoe"))
    changed = two.contacts[1].with_values({"F_s": 2.0})
    found = diff(two, replace(two, contacts=(two.contacts[0], changed)))
    assert [(each.part, each.name) for each in found.changes] == [("number", "shoe.F_s")]
