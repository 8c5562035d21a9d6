"""An exact, event-driven simulation of systems whose motion is linear between events.

It shares no code with the packages. Between two events the state, extended by 1, by t, by the
oscillators of sinusoidal forces and by the values that controllers hold, obeys s' = A s. Steps of
at most one radian of the fastest mode are Taylor polynomials, exact to rounding; so every
comparison of a guard is a polynomial in time. Its first root is looked for between seventeen points
and the extrema between them, and refined to the last bits.

Rules at an event: all enabled edges of one instant fire as one set, in the order of the contacts,
and then the guards are asked again. A comparison that is zero to rounding counts as equal; once
nothing more fires, it counts as what it will be just after. Velocities are set by impulses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from random import Random
from typing import Any, NamedTuple

import numpy as np

ORDER = 22  # of the Taylor polynomials: 1 / 23! is 4e-23
ZERO = 1e-12  # what rounding leaves of zero, relative to the summands
CLOSE = 1e-9
DEPENDENT = 1e-9  # a pivot under this part of the diagonal is rounding
MOST_MICROSTEPS = 60
MOST_EVENTS = 6000
POINTS = np.linspace(0.0, 1.0, 17)
POWERS = POINTS[:, None] ** np.arange(ORDER + 1)
FALLING = np.arange(1, ORDER + 1)


class Undecided(Exception):
    """No choice of modes is consistent at one instant, or a lock would take a velocity."""


class Endless(Exception):
    """Events without end in a finite time."""


class Firing(NamedTuple):
    """A transition."""

    t: float
    contact: str
    element: int
    edge: str


@dataclass(frozen=True)
class Touch:
    """A contact: its kind, coefficients of its velocity by body, numbers, initial state."""

    name: str
    kind: str
    row: Mapping[int, float]
    values: Mapping[str, Any]
    state: str

    @property
    def elements(self) -> int:
        """How many machines it has."""
        return len(self.values["k"]) if self.kind == "gms" else 1


@dataclass(frozen=True)
class Controller:
    """Values that change at ticks: for each a linear formula over named quantities, in order."""

    period: float
    updates: Sequence[tuple[str, Mapping[str, float]]]
    acts: str  # this value is a force
    body: int  # on this body


@dataclass(frozen=True)
class Plain:
    """A system as numbers: free bodies first, then driven ones.

    Springs are (i, j, k, d) with j = -1 for the ground; loads (A, w, phi, B, C) of the free bodies
    are A sin(w t + phi) + B + C t; belts are corners (t, v).
    """

    masses: Sequence[float]
    springs: Sequence[tuple[int, int, float, float]]
    loads: Sequence[tuple[float, float, float, float, float]]
    belts: Sequence[Sequence[tuple[float, float]]]
    controllers: Sequence[Controller]
    touches: Sequence[Touch]
    x: Sequence[float]
    v: Sequence[float]
    t_end: float


@dataclass
class Run:
    """What happened: transitions, the end, and where rounding decides, with times."""

    firings: list[Firing] = field(default_factory=list)
    x: list[float] = field(default_factory=list)
    v: list[float] = field(default_factory=list)
    z: dict[str, list[float]] = field(default_factory=dict)
    notes: list[tuple[float, str]] = field(default_factory=list)
    trail: list[tuple[float, list[float], list[float], tuple[str, ...]]] = field(
        default_factory=list
    )


@dataclass(frozen=True, eq=False)
class Arc:
    """The linear motion in one combination of modes."""

    h: float
    taylor: np.ndarray  # (ORDER + 1, N, N): A^k h^k / k!
    rows: np.ndarray  # (g, N): the comparisons
    margins: np.ndarray  # (ORDER + 1, g, N): their Taylor coefficients
    sizes: np.ndarray  # |margins|
    place: Mapping[tuple[int, int, str], int]  # (contact, element, comparison) -> row
    watched: tuple[int, ...]
    accelerations: np.ndarray
    broken: np.ndarray  # (locks, N): what locks that repeat others ask of them in vain, must be 0


# --------------------------------------------------------------------------- edges
Sign = Callable[[str], int]
LOCKED = {"stuck", "rest", "engaged"}
EDGES: dict[str, dict[str, list[tuple[str, str, Callable[[Sign], bool]]]]] = {
    "stiction": {
        "stuck": [
            ("release_forward", "forward", lambda s: s("F - F_s") > 0),
            ("release_backward", "backward", lambda s: s("F + F_s") < 0),
        ],
        "forward": [
            ("arrest_forward", "stuck", lambda s: s("v") < 0),
            ("reverse_forward", "backward", lambda s: s("v") < 0),
        ],
        "backward": [
            ("arrest_backward", "stuck", lambda s: s("v") > 0),
            ("reverse_backward", "forward", lambda s: s("v") > 0),
        ],
    },
    "end-stop": {
        "free": [
            ("bounce", "free", lambda s: s("x - x_s") >= 0 and s("v - v_r") > 0),
            ("settle", "rest", lambda s: s("x - x_s") >= 0 and s("v") > 0 and s("v - v_r") <= 0),
        ],
        "rest": [("lift", "free", lambda s: s("F") < 0)],
    },
    "backlash": {
        "apart": [
            ("touch_right", "right", lambda s: s("x - gap") >= 0 and s("v") > 0),
            ("touch_left", "left", lambda s: s("x + gap") <= 0 and s("v") < 0),
        ],
        "right": [("leave_right", "apart", lambda s: s("F") < 0)],
        "left": [("leave_left", "apart", lambda s: s("F") > 0)],
    },
    "dog-clutch": {
        "open": [("engage", "engaged", lambda s: s("t - t_on") >= 0 and s("t - t_off") < 0)],
        "engaged": [("disengage", "open", lambda s: s("t - t_off") >= 0)],
    },
    "gms": {
        "stick": [
            ("break_away_forward", "slip", lambda s: s("z - s") >= 0 and s("v - v_c") > 0),
            ("break_away_backward", "slip", lambda s: s("z + s") <= 0 and s("v + v_c") < 0),
        ],
        "slip": [
            (
                "arrest",
                "stick",
                lambda s: (
                    s("v - v_c") <= 0 and s("v + v_c") >= 0 and s("z - s") < 0 and s("z + s") > 0
                ),
            )
        ],
    },
}
# Comparisons in which a state is left, or its flow changes.
COMPARISONS = {
    ("stiction", "stuck"): ("F - F_s", "F + F_s"),
    ("stiction", "forward"): ("v",),
    ("stiction", "backward"): ("v",),
    ("end-stop", "free"): ("x - x_s", "v", "v - v_r"),
    ("end-stop", "rest"): ("F",),
    ("backlash", "apart"): ("x - gap", "x + gap", "v"),
    ("backlash", "right"): ("F",),
    ("backlash", "left"): ("F",),
    ("dog-clutch", "open"): (),
    ("dog-clutch", "engaged"): (),
    ("gms", "stick"): ("z - s", "z + s", "v - v_c", "v + v_c"),
    ("gms", "slip"): ("z - s", "z + s", "v - v_c", "v + v_c", "v"),
}


# --------------------------------------------------------------------------- the simulation
class Simulation:
    """One run of a plain system."""

    def __init__(self, plain: Plain) -> None:
        self.plain = plain
        self.free = len(plain.masses)
        self.bodies = self.free + len(plain.belts)
        names = [f"x{b}" for b in range(self.bodies)] + [f"v{b}" for b in range(self.bodies)]
        for c, touch in enumerate(plain.touches):
            names += [f"z{c}_{e}" for e in range(touch.elements) if touch.kind == "gms"]
        for each in plain.controllers:
            names += [name for name, _ in each.updates]
        for b in range(self.free):
            names += [f"cos{b}", f"sin{b}"]
        names += ["t", "1"]
        self.at = {name: i for i, name in enumerate(names)}
        self.size = len(names)
        self.J = np.zeros((len(plain.touches), self.bodies))
        for c, touch in enumerate(plain.touches):
            for b, coefficient in touch.row.items():
                self.J[c, b] = coefficient
        self.Jf = self.J[:, : self.free]
        self.inverse = 1.0 / np.array(plain.masses)
        self.W = (self.Jf * self.inverse) @ self.Jf.T
        self.mode = [[touch.state] * touch.elements for touch in plain.touches]
        self.side = [0] * len(plain.touches)  # sgn(v) in the slip law
        self.jumped = [False] * len(plain.touches)
        # Whether z has been at its threshold since it broke away; else it tends to it, and never
        # gets there, however close it comes.
        self.pinned = [[False] * touch.elements for touch in plain.touches]
        self.segment = [0] * len(plain.belts)
        self.arcs: dict[Any, Arc] = {}
        self.t = 0.0
        self.s = np.zeros(self.size)
        self.s[self.at["1"]] = 1.0
        self.s[: self.free] = plain.x
        self.s[self.bodies : self.bodies + self.free] = plain.v
        for i, corners in enumerate(plain.belts):
            self.s[self.bodies + self.free + i] = corners[0][1]
        self.run = Run()
        self.stops = self._stops()

    def _stops(self) -> list[tuple[float, list[tuple[str, int]]]]:
        """Return the known times, each with what happens then, in order."""
        found: dict[float, list[tuple[str, int]]] = {0.0: [], self.plain.t_end: []}
        for i, corners in enumerate(self.plain.belts):
            for k, (t, _) in enumerate(corners):
                found.setdefault(t, []).append(("corner", i * 1000 + k))
        for i, each in enumerate(self.plain.controllers):
            period = Fraction(repr(each.period))
            for k in range(int(Fraction(self.plain.t_end) / period) + 1):
                found.setdefault(float(k * period), []).append(("tick", i))
        for touch in self.plain.touches:
            if touch.kind == "dog-clutch":
                found.setdefault(touch.values["t_on"], [])
                found.setdefault(touch.values["t_off"], [])
        return sorted((t, what) for t, what in found.items() if t <= self.plain.t_end)

    # ------------------------------------------------------------------ arcs
    def row(self, entries: Mapping[str, float]) -> np.ndarray:
        """Return a linear function of the state."""
        row = np.zeros(self.size)
        for name, value in entries.items():
            row[self.at[name]] += value
        return row

    def motion(self, c: int, letter: str) -> np.ndarray:
        """Return the position or the velocity of a contact as a row."""
        row = np.zeros(self.size)
        first = 0 if letter == "x" else self.bodies
        row[first : first + self.bodies] = self.J[c]
        return row

    def locked(self) -> list[int]:
        """Return the locked contacts."""
        return [c for c, modes in enumerate(self.mode) if modes[0] in LOCKED]

    def independent(self, chosen: Sequence[int]) -> list[int]:
        """Return those that do not repeat the ones before them."""
        kept: list[int] = []
        for c in chosen:
            pivot = self.W[c, c]
            if kept:
                w = self.W[np.ix_(kept, kept)]
                pivot -= self.W[c, kept] @ np.linalg.solve(w, self.W[kept, c])
            if pivot > DEPENDENT * self.W[c, c]:
                kept.append(c)
        return kept

    def arc(self) -> Arc:
        """Return the motion in the present modes."""
        key = (tuple(map(tuple, self.mode)), tuple(self.side), tuple(self.segment))
        found = self.arcs.get(key)
        if found is None:
            found = self.arcs[key] = self._arc()
        return found

    def _arc(self) -> Arc:
        plain, at, one = self.plain, self.at, self.row({"1": 1.0})
        A = np.zeros((self.size, self.size))
        A[: self.bodies, self.bodies : 2 * self.bodies] = np.eye(self.bodies)
        forces = np.zeros((self.free, self.size))
        for i, j, k, d in plain.springs:
            pull = self.row({f"x{i}": k, f"v{i}": d})
            if j >= 0:
                pull -= self.row({f"x{j}": k, f"v{j}": d})
            forces[i] -= pull
            if 0 <= j < self.free:
                forces[j] += pull
        for b, (size, w, _, constant, ramp) in enumerate(plain.loads):
            forces[b] += self.row({f"sin{b}": size, "1": constant, "t": ramp})
            A[at[f"cos{b}"], at[f"sin{b}"]] = -w
            A[at[f"sin{b}"], at[f"cos{b}"]] = w
        for each in plain.controllers:
            forces[each.body] += self.row({each.acts: 1.0})
        A[at["t"], at["1"]] = 1.0
        driven = np.zeros((len(plain.belts), self.size))
        for i, corners in enumerate(plain.belts):
            k = self.segment[i]
            if 0 < k < len(corners):
                (t0, v0), (t1, v1) = corners[k - 1], corners[k]
                driven[i] = (v1 - v0) / (t1 - t0) * one
        F = np.zeros((len(plain.touches), self.size))
        for c, touch in enumerate(plain.touches):
            F[c] = self._force(c, touch, A)
        a = self.inverse[:, None] * (forces - self.Jf.T @ F)
        kept = self.independent(self.locked())
        if kept:
            goal = self.Jf[kept] @ a + self.J[kept][:, self.free :] @ driven
            hold = np.linalg.solve(self.W[np.ix_(kept, kept)], goal)
            F[kept] = hold
            a -= self.inverse[:, None] * (self.Jf[kept].T @ hold)
        others = [c for c in self.locked() if c not in kept]
        broken = self.Jf[others] @ a + self.J[others][:, self.free :] @ driven
        A[self.bodies : self.bodies + self.free] = a
        A[self.bodies + self.free : 2 * self.bodies] = driven
        place, rows = {}, []
        for c, touch in enumerate(plain.touches):
            for e, mode in enumerate(self.mode[c]):
                for name in COMPARISONS[touch.kind, mode]:
                    place[c, e, name] = len(rows)
                    rows.append(self._comparison(c, e, name, F[c]))
            place[c, -1, "v"] = len(rows)
            rows.append(self.motion(c, "v"))
        watched = tuple(r for (_, e, _), r in place.items() if e >= 0)
        fastest = float(max(abs(np.linalg.eigvals(A))))
        h = 1.0 / max(fastest, 10.0)
        R = np.array(rows)
        taylor = np.empty((ORDER + 1, self.size, self.size))
        taylor[0] = np.eye(self.size)
        for k in range(1, ORDER + 1):
            taylor[k] = A @ taylor[k - 1] * (h / k)
        margins = R @ taylor
        return Arc(h, taylor, R, margins, np.abs(margins), place, watched, a, broken)

    def _force(self, c: int, touch: Touch, A: np.ndarray) -> np.ndarray:
        """Return the force of a contact that is not locked, and write the flow of its elements."""
        mode, p = self.mode[c], touch.values
        x, v, one = self.motion(c, "x"), self.motion(c, "v"), self.row({"1": 1.0})
        if touch.kind == "stiction" and mode[0] != "stuck":
            return (1 if mode[0] == "forward" else -1) * p["F_c"] * one + p["b"] * v
        if touch.kind == "backlash" and mode[0] != "apart":
            side = -1 if mode[0] == "right" else 1
            return p["k"] * (x + side * p["gap"] * one) + p["d"] * v
        F = np.zeros(self.size)
        if touch.kind == "gms":
            F += p["sigma_2"] * v
            for e, each in enumerate(mode):
                z, s = self.row({f"z{c}_{e}": 1.0}), p["weights"][e] * p["F_c"]
                dz = v if each == "stick" else p["C"][e] * (self.side[c] * one - z / s)
                A[self.at[f"z{c}_{e}"]] = dz
                F += p["k"][e] * z + p["sigma"][e] * dz
        return F

    def _comparison(self, c: int, e: int, name: str, F: np.ndarray) -> np.ndarray:
        """Return a margin as a row."""
        p, one = self.plain.touches[c].values, self.row({"1": 1.0})
        what, _, limit = name.partition(" ")
        if what == "F":
            row = F.copy()
        elif what == "z":
            row = self.row({f"z{c}_{e}": 1.0})
        else:
            row = self.motion(c, what)
        if limit:
            sign, number = limit.split()
            value = p["weights"][e] * p["F_c"] if number == "s" else p[number]
            row = row + (1 if sign == "+" else -1) * value * one
        return row

    # ------------------------------------------------------------------ signs
    def sign(self, row: int, arc: Arc, *, after: bool) -> int:
        """Return the sign of a comparison now, or just after now."""
        s, size = self.s, np.abs(self.s)
        for k in range(ORDER + 1 if after else 1):
            value = arc.margins[k, row] @ s
            if abs(value) > ZERO * (1.0 + arc.sizes[k, row] @ size):
                return 1 if value > 0 else -1
        return 0

    def velocity(self, c: int) -> float:
        """Return a contact's velocity; zero to rounding is zero."""
        w = self.s[self.bodies : 2 * self.bodies]
        v = self.J[c] @ w
        return 0.0 if abs(v) <= ZERO * (1.0 + np.abs(self.J[c]) @ np.abs(w)) else float(v)

    def enabled(self, *, after: bool) -> list[tuple[int, int, str, str]]:
        """Return the first enabled edge of each machine."""
        arc, found = self.arc(), []
        for c, touch in enumerate(self.plain.touches):
            moved = self.velocity(c) if self.jumped[c] else 0.0
            for e, mode in enumerate(self.mode[c]):
                signs: dict[str, int] = {}

                def sign(
                    name: str,
                    c: int = c,
                    e: int = e,
                    mode: str = mode,
                    moved: float = moved,
                    signs: dict[str, int] = signs,
                    touch: Touch = touch,
                ) -> int:
                    if name.startswith("t"):
                        t = touch.values[name[4:]]
                        return (self.t > t) - (self.t < t)
                    if mode in LOCKED and moved != 0.0:
                        return 1 if moved > 0 else -1  # F is larger than anything
                    if name not in signs:
                        tends = mode == "slip" and name[0] == "z" and not self.pinned[c][e]
                        if tends and self.gap(c, e) < CLOSE:
                            signs[name] = -1 if name == "z - s" else 1
                        else:
                            signs[name] = self.sign(arc.place[c, e, name], arc, after=after)
                    return signs[name]

                for edge, target, guard in EDGES[touch.kind][mode]:
                    if self.jumped[c] and edge.startswith("arrest_"):
                        continue
                    if guard(sign):
                        found.append((c, e, edge, target))
                        break
        return found

    def sides(self) -> None:
        """Choose sgn(v) of the slip laws, on v = 0 that of the side to which the flow leads."""
        for c, touch in enumerate(self.plain.touches):
            if touch.kind != "gms":
                continue
            v, before = self.velocity(c), self.side[c]
            if "slip" not in self.mode[c]:
                self.side[c] = 0
                continue
            if v != 0.0:
                self.side[c] = 1 if v > 0 else -1
                if before == -self.side[c]:
                    self.pinned[c] = [False] * touch.elements
                continue
            for side in (1, -1):
                self.side[c] = side
                arc = self.arc()
                if self.sign(arc.place[c, -1, "v"], arc, after=True) == side:
                    break
            else:
                self.side[c] = 0

    # ------------------------------------------------------------------ acts
    def fire(self, *, after: bool) -> bool:
        """Take all enabled edges as one set, up to one after which the guards are new.

        It is an impulse, or one that lets go of a lock: what the other locks hold is new, too.
        """
        self.sides()
        edges = self.enabled(after=after)
        # Locks that an impulse has moved let go first: what the others hold depends on them.
        first = [each for each in edges if self.moved(each[0])]
        for c, e, edge, target in first or edges:
            p, v = self.plain.touches[c].values, self.velocity(c)
            self.run.firings.append(Firing(self.t, self.plain.touches[c].name, e, edge))
            releases = self.mode[c][e] in LOCKED and target not in LOCKED
            self.mode[c][e] = target
            if target == "slip":
                self.pinned[c][e] = True
            elif edge == "arrest" and not self.pinned[c][e] and self.gap(c, e) < CLOSE:
                self.run.notes.append((self.t, f"|z| of element {e} is s but for rounding"))
            if edge in ("bounce", "settle", "engage"):
                self.impulse(c, -p["e"] * v if edge == "bounce" else 0.0)
                break
            if releases:
                break
        return bool(edges)

    def gap(self, c: int, e: int) -> float:
        """Return how far |z| of an element is from s, as a part of s."""
        p = self.plain.touches[c].values
        s = p["weights"][e] * p["F_c"]
        return abs(abs(float(self.s[self.at[f"z{c}_{e}"]])) - s) / s

    def moved(self, c: int) -> bool:
        """Return whether a contact is locked, but an impulse has moved it."""
        return self.jumped[c] and self.mode[c][0] in LOCKED and self.velocity(c) != 0.0

    def impulse(self, c: int, goal: float) -> None:
        """Set the velocity of a contact; as many held locks as can carry the impulse keep theirs.

        A stuck contact carries none. A stop at rest carries one that pushes into it; if it lets go
        it moves away.
        """
        first, free = self.bodies, self.free
        w = self.s[first : first + self.bodies]
        before = self.J @ w
        held = [each for each in self.locked() if each != c and self.velocity(each) == 0.0]
        for kept in sorted(subsets(held), key=len, reverse=True):
            rows = self.independent(sorted([*kept, c]))
            right = np.array([before[r] - goal if r == c else 0.0 for r in rows])
            P = np.linalg.solve(self.W[np.ix_(rows, rows)], right)
            after = before - self.W[:, rows] @ P
            limit = ZERO * (1.0 + float(np.max(np.abs(P))))
            carried = dict(zip(rows, P.tolist(), strict=True))
            if all(
                self.carries(r, carried.get(r, 0.0), limit)
                if r in kept
                else self.mode[r][0] != "engaged"
                and not (self.mode[r][0] == "rest" and after[r] > limit)
                for r in held
            ):
                break
        else:
            raise Undecided(f"at t = {self.t!r}: no locks can carry the impulse on contact {c}")
        w[:free] -= self.inverse * (self.Jf[rows].T @ P)
        after = self.J @ w
        for r in range(len(before)):
            if abs(after[r] - before[r]) > ZERO * (1.0 + abs(before[r])):
                self.jumped[r] = True

    def carries(self, c: int, impulse: float, limit: float) -> bool:
        """Return whether a lock holds against an impulse."""
        mode = self.mode[c][0]
        if mode == "stuck":
            return abs(impulse) <= limit
        return mode == "engaged" or impulse >= -limit

    def rest(self) -> None:
        """Put locked contacts to rest exactly: what is taken is rounding."""
        kept = self.independent(self.locked())
        if kept:
            w = self.s[self.bodies : 2 * self.bodies]
            v = self.J[kept] @ w
            if max(abs(v)) > 1e-9:
                raise Undecided(f"at t = {self.t!r}: a lock would take v = {max(abs(v)):.3g}")
            P = np.linalg.solve(self.W[np.ix_(kept, kept)], v)
            w[: self.free] -= self.inverse * (self.Jf[kept].T @ P)

    def settle(self) -> None:
        """Fire until nothing is enabled, now and just after."""
        count = 0
        self.jumped = [False] * len(self.jumped)
        while True:
            while self.fire(after=False):
                count += 1
                if count > MOST_MICROSTEPS:
                    raise Undecided(f"at t = {self.t!r}: {self.run.firings[-8:]}")
            self.rest()
            self.jumped = [False] * len(self.jumped)
            if not self.fire(after=True):
                break
            count += 1
            if count > MOST_MICROSTEPS:
                raise Undecided(f"at t = {self.t!r}: {self.run.firings[-8:]}")
        if np.any(np.abs(self.arc().broken @ self.s) > 1e-9):
            raise Undecided(f"at t = {self.t!r}: locks contradict one another")
        if len(self.run.firings) > MOST_EVENTS:
            raise Endless(f"{MOST_EVENTS} events until t = {self.t!r}")

    # ------------------------------------------------------------------ flowing
    def happen(self, what: Sequence[tuple[str, int]]) -> None:
        """Tick, or turn a corner."""
        for kind, i in what:
            if kind == "tick":
                for name, formula in self.plain.controllers[i].updates:
                    self.s[self.at[name]] = self.row(formula) @ self.s
            else:
                belt, k = divmod(i, 1000)
                self.segment[belt] = k + 1
                self.s[self.bodies + self.free + belt] = self.plain.belts[belt][k][1]

    def refresh(self) -> None:
        """Set what is known of time exactly."""
        self.s[self.at["t"]] = self.t
        for b, (_, w, phi, _, _) in enumerate(self.plain.loads):
            self.s[self.at[f"cos{b}"]] = math.cos(w * self.t + phi)
            self.s[self.at[f"sin{b}"]] = math.sin(w * self.t + phi)

    def flow(self, until: float) -> bool:
        """Flow to the next crossing; return whether it came before the known time."""
        arc = self.arc()
        while True:
            share = (until - self.t) / arc.h
            last = share <= 1.0
            powers = min(share, 1.0) ** np.arange(ORDER + 1)
            coefficients = (arc.margins[:, arc.watched] @ self.s) * powers[:, None]
            limits = ZERO * (1.0 + arc.sizes[:, arc.watched] @ np.abs(self.s)) * powers[:, None]
            first = 2.0
            for g in range(len(arc.watched)):
                root = first_root(coefficients[:, g], limits[:, g])
                first = min(first, root)
            x = min(first, 1.0) * min(share, 1.0)
            self.s = np.tensordot(x ** np.arange(ORDER + 1), arc.taylor, 1) @ self.s
            if first <= 1.0:
                self.t += float(x * arc.h)
                return True
            if last:
                self.t = until
                return False
            self.t += arc.h

    def complete(self) -> Run:
        """Run to the end."""
        self.refresh()
        for t, what in self.stops:
            while self.t < t and self.flow(t):
                self.refresh()
                self.settle()
                self.note()
            self.t = t
            self.refresh()
            self.happen(what)
            self.settle()
            self.note()
        self.run.x = self.s[: self.bodies].tolist()
        self.run.v = self.s[self.bodies : 2 * self.bodies].tolist()
        for c, touch in enumerate(self.plain.touches):
            if touch.kind == "gms":
                first = self.at[f"z{c}_0"]
                self.run.z[touch.name] = self.s[first : first + touch.elements].tolist()
        return self.run

    def note(self) -> None:
        """Keep the state after an event."""
        n = self.bodies
        modes = tuple(",".join(each) for each in self.mode)
        self.run.trail.append((self.t, self.s[:n].tolist(), self.s[n : 2 * n].tolist(), modes))


