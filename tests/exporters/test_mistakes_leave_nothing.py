"""Whatever is wrong with an export, the answer is one error of ours, and nothing is written.

The claims hold for every format, also for one that is registered here.
"""

from __future__ import annotations

import itertools
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSError,
    GMSParameters,
    OutputError,
    ParameterError,
    State,
    export,
)
from gms_fsm.exporters import FORMATS, Format, Subject, formats, register
from plots.output.mermaid import mermaid
from tests.exporters.test_what_cannot_be_written_is_named import system as driven
from tests.scenario_files import CommandLine, one_message

CHART = """\
name = "spring"
variables = ["z"]
parameters = ["k"]

[outputs]
F = "k * z"

[[state]]
name = "on"
flow.z = "v"
"""
PROGRAMS = [name for name, each in formats().items() if each.subject == "friction"]
KINDS = [*PROGRAMS, "states"]
GMS_MODEL = GMS(GMSParameters.paper("stick-slip"), law="signed")


def states(subject: Subject) -> dict[str, str]:
    names = "\n".join(each.name for each in subject.contact.chart.states)
    assert subject.start.system.contacts  # with its initial values, which are then checked
    return {f"{subject.name}.txt": names, "README-it-states.md": "One name per line.\n"}


pytestmark = pytest.mark.filterwarnings("ignore:the FMU has no binary")


@pytest.fixture(autouse=True)
def _no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """No compiler: archives are made faster, and no mistake is one of the compiler's."""
    monkeypatch.setattr(shutil, "which", lambda name: None)


@pytest.fixture(autouse=True)
def _one_more_format() -> Iterator[None]:
    takes = ("initial", "t_start")
    own = Format("states", "friction", "a list of states", "a test", states, takes=takes,
                 words=["double", "while"])  # fmt: skip
    register(own)
    yield
    FORMATS.remove(own)


def there(folder: Path) -> dict[str, bytes | None]:
    """Return what is in a folder, with the contents of its files."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


def refused(
    inside: Path, *arguments: Any, kind: type[GMSError] = ParameterError, **more: Any
) -> str:
    """Return the message of an export that leaves the folder as it was."""
    before = there(inside)
    with pytest.raises(kind) as error:
        export(*arguments, **more)
    assert there(inside) == before
    said = str(error.value)
    assert "\n" not in said
    assert error.value.reason
    return said


def friction(name: str = "one", parameter: str = "k") -> ChartModel:
    """A spring as a chart of one state."""
    state = State("on", {"z": "v"})
    chart = Chart(name, ("v",), ("z",), (parameter,), (state,), (), {"F": f"{parameter} * z"})
    return ChartModel(chart, {parameter: 2.0})


def words_for_charts(form: str) -> list[str]:
    """Return words of a format's language that are parameters of charts, at most three."""
    found = []
    for word in sorted(formats()[form].words, key=lambda each: (len(each) < 4, each)):
        try:
            friction(parameter=word)
        except GMSError:
            continue
        found.append(word)
    return found[:3]


@pytest.mark.parametrize("form", KINDS)
def test_without_a_mistake_the_readme_is_among_the_files(form: str, tmp_path: Path) -> None:
    files = export(GMS_MODEL, form, tmp_path / "out", name="it")
    assert tmp_path / "out" / f"README-it-{form}.md" in files
    assert all(path.parent == tmp_path / "out" and path.stat().st_size for path in files)


def test_a_text_of_a_chart_is_one_file(tmp_path: Path) -> None:
    (path,) = export(GMS_MODEL, ".mmd", tmp_path, name="it")
    assert path.name == "it.mmd"
    assert path.read_text(encoding="utf-8") == mermaid(GMS_MODEL.chart)
    assert "a system of bodies" in refused(tmp_path, driven(), ".mmd", tmp_path)


def test_what_we_wrote_is_replaced(tmp_path: Path) -> None:
    files = export(GMS_MODEL, "st", tmp_path, name="it")
    before = there(tmp_path)
    assert export(GMS_MODEL, "st", tmp_path, name="it") == files
    assert there(tmp_path) == before


def test_what_is_not_ours_stays(tmp_path: Path) -> None:
    names = [path.name for path in export(GMS_MODEL, "transitions", tmp_path / "first", name="it")]
    for name in names:
        folder = tmp_path / name.partition(".")[0]
        folder.mkdir()
        (folder / name).write_text("mine")
        said = refused(folder, GMS_MODEL, "transitions", folder, name="it", kind=OutputError)
        assert name in said
        assert "was not written by gms-fsm" in said


