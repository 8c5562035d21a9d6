"""The debugger for editors: `serve` answers requests of the Debug Adapter Protocol.

Every request that moves, explains or changes something is a command of the line prompt, so an
editor gets the answers of the prompt. `_wire` reads and writes messages, `_adapter` translates,
`_scopes` says what is shown of a row, `_lines` knows the lines of a file.
"""

from gms_fsm.debugger.dap._adapter import Launched
from gms_fsm.debugger.dap._server import serve

__all__ = ["Launched", "serve"]
