"""Draw a system: bodies, springs, contacts, signals, controllers, states, and who acts on whom.

Everything is read from the system. Signals are on the left, then come controllers and further
states, then the bodies and on the right springs and contacts. Thick lines join a spring or a
contact to the bodies that it acts on: their motion goes one way, its force goes back. Thin arrows
carry the values written on them; dashed ones are read at ticks only. Kinds of blocks differ in
shape: signals and contacts have round corners, bodies, springs and contacts thick outlines; what
holds its values between ticks has a staircase, a spring a zigzag, a damper without a spring a
dashpot.

In the SVG, nodes have the classes ``signal``, ``sampled``, ``flow``, ``body``, ``spring`` and
``contact`` and the id ``kind-name``; lines have the classes ``acts`` and ``reads``, and ids such
as ``reads-signal-r-sampled-pid-1``, the last number counting their pieces.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import graphviz

from gms_fsm.foundation.text import visible
from gms_fsm.language import (
    MATLAB_LIKE,
    Binary,
    Name,
    Negative,
    Number,
    Value,
    derivative,
    names_in,
    parse_value,
    spell,
)
from gms_fsm.systems.signals import Corners, Formula, Signal
from gms_fsm.systems.springs import field_of, pull, summed
from gms_fsm.systems.system import Body, Contact, Spring, System
from plots.charts.labels import escape, wrapped
from plots.output.drawings import DrawnGraph
from plots.style import INK, MONO, PANEL, PAPER, SANS, TEXT_GREY
from plots.systems.system_routes import Box, DiagramSheet, Join, routed
from plots.systems.wires import blank, caption, draw_path, placed

# Column, corners, fill and width of the outline of each kind.
LOOKS = {
    "signal": (0, "rounded,filled", PAPER, 1.1),
    "sampled": (1, "filled", PAPER, 1.1),
    "flow": (1, "filled", PAPER, 1.1),
    "let": (1, "filled", PAPER, 1.1),
    "supervisor": (1, "rounded,filled", PAPER, 1.1),
    "body": (2, "filled", PANEL, 1.8),
    "spring": (3, "filled", PAPER, 1.8),
    "contact": (3, "rounded,filled", PANEL, 1.8),
}
# Sizes in points; Graphviz would ask the fonts, and its programs have different ones.
TITLE_ROW, ROW, ABOVE, SIDE = 19.0, 15.0, 5.0, 8.0
WIDE, NARROW, BOLD = 6.1, 5.6, 7.4  # characters: 10 points mono, 10 points sans, 12 points bold
LONGEST = 36  # characters of a line
MARK = (20.0, 10.0)  # size of a symbol; its lines in parts of it
MARKS = {
    "hold": [[(0, 0), (1 / 3, 0), (1 / 3, 0.5), (2 / 3, 0.5), (2 / 3, 1), (1, 1)]],
    "spring": [[(0, 0.5), (0.2, 1), (0.4, 0), (0.6, 1), (0.8, 0), (1, 0.5)]],
    "damper": [
        [(0.7, 1), (0.3, 1), (0.3, 0.5), (0, 0.5), (0.3, 0.5), (0.3, 0), (0.7, 0)],
        [(1, 0.5), (0.55, 0.5), (0.55, 0.8), (0.55, 0.2)],
    ],
}
ACTS = 2.2  # width of a line between body and contact


@dataclass(frozen=True)
class DiagramBlock:
    """One part of a system, as it is drawn.

    Parameters
    ----------
    kind : str
        A key of `LOOKS`.
    name : str
        Its name.
    note : str
        What stands next to the name, such as ``driven body``.
    texts : tuple of str
        Equations.
    reads : tuple of str
        The names that its equations read.
    mark : str
        A key of `MARKS`, or empty.
    """

    kind: str
    name: str
    note: str
    texts: tuple[str, ...]
    reads: tuple[str, ...]
    mark: str = ""

    @property
    def id(self) -> str:
        """The id in the picture."""
        return f"{self.kind}-{self.name}"


def system_diagram(system: System) -> DrawnGraph:
    """Draw a system."""
    blocks = list(_blocks(system))
    graph = blank(graphviz.escape(visible(system.name)))
    graph.text = "\n".join([system.name, *map(_in_words, blocks)])
    columns = sorted({LOOKS[block.kind][0] for block in blocks})
    boxes = [Box(block.id, *_size(block), columns.index(LOOKS[block.kind][0])) for block in blocks]
    joins = [*_acting(system), *_reading(blocks, _owners(system))]
    sheet = routed(boxes, joins)
    _draw_title(graph, system, sheet)
    for block in blocks:
        _draw_block(graph, block, sheet.boxes[block.id])
    ticking = {block.id for block in blocks if block.kind == "sampled"}
    for join in joins:
        _draw_join(graph, join, sheet.paths[join.id], dashed=join.target in ticking)
    return graph


def _in_words(block: DiagramBlock) -> str:
    return "\n    ".join([f"  {block.note} {block.name}", *block.texts])


# --------------------------------------------------------------------------- what is drawn
def _blocks(system: System) -> Iterator[DiagramBlock]:
    """Yield every part, from what drives to what is driven."""
    names = system.readable
    for name, signal in system.signals.items():
        yield DiagramBlock("signal", name, "signal", (signal_text(name, signal),), ())
    for part in system.sampled:
        trees = {each: parse_value(t, [*names, "period"]) for each, t in part.updates.items()}
        note = f"every {_seconds(part.period)}"
        if part.offset:
            note += f", first after {_seconds(part.offset)}"
        texts = tuple(_equation(each, tree) for each, tree in trees.items())
        reads = _read(system, trees.values())
        yield DiagramBlock("sampled", part.name, note, texts, reads, "hold")
    for name, text in system.flow.items():
        tree = parse_value(text, names)
        yield DiagramBlock(
            "flow", name, "state", (_equation(f"d{name}/dt", tree),), _read(system, [tree])
        )
    for name, text in system.let.items():
        tree = parse_value(text, names)
        yield DiagramBlock("let", name, "value", (_equation(name, tree),), _read(system, [tree]))
    for body in system.bodies:
        yield _body(system, body)
    for index, spring in enumerate(system.springs):
        yield _spring(system, index, spring)
    for contact in system.machines:
        yield _contact(system, contact)


def _body(system: System, body: Body) -> DiagramBlock:
    if body.velocity is not None:
        tree = _tree(body.velocity, system.readable)
        texts = () if tree == Name(body.v) else (_equation(body.v, tree),)
        return DiagramBlock("body", body.name, "driven body", texts, _read(system, [tree]))
    inertia, force = (_tree(each, system.readable) for each in (body.inertia or 0.0, body.force))
    total = force
    for spring in system.springs:
        name = f"{spring.name}.F"
        if body.name == spring.first:
            total = _less(total, Number(-1.0), name)
        elif body.name == spring.second:
            total = _less(total, _tree(spring.ratio, system.readable), name)
    for v, name in _forces(system):
        total = _less(total, _share(system, v, body), name)
    rate = Name(f"d{body.v}/dt")
    left = rate if inertia == Number(1.0) else Binary("*", inertia, rate)
    texts = (_equation(spell(left, MATLAB_LIKE), total),)
    return DiagramBlock("body", body.name, "body", texts, _read(system, [inertia, force]))


def _spring(system: System, index: int, spring: Spring) -> DiagramBlock:
    bodies = {body.name: body for body in system.bodies}
    terms = pull(spring, bodies, partial(field_of, system, index))
    kind = "damper" if spring.k == 0.0 else "spring"
    text = _equation("F", summed(terms))
    reads = _read(system, [field_of(system, index, "rest")])
    return DiagramBlock("spring", spring.name, kind, (text,), reads, kind)


def _contact(system: System, contact: Contact) -> DiagramBlock:
    chart, bound = contact.chart, {n: _tree(t, system.readable) for n, t in contact.inputs.items()}
    for name in chart.inputs:  # one of the same name in the system is bound without being named
        if name not in (*bound, *chart.velocities, "t", "x", "s") and name in system.names:
            bound[name] = Name(name)
    several = len(chart.velocities) > 1
    texts = [
        f"velocity{f' {own}' if several else ''}: {spell(_tree(v, system.readable), MATLAB_LIKE)}"
        for own, v in zip(chart.velocities, contact.v, strict=True)
    ]
    texts += [_equation(name, tree) for name, tree in bound.items() if tree != Name(name)]
    kind = "contact" if contact.v else "supervisor"
    note = kind if contact.period is None else f"{kind}, every {_seconds(contact.period)}"
    if contact.model is None:
        title = f"{chart.name} × {contact.n}" if contact.n > 1 else chart.name
    else:
        title = contact.model.title
    mark = "" if contact.period is None else "hold"
    reads = _read(system, bound.values())
    return DiagramBlock(kind, contact.name, note, (title, *texts), reads, mark)


def _forces(system: System) -> Iterator[tuple[str, str]]:
    """Yield each force: the text of its velocity, and what it is called."""
    for contact in system.contacts:
        for force, v in zip(contact.chart.force_names, contact.v, strict=True):
            yield v, f"{contact.name}.{force}"


def _share(system: System, v: str, body: Body) -> Value:
    """Return the coefficient of a body's velocity in that of a contact."""
    share = derivative(_tree(v, system.readable), body.v)
    return Number(0.0) if share is None else share


