"""Labels of Graphviz with fixed sizes: every piece of text has a cell of its own.

The width of a cell comes from `plots.style.fonts`, not from Graphviz, so that a picture has the
same sizes wherever it is drawn. In the SVG a piece is one text, in this order.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from math import ceil

from gms_fsm.foundation.text import visible
from plots.charts.labels import Piece, Row, escape
from plots.style import MONO, SANS, ChartTheme
from plots.style.fonts import width

PLAIN = 10  # points, of formulas
LEAST = 7  # points, of every text but an index
SMALLER = 0.72  # a lowered index
LINE, TITLE = 1.4, 1.5  # height of a line, in sizes of its font
SIDE = 6  # left and right of the text of a state
WIDER = 1.07  # the smallest texts in pictures of pixels: Graphviz puts letters at whole ones

# Of a role: size, face, bold, secondary.
_FACES = {
    "title": (12, SANS, True, False),
    "among": (12, SANS, True, False),
    "dot": (12, SANS, False, False),
    "region": (13, SANS, True, False),
    "note": (10, SANS, False, True),
    "count": (9, SANS, False, True),
    "never": (9, SANS, True, False),
    "priority": (PLAIN, MONO, True, False),
    "word": (PLAIN, MONO, False, True),
}
_FORMULA = (PLAIN, MONO, False, False)


@dataclass(frozen=True)
class Label:
    """An HTML label of Graphviz, and its size.

    Parameters
    ----------
    html : str
        A table, with the angle brackets around it.
    width, height : int
        Points.
    """

    html: str
    width: int
    height: int


@dataclass(frozen=True)
class CellWriter:
    """Sets rows of pieces as tables.

    Parameters
    ----------
    colours : ChartTheme
        The theme.
    scale : float
        Size of all texts, 1 for the usual one.
    joined : bool
        Whether pieces that look alike are one text; a picture of pixels rounds the width of each.
    """

    colours: ChartTheme
    scale: float = 1.0
    joined: bool = False

    def text(self, rows: Sequence[Row]) -> Label:
        """Set lines of text below one another."""
        heights = [self._height(row) for row in rows]
        wide = max(self._width(row) for row in rows) + 2
        body = "".join(map(self._row, rows, heights, [wide] * len(rows)))
        return Label(f"<{_table('', wide, sum(heights), body)}>", wide, sum(heights))

    def guard(self, rows: Sequence[Row], marked: bool = False) -> Label:
        """Set the label of an edge: the priority in a column of its own, then the lines."""
        pad = SIDE - 1 if marked else 0
        first = pad + max(self._width(row[:1]) for row in rows) + 2
        heights = [self._height(row) for row in rows]
        wide = first + max(self._width(row[1:]) for row in rows) + pad + 2
        body = "".join(
            self._row([Piece("", "pad"), *row] if marked else row, height, wide, first)
            for row, height in zip(rows, heights, strict=True)
        )
        look = f'BGCOLOR="{self.colours.paper}" '
        tall = sum(heights) + 2
        if marked:
            look += f'BORDER="1" COLOR="{self.colours.ink}" '
            body = body.replace(f'WIDTH="{wide}"', f'WIDTH="{wide - 2}"')
        return Label(f"<{_table(look, wide, tall, body)}>", wide, tall)

    def state(
        self,
        rows: Sequence[Row],
        marked: bool = False,
        least: tuple[float, float] = (0, 0),
        *,
        inside: bool = False,
    ) -> Label:
        """Set the box of a state: its title, and below a rule the other rows, with one indent.

        What is spare is above and below these; with states inside all of it is below, and what is
        drawn there is seen through it.
        """
        heights = [self._height(row) for row in rows]
        small = PLAIN * self.scale <= LEAST
        text = ceil(max(map(self._width, rows)) * (WIDER if small else 1))
        wide = max(text, 36) + 2 * SIDE + 2
        ink, border = self.colours.ink, 3 if marked else 1
        tall = sum(heights) + 4 + 2 * border
        wide += 2 * border - 2
        wide, tall = max(wide, ceil(least[0])), max(tall, ceil(least[1]))
        inner = wide - 2 * border
        title, *more = (
            self._row([Piece("", "pad"), *row], height, inner, ground=inside)
            for row, height in zip(rows, heights, strict=True)
        )
        ground = "" if inside else f'BGCOLOR="{self.colours.paper}" '
        look = f'BORDER="{border}" COLOR="{ink}" {ground}STYLE="ROUNDED" '
        ruled = inside or bool(more)
        spare = tall - sum(heights) - 2 * border - ruled
        top = 0 if inside else spare // 2
        above, below = (
            f'<TR><TD HEIGHT="{room}"></TD></TR>' * bool(room) for room in (top, spare - top)
        )
        texts = "".join(more)
        body = f"{title}<HR/>{above}{texts}{below}" if ruled else f"{above}{title}{below}"
        return Label(f"<{_table(look, wide, tall, body)}>", wide, tall)

    def _row(
        self, row: Row, height: int, wide: int, first: int = 0, *, ground: bool = False
    ) -> str:
        """Return one line as a row of a table; its pieces are a table in it."""
        cells, at = "", 0.0
        for i, piece in enumerate(self._pieces(row)):
            end = at + self._piece_width(piece)
            if i == (row[0].role == "pad") and first:
                end = first
            cells += self._cell(piece, max(round(end) - round(at), 1), height, ground)
            at = max(end, at + 1)
        # Graphviz would spread the cells over the line: the last one fills it.
        cells += f"<TD {_size(wide - round(at), height)}></TD>"
        inner = _table("", wide, height, f"<TR>{cells}</TR>")
        return f"<TR><TD {_size(wide, height)}>{inner}</TD></TR>"

    def _pieces(self, row: Row) -> Row:
        if not self.joined:
            return row
        alike = groupby(row, lambda piece: (_FACES.get(piece.role, _FORMULA), piece.lowered))
        groups = (list(group) for _, group in alike)
        return [replace(each[0], text="".join(piece.text for piece in each)) for each in groups]

    def _cell(self, piece: Piece, wide: int, height: int, ground: bool) -> str:
        size = _size(wide, height)
        size += f' BGCOLOR="{self.colours.paper}"' if ground else ""
        if piece.role == "pad":
            return f"<TD {size}></TD>"
        _, face, bold, soft = _FACES.get(piece.role, _FORMULA)
        points = self._points(piece)
        words = escape(piece.text)
        words = f"<B>{words}</B>" if bold else words
        colour = self.colours.soft if soft else self.colours.ink
        place = ' VALIGN="BOTTOM"' if piece.lowered else ""
        return (
            f'<TD ALIGN="LEFT"{place} {size}><FONT FACE="{face}" POINT-SIZE="{points}" '
            f'COLOR="{colour}">{words}</FONT><BR ALIGN="LEFT"/></TD>'
        )

    def _width(self, row: Iterable[Piece]) -> int:
        return ceil(sum(map(self._piece_width, row)))

    def _piece_width(self, piece: Piece) -> float:
        if piece.role == "pad":
            return SIDE - 1
        _, face, bold, _ = _FACES.get(piece.role, _FORMULA)
        return width(visible(piece.text), self._points(piece), mono=face == MONO, bold=bold)

    def _points(self, piece: Piece) -> int:
        """Return the size of a text; Graphviz takes whole points only."""
        size = max(_FACES.get(piece.role, _FORMULA)[0] * self.scale, LEAST)
        return int(size * (SMALLER if piece.lowered else 1))

    def _height(self, row: Row) -> int:
        sizes = [(_FACES.get(piece.role, _FORMULA)[0], piece.role) for piece in row] or [(0, "")]
        size, role = max(sizes)
        return ceil(size * self.scale * (TITLE if role in ("title", "region") else LINE))


def _table(look: str, wide: int, tall: int, body: str) -> str:
    border = "" if "BORDER" in look else 'BORDER="0" '
    return (
        f'<TABLE {look}{border}CELLBORDER="0" CELLSPACING="0" CELLPADDING="0" '
        f"{_size(wide, tall)}>{body}</TABLE>"
    )


def _size(wide: int, tall: int) -> str:
    return f'FIXEDSIZE="TRUE" WIDTH="{max(wide, 1)}" HEIGHT="{tall}"'
