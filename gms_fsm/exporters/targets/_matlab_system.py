"""A whole system as a function file for MATLAB and GNU Octave, around those of its frictions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace

from gms_fsm.exporters._names import check_functions, identifier
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.plain.whole import WholeSystem, safe_name
from gms_fsm.foundation.text import visible
from gms_fsm.language import MATLAB, Node, Number, spell

# What the functions of the file call their own variables.
OWN = frozenset(
    [
        "log",
        "p",
        "y",
        "w",
        "F",
        "s",
        "dy",
        "rate",
        "rate_new",
        "y_new",
        "y_next",
        "F_new",
        "steps",
        "count",
        "k",
        "t",
        "t_end",
        "dt",
        "given",
        "moved",
    ]
)
FUNCTIONS = ("rates", "inputs", "advance", "numbers")  # of the file
MAIN = """\
function log = @(t_end, dt{arguments})
%@  {title}
%
%   log = @(t_end, dt{arguments}) runs the system from t = {t_start} to t_end in steps of dt [s].
%   log.t and one column for each state, value and force have a row for every step; they are
%   allocated at the beginning. log.switches.NAME has a row for every switch of a contact: time [s],
%   element, edge.{inputs}
%
%   In each step the bodies move by the trapezoidal rule, whose error falls with the square of dt;
%   during it each contact has a velocity on a straight line, and its switches are located.
p = @_numbers();
given = {{{given}}};
count = round((t_end - {t_start}) / dt);
log = struct('t', {t_start} + dt * (0:count).');
{allocate}
y = [{start}];
w = [{values}];
s = {{{begin}}};
for j = 1:{contacts}
    s{{j}}.tolerance = 1e-8;  % far below the error of a step of the bodies
end
F = zeros({contacts}, 1);
{check}for k = 0:count
    t = log.t(k + 1);
{tick}    moved = @_inputs(t, y, w, p, given);
    for j = 1:{contacts}  % forces at t: signals and samplers may have jumped
        [s{{j}}, F(j)] = @_advance(j, s{{j}}, moved{{j}}, moved{{j}}, 0);
    end
{write}
    if k == count
        break
    end
    rate = @_rates(t, y, w, F, p, given);
    y_new = y + dt * rate;
    F_new = F;
    s_new = s;
    steps = 0;
    while true  % until the end of the step is consistent with itself
        ahead = @_inputs(t + dt, y_new, w, p, given);
        for j = 1:{contacts}
            [s_new{{j}}, F_new(j)] = @_advance(j, s{{j}}, moved{{j}}, ahead{{j}}, dt);
        end
        y_next = y + dt / 2 * (rate + @_rates(t + dt, y_new, w, F_new, p, given));
        done = all(abs(y_next - y_new) <= 1e-10 * abs(y_next) + 1e-15);
        y_new = y_next;
        steps = steps + 1;
        if done
            break
        elseif steps == 100
            error('@:step', 'the step from t = %g s does not converge: choose a shorter dt', t);
        end
    end
    y = y_new;
    F = F_new;
    s = s_new;
end
{close}end
"""


class MatlabSystem:
    """Prints a system."""

    def __init__(
        self,
        subject: Subject,
        words: Iterable[str],
        functions: Mapping[str, str],
        defined: Mapping[str, str],
    ) -> None:
        self.defined = defined
        self.name = identifier(subject.name, words, f"name {subject.name!r}")
        self.whole = whole = WholeSystem.of(subject, {*words, *OWN})
        ticks = {f"tick{i}" for i in range(1, len(whole.samplers) + 1)}
        for each in whole.contacts:  # their files have names beside those of the own functions
            identifier(each.name, {*defined, *FUNCTIONS, *ticks}, f"contact {each.name!r}")
        self.dialect = replace(MATLAB, functions={**MATLAB.functions, **functions})
        self.texts = {name: f"p.{name}" for name in whole.numbers}
        self.texts |= {each.force: safe_name(each.force) for each in whole.contacts}
        trees: list[Node] = [tree for row in whole.rates.values() for tree in row]
        trees += [tree for _, tree in whole.definitions]
        trees += [tree for rows in whole.updates.values() for tree in rows.values()]
        check_functions(trees, self.dialect, f"system {subject.title!r}", "MATLAB")
        self.states = [*whole.rates]
        self.values = [name for each in whole.samplers for name in each.updates]

    def spell(self, node: Node, more: Mapping[str, str] | None = None) -> str:
        return spell(node, self.dialect, {**self.texts, **(more or {})})

    def text(self) -> str:
        """Return the file; functions of its own begin with ``@``, which stands for its name."""
        whole, t_start = self.whole, repr(self.whole.subject.t_start)
        columns = [*self.states, *self.values, *(safe_name(u.force) for u in whole.contacts)]
        write = [f"    log.{name}(k + 1) = y({i});" for i, name in enumerate(self.states, 1)]
        write += [f"    log.{name}(k + 1) = w({i});" for i, name in enumerate(self.values, 1)]
        write += [
            f"    log.{safe_name(each.force)}(k + 1) = F({i});"
            for i, each in enumerate(whole.contacts, 1)
        ]
        arguments = "".join(f", {name}" for name in whole.inputs)
        main = MAIN.format(
            arguments=arguments,
            title=visible(whole.subject.title).replace("@", "at"),
            t_start=t_start,
            inputs="".join(
                f"\n%   {u} is a function of t, such as @(t) 0." for u in whole.inputs
            ).replace("@(t)", "AT(t)"),
            given=", ".join(whole.inputs),
            allocate="\n".join(f"log.{name} = zeros(count + 1, 1);" for name in columns),
            start="; ".join(repr(whole.start[name]) for name in self.states),
            values="; ".join(repr(whole.start[name]) for name in self.values),
            begin=", ".join(f"{each.friction.name}()" for each in whole.contacts),
            contacts=len(whole.contacts),
            check="".join(self.checks()),
            tick="".join(self.ticks()),
            write="\n".join(write),
            close="".join(
                f"log.switches.{each.name} = s{{{i}}}.log;\n"
                for i, each in enumerate(whole.contacts, 1)
            ),
        )
        text = "\n".join([main, *self.functions()])
        for name, each in self.defined.items():  # earlier ones call later ones
            text += f"\n{each}" if f"@_{name}(" in text else ""
        return text.replace("@", self.name).replace("AT(t)", "@(t)")

    # ------------------------------------------------------------------ samplers
    def checks(self) -> Iterator[str]:
        for each in self.whole.samplers:
            for what, length in (("period", each.period), ("offset", each.offset)):
                text = f"abs({length!r} / dt - round({length!r} / dt)) > 1e-9"
                why = f"the {what} of {each.name} is no multiple of dt"
                yield f"if {text}\n    error('@:dt', '{why}');\nend\n"

    def ticks(self) -> Iterator[str]:
        for i, each in enumerate(self.whole.samplers, 1):
            first, period = f"round({each.offset!r} / dt)", f"round({each.period!r} / dt)"
            yield f"    if k >= {first} && mod(k - {first}, {period}) == 0  % {each.name}\n"
            yield f"        w = @_tick{i}(t, y, w, F, p, given);\n    end\n"

    # ------------------------------------------------------------------ functions
    def function(self, head: str, lines: Iterable[str]) -> str:
        return "\n".join([f"function {head}", *self.unpacked(), *lines, "end", ""])

    def unpacked(self) -> Iterator[str]:
        whole = self.whole
        yield from (f"{name} = y({i});" for i, name in enumerate(self.states, 1))
        yield from (f"{name} = w({i});" for i, name in enumerate(self.values, 1))
        yield from (f"{name} = given{{{i}}}(t);" for i, name in enumerate(whole.inputs, 1))
        yield from (f"{name} = {self.spell(tree)};" for name, tree in whole.definitions)

    def functions(self) -> Iterator[str]:
        whole = self.whole
        forces = [f"{safe_name(each.force)} = F({i});" for i, each in enumerate(whole.contacts, 1)]
        rows = []
        for mass, rate in whole.rates.values():
            text = self.spell(rate)
            rows.append(text if mass == Number(1.0) else f"({text}) / ({self.spell(mass)})")
        yield self.function(
            "dy = @_rates(t, y, w, F, p, given)", [*forces, f"dy = [{'; '.join(rows)}];"]
        )
        vectors = [
            f"[{', '.join(self.spell(tree) for _, tree in each.inputs)}]" for each in whole.contacts
        ]
        yield self.function(
            "moved = @_inputs(t, y, w, p, given)", [f"moved = {{{', '.join(vectors)}}};"]
        )
        for i, each in enumerate(whole.samplers, 1):
            more = {"period": repr(each.period)}
            lines = [
                f"{name} = {self.spell(tree, more)};"
                for name, tree in whole.updates[each.name].items()
            ]
            lines.append(f"w = [{'; '.join(self.values)}];")
            yield self.function(f"w = @_tick{i}(t, y, w, F, p, given)", [*forces, *lines])
        yield "\n".join(["function [s, F] = @_advance(j, s, u0, u1, dt)", *self.calls(), "end", ""])
        numbers = [f"p.{name} = {value!r};" for name, value in whole.numbers.items()]
        yield "\n".join(["function p = @_numbers()", "p = struct();", *numbers, "end", ""])

    def calls(self) -> Iterator[str]:
        yield "switch j"
        for i, each in enumerate(self.whole.contacts, 1):
            further = "".join(f", u0({k}), u1({k})" for k in range(2, len(each.inputs) + 1))
            yield f"    case {i}"
            yield f"        [s, F] = {each.friction.name}(s, u0(1), u1(1), dt{further});"
        yield "end"

    # ------------------------------------------------------------------ all files
    def files(self, friction: Callable[[Subject], str]) -> dict[str, str]:
        """Return the system's file, those of its frictions, and a README."""
        found = {f"{self.name}.m": self.text()}
        found |= {f"{u.friction.name}.m": friction(u.friction) for u in self.whole.contacts}
        return {**found, f"README-{self.name}-matlab.md": self.readme()}

    def readme(self) -> str:
        name, whole = self.name, self.whole
        frictions = "".join(
            f"- {each.friction.name}.m: the friction of the contact {each.name}\n"
            for each in whole.contacts
        )
        arguments = "".join(f", {each}" for each in whole.inputs)
        return f"""\
# {visible(whole.subject.title)} for MATLAB and GNU Octave

- {name}.m: the function `{name}`, a run of the whole system
{frictions}
## How to run it

In MATLAB or Octave, in this folder:

    log = {name}(1, 1e-3{arguments});       % to 1 s in steps of 1 ms
    plot(log.t, log.{self.states[0]})

`help {name}` says what is in the log. GNU Octave 7.3 has run it; MATLAB itself has not.

## What it computes

In each step of dt the bodies move by the trapezoidal rule, with the forces of the contacts at both
ends; a contact has a velocity on a straight line, and its switches are located in it. The error
falls with the square of dt. Samplers tick at multiples of dt.

## What it does not do

It has no step-size control. A step that does not converge, because dt is too long for the stiffness
or the damping of the system, ends in an error.
"""
