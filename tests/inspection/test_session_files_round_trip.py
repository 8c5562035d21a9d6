"""A session comes back from its file with the same rows, cursors, breakpoints and watches."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import scipy.integrate

from gms_fsm import Prescribed, Slider
from gms_fsm.errors import OutputError, SessionError, TraceFileError
from gms_fsm.session.session import Session
from tests.helpers import FIG4_SINE, pulled_mass, stick_slip


def _walked() -> Session:
    model, rig = pulled_mass()
    session = Session(model, rig, 12.0, rtol=1e-5)
    session.goto(5.0)
    session.poke({"z": {1: -0.003}}, v=0.05, state={2: "slip"})
    session.goto(8.0)
    session.until("t > 8.7")
    session.poke({"z": {0: 0.001}})
    session.until("t > 9.3")
    session.switch(1)
    session.break_on("fires", "arrest", 1, "z1 > 0", 2)
    session.break_on("leave", "slip")
    session.watches.append("z1 / s1")
    return session


def test_everything_is_restored(tmp_path: Path) -> None:
    session = _walked()
    loaded = Session.load(session.save(tmp_path / "walk.json"))
    assert (loaded.current, loaded.watches) == (1, ["z1 / s1"])
    assert loaded.breakpoints == session.breakpoints
    for number, (a, b) in enumerate(zip(session.branches, loaded.branches, strict=True)):
        assert (a.parent, a.fork, a.cursor, a.edits) == (b.parent, b.fork, b.cursor, b.edits)
        session.switch(number)
        loaded.switch(number)
        assert session.here == loaded.here
        session.goto(12.0)
        loaded.goto(12.0)
        assert len(a) == len(b)
        assert [a.raw(row) for row in range(len(a))] == [b.raw(row) for row in range(len(b))]
        assert a.log() == b.log()


class Cart:
    title, acceleration = "cart", "(2 * F_a - F) / mass"
    numbers = {"mass": 1.0}  # noqa: RUF012
    signals = Slider(1.0, "0.2 * t").signals


def test_a_rig_of_a_custom_class_is_restored(tmp_path: Path) -> None:
    session = Session(stick_slip("signed"), Cart(), 6.0)
    session.goto(5.0)
    loaded = Session.load(session.save(tmp_path / "walk.json"))
    loaded.goto(5.0)
    assert session.here == loaded.here
    assert loaded.rig.title == "cart"


def test_saved_twice_is_the_same_file(tmp_path: Path) -> None:
    first = _walked().save(tmp_path / "a.json")
    second = Session.load(first).save(tmp_path / "b.json")
    assert first.read_text() == second.read_text()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "null",
        "{}",
        '{"format": "other"}',
        '{"format": "gms-fsm session 1"}',
        "\x00",
        "title = 'a scenario'",
    ],
)
def test_other_files_are_rejected(text: str, tmp_path: Path) -> None:
    path = tmp_path / "odd.json"
    path.write_text(text)
    with pytest.raises(TraceFileError, match=r"odd\.json"):
        Session.load(path)


FORK = {"fork": -1, "edits": {}, "cursor": 0, "from": None, "between": None}
ORIGINAL = {"parent": None, **FORK}
DAMAGE: list[tuple[str, Any]] = [
    ("branches", [ORIGINAL, {"parent": 0, **FORK, "law": "another"}]),
    ("branches", [ORIGINAL, {"parent": 0, **FORK, "values": {"F_s": "x"}}]),
    ("branches", [ORIGINAL, {"parent": 1, **FORK}]),
    ("current", 7),
    ("current", "one"),
    ("t_end", -1.0),
    ("t_end", None),
    ("header", {}),
    ("options", {"method": "rk5"}),
    ("options", {"nonsense": 1}),
    ("branches", None),
    ("branches", [{"cursor": -3, "between": None}]),
    ("breakpoints", [{"kind": "fired", "name": "arrest"}]),
    ("breakpoints", [{"kind": "fires", "name": "arest"}]),
    ("breakpoints", [{"kind": "fires", "name": "arrest", "element": 9}]),
    ("breakpoints", [{"kind": "fires", "name": "arrest", "condition": "z9 >"}]),
    ("watches", 5),
]


@pytest.mark.parametrize(("key", "value"), DAMAGE, ids=[f"{k}={v}"[-50:] for k, v in DAMAGE])
def test_a_damaged_file_is_rejected_on_reading(key: str, value: Any, tmp_path: Path) -> None:
    path = Session(stick_slip("signed"), Prescribed(FIG4_SINE), 5.0).save(tmp_path / "s.json")
    data = json.loads(path.read_text())
    path.write_text(json.dumps(data | {key: value}))
    with pytest.raises(TraceFileError, match="not a session file"):
        Session.load(path)


@pytest.mark.parametrize("key", ["header", "t_end", "options", "branches", "current"])
def test_a_missing_part_is_rejected(key: str, tmp_path: Path) -> None:
    path = _walked().save(tmp_path / "s.json")
    data = json.loads(path.read_text())
    del data[key]
    path.write_text(json.dumps(data))
    with pytest.raises(TraceFileError):
        Session.load(path)


def test_a_missing_file_and_a_folder(tmp_path: Path) -> None:
    with pytest.raises(TraceFileError, match="no such file"):
        Session.load(tmp_path / "nothing.json")
    with pytest.raises(TraceFileError):
        Session.load(tmp_path)


def test_what_a_file_cannot_store(tmp_path: Path) -> None:
    function = Session(stick_slip("signed"), Prescribed(lambda t: 0.1), 1.0)
    radau = Session(stick_slip("signed"), Prescribed("0.1"), 1.0, method=scipy.integrate.Radau)
    for session in (function, radau):
        with pytest.raises(SessionError):
            session.save(tmp_path / "s.json")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(OutputError):
        _walked().save(tmp_path / "no" / "folder" / "s.json")
