"""Leave out the doctests of modules that cannot be imported without their extra."""

from __future__ import annotations

import importlib.util

# The classes of the full-screen debugger derive from those of Textual (extra: tui).
collect_ignore = (
    []
    if importlib.util.find_spec("textual")
    else [f"gms_fsm/app/debugger/tui/{name}.py" for name in ("_app", "_widgets")]
)
