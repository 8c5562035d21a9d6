"""Derivatives of generated text, as text: each function with the tangents of what it computes.

A program's functions are assignments, branches and loops whose right-hand sides are written in the
expression language. They are read back, and before each assignment stands that of its tangent: the
partial derivatives of `gms_fsm.language.derivative` times the tangents of what it reads. Branches
are those of the values. A tangent is a number, or an array with one entry per direction: the text
is the same.
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from gms_fsm.errors import ParameterError
from gms_fsm.language import derivative, names_in, parse_value, spell
from gms_fsm.language.tree import Number, Value
from gms_fsm.lowering.generated import SIGNALS, CarefulText, ieee, load
from gms_fsm.lowering.program import Program

MARK = "d__"  # before the name of a value: its tangent
FUNCTIONS = ("flow", "observe", "margins", "normal", "act", "tick", "follow")
VECTORS = ("y", "dy", "out")  # arrays that have tangents
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
    if program.callables:
        name = next(iter(program.callables))
        raise ParameterError(
            "a Python function has no derivative here",
            place=f"signal {name!r}",
            advice="give the signal as an expression or as corners",
            key=("sensitivities",),
        )
    return _made(program.source, program.plan.title, active)


@functools.lru_cache(maxsize=64)
def _made(source: str, title: str, active: ActiveNumbers) -> Mapping[str, Any]:
    text = with_tangents(source, active)
    fast, careful = load(title, text, SIGNALS), CarefulText(title, text, SIGNALS)
    functions = {name: ieee(fast[name], careful[name]) for name in FUNCTIONS}
    return functions | {"text": text, "plain flow": fast["flow"]}


def with_tangents(source: str, active: ActiveNumbers, names: Iterable[str] = FUNCTIONS) -> str:
    """Return the text of some functions with tangents, and all constants of the text."""
    body: list[ast.stmt] = []
    for part in ast.parse(source).body:
        if isinstance(part, ast.FunctionDef):
            if part.name in names:
                body.append(_function(part, active))
        else:
            body.append(part)
    return ast.unparse(ast.fix_missing_locations(ast.Module(body, [])))


def _function(function: ast.FunctionDef, active: ActiveNumbers) -> ast.FunctionDef:
    """Return a function with tangents."""
    filled = [arg.arg for arg in function.args.args if arg.arg in VECTORS[1:]]
    arguments = [MARK + name for name in ("t", "y", "p", *filled)]
    function.args.args += [ast.arg(name) for name in arguments]
    writer = _TangentWriter(active, function)
    function.body = writer.block(function.body)
    return function


class _TangentWriter:
    """Writes the assignments of tangents of one function."""

    def __init__(self, active: ActiveNumbers, function: ast.FunctionDef) -> None:
        self.places = active
        self.active = {"t", *VECTORS}
        while True:  # until no more names depend on something that has a tangent
            before = len(self.active)
            for node in ast.walk(function):
                match node:
                    case (
                        ast.Assign(targets=[ast.Name(id=name)], value=value)
                        | ast.AugAssign(target=ast.Name(id=name), value=value)
                    ):
                        if name not in self.active and self.tangent(value) != ZERO:
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
                    found += self.assigned(target, self.tangent(value))
                case ast.AugAssign(target=ast.Name(id=name) as target, value=value):
                    more = self.tangent(value)
                    if name in self.active and more != ZERO:
                        found += self.assigned(target, f"{MARK}{name} + {more}")
                case ast.If() if _is_rounding(each):
                    found.append(each)
                    continue
                case ast.If(body=body, orelse=orelse):
                    each.body, each.orelse = self.block(body), self.block(orelse)
                case ast.For(body=body) | ast.While(body=body):
                    each.body = self.block(body)
            found.append(each)
        return found

    def assigned(self, target: ast.expr, value: str) -> list[ast.stmt]:
        """Return the assignment of the tangent of a target, if it has one."""
        match target:
            case ast.Name(id=name) if name in self.active:
                return ast.parse(f"{MARK}{name} = {value}").body
            case ast.Subscript(value=ast.Name(id=name), slice=place) if name in VECTORS:
                return ast.parse(f"{MARK}{name}[{ast.unparse(place)}] = {value}").body
        return []

    # ------------------------------------------------------------------ expressions
    def tangent(self, value: ast.expr) -> str:
        """Return the tangent of an expression as text."""
        atoms = _Atoms(self)
        try:
            text = ast.unparse(atoms.visit(ast.parse(ast.unparse(value), mode="eval")))
        except _NoNumber:
            return ZERO
        if not any(slope != ZERO for _, slope in atoms.found.values()):
            return ZERO
        tree = parse_value(text, atoms.found)
        written = {name: here for name, (here, _) in atoms.found.items()}
        terms = []
        for name in sorted(names_in(tree), key=lambda each: int(each[1:])):
            slope = atoms.found[name][1]
            partial = derivative(tree, name) if slope != ZERO else None
            if partial is None or partial == Number(0.0):
                continue
            terms.append(
                slope if partial == Number(1.0) else f"{_factor(partial, written)} * {slope}"
            )
        return f"({' + '.join(terms)})" if terms else ZERO


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
