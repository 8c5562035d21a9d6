"""Names and help texts of the commands of the debugger."""

from __future__ import annotations

import string
from dataclasses import dataclass

from gms_fsm.session.here import why_at
from gms_fsm.session.session import Session
from gms_fsm.session.tree.poking import pokeable


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
        "Show everything on one screen: {bodies}state, variables, threshold s and the ratio of the "
        "first variable to it (if any), force and edges of each element, by priority, with one "
        "mark per clause; below, the states over time.",
        ("where",),
        "w",
    ),
    "why": Command(
        "look",
        "why [{ELEMENT}] [EDGE]",
        "Explain why the edges of an element fire or not, clause by clause: both sides, the margin "
        "(negative on the false side), and the truth. With the name of an edge, only that edge.",
        ("why", "why {element}", "why {element} {leaving}"),
    ),
    "list": Command(
        "look",
        "list",
        "Draw the chart of the current element: the active state and the guards evaluated.",
        ("list",),
        "l",
    ),
    "log": Command("look", "log [N]", "Show the last N transitions (default 10).", ("log 4",)),
    "trust": Command(
        "look",
        "trust",
        "Show how far this branch is to be trusted: switches decided by less than the tolerances, "
        "places without a unique answer, values outside the chart's domain. Runs it to its end.",
        ("trust",),
    ),
    "coverage": Command(
        "look",
        "coverage",
        "Show what all branches together have tried: states, edges, clauses of guards, and those "
        "that decided a guard alone (MC/DC); below, what was never taken and why not. Runs them to "
        "their ends.",
        ("coverage",),
    ),
    "print": Command(
        "look",
        "print EXPRESSION",
        "Print the value of an expression, in SI units or the unit given, or the truth of a "
        "condition. Names: {names}.",
        ("print {z}1 / {s}1", "print {lead}F in mN", "p {lead}state({n}) == {state}"),
        "p",
    ),
    "watch": Command(
        "look",
        "watch [EXPRESSION]",
        "Show an expression after every move; without an argument, show all watches.",
        ("watch {lead}F{n}", "watch abs({z}1) / {s}1"),
    ),
    "unwatch": Command("look", "unwatch N|all", "Remove a watch.", ("unwatch 1",)),
    "element": Command(
        "look",
        "element {NUMBER}",
        "Choose the element shown by list and why; elements are numbered from 1.",
        ("element {element}",),
    ),
    "step": Command(
        "move",
        "step [N]",
        "Go forward N rows (default 1). Each firing at one time is a separate row.",
        ("step", "s 10"),
        "s",
    ),
    "back": Command(
        "move",
        "back [N], back until CONDITION, or back continue",
        "Go back N rows (default 1); to the last point before this one where a condition was true, "
        "also between rows; or to the breakpoint before this row.",
        ("back 10", "back continue", "back until abs({z}1) > 0.9*{s}1"),
    ),
    "next": Command("move", "next", "Go forward to the next transition.", ("next",), "n"),
    "prev": Command("move", "prev", "Go back to the previous transition.", ("prev",)),
    "goto": Command(
        "move",
        "goto T",
        "Go to the last row at or before a time, in seconds without a unit.",
        ("goto {t}",),
    ),
    "until": Command(
        "move",
        "until CONDITION",
        "Go forward to the next point where a condition becomes true, also between rows. Numbers "
        "without a unit are in SI units.",
        (
            "until abs({z}1) > 0.9*{s}1",
            "until {lead}F > 500 mN",
            "u {lead}state({n}) == {state} and {lead}{v} > 0",
        ),
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
        "break [tested|valid|fires] EDGE [{at}] [if CONDITION] [hits K], or "
        "break [enter|leave] STATE ..., or break changes EXPRESSION ...",
        "Make continue stop where the guard of an edge is evaluated (tested) or becomes true "
        "(valid), or where the edge is taken (fires, the default); where a state is entered (the "
        "default) or left; or at a row where an expression is not what it was at the row before. "
        "The condition is evaluated after the event; with hits K, stop from the K-th hit on. "
        "Without an argument, show all breakpoints.",
        (
            "break fires {edge} {where}",
            "break changes sgn({lead}{v})",
            "b changes {lead}state({n})",
            "b enter {state} if {lead}{v} < 0 hits 3",
        ),
        "b",
    ),
    "breaks": Command("stop", "breaks", "Show all breakpoints and their hits.", ("breaks",)),
    "clear": Command("stop", "clear N|all", "Remove a breakpoint.", ("clear 1",)),
    "poke": Command(
        "change",
        "poke {poked}=VALUE {lead}state1=STATE ...",
        "Change values here and continue in a new branch; the present one is kept. What can be "
        "changed: {pokeable}. A value can be an expression, or a number with a unit.",
        (
            "poke {z}1=0",
            "poke {z}{n}=0.9*{s}{n} {lead}state{n}={state}",
            "poke {lead}state{n}={state}",
        ),
    ),
    "send": Command(
        "change",
        "send EVENT",
        "Send an event to the machines here and continue in a new branch.",
        ("send overheat",),
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
    "source": Command(
        "file",
        "source FILE",
        "Execute the commands in a file, one on each line, up to the first error.",
        ("source mine.txt",),
    ),
    "help": Command(
        "file", "help [COMMAND]", "Show all commands, or the help on one.", ("help break",), "h"
    ),
    "quit": Command("file", "quit", "Leave.", ("quit",), "q"),
}
ALIASES = {each.alias: name for name, each in COMMANDS.items() if each.alias} | {
    "?": "help",
    "exit": "quit",
    ":q": "quit",
    "set": "poke",
}
MOVES = ("step", "back", "next", "prev", "until", "continue")
OVERVIEW = """\
To find out why an element switches or does not:  goto {t}   then   why {first}

{groups}

help COMMAND shows its usage and an example. Elements are numbered from 1.
An empty line repeats the last move when you type; in a script it does nothing.
Lines that begin with # are comments. Set NO_COLOR=1 for plain text.
Ctrl-C interrupts a long move."""


