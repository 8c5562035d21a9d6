"""Lines of generated text that know what they read.

A function is put together from its body outwards: what the body reads is computed before it, and so
on, until only arguments are left. Nothing is computed that nobody reads.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

from gms_fsm.language import (
    Binary,
    Call,
    Comparison,
    Name,
    Node,
    Requirement,
    Split,
    Value,
    frozen,
    names_in,
    spell,
)
from gms_fsm.language.functions import ROUGH
from gms_fsm.language.tree import walk
from gms_fsm.lowering.places import Places, total
from gms_fsm.lowering.printing.names import computed_names
from gms_fsm.lowering.printing.plan import Computed, ProgramPlan, RoughCall
from gms_fsm.systems.reading.assembly import of
from integrators import LIVE

# Where a rough call takes its sign from: held ones, those seen now, or given ones, some of which
# may be marked as live.
Signs = Literal["held", "live", "given"]
QUICK = (*ROUGH, "sqrt")  # functions that need no library
# A chain of elif is a tree as deep as it is long, and readers call themselves at each level.
MOST_BRANCHES = 50
TABLES = "the tables"  # what a signal that is a table reads


class CodeLine(NamedTuple):
    """A line of text, and the names from the trees that it reads.

    A lazy line stands for: compute these names here, unless they have been computed, and only if
    the last of some lines before it finds that they are read.
    """

    text: str
    reads: frozenset[str] = frozenset()
    lazy: tuple[str, ...] = ()
    only: tuple[CodeLine, ...] = ()


@dataclass(frozen=True)
class Phase:
    """A part of what happens when an edge is taken.

    Parameters
    ----------
    lines : list of CodeLine
        Assignments.
    hits : bool
        An impulse follows them, and the next phase starts with the velocities after it.
    """

    lines: list[CodeLine]
    hits: bool


def reads_of(lines: Iterable[CodeLine]) -> frozenset[str]:
    """Return what lines read."""
    return frozenset[str]().union(*(line.reads for line in lines))


def _does_something(lines: Iterable[CodeLine]) -> bool:
    """Return whether lines are more than comments."""
    return any(not line.text.lstrip().startswith("#") for line in lines)


def indented(lines: Iterable[CodeLine]) -> list[CodeLine]:
    """Return lines one level deeper."""
    return [line._replace(text="    " + line.text) for line in lines]


class Case(NamedTuple):
    """Lines for some values of an integer: the first of them, and the test of being one."""

    first: str
    test: str
    lines: list[CodeLine]
    note: str = ""
    reads: frozenset[str] = frozenset()


def chosen(number: str, branches: Sequence[Case], *, all_values: bool = False) -> list[CodeLine]:
    """Write an if-else over an integer, in the order of its values; a long one as two halves."""
    if len(branches) > MOST_BRANCHES:
        half = len(branches) // 2
        first, rest = branches[:half], branches[half:]
        return [
            CodeLine(f"if {number} < {rest[0].first}:", rest[0].reads),
            *indented(chosen(number, first, all_values=all_values)),
            CodeLine("else:"),
            *indented(chosen(number, rest, all_values=all_values)),
        ]
    lines = []
    for k, each in enumerate(branches):
        last, word = all_values and k == len(branches) - 1, "elif" if k else "if"
        head = f"else:  # {each.first}" if last else f"{word} {number} {each.test}:{each.note}"
        lines += [CodeLine(head, each.reads), *indented(each.lines)]
    return lines


class ProgramWriter(ABC):
    """Writes values, loops over elements and functions of a plan.

    Parameters
    ----------
    plan : ProgramPlan
        Of the program.
    """

    def __init__(self, plan: ProgramPlan) -> None:
        self.plan, self.read = plan, plan.read
        self.names, self.layout = plan.names, plan.layout
        self.sizes = [block.size for block in plan.layout.y.blocks]
        # What is computed with the forces, never at the head of a function.
        self.late = plan.read.late

    # ------------------------------------------------------------------ values
    def spell(self, node: Node) -> str:
        """Spell a tree with the names of the text."""
        return spell(node, rename=self.names.texts)

    def local(self, name: str) -> str:
        """Return the name in the text."""
        return self.names.local[name]

    def put(self, target: str, tree: Value, note: str = "") -> CodeLine:
        """Write an assignment to a name or a place of the text."""
        return CodeLine(f"{target} = {self.spell(tree)}{note}", computed_names(tree))

    def at(self, array: str, places: Places[str], name: str) -> tuple[str, frozenset[str]]:
        """Spell a place of an array, and say which sizes it reads."""
        sizes = frozenset(f"#{size}" for size in places.sizes(name))
        return f"{array}[{places.text(name)}]", sizes

    def store(self, array: str, places: Places[str], name: str, text: str) -> CodeLine:
        """Write an assignment to a place of an array."""
        place, sizes = self.at(array, places, name)
        return CodeLine(f"{place} = {text}", sizes)

    # ------------------------------------------------------------------ corners and jumps
    def computed(
        self, target: str, value: Computed, signs: Signs, note: str = ""
    ) -> list[CodeLine]:
        """Write an assignment of a value, after its rough calls."""
        return [*self.calls(value.calls, signs), self.put(target, value.tree, note)]

    def calls(self, calls: Iterable[RoughCall], signs: Signs) -> list[CodeLine]:
        """Assign rough calls, each once."""
        return [self.call(each, signs) for each in dict.fromkeys(calls)]

    def call(self, rough: RoughCall, signs: Signs) -> CodeLine:
        """Assign a rough call, whose sign is held, live or given."""
        call, live = rough.call, self.spell(rough.call)
        if signs == "live":
            return CodeLine(f"{rough.name} = {live}", computed_names(call))
        held = self.plan.held
        sizes = frozenset(f"#{size}" for size in held.sizes(rough.turning))
        sign = f"held[{held.text(rough.turning)}]"
        frame = frozen(call, Name(sign))
        value = self.spell(frame)
        if isinstance(frame, Call):  # a choice: without brackets around it
            value = value[1:-1]
        if signs == "given":
            value = f"{live} if {sign} == {LIVE} else {value}"
        elif call.function == "sgn":
            return CodeLine(f"{rough.name} = {value}", sizes)
        return CodeLine(f"{rough.name} = {value}", sizes | computed_names(call))

    def why(self, u: Value) -> str:
        """Say why a sign is watched; one that follows time changes while nothing moves."""
        return "FOR_A_SIGN | WAITING" if self.follows_time(u) else "FOR_A_SIGN"

    def follows_time(self, tree: Node) -> bool:
        """Return whether a tree depends on time though nothing moves.

        Not by way of a given motion: there something moves, and errors limit the steps.
        """
        found = {name for body in self.read.system.bodies for name in (body.x, body.v)}
        found |= {name for bank in self.read.banks for name in bank.velocities}
        waiting = [*names_in(tree)]
        while waiting:
            name = waiting.pop()
            if name in found:
                continue
            found.add(name)
            definition = self.read.defined.get(name)
            if name == "t" or (definition is not None and definition.signal is not None):
                return True
            if definition is not None and definition.tree is not None:
                waiting += names_in(definition.tree)
        return False

    # ------------------------------------------------------------------ what elements read first
    def element(self, bank: int, reads: frozenset[str], signs: Signs) -> list[CodeLine]:
        """Assign what lines read of an element: its variables, and what is computed from them."""
        needed = self.closure(reads)
        owner, y = self.read.owner, self.layout.y
        lines = []
        for name in self.read.banks[bank].variables:
            if name in needed:
                place, sizes = self.at("y", y, name)
                lines.append(CodeLine(f"{self.local(name)} = {place}", sizes))
        for name, value in self.plan.definitions.items():
            if name in needed and owner.get(name) == bank:
                lines += self.computed(self.local(name), value, signs)
        return lines

    def closure(self, reads: frozenset[str]) -> frozenset[str]:
        """Return names, and those that they are computed from."""
        found, waiting = set[str](), [*reads]
        while waiting:
            name = waiting.pop()
            if name not in found:
                found.add(name)
                waiting += self.needs.get(name, ())
        return frozenset(found)

    @cached_property
    def needs(self) -> Mapping[str, frozenset[str]]:
        """By name what its definition reads."""
        return {
            name: computed_names(value.tree).union(*(computed_names(u.call) for u in value.calls))
            for name, value in self.plan.definitions.items()
        }

    def loop(
        self,
        bank: int,
        signs: Signs,
        before: Sequence[CodeLine] = (),
        branches: Mapping[str, list[CodeLine]] | None = None,
        after: Sequence[CodeLine] = (),
    ) -> list[CodeLine]:
        """Write a loop over the elements of a contact: lines, an if-else over states, lines.

        What is computed from the variables is computed where it is read: before the if-else if it
        is read outside or in more than one branch, else in its branch.
        """
        rows = {} if branches is None else dict(branches)
        wanted = [self.own(bank, reads_of(lines)) for lines in rows.values()]
        outside = self.own(bank, reads_of([*before, *after]))
        first = outside | {
            name for each in wanted for name in each if sum(name in other for other in wanted) > 1
        }
        if len(rows) == 1:
            first = first.union(*wanted)
        variables = {*self.read.banks[bank].variables}
        first |= frozenset(name for each in wanted for name in each if name in variables)
        for (state, lines), each in zip(rows.items(), wanted, strict=True):
            if inside := each - first:
                made = self.element(bank, inside, signs)
                seen = {self.local(name) for name in self.closure(inside) & first}
                rows[state] = [
                    line for line in made if line.text.split(" =")[0] not in seen
                ] + lines
        ahead = list[CodeLine]()
        if len(rows) > 1:
            states, mode = self.names.states[bank], self.mode(bank)
            tests = {f"{mode} == {states[state]}": lines for state, lines in rows.items()}
            ahead, parts = self.ahead(bank, tests, whole=len(rows) == len(states))
            rows = dict(zip(rows, parts, strict=True))
        body = [*before, *(self.by_state(bank, rows) if rows else []), *after]
        body = [*self.element(bank, first, signs), *body]
        if not body:
            return []
        text = f"for i in range({self.sizes[bank]}):"
        head = CodeLine(text, frozenset({f"#{self.sizes[bank]}"}))
        return self.outward(bank, [*ahead, head, *indented(body)])

    def ahead(
        self,
        bank: int,
        rows: Mapping[str, list[CodeLine]],
        reads: frozenset[str] = frozenset(),
        *,
        whole: bool = False,
    ) -> tuple[list[CodeLine], list[list[CodeLine]]]:
        """Let what takes long be computed before a loop, if a test holds by which lines read it.

        Inside the loop machine code would have it, and a test, once for each element. Returns what
        is before the loop, and the lines by test, of which one holds for each element if `whole`.
        """
        readers, found = dict[str, list[str]](), list[list[CodeLine]]()
        for test, lines in rows.items():
            first, *rest = self.lazily(lines) or [CodeLine("")]
            found.append(rest if first.lazy else lines)
            for name in first.lazy:
                readers.setdefault(name, []).append(test)
        groups = dict[tuple[str, ...], list[str]]()
        for name in (each for each in self.read.defined if each in readers):
            groups.setdefault((*readers[name],), []).append(name)
        made, size = [], self.sizes[bank]
        for tests, names in groups.items():
            before = (
                CodeLine("found = False"),
                CodeLine(f"for i in range({size}):", reads | {f"#{size}"}),
                CodeLine(f"    found = found or {' or '.join(tests)}"),
                CodeLine("if found:"),
            )
            always = whole and len(tests) == len(rows)
            made.append(CodeLine("", lazy=(*names,), only=() if always else before))
        return made, found

    def lazily(self, lines: list[CodeLine]) -> list[CodeLine]:
        """Let what takes long be computed in these lines, which may not be reached."""
        needed = self.closure(reads_of(lines)) & self.long
        names = [name for name in self.read.defined if name in needed] if needed else []
        if not names:
            return lines
        without = [line._replace(reads=line.reads - {*names}) for line in lines]
        return [CodeLine("", lazy=(*names,)), *without]

    @cached_property
    def long(self) -> frozenset[str]:
        """The shared quantities that contain a function such as exp or a power."""
        return frozenset(
            name
            for name, value in self.plan.definitions.items()
            if name not in self.late and name not in self.read.owner and not value.calls
            for part in walk(value.tree)
            if (isinstance(part, Call) and part.function not in QUICK)
            or (isinstance(part, Binary) and part.op == "**")
        )

    def own(self, bank: int, reads: frozenset[str]) -> frozenset[str]:
        """Return what is read of an element that is assigned first."""
        parameters = {*self.read.own}
        rates = {*map(self.read.banks[bank].rate, self.read.banks[bank].variables)}
        owner = self.read.owner
        return frozenset(
            name
            for name in self.closure(reads)
            if owner.get(name) == bank and name not in parameters and name not in rates
        )

    def outward(self, bank: int, lines: list[CodeLine]) -> list[CodeLine]:
        """Forget what lines read of an element; its parameters stay, as arrays."""
        inside = {
            name
            for name, owner in self.read.owner.items()
            if owner == bank and name not in self.read.own
        }
        return [line._replace(reads=line.reads - inside) for line in lines]

    def by_state(self, bank: int, branches: Mapping[str, list[CodeLine]]) -> list[CodeLine]:
        """Write an if-else over the element's state."""
        states = self.names.states[bank]
        filled = [
            Case(
                states[state],
                f"== {states[state]}",
                body if _does_something(body) else [*body, CodeLine("pass")],
            )
            for state, body in branches.items()
        ]
        if not any(_does_something(body) for body in branches.values()):
            return []
        if len(filled) == 1:
            return next(iter(branches.values()))
        return chosen(self.mode(bank), filled, all_values=True)

    def mode(self, bank: int, element: str = "i") -> str:
        """Spell the mode of an element of a contact."""
        return f"mode[{self.machine(bank, element)}]"

    def machine(self, bank: int, element: str = "i") -> str:
        """Spell the number of an element of a contact among all machines."""
        return total([*self.sizes[:bank], element])

    # ------------------------------------------------------------------ functions
    def function(
        self, signature: str, doc: str, body: list[CodeLine], signs: Signs, *, within: bool = False
    ) -> list[str]:
        """Assemble a function: signature, the values its body reads, then the body.

        Within a step velocities that locks determine are computed; elsewhere they are in y.
        """
        at_once = self.closure(reads_of(body))
        times = Counter(name for line in body for name in line.lazy if name not in at_once)
        lines: list[CodeLine] = []
        for line in body:
            made = [] if line.lazy else [line]
            for name in (each for each in line.lazy if each in times):
                found, own = self.defined(name, signs), self.local(name)
                if times[name] > 1:
                    found = [CodeLine(f"if {own} != {own}:"), *indented(found)]
                made += found
            if line.lazy and made:
                made = [*line.only, *indented(made)] if line.only else made
                made = [each._replace(text=line.text + each.text) for each in made]
            lines += made
        first = [CodeLine(f"{self.local(name)} = nan  # computed if it is read") for name in times]
        head = self.head(reads_of(lines) - {*times}, signs, self.followed() if within else [])
        lines = [*head, *first, *lines] or [CodeLine("pass")]
        return [f"def {signature}:", f'    """{doc}"""', *(f"    {line.text}" for line in lines)]

    @abstractmethod
    def followed(self) -> list[CodeLine]:
        """Write the velocities that locks determine."""

    @abstractmethod
    def rounded(self, name: str) -> list[CodeLine]:
        """Write that a value is zero if it is so but for rounding."""

    def head(
        self, reads: frozenset[str], signs: Signs, followed: list[CodeLine] | None = None
    ) -> list[CodeLine]:
        """Write what is read before a body: numbers, states, and what is computed from them."""
        needed = self.closure(reads | reads_of(followed or ())) - self.late
        values: list[CodeLine] = []
        for name in self.read.defined:
            # May read a velocity; how many elements are in a state does not.
            of_a_part = "." in name and "(" not in name
            if followed and (of_a_part or name in self.read.system.let):
                values, followed = values + followed, None
            if name in needed and name not in self.read.owner:
                values += self.defined(name, signs)
        values += followed or []
        needed = (needed | self.closure(reads_of(values))) - self.late
        shared = [(name, j) for j, name in enumerate(self.names.shared) if name in needed]
        own = [(name, j) for j, name in enumerate(self.names.own) if name in needed]
        # With several contacts their sizes are numerals.
        sizes = [size for size in self.sizes if f"#{size}" in needed and len(self.sizes) == 1]
        lines = []
        if shared or own or sizes or TABLES in needed:
            lines.append(CodeLine("shared, own, tables = p"))
        lines += [CodeLine(f"{self.local(name)} = shared[{j}]") for name, j in shared]
        lines += [CodeLine(f"{self.local(name)} = own[{j}]") for name, j in own]
        for size in sizes:
            # After the elements' modes come those of the surfaces: len(mode) says nothing.
            weight = self.names.own.index(self.read.banks[0].weight)
            lines.append(CodeLine(f"{size} = len(own[{weight}])"))
        y = self.layout.y
        lines += [
            CodeLine(f"{self.local(name)} = y[{y.text(name)}]")
            for name in y.shared
            if name in needed
        ]
        # What is read of a single element outside of the loop over its contact.
        lines += [
            CodeLine(f"{self.local(name)} = y[{y.start_text(name)}]")
            for name in y.own
            if name in needed
        ]
        return lines + values

    def defined(self, name: str, signs: Signs) -> list[CodeLine]:
        """Assign a shared quantity that is computed from others."""
        target = self.local(name)
        value = self.plan.definitions.get(name)
        if value is not None:
            if name.endswith(".curve S"):
                return self.curve(name, value, signs)
            return [*self.computed(target, value, signs), *self.rounded(name)]
        if (counts := self.read.defined[name].counts) is not None:
            bank = self.read.banks[counts[0]]
            mode, states = self.mode(bank.index), self.names.states[bank.index]
            test = " or ".join(f"{mode} == {states[each]}" for each in counts[1])
            size = self.sizes[bank.index]
            return [
                CodeLine(f"{target} = 0.0"),
                CodeLine(f"for i in range({size}):", frozenset({f"#{size}"})),
                CodeLine(f"    if {test}:"),
                CodeLine(f"        {target} += 1.0"),
            ]
        if (name, "times") in self.plan.tables.shared:
            return [
                CodeLine(f"{target} = piecewise_linear(t, {self.table(name)})", frozenset({TABLES}))
            ]
        return [CodeLine(f"{target} = {name}_signal(t)")]

    def curve(self, name: str, value: Computed, signs: Signs) -> list[CodeLine]:
        """Assign a Stribeck curve; where it is flat to the last bit, exp would be lost."""
        contact = name.removesuffix("curve S")
        (bank,) = [each for each in self.read.banks if of(each.name, "") == contact]
        v, F_c, flat = bank.velocities[0], f"{contact}curve F_c", f"{contact}curve v flat"
        *calls, line = self.computed(self.local(name), value, signs, "  # (2)")
        test = f"if abs({self.local(v)}) > {self.local(flat)}:"
        constant = CodeLine(f"{self.local(name)} = {self.local(F_c)}", frozenset({F_c}))
        return [
            *calls,
            CodeLine(test, frozenset({v, flat})),
            *indented([constant]),
            CodeLine("else:"),
            *indented([line]),
        ]

    def table(self, name: str) -> str:
        """Spell the corners of a signal: their times and values."""
        places = (self.plan.tables.text((name, column)) for column in ("times", "values"))
        return ", ".join(f"tables[{place}]" for place in places)


def comparisons_of(part: Split) -> list[Comparison]:
    """Return the comparisons in a split condition."""
    if isinstance(part, Requirement):
        return [part.comparison]
    return [each for inner in part[1] for each in comparisons_of(inner)]


def numbered(constants: Iterable[str]) -> str:
    """Write an assignment of the numbers from 0 to constants."""
    names = [*constants]
    return f"{', '.join(names)} = {', '.join(str(number) for number in range(len(names)))}"
