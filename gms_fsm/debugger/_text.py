"""The display of the debugger as lines of text, 80 columns wide unless the terminal is wider."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gms_fsm.debugger._over_time import Ribbons
from gms_fsm.debugger._view import BranchView, ContactView, Screen, StateView
from gms_fsm.foundation.quantities import WIDTH, named_numbers
from gms_fsm.session.session import Breakpoint

BAR = 8  # characters for |z|/s = 1, and more in a wide terminal


@dataclass(frozen=True)
class Marks:
    """Drawing characters: no and yes, bar, states of a ribbon, a box, the active box, micro."""

    truth: str
    bar: str
    ribbon: str
    box: str
    active: str
    micro: str


PLAIN = Marks("ny", ".#", "-#=+%o", "+-+|++", "+=+|++", "u")
DRAWN = Marks("✗✓", "░█", "─▓═┼▒┄", "┌─┐│└┘", "╔═╗║╚╝", "µ")


def screen_lines(
    view: Screen, ribbons: Ribbons, chosen: int, marks: Marks, width: int = WIDTH
) -> Iterator[str]:
    """Yield one screen: the position, each element with values and edges, the states over time."""
    step = f", micro-step {view.microstep}" if view.microstep else ""
    yield f"t = {view.t:.9g} s, row {view.row}{step}, branch {view.branch}"
    yield from _body_lines(view)
    for contact in view.contacts:
        yield from _contact_lines(contact, view, chosen, marks, width)
    no, yes = tuple(marks.truth)
    yield f"edges by priority, one mark per clause: {yes} true, {no} false, * just taken; see why"
    yield from _ribbon_lines(ribbons, view.contacts, marks)


def _body_lines(view: Screen) -> Iterator[str]:
    """Yield the bodies and the further values of a system."""
    wide = max((len(body.name) for body in view.bodies), default=0)
    for body in view.bodies:
        given = "  (given)" if body.driven else ""
        yield f"{body.name:<{wide}}  {body.text()}{given}"
    for each in view.values:
        tick = "" if each.tick is None else f"; next tick at t = {each.tick:.9g} s"
        yield f"{each.title}: {named_numbers(each.values)}{tick}"
    if view.bodies:
        yield from ending_lines(view.ending)


def _contact_lines(
    contact: ContactView, view: Screen, chosen: int, marks: Marks, width: int
) -> Iterator[str]:
    """Yield a contact: its force, and each element with its values and edges."""
    shared = "  (shared with other locks)" if contact.here.shared else ""
    if contact.name:
        yield contact.title
        yield f"  {contact.here.said}{shared}".rstrip()
    else:
        yield contact.here.written("v", "x", "F")
        yield from ending_lines(view.ending)
    chart, scales = contact.chart, contact.scales
    columns = [scales[name] for name in chart.variables]
    bar, most = BAR + max(0, width - WIDTH) // 4, 8 + max(0, width - WIDTH) // 4
    wide = max(5, min(most, max(len(state.name) for state in chart.states)))
    yield "  ".join(["  el", " ".join([f"{'state':<{wide}}", *_heads(contact, bar)]), "edges"])
    for i, each in enumerate(contact.elements, start=contact.first):
        lead = f"{'>' if i == chosen else ' '}{each.number:>3}  "
        pairs = zip(columns, each.variables, strict=True)
        cells = [f"{scale.number(value):>10}" for scale, value in pairs]
        if each.s is not None and each.ratio is not None:
            shown = f"{each.ratio:.3f}" if each.ratio < 100 else f"{each.ratio:.1e}"
            cells += [f"{scales['s'].number(each.s):>9}", f"{shown:>7}"]
            if len(each.variables) == 1:  # further variables take the place of the bar
                cells.append(_bar(each.ratio, marks, bar))
        cells += [f"{scales['F'].number(each.F):>10}"][: len(chart.velocities)]
        line = lead + " ".join([f"{short(each.state, wide):<{wide}}", *cells])
        edges = " ".join(
            f"{edge.priority}:"
            + "".join(" ?" if holds is None else marks.truth[holds] for holds in edge.clauses)
            + ("*" if edge.fired else "")
            for edge in each.edges
        )
        if len(line) + 2 + len(edges) <= width:
            yield f"{line}  {edges}"
        else:
            yield line
            yield f"      {edges}"


def _heads(contact: ContactView, bar: int) -> list[str]:
    """Return the headings of the values of an element, with the same widths."""
    chart = contact.chart
    named = {"s": "s", "F": "F_i"} | {name: name for name in chart.variables}
    heading = {
        name: f"{named[name]} [{scale.unit}]" if scale.unit else named[name]
        for name, scale in contact.scales.items()
    }
    names = [heading[name] for name in chart.variables]
    heads = [f"{short(name, 10):>10}" for name in names]
    if contact.elements[0].ratio is not None:
        heads += [f"{heading['s']:>9}", f"{short(f'|{chart.variables[0]}|/s', 7):>7}"]
        if len(names) == 1:
            heads.append(" " * (bar + 2))
    return [*heads, *[f"{heading['F']:>10}"][: len(chart.velocities)]]


def _bar(ratio: float, marks: Marks, wide: int) -> str:
    empty, full = tuple(marks.bar)
    filled = min(wide, round(wide * min(ratio, 1.0)))
    return f"[{full * filled}{empty * (wide - filled)}{'>' if ratio > 1 else ']'}"


def _ribbon_lines(ribbons: Ribbons, contacts: Sequence[ContactView], marks: Marks) -> Iterator[str]:
    """Yield the states of every element over time, and the current position."""
    drawn, names = marks.ribbon, labels(contacts)
    lead = _lead(names)
    scale = f"{ribbons.start:g} s"
    yield f"{' ' * lead}{scale}{f'{ribbons.end:g} s':>{len(ribbons.modes) - len(scale)}}"
    for i, label in enumerate(names):
        parts = (" " if mode is None else drawn[mode[i] % len(drawn)] for mode in ribbons.modes)
        yield f" {short(label, lead - 2):<{lead - 2}} {''.join(parts)}".rstrip()
    yield f"{' ' * lead}{' ' * ribbons.now}^"
    keys: dict[tuple[str, ...], list[str]] = {}
    for contact in contacts:
        keys.setdefault(tuple(s.name for s in contact.chart.states), []).append(contact.name)
    for number, (states, whose) in enumerate(keys.items(), start=1):
        who = f"{', '.join(whose)}: " if len(keys) > 1 else ""
        key = "  ".join(f"{drawn[j % len(drawn)]} {name}" for j, name in enumerate(states))
        last = "  ^ now  (blank: not computed)" if number == len(keys) else ""
        yield f"      {who}{key}{last}"


def ribbon_parts(view: Screen, width: int = WIDTH) -> int:
    """Return the number of characters for the states over time."""
    return width - _lead(labels(view.contacts))


def labels(contacts: Sequence[ContactView]) -> list[str]:
    """Return the labels of all elements."""
    return [
        f"{contact.name} {each.number}" if contact.name else f"E{each.number}"
        for contact in contacts
        for each in contact.elements
    ]


def _lead(labels: Sequence[str]) -> int:
    """Return the width of the labels of ribbons.

    >>> _lead(["E1"]), _lead(["bearing 1"]), _lead(["a very long name of a contact 12"])
    (6, 11, 22)
    """
    return min(22, max(6, 2 + max(map(len, labels))))


def ending_lines(ending: str) -> Iterator[str]:
    """Yield a note at the last row."""
    if ending == "end":
        yield "  end of the run"
    elif ending:
        yield f"  the run cannot continue: {ending}"
        yield "  go back and look, or poke a value to continue in a new branch"


def chart_lines(states: Sequence[StateView], marks: Marks, width: int = WIDTH) -> Iterator[str]:
    """Yield a chart as boxes, the active one marked, with the edges below each."""
    for state in states:
        lines = [state.name + ("  ACTIVE" if state.active else "")]
        lines += [f"  d{name} = {text}" for name, text in state.flow]
        lines += [f"  {name} = {text}" for name, text in state.forces]
        lines += ["  locked: v = 0, F is what holds it"] * state.locked
        box, lead = (marks.active, "> ") if state.active else (marks.box, "  ")
        yield from _boxed(lines, box, lead, width)
        for edge in state.edges:
            fired = "  FIRED" if edge.fired else ""
            yield f"     {edge.priority} {edge.name} -> {edge.target}{fired}"
            truths = " ".join("true" if holds else "false" for holds in edge.clauses)
            yield f"         [{edge.guard}]{f'  {truths}' if truths else ''}"


def _boxed(lines: Sequence[str], box: str, lead: str, width: int) -> Iterator[str]:
    left, across, right, side, low_left, low_right = tuple(box)
    lines = [short(line, width - 8) for line in lines]
    wide = max(30, *(len(line) for line in lines)) + 2
    yield f"  {left}{across * wide}{right}"
    for number, line in enumerate(lines):
        yield f"{'  ' if number else lead}{side} {line:<{wide - 1}}{side}"
    yield f"  {low_left}{across * wide}{low_right}"


def branch_lines(branches: Sequence[BranchView]) -> Iterator[str]:
    """Yield the branches of a session."""
    for each in branches:
        yield f"{'>' if each.current else ' '} {each.number}  {progress(each)}"
        if each.parent is not None:
            yield f"     from branch {each.parent} at t = {each.t_fork:.9g} s: {each.edits}"


def progress(branch: BranchView) -> str:
    """Return how far a branch has been computed."""
    how = {"": "not at its end", "end": "at its end"}.get(branch.outcome, "it cannot continue")
    return (
        f"{branch.rows} rows, {branch.transitions} transitions, computed to "
        f"t = {branch.t_computed:.9g} s; {how}"
    )


def breakpoint_text(point: Breakpoint) -> str:
    """Return the description of a breakpoint."""
    who = "all elements" if point.element is None else f"element {point.element + 1}"
    if point.contact:
        who = point.contact if point.element is None else f"{point.contact} {point.element + 1}"
    condition = f", if {point.condition}" if point.condition else ""
    hits = f", from hit {point.hits} on" if point.hits > 1 else ""
    where = "" if point.kind == "changes" else f", {who}"
    return f"{point.kind} {point.name}{where}{condition}{hits}"


def short(text: str, wide: int) -> str:
    """Return a text shortened to fit a column.

    >>> short("break_away_forward", 8)
    'break_a~'
    """
    return text if len(text) <= wide else text[: wide - 1] + "~"
