"""A rig's number or signal is never confused with something else, whatever its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pytest

from gms_fsm import GMS, GMSParameters, ParameterError, simulate
from gms_fsm.systems.signals import Signal, as_signal

MODEL = GMS(GMSParameters.paper("stick-slip"), law="signed")
FREE = ["q", "mass", "k", "C", "sigma", "v_c", "z", "STICK", "stick", "arrest", "max_0", "t0"]
# Names that the generated text uses itself, or that belong to the model.
FREE += ["n", "i", "y", "p", "out", "mode", "edge", "held", "weight", "own", "shared", "tables"]
FREE += ["s", "F_c", "v_s", "sigma_2", "S", "dS", "dz", "dy", "F_i", "j", "friction", "a", "a_body"]
USED = ["x", "v", "t", "F", "exp", "pi"]


@dataclass
class Pushed:
    """A user-defined rig with one number or one signal of a given name."""

    acceleration: str
    numbers: Mapping[str, float] = field(default_factory=dict)
    signals: Mapping[str, Signal] = field(default_factory=dict)
    title: str = "pushed"


def by_number(name: str) -> Pushed:
    return Pushed(f"{name} * sin(t) - F", numbers={name: 2.0})


def by_signal(name: str) -> Pushed:
    return Pushed(f"{name} - F", signals={name: as_signal("2 * sin(t)")})


@pytest.mark.parametrize("rig", [by_number, by_signal])
@pytest.mark.parametrize("name", FREE)
def test_a_free_name_changes_nothing(name: str, rig) -> None:  # type: ignore[no-untyped-def]
    trace, like = (simulate(MODEL, rig(each), 3.0) for each in (name, "quantity"))
    np.testing.assert_array_equal(trace.z, like.z)
    np.testing.assert_array_equal(trace.F, like.F)
    assert abs(trace.z).max() > 0.01


@pytest.mark.parametrize("rig", [by_number, by_signal])
@pytest.mark.parametrize("name", USED)
def test_a_name_with_a_meaning_is_refused(name: str, rig) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ParameterError) as caught:
        simulate(MODEL, rig(name), 3.0)
    assert repr(name) in str(caught.value)
