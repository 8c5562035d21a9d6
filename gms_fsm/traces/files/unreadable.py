"""What is said of a file that cannot be read: that it is of another kind, or what is damaged."""

from __future__ import annotations

import json
import re
import tomllib
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from gms_fsm.errors import GMSError, TraceFileError, cut, why
from gms_fsm.foundation.toml import LARGEST_FILE

Error = TypeVar("Error", bound=GMSError)
MOST_TOLD = 3  # findings in a message
HEAD = 4096  # characters in which a file says what it is
# Kinds of files, and what reads them.
READERS = {
    "trace": "Trace.load({})",
    "session": "Session.load({})",
    "sweep": "Sweep.load({})",
    "coverage": "Coverage.load({})",
    "checkpoint": "simulate(..., checkpoint={})",
    "chart": "Chart.load({})",
    "system": "System.load({})",
    "scenario": "gms_fsm.app.scenario.load_scenario({})",
    "table": "Record.from_csv({}, time=..., position=...)",
}
SHORT = {"missing": " is missing", "extra_forbidden": " is unknown"}
TABLES = {"chart": ("state", "edge"), "scenario": ("model", "rig", "run"), "system": ("body",)}


def unreadable(
    path: Path,
    wanted: str,
    error: BaseException,
    kind: type[Error] = TraceFileError,  # type: ignore[assignment]
    advice: str = "write it again",
) -> Error:
    """Return the error of a file that should be of a kind, and could not be read."""
    place, found = str(path), kind_of_file(path)
    if path.is_dir():
        return kind(f"it is a folder, not a {wanted} file", place=place, advice="name the file")
    if found and found != wanted:
        reader = READERS[found].format(repr(place))
        reason = f"it is a {found}{' file' * (found != 'table')}, not a {wanted} file"
        return kind(reason, place=place, advice=f"{reader} reads it")
    what = f"damaged {wanted} file" if found else f"not a {wanted} file, or damaged"
    return kind(f"{what} ({damage(error)})", place=place, advice=advice)


def kind_of_file(path: Path) -> str:
    """Return what a file says that it is, a key of `READERS`; empty if it says nothing."""
    try:
        if zipfile.is_zipfile(path):
            return _kind_of_archive(path)
        with path.open(encoding="utf-8") as file:
            text = file.read(HEAD)
        if path.suffix == ".toml":
            tables = tomllib.loads(path.read_text("utf-8")) if _is_small(path) else {}
            return next((kind for kind, keys in TABLES.items() if tables.keys() & {*keys}), "")
    except Exception:  # zipfile alone raises many kinds for a damaged archive
        return ""
    if text.startswith("# {"):
        return "trace"
    named = re.search(r'"format": ?"gms-fsm (\w+)', text)
    if named and named[1] in READERS:
        return named[1]
    return "table" if path.suffix in (".csv", ".tsv") else ""


def _is_small(path: Path) -> bool:
    return path.stat().st_size <= LARGEST_FILE


def _kind_of_archive(path: Path) -> str:
    """Return the kind of an archive of arrays, by their names."""
    with zipfile.ZipFile(path) as archive:
        names = {*archive.namelist()}
    if "format.npy" in names:
        return "checkpoint" if any(name.startswith("loop_") for name in names) else "sweep"
    return "trace" if "header.npy" in names else ""


@contextmanager
def part_of_a_file(name: str) -> Iterator[None]:
    """Errors within are of a part of a file."""
    try:
        yield
    except Exception as error:  # any error is the fault of the damaged file
        raise TraceFileError(f"{name}: {damage(error)}") from None


def damage(error: BaseException) -> str:
    """Say what is damaged in a file, in its own words.

    >>> damage(KeyError("rows_t.npy")), damage(AttributeError("'list' object has no keys"))
    ('rows_t is missing', 'it has another form')
    """
    from pydantic import ValidationError  # runs need no pydantic

    match error:
        case ValidationError():
            return _invalid(error.errors(include_url=False))
        case json.JSONDecodeError():
            return f"line {error.lineno}, column {error.colno} is not JSON: {error.msg}"
        case UnicodeDecodeError():
            return "it is not text"
        case zipfile.BadZipFile() | EOFError() | zlib.error():
            return "the archive is incomplete, or overwritten"
        case KeyError() if error.args and isinstance(error.args[0], str):
            return f"{cut(error.args[0].removesuffix('.npy'))} is missing"
        case GMSError():
            return str(error)
        case OSError() if error.strerror:
            return f"cannot be read: {error.strerror}"
        case RecursionError() | MemoryError():
            return "it is nested too deeply, or too large"
        case OverflowError():
            return "a number in it is too large"
        case ValueError():
            return why(error).partition(": ")[2] or "a value is not as it must be"
    return "it has another form"


def _invalid(findings: Sequence[Any]) -> str:
    """Return what a table of a file lacks, or has wrong."""
    found = list[str]()
    for each in findings:
        place = ".".join(str(part) for part in each["loc"] if not str(part).startswith("<"))
        said = re.sub("^Value error, ", "", each["msg"]).replace("Input should be", "it must be")
        said = SHORT.get(each["type"], f": {said}")
        found.append(f"{place}{said}".removeprefix(": "))
    more = f", and {len(found) - MOST_TOLD} more" if len(found) > MOST_TOLD else ""
    return cut(f"{', '.join(found[:MOST_TOLD])}{more}", 300)
