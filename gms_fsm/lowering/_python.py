"""Prints the plan of a program as Python text: if-else that one can read and step through."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from gms_fsm.language import (
    Comparison,
    Name,
    Negative,
    Number,
    Requirement,
    Split,
    Value,
    names_in,
    split,
)
from gms_fsm.lowering._lines import TABLES, Line, Signs, Writer, indented, reads_of
from gms_fsm.lowering._locks import Locks
from gms_fsm.lowering._names import computed_names
from gms_fsm.lowering._plan import BankPlan, Computed, Gradient, Plan, both_sides, gradient_of
from gms_fsm.systems._assembly import Bank, Edge, of
from integrators import LIVE

__all__ = ["FUNCTIONS", "python"]

FUNCTIONS = (
    "flow",
    "flow_live",
    "switch",
    "act",
    "observe",
    "normal",
    "arm",
    "margins",
    "values",
    "tick",
)


def python(plan: Plan) -> str:
    """Return a program as Python text.

    Parameters
    ----------
    plan : Plan
        Of the program.

    Returns
    -------
    str
        The constants for states and edges, then the functions named in `FUNCTIONS`.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> from gms_fsm.systems._assembly import assembled
    >>> from gms_fsm.lowering._plan import plan_of
    >>> from gms_fsm.systems.system import system_of
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> plan = plan_of(assembled(system_of(model, Prescribed("0.1*t"))))
    >>> print(python(plan).splitlines()[3])
    STICK, SLIP = 0, 1  # states
    """
    printer = _Printer(plan)
    lines = [
        f"# {_one_line(plan.title)}",
        "# Generated from the chart; parameters are arguments, so one text serves all values.",
        "",
    ]
    for bank, states in zip(plan.banks, plan.names.states, strict=True):
        whose = "" if len(plan.banks) == 1 else f" of {bank.bank.name}"
        lines.append(f"{_numbered(states.values())}  # states{whose}")
    if any(plan.names.edges):
        lines.append(f"{_numbered(edge for each in plan.names.edges for edge in each)}  # edges")
    for function in (
        printer.switch(),
        printer.act(),
        printer.flow("held"),
        printer.flow("live"),
        printer.observe(),
        printer.normal(),
        printer.arm(),
        printer.margins(),
        printer.values(),
        printer.tick(),
    ):
        lines += ["", "", *function]
    return "\n".join(lines) + "\n"


class _Printer(Writer):
    """Prints the functions of a plan."""

    def __init__(self, plan: Plan) -> None:
        super().__init__(plan)
        self.locks = Locks(self)
        self.locking = any(bank.chart.locks for bank in self.read.banks)

    # ------------------------------------------------------------------ forces
    def forces(
        self, signs: Signs, *, wanted: bool, rates: bool = False, observed: bool = False
    ) -> list[Line]:
        """Write the rates and the forces of all contacts, and the accelerations.

        Parameters
        ----------
        signs : {"held", "live", "given"}
            Where signs come from.
        wanted : bool
            Whether forces are wanted at all.
        rates : bool
            Store the rates into dy.
        observed : bool
            Store what is observed of the elements into out.
        """
        lines: list[Line] = []
        for bank in self.plan.banks:
            lines += self.bank_forces(bank, signs, wanted, rates=rates, observed=observed)
        if wanted and (rates or self.locking):
            for body in self.read.free:
                value = self.plan.accelerations[body.name]
                if self.locking:
                    lines += self.computed(self.local(f"{body.name} a"), value, signs)
        if wanted and self.locking:
            lines += self.driven_accelerations()
            lines += self.locks.forces()
        return lines

    def bank_forces(
        self,
        plan: BankPlan,
        signs: Signs,
        wanted: bool,
        *,
        rates: bool = False,
        observed: bool = False,
        held: bool = False,
    ) -> list[Line]:
        """Write the loop over the elements of a contact, and its force; `held` stores both."""
        bank, y = plan.bank, self.layout.y
        if bank.periodic and not held:
            return self.held_forces(bank, wanted, rates=rates, observed=observed)
        forces = wanted and (plan.moves or observed or not rates or self.locking)
        used = {name for tree in plan.common.values() for name in names_in(tree)} | {
            name
            for each in plan.states
            for value in each.forces.values()
            for name in self.names_of(value)
        }
        needed = {
            name
            for name in bank.variables
            if rates or observed or held or (forces and bank.rate(name) in used)
        }
        # Only a contact with several velocities has several forces.
        several = {force: f"F_i{'' if q == 0 else f'_{q}'}" for q, force in enumerate(bank.forces)}
        branches: dict[str, list[Line]] = {}
        for each in plan.states:
            branch: list[Line] = []
            for name in bank.variables:
                if name in needed:
                    branch += self.computed(self.local(bank.rate(name)), each.rates[name], signs)
            for force in bank.forces if forces else ():
                if force in plan.common:
                    continue
                if each.locked:
                    branch.append(Line(f"{several[force]} = 0.0"))
                else:
                    branch += self.computed(several[force], each.forces[force], signs, "  # (3)")
            branches[each.state] = branch
        after: list[Line] = []
        for force in bank.forces if forces else ():
            total = self.local(force)
            if force not in plan.common:
                after.append(Line(f"{total} += {several[force]}"))
            elif observed or held:
                after.append(self.put(several[force], plan.common[force], "  # (3)"))
                after.append(Line(f"{total} += {several[force]}"))
            else:
                tree = plan.common[force]
                after.append(Line(f"{total} += {self.spell(tree)}  # (3)", computed_names(tree)))
        if observed:
            after += self.elements_seen(plan, several)
        if rates:
            after += [self.store("dy", y, v, self.local(bank.rate(v))) for v in bank.variables]
        if held:
            after += [
                self.store("y", y, bank.held(bank.rate(v)), self.local(bank.rate(v)))
                for v in bank.variables
            ]
            after += [
                self.store("y", y, bank.held(f"{force}_elements"), several[force])
                for force in bank.forces
            ]
        lines = [Line(f"{self.local(force)} = 0.0") for force in bank.forces if forces]
        lines += self.loop(bank.index, signs, (), branches, after)
        for force, value in plan.totals.items() if forces else ():
            lines += self.computed(self.local(force), value, signs, "  # (4)")
        if held:
            lines += [
                Line(f"y[{y.text(bank.held(force))}] = {self.local(force)}")
                for force in bank.forces
            ]
        return lines

    def held_forces(self, bank: Bank, wanted: bool, *, rates: bool, observed: bool) -> list[Line]:
        """Write the force of a contact with a period, and its rates: what is held of them."""
        y, seen, lines = self.layout.y, self.layout.observed, list[Line]()
        for force in bank.forces if wanted else ():
            held = bank.held(force)
            lines.append(Line(f"{self.local(force)} = {self.local(held)}", frozenset({held})))
            if rates:
                lines.append(Line(f"dy[{y.text(held)}] = 0.0"))
        after: list[Line] = []
        pairs = [(bank.rate(v), bank.held(bank.rate(v))) for v in bank.variables]
        for v, (rate, held) in zip(bank.variables, pairs, strict=True):
            place, sizes = self.at("y", y, held)
            if rates:
                line = self.store("dy", y, v, place)
                after += [Line(line.text, line.reads | sizes), self.store("dy", y, held, "0.0")]
            if observed:
                line = self.store("out", seen, rate, place)
                after.append(Line(line.text, line.reads | sizes))
        for force in bank.forces:
            held = bank.held(f"{force}_elements")
            place, sizes = self.at("y", y, held)
            if rates:
                after.append(self.store("dy", y, held, "0.0"))
            if observed:
                line = self.store("out", seen, f"{force}_elements", place)
                after.append(Line(line.text, line.reads | sizes))
        if observed:
            after.append(self.threshold_seen(bank))
        return [*lines, *self.loop(bank.index, "live", (), None, after)]

    @staticmethod
    def names_of(value: Computed) -> frozenset[str]:
        """Return what a computed value reads, in its rough calls too."""
        found = computed_names(value.tree)
        return found.union(*(computed_names(call.call) for call in value.calls))

    def elements_seen(self, plan: BankPlan, several: Mapping[str, str]) -> list[Line]:
        """Store what is observed of an element."""
        bank, seen = plan.bank, self.layout.observed
        lines = [self.threshold_seen(bank)]
        lines += [
            self.store("out", seen, f"{force}_elements", several[force]) for force in bank.forces
        ]
        return lines + [
            self.store("out", seen, bank.rate(v), self.local(bank.rate(v))) for v in bank.variables
        ]

    def threshold_seen(self, bank: Bank) -> Line:
        """Store the threshold of an element: that of its model, or the chart's own."""
        seen, s = self.layout.observed, of(bank.name, "s")
        if not bank.threshold and s not in self.read.owner:
            return self.store("out", seen, s, "nan")
        threshold = bank.threshold or s
        place, sizes = self.at("out", seen, s)
        return Line(f"{place} = {self.local(threshold)}", sizes | {threshold})

    def driven_accelerations(self) -> list[Line]:
        """Write the accelerations of driven bodies that locks refer to."""
        wanted = {name for row in self.locks.rows for name in row.row}
        lines = []
        for body in self.read.system.bodies:
            if body.driven and body.name in wanted:
                lines.append(self.rate_in_time(self.local(f"{body.name} a"), body.v))
        return lines

    def rate_in_time(self, target: str, name: str) -> Line:
        """Write the rate of a quantity that depends on time only."""
        gradient = gradient_of(Name(name), self.read)
        terms, reads = self.time_terms(gradient)
        return Line(f"{target} = {' + '.join(terms) or '0.0'}", reads)

    # ------------------------------------------------------------------ the functions
    def before_guards(self, names: Iterable[frozenset[str]]) -> list[Line]:
        """Write the forces, and the accelerations, where guards or actions read them."""
        read = frozenset[str]().union(*names)
        if not read & self.late:
            return []
        lines = self.forces("live", wanted=True)
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

    def switch(self) -> list[str]:
        lines = self.before_guards(
            computed_names(edge.guard) for bank in self.read.banks for edge in bank.edges
        )
        for bank in self.read.banks:
            branches: dict[str, list[Line]] = {}
            for state in bank.states:
                rows: list[Line] = []
                for edge, constant in self.leaving(bank, state):
                    word = "elif" if rows else "if"
                    rows += [
                        Line(f"{word} {self.spell(edge.guard)}:", computed_names(edge.guard)),
                        Line(f"    edge = {constant}  # {state} -> {edge.target}"),
                    ]
                branches[state] = rows
            place, sizes = self.machine(bank.index)
            after = [Line(f"out[{place}] = edge", sizes)]
            lines += self.loop(
                bank.index, "live", [Line("edge = -1")], branches if bank.edges else None, after
            )
        return self.function(
            "switch(t, y, mode, p, out)",
            "out[i] = the first edge of element i whose guard holds, or -1.",
            lines,
            "live",
        )

    def leaving(self, bank: Bank, state: str) -> list[tuple[Edge, str]]:
        """Return the edges that leave a state, highest priority first, with their constants."""
        constants = self.names.edges[bank.index]
        return [
            (edge, constant)
            for edge, constant in zip(bank.edges, constants, strict=True)
            if edge.source == state
        ]

    def act(self) -> list[str]:
        steps = [
            computed_names(value)
            for bank in self.read.banks
            for edge in bank.edges
            for _, value in edge.steps
        ]
        lines, several = self.before_guards(steps), len(self.read.banks) > 1
        for bank in self.read.banks:
            inner: list[Line] = []
            for edge, constant in zip(bank.edges, self.names.edges[bank.index], strict=True):
                word = "elif" if inner else "if"
                taken = self.taken(bank, edge)
                inner += [Line(f"{word} edge == {constant}:"), *indented(taken)]
            first = self.element(bank.index, self.own(bank.index, reads_of(inner)), "live")
            body = self.outward(bank.index, [*first, *inner])
            if several and inner:
                before = self.sizes[: bank.index]
                sizes = frozenset(f"#{size}" for size in before)
                shift = "".join(f" - {size}" for size in before)
                last = self.names.edges[bank.index][-1]
                word = "if" if bank is next(b for b in self.read.banks if b.edges) else "elif"
                lines.append(Line(f"{word} edge <= {last}:"))
                body = [Line(f"i = machine{shift}", sizes), *body]
                body = indented(body)
            lines += body
        if not any(bank.edges for bank in self.read.banks):
            lines = [Line("pass  # the chart has no edges")]
        machine = "machine" if several else "i"
        return self.function(
            f"act(edge, {machine}, t, y, mode, p)",
            f"Take an edge of {'a machine' if several else 'element i'}.",
            lines,
            "live",
        )

    def taken(self, bank: Bank, edge: Edge) -> list[Line]:
        """Write what happens when an edge is taken."""
        lines: list[Line] = []
        locked = {state.name for state in bank.chart.states if state.locked}
        targets: dict[int, str] = {}
        for name, value in edge.steps:
            if name in bank.variables:
                # What is computed from variables is computed again from what they are now.
                tree = self.fresh(value, bank)
                lines.append(self.put(self.local(name), tree))
                place, sizes = self.at("y", self.layout.y, name)
                lines.append(Line(f"{place} = {self.local(name)}", sizes))
            else:
                targets[bank.velocities.index(name)] = name
                lines += self.locks.impulse(
                    bank.index, {bank.velocities.index(name): self.spell(value)}
                )
                lines[-1] = Line(lines[-1].text, lines[-1].reads | computed_names(value))
                lines += self.velocities_again()
        place, sizes = self.mode(bank.index)
        constant = self.names.states[bank.index][edge.target]
        lines.append(Line(f"{place} = {constant}", sizes))
        if edge.target in locked:
            lines += self.locks.impulse(
                bank.index, dict.fromkeys(range(len(bank.velocities)), "0.0")
            )
        return lines

    def fresh(self, value: Value, bank: Bank) -> Value:
        """Return a value with what is computed from variables expanded."""
        inside = {
            each.name
            for each in self.read.definitions
            if each.bank == bank.index and self.read.closure([each.name]) & {*bank.variables}
        }
        if not names_in(value) & inside:
            return value
        return self.read.expanded(value)

    def velocities_again(self) -> list[Line]:
        """Write the relative velocities anew, after an impulse."""
        return [
            self.put(self.local(name), self.plan.definitions[name].tree)
            for bank in self.read.banks
            for name in bank.velocities
            if name in self.plan.definitions
        ]

    def flow(self, signs: Signs) -> list[str]:
        y = self.layout.y
        free = {body.name for body in self.read.free}
        lines = self.forces(signs, wanted=bool(free), rates=True)
        for body in self.read.system.bodies:
            lines.append(Line(f"dy[{y.text(body.x)}] = {self.local(body.v)}", frozenset({body.v})))
            if body.name in free:
                place = f"dy[{y.text(body.v)}]"
                if self.locking:
                    lines.append(Line(f"{place} = {self.local(f'{body.name} a')}"))
                else:
                    lines += self.computed(place, self.plan.accelerations[body.name], signs)
        for name, value in self.plan.flow.items():
            lines += self.computed(f"dy[{y.text(name)}]", value, signs)
        for each in self.read.system.sampled:
            lines += [Line(f"dy[{y.text(name)}] = 0.0") for name in each.updates]
        if signs == "live":
            return self.function(
                "flow_live(t, y, mode, held, p, dy)",
                "dy = dy/dt, all states frozen, corners and jumps evaluated live.",
                lines,
                signs,
            )
        return self.function(
            "flow(t, y, mode, held, p, dy)",
            "dy = dy/dt, all states and all signs frozen.",
            lines,
            signs,
        )

    def observe(self) -> list[str]:
        seen = self.layout.observed
        lines = self.forces("given", wanted=True, observed=True)
        for bank in self.read.banks:
            for name, velocity in zip(bank.chart.velocities, bank.velocities, strict=True):
                place = f"out[{seen.text(of(bank.name, name))}]"
                lines.append(Line(f"{place} = {self.local(velocity)}", frozenset({velocity})))
            for force in bank.forces:
                lines.append(Line(f"out[{seen.text(force)}] = {self.local(force)}"))
            if bank.position in seen.shared:
                place = f"out[{seen.text(bank.position)}]"
                text = f"{place} = {self.local(bank.position)}"
                lines.append(Line(text, frozenset({bank.position})))
            if bank.chart.locks:
                lines += self.locks_seen(bank)
        return self.function(
            "observe(t, y, mode, held, p, out)",
            f"out = v, F, then for all elements s, F_i and the rates; sign {LIVE} means live.",
            lines,
            "given",
        )

    def locks_seen(self, bank: Bank) -> list[Line]:
        """Store the force of a locked element, and whether others carry it."""
        seen, lines = self.layout.observed, []
        locked = [state.name for state in bank.chart.states if state.locked]
        mode, sizes = self.mode(bank.index)
        mode = mode.replace("i]", "0]")
        states = " or ".join(f"{mode} == {self.names.states[bank.index][each]}" for each in locked)
        for q, force in enumerate(bank.forces):
            r = self.locks.number(bank.index, q)
            place, more = self.at("out", seen, f"{force}_elements")
            place = place.replace("i]", "0]")
            lines += [
                Line(f"out[{seen.text(f'{force} shared')}] = 0.0"),
                Line(f"if {states}:", sizes),
                Line(f"    {place} = {self.local(force)}", more),
                Line(f"    out[{seen.text(f'{force} shared')}] = 1.0 - l_{r}"),
            ]
        return lines

    def normal(self) -> list[str]:
        lines: list[Line] = []
        for each in self.plan.gradients:
            word, inner = "elif" if lines else "if", self.gradient(each)
            surfaces, note = self.plan.surfaces, f"  # {self.spell(each.surface)}"
            sizes = frozenset(f"#{size}" for size in surfaces.sizes(each.surface))
            if each.surface in surfaces.shared:
                place = surfaces.text(each.surface)
                lines.append(Line(f"{word} surface == {place}:{note}"))
            else:
                end, start = (surfaces.start_text(each.surface, k) for k in (1, 0))
                bank = self.read.bank_of(each.surface)
                assert bank is not None
                size = frozenset({f"#{self.sizes[bank]}"})
                lines.append(Line(f"{word} surface < {end}:{note}", sizes | size))
                first = self.element(bank, self.own(bank, reads_of(inner)), "live")
                inner = [Line(f"i = surface - ({start})"), *self.outward(bank, [*first, *inner])]
            lines += indented(inner or [Line("pass")])
        if lines:
            y = self.layout.y
            every = frozenset(f"#{block.size}" for block in y.blocks if block.names)
            text = f"for j in range({self.size_text(1)}):"
            lines = [Line(text, every), Line("    out[j] = 0.0"), *lines]
        return self.function(
            "normal(surface, t, y, mode, p, out)",
            "out = the gradient of a surface's value over y, then its rate in t.",
            lines,
            "live",
        )

    def size_text(self, more: int = 0) -> str:
        """Spell the size of the state vector, and some more."""
        y = self.layout.y
        terms = [str(len(y.shared) + more)]
        terms += [f"{len(block.names)} * {block.size}" for block in y.blocks if block.names]
        return " + ".join(terms)

    def gradient(self, gradient: Gradient) -> list[Line]:
        """Write the gradient of a value over y, and its rate in t."""
        lines = []
        for name, value in gradient.by_state.items():
            place, sizes = self.at("out", self.layout.y, name)
            text = f"{place} = {self.spell(value)}"
            lines.append(Line(text, sizes | computed_names(value)))
        terms, reads = self.time_terms(gradient)
        if terms:
            every = frozenset(f"#{b.size}" for b in self.layout.y.blocks if b.names)
            lines.append(Line(f"out[{self.size_text()}] = {' + '.join(terms)}", reads | every))
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

    # ------------------------------------------------------------------ comparisons
    def arm(self) -> list[str]:
        held = self.plan.held
        watched = [*self.plan.always]
        for bank in self.read.banks:
            for edge in bank.edges if not bank.periodic else ():
                watched += _comparisons(split(edge.guard))
        lines = self.before_guards(
            computed_names(side) for each in watched for side in (each.left, each.right)
        )
        lines += [self.watch(relation) for relation in self.plan.always]
        lines += [self.hold(u) for u in held.shared]
        for bank, rough in zip(self.read.banks, self.plan.rough, strict=True):
            branches = {}
            for state in bank.states:
                rows: list[Line] = []
                for u in rough[state]:
                    if u in held.own:
                        rows.append(self.hold(u))
                    rows += [self.watch(relation) for relation in both_sides(u)]
                for edge, _ in self.leaving(bank, state) if not bank.periodic else ():
                    rows.append(Line(f"# {edge.name}: {self.spell(edge.guard)}"))
                    rows += self.witness(split(edge.guard))
                branches[state] = rows
            if any(branches.values()):
                lines += self.loop(bank.index, "live", (), branches)
        return self.function(
            "arm(t, y, mode, p, held, watch)",
            "Freeze the signs and mark the comparisons that keep every false guard false.",
            lines,
            "live",
        )

    def hold(self, u: Value) -> Line:
        """Hold the sign of a value."""
        held = self.plan.held
        sizes = frozenset(f"#{size}" for size in held.sizes(u))
        text = f"held[{held.text(u)}] = sgn({self.spell(u)})"
        return Line(text, sizes | computed_names(u))

    def watch(self, relation: Comparison) -> Line:
        relations = self.plan.relations
        sizes = frozenset(f"#{size}" for size in relations.sizes(relation))
        return Line(f"watch[{relations.text(relation)}] = 1", sizes)

    def witness(self, part: Split) -> list[Line]:
        """Write: if this part is false, watch what keeps it false."""
        if isinstance(part, Requirement):
            # Not the opposite comparison: of NaN neither is true, and it has to be watched.
            reads = computed_names(part.relation)
            return [
                Line(f"if not {self.spell(part.relation)}:", reads),
                *indented([self.watch(part.comparison)]),
            ]
        word, parts = part
        if word == "either":
            return [line for each in parts for line in self.witness(each)]
        lines: list[Line] = []
        for each in parts:
            other = "el" if lines else ""
            if isinstance(each, Requirement):
                first, *rest = self.witness(each)
                lines += [Line(other + first.text, first.reads), *rest]
            else:
                reads = frozenset(
                    name
                    for r in _comparisons(each)
                    for side in (r.left, r.right)
                    for name in computed_names(side)
                )
                inner = self.witness(each) or [Line("pass")]
                lines += [Line(f"{other}if not ({self.truth(each)}):", reads), *indented(inner)]
        return lines

    def truth(self, part: Split) -> str:
        """Spell a split condition; brackets everywhere, as it is only read by machines."""
        if isinstance(part, Requirement):
            return self.spell(part.relation)
        word, parts = part
        if not parts:
            return "True" if word == "both" else "False"
        return (" and " if word == "both" else " or ").join(
            self.truth(q) if isinstance(q, Requirement) else f"({self.truth(q)})" for q in parts
        )

    def margins(self) -> list[str]:
        relations = self.plan.relations
        lines = self.before_guards(
            computed_names(side)
            for each in (*relations.shared, *relations.own)
            for side in (each.left, each.right)
        )
        for each in relations.shared:
            lines += self.margin(each)
        for bank, block in zip(self.read.banks, relations.blocks, strict=True):
            rows = [line for each in block.names for line in self.margin(each)]
            if rows:
                lines += self.loop(bank.index, "live", rows)
        return self.function(
            "margins(t, y, mode, p, watch, out)",
            "For each watched comparison, left - right.",
            lines,
            "live",
        )

    def margin(self, comparison: Comparison) -> list[Line]:
        relations = self.plan.relations
        index = relations.text(comparison)
        sizes = frozenset(f"#{size}" for size in relations.sizes(comparison))
        margin, reads = self.spell(comparison.left), computed_names(comparison.left)
        if comparison.right != Number(0.0):
            right = self.spell(comparison.right)
            simple = isinstance(comparison.right, Name | Number | Negative)
            margin = f"{margin} - {right if simple else f'({right})'}"
            reads |= computed_names(comparison.right)
        return [
            Line(f"if watch[{index}]:", sizes),
            Line(f"    out[{index}] = {margin}", sizes | reads),
        ]

    def values(self) -> list[str]:
        shown, late = self.layout.shown, []
        for name in shown.shared:
            late.append(frozenset({name}) if name in self.late else frozenset())
        lines = self.before_guards(late)
        for bank in self.read.banks:
            start = of(bank.name, "")
            for name in shown.shared:
                if name.startswith(start):
                    tree = bank.means[name.removeprefix(start)]
                    lines.append(self.put(f"out[{shown.text(name)}]", tree))
            rows = []
            for name in shown.blocks[bank.index].names:
                place, sizes = self.at("out", shown, name)
                means = bank.means.get(name.removeprefix(start))
                if means is None or name not in self.read.owner:
                    rows.append(Line(f"{place} = nan", sizes))
                else:
                    line = self.put(place, means)
                    rows.append(Line(line.text, line.reads | sizes))
            lines += self.loop(bank.index, "live", rows)
        return self.function(
            "values(t, y, mode, p, out)",
            "out = what guards can read besides variables and parameters.",
            lines,
            "live",
        )

    def tick(self) -> list[str]:
        y, lines = self.layout.y, list[Line]()
        for k, each in enumerate(self.read.system.sampled):
            inside: list[Line] = []
            for name, tree in self.read.updates[each.name].items():
                inside.append(self.put(self.local(name), tree))
                inside.append(Line(f"y[{y.text(name)}] = {self.local(name)}"))
            lines += [Line(f"if bits & {1 << k}:  # {each.name}"), *indented(inside)]
        for plan in self.plan.banks:
            if bit := self.read.bit(plan.bank):
                lines += [Line(f"if bits & {bit}:  # {plan.bank.name}")]
                lines += indented(self.bank_forces(plan, "live", True, held=True))
        return self.function(
            "tick(bits, t, y, mode, p)",
            "Update what ticks: samplers, and what discrete machines give out.",
            lines,
            "live",
        )


def _comparisons(part: Split) -> list[Comparison]:
    if isinstance(part, Requirement):
        return [part.comparison]
    return [each for inner in part[1] for each in _comparisons(inner)]


def _numbered(constants: Iterable[str]) -> str:
    """Write an assignment of the numbers from 0 to constants."""
    names = [*constants]
    return f"{', '.join(names)} = {', '.join(str(number) for number in range(len(names)))}"


def _one_line(text: str) -> str:
    """Return text fit for a comment: a line break would end it."""
    return "".join(c if c.isprintable() else " " for c in text)
