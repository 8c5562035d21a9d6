"""The guards of an element clause by clause: a table, and margins as bars on a log scale."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import NamedTuple

from gms_fsm.debugger.tui._chart import MARKS
from gms_fsm.debugger.tui._spans import Line, PanelLine, Span, line
from gms_fsm.foundation.quantities import Scale, trimmed, wrapped
from gms_fsm.session.explain import Clause, Why
from gms_fsm.session.session import Breakpoint

DECADES = 6  # of a margin, relative to the larger side
VALUE = 13  # columns of a value in the table of clauses
VALUES = VALUE + 4  # columns around text and bar


def margin_bar(relative: float, half: int) -> str:
    """Return a margin on a logarithmic scale: to the right if true, to the left if false.

    Examples
    --------
    >>> margin_bar(1.0, 6), margin_bar(-1e-3, 6), margin_bar(0.0, 6)
    ('      │██████', '   ███│      ', '      │      ')
    """
    size = 0.0
    if relative and math.isfinite(relative):
        size = half * max(0.0, min(1.0, 1.0 + math.log10(abs(relative)) / DECADES))
    full, rest = int(size), size - int(size) >= 0.5
    if relative < 0.0:
        return f"{'▐' * rest + '█' * full:>{half}}│{' ' * half}"
    return f"{' ' * half}│{'█' * full + '▌' * rest:<{half}}"


def why_rows(why: Why, address: str, points: Sequence[Breakpoint], width: int) -> list[PanelLine]:
    """Return the edges of an element clause by clause; a click sets a breakpoint at a guard."""
    rows = [
        PanelLine(line((part, "head"))) for text in why.heading for part in wrapped(text, width)
    ]
    texts = [len(clause.text) for each in why for clause in each.clauses]
    if texts:
        table = ClauseTable.fitting(max(texts), width)
        rows.append(PanelLine(line((table.head, "dim"))))
    for each in why:
        edge = each.edge
        command = f"break valid {edge.name} element {address}"
        if not address.isdigit():
            command = f"break valid {edge.name} {address}"
        marks = " ● break" if any(point.name == edge.name for point in points) else ""
        fired = "  FIRED" if each.fired else ""
        text = f"{each.priority} {edge.name}: {edge.source} → {edge.target}{fired}{marks}"
        role = "fired" if each.fired else "head"
        rows += [PanelLine(line((part, role)), command) for part in wrapped(text, width)]
        rows += [
            PanelLine(each, command) for clause in each.clauses for each in table.lines(clause)
        ]
    for each in why:
        role = "fired" if each.fired else "true" if each.holds else ""
        rows += [PanelLine(line((part, role))) for part in wrapped(each.verdict, width)]
    return rows


def _cell(scale: Scale, value: float) -> str:
    """Return a value, with two digits if more would leave its column: bars share their zero."""
    text = trimmed(scale.text(value))
    return text if len(text) < VALUE else trimmed(scale.text(value, 2))


class ClauseTable(NamedTuple):
    """How clauses are laid out: widths of the text and of half a bar, and what there is room for.

    Where a text leaves no room for its margin, the margin is on the next line.
    """

    wide: int
    half: int
    sides: bool
    apart: bool

    @classmethod
    def fitting(cls, wide: int, width: int) -> ClauseTable:
        """Return the layout for texts and a panel of given widths."""
        sides = width >= wide + VALUES + 2 * VALUE + 2 * 6
        apart = width < wide + VALUES + 2 * 2
        wide = min(wide, width - 2) if apart else wide
        used = VALUES + 2 * VALUE * sides + (0 if apart else wide)
        return cls(wide, max(2, min(12, (width - used) // 2)), sides, apart)

    @property
    def head(self) -> str:
        """The headings of the columns."""
        values = f"{'left':>{VALUE}}{'right':>{VALUE}}" if self.sides else ""
        no, yes = ("false", "true") if self.half >= len("false") else (MARKS[False], MARKS[True])
        bar = f"{no:>{self.half}}│{yes:<{self.half}}"
        clause = "" if self.apart else f"{'clause':<{self.wide}}"
        return f"  {clause}{values}{'margin':>{VALUE}} {bar}"

    def lines(self, clause: Clause) -> list[Line]:
        """Return the line of a clause, or two: truth, text, both sides, margin, bar."""
        mark = MARKS[clause.holds if clause.computable else None]
        role, value = "true" if clause.holds else "false", list[Span]()
        if not clause.computable:
            value = [Span("  cannot be computed here", "dim")]
        elif math.isnan(clause.margin):  # compound: no two sides
            value = [Span("  true" if clause.holds else "  false", role)]
        else:
            if self.sides:
                both = (_cell(clause.scale, side) for side in (clause.left, clause.right))
                value += [Span(f" {side:>{VALUE - 1}}") for side in both]
            margin = _cell(clause.scale, clause.margin) if clause.relative else "0, rounding"
            bar = margin_bar(clause.relative, self.half)
            value += [Span(f" {margin:>{VALUE - 1}} "), Span(bar, role)]
        if not self.apart:
            return [[Span(f"{mark} ", role), Span(f"{clause.text:<{self.wide}}"), *value]]
        texts = textwrap.wrap(clause.text, self.wide)
        leads = [f"{mark} ", *["  "] * len(texts)]
        found = [line((lead, role), text) for lead, text in zip(leads, texts, strict=False)]
        return [*found, [Span("  "), *value]]
