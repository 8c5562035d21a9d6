"""Identification of Python functions across processes.

Two functions are the same if their code, constants, default values, closures and the globals they
read are the same. This can be determined for functions written in Python over plain values;
objects from a library are identified by name and the library's version. The behaviour of other
callables cannot be determined.
"""

from __future__ import annotations

import dis
import functools
import hashlib
import os
import site
import sys
import sysconfig
from collections.abc import Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

from gms_fsm.errors import SignalError

_PLAIN = (type(None), bool, int, float, complex, str, bytes, type(...))
_PATHS = [sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")]
_PLACES = tuple(  # where libraries are installed
    f"{path}{os.sep}" for path in (*_PATHS, *site.getsitepackages(), site.getusersitepackages())
)
_CODE = (
    "co_code",
    "co_names",
    "co_varnames",
    "co_freevars",
    "co_cellvars",
    "co_flags",
    "co_argcount",
    "co_posonlyargcount",
    "co_kwonlyargcount",
    "co_exceptiontable",
)


def identity(call: Any) -> str:
    """Return a hash of what a function computes.

    Examples
    --------
    >>> identity(lambda t: 0.1 * t) == identity(lambda t: 0.1 * t)
    True
    >>> identity(lambda t: 0.1 * t) == identity(lambda t: 0.2 * t)
    False
    >>> identity(abs)
    Traceback (most recent call last):
    gms_fsm.errors.SignalError: the behaviour of abs (builtin_function_or_method) is unknown
    """
    inner = call
    while isinstance(inner, functools.partial):
        inner = inner.func
    if not isinstance(getattr(inner, "py_func", inner), FunctionType):
        raise _unknown(inner)
    stamp = hashlib.sha256(repr((sys.version_info[:2], sys.implementation.name)).encode())
    for part in _parts(call, ()):
        stamp.update(b"%d " % len(part))
        stamp.update(part)
    return stamp.hexdigest()


def _unknown(value: Any) -> SignalError:
    name = getattr(value, "__qualname__", None)
    kind = type(value).__qualname__
    what = f"an object of class {kind}" if name is None else f"{name} ({kind})"
    return SignalError(f"the behaviour of {what} is unknown")


def _parts(value: Any, inside: tuple[int, ...]) -> Iterator[bytes]:
    """Yield everything that identifies a value; `inside` are the objects that enclose it."""
    if id(value) in inside:
        yield b"the one %d around it" % inside[::-1].index(id(value))
        return
    inside = (*inside, id(value))
    yield type(value).__name__.encode()
    if type(value) in _PLAIN:
        yield repr(value).encode()
    elif isinstance(value, ModuleType) and _library(value):
        yield _library(value).encode()
    elif _in_library(value):
        yield f"{value.__qualname__} of {_library(sys.modules[value.__module__])}".encode()
    elif isinstance(value, FunctionType):
        yield from _function_parts(value, inside)
    elif isinstance(value, np.ndarray | np.generic) and not value.dtype.hasobject:
        yield repr((value.dtype.descr, value.shape)).encode()
        yield value.tobytes()
    elif type(value) in (tuple, list):
        for part in (len(value), *value):
            yield from _parts(part, inside)
    elif type(value) is dict:
        yield from _parts([*value.items()], inside)
    elif type(value) in (set, frozenset):
        yield from sorted(b" ".join(_parts(part, inside)) for part in value)
    elif isinstance(value, functools.partial):
        yield from _parts([value.func, value.args, value.keywords], inside)
    elif isinstance(value, CodeType):
        yield repr([getattr(value, name) for name in _CODE]).encode()
        yield from _parts(value.co_consts, inside)
    elif isinstance(getattr(value, "py_func", None), FunctionType):  # wrapped by a compiler
        yield from _parts(value.py_func, inside)
    else:
        raise _unknown(value)


def _function_parts(function: FunctionType, inside: tuple[int, ...]) -> Iterator[bytes]:
    yield from _parts(function.__code__, inside)
    yield from _parts([function.__defaults__, function.__kwdefaults__], inside)
    for cell in function.__closure__ or ():
        try:
            enclosed = cell.cell_contents
        except ValueError:
            yield b"empty"  # calling the function would raise
        else:
            yield from _parts(enclosed, inside)
    for path in sorted({*_globals_read(function.__code__)}):
        found: Any = function.__globals__
        name, *attributes = path
        if name in found:  # else a builtin
            found = found[name]
            # The contents of a user's module or class may change while its name stays.
            while attributes and _holds_names(found):
                found = getattr(found, attributes.pop(0), None)
            yield ".".join(path).encode()
            yield from _parts(found, inside)


def _holds_names(value: Any) -> bool:
    if isinstance(value, ModuleType):
        return not _library(value)
    return isinstance(value, type) and not _in_library(value)


def _globals_read(code: CodeType) -> Iterator[tuple[str, ...]]:
    """Yield the globals that some code reads, each with the attributes read from it."""
    path: tuple[str, ...] = ()
    for step in dis.get_instructions(code):
        if step.opname == "EXTENDED_ARG":  # belongs to the next instruction
            continue
        if step.opname in ("LOAD_ATTR", "LOAD_METHOD") and path:
            path = (*path, str(step.argval))
            continue
        if path:
            yield path
        path = (str(step.argval),) if step.opname in ("LOAD_GLOBAL", "LOAD_NAME") else ()
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _globals_read(constant)


def _in_library(value: Any) -> bool:
    """Return whether a value is the object that a library's module has under the value's name."""
    module = sys.modules.get(getattr(value, "__module__", None) or "")
    if module is None or not _library(module):
        return False
    found: Any = module
    for name in str(getattr(value, "__qualname__", "?")).split("."):
        found = getattr(found, name, None)
    return found is value


def _library(module: ModuleType) -> str:
    """Return name and version of an installed module; nothing for a user's module."""
    place = getattr(module, "__file__", None)
    if module.__name__ not in sys.builtin_module_names and not (place or "").startswith(_PLACES):
        return ""
    top = sys.modules.get(module.__name__.partition(".")[0])
    return f"{module.__name__} {getattr(top, '__version__', '')}"
