"""The debugger: commands over a session, with a terminal as their face.

`_view` makes plain data of what a session shows, `_text` makes lines of 80 columns of that,
`_commands` reads a command, does it and answers in lines; `_terminal` asks and prints. Another face
needs `_view` and the session, or `_commands`.
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
