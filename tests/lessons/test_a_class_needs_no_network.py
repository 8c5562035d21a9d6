"""The teaching pack and the lessons' live pages: whole, offline, and judging as Python does."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm.app.lessons import LESSONS, Result
from gms_fsm.app.lessons.engine.lesson import Lesson
from gms_fsm.app.lessons.engine.markup import items_of
from gms_fsm.app.lessons.engine.page import live_page
from gms_fsm.app.lessons.engine.predict import Question, judged
from tests.scenario_files import CommandLine

pytestmark = pytest.mark.slow
for module in ("playwright", "matplotlib", "uplot", "axe_playwright_python"):
    pytest.importorskip(module, reason="the pages are opened in a browser")

from gms_fsm.app.lessons.pack import CHOSEN, SHEETS, write_class  # noqa: E402
from tests.plots.browser import Open, browser, faults, open_page  # noqa: E402

__all__ = ["browser", "open_page"]
Ran = Callable[[int], Result]


@pytest.fixture(scope="module")
def folder(ran: Ran, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("class")
    with pytest.MonkeyPatch.context() as patch:
        made = {number: ran(number) for number in CHOSEN}  # before `run` is replaced
        patch.setattr(Lesson, "run", lambda lesson: made[int(lesson.words["number"])])
        page = live_page(made[6])  # the other pages are as long to make
        patch.setattr("gms_fsm.app.lessons.pack.live_page", lambda _: page)
        write_class(target, lambda _: None)
    return target


# --------------------------------------------------------------------------- the pack
def test_the_pack_is_whole_and_links_to_its_own_files(folder: Path) -> None:
    index = (folder / "index.html").read_text(encoding="utf-8")
    linked = set(re.findall(r'href="([^"]+)"', index))
    assert linked == {*SHEETS[1:], *(f"lesson_{number}_live.html" for number in CHOSEN)}
    for name in [*linked, "desk_experiment.ipynb", *(f"lesson_{n}.ipynb" for n in CHOSEN)]:
        assert (folder / name).is_file(), name


def test_the_plan_fills_90_minutes(folder: Path) -> None:
    index = (folder / "index.html").read_text(encoding="utf-8")
    spans = [(int(a), int(b)) for a, b in re.findall(r"<td>(\d+) to (\d+)</td>", index)]
    assert [a for a, _ in spans] == [0, *(b for _, b in spans[:-1])]
    assert spans[-1][1] == 90
    for number in CHOSEN:
        assert LESSONS[number].question in index


def test_every_task_has_a_solution(folder: Path) -> None:
    tasks, solutions = (
        (folder / f"{name}.html").read_text(encoding="utf-8") for name in ("tasks", "solutions")
    )
    for number in CHOSEN:
        lesson = LESSONS[number]
        count = len(items_of(lesson.words["tasks"]))
        assert len(items_of(lesson.words["solutions"])) == count >= 2
        for page in (tasks, solutions):
            assert lesson.heading in page
    assert tasks.count('class="answer"') == sum(len(LESSONS[n].questions) for n in CHOSEN)


@pytest.mark.matrix
def test_sheets_load_nothing_and_slides_fit_their_pages(folder: Path, open_page: Open) -> None:
    for name in SHEETS:
        page = open_page(folder / name)  # which fails at a request, or a message
        assert "default-src 'none'" in page.content()
        assert not re.search(r"""(?:src|href)=["'](?!data:)[a-z]+:""", page.content()), name
        assert faults(page) == [], name
    page = open_page(folder / "slides.html")
    high = page.evaluate(
        "[...document.querySelectorAll('.slide')].map((e) => [e.scrollHeight, e.clientHeight])"
    )
    assert len(high) == 2 + 5 * len(CHOSEN)
    assert all(inside <= room for inside, room in high)


def test_the_command_line_writes_a_pack(gms_fsm: CommandLine, monkeypatch: Any) -> None:
    monkeypatch.setattr(
        "gms_fsm.app.lessons.pack.write_class", lambda where, tell: [where / "index.html"] * 14
    )
    assert gms_fsm("class", "-o", "pack").out == "14 files in pack; start with pack/index.html\n"


