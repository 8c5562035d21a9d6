"""Derivatives of generated text, as text: each function with the tangents of what it computes.

A program's functions are assignments, branches and loops whose right-hand sides are written in the
expression language. They are read back, and before each assignment stands that of its tangent: the
partial derivatives of `gms_fsm.language.derivative` times the tangents of what it reads. Branches
are those of the values. A tangent is a number, or an array with one entry per direction: the text
is the same. In lanes there are several numbers, one after another, and the tangents of the state
follow it in its own vector; the factors of all lanes are computed once.
"""

from __future__ import annotations

import ast
import copy
import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from gms_fsm.errors import ParameterError
from gms_fsm.language import ELEMENTARY, derivative, names_in, parse_value, spell
from gms_fsm.language.tree import Number, Value
from gms_fsm.lowering.generated import SIGNALS, CarefulText, ieee, load
from gms_fsm.lowering.program import Program

MARK = "d__"  # before the name of a value: its tangent
FUNCTIONS = ("flow", "observe", "margins", "normal", "act", "tick", "follow")
VECTORS = ("y", "dy", "out")  # arrays that have tangents
IN_THEIRS = ("y", "dy")  # in lanes these are in the same vector
OF_LANES = ("slope", "flow", "margins", "normal", "act", "tick", "follow")
SLOPE = {"slope": "flow"}  # what computes at a fixed time only the tangents of what that fills
ZERO = "0.0"
ROUNDING = 1e-12  # a difference that is set to 0 below this, relative to its terms, keeps its slope


@dataclass(frozen=True)
class ActiveNumbers:
    """Which numbers of a program have tangents: by their places among its arguments.

    Parameters
    ----------
    shared, own : frozenset of int
        Of those with one value, and of those with one value per element.
    """

    shared: frozenset[int]
    own: frozenset[int]


def tangents(program: Program, active: ActiveNumbers) -> Mapping[str, Any]:
    """Return the functions of a program with tangents, their ``"text"``, and the ``"plain flow"``.

    Each takes its own arguments, and then the tangents of t, y, the numbers (shared, own), and of
    what it fills: ``flow(t, y, mode, held, p, dy, dt, y_t, p_t, dy_t)``.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> from gms_fsm.lowering.program import lower
    >>> program = lower(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("2*t"))
    >>> flow = tangents(program, ActiveNumbers(frozenset(), frozenset()))["flow"]
    >>> dy, slope, size = [0.0] * 5, [0.0] * 5, program.layout.y.size
    >>> flow(1.0, [0.0] * size, [0] * 4, [0.0], program.p, dy, 1.0, [0.0] * size, ([], []), slope)
    >>> dy[0], slope[0]
    (2.0, 2.0)
    """
    refuse_callables(program)
    return _made(program.source, program.plan.title, active)


def refuse_callables(program: Program) -> None:
    """Refuse signals that are Python functions."""
    if program.callables:
        name = next(iter(program.callables))
        raise ParameterError(
            "a Python function has no derivative here",
            place=f"signal {name!r}",
            advice="give the signal as an expression or as corners",
            key=("sensitivities",),
        )


@functools.lru_cache(maxsize=64)
def _made(source: str, title: str, active: ActiveNumbers) -> Mapping[str, Any]:
    text = with_tangents(source, active)
    fast, careful = load(title, text, SIGNALS), CarefulText(title, text, SIGNALS)
    return {name: ieee(fast[name], careful[name]) for name in FUNCTIONS}


@functools.lru_cache(maxsize=64)
def in_lanes(
    source: str, title: str, active: ActiveNumbers, lanes: int, size: int
) -> Mapping[str, Any]:
    """Return the functions of a text with tangents in lanes, their ``"text"``, and ``"plain"``."""
    text = with_tangents(source, active, OF_LANES, LanePlaces(lanes, size))
    fast, careful = load(title, text, SIGNALS), CarefulText(title, text, SIGNALS)
    plain = {name: fast[name] for name in OF_LANES}
    made = {name: ieee(fast[name], careful[name]) for name in OF_LANES}
    return made | {"text": text, "plain": plain}


