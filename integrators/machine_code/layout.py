"""Blocks of memory that hold all arguments of a function, and what their fields are called.

A block is described by an example: named tuples of numbers, of lists or arrays, and of
`OuterArray`. Lists become arrays inside the block, with constant lengths; an `OuterArray` is an
array elsewhere, of which the block holds the address and the lengths. Functions and what else is
known while translating take no room.

A dataclass is a record whose numbers can be assigned. They come first among its fields. In a block,
its attributes read and write the block's words.
"""

from __future__ import annotations

import ctypes
import dataclasses
import functools
import operator
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from integrators.machine_code.front_end.values import (
    ArrayValue,
    FixedValue,
    NumberValue,
    RecordValue,
    Value,
)
from integrators.machine_code.records import FIELDS, numbers_of
from integrators.machine_code.tree import Address, Const, Expr, Load, Local

__all__ = ["BlockLayout", "MemoryBlock", "OuterArray", "parts_of"]

_KINDS = {float: "f", int: "i", bool: "b"}
_DTYPES = {"f": np.dtype(np.float64), "i": np.dtype(np.int64), "b": np.dtype(np.bool_)}
_WORDS: dict[str, Any] = {"f": ctypes.c_double, "i": ctypes.c_int64}


@dataclass(frozen=True)
class OuterArray:
    """An array outside the block.

    Parameters
    ----------
    kind : {"f", "i", "b"}
        Of its entries.
    width : int, optional
        Length of its rows, if it is a table.
    table : bool
        Whether it is a table whose rows may have any length.
    """

    kind: str = "f"
    width: int | None = None
    table: bool = False


@dataclass(frozen=True, eq=False)
class _Place:
    """A field of a block: the way to it in the named tuples, where it is, and what it is."""

    way: tuple[int, ...]
    offset: int  # in words of eight bytes
    kind: str
    shape: tuple[int, ...] | None  # of an array inside the block; () of a number in a dataclass
    lengths: int = 0  # of a column
    width: int = 0  # of its rows

    @functools.cached_property
    def dtype(self) -> np.dtype[Any]:
        """Of its entries."""
        return _DTYPES[self.kind]

    @functools.cached_property
    def empty(self) -> Any:
        """A column without entries."""
        return np.zeros((0, self.width)[: 2 if self.width or self.lengths == 2 else 1], self.dtype)


