"""The program beside an exported engine runs on the record beside it, and refuses a broken one."""

from __future__ import annotations

import io
import subprocess
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Body, ChartModel, Contact, Settings, System, export, simulate
from gms_fsm.charts import CHARTS
from gms_fsm.systems.models import Model
from gms_fsm.systems.signals import Corners
from tests.exporters.c_programs import COMPILERS, built
from tests.helpers import stick_slip

pytestmark = pytest.mark.skipif(not COMPILERS, reason="there is no C compiler")


def driven(times: list[float], forces: list[float]) -> System:
    """Return a mass under a recorded force."""
    friction: Model = ChartModel(CHARTS["maxwell-slip"], {"k": 10.0, "F_c": 0.2}, sigma_2=0.1)
    return System(
        "mass",
        bodies=(Body("mass", inertia="m", force="f"),),
        contacts=(Contact("pad", friction),),
        numbers={"m": 1.0},
        signals={"f": Corners(np.array(times), np.array(forces), held=False)},
    )


@pytest.mark.parametrize("start", [0.0, 0.5, 1.0])
def test_jumps_and_a_later_start(start: float, tmp_path: Path) -> None:
    system = driven([0, 1, 1, 2, 2, 3], [0, 0.5, 2, 2, -1, -1])
    export(system, "c99", tmp_path, name="it", t_start=start)
    program = built(tmp_path, "it", COMPILERS[0])
    with (tmp_path / "it_record.csv").open() as record:
        done = subprocess.run([program], stdin=record, capture_output=True, text=True, check=True)
    table = np.genfromtxt(io.StringIO(done.stdout), delimiter=",", names=True)
    trace = simulate(system, 3.0, t_start=start)
    assert table["x"][-1] == pytest.approx(trace.body("mass").x[-1], rel=1e-5)
    assert table["t"][0] == start
    assert table["t"].tolist().count(2.0) == 2


@pytest.mark.parametrize(
    ("record", "said"),
    [
        ("t,v\n0,0\n1\n", "row 3: it must have 2 numbers"),
        ("t,v\n0,0\n1,abc\n", "row 3: it must have 2 numbers"),
        ("t,v\n0,0\n1,2,3\n", "row 3: it must have 2 numbers"),
        ("v,t\n0,0\n", "row 1: the columns must be t,v"),
        ("t;v\n0;0\n", "row 1: the columns must be t,v"),
        ("", "row 1: the columns must be t,v"),
        ("t,v\n0,0\n1,nan\n", "row 3: an argument is not finite"),
        ("t,v\n0,0\n1,0\n0.5,0\n", "row 4: an argument is not finite, or time goes backward"),
    ],
)
def test_a_broken_record(record: str, said: str, program: Path) -> None:
    done = subprocess.run([program], input=record, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert said in done.stderr


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a compiled program."""
    folder = tmp_path_factory.mktemp("program")
    export(stick_slip("signed"), "c99", folder, name="it")
    return built(folder, "it", COMPILERS[0])


def test_no_name_is_one_of_the_c_library(program: Path) -> None:
    """Without -std=c99 its headers declare more of them: finite, gamma, j0 and others."""
    command = [COMPILERS[0], "-fsyntax-only", "it.c", "it_plain.c"]
    subprocess.run(command, cwd=program.parent, check=True)


def test_settings_are_those_of_the_engine(tmp_path: Path) -> None:
    model = stick_slip("signed")
    sources = set()
    for settings in (Settings(), Settings(method="rk4", step=1e-3), Settings(atol=1e-12)):
        export(model, "c99", tmp_path, name="it", settings=settings)
        sources.add((tmp_path / "it.c").read_text())
        method = "rk4" if settings.step else "dp45"
        assert f"Method {method}" in (tmp_path / "README-it-c99.md").read_text()
    assert len(sources) == 3
