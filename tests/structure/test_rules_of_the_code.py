"""The rules of CONTRIBUTING that the text of a module shows: a table of rules, walked over all.

A rule yields the lines of a module that break it. Each is tried on lines that do and do not.
"""

from __future__ import annotations

import ast
import functools
import importlib
import inspect
import io
import re
import sys
import tokenize
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

import gms_fsm
from gms_fsm import GMSError
from tests.helpers import ROOT
from tests.structure.source import Source, sources

Function = ast.FunctionDef | ast.AsyncFunctionDef
ERRORS = {name for name in gms_fsm.__all__ if name.endswith("Error")}
MARKS = {"System", "Mounting", "Several"}  # a run that has one of these was given a system
LONGEST_MODULE, LONGEST_FUNCTION = 600, 80  # lines, lines of code


def evaluated(source: Source) -> Iterator[int]:
    """Nothing a user writes is evaluated as Python."""
    for node in source.nodes:
        called = node.func if isinstance(node, ast.Call) else None
        if isinstance(called, ast.Name) and called.id in ("eval", "exec", "compile"):
            yield called.lineno


def switching(source: Source) -> Iterator[int]:
    """States are named in charts; code that compares with such a name has its own rule."""
    for node in source.nodes:
        if isinstance(node, ast.Compare | ast.MatchValue):
            texts = (each.value for each in ast.walk(node) if isinstance(each, ast.Constant))
            if {"stick", "slip"} & {text for text in texts if isinstance(text, str)}:
                yield node.lineno


def asked(source: Source) -> Iterator[int]:
    """Behind the door nothing asks whether it is a system."""
    for node in source.nodes:
        named: list[ast.expr] = []
        if isinstance(node, ast.Call) and ast.unparse(node.func) in (
            "isinstance",
            "issubclass",
            "type",
        ):
            named = [*node.args]
        elif isinstance(node, ast.Compare):
            named = [node.left, *node.comparators]
        elif isinstance(node, ast.MatchClass):
            named = [node.cls]
        names = (part for one in named for part in ast.walk(one))
        if any(getattr(part, "id", getattr(part, "attr", "")) in MARKS for part in names):
            yield named[0].lineno


def hiding(source: Source) -> Iterator[int]:
    """An error's reason is one field; advice is another."""
    for node in source.nodes:
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ERRORS and node.args:
            first = node.args[0]
            parts = first.values if isinstance(first, ast.JoinedStr) else [first]
            texts = [part.value for part in parts if isinstance(part, ast.Constant)]
            if any("; " in text for text in texts if isinstance(text, str)):
                yield node.lineno


def named_errors(source: Source) -> Iterator[int]:
    """Errors are defined in one place, and those that keep a trace in another."""
    for node in source.nodes:
        if isinstance(node, ast.ClassDef) and node.name.endswith(("Error", "Exception")):
            yield node.lineno


def reading(source: Source) -> Iterator[int]:
    """Messages are for people; programs use the fields."""
    for node in source.nodes:
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "str(error)":
            yield node.lineno


def of_friction(source: Source) -> Iterator[int]:
    """`integrators` knows nothing about friction, nor its callers, and imports few."""
    for number, line in enumerate(source.text.splitlines(), start=1):
        if re.search(r"(?i)\b(?:slip|stick|friction|stribeck|bristle)\w*|gms", line):
            yield number
    known = {*sys.stdlib_module_names, "integrators", "numpy", "scipy", "llvmlite"}
    for node in source.nodes:
        modules: list[str] = []
        if isinstance(node, ast.Import):
            modules = [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom):
            modules = [str(node.module)]
        outside = {each.partition(".")[0] for each in modules} - known
        if outside or getattr(node, "id", getattr(node, "arg", "")) == "z":
            yield node.lineno  # type: ignore[attr-defined]


def leaving(source: Source) -> Iterator[int]:
    """Text leaves the program, as bytes or to a terminal, through `gms_fsm.foundation.text`."""
    inside = set[ast.AST]()  # of what only tells texts apart, or is made visible
    for node in source.nodes:
        called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
        if isinstance(node, ast.Yield) or called.endswith(("sha256", ".update")):
            inside.update(ast.walk(node))
        given = map(ast.unparse, node.args) if isinstance(node, ast.Call) else ()
        if any(each.startswith(("visible", "encoded")) for each in given):
            inside.add(node)
    for node in source.nodes:
        if not isinstance(node, ast.Call) or node in inside:
            continue
        called = ast.unparse(node.func)
        word = called.rpartition(".")[2]
        bare = word in ("encode", "isprintable") and not node.args
        stream = called.endswith(("stdout.write", "stderr.write", ".writestr"))
        if bare or stream or word in ("print", "echo") or (word == "write_text" and "." in called):
            yield node.lineno


