"""What names stand for while a function is translated: numbers, arrays, records, Python objects."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from integrators.machine_code.tree import (
    SIZES,
    Address,
    AddressOf,
    Const,
    Expr,
    Global,
    Load,
    Local,
    Op,
)


@dataclass(frozen=True)
class NumberValue:
    """A number."""

    expr: Expr


@dataclass(frozen=True)
class ArrayValue:
    """A view of memory, row by row.

    Parameters
    ----------
    kind : str
        Of its entries.
    dims : tuple of Expr
        Its lengths.
    base : Expr
        An address.
    offset : int
        Bytes from there.
    index : Expr, optional
        Further entries from there.
    name : str
        Of a number of a record.
    """

    kind: str
    dims: tuple[Expr, ...]
    base: Expr
    offset: int = 0
    index: Expr | None = None
    name: str = field(default="", compare=False)
    empty: bool = field(default=False, compare=False)  # a row of an array without rows

    @property
    def address(self) -> Address:
        """Where it begins."""
        size = SIZES[self.kind]
        return Address(self.base, self.offset, self.index, size, self.name, self.empty)

    @property
    def beginning(self) -> AddressOf:
        """Its address as a value."""
        return AddressOf(self.address, to=self.kind)

    def at(self, place: Expr) -> ArrayValue | NumberValue:
        """Return an entry, or a row of a table."""
        step = place
        for length in self.dims[1:]:
            step = times(step, length)
        offset, index = self.offset, self.index
        if isinstance(step, Const):
            offset += SIZES[self.kind] * step.value
        else:
            index = step if index is None else plus(index, step)
        empty = self.empty or self.dims[0] == Const("i", 0)
        row = replace(self, dims=self.dims[1:], offset=offset, index=index, empty=empty)
        return row if row.dims else NumberValue(Load(self.kind, row.address))


@dataclass(frozen=True)
class RecordValue:
    """A named tuple, a tuple whose names are its places, or a dataclass.

    The numbers of a dataclass can be assigned: they are arrays without lengths.
    """

    cls: Any  # the class of a named tuple or a dataclass, or tuple
    fields: Mapping[str, Value]

    def __getitem__(self, name: str) -> Value:
        """Return a field."""
        part = self.fields[name]
        if isinstance(part, ArrayValue) and not part.dims:
            return NumberValue(Load(part.kind, part.address))
        return part


@dataclass(frozen=True)
class FixedValue:
    """A Python object known while translating: a function, a class, a module."""

    value: Any


Value = NumberValue | ArrayValue | RecordValue | FixedValue


def plus(a: Expr, b: Expr) -> Expr:
    """Return a sum of integers.

    Examples
    --------
    >>> plus(Const("i", 2), Const("i", 3)).value
    5
    >>> plus(Const("i", 0), Local("i", "n")).name, plus(Local("i", "n"), Const("i", 0)).name
    ('n', 'n')
    """
    if isinstance(a, Const) and isinstance(b, Const):
        return Const("i", a.value + b.value)
    if isinstance(a, Const) and a.value == 0:
        return b
    if isinstance(b, Const) and b.value == 0:
        return a
    return Op("i", "+", (a, b))


def times(a: Expr, b: Expr) -> Expr:
    """Return a product of integers.

    Examples
    --------
    >>> times(Const("i", 1), Local("i", "n")).name
    'n'
    """
    if isinstance(a, Const) and isinstance(b, Const):
        return Const("i", a.value * b.value)
    if isinstance(a, Const) and a.value == 1:
        return b
    if isinstance(b, Const) and b.value == 1:
        return a
    return Op("i", "*", (a, b))


def leaves(value: Value) -> Iterator[NumberValue | ArrayValue | FixedValue]:
    """Yield the numbers, arrays and objects that a value is made of, in order.

    Examples
    --------
    >>> one, two = (NumberValue(Const("i", each)) for each in (1, 2))
    >>> [each.expr.value for each in leaves(RecordValue(tuple, {"0": one, "1": two}))]
    [1, 2]
    """
    if isinstance(value, RecordValue):
        for part in value.fields.values():
            yield from leaves(part)
    else:
        yield value


def substituted(part: Any, given: Mapping[Local, Expr]) -> Any:
    """Return a value, or an expression in one, with locals replaced.

    Examples
    --------
    >>> n = Local("i", "n")
    >>> substituted(NumberValue(n), {n: Const("i", 5)}).expr.value
    5
    >>> substituted(Op("i", "+", (n, n)), {n: Const("i", 5)}).operands[1].value
    5
    """
    return with_locals(part, lambda local: given.get(local, local)) if given else part


def with_locals(part: Any, give: Callable[[Local], Expr]) -> Any:
    """Return a value, or an expression in one, with what is given for its locals, in their order.

    Not with `replace`, which takes most of the time of a translation.
    """
    match part:
        case Local():
            return give(part)
        case Const() | Global() | FixedValue() | None:
            return part
        case Load(kind=kind, address=at):
            return Load(kind, with_locals(at, give))
        case AddressOf(address=at, kind=kind, to=to):
            return AddressOf(with_locals(at, give), kind, to)
        case Address(base, offset, index, size, name, empty):
            moved, at = with_locals(base, give), with_locals(index, give)
            return Address(moved, offset, at, size, name, empty)
        case Op(kind=kind, op=op, operands=parts):
            return Op(kind, op, tuple([with_locals(each, give) for each in parts]))
        case NumberValue(expr=inner):
            return NumberValue(with_locals(inner, give))
        case ArrayValue(kind, dims, base, offset, index, name, empty):
            lengths = tuple([with_locals(each, give) for each in dims])
            moved, at = with_locals(base, give), with_locals(index, give)
            return ArrayValue(kind, lengths, moved, offset, at, name, empty)
        case RecordValue(cls=cls, fields=fields):
            return RecordValue(cls, {k: with_locals(each, give) for k, each in fields.items()})
    raise AssertionError(part)  # anything else would have been assigned to a local before


class Renamed(Mapping[str, Value]):
    """The fields of a record with other locals; each is made when it is asked for."""

    def __init__(self, record: RecordValue, names: Mapping[Local, Local]) -> None:
        self.record, self.names = record, names
        self._made: dict[str, Value] = {}

    def __getitem__(self, name: str) -> Value:
        if name not in self._made:
            self._made[name] = renamed(self.record.fields[name], self.names)
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.record.fields)

    def __len__(self) -> int:
        return len(self.record.fields)


def renamed(value: Value, names: Mapping[Local, Local]) -> Value:
    """Return a value with other locals; all that it has must be among the names."""
    if isinstance(value, RecordValue):
        return RecordValue(value.cls, Renamed(value, names))
    return with_locals(value, names.__getitem__)  # type: ignore[no-any-return]


class RecordForms:
    """The forms of records that are passed in one module, and which locals are in each record."""

    def __init__(self) -> None:
        self._numbers: dict[Any, int] = {}
        self._found: dict[int, tuple[RecordValue, int, dict[Local, str]]] = {}  # by `id`

    def of(self, record: RecordValue) -> tuple[int, dict[Local, str]]:
        """Return the number of its form, and its locals in order, each with its first field."""
        if (found := self._found.get(id(record))) is None:
            self._found[id(record)] = found = record, *self._form(record)
        return found[1:]

    def _form(self, record: RecordValue) -> tuple[int, dict[Local, str]]:
        if isinstance(record.fields, Renamed):
            number, fields = self.of(record.fields.record)
            return number, {record.fields.names[local]: field for local, field in fields.items()}
        names: dict[Local, Expr] = {}
        fields = {}

        def numbered(local: Local) -> Expr:
            return names.setdefault(local, Local(local.kind, f"a{len(names)}"))

        parts = []
        for name, part in record.fields.items():
            parts.append((name, self.shape(part, numbered)))
            inside = self.of(part)[1] if isinstance(part, RecordValue) else {}
            for local in names:
                fields.setdefault(local, inside.get(local, name))
        return self._numbers.setdefault((id(record.cls), *parts), len(self._numbers)), fields

    def shape(self, value: Value, numbered: Callable[[Local], Expr]) -> Any:
        """Return what a translation depends on, in terms of numbered locals."""
        match value:
            case NumberValue(expr=expr):
                return "number", with_locals(expr, numbered)
            case ArrayValue(kind=kind, offset=offset):
                parts = (*value.dims, value.base, value.index)
                return "view", kind, offset, *(with_locals(each, numbered) for each in parts)
            case RecordValue():
                number, names = self.of(value)
                return "record", number, *map(numbered, names)
            case FixedValue(value=fixed):
                return "fixed", id(fixed)
