"""The notebooks in the repository are those of the lessons, and run without the docs extras."""

from __future__ import annotations

import importlib.util
import json
import re
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from gms_fsm.app.lessons import LESSONS
from gms_fsm.app.lessons.notebooks import composed
from gms_fsm.app.lessons.predict import reveal, vary
from tests.helpers import ROOT, matrix
from tests.scenario_files import CommandLine

FOLDER = ROOT / "docs" / "lessons"
NOTEBOOKS = [*(f"lesson_{number}" for number in LESSONS), "desk_experiment"]
# With ipywidgets, and nothing else of the extra docs, the site runs all lessons
# (tests/docs/test_docs_build.py). Without it, `vary` draws once; one lesson has no slider.
WITHOUT_SLIDERS = matrix(
    ["lesson_1", "lesson_4", "desk_experiment"], ["lesson_1", "desk_experiment"]
)


@pytest.fixture(scope="module")
def notebooks() -> ModuleType:
    """The module that writes and executes notebooks, docs/notebooks.py."""
    for module in ("ipykernel", "nbclient"):
        pytest.importorskip(module, reason="running a notebook needs ipykernel and nbclient")
    spec = importlib.util.spec_from_file_location("notebooks", ROOT / "docs" / "notebooks.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_those_in_the_repository_are_in_step(notebooks: ModuleType) -> None:
    """If this fails, run: python docs/notebooks.py."""
    sources = notebooks.sources()
    assert {path.stem for path in sources} == set(NOTEBOOKS)
    assert set(FOLDER.glob("*.ipynb")) == set(sources)
    for path, text in sources.items():
        assert path.read_text(encoding="utf-8") == text, path.name


@pytest.mark.slow
@pytest.mark.parametrize("name", WITHOUT_SLIDERS)
def test_it_runs_from_top_to_bottom(name: str, notebooks: ModuleType, tmp_path: Path) -> None:
    for module in ("matplotlib", "llvmlite", "pygraphviz", "uplot"):
        pytest.importorskip(module, reason="a lesson uses the extra 'all'")
    text = (FOLDER / f"{name}.ipynb").read_text(encoding="utf-8")
    hidden = 'import sys\nsys.modules["ipywidgets"] = None'
    first = f"{notebooks.WITHOUT_DOCS}\n{hidden}\n{notebooks.STRICT}"
    done = notebooks.executed(text, tmp_path, first)
    outputs = [output for cell in done.cells for output in cell.get("outputs", ())]
    said = "".join(each["text"] for each in outputs if each.get("name") == "stderr")
    assert [line for line in said.splitlines() if not line.startswith("findfont: ")] == []  # fonts
    pictures = [each for each in outputs if "image/png" in each.get("data", {})]
    printed = "".join(each.get("text", "") for each in outputs)
    if name.startswith("lesson"):
        assert len(pictures) == 1 + text.count('"vary(')
        assert printed.count("You predicted nothing. Measured: ") == text.count('"reveal(') >= 2
        assert (tmp_path / f"{name}_replay.html").is_file()
    else:
        assert len(pictures) == 1
        assert "friction coefficient 0.30" in printed  # the record was made with 0.30


@pytest.mark.parametrize("number", LESSONS)
def test_readers_predict_before_the_run_and_compare_after_it(number: int) -> None:
    cells = composed(number)
    (run,) = (i for i, (_, text) in enumerate(cells) if "this.run()" in text)
    asked = [text for kind, text in cells[:run] if kind == "code"]
    names = re.findall(r"^(\w+) = None", "\n".join(asked), re.MULTILINE)
    assert len(names) >= 2
    answers = "\n".join(text for kind, text in cells[run:] if kind == "code")
    assert [name for name in names if f"reveal({name}, " not in answers] == []
    assert any("<details>" in text for kind, text in cells[run:] if kind == "markdown")


def test_the_command_line_writes_them(gms_fsm: CommandLine) -> None:
    done = gms_fsm("lesson", "1", "--notebook", "-o", "mine")
    assert done.code == 0, done.err
    path = Path("mine", "lesson_1.ipynb")
    assert done.out == f"{path}\n"
    assert path.read_text(encoding="utf-8") == (FOLDER / path.name).read_text(encoding="utf-8")
    assert len(gms_fsm("lesson", "--notebook", "-o", "all").out.splitlines()) == len(LESSONS)


def test_a_notebook_with_answers_is_not_written_over(gms_fsm: CommandLine) -> None:
    gms_fsm("lesson", "1", "--notebook", "-o", "mine")
    path = Path("mine", "lesson_1.ipynb")
    content: Any = json.loads(path.read_text(encoding="utf-8"))
    content["cells"][2]["source"] = ["first_slip = 6.25"]
    path.write_text(json.dumps(content), encoding="utf-8")
    done = gms_fsm("lesson", "1", "--notebook", "-o", "mine")
    assert done.code == 2
    assert "lesson_1.ipynb" in done.err
    assert "6.25" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("predicted", "measured", "said"),
    [
        (6.26, 6.25, "your answer is right"),
        (3.0, 6.0, "50 % too low"),
        (9.0, 6.0, "50 % too high"),
        (-1.0, 6.0, "far off"),
        (1e9, 6.0, "far off"),
        (0.0, 0.0, "You predicted 0 N. Measured: 0 N."),
        ("lower", "higher", "You predicted lower. Measured: higher."),
        (None, 6.0, "You predicted nothing. Measured: 6 N."),
    ],
)
def test_a_prediction_is_compared(
    predicted: float | str | None,
    measured: float | str,
    said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    reveal(predicted, measured, "N")
    assert said in capsys.readouterr().out


def test_a_parameter_has_a_slider_where_ipywidgets_is_installed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    widgets = pytest.importorskip("ipywidgets", reason="a slider needs ipywidgets")
    made: list[Any] = []
    monkeypatch.setattr(widgets, "interact", lambda draw, **slider: made.append(slider))
    vary(lambda n: n, 3, 1, 20, 1, "n")
    vary(lambda w: w, 45.0, 0.0, 2.7, 0.05, "w", log=True)
    vary(lambda v: v, 0.1, 0, 1, 0.1, "v")
    kinds = [(name, type(slider).__name__) for each in made for name, slider in each.items()]
    assert kinds == [("n", "IntSlider"), ("w", "FloatLogSlider"), ("v", "FloatSlider")]
    assert made[0]["n"].value == 3
