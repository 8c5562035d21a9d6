"""Draw a mechanism as a figure: places of `plots.systems.mechanical_layout`, with the symbols."""

from __future__ import annotations

import textwrap

from gms_fsm.foundation.text import visible
from gms_fsm.language import names_in, parse_value
from gms_fsm.systems.system import System
from plots.style import PANEL, PAPER, RC, TEXT_GREY
from plots.style.matplotlib import Figure, rc_context
from plots.systems.mechanical_layout import (
    ABOVE,
    BRISTLE,
    LEG,
    STUB,
    BodyColumn,
    DrawnSpring,
    Item,
    MechanismLayout,
    Touch,
    arranged,
    force_of,
    label_of,
    motion_of,
    slots_of,
    written,
)
from plots.systems.mechanical_symbols import (
    LINE,
    NAME,
    UNIT,
    Pen,
    damper_points,
    formula,
    spring_points,
    width,
)
from plots.systems.system_diagram import signal_text

MARGIN = 0.3
FOOT = 90  # characters of a line below the drawing
ROUND, BEND = 0.3, 0.4  # of what turns: corners of its box, heights of its arrows


def mechanical_figure(system: System) -> Figure:
    """Draw a system as a mechanism; see `plots.systems.mechanism.schematic`."""
    layout = arranged(system)
    with rc_context(RC):
        figure = Figure()
        ax = figure.add_axes((0, 0, 1, 1))
        ax.set_axis_off()
        pen = Pen(ax)
        _columns(pen, layout)
        _belts(pen, layout)
        for place, items in layout.gaps.items():
            _gap(pen, layout, place, items)
        _over(pen, layout)
        left, bottom, right, top = _extent(pen)
        foot = _sources(system)
        for k, line in enumerate(foot):
            pen.text(left, bottom - 0.45 - LINE * k, line, ha="left", colour=TEXT_GREY)
        title = visible(system.name)
        pen.text(left, top + 0.5, title, size=10, bold=True, ha="left", gid="title")
        bottom -= 0.3 + LINE * len(foot) if foot else 0.0
        widest = max([width(title, 10, bold=True), *(width(line) for line in foot)])
        right = max(right, left + widest)
        x0, x1, y0, y1 = left - MARGIN, right + MARGIN, bottom - MARGIN, top + 0.5 + MARGIN + 0.1
        ax.set(xlim=(x0, x1), ylim=(y0, y1))
        figure.set_size_inches(UNIT * (x1 - x0), UNIT * (y1 - y0))
    return figure


def _extent(pen: Pen) -> tuple[float, float, float, float]:
    """Return what the drawing covers: left, bottom, right, top."""
    figure = pen.ax.figure
    # One inch of the figure is one inch of the drawing, whatever it covers.
    pen.ax.set(xlim=(0, 10), ylim=(0, 10))
    figure.set_size_inches(10 * UNIT, 10 * UNIT)  # type: ignore[union-attr]
    inverse = pen.ax.transData.inverted()
    boxes = [inverse.transform(each.get_window_extent()) for each in pen.drawn]
    return (
        float(min(box[0][0] for box in boxes)),
        float(min(box[0][1] for box in boxes)),
        float(max(box[1][0] for box in boxes)),
        float(max(box[1][1] for box in boxes)),
    )


# --------------------------------------------------------------------------- bodies
def _columns(pen: Pen, layout: MechanismLayout) -> None:
    for column in layout.columns:
        body, high = column.body, layout.high
        fill, corner = PAPER if body.driven else PANEL, ROUND if body.rotary else 0.0
        gid = f"body {body.name}"
        pen.box(column.left, 0.0, column.width, high, gid, fill=fill, corner=corner)
        name, inertia = column.texts
        middle = column.left + 0.5 * column.width
        rise = 0.17 if inertia else 0.0
        pen.text(middle, 0.5 * high + rise, name, size=NAME, bold=True)
        if inertia:
            pen.text(middle, 0.5 * high - rise, inertia)
        _motion(pen, column, high)
        _force(pen, column, high)
    for slot, x in slots_of(layout.columns):
        y = layout.belts[slot.belt] if slot.belt else -BRISTLE
        if slot.touch is None:
            _legs(pen, slot.links, x)
        else:
            _below(pen, slot.touch, x, x + slot.width, y, belt=bool(slot.belt))


