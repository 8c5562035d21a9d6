"""The terminal face of a session: one command a line, answers as plain text of 80 columns.

Nothing is ever redrawn: what was said stays above, so that a transcript, a pipe and a screen reader
all get the same words. Colour is put on last and says nothing that the words do not.
"""

from __future__ import annotations

import cmd
import difflib
import io
import os
import re
import string
import sys
import textwrap
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from gms_fsm.app.scenario import Loaded, load_scenario
from gms_fsm.errors import GMSError, ScenarioError, SessionError
from gms_fsm.inspection.explain import Explanation, holds
from gms_fsm.inspection.session import KINDS, Branch, Breakpoint, Session
from gms_fsm.language.expression import evaluate
from gms_fsm.systems.models import parameter_names

__all__ = ["Debugger", "run_debugger", "scenario_to_debug"]

WIDTH = 80
BAR = 8  # characters of |z|/s = 1


# --------------------------------------------------------------------------- the commands
@dataclass(frozen=True)
class Command:
    """What the help says of a command; `Debugger.help_of` fills the braces with a chart's names."""

    group: str
    usage: str
    says: str
    examples: tuple[str, ...]
    alias: str = ""


COMMANDS = {
    "where": Command(
        "look",
        "where",
        "Everything on one screen: each element's state, variables, threshold s and |{z}|/s if it "
        "has one, force, and its edges by priority with a mark a clause; below, the states over "
        "time.",
        ("where",),
        "w",
    ),
    "why": Command(
        "look",
        "why [ELEMENT] [EDGE]",
        "Say why the edges of an element fire or do not, clause by clause: both sides, the margin "
        "(negative: on the false side), and the truth. With an edge's name, that one alone.",
        ("why", "why {n}", "why {n} {leaving}"),
    ),
    "list": Command(
        "look",
        "list",
        "Draw the current element's chart: the active state and the guards that are asked.",
        ("list",),
        "l",
    ),
    "log": Command("look", "log [N]", "The last N transitions (10) up to here.", ("log 4",)),
    "print": Command(
        "look",
        "print EXPRESSION",
        "The value of an expression or the truth of a condition. Names: t, x, v, F, s, and with an "
        "element's number {numbered}, s1, F1, state(1).",
        ("print {z}1 / {s}1", "p state({n}) == {state}"),
        "p",
    ),
    "watch": Command(
        "look",
        "watch [EXPRESSION]",
        "Show an expression after every move; alone, show all watches.",
        ("watch F{n}", "watch abs({z}1) / {s}1"),
    ),
    "unwatch": Command("look", "unwatch N|all", "Take a watch away.", ("unwatch 1",)),
    "element": Command(
        "look",
        "element N",
        "Choose the element that list and why show; counted from 1.",
        ("element {n}",),
    ),
    "step": Command(
        "move",
        "step [N]",
        "Go forward N rows (1). The firings of one time are rows of their own.",
        ("step", "s 10"),
        "s",
    ),
    "back": Command("move", "back [N]", "Go back N rows (1).", ("back 10",)),
    "next": Command("move", "next", "Go forward to the next transition.", ("next",), "n"),
    "prev": Command("move", "prev", "Go back to the transition before.", ("prev",)),
    "goto": Command(
        "move", "goto T", "Go to the last row at or before a time, in seconds.", ("goto {t}",)
    ),
    "until": Command(
        "move",
        "until CONDITION",
        "Go forward to where a condition next becomes true, also between two rows.",
        ("until abs({z}1) > 0.9*{s}1", "u state({n}) == {state} and v > 0"),
        "u",
    ),
    "continue": Command(
        "move",
        "continue",
        "Go forward to the next breakpoint that hits, or the end.",
        ("continue",),
        "c",
    ),
    "break": Command(
        "stop",
        "break [tested|valid|fires] EDGE [element N] [if CONDITION] [hits K], or "
        "break [enter|leave] STATE ...",
        "Let continue stop where an edge's guard is asked (tested), becomes true (valid), or where "
        "it is taken (fires, also if left out); where a state is entered (also if left out) or "
        "left. The condition is looked at after the event; K: stop from the K-th hit on. Alone, "
        "show all breakpoints.",
        ("break fires {edge} element {n}", "b enter {state} if v < 0 hits 3"),
        "b",
    ),
    "breaks": Command("stop", "breaks", "Show all breakpoints and their hits.", ("breaks",)),
    "clear": Command("stop", "clear N|all", "Take a breakpoint away.", ("clear 1",)),
    "poke": Command(
        "change",
        "poke {z}1=VALUE v=VALUE state1=STATE ...",
        "Change values here and go on in a new branch; the present one stays as it is. What can be "
        "changed: {numbered}, state1, likewise of the other elements, and v where the rig has a "
        "mass. A value can be an expression without blanks.",
        ("poke {z}1=0", "poke {z}{n}=0.9*{s}{n} state{n}={state}"),
    ),
    "run": Command("change", "run", "Compute this branch to its end; stay here.", ("run",)),
    "branches": Command("change", "branches", "Show all branches.", ("branches",)),
    "branch": Command("change", "branch N", "Walk another branch.", ("branch 0",)),
    "compare": Command(
        "change",
        "compare [A B]",
        "Compute two branches to their ends and compare them; alone, this one and its parent.",
        ("compare 0 1",),
    ),
    "plot": Command(
        "change",
        "plot FILE.png",
        "Compute all branches to their ends and draw them (.png, .svg or .pdf; needs matplotlib).",
        ("plot branches.png",),
    ),
    "save": Command("file", "save FILE", "Write the session to a file.", ("save mine.json",)),
    "load": Command("file", "load FILE", "Go on with a session from a file.", ("load mine.json",)),
    "help": Command("file", "help [COMMAND]", "Show what there is.", ("help break",), "h"),
    "quit": Command("file", "quit", "Leave.", ("quit",), "q"),
}
ALIASES = {each.alias: name for name, each in COMMANDS.items() if each.alias} | {"?": "help"}
MOVES = ("step", "back", "next", "prev", "until", "continue")
OVERVIEW = """\
To find out why an element switches or does not:  goto {t}   then   why 1

{groups}

help COMMAND says how it is used, with an example. Elements count from 1.
An empty line repeats the last move when you type; in a script it does nothing.
Lines that begin with # are comments. NO_COLOR=1 gives plain text.
Ctrl-C stops a long move where it is."""


