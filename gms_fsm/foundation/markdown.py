"""Markdown of reports: texts that display literally, and tables."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence


def plain(text: str) -> str:
    r"""Return Markdown that displays a text literally.

    Examples
    --------
    >>> print(plain("F_c < 2 N, *new* ![x](y)"))
    F_c &lt; 2 N, \*new\* !\[x\](y)
    """
    lines = []
    for line in text.splitlines():
        shown = "".join(c if c.isprintable() else " " for c in line).strip()
        shown = re.sub(r"[\\`*\[\]|~$#]", r"\\\g<0>", shown)
        shown = re.sub(
            r"(?<![^\W_])_|_(?![^\W_])", r"\\_", shown
        )  # but not in F_c, which needs none
        shown = shown.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
        lines.append(re.sub(r"^(\d*)([-+=.)])", r"\1\\\2", shown))  # a list, a rule, a heading
    return "\n".join(lines)


def table_lines(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return the lines of a table.

    Examples
    --------
    >>> table_lines(["name", "N"], [["F_c", "1.5"]])
    ['| name | N |', '| --- | --- |', '| F_c | 1.5 |']
    """
    return ["| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows]]