def test_folders_that_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "out").write_text("mine")
    (tmp_path / "README-it-st.md").mkdir()
    for folder, said in (
        (tmp_path / "out", "choose another folder"),
        (tmp_path / "out" / "below", ""),
        (tmp_path, "a folder is there"),
        ("a\0b", "a null byte"),
        *([("/proc/friction", "/proc/friction")] if Path("/proc/self").exists() else []),
    ):
        given = refused(tmp_path, GMS_MODEL, "st", folder, name="it", kind=OutputError)
        assert said in given
    monkeypatch.chdir(tmp_path)
    assert 'write "."' in refused(tmp_path, GMS_MODEL, "st", "")


@pytest.mark.parametrize("form", ["", "c", "C99", "../c99", 3, None, ["c99"]])
def test_an_unknown_format(form: Any, tmp_path: Path) -> None:
    said = refused(tmp_path, GMS_MODEL, form, tmp_path / "out")
    assert "there is no format" in said
    assert all(each in said for each in formats())


@pytest.mark.parametrize("form", PROGRAMS)
def test_a_word_of_the_language_as_name_chart_or_parameter(form: str, tmp_path: Path) -> None:
    for word in sorted(formats()[form].words)[:1]:
        assert repr(word) in refused(tmp_path, GMS_MODEL, form, tmp_path / "out", name=word)
    words = words_for_charts(form)
    for word in words:
        if word.islower():  # names are made in lower case
            assert repr(word) in refused(tmp_path, friction(word), form, tmp_path / "out")
        if form == "transitions":  # its words are modules, which files may not be called after
            continue
        given = friction(parameter=word)
        assert word in refused(tmp_path, given, form, tmp_path / "out", name="it")
    assert words or not re.search(r"c99|fmu|matlab|modelica|st$", form)


# The door is the same for all formats: each wrong value is given to one of them.
NAMES = ["../x", "/x", "a/b", "a b", "1x", "x.y", "é", "x" * 64]
TITLES = ["../x", "..", "/etc/x", "x\\y", "...", "+", "3"]
WRONG: list[tuple[str, Any]] = [
    *(("system", each) for each in (None, 3, "gms", object(), [GMS_MODEL])),
    *(("folder", each) for each in (None, 3, object(), ["out"])),
    *(("name", each) for each in (None, 3, ["it"])),
    *(("initial", each) for each in (3, "z", {"y": 1.0}, {"z": "x"})),
    *(("t_start", each) for each in ("x", None, float("nan"))),
    *(("settings", each) for each in (3, {"rtol": 1e-3})),
]


@pytest.mark.parametrize(("form", "name"), [*zip(itertools.cycle(KINDS), NAMES, strict=False)])
def test_a_name_that_is_no_identifier(form: str, name: str, tmp_path: Path) -> None:
    assert repr(name) in refused(tmp_path, GMS_MODEL, form, tmp_path / "out", name=name)


@pytest.mark.parametrize(("form", "name"), [*zip(itertools.cycle(KINDS), TITLES, strict=False)])
def test_a_chart_named_like_a_path(form: str, name: str, tmp_path: Path) -> None:
    said = refused(tmp_path, friction(name), form, tmp_path / "out")
    assert repr(name) in said
    assert "give another name" in said


@pytest.mark.parametrize(("form", "wrong"), [*zip(itertools.cycle(KINDS), WRONG, strict=False)])
def test_wrong_types(form: str, wrong: tuple[str, Any], tmp_path: Path) -> None:
    given = {"system": GMS_MODEL, "folder": tmp_path / "out", "name": "it", wrong[0]: wrong[1]}
    refused(tmp_path, kind=GMSError, format=form, **given)


@pytest.mark.parametrize("kind", ["model", "format", "folder", "word", "path", "chart", "signal"])
def test_the_command_line_says_it_in_one_message(kind: str, gms_fsm: CommandLine) -> None:
    here = Path.cwd()
    (here / "file").write_text("mine")
    (here / "double.toml").write_text(CHART.replace("spring", "double"))
    (here / "named.toml").write_text(CHART.replace("spring", "../x"))
    (here / "bare.toml").write_text(CHART)
    (here / "driven.toml").write_text("x = [")
    before = there(here)
    arguments, said = {
        "model": (["nobody", "--to", "c99"], "nobody"),
        "format": (["gms", "--law", "signed", "--to", "c98"], "there is no format 'c98'"),
        "folder": (["gms", "--law", "signed", "--to", "c99", "-o", "file"], "another folder"),
        "word": (["gms", "--law", "signed", "--to", "c99", "--name", "double"], "'double'"),
        "path": (["gms", "--law", "signed", "--to", "c99", "--name", "../x"], "'../x'"),
        "chart": (["bare.toml", "--to", "c99"], "needs numbers"),
        "signal": (["driven.toml", "--to", "c99"], "driven.toml"),
    }[kind]
    one_message(gms_fsm("export", *arguments), said)
    assert there(here) == before
    assert not (here.parent / "x").exists()
