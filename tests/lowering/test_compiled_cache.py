"""Machine code is cached on disk, and damage to the cache costs time and nothing else.

Another process does not compile again; two may start at the same time; an unwritable folder or a
damaged file is tolerated, down to a single wrong bit. The name of a file depends on all that the
code depends on; programs compiled in different processes are never confused. Without llvmlite, the
message says what to install, and the machines run.
"""

from __future__ import annotations

import gc
import os
import random
import subprocess
import sys
import textwrap
import types
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import ChartModel, Prescribed, prepare, simulate
from gms_fsm.foundation.store import CodeFolder
from gms_fsm.lowering import compiling as compiled
from gms_fsm.lowering.program import lower
from gms_fsm.run.problem import Problem
from gms_fsm.run.recording import compiled_run, ready_code
from integrators import elementary, loop, step_size
from integrators.machine_code import calls
from integrators.machine_code.front_end import statements
from integrators.machine_code.layout import BlockLayout
from integrators.runners import columns
from integrators.runners import compiled as engines
from integrators.runners import edition as machine
from tests.helpers import CURVE, ROOT, open_loop, stick_slip

pytestmark = pytest.mark.slow

pytest.importorskip("llvmlite", reason="needs the extra fast")

OPEN_LOOP = Prescribed("0.2*sin(2*pi*t/20)")
NOTE = "gms-fsm: compiling, once for each chart and method"

# A whole run, by both engines. With an empty cache this takes some 4 s, which a terminal explains.
RUN = """
    import sys
    sys.stderr.isatty = lambda: True
    from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    rig = Prescribed("0.2*sin(2*pi*t/20)")
    one, other = (simulate(model, rig, 31.0, engine=e) for e in ("compiled", "machines"))
    assert one.rows.y.tobytes() == other.rows.y.tobytes()
    assert one.F.tobytes() == other.F.tobytes()
    assert one.transitions.tobytes() == other.transitions.tobytes()
    print("equal", len(one.transitions))
"""
# One function of one program: a second. The velocities are chosen so that a mix-up is visible.
ROWS = """
    import sys
    sys.stderr.isatty = lambda: True
    import numpy as np
    from gms_fsm import GMS, GMSParameters, Prescribed
    from gms_fsm.lowering import compiling as compiled
    from gms_fsm.lowering.program import lower
    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    t = np.linspace(0.0, 3.0, 50)
    y, mode = np.full((50, 5), 0.1), np.zeros((50, 4), dtype=np.int64)
    for velocity in sys.argv[1:]:
        program = lower(model, Prescribed(velocity))
        found = compiled.observe_rows(program, t, y, mode, range(14))
        for row in range(50):
            out = [0.0] * 14
            program.ieee["observe"](t[row], y[row].tolist(), [0] * 4, program.live, program.p, out)
            assert found[row].tolist() == out, velocity
    print("equal")
"""


