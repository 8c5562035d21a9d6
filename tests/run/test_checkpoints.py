"""A checkpoint survives a killed process; it is refused unless this program wrote it for this run.

The same Python function means the same code, constants, defaults, enclosed values and globals, in
any process; if that cannot be determined, the run is refused before it starts. Compiled code would
use an invalid number as a memory address, so each is checked; nothing too large is unpacked. That
runs go on bit for bit is in tests/laws/test_interrupted_runs_go_on.py.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
import math
import os
import signal
import subprocess
import sys
import textwrap
import time
import types
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import ElementMachines, Prescribed, Slider, Trace, simulate
from gms_fsm.app.report import run_scenario
from gms_fsm.app.scenario import load_scenario
from gms_fsm.errors import CheckpointError, ParameterError, SignalError
from gms_fsm.run._checkpoint import Checkpointer
from gms_fsm.run._identity import identity
from integrators.runners import states
from tests.corpus import ENGINES, belt
from tests.helpers import FASTEST, ROOT, open_loop, other_parts, pulled_mass, same_bits, stick_slip

LEVEL = 0.2
BOTH = sorted({"machines", FASTEST})
SYSTEM = {"initial": {"q2": 0.2, "pad.states": ["backward"]}, "engine": "ifelse"}


@pytest.fixture(autouse=True)
def _short_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a compiled run return often enough to be interrupted."""
    monkeypatch.setattr("gms_fsm.run.recording.compiled_run.STEPS_AT_ONCE", 60)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run.checkpoint"


def begun(path: Path, *subject: Any, t_end: float = 25.0, **options: Any) -> None:
    """Create the checkpoint of a run interrupted on its way."""

    def stop(moment: Any) -> None:
        if moment.t > 0.4 * t_end:
            raise InterruptedError

    how = {"engine": "machines", **options, "checkpoint_every": 0.0, "progress": stop}
    with pytest.raises(InterruptedError):
        simulate(*(subject or (stick_slip("signed"), open_loop())), t_end, checkpoint=path, **how)


def goes_on(path: Path, *subject: Any, t_end: float = 25.0, **options: Any) -> Trace:
    how = {"engine": "machines", **options}
    subject = subject or (stick_slip("signed"), open_loop())
    return simulate(*subject, t_end, checkpoint=path, **how)


def on(signal: Any) -> tuple[Any, Any]:
    return stick_slip("signed"), Prescribed(signal)


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


class _Wrapped:
    """What just-in-time compilers for Python make of a function."""

    def __init__(self, function: Callable[[float], float]) -> None:
        self.py_func = function

    def __call__(self, t: float) -> float:
        return self.py_func(t)


PAIRS = {
    "constant": (lambda t: 0.2 * math.sin(t / 3), lambda t: 0.1 * math.sin(t / 3)),
    "code": (lambda t: 0.2 * math.sin(t / 3), lambda t: 0.2 * math.cos(t / 3)),
    "operator": (lambda t: 0.2 * t, lambda t: 0.2 / (t + 1)),
    "closure": (_louder(0.2), _louder(0.1)),
    "default": (_default(0.2), _default(0.1)),
    "array": (_table(0.1, 0.2), _table(0.1, 0.3)),
    "partial": (functools.partial(_default(0.2), level=0.3), functools.partial(_default(0.2))),
    "function inside": (lambda t: _louder(0.2)(t), lambda t: _default(0.2)(t)),
    "wrapped": (_Wrapped(_louder(0.2)), _Wrapped(_louder(0.1))),
}


@pytest.mark.parametrize("pair", PAIRS)
def test_another_function_is_another_one(pair: str) -> None:
    one, other = PAIRS[pair]
    assert identity(one) == identity(one) != identity(other)


def test_another_function_is_refused(path: Path) -> None:
    begun(path, *on(_louder(0.2)))
    before = path.read_bytes()
    with pytest.raises(CheckpointError, match="another model, rig, signal"):
        goes_on(path, *on(_louder(0.1)))
    assert path.read_bytes() == before
    again = goes_on(path, *on(_louder(0.2)))  # made anew: the same
    assert not path.exists()
    assert other_parts(again, simulate(*on(_louder(0.2)), 25.0)) == []


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
    found = [
        subprocess.check_output(
            [sys.executable, "-c", code], cwd=ROOT, env={**os.environ, "PYTHONHASHSEED": seed}
        )
        for seed in ("0", "1")
    ]
    assert found[0] == found[1]


class _Held:
    level = 0.1

    def __call__(self, t: float) -> float:
        return 0.1

    def method(self, t: float) -> float:
        return 0.1


_HELD = _Held()
UNKNOWN = {
    "object": _HELD,
    "method": _HELD.method,
    "builtin": math.sin,
    "ufunc": np.sin,
    "generator": np.random.default_rng(1).normal,
    "partial of a builtin": functools.partial(math.pow, 0.1),
    "object inside": lambda t: _HELD.level * t,
    "object enclosed": (lambda held: lambda t: held.level * t)(_Held()),
}


