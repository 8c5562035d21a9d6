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
    """Show a session on the whole terminal until the user quits.

    Parameters
    ----------
    session : Session
        The session.
    title : str, optional
        What it is, shown at the top.
    light : bool
        Whether to begin with dark text on a light ground; a key changes it.

    Returns
    -------
    int
        The exit code, 0.

    Raises
    ------
    MissingExtraError
        If Textual is not installed.
    SessionError
        If there is no terminal, or one that cannot place text.
    """
    require("textual", "tui")
    terminal = all(file is not None and file.isatty() for file in (sys.stdin, sys.stdout))
    if not terminal or os.environ.get("TERM") == "dumb":
        raise SessionError(
            "the full-screen debugger needs a terminal",
            advice="without --tui it reads commands from a pipe and answers in lines",
        )
    from gms_fsm.debugger.tui._app import FullScreen

    return FullScreen(session, title, light=light).run() or 0