def _start(code: str, *arguments: str, **environment: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", textwrap.dedent(code), *arguments],
        cwd=ROOT,
        env={**os.environ, **environment},
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def _ended(process: subprocess.Popen[str]) -> tuple[str, str]:
    """Return a process's output on both streams; it must have ended successfully."""
    out, err = process.communicate()
    assert process.returncode == 0, err
    return out, err


def _rows(folder: Path, *velocities: str) -> str:
    out, err = _ended(_start(ROWS, *velocities, GMS_FSM_CACHE=str(folder)))
    assert out == "equal\n"
    return err


def _kept(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.is_file()}


# --------------------------------------------------------------------------- once on this machine
@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A new cache folder after a first run, and what that run wrote to standard error."""
    folder = tmp_path_factory.mktemp("cache")
    out, err = _ended(_start(RUN, GMS_FSM_CACHE=str(folder)))
    assert out == "equal 24\n"
    return folder, err


def test_the_first_process_compiles_and_says_so_and_the_next_does_not(
    warm: tuple[Path, str], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, said = warm
    assert NOTE in said, "the wait is explained"
    before = {path: path.stat().st_ino for path in _kept(folder)}
    assert sorted(path.name.partition("-")[0] for path in before) == ["observe_free", "record"]
    assert _ended(_start(RUN, GMS_FSM_CACHE=str(folder))) == ("equal 24\n", "")
    assert {path: path.stat().st_ino for path in _kept(folder)} == before
    compiled.notify("compiling ...")  # here nobody waits
    assert capsys.readouterr() == ("", "")


def test_a_damaged_cache_only_costs_time(warm: tuple[Path, str]) -> None:
    """One file is garbage, one has a wrong bit: undetected, one in five crashes the process."""
    folder, _ = warm
    whole = sorted(_kept(folder))
    whole[0].write_bytes(b"garbage" * 9)
    _flip(whole[1], random.Random(14))
    out, err = _ended(_start(RUN, GMS_FSM_CACHE=str(folder)))
    assert (out, err.count(NOTE)) == ("equal 24\n", 2)
    assert "Traceback" not in err
    assert sorted(_kept(folder)) == whole
    assert all(CodeFolder(path.parent).get(path.name) for path in whole), "all are recreated"


def test_two_processes_that_start_at_once_both_succeed(tmp_path: Path) -> None:
    started = [_start(ROWS, "0.1*t", GMS_FSM_CACHE=str(tmp_path)) for _ in range(2)]
    assert [_ended(process)[0] for process in started] == ["equal\n"] * 2
    assert not list(tmp_path.rglob(".*")), "no half files are left"


# --------------------------------------------------------------------------- damage
@pytest.fixture
def observe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], bool]:
    """Return a function that uses one function of a program, and says whether it was compiled."""
    said: list[str] = []
    monkeypatch.setattr(compiled, "store", lambda: CodeFolder.at(tmp_path))
    monkeypatch.setattr(compiled, "notify", said.append)
    program = lower(stick_slip("signed"), Prescribed("0.1*t"))
    y, mode = [0.1, 0.2, 0.3, 0.2, 0.1], [0, 1, 0, 1]
    wanted = [0.0] * 14
    program.ieee["observe"](2.0, y, mode, program.live, program.p, wanted)

    def once() -> bool:
        said.clear()
        monkeypatch.setattr(compiled, "_observers", {})
        rows = np.array([2.0]), np.array([y]), np.array([mode])
        assert compiled.observe_rows(program, *rows, range(14)).tolist() == [wanted]
        return bool(said)

    return once


def test_functions_in_memory_give_way_when_they_are_many(
    observe: Callable[[], bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert observe()
    monkeypatch.setattr(compiled, "_observers", {-1: None})
    monkeypatch.setattr(compiled, "MOST_ENGINES", 1)
    program = lower(stick_slip("signed"), Prescribed("0.1*t"))
    rows = np.array([2.0]), np.zeros((1, 5)), np.zeros((1, 4), dtype=int)
    compiled.observe_rows(program, *rows, range(14))
    assert [*compiled._observers] == [(id(program.functions), range(14), False)]


def _flip(path: Path, source: random.Random) -> None:
    content = bytearray(path.read_bytes())
    bit = source.randrange(8 * len(content))
    content[bit // 8] ^= 1 << bit % 8
    path.write_bytes(content)


def test_a_damaged_file_is_replaced_but_a_folder_in_its_place_is_left_alone(
    observe: Callable[[], bool], tmp_path: Path
) -> None:
    """It costs the time once, not each time; what damage is detected, the store says."""
    assert observe()
    (path,) = _kept(tmp_path)
    _flip(path, random.Random(3))
    assert observe()
    assert _kept(tmp_path) == {path}
    assert not observe()
    path.unlink()
    path.mkdir()
    assert observe()
    assert path.is_dir()


def test_a_folder_that_cannot_be_written_only_costs_time(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("not a folder")
    for folder in (in_the_way, in_the_way / "below", Path("/proc/no such place")):
        assert CodeFolder.at(folder) is None
    assert "Traceback" not in _rows(in_the_way / "below", "0.1*t")
    assert in_the_way.read_text() == "not a folder"
    assert list(tmp_path.iterdir()) == [in_the_way]


# --------------------------------------------------------------------------- no mix-up
def test_programs_compiled_in_different_processes_are_not_confused(tmp_path: Path) -> None:
    """Each is the first that its process compiles; a third process loads and uses both twice."""
    velocities = "0.1*t", "0.2*sin(t)"
    for velocity in velocities:
        _rows(tmp_path, velocity)
    before = _kept(tmp_path)
    assert len(before) == 2
    out, _ = _ended(_start(ROWS, *velocities, *velocities, GMS_FSM_CACHE=str(tmp_path),
                           PYTHONHASHSEED="0"))  # fmt: skip
    assert out == "equal\n"
    assert _kept(tmp_path) == before


# --------------------------------------------------------------------------- changed source
def _of(module: str) -> Any:
    """Return a function as if it had been written in a module."""

    def other(a: Any, b: Any) -> Any:
        return a - b

    other.__module__ = module
    return other


_other_norm, _other_loop = _of(step_size.__name__), _of(columns.__name__)
_other_key, _other_body = _of(BlockLayout.__module__), _of(statements.__name__)


CHANGES: tuple[tuple[Any, str, Any], ...] = (
    (step_size, "error_norm", _other_norm),
    (columns, "record", _other_loop),
    (BlockLayout, "key", _other_key),
    (statements, "body", _other_body),
    (step_size, "SAFETY", 0.8),
    (elementary, "LOW", (1.0, *elementary.LOW[1:])),
    (loop, "MOST_SWITCHES", 99),
    (sys, "version", "4.0"),
)


def test_the_edition_covers_every_module_whose_functions_are_translated() -> None:
    named = [each for module in machine.LOOPS for each in vars(module).values()]
    functions = [each for each in named if isinstance(each, types.FunctionType)]
    modules = {each.__module__ for each in functions} - {"typing", "dataclasses"}  # of records
    assert modules == {module.__name__ for module in machine.LOOPS}


def test_changed_source_changes_the_edition(monkeypatch: pytest.MonkeyPatch) -> None:
    machine.edition.cache_clear()
    found = [machine.edition()]
    for place, name, other in CHANGES:
        with monkeypatch.context() as patch:
            patch.setattr(place, name, other)
            machine.edition.cache_clear()
            found.append(machine.edition())
    assert len(set(found)) == len(found) == 1 + len(CHANGES)
    machine.edition.cache_clear()
    assert machine.edition() == found[0]


def test_what_a_run_keeps_is_no_part_of_the_edition(monkeypatch: pytest.MonkeyPatch) -> None:
    found = set()
    for kept in ({}, {"a system": 1.5}):
        monkeypatch.setattr(loop, "kept", kept, raising=False)
        machine.edition.cache_clear()
        found.add(machine.edition())
    monkeypatch.undo()
    machine.edition.cache_clear()
    assert len(found) == 1


class _Names:
    """A store that knows nothing, keeps nothing, and remembers the name that it was asked for."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    def get(self, name: str) -> bytes | None:
        self.asked.append(name)
        raise LookupError

    def put(self, name: str, content: bytes) -> None:
        raise AssertionError


def _name(rig: Prescribed = OPEN_LOOP, elements: int = 4, **options: Any) -> str:
    """Return the name of the machine code of a run."""
    store = _Names()
    values = {name: np.ravel(value)[0] for name, value in stick_slip("signed").values.items()}
    model = ChartModel(stick_slip("signed").chart, values, n=elements, stribeck=CURVE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiled, "store", lambda: store)
        patch.setattr(ready_code, "_known", {})
        with pytest.raises(LookupError):
            simulate(model, rig, 1.0, engine="compiled", **options)
    return store.asked[0]


def test_the_name_depends_on_all_that_the_code_depends_on(monkeypatch: pytest.MonkeyPatch) -> None:
    names = {
        "usual": _name(),
        "another text": _name(Prescribed("0.2*t")),
        "another flow is called": _name(events="step", method="rk4", step=0.1),
        "other coefficients": _name(method="heun", step=0.1),
        "another layout": _name(elements=5),
        "lengths that are variables": _name(elements=200),
    }
    for place, attribute in ((engines, "edition"), (engines, "target_name")):
        with monkeypatch.context() as patch:
            patch.setattr(place, attribute, lambda: "another")
            names[attribute] = _name()
    with monkeypatch.context() as patch:
        patch.setattr(compiled, "piecewise_linear", _other_loop)
        names["a function that the text may call"] = _name()
    assert len(set(names.values())) == len(names), names
    assert _name() == names["usual"]


def test_one_code_serves_all_numbers() -> None:
    assert _name(t_eval=[0.1, 0.2]) == _name()
    assert _name(rtol=1e-4, max_step=0.1) == _name()
    assert _name(elements=300) == _name(elements=200)


def test_a_digest_depends_on_code_and_constants_but_not_on_the_file() -> None:
    def function(text: str) -> Callable[..., Any]:
        names: dict[str, Any] = {}
        exec(compile(text, "<one>", "exec"), names)
        return names["f"]  # type: ignore[no-any-return]

    one = function("def f(a):\n    return a + 1.0\n")
    same = function("\n\n\ndef f(a):\n    return a + 1.0\n")
    others = [
        function(f"def f({name}):\n    {text}\n")
        for name, text in (
            ("a", "return a + 1.5"),
            ("a", "return a - 1.0"),
            ("b", "return b + 1.0"),
            ("a", "def g(b):\n        return b\n    return a + 1.0"),
            ("a", "return abs(a)"),
            ("a", "return max(a)"),
        )
    ]
    digests = {machine.digest(u) for u in (one, *others)}
    assert len(digests) == 1 + len(others)
    assert machine.digest(same) == machine.digest(one) != machine.digest(one, text="more")


# --------------------------------------------------------------------------- at once, and better
def test_what_was_compiled_at_once_is_replaced_where_it_takes_time_and_has_the_same_bits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled, "store", lambda: CodeFolder.at(tmp_path))
    monkeypatch.setattr(ready_code, "_known", {})

    def kinds() -> list[bool]:
        return sorted(path.name.endswith("-at-once") for path in _kept(tmp_path))

    def run() -> bytes:
        trace = simulate(stick_slip("signed"), OPEN_LOOP, 31.0, engine="compiled")
        return trace.rows.y.tobytes() + trace.transitions.tobytes()

    first = run()
    assert kinds() == [True]
    monkeypatch.setattr(calls, "AT_ONCE", 0.0)
    assert run() == first
    assert kinds() == [False, True]
    monkeypatch.setattr(ready_code, "_known", {})
    path = next(each for each in _kept(tmp_path) if each.name.endswith("-at-once"))
    path.unlink()
    assert run() == first
    assert kinds() == [False], "the better one is what is loaded"


