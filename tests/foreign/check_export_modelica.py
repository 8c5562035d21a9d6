"""Claim: Modelica tools read the model, and one that simulates takes the switches of `simulate`."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import version

import pytest
from pymoca import parser

from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.modelica import modelica
from tests.exporters.rumoca_runs import compared
from tests.exporters.text_cases import NAMES, case

NEAR = 1e-6  # of the largest force; Rumoca locates events by the tolerance of its solver


@pytest.mark.parametrize("name", NAMES)
def test_rumoca_takes_the_switches(name: str, ran: Callable[..., None]) -> None:
    found = [compared(name, seed) for seed in range(3)]
    assert max(force for _, force in found) < NEAR
    ran(
        "modelica",
        f"Rumoca {version('rumoca')}",
        f"{name}: 3 random frictions, 3 s of two sines",
        f"all {sum(count for count, _ in found)} switches of simulate in its order; F at most "
        f"{max(force for _, force in found):.1g} of its largest value apart",
    )


def test_pymoca_parses_it(ran: Callable[..., None]) -> None:
    for name in NAMES:
        files = modelica(Subject.of(case(name, 0).model, "modelica", name="friction"))
        tree = parser.parse(files["friction.mo"])
        assert tree is not None, name
        assert {"friction_element", "friction"} <= {*tree.classes}, name
    told = f"pymoca {version('pymoca')}"
    ran("modelica", told, f"parsed {len(NAMES)} frictions", "both classes found")
