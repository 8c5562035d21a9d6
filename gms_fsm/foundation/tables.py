"""Tables of files as pydantic models, and the error in a table in one sentence.

The sentence gives key, value, rule, and the nearest key; it names no file.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Discriminator, Tag, ValidationError
from pydantic.fields import FieldInfo

from gms_fsm.errors import LONGEST_SHOWN, GMSError, OutputError, cut, keyed, shown
from gms_fsm.foundation.arguments import either, meant, nearest, some_of
from gms_fsm.foundation.files import output_folder, write_whole
from gms_fsm.foundation.quantities import in_si
from gms_fsm.foundation.text import encoded
from gms_fsm.foundation.toml import LARGEST_FILE, Key, TomlFile, written

# Tags of union members in pydantic's errors; no key of a file looks like these.
ONE, LIST, TEXT, TABLE = "<one>", "<list>", "<text>", "<table>"


class Table(BaseModel):
    """A table of a file, without unknown keys or type conversions."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def _form(given: Any) -> str:
    return LIST if isinstance(given, list) else ONE


def _kind(given: Any) -> str:
    return TEXT if isinstance(given, str) else ONE


# A number, or one per element; one text or several; an expression or a number.
Numbers = Annotated[
    Annotated[float, Tag(ONE)] | Annotated[list[float], Tag(LIST)], Discriminator(_form)
]
Texts = Annotated[Annotated[str, Tag(ONE)] | Annotated[list[str], Tag(LIST)], Discriminator(_form)]
Value = Annotated[Annotated[str, Tag(TEXT)] | Annotated[float, Tag(ONE)], Discriminator(_kind)]

NUMBER = r"(?:(?<![\d.])[+-])?(?:\d+(?:\.(?!\.)\d*)?|(?<!\.)\.\d+)(?:[eE][+-]?\d+)?"

ALSO = {"transition": "edge", "transitions": "edge"}  # what other programs call a key

Kind = TypeVar("Kind", bound=BaseModel)
Made = TypeVar("Made")


# --------------------------------------------------------------------------- files
def read_file(
    path: Path,
    kind: type[Kind],
    error: type[GMSError],
    build: Callable[[Kind], Made],
    overrides: Sequence[str] = (),
) -> Made:
    """Read what a TOML file describes."""
    return read(TomlFile.of(path, error, overrides), kind, error, build)


def read(
    file: TomlFile, kind: type[Kind], error: type[GMSError], build: Callable[[Kind], Made]
) -> Made:
    """Read what the tables of a TOML file describe."""
    try:
        table = kind.model_validate(file.data)
    except ValidationError as found:
        key, sentence = explained(found, file.data, kind)
        place = file.place_of(key)
        raise error(": ".join([*place, sentence]), place=str(file.path)) from None
    try:
        return build(table)
    except GMSError as found:
        raise file.blamed(found, _key_in_file(found.key, file.data, kind)) from None


def write_file(path: Path, table: Table) -> Path:
    """Write a table to a TOML file, whole."""
    if path.suffix != ".toml":
        raise OutputError(f"its name must end in .toml, not {path.suffix!r}", place=str(path))
    text = written(table.model_dump(by_alias=True, exclude_defaults=True))
    try:
        raw = encoded(text)
    except UnicodeEncodeError as error:
        found = shown(error.object[error.start : error.end])
        raise OutputError(
            f"a text has the character {found}, which no file can store", place=str(path)
        ) from None
    if len(raw) > LARGEST_FILE:
        raise OutputError(
            f"it would have {len(raw)} bytes, and at most {LARGEST_FILE} can be read",
            place=str(path),
            advice="give long signals as expressions",
        )
    output_folder(path.parent, [path.name])
    return write_whole(path, lambda file: file.write(raw))


def built(make: Callable[..., Made], *key: str | int, **given: Any) -> Made:
    """Return what a function makes; its errors name a part of something larger."""
    with keyed(*key):
        return make(**given)


def _key_in_file(key: Key, given: Any, root: type[BaseModel]) -> Key:
    """Return the key of a part as the file has it: with aliases, and no deeper than its tables."""
    options, found, data = [root], list[str | int](), given
    for part in key:
        if not isinstance(data, dict | list):
            break
        name = part
        if isinstance(part, str) and options:
            field = _fitting(options, data).model_fields.get(part)
            options = [] if field is None else _tables_in(field.annotation)
            if field is not None and field.alias in data:
                name = field.alias or part
        found.append(name)
        try:
            data = _inside(data, name)
        except (LookupError, TypeError):
            break
    return tuple(found)


