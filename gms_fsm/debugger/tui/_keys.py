"""The keys of the full-screen debugger, in one table: bindings, the line of keys, and the help."""

from __future__ import annotations

from typing import NamedTuple

from gms_fsm.debugger.tui._spans import PanelLine, line


class Key(NamedTuple):
    """A key: names for Textual, how it is shown, a label (or none), an action, its help."""

    names: str
    shown: str
    label: str
    action: str
    says: str


# In order of importance: a narrow terminal shows the first ones, and always the last two.
KEYS = (
    Key("s,right", "→", "step", "steps('step')", "step: one row forward; 10s goes ten rows"),
    Key("left", "←", "back", "steps('back')", "one row back"),
    Key("n,shift+right", "n", "next", "command('next')", "to the next transition"),
    Key("w", "w", "why", "why", "why the element switches or not; 25w asks it at t = 25 s"),
    Key("c", "c", "continue", "command('continue')", "to the next breakpoint"),
    Key(
        "b",
        "b",
        "break",
        "break",
        "set a breakpoint where the guard of the first edge becomes true; 2b: of the second",
    ),
    Key("p", "p", "poke", "poke", "change a value and continue in a new branch"),
    Key("x", "x", "compare", "command('compare')", "compare this branch with its parent"),
    Key("v", "v", "view", "view", "show the other panels, on a small terminal"),
    Key("colon,slash", ":", "command", "prompt('')", "type any command; Tab completes it"),
    Key("g", "g", "goto", "goto", "go to a time; 25g goes to t = 25 s"),
    Key("u", "u", "until", "prompt('until ')", "to where a condition becomes true"),
    Key("up", "↑", "", "element(-1)", "the element before"),
    Key("down,e", "e", "element", "element(1)", "the next element; 3e chooses element 3"),
    Key("f", "f", "follow", "follow", "follow the element that fires, or keep this one"),
    Key("N,shift+left", "N", "prev", "command('prev')", "to the transition before"),
    Key("o", "o", "other branch", "branch", "switch to the next branch"),
    Key("plus,equals_sign", "+", "zoom", "zoom(0.25)", "show a shorter time in the ribbons"),
    Key("minus", "-", "zoom out", "zoom(4)", "show a longer time in the ribbons"),
    Key("d", "d", "dark/light", "ground", "dark or light ground"),
    Key("tab", "Tab", "panel", "app.focus_next", "the next panel; PgUp and PgDn scroll it"),
    Key("question_mark", "?", "help", "help", "this page"),
    Key("q", "q", "quit", "leave", "leave"),
)


def with_number(number: str) -> list[tuple[str, str, str]]:
    """Return what a number that has been typed can become: (key, label, action) triples.

    >>> [label for _, label, _ in with_number("25")][:2]
    ['why at 25 s', 'go to 25 s']
    """
    found = [("w", f"why at {number} s", "why"), ("g", f"go to {number} s", "goto")]
    if "." not in number:
        found += [
            ("→", f"step {number} rows", "steps('step')"),
            ("←", f"back {number} rows", "steps('back')"),
            ("e", f"element {number}", "element(1)"),
            ("b", f"break at edge {number}", "break"),
        ]
    return found


def help_rows(overview: str) -> list[PanelLine]:
    """Return the page of the help: the keys, then the commands of the prompt."""
    rows = [PanelLine(line(("Keys. A number before a key is its argument.", "head")))]
    rows += [PanelLine(line((f"  {each.shown:<4}", "head"), each.says)) for each in KEYS]
    rows += [
        PanelLine(
            line("Esc stops a long move, or leaves the command line. The mouse: an element,")
        ),
        PanelLine(line("a time, a transition or a branch goes there; a guard sets a breakpoint.")),
        PanelLine(line("")),
        PanelLine(line(("Commands", "head"))),
    ]
    return rows + [PanelLine(line(text)) for text in overview.splitlines()]
