"""Writes what holds locked contacts, and the impulses that set velocities.

A locked contact is a constraint: its relative velocity J w is 0, and its force F is what keeps it
so. With a the accelerations without the forces of locked contacts, these forces solve
(J M^-1 J') F = J a, here by an unrolled L D L' in which the row of an unlocked contact is that of
the identity; so there is one text for every combination. Entries that are zero by structure are
left out: for chains and trees of bodies the text, and the time it takes, is linear.

Where a lock would repeat those before it (its pivot is zero to rounding), the earlier contacts
carry the force and the later one none. Last the dependent accelerations (or velocities) are set
exactly, so that a stuck body is at rest to the last bit.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass

from gms_fsm.language import Binary, Name, Negative, Number, Value
from gms_fsm.lowering._lines import Line, Writer, indented
from gms_fsm.lowering._names import computed_names
from gms_fsm.lowering._plan import times
from gms_fsm.systems.system import Body

__all__ = ["Lock", "Locks"]

# A pivot under this part of the diagonal is one that rounding has left of zero.
DEPENDENT = 1e-9
UNITS = (Number(1.0), Number(-1.0), Negative(Number(1.0)))


@dataclass(frozen=True)
class Lock:
    """One velocity of a contact that can be locked, or be set by an action.

    Parameters
    ----------
    bank, velocity : int
        Which contact, and which of its velocities.
    row : mapping of str to Value
        Coefficients by body.
    """

    bank: int
    velocity: int
    row: Mapping[str, Value]


class Locks:
    """Writes the equations of all locks of a system.

    Parameters
    ----------
    writer : Writer
        Of its program.
    """

    def __init__(self, writer: Writer) -> None:
        self.writer, self.read = writer, writer.read
        self.bodies = {body.name: body for body in self.read.system.bodies}
        self.rows = [
            Lock(bank.index, q, row)
            for bank in self.read.banks
            if bank.chart.locks or bank.chart.sets_velocity
            for q, row in enumerate(bank.jacobian)
        ]

    def number(self, bank: int, velocity: int = 0) -> int:
        """Return the row of a contact's velocity."""
        return next(
            r for r, each in enumerate(self.rows) if (each.bank, each.velocity) == (bank, velocity)
        )

    def free(self, row: Mapping[str, Value]) -> dict[str, Value]:
        """Return the coefficients of free bodies."""
        return {name: value for name, value in row.items() if not self.bodies[name].driven}

    def weight(self, a: Lock, b: Lock) -> Value | None:
        """Return an entry of J M^-1 J'; None where it is zero by structure."""
        total: Value | None = None
        for name, one in self.free(a.row).items():
            if name in b.row:
                term = Binary("/", times(one, b.row[name]), self.inertia(name))
                total = term if total is None else Binary("+", total, term)
        return total

    def inertia(self, body: str) -> Value:
        """Return a body's inertia."""
        return self.read.inertias[body]

    def relative(self, row: Mapping[str, Value], name_of: Mapping[str, str]) -> Value:
        """Return J w, over names for the bodies."""
        total: Value | None = None
        for body, coefficient in row.items():
            term = times(coefficient, Name(name_of[body]))
            total = term if total is None else Binary("+", total, term)
        assert total is not None
        return total

    # ------------------------------------------------------------------ the equations
    def solve(self, right: Mapping[int, Value]) -> list[Line]:
        """Write the solution hold_r of the equations, with flags l_r and right sides."""
        put, rows = self.writer.put, range(len(self.rows))
        entries = {
            (r, s): value
            for r in rows
            for s in range(r + 1)
            if (value := self.weight(self.rows[r], self.rows[s])) is not None
        }
        order = self.order({key for key in entries if key[0] != key[1]})
        place = {r: k for k, r in enumerate(order)}
        # Which entries of L are not zero: those of the matrix, and what elimination fills in.
        lower = {
            (r, s) if place[r] > place[s] else (s, r) for r, s in entries if place[r] != place[s]
        }
        for k in order:
            below = [r for r in order if (r, k) in lower]
            lower |= {(r, s) for r in below for s in below if place[r] > place[s]}
        lines: list[Line] = []
        for s in order:
            diagonal = entries[s, s]
            lines.append(put(f"W_{s}", diagonal))
            less = "".join(f" - L_{s}_{k} * L_{s}_{k} * D_{k}" for k in order if (s, k) in lower)
            lines += [
                Line(f"D_{s} = W_{s}{less}"),
                Line(f"if l_{s} == 0.0 or D_{s} <= {DEPENDENT} * W_{s}:"),
                Line(f"    l_{s} = 0.0"),
                Line(f"    D_{s} = 1.0"),
            ]
            for r in order:
                if (r, s) in lower:
                    entry = entries.get((max(r, s), min(r, s)))
                    text = "0.0" if entry is None else self.writer.spell(entry)
                    reads = frozenset() if entry is None else computed_names(entry)
                    less = "".join(
                        f" - L_{r}_{k} * L_{s}_{k} * D_{k}"
                        for k in order
                        if (r, k) in lower and (s, k) in lower
                    )
                    lines.append(Line(f"L_{r}_{s} = l_{r} * l_{s} * ({text}{less}) / D_{s}", reads))
        for r in order:
            value = right[r]
            less = "".join(f" - L_{r}_{k} * w_{k}" for k in order if (r, k) in lower)
            lines.append(
                Line(f"w_{r} = l_{r} * ({self.writer.spell(value)}{less})", computed_names(value))
            )
        for r in reversed(order):
            less = "".join(f" - L_{k}_{r} * hold_{k}" for k in order if (k, r) in lower)
            lines.append(Line(f"hold_{r} = w_{r} / D_{r}{less}"))
        return lines

    def order(self, links: Set[tuple[int, int]]) -> list[int]:
        """Return the order of elimination.

        As listed, which decides who carries a force that several could carry. Where no lock can
        repeat others, because the contacts join the bodies and the ground to trees, it is free:
        the row with the fewest neighbours comes next, so that nothing is filled in.
        """
        rows = list(range(len(self.rows)))
        if not self.joins_trees():
            return rows
        near: dict[int, set[int]] = {r: set() for r in rows}
        for r, s in links:
            near[r].add(s)
            near[s].add(r)
        order: list[int] = []
        while near:
            r = min(near, key=lambda each: (len(near[each]), each))
            others = near.pop(r)
            for s in others:
                near[s] = (near[s] | others) - {r, s}
            order.append(r)
        return order

    def joins_trees(self) -> bool:
        """Return whether the rows join bodies and the ground without closing a loop."""
        group: dict[str | None, str | None] = {None: None, **{name: name for name in self.bodies}}

        def root(name: str | None) -> str | None:
            while group[name] != name:
                name = group[name]
            return name

        for each in self.rows:
            ends: list[str | None] = [*self.free(each.row)]
            if len(ends) == 1:
                ends.append(None)
            one, *others = map(root, ends)
            if len(others) != 1 or one == others[0]:
                return False
            group[one if one is not None else others[0]] = others[0] if one is not None else one
        return True

    def exact(
        self, name_of: Mapping[str, str], target: Mapping[int, str] | None = None
    ) -> list[Line]:
        """Set the dependent accelerations, or velocities, exactly."""
        lines: list[Line] = []
        for r, body in self.sequence():
            row = self.rows[r].row
            others = {name: value for name, value in row.items() if name != body}
            goal = (target or {}).get(r, "0.0")
            text, reads = goal, frozenset[str]()
            if others:
                tree = self.relative(others, name_of)
                spelled = self.writer.spell(tree)
                text = f"-({spelled})" if goal == "0.0" else f"{goal} - ({spelled})"
                reads = computed_names(tree)
            coefficient = row[body]
            if coefficient != Number(1.0):
                spelled = self.writer.spell(coefficient)
                text = f"({text}) / ({spelled})"
                reads |= computed_names(coefficient)
            local = self.writer.local(name_of[body])
            lines += [Line(f"if l_{r} > 0.0:"), Line(f"    {local} = {text}", reads)]
        return lines

    def sequence(self) -> list[tuple[int, str]]:
        """Return the rows with the body that each sets, so that what a row reads was set before.

        A body that only one row moves can follow its other bodies, and is taken off; so are those
        that only one of the remaining rows moves. Where rows close a loop, these are gone through
        as listed, and back again.
        """
        left = {r: list(self.free(each.row)) for r, each in enumerate(self.rows)}
        last: list[tuple[int, str]] = []
        while ends := [
            (self.rows[r].row[body] not in UNITS, r, body)
            for r, bodies in left.items()
            for body in bodies
            if sum(body in others for others in left.values()) == 1
        ]:
            _, r, body = min(ends)
            last.insert(0, (r, body))
            del left[r]
        loops = [(r, self.dependent(self.rows[r].row)) for r in left]
        return [*loops, *reversed(loops[:-1]), *last]

    def dependent(self, row: Mapping[str, Value]) -> str:
        """Choose the body that follows the others: one with coefficient 1 or -1 if there is one."""
        free = self.free(row)
        return next((name for name, value in free.items() if value in UNITS), next(iter(free)))

    # ------------------------------------------------------------------ forces and impulses
    def flags(self, *, kept: bool = False) -> list[Line]:
        """Write which locks hold in the present modes; flags that are kept may be set already."""
        lines = []
        for r, each in enumerate(self.rows):
            bank = self.read.banks[each.bank]
            place, states = self.writer.mode(each.bank, "0"), self.writer.names.states[each.bank]
            locked = [states[state.name] for state in bank.chart.states if state.locked]
            text = " or ".join(f"{place} == {state}" for state in locked) or "False"
            other = f"l_{r}" if kept else "0.0"
            lines.append(Line(f"l_{r} = 1.0 if {text} else {other}"))
        return lines

    def forces(self) -> list[Line]:
        """Write the forces of locked contacts, and the accelerations with them."""
        names = {name: f"{name} a" for name in self.bodies}
        lines = self.flags()
        lines += self.solve({r: self.relative(each.row, names) for r, each in enumerate(self.rows)})
        for r, each in enumerate(self.rows):
            force = self.writer.local(self.read.banks[each.bank].forces[each.velocity])
            inside = [Line(f"{force} = {force} + hold_{r}")]
            for body, coefficient in self.free(each.row).items():
                a = self.writer.local(names[body])
                share = (
                    "" if coefficient == Number(1.0) else f"({self.writer.spell(coefficient)}) * "
                )
                inertia = self.inertia(body)
                reads = computed_names(coefficient) | computed_names(inertia)
                inside.append(
                    Line(f"{a} = {a} - {share}hold_{r} / ({self.writer.spell(inertia)})", reads)
                )
            lines += [Line(f"if l_{r} > 0.0:"), *indented(inside)]
        return lines + self.exact(names)

    def no_impulse(self) -> list[Line]:
        """Write that no velocity is to be set."""
        rows = range(len(self.rows))
        return [
            Line("hit = 0"),
            *(Line(f"{name}_{r} = 0.0") for r in rows for name in ("l", "goal")),
        ]

    def hit(self, bank: int, targets: Mapping[int, Line]) -> list[Line]:
        """Write that the next impulse sets velocities of a contact.

        Parameters
        ----------
        bank : int
            The contact.
        targets : mapping of int to Line
            By velocity, its new value.
        """
        lines = [Line("hit = 1")]
        for q, goal in targets.items():
            r = self.number(bank, q)
            lines += [Line(f"l_{r} = 1.0"), Line(f"goal_{r} = {goal.text}", goal.reads)]
        return lines

    def impulse(self) -> list[Line]:
        """Write the impulse that sets the velocities asked for and keeps those of held locks."""
        names = {name: self.velocity(body) for name, body in self.bodies.items()}
        rows = range(len(self.rows))
        lines = self.flags(kept=True)
        right: dict[int, Value] = {}
        for r, each in enumerate(self.rows):
            right[r] = Binary("-", self.relative(each.row, names), Name(f"goal_{r}"))
        lines += self.solve(right)
        moved: dict[str, None] = {}
        for r, each in enumerate(self.rows):
            inside = []
            for body, coefficient in self.free(each.row).items():
                v = self.writer.local(names[body])
                moved[body] = None
                share = (
                    "" if coefficient == Number(1.0) else f"({self.writer.spell(coefficient)}) * "
                )
                inertia = self.inertia(body)
                reads = computed_names(coefficient) | computed_names(inertia) | {names[body]}
                inside.append(
                    Line(f"{v} = {v} - {share}hold_{r} / ({self.writer.spell(inertia)})", reads)
                )
            lines += [Line(f"if l_{r} > 0.0:"), *indented(inside)]
        lines += self.exact(names, {r: f"goal_{r}" for r in rows})
        y = self.writer.layout.y
        lines += [
            Line(f"y[{y.text(names[body])}] = {self.writer.local(names[body])}") for body in moved
        ]
        return [Line("if hit == 1:"), *indented(lines)]

    @staticmethod
    def velocity(body: Body) -> str:
        """Return the name of a body's velocity."""
        return body.v
