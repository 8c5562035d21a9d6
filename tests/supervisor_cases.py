"""Systems with machines that are no contacts, with what is known of them in closed form."""

from __future__ import annotations

import math

from gms_fsm import Body, Chart, Contact, State, Supervisor, System, Transition
from gms_fsm.charts import CHARTS
from tests.systems_cases import Case

THERMOSTAT = Chart(
    "thermostat",
    inputs=("T",),
    velocities=(),
    parameters=("low", "high"),
    states=(State("off", outputs={"u": "0"}), State("on", outputs={"u": "1"})),
    transitions=(
        Transition("switch_on", "off", "on", guard="T < low"),
        Transition("switch_off", "on", "off", guard="T > high"),
    ),
)
LIGHT = Chart(
    "light",
    inputs=(),
    velocities=(),
    states=(State("red"), State("green"), State("amber")),
    transitions=(
        Transition("go", "red", "green", guard="after(30)"),
        Transition("warn", "green", "amber", guard="after(25)"),
        Transition("halt", "amber", "red", guard="after(5)", emit="red"),
    ),
)
SIDE = Chart(  # goes while the main road waits
    "side",
    inputs=("free",),
    velocities=(),
    states=(State("red"), State("green")),
    transitions=(
        Transition("go", "red", "green", guard="free > 0.5 and after(2)"),
        Transition("halt", "green", "red", guard="free < 0.5"),
    ),
)
COUNTER = Chart(
    "counter",
    inputs=(),
    velocities=(),
    variables=("k",),
    states=(State("counting", outputs={"n": "k"}),),
    transitions=(
        Transition("count_one", "counting", "counting", event="red", actions={"k": "k + 1"}),
    ),
)
GEARS = Chart(
    "gears",
    inputs=("w",),
    velocities=(),
    parameters=("w_up",),
    states=(
        State("first", outputs={"torque": "4"}),
        State("shifting", outputs={"torque": "0"}),
        State("second", outputs={"torque": "2"}),
    ),
    transitions=(
        Transition("declutch", "first", "shifting", guard="w > w_up"),
        Transition("engage", "shifting", "second", guard="after(0.25)"),
    ),
)
PUSHES = Chart(
    "pushes",
    inputs=(),
    velocities=(),
    states=(State("push", outputs={"F": "3"}), State("rest", outputs={"F": "0"})),
    transitions=(
        Transition("stop", "push", "rest", guard="after(1)"),
        Transition("start", "rest", "push", guard="after(3)"),
    ),
)
COOLED = Chart(
    "cooled brake",
    inputs=("P",),
    velocities=(),
    variables=("T",),
    parameters=("C", "h"),
    states=(
        State("normal", flow={"T": "(P - h * T) / C"}, outputs={"N": "30"}),
        State("hot", flow={"T": "(P - h * T) / C"}, outputs={"N": "3"}),
    ),
    transitions=(
        Transition("overheats", "normal", "hot", guard="T > 30"),
        Transition("cools", "hot", "normal", guard="T < 15"),
    ),
)
BRAKE = Chart(
    "brake",
    inputs=("v", "N"),
    parameters=("mu", "v_0"),
    states=(State("on"),),
    outputs={"F": "mu * N * tanh(v / v_0)"},
)


def thermostat() -> Case:
    """A room that is heated by a thermostat."""
    heater = Supervisor("heater", THERMOSTAT, {"low": 19.0, "high": 21.0})
    return Case(System("room", supervisors=(heater,), flow={"T": "30 * heater.u - T"}), 3.0)


def crossing() -> Case:
    """Two traffic lights, one of which sees the other, and a counter of the cycles."""
    lights = (
        Supervisor("main", LIGHT),
        Supervisor("side", SIDE, inputs={"free": "is_in(main.red)"}),
        Supervisor("cycles", COUNTER),
    )
    return Case(System("crossing", supervisors=lights), 200.0)


def gear_shift() -> Case:
    """A drive that shifts gears: w' = torque - w."""
    shift = Supervisor("shift", GEARS, {"w_up": 3.0}, inputs={"w": "w"})
    drive = Body("drive", inertia=1.0, force="shift.torque - w", x="phi", v="w")
    return Case(System("gear shift", bodies=(drive,), supervisors=(shift,)), 2.0)


def intermittent_drive() -> Case:
    """A mass of 1 kg with friction F_c = F_s = 1 N, pushed by 3 N for 1 s every 4 s."""
    return Case(
        System(
            "intermittent drive",
            bodies=(Body("sled", inertia=1.0, force="drive.F"),),
            contacts=(Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.0, "b": 0.0}),),
            supervisors=(Supervisor("drive", PUSHES),),
        ),
        8.0,
    )


def hot_brake() -> Case:
    """A disc whose brake is eased while it is hot; its heat is the power of the contact."""
    return Case(
        System(
            "hot brake",
            bodies=(Body("disc", inertia=2.0, force="20 - 2 * w", x="phi", v="w"),),
            contacts=(
                Contact("pad", BRAKE, {"mu": 0.4, "v_0": 0.1}, v="w", inputs={"N": "mode.N"}),
            ),
            supervisors=(
                Supervisor("mode", COOLED, {"C": 5.0, "h": 1.0}, inputs={"P": "pad.F * pad.v"}),
            ),
        ),
        60.0,
    )


CASES = (thermostat, crossing, gear_shift, intermittent_drive, hot_brake)
HEATING = (
    math.log(30.0 / 9.0),  # from 0 to 21 degrees
    math.log(21.0 / 19.0),  # cooling
    math.log(11.0 / 9.0),  # heating
)
