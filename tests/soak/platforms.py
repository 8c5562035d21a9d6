"""The same bits on every platform: Python's engines, C by several compilers, JavaScript.

``python -m tests.soak.platforms --count 250 --seed 1`` runs the scenarios, the demonstrations and
random systems in machine code, in C by two of the compilers and levels in turn, and in node, and
prints each run that differs. ``--script qjs`` takes another JavaScript engine, ``""`` none.
"""

from __future__ import annotations

import ctypes
import functools
import json
import os
import shutil
import subprocess
import sys
import tempfile
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from gms_fsm import Settings, System, Trace, export
from gms_fsm.app.scenario import load_scenario
from gms_fsm.exporters._quantities import outputs_of
from gms_fsm.lowering import compiling
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording import ready_code
from gms_fsm.systems.signals import Function
from gms_fsm.systems.system import system_of
from integrators.machine_code import calls
from integrators.machine_code.c99 import c99_text
from integrators.runners import compiled
from tests.helpers import FASTEST, ROOT, bits
from tests.soak.random_systems import SHAPES, T_END, trial
from tests.soak.trying import Seen, examine, outcome

COMPILERS = [each for each in ("gcc", "clang") if shutil.which(each)]
FLAGS = ("-std=c99", "-ffp-contract=off", "-shared", "-fPIC")
COMBINATIONS = [(each, level) for each in COMPILERS for level in ("-O0", "-O1", "-O2", "-O3")]


@dataclass(frozen=True, eq=False)
class Case:
    """A system and how to run it."""

    name: str
    system: System
    t_end: float
    settings: dict[str, Any]
    t_start: float = 0.0
    initial: dict[str, Any] = field(default_factory=dict)

    @property
    def printable(self) -> bool:
        """Whether JavaScript can have it: no Python functions, rows, one of our methods."""
        functions = any(isinstance(each, Function) for each in self.system.signals.values())
        return not functions and self.settings.get("output") != "end"

    def run(self, engine: str = FASTEST) -> tuple[Trace | None, str]:
        """Return the trace, also of a run that stops, and its error."""
        where = {"t_start": self.t_start, "initial": self.initial}
        return outcome(self.system, self.t_end, **where, **{**self.settings, "engine": engine})


# --------------------------------------------------------------------------- cases
def scenario(path: Path) -> Case:
    """Return the run of a scenario file."""
    loaded = load_scenario(path)
    given = dict(loaded.arguments)
    held = given.get("step") if given.get("events") == "held" else None
    system = loaded.system or system_of(loaded.model, loaded.rig, held)
    t_end, t_start = given.pop("t_end"), given.pop("t_start", 0.0)
    initial, _ = given.pop("initial", None) or {}, given.pop("engine", None)
    settings = {name: each for name, each in given.items() if name in Settings.__dataclass_fields__}
    return Case(path.stem, system, t_end, settings, t_start, initial)


def scenarios() -> list[Case]:
    """Return the shipped scenarios; one needs a measured record."""
    paths = sorted((ROOT / "gms_fsm/scenarios").glob("*.toml"))
    data = "GMS_FSM_DATA" in os.environ
    return [scenario(path) for path in paths if data or path.stem != "tribometer"]


def demonstrations() -> Iterator[Case]:
    """Yield a run of each chart with its demonstration numbers, as its page in the zoo has it."""
    sys.path.insert(0, str(ROOT / "docs"))
    import make_zoo

    for item in make_zoo.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"zoo_{item.name.replace('-', '_')}.toml"
            path.write_text(make_zoo.run_of(item).text, encoding="utf-8")
            yield scenario(path)


def random_case(seed: int, index: int) -> Case:
    """Return a random system, as `tests.soak.random_systems` draws it."""
    drawn = trial(seed, index, SHAPES)
    how = dict(drawn.how)
    return Case(f"random_{seed}_{index}", drawn.system, T_END, how, initial=how.pop("initial", {}))


# --------------------------------------------------------------------------- C
class CLibrary:
    """A shared library in place of machine code; see `integrators.machine_code.objects.Library`."""

    def __init__(self, path: bytes) -> None:
        self._library = ctypes.CDLL(path.decode())

    def address(self, name: str) -> int:
        """Return the address of a function."""
        return ctypes.cast(getattr(self._library, name), ctypes.c_void_p).value or 0

    def variable(self, name: str) -> int:
        """Return the address of a variable; 0 if there is none."""
        try:
            return ctypes.addressof(ctypes.c_void_p.in_dll(self._library, name))
        except ValueError:
            return 0


@contextmanager
def in_c(compiler: str, level: str, warnings: Sequence[str] = ("-w",)) -> Iterator[list[str]]:
    """Let what is compiled be compiled by a C compiler; yield the texts of the C99 printer."""
    with tempfile.TemporaryDirectory() as folder:
        texts: list[str] = []

        def shared(name: str, layout: Any, entries: Any, *_: Any, **__: Any) -> bytes:
            texts.append(c99_text(compiled.translated(layout, entries).module))
            source = Path(folder) / f"{entries[0].function.__name__}{len(texts)}.c"
            source.write_text(texts[-1], encoding="utf-8")
            made = source.with_suffix(".so")
            command = [compiler, *FLAGS, *warnings, level, str(source), "-o", str(made), "-lm"]
            subprocess.run(command, check=True)
            return bytes(made)

        with (
            mock.patch.object(compiled, "_object", shared),
            mock.patch.object(compiled, "Library", CLibrary),
            mock.patch.object(calls, "Library", CLibrary),
            mock.patch.object(ready_code, "_known", {}),
            mock.patch.object(compiling, "_observers", {}),
        ):
            yield texts


