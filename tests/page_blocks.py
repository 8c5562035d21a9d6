"""The code blocks of a page, and how they are run."""

from __future__ import annotations

import contextlib
import io
import re
import sys
from dataclasses import dataclass
from typing import Any
from unittest import mock

from gms_fsm.app.cli import main
from gms_fsm.app.scenario import load_scenario, run_debugger

FENCE = re.compile(
    r"(?:^<!-- file: (?P<file>\S+) -->\n)?^```(?P<kind>[^\n`]*)\n(?P<body>.*?)^```$",
    re.DOTALL | re.MULTILINE,
)


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Parameters
    ----------
    kind : str
        Text after the opening fence.
    body : str
        Lines of the block.
    file : str
        File name from a comment before the block, else empty.
    line : int
        First line, from 1.
    """

    kind: str
    body: str
    file: str
    line: int


def blocks_of(text: str) -> list[Block]:
    """Return the blocks of a page, without Sphinx directives."""
    return [
        Block(m["kind"], m["body"], m["file"] or "", text.count("\n", 0, m.start()) + 1)
        for m in FENCE.finditer(text)
        if not m["kind"].startswith("{")
    ]


class Page:
    """Runs the blocks of one page, in order, in one namespace and in the current folder."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.namespace: dict[str, Any] = {"__name__": "page"}

    def python(self, block: Block) -> str:
        """Execute a Python block and return its output."""
        code = "\n" * (block.line) + block.body  # so that errors have the line number of the page
        with contextlib.redirect_stdout(io.StringIO()) as out:
            exec(compile(code, self.name, "exec", dont_inherit=True), self.namespace)
        return out.getvalue()

    def console(self, block: Block) -> list[tuple[str, str, str, bool]]:
        """Run the commands of a block: (command, shown, said, whether it succeeded) of each."""
        found = []
        for part in re.split(r"^(?=\$ )", block.body, flags=re.MULTILINE):
            if not part.strip():
                continue
            command, _, shown = part.removeprefix("$ ").partition("\n")
            words = command.split()
            assert words[0] == "gms-fsm", command
            if words[1] == "debug":
                found.append((command, shown, *_debugged(words[2], shown)))
            else:
                found.append((command, shown, *_run(words[1:])))
        return found


def _run(arguments: list[str]) -> tuple[str, bool]:
    out, err, code = io.StringIO(), io.StringIO(), 0
    with (
        mock.patch.object(sys, "argv", ["gms-fsm", *arguments]),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as end:
            code = int(end.code or 0)
    said = out.getvalue() if code == 0 else out.getvalue() + err.getvalue()
    return said, code == 0


def _debugged(scenario: str, shown: str) -> tuple[str, bool]:
    """Run the commands of a transcript in the debugger."""
    commands = re.findall(r"^\(t=[^)]*\) (.+)$", shown, re.MULTILINE)
    out = io.StringIO()
    script = io.StringIO("".join(f"{command}\n" for command in commands))
    code = run_debugger(load_scenario(scenario), script, out)
    return out.getvalue(), code == 0


def agrees(shown: str, said: str) -> bool:
    """Return whether a page shows the output; a line ``...`` matches any lines."""
    pattern = "".join(
        r"(?:.*\n)*?" if line.strip() == "..." else re.escape(line.rstrip()) + r"[ ]*\n"
        for line in shown.rstrip("\n").split("\n")
    )
    return re.fullmatch(pattern, said.rstrip("\n") + "\n") is not None