# --------------------------------------------------------------------------- marks
@dataclass(frozen=True)
class Marks:
    """Characters to draw with: yes, no, bar, a ribbon's states, a box, the active box."""

    truth: str
    bar: str
    ribbon: str
    box: str
    active: str


PLAIN = Marks("ny", ".#", "-#=+%o", "+-+|++", "+=+|++")
DRAWN = Marks("✗✓", "░█", "─▓═┼▒┄", "┌─┐│└┘", "╔═╗║╚╝")
COLOURS = ("34", "33", "35", "36", "32")  # of states
WORDS = {"true": "32", "false": "31", "fired": "1", "FIRED": "1", "error:": "1;31", "ACTIVE": "1"}


class Debugger(cmd.Cmd):
    r"""Reads commands and shows a session: ``Debugger(Session(model, rig, t_end)).run()``.

    Parameters
    ----------
    session : Session
        What is walked.
    title : str, optional
        Said by `run` before the titles of the model and the rig.
    stdin, stdout : text files, optional
        The terminal when left out. Commands that do not come from a terminal are echoed, so that a
        transcript reads well.

    Examples
    --------
    At a terminal ``Debugger(session).run()`` asks for commands. Here they come from a text:

    >>> import io
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> session = Session(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...                   Prescribed("0.15*sin(2*pi*t/25)"), 100.0)
    >>> print(Debugger(session).reply("print s1"))
    1.5
    >>> code = Debugger(session, stdin=io.StringIO("next\nquit\n")).run()
    GMS, 4 elements, published law; prescribed velocity, to t = 100 s
    help shows the commands, where shows everything, quit leaves.
    (t=0.0000 s) next
    row 12, t = 4.91276067 s, micro-step 1: v = 0.141608 m/s, F = 1.34657 N
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
        self.session, self.title, self.element = session, title, 0
        self.typed = stdin is None and sys.stdin is not None and sys.stdin.isatty()
        self.use_rawinput = self.typed
        self.coloured = (
            self.stdout.isatty()
            and not os.environ.get("NO_COLOR")
            and os.environ.get("TERM") != "dumb"
        )
        encoding = (getattr(self.stdout, "encoding", None) or "utf-8").lower()
        self.encoding = encoding
        self.marks = DRAWN if self.coloured and encoding.startswith("utf") else PLAIN
        self.last_move = ""
        self._new_prompt()

    # ------------------------------------------------------------------ the loop
    def run(self) -> int:
        """Greet, then read and answer until `quit` or the end of input.

        Returns
        -------
        int
            0, the exit code.
        """
        model, rig = self.session.model, self.session.rig
        if self.title:
            self.say(self.title)
        self.say(f"{model.title}; {rig.title}, to t = {self.session.t_end:g} s")
        self.say("help shows the commands, where shows everything, quit leaves.")
        while True:
            try:
                self.cmdloop()
            except KeyboardInterrupt:  # at the prompt
                self.say("\nquit leaves")
            else:
                return 0

    def precmd(self, line: str) -> str:
        """Echo a command that nobody typed."""
        if not self.typed:
            self.stdout.write("\n" if line == "EOF" else f"{line}\n")
        return line

    def postcmd(self, stop: bool, line: str) -> bool:  # noqa: ARG002 (the base's signature)
        """Say in the prompt where we are."""
        self._new_prompt()
        return stop

    def _new_prompt(self) -> None:
        session = self.session
        branch = f", branch {session.current}" if session.current else ""
        self.prompt = f"(t={session.here.t:.4f} s{branch}) "

    def onecmd(self, line: str) -> bool:
        """Do one command; a mistake is answered and never ends the session.

        Parameters
        ----------
        line : str
            As typed.

        Returns
        -------
        bool
            Whether to leave.
        """
        name, rest = ([*line.split(None, 1), "", ""])[:2]
        if not name:
            if not self.typed or not self.last_move:
                return False
            return self.onecmd(self.last_move)
        if name.startswith("#"):
            return False
        if name == "EOF":
            return True
        name = ALIASES.get(name, name)
        if name in MOVES:
            self.last_move = line
        try:
            if name not in COMMANDS:
                near = difflib.get_close_matches(name, COMMANDS, 1)
                hint = f"did you mean {near[0]}? " if near else ""
                raise SessionError(f"no command {name!r}; {hint}help lists them")
            return bool(getattr(self, f"do_{name}")(rest.strip()))
        except KeyboardInterrupt:
            self.say("stopped")
            self._show()
        except GMSError as error:
            self.say(f"error: {error}")
        except BrokenPipeError:
            raise
        except Exception as error:  # losing a session would be worse than an odd message
            self.say(f"error: {type(error).__name__}: {error}")
        return False

    def reply(self, line: str) -> str:
        """Return what a command answers, for scripts.

        Parameters
        ----------
        line : str
            A command.

        Returns
        -------
        str
            The answer without the last line break.
        """
        stdout, self.stdout = self.stdout, io.StringIO()
        try:
            self.onecmd(line)
            return self.stdout.getvalue().rstrip("\n")
        finally:
            self.stdout = stdout

    def say(self, text: str) -> None:
        """Write lines, none wider than the screen."""
        for line in text.split("\n"):
            for part in _wrapped(line):
                part = part.encode(self.encoding, "replace").decode(self.encoding)
                self.stdout.write(f"{self._painted(part)}\n")

    def _painted(self, line: str) -> str:
        if not self.coloured:
            return line
        states = [state.name for state in self.session.model.chart.states]
        codes = WORDS | {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(states)}
        words = "|".join(re.escape(word) for word in codes)
        return re.sub(
            rf"(?<!\w)({words})(?!\w)", lambda m: f"\x1b[{codes[m[0]]}m{m[0]}\x1b[0m", line
        )

    # ------------------------------------------------------------------ help and completion
    def do_help(self, arg: str) -> None:
        """Show the overview, or one command."""
        if not arg:
            groups: dict[str, list[str]] = {}
            for name, each in COMMANDS.items():
                short = f"{name} ({each.alias})" if each.alias else name
                groups.setdefault(each.group, []).append(short)
            lines = [f"  {group:<8}{'  '.join(names)}" for group, names in groups.items()]
            self.say(OVERVIEW.format(groups="\n".join(lines), **self._names()))
            return
        name = ALIASES.get(arg, arg)
        if name not in COMMANDS:
            raise SessionError(f"no command {arg!r}; help lists them")
        each = self.help_of(name)
        alias = f"   (short: {each.alias})" if each.alias else ""
        self.say(f"{each.usage}{alias}\n{each.says}")
        self.say("\n".join(f"  example: {example}" for example in each.examples))

    def help_of(self, name: str) -> Command:
        """Return what the help says of a command, with the names of this session.

        Parameters
        ----------
        name : str
            A command.

        Returns
        -------
        Command
            Without braces; an example that needs what the chart lacks is left out.
        """
        each, names = COMMANDS[name], self._names()
        examples = [
            example.format_map(names)
            for example in each.examples
            if all(field in (None, *names) for _, field, *_ in string.Formatter().parse(example))
        ]
        usage, says = each.usage.format_map(names), each.says.format_map(names)
        return Command(each.group, usage, says, tuple(examples), each.alias)

    def _names(self) -> dict[str, str]:
        """Return what stands for the braces of the help, as far as the chart has it."""
        session, chart = self.session, self.session.model.chart
        start, n = session.branch.raw(0)[0], min(2, session.model.n)
        names = {
            "t": f"{start + 0.25 * (session.t_end - start):.9g}",
            "n": str(n),
            "z": chart.variables[0],
            "numbered": ", ".join(f"{name}1" for name in chart.variables),
            "state": chart.states[0].name,
        }
        if "s" in chart.inputs:
            names["s"] = "s"
        if chart.transitions:
            names |= {"edge": chart.transitions[0].name, "state": chart.transitions[0].target}
        for each in session.why(n - 1):
            names.setdefault("leaving", each.edge.name)
        return names

    def _usage(self, name: str) -> str:
        each = self.help_of(name)
        return f"usage: {each.usage}, for example: {each.examples[-1]}"

    def _path(self, name: str, text: str) -> Path:
        if not text:
            raise SessionError(f"a file name is missing; {self._usage(name)}")
        return Path(text.strip("\"'")).expanduser()

    def completenames(self, text: str, *_: object) -> list[str]:
        """Complete a command."""
        return [name for name in COMMANDS if name.startswith(text)]

    def completedefault(self, *arguments: object) -> list[str]:
        """Complete an argument: edges, states, names, numbers, whatever the command takes."""
        text, line, begin = str(arguments[0]), str(arguments[1]), int(str(arguments[2]))
        name = line.split(None, 1)[0]
        words = self._words(ALIASES.get(name, name), line[:begin])
        return [word for word in words if word.startswith(text)]

    complete_help = completedefault

    def _words(self, name: str, before: str) -> Sequence[str]:
        chart, session = self.session.model.chart, self.session
        states, edges = self._states, self._edges
        elements = [str(i + 1) for i in range(session.model.n)]
        names = [*session.names, *(f"state({i})" for i in elements)]
        if before.endswith("="):
            return states
        match name:
            case "break":
                return [*KINDS, *edges, *states, "element", "if", "hits", *names]
            case "until" | "print" | "watch":
                return [*names, *states]
            case "poke":
                return [*(f"{u}{i}=" for u in (*chart.variables, "state") for i in elements), "v="]
            case "why":
                return [*elements, *edges]
            case "element":
                return elements
            case "help":
                return list(COMMANDS)
            case "branch" | "compare":
                return [str(i) for i in range(len(session.branches))]
            case "clear":
                return [*(str(i + 1) for i in range(len(session.breakpoints))), "all"]
            case "unwatch":
                return [*(str(i + 1) for i in range(len(session.watches))), "all"]
        return ()

    @property
    def _states(self) -> list[str]:
        return [state.name for state in self.session.model.chart.states]

    @property
    def _edges(self) -> list[str]:
        return [edge.name for edge in self.session.model.chart.transitions]

    # ------------------------------------------------------------------ moving
    def _ahead(self) -> None:
        """Refuse to go forward from the end."""
        branch = self.session.branch
        last = branch.between is None and branch.cursor + 1 == len(branch)
        if last and not branch.pull() and branch.outcome == "end":
            raise SessionError("this is the end of the run; go back first")

    def do_step(self, arg: str) -> None:
        """Go forward."""
        count = _count("step", arg)
        self._ahead()
        self.session.step(count)
        self._show()

    def do_back(self, arg: str) -> None:
        """Go back."""
        self.session.back(_count("back", arg))
        self._show()

    def do_next(self, arg: str) -> None:
        """Go to the next transition."""
        _nothing("next", arg)
        self._ahead()
        if self.session.next_transition().fired is None:
            self.say("no transition before the end")
        self._show()

    def do_prev(self, arg: str) -> None:
        """Go to the transition before."""
        _nothing("prev", arg)
        self.session.prev_transition()
        self._show()

    def do_goto(self, arg: str) -> None:
        """Go to a time."""
        try:
            t = float(arg.removesuffix("s"))
        except ValueError:
            raise SessionError(f"{arg!r} is no time; {self._usage('goto')}") from None
        try:
            self.session.goto(t)
        except KeyboardInterrupt:
            self.session.goto(self._last(self.session.branch))
            raise
        self._show()

    def do_until(self, arg: str) -> None:
        """Go to where a condition becomes true."""
        if not arg:
            raise SessionError(f"a condition is missing; {self._usage('until')}")
        condition, session, branch = self._with_states(arg), self.session, self.session.branch
        already = holds(session.parse(condition), session.values())
        self._ahead()
        start = branch.cursor, branch.between
        if not session.reaches(condition):
            if already:
                branch.cursor, branch.between = start
                self.say(
                    "it is true here already and does not become true again; until waits for "
                    "it to become true"
                )
            else:
                self.say("it does not become true before the end")
        self._show()

    def _with_states(self, condition: str) -> str:
        """Return a condition with the states' own capitals."""
        return re.sub(
            r"(\bstate\b\s*(?:\(\s*\d+\s*\)\s*)?[=!]=\s*)(\w+)",
            lambda found: found[1] + _spelt(found[2], self._states),
            condition,
        )

    def do_continue(self, arg: str) -> None:
        """Go to the next breakpoint."""
        _nothing("continue", arg)
        self._ahead()
        _, point = self.session.proceed()
        if point is None:
            self.say("no breakpoint hit" if self.session.breakpoints else "no breakpoint is set")
        else:
            number = self.session.breakpoints.index(point) + 1
            self.say(f"breakpoint {number}: {_described(point)}")
        self._show()

    def do_run(self, arg: str) -> None:
        """Compute to the end."""
        _nothing("run", arg)
        branch = self.session.branch
        branch.complete()
        self.say(f"branch {self.session.current}: {self._progress(branch)}")

    # ------------------------------------------------------------------ looking
    def _show(self) -> None:
        """Say where we are, after a move."""
        self.say(str(self.session.here))
        self._say_outcome()
        if self.session.watches:
            self.do_watch("")

    def _say_outcome(self) -> None:
        here, branch = self.session.here, self.session.branch
        if branch.outcome and here.row + 1 == len(branch) and not here.located:
            if branch.outcome == "end":
                self.say("  end of the run")
            else:
                reason = branch.outcome.partition("; the run up to there")[0]
                self.say(f"  the run cannot go on: {reason}")
                self.say("  go back, look, or poke something to go on in another branch")

    def do_where(self, arg: str) -> None:
        """Show everything."""
        _nothing("where", arg)
        session, here = self.session, self.session.here
        step = f", micro-step {here.microstep}" if here.microstep else ""
        self.say(f"t = {here.t:.9g} s, row {here.row}{step}, branch {session.current}")
        self.say(f"v = {here.v:.6g} m/s, x = {here.x:.6g} m, F = {here.F:.6g} N")
        self._say_outcome()
        wide = max(5, min(8, max(map(len, self._states))))
        self.say("  ".join(["  el", " ".join([f"{'state':<{wide}}", *self._heads()]), "edges"]))
        for i in range(session.model.n):
            lead = f"{'>' if i == self.element else ' '}{i + 1:>3}  "
            line = lead + " ".join([f"{_short(here.states[i], wide):<{wide}}", *self._cells(i)])
            marks = self._edge_marks(i)
            if len(line) + 2 + len(marks) <= WIDTH:
                self.say(f"{line}  {marks}")
            else:
                self.say(f"{line}\n      {marks}")
        no, yes = tuple(self.marks.truth)
        self.say(
            f"edges by priority, a mark a clause: {yes} true, {no} false, * just taken; see why"
        )
        self.say("\n".join(self._ribbons()))

    def _heads(self) -> list[str]:
        """Return the headings of a line of `where`, as wide as `_cells`."""
        chart = self.session.model.chart
        units = {name: chart.unit(name) for name in chart.variables}
        names = [f"{name} [{unit}]" if unit else name for name, unit in units.items()]
        heads = [f"{_short(name, 10):>10}" for name in names]
        if "s" in chart.inputs:
            heads += [f"{'s [m]':>9}", f"{_short(f'|{chart.variables[0]}|/s', 7):>7}"]
            if len(names) == 1:
                heads.append(" " * (BAR + 2))
        return [*heads, f"{'F_i [N]':>10}"]

    def _cells(self, i: int) -> list[str]:
        """Return an element's numbers: variables, threshold and ratio if it has one, force.

        A bar shows the ratio where further variables do not need its place.
        """
        session, here = self.session, self.session.here
        chart, values = session.model.chart, session.values()
        cells = [f"{values[f'{name}{i + 1}']:>10.4g}" for name in chart.variables]
        if "s" in chart.inputs:
            ratio = abs(here.z[i]) / here.s[i]
            shown = f"{ratio:.3f}" if ratio < 100 else f"{ratio:.1e}"
            cells += [f"{here.s[i]:>9.4g}", f"{shown:>7}"]
            if len(chart.variables) == 1:
                cells.append(self._bar(ratio))
        return [*cells, f"{here.F_elements[i]:>10.4g}"]

    def _bar(self, ratio: float) -> str:
        empty, full = tuple(self.marks.bar)
        filled = min(BAR, round(BAR * min(ratio, 1.0)))
        return f"[{full * filled}{empty * (BAR - filled)}{'>' if ratio > 1 else ']'}"

    def _edge_marks(self, i: int) -> str:
        return " ".join(
            f"{each.priority}:"
            + "".join(self.marks.truth[c.holds] if c.computable else " ?" for c in each.clauses)
            + ("*" if each.fired else "")
            for each in self.session.why(i)
        )

    def _ribbons(self) -> list[str]:
        """Return every element's states over time, and where we are."""
        session, branch = self.session, self.session.branch
        chart, n = session.model.chart, session.model.n
        start, end = branch.raw(0)[0], session.t_end
        wide = WIDTH - 6
        modes: list[tuple[int, ...] | None] = []
        for cell in range(wide):
            t = start + (end - start) * (cell + 0.5) / wide
            row = bisect_right(range(len(branch)), t, key=lambda r: branch.raw(r)[0]) - 1
            # The last row's states are known up to its time only.
            reached = row + 1 < len(branch) or branch.outcome == "end"
            modes.append(branch.raw(row)[3] if row >= 0 and reached else None)
        marks = self.marks.ribbon
        lines = [
            f" E{i + 1:<3} "
            + "".join(" " if mode is None else marks[mode[i] % len(marks)] for mode in modes)
            for i in range(n)
        ]
        now = min(wide - 1, int(wide * (session.here.t - start) / (end - start)))
        key = "  ".join(f"{marks[j % len(marks)]} {s.name}" for j, s in enumerate(chart.states))
        scale = f"{start:g} s"
        return [
            f"      {scale}{f'{end:g} s':>{wide - len(scale)}}",
            *(line.rstrip() for line in lines),
            f"      {' ' * now}^",
            f"      {key}  ^ now  (blank: not computed)",
        ]

    def do_why(self, arg: str) -> None:
        """Explain the guards of an element."""
        i, edge, words = self.element, "", arg.split()
        if words and words[0].isdigit():
            i = self._element("why", words.pop(0))
        if words:
            edge = _spelt(words.pop(0), self._edges)
            if edge not in self._edges or words:
                raise SessionError(
                    f"{' '.join([edge, *words])!r} is no edge; there are "
                    f"{', '.join(self._edges) or 'none'}; {self._usage('why')}"
                )
        found, branch = self.session.why(i, edge), self.session.branch
        self.say(str(found))
        if found.left and not edge and (branch.cursor + 1 < len(branch) or branch.pull()):
            which = "" if i == self.element else f" {i + 1}"
            self.say(f"step, then why{which}: the edges that leave {found.state}")

    def do_list(self, arg: str) -> None:
        """Draw the chart."""
        _nothing("list", arg)
        i, here, chart = self.element, self.session.here, self.session.model.chart
        found = {each.edge.name: each for each in self.session.why(i)}
        self.say(f"element {i + 1} of {self.session.model.n}: {chart.name}, t = {here.t:.9g} s")
        for state in chart.states:
            active = state.name == here.states[i]
            lines = [state.name + ("  ACTIVE" if active else "")]
            lines += [f"  d{name} = {text}" for name, text in state.flow.items()]
            self.say(
                "\n".join(
                    _boxed(
                        lines,
                        self.marks.active if active else self.marks.box,
                        "> " if active else "  ",
                    )
                )
            )
            for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
                each = found.get(edge.name)
                self.say(
                    f"     {priority} {edge.name} -> {edge.target}"
                    f"{'  FIRED' if each and each.fired else ''}"
                )
                asked = "" if each is None else _truths(each)
                self.say(f"         [{chart.guard_text(edge.name)}]{asked}")

    def do_log(self, arg: str) -> None:
        """Show the last transitions."""
        count, branch = _count("log", arg, 10), self.session.branch
        rows = branch.firing_rows(self.session.here.row + 1)
        if not rows:
            self.say("no transition up to here")
        for row in rows[-count:]:
            self.say(f"  t = {branch.raw(row)[0]:<12.9g} s  row {row:<5} {branch.fired(row)}")
        if len(rows) > count:
            self.say(f"  ({len(rows) - count} before these)")

    def do_print(self, arg: str) -> None:
        """Show a value."""
        if not arg:
            raise SessionError(f"an expression is missing; {self._usage('print')}")
        self.say(self._value(arg))

    def _value(self, text: str) -> str:
        if re.search(r"[<>]|==|\b(and|or|not|state)\b", text):
            return "true" if self._truth(text) else "false"
        return f"{self.session.watch(text):.9g}"

    def _truth(self, text: str) -> bool:
        tree = self.session.parse(self._with_states(text))
        try:
            return bool(evaluate(tree, self.session.values()))
        except (ArithmeticError, ValueError) as error:
            raise SessionError(f"{text!r} cannot be computed here: {error}") from None

    def do_watch(self, arg: str) -> None:
        """Add a watch, show all."""
        if arg:
            self._value(arg)  # refuses what cannot be read
            self.session.watches.append(arg)
        for number, text in enumerate(self.session.watches, start=1):
            try:
                value = self._value(text)
            except GMSError as error:
                value = str(error).partition("\n")[0]
            self.say(f"  watch {number}: {text} = {value}")
        if not self.session.watches:
            self.say("nothing is watched")

    def do_unwatch(self, arg: str) -> None:
        """Take watches away."""
        self._remove(self.session.watches, "unwatch", arg)
        self.do_watch("")

    def do_element(self, arg: str) -> None:
        """Choose an element."""
        self.element = self._element("element", arg)
        self.say(f"element {self.element + 1} is in {self.session.here.states[self.element]}")

    def _element(self, command: str, text: str) -> int:
        number = _whole(text, self.help_of(command).usage)
        if not 1 <= number <= self.session.model.n:
            raise SessionError(f"no element {number}; there are 1 to {self.session.model.n}")
        return number - 1

    # ------------------------------------------------------------------ breakpoints
    def do_break(self, arg: str) -> None:
        """Set a breakpoint."""
        if not arg:
            self.do_breaks("")
            return
        form = re.fullmatch(
            rf"(?:({'|'.join(KINDS)})\s+)?(\w+)(?:\s+(?:element\s+)?(\d+|all))?"
            r"(?:\s+if\s+(.+?))?(?:\s+hits\s+(\d+))?",
            arg,
        )
        if form is None:
            raise SessionError(f"{arg!r} is no breakpoint; {self._usage('break')}")
        kind, name, element, condition, hits = form.groups()
        states, edges = self._states, self._edges
        asked = {None: states + edges, "enter": states, "leave": states}.get(kind, edges)
        name = _spelt(name, asked)
        if name not in states + edges:
            raise SessionError(
                f"no edge or state {name!r}; edges: {', '.join(edges) or 'none'}; "
                f"states: {', '.join(states)}"
            )
        point = self.session.break_on(
            kind or ("enter" if name in states else "fires"),
            name,
            None if element in (None, "all") else self._element("break", element),
            self._with_states(condition or ""),
            _whole(hits, "hits K") if hits else 1,
        )
        self.say(f"breakpoint {len(self.session.breakpoints)}: {_described(point)}")

    def do_breaks(self, arg: str) -> None:
        """Show breakpoints."""
        _nothing("breaks", arg)
        for number, point in enumerate(self.session.breakpoints, start=1):
            self.say(f"  {number}  {_described(point)}; seen {point.seen}")
        if not self.session.breakpoints:
            self.say("no breakpoint is set")

    def do_clear(self, arg: str) -> None:
        """Take breakpoints away."""
        self._remove(self.session.breakpoints, "clear", arg)
        self.do_breaks("")

    def _remove(self, where: list[Breakpoint] | list[str], name: str, arg: str) -> None:
        if arg == "all":
            where.clear()
            return
        number = _whole(arg, COMMANDS[name].usage)
        if not 1 <= number <= len(where):
            raise SessionError(f"there is no number {number}; there are {len(where)}")
        del where[number - 1]

    # ------------------------------------------------------------------ branches
    def do_poke(self, arg: str) -> None:
        """Change values in a new branch."""
        variables: dict[str, dict[int, float]] = {}
        states: dict[int, str] = {}
        v: float | None = None
        for part in re.sub(r"\s*=\s*", "=", arg).split():
            name, _, value = part.partition("=")
            if name == "v" and value:
                v = self.session.watch(value)
                continue
            what, i = self._pokeable(name)
            if not what and name in parameter_names(self.session.model):
                raise SessionError(
                    f"{name} is a parameter; for another value start a session with another model"
                )
            if not value or not what:
                raise SessionError(f"{part!r} cannot be poked; {self._usage('poke')}")
            if what == "state":
                states[i] = _spelt(value, self._states)
            else:
                variables.setdefault(what, {})[i] = self.session.watch(value)
        parent = self.session.current
        number = self.session.poke(variables, v, states)
        self.say(f"branch {number}, from branch {parent}: {self._edits(self.session.branch)}")
        self._show()

    def _pokeable(self, name: str) -> tuple[str, int]:
        """Return variable (or 'state') and element; an empty text for another name."""
        known = (*self.session.model.chart.variables, "state")
        form = re.fullmatch(rf"({'|'.join(map(re.escape, known))})(\d*)", name)
        if form is None:
            return "", 0
        if form[2]:
            return form[1], self._element("poke", form[2])
        if self.session.model.n > 1:
            raise SessionError(f"{name!r} cannot be poked; for element 1 write {name}1")
        return form[1], 0

    @staticmethod
    def _edits(branch: Branch) -> str:
        edits = branch.edits
        parts = [
            f"{name}{i + 1} = {value:.6g}"
            for name, values in edits.get("variables", {}).items()
            for i, value in values.items()
        ]
        if edits.get("v") is not None:
            parts.append(f"v = {edits['v']:.6g}")
        parts += [f"state {i + 1} = {name}" for i, name in edits.get("state", {}).items()]
        return ", ".join(parts)

    @staticmethod
    def _last(branch: Branch) -> float:
        return branch.raw(len(branch) - 1)[0]

    def _progress(self, branch: Branch) -> str:
        how = {"": "not at its end", "end": "at its end"}.get(branch.outcome, "it cannot go on")
        return (
            f"{len(branch)} rows, {len(branch.log())} transitions, computed to "
            f"t = {self._last(branch):.9g} s; {how}"
        )

    def do_branches(self, arg: str) -> None:
        """Show branches."""
        _nothing("branches", arg)
        for number, branch in enumerate(self.session.branches):
            mark = ">" if number == self.session.current else " "
            self.say(f"{mark} {number}  {self._progress(branch)}")
            if branch.parent is not None:
                t = branch.raw(branch.fork + 1)[0]
                self.say(
                    f"     from branch {branch.parent} at t = {t:.9g} s: {self._edits(branch)}"
                )

    def do_branch(self, arg: str) -> None:
        """Walk another branch."""
        self.session.switch(_whole(arg, "branch N"))
        self.say(f"branch {self.session.current}")
        self._show()

    def do_compare(self, arg: str) -> None:
        """Compare branches."""
        numbers = [_whole(text, "compare A B") for text in arg.split()]
        if len(numbers) not in (0, 2):
            raise SessionError(f"two branches are needed; {self._usage('compare')}")
        self.say(str(self.session.compare(*numbers)))

    def do_plot(self, arg: str) -> None:
        """Draw branches."""
        path = self._path("plot", arg)
        if path.suffix not in (".png", ".svg", ".pdf"):
            raise SessionError(f"{arg!r} must end in .png, .svg or .pdf")
        from plots import figures

        runs = {}
        for number, branch in enumerate(self.session.branches):
            branch.complete()
            trace = branch.trace()
            if not trace.t[-1] > trace.t[0]:
                raise SessionError(f"branch {number} failed at once; there is nothing to draw")
            edits = f": {self._edits(branch)}" if branch.edits else ""
            runs[_short(f"branch {number}{edits}", 50)] = trace
        self.say(f"written to {figures.save(figures.compare_laws(runs), path)}")

    def do_save(self, arg: str) -> None:
        """Write the session."""
        self.say(f"written to {self.session.save(self._path('save', arg))}")

    def do_load(self, arg: str) -> None:
        """Read a session."""
        self.session = Session.load(self._path("load", arg))
        self.element = min(self.element, self.session.model.n - 1)
        self.say(f"{self.session.model.title}, {len(self.session.branches)} branches")
        self._show()

    def do_quit(self, arg: str) -> bool:
        """Leave."""
        _nothing("quit", arg)
        return True