def test_what_repeats_a_run_is_compiled_when_a_run_is_repeated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled, "store", lambda: CodeFolder.at(tmp_path))
    monkeypatch.setattr(ready_code, "_known", {})
    prepared = prepare(stick_slip("signed"), OPEN_LOOP, 31.0)
    assert not _kept(tmp_path)
    end = prepared.end()
    assert sorted(path.name.partition("-")[0] for path in _kept(tmp_path)) == ["adapt", "record"]
    trace = simulate(stick_slip("signed"), OPEN_LOOP, 31.0, engine="machines")
    assert end.y == tuple(trace.rows.y[-1].tolist())


# --------------------------------------------------------------------------- several threads
def test_threads_may_compile_at_the_same_time(tmp_path: Path) -> None:
    code = """
        import threading
        import numpy as np
        from gms_fsm import GMS, GMSParameters, Prescribed, simulate

        model = GMS(GMSParameters.paper("stick-slip"), law="signed")
        begin, found = threading.Barrier(3), {}

        def work(number: int, velocity: str) -> None:
            begin.wait()
            trace = simulate(model, Prescribed(velocity), 3.0, engine="compiled")
            found[number] = trace.rows.y.tobytes() + trace.F.tobytes()

        velocities = ["0.1*t", "0.1*t", "0.2*sin(t)"]
        threads = [threading.Thread(target=work, args=each) for each in enumerate(velocities)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for number, velocity in enumerate(velocities):
            trace = simulate(model, Prescribed(velocity), 3.0)
            assert found[number] == trace.rows.y.tobytes() + trace.F.tobytes()
        print("equal")
    """
    assert _ended(_start(code, GMS_FSM_CACHE=str(tmp_path)))[0] == "equal\n"


