"""The errors of the package, with one base; those that carry a run: `gms_fsm.traces.failures`.

A user's mistake is a `GMSError`: its text says what is wrong, where, with which value, and what to
do. The command line prints that text and exits with code 2; Python callers can catch the base.
"""

from __future__ import annotations

import contextlib
import copy
import copyreg
import enum
from collections.abc import Iterator
from typing import Any, NamedTuple, Self

LONGEST_SHOWN = 120  # characters of a value in a message
SCENE = 72  # of the line of a text that is at fault


def cut(text: str, longest: int = LONGEST_SHOWN) -> str:
    """Return a text cut to a length suitable for a message.

    >>> cut("abcdef", 3)
    'abc ...'
    """
    return text if len(text) <= longest else f"{text[:longest]} ..."


def shown(value: object) -> str:
    """Return a value as a message shows it: its Python repr, cut if it is long.

    NumPy numbers appear as plain numbers: 20.0, not np.float64(20.0). What would take several
    lines, such as a table, is only named, unless it is an array.

    >>> shown("abc")
    "'abc'"
    """
    if type(value) is str:
        return cut(repr(value))
    try:
        text = repr(_plain(value))
        if "\n" in text:
            plain = hasattr(value, "dtype") or type(value) in (list, tuple, dict)
            text = " ".join(text.split()) if plain else f"<{type(value).__name__}>"
        return cut(text)
    except (RecursionError, ValueError):  # nested too deeply; an integer of 5,000 digits
        return "..."


def _plain(value: object) -> object:
    """Return NumPy numbers as Python numbers, also inside tuples, lists and mappings."""
    if type(value) is tuple:
        return tuple(map(_plain, value))
    if type(value) is list:
        return list(map(_plain, value))
    if type(value) is dict:
        return {_plain(key): _plain(each) for key, each in value.items()}
    return value.item() if getattr(value, "shape", None) == () else value  # type: ignore[attr-defined]


def why(error: BaseException) -> str:
    """Return another library's error message in one line.

    NumPy's advice to unpickle an unreadable file is left out.

    >>> why(ValueError("no header. If you trust the file, unpickle it"))
    'ValueError: no header.'
    """
    text = cut(str(error).partition("\n")[0].partition(" If you trust")[0], 200)
    return f"{type(error).__name__}: {text}" if text else type(error).__name__


class _Nothing(enum.Enum):
    """Represents a missing value, because None may be the invalid value."""

    NOTHING = enum.auto()


NOTHING = _Nothing.NOTHING


class GMSError(Exception):
    """Base of every error that this package raises on purpose; its text is made from its fields.

    Parameters
    ----------
    reason : str
        What is wrong: ``"it must be > 0"``, ``"there is no such file"``.
    place : str, optional
        Where: an argument, a file, a key or column in a file, an edge of a chart.
    value : object, optional
        The value found there.
    advice : str, optional
        What to do about it.
    key : tuple of str or int, optional
        The part of a chart, a system or the arguments of a call that is at fault, as the names of
        attributes and places in sequences that lead to it: ``("transitions", 2, "guard")``,
        ``("initial", "z")``. Not shown; a file finds its line by it.

    Examples
    --------
    >>> print(GMSError("it must be > 0", place="step", value=-1.0, advice="leave it out"))
    step is -1.0; it must be > 0; leave it out
    >>> print(GMSError("no such file", place="run.toml"))
    run.toml: no such file
    >>> print(GMSError("it must be > 0", place="step", value=-1.0).inside("run.toml"))
    run.toml: step is -1.0; it must be > 0
    """

    def __init__(
        self,
        reason: str,
        *,
        place: str = "",
        value: object = NOTHING,
        advice: str = "",
        key: tuple[str | int, ...] = (),
    ) -> None:
        self.reason, self.place, self.value, self.advice = reason, place, value, advice
        self.key = key
        self.outer = ""  # what contains the place: files, keys
        super().__init__(reason)

    def __str__(self) -> str:
        head = (
            "" if self.value is NOTHING else f"{self.place or 'the value'} is {shown(self.value)}; "
        )
        if not head and self.place:
            head = f"{self.place}: "
        text = f"{head}{self.reason}" + (f"; {self.advice}" if self.advice else "")
        return f"{self.outer}: {text}" if self.outer else text

    def __repr__(self) -> str:
        return f"{type(self).__name__}({str(self)!r})"

    def __reduce__(self) -> tuple[Any, ...]:
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]

    def inside(self, place: object) -> Self:
        """Return this error with an enclosing place added, such as a file.

        Parameters
        ----------
        place : str or Path
            What contains the place that the error names.

        Returns
        -------
        GMSError
            An error of the same class with the same fields.
        """
        return self.replaced(outer=f"{place}: {self.outer}" if self.outer else str(place))

    def replaced(self, **fields: object) -> Self:
        """Return this error with some fields replaced.

        Parameters
        ----------
        **fields : object
            New values, by name.

        Returns
        -------
        GMSError
            An error of the same class.

        Examples
        --------
        >>> print(GMSError("it must be > 0", place="alpha", value=0).replaced(place="shares"))
        shares is 0; it must be > 0
        """
        again = copy.copy(self)
        for name, value in fields.items():
            setattr(again, name, value)
        return again

    @classmethod
    def of(cls, error: GMSError) -> Self:
        """Return an error of this class with the fields of another.

        Parameters
        ----------
        error : GMSError
            For example an error in a signal from a scenario file.

        Returns
        -------
        GMSError
            An error of this class.

        Examples
        --------
        >>> ScenarioError.of(UnitError("unknown unit", place="column 't'", value="mN"))
        ScenarioError("column 't' is 'mN'; unknown unit")
        """
        made = cls(error.reason, place=error.place, value=error.value, advice=error.advice)
        return made.replaced(outer=error.outer, key=error.key)


