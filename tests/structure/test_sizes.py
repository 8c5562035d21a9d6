"""No module has over 600 lines and no function over 80 lines of code, unless a comment says why.

Blank lines, comments and docstrings do not count as code, and a nested function counts
separately. The comment stands directly above the function (or
its decorators) and begins with "Long because".
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from pathlib import Path

from tests.helpers import ROOT

PACKAGES = ("gms_fsm", "integrators", "plots")
LONGEST_MODULE, LONGEST_FUNCTION = 600, 80  # lines, lines of code
SAID = re.compile(r"# Long because \w")

Function = ast.FunctionDef | ast.AsyncFunctionDef


def modules() -> list[Path]:
    """Return every module of the packages."""
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def code_lines(text: str) -> set[int]:
    """Return the numbers of the lines that contain code."""
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    blank = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT}
    found = {
        line
        for token in tokens
        if token.type not in blank and token.type != tokenize.ENDMARKER
        for line in range(token.start[0], token.end[0] + 1)
    }
    for node in ast.walk(ast.parse(text)):
        holds = isinstance(node, (ast.Module, ast.ClassDef, *Function.__args__))
        if holds and ast.get_docstring(node, clean=False) is not None:
            first = node.body[0]  # type: ignore[attr-defined]
            found -= set(range(first.lineno, first.end_lineno + 1))
    return found


def long_functions(text: str) -> dict[str, int]:
    """Return the functions of a module that are too long without a reason, with their sizes."""
    lines, code, found = text.splitlines(), set[int](), {}
    for node in ast.walk(ast.parse(text)):
        if (
            not isinstance(node, Function)
            or (node.end_lineno or 0) - node.lineno < LONGEST_FUNCTION
        ):
            continue
        code = code or code_lines(text)
        inner = {
            line
            for other in ast.walk(node)
            if isinstance(other, Function) and other is not node
            for line in range(other.lineno, (other.end_lineno or 0) + 1)
        }
        size = len(code & set(range(node.lineno, (node.end_lineno or 0) + 1)) - inner)
        first = min([node.lineno, *(each.lineno for each in node.decorator_list)])
        above = first - 1  # of the last line of the comment above the function, counted from 1
        while above > 0 and lines[above - 1].lstrip().startswith("#"):
            above -= 1
        comment = "\n".join(lines[above : first - 1])
        if size > LONGEST_FUNCTION and not SAID.search(comment):
            found[node.name] = size
    return found


def test_no_module_and_no_function_is_too_long() -> None:
    found: dict[str, object] = {}
    for path in modules():
        text, name = path.read_text(encoding="utf-8"), str(path.relative_to(ROOT))
        size, functions = len(text.splitlines()), long_functions(text)
        found |= {name: functions or size} if functions or size > LONGEST_MODULE else {}
    assert found == {}


def test_lines_of_code_are_counted() -> None:
    head = 'def f():\n    """Doc.\n\n    Doc.\n    """\n\n    # comment\n'
    assert long_functions(head + "    x = 1\n" * 79) == {}
    assert long_functions(head + "    x = 1\n" * 80) == {"f": 81}
    assert long_functions(f"# Long because it is a table.\n{head}" + "    x = 1\n" * 80) == {}
    assert long_functions(f"# Long because it is\n# a table.\n{head}" + "    x = 1\n" * 80) == {}
    assert long_functions(f"# Long because it is a table.\n\n{head}" + "    x = 1\n" * 80) != {}
    assert long_functions(f"# Too long.\n@g\n{head}" + "    x = 1\n" * 80) == {"f": 81}
    inner = "    def g():\n" + "        x = 1\n" * 40
    assert long_functions(head + inner + "    x = 1\n" * 40) == {}
    text = "    x = '''\n\n\n'''\n"  # a string that is code counts with all its lines
    assert long_functions(head + text * 20) == {"f": 81}
