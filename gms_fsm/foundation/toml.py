"""Defensive reading of TOML with the lines of its keys, changes to single keys, and writing."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from gms_fsm.errors import GMSError, ScenarioError, cut, scene, shown
from gms_fsm.foundation.arguments import no_file, unknown
from gms_fsm.foundation.quantities import in_si

Key = tuple[str | int, ...]  # names of keys, and places in arrays from 0
Error = TypeVar("Error", bound=GMSError)

LARGEST_FILE = 1_000_000  # bytes
LONGEST_LINE = 2000  # characters that are searched for what is usual, in quadratic time
MOST_PREFIXES = 60  # that are read to find a line
DEEPEST_KEY = 6  # parts
REPEATED = ("state", "edge", "parameter", "body", "spring", "contact", "supervisor", "sampled")
# tomllib takes quadratic time in the number of parts of a key, which can be hours.
_ENDLESS_KEY = re.compile(
    r"""(?<![\w"'-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){20}"""
)
_TEXT_OR_COMMENT = re.compile(r""""[^"]*"?|'[^']*'?|#.*""")
_HALF_A_NUMBER = re.compile(  # a digit on only one side of the point
    r"(?<![\w.+-])([+-]?)(?:(\d+)\.|\.(\d+))((?:[eE][+-]?\d+)?)(?![\w.])"
)
_AT = re.compile(r" \(at line (\d+), column (\d+)\)| \(at end of document\)")
# What is usual in a line that is not TOML, without its comment, and the cure.
_NUMBER = r"[+-]?\d[\d_]*(?:\.\d+)?(?:[eE][+-]?\d+)?"
_VALUE = rf"\"[^\"]*\"|'[^']*'|\[[^\]]*\]|\{{[^}}]*\}}|{_NUMBER}|true|false"


def _number_alone(found: re.Match[str]) -> str:
    """Return the advice on a number that is written with a unit, or as a power."""
    number = in_si(found[2])
    return f"write the number alone, in SI units: {found[1]} = {number}" if number else ""


def _with_commas(found: re.Match[str]) -> str:
    """Return the advice on numbers of a list that have no commas between them."""
    numbers = ", ".join(re.split(r"\s*[,;]\s*|\s+", found[1].strip()))
    return f"write commas between the numbers of a list: [{numbers}]"


_USUAL: Sequence[tuple[str, str | Callable[[re.Match[str]], str]]] = (
    (r"[“”„«»‘’]", "write straight quotes, \" or '"),
    (
        r"^([\w.]+)\s*=\s*([1-9]\d*),(\d{3})$",
        "a number has no comma: write {1} = {2}{3} or {1} = {2}.{3}",
    ),
    (r"=\s*\[[^\]]*\b\d+,0\d", "a number has a decimal point: 0.05, not 0,05"),
    (r"^([\w.]+)\s*=\s*(\d+),(\d+)$", "a number has a decimal point: write {1} = {2}.{3}"),
    (rf"^([\w.]+)\s*=\s*({_NUMBER}(?:\s*[,;\s]\s*{_NUMBER})+)$", "write a list in brackets: [{2}]"),
    (rf"^([\w.]+)\s*=\s*({_NUMBER})\s*;$", "a line ends without ';': write {1} = {2}"),
    (
        rf"^([\w.]+)\s*=\s*({_VALUE})\s*(?://|%)\s*(\S.*)$",
        "a comment begins with #: write {1} = {2}  # {3}",
    ),
    (r"^([\w.]+)\s*=\s*([^\"'\[{]+)$", _number_alone),
    (
        rf"^([\w.]+)\s*=\s*({_NUMBER})\s*([a-zA-Zµμ°%][\w/^²*·µ]*)$",
        "write the number alone, in SI units; {3} can stand behind a #",
    ),
    (rf"=\s*\[\s*({_NUMBER}(?:\s*[,;]\s*{_NUMBER}|\s+{_NUMBER})+)\s*\]", _with_commas),
    (
        r"\"[A-Za-z]:\\",
        "in double quotes a \\ has a meaning: write the path with / or in single quotes",
    ),
    (r"^([\w.]+)\s*=\s*True\b", "write {1} = true"),
    (r"^([\w.]+)\s*=\s*False\b", "write {1} = false"),
    (
        r"^([\w.]+)\s*=\s*(?:None|null|nan|NaN)?$",
        "a key needs a value: leave the line out, or give one",
    ),
    (r"^([\w.]+)\s*:\s*(.*)$", "write {1} = {2}"),
    (r"^([\w.]+)\s*=\s*([^\W\d]\w*)$", 'a text has quotes: write {1} = "{2}"'),
    (
        rf"^([\w.]+)\s*=\s*((?:{_NUMBER}|[^\W\d]\w*|[-(])[^\"']*)$",
        'a formula has quotes: write {1} = "{2}" where one is allowed, else its value',
    ),
    (r"^[\w.]+\s*=\s*(?:\"[^\"]*|'[^']*)$", "the closing quote is missing"),
    (r"^[\w.]+\s*=\s*(?:\"[^\"]*\"|'[^']*')\s*\S", "the line ends after the closing quote"),
    (r"\{[^}]*$", "a table in braces stands on one line"),
    (
        rf"\{{[^}}]*?=\s*({_VALUE})\s+([\w.]+)\s*=",
        "write a comma between the keys of a table in braces: {1}, {2} = ...",
    ),
    (
        r"^\[[^\]]*$|^\[\[[^\]]*\]$",
        "write the head of a table as [run], or [[body]] where there may be several",
    ),
)


_NOT_TOML = (  # how other files begin
    (b"PK", "an archive", "Trace.load reads a run, Sweep.load a sweep, gms-fsm replay shows a run"),
    (b"{", "JSON", "Session.load reads a session, Coverage.load a coverage; else write it as TOML"),
    (b"<", "XML", "Chart.from_scxml reads SCXML; else write it as TOML"),
)


def parsed(path: Path) -> dict[str, Any]:
    """Return the contents of a scenario file."""
    return data_of(text_of(path), path)


def text_of(path: Path, kind: type[GMSError] = ScenarioError) -> str:
    """Return the text of a file."""
    try:
        with path.open("rb") as file:
            raw = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise no_file(path, kind) from None
    except (OSError, ValueError) as error:  # a ValueError if the name contains a null byte
        reason = getattr(error, "strerror", None) or str(error)
        raise kind(
            f"cannot be read ({reason})", place=str(path), advice="give a readable file"
        ) from None
    if len(raw) > LARGEST_FILE:
        raise kind(
            f"larger than {LARGEST_FILE} bytes",
            place=str(path),
            advice="keep records in separate files",
        )
    for begin, what, advice in _NOT_TOML:
        if raw.lstrip().startswith(begin):
            raise kind(f"it is {what}, not TOML", place=str(path), advice=advice)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise kind(
            f"line {line} is not UTF-8 text",
            place=str(path),
            advice="give a TOML file, saved as UTF-8",
        ) from None


def data_of(text: str, path: Path, kind: type[GMSError] = ScenarioError) -> dict[str, Any]:
    """Return the contents of a TOML text."""
    if endless := _ENDLESS_KEY.search(text):
        line = text.count("\n", 0, endless.start()) + 1
        raise kind(
            f"line {line}: a key of more than 20 parts",
            place=str(path),
            advice="no key is nested this deeply",
        )
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # a number with 5,000 digits raises ValueError
        reason, advice = _refused(str(error), text)
        raise kind(reason, place=str(path), advice=advice) from None


def _refused(said: str, text: str) -> tuple[str, str]:
    """Return what is wrong with a text that is not TOML, and advice that shows the line."""
    if (at := _AT.search(said)) is None:
        return f"not valid TOML: {cut(said)}", ""
    lines = text.split("\n")
    number, column = (int(at[1]), int(at[2])) if at[1] else (len(lines), 1)
    line = lines[number - 1].rstrip()
    if said.startswith("Cannot"):  # declare, overwrite, redefine: all of what is there already
        advice = _twice(lines[:number])
    else:
        advice = _with_digits(line) or _usual(line) or cut(said.replace(at[0], ""))
    return f"line {number} is not valid TOML", f"{advice}\n{scene(line, column)}"


def _usual(line: str) -> str:
    """Return the advice on what is usual in a line that is not TOML."""
    if len(line) > LONGEST_LINE:
        return ""
    plain = re.sub(r"\s*#[^\"']*$", "", line).strip()
    for pattern, advice in _USUAL:
        if not (found := re.search(pattern, plain)):
            continue
        if not isinstance(advice, str):
            said = advice(found)
        else:
            said = advice.format("", *(each.strip() for each in found.groups("")))
        if said:
            return said
    return ""


def _twice(lines: Sequence[str]) -> str:
    """Return the advice on the last of some lines, whose key or table is given before."""
    if key := re.match(r"\s*([\w-]+)\s*=", lines[-1]):
        for i in range(len(lines) - 1, 0, -1):
            before = lines[i - 1]
            if re.match(rf"\s*{key[1]}\s*=", before):
                return (
                    f"{key[1]} is on line {i} already: remove one, or write the head of its "
                    "table, such as [rig], above the second"
                )
            if before.lstrip().startswith("["):
                break
    head = re.match(r"\s*\[+([\w.-]+)\]", lines[-1])
    if head and head[1].rpartition(".")[2] in REPEATED:
        return f"there may be several of it: write each head as [[{head[1]}]]"
    return "the key, or its table, is given twice: join them"


def _with_digits(line: str) -> str:
    """Return advice on the first number of a line that is invalid in TOML, such as .25."""
    found = _HALF_A_NUMBER.search(_TEXT_OR_COMMENT.sub("", line))
    if not found:
        return ""
    sign, whole, part, exponent = found.groups()
    return f"write {sign}{whole or 0}.{part or 0}{exponent}, not {found[0]}"


def override(data: dict[str, Any], setting: str) -> Key:
    """Change one key."""
    key, equals, text = setting.partition("=")
    parts = [part.strip() for part in key.split(".")]
    if not equals or not all(parts):
        raise ScenarioError(
            "give it as key=value, for example run.t_end=10", place=f"--set {cut(setting)}"
        )
    if "\n" in setting:
        line = setting.partition("\n")[0]
        raise ScenarioError("give one key and one value, on one line", place=f"--set {cut(line)}")
    if len(parts) > DEEPEST_KEY:
        raise ScenarioError("no key is nested this deeply", place=f"--set {cut(setting)}")
    if _ENDLESS_KEY.search(text):
        raise ScenarioError("no key is nested this deeply", place=f"--set {cut(setting)}")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
        hint = _with_digits(text)
        if hint and (value[0] in "[{" or _HALF_A_NUMBER.fullmatch(value)):
            raise ScenarioError(
                "not valid TOML", place=f"--set {cut(setting)}", advice=hint
            ) from None
    except (ValueError, RecursionError) as error:
        raise ScenarioError(f"{cut(str(error))}", place=f"--set {cut(setting)}") from None
    return _set(data, parts, value, f"--set {cut(setting)}")


def _set(data: dict[str, Any], parts: Sequence[str], value: Any, here: str) -> Key:
    """Set a key, and return it."""
    table: Any = data
    key: Key = ()
    for depth, part in enumerate(parts):
        step: str | int = _index(table, part, here) if isinstance(table, list) else part
        key, last = (*key, step), depth + 1 == len(parts)
        if last:
            table[step] = value
            break
        table = table[step] if isinstance(step, int) else table.setdefault(step, {})
        if not isinstance(table, dict) and not _is_tables(table):
            raise ScenarioError(f"{shown(part)} is a value, not a table", place=here)
    return key


def _index(tables: Sequence[Mapping[str, Any]], part: str, here: str) -> int:
    """Return the index of a table of an array, given its name or its index."""
    names = [str(each.get("name", i)) for i, each in enumerate(tables)]
    if part in names:
        return names.index(part)
    if part.isdecimal() and int(part) < len(tables):
        return int(part)
    raise unknown("table", part, names, ScenarioError, place=here)


# --------------------------------------------------------------------------- lines
@dataclass(frozen=True, eq=False)
class TomlFile:
    """A TOML file as it was read, which knows where each of its keys is given.

    `replaced` are the keys given by ``--set``.
    """

    path: Path
    text: str
    data: dict[str, Any]
    replaced: Sequence[Key] = ()

    @classmethod
    def of(
        cls, path: Path, kind: type[GMSError] = ScenarioError, overrides: Sequence[str] = ()
    ) -> TomlFile:
        """Read a file, and change keys."""
        text = text_of(path, kind)
        data = data_of(text, path, kind)
        return cls(path, text, data, [override(data, each) for each in overrides])

    def place_of(self, key: Key) -> list[str]:
        """Return where a key is given: on a line, or by an override; nothing if nowhere."""
        if any(key[: len(each)] == each for each in self.replaced):
            return ["--set"]
        line = line_of(self.text, key)
        return [f"line {line}"] if line else []

    def written(self, key: Key) -> Key:
        """Return what the file has of a key; a name with dots may be tables in tables."""
        found, data, left = list[str | int](), self.data, [*key]
        while left and isinstance(data, dict | list):
            part = left.pop(0)
            if isinstance(part, str) and isinstance(data, dict) and part not in data:
                part, dot, rest = part.partition(".")
                left[:0] = [rest] * bool(dot)
            if not _has(data, (part,)):
                break
            found.append(part)
            data = data[part]  # type: ignore[index]
        return tuple(found)

    def _narrowed(self, key: Key, name: str) -> Key:
        """Return the key of a name that is given in a table of the file, or in a table in it."""
        table: Any = self.data
        for part in key:
            table = table[part]
        if not isinstance(table, dict):
            return key
        inner = [(each, name) for each, value in table.items() if isinstance(value, dict)]
        return next(((*key, *each) for each in [(name,), *inner] if _has(table, each)), key)

    def blamed(self, error: Error, key: Key) -> Error:
        """Return an error with the line and the key of this file that it is about, if any."""
        found = self.written(key)
        found = found and self._narrowed(found, error.place.partition("[")[0])
        where, dotted = self.place_of(found) if found else [], ".".join(map(str, found))
        if not where:
            return error.inside(self.path)
        if not error.outer and error.place and found[-1] == error.place:
            error = error.replaced(place=dotted)
        else:
            where.append(dotted)
        return error.inside(", ".join(where)).inside(self.path)


def line_of(text: str, key: Key) -> int:
    r"""Return the line on which a key is written.

    The line is found by reading prefixes of the text: the first one that has the key ends there.

    Examples
    --------
    >>> line_of('[[edge]]\nname = "b"\n[[edge]]\nguard = "z > s"', ("edge", 1, "guard"))
    4
    """
    whole = tomllib.loads(text)
    while key and not _has(whole, key):
        key = key[:-1]
    lines, left = text.split("\n"), MOST_PREFIXES
    if not key:  # what is missing stands on no line
        return 0

    def valid_end(last: int) -> tuple[int, bool]:
        """Return the end of the longest valid prefix up to a line, and whether it has the key."""
        nonlocal left
        for end in range(last, 0, -1):  # a prefix may end inside an array or a long text
            left -= 1
            if left < 0:
                break
            try:
                return end, _has(tomllib.loads("\n".join(lines[:end])), key)
            except tomllib.TOMLDecodeError:
                continue
        return 0, False

    low, high = 0, len(lines)
    while low + 1 < high and left >= 0:
        middle = (low + high) // 2
        end, found = valid_end(middle)
        low, high = (low, end) if found else (middle, high)
    before, _ = valid_end(high - 1)
    return before + 1 if left >= 0 else 0


def _has(data: Any, key: Key) -> bool:
    for part in key:
        try:
            data = data[part]
        except (LookupError, TypeError):
            return False
    return True


# --------------------------------------------------------------------------- writing
_BARE = re.compile(r"[A-Za-z0-9_-]+")


def written(data: Mapping[str, Any]) -> str:
    """Return tables as TOML text that reads back equal.

    Examples
    --------
    >>> print(written({"name": "a", "state": [{"name": "b", "flow": {"z": "v"}}]}), end="")
    name = "a"
    <BLANKLINE>
    [[state]]
    name = "b"
    flow.z = "v"
    """
    return "\n".join(_lines(data, ())).removeprefix("\n") + "\n"


def _lines(table: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[str]:
    tables = {}
    for name, value in table.items():
        if path and value and _is_table(value) and not any(map(_nested, value.values())):
            yield from (f"{_dotted((name, key))} = {_value(u)}" for key, u in value.items())
        elif _nested(value):
            tables[name] = value
        else:
            yield f"{_dotted((name,))} = {_value(value)}"
    for name, value in tables.items():
        here = (*path, name)
        head = f"[[{_dotted(here)}]]" if _is_tables(value) else f"[{_dotted(here)}]"
        for each in value if _is_tables(value) else [value]:
            yield from ("", head, *_lines(each, here))


def _is_table(value: object) -> bool:
    return isinstance(value, Mapping)


def _nested(value: object) -> bool:
    return _is_table(value) or _is_tables(value)


def _is_tables(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(map(_is_table, value))


def _dotted(names: Sequence[str]) -> str:
    return ".".join(name if _BARE.fullmatch(name) else _value(name) for name in names)


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):  # the escapes of JSON are those of TOML, which needs one more
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)
