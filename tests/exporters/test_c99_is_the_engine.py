"""An exported C99 engine computes the bits of the run; its struct is its whole state.

The program beside it runs on the record beside it; bad arguments and broken records change nothing.
"""

from __future__ import annotations

import ctypes
import io
import itertools
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    FrictionState,
    GMSParameters,
    Parameter,
    Settings,
    State,
    Stribeck,
    System,
    export,
    simulate,
)
from gms_fsm.charts import CHARTS
from gms_fsm.exporters import Subject
from gms_fsm.exporters._c import engine_of
from gms_fsm.systems.signals import Corners
from tests.exporters.c_programs import (
    COMPILERS,
    WARNINGS,
    Library,
    built,
    needs_c,
    random_calls,
    same_bits,
)
from tests.exporters.frictions import DENSE, dense
from tests.helpers import matrix, stick_slip

pytestmark = [needs_c, pytest.mark.slow]
QUICK = "-O0"  # compiles in a fraction of the time, where the claim is not about -O2


# A bank, a sampled controller, sliding.
@pytest.mark.every(3)
@pytest.mark.parametrize("name", matrix([*DENSE], ["GMS 4", "servo", "between states"]))
def test_the_bits_on_a_random_record(name: str, tmp_path: Path) -> None:
    given, t, inputs = dense(name, 1)
    switches = same_bits(given, tmp_path, t, COMPILERS[:1], **inputs)
    assert switches > 10 or name == "LuGre"


# --------------------------------------------------------------------------- the struct
def model(k: float = 0.7, **curve: float) -> GMS:
    given: dict[str, float] = {"F_c": 0.4, "F_s": 1.5, "v_s": 1e-3, "delta": 2.0} | curve
    more: dict[str, Any] = {"sigma_2": 0.1, "stribeck": Stribeck(**given), "v_c": 1e-6}
    return GMS(GMSParameters([k, 0.9], [0.3, 0.4], [0.1, 0.05], **more), law="signed")


def library(folder: Path, given: GMS | ChartModel) -> Library:
    export(given, "c99", folder, name="it")
    return Library(folder, engine_of(Subject.of(given, "c99", name="it")), "cc", QUICK)


