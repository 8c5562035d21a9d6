"""Shortens JavaScript that the printer has written: no comments, short names, few blanks."""

from __future__ import annotations

import itertools
import re
import string
from collections import Counter
from collections.abc import Collection, Iterator, Mapping

from integrators.machine_code.script.javascript import HELPERS, RESERVED

_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*")
_FUNCTION = re.compile(r"(?m)^function (\w+)")
_PART = re.compile(r"(?<![\w.])0(\.\d)")
_POWER = re.compile(r"(?<=\de)-0(?=\d)")
_WHOLE = re.compile(r"(?<![\w.])(\d+)\.0(?!\w)")


def compact(text: str, kept: Collection[str]) -> str:
    r"""Return printed functions as a shorter text that computes the same, with some names kept.

    Examples
    --------
    >>> compact("function twice(u_0) {\n    return 2.0 * u_0; /* doubled */\n}", ["twice"])
    'function twice(a){return 2*a;}'
    """
    bare = _short(_COMMENT.sub("", text).strip().splitlines())
    fixed = {*RESERVED.split(), *HELPERS, *kept, "Float64Array", "BigInt64Array"}
    own = [each for each in _FUNCTION.findall(bare) if each not in fixed]
    counts = Counter(each for each in _NAME.findall(bare) if each in {*own})
    longer = dict(zip(sorted(own, key=lambda each: -counts[each]), _names(fixed, 2), strict=False))
    renamed = "".join(
        _renamed(each, longer, fixed) for each in re.split(r"(?m)^(?=function )", bare)
    )

    def blank(found: re.Match[str]) -> str:
        before, after = renamed[found.start() - 1], renamed[found.end()]
        words = all(each.isalnum() or each == "_" for each in (before, after))
        return " " * (words or (before == after and before in "+-"))

    packed = re.sub(r"\s+", blank, renamed)
    return _PART.sub(r"\1", _WHOLE.sub(r"\1", _POWER.sub("-", packed)))


def _short(lines: list[str]) -> str:
    """Return lines in which a single statement has no braces, and declarations are joined."""
    made: list[str] = []
    for line in lines:
        space, word, rest = re.match(r"(\s*)(let )?(.*)", line).groups("")  # type: ignore[union-attr]
        if word and made and re.match(f"{space}let ", made[-1]):
            made[-1] = f"{made[-1].removesuffix(';')}, {rest}"
            continue
        inner = made[-1].strip() if made else ""
        if rest.startswith("}") and len(made) > 1 and inner.endswith(";"):
            opening = made[-2].strip()
            alone = not re.match(r"(if|for|while|let|const)\b", inner)
            if alone and re.match(r"(}? ?else|if|for|while)\b.*{$", opening):
                made[-2:] = [f"{made[-2].removesuffix('{')}{inner}"]
                line = f"{space}{rest[1:].lstrip()}"
        if line.strip():
            made.append(line)
    return "\n".join(made)


def _renamed(function: str, known: Mapping[str, str], fixed: Collection[str]) -> str:
    """Give the variables of one function names that only begin there."""
    names = _NAME.findall(function)
    counts = Counter(each for each in names if each not in fixed and each not in known)
    taken = {*fixed, *known.values()}
    short = zip((each for each, _ in counts.most_common()), _names(taken, 1), strict=False)
    every = {**known, **dict(short)}
    return _NAME.sub(lambda found: every.get(found[0], found[0]), function)


def _names(taken: Collection[str], least: int) -> Iterator[str]:
    """Yield names that are free, from a length on."""
    for length in itertools.count(least):
        for each in itertools.product(string.ascii_letters, repeat=length):
            if (name := "".join(each)) not in taken:
                yield name