def subsets(held: Sequence[int]) -> list[list[int]]:
    """Return all choices among these."""
    found: list[list[int]] = [[]]
    for each in held:
        found += [[*one, each] for one in found]
    return found


def first_root(p: np.ndarray, limits: np.ndarray) -> float:
    """Return the first root of a polynomial in (0, 1], or 2; one at 0 itself does not count."""
    size = np.abs(p)
    if size[0] > size[1:].sum():
        return 2.0
    m = 0
    while m <= ORDER and size[m] <= limits[m]:
        m += 1
    if m > ORDER:
        return 2.0
    q = np.zeros(ORDER + 1)
    q[: ORDER + 1 - m] = p[m:]
    values = POWERS @ q
    slopes = POWERS[:, :-1] @ (q[1:] * FALLING)
    sign = values[0] > 0.0
    coefficients = q[::-1].tolist()
    derived = (q[1:] * FALLING)[::-1].tolist()
    for j in range(1, len(POINTS)):
        a, b = float(POINTS[j - 1]), float(POINTS[j])
        # An extremum in between can hide two roots: where it lies beyond zero, stop before it.
        if (slopes[j - 1] > 0.0) != (slopes[j] > 0.0) and (slopes[j - 1] > 0.0) != sign:
            x = bisected(derived, a, b, slopes[j - 1] > 0.0)
            if (horner(coefficients, x) > 0.0) != sign:
                return bisected(coefficients, a, x, sign)
        if (values[j] > 0.0) != sign:
            return bisected(coefficients, a, b, sign)
    # Met just at the end: the next piece starts there, and would take it for one that it left.
    return 1.0 if abs(values[-1]) <= limits[0] else 2.0


