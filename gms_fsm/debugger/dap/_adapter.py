"""The translation: requests of the Debug Adapter Protocol into commands of the debugger.

The adapter has no rules of its own. A frame is a row; the frames below it are the rows before it in
the same cascade. A request that moves is answered at once and done afterwards, so that it can be
interrupted.
"""

from __future__ import annotations

import functools
import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from gms_fsm.debugger._commands import Commands
from gms_fsm.debugger._help import COMMANDS
from gms_fsm.debugger._script import command_of
from gms_fsm.debugger._text import breakpoint_text
from gms_fsm.debugger._view import ending
from gms_fsm.debugger.dap._lines import TableLines, tables_of
from gms_fsm.debugger.dap._scopes import ShownScope, scopes_of
from gms_fsm.errors import GMSError, SessionError
from gms_fsm.foundation.arguments import unknown
from gms_fsm.session.results import Here
from gms_fsm.session.session import Breakpoint, Session

Arguments: TypeAlias = Mapping[str, Any]
Body: TypeAlias = dict[str, Any]

THREAD = 1  # the run is one thread, whatever its contacts
CAPABILITIES = (
    "supportsConfigurationDoneRequest",
    "supportsFunctionBreakpoints",
    "supportsConditionalBreakpoints",
    "supportsHitConditionalBreakpoints",
    "supportsEvaluateForHovers",
    "supportsStepBack",
    "supportsSetVariable",
    "supportsCompletionsRequest",
    "supportsTerminateRequest",
)
BEFORE = ("initialize", "launch", "disconnect", "terminate")  # requests that need no session


@dataclass(frozen=True)
class Launched:
    """What a launch request begins.

    Parameters
    ----------
    session : Session
        The session.
    title : str
        What runs.
    path : Path
        The file in which it is described.
    """

    session: Session
    title: str
    path: Path


