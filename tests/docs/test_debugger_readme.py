"""The transcript in the README equals the output of the debugger."""

from __future__ import annotations

import io
import re

from gms_fsm.app.debugger import run_debugger
from gms_fsm.app.scenario import load_scenario
from tests.helpers import ROOT


def test_the_transcript_is_true() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(r"^```\w*\n\$ gms-fsm debug (\S+)\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    assert found, "README.md has no fenced block that begins with '$ gms-fsm debug'"
    scenario, transcript = found.groups()
    commands = re.findall(r"^\(t=[^)]*\) (.+)$", transcript, re.MULTILINE)
    assert commands[-1] in ("q", "quit")
    assert 3 <= len(commands) <= 12
    out = io.StringIO()
    script = io.StringIO("".join(f"{command}\n" for command in commands))
    assert run_debugger(load_scenario(ROOT / scenario), script, out) == 0
    assert out.getvalue() == transcript