def horner(coefficients: Sequence[float], x: float) -> float:
    """Return the value of a polynomial, highest power first."""
    value = 0.0
    for each in coefficients:
        value = value * x + each
    return value


def bisected(coefficients: Sequence[float], a: float, b: float, sign: bool) -> float:
    """Return the point in [a, b] where the sign changes; it is `sign` at a."""
    fa, fb = horner(coefficients, a), horner(coefficients, b)
    for k in range(80):
        if b - a <= 2e-16:
            break
        x = 0.5 * (a + b)
        if fa != fb:  # a secant first, kept inside
            secant = a - fa * (b - a) / (fb - fa)
            x = secant if k % 3 and a < secant < b else x
        fx = horner(coefficients, x)
        if fx == 0.0:
            return x
        if (fx > 0.0) == sign:
            a, fa = x, fx
        else:
            b, fb = x, fx
    return b


def simulate(plain: Plain) -> Run:
    """Run a plain system to its end."""
    return Simulation(plain).complete()


# --------------------------------------------------------------------------- conditioning
def perturbed(plain: Plain, part: float, seed: int) -> Plain:
    """Return the system with every number changed by about this part of it; ratios stay."""
    chance = Random(seed)

    def moved(value: float) -> float:
        return value * (1.0 + part * chance.uniform(-1.0, 1.0))

    def numbers(values: Mapping[str, Any]) -> dict[str, Any]:
        new = {
            name: [moved(each) for each in value] if isinstance(value, list) else moved(value)
            for name, value in values.items()
        }
        if "F_s" in values and values["F_s"] == values["F_c"]:
            new["F_s"] = new["F_c"]
        return new

    return replace(
        plain,
        masses=[moved(m) for m in plain.masses],
        springs=[(i, j, moved(k), moved(d)) for i, j, k, d in plain.springs],
        loads=[tuple(moved(each) for each in load) for load in plain.loads],
        belts=[[(t, moved(v)) for t, v in corners] for corners in plain.belts],
        controllers=[
            replace(
                each,
                updates=[
                    (name, {key: moved(value) for key, value in formula.items()})
                    for name, formula in each.updates
                ],
            )
            for each in plain.controllers
        ],
        touches=[replace(each, values=numbers(each.values)) for each in plain.touches],
        x=[moved(x) for x in plain.x],
        v=[moved(v) for v in plain.v],
    )