class Adapter:
    """Answers requests, one after the other.

    Parameters
    ----------
    launch : callable
        Begins a session, given the arguments of the launch request.
    send : callable
        Sends an event, given its name and body.
    interrupted : callable
        Whether the client asks for a pause; asked at every row of a move.
    """

    def __init__(
        self,
        launch: Callable[[Arguments], Launched],
        send: Callable[[str, Body], None],
        interrupted: Callable[[], bool],
    ) -> None:
        self.launch, self.send, self.interrupted = launch, send, interrupted
        self.commands: Commands | None = None
        self.path = Path()  # the file that was launched
        self.tables: list[TableLines] = []
        self.scopes: list[tuple[int, ShownScope]] = []  # row and scope, by reference from 1
        self.points: dict[int, tuple[str, Breakpoint]] = {}  # by number: their source, or nothing
        self.given = 0  # numbers of breakpoints given so far
        self.first_line = self.first_column = 1  # the numbers that the client gives them
        self.entry: Arguments = {}
        self.over = False  # whether the client has been told that the run is over

    # ------------------------------------------------------------------ requests
    def answer(self, request: str, arguments: Arguments) -> tuple[Body, Callable[[], None] | None]:
        """Answer a request, and return what is to be done once the answer has been sent."""
        if request not in REQUESTS:
            raise unknown("request", request, REQUESTS, SessionError)
        if self.commands is None and request not in BEFORE:
            raise SessionError(f"{request} comes before launch", advice="launch a scenario first")
        found = REQUESTS[request](self, arguments)
        return found if isinstance(found, tuple) else (found or {}, None)

    def initialize(self, given: Arguments) -> Body:
        """Say what is supported."""
        self.first_line = int(given.get("linesStartAt1", True))
        self.first_column = int(given.get("columnsStartAt1", True))
        if given.get("pathFormat", "path") != "path":
            raise SessionError("paths are wanted, not URIs", place="pathFormat")
        return dict.fromkeys(CAPABILITIES, True)

    def launched(self, given: Arguments) -> tuple[Body, Callable[[], None]]:
        """Begin a session."""
        with self._noting():
            begun = self.launch(given)
        self.entry, self.path = given, begun.path
        self.tables = list(tables_of(begun.path))
        self.commands = Commands(begun.session, follow=True)
        self.output(f"{begun.title}\n{begun.session.title}")
        return {}, lambda: self.send("initialized", {})

    def configured(self, _: Arguments) -> tuple[Body, Callable[[], None]]:
        """Stop at the start, or run."""
        commands = self._commands
        if self.entry.get("noDebug"):

            def whole() -> None:
                self._say("run")
                self._end()

            return {}, whole
        if self.entry.get("stopOnEntry", True):
            self.output("\n".join(commands.here()))
            return {}, lambda: self._stopped("entry")
        return {}, lambda: self._move("continue", "pause")

    def threads(self, _: Arguments) -> Body:
        """Return the only thread."""
        return {"threads": [{"id": THREAD, "name": self._session.title}]}

    def disconnect(self, _: Arguments) -> Body:
        """Answer; the server ends."""
        return {}

    def terminate(self, _: Arguments) -> tuple[Body, Callable[[], None]]:
        """End the run."""
        return {}, self._end

    def pause(self, _: Arguments) -> Body:
        """Answer: a move was interrupted when the request arrived, before it came here."""
        return {}

    # ------------------------------------------------------------------ moves
    def resume(self, _: Arguments) -> tuple[Body, Callable[[], None]]:
        """Go to the next breakpoint; from the end of the run, end."""
        at_end = bool(ending(self._session))
        go = self._end if at_end else lambda: self._move("continue", "pause")
        return {"allThreadsContinued": True}, go

    def reverse(self, _: Arguments) -> tuple[Body, Callable[[], None]]:
        """Go back to the breakpoint before; if there is none, to the transition before."""
        line = "back continue" if self._session.breakpoints else "prev"
        return {}, lambda: self._move(line, "step")

    def stepping(self, line: str) -> tuple[Body, Callable[[], None]]:
        """Make a move of one command."""
        return {}, lambda: self._move(line, "step")

    def step_out(self, _: Arguments) -> tuple[Body, Callable[[], None]]:
        """Go to the last micro-step of this instant."""
        return self.stepping(f"goto {self._session.here.t!r}")

    def _move(self, line: str, reason: str) -> None:
        """Execute a command that moves, and say where it stopped."""
        commands = self._commands
        if not self._say(line):
            reason = "pause"
        if commands.hit is None:
            self._stopped(reason)
            return
        number, kind = next(
            (
                (number, "breakpoint" if source else "function breakpoint")
                for number, (source, point) in self.points.items()
                if point is commands.hit
            ),
            (0, "breakpoint"),  # set by a command
        )
        self._stopped(kind, breakpoint_text(commands.hit), [number] if number else [])

    def _say(self, line: str) -> bool:
        """Execute a command and print its answer; return whether it was not interrupted."""
        try:
            self.output("\n".join(self._answers(line)))
        except KeyboardInterrupt:
            self.output("stopped")
            return False
        except GMSError as error:
            self.output(str(error), "important")
        except Exception as error:  # a client that is told of no stop waits for ever
            self.output(f"{type(error).__name__}: {error}", "important")
        return True

    def _answers(self, line: str) -> Iterator[str]:
        """Execute a command."""
        self._commands.hit = None
        for branch in self._session.branches:
            branch.on_row = self._on_row
        with self._noting():
            yield from self._commands.answer(*command_of(line))

    @contextmanager
    def _noting(self) -> Iterator[None]:
        """Print the notes that the block gives."""
        with warnings.catch_warnings(record=True) as notes:
            yield
        for each in notes:
            self.output(f"note: {each.message}", "important")

    def _on_row(self) -> None:
        if self.interrupted():
            raise KeyboardInterrupt

    def _stopped(self, reason: str, text: str = "", hit: Sequence[int] = ()) -> None:
        end = ending(self._session)
        if end and not hit:
            reason, text = ("pause", "end of the run") if end == "end" else ("exception", end)
        body: Body = {"reason": reason, "threadId": THREAD, "allThreadsStopped": True}
        body |= {"description": text} if text else {}
        body |= {"hitBreakpointIds": [*hit]} if hit else {}
        self.scopes.clear()  # references live until the next stop
        self.send("stopped", body)

    def _end(self) -> None:
        if not self.over:
            self.over = True
            failed = self.commands is not None and self._session.branch.failure is not None
            self.send("exited", {"exitCode": int(failed)})
            self.send("terminated", {})

    # ------------------------------------------------------------------ breakpoints
    def set_source_breakpoints(self, given: Arguments) -> Body:
        """Set breakpoints on the edges that are written on some lines of a file."""
        path = Path(_text(given.get("source") or {}, "path")).resolve()
        self._forget(str(path))
        places = [each for each in self.tables if each.path.resolve() == path]
        return {"breakpoints": [self._on_line(each, places, str(path)) for each in _listed(given)]}

    def _on_line(self, wanted: Arguments, places: Sequence[TableLines], source: str) -> Body:
        line = int(wanted["line"]) + 1 - self.first_line
        found = [each for each in places if each.first <= line <= each.last]
        if not found or found[0].kind != "edge":
            said = "no edge is written here; an edge is a table [[...edge]] of this file"
            return {"verified": False, "line": wanted["line"], "message": said}
        contact = f" {found[0].contact}" if len(found) == 1 and found[0].contact else ""
        made = self._set(f"fires {found[0].name}{contact}", wanted, source)
        return made | {"line": found[0].first - 1 + self.first_line}

    def set_function_breakpoints(self, given: Arguments) -> Body:
        """Set breakpoints that are written as `break` takes them, or as a condition."""
        self._forget("")
        made = []
        for each in _listed(given):
            name, wanted = _text(each, "name").strip(), dict(each)
            if re.search(r"[<>]|[=!]=", name) and not re.search(r"\bif\b|^changes\b", name):
                extra = f" and ({each['condition']})" if each.get("condition") else ""
                wanted["condition"] = f"({name}){extra}" if extra else name
                name = f"changes {name}"  # where it changes and then holds, it became true
            made.append(self._set(name, wanted, ""))
        return {"breakpoints": made}

    def _set(self, text: str, wanted: Arguments, source: str) -> Body:
        """Set a breakpoint, and return it; what is wrong with it is its message."""
        try:
            if condition := str(wanted.get("condition") or "").strip():
                text += f" if {condition}"
            if hits := str(wanted.get("hitCondition") or "").strip():
                text += f" hits {_hits(hits)}"
            (said,) = self._commands.answer("break", text)
        except GMSError as error:
            return {"verified": False, "message": str(error)}
        self.given += 1
        self.points[self.given] = source, self._session.breakpoints[-1]
        return {"id": self.given, "verified": True, "message": said}

    def _forget(self, source: str) -> None:
        """Remove the breakpoints of a file, or those of no file."""
        session = self._session
        old = [number for number, (where, _) in self.points.items() if where == source]
        gone = {id(self.points.pop(number)[1]) for number in old}
        session.breakpoints = [each for each in session.breakpoints if id(each) not in gone]

    # ------------------------------------------------------------------ looking
    def stack(self, given: Arguments) -> Body:
        """Return this row, and those before it in the same cascade."""
        branch = self._session.branch
        rows = [branch.cursor]
        while branch.between is None and branch.raw(rows[-1]).microstep > 0:
            rows.append(rows[-1] - 1)
        shown = rows[int(given.get("startFrame") or 0) :]
        if (levels := int(given.get("levels") or 0)) > 0:
            shown = shown[:levels]
        return {"stackFrames": [self._frame(row) for row in shown], "totalFrames": len(rows)}

    def _frame(self, row: int) -> Body:
        here = self._session.at(row)
        step = f", micro-step {here.microstep}" if here.microstep else ""
        fired = f": {here.fired}" if here.fired else ""
        frame: Body = {"id": row + 1, "name": f"t = {here.t:.9g} s{step}{fired}"}
        place = self._place(here)
        line = 1 if place is None else place.first
        frame |= {"line": line - 1 + self.first_line, "column": self.first_column}
        path = self.path if place is None else place.path
        return frame | {"source": {"name": path.name, "path": str(path.resolve())}}

    def _place(self, here: Here) -> TableLines | None:
        """Return where the edge taken is written; else the state, or what has the element."""
        commands = self._commands
        bank = commands.elements.bank(commands.element)
        if here.fired is not None:
            contact, wanted = here.fired.contact, ("edge", here.fired.edge)
        else:
            contact = bank.name if commands.elements.named else ""
            element = commands.element - bank.first
            wanted = ("state", here.contacts[bank.name].states[element])
        for kind, name in (wanted, ("contact", contact), ("supervisor", contact), ("model", "")):
            for each in self.tables:
                if (each.kind, each.name, each.contact) == (kind, name, contact):
                    return each
        return None

    def scopes_at(self, given: Arguments) -> Body:
        """Return the scopes of a row."""
        row = self._row(given)
        with self._at(row):
            found = []
            for scope in scopes_of(self._commands):
                self.scopes.append((row, scope))
                reference = len(self.scopes)
                found.append(
                    {"name": scope.name, "variablesReference": reference, "expensive": False}
                )
        return {"scopes": found}

    def variables(self, given: Arguments) -> Body:
        """Return the values of a scope."""
        row, scope = self._scope(given)
        with self._at(row):
            return {
                "variables": [
                    {"name": each.name, "value": each.text, "variablesReference": 0}
                    | ({"evaluateName": each.name} if each.printed else {})
                    for each in scope.values()
                ]
            }

    def set_variable(self, given: Arguments) -> tuple[Body, Callable[[], None]]:
        """Poke a value, which makes a branch."""
        row, scope = self._scope(given)
        name = _text(given, "name")
        with self._at(row):
            said = list(self._answers(f"poke {name}={_text(given, 'value')}"))
        new = next((each.text for each in scope.values() if each.name == name), "")

        def moved() -> None:
            self.output("\n".join(said))
            self._stopped("goto", said[0])

        return {"value": new}, moved

    def evaluate(self, given: Arguments) -> tuple[Body, Callable[[], None] | None]:
        """Execute a command, explain an edge, or return a value."""
        text, context = _text(given, "expression").strip(), given.get("context")
        if context == "repl" and command_of(text)[0] in COMMANDS:
            return self._command(text)
        with self._at(self._row(given)):
            machine = self._owner(text) if context == "hover" else None
            said = self._answers(f"print {text}") if machine is None else self._why(machine, text)
            return {"result": "\n".join(said), "variablesReference": 0}, None

    def _command(self, text: str) -> tuple[Body, Callable[[], None] | None]:
        """Execute a command that was typed; whoever looks on is told of a move."""
        commands, before = self._commands, self._position
        try:
            said = "\n".join(self._answers(text))
        except KeyboardInterrupt:
            said = "stopped"
        then = None
        if commands.left:
            then = self._end
        elif self._position != before:
            then = functools.partial(self._stopped, "goto")
        return {"result": said, "variablesReference": 0}, then

    def completions(self, given: Arguments) -> Body:
        """Complete a word of a command."""
        typed = _text(given, "text")[: int(given.get("column", 1)) - self.first_column]
        word = re.split(r"\s", typed)[-1]
        before = typed.removesuffix(word)
        start = {"start": len(before) + self.first_column, "length": len(word)}
        words = self._commands.complete(word, before)
        return {"targets": [{"label": each, **start} for each in words]}

    def _owner(self, edge: str) -> int | None:
        """Return the element that is asked about an edge; None if there is no such edge."""
        elements = self._commands.elements
        some = (elements.chosen, *(bank.first for bank in elements.banks))
        for machine in some:
            if edge in {each.name for each in elements.chart(machine).transitions}:
                return machine
        return None

    def _why(self, machine: int, edge: str) -> list[str]:
        """Return in two lines why an edge fires or not."""
        try:
            found = self._session.why(self._commands.elements.address(machine), edge)
        except SessionError as error:  # it leaves another state, which is the answer
            return [error.reason, error.advice]
        return [found.heading[0], found[0].verdict]

    # ------------------------------------------------------------------ places
    @property
    def _commands(self) -> Commands:
        assert self.commands is not None
        return self.commands

    @property
    def _session(self) -> Session:
        return self._commands.session

    @property
    def _position(self) -> tuple[object, ...]:
        here = self._session.here
        return self._session, self._session.current, here.row, here.t

    def _row(self, given: Arguments) -> int:
        """Return the row of a frame, by default that of the cursor."""
        here = self._session.here.row
        row = int(given.get("frameId") or here + 1) - 1
        if not 0 <= row < len(self._session.branch):
            raise SessionError(f"there is no frame {row + 1}")
        return row

    def _scope(self, given: Arguments) -> tuple[int, ShownScope]:
        number = int(given.get("variablesReference") or 0)
        if not 1 <= number <= len(self.scopes):
            raise SessionError(f"there is no scope {number}", advice="ask for the scopes again")
        return self.scopes[number - 1]

    @contextmanager
    def _at(self, row: int) -> Iterator[None]:
        """Look from a row, and come back."""
        branch = self._session.branch
        before = branch.cursor, branch.between
        if row != branch.cursor:
            branch.cursor, branch.between = row, None
        try:
            yield
        finally:
            branch.cursor, branch.between = before

    def output(self, text: str, category: str = "console") -> None:
        """Print lines where the client shows what the debugger says."""
        self.send("output", {"category": category, "output": f"{text}\n"})


