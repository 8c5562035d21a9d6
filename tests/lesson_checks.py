"""Checks for every lesson: five lines, and a figure with nothing cut off or covered."""

from __future__ import annotations

import itertools
from typing import Any

import pytest

from gms_fsm.app.lessons import Lesson, Result


def check_lines(result: Result) -> None:
    """Check the five lines: question, runs with the law, two with measured values, conclusion."""
    lines = result.lines()
    question, run, first, second, moral = lines
    assert question.startswith("Question: ")
    assert question.endswith("?")
    assert run.startswith("Run: ")
    assert "chosen by us" in run
    assert "signed law" in run or "published law" in run
    for line in (first, second):
        assert line.startswith("Measured")
        assert any(digit in line for digit in "0123456789")
    assert moral.startswith("So: ")
    assert not any("\n" in line for line in lines)


def check_figure(lesson: Lesson, result: Result) -> None:
    """Check that every axis has its unit, and no text is cut off or overlaps another."""
    pytest.importorskip("matplotlib", reason="pictures need the extra 'plots'")
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = lesson.figure(result)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    boxes: list[tuple[str, Any]] = []
    laws = []
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            label = axis.label.get_text()
            counts = label in ("", "elements n", "switches found once per step", "elements in slip")
            assert counts or "[" in label, label
        texts = [ax.title, ax._left_title, ax.xaxis.label, ax.yaxis.label, *_notes(ax)]
        boxes += [(t.get_text(), t.get_window_extent(renderer)) for t in texts if t.get_text()]
        laws += [t.get_text() for t in texts if " law" in t.get_text()]
    assert laws, "no panel names the law it ran"
    width, height = canvas.get_width_height()
    for text, box in boxes:
        assert min(box.x0, box.y0, width - box.x1, height - box.y1) >= -1, text
    for (one, a), (other, b) in itertools.combinations(boxes, 2):
        wide = min(a.x1, b.x1) - max(a.x0, b.x0)
        high = min(a.y1, b.y1) - max(a.y0, b.y0)
        assert wide <= 1 or high <= 1, (one, other)


def _notes(ax: Any) -> list[Any]:
    from matplotlib.text import Annotation

    return [text for text in ax.texts if isinstance(text, Annotation)]
