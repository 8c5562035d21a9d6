"""Claim: FMPy runs the FMUs as the engine runs, in both versions and both kinds, and whole systems.

FMPy 0.3.32 does not give the inputs to the right side of a Model Exchange FMU, only to its event
indicators; so its accuracy is judged where the motion is a formula, and with a record only the
sequence of switches is.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu

from gms_fsm import Body, Contact, FrictionState, Prescribed, Settings, System, simulate
from gms_fsm.charts.registry import registered
from gms_fsm.charts.zoo.sliding.karnopp import KARNOPP
from gms_fsm.systems.models import ChartModel, demonstration
from tests.exporters.c_cases import CASES, case
from tests.exporters.c_programs import known_floors
from tests.exporters.fmus import (
    END,
    FORMATS,
    PAPER,
    Slave,
    paper_record,
    switched,
    taken,
    written,
)

Ran = Callable[..., None]
FMPY = f"FMPy {fmpy.__version__}"
STATES = [f"state[{k + 1}]" for k in range(4)]
BODY = {"bodies": (Body("mass", inertia="m", force="f", x="x", v="v"),), "numbers": {"m": 1.0}}
KARNOPP_ON_A_MASS = System(
    "mass",
    contacts=(
        Contact(
            "pad", ChartModel(KARNOPP, {"F_c": 1.0, "F_s": 1.5, "sigma_2": 0.4, "D": 1e-4}), v="v"
        ),
    ),
    signals={"f": "3 * sin(1.5 * t) * min(t, 1)"},
    **BODY,  # type: ignore[arg-type]
)
# Dry friction by sgn(v), besides a bristle: the motion slides along v = 0 when it rests.
SGN_ON_A_MASS = System(
    "mass",
    bodies=(
        Body("mass", inertia="1.0", force="3 * sin(1.5 * t) * min(t, 1) - sgn(v)", x="x", v="v"),
    ),
    contacts=(Contact("friction", PAPER, v="v"),),
)
GMS_ON_A_FORMULA = System(
    "open loop",
    bodies=(Body("body", velocity="v"),),
    contacts=(Contact("friction", PAPER, v="v"),),
    signals={"v": "0.2 * sin(2 * pi * t / 20)"},
)


def servo() -> System:
    """Return the servo of the scenarios."""
    from gms_fsm.app.scenario import load_system

    return load_system(Path(__file__).parents[2] / "scenarios" / "servo.toml")


def simulated(path: Path, kind: str, end: float, **options: Any) -> np.ndarray:
    """Return the result of FMPy."""
    result = fmpy.simulate_fmu(str(path), fmi_type=kind, stop_time=end, **options)
    assert isinstance(result, np.ndarray)
    return result


# --------------------------------------------------------------------------- the paper's open loop
@pytest.mark.parametrize("form", FORMATS)
def test_the_model_description_is_valid(form: str, tmp_path: Path, ran: Ran) -> None:
    for what in (PAPER, servo(), KARNOPP_ON_A_MASS):
        assert validate_fmu(str(written(what, form, tmp_path, name="it"))) == []
    ran(form, FMPY, "validation of three FMUs", "no findings")


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("solver", ["CVode", "Euler"])
def test_model_exchange_takes_all_edges(form: str, solver: str, tmp_path: Path, ran: Ran) -> None:
    t, v = paper_record()
    trace = simulate(PAPER, Prescribed((t, v)), END)
    record = np.array(list(zip(t, v, strict=True)), dtype=[("time", "f8"), ("v", "f8")])
    step = {"output_interval": 0.01} if solver == "CVode" else {
        "output_interval": 1e-3, "step_size": 1e-3
    }  # fmt: skip
    result = simulated(
        written(PAPER, form, tmp_path, name="gms"), "ModelExchange", END, solver=solver,
        input=record, output=STATES, **step,
    )  # fmt: skip
    found = switched(result, STATES, ("stick", "slip"))
    assert sorted(taken(trace)) == sorted(each[1:] for each in found)
    if solver == "CVode":  # Euler takes the edges of one step in the order of the elements
        assert [each[1:] for each in found] == taken(trace)
    assert len(found) == 48
    order = "in sequence" if solver == "CVode" else "those of a step in the order of the elements"
    ran(form, FMPY, f"open loop, Model Exchange, {solver}", f"48 of 48 switches, {order}")


@pytest.mark.parametrize("form", FORMATS)
def test_model_exchange_is_accurate(form: str, tmp_path: Path, ran: Ran) -> None:
    trace = simulate(GMS_ON_A_FORMULA, END, rtol=1e-9)
    names = [f"friction.{each}" for each in STATES]
    result = simulated(
        written(GMS_ON_A_FORMULA, form, tmp_path, name="gms"), "ModelExchange", END,
        relative_tolerance=1e-8, output_interval=0.01, output=names,
    )  # fmt: skip
    found = switched(result, names, ("stick", "slip"))
    assert [each[1:] for each in found] == taken(trace)
    late = np.abs([each[0] for each in found] - trace.transitions.t).max()
    assert late < 1e-5
    ran(
        form, FMPY, "open loop as a formula, Model Exchange, CVode", f"switches within {late:.0e} s"
    )


@pytest.mark.parametrize("form", FORMATS)
def test_co_simulation_gives_the_engine_s_bits(form: str, tmp_path: Path, ran: Ran) -> None:
    path = written(PAPER, form, tmp_path, name="gms")
    t, v = paper_record()
    state, slave, forces = FrictionState(PAPER), Slave(path), []
    for j in range(1, t.size):
        h = float(t[j] - t[j - 1])
        # The last bit of the end of a line that is given by its derivative is that of v + dv * h.
        last = v[j] if form == "fmu3" else v[j - 1] + (v[j] - v[j - 1]) / h * h
        forces.append(state.advance(float(v[j - 1]), float(last), h))
    found = slave.run(t, ["F"], v=v)[:, 0]
    np.testing.assert_array_equal(found, forces)
    assert slave.count("switches") == 48
    how = "input derivatives" if form == "fmu2" else "intermediate update"
    ran(form, FMPY, f"open loop, Co-Simulation, {how}", "48 of 48 switches, all bits of F")


@pytest.mark.parametrize("form", FORMATS)
def test_co_simulation_with_held_inputs(form: str, tmp_path: Path, ran: Ran) -> None:
    t, v = paper_record()
    record = np.array(list(zip(t, v, strict=True)), dtype=[("time", "f8"), ("v", "f8")])
    result = simulated(
        written(PAPER, form, tmp_path, name="gms"), "CoSimulation", END,
        input=record, output_interval=0.01, output=["switches"],
    )  # fmt: skip
    assert result["switches"][-1] == 48
    ran(form, FMPY, "open loop, Co-Simulation by its own loop", "48 of 48 switches")


# --------------------------------------------------------------------------- whole systems
@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("name", CASES)
def test_co_simulation_on_random_records(name: str, form: str, tmp_path: Path, ran: Ran) -> None:
    from dataclasses import replace

    given, t, inputs = case(name, 3)
    t = np.arange(t.size) * 2.0 ** np.round(np.log2(t[-1] / (t.size - 1)))  # exact lines
    inputs = {key: np.round(each * 2**30) / 2**30 for key, each in inputs.items()}
    known: dict[str, Settings] = {}
    if isinstance(given, System):
        signals = {key: (t, each) for key, each in inputs.items()}
        given = replace(given, signals={**given.signals, **signals})
        known["settings"] = known_floors(given, t)
        trace, seen = simulate(given, t[-1], t_eval=t, **known), f"{given.contacts[0].name}.F"
    else:
        trace, seen = simulate(given, Prescribed((t, inputs["v"])), t[-1], t_eval=t), "F"
    slave = Slave(written(given, form, tmp_path, name="it", **known))
    force = slave.run(t, [seen], **inputs)[:, 0]
    np.testing.assert_array_equal(force[:-1], trace.F[1:-1])
    ran(form, FMPY, f"{name} on a random record, Co-Simulation", "all bits of F")


WHOLE: dict[str, tuple[Callable[[], System], float, str]] = {
    "servo": (servo, 0.2, "x_l"),
    "Karnopp on a mass": (lambda: KARNOPP_ON_A_MASS, 10.0, "x"),
    "sgn(v) on a mass": (lambda: SGN_ON_A_MASS, 10.0, "x"),
}


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("name", WHOLE)
def test_whole_systems(name: str, form: str, tmp_path: Path, ran: Ran) -> None:
    make, end, seen = WHOLE[name]
    system = make()
    t = np.linspace(0.0, end, 201)
    trace = simulate(system, end, t_eval=t, rtol=1e-9)
    path = written(system, form, tmp_path, name="it")
    output = {"output": [seen, "switches"], "record_events": False, "output_interval": end / 200}
    result = simulated(path, "ModelExchange", end, relative_tolerance=1e-9, **output)
    assert result["switches"][-1] == len(trace.transitions) > 10
    apart = np.abs(np.interp(t, result["time"], result[seen]) - trace.value(seen)).max()
    assert apart < 1e-6 * np.abs(trace.value(seen)).max() + 1e-7
    ran(form, FMPY, f"{name}, Model Exchange, CVode", f"all switches, {seen} within {apart:.0e} m")
    result = simulated(path, "CoSimulation", end, **output)
    exact = simulate(system, end, t_eval=t)
    assert result["switches"][-1] == len(exact.transitions)
    apart = np.abs(np.interp(t, result["time"], result[seen]) - exact.value(seen)).max()
    assert apart < 1e-6 * np.abs(trace.value(seen)).max()
    ran(form, FMPY, f"{name}, Co-Simulation", f"all switches, {seen} within {apart:.0e} m")


# What the engine refuses with such a force, or what is not a friction of one velocity.
NOT_HERE = {"planar-coulomb", "bouc-wen", "rate-state-ageing", "rate-state-slip"}
CHARTS = [name for name in registered() if name not in NOT_HERE and not name.startswith("broken:")]


@pytest.mark.parametrize("name", CHARTS)
def test_every_built_in_chart_on_a_mass(name: str, tmp_path: Path, ran: Ran) -> None:
    entry = registered()[name]
    system = System(
        "mass",
        bodies=(Body("mass", inertia="1.0", force="3 * sin(1.5 * t) * min(t, 1)", x="x", v="v"),),
        contacts=(Contact("it", demonstration(entry, next(iter(entry.laws), "")), v="v"),),
    )
    t = np.linspace(0.0, 10.0, 641)
    trace = simulate(system, 10.0, t_eval=t, rtol=1e-9)
    result = simulated(
        written(system, "fmu3", tmp_path, name="it"), "ModelExchange", 10.0, output_interval=1 / 64,
        relative_tolerance=1e-9, output=["x", "switches"], record_events=False,
    )  # fmt: skip
    apart = np.abs(np.interp(t, result["time"], result["x"]) - trace.x).max()
    assert apart < 2e-5
    if name != "elasto-plastic":  # it rests on a threshold: there the noise of a method switches it
        assert result["switches"][-1] == len(trace.transitions)
    what = f"{len(CHARTS)} built-in charts on a mass, Model Exchange, CVode"
    ran("fmu3", FMPY, what, "x within 2e-5 m, and all switches but those of one chart")


# --------------------------------------------------------------------------- instances, sources
@pytest.mark.parametrize("form", FORMATS)
def test_all_functions_are_there_and_nothing_is_global(form: str, tmp_path: Path, ran: Ran) -> None:
    header = Path(fmpy.__file__).parent / "c-code" / f"fmi{form[-1]}Functions.h"
    wanted = {*re.findall(rf"FullName\((fmi{form[-1]}\w+)\)", header.read_text())} - {"name"}
    folder = Path(fmpy.extract(str(written(PAPER, form, tmp_path, name="gms"))))
    (library,) = (folder / "binaries").rglob("gms.so")
    lines = subprocess.run(
        ["nm", "-D", "--defined-only", str(library)], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    assert {line.split()[-1] for line in lines} == wanted
    for source in (folder / "sources").glob("*.c"):
        subprocess.run(
            ["cc", "-std=c99", "-fPIC", "-c", source.name], cwd=source.parent, check=True
        )
        command = ["nm", source.with_suffix(".o").name]
        table = subprocess.run(
            command, cwd=source.parent, capture_output=True, text=True, check=True
        )
        assert not re.search(r" [bBcCdD] ", table.stdout.replace(" d .", "")), table.stdout
    ran(
        form,
        f"nm {_version_of_nm()}",
        "functions of the standard, globals",
        f"{len(wanted)} functions, no globals",
    )


@pytest.mark.parametrize("form", FORMATS)
def test_instances_are_independent_and_their_states_can_be_kept(
    form: str, tmp_path: Path, ran: Ran
) -> None:
    folder = str(fmpy.extract(str(written(PAPER, form, tmp_path, name="gms"))))
    t, v = paper_record()
    first, second, third = (Slave(tmp_path, folder=folder) for _ in range(3))
    alone = first.run(t[:900], ["F"], v=v[:900])
    one, two = [], []
    for j in range(1, 500):
        one.append(second.run(t[j - 1 : j + 1], ["F"], v=v[j - 1 : j + 1])[0])
        two.append(third.run(t[j - 1 : j + 1], ["F"], v=0.5 * v[j - 1 : j + 1])[0])
    np.testing.assert_array_equal(one, alone[:499])
    assert not np.array_equal(two, one)
    upper = form == "fmu3"

    def call(fmu: Any, name: str) -> Any:
        return getattr(fmu, name.replace("state", "State") if upper else name)

    kept = call(second.fmu, "getFMUstate")()
    saved = call(second.fmu, "serializeFMUstate")(kept)
    rest = second.run(t[499:900], ["F"], v=v[499:900])
    np.testing.assert_array_equal(rest, alone[499:])
    call(second.fmu, "setFMUstate")(kept)
    np.testing.assert_array_equal(second.run(t[499:900], ["F"], v=v[499:900]), rest)
    back = "deserializeFMUState" if upper else "deSerializeFMUstate"
    call(third.fmu, "setFMUstate")(getattr(third.fmu, back)(saved))
    np.testing.assert_array_equal(third.run(t[499:900], ["F"], v=v[499:900]), rest)
    ran(form, FMPY, "three instances; a state kept, serialized and restored", "equal bits")


@pytest.mark.parametrize("form", FORMATS)
def test_another_start_and_other_numbers(form: str, tmp_path: Path, ran: Ran) -> None:
    system = servo()
    path = written(system, form, tmp_path, name="it")
    early, late = Slave(path), Slave(path, start=4.0)  # its ticks begin at the start
    t = np.arange(0, 200) * 2.0**-10
    np.testing.assert_allclose(
        late.run(t + 4.0, ["x_l"]), early.run(t, ["x_l"]), rtol=0.0, atol=1e-9
    )
    path = written(PAPER, form, tmp_path, name="gms")
    other, v = Slave(path, **{"k[2]": 3.0, "v_s": 2e-3, "z[1]": 0.1}), paper_record(2.0**-6)[1]
    from dataclasses import replace

    numbers = PAPER.parameters  # type: ignore[attr-defined]
    k = [*numbers.k]
    k[1] = 3.0
    changed = replace(numbers, k=k, stribeck=replace(numbers.stribeck, v_s=2e-3))
    state = FrictionState(type(PAPER)(changed, law="signed"), initial={"z": [0.1, 0.0, 0.0, 0.0]})
    h = 2.0**-6
    v = np.round(v * 2**20) / 2**20
    theirs = [state.advance(float(v[j - 1]), float(v[j]), h) for j in range(1, 1000)]
    ours = other.run(np.arange(1000) * h, ["F"], v=v[:1000])[:, 0]
    np.testing.assert_array_equal(ours, theirs)
    ran(form, FMPY, "the servo from t = 4 s", "x_l within 1e-9 m of that from 0")
    ran(form, FMPY, "parameters and initial values set", "all bits of F")


@pytest.mark.parametrize("form", FORMATS)
def test_wrong_calls_are_errors_with_a_message(
    form: str, tmp_path: Path, ran: Ran, capfd: pytest.CaptureFixture[str]
) -> None:
    slave = Slave(written(PAPER, form, tmp_path, name="gms"))
    t, v = paper_record()
    slave.run(t[:100], ["F"], v=v[:100])
    kept = [slave.get(name) for name in ("x", "z[1]", "F")]

    def fails(message: str, call: Callable[[], Any]) -> None:
        with pytest.raises(Exception, match="failed with status 3"):
            call()
        assert message in capfd.readouterr().out

    fails("can be set only before the start", lambda: slave.put("k[1]", 2.0))
    fails("cannot be set", lambda: slave.put("F", 2.0))
    fails("cannot be nan", lambda: slave.put("v", float("nan")))
    fails("it must be positive", lambda: slave.fmu.doStep(float(t[99]), 0.0))
    fails("but the time is 0.98999999999999999", lambda: slave.fmu.doStep(0.0, 0.01))
    fails("is an integer", lambda: slave.get("switches"))
    slave.fmu.terminate()
    fails("after an error", lambda: slave.fmu.doStep(float(t[99]), 0.01))
    assert [slave.get(name) for name in ("x", "z[1]", "F")] == kept
    ran(form, FMPY, "wrong calls", "errors with a message, nothing changed")


@pytest.mark.parametrize("form", FORMATS)
def test_the_sources_can_be_compiled_again(form: str, tmp_path: Path, ran: Ran) -> None:
    folder = Path(fmpy.extract(str(written(PAPER, form, tmp_path, name="gms"))))
    (folder / "binaries").rename(folder / "before")
    build = tmp_path / "build"
    build.mkdir()
    build_platform_binary(
        folder, build, cmake_options={"CMAKE_C_FLAGS:STRING": "-ffp-contract=off"}
    )
    t, v = paper_record(2.0**-6)
    slave = Slave(folder, folder=str(folder))
    slave.run(t, ["F"], v=v)
    assert slave.count("switches") == 48
    ran(form, f"{FMPY} and CMake", "the sources, compiled again", "48 of 48 switches")


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_sources_give_no_warning(form: str, compiler: str, tmp_path: Path, ran: Ran) -> None:
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} is not here")
    for what in (PAPER, servo(), KARNOPP_ON_A_MASS, CASES["LuGre"](np.random.default_rng(1))[0]):
        folder = Path(fmpy.extract(str(written(what, form, tmp_path, name="it")))) / "sources"
        flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fPIC", "-shared"]
        files = [each.name for each in folder.glob("*.c")]
        command = [compiler, *flags, *files, "-o", "it.so", "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    head = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=True)
    version = head.stdout.splitlines()[0].split()[-1]
    ran(form, f"{compiler} {version}", "-std=c99 -Wall -Wextra -Wpedantic", "no warning")


def _version_of_nm() -> str:
    told = subprocess.run(["nm", "--version"], capture_output=True, text=True, check=True).stdout
    return told.splitlines()[0].split()[-1]
