"""Format ``matlab``: a function file for MATLAB and GNU Octave, with located switches inside."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from gms_fsm.errors import ParameterError
from gms_fsm.exporters._c import TEMPLATES
from gms_fsm.exporters._element import Element
from gms_fsm.exporters._element_parts import Expression, Let, State
from gms_fsm.exporters._names import LONGEST
from gms_fsm.exporters._readme import about_friction
from gms_fsm.exporters._registry import Exporter, register
from gms_fsm.exporters._subject import Subject
from gms_fsm.language import MATLAB, Node, Relation, names_in, spell
from gms_fsm.lowering._plan import RoughCall, both_sides
from gms_fsm.lowering.adapting import SHARE
from gms_fsm.lowering.scales import scales_of

__all__ = ["WORDS", "matlab"]

# Keywords of MATLAB (iskeyword) and of Octave, and the functions that the text calls.
WORDS = frozenset(
    re.findall(
        r"\w+",
        """
        arguments break case catch classdef continue else elseif end enumeration events for function
        global if methods otherwise parfor persistent properties return spmd switch try while
        do endclassdef endenumeration endevents endfor endfunction endif endmethods endparfor
        endproperties endspmd endswitch endwhile end_try_catch end_unwind_protect until
        unwind_protect unwind_protect_cleanup
        abs all asinh atan cos eps error exp false find log max min numel pi power sign sin sqrt
        struct tanh true zeros
        """,
    )
)
FIELDS = ("longest_step", "tolerance", "edges")


def matlab(subject: Subject) -> dict[str, str]:
    """Return a friction as a function file.

    Parameters
    ----------
    subject : Subject
        One friction, whose velocity is an input.

    Returns
    -------
    dict of str to str
        ``<name>.m`` and ``README-<name>-matlab.md``.

    Raises
    ------
    ParameterError
        If it cannot be expressed; what is in the way is named.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> text = matlab(Subject.of(model, "matlab", name="gms"))["gms.m"]
    >>> "elseif z(i) <= -s && v < -p.v_c" in text
    True
    """
    printer = _Printer(subject)
    return {
        f"{subject.name}.m": printer.text(),
        f"README-{subject.name}-matlab.md": printer.readme(),
    }


class _Printer:
    """Prints a friction as a function file."""

    def __init__(self, subject: Subject) -> None:
        self.name = subject.name
        self.element = Element.of(subject, WORDS, time=False)
        element, free = self.element, self.element.free
        self.part, self.t_start = free("F_i"), subject.t_start
        self.scales = scales_of(subject.contact)
        self.y, self.u, self.tau, self.p, self.i = map(free, ("y", "u", "tau", "p", "i"))
        self.state, self.held, self.found = map(free, ("state", "held", "found"))
        self.edge, self.dy = map(free, ("edge", "dy"))
        self.texts = {
            each.name: f"{self.p}.{each.name}" + f"({self.i})" * isinstance(each.value, tuple)
            for each in element.constants
        }
        for variable in element.variables:
            self.texts[variable.name] = f"{variable.name}({self.i})"
            self.texts[variable.rate] = f"{variable.rate}({self.i})"
        # The held signs, h1, h2 ...: of what they are stands in a comment.
        self.signs = {
            u: (f"{self.held}.h{number}{f'({self.i})' if own else ''}", own)
            for number, (u, own) in enumerate(element.held, 1)
        }

    # ------------------------------------------------------------------ the parts of the file
    def text(self) -> str:
        element = self.element
        inputs = [name for name, _ in element.inputs]
        vectors = [each.name for each in element.variables] + [element.position] * bool(
            element.position
        )
        unpack = [f"s.{name} = {self.piece(name, 'y')};" for name in vectors]
        further = "".join(f", {name}0, {name}1" for name in inputs[1:])
        about = "".join(
            f"\n%   {name}0 and {name}1 are the input {name} at both ends." for name in inputs[1:]
        )
        for each in vectors:
            if each in FIELDS:
                raise ParameterError(
                    "it is a field of the function's own",
                    place=f"chart {element.title!r}, variable {each!r}",
                    advice="give it another name",
                )
        template = (TEMPLATES / "matlab.m").read_text(encoding="utf-8")
        main = template.format(
            arguments=further,
            title=_one_line(element.title),
            inputs=about,
            lines=", ".join(f"'{name}', [{name}0, {name}1]" for name in inputs),
            pack="; ".join(f"s.{name}" for name in vectors),
            speed=repr(self.scales.v) if self.scales.v else "Inf",
            sizes="; ".join(map(repr, self.sizes())),
            unpack="\n".join(unpack),
        )
        parts = [
            main,
            self.function(f"{self.dy} = @_flow({self.given('held')})", self.flow()),
            self.function(f"F = @_force({self.given()})", self.force()),
            self.function(
                f"{self.edge} = @_guards({self.given()})",
                self.guards(),
            ),
            self.function(
                f"[{self.y}, {self.state}] = @_take({self.edge}, {self.i}, {self.given()})",
                self.take(),
            ),
            self.function(f"{self.found} = @_compare({self.given()})", self.compare()),
            self.function(
                f"{self.held} = @_signs({self.y}, {self.u}, {self.tau}, {self.p})", self.sign()
            ),
            self.numbers(),
            self.begin(),
        ]
        text = "\n".join(parts)
        suffix = max(re.findall(r"@(_\w+)", text), key=len)
        if len(self.name + suffix) > LONGEST:
            raise ParameterError(
                f"it has more than {LONGEST - len(suffix)} characters: MATLAB's names have at most "
                f"{LONGEST}, and there will be a function {self.name + suffix!r}",
                place=f"name {self.name!r}",
                advice='give a shorter one, for example name="friction" (--name friction)',
            )
        return text.replace("@", self.name)

    def sizes(self) -> list[float]:
        """Return for each component of the vector below which size its error is absolute."""
        element = self.element
        found = [
            SHARE * size
            for each in element.variables
            for size in self.scales.variables.get(each.name, (0.0,) * element.n)
        ]
        return [*found, SHARE * self.scales.x] if element.position else found

    def given(self, *more: str) -> str:
        held = [self.held] if more else []
        return ", ".join([self.y, self.u, self.tau, self.state, *held, self.p])

    def function(self, head: str, body: Sequence[str]) -> str:
        return "\n".join([f"function {head}", *body, "end", ""])

    def piece(self, name: str, vector: str) -> str:
        """Spell the part of the vector that a name stands for."""
        n, order = self.element.n, [each.name for each in self.element.variables]
        if name not in order:  # the position comes last
            return f"{vector}({n * len(order) + 1})"
        first = n * order.index(name)
        return f"{vector}({first + 1}:{first + n})" if n > 1 else f"{vector}({first + 1})"

    # ------------------------------------------------------------------ what is read first
    def head(self, reads: Iterable[str], held: bool = False) -> list[str]:
        """Assign what elements read: inputs, variables, and what they share."""
        element = self.element
        shared = element.needed(reads, per_element=False)
        inside = element.needed(reads, per_element=True)
        names = {*reads}.union(*(each.value.names for each in (*shared, *inside)))
        lines = [
            f"{name} = @_line({self.u}.{name}, {self.u}, {self.tau});"
            for name, _ in element.inputs
            if name in names
        ]
        if "t" in names:
            lines.append(f"t = {self.u}.t + {self.tau};")
        for each in element.variables:
            if each.name in names:
                lines.append(f"{each.name} = {self.piece(each.name, self.y)};")
        if element.position in names:
            lines.append(f"{element.position} = {self.piece(element.position, self.y)};")
        return lines + self.lets(shared, held)

    def lets(self, lets: Iterable[Let], held: bool) -> list[str]:
        return [line for each in lets for line in self.assign(each.name, each.value, held)]

    def assign(self, target: str, value: Expression, held: bool) -> list[str]:
        """Assign a value, with held signs or with those of now."""
        if not held:
            return [f"{target} = {self.spell(value.tree)};"]
        calls = [line for each in value.calls for line in self.call(each)]
        return [*calls, f"{target} = {self.spell(value.smooth)};"]

    def call(self, rough: RoughCall) -> Iterator[str]:
        """Assign a call that has a corner or a jump, with the sign that is held."""
        (sign, _), call = self.signs[rough.turning], rough.call
        first, *others = map(self.spell, call.arguments)
        match call.function:
            case "sgn":
                yield f"{rough.name} = {sign};"
            case "abs":
                product = self.spell(call.arguments[0])
                yield f"{rough.name} = {sign} * ({product});"
            case function:
                yield f"if {sign} {'<=' if function == 'min' else '>='} 0"
                yield f"    {rough.name} = {first};"
                yield "else"
                yield f"    {rough.name} = {others[0]};"
                yield "end"

    def spell(self, node: Node) -> str:
        return spell(node, MATLAB, self.texts)

    def loop(
        self,
        reads: Sequence[frozenset[str]],
        branches: Sequence[Sequence[str]],
        *,
        held: bool = False,
        first: Sequence[str] = (),
        after: Sequence[str] = (),
    ) -> list[str]:
        """Write a loop over the elements, with a branch for each state."""
        before, inside = self.element.placed(reads)
        rows = [
            [*self.lets(lets, held), *lines] if lines else []
            for lets, lines in zip(inside, branches, strict=True)
        ]
        body = [*first, *self.lets(before, held), *self.choice(rows), *after]
        return [f"for {self.i} = 1:{self.element.n}", *_indented(body), "end"]

    def choice(self, rows: Sequence[Sequence[str]]) -> list[str]:
        """Choose by the element's state."""
        if len(rows) == 1:
            return list(rows[0])
        if not any(rows):
            return []
        lines = [f"switch {self.state}({self.i})"]
        for number, (state, row) in enumerate(zip(self.element.states, rows, strict=True), 1):
            lines += [f"    case {number}  % {state.name}", *_indented(_indented(row))]
        return [*lines, "end"]

    # ------------------------------------------------------------------ the functions
    def rates(self, state: State, held: bool, wanted: frozenset[str] | None = None) -> list[str]:
        return [
            line
            for each in self.element.variables
            if wanted is None or each.rate in wanted
            for line in self.assign(self.texts[each.rate], state.rates[each.name], held)
        ]

    def flow(self) -> list[str]:
        element = self.element
        reads = [
            frozenset[str]().union(*(rate.names for rate in state.rates.values()))
            for state in element.states
        ]
        every = frozenset[str]().union(*reads)
        v, _ = element.inputs[0]
        empty = [f"{each.rate} = zeros({element.n}, 1);" for each in element.variables]
        rows = [self.rates(state, held=True) for state in element.states]
        parts = [each.rate for each in element.variables] + [v] * bool(element.position)
        lines = ["% The rates of change, states and signs held."]
        lines += [*self.head(every | ({v} if element.position else set()), held=True), *empty]
        lines += self.loop(reads, rows, held=True) if any(rows) else []
        return [*lines, f"{self.dy} = [{'; '.join(parts)}];"]

    def force(self) -> list[str]:
        element = self.element
        reads, rows = list[frozenset[str]](), []
        for state in element.states:
            wanted = state.force.names
            used = [state.rates[e.name].names for e in element.variables if e.rate in wanted]
            reads.append(wanted.union(*used))
            row = self.rates(state, held=False, wanted=wanted)
            rows.append([*row, *self.assign(self.part, state.force, held=False)])
        every = element.total.names.union(*reads)
        rates = [each.rate for each in element.variables if each.rate in every]
        lines = ["% The force of all elements.", *self.head(every)]
        lines += [f"{rate} = zeros({element.n}, 1);" for rate in rates]
        lines += ["F = 0;", *self.loop(reads, rows, after=[f"F = F + {self.part};"])]
        return [*lines, f"F = {self.spell(element.total.tree)};"]

    def guards(self) -> list[str]:
        element = self.element
        reads = [
            frozenset[str]().union(*(names_in(edge.guard) for edge in state.edges))
            for state in element.states
        ]
        rows = []
        for state in element.states:
            row, word = [], "if"
            for edge in state.edges:
                row.append(f"{word} {self.spell(edge.guard)}")
                row.append(f"    {self.edge}({self.i}) = {edge.number + 1};  % {edge.name}")
                word = "elseif"
            rows.append([*row, "end"] if row else row)
        lines = ["% For each element its first edge whose guard is true, or 0."]
        lines += [*self.head(frozenset[str]().union(*reads))]
        lines += [f"{self.edge} = zeros(1, {element.n});"]
        return lines + (self.loop(reads, rows) if any(rows) else [])

    def take(self) -> list[str]:
        element = self.element
        edges = [edge for state in element.states for edge in state.edges]
        reads = [names_in(tree) for edge in edges for _, tree in edge.steps]
        every = frozenset[str]().union(*reads)
        changed = [
            each.name
            for each in element.variables
            if any(each.name == name for edge in edges for name, _ in edge.steps)
        ]
        lines = ["% Take an edge of an element."]
        lines += self.head(every | {*changed})
        lines += self.lets(element.needed(every, per_element=True), held=False)
        if not edges:
            return lines
        lines.append(f"switch {self.edge}")
        for edge in sorted(edges, key=lambda each: each.number):
            row = [f"{self.texts[name]} = {self.spell(tree)};" for name, tree in edge.steps]
            row.append(f"{self.state} = {edge.target + 1};  % {element.states[edge.target].name}")
            lines += [f"    case {edge.number + 1}  % {edge.name}", *_indented(_indented(row))]
        lines.append("end")
        return lines + [f"{self.piece(name, self.y)} = {name};" for name in changed]

    def compare(self) -> list[str]:
        """Print the comparisons in which guards, corners and jumps can change."""
        element = self.element
        rows: list[list[str]] = []
        reads: list[frozenset[str]] = []
        for state in element.states:
            found = [each for edge in state.edges for each in edge.comparisons]
            found += [each for u in state.corners for each in both_sides(u)]
            relations = [
                Relation(">" if each.strict else ">=", each.left, each.right)
                for each in dict.fromkeys(found)
            ]
            reads.append(frozenset[str]().union(*map(names_in, relations)))
            rows.append(self.collected(map(self.spell, relations)))
        outer = [
            Relation(">" if each.strict else ">=", each.left, each.right)
            for u in element.corners
            for each in both_sides(u)
        ]
        every = frozenset[str]().union(*reads, *map(names_in, outer))
        lines = ["% Comparisons: while none of them changes, no guard and no sign does."]
        lines += [*self.head(every), f"{self.found} = false(1, 0);"]
        lines += self.collected(map(self.spell, outer))
        return lines + (self.loop(reads, rows) if any(rows) else [])

    def collected(self, relations: Iterable[str]) -> list[str]:
        texts = ", ".join(f"({each})" for each in relations)
        return [f"{self.found} = [{self.found}, {texts}];"] if texts else []

    def sign(self) -> list[str]:
        """Print the signs that an arc begins with."""
        shared = [(u, text) for u, (text, own) in self.signs.items() if not own]
        own = [(u, text) for u, (text, each) in self.signs.items() if each]
        reads = frozenset[str]().union(*(names_in(u) for u in self.signs))
        lines = ["% Signs, held until they change.", *self.head(reads), f"{self.held} = struct();"]
        lines += [f"{text} = sign({self.spell(u)});" for u, text in shared]
        if own:
            needed = frozenset[str]().union(*(names_in(u) for u, _ in own))
            body = self.lets(self.element.needed(needed, per_element=True), held=False)
            body += [f"{text} = sign({self.spell(u)});" for u, text in own]
            lines += [f"for {self.i} = 1:{self.element.n}", *_indented(body), "end"]
        return lines

    def numbers(self) -> str:
        lines = ["p = struct();"]
        for each in self.element.constants:
            value = each.value
            text = f"[{', '.join(map(repr, value))}]" if isinstance(value, tuple) else repr(value)
            lines.append(f"p.{each.name} = {text};{_note(each.about)}")
        return self.function("p = @_numbers()", lines)

    def begin(self) -> str:
        element, start = self.element, repr(self.t_start)
        lines = [f"s = struct('t', {start}, 'longest_step', Inf, 'tolerance', 1e-10);"]
        for each in element.variables:
            lines.append(
                f"s.{each.name} = [{'; '.join(map(repr, each.start))}];{_note(each.about)}"
            )
        if element.position:
            lines.append(f"s.{element.position} = {element.position_start!r};  % m: position")
        states = ", ".join(f"'{each.name}'" for each in element.states)
        edges = ", ".join(f"'{each}'" for each in element.edges)
        numbers = ", ".join(str(index + 1) for index in element.start)
        lines += [
            f"s.states = {{{states}}};",
            f"s.state = [{numbers}];  % numbers of the elements' states",
            f"s.edges = {{{edges}}};",
            "s.log = zeros(0, 3);",
        ]
        return self.function("s = @_begin()", lines)

    # ------------------------------------------------------------------ for people
    def readme(self) -> str:
        name = self.name
        further = "".join(f", {each}0, {each}1" for each, _ in self.element.inputs[1:])
        return f"""\
# {self.element.title} for MATLAB and GNU Octave

- {name}.m: the function `{name}`

## How to run it

In MATLAB or Octave, in this folder:

    s = {name}();                          % at the beginning
    [s, F] = {name}(s, v0, v1, dt{further});  % force at the end of dt [N]
    s.log                                  % rows of time, element, edge
    s.edges(s.log(:, 3))                   % names of the edges

or in a shell: `octave-cli --eval "s = {name}(); [s, F] = {name}(s, 0, 0.1, 0.01{further})"`.
`help {name}` prints its arguments. GNU Octave 7.3 has run it; MATLAB itself has not.

## What it computes

{about_friction(self.element)}
In each call the inputs are straight lines. Between switches the flow is integrated by the
classical Runge-Kutta method with states and signs held. Each step is compared with two of half its
length, and halved until they agree to `s.tolerance` (1e-10) of each variable; close to zero, of a
tenth of its scale in the model. In a step the velocity changes by at most half of itself, or of
the model's velocity scale. A step in which a comparison of a guard changes is cut there by
bisection; then edges are taken until no guard is true.

## What it does not do

A comparison that changes twice within one step is not noticed; `s.longest_step` (Inf at first)
limits the steps [s]. The method is explicit, so a stiff flow costs many short steps. Motion that
slides along a surface on which a sign changes (Filippov) ends in an error.
"""


def _indented(lines: Iterable[str]) -> list[str]:
    return [f"    {line}" for line in lines]


def _one_line(text: str) -> str:
    return re.sub(r"\s+", " ", text).replace("@", "at").replace("{", "(").replace("}", ")")


def _note(text: str) -> str:
    return f"  % {_one_line(text)}" if text else ""


register(Exporter("matlab", "a function file for MATLAB and GNU Octave", matlab, WORDS))
