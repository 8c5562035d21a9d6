"""With a custom chart the debugger uses its names of variables, states and edges."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, Transition
from gms_fsm.app.debugger import COMMANDS, Debugger, help_of, scenario_to_debug
from gms_fsm.errors import ScenarioError
from gms_fsm.inspection.session import Session
from tests.helpers import ROOT, stick_slip

SCENARIOS = ROOT / "scenarios"


def contact(n: int = 1) -> ChartModel:
    """Three states, two variables; w decays while the contact moves."""
    chart = Chart(
        "warming contact",
        ("v", "s"),
        ("z", "w"),
        ("k", "tau"),
        (
            State("static", {"z": "v", "w": "0"}),
            State("rising", {"z": "v", "w": "(1 - w) / tau"}),
            State("kinetic", {"z": "0", "w": "-w / tau"}),
        ),
        (
            Transition("break_away", "static", "rising", guard="abs(z) >= s"),
            Transition("let_go", "rising", "kinetic", guard="w > 0.5"),
            Transition("arrest", "kinetic", "static", guard="abs(v) <= 0.01", actions={"z": "0"}),
        ),
        {"F": "k * z"},
    )
    values = {"k": 1.0, "tau": 1.0}
    return ChartModel(chart, values, n=n, stribeck=Stribeck(0.1, 0.2, 0.1), weights=[1.0] * n)


def own(n: int = 1, t_end: float = 8.0) -> Debugger:
    """Return a debugger on that contact, moved back and forth."""
    session = Session(contact(n), Prescribed("0.2*sin(t)"), t_end)
    return Debugger(session, "", io.StringIO(), io.StringIO())


@pytest.mark.parametrize("title", ["", "My contact"])
def test_it_greets_without_a_scenario(title: str) -> None:
    out = io.StringIO()
    made = Debugger(own().session, title, io.StringIO("next\nquit\n"), out)
    assert made.run() == 0
    said = out.getvalue().splitlines()
    assert said[: bool(title)] == [title] * bool(title)
    assert said[bool(title) :][:3] == [
        "warming contact; prescribed velocity, to t = 8 s",
        "help lists the commands, where shows everything, quit exits.",
        "(t=0.0000 s) next",
    ]


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("n", [1, 3])
def test_help_has_examples_of_this_session(
    name: str, n: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    made = own(n, 0.7)
    for line in ("watch x", "b arrest", "poke w1=0.1", "run", "save mine.json"):
        assert "error" not in made.reply(line)
    text = made.reply(f"help {name}")
    assert "slip" not in text
    assert "{" not in text
    examples = help_of(name, made.session).examples
    assert examples
    for example in examples:
        assert f"example: {example}" in text
        if name != "plot":
            made.reply("goto 0.1")
            assert "error:" not in made.reply(example)


def test_help_without_a_threshold_or_an_edge() -> None:
    chart = Chart("spring", ("v",), ("u",), ("k",), (State("on", {"u": "v"}),), (), {"F": "k * u"})
    model = ChartModel(chart, {"k": 1.0}, n=2, stribeck=Stribeck(1.0, 1.0, 1.0))
    session = Session(model, Prescribed("0.1"), 2.0, t_start=1.0)
    made = Debugger(session, "", io.StringIO(), io.StringIO())
    assert made.reply("help").startswith(
        "To find out why an element switches or does not:  goto 1.25   then   why 1\n"
    )
    assert help_of("print", made.session).examples == ("print F1", "p state(2) == on")
    assert help_of("break", made.session).examples == ("b enter on if v < 0 hits 3",)
    assert help_of("poke", made.session).examples == ("poke u1=0", "poke state2=on")
    assert help_of("poke", made.session).usage.startswith("poke u1=VALUE")
    for name in COMMANDS:
        assert help_of(name, made.session).examples
        assert "error:" not in made.reply(f"help {name}")
    assert "no edge leaves this state" in made.reply("why")
    assert made.reply("why go").startswith("error: 'go' is not an edge; there are none")
    assert made.reply("where").splitlines()[2].split() == [
        "el",
        "state",
        "u",
        "F_i",
        "[N]",
        "edges",
    ]


def test_every_variable_can_be_poked() -> None:
    made = own(2)
    made.reply("goto 1")
    said = made.reply("poke w2=0.25 z1 = 2*z2 state2=Rising")
    z = made.session.watch("z2")
    assert said.startswith(
        f"branch 1, from branch 0: w2 = 0.25, z1 = {2 * z:.6g}, state 2 = rising"
    )
    assert made.reply("print w2") == "0.25"
    assert made.reply("print w1") == "0"
    assert made.session.here.z == (2 * z, z)
    assert "w2 = 0.25" in made.reply("branches")
    assert made.reply("poke w9=1") == "error: no element 9; there are 1 to 2"
    assert made.reply("poke w=1") == "error: 'w' cannot be poked; for element 1 write w1"
    assert made.reply("poke q1=1").startswith("error: 'q1=1' cannot be poked; usage: poke z1=VALUE")
    assert made.completedefault("w", "poke w", 5, 6) == ["w1=", "w2="]


def test_a_single_element_needs_no_number() -> None:
    made = own()
    assert made.reply("poke w=0.25 state=rising").startswith(
        "branch 1, from branch 0: w1 = 0.25, state 1 = rising"
    )
    assert made.reply("print w") == made.reply("print w1") == "0.25"
    assert made.reply("print state == RISING") == "true"
    assert "w = 0.5" in made.reply("watch w + 0.25").replace("w + 0.25", "w")
    assert made.reply("until w > 0.3").startswith("between rows")
    assert made.session.watch("w1") == pytest.approx(0.3)


def test_with_several_elements_a_number_is_required() -> None:
    made = own(2)
    for command in ("print w", "watch 2*w", "until w > 0", "b arrest if w > 0", "poke z1=w"):
        assert "unknown name 'w'; for element 1 write w1; allowed:" in " ".join(
            made.reply(command).split()
        )
    assert "for element 1" not in made.reply("print q")


def test_where_has_one_column_per_variable() -> None:
    made = own(2)
    made.reply("poke w2=0.125")
    said = made.reply("where").splitlines()
    assert said[2].split() == [
        "el",
        "state",
        "z",
        "[m]",
        "w",
        "s",
        "[m]",
        "|z|/s",
        "F_i",
        "[N]",
        "edges",
    ]
    assert said[4].split() == ["2", "static", "0", "0.125", "0.2", "0.000", "0", "1:n"]
    assert [line.index("1:n") for line in said[3:5]] == [said[2].index("edges")] * 2


def test_where_puts_edges_without_room_on_a_separate_line() -> None:
    names = ("a", "b", "c", "d")
    flows = dict.fromkeys(names, "v")
    edges = tuple(Transition(f"e{i}", "on", "off", guard=f"a > {i} and b > 9") for i in range(1, 5))
    chart = Chart(
        "wide",
        ("v",),
        names,
        ("k",),
        (State("on", flows), State("off", flows)),
        edges,
        {"F": "k * a"},
    )
    model = ChartModel(chart, {"k": 1.0}, n=2, stribeck=Stribeck(1.0, 1.0, 1.0))
    session = Session(model, Prescribed("0.1"), 2.0)
    said = Debugger(session, "", io.StringIO(), io.StringIO()).reply("where").splitlines()
    assert said[2].split() == ["el", "state", *names, "F_i", "[N]", "edges"]
    assert said[4] == "      1:nn 2:nn 3:nn 4:nn"
    assert max(map(len, said)) <= 80


def test_why_takes_an_edge() -> None:
    made = own(2)
    said = made.reply("why break_away")
    assert said == made.reply("why 1 BREAK_AWAY")
    assert said.splitlines()[1] == "break_away does not fire: |z| >= s is false by 0.2 m."
    assert made.reply("why let_go") == "error: let_go leaves rising; element 1 is in static"
    assert made.reply("why 2 let_go") == "error: let_go leaves rising; element 2 is in static"
    assert "'let' is not an edge; there are break_away, let_go, arrest" in made.reply("why 1 let")


@pytest.mark.slow
def test_after_a_firing_why_says_how_to_explain_the_new_state() -> None:
    made = own(2)
    assert "element 1: static -> rising by break_away" in made.reply("next")
    said = made.reply("why").splitlines()
    assert said[1] == "it has just left static; the values are those before the firing"
    assert said[2] == "break_away fired here: every clause was true."
    assert said[-1] == "for the edges that leave rising: step, then why"
    new = made.reply("why let_go")  # given by name, it is shown immediately
    assert new.splitlines()[1] == "let_go does not fire: w > 0.5 is false by 0.5."
    assert "just left" not in new
    assert "step, then" not in made.reply("why break_away")
    made.reply("element 2")
    assert (
        made.reply("why 1").splitlines()[-1] == "for the edges that leave rising: step, then why 1"
    )
    made.reply("step")
    assert "let_go does not fire" in made.reply("why 1")


def test_where_the_run_ends_with_a_firing_no_step_is_promised() -> None:
    from tests.inspection.test_session_failures_are_outcomes import both_ways

    made = Debugger(Session(both_ways(), Prescribed("0.15"), 20.0), "", None, io.StringIO())
    made.reply("goto 20")
    said = made.reply("why 2")
    assert "fired here" in said
    assert "step, then why" not in said


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("break Rising", "breakpoint 1: enter rising, all elements"),
        ("break LEAVE Rising", "error"),  # a kind is no name
        ("break leave RISING element 1", "breakpoint 1: leave rising, element 1"),
        ("break Break_Away", "breakpoint 1: fires break_away, all elements"),
        (
            "b arrest if state(1) == Kinetic",
            "breakpoint 1: fires arrest, all elements, if state(1) == kinetic",
        ),
        ("print state(1) == STATIC", "true"),
        ("print not state( 1 ) != Static and v < 1", "true"),
        ("until state(1)==Rising", "row 11"),
        ("poke state1=KINETIC", "branch 1, from branch 0: state 1 = kinetic"),
        ("why Break_away", "element 1 is in static"),
        ("break Risen", "error: no edge or state 'Risen'; edges: break_away"),
        ("print state(1) == Risen", "error: column 13: unknown state"),
    ],
)
def test_capitals_do_not_matter(command: str, said: str) -> None:
    assert own().reply(command).startswith(said)


def test_capitals_matter_where_only_they_differ() -> None:
    flow = {"z": "v"}
    chart = Chart(
        "two cases",
        ("v",),
        ("z",),
        ("k",),
        (State("on", flow), State("ON", flow)),
        (Transition("go", "on", "ON", guard="z > 1"), Transition("Go", "ON", "on", guard="z < 0")),
        {"F": "k * z"},
    )
    model = ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.0, 1.0))
    session = Session(model, Prescribed("0.1"), 2.0)
    made = Debugger(session, "", io.StringIO(), io.StringIO())
    assert made.reply("break ON") == "breakpoint 1: enter ON, all elements"
    assert made.reply("break Go") == "breakpoint 2: fires Go, all elements"
    assert made.reply("break On").startswith("error: no edge or state 'On'; edges: go, Go; states:")
    assert made.reply("print state(1) == ON") == "false"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "mine.py",
            "mine.py is a Python file; debug takes a scenario (.toml); for a custom model use "
            "Debugger(Session(model, rig, t_end)).run(), see docs/howto/debugging.md",
        ),
        (
            "t.npz",
            "t.npz is a trace; `gms-fsm replay t.npz` steps through it; debug takes a "
            "scenario (.toml)",
        ),
        (
            "t.CSV",
            "t.CSV is a trace; `gms-fsm replay t.CSV` steps through it; debug takes a "
            "scenario (.toml)",
        ),
    ],
)
def test_other_files_are_rejected_with_advice(name: str, said: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        scenario_to_debug(name)
    assert str(caught.value) == said


def test_a_scenario_is_read_and_a_missing_one_named() -> None:
    path = SCENARIOS / "paper_fig4_stick_slip.toml"
    loaded = scenario_to_debug(path, ["model.law=signed"])
    assert loaded.model.title == stick_slip("signed").title
    with pytest.raises(ScenarioError, match="no such file"):
        scenario_to_debug("none.toml")
