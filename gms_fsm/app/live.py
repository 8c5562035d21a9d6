"""Live view of a running simulation in the terminal: the active state of every element."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from gms_fsm.run.simulate import Moment

__all__ = ["LiveView"]

BETWEEN_FRAMES = 0.1  # s; drawing more often would cost more than the simulation
BAR = 20  # characters for |z|/s = 1
COLOURS = ("blue", "dark_orange3", "green", "magenta", "yellow")


class LiveView:
    """Shows states, |z|/s as bars, v and F during a simulation.

    Use it as a context manager and pass it to ``simulate(progress=...)``.

    Parameters
    ----------
    console : Console
        Console to draw on.
    t_start, t_end : float
        Start and end time for the progress bar, s.
    detail : bool
        If False, show only the progress bar.
    """

    def __init__(self, console: Console, t_start: float, t_end: float, detail: bool) -> None:
        self.detail = detail
        self.names: list[str] = []
        self.next_frame = 0.0
        self.latest: Moment | None = None
        self.bar = Progress(
            TextColumn("t = {task.fields[t]:.2f} s"),
            BarColumn(),
            TimeElapsedColumn(),
            console=console,
        )
        self.t_start = t_start
        self.task = self.bar.add_task("", total=t_end - t_start, t=t_start)
        self.console = console
        self.live = Live(self.bar, console=console, auto_refresh=False)

    def __enter__(self) -> LiveView:
        return self  # drawing starts with the first call: no empty bar before an error

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self.console.is_terminal:
            if self.latest is not None:
                self.show(self.latest)  # the last state is always drawn
            self.live.stop()
        elif self.detail and self.latest is not None:
            self.console.print(*self.tables(self.latest))  # a log gets only the last state

    def __call__(self, moment: Moment) -> None:
        """Draw, if enough time has passed since the last frame."""
        self.latest = moment
        if not self.console.is_terminal:
            return
        now = time.monotonic()
        if now < self.next_frame:
            return
        self.show(moment)
        self.next_frame = time.monotonic() + BETWEEN_FRAMES

    def show(self, moment: Moment) -> None:
        """Draw now."""
        self.bar.update(self.task, completed=moment.t - self.t_start, t=moment.t)
        shown = Group(*self.tables(moment), self.bar) if self.detail else self.bar
        self.live.start()
        self.live.update(shown, refresh=True)

    def tables(self, moment: Moment) -> list[Table]:
        """Return the table of each contact.

        Parameters
        ----------
        moment : Moment
            The latest row.

        Returns
        -------
        list of rich.table.Table
            One, if there are not several contacts.
        """
        values, states, found = moment.values, moment.states, list[Table]()
        for name in [key.removesuffix("F") for key in values if key.split(".")[-1] == "F"]:
            own = {each: values[name + each] for each in ("v", "F", "z", "s")}
            lead = f"{name.removesuffix('.')}   ".lstrip()
            here, states = states[: len(own["z"])], states[len(own["z"]) :]
            found.append(self.table(moment.t, here, own, lead))
        return found

    def table(
        self, t: float, states: Sequence[str], values: Mapping[str, Any], lead: str = ""
    ) -> Table:
        """Return a table with one line per element.

        Parameters
        ----------
        t : float
            Time, s.
        states : sequence of str
            State of each element.
        values : mapping
            ``v`` and ``F``; ``z`` and ``s``, one per element.
        lead : str
            Put in front of the title.

        Returns
        -------
        rich.table.Table
            State, |z|/s and z of each element; v and F in the title.
        """
        title = f"{lead}t = {t:10.4f} s   v = {values['v']:+.6f} m/s   F = {values['F']:+.5f} N"
        bare = all(map(math.isnan, values["s"]))  # no threshold without a Stribeck curve
        still = all(map(math.isnan, values["z"]))  # a chart without variables
        table = Table("element", "state", title=title, title_justify="left", min_width=len(title))
        for head in (*(() if bare else ("|z|/s", "")), *(() if still else ("z [m]",))):
            table.add_column(Text(head))  # [m] would be markup
        for i, (state, z, s) in enumerate(zip(states, values["z"], values["s"], strict=True)):
            if state not in self.names:
                self.names.append(state)
            colour = COLOURS[self.names.index(state) % len(COLOURS)]
            # Colours and bars are repeated as words and numbers.
            row = [
                Text(f"E{i + 1}"),
                Text(state.upper() if self.names.index(state) else state, style=colour),
            ]
            if not bare:
                ratio = abs(z) / s
                filled = min(BAR, round(BAR * ratio))
                bar = Text("█" * filled + "░" * (BAR - filled), style=colour)
                row += [Text(f"{ratio:.3f}"), bar]
            table.add_row(*row, *([] if still else [f"{z:+.4e}"]))
        return table
