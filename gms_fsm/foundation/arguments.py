"""Checks of arguments: their types, and names that nobody knows.

Checks of numbers are in `charts.parameters`.
"""

from __future__ import annotations

import contextlib
import difflib
import functools
import inspect
import operator
import os
import textwrap
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar, cast

from gms_fsm.errors import GMSError, ParameterError, shown

Called = TypeVar("Called", bound=Callable[..., Any])
Kind = TypeVar("Kind", bound=type)
OWN = ("self", "cls")
ANY_NUMBER = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
MOST_NAMED = 12  # of all names: more are a wall that nobody reads


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
    """Return an iterable as a list; raise a `ParameterError` for anything else, and for a text.

    Examples
    --------
    >>> listed("records", "rig.csv", "records")
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: records is 'rig.csv'; it must be records
    """
    if isinstance(value, str):
        raise ParameterError(f"it must be {wanted}", place=name, value=value)
    return list(checked_kind(name, value, Iterable, wanted))


# --------------------------------------------------------------------------- of a call
def refusing(
    error: type[GMSError] = ParameterError,
    *advice: str,
    instead: Mapping[str, str] | None = None,
    quick: tuple[str, ...] = (),
    **needed: str,
) -> Callable[[Called], Called]:
    """Return a decorator: a class or function refuses arguments that it does not take, or lacks.

    So do the methods of a class, except those that are `quick`, for which a look at each call would
    cost too much: their own checks refuse what is lacking. `instead` has names of other programs,
    with ours; `needed` says what to give for one that is missing, `advice` what else holds where
    there is no such argument.

    Examples
    --------
    >>> @refusing(speed="a number [m/s]")
    ... def belt(speed, load=1.0): ...
    >>> belt(spede=0.1)
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: belt: it has no argument 'spede'; did you mean 'speed'? \
it takes speed, load
    >>> belt()
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: belt: speed is missing; give a number [m/s]
    """

    def guarded(kind: Any, call: Any, *more: str) -> Any:
        @functools.wraps(call)
        def checked(*args: Any, **given: Any) -> Any:
            try:
                return call(*args, **given)
            except TypeError:
                misfit = _misfit(kind, call, args, given, instead or {}, needed, more)
                if misfit is None:  # raised within
                    raise
                place, reason, *rest = misfit
            raise error(reason, place=place, advice="; ".join(rest))

        return checked

    def add(kind: Called) -> Called:
        if not isinstance(kind, type):
            return cast("Called", guarded(kind, kind, *advice))
        kind.__init__ = guarded(kind, kind.__init__, *advice)  # type: ignore[misc]
        for name, each in [*vars(kind).items()]:
            method = getattr(each, "__func__", each)
            if name.startswith("_") or not inspect.isfunction(method):
                continue
            if name in quick:
                _lacking(method)
            elif not hasattr(method, "__wrapped__"):
                checked = guarded(method, method)
                setattr(kind, name, checked if method is each else type(each)(checked))
        return kind

    return add


class _Lacking:
    """Stands for an argument that is lacking."""

    def __repr__(self) -> str:
        return "missing"


LACKING = _Lacking()


def _lacking(call: Any) -> None:
    """Let a function be called without its arguments, so that its checks see that they lack."""
    call.__signature__ = inspect.signature(call)
    call.__defaults__ = (LACKING,) * (call.__code__.co_argcount - 1)


