"""engine="compiled" gives the same as engine="machines", to the last bit, including failures.

Compared are rows, micro-steps, states, thresholds, forces, rates, both sides of every stop and the
transition log; if a run fails, the same error with the same text and the same recorded part.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gms_fsm
from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    LuGre,
    Prescribed,
    PulledSlider,
    Slider,
    State,
    Stribeck,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts import gms_element
from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.lowering.program import lower
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import Signal, as_signal
from gms_fsm.traces.failures import (
    LivelockError,
    NotFiniteError,
    SignalEndError,
    SimulationError,
    StepSizeError,
)
from tests.helpers import (
    CURVE,
    FIG3_FORCE,
    FIG4_SINE,
    FunctionBelt,
    non_drifting,
    open_loop,
    pulled_mass,
    same_bits,
    stick_slip,
    wear,
)

pytest.importorskip("llvmlite", reason="needs the extra fast")

from gms_fsm.lowering import _compiled as compiled
from tests.helpers import ROOT


# --------------------------------------------------------------------------- comparing
def _bits(name: str, a: np.ndarray, b: np.ndarray) -> None:
    """Assert equal bit patterns: 0.0 is not -0.0; a NaN is a NaN, whatever its payload."""
    assert a.dtype == b.dtype, name
    assert a.shape == b.shape, name
    if a.dtype == np.float64:
        np.testing.assert_array_equal(np.isnan(a), np.isnan(b), err_msg=name)
        a, b = (np.where(np.isnan(u), 0.0, u).view(np.int64) for u in (a, b))
    np.testing.assert_array_equal(a, b, err_msg=name)


def identical(a: Trace, b: Trace) -> None:
    """Assert that nothing in two traces differs."""
    same_bits(a, b)
    for part in ("rows", "stops"):
        for column in ("t", "microstep", "y", "mode"):
            _bits(f"{part}.{column}", *(getattr(getattr(u, part), column) for u in (a, b)))
    for column in ("v", "s", "F", "F_elements", "dz"):
        _bits(column, getattr(a, column), getattr(b, column))
    _same_logs(a, b)


def _same_logs(a: Trace, b: Trace) -> None:
    assert a.transitions.dtype == b.transitions.dtype
    for column in a.transitions.dtype.names:
        _bits(f"log {column}", np.array(a.transitions[column]), np.array(b.transitions[column]))


def _run(model: Model, rig: Rig, arguments: Mapping[str, Any]) -> tuple[Trace | None, str]:
    try:
        return simulate(model, rig, **arguments), ""
    except GMSError as error:
        return getattr(error, "trace", None), f"{type(error).__name__}: {error}"


def both(model: Model, rig: Rig, t_end: float, **options: Any) -> tuple[Trace, str]:
    """Run both engines and compare; return one trace and the error, or an empty text."""
    (one, said), (other, too) = (
        _run(model, rig, {"t_end": t_end, "engine": engine, **options})
        for engine in ("machines", "compiled")
    )
    assert said == too
    assert one is not None, said
    assert other is not None
    identical(one, other)
    return one, said


def agreed(model: Model, rig: Rig, t_end: float, **options: Any) -> Trace:
    """Run both engines to the end and compare; return one trace."""
    trace, said = both(model, rig, t_end, **options)
    assert not said
    return trace


# --------------------------------------------------------------------------- shipped scenarios
def _data_folder() -> Path | None:
    for folder in (os.environ.get("GMS_FSM_DATA"), ROOT.parent / "shared" / "data"):
        if folder and (Path(folder) / "reciprocating_friction.tsv").is_file():
            return Path(folder)
    return None


@pytest.mark.slow
def test_every_shipped_scenario(monkeypatch: pytest.MonkeyPatch) -> None:
    """One after the other in one process: programs of one kind must not be confused."""
    folder = _data_folder()
    paths = sorted((ROOT / "scenarios").glob("*.toml"))
    # Systems are in tests/systems and tests/zoo.
    paths = [path for path in paths if "[[body]]" not in path.read_text(encoding="utf-8")]
    if folder is None:
        paths = [path for path in paths if path.stem != "tribometer"]
    else:
        monkeypatch.setenv("GMS_FSM_DATA", str(folder))
    count = {}
    for path in paths:
        loaded = load_scenario(path)
        arguments = {name: u for name, u in loaded.arguments.items() if name != "engine"}
        count[path.stem] = len(agreed(loaded.model, loaded.rig, **arguments).transitions)
    assert len(count) >= 5
    assert count["pulled_mass"] == 72


FIXED = {"method": "rk4", "step": 7.003e-3}
T_EVAL = np.linspace(0, 12, 777)
OPTIONS: dict[str, dict[str, Any]] = {
    "dp45": {},
    "bs23": {"method": "bs23"},
    "tight": {"rtol": 1e-10, "atol": 1e-13},
    "loose": {"rtol": 1, "atol": 1},  # integers
    "max_step": {"max_step": 1e-2},
    "dp45 on a grid": {"step": 1e-2},
    "euler": {"method": "euler", "step": 5.003e-3},
    "heun": {"method": "heun", "step": 5.003e-3},
    "rk4": FIXED,
    "rk4 by step": FIXED | {"events": "step"},
    "euler by step": {"method": "euler", "step": 5.003e-3, "events": "step"},
    "dp45 by step": {"events": "step", "max_step": 1e-2},
    "bs23 by step": {"method": "bs23", "events": "step", "max_step": 1e-2},
}
FEW = ("dp45", "bs23", "rk4", "dp45 by step", "rk4 by step")
CASES: dict[str, tuple[Model, Rig]] = {
    "open loop, signed": (stick_slip("signed"), open_loop()),
    "fig. 4, published": (stick_slip("published"), Prescribed(FIG4_SINE)),
    "fig. 3, slipping": non_drifting("signed", slipping=True),
    "pulled mass": pulled_mass(),
}


@pytest.mark.parametrize("options", OPTIONS)
@pytest.mark.parametrize("case", CASES)
def test_every_method(case: str, options: str) -> None:
    assert len(agreed(*CASES[case], 12.0, **OPTIONS[options]).transitions) > 0


@pytest.mark.slow
@pytest.mark.parametrize("options", FEW)
@pytest.mark.parametrize("case", CASES)
def test_requested_rows_and_only_the_end(case: str, options: str) -> None:
    trace = agreed(*CASES[case], 12.0, **OPTIONS[options], t_eval=T_EVAL)
    np.testing.assert_array_equal(trace.t, T_EVAL)
    assert len(trace.stops) > len(trace.transitions) > 0
    _same_logs(agreed(*CASES[case], 12.0, **OPTIONS[options], output="end"), trace)


@pytest.mark.parametrize("law", ["signed", "published"])
def test_fig_3_as_printed(law: str) -> None:
    assert len(agreed(*non_drifting(law), 30.0).transitions) == 0


@pytest.mark.parametrize("rig", [Prescribed("1e-3*(1.5+cos(10*t))"), Slider(1.0, FIG3_FORCE)])
def test_lugre(rig: Rig) -> None:
    model = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4.0, stribeck=Stribeck(1.0, 1.5, 1e-3))
    trace = agreed(model, rig, 6.0)
    assert len(trace.transitions) == 0
    agreed(model, rig, 6.0, **FIXED, events="step")
    agreed(model, rig, 6.0, output="end")


@pytest.mark.slow
def test_a_run_that_fills_its_columns_many_times_over() -> None:
    """More rows, firings and stops than there is room for at first, in several calls."""
    model, _ = pulled_mass()
    trace = agreed(model, Prescribed("0.3*sin(20*t)"), 40.0, **FIXED)
    assert len(trace) > 6000
    assert len(trace.transitions) > 1024
    few = agreed(model, Prescribed("0.3*sin(20*t)"), 40.0, t_eval=[0.0, 40.0])
    assert len(few.stops) > 2048
    agreed(model, Prescribed("0.3*sin(20*t)"), 2.1, method="euler", step=1e-4)  # 21,000 steps


@pytest.mark.slow
def test_a_run_that_starts_before_zero() -> None:
    trace = agreed(stick_slip("signed"), open_loop(), 11.0, t_start=-20.5)
    assert trace.t[0] == -20.5
    assert len(trace.transitions) > 8
    agreed(stick_slip("signed"), open_loop(), -1.0, t_start=-20.5, **FIXED)


def test_initial_values() -> None:
    initial = {"x": 0.5, "v": 0.01, "z": [0, 0.001, 0.002, 0.003], "states": ["slip"] * 4}
    trace = agreed(*pulled_mass(), 5.0, initial=initial)
    assert trace.states[0].tolist() == ["slip"] * 4
    agreed(*pulled_mass(), 5.0, initial=initial, output="end")


# --------------------------------------------------------------------------- signals
@dataclass(frozen=True, eq=False)
class TwoForces:
    """A user-defined rig with two signals, a number, time and position in its equation."""

    first: Any
    second: Any
    mass: float = 1.0
    title: str = field(default="two forces", init=False)
    acceleration: str = field(default="(F_a + F_b * cos(t) - 0.1 * x - F) / mass", init=False)

    @property
    def signals(self) -> Mapping[str, Signal]:
        return {"F_a": as_signal(self.first), "F_b": as_signal(self.second)}

    @property
    def numbers(self) -> Mapping[str, float]:
        return {"mass": self.mass}


JUMPS = [0, 1, 1, 2, 2.5, 2.5, 2.5, 10], [0.1, 0.2, -0.3, -0.3, 0.5, 0.6, 0.7, 0]
_noise = np.random.default_rng(3)
SAMPLES = np.linspace(0, 10, 501), _noise.normal(size=501).cumsum() * 0.02
VELOCITIES: dict[str, Any] = {
    "a number": 0.1,
    "ramps": [(0, 0), (2, 0.2), (4, -0.2), (9, 0.3)],
    "ramps with jumps": list(zip(*JUMPS, strict=True)),
    "a jump at the start and at the end": [(0, 0.1), (0, 0.2), (10, -0.2), (10, 0.2)],
    "ramps that begin later": [(3, 0.2), (4, -0.2)],
    "a record": SAMPLES,
    "a record with jumps": JUMPS,
    "corners": "0.1*abs(sin(t)) + min(0.1, max(-0.1, sin(5*t)))",
    "jumps of an expression": "0.2*sgn(cos(0.7*t)) - 0.05*sgn(sin(t))",
    "powers": "0.2*sin(t)*8**(sin(3*t)/3) + 0.05*(1.1 + cos(t))**0.5 - 0.02*2**cos(t)",
    "all functions": "0.4*tanh(sin(t))*exp(-0.1*t) + 0.1*cos(3*t)*sqrt(t)/(1 + t**2)",
}


@pytest.mark.slow
@pytest.mark.parametrize("velocity", VELOCITIES)
def test_every_kind_of_velocity(velocity: str) -> None:
    model, rig = stick_slip("signed"), Prescribed(VELOCITIES[velocity])
    trace = agreed(model, rig, 10.0)
    assert len(trace.transitions) > 0
    agreed(model, rig, 10.0, method="heun", step=0.013, events="step")
    agreed(model, rig, 10.0, **FIXED)
    agreed(model, rig, 10.0, t_eval=[0.0, 1.0, 2.0, 2.5, 3.0, 10.0])
    agreed(model, rig, 10.0, output="end", method="bs23")


@pytest.mark.parametrize(
    "forces",
    [
        (([0, 3, 3, 7, 12.0], [0, 1, 0.5, 2, 0]), (SAMPLES[0] * 1.2, SAMPLES[1])),
        ([(0, 0), (5, 3)], (np.linspace(0, 12, 7), [0, 1, 0, 2, 0, 3, 0])),
        ("sgn(sin(t))*2", [(0, 0), (5, 3), (5, -3)]),
        ([(0, 1), (1, 2), (1, -2), (6, 4)], 0.5),
    ],
    ids=["two records", "ramps and a record", "expression and ramps", "ramps and a number"],
)
def test_tables_of_different_lengths(forces: tuple[Any, Any]) -> None:
    trace = agreed(stick_slip("signed"), TwoForces(*forces), 12.0)
    assert len(trace.transitions) > 0
    agreed(stick_slip("signed"), TwoForces(*forces, mass=0.3), 12.0, t_eval=[0.0, 3.0, 5.0, 12.0])
    agreed(stick_slip("signed"), TwoForces(*forces), 12.0, **FIXED, output="end")


@pytest.mark.slow
@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    st.lists(st.floats(0, 1.5, allow_subnormal=False) | st.just(0.0), min_size=2, max_size=12),
    st.lists(st.floats(-0.5, 0.5), min_size=12, max_size=12),
    st.booleans(),
)
def test_random_corners_and_jumps(gaps: list[float], values: list[float], held: bool) -> None:
    times = np.concatenate([[0.0], np.cumsum(gaps), [np.sum(gaps) + 1.0]])
    level = np.resize(values, times.size)
    given = list(zip(times, level, strict=True)) if held else (times, level)
    rig = Prescribed(given)
    if times[1] > 0.0 or held:  # a record must cover the start
        agreed(stick_slip("signed"), rig, float(times[-1]), rtol=1e-5)


# --------------------------------------------------------------------------- parameters
@st.composite
def _banks(draw: st.DrawFn) -> GMS:
    n = draw(st.sampled_from([2, 5]))  # each is compiled; the others are below

    def numbers(low: float, high: float) -> list[float]:
        return draw(st.lists(st.floats(low, high), min_size=n, max_size=n))

    F_c = draw(st.floats(0.1, 1.0))
    parameters = GMSParameters(
        numbers(1, 50),
        numbers(0, 0.5),
        numbers(0.005, 0.5),
        sigma_2=draw(st.floats(0.05, 1)),
        stribeck=Stribeck(F_c, F_c * draw(st.floats(1.01, 3)), draw(st.floats(0.01, 0.2))),
        v_c=draw(st.floats(1e-7, 1e-4)),
        weights=numbers(5e-3, 5e-2),
    )
    return GMS(parameters, law=draw(st.sampled_from(["signed", "published"])))


METHODS = st.sampled_from(["dp45", "bs23", "rk4", "heun", "euler"])


@pytest.mark.slow
@settings(max_examples=12, deadline=None, derandomize=True)
@given(_banks(), METHODS, st.floats(0.05, 1.0), st.sampled_from(["located", "step"]))
def test_random_banks_open_loop(model: GMS, method: str, level: float, events: str) -> None:
    ramps = [(0.0, 0.0), (1.0, level), (2.0, -level), (2.0, level), (3.0, -0.5 * level)]
    options: dict[str, Any] = {"method": method, "events": events, "rtol": 1e-5}
    if method not in ("dp45", "bs23"):
        options["step"] = 7.3e-3
    elif events == "step":
        options["max_step"] = 2e-2
    both(model, Prescribed(ramps), 3.0, **options)


@pytest.mark.slow
@settings(max_examples=8, deadline=None, derandomize=True)
@given(_banks(), METHODS, st.floats(0.5, 5.0), st.sampled_from(["all", "end"]))
def test_random_banks_closed_loop(model: GMS, method: str, stiffness: float, output: str) -> None:
    """The published law slides occasionally: both engines alike."""
    step = None if method in ("dp45", "bs23") else 7.3e-3
    both(
        model,
        PulledSlider(1.0, stiffness, 0.1),
        4.0,
        method=method,
        step=step,
        rtol=1e-5,
        output=output if model.law == "signed" else "all",
    )


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 12])
def test_any_number_of_elements(n: int) -> None:
    parameters = GMSParameters(
        np.linspace(1, 3, n),
        [0.1] * n,
        [0.1] * n,
        sigma_2=0.1,
        stribeck=Stribeck(0.4, 0.8, 1e-2),
        v_c=1e-6,
        weights=np.linspace(0.3, 1, n),
    )
    trace = agreed(GMS(parameters, law="signed"), Prescribed("0.2*sin(2*pi*t/7)"), 14.0)
    assert set(trace.transitions.element.tolist()) == set(range(n))


# --------------------------------------------------------------------------- user-defined charts
SWINGING, PULLED = Prescribed("0.3*sin(2*pi*t/17)"), PulledSlider(1, 2, 0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rig", "options"),
    [
        (SWINGING, "dp45"),
        (SWINGING, "rk4 by step"),
        (PULLED, "dp45 by step"),
        (PULLED, "rk4"),
    ],
)
def test_assignments_entry_and_exit(rig: Rig, options: str) -> None:
    for n in (1, 3):
        trace = agreed(wear(n), rig, 40.0, **OPTIONS[options])
        assert {"yield_", "tear"} <= set(trace.transitions.edge.tolist())
        agreed(wear(n), rig, 12.0, **OPTIONS[options], t_eval=T_EVAL)


def test_a_reset_in_stateflows_order() -> None:
    chart = Chart(
        "order, compiled",
        inputs=("t",),
        variables=("z", "w"),
        parameters=(),
        states=(
            State("a", {"z": "0", "w": "0"}, exit={"z": "z + 1", "w": "z"}),
            State("b", {"z": "0", "w": "1"}, entry={"z": "z + 0.5", "w": "w + z"}),
        ),
        transitions=(Transition("go", "a", "b", "t >= 1", actions={"z": "10 * z", "w": "w * z"}),),
        outputs={"F": "z"},
    )
    model = ChartModel(chart, {}, n=2, stribeck=CURVE)
    trace = agreed(model, Prescribed("0"), 2.0, initial={"z": [2.0, 3.0], "w": [0.0, 0.0]})
    assert trace.z[-1].tolist() == [30.5, 40.5]
    assert trace.transitions.F_after[0] == 30.5 + 3.0


def _function(text: str) -> ChartModel:
    """Return a chart whose force is a function of z."""
    chart = Chart("f", ("v",), ("z",), (), (State("on", {"z": "0"}),), (), {"F": text})
    return ChartModel(chart, {}, n=1, stribeck=CURVE)


def _argument_values() -> list[float]:
    rng = np.random.default_rng(11)
    whole = [float(u) for u in range(-12, 13)]
    near = rng.normal(0, 2, 1500).tolist() + rng.uniform(-800, 800, 500).tolist()
    wide = (rng.choice([-1, 1], 500) * 10 ** rng.uniform(-300, 300, 500)).tolist()
    return [0.0, -0.0, *whole, *near, *wide]


FUNCTIONS = [
    "8**z",
    "2**z",
    "0.5**z",
    "10**z",
    "z**0.5",
    "z**(-0.5)",
    "abs(z)**0.25",
    "z**(-1.0)",
    "z**9",
    "exp(z)**0.5",
    "pi**z",
    "z**z",
    "z**5",
    "exp(z)",
    "exp(-z)*exp(z)",
    "sin(z)*cos(z)",
    "tanh(z)",
    "sqrt(z)",
    "1/z",
    "z/3*3",
    "0*z",
    "-z",
    "sgn(sqrt(z))",
    "min(z, sqrt(z))",
    "max(sqrt(z), z)",
    "min(0*z, -0*z)",
    "max(z, 1, sqrt(z))",
    "abs(-abs(z))",
    "1e300*z*z",
    "(z - z)/(z - z)",
]


@pytest.mark.parametrize("text", FUNCTIONS)
def test_every_function_at_many_places(text: str) -> None:
    """Compilers turn 8**z into exp2 and z**0.5 into sqrt, which differ in the last bits."""
    values = _argument_values()
    program = lower(_function(text), Prescribed("0"))
    y = np.column_stack([np.zeros(len(values)), values])
    mode = np.zeros((len(values), program.layout.modes), dtype=np.int64)
    found = compiled.observe_rows(program, np.zeros(len(values)), y, mode, range(5))
    wanted, out = np.empty_like(found), [0.0] * 5
    for row, place in enumerate(y.tolist()):
        program.ieee["observe"](0.0, place, [0], program.live, program.p, out)
        wanted[row] = out
    _bits(text, wanted[:, 1], found[:, 1])


# --------------------------------------------------------------------------- failures
def _broken(*edges: Transition) -> ChartModel:
    sound = gms_element("signed")
    chart = Chart(
        "broken",
        sound.inputs,
        sound.variables,
        sound.parameters,
        sound.states,
        edges,
        sound.outputs,
    )
    values = {"k": 1, "sigma": 0.1, "C": 0.1, "v_c": 0.2}
    return ChartModel(chart, values, n=2, stribeck=Stribeck(1.0, 1.5, 1e-3), weights=[2, 1])


def _flow(text: str) -> ChartModel:
    chart = Chart(
        "flow", ("v", "t"), ("z",), ("k",), (State("on", {"z": text}),), (), {"F": "k * z"}
    )
    return ChartModel(chart, {"k": 1.0}, n=2, stribeck=CURVE)


BOTH_WAYS = _broken(
    Transition("break_away", "stick", "slip", guard="abs(z) >= s and abs(v) <= v_c"),
    Transition("arrest", "slip", "stick", guard="abs(v) <= v_c and abs(z) < 10 * s"),
)
BLOW_UP = {"initial": {"z": [0.1, 1.0]}}
STEPS = {"method": "rk4", "step": 0.01}
LOOPS = _broken(Transition("again", "stick", "stick", guard="z >= s"))
BAD_ACTION = _broken(
    Transition("go", "stick", "slip", guard="z >= 0.05", actions={"z": "1 / (z - z)"})
)
RECORD = np.linspace(0, 35, 701), 0.2 * np.sin(2 * np.pi * np.linspace(0, 35, 701) / 20)


def _nan(guard: str) -> ChartModel:
    return _broken(Transition("go", "stick", "slip", guard=guard))


FAILURES: dict[str, tuple[type[SimulationError], Model, Rig, float, dict[str, Any]]] = {
    "livelock": (LivelockError, BOTH_WAYS, Prescribed("0.15"), 20.0, {}),
    "self-loop": (LivelockError, LOOPS, Prescribed("0.5"), 5.0, {}),
    "no slope": (LivelockError, _flow("0"), FunctionBelt(), 5.0, {"initial": {"v": 1.0}}),
    "blow-up": (StepSizeError, _flow("z * z"), Prescribed("0"), 2.0, BLOW_UP),
    "blow-up, bs23": (
        StepSizeError,
        _flow("z * z"),
        Prescribed("0"),
        2.0,
        BLOW_UP | {"method": "bs23", "rtol": 1e-4},
    ),
    "blow-up by step": (
        StepSizeError,
        _flow("z * z"),
        Prescribed("0"),
        2.0,
        BLOW_UP | {"events": "step", "max_step": 0.05},
    ),
    "blow-up, rk4": (NotFiniteError, _flow("z * z"), Prescribed("0"), 20.0, BLOW_UP | STEPS),
    "blow-up, rk4 by step": (
        NotFiniteError,
        _flow("z * z"),
        Prescribed("0"),
        20.0,
        BLOW_UP | STEPS | {"events": "step"},
    ),
    "pole of t": (StepSizeError, _flow("1 / (1 - t)**2"), Prescribed("0"), 2.0, {}),
    "odd pole of t": (SimulationError, _flow("1 / (t - 1)"), Prescribed("0"), 2.0, {}),
    "infinite at once": (NotFiniteError, _flow("1 / (k - 1)"), Prescribed("0"), 2.0, {}),
    "sqrt leaves its domain": (
        NotFiniteError,
        stick_slip("published"),
        Prescribed("0.1*sqrt(3 - t)"),
        10.0,
        {},
    ),
    "sqrt, fixed steps": (
        NotFiniteError,
        stick_slip("published"),
        Prescribed("0.1*sqrt(3 - t)"),
        10.0,
        STEPS,
    ),
    "exp overflows": (
        NotFiniteError,
        stick_slip("published"),
        Prescribed("exp(800*(t - 2.9))"),
        10.0,
        {},
    ),
    "division by zero": (
        SimulationError,
        stick_slip("signed"),
        Prescribed("0.1/(2 - t)"),
        10.0,
        {},
    ),
    "nothing at the start": (
        NotFiniteError,
        stick_slip("signed"),
        Prescribed("sqrt(-1 - t)"),
        10.0,
        {},
    ),
    "a force without end": (SimulationError, pulled_mass()[0], Slider(1.0, "exp(300*t)"), 10.0, {}),
    "a guard of NaN": (NotFiniteError, _nan("0 / (z - z) > 0"), Prescribed("0.1"), 1.0, {}),
    "a root in a guard": (NotFiniteError, _nan("sqrt(-1 - z) > 0"), Prescribed("0.1"), 1.0, {}),
    "an action of NaN": (NotFiniteError, BAD_ACTION, Prescribed("0.1"), 1.0, {}),
    "the record ends": (SignalEndError, stick_slip("signed"), Prescribed(RECORD), 61.0, {}),
    "the record ends, rk4": (SignalEndError, stick_slip("signed"), Prescribed(RECORD), 61.0, STEPS),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", FAILURES)
def test_failures_have_identical_messages(case: str) -> None:
    error, model, rig, t_end, options = FAILURES[case]
    whole, said = both(model, rig, t_end, **options)
    kind, _, text = said.partition(": ")
    assert issubclass(getattr(gms_fsm, kind), error), said
    assert "kept" in text
    assert "np." not in text
    assert len(whole) >= 1
    times = np.linspace(0, t_end, 41)
    sampled, again = both(model, rig, t_end, **options, t_eval=times)
    assert again == said
    np.testing.assert_array_equal(sampled.t, times[times <= whole.t[-1]][: len(sampled)])
    _same_logs(sampled, whole)


@pytest.mark.slow
@pytest.mark.parametrize("case", FAILURES)
def test_failures_keep_the_state_reached(case: str) -> None:
    """With output="end" the recorded row is the last one that output="all" would record."""
    _, model, rig, t_end, options = FAILURES[case]
    arguments = {"t_end": t_end, "engine": "compiled", **options}
    whole, said = _run(model, rig, arguments)
    end, again = _run(model, rig, arguments | {"output": "end"})
    assert said == again != ""
    assert whole is not None
    assert end is not None
    _bits("t", whole.t[-1:], end.t)
    _bits("y", whole.rows.y[-1:], end.rows.y)
    _same_logs(whole, end)


@pytest.mark.parametrize("case", FAILURES)
def test_failures_keep_the_same_end(case: str) -> None:
    _, model, rig, t_end, options = FAILURES[case]
    both(model, rig, t_end, **options, output="end")


@pytest.mark.parametrize("guard", ["1 / (z - z) > 0", "exp(1e4 + z) > 0"])
def test_an_infinite_side_of_a_guard(guard: str) -> None:
    trace = agreed(_broken(Transition("go", "stick", "slip", guard=guard)), Prescribed("0.1"), 1.0)
    assert set(trace.transitions.t.tolist()) == {0.0}


def test_an_infinite_force_is_recorded_unchanged() -> None:
    chart = Chart("loud", ("v",), ("z",), (), (State("on", {"z": "v"}),), (), {"F": "1 / (1 - z)"})
    model = ChartModel(chart, {}, n=1, stribeck=CURVE)
    trace = agreed(model, Prescribed("1"), 2.0, initial={"z": [1.0]})
    assert np.isinf(trace.F[0])


def test_scipy_solvers_are_not_compiled() -> None:
    scipy_integrate = pytest.importorskip("scipy.integrate")
    with pytest.raises(
        ParameterError, match=r"'compiled' runs the built-in methods.*RK45.*'machines'"
    ):
        simulate(
            stick_slip("signed"), open_loop(), 1.0, engine="compiled", method=scipy_integrate.RK45
        )