# --------------------------------------------------------------------------- errors
def explained(
    error: ValidationError, data: dict[str, Any], root: type[BaseModel]
) -> tuple[Key, str]:
    """Describe the first validation error in one sentence, and count the others."""
    findings = error.errors(include_url=False)
    # An unknown key is often the cause of a missing one, so report it first.
    first = min(findings, key=lambda f: f["type"] != "extra_forbidden")
    places = _written_key(first["loc"], data)
    unknown = [each["loc"] for each in findings if each["type"] == "extra_forbidden"]
    if unknown and (head := _head_missing([_written_key(u, data) for u in unknown], data, root)):
        where = f"no key of [{places[0]}]" if len(places) > 1 else "in no table"
        return places, f"{places[-1]} is {where}; write the head of its table, {head}, above it"
    rest = len(findings) - 1
    sentence = _sentence(first, places, data, root) + (f" (and {rest} more)" if rest else "")
    cause = first.get("ctx", {}).get("error")
    if inner := getattr(cause, "key", ()):
        return (*places, *inner), sentence
    tag = first.get("ctx", {}).get("discriminator", "").strip("'")
    part = tag or getattr(cause, "place", "").partition("[")[0]
    value = first.get("input")
    return (*places, part) if isinstance(value, dict) and part in value else places, sentence


def _head_missing(unknown: list[Key], data: dict[str, Any], root: type[BaseModel]) -> str:
    """Return the head of the table to which unknown keys belong, if it is not there.

    Without its head, a table gives its keys to the table before it, or to none. One key alone tells
    that only of a table that must be there.
    """
    table = unknown[0][:-1]
    keys = [each[-1] for each in unknown if each[:-1] == table]
    for name, field in root.model_fields.items():
        shown = field.alias or name
        there = {} if shown in data else _fields_at((shown,), {shown: {}}, root)
        least = 1 if field.is_required() else 2
        if len(table) < 2 and keys[0] in there and sum(key in there for key in keys) >= least:
            return f"[[{shown}]]" if get_origin(field.annotation) is list else f"[{shown}]"
    return ""


def _sentence(first: Any, places: Key, data: dict[str, Any], root: type[BaseModel]) -> str:
    key = cut(".".join(map(str, places)))
    value, kind = first.get("input"), first["type"]
    if kind == "extra_forbidden":
        valid = _fields_at(places[:-1], data, root)
        near = _instead(str(places[-1])[:LONGEST_SHOWN], places[:-1], valid, data, root)
        hint = f"did you mean {near!r}? " if near else ""
        if kinds := _kinds_with(str(places[-1]), places[:-1], data, root):
            hint = f"it is a key of kind = {either(kinds)}; "
        return f"{key} = {cut(shown(value), 40)}: unknown key; {hint}valid here: {some_of(valid)}"
    if kind == "missing":
        field = _fields_at(places[:-1], data, root).get(str(places[-1]))
        told = "" if field is None else _what(field)
        if not told and field is not None and _tables_in(field.annotation):
            told = f"; add a table [{key}]"
        return f"{key} is missing{told}"
    if kind == "union_tag_not_found":
        field = _fields_at(places[:-1], data, root).get(str(places[-1]))
        return f"{key}.kind is missing{'' if field is None else _what_kind(field)}"
    if kind == "union_tag_invalid":
        tag, allowed = first["ctx"]["discriminator"].strip("'"), first["ctx"]["expected_tags"]
        given = first["ctx"]["tag"]
        tags = re.findall("'([^']+)'", allowed)
        begun = [tag for tag in tags if str(given).casefold().startswith(tag.casefold())]
        hint = meant(begun[0] if begun else given, tags)
        return f"{key}.{tag} = {shown(given)}: {hint}it must be one of {allowed}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        inner = _fields_at(places, data, root) if len(places) > 1 else {}
        form = _as_table(value, inner) or f"[{key}]"
        return f"{key} = {shown(value)}: it must be a table, {form}"
    text = first["msg"].removeprefix("Value error, ")
    text = text.replace("Input should be", "it must be")
    if isinstance(value, dict):
        if kind == "list_type":
            return f"[{key}]: there may be several of it; write [[{key}]]"
        if kind != "value_error":
            return f"[{key}] is a table; {_other_form(kind, None, 0) or text}"
        return f"[{key}] {text}" if key else text
    field = _fields_at(places[:-1], data, root).get(str(places[-1]))
    outer = _fields_at(places[:-2], data, root).get(str(places[-2])) if len(places) > 1 else None
    pair = isinstance(places[-1], str) and (_pair_in(field) or _pair_in(outer))
    if pair and kind in ("list_type", "too_short", "too_long"):
        return f"{key} = {shown(value)}: {_as_pair(value, field)}"
    if kind == "too_short" and not value and field is not None:
        return f"{key} = {shown(value)}: it must not be empty{_what(field)}"
    per_element = field is not None and "element" in (field.description or "")
    elements = _beside(places, data) if per_element else 0
    return f"{key} = {shown(value)}: {_other_form(kind, value, elements) or text}"


