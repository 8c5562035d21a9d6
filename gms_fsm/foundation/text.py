r"""Texts of users on their way out: to a terminal, into a file, a picture, a comment, Markdown.

A title or a name may come from anyone. A control code in it could move a terminal's cursor, end a
comment or make an SVG malformed; a bidirectional mark shows code in another order than it has. So
they leave as escapes that can be read: ESC as ``\u001b``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

# Control codes but tab and line feed, bidirectional and other invisible marks, line separators, and
# the two that XML forbids. A surrogate cannot be encoded at all; that is an error of its own.
_UNSEEN = re.compile(
    "[\0-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff"
    "\ufff9-\ufffb\ufffe\uffff\U000e0000-\U000e007f]"
)


def visible(text: str) -> str:
    r"""Return a text on one line in which all that cannot be seen is an escape.

    White space becomes a space, character by character: indentation stays.

    Examples
    --------
    >>> print(visible("a title\nof \x1b[31mtwo lines"))
    a title of \u001b[31mtwo lines
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else " " if c.isspace() else _escape(c) for c in text)


def visible_lines(text: str) -> str:
    r"""Return a text of several lines in which control codes and invisible marks are escapes.

    Examples
    --------
    >>> print(visible_lines("x = 1  # \u202e\ny = 2"))
    x = 1  # \u202e
    y = 2
    """
    return _UNSEEN.sub(lambda match: _escape(match[0]), text)


def referenced(xml: str) -> str:
    """Return XML whose control codes and invisible marks are references: readers give them back."""
    return _UNSEEN.sub(lambda match: f"&#{ord(match[0])};", xml)


def encoded(text: str) -> bytes:
    """Return the bytes of a text that leaves the program."""
    return visible_lines(text).encode()


def _escape(character: str) -> str:
    """Return the escape that Python, C, JavaScript, JSON and TOML have in common."""
    code = ord(character)
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def plain(text: str) -> str:
    r"""Return Markdown that displays a text literally.

    Examples
    --------
    >>> print(plain("F_c < 2 N, *new* ![x](y)"))
    F_c &lt; 2 N, \*new\* !\[x\](y)
    """
    lines = []
    for line in text.splitlines():
        shown = re.sub(r"[\\`*\[\]|~$#]", r"\\\g<0>", visible(line).strip())
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
