"""What the panels show, as lines; with each line the command that a click on it gives.

Values are those of the view, in engineering units; sentences are those of the line prompt.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from gms_fsm.app._quantities import quantity, sparkline
from gms_fsm.app.debugger._text import breakpoint_text, progress, short, wrapped
from gms_fsm.app.debugger._view import (
    BranchView,
    ContactView,
    ElementView,
    EventView,
    Ribbons,
    View,
)
from gms_fsm.app.debugger.tui._chart import MARKS
from gms_fsm.app.debugger.tui._spans import Line, Span, line, state_role
from gms_fsm.inspection.explain import Clause, Why
from gms_fsm.inspection.session import Breakpoint, Fired

__all__ = [
    "RIBBON",
    "Row",
    "answer_rows",
    "axis",
    "curve_rows",
    "element_rows",
    "event_rows",
    "fitted",
    "labels",
    "margin_bar",
    "ranges",
    "ribbon_rows",
    "session_rows",
    "status_lines",
    "why_rows",
]

RIBBON = "─▓═┼▒┄"  # one mark per state, as at the line prompt
DECADES = 6  # of a margin, relative to the larger side
UNITS = {"v": "m/s", "F": "N"}
BAR = 8  # characters for |z|/s = 1
VALUE = 13  # columns of a value in the table of clauses
VALUES = VALUE + 4  # columns around text and bar


class Row(NamedTuple):
    """A line of a panel, and the command that a click on it gives; empty for none."""

    line: Line
    command: str = ""


def status_lines(view: View, title: str, width: int, *, busy: bool = False) -> list[Line]:
    """Return time, place and the main values: what is shown above everything.

    Parameters
    ----------
    view : View
        The screen.
    title : str
        What runs.
    width : int
        Columns.
    busy : bool
        Whether a command is being executed.

    Returns
    -------
    list of Line
        As many as are needed.
    """
    step = f" micro-step {view.microstep}" if view.microstep else ""
    place = f"between rows {view.row} and {view.row + 1}" if view.located else f"row {view.row}"
    parts = [
        Span(f"t = {view.t:.9g} s", "head"),
        Span(f"{place}{step}"),
        Span(f"branch {view.branch}", "fired" if view.branch else ""),
    ]
    for contact in view.contacts:
        lead = f"{contact.name}: " if contact.name else ""
        values = {"v": (contact.v, "m/s"), "F": (contact.F, "N")}
        text = " ".join(f"{name} = {quantity(*value)}" for name, value in values.items())
        parts.append(Span(f"{lead}{text}"))
    if view.ending == "end":
        parts.append(Span("end of the run", "fired"))
    elif view.ending:
        parts.append(Span("the run cannot continue", "error"))
    if busy:
        parts.append(Span("… working, Esc stops it", "now"))
    found = fitted(parts, width)
    left = width - sum(len(span.text) for span in found[0]) - 4
    if len(title) <= left:
        found[0] = [Span(f"{title} ", "command"), *found[0]]
    return found


def fitted(parts: Sequence[Span], width: int, gap: str = "  ") -> list[Line]:
    """Return parts in as few lines as hold them; a part is never split.

    >>> [len(each) for each in fitted([Span("one"), Span("two"), Span("three")], 9)]
    [3, 1]
    """
    lines: list[list[Span]] = [[]]
    for part in parts:
        used = sum(len(span.text) for span in lines[-1])
        if lines[-1] and used + len(gap) + len(part.text) > width:
            lines.append([])
        elif lines[-1]:
            lines[-1].append(Span(gap))
        lines[-1].append(part)
    return list(lines)


# --------------------------------------------------------------------------- elements
def element_rows(view: View, chosen: int, width: int) -> list[Row]:
    """Return a table of the elements; a click chooses one.

    Parameters
    ----------
    view : View
        The screen.
    chosen : int
        The marked element, counted over all contacts from 0.
    width : int
        Columns.

    Returns
    -------
    list of Row
        A heading per contact and a row per element; then bodies and further values of a system.
    """
    rows: list[Row] = []
    for contact in view.contacts:
        if contact.name:
            rows += [Row(line((part, "head"))) for part in wrapped(contact.title, width)]
        rows += _table(contact, chosen, width)
    for body in view.bodies:
        given = " (given)" if body.driven else ""
        (x, position), (v, velocity) = body.x, body.v
        text = f"{body.name}: {x} = {quantity(position)}, {v} = {quantity(velocity)}{given}"
        rows += [Row(line((part, "dim"))) for part in wrapped(text, width)]
    for each in view.values:
        values = ", ".join(f"{name} = {quantity(value)}" for name, value in each.values.items())
        tick = "" if each.tick is None else f"; next tick at t = {each.tick:.9g} s"
        text = f"{each.title}: {values}{tick}"
        rows += [Row(line((part, "dim"))) for part in wrapped(text, width)]
    return rows


def _table(contact: ContactView, chosen: int, width: int) -> list[Row]:
    """Return the elements of a contact: columns as far as there is room, edges last."""
    chart, lead = contact.chart, f"{contact.name} " if contact.name else ""
    names = [state.name for state in chart.states]
    heads = ["  el", "state", *chart.variables, "s", f"|{(*chart.variables, '')[0]}|/s", "F"]
    cells = [
        [
            f"{'▶' if i == chosen else ' '} E{each.number}",
            each.state,
            *(
                quantity(value, chart.unit(name))
                for name, value in zip(chart.variables, each.variables, strict=True)
            ),
            "" if each.s is None else quantity(each.s, "m"),
            "" if each.ratio is None else _ratio(each.ratio),
            quantity(each.F, "N"),
        ]
        for i, each in enumerate(contact.elements, start=contact.first)
    ]
    wide = [max(len(row[j]) for row in [heads, *cells]) for j in range(len(heads))]
    kept = [j for j in range(len(heads)) if any(row[j] for row in cells)]
    while len(kept) > 2 and sum(wide[j] + 2 for j in kept) > width:
        kept.pop(-2 if len(kept) > 3 else -1)
    used = sum(wide[j] + 2 for j in kept)
    bar = contact.elements[0].ratio is not None and used + BAR + 2 <= width
    edges_at = used + (BAR + 2 if bar else 0)
    edges = all(edges_at + len(_edges(each)) <= width for each in contact.elements)
    text = "  ".join(_cell(heads[j], wide[j], j) for j in kept)
    text += f"  {'0':<{BAR - 1}}1" if bar else ""
    rows = [Row(line((f"{text}  {'edges' if edges else ''}".rstrip(), "dim")))]
    for i, (each, row) in enumerate(zip(contact.elements, cells, strict=True), contact.first):
        spans = [
            Span(f"{_cell(row[j], wide[j], j)}  ", _element_role(j, names, each, i == chosen))
            for j in kept
        ]
        if bar:
            spans.append(Span(f"{_ratio_bar(each.ratio)}  ", state_role(names.index(each.state))))
        if edges:
            spans.append(Span(_edges(each)))
        rows.append(Row(spans, f"element {lead}{each.number}"))
    return rows


def _ratio(ratio: float) -> str:
    return f"{ratio:.3f}" if ratio < 1000.0 else f"{ratio:.2e}"


def _element_role(column: int, names: Sequence[str], each: ElementView, chosen: bool) -> str:
    if column == 1:
        return state_role(names.index(each.state))
    return "head" if chosen else ""


def _cell(text: str, wide: int, column: int) -> str:
    return f"{text:<{wide}}" if column < 2 else f"{text:>{wide}}"


def _edges(each: ElementView) -> str:
    return " ".join(
        f"{edge.priority}:{''.join(MARKS[truth] for truth in edge.clauses)}"
        + ("*" if edge.fired else "")
        for edge in each.edges
    )


def _ratio_bar(ratio: float | None) -> str:
    filled = 0 if ratio is None else min(BAR, round(BAR * ratio))
    over = ratio is not None and ratio > 1.0
    return ("█" * filled + "░" * (BAR - filled))[: BAR - over] + "▶" * over


# --------------------------------------------------------------------------- guards
def margin_bar(relative: float, half: int) -> str:
    """Return a margin on a logarithmic scale: to the right if true, to the left if false.

    Parameters
    ----------
    relative : float
        The margin over the larger side. Each of six decades below 1 has the same width.
    half : int
        Characters on each side.

    Returns
    -------
    str
        ``2 * half + 1`` characters.

    Examples
    --------
    >>> margin_bar(1.0, 6), margin_bar(-1e-3, 6), margin_bar(0.0, 6)
    ('      │██████', '   ███│      ', '      │      ')
    """
    size = 0.0
    if relative and math.isfinite(relative):
        size = half * max(0.0, min(1.0, 1.0 + math.log10(abs(relative)) / DECADES))
    full, rest = int(size), size - int(size) >= 0.5
    if relative < 0.0:
        return f"{'▐' * rest + '█' * full:>{half}}│{' ' * half}"
    return f"{' ' * half}│{'█' * full + '▌' * rest:<{half}}"


def why_rows(why: Why, address: str, points: Sequence[Breakpoint], width: int) -> list[Row]:
    """Return the edges of an element clause by clause; a click sets a breakpoint at a guard.

    Parameters
    ----------
    why : Why
        From the session.
    address : str
        How a command names the element.
    points : sequence of Breakpoint
        The breakpoints, which are marked.
    width : int
        Columns.

    Returns
    -------
    list of Row
        Heading, edges with their clauses, and one sentence per edge.
    """
    rows = [Row(line((part, "head"))) for text in why.heading for part in wrapped(text, width)]
    texts = [len(clause.text) for each in why for clause in each.clauses]
    if texts:
        table = Table.fitting(max(texts), width)
        rows.append(Row(line((table.head, "dim"))))
    for each in why:
        edge = each.edge
        command = f"break valid {edge.name} element {address}"
        if not address.isdigit():
            command = f"break valid {edge.name} {address}"
        marks = " ● break" if any(point.name == edge.name for point in points) else ""
        fired = "  FIRED" if each.fired else ""
        text = f"{each.priority} {edge.name}: {edge.source} → {edge.target}{fired}{marks}"
        role = "fired" if each.fired else "head"
        rows += [Row(line((part, role)), command) for part in wrapped(text, width)]
        rows += [Row(each, command) for clause in each.clauses for each in table.lines(clause)]
    for each in why:
        role = "fired" if each.fired else "true" if each.holds else ""
        rows += [Row(line((part, role))) for part in wrapped(each.verdict, width)]
    return rows


class Table(NamedTuple):
    """How clauses are laid out: widths of the text and of half a bar, and what there is room for.

    Where a text leaves no room for its margin, the margin is on the next line.
    """

    wide: int
    half: int
    sides: bool
    apart: bool

    @classmethod
    def fitting(cls, wide: int, width: int) -> Table:
        """Return the layout for texts and a panel of given widths."""
        sides = width >= wide + VALUES + 2 * VALUE + 2 * 6
        apart = width < wide + VALUES + 2 * 2
        wide = min(wide, width - 2) if apart else wide
        used = VALUES + 2 * VALUE * sides + (0 if apart else wide)
        return cls(wide, max(2, min(12, (width - used) // 2)), sides, apart)

    @property
    def head(self) -> str:
        """The headings of the columns."""
        values = f"{'left':>{VALUE}}{'right':>{VALUE}}" if self.sides else ""
        bar = f"{'false'[: self.half]:>{self.half}}│{'true'[: self.half]:<{self.half}}"
        clause = "" if self.apart else f"{'clause':<{self.wide}}"
        return f"  {clause}{values}{'margin':>{VALUE}} {bar}"

    def lines(self, clause: Clause) -> list[Line]:
        """Return the line of a clause, or two: truth, text, both sides, margin, bar."""
        mark = MARKS[clause.holds if clause.computable else None]
        role, value = "true" if clause.holds else "false", list[Span]()
        if not clause.computable:
            value = [Span("  cannot be computed here", "dim")]
        elif math.isnan(clause.margin):  # compound: no two sides
            value = [Span("  true" if clause.holds else "  false", role)]
        else:
            if self.sides:
                both = (quantity(side, clause.unit) for side in (clause.left, clause.right))
                value += [Span(f"{side:>{VALUE}}") for side in both]
            margin = quantity(clause.margin, clause.unit) if clause.relative else "0, rounding"
            bar = margin_bar(clause.relative, self.half)
            value += [Span(f"{margin:>{VALUE}} "), Span(bar, role)]
        if not self.apart:
            return [[Span(f"{mark} ", role), Span(f"{clause.text:<{self.wide}}"), *value]]
        texts = textwrap.wrap(clause.text, self.wide)
        leads = [f"{mark} ", *["  "] * len(texts)]
        found = [line((lead, role), text) for lead, text in zip(leads, texts, strict=False)]
        return [*found, [Span("  "), *value]]


# --------------------------------------------------------------------------- over time
def labels(contacts: Sequence[ContactView]) -> list[str]:
    """Return the label of each element: ``E1``, in a system ``gear 1``."""
    return [
        f"{contact.name} {each.number}" if contact.name else f"E{each.number}"
        for contact in contacts
        for each in contact.elements
    ]


def axis(start: float, end: float, width: int) -> str:
    """Return times at round values below a strip of characters.

    >>> axis(0.0, 100.0, 40)
    '0 s     20 s    40 s    60 s    80 s   '
    """
    rough = (end - start) / max(2, width // 14)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough)
    text, k = "", math.ceil(start / step - 1e-9)
    while k * step <= end:
        column = int(width * (k * step - start) / (end - start))
        label = f"{k * step:.6g} s"
        if column >= len(text) + bool(text) and column + len(label) <= width:
            text = text.ljust(column) + label
        k += 1
    return text.ljust(width - 1)


def ribbon_rows(
    ribbons: Ribbons, parent: Ribbons | None, view: View, chosen: int, lead: int
) -> list[Row]:
    """Return the states of all elements over time; the cursor is a column.

    Parameters
    ----------
    ribbons : Ribbons
        Of the current branch.
    parent : Ribbons or None
        Of the branch to compare with, over the same time.
    view : View
        The screen.
    chosen : int
        The marked element.
    lead : int
        Columns of the labels.

    Returns
    -------
    list of Row
        One per element; with a parent, a last one that marks where any state differs.
    """
    rows = []
    states = [each.state for each in view.elements]
    roles = [
        state_role([state.name for state in contact.chart.states].index(each.state))
        for contact in view.contacts
        for each in contact.elements
    ]
    for i, label in enumerate(labels(view.contacts)):
        mark = "▶" if i == chosen else " "
        wide = max(2, lead - 2 - min(9, max(map(len, states))))
        text = f"{mark}{short(label, wide):<{wide}}"
        spans = [Span(text, "head" if i == chosen else "")]
        room = lead - len(text) - 1
        spans.append(Span(f"{short(states[i], room):<{room}} ", roles[i]))
        for part, mode in enumerate(ribbons.modes):
            shown = " " if mode is None else RIBBON[mode[i] % len(RIBBON)]
            role = "dim" if mode is None else state_role(mode[i])
            spans.append(Span("┃", "now") if part == ribbons.now else Span(shown, role))
        rows.append(Row(_joined(spans)))
    if parent is not None:
        marks = [
            "≠" if None not in (a, b) and a != b else " "
            for a, b in zip(ribbons.modes, parent.modes, strict=True)
        ]
        rows.append(Row(line((f"{' differs':<{lead}}", "dim"), ("".join(marks), "fired"))))
    return rows


def _joined(spans: Sequence[Span]) -> Line:
    """Return spans with neighbours of the same role as one."""
    found: list[Span] = []
    for span in spans:
        if found and found[-1].role == span.role:
            found[-1] = Span(found[-1].text + span.text, span.role)
        else:
            found.append(span)
    return found


def ranges(values: Mapping[str, Sequence[float | None]]) -> str:
    """Return the ranges of velocity and force.

    >>> ranges({"v": (0.0, None, 0.15), "F": (1.0, 2.0)})
    'v 0 m/s to 150.0 mm/s  F 1.000 N to 2.000 N'
    """
    found = []
    for name, each in values.items():
        known = [value for value in each if value is not None and math.isfinite(value)]
        if known:
            low, high = (quantity(value, UNITS[name]) for value in (min(known), max(known)))
            found.append(f"{name} {low} to {high}")
    return "  ".join(found)


def curve_rows(values: Mapping[str, Sequence[float | None]], lead: int, now: int) -> list[Row]:
    """Return velocity and force over time as sparklines; `ranges` says what they span.

    Parameters
    ----------
    values : dict
        From `gms_fsm.app.debugger._view.curves`.
    lead : int
        Columns of the label.
    now : int
        The part that contains the cursor.

    Returns
    -------
    list of Row
        One per name.
    """
    rows = []
    for name, each in values.items():
        text = sparkline(each)
        spans = [Span(f" {name:<{lead - 1}}"), Span(text[:now], "dim")]
        rows.append(Row([*spans, Span(text[now : now + 1], "now"), Span(text[now + 1 :], "dim")]))
    return rows


# --------------------------------------------------------------------------- lists
def event_rows(events: Sequence[EventView], cursor: int, width: int) -> list[Row]:
    """Return the firings computed so far; a click goes there.

    Parameters
    ----------
    events : sequence of EventView
        All firings of the branch.
    cursor : int
        Row at the cursor.
    width : int
        Columns.

    Returns
    -------
    list of Row
        One per firing; the last at or before the cursor is marked.
    """
    if not events:
        return [Row(line(("no transition so far", "dim")))]
    here = max((i for i, each in enumerate(events) if each.row <= cursor), default=-1)
    rows = []
    for i, each in enumerate(events):
        text = f"{'▶' if i == here else ' '}{each.t:>11.9g} s  "
        text += _fired(each.fired, width - len(text))
        role = "head" if i == here else "dim" if each.row > cursor else ""
        rows.append(Row(line((text, role)), _move(each.row - cursor)))
    return rows


def _fired(fired: Fired, room: int) -> str:
    """Return what fired, in the longest form that fits."""
    who = f"{fired.contact} {fired.element + 1}" if fired.contact else f"E{fired.element + 1}"
    change = f"{fired.source} → {fired.target}"
    forms = (f"{who} {change}  {fired.edge}", f"{who} {fired.edge}", f"{who} {change}")
    return next((form for form in forms if len(form) <= room), short(forms[-1], max(1, room)))


def _move(rows: int) -> str:
    if rows == 0:
        return ""
    return f"step {rows}" if rows > 0 else f"back {-rows}"


def session_rows(
    branches: Sequence[BranchView],
    points: Sequence[Breakpoint],
    watches: Sequence[str],
    width: int,
) -> list[Row]:
    """Return branches as a tree, breakpoints and watches; a click switches to a branch.

    Parameters
    ----------
    branches : sequence of BranchView
        All branches.
    points : sequence of Breakpoint
        All breakpoints.
    watches : sequence of str
        The lines of the watches.
    width : int
        Columns.

    Returns
    -------
    list of Row
        The rows.
    """
    rows = []
    for each in branches:
        mark, indent = ("▶" if each.current else " "), "  " * _depth(each, branches)
        fork = "" if each.parent is None else f" from {each.parent} at {each.t_fork:.9g} s:"
        text = f"{mark}{indent}branch {each.number}{fork} {each.edits}".rstrip()
        role, command = ("head" if each.current else "", f"branch {each.number}")
        rows += [Row(line((part, role)), command) for part in wrapped(text, width)]
        detail = f"  {indent}{progress(each)}"
        rows += [Row(line((part, "dim")), command) for part in wrapped(detail, width)]
    for number, point in enumerate(points, start=1):
        text = f"● {number} {breakpoint_text(point)}; hits: {point.seen}"
        rows += [Row(line((part, "false"))) for part in wrapped(text, width)]
    rows += [Row(line(part)) for text in watches for part in wrapped(text, width)]
    return rows


def _depth(each: BranchView, branches: Sequence[BranchView]) -> int:
    return 0 if each.parent is None else 1 + _depth(branches[each.parent], branches)


def answer_rows(lines: Sequence[str], width: int) -> list[Row]:
    """Return lines of a transcript, wrapped; commands and errors stand out.

    Parameters
    ----------
    lines : sequence of str
        Commands begin with their prompt, errors with ``error:``.
    width : int
        Columns.

    Returns
    -------
    list of Row
        The rows.
    """
    rows = []
    for each in lines:
        role = "command" if each.startswith("(t=") else "error" if each.startswith("error:") else ""
        rows += [Row(line((part, role))) for part in wrapped(each, width)]
    return rows
