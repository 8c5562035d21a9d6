"""Whatever is wrong with an export, the answer is one error of ours, and nothing is written.

What a format cannot express is refused by the place where it stands.
"""

from __future__ import annotations

import itertools
import shutil
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSError,
    OutputError,
    ParameterError,
    State,
    System,
    Transition,
    export,
)
from gms_fsm.charts import CHARTS
from gms_fsm.exporters import formats
from gms_fsm.run.settings import Settings
from plots.output.mermaid import mermaid
from tests.exporters.frictions import KARNOPP_MODEL
from tests.helpers import stick_slip
from tests.scenario_files import CommandLine, one_message

PROGRAMS = [name for name, each in formats().items() if each.subject == "friction"]
PAPER = stick_slip("signed")
pytestmark = pytest.mark.filterwarnings("ignore:the FMU has no binary")


@pytest.fixture(autouse=True)
def _no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """No compiler: archives are made faster, and no mistake is one of the compiler's."""
    monkeypatch.setattr(shutil, "which", lambda name: None)


def there(folder: Path) -> dict[str, bytes | None]:
    """Return what is in a folder, with the contents of its files."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


def refused(
    inside: Path, *arguments: Any, kind: type[GMSError] = ParameterError, **more: Any
) -> GMSError:
    """Return the error of an export that leaves the folder as it was."""
    before = there(inside)
    with pytest.raises(kind) as caught:
        export(*arguments, **more)
    assert there(inside) == before
    assert "\n" not in str(caught.value)
    assert caught.value.reason
    return caught.value


# --------------------------------------------------------------------------- what cannot be said
def chart(guard: str = "v > 0", actions: Any = None, flow: str = "v", **parts: Any) -> Chart:
    """Return a chart of two states."""
    given: dict[str, Any] = {
        "variables": ("z",),
        "states": (State("a", flow={"z": flow}), State("b")),
        "transitions": (Transition("go", "a", "b", guard, actions or {}),),
        "outputs": {"F": "z"},
    }
    return Chart(**{"name": "own", **given, **parts})


def model(**parts: Any) -> ChartModel:
    """Return the same with numbers."""
    made = chart(**parts)
    return ChartModel(made, dict.fromkeys(made.parameter_names, 1.0))


def system(signal: Any = "0", pad: Any = PAPER) -> System:
    """Return a mass under a force."""
    body, contact = Body("mass", inertia=1.0, force="f"), Contact("pad", pad)
    return System("driven", bodies=(body,), contacts=(contact,), signals={"f": signal})


def push(t: float) -> float:
    return 0.1 * t


PUSH = f"{Path(__file__).name}:{push.__code__.co_firstlineno}, push)"
READS_F, READS_A = chart("F > 1"), chart("a > 1")
ENTERED = chart(let={"twice": "2 * v"}, states=(State("a", entry={"z": "twice"}),), transitions=())
EDGES = Chart(
    "own", variables=("edges",), states=(State("a", flow={"edges": "v"}),), outputs={"F": "edges"}
)
CASES = chart(states=(State("a"), State("A")), transitions=())
ROWS: list[tuple[str, Any, str, str]] = [  # formats, what is given, place, word of the reason
    # locks, forces and accelerations in guards
    ("scxml transitions", CHARTS["karnopp"], "state 'stuck'", "locks"),
    ("fmu2 fmu3 matlab modelica st", KARNOPP_MODEL, 'chart "Karnopp\'s model"', "locks"),
    ("scxml", CHARTS["backlash"], "edge 'leave_right': guard", "'F'"),
    ("scxml transitions", READS_A, "edge 'go': guard", "acceleration"),
    ("matlab modelica st", ChartModel(READS_F, {}), "edge 'go'", "'F'"),
    ("matlab modelica st", ChartModel(READS_A, {}), "edge 'go'", "'a'"),
    ("scxml transitions", chart(actions={"v": "0"}), "edge 'go': action 'v'", "velocity"),
    ("transitions", chart(actions={"z": "F"}), "edge 'go': action 'z'", "'F'"),
    ("transitions", chart(velocities=("v", "w"), outputs={"F": "v", "F_w": "w"}), "own", "v, w"),
    # names, words and functions of languages
    ("scxml", chart(parameters=("delete",)), "name 'delete'", "word"),
    ("scxml", chart(variables=("z", "Math")), "name 'Math'", "word"),
    ("scxml", chart(parameters=("σ",)), "name 'σ'", "ASCII"),
    ("scxml", chart(name="a\x00b"), "name", "'\\x00'"),
    ("scxml", chart(reference="\ufffe"), "reference", "U+FFFE"),
    ("c99 fmu2", model(parameters=("double",)), "'double'", "word"),
    ("matlab", model(parameters=("function",)), "parameter 'function'", "word"),
    ("modelica", model(parameters=("when",)), "parameter 'when'", "word"),
    ("st", model(parameters=("LReal",)), "parameter 'LReal'", "word"),
    ("st", model(parameters=("Z",)), "'z'", "one name"),
    ("st", ChartModel(CASES, {}), "state 'A'", "one name"),
    ("st", model(parameters=("k__1",), outputs={"F": "k__1 * z"}), "name 'k__1'", "underscores"),
    ("st", model(flow="v - tanh(z)"), "chart 'own'", "'tanh'"),
    ("st modelica", model(flow="v - asinh(z)"), "chart 'own'", "'asinh'"),
    ("st modelica scxml", model(guard="noise(v, 1) > z"), "chart 'own'", "'noise'"),
    ("matlab", ChartModel(EDGES, {}), "variable 'edges'", "field"),
    # numbers, first values, signals
    ("c99 fmu3 js matlab", chart(), "chart 'own'", "numbers"),
    ("c99 fmu2", ChartModel(ENTERED, {}), "contact 'friction'", "v is known"),
    ("fmu2 fmu3", system(push), "signal 'f'", "Python function"),
    ("js", system(push), "signal 'f'", PUSH),
    ("scxml transitions st .mmd", system(), "system 'driven'", "system of bodies"),
    ("matlab modelica", system(pad=KARNOPP_MODEL), "contact 'pad'", "locks the bodies"),
    # what is not used, or missing
    ("js", system(), "t_end", "needs its end"),
    ("js", system(), "settings", "rows"),
    ("c99", PAPER, "t_end", "does not use"),
    ("st", PAPER, "settings", "does not use"),
    ("c99", PAPER, "settings", "locate"),
]
OPTIONS = {  # by format and place
    ("js", "signal 'f'"): {"t_end": 1.0},
    ("js", "settings"): {"settings": Settings(output="end"), "t_end": 1.0},
    ("c99", "t_end"): {"t_end": 1.0},
    ("st", "settings"): {"settings": Settings()},
    ("c99", "settings"): {"settings": Settings(step=1e-3, events="held")},
}


@pytest.mark.parametrize(
    ("form", "given", "place", "word"),
    [(form, *row) for forms, *row in ROWS for form in forms.split()],
    ids=lambda each: each if isinstance(each, str) else "",
)
def test_what_a_format_cannot_express(
    form: str, given: Any, place: str, word: str, tmp_path: Path
) -> None:
    more: Any = OPTIONS.get((form, place), {})
    error = refused(tmp_path, given, form, tmp_path / "out", name="it", **more)
    assert place in error.place
    assert word in error.reason


@pytest.mark.matrix
@pytest.mark.slow
def test_an_engine_without_a_plain_form_says_why(tmp_path: Path) -> None:
    files = export(ChartModel(READS_F, {}), "c99", tmp_path, name="it")
    assert not [each for each in files if "plain" in each.name]
    text = (tmp_path / "README-it-c99.md").read_text(encoding="utf-8")
    assert "There is no plain form: chart 'own', edge 'go': it reads 'F'" in text


def test_a_text_of_a_chart_is_one_file(tmp_path: Path) -> None:
    (path,) = export(PAPER, ".mmd", tmp_path, name="it")
    assert path.name == "it.mmd"
    assert path.read_text(encoding="utf-8") == mermaid(PAPER.chart)


# --------------------------------------------------------------------------- names and folders
NAMES = ["../x", "/x", "a/b", "a b", "1x", "x.y", "é", "x" * 64]
WORDS = [("st", "Z"), ("matlab", "k" * 52), ("transitions", "math"), ("modelica", "z")]
WORDS += [(form, min(formats()[form].words)) for form in PROGRAMS if formats()[form].words]


@pytest.mark.parametrize(
    ("form", "name"), [*zip(itertools.cycle(PROGRAMS), NAMES, strict=False), *WORDS]
)
def test_a_name_of_files_that_cannot_be(form: str, name: str, tmp_path: Path) -> None:
    error = refused(tmp_path, model(), form, tmp_path / "out", name=name)
    assert repr(name) in str(error)


TITLES = ["../x", "..", "/etc/x", "x\\y", "...", "+", "3", "while"]


@pytest.mark.parametrize(("form", "name"), [*zip(itertools.cycle(PROGRAMS), TITLES, strict=False)])
def test_a_chart_named_like_a_path(form: str, name: str, tmp_path: Path) -> None:
    said = str(refused(tmp_path, model(name=name), form, tmp_path / "out"))
    assert repr(name) in said
    assert "another name" in said


@pytest.mark.matrix
@pytest.mark.slow
def test_what_is_not_ours_stays(tmp_path: Path) -> None:
    for name in [path.name for path in export(PAPER, "transitions", tmp_path / "a", name="it")]:
        folder = tmp_path / name.partition(".")[0]
        folder.mkdir()
        (folder / name).write_text("mine")
        said = str(refused(folder, PAPER, "transitions", folder, name="it", kind=OutputError))
        assert name in said
        assert "was not written by gms-fsm" in said


def test_folders_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    (tmp_path / "README-it-st.md").mkdir()
    for folder, said in (
        (tmp_path / "out", "choose another folder"),
        (tmp_path / "out" / "below", ""),
        (tmp_path, "a folder is there"),
        ("a\0b", "a null byte"),
        *([("/proc/friction", "/proc/friction")] if Path("/proc/self").exists() else []),
    ):
        assert said in str(refused(tmp_path, PAPER, "st", folder, name="it", kind=OutputError))
    assert 'write "."' in str(refused(tmp_path, PAPER, "st", ""))


@pytest.mark.parametrize("form", ["", "c99x", "../c99", 33, None, ["c99"]])
def test_an_unknown_format(form: Any, tmp_path: Path) -> None:
    said = str(refused(tmp_path, PAPER, form, tmp_path / "out"))
    assert "there is no format" in said
    assert all(each in said for each in formats())


@pytest.mark.parametrize(
    ("form", "served"),
    [("simulink", "'fmu2', 'fmu3' or 'matlab'"), ("C", "'c99'"), ("Python", "'transitions'")],
)
def test_the_name_of_a_program_points_to_its_formats(
    form: str, served: str, tmp_path: Path
) -> None:
    assert str(refused(tmp_path, PAPER, form, tmp_path / "out")).endswith(f"served by {served}")


@pytest.mark.every(3)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("gms --law signed --to c99 -o file", "another folder"),
        ("gms --law signed --to c99 --name ../x", "'../x'"),
        ("bare.toml --to c99", "needs numbers"),
    ],
)
def test_the_command_line_says_it_in_one_message(
    arguments: str, said: str, gms_fsm: CommandLine
) -> None:
    here = Path.cwd()
    (here / "file").write_text("mine")
    (here / "bare.toml").write_text(
        'name = "spring"\nvariables = ["z"]\nparameters = ["k"]\noutputs.F = "k * z"\n'
        '[[state]]\nname = "on"\nflow.z = "v"\n'
    )
    before = there(here)
    one_message(gms_fsm("export", *arguments.split()), said)
    assert there(here) == before
    assert not (here.parent / "x").exists()


def test_quantities_that_a_program_would_call_the_same_are_refused(tmp_path: Path) -> None:
    body = Body("one", inertia=1.0, force="1", x="x", v="w")
    pad = Contact("p", stick_slip("signed"), v="w")
    system = System("twice", bodies=(body,), contacts=(pad,), flow={"p_F": "1"})
    with pytest.raises(ParameterError, match="two quantities would be called 'p_F'"):
        export(system, "c99", tmp_path / "out")
    assert not [*tmp_path.rglob("*.c")]