def _other_form(kind: str, value: object, elements: int) -> str:
    """Return how a value of another type is written; empty if the rule says it."""
    text = value.strip() if isinstance(value, str) else ""
    if kind in ("int_type", "int_parsing", "int_from_float"):
        return f"it must be a whole number{', without quotes' * bool(text)}"
    if kind == "float_type" and not text:
        return "it must be a number"
    if kind == "float_type":
        number = in_si(text)
        form = "it must be a number in SI units, without quotes, unit or formula"
        return f"{form}: {number}" if number else form
    if kind in ("bool_type", "bool_parsing"):
        known = {"yes": "true", "on": "true", "no": "false", "off": "false"}
        form = known.get(text.casefold(), text.casefold())
        alone = f": {form}" if form in ("true", "false") else ""
        return f"it must be true or false{', without quotes' * bool(text)}{alone}"
    if kind == "string_type" and isinstance(value, int | float):
        return f'it must be a text, in quotes: "{str(value).lower()}"'
    if kind == "string_type":
        return "it must be a text, in quotes"
    if kind == "list_type" and 0 < len(text) <= LONGEST_SHOWN:
        return f"it must be a list: {_as_list(text)}"
    if kind == "list_type" and isinstance(value, int | float) and not isinstance(value, bool):
        every = ", ".join([repr(value)] * max(1, elements))
        return f"it must be a list{', one number for each element' * bool(elements)}: [{every}]"
    return "it must be a list, in brackets" if kind == "list_type" else ""


def _as_pair(value: object, field: FieldInfo | None) -> str:
    """Return how two numbers are written: with those that are given, if there are one or two."""
    numbers = re.findall(NUMBER, value if isinstance(value, str) else repr(value))
    span = field is not None and "from and to" in (field.description or "")
    form = "from and to" if span else "lowest and highest"
    if span and len(numbers) == 1:
        numbers = ["0", *numbers]
    return f"it must be a list of two numbers, {form}" + (
        f": [{', '.join(numbers)}]" if len(numbers) == 2 else ""
    )


def _pair_in(field: Any) -> bool:
    """Return whether a key, or a part of its annotation, takes a list of two."""
    annotation = field.annotation if isinstance(field, FieldInfo) else field
    limits = [getattr(each, "metadata", ()) for each in getattr(annotation, "__metadata__", ())]
    if any(getattr(each, "max_length", 0) == 2 for several in limits for each in several):
        return True
    return any(map(_pair_in, get_args(annotation)))


def _as_list(text: str) -> str:
    """Return a text as the list that it stands for.

    >>> _as_list("4-16"), _as_list("100, 50"), _as_list("k, weights"), _as_list("coverage")
    ('[4, 16]', '[100, 50]', '["k", "weights"]', '["coverage"]')
    """
    if re.fullmatch(rf"\W*{NUMBER}(?:(?:[\s,;:\-]|\.\.|to)+{NUMBER})*\W*s?", text):
        return f"[{', '.join(re.findall(NUMBER, text))}]"
    words = filter(None, (each.strip() for each in re.split(r"[,;]", text.strip("[]"))))
    return f"[{', '.join(f'{chr(34)}{cut(each, 40)}{chr(34)}' for each in words)}]"


