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
import sys
import textwrap
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from gms_fsm.errors import GMSError, ScenarioError, SessionError
from gms_fsm.explain import Clause, Explanation
from gms_fsm.expression import evaluate
from gms_fsm.scenario import Loaded
from gms_fsm.session import KINDS, Branch, Breakpoint, Session

__all__ = ["Debugger", "run_debugger"]

WIDTH = 80
BAR = 8  # characters of |z|/s = 1
ROUNDING = 1e-8  # a margin this small beside both sides is the clock's and the floats', not physics
UNITS = {"t": "s", "x": "m", "v": "m/s", "v_c": "m/s", "z": "m", "s": "m"}


# --------------------------------------------------------------------------- the commands
@dataclass(frozen=True)
class Command:
    """What the help says of a command."""

    group: str
    usage: str
    says: str
    examples: tuple[str, ...]
    alias: str = ""


COMMANDS = {
    "where": Command(
        "look", "where",
        "Everything on one screen: each element's state, z, s, |z|/s, force, and its edges by "
        "priority with a mark a clause; below, the states over time.",
        ("where",), "w",
    ),
    "why": Command(
        "look", "why [ELEMENT]",
        "Say why the edges of an element fire or do not, clause by clause: both sides, the margin "
        "(negative: on the false side), and the truth.",
        ("why", "why 2"),
    ),
    "list": Command(
        "look", "list",
        "Draw the current element's chart: the active state and the guards that are asked.",
        ("list",), "l",
    ),
    "log": Command("look", "log [N]", "The last N transitions (10) up to here.", ("log 4",)),
    "print": Command(
        "look", "print EXPRESSION",
        "The value of an expression or the truth of a condition. Names: t, x, v, F, s, and with an "
        "element's number z1, s1, F1, state(1).",
        ("print z1 / s1", "p state(2) == slip"), "p",
    ),
    "watch": Command(
        "look", "watch [EXPRESSION]",
        "Show an expression after every move; alone, show all watches.", ("watch abs(z1) / s1",),
    ),
    "unwatch": Command("look", "unwatch N|all", "Take a watch away.", ("unwatch 1",)),
    "element": Command(
        "look", "element N",
        "Choose the element that list and why show; counted from 1.", ("element 2",),
    ),
    "step": Command(
        "move", "step [N]",
        "Go forward N rows (1). The firings of one time are rows of their own.",
        ("step", "s 10"), "s",
    ),
    "back": Command("move", "back [N]", "Go back N rows (1).", ("back 10",)),
    "next": Command("move", "next", "Go forward to the next transition.", ("next",), "n"),
    "prev": Command("move", "prev", "Go back to the transition before.", ("prev",)),
    "goto": Command(
        "move", "goto T", "Go to the last row at or before a time, in seconds.", ("goto 25",)
    ),
    "until": Command(
        "move", "until CONDITION",
        "Go forward to where a condition next becomes true, also between two rows.",
        ("until abs(z1) > 0.3", "u state(2) == slip and v < 0"), "u",
    ),
    "continue": Command(
        "move", "continue", "Go forward to the next breakpoint that hits, or the end.",
        ("continue",), "c",
    ),
    "break": Command(
        "stop", "break [tested|valid|fires] EDGE [element N] [if CONDITION] [hits K], or "
        "break [enter|leave] STATE ...",
        "Let continue stop where an edge's guard is asked (tested), becomes true (valid), or where "
        "it is taken (fires, also if left out); where a state is entered (also if left out) or "
        "left. The condition is looked at after the event; K: stop from the K-th hit on. Alone, "
        "show all breakpoints.",
        ("break fires break_away_backward element 2", "b enter slip if v < 0 hits 3"), "b",
    ),
    "breaks": Command("stop", "breaks", "Show all breakpoints and their hits.", ("breaks",)),
    "clear": Command("stop", "clear N|all", "Take a breakpoint away.", ("clear 1",)),
    "poke": Command(
        "change", "poke z1=VALUE v=VALUE state1=STATE ...",
        "Change values here and go on in a new branch; the present one stays as it is. A value can "
        "be an expression without blanks. v only where the rig has a mass.",
        ("poke z1=-0.3", "poke z2=0.9*s2 state2=stick"),
    ),
    "run": Command("change", "run", "Compute this branch to its end; stay here.", ("run",)),
    "branches": Command("change", "branches", "Show all branches.", ("branches",)),
    "branch": Command("change", "branch N", "Walk another branch.", ("branch 0",)),
    "compare": Command(
        "change", "compare [A B]",
        "Compare two branches as far as both are computed; alone, this one and its parent.",
        ("compare 0 1",),
    ),
    "plot": Command(
        "change", "plot FILE.png",
        "Draw the branches against each other (.png, .svg or .pdf; needs matplotlib).",
        ("plot branches.png",),
    ),
    "save": Command("file", "save FILE", "Write the session to a file.", ("save mine.json",)),
    "load": Command("file", "load FILE", "Go on with a session from a file.", ("load mine.json",)),
    "help": Command("file", "help [COMMAND]", "Show what there is.", ("help break",), "h"),
    "quit": Command("file", "quit", "Leave.", ("quit",), "q"),
}  # fmt: skip
ALIASES = {each.alias: name for name, each in COMMANDS.items() if each.alias} | {"?": "help"}
MOVES = ("step", "back", "next", "prev", "until", "continue")
OVERVIEW = """\
To find out why an element switches or does not:  goto 25   then   why 1

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
    """Reads commands and shows a session.

    Parameters
    ----------
    session : Session
        What is walked.
    title : str
        Said at the start.
    stdin, stdout : text files, optional
        The terminal when left out. Commands that do not come from a terminal are echoed, so that a
        transcript reads well.

    Examples
    --------
    >>> import io
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> session = Session(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...                   Prescribed("0.15*sin(2*pi*t/25)"), 100.0)
    >>> print(Debugger(session).reply("print s1"))
    1.5
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
        """Read and answer until `quit` or the end of input.

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
            self.say(OVERVIEW.format(groups="\n".join(lines)))
            return
        name = ALIASES.get(arg, arg)
        if name not in COMMANDS:
            raise SessionError(f"no command {arg!r}; help lists them")
        each = COMMANDS[name]
        alias = f"   (short: {each.alias})" if each.alias else ""
        self.say(f"{each.usage}{alias}\n{each.says}")
        self.say("\n".join(f"  example: {example}" for example in each.examples))

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
        states = [state.name for state in chart.states]
        elements = [str(i + 1) for i in range(session.model.n)]
        names = [*session.names, *(f"state({i})" for i in elements)]
        if before.endswith("="):
            return states
        match name:
            case "break":
                edges = [edge.name for edge in chart.transitions]
                return [*KINDS, *edges, *states, "element", "if", "hits", *names]
            case "until" | "print" | "watch":
                return [*names, *states]
            case "poke":
                return [
                    *(f"{u}{i}=" for u in (chart.variables[0], "state") for i in elements),
                    "v=",
                ]
            case "why" | "element":
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

    # ------------------------------------------------------------------ moving
    def do_step(self, arg: str) -> None:
        """Go forward."""
        self.session.step(_count("step", arg))
        self._show()

    def do_back(self, arg: str) -> None:
        """Go back."""
        self.session.back(_count("back", arg))
        self._show()

    def do_next(self, arg: str) -> None:
        """Go to the next transition."""
        _nothing("next", arg)
        self.session.next_transition()
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
            raise SessionError(f"{arg!r} is no time; {_usage('goto')}") from None
        try:
            self.session.goto(t)
        except KeyboardInterrupt:
            self.session.goto(self._last(self.session.branch))
            raise
        self._show()

    def do_until(self, arg: str) -> None:
        """Go to where a condition becomes true."""
        if not arg:
            raise SessionError(f"a condition is missing; {_usage('until')}")
        here = self.session.until(arg)
        if not here.located and not self._truth(arg):
            self.say("it does not become true before the end")
        self._show()

    def do_continue(self, arg: str) -> None:
        """Go to the next breakpoint."""
        _nothing("continue", arg)
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
        while branch.pull():
            pass
        self.say(f"branch {self.session.current}: {self._progress(branch)}")

    # ------------------------------------------------------------------ looking
    def _show(self) -> None:
        """Say where we are, after a move."""
        here, branch = self.session.here, self.session.branch
        place = f"between rows {here.row} and {here.row + 1}" if here.located else f"row {here.row}"
        step = f", micro-step {here.microstep}" if here.microstep else ""
        self.say(f"{place}, t = {here.t:.9g} s{step}: v = {here.v:.6g} m/s, F = {here.F:.6g} N")
        if here.microstep:
            _, i, edge, source, target = branch.fired(here.row)[:5]
            self.say(f"  element {i + 1}: {source} -> {target} by {edge}")
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
        names = [state.name for state in session.model.chart.states]
        wide = max(5, min(8, max(map(len, names))))
        bar = " " * (BAR + 2)
        head = (
            f"  el  {'state':<{wide}} {'z [m]':>10} {'s [m]':>9} {'|z|/s':>7} {bar} {'F_i [N]':>10}"
        )
        self.say(f"{head}  edges")
        for i in range(session.model.n):
            z, s = here.z[i], here.s[i]
            ratio = abs(z) / s
            shown = f"{ratio:.3f}" if ratio < 100 else f"{ratio:.1e}"
            line = (
                f"{'>' if i == self.element else ' '}{i + 1:>3}  "
                f"{_short(here.states[i], wide):<{wide}} {z:>10.4g} {s:>9.4g} {shown:>7} "
                f"{self._bar(ratio)} {here.F_elements[i]:>10.4g}  "
            )
            self.say(_short(line + self._edge_marks(i), WIDTH))
        no, yes = tuple(self.marks.truth)
        self.say(
            f"edges by priority, a mark a clause: {yes} true, {no} false, * just taken; see why"
        )
        self.say("\n".join(self._ribbons()))

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
        i = self._element(arg) if arg else self.element
        here, found = self.session.here, self.session.why(i)
        fired = next((each for each in found if each.fired), None)
        self.say(f"element {i + 1} is in {here.states[i]} at t = {here.t:.9g} s")
        if fired is not None:
            self.say(f"it has just left {fired.edge.source}; values are those before that")
        if not found:
            self.say("no edge leaves this state")
        holding = next((each for each in found if each.holds), None)
        for each in found:
            self.say(_verdict(each, fired, holding))
        for each in found:
            self.say(
                f"  {each.priority} {each.edge.name}: {each.edge.source} -> {each.edge.target}"
            )
            wide = max(len(clause.text) for clause in each.clauses)
            for clause in each.clauses:
                self.say(f"    {'true ' if clause.holds else 'false'}  {clause.text:<{wide}}"
                         f"{_sides(clause)}")  # fmt: skip

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
            self.say("\n".join(_boxed(lines, self.marks.active if active else self.marks.box,
                                      "> " if active else "  ")))  # fmt: skip
            for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
                each = found.get(edge.name)
                self.say(f"     {priority} {edge.name} -> {edge.target}"
                         f"{'  FIRED' if each and each.fired else ''}")  # fmt: skip
                asked = "" if each is None else _truths(each)
                self.say(f"         [{chart.guard_text(edge.name)}]{asked}")

    def do_log(self, arg: str) -> None:
        """Show the last transitions."""
        count, branch = _count("log", arg, 10), self.session.branch
        rows = branch.firing_rows(self.session.here.row + 1)
        if not rows:
            self.say("no transition up to here")
        for row in rows[-count:]:
            t, i, edge, source, target = branch.fired(row)[:5]
            self.say(f"  t = {t:<12.9g} s  row {row:<5} element {i + 1:<3} {source} -> {target} "
                     f"by {edge}")  # fmt: skip
        if len(rows) > count:
            self.say(f"  ({len(rows) - count} before these)")

    def do_print(self, arg: str) -> None:
        """Show a value."""
        if not arg:
            raise SessionError(f"an expression is missing; {_usage('print')}")
        self.say(self._value(arg))

    def _value(self, text: str) -> str:
        if re.search(r"[<>]|==|\b(and|or|not|state)\b", text):
            return "true" if self._truth(text) else "false"
        return f"{self.session.watch(text):.9g}"

    def _truth(self, text: str) -> bool:
        tree = self.session.parse(text)
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
        self.element = self._element(arg)
        self.say(f"element {self.element + 1} is in {self.session.here.states[self.element]}")

    def _element(self, text: str) -> int:
        number = _whole(text, "element N")
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
            raise SessionError(f"{arg!r} is no breakpoint; {_usage('break')}")
        kind, name, element, condition, hits = form.groups()
        states = [state.name for state in self.session.model.chart.states]
        edges = [edge.name for edge in self.session.model.chart.transitions]
        if name not in (*states, *edges):
            raise SessionError(
                f"no edge or state {name!r}; edges: {', '.join(edges) or 'none'}; "
                f"states: {', '.join(states)}"
            )
        point = self.session.break_on(
            kind or ("enter" if name in states else "fires"), name,
            None if element in (None, "all") else self._element(element),
            condition or "", _whole(hits, "hits K") if hits else 1,
        )  # fmt: skip
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
        variable = self.session.model.chart.variables[0]
        z: dict[int, float] = {}
        states: dict[int, str] = {}
        v: float | None = None
        for part in re.sub(r"\s*=\s*", "=", arg).split():
            name, equals, value = part.partition("=")
            form = re.fullmatch(rf"({re.escape(variable)}|state)(\d+)", name)
            if not equals or not value or (form is None and name != "v"):
                raise SessionError(f"{part!r} cannot be poked; {_usage('poke')}")
            if form is None:
                v = self.session.watch(value)
            elif form[1] == variable:
                z[self._element(form[2])] = self.session.watch(value)
            else:
                states[self._element(form[2])] = value
        parent = self.session.current
        number = self.session.poke(z, v, states)
        self.say(f"branch {number}, from branch {parent}: {self._edits(self.session.branch)}")
        self._show()

    def _edits(self, branch: Branch) -> str:
        edits, variable = branch.edits, self.session.model.chart.variables[0]
        parts = [f"{variable}{i + 1} = {value:.6g}" for i, value in edits.get("z", {}).items()]
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
        if arg:
            numbers = [_whole(text, "compare A B") for text in arg.split()]
            if len(numbers) != 2:
                raise SessionError(f"two branches are needed; {_usage('compare')}")
            a, b = numbers
        else:
            parent = self.session.branch.parent
            if parent is None:
                raise SessionError(f"branch 0 has no parent; {_usage('compare')}")
            a, b = parent, self.session.current
        found = self.session.compare(a, b)
        p, q = found.transitions
        self.say(f"branches {a} and {b} until t = {found.t:.9g} s: {p} and {q} transitions")
        if found.first_difference is None:
            self.say("  the same transitions")
        else:
            self.say(f"  first different transition at t = {found.first_difference:.9g} s")
        self.say(f"  largest difference: z {found.z:.3g} m, F {found.F:.3g} N")
        for number in (a, b):
            if not self.session.branches[number].outcome:
                self.say(f"  branch {number} is not at its end; there, run computes the rest")

    def do_plot(self, arg: str) -> None:
        """Draw branches."""
        path = _path("plot", arg)
        if path.suffix not in (".png", ".svg", ".pdf"):
            raise SessionError(f"{arg!r} must end in .png, .svg or .pdf")
        from plots import figures

        runs = {}
        for number, branch in enumerate(self.session.branches):
            trace = branch.trace()
            if not trace.t[-1] > trace.t[0]:
                raise SessionError(f"branch {number} has no stretch of time yet; run computes it")
            edits = f": {self._edits(branch)}" if branch.edits else ""
            runs[_short(f"branch {number}{edits}", 50)] = trace
        self.say(f"written to {figures.save(figures.compare_laws(runs), path)}")

    def do_save(self, arg: str) -> None:
        """Write the session."""
        self.say(f"written to {self.session.save(_path('save', arg))}")

    def do_load(self, arg: str) -> None:
        """Read a session."""
        self.session = Session.load(_path("load", arg))
        self.element = min(self.element, self.session.model.n - 1)
        self.say(f"{self.session.model.title}, {len(self.session.branches)} branches")
        self._show()

    def do_quit(self, arg: str) -> bool:
        """Leave."""
        _nothing("quit", arg)
        return True


# --------------------------------------------------------------------------- reading arguments
def _usage(name: str) -> str:
    each = COMMANDS[name]
    return f"usage: {each.usage}, for example: {each.examples[-1]}"


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


def _path(name: str, text: str) -> Path:
    if not text:
        raise SessionError(f"a file name is missing; {_usage(name)}")
    return Path(text.strip("\"'")).expanduser()


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


def _unit(clause: Clause) -> str:
    """Return the unit of a clause's margin where its names leave no doubt."""
    units = {UNITS.get(name, "?") for name in re.findall(r"[A-Za-z_]\w*", clause.text)}
    plain = not set(clause.text) & set("*/^()")
    return f" {units.pop()}" if plain and len(units) == 1 and "?" not in units else ""


