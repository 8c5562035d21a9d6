"""Running exported models in Rumoca."""

from __future__ import annotations

from typing import Any

import numpy as np
import rumoca

from gms_fsm import Prescribed, simulate
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.targets.modelica import modelica
from tests.exporters.frictions import case

T_END = 3.0
TEST = """
model Test
  friction given;
equation
  given.v = {velocity};
  {more}
end Test;
"""


def compared(name: str, seed: int) -> tuple[int, float]:
    """Compare a run with `simulate`; return the switches, and how far the forces differ."""
    model, repeat = case(name, seed).model, f"repeat with compared({name!r}, {seed})"
    size = 0.2 if name.startswith("gms") else 3e-3
    velocity = f"{size!r}*sin(2*t) + {size / 3!r}*sin(7.3*t)"
    result = ran_in_rumoca(model, velocity)
    grid = np.arange(1, 300) * 0.01
    trace = simulate(model, Prescribed(velocity), T_END, rtol=1e-10, t_eval=grid)
    log = trace.transitions
    n, states = model.n, [state.name for state in model.chart.states]
    found = []
    for i in range(n):
        column = f"given.element{f'[{i + 1}]' if n > 1 else ''}.state"
        if column in result.names:
            entered = np.round(result[column]).astype(int)
            found += [
                (float(result.time[k + 1]), i, states[entered[k + 1] - 1])
                for k in np.flatnonzero(np.diff(entered))
            ]
    targets = {edge.name: edge.target for edge in model.chart.transitions}
    wanted = [(int(i), targets[edge]) for i, edge in zip(log.element, log.edge, strict=True)]
    assert [(i, state) for _, i, state in sorted(found, key=lambda each: each[0])] == wanted, repeat
    at = np.searchsorted(result.time, grid - 1e-9)
    assert np.abs(np.asarray(result.time)[at] - grid).max() < 1e-9, repeat
    apart = np.abs(np.asarray(result["given.F"])[at] - trace.F)
    return len(wanted), float(apart.max() / np.abs(trace.F).max())


def ran_in_rumoca(model: Any, velocity: str, more: str = "") -> Any:
    """Return Rumoca's result for a friction with a velocity over t, and one more equation."""
    text = modelica(Subject.of(model, "modelica", name="friction"))["friction.mo"]
    text += TEST.format(velocity=velocity, more=f"{more};" * bool(more)).replace("*t)", "*time)")
    config = rumoca.SimConfig(solver="auto", rtol=1e-9, atol=1e-14)
    return rumoca.Session().loads(text, model="Test").simulate((0.0, T_END), dt=0.01, config=config)
