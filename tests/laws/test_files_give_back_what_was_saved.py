"""What is read from a file is what was saved: traces, sessions, systems."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Record, Session, System, Trace
from gms_fsm.charts import CHARTS
from gms_fsm.errors import OutputError
from gms_fsm.lowering.program import lower
from gms_fsm.traces.monitors import examine
from tests.corpus import (
    CORPUS,
    ENGINES,
    FAILING,
    FEW,
    KINDS,
    QUICK,
    RIG_RUNS,
    SYSTEM_RUNS,
    Run,
    each,
    outcome,
    run,
    trace,
)
from tests.helpers import FASTEST, other_parts, same_bits

FUNCTIONS = {"a function", "no slope"}


@pytest.mark.every(3)
@each(CORPUS, KINDS)
def test_a_trace_in_npz_is_whole(name: str, tmp_path: Path) -> None:
    """Rows, stops, log, settings and titles; the chart is that of the run; equal, its bytes too."""
    one = trace(name)
    path = one.save(tmp_path / "run.npz")
    read = Trace.load(path)
    assert other_parts(read, one) == []
    assert (read.stops is read.rows) == (one.stops is one.rows)
    assert read.save(tmp_path / "again.npz").read_bytes() == path.read_bytes()
    assert (read.title, read.contacts) == (one.title, one.contacts)
    assert dict(read.settings) == dict(one.settings)
    assert [read.contact(each).model.chart for each in read.contacts] == [
        one.contact(each).model.chart for each in one.contacts
    ]
    if name not in FUNCTIONS:
        times = np.linspace(one.t[0], one.t[-1], 7)
        same_bits(read.sample(times), one.sample(times))


@each(sorted({*RIG_RUNS, *FEW} - FUNCTIONS), KINDS)
def test_what_is_read_runs_as_it_did(name: str, tmp_path: Path) -> None:
    """Model and rig, or system, of the file, also those of one's own."""
    one = trace(name)
    read = Trace.load(one.save(tmp_path / "run.npz"))
    subject = (read.model, read.rig) if len(run(name).subject) == 2 else (read.system,)
    again = Run(subject, run(name).t_end, run(name).how)(engine=FASTEST)
    assert other_parts(again, one) == []


@pytest.mark.every(3)
@each([*FEW, *FAILING])
def test_a_trace_in_csv_is_whole_but_for_its_stops(name: str, tmp_path: Path) -> None:
    one, _ = outcome(name)
    assert one is not None
    path = one.save(tmp_path / "run.csv")
    read = Trace.load(path)
    same_bits(read, one)
    assert [part for part in other_parts(read, one) if not part.startswith("stops")] == []
    again = read.save(tmp_path / "again.csv")
    assert again.read_bytes() == path.read_bytes()


@pytest.mark.every(2)
@pytest.mark.slow
@each(FEW, QUICK)
def test_verdicts_are_those_of_the_run(name: str, tmp_path: Path) -> None:
    """Of all engines and from both kinds of files; a sum may round in another order."""
    monitors = ["all", "t < 1", "1 / t > 0"]
    one = run(name)(engine=FASTEST, monitors=monitors)
    for engine in ENGINES:
        assert run(name)(engine=engine, monitors=monitors).monitors == one.monitors, engine
    for ending in ("npz", "csv"):
        read = Trace.load(one.save(tmp_path / f"run.{ending}"))
        assert list(read.monitors.items()) == list(one.monitors.items())
        if ending == "npz":
            again = examine(read, monitors)
            assert [each.text for each in again.values()] == [
                each.text for each in one.monitors.values()
            ]
        assert read.sample([one.t[-1]]).monitors == read.refined(50).monitors == one.monitors


@pytest.mark.every(2)
@each(FEW, {*QUICK, "several rates"})
def test_a_session_is_where_it_was(name: str, tmp_path: Path) -> None:
    """After a walk, a poke and a breakpoint; saved twice it is the same file."""
    subject, how, t_end = run(name).subject, run(name).how, run(name).t_end
    session = Session(*subject, t_end, **how)
    session.goto(0.3 * t_end + 0.7 * session.here.t)
    session.step(3)
    session.back(2)
    session.watches.append("t + 1")
    path = session.save(tmp_path / "walk.json")
    read = Session.load(path)
    assert repr(read.here) == repr(session.here)
    assert read.watches == session.watches
    assert read.save(tmp_path / "again.json").read_text() == path.read_text()
    assert repr(read.goto(t_end)) == repr(session.goto(t_end))
    assert other_parts(read.branch.trace(), session.branch.trace()) == []


@each((name for name in SYSTEM_RUNS if "random" not in name), {*SYSTEM_RUNS} - {"cradle with pads"})
def test_a_system_file_is_the_same_program(name: str, tmp_path: Path) -> None:
    (system,) = run(name).subject
    read = System.load(system.save(tmp_path / "own.toml"))
    one, other = lower(system), lower(read)
    assert (other.source, other.p, other.knots) == (one.source, one.p, one.knots)
    assert read == system
    assert hash(read) == hash(system)
    again = read.save(tmp_path / "again.toml")
    assert again.read_text() == (tmp_path / "own.toml").read_text()


@pytest.mark.parametrize("name", ["a chart", "a system", "a record"])
def test_its_own_file_is_replaced_and_any_other_is_kept(name: str, tmp_path: Path) -> None:
    """Also its own after an edit; in a folder's place nothing is written."""
    (system,), time = run("system servo").subject, np.arange(9.0)
    save, ending = {
        "a chart": (CHARTS["stiction"].save, "toml"),
        "a system": (system.save, "toml"),
        "a record": (Record.from_arrays(time=time, position=time).to_csv, "csv"),
    }[name]
    path = save(tmp_path / f"own.{ending}")
    save(path)
    for theirs in (b"# my notes\n" + path.read_bytes(), b"name = 'my own'\n"):
        path.write_bytes(theirs)
        with pytest.raises(OutputError, match="not written by gms-fsm"):
            save(path)
        assert path.read_bytes() == theirs
    (tmp_path / f"folder.{ending}").mkdir()
    with pytest.raises(OutputError):
        save(tmp_path / f"folder.{ending}")
