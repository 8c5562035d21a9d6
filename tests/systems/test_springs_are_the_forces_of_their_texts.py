"""A declared spring adds the force that its formula says, to both bodies, with its gear ratio."""

from __future__ import annotations

import pytest

from gms_fsm import GMS, GMSParameters, PulledSlider, simulate
from gms_fsm.language import spell
from gms_fsm.systems.system import Body, Contact, Spring, System, system_of
from tests.helpers import same_bits
from tests.systems_cases import DRY, STICTION

PAD = (Contact("pad", STICTION, DRY, v="w_2"),)
NUMBERS = {"k": 3.0, "d": 0.2, "n": 2.0, "V": 0.1}


def pair(one: str = "0", two: str = "0", *springs: Spring) -> System:
    bodies = (
        Body("one", inertia=1.0, force=one, x="q_1", v="w_1"),
        Body("two", inertia=2.0, force=two, x="q_2", v="w_2"),
    )
    return System("pair", bodies=bodies, springs=springs, contacts=PAD, numbers=NUMBERS)


def forces(system: System) -> dict[str, str]:
    return {name: spell(tree) for name, tree in system.assembly.forces.items()}


@pytest.mark.parametrize(
    ("spring", "one", "two"),
    [
        (Spring("s", "one", k="k", d="d"), "-k * q_1 - d * w_1", "0"),
        (Spring("s", "one", k="k", rest="V * t"), "k * (V * t - q_1)", "0"),
        (Spring("s", "one", k="k", d="d", rest=0.5), "k * (0.5 - q_1) - d * w_1", "0"),
        (Spring("s", "one", "two", d="d"), "d * (w_2 - w_1)", "-d * (w_2 - w_1)"),
        (
            Spring("s", "one", "two", k="k", d="d", ratio="n", rest="V"),
            "k * (n * q_2 + V - q_1) + d * (n * w_2 - w_1)",
            "-n * (k * (n * q_2 + V - q_1) + d * (n * w_2 - w_1))",
        ),
    ],
)
def test_its_force_is_that_of_the_text(spring: Spring, one: str, two: str) -> None:
    declared = pair("0", "0", spring)
    assert forces(declared) == forces(pair(one, two))
    start = {"one.v": 0.5, "two.x": 0.1}
    runs = [simulate(each, 5.0, initial=start) for each in (declared, pair(one, two))]
    same_bits(*runs)


def test_springs_come_after_the_text_in_their_order() -> None:
    springs = (Spring("a", "one", d="d"), Spring("b", "one", "two", k="k", ratio="n"))
    assert forces(pair("V * t", "V", *springs)) == {
        "one": "V * t - d * w_1 + k * (n * q_2 - q_1)",
        "two": "V - n * (k * (n * q_2 - q_1))",
    }


def test_a_driven_body_feels_nothing() -> None:
    bodies = (
        Body("hand", velocity="V", x="q_1", v="w_1"),
        Body("two", inertia=1.0, x="q_2", v="w_2"),
    )
    system = System(
        "pulled",
        bodies=bodies,
        springs=(Spring("s", "two", "hand", k="k"),),
        contacts=PAD,
        numbers=NUMBERS,
    )
    assert forces(system) == {"two": "k * (q_1 - q_2)"}


def test_a_rig_declares_its_spring_and_a_derived_one_with_another_force_does_not() -> None:
    class Shaken(PulledSlider):
        acceleration = "(stiffness * (speed * t - x) + sin(t) - F) / mass"

    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    pulled, shaken = (system_of(model, rig(1.0, 2.0, 0.1)) for rig in (PulledSlider, Shaken))
    assert forces(pulled) == {"body": "stiffness * (speed * t - x)"}
    assert [each.name for each in pulled.springs] == ["spring"]
    assert forces(shaken) == {"body": "stiffness * (speed * t - x) + sin(t)"}
    assert shaken.springs == ()


def test_rigs_that_differ_in_their_springs_share_no_system() -> None:
    class Bare(PulledSlider):
        springs = ()

    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    pulled, bare = (system_of(model, rig(1.0, 2.0, 0.1)) for rig in (PulledSlider, Bare))
    assert (len(pulled.springs), len(bare.springs)) == (1, 0)