# --------------------------------------------------------------------------- JavaScript
DRIVER = """
import { run } from "./NAME.mjs";
let made, end = "end";
try { made = run(NUMBERS); } catch (error) { made = error.run; end = error.message; }
const text = (u) => Object.is(u, -0) ? "-0" : String(u);
const columns = [made.t, made.microstep, ...Object.values(made.outputs).flatMap((each) =>
    Array.isArray(each) ? each : [each])];
(globalThis.console ? console.log : print)(JSON.stringify({
    end,
    columns: columns.map((each) => Array.from(each, text)),
    log: made.log.map(({ t, element, contact, edge, source, target, z, v, s, F_before, F_after }) =>
        [contact, element, edge, source, target, ...[t, z, v, s, F_before, F_after].map(text)]),
}));
"""


def in_javascript(
    case: Case, folder: Path, script: Sequence[str] = ("node",), numbers: str = "{}"
) -> dict[str, Any]:
    """Run a case in a JavaScript engine, with some numbers changed."""
    export(
        case.system,
        "js",
        folder,
        name=case.name,
        initial=case.initial,
        t_start=case.t_start,
        t_end=case.t_end,
        settings=Settings(**{**case.settings, "engine": "ifelse"}),
    )
    program = folder / f"{case.name}_driver.mjs"
    text = DRIVER.replace("NAME", case.name).replace("NUMBERS", numbers)
    program.write_text(text, encoding="utf-8")
    found: dict[str, Any] = json.loads(ran(program, script))
    return found


def ran(program: Path, script: Sequence[str] = ("node",)) -> str:
    """Run a program in a JavaScript engine, and return what it printed."""
    command = [*script, program.name]
    done = subprocess.run(command, cwd=program.parent, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def expected(case: Case, trace: Trace) -> dict[str, Any]:
    """Return what JavaScript must give."""
    start = Problem.of(
        case.system, None, case.t_end, Settings(**{**case.settings, "engine": "ifelse"}),
        t_start=case.t_start, initial=case.initial,
    )  # fmt: skip
    rows, seen = trace.rows, trace.seen
    columns: list[Any] = [rows.t, rows.microstep]
    for each in outputs_of(start, False, ()):
        for k in range(each.length or 1):
            match each.place:
                case "y":
                    columns.append(rows.y[:, each.index + k])
                case "mode":
                    columns.append(rows.mode[:, each.index + k])
                case _:
                    whole = seen[each.label]
                    columns.append(whole if each.length is None else whole[:, k])
    names = ("contact", "element", "edge", "source", "target", "t", "z", "v", "s", "F_before",
             "F_after")  # fmt: skip
    log = [[record[name] for name in names] for record in trace.transitions]
    for record in log:
        record[1] += 1
    return {"columns": columns, "log": log}


def differences(case: Case, trace: Trace, found: dict[str, Any]) -> list[str]:
    """Return what differs between a run and that of JavaScript."""
    wanted, differ = expected(case, trace), []
    if len(found["columns"][0]) != len(wanted["columns"][0]):
        return [f"{len(found['columns'][0])} rows, not {len(wanted['columns'][0])}"]
    if len(found["columns"]) != len(wanted["columns"]):
        return ["another number of columns"]
    for k, (theirs, ours) in enumerate(zip(found["columns"], wanted["columns"], strict=True)):
        a = np.array([float(u) for u in theirs]).view(np.int64)
        b = np.asarray(ours, dtype=np.float64).copy()
        b[np.isnan(b)] = np.nan
        if len(bad := np.flatnonzero(a != b.view(np.int64))):
            differ.append(f"column {k} in {len(bad)} rows from {bad[0]}: {theirs[bad[0]]}")
    logs = [
        [[*row[:5], *(float(u).hex() for u in row[5:])] for row in each["log"]]
        for each in (wanted, found)
    ]
    return differ + ["the log"] * (logs[0] != logs[1])


# --------------------------------------------------------------------------- all of them
def check(
    case: Case, combinations: Sequence[tuple[str, str]], script: Sequence[str] | None
) -> list[str]:
    """Return on which platforms a run differs from that of machine code."""
    trace, end = case.run()
    mine, found = bits(trace), []
    for compiler, level in combinations:
        with in_c(compiler, level):
            other, its_end = case.run()
            theirs = bits(other)
        parts = [name for name in mine | theirs if mine.get(name) != theirs.get(name)]
        if parts or its_end != end:
            found.append(f"{compiler} {level}: {', '.join(parts[:4])} {its_end}")
    if script and case.printable and trace is not None:
        with tempfile.TemporaryDirectory() as folder:
            made = in_javascript(case, Path(folder), script)
        if (made["end"] == "end") != (end == ""):
            found.append(f"{script[0]}: {made['end']!r} and not {end!r}")
        differ = differences(case, trace, made)
        found += [f"{script[0]}: {each}" for each in differ[:4]]
    return found


@functools.cache
def shipped() -> list[Case]:
    """Return the scenarios and the demonstrations."""
    return [*scenarios(), *demonstrations()]


def look(given: Namespace, index: int) -> Iterator[Seen]:
    """Compare one run: first those that are shipped, then random ones."""
    known = shipped()
    case = known[index] if index < len(known) else random_case(given.seed, index - len(known))
    turns = [COMBINATIONS[(2 * index + k) % len(COMBINATIONS)] for k in range(2) if COMBINATIONS]
    differ = check(case, turns, given.script.split() or None)
    trace, _ = case.run()
    counts = {
        "in a script": case.printable,
        "switches": 0 if trace is None else len(trace.transitions),
    }
    yield Seen(f"--index {index}", counts, "; ".join([case.name, *differ]) if differ else "")


if __name__ == "__main__":
    examine("platforms", "The same bits on every platform?", look, count=250, script="node")
