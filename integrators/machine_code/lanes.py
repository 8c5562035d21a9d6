"""Short loops over numbers side by side, such as the elements of a bank, as LLVM's vectors.

The bits are those of the loop: each lane does what one turn does, and sums are added up in order.
What a loop reads or writes by turn has to exist for all its turns, whatever it asks first.
LLVM itself writes short loops out before it looks for vectors, and then finds few: a flow branches
by the state of each element, and what has been stored number by number cannot be read at once
without waiting. So the loops over a state follow the groups that the flow computes side by side.
"""

from __future__ import annotations

import functools
import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
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
    Global,
    If,
    Invoke,
    Load,
    Local,
    Logic,
    Op,
    Put,
    Statement,
    TypedFunction,
    expressions_in,
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
    "FunctionLoops",
    "LaneWriter",
    "Turns",
    "groups_of",
    "operation",
]

TYPES = {"f": "double", "i": "i64", "b": "i1", "p": "ptr"}
ALIAS = {"f": "!5", "i": "!6", "b": "!7", "p": "!8"}  # what does not overlap, see `llvm_text`

WIDE = 4  # numbers in a vector, and the fewest turns that are worth one
MOST_WRITTEN_OUT = 16  # turns; vectors of longer loops are LLVM's if they have no branches
_SLOW = {"/", "sqrt"}  # operations that are worth a branch if no lane needs them
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
    bounds: tuple[int, int] | None  # turns from the first to before the second, if not many
    varying: frozenset[Local]  # what differs by lane: the loop's variable and what turns assign to
    kept: frozenset[Local]  # to which each turn assigns
    folded: frozenset[Local]  # sums and the like, from one turn to the next
    apart: tuple[tuple[Expr, Expr], ...]  # places that must not be neighbours if they differ

    def pieces(
        self, groups: Sequence[tuple[int, int]], *, alone: bool
    ) -> Iterator[tuple[int, int]]:
        """Yield first turns and widths; no vector is in two groups, nor between them if `alone`."""
        if self.bounds is None:
            return
        start, stop = self.bounds
        if start > 0 or (groups and groups[-1][1] > stop):  # no loop over the state
            groups = ()
        edges = [(start, start), *groups, (stop, stop)]
        for (_, before), (first, end) in itertools.pairwise(edges):
            yield from _pieces(before, first, 1 if alone else WIDE)
            yield from _pieces(first, end, WIDE)


def _typed(kind: str, width: int) -> str:
    """Return the type of numbers side by side."""
    return TYPES[kind] if width == 1 else f"<{width} x {TYPES[kind]}>"


def operation(
    new: Callable[[str], str], op: str, kind: str, parts: Sequence[str], width: int = 1
) -> str:
    """Write an operation on numbers of a kind, or on several side by side; return its name."""
    a, b, type_ = parts[0], parts[-1], _typed(kind, width)
    if op in _SIGNS:
        return new(f"{_compare(op, kind)} {type_} {a}, {b}")
    if op in ("min", "max"):
        test = new(f"{_compare('<' if op == 'min' else '>', kind)} {type_} {b}, {a}")
        return new(f"select {_typed('b', width)} {test}, {type_} {b}, {type_} {a}")
    if op == "not":
        return new(f"xor {type_} {a}, {_splat('b', 'true', width)}")
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


def _splat(kind: str, number: str, width: int) -> str:
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


def _bounds(loop: For) -> tuple[int, int] | None:
    """Return the first turn and the one after the last; nothing if they are not known, or many."""
    match loop.start, loop.stop:
        case Const(value=start), Const(value=stop) if stop - start <= MOST_WRITTEN_OUT:
            return start, stop
    return None


class FunctionLoops:
    """The loops of a function, whose arrays of different names are different ones if `distinct`."""

    def __init__(self, function: TypedFunction, *, distinct: bool) -> None:
        self.function, self.distinct = function, distinct

    @functools.cached_property
    def _reads(self) -> Counter[Local]:
        return _reads_of(self.function.body)

    def of(self, loop: For) -> Turns | None:
        """Return how the turns of a loop can be lanes; nothing if they cannot, or need not."""
        reader = _LoopReader(loop, self.distinct)
        if reader.bounds is not None:
            worth_it = reader.bounds[1] - reader.bounds[0] >= WIDE
        else:
            branches = any(isinstance(each, If) for each in reader.statements)
            worth_it = bool(reader.folded) or branches
        if loop.step != 1 or not worth_it or (kept := reader.kept()) is None:
            return None
        lost = reader.assigned - reader.folded - kept  # wrong if they are read outside the loop
        if any(self._reads[each] > reader.reads[each] for each in lost):
            return None
        bounds, varying, apart = reader.bounds, frozenset(reader.varying), tuple(reader.apart)
        return Turns(loop, bounds, varying, frozenset(kept), reader.folded, apart)

    def groups(self) -> set[tuple[int, int]]:
        """Return which entries of its last parameter are written side by side."""
        found = set()
        for loop in statements_of(self.function.body):
            turns = self.of(loop) if isinstance(loop, For) else None
            if turns is None or turns.bounds is None:
                continue
            start, stop = turns.bounds
            for put in statements_of(turns.loop.body):
                if isinstance(put, Put) and put.address.base == self.function.parameters[-1]:
                    place = _place(put.address, turns.loop.target)
                    assert place is not None
                    first = start + place[1] // 8
                    found.add((first, first + stop - start))
        return found


