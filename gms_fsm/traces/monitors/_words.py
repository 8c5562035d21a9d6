"""Text for values and elements in verdicts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping


def values_text(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in values.items())


def elements_text(numbers: Iterable[int]) -> str:
    """Return the names of elements, numbered from 1."""
    words = [str(i + 1) for i in numbers]
    return f"element{'s' if len(words) > 1 else ''} {', '.join(words)}"
