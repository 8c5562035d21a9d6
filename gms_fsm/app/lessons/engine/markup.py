"""The words of a lesson as HTML, and files as addresses that need no network."""

from __future__ import annotations

import base64
import functools
import re
import sys
from collections.abc import Mapping
from html import escape
from io import BytesIO
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from markdown_it import MarkdownIt

from gms_fsm.charts.chart import Chart

if TYPE_CHECKING:
    from gms_fsm.app.lessons.engine.lesson import Lesson, Result

HERE = Path(__file__).parent
_MARKDOWN = MarkdownIt("commonmark", {"html": False}).enable("table")
_CODE = re.compile(r"(```.*?^```|``.*?``|`[^`]*`)", re.DOTALL | re.MULTILINE)
_STAR = re.compile(r"(?<!\*)\*(?!\*)")  # not those of **bold**
_MICRO = re.compile(r"\bum\b")
_LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")


def typeset(text: str) -> str:
    """Return words of a terminal as a page has them.

    Examples
    --------
    >>> typeset("in um, at 3 um/s; a drum")
    'in µm, at 3 µm/s; a drum'
    """
    return _MICRO.sub("µm", text)


def html_of(text: str, *, links: bool = False) -> str:
    r"""Return Markdown as HTML. Single stars are no emphasis; links become words by default.

    Examples
    --------
    >>> html_of("1. F = k * z, see [there](page.md)\n")
    '<ol>\n<li>F = k * z, see there</li>\n</ol>\n'
    """
    parts = _CODE.split(text)
    plain = [part if links else _LINK.sub(r"\1", part) for part in parts[::2]]
    parts[::2] = [_STAR.sub(r"\*", typeset(part)) for part in plain]
    rendered: str = _MARKDOWN.render("".join(parts))
    return rendered


def items_of(text: str) -> list[str]:
    r"""Return the items of a list, each as text.

    Examples
    --------
    >>> items_of("- Double C.\n- Halve it,\n  and look.")
    ['Double C.', 'Halve it,\n  and look.']
    """
    return [each.strip() for each in re.split(r"^(?:- |\d+\. )", text, flags=re.MULTILINE)[1:]]


def filled(template: str, values: Mapping[str, str]) -> str:
    """Return a template of this folder, or of the one given, with its values."""
    return Template((HERE / template).read_text(encoding="utf-8")).substitute(values)


def asked_of(lesson: Lesson) -> str:
    """Return what is asked as HTML; where a notebook shows a chart, there is its picture."""
    from plots import statechart
    from plots.output.graphviz import picture

    known = {name.casefold(): each for name, each in vars(sys.modules[lesson.module]).items()}
    found = html_of(lesson.words["before"])
    for code in re.findall(r"<pre><code class=\"language-python\">.*?</code></pre>\n", found, re.S):
        last = code.removesuffix("</code></pre>\n").split()[-1]
        if isinstance(chart := known.get(last.casefold()), Chart):
            image = _image(picture(statechart(chart), "svg"), f"chart {chart.name}", "chart")
            found = found.replace(code, f"{code}<p>{image}</p>\n", 1)
    return found


@functools.lru_cache(maxsize=16)  # slides, solutions and live page show the same
def picture_of(result: Result) -> str:
    """Return the figure of a lesson as an ``img`` that contains it."""
    figure: Any = result.lesson.figure(result)
    file = BytesIO()
    figure.savefig(file, format="svg", metadata={"Date": None})
    return _image(file.getvalue(), f"The runs: {result.lesson.heading}", "figure")


def _image(svg: bytes, said: str, kind: str) -> str:
    data, alt = base64.b64encode(svg).decode(), escape(said, quote=True)
    return f'<img class="{kind}" alt="{alt}" src="data:image/svg+xml;base64,{data}">'
