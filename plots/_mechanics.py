"""What a system consists of as a mechanism: springs, dampers, contacts and other forces.

Springs and dampers are found in the checked trees of the bodies' forces. A term is a spring between
two bodies if it is a constant times a difference of positions (``k * (x_2 - x_1)``, also with
gearing, ``lead * k * (lead * phi - x)``), pulls the body back, and the other body has the same term
with the opposite sign; with velocities it is a damper. The other end can also be the ground, or a
point that moves as a function of time (``k * (V * t - x)``). Whatever else acts on a body is a
force. A force that a controller computes from a signal is one too: it cannot be told from a spring.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import reduce

from gms_fsm.charts.registry import charts
from gms_fsm.language import (
    Binary,
    Name,
    Negative,
    Number,
    Value,
    derivative,
    names_in,
    parse_value,
)
from gms_fsm.systems.system import Body, Contact, System

__all__ = ["GROUND", "Force", "Link", "Mechanism", "Touch", "mechanism"]

GROUND = ""  # stands for the name of a body where there is none
ONE = Number(1.0)
# Contacts with a symbol of their own; all other included charts, and those that can lock, are
# friction.
SYMBOLS = {"backlash": "backlash", "end-stop": "stop", "dog-clutch": "clutch"}


@dataclass(frozen=True)
class Term:
    """A product of a sum.

    Parameters
    ----------
    sign : int
        1 or -1.
    factors, divisors : tuple of Value
        What is multiplied, and what that is divided by.
    """

    sign: int = 1
    factors: tuple[Value, ...] = ()
    divisors: tuple[Value, ...] = ()

    def times(self, other: Term) -> Term:
        """Return the product with another one."""
        return Term(
            self.sign * other.sign, self.factors + other.factors, self.divisors + other.divisors
        )

    def less(self, other: Term) -> Term:
        """Return the quotient by another one, with equal factors taken out."""
        above, below = [*self.factors, *other.divisors], [*self.divisors]
        for each in other.factors:
            if each in above:
                above.remove(each)
            else:
                below.append(each)
        return Term(self.sign * other.sign, tuple(above), tuple(below))

    @property
    def size(self) -> tuple[frozenset[tuple[Value, int]], ...]:
        """Its value without the sign, whatever the order of its factors."""
        return tuple(
            frozenset((each, parts.count(each)) for each in parts)
            for parts in (self.factors, self.divisors)
        )

    @property
    def tree(self) -> Value:
        """Its value without the sign, as a tree."""
        above = reduce(lambda a, b: Binary("*", a, b), self.factors) if self.factors else ONE
        return reduce(lambda a, b: Binary("/", a, b), self.divisors, above)

    @property
    def signed(self) -> Value:
        """Its value as a tree, with a minus before the first factor."""
        if self.sign > 0 or not self.factors:
            return self.tree if self.sign > 0 else Negative(self.tree)
        first, *others = self.factors
        turned = Number(-first.value) if isinstance(first, Number) else Negative(first)
        return replace(self, sign=1, factors=(turned, *others)).tree

    def names(self) -> frozenset[str]:
        """Return the names that it depends on."""
        return frozenset().union(*map(names_in, self.factors + self.divisors))


@dataclass(frozen=True)
class Stretch:
    """A sum of positions, or of velocities, of bodies.

    Parameters
    ----------
    kind : {"spring", "damper"}
        What resists it.
    shares : mapping of str to Term
        The coefficient of each body.
    drive : tuple of Term
        What it has besides, over time and numbers.
    """

    kind: str
    shares: Mapping[str, Term]
    drive: tuple[Term, ...]

    @property
    def size(self) -> tuple[object, ...]:
        """What it is, whichever way it counts."""
        first = min(self.shares)
        turn = self.shares[first].sign
        shares = {(body, turn * each.sign, each.size) for body, each in self.shares.items()}
        return (
            self.kind,
            frozenset(shares),
            frozenset((turn * each.sign, each.size) for each in self.drive),
        )


@dataclass(frozen=True)
class Link:
    """A spring or a damper.

    Parameters
    ----------
    kind : {"spring", "damper"}
        Which.
    constant : Value
        Its stiffness or its damping.
    ends : (str, str)
        Bodies; the second may be the ground, or a point that moves by itself.
    ratios : (Term, Term)
        By what the motion of each end is multiplied.
    drive : tuple of Term
        How the second end moves, where it is no body.
    """

    kind: str
    constant: Value
    ends: tuple[str, str]
    ratios: tuple[Term, Term]
    drive: tuple[Term, ...] = ()


@dataclass(frozen=True)
class Force:
    """What acts on a body besides springs, dampers and contacts: the terms of a sum."""

    body: str
    terms: tuple[Term, ...]


@dataclass(frozen=True)
class Touch:
    """A contact.

    Parameters
    ----------
    contact : Contact
        Which.
    symbol : {"friction", "backlash", "stop", "clutch", "box"}
        How it is drawn.
    shares : mapping of str to Term
        Coefficients of the bodies' velocities in that of the contact.
    """

    contact: Contact
    symbol: str
    shares: Mapping[str, Term]


@dataclass(frozen=True)
class Mechanism:
    """All of a system that is drawn mechanically, in the order of the system."""

    links: tuple[Link, ...]
    forces: tuple[Force, ...]
    touches: tuple[Touch, ...]


@dataclass(frozen=True)
class _Found:
    """A term of a body's force that may be one side of a spring or a damper."""

    body: str
    term: Term  # as it stands in the force
    constant: Term
    stretch: Stretch

    @property
    def size(self) -> tuple[object, ...]:
        return self.constant.size, self.stretch.size


