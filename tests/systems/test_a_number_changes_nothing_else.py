"""Another slip law, or another number, leaves all else of a system as it was."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    LuGre,
    Prescribed,
    Slider,
    State,
    Stribeck,
    System,
    Transition,
)
from gms_fsm.charts import CHARTS
from gms_fsm.charts.registry import entry
from gms_fsm.session.session import Session
from gms_fsm.systems.models import demonstration
from gms_fsm.systems.mounted import Mounted, mounted
from gms_fsm.systems.numbers import known_in, law_of, value_in, varied, with_law
from gms_fsm.systems.parts import Sampled
from gms_fsm.systems.rigs import TextRig

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


WHOLE = mounted(several())


def rest_of(contact: Contact) -> tuple[Any, ...]:
    return contact.name, contact.v, contact.n, dict(contact.inputs), contact.period


def numbers_of(what: Mounted) -> dict[str, list[float]]:
    return {name: np.ravel(value_in(what, name)).tolist() for name in known_in(what)}


def same(one: Mounted, other: Mounted) -> bool:
    assert one.system.bodies == other.system.bodies
    return [*map(rest_of, one.system.contacts)] == [*map(rest_of, other.system.contacts)]


@given(st.sampled_from([*known_in(WHOLE)]), st.floats(1.0, 1.1))
def test_one_number(name: str, factor: float) -> None:
    value = np.asarray(value_in(WHOLE, name)) * factor
    other = varied(WHOLE, {name: value})
    assert numbers_of(other) == numbers_of(WHOLE) | {name: np.ravel(value).tolist()}
    assert same(other, WHOLE)


@given(st.sampled_from([*known_in(WHOLE)]), st.sampled_from([1.0, 1.05]))
def test_systems_are_equal_whose_numbers_are(name: str, factor: float) -> None:
    one, two = (
        varied(mounted(several()), {name: np.asarray(value_in(WHOLE, name)) * factor}).system
        for _ in range(2)
    )
    assert one == two
    assert hash(one) == hash(two)
    assert (one == WHOLE.system) == (factor == 1.0 or not np.any(value_in(WHOLE, name)))


@pytest.mark.parametrize(
    "make",
    [
        lambda k: GMS(GMSParameters.paper("stick-slip").replaced(k=[k, 1, 1, 1]), law="signed"),
        lambda k: LuGre(sigma_0=k, sigma_1=1, sigma_2=0, stribeck=Stribeck(1, 1.5, 1e-3)),
        lambda k: ChartModel(CHARTS["stiction"], STICTION | {"F_s": k}),
        lambda k: Prescribed([(0, 0), (1, k)]),
        lambda k: Slider(1.0, (np.arange(2.0), np.array([0, k]))),
        lambda k: TextRig("pushed", "(P - F) / m", {"P": "sin(t)"}, {"m": k}),
        lambda k: State("stick", flow={"z": f"{k} * v"}),
        lambda k: Transition("slips", ("stick", "hold"), "slip", guard=f"z > {k}"),
    ],
)
def test_parts_are_equal_whose_values_are(make: Any) -> None:
    assert make(2.0) == make(2.0) != make(3.0)
    assert len({make(2.0), make(2.0), make(3.0)}) == 2


def test_updates_of_a_sampler_in_another_order_are_another_sampler() -> None:
    one, other = (
        Sampled("pid", period=1e-3, updates=dict(updates))
        for updates in itertools.permutations([("u", "w"), ("w", "u")])
    )
    assert one != other


def test_another_law() -> None:
    lawful = with_law(WHOLE, "published")
    assert law_of(lawful) == "published"
    assert numbers_of(lawful) == numbers_of(WHOLE)
    assert same(lawful, WHOLE)
    assert [each.chart.name == was.chart.name
            for each, was in zip(lawful.system.contacts, several().contacts, strict=True)
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
    session = Session(system, 1.0, engine="ifelse")
    session.fork(law="published")
    before, after = (session.tree.trace(k).contact("pad").F[-1] for k in (0, 1))
    assert before == after == 3.0