def long(source: Source) -> Iterator[int]:
    """No function is too long, unless a comment directly above it says why."""
    lines = source.text.splitlines()
    if len(lines) > LONGEST_MODULE:
        yield len(lines)
    functions = [each for each in source.nodes if isinstance(each, Function)]
    for node in functions:
        own = _lines(node)
        if len(own) <= LONGEST_FUNCTION:
            continue
        inner = set[int]().union(*(_lines(each) for each in ast.walk(node)
                                   if isinstance(each, Function) and each is not node))  # fmt: skip
        above = min([node.lineno, *(each.lineno for each in node.decorator_list)]) - 1
        while above > 0 and lines[above - 1].lstrip().startswith("#"):
            above -= 1
        said = re.match(r"\s*# Long because \w", lines[above]) if above < node.lineno - 1 else None
        if len((own & code_lines(source.text)) - inner) > LONGEST_FUNCTION and not said:
            yield node.lineno


def _lines(node: Function) -> set[int]:
    return {*range(node.lineno, (node.end_lineno or 0) + 1)}


@functools.cache
def code_lines(text: str) -> set[int]:
    """Return the numbers of the lines that contain code: no comments, no docstrings."""
    blank = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
    found = {
        line
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in blank and token.type != tokenize.ENDMARKER
        for line in range(token.start[0], token.end[0] + 1)
    }
    for node in ast.walk(ast.parse(text)):
        holds = isinstance(node, (ast.Module, ast.ClassDef, *Function.__args__))
        if holds and ast.get_docstring(node, clean=False) is not None:
            first = node.body[0]  # type: ignore[attr-defined]
            found -= set(range(first.lineno, first.end_lineno + 1))
    return found


class Rule(NamedTuple):
    """What is looked for, where, lines that break it and lines that do not; known places."""

    lines: Callable[[Source], Iterable[int]]
    under: tuple[str, ...]
    breaking: tuple[str, ...]
    fine: tuple[str, ...] = ("x = 1",)
    but: tuple[str, ...] = ()
    known: tuple[str, ...] = ()  # with a reason, or the one place of the thing


DOC = 'def f():\n    """Doc.\n\n    Doc.\n    """\n\n    # comment\n'
ASKING = ("isinstance(m, System)", "isinstance(m, Chart | systems.System)", "type(m) is System",
          "x = 1 if isinstance(t.model, (Chart, Several)) else 2",
          "match m:\n    case System(name=name):\n        pass")  # fmt: skip
EVERY = ("gms_fsm/", "integrators/", "plots/")
RULES = {
    "nothing is evaluated": Rule(
        evaluated,
        EVERY,
        ("eval (1)", "x = exec(t)", "compile('a')"),
        ("text = 'eval(1)'  # eval(1)", "evaluate(1)", "model.eval", "re.compile('a')"),
        # The front end compiles the text of a function to compare it with the code that is loaded.
        known=(
            "gms_fsm/lowering/generated.py",
            "integrators/machine_code/front_end/sources.py",
        ),
    ),
    "no switching outside the charts": Rule(
        switching,
        ("gms_fsm/", "plots/"),
        ("if state == 'stick':\n    x = 1", "x = s in ('slip', 'a')"),
        ("x = 'stick'",),
        but=("gms_fsm/app/lessons/", "gms_fsm/app/paper/"),
    ),
    "nothing asks whether it is a system": Rule(
        asked,
        ("gms_fsm/", "plots/"),
        ASKING,
        but=("gms_fsm/exporters/",),  # a room with a door of its own
        known=("gms_fsm/systems/mounted.py",),
    ),
    "no reason hides advice": Rule(
        hiding,
        ("gms_fsm/", "plots/"),
        ('raise ChartError("none; give one")', 'raise ChartError(f"{a} is none; give {b}")'),
        ('raise ChartError("none", advice="give one; or two")',),
    ),
    "errors have their homes": Rule(
        named_errors,
        ("gms_fsm/", "plots/"),
        ("class OwnError(ValueError): ...",),
        known=("gms_fsm/errors.py", "gms_fsm/traces/failures.py"),
    ),
    "no code reads a message": Rule(
        reading,
        ("gms_fsm/", "plots/"),
        ('str(error).startswith("a")',),
        but=("gms_fsm/errors.py",),
    ),
    "integrators know nothing about friction": Rule(
        of_friction,
        ("integrators/",),
        ("x = 'stick-slip'", "z = 1", "def f(z): ...", "import pandas", "x = 'gms-fsm'"),
        ("import numpy as np", "size = 1"),
    ),
    "text leaves through one function": Rule(
        leaving,
        ("gms_fsm/", "plots/"),
        (
            "print(title)",
            "file.write(text.encode())",
            "typer.echo(f'{title}')",
            "stdout.write(title)",
            "console.print(title)",
            "path.write_text(title)",
            "''.join(c for c in title if c.isprintable())",
        ),
        (
            "print(visible(title))",
            "file.write(encoded(text))",
            "sha256(text.encode())",
            "write_text(path, title)",
            "video.encode(frame)",
        ),
        but=("gms_fsm/app/lessons/",),  # texts of ours
        known=(
            "gms_fsm/foundation/text.py",
            "gms_fsm/app/live.py",  # numbers, and names that are identifiers
            "gms_fsm/app/verbs/console.py",
            "gms_fsm/app/verbs/fit.py",  # a table of visible cells
            "gms_fsm/debugger/_terminal.py",
            "gms_fsm/language/_read.py",  # counts bytes
        ),
    ),
    "nothing is too long": Rule(
        long,
        EVERY,
        (
            DOC + "    x = 1\n" * 80,
            f"# Long because it is a table.\n\n{DOC}" + "    x = 1\n" * 80,
            f"# Too long.\n@g\n{DOC}" + "    x = 1\n" * 80,
            DOC + "    x = '''\n\n\n'''\n" * 20,  # a string that is code counts with all lines
            "x = 1\n" * 601,
        ),
        (
            DOC + "    x = 1\n" * 79,
            f"# Long because it is\n# a table.\n{DOC}" + "    x = 1\n" * 80,
            DOC + "    def g():\n" + "        x = 1\n" * 40 + "    x = 1\n" * 40,
        ),
    ),
}


