"""What foreign tools have run is kept as rows of a table, which the documentation shows."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

ROWS = Path(__file__).parent / "exports.json"  # read by docs/make_exports.py
_rows = pytest.StashKey[list[list[str]]]()


@pytest.fixture
def ran(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Return a function that keeps a row: ran(format, tool with version, what, result)."""
    stash = request.config.stash

    def keep(form: str, tool: str, what: str, result: str) -> None:
        stash.setdefault(_rows, []).append([form, tool, what, result])

    return keep


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write the rows of this run in place of the earlier ones about the same."""
    new = session.config.stash.get(_rows, [])
    if not new or hasattr(session.config, "workerinput"):
        return
    earlier = json.loads(ROWS.read_text(encoding="utf-8")) if ROWS.exists() else []
    table = {(form, tool.split()[0], what): row for row in (*earlier, *new)
             for form, tool, what, _ in [row]}  # fmt: skip
    text = json.dumps(sorted(table.values()), indent=1, ensure_ascii=False)
    ROWS.write_text(text + "\n", encoding="utf-8")
