"""Format ``matlab``: a function file for MATLAB and GNU Octave, with located switches inside."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace

from gms_fsm.errors import ParameterError
from gms_fsm.exporters._c import TEMPLATES
from gms_fsm.exporters._names import LONGEST
from gms_fsm.exporters._readme import about_friction
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.element import NamedFriction
from gms_fsm.exporters.plain.form import (
    ByState,
    Enter,
    ForEach,
    Guards,
    SetTo,
    Statement,
    TwoWays,
    Verbatim,
)
from gms_fsm.exporters.plain.parts import Expression, Let, StateParts
from gms_fsm.exporters.plain.walker import Forms, Walker
from gms_fsm.exporters.targets._matlab_system import MatlabSystem
from gms_fsm.formats import Format, register
from gms_fsm.foundation.text import visible
from gms_fsm.language import (
    CHOICES,
    MATLAB,
    Binary,
    Call,
    Comparison,
    Name,
    Relation,
    frozen,
    names_in,
)
from gms_fsm.lowering.adapting import SHARE
from gms_fsm.lowering.printing.plan import RoughCall, both_sides
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
FORMS = Forms(
    assign="{0} = {1};",
    new="{0} = {1};",
    load="{0} = {1};",
    declare="",
    first="if {0}",
    then="elseif {0}",
    other="else",
    end="end",
    loop="for {0} = 1:{1}",
    end_loop="end",
    comment="% {0}",
    marks={"@": "at", "{": "(", "}": ")"},
)
# Functions of the file's own, in their own scope: a quantity may have the name of one they call.
DEFINED = {
    "floor": "function n = @_floor(u)\nn = floor(u);\nend\n",
    "round": """\
function n = @_round(u)
% The nearest whole number, the even one of two.
n = floor(u);
rest = u - n;
n = n + (rest > 0.5 || (rest == 0.5 && mod(n, 2) == 1));
end
""",
    "tooth": """\
function d = @_tooth(u)
% How far u is from a whole number, negative where the one below it is odd.
m = mod(u, 2);
d = min(m, max(1 - m, m - 2));
end
""",
    "noise": """\
function value = @_noise(n, seed)
% The n-th of a series of numbers that look like chance, on 32 bits.
x = mod(floor(n), 2^32);
key = mod(@_times(mod(floor(seed), 2^32), 2654435769) + 1640531527, 2^32);
for part = 1:4
    x = mod(x + key, 2^32);
    x = @_times(x, mod(2 * x + 1, 2^32));
    high = floor(x / 65536);
    x = 65536 * (x - 65536 * high) + high;
    key = mod(key + 2654435769, 2^32);
end
value = x / 2^31 - 1;
end
""",
    "times": """\
function value = @_times(a, b)
high = floor(a / 65536);
value = mod(65536 * mod(high * b, 65536) + (a - 65536 * high) * b, 2^32);
end
""",
    "choose": """\
function value = @_choose(yes, a, b)
if yes
    value = a;
else
    value = b;