def with_tangents(
    source: str,
    active: ActiveNumbers,
    names: Iterable[str] = FUNCTIONS,
    lanes: LanePlaces | None = None,
) -> str:
    """Return the text of some functions with tangents, and all constants of the text."""
    body: list[ast.stmt] = []
    for part in ast.parse(source).body:
        if isinstance(part, ast.FunctionDef):
            own = part.name
            for name in (own, *(slope for slope, of in SLOPE.items() if of == own)):
                if name in names:
                    part.name = name
                    body.append(_function(copy.deepcopy(part), active, lanes))
        else:
            body.append(part)
    return ast.unparse(ast.fix_missing_locations(ast.Module(body, [])))


def _function(
    function: ast.FunctionDef, active: ActiveNumbers, lanes: LanePlaces | None
) -> ast.FunctionDef:
    """Return a function with tangents."""
    filled = [arg.arg for arg in function.args.args if arg.arg in VECTORS[1:]]
    arguments = [MARK + name for name in ("t", "y", "p", *filled)]
    if lanes is not None:
        arguments = [each for each in arguments if each.removeprefix(MARK) not in IN_THEIRS]
    function.args.args += [ast.arg(name) for name in arguments]
    writer = _TangentWriter(active, function, lanes)
    function.body = writer.block(function.body)
    return function


@dataclass(frozen=True)
class LanePlaces:
    """Tangents side by side.

    Parameters
    ----------
    count : int
        How many there are.
    size : int
        Length of the state, which its tangents follow.
    """

    count: int
    size: int

    def spread(
        self, target: ast.expr, terms: list[tuple[str, str]], values: list[ast.stmt]
    ) -> list[ast.stmt]:
        """Return the assignments of a tangent in all lanes, and then that of the value."""
        factors, sums = [], []
        for k, (factor, slope) in enumerate(terms):
            if factor and not factor.isidentifier():
                factors += ast.parse(f"g__{k} = {factor}").body
                factor = f"g__{k}"
            sums.append(f"{factor} * {slope}" if factor else slope)
        text = f"{ast.unparse(target)} = {' + '.join(sums) or ZERO}"
        made = [_Lane(self, lane).visit(ast.parse(text).body[0]) for lane in range(self.count)]
        return _once_each([*factors, *values], len(factors), made)


class _Lane(ast.NodeTransformer):
    """Writes a tangent as one of the numbers of a lane."""

    def __init__(self, lanes: LanePlaces, lane: int) -> None:
        self.lanes, self.lane = lanes, lane

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        match node.value:
            case ast.Name(id=name) if name.startswith(MARK):
                plain, first = name.removeprefix(MARK), self.lane
                if plain in IN_THEIRS:
                    name, first = plain, self.lane + self.lanes.size
                place = ast.unparse(self.generic_visit(node.slice))
                count = self.lanes.count
                return ast.Subscript(
                    ast.Name(name, ast.Load()),
                    ast.parse(f"({place}) * {count} + {first}", mode="eval").body,
                    node.ctx,
                )
        return self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if not node.id.startswith(MARK):
            return node
        if node.id == f"{MARK}t":
            return ast.Subscript(node, ast.Constant(self.lane), node.ctx)
        return ast.Name(f"d{self.lane}__{node.id.removeprefix(MARK)}", node.ctx)


def _once_each(statements: list[ast.stmt], factors: int, lanes: list[ast.stmt]) -> list[ast.stmt]:
    """Return factors, lanes and the value, with functions that stand there repeatedly called once.

    One in an alternative may not be called where that is not chosen.
    """
    calls = _Calls()
    for each in statements:
        calls.visit(each)
    names = {text: f"e__{k}" for k, (text, n) in enumerate(calls.found.items()) if n > 1}
    before = [ast.parse(f"{name} = {text}").body[0] for text, name in names.items()]
    put = _Calls(names)
    statements = [put.visit(copy.deepcopy(each)) for each in statements]
    return [*before, *statements[:factors], *lanes, *statements[factors:]]


