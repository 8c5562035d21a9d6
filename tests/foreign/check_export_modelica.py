"""Claim: Modelica tools read the model, and one that simulates takes the switches of `simulate`."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import version

import numpy as np
import pytest
from pymoca import parser

from gms_fsm import Body, System, simulate
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.targets.modelica import modelica
from tests.exporters.frictions import NAMES, case, loaded
from tests.exporters.rumoca_runs import T_END, compared, ran_in_rumoca

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


def test_further_inputs_position_time_and_actions(ran: Callable[..., None]) -> None:
    load = "0.2 + 0.5*sin(2*t)"
    result = ran_in_rumoca(loaded(), "cos(3*t)", f"given.load = {load}")
    grid, body = np.arange(1, 300) * 0.01, Body("body", velocity="cos(3*t)")
    system = System("moved", bodies=(body,), contacts=(loaded(f"({load})"),))
    trace = simulate(system, T_END, rtol=1e-10, t_eval=grid)
    exact = trace.contact("contact").F
    at = np.searchsorted(result.time, grid - 1e-9)
    worst = float(np.abs(np.asarray(result["given.F"])[at] - exact).max() / np.abs(exact).max())
    assert worst < NEAR
    ran(
        "modelica",
        f"Rumoca {version('rumoca')}",
        "a chart with x, t, a further input and actions",
        f"F at most {worst:.1g} of its largest value apart, over {len(trace.transitions)} switches",
    )