# --------------------------------------------------------------------------- without llvmlite
WITHOUT = """
    import sys
    for name in {absent!r}:
        sys.modules[name] = None
    import numpy as np
    from gms_fsm import GMS, GMSParameters, Prescribed, Trace, errors, simulate, sweep
    model, rig = GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2")
    for ask in (
        lambda: simulate(model, rig, 3.0, engine="compiled"),
        lambda: simulate(model, rig, 3.0, engine="compiled", output="end"),
        lambda: sweep(model, rig, 3.0, {{"F_s": [1.0, 2.0]}}),
    ):
        try:
            ask()
        except errors.MissingExtraError as error:
            print(error)
        else:
            raise SystemExit("not refused")
    assert len(simulate(model, rig, 3.0).transitions) == 4
    assert len(simulate(model, rig, 3.0, engine="ifelse").transitions) == 4
    made = sweep(model, rig, 3.0, {{"F_s": [1.0, 2.0]}}, engine="machines")
    assert made.outcome.tolist() == ["ok", "ok"], made.message
    for path in sys.argv[1:]:
        print(float(Trace.load(path).F[-1]), len(Trace.load(path).sample([1.0])))
"""


@pytest.mark.every(2)
@pytest.mark.parametrize("absent", [["llvmlite"], ["platformdirs"]])
def test_without_the_extra_the_message_says_what_to_install(
    absent: list[str], tmp_path: Path
) -> None:
    trace = simulate(stick_slip("signed"), open_loop(), 3.0, engine="compiled")
    path = trace.save(tmp_path / "compiled.npz")
    out, err = _ended(_start(WITHOUT.format(absent=absent), str(path)))
    *said, loaded = out.splitlines()
    assert len(said) == 3
    for line in said:
        for word in (absent[0], "not installed", "gms-fsm[fast]", "engine='machines'"):
            assert word in line
    assert loaded == f"{float(trace.F[-1])} 1", "results computed with it are readable without it"
    assert err == ""


def test_llvmlite_is_not_loaded_before_it_is_needed() -> None:
    code = """
        import sys
        import gms_fsm
        from gms_fsm import GMS, GMSParameters, Prescribed, simulate, sweep
        model, rig = GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2")
        simulate(model, rig, 3.0)
        sweep(model, rig, 3.0, {"F_s": [1.0, 2.0]}, engine="machines")
        print("llvmlite" in sys.modules)
    """
    assert _ended(_start(code))[0] == "False\n"


# --------------------------------------------------------------------------- memory of calls
@pytest.mark.parametrize("ending", [False, True])
def test_memory_is_given_back_but_not_while_the_interpreter_ends(
    ending: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = compiled_run.CompiledRun(Problem.of(stick_slip("signed"), OPEN_LOOP, 1.0), None)
    prepared, words = run.columns.prepared, run.columns.block.address
    prepared._spare.clear()
    monkeypatch.setattr(weakref.finalize, "_shutdown", ending)
    del run
    gc.collect()
    assert [each.address for each in prepared._spare] == [words] * (not ending)