class BlockLayout:
    """Where everything is in a block.

    Parameters
    ----------
    example : named tuple or tuple
        See the module docstring.
    known : callable
        Returns whether a named tuple or an object takes no room.
    inside : bool
        Whether lists are inside the block; otherwise they are columns, of any length.

    Examples
    --------
    >>> from integrators.step_size import Control
    >>> layout = BlockLayout(Control(0.0, 0.0, 1e-6, [0.0, 0.0], 1.0, 0.0), lambda part: False)
    >>> layout.words
    7
    """

    def __init__(self, example: Any, known: Callable[[Any], bool], *, inside: bool = True) -> None:
        self.known, self.inside, self.words = known, inside, 0
        self.numbers: list[_Place] = []
        self.arrays: list[_Place] = []
        self.columns: list[_Place] = []
        self.value = self._value(example, (), Local("p", "block"))
        self._example = example
        self.look_at_numbers = _looker(example, [place.way for place in self.numbers])
        self.look_at_columns = _looker(example, [place.way for place in self.columns])

    @functools.cached_property
    def assigned_columns(self) -> list[tuple[tuple[int, ...], str]]:
        """The ways to dataclasses that have columns, and the names of these."""
        arrays = {place.way for place in self.arrays}
        ways = [place.way for place in self.columns if place.way not in arrays]
        owners = [(way, _found(self._example, way[:-1])) for way in ways]
        return [
            (way[:-1], _names(owner)[way[-1]])
            for way, owner in owners
            if dataclasses.is_dataclass(owner)
        ]

    @functools.cached_property
    def inner(self) -> frozenset[tuple[int, ...]]:
        """The ways to named tuples that contain arrays."""
        ways = [place.way for place in (*self.arrays, *self.columns)]
        return frozenset(way[:k] for way in ways for k in range(1, len(way)))

    def offset(self, name: str) -> int:
        """Return where a number or an array is inside the block.

        Parameters
        ----------
        name : str
            The fields on the way to it, with dots; those of an unnamed tuple by number.

        Returns
        -------
        int
            Its first word.

        Examples
        --------
        >>> from integrators.step_size import Control
        >>> control = Control(0.0, 0.0, 1e-6, [0.0, 0.0], 1.0, 0.0)
        >>> BlockLayout(control, lambda part: False).offset("rtol")
        2
        """
        return self.offsets[name]

    def part(self, name: str) -> Value:
        """Return a part of the block, to be passed to a function.

        Parameters
        ----------
        name : str
            As in `offset`.

        Returns
        -------
        Value
            A number, an array or a record.
        """
        found: Value = self.value
        for each in name.split("."):
            assert isinstance(found, RecordValue)
            found = found[each]
        return found

    @functools.cached_property
    def offsets(self) -> Mapping[str, int]:
        """The first words of all numbers and arrays, by their names; see `offset`."""
        places = (*self.numbers, *self.arrays)
        return {_path(self._example, place.way): place.offset for place in places}

    @functools.cached_property
    def column_numbers(self) -> Mapping[str, int]:
        """The number of each column, by its name."""
        return {_path(self._example, each.way): k for k, each in enumerate(self.columns)}

    @functools.cached_property
    def column_offsets(self) -> Mapping[str, tuple[int, int, int]]:
        """Of each column, by its name: the word of its address, its lengths, its width."""
        each = zip(self.column_numbers, self.columns, strict=True)
        return {name: (place.offset, place.lengths, place.width) for name, place in each}

    def kinds(self) -> list[str]:
        """Return what is in each word: ``"f"``, ``"i"`` or, eight in each, ``"b"``."""
        found = ["i"] * self.words
        for place in self.numbers:
            found[place.offset] = place.kind if place.kind == "f" else "i"
        for place in self.arrays:
            words = -(-place.dtype.itemsize * int(np.prod(place.shape or ())) // 8)
            found[place.offset : place.offset + words] = [place.kind] * words
        return found

    def _value(
        self, example: Any, way: tuple[int, ...], block: Expr, owner: str = ""
    ) -> RecordValue:
        record: Any = type(example)
        names, hints = _names(example), _kinds(record)
        words = numbers_of(record) if dataclasses.is_dataclass(example) else {}
        fields: dict[str, Value] = {}
        for k, (name, part) in enumerate(zip(names, _parts(example), strict=True)):
            here = (*way, k)
            if self.known(part):
                fields[name] = _constant(part)
            elif name in words:
                self.arrays.append(_Place(here, self.words, words[name], ()))
                path = f"{owner}.{name}" if owner else name
                fields[name] = ArrayValue(words[name], (), block, 8 * self.words, name=path)
                self.words += 1
            elif isinstance(part, list | np.ndarray):
                fields[name] = self._array(part, here, block, hints.get(name))
            elif isinstance(part, OuterArray):
                fields[name] = self._column(part, here, block)
            elif _is_record(part):
                fields[name] = self._value(part, here, block, name)
            else:
                kind = hints.get(name) or ("f" if isinstance(part, float) else "i")
                place = Address(block, 8 * self.words)
                fields[name] = NumberValue(Load(kind, place))
                self.numbers.append(_Place(here, self.words, kind, None))
                self.words += 1
        return RecordValue(record, fields)

    def _array(self, part: Any, way: tuple[int, ...], block: Expr, kind: str | None) -> ArrayValue:
        if isinstance(part, np.ndarray):
            kind, shape = part.dtype.kind, part.shape
        else:
            kind, shape = kind or "f", _shape(part)
        if not self.inside:
            made = self._column(OuterArray(kind, table=len(shape) == 2), way, block)
            self.arrays.append(_Place(way, -1, kind, shape))
            return made
        start = self.words
        self.arrays.append(_Place(way, start, kind, shape))
        self.words += -(-_DTYPES[kind].itemsize * int(np.prod(shape)) // 8)
        return ArrayValue(kind, tuple(Const("i", each) for each in shape), block, 8 * start)

    def _column(self, part: OuterArray, way: tuple[int, ...], block: Expr) -> ArrayValue:
        start = self.words
        variable = part.width is not None and not self.inside
        lengths = 2 if part.table or variable else 1
        dims: tuple[Expr, ...] = tuple(
            Load("i", Address(block, 8 * (start + 1 + k))) for k in range(lengths)
        )
        if part.width is not None and not variable:
            dims = dims[0], Const("i", part.width)
        width = 0 if variable else part.width or 0
        self.columns.append(_Place(way, start, part.kind, None, lengths, width))
        self.words += 1 + lengths
        return ArrayValue(part.kind, dims, Load("p", Address(block, 8 * start)))

    def key(self) -> str:
        """Return a text that says where everything is."""
        inside = [place for place in self.arrays if place.offset >= 0]
        return repr((self.words, self.numbers, inside, self.columns))


class MemoryBlock:
    """The memory of one call.

    Parameters
    ----------
    layout : BlockLayout
        Where everything is.
    example : named tuple or tuple
        Its lists become arrays in memory.
    like : MemoryBlock, optional
        A block whose present contents are copied, instead of those of the example.
    words : ndarray of int, optional
        The memory, ``layout.words`` long; the block's own if omitted.

    Attributes
    ----------
    contents : named tuple or tuple
        Like the example, with arrays that are places in the block.
    address : int
        What is passed to machine code.
    words : ndarray of int
        The memory.

    Examples
    --------
    >>> from integrators.step_size import Control
    >>> control = Control(0.0, 0.0, 1e-6, [0.0, 0.5], 1.0, 0.0)
    >>> block = MemoryBlock(BlockLayout(control, lambda part: False), control)
    >>> block.contents.atol
    array([0. , 0.5])
    """

    def __init__(
        self, layout: BlockLayout, example: Any, like: MemoryBlock | None = None, words: Any = None
    ) -> None:
        self.layout = layout
        self._words: Any = np.zeros(layout.words, dtype=np.int64) if words is None else words
        self._floats: Any = self._words.view(np.float64)
        self._columns: list[Any] = [None] * len(layout.columns)  # what they were last time
        kinds = [self._floats if each.kind == "f" else self._words for each in layout.numbers]
        self._targets = kinds, [place.offset for place in layout.numbers]
        self.address: int = self._words.ctypes.data
        made = {place.way: self._array(place) for place in layout.arrays}
        self._outside = [made[place.way] for place in layout.arrays if place.offset < 0]
        if like is None:
            for way, array in made.items():
                if array.size:
                    array[...] = _found(example, way)
        made |= {place.way: place.empty for place in layout.columns if place.way not in made}
        self.contents: Any = self._rebuilt(example, (), made)
        if like is not None:
            self.become(like)

    @property
    def words(self) -> Any:
        """The memory."""
        return self._words

    @property
    def is_whole(self) -> bool:
        """Whether all arrays of the example are inside."""
        return not self._outside

    def become(self, like: MemoryBlock) -> None:
        """Take over what another block contains.

        Parameters
        ----------
        like : MemoryBlock
            Of the same layout and example.
        """
        self._columns[:] = like._columns
        self._words[:] = like._words
        for array, other in zip(self._outside, like._outside, strict=True):
            array[...] = other
        for way, name in self.layout.assigned_columns:
            setattr(_found(self.contents, way), name, getattr(_found(like.contents, way), name))

    def _array(self, place: _Place) -> Any:
        if place.offset < 0:
            return np.zeros(place.shape or (), place.dtype)
        return np.ndarray(place.shape or (), place.dtype, self._words, 8 * place.offset)

    def _rebuilt(
        self, example: Any, way: tuple[int, ...], made: Mapping[tuple[int, ...], Any]
    ) -> Any:
        """Return an example with some parts replaced by places in the block."""
        parts = []
        for k, part in enumerate(_parts(example)):
            here = (*way, k)
            if here in made:
                parts.append(made[here])
            elif here in self.layout.inner:
                parts.append(self._rebuilt(part, here, made))
            else:
                parts.append(part)
        if isinstance(example, tuple):
            return getattr(type(example), "_make", type(example))(parts)
        record: Any = type(example)
        kind, words = _view(record), numbers_of(record)
        view = kind.from_buffer(self._words, made[(*way, 0)].ctypes.data - self.address)
        for name, part in list(zip(_names(example), parts, strict=True))[len(words) :]:
            setattr(view, name, part)
        return view

    def update(self, contents: Any) -> None:
        """Write numbers, and where the columns are, before a call.

        Parameters
        ----------
        contents : named tuple or tuple
            Like the example; arrays inside the block are not looked at.
        """
        numbers = self.layout.look_at_numbers(contents)
        for target, offset, number in zip(*self._targets, numbers, strict=True):
            target[offset] = number
        self.update_columns(contents)

    def update_columns(self, contents: Any) -> list[slice]:
        """Write where the columns are that are others than the last time.

        Parameters
        ----------
        contents : named tuple or tuple
            As for `update`.

        Returns
        -------
        list of slice
            The words of these columns.
        """
        found = self.layout.look_at_columns(contents)
        columns = zip(self.layout.column_numbers.items(), found, strict=True)
        return [self.place(name, u) for (name, k), u in columns if self._columns[k] is not u]

    def place(self, name: str, array: Any) -> slice:
        """Write where a column is.

        Parameters
        ----------
        name : str
            As in `BlockLayout.offset`.
        array : ndarray
            The column.

        Returns
        -------
        slice
            Its words.
        """
        k = self.layout.column_numbers[name]
        place = self.layout.columns[k]
        assert array.dtype == place.dtype
        assert array.flags.c_contiguous
        self._columns[k] = array
        written = slice(place.offset, place.offset + 1 + place.lengths)
        self._words[written] = _address(array), *array.shape[: place.lengths]
        return written

    def numbers(self) -> list[Const]:
        """Return what is in all words; truth values are eight in a word, as an integer."""
        self.update(self.contents)
        rows = zip(self.layout.kinds(), self._floats.tolist(), self._words.tolist(), strict=True)
        return [Const("f", u) if kind == "f" else Const("i", whole) for kind, u, whole in rows]

    def set_words(self) -> Iterator[tuple[int, float | int | list[bool]]]:
        """Yield the words that are not zero, without the addresses and lengths of columns.

        Yields
        ------
        (int, float or int or list of bool)
            The place of a word, and what is in it.
        """
        self.update(self.contents)
        columns = {each.offset + k for each in self.layout.columns for k in range(1 + each.lengths)}
        kinds = self.layout.kinds()
        for k in np.flatnonzero(self._words).tolist():
            if k in columns:
                continue
            if kinds[k] == "f":
                yield k, float(self._floats[k])
            elif kinds[k] == "i":
                yield k, int(self._words[k])
            else:
                yield k, self._words[k : k + 1].view(np.bool_).tolist()

    def copy(self) -> list[Any]:
        """Return the numbers and the arrays of the example, but no columns.

        Returns
        -------
        list of ndarray
            For `restore`.
        """
        return [array.copy() for array in (self._words, *self._outside)]

    def restore(self, copy: list[Any]) -> None:
        """Return to what `copy` returned.

        Parameters
        ----------
        copy : list of ndarray
            Of this block.
        """
        for array, before in zip((self._words, *self._outside), copy, strict=True):
            array[...] = before


_NOTHING: Any = ctypes.c_byte * 0


def _address(array: Any) -> int:
    """Return where the numbers of an array are."""
    if array.flags.writeable:  # in a third of the time
        return ctypes.addressof(_NOTHING.from_buffer(array))
    address: int = array.ctypes.data
    return address


def _looker(example: Any, ways: Sequence[tuple[int, ...]]) -> Callable[[Any], Sequence[Any]]:
    """Return a function that returns what ways lead to.

    Walking them all anew in Python takes longer than some runs.
    """
    names = [_dotted(example, way) for way in ways]
    if len(names) < 2 or "" in names:
        parts = [operator.attrgetter(name) if name else None for name in names]
        pairs = list(zip(parts, ways, strict=True))
        return lambda contents: [
            _found(contents, way) if part is None else part(contents) for part, way in pairs
        ]
    return operator.attrgetter(*names)


def _dotted(example: Any, way: tuple[int, ...]) -> str:
    """Return the names on a way, with dots; nothing if there is a tuple without names."""
    path = _path(example, way)
    return "" if any(name.isdigit() for name in path.split(".")) else path


def _path(example: Any, way: tuple[int, ...]) -> str:
    """Return the names on a way, with dots; numbers where there are none."""
    names = []
    for k in way:
        names.append(_names(example)[k])
        example = _found(example, (k,))
    return ".".join(names)


def _found(contents: Any, way: tuple[int, ...]) -> Any:
    for k in way:
        named = not isinstance(contents, tuple)
        contents = getattr(contents, _names(contents)[k]) if named else contents[k]
    return contents


def _is_record(part: Any) -> bool:
    """Return whether a part of an example is a tuple or a dataclass, which has parts itself."""
    return isinstance(part, tuple) or (
        dataclasses.is_dataclass(part) and not isinstance(part, OuterArray)
    )


def _names(record: Any) -> tuple[str, ...]:
    """Return the names of the fields of a record; their places in a tuple without names."""
    if isinstance(record, tuple) and not hasattr(record, "_fields"):
        return tuple(map(str, range(len(record))))
    names: tuple[str, ...] = type(record).__match_args__
    return names


def _parts(record: Any) -> tuple[Any, ...]:
    """Return the fields of a record, in order."""
    if isinstance(record, tuple):
        return record
    return tuple(getattr(record, name) for name in _names(record))


def parts_of(record: Any, known: Callable[[Any], bool]) -> list[Any]:
    """Return the parts of records that are no records themselves.

    Parameters
    ----------
    record : named tuple, tuple or dataclass
        As for a `BlockLayout`; something else is its own only part.
    known : callable
        As for a `BlockLayout`: what is known has no parts.

    Returns
    -------
    list
        In order.

    Examples
    --------
    >>> parts_of((1, ([2.0], 3)), callable)
    [1, [2.0], 3]
    """
    if _is_record(record) and not known(record):
        return [part for each in _parts(record) for part in parts_of(each, known)]
    return [record]


@functools.cache
def _view(record: Any) -> Any:
    """Return a class like a dataclass whose numbers are words in memory."""
    fields = [(name, _WORDS[kind]) for name, kind in numbers_of(record).items()]
    members = {"_fields_": fields, "__match_args__": record.__match_args__}
    return type(record.__name__, (ctypes.Structure,), members)


def _constant(part: Any) -> Value:
    if hasattr(part, "_fields"):
        names = zip(part._fields, part, strict=True)
        return RecordValue(type(part), {name: _constant(each) for name, each in names})
    if isinstance(part, bool | int | float):
        return NumberValue(Const(_KINDS[type(part)], part))
    return FixedValue(part)


@functools.cache
def _kinds(record: Any) -> dict[str, str]:
    """Return the kinds of the fields of a record, where its hints say them."""
    hints = typing.get_type_hints(record)
    return {name: FIELDS[hint] for name, hint in hints.items() if hint in FIELDS}


def _shape(part: list[Any]) -> tuple[int, ...]:
    """Return the lengths of a list, or of a list of lists."""
    if part and isinstance(part[0], list):
        return len(part), len(part[0])
    return (len(part),)
