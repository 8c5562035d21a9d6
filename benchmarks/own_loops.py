"""What a loop of one's own loses if friction steps in it naively, and what each step costs.

The pulled mass and the servo of `cases.py`, in fixed-step loops as users write them, with friction
in three ways: guards asked once a sample; switches located while the velocity is held; switches
located along the straight line from one velocity to the next. Times are medians over rounds in
which every loop runs, relative to the naive loop of the same round.

    python benchmarks/own_loops.py [--rounds 9]
    python benchmarks/own_loops.py --write        the tables in docs/howto/own-loops.md
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import textwrap
import time
from collections.abc import Callable
from contextlib import nullcontext
from math import copysign, exp, sin
from typing import Any, TypeAlias

import numpy as np
from cases import model_and_rig, servo
from compare import WIDTH, machine, markdown, replace
from rivals import EDGES, PULLED_MASS, Array

from gms_fsm import GMS, FrictionState, Prescribed, simulate

PAGE = "docs/howto/own-loops.md"
PACKAGES = ("llvmlite", "pathsim", "control", "mujoco")
T_END, M, K, V = 60.0, 1.0, 2.0, 0.1  # pulled mass: s, kg, N/m, m/s
Log: TypeAlias = list[tuple[int, str]]


class Naive:
    """Friction as it is often written: guards once a sample, then an Euler step.

    Parameters
    ----------
    model : GMS
        With the signed law.
    """

    def __init__(self, model: GMS) -> None:
        p = model.parameters
        self.numbers = list(
            zip(p.k.tolist(), p.sigma.tolist(), p.C.tolist(), p.weights.tolist(), strict=True)
        )
        curve = p.stribeck
        self.F_c, self.F_s, self.v_s = curve.F_c, curve.F_s, curve.v_s
        self.v_c, self.sigma_2 = p.v_c, p.sigma_2
        self.z = [0.0] * len(self.numbers)
        self.slips = [False] * len(self.numbers)
        self.log: Log = []

    def step(self, v: float, dt: float) -> float:
        """Return the force at v, and advance by dt."""
        strength = self.F_c + (self.F_s - self.F_c) * exp(-((v / self.v_s) ** 2))
        F = self.sigma_2 * v
        for i, (k, sigma, C, w) in enumerate(self.numbers):
            z, s = self.z[i], w * strength
            if self.slips[i]:
                if abs(v) <= self.v_c and abs(z) < s:
                    self._take(i, 2)
            elif z >= s and v > self.v_c:
                self._take(i, 0)
            elif z <= -s and v < -self.v_c:
                self._take(i, 1)
            dz = C * (copysign(1.0, v) * (v != 0.0) - z / s) if self.slips[i] else v
            F += k * z + sigma * dz
            self.z[i] = z + dt * dz
        return F

    def _take(self, i: int, edge: int) -> None:
        self.slips[i] = not self.slips[i]
        self.log.append((i, EDGES[edge]))


# --------------------------------------------------------------------------- the pulled mass
def naive(dt: float, log: Log | None) -> Array:
    """Return x at every sample: one call a sample, with the velocity only."""
    model, _ = model_and_rig(PULLED_MASS)
    friction, x, v, xs = Naive(model), 0.0, 0.0, [0.0]
    for step in range(round(T_END / dt)):
        v += dt * (K * (V * step * dt - x) - friction.step(v, dt)) / M
        x += dt * v
        xs.append(x)
    if log is not None:
        log += friction.log
    return np.array(xs)


def held(dt: float, log: Log | None) -> Array:
    """Return x at every sample: switches are located, but the velocity is held in a sample."""
    model, _ = model_and_rig(PULLED_MASS)
    friction, x, v, xs = FrictionState(model), 0.0, 0.0, [0.0]
    for step in range(round(T_END / dt)):
        F = friction.advance(v, v, dt)
        _keep(friction, log)
        v += dt * (K * (V * step * dt - x) - F) / M
        x += dt * v
        xs.append(x)
    return np.array(xs)


def straight(dt: float, log: Log | None) -> Array:
    """Return x at every sample: the last force gives the next velocity."""
    model, _ = model_and_rig(PULLED_MASS)
    friction, x, v, F, xs = FrictionState(model), 0.0, 0.0, 0.0, [0.0]
    for step in range(round(T_END / dt)):
        v_next = v + dt * (K * (V * step * dt - x) - F) / M
        F = friction.advance(v, v_next, dt)
        _keep(friction, log)
        x += dt * (v + v_next) / 2
        v = v_next
        xs.append(x)
    return np.array(xs)


def heun(dt: float, log: Log | None) -> Array:
    """Return x at every sample: the force at the end is peeked at, then the step is done."""
    model, _ = model_and_rig(PULLED_MASS)
    friction, x, v, F, xs = FrictionState(model), 0.0, 0.0, 0.0, [0.0]
    for step in range(round(T_END / dt)):
        a = (K * (V * step * dt - x) - F) / M
        tried = v + dt * a
        F_tried = friction.peek(v, tried, dt)
        x_tried = x + dt * (v + tried) / 2
        a_tried = (K * (V * (step + 1) * dt - x_tried) - F_tried) / M
        v_next = v + dt * (a + a_tried) / 2
        F = friction.advance(v, v_next, dt)
        _keep(friction, log)
        x += dt * (v + v_next) / 2
        v = v_next
        xs.append(x)
    return np.array(xs)


def _keep(friction: FrictionState, log: Log | None) -> None:
    if log is not None:
        log += [(each.element, each.edge) for each in friction.switches]


LOOPS: dict[str, Callable[[float, Log | None], Array]] = {
    "guards once a sample (naive)": naive,
    "switches located, v held": held,
    "straight line v0 → v1": straight,
    "straight line, Heun with `peek`": heun,
}


def reference() -> tuple[Array, Log]:
    """Return the exact x every 10 ms, and the edges."""
    model, rig = model_and_rig(PULLED_MASS)
    t = np.linspace(0.0, T_END, 6001)
    exact = simulate(model, rig, T_END, engine="compiled", rtol=1e-10, atol=1e-13, t_eval=t)
    return exact.x, [(int(each.element), str(each.edge)) for each in exact.transitions]


def judged(x: Array, log: Log, exact: Array, true: Log) -> list[str]:
    """Return the number of edges, how many are right before the first wrong one, the error of x."""
    pairs = zip(log, true, strict=False)
    same = next((i for i, pair in enumerate(pairs) if pair[0] != pair[1]), min(len(log), len(true)))
    return [f"{len(log)}", f"{same}", f"{1e3 * float(np.abs(x - exact).max()):.3g} mm"]


def pulled_mass(rounds: int) -> tuple[list[tuple[str, ...]], float]:
    """Return the rows of the table of the pulled mass, and the time of a naive step, µs."""
    exact, true = reference()
    rows = {name: [name] for name in LOOPS}
    for dt in (1e-3, 1e-4):
        for name, loop in LOOPS.items():
            log: Log = []
            x = loop(dt, log)[:: round(0.01 / dt)]
            rows[name] += judged(x, log, exact, true)
    seconds: dict[str, list[float]] = {name: [] for name in LOOPS}
    for _ in range(rounds):
        for name, loop in LOOPS.items():
            begin = time.perf_counter()
            loop(1e-3, None)
            seconds[name].append(time.perf_counter() - begin)
    first = seconds[next(iter(LOOPS))]
    step = 1e6 * statistics.median(first) * 1e-3 / T_END
    for name, mine in seconds.items():
        ratio = statistics.median(a / b for a, b in zip(mine, first, strict=True))
        rows[name] += [f"{ratio:.2f}"]
    return [tuple(row) for row in rows.values()], step


# --------------------------------------------------------------------------- in hosts
def in_scipy(dt: float) -> tuple[Array, Log]:
    """Return x at every sample: SciPy's solver within each one, RK45."""
    from gms_fsm.adapters.scipy import solve_ivp

    model, _ = model_and_rig(PULLED_MASS)

    def mass(t: float, y: Array, F: float) -> list[float]:
        return [y[1], (K * (V * t - y[0]) - F) / M]

    found = solve_ivp(mass, (0.0, T_END), [0.0, 0.0], model, velocity=1, sample=dt)
    return found.y[0], [(each.element, each.edge) for each in found.switches]


