"""Lines of text whose parts have roles, such as ``true`` or ``fired``; a palette gives colours.

Whatever a role's colour says is also said by a word, a mark or the weight of a line.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from rich.text import Text

STATES = 6  # colours of states; the ribbons' marks repeat in the same rhythm


class Span(NamedTuple):
    """A part of a line, and its role."""

    text: str
    role: str = ""


Line = Sequence[Span]


class PanelLine(NamedTuple):
    """A line of a panel, and the command that a click on it gives; empty for none."""

    line: Line
    command: str = ""


# The colours of states are those of Okabe and Ito, darker on a light ground.
DARK: Mapping[str, str] = {
    "": "#e2e6ea",
    "dim": "#9aa5b1",
    "head": "bold #e2e6ea",
    "true": "#7ddc9c",
    "false": "#ff9d8a",
    "fired": "bold #ffd75e",
    "active": "bold #6cc4f5",
    "now": "bold #ffffff on #b3400f",
    "chosen": "bold #ffffff on #1f4e79",
    "error": "bold #ff9d8a",
    "command": "bold #6cc4f5",
    "state0": "#6cc4f5",
    "state1": "#f0b040",
    "state2": "#4fd0a5",
    "state3": "#e59ac5",
    "state4": "#f0e05a",
    "state5": "#b8a9ff",
}
LIGHT: Mapping[str, str] = {
    "": "#1b2530",
    "dim": "#55606c",
    "head": "bold #1b2530",
    "true": "#0b6b33",
    "false": "#a52a12",
    "fired": "bold #7a4b00",
    "active": "bold #00558f",
    "now": "bold #ffffff on #b3400f",
    "chosen": "bold #ffffff on #1f4e79",
    "error": "bold #a52a12",
    "command": "bold #00558f",
    "state0": "#00558f",
    "state1": "#8a5200",
    "state2": "#00664a",
    "state3": "#8f2f6b",
    "state4": "#6b5f00",
    "state5": "#5a46b8",
}


def line(*parts: str | tuple[str, str]) -> Line:
    """Return a line of texts and of (text, role) pairs.

    >>> plain([line("z ", ("true", "true"))])
    'z true'
    """
    return tuple(Span(part) if isinstance(part, str) else Span(*part) for part in parts)


def plain(lines: Iterable[Line]) -> str:
    """Return the text alone."""
    return "\n".join("".join(span.text for span in each) for each in lines)


def painted(lines: Iterable[Line], palette: Mapping[str, str]) -> Text:
    """Return lines in the colours of a palette; they are never wrapped.

    >>> painted([line(("no", "false"))], DARK).plain
    'no'
    """
    text = Text(no_wrap=True, overflow="crop", end="")
    for number, each in enumerate(lines):
        if number:
            text.append("\n")
        for span in each:
            text.append(span.text, palette[span.role])
    return text


def state_role(index: int) -> str:
    """Return the role of a state by its place in the chart."""
    return f"state{index % STATES}"