def _misfit(
    kind: Any,
    call: Callable[..., Any],
    args: tuple[Any, ...],
    given: Mapping[str, Any],
    instead: Mapping[str, str],
    needed: Mapping[str, str],
    advice: tuple[str, ...],
) -> tuple[str, ...] | None:
    """Return place, reason and advice if a call does not fit; None if it does."""
    signature = inspect.signature(call)
    try:
        signature.bind(*args, **given)
    except TypeError as error:
        said = str(error)
    else:
        return None
    every = {name: each for name, each in signature.parameters.items() if name not in OWN}
    args = args[len(signature.parameters) - len(every) :]
    takes = {name: each for name, each in every.items() if each.kind not in ANY_NUMBER}
    place = kind.__qualname__
    if isinstance(kind, type) and "name" in takes and (args or "name" in given):
        place = f"{kind.__name__.lower()} {shown(given.get('name', args[0] if args else None))}"
    for name in given if takes == every else ():
        if name not in takes:
            ours = instead.get(name)
            near = ours if ours in takes else nearest(name, takes)
            hint = f"did you mean {near!r}? " if near else ""
            return (
                place,
                f"it has no argument {name!r}",
                f"{hint}it takes {', '.join(takes) or 'none'}",
                *advice,
            )
    ordered = [name for name, each in takes.items() if each.kind is not each.KEYWORD_ONLY]
    if len(args) > len(ordered):
        rest = [name for name in takes if name not in ordered]
        form = f": {', '.join(f'{name}=...' for name in rest)}" if rest else ""
        cure = f"give at most {len(ordered)}{', the others by name' * bool(rest)}{form}"
        if not ordered:
            cure = f"give each by its name{form}" if rest or takes != every else "it takes none"
        several = f"{len(args)} argument{'s' * (len(args) > 1)} without a name"
        return place, f"{several} {'are' if len(args) > 1 else 'is'} too many", cure
    for name, each in takes.items():
        if each.default is each.empty and name not in given and name not in ordered[: len(args)]:
            return place, f"{name} is missing", f"give {needed.get(name, f'{name}=...')}"
    return place, said


def pointing(ours: Mapping[str, str]) -> Callable[[Kind], Kind]:
    """Return a decorator: a class that is asked for what other programs have says what is ours.

    Examples
    --------
    >>> @pointing({"velocity": "run.v"})
    ... class Run: ...
    >>> Run().velocity
    Traceback (most recent call last):
    AttributeError: a Run has no 'velocity'; write run.v
    """

    def add(kind: Kind) -> Kind:
        def missing(self: object, name: str) -> Any:
            if make := vars(self).get(LATER):
                vars(self).update(vars(make()))
                vars(self).pop(LATER, None)
                return getattr(self, name)
            if name in vars(self):  # another thread has just made it
                return vars(self)[name]
            if hasattr(kind, name):
                return object.__getattribute__(self, name)  # raises what the property has raised
            cure = f"; write {ours[name]}" if name in ours else ""
            raise AttributeError(f"a {kind.__name__} has no {name!r}{cure}", name=name, obj=self)

        kind.__getattr__ = missing  # type: ignore[attr-defined]
        return kind

    return add


LATER = "_made_later"


def later(kind: type[Any], make: Callable[[], Any], **known: Any) -> Any:
    """Return an object of a class that `pointing` decorates; `make` is called when it is read.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @pointing({})
    ... @dataclass(frozen=True)
    ... class Run:
    ...     v: float
    >>> later(Run, lambda: Run(0.2)).v
    0.2
    """
    new = object.__new__(kind)
    vars(new).update(known)
    vars(new)[LATER] = make
    return new


def copied(it: Any, **others: Any) -> Any:
    """Return an object of a dataclass with other fields, unchecked: all of them fit together.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Run:
    ...     v: float
    ...     w: float = 0.5
    >>> copied(Run(0.2), w=1.0)
    Run(v=0.2, w=1.0)
    """
    new, own, fields = object.__new__(type(it)), vars(it), it.__dataclass_fields__
    if len(own) > len(fields):  # there are properties that have been computed
        own = {name: own[name] for name in fields}
    vars(new).update(own, **others)
    return new


# --------------------------------------------------------------------------- names
def nearest(name: object, known: Iterable[str], cutoff: float = 0.6) -> str:
    """Return the known name most like a wrong one, whatever its case; empty if none is.

    A name of which the wrong one is the beginning is near, too, and one of which it is the end
    behind a dot.

    Examples
    --------
    >>> nearest("F_s", ["numbers.F_c", "bearing.F_s"])
    'bearing.F_s'
    >>> nearest("SIGMA2", ["k", "sigma_2"]), nearest("mass", ["k"]), nearest("GMS", ["gms-signed"])
    ('sigma_2', '', 'gms-signed')
    """
    by_case = {each.casefold(): each for each in known}
    folded = str(name)[:100].casefold()
    inner = [each for each in by_case if each.endswith(f".{folded}")]
    near = inner[:1] or difflib.get_close_matches(folded, by_case, n=1, cutoff=cutoff)
    if not near and len(folded) > 2:
        near = [each for each in by_case if each.startswith(folded)]
    return by_case[near[0]] if near else ""