class _Calls(ast.NodeTransformer):
    """Counts the calls of elementary functions, or puts names in their places."""

    def __init__(self, names: Mapping[str, str] | None = None) -> None:
        self.names = names
        self.found: dict[str, int] = {}

    def visit_Call(self, node: ast.Call) -> ast.AST:
        match node.func:
            case ast.Name(id=name) if name in ELEMENTARY:
                text = ast.unparse(node)
                self.found[text] = self.found.get(text, 0) + 1
                if self.names and text in self.names:
                    return ast.Name(self.names[text], ast.Load())
        return self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        return node


class _TangentWriter:
    """Writes the assignments of tangents of one function."""

    def __init__(
        self, active: ActiveNumbers, function: ast.FunctionDef, lanes: LanePlaces | None
    ) -> None:
        self.places, self.lanes = active, lanes
        alone = function.name in SLOPE
        self.active = {*VECTORS} if alone else {"t", *VECTORS}
        self.left_out = "dy" if alone and not _reads(function, "dy") else ""
        while True:  # until no more names depend on something that has a tangent
            before = len(self.active)
            for node in ast.walk(function):
                match node:
                    case (
                        ast.Assign(targets=[ast.Name(id=name)], value=value)
                        | ast.AugAssign(target=ast.Name(id=name), value=value)
                    ):
                        if name not in self.active and self.terms(value):
                            self.active.add(name)
            if len(self.active) == before:
                break

    # ------------------------------------------------------------------ statements
    def block(self, statements: list[ast.stmt]) -> list[ast.stmt]:
        """Return statements, each after the assignment of its tangent."""
        found: list[ast.stmt] = []
        for each in statements:
            match each:
                case ast.Assign(targets=[ast.Tuple()], value=ast.Name(id="p")):
                    found.append(each)
                    found += ast.parse(f"{MARK}shared, {MARK}own = {MARK}p").body
                    continue
                case ast.Assign(targets=[target], value=value):
                    found += self.assigned(target, self.terms(value), each)
                    continue
                case ast.AugAssign(target=ast.Name(id=name) as target, value=value):
                    more = self.terms(value)
                    before = [("", f"{MARK}{name}")]
                    if name in self.active and more:
                        found += self.assigned(target, [*before, *more], each)
                        continue
                case ast.If() if _is_rounding(each):
                    found.append(each)
                    continue
                case ast.If(body=body, orelse=orelse):
                    each.body, each.orelse = self.block(body), self.block(orelse)
                case ast.For(body=body) | ast.While(body=body):
                    each.body = self.block(body)
            found.append(each)
        return found

    def assigned(
        self, target: ast.expr, terms: list[tuple[str, str]], value: ast.stmt
    ) -> list[ast.stmt]:
        """Return an assignment after that of the tangent of its target, if it has one."""
        match target:
            case ast.Name(id=name) if name in self.active:
                tangent = f"{MARK}{name}"
            case ast.Subscript(value=ast.Name(id=name), slice=place) if name in VECTORS:
                tangent = f"{MARK}{name}[{ast.unparse(place)}]"
            case _:
                return [value]
        values = [] if self.left_out and tangent.startswith(f"{MARK}{self.left_out}[") else [value]
        if self.lanes is None or any(slope.startswith(f"{MARK}own[") for _, slope in terms):
            return [*ast.parse(f"{tangent} = {total(terms)}").body, *values]
        made: Any = ast.parse(tangent, mode="eval").body
        return self.lanes.spread(made, terms, values)

    # ------------------------------------------------------------------ expressions
    def tangent(self, value: ast.expr) -> str:
        """Return the tangent of an expression as text."""
        terms = self.terms(value)
        return f"({total(terms)})" if terms else ZERO

    def terms(self, value: ast.expr) -> list[tuple[str, str]]:
        """Return what a tangent is the sum of: factors, empty if 1, and tangents."""
        atoms = _Atoms(self)
        try:
            text = ast.unparse(atoms.visit(ast.parse(ast.unparse(value), mode="eval")))
        except _NoNumber:
            return []
        if not any(slope != ZERO for _, slope in atoms.found.values()):
            return []
        tree = parse_value(text, atoms.found)
        written = {name: here for name, (here, _) in atoms.found.items()}
        terms = []
        for name in sorted(names_in(tree), key=lambda each: int(each[1:])):
            slope = atoms.found[name][1]
            partial = derivative(tree, name) if slope != ZERO else None
            if partial is not None and partial != Number(0.0):
                terms.append(("" if partial == Number(1.0) else _factor(partial, written), slope))
        return terms


