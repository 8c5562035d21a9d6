"""The error in a scenario, in one sentence: file, key, value, rule, and the nearest key."""

from __future__ import annotations

import difflib
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from gms_fsm.app._tables import FORMS, Scenario
from gms_fsm.errors import LONGEST_SHOWN, cut, shown

__all__ = ["explained"]


def explained(error: ValidationError, data: dict[str, Any]) -> str:
    """Describe the first validation error in one sentence, and count the others.

    Parameters
    ----------
    error : ValidationError
        The errors found by pydantic.
    data : dict
        Contents of the file.

    Returns
    -------
    str
        Key, value, rule, and the nearest valid key for a mistyped one.
    """
    findings = error.errors(include_url=False)
    # An unknown key is often the cause of a missing one, so report it first.
    first = min(findings, key=lambda f: f["type"] != "extra_forbidden")
    places = _written_key(first["loc"])
    key = cut(".".join(places))
    value = first.get("input")
    rest = len(findings) - 1
    more = f" (and {rest} more)" if rest else ""
    kind = first["type"]
    if kind == "extra_forbidden":
        valid = _valid_keys(places[:-1], data)
        wanted = places[-1][:LONGEST_SHOWN]
        near = difflib.get_close_matches(wanted, valid, n=1) or _elsewhere(wanted, data)
        hint = f"did you mean {near[0]!r}? " if near else ""
        return f"{key} = {shown(value)}: unknown key; {hint}valid here: {', '.join(valid)}{more}"
    if kind == "missing":
        return f"{key} is missing{more}"
    if kind == "union_tag_not_found":
        return f"{key}.kind is missing{more}"
    if kind == "union_tag_invalid":
        tag, allowed = first["ctx"]["discriminator"].strip("'"), first["ctx"]["expected_tags"]
        return f"{key}.{tag} = {shown(first['ctx']['tag'])}: it must be one of {allowed}{more}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{key} = {shown(value)}: it must be a table, [{key}]{more}"
    text = first["msg"].removeprefix("Value error, ")
    text = text.replace("Input should be", "it must be")
    if isinstance(value, dict):
        return f"[{key}] {text}{more}" if key else f"{text}{more}"
    return f"{key} = {shown(value)}: {text}{more}"


def _elsewhere(key: str, data: dict[str, Any]) -> list[str]:
    """Return the most similar key of another table, with its table."""
    everywhere = ("run", "initial", "output")
    tables = [name for name in Scenario.model_fields if name in data or name in everywhere]
    places = {name: f"{table}.{name}" for table in tables for name in _valid_keys([table], data)}
    return [places[name] for name in difflib.get_close_matches(key, places, n=1)]


def _written_key(loc: tuple[int | str, ...]) -> list[str]:
    """Return the location of an error as the user wrote it, without the tags of union members."""
    places = [str(part) for part in loc if part not in FORMS]
    if loc and loc[0] in ("model", "rig"):
        del places[1:2]  # the tag of the model or rig
    return places


def _valid_keys(places: list[str], data: dict[str, Any]) -> list[str]:
    """Return the keys that are valid in a table of the file."""
    kind: Any = Scenario
    table: Any = data
    for place in places:
        if place.isdigit():
            return []
        annotation = kind.model_fields[place].annotation
        table = table.get(place, {}) if isinstance(table, dict) else {}
        options = _tables_in(annotation)
        fitting = [each for each in options if isinstance(table, dict) and _fits(each, table)]
        if not (fitting or options):
            return []
        kind = (fitting or options)[0]
    return [field.alias or name for name, field in kind.model_fields.items()]


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
