"""A client of the Debug Adapter Protocol gets the answers of the debugger.

The acceptance: it steps the pulled mass through a cascade of micro-steps and back, and asks why
element 1 does not arrest.
"""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

from gms_fsm.app.cli import app
from gms_fsm.app.scenario import load_scenario, session_of
from gms_fsm.debugger import Debugger
from gms_fsm.scenarios import scenario_path
from gms_fsm.session.session import Session
from tests.app.dap_client import DapClient, adapter
from tests.helpers import ROOT
from tests.inspection.sessions import debugger
from tests.page_blocks import blocks_of

SQUEAL = "brake_squeal"


def at_the_prompt(scenario: str = "pulled_mass") -> Debugger:
    """Return the debugger of the prompt on the same scenario."""
    return debugger(session_of(load_scenario(scenario)))


def answered(prompt: Debugger, line: str) -> str:
    """Return the answer of the prompt before it is fitted to a terminal."""
    return "\n".join(prompt.commands.reply(line))


def session(scenario: str = "pulled_mass") -> Session:
    """Return a session of a scenario."""
    return session_of(load_scenario(scenario))


def in_a_cascade(client: DapClient) -> None:
    """Launch the pulled mass and stop at the first arrest, the first of four at one instant."""
    client.launch("pulled_mass")
    client.ask("setFunctionBreakpoints", breakpoints=[{"name": "arrest"}])
    client.ask("configurationDone")
    assert client.event("stopped")["reason"] == "entry"
    assert client.go("continue")["reason"] == "function breakpoint"


def tops(client: DapClient, command: str, count: int) -> list[str]:
    """Return the name of the uppermost frame after each of some moves."""
    found = []
    for _ in range(count):
        client.go(command)
        found.append(client.frames()[0]["name"])
    return found


# --------------------------------------------------------------------------- the acceptance
def test_a_cascade_is_stepped_through_and_back() -> None:
    own = session()
    own.break_on("fires", "arrest")
    rows = [own.proceed()[0]] + [own.step() for _ in range(3)]
    cascade = [f"t = {r.t:.9g} s, micro-step {r.microstep}: {r.fired}" for r in rows]
    with adapter() as client:
        in_a_cascade(client)
        first = client.frames()[0]["name"]
        assert [first, *tops(client, "stepIn", 3)] == cascade
        assert tops(client, "stepBack", 3) == cascade[2::-1]


def test_the_stack_is_the_cascade_newest_first_down_to_the_row_before_it() -> None:
    with adapter() as client:
        in_a_cascade(client)
        client.go("stepOut")  # to the last micro-step
        names = [frame["name"] for frame in client.frames()]
        assert [name.partition(", micro-step ")[2][:1] for name in names] == [
            "4",
            "3",
            "2",
            "1",
            "",
        ]
        part = client.ask("stackTrace", threadId=1, startFrame=1, levels=2)
        assert [frame["name"] for frame in part["stackFrames"]] == names[1:3]
        assert part["totalFrames"] == 5


def test_why_element_1_does_not_arrest_is_the_answer_of_the_prompt() -> None:
    prompt = at_the_prompt()
    answered(prompt, "goto 0.19")
    with adapter() as client:
        client.enter("pulled_mass")
        client.said("goto 0.19")
        assert client.event("stopped")["reason"] == "goto"
        said = client.said("why 1 arrest")
        assert said == answered(prompt, "why 1 arrest")
        assert "arrest does not fire: |v| <= v_c is false by" in said


def test_hover_over_an_edge_says_why_not_in_two_lines() -> None:
    own = session()
    own.goto(0.19)
    found = own.why(0, "arrest")
    with adapter() as client:
        client.enter("pulled_mass")
        client.said("goto 0.19")
        said = client.said("arrest", "hover", frameId=client.frames()[0]["id"])
        assert said.split("\n") == [found.heading[0], found[0].verdict]
        other = client.said("break_away_forward", "hover").split("\n")
        assert other == ["break_away_forward leaves stick", "element 1 is in slip"]


def test_each_element_has_a_scope_with_what_the_prompt_prints() -> None:
    prompt = at_the_prompt()
    answered(prompt, "break arrest")
    answered(prompt, "continue")
    with adapter() as client:
        in_a_cascade(client)
        for i in range(1, 5):
            values = client.values(f"element {i}")
            for name in (f"z{i}", f"s{i}", f"F{i}"):
                assert values[name] == answered(prompt, f"print {name}")
            assert values[f"state{i}"] == prompt.session.here.states[i - 1]
        fired = client.values("element 1")
        assert fired["arrest"] == "FIRED [|v| <= v_c && |z| < s]  true true"