def in_pathsim(dt: float) -> tuple[Array, Log]:
    """Return x at every sample: PathSim with RK4."""
    from pathsim import Connection, Simulation
    from pathsim.blocks import Function, Integrator, Scope, Source
    from pathsim.solvers import RK4

    from gms_fsm.adapters.pathsim import friction_block

    model, _ = model_and_rig(PULLED_MASS)
    pull = Source(lambda t: K * V * t)
    mass = Function(lambda load, x, F: (load - K * x - F) / M)
    x, v, pad, scope = Integrator(), Integrator(), friction_block(model, dt), Scope()
    wires = [
        Connection(pull, mass[0]),
        Connection(x, mass[1], scope),
        Connection(pad, mass[2]),
        Connection(mass, v),
        Connection(v, x, pad),
    ]
    Simulation([pull, mass, x, v, pad, scope], wires, dt=dt, log=False, Solver=RK4).run(T_END)
    t, (found,) = scope.read()
    samples = np.interp(np.arange(round(T_END / dt) + 1) * dt, t, found)
    return samples, [(each.element, each.edge) for each in pad.switches]


def in_control(dt: float) -> tuple[Array, Log]:
    """Return x at every sample: python-control, with a plant discretized exactly."""
    import control

    from gms_fsm.adapters.control import friction_system

    model, _ = model_and_rig(PULLED_MASS)
    A, B = [[0.0, 1.0], [-K / M, 0.0]], [[0.0, 0.0], [K / M, -1.0 / M]]
    plant = control.c2d(control.ss(A, B, np.eye(2), np.zeros((2, 2))), dt)
    plant = control.ss(plant, name="mass", inputs=["end", "F"], outputs=["x", "v"])
    loop = control.interconnect(
        [plant, friction_system(model, dt)],
        connections=[["mass.F", "friction.F"], ["friction.v", "mass.v"]],
        inplist=["mass.end"],
        outlist=["mass.x", "mass.v"],
    )
    t = dt * np.arange(round(T_END / dt) + 1)
    x, v = control.input_output_response(loop, t, V * t).outputs
    friction, log = FrictionState(model), []
    for v0, v1 in itertools.pairwise(v):  # the system keeps no list of its edges
        friction.advance(v0, v1, dt)
        log += [(each.element, each.edge) for each in friction.switches]
    return x, log


