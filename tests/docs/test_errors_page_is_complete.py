"""docs/errors.md has every error, each with a real example and advice.

There is one hierarchy with one root, and its classes also derive from fitting built-in exceptions.
tests/docs/test_docs_are_true.py runs the blocks of the page and compares their output; this
module checks that every class has one, and that no extra is needed to run them.
"""

from __future__ import annotations

import builtins
import inspect
import re

import pytest

from gms_fsm import errors
from gms_fsm.errors import GMSError
from gms_fsm.traces import failures
from gms_fsm.traces.failures import SimulationError
from tests.helpers import ROOT
from tests.page_blocks import blocks_of

PAGE = (ROOT / "docs" / "errors.md").read_text(encoding="utf-8")
SECTIONS = dict(re.findall(r"^## (\w+)\n(.*?)(?=^## |\Z)", PAGE, re.MULTILINE | re.DOTALL))


HOMES = (errors.__name__, failures.__name__)
KINDS = [
    kind
    for home in (errors, failures)
    for _, kind in inspect.getmembers(home, inspect.isclass)
    if kind.__module__ in HOMES and issubclass(kind, BaseException) and kind is not GMSError
]


def test_every_error_has_one_root_a_builtin_relative_and_a_section() -> None:
    assert len(KINDS) > 10
    for kind in KINDS:
        assert issubclass(kind, GMSError)
        usual = [base for base in kind.__mro__ if base.__module__ == builtins.__name__]
        assert usual[0] is not Exception
        assert (kind.__doc__ or "").partition("\n")[0].endswith(".")
    named = [name for name in SECTIONS if name.endswith("Error")]
    assert sorted(named) == sorted(kind.__name__ for kind in KINDS)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_section_has_cause_example_and_advice(kind: type[GMSError]) -> None:
    section, name = SECTIONS[kind.__name__], kind.__name__
    assert len(section.partition("```")[0].split()) > 5  # when it is raised
    (*_, last) = (block for block in blocks_of(section) if block.kind in ("text", "console"))
    if kind is SimulationError:  # the root of others; its example shows the trace that is kept
        assert ".trace" in section
        assert "*Do:*" not in section
        return
    assert len(last.body.split()) > 6
    assert re.search(
        "^error: " if last.kind == "console" else f"^{name}: ", last.body, re.MULTILINE
    )
    assert "\n*Do:* " in section
