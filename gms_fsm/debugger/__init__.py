"""The debugger: commands on a session, with a terminal interface.

`_view` turns a session into plain data, and `_text` turns that into lines. `_commands` parses and
executes a command and answers in lines; `_terminal` reads and prints. The full-screen interface in
`tui` shows `_view` in panels, and its keys give commands. Another interface can do the same.
"""

from gms_fsm.debugger._help import ALIASES, COMMANDS, help_of
from gms_fsm.debugger._terminal import Debugger
from gms_fsm.debugger._view import Screen, view

__all__ = [
    "ALIASES",
    "COMMANDS",
    "Debugger",
    "Screen",
    "help_of",
    "view",
]