def names_for(session: Session) -> dict[str, str]:
    """Return the replacements for the names in braces, as far as the chart has them."""
    start, system = session.start, session.system
    given, several = start.what.named, len(system.machines) > 1
    contact = system.machines[0]
    chart, n = contact.chart, min(2, contact.n)
    lead = f"{contact.name}." if several else ""
    begin = session.branch.raw(0).t
    own = [name for name in pokeable(start) if given or name not in start.program.layout.y.shared]
    labels = [start.program.layout.label(name) if not several else name for name in own]
    numbered = [
        f"{label}1" if name in start.program.layout.y.own else label
        for name, label in zip(own, labels, strict=True)
    ]
    names = {
        "t": f"{begin + 0.25 * (session.t_end - begin):.9g}",
        "n": str(n),
        "lead": lead,
        "v": (*chart.velocities, "t")[0],
        "bodies": "bodies, sampled values and signals, then the contacts: " if given else "",
        "ELEMENT": "CONTACT [N]" if several else "ELEMENT",
        "NUMBER": "CONTACT [N]" if several else "N",
        "element": f"{contact.name} {n}" if several else str(n),
        "first": f"{contact.name} 1" if several else "1",
        "at": "CONTACT [N]" if several else "element N",
        "where": f"{contact.name} {n}" if several else f"element {n}",
        "names": _names(session),
        "pokeable": ", ".join([*numbered, f"{lead}state1"])
        + (", likewise for the other elements" if start.program.layout.n > 1 else "")
        + ("" if given else ", and v if the rig has a mass"),
        "poked": next(iter(numbered), "v"),
        "state": chart.states[0].name,
    }
    if chart.variables:
        names["z"] = f"{lead}{chart.variables[0]}"
        if "s" in chart.inputs and contact.stribeck is not None:
            names["s"] = f"{lead}s"
    if chart.transitions:
        names |= {"edge": chart.transitions[0].name, "state": chart.transitions[0].target}
    for each in why_at(session.branch, n - 1, ""):
        names.setdefault("leaving", each.edge.name)
    return names


def _names(session: Session) -> str:
    """Return in words which names expressions can use."""
    system, first = session.system, session.system.machines[0]
    own = [*first.chart.variables, *(["s"] if first.stribeck is not None else []), "F", "state"]
    numbered = [f"{name}1" if name != "state" else "state(1)" for name in own]
    if not session.start.what.named:
        curve = ", s" if first.stribeck is not None else ""
        return f"t, x, v, F{curve}, and with an element number {', '.join(numbered)}"
    lead = f"{first.name}."
    contact = [f"{lead}{name}" for name in (*first.chart.velocities, *first.chart.force_names)]
    inside = [f"{lead}{name}" for name in numbered]
    return f"{', '.join(system.names)}; {', '.join([*contact, *inside])}"


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
    """Return the first page of the help."""
    groups: dict[str, list[str]] = {}
    for name, each in COMMANDS.items():
        short = f"{name} ({each.alias})" if each.alias else name
        groups.setdefault(each.group, []).append(short)
    lines = [f"  {group:<8}{'  '.join(names)}" for group, names in groups.items()]
    return OVERVIEW.format(groups="\n".join(lines), **names_for(session))