def _as_table(value: object, fields: Mapping[str, FieldInfo]) -> str:
    """Return a value as the table in one line that it stands for; empty for a large table."""
    needed = [name for name, field in fields.items() if field.is_required()]
    if not 1 < len(needed) < 4:
        return ""
    given = value if isinstance(value, list) else [value] if isinstance(value, str) else []
    plain = all(isinstance(each, str | int | float) for each in given)
    parts = [shown(each).replace("'", '"') for each in given[: len(needed) * plain]]
    parts += ["..."] * (len(needed) - len(parts))
    return f"{{ {', '.join(map(' = '.join, zip(needed, parts, strict=True)))} }}"


def _beside(places: Key, data: Any) -> int:
    """Return the number of entries of the longest list of numbers beside a key."""
    for part in places[:-1]:
        data = data[part]
    values = data.values() if isinstance(data, dict) else []
    lists = [each for each in values if isinstance(each, list)]
    numbers = [each for each in lists if all(isinstance(part, int | float) for part in each)]
    return max(map(len, numbers), default=0)


def _what(field: FieldInfo) -> str:
    """Return what a missing key is: its choices, its description."""
    choices, known = _choices(field.annotation), field.description or ""
    if not all(repr(each) in known for each in choices):
        known = "; ".join(filter(None, (f"give {either(choices)}", known)))
    return known and f"; {known}"


def _what_kind(field: FieldInfo) -> str:
    """Return the kinds of a table."""
    kinds = [table.model_fields.get("kind") for table in _tables_in(field.annotation)]
    choices = [each for kind in kinds if kind for each in _choices(kind.annotation)]
    return f"; give {either(choices)}" if choices else ""


def _choices(annotation: Any) -> list[str]:
    """Return the texts that an annotation allows, if it allows only some."""
    return [each for each in get_args(annotation) if isinstance(each, str)]


def _instead(
    key: str,
    table: Key,
    valid: Mapping[str, FieldInfo],
    data: dict[str, Any],
    root: type[BaseModel],
) -> str:
    """Return the key that is meant by an unknown one.

    That is the key of this name in a table within or elsewhere, the one that is described by this
    name, or the most similar one: here, in a table within, elsewhere.
    """
    inner = {
        name: f"{each}.{name}" for each in valid for name in _fields_at((*table, each), data, root)
    }
    described = [
        each
        for each, field in valid.items()
        if re.search(rf"\b{re.escape(key)}\b", field.description or "")
    ]
    tables = [
        name
        for name, field in root.model_fields.items()
        if name in data or isinstance(field.default, BaseModel)
    ]
    places = {name: f"{each}.{name}" for each in tables for name in _fields_at((each,), data, root)}
    found = (
        ALSO.get(key) if ALSO.get(key) in valid else "",
        f"outputs.{key}" if "outputs" in valid and re.fullmatch("F(_.+)?", key) else "",
        inner.get(key),
        places.get(key),
        described[0] if len(described) == 1 else "",
        nearest(key, valid),
        inner.get(nearest(key, inner, 0.75)),
        places.get(nearest(key, places, 0.75)),
    )
    return next(filter(None, found), "")


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


def _inside(data: Any, part: str | int) -> Any:
    return data[part]


def _kinds_with(key: str, places: Key, data: dict[str, Any], root: type[BaseModel]) -> list[str]:
    """Return the other kinds of a table that have a key."""
    options, _ = _options_at(places, data, root)
    known = [each.model_fields for each in options]
    kinds = (_choices(each["kind"].annotation) for each in known if key in each and "kind" in each)
    return [kind for several in kinds for kind in several]


def _fields_at(places: Key, data: dict[str, Any], root: type[BaseModel]) -> dict[str, FieldInfo]:
    """Return the keys that are valid in a table of the file."""
    options, table = _options_at(places, data, root)
    fields = _fitting(options, table).model_fields if options else {}
    return {field.alias or name: field for name, field in fields.items()}


def _options_at(
    places: Key, data: dict[str, Any], root: type[BaseModel]
) -> tuple[list[type[BaseModel]], Any]:
    """Return the kinds that a table of the file may have, and the table."""
    options, table = [root], data
    for place in places:
        if not isinstance(place, int):
            fields = _fitting(options, table).model_fields
            named = {field.alias or name: field for name, field in fields.items()} | fields
            if place not in named:
                return [], {}
            options = _tables_in(named[place].annotation)
            if not options:
                return [], {}
        try:
            table = _inside(table, place)
        except (LookupError, TypeError):
            table = {}
    return options, table


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
