"""Where the parts of a mechanical drawing are: bodies in a row, what is between them in lanes.

Bodies stand next to each other; a driven body that others only rub on is a belt below them.
Springs, dampers and contacts between two neighbours lie one above the other in the gap between
them. What joins bodies that are no neighbours passes above the others. Friction on the ground or on
a belt is below its body, an end stop on the side on which it is hit; so are the springs of a body
that moves normal to the ground.
"""

from __future__ import annotations

import textwrap
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import permutations

from gms_fsm.charts.registry import charts
from gms_fsm.foundation.quantities import JOINED
from gms_fsm.foundation.text import visible
from gms_fsm.language import (
    MATLAB_LIKE,
    Negative,
    Number,
    Value,
    derivative,
    names_in,
    parse_value,
    spell,
)
from gms_fsm.systems.system import Body, Contact, Spring, System
from plots.charts.labels import wrapped
from plots.systems.mechanical_symbols import LINE, NAME, formula, width

LONGEST = 30  # characters of a line of a force
NARROW = 20  # characters of a line under a contact
ABOVE = 0.75  # from the top of a contact's lane to the middle of its symbol
MOST_ORDERED = 7  # bodies; of more, all orders are too many to try
BELOW = 1.75  # from the ground to a belt under it, and from one belt to the next
BRISTLE = 0.35  # from the bottom of a body to what it rubs on
LEG = 1.3  # from the bottom of a body to the ground under a spring
STUB = 0.25  # between lines that pass above other bodies
GROUND = ""  # stands for the name of a body where there is none
# Contacts with a symbol of their own; all other included charts, and those that can lock, are
# friction.
SYMBOLS = {"backlash": "backlash", "end-stop": "stop", "dog-clutch": "clutch"}
# Numbers that belong into the picture: how far a stop is, how wide a play.
SHOWN = {"stop": ("x_s",), "backlash": ("gap",)}


@dataclass(frozen=True)
class DrawnSpring:
    """A spring or a damper: ``kind`` says which; the label is a formula."""

    kind: str
    constant: str
    label: str


@dataclass(frozen=True)
class Touch:
    """A contact, how it is drawn, and by body the sign and the size of its share in the motion."""

    contact: Contact
    symbol: str
    shares: Mapping[str, tuple[int, str]]


@dataclass(frozen=True)
class Item:
    """What lies in one lane: a spring and a damper in parallel, one of them, or a contact.

    Parameters
    ----------
    left, right : str
        The bodies at its ends; `GROUND` is the ground, or a point that moves by itself.
    ratios : (str, str)
        The gear ratios there, as formulas; empty for 1.
    links : tuple of DrawnSpring
        At most one spring and one damper.
    drive : str
        How an end that is no body moves, as a formula; empty for the ground.
    touch : Touch or None
        Instead, a contact.
    """

    left: str
    right: str
    ratios: tuple[str, str] = ("", "")
    links: tuple[DrawnSpring, ...] = ()
    drive: str = ""
    touch: Touch | None = None

    @property
    def height(self) -> float:
        """Height of its lane."""
        if self.touch is not None:
            return ABOVE + 0.45 + LINE * len(label_of(self.touch))
        return 1.7 if len(self.links) == 2 else 1.1

    @property
    def width(self) -> float:
        """Width that it needs at least."""
        if self.touch is not None:
            texts = [width(line) for line in label_of(self.touch)]
            wide = max(1.7, width(self.touch.contact.name, NAME, bold=True), *texts)
        else:
            wide = max(2.0, 0.6 + max(width(link.label) for link in self.links))
        geared = sum(width(each) + 0.5 for each in self.ratios if each)
        return wide + 0.3 + geared


@dataclass(frozen=True)
class Slot:
    """What is below a body: a contact with the ground or with a belt, or springs to the ground."""

    touch: Touch | None
    belt: str = GROUND
    links: tuple[DrawnSpring, ...] = ()

    @property
    def width(self) -> float:
        """Width that it needs."""
        if self.touch is None:
            return sum(0.65 + width(link.label) for link in self.links) + 0.3
        texts = [width(line) for line in label_of(self.touch)]
        return 0.35 + max(1.2, width(self.touch.contact.name, NAME, bold=True), *texts)