@pytest.mark.parametrize("name", RULES)
def test_the_rule_finds_what_it_looks_for(name: str) -> None:
    for text in RULES[name].breaking:
        assert [*RULES[name].lines(Source.of(text))], text
    for text in RULES[name].fine:
        assert not [*RULES[name].lines(Source.of(text))], text


@pytest.mark.slow
@pytest.mark.parametrize("name", RULES)
def test_every_module_keeps_the_rule(name: str) -> None:
    rule = RULES[name]
    found = {
        each.path: lines
        for each in sources().values()
        if each.path.startswith(rule.under) and not each.path.startswith(rule.but or ("-",))
        if (lines := [*rule.lines(each)])
    }
    assert set(found) == set(rule.known), found


# --------------------------------------------------------------------------- docstrings
SECTION = re.compile(r"^ *(Parameters|Returns|Yields|Raises|Other Parameters)\n *---+$", re.M)
DIRECTIVE = re.compile(r"^\.\. auto(module|class|function):: ([\w.]+)$", re.M)
Place = tuple[str, int]  # of a function: its file, and the line of its first decorator or `def`


def _object(name: str) -> Any:
    """Return the object of a dotted name."""
    module = name
    while module not in sources():
        module = module.rpartition(".")[0]
    rest = name.removeprefix(module).split(".")[1:]
    return functools.reduce(getattr, rest, importlib.import_module(module))


def _functions(shown: Any) -> Iterator[Any]:
    """Yield the functions behind a name: itself, or the public methods of a class."""
    if inspect.isclass(shown):
        for base in shown.__mro__:
            for name, each in vars(base).items():
                if not name.startswith("_"):
                    yield from _functions(each)
    elif isinstance(shown, property):
        yield from (each for each in (shown.fget, shown.fset) if each)
    elif isinstance(shown, functools.cached_property):
        yield shown.func
    elif isinstance(shown, classmethod | staticmethod):
        yield shown.__func__
    elif inspect.isroutine(shown) or hasattr(shown, "__wrapped__"):
        yield shown


def _shown_by(kind: str, name: str) -> Iterator[Any]:
    found = _object(name)
    if kind != "module":
        yield found
        return
    names = getattr(found, "__all__", None)
    yield from (
        each
        for key, each in ((n, getattr(found, n)) for n in names or vars(found))
        if names or (not key.startswith("_") and getattr(each, "__module__", "") == name)
    )


def _place(function: Any) -> Place | None:
    code = getattr(inspect.unwrap(function), "__code__", None)
    if code is None or not Path(code.co_filename).is_relative_to(ROOT):
        return None
    return Path(code.co_filename).relative_to(ROOT).as_posix(), code.co_firstlineno


@pytest.mark.slow
def test_sections_are_for_what_the_documentation_shows() -> None:
    """Elsewhere names and types say it, and a docstring adds what is not obvious."""
    pytest.importorskip("matplotlib", reason="imports every documented module (extra: dev)")
    with_sections = {
        (each.path, min([node.lineno, *(one.lineno for one in node.decorator_list)]))
        for each in sources().values()
        for node in each.nodes
        if isinstance(node, Function) and SECTION.search(ast.get_docstring(node) or "")
    }
    assert len(with_sections) > 300
    documented = {
        _place(function)
        for page in sorted((ROOT / "docs" / "api").glob("*.rst"))
        for kind, name in DIRECTIVE.findall(page.read_text(encoding="utf-8"))
        for shown in _shown_by(kind, name)
        for function in _functions(shown)
    }
    assert with_sections - documented == set()
    public = {
        f"{module}.{name}": _place(getattr(importlib.import_module(module), name))
        for module in ("gms_fsm", "plots", "integrators")
        for name in importlib.import_module(module).__all__
    }
    lacking = {name for name, place in public.items() if place and place not in with_sections}
    assert lacking == set()


def test_errors_are_known_to_the_rules() -> None:
    assert all(issubclass(getattr(gms_fsm, name), GMSError) for name in ERRORS)
    assert len(ERRORS) > 10