def _less(total: Value, share: Value, force: str) -> Value:
    """Return a sum of forces minus a share of another one."""
    term: Value = Name(force)
    negative = isinstance(share, Negative) or (isinstance(share, Number) and share.value < 0)
    match share:
        case Number(0.0):
            return total
        case Number(value):
            term = term if abs(value) == 1.0 else Binary("*", Number(abs(value)), term)
        case Negative(operand):
            term = Binary("*", operand, term)
        case _:
            term = Binary("*", share, term)
    if total == Number(0.0):
        return term if negative else Negative(term)
    return Binary("+" if negative else "-", total, term)


def signal_text(name: str, signal: Signal | str) -> str:
    """Return what a signal is, in one line."""
    match signal:
        case str():
            return f"{name} = {signal.replace('**', '^')}"
        case Formula(text=text):
            return f"{name} = {text.replace('**', '^')}"
        case Corners(times=times, held=held):
            return f"{name}: {times.size} {'corners' if held else 'samples'}"
    return f"{name}: a Python function"


# --------------------------------------------------------------------------- who acts on whom
def _owners(system: System) -> Mapping[str, str]:
    """Return for each name the id of the block that it comes from."""
    owners = {name: f"signal-{name}" for name in system.signals}
    owners |= {name: f"flow-{name}" for name in system.flow}
    owners |= {name: f"let-{name}" for name in system.let}
    owners |= {name: f"sampled-{each.name}" for each in system.sampled for name in each.updates}
    for each in system.machines:
        block = f"{'contact' if each.v else 'supervisor'}-{each.name}"
        owners |= {name: block for name in system.readable if f"{each.name}." in name}
    moved = {name: f"body-{body.name}" for body in system.bodies for name in (body.x, body.v)}
    # A body driven by a signal of the name of its velocity: the name is the signal's.
    return moved | owners