@dataclass
class BodyColumn:
    """A body of the row, and where it is.

    Parameters
    ----------
    body : Body
        Which.
    slots : tuple of Slot
        Contacts below it.
    force : tuple of str
        Lines of the other force on it.
    left : float
        Left side of its box.
    """

    body: Body
    slots: tuple[Slot, ...]
    force: tuple[str, ...]
    left: float = 0.0

    @property
    def texts(self) -> tuple[str, str]:
        """What stands in the box: the name, and the inertia as a formula."""
        inertia = self.body.inertia
        shown = "" if inertia is None else written(inertia)
        return visible(self.body.name), shown if len(shown) <= 2 * LONGEST else ""

    @property
    def motion(self) -> str:
        """What stands at the arrow of its motion."""
        body = self.body
        if body.velocity is None:
            return formula(body.x)
        return motion_of(body)

    @property
    def width(self) -> float:
        """Width of its box."""
        name, inertia = self.texts
        slots = sum(each.width for each in self.slots)
        return max(1.5, width(name, NAME, bold=True) + 0.4, width(inertia) + 0.4, slots + 0.1)

    @property
    def right(self) -> float:
        """Right side of its box."""
        return self.left + self.width

    @property
    def top(self) -> float:
        """Width of what stands above its box."""
        force = max((width(line) for line in self.force), default=-1.0)
        return max(1.15 + width(self.motion), 1.05 + force)


@dataclass
class MechanismLayout:
    """A mechanical drawing as places.

    Parameters
    ----------
    columns : list of BodyColumn
        Bodies from left to right.
    gaps : dict of int to list of Item
        What lies to the left of each column, from above; the last one is to the right of all.
    over : list of Item
        What passes above.
    belts : dict of str to float
        Height of the top of each belt.
    bodies : dict of str to Body
        By name.
    high : float
        Height of the boxes.
    widths : dict of int to float
        Of the gaps.
    """

    columns: list[BodyColumn]
    gaps: dict[int, list[Item]]
    over: list[Item]
    belts: dict[str, float]
    bodies: dict[str, Body]
    high: float = 0.0
    widths: dict[int, float] = field(default_factory=dict)

    def place(self, body: str) -> int:
        """Return which column a body is."""
        return next(i for i, each in enumerate(self.columns) if each.body.name == body)

    @property
    def head(self) -> float:
        """Height of what stands above the boxes."""
        lines = max((len(each.force) for each in self.columns), default=0)
        return 0.75 + (0.35 + LINE * lines if lines else 0.0)


def arranged(system: System) -> MechanismLayout:
    """Return where everything is: each spring, force and contact once."""
    bodies = {each.name: each for each in system.bodies}
    touches = [_touch(system, each) for each in system.contacts]
    belts = _belts(system, touches)
    below = _slots(touches, belts)
    level = [*_sprung(system), *_touching(touches, belts)]
    row = _ordered([name for name in bodies if name not in belts], level)
    for item in [each for each in level if _is_leg(bodies[each.left], each)]:
        level.remove(item)
        below[item.left].append(Slot(None, links=item.links))
    columns = [
        BodyColumn(bodies[name], tuple(below[name]), _lines(force_of(system, bodies[name])))
        for name in row
    ]
    layout = MechanismLayout(columns, defaultdict(list), [], {}, bodies)
    for item in level:
        _put(layout, item)
    _place(layout)
    _place_belts(layout, belts)
    return layout


def _is_leg(body: Body, item: Item) -> bool:
    """Return whether springs stand between a body and the ground below it."""
    to_ground = item.right == GROUND and item.touch is None and not item.drive
    return body.motion == "normal" and to_ground


def label_of(touch: Touch) -> list[str]:
    """Return the lines under the symbol of a contact."""
    contact = touch.contact
    count = f" × {contact.n}" if contact.n > 1 else ""
    name = visible(contact.chart.name).replace(" law", f"{JOINED}law")
    lines = _wrapped(f"{name}{count.replace(' ', JOINED)}")
    if _of_many(touch):
        lines += [formula(v) for v in contact.v]
    for name in SHOWN.get(touch.symbol, ()):
        lines.append(_number(touch, name))
    return lines


def _of_many(touch: Touch) -> bool:
    """Return whether a contact has more velocities or bodies than a line has ends."""
    return len(touch.shares) > 2 or len(touch.contact.v) > 1


def _number(touch: Touch, name: str) -> str:
    """Return a number of a contact, which is a length or an angle."""
    value = touch.contact.values[name]
    shown = f"{value:.4g}" if isinstance(value, int | float) else "…"
    return f"{formula(name)} = {shown} {touch.contact.chart.unit(name)}"


