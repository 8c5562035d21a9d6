"""The printer of LLVM's language, in the plainest form; LLVM itself makes it fast.

Locals are places on the stack, which LLVM turns into registers. Functions of the C library are
called as they are (``nobuiltin``): LLVM would otherwise turn pow(z, 0.5) into sqrt, which differs
in the last bits. Nothing is contracted or reassociated.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence

from integrators.machine_code.tree import (
    Address,
    AddressOf,
    Assign,
    AssignMany,
    Break,
    Callback,
    Choose,
    Const,
    ConstantTable,
    Continue,
    Do,
    Expr,
    For,
    Foreign,
    Global,
    If,
    Invoke,
    Load,
    Local,
    Logic,
    Module,
    Op,
    Put,
    Return,
    Statement,
    TypedFunction,
    While,
)
from integrators.machine_code.tuning import KEEPING

__all__ = ["llvm_text"]

_TYPES = {"f": "double", "i": "i64", "b": "i1", "p": "ptr"}
_FLOATS = {"+": "fadd", "-": "fsub", "*": "fmul", "/": "fdiv"}
_INTEGERS = {
    "+": "add", "-": "sub", "*": "mul", "&": "and", "|": "or", "^": "xor", "<<": "shl",
    ">>": "ashr",
}  # fmt: skip
_SIGNS = {"<": "lt", "<=": "le", ">": "gt", ">=": "ge"}


def llvm_text(module: Module) -> str:
    """Return a module in LLVM's language.

    Parameters
    ----------
    module : Module
        From `integrators.machine_code.front_end.translate.Translator`.

    Returns
    -------
    str
        The text.

    Examples
    --------
    >>> from integrators.machine_code.front_end.translate import Translator
    >>> from integrators.machine_code.front_end.values import NumberValue
    >>> from integrators.step_size import memory_of
    >>> translator = Translator()
    >>> _ = translator.entry("entry", memory_of, [NumberValue(Local("f", "root"))])
    >>> "define internal double @memory_of(" in llvm_text(translator.module)
    True
    """
    foreign: dict[str, int] = {}
    functions = [_Writer(function, module, foreign).text() for function in module.functions]
    lines = [_table(table) for table in module.tables]
    for name, kinds in module.outer.items():
        lines.append(f"declare i64 @{name}({', '.join(_TYPES[kind] for kind in kinds)})")
    if module.callbacks and module.outer:  # those of the other module
        lines.append(f"@callbacks = external global [{module.callbacks} x ptr]")
    elif module.callbacks:
        lines.append(f"@callbacks = global [{module.callbacks} x ptr] zeroinitializer")
    lines += ["declare double @llvm.sqrt.f64(double)", "declare double @llvm.fabs.f64(double)"]
    lines += ["declare double @llvm.copysign.f64(double, double)"]
    for name, count in foreign.items():
        arguments = ", ".join(["double"] * count)
        lines.append(f"declare double @{name}({arguments}) nounwind memory(none)")
    # Addresses, integers and floats in memory do not overlap.
    aliases = [
        '!0 = !{!"memory"}',
        *(f'!{k} = !{{!"{name}", !0}}' for k, name in enumerate(("f", "i", "b", "p"), 1)),
        *(f"!{k + 4} = !{{!{k}, !{k}, i64 0}}" for k in range(1, 5)),
    ]
    aliases += ["!9 = distinct !{!9, !10}", '!10 = !{!"llvm.loop.unroll.full"}']
    return "\n".join([*lines, *functions, *aliases, ""])


_ALIAS = {"f": "!5", "i": "!6", "b": "!7", "p": "!8"}


def _table(table: ConstantTable) -> str:
    entries = ", ".join(f"double {_float(value)}" for value in table.values)
    return (
        f"@{table.name} = private unnamed_addr constant [{len(table.values)} x double] [{entries}]"
    )


def _float(value: float) -> str:
    bits = struct.unpack("<Q", struct.pack("<d", value))[0]
    return f"0x{bits:016X}"


_INLINE = {True: " alwaysinline", False: " noinline", None: ""}
LONGEST = 300  # lines of a function that is put inline because that was asked for
MOST_TURNS = 8  # of loops that call functions and are written out


def _calls(body: Sequence[Statement]) -> bool:
    """Return whether statements call functions for what they do."""
    for each in body:
        if isinstance(each, Do):
            return True
        if isinstance(each, If) and (_calls(each.body) or _calls(each.orelse)):
            return True
    return False


class _Writer:
    """Writes one function."""

    def __init__(self, function: TypedFunction, module: Module, foreign: dict[str, int]) -> None:
        self.function, self.module, self.foreign = function, module, foreign
        self.results = dict.fromkeys(module.outer, "i")
        self.results |= {each.name: each.results for each in module.functions}
        self.keeping = {
            each.name
            for each in module.functions
            if not each.entry and re.sub(r"_\d+$", "", each.name) in KEEPING
        }
        self.lines: list[str] = []
        self.counter = 0
        self.loops: list[tuple[str, str]] = []  # labels of continue and break
        self.ended = False
        self.parameters = set(function.parameters)

    def text(self) -> str:
        """Return its text."""
        function = self.function
        names = ", ".join(map(self.parameter, function.parameters))
        head = "define" if function.entry else "define internal"
        for each in function.variables:
            self.lines.append(f"  %{_name(each.name)} = alloca {_TYPES[each.kind]}")
        self.block(function.body)
        if not self.ended:
            self.lines.append("  ret void" if not function.results else "  unreachable")
        inline = _INLINE[None if function.inline and len(self.lines) > LONGEST else function.inline]
        results = self.result(function.results)
        # Of a loop with a call of memcpy LLVM makes no vectors.
        calls = ' "no-builtin-memcpy"' if function.apart else ""
        head += self.convention(function.name)
        opening = f"{head} {results} @{function.name}({names}) nounwind{inline}{calls} {{"
        return "\n".join([opening, "entry:", *self.lines, "}"])

    def parameter(self, local: Local) -> str:
        """Return a parameter with what is known of it."""
        name, known = local.name.partition(".")[0], ""
        if name in self.function.apart:
            known = " noalias"
        elif self.function.apart and self.module.words and name == "block":
            known = f" align 8 dereferenceable({8 * self.module.words})"
        return f"{_TYPES[local.kind]}{known} %{_name(local.name)}"

    @staticmethod
    def result(kinds: str) -> str:
        """Return the type of results."""
        if not kinds:
            return "void"
        if len(kinds) == 1:
            return _TYPES[kinds]
        return "{" + ", ".join(_TYPES[kind] for kind in kinds) + "}"

    def new(self, line: str) -> str:
        """Write a line with a result, and return its name."""
        self.counter += 1
        name = f"%t{self.counter}"
        self.lines.append(f"  {name} = {line}")
        return name

    def label(self, name: str) -> str:
        """Return a new label."""
        self.counter += 1
        return f"{name}{self.counter}"

    def place(self, label: str) -> None:
        """Begin a block."""
        self.lines.append(f"{label}:")
        self.ended = False

    def jump(self, label: str) -> None:
        """Go to a block, unless this one has ended."""
        if not self.ended:
            self.lines.append(f"  br label %{label}")
        self.ended = True

    def branch(self, test: str, yes: str, no: str) -> None:
        """End a block with a branch."""
        self.lines.append(f"  br i1 {test}, label %{yes}, label %{no}")
        self.ended = True

    # ------------------------------------------------------------------ statements
    def block(self, body: Sequence[Statement]) -> None:
        """Write statements; those after a jump are never reached."""
        for statement in body:
            if self.ended:
                return
            self.statement(statement)

    def statement(self, statement: Statement) -> None:
        """Write a statement."""
        match statement:
            case Assign(target=target, value=value):
                kind = _TYPES[target.kind]
                self.lines.append(f"  store {kind} {self.value(value)}, ptr %{_name(target.name)}")
            case AssignMany(targets=targets, call=call):
                made = self.call(call)
                kinds = self.result(self.results[call.name])
                for k, target in enumerate(targets):
                    part = self.new(f"extractvalue {kinds} {made}, {k}")
                    kind = _TYPES[target.kind]
                    self.lines.append(f"  store {kind} {part}, ptr %{_name(target.name)}")
            case Put(kind=kind, address=address, value=value):
                self.put(kind, address, self.value(value))
            case Do(call=Invoke(kind="") as call):
                self.call(call)
            case Do(call=call):
                self.value(call)
            case If():
                self.branches(statement)
            case While(test=test, body=body):
                self.loop(test, body)
            case For():
                self.counted(statement)
            case Break():
                self.jump(self.loops[-1][1])
            case Continue():
                self.jump(self.loops[-1][0])
            case Return(values=values):
                self.give([self.value(value) for value in values])

    def put(self, kind: str, address: Address, value: str) -> None:
        """Write to memory."""
        place = self.address(address)
        if kind == "b":
            value = self.new(f"zext i1 {value} to i8")
            self.lines.append(f"  store i8 {value}, ptr {place}, !tbaa {_ALIAS[kind]}")
        else:
            self.lines.append(f"  store {_TYPES[kind]} {value}, ptr {place}, !tbaa {_ALIAS[kind]}")

    def give(self, values: Sequence[str]) -> None:
        """Return numbers."""
        kinds = self.function.results
        if not kinds:
            self.lines.append("  ret void")
        elif len(kinds) == 1:
            self.lines.append(f"  ret {_TYPES[kinds]} {values[0]}")
        else:
            whole, whole_type = "undef", self.result(kinds)
            for k, (kind, value) in enumerate(zip(kinds, values, strict=True)):
                whole = self.new(f"insertvalue {whole_type} {whole}, {_TYPES[kind]} {value}, {k}")
            self.lines.append(f"  ret {whole_type} {whole}")
        self.ended = True

    def branches(self, statement: If) -> None:
        """Write a branch."""
        yes, no, end = self.label("yes"), self.label("no"), self.label("end")
        self.test(statement.test, yes, no if statement.orelse else end)
        self.place(yes)
        self.block(statement.body)
        self.jump(end)
        if statement.orelse:
            self.place(no)
            self.block(statement.orelse)
            self.jump(end)
        self.place(end)

    def loop(self, test: Expr, body: Sequence[Statement]) -> None:
        """Write a while loop."""
        head, inside, end = self.label("head"), self.label("body"), self.label("end")
        self.jump(head)
        self.place(head)
        self.test(test, inside, end)
        self.place(inside)
        self.loops.append((head, end))
        self.block(body)
        self.loops.pop()
        self.jump(head)
        self.place(end)

    def counted(self, statement: For) -> None:
        """Write a loop over a range."""
        place = f"%{_name(statement.target.name)}"
        head, inside, more, end = map(self.label, ("head", "body", "more", "end"))
        stop = self.value(statement.stop)
        self.lines.append(f"  store i64 {self.value(statement.start)}, ptr {place}")
        self.jump(head)
        self.place(head)
        now = self.new(f"load i64, ptr {place}")
        self.branch(self.new(f"icmp slt i64 {now}, {stop}"), inside, end)
        self.place(inside)
        self.loops.append((more, end))
        self.block(statement.body)
        self.loops.pop()
        self.jump(more)
        self.place(more)
        now = self.new(f"load i64, ptr {place}")
        self.lines.append(
            f"  store i64 {self.new(f'add nsw i64 {now}, {statement.step}')}, ptr {place}"
        )
        self.jump(head)
        if isinstance(statement.stop, Const) and isinstance(statement.start, Const):
            turns = statement.stop.value - statement.start.value
            if turns <= MOST_TURNS and _calls(statement.body):
                self.lines[-1] += ", !llvm.loop !9"
        self.place(end)

    def test(self, expr: Expr, yes: str, no: str) -> None:
        """Go to one of two blocks."""
        match expr:
            case Logic(op=op, left=left, right=right):
                middle = self.label("and")
                if op == "and":
                    self.test(left, middle, no)
                else:
                    self.test(left, yes, middle)
                self.place(middle)
                self.test(right, yes, no)
            case Op(op="not", operands=(inner,)):
                self.test(inner, no, yes)
            case _:
                self.branch(self.value(expr), yes, no)

    # ------------------------------------------------------------------ expressions
    def value(self, expr: Expr) -> str:
        """Write an expression and return its result."""
        match expr:
            case Const(kind="f", value=value):
                return _float(value)
            case Const(value=value):
                return str(int(value))
            case Local(kind=kind, name=name):
                if expr in self.parameters:
                    return f"%{_name(name)}"
                return self.new(f"load {_TYPES[kind]}, ptr %{_name(name)}")
            case Global(name=name):
                return f"@{name}"
            case Load(kind=kind, address=address):
                return self.load(kind, address)
            case AddressOf(address=address):
                return self.address(address)
            case Logic() | Choose():
                return self.joined(expr)
            case Op():
                return self.operation(expr)
            case Invoke():
                return self.call(expr)
            case Foreign(name=name, arguments=arguments):
                self.foreign[name] = len(arguments)
                given = ", ".join(f"double {self.value(each)}" for each in arguments)
                return self.new(f"call double @{name}({given}) nobuiltin")
            case Callback(number=number, arguments=arguments):
                place = self.new(f"getelementptr i8, ptr @callbacks, i64 {8 * number}")
                function = self.new(f"load ptr, ptr {place}")
                given = ", ".join(f"double {self.value(each)}" for each in arguments)
                return self.new(f"call double {function}({given})")

    def joined(self, expr: Logic | Choose) -> str:
        """Write an expression of which only a part is evaluated."""
        yes, no, end = self.label("yes"), self.label("no"), self.label("end")
        kind = _TYPES[expr.kind]
        if isinstance(expr, Choose):
            self.test(expr.test, yes, no)
            parts: tuple[Expr, Expr] = expr.yes, expr.no
        else:
            self.test(expr, yes, no)
            parts = Const("b", True), Const("b", False)
        ends = []
        for label, part in zip((yes, no), parts, strict=True):
            self.place(label)
            value = self.value(part)
            last = self.label("last")
            self.jump(last)
            self.place(last)
            self.jump(end)
            ends.append(f"[{value}, %{last}]")
        self.place(end)
        return self.new(f"phi {kind} {', '.join(ends)}")

    def load(self, kind: str, address: Address) -> str:
        """Read from memory."""
        place = self.address(address)
        if kind == "b":
            byte = self.new(f"load i8, ptr {place}, !tbaa {_ALIAS[kind]}")
            return self.new(f"icmp ne i8 {byte}, 0")
        return self.new(f"load {_TYPES[kind]}, ptr {place}, !tbaa {_ALIAS[kind]}")

    def address(self, address: Address) -> str:
        """Write an address."""
        place = self.value(address.base)
        if address.offset:
            place = self.new(f"getelementptr inbounds i8, ptr {place}, i64 {address.offset}")
        if address.index is not None:
            entry = "i8" if address.size == 1 else "double"
            index = self.value(address.index)
            place = self.new(f"getelementptr inbounds {entry}, ptr {place}, i64 {index}")
        return place

    def operation(self, expr: Op) -> str:
        """Write an operation."""
        op, parts = expr.op, [self.value(each) for each in expr.operands]
        kind = expr.operands[0].kind
        a, b, type_ = parts[0], parts[-1], _TYPES[kind]
        if op in ("<", "<=", ">", ">=", "==", "!="):
            return self.new(f"{_compare(op, kind)} {type_} {a}, {b}")
        if op in ("min", "max"):
            sign = _compare("<" if op == "min" else ">", kind)
            test = self.new(f"{sign} {type_} {b}, {a}")
            return self.new(f"select i1 {test}, {type_} {b}, {type_} {a}")
        if op == "not":
            return self.new(f"xor i1 {a}, true")
        if op == "float":
            sign = "uitofp" if kind == "b" else "sitofp"
            return self.new(f"{sign} {type_} {a} to double")
        if op == "int":
            sign = "zext" if kind == "b" else "fptosi"
            return self.new(f"{sign} {type_} {a} to i64")
        if kind == "f":
            if op == "neg":
                return self.new(f"fneg double {a}")
            if op in ("abs", "sqrt", "copysign"):
                name = "fabs" if op == "abs" else op
                given = ", ".join(f"double {each}" for each in parts)
                return self.new(f"call double @llvm.{name}.f64({given})")
            return self.new(f"{_FLOATS[op]} double {a}, {b}")
        if op == "neg":
            return self.new(f"sub i64 0, {a}")
        if op == "abs":
            test = self.new(f"icmp slt i64 {a}, 0")
            minus = self.new(f"sub i64 0, {a}")
            return self.new(f"select i1 {test}, i64 {minus}, i64 {a}")
        if op in ("//", "%"):
            return self.floored(op, a, b)
        return self.new(f"{_INTEGERS[op]} i64 {a}, {b}")

    def floored(self, op: str, a: str, b: str) -> str:
        """Write a division of integers that rounds down, as Python's does."""
        quotient, rest = self.new(f"sdiv i64 {a}, {b}"), self.new(f"srem i64 {a}, {b}")
        differ = self.new(f"icmp slt i64 {self.new(f'xor i64 {rest}, {b}')}, 0")
        uneven = self.new(f"icmp ne i64 {rest}, 0")
        low = self.new(f"and i1 {differ}, {uneven}")
        if op == "//":
            return self.new(f"sub i64 {quotient}, {self.new(f'zext i1 {low} to i64')}")
        raised = self.new(f"add i64 {rest}, {b}")
        return self.new(f"select i1 {low}, i64 {raised}, i64 {rest}")

    def call(self, call: Invoke) -> str:
        """Write a call of a function of the module."""
        given = ", ".join(f"{_TYPES[each.kind]} {self.value(each)}" for each in call.arguments)
        how = self.convention(call.name)
        line = f"call{how} {self.result(self.results[call.name])} @{call.name}({given})"
        if not self.results[call.name]:
            self.lines.append(f"  {line}")
            return ""
        return self.new(line)

    def convention(self, name: str) -> str:
        """Return how a function is called, if not as in C."""
        return " preserve_allcc" if name in self.keeping else ""


def _compare(op: str, kind: str) -> str:
    """Return the instruction of a comparison; with NaN only != is true."""
    if kind == "f":
        return "fcmp une" if op == "!=" else f"fcmp o{'eq' if op == '==' else _SIGNS[op]}"
    if op in ("==", "!="):
        return "icmp eq" if op == "==" else "icmp ne"
    return f"icmp {'u' if kind == 'b' else 's'}{_SIGNS[op]}"


def _name(name: str) -> str:
    return f'"{name}"'