def _text(given: Mapping[str, Any], name: str) -> str:
    found = given.get(name)
    if not isinstance(found, str):
        raise SessionError("a text is wanted", place=name, value=found)
    return found


def _listed(given: Arguments) -> list[Arguments]:
    return [each for each in given.get("breakpoints") or [] if isinstance(each, dict)]


def _hits(text: str) -> str:
    form = re.fullmatch(r"(?:>=\s*)?(\d+)", text)
    if form is None:
        raise SessionError(f"{text!r} counts no hits", advice="write 3, to stop from hit 3 on")
    return form[1]


REQUESTS: Mapping[str, Callable[[Adapter, Arguments], Any]] = {
    "initialize": Adapter.initialize,
    "launch": Adapter.launched,
    "configurationDone": Adapter.configured,
    "disconnect": Adapter.disconnect,
    "terminate": Adapter.terminate,
    "threads": Adapter.threads,
    "stackTrace": Adapter.stack,
    "scopes": Adapter.scopes_at,
    "variables": Adapter.variables,
    "setVariable": Adapter.set_variable,
    "evaluate": Adapter.evaluate,
    "completions": Adapter.completions,
    "setBreakpoints": Adapter.set_source_breakpoints,
    "setFunctionBreakpoints": Adapter.set_function_breakpoints,
    "setExceptionBreakpoints": lambda adapter, given: {},  # noqa: ARG005 (clients send it always)
    "continue": Adapter.resume,
    "reverseContinue": Adapter.reverse,
    "next": lambda adapter, _: adapter.stepping("next"),
    "stepIn": lambda adapter, _: adapter.stepping("step"),
    "stepOut": Adapter.step_out,
    "stepBack": lambda adapter, _: adapter.stepping("back"),
    "pause": Adapter.pause,
}