def _reads_of(body: Sequence[Statement]) -> Counter[Local]:
    return Counter(each for each in expressions_in(body) if isinstance(each, Local))


def groups_of(scopes: Iterable[FunctionLoops]) -> tuple[tuple[int, int], ...]:
    """Return which entries of the state its flows compute side by side, in order."""
    groups: list[tuple[int, int]] = []
    for first, end in sorted(set[tuple[int, int]]().union(*(each.groups() for each in scopes))):
        if not groups or groups[-1][1] <= first:
            groups.append((first, end))
    return tuple(groups)


_FIRST = Const("i", 0)


def _place(address: Address, target: Local) -> tuple[Expr, int] | None:
    """Return how far turn 0 is from the base, in entries that are not known, and in bytes.

    Nothing if the place is not that of a turn.
    """
    match address.index:
        case Local() as index if index == target:
            return _FIRST, address.offset
        case (
            Op(op="+", operands=(more, Local() as index))
            | Op(op="+", operands=(Local() as index, more))
        ) if index == target:
            if isinstance(more, Const):
                return _FIRST, address.offset + address.size * int(more.value)
            return more, address.offset
    return None


class _LoopReader:
    """Reads the body of a loop: whether its turns can be lanes."""

    def __init__(self, loop: For, distinct: bool) -> None:
        self.loop, self.bounds, self.distinct = loop, _bounds(loop), distinct
        self.apart: list[tuple[Expr, Expr]] = []
        self.statements = list(statements_of(loop.body))
        made = [each for each in self.statements if isinstance(each, Assign)]
        targets = [each.target for each in made]
        self.assigned = frozenset(targets)
        self.varying = {loop.target, *targets}
        self.reads = _reads_of(loop.body)
        once = {u for u in self.assigned if self.reads[u] == targets.count(u) == 1}
        self.folded = frozenset(u.target for u in made if u.target in once and _folds(u))

    def kept(self) -> set[Local] | None:
        """Return the locals to which each turn assigns; nothing if turns cannot be lanes."""
        known = set[Local]()
        useful = bool(self.folded) or any(isinstance(each, Put) for each in self.statements)
        if useful and self._block(self.loop.body, known, sure=True) and self._are_apart():
            return known
        return None

    def _block(self, body: Sequence[Statement], known: set[Local], *, sure: bool) -> bool:
        """Read statements; `known` are the locals to which this turn has assigned.

        `sure` is whether each turn comes to them.
        """
        for each in body:
            match each:
                case Assign(target=target, value=value) if target in self.folded:
                    asked = isinstance(value, Op)  # what is right of an `or` may not be
                    if not sure or not self._computes(_added(value)[1], known, sure=asked):
                        return False
                case Assign(target=target, value=value):
                    if target == self.loop.target or not self._computes(value, known, sure=sure):
                        return False
                    known.add(target)
                case Put(kind="f", address=address, value=value):
                    if not (self._is_turn(address) and self._computes(value, known, sure=sure)):
                        return False
                case If(test=test, body=yes, orelse=no):
                    ends = set(known), set(known)
                    if not self._computes(test, known, sure=sure):
                        return False
                    for block, end in zip((yes, no), ends, strict=True):
                        if not self._block(block, end, sure=False):
                            return False
                    known |= ends[0] & ends[1]
                case _:
                    return False
        return True

    def _is_turn(self, address: Address) -> bool:
        """Return whether there is a place for each turn, one after the other."""
        if (place := _place(address, self.loop.target)) is None:
            return False
        more = place[0]
        return (
            (self.bounds is None or more == _FIRST)
            and self._is_same(address.base, sure=False)
            and self._is_same(more, sure=False)
        )

    def _is_same(self, expr: Expr, *, sure: bool) -> bool:
        """Return whether an expression is the same in all turns, and can be computed once.

        Unless each turn comes to it, nothing may happen where no turn would.
        """
        if self.varying & set(locals_in(expr)) or may_write(expr):
            return False
        for each in parts_of(expr):
            match each:
                case Callback():
                    return False
                case Invoke() | Foreign() | Op(op="//" | "%" | "<<" | ">>" | "int"):
                    if not sure:
                        return False
                case Load(address=Address(index=index)):
                    if not sure and not isinstance(index, Const | None):
                        return False
        return True

    def _computes(self, expr: Expr, known: set[Local], *, sure: bool) -> bool:
        """Return whether lanes can compute an expression from what is known."""
        if not self.varying & set(locals_in(expr)):
            return self._is_same(expr, sure=sure)
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
                    or (op in ("&", "|") and kinds == {"i"})
                    or op == "not"
                )
                return fits and all(self._computes(each, known, sure=sure) for each in parts)
            case Logic(left=left, right=right):
                first = self._computes(left, known, sure=sure)
                return first and self._computes(right, known, sure=False)
            case Choose(test=test, yes=yes, no=no):
                first = self._computes(test, known, sure=sure)
                return first and all(self._computes(u, known, sure=False) for u in (yes, no))
        return False

    def _are_apart(self) -> bool:
        """Return whether no turn reads or writes what another one writes."""
        puts = [each.address for each in self.statements if isinstance(each, Put)]
        reads = [each for each in expressions_in(self.loop.body) if isinstance(each, Load)]
        places = puts + [each.address for each in reads if each.kind == "f"]
        return all(self._is_apart(*pair) for pair in itertools.product(puts, places))

    def _is_apart(self, put: Address, other: Address) -> bool:
        """Return whether turns that write at one place leave alone what others do at another."""
        first, second = (_place(each, self.loop.target) for each in (put, other))
        if put.base != other.base:  # arrays are equal or have nothing in common
            known = _is_array(put.base) and _is_array(other.base)
            return self.distinct or known or first == second
        assert first is not None
        if second is None:  # one that all turns read
            if other.index is not None or self.bounds is None:
                return False
            start, stop = self.bounds
            return not 8 * start <= other.offset - first[1] < 8 * stop
        if first[0] != second[0]:
            self.apart.append((first[0], second[0]))
            return first[1] == second[1]
        start, stop = self.bounds or (0, WIDE)
        return first == second or abs(first[1] - second[1]) >= 8 * (stop - start)


