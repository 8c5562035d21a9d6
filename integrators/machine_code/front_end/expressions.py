"""Values of expressions: names, fields, entries, operations, choices and calls."""

from __future__ import annotations

import ast
import builtins
import math
import operator
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from integrators.machine_code.front_end.passing import ANY_LENGTH, passed_of, without_lengths
from integrators.machine_code.front_end.values import (
    ArrayValue,
    FixedValue,
    NumberValue,
    RecordValue,
    Value,
    plus,
    substituted,
)
from integrators.machine_code.front_end.work import Work, as_kind, common
from integrators.machine_code.tree import (
    Assign,
    AssignMany,
    Callback,
    Choose,
    Const,
    Do,
    Expr,
    Foreign,
    Invoke,
    Load,
    Local,
    Logic,
    Op,
    OuterEntry,
    may_write,
    parts_of,
)

# Called as the C library has it, which is exact. What is rounded there differs from one library to
# the next; instead of exp, sin ... of `math` there are those of `integrators.elementary`.
FOREIGN: Mapping[Any, str] = {math.nextafter: "nextafter"}
_OPERATORS: Mapping[type[ast.AST], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", operator.add),
    ast.Sub: ("-", operator.sub),
    ast.Mult: ("*", operator.mul),
    ast.Div: ("/", operator.truediv),
    ast.FloorDiv: ("//", operator.floordiv),
    ast.Mod: ("%", operator.mod),
    ast.BitAnd: ("&", operator.and_),
    ast.BitOr: ("|", operator.or_),
    ast.BitXor: ("^", operator.xor),
    ast.LShift: ("<<", operator.lshift),
    ast.RShift: (">>", operator.rshift),
}
_COMPARISONS: Mapping[type[ast.AST], tuple[str, Callable[[Any, Any], bool]]] = {
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
}


@dataclass(frozen=True)
class HostFunction:
    """A function of the host program, from float to float, called by its number."""

    number: int


def value(work: Work, node: ast.expr) -> Value:
    """Translate an expression."""
    match node:
        case ast.Constant(value=bool() | int() | float() as given):
            return NumberValue(_constant(given))
        case ast.Name(id=name):
            return _named(work, name)
        case ast.Attribute(value=whole, attr=name):
            return _attribute(work, value(work, whole), name)
        case ast.Subscript():
            return subscript(work, node)
        case ast.Call():
            made = call(work, node)
            if made is None:
                raise work.error("the function returns nothing")
            return made
        case ast.BinOp(left=left, op=op, right=right):
            a, b = _numbers(work, [left, right])
            return NumberValue(operation(work, op, a, b))
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return NumberValue(negated(condition(work, operand)))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return NumberValue(_minus(work, number(work, operand)))
        case ast.Compare(left=left, ops=ops, comparators=others):
            return NumberValue(_comparison(work, left, ops, others))
        case ast.BoolOp():
            return NumberValue(condition(work, node))
        case ast.IfExp(test=test, body=yes, orelse=no):
            return _choice(work, test, yes, no)
        case ast.Tuple(elts=parts):
            values = [steady(work, each) for each in in_order(work, parts)]
            return RecordValue(tuple, {str(k): each for k, each in enumerate(values)})
    raise work.error("this expression is not part of the subset")


def number(work: Work, node: ast.expr) -> Expr:
    """Translate an expression that is a number."""
    made = value(work, node)
    if not isinstance(made, NumberValue):
        raise work.error(f"{ast.unparse(node)} is not a number")
    return made.expr


def integer(work: Work, node: ast.expr) -> Expr:
    """Translate an expression that is an integer."""
    expr = number(work, node)
    if expr.kind == "f":
        raise work.error(f"{ast.unparse(node)} is not an integer")
    return as_kind(work, expr, "i")


def in_order(work: Work, nodes: Sequence[ast.expr]) -> list[Value]:
    """Translate operands; what is read from memory stays on its side of a call."""
    made: list[Value] = []
    for k, node in enumerate(nodes):
        each = value(work, node)
        if isinstance(each, NumberValue) and may_write(each.expr):
            touched = [isinstance(u, NumberValue) and contains(u.expr, Load | Invoke) for u in made]
            made = [steady(work, u) if old else u for u, old in zip(made, touched, strict=True)]
            if any(touched) or any(not isinstance(u, ast.Constant) for u in nodes[k + 1 :]):
                each = steady(work, each)
        made.append(each)
    return made


def steady(work: Work, each: Value) -> Value:
    """Return a number with its present value, anything else as it is."""
    return NumberValue(work.kept(each.expr)) if isinstance(each, NumberValue) else each


def contains(expr: Expr, kind: Any) -> bool:
    """Return whether an expression has a part of some class."""
    return any(isinstance(each, kind) for each in parts_of(expr))