def scene(text: str, column: int) -> str:
    """Return a line of a text with a mark below a column, cut around it to fit a screen.

    >>> print(scene("z > u", 5))
        z > u
            ^
    """
    start = max(0, column - 1 - SCENE // 2)
    shown = text[start : start + SCENE].replace("\n", " ").replace("\t", " ").rstrip()
    return f"    {shown}\n    {' ' * (column - 1 - start)}^"


@contextlib.contextmanager
def keyed(*key: str | int) -> Iterator[None]:
    """Errors within are of a part of something larger, or of an argument of a call.

    >>> with keyed("initial"), keyed("z"):
    ...     raise GMSError("it must be > 0", place="z", value=0)
    Traceback (most recent call last):
    gms_fsm.errors.GMSError: z is 0; it must be > 0
    """
    try:
        yield
    except GMSError as error:
        raise error.replaced(key=(*key, *error.key)) from None


class Part(NamedTuple):
    """A part of a chart or of a system, to be named in errors.

    Parameters
    ----------
    words : str
        For messages: ``"chart 'a', edge 'slips', guard"``.
    key : tuple of str or int
        As in `GMSError`.

    Examples
    --------
    >>> Part("chart 'a'").of("edge 'slips'", "transitions", 2)
    Part(words="chart 'a', edge 'slips'", key=('transitions', 2))
    """

    words: str
    key: tuple[str | int, ...] = ()

    def of(self, words: str, *key: str | int) -> Part:
        """Return a part of this part."""
        return Part(f"{self.words}, {words}", (*self.key, *key))


class ExpressionError(GMSError, ValueError):
    """A text in the expression language cannot be parsed.

    Parameters
    ----------
    reason : str
        What is wrong.
    text : str
        The whole text.
    column : int
        Column of the error, counted from 1.
    allowed : str
        What would be allowed there.
    where : str, optional
        The owner of the text, for example ``guard of 'arrest'``.

    Examples
    --------
    >>> print(ExpressionError("unknown name 'u'", "z > u", 5, "names: v, z"))
    column 5: unknown name 'u'; allowed: names: v, z
        z > u
            ^
    """

    def __init__(self, reason: str, text: str, column: int, allowed: str, where: str = "") -> None:
        super().__init__(
            reason,
            place=f"{where}, column {column}" if where else f"column {column}",
            advice=f"allowed: {allowed}\n{scene(text, column)}",
        )
        self.text, self.column, self.allowed, self.where = text, column, allowed, where

    def at(self, where: str | Part) -> ExpressionError:
        """Return the same error with its owner named."""
        part = Part(where) if isinstance(where, str) else where
        made = ExpressionError(self.reason, self.text, self.column, self.allowed, part.words)
        return made.replaced(key=part.key)


class ChartError(GMSError, ValueError):
    """A chart is inconsistent: an unknown state, a missing flow, a name used twice."""


class ParameterError(GMSError, ValueError):
    """A parameter violates its rule; the text names the parameter, the value and the rule."""


class SignalError(GMSError, ValueError):
    """An input signal cannot be used: not finite, not in order of time, too short."""


class TraceFileError(GMSError, ValueError):
    """A trace file is damaged, incomplete or not a trace."""


class CheckpointError(GMSError, ValueError):
    """A checkpoint is damaged, or belongs to another run."""


class OutputError(GMSError, OSError):
    """An output folder or file cannot be written."""


class MissingExtraError(GMSError, ImportError):
    """An optional dependency is not installed; the text names the extra that provides it."""


class UnitError(GMSError, ValueError):
    """A unit is unknown, or measures a different quantity."""


class RecordError(GMSError, ValueError):
    """A measured record cannot be used; the text names the file, row and column."""


class ScenarioError(GMSError, ValueError):
    """A scenario file is invalid; the text names the file, key, value and rule."""


class SessionError(GMSError, ValueError):
    """A step-by-step session was asked for something that does not exist."""