def in_mujoco(dt: float, integrator: str, friction: bool) -> tuple[Array, Log]:
    """Return x at every sample: a slide of MuJoCo, pulled by the loop."""
    import mujoco

    from gms_fsm.adapters.mujoco import JointFriction

    model, _ = model_and_rig(PULLED_MASS)
    rail = mujoco.MjModel.from_xml_string(RAIL.format(dt=dt, integrator=integrator, M=M, K=K))
    data, xs = mujoco.MjData(rail), [0.0]
    joints = JointFriction(rail, data, {"rail": model}) if friction else None
    with joints or nullcontext():
        for _ in range(round(T_END / dt)):
            data.qfrc_applied[0] = K * V * data.time
            mujoco.mj_step(rail, data)
            xs.append(data.qpos[0])
    log = [] if joints is None else [(each.element, each.edge) for each in joints.switches]
    return np.array(xs), log


RAIL = """
<mujoco>
  <option timestep="{dt}" gravity="0 0 0" integrator="{integrator}"/>
  <worldbody><body>
    <joint name="rail" type="slide" axis="1 0 0" stiffness="{K}"/>
    <geom size=".1" mass="{M}" contype="0" conaffinity="0"/>
  </body></worldbody>
</mujoco>
"""
HOSTS: dict[str, Callable[[float], tuple[Array, Log]]] = {
    "SciPy, RK45 within samples": in_scipy,
    "PathSim, RK4": in_pathsim,
    "python-control": in_control,
    "MuJoCo, Euler": lambda dt: in_mujoco(dt, "Euler", True),
    "MuJoCo, RK4": lambda dt: in_mujoco(dt, "RK4", True),
    "MuJoCo, Euler, without friction": lambda dt: in_mujoco(dt, "Euler", False),
}


def hosts(rounds: int) -> list[tuple[str, ...]]:
    """Return the rows of the table of the hosts, at 1 kHz."""
    exact, true = reference()
    rows: dict[str, list[str]] = {name: [name] for name in HOSTS}
    ratios: dict[str, list[float]] = {name: [] for name in HOSTS}
    for turn in range(rounds):
        begin = time.perf_counter()
        naive(1e-3, None)
        first = time.perf_counter() - begin
        for name, host in HOSTS.items():
            begin = time.perf_counter()
            x, log = host(1e-3)
            ratios[name].append((time.perf_counter() - begin) / first)
            if turn == 0:
                rows[name] += judged(x[::10], log, exact, true) if log else ["", "", ""]
    for name, mine in ratios.items():
        rows[name] += [f"{statistics.median(mine):.3g}"]
    return [tuple(row) for row in rows.values()]