def _wrapped(text: str) -> list[str]:
    lines = textwrap.wrap(text, NARROW, break_long_words=False)
    return [line.replace(JOINED, " ") for line in lines]


def force_of(system: System, body: Body) -> Value:
    """Return what the text of a body's force says; 0 for a driven one."""
    return Number(0.0) if body.driven else parse_value(str(body.force), system.readable)


def written(text: str | float) -> str:
    """Return the text of an expression, or a number, as a formula."""
    plain = f"{text:g}" if not isinstance(text, str) else text
    return formula(plain.replace("**", "^"))


# --------------------------------------------------------------------------- who is where
def _touch(system: System, contact: Contact) -> Touch:
    shares: dict[str, tuple[int, str]] = {}
    for text in contact.v:
        tree = parse_value(text, system.readable)
        for body in system.bodies:
            share = derivative(tree, body.v)
            if share is not None and share != Number(0.0):
                shares.setdefault(body.name, _share(share))
    many = len(shares) > 2 or len(contact.v) > 1
    return Touch(contact, "box" if many else _symbol(contact), shares)


def _share(tree: Value) -> tuple[int, str]:
    """Return the sign of a share, and its size as a formula; empty for 1."""
    match tree:
        case Negative(operand):
            sign, size = _share(operand)
            return -sign, size
        case Number(value):
            return 1 if value > 0.0 else -1, _ratio(abs(value))
    return 1, _ratio(spell(tree, MATLAB_LIKE))


def _ratio(text: str | float) -> str:
    return "" if text == 1.0 else written(text)


def _symbol(contact: Contact) -> str:
    name = next((name for name, chart in charts().items() if chart == contact.chart), "")
    if name:
        return SYMBOLS.get(name, "friction")
    locks = any(state.locked for state in contact.chart.states)
    return "friction" if locks or contact.model is not None else "box"


def _belts(system: System, touches: Sequence[Touch]) -> list[str]:
    """Return the driven bodies that others only rub on."""
    linked = {end for spring in system.springs for end in (spring.first, spring.second)}
    driven = {each.name for each in system.bodies if each.driven}
    free = {each.name for each in system.bodies} - driven
    belts = []
    for name in driven - linked:
        own = [each for each in touches if name in each.shares]
        if own and all(
            each.symbol == "friction" and len(each.shares) == 2 and each.shares.keys() & free
            for each in own
        ):
            belts.append(name)
    return sorted(belts, key=[each.name for each in system.bodies].index)


def _slots(touches: Iterable[Touch], belts: Sequence[str]) -> dict[str, list[Slot]]:
    slots: dict[str, list[Slot]] = defaultdict(list)
    for touch in touches:
        above = [name for name in touch.shares if name not in belts]
        belt = next((name for name in touch.shares if name in belts), GROUND)
        single = len(above) == 1 and touch.symbol not in ("stop", "backlash")
        if single or _of_many(touch):
            slots[above[0]].append(Slot(touch, belt))
    return slots


def _sprung(system: System) -> Iterator[Item]:
    for spring in system.springs:
        ends, ratios = (spring.first, spring.second or GROUND), ("", _ratio(spring.ratio))
        rest, moves = _rest(system, spring)
        label = written(spring.k) + (f", rest {rest}" if rest and not moves else "")
        links = [DrawnSpring("spring", str(spring.k), label)] if spring.k != 0.0 else []
        damper = (
            [DrawnSpring("damper", str(spring.d), written(spring.d))] if spring.d != 0.0 else []
        )
        if moves and links:  # the damper does not see the end that moves
            yield Item(*ends, links=tuple(links), drive=rest)
            links = []
        if links or damper:
            yield Item(*ends, ratios, tuple(links + damper))


def _rest(system: System, spring: Spring) -> tuple[str, bool]:
    """Return where a spring is at rest, as a formula, and whether that is an end that moves."""
    tree = parse_value(str(spring.rest), system.readable)
    moves = spring.second is None and bool(names_in(tree) - {*system.numbers})
    return ("" if tree == Number(0.0) else written(spring.rest)), moves


def _touching(touches: Iterable[Touch], belts: Sequence[str]) -> Iterator[Item]:
    for touch in touches:
        ends = [name for name in touch.shares if name not in belts]
        if _of_many(touch):
            continue
        sizes = [touch.shares[each][1] for each in ends]
        if len(ends) == 2 == len(touch.shares):
            yield Item(ends[0], ends[1], (sizes[0], sizes[1]), touch=touch)
        elif touch.symbol in ("stop", "backlash"):
            yield Item(ends[0], GROUND, (sizes[0], ""), touch=touch)


