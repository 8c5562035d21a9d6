"""Lessons as notebooks, composed of ``notebook.md`` and the words of a lesson.

A fenced ``python`` block is a cell.

A notebook is a JSON file (nbformat 4.5), written here without Jupyter's packages. It has no
outputs. To run it, a kernel is needed: ``pip install ipykernel``, and a program that opens
notebooks.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from string import Template
from typing import Any

from gms_fsm.app.lessons import lesson
from gms_fsm.foundation.files import output_folder, write_text

TEMPLATE = Template(Path(__file__).with_name("notebook.md").read_text(encoding="utf-8"))
SOLUTIONS = "<details>\n<summary>Solutions</summary>\n\n{}\n\n</details>\n\n"
NEW = "<!-- a new cell -->\n"
FENCE = re.compile(r"^```(\w*)\n(.*?)^```\n", re.MULTILINE | re.DOTALL)
# Left out of cells: comments, and pictures, which the cells draw themselves.
LEFT_OUT = re.compile(r"^(?:<!--.*?-->|!\[[^\]]*\]\([^)]*\))\n", re.MULTILINE | re.DOTALL)

Cell = tuple[str, str]  # its kind, "markdown" or "code", and its text


def write_notebook(number: int, folder: str | Path) -> Path:
    """Write a lesson as a notebook.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_notebook(1, folder).name
    'lesson_1.ipynb'
    """
    content, name = notebook(composed(number)), f"lesson_{number}.ipynb"
    folder = output_folder(folder, [name])
    return write_text(folder / name, content)


def composed(number: int) -> tuple[Cell, ...]:
    """Return the cells of a lesson.

    Examples
    --------
    >>> kind, text = composed(1)[0]
    >>> kind, text.splitlines()[0]
    ('markdown', '# Lesson 1: Pre-sliding hysteresis')
    """
    chosen = lesson(number)
    words = dict(chosen.words) | {"explanation": _escaped(chosen.words["explanation"])}
    if words["solutions"]:
        words["solutions"] = SOLUTIONS.format(words["solutions"])
    page = TEMPLATE.substitute(
        words,
        module=chosen.module,
        source=inspect.getsource(chosen.measure),
        answers="".join(f"{each.name} = None  # {each.hint}\n" for each in chosen.questions),
        compared=_compared([each.name for each in chosen.questions], words["after"]),
    )
    return tuple(cell for part in page.split(NEW) for cell in cells_of(part))


def _compared(names: Iterable[str], after: str) -> str:
    """Return the cell that compares the answers, and imports what the cells after it call."""
    called = "compare, vary" if "vary(" in after else "compare"
    answers = "".join(f"    {name}={name},\n" for name in names)
    return f"""\
from gms_fsm.app.lessons.engine.predict import {called}

compare(
    result,
{answers})
"""


def cells_of(text: str) -> tuple[Cell, ...]:
    r"""Split Markdown into cells: ``python`` blocks are code; their outputs are left out.

    Examples
    --------
    >>> cells_of("Two.\n\n```python\n1 + 1\n```\n\n```text\n2\n```\n\nThree.\n")
    (('markdown', 'Two.'), ('code', '1 + 1'), ('markdown', 'Three.'))
    """
    return tuple((kind, cell.strip("\n")) for kind, cell in _parts(text) if cell.strip())


def _parts(text: str) -> Iterator[Cell]:
    here, plain, after_code = 0, "", False
    text = LEFT_OUT.sub("", text)
    for fence in FENCE.finditer(text):
        between = text[here : fence.start()]
        here = fence.end()
        plain += between
        if fence[1] == "python":
            yield "markdown", plain
            yield "code", fence[2]
            plain, after_code = "", True
            continue
        if not (fence[1] == "text" and after_code and not between.strip()):
            plain += fence[0]
        after_code = False
    yield "markdown", plain + text[here:]


def notebook(cells: tuple[Cell, ...]) -> str:
    """Return cells as the text of a notebook file, without outputs.

    Examples
    --------
    >>> json.loads(notebook((("code", "1 + 1"),)))["cells"][0]["source"]
    ['1 + 1']
    """
    content = {
        "cells": [_cell(place, *cell) for place, cell in enumerate(cells)],
        "metadata": {
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        },
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def _cell(place: int, kind: str, text: str) -> Mapping[str, Any]:
    outputs: Mapping[str, Any] = {"execution_count": None, "outputs": []} if kind == "code" else {}
    return {
        "cell_type": kind,
        "id": f"cell-{place}",
        "metadata": {},
        **outputs,
        "source": text.splitlines(keepends=True),
    }


def _escaped(text: str) -> str:
    """Return a docstring as Markdown, with stars escaped outside its code."""
    parts = re.split(r"(``.*?``)", text, flags=re.DOTALL)
    return "".join(part if i % 2 else part.replace("*", r"\*") for i, part in enumerate(parts))
