"""The full-screen interface of a session, with Textual (extra ``tui``).

Every key and every click gives a command of the line prompt, which is shown with its answer, so
both interfaces give the same answers. The panels show the view model of the debugger.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from gms_fsm.errors import SessionError
from gms_fsm.foundation.extras import require
from gms_fsm.session.session import Session

__all__ = ["run_tui"]

LOADING, CLEARED = "opening the debugger on the whole terminal ...", "\r\x1b[2K"


def run_tui(session: Session, title: str = "", *, light: bool = False) -> int:
    """Show a session on the whole terminal until the user quits."""
    require("textual", "tui")
    terminal = all(file is not None and file.isatty() for file in (sys.stdin, sys.stdout))
    if not terminal or os.environ.get("TERM") == "dumb":
        raise SessionError(
            "the full-screen debugger needs a terminal",
            advice="without --tui it reads commands from a pipe and answers in lines",
        )
    with quiet():
        sys.stdout.write(LOADING)
        sys.stdout.flush()
        from gms_fsm.debugger.tui._app import FullScreen

        app = FullScreen(session, title, light=light)
        sys.stdout.write(CLEARED)
        sys.stdout.flush()
        return app.run() or 0


@contextmanager
def quiet() -> Iterator[None]:
    """Do not echo keys that are typed while the screen is not yet, or no longer, drawn."""
    if sys.platform == "win32":  # has no termios, and echoes nothing
        yield
        return
    import termios

    try:
        before = termios.tcgetattr(sys.stdin)
    except (OSError, termios.error):
        yield
        return
    without = [*before[:3], before[3] & ~termios.ECHO, *before[4:]]
    termios.tcsetattr(sys.stdin, termios.TCSADRAIN, without)
    try:
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)
