"""The tables of a scenario or chart file and their lines: where an edge is written."""

from __future__ import annotations

import itertools
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from gms_fsm.foundation.toml import text_of

_HEAD = re.compile(r"\s*\[\[?\s*([\w.\s\"'-]+?)\s*\]\]?\s*(?:#.*)?")
_LONG_TEXT = re.compile(r'"""[\s\S]*?"""|' + r"'''[\s\S]*?'''")
OWNERS = ("contact", "supervisor")


@dataclass(frozen=True)
class TableLines:
    """A table of a file, with its lines counted from 1.

    Parameters
    ----------
    path : Path
        The file.
    first, last : int
        Its lines.
    kind : str
        The last part of its head: ``"edge"``, ``"state"``, ``"contact"``.
    name : str
        The name that it gives; empty if it gives none.
    contact : str
        The contact or supervisor to which it belongs; empty if that is not known.
    """

    path: Path
    first: int
    last: int
    kind: str
    name: str
    contact: str


def tables_of(path: Path, contact: str = "") -> Iterator[TableLines]:
    """Yield the tables of a file, and those of the chart files that its contacts name."""
    # A long text becomes an empty one on as many lines, so that nothing inside is a head.
    text = _LONG_TEXT.sub(lambda found: '""' + "\n" * found[0].count("\n"), text_of(path))
    lines = text.split("\n")
    heads = [(i, found[1]) for i, line in enumerate(lines) if (found := _HEAD.fullmatch(line))]
    for (begin, head), (end, _) in itertools.pairwise([*heads, (len(lines), "")]):
        kind = head.rpartition(".")[2].strip("\"' ")
        own = _keys("\n".join(lines[begin + 1 : end]))
        if head in OWNERS:
            contact = str(own.get("name", ""))
        while not lines[end - 1].strip():  # blank lines belong to no table
            end -= 1
        yield TableLines(path, begin + 1, end, kind, str(own.get("name", "")), contact)
        chart = path.parent / str(own.get("chart", ""))
        if head in OWNERS and chart.suffix == ".toml" and chart.is_file():
            yield from tables_of(chart, contact)


def _keys(text: str) -> dict[str, object]:
    """Return the keys of a table; none if it cannot be read alone."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError):
        return {}