def meant(name: object, known: Iterable[str]) -> str:
    """Return the question whether the nearest name was meant, with a blank after it."""
    near = nearest(name, known)
    return f"did you mean {near!r}? " if near else ""


def some_of(known: Iterable[str]) -> str:
    """Return names as one text; of very many the first.

    Examples
    --------
    >>> some_of(["k", "sigma_2"]), some_of([])
    ('k, sigma_2', 'none')
    """
    names = [*known]
    more = len(names) - MOST_NAMED
    if more > 1:
        return f"{', '.join(names[:MOST_NAMED])} and {more} more"
    return ", ".join(names) or "none"


def either(choices: Iterable[str]) -> str:
    """Return choices as one text.

    Examples
    --------
    >>> either(["a", "b", "c"])
    "'a', 'b' or 'c'"
    """
    *first, last = map(repr, choices)
    return f"{', '.join(first)} or {last}" if first else last


def unknown(
    noun: str, name: object, known: Iterable[str], kind: type[GMSError] = ParameterError, **at: Any
) -> GMSError:
    """Return the error of a name that is not known; `at` is its place and key.

    Examples
    --------
    >>> print(unknown("parameter", "K", ["k", "sigma_2"]))
    there is no parameter 'K'; did you mean 'k'? there are k, sigma_2
    """
    return kind(f"there is no {noun} {shown(name)}", advice=there_are(name, known), **at)


def there_are(name: object, known: Iterable[str], *, every: bool = False) -> str:
    """Return the advice on a name that is not known: with names, or every name there is.

    Examples
    --------
    >>> there_are("K", ["k", "sigma_2"])
    "did you mean 'k'? there are k, sigma_2"
    """
    names = [*dict.fromkeys(known)]
    hint = meant(name, names)
    if every and len(names) > MOST_NAMED:
        return "\n".join([f"{hint}there are", *textwrap.wrap(", ".join(names), 76)])
    if hint and len(names) > MOST_NAMED + 1:  # a wall of names would hide the one that is meant
        return f"{hint}there are {len(names)} in all"
    return f"{hint}there {'is only' if len(names) == 1 else 'are'} {some_of(names)}"


def no_file(path: str | os.PathLike[str], kind: type[GMSError]) -> GMSError:
    """Return the error of a file that is missing: it names those of its folder.

    Examples
    --------
    >>> print(no_file("no/such/folder/run.npz", GMSError))
    no/such/folder/run.npz: no such file; there is no folder no/such/folder either
    """
    place = Path(path)
    advice = f"there is no folder {place.parent} either"
    with contextlib.suppress(OSError):
        there = [each.name for each in place.parent.iterdir() if not each.name.startswith(".")]
        alike = sorted(each for each in there if place.suffix in ("", Path(each).suffix))
        what = f"no *{place.suffix}" if place.suffix else "nothing"
        where = "this folder" if place.parent == Path() else str(place.parent)
        near = nearest(place.stem, stems := {Path(each).stem: each for each in alike})
        advice = f"did you mean {stems[near]!r}? " if near else ""
        if not advice or len(alike) <= MOST_NAMED:
            advice += f"in {where} there is {some_of(alike) if alike else what}"
    return kind("no such file", place=str(path), advice=advice)


def one_of(
    place: str, value: Any, choices: Iterable[str], kind: type[GMSError] = ParameterError
) -> str:
    """Return one of several texts.

    Examples
    --------
    >>> one_of("search", "hop", ["hops", "local"])
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: search is 'hop'; it must be 'hops' or 'local'
    """
    known = [*choices]
    if not isinstance(value, str) or value not in known:
        raise kind(f"it must be {either(known)}", place=place, value=value)
    return value