def _numbers(work: Work, nodes: Sequence[ast.expr]) -> list[Expr]:
    """Translate several numbers, in order."""
    made = in_order(work, nodes)
    for node, each in zip(nodes, made, strict=True):
        if not isinstance(each, NumberValue):
            raise work.error(f"{ast.unparse(node)} is not a number")
    return [each.expr for each in made if isinstance(each, NumberValue)]


# --------------------------------------------------------------------------- names and parts
def _named(work: Work, name: str) -> Value:
    """Return what a name stands for."""
    if name in work.scope:
        return work.scope[name]
    if name in work.assigned:
        raise work.error(f"{name} is read before it is assigned")
    if name in work.names:
        return _object(work, work.names[name], name)
    if hasattr(builtins, name):
        return FixedValue(getattr(builtins, name))
    raise work.error(f"{name} is not defined")


def _object(work: Work, given: Any, name: str = "") -> Value:
    """Return a Python object as a value."""
    if isinstance(given, bool | int | float):
        return NumberValue(replace(_constant(given), name=name))
    if isinstance(given, tuple) and not hasattr(given, "_fields"):
        return work.translator.table(given)
    return FixedValue(given)


def _attribute(work: Work, whole: Value, name: str) -> Value:
    """Return a field of a tuple, or a member of a module."""
    if isinstance(whole, RecordValue) and name in whole.fields:
        part = whole[name]
        return _object(work, part.value) if isinstance(part, FixedValue) else part
    if isinstance(whole, FixedValue) and isinstance(whole.value, types.ModuleType):
        return _object(work, getattr(whole.value, name))
    raise work.error(f"there is no {name}")


def subscript(work: Work, node: ast.Subscript) -> Value:
    """Return an entry, a row, or the first entries of an array."""
    whole = value(work, node.value)
    if isinstance(whole, RecordValue) and isinstance(node.slice, ast.Constant):
        return whole.fields[str(node.slice.value)]
    if not isinstance(whole, ArrayValue):
        raise work.error(f"{ast.unparse(node.value)} is not an array")
    if isinstance(node.slice, ast.Slice):
        if node.slice.lower or node.slice.step or node.slice.upper is None:
            raise work.error("only the first entries of an array can be taken")
        dims = work.kept(integer(work, node.slice.upper)), *whole.dims[1:]
        return ArrayValue(whole.kind, dims, whole.base, whole.offset, whole.index)
    place = integer(work, node.slice)
    if isinstance(place, Const) and place.value < 0:
        if whole.dims[0] == ANY_LENGTH:
            raise work.error("a place from the end is written with a minus")
        place = plus(whole.dims[0], place)
    # What is in the place of a row may change while the row is in use.
    if contains(place, Invoke) or (len(whole.dims) > 1 and contains(place, Load)):
        place = work.kept(place)
    return whole.at(place)


# --------------------------------------------------------------------------- operations
def operation(work: Work, op: ast.operator, a: Expr, b: Expr) -> Expr:
    """Return the result of an operator."""
    if isinstance(op, ast.Pow):
        return _power(work, a, b)
    if type(op) not in _OPERATORS:
        raise work.error("this operator is not part of the subset")
    sign, compute = _OPERATORS[type(op)]
    if sign == "/":
        a, b = as_kind(work, a, "f"), as_kind(work, b, "f")
    a, b = common(work, a, b)
    if a.kind == "b":
        a, b = as_kind(work, a, "i"), as_kind(work, b, "i")
    if a.kind == "f" and sign not in "+-*/":
        raise work.error(f"{sign} is for integers only")
    if isinstance(b, Const) and b.value == 0 and sign in ("//", "%"):
        raise work.error("division by zero")
    if isinstance(a, Const) and isinstance(b, Const):
        # Names of bits say more than their sum; -2 - ARREST is a refused edge.
        named = b.name and (sign == "-" or (sign == "|" and a.name))
        if not (named or (sign == "/" and b.value == 0.0)):
            return _constant(compute(a.value, b.value))
    return Op(a.kind, sign, (a, b))


def _power(work: Work, a: Expr, b: Expr) -> Expr:
    if a.kind != "f" and b.kind != "f":
        if isinstance(a, Const) and isinstance(b, Const) and b.value >= 0:
            return _constant(a.value**b.value)
        raise work.error("a power of integers is not part of the subset")
    raise work.error("a power of floats is not part of the subset: call elementary.power")


def _minus(work: Work, expr: Expr) -> Expr:
    if expr.kind == "b":
        expr = as_kind(work, expr, "i")
    if isinstance(expr, Const):
        return Const(expr.kind, -expr.value)
    return Op(expr.kind, "neg", (expr,))


