"""What holds for every lesson: its lines, its figure, its notebook, its questions and answers."""

from __future__ import annotations

import importlib.util
import itertools
import json
import math
import re
import string
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from gms_fsm.app import lessons
from gms_fsm.app.lessons import LESSONS, Result
from gms_fsm.app.lessons.engine.lesson import LEVELS, Lesson, grid
from gms_fsm.app.lessons.engine.notebooks import composed
from gms_fsm.app.lessons.engine.predict import Question, judged, vary
from gms_fsm.errors import MissingExtraError, ParameterError
from tests.helpers import ROOT, matrix
from tests.scenario_files import CommandLine, one_message

FOLDER = ROOT / "docs" / "lessons"
COUNTED = ("", "elements $n$", "switches found once per step", "elements in slip")  # without a unit
FORMATTER = string.Formatter()
# What a reader finds with pencil and paper from the data of a lesson, and what a hasty one says.
COMPUTED: dict[int, tuple[float | str, ...]] = {
    0: (28, "either", 1.5 / (2 * 0.1)),
    1: (0.25 / 40 * 1e3, 0),
    2: (8 * 0.1 * 0.25 / 1.2, 0),
    3: (2 / (0.2 * 2 * math.pi / 20), 4),
    4: (0.4, 0.4 - 0.8 * math.exp(0.1 * 4.9 / 0.4), "more"),
    5: (100 / (4 * 4**2), 0),
    6: (1.5, 1.04 - 0.64 * (1.5 - 1.04), (1.5 - 0.75) / 2 / 0.01 + math.pi / math.sqrt(2)),
    7: ("higher", 50),
    8: (0, (0.3 + 0.4 + 0.5 + 0.6) * 0.14, "larger"),
    9: (1.5 / (2 * 0.1), 0, 0.04 / 0.05, 0.5 * 0.75 * (1 - 0.5**2)),
    10: ("lugre", "gms-published", "gms-signed"),
    11: ("weights2", math.sqrt(1.95 / 0.05), 2 / 0.5),
    12: (2, 0, 1, "copy"),
    13: (
        math.sqrt(8713 / 1.14e-3) / (2 * math.pi),
        0.15 / math.sqrt(8713 / 1.14e-3) * 1e6,
        "lower",
    ),
}
GUESSED: dict[int, tuple[float | str, ...]] = {
    0: (15, "off", 15),
    1: (25, 0.01),
    2: (0, 0.2),
    3: (1, 48),
    4: (1.5, -0.4, "same"),
    5: (25, 50),
    6: (1, 0.5, 5),
    7: ("lower", 600),
    8: (10, 1e-3, "same"),
    9: (5, 1e-3, 0.4, 0.5),
    10: ("stiction", "lugre", "elasto-plastic"),
    11: ("k2", 39, 1),
    12: (3, 1, 2, "both"),
    13: (220, 150, "same"),
}
Ran = Callable[[int], Result]
each_lesson = pytest.mark.parametrize(
    "number",
    [
        *(0, 1, 9),
        *(pytest.param(number, marks=pytest.mark.slow) for number in (6, 10, 13)),
        *(pytest.param(n, marks=pytest.mark.matrix) for n in (2, 3, 4, 5, 7, 8, 11, 12)),
    ],
    scope="module",  # tests of a lesson follow each other, so that one worker runs it
)


def test_a_module_in_the_folder_is_a_lesson() -> None:
    assert list(LESSONS) == list(range(len(LESSONS)))
    assert len(LESSONS) >= 12
    for number, lesson in LESSONS.items():
        assert lesson.heading == f"Lesson {number}: {lesson.question}"
        assert f".l{number}_" in lesson.module
    assert len({lesson.question for lesson in LESSONS.values()}) == len(LESSONS)


@pytest.mark.every(2)
@each_lesson
def test_the_five_lines_say_what_was_measured(ran: Ran, number: int) -> None:
    question, run, first, second, moral = ran(number).lines()
    assert question == f"Question: {LESSONS[number].question}"
    assert run.startswith("Run: ")
    assert "chosen by us" in run
    assert re.search("signed law|published law", run)
    assert moral.startswith("So: ")
    assert not re.search(r"[{}\n]", "".join((run, first, second, moral)))
    # In both lines of measured values, the numbers are those of the run.
    templates = LESSONS[number].words["said"].split("\n\n")[1:3]
    for template, line in zip(templates, (first, second), strict=True):
        fields = [re.split(r"\W", name)[0] for _, name, *_ in FORMATTER.parse(template) if name]
        assert {*fields} & {*ran(number).values}
        assert line.startswith("Measured")


