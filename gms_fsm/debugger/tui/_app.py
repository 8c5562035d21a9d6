"""The full-screen debugger: panels on the view model, keys and clicks that give commands."""

# ruff: noqa: E402  require() must come before the imports that it checks

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

from gms_fsm.foundation.extras import require
from gms_fsm.foundation.text import visible

require("textual", "tui")

from rich.text import Text
from textual import events, on
from textual.app import App, ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.theme import Theme
from textual.widgets import Input, Static

from gms_fsm.debugger._commands import Commands
from gms_fsm.debugger._help import overview
from gms_fsm.debugger._over_time import curves, ribbons
from gms_fsm.debugger._over_time import events as events_of
from gms_fsm.debugger._text import DRAWN, labels
from gms_fsm.debugger._view import Screen, branches, chart_states, view
from gms_fsm.debugger.tui import _guards, _time
from gms_fsm.debugger.tui import _panels as drawn
from gms_fsm.debugger.tui._chart import chart_art
from gms_fsm.debugger.tui._keys import KEYS, help_rows, with_number
from gms_fsm.debugger.tui._spans import DARK, LIGHT, PanelLine, line, painted
from gms_fsm.debugger.tui._widgets import Help, Keys, Panel, Prompt, Ribbon
from gms_fsm.session.session import Session
from plots.style import THEMES, colour

GROUNDS = {
    f"gms-{theme}": Theme(
        f"gms-{theme}",
        primary=colour("soft", theme),
        foreground=colour("ink", theme),
        background=colour("paper", theme),
        surface=colour("panel", theme),
        dark=theme == "dark",
    )
    for theme in THEMES
}
TITLES = {"events": "transitions", "why": "why (margins: log scale)"}
LARGE = (120, 36)  # columns and rows from which all panels are shown at once
PAGES, LISTS, ANSWERS = 3, 1, 2  # pages of a smaller terminal; those of lists and of answers
ELEMENTS = 0.4  # the most of the height that elements take on their page
RIBBONS, LOWER = 0.3, 8  # the most of the height that ribbons take; rows of the lower panels
TRANSCRIPT = 2000  # lines
SLOW = 0.2  # s, after which a command is reported as still working


