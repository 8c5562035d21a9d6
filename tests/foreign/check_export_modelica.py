"""Claim: Modelica tools read the model, and one that simulates takes the switches of `simulate`."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import version

import numpy as np
import pytest
import rumoca
from pymoca import parser

from gms_fsm import Body, Prescribed, System, simulate
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.targets.modelica import modelica
from tests.exporters.frictions import NAMES, case, loaded, scenario
from tests.exporters.rumoca_runs import T_END, compared, ran_in_rumoca

FLANGED = """
connector Flange_a
  Real {s};
  flow Real {f};
end Flange_a;
connector Flange_b
  Real {s};
  flow Real {f};
end Flange_b;
model Mover
  Flange_a flange;
  input Real u;
equation
  flange.{s} = u;
end Mover;
model Test
  pad_{kind} pad;
  Mover one;
  Mover other;
  Real x(start = 0, fixed = true);
equation
  der(x) = 1e-3 * sin(50 * time);
  one.u = x;
  other.u = 0;
  connect(pad.flange_b, one.flange);
  connect(pad.flange_a, other.flange);
end Test;
"""
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


@pytest.mark.parametrize("name", ["pulled_mass", "servo", "paper_fig3_non_drifting"])
def test_whole_systems(name: str, ran: Callable[..., None]) -> None:
    system, t_end = scenario(name), 0.05
    text = modelica(Subject.of(system, "modelica", name=name))[f"{name}.mo"]
    config = rumoca.SimConfig(solver="auto", rtol=1e-9, atol=1e-14)
    model = rumoca.Session().loads(text, model=name)
    result = model.simulate((0.0, t_end), dt=t_end / 50, config=config)
    trace, body = simulate(system, t_end, rtol=1e-10), system.bodies[-1]
    apart = abs(float(np.asarray(result[body.x])[-1]) - float(trace.body(body.name).x[-1]))
    assert apart < 1e-9
    told = f"Rumoca {version('rumoca')}"
    what = f"{len(trace.transitions)} switches; {body.x} within {apart:.0e} m at the end"
    ran("modelica", told, f"{name}, a whole system, 0.05 s", what)


@pytest.mark.parametrize(
    ("kind", "s", "f"), [("translational", "s", "f"), ("rotational", "phi", "tau")]
)
def test_between_flanges(kind: str, s: str, f: str, ran: Callable[..., None]) -> None:
    """The connectors are like those of the Modelica Standard Library, which Rumoca lacks."""
    contact, outer = scenario("servo").contact("bearing"), kind.capitalize()
    files = modelica(Subject.of(contact, "modelica", name="pad"))
    given = files["pad_flanges.mo"].partition("model pad_rotational")
    own = given[0] if kind == "translational" else given[1] + given[2]
    text = files["pad.mo"] + own.replace(f"Modelica.Mechanics.{outer}.Interfaces.", "")
    text += FLANGED.format(kind=kind, s=s, f=f)
    config = rumoca.SimConfig(solver="auto", rtol=1e-9, atol=1e-14)
    result = rumoca.Session().loads(text, model="Test").simulate((0.0, 0.2), dt=1e-3, config=config)
    exact = simulate(contact.model, Prescribed("1e-3*sin(50*t)"), 0.2, rtol=1e-10).F[-1]
    ends = [float(np.asarray(result[f"pad.flange_{u}.{f}"])[-1]) for u in "ba"]
    assert ends == pytest.approx([exact, -exact], rel=1e-6)
    told = f"Rumoca {version('rumoca')}"
    ran("modelica", told, f"GMS 4 between {kind} flanges (connectors of our own)", "F within 1e-6")