end
end
""",
}
CALLED = {name: f"@_{name}({{all}})" for name in ("floor", "round", "tooth", "noise")} | {
    name: f"@_choose({{0}} {op} {{1}}, {{2}}, {{3}})" for name, op in CHOICES.items()
}


def matlab(subject: Subject) -> dict[str, str]:
    """Return a friction, or a whole system, as function files.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> text = matlab(Subject.of(model, "matlab", name="gms"))["gms.m"]
    >>> "elseif z(i) <= -s && v < -p.v_c" in text
    True
    """
    if not subject.alone:
        system = MatlabSystem(subject, WORDS, CALLED, DEFINED)
        return system.files(lambda friction: FunctionFile(friction).text())
    printer = FunctionFile(subject)
    return {
        f"{subject.name}.m": printer.text(),
        f"README-{subject.name}-matlab.md": printer.readme(),
    }


class FunctionFile:
    """Prints a friction as a function file."""

    def __init__(self, subject: Subject) -> None:
        self.name = subject.name
        self.element = NamedFriction.of(subject, WORDS, time=False)
        element, free = self.element, self.element.free
        self.part, self.t_start = free("F_i"), subject.t_start
        self.scales = scales_of(subject.contact)
        self.y, self.u, self.tau, self.p, self.i = map(free, ("y", "u", "tau", "p", "i"))
        self.state, self.held, self.found = map(free, ("state", "held", "found"))
        self.edge, self.dy = map(free, ("edge", "dy"))
        texts = {
            each.name: f"{self.p}.{each.name}" + f"({self.i})" * each.several
            for each in element.constants
        }
        own = [name for each in element.variables for name in (each.name, each.rate)]
        self.walker = Walker(
            FORMS,
            replace(MATLAB, functions={**MATLAB.functions, **CALLED}),
            texts | {name: f"{name}({self.i})" for name in own},
            [each.name for each in element.states],
            test=lambda k: f"{self.state}({self.i}) == {k + 1}",
            enter=lambda k: f"{self.state} = {k + 1};",
            count=element.n,
            index=self.i,
        )
        self.spell = self.walker.spell
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
            length=element.length,
            force=element.force,
            title=FORMS.clean(element.title),
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
        for name, each in DEFINED.items():  # earlier ones call later ones
            text += f"\n{each}" if f"@_{name}(" in text else ""
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

    def function(self, head: str, body: Iterable[Statement]) -> str:
        return "\n".join([f"function {head}", *self.walker.lines(body), "end", ""])

    def piece(self, name: str, vector: str) -> str:
        """Spell the part of the vector that a name stands for."""
        n, order = self.element.n, [each.name for each in self.element.variables]
        if name not in order:  # the position comes last
            return f"{vector}({n * len(order) + 1})"
        first = n * order.index(name)
        return f"{vector}({first + 1}:{first + n})" if n > 1 else f"{vector}({first + 1})"

    # ------------------------------------------------------------------ what is read first
    def head(self, reads: Iterable[str], held: bool = False) -> list[Statement]:
        """Assign what elements read: inputs, variables, and what they share."""
        element, u = self.element, self.u
        shared = element.needed(reads, per_element=False)
        inside = element.needed(reads, per_element=True)
        names = {*reads}.union(*(each.value.names for each in (*shared, *inside)))
        lines = {name: f"@_line({u}.{name}, {u}, {self.tau})" for name, _ in element.inputs}
        lines |= {"t": f"{u}.t + {self.tau}"}
        lines |= {each.name: self.piece(each.name, self.y) for each in element.variables}
        lines |= {name: self.piece(name, self.y) for name in filter(None, [element.position])}
        read = [Verbatim(f"{name} = {text};") for name, text in lines.items() if name in names]
        return [*read, *self.lets(shared, held)]

    def lets(self, lets: Iterable[Let], held: bool) -> list[Statement]:
        return [line for each in lets for line in self.assign(each.name, each.value, held)]

    def assign(self, target: str, value: Expression, held: bool) -> list[Statement]:
        """Assign a value, with held signs or with those of now."""
        if not held:
            return [SetTo(target, value.tree)]
        return [*map(self.call, value.calls), SetTo(target, value.smooth)]

    def call(self, rough: RoughCall) -> Statement:
        """Assign a call that has a corner or a jump, with the sign that is held."""
        sign, _ = self.signs[rough.turning]
        match value := frozen(rough.call, Name(sign)):
            case Call(function, (_, _, yes, no)):
                first, other = SetTo(rough.name, yes), SetTo(rough.name, no)
                return TwoWays(f"{sign} {CHOICES[function]} 0", (first,), (other,))
        return SetTo(rough.name, value)

    def loop(
        self,
        reads: Sequence[frozenset[str]],
        branches: Sequence[Sequence[Statement]],
        *,
        held: bool = False,
        after: Sequence[Statement] = (),
    ) -> list[Statement]:
        """Write a loop over the elements, with a branch for each state."""
        if not any(branches):
            return []
        before, inside = self.element.placed(reads)
        rows = tuple(
            (*self.lets(lets, held), *lines) if lines else ()
            for lets, lines in zip(inside, branches, strict=True)
        )
        return [ForEach((*self.lets(before, held), ByState(rows), *after))]

    # ------------------------------------------------------------------ the functions
    def rates(
        self, state: StateParts, held: bool, wanted: frozenset[str] | None = None
    ) -> list[Statement]:
        return [
            line
            for each in self.element.variables
            if wanted is None or each.rate in wanted
            for line in self.assign(each.rate, state.rates[each.name], held)
        ]

    def zeros(self, rates: Iterable[str]) -> list[Statement]:
        return [Verbatim(f"{rate} = zeros({self.element.n}, 1);") for rate in rates]

    def flow(self) -> list[Statement]:
        element = self.element
        reads = [
            frozenset[str]().union(*(rate.names for rate in state.rates.values()))
            for state in element.states
        ]
        every = frozenset[str]().union(*reads)
        v, _ = element.inputs[0]
        rates = [each.rate for each in element.variables]
        parts = rates + [v] * bool(element.position)
        return [
            Verbatim("% The rates of change, states and signs held."),
            *self.head(every | ({v} if element.position else set()), held=True),
            *self.zeros(rates),
            *self.loop(reads, [self.rates(e, held=True) for e in element.states], held=True),
            Verbatim(f"{self.dy} = [{'; '.join(parts)}];"),
        ]

    def force(self) -> list[Statement]:
        element = self.element
        reads, rows = list[frozenset[str]](), list[list[Statement]]()
        for state in element.states:
            wanted = state.force.names
            used = [state.rates[e.name].names for e in element.variables if e.rate in wanted]
            reads.append(wanted.union(*used))
            row = self.rates(state, held=False, wanted=wanted)
            rows.append([*row, *self.assign(self.part, state.force, held=False)])
        every = element.total.names.union(*reads)
        added = SetTo("F", Binary("+", Name("F"), Name(self.part)))
        return [
            Verbatim("% The force of all elements."),
            *self.head(every),
            *self.zeros(each.rate for each in element.variables if each.rate in every),
            Verbatim("F = 0;"),
            *self.loop(reads, rows, after=[added]),
            SetTo("F", element.total.tree),
        ]

    def guards(self) -> list[Statement]:
        states = self.element.states
        reads = [
            frozenset[str]().union(*(names_in(edge.guard) for edge in state.edges))
            for state in states
        ]
        rows: list[list[Statement]] = [
            [
                Guards(
                    tuple(
                        (edge, (Verbatim(f"{self.edge}({self.i}) = {edge.number + 1};"),))
                        for edge in state.edges
                    )
                )
            ]
            * bool(state.edges)
            for state in states
        ]
        return [
            Verbatim("% For each element its first edge whose guard is true, or 0."),
            *self.head(frozenset[str]().union(*reads)),
            Verbatim(f"{self.edge} = zeros(1, {self.element.n});"),
            *self.loop(reads, rows),
        ]

    def take(self) -> list[Statement]:
        element = self.element
        edges = [edge for state in element.states for edge in state.edges]
        reads = [names_in(tree) for edge in edges for _, tree in edge.steps]
        every = frozenset[str]().union(*reads)
        changed = [
            each.name
            for each in element.variables
            if any(each.name == name for edge in edges for name, _ in edge.steps)
        ]
        lines: list[Statement] = [Verbatim("% Take an edge of an element.")]
        lines += self.head(every | {*changed})
        lines += self.lets(element.needed(every, per_element=True), held=False)
        if not edges:
            return lines
        lines.append(Verbatim(f"switch {self.edge}"))
        for edge in sorted(edges, key=lambda each: each.number):
            lines.append(Verbatim(f"    case {edge.number + 1}  % {edge.name}"))
            steps = (SetTo(name, tree) for name, tree in edge.steps)
            row: list[Statement] = [*steps, Enter(edge.target)]
            lines += [Verbatim(f"        {line}") for line in self.walker.lines(row)]
        lines.append(Verbatim("end"))
        return lines + [Verbatim(f"{self.piece(name, self.y)} = {name};") for name in changed]

    def compare(self) -> list[Statement]:
        """Print the comparisons in which guards, corners and jumps can change."""
        element = self.element
        rows: list[list[Statement]] = []
        reads: list[frozenset[str]] = []
        for state in element.states:
            found = [each for edge in state.edges for each in edge.comparisons]
            found += [each for u in state.corners for each in both_sides(u)]
            relations = _relations(dict.fromkeys(found))
            reads.append(frozenset[str]().union(*map(names_in, relations)))
            rows.append(self.collected(relations))
        outer = _relations(each for u in element.corners for each in both_sides(u))
        every = frozenset[str]().union(*reads, *map(names_in, outer))
        return [
            Verbatim("% Comparisons: while none of them changes, no guard and no sign does."),
            *self.head(every),
            Verbatim(f"{self.found} = false(1, 0);"),
            *self.collected(outer),
            *self.loop(reads, rows),
        ]

    def collected(self, relations: Iterable[Relation]) -> list[Statement]:
        texts = ", ".join(f"({self.spell(each)})" for each in relations)
        return [Verbatim(f"{self.found} = [{self.found}, {texts}];")] if texts else []

    def sign(self) -> list[Statement]:
        """Print the signs that an arc begins with."""
        reads = frozenset[str]().union(*(names_in(u) for u in self.signs))
        lines: dict[bool, list[Statement]] = {True: [], False: []}
        for u, (text, own) in self.signs.items():
            lines[own].append(Verbatim(f"{text} = sign({self.spell(u)});"))
        inner = [names_in(u) for u, (_, own) in self.signs.items() if own]
        needed = self.element.needed(frozenset[str]().union(*inner), per_element=True)
        body = ForEach((*self.lets(needed, held=False), *lines[True]))
        return [
            Verbatim("% Signs, held until they change."),
            *self.head(reads),
            Verbatim(f"{self.held} = struct();"),
            *lines[False],
            *([body] if inner else []),
        ]

    def numbers(self) -> str:
        lines = ["p = struct();"]
        for each in self.element.constants:
            value = each.value
            text = f"[{', '.join(map(repr, value))}]" if isinstance(value, tuple) else repr(value)
            lines.append(f"p.{each.name} = {text};{FORMS.note(each.about)}")
        return self.function("p = @_numbers()", map(Verbatim, lines))

    def begin(self) -> str:
        element, start = self.element, repr(self.t_start)
        lines = [f"s = struct('t', {start}, 'longest_step', Inf, 'tolerance', 1e-10);"]
        for each in element.variables:
            values = "; ".join(map(repr, each.start))
            lines.append(f"s.{each.name} = [{values}];{FORMS.note(each.about)}")
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
        return self.function("s = @_begin()", map(Verbatim, lines))

    # ------------------------------------------------------------------ for people
    def readme(self) -> str:
        name = self.name
        further = "".join(f", {each}0, {each}1" for each, _ in self.element.inputs[1:])
        return f"""\
# {visible(self.element.title)} for MATLAB and GNU Octave

- {name}.m: the function `{name}`

## How to run it

In MATLAB or Octave, in this folder:

    s = {name}();                          % at the beginning
    [s, F] = {name}(s, v0, v1, dt{further});  % force at the end of dt [{self.element.force}]
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


def _relations(found: Iterable[Comparison]) -> list[Relation]:
    return [Relation(">" if e.strict else ">=", e.left, e.right) for e in found]


register(
    Format(
        "matlab",
        "friction",
        "a function file for MATLAB, Simulink and GNU Octave",
        "gms-fsm",
        matlab,
        words=WORDS,
        takes=("initial", "t_start"),
        whole=True,
    )
)
