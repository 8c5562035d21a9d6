"""The printer of C99, for people and for other tools.

Compiled without contraction (``-ffp-contract=off``) it computes the same bits as LLVM's machine
code: nothing is called but sqrt, fabs, copysign and nextafter, which are exact.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence

from integrators.machine_code.locals import assigned_once, declarations, mentioned
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
    may_write,
    parts_of,
)

__all__ = [
    "HEAD",
    "HELPERS",
    "RESERVED",
    "TYPES",
    "CFields",
    "CNames",
    "CWriter",
    "c99_text",
    "calls",
    "number_text",
    "structure_text",
    "table_text",
]

TYPES = {"f": "double", "i": "int64_t", "b": "bool", "p": "char *"}
HEAD = """\
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#if defined(__FAST_MATH__) || DBL_MANT_DIG != 53
#error "double must be IEEE binary64, and -ffast-math must not be used"
#endif
"""
HELPERS = {
    "min_f": "static inline double min_f(double a, double b) { return b < a ? b : a; }",
    "max_f": "static inline double max_f(double a, double b) { return b > a ? b : a; }",
    "min_i": "static inline int64_t min_i(int64_t a, int64_t b) { return b < a ? b : a; }",
    "max_i": "static inline int64_t max_i(int64_t a, int64_t b) { return b > a ? b : a; }",
    "abs_i": "static inline int64_t abs_i(int64_t a) { return a < 0 ? -a : a; }",
    "mod_i": """\
static inline int64_t mod_i(int64_t a, int64_t b)
{
    int64_t r = a % b;
    return r && (r ^ b) < 0 ? r + b : r;
}""",
    "div_i": """\
static inline int64_t div_i(int64_t a, int64_t b)
{
    return a / b - (a % b && (a ^ b) < 0);
}""",
}
# How tightly operators bind in C, for as few brackets as compilers accept without a warning.
_BINDS = {
    "*": 9, "/": 9, "+": 8, "-": 8, "<": 6, "<=": 6, ">": 6, ">=": 6, "==": 5, "!=": 5,
}  # fmt: skip
_UNARY, _WHOLE = 10, 11


def c99_text(module: Module, taken: Iterable[str] = (), *, hidden: bool = False) -> str:
    """Return a module as one C99 text.

    Parameters
    ----------
    module : Module
        From `integrators.machine_code.front_end.translate.Translator`.
    taken : iterable of str
        Names that the text must not define.
    hidden : bool
        Whether entries are static, too.

    Returns
    -------
    str
        The text. It gives no warning with ``-Wall -Wextra -Wpedantic``.

    Examples
    --------
    >>> from integrators.machine_code.front_end.translate import Translator
    >>> from integrators.machine_code.front_end.values import NumberValue
    >>> from integrators.step_size import memory_of
    >>> translator = Translator()
    >>> _ = translator.entry("entry", memory_of, [NumberValue(Local("f", "root"))])
    >>> print(c99_text(translator.module).partition("static double ")[2].strip())
    memory_of(double root)
    {
        return sqrt(max_f(root, 0.3));
    }
    <BLANKLINE>
    double entry(double root)
    {
        return memory_of(root);
    }
    """
    kinds = sorted({f.results for f in module.functions if len(f.results) > 1})
    parts = [*map(structure_text, kinds), *map(table_text, module.tables)]
    if module.callbacks:
        parts.append(f"double (*callbacks[{module.callbacks}])(double);")
    results = {f.name: f.results for f in module.functions}
    known = {*RESERVED.split(), *taken, *(table.name for table in module.tables)}
    functions = CNames(known - {f.name for f in module.functions if f.entry})
    known |= {functions(f.name) for f in module.functions}
    fields = CFields(known)
    writers = [CWriter(f, results, functions, CNames(known), fields) for f in module.functions]
    parts += [each.text(static=hidden or not each.function.entry) for each in writers]
    if fields.offsets:
        parts.insert(0, fields.text())
    text = "\n".join(parts)
    used = [each for name, each in HELPERS.items() if re.search(rf"\b{name}\b", text)]
    return "\n".join([HEAD, *used, text])


def structure_text(kinds: str) -> str:
    """Return the type of several results."""
    fields = " ".join(f"{TYPES[kind]} v{k};" for k, kind in enumerate(kinds))
    return f"typedef struct {{ {fields} }} many_{kinds};"


def table_text(table: ConstantTable) -> str:
    """Return a table of constants."""
    entries = textwrap.fill(", ".join(map(number_text, table.values)), 92)
    return f"static const double {table.name}[] = {{\n{textwrap.indent(entries, '    ')}\n}};"


def number_text(value: float) -> str:
    """Return a floating-point number in C.

    Parameters
    ----------
    value : float
        Any.

    Returns
    -------
    str
        To the last bit.

    Examples
    --------
    >>> number_text(0.1), number_text(float("-inf"))
    ('0.1', '-INFINITY')
    """
    if value != value:
        return "NAN"
    if value in (float("inf"), float("-inf")):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(value)


def _result(kinds: str) -> str:
    if len(kinds) > 1:
        return f"many_{kinds}"
    return TYPES[kinds] if kinds else "void"


class CNames:
    """Names of C, each for one name of the module."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = {*taken}
        self._found: dict[str, str] = {}

    def __call__(self, name: str) -> str:
        """Return the name of a variable or a function."""
        if name not in self._found:
            words = re.sub(r"\W+", "_", re.sub(r"^\.\d+\.|\.\d+\.$", "", name)).strip("_")
            free = words = f"u{words}" if words[:1].isdigit() else words
            number = 1
            while free in self._taken:
                number += 1
                free = f"{words}_{number}"
            self._taken.add(free)
            self._found[name] = free
        return self._found[name]


