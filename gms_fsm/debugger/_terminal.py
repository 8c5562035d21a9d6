"""The terminal interface of a session: one command per line, answered by lines of plain text.

Lines are as wide as the terminal; in a pipe or a file they have 80 columns, whatever wrote them.

Nothing is redrawn, so a transcript, a pipe and a screen reader all get the same text. Colour is
added last and carries no additional information.
"""

from __future__ import annotations

import cmd
import io
import os
import re
import shutil
import sys
from typing import TextIO

from gms_fsm.debugger._commands import Commands
from gms_fsm.debugger._text import DRAWN, PLAIN
from gms_fsm.foundation.quantities import WIDTH, wrapped
from gms_fsm.foundation.text import visible, visible_lines
from gms_fsm.session.session import Session
from plots.style import ansi

NARROWEST = 40  # columns; a narrower terminal breaks the lines itself
# Looks of words, in the colours that the terminal gives to the roles; bold where it changes.
WORDS = {
    "true": ansi("holds"),
    "false": ansi("fails"),
    "fired": ansi("now", bold=True),
    "FIRED": ansi("now", bold=True),
    "error:": ansi("error", bold=True),
    "ACTIVE": ansi("active", bold=True),
}


class Debugger(cmd.Cmd):
    r"""Reads commands and displays a session: ``Debugger(Session(model, rig, t_end)).run()``.

    Parameters
    ----------
    session : Session
        The session.
    title : str, optional
        Printed by `run` before the titles of the model and the rig.
    stdin, stdout : text files, optional
        The terminal by default. Commands that do not come from a terminal are echoed, so that a
        transcript is readable.

    Examples
    --------
    In a terminal, ``Debugger(session).run()`` prompts for commands. Here they come from a string:

    >>> import io
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> session = Session(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...                   Prescribed("0.15*sin(2*pi*t/25)"), 100.0)
    >>> print(Debugger(session).reply("print s1"))
    1.5 m
    >>> code = Debugger(session, stdin=io.StringIO("next\nquit\n")).run()
    GMS, 4 elements, published law; prescribed velocity, to t = 100 s
    help lists the commands, where shows everything, quit exits.
    (t=0.0000 s) next
    row 11, t = 4.91276068 s, micro-step 1: v = 141.608 mm/s, F = 1.34657 N
      element 1: stick -> slip by break_away_forward
    (t=4.9128 s) quit
    """

    def __init__(
        self,
        session: Session,
        title: str = "",
        stdin: TextIO | None = None,
        stdout: TextIO | None = None,
    ) -> None:
        super().__init__(stdin=stdin, stdout=stdout)
        self.title = title
        self.typed = stdin is None and sys.stdin is not None and sys.stdin.isatty()
        self.use_rawinput = self.typed
        self.coloured = (
            self.stdout.isatty()
            and not os.environ.get("NO_COLOR")
            and os.environ.get("TERM") != "dumb"
        )
        self.encoding = (getattr(self.stdout, "encoding", None) or "utf-8").lower()
        drawn = self.coloured and self.encoding.startswith("utf")
        self.commands = Commands(session, DRAWN if drawn else PLAIN)
        self.prompt = self.commands.prompt

    @property
    def session(self) -> Session:
        """The current session; `load` replaces it."""
        return self.commands.session

    # ------------------------------------------------------------------ the loop
    def run(self) -> int:
        """Print a greeting, then read and answer commands until `quit` or the end of input.

        Returns
        -------
        int
            The exit code: 1 if commands that were not typed were refused, else 0.
        """
        if self.title:
            self.say(visible(self.title))
        self.say(self.session.title)
        self.say("help lists the commands, where shows everything, quit exits.")
        while True:
            try:
                self.cmdloop()
            except KeyboardInterrupt:  # at the prompt
                self.say("\nquit exits")
            else:
                return int(self.commands.refused > 0 and not self.typed)

    def precmd(self, line: str) -> str:
        """Echo a command that was not typed."""
        if not self.typed:
            self.stdout.write("\n" if line == "EOF" else f"{visible(line)}\n")
        return line

    def postcmd(self, stop: bool, line: str) -> bool:  # noqa: ARG002 (signature of the base class)
        """Show the current position in the prompt."""
        self.prompt = self.commands.prompt
        return stop

    def onecmd(self, line: str) -> bool:
        """Execute one command; an error is printed and never ends the session.

        Parameters
        ----------
        line : str
            The line as typed.

        Returns
        -------
        bool
            Whether to exit.
        """
        if line == "EOF":
            return True
        if self.typed and not line.strip():
            line = self.commands.last_move
        self.commands.width = self.width
        for said in self.commands.reply(line):
            self.say(said)
        return self.commands.left

    @property
    def width(self) -> int:
        """Columns: those of the terminal, else 80."""
        if not self.stdout.isatty():
            return WIDTH
        return max(NARROWEST, shutil.get_terminal_size((WIDTH, 24)).columns)

    def reply(self, line: str) -> str:
        """Return the answer to a command, for scripts.

        Parameters
        ----------
        line : str
            A command.

        Returns
        -------
        str
            The answer without the final line break.
        """
        stdout, self.stdout = self.stdout, io.StringIO()
        try:
            self.onecmd(line)
            return self.stdout.getvalue().rstrip("\n")
        finally:
            self.stdout = stdout

    def say(self, text: str) -> None:
        """Print lines, wrapped to the screen width."""
        width = self.width
        for line in visible_lines(text).replace("µ", self.commands.marks.micro).split("\n"):
            for part in wrapped(line, width):
                part = part.encode(self.encoding, "replace").decode(self.encoding)
                self.stdout.write(f"{self._painted(part)}\n")

    def _painted(self, line: str) -> str:
        if not self.coloured:
            return line
        states = self.commands.states
        codes = WORDS | {name: ansi("active", bold=i > 0) for i, name in enumerate(states)}
        words = "|".join(re.escape(word) for word in codes)
        return re.sub(
            rf"(?<!\w)({words})(?!\w)", lambda m: f"\x1b[{codes[m[0]]}m{m[0]}\x1b[0m", line
        )

    # ------------------------------------------------------------------ completion
    def completenames(self, text: str, *_: object) -> list[str]:
        """Complete a command."""
        return self.commands.complete(text)

    def completedefault(self, *arguments: object) -> list[str]:
        """Complete an argument: edges, states, names or numbers, depending on the command."""
        text, line, begin = str(arguments[0]), str(arguments[1]), int(str(arguments[2]))
        return self.commands.complete(text, line[:begin])

    complete_help = completedefault
