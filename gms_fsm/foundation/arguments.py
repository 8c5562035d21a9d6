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

    Parameters
    ----------
    name : str
        The argument's name.
    value : object
        The value to check.
    kind : type or tuple of type
        The required type.
    wanted : str
        The same in words, for the message.

    Returns
    -------
    object
        The value.

    Raises
    ------
    ParameterError
        If it has another type.

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

    Parameters
    ----------
    name : str
        The argument's name.
    value : str or Path
        The value to check.

    Returns
    -------
    Path
        The path.

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

    Parameters
    ----------
    name : str
        The argument's name.
    value : int
        The value to check; True and False are not accepted.
    least : int, optional
        The smallest allowed value.
    kind : type of GMSError
        The class of error to raise.

    Returns
    -------
    int
        The number.

    Raises
    ------
    GMSError
        If it is not an integer, or too small.

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
    """Return an iterable as a list; raise a `ParameterError` for anything else.

    Parameters
    ----------
    name : str
        The argument's name.
    value : iterable
        The value to convert.
    wanted : str
        The requirement in words, for the message.

    Returns
    -------
    list
        Its items.
    """
    return list(checked_kind(name, value, Iterable, wanted))