@pytest.mark.parametrize("kind", UNKNOWN)
def test_a_function_that_cannot_be_identified_is_refused_before_the_run(
    kind: str, path: Path
) -> None:
    told: list[object] = []
    with pytest.raises(ParameterError, match="signal 'v' cannot be resumed; give an expression"):
        goes_on(path, *on(UNKNOWN[kind]), progress=told.append)
    assert told == []
    assert not path.exists()
    with pytest.raises(SignalError):
        identity(UNKNOWN[kind])


# --------------------------------------------------------------------------- other runs
class _Own:
    title, acceleration, numbers = "mine", "(F_a - F) / mass", {"mass": 1.0}
    signals = Slider(1.0, "0.2 * t").signals


def _own_rigs() -> dict[str, Any]:
    """Return rigs with a name of their own, with a built-in rig's name, and derived from one."""
    namesake = type("Slider", (_Own,), {"acceleration": "(2 * F_a - F) / mass"})
    derived = type("Slider", (Slider,), {"acceleration": "(2 * F_a - F) / mass"})
    return {"own": _Own(), "namesake": namesake(), "derived": derived(1.0, "0.2 * t")}


@pytest.mark.parametrize("kind", ["own", "namesake", "derived"])
def test_a_rig_of_a_custom_class_is_identified_by_its_texts(kind: str, path: Path) -> None:
    rigs = _own_rigs()
    begun(path, stick_slip("signed"), rigs.pop(kind))
    before = path.read_bytes()
    for other in (Slider(1.0, "0.2 * t"), *rigs.values()):
        with pytest.raises(CheckpointError, match="another model, rig, signal"):
            goes_on(path, stick_slip("signed"), other)
    assert path.read_bytes() == before
    goes_on(path, stick_slip("signed"), _own_rigs()[kind])
    assert not path.exists()


def test_a_checkpoint_of_another_run_is_refused(path: Path) -> None:
    begun(path)
    before = path.read_bytes()
    changes: list[dict[str, Any]] = [{"rtol": 1e-7}, {"output": "end"}, {"initial": {"x": 1.0}}]
    for change in [*changes, {"t_end": 26.0}]:
        with pytest.raises(CheckpointError, match=r"another.*remove it"):
            goes_on(path, **change)
    for subject in ((stick_slip("published"), open_loop()), on("0.2")):
        with pytest.raises(CheckpointError, match=r"another.*remove it"):
            goes_on(path, *subject)
    assert path.read_bytes() == before


def test_another_version_is_named(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr("gms_fsm._version.__version__", "0.0.7")
        begun(path)
    with pytest.raises(CheckpointError, match=r"started by gms-fsm 0\.0\.7 .* this is gms-fsm "):
        goes_on(path)
    monkeypatch.setattr("integrators.runners.edition.edition", lambda: "another loop")
    with pytest.raises(CheckpointError, match="which may compute different bits"):
        goes_on(path)
    _write(
        path, {"format": np.array("gms-fsm checkpoint 1"), "identity": _arrays(path)["identity"]}
    )
    with pytest.raises(CheckpointError, match="started by an older gms-fsm"):
        goes_on(path)


# --------------------------------------------------------------------------- damage
def _arrays(path: Path) -> dict[str, Any]:
    with np.load(path, allow_pickle=False) as file:
        return dict(file)


def _write(path: Path, arrays: dict[str, Any]) -> None:
    with path.open("wb") as file:
        np.savez(file, **arrays)


def test_a_damaged_checkpoint_is_refused(path: Path) -> None:
    begun(path)
    whole = path.read_bytes()
    for content in (whole[:500], b"hello", b""):
        path.write_bytes(content)
        with pytest.raises(CheckpointError, match="damaged"):
            goes_on(path)
    for arrays in ({"a": np.zeros(3)}, {"format": np.array("another program's")}):
        _write(path, arrays)
        with pytest.raises(CheckpointError, match="damaged"):
            goes_on(path)


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "options"),
    [*zip(BOTH, [{"t_eval": np.linspace(0, 25, 333)}, {}], strict=False)],  # in turn
    ids=BOTH,
)
def test_every_integer_and_every_shape_is_checked(
    engine: str, options: dict[str, Any], path: Path
) -> None:
    """Each array in turn: far out of range, one row short, one axis more, another type."""
    begun(path, engine=engine, **options)
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
                goes_on(path, engine=engine, **options)
            tried += 1
    assert tried > 60
    for name in whole:
        _write(path, {other: array for other, array in whole.items() if other != name})
        with pytest.raises(CheckpointError):
            goes_on(path, engine=engine, **options)
    for place in ("phase", "machine", "edge", "jump", "active", "taken"):
        for value in (-7, 10**6):
            counts = whole["loop_counts"].copy()
            counts[states.COUNTS.index(place)] = value
            _write(path, {**whole, "loop_counts": counts})
            with pytest.raises(CheckpointError, match="not within"):
                goes_on(path, engine=engine, **options)
    _write(path, whole)
    goes_on(path, engine=engine, **options)


