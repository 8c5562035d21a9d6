"""Writes the rates and the forces of contacts, and the accelerations of bodies."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Literal, TypeAlias

from gms_fsm.language import Name, Value, names_in
from gms_fsm.lowering.places import Places
from gms_fsm.lowering.printing.lines import TABLES, CodeLine, ProgramWriter, Signs
from gms_fsm.lowering.printing.locks import Locks
from gms_fsm.lowering.printing.names import computed_names
from gms_fsm.lowering.printing.plan import BankPlan, Computed, Gradient, ProgramPlan, gradient_of
from gms_fsm.systems.reading.assembly import Bank, of
from gms_fsm.systems.reading.order import is_deferred, order_of

Part: TypeAlias = Literal["all", "outputs", "rates"]  # of what a machine gives out


class ForceWriter(ProgramWriter):
    """Writes what contacts give out.

    Parameters
    ----------
    plan : ProgramPlan
        Of the program.
    """

    def __init__(self, plan: ProgramPlan) -> None:
        super().__init__(plan)
        self.locks = Locks(self)
        self.locking = any(bank.chart.locks for bank in self.read.banks)

    def followed(self) -> list[CodeLine]:
        """Write the velocities that locks determine."""
        return self.locks.following() if self.locking else []

    def rounded(self, name: str) -> list[CodeLine]:
        """Write that the velocity of a contact is zero where locks leave only rounding of it."""
        rows = self.rows
        return self.locks.rounded(name, rows[name]) if self.locking and name in rows else []

    @cached_property
    def rows(self) -> Mapping[str, Mapping[str, Value]]:
        """The coefficients of each contact's velocity, by body."""
        return {
            velocity: row
            for bank in self.read.banks
            for velocity, row in zip(bank.velocities, bank.jacobian, strict=True)
        }

    def forces(
        self, signs: Signs, *, wanted: bool, rates: bool = False, observed: bool = False
    ) -> list[CodeLine]:
        """Write the rates and the forces of all contacts, and the accelerations."""
        lines: list[CodeLine] = []
        made: set[str] = set()
        for bank in order_of(self.read):
            lines += self.late_definitions(made, signs) if wanted else []
            plan = self.plan.banks[bank.index]
            # Rates that read what machines give out are computed after all of it.
            part: Part = "outputs" if is_deferred(self.read, bank) else "all"
            lines += self.bank_forces(
                plan, signs, wanted, rates=rates, observed=observed, part=part
            )
            made |= {*bank.forces}
        lines += self.late_definitions(made, signs) if wanted else []
        for bank in self.read.banks if rates or observed else ():
            if is_deferred(self.read, bank):
                plan = self.plan.banks[bank.index]
                lines += self.bank_forces(
                    plan, signs, wanted, rates=rates, observed=observed, part="rates"
                )
        if wanted and (rates or self.locking):
            for body in self.read.free:
                value = self.plan.accelerations[body.name]
                if self.locking:
                    lines += self.computed(self.local(f"{body.name} a"), value, signs)
        if wanted and self.locking:
            lines += self.driven_accelerations()
            lines += self.locks.forces()
        return lines

    def late_definitions(self, made: set[str], signs: Signs) -> list[CodeLine]:
        """Write what is computed from what machines give out, as far as that is known."""
        lines: list[CodeLine] = []
        for name, needs in self.late_needs.items():
            if name not in made and needs <= made:
                lines += self.defined(name, signs)
                made.add(name)
        return lines

    @cached_property
    def late_needs(self) -> Mapping[str, frozenset[str]]:
        """By name what is known late among what its definition follows from."""
        names = [each.name for each in self.read.definitions if each.name in self.late]
        return {name: (self.read.closure([name]) & self.late) - {name} for name in names}

    def bank_forces(
        self,
        plan: BankPlan,
        signs: Signs,
        wanted: bool,
        *,
        rates: bool = False,
        observed: bool = False,
        held: bool = False,
        part: Part = "all",
    ) -> list[CodeLine]:
        """Write the loop over the elements of a contact, and its force; `held` stores both."""
        bank, y = plan.bank, self.layout.y
        if bank.periodic and not held:
            return self.held_forces(bank, wanted, rates=rates, observed=observed)
        forces = wanted and (plan.moves or observed or not rates or self.locking)
        forces, later = forces and part != "rates", part == "outputs"
        used = {name for tree in plan.common.values() for name in names_in(tree)} | {
            name
            for each in plan.states
            for value in each.forces.values()
            for name in self.names_of(value)
        }
        needed = {
            name
            for name in bank.variables
            if ((rates or observed or held) and not later) or (forces and bank.rate(name) in used)
        }
        # Only a contact with several velocities has several forces.
        several = {force: f"F_i{'' if q == 0 else f'_{q}'}" for q, force in enumerate(bank.forces)}
        branches: dict[str, list[CodeLine]] = {}
        for each in plan.states:
            branch: list[CodeLine] = []
            for name in bank.variables:
                if name in needed:
                    branch += self.computed(self.local(bank.rate(name)), each.rates[name], signs)
            for force in bank.forces if forces else ():
                if force in plan.common:
                    continue
                if each.locked:
                    branch.append(CodeLine(f"{several[force]} = 0.0"))
                else:
                    branch += self.computed(several[force], each.forces[force], signs, "  # (3)")
            branches[each.state] = branch
        after = self.summed(plan, several, stored=observed or held) if forces else []
        if observed and part != "rates":
            after += self.elements_seen(plan, several)
        places: list[tuple[str, Places[str], Callable[[str], str]]] = []
        if not later:
            places += [("out", self.layout.observed, bank.rate)] * observed
            places += [("dy", y, str)] * rates
        if held:
            places.append(("y", y, lambda v: bank.held(bank.rate(v))))
        for array, layout, place in places:
            after += [
                self.store(array, layout, place(v), self.local(bank.rate(v)))
                for v in bank.variables
            ]
        if held:
            after += [
                self.store("y", y, bank.held(f"{force}_elements"), several[force])
                for force in bank.forces
            ]
        lines = [CodeLine(f"{self.local(force)} = 0.0") for force in bank.forces if forces]
        lines += self.loop(bank.index, signs, (), branches, after)
        for force, value in plan.totals.items() if forces else ():
            lines += self.computed(self.local(force), value, signs, "  # (4)")
        if held:
            lines += [
                CodeLine(f"y[{y.text(bank.held(force))}] = {self.local(force)}")
                for force in bank.forces
            ]
        return lines

    def summed(self, plan: BankPlan, several: Mapping[str, str], *, stored: bool) -> list[CodeLine]:
        """Add what an element gives out to what its machine does."""
        lines: list[CodeLine] = []
        for force in plan.bank.forces:
            total, tree = self.local(force), plan.common.get(force)
            if tree is None:
                lines.append(CodeLine(f"{total} += {several[force]}"))
            elif stored:
                lines.append(self.put(several[force], tree, "  # (3)"))
                lines.append(CodeLine(f"{total} += {several[force]}"))
            else:
                text = f"{total} += {self.spell(tree)}  # (3)"
                lines.append(CodeLine(text, computed_names(tree)))
        return lines

    def held_forces(
        self, bank: Bank, wanted: bool, *, rates: bool, observed: bool
    ) -> list[CodeLine]:
        """Write the force of a contact with a period, and its rates: what is held of them."""
        y, seen, lines = self.layout.y, self.layout.observed, list[CodeLine]()
        for force in bank.forces if wanted else ():
            held = bank.held(force)
            lines.append(CodeLine(f"{self.local(force)} = {self.local(held)}", frozenset({held})))
            if rates:
                lines.append(CodeLine(f"dy[{y.text(held)}] = 0.0"))
        after: list[CodeLine] = []
        pairs = [(bank.rate(v), bank.held(bank.rate(v))) for v in bank.variables]
        for v, (rate, held) in zip(bank.variables, pairs, strict=True):
            place, sizes = self.at("y", y, held)
            if rates:
                line = self.store("dy", y, v, place)
                after += [CodeLine(line.text, line.reads | sizes), self.store("dy", y, held, "0.0")]
            if observed:
                line = self.store("out", seen, rate, place)
                after.append(CodeLine(line.text, line.reads | sizes))
        for force in bank.forces:
            held = bank.held(f"{force}_elements")
            place, sizes = self.at("y", y, held)
            if rates:
                after.append(self.store("dy", y, held, "0.0"))
            if observed:
                line = self.store("out", seen, f"{force}_elements", place)
                after.append(CodeLine(line.text, line.reads | sizes))
        if observed:
            after.append(self.threshold_seen(bank))
        return [*lines, *self.loop(bank.index, "live", (), None, after)]

    @staticmethod
    def names_of(value: Computed) -> frozenset[str]:
        """Return what a computed value reads, in its rough calls too."""
        found = computed_names(value.tree)
        return found.union(*(computed_names(call.call) for call in value.calls))

    def elements_seen(self, plan: BankPlan, several: Mapping[str, str]) -> list[CodeLine]:
        """Store what is observed of an element."""
        bank, seen = plan.bank, self.layout.observed
        lines = [self.threshold_seen(bank)]
        return lines + [
            self.store("out", seen, f"{force}_elements", several[force]) for force in bank.forces
        ]

    def threshold_seen(self, bank: Bank) -> CodeLine:
        """Store the threshold of an element: that of its model, or what s means in its chart."""
        seen, s = self.layout.observed, of(bank.name, "s")
        means = Name(bank.threshold) if bank.threshold else bank.means.get("s")
        if means is None:
            return self.store("out", seen, s, "nan")
        place, sizes = self.at("out", seen, s)
        line = self.put(place, means)
        return CodeLine(line.text, line.reads | sizes)

    def driven_accelerations(self) -> list[CodeLine]:
        """Write the accelerations of driven bodies that locks refer to."""
        wanted = {name for row in self.locks.rows for name in row.row}
        lines = []
        for body in self.read.system.bodies:
            if body.driven and body.name in wanted:
                lines.append(self.rate_in_time(self.local(f"{body.name} a"), body.v))
        return lines

    def rate_in_time(self, target: str, name: str) -> CodeLine:
        """Write the rate of a quantity that depends on time only."""
        gradient = gradient_of(Name(name), self.read)
        terms, reads = self.time_terms(gradient)
        return CodeLine(f"{target} = {' + '.join(terms) or '0.0'}", reads)

    def before_guards(self, names: Iterable[frozenset[str]]) -> list[CodeLine]:
        """Write the forces, and the accelerations, where guards or actions read them."""
        read = frozenset[str]().union(*names)
        if not read & self.late:
            return []
        lines = self.forces("live", wanted=True)
        for force in (force for bank in self.read.banks for force in bank.forces if force in read):
            # With an infinite force no guard is decided: NaN ends the run where it is watched.
            F = self.local(force)
            lines.append(CodeLine(f"{F} = {F} - ({F} - {F})  # NaN if infinite"))
        rates = {name for bank in self.read.banks for name in bank.rates}
        if read & rates:
            if not self.locking:
                for body in self.read.free:
                    value = self.plan.accelerations[body.name]
                    lines += self.computed(self.local(f"{body.name} a"), value, "live")
                for body in self.read.system.bodies:
                    if body.driven:
                        lines.append(self.rate_in_time(self.local(f"{body.name} a"), body.v))
            wanted = [
                (name, row)
                for bank in self.read.banks
                for name, row in zip(bank.rates, bank.jacobian, strict=True)
                if name in read
            ]
            for name, row in wanted:
                tree = self.locks.relative(row, {each: f"{each} a" for each in row})
                lines.append(self.put(self.local(name), tree))
        return lines

    def time_terms(self, gradient: Gradient) -> tuple[list[str], frozenset[str]]:
        """Spell the terms of a rate in time, and say what they read."""
        terms, reads = [], frozenset[str]()
        if gradient.by_t is not None:
            terms.append(self.spell(gradient.by_t))
            reads |= computed_names(gradient.by_t)
        for name, value in gradient.by_signal.items():
            terms.append(f"({self.spell(value)}) * piecewise_slope(t, {self.table(name)})")
            reads |= computed_names(value) | {TABLES}
        return terms, reads