@pytest.mark.every(3)
@each_lesson
def test_readers_predict_before_the_run_and_compare_after_it(
    ran: Ran, number: int, capsys: pytest.CaptureFixture[str]
) -> None:
    cells, questions = composed(number), LESSONS[number].questions
    (run,) = (i for i, (_, text) in enumerate(cells) if "this.run()" in text)
    asked = [text for kind, text in cells[:run] if kind == "code"]
    (compared,) = (text for kind, text in cells[run:] if kind == "code" and "compare(" in text)
    assert any("<summary>Why?" in text for kind, text in cells[run:] if kind == "markdown")
    names: dict[str, Any] = {"result": ran(number)}
    exec("\n".join(asked), names)
    answers = [f"{each.name} = None  # {each.hint}" for each in questions]
    assert asked[-1].splitlines() == answers
    assert all(names[each.name] is None for each in questions)
    exec(compared, names)
    assert capsys.readouterr().out.count("You predicted nothing. Measured: ") == len(questions)


@each_lesson
def test_every_item_is_a_question_that_the_run_answers(ran: Ran, number: int) -> None:
    lesson, result = LESSONS[number], ran(number)
    assert lesson.level in LEVELS
    items = re.findall(r"^\d+\. ", lesson.words["before"], re.MULTILINE)
    assert items == [f"{i}. " for i in range(1, len(lesson.questions) + 1)]
    assert len(items) >= 2
    for question in lesson.questions:
        measured = result.values[question.name]
        assert judged(question, measured, measured)[0], question
        if question.choices:
            assert measured in question.choices
        else:
            assert bool(question.rtol) != bool(question.atol)


@each_lesson
def test_who_computes_from_what_is_printed_is_right_and_who_does_not_is_not(
    ran: Ran, number: int
) -> None:
    questions, result = LESSONS[number].questions, ran(number)
    for answers, right in ((COMPUTED[number], True), (GUESSED[number], False)):
        for question, answer in zip(questions, answers, strict=True):
            verdict, said = judged(question, answer, result.values[question.name])
            assert verdict == right, said


@pytest.mark.every(2)
@pytest.mark.slow
@each_lesson
def test_its_figure_has_units_and_nothing_overlaps(ran: Ran, number: int) -> None:
    pytest.importorskip("matplotlib", reason="pictures need the extra 'plots'")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.text import Annotation

    lesson = LESSONS[number]
    figure = lesson.figure(ran(number))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    texts: list[Any] = []
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            label = axis.label.get_text()
            assert label in COUNTED or "[" in label, label
        texts += [ax.title, ax._left_title, ax.xaxis.label, ax.yaxis.label]
        texts += [text for text in ax.texts if isinstance(text, Annotation)]
    said = [text.get_text() for text in texts]
    letters = "".join(sorted(ax.title.get_text() for ax in figure.axes))
    assert letters == "abcdef"[: len(lesson.panels)]
    assert any(" law" in each for each in said), "no panel names the law it ran"
    boxes = [(t.get_text(), t.get_window_extent()) for t in texts if t.get_text()]
    width, height = canvas.get_width_height()
    for text, box in boxes:
        assert min(box.x0, box.y0, width - box.x1, height - box.y1) >= -1, text
    for (one, a), (other, b) in itertools.combinations(boxes, 2):
        wide = min(a.x1, b.x1) - max(a.x0, b.x0)
        high = min(a.y1, b.y1) - max(a.y0, b.y0)
        assert wide <= 1 or high <= 1, (one, other)


def test_a_page_without_its_parts_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = ModuleType("broken", "Lesson 12: Nothing.\n\nWhat?\n\nNo sections.")
    monkeypatch.setitem(sys.modules, "broken", broken)
    with pytest.raises(ValueError, match="broken: its docstring is not the page of a lesson"):
        _ = Lesson("broken", dict, (), grid("a", (1.0, 1.0)), level="school", questions=()).title
    with pytest.raises(AttributeError, match="nothing named shoes was measured"):
        _ = Result(LESSONS[1], {}).shoes


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


def test_notebooks_in_the_repository_are_in_step(notebooks: ModuleType) -> None:
    """If this fails, run: python docs/notebooks.py."""
    sources = notebooks.sources()
    names = {path.stem for path in sources}
    assert names == {*(f"lesson_{number}" for number in LESSONS), "desk_experiment"}
    assert set(FOLDER.glob("*.ipynb")) == {path for path in sources if path.parent == FOLDER}
    for path, text in sources.items():
        assert path.read_text(encoding="utf-8") == text, path.name


# With ipywidgets, and nothing else of the extra docs, the site runs all lessons
# (tests/docs/test_docs_build.py). Without it, `vary` draws once; one lesson has no slider.
@pytest.mark.matrix
@pytest.mark.slow
@pytest.mark.parametrize(
    "name", matrix(["lesson_0", "lesson_1", "lesson_4", "desk_experiment"], ["desk_experiment"])
)
def test_a_notebook_runs_from_top_to_bottom(
    name: str, notebooks: ModuleType, tmp_path: Path
) -> None:
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
    lesson = name.startswith("lesson")
    assert len(pictures) == 1 + text.count('"vary(')
    assert printed.count("You predicted nothing. Measured: ") == text.count(" = None  # ")
    assert (tmp_path / f"{name}_replay.html").is_file() == lesson
    assert lesson or "friction coefficient 0.30" in printed  # the record was made with 0.30