def _is_array(base: Expr) -> bool:
    """Return whether this is the beginning of a block, or that of an array to which it leads."""
    match base:
        case Global() | Local(kind="p", to=""):
            return True
        case Load(kind="p", address=Address(base=Local(kind="p", to=""), index=None)):
            return True
    return False


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


class _FunctionWriter(Protocol):
    """What lanes need of the printer of a function."""

    lines: list[str]
    places: list[str]

    def new(self, line: str) -> str: ...
    def value(self, expr: Expr) -> str: ...
    def label(self, name: str) -> str: ...
    def place(self, label: str) -> None: ...
    def jump(self, label: str) -> None: ...
    def branch(self, test: str, yes: str, no: str) -> None: ...


def _alone(local: Local) -> str:
    """Return the place of a local that is the same in all lanes."""
    return f'%"{local.name}"'


class LaneWriter:
    """Writes some turns of a loop as one; the first one may be a name, known only later."""

    def __init__(self, writer: _FunctionWriter, turns: Turns, first: int | str, width: int) -> None:
        self.writer, self.turns, self.first, self.width = writer, turns, first, width
        self.known: set[Local] = set()  # locals with a number in each lane

    def write(self) -> None:
        """Write them; after the last ones locals are as the loop would leave them."""
        self._block(self.turns.loop.body, None)
        bounds = self.turns.bounds
        if bounds is None or self.first == bounds[1] - self.width:
            for each in sorted(self.turns.kept, key=lambda local: local.name):
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
        if not any(isinstance(each, Op) and each.op in _SLOW for each in expressions_in(body)):
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
            self.known.add(target)
            line = f"  {self._at(target)} = alloca {_typed(target.kind, self.width)}"
            if line not in self.writer.places:
                self.writer.places.append(line)
        elif mask is not None:
            value = self._chosen(mask, target.kind, value, self._read(target))
        self._store(self._at(target), _typed(target.kind, self.width), value)

    def _put(self, address: Address, value: str, mask: str | None) -> None:
        place = self._place(address)
        if mask is not None:
            value = self._chosen(mask, "f", value, self._load("f", place))
        # Else LLVM would write the lanes of the mask only, and a processor cannot read what is
        # written so before it has left for the cache.
        how = "store" if mask is None else "store volatile"
        line = f"  {how} {_typed('f', self.width)} {value}, ptr {place}, align 8"
        self.writer.lines.append(f"{line}, !tbaa {ALIAS['f']}")

    def _fold(self, target: Local, value: Expr) -> None:
        """Take the lanes into a sum, one after the other."""
        new, more, total = self.writer.new, self.value(_added(value)[1]), self.writer.value(target)
        if isinstance(value, Logic):
            total = new(f"select i1 {total}, i1 true, i1 {self._any(more)}")
        elif isinstance(value, Op):
            for lane in range(self.width):
                total = operation(new, value.op, "f", (total, self._lane(more, "f", lane)))
        self._store(_alone(target), TYPES[target.kind], total)

    # ------------------------------------------------------------------ expressions
    def value(self, expr: Expr) -> str:
        """Write an expression and return its value in each lane."""
        if not self.turns.varying & set(locals_in(expr)):
            return self._all(expr.kind, self.writer.value(expr))
        match expr:
            case Load(kind=kind, address=address):
                return self._load(kind, self._place(address))
            case Op(op=op, operands=parts):
                return self._operation(op, parts[0].kind, *map(self.value, parts))
            case Logic(op=op, left=left, right=right):
                a, b = self.value(left), self.value(right)
                return self._both(a, b) if op == "and" else self._chosen(a, "b", self._true, b)
            case Choose(kind=kind, test=test, yes=yes, no=no):
                return self._chosen(self.value(test), kind, self.value(yes), self.value(no))
        assert isinstance(expr, Local)
        return self._read(expr)

    def _operation(self, op: str, kind: str, *parts: str) -> str:
        return operation(self.writer.new, op, kind, parts, self.width)

    def _chosen(self, mask: str, kind: str, yes: str, no: str) -> str:
        type_ = _typed(kind, self.width)
        test = f"{_typed('b', self.width)} {mask}"
        return self.writer.new(f"select {test}, {type_} {yes}, {type_} {no}")

    @property
    def _true(self) -> str:
        return _splat("b", "true", self.width)

    def _both(self, mask: str | None, other: str) -> str:
        if mask is None:
            return other
        return self._chosen(mask, "b", other, _splat("b", "false", self.width))

    def _any(self, mask: str) -> str:
        """Return whether a mask holds in a lane."""
        if self.width == 1:
            return mask
        bits = self.writer.new(f"bitcast {_typed('b', self.width)} {mask} to i{self.width}")
        return self.writer.new(f"icmp ne i{self.width} {bits}, 0")

    def _all(self, kind: str, value: str) -> str:
        """Return a number in each lane."""
        if self.width == 1:
            return value
        type_ = _typed(kind, self.width)
        one = self.writer.new(f"insertelement {type_} undef, {TYPES[kind]} {value}, i64 0")
        order = f"<{self.width} x i32> zeroinitializer"
        return self.writer.new(f"shufflevector {type_} {one}, {type_} undef, {order}")

    def _lane(self, value: str, kind: str, lane: int) -> str:
        """Return the number in a lane."""
        if self.width == 1:
            return value
        return self.writer.new(f"extractelement {_typed(kind, self.width)} {value}, i64 {lane}")

    # ------------------------------------------------------------------ places
    def _at(self, local: Local) -> str:
        return f'%"{local.name}.{self.width}"'

    def _read(self, local: Local) -> str:
        return self.writer.new(f"load {_typed(local.kind, self.width)}, ptr {self._at(local)}")

    def _store(self, place: str, kind: str, value: str) -> None:
        self.writer.lines.append(f"  store {kind} {value}, ptr {place}")

    def _place(self, address: Address) -> str:
        """Return the address of the first lane."""
        found = _place(address, self.turns.loop.target)
        assert found is not None
        more, offset = found
        place = self.writer.value(address.base)
        if isinstance(self.first, int):
            offset += address.size * self.first
        if offset:
            place = self.writer.new(f"getelementptr inbounds i8, ptr {place}, i64 {offset}")
        entry = "i8" if address.size == 1 else "double"
        for each in (
            "" if more == _FIRST else self.writer.value(more),
            self.first if isinstance(self.first, str) else "",
        ):
            if each:
                place = self.writer.new(f"getelementptr inbounds {entry}, ptr {place}, i64 {each}")
        return place

    def _load(self, kind: str, place: str) -> str:
        if kind != "b":
            how = f"align 8, !tbaa {ALIAS[kind]}"
            return self.writer.new(f"load {_typed(kind, self.width)}, ptr {place}, {how}")
        type_ = "i8" if self.width == 1 else f"<{self.width} x i8>"
        loaded = self.writer.new(f"load {type_}, ptr {place}, align 1, !tbaa {ALIAS[kind]}")
        zero = "0" if self.width == 1 else "zeroinitializer"
        return self.writer.new(f"icmp ne {type_} {loaded}, {zero}")
