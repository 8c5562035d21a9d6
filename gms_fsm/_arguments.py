"""Checks of the kind of an argument, for every public entry; numbers are in `charts.parameters`."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from gms_fsm.errors import GMSError, ParameterError

__all__ = ["checked_kind", "checked_path", "checked_whole", "listed"]


def checked_kind(name: str, value: Any, kind: type | tuple[type, ...], wanted: str) -> Any:
    """Return a value if it is of a kind.

    Parameters
    ----------
    name : str
        The argument.
    value : object
        What was given.
    kind : type or tuple of type
        What it must be.
    wanted : str
        The same in words.

    Returns
    -------
    object
        The value.

    Raises
    ------
    ParameterError
        If it is of another kind.

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
    """Return a path; raise a `ParameterError` for what is none.

    Parameters
    ----------
    name : str
        The argument.
    value : str or Path
        What was given.

    Returns
    -------
    Path
        The path.
    """
    return Path(checked_kind(name, value, (str, os.PathLike), "a path, as a text or a Path"))


def checked_whole(
    name: str, value: Any, least: int | None = None, kind: type[GMSError] = ParameterError
) -> int:
    """Return a whole number.

    Parameters
    ----------
    name : str
        The argument.
    value : int
        What was given; True and False are no numbers here.
    least : int, optional
        The smallest that will do.
    kind : type of GMSError
        What to raise.

    Returns
    -------
    int
        The number.

    Raises
    ------
    GMSError
        If it is none, or too small.

    Examples
    --------
    >>> checked_whole("points", 0, 1)
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
    """Return what can be gone through as a list; raise a `ParameterError` for what cannot.

    Parameters
    ----------
    name : str
        The argument.
    value : iterable
        What was given.
    wanted : str
        What it must be, in words.

    Returns
    -------
    list
        Its items.
    """
    return list(checked_kind(name, value, Iterable, wanted))