def _sides(clause: Clause) -> str:
    if not clause.computable:
        return "  cannot be computed here"
    if clause.margin != clause.margin:  # compound: no two sides
        return ""
    return (
        f"  left {clause.left:<11.5g} right {clause.right:<11.5g} margin "
        f"{_amount(clause, signed=True)}"
    )


def _amount(clause: Clause, *, signed: bool) -> str:
    if abs(clause.margin) <= ROUNDING * max(abs(clause.left), abs(clause.right)):
        return "0 (rounding)"
    return f"{clause.margin if signed else abs(clause.margin):{'+' if signed else ''}.3g}" + _unit(
        clause
    )


def _verdict(each: Explanation, fired: Explanation | None, holding: Explanation | None) -> str:
    """Say in one sentence why an edge fires or does not."""
    name = each.edge.name
    if each.fired:
        return f"{name} fired here: every clause was true."
    if each.holds:
        other = fired or holding
        if other is not None and other is not each:
            return f"{name} does not fire: its guard is true, but {other.edge.name} goes first."
        return f"{name} fires next: every clause is true."
    parts = []
    for clause in each.clauses:
        if not clause.holds:
            by = "" if clause.margin != clause.margin else f" by {_amount(clause, signed=False)}"
            parts.append(f"{clause.text} is false{by}")
    return f"{name} {'did' if fired else 'does'} not fire: {' and '.join(parts)}."


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


def run_debugger(loaded: Loaded, stdin: TextIO | None = None, stdout: TextIO | None = None) -> int:
    """Open a scenario in the debugger.

    Parameters
    ----------
    loaded : Loaded
        From `gms_fsm.scenario.load_scenario`. Wanted times are left out: a session stops at every
        row.
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
