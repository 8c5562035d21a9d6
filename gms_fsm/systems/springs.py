"""Springs and dampers between two bodies, or between a body and the ground."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from gms_fsm.errors import ExpressionError, ParameterError, Part, shown
from gms_fsm.foundation.arguments import refusing, unknown
from gms_fsm.language import Binary, Name, Negative, Number, Value, parse_value
from gms_fsm.systems.given import Text, check_name, check_text, constant
from gms_fsm.systems.parts import Body

if TYPE_CHECKING:
    from gms_fsm.systems.system import System


ZERO, ONE = Number(0.0), Number(1.0)
Terms = tuple[tuple[int, Value], ...]  # each with its sign


@refusing(instead={"stiffness": "k", "damping": "d"})
@dataclass(frozen=True)
class Spring:
    """A spring, a damper, or both in parallel, between two bodies or a body and the ground.

    It pulls the first body with ``F = k (ratio x_2 + rest - x_1) + d (ratio v_2 - v_1)``, and the
    second one with ``-ratio F``. The ground has x_2 = v_2 = 0.

    Parameters
    ----------
    name : str
        Unique in its system.
    first : str
        A body.
    second : str, optional
        Another body; None for the ground.
    k : str or float
        Stiffness, N/m, >= 0, over the numbers of the system.
    d : str or float
        Damping, Ns/m, >= 0, over the numbers.
    ratio : str or float
        Gear ratio: what the motion of the second body is multiplied by; over the numbers.
    rest : str or float
        x_1 - ratio x_2 without a force, m, over ``t``, signals and numbers: where the end of a
        spring that is pulled is. The damper does not see it.

    Examples
    --------
    >>> Spring("shaft", "motor", "load", k="k_s", d="d_s").ratio
    1.0
    >>> Spring("pulled", "mass", k=2.0, rest="0.1 * t").second is None
    True
    """

    name: str
    first: str
    second: str | None = None
    k: Text = field(default=0.0, kw_only=True)
    d: Text = field(default=0.0, kw_only=True)
    ratio: Text = field(default=1.0, kw_only=True)
    rest: Text = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        here = f"spring {shown(self.name)}"
        check_name(self.name, here)
        for each in ("k", "d", "ratio", "rest"):
            check_text(getattr(self, each), f"{here}: {each}")
        if self.k == 0.0 == self.d:
            raise ParameterError(
                "it has neither a stiffness nor a damping",
                place=here,
                advice="give k=..., d=... or both",
            )
        if self.first == self.second:
            raise ParameterError(
                f"both its ends are {shown(self.first)}",
                place=here,
                advice="give another body, or None for the ground",
                key=("second",),
            )


# --------------------------------------------------------------------------- in a system
def spring_forces(system: System) -> Iterator[tuple[str, int, Value]]:
    """Yield what springs add to the forces of bodies: body, sign and term."""
    check_springs(system)
    for i, spring in enumerate(system.springs):
        ends = {"first": spring.first, "second": spring.second}
        bodies = {body.name: body for body in system.bodies}
        for end, name in ends.items():
            if name not in bodies and (end, name) != ("second", None):
                where, key = _place(system, i).words, ("springs", i, end)
                raise unknown("body", name, bodies, place=where, key=key)
        terms = pull(spring, bodies, partial(field_of, system, i))
        if spring.second is None:
            yield from ((spring.first, sign, term) for sign, term in terms)
        else:
            yield spring.first, 1, summed(terms)
            yield spring.second, -1, times(field_of(system, i, "ratio"), summed(terms))


def check_springs(system: System) -> None:
    """Refuse springs that push away, and dampers that drive."""
    for i, spring in enumerate(system.springs):
        for name, what in (("k", "stiffness"), ("d", "damping")):
            if not 0.0 <= constant(field_of(system, i, name), system.numbers) < math.inf:
                raise ParameterError(
                    f"the {what} must be >= 0",
                    place=_place(system, i).of(name).words,
                    value=getattr(spring, name),
                    advice="a force of another sign is a text: Body(..., force='k * x')",
                    key=("springs", i, name),
                )


def field_of(system: System, index: int, name: str) -> Value:
    """Read a field of a spring; only `rest` may change during a run."""
    names = [*system.numbers, *(["t", *system.given] if name == "rest" else [])]
    try:
        return parse_value(str(getattr(system.springs[index], name)), names)
    except ExpressionError as error:
        raise error.at(_place(system, index).of(name, name)) from None


def _place(system: System, index: int) -> Part:
    words = f"system {system.name!r}, spring {system.springs[index].name!r}"
    return Part(words, ("springs", index))


def on_ground(springs: Iterable[Spring], body: Body, names: Iterable[str]) -> Value:
    """Return the force of springs between a body and the ground, over the names of a rig."""
    known = [*names]
    total: Value = ZERO
    for spring in springs:
        texts = {name: str(getattr(spring, name)) for name in ("k", "d", "ratio", "rest")}
        trees = {name: parse_value(text, known) for name, text in texts.items()}
        for sign, term in pull(spring, {body.name: body}, trees.__getitem__):
            total = added(total, sign, term)
    return total


# --------------------------------------------------------------------------- one spring
def pull(spring: Spring, bodies: Mapping[str, Body], read: Callable[[str], Value]) -> Terms:
    """Return the terms of the force on the first body; `read` gives the tree of a field."""
    one, two = bodies[spring.first], None if spring.second is None else bodies[spring.second]
    terms = []
    for share, near, far, offset in (
        (read("k"), one.x, two.x if two else None, read("rest")),
        (read("d"), one.v, two.v if two else None, ZERO),
    ):
        if share == ZERO:
            continue
        end = added(ZERO if far is None else times(read("ratio"), Name(far)), 1, offset)
        away = Name(near) if end == ZERO else Binary("-", end, Name(near))
        terms.append((-1 if end == ZERO else 1, times(share, away)))
    return tuple(terms)


def summed(terms: Terms) -> Value:
    """Return the sum of terms."""
    total: Value = ZERO
    for sign, term in terms:
        total = added(total, sign, term)
    return total


def times(share: Value, tree: Value) -> Value:
    """Return a product, without a factor 1."""
    return tree if share == ONE else Binary("*", share, tree)


def added(total: Value, sign: int, term: Value) -> Value:
    """Return a sum with one more term, without a 0."""
    if term == ZERO:
        return total
    if total == ZERO:
        return term if sign > 0 else minus(term)
    return Binary("+" if sign > 0 else "-", total, term)


def minus(tree: Value) -> Value:
    """Return ``-k * x`` as it is read, with the sign at its first factor."""
    match tree:
        case Binary("*" | "/" as op, left, right):
            return Binary(op, minus(left), right)
    return Negative(tree)
