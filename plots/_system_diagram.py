"""Draw a system: bodies, contacts, signals, controllers, further states, and who acts on whom.

Everything is read from the system. Thick lines join a contact to the bodies that it acts on: their
velocities go one way, its force goes back. Thin arrows carry the values written on them; dashed
ones are read at ticks only. Signals are on the left, and a contact of a single body is next to it.

In the SVG, nodes have the classes ``signal``, ``sampled``, ``flow``, ``body`` and ``contact`` and
the id ``kind-name``; lines have the classes ``acts`` (contact and body) and ``reads``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import graphviz

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
from gms_fsm.systems.system import Body, Contact, System
from plots._labels import escape, printable, wrapped
from plots.drawings import DrawnGraph
from plots.style import (
    BLUE,
    BLUE_TINT,
    INK,
    MONO,
    PANEL,
    PAPER,
    SANS,
    TEXT_GREY,
    VERMILION,
    VERMILION_TINT,
)

__all__ = ["signal_text", "system_diagram"]

# Outline, fill and border of each kind.
LOOKS = {
    "signal": (BLUE, BLUE_TINT, 1),
    "sampled": (INK, PAPER, 1),
    "flow": (INK, PAPER, 1),
    "body": (VERMILION, VERMILION_TINT, 1),
    "contact": (INK, PANEL, 2),
}


@dataclass(frozen=True)
class Block:
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
    """

    kind: str
    name: str
    note: str
    texts: tuple[str, ...]
    reads: tuple[str, ...]

    @property
    def id(self) -> str:
        """The id in the picture."""
        return f"{self.kind}-{self.name}"


def system_diagram(system: System) -> DrawnGraph:
    """Draw a system.

    Parameters
    ----------
    system : System
        The system.

    Returns
    -------
    graphviz.Digraph
        The picture as a Graphviz graph.
    """
    graph = DrawnGraph(
        name=graphviz.escape(printable(system.name)),
        graph_attr={
            "rankdir": "LR",
            "bgcolor": PAPER,
            "pad": "0.2",
            "nodesep": "0.35",
            "ranksep": "0.5",
            "fontname": SANS,
            "label": f"<{_title(system)}>",
            "labelloc": "t",
            "labeljust": "l",
        },
        node_attr={"fontname": SANS, "shape": "plain"},
        edge_attr={
            "color": INK,
            "arrowsize": "0.7",
            "penwidth": "1.1",
            "fontname": MONO,
            "fontsize": "10",
            "fontcolor": TEXT_GREY,
        },
    )
    blocks = list(_blocks(system))
    graph.text = "\n".join([system.name, *map(_in_words, blocks)])
    for block in blocks:
        graph.node(block.id, f"<{_box(block)}>", id=block.id, **{"class": block.kind})
    _draw_contacts(graph, system)
    _draw_values(graph, blocks, _owners(system))
    return graph


def _in_words(block: Block) -> str:
    return "\n    ".join([f"  {block.note} {block.name}", *block.texts])


# --------------------------------------------------------------------------- what is drawn
def _blocks(system: System) -> Iterator[Block]:
    """Yield every part, from what drives to what is driven."""
    names = system.names
    for name, signal in system.signals.items():
        yield Block("signal", name, "signal", (signal_text(name, signal),), ())
    for part in system.sampled:
        trees = {each: parse_value(t, [*names, "period"]) for each, t in part.updates.items()}
        note = f"every {_seconds(part.period)}"
        if part.offset:
            note += f", first after {_seconds(part.offset)}"
        texts = tuple(_equation(each, tree) for each, tree in trees.items())
        yield Block("sampled", part.name, note, texts, _read(system, trees.values()))
    for name, text in system.flow.items():
        tree = parse_value(text, names)
        yield Block("flow", name, "state", (_equation(f"d{name}/dt", tree),), _read(system, [tree]))
    for body in system.bodies:
        yield _body(system, body)
    for contact in system.contacts:
        yield _contact(system, contact)


def _body(system: System, body: Body) -> Block:
    if body.velocity is not None:
        tree = _tree(body.velocity, system.names)
        texts = () if tree == Name(body.v) else (_equation(body.v, tree),)
        return Block("body", body.name, "driven body", texts, _read(system, [tree]))
    inertia, force = (_tree(each, system.names) for each in (body.inertia or 0.0, body.force))
    total = force
    for v, name in _forces(system):
        total = _less(total, _share(system, v, body), name)
    rate = Name(f"d{body.v}/dt")
    left = rate if inertia == Number(1.0) else Binary("*", inertia, rate)
    texts = (_equation(spell(left, MATLAB_LIKE), total),)
    return Block("body", body.name, "body", texts, _read(system, [inertia, force]))


def _contact(system: System, contact: Contact) -> Block:
    chart, bound = contact.chart, {n: _tree(t, system.names) for n, t in contact.inputs.items()}
    for name in chart.inputs:  # one of the same name in the system is bound without being named
        if name not in (*bound, *chart.velocities, "t", "x", "s") and name in system.names:
            bound[name] = Name(name)
    several = len(chart.velocities) > 1
    texts = [
        f"velocity{f' {own}' if several else ''}: {spell(_tree(v, system.names), MATLAB_LIKE)}"
        for own, v in zip(chart.velocities, contact.v, strict=True)
    ]
    texts += [_equation(name, tree) for name, tree in bound.items() if tree != Name(name)]
    note = "contact" if contact.period is None else f"contact, every {_seconds(contact.period)}"
    if contact.model is None:
        title = f"{chart.name} × {contact.n}" if contact.n > 1 else chart.name
    else:
        title = contact.model.title
    return Block("contact", contact.name, note, (title, *texts), _read(system, bound.values()))


