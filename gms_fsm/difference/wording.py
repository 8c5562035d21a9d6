"""What values are called in a comparison: two that differ never look the same."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from gms_fsm.errors import cut
from gms_fsm.language import EVENT
from gms_fsm.systems.signals import Corners, Formula, Function
from gms_fsm.verification.findings import listed

AROUND = 10  # characters shown before the first that differs


def said(value: Any, *, exact: bool = False) -> str:
    """Return a value as text, its numbers with nine digits or with all."""
    match value:
        case None:
            return "none"
        case Formula():
            return value.text
        case Corners():
            return said([*zip(value.times.tolist(), value.values.tolist(), strict=True)])
        case Function():
            return "a Python function"
        case float():
            return (repr(float(value)) if exact else f"{value:.9g}").removesuffix(".0")
        case np.ndarray() | np.generic():
            return said(value.tolist(), exact=exact)
        case Mapping():
            each = (f"{name} = {said(one, exact=exact)}" for name, one in value.items())
            return ", ".join(each)
        case list() | tuple():
            parts = [said(one, exact=exact) for one in value]
            inner = any(isinstance(one, tuple) for one in value)
            return ", ".join(f"({part})" for part in parts) if inner else ", ".join(parts)
        case type():
            return value.__name__
    return str(value)


def both(one: Any, other: Any) -> tuple[str, str]:
    """Return two values that differ as texts that differ, cut if they are long.

    Examples
    --------
    >>> both(1.0, 2.0), both(1.0, 1.0 + 2**-52)
    (('1', '2'), ('1', '1.0000000000000002'))
    """
    texts = "", ""
    for exact in (False, True):
        texts = said(one, exact=exact), said(other, exact=exact)
        short = cut(texts[0]), cut(texts[1])
        if short[0] != short[1]:
            return short
    if texts[0] == texts[1]:
        return short[0], f"another that reads {short[0]}"
    shared = itertools.takewhile(lambda pair: pair[0] == pair[1], zip(*texts, strict=False))
    start = max(0, len([*shared]) - AROUND)
    return f"... {cut(texts[0][start:])}", f"... {cut(texts[1][start:])}"


def fields_apart(one: Any, other: Any) -> tuple[str, str]:
    """Return the fields that differ in two parts of a system, as texts."""
    rows = []
    for name in (each.name for each in fields(one)):
        before, after = getattr(one, name), getattr(other, name)
        if isinstance(before, Mapping) and isinstance(after, Mapping):
            if [*before.items()] == [*after.items()]:
                continue
            if before == after:
                before, after, name = [*before], [*after], f"order of {name}"
            else:
                apart = {key for key in {**before, **after} if before.get(key) != after.get(key)}
                before, after = (
                    {key: text for key, text in each.items() if key in apart} or None
                    for each in (before, after)
                )
        elif before == after:
            continue
        rows.append([f"{name}: {text}" for text in both(before, after)])
    return "; ".join(row[0] for row in rows), "; ".join(row[1] for row in rows)


def point_text(point: Mapping[str, float]) -> str:
    """Return named numbers as text, events by their names.

    Examples
    --------
    >>> point_text({"event__hot": 1.0, "z": 2.0})
    'event hot has come, z = 2'
    """
    return ", ".join(
        f"event {name.removeprefix(EVENT)} has {'' if value > 0.5 else 'not '}come"
        if name.startswith(EVENT)
        else listed({name: value})
        for name, value in point.items()
    )
