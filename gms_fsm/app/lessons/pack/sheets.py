"""The sheets of the teaching pack, made from the words and results of lessons."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Iterator, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from gms_fsm.app.lessons.engine.lesson import Result
from gms_fsm.app.lessons.engine.markup import asked_of, html_of, items_of, picture_of
from gms_fsm.app.lessons.engine.predict import Question

HERE = Path(__file__).parent
# A copy that `python docs/notebooks.py` writes from the how-to page; a wheel has no docs.
HOMEWORK = HERE / "desk_experiment.ipynb"
TITLE = "Friction as a state machine"
LONG = 900  # characters of text that fill a slide in its usual size


def plan(results: Sequence[Result]) -> str:
    """Return the plan of the class, with links to its files."""
    questions = {
        f"lesson_{each.lesson.words['number']}": f"{each.lesson.title}: {each.lesson.question}"
        for each in results
    }
    text = Template(_read("plan.md")).substitute(questions)
    return _sheet(TITLE, html_of(text, links=True))


def slides(results: Sequence[Result]) -> str:
    """Return the slides: for each lesson its question, predictions, what happens, why."""
    parts = [f'<section class="slide first"><h1>{TITLE}</h1><p>90 minutes</p></section>']
    for each in results:
        parts += _slides_of(each)
    parts.append(
        '<section class="slide first"><h1>Homework</h1><p>Measure the friction of your phone on '
        "your desk: homework.html says how.</p></section>"
    )
    return _sheet(f"{TITLE}: slides", "\n".join(parts), kind="slides")


def _slides_of(result: Result) -> Iterator[str]:
    lesson = result.lesson
    heading, question = escape(lesson.title), escape(lesson.question)
    about = f"Lesson {lesson.words['number']}: {heading}"
    yield f'<section class="slide first"><h1>{question}</h1><p>{about}</p></section>'
    yield _slide(f"{heading}: predict", asked_of(lesson))
    yield _slide(f"{heading}: what happens", html_of(lesson.words["explanation"]))
    yield f'<section class="slide">{picture_of(result)}</section>'
    moral = escape(result.lines()[-1].removeprefix("So: "))
    moral = f"<p><b>{moral[0].upper()}{moral[1:]}</b></p>"
    yield _slide(f"{heading}: why", html_of(lesson.words["why"]) + moral)


def _slide(heading: str, body: str) -> str:
    long = len(re.sub(r"<[^>]+>", "", body)) > LONG or "<table>" in body
    return f'<section class="slide{" long" * long}"><h1>{heading}</h1>\n{body}</section>'


def tasks(results: Sequence[Result]) -> str:
    """Return the sheet for students: what to predict, with room for answers, and what to try."""
    parts = [f"<h1>{TITLE}: tasks</h1>"]
    for each in results:
        lesson = each.lesson
        rooms = "\n".join(map(_room, range(1, 9), lesson.questions))
        parts.append(
            f'<section class="lesson"><h2>{escape(lesson.heading)}</h2>\n<h3>Predict</h3>\n'
            f"{asked_of(lesson)}\n{rooms}\n<h3>Try</h3>\n{html_of(lesson.words['tasks'])}</section>"
        )
    return _sheet(f"{TITLE}: tasks", "\n".join(parts))


def _room(number: int, question: Question) -> str:
    hint = escape(question.hint)
    return f'<div class="answer">{number}. <i></i><span class="soft">{hint}</span></div>'


def solutions(results: Sequence[Result]) -> str:
    """Return the sheet for the teacher: what is measured, why, and what trying shows."""
    parts = [f"<h1>{TITLE}: solutions</h1>"]
    for each in results:
        lesson = each.lesson
        rows = "".join(
            f"<tr><td>{number}</td><td>{_measured(each, question)}</td>"
            f"<td>{escape(question.tolerance or 'the word')}</td></tr>"
            for number, question in enumerate(lesson.questions, 1)
        )
        lines = "\n".join(f"<p>{escape(line)}</p>" for line in each.lines()[1:])
        tried = zip(
            items_of(lesson.words["tasks"]), items_of(lesson.words["solutions"]), strict=True
        )
        shown = "\n".join(f"<li>{html_of(task)}{html_of(found)}</li>" for task, found in tried)
        heads = "<th>question</th><th>measured</th><th>right within</th>"
        parts.append(
            f'<section class="lesson"><h2>{escape(lesson.heading)}</h2>\n'
            f"<table><tr>{heads}</tr>{rows}</table>\n"
            f"{html_of(lesson.words['why'])}\n<h3>What trying shows</h3>\n<ol>{shown}</ol>\n"
            f"<h3>The runs</h3>\n{lines}\n{picture_of(each)}</section>"
        )
    return _sheet(f"{TITLE}: solutions", "\n".join(parts))


def _measured(result: Result, question: Question) -> str:
    value: Any = result.values[question.name]
    return escape(value if isinstance(value, str) else f"{value:.4g} {question.unit}")


def homework() -> str:
    """Return the experiment with a phone, as its notebook has it."""
    cells = json.loads(HOMEWORK.read_text(encoding="utf-8"))["cells"]
    texts = ((each["cell_type"], "".join(each["source"])) for each in cells)
    body = "\n".join(
        html_of(text) if kind == "markdown" else f"<pre>{escape(text)}</pre>"
        for kind, text in texts
    )
    return _sheet(f"{TITLE}: homework", body)


def _sheet(title: str, body: str, kind: str = "sheet") -> str:
    style = _read("sheet.css")
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    return Template(_read("sheet.html")).substitute(
        title=escape(title), style=style, digest=f"'sha256-{digest}'", body=body + "\n", kind=kind
    )


def _read(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")
