"""A checkpoint is refused unless this program wrote it, for these functions, with possible values.

The same Python function means the same code, constants, defaults, enclosed values and globals, in
any process; if that cannot be determined, the run is refused before it starts. Compiled code would
use an invalid number as a memory address, so each is checked; nothing too large is unpacked.
"""

from __future__ import annotations

import functools
import math
import os
import subprocess
import sys
import types
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Slider, simulate
from gms_fsm.errors import CheckpointError, ParameterError, SignalError
from gms_fsm.run._identity import identity
from integrators.runners import states
from tests.helpers import ROOT, open_loop, same_bits, stick_slip

LEVEL = 0.2
ENGINES = [
    "machines",
    pytest.param(
        "compiled",
        marks=pytest.mark.skipif(
            not __import__("importlib.util").util.find_spec("llvmlite"),
            reason="needs the extra fast",
        ),
    ),
]


@pytest.fixture(autouse=True)
def _short_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a compiled run return often enough to be interrupted."""
    monkeypatch.setattr("gms_fsm.run.recording.compiled_run.STEPS_AT_ONCE", 60)


def begun(path: Path, rig: Any, engine: str = "machines", **options: Any) -> None:
    """Create the checkpoint of a run interrupted on its way."""

    def stop(moment: Any) -> None:
        if moment.t > 11.0:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        simulate(
            stick_slip("signed"),
            rig,
            25.0,
            engine=engine,
            checkpoint=path,
            checkpoint_every=0.0,
            progress=stop,
            **options,
        )


def goes_on(path: Path, rig: Any, engine: str = "machines", **options: Any) -> None:
    simulate(stick_slip("signed"), rig, 25.0, engine=engine, checkpoint=path, **options)


# --------------------------------------------------------------------------- functions
def _sine(t: float) -> float:
    return LEVEL * math.sin(t / 3)


def _louder(level: float) -> Callable[[float], float]:
    return lambda t: level * math.sin(t / 3)


def _default(level: float) -> Callable[[float], float]:
    def call(t: float, level: float = level) -> float:
        return level * math.sin(t / 3)

    return call


def _table(*values: float) -> Callable[[float], float]:
    table = np.array(values)
    return lambda t: float(np.interp(t, [0.0, 30.0], table))


PAIRS = {
    "constant": (lambda t: 0.2 * math.sin(t / 3), lambda t: 0.1 * math.sin(t / 3)),
    "code": (lambda t: 0.2 * math.sin(t / 3), lambda t: 0.2 * math.cos(t / 3)),
    "operator": (lambda t: 0.2 * t, lambda t: 0.2 / (t + 1)),
    "closure": (_louder(0.2), _louder(0.1)),
    "default": (_default(0.2), _default(0.1)),
    "array": (_table(0.1, 0.2), _table(0.1, 0.3)),
    "partial": (functools.partial(_default(0.2), level=0.3), functools.partial(_default(0.2))),
    "function inside": (lambda t: _louder(0.2)(t), lambda t: _default(0.2)(t)),
}


@pytest.mark.parametrize("pair", PAIRS)
def test_another_function_is_refused(pair: str, tmp_path: Path) -> None:
    path, (one, other) = tmp_path / "run.checkpoint", PAIRS[pair]
    begun(path, Prescribed(one))
    before = path.read_bytes()
    with pytest.raises(CheckpointError, match="another model, rig, signal"):
        goes_on(path, Prescribed(other))
    assert path.read_bytes() == before
    goes_on(path, Prescribed(one))
    assert not path.exists()


def test_a_recreated_function_is_the_same(tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    begun(path, Prescribed(_louder(0.2)))
    goes_on(path, Prescribed(_louder(0.2)))


def test_another_value_of_a_global_is_another_function(monkeypatch: pytest.MonkeyPatch) -> None:
    before = identity(_sine)
    monkeypatch.setitem(globals(), "LEVEL", 0.3)
    assert identity(_sine) != before


@pytest.mark.parametrize("own", [types.ModuleType("settings_of_mine"), type("Settings", (), {})])
@pytest.mark.parametrize("others", [0, 400])
def test_another_value_in_a_user_module_or_class_is_another_function(own: Any, others: int) -> None:
    """Even if the names are many, and their numbers long."""
    own.level, names = 0.2, {"own": own}
    many = "".join(f"    t = t + name{i}\n" for i in range(others))
    names |= {f"name{i}": 0.0 for i in range(others)}
    exec(f"def call(t):\n{many}    return own.level * t\n", names)
    before = identity(names["call"])
    own.level = 0.3
    assert identity(names["call"]) != before


def test_a_function_of_an_editable_package_is_identified_by_its_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    found = []
    for turn, rate in enumerate((0.1, 0.2)):
        name = f"lab_of_mine_{turn}"
        (tmp_path / f"{name}.py").write_text(
            f"__version__ = '1.0'\ndef inner(t):\n    return {rate} * t\n"
            "def call(t):\n    return inner(t)\n"
        )
        found.append(identity(__import__(name).call))
    assert found[0] != found[1]


def test_a_function_that_calls_itself_has_an_identity() -> None:
    names: dict[str, Any] = {}
    exec("def call(t):\n    return 1.0 if t < 1 else call(t - 1)\n", names)
    assert identity(names["call"]) == identity(names["call"])


@pytest.mark.slow
def test_another_process_gives_the_same_identity() -> None:
    code = """
