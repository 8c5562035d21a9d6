"""Lines of text whose parts have roles, such as ``true`` or ``fired``; a palette gives colours.

Whatever a role's colour says is also said by a word, a mark or the weight of a line.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from rich.text import Text

from gms_fsm.foundation.text import visible
from plots.style import ROLES, Theme, colour

STATES = 6  # looks of states; the ribbons' marks repeat in the same rhythm


class Span(NamedTuple):
    """A part of a line, and its role."""

    text: str
    role: str = ""


Line = Sequence[Span]


class PanelLine(NamedTuple):
    """A line of a panel, and the command that a click on it gives; empty for none."""

    line: Line
    command: str = ""


def _palette(theme: Theme) -> Mapping[str, str]:
    """Return the looks of the roles, in the colours of all pictures (`docs/colours.md`)."""
    ink, now = colour("ink", theme), colour("now text", theme)
    states = ROLES["hatches"].colours(theme)
    return {
        "": ink,
        "dim": colour("soft", theme),
        "head": f"bold {ink}",
        "true": colour("holds", theme),
        "false": colour("fails", theme),
        "fired": f"bold {now}",
        "active": f"bold {colour('active', theme)}",
        "now": f"bold {colour('paper', theme)} on {now}",
        **{f"state{i}": states[min(i, len(states) - 1)] for i in range(STATES)},
    }


DARK, LIGHT = _palette("dark"), _palette("light")


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
            text.append(visible(span.text), palette[span.role])
    return text


def state_role(index: int) -> str:
    """Return the role of a state by its place in the chart."""
    return f"state{index % STATES}"