# --------------------------------------------------------------------------- a lesson's page
CASES: list[tuple[Question, float | str | None, float | str]] = [
    (Question("a", "um", rtol=0.05), 6.0, 6.25),
    (Question("a", "um", rtol=0.05), 5.0, 6.25),
    (Question("a", "um", rtol=0.05), 0.0, 6.25),
    (Question("a", "um", rtol=0.05), -6.0, 6.25),
    (Question("a", "um", rtol=0.05), 1e6, 6.25),
    (Question("a", "N", atol=1e-3), 0.0, 5.506e-8),
    (Question("a", "N", atol=1e-3), 0.1, 5.506e-8),
    (Question("a", "m", rtol=0.1), -2.3, -2.283),
    (Question("a", "m", rtol=0.1), 3.0, 39.4),
    (Question("a"), None, 39.4),
    (Question("a", choices=("on", "off")), "on", "off"),
    (Question("a", choices=("on", "off")), "on", "on"),
]


@pytest.fixture(scope="module")
def lesson(folder: Path) -> Path:
    return folder / "lesson_6_live.html"


def test_a_page_judges_as_python_does(lesson: Path, open_page: Open) -> None:
    page = open_page(lesson)
    for question, predicted, measured in CASES:
        fields = {name: getattr(question, name) for name in ("unit", "rtol", "atol", "tolerance")}
        given = json.dumps([fields, predicted, measured])
        right, said = page.evaluate(f"judged(...{given})")
        assert (right, said) == judged(question, predicted, measured)
        assert math.isfinite(len(said))


def test_a_lesson_opens_its_run_after_the_answers(lesson: Path, open_page: Open) -> None:
    page = open_page(lesson)
    assert not page.is_visible("#judged")
    assert not page.is_visible("#revealed")
    assert page.evaluate("document.querySelector('#numbers').closest('[inert]') !== null")
    assert faults(page, context="#lesson") == []
    for place, answer in enumerate(("1.5 N", "0,5", ""), 1):
        page.fill(f"#answer-{place}", answer)
    page.click("#compare")
    said = page.locator("#answers output").all_inner_texts()
    assert [each.split(". ", 1)[0] for each in said] == [
        "You predicted 1.5 N",
        "You predicted 0.5 N",
        "You predicted nothing",
    ]
    assert [page.locator("output.right").count(), page.locator("output.wrong").count()] == [1, 2]
    page.click("#to-run")
    assert not page.is_visible("#lesson")
    before = page.locator("#took").inner_text()
    dial = page.locator("#numbers input[type=range]").first
    dial.evaluate("(e) => { e.value = e.max; e.dispatchEvent(new Event('input')); }")
    page.wait_for_function("(old) => document.querySelector('#took').innerText !== old", arg=before)
    page.click("#to-lesson")
    assert "damping ratio" in page.locator("#revealed").inner_text()


def test_what_is_no_number_is_asked_for_again(lesson: Path, open_page: Open) -> None:
    page = open_page(lesson)
    page.fill("#answer-1", "a lot")
    page.click("#compare")
    assert page.locator("#answers output").first.inner_text().startswith("Give a number")
    assert not page.is_visible("#judged")


@pytest.mark.matrix
def test_a_lesson_without_sliders_has_its_replay(ran: Ran, tmp_path: Path, open_page: Open) -> None:
    page = open_page(live_page(ran(8)).save(tmp_path / "lesson_8_live.html"))
    assert page.locator("#answer-3 option").all_inner_texts() == ["", "smaller", "same", "larger"]
    page.click("#compare")
    page.click("#to-run")
    assert page.locator("main .run").count() == 2
    assert page.locator("#numbers").count() == 0


@pytest.mark.matrix
@pytest.mark.every(8)
@pytest.mark.parametrize("number", [0, 1, 2, 4, 5, 6, 7, 9])
def test_the_live_run_is_one_of_the_lesson(number: int) -> None:
    import plots

    live = LESSONS[number].live
    assert live is not None
    subject, vary, options = live()
    html = plots.play(*subject, vary=vary, **options).html
    assert all(name in html for name in vary)
    assert np.isfinite(subject[-1])