def test_the_command_line_lists_lessons_and_writes_notebooks(gms_fsm: CommandLine) -> None:
    done = gms_fsm("lesson")
    assert done.code == 0, done.err
    for line, (number, lesson) in zip(done.out.splitlines(), LESSONS.items(), strict=True):
        assert line == f"{number}  {lesson.title}: {lesson.question}"
    path = Path("mine", "lesson_1.ipynb")
    assert gms_fsm("lesson", "1", "--notebook", "-o", "mine").out == f"{path}\n"
    assert path.read_text(encoding="utf-8") == (FOLDER / path.name).read_text(encoding="utf-8")
    assert len(gms_fsm("lesson", "--notebook", "-o", "all").out.splitlines()) == len(LESSONS)

    content: Any = json.loads(path.read_text(encoding="utf-8"))
    content["cells"][2]["source"] = ["first_slip = 6.25"]
    path.write_text(json.dumps(content), encoding="utf-8")
    done = gms_fsm("lesson", "1", "--notebook", "-o", "mine")  # not over a reader's answers
    assert done.code == 2
    assert "lesson_1.ipynb" in done.err
    assert "6.25" in path.read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_command_line_writes_text_figure_and_page(gms_fsm: CommandLine) -> None:
    for module in ("matplotlib", "uplot", "pygraphviz"):
        pytest.importorskip(module, reason="figure and page need the extras")
    done = gms_fsm("lesson", "7", "-o", "out")
    assert done.code == 0, done.err
    text = Path("out/lesson_7.txt").read_text(encoding="utf-8")
    assert done.out.startswith(text)
    assert len(text.splitlines()) == 5
    assert Path("out/lesson_7.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in Path("out/lesson_7.svg").read_text(encoding="utf-8")
    page = Path("out/lesson_7.html").read_text(encoding="utf-8")
    assert "Lesson 7" in page
    assert "10 rad/s: GMS" in page
    for name in ("txt", "png", "svg", "html"):
        assert f"lesson_7.{name}" in done.out


def test_a_mistake_is_one_message_before_anything_runs(
    gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Lesson, "run", lambda _: pytest.fail("it was run"))
    Path("file").write_text("in the way")
    one_message(gms_fsm("lesson", "00"), "no lesson '00'")
    one_message(gms_fsm("lesson", "7", "-o", "file/out"), "choose another folder")
    assert list(Path().iterdir()) == [Path("file")]
    with pytest.raises(ParameterError):
        lessons.teach(99, "out")


def test_without_the_extras_there_is_the_text_and_a_note(
    ran: Ran, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = ran(1)  # before `run` is replaced, as it runs only once
    monkeypatch.setattr(Lesson, "run", lambda _: result)

    def missing(*_: object) -> list[Path]:
        raise MissingExtraError("needs an extra")

    for step in ("_draw", "_replay"):
        monkeypatch.setattr(lessons, step, missing)
    with pytest.warns(UserWarning, match="was written: needs an extra") as noted:
        taught = lessons.teach(1, tmp_path)
    assert len(noted) == 2
    assert [path.name for path in taught.files] == ["lesson_1.txt"]
    assert taught.files[0].read_text(encoding="utf-8").splitlines() == list(taught.lines)


@pytest.mark.parametrize(
    ("predicted", "measured", "said"),
    [
        (6.26, 6.25, "Right, within 2 %."),
        (6.0, 6.25, "Your answer is 4 % too low."),
        (9.0, 6.0, "Your answer is 50 % too high."),
        (0.0, 6.0, "Your answer is much too low."),
        (-1.0, 6.0, "Your answer is too low."),
        (math.inf, 6.0, "Your answer is too high."),
        (math.nan, 6.0, "Your answer is too low."),
        (None, 6.0, "You predicted nothing. Measured: 6 N."),
    ],
)
def test_a_number_is_right_within_its_tolerance(predicted: Any, measured: Any, said: str) -> None:
    right, words = judged(Question("F", "N", rtol=0.02), predicted, measured)
    assert words.endswith(said)
    assert right == said.startswith("Right")


def test_nothing_is_right_for_what_is_rounding() -> None:
    gap = Question("gap", "N", atol=1e-3)
    assert judged(gap, 0.0, 5e-8) == (
        True,
        "You predicted 0 N. Measured: 5e-08 N. Right, within 0.001 N.",
    )
    assert judged(gap, 0.01, 5e-8)[1].endswith("Your answer is too high.")


def test_words_are_right_in_any_case() -> None:
    asked = Question("at_20", choices=("on", "off"))
    assert judged(asked, " Off ", "off")[0]
    assert judged(asked, "on", "off") == (False, "You predicted on. Measured: off. Not right.")


def test_a_parameter_has_a_slider_where_ipywidgets_is_installed(
    monkeypatch: pytest.MonkeyPatch,
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


def test_without_ipywidgets_a_parameter_is_drawn_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("IPython", reason="display is IPython's")
    monkeypatch.setattr("gms_fsm.app.lessons.engine.predict.find_spec", lambda _: None)
    vary(lambda n: f"drawn with {n}", 3, 1, 20, 1, "n")
    said = capsys.readouterr().out
    assert said.count("drawn with") == 1
    assert "n = 3; for another value call" in said
