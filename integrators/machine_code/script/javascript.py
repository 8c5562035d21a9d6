"""The printer of JavaScript, for browsers and node: the same bits as machine code and C.

It is the printer of C with another memory: one array of floats ``F`` seen also as bytes ``B``. An
address is the number of a word of eight bytes. Integers are stored as floats: exact up to 2**53;
those that bits are taken from have 32 bits.
"""

from __future__ import annotations

import inspect
import math
import re
from collections.abc import Callable, Mapping

from integrators.machine_code.c99 import CFields, CNames, CWriter, calls
from integrators.machine_code.front_end.translate import Translator
from integrators.machine_code.front_end.values import NumberValue
from integrators.machine_code.locals import without_copies
from integrators.machine_code.tree import (
    Address,
    AddressOf,
    AssignMany,
    Callback,
    Choose,
    Const,
    Expr,
    Foreign,
    Global,
    Load,
    Local,
    Module,
    Op,
    Put,
    Return,
    Statement,
    TypedFunction,
)

RESERVED = """
    B F Infinity Math NaN arguments async await break case catch class const continue debugger
    default delete div do else enum eval export extends false finally for function if implements in
    instanceof interface let max min mod new nextafter null of package private protected
    public return scratch static super switch this throw true try typeof undefined var void while
    with yield import
"""
HELPERS = {
    "min": "function min(a, b) { return b < a ? b : a; }",
    "max": "function max(a, b) { return b > a ? b : a; }",
    "mod": "function mod(a, b) { const r = a % b; return r !== 0 && r < 0 !== b < 0 ? r + b : r; }",
    "div": "function div(a, b) { return Math.floor(a / b); }",
    "copysign": """\
function copysign(a, b) {
    return b < 0 || (b === 0 && 1 / b < 0) ? -Math.abs(a) : Math.abs(a);
}""",
    "nextafter": """\
const scratch = new Float64Array(1), bits = new BigInt64Array(scratch.buffer);
function nextafter(a, b) {
    if (a !== a || b !== b || a === b) return a === b ? b : NaN;
    if (a === 0) return b > 0 ? 5e-324 : -5e-324;
    scratch[0] = a;
    bits[0] += a < b === a > 0 ? 1n : -1n;
    return scratch[0];
}""",
}
FIRST = 8  # words before the tables: results of functions that have several
_ZEROS = {"f": "0.5", "i": "0", "b": "false", "p": "0"}  # so that a variable keeps its type
_UNARY, _WHOLE = 10, 11


def tables_of(module: Module) -> tuple[Mapping[str, int], list[float]]:
    """Return the words at which tables begin, and all words up to the end of the last one."""
    places, words = dict[str, int](), [0.0] * FIRST
    for table in module.tables:
        places[table.name] = len(words)
        words += table.values
    return places, words


def javascript_text(module: Module) -> str:
    """Return a module as JavaScript: functions of words in ``F`` and bytes in ``B``.

    Examples
    --------
    >>> from integrators.machine_code.front_end.translate import Translator
    >>> from integrators.machine_code.tree import Local
    >>> from integrators.machine_code.front_end.values import NumberValue
    >>> from integrators.step_size import memory_of
    >>> translator = Translator()
    >>> _ = translator.entry("entry", memory_of, [NumberValue(Local("f", "root"))])
    >>> print(javascript_text(translator.module).strip())
    function max(a, b) { return b > a ? b : a; }
    function memory_of(root) {
        return Math.sqrt(max(root, 0.3));
    }
    <BLANKLINE>
    function entry(root) {
        return memory_of(root);
    }
    """
    tables, _ = tables_of(module)
    entries = {each.name for each in module.functions if each.entry}
    taken = {*RESERVED.split(), *HELPERS, "bits"}
    functions = CNames(taken - entries)
    known = taken | {functions(each.name) for each in module.functions}
    results = {each.name: each.results for each in module.functions}
    text = "\n".join(
        _Script(without_copies(each), results, functions, CNames(known), tables).text(static=True)
        for each in module.functions
    )
    used = [each for name, each in HELPERS.items() if re.search(rf"\b{name}\(", text)]
    return "\n".join([*used, text])


def script_number(value: float) -> str:
    """Return a floating-point number in JavaScript."""
    if value != value:
        return "NaN"
    if math.isinf(value):
        return "Infinity" if value > 0 else "-Infinity"
    return repr(value)