def _motion(pen: Pen, column: BodyColumn, high: float) -> None:
    """Draw the direction in which the position of a body counts, or how a driven body moves."""
    body, x, y = column.body, column.left + 0.3, high + 0.35
    gid, lw = (f"velocity {body.name}", 1.8) if body.driven else (f"position {body.name}", 0.9)
    match body.motion:
        case "turning":
            pen.arrow((x, y - 0.15), (x + 0.7, y - 0.15), gid, lw=lw, bend=BEND)
        case "normal":
            x += 0.2
            if not body.driven:
                pen.line([(x - 0.17, high + 0.1), (x + 0.17, high + 0.1)], lw=0.9)
            pen.arrow((x, high + 0.1), (x, high + 0.7), gid, lw=lw)
            x -= 0.6
        case _:
            if not body.driven:
                pen.line([(x, y - 0.17), (x, y + 0.17)], lw=0.9)
            pen.arrow((x, y), (x + 0.7, y), gid, lw=lw)
    pen.text(x + 0.8, y, column.motion, ha="left")


def _force(pen: Pen, column: BodyColumn, high: float) -> None:
    """Draw what acts on a body besides springs, dampers and contacts, as if it were positive."""
    if not column.force:
        return
    x, y = column.left + 0.12, high + 0.95
    gid, text = f"force {column.body.name}", x + 0.9
    if column.body.motion == "normal":
        pen.arrow((x, high), (x, y + 0.2), gid)
        text = x + 0.25
    else:
        turns = column.body.rotary
        pen.line([(x, high - 0.2 * ROUND * turns), (x, y)])  # from the round corner
        pen.arrow((x, y), (x + 0.8, y), gid, bend=BEND * turns)
    lines = column.force
    for k, line in enumerate(lines):
        pen.text(text, y + LINE * (len(lines) - 1 - k), line, ha="left")


def _below(pen: Pen, touch: Touch, left: float, right: float, y: float, *, belt: bool) -> None:
    """Draw a contact under a body."""
    middle, half = 0.5 * (left + right), 0.6
    name, gid = touch.contact.name, f"contact {touch.contact.name}"
    if touch.symbol == "friction":
        if belt and y < -BRISTLE:  # a leg down to the belt
            pen.line([(middle, 0.0), (middle, y + BRISTLE)], lw=2.0)
        pen.bristles(middle - half, middle + half, y + BRISTLE, y, gid)
    else:
        pen.box(middle - half, y, 2 * half, BRISTLE, gid, fill=PAPER)
    if not belt:
        pen.floor(middle - half - 0.1, middle + half + 0.1, y)
    under = y - (0.5 if belt else 0.36)
    pen.text(middle, under, name, size=NAME, bold=True)
    for k, line in enumerate(label_of(touch)):
        pen.text(middle, under - LINE * (k + 1), line, colour=TEXT_GREY)


def _legs(pen: Pen, links: tuple[DrawnSpring, ...], left: float) -> None:
    """Draw springs and dampers between a body and the ground below it."""
    x = left + 0.35
    for link in links:
        points = spring_points if link.kind == "spring" else damper_points
        upright = points(-LEG, 0.0, x)[:, ::-1]
        pen.line(upright, gid=f"{link.kind} {link.constant}")
        pen.floor(x - 0.25, x + 0.25, -LEG)
        pen.text(x + 0.2, -0.5 * LEG, link.label, ha="left")
        x += 0.65 + width(link.label)


