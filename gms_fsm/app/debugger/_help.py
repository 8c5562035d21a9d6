"""What the debugger's commands are called and what the help says of them."""

from __future__ import annotations

import string
from dataclasses import dataclass

from gms_fsm.inspection.session import Session

__all__ = ["ALIASES", "COMMANDS", "MOVES", "Command", "help_of", "names_for", "overview"]


@dataclass(frozen=True)
class Command:
    """What the help says of a command; `help_of` fills the braces with a chart's names."""

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
        "Compute all branches to their ends and draw them (needs matplotlib).",
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


def names_for(session: Session) -> dict[str, str]:
    """Return what stands for the braces of the help, as far as the chart has it.

    Parameters
    ----------
    session : Session
        What is walked.

    Returns
    -------
    dict
        Name in braces to text.
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
    """Return what the help says of a command, with the names of a session.

    Parameters
    ----------
    name : str
        A command.
    session : Session
        What is walked.

    Returns
    -------
    Command
        Without braces; an example that needs what the chart lacks is left out.
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
    """Return the help's first page.

    Parameters
    ----------
    session : Session
        What is walked.

    Returns
    -------
    str
        Lines.
    """
    groups: dict[str, list[str]] = {}
    for name, each in COMMANDS.items():
        short = f"{name} ({each.alias})" if each.alias else name
        groups.setdefault(each.group, []).append(short)
    lines = [f"  {group:<8}{'  '.join(names)}" for group, names in groups.items()]
    return OVERVIEW.format(groups="\n".join(lines), **names_for(session))