class _Script(CWriter):
    """Writes one function."""

    NARROW = False  # that is longer

    def __init__(
        self,
        function: TypedFunction,
        results: dict[str, str],
        functions: CNames,
        locals_: CNames,
        tables: Mapping[str, int],
    ) -> None:
        self.tables = tables
        super().__init__(function, results, functions, locals_, CFields(()))

    def text(self, *, static: bool) -> str:
        """Return its text."""
        del static
        function = self.function
        names = ", ".join(self.name(each.name) for each in function.parameters)
        lines = [f"function {self.functions(function.name)}({names}) {{"]
        own = [f"{self.name(each.name)} = {_ZEROS[each.kind]}" for each in self.first]
        if own:
            lines.append(f"    let {', '.join(own)};")
        body = self.block(function.body, 1)
        if body and body[-1] == "    return;":
            body.pop()
        return "\n".join([*lines, *body, "}", ""])

    def beginning(self, local: Local) -> str:
        """Write what stands before a local that is declared where it gets its value."""
        del local
        return "let "

    # ------------------------------------------------------------------ statements
    def statement(self, statement: Statement, depth: int) -> list[str]:
        """Write a statement."""
        space = "    " * depth
        match statement:
            case AssignMany(targets=targets, call=call):
                kinds = self.results[call.name]
                return [f"{space}{self.value(call)};"] + [
                    f"{space}{self.target(statement, each)} = F[{k}]"
                    f"{' !== 0' if kinds[k] == 'b' else ''};"
                    for k, each in enumerate(targets)
                    if each.name not in self.unread
                ]
            case Return(values=values) if len(values) > 1:
                texts = [self.value(each) for each in values]
                lines = []
                if any(map(calls, values)):  # these leave their results there, too
                    self.counter += 1
                    names = [self.name(f"made.{self.counter}.{k}") for k in range(len(values))]
                    pairs = zip(names, texts, strict=True)
                    lines += [f"{space}const {', '.join(f'{a} = {b}' for a, b in pairs)};"]
                    texts = names
                lines += [f"{space}F[{k}] = {each};" for k, each in enumerate(texts)]
                return [*lines, f"{space}return;"]
            case Put(kind="b", address=address, value=value):
                return [f"{space}{self.place('b', address)} = {self.value(value, 2)} ? 1 : 0;"]
        return super().statement(statement, depth)

    # ------------------------------------------------------------------ expressions
    def bare(self, expr: Expr) -> tuple[str, int]:
        """Write an expression; return also how tightly it binds."""
        match expr:
            case Const(kind="f", value=value):
                text = script_number(value)
                return text, _UNARY if text.startswith("-") else _WHOLE
            case Global(name=name):
                return str(self.tables[name]), _WHOLE
            case Const(kind="p", value=value):
                return str(value // 8), _WHOLE
            case Load(kind="b", address=address):
                return f"{self.place('b', address)} !== 0", 5
            case Callback():
                raise ValueError("JavaScript cannot call a function of the host program")
            case Foreign(name=name, arguments=arguments):
                return f"{name}({', '.join(map(self.value, arguments))})", _WHOLE
            case Choose(kind="i", test=test, yes=yes, no=no) if isinstance(yes, Const):
                parts = (self.value(each, 2) for each in (test, yes, no))
                return "{} ? {} : {}".format(*parts), 1
        return super().bare(expr)

    def operation(self, expr: Op) -> tuple[str, int]:
        """Write an operation."""
        op, kind, parts = expr.op, expr.operands[0].kind, expr.operands
        if op in ("==", "!="):
            a, b = parts
            return f"{self.value(a, 7)} {op}= {self.value(b, 7)}", 5
        if op in ("&", "|", "^", "<<", ">>"):
            a_text, b_text = (self.value(each, _UNARY) for each in parts)
            text = f"{a_text} {op} {b_text}"
            return (f"({text}) !== 0", 5) if expr.kind == "b" else (text, 4)
        if op == "float":  # no integer is -0
            bound = self.value(parts[0], 8)
            return (f"{self.value(parts[0], 2)} ? 1 : 0", 1) if kind == "b" else (f"{bound} + 0", 8)
        if op == "int":
            if kind == "b":
                return f"{self.value(parts[0], 2)} ? 1 : 0", 1
            return f"Math.trunc({self.value(parts[0])})", _WHOLE
        names = {"%": "mod", "//": "div", "abs": "Math.abs", "sqrt": "Math.sqrt"}
        names |= {each: each for each in ("min", "max", "copysign")}
        if op in names:
            return f"{names[op]}({', '.join(map(self.value, parts))})", _WHOLE
        return super().operation(expr)

    # ------------------------------------------------------------------ memory
    def words(self, address: Address) -> str:
        """Write the number of a word."""
        if address.offset % 8:
            raise ValueError(f"JavaScript has no address within a word: {address}")
        base, offset = address.base, address.offset // 8
        parts: list[str] = []
        match base:
            case Global(name=name):
                offset += self.tables[name]
            case Const(value=value):
                offset += value // 8
            case _:
                parts.append(self.value(base, 8))
        index = address.index
        while address.size == 8 and index is not None:
            match index:
                case Const(value=more):
                    index = None
                case Op(op="+", operands=(Const(value=more), index) | (index, Const(value=more))):
                    pass
                case _:
                    break
            offset += more
        if index is not None:
            parts.append(self.value(index, 9))
        if offset or not parts:
            parts.append(f"{offset} /* {address.name} */" if address.name else str(offset))
        return " + ".join(parts)

    def place(self, kind: str, address: Address) -> str:
        """Write a place in memory."""
        if kind != "b":
            return f"F[{self.words(address)}]"
        first = self.words(Address(address.base, address.offset))
        index = "" if address.index is None else f" + {self.value(address.index, 9)}"
        bytes_ = str(8 * int(first)) if first.isdigit() else f"({first}) * 8"
        return f"B[{bytes_}{index}]"

    def address_of(self, expr: AddressOf) -> tuple[str, int]:
        """Write an address."""
        address = expr.address
        if address.size != 8 and address.index is not None:
            raise ValueError(f"JavaScript has no address within a word: {address}")
        return self.words(address), 8


def library_text(functions: Mapping[str, Callable[..., float]]) -> str:
    r"""Return functions of floats as one JavaScript expression: an object with them by name.

    Examples
    --------
    >>> from integrators.step_size import memory_of
    >>> text = library_text({"memory_of": memory_of})
    >>> text.startswith("(() => {") and text.endswith("return { memory_of };\n})()")
    True
    """
    translator = Translator()
    for name, function in functions.items():
        numbers = [NumberValue(Local("f", each)) for each in inspect.signature(function).parameters]
        translator.entry(name, function, numbers)
    _, words = tables_of(translator.module)
    text = javascript_text(translator.module)
    memory = ",".join(map(script_number, words)) if translator.module.tables else ""
    lines = [f"const F = Float64Array.of({memory});", text, f"return {{ {', '.join(functions)} }};"]
    return "\n".join(["(() => {", *lines, "})()"])