# --------------------------------------------------------------------------- the servo
def servo_loop(dt: float, way: str) -> float:
    """Return where the load is at the end, m."""
    (system,) = servo()
    n, model = system.numbers, system.contacts[0].model
    friction: Any = Naive(model) if way == "naive" else FrictionState(model)
    m_m, m_l, k_s, d_s = (n[name] for name in ("m_m", "m_l", "k_s", "d_s"))
    x_m = v_m = x_l = v_l = integral = e_before = u = F = 0.0
    for step in range(round(0.2 / dt)):
        if step % round(1e-3 / dt) == 0:
            e = n["ref"] - x_m
            u = n["k_p"] * e + integral + n["k_d"] * (e - e_before) / 1e-3
            integral += n["k_i"] * 1e-3 * e
            e_before = e
        shaft = k_s * (x_m - x_l) + d_s * (v_m - v_l)
        v_m += dt * (u - shaft) / m_m
        x_m += dt * v_m
        if way == "naive":
            F = friction.step(v_l, dt)
        elif way == "held":
            F = friction.advance(v_l, v_l, dt)
        v = v_l + dt * (shaft - F) / m_l
        if way == "straight":
            F = friction.advance(v_l, v, dt)
        v_l = v
        x_l += dt * v_l
    return x_l


def servos() -> list[tuple[str, ...]]:
    """Return the rows of the table of the servo."""
    steps = (1e-4, 2e-5, 5e-6)
    ways = dict(zip(("naive", "held", "straight"), LOOPS, strict=False))
    return [
        (name, *(f"{1e3 * servo_loop(dt, way):.4f} mm" for dt in steps))
        for way, name in ways.items()
    ]


# --------------------------------------------------------------------------- against the clock
def jitter(seconds: float) -> str:
    """Return how late the samples of a 1 kHz loop are, and what ignoring that costs."""
    model, _ = model_and_rig(PULLED_MASS)
    real, wished = FrictionState(model), FrictionState(model)
    late, took, wrong = [], [], 0.0
    begin, v0 = time.perf_counter(), 0.0
    for tick in range(1, round(1e3 * seconds) + 1):
        time.sleep(max(0.0, begin + 1e-3 * tick - time.perf_counter()))
        t = time.perf_counter() - begin
        v1 = 0.1 * sin(20.0 * t)
        F = real.advance_to(v0, v1, t)
        took.append(time.perf_counter() - begin - t)
        wrong = max(wrong, abs(F - wished.advance(v0, v1, 1e-3)))
        late.append(t - 1e-3 * tick)
        v0 = v1
    end = real.advance_to(v0, v0, real.t)
    times = np.array(late) + 1e-3 * np.arange(1, len(late) + 1)
    samples = Prescribed((np.r_[0.0, times], np.r_[0.0, 0.1 * np.sin(20.0 * times)]))
    assert end == simulate(model, samples, times[-1], engine="compiled").F[-1]
    median, most, slow = 1e6 * np.median(late), 1e6 * np.quantile(late, 0.99), 1e6 * max(late)
    return (
        f"A loop of 1 kHz against the clock, {seconds:.0f} s: samples {median:.0f} µs late in the "
        f"median, {most:.0f} µs for 99 %, {slow:,.0f} µs at most; `advance_to` takes "
        f"{1e6 * np.median(took):.1f} µs in the median. With the times measured, the force is that "
        f"of `simulate` on the same samples, to the bit; with a dt of 1 ms instead, it is wrong by "
        f"up to {wrong:.2g} N."
    )


def page(rounds: int) -> str:
    """Return what the page says, measured here."""
    rows, step = pulled_mass(rounds)
    head = ("", "1 kHz: edges", "right", "error", "10 kHz: edges", "right", "error", "time")
    end = ("", "100 µs", "20 µs", "5 µs")
    return "\n".join(
        [
            textwrap.fill(
                "Pulled mass, 60 s, 72 edges: edges taken, how many of them are right before the "
                "first wrong one, the largest error of the position, and the time of a step "
                f"relative to the naive loop ({step:.1f} µs, in plain Python):",
                WIDTH,
            ),
            "",
            *markdown(head, rows),
            "",
            "The same at 1 kHz in other programs, time relative to the naive loop, too:",
            "",
            *markdown(("", "edges", "right", "error", "time"), hosts(max(1, rounds // 3))),
            "",
            "Servo, where the load stops; 1.3299 mm is right:",
            "",
            *markdown(end, servos()),
            "",
            textwrap.fill(jitter(10.0), WIDTH),
            "",
            textwrap.fill(f"{machine(*PACKAGES)}; medians of interleaved rounds.", WIDTH),
        ]
    )


def main() -> None:
    """Print the tables, or write them into the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--write", action="store_true", help=f"replace the tables in {PAGE}")
    options = parser.parse_args()
    text = page(options.rounds)
    if options.write:
        replace(PAGE, text)
    else:
        print(text)


if __name__ == "__main__":
    main()
