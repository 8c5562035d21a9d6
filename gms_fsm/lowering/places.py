"""Arrays whose places have names, and how these places read in generated text."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

Name = TypeVar("Name", bound=Hashable)


@dataclass(frozen=True)
class ElementPlaces(Generic[Name]):
    """Names with one place per element each.

    Parameters
    ----------
    names : tuple
        One after the other.
    n : int
        Number of elements.
    size : str
        Their number in generated text: a name, or a numeral.
    """

    names: tuple[Name, ...]
    n: int
    size: str = "n"


@dataclass(frozen=True)
class Places(Generic[Name]):
    """The layout of an array: shared names first, then blocks of names with a place per element.

    In generated text the element is called ``i``.

    Parameters
    ----------
    shared : tuple
        Names with one place each.
    blocks : tuple of ElementPlaces
        Names with one place per element each.

    Examples
    --------
    >>> y = Places(("x", "v"), (ElementPlaces(("z", "w"), 3),))
    >>> y.size, y.index("v"), y.index("w", 2), y.block("z")
    (8, 1, 7, slice(2, 5, None))
    >>> y.text("v"), y.text("z"), y.text("w"), y.size_text()
    ('1', '2 + i', '2 + n + i', '2 + 2 * n')
    >>> y.named([0.0, 0.1, 1, 2, 3, 4, 5, 6])
    {'x': 0.0, 'v': 0.1, 'z': [1, 2, 3], 'w': [4, 5, 6]}
    """

    shared: tuple[Name, ...]
    blocks: tuple[ElementPlaces[Name], ...]

    @cached_property
    def own(self) -> tuple[Name, ...]:
        """The names with one place per element."""
        return tuple(name for block in self.blocks for name in block.names)

    @cached_property
    def size(self) -> int:
        """The number of places."""
        return len(self.shared) + sum(len(block.names) * block.n for block in self.blocks)

    def __iter__(self) -> Iterator[tuple[Name, int | None]]:
        """Yield for each place, in order, its name and its element (None if shared)."""
        yield from ((name, None) for name in self.shared)
        for block in self.blocks:
            yield from ((name, i) for name in block.names for i in range(block.n))

    def index(self, name: Name, element: int = 0) -> int:
        """Return the place of a shared name, or of an own name of one element."""
        start, _ = self._spans[name]
        return start if start < len(self.shared) else start + element

    @cached_property
    def _spans(self) -> Mapping[Name, tuple[int, int]]:
        """First place and number of places of each name."""
        spans = {name: (place, 1) for place, name in enumerate(self.shared)}
        start = len(self.shared)
        for block in self.blocks:
            for name in block.names:
                spans[name] = start, block.n
                start += block.n
        return spans

    def block(self, name: Name) -> slice:
        """Return the places of an own name, one per element."""
        start, count = self._spans[name]
        return slice(start, start + count)

    def where(self, name: Name) -> int | slice:
        """Return the subscript for an array that selects everything under a name."""
        return self._all[name]

    @cached_property
    def _all(self) -> Mapping[Name, int | slice]:
        """The subscript of each name."""
        shared: dict[Name, int | slice] = {name: self._spans[name][0] for name in self.shared}
        return shared | {name: self.block(name) for name in self.own}

    def all_of(self, name: Name) -> range:
        """Return the places of a name: one if it is shared, else one per element."""
        start, count = self._spans[name]
        return range(start, start + count)

    def named(self, values: Any) -> dict[Name, Any]:
        """Return the values by name."""
        return {name: values[where] for name, where in self._all.items()}

    def joined(self, values: Mapping[Name, Any]) -> list[Any]:
        """Return entries in the order of the places; the inverse of `named`."""
        return [values[name] if i is None else values[name][i] for name, i in self]

    # ------------------------------------------------------------------ as text
    def text(self, name: Name) -> str:
        """Return a place as Python text over ``i`` and the sizes."""
        block, place = self._found[name]
        return str(place) if block < 0 else total([self.start_text(name), "i"])

    def start_text(self, name: Name, after: int = 0) -> str:
        """Return the first place of a name as Python text over the sizes."""
        block, place = self._found[name]
        if block < 0:
            return str(place + after)
        rows = [_times(place + after, self.blocks[block].size)] if place + after else []
        return total([*self._before[block], *rows])

    def sizes(self, name: Name) -> frozenset[str]:
        """Return which sizes the text of a place reads."""
        block, place = self._found[name]
        if block < 0:
            return frozenset()
        return self._sizes[block] | ({self.blocks[block].size} if place else set())

    @cached_property
    def _found(self) -> Mapping[Name, tuple[int, int]]:
        """The block of each name, -1 if it is shared, and its place among the names there."""
        groups = enumerate((self.shared, *(block.names for block in self.blocks)), -1)
        return {name: (k, place) for k, names in groups for place, name in enumerate(names)}

    @cached_property
    def _before(self) -> Sequence[Sequence[str]]:
        """The terms of the first place of each block."""
        terms = [str(len(self.shared))]
        found = [terms]
        for block in self.blocks:
            rows = [_times(len(block.names), block.size)] if block.names else []
            terms = total([*terms, *rows]).split(" + ")
            found.append(terms)
        return found

    @cached_property
    def _sizes(self) -> Sequence[frozenset[str]]:
        """The sizes of the blocks before each one."""
        found = [frozenset[str]()]
        for block in self.blocks:
            found.append(found[-1] | ({block.size} if block.names else set()))
        return found

    def size_text(self, more: int = 0) -> str:
        """Return how many places there are, and some more, as Python text over the sizes."""
        terms = [str(len(self.shared) + more)]
        terms += [_times(len(block.names), block.size) for block in self.blocks if block.names]
        return total(terms)


def total(terms: Iterable[str]) -> str:
    """Return a sum as Python text, with its numerals added up.

    Examples
    --------
    >>> total(["2", "n", "i"]), total(["2", "3", "i"]), total([])
    ('2 + n + i', '5 + i', '0')
    """
    numbers, names = 0, list[str]()
    for term in terms:
        if term.isdigit():
            numbers += int(term)
        else:
            names.append(term)
    return " + ".join([str(numbers), *names] if numbers or not names else names)


def _times(rows: int, size: str) -> str:
    """Return a product as Python text."""
    if size.isdigit():
        return str(rows * int(size))
    return size if rows == 1 else f"{rows} * {size}"