def _belts(pen: Pen, layout: MechanismLayout) -> None:
    for name, y in layout.belts.items():
        own = ((slot, x) for slot, x in slots_of(layout.columns) if slot.belt == name)
        spans = [(x, x + slot.width) for slot, x in own]
        left, right = min(span[0] for span in spans) - 0.2, max(span[1] for span in spans) + 0.2
        pen.box(left, y - 0.28, right - left, 0.28, f"body {name}", fill=PAPER)
        body = layout.bodies[name]
        start, end = (right + 0.1, y - 0.14), (right + 0.8, y - 0.14)
        bend = BEND * body.rotary
        pen.arrow(start, end, f"velocity {name}", lw=1.8, bend=bend)
        pen.text(right + 0.9, y + 0.03, name, size=NAME, bold=True, ha="left")
        pen.text(right + 0.9, y - 0.29, motion_of(body), ha="left")


# --------------------------------------------------------------------------- between bodies
def _gap(pen: Pen, layout: MechanismLayout, place: int, items: list[Item]) -> None:
    """Draw what lies to the left of a column, one above the other."""
    if not items:
        return
    columns, last = layout.columns, len(layout.columns)
    start = columns[place - 1].right if place else columns[0].left - layout.widths[0]
    end = columns[place].left if place < last else columns[-1].right + layout.widths[last]
    stubs = STUB * len(layout.over)
    used = sum(each.height for each in items)
    y = 0.5 * (layout.high - stubs + used)
    for item in items:
        middle = y - 0.5 * item.height
        low, high = y - item.height + 0.15, y - 0.15
        left, right = start, end
        if not item.left:
            left = start + 0.3 if place == 0 else max(start + 0.4, end - item.width)
            _anchor(pen, item, left, middle, low, high, way=-1)
        if not item.right:
            right = end - 0.3 if place == last else min(end - 0.4, start + item.width)
            _anchor(pen, item, right, middle, low, high, way=1)
        _item(pen, item, left, right, middle)
        y -= item.height


def _anchor(pen: Pen, item: Item, x: float, y: float, low: float, high: float, way: int) -> None:
    """Draw the end of an item that is at no body: a wall, or a point that moves."""
    if not item.drive:
        pen.wall(x, low, high, way)
        return
    pen.line([(x, y - 0.3), (x, y + 0.3)], lw=1.8)
    away = x if way > 0 else x - 0.9
    pen.arrow((away + 0.1, y), (away + 0.8, y), "velocity end", lw=1.8)
    text_x = x + 0.9 if way > 0 else x - 0.9
    pen.text(text_x, y, item.drive, ha="left" if way > 0 else "right")


def _over(pen: Pen, layout: MechanismLayout) -> None:
    """Draw what passes above other bodies."""
    y = layout.high + layout.head + 0.3
    for k, item in enumerate(layout.over):
        one, other = (layout.columns[layout.place(each)] for each in (item.left, item.right))
        height = layout.high - STUB * (k + 0.6)
        away = max(one.right, one.left + one.top) + 0.15 + STUB * k
        back = other.left - 0.2 - STUB * k
        middle = y + 0.5 * item.height
        pen.line([(one.right, height), (away, height), (away, middle)])
        pen.line([(other.left, height), (back, height), (back, middle)])
        _item(pen, item, away, back, middle)
        y += item.height


def _item(pen: Pen, item: Item, left: float, right: float, y: float) -> None:
    """Draw springs, dampers or a contact between two places."""
    if item.touch is not None:
        y += 0.5 * item.height - ABOVE
    left = _gear(pen, item.ratios[0], left, y, 1)
    right = _gear(pen, item.ratios[1], right, y, -1)
    if item.touch is None:
        _links(pen, item.links, left, right, y)
        return
    name, lines = item.touch.contact.name, label_of(item.touch)
    gid = f"contact {name}"
    match item.touch.symbol:
        case "friction":
            pen.friction_between(left, right, y, gid)
        case "backlash":
            pen.backlash(left, right, y, gid)
        case "clutch":
            pen.clutch(left, right, y, gid)
        case "stop":
            face, post = (left, right) if item.left else (right, left)
            pen.stop(face, post, y, gid)
        case _:
            middle = 0.5 * (left + right)
            pen.line([(left, y), (middle - 0.4, y)])
            pen.line([(middle + 0.4, y), (right, y)])
            pen.box(middle - 0.4, y - 0.25, 0.8, 0.5, gid, fill=PAPER)
    middle = 0.5 * (left + right)
    pen.text(middle, y + 0.5, name, size=NAME, bold=True)
    for k, line in enumerate(lines):
        pen.text(middle, y - 0.5 - LINE * k, line, colour=TEXT_GREY)


