"""Scripts of the debugger reproduce the stories of the Fig. 4 run and of the pulled mass."""

from __future__ import annotations

import io

import pytest

from gms_fsm import simulate
from gms_fsm.app.debugger import run_debugger
from gms_fsm.app.scenario import load_scenario
from tests.helpers import ROOT

SCENARIOS = ROOT / "scenarios"
FIG_4 = "paper_fig4_stick_slip"
PULLED = "pulled_mass"


def talk(scenario: str, *commands: str, overrides: tuple[str, ...] = ()) -> str:
    """Return the transcript of commands given to a scenario."""
    loaded = load_scenario(SCENARIOS / f"{scenario}.toml", overrides)
    out = io.StringIO()
    script = io.StringIO("".join(f"{command}\n" for command in commands))
    assert run_debugger(loaded, script, out) == 0
    return out.getvalue()


def answers(scenario: str, *commands: str) -> list[str]:
    """Return the answer to each command."""
    parts = talk(scenario, *commands, "quit").split("\n(t=")
    return [part.partition("\n")[2] for part in parts[1 : len(commands) + 1]]


def test_fig_4_story() -> None:
    said = talk(
        FIG_4,
        "break fires break_away_backward element 2",
        "continue",
        "why 2",
        "back 10",
        "poke z2=-0.3",
        "run",
        "branch 0",
        "run",
        "compare 0 1",
        "quit",
    )
    expected = """\
Stick-slip (paper, Fig. 4)
GMS, 4 elements, published law; prescribed velocity, to t = 100 s
help lists the commands, where shows everything, quit exits.
(t=0.0000 s) break fires break_away_backward element 2
breakpoint 1: fires break_away_backward, element 2
(t=0.0000 s) continue
breakpoint 1: fires break_away_backward, element 2
row 51, t = 20.1406777 s, micro-step 1: v = -0.140931 m/s, F = -1.2408 N
  element 2: stick -> slip by break_away_backward
(t=20.1407 s) why 2
element 2 is in slip at t = 20.1406777 s
it has just left stick; the values are those before the firing
break_away_forward did not fire: z >= s is false by 0.8 m and v > v_c is false
  by 0.141 m/s.
break_away_backward fired here: every clause was true.
  1 break_away_forward: stick -> slip
    false  z >= s   left -0.4        right 0.4         margin -0.8 m
    false  v > v_c  left -0.14093    right 1e-06       margin -0.141 m/s
  2 break_away_backward: stick -> slip
    true   z <= -s   left -0.4        right -0.4        margin 0 (rounding)
    true   v < -v_c  left -0.14093    right -1e-06      margin +0.141 m/s
for the edges that leave slip: step, then why 2
(t=20.1407 s) back 10
"""
    assert said.startswith(expected)
    assert "branch 1, from branch 0: z2 = -0.3" in said
    assert "computed to t = 100 s; at its end" in said
    assert "branches 0 and 1 until t = 100 s: 50 and" in said
    assert "first different transition at t = " in said


@pytest.mark.slow
def test_pulled_mass_story() -> None:
    said = answers(
        PULLED,
        "break fires break_away_backward element 2",
        "continue",
        "why 2",
        "goto 3",
        "poke v=-0.5",
        "continue",
        "why 2",
        "back 10",
        "poke z2=-0.001",
        "run",
        "branch 1",
        "run",
        "compare 1 2",
        "branches",
    )
    # It is pulled forward and never breaks away backward by itself.
    assert said[1].startswith("no breakpoint was hit\nrow 1998, t = 60 s")
    assert "arrest does not fire: |v| <= v_c is false by" in said[2]
    assert said[4].startswith("branch 1, from branch 0: v = -0.5")
    assert said[5].startswith("breakpoint 1: fires break_away_backward, element 2")
    assert "element 2: stick -> slip by break_away_backward" in said[5]
    assert "break_away_backward fired here: every clause was true." in said[6]
    assert "from branch 1: z2 = -0.001" in said[8]
    assert said[9].startswith("branch 2:")
    assert said[9].endswith("at its end")
    assert "branches 1 and 2 until t = 60 s" in said[12]
    assert said[13].count("computed to t = 60 s; at its end") == 3


@pytest.mark.parametrize(
    "commands", [("goto 25", "why 1"), ("g", "goto 25", "where", "why"), ("u t >= 25", "why")]
)
def test_why_element_1_does_not_arrest_is_known_within_five_commands(
    commands: tuple[str, ...],
) -> None:
    said = talk(FIG_4, *commands, "quit")
    assert len(commands) <= 5
    assert "element 1 is in slip" in said
    assert "arrest does not fire: |z| < s is false by 0.776 m." in said


def test_the_way_to_the_answer_is_in_the_help() -> None:
    first = answers(FIG_4, "help")[0]
    assert "goto 25" in first.splitlines()[0]
    assert "why 1" in first.splitlines()[0]


def test_under_the_signed_law_it_does_arrest() -> None:
    said = talk(FIG_4, "goto 25", "why 1", overrides=("model.law=signed",))
    assert "element 1 is in stick" in said


@pytest.mark.parametrize("scenario", [FIG_4, PULLED])
def test_every_transition_of_the_log_is_shown(scenario: str) -> None:
    loaded = load_scenario(SCENARIOS / f"{scenario}.toml")
    log = simulate(loaded.model, loaded.rig, **loaded.arguments).transitions
    said = answers(scenario, *["next"] * (len(log) + 1), "log 1000")
    for record, text in zip(log, said, strict=False):
        assert f"t = {record.t:.9g} s, micro-step " in text
        assert (
            f"element {record.element + 1}: {record.source} -> {record.target} by {record.edge}"
            in text
        )
    assert "end of the run" in said[-2]
    assert len(said[-1].splitlines()) == len(log)


@pytest.mark.slow
def test_the_same_script_gives_the_same_transcript() -> None:
    script = ("until z2 < -0.3", "poke z1=0.1", "next", "where", "list", "prev", "compare")
    assert talk(FIG_4, *script) == talk(FIG_4, *script)
