"""The generated program: a chart on a rig, lowered to if-else text one can read and step through.

This is the paper's Fig. 2c made from its Fig. 2b: one reader of the chart, with no rule of its own.
The text holds no numbers of the user's; parameters arrive as arguments, so that one text serves
every parameter set and every number of elements, in Python and, compiled, elsewhere.

The functions of a program
--------------------------
``flow``       dy/dt with every state frozen and every sign held (located crossings)
``flow_live``  the same with sgn, abs, min, max as they stand (for guards looked at once a step)
``switch``     for each element the first edge whose guard holds, or -1
``act``        take an edge: its assignments and the new state
``observe``    v, F, and per element s, F_i, dz; signs as given, or as they stand
``normal``     the gradient of a surface that a motion can slide on (see `integrators.sliding`)
``arm``        which comparisons to watch until the next stop, and the signs to hold
``margins``    the watched comparisons as numbers that change sign where the comparison does

What ``arm`` watches: a guard that is false stays false as long as one false comparison of it (of
each arm, for ``or``) stays false. The first one in the text is the witness; when it turns true the
driver stops, asks, and arms again. So nothing is watched that cannot change a state: not z - s
while slipping toward it, not v_c while sticking below s.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import integrators
from gms_fsm.charts.chart import RESERVED
from gms_fsm.charts.parameters import as_floats
from gms_fsm.errors import SignalError
from gms_fsm.language import (
    Binary,
    Call,
    Comparison,
    Literal,
    Name,
    Negative,
    Node,
    Number,
    Split,
    Value,
    comparisons,
    derivative,
    names_in,
    parse_value,
    renamed,
    rough_points,
    spell,
    split,
    substitute,
    turning_inside,
)
from gms_fsm.lowering._generated import ieee, load, load_careful
from gms_fsm.lowering.layout import Layout, Places
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.signals import (
    Corners,
    Formula,
    Function,
    Signal,
    piecewise_linear,
    piecewise_slope,
)
from integrators import LIVE

__all__ = ["Arguments", "Program", "arguments", "equations", "lower"]

Arguments = tuple[list[float], list[list[float]], list[list[float]]]


@dataclass(frozen=True, eq=False)
class Program:
    """A model on a rig as generated functions and the arrays they take.

    Parameters
    ----------
    source : str
        The text of all functions.
    functions : mapping of str to callable
        By name, see the module's text.
    ieee : mapping of str to callable
        The same functions; they compute inf and NaN where Python would raise.
    callables : mapping of str to callable
        The Python functions that are signals, by the signal's name.
    p : tuple
        (shared numbers, one list an own parameter, times and values of each corner table): an
        argument of all functions.
    layout : Layout
        Where everything stands in the state vector, in what ``observe`` fills and in the modes.
    held : int
        How many signs are held.
    strict : list of bool
        For each relation whether its margin must be positive (or may be zero) to be true.
    relations : list of str
        Each relation in words, for messages.
    surfaces : integrators.Surfaces
        Where the motion can slide.
    surface_names : list of str
        What is zero on each.
    knots, jumps : list of float
        Times [s] where a signal has a corner, and where it jumps.
    """

    source: str
    functions: Mapping[str, Callable[..., Any]]
    ieee: Mapping[str, Callable[..., Any]]
    callables: Mapping[str, Callable[[float], float]]
    p: Arguments
    layout: Layout
    held: int
    strict: list[bool]
    relations: list[str]
    surfaces: integrators.Surfaces
    surface_names: list[str]
    knots: list[float]
    jumps: list[float]

    @property
    def live(self) -> list[float]:
        """For every sign: as it is seen."""
        return [LIVE] * self.held


def lower(model: Model, rig: Rig) -> Program:
    """Generate the program of a model on a rig.

    Parameters
    ----------
    model : Model
        What rubs.
    rig : Rig
        What it is mounted on.

    Returns
    -------
    Program
        Text, functions and arrays.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> program = lower(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.1*t"))
    >>> "if z >= s and v > v_c:" in program.source
    True
    """
    signals = rig.signals.values()
    shape = (
        repr(model.chart),
        model.stribeck is None,
        model.n,
        tuple(np.ndim(model.values[name]) for name in model.chart.parameter_names),
        rig.title,
        rig.acceleration,
        tuple(rig.numbers),
        tuple(rig.signals),
        tuple(_spelling(s) for s in signals),
    )
    corners = [s for s in signals if isinstance(s, Corners)]
    return dataclasses.replace(
        _lowered(_Shape(shape, model, rig)),
        p=arguments(model, rig),
        knots=sorted({float(t) for s in corners for t in s.times}),
        jumps=sorted({float(t) for s in corners for t in s.jumps}),
    )


def _spelling(signal: Signal) -> str | int | None:
    """Return what the text depends on in a signal, hashable.

    A callable counts by identity, which the rig in the cache keeps from being given away: callables
    that call themselves equal need not return the same, and some cannot be hashed.
    """
    match signal:
        case Formula(text=text):
            return text
        case Function(call=call):
            return id(call)
    return None


@dataclass(frozen=True)
class _Shape:
    """What the text depends on; a model and a rig of that shape."""

    key: tuple[Any, ...]
    model: Model = field(compare=False)
    rig: Rig = field(compare=False)


@functools.lru_cache(maxsize=64)
def _lowered(shape: _Shape) -> Program:
    """Generate the text for all models and rigs of a shape, without their numbers."""
    model, rig = shape.model, shape.rig
    writer = _Lowering(model, rig)
    source = writer.source()
    callables = {
        name: signal.call for name, signal in rig.signals.items() if isinstance(signal, Function)
    }
    title = f"{model.chart.name}, {rig.title}"
    names: dict[str, Any] = {
        "piecewise_linear": piecewise_linear,
        "piecewise_slope": piecewise_slope,
        "nan": math.nan,
    }
    names |= {f"{name}_signal": _guarded(name, call) for name, call in callables.items()}
    namespace, careful = load(title, source, names), load_careful(title, source, names)
    return Program(
        source=source,
        functions={name: namespace[name] for name in _FUNCTION_NAMES},
        ieee={name: ieee(namespace[name], careful[name]) for name in _FUNCTION_NAMES},
        callables=callables,
        p=([], [], []),
        layout=writer.layout,
        held=writer.held.size,
        strict=[relation.strict for relation, _ in writer.relations],
        relations=writer.relation_names(),
        surfaces=writer.surface_table(),
        surface_names=writer.surface_names(),
        knots=[],
        jumps=[],
    )


def arguments(model: Model, rig: Rig) -> Arguments:
    """Return the numbers of a model and a rig, as the functions of their program take them.

    Parameters
    ----------
    model, rig
        What runs.

    Returns
    -------
    tuple of lists
        See `Program`.
    """
    curve, values = model.stribeck, [model.values[name] for name in model.chart.parameter_names]
    shared = [] if curve is None else [curve.F_c, curve.F_s, curve.v_s, curve.dip]
    shared += [model.sigma_2, *rig.numbers.values()]
    shared += [float(value) for value in values if np.ndim(value) == 0]
    own = [as_floats(model.weights)]
    own += [as_floats(np.asarray(value)) for value in values if np.ndim(value) > 0]
    tables = [
        as_floats(column)
        for s in rig.signals.values()
        if isinstance(s, Corners)
        for column in (s.times, s.values)
    ]
    return shared, own, tables


def equations(program: Program) -> integrators.Equations:
    """Return a program as the integrators take it.

    Parameters
    ----------
    program : Program
        From `lower`.

    Returns
    -------
    integrators.Equations
        Its functions and numbers.
    """
    functions = program.ieee
    return integrators.Equations(
        flow=functions["flow"],
        flow_live=functions["flow_live"],
        arm=functions["arm"],
        margins=functions["margins"],
        normal=functions["normal"],
        p=program.p,
        held=program.held,
        strict=program.strict,
        relations=program.relations,
        surfaces=program.surfaces,
        knots=program.knots,
        jumps=program.jumps,
        seen=program.layout.observed.size,
    )


_DIP = "v dip"  # not an identifier, so no chart can have a name like it
_FUNCTION_NAMES = ("flow", "flow_live", "switch", "act", "observe", "normal", "arm", "margins")


def _guarded(name: str, call: Callable[[float], float]) -> Callable[[float], float]:
    def sampled(t: float) -> float:
        try:
            return float(call(t))
        except Exception as error:
            raise SignalError(
                f"signal {name!r}: the function raised {type(error).__name__} at t = {t!r} s: "
                f"{error}"
            ) from error

    return sampled


class _Lowering:
    """Collects names, signs and relations of a model on a rig, then writes the functions."""

    def __init__(self, model: Model, rig: Rig) -> None:
        self.model, self.rig, self.chart = model, rig, model.chart
        self.prescribed = rig.acceleration is None
        self.curve = None
        if model.stribeck is not None:
            self.curve = parse_value(model.stribeck.text, ["F_c", "F_s", "v_s", "v"])
        # A chart may have names of the rig's: those of the rig are set apart.
        self.rig_names = {name: Name(f"rig {name}") for name in (*rig.signals, *rig.numbers)}
        self.acceleration = (
            None
            if rig.acceleration is None
            else renamed(
                parse_value(rig.acceleration, ["t", "x", "v", "F", *self.rig_names]),
                self.rig_names,
            )
        )
        self._collect_numbers()
        self._collect_rough()
        self._collect_surfaces()
        self._collect_relations()
        self._collect_constants()
        self.layout = Layout.of(model, rig, self.surfaces.size)

    # ------------------------------------------------------------------ collecting
    def _collect_numbers(self) -> None:
        # In the order of `arguments`.
        self.shared = [] if self.curve is None else ["F_c", "F_s", "v_s", "v_dip"]
        self.shared += ["sigma_2", *self.rig.numbers]
        self.own = ["weight"]
        taken = set(self.shared) | set(self.rig.signals) | {f"{s}_signal" for s in self.rig.signals}
        # Of the text itself.
        taken |= {"F_i", "len", "range", "piecewise_linear", "piecewise_slope", "v_dip"}
        taken |= {"surface", "j", "dS", "nan"}
        # A chart may call its own parameter F_c or mass: it gets a name of its own in the text.
        self.rename: dict[str, str] = {_DIP: "v_dip"}
        self.rename |= {apart.id: name for name, apart in self.rig_names.items()}
        chart_names = (*self.chart.variables, *self.chart.parameter_names)
        for name in chart_names:
            local = name
            while local in taken or (local != name and local in chart_names):
                local += "_"
            taken.add(local)
            self.rename[name] = local
        self.locals = taken
        for name in self.chart.parameter_names:
            if np.ndim(self.model.values[name]) == 0:
                self.shared.append(self.rename[name])
            else:
                self.own.append(self.rename[name])
                self.rename[name] += "[i]"

    def is_shared(self, node: Node) -> bool:
        """Tell whether a tree of the chart has one value for all elements."""
        return all(
            name in ("t", "x", "v")
            or name.startswith("rig ")
            or self.rename.get(name) in self.shared
            for name in names_in(node)
        )

    def _collect_rough(self) -> None:
        # Where a flow, the force, the rig or a signal has a corner or a jump, the driver stops and
        # holds a sign. In the rig a sign of F itself stays live: F is known only with the flow.
        self.rig_rough: list[Value] = []
        for signal in self.rig.signals.values():
            if isinstance(signal, Formula):
                self.rig_rough += rough_points(signal.tree)
        if self.acceleration is not None:
            self.rig_rough += [u for u in rough_points(self.acceleration) if "F" not in names_in(u)]
        self.forces = {}
        self.state_rough = {}
        for state in self.chart.states:
            flows = {v: self.chart.flows[state.name, v] for v in self.chart.variables}
            rates = {f"d{variable}": tree for variable, tree in flows.items()}
            self.forces[state.name] = turning_inside(self.chart.forces["F"], rates)
            texts = [*flows.values(), self.forces[state.name]]
            self.state_rough[state.name] = tuple(
                dict.fromkeys(u for tree in texts for u in rough_points(tree))
            )
        found = [u for rough in self.state_rough.values() for u in rough]
        shared = dict.fromkeys([*self.rig_rough, *(u for u in found if self.is_shared(u))])
        own = dict.fromkeys(u for u in found if not self.is_shared(u))
        self.held = Places(tuple(shared), tuple(own), self.model.n)
        self.sign_names: dict[Value, str] = {}
        for number, u in enumerate([*self.held.shared, *self.held.own]):
            label = u.id if isinstance(u, Name) and u.id.isidentifier() else str(number)
            while any(f"{f}_{label}" in self.locals for f in ("sgn", "abs", "min", "max")):
                label += "_"
            self.sign_names[u] = label

    def _collect_surfaces(self) -> None:
        shared, own = (
            tuple(u for u in rough if self._can_be_slid_on(u))
            for rough in (self.held.shared, self.held.own)
        )
        self.surfaces = Places(shared, own, self.model.n)

    def _can_be_slid_on(self, u: Value) -> bool:
        """Tell whether u depends on the state, by ways that have a derivative."""
        names = names_in(u)
        if "s" in names:
            names |= {"v"}
        states = {"x", *self.chart.variables, *([] if self.prescribed else ["v"])}
        signals = {name for name in self.rig.signals if self.rig_names[name].id in names}
        if self.prescribed and "v" in names:
            signals |= {"v"}
        return (
            bool(names & states)
            and all(derivative(u, name) is not None for name in names)
            and all(self._has_slope(self.rig.signals[name]) for name in signals)
        )

    @staticmethod
    def _has_slope(signal: Signal) -> bool:
        if isinstance(signal, Formula):
            return derivative(signal.tree, "t") is not None
        return isinstance(signal, Corners)

    def _collect_relations(self) -> None:
        wanted: list[Comparison] = []
        for edge in self.chart.transitions:
            wanted += comparisons(split(self.chart.guards[edge.name]))
        for u in [*self.held.shared, *self.held.own]:
            wanted += self._sign_relations(u)
        if "s" in self.chart.inputs:
            wanted += self.landmarks()
        wanted = list(dict.fromkeys(wanted))
        own = [r for r in wanted if not (self.is_shared(r.left) and self.is_shared(r.right))]
        shared = [r for r in wanted if r not in own]
        self.relations = Places(tuple(shared), tuple(own), self.model.n)

    def landmarks(self) -> list[Comparison]:
        """Where s(v) starts to change fast: a large step would jump the whole dip unseen."""
        v, dip = Name("v"), Name(_DIP)
        # Mirror images of each other, so that a mirrored run stops at mirrored places.
        return [Comparison(v, dip, strict=True), Comparison(Negative(dip), v, strict=True)]

    # ------------------------------------------------------------------ arrays
    def relation_names(self) -> list[str]:
        """Say each relation in words."""
        plain = {apart.id: name for name, apart in self.rig_names.items()}
        return [
            spell(Literal(relation, True).relation, rename=plain) + _of_element(i)
            for relation, i in self.relations
        ]

    def surface_names(self) -> list[str]:
        """Say what is zero on each surface."""
        plain = {apart.id: name for name, apart in self.rig_names.items()}
        return [spell(u, rename=plain) + _of_element(i) for u, i in self.surfaces]

    def surface_table(self) -> integrators.Surfaces:
        """Return where the surfaces' signs and relations stand."""
        surfaces = [*self.surfaces.shared, *self.surfaces.own]
        above, at_least = (
            [r for u in surfaces for r in self.relations.all_of(_with_zero(u, strict))]
            for strict in (True, False)
        )
        sign = [k for u in surfaces for k in self.held.all_of(u)]
        return integrators.Surfaces(sign=sign, above=above, at_least=at_least)

    # ------------------------------------------------------------------ the text
    def source(self) -> str:
        states = ", ".join(self.state_constant(s.name) for s in self.chart.states)
        lines = [
            f"# {_one_line(self.model.chart.name)}, {_one_line(self.rig.title)}",
            "# Generated from the chart; parameters are arguments: one text for every set of them.",
            "",
            f"{states} = {_tuple(range(len(self.chart.states)))}  # states",
        ]
        if self.chart.transitions:
            edges = ", ".join(self.edge_constant(t.name) for t in self.chart.transitions)
            lines.append(f"{edges} = {_tuple(range(len(self.chart.transitions)))}  # edges")
        for part in (
            self.write_switch(),
            self.write_act(),
            self.write_flow(live=False),
            self.write_flow(live=True),
            self.write_observe(),
            self.write_normal(),
            self.write_arm(),
            self.write_margins(),
        ):
            lines += ["", "", *part]
        return "\n".join(lines) + "\n"

    def state_constant(self, state: str) -> str:
        return self.constants["state", state]

    def edge_constant(self, edge: str) -> str:
        return self.constants["edge", edge]

    def _collect_constants(self) -> None:
        # STICK reads best, but a state called c must not become the parameter C, nor the edge
        # Home the state home.
        taken = {*self.locals, *RESERVED}
        self.constants: dict[tuple[str, str], str] = {}
        names = [("state", s.name) for s in self.chart.states]
        names += [("edge", t.name) for t in self.chart.transitions]
        for kind, name in names:
            constant = name.upper()
            while constant in taken or not constant.isidentifier():
                constant += "_"
            taken.add(constant)
            self.constants[kind, name] = constant

    def spell(self, node: Node) -> str:
        return spell(node, rename=self.rename)

    def function(
        self, signature: str, doc: str, body: list[str], *, live: bool = True
    ) -> list[str]:
        """Put a function together: signature, the names its body uses, then the body."""
        used = _words(body)
        lines = [f"def {signature}:", f'    """{doc}"""']
        front: list[str] = []
        if "S" in used and self.curve is not None:
            front.append(f"S = {spell(self.curve)}  # (2)")
            used |= _words(front)
        if "v" in used:
            front.insert(0, f"v = y[{self.layout.y.text('v')}]") if not self.prescribed else None
            used |= {"v"}
        signals: list[str] = []
        tables = 0
        for name, signal in self.rig.signals.items():
            if name in used:
                signals += self.signal_lines(name, signal, tables, live)
            tables += isinstance(signal, Corners)
        if "x" in used:
            front.insert(0, f"x = y[{self.layout.y.text('x')}]")
        used |= _words(signals)
        setup: list[str] = []
        needed = [(j, name) for j, name in enumerate(self.shared) if name in used]
        arrays = [(j, name) for j, name in enumerate(self.own) if name in used]
        if needed or arrays or used & {"n", "tables"}:
            setup.append("shared, own, tables = p")
        setup += [f"{name} = shared[{j}]" for j, name in needed]
        setup += [f"{name} = own[{j}]" for j, name in arrays]
        if "n" in used:
            setup.append("n = len(own[0])")  # behind the elements' modes stand the surfaces'
        return lines + ["    " + line for line in [*setup, *signals, *front, *body]]

    def signal_lines(self, name: str, signal: Signal, table: int, live: bool) -> list[str]:
        if isinstance(signal, Function):
            return [f"{name} = {name}_signal(t)"]
        if isinstance(signal, Corners):
            return [f"{name} = piecewise_linear(t, tables[{2 * table}], tables[{2 * table + 1}])"]
        smooth, calls = substitute(signal.tree, self.sign_names)
        signs = "live" if live else "held"
        return [*self.rough_lines(calls, signs), f"{name} = {spell(smooth)}"]

    def rough_lines(self, calls: Mapping[str, Call], signs: str) -> list[str]:
        """Assign the rough calls of a flow: from "held" signs, "live", or "given" ones.

        A sign that is given may say that it is to be taken live.
        """
        lines = []
        labels = {label: u for u, label in self.sign_names.items()}
        for name, call in calls.items():
            live = self.spell(call)
            if signs == "live":
                lines.append(f"{name} = {live}")
                continue
            sign = f"held[{self.held.text(labels[name.partition('_')[2]])}]"
            a = self.spell(call.arguments[0])
            product = self.spell(Binary("*", Name(sign), call.arguments[0]))
            match call.function:
                case "sgn":
                    value = sign
                case "abs":
                    value = product
                case "min":
                    value = f"{a} if {sign} <= 0.0 else {self.spell(call.arguments[1])}"
                case _:
                    value = f"{a} if {sign} >= 0.0 else {self.spell(call.arguments[1])}"
            if signs == "given":
                value = f"{live} if {sign} == {LIVE} else {value}"
            lines.append(f"{name} = {value}")
        return lines

    def flow_branches(
        self, signs: str, *, force: bool
    ) -> tuple[dict[str, Call], dict[str, list[str]]]:
        """Return the rough calls that elements share, and by state the lines of flows and force."""
        shared_calls: dict[str, Call] = {}
        labels = {label: u for u, label in self.sign_names.items()}
        branches = {}
        for state in self.chart.states:
            own: dict[str, Call] = {}

            def smooth(tree: Value, own: dict[str, Call] = own) -> Value:
                value, calls = substitute(tree, self.sign_names)
                for name, call in calls.items():
                    shared = labels[name.partition("_")[2]] in self.held.shared
                    (shared_calls if shared else own).setdefault(name, call)
                return value

            flows = [
                f"d{self.rename[v]} = {self.spell(smooth(self.chart.flows[state.name, v]))}"
                for v in self.chart.variables
            ]
            if force and self.force_by_state:
                flows.append(f"F_i = {self.force(smooth(self.forces[state.name]))}  # (3)")
            branches[state.name] = [*self.rough_lines(own, signs), *flows]
        return shared_calls, branches

    @property
    def force_by_state(self) -> bool:
        """Whether the force has corners, which differ from state to state."""
        return any(rough_points(tree) for tree in self.forces.values())

    def element_values(self, used: Iterable[str]) -> list[str]:
        """Assign the element's own variables and threshold, as far as they are used."""
        words = set(used)
        lines = [
            f"{self.rename[variable]} = y[{self.layout.y.text(variable)}]"
            for variable in self.chart.variables
            if self.rename[variable] in words
        ]
        return lines + (["s = weight[i] * S"] if "s" in words else [])

    def by_state(self, branches: Mapping[str, list[str]]) -> list[str]:
        """Write an if-else over the element's state."""
        filled = [(s.name, branches[s.name] or ["pass"]) for s in self.chart.states]
        if len(filled) == 1:
            return branches[filled[0][0]]
        lines = []
        for number, (state, body) in enumerate(filled):
            word = "if" if number == 0 else "elif"
            last = number == len(filled) - 1
            head = "else" if last else f"{word} mode[i] == {self.state_constant(state)}"
            note = f"  # {self.state_constant(state)}" if last else ""
            lines += [f"{head}:{note}", *_indented(body)]
        return lines

    # ------------------------------------------------------------------ the functions
    def write_switch(self) -> list[str]:
        branches = {}
        for state in self.chart.states:
            lines: list[str] = []
            for number, (_, edge) in enumerate(self.chart.leaving(state.name)):
                word = "if" if number == 0 else "elif"
                lines += [
                    f"{word} {self.spell(self.chart.guards[edge.name])}:",
                    f"    edge = {self.edge_constant(edge.name)}  # {state.name} -> {edge.target}",
                ]
            branches[state.name] = lines
        inner = self.by_state(branches) if self.chart.transitions else []
        body = [
            "for i in range(n):",
            *_indented([*self.element_values(_words(inner)), "edge = -1", *inner, "out[i] = edge"]),
        ]
        return self.function(
            "switch(t, y, mode, p, out)",
            "out[i] = the first edge of element i whose guard holds, or -1.",
            body,
        )

    def write_act(self) -> list[str]:
        targets = {s.name: s for s in self.chart.states}
        lines: list[str] = []
        for edge in self.chart.transitions:
            # Stateflow's order: exit of the source, action of the edge, entry of the target.
            steps = [
                *self.chart.assignments["exit", targets[edge.source].name].items(),
                *self.chart.assignments["action", edge.name].items(),
                *self.chart.assignments["entry", targets[edge.target].name].items(),
            ]
            lines.append(f"{'elif' if lines else 'if'} edge == {self.edge_constant(edge.name)}:")
            for variable, tree in steps:
                local, place = self.rename[variable], self.layout.y.text(variable)
                lines += _indented([f"{local} = {self.spell(tree)}", f"y[{place}] = {local}"])
            lines.append(f"    mode[i] = {self.state_constant(edge.target)}")
        body = [*self.element_values(_words(lines)), *lines] or ["pass  # the chart has no edge"]
        return self.function("act(edge, i, t, y, mode, p)", "Take an edge of element i.", body)

    def write_flow(self, live: bool) -> list[str]:
        signs = "live" if live else "held"
        shared_calls, branches = self.flow_branches(signs, force=not self.prescribed)
        inner = self.by_state(branches)
        if not self.prescribed:
            force = "F_i" if self.force_by_state else f"{self.force(self.chart.forces['F'])}"
            inner.append(f"F += {force}" + ("" if self.force_by_state else "  # (3)"))
        inner += [f"dy[{self.layout.y.text(v)}] = d{self.rename[v]}" for v in self.chart.variables]
        place = self.layout.y.text
        ends = [f"dy[{place('x')}] = v"]
        if self.acceleration is not None:
            smooth, calls = substitute(self.acceleration, self.sign_names)
            shared_calls |= calls
            ends += [f"dy[{place('v')}] = {self.spell(smooth)}"]
            ends.insert(0, "F += sigma_2 * v  # (4)")
        body = [
            *self.rough_lines(shared_calls, signs),
            *([] if self.prescribed else ["F = 0.0"]),
            "for i in range(n):",
            *_indented([*self.element_values(_words(inner)), *inner]),
            *ends,
        ]
        name, doc = (
            ("flow_live", "dy = dy/dt, all states frozen, corners and jumps evaluated live.")
            if live
            else ("flow", "dy = dy/dt, all states frozen and all signs held.")
        )
        return self.function(f"{name}(t, y, mode, held, p, dy)", doc, body, live=live)

    def force(self, tree: Value) -> str:
        rename = {**self.rename, **{"d" + v: "d" + self.rename[v] for v in self.chart.variables}}
        return spell(tree, rename=rename)

    def write_observe(self) -> list[str]:
        shared_calls, branches = self.flow_branches("given", force=True)
        place = self.layout.observed.text
        without = "nan" if self.curve is None else "weight[i] * S"
        threshold = "s" if "s" in self.chart.inputs else without
        force = (
            [] if self.force_by_state else [f"F_i = {self.force(self.chart.forces['F'])}  # (3)"]
        )
        inner = [
            *self.by_state(branches),
            *force,
            "F += F_i",
            f"out[{place('s')}] = {threshold}",
            f"out[{place('F_elements')}] = F_i",
            *(f"out[{place(f'd{v}')}] = d{self.rename[v]}" for v in self.chart.variables),
        ]
        body = [
            *self.rough_lines(shared_calls, "given"),
            "F = 0.0",
            "for i in range(n):",
            *_indented([*self.element_values(_words(inner)), *inner]),
            f"out[{place('v')}] = v",
            f"out[{place('F')}] = F + sigma_2 * v  # (4)",
        ]
        return self.function(
            "observe(t, y, mode, held, p, out)",
            f"out = v, F, then for all elements s, F_i and the rates; a sign {LIVE} is taken live.",
            body,
        )

    def write_normal(self) -> list[str]:
        lines: list[str] = []
        for u in (*self.surfaces.shared, *self.surfaces.own):
            word, inner = "elif" if lines else "if", self.gradient(u)
            asked, element = self.surfaces.asking_text(u, "surface")
            lines.append(f"{word} {asked}:  # {self.spell(u)}")
            if element:
                inner = [f"i = {element}", *self.element_values(_words(inner)), *inner]
            lines += _indented(inner)
        clear = [f"for j in range({self.layout.y.size_text(1)}):", "    out[j] = 0.0"]
        body = [*clear, *lines] if lines else ["pass"]
        return self.function(
            "normal(surface, t, y, mode, p, out)",
            "out = the gradient over y of what is zero on a surface, then its rate in t.",
            body,
        )

    def gradient(self, u: Value) -> list[str]:
        """Write the gradient of u over y, and its rate in t."""
        place = self.layout.y.text
        lines = [
            f"out[{place(name)}] = {self.spell(_known(u, name))}"
            for name in ("x", *self.chart.variables)
            if name in names_in(u)
        ]
        by_v = [self.spell(_known(u, "v"))] if "v" in names_in(u) else []
        if "s" in names_in(u):
            assert self.curve is not None  # charts with s have one
            slope = spell(_known(self.curve, "v"))
            lines.append(f"dS = {slope}")
            by_v.append(f"({self.spell(_known(u, 's'))}) * weight[i] * dS")
        rates = [self.spell(_known(u, "t"))] if "t" in names_in(u) else []
        if by_v and not self.prescribed:
            lines.append(f"out[{place('v')}] = {' + '.join(by_v)}")
        elif by_v:
            rates.append(f"({' + '.join(by_v)}) * {self.signal_slope('v')}")
        rates += [
            f"({self.spell(_known(u, apart.id))}) * {self.signal_slope(name)}"
            for name, apart in self.rig_names.items()
            if name in self.rig.signals and apart.id in names_in(u)
        ]
        behind = self.layout.y.size_text()
        return lines + ([f"out[{behind}] = {' + '.join(rates)}"] if rates else [])

    def signal_slope(self, name: str) -> str:
        """Spell the rate of a signal."""
        signals = self.rig.signals
        signal = signals[name]
        if isinstance(signal, Formula):
            return f"({spell(_known(signal.tree, 't'))})"
        before = list(signals)[: list(signals).index(name)]
        table = 2 * sum(isinstance(signals[other], Corners) for other in before)
        return f"piecewise_slope(t, tables[{table}], tables[{table + 1}])"

    def write_arm(self) -> list[str]:
        always = [r for u in self.rig_rough for r in self._sign_relations(u)]
        if "s" in self.chart.inputs:
            always += self.landmarks()
        body = [f"watch[{self.relations.text(r)}] = 1" for r in dict.fromkeys(always)]
        body += [f"held[{self.held.text(u)}] = sgn({self.spell(u)})" for u in self.held.shared]
        branches = {}
        for state in self.chart.states:
            lines = []
            for u in self.state_rough[state.name]:
                if u in self.held.own:
                    lines.append(f"held[{self.held.text(u)}] = sgn({self.spell(u)})")
                lines += [f"watch[{self.relations.text(r)}] = 1" for r in self._sign_relations(u)]
            for _, edge in self.chart.leaving(state.name):
                lines.append(f"# {edge.name}: {self.spell(self.chart.guards[edge.name])}")
                lines += self.witness(split(self.chart.guards[edge.name]))
            branches[state.name] = lines
        inner = self.by_state(branches)
        if any(branches.values()):
            body += [
                "for i in range(n):",
                *_indented([*self.element_values(_words(inner)), *inner]),
            ]
        return self.function(
            "arm(t, y, mode, p, held, watch)",
            "Hold the signs and mark the comparisons that keep every false guard false.",
            body or ["pass"],
        )

    def _sign_relations(self, u: Value) -> list[Comparison]:
        return [_with_zero(u, strict=True), _with_zero(u, strict=False)]

    def witness(self, part: Split) -> list[str]:
        """Write: if this part is false, watch what keeps it false."""
        if isinstance(part, Literal):
            # Not the opposite comparison: of NaN neither is true, and it has to be watched.
            return [
                f"if not {self.spell(part.relation)}:",
                f"    watch[{self.relations.text(part.comparison)}] = 1",
            ]
        word, parts = part
        if word == "either":
            return [line for each in parts for line in self.witness(each)]
        lines: list[str] = []
        for each in parts:
            other = "el" if lines else ""
            if isinstance(each, Literal):
                first, *rest = self.witness(each)
                lines += [other + first, *rest]
            else:
                lines += [f"{other}if not ({self.truth(each)}):", *_indented(self.witness(each))]
        return lines

    def truth(self, part: Split) -> str:
        """Spell a split condition; brackets everywhere, as it is only read by machines."""
        if isinstance(part, Literal):
            return self.spell(part.relation)
        word, parts = part
        return (" and " if word == "both" else " or ").join(
            self.truth(q) if isinstance(q, Literal) else f"({self.truth(q)})" for q in parts
        )

    def write_margins(self) -> list[str]:
        shared = [self.margin_lines(r) for r in self.relations.shared]
        own = [line for r in self.relations.own for line in self.margin_lines(r)]
        body = [line for lines in shared for line in lines]
        if own:
            body += ["for i in range(n):", *_indented([*self.element_values(_words(own)), *own])]
        return self.function(
            "margins(t, y, mode, p, watch, out)",
            "For each watched comparison left - right.",
            body or ["pass"],
        )

    def margin_lines(self, comparison: Comparison) -> list[str]:
        index = self.relations.text(comparison)
        margin = self.spell(comparison.left)
        if comparison.right != Number(0.0):
            right = spell(comparison.right, rename=self.rename)
            simple = isinstance(comparison.right, Name | Number | Negative)
            margin = f"{margin} - {right if simple else f'({right})'}"
        return [f"if watch[{index}]:", f"    out[{index}] = {margin}"]


def _with_zero(u: Value, strict: bool) -> Comparison:
    return Comparison(u, Number(0.0), strict)


def _of_element(element: int | None) -> str:
    """Name an element, counted from 1 in texts; nothing where all share what is named."""
    return "" if element is None else f" of element {element + 1}"


def _known(value: Value, name: str) -> Value:
    """Return a derivative that there is: surfaces without one are not slid on."""
    found = derivative(value, name)
    assert found is not None
    return found


def _words(lines: Iterable[str]) -> set[str]:
    """Return the identifiers in lines of code (comments left out)."""
    found: set[str] = set()
    for line in lines:
        word = ""
        for c in line.partition("#")[0] + " ":
            if c == "_" or c.isalnum():
                word += c
            elif word:
                found.add(word)
                word = ""
    return found


def _indented(lines: Iterable[str]) -> list[str]:
    return ["    " + line for line in lines]


def _tuple(numbers: Iterable[int]) -> str:
    return ", ".join(str(number) for number in numbers)


def _one_line(text: str) -> str:
    """Return text fit for a comment: a line break would end it."""
    return "".join(c if c.isprintable() else " " for c in text)