def _comparison(
    work: Work, left: ast.expr, ops: Sequence[ast.cmpop], others: Sequence[ast.expr]
) -> Expr:
    """Return a comparison, which may be a chain."""
    if isinstance(ops[0], ast.In | ast.NotIn) and isinstance(others[0], ast.Tuple):
        whole = _once(work, number(work, left))
        found: Expr = Const("b", False)
        for each in others[0].elts:
            found = _or(found, _compared(work, ast.Eq(), whole, number(work, each)))
        return negated(found) if isinstance(ops[0], ast.NotIn) else found
    first, *inner, last = _numbers(work, [left, *others])
    parts = [first, *(_once(work, each) for each in inner), last]
    result: Expr = Const("b", True)
    for a, op, b in zip(parts, ops, parts[1:], strict=False):
        result = _and(result, _compared(work, op, a, b))
    return result


def _once(work: Work, expr: Expr) -> Expr:
    """Return an expression that can be read twice."""
    return work.kept(expr) if contains(expr, Invoke | Callback) else expr


def _compared(work: Work, op: ast.cmpop, a: Expr, b: Expr) -> Expr:
    if type(op) not in _COMPARISONS:
        raise work.error("this comparison is not part of the subset")
    sign, compute = _COMPARISONS[type(op)]
    a, b = common(work, a, b)
    if isinstance(a, Const) and isinstance(b, Const):
        return Const("b", compute(a.value, b.value))
    return Op("b", sign, (a, b))


def condition(work: Work, node: ast.expr) -> Expr:
    """Translate an expression as a truth value."""
    if isinstance(node, ast.BoolOp):
        join = _and if isinstance(node.op, ast.And) else _or
        made: Expr | None = None
        for each in node.values:
            before = len(work.out)
            part = condition(work, each)
            if made is not None and len(work.out) != before:
                raise work.error("after and and or only plain expressions are possible")
            made = part if made is None else join(made, part)
            if isinstance(made, Const) and made.value is isinstance(node.op, ast.Or):
                break  # what comes after it is never asked, and not translated
        assert made is not None
        return made
    expr = number(work, node)
    if expr.kind == "b":
        return expr
    if isinstance(expr, Const):
        return Const("b", bool(expr.value))
    return Op("b", "!=", (expr, Const(expr.kind, 0 if expr.kind == "i" else 0.0)))


def _choice(work: Work, test: ast.expr, yes: ast.expr, no: ast.expr) -> Value:
    """Translate a conditional expression."""
    chosen = condition(work, test)
    if isinstance(chosen, Const):
        return value(work, yes if chosen.value else no)
    before = len(work.out)
    a, b = value(work, yes), value(work, no)
    if len(work.out) != before:
        raise work.error("the alternatives must be plain expressions")
    if isinstance(a, NumberValue) and isinstance(b, NumberValue):
        u, v = common(work, a.expr, b.expr)
        return NumberValue(Choose(u.kind, chosen, u, v))
    if (
        isinstance(a, ArrayValue)
        and isinstance(b, ArrayValue)
        and (a.kind, len(a.dims)) == (b.kind, len(b.dims))
    ):
        chosen = work.kept(chosen)
        place = Choose("p", chosen, a.beginning, b.beginning)
        dims = tuple(
            u if u == v else work.kept(Choose("i", chosen, u, v))
            for u, v in zip(a.dims, b.dims, strict=True)
        )
        return ArrayValue(a.kind, dims, work.kept(place))
    raise work.error("the alternatives differ in kind")


# --------------------------------------------------------------------------- calls
def call(work: Work, node: ast.Call) -> Value | None:
    """Translate a call."""
    called = value(work, node.func)
    if not isinstance(called, FixedValue):
        raise work.error(f"{ast.unparse(node.func)} is not a function")
    function = called.value
    if isinstance(function, type) and hasattr(function, "_fields"):
        return _record(work, function, node)
    if node.keywords:
        raise work.error("arguments are given by place")
    if function is float and isinstance(node.args[0], ast.Constant):
        return NumberValue(Const("f", float(str(node.args[0].value))))
    arguments = in_order(work, node.args)
    if isinstance(function, types.FunctionType):
        return _own_call(work, function, arguments)
    if function is len:
        return _length(work, arguments[0])
    if isinstance(function, OuterEntry):
        return _outer_call(work, function.name, arguments)
    parts = [each.expr for each in arguments if isinstance(each, NumberValue)]
    if len(parts) != len(arguments):
        raise work.error("the function takes numbers")
    return NumberValue(_known_call(work, function, parts))


def _outer_call(work: Work, name: str, arguments: list[Value]) -> Value:
    """Return a call of an entry of another module."""
    passed: list[Expr] = []
    for each in arguments:
        match each:
            case ArrayValue():
                passed.append(each.beginning)
            case NumberValue(expr=expr):
                passed.append(as_kind(work, expr, "i"))
            case _:
                raise work.error("another module's entry takes arrays and integers")
    work.translator.module.outer[name] = "".join(each.kind for each in passed)
    return NumberValue(Invoke("i", name, tuple(passed)))


