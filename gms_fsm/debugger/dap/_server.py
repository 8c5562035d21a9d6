"""The loop of the adapter: a thread reads requests, so that one can interrupt a move."""

from __future__ import annotations

import contextlib
import itertools
import queue
import sys
import threading
from collections.abc import Callable, Mapping
from typing import Any, BinaryIO

from gms_fsm.debugger.dap._adapter import Adapter, Launched
from gms_fsm.debugger.dap._wire import ProtocolMessage, read_message, write_message
from gms_fsm.errors import GMSError

INTERRUPTING = ("pause", "disconnect", "terminate")


def serve(
    launch: Callable[[Mapping[str, Any]], Launched], reading: BinaryIO, writing: BinaryIO
) -> int:
    """Answer requests until the client disconnects; return the exit code, 1 if it just goes.

    `launch` begins a session, given the arguments of the launch request. Nothing but answers and
    events is written.
    """
    waiting: queue.Queue[ProtocolMessage | GMSError | None] = queue.Queue()
    stop = threading.Event()
    numbers = itertools.count(1)

    def send(kind: str, **parts: object) -> None:
        write_message(writing, {"seq": next(numbers), "type": kind, **parts})

    def event(name: str, body: Mapping[str, Any]) -> None:
        send("event", event=name, body=body)

    def read() -> None:
        """Read up to a disconnect: no thread waits for input when the process ends."""
        name = ""
        while name != "disconnect":
            try:
                message = read_message(reading)
            except GMSError as error:
                waiting.put(error)
                continue
            name = "" if message is None else str(message.get("command"))
            if name in INTERRUPTING or message is None:
                stop.set()
            waiting.put(message)
            if message is None:
                return

    adapter = Adapter(launch, event, stop.is_set)
    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    with (
        contextlib.redirect_stdout(sys.stderr),  # whatever a library prints is no message
        contextlib.suppress(BrokenPipeError),  # the client is gone
    ):
        while (message := waiting.get()) is not None:
            if isinstance(message, GMSError):
                adapter.output(str(message), "stderr")
                continue
            if message.get("type") != "request":
                continue
            name = str(message.get("command"))
            if name in INTERRUPTING:
                stop.clear()
            _answer(adapter, message, name, send)
            if name == "disconnect":
                reader.join()
                return 0
    reader.join()
    return 1


def _answer(
    adapter: Adapter, request: ProtocolMessage, name: str, send: Callable[..., None]
) -> None:
    """Answer one request, then do what it asks for."""
    arguments = request.get("arguments")
    heading = {"request_seq": request.get("seq", 0), "command": name}
    try:
        body, then = adapter.answer(name, arguments if isinstance(arguments, dict) else {})
    except (Exception, KeyboardInterrupt) as error:  # without an answer a client waits for ever
        said = str(error) if isinstance(error, GMSError) else f"{type(error).__name__}: {error}"
        send("response", **heading, success=False, message=said, body={})
        return
    send("response", **heading, success=True, body=body)
    if then is not None:
        then()
