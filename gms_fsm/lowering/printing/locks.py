"""Writes what holds locked contacts, and the impulses that set velocities.

A locked contact is a constraint: its relative velocity J w is 0, and its force F is what keeps it
so. With a the accelerations without the forces of locked contacts, these forces solve
(J M^-1 J') F = J a, here by an unrolled L D L' in which the row of an unlocked contact is that of
the identity; so there is one text for every combination. Entries that are zero by structure are
left out: for chains and trees of bodies the text, and the time it takes, is linear.

Where a lock would repeat those before it (its pivot is zero to rounding), the earlier contacts
carry the force and the later one none.

Velocities that locks determine are not integrated: within a step they are computed from the others,
and after it the state vector follows (`follow`). So are the accelerations; a stuck body is at rest
to the last bit.

An impulse is the same system with velocities on the right. A lock carries it unless a guard that
leaves its state would hold with the impulse as F, times a number without limit: stiction lets go
whatever its size, a stop lets go where it would have to pull.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Set
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from gms_fsm.language import Binary, Name, Negative, Number, Value, names_in, spell
from gms_fsm.lowering.printing.lines import CodeLine, ProgramWriter, indented, reads_of
from gms_fsm.lowering.printing.names import computed_names
from gms_fsm.lowering.printing.plan import times
from gms_fsm.systems.system import Body

# A pivot under this part of the diagonal is one that rounding has left of zero.
DEPENDENT = 1e-9
LAST_PLACES = 1e-15  # a difference of this part of what it is made from is rounding
# A velocity, or a jump of one, that counts as none: parts of the speeds of the bodies, of how far
# these come in all the time at their rates, and of their tolerances.
ROUNDING = 1e-12
UNFELT = 1e-3
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


class Elimination(NamedTuple):
    """How the equations of locks are solved as L D L'."""

    entries: Mapping[tuple[int, int], Value]  # of the matrix, by row and column, below or on D
    order: list[int]
    left: Mapping[int, list[int]]  # of each row the columns of L that are not zero, in order
    below: Mapping[int, list[int]]  # of each column the rows


