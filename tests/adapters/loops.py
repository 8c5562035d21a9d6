"""The scenario servo and the pulled mass, as users of other loops write them."""

from __future__ import annotations

from typing import Any

import numpy as np

from gms_fsm import (
    Body,
    Chart,
    Contact,
    Parameter,
    PulledSlider,
    State,
    System,
    Trace,
    simulate,
)
from gms_fsm.app.scenario import load_system
from gms_fsm.charts import CHARTS
from tests.helpers import FASTEST, pulled_mass

m_m, m_l, k_s, d_s = 0.5, 1.0, 2e4, 5.0  # kg, kg, N/m, Ns/m
REF, k_p, k_i, k_d, PERIOD = 2e-3, 400.0, 500.0, 40.0, 1e-3  # m, the controller, s
T_END, LOAD = 0.2, 1.3215e-3  # s, and m: where the load is then
PULLED_END = 60.0  # s


def servo_friction() -> Any:
    """Return the friction of the servo's load."""
    (contact,) = load_system("servo").contacts
    return contact.model


class PID:
    """The sampled controller: u at each of its ticks."""

    def __init__(self) -> None:
        self.I = self.e_before = 0.0

    def __call__(self, x_m: float) -> float:
        e = REF - x_m
        u = k_p * e + self.I + k_d * (e - self.e_before) / PERIOD
        self.I += k_i * PERIOD * e
        self.e_before = e
        return u


def servo_in_pathsim(period: float, **options: Any) -> tuple[Any, Any, Any]:
    """Return PathSim's simulation of the servo, the friction block, and the block of x_l."""
    from pathsim import Connection, Simulation
    from pathsim.blocks import Block, Function, Integrator
    from pathsim.events import Schedule

    from gms_fsm.adapters.pathsim import friction_block

    class Controller(Block):
        def __init__(self) -> None:
            super().__init__()
            self.pid = PID()
            self.events = [Schedule(t_period=PERIOD, func_act=self._tick)]

        def __len__(self) -> int:
            return 0

        def _tick(self, t: float) -> None:
            self.outputs[0] = self.pid(self.inputs[0])

        def update(self, t: float) -> None:
            """Hold u between the ticks."""

        def reset(self) -> None:
            super().reset()
            self.pid = PID()

    def accelerations(*signals: float) -> tuple[float, float]:
        u, x_m, v_m, x_l, v_l, F = signals
        shaft = k_s * (x_m - x_l) + d_s * (v_m - v_l)
        return (u - shaft) / m_m, (shaft - F) / m_l

    friction, controller = friction_block(servo_friction(), period), Controller()
    x_m, v_m, x_l, v_l = (Integrator() for _ in range(4))
    bodies = Function(accelerations)
    wires = [
        Connection(controller, bodies[0]),
        Connection(x_m, bodies[1], controller),
        Connection(v_m, bodies[2], x_m),
        Connection(x_l, bodies[3]),
        Connection(v_l, bodies[4], x_l, friction["v"]),
        Connection(friction["F"], bodies[5]),
        Connection(bodies[0], v_m),
        Connection(bodies[1], v_l),
    ]
    blocks = [controller, x_m, v_m, x_l, v_l, bodies, friction]
    options = {"dt": period, "log": False} | options
    return Simulation(blocks, wires, **options), friction, x_l


def pulled_mass_in_pathsim(period: float, **options: Any) -> tuple[Any, Any, Any]:
    """Return PathSim's simulation of the pulled mass, the friction block, and the block of x."""
    from pathsim import Connection, Simulation
    from pathsim.blocks import Function, Integrator, Source

    from gms_fsm.adapters.pathsim import friction_block

    model, _ = pulled_mass()
    friction, x, v = friction_block(model, period), Integrator(), Integrator()
    pull, mass = Source(lambda t: 0.1 * t), Function(lambda end, x, F: 2.0 * (end - x) - F)
    wires = [
        Connection(pull, mass[0]),
        Connection(x, mass[1]),
        Connection(friction, mass[2]),
        Connection(mass, v),
        Connection(v, x, friction),
    ]
    options = {"dt": period, "log": False} | options
    return Simulation([friction, x, v, pull, mass], wires, **options), friction, x