def _read(system: System, trees: Iterable[Value]) -> tuple[str, ...]:
    found = frozenset[str]().union(*map(names_in, trees))
    return tuple(name for name in system.readable if name in found)


def _acting(system: System) -> Iterator[Join]:
    for spring in system.springs:
        for end in (spring.first, spring.second):
            if end is not None:
                name = f"acts-{spring.name}-{end}"
                yield Join(name, f"body-{end}", f"spring-{spring.name}")
    for contact in system.contacts:
        for body in system.bodies:
            if any(_share(system, v, body) != Number(0.0) for v in contact.v):
                name = f"acts-{contact.name}-{body.name}"
                yield Join(name, f"body-{body.name}", f"contact-{contact.name}")


def _reading(blocks: Iterable[DiagramBlock], owners: Mapping[str, str]) -> Iterator[Join]:
    for block in blocks:
        carried: dict[str, list[str]] = {}
        for name in block.reads:
            source = owners.get(name, block.id)  # t and numbers come from nowhere
            if source != block.id:
                carried.setdefault(source, []).append(name)
        for source, names in carried.items():
            yield Join(f"reads-{source}-{block.id}", source, block.id, ", ".join(names))


# --------------------------------------------------------------------------- drawing
def _draw_block(graph: graphviz.Digraph, block: DiagramBlock, box: Box) -> None:
    _, style, fill, line = LOOKS[block.kind]
    look = {"shape": "box", "style": style, "fillcolor": fill, "penwidth": f"{line:g}"}
    look["class"] = block.kind
    label = f"<{_rows(_lines(block), box)}>"
    placed(graph, block.id, (box.x, box.y), (box.width, box.height), label, **look)
    for k, places in enumerate(MARKS.get(block.mark, ())):
        _draw_mark(graph, f"{block.id}-{block.mark}{k or ''}", block.mark, places, box)


