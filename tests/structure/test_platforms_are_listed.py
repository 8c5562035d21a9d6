"""Every place that asks for the operating system is in the list of `docs/platforms.md`."""

import ast
import re
from typing import Any

import pytest

from gms_fsm.errors import MissingExtraError
from gms_fsm.foundation.extras import EXTRAS, missing
from tests.helpers import ROOT
from tests.structure.source import Source, sources

PAGE = (ROOT / "docs" / "platforms.md").read_text(encoding="utf-8")
ONLY_SOMEWHERE = {"fcntl", "termios", "tty", "pty", "resource", "pwd", "grp", "msvcrt", "winreg"}
ASKED = {"platform", "system", "machine", "name", "uname", "getuid", "fork", "O_NOFOLLOW"}


def asks(source: Source) -> bool:
    """Return whether a module asks for the system, or imports what only some have."""
    for node in source.nodes:
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.value.id in ("sys", "os", "platform") and node.attr in ASKED:
                return True
        elif isinstance(node, ast.Import | ast.ImportFrom):
            module = getattr(node, "module", None)
            if ONLY_SOMEWHERE & {module, *(each.name for each in node.names)}:
                return True
    return False


def test_the_list_is_complete() -> None:
    found = {each.path for each in sources().values() if asks(each)}
    fonts = {"plots/output/graphviz.py"}  # has folders of all systems, and asks for none
    listed = set(re.findall(r"^\| `(\S+\.py)` \|", PAGE, re.MULTILINE))
    assert listed == {path for path in found if path.startswith(("gms_fsm", "plots"))} | fonts
    assert "WINDOWSFONTDIR" in (ROOT / "plots/output/graphviz.py").read_text(encoding="utf-8")


@pytest.mark.parametrize("extra", EXTRAS)
def test_what_is_lacking_is_said_in_one_sentence(extra: str) -> None:
    error: Any = missing("some_package", extra)
    assert isinstance(error, MissingExtraError)
    said = str(error)
    assert "\n" not in said
    assert f'"gms-fsm[{extra}]"' in said
    assert "(without it: " in said
