"""Whatever is wrong with an export, the answer is one error of ours, and nothing is written.

The claims hold for every format, also for one that is registered here.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSError,
    GMSParameters,
    OutputError,
    ParameterError,
    State,
    System,
    export,
)
from gms_fsm.exporters import FORMATS, Format, Subject, formats, register
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
LINUX = pytest.mark.skipif(not Path("/proc/self").exists(), reason="there is no /proc")


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


def driven() -> System:
    """A mass whose force is a Python function."""
    body = Body("mass", inertia=1.0, force="f")
    pad = Contact("pad", friction().chart, {"k": 1.0})
    return System("driven", bodies=(body,), contacts=(pad,), signals={"f": lambda t: t})


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
    again = {path: path.read_bytes() for path in files}
    assert export(GMS_MODEL, form, tmp_path / "out", name="it") == files  # ours, so replaced
    assert form in ("fmu2", "fmu3") or {path: path.read_bytes() for path in files} == again


@pytest.mark.parametrize("form", KINDS)
def test_a_file_in_place_of_the_folder(form: str, tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    said = refused(tmp_path, GMS_MODEL, form, tmp_path / "out", kind=OutputError)
    assert "choose another folder" in said
    refused(tmp_path, GMS_MODEL, form, tmp_path / "out" / "below", kind=OutputError)


def test_a_text_that_names_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert 'write "."' in refused(tmp_path, GMS_MODEL, "c99", "")
    assert "a null byte" in refused(tmp_path, GMS_MODEL, "c99", "a\0b", kind=OutputError)
    with pytest.raises(ParameterError, match="it is empty"):
        System.load("")


@LINUX
@pytest.mark.parametrize("form", KINDS)
def test_a_folder_that_cannot_be_written(form: str, tmp_path: Path) -> None:
    said = refused(tmp_path, GMS_MODEL, form, "/proc/friction", kind=OutputError)
    assert "/proc/friction" in said
    refused(tmp_path, GMS_MODEL, form, "/proc/self/fdinfo", kind=OutputError)


@pytest.mark.parametrize("form", KINDS)
def test_a_file_that_is_not_ours(form: str, tmp_path: Path) -> None:
    files = export(GMS_MODEL, form, tmp_path / "first", name="it")
    for number, path in enumerate(files):
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / path.name).write_text("mine")
        said = refused(folder, GMS_MODEL, form, folder, name="it", kind=OutputError)
        assert path.name in said
        assert "was not written by gms-fsm" in said


@pytest.mark.parametrize("form", KINDS)
def test_a_folder_in_place_of_a_file(form: str, tmp_path: Path) -> None:
    (tmp_path / f"README-it-{form}.md").mkdir()
    assert "a folder is there" in refused(
        tmp_path, GMS_MODEL, form, tmp_path, name="it", kind=OutputError
    )


@pytest.mark.parametrize("form", ["", "c", "C99", "../c99", 3, None, ["c99"]])
def test_an_unknown_format(form: Any, tmp_path: Path) -> None:
    said = refused(tmp_path, GMS_MODEL, form, tmp_path / "out")
    assert "there is no such format" in said
    assert all(each in said for each in formats())


@pytest.mark.parametrize("form", KINDS)
def test_a_word_of_the_language_as_name(form: str, tmp_path: Path) -> None:
    for word in sorted(formats()[form].words)[:3]:
        said = refused(tmp_path, GMS_MODEL, form, tmp_path / "out", name=word)
        assert repr(word) in said


@pytest.mark.parametrize("form", KINDS)
@pytest.mark.parametrize("name", ["../x", "/x", "a/b", "a b", "1x", "x.y", "é", "x" * 64])
def test_a_name_that_is_no_identifier(form: str, name: str, tmp_path: Path) -> None:
    assert repr(name) in refused(tmp_path, GMS_MODEL, form, tmp_path / "out", name=name)


@pytest.mark.parametrize("form", PROGRAMS)
def test_a_word_of_the_language_as_chart_or_parameter(form: str, tmp_path: Path) -> None:
    words = words_for_charts(form)
    for word in words:
        if word.islower():  # names are made in lower case
            assert repr(word) in refused(tmp_path, friction(word), form, tmp_path / "out")
        if form == "transitions":  # its words are modules, which files may not be called after
            continue
        given = friction(parameter=word)
        assert word in refused(tmp_path, given, form, tmp_path / "out", name="it")
    assert words or not re.search(r"c99|fmu|matlab|modelica|st$", form)


@pytest.mark.parametrize("form", KINDS)
@pytest.mark.parametrize("name", ["../x", "..", "/etc/x", "x\\y", "...", "+", "3"])
def test_a_chart_named_like_a_path(form: str, name: str, tmp_path: Path) -> None:
    said = refused(tmp_path, friction(name), form, tmp_path / "out")
    assert repr(name) in said
    assert "give another name" in said


@pytest.mark.parametrize("form", KINDS)
def test_a_python_function_as_signal(form: str, tmp_path: Path) -> None:
    said = refused(tmp_path, driven(), form, tmp_path / "out")
    assert re.search(r"'f'|'driven'", said), said


@pytest.mark.parametrize("form", KINDS)
def test_a_chart_without_numbers(form: str, tmp_path: Path) -> None:
    chart = friction().chart
    if form in ("scxml", "transitions"):  # formats of charts
        return
    said = refused(tmp_path, chart, form, tmp_path / "out")
    assert f"format {form!r} needs numbers" in said
    assert "chart 'one'" in said


WRONG: Mapping[str, tuple[Any, ...]] = {
    "system": (None, 3, "gms", object(), [GMS_MODEL]),
    "folder": (None, 3, object(), ["out"]),
    "name": (None, 3, ["it"]),
    "initial": (3, "z", {"y": 1.0}, {"z": "x"}),
    "t_start": ("x", None, float("nan")),
    "settings": (3, {"rtol": 1e-3}),
}


@pytest.mark.parametrize("form", KINDS)
@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_types(form: str, wrong: str, tmp_path: Path) -> None:
    for value in WRONG[wrong]:
        given = {"system": GMS_MODEL, "folder": tmp_path / "out", "name": "it", wrong: value}
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
        "format": (["gms", "--law", "signed", "--to", "c98"], "there is no such format"),
        "folder": (["gms", "--law", "signed", "--to", "c99", "-o", "file"], "another folder"),
        "word": (["gms", "--law", "signed", "--to", "c99", "--name", "double"], "'double'"),
        "path": (["gms", "--law", "signed", "--to", "c99", "--name", "../x"], "'../x'"),
        "chart": (["bare.toml", "--to", "c99"], "needs numbers"),
        "signal": (["driven.toml", "--to", "c99"], "driven.toml"),
    }[kind]
    one_message(gms_fsm("export", *arguments), said)
    assert there(here) == before
    assert not (here.parent / "x").exists()
