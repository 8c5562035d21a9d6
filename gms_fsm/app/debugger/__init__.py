"""The debugger: commands on a session, with a terminal interface.

`_view` turns a session into plain data, and `_text` turns that into lines of 80 columns.
`_commands` parses and executes a command and answers in lines; `_terminal` reads and prints.
Another interface can use `_view` and the session, or `_commands`.
"""

from gms_fsm.app.debugger._help import ALIASES, COMMANDS, help_of
from gms_fsm.app.debugger._terminal import Debugger, run_debugger, scenario_to_debug
from gms_fsm.app.debugger._view import View, view

__all__ = [
    "ALIASES",
    "COMMANDS",
    "Debugger",
    "View",
    "help_of",
    "run_debugger",
    "scenario_to_debug",
    "view",
]