def servo_in_control(dt: float, *names: str) -> Any:
    """Return the servo as an interconnection of discrete-time systems, with its signals' names."""
    import control

    from gms_fsm.adapters.control import friction_system

    A = np.array(
        [
            [0, 1, 0, 0],
            [-k_s / m_m, -d_s / m_m, k_s / m_m, d_s / m_m],
            [0, 0, 0, 1],
            [k_s / m_l, d_s / m_l, -k_s / m_l, -d_s / m_l],
        ]
    )
    B = np.array([[0, 0], [1 / m_m, 0], [0, 0], [0, -1 / m_l]])
    signals = ["x_m", "v_m", "x_l", "v_l"]
    exact = control.c2d(control.ss(A, B, np.eye(4), np.zeros((4, 2))), dt)
    plant = control.ss(exact, inputs=["u", "F"], outputs=signals, name="plant")
    ticks = round(PERIOD / dt)

    def law(x: Any, u: Any) -> tuple[float, float]:
        e = REF - u[0]
        return e, k_p * e + x[1] + k_d * (e - x[2]) / PERIOD

    def update(t: float, x: Any, u: Any, params: Any) -> Any:  # x: samples, I, e_before, u
        if x[0] % ticks:
            return np.array([x[0] + 1, *x[1:]])
        e, now = law(x, u)
        return np.array([x[0] + 1, x[1] + k_i * PERIOD * e, e, now])

    def output(t: float, x: Any, u: Any, params: Any) -> float:
        return x[3] if x[0] % ticks else law(x, u)[1]

    pid = control.nlsys(update, output, inputs=["x_m"], outputs=["u"], states=4, dt=dt, name="pid")
    return control.interconnect(
        [plant, pid, friction_system(servo_friction(), dt)],
        connections=[
            ["plant.u", "pid.u"],
            ["plant.F", "friction.F"],
            ["pid.x_m", "plant.x_m"],
            ["friction.v", "plant.v_l"],
        ],
        inplist=[],
        outlist=[f"plant.{name}" for name in signals] + ["friction.F"],
        outputs=[*signals, "F"],
        dt=dt,
    )


def loaded_pad() -> Contact:
    """Return viscous friction that grows with a normal force, a further input."""
    chart = Chart(
        "pad",
        inputs=("v", "N"),
        parameters=(Parameter("mu", "s/m", "> 0"),),
        states=(State("slip"),),
        outputs={"F": "mu * N * v"},
    )
    return Contact("pad", chart, {"mu": 3.0}, v="v", inputs={"N": "load"})


def by_element(switches: Any) -> list[tuple[int, list[str], list[float]]]:
    """Return the edges and times of each element: equal elements may swap within one instant."""
    mine = [[each for each in switches if int(each.element) == i] for i in range(4)]
    return [
        (i, [str(e.edge) for e in log], [float(e.t) for e in log]) for i, log in enumerate(mine)
    ]


def sequence(switches: Any) -> list[tuple[int, str]]:
    """Return the elements and edges, in order, of a log or of a list of switches."""
    return [(int(each.element), str(each.edge)) for each in switches]


def exact_servo() -> Trace:
    """Return the servo by `simulate`."""
    system = load_system("servo")
    return simulate(system, T_END, engine=FASTEST, rtol=1e-9, atol=1e-12)


def exact_pulled_mass(t_end: float = PULLED_END) -> Trace:
    """Return the pulled mass by `simulate`."""
    model, _ = pulled_mass()
    rig = PulledSlider(1.0, 2.0, 0.1)
    return simulate(model, rig, t_end, engine=FASTEST, rtol=1e-10, atol=1e-13)


def sled(inputs: tuple[str, ...] = ("u",)) -> System:
    """Return a mass on a dry contact, pushed by an input."""
    pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.5})
    body = Body("sled", inertia=1.0, force="u")
    return System("sled", bodies=(body,), contacts=(pad,), inputs=inputs)
