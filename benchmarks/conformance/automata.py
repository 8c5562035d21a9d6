"""Bodies with contacts as a hybrid automaton with affine flows, written for this suite alone.

Nothing of gms_fsm is used. A `Mechanism` computes with any kind of number: `references.py` runs it
with 50 digits, `rivals.py` with floats in SciPy and PathSim. An affine function is a mapping from
names to coefficients; the name ``1`` is the constant. Names of a state vector are ``x_a`` and
``v_a`` for the body a, the names of signals, and those of further states.

What is assumed about impacts: an impulse is shared by the locks that can carry it; a lock carries
none if an edge leaves its state at the force that it would need. A contact whose velocity has
jumped is not arrested in that instant, because it was nowhere at rest.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

Affine = Mapping[str, Any]
Vector = list[Any]
Modes = tuple[str, ...]
LOCKED = None  # in place of a force
HUGE = 10**30


@dataclass(frozen=True)
class Edge:
    """An edge: taken where all conditions ``(affine, strict)`` are positive (or not negative)."""

    source: str
    name: str
    target: str
    when: Sequence[tuple[Affine, bool]]
    back: Any = None  # v := -back * v, an impulse
    sets: Mapping[str, Affine] = field(default_factory=dict)
    takes: bool = False  # takes momentum on purpose


@dataclass(frozen=True)
class Contact:
    """A contact: coefficients by body, the force of each state, edges; the first state is default.

    Its affine functions read x, v and F of the contact, and all names of the state vector.
    """

    name: str
    row: Affine
    states: Mapping[str, Affine | None]
    edges: Sequence[Edge]
    element: int = 1
    rates: Mapping[str, Mapping[str, Affine]] = field(default_factory=dict)  # by state


@dataclass(frozen=True)
class Fired:
    """An edge that was taken."""

    t: Any
    contact: str
    element: int
    edge: str


def more(text: str, bound: Any = 0, *, strict: bool = True) -> tuple[Affine, bool]:
    """Return the condition ``text > bound``; text is a name, with a minus sign for ``-name >``."""
    name = text.lstrip("-")
    return {name: -1 if text.startswith("-") else 1, "1": -bound}, strict


def stiction(name: str, row: Affine, F_c: Any, F_s: Any, b: Any = 0) -> Contact:
    """Return Coulomb friction with stiction."""
    forward, backward = [more("v")], [more("-v")]
    edges = (
        Edge("stuck", "release_forward", "forward", [more("F", F_s)]),
        Edge("stuck", "release_backward", "backward", [more("-F", F_s)]),
        Edge("forward", "arrest_forward", "stuck", backward),
        Edge("backward", "arrest_backward", "stuck", forward),
        Edge("forward", "reverse_forward", "backward", backward),
        Edge("backward", "reverse_backward", "forward", forward),
    )
    states = {"stuck": LOCKED, "forward": {"1": F_c, "v": b}, "backward": {"1": -F_c, "v": b}}
    return Contact(name, row, states, edges)


def end_stop(name: str, row: Affine, x_s: Any, e: Any, v_r: Any = None) -> Contact:
    """Return an end stop; without a rest speed it has no rest."""
    there = more("x", x_s, strict=False)
    edges = [Edge("free", "bounce", "free", [there, more("v", v_r or 0)], back=e)]
    if v_r is None:
        return Contact(name, row, {"free": {}}, edges)
    slow = [there, more("v"), more("-v", -v_r, strict=False)]
    edges.append(Edge("free", "settle", "rest", slow, takes=True))
    edges.append(Edge("rest", "lift", "free", [more("-F")]))
    return Contact(name, row, {"free": {}, "rest": LOCKED}, edges)


def backlash(name: str, row: Affine, k: Any, d: Any, gap: Any) -> Contact:
    """Return a gap with elastic flanks."""
    states = {
        "apart": {},
        "right": {"x": k, "v": d, "1": -k * gap},
        "left": {"x": k, "v": d, "1": k * gap},
    }
    edges = (
        Edge("apart", "touch_right", "right", [more("x", gap, strict=False), more("v")]),
        Edge("apart", "touch_left", "left", [more("-x", gap, strict=False), more("-v")]),
        Edge("right", "leave_right", "apart", [more("-F")]),
        Edge("left", "leave_left", "apart", [more("F")]),
    )
    return Contact(name, row, states, edges)


def dog_clutch(name: str, row: Affine, t_on: Any, t_off: Any) -> Contact:
    """Return a clutch that is engaged from t_on to t_off."""
    on, off = more("t", t_on, strict=False), more("t", t_off, strict=False)
    edges = (
        Edge("open", "engage", "engaged", [on, more("-t", -t_off)], takes=True),
        Edge("engaged", "disengage", "open", [off]),
    )
    return Contact(name, row, {"open": {}, "engaged": LOCKED}, edges)


def element(bank: str, i: int, row: Affine, k: Any, F_c: Any) -> Contact:
    """Return an element of a Maxwell-slip bank, with the deflection z_i."""
    z, limit = f"z_{i}", F_c / k
    force = {z: k}
    edges = (
        Edge(
            "stick",
            "break_away_forward",
            "slip_forward",
            [more(z, limit, strict=False), more("v")],
            sets={z: {"1": limit}},
        ),
        Edge(
            "stick",
            "break_away_backward",
            "slip_backward",
            [more(f"-{z}", limit, strict=False), more("-v")],
            sets={z: {"1": -limit}},
        ),
        Edge("slip_forward", "turn_forward", "stick", [more("-v")]),
        Edge("slip_backward", "turn_backward", "stick", [more("v")]),
    )
    states = dict.fromkeys(("stick", "slip_forward", "slip_backward"), force)
    return Contact(bank, row, states, edges, i, {"stick": {z: {"v": 1}}})


def added(*parts: tuple[Any, Affine]) -> dict[str, Any]:
    """Return the sum of affine functions, each times a number."""
    total: dict[str, Any] = {}
    for factor, part in parts:
        for name, value in part.items():
            total[name] = total.get(name, 0) + factor * value
    return total


class Mechanism:
    """Free bodies (mass, force), driven bodies and other signals (corners), contacts.

    Parameters
    ----------
    free : mapping
        By body: its mass, and its force as an affine function.
    contacts : sequence of Contact
        In order: of two that are enabled the earlier one goes first.
    driven : mapping
        By body: its velocity as a list of corners.
    signals : mapping
        Further functions of time as lists of corners; two corners at one time make a jump.
    flow : mapping
        Rates of further states.
    start : mapping
        Initial values by name, and the states of contacts by name.
    numbers : namespace
        The kind of numbers: changes of velocity up to ``small`` are rounding errors, and a strict
        comparison holds beyond ``zero``.
    known : bool
        Whether a solver is told where the signals have corners; not if they are formulas.
    """

    def __init__(
        self,
        free: Mapping[str, tuple[Any, Affine]],
        contacts: Sequence[Contact],
        *,
        driven: Mapping[str, Sequence[tuple[Any, Any]]] | None = None,
        signals: Mapping[str, Sequence[tuple[Any, Any]]] | None = None,
        flow: Mapping[str, Affine] | None = None,
        start: Mapping[str, Any] | None = None,
        numbers: Any,
        known: bool = True,
    ) -> None:
        self.free, self.contacts, self.known = dict(free), list(contacts), known
        self.small, self.zero = numbers.small, numbers.zero
        self.driven, self.flow = dict(driven or {}), dict(flow or {})
        self.corners = {f"v_{body}": line for body, line in self.driven.items()}
        self.corners |= signals or {}
        own = [z for c in contacts for z in c.rates.get(next(iter(c.states)), {})]
        places = [f"x_{b}" for b in (*self.free, *self.driven)] + [f"v_{b}" for b in self.free]
        self.names = [*places, *self.corners, *self.flow, *own, "t", "1"]
        self.place = {name: i for i, name in enumerate(self.names)}
        start = dict(start or {})
        self.modes: Modes = tuple(
            start.pop(c.name, next(iter(c.states))) if c.element == 1 else next(iter(c.states))
            for c in contacts
        )
        self.y: Vector = [start.pop(name, 0) for name in self.names]
        self.y[-1] = 1
        assert not start, start
        self.knots = sorted({t for line in self.corners.values() for t, _ in line if t > 0})
        self.log: list[Fired] = []
        self._made: dict[Any, Any] = {}
        self.jumped: set[int] = set()
        self.enter(0)

    # ------------------------------------------------------------------ signals
    def slope(self, line: Sequence[tuple[Any, Any]], segment: int) -> Any:
        """Return the slope of a signal in a segment between knots."""
        t = 0 if segment == 0 else self.knots[segment - 1]
        for (t0, u0), (t1, u1) in pairwise(line):
            if t0 <= t < t1:
                return (u1 - u0) / (t1 - t0)
        return 0

    def at(self, line: Sequence[tuple[Any, Any]], t: Any, *, after: bool = True) -> Any:
        """Return the value of a signal, at a jump that after or before it."""
        if t < line[0][0]:
            return line[0][1]
        for (t0, u0), (t1, u1) in pairwise(line):
            if (t0 <= t < t1) if after else (t0 < t <= t1):
                return u0 + (u1 - u0) * (t - t0) / (t1 - t0)
        return line[-1][1]

    def enter(self, t: Any) -> None:
        """Set all signals to their values after a knot; contacts may jump."""
        before = [self.of(self.velocity(c)) for c in self.contacts]
        for name, line in self.corners.items():
            self.y[self.place[name]] = self.at(line, t)
        self.segment = sum(knot <= t for knot in self.knots)
        self.note_jumps(before)

    def note_jumps(self, before: Iterable[Any]) -> None:
        """Remember the contacts whose velocities differ from those before."""
        for i, (c, v) in enumerate(zip(self.contacts, before, strict=True)):
            if abs(self.of(self.velocity(c)) - v) > self.small:
                self.jumped.add(i)

    # ------------------------------------------------------------------ affine functions
    def of(self, function: Affine) -> Any:
        """Return the value of an affine function at the present state."""
        return sum((k * self.y[self.place[name]] for name, k in function.items()), 0 * self.y[-1])

    def velocity(self, c: Contact) -> Affine:
        """Return the velocity of a contact."""
        return {f"v_{body}": k for body, k in c.row.items()}

    def opened(self, c: Contact, function: Affine, F: Affine) -> Affine:
        """Return a function of a contact as one of the state vector."""
        local = {
            "x": {f"x_{body}": k for body, k in c.row.items()},
            "v": self.velocity(c),
            "F": F,
        }
        return added(*((k, local.get(name, {name: 1})) for name, k in function.items()))

    def dynamics(self, modes: Modes) -> tuple[list[Affine], list[Affine]]:
        """Return the rates of all names, and the forces of all contacts."""
        key = modes, self.segment
        if key not in self._made:
            self._made[key] = self._dynamics(modes)
        return self._made[key]  # type: ignore[no-any-return]

    def _dynamics(self, modes: Modes) -> tuple[list[Affine], list[Affine]]:
        slopes = {name: self.slope(line, self.segment) for name, line in self.corners.items()}
        forces: list[Affine] = [{} for _ in self.contacts]
        a: dict[str, Affine] = {body: {"1": slopes[f"v_{body}"]} for body in self.driven}
        a |= {body: added((1 / m, force)) for body, (m, force) in self.free.items()}
        held = [i for i, mode in enumerate(modes) if self.contacts[i].states[mode] is LOCKED]
        for i, c in enumerate(self.contacts):
            if i not in held:
                forces[i] = self.opened(c, c.states[modes[i]] or {}, {})
                self._push(a, c, forces[i])
        rows = [self.contacts[i] for i in held]
        wanted = [added(*((k, a[body]) for body, k in c.row.items())) for c in rows]
        for i, force in zip(held, self._carried(rows, wanted), strict=True):
            forces[i] = force
            self._push(a, self.contacts[i], force)
        rates: dict[str, Affine] = {f"x_{b}": {f"v_{b}": 1} for b in (*self.free, *self.driven)}
        rates |= {f"v_{body}": a[body] for body in self.free}
        rates |= {name: {"1": slope} for name, slope in slopes.items()} | self.flow
        for c, mode in zip(self.contacts, modes, strict=True):
            for z, rate in c.rates.get(mode, {}).items():
                rates[z] = self.opened(c, rate, {})
        rates["t"] = {"1": 1}
        return [rates.get(name, {}) for name in self.names], forces

    def _push(self, a: dict[str, Affine], c: Contact, force: Affine) -> None:
        for body, k in c.row.items():
            if body in self.free:
                a[body] = added((1, a[body]), (-k / self.free[body][0], force))

    def _carried(self, rows: Sequence[Contact], wanted: Sequence[Affine]) -> list[Affine]:
        """Solve J M^-1 J' F = wanted; of rows that repeat others the earlier ones carry."""
        n = len(rows)
        matrix = [
            [
                sum(
                    k * c.row.get(b, 0) / self.free[b][0]
                    for b, k in r.row.items()
                    if b in self.free
                )
                for c in rows
            ]
            for r in rows
        ]
        right, used = [dict(each) for each in wanted], []
        for i in range(n):  # Gauss-Jordan, pivots in order
            if abs(matrix[i][i]) < 1e-12:
                continue
            used.append(i)
            for r in range(n):
                if r != i and matrix[r][i] != 0:
                    factor = matrix[r][i] / matrix[i][i]
                    matrix[r] = [x - factor * p for x, p in zip(matrix[r], matrix[i], strict=True)]
                    right[r] = added((1, right[r]), (-factor, right[i]))
        return [added((1 / matrix[i][i], right[i])) if i in used else {} for i in range(n)]

    # ------------------------------------------------------------------ edges
    def edges(self, modes: Modes) -> list[tuple[int, Edge, list[tuple[Affine, bool]]]]:
        """Return the edges that leave the present states, with conditions on the state vector."""
        _, forces = self.dynamics(modes)
        return [
            (i, e, [(self.opened(c, f, forces[i]), strict) for f, strict in e.when])
            for i, c in enumerate(self.contacts)
            for e in c.edges
            if e.source == modes[i]
        ]

    def holds(self, conditions: Iterable[tuple[Affine, bool]]) -> bool:
        """Return whether conditions hold at the present state."""
        return all(
            (value > self.zero if strict else value >= 0)
            for value, strict in ((self.of(function), strict) for function, strict in conditions)
        )

    def leaves(self, c: Contact, mode: str, F: Any) -> Edge | None:
        """Return the edge that would leave a locked state at a huge force in a direction."""
        if abs(F) <= self.small:
            return None
        for e in c.edges:
            conditions = [
                (self.opened(c, f, {"1": HUGE if F > 0 else -HUGE}), strict) for f, strict in e.when
            ]
            if e.source == mode and self.holds(conditions):
                return e
        return None

    def settle(self, first: tuple[int, Edge] | None = None) -> None:
        """Take an edge, if one is given, and then all that are enabled."""
        if first is not None:
            self.take(*first)
        for _ in range(200):
            chosen = self.enabled()
            if chosen is None:
                self.jumped.clear()
                return
            self.take(*chosen)
        raise RuntimeError("endless switching at one instant")

    def enabled(self) -> tuple[int, Edge] | None:
        """Return the first edge that is enabled."""
        open_edges = self.edges(self.modes)
        for i, c in enumerate(self.contacts):
            mode = self.modes[i]
            if c.states[mode] is LOCKED and i in self.jumped:
                v = self.of(self.velocity(c))
                if (e := self.leaves(c, mode, v)) is not None:
                    return i, e
            for j, e, conditions in open_edges:
                arrest = c.states[e.target] is LOCKED and not e.takes if j == i else False
                if j == i and not (arrest and i in self.jumped) and self.holds(conditions):
                    return i, e
        return None

    def take(self, i: int, e: Edge) -> None:
        """Take an edge of a contact."""
        c = self.contacts[i]
        self.log.append(Fired(self.y[self.place["t"]], c.name, c.element, e.name))
        before = [self.of(self.velocity(each)) for each in self.contacts]
        if e.back is not None or e.takes:
            self.strike(i, -(e.back or 0) * before[i])
            self.note_jumps(before)
        for z, value in e.sets.items():
            self.y[self.place[z]] = self.of(value)
        self.modes = (*self.modes[:i], e.target, *self.modes[i + 1 :])
        if c.states[e.target] is LOCKED and not e.takes:
            self._share([self.contacts[k] for k in self.held()], None, 0)

    def held(self) -> list[int]:
        """Return the contacts that are locked."""
        modes = enumerate(self.modes)
        return [i for i, mode in modes if self.contacts[i].states[mode] is LOCKED]

    def strike(self, i: int, goal: Any) -> None:
        """Give a contact a velocity by an impulse, shared by the locks that can carry it."""
        carrying, y = [k for k in self.held() if k not in (i, *self.jumped)], list(self.y)
        while True:
            rows = [i, *carrying]
            P = self._share([self.contacts[k] for k in rows], self.contacts[i], goal)
            gone = {
                k
                for k, p in zip(rows[1:], P[1:], strict=True)
                if self.leaves(self.contacts[k], self.modes[k], p) is not None
            }
            if not gone:
                return
            self.y, carrying = list(y), [k for k in carrying if k not in gone]

    def _share(self, rows: Sequence[Contact], struck: Contact | None, goal: Any) -> list[Any]:
        """Change the velocities so that all rows have velocity 0, and the struck one its goal."""
        wanted = [{"1": self.of(self.velocity(c)) - (goal if c is struck else 0)} for c in rows]
        P = [each.get("1", 0) for each in self._carried(rows, wanted)]
        for c, p in zip(rows, P, strict=True):
            for body, k in c.row.items():
                if body in self.free:
                    self.y[self.place[f"v_{body}"]] -= k * p / self.free[body][0]
        return P

    # ------------------------------------------------------------------ at the end
    def end(self) -> dict[str, Any]:
        """Return positions, velocities, further states and forces, by their names in gms-fsm."""
        _, forces = self.dynamics(self.modes)
        found: dict[str, Any] = {}
        for body in self.free:
            found |= {f"{body}.{q}": self.y[self.place[f"{q}_{body}"]] for q in "xv"}
        own = {z: c.name for c in self.contacts for rates in c.rates.values() for z in rates}
        for name in (*self.flow, *own):
            label = f"{own[name]}.{name}" if name in own else name
            found[label] = self.y[self.place[name]]
        for c, force in zip(self.contacts, forces, strict=True):
            found[f"{c.name}.F"] = found.get(f"{c.name}.F", 0) + self.of(force)
        return found
