"""Every command answers; a mistake is one message, never a traceback, and the session continues."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pytest

from gms_fsm import Prescribed
from gms_fsm.app.debugger import ALIASES, COMMANDS, Debugger, help_of
from gms_fsm.inspection.session import Session
from tests.app.test_debugger_transcripts import FIG_4, PULLED, answers, talk
from tests.helpers import FIG4_SINE, stick_slip


def _debugger(*, typed: bool = False) -> Debugger:
    session = Session(stick_slip("published"), Prescribed(FIG4_SINE), 100.0)
    made = Debugger(session, "", io.StringIO(), io.StringIO())
    made.typed = typed
    return made


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_usage_and_an_example_that_works(
    name: str, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    made = _debugger()
    text = made.reply(f"help {name}")
    assert text.startswith(COMMANDS[name].usage.split()[0])
    for example in help_of(name, made.session).examples:
        assert f"example: {example}" in text
        for line in ("goto 20", "watch x", "b arrest", "poke z1=0.1", "run", "save mine.json"):
            assert "error" not in made.reply(line)
        if name != "plot":
            assert "error:" not in made.reply(example)


def test_the_overview_names_every_command() -> None:
    text = _debugger().reply("help")
    assert len(text.splitlines()) < 24
    for name, each in COMMANDS.items():
        assert (f"{name} ({each.alias})" if each.alias else name) in text


@pytest.mark.parametrize(
    ("alias", "name"),
    [
        ("s", "step"),
        ("b", "break"),
        ("n", "next"),
        ("c", "continue"),
        ("u", "until"),
        ("w", "where"),
        ("p", "print"),
        ("l", "list"),
        ("q", "quit"),
    ],
)
def test_short_names_are_those_of_pdb(alias: str, name: str) -> None:
    assert ALIASES[alias] == name


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("stpe", "did you mean step?"),
        ("xyzzy", "help lists all commands"),
        ("step many", "'many' is not an integer; usage: step [N]"),
        ("step 0", "usage: step [N]"),
        ("step -3", "is not an integer"),
        ("back 1.5", "is not an integer"),
        ("step 99999999999999999999", "is not an integer"),
        ("next 3", "next takes no argument"),
        ("goto", "usage: goto T, for example: goto 25"),
        ("goto yesterday", "'yesterday' is not a time"),
        ("goto -1", "is before the start"),
        ("goto nan", "is before the start"),
        ("until", "a condition is missing; usage: until CONDITION"),
        ("until z9 > 0", "unknown name 'z9'"),
        ("until z1 >", "column"),
        ("why 5", "no element 5; there are 1 to 4"),
        ("why 0", "no element 0"),
        (
            "why one",
            "'one' is not an edge; there are break_away_forward, break_away_backward, arrest; "
            "usage: why [ELEMENT] [EDGE], for example: why 2 break_away_forward",
        ),
        ("why 1 arest", "'arest' is not an edge"),
        ("why arrest 1", "'arrest 1' is not an edge"),
        ("why 1.5", "'1.5' is not an edge"),
        ("why 99999999999", "is not an integer; usage: why [ELEMENT] [EDGE]"),
        ("why arrest", "arrest leaves slip; element 1 is in stick"),
        ("why 2 Arrest", "arrest leaves slip; element 2 is in stick"),
        ("element", "usage: element N"),
        ("element arrest", "'arrest' is not an integer; usage: element N"),
        ("print", "an expression is missing"),
        ("print 1 / x", "cannot be computed here"),
        ("print 1 / x > 2", "cannot be computed here"),
        ("print __import__('os')", "unknown function"),
        ("print z1 = 3", "column"),
        ("watch z9", "unknown name 'z9'"),
        ("print z", "unknown name 'z'; for element 1 write z1; allowed: the names t, x"),
        ("until z > 1", "unknown name 'z'; for element 1 write z1"),
        ("print sgn", "the function 'sgn' needs (...)"),
        ("unwatch 1", "there is no number 1; there are 0"),
        ("break arest", "edges: break_away_forward"),
        ("break fired arrest", "is not a breakpoint; usage: break"),
        ("break fires slip", "no edge 'slip'"),
        ("break enter arrest", "no state 'arrest'"),
        ("break arrest element 7", "no element 7"),
        ("break arrest if z9 > 1", "unknown name 'z9'"),
        ("break arrest hits 0", "at least 1"),
        ("break arrest if", "is not a breakpoint"),
        ("clear", "is not an integer"),
        ("clear 3", "there is no number 3"),
        ("poke", "nothing to poke"),
        ("poke z1", "'z1' cannot be poked; usage: poke z1=VALUE"),
        ("poke z=1", "'z' cannot be poked; for element 1 write z1"),
        ("poke state=slip", "'state' cannot be poked; for element 1 write state1"),
        ("poke v", "'v' cannot be poked"),
        ("poke z1=", "cannot be poked"),
        ("poke q1=3", "cannot be poked"),
        ("poke z9=0", "no element 9; there are 1 to 4"),
        ("poke z1=nan", "unknown name 'nan'"),
        ("poke z1=1e999", "column"),
        ("poke v=0.1", "prescribes the velocity"),
        ("poke state1=slipp", "'stick', 'slip'"),
        ("branch 3", "no branch 3; there are 0 to 0"),
        ("branch", "usage: branch N"),
        ("compare", "branch 0 has no parent"),
        ("compare 0", "two branches are needed"),
        ("compare 0 4", "no branch 4"),
        ("plot", "a file name is missing"),
        ("plot picture.bmp", "must end in .png, .svg or .pdf"),
        ("save", "a file name is missing"),
        ("save no/folder/here.json", "cannot write"),
        ("load", "a file name is missing"),
        ("load nothing.json", "no such file"),
        ("help nonsense", "unknown command 'nonsense'"),
        ("quit now", "quit takes no argument"),
        ("log 0", "usage: log [N]"),
        ("where now", "takes no argument"),
    ],
)
def test_a_mistake_is_one_message(command: str, said: str) -> None:
    answer, after = answers(FIG_4, command, "print t")
    # printed on one line, or wrapped
    assert answer.startswith("error: ")
    assert said in " ".join(answer.split())
    assert answer.count("error:") == 1
    assert "Traceback" not in answer
    assert after == "0"


def test_an_unexpected_failure_does_not_end_the_session(monkeypatch: pytest.MonkeyPatch) -> None:
    made = _debugger()
    monkeypatch.setattr(made.commands, "do_where", lambda arg: 1 / 0)
    assert made.reply("where") == "error: ZeroDivisionError: division by zero"
    assert made.reply("print t") == "0"


def test_moves() -> None:
    said = answers(FIG_4, "s", "step 3", "back", "back 100", "goto 12.5", "prev", "prev", "n")
    assert [text.split(",")[0] for text in said] == [
        "row 1",
        "row 4",
        "row 3",
        "row 0",
        "row 34",
        "row 33",
        "row 32",
        "row 33",
    ]
    assert "element 4: slip -> stick by arrest" in said[4]


def test_next_reports_that_there_is_no_other() -> None:
    said = answers(FIG_4, "goto 99.9", "next", "next", "next")[3]
    assert said.startswith("no transition before the end\nrow 330, t = 100 s")


def test_until_reports_where_and_whether() -> None:
    said = answers(FIG_4, "u z1 > 0.123", "u state(1) == slip", "u z1 > 99")
    assert said[0].startswith("between rows 8 and 9, t = 2.60048188")
    assert "element 1: stick -> slip by break_away_forward" in said[1]
    assert said[2].startswith("it does not become true before the end\nrow 330, t = 100 s")


@pytest.mark.slow
def test_until_stays_if_the_condition_is_always_true() -> None:
    said = answers(FIG_4, "goto 25", "u t > 1", "s", "u t > 30", "u t > 30", "u t > 30.1")
    stays = "it is already true here and does not become true again; until stops where it becomes"
    assert " ".join(said[1].split()) == " ".join(f"{stays} true {said[0]}".split())
    assert said[2].startswith("row 74")
    assert "t = 30 s" in said[3]
    assert " ".join(said[4].split()).startswith(stays)
    assert said[4].endswith(said[3])  # the located place, too, is kept
    assert "t = 30.1 s" in said[5]


def test_until_continues_to_where_it_becomes_true_again() -> None:
    said = answers(FIG_4, "u v > 0.1", "u v > 0.1", "u v > 0.1")
    times = [float(text.split("t = ")[1].split(" s")[0]) for text in said]
    assert times == sorted(set(times))


@pytest.mark.parametrize("command", ["step", "step 3", "next", "continue", "until z1 > 9", "u t>1"])
def test_at_the_end_only_back_works(command: str) -> None:
    said = answers(FIG_4, "goto 100", "b arrest", command, "print t", "back", command)
    assert said[2] == "error: this is the end of the run; go back first"
    assert said[3] == "100"
    assert "error" not in said[5]


def test_print_and_watch() -> None:
    said = answers(
        FIG_4,
        "p s1",
        "p state(1) == stick and z1 < 1",
        "p not t > -1",
        "watch z1 / s1",
        "watch state(2) == slip",
        "watch",
        "goto 25",
        "unwatch 1",
        "unwatch all",
    )
    assert said[:3] == ["1.5", "true", "false"]
    assert said[5] == "  watch 1: z1 / s1 = 0\n  watch 2: state(2) == slip = false"
    assert "  watch 1: z1 / s1 = -1.51743" in said[6]
    assert said[7] == "  watch 1: state(2) == slip = false"
    assert said[8] == "no watch is set"


def test_a_watch_that_cannot_be_computed_does_no_harm() -> None:
    said = answers(FIG_4, "s", "watch 1 / z1", "back", "s")
    assert "watch 1: 1 / z1 = '1 / z1' cannot be computed here" in " ".join(said[2].split())
    assert "row 1" in said[3]


def test_breakpoints() -> None:
    said = answers(
        FIG_4,
        "c",
        "goto 0",
        "b",
        "b arrest 2",
        "b enter slip element 3 if v < 0 hits 2",
        "b tested break_away_forward all",
        "breaks",
        "clear 3",
        "c",
        "c",
        "clear all",
        "b",
    )
    assert said[0].startswith("no breakpoint is set\nrow 330")
    assert said[2] == "no breakpoint is set"
    assert said[3] == "breakpoint 1: fires arrest, element 2"
    assert said[4] == "breakpoint 2: enter slip, element 3, if v < 0, from hit 2 on"
    assert said[5] == "breakpoint 3: tested break_away_forward, all elements"
    assert said[6].splitlines()[1].endswith("from hit 2 on; hits: 0")
    assert len(said[7].splitlines()) == 2
    assert said[8].startswith("breakpoint 1")
    assert "t = 12.4999735 s" in said[8]
    assert said[9].startswith("breakpoint 1")
    assert "t = 24.9999735 s" in said[9]
    assert said[11] == "no breakpoint is set"


def test_poke_by_expression_and_branches(tmp_path: Path) -> None:
    said = answers(
        FIG_4,
        "goto 25",
        "poke z1 = -0.9*s1 state4=slip",
        "p z1 / s1",
        "why 1",
        "next",
        "branch 0",
        "branches",
        "run",
        "compare 0 1",
    )
    assert said[1].startswith("branch 1, from branch 0: z1 = -1.35, state 4 = slip\nrow 74")
    assert said[2] == "-0.9"
    assert "arrest fires next: every clause is true." in said[3]
    assert "element 1: slip -> stick by arrest" in said[4]
    assert said[6].startswith("> 0  ")
    assert "     from branch 0 at t = 24.9999735 s: z1 = -1.35, state 4 = slip" in said[6]
    assert said[7].endswith("at its end")
    assert said[8].startswith("branches 0 and 1 until t = 100 s: 50 and 51 transitions")
    assert "(t=25.0000 s, branch 1) " in talk(FIG_4, "goto 25", "poke z1=0")


def test_a_velocity_can_be_poked_where_there_is_a_mass() -> None:
    said = answers(PULLED, "goto 3", "poke v=-0.25", "p v")
    assert said[1].startswith("branch 1, from branch 0: v = -0.25")
    assert said[2] == "-0.25"


def test_save_and_load(tmp_path: Path) -> None:
    path = tmp_path / "a session.json"
    said = answers(
        FIG_4,
        "goto 25",
        "watch z1",
        "b arrest",
        "poke z1=0",
        "run",
        f"save {path}",
        "goto 0",
        "branch 0",
        "clear all",
        f'load "{path}"',
        "branches",
        "breaks",
    )
    assert said[5].startswith("written to")
    assert "2 branches" in said[9]
    assert "row 74, t = 24.9999735 s" in said[9]
    assert "watch 1: z1 = 0" in said[9]
    assert "> 1  " in said[10]
    assert said[11] == "  1  fires arrest, all elements; hits: 0"


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_plot(tmp_path: Path, suffix: str) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / f"branches.{suffix}"
    said = answers(FIG_4, f"plot {path}", "goto 25", "poke z1=0", f"plot {path}", "branches")
    for answer in (said[0], said[3]):
        assert answer.replace("\n", "").replace(" ", "").startswith("writtento")
    assert said[4].count("at its end") == 2
    assert path.stat().st_size > 5000


def test_list_draws_the_chart_of_the_chosen_element() -> None:
    said = answers(FIG_4, "goto 25", "list", "element 2", "l")
    assert said[1].splitlines()[0].startswith("element 1 of 4: GMS element, published law")
    assert "> | slip  ACTIVE" in said[1]
    assert "[|v| <= v_c && |z| < s]  true false" in said[1]
    assert "1 arrest -> stick  FIRED" not in said[1]
    assert "> | stick  ACTIVE" in said[3]
    assert "dz = sgn(v) * C * (1 - z / s)" in said[3]
    fired = answers(FIG_4, "next", "list")[1]
    assert "1 break_away_forward -> slip  FIRED" in fired


def test_where_shows_every_element_and_the_states_over_time() -> None:
    said = answers(FIG_4, "goto 100", "goto 25", "where")[2].splitlines()
    assert said[0] == "t = 24.9999735 s, row 73, micro-step 3, branch 0"
    assert " ".join(said[3].split()) == "> 1 slip -2.276 1.5 1.517 [########> -1.669 1:yn"
    assert said[6].split()[-1] == "1:yy*"
    ribbons = {line.split()[0]: line[6:] for line in said if line.startswith(" E")}
    assert len(ribbons) == 4
    for ribbon in ribbons.values():
        assert len(ribbon) == 74
        assert set(ribbon) == {"-", "#"}
    # Element 1 slips through 25 s, element 2 does not.
    assert ribbons["E1"][17:19] == "##"
    assert ribbons["E2"][17:19] == "#-"
    assert said[-2].index("^") == 6 + 18


def test_an_uncomputed_part_of_a_ribbon_is_blank() -> None:
    said = answers(FIG_4, "goto 25", "where")[1]
    assert any(line.startswith(" E1") and len(line) < 30 for line in said.splitlines())


def test_an_empty_line_repeats_a_move_only_when_typed() -> None:
    assert answers(FIG_4, "step 2", "", "print t")[1] == ""
    made = _debugger(typed=True)
    assert made.reply("") == ""
    assert made.reply("step 2").startswith("row 2")
    assert made.reply("").startswith("row 4")
    made.reply("print t")
    assert made.reply("").startswith("row 6")


def test_comments_are_ignored() -> None:
    said = answers(FIG_4, "# find the row", "goto 25")
    assert said[0] == ""
    assert said[1].startswith("row 73")


def test_the_end_of_input_is_a_quiet_quit() -> None:
    assert talk(FIG_4, "goto 25").endswith("(t=25.0000 s) \n")
    assert talk(FIG_4, "goto 25", "q", "goto 50").endswith("(t=25.0000 s) q\n")


@pytest.mark.parametrize(
    ("line", "text", "words"),
    [
        ("", "st", ["step"]),
        ("", "b", ["back", "break", "breaks", "branches", "branch"]),
        ("b fires ", "break_", ["break_away_forward", "break_away_backward"]),
        ("break ", "sl", ["slip"]),
        ("break ", "te", ["tested"]),
        ("until ", "z", ["z1", "z2", "z3", "z4"]),
        ("p ", "state(", ["state(1)", "state(2)", "state(3)", "state(4)"]),
        ("poke ", "state1", ["state1="]),
        ("poke state1=", "s", ["stick", "slip"]),
        ("why ", "", ["1", "2", "3", "4", "break_away_forward", "break_away_backward", "arrest"]),
        ("why 1 ", "arr", ["arrest"]),
        ("element ", "", ["1", "2", "3", "4"]),
        ("help ", "go", ["goto"]),
        ("branch ", "", ["0"]),
        ("clear ", "", ["all"]),
        ("unwatch ", "", ["all"]),
        ("goto ", "", []),
    ],
)
def test_completion(line: str, text: str, words: list[str]) -> None:
    made = _debugger()
    whole = line + text
    if line:
        found = made.completedefault(text, whole, len(line), len(whole))
    else:
        found = made.completenames(text)
    assert sorted(found) == sorted(words)


def test_a_livelock_is_shown_and_can_be_stepped_back_from() -> None:
    from tests.inspection.test_session_failures_are_outcomes import both_ways

    made = Debugger(Session(both_ways(), Prescribed("0.15"), 20.0), "", None, io.StringIO())
    said = made.reply("goto 20")
    assert "the run cannot continue: element 2 at t = 6.66666" in said
    assert "go back and look, or poke a value to continue in a new branch" in said
    assert "the run cannot continue" in made.reply("where")
    assert "it cannot continue" in made.reply("branches")
    assert "fired here" in made.reply("why 2")
    assert made.reply("back 3").startswith("row ")
    assert made.reply("poke z2=0").startswith("branch 1")
    assert "the run cannot continue" not in made.reply("goto 12")


def test_a_guard_that_cannot_be_computed_is_reported() -> None:
    from gms_fsm import Chart, ChartModel, State, Stribeck, Transition

    chart = Chart(
        "bad",
        ("v",),
        ("z",),
        ("k",),
        (State("on", {"z": "v"}), State("off", {"z": "0"})),
        (Transition("go", "on", "off", guard="0 / (z - z) > 0"),),
        {"F": "k * z"},
    )
    model = ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.5, 0.1))
    made = Debugger(Session(model, Prescribed("1"), 1.0), "", None, io.StringIO())
    assert "cannot be computed here" in made.reply("why")
    assert " ?" in made.reply("where")
    assert "the run cannot continue" in made.reply("step")
    assert "the run cannot continue" in made.reply("where")