import math, numpy as np
from math import cos
from numpy import sin
from gms_fsm.run._identity import identity
TABLE, LEVEL = np.linspace(0, 1, 5), 0.25
def inner(t, *, scale=(1, 2.5)):
    return scale[0] * LEVEL * math.sin(t) + cos(t) + sin(t)
def outer(word):
    names = frozenset({"one", "two", "three", word})
    return lambda t: inner(t) + np.interp(t, TABLE, TABLE) if word in {"a", "b"} else len(names)
print(identity(outer("four")))
"""
    found = {
        subprocess.run(
            [sys.executable, "-c", code],
            cwd=ROOT,
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "1", "2")
    }
    assert len(found) == 1


class _Callable:
    def __call__(self, t: float) -> float:
        return 0.1

    def method(self, t: float) -> float:
        return 0.1


class _Counter:
    level = 0.1


_HELD = _Counter()

UNKNOWN = {
    "object": _Callable(),
    "method": _Callable().method,
    "builtin": math.sin,
    "ufunc": np.sin,
    "generator": np.random.default_rng(1).normal,
    "partial of a builtin": functools.partial(math.pow, 0.1),
    "object inside": lambda t: _HELD.level * t,
    "object enclosed": (lambda held: lambda t: held.level * t)(_Counter()),
}


@pytest.mark.parametrize("kind", UNKNOWN)
def test_a_function_that_cannot_be_identified_is_refused_before_the_run(
    kind: str, tmp_path: Path
) -> None:
    path, rig = tmp_path / "run.checkpoint", Prescribed(UNKNOWN[kind])
    with pytest.raises(ParameterError, match="signal 'v' cannot be resumed; give an expression"):
        goes_on(path, rig)
    assert not path.exists()
    with pytest.raises(SignalError):
        identity(UNKNOWN[kind])


@pytest.mark.slow
def test_a_function_wrapped_by_a_compiler_is_identified_by_its_text(tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    begun(path, Prescribed(_Wrapped(_louder(0.2))))
    with pytest.raises(CheckpointError, match="another model"):
        goes_on(path, Prescribed(_Wrapped(_louder(0.1))))
    goes_on(path, Prescribed(_Wrapped(_louder(0.2))))


class _Wrapped:
    """What just-in-time compilers for Python make of a function."""

    def __init__(self, function: Callable[[float], float]) -> None:
        self.py_func = function

    def __call__(self, t: float) -> float:
        return self.py_func(t)


# --------------------------------------------------------------------------- user-defined rigs
class _Own:
    title, acceleration, numbers = "mine", "(F_a - F) / mass", {"mass": 1.0}
    signals = Slider(1.0, "0.2 * t").signals


def _own_rigs() -> dict[str, Any]:
    """Return rigs with a name of their own, with a built-in rig's name, and derived from one."""
    namesake = type("Slider", (_Own,), {"acceleration": "(2 * F_a - F) / mass"})
    derived = type("Slider", (Slider,), {"acceleration": "(2 * F_a - F) / mass"})
    return {"own": _Own(), "namesake": namesake(), "derived": derived(1.0, "0.2 * t")}


@pytest.mark.parametrize("kind", ["own", "namesake", "derived"])
def test_a_rig_of_a_custom_class_is_identified_by_its_texts(kind: str, tmp_path: Path) -> None:
    path, rigs = tmp_path / "run.checkpoint", _own_rigs()
    begun(path, rigs.pop(kind))
    before = path.read_bytes()
    for other in (Slider(1.0, "0.2 * t"), *rigs.values()):
        with pytest.raises(CheckpointError, match="another model, rig, signal"):
            goes_on(path, other)
    assert path.read_bytes() == before
    goes_on(path, _own_rigs()[kind])
    assert not path.exists()


