"""The full-screen interface of a session, with Textual (extra ``tui``).

Every key and every click gives a command of the line prompt, which is shown with its answer, so
both interfaces give the same answers. The panels show the view model of the debugger.
"""

from __future__ import annotations

import os
import sys

from gms_fsm.errors import SessionError
from gms_fsm.foundation.extras import require
from gms_fsm.session.session import Session

__all__ = ["run_tui"]


def run_tui(session: Session, title: str = "", *, light: bool = False) -> int:
    """Show a session on the whole terminal until the user quits."""
    require("textual", "tui")
    terminal = all(file is not None and file.isatty() for file in (sys.stdin, sys.stdout))
    if not terminal or os.environ.get("TERM") == "dumb":
        raise SessionError(
            "the full-screen debugger needs a terminal",
            advice="without --tui it reads commands from a pipe and answers in lines",
        )
    from gms_fsm.debugger.tui._app import FullScreen

    return FullScreen(session, title, light=light).run() or 0