def test_a_frame_below_shows_the_row_before() -> None:
    with adapter() as client:
        in_a_cascade(client)
        client.go("stepOut")
        ids = [frame["id"] for frame in client.frames()]
        states = [client.values("element 4", frame)["state4"] for frame in ids]
        assert states == ["stick", "slip", "slip", "slip", "slip"]
        assert client.said("state(3) == stick", "watch", frameId=ids[2]) == "false"
        assert client.said("state(3) == stick", "watch", frameId=ids[0]) == "true"


# --------------------------------------------------------------------------- moves
def test_next_goes_to_the_next_firing_and_reverse_to_the_one_before() -> None:
    own = session()
    rows = [own.next_transition() for _ in range(3)]
    with adapter() as client:
        client.enter("pulled_mass")
        ids = []
        for command in ("next", "next", "next", "reverseContinue"):
            client.go(command)
            ids.append(client.frames()[0]["id"] - 1)
        assert ids == [rows[0].row, rows[1].row, rows[2].row, rows[1].row]


def test_reverse_stops_at_a_breakpoint() -> None:
    with adapter() as client:
        in_a_cascade(client)
        client.said("goto 0.5")
        client.event("stopped")
        stop = client.go("reverseContinue")
        assert (stop["reason"], stop["hitBreakpointIds"]) == ("function breakpoint", [1])
        assert "arrest" in client.frames()[0]["name"]


def test_the_end_is_a_stop_from_which_one_goes_back_or_leaves() -> None:
    with adapter() as client:
        client.enter("pulled_mass")
        assert client.go("continue")["description"] == "end of the run"
        client.go("stepBack")
        client.go("stepIn")
        client.ask("continue", threadId=1)
        assert client.event("exited") == {"exitCode": 0}
        assert client.event("terminated") == {}


def test_without_stop_on_entry_it_runs_to_the_first_breakpoint() -> None:
    with adapter() as client:
        client.launch("pulled_mass", stopOnEntry=False)
        client.ask("setFunctionBreakpoints", breakpoints=[{"name": "slip"}])
        client.ask("configurationDone")
        assert client.event("stopped")["description"] == "enter slip, all elements"


def test_without_debugging_it_runs_and_leaves() -> None:
    with adapter() as client:
        client.launch("pulled_mass", noDebug=True)
        client.ask("configurationDone")
        client.event("terminated")
        said = "".join(
            each["body"]["output"] for each in client.seen if each.get("event") == "output"
        )
        assert "branch 0: 1850 rows" in said


def test_a_pause_interrupts_a_move() -> None:
    with adapter() as client:
        client.enter("pulled_mass", set=["run.t_end=1e6"])
        client.ask("continue", threadId=1)
        pause = client.send("pause", threadId=1)
        assert client.event("stopped")["reason"] == "pause"
        assert client.response(pause)["success"]
        assert float(client.said("t", "watch").split()[0]) < 1e6


def test_the_engine_and_other_keys_are_set_at_the_launch() -> None:
    with adapter() as client:
        client.enter("pulled_mass", set=["run.t_end=0.01"], engine="ifelse")
        assert "to t = 0.01 s" in client.ask("threads")["threads"][0]["name"]


# --------------------------------------------------------------------------- breakpoints
@pytest.mark.matrix
def test_a_condition_is_a_breakpoint_where_it_becomes_true() -> None:
    own = session()
    found = []
    while own.reaches("v > 3e-3 and z1 > 0"):
        found.append(own.here.row + own.here.located)
    with adapter() as client:
        client.launch("pulled_mass")
        client.ask(
            "setFunctionBreakpoints", breakpoints=[{"name": "v > 3 mm/s", "condition": "z1 > 0"}]
        )
        client.ask("configurationDone")
        client.event("stopped")
        rows = []
        while client.go("continue").get("hitBreakpointIds"):
            rows.append(client.frames()[0]["id"] - 1)
        assert rows == found != []


def test_hits_and_conditions_are_those_of_the_session() -> None:
    own = session()
    own.break_on("fires", "arrest", None, "state(1) == stick", 3)
    here, _ = own.proceed()
    wanted = {"name": "arrest", "condition": "state(1) == stick", "hitCondition": ">= 3"}
    with adapter() as client:
        client.launch("pulled_mass")
        client.ask("setFunctionBreakpoints", breakpoints=[wanted])
        client.ask("configurationDone")
        client.event("stopped")
        client.go("continue")
        assert client.frames()[0]["id"] - 1 == here.row


