"""The printer of LLVM's language, in the plainest form; LLVM itself makes it fast.

Locals are places on the stack, which LLVM turns into registers. Functions of the C library are
called as they are (``nobuiltin``): LLVM would otherwise turn pow(z, 0.5) into sqrt, which differs
in the last bits. Nothing is contracted or reassociated.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence

from integrators.machine_code.lanes import (
    ALIAS,
    DECLARED,
    TYPES,
    WIDE,
    FunctionLoops,
    LaneWriter,
    Turns,
    groups_of,
    operation,
)
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
    While,
)
from integrators.machine_code.tuning import DISTINCT, FLOWS, IN_ROWS, KEEPING, WITH_FLOWS

__all__ = ["llvm_text"]


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
    scopes = [
        FunctionLoops(each, distinct=_plain(each.name) in DISTINCT) for each in module.functions
    ]
    groups = groups_of(each for each in scopes if _plain(each.function.name) in FLOWS)
    functions = [_Writer(each, module, foreign, groups).text() for each in scopes]
    lines = [_table(table) for table in module.tables]
    for name, kinds in module.outer.items():
        lines.append(f"declare i64 @{name}({', '.join(TYPES[kind] for kind in kinds)})")
    if module.callbacks and module.outer:  # those of the other module
        lines.append(f"@callbacks = external global [{module.callbacks} x ptr]")
    elif module.callbacks:
        lines.append(f"@callbacks = global [{module.callbacks} x ptr] zeroinitializer")
    lines += DECLARED
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
    # Loops that are vectors already, or what is left of them.
    aliases += ["!11 = distinct !{!11, !12, !13}", '!12 = !{!"llvm.loop.unroll.disable"}']
    aliases += ['!13 = !{!"llvm.loop.vectorize.enable", i1 false}']
    return "\n".join([*lines, *functions, *aliases, ""])


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

    def __init__(
        self,
        loops: FunctionLoops,
        module: Module,
        foreign: dict[str, int],
        groups: Sequence[tuple[int, int]],
    ) -> None:
        self.turns, self.module, self.foreign, self.groups = loops, module, foreign, groups
        self.function = function = loops.function
        self.results = dict.fromkeys(module.outer, "i")
        self.results |= {each.name: each.results for each in module.functions}
        self.keeping = {
            each.name
            for each in module.functions
            if not each.entry and _plain(each.name) in KEEPING
        }
        self.lines: list[str] = []
        self.places: list[str] = []  # on the stack, of what lanes assign to
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
            self.lines.append(f"  %{_name(each.name)} = alloca {TYPES[each.kind]}")
        self.block(function.body)
        if not self.ended:
            self.lines.append("  ret void" if not function.results else "  unreachable")
        inline = _INLINE[None if function.inline and len(self.lines) > LONGEST else function.inline]
        results = self.result(function.results)
        # Of a loop with a call of memcpy LLVM makes no vectors.
        calls = ' "no-builtin-memcpy"' if function.apart else ""
        head += self.convention(function.name)
        opening = f"{head} {results} @{function.name}({names}) nounwind{inline}{calls} {{"
        return "\n".join([opening, "entry:", *self.places, *self.lines, "}"])

    def parameter(self, local: Local) -> str:
        """Return a parameter with what is known of it."""
        name, known = local.name.partition(".")[0], ""
        if name in self.function.apart:
            known = " noalias"
        elif self.function.apart and self.module.words and name == "block":
            known = f" align 8 dereferenceable({8 * self.module.words})"
        return f"{TYPES[local.kind]}{known} %{_name(local.name)}"

    @staticmethod
    def result(kinds: str) -> str:
        """Return the type of results."""
        if not kinds:
            return "void"
        if len(kinds) == 1:
            return TYPES[kinds]
        return "{" + ", ".join(TYPES[kind] for kind in kinds) + "}"

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
                kind = TYPES[target.kind]
                self.lines.append(f"  store {kind} {self.value(value)}, ptr %{_name(target.name)}")
            case AssignMany(targets=targets, call=call):
                made = self.call(call)
                kinds = self.result(self.results[call.name])
                for k, target in enumerate(targets):
                    part = self.new(f"extractvalue {kinds} {made}, {k}")
                    kind = TYPES[target.kind]
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
            self.lines.append(f"  store i8 {value}, ptr {place}, !tbaa {ALIAS[kind]}")
        else:
            self.lines.append(f"  store {TYPES[kind]} {value}, ptr {place}, !tbaa {ALIAS[kind]}")

    def give(self, values: Sequence[str]) -> None:
        """Return numbers."""
        kinds = self.function.results
        if not kinds:
            self.lines.append("  ret void")
        elif len(kinds) == 1:
            self.lines.append(f"  ret {TYPES[kinds]} {values[0]}")
        else:
            whole, whole_type = "undef", self.result(kinds)
            for k, (kind, value) in enumerate(zip(kinds, values, strict=True)):
                whole = self.new(f"insertvalue {whole_type} {whole}, {TYPES[kind]} {value}, {k}")
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
        name = _plain(self.function.name)
        if name not in IN_ROWS and (turns := self.turns.of(statement)):
            if turns.bounds is None:
                self.in_lanes(turns)
                return
            for first, width in turns.pieces(self.groups, alone=name in WITH_FLOWS):
                LaneWriter(self, turns, first, width).write()
            return
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

    def in_lanes(self, turns: Turns) -> None:
        """Write a loop as one over vectors, and what is left as one over numbers."""
        place = f"%{_name(turns.loop.target.name)}"
        start, stop = self.value(turns.loop.start), self.value(turns.loop.stop)
        last = self.new(f"sub nsw i64 {stop}, {WIDE - 1}")
        for one, other in turns.apart:  # if places are neighbours, there are no vectors
            gap = self.new(f"sub i64 {self.value(one)}, {self.value(other)}")
            moved = self.new(f"add i64 {gap}, {WIDE - 1}")
            near = self.new(f"icmp ult i64 {moved}, {2 * WIDE - 1}")
            both = self.new(f"and i1 {near}, {self.new(f'icmp ne i64 {gap}, 0')}")
            last = self.new(f"select i1 {both}, i64 {start}, i64 {last}")
        self.lines.append(f"  store i64 {start}, ptr {place}")
        for width, end in ((WIDE, last), (1, stop)):
            head, inside, after = map(self.label, ("head", "body", "end"))
            self.jump(head)
            self.place(head)
            now = self.new(f"load i64, ptr {place}")
            self.branch(self.new(f"icmp slt i64 {now}, {end}"), inside, after)
            self.place(inside)
            LaneWriter(self, turns, now, width).write()
            then = self.new(f"add nsw i64 {now}, {width}")
            self.lines.append(f"  store i64 {then}, ptr {place}")
            self.jump(head)
            self.lines[-1] += ", !llvm.loop !11"
            self.place(after)

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
                return self.new(f"load {TYPES[kind]}, ptr %{_name(name)}")
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
        kind = TYPES[expr.kind]
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
            byte = self.new(f"load i8, ptr {place}, !tbaa {ALIAS[kind]}")
            return self.new(f"icmp ne i8 {byte}, 0")
        return self.new(f"load {TYPES[kind]}, ptr {place}, !tbaa {ALIAS[kind]}")

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
        a, b = parts[0], parts[-1]
        if op == "float":
            sign = "uitofp" if kind == "b" else "sitofp"
            return self.new(f"{sign} {TYPES[kind]} {a} to double")
        if op == "int":
            sign = "zext" if kind == "b" else "fptosi"
            return self.new(f"{sign} {TYPES[kind]} {a} to i64")
        if op == "neg" and kind != "f":
            return self.new(f"sub i64 0, {a}")
        if op == "abs" and kind != "f":
            test = self.new(f"icmp slt i64 {a}, 0")
            minus = self.new(f"sub i64 0, {a}")
            return self.new(f"select i1 {test}, i64 {minus}, i64 {a}")
        if op in ("//", "%"):
            return self.floored(op, a, b)
        return operation(self.new, op, kind, parts)

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
        given = ", ".join(f"{TYPES[each.kind]} {self.value(each)}" for each in call.arguments)
        how = self.convention(call.name)
        line = f"call{how} {self.result(self.results[call.name])} @{call.name}({given})"
        if not self.results[call.name]:
            self.lines.append(f"  {line}")
            return ""
        return self.new(line)

    def convention(self, name: str) -> str:
        """Return how a function is called, if not as in C."""
        return " preserve_allcc" if name in self.keeping else ""


def _plain(name: str) -> str:
    """Return the name of a function without the number of its version."""
    return re.sub(r"_\d+$", "", name)


def _name(name: str) -> str:
    return f'"{name}"'
