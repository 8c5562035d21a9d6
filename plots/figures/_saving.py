"""Saves figures."""

from __future__ import annotations

import re
from io import BytesIO
from pathlib import Path

from gms_fsm._files import written_whole
from gms_fsm.errors import OutputError
from plots._matplotlib import Figure, rc_context
from plots.style import RC

__all__ = ["save"]

FORMATS = ("png", "svg", "pdf")


def save(figure: Figure, path: str | Path) -> Path:
    """Write a figure; the suffix chooses the format.

    Parameters
    ----------
    figure : Figure
        What.
    path : str or Path
        Ends in ``.png``, ``.svg`` or ``.pdf``.

    Returns
    -------
    Path
        The file, written whole.

    Raises
    ------
    OutputError
        If the ending is another, or the folder cannot be written.
    """
    path = Path(path)
    ending = path.suffix[1:].lower()
    if ending not in FORMATS:
        raise OutputError(f"{path}: a figure is saved as .png, .svg or .pdf, not {path.suffix!r}")
    buffer = BytesIO()
    with rc_context(RC):
        stamp = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(ending, {})
        figure.savefig(buffer, format=ending, metadata=stamp)
    picture = buffer.getvalue()
    if ending == "svg":
        picture = _named_clips(picture)
    return written_whole(path, lambda file: file.write(picture))


def _named_clips(svg: bytes) -> bytes:
    """Return an SVG with its clips numbered, so that the same trace gives the same file.

    matplotlib names them by a hash of their corners, which the layout finds to 13 digits only.
    """
    names: dict[bytes, bytes] = {}

    def name(match: re.Match[bytes]) -> bytes:
        return names.setdefault(match[0], b"clip%d" % len(names))

    return re.sub(rb'(?<=[#"])p[0-9a-f]{10}(?=[")])', name, svg)
