"""How objects show themselves: pictures and tables in notebooks, short text everywhere.

What draws stands above and is not imported here: it declares itself in the entry point group
``gms_fsm.display``, and is loaded when a notebook asks for a picture, or a fit for its report.
"""

from __future__ import annotations

import functools
import re
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np

from gms_fsm.errors import cut

Form: TypeAlias = str  # as in the names of the methods that IPython asks: html, png or svg
Shown = TypeVar("Shown", bound=type)

GROUP = "gms_fsm.display"  # of entry points
ALWAYS = {"trust": "gms_fsm.session.trust:trust_of"}  # this package's, installed or not
PROJECT = Path(__file__).parents[2] / "pyproject.toml"  # in a checkout
MOST_NUMBERS = 8  # of an array in a short repr
ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")


def displayed(*forms: Form) -> Callable[[Shown], Shown]:
    """Return a class decorator: notebooks show the objects of the class.

    Examples
    --------
    >>> @displayed("html")
    ... class Unknown:
    ...     pass
    >>> Unknown()._repr_html_() is None
    True
    """

    def add(kind: Shown) -> Shown:
        for form in forms:
            setattr(kind, f"_repr_{form}_", _method(form))
        return kind

    return add


def _method(form: Form) -> Callable[[object], Any]:
    def method(self: object) -> Any:
        return _shown("notebook", self, form)

    return method


def register_figures() -> None:
    """Make IPython show a matplotlib figure that is the last line of a cell.

    Without this, only figures made by pyplot are shown, or all after ``%matplotlib inline``. Does
    nothing outside IPython. matplotlib is not imported.
    """
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    if shell is not None:
        formatter = shell.display_formatter.formatters["image/png"]
        formatter.for_type_by_name("matplotlib.figure", "Figure", _figure)


def _figure(figure: object) -> Any:
    return _shown("figure", figure)


def _shown(name: str, *given: object) -> Any:
    show = asked(name)
    return None if show is None else show(*given)  # a notebook then shows the text


# --------------------------------------------------------------------------- what draws
@functools.cache
def asked(name: str) -> Callable[..., Any] | None:
    """Return what is declared in the entry point group under a name.

    Examples
    --------
    >>> show = asked("notebook")
    >>> show is None or show.__module__ == "plots.output.notebook"
    True
    """
    for each in _declared():
        if each.name == name:
            found: Callable[..., Any] = each.load()
            return found
    return None


def _declared() -> Iterator[EntryPoint]:
    """Yield what is always there, the entry points of the checkout, and those installed."""
    yield from (EntryPoint(name, value, GROUP) for name, value in ALWAYS.items())
    if PROJECT.is_file():
        project = tomllib.loads(PROJECT.read_text(encoding="utf-8")).get("project", {})
        for name, value in project.get("entry-points", {}).get(GROUP, {}).items():
            yield EntryPoint(name, value, GROUP)
    yield from entry_points(group=GROUP)


# --------------------------------------------------------------------------- text
def short_repr(kind: Shown) -> Shown:
    """Give a dataclass a repr in which every field is short.

    Long values are cut, arrays are described by their shape, and functions by their name: nothing
    prints a memory address.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @short_repr
    ... @dataclass
    ... class Motion:
    ...     v: object
    >>> Motion(short_repr)
    Motion(v=<function short_repr>)
    """
    kind.__repr__ = _short  # type: ignore[method-assign,assignment]
    return kind


def _short(self: Any) -> str:
    values = (
        f"{each.name}={_value(getattr(self, each.name))}" for each in fields(self) if each.repr
    )
    return f"{type(self).__name__}({', '.join(values)})"


def _value(value: object) -> str:
    size = getattr(value, "size", 0)
    if isinstance(size, int) and size > MOST_NUMBERS:
        shape = " x ".join(map(str, value.shape))  # type: ignore[attr-defined]
        return f"<array of {shape}>"
    text = ADDRESS.sub("", repr(value))
    return text if is_dataclass(value) else cut(text)


def full_text(value: Any) -> str:
    """Return all fields of a dataclass as one text, in order and uncut.

    Values with equal texts are the same, also in the order of their mappings.

    Examples
    --------
    >>> from gms_fsm import State
    >>> full_text(State("stick", flow={"z": "v"}))
    "State('stick', {'z': 'v'}, {}, {}, {}, False, (), '', False)"
    """
    parts = ", ".join(repr(getattr(value, each.name)) for each in fields(value) if each.repr)
    return f"{type(value).__name__}({parts})"


# --------------------------------------------------------------------------- tables
@displayed("html")
class Log(np.recarray[Any, Any]):
    """A record array that notebooks show as a table of its first rows.

    In every other respect it is a `numpy.recarray`.

    Examples
    --------
    >>> records = np.array([(0.5, "slip"), (0.7, "stick")], dtype=[("t", "f8"), ("to", "U5")])
    >>> log = records.view(Log)
    >>> log
    <2 records of t, to>
    >>> log.to.tolist(), log[log.t > 0.6]
    (['slip', 'stick'], <1 record of t, to>)
    """

    def __repr__(self) -> str:
        names = self.dtype.names
        if names is None or self.ndim != 1:
            return repr(self.view(np.ndarray))
        return f"<{len(self)} record{'s' * (len(self) != 1)} of {', '.join(names)}>"
