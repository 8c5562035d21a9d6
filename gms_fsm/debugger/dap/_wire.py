"""Messages of the Debug Adapter Protocol: JSON behind a head that gives its length."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, BinaryIO, TypeAlias

from gms_fsm.errors import SessionError, cut
from gms_fsm.foundation.text import encoded, visible_lines

ProtocolMessage: TypeAlias = Mapping[str, Any]

LARGEST_MESSAGE = 10_000_000  # bytes
LONGEST_HEAD = 1000  # bytes of one line


def read_message(stream: BinaryIO) -> ProtocolMessage | None:
    r"""Return the next message; None at the end, or where a message has no length.

    A message that is no JSON object raises `SessionError`, and the next one can still be read.

    >>> import io
    >>> read_message(io.BytesIO(b'Content-Length: 9\r\n\r\n{"seq":1}'))
    {'seq': 1}
    """
    length = 0
    while head := stream.readline(LONGEST_HEAD).strip():
        name, _, value = head.partition(b":")
        if name.strip().lower() == b"content-length" and value.strip().isdigit():
            length = int(value)
    if not 0 < length <= LARGEST_MESSAGE:
        return None
    raw = stream.read(length)
    if len(raw) < length:
        return None
    try:
        message = json.loads(raw)
    except (ValueError, RecursionError) as error:
        raise SessionError(f"a message is not JSON: {cut(str(error))}") from None
    if not isinstance(message, dict):
        raise SessionError("a message is not a JSON object", value=message)
    return message


def write_message(stream: BinaryIO, message: ProtocolMessage) -> None:
    """Write a message, with whatever cannot be seen in its texts as escapes."""
    body = encoded(json.dumps(_seen(message)))
    stream.write(b"Content-Length: %d\r\n\r\n%b" % (len(body), body))
    stream.flush()


def _seen(value: Any) -> Any:
    """Return a value with all texts in it made visible."""
    if isinstance(value, str):
        return visible_lines(value)
    if isinstance(value, Mapping):
        return {name: _seen(each) for name, each in value.items()}
    return [_seen(each) for each in value] if isinstance(value, list | tuple) else value