def _gear(pen: Pen, ratio: str, x: float, y: float, way: int) -> float:
    """Draw a gear ratio in the line that leaves a body, and return where the line goes on."""
    if not ratio:
        return x
    wide = width(ratio) + 0.25
    near = x + 0.15 * way
    pen.line([(x, y), (near, y)])
    pen.box(min(near, near + wide * way), y - 0.2, wide, 0.4, fill=PAPER, line=1.0)
    pen.text(near + 0.5 * wide * way, y, ratio)
    return near + wide * way


def _links(pen: Pen, links: tuple[DrawnSpring, ...], left: float, right: float, y: float) -> None:
    """Draw a spring, a damper, or both in parallel."""
    heights = {"spring": y + 0.25, "damper": y - 0.25} if len(links) == 2 else {links[0].kind: y}
    inner_left, inner_right = left, right
    if len(links) == 2:  # frames that connect both ends
        inner_left, inner_right = left + 0.2, right - 0.2
        for x, end in ((inner_left, left), (inner_right, right)):
            pen.line([(x, y - 0.25), (x, y + 0.25)])
            pen.line([(x, y), (end, y)])
    middle, half = 0.5 * (left + right), min(0.9, 0.5 * (inner_right - inner_left))
    for link in links:
        at, a, b = heights[link.kind], middle - half, middle + half
        points = spring_points(a, b, at) if link.kind == "spring" else damper_points(a, b, at)
        pen.line(points, gid=f"{link.kind} {link.constant}")
        if a > inner_left:
            pen.line([(inner_left, at), (a, at)])
            pen.line([(b, at), (inner_right, at)])
        pen.text(middle, at + (0.32 if link.kind == "spring" else -0.34), link.label)


# --------------------------------------------------------------------------- what is written below
def _sources(system: System) -> list[str]:
    """Return where signals, states and sampled values come from that stand in the picture."""
    given = [each.velocity for each in system.bodies if each.velocity is not None]
    given += [each.rest for each in system.springs]
    used = {name for text in given for name in names_in(parse_value(str(text), system.readable))}
    used |= {name for body in system.bodies for name in names_in(force_of(system, body))}
    lines = []
    flows = {name: text for name, text in system.flow.items() if name in used}
    for text in flows.values():
        used |= names_in(parse_value(text, system.readable))
    for name, text in reversed([*system.let.items()]):  # earlier ones are used by later ones
        used |= names_in(parse_value(text, system.readable)) if name in used else set()
    for name, signal in system.signals.items():
        if name in used:
            lines += _folded(signal_text(name, signal))
    for sampled in system.sampled:
        own = [name for name in sampled.updates if name in used]
        if own:
            every = (
                f"{1e3 * sampled.period:g} ms" if sampled.period < 1 else f"{sampled.period:g} s"
            )
            lines.append(f"{', '.join(map(formula, own))}: from {sampled.name}, every {every}")
    for name, text in flows.items():
        lines += _folded(f"d{name}/dt = {text}")
    for name, text in system.let.items():
        lines += _folded(f"{name} = {text}") if name in used else []
    return lines


def _folded(text: str) -> list[str]:
    """Return an equation as a formula, or a long one as lines of plain text."""
    if "=" in text and len(text) <= FOOT:
        return [written(text)]
    lines = textwrap.wrap(visible(text), FOOT, subsequent_indent="    ")
    return [line.replace("$", r"\$") for line in lines]