def _known_call(work: Work, function: Any, parts: list[Expr]) -> Expr:
    """Return a call of a built-in function."""
    if isinstance(function, HostFunction):
        module = work.translator.module
        module.callbacks = max(module.callbacks, function.number + 1)
        return Callback(function.number, tuple(as_kind(work, each, "f") for each in parts))
    if function in FOREIGN:
        return Foreign(FOREIGN[function], tuple(as_kind(work, each, "f") for each in parts))
    if function in (math.sqrt, math.copysign):
        return Op("f", function.__name__, tuple(as_kind(work, each, "f") for each in parts))
    if function is float:
        return as_kind(work, parts[0], "f")
    if function is int:
        return parts[0] if parts[0].kind == "i" else Op("i", "int", (parts[0],))
    if function in (min, max, abs):
        parts = common(work, *parts)
        if parts[0].kind == "b":
            parts = [as_kind(work, each, "i") for each in parts]
        if function is abs:
            return Op(parts[0].kind, "abs", (parts[0],))
        made = parts[0]
        for each in parts[1:]:
            made = Op(made.kind, function.__name__, (made, each))
        return made
    raise work.error(f"{getattr(function, '__name__', function)} is not part of the subset")


def _length(work: Work, whole: Value) -> Value:
    """Return the length of an array or a tuple."""
    if isinstance(whole, RecordValue):
        return NumberValue(Const("i", len(whole.fields)))
    if not isinstance(whole, ArrayValue):
        raise work.error("a number has no length")
    return NumberValue(whole.dims[0])


def _record(work: Work, cls: Any, node: ast.Call) -> Value:
    """Return a new tuple; its numbers keep their present values."""
    names = [*cls._fields[: len(node.args)], *(str(each.arg) for each in node.keywords)]
    nodes = [*node.args, *(each.value for each in node.keywords)]
    fields: dict[str, Value] = {
        name: FixedValue(given)
        for name, given in cls._field_defaults.items()
        if name not in names and callable(given)
    }
    if sorted([*names, *fields]) != sorted(cls._fields):
        raise work.error(f"{cls.__name__} takes {', '.join(cls._fields)}")
    for name, part in zip(names, nodes, strict=True):
        made = value(work, part)
        fields[name] = made if isinstance(part, ast.Attribute) else steady(work, made)
    return RecordValue(cls, {name: fields[name] for name in cls._fields})


def _own_call(work: Work, function: Callable[..., Any], arguments: list[Value]) -> Value | None:
    """Return a call of another function of the subset."""
    translator = work.translator
    arguments = without_lengths(translator.source(function), arguments)
    given_now, kinds = passed_of(arguments, translator.forms)
    done = translator.translated(function, arguments, kinds)
    name, result, slots = done.function.name, done.result, done.slots
    if isinstance(result, RecordValue | ArrayValue):  # it may contain what is passed
        given_now, _ = passed_of([steady(work, each) for each in arguments], translator.forms)
    passed = tuple(given_now)
    if result is None:
        work.out.append(Do(Invoke("", name, passed)))
        return None
    if isinstance(result, NumberValue):
        return NumberValue(Invoke(slots[0].kind, name, passed))
    given: dict[Local, Expr] = dict(zip(done.function.parameters, passed, strict=True))
    targets = [work.new(slot.kind, slot.to) for slot in slots]
    given.update(zip(slots, targets, strict=True))
    if not slots:
        work.out.append(Do(Invoke("", name, passed)))
    elif len(slots) == 1:
        work.out.append(Assign(targets[0], Invoke(slots[0].kind, name, passed)))
    else:
        work.out.append(AssignMany(tuple(targets), Invoke("", name, passed)))
    return substituted(result, given)  # type: ignore[no-any-return]


# --------------------------------------------------------------------------- small parts
def _constant(given: Any) -> Const:
    """Return a Python number as a constant."""
    if isinstance(given, bool):
        return Const("b", given)
    return Const("f" if isinstance(given, float) else "i", given)


def negated(expr: Expr) -> Expr:
    """Return the opposite of a truth value."""
    if isinstance(expr, Const):
        return Const("b", not expr.value)
    return Op("b", "not", (expr,))


def _and(a: Expr, b: Expr) -> Expr:
    if isinstance(a, Const):
        return b if a.value else a
    return Logic("and", a, b) if not (isinstance(b, Const) and b.value) else a


def _or(a: Expr, b: Expr) -> Expr:
    if isinstance(a, Const):
        return a if a.value else b
    return Logic("or", a, b) if not (isinstance(b, Const) and not b.value) else a
