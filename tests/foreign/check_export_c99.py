"""The exported C99 programs, compiled by gcc and by clang, compute the engine's bits."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import export
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts.registry import registered
from gms_fsm.exporters import Subject
from gms_fsm.exporters._c import engine_of
from gms_fsm.systems.models import demonstration
from gms_fsm.systems.signals import Corners
from gms_fsm.systems.system import system_of
from tests.exporters.c_programs import COMPILERS, WARNINGS, Library, random_calls, same_bits
from tests.exporters.frictions import DENSE, dense, times, walk
from tests.exporters.plain_samples import CASES, friction
from tests.helpers import ROOT

SEEDS = range(2, 8)
# The earthquake is stiff: Python stops it at a million steps, exported C has a limit for each call.
SCENARIOS = sorted(
    path for path in (ROOT / "gms_fsm/scenarios").glob("*.toml") if path.stem != "earthquake"
)


def version(compiler: str) -> str:
    """Return a compiler with its version."""
    text = subprocess.run([compiler, "-dumpversion"], capture_output=True, text=True, check=True)
    return f"{compiler} {text.stdout.strip()}"


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("name", DENSE)
def test_random_records(name: str, compiler: str, tmp_path: Path, ran: Callable[..., None]) -> None:
    switches = 0
    for seed in SEEDS:
        given, t, inputs = dense(name, seed)
        switches += same_bits(given, tmp_path, t, [compiler], **inputs)
    what = f"{name}, {len(SEEDS)} random records"
    ran("c99", version(compiler), what, f"{switches} switches, all bits equal, no warning")


@pytest.mark.parametrize("name", CASES)
def test_random_calls(name: str, tmp_path: Path, ran: Callable[..., None]) -> None:
    given = friction(name)
    export(given, "c99", tmp_path, name="it")
    library = Library(tmp_path, engine_of(Subject.of(given, "c99", name="it")), "gcc")
    switches = random_calls(library, given, 100_000)
    what = f"{name}, 100,000 random calls"
    ran("c99", version("gcc"), what, f"{switches:,} switches, all bits equal to FrictionState")


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_both_forms_are_cpp(compiler: str, tmp_path: Path, ran: Callable[..., None]) -> None:
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} is not installed")
    count = 0
    for name in DENSE:
        given, _, _ = dense(name, 2)
        export(given, "c99", tmp_path, name="it")
        sources = [each.name for each in tmp_path.glob("it*.c")]
        command = [compiler, "-x", "c++", "-fsyntax-only", *WARNINGS, *sources]
        subprocess.run(command, cwd=tmp_path, check=True)
        count += len(sources)
    ran(
        "c99",
        version(compiler),
        "both forms and their programs as C++",
        f"{count} files, no warning",
    )


@pytest.mark.parametrize("name", [name for name, each in registered().items() if not each.wrong])
def test_every_chart_without_locks(name: str, tmp_path: Path) -> None:
    entry = registered()[name]
    if any(entry.chart(law).locks for law in entry.laws or ("",)):
        return  # such charts are parts of systems
    for seed, law in enumerate(entry.laws or ("",)):
        random = np.random.default_rng([seed, *name.encode()])
        t = times(random, 2.0)
        same_bits(demonstration(entry, law), tmp_path, t, COMPILERS, v=walk(random, t, 0.01))


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_every_system(path: Path, tmp_path: Path) -> None:
    loaded = load_scenario(path)
    system = loaded.system or system_of(loaded.model, loaded.rig)
    records = {name: each for name, each in system.signals.items() if isinstance(each, Corners)}
    start, end = loaded.arguments["t_start"], loaded.arguments["t_end"]
    t = np.linspace(start, min(end, start + 20.0), 1001)
    inputs = {name: np.interp(t, each.times, each.values) for name, each in records.items()}
    same_bits(system, tmp_path, t, COMPILERS, loaded.arguments.get("initial"), **inputs)