def test_a_line_of_an_edge_is_a_breakpoint_on_it() -> None:
    path = scenario_path(SQUEAL)
    lines = path.read_text(encoding="utf-8").split("\n")
    head = lines.index('name = "arrest_forward"')  # counted from 1, the line above
    own = session(SQUEAL)
    own.break_on("fires", "arrest_forward", "pad")
    here, _ = own.proceed()
    with adapter() as client:
        client.launch(SQUEAL)
        set_ = client.ask(
            "setBreakpoints",
            source={"path": str(path)},
            breakpoints=[{"line": head + 4}, {"line": 1}, {"line": len(lines) + 9}],
        )["breakpoints"]
        assert [each["verified"] for each in set_] == [True, False, False]
        assert (set_[0]["line"], lines[head - 1]) == (head, "[[contact.chart.edge]]")
        client.ask("configurationDone")
        client.event("stopped")
        assert client.go("continue")["reason"] == "breakpoint"
        top = client.frames()[0]
        assert (top["id"] - 1, top["line"], top["source"]["path"]) == (here.row, head, str(path))


def test_an_edge_of_a_chart_file_is_found_there(tmp_path: Path) -> None:
    text = """\
inputs = ["v"]
variables = ["z"]
reference = '''
[[edge]]
name = "no_edge"
'''
[[state]]
name = "on"
flow.z = "v"
outputs.F = "z"
[[state]]
name = "off"
flow.z = "0"
outputs.F = "0"
[[edge]]
name = "go"
from = "on"
to = "off"
guard = "z > 0.1"
"""
    (tmp_path / "own.toml").write_text(f'name = "own"\n{text}', encoding="utf-8")
    (tmp_path / "system.toml").write_text(
        """\
name = "two"
[[body]]
name = "sled"
inertia = 1.0
force = "1"
[[contact]]
name = "pad"
chart = "own.toml"
[run]
t_end = 2.0
""",
        encoding="utf-8",
    )
    with adapter() as client:
        client.launch(str(tmp_path / "system.toml"))
        source = {"path": str(tmp_path / "own.toml")}
        found = client.ask(
            "setBreakpoints", source=source, breakpoints=[{"line": 5}, {"line": 18}]
        )["breakpoints"]
        assert [each["verified"] for each in found] == [False, True]
        client.ask("configurationDone")
        client.event("stopped")
        client.go("continue")
        top = client.frames()[0]
        assert (top["source"]["name"], top["line"]) == ("own.toml", 16)


def test_breakpoints_of_a_file_replace_those_that_were_there() -> None:
    path = scenario_path(SQUEAL)
    line = path.read_text(encoding="utf-8").split("\n").index('name = "lift"') + 1
    with adapter() as client:
        client.launch(SQUEAL)
        client.ask("setFunctionBreakpoints", breakpoints=[{"name": "apart"}])
        for lines in ([line], [line, line + 6], []):
            given = [{"line": each} for each in lines]
            client.ask("setBreakpoints", source={"path": str(path)}, breakpoints=given)
        client.ask("configurationDone")
        client.event("stopped")
        assert client.said("breaks") == "  1  enter apart, all elements; hits: 0"


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ({"name": "arest"}, "there is no edge or state 'arest'; did you mean 'arrest'?"),
        ({"name": "v > 3 mm"}, "unit"),
        ({"name": "arrest", "condition": "z9 > 0"}, "unknown name 'z9'"),
        ({"name": "arrest", "hitCondition": "% 2"}, "'% 2' counts no hits"),
        ({"name": "arrest", "hitCondition": "0"}, "hits is 0"),
    ],
)
def test_what_is_wrong_with_a_breakpoint_is_its_message(wanted: dict[str, str], said: str) -> None:
    with adapter() as client:
        client.launch("pulled_mass")
        (found,) = client.ask("setFunctionBreakpoints", breakpoints=[wanted])["breakpoints"]
        assert not found["verified"]
        assert said in found["message"]


