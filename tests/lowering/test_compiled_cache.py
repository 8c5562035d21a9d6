"""Machine code is cached on disk, and damage to the cache costs time and nothing else.

Another process does not compile again; two may start at the same time; an unwritable folder or a
damaged file is tolerated, down to a single wrong bit; changed source has another name; programs
compiled in different processes are never confused. Without numba, the message says what to
install, and the machines run.
"""

from __future__ import annotations

import os
import random
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.lowering import _compiled as compiled
from gms_fsm.lowering._store import Store
from gms_fsm.lowering.program import lower
from integrators import columns, loop, step_size
from integrators import compiled as machine
from tests.helpers import ROOT, open_loop, stick_slip

pytestmark = pytest.mark.slow

numba = pytest.importorskip("numba", reason="needs the extra fast")

NOTE = "gms-fsm: compiling the engine, once on this machine"

# A whole run, by both engines. On a new machine this takes some 10 s, most of it for the loop.
RUN = """
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
    import numpy as np
    from gms_fsm import GMS, GMSParameters, Prescribed
    from gms_fsm.lowering import _compiled as compiled
    from gms_fsm.lowering.program import lower
    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    t = np.linspace(0.0, 3.0, 50)
    y, mode = np.full((50, 5), 0.1), np.zeros((50, 4), dtype=np.int64)
    for velocity in sys.argv[1:]:
        program = lower(model, Prescribed(velocity))
        found = compiled.observe_rows(program, t, y, mode)
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
        env={**os.environ, "NUMBA_OPT": "0", **environment},  # halves the compilation time
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
    out, err = _ended(_start(ROWS, *velocities, NUMBA_CACHE_DIR=str(folder)))
    assert out == "equal\n"
    return err


def _kept(folder: Path) -> set[Path]:
    return {path for path in folder.rglob("*") if path.is_file()}


# --------------------------------------------------------------------------- once on this machine
@pytest.fixture(scope="module")
def warm(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A new cache folder after a first run, and what that run wrote to standard error."""
    folder = tmp_path_factory.mktemp("cache")
    out, err = _ended(_start(RUN, NUMBA_CACHE_DIR=str(folder)))
    assert out == "equal 24\n"
    return folder, err


def test_the_first_process_compiles_and_says_so(warm: tuple[Path, str]) -> None:
    folder, said = warm
    assert NOTE in said, "the wait is explained"
    assert len([path for path in _kept(folder) if path.match("record-*")]) == 1


def test_two_processes_that_start_at_once_both_succeed(tmp_path: Path) -> None:
    started = [_start(ROWS, "0.1*t", NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2)]
    assert [_ended(process)[0] for process in started] == ["equal\n"] * 2
    assert not list(tmp_path.rglob(".*")), "no half files are left"


def test_the_next_process_does_not_compile_again(warm: tuple[Path, str]) -> None:
    folder, _ = warm
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
    assert _ended(_start(RUN, NUMBA_CACHE_DIR=str(folder))) == ("equal 24\n", "")
    after = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
    assert after == before


def test_a_damaged_cache_only_costs_time(warm: tuple[Path, str]) -> None:
    """Every file of it is garbage, or truncated. The loop is not compiled again (10 s)."""
    folder, _ = warm
    for turn, path in enumerate(sorted(_kept(folder))):
        content = path.read_bytes()
        path.write_bytes(b"garbage" * 9 if turn % 2 else content[: len(content) // 2])
        if path.match("record-*"):
            assert Store(path.parent).get(path.name) is None
            path.write_bytes(content)
    out, err = _ended(_start(RUN, NUMBA_CACHE_DIR=str(folder)))
    assert out == "equal 24\n"
    assert "Traceback" not in err


def test_a_wrong_bit_anywhere_is_detected_before_the_code_is_loaded(warm: tuple[Path, str]) -> None:
    """Undetected, one in five crashes the process. Each process here has one in each file."""
    folder, source = warm[0], random.Random(14)
    whole = _kept(folder)
    for _ in range(3):
        small = [path for path in whole if not path.match("record-*")]  # that one takes 10 s
        for path in small:
            _flip(path, source)
        assert _ended(_start(RUN, NUMBA_CACHE_DIR=str(folder))) == ("equal 24\n", "")
        assert _kept(folder) == set(whole)
        assert all(Store(path.parent).get(path.name) for path in whole), "all are recreated"


# --------------------------------------------------------------------------- damage of every kind
def _forget_all() -> None:
    for cached in (compiled._machine_code, compiled._loaded):
        cached.cache_clear()


@pytest.fixture
def observe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], Any]]:
    """Return a function that compiles and tries one function, as a new process would."""
    monkeypatch.setattr(compiled, "store", lambda: Store.at(tmp_path))
    program = lower(stick_slip("signed"), Prescribed("0.1*t"))
    y, mode = [0.1, 0.2, 0.3, 0.2, 0.1], [0, 1, 0, 1]
    wanted = [0.0] * 14
    program.ieee["observe"](2.0, y, mode, program.live, program.p, wanted)

    def once() -> Any:
        _forget_all()
        [code], found = compiled.machine_code(program, "observe"), np.zeros(14)
        live = np.array(program.live)
        code(2.0, np.array(y), np.array(mode), live, compiled.packed(program.p), found)
        assert found.tolist() == wanted
        return code

    yield once
    _forget_all()