class FullScreen(App[int]):
    """The application.

    Parameters
    ----------
    session : Session
        The session.
    title : str
        What runs.
    light : bool
        Whether to begin with a light ground.
    """

    CSS_PATH = "tui.tcss"
    ENABLE_COMMAND_PALETTE = False
    AUTO_FOCUS = ""
    BINDINGS: ClassVar = [
        *(Binding(each.names, each.action, each.says, show=False) for each in KEYS),
        *(Binding(digit, f"digit('{digit}')", show=False) for digit in "0123456789"),
        Binding("full_stop", "digit('.')", show=False),
        Binding("backspace", "digit('')", show=False),
        Binding("home", "command('goto {start}')", show=False),
        Binding("end", "command('goto {end}')", show=False),
        Binding("escape", "stop", show=False),
        Binding("ctrl+c", "interrupt", show=False, priority=True),
    ]

    def __init__(self, session: Session, title: str = "", *, light: bool = False) -> None:
        super().__init__()
        self.commands = Commands(session, DRAWN, follow=True)
        self.heading = title
        self.number = ""  # typed before a key
        self.page = self.highest = 0  # the page shown; the most rows of the upper panels
        self.zoom: float | None = None  # s, shown in the ribbons; None for the whole run
        self.said: list[str] = [session.title]  # the transcript
        self.last = 0  # line of the transcript at which the last answer begins
        self.waiting: deque[str] = deque()
        self.busy = self.stopping = False
        self.seen: Screen = view(session)
        names = ("chart", "elements", "why", "events", "session", "answers")
        self.panels = {name: Panel(TITLES.get(name, name), name) for name in names}
        self.ribbon, self.top = Ribbon("states over time", "ribbons"), Horizontal(id="top")
        self.status, self.lead = Static(id="status"), Static(id="lead")
        self.prompt, self.keys, self.small = Prompt(self._complete), Keys(), False
        for theme in GROUNDS.values():
            self.register_theme(theme)
        self.theme = "gms-light" if light else "gms-dark"

    # ------------------------------------------------------------------ layout
    def compose(self) -> ComposeResult:
        """Make the panels."""
        panels = self.panels
        yield self.status
        with Vertical(id="body"):
            with self.top:
                yield panels["chart"]
                with Vertical(id="right"):
                    yield panels["elements"]
                    yield panels["why"]
            yield self.ribbon
            with Horizontal(id="bottom"):
                yield panels["events"]
                yield panels["session"]
                yield panels["answers"]
        with Horizontal(id="line"):
            yield self.lead
            yield self.prompt
        yield self.keys

    def on_mount(self) -> None:
        """Draw, with no panel in focus."""
        self.screen.set_focus(None)
        self._arrange()

    def on_resize(self, event: events.Resize) -> None:
        """Lay out for the new size."""
        self._arrange(event.size.width, event.size.height)

    def _arrange(self, width: int = 0, height: int = 0) -> None:
        width, height = width or self.size.width, height or self.size.height
        self.small = width < LARGE[0] or height < LARGE[1]
        screen = self.screen_stack[0]
        screen.set_class(self.small, "small")
        for page in range(PAGES):
            screen.set_class(self.small and page == self.page, f"page{page}")
        self.call_after_refresh(self.draw)

    @property
    def palette(self) -> Mapping[str, str]:
        """The colours of the roles."""
        return DARK if self.current_theme.dark else LIGHT

    # ------------------------------------------------------------------ drawing
    def draw(self) -> None:
        """Draw everything."""
        if self.busy:
            return
        self.seen = view(self.commands.session)
        self._draw_status()
        for name, rows in self._contents().items():
            self._show(name, rows)
        self._share_height()
        self._draw_ribbons()
        self._draw_keys()

    def _contents(self) -> dict[str, Callable[[int], Sequence[PanelLine]]]:
        """Return what each panel shows, as functions of its width."""
        commands, session, element = self.commands, self.commands.session, self.commands.element
        address = commands.elements.short(element)
        watches = list(commands.answer("watch", "")) if session.watches else []
        return {
            "chart": self._chart,
            "elements": lambda width: drawn.element_rows(self.seen, element, width),
            "why": lambda width: _guards.why_rows(
                session.why(commands.elements.address(element)),
                address,
                session.breakpoints,
                width,
            ),
            "events": lambda width: drawn.event_rows(
                events_of(session, ahead=True), self.seen.row, width
            ),
            "session": lambda width: drawn.session_rows(
                branches(session), session.breakpoints, watches, width
            ),
            "answers": self._answers,
        }

    def _share_height(self) -> None:
        """Give the upper panels the height of their contents, and the rest to the lower ones.

        The height never shrinks, so that nothing jumps from step to step.
        """
        if self.small:
            rows = len(self.panels["elements"].rows) + 1
            most = int(ELEMENTS * self.size.height)
            self.top.styles.height = min(rows, most) if self.page == LISTS else None
            self.highest = 0
            return
        size = {name: len(self.panels[name].rows) + 2 for name in ("chart", "elements", "why")}
        most = max(size["chart"], size["elements"] + size["why"])
        ribbons = min(len(self.seen.elements) + 6, int(RIBBONS * self.size.height))
        rest = self.size.height - ribbons - 3 - LOWER
        self.highest = max(self.highest, min(most, rest))
        self.top.styles.height = self.highest

    def _show(self, name: str, rows: Callable[[int], Sequence[PanelLine]]) -> None:
        panel = self.panels[name]
        if not panel.display or not panel.size.width:
            return
        try:
            panel.show(rows(panel.columns), self.palette)
        except Exception as error:  # a value that cannot be computed must not end the session
            text = f"cannot be shown here: {error}"
            panel.show([PanelLine(line((text, "head")))], self.palette)
        if name == "answers":
            self.call_after_refresh(self.call_after_refresh, self._show_last_answer, panel)
        elif name != "chart":
            marks = ("".join(span.text for span in row.line) for row in panel.rows)
            here = next((i for i, text in enumerate(marks) if text.startswith("▶")), 0)
            self.call_after_refresh(panel.keep_visible, here)

    def _show_last_answer(self, panel: Panel) -> None:
        """Scroll to the last answer, from its beginning if it is longer than the panel."""
        top = 0
        if not self.only_last:
            before = len(drawn.answer_rows(self.said[: self.last], panel.columns))
            height = panel.scrollable_content_region.height
            top = min(before, max(0, len(panel.rows) - height))
        panel.scroll_to(y=top, animate=False)

    @property
    def only_last(self) -> bool:
        """Whether there is room for two lines of answers only."""
        return self.small and self.page != ANSWERS

    def _answers(self, width: int) -> list[PanelLine]:
        """Return the transcript; where there is room for two lines, the last answer."""
        panel, begin = self.panels["answers"], 0
        panel.border_title = "answers"
        if self.only_last:
            begin = self.last
            if self.said[begin].startswith("(t="):  # the title has the command
                panel.border_title, begin = Text(visible(self.said[begin])), begin + 1
        return drawn.answer_rows(self.said[begin:], width)

    def _chart(self, width: int) -> list[PanelLine]:
        """Draw the chart of the chosen element, with the names of edges if they take no lines."""
        commands, panel = self.commands, self.panels["chart"]
        states = chart_states(commands.session, commands.element)
        name = commands.elements.name(commands.element)
        title = f"{name}: {commands.elements.chart(commands.element).name}"
        panel.border_title = Text(visible(title) if len(title) <= width - 2 else name)
        art, shorter = (chart_art(states, width, names=names) for names in (True, False))
        if len(art) > len(shorter):
            art = shorter
        active = next((i for i, each in enumerate(art) if "ACTIVE" in str(each)), 0)
        self.call_after_refresh(panel.keep_visible, active + 1)
        return [PanelLine(each) for each in art]

    def _draw_status(self) -> None:
        several = len(self.commands.session.branches) > 1
        width = self.status.outer_size.width - self.status.styles.gutter.width
        lines = drawn.status_lines(self.seen, self.heading, width, several=several, busy=self.busy)
        self.status.update(painted(lines, self.palette))
        lead = f"{self.number}" if self.number else self.commands.prompt
        if not self.busy:
            self.lead.update(painted([line((lead, "head"))], self.palette))

    def _draw_ribbons(self) -> None:
        panel = self.ribbon
        if not panel.display or not panel.size.width:
            return
        session, element = self.commands.session, self.commands.element
        states = max(len(each.state) for each in self.seen.elements)
        names = max(map(len, labels(self.seen.contacts)))
        lead = min(names, 14) + min(states, 9) + 3
        parts, span = max(10, panel.columns - lead), self.span
        shown, parent = ribbons(session, parts, span=span), session.branch.parent
        other = None if parent is None else ribbons(session, parts, branch=parent, span=span)
        rows = _time.ribbon_rows(shown, other, self.seen, element, lead)
        bank = self.commands.elements.bank(element)
        whose = f" ({bank.name})" if len(self.seen.contacts) > 1 else ""
        title = f"states over time{whose}: {'  '.join(self._key())}"
        if not self.small:
            values = curves(session, element, parts, span)
            panel.border_subtitle = _time.ranges(values, session.system.contact(bank.name).chart)
            rows = _time.curve_rows(values, lead, shown.now) + rows
        axis = " " * lead + _time.axis(*span, parts)
        panel.lead, panel.span, panel.parts = lead, span, parts
        panel.border_title = Text(visible(title))
        panel.show([*rows, PanelLine(line((axis, "dim")))], self.palette)
        self.call_after_refresh(panel.keep_visible, 0)

    def _key(self) -> list[str]:
        """Return the marks of the states, of the chosen element's chart."""
        chart = self.commands.elements.chart(self.commands.element)
        marks = DRAWN.ribbon
        return [f"{marks[i % len(marks)]} {each.name}" for i, each in enumerate(chart.states)]

    @property
    def span(self) -> tuple[float, float]:
        """Start and end of the time shown, s."""
        session = self.commands.session
        start, end = session.branches[0].raw(0).t, session.t_end
        if self.zoom is None or self.zoom >= end - start:
            return start, end
        left = min(max(start, session.here.t - self.zoom / 2), end - self.zoom)
        return left, left + self.zoom

    def _draw_keys(self) -> None:
        if self.number:
            self.keys.show(with_number(self.number), 0, self.palette)
            return
        shown = [(each.shown, each.label, each.action) for each in KEYS if each.label]
        self.keys.show(shown, 2, self.palette)

    # ------------------------------------------------------------------ commands
    def give(self, *lines: str) -> None:
        """Execute commands of the line prompt, one after the other."""
        self.waiting.extend(lines)
        self.number = ""
        if not self.busy:
            self.busy = True
            self.set_timer(SLOW, self._still_busy)
            self.run_worker(self._work, thread=True, exclusive=False)

    def _work(self) -> None:
        """Execute the commands that wait, in a thread, so that keys are still read."""
        while self.waiting:
            text = self.waiting.popleft()
            for branch in self.commands.session.branches:
                branch.on_row = self._on_row
            prompt = self.commands.prompt
            said = list(self.commands.reply(text))
            self.call_from_thread(self._answered, f"{prompt}{text}", said)
        self.call_from_thread(self._done)

    def _on_row(self) -> None:
        """Interrupt a move if the user asked for it."""
        if self.stopping:
            self.stopping = False
            raise KeyboardInterrupt

    def _answered(self, asked: str, said: Sequence[str]) -> None:
        self.last = len(self.said)
        self.said += [asked, *(part for each in said for part in each.split("\n"))]
        if len(self.said) > TRANSCRIPT:
            self.last -= len(self.said) - TRANSCRIPT
            del self.said[:-TRANSCRIPT]
        if self.commands.left:
            self.exit(0)

    def _done(self) -> None:
        self.busy = self.stopping = False
        if self.waiting:  # given while the last answer was being shown
            self.give()
        else:
            self.draw()

    def _still_busy(self) -> None:
        if self.busy:
            self._draw_status()

    @on(Panel.Chosen)
    def _clicked(self, message: Panel.Chosen) -> None:
        self.give(message.command)

    @on(Input.Submitted)
    def _typed(self, message: Input.Submitted) -> None:
        prompt = self.prompt
        text = message.value.strip() or self.commands.last_move
        prompt.remember(message.value.strip())
        prompt.action_leave()
        if text:
            self.give(text)

    @on(Prompt.Completing)
    def _completing(self, message: Prompt.Completing) -> None:
        if message.words:
            keys = [("", word, "bell") for word in message.words]
            self.keys.show(keys, 0, self.palette)
        else:
            self._draw_keys()

    def _complete(self, text: str, before: str) -> list[str]:
        return [] if self.busy else self.commands.complete(text, before)

    # ------------------------------------------------------------------ keys
    def action_digit(self, digit: str) -> None:
        """Collect a number for the next key."""
        self.number = self.number + digit if digit else self.number[:-1]
        self._draw_status()
        self._draw_keys()

    def action_command(self, text: str) -> None:
        """Execute a command."""
        start, end = self.commands.session.branch.raw(0).t, self.commands.session.t_end
        self.give(text.format(start=repr(start), end=repr(end)))

    def action_steps(self, name: str) -> None:
        """Go by rows; the number before the key is how many."""
        self.give(f"{name} {self.number}".strip())

    def action_goto(self) -> None:
        """Go to the time given by the number, or ask for one."""
        if self.number:
            self.give(f"goto {self.number}")
        else:
            self.action_prompt("goto ")

    def action_why(self) -> None:
        """Explain the chosen element, at the time given by the number, if there is one."""
        self._turn_to(0)
        why = f"why {self.commands.elements.short(self.commands.element)}"
        self.give(*([f"goto {self.number}", why] if self.number else [why]))

    def action_break(self) -> None:
        """Set a breakpoint at a guard of the chosen element, the first or the numbered one."""
        element, elements = self.commands.element, self.commands.elements
        edges = [each.edge.name for each in self.commands.session.why(elements.address(element))]
        which = int(self.number) if self.number.isdigit() else 1
        if not 1 <= which <= len(edges):
            state = self.seen.elements[element].state
            self._refuse(f"{state} has {len(edges)} edges, so there is no edge {which}")
            return
        word = "" if elements.named else "element "
        self.give(f"break valid {edges[which - 1]} {word}{elements.short(element)}")

    def action_element(self, step: int) -> None:
        """Choose an element: the numbered one, or a neighbour."""
        count = len(self.seen.elements)
        found = (self.commands.element + step) % count
        if self.number:
            found = int(self.number) - 1 if self.number.isdigit() else -1
            if not 0 <= found < count:
                self._refuse(f"there is no element {self.number}; there are 1 to {count}")
                return
        self.give(f"element {self.commands.elements.name(found).removeprefix('element ')}")

    def action_poke(self) -> None:
        """Begin a poke of the chosen element."""
        elements, element = self.commands.elements, self.commands.element
        bank = elements.bank(element)
        lead = f"{bank.name}." if elements.named else ""
        name = (*elements.chart(element).variables, "state")[0]
        self.action_prompt(f"poke {lead}{name}{element - bank.first + 1}=")

    def action_follow(self) -> None:
        """Keep the chosen element at firings of others, or follow them again."""
        self.commands.follow = not self.commands.follow
        self.notify("follows what fires" if self.commands.follow else "keeps this element")

    def action_branch(self) -> None:
        """Switch to the next branch."""
        tree = self.commands.session.tree
        numbers = list(tree.forks)
        self.give(f"branch {numbers[(numbers.index(tree.current) + 1) % len(numbers)]}")

    def action_prompt(self, text: str) -> None:
        """Go to the command line."""
        self.number = ""
        self._draw_status()
        self._draw_keys()
        prompt = self.prompt
        prompt.write(text)
        prompt.focus()

    def action_view(self) -> None:
        """Show the next page, on a small terminal."""
        self._turn_to((self.page + 1) % PAGES)

    def _turn_to(self, page: int) -> None:
        self.page, self.number = page, self.number
        self._arrange()

    def action_zoom(self, factor: float) -> None:
        """Show a shorter or a longer time."""
        start, end = self.span
        self.zoom = (end - start) * factor
        self._draw_ribbons()

    def action_ground(self) -> None:
        """Change between dark and light."""
        self.theme = "gms-light" if self.current_theme.dark else "gms-dark"
        self.draw()

    def action_help(self) -> None:
        """Show the help."""
        self.push_screen(Help(help_rows(overview(self.commands.session)), self.palette))

    def action_stop(self) -> None:
        """Interrupt a long move; forget a number."""
        self.stopping = self.busy
        self.waiting.clear()
        self.number = ""
        self._draw_status()
        self._draw_keys()

    def action_interrupt(self) -> None:
        """Interrupt a long move, or say how to leave."""
        if not self.busy:
            self.notify("q quits")
        self.action_stop()

    def action_leave(self) -> None:
        """Leave, also during a long move."""
        self.stopping = self.busy
        self.waiting.clear()
        self.exit(0)

    def _refuse(self, text: str) -> None:
        """Answer a mistake."""
        self.number = ""
        self.last = len(self.said)
        self.said.append(f"error: {text}")
        self.draw()
