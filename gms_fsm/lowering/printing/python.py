"""Prints the plan of a program as Python text: if-else that one can read and step through."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gms_fsm.charts.parts import SUPPLIED
from gms_fsm.foundation.text import visible
from gms_fsm.language import (
    Binary,
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
from gms_fsm.lowering.places import total
from gms_fsm.lowering.printing.lines import (
    MOST_BRANCHES,
    Case,
    CodeLine,
    Phase,
    Signs,
    chosen,
    comparisons_of,
    indented,
    numbered,
    reads_of,
)
from gms_fsm.lowering.printing.lock_functions import LockFunctions
from gms_fsm.lowering.printing.names import computed_names
from gms_fsm.lowering.printing.plan import Gradient, Pair, ProgramPlan, both_sides
from gms_fsm.systems.reading.assembly import Bank, ContactEdge, of
from integrators import LIVE

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
    "follow",
    "jolts",
)


def python(plan: ProgramPlan) -> str:
    """Return a program as Python text.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> from gms_fsm.systems.reading.assembly import assembled
    >>> from gms_fsm.lowering.printing.plan import plan_of
    >>> from gms_fsm.systems.system import system_of
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> plan = plan_of(assembled(system_of(model, Prescribed("0.1*t"))))
    >>> print(python(plan).splitlines()[3])
    STICK, SLIP = 0, 1  # states
    """
    printer = _PythonPrinter(plan)
    lines = [
        f"# {visible(plan.title)}",
        "# Generated from the chart; parameters are arguments, so one text serves all values.",
        "",
    ]
    for bank, states in zip(plan.banks, plan.names.states, strict=True):
        whose = "" if len(plan.banks) == 1 else f" of {bank.bank.name}"
        lines.append(f"{numbered(states.values())}  # states{whose}")
    if any(plan.names.edges):
        lines.append(f"{numbered(edge for each in plan.names.edges for edge in each)}  # edges")
    lines.append(printer.marks)
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
        printer.follow(),
        printer.jolts(),
    ):
        lines += ["", "", *function]
    return "\n".join(lines) + "\n"


class _PythonPrinter(LockFunctions):
    """Prints the functions of a plan."""

    # ------------------------------------------------------------------ the functions
    def switch(self) -> list[str]:
        lines = self.before_guards(
            computed_names(edge.guard) for bank in self.read.banks for edge in bank.edges
        )
        lines += self.moved_locks()
        slides = False
        for bank in self.read.banks:
            pairs = [u for u in self.plan.surfaces.own if isinstance(u, Pair)]
            skipped = {name for u in pairs if u.bank == bank.index for name in (u.rise, u.fall)}
            slides = slides or bool(skipped)
            branches: dict[str, list[CodeLine]] = {}
            jolt = f"jolt[{self.machine(bank.index)}]"
            for state in bank.states:
                rows: list[CodeLine] = []
                leaving = self.leaving(bank, state)
                # Where the velocity has jumped, an arrest would take it: another edge, or none.
                refused = [(edge, f"-2 - {constant}") for edge, constant in leaving if edge.arrests]
                for k, (edge, constant) in enumerate((*leaving, *refused)):
                    word, guard = "elif" if k % MOST_BRANCHES else "if", self.spell(edge.guard)
                    if edge.arrests and not constant.startswith("-"):
                        guard = f"{jolt} != JUMPED and ({guard})"
                    if edge.name in skipped:
                        guard = f"skip != {constant} and {guard}"
                    pair = [
                        CodeLine(f"{word} {guard}:", computed_names(edge.guard)),
                        CodeLine(f"    edge = {constant}  # {state} -> {edge.target}"),
                    ]
                    if k and k % MOST_BRANCHES == 0:
                        rows.append(CodeLine("if edge == -1:"))
                    rows += pair if k < MOST_BRANCHES else indented(pair)
                branches[state] = rows
            place = f"out[{self.machine(bank.index)}]"
            before = [CodeLine("edge = -1")] + [CodeLine(f"skip = {place}")] * bool(skipped)
            after = [CodeLine(f"{place} = edge")]
            lines += self.loop(bank.index, "live", before, branches if bank.edges else None, after)
        doc = "out[i] = the first edge of element i whose guard holds, or -1"
        return self.function(
            "switch(t, y, mode, p, jolt, out)",
            f"{doc}; not the one in out[i]." if slides else f"{doc}.",
            lines,
            "live",
        )

    def leaving(self, bank: Bank, state: str) -> list[tuple[ContactEdge, str]]:
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
        steps += [
            computed_names(edge.guard) - {*bank.forces}
            for bank in self.read.banks
            for edge in bank.edges
            if edge.source in bank.locked
        ]
        lines, several = self.before_guards(steps), len(self.read.banks) > 1
        phases = [
            {
                constant: self.phases(bank, edge)
                for edge, constant in zip(bank.edges, constants, strict=True)
            }
            for bank, constants in zip(self.read.banks, self.names.edges, strict=True)
        ]
        last = max((len(each) for edges in phases for each in edges.values()), default=1)
        if last > 1 or any(each[0].hits for edges in phases for each in edges.values()):
            lines += self.locks.no_impulse()
        for number in range(last):
            found = [
                {edge: each[number] for edge, each in edges.items() if number < len(each)}
                for edges in phases
            ]
            lines += self.dispatched(found)
            if any(each.hits for edges in found for each in edges.values()):
                lines += self.locks.impulse()
            if number + 1 < last:
                lines += [*self.locks.no_impulse(), *self.velocities_again()]
        machine = "machine" if several else "i"
        return self.function(
            f"act(edge, {machine}, t, y, mode, p)",
            f"Take an edge of {'a machine' if several else 'element i'}.",
            lines,
            "live",
        )

    def dispatched(self, phases: Sequence[Mapping[str, Phase]]) -> list[CodeLine]:
        """Write one phase of what the edges do, by contact and edge."""
        lines, cases, several = list[CodeLine](), list[Case](), len(self.read.banks) > 1
        for bank, found in zip(self.read.banks, phases, strict=True):
            rows = [Case(k, f"== {k}", phase.lines) for k, phase in found.items()]
            inner = chosen("edge", rows)
            first = self.element(bank.index, self.own(bank.index, reads_of(inner)), "live")
            body = self.outward(bank.index, [*first, *inner])
            if several and inner:
                constants = self.names.edges[bank.index]
                body.insert(0, CodeLine(f"i = machine - {total(self.sizes[: bank.index])}"))
                cases.append(Case(constants[0], f"<= {constants[-1]}", body))
            else:
                lines += body
        return [*lines, *chosen("edge", cases)]

    def phases(self, bank: Bank, edge: ContactEdge) -> list[Phase]:
        """Write what happens when an edge is taken; every impulse ends a phase."""
        lines: list[CodeLine] = []
        found: list[Phase] = []
        for name, value in edge.steps:
            # What is computed from variables is computed again from what they are now.
            tree = self.fresh(value, bank, moved=bool(found))
            if name in bank.chart.events:
                lines.append(CodeLine(f"y[{self.layout.y.text(name)}] = 1.0  # {name}"))
            elif name in bank.variables:
                lines.append(self.put(self.local(name), tree))
                place, sizes = self.at("y", self.layout.y, name)
                lines.append(CodeLine(f"{place} = {self.local(name)}", sizes))
            else:
                goal = CodeLine(self.spell(tree), computed_names(tree))
                targets = {bank.velocities.index(name): goal}
                hit = self.locks.hit(bank.index, targets, impulse=True)
                found.append(Phase([*lines, *hit], hits=True))
                lines = []
        target = self.names.states[bank.index][edge.target]
        lines.append(CodeLine(f"{self.mode(bank.index)} = {target}"))
        if edge.locks:
            every = dict.fromkeys(range(len(bank.velocities)), CodeLine("0.0"))
            lines += self.locks.hit(bank.index, every, impulse=bank.is_impulse(edge))
        return [*found, Phase(lines, hits=edge.locks)]

    def fresh(self, value: Value, bank: Bank, *, moved: bool) -> Value:
        """Return a value with what is computed from variables expanded; and from velocities."""
        changed = {*bank.variables, *(bank.velocities if moved else ())}
        inside = {
            each.name for each in self.read.definitions if self.read.closure([each.name]) & changed
        } - changed
        if not names_in(value) & inside:
            return value
        return self.read.expanded(value)

    def velocities_again(self) -> list[CodeLine]:
        """Write the relative velocities anew, after an impulse."""
        return [
            line
            for bank in self.read.banks
            for name in bank.velocities
            if name in self.plan.definitions
            for line in (
                self.put(self.local(name), self.plan.definitions[name].tree),
                *self.rounded(name),
            )
        ]

    def flow(self, signs: Signs) -> list[str]:
        y = self.layout.y
        free = {body.name for body in self.read.free}
        seen = any(plan.moves for plan in self.plan.banks)
        lines = self.forces(signs, wanted=bool(free) or seen, rates=True)
        for body in self.read.system.bodies:
            lines.append(
                CodeLine(f"dy[{y.text(body.x)}] = {self.local(body.v)}", frozenset({body.v}))
            )
            if body.name in free:
                place = f"dy[{y.text(body.v)}]"
                if self.locking:
                    lines.append(CodeLine(f"{place} = {self.local(f'{body.name} a')}"))
                else:
                    lines += self.computed(place, self.plan.accelerations[body.name], signs)
        for name, value in self.plan.flow.items():
            lines += self.computed(f"dy[{y.text(name)}]", value, signs)
        lines += [CodeLine(f"dy[{y.text(name)}] = 0.0") for name in self.read.system.events]
        for each in self.read.system.sampled:
            lines += [CodeLine(f"dy[{y.text(name)}] = 0.0") for name in each.updates]
        if signs == "live":
            return self.function(
                "flow_live(t, y, mode, held, p, dy)",
                "dy = dy/dt, all states frozen, corners and jumps evaluated live.",
                lines,
                signs,
                within=True,
            )
        return self.function(
            "flow(t, y, mode, held, p, dy)",
            "dy = dy/dt, all states and all signs frozen.",
            lines,
            signs,
            within=True,
        )

    def observe(self) -> list[str]:
        seen = self.layout.observed
        lines = self.forces("given", wanted=True, observed=True)
        for bank in self.read.banks:
            for name, velocity in zip(bank.chart.velocities, bank.velocities, strict=True):
                place = f"out[{seen.text(of(bank.name, name))}]"
                lines.append(CodeLine(f"{place} = {self.local(velocity)}", frozenset({velocity})))
            for force in bank.forces:
                lines.append(CodeLine(f"out[{seen.text(force)}] = {self.local(force)}"))
            if bank.position in seen.shared:
                place = f"out[{seen.text(bank.position)}]"
                text = f"{place} = {self.local(bank.position)}"
                lines.append(CodeLine(text, frozenset({bank.position})))
            if bank.chart.locks:
                lines += self.locks_seen(bank)
        return self.function(
            "observe(t, y, mode, held, p, out)",
            f"out = v, F, then for all elements s, F_i and the rates; sign {LIVE} means live.",
            lines,
            "given",
        )

    def locks_seen(self, bank: Bank) -> list[CodeLine]:
        """Store the force of a locked element, and whether others carry it."""
        seen, lines = self.layout.observed, []
        mode = self.mode(bank.index, "0")
        states = " or ".join(
            f"{mode} == {self.names.states[bank.index][each]}" for each in bank.locked
        )
        for q, force in enumerate(bank.forces):
            r = self.locks.number(bank.index, q)
            _, more = self.at("out", seen, f"{force}_elements")
            place = f"out[{seen.start_text(f'{force}_elements')}]"
            lines += [
                CodeLine(f"out[{seen.text(f'{force} shared')}] = 0.0"),
                CodeLine(f"if {states}:"),
                CodeLine(f"    {place} = {self.local(force)}", more),
                CodeLine(f"    out[{seen.text(f'{force} shared')}] = 1.0 - l_{r}"),
            ]
        return lines

    def normal(self) -> list[str]:
        branches = []
        for each in self.plan.gradients:
            inner = self.gradient(each)
            surfaces, note = self.plan.surfaces, f"  # {self.spell(each.value)}"
            sizes = frozenset(f"#{size}" for size in surfaces.sizes(each.surface))
            if each.surface in surfaces.shared:
                start = surfaces.text(each.surface)
                test, reads = f"== {start}", frozenset[str]()
            else:
                end, start = (surfaces.start_text(each.surface, k) for k in (1, 0))
                u = each.surface
                bank = u.bank if isinstance(u, Pair) else self.read.bank_of(each.value)
                assert bank is not None
                size = frozenset({f"#{self.sizes[bank]}"})
                test, reads = f"< {end}", sizes | size
                first = self.element(bank, self.own(bank, reads_of(inner)), "live")
                inner = [
                    CodeLine(f"i = surface - ({start})"),
                    *self.outward(bank, [*first, *inner]),
                ]
            branches.append(Case(start, test, inner or [CodeLine("pass")], note, reads))
        lines = chosen("surface", branches)
        if lines:
            y = self.layout.y
            every = frozenset(f"#{block.size}" for block in y.blocks if block.names)
            text = f"for j in range({self.layout.y.size_text(1)}):"
            lines = [CodeLine(text, every), CodeLine("    out[j] = 0.0"), *lines]
        return self.function(
            "normal(surface, t, y, mode, p, out)",
            "out = the gradient of a surface's value over y, then its rate in t.",
            lines,
            "live",
        )

    def gradient(self, gradient: Gradient) -> list[CodeLine]:
        """Write the gradient of a value over y, and its rate in t."""
        lines = []
        for name, value in gradient.by_state.items():
            place, sizes = self.at("out", self.layout.y, name)
            text = f"{place} = {self.spell(value)}"
            lines.append(CodeLine(text, sizes | computed_names(value)))
        terms, reads = self.time_terms(gradient)
        if terms:
            every = frozenset(f"#{b.size}" for b in self.layout.y.blocks if b.names)
            lines.append(
                CodeLine(f"out[{self.layout.y.size_text()}] = {' + '.join(terms)}", reads | every)
            )
        return lines

    # ------------------------------------------------------------------ comparisons
    def arm(self) -> list[str]:
        held = self.plan.held
        watched = [*self.plan.always]
        for bank in self.read.banks:
            for edge in bank.edges if not bank.periodic else ():
                watched += comparisons_of(split(edge.guard))
        sides = [side for each in watched for side in (each.left, each.right)]
        lines = self.before_guards(map(computed_names, [*sides, *held.shared, *held.own]))
        lines += [self.watch(relation, self.why(relation.left)) for relation in self.plan.always]
        lines += [self.hold(u) for u in held.shared]
        for bank, rough in zip(self.read.banks, self.plan.rough, strict=True):
            branches = {}
            for state in bank.states:
                rows: list[CodeLine] = []
                for u in rough[state]:
                    if u in held.own:
                        rows.append(self.hold(u))
                    rows += [self.watch(relation, self.why(u)) for relation in both_sides(u)]
                for edge, _ in self.leaving(bank, state) if not bank.periodic else ():
                    rows.append(CodeLine(f"# {edge.name}: {self.spell(edge.guard)}"))
                    rows += self.witness(split(edge.guard), self.waits(bank, state, edge))
                branches[state] = rows
            if any(branches.values()):
                lines += self.loop(bank.index, "live", (), branches)
        return self.function(
            "arm(t, y, mode, p, held, watch)",
            "Freeze the signs and mark the comparisons that keep every false guard false.",
            lines,
            "live",
        )

    def hold(self, u: Value) -> CodeLine:
        """Hold the sign of a value."""
        held = self.plan.held
        sizes = frozenset(f"#{size}" for size in held.sizes(u))
        text = f"held[{held.text(u)}] = sgn({self.spell(u)})"
        return CodeLine(text, sizes | computed_names(u))

    def watch(self, relation: Comparison, why: str = "FOR_A_SIGN") -> CodeLine:
        relations = self.plan.relations
        sizes = frozenset(f"#{size}" for size in relations.sizes(relation))
        return CodeLine(f"watch[{relations.text(relation)}] |= {why}", sizes)

    def waits(self, bank: Bank, state: str, edge: ContactEdge) -> bool:
        """Return whether a guard can change while nothing that it reads moves.

        So can the force that holds a contact, and an input.
        """
        if any(bank.outputs[state, force] is None for force in bank.forces):
            return True
        inputs = {
            name
            for each in bank.chart.inputs
            if each not in SUPPLIED
            for name in names_in(bank.means[each])
        }
        return bool(inputs & self.read.closure(names_in(edge.guard)))

    def witness(self, part: Split, waits: bool) -> list[CodeLine]:
        """Write: if this part is false, watch what keeps it false."""
        if isinstance(part, Requirement):
            # Not the opposite comparison: of NaN neither is true, and it has to be watched.
            reads = computed_names(part.relation)
            waits = waits or self.follows_time(part.relation)
            return [
                CodeLine(f"if not {self.spell(part.relation)}:", reads),
                *indented([self.watch(part.comparison, "FOR_A_GUARD" + " | WAITING" * waits)]),
            ]
        word, parts = part
        if word == "either":
            return [line for each in parts for line in self.witness(each, waits)]
        lines: list[CodeLine] = []
        for each in parts:
            other = "el" if lines else ""
            if isinstance(each, Requirement):
                first, *rest = self.witness(each, waits)
                lines += [CodeLine(other + first.text, first.reads), *rest]
            else:
                reads = frozenset(
                    name
                    for r in comparisons_of(each)
                    for side in (r.left, r.right)
                    for name in computed_names(side)
                )
                inner = self.witness(each, waits) or [CodeLine("pass")]
                lines += [CodeLine(f"{other}if not ({self.truth(each)}):", reads), *indented(inner)]
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
        for head, inner in map(self.margin, relations.shared):
            lines += [head, *indented(self.lazily(inner))]
        for bank, block in zip(self.read.banks, relations.blocks, strict=True):
            made = {relations.text(each): self.margin(each) for each in block.names}
            tests = {f"watch[{index}] != 0": inner for index, (_, inner) in made.items()}
            ahead, parts = self.ahead(bank.index, tests, reads_of(h for h, _ in made.values()))
            pairs = zip(made.values(), parts, strict=True)
            rows = [line for (head, _), part in pairs for line in (head, *indented(part))]
            lines += [*ahead, *self.loop(bank.index, "live", rows)]
        return self.function(
            "margins(t, y, mode, p, watch, out)",
            "For each watched comparison, left - right.",
            lines,
            "live",
            within=True,
        )

    def margin(self, comparison: Comparison) -> tuple[CodeLine, list[CodeLine]]:
        relations = self.plan.relations
        index = relations.text(comparison)
        sizes = frozenset(f"#{size}" for size in relations.sizes(comparison))
        margin, reads = self.spell(comparison.left), computed_names(comparison.left)
        if comparison.right != Number(0.0):
            right = self.spell(comparison.right)
            simple = isinstance(comparison.right, Name | Number | Negative)
            margin = f"{margin} - {right if simple else f'({right})'}"
            reads |= computed_names(comparison.right)
        inner = [CodeLine(f"out[{index}] = {margin}", sizes | reads)]
        bank = self.read.bank_of(Binary("-", comparison.left, comparison.right))
        if bank is not None:  # what takes long, and what is computed from it
            own = self.own(bank, reads)
            inside = frozenset(name for name in own if self.closure(frozenset({name})) & self.long)
            made = self.element(bank, inside, "live")
            seen = {self.local(name) for name in self.closure(inside) & (own - inside)}
            inner = [line for line in made if line.text.split(" =")[0] not in seen] + inner
            inner = [line._replace(reads=line.reads - inside) for line in inner]
        return CodeLine(f"if watch[{index}]:", sizes), inner

    def values(self) -> list[str]:
        shown, late = self.layout.shown, []
        for name in shown.shared:
            late.append(self.closure(frozenset({name})))
        for bank in self.read.banks:
            for name in (*bank.chart.inputs, *bank.chart.let):
                if (tree := bank.means.get(name)) is not None:
                    late.append(computed_names(tree))
        lines = [*self.before_guards(late), *self.moved_locks()]
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
                if means is None:
                    rows.append(CodeLine(f"{place} = nan", sizes))
                else:
                    line = self.put(place, means)
                    rows.append(CodeLine(line.text, line.reads | sizes))
            lines += self.loop(bank.index, "live", rows)
        return self.function(
            "values(t, y, mode, p, jolt, out)",
            "out = what guards can read besides variables and parameters.",
            lines,
            "live",
        )

    def tick(self) -> list[str]:
        y, lines = self.layout.y, list[CodeLine]()
        for k, each in enumerate(self.read.system.sampled):
            inside: list[CodeLine] = []
            for name, tree in self.read.updates[each.name].items():
                inside.append(self.put(self.local(name), tree))
                inside.append(CodeLine(f"y[{y.text(name)}] = {self.local(name)}"))
            lines += [CodeLine(f"if bits & {1 << k}:  # {each.name}"), *indented(inside)]
        for plan in self.plan.banks:
            if bit := self.read.bit(plan.bank):
                lines += [CodeLine(f"if bits & {bit}:  # {plan.bank.name}")]
                body = self.bank_forces(plan, "live", True, held=True)
                lines += indented(body or [CodeLine("pass")])
        if bit := self.read.events_bit:
            lines.append(CodeLine(f"if bits & {bit}:  # all machines were asked"))
            lines += [CodeLine(f"    y[{y.text(name)}] = 0.0") for name in self.read.system.events]
        if bit := self.read.lasting_bit:
            lines.append(CodeLine(f"if bits & {bit}:  # before machines are asked"))
            for bank in self.read.banks:
                rows = [
                    CodeLine(line.text, line.reads | sizes)
                    for name, tree in bank.lasting.items()
                    for place, sizes in [self.at("y", y, name)]
                    for line in [self.put(place, tree)]
                ]
                lines += indented(self.loop(bank.index, "live", rows))
        if reads_of(lines) & self.late:
            lines = [*self.forces("live", wanted=True), *lines]
        return self.function(
            "tick(bits, t, y, mode, p)",
            "Update what ticks: samplers, and what discrete machines give out.",
            lines,
            "live",
        )
