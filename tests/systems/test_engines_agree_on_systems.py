"""The machines, the if-else text and machine code give equal bits for systems that lock."""

from __future__ import annotations

import pytest

from gms_fsm import Body, Contact, System, simulate
from tests.helpers import stick_slip
from tests.systems_cases import CASES, same_system_bits


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_engines_agree(name: str) -> None:
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    one = CASES[name]().run("compiled")
    assert len(one.transitions)
    for engine in ("ifelse", "machines"):
        same_system_bits(one, CASES[name]().run(engine))


@pytest.mark.parametrize("bound", ["0.2", "w + 0.1 * x"])
def test_engines_agree_on_an_input_called_s(bound: str) -> None:
    chart = stick_slip("signed").chart
    values = stick_slip("signed").values
    contact = Contact("pad", chart, values, n=4, inputs={"s": bound})
    body = Body("mass", inertia=1.0, force="2 * sin(t)")
    system = System("bound", bodies=(body,), contacts=(contact,), signals={"w": "0.2 + 0.01 * t"})
    one = simulate(system, 8.0, engine="ifelse")
    assert len(one.transitions)
    assert (one.s > 0.0).all()
    same_system_bits(one, simulate(system, 8.0, engine="machines"))