# --------------------------------------------------------------------------- reading arguments
def _whole(text: str, usage: str) -> int:
    if not re.fullmatch(r"\d{1,9}", text):
        raise SessionError(f"{text!r} is no whole number; usage: {usage}")
    return int(text)


def _count(name: str, text: str, default: int = 1) -> int:
    count = _whole(text, COMMANDS[name].usage) if text else default
    if count < 1:
        raise SessionError(f"{name} {count} goes nowhere; usage: {COMMANDS[name].usage}")
    return count


def _nothing(name: str, arg: str) -> None:
    if arg:
        raise SessionError(f"{name} takes no argument, it got {arg!r}")


def _spelt(name: str, known: Iterable[str]) -> str:
    """Return the known name that is the same but for capitals; the name as it is if in doubt."""
    same = [each for each in known if each.casefold() == name.casefold()]
    return same[0] if len(same) == 1 else name


# --------------------------------------------------------------------------- wording
def _wrapped(line: str) -> Iterator[str]:
    if len(line) <= WIDTH:
        yield line.rstrip()
        return
    indent = " " * (len(line) - len(line.lstrip()) + 2)
    yield from textwrap.wrap(line, WIDTH, subsequent_indent=indent[:40])


def _short(text: str, wide: int) -> str:
    return text if len(text) <= wide else text[: wide - 1] + "~"


