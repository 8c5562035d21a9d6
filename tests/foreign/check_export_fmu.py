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
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.build import build_platform_binary
from fmpy.validation import validate_fmu

from gms_fsm import Body, Contact, FrictionState, Prescribed, Settings, System, simulate
from gms_fsm.charts.registry import registered
from gms_fsm.systems.models import demonstration
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
from tests.exporters.frictions import DENSE, KARNOPP_MODEL, dense, servo

Ran = Callable[..., None]
FMPY = f"FMPy {fmpy.__version__}"
STATES = [f"state[{k + 1}]" for k in range(4)]
PUSH = "3 * sin(1.5 * t) * min(t, 1)"
forms = pytest.mark.parametrize("form", FORMATS)


def on_a_mass(friction: Any, force: str = PUSH) -> System:
    """Return a mass under a force."""
    body = Body("mass", inertia="1.0", force=force, x="x", v="v")
    return System("mass", bodies=(body,), contacts=(Contact("it", friction, v="v"),))


OPEN_LOOP = System(
    "open loop",
    bodies=(Body("body", velocity="0.2 * sin(2 * pi * t / 20)"),),
    contacts=(Contact("friction", PAPER, v="v"),),
)
# Dry friction by sgn(v), besides a bristle: the motion slides along v = 0 when it rests.
WHOLE: dict[str, tuple[System, float, str]] = {
    "open loop as a formula": (OPEN_LOOP, END, "friction.F"),
    "servo": (servo(), 0.2, "x_l"),
    "Karnopp on a mass": (on_a_mass(KARNOPP_MODEL), 10.0, "x"),
    "sgn(v) on a mass": (on_a_mass(PAPER, f"{PUSH} - sgn(v)"), 10.0, "x"),
}


def simulated(path: Path, kind: str, end: float, **options: Any) -> np.ndarray:
    """Return the result of FMPy."""
    result = fmpy.simulate_fmu(str(path), fmi_type=kind, stop_time=end, **options)
    assert isinstance(result, np.ndarray)
    return result


@forms
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


@forms
@pytest.mark.parametrize("name", DENSE)
def test_co_simulation_on_random_records(name: str, form: str, tmp_path: Path, ran: Ran) -> None:
    given, t, inputs = dense(name, 3)
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


@forms
@pytest.mark.parametrize("name", WHOLE)
def test_whole_systems(name: str, form: str, tmp_path: Path, ran: Ran) -> None:
    system, end, seen = WHOLE[name]
    t, unit = np.linspace(0.0, end, 201), "N" if seen.endswith("F") else "m"
    path = written(system, form, tmp_path, name="it")
    assert validate_fmu(str(path)) == []
    output = {"output": [seen, "switches"], "record_events": False, "output_interval": end / 200}
    for kind, options, rtol in (
        ("Model Exchange, CVode", {"relative_tolerance": 1e-9}, 1e-9),
        ("Co-Simulation", {}, 1e-6),
    ):
        trace = simulate(system, end, t_eval=t, rtol=rtol)
        result = simulated(path, kind.split(",")[0].replace(" ", "").replace("-", ""), end,
                           **options, **output)  # fmt: skip
        assert result["switches"][-1] == len(trace.transitions) > 10
        exact = trace.value(seen.rpartition(".")[2])
        apart = np.abs(np.interp(t, result["time"], result[seen]) - exact).max()
        assert apart < 2e-6 * np.abs(exact).max() + 1e-7
        ran(form, FMPY, f"{name}, {kind}", f"all switches, {seen} within {apart:.0e} {unit}")


# What the engine refuses with such a force, or what is not a friction of one velocity.
NOT_HERE = {"planar-coulomb", "bouc-wen", "rate-state-ageing", "rate-state-slip"}
CHARTS = [name for name in registered() if name not in NOT_HERE and not name.startswith("broken:")]


@pytest.mark.parametrize("name", CHARTS)
def test_every_built_in_chart_on_a_mass(name: str, tmp_path: Path, ran: Ran) -> None:
    entry = registered()[name]
    system = on_a_mass(demonstration(entry, next(iter(entry.laws), "")))
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
@forms
def test_all_functions_are_there_without_globals_or_warnings(
    form: str, tmp_path: Path, ran: Ran
) -> None:
    header = Path(fmpy.__file__).parent / "c-code" / f"fmi{form[-1]}Functions.h"
    wanted = {*re.findall(rf"FullName\((fmi{form[-1]}\w+)\)", header.read_text())} - {"name"}
    folder = Path(fmpy.extract(str(written(PAPER, form, tmp_path, name="gms"))))
    (library,) = (folder / "binaries").rglob("gms.so")
    lines = said("nm", "-D", "--defined-only", str(library)).splitlines()
    assert {line.split()[-1] for line in lines} == wanted
    for source in (folder / "sources").glob("*.c"):
        said("cc", "-std=c99", "-fPIC", "-c", source.name, folder=source.parent)
        table = said("nm", source.with_suffix(".o").name, folder=source.parent)
        assert not re.search(r" [bBcCdD] ", table.replace(" d .", "")), table
    tool = f"nm {said('nm', '--version').splitlines()[0].split()[-1]}"
    what = f"{len(wanted)} functions, no globals"
    ran(form, tool, "functions of the standard, globals", what)
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fPIC", "-shared"]
    for compiler in filter(shutil.which, ("gcc", "clang")):
        for given in (PAPER, servo(), on_a_mass(KARNOPP_MODEL), dense("LuGre", 1)[0]):
            folder = Path(fmpy.extract(str(written(given, form, tmp_path, name="it")))) / "sources"
            files = [each.name for each in folder.glob("*.c")]
            said(compiler, *flags, *files, "-o", "it.so", "-lm", folder=folder)
        tool = f"{compiler} {said(compiler, '--version').splitlines()[0].split()[-1]}"
        ran(form, tool, "-std=c99 -Wall -Wextra -Wpedantic", "no warning")


def said(*command: str, folder: Path | None = None) -> str:
    """Return what a program prints."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@forms
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


@forms
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


@forms
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


@forms
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
