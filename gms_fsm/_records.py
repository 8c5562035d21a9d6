"""Tables of files as pydantic models, and the error in a table in one sentence.

The sentence gives key, value, rule, and the nearest key; it names no file.
"""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from gms_fsm._toml import Key, line_of
from gms_fsm.errors import LONGEST_SHOWN, GMSError, cut, shown

__all__ = ["Kind", "Table", "checked_table", "explained", "placed"]


class Table(BaseModel):
    """A table of a file, without unknown keys or type conversions."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


Kind = TypeVar("Kind", bound=BaseModel)


def checked_table(
    kind: type[Kind], data: dict[str, Any], text: str, path: Path, error: type[GMSError]
) -> Kind:
    """Return the contents of a file as a table.

    Parameters
    ----------
    kind : type of Table
        What the file must be.
    data, text : dict and str
        Its contents.
    path : Path
        The file.
    error : type of GMSError
        The class of error to raise.

    Returns
    -------
    Table
        Checked.

    Raises
    ------
    GMSError
        Naming file, line, key, value and rule.
    """
    try:
        return kind.model_validate(data)
    except ValidationError as found:
        key, sentence = explained(found, data, kind)
        line = line_of(text, key)
        raise error(f"line {line}: {sentence}" if line else sentence, place=str(path)) from None


def placed(error: GMSError, key: Key, text: str, path: Path) -> GMSError:
    """Return an error with the file, the line and the key it comes from.

    Parameters
    ----------
    error : GMSError
        From the object that a file describes.
    key : tuple of str or int
        The key at fault.
    text : str
        Contents of the file.
    path : Path
        The file.

    Returns
    -------
    GMSError
        An error of the same class.
    """
    line = line_of(text, key)
    place = ".".join(map(str, key))
    both = ", ".join(filter(None, (f"line {line}" if line else "", place)))
    return (error.inside(both) if both else error).inside(path)


def explained(
    error: ValidationError, data: dict[str, Any], root: type[BaseModel]
) -> tuple[Key, str]:
    """Describe the first validation error in one sentence, and count the others.

    Parameters
    ----------
    error : ValidationError
        The errors found by pydantic.
    data : dict
        Contents of the file.
    root : type of Table
        What the file was checked against.

    Returns
    -------
    tuple, str
        The key; and the sentence: key, value, rule, and the nearest valid key for a mistyped one.
    """
    findings = error.errors(include_url=False)
    # An unknown key is often the cause of a missing one, so report it first.
    first = min(findings, key=lambda f: f["type"] != "extra_forbidden")
    places = _written_key(first["loc"], data)
    rest = len(findings) - 1
    return places, _sentence(first, places, data, root) + (f" (and {rest} more)" if rest else "")


def _sentence(first: Any, places: Key, data: dict[str, Any], root: type[BaseModel]) -> str:
    key = cut(".".join(map(str, places)))
    value, kind = first.get("input"), first["type"]
    if kind == "extra_forbidden":
        valid = _valid_keys(places[:-1], data, root)
        wanted = str(places[-1])[:LONGEST_SHOWN]
        near = difflib.get_close_matches(wanted, valid, n=1) or _elsewhere(wanted, data, root)
        hint = f"did you mean {near[0]!r}? " if near else ""
        return f"{key} = {shown(value)}: unknown key; {hint}valid here: {', '.join(valid)}"
    if kind == "missing":
        return f"{key} is missing"
    if kind == "union_tag_not_found":
        return f"{key}.kind is missing"
    if kind == "union_tag_invalid":
        tag, allowed = first["ctx"]["discriminator"].strip("'"), first["ctx"]["expected_tags"]
        return f"{key}.{tag} = {shown(first['ctx']['tag'])}: it must be one of {allowed}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{key} = {shown(value)}: it must be a table, [{key}]"
    text = first["msg"].removeprefix("Value error, ")
    text = text.replace("Input should be", "it must be")
    if isinstance(value, dict):
        return f"[{key}] {text}" if key else text
    return f"{key} = {shown(value)}: {text}"


def _elsewhere(key: str, data: dict[str, Any], root: type[BaseModel]) -> list[str]:
    """Return the most similar key of another table, with its table."""
    tables = [
        name
        for name, field in root.model_fields.items()
        if name in data or isinstance(field.default, BaseModel)
    ]
    places = {
        name: f"{table}.{name}" for table in tables for name in _valid_keys((table,), data, root)
    }
    return [places[name] for name in difflib.get_close_matches(key, places, n=1)]


def _written_key(loc: tuple[int | str, ...], data: Any) -> Key:
    """Return the location of an error as the user wrote it, without the tags of union members."""
    places: list[int | str] = []
    for part in loc:
        chosen = [data.get(key) for key in ("kind", "chart")] if isinstance(data, dict) else []
        # The tags of our unions look like <this>; those of pydantic's are the value of a key.
        if isinstance(part, str) and (part.startswith("<") or part in chosen):
            continue
        places.append(part)
        inside = isinstance(data, dict) or (isinstance(data, list) and isinstance(part, int))
        try:
            data = data[part] if inside else None
        except (LookupError, TypeError):
            data = None
    return tuple(places)


def _valid_keys(places: Key, data: dict[str, Any], root: type[BaseModel]) -> list[str]:
    """Return the keys that are valid in a table of the file."""
    options, table = [root], data
    for place in places:
        if not isinstance(place, int):
            fields = _fitting(options, table).model_fields
            named = {field.alias or name: field for name, field in fields.items()} | fields
            if place not in named:
                return []
            options = _tables_in(named[place].annotation)
            if not options:
                return []
        try:
            table = table[place]
        except (LookupError, TypeError):
            table = {}
    fields = _fitting(options, table).model_fields
    return [field.alias or name for name, field in fields.items()]


def _fitting(options: list[type[BaseModel]], table: Any) -> type[BaseModel]:
    """Return the kind of a table, or the first kind if none fits."""
    if isinstance(table, dict):
        return next((each for each in options if _fits(each, table)), options[0])
    return options[0]


def _tables_in(annotation: Any) -> list[type[BaseModel]]:
    """Return the tables allowed by an annotation, including those in unions."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [table for part in get_args(annotation) for table in _tables_in(part)]


def _fits(option: type[BaseModel], table: dict[str, Any]) -> bool:
    """Return whether a table of the file is of this kind, or for this chart."""
    for key in ("kind", "chart"):
        if key in option.model_fields:
            return table.get(key) in get_args(option.model_fields[key].annotation)
    return True
