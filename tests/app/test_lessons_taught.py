"""`gms-fsm lesson` lists eleven lessons, and writes the text, figure and replay page of one."""

from __future__ import annotations

import types
from pathlib import Path

import pytest

from gms_fsm._files import LIST
from gms_fsm.app import lessons
from gms_fsm.errors import MissingExtraError, OutputError, ParameterError
from tests.scenario_files import CommandLine


def test_there_are_eleven_each_a_plain_module() -> None:
    assert list(lessons.LESSONS) == list(range(1, 12))
    for number, lesson in lessons.LESSONS.items():
        assert isinstance(lesson, types.ModuleType)
        assert lesson.__name__.startswith(f"gms_fsm.app.lessons.l{number}_")
        assert (lesson.__doc__ or "").startswith(f"Lesson {number}: ")
    assert len({lesson.QUESTION for lesson in lessons.LESSONS.values()}) == 11


def test_without_a_number_they_are_listed(gms_fsm: CommandLine) -> None:
    done = gms_fsm("lesson")
    assert done.code == 0, done.err
    lines = done.out.splitlines()
    assert [int(line.split()[0]) for line in lines] == list(range(1, 12))
    for line, lesson in zip(lines, lessons.LESSONS.values(), strict=True):
        assert lesson.QUESTION in line


@pytest.mark.slow
def test_one_is_run_and_written(gms_fsm: CommandLine) -> None:
    pytest.importorskip("matplotlib", reason="pictures need the extra 'plots'")
    pytest.importorskip("uplot", reason="the replay page needs the extra 'replay'")
    pytest.importorskip("pygraphviz", reason="the page's chart needs Graphviz, extra 'render'")
    done = gms_fsm("lesson", "7", "-o", "out")
    assert done.code == 0, done.err
    folder = Path("out")
    text = (folder / "lesson_7.txt").read_text()
    assert len(text.splitlines()) == 5
    assert done.out.startswith(text)
    assert (folder / "lesson_7.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (folder / "lesson_7.svg").read_text()
    page = (folder / "lesson_7.html").read_text()
    assert "Lesson 7" in page
    for name in lessons.lesson(7).run().replayed:
        assert f"{name}: GMS" in page
    for path in set(folder.iterdir()) - {folder / LIST}:
        assert path.name in done.out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["99"], "no lesson '99'"),
        (["0"], "no lesson '0'"),
        (["one"], "no lesson 'one'"),
        (["7", "-o", "file/out"], "choose another folder"),
    ],
)
def test_a_mistake_is_one_message(arguments: list[str], said: str, gms_fsm: CommandLine) -> None:
    Path("file").write_text("in the way")
    done = gms_fsm("lesson", *arguments)
    assert done.code == 2
    assert said in done.err
    assert "Traceback" not in done.err + done.out
    assert list(Path().iterdir()) == [Path("file")]


def test_a_mistake_is_reported_before_anything_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lessons.l7_frictional_lag, "run", lambda: pytest.fail("it was run"))
    with pytest.raises(ParameterError, match="9  Contacts"):
        lessons.teach(99, tmp_path)
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(OutputError):
        lessons.teach(7, tmp_path / "file" / "out")


@pytest.mark.slow
def test_without_the_extras_there_is_the_text_and_a_note(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(*_: object) -> list[Path]:
        raise MissingExtraError("needs an extra")

    monkeypatch.setattr(lessons, "_draw", missing)
    monkeypatch.setattr(lessons, "_replay", missing)
    with pytest.warns(UserWarning, match="was written: needs an extra") as noted:
        taught = lessons.teach(7, tmp_path)
    assert len(noted) == 2
    assert [path.name for path in taught.files] == ["lesson_7.txt"]
    assert taught.files[0].read_text().splitlines() == list(taught.lines)
