"""The widgets of the full-screen debugger: panels that can be clicked, and the command line."""

# ruff: noqa: E402  require() must come before the imports that it checks

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from gms_fsm.foundation.extras import require

require("textual", "tui")

from rich.text import Text
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import ScrollableContainer
from textual.message import Message
from textual.screen import ModalScreen
from textual.widgets import Input, Static

from gms_fsm.debugger.tui._spans import PanelLine, painted


class Panel(ScrollableContainer, can_focus=True, inherit_bindings=False):
    """Lines in a frame; a click on a line gives its command."""

    BINDINGS: ClassVar = [
        Binding("pageup", "page_up", show=False),
        Binding("pagedown", "page_down", show=False),
    ]

    class Chosen(Message):
        """A line was clicked, or a time in the ribbons."""

        def __init__(self, command: str) -> None:
            super().__init__()
            self.command = command

    def __init__(self, title: str, name: str) -> None:
        super().__init__(id=name)
        self.border_title = title
        self.body = Static(expand=True)
        self.rows: Sequence[PanelLine] = ()

    def compose(self) -> ComposeResult:
        """Add the text."""
        yield self.body

    @property
    def columns(self) -> int:
        """Columns for text, with a gap before the scroll bar."""
        return max(10, self.outer_size.width - self.styles.gutter.width - 2)

    def show(self, rows: Sequence[PanelLine], palette: Mapping[str, str]) -> None:
        """Show lines instead of those shown."""
        self.rows = rows
        self.body.update(painted([row.line for row in rows], palette))

    @property
    def shown(self) -> str:
        """The text shown."""
        return "\n".join("".join(span.text for span in row.line) for row in self.rows)

    def keep_visible(self, row: int) -> None:
        """Scroll so that a line is in the middle, if it is not visible."""
        top, height = self.scroll_offset.y, self.scrollable_content_region.height
        if not top <= row < top + height:
            self.scroll_to(y=max(0, row - height // 2), animate=False)

    def on_click(self, event: events.Click) -> None:
        """Give the command of the line."""
        if event.widget is self.body and 0 <= event.y < len(self.rows):
            self.chosen(event.x, event.y)

    def chosen(self, column: int, row: int) -> None:  # noqa: ARG002 (used by Ribbon)
        """Give the command at a place."""
        if command := self.rows[row].command:
            self.post_message(self.Chosen(command))


class Ribbon(Panel):
    """States over time: a click goes to the time."""

    lead, span, parts = 0, (0.0, 1.0), 1

    def chosen(self, column: int, row: int) -> None:  # noqa: ARG002 (the time is the column's)
        """Go to the time of a column."""
        part = column - self.lead
        if 0 <= part < self.parts:
            start, end = self.span
            t = start + (end - start) * (part + 0.5) / self.parts
            self.post_message(self.Chosen(f"goto {t:.6g}"))


class Keys(Static):
    """The keys, as many as there is room for; each can be clicked."""

    def __init__(self) -> None:
        super().__init__(id="keys")
        self.places: list[tuple[int, int, str]] = []

    def show(
        self, keys: Sequence[tuple[str, str, str]], last: int, palette: Mapping[str, str]
    ) -> None:
        """Show (key, label, action) triples; the last ones always."""
        room = self.size.width - sum(_long(each) for each in keys[len(keys) - last :])
        kept: list[tuple[str, str, str]] = []
        for each in keys[: len(keys) - last]:
            if _long(each) > room:
                break
            room -= _long(each)
            kept.append(each)
        text, self.places, column = Text(no_wrap=True, end=""), [], 0
        for key, label, action in [*kept, *keys[len(keys) - last :]]:
            text.append(f" {key}", palette["head"])
            text.append(f" {label} ", palette[""])
            self.places.append((column, column + _long((key, label, action)), action))
            column = self.places[-1][1]
        self.update(text)

    async def on_click(self, event: events.Click) -> None:
        """Do what the key does."""
        for left, right, action in self.places:
            if left <= event.x < right:
                await self.app.run_action(action)


def _long(key: tuple[str, str, str]) -> int:
    return len(key[0]) + len(key[1]) + 3


class Prompt(Input):
    """The command line: history with the arrow keys, completion with Tab."""

    BINDINGS: ClassVar = [
        Binding("up", "earlier", show=False),
        Binding("down", "later", show=False),
        Binding("tab", "complete", show=False, priority=True),
        Binding("escape", "leave", show=False),
    ]

    class Completing(Message):
        """Several words are possible."""

        def __init__(self, words: Sequence[str]) -> None:
            super().__init__()
            self.words = words

    def __init__(self, complete: Callable[[str, str], list[str]]) -> None:
        super().__init__(id="prompt", compact=True, select_on_focus=False)
        self.complete = complete
        self.history: list[str] = []
        self.place = 0

    def remember(self, line: str) -> None:
        """Add a line to the history."""
        if line and self.history[-1:] != [line]:
            self.history.append(line)
        self.place = len(self.history)

    def action_earlier(self) -> None:
        """Show the command before."""
        self._recall(-1)

    def action_later(self) -> None:
        """Show the command after."""
        self._recall(1)

    def _recall(self, step: int) -> None:
        self.place = min(len(self.history), max(0, self.place + step))
        self.write([*self.history, ""][self.place])

    def write(self, text: str) -> None:
        """Replace the text and go to its end."""
        self.value, self.cursor_position = text, len(text)

    def action_complete(self) -> None:
        """Complete the word before the cursor as far as it is clear."""
        typed = self.value[: self.cursor_position]
        begin = 1 + max(typed.rfind(" "), typed.rfind("="))
        words = self.complete(typed[begin:], typed[:begin])
        common = _common(words)
        end = " " if len(words) == 1 and not common.endswith("=") else ""
        if words:
            self.write(typed[:begin] + common + end)
        self.post_message(self.Completing(words if len(words) != 1 else ()))

    def action_leave(self) -> None:
        """Give the keys back to the panels."""
        self.value = ""
        self.screen.set_focus(None)
        self.post_message(self.Completing(()))


def _common(words: Sequence[str]) -> str:
    """Return the longest common beginning.

    >>> _common(["break_away_forward", "break_away_backward"]), _common([])
    ('break_away_', '')
    """
    if not words:
        return ""
    first, last = min(words), max(words)
    same = next(
        (i for i, (a, b) in enumerate(zip(first, last, strict=False)) if a != b),
        min(len(first), len(last)),
    )
    return first[:same]


class Help(ModalScreen[None]):
    """The keys and the commands."""

    BINDINGS: ClassVar = [
        Binding("escape,q,question_mark,enter", "dismiss", "close"),
        Binding("up", "scroll(-1)", show=False),
        Binding("down", "scroll(1)", show=False),
    ]

    def __init__(self, rows: Sequence[PanelLine], palette: Mapping[str, str]) -> None:
        super().__init__()
        self.panel, self.lines, self.palette = Panel("help (Esc closes)", "help"), rows, palette

    def compose(self) -> ComposeResult:
        """Add the text."""
        yield self.panel

    def on_mount(self) -> None:
        """Show the text."""
        self.panel.show(self.lines, self.palette)
        self.panel.focus()

    def action_scroll(self, rows: int) -> None:
        """Scroll by lines."""
        self.panel.scroll_relative(y=rows, animate=False)
