"""A minimal client of the Debug Adapter Protocol, over pipes to an adapter that runs elsewhere."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

from gms_fsm.app.scenario import launched
from gms_fsm.debugger.dap import serve

PATIENCE = 60.0  # seconds to wait for a message, then the test fails


class DapClient:
    """Sends requests and waits for answers and events; keeps every message."""

    def __init__(self, reading: BinaryIO, writing: BinaryIO) -> None:
        self.reading, self.writing, self.seq = reading, writing, 0
        self.seen: list[dict[str, Any]] = []
        self.incoming: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self.waiting: list[dict[str, Any]] = []  # events that nobody has asked for yet
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self) -> None:
        try:
            while head := self.reading.readline():
                name, length = head.split(b":")
                assert name == b"Content-Length"
                assert self.reading.readline() == b"\r\n"
                self.incoming.put(json.loads(self.reading.read(int(length))))
        finally:
            self.incoming.put(None)

    def close(self) -> None:
        """Close both ends, once the adapter has closed its own."""
        self.writing.close()
        self.reader.join(PATIENCE)
        self.reading.close()

    def _next(self) -> dict[str, Any]:
        message = self.incoming.get(timeout=PATIENCE)
        assert message is not None, "the adapter has left"
        self.seen.append(message)
        return message

    def send(self, command: str, **arguments: Any) -> int:
        """Send a request, and return its number."""
        self.seq += 1
        self.raw({"seq": self.seq, "type": "request", "command": command, "arguments": arguments})
        return self.seq

    def raw(self, message: object) -> None:
        """Send a message as it is."""
        body = json.dumps(message).encode()
        self.writing.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        self.writing.flush()

    def response(self, number: int) -> dict[str, Any]:
        """Wait for the answer to a request."""
        while True:
            message = self._next()
            if message["type"] == "event":
                self.waiting.append(message)
            elif message["request_seq"] == number:
                return message

    def ask(self, command: str, **arguments: Any) -> dict[str, Any]:
        """Send a request that succeeds, and return the body of its answer."""
        found = self.response(self.send(command, **arguments))
        assert found["success"], found["message"]
        body: dict[str, Any] = found["body"]
        return body

    def fail(self, command: str, **arguments: Any) -> str:
        """Send a request that fails, and return what the answer says."""
        found = self.response(self.send(command, **arguments))
        assert not found["success"]
        return str(found["message"])

    def event(self, name: str) -> dict[str, Any]:
        """Wait for an event, and return its body."""
        while True:
            for i, each in enumerate(self.waiting):
                if each["event"] == name:
                    body: dict[str, Any] = self.waiting.pop(i)["body"]
                    return body
            message = self._next()
            assert message["type"] == "event", message
            self.waiting.append(message)

    def go(self, command: str) -> dict[str, Any]:
        """Send a request that moves, and return where it stopped."""
        self.ask(command, threadId=1)
        return self.event("stopped")

    def launch(self, program: str, **arguments: Any) -> None:
        """Launch a scenario, up to the moment at which breakpoints are set."""
        self.ask("initialize", adapterID="gms-fsm", linesStartAt1=True, columnsStartAt1=True)
        self.ask("launch", program=program, **arguments)
        self.event("initialized")

    def enter(self, program: str, **arguments: Any) -> None:
        """Launch a scenario, and stop at its start."""
        self.launch(program, **arguments)
        self.ask("configurationDone")
        assert self.event("stopped")["reason"] == "entry"

    def frames(self) -> list[dict[str, Any]]:
        """Return the stack."""
        found: list[dict[str, Any]] = self.ask("stackTrace", threadId=1)["stackFrames"]
        return found

    def values(self, scope: str, frame: int | None = None) -> dict[str, str]:
        """Return the values of a scope by name."""
        variables = self.ask("variables", variablesReference=self.scope(scope, frame))["variables"]
        return {each["name"]: each["value"] for each in variables}

    def scope(self, name: str, frame: int | None = None) -> int:
        """Return the reference of a scope."""
        frame = self.frames()[0]["id"] if frame is None else frame
        scopes = self.ask("scopes", frameId=frame)["scopes"]
        return int({each["name"]: each["variablesReference"] for each in scopes}[name])

    def said(self, expression: str, context: str = "repl", **arguments: Any) -> str:
        """Return the result of an expression or a command."""
        return str(
            self.ask("evaluate", expression=expression, context=context, **arguments)["result"]
        )


@contextmanager
def adapter() -> Iterator[DapClient]:
    """Serve in a thread, over two pipes."""
    (read_there, write_here), (read_here, write_there) = os.pipe(), os.pipe()
    there = os.fdopen(read_there, "rb"), os.fdopen(write_there, "wb")
    here = os.fdopen(read_here, "rb"), os.fdopen(write_here, "wb")
    codes = list[int]()

    def run() -> None:
        with there[0], there[1]:
            codes.append(serve(launched, *there))

    server = threading.Thread(target=run, daemon=True)
    server.start()
    client = DapClient(*here)
    try:
        yield client
        client.ask("disconnect")
    finally:
        client.close()
        server.join(PATIENCE)
    assert codes == [0]


def process() -> subprocess.Popen[bytes]:
    """Start `gms-fsm dap`."""
    command = [sys.executable, "-m", "gms_fsm", "dap"]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL)