def total(terms: list[tuple[str, str]]) -> str:
    """Spell a sum of terms."""
    return " + ".join(f"{a} * {b}" if a else b for a, b in terms) or ZERO


class _NoNumber(Exception):
    """An expression is no number that has a tangent: a tuple, or nan."""


class _Atoms(ast.NodeTransformer):
    """Replaces what the expression language does not know by names, with their tangents."""

    def __init__(self, writer: _TangentWriter) -> None:
        self.writer = writer
        self.found: dict[str, tuple[str, str]] = {}  # name: text of its value, text of its tangent

    def atom(self, value: str, slope: str) -> ast.Name:
        for name, known in self.found.items():
            if known == (value, slope):
                return ast.Name(name, ast.Load())
        name = f"q{len(self.found)}"
        self.found[name] = value, slope
        return ast.Name(name, ast.Load())

    def visit_Tuple(self, _: ast.Tuple) -> ast.AST:
        raise _NoNumber

    def visit_BoolOp(self, _: ast.BoolOp) -> ast.AST:
        raise _NoNumber

    visit_Compare = visit_BoolOp  # type: ignore[assignment]

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id == "nan":
            raise _NoNumber
        slope = MARK + node.id if node.id in self.writer.active else ZERO
        return self.atom(node.id, slope)

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        text, place, slope = ast.unparse(node), ast.unparse(node.slice), ZERO
        match node.value:
            case ast.Name(id="shared"):
                slope = f"{MARK}{text}" if int(place) in self.writer.places.shared else ZERO
            case ast.Name(id="own"):
                slope = f"{MARK}{text}" if int(place) in self.writer.places.own else ZERO
            case ast.Name(id=name) if name in self.writer.active:
                slope = f"{MARK}{text}"
        return self.atom(text, slope)

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        yes, no = self.writer.tangent(node.body), self.writer.tangent(node.orelse)
        slope = ZERO if yes == no == ZERO else f"({yes} if {ast.unparse(node.test)} else {no})"
        return self.atom(f"({ast.unparse(node)})", slope)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        text, parts = ast.unparse(node), node.args
        match node.func:
            case ast.Name(id="len" | "piecewise_slope"):
                return self.atom(text, ZERO)
            case ast.Name(id="piecewise_linear"):
                slope = self.writer.tangent(parts[0])
                rate = f"piecewise_slope{text.removeprefix('piecewise_linear')}"
                return self.atom(text, ZERO if slope == ZERO else f"{rate} * {slope}")
            case ast.Name(id="pow"):
                base, power = (ast.unparse(each) for each in parts)
                d_base, d_power = (self.writer.tangent(each) for each in parts)
                if d_power != ZERO:
                    d_log = f"({power}) / ({base}) * {d_base} + log({base}) * {d_power}"
                    return self.atom(text, f"({text} * ({d_log}) if {base} > 0.0 else 0.0)")
        node.args = [self.visit(each) for each in parts]
        return node


def _factor(partial: Value, written: Mapping[str, str]) -> str:
    text = spell(partial, rename=written)
    return text if text.isidentifier() else f"({text})"


def _reads(function: ast.FunctionDef, array: str) -> bool:
    """Return whether a function reads entries of an array."""
    return any(
        isinstance(node, ast.Subscript)
        and isinstance(node.ctx, ast.Load)
        and isinstance(node.value, ast.Name)
        and node.value.id == array
        for node in ast.walk(function)
    )


def _is_rounding(node: ast.If) -> bool:
    """Return whether a branch only removes the rounding of a difference: its slope stays."""
    match node:
        case ast.If(
            test=ast.Compare(
                left=ast.Call(args=[ast.Name(id=tested)]),
                comparators=[ast.BinOp(left=ast.Constant(value=float(small)))],
            ),
            body=[ast.Assign(targets=[ast.Name(id=name)], value=ast.Constant(value=0.0))],
            orelse=[],
        ):
            return tested == name and small < ROUNDING
    return False