def _draw_mark(
    graph: graphviz.Digraph, name: str, kind: str, places: list[tuple[float, float]], box: Box
) -> None:
    """Draw a line of a symbol at the upper right of a block."""
    wide, high = MARK
    x, y = box.x + 0.5 * box.width - wide - 7.0, box.y + 0.5 * box.height - high - 8.0
    corners = [(x + wide * a, y + high * b) for a, b in places]
    draw_path(graph, name, corners, arrow="none", kind=kind)


def _draw_join(
    graph: graphviz.Digraph, join: Join, path: list[tuple[float, float]], *, dashed: bool
) -> None:
    style = "dashed" if dashed else "solid"
    if join.id.startswith("acts-"):
        look: dict[str, Any] = {"arrow": "both", "width": ACTS, "tip": ACTS, "kind": "acts"}
    else:
        look = {"arrow": "forward", "kind": "reads"}
    draw_path(graph, join.id, path, style=style, **look)
    if join.text:
        wide = WIDE * len(join.text)
        at = (path[0][0] + 4.0 + 0.5 * wide, path[0][1] + 8.0)
        text = _text(join.text, face=MONO, size=10, colour=TEXT_GREY)
        caption(graph, f"{join.id}-name", at, text, width=wide, height="0.17")


def _draw_title(graph: graphviz.Digraph, system: System, sheet: DiagramSheet) -> None:
    key = "thick: motion one way, force back to the body; thin: values that are read"
    if system.sampled:
        key += "; dashed: at ticks only"
    rows = [_text(visible(system.name), bold=True), _text(key, size=10, colour=TEXT_GREY)]
    wide = max(BOLD * len(system.name), NARROW * len(key))
    box = Box("title", wide, 40.0, 0)
    at = (sheet.left + 0.5 * wide, sheet.top + 42.0)
    label = f"<{_rows(rows, box)}>"
    placed(graph, "title", at, (wide, 40.0), label, shape="plaintext")


# --------------------------------------------------------------------------- texts
def _tree(text: str | float, names: Iterable[str]) -> Value:
    return parse_value(text, names) if isinstance(text, str) else Number(float(text))


def _equation(left: str, right: Value) -> str:
    return f"{left} = {spell(right, MATLAB_LIKE)}"


def _seconds(value: float) -> str:
    return f"{1e3 * value:g} ms" if value < 1.0 else f"{value:g} s"


def _lines(block: DiagramBlock) -> list[str]:
    title = f"{_text(block.name, bold=True)}&#160; {_text(block.note, colour=TEXT_GREY, size=10)}"
    boundary = 1 if block.kind == "contact" else 0  # the name of its chart
    rows = [title]
    for k, text in enumerate(block.texts):
        face = SANS if k < boundary else MONO
        rows += [_text(line, face=face, size=10) for line in wrapped(text, LONGEST)]
    return rows


def _size(block: DiagramBlock) -> tuple[float, float]:
    """Return the width and the height of a block."""
    shown = [line for text in block.texts for line in wrapped(text, LONGEST)]
    title = (
        BOLD * len(block.name) + NARROW * (len(block.note) + 2) + (MARK[0] + 8) * bool(block.mark)
    )
    wide = max(title, *(WIDE * len(line) for line in shown), 60.0)
    return wide + 2 * SIDE, TITLE_ROW + ROW * len(shown) + 2 * ABOVE


def _rows(rows: Iterable[str], box: Box) -> str:
    cells = "".join(
        f'<TR><TD ALIGN="LEFT" HEIGHT="{TITLE_ROW if k == 0 else ROW:g}">{row}</TD></TR>'
        for k, row in enumerate(rows)
    )
    # As wide as the block, so that texts begin at its left side.
    wide = box.width - 2 * SIDE * (box.id != "title")
    look = 'BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="0"'
    return f'<TABLE {look} WIDTH="{wide:.0f}">{cells}</TABLE>'


def _text(
    text: str, *, face: str = SANS, size: int = 12, colour: str = INK, bold: bool = False
) -> str:
    words = f"<B>{escape(text)}</B>" if bold else escape(text)
    return f'<FONT FACE="{face}" POINT-SIZE="{size}" COLOR="{colour}">{words}</FONT>'