def _forces(system: System) -> Iterator[tuple[str, str]]:
    """Yield each force: the text of its velocity, and what it is called."""
    for contact in system.contacts:
        for force, v in zip(contact.chart.force_names, contact.v, strict=True):
            yield v, f"{contact.name}.{force}"


def _share(system: System, v: str, body: Body) -> Value:
    """Return the coefficient of a body's velocity in that of a contact."""
    share = derivative(_tree(v, system.names), body.v)
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
            return f"{name} = {signal}"
        case Formula(text=text):
            return f"{name} = {text}"
        case Corners(times=times, held=held):
            return f"{name}: {times.size} {'corners' if held else 'samples'}"
    return f"{name}: a Python function"


# --------------------------------------------------------------------------- who acts on whom
def _owners(system: System) -> Mapping[str, str]:
    """Return for each name the id of the block that it comes from."""
    owners = {name: f"signal-{name}" for name in system.signals}
    owners |= {name: f"flow-{name}" for name in system.flow}
    owners |= {name: f"sampled-{each.name}" for each in system.sampled for name in each.updates}
    moved = {name: f"body-{body.name}" for body in system.bodies for name in (body.x, body.v)}
    # A body driven by a signal of the name of its velocity: the name is the signal's.
    return moved | owners


def _read(system: System, trees: Iterable[Value]) -> tuple[str, ...]:
    found = frozenset[str]().union(*map(names_in, trees))
    return tuple(name for name in system.names if name in found)


def _draw_contacts(graph: graphviz.Digraph, system: System) -> None:
    for contact in system.contacts:
        touched = [
            body
            for body in system.bodies
            if any(_share(system, v, body) != Number(0.0) for v in contact.v)
        ]
        place = f"contact-{contact.name}"
        for k, body in enumerate(touched):
            first, other = f"body-{body.name}", place
            if k:  # the contact is between its bodies, in the order in which they are given
                first, other = other, first
            graph.edge(
                first,
                other,
                id=f"acts-{contact.name}-{body.name}",
                dir="both",
                penwidth="2.2",
                **{"class": "acts"},
            )
        if len(touched) == 1:
            with graph.subgraph() as level:
                level.attr(rank="same")
                level.node(f"body-{touched[0].name}")
                level.node(place)


def _draw_values(
    graph: graphviz.Digraph, blocks: Iterable[Block], owners: Mapping[str, str]
) -> None:
    for block in blocks:
        carried: dict[str, list[str]] = {}
        for name in block.reads:
            source = owners.get(name, block.id)  # t and numbers come from nowhere
            if source != block.id:
                carried.setdefault(source, []).append(name)
        for source, names in carried.items():
            graph.edge(
                source,
                block.id,
                label=f" {', '.join(names)} ",
                id=f"reads-{source}-{block.id}",
                style="dashed" if block.kind == "sampled" else "solid",
                **{"class": "reads"},
            )


# --------------------------------------------------------------------------- texts
def _tree(text: str | float, names: Iterable[str]) -> Value:
    return parse_value(text, names) if isinstance(text, str) else Number(float(text))


def _equation(left: str, right: Value) -> str:
    return f"{left} = {spell(right, MATLAB_LIKE)}"


def _seconds(value: float) -> str:
    return f"{1e3 * value:g} ms" if value < 1.0 else f"{value:g} s"


def _title(system: System) -> str:
    key = "thick: velocity to the contact, force to the body; thin: values that are read"
    if system.sampled:
        key += "; dashed: at ticks only"
    return _rows([_text(system.name, bold=True), _text(key, size=9, colour=TEXT_GREY)])


def _box(block: Block) -> str:
    colour, fill, border = LOOKS[block.kind]
    title = f"{_text(block.name, bold=True)}&#160; {_text(block.note, colour=TEXT_GREY, size=10)}"
    boundary = 1 if block.kind == "contact" else 0  # the name of its chart
    rows = [title, *(_text(text, size=10) for text in block.texts[:boundary])]
    for text in block.texts[boundary:]:
        rows += [_text(line, face=MONO, size=10) for line in wrapped(text)]
    style = "" if block.kind in ("sampled", "flow") else 'STYLE="ROUNDED"'
    return _rows(rows, f'BORDER="{border}" COLOR="{colour}" BGCOLOR="{fill}" {style}')


def _rows(rows: Iterable[str], look: str = 'BORDER="0"') -> str:
    cells = "".join(f'<TR><TD ALIGN="LEFT">{row}</TD></TR>' for row in rows)
    return f'<TABLE {look} CELLBORDER="0" CELLSPACING="0" CELLPADDING="4">{cells}</TABLE>'


def _text(
    text: str, *, face: str = SANS, size: int = 12, colour: str = INK, bold: bool = False
) -> str:
    words = f"<B>{escape(text)}</B>" if bold else escape(text)
    return f'<FONT FACE="{face}" POINT-SIZE="{size}" COLOR="{colour}">{words}</FONT>'