def _flip(path: Path, source: random.Random) -> None:
    content = bytearray(path.read_bytes())
    bit = source.randrange(8 * len(content))
    content[bit // 8] ^= 1 << bit % 8
    path.write_bytes(content)


def _flipped(path: Path) -> None:
    _flip(path, random.Random(3))


def _truncated(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def _empty(path: Path) -> None:
    path.write_bytes(b"")


def _garbage(path: Path) -> None:
    path.write_bytes(b"\x80\x05garbage" * 100)


def _another_kind(path: Path) -> None:
    path.unlink()
    path.mkdir()


def _another_name(path: Path) -> None:
    """A complete file that was stored for another function."""
    Store(path.parent).put("other", b"content")
    path.write_bytes((path.parent / "other").read_bytes())
    (path.parent / "other").unlink()


def _unreadable(path: Path) -> None:
    """A complete file whose content has another meaning."""
    Store(path.parent).put(path.name, b"something else")


DAMAGES = [_flipped, _truncated, _empty, _garbage, _another_name, _unreadable]


@pytest.mark.parametrize("damage", [*DAMAGES, _another_kind])
def test_a_damaged_file_is_tolerated(
    damage: Callable[[Path], None], observe: Callable[[], Any], tmp_path: Path
) -> None:
    observe()
    (path,) = _kept(tmp_path)
    damage(path)
    assert not observe().stats.cache_hits


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_cache_is_rebuilt(
    damage: Callable[[Path], None], observe: Callable[[], Any], tmp_path: Path
) -> None:
    """It costs the time once, not each time."""
    observe()
    (path,) = _kept(tmp_path)
    damage(path)
    observe()
    assert _kept(tmp_path) == {path}
    assert observe().stats.cache_hits


def test_a_folder_that_cannot_be_written_only_costs_time(tmp_path: Path) -> None:
    in_the_way = tmp_path / "file"
    in_the_way.write_text("not a folder")
    for folder in (in_the_way, in_the_way / "below", Path("/proc/no such place")):
        assert Store.at(folder) is None
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
    _rows(tmp_path, *velocities, *velocities)
    assert _kept(tmp_path) == before


def test_the_names_are_the_same_in_every_process(tmp_path: Path) -> None:
    for seed in ("0", "1", "random"):
        out, _ = _ended(_start(ROWS, "0.1*t", NUMBA_CACHE_DIR=str(tmp_path), PYTHONHASHSEED=seed))
        assert out == "equal\n"
    assert len(_kept(tmp_path)) == 2  # the program's observe, and its caller for each row


# --------------------------------------------------------------------------- changed source
def _other(a: Any, b: Any) -> Any:
    return a - b


def _changes(patch: pytest.MonkeyPatch) -> dict[str, Callable[[], None]]:
    return {
        "an inlined function": lambda: patch.setattr(
            machine, "_INLINED", (*machine._INLINED[:-1], _other)
        ),
        "a function of an arc": lambda: patch.setattr(
            machine, "_OF_AN_ARC", (*machine._OF_AN_ARC[1:], _other)
        ),
        "the loop": lambda: patch.setattr(columns, "record", _other),
        "a number": lambda: patch.setattr(step_size, "SAFETY", 0.8),
        "a limit": lambda: patch.setattr(loop, "MOST_SWITCHES", 99),
        "Python": lambda: patch.setattr(sys, "version", "4.0"),
    }


def test_changed_source_changes_the_edition() -> None:
    usual = machine.edition()
    found = {"nothing": usual}
    with pytest.MonkeyPatch.context() as patch:
        names = list(_changes(patch))
    for name in names:
        with pytest.MonkeyPatch.context() as patch:
            _changes(patch)[name]()
            found[name] = machine.edition()
    assert len(set(found.values())) == len(found), found
    assert machine.edition() == usual


def test_another_edition_signature_option_or_numba_changes_the_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from numba.core.registry import cpu_target

    def name(signature: Any = "iifVIP", function: Any = _other) -> str:
        return machine._VerifiedCache(function, None, machine._silent)._name(
            signature, cpu_target.target_context
        )

    def sum_of(a: Any, b: Any) -> Any:
        return a + b

    found = [name(), name("fiiVIP"), name(function=sum_of)]
    for place, attribute, value in (
        (machine, "edition", lambda: "another"),
        (machine, "_OPTIONS", {"error_model": "python"}),
        (numba, "__version__", "0.0"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(place, attribute, value)
            found.append(name())
    assert len(set(found)) == len(found)
    assert name() == found[0]


def test_a_digest_depends_on_code_and_constants_but_not_on_the_file() -> None:
    def function(text: str) -> Callable[..., Any]:
        names: dict[str, Any] = {}
        exec(compile(text, "<one>", "exec"), names)
        return names["f"]  # type: ignore[no-any-return]

    one = function("def f(a):\n    return a + 1.0\n")
    same = function("\n\n\ndef f(a):\n    return a + 1.0\n")
    others = [
        function("def f(a):\n    return a + 1.5\n"),
        function("def f(a):\n    return a - 1.0\n"),
        function("def f(b):\n    return b + 1.0\n"),
        function("def f(a):\n    def g(b):\n        return b\n    return a + 1.0\n"),
        function("def f(a):\n    return abs(a)\n"),
        function("def f(a):\n    return max(a)\n"),
    ]
    digests = {machine.digest(u) for u in (one, *others)}
    assert len(digests) == 1 + len(others)
    assert machine.digest(same) == machine.digest(one) != machine.digest(one, text="more")


# --------------------------------------------------------------------------- several threads
def test_compiling_leaves_numbas_settings_unchanged() -> None:
    """Many threads compile at once; the user's own numba functions must not be affected."""
    code = """
        import threading
        import numba
        import numpy as np
        from gms_fsm import GMS, GMSParameters, Prescribed
        from gms_fsm.lowering import _compiled as compiled
        from gms_fsm.lowering.program import lower
        from integrators import compiled as machine

        before = numba.config.CACHE_DIR, numba.config.LOOP_VECTORIZE
        model = GMS(GMSParameters.paper("stick-slip"), law="signed")
        begin = threading.Barrier(4)

        def system() -> None:
            begin.wait()
            compiled.machine_code(lower(model, Prescribed("0.1*t")), "act")

        def rows() -> None:
            begin.wait()
            machine._compiled_each_row(compiled.store())

        threads = [threading.Thread(target=work) for work in (system, rows, rows, system)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert (numba.config.CACHE_DIR, numba.config.LOOP_VECTORIZE) == before
        print("as before")
    """
    assert _ended(_start(code))[0] == "as before\n"


# --------------------------------------------------------------------------- without numba
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


@pytest.mark.parametrize("absent", [["numba"], ["platformdirs"]])
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


def test_numba_is_not_loaded_before_it_is_needed() -> None:
    code = """
        import sys
        import gms_fsm
        from gms_fsm import GMS, GMSParameters, Prescribed, simulate, sweep
        model, rig = GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2")
        simulate(model, rig, 3.0)
        sweep(model, rig, 3.0, {"F_s": [1.0, 2.0]}, engine="machines")
        print(sorted({"numba", "llvmlite"} & set(sys.modules)))
    """
    assert _ended(_start(code))[0] == "[]\n"