def _described(point: Breakpoint) -> str:
    who = "all elements" if point.element is None else f"element {point.element + 1}"
    condition = f", if {point.condition}" if point.condition else ""
    hits = f", from hit {point.hits} on" if point.hits > 1 else ""
    return f"{point.kind} {point.name}, {who}{condition}{hits}"


def _truths(each: Explanation) -> str:
    return "  " + " ".join("true" if clause.holds else "false" for clause in each.clauses)


def _boxed(lines: Sequence[str], box: str, lead: str) -> Iterator[str]:
    left, across, right, side, low_left, low_right = tuple(box)
    lines = [_short(line, WIDTH - 8) for line in lines]
    wide = max(30, *(len(line) for line in lines)) + 2
    yield f"  {left}{across * wide}{right}"
    for number, line in enumerate(lines):
        yield f"{'  ' if number else lead}{side} {line:<{wide - 1}}{side}"
    yield f"  {low_left}{across * wide}{low_right}"


def scenario_to_debug(path: str | Path, overrides: Sequence[str] = ()) -> Loaded:
    """Read the scenario that ``gms-fsm debug`` is given; say where another file belongs.

    Parameters
    ----------
    path : str or Path
        A TOML file.
    overrides : sequence of str
        See `gms_fsm.app.scenario.load_scenario`.

    Returns
    -------
    Loaded
        For `run_debugger`.

    Raises
    ------
    ScenarioError
        If it is a trace, a Python file, or no valid scenario.

    Examples
    --------
    >>> scenario_to_debug("t.npz")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    gms_fsm.errors.ScenarioError: t.npz is a trace; `gms-fsm replay t.npz` steps through it; ...
    """
    match Path(path).suffix.lower():
        case ".py":
            raise ScenarioError(
                f"{path} is Python; debug takes a scenario (.toml); for a model of your own: "
                "Debugger(Session(model, rig, t_end)).run(), see docs/howto/debugging.md"
            )
        case ".npz" | ".csv":
            raise ScenarioError(
                f"{path} is a trace; `gms-fsm replay {path}` steps through it; debug takes a "
                "scenario (.toml)"
            )
    return load_scenario(path, overrides)


def run_debugger(loaded: Loaded, stdin: TextIO | None = None, stdout: TextIO | None = None) -> int:
    """Open a scenario in the debugger.

    Parameters
    ----------
    loaded : Loaded
        From `gms_fsm.app.scenario.load_scenario`. Wanted times are left out: a session stops at
        every row.
    stdin, stdout : text files, optional
        The terminal when left out.

    Returns
    -------
    int
        Exit code: 0 at `quit` and at the end of input.

    Raises
    ------
    ScenarioError
        If the scenario's run cannot be set up.
    """
    not_here = ("t_eval", "monitors")
    options = {name: value for name, value in loaded.arguments.items() if name not in not_here}
    try:
        session = Session(loaded.model, loaded.rig, options.pop("t_end"), **options)
    except GMSError as error:
        raise ScenarioError(f"{loaded.path}: {error}") from None
    return Debugger(session, loaded.title, stdin, stdout).run()
