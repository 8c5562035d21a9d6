"""Checks of argument types for the public API; checks of numbers are in `charts.parameters`."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from gms_fsm.errors import GMSError, ParameterError

__all__ = ["checked_integer", "checked_kind", "checked_path", "listed"]


def checked_kind(name: str, value: Any, kind: type | tuple[type, ...], wanted: str) -> Any:
    """Return a value if it has the required type.

    Examples
    --------
    >>> checked_kind("title", 5, str, "a text")
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: title is 5; it must be a text
    """
    if not isinstance(value, kind):
        raise ParameterError(f"it must be {wanted}", place=name, value=value)
    return value


def checked_path(name: str, value: Any) -> Path:
    """Return a path; raise a `ParameterError` for anything else, and for what names no file.

    Examples
    --------
    >>> checked_path("folder", "")
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: folder is ''; it is empty; write "." for the working directory
    """
    checked_kind(name, value, (str, os.PathLike), "a path, as a text or a Path")
    text = os.fsdecode(value)
    if not text:
        raise ParameterError(
            "it is empty", place=name, value=value, advice='write "." for the working directory'
        )
    return Path(text)


def checked_integer(
    name: str, value: Any, least: int | None = None, kind: type[GMSError] = ParameterError
) -> int:
    """Return an integer.

    Examples
    --------
    >>> checked_integer("points", 0, 1)
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: points is 0; it must be an integer, at least 1
    """
    wanted = "an integer" if least is None else f"an integer, at least {least}"
    try:
        number = operator.index(value)
    except TypeError:
        raise kind(f"it must be {wanted}", place=name, value=value) from None
    if isinstance(value, bool) or (least is not None and number < least):
        raise kind(f"it must be {wanted}", place=name, value=value)
    return number


def listed(name: str, value: Any, wanted: str) -> list[Any]:
    """Return an iterable as a list; raise a `ParameterError` for anything else."""
    return list(checked_kind(name, value, Iterable, wanted))
