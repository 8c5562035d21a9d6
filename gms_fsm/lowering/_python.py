"""Printing of a program's plan as Python text: if-else code to read and step through."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from gms_fsm.language import (
    Binary,
    Comparison,
    Name,
    Negative,
    Node,
    Number,
    Requirement,
    Split,
    spell,
    split,
)
from gms_fsm.lowering import _reads as reads
from gms_fsm.lowering._plan import Edge, Flow, Gradient, Input, Plan, RoughCall, both_sides
from gms_fsm.lowering._reads import Reads, Signs
from integrators import LIVE

__all__ = ["FUNCTIONS", "python"]

FUNCTIONS = ("flow", "flow_live", "switch", "act", "observe", "normal", "arm", "margins")


def python(plan: Plan) -> str:
    """Return a program as Python text.

    Parameters
    ----------
    plan : Plan
        The plan of the program.

    Returns
    -------
    str
        The functions listed in `FUNCTIONS`, after the constants for states and edges.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> from gms_fsm.lowering._plan import plan_of
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> print(python(plan_of(model, Prescribed("0.1*t"))).splitlines()[3])
    STICK, SLIP = 0, 1  # states
    """
    writer = _Writer(plan)
    lines = [
        f"# {_one_line(plan.title)}",
        "# Generated from the chart; parameters are arguments, so one text serves all values.",
        "",
        f"{_numbered(plan.names.states.values())}  # states",
    ]
    if plan.edges:
        lines.append(f"{_numbered(plan.names.edges.values())}  # edges")
    for function in (
        writer.switch(),
        writer.act(),
        writer.flow(),
        writer.flow_live(),
        writer.observe(),
        writer.normal(),
        writer.arm(),
        writer.margins(),
    ):
        lines += ["", "", *function]
    return "\n".join(lines) + "\n"


class _Writer:
    """Writes the functions of a plan as lines."""

    def __init__(self, plan: Plan) -> None:
        self.plan, self.names, self.layout = plan, plan.names, plan.layout

    # ------------------------------------------------------------------ the functions
    def switch(self) -> list[str]:
        branches = {}
        for state in self.names.states:
            lines: list[str] = []
            for edge in self.plan.leaving(state):
                word = "elif" if lines else "if"
                constant = self.names.edges[edge.name]
                lines += [
                    f"{word} {self.spell(edge.guard)}:",
                    f"    edge = {constant}  # {state} -> {edge.target}",
                ]
            branches[state] = lines
        inner = self.by_state(branches) if self.plan.edges else []
        found = reads.of_switch(self.plan)
        return self.function(
            "switch(t, y, mode, p, out)",
            "out[i] = the first edge of element i whose guard holds, or -1.",
            self.elements(found, ["edge = -1", *inner, "out[i] = edge"]),
            found,
        )

    def act(self) -> list[str]:
        found = reads.of_act(self.plan)
        lines: list[str] = []
        for edge in self.plan.edges:
            word = "elif" if lines else "if"
            lines += [
                f"{word} edge == {self.names.edges[edge.name]}:",
                *_indented(self.taken(edge)),
            ]
        body = [*self.element_values(found), *lines] or ["pass  # the chart has no edges"]
        return self.function(
            "act(edge, i, t, y, mode, p)", "Take an edge of element i.", body, found
        )

    def taken(self, edge: Edge) -> list[str]:
        """Write the effect of taking an edge."""
        lines = []
        for variable, value in edge.steps:
            local, place = self.names.local[variable], self.layout.y.text(variable)
            lines += [f"{local} = {self.spell(value)}", f"y[{place}] = {local}"]
        return [*lines, f"mode[i] = {self.names.states[edge.target]}"]

    def flow(self) -> list[str]:
        return self.function(
            "flow(t, y, mode, held, p, dy)",
            "dy = dy/dt, all states and all signs frozen.",
            self.rates("held"),
            reads.of_flow(self.plan, "held"),
            signs="held",
        )

    def flow_live(self) -> list[str]:
        return self.function(
            "flow_live(t, y, mode, held, p, dy)",
            "dy = dy/dt, all states frozen, corners and jumps evaluated live.",
            self.rates("live"),
            reads.of_flow(self.plan, "live"),
        )

    def rates(self, signs: Signs) -> list[str]:
        """Write the body of the flow."""
        flow, place = self.plan.flow, self.layout.y.text
        inner = self.by_state(self.flow_branches(flow, signs))
        if flow.by_state:
            inner.append("F += F_i")
        elif flow.force is not None:
            inner.append(f"F += {self.spell(flow.force)}  # (3)")
        inner += [f"dy[{place(v)}] = {self.names.local[f'd{v}']}" for v in self.plan.variables]
        ends = [f"dy[{place('x')}] = v"]
        if flow.acceleration is not None:
            ends.insert(0, "F += sigma_2 * v  # (4)")
            ends.append(f"dy[{place('v')}] = {self.spell(flow.acceleration)}")
        return [
            *self.rough_lines(flow.calls, signs),
            *([] if self.plan.prescribed else ["F = 0.0"]),
            *self.elements(reads.of_flow(self.plan, signs), inner),
            *ends,
        ]

    def flow_branches(self, flow: Flow, signs: Signs) -> dict[str, list[str]]:
        """Write the rates for each state, and the force if it depends on the state."""
        branches = {}
        for each in flow.states:
            lines = self.rough_lines(each.calls, signs)
            for variable, rate in each.rates.items():
                lines.append(f"{self.names.local[f'd{variable}']} = {self.spell(rate)}")
            if each.force is not None:
                lines.append(f"F_i = {self.spell(each.force)}  # (3)")
            branches[each.state] = lines
        return branches

    def observe(self) -> list[str]:
        flow, place = self.plan.observed, self.layout.observed.text
        without = "nan" if self.plan.curve is None else "weight[i] * S"
        found = reads.of_observe(self.plan)
        inner = [
            *self.by_state(self.flow_branches(flow, "given")),
            *([] if flow.force is None else [f"F_i = {self.spell(flow.force)}  # (3)"]),
            "F += F_i",
            f"out[{place('s')}] = {'s' if self.plan.threshold else without}",
            f"out[{place('F_elements')}] = F_i",
            *(
                f"out[{place(f'd{variable}')}] = {self.names.local[f'd{variable}']}"
                for variable in self.plan.variables
            ),
        ]
        body = [
            *self.rough_lines(flow.calls, "given"),
            "F = 0.0",
            *self.elements(found, inner),
            f"out[{place('v')}] = v",
            f"out[{place('F')}] = F + sigma_2 * v  # (4)",
        ]
        return self.function(
            "observe(t, y, mode, held, p, out)",
            f"out = v, F, then for all elements s, F_i and the rates; sign {LIVE} means live.",
            body,
            found,
        )

    def normal(self) -> list[str]:
        lines: list[str] = []
        for each in self.plan.gradients:
            word, inner = "elif" if lines else "if", self.gradient(each)
            asked, element = self.plan.surfaces.membership_text(each.surface, "surface")
            lines.append(f"{word} {asked}:  # {self.spell(each.surface)}")
            if element:
                first = self.element_values(reads.of_gradient(self.plan, each))
                inner = [f"i = {element}", *first, *inner]
            lines += _indented(inner)
        clear = [f"for j in range({self.layout.y.size_text(1)}):", "    out[j] = 0.0"]
        return self.function(
            "normal(surface, t, y, mode, p, out)",
            "out = the gradient of a surface's value over y, then its rate in t.",
            [*clear, *lines] if lines else ["pass"],
            reads.of_normal(self.plan),
        )

    def gradient(self, gradient: Gradient) -> list[str]:
        """Write the gradient of a value over y, and its rate in t."""
        place = self.layout.y.text
        lines = [
            f"out[{place(name)}] = {self.spell(value)}" for name, value in gradient.by_state.items()
        ]
        by_v = [] if gradient.by_v is None else [self.spell(gradient.by_v)]
        if gradient.by_s is not None:
            assert self.plan.curve_slope is not None  # charts with s have a curve
            lines.append(f"dS = {spell(self.plan.curve_slope)}")
            by_v.append(f"({self.spell(gradient.by_s)}) * weight[i] * dS")
        rates = [] if gradient.by_t is None else [self.spell(gradient.by_t)]
        slopes = {each.name: self.signal_slope(each) for each in self.plan.inputs}
        if by_v and not self.plan.prescribed:
            lines.append(f"out[{place('v')}] = {' + '.join(by_v)}")
        elif by_v:
            rates.append(f"({' + '.join(by_v)}) * {slopes['v']}")
        rates += [
            f"({self.spell(value)}) * {slopes[name]}" for name, value in gradient.by_signal.items()
        ]
        behind = self.layout.y.size_text()
        return lines + ([f"out[{behind}] = {' + '.join(rates)}"] if rates else [])

    def arm(self) -> list[str]:
        held = self.plan.held
        body = [self.watch(relation) for relation in self.plan.always]
        body += [f"held[{held.text(u)}] = sgn({self.spell(u)})" for u in held.shared]
        branches = {}
        for state in self.names.states:
            lines = []
            for u in self.plan.rough[state]:
                if u in held.own:
                    lines.append(f"held[{held.text(u)}] = sgn({self.spell(u)})")
                lines += [self.watch(relation) for relation in both_sides(u)]
            for edge in self.plan.leaving(state):
                lines.append(f"# {edge.name}: {self.spell(edge.guard)}")
                lines += self.witness(split(edge.guard))
            branches[state] = lines
        found = reads.of_arm(self.plan)
        if any(branches.values()):
            body += self.elements(found, self.by_state(branches))
        return self.function(
            "arm(t, y, mode, p, held, watch)",
            "Freeze the signs and mark the comparisons that keep every false guard false.",
            body or ["pass"],
            found,
        )

    def watch(self, relation: Comparison) -> str:
        return f"watch[{self.plan.relations.text(relation)}] = 1"

    def witness(self, part: Split) -> list[str]:
        """Write: if this part is false, watch the comparison that keeps it false."""
        if isinstance(part, Requirement):
            # Not the opposite comparison: for NaN neither is true, but it must be watched.
            return [f"if not {self.spell(part.relation)}:", f"    {self.watch(part.comparison)}"]
        word, parts = part
        if word == "either":
            return [line for each in parts for line in self.witness(each)]
        lines: list[str] = []
        for each in parts:
            other = "el" if lines else ""
            if isinstance(each, Requirement):
                first, *rest = self.witness(each)
                lines += [other + first, *rest]
            else:
                lines += [f"{other}if not ({self.truth(each)}):", *_indented(self.witness(each))]
        return lines

    def truth(self, part: Split) -> str:
        """Spell a split condition, fully parenthesized, since only machines read it."""
        if isinstance(part, Requirement):
            return self.spell(part.relation)
        word, parts = part
        return (" and " if word == "both" else " or ").join(
            self.truth(q) if isinstance(q, Requirement) else f"({self.truth(q)})" for q in parts
        )

    def margins(self) -> list[str]:
        relations, found = self.plan.relations, reads.of_margins(self.plan)
        body = [line for each in relations.shared for line in self.margin(each)]
        own = [line for each in relations.own for line in self.margin(each)]
        return self.function(
            "margins(t, y, mode, p, watch, out)",
            "For each watched comparison, left - right.",
            body + (self.elements(found, own) if own else []) or ["pass"],
            found,
        )

    def margin(self, comparison: Comparison) -> list[str]:
        index = self.plan.relations.text(comparison)
        margin = self.spell(comparison.left)
        if comparison.right != Number(0.0):
            right = self.spell(comparison.right)
            simple = isinstance(comparison.right, Name | Number | Negative)
            margin = f"{margin} - {right if simple else f'({right})'}"
        return [f"if watch[{index}]:", f"    out[{index}] = {margin}"]

    # ------------------------------------------------------------------ building blocks
    def spell(self, node: Node) -> str:
        return spell(node, rename=self.names.texts)

    def function(
        self, signature: str, doc: str, body: list[str], found: Reads, *, signs: Signs = "live"
    ) -> list[str]:
        """Assemble a function: signature, the values its body reads, the body."""
        head = reads.head_of(self.plan, found, signs)
        lines = ["shared, own, tables = p"] if head.arguments else []
        lines += [f"{name} = shared[{j}]" for name, j in head.shared]
        lines += [f"{name} = own[{j}]" for name, j in head.own]
        if head.size:
            lines.append("n = len(own[0])")  # mode also has the surfaces' flags, after the elements
        for signal in head.inputs:
            lines += self.signal_lines(signal, signs)
        if head.x:
            lines.append(f"x = y[{self.layout.y.text('x')}]")
        if head.v:
            lines.append(f"v = y[{self.layout.y.text('v')}]")
        if head.curve and self.plan.curve is not None:
            lines.append(f"S = {spell(self.plan.curve)}  # (2)")
        return [f"def {signature}:", f'    """{doc}"""', *_indented([*lines, *body])]

    def elements(self, found: Reads, lines: list[str]) -> list[str]:
        """Write a loop over the elements."""
        return ["for i in range(n):", *_indented([*self.element_values(found), *lines])]

    def element_values(self, found: Reads) -> list[str]:
        """Assign the element's variables and threshold, as far as they are read."""
        return [
            "s = weight[i] * S"
            if name == "s"
            else f"{self.names.local[name]} = y[{self.layout.y.text(name)}]"
            for name in reads.of_element(self.plan, found)
        ]

    def by_state(self, branches: Mapping[str, list[str]]) -> list[str]:
        """Write an if-else over the element's state."""
        filled = [(self.names.states[state], body or ["pass"]) for state, body in branches.items()]
        if len(filled) == 1:
            return next(iter(branches.values()))
        lines = []
        for number, (constant, body) in enumerate(filled):
            word = "if" if number == 0 else "elif"
            last = number == len(filled) - 1
            head = f"else:  # {constant}" if last else f"{word} mode[i] == {constant}:"
            lines += [head, *_indented(body)]
        return lines

    def signal_lines(self, signal: Input, signs: Signs) -> list[str]:
        if signal.formula is not None:
            value = f"{signal.name} = {spell(signal.formula)}"
            return [*self.rough_lines(signal.calls, signs), value]
        if signal.tabled:
            return [f"{signal.name} = piecewise_linear(t, {self.table(signal)})"]
        return [f"{signal.name} = {signal.name}_signal(t)"]

    def signal_slope(self, signal: Input) -> str:
        """Spell the rate of a signal."""
        if signal.tabled:
            return f"piecewise_slope(t, {self.table(signal)})"
        return "" if signal.slope is None else f"({spell(signal.slope)})"

    def table(self, signal: Input) -> str:
        """Spell the table of a signal: its times and values."""
        places = (self.plan.tables.text((signal.name, column)) for column in ("times", "values"))
        return ", ".join(f"tables[{place}]" for place in places)

    def rough_lines(self, calls: Iterable[RoughCall], signs: Signs) -> list[str]:
        """Assign rough calls."""
        return [f"{each.name} = {self.rough_call(each, signs)}" for each in calls]

    def rough_call(self, rough: RoughCall, signs: Signs) -> str:
        """Spell a rough call, whose sign is frozen, live or given."""
        call, live = rough.call, self.spell(rough.call)
        if signs == "live":
            return live
        sign = f"held[{self.plan.held.text(rough.turning)}]"
        first = self.spell(call.arguments[0])
        match call.function:
            case "sgn":
                value = sign
            case "abs":
                value = self.spell(Binary("*", Name(sign), call.arguments[0]))
            case "min":
                value = f"{first} if {sign} <= 0.0 else {self.spell(call.arguments[1])}"
            case _:
                value = f"{first} if {sign} >= 0.0 else {self.spell(call.arguments[1])}"
        return f"{live} if {sign} == {LIVE} else {value}" if signs == "given" else value


def _indented(lines: Iterable[str]) -> list[str]:
    return ["    " + line for line in lines]


def _numbered(constants: Iterable[str]) -> str:
    """Write an assignment of the numbers from 0 to constants."""
    names = [*constants]
    return f"{', '.join(names)} = {', '.join(str(number) for number in range(len(names)))}"


def _one_line(text: str) -> str:
    """Return text as one printable line, for use in a comment."""
    return "".join(c if c.isprintable() else " " for c in text)
