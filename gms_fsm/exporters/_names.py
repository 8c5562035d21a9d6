"""Names of files, functions and quantities; refused if another language cannot have them."""

from __future__ import annotations

import re
from collections.abc import Iterable

from gms_fsm.errors import ParameterError
from gms_fsm.language import Dialect, Node, spell

LONGEST = 63  # characters that C99 compilers and MATLAB tell apart


def slug(text: str, place: str) -> str:
    """Return a name for files and functions, made from a title.

    Examples
    --------
    >>> slug("Karnopp's model", "chart")
    'karnopps_model'
    """
    made = re.sub(r"[^a-z0-9]+", "_", text.lower().replace("'", "")).strip("_")
    if re.search(r"[/\\\x00-\x1f]|^\.", text) or not made[:1].isalpha():
        raise ParameterError(
            f"files cannot be called after {text!r}",
            place=place,
            advice='give another name, for example name="friction" (--name friction)',
        )
    return made[:LONGEST].rstrip("_")


def identifier(name: str, words: Iterable[str], place: str) -> str:
    """Return a name if another language can have it.

    Examples
    --------
    >>> identifier("double", ["double"], "parameter 'double'")
    Traceback (most recent call last):
    gms_fsm.errors.ParameterError: parameter 'double': it is a word of the format's language...
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or len(name) > LONGEST:
        raise ParameterError(
            "the format has only names of ASCII letters, digits and underscores, at most "
            f"{LONGEST}, that begin with a letter",
            place=place,
            advice="give it another name",
        )
    if name in words:
        raise ParameterError(
            "it is a word of the format's language", place=place, advice="give it another name"
        )
    return name


def check_functions(trees: Iterable[Node], dialect: Dialect, place: str, language: str) -> None:
    """Refuse trees with a function that another language does not have, naming it."""
    try:
        for tree in trees:
            spell(tree, dialect)
    except KeyError as error:
        raise ParameterError(
            f"{language} has no function {error.args[0]!r}",
            place=place,
            advice="write the expression without it, or choose another format",
        ) from None