def mechanism(system: System) -> Mechanism:
    """Return the springs, dampers, contacts and other forces of a system.

    Parameters
    ----------
    system : System
        The system.

    Returns
    -------
    Mechanism
        Each term of each free body's force is in exactly one link or force.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, PulledSlider
    >>> from gms_fsm.systems.system import system_of
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> found = mechanism(system_of(model, PulledSlider(1.0, 2.0, 0.1)))
    >>> [(each.kind, each.constant, each.ends) for each in found.links]
    [('spring', Name(id='stiffness'), ('body', ''))]
    >>> found.forces
    ()
    """
    reader = _Reader(system)
    candidates: list[_Found] = []
    others: dict[str, list[Term]] = {}
    for body in system.bodies:
        if not body.driven:
            found, rest = reader.body(body)
            candidates += found
            others[body.name] = rest
    links, single = _paired(candidates, {each.name for each in system.bodies if each.driven})
    for each in single:
        others[each.body].append(each.term)
    forces = (Force(body, tuple(rest)) for body, rest in others.items() if rest)
    touches = (_touch(system, contact) for contact in system.contacts)
    return Mechanism(tuple(links), tuple(forces), tuple(touches))


class _Reader:
    """Finds springs and dampers in the forces of one system."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.constants = frozenset(system.numbers)
        self.owners = {
            name: (kind, body.name)
            for body in system.bodies
            for name, kind in ((body.x, "spring"), (body.v, "damper"))
            if name not in system.signals
        }

    def body(self, body: Body) -> tuple[list[_Found], list[Term]]:
        """Return what may be springs and dampers on a body, and the other terms of its force."""
        force = body.force
        tree = parse_value(force, self.system.names) if isinstance(force, str) else Number(force)
        found: list[_Found] = []
        rest: list[Term] = []
        for term in self.terms(tree):
            if Number(0.0) in term.factors:
                continue
            side = self.side(body.name, term)
            if side is None:
                rest.append(term)
            else:
                found.append(side)
        return self.joined(body.name, found, rest)

    def joined(
        self, body: str, found: list[_Found], rest: list[Term]
    ) -> tuple[list[_Found], list[Term]]:
        """Join ``k * x_2`` and ``-k * x_1`` to one spring."""
        left = []
        for term in rest:
            stretch = self.single(term)
            own = None
            if stretch is not None and term.sign > 0:
                constant = self.constant(term)
                own = next(
                    (
                        each
                        for each in found
                        if each.stretch.kind == stretch.kind
                        and len(each.stretch.shares) == 1
                        and not each.stretch.drive
                        and each.constant.size == constant.size
                    ),
                    None,
                )
            if own is None or stretch is None:
                left.append(term)
                continue
            found.remove(own)
            shares = {**stretch.shares, body: Term(-1)}
            both = Stretch(stretch.kind, shares, ())
            # Put back into the force, it stands as one term.
            (name,) = (each for each in term.factors if names_in(each) & self.owners.keys())
            difference = Binary("-", name, own.term.factors[-1])
            whole = Term(1, (*own.constant.factors, difference), own.constant.divisors)
            found.append(_Found(body, whole, own.constant, both))
        return found, left

    def single(self, term: Term) -> Stretch | None:
        """Return the stretch of a term that has one position or velocity, as a plain name."""
        moving = [each for each in term.factors if names_in(each) & self.owners.keys()]
        if len(moving) != 1 or not isinstance(moving[0], Name):
            return None
        return self.stretch(moving[0]) if term.names() <= self.allowed else None

    @property
    def allowed(self) -> frozenset[str]:
        return self.constants | self.owners.keys()

    def constant(self, term: Term) -> Term:
        """Return a term without its moving factor."""
        still = tuple(each for each in term.factors if not names_in(each) & self.owners.keys())
        return Term(term.sign, still, term.divisors)

    def side(self, body: str, term: Term) -> _Found | None:
        """Return a term as one side of a spring or a damper, if it may be one."""
        moving = [each for each in term.factors if names_in(each) & self.owners.keys()]
        if len(moving) != 1:
            return None
        stretch, constant = self.stretch(moving[0]), self.constant(term)
        if stretch is None or not constant.names() <= self.constants:
            return None
        own = stretch.shares.get(body)
        if own is None or len(stretch.shares) > 2 or constant.sign * own.sign > 0:
            return None
        plain = replace(constant.less(own), sign=1)
        # The last factor is the stretch, so that a term can be written as it was.
        ordered = Term(term.sign, (*constant.factors, moving[0]), term.divisors)
        return _Found(body, ordered, plain, stretch)

    def stretch(self, tree: Value) -> Stretch | None:
        """Return a sum of positions or of velocities as such."""
        kinds, shares, drive = set(), {}, []
        for term in self.flat(tree):
            moving = [each for each in term.factors if names_in(each) & self.owners.keys()]
            if not moving:
                if not term.names() <= self.constants | {"t"}:
                    return None
                drive.append(term)
                continue
            if len(moving) > 1 or not isinstance(moving[0], Name):
                return None
            kind, body = self.owners[moving[0].id]
            share = self.constant(term)
            if body in shares or not share.names() <= self.constants:
                return None
            kinds.add(kind)
            shares[body] = share
        return Stretch(kinds.pop(), shares, tuple(drive)) if len(kinds) == 1 else None

    def flat(self, tree: Value) -> list[Term]:
        """Return the terms of a sum; sums inside its products stay as they are."""
        match tree:
            case Negative(operand):
                return [replace(each, sign=-each.sign) for each in self.flat(operand)]
            case Binary("+", left, right):
                return self.flat(left) + self.flat(right)
            case Binary("-", left, right):
                return self.flat(left) + self.flat(Negative(right))
        return self.product(tree, self.whole)

    def terms(self, tree: Value) -> list[Term]:
        """Return the terms of a sum; what stands before a bracket that is no stretch goes in."""
        match tree:
            case Negative(operand):
                return [replace(each, sign=-each.sign) for each in self.terms(operand)]
            case Binary("+", left, right):
                return self.terms(left) + self.terms(right)
            case Binary("-", left, right):
                return self.terms(left) + self.terms(Negative(right))
        return self.product(tree, self.opened)

    def product(self, tree: Value, inside: Callable[[Value], list[Term]]) -> list[Term]:
        match tree:
            case Binary("*", left, right):
                return [
                    a.times(b)
                    for a in self.factor(left, inside)
                    for b in self.factor(right, inside)
                ]
            case Binary("/", left, right):
                below = Term(divisors=(right,))
                return [each.times(below) for each in self.factor(left, inside)]
            case Number(value) if abs(value) == 1.0 or value < 0.0:
                size = () if abs(value) == 1.0 else (Number(-value),)
                return [Term(1 if value > 0.0 else -1, size)]
        return [Term(factors=(tree,))]

    def factor(self, tree: Value, inside: Callable[[Value], list[Term]]) -> list[Term]:
        match tree:
            case Negative(operand):
                return [replace(e, sign=-e.sign) for e in self.factor(operand, inside)]
            case Binary("+" | "-"):
                return inside(tree)
        return self.product(tree, inside)

    def whole(self, tree: Value) -> list[Term]:
        return [Term(factors=(tree,))]

    def opened(self, tree: Value) -> list[Term]:
        names = names_in(tree)
        # A bracket with a signal or a state is the error of a controller, and stays one.
        if not names & self.owners.keys() or not names <= self.allowed | {"t"}:
            return self.whole(tree)
        if self.stretch(tree) is not None:
            return self.whole(tree)
        return self.terms(tree)


def _paired(candidates: list[_Found], driven: set[str]) -> tuple[list[Link], list[_Found]]:
    """Return links, and the candidates to which no other body has the opposite."""
    links, single, left = [], [], list(candidates)
    while left:
        one = left.pop(0)
        others = [name for name in one.stretch.shares if name != one.body]
        far = others[0] if others else GROUND
        if others and far not in driven:
            match = next((e for e in left if e.body == far and e.size == one.size), None)
            if match is None:
                single.append(one)
                continue
            left.remove(match)
        shares = one.stretch.shares
        turned = [replace(shares.get(name, Term()), sign=1) for name in (one.body, far)]
        opposite = one.stretch.drive
        if one.stretch.shares[one.body].sign > 0:  # as the end moves, not as it is subtracted
            opposite = tuple(replace(each, sign=-each.sign) for each in opposite)
        ends = (one.body, far)
        constant = one.constant.tree
        links.append(Link(one.stretch.kind, constant, ends, (turned[0], turned[1]), opposite))
    return links, single


def _touch(system: System, contact: Contact) -> Touch:
    shares: dict[str, Term] = {}
    for text in contact.v:
        tree = parse_value(text, system.names)
        for body in system.bodies:
            share = derivative(tree, body.v)
            if share is not None and share != Number(0.0):
                shares.setdefault(body.name, _as_term(share))
    symbol = _symbol(contact)
    if len(shares) > 2 or len(contact.v) > 1:
        symbol = "box"
    return Touch(contact, symbol, shares)


def _as_term(tree: Value) -> Term:
    match tree:
        case Negative(operand):
            inner = _as_term(operand)
            return replace(inner, sign=-inner.sign)
        case Number(value):
            size = () if abs(value) == 1.0 else (Number(abs(value)),)
            return Term(1 if value > 0.0 else -1, size)
    return Term(factors=(tree,))


def _symbol(contact: Contact) -> str:
    name = next((name for name, chart in charts().items() if chart == contact.chart), "")
    if name:
        return SYMBOLS.get(name, "friction")
    locks = any(state.locked for state in contact.chart.states)
    return "friction" if locks or contact.model is not None else "box"


def total(terms: Iterable[Term]) -> Value:
    """Return the sum of terms as a tree."""
    value: Value | None = None
    for each in terms:
        if value is None:
            value = each.signed
        else:
            value = Binary("+" if each.sign > 0 else "-", value, each.tree)
    return Number(0.0) if value is None else value