# --------------------------------------------------------------------------- looking, changing
def test_a_system_has_scopes_for_its_contacts_and_its_own_values() -> None:
    prompt = at_the_prompt(SQUEAL)
    answered(prompt, "goto 0.001")
    with adapter() as client:
        client.enter(SQUEAL)
        client.said("goto 0.001")
        scopes = client.ask("scopes", frameId=client.frames()[0]["id"])["scopes"]
        assert [each["name"] for each in scopes] == ["system", "face", "face 1", "pad", "pad 1"]
        shown = client.values("system") | client.values("pad") | client.values("pad 1")
        assert {"t", "v_x", "x_d", "k_x", "pad.F", "pad.state1", "pad.F1"} <= {*shown}
        for name in ("v_x", "k_x", "pad.F", "pad.v"):
            assert shown[name] == answered(prompt, f"print {name}")


def test_a_value_that_is_set_makes_a_branch_and_keeps_the_present_one() -> None:
    own = session()
    own.break_on("fires", "arrest")
    row = own.proceed()[0].row
    own.poke({"z": {1: 0.0}})
    with adapter() as client:
        in_a_cascade(client)
        reference = client.scope("element 2")
        set_ = client.ask("setVariable", variablesReference=reference, name="z2", value="0 um")
        assert set_["value"] == "0 m"
        assert client.event("stopped")["description"] == "branch 1, from branch 0: z2 = 0"
        assert client.frames()[0]["id"] - 1 == own.here.row == row + 1
        assert client.values("friction")["F"] == f"{1e3 * own.here.F:.9g} mN"
        client.said("branch 0")
        assert client.frames()[0]["id"] - 1 == row


def test_a_state_is_set_by_its_name() -> None:
    with adapter() as client:
        client.enter("pulled_mass")
        client.said("goto 0.05")
        reference = client.scope("element 3")
        client.ask("setVariable", variablesReference=reference, name="state3", value="Slip")
        assert client.values("element 3")["state3"] == "slip"


def test_the_console_takes_commands_and_expressions_and_completes_them() -> None:
    prompt = at_the_prompt()
    with adapter() as client:
        client.enter("pulled_mass")
        for line in ("n", "why 1", "p z1 / s1", "log", "where"):
            assert client.said(line) == answered(prompt, line), line
        assert client.said("abs(z1) < s1") == answered(prompt, "print abs(z1) < s1")
        found = client.ask("completions", text="why 1 arr", column=10)["targets"]
        assert found == [{"label": "arrest", "start": 7, "length": 3}]


def test_lines_from_0_are_understood() -> None:
    path = scenario_path(SQUEAL)
    head = path.read_text(encoding="utf-8").split("\n").index('name = "lift"') - 1
    with adapter() as client:
        client.ask("initialize", adapterID="gms-fsm", linesStartAt1=False)
        client.ask("launch", program=SQUEAL)
        given = {"source": {"path": str(path)}, "breakpoints": [{"line": head + 2}]}
        (found,) = client.ask("setBreakpoints", **given)["breakpoints"]
        assert (found["verified"], found["line"]) == (True, head)


def test_a_bank_of_many_elements_is_shown_one_by_one() -> None:
    many = [f"model.{name}={[number] * 300}" for name, number in (("k", 1e5), ("sigma", 25.0))]
    shares = f"model.shares={[1 / 300] * 300}"
    with adapter() as client:
        client.enter("pulled_mass", set=[*many, shares])
        assert client.values("element 300")["state300"] == "stick"


# --------------------------------------------------------------------------- the page
def page(name: str) -> Any:
    """Return a JSON file of the page on VS Code."""
    blocks = blocks_of((ROOT / "docs/howto/vscode.md").read_text(encoding="utf-8"))
    return json.loads(next(each.body for each in blocks if each.file == name))


def test_the_launch_file_of_the_page_launches_what_the_extension_declares() -> None:
    (declared,) = page("package.json")["contributes"]["debuggers"]
    keys = declared["configurationAttributes"]["launch"]
    for each in page("launch.json")["configurations"]:
        given = {
            name: value for name, value in each.items() if name not in ("type", "request", "name")
        }
        assert (each["type"], each["request"]) == (declared["type"], "launch")
        assert {*keys["required"]} <= {*given} <= {*keys["properties"]}
        given["program"] = given["program"].replace("${file}", str(scenario_path(SQUEAL)))
        with adapter() as client:
            client.enter(**given)


def test_the_extension_starts_the_verb() -> None:
    (declared,) = page("package.json")["contributes"]["debuggers"]
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"][
        "scripts"
    ]
    assert declared["runtime"] in scripts
    verbs = [each.name for each in app.registered_commands]
    assert declared["runtimeArgs"] == ["dap"]
    assert "dap" in verbs
