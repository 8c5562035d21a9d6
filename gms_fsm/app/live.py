"""Live view of a running simulation: states, curves and transitions, also against the clock."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterable, Mapping, Sequence
from types import TracebackType
from typing import Any

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from gms_fsm.foundation.quantities import Scale, scale_of, sparkline
from gms_fsm.lowering.log_columns import LogRecord
from gms_fsm.run.simulate import Moment
from plots.style import ANSI

BETWEEN_FRAMES = 0.1  # s; drawing more often would cost more than the simulation
BETWEEN_LINES = 1.0  # s of the clock, without a terminal
LATE = 1.0  # s of the clock by which a run may be behind before the clock waits for it
BAR = 20  # characters for |z|/s = 1
CURVE = 60  # characters of v and F over time; against the clock each is one frame
EVENTS = 5  # transitions shown


class LiveView:
    """Shows states, |z|/s as bars, v and F, and the last transitions during a simulation.

    Use it as a context manager and pass it to ``simulate(progress=...)``. Without a terminal it
    prints lines.

    Parameters
    ----------
    console : Console
        Console to draw on.
    t_start, t_end : float
        Start and end time for the progress bar, s.
    detail : bool
        If False, show only the progress bar.
    pace : float, optional
        Simulated seconds per second of the clock; as fast as possible if omitted.
    """

    def __init__(
        self,
        console: Console,
        t_start: float,
        t_end: float,
        detail: bool,
        pace: float | None = None,
    ) -> None:
        self.detail, self.pace = detail, pace
        self.largest: dict[str, float] = {}  # of each quantity so far, which chooses its unit
        self.next_frame = self.next_line = 0.0
        self.latest: Moment | None = None
        self.begin: float | None = None  # time of the clock at t_start, against the clock
        self.behind = False  # whether computing takes longer than the pace allows
        self.read = 0  # transitions read
        self.last: list[LogRecord] = []  # the last of them
        self.t_start, self.time = t_start, Scale(0, "s")  # as in the log
        self.bar = Progress(
            TextColumn("t = {task.fields[t]}"),
            BarColumn(),
            TimeElapsedColumn(),
            console=console,
        )
        self.task = self.bar.add_task("", total=t_end - t_start, t=self.time.text(t_start, 5))
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
            self._print_transitions(self.latest)
            self.console.print(*self.tables(self.latest))

    def __call__(self, moment: Moment) -> None:
        """Draw, if enough time has passed since the last frame; against the clock, wait for it."""
        if self.pace is None:
            self._see(moment)
            return
        if self.begin is None:
            self.begin = time.monotonic()
        late = time.monotonic() - self._due(moment.t)
        if late > LATE:
            self.begin, self.behind = self.begin + late, True
        while (now := time.monotonic()) < self._due(moment.t):
            self._see(moment.at(self.t_start + self.pace * (now - self.begin)))
            left = self._due(moment.t) - time.monotonic()
            if left > 0.0:
                time.sleep(min(BETWEEN_FRAMES, left))
        self._see(moment)

    def _due(self, t: float) -> float:
        """Return when the clock reaches a simulated time."""
        assert self.begin is not None
        assert self.pace is not None
        return self.begin + (t - self.t_start) / self.pace

    def _see(self, moment: Moment) -> None:
        """Draw a moment, if enough time has passed since the last frame."""
        self.latest = moment
        now = time.monotonic()
        if not self.console.is_terminal:
            if self.detail and now >= self.next_line:
                self._print_lines(moment)
                self.next_line = now + BETWEEN_LINES
            return
        if now < self.next_frame:
            return
        self.show(moment)
        self.next_frame = time.monotonic() + BETWEEN_FRAMES

    def show(self, moment: Moment) -> None:
        """Draw now."""
        self.bar.update(self.task, completed=moment.t - self.t_start, t=self.time.text(moment.t, 5))
        shown = Group(*self.picture(moment), self.bar) if self.detail else self.bar
        self.live.start()
        self.live.update(shown, refresh=True)

    # ------------------------------------------------------------------ lines
    def _print_transitions(self, moment: Moment) -> None:
        """Print the transitions since the last line, if against the clock."""
        new = self._read(moment)
        for record in new if self.pace is not None else ():
            self._print(_event(record))

    def _print_lines(self, moment: Moment) -> None:
        """Print the transitions since the last line, and the values."""
        self._print_transitions(moment)
        count = "" if self.pace is not None else f", {self.read} transitions"
        self._print(f"t = {self.time.text(moment.t, 5)}{count}: {self._summary(moment)}")

    def _print(self, text: str) -> None:
        self.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def _read(self, moment: Moment) -> list[LogRecord]:
        """Return the transitions since the last reading."""
        new = moment.transitions(self.read)
        self.read += len(new)
        self.last = [*self.last, *new][-EVENTS:]
        return new

    def _summary(self, moment: Moment) -> str:
        """Return v, F and the states of each contact in one line."""
        values, units, states, parts = moment.values, moment.units, iter(moment.states), []
        for lead in _leads(values):
            here = list(itertools.islice(states, len(values[f"{lead}z"])))
            text = (
                f"{lead}{name} = "
                + self.scale(lead + name, [values[lead + name]], units).text(values[lead + name])
                for name in ("v", "F")
            )
            counts = (f"{here.count(name)} {name}" for name in dict.fromkeys(here))
            parts.append(", ".join([*text, *counts]))
        return "; ".join(parts)

    # ------------------------------------------------------------------ the picture
    def picture(self, moment: Moment) -> list[RenderableType]:
        """Return tables, curves and the last transitions."""
        self._read(moment)
        curves = self.curves(moment)  # first: they choose units that suit what they show
        slow = "; computing is slower than that" * self.behind
        pace = "" if self.pace is None else f"simulated seconds per second: {self.pace:g}{slow}"
        return [
            *self.tables(moment),
            *curves,
            Text(f"last transitions ({self.read} so far)" if self.last else "no transition so far"),
            *(Text(f"  {_event(record)}", no_wrap=True) for record in self.last),
            *([Text(pace)] if pace else []),
        ]

    def curves(self, moment: Moment) -> list[Text]:
        """Return v and F of each contact over time: since the start, or the last frames."""
        start = self.t_start
        if self.pace is not None:
            start = max(start, moment.t - self.pace * CURVE * BETWEEN_FRAMES)
        span = moment.t - start
        if span <= 0.0:
            return []
        wide = max(10, min(CURVE, self.console.width - 44))
        seen = [moment.at(start + span * (i + 1) / wide).values for i in range(wide)]
        lines = []
        for lead in _leads(seen[-1]):
            for name in ("v", "F"):
                values = [float(each[lead + name]) for each in seen]
                scale = self.scale(lead + name, values, moment.units)
                low, high = scale.number(min(values)), scale.text(max(values))
                text = f"{lead}{name} {sparkline(values)} {low} to {high}"
                lines.append(Text(text, no_wrap=True))
        return [*lines, Text(f"over the last {self.time.text(span)}")]

    def tables(self, moment: Moment) -> list[Table]:
        """Return the table of each contact."""
        values, found = moment.values, list[Table]()
        states = zip(moment.states, moment.modes, strict=True)
        for name in _leads(values):
            here = list(itertools.islice(states, len(values[f"{name}z"])))
            found.append(self.table(moment, here, values, name))
        return found

    def scale(self, name: str, values: Iterable[float], units: Mapping[str, str]) -> Scale:
        """Return how a quantity is written: in the unit that suits the largest value so far."""
        sizes = (abs(each) for each in values if math.isfinite(each))
        self.largest[name] = max(self.largest.get(name, 0.0), *sizes, 0.0)
        return scale_of(self.largest[name], units[name])

    def table(
        self, at: Moment, states: Sequence[tuple[str, int]], seen: Mapping[str, Any], lead: str
    ) -> Table:
        """Return a table with one line per element: of each the state and its place."""
        values = {each: seen[lead + each] for each in ("v", "F", "z", "s")}
        scales = {
            name: self.scale(lead + name, np.ravel(values[name]), at.units)
            for name in ("v", "F", "z")
        }
        v, F = (scales[name].text(values[name]) for name in ("v", "F"))
        title = f"{lead.removesuffix('.')}   ".lstrip()
        title += f"t = {self.time.text(at.t, 5):<9}   v = {v:<11}   F = {F}"
        bare = all(map(math.isnan, values["s"]))  # no threshold without a Stribeck curve
        still = all(map(math.isnan, values["z"]))  # a chart without variables
        table = Table("element", "state", title=title, title_justify="left", min_width=len(title))
        scale = f"0{1:>{BAR - 1}}"  # of the bar
        for head in () if bare else ("|z|/s", scale):
            table.add_column(head)
        if not still:
            table.add_column("z", justify="right")
        rows = zip(states, values["z"], values["s"], strict=True)
        for i, ((state, place), z, s) in enumerate(rows):
            # Colours and bars are repeated as words and numbers; the default state is plain.
            look = f"{'bold ' if place else ''}color({ANSI['active']})"
            row = [Text(f"E{i + 1}"), Text(state.upper() if place else state, style=look)]
            if not bare:
                ratio = abs(z) / s
                filled = min(BAR, round(BAR * ratio))
                bar = Text("█" * filled + "░" * (BAR - filled), style=look)
                row += [Text(f"{ratio:.3f}"), bar]
            table.add_row(*row, *([] if still else [scales["z"].text(z)]))
        return table


def _leads(values: Mapping[str, Any]) -> list[str]:
    """Return what stands before the names of each contact: nothing, or ``gear.``."""
    return [key.removesuffix("F") for key in values if key.split(".")[-1] == "F"]


def _event(record: LogRecord) -> str:
    who = f"{record.contact} {record.element + 1}".lstrip() if record.contact else ""
    who = who or f"element {record.element + 1}"
    return f"t = {record.t:.9g} s  {who}: {record.source} -> {record.target} by {record.edge}"
