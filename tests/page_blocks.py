"""The code blocks of a page, and how they are run."""

from __future__ import annotations

import contextlib
import io
import re
import shutil
import sys
from dataclasses import dataclass
from typing import Any
from unittest import mock

from gms_fsm.app.cli import main
from gms_fsm.app.debugger import run_debugger
from gms_fsm.app.scenario import load_scenario
from tests.helpers import ROOT

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
        What stands behind the fence.
    body : str
        Its lines.
    file : str
        The name a comment before it gives, else empty.
    line : int
        Where it begins, from 1.
    """

    kind: str
    body: str
    file: str
    line: int


def blocks_of(text: str) -> list[Block]:
    """Return the blocks of a page, those that are directions to Sphinx left out."""
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
        shutil.copytree(ROOT / "scenarios", "scenarios")

    def python(self, block: Block) -> str:
        """Execute a Python block and return what it prints."""
        code = "\n" * (block.line) + block.body  # so that an error names the page's line
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
    """Give the debugger the commands behind the prompts of a transcript."""
    commands = re.findall(r"^\(t=[^)]*\) (.+)$", shown, re.MULTILINE)
    out = io.StringIO()
    script = io.StringIO("".join(f"{command}\n" for command in commands))
    code = run_debugger(load_scenario(scenario), script, out)
    return out.getvalue(), code == 0


def agrees(shown: str, said: str) -> bool:
    """Return whether a page shows what was said; a line ``...`` stands for any lines."""
    pattern = "".join(
        r"(?:.*\n)*?" if line.strip() == "..." else re.escape(line.rstrip()) + r"[ ]*\n"
        for line in shown.rstrip("\n").split("\n")
    )
    return re.fullmatch(pattern, said.rstrip("\n") + "\n") is not None
