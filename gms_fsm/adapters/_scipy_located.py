"""SciPy's `solve_ivp` with located switches: friction and caller as one set of equations."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import integrators
from gms_fsm.adapters._scipy_parts import Caller, Carried, ContactSwitch, Solution
from gms_fsm.charts.parameters import FloatArray
from gms_fsm.lowering.program import equations
from gms_fsm.run.machines import IfElse
from gms_fsm.run.problem import IMPLICIT
from integrators import Arc, Firing, Held, HybridError, Livelock, NotFinite, hybrid, look

NUDGE = 1e-6  # of a component of y, to see how the velocities depend on it


class Located:
    """The caller's equations and the frictions as one set of equations.

    The state vector is the caller's, followed by that of the frictions.
    """

    def __init__(self, caller: Caller, carried: Carried) -> None:
        self.caller, self.carried = caller, carried
        self.driven = driven = carried.driven
        # The places of the caller's state, and of the frictions' own.
        self._host, self._own = slice(0, caller.n), slice(caller.n, caller.n + len(driven.own))
        self.program = program = driven.program
        self._rates = [0.0] * program.layout.y.size
        self._seen = [0.0] * program.layout.observed.size
        self._gradient = [0.0] * (program.layout.y.size + 1)
        switch = IfElse(program)
        self._act, self.tick, self.jolts = switch.act, switch.tick, switch.jolts

    def _full(self, y: Sequence[float]) -> list[float]:
        return self.driven.full(y[self._own], self.caller.velocities(np.array(y[self._host])))

    # ------------------------------------------------------------------ as integrators.Equations
    def equations(self) -> integrators.Equations:
        """Return both as one."""
        whole = equations(self.program)
        return integrators.Equations(
            flow=self.flow,
            flow_live=self.flow,  # for runs without located crossings only
            arm=self.arm,
            margins=self.margins,
            normal=self.normal,
            p=whole.p,
            held=whole.held,
            strict=whole.strict,
            relations=whole.relations,
            surfaces=whole.surfaces,
            seen=whole.seen,
        )

    def flow(
        self, t: float, y: list[float], mode: list[int], held: list[float], p: Any, dy: list[float]
    ) -> None:
        host, rates, seen = np.array(y[self._host]), self._rates, self._seen
        full = self.driven.full(y[self._own], self.caller.velocities(host))
        self.program.ieee["flow"](t, full, mode, held, p, rates)
        self.program.ieee["observe"](t, full, mode, held, p, seen)
        dy[self._host] = self.caller.rates(t, host, [seen[k] for k in self.driven.forces])
        dy[self._own] = [rates[k] for k in self.driven.own]

    def arm(
        self,
        t: float,
        y: list[float],
        mode: list[int],
        p: Any,
        held: list[float],
        watch: list[int],
    ) -> None:
        self.program.ieee["arm"](t, self._full(y), mode, p, held, watch)

    def margins(
        self, t: float, y: list[float], mode: list[int], p: Any, watch: list[int], out: list[float]
    ) -> None:
        self.program.ieee["margins"](t, self._full(y), mode, p, watch, out)

    def normal(
        self, surface: int, t: float, y: list[float], mode: list[int], p: Any, out: list[float]
    ) -> None:
        gradient, host = self._gradient, np.array(y[self._host])
        self.program.ieee["normal"](surface, t, self._full(y), mode, p, gradient)
        for j, slopes in enumerate(self._slopes(host)):
            out[j] = math.fsum(
                gradient[k] * slope for k, slope in zip(self.driven.velocities, slopes, strict=True)
            )
        own = [gradient[k] for k in self.driven.own]
        out[self._own] = own
        out[self._own.stop] = gradient[-1]

    def _slopes(self, host: FloatArray) -> Iterator[list[float]]:
        """Yield for each component of the caller's state how the velocities depend on it."""
        for j in range(len(host)):
            step = NUDGE * (abs(host[j]) or 1.0)
            after, before = host.copy(), host.copy()
            after[j], before[j] = host[j] + step, host[j] - step
            width = after[j] - before[j]
            pairs = zip(self.caller.velocities(after), self.caller.velocities(before), strict=True)
            yield [float((b - a) / width) for b, a in pairs]

    def observe(
        self, t: float, y: list[float], mode: list[int], signs: list[float], p: Any, out: Any
    ) -> None:
        self.program.ieee["observe"](t, self._full(y), mode, signs, p, out)

    # ------------------------------------------------------------------ as integrators.Switching
    def ask(
        self, t: float, y: list[float], mode: list[int], p: Any, jolt: list[int], edges: list[int]
    ) -> None:
        self.program.ieee["switch"](t, self._full(y), mode, p, jolt, edges)

    def act(
        self, edge: int, machine: int, t: float, y: list[float], mode: list[int], p: Any
    ) -> None:
        full = self._full(y)
        self._act(edge, machine, t, full, mode, p)
        y[self._own] = [full[k] for k in self.driven.own]

    # ------------------------------------------------------------------ running
    def solution(
        self, y0: FloatArray, start: float, end: float, options: integrators.LoopOptions
    ) -> Solution:
        """Run, and collect rows and switches."""
        t: list[float] = []
        rows: list[list[float]] = []
        modes: list[tuple[int, ...]] = []
        switches: list[ContactSwitch] = []
        whole = self.equations()
        y = [*y0.tolist(), *self.carried.y]
        b = hybrid.buffers(whole, start, y, list(self.carried.mode), end, options)
        message = ""
        try:
            for event in hybrid.events(whole, self, b, options):
                if isinstance(event, Arc):
                    t += event.t
                    rows += event.y
                    modes += [event.mode] * len(event.t)
                elif isinstance(event, Firing):
                    place, edge = self.driven.place(event.machine), self.driven.edge(event.edge)
                    switches.append(ContactSwitch(event.t, *place, edge))
        except HybridError as error:
            message = f"it stopped at t = {error.t!r} s: {error}; {_advice(error, options.method)}"
        nfev = self.caller.nfev
        forces = [self._observed(whole, *row) for row in zip(t, rows, modes, strict=True)]
        table = np.array(forces).reshape(-1, len(self.driven.forces)).T
        states = np.array(rows).reshape(len(t), len(y)).T
        return Solution(
            t=np.array(t),
            y=states[self._host],
            F=table if self.carried.several else table[0],
            switches=tuple(switches),
            friction=Carried(
                self.driven, tuple(b.now.y[self._own]), tuple(b.now.mode), self.carried.several
            ),
            nfev=nfev,
            success=not message,
            message=message or "the end was reached",
        )

    def _observed(
        self, whole: integrators.Equations, t: float, y: list[float], mode: tuple[int, ...]
    ) -> list[float]:
        """Return the forces at a row; on a surface with the sigmas there."""
        layout = self.program.layout
        out = [0.0] * layout.observed.size
        sliding = integrators.sliding_scratch(
            whole.surfaces, len(y), whole.held, len(whole.strict), whole.seen, mode[layout.slides]
        )
        functions = whole.functions(located=True)
        look(
            self.observe,
            Held(functions, [0.0] * whole.held, sliding),
            t,
            y,
            list(mode[layout.elements]),
            out,
        )
        return [out[k] for k in self.driven.forces]


def _advice(error: HybridError, method: Any) -> str:
    """Say what to do where the solver gives up."""
    if isinstance(error, NotFinite):
        return "fun, velocity or the friction gives NaN or infinity there"
    if isinstance(error, Livelock):
        return "states keep switching without progress: prove() finds such guards"
    if getattr(method, "__name__", "") in IMPLICIT:
        return "try a larger rtol and atol"
    return "try a stiff method ('Radau'), or a larger rtol and atol"
