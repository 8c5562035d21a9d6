"""Loads generated code so that debuggers and tracebacks find its lines.

The only place where text becomes code, and it is always our own text, printed from a checked tree.
"""

from __future__ import annotations

import functools
import hashlib
import linecache
from collections.abc import Mapping
from types import CodeType
from typing import Any

from gms_fsm.expression import NAMESPACE

__all__ = ["load"]


def load(title: str, source: str, names: Mapping[str, Any] | None = None) -> dict[str, Any]:
    r"""Run generated text and return what it defines.

    Parameters
    ----------
    title : str
        Shown in place of a file name.
    source : str
        Python text.
    names : mapping, optional
        Objects it may use besides the functions of the expression language.

    Returns
    -------
    dict
        Its namespace.

    Examples
    --------
    >>> load("example", "def twice(v):\n    return 2.0 * v\n")["twice"](3.0)
    6.0
    """
    namespace: dict[str, Any] = {**NAMESPACE, **(names or {})}
    exec(_compiled(title, source), namespace)
    return namespace


@functools.lru_cache(maxsize=256)
def _compiled(title: str, source: str) -> CodeType:
    digest = hashlib.sha256(source.encode()).hexdigest()[:8]
    filename = f"<{title} {digest}>"
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    return compile(source, filename, "exec")
