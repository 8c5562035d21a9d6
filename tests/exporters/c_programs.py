"""Exported C: compiled, run on records or called from Python, and compared with the engine."""

from __future__ import annotations

import ctypes
import functools
import io
import re
import shutil
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    FrictionState,
    GMSError,
    Model,
    Prescribed,
    Settings,
    System,
    Trace,
    export,
    simulate,
)
from gms_fsm.exporters import Subject
from gms_fsm.exporters._c import CEngine, engine_of
from gms_fsm.exporters.plain.c import plain_c
from gms_fsm.run.problem import Problem
from gms_fsm.systems.signals import Corners
from tests.exporters.frictions import case

WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wcast-qual", "-Wconversion", "-Werror"]
FLAGS = ["-std=c99", "-O2", "-ffp-contract=off", *WARNINGS]
COMPILERS = [each for each in ("gcc", "clang") if shutil.which(each)]
needs_c = pytest.mark.skipif(not COMPILERS, reason="there is no C compiler")


@dataclass(frozen=True)
class Output:
    """What a program wrote: columns by name, switches as texts, and its complaint."""

    columns: Mapping[str, np.ndarray]
    switches: list[list[str]]
    message: str


def compiled(folder: Path, compiler: str, made: str, *arguments: str) -> Path:
    """Compile files of a folder; every warning is an error."""
    command = [compiler or COMPILERS[0], *FLAGS, *arguments, "-o", made, "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / made


def built(folder: Path, name: str, compiler: str = "cc", *more: str) -> Path:
    """Compile an exported program."""
    return compiled(folder, compiler, f"{name}-{compiler}", *more, f"{name}.c", f"{name}_main.c")


def run(program: Path, t: np.ndarray, **inputs: np.ndarray) -> Output:
    """Run a program on a record."""
    rows = zip(t.tolist(), *(each.tolist() for each in inputs.values()), strict=True)
    record = "\n".join([",".join(("t", *inputs)), *(",".join(map(repr, row)) for row in rows), ""])
    log = program.with_suffix(".log")
    done = subprocess.run(
        [str(program), str(log)], input=record, capture_output=True, text=True, check=False
    )
    head, *_ = done.stdout.splitlines()
    table = np.loadtxt(io.StringIO(done.stdout), delimiter=",", skiprows=1, ndmin=2)
    columns = dict(zip(head.split(","), table.T, strict=True))
    switches = [line.split(",") for line in log.read_text().splitlines()]
    return Output(columns, switches, done.stderr)


def known_floors(
    system: System, t: np.ndarray, initial: Mapping[str, Any] | None = None
) -> Settings:
    """Return settings whose tolerances are what a run knows of forces to come, and a step not."""
    places = Problem.of(system, None, t[-1], t_start=t[0], initial=initial)
    floor = places.options.floor
    if floor is None:
        return Settings()
    names = places.program.layout.y.shared
    return Settings(atol={name: each for name, each in zip(names, floor, strict=False) if each})


def same_bits(
    given: Model | System,
    folder: Path,
    t: np.ndarray,
    compilers: list[str],
    initial: Mapping[str, Any] | None = None,
    **inputs: np.ndarray,
) -> int:
    """Assert that a program computes what the engine does; return the number of switches."""
    # What ticks at the very end of a run does not tick in it, but it does in a call.
    wanted, options = t[:-1], {"t_eval": t[:-1], "output": "t_eval"}
    trace: Trace | None
    settings = Settings()
    if isinstance(given, System):
        records = {name: Corners(t, each, held=False) for name, each in inputs.items()}
        given = replace(given, signals={**given.signals, **records})
    try:
        if isinstance(given, System):
            # Steps end at the rows of a record; without one, give one that nobody reads.
            rows = {} if inputs else {"nothing": Corners(t, 0.0 * t, held=False)}
            stopped = replace(given, signals={**given.signals, **rows})
            settings = known_floors(stopped, t, initial)
            trace = simulate(
                stopped, t[-1], t_start=t[0], initial=initial, settings=settings, **options
            )
        else:
            trace = simulate(given, Prescribed((t, inputs["v"])), t[-1], **options)
    except GMSError:
        trace = None
    begun: Any = {"name": "it", "initial": initial, "t_start": t[0], "settings": settings}
    export(given, "c99", folder, **begun)
    made = engine_of(Subject.of(given, "c99", **begun))
    for compiler in compilers:
        found = run(built(folder, "it", compiler), t, **inputs)
        if trace is None:
            assert found.message
            continue
        assert not found.message
        places: Mapping[str, Any] = {"y": trace.rows.y, "mode": trace.rows.mode}
        for each in made.outputs:
            for k in range(each.length or 1):
                name = each.name if each.length is None else f"{each.name}[{k + 1}]"
                column = found.columns[name][: wanted.size]
                if each.place in places:
                    assert np.array_equal(column, places[each.place][:, each.index + k]), name
                elif each.label.endswith(".F"):
                    force = trace.contact(each.label[:-2]).F
                    assert np.array_equal(column, force), name
        log = trace.firings
        names = list(made.edges.values())
        theirs = [
            [t, str(machine + 1), names[edge]]
            for t, machine, edge in zip(
                log.t.tolist(), log.machine.tolist(), log.edge.tolist(), strict=True
            )
        ]
        ours = [[float(t), *rest] for t, *rest in found.switches]
        end = wanted[-1]
        assert [s for s in ours if s[0] <= end] == [s for s in theirs if s[0] <= end]
    return 0 if trace is None else len(trace.firings.t)


class Library:
    """An exported engine, called from Python."""

    def __init__(self, folder: Path, made: CEngine, compiler: str = "cc", *more: str) -> None:
        self.made, name = made, made.name
        arguments = (*more, "-fPIC", "-shared", f"{name}.c")
        path = compiled(folder, compiler, f"{name}-{compiler}.so", *arguments)
        found = ctypes.CDLL(str(path))
        kinds = {True: ctypes.c_int64, False: ctypes.c_double}
        fields: list[tuple[str, Any]] = [("t", ctypes.c_double)]
        for each in made.outputs:
            kind = kinds[each.place == "mode"]
            fields.append((each.name, kind if each.length is None else kind * each.length))
        fields += [("switches", ctypes.c_int64), ("logged", ctypes.c_int64)]
        fields.append(("engine", ctypes.c_int64 * 8192))  # at least what it takes
        self.State = type("State", (ctypes.Structure,), {"_fields_": fields})
        pointer = ctypes.POINTER(self.State)
        numbers = [ctypes.c_double] * (2 * len(made.inputs) + 1)
        self.init = self._of(found, "init", None, pointer)
        limit = ctypes.c_int64
        self._advance = self._of(found, "advance", ctypes.c_int, pointer, *numbers, limit)
        self.get = self._of(found, "get", ctypes.c_double, pointer, ctypes.c_int)
        self.set = self._of(found, "set", ctypes.c_int, pointer, ctypes.c_int, ctypes.c_double)
        self.message = self._of(found, "message", ctypes.c_char_p, ctypes.c_int)

    def _of(self, found: ctypes.CDLL, name: str, result: Any, *arguments: Any) -> Any:
        function = getattr(found, f"{self.made.name}_{name}")
        function.restype, function.argtypes = result, arguments
        return function

    def advance(self, state: Any, *numbers: float, max_steps: int = 10**6) -> int:
        """Advance a state."""
        code: int = self._advance(state, *numbers, max_steps)
        return code

    def begun(self) -> Any:
        """Return a state at the start."""
        state = self.State()
        self.init(state)
        return state

    def place(self, name: str) -> int:
        """Return the enumerator of a parameter."""
        found = re.search(rf"_parameter_{name} = (\d+)", self.made.header)
        assert found
        return int(found[1])


def random_calls(c: Library, given: Model, count: int, seed: int = 5) -> int:
    """Assert that random calls have the bits of `FrictionState`; return the switches.

    Velocities of every size, jumps between calls, changes of direction; samples of 0 to 0.1 s.
    """
    random = np.random.default_rng(seed)
    ends = random.normal(size=(count, 2)) * 10.0 ** random.uniform(-6.0, 0.0, size=(count, 1))
    ends[1:, 0] = np.where(random.random(count - 1) < 0.7, ends[:-1, 1], ends[1:, 0])
    ends[random.random(count) < 0.1, 1] = 0.0
    lengths = np.where(random.random(count) < 0.02, 0.0, random.uniform(1e-4, 0.1, size=count))
    friction, state = FrictionState(given), c.begun()
    rows = zip(ends[:, 0].tolist(), ends[:, 1].tolist(), lengths.tolist(), strict=True)
    for k, (v0, v1, dt) in enumerate(rows):
        assert c.advance(state, v0, v1, dt) == 0, (k, v0, v1, dt)
        assert friction.advance(v0, v1, dt) == state.F, (k, v0, v1, dt)
    switches: int = state.switches
    return switches


# --------------------------------------------------------------------------- the plain form
STEP = 1e-3


def plain_step(folder: Path, subject: Subject, compiler: str = "") -> Callable[..., float]:
    """Return the step of a friction that has begun, as a function of its inputs and dt."""
    return functools.partial(plain_library(folder, subject, compiler), "step")


def plain_library(folder: Path, subject: Subject, compiler: str = "") -> Callable[..., float]:
    """Return the functions of a friction that has begun, by their names."""
    files = plain_c(subject)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    made, source = f"{subject.name}.so", f"{subject.name}_plain.c"
    library = compiled(folder, compiler, made, "-shared", "-fPIC", source)
    loaded = ctypes.CDLL(str(library))
    memory = ctypes.create_string_buffer(65536)
    loaded[f"{subject.name}_plain_start"](memory)

    def called(name: str, *inputs: float) -> float:
        function = loaded[f"{subject.name}_plain_{name}"]
        function.restype = ctypes.c_double
        return float(function(memory, *map(ctypes.c_double, inputs)))

    return called


def plain_compared(name: str, seed: int, compiler: str, folder: Path) -> tuple[int, int]:
    """Compare the bits with those of the engine; return the switches and the steps."""
    given = case(name, seed)
    trace = given.simulated(method="euler", step=STEP, events="step")
    last = np.append(np.diff(trace.t) > 0.0, True)  # of the rows at one time: after switching
    t, v, F = trace.t[last], trace.v[last], trace.F[last]
    step = plain_step(folder, Subject.of(given.model, "c99", name=f"f{seed}{compiler}"), compiler)
    found = [step(v[k], t[k + 1] - t[k]) for k in range(len(t) - 1)]
    assert found == F[:-1].tolist(), f"repeat with case({name!r}, {seed})"
    return len(trace.transitions), len(found)
