"""Systems with machines that are no contacts, with what is known of them in closed form."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gms_fsm import Body, Chart, Contact, State, Supervisor, System, Transition
from gms_fsm.charts import CHARTS
from tests.systems_cases import STICTION, Case

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
DAY, NIGHT = {"red": 30.0, "green": 25.0, "amber": 5.0}, {"lit": 1.0, "dark": 1.0}  # s each
LONG_DAY, LONG_NIGHT = 100.0, 20.5  # s
TWO_LEVELS = Chart(  # by night it blinks; by day it goes on where it was
    "light of two levels",
    inputs=(),
    velocities=(),
    states=(
        State("day", states=tuple(map(State, DAY)), history=True),
        State("night", states=tuple(map(State, NIGHT))),
    ),
    transitions=(
        *(
            Transition(f"from_{one}", f"{around}.{one}", f"{around}.{other}", guard=f"after({T})")
            for around, inside in (("day", DAY), ("night", NIGHT))
            for (one, T), other in zip(inside.items(), [*inside][1:] + [*inside][:1], strict=True)
        ),
        Transition("evening", "day", "night", guard=f"after({LONG_DAY})"),
        Transition("morning", "night", "day", guard=f"after({LONG_NIGHT})"),
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
RELAY = Chart(
    "relay",
    inputs=("x",),
    velocities=(),
    states=(State("pull", outputs={"u": "-1"}), State("push", outputs={"u": "1"})),
    transitions=(
        Transition("fall_below", "pull", "push", guard="x < 0"),
        Transition("rise_above", "push", "pull", guard="x > 0"),
    ),
)
VALVE = Chart(  # the stem q of He et al. (2007); r: force that is left, p: the last signal
    "valve stiction of He",
    inputs=("u",),
    velocities=(),
    variables=("r", "p", "q"),
    parameters=("f_s", "f_d"),
    states=(State("valve", outputs={"y": "q"}),),
    transitions=(
        Transition(
            "jump",
            "valve",
            "valve",
            guard="abs(r + u - p) > f_s",
            actions={
                "q": "u - sgn(r + u - p) * f_d",
                "r": "sgn(r + u - p) * f_d",
                "p": "u",
            },
        ),
        Transition(
            "stay", "valve", "valve", guard="u < p or u > p", actions={"r": "r + u - p", "p": "u"}
        ),
    ),
)
LATE = {"p": "u", "m": "n"}  # the sample n is dealt with, and its signal is the last one
KANO = Chart(  # d: direction, w: signal where it rests, p and q: last signal and its change
    "valve stiction of Kano",
    inputs=("u", "n"),
    velocities=(),
    variables=("d", "w", "p", "q", "y", "m"),
    initial={"d": 1.0, "m": -1.0},
    parameters=("S", "J"),
    states=(State("rests", outputs={"stem": "y"}), State("moves", outputs={"stem": "y"})),
    transitions=(
        Transition(
            "turn",
            "rests",
            "moves",
            guard="n > m and -d * (u - w) > S",
            actions={"y": "u + d * (S - J) / 2", "d": "-d", "q": "u - p", **LATE},
        ),
        Transition(
            "go_on",
            "rests",
            "moves",
            guard="n > m and d * (u - w) > J",
            actions={"y": "u - d * (S - J) / 2", "q": "u - p", **LATE},
        ),
        Transition("stay", "rests", "rests", guard="n > m", actions={"q": "u - p", **LATE}),
        Transition(
            "rest", "moves", "rests", guard="n > m and (u - p) * q <= 0", actions={"w": "p"}
        ),
        Transition(
            "slide",
            "moves",
            "moves",
            guard="n > m",
            actions={"y": "u - d * (S - J) / 2", "q": "u - p", **LATE},
        ),
    ),
)
STUCK, MOVED = {"w": "p", **LATE}, {"y": "u - d * (S - J) / 2", **LATE}
CHOUDHURY = Chart(  # d: direction of the signal, w: signal where it sticks, p: last signal
    "valve stiction of Choudhury",
    inputs=("u", "n"),
    velocities=(),
    variables=("d", "w", "p", "y", "m"),
    initial={"d": 1.0, "m": -1.0},
    parameters=("S", "J"),
    states=tuple(State(name, outputs={"stem": "y"}) for name in ("halted", "reversed", "moves")),
    transitions=(
        *(
            Transition(
                f"reverse_{name}",
                name,
                "reversed",
                guard="n > m and (u - p) * d < 0",
                actions={"d": "-d", **STUCK},
            )
            for name in ("halted", "reversed", "moves")
        ),
        Transition("pass_J", "halted", "moves", guard="n > m and abs(u - w) > J", actions=MOVED),
        Transition("pass_S", "reversed", "moves", guard="n > m and abs(u - w) > S", actions=MOVED),
        Transition("halt", "moves", "halted", guard="n > m and (u - p) * d <= 0", actions=STUCK),
        Transition("slide", "moves", "moves", guard="n > m", actions=MOVED),
        *(
            Transition(f"stay_{name}", name, name, guard="n > m", actions=LATE)
            for name in ("halted", "reversed")
        ),
    ),
)
GEARBOX = Chart(
    "gearbox",
    inputs=("w", "shut"),
    velocities=(),
    parameters=("w_up",),
    states=(
        State("first", outputs={"torque": "30", "N_1": "60", "N_2": "0"}),
        State("open", outputs={"torque": "-20", "N_1": "0", "N_2": "0"}),
        State("closing", outputs={"torque": "30", "N_1": "0", "N_2": "60"}),
        State("second", outputs={"torque": "30", "N_1": "0", "N_2": "60"}),
    ),
    transitions=(
        Transition("release", "first", "open", guard="w > w_up"),
        Transition("close", "open", "closing", guard="after(0.5)"),
        Transition("locked", "closing", "second", guard="shut > 0.5"),
    ),
)
CALM = Chart(
    "anti-hunting",
    inputs=("e", "rests"),
    velocities=(),
    parameters=("band",),
    states=(State("integrate", outputs={"k": "1"}), State("hold", outputs={"k": "0"})),
    transitions=(
        Transition("freeze", "integrate", "hold", guard="rests > 0.5 and abs(e) < band"),
        Transition("resume", "hold", "integrate", guard="rests < 0.5"),
    ),
)
LIFT = Chart(
    "lift",
    inputs=("x", "u"),
    velocities=(),
    parameters=("load", "h"),
    states=(
        State("parked", outputs={"N": "40", "run": "1"}),
        State("lifting", outputs={"N": "0", "run": "1"}),
        State("arrived", outputs={"N": "40", "run": "0"}),
    ),
    transitions=(
        Transition("ease", "parked", "lifting", guard="u >= load"),
        Transition("apply", "lifting", "arrived", guard="x >= h"),
    ),
)
PARKING = Chart(
    "parking brake",
    inputs=("v", "N"),
    parameters=("mu",),
    states=(
        State("stuck", locked=True),
        State("up", outputs={"F": "mu * N"}),
        State("down", outputs={"F": "-mu * N"}),
    ),
    transitions=(
        Transition("release_up", "stuck", "up", guard="F > mu * N"),
        Transition("release_down", "stuck", "down", guard="F < -mu * N"),
        Transition("arrest_up", "up", "stuck", guard="v < 0"),
        Transition("arrest_down", "down", "stuck", guard="v > 0"),
    ),
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


def relay() -> Case:
    """A mass of 1 kg with friction of 0.5 N, drawn to x = 0 by the 1 N of a relay."""
    return Case(
        System(
            "relay",
            bodies=(Body("mass", inertia=1.0, force="relay.u"),),
            contacts=(Contact("pad", STICTION, {"F_c": 0.5, "F_s": 0.5, "b": 0.0}),),
            supervisors=(Supervisor("relay", RELAY, inputs={"x": "x"}),),
        ),
        3.5,
        initial={"mass.x": 1.0},
    )


def valve() -> Case:
    """A sticking valve, asked once a second."""
    inputs = {"u": "sin(0.25 * t)"}
    stem = Supervisor("valve", VALVE, {"f_s": 0.3, "f_d": 0.2}, inputs=inputs, period=1.0)
    return Case(System("valve", supervisors=(stem,)), 60.0)


def sampled_valve(chart: Chart, S: float, J: float, signal: Sequence[float]) -> Case:
    """A sticking valve that gets one value of a signal a second."""
    values, inputs = {"S": S, "J": J}, {"u": "u", "n": "t"}
    stem = Supervisor("valve", chart, values, inputs=inputs, period=1.0)
    corners = [(float(k), value) for k, value in enumerate([*signal, signal[-1]])]
    return Case(System("valve", supervisors=(stem,), signals={"u": corners}), float(len(signal)))


def clutches() -> Case:
    """A car of 20 kg m^2 that shifts up: a gear of 3 and one of 2, each with its clutch."""
    gears = (("one", 3, "box.N_1"), ("two", 2, "box.N_2"))
    inputs = {"w": "w_e", "shut": "is_in(two.stuck)"}
    return Case(
        System(
            "clutches",
            bodies=(
                Body("engine", inertia=1.0, force="box.torque", x="phi_e", v="w_e"),
                Body("car", inertia=20.0, force="-10", x="phi_c", v="w_c"),
            ),
            contacts=tuple(
                Contact(name, PARKING, {"mu": 1.0}, v=f"w_e - {ratio} * w_c", inputs={"N": N})
                for name, ratio, N in gears
            ),
            supervisors=(Supervisor("box", GEARBOX, {"w_up": 100.0}, inputs=inputs),),
        ),
        15.0,
    )


def hunting(band: float = 0.05) -> Case:
    """A servo with stiction, whose integral is frozen while the mass rests near its aim."""
    inputs = {"e": "1 - x", "rests": "is_in(pad.stuck)"}
    return Case(
        System(
            "hunting",
            bodies=(Body("mass", inertia=1.0, force="20 * (1 - x) + 40 * i - 3 * v"),),
            contacts=(Contact("pad", STICTION, {"F_c": 1.0, "F_s": 1.5, "b": 0.0}),),
            supervisors=(Supervisor("calm", CALM, {"band": band}, inputs=inputs),),
            flow={"i": "calm.k * (1 - x)"},
        ),
        20.0,
    )


def lift() -> Case:
    """A cage of 2 kg whose brake is eased when the motor, 4 N/s, carries its 20 N."""
    inputs = {"x": "x", "u": "4 * t"}
    return Case(
        System(
            "lift",
            bodies=(Body("cage", inertia=2.0, force="control.run * 4 * t - 20"),),
            contacts=(Contact("brake", PARKING, {"mu": 0.75}, inputs={"N": "control.N"}),),
            supervisors=(Supervisor("control", LIFT, {"load": 20.0, "h": 1.0}, inputs=inputs),),
        ),
        8.0,
    )


CASES = (
    thermostat,
    crossing,
    gear_shift,
    intermittent_drive,
    hot_brake,
    relay,
    valve,
    hunting,
    lift,
    clutches,
)
HEATING = (
    math.log(30.0 / 9.0),  # from 0 to 21 degrees
    math.log(21.0 / 19.0),  # cooling
    math.log(11.0 / 9.0),  # heating
)
