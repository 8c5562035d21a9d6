"""A rig's number or signal is never confused with something else, whatever its name."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gms_fsm import GMS, GMSParameters, simulate
from gms_fsm.systems.signals import as_signal
from tests.helpers import same_bits

MODEL = GMS(GMSParameters.paper("stick-slip"), law="signed")
FREE = ["q", "mass", "k", "C", "sigma", "v_c", "z", "STICK", "stick", "arrest", "max_0", "t0"]
# Names that the generated text uses itself, or that belong to the model.
FREE += ["n", "i", "y", "p", "out", "mode", "edge", "held", "weight", "own", "shared", "tables"]
FREE += ["s", "F_c", "v_s", "sigma_2", "S", "dS", "dz", "dy", "F_i", "j", "friction", "a", "a_body"]


def pushed(names: list[str], kind: str) -> Any:
    """Return a rig with a number or a signal for each name, all of other values."""
    values = {name: f"{0.2 + 0.01 * place} * t" for place, name in enumerate(names)}
    if kind == "numbers":
        values = {name: 0.2 + 0.01 * place for place, name in enumerate(names)}
    else:
        values = {name: as_signal(text) for name, text in values.items()}
    force = " + ".join(f"{name} * sin({place + 1} * t)" for place, name in enumerate(names))
    given = {"numbers": {}, "signals": {}} | {kind: values}
    return SimpleNamespace(title="pushed", acceleration=f"{force} - F", **given)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["numbers", "signals"])
def test_a_free_name_changes_nothing(kind: str) -> None:
    """All at once, beside names that mean nothing."""
    plain = [f"quantity_{place}" for place in range(len(FREE))]
    one, other = (simulate(MODEL, pushed(names, kind), 3.0) for names in (FREE, plain))
    same_bits(one, other)
    assert abs(one.z).max() > 0.01
