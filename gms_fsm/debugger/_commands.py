"""The commands of the debugger: each parses its argument, acts on the session and answers in lines.

A command yields its lines as they are produced, so an interruption does not lose earlier lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from gms_fsm.debugger import _text as text_of
from gms_fsm.debugger._elements import Elements, completions, integer, read_edits, spelled
from gms_fsm.debugger._help import ALIASES, COMMANDS, MOVES, help_of, overview
from gms_fsm.debugger._over_time import events, ribbons
from gms_fsm.debugger._script import command_of, count_of, nothing, remove, script_lines
from gms_fsm.debugger._view import branches, chart_states, ending, view
from gms_fsm.errors import ExpressionError, GMSError, SessionError
from gms_fsm.foundation.arguments import meant, there_are
from gms_fsm.foundation.quantities import WIDTH, in_words
from gms_fsm.language import EVENT, evaluate
from gms_fsm.session.coverage import coverage
from gms_fsm.session.explain import holds
from gms_fsm.session.session import KINDS, Breakpoint, Session
from gms_fsm.traces.system_scope import asked_unit, in_si, units_of


class Commands:
    """Commands on a session.

    Parameters
    ----------
    session : Session
        The session.
    marks : Marks
        Drawing characters.
    width : int
        Columns of tables and pictures.
    follow : bool
        Whether a step to a firing chooses the element that fired.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> session = Session(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...                   Prescribed("0.15"), 1.0)
    >>> list(Commands(session).answer("print", "s1"))
    ['400 mm']
    """

    def __init__(
        self,
        session: Session,
        marks: text_of.Marks = text_of.PLAIN,
        width: int = WIDTH,
        *,
        follow: bool = False,
    ) -> None:
        self.follow = follow
        self.session, self.marks, self.width, self.element = session, marks, width, 0
        self.last_move = ""  # the line that moved last, which an empty line repeats
        self.left = False  # whether the last line was `quit`
        self.refused = 0  # lines that were answered by an error
        self.hit: Breakpoint | None = None  # where `continue` stopped last
        self.sourced: list[Path] = []  # the files of commands that are being read

    def reply(self, line: str) -> Iterator[str]:
        """Execute a line as a person types it; a mistake is answered and changes nothing."""
        (name, rest), self.left = command_of(line), False
        if not name:
            return
        if name in MOVES:
            self.last_move = line
        try:
            yield from self.answer(name, rest)
        except KeyboardInterrupt:
            yield "stopped"
            yield from self.here()
        except GMSError as error:
            self.refused += 1
            yield f"error: {error}"
        except BrokenPipeError:
            raise
        except Exception as error:  # losing the session would be worse than an unclear message
            self.refused += 1
            yield f"error: {type(error).__name__}: {error}"

    def answer(self, name: str, arg: str) -> Iterator[str]:
        """Execute a command."""
        if name not in COMMANDS:
            near = _MEANT.get(name.removesuffix("()"), "")
            hint = f"did you mean {near!r}? " if near else meant(name, COMMANDS)
            hint += "help lists all commands"
            raise SessionError(f"there is no command {name!r}", advice=hint)
        yield from getattr(self, f"do_{name}")(arg)
        fired = self.session.here.fired
        if self.follow and name in MOVES and fired is not None:
            bank = self.session.start.program.layout.contact(fired.contact)
            self.element = bank.first + fired.element

    @property
    def prompt(self) -> str:
        """What stands in front of a command."""
        session = self.session
        branch = f", branch {session.current}" if session.current else ""
        return f"(t={session.here.t:.4f} s{branch}) "

    def complete(self, text: str, before: str = "") -> list[str]:
        """Return how a word can be completed."""
        typed = before.split(None, 1)
        words = self.words(ALIASES.get(typed[0], typed[0]), before) if typed else COMMANDS
        return [word for word in words if word.startswith(text)]

    def words(self, name: str, before: str) -> Sequence[str]:
        """Return the possible arguments of a command: edges, states, names, numbers."""
        session, states, edges = self.session, self.states, self._edges
        elements, inside, values = completions(session)
        names = [*session.names, *inside]
        if before.endswith("="):
            return states
        match name:
            case "break":
                return [*KINDS, *edges, *states, "element", "if", "hits", *names]
            case "until" | "print" | "watch":
                return [*names, *states]
            case "back":
                return ["until", "continue", *names, *states]
            case "poke":
                return [f"{name}=" for name in values]
            case "why":
                return [*elements, *edges]
            case "element":
                return elements
            case "help":
                return list(COMMANDS)
            case "branch" | "compare":
                return list(map(str, session.tree.forks))
            case "clear":
                return [*(str(i + 1) for i in range(len(session.breakpoints))), "all"]
            case "unwatch":
                return [*(str(i + 1) for i in range(len(session.watches))), "all"]
        return ()

    @property
    def states(self) -> list[str]:
        """Names of the states of all charts, composite ones among them."""
        charts = (contact.chart for contact in self.session.system.machines)
        return list(dict.fromkeys(path for chart in charts for path in chart.nesting.levels))

    @property
    def _edges(self) -> list[str]:
        charts = (contact.chart for contact in self.session.system.machines)
        return list(dict.fromkeys(edge.name for chart in charts for edge in chart.transitions))

    def _usage(self, name: str) -> str:
        each = help_of(name, self.session)
        return f"usage: {each.usage}, for example: {each.examples[-1]}"

    def _path(self, name: str, text: str) -> Path:
        if not text:
            raise SessionError("a file name is missing", advice=f"{self._usage(name)}")
        return Path(text.strip("\"'")).expanduser()

    # ------------------------------------------------------------------ help
    def do_help(self, arg: str) -> Iterator[str]:
        """Show the overview, or the help on one command."""
        if not arg:
            yield overview(self.session)
            return
        name = ALIASES.get(arg, arg)
        if name not in COMMANDS:
            raise SessionError(f"unknown command {arg!r}", advice="help lists all commands")
        each = help_of(name, self.session)
        alias = f"   (short: {each.alias})" if each.alias else ""
        yield f"{each.usage}{alias}\n{each.says}"
        yield "\n".join(f"  example: {example}" for example in each.examples)

    # ------------------------------------------------------------------ moving
    def _ahead(self) -> None:
        """Raise an error at the end of the run."""
        branch = self.session.branch
        last = branch.between is None and branch.cursor + 1 == len(branch)
        if last and not branch.pull() and branch.ended:
            raise SessionError("this is the end of the run", advice="go back first")

    def here(self) -> Iterator[str]:
        """Show the current position, after a move."""
        yield str(self.session.here)
        yield from text_of.ending_lines(ending(self.session))
        if self.session.watches:
            yield from self.do_watch("")

    def do_step(self, arg: str) -> Iterator[str]:
        """Go forward."""
        count = count_of("step", arg)
        self._ahead()
        self.session.step(count)
        yield from self.here()

    def do_back(self, arg: str) -> Iterator[str]:
        """Go back: by rows, to where a condition was true last, or to a breakpoint."""
        word, _, rest = arg.partition(" ")
        match ALIASES.get(word, word):
            case "until":
                yield from self._until(rest.strip(), back=True)
            case "continue":
                nothing("back continue", rest.strip())
                yield from self._continue(back=True)
            case _:
                self.session.back(count_of("back", arg))
                yield from self.here()

    def do_next(self, arg: str) -> Iterator[str]:
        """Go to the next transition."""
        nothing("next", arg)
        self._ahead()
        if self.session.next_transition().fired is None:
            yield "no transition before the end"
        yield from self.here()

    def do_prev(self, arg: str) -> Iterator[str]:
        """Go to the previous transition."""
        nothing("prev", arg)
        self.session.prev_transition()
        yield from self.here()

    def do_goto(self, arg: str) -> Iterator[str]:
        """Go to a time."""
        try:
            t = self.session.watch(in_si(self.session.start.what, arg, "t"))
        except ExpressionError:
            advice = f"{self._usage('goto')}; the run ends at {self.session.t_end:g} s"
            raise SessionError(f"{arg!r} is not a time", advice=advice) from None
        try:
            self.session.goto(t)
        except KeyboardInterrupt:
            self.session.goto(self.session.branch.last.t)
            raise
        if t > self.session.t_end:
            yield (
                f"the run ends at {self.session.t_end:g} s; of a scenario, "
                f"--set run.t_end={t:g} makes it longer"
            )
        yield from self.here()

    def do_until(self, arg: str) -> Iterator[str]:
        """Go to the next point where a condition becomes true."""
        yield from self._until(arg, back=False)

    def _until(self, arg: str, *, back: bool) -> Iterator[str]:
        if not arg:
            usage = self._usage("back" if back else "until")
            raise SessionError("a condition is missing", advice=usage)
        condition, session, branch = self._with_states(arg), self.session, self.session.branch
        already = holds(session.parse(condition), session.values())
        if not back:
            self._ahead()
        start = branch.cursor, branch.between
        if not session.reaches(condition, back=back):
            if already:
                branch.cursor, branch.between = start
                yield (
                    "it is true here and from the start on"
                    if back
                    else "it is already true here and does not become true again; until stops "
                    "where it becomes true"
                )
            else:
                never = (
                    "it was not true before" if back else "it does not become true before the end"
                )
                yield f"{never}{self._units_in(arg)}"
        yield from self.here()

    def _unit(self, name: str) -> str:
        """Return the unit of a name, empty if it is not known."""
        return units_of(self.session.start.what).get(name, "")

    def _units_in(self, text: str) -> str:
        """Return the units in which a text's numbers are read."""
        found = ((name, self._unit(name)) for name in re.findall(r"[^\W\d][\w.]*", text))
        units = ", ".join(f"{name} in {unit}" for name, unit in dict(found).items() if unit)
        return f" ({units}, unless a unit is given)" if units else ""

    def _with_states(self, condition: str) -> str:
        """Return a condition with the states spelled as in the chart."""
        condition = re.sub(r"\bstate(\d+)(?=\s*[=!]=)", r"state(\1)", condition)  # as in poke
        return re.sub(
            r"(\bstate\b\s*(?:\(\s*\d+\s*\)\s*)?[=!]=\s*)(\w+)",
            lambda found: found[1] + spelled(found[2], self.states),
            condition,
        )

    def do_continue(self, arg: str) -> Iterator[str]:
        """Go to the next breakpoint."""
        nothing("continue", arg)
        self._ahead()
        yield from self._continue(back=False)

    def _continue(self, *, back: bool) -> Iterator[str]:
        _, point = self.session.proceed(back=back)
        self.hit = point
        if point is None:
            yield "no breakpoint was hit" if self.session.breakpoints else "no breakpoint is set"
        else:
            number = self.session.breakpoints.index(point) + 1
            yield f"breakpoint {number}: {text_of.breakpoint_text(point)}"
        yield from self.here()

    def do_run(self, arg: str) -> Iterator[str]:
        """Compute to the end."""
        nothing("run", arg)
        self.session.branch.complete()
        current = next(each for each in branches(self.session) if each.current)
        yield f"branch {current.number}: {text_of.progress(current)}"

    # ------------------------------------------------------------------ looking
    def do_where(self, arg: str) -> Iterator[str]:
        """Show everything."""
        nothing("where", arg)
        seen = view(self.session)
        states = ribbons(self.session, text_of.ribbon_parts(seen, self.width))
        yield from text_of.screen_lines(seen, states, self.element, self.marks, self.width)

    def do_why(self, arg: str) -> Iterator[str]:
        """Explain the guards of an element."""
        words = arg.split()
        i, edge = self.elements.taken("why", words), ""
        if words:
            edge = spelled(words.pop(0), self._edges)
            if edge not in self._edges or words:
                raise SessionError(
                    f"{' '.join([edge, *words])!r} is not an edge",
                    advice=f"{there_are(edge, self._edges)}; {self._usage('why')}",
                )
        found, branch = self.session.why(self.elements.address(i), edge), self.session.branch
        yield str(found)
        if found.left and not edge and (branch.cursor + 1 < len(branch) or branch.pull()):
            which = "" if i == self.element else f" {self.elements.short(i)}"
            yield f"for the edges that leave {found.state}: step, then why{which}"

    def do_list(self, arg: str) -> Iterator[str]:
        """Draw the chart."""
        nothing("list", arg)
        session, elements = self.session, self.elements
        count, chart = elements.bank(self.element).n, elements.chart(self.element)
        yield f"{elements.name(self.element)} of {count}: {chart.name}, t = {session.here.t:.9g} s"
        states = chart_states(session, self.element)
        yield from text_of.chart_lines(states, self.marks, self.width)

    def do_log(self, arg: str) -> Iterator[str]:
        """Show the last transitions."""
        count, found = count_of("log", arg, 10), events(self.session)
        if not found:
            yield "no transition so far"
        for each in found[-count:]:
            yield f"  t = {each.t:<12.9g} s  row {each.row:<5} {each.fired}"
        if len(found) > count:
            yield f"  ({len(found) - count} earlier ones)"

    def do_trust(self, arg: str) -> Iterator[str]:
        """Show the findings about the branch."""
        nothing("trust", arg)
        yield from self.session.tree.trace().trust().text.splitlines()

    def do_coverage(self, arg: str) -> Iterator[str]:
        """Show what the branches have tried."""
        nothing("coverage", arg)
        yield from coverage(self.session).text.splitlines()

    def do_print(self, arg: str) -> Iterator[str]:
        """Show a value."""
        if not arg:
            raise SessionError("an expression is missing", advice=f"{self._usage('print')}")
        yield self._value(arg)

    def _value(self, text: str) -> str:
        if re.search(r"[<>]|==|\b(and|or|not|state)\b", text):
            return "true" if self._truth(text) else "false"
        asked, unit, size = asked_unit(self.session.start.what, text)
        value = self.session.watch(asked)
        return f"{value / size:.9g} {unit}" if unit else in_words(value, self._unit(asked), 9)

    def _truth(self, text: str) -> bool:
        tree = self.session.parse(self._with_states(text))
        try:
            return bool(evaluate(tree, self.session.values()))
        except (ArithmeticError, ValueError) as error:
            raise SessionError(f"{text!r} cannot be computed here: {error}") from None

    def do_watch(self, arg: str) -> Iterator[str]:
        """Add a watch, or show all."""
        if arg:
            self._value(arg)  # raises if it cannot be parsed
            self.session.watches.append(arg)
        for number, text in enumerate(self.session.watches, start=1):
            try:
                value = self._value(text)
            except GMSError as error:
                value = error.reason
            yield f"  watch {number}: {text} = {value}"
        if not self.session.watches:
            yield "no watch is set"

    def do_unwatch(self, arg: str) -> Iterator[str]:
        """Remove watches."""
        remove(self.session.watches, "unwatch", arg)
        yield from self.do_watch("")

    def do_element(self, arg: str) -> Iterator[str]:
        """Choose an element."""
        words = arg.split()
        found = self.elements.taken("element", words, needed=True)
        if words:
            raise SessionError(f"{arg!r} is not an element", advice=self._usage("element"))
        self.element = found
        branch = self.session.branch
        yield f"{self.elements.name(found)} is in {branch.state(branch.here, found)}"

    @property
    def elements(self) -> Elements:
        """The elements of the session, as they are written."""
        return Elements(self.session, self.element)

    # ------------------------------------------------------------------ breakpoints
    def do_break(self, arg: str) -> Iterator[str]:
        """Set a breakpoint."""
        if not arg:
            yield from self.do_breaks("")
            return
        if changes := re.fullmatch(r"changes\s+(.+?)(?:\s+if\s+(.+?))?(?:\s+hits\s+(\d+))?", arg):
            text, condition, hits = changes.groups()
            yield self._set("changes", self._with_states(text), None, condition, hits)
            return
        form = re.fullmatch(
            rf"(?:({'|'.join(KINDS)})\s+)?(\w[\w.]*)(?:\s+(?:element\s+)?({self.elements.pattern}))?"
            r"(?:\s+if\s+(.+?))?(?:\s+hits\s+(\d+))?",
            arg,
        )
        if form is None:
            usage = self._usage("break")
            if re.search("[<>]", arg):
                text = arg.removeprefix("if ")
                usage = (
                    f"until {text} goes there, break changes {text} stops where it changes; of a "
                    f"breakpoint, a condition follows if: {usage}"
                )
            raise SessionError(f"{arg!r} is not a breakpoint", advice=usage)
        kind, name, element, condition, hits = form.groups()
        states, edges = self.states, self._edges
        asked = {None: states + edges, "enter": states, "leave": states}.get(kind, edges)
        name = spelled(name, asked)
        if name not in states + edges:
            if arg == "changes":
                example = help_of("break", self.session).examples[1]
                raise SessionError("an expression is missing", advice=f"for example {example}")
            raise SessionError(
                f"there is no edge or state {name!r}",
                advice=f"{meant(name, states + edges)}edges: {', '.join(edges) or 'none'}; "
                f"states: {', '.join(states)}",
            )
        where = None if element in (None, "all") else self.elements.address_of("break", element)
        kind = kind or ("enter" if name in states else "fires")
        yield self._set(kind, name, where, condition, hits)

    def _set(
        self, kind: str, name: str, where: int | str | None, condition: str | None, hits: str | None
    ) -> str:
        """Set a breakpoint, and return what is said about it."""
        count = integer(hits, "hits K") if hits else 1
        condition = self._with_states(condition or "")
        point = self.session.break_on(kind, name, where, condition, count)
        return f"breakpoint {len(self.session.breakpoints)}: {text_of.breakpoint_text(point)}"

    def do_breaks(self, arg: str) -> Iterator[str]:
        """Show breakpoints."""
        nothing("breaks", arg)
        for number, point in enumerate(self.session.breakpoints, start=1):
            yield f"  {number}  {text_of.breakpoint_text(point)}; hits: {point.seen}"
        if not self.session.breakpoints:
            yield "no breakpoint is set"

    def do_clear(self, arg: str) -> Iterator[str]:
        """Remove breakpoints."""
        remove(self.session.breakpoints, "clear", arg)
        yield from self.do_breaks("")

    # ------------------------------------------------------------------ branches
    def do_poke(self, arg: str) -> Iterator[str]:
        """Change values in a new branch."""
        edits = read_edits(self.session, arg, self._usage("poke"), self.states)
        parent = self.session.current
        number = self.session.poke(edits.variables, edits.v, edits.state)
        yield f"branch {number}, from branch {parent}: {self.session.branch.edits}"
        yield from self.here()

    def do_send(self, arg: str) -> Iterator[str]:
        """Send an event in a new branch."""
        events = [name.removeprefix(EVENT) for name in self.session.system.events]
        if not events:
            yield "no machine here waits for events"
        elif not arg:
            raise SessionError("the name of an event is missing", advice=self._usage("send"))
        elif arg not in events:
            raise SessionError(f"there is no event {arg!r}", advice=there_are(arg, events))
        else:
            yield from self.do_poke(f"{arg}=1")

    def do_branches(self, arg: str) -> Iterator[str]:
        """Show branches."""
        nothing("branches", arg)
        yield from text_of.branch_lines(branches(self.session))

    def do_branch(self, arg: str) -> Iterator[str]:
        """Switch to another branch."""
        self.session.switch(integer(arg, "branch N"))
        yield f"branch {self.session.current}"
        yield from self.here()

    def do_compare(self, arg: str) -> Iterator[str]:
        """Compare branches."""
        numbers = [integer(text, "compare A B") for text in arg.split()]
        if len(numbers) not in (0, 2):
            raise SessionError("two branches are needed", advice=f"{self._usage('compare')}")
        yield str(self.session.compare(*numbers))

    def do_plot(self, arg: str) -> Iterator[str]:
        """Draw branches."""
        path = self._path("plot", arg)
        from plots.output import formats

        formats.chosen(path, "figure")  # check the file name before importing matplotlib
        from plots import figures

        runs = {}
        for number, fork in self.session.tree.forks.items():
            trace = self.session.tree.trace(number)
            if not trace.t[-1] > trace.t[0]:
                raise SessionError(
                    f"branch {number} failed immediately", advice="there is nothing to draw"
                )
            edits = f": {fork.changes}" if fork.changes else ""
            bank = self.elements.bank(self.element)
            if len(trace.contacts) > 1:
                trace = trace.contact(bank.name)
            runs[text_of.short(f"branch {number}{edits}", 50)] = trace
        yield f"written to {figures.save(figures.compare_laws(runs), path)}"

    # ------------------------------------------------------------------ files
    def do_save(self, arg: str) -> Iterator[str]:
        """Write the session."""
        yield f"written to {self.session.save(self._path('save', arg))}"

    def do_load(self, arg: str) -> Iterator[str]:
        """Read a session."""
        self.session = Session.load(self._path("load", arg))
        self.element = min(self.element, self.session.start.program.layout.n - 1)
        count = len(self.session.branches)
        yield f"{self.session.title}; {count} branch{'es' if count > 1 else ''}"
        yield from self.here()

    def do_source(self, arg: str) -> Iterator[str]:
        """Execute the commands in a file, up to the first error."""
        path = self._path("source", arg)
        if path.resolve() in self.sourced:
            raise SessionError("it is a file of commands that sources itself", place=str(path))
        self.sourced.append(path.resolve())
        try:
            for line in script_lines(path):
                yield f"{self.prompt}{line.text}"
                try:
                    yield from self.answer(line.name, line.rest)
                except GMSError as error:
                    raise error.inside(f"{path}, line {line.number}") from None
                if self.left:
                    return
        finally:
            self.sourced.pop()

    def do_quit(self, arg: str) -> Iterator[str]:
        """Do nothing: the interface ends the loop."""
        nothing("quit", arg)
        self.left = True
        yield from ()


_MEANT = {"delete": "clear", "switch": "branch", "exit": "quit", "quit": "quit", "help": "help"}
_MEANT |= dict.fromkeys(("info", "show", "state", "states"), "where") | {"fork": "poke"}