def _ordered(row: list[str], items: Iterable[Item]) -> list[str]:
    """Return the bodies in the order with the shortest connections; as given, if that is one."""
    pairs = [(each.left, each.right) for each in items if each.right]
    if len(row) > MOST_ORDERED or not pairs:
        return row

    lengths = {
        order: sum(abs(order.index(a) - order.index(b)) for a, b in pairs)
        for order in permutations(row)
    }
    return list(min(lengths.items(), key=lambda each: each[1])[0])


def _put(layout: MechanismLayout, item: Item) -> None:
    """Put an item into a gap, with its ends from left to right."""
    last, here = len(layout.columns) - 1, layout.place(item.left)
    if item.right:
        there = layout.place(item.right)
        if here > there:
            item, here, there = _turned(item), there, here
        if there - here > 1:
            layout.over.append(item)
        else:
            layout.gaps[there].append(item)
        return
    # At the ground: outside of the row if that is next to it.
    to_right = here == last and (here > 0 or bool(item.drive))
    if item.touch is not None and item.touch.symbol == "stop":
        to_right = item.touch.shares[item.left][0] > 0
    if to_right:
        layout.gaps[here + 1].append(item)
    else:
        layout.gaps[here].append(_turned(item))


def _turned(item: Item) -> Item:
    ratios = (item.ratios[1], item.ratios[0])
    return replace(item, left=item.right, right=item.left, ratios=ratios)


def _lines(force: Value) -> tuple[str, ...]:
    """Return a force as lines of formulas."""
    text = "" if force == Number(0.0) else spell(force, MATLAB_LIKE)
    return tuple(formula(line.strip()) for line in wrapped(text, LONGEST))


# --------------------------------------------------------------------------- places
def _place(layout: MechanismLayout) -> None:
    """Set the height of the boxes, the widths of the gaps and where the boxes are."""
    stubs = STUB * len(layout.over)
    lanes = [sum(each.height for each in gap) for gap in layout.gaps.values()]
    layout.high = max(1.6, *lanes, 0.0) + stubs
    x = 0.0
    for i, column in enumerate(layout.columns):
        items = layout.gaps[i]
        wide = max((each.width for each in items), default=0.0 if i == 0 else 0.8)
        wide += 0.45 * any(not each.left or not each.right for each in items)
        arms = [
            each for each in layout.over if layout.place(each.left) < i <= layout.place(each.right)
        ]
        wide = max(wide, 0.6 + STUB * len(arms)) if arms else wide
        start = x + wide
        if i:
            before = layout.columns[i - 1]
            start = max(start, before.left + before.top + 0.3 + 2 * STUB * len(arms))
        column.left = start
        layout.widths[i] = start - x
        x = column.right
    end = len(layout.columns)
    wide = max((each.width + 0.45 for each in layout.gaps[end]), default=0.0)
    layout.widths[end] = wide


def _place_belts(layout: MechanismLayout, belts: Sequence[str]) -> None:
    """Set the height of each belt: as high as nothing is in its way."""
    spans: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for slot, left in slots_of(layout.columns):
        spans[slot.belt].append((left, left + slot.width))
    levels = [spans[GROUND]]
    for name in belts:
        # Its name and its velocity stand to the right of it.
        text = width(name, NAME, bold=True) + width(motion_of(layout.bodies[name]))
        span = (min(spans[name])[0] - 0.2, max(spans[name])[1] + 1.2 + text)
        free = (
            k
            for k, taken in enumerate(levels)
            if all(span[1] < left or right < span[0] for left, right in taken)
        )
        level = next(free, len(levels))
        if level == len(levels):
            levels.append([])
        levels[level].append(span)
        layout.belts[name] = -BRISTLE - BELOW * level


def slots_of(columns: Iterable[BodyColumn]) -> Iterable[tuple[Slot, float]]:
    """Yield the contacts below bodies, with the left side of the room of each."""
    for column in columns:
        left = column.left + 0.5 * (column.width - sum(each.width for each in column.slots))
        for slot in column.slots:
            yield slot, left
            left += slot.width


def motion_of(body: Body) -> str:
    """Return how a driven body moves, as a formula."""
    given = 0.0 if body.velocity is None else body.velocity
    own = formula(body.v)
    return own if given == body.v else f"{own[:-1]} = {written(given)[1:]}"