class CFields:
    """Constants for where the numbers of records are, in bytes from the beginning of a block."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = {*taken}
        self.offsets: dict[str, int] = {}

    def __call__(self, address: Address) -> str:
        """Return the offset of a place, by its name if that is free."""
        name = re.sub(r"\W", "_", address.name).upper()
        if name in ("", *self._taken) or self.offsets.get(name, address.offset) != address.offset:
            return str(address.offset)
        self.offsets[name] = address.offset
        return name

    def text(self) -> str:
        """Return their definitions."""
        lines = ",\n".join(f"    {name} = {offset}" for name, offset in self.offsets.items())
        return f"enum {{\n{lines}\n}};\n"


RESERVED = """
    INFINITY NAN NULL alignas alignof asm auto bool break callbacks case char const continue
    default do double else enum extern false float for goto if inline int long register restrict
    return short signed sizeof static struct switch true typedef union unsigned void volatile
    while acos asin asinh atan atan2 cos cosh exp fabs floor gamma j0 j1 jn log main nextafter pow
    round sin sinh sqrt tan tanh y0 y1 yn abs_i div_i max_f max_i min_f min_i mod_i
"""


def calls(expr: Expr) -> bool:
    """Return whether an expression calls a function, which may have effects."""
    return any(isinstance(part, Invoke | Callback) for part in parts_of(expr))


def _loops(body: Iterable[Statement]) -> Iterator[For]:
    """Yield all counted loops."""
    for each in body:
        if isinstance(each, For):
            yield each
        if isinstance(each, For | While | If):
            yield from _loops(each.body)
        if isinstance(each, If):
            yield from _loops(each.orelse)


class CWriter:
    """Writes one function."""

    NARROW = True  # whether loops declare counters of their own, and blocks what branches set

    def __init__(
        self,
        function: TypedFunction,
        results: dict[str, str],
        functions: CNames,
        locals_: CNames,
        fields: CFields,
    ) -> None:
        self.function, self.results = function, results
        self.functions, self.name, self.field = functions, locals_, fields
        self.counter = 0  # of results with several parts
        self.read = set[str]()
        self.here = dict[int, frozenset[str]]()  # what statements declare, by their `id`
        self.before = dict[int, list[Local]]()  # what is declared before them
        self.once = assigned_once(function.body)
        self.unread = self._unread()
        found = declarations(function.body, narrow=self.NARROW)
        used = [each for each in function.variables if each.name not in self.unread]
        self.here = {at: names - self.unread for at, names in found.at.items()}
        self.before = {
            at: [u for u in used if u.name in names] for at, names in found.before.items()
        }
        later = frozenset[str]().union(*found.at.values(), *found.before.values())
        self.first = [each for each in used if each.name not in later]

    def _unread(self) -> set[str]:
        """Return the variables that are only written, which compilers warn of."""
        self.unread = set[str]()
        loops = {each.target.name for each in _loops(self.function.body)}
        while True:
            self.read.clear()
            self.block(self.function.body, 1)
            found = {v.name for v in self.function.variables} - self.read - loops
            if found <= self.unread:
                self.counter = 0
                return found
            self.unread = found

    def text(self, *, static: bool) -> str:
        """Return its text."""
        function = self.function
        names = ", ".join(f"{self.declared(p)}{self.name(p.name)}" for p in function.parameters)
        head = f"{self.heading()}static " if static else ""
        opening = (
            f"{head}{_result(function.results)} {self.functions(function.name)}({names or 'void'})"
        )
        lines = [opening, "{"]
        left = self.first
        for statement in function.body:
            inside = mentioned((statement,))
            self.before.setdefault(id(statement), []).extend(u for u in left if u.name in inside)
            left = [each for each in left if each.name not in inside]
        self.read.clear()
        body = self.block(function.body, 1)
        if body and body[-1] == "    return;":
            body.pop()
        unused = [p.name for p in function.parameters if p.name not in self.read]
        lines += [f"    (void){self.name(each)};" for each in unused]
        return "\n".join([*lines, *body, "}", ""])

    def _declarations(self, statement: Statement, depth: int) -> Iterator[str]:
        """Write the declarations of locals that get their values inside a statement."""
        locals_ = self.before.get(id(statement), [])
        types = [*map(self.declared, locals_)]
        for type_ in dict.fromkeys(types):
            own = [self.name(v.name) for v, its in zip(locals_, types, strict=True) if its == type_]
            star = ", *" if type_.endswith("*") else ", "
            yield f"{'    ' * depth}{type_}{star.join(own)};"

    def declared(self, local: Local) -> str:
        """Write the type of a local."""
        return f"{TYPES[local.kind]} ".replace("* ", "*")

    def beginning(self, local: Local) -> str:
        """Write what stands before a local that is declared where it gets its value."""
        const = local.name in self.once and local.kind != "p"
        return f"{'const ' * const}{self.declared(local)}"

    def target(self, statement: Statement, local: Local) -> str:
        """Write a local that a statement gives a value to, declared if it is not yet."""
        here = local.name in self.here.get(id(statement), ())
        return f"{self.beginning(local) if here else ''}{self.name(local.name)}"

    def heading(self) -> str:
        """Write what stands before a function."""
        return ""

    # ------------------------------------------------------------------ statements
    def block(self, body: Sequence[Statement], depth: int) -> list[str]:
        """Write statements."""
        return [
            line
            for each in body
            for line in (*self._declarations(each, depth), *self.statement(each, depth))
        ]

    def statement(self, statement: Statement, depth: int) -> list[str]:
        """Write a statement."""
        space = "    " * depth
        match statement:
            case Assign(target=target, value=value):
                if target.name in self.unread:
                    kept = may_write(value) or any(isinstance(u, Callback) for u in parts_of(value))
                    return [f"{space}{self.value(value)};"] if kept else []
                return [f"{space}{self.target(statement, target)} = {self.value(value)};"]
            case AssignMany(targets=targets, call=call):
                self.counter += 1
                whole = self.name(f"many.{self.counter}")
                made = f"{space}const many_{self.results[call.name]} {whole} = {self.value(call)};"
                parts = [
                    f"{space}{self.target(statement, each)} = {whole}.v{k};"
                    for k, each in enumerate(targets)
                    if each.name not in self.unread
                ]
                return [made, *parts]
            case Put(kind=kind, address=address, value=value):
                return [f"{space}{self.place(kind, address)} = {self.value(value)};"]
            case Do(call=call):
                return [f"{space}{self.value(call)};"]
            case If(test=test, body=body, orelse=orelse):
                lines = [f"{space}if ({self.value(test)}) {{", *self.block(body, depth + 1)]
                chained = len(orelse) == 1 and isinstance(orelse[0], If)
                if chained and not self.before.get(id(orelse[0])):
                    first, *rest = self.statement(orelse[0], depth)
                    return [*lines, f"{space}}} else {first.lstrip()}", *rest]
                if orelse:
                    lines += [f"{space}}} else {{", *self.block(orelse, depth + 1)]
                return [*lines, f"{space}}}"]
            case While(test=test, body=body):
                head = f"{space}while ({self.value(test)}) {{"
                return [head, *self.block(body, depth + 1), f"{space}}}"]
            case For(target=target, start=start, stop=stop, step=step, body=body):
                name = self.name(target.name)
                more = f"{name}++" if step == 1 else f"{name} += {step}"
                first = f"{self.target(statement, target)} = {self.value(start)}"
                head = f"{first}; {name} < {self.value(stop, 7)}; {more}"
                return [f"{space}for ({head}) {{", *self.block(body, depth + 1), f"{space}}}"]
            case Break():
                return [f"{space}break;"]
            case Continue():
                return [f"{space}continue;"]
            case Return(values=()):
                return [f"{space}return;"]
            case Return(values=(value,)):
                return [f"{space}return {self.value(value)};"]
            case Return(values=values):
                parts_text = ", ".join(map(self.value, values))
                self.counter += 1
                whole, kind = self.name(f"many.{self.counter}"), f"many_{self.function.results}"
                made = f"{space}const {kind} {whole} = {{{parts_text}}};"
                return [made, f"{space}return {whole};"]
        raise AssertionError(statement)

    # ------------------------------------------------------------------ expressions
    def value(self, expr: Expr, binds: int = 0) -> str:
        """Write an expression, in brackets if it binds less tightly than its surroundings."""
        text, own = self.bare(expr)
        return f"({text})" if own < binds else text

    def bare(self, expr: Expr) -> tuple[str, int]:
        """Write an expression; return also how tightly it binds."""
        match expr:
            case Const(kind="f", value=value):
                text = number_text(value)
                return text, _UNARY if text.startswith("-") else _WHOLE
            case Const(kind="b", value=value):
                return ("true" if value else "false"), _WHOLE
            case Const(value=value):
                return str(value), _UNARY if value < 0 else _WHOLE
            case Local(name=name):
                self.read.add(name)
                return self.name(name), _WHOLE
            case Global(name=name):
                return f"(char *){name}", _UNARY
            case Load(kind=kind, address=address):
                return self.place(kind, address), _WHOLE
            case AddressOf():
                return self.address_of(expr)
            case Logic(op=op, left=left, right=right):
                sign, binds = ("&&", 3) if op == "and" else ("||", 2)
                inner = binds if op == "and" else 3
                # Brackets around && within ||, as compilers advise.
                a, b = (self.value(each, inner + (op == "or")) for each in (left, right))
                if isinstance(left, Logic) and left.op == op:
                    a = self.value(left)
                return f"{a} {sign} {b}", binds
            case Choose(test=test, yes=yes, no=no):
                parts = (self.value(each, 2) for each in (test, yes, no))
                return "{} ? {} : {}".format(*parts), 1
            case Op():
                return self.operation(expr)
            case Invoke(name=name, arguments=arguments):
                return f"{self.functions(name)}({', '.join(map(self.value, arguments))})", _WHOLE
            case Foreign(name=name, arguments=arguments):
                return f"{name}({', '.join(map(self.value, arguments))})", _WHOLE
            case Callback(number=number, arguments=arguments):
                return f"callbacks[{number}]({', '.join(map(self.value, arguments))})", _WHOLE
        raise AssertionError(expr)

    def operation(self, expr: Op) -> tuple[str, int]:
        """Write an operation."""
        op, kind = expr.op, expr.operands[0].kind
        if op in _BINDS:
            binds = _BINDS[op]
            a, b = expr.operands
            # The right operand in brackets at equal rank: nothing may be reassociated. Comparisons
            # of comparisons in brackets, as compilers advise.
            least = max(binds, 7) if binds < 8 else binds
            return f"{self.value(a, least)} {op} {self.value(b, least + 1)}", binds
        if op in ("&", "|", "^", "<<", ">>"):
            a_text, b_text = (self.value(each, _UNARY) for each in expr.operands)
            return f"{a_text} {op} {b_text}", 4
        if op in ("neg", "not"):
            return f"{'-' if op == 'neg' else '!'}{self.value(expr.operands[0], _WHOLE)}", _UNARY
        if op in ("float", "int"):
            type_ = TYPES["f" if op == "float" else "i"]
            return f"({type_}){self.value(expr.operands[0], _UNARY)}", _UNARY
        names = {"abs": "fabs" if kind == "f" else "abs_i", "sqrt": "sqrt", "%": "mod_i"}
        names["copysign"] = "copysign"
        names |= {"//": "div_i", "min": f"min_{kind}", "max": f"max_{kind}"}
        return f"{names[op]}({', '.join(map(self.value, expr.operands))})", _WHOLE

    def place(self, kind: str, address: Address) -> str:
        """Write a place in memory."""
        if isinstance(address.base, Global) and address.size == 8:
            first = address.offset // 8
            index = "" if address.index is None else self.value(address.index, 8 if first else 0)
            index = f"{index} + {first}" if index and first else index or str(first)
            return f"{address.base.name}[{index}]"
        type_ = TYPES[kind] if kind != "p" else "char *"
        base = self.value(address.base, 8)
        if address.offset or address.name:
            base = f"({base} + {self.field(address)})"
        index = "0" if address.index is None else self.value(address.index)
        return f"(({type_} *){base})[{index}]".replace("* *", "**")

    def address_of(self, expr: AddressOf) -> tuple[str, int]:
        """Write an address."""
        address = expr.address
        text = self.value(address.base, 8)
        if address.offset:
            text += f" + {address.offset}"
        if address.index is not None:
            text += f" + {address.size} * {self.value(address.index, _UNARY)}"
        return text, 8 if "+" in text else _UNARY
