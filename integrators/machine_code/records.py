"""Records: dataclasses whose numbers come first among their fields, and can be assigned."""

from __future__ import annotations

import functools
import typing
from collections.abc import Iterable
from typing import Any

# Kinds of fields; truth values that are not in lists take a word, as integers do.
FIELDS: dict[Any, str] = {
    float: "f", int: "i", bool: "i", list[int]: "i", list[list[int]]: "i", list[bool]: "b",
}  # fmt: skip


@functools.cache
def numbers_of(record: Any) -> dict[str, str]:
    """Return the kinds of the numbers of a dataclass, by name.

    Examples
    --------
    >>> from integrators.steps import Now
    >>> [*numbers_of(Now)][:2]
    ['t', 'h']
    """
    hints = typing.get_type_hints(record)
    kinds = {name: FIELDS[hint] for name, hint in hints.items() if hint in (float, int, bool)}
    assert [*kinds] == [*hints][: len(kinds)], f"numbers come first in {record.__name__}"
    return kinds


def arrays_of(record: Any) -> tuple[str, ...]:
    """Return the names of the fields of a dataclass that are no numbers."""
    names: tuple[str, ...] = record.__match_args__[len(numbers_of(record)) :]
    return names


def numbers_in(record: Any, names: Iterable[str]) -> list[Any]:
    """Return some numbers of a record."""
    return [getattr(record, name) for name in names]


def put_numbers(record: Any, names: Iterable[str], numbers: Iterable[Any]) -> None:
    """Assign some numbers of a record."""
    for name, number in zip(names, numbers, strict=True):
        setattr(record, name, number)
