"""Names and help texts of the commands of the debugger."""

from __future__ import annotations

import string
from dataclasses import dataclass

from gms_fsm.inspection.session import Session

__all__ = ["ALIASES", "COMMANDS", "MOVES", "Command", "help_of", "names_for", "overview"]


@dataclass(frozen=True)
class Command:
    """Help on a command; `help_of` replaces the names in braces by those of a chart."""

    group: str
    usage: str
    says: str
    examples: tuple[str, ...]
    alias: str = ""


COMMANDS = {
    "where": Command(
        "look",
        "where",
        "Show everything on one screen: state, variables, threshold s and |{z}|/s (if any), force "
        "and edges of each element, by priority, with one mark per clause; below, the states over "
        "time.",
        ("where",),
        "w",
    ),
    "why": Command(
        "look",
        "why [ELEMENT] [EDGE]",
        "Explain why the edges of an element fire or not, clause by clause: both sides, the margin "
        "(negative on the false side), and the truth. With the name of an edge, only that edge.",
        ("why", "why {n}", "why {n} {leaving}"),
    ),
    "list": Command(
        "look",
        "list",
        "Draw the chart of the current element: the active state and the guards evaluated.",
        ("list",),
        "l",
    ),
    "log": Command("look", "log [N]", "Show the last N transitions (default 10).", ("log 4",)),
    "print": Command(
        "look",
        "print EXPRESSION",
        "Print the value of an expression or the truth of a condition. Names: t, x, v, F, s, and "
        "with an element number {numbered}, s1, F1, state(1).",
        ("print {z}1 / {s}1", "p state({n}) == {state}"),
        "p",
    ),
    "watch": Command(
        "look",
        "watch [EXPRESSION]",
        "Show an expression after every move; without an argument, show all watches.",
        ("watch F{n}", "watch abs({z}1) / {s}1"),
    ),
    "unwatch": Command("look", "unwatch N|all", "Remove a watch.", ("unwatch 1",)),
    "element": Command(
        "look",
        "element N",
        "Choose the element shown by list and why; elements are numbered from 1.",
        ("element {n}",),
    ),
    "step": Command(
        "move",
        "step [N]",
        "Go forward N rows (default 1). Each firing at one time is a separate row.",
        ("step", "s 10"),
        "s",
    ),
    "back": Command("move", "back [N]", "Go back N rows (default 1).", ("back 10",)),
    "next": Command("move", "next", "Go forward to the next transition.", ("next",), "n"),
    "prev": Command("move", "prev", "Go back to the previous transition.", ("prev",)),
    "goto": Command(
        "move", "goto T", "Go to the last row at or before a time in seconds.", ("goto {t}",)
    ),
    "until": Command(
        "move",
        "until CONDITION",
        "Go forward to the next point where a condition becomes true, also between rows.",
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
        "Make continue stop where the guard of an edge is evaluated (tested) or becomes true "
        "(valid), or where the edge is taken (fires, the default); where a state is entered (the "
        "default) or left. The condition is evaluated after the event; with hits K, stop from the "
        "K-th hit on. Without an argument, show all breakpoints.",
        ("break fires {edge} element {n}", "b enter {state} if v < 0 hits 3"),
        "b",
    ),
    "breaks": Command("stop", "breaks", "Show all breakpoints and their hits.", ("breaks",)),
    "clear": Command("stop", "clear N|all", "Remove a breakpoint.", ("clear 1",)),
    "poke": Command(
        "change",
        "poke {z}1=VALUE v=VALUE state1=STATE ...",
        "Change values here and continue in a new branch; the present one is kept. What can be "
        "changed: {numbered}, state1, likewise for the other elements, and v if the rig has a "
        "mass. A value can be an expression without spaces.",
        ("poke {z}1=0", "poke {z}{n}=0.9*{s}{n} state{n}={state}"),
    ),
    "run": Command("change", "run", "Compute this branch to its end, without moving.", ("run",)),
    "branches": Command("change", "branches", "Show all branches.", ("branches",)),
    "branch": Command("change", "branch N", "Switch to another branch.", ("branch 0",)),
    "compare": Command(
        "change",
        "compare [A B]",
        "Compute two branches to their ends and compare them; by default this one and its parent.",
        ("compare 0 1",),
    ),
    "plot": Command(
        "change",
        "plot FILE.png",
        "Compute all branches to their ends and draw them (needs matplotlib).",
        ("plot branches.png",),
    ),
    "save": Command("file", "save FILE", "Write the session to a file.", ("save mine.json",)),
    "load": Command("file", "load FILE", "Load a session from a file.", ("load mine.json",)),
    "help": Command(
        "file", "help [COMMAND]", "Show all commands, or the help on one.", ("help break",), "h"
    ),
    "quit": Command("file", "quit", "Leave.", ("quit",), "q"),
}
ALIASES = {each.alias: name for name, each in COMMANDS.items() if each.alias} | {"?": "help"}
MOVES = ("step", "back", "next", "prev", "until", "continue")
OVERVIEW = """\
To find out why an element switches or does not:  goto {t}   then   why 1

{groups}

help COMMAND shows its usage and an example. Elements are numbered from 1.
An empty line repeats the last move when you type; in a script it does nothing.
Lines that begin with # are comments. Set NO_COLOR=1 for plain text.
Ctrl-C interrupts a long move."""


def names_for(session: Session) -> dict[str, str]:
    """Return the replacements for the names in braces, as far as the chart has them.

    Parameters
    ----------
    session : Session
        The session.

    Returns
    -------
    dict
        Replacement text by name.
    """
    chart = session.model.chart
    start, n = session.branch.raw(0).t, min(2, session.model.n)
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


def help_of(name: str, session: Session) -> Command:
    """Return the help on a command, with the names of a session.

    Parameters
    ----------
    name : str
        Name of the command.
    session : Session
        The session.

    Returns
    -------
    Command
        The help without braces; examples that need names the chart lacks are omitted.
    """
    each, names = COMMANDS[name], names_for(session)
    examples = [
        example.format_map(names)
        for example in each.examples
        if all(field in (None, *names) for _, field, *_ in string.Formatter().parse(example))
    ]
    usage, says = each.usage.format_map(names), each.says.format_map(names)
    return Command(each.group, usage, says, tuple(examples), each.alias)


def overview(session: Session) -> str:
    """Return the first page of the help.

    Parameters
    ----------
    session : Session
        The session.

    Returns
    -------
    str
        The lines.
    """
    groups: dict[str, list[str]] = {}
    for name, each in COMMANDS.items():
        short = f"{name} ({each.alias})" if each.alias else name
        groups.setdefault(each.group, []).append(short)
    lines = [f"  {group:<8}{'  '.join(names)}" for group, names in groups.items()]
    return OVERVIEW.format(groups="\n".join(lines), **names_for(session))