class Locks:
    """Writes the equations of all locks of a system.

    Parameters
    ----------
    writer : ProgramWriter
        Of its program.
    """

    def __init__(self, writer: ProgramWriter) -> None:
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
    def solve(self, right: Mapping[int, Value]) -> list[CodeLine]:
        """Write the solution hold_r of the equations, with flags l_r and right sides."""
        put = self.writer.put
        entries, order, left, below = self.elimination
        lines: list[CodeLine] = []
        for s in order:
            diagonal = entries[s, s]
            lines.append(put(f"W_{s}", diagonal))
            less = "".join(f" - L_{s}_{k} * L_{s}_{k} * D_{k}" for k in left[s])
            lines += [
                CodeLine(f"D_{s} = W_{s}{less}"),
                CodeLine(f"if l_{s} == 0.0 or D_{s} <= {DEPENDENT} * W_{s}:"),
                CodeLine(f"    l_{s} = 0.0"),
                CodeLine(f"    D_{s} = 1.0"),
            ]
            for r in below[s]:
                entry = entries.get((max(r, s), min(r, s)))
                text = "0.0" if entry is None else self.writer.spell(entry)
                reads = frozenset() if entry is None else computed_names(entry)
                both = [k for k in left[r] if k in left[s]]
                less = "".join(f" - L_{r}_{k} * L_{s}_{k} * D_{k}" for k in both)
                lines.append(CodeLine(f"L_{r}_{s} = l_{r} * l_{s} * ({text}{less}) / D_{s}", reads))
        for r in order:
            value = right[r]
            less = "".join(f" - L_{r}_{k} * w_{k}" for k in left[r])
            lines.append(
                CodeLine(
                    f"w_{r} = l_{r} * ({self.writer.spell(value)}{less})", computed_names(value)
                )
            )
        for r in reversed(order):
            less = "".join(f" - L_{k}_{r} * hold_{k}" for k in below[r])
            lines.append(CodeLine(f"hold_{r} = w_{r} / D_{r}{less}"))
        return lines

    @cached_property
    def elimination(self) -> Elimination:
        """The equations' entries, the order of elimination, and what it fills in."""
        rows = range(len(self.rows))
        sharing: dict[str, list[int]] = {}  # the rows that a body is in
        for r in rows:
            for name in self.rows[r].row:
                sharing.setdefault(name, []).append(r)
        near = {(r, s) for found in sharing.values() for r in found for s in found if s <= r}
        entries = {
            (r, s): value
            for r, s in sorted(near)
            if (value := self.weight(self.rows[r], self.rows[s])) is not None
        }
        order = self.order({key for key in entries if key[0] != key[1]})
        place = {r: k for k, r in enumerate(order)}
        # Which entries of L are not zero: those of the matrix, and what elimination fills in.
        below: dict[int, set[int]] = {r: set() for r in order}
        for r, s in entries:
            if r != s:
                first, then = sorted((r, s), key=place.__getitem__)
                below[first].add(then)
        for k in order:
            for s in below[k]:
                below[s] |= {r for r in below[k] if place[r] > place[s]}
        left = {r: [k for k in order if r in below[k]] for r in order}
        return Elimination(
            entries, order, left, {r: sorted(below[r], key=place.__getitem__) for r in order}
        )

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
    ) -> list[CodeLine]:
        """Set the dependent accelerations, or velocities, exactly."""
        loops, leaves = self.sequence()
        goals = target or {}
        lines = self.eliminated(loops, name_of, goals)
        for r, body in leaves:
            row = self.rows[r].row
            text, reads = self.rest(r, {body}, name_of, goals)
            coefficient = row[body]
            if coefficient != Number(1.0):
                spelled = self.writer.spell(coefficient)
                text = f"({text}) / ({spelled})"
                reads |= computed_names(coefficient)
            local = self.writer.local(name_of[body])
            lines += [CodeLine(f"if l_{r} > 0.0:"), CodeLine(f"    {local} = {text}", reads)]
        return lines

    def rest(
        self, r: int, without: Set[str], name_of: Mapping[str, str], goals: Mapping[int, str]
    ) -> tuple[str, frozenset[str]]:
        """Spell what a row leaves for some of its bodies."""
        goal = goals.get(r, "0.0")
        others = {name: value for name, value in self.rows[r].row.items() if name not in without}
        if not others:
            return goal, frozenset()
        tree = self.relative(others, name_of)
        spelled = self.writer.spell(tree)
        text = f"-({spelled})" if goal == "0.0" else f"{goal} - ({spelled})"
        return text, computed_names(tree)

    def eliminated(
        self, loops: list[int], name_of: Mapping[str, str], goals: Mapping[int, str]
    ) -> list[CodeLine]:
        """Set what rows determine that close loops: by Gauss and Jordan, the largest one first.

        The rows that hold are known only while it runs, so each has its pivot q found there.
        """
        bodies = [*dict.fromkeys(body for r in loops for body in self.free(self.rows[r].row))]
        lines, put = list[CodeLine](), self.writer.put
        columns: dict[int, list[int]] = {}  # of each row, where it may have entries

        def at_pivot(r: int, s: int) -> list[CodeLine]:
            """Set u to the entry of row r in the pivot column of row s."""
            first, *others = columns[s]
            return [
                CodeLine(f"u = e_{r}_{first}"),
                *(CodeLine(f"u = e_{r}_{j} if q_{s} == {j} else u") for j in others),
            ]

        def less(r: int, s: int) -> list[CodeLine]:
            """Subtract row s from row r; as a pivot is 1, what remains in its column is 0."""
            if not {*columns[r]} & {*columns[s]}:
                return []
            more = [j for j in columns[s] if j not in columns[r]]
            columns[r] = sorted(columns[r] + more)
            inside = at_pivot(r, s)
            inside += [CodeLine(f"e_{r}_{j} = e_{r}_{j} - u * e_{s}_{j}") for j in columns[s]]
            inside += [CodeLine(f"g_{r} = g_{r} - u * g_{s}")]
            filled = [CodeLine(f"e_{r}_{j} = 0.0") for j in more]
            return [*filled, CodeLine(f"if q_{s} >= 0:"), *indented(inside)]

        for k, r in enumerate(loops):
            free = self.free(self.rows[r].row)
            columns[r] = [j for j, body in enumerate(bodies) if body in free]
            lines += [put(f"e_{r}_{j}", free[bodies[j]]) for j in columns[r]]
            text, reads = self.rest(r, free.keys(), name_of, goals)
            size = " + ".join(f"abs(e_{r}_{j})" for j in columns[r])
            lines += [
                CodeLine(f"g_{r} = {text}", reads),
                CodeLine(f"best = {DEPENDENT} * ({size})"),
            ]
            for s in loops[:k]:
                lines += less(r, s)
            lines.append(CodeLine(f"q_{r} = -1"))
            for j in columns[r]:
                lines += [
                    CodeLine(f"if l_{r} > 0.0 and abs(e_{r}_{j}) > best:"),
                    CodeLine(f"    best = abs(e_{r}_{j})"),
                    CodeLine(f"    q_{r} = {j}"),
                ]
            inside = [*at_pivot(r, r), CodeLine(f"g_{r} = g_{r} / u")]
            inside += [CodeLine(f"e_{r}_{j} = e_{r}_{j} / u") for j in columns[r]]
            lines += [CodeLine(f"if q_{r} >= 0:"), *indented(inside)]
            for s in loops[:k]:
                lines += less(s, r)
        for r in loops:
            names = {j: name_of[bodies[j]] for j in columns[r]}
            for j, name in names.items():
                terms = [
                    f" - e_{r}_{i} * {self.writer.local(other)}"
                    for i, other in names.items()
                    if i != j
                ]
                text = f"{self.writer.local(name)} = g_{r}{''.join(terms)}"
                inside = [CodeLine(text, frozenset(names.values()))]
                lines += [CodeLine(f"if q_{r} == {j}:"), *indented(inside)]
        return lines

    def sequence(self) -> tuple[list[int], list[tuple[int, str]]]:
        """Return the rows that close loops, then the others with the body that each sets.

        A body that only one row moves can follow its other bodies, and is taken off; so are those
        that only one of the remaining rows moves. In the order returned, what a row reads was set
        before.
        """
        left = {r: list(self.free(each.row)) for r, each in enumerate(self.rows)}
        leaves: list[tuple[int, str]] = []
        moved = Counter(body for bodies in left.values() for body in bodies)
        while ends := [
            (self.rows[r].row[body] not in UNITS, r, body)
            for r, bodies in left.items()
            for body in bodies
            if moved[body] == 1
        ]:
            _, r, body = min(ends)
            leaves.insert(0, (r, body))
            moved.subtract(left.pop(r))
        return [*left], leaves

    def followers(self) -> list[str]:
        """Return the bodies whose velocities locks may determine."""
        loops, leaves = self.sequence()
        found = [body for r in loops for body in self.free(self.rows[r].row)]
        return [*dict.fromkeys([*found, *(body for _, body in leaves)])]

    # ------------------------------------------------------------------ forces and impulses
    def locking(self, r: int) -> str:
        """Spell whether the present mode locks a row."""
        bank = self.read.banks[self.rows[r].bank]
        place, states = self.writer.mode(bank.index, "0"), self.writer.names.states[bank.index]
        return " or ".join(f"{place} == {states[each]}" for each in bank.locked) or "False"

    def flags(self) -> list[CodeLine]:
        """Write which locks hold in the present modes."""
        rows = range(len(self.rows))
        return [CodeLine(f"l_{r} = 1.0 if {self.locking(r)} else 0.0") for r in rows]

    def speed(self, body: str, coefficient: Value) -> str:
        """Spell the size of a term of a relative velocity."""
        size = f"abs({self.writer.local(self.velocity(self.bodies[body]))})"
        if coefficient in UNITS:
            return size
        return f"abs({self.writer.spell(coefficient)}) * {size}"

    def rounded(self, name: str, row: Mapping[str, Value]) -> list[CodeLine]:
        """Write that a relative velocity is zero if it is so but for rounding."""
        local = self.writer.local(name)
        size = " + ".join(self.speed(body, coefficient) for body, coefficient in row.items())
        reads = frozenset(self.velocity(self.bodies[body]) for body in row)
        reads = reads.union(*(computed_names(coefficient) for coefficient in row.values()))
        return [
            CodeLine(f"if abs({local}) <= {LAST_PLACES} * ({size}):", reads),
            CodeLine(f"    {local} = 0.0"),
        ]

    def following(self) -> list[CodeLine]:
        """Write the velocities that locks determine."""
        names = {name: self.velocity(body) for name, body in self.bodies.items()}
        return [*self.flags(), *self.exact(names)]

    def forces(self) -> list[CodeLine]:
        """Write the forces of locked contacts, and the accelerations with them."""
        names = {name: f"{name} a" for name in self.bodies}
        lines = self.flags()
        lines += self.solve({r: self.relative(each.row, names) for r, each in enumerate(self.rows)})
        for r, each in enumerate(self.rows):
            force = self.writer.local(self.read.banks[each.bank].forces[each.velocity])
            inside = [CodeLine(f"{force} = {force} + hold_{r}"), *self.shares(r, names)]
            lines += [CodeLine(f"if l_{r} > 0.0:"), *indented(inside)]
        return [*lines, *self.exact(names), *self.contradicted(names)]

    def contradicted(self, names: Mapping[str, str]) -> list[CodeLine]:
        """Write that no force holds a contact where other locks, or what is driven, move it."""
        lines: list[CodeLine] = []
        # A row that closes no loop is independent of the others, whichever of them hold.
        doubtful = {*self.sequence()[0]} if self.joins_trees() else {*range(len(self.rows))}
        for r, each in enumerate(self.rows):
            bank = self.read.banks[each.bank]
            if not bank.locked or r not in doubtful:
                continue
            tree = self.relative(each.row, names)
            size = " + ".join(
                f"abs({self.writer.spell(times(coefficient, Name(names[body])))})"
                for body, coefficient in each.row.items()
            )
            force = self.writer.local(bank.forces[each.velocity])
            reads = computed_names(tree)
            lines += [
                CodeLine(f"if l_{r} == 0.0 and ({self.locking(r)}):"),
                CodeLine(f"    u = {self.writer.spell(tree)}", reads),
                CodeLine(f"    if abs(u) > {DEPENDENT} * ({size}):", reads),
                CodeLine(f"        {force} = {force} + u * ENDLESS"),
            ]
        return lines

    def shares(self, r: int, names: Mapping[str, str]) -> list[CodeLine]:
        """Write what the force, or impulse, of a row does to the bodies."""
        lines = []
        for body, coefficient in self.free(self.rows[r].row).items():
            local, inertia = self.writer.local(names[body]), self.inertia(body)
            share = "" if coefficient == Number(1.0) else f"({self.writer.spell(coefficient)}) * "
            text = f"{local} = {local} - {share}hold_{r} / ({self.writer.spell(inertia)})"
            own = frozenset() if names[body].endswith(" a") else frozenset({names[body]})
            lines.append(
                CodeLine(text, computed_names(coefficient) | computed_names(inertia) | own)
            )
        return lines

    # ------------------------------------------------------------------ impulses
    def no_impulse(self) -> list[CodeLine]:
        """Write that no velocity is to be set."""
        rows = range(len(self.rows))
        return [
            CodeLine("hit = 0"),
            *(CodeLine(f"{name}_{r} = 0.0") for r in rows for name in ("goal", "set")),
        ]

    def hit(self, bank: int, targets: Mapping[int, CodeLine], *, impulse: bool) -> list[CodeLine]:
        """Write that velocities of a contact are set next."""
        lines = [CodeLine(f"hit = {2 if impulse else 1}")]
        for q, goal in targets.items():
            r = self.number(bank, q)
            lines += [CodeLine(f"set_{r} = 1.0"), CodeLine(f"goal_{r} = {goal.text}", goal.reads)]
        return lines

    def impulse(self) -> list[CodeLine]:
        """Write the impulse that sets the velocities asked for and keeps those of held locks."""
        names = {name: self.velocity(body) for name, body in self.bodies.items()}
        rows = range(len(self.rows))
        keep = [CodeLine(f"keep_{r} = 1.0 if {self.locking(r)} else set_{r}") for r in rows]
        right: dict[int, Value] = {}
        for r, each in enumerate(self.rows):
            right[r] = Binary("-", self.relative(each.row, names), Name(f"goal_{r}"))
        solved = [*(CodeLine(f"l_{r} = keep_{r}") for r in rows), *self.solve(right)]
        read, letting = self.letting()
        if letting:
            inside = [CodeLine("again = 0"), *solved]
            solved = [
                *read,
                CodeLine("again = 1"),
                CodeLine("while again == 1:"),
                *indented(inside + letting),
            ]
        lines = [*keep, *solved]
        moved: dict[str, None] = {}
        for r, each in enumerate(self.rows):
            moved |= dict.fromkeys(self.free(each.row))
            lines += [CodeLine(f"if l_{r} > 0.0:"), *indented(self.shares(r, names))]
        lines += self.exact(names, {r: f"goal_{r}" for r in rows})
        y = self.writer.layout.y
        lines += [
            CodeLine(f"y[{y.text(names[body])}] = {self.writer.local(names[body])}")
            for body in moved
        ]
        return [CodeLine("if hit > 0:"), *indented(lines)]

    def letting(self) -> tuple[list[CodeLine], list[CodeLine]]:
        """Write which lock lets go instead of carrying the impulse: the first one that does.

        Before it stands what the guards read of the only element of a contact that locks.
        """
        lines: list[CodeLine] = []
        first_read: list[CodeLine] = []
        for bank in self.read.banks:
            begun = len(lines)
            first = [r for r, each in enumerate(self.rows) if each.bank == bank.index]
            place = self.writer.mode(bank.index, "0")
            for edge in bank.edges:
                if edge.source not in bank.locked or not names_in(edge.guard) & {*bank.forces}:
                    continue
                pushed = {
                    force: f"(hold_{r} * ENDLESS)"
                    for force, r in zip(bank.forces, first, strict=True)
                }
                guard = spell(edge.guard, rename=dict(self.writer.names.texts) | pushed)
                state = self.writer.names.states[bank.index][edge.source]
                none_yet = "again == 0 and " if lines else ""  # not elif: hundreds nest too deep
                free = f"hit == 2 and keep_{first[0]} > 0.0 and set_{first[0]} == 0.0"
                reads = computed_names(edge.guard) - {*bank.forces}
                lines.append(
                    CodeLine(f"if {none_yet}{free} and {place} == {state} and ({guard}):", reads)
                )
                lines += [CodeLine(f"    keep_{r} = 0.0") for r in first]
                lines.append(CodeLine("    again = 1"))
            reads = reads_of(lines[begun:])
            lines[begun:] = self.writer.outward(bank.index, lines[begun:])
            if any(self.read.owner.get(name) == bank.index for name in reads):
                own = self.writer.element(bank.index, self.writer.own(bank.index, reads), "live")
                index = [CodeLine("i = 0")] if len(self.read.banks) > 1 else []
                first_read += [*index, *self.writer.outward(bank.index, own)]
        return first_read, lines

    def jolts(self) -> list[CodeLine]:
        """Write which contacts have been moved by more than the motion itself moves them."""
        lines: list[CodeLine] = []
        for bank in self.read.banks:
            first = [r for r, each in enumerate(self.rows) if each.bank == bank.index]
            if not bank.locked:
                continue
            lines += [CodeLine("moved = 0"), CodeLine("moves = 0")]
            for r in first:
                row = self.rows[r].row
                v = bank.velocities[self.rows[r].velocity]
                lines.append(CodeLine("reach = 0.0"))
                for body, coefficient in row.items():
                    name = self.velocity(self.bodies[body])
                    size = f"{ROUNDING} * abs({self.writer.local(name)})"
                    if self.bodies[body].driven:  # a crossing is located a few clock ticks late
                        a = self.writer.local(f"{body} a")
                        size = f"({size} + {ROUNDING} * abs({a} * t))"
                    else:
                        place = self.writer.layout.y.text(name)
                        size = f"({size} + {UNFELT} * least[{place}])"
                    if coefficient != Number(1.0):
                        size = f"abs({self.writer.spell(coefficient)}) * {size}"
                    reads = computed_names(coefficient) | {name}
                    lines.append(CodeLine(f"reach = reach + {size}", reads))
                local = self.writer.local(v)
                lines += [
                    CodeLine(f"if abs({local} - was[{r}]) > reach:", frozenset({v})),
                    CodeLine("    moved = 1"),
                    CodeLine(f"if abs({local}) > reach:"),
                    CodeLine("    moves = 1"),
                    CodeLine(f"was[{r}] = {local}"),
                ]
            jolt = f"jolt[{self.writer.machine(bank.index, '0')}]"
            lines += [
                CodeLine("if mark > 0:"),
                CodeLine(f"    if {self.locking(first[0])}:"),
                CodeLine(f"        {jolt} = LET_GO * moves"),
                CodeLine("    elif moved + moves == 2:"),
                CodeLine(f"        {jolt} = JUMPED"),
            ]
        return lines

    @staticmethod
    def velocity(body: Body) -> str:
        """Return the name of a body's velocity."""
        return body.v
