"""What the panels show, as lines; with each line the command that a click on it gives.

Values are those of the view, in engineering units; sentences are those of the line prompt.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence

from gms_fsm.debugger._over_time import EventView
from gms_fsm.debugger._text import breakpoint_text, progress
from gms_fsm.debugger._view import BranchView, ContactView, ElementView, Screen
from gms_fsm.debugger.tui._chart import MARKS
from gms_fsm.debugger.tui._spans import Line, PanelLine, Span, line, state_role
from gms_fsm.foundation.quantities import quantity, wrapped
from gms_fsm.session.session import Breakpoint, Fired

BAR = 8  # characters for |z|/s = 1
TIME = " " * 16  # columns of the time of a transition


def status_lines(
    view: Screen, title: str, width: int, *, several: bool = False, busy: bool = False
) -> list[Line]:
    """Return time, place and the main values: what is shown above everything."""
    step = f" micro-step {view.microstep}" if view.microstep else ""
    place = f"between rows {view.row} and {view.row + 1}" if view.located else f"row {view.row}"
    parts = [
        Span(f"t = {view.t:.9g} s", "head"),
        Span(f"{place}{step}"),
        *([Span(f"branch {view.branch}", "head")] if several else []),
    ]
    for contact in view.contacts:
        lead = f"{contact.name}: " if contact.name else ""
        parts.append(Span(f"{lead}{contact.here.written('v', 'F')}"))
    if view.ending == "end":
        parts.append(Span("end of the run", "head"))
    elif view.ending:
        parts.append(Span("the run cannot continue", "head"))
    if busy:
        parts.append(Span("… working, Esc stops it", "now"))
    found = fitted(parts, width)
    for text in _forms(view.fired) if view.fired else ():  # the chart says it too
        more = fitted([*parts[:2], Span(f"FIRED {text}", "fired"), *parts[2:]], width)
        if len(more) == len(found):
            found = more
            break
    left = width - sum(len(span.text) for span in found[0]) - 4
    if len(title) <= left:
        found[0] = [Span(f"{title} ", "head"), *found[0]]
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


def element_rows(view: Screen, chosen: int, width: int) -> list[PanelLine]:
    """Return a table of the elements; a click chooses one."""
    rows: list[PanelLine] = []
    for contact in view.contacts:
        if contact.name:
            rows += [PanelLine(line((part, "head"))) for part in wrapped(contact.title, width)]
        rows += _table(contact, chosen, width)
    for body in view.bodies:
        given = " (given)" if body.driven else ""
        text = f"{body.name}: {body.text()}{given}"
        rows += [PanelLine(line((part, "dim"))) for part in wrapped(text, width)]
    for each in view.values:
        values = ", ".join(f"{name} = {quantity(value)}" for name, value in each.values.items())
        tick = "" if each.tick is None else f"; next tick at t = {each.tick:.9g} s"
        text = f"{each.title}: {values}{tick}"
        rows += [PanelLine(line((part, "dim"))) for part in wrapped(text, width)]
    return rows


def _table(contact: ContactView, chosen: int, width: int) -> list[PanelLine]:
    """Return the elements of a contact: columns as far as there is room, edges last."""
    chart, lead = contact.chart, f"{contact.name} " if contact.name else ""
    scales = contact.scales
    names = [state.name for state in chart.states]
    heads = ["  el", "state", *chart.variables, "s", f"|{(*chart.variables, '')[0]}|/s", "F"]
    cells = [
        [
            f"{'▶' if i == chosen else ' '} E{each.number}",
            each.state,
            *(
                scales[name].text(value)
                for name, value in zip(chart.variables, each.variables, strict=True)
            ),
            "" if each.s is None else scales["s"].text(each.s),
            "" if each.ratio is None else _ratio(each.ratio),
            scales["F"].text(each.F),
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
    rows = [PanelLine(line((f"{text}  {'edges' if edges else ''}".rstrip(), "dim")))]
    for i, (each, row) in enumerate(zip(contact.elements, cells, strict=True), contact.first):
        spans = [
            Span(f"{_cell(row[j], wide[j], j)}  ", _element_role(j, names, each, i == chosen))
            for j in kept
        ]
        if bar:
            spans.append(Span(f"{_ratio_bar(each.ratio)}  ", state_role(names.index(each.state))))
        if edges:
            spans.append(Span(_edges(each)))
        rows.append(PanelLine(spans, f"element {lead}{each.number}"))
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


def event_rows(events: Sequence[EventView], cursor: int, width: int) -> list[PanelLine]:
    """Return the firings computed so far; a click goes there."""
    if not events:
        return [PanelLine(line(("no transition so far", "dim")))]
    here = max((i for i, each in enumerate(events) if each.row <= cursor), default=-1)
    forms = [_forms(each.fired) for each in events]
    room = width - len(TIME)
    fitting = (i for i in range(len(forms[0])) if max(len(form[i]) for form in forms) <= room)
    form, rows = next(fitting, len(forms[0]) - 1), list[PanelLine]()
    for i, each in enumerate(events):
        role = "head" if i == here else "dim" if each.row > cursor else ""
        lead = f"{'▶' if i == here else ' '}{each.t:>#11.9g} s  "
        for part in textwrap.wrap(forms[i][form], max(8, room)):
            rows.append(PanelLine(line((lead + part, role)), _move(each.row - cursor)))
            lead = TIME
    return rows


def _forms(fired: Fired) -> tuple[str, ...]:
    """Return what fired, from long to short."""
    who = f"{fired.contact} {fired.element + 1}" if fired.contact else f"E{fired.element + 1}"
    change = f"{fired.source} → {fired.target}"
    return f"{who} {change}  {fired.edge}", f"{who} {fired.edge}"


def _move(rows: int) -> str:
    if rows == 0:
        return ""
    return f"step {rows}" if rows > 0 else f"back {-rows}"


def session_rows(
    branches: Sequence[BranchView],
    points: Sequence[Breakpoint],
    watches: Sequence[str],
    width: int,
) -> list[PanelLine]:
    """Return branches as a tree, breakpoints and watches; a click switches to a branch."""
    rows, numbered = list[PanelLine](), {each.number: each for each in branches}
    for each in branches:
        mark, indent = ("▶" if each.current else " "), "  " * _depth(each, numbered)
        fork = "" if each.parent is None else f" from {each.parent} at {each.t_fork:.9g} s:"
        text = f"{mark}{indent}branch {each.number}{fork} {each.edits}".rstrip()
        role, command = ("head" if each.current else "", f"branch {each.number}")
        rows += [PanelLine(line((part, role)), command) for part in wrapped(text, width)]
        detail = f"  {indent}{progress(each)}"
        rows += [PanelLine(line((part, "dim")), command) for part in wrapped(detail, width)]
    for number, point in enumerate(points, start=1):
        text = f"● {number} {breakpoint_text(point)}; hits: {point.seen}"
        rows += [PanelLine(line((part, "head"))) for part in wrapped(text, width)]
    rows += [PanelLine(line(part)) for text in watches for part in wrapped(text, width)]
    return rows


def _depth(each: BranchView, branches: Mapping[int, BranchView]) -> int:
    return 0 if each.parent is None else 1 + _depth(branches[each.parent], branches)


def answer_rows(lines: Sequence[str], width: int) -> list[PanelLine]:
    """Return lines of a transcript, wrapped; commands and errors stand out."""
    rows = []
    for each in lines:
        role = "head" if each.startswith(("(t=", "error:")) else ""
        rows += [PanelLine(line((part, role))) for part in wrapped(each, width)]
    return rows
