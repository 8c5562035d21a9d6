"""Whatever an editor asks the adapter is answered, and the adapter leaves with its client."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from gms_fsm.app.verbs.runs import dap_command
from gms_fsm.debugger.dap._adapter import REQUESTS
from gms_fsm.errors import SessionError
from tests.app.dap_client import PATIENCE, DapClient, adapter, process

STEEP = """\
name = "steep"
[[body]]
name = "sled"
velocity = "1"
v = "v"
[[contact]]
name = "pad"
v = "v"
[contact.chart]
name = "steep"
inputs = ["v"]
variables = ["z"]
initial = { z = 1.0 }
[[contact.chart.state]]
name = "on"
flow.z = "z * z * v"
outputs.F = "z"
[run]
t_end = 2.0
"""


# --------------------------------------------------------------------------- mistakes
WRONG: dict[str, tuple[Callable[[DapClient], str], str]] = {
    "unknown request": (lambda c: c.fail("restart"), "there is no request 'restart'"),
    "unknown scenario": (
        lambda c: c.fail("launch", program="pulledmass"),
        "there is no file or scenario 'pulledmass'; did you mean 'pulled_mass'?",
    ),
    "no scenario": (lambda c: c.fail("launch"), "program is None; give a scenario file"),
    "run that cannot be": (
        lambda c: c.fail("launch", program="pulled_mass", set=["run.t_end=-1"]),
        "run.t_end",
    ),
    "setting that is no list": (
        lambda c: c.fail("launch", program="pulled_mass", set="a=1"),
        "set is 'a=1'; give a list of texts",
    ),
    "unknown engine": (
        lambda c: c.fail("launch", program="pulled_mass", engine="steam"),
        "run.engine",
    ),
    "request before the launch": (lambda c: c.fail("stackTrace"), "stackTrace comes before launch"),
    "paths that are URIs": (
        lambda c: c.fail("initialize", pathFormat="uri"),
        "paths are wanted, not URIs",
    ),
}
WRONG_IN_A_RUN: dict[str, tuple[Callable[[DapClient], str], str]] = {
    "unknown name": (
        lambda c: c.fail("evaluate", expression="z9", context="watch"),
        "unknown name 'z9'",
    ),
    "command that is wrong": (
        lambda c: c.fail("evaluate", expression="why 9", context="repl"),
        "no element 9; there are 1 to 4",
    ),
    "scope of before": (
        lambda c: c.fail("variables", variablesReference=99),
        "there is no scope 99; ask for the scopes again",
    ),
    "frame of no row": (lambda c: c.fail("scopes", frameId=999), "there is no frame 999"),
    "value of no number": (
        lambda c: c.fail(
            "setVariable", variablesReference=c.scope("element 1"), name="z1", value="much"
        ),
        "unknown name 'much'",
    ),
    "edge as a value": (
        lambda c: c.fail(
            "setVariable", variablesReference=c.scope("element 1"), name="arrest", value="1"
        ),
        "'arrest' cannot be poked",
    ),
    "expression that is no text": (lambda c: c.fail("evaluate", expression=3), "expression is 3"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_mistake_is_answered_by_its_message(case: str) -> None:
    with adapter() as client:
        call, said = WRONG[case]
        assert said in call(client)


def test_a_mistake_in_a_run_leaves_it_as_it_was() -> None:
    with adapter() as client:
        client.enter("pulled_mass")
        client.said("goto 0.05")
        before = client.frames()
        for case, (call, said) in WRONG_IN_A_RUN.items():
            assert said in call(client), case
        assert client.frames() == before
        assert client.said("branches").count("rows") == 1


def test_what_is_no_request_is_passed_over() -> None:
    with adapter() as client:
        client.raw([1, 2])
        client.raw({"type": "event", "event": "output"})
        assert "a message is not a JSON object" in client.event("output")["output"]
        client.enter("pulled_mass")


@pytest.mark.parametrize("request_", sorted({*REQUESTS} - {"disconnect"}))
def test_arguments_of_any_kind_are_answered(request_: str) -> None:
    names = "breakpoints column expression frameId levels name program source startFrame text value"
    with adapter() as client:
        client.enter("pulled_mass", set=["run.t_end=0.1"])
        for junk in (
            None,
            -1,
            "x",
            [3],
            {"path": 3, "name": []},
            [{"line": "a", "name": "arrest"}],
        ):
            given = dict.fromkeys([*names.split(), "variablesReference"], junk)
            assert isinstance(client.response(client.send(request_, **given))["success"], bool)
        assert client.ask("threads")


def test_a_failed_run_says_why_and_leaves_with_1(tmp_path: Path) -> None:
    path = tmp_path / "steep.toml"
    path.write_text(STEEP, encoding="utf-8")
    with adapter() as client:
        client.enter(str(path))
        stop = client.go("continue")
        assert (stop["reason"], "z" in stop["description"]) == ("exception", True)
        client.ask("continue", threadId=1)
        assert client.event("exited") == {"exitCode": 1}


def test_at_a_terminal_the_verb_names_the_one_that_is_meant(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.stdin", SimpleNamespace(isatty=lambda: True))
    with pytest.raises(SessionError, match="gms-fsm debug SCENARIO"):
        dap_command()


# --------------------------------------------------------------------------- the process
@pytest.mark.slow
def test_the_verb_writes_nothing_but_the_protocol_and_leaves_with_the_client() -> None:
    with process() as started:
        assert started.stdin is not None
        assert started.stdout is not None
        client = DapClient(started.stdout, started.stdin)  # which reads nothing else
        client.enter("pulled_mass", set=["model.law=published", "model.stribeck.F_s=1"])
        client.go("continue")
        client.ask("disconnect")
        assert started.wait(PATIENCE) == 0
        client.close()
        said = [each["body"] for each in client.seen if each.get("event") == "output"]
        notes = [each["output"] for each in said if each["category"] == "important"]
        assert ["note: " in each for each in notes] == [True]  # without drop it never arrests


@pytest.mark.slow
def test_the_process_leaves_when_its_client_is_gone() -> None:
    with process() as started:
        assert started.stdin is not None
        started.stdin.write(b"Content-Length: 12\r\n\r\n" + json.dumps({"a": 1}).encode()[:5])
        started.stdin.close()
        assert started.wait(PATIENCE) == 1
