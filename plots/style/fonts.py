"""The two fonts of all pictures, which are shipped: their widths and characters, read from them.

A layout uses these widths and not those of the fonts that are installed, so that a picture has the
same size on every machine. DejaVu Sans and DejaVu Sans Mono are also the fonts of matplotlib.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from struct import unpack_from

FOLDER = Path(__file__).parent / "typefaces"

_FAR_EAST = {True: 1.204, False: 1.0}  # sizes of the font; width where another font stands in


def width(text: str, size: float, *, mono: bool = True, bold: bool = True) -> float:
    """Return the width of a text.

    Examples
    --------
    >>> width("v > v_c", 10), width("slip", 10, mono=False)
    (42.14, 19.97)
    """
    advances = _advances(f"DejaVuSans{'Mono' * mono}{'-Bold' * bold}.ttf")
    return round(sum(_advance(c, advances, mono) for c in text) * size, 2)


def _advance(character: str, advances: Mapping[int, float], mono: bool) -> float:
    if unicodedata.combining(character):
        return 0.0
    if unicodedata.east_asian_width(character) in "WF":
        return _FAR_EAST[mono]
    return advances.get(ord(character), advances[ord("W")])


def missing_glyphs(text: str) -> list[str]:
    """Return the characters of a text that the font of formulas does not have, each once.

    Examples
    --------
    >>> missing_glyphs("Δζ ≥ 力")
    ['力']
    """
    known = _advances("DejaVuSansMono.ttf")
    return [c for c in dict.fromkeys(text) if ord(c) not in known]


@cache
def _advances(name: str) -> dict[int, float]:
    """Return the width of every character of a font, in sizes of the font."""
    data = (FOLDER / name).read_bytes()
    (count,) = unpack_from(">H", data, 4)
    records = (unpack_from(">4s4xL4x", data, 12 + 16 * k) for k in range(count))
    tables = dict(records)
    (em,) = unpack_from(">H", data, tables[b"head"] + 18)
    (full,) = unpack_from(">H", data, tables[b"hhea"] + 34)
    widths = unpack_from(f">{2 * full}H", data, tables[b"hmtx"])[::2]
    start = tables[b"cmap"]
    (count,) = unpack_from(">H", data, start + 2)
    places = (unpack_from(">HHL", data, start + 4 + 8 * k) for k in range(count))
    # Platform 3, encoding 10 is all of Unicode: groups of characters with glyphs in a row.
    (segments,) = (start + place for *kind, place in places if kind == [3, 10])
    (count,) = unpack_from(">L", data, segments + 12)
    groups = (unpack_from(">3L", data, segments + 16 + 12 * k) for k in range(count))
    return {
        code: widths[min(glyph + code - begin, full - 1)] / em
        for begin, end, glyph in groups
        for code in range(begin, end + 1)
    }