# --------------------------------------------------------------------------- another program
def test_another_version_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.checkpoint"
    with monkeypatch.context() as patch:
        patch.setattr("gms_fsm._version.__version__", "0.0.7")
        begun(path, open_loop())
    with pytest.raises(CheckpointError, match=r"started by gms-fsm 0\.0\.7 .* this is gms-fsm "):
        goes_on(path, open_loop())
    with monkeypatch.context() as patch:
        patch.setattr("integrators.runners.compiled.edition", lambda: "another loop")
        with pytest.raises(CheckpointError, match="which may compute different bits"):
            goes_on(path, open_loop())


def test_a_checkpoint_of_another_format_belongs_to_another_program(tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    begun(path, open_loop())
    arrays = _arrays(path)
    _write(path, {"format": np.array("gms-fsm checkpoint 1"), "identity": arrays["identity"]})
    with pytest.raises(CheckpointError, match="started by an older gms-fsm"):
        goes_on(path, open_loop())


# --------------------------------------------------------------------------- impossible numbers
def _arrays(path: Path) -> dict[str, Any]:
    with np.load(path, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


def _write(path: Path, arrays: dict[str, Any]) -> None:
    with path.open("wb") as file:
        np.savez(file, **arrays)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("options", [{}, {"t_eval": np.linspace(0, 25, 333)}], ids=["all", "eval"])
def test_every_integer_and_every_shape_is_checked(
    engine: str, options: dict[str, Any], tmp_path: Path
) -> None:
    """Each array in turn: far out of range, one row short, one axis more, another type."""
    path = tmp_path / "run.checkpoint"
    begun(path, open_loop(), engine, **options)
    whole = _arrays(path)
    counted = {"loop_switches", "loop_changes", "kept_rows_microstep", "kept_stops_microstep"}
    tried = 0
    for name in [name for name in whole if name.startswith(("loop_", "kept_"))]:
        array = whole[name]
        changes = [array[np.newaxis], np.full(array.shape, "text")]
        if array.size > 1 and array.dtype.names is None:
            changes.append(array[:-1])
        if array.size and array.dtype.kind == "i" and name not in counted:
            changes.append(np.full_like(array, 10**12))
        for changed in changes:
            _write(path, {**whole, name: changed})
            with pytest.raises(CheckpointError, match=r"damaged .*remove it"):
                goes_on(path, open_loop(), engine, **options)
            tried += 1
    assert tried > 60
    for name in whole:
        _write(path, {other: array for other, array in whole.items() if other != name})
        with pytest.raises(CheckpointError):
            goes_on(path, open_loop(), engine, **options)
    _write(path, whole)
    goes_on(path, open_loop(), engine, **options)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("place", ["phase", "machine", "edge", "jump", "active", "taken"])
def test_each_index_is_checked_against_its_range(place: str, engine: str, tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    begun(path, open_loop(), engine)
    whole = _arrays(path)
    for value in (-7, 10**6):
        counts = whole["loop_counts"].copy()
        counts[states.COUNTS.index(place)] = value
        _write(path, {**whole, "loop_counts": counts})
        with pytest.raises(CheckpointError, match="not within"):
            goes_on(path, open_loop(), engine)


@pytest.mark.slow
def test_data_that_unpacks_to_more_than_the_file_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "run.checkpoint"
    begun(path, open_loop())
    whole = _arrays(path)
    with path.open("wb") as file:
        np.savez_compressed(file, **{**whole, "loop_y": np.zeros(50_000_000)})
    with zipfile.ZipFile(path) as archive:
        assert archive.getinfo("loop_y.npy").file_size > 100 * path.stat().st_size
    with pytest.raises(CheckpointError, match="unpacks to 400000128 bytes"):
        goes_on(path, open_loop())


def test_an_interrupted_run_with_a_function_continues_bit_for_bit(tmp_path: Path) -> None:
    path, rig = tmp_path / "run.checkpoint", Prescribed(_louder(0.2))
    begun(path, rig)
    trace = simulate(stick_slip("signed"), rig, 25.0, checkpoint=path)
    same_bits(trace, simulate(stick_slip("signed"), rig, 25.0))
