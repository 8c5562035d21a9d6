"""States, velocity and force over time, drawn in text with an axis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from gms_fsm.charts.chart import Chart
from gms_fsm.debugger._over_time import Ribbons
from gms_fsm.debugger._text import DRAWN, labels, short
from gms_fsm.debugger._view import Screen
from gms_fsm.debugger.tui._spans import Line, PanelLine, Span, line, state_role
from gms_fsm.foundation.quantities import scale_of, sparkline
from gms_fsm.traces.scope import unit_of


def axis(start: float, end: float, width: int) -> str:
    """Return times at round values below a strip of characters.

    >>> axis(0.0, 100.0, 40)
    '0 s                 50 s               '
    """
    rough = (end - start) / max(2, width // 10)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough)
    text, k = "", math.ceil(start / step - 1e-9)
    while k * step <= end:
        column = int(width * (k * step - start) / (end - start))
        label = f"{k * step:.6g} s"
        if column >= len(text) + bool(text) and column + len(label) <= width:
            text = text.ljust(column) + label
        k += 1
    return text.ljust(width - 1)


def ribbon_rows(
    ribbons: Ribbons, parent: Ribbons | None, view: Screen, chosen: int, lead: int
) -> list[PanelLine]:
    """Return the states of all elements over time; the cursor is a column."""
    rows, marks = [], DRAWN.ribbon
    states = [each.state for each in view.elements]
    roles = [
        state_role([state.name for state in contact.chart.states].index(each.state))
        for contact in view.contacts
        for each in contact.elements
    ]
    for i, label in enumerate(labels(view.contacts)):
        mark = "▶" if i == chosen else " "
        wide = max(2, lead - 2 - min(9, max(map(len, states))))
        text = f"{mark}{short(label, wide):<{wide}}"
        spans = [Span(text, "head" if i == chosen else "")]
        room = lead - len(text) - 1
        spans.append(Span(f"{short(states[i], room):<{room}} ", roles[i]))
        for part, mode in enumerate(ribbons.modes):
            shown = " " if mode is None else marks[mode[i] % len(marks)]
            role = "dim" if mode is None else state_role(mode[i])
            spans.append(Span("┃", "now") if part == ribbons.now else Span(shown, role))
        rows.append(PanelLine(_joined(spans)))
    if parent is not None:
        differs = [
            "≠" if None not in (a, b) and a != b else " "
            for a, b in zip(ribbons.modes, parent.modes, strict=True)
        ]
        rows.append(PanelLine(line((f"{' differs':<{lead}}", "dim"), ("".join(differs), "head"))))
    return rows


def _joined(spans: Sequence[Span]) -> Line:
    """Return spans with neighbours of the same role as one."""
    found: list[Span] = []
    for span in spans:
        if found and found[-1].role == span.role:
            found[-1] = Span(found[-1].text + span.text, span.role)
        else:
            found.append(span)
    return found


def ranges(values: Mapping[str, Sequence[float | None]], chart: Chart) -> str:
    """Return the ranges of velocity and force.

    >>> from gms_fsm.charts import LUGRE
    >>> ranges({"v": (0.0, None, 0.15), "F": (1.0, 2.0)}, LUGRE)
    'v 0 to 150.0 mm/s  F 1.000 to 2.000 N'
    """
    found = []
    for name, each in values.items():
        known = [value for value in each if value is not None and math.isfinite(value)]
        if known:
            scale = scale_of(known, unit_of(chart, name))
            low, high = scale.number(min(known)), scale.text(max(known))
            found.append(f"{name} {low} to {high}")
    return "  ".join(found)


def curve_rows(
    values: Mapping[str, Sequence[float | None]], lead: int, now: int
) -> list[PanelLine]:
    """Return velocity and force over time as sparklines; `ranges` says what they span."""
    rows = []
    for name, each in values.items():
        text = sparkline(each)
        spans = [Span(f" {name:<{lead - 1}}"), Span(text[:now], "dim")]
        rows.append(
            PanelLine([*spans, Span(text[now : now + 1], "now"), Span(text[now + 1 :], "dim")])
        )
    return rows
