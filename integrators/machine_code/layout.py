"""Blocks of memory that hold all arguments of a function, and what their fields are called.

A block is described by an example: named tuples of numbers, of lists and of `Column`. Lists become
arrays inside the block, with constant lengths; a `Column` is an array elsewhere, of which the block
holds the address and the length. Functions and `Coefficients` are known while translating and take
no room.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from integrators.machine_code.tree import Address, Const, Expr, Load, Local
from integrators.machine_code.values import Array, Fixed, Number, Record, Value

__all__ = ["Column", "Layout"]

_KINDS = {float: "f", int: "i", bool: "b"}
_DTYPES = {"f": np.dtype(np.float64), "i": np.dtype(np.int64), "b": np.dtype(np.bool_)}


@dataclass(frozen=True)
class Column:
    """An array outside the block.

    Parameters
    ----------
    kind : str
        ``"f"`` or ``"i"``.
    width : int, optional
        Length of its rows, if it is a table.
    """

    kind: str = "f"
    width: int | None = None


class Layout:
    """Where everything is in a block.

    Parameters
    ----------
    example : named tuple or tuple
        See the module docstring.
    known : callable
        Returns whether a named tuple or an object takes no room.

    Examples
    --------
    >>> from integrators.step_size import Control
    >>> layout = Layout(Control(0.0, 0.0, 1e-6, [0.0, 0.0], 1.0, 0.0), lambda part: False)
    >>> layout.dtype["atol"].shape, layout.dtype.itemsize
    ((2,), 56)
    """

    def __init__(self, example: Any, known: Callable[[Any], bool]) -> None:
        self._known = known
        self.dtype = self._dtype(example)
        self.value = self._value(example, self.dtype, 0, Local("p", "block"))

    def _parts(self, example: Any) -> Iterator[tuple[str, Any]]:
        names = getattr(example, "_fields", None) or map(str, range(len(example)))
        return zip(names, example, strict=True)

    def _dtype(self, example: Any) -> np.dtype[Any]:
        fields: list[tuple[str, Any]] = []
        for name, part in self._parts(example):
            if self._known(part):
                continue
            if isinstance(part, tuple):
                fields.append((name, self._dtype(part)))
            elif isinstance(part, Column):
                fields += [(name, np.dtype(np.uint64)), (f"{name}_n", np.dtype(np.int64))]
            elif isinstance(part, list):
                kind, dims = _shape(part)
                fields.append((name, np.dtype((_DTYPES[kind], dims))))
            else:
                # A truth value takes as much room as the others: everything stays aligned.
                fields.append((name, _DTYPES["f" if isinstance(part, float) else "i"]))
        return np.dtype(_aligned(fields))

    def _value(self, example: Any, dtype: np.dtype[Any], start: int, block: Expr) -> Record:
        fields: dict[str, Value] = {}
        for name, part in self._parts(example):
            if self._known(part):
                fields[name] = self._constant(part)
                continue
            inner, offset = dtype.fields[name][:2]  # type: ignore[index]
            place = Address(block, start + offset)
            if isinstance(part, tuple):
                fields[name] = self._value(part, inner, start + offset, block)
            elif isinstance(part, Column):
                length = Load("i", Address(block, start + offset + 8))
                dims: tuple[Expr, ...] = (length,)
                if part.width is not None:
                    dims = length, Const("i", part.width)
                fields[name] = Array(part.kind, dims, Load("p", place))
            elif isinstance(part, list):
                kind, shape = _shape(part)
                lengths = tuple(Const("i", each) for each in shape)
                fields[name] = Array(kind, lengths, block, start + offset)
            elif isinstance(part, bool):
                fields[name] = Number(Load("i", place))
            else:
                fields[name] = Number(Load(_KINDS[type(part)], place))
        return Record(type(example), fields)

    def _constant(self, part: Any) -> Value:
        if hasattr(part, "_fields"):
            names = zip(part._fields, part, strict=True)
            return Record(type(part), {name: self._constant(each) for name, each in names})
        if isinstance(part, bool | int | float):
            return Number(Const(_KINDS[type(part)], part))
        return Fixed(part)


def _shape(part: Any) -> tuple[str, tuple[int, ...]]:
    """Return the kind and the lengths of a list."""
    if part and isinstance(part[0], list):
        kind, dims = _shape(part[0])
        return kind, (len(part), *dims)
    return (_KINDS[type(part[0])] if part else "f"), (len(part),)


def _aligned(fields: list[tuple[str, Any]]) -> dict[str, Any]:
    """Place fields one after another, each at a multiple of eight bytes."""
    offsets, end = [], 0
    for _, dtype in fields:
        offsets.append(end)
        end += -(-dtype.itemsize // 8) * 8
    return {
        "names": [name for name, _ in fields],
        "formats": [dtype for _, dtype in fields],
        "offsets": offsets,
        "itemsize": end,
    }