@pytest.mark.slow
def test_data_that_unpacks_to_more_than_the_file_is_not_unpacked(path: Path) -> None:
    begun(path)
    whole = _arrays(path)
    with path.open("wb") as file:
        np.savez_compressed(file, **{**whole, "loop_y": np.zeros(10_000_000)})
    with zipfile.ZipFile(path) as archive:
        assert archive.getinfo("loop_y.npy").file_size > 100 * path.stat().st_size
    with pytest.raises(CheckpointError, match="unpacks to 80000128 bytes"):
        goes_on(path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "value"), [("loop_mode", 3), ("loop_edges", 9), ("kept_log", "none")]
)
def test_values_that_no_run_of_a_system_can_have_are_refused(
    name: str, value: Any, path: Path
) -> None:
    begun(path, belt(), t_end=12.0, **SYSTEM)
    arrays = _arrays(path)
    if name == "kept_log":
        arrays[name]["contact"][0] = value
    else:  # those of the second machine: it has two states and three edges
        arrays[name][1] = value
    with pytest.raises(CheckpointError, match="another model, rig, signal"):
        goes_on(path, belt("0.2"), t_end=12.0, **SYSTEM)
    _write(path, arrays)
    with pytest.raises(CheckpointError, match="damaged"):
        goes_on(path, belt(), t_end=12.0, **SYSTEM)


# --------------------------------------------------------------------------- going on
def test_checkpoints_are_written_at_the_requested_interval(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    saved = []
    save = Checkpointer.save
    monkeypatch.setattr(Checkpointer, "save", lambda keeper: (saved.append(0), save(keeper))[1])
    goes_on(path, checkpoint_every=1e6)
    assert len(saved) == 1  # at the start


@pytest.mark.parametrize("engine", sorted({*ENGINES} - {"ifelse"}))
def test_user_machines_continue_in_their_states(engine: str, path: Path) -> None:
    """Interrupted again and again: each firing calls them once."""
    (model, rig), fired, interrupts = (stick_slip("signed"), open_loop()), list[str](), 0

    def machines() -> ElementMachines:
        made = ElementMachines(model)
        for state in ("slip", "stick"):
            register = getattr(made.machine, f"on_enter_{state}")
            register(lambda event: fired.append(event.transition.dest))
        return made

    def stop(_: object) -> None:
        nonlocal interrupts
        if next(told) == 9:
            interrupts += 1
            raise InterruptedError

    whole = None
    while whole is None:
        told, last = itertools.count(1), machines()
        how = {"engine": engine, "machines": last, "checkpoint_every": 0.0, "progress": stop}
        with contextlib.suppress(InterruptedError):
            whole = goes_on(path, model, rig, **how)
    assert interrupts
    assert fired == whole.transitions.target.tolist()
    assert last.elements[0].state == "stick"


@pytest.mark.slow
def test_a_killed_process_can_be_resumed(tmp_path: Path) -> None:
    """SIGKILL at some moment; the next process ends with the bits of an undisturbed run."""
    script = tmp_path / "long.py"
    script.write_text(
        textwrap.dedent(
            """
            import sys, time
            from gms_fsm import simulate
            from tests.helpers import pulled_mass
            trace = simulate(*pulled_mass(), 20.0, checkpoint="long.checkpoint",
                             checkpoint_every=0.0, progress=lambda _: time.sleep(1e-3))
            trace.save("long.npz")
            """
        )
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(script)]
    child = subprocess.Popen(command, cwd=tmp_path, env=environment)
    while not (tmp_path / "long.checkpoint").exists():
        time.sleep(0.01)
    time.sleep(0.1)
    child.send_signal(signal.SIGKILL)
    child.wait()
    assert (tmp_path / "long.checkpoint").exists()
    assert not (tmp_path / "long.npz").exists()
    subprocess.run(command, cwd=tmp_path, env=environment, check=True)
    same_bits(Trace.load(tmp_path / "long.npz"), simulate(*pulled_mass(), 20.0))
    assert not (tmp_path / "long.checkpoint").exists()


@pytest.mark.slow
def test_the_command_line_resumes(tmp_path: Path, gms_fsm: Any) -> None:
    """`gms-fsm run --checkpoint`, interrupted, then the same command again."""
    loaded = load_scenario("pulled_mass", [])
    told = itertools.count(1)

    def stop(_: object) -> None:
        if next(told) == 30:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        run_scenario(loaded, tmp_path, stop, checkpoint=True)
    assert (tmp_path / "run.checkpoint").exists()
    options = ("-o", str(tmp_path), "--checkpoint", "--set", "output.figures=[]")
    gms_fsm("run", str(loaded.path), *options)
    assert not (tmp_path / "run.checkpoint").exists()
    whole = simulate(loaded.model, loaded.rig, **loaded.arguments)
    same_bits(Trace.load(tmp_path / "trace.npz"), whole)