@pytest.fixture(scope="module")
def c(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """Return the engine of a friction."""
    return library(tmp_path_factory.mktemp("engine"), model())


PAIRS = [*itertools.pairwise(np.cumsum(np.random.default_rng(3).normal(size=60)) * 0.3)]


def forces(c: Library, state: Any) -> list[float]:
    found = []
    for v0, v1 in PAIRS:
        assert c.advance(state, v0, v1, 0.1) == 0
        found.append(state.F)
    return found


def in_python(given: GMS | ChartModel) -> list[float]:
    friction = FrictionState(given)
    return [friction.advance(v0, v1, 0.1) for v0, v1 in PAIRS]


@pytest.mark.matrix
def test_the_engine_in_a_struct(c: Library) -> None:
    first, copied = c.begun(), c.State()
    begun = forces(c, first)
    ctypes.memmove(ctypes.byref(copied), ctypes.byref(first), ctypes.sizeof(first))
    assert forces(c, first) == forces(c, copied)  # a copy goes on in the same way
    assert forces(c, c.begun()) == begun == in_python(model())  # another one knows nothing of it
    assert first.switches > 4


@pytest.mark.parametrize(
    "numbers",
    [(math.nan, 0.0, 0.1), (0.0, math.inf, 0.1), (0.0, 0.0, -0.1), (0.0, 0.0, math.nan),
     (0.0, 0.0, 1e-300), (0.0, 0.0, 1e10)],
)  # fmt: skip
def test_bad_arguments(numbers: tuple[float, ...], c: Library) -> None:
    state = c.begun()
    assert c.advance(state, 0.1, 0.1, 5.0) == 0
    before = bytes(state)
    code = c.advance(state, *numbers)
    assert code == -1
    assert b"not finite" in c.message(code)
    assert bytes(state) == before


def test_random_calls_have_the_bits_of_the_engine(c: Library) -> None:
    assert random_calls(c, model(), 10_000) > 500


def test_a_limit_of_steps_and_the_state_after_an_error(c: Library) -> None:
    one, other, public = c.begun(), c.begun(), c.State.engine.offset
    for v0, v1 in PAIRS:
        before = bytes(one)[:public]
        code = c.advance(one, v0, v1, 0.1, max_steps=1)
        if code != 0:
            assert b"more steps than max_steps" in c.message(code)
            assert bytes(one)[:public] == before
            assert c.advance(one, v0, v1, 0.1) == 0
        assert c.advance(other, v0, v1, 0.1) == 0
        assert bytes(one)[8:] == bytes(other)[8:] or one.F == other.F
    assert one.F == other.F
    assert c.advance(one, 0.0, 0.0, 0.1, max_steps=0) == -1


def test_what_cannot_happen_is_left_out() -> None:
    made = engine_of(Subject.of(model(), "c99", name="it"))
    for word in ("surface", "jumps", "ticks", "events", "impulse", "discrete"):
        assert word not in made.header
    assert "block->now.t" in made.source
    assert "(char *)" not in made.source


@pytest.mark.matrix
@pytest.mark.skipif(not shutil.which("g++"), reason="there is no C++ compiler")
def test_both_forms_are_cpp(tmp_path: Path) -> None:
    export(stick_slip("signed"), "c99", tmp_path, name="it")
    command = ["g++", "-x", "c++", "-fsyntax-only", *WARNINGS, "it.c", "it_plain.c"]
    subprocess.run(command, cwd=tmp_path, check=True)


def test_numbers_are_set_and_all_that_follows_from_them(c: Library) -> None:
    """Tolerances and scales, too: the bits are those of a friction that began with the numbers."""
    given = {"F_s": 0.9, "v_s": 5e-3}
    state, k = c.begun(), c.place("k")
    assert [c.get(state, k), c.get(state, k + 1)] == [0.7, 0.9]
    for name, value in given.items():
        assert c.set(state, c.place(name), value) == 0
    assert c.set(state, k, 70.0) == 0
    assert forces(c, state) == in_python(model(**given, k=70.0))
    for place, value in ((-1, 1.0), (4, 1.0), (10**6, 1.0), (k, math.nan)):
        assert c.set(state, place, value) == -1


def test_a_number_that_is_set_in_the_midst_of_a_motion_counts_from_then_on(c: Library) -> None:
    """Not only from the second stage of the next step on: rates are asked for anew."""
    state = c.begun()
    for _ in range(5):
        assert c.advance(state, 0.5, 0.5, 1.0) == 0  # in steady slip
    assert c.set(state, c.place("F_c"), 0.8) == 0
    z = [state.z[0]]
    for _ in range(2):
        assert c.advance(state, 0.5, 0.5, 1e-6) == 0
        z.append(state.z[0])
    first, second = np.diff(z)
    assert first == pytest.approx(second, rel=1e-3)
    assert first > 1e-8


@pytest.mark.matrix
def test_the_entry_of_the_default_state_follows_a_number(tmp_path: Path) -> None:
    entry = {"z": "2.0 * z_0 + sgn(tau - 2.0)"}
    chart = Chart(
        "winding down",
        parameters=(Parameter("z_0", "m"), Parameter("tau", "s", "> 0")),
        inputs=("v",),
        variables=("z",),
        states=(State("only", entry=entry, flow={"z": "v - z / tau"}),),
        outputs={"F": "z"},
    )
    c = library(tmp_path, ChartModel(chart, {"z_0": 0.5, "tau": 2.0}))
    state: Any = c.begun()
    assert state.z[0] == 1.0
    assert c.set(state, c.place("z_0"), -3.0) == 0
    assert state.z[0] == -6.0
    assert c.set(state, c.place("tau"), 0.01) == 0
    assert forces(c, state) == in_python(ChartModel(chart, {"z_0": -3.0, "tau": 0.01}))


# --------------------------------------------------------------------------- the program
@pytest.mark.every(3)
@pytest.mark.parametrize("start", matrix([0.0, 0.5, 1.0], [0.0, 1.0]))
def test_jumps_and_a_later_start(start: float, tmp_path: Path) -> None:
    friction = ChartModel(CHARTS["maxwell-slip"], {"k": 10.0, "F_c": 0.2}, sigma_2=0.1)
    force = Corners(np.array([0, 1, 1, 2, 2, 3.0]), np.array([0, 0.5, 2, 2, -1, -1]), held=False)
    system = System(
        "mass",
        bodies=(Body("mass", inertia=1.0, force="f"),),
        contacts=(Contact("pad", friction),),
        signals={"f": force},
    )
    export(system, "c99", tmp_path, name="it", t_start=start)
    program = built(tmp_path, "it", COMPILERS[0], QUICK)
    with (tmp_path / "it_record.csv").open() as record:
        done = subprocess.run([program], stdin=record, capture_output=True, text=True, check=True)
    table = np.genfromtxt(io.StringIO(done.stdout), delimiter=",", names=True)
    trace = simulate(system, 3.0, t_start=start)
    assert table["x"][-1] == pytest.approx(trace.body("mass").x[-1], rel=1e-5)
    assert table["t"][0] == start
    assert table["t"].tolist().count(2.0) == 2


@pytest.mark.matrix
def test_a_broken_record_is_named(tmp_path: Path) -> None:
    export(stick_slip("signed"), "c99", tmp_path, name="it")
    program = built(tmp_path, "it", COMPILERS[0], QUICK)
    for record, said in {
        "t,v\n0,0\n1\n": "row 3: it must have 2 numbers",
        "t,v\n0,0\n1,abc\n": "row 3: it must have 2 numbers",
        "t,v\n0,0\n1,2,3\n": "row 3: it must have 2 numbers",
        "v,t\n0,0\n": "row 1: the columns must be t,v",
        "": "row 1: the columns must be t,v",
        "t,v\n0,0\n1,nan\n": "row 3: an argument is not finite",
        "t,v\n0,0\n1,0\n0.5,0\n": "row 4: an argument is not finite or no limit, or",
    }.items():
        done = subprocess.run([program], input=record, capture_output=True, text=True, check=False)
        assert done.returncode == 1
        assert said in done.stderr


@pytest.mark.matrix
def test_no_name_is_one_of_the_c_library(tmp_path: Path) -> None:
    """Without -std=c99 its headers declare more of them: finite, gamma, j0 and others."""
    export(stick_slip("signed"), "c99", tmp_path, name="it")
    command = [COMPILERS[0], "-fsyntax-only", "it.c", "it_plain.c"]
    subprocess.run(command, cwd=tmp_path, check=True)


@pytest.mark.matrix
def test_settings_are_those_of_the_engine(tmp_path: Path) -> None:
    sources = set()
    for settings in (Settings(), Settings(method="rk4", step=1e-3), Settings(atol=1e-12)):
        export(stick_slip("signed"), "c99", tmp_path, name="it", settings=settings)
        sources.add((tmp_path / "it.c").read_text())
        method = "rk4" if settings.step else "dp45"
        assert f"Method {method}" in (tmp_path / "README-it-c99.md").read_text()
    assert len(sources) == 3
