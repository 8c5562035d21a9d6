"""A lesson as one live page: predict, be judged, drag, and read why. It needs no network."""

from __future__ import annotations

import base64
import hashlib
import json
from dataclasses import asdict
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from gms_fsm.app.lessons.engine.markup import HERE, asked_of, filled, html_of, picture_of, typeset
from gms_fsm.app.lessons.engine.predict import Question

if TYPE_CHECKING:
    from gms_fsm.app.lessons.engine.lesson import Result
    from plots.page.replay import Replay


def live_page(result: Result) -> Replay:
    """Return the page of a lesson that was run: its words over a run that can be changed.

    A lesson without a `live` run has its replayed runs instead, which only step.
    """
    import plots
    from plots.page.replay import Replay, replay

    lesson, title = result.lesson, result.lesson.heading
    if lesson.live is None:
        runs = result.replayed
        page = replay(*runs.values(), title=title, names=list(runs))
        drag = "Step through the runs of the lesson, and ask why a guard fires, or does not."
    else:
        subject, vary, options = lesson.live()
        page = plots.play(*subject, vary=vary, title=title, **options)
        drag = (
            f"The run is computed in this page. Drag {_listed(list(vary))}, and see what changes; "
            "the run as it was stays dashed."
        )
    words = {name: html_of(lesson.words[name]) for name in ("explanation", "why", "tasks")}
    section = filled(
        "page.html",
        words
        | {
            "before": asked_of(lesson),
            "heading": escape(title),
            "title": escape(lesson.title),
            "level": lesson.level.capitalize(),
            "drag": escape(drag),
            "fields": "\n".join(map(_field, range(1, 9), lesson.questions)),
            "lines": "\n".join(f"<p>{escape(typeset(line))}</p>" for line in result.lines()[1:]),
            "figure": picture_of(result),
            "asked": _asked(result),
        },
    )
    return Replay(_with_section(page.html, section))


def _listed(names: list[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} or {last}" if others else last


def _field(number: int, question: Question) -> str:
    name, hint = f"answer-{number}", escape(typeset(question.hint))
    if question.choices:
        options = "".join(f"<option>{escape(each)}</option>" for each in ("", *question.choices))
        entry, hint = f'<select id="{name}">{options}</select>', ""
    else:
        entry = f'<input id="{name}" inputmode="decimal" autocomplete="off">'
    return (
        f'<div class="answer"><label for="{name}">{number}.</label>{entry}'
        f'<span class="hint">{hint}</span><output for="{name}"></output></div>'
    )


def _asked(result: Result) -> str:
    """Return questions and measured values as JSON that cannot end its element."""
    questions = [
        asdict(each) | {"tolerance": each.tolerance, "unit": typeset(each.unit)}
        for each in result.lesson.questions
    ]
    measured = [result.values[each.name] for each in result.lesson.questions]
    plain = [each if isinstance(each, str) else float(np.asarray(each)) for each in measured]
    return json.dumps({"questions": questions, "measured": plain}).replace("<", "\\u003c")


def _with_section(page: str, section: str) -> str:
    """Put a section before everything else on a page, and let the page's policy know of it."""
    style, script = ((HERE / f"page.{kind}").read_text(encoding="utf-8") for kind in ("css", "js"))
    for place, what in (
        ("script-src ", f"script-src {_digest(script)} "),
        ("style-src ", f"img-src data:; style-src {_digest(style)} "),
        ("</head>", f"<style>{style}</style>\n</head>"),
        ("<body>", f"<body>\n{section}"),
    ):
        page = page.replace(place, what, 1)
    return f"<script>{script}</script>\n</body>".join(page.rsplit("</body>", 1))


def _digest(text: str) -> str:
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"
