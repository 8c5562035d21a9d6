"""Short loops over numbers side by side, such as the elements of a bank, as LLVM's vectors.

The bits are those of the loop: each lane does what one turn does, and sums are added up in order.
LLVM itself writes short loops out before it looks for vectors, and then finds few: a flow branches
by the state of each element, and what has been stored number by number cannot be read at once
without waiting. So the loops over a state follow the groups that the flow computes side by side.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from integrators.machine_code.tree import (
    Address,
    Assign,
    Callback,
    Choose,
    Const,
    Expr,
    For,
    Foreign,
    If,
    Invoke,
    Load,
    Local,
    Logic,
    Module,
    Op,
    Put,
    Statement,
    locals_in,
    may_write,
    parts_of,
    statements_of,
)

__all__ = [
    "ALIAS",
    "DECLARED",
    "MOST_WRITTEN_OUT",
    "TYPES",
    "WIDE",
    "LaneWriter",
    "Turns",
    "groups_of",
    "operation",
    "turns_of",
]

TYPES = {"f": "double", "i": "i64", "b": "i1", "p": "ptr"}
ALIAS = {"f": "!5", "i": "!6", "b": "!7", "p": "!8"}  # what does not overlap, see `llvm_text`

WIDE = 4  # numbers in a vector, and the fewest turns that are worth one
MOST_WRITTEN_OUT = 16  # turns; vectors of longer loops are LLVM's if they have no branches
SLOW = {"/", "sqrt"}  # operations that are worth a branch if no lane needs them
_FLOATS = {"+": "fadd", "-": "fsub", "*": "fmul", "/": "fdiv"}
_INTEGERS = {
    "+": "add", "-": "sub", "*": "mul", "&": "and", "|": "or", "^": "xor", "<<": "shl",
    ">>": "ashr",
}  # fmt: skip
_SIGNS = {"<": "lt", "<=": "le", ">": "gt", ">=": "ge", "==": "eq", "!=": "ne"}
_INTRINSIC = {"abs": "fabs", "sqrt": "sqrt", "copysign": "copysign"}
_IN_LANES = {*_FLOATS, *_INTRINSIC, "neg", "min", "max"}
_FOLDS = {"+", "-", "*", "min", "max"}
DECLARED = [
    f"declare {kind} @llvm.{name}.{short}({', '.join([kind] * count)})"
    for kind, short in (("double", "f64"), ("<2 x double>", "v2f64"), ("<4 x double>", "v4f64"))
    for name, count in (("fabs", 1), ("sqrt", 1), ("copysign", 2))
]


@dataclass(frozen=True)
class Turns:
    """A loop whose turns can be lanes."""

    loop: For
    start: int
    stop: int  # 0 if they are not known, or many
    folded: frozenset[Local]  # sums and the like, from one turn to the next
    apart: tuple[tuple[Expr, Expr], ...]  # places that must not be neighbours if they differ

    def pieces(
        self, groups: Sequence[tuple[int, int]], *, alone: bool
    ) -> Iterator[tuple[int, int]]:
        """Yield first turns and widths of vectors: groups belong together; others may be none."""
        if self.start > 0 or (groups and groups[-1][1] > self.stop):  # no loop over the state
            groups = ()
        edges = [(self.start, self.start), *groups, (self.stop, self.stop)]
        for (_, before), (first, end) in itertools.pairwise(edges):
            yield from _pieces(before, first, 1 if alone else WIDE)
            yield from _pieces(first, end, WIDE)


def typed(kind: str, width: int) -> str:
    """Return the type of numbers side by side."""
    return TYPES[kind] if width == 1 else f"<{width} x {TYPES[kind]}>"


def operation(
    new: Callable[[str], str], op: str, kind: str, parts: Sequence[str], width: int = 1
) -> str:
    """Write an operation on numbers of a kind, or on several side by side; return its name."""
    a, b, type_ = parts[0], parts[-1], typed(kind, width)
    if op in _SIGNS:
        return new(f"{_compare(op, kind)} {type_} {a}, {b}")
    if op in ("min", "max"):
        test = new(f"{_compare('<' if op == 'min' else '>', kind)} {type_} {b}, {a}")
        return new(f"select {typed('b', width)} {test}, {type_} {b}, {type_} {a}")
    if op == "not":
        return new(f"xor {type_} {a}, {splat('b', 'true', width)}")
    if op == "neg" and kind == "f":
        return new(f"fneg {type_} {a}")
    if op in _INTRINSIC and kind == "f":
        given = ", ".join(f"{type_} {each}" for each in parts)
        suffix = "f64" if width == 1 else f"v{width}f64"
        return new(f"call {type_} @llvm.{_INTRINSIC[op]}.{suffix}({given})")
    return new(f"{(_FLOATS if kind == 'f' else _INTEGERS)[op]} {type_} {a}, {b}")


def _compare(op: str, kind: str) -> str:
    """Return the instruction of a comparison; with NaN only != is true."""
    if kind == "f":
        return "fcmp une" if op == "!=" else f"fcmp o{_SIGNS[op]}"
    sign = "" if op in ("==", "!=") else "u" if kind == "b" else "s"
    return f"icmp {sign}{_SIGNS[op]}"


def splat(kind: str, number: str, width: int) -> str:
    """Return a constant in each lane."""
    return number if width == 1 else f"<{', '.join([f'{TYPES[kind]} {number}'] * width)}>"


def _pieces(start: int, stop: int, widest: int) -> Iterator[tuple[int, int]]:
    """Yield places and widths, the narrow ones first."""
    width = 1
    while start < stop:
        if width < widest and not (stop - start) & width:
            width *= 2
            continue
        yield start, width
        start += width


def _bounds(loop: For) -> tuple[int, int]:
    """Return the first turn and the one after the last; zeros if they are not known, or many."""
    match loop.start, loop.stop:
        case Const(value=start), Const(value=stop) if stop - start <= MOST_WRITTEN_OUT:
            return start, stop
    return 0, 0


def turns_of(loop: For) -> Turns | None:
    """Return how the turns of a loop can be lanes; nothing if they cannot, or need not."""
    if loop.step != 1:
        return None
    start, stop = _bounds(loop)
    reader = _LoopReader(loop, start, stop)
    if stop:
        worth_it = stop - start >= WIDE
    else:
        worth_it = bool(reader.folded) or any(isinstance(each, If) for each in reader.statements)
    if not (worth_it and reader.fits()):
        return None
    return Turns(loop, reader.start, reader.stop, reader.folded, tuple(reader.apart))


def groups_of(module: Module, is_flow: Callable[[str], bool]) -> tuple[tuple[int, int], ...]:
    """Return which entries of the state its flows compute side by side, in order."""
    found = set()
    for function in module.functions:
        loops = statements_of(function.body) if is_flow(function.name) else ()
        for turns in (turns_of(each) for each in loops if isinstance(each, For)):
            for put in statements_of(turns.loop.body) if turns and turns.stop else ():
                if turns and isinstance(put, Put) and put.address.base == function.parameters[-1]:
                    _, offset = _place(put.address, turns.loop.target) or (None, 0)
                    first = turns.start + offset // 8
                    found.add((first, first + turns.stop - turns.start))
    groups: list[tuple[int, int]] = []
    for first, end in sorted(found):
        if not groups or groups[-1][1] <= first:
            groups.append((first, end))
    return tuple(groups)


NOWHERE = Const("i", 0)


def _place(address: Address, target: Local) -> tuple[Expr, int] | None:
    """Return how far turn 0 is from the base, in entries that are not known, and in bytes.

    Nothing if the place is not that of a turn.
    """
    match address.index:
        case Local() as index if index == target:
            return NOWHERE, address.offset
        case (
            Op(op="+", operands=(more, Local() as index))
            | Op(op="+", operands=(Local() as index, more))
        ) if index == target:
            if isinstance(more, Const):
                return NOWHERE, address.offset + address.size * int(more.value)
            return more, address.offset
    return None


class _LoopReader:
    """Reads the body of a loop: whether its turns can be lanes."""

    def __init__(self, loop: For, start: int, stop: int) -> None:
        self.loop, self.start, self.stop = loop, start, stop
        self.apart: list[tuple[Expr, Expr]] = []
        self.statements = list(statements_of(loop.body))
        made = [each for each in self.statements if isinstance(each, Assign)]
        self.assigned = {each.target for each in made}
        reads = [u for each in self.statements for e in _read_by(each) for u in locals_in(e)]
        targets = [each.target for each in made]
        once = {u for u in self.assigned if reads.count(u) == targets.count(u) == 1}
        self.folded = frozenset(
            each.target for each in made if each.target in once and _folds(each)
        )

    def fits(self) -> bool:
        """Return whether they can, and it is worth it."""
        useful = bool(self.folded) or any(isinstance(each, Put) for each in self.statements)
        return useful and self._block(self.loop.body, set(), masked=False) and self._apart()

    def _block(self, body: Sequence[Statement], known: set[Local], *, masked: bool) -> bool:
        """Read statements; `known` are the locals to which this turn has assigned."""
        for each in body:
            match each:
                case Assign(target=target, value=value) if target in self.folded:
                    if masked or not self._computes(_added(value)[1], known):
                        return False
                case Assign(target=target, value=value):
                    if target == self.loop.target or not self._computes(value, known):
                        return False
                    known.add(target)
                case Put(kind="f", address=address, value=value):
                    if not (self._is_turn(address) and self._computes(value, known)):
                        return False
                case If(test=test, body=yes, orelse=no):
                    ends = set(known), set(known)
                    if not self._computes(test, known):
                        return False
                    for block, end in zip((yes, no), ends, strict=True):
                        if not self._block(block, end, masked=True):
                            return False
                    known |= ends[0] & ends[1]
                case _:
                    return False
        return True

    def _is_turn(self, address: Address) -> bool:
        place = _place(address, self.loop.target)
        if place is None or (self.stop and place[0] != NOWHERE):
            return False
        differs = {self.loop.target, *self.assigned}
        return not differs & {*locals_in(address.base), *locals_in(place[0])}

    def _computes(self, expr: Expr, known: set[Local]) -> bool:
        """Return whether lanes can compute an expression from what is known."""
        if not {self.loop.target, *self.assigned} & set(locals_in(expr)):
            # Computed once, also where no lane needs it: it must do nothing, and cannot fail.
            return not may_write(expr) and not any(
                isinstance(each, Callback) or getattr(each, "op", "") in ("//", "%")
                for each in parts_of(expr)
            )
        match expr:
            case Local():
                return expr in known
            case Load(kind=kind, address=address):
                return kind != "p" and self._is_turn(address)
            case Op(op=op, operands=parts):
                kinds = {each.kind for each in parts}
                fits = (
                    (op in _IN_LANES and kinds == {"f"})
                    or (op in _SIGNS and len(kinds) == 1)
                    or (op in "&|" and kinds == {"i"})
                    or op == "not"
                )
                return fits and all(self._computes(each, known) for each in parts)
            case Logic(left=left, right=right):
                return self._computes(left, known) and self._computes(right, known)
            case Choose(test=test, yes=yes, no=no):
                return all(self._computes(each, known) for each in (test, yes, no))
        return False

    def _apart(self) -> bool:
        """Return whether no turn reads or writes what another one writes."""
        size = 8 * (self.stop - self.start if self.stop else WIDE)
        puts = [each.address for each in self.statements if isinstance(each, Put)]
        parts = [u for each in self.statements for e in _read_by(each) for u in parts_of(e)]
        places = puts + [u.address for u in parts if isinstance(u, Load) and u.kind == "f"]
        for put, other in itertools.product(puts, places):
            if other.base != put.base:
                continue
            first, second = (_place(each, self.loop.target) for each in (put, other))
            if first is None or second is None:  # one that all turns read
                if first is None or other.index is not None or not self.stop:
                    return False
                if 0 <= other.offset - 8 * self.start - first[1] < size:
                    return False
            elif first[0] != second[0]:
                if first[1] != second[1]:
                    return False
                self.apart.append((first[0], second[0]))
            elif first != second and abs(first[1] - second[1]) < size:
                return False
        return True


def _folds(each: Assign) -> bool:
    """Return whether a turn adds something to what was there."""
    match each.value:
        case Op(kind="f", op=op) if op in _FOLDS:
            return _added(each.value)[0] == each.target
        case Logic(op="or"):
            return _added(each.value)[0] == each.target
    return False


def _added(value: Expr) -> tuple[Expr, Expr]:
    """Return what was there before a turn, and what is added."""
    match value:
        case Op(operands=(first, rest)):
            return first, rest
        case Logic(left=Logic(op="or") as left, right=right):
            first, rest = _added(left)
            return first, Logic("or", rest, right)
        case Logic(left=first, right=rest):
            return first, rest
    raise AssertionError(value)


def _read_by(statement: Statement) -> Iterator[Expr]:
    """Yield the expressions that a statement itself reads."""
    match statement:
        case Assign(value=value):
            yield value
        case Put(address=address, value=value):
            yield from (address.base, value)
        case If(test=test):
            yield test


class FunctionWriter(Protocol):
    """What lanes need of the printer of a function."""

    lines: list[str]
    places: list[str]

    def new(self, line: str) -> str:
        """Write a line with a result, and return its name."""

    def value(self, expr: Expr) -> str:
        """Write an expression, and return its result."""

    def label(self, name: str) -> str:
        """Return a new label."""

    def place(self, label: str) -> None:
        """Begin a block."""

    def jump(self, label: str) -> None:
        """Go to a block."""

    def branch(self, test: str, yes: str, no: str) -> None:
        """Go to one of two blocks."""


def _alone(local: Local) -> str:
    """Return the place of a local that is the same in all lanes."""
    return f'%"{local.name}"'


class LaneWriter:
    """Writes some turns of a loop as one; the first one may be a name, known only later."""

    def __init__(self, writer: FunctionWriter, turns: Turns, first: int | str, width: int) -> None:
        self.writer, self.turns, self.first, self.width = writer, turns, first, width
        self.known: list[Local] = []  # locals with a number in each lane

    def write(self) -> None:
        """Write them; after the last ones locals are as the loop would leave them."""
        self._block(self.turns.loop.body, None)
        if isinstance(self.first, str) or self.first + self.width == self.turns.stop:
            for each in self.known:
                last = self._lane(self._read(each), each.kind, self.width - 1)
                self._store(_alone(each), TYPES[each.kind], last)

    # ------------------------------------------------------------------ statements
    def _block(self, body: Sequence[Statement], mask: str | None) -> None:
        for each in body:
            match each:
                case Assign(target=target, value=value) if target in self.turns.folded:
                    self._fold(target, value)
                case Assign(target=target, value=value):
                    self._assign(target, self.value(value), mask)
                case Put(address=address, value=value):
                    self._put(address, self.value(value), mask)
                case If(test=test, body=yes, orelse=no):
                    holds = self.value(test)
                    self._masked(yes, self._both(mask, holds))
                    if no:
                        self._masked(no, self._both(mask, self._operation("not", "b", holds)))

    def _masked(self, body: Sequence[Statement], mask: str) -> None:
        """Write statements for the lanes of a mask; slow ones only if there are any."""
        parts = [u for s in statements_of(body) for e in _read_by(s) for u in parts_of(e)]
        if not any(isinstance(u, Invoke | Foreign) or getattr(u, "op", "") in SLOW for u in parts):
            self._block(body, mask)
            return
        some, end = self.writer.label("some"), self.writer.label("end")
        self.writer.branch(self._any(mask), some, end)
        self.writer.place(some)
        self._block(body, mask)
        self.writer.jump(end)
        self.writer.place(end)

    def _assign(self, target: Local, value: str, mask: str | None) -> None:
        if target not in self.known:
            self.known.append(target)
            line = f"  {self._at(target)} = alloca {typed(target.kind, self.width)}"
            if line not in self.writer.places:
                self.writer.places.append(line)
        elif mask is not None:
            value = self._chosen(mask, target.kind, value, self._read(target))
        self._store(self._at(target), typed(target.kind, self.width), value)

    def _put(self, address: Address, value: str, mask: str | None) -> None:
        place = self._place(address)
        if mask is not None:
            value = self._chosen(mask, "f", value, self._load("f", place))
        line = f"  store {typed('f', self.width)} {value}, ptr {place}, align 8"
        self.writer.lines.append(f"{line}, !tbaa {ALIAS['f']}")

    def _fold(self, target: Local, value: Expr) -> None:
        """Take the lanes into a sum, one after the other."""
        new, more, total = self.writer.new, self.value(_added(value)[1]), self.writer.value(target)
        if isinstance(value, Logic):
            total = new(f"or i1 {total}, {self._any(more)}")
        elif isinstance(value, Op):
            for lane in range(self.width):
                total = operation(new, value.op, "f", (total, self._lane(more, "f", lane)))
        self._store(_alone(target), TYPES[target.kind], total)

    # ------------------------------------------------------------------ expressions
    def value(self, expr: Expr) -> str:
        """Write an expression and return its value in each lane."""
        if not {self.turns.loop.target, *self.known} & set(locals_in(expr)):
            spread = self._all if not isinstance(expr, Const) else self._constant
            return spread(expr.kind, self.writer.value(expr))
        match expr:
            case Load(kind=kind, address=address):
                return self._load(kind, self._place(address))
            case Op(op=op, operands=parts):
                return self._operation(op, parts[0].kind, *map(self.value, parts))
            case Logic(op=op, left=left, right=right):
                kind = typed("b", self.width)
                return self.writer.new(f"{op} {kind} {self.value(left)}, {self.value(right)}")
            case Choose(kind=kind, test=test, yes=yes, no=no):
                return self._chosen(self.value(test), kind, self.value(yes), self.value(no))
        assert isinstance(expr, Local)
        return self._read(expr)

    def _operation(self, op: str, kind: str, *parts: str) -> str:
        return operation(self.writer.new, op, kind, parts, self.width)

    def _chosen(self, mask: str, kind: str, yes: str, no: str) -> str:
        type_ = typed(kind, self.width)
        test = f"{typed('b', self.width)} {mask}"
        return self.writer.new(f"select {test}, {type_} {yes}, {type_} {no}")

    def _both(self, mask: str | None, other: str) -> str:
        if mask is None:
            return other
        return self.writer.new(f"and {typed('b', self.width)} {mask}, {other}")

    def _any(self, mask: str) -> str:
        """Return whether a mask holds in a lane."""
        if self.width == 1:
            return mask
        bits = self.writer.new(f"bitcast {typed('b', self.width)} {mask} to i{self.width}")
        return self.writer.new(f"icmp ne i{self.width} {bits}, 0")

    def _constant(self, kind: str, value: str) -> str:
        return splat(kind, value, self.width)

    def _all(self, kind: str, value: str) -> str:
        """Return a number in each lane."""
        if self.width == 1:
            return value
        type_ = typed(kind, self.width)
        one = self.writer.new(f"insertelement {type_} undef, {TYPES[kind]} {value}, i64 0")
        order = f"<{self.width} x i32> zeroinitializer"
        return self.writer.new(f"shufflevector {type_} {one}, {type_} undef, {order}")

    def _lane(self, value: str, kind: str, lane: int) -> str:
        """Return the number in a lane."""
        if self.width == 1:
            return value
        return self.writer.new(f"extractelement {typed(kind, self.width)} {value}, i64 {lane}")

    # ------------------------------------------------------------------ places
    def _at(self, local: Local) -> str:
        return f'%"{local.name}.{self.width}"'

    def _read(self, local: Local) -> str:
        return self.writer.new(f"load {typed(local.kind, self.width)}, ptr {self._at(local)}")

    def _store(self, place: str, kind: str, value: str) -> None:
        self.writer.lines.append(f"  store {kind} {value}, ptr {place}")

    def _place(self, address: Address) -> str:
        """Return the address of the first lane."""
        found = _place(address, self.turns.loop.target)
        assert found is not None
        place, (more, offset) = self.writer.value(address.base), found
        if isinstance(self.first, int):
            offset += address.size * self.first
        if offset:
            place = self.writer.new(f"getelementptr inbounds i8, ptr {place}, i64 {offset}")
        entry = "i8" if address.size == 1 else "double"
        for each in (
            "" if more == NOWHERE else self.writer.value(more),
            self.first if isinstance(self.first, str) else "",
        ):
            if each:
                place = self.writer.new(f"getelementptr inbounds {entry}, ptr {place}, i64 {each}")
        return place

    def _load(self, kind: str, place: str) -> str:
        if kind != "b":
            how = f"align 8, !tbaa {ALIAS[kind]}"
            return self.writer.new(f"load {typed(kind, self.width)}, ptr {place}, {how}")
        type_ = "i8" if self.width == 1 else f"<{self.width} x i8>"
        loaded = self.writer.new(f"load {type_}, ptr {place}, align 1, !tbaa {ALIAS[kind]}")
        zero = "0" if self.width == 1 else "zeroinitializer"
        return self.writer.new(f"icmp ne {type_} {loaded}, {zero}")
