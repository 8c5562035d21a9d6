"""Exported JavaScript, run by several engines, computes the engine's bits; its types hold."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from gms_fsm import export
from tests.helpers import stick_slip
from tests.soak.platforms import COMBINATIONS, Case, check, demonstrations, random_case, scenarios

# A command, and how it is called here; what is not installed is not run.
ENGINES = {"node": ["node"], "SpiderMonkey": ["js102", "-m"], "JavaScriptCore": ["jsc", "-m"]}
INSTALLED = {name: each for name, each in ENGINES.items() if shutil.which(each[0])}
SEED, COUNT = 5, 24
TYPED = """
import { numbers, run, type Run } from "./NAME.mjs";
const found: Run = run({ friction_F_c: numbers.friction_F_c.value as number });
const z: Float64Array = found.outputs.friction_z[0];
console.log(z.at(-1), found.log[0].edge satisfies string);
"""
STEPPED = """
import { Friction } from "./it.mjs";
const force: number = new Friction({ k: [1, 2, 3, 4] }).advance({ v: 0 }, { v: 1 }, 0.1).F;
console.log(force);
"""


def version(name: str) -> str:
    """Return an engine with its version."""
    command = ["dpkg-query", "-W", "-f=${Version}", "libjavascriptcoregtk-4.0-bin"]
    if name != "JavaScriptCore":
        command = [ENGINES[name][0], "--version"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return f"{name} {said.split()[-1].removeprefix('v').removeprefix('JavaScript-C')}"


def same(cases: Iterable[Case], script: list[str]) -> tuple[int, int]:
    """Assert that an engine gives the bits; return the number of runs and of switches."""
    count = switches = 0
    for case in cases:
        if case.printable:
            assert check(case, (), script) == [], case.name
            trace, _ = case.run()
            count += 1
            switches += 0 if trace is None else len(trace.transitions)
    return count, switches


@pytest.mark.parametrize("name", INSTALLED)
def test_scenarios_and_demonstrations(name: str, ran: Callable[..., None]) -> None:
    for what, cases in (("shipped scenarios", scenarios()), ("demonstrations", demonstrations())):
        count, switches = same(cases, ENGINES[name])
        said = f"{count} runs, {switches:,} switches: all bits of rows, log and F"
        ran("js", version(name), what, said)


@pytest.mark.parametrize("name", INSTALLED)
def test_random_systems(name: str, ran: Callable[..., None]) -> None:
    cases = (random_case(SEED, index) for index in range(COUNT))
    count, switches = same(cases, ENGINES[name])
    said = f"{count} runs, {switches:,} switches: all bits of rows, log and F"
    ran("js", version(name), "random systems", said)


@pytest.mark.parametrize("combination", COMBINATIONS, ids=" ".join)
def test_whole_runs_in_c(combination: tuple[str, str]) -> None:
    cases = [*scenarios(), *(random_case(SEED, index) for index in range(4))]
    assert [each for case in cases for each in check(case, [combination], None)] == []


def test_types(tmp_path: Path, ran: Callable[..., None]) -> None:
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "gms-fsm-typescript"
    if not (home / "node_modules").exists():
        home.mkdir(parents=True, exist_ok=True)
        subprocess.run(["npm", "install", "--silent", "typescript@5"], cwd=home, check=True)
    case = next(each for each in scenarios() if each.name == "pulled_mass")
    export(case.system, "js", tmp_path, name="NAME", t_end=1.0)
    export(stick_slip("signed"), "js", tmp_path, name="it")
    (tmp_path / "run.mts").write_text(TYPED)
    (tmp_path / "steps.mts").write_text(STEPPED)
    compiler = home / "node_modules" / ".bin" / "tsc"
    flags = ["--strict", "--noEmit", "--module", "nodenext", "--target", "es2022", "--lib",
             "es2022,dom"]  # fmt: skip
    command = [str(compiler), *flags, "run.mts", "steps.mts"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    said = subprocess.run([str(compiler), "--version"], capture_output=True, text=True, check=True)
    ran("js", f"TypeScript {said.stdout.split()[-1]}", "types of both kinds, --strict", "no error")
