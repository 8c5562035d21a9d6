"""HTML for notebooks: escaped texts, tables, and how many more rows there are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from gms_fsm.errors import cut
from gms_fsm.foundation.text import visible_lines

LONGEST = 400  # characters of a cell


def table(
    heads: Sequence[str], rows: Iterable[Sequence[object]], *, more: str = "", caption: str = ""
) -> str:
    """Return a table; every text is escaped and cut.

    Examples
    --------
    >>> table(["t [s]"], [[0.1]], more="and 2 more")
    '<table><thead><tr><th>t [s]</th></tr></thead><tbody><tr><td>0.1</td></tr></tbody></table>\
<p>and 2 more</p>'
    """
    grid = [list(row) for row in rows]
    kinds = grid[0] if grid else heads
    head = "".join(
        f"<th{_side(kind)}>{_text(each)}</th>" for each, kind in zip(heads, kinds, strict=True)
    )
    body = "".join(
        f"<tr>{''.join(f'<td{_side(each)}>{_text(each)}</td>' for each in row)}</tr>"
        for row in grid
    )
    whole = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return (paragraph(caption) if caption else "") + whole + (paragraph(more) if more else "")


def paragraph(text: str) -> str:
    """Return a paragraph with a text, escaped."""
    return f"<p>{_text(text)}</p>"


def listing(text: str) -> str:
    """Return a text in a fixed-width font, line by line, escaped."""
    return f'<pre style="line-height:1.3">{escape(visible_lines(text))}</pre>'


def _side(value: object) -> str:
    return ' style="text-align:left"' if isinstance(value, str) else ""  # numbers: right


def _text(value: object) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return escape(cut(visible_lines(text), LONGEST))
