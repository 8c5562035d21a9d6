"""How objects show themselves: pictures and tables in notebooks, short text everywhere.

The only module of the core that imports `plots`, and only when a notebook asks for a picture. See
`plots.notebook` for what is shown.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any, TypeAlias, TypeVar

from gms_fsm.errors import cut

__all__ = ["Form", "displayed", "full_text", "register_figures", "short_repr"]

Form: TypeAlias = str  # as in the names of the methods that IPython asks: html, png or svg
Shown = TypeVar("Shown", bound=type)

MOST_NUMBERS = 8  # of an array in a short repr
ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")


def displayed(*forms: Form) -> Callable[[Shown], Shown]:
    """Return a class decorator: notebooks show the objects of the class.

    Parameters
    ----------
    *forms : {"html", "png", "svg"}
        What `plots.notebook` makes of them.

    Returns
    -------
    callable
        It adds a method ``_repr_html_``, ``_repr_png_`` or ``_repr_svg_`` for each form. The
        methods return None where there is nothing to show, for example without Graphviz.

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
        from plots import notebook

        return notebook.shown(self, form)

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
    from plots import notebook

    return notebook.figure_png(figure)


# --------------------------------------------------------------------------- text
def short_repr(kind: Shown) -> Shown:
    """Give a dataclass a repr in which every field is short.

    Long values are cut, arrays are described by their shape, and functions by their name: nothing
    prints a memory address.

    Parameters
    ----------
    kind : type
        A dataclass.

    Returns
    -------
    type
        The same class.

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

    Parameters
    ----------
    value : dataclass
        Its fields must be dataclasses, numbers, texts, tuples or mappings with full reprs.

    Returns
    -------
    str
        The text; an identity, not for display.

    Examples
    --------
    >>> from gms_fsm import State
    >>> full_text(State("stick", flow={"z": "v"}))
    "State('stick', {'z': 'v'}, {}, {}, {}, False)"
    """
    parts = ", ".join(repr(getattr(value, each.name)) for each in fields(value) if each.repr)
    return f"{type(value).__name__}({parts})"
