"""Another slip law, or another number, leaves all else of a system as it was."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gms_fsm import GMS, Body, Chart, ChartModel, Contact, GMSParameters, State, System
from gms_fsm.charts import CHARTS
from gms_fsm.charts.registry import entry
from gms_fsm.inspection.session import Session
from gms_fsm.systems.models import demonstration
from gms_fsm.systems.numbers import Adjustable
from tests.helpers import FASTEST

STICTION = {"F_c": 1.0, "F_s": 1.5, "b": 0.1}


def bank(law: Any = "signed") -> GMS:
    return GMS(GMSParameters.paper("stick-slip"), law=law)


def several() -> System:
    """Return four contacts: with a load of its own, a period, a geared velocity, numbers alone."""
    loaded = demonstration(entry("modelica"))
    assert loaded.inputs
    return System(
        "several",
        bodies=(Body("a", inertia="m", force="f", x="x_a", v="v_a"),
                Body("b", inertia=2.0, force="-x_b", x="x_b", v="v_b")),
        contacts=(
            Contact("ground", bank(), v="v_a"),
            Contact("pad", loaded, v="v_b", inputs=dict.fromkeys(loaded.inputs, "10 + load")),
            Contact("gear", bank(), v="v_b - ratio * v_a", period=0.01),
            Contact("stop", CHARTS["stiction"], STICTION, v="2 * v_b"),
        ),
        numbers={"m": 1.0, "f": 3.0, "ratio": 3.0, "load": 1.0},
    )  # fmt: skip


WHOLE = Adjustable(several())


def rest_of(contact: Contact) -> tuple[Any, ...]:
    return contact.name, contact.v, contact.n, dict(contact.inputs), contact.period


def numbers_of(what: Adjustable) -> dict[str, list[float]]:
    return {name: np.ravel(what.value(name)).tolist() for name in what.known}


def same(one: Adjustable, other: Adjustable) -> bool:
    assert isinstance(one.what, System)
    assert isinstance(other.what, System)
    assert one.what.bodies == other.what.bodies
    return [*map(rest_of, one.what.contacts)] == [*map(rest_of, other.what.contacts)]


@given(st.sampled_from([*WHOLE.known]), st.floats(1.0, 1.1))
def test_one_number(name: str, factor: float) -> None:
    value = np.asarray(WHOLE.value(name)) * factor
    varied = WHOLE.varied({name: value})
    assert numbers_of(varied) == numbers_of(WHOLE) | {name: np.ravel(value).tolist()}
    assert same(varied, WHOLE)


def test_another_law() -> None:
    lawful = WHOLE.with_law("published")
    assert lawful.law == "published"
    assert numbers_of(lawful) == numbers_of(WHOLE)
    assert same(lawful, WHOLE)
    assert isinstance(lawful.what, System)
    assert [each.chart.name == was.chart.name
            for each, was in zip(lawful.what.contacts, several().contacts, strict=True)
            ] == [False, True, False, True]  # fmt: skip


@pytest.mark.slow
def test_the_load_of_another_contact_in_a_fork_with_another_law() -> None:
    """The model brings a load of its own; the contact's is 10."""
    chart = Chart("dry", inputs=("v", "N"), variables=(), parameters=(), transitions=(),
                  states=(State("slide"),), outputs={"F": "0.3 * N"})  # fmt: skip
    model = ChartModel(chart, {}, inputs={"N": "5"})
    system = System(
        "two",
        bodies=(Body("a", velocity="2 + sin(t)", x="x_a", v="v_a"),),
        contacts=(
            Contact("pad", model, v="v_a", inputs={"N": "10"}),
            Contact("gms", bank(), v="v_a"),
        ),
    )
    session = Session(system, 1.0, engine=FASTEST)
    session.fork(law="published")
    before, after = (session.tree.trace(k).contact("pad").F[-1] for k in (0, 1))
    assert before == after == 3.0
