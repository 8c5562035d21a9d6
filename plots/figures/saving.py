"""Figures as bytes, the same for the same trace."""

from __future__ import annotations

import re
from collections.abc import Mapping
from io import BytesIO

from gms_fsm.foundation.text import visible_lines
from plots.figures._layout import aligned
from plots.style import RC
from plots.style.matplotlib import Figure, Text, rc_context


def picture(figure: Figure, form: str, metadata: Mapping[str, None]) -> bytes:
    """Return a figure as bytes."""
    for each in figure.findobj(Text):
        written, shown = each.get_text(), visible_lines(each.get_text())
        if shown != written:  # matplotlib writes it into a comment of an SVG, too
            each.set(text=shown, parse_math=False)
    aligned(figure)
    buffer = BytesIO()
    # A journal's PDF has fonts that can be selected and edited: TrueType, Type 42.
    with rc_context(RC | {"pdf.fonttype": 42}):
        dpi = max(figure.dpi, RC["savefig.dpi"])
        figure.savefig(buffer, format=form, metadata=metadata, dpi=dpi)
    return _named_clips(buffer.getvalue()) if form == "svg" else buffer.getvalue()


def _named_clips(svg: bytes) -> bytes:
    """Return an SVG with its clip paths numbered, so that the same trace gives the same file.

    matplotlib names them by a hash of their corners, but the layout is reproducible only to 13
    digits.
    """
    names: dict[bytes, bytes] = {}

    def name(match: re.Match[bytes]) -> bytes:
        return names.setdefault(match[0], b"clip%d" % len(names))

    return re.sub(rb'(?<=[#"])p[0-9a-f]{10}(?=[")])', name, svg)
