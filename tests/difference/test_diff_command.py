"""Claim: ``gms-fsm diff`` says what differs; its exit code is 0, 1 or 2."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from gms_fsm import Prescribed, simulate
from gms_fsm.charts import gms_element
from tests.helpers import stick_slip
from tests.scenario_files import CommandLine


def graphviz() -> None:
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")


def saved(name: str, guard: str) -> str:
    text = (
        'name = "window"\nvariables = ["z"]\nparameters = ["c"]\n'
        '[outputs]\nF = "z"\n'
        '[[state]]\nname = "inside"\nflow = {z = "v"}\n[[state]]\nname = "outside"\n'
        f'[[edge]]\nname = "leave"\nfrom = "inside"\nto = "outside"\nguard = "{guard}"\n'
    )
    Path(name).write_text(text, encoding="utf-8")
    return name


@pytest.mark.parametrize(
    ("other", "code", "last"),
    [
        ("z > c", 0, "equal"),
        ("not c >= z", 0, "equivalent: only names, order and spelling differ"),
        ("z > c + 1", 1, "  for example at c = 1, z = 2"),
    ],
)
def test_the_exit_code_says_whether_they_do_the_same(
    gms_fsm: CommandLine, other: str, code: int, last: str
) -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    answer = gms_fsm("diff", saved("a.toml", "z > c"), saved("b.toml", other))
    assert (answer.code, answer.err) == (code, "")
    assert answer.out.splitlines()[0] == "a.toml -> b.toml"
    assert answer.out.splitlines()[-1] == last


def test_undecided_is_2(gms_fsm: CommandLine) -> None:
    answer = gms_fsm("diff", saved("a.toml", "exp(z) > 1"), saved("b.toml", "z > 0"))
    assert answer.code == 2
    assert "undecided: " in answer.out


def test_an_included_chart_has_its_law_behind_a_colon(gms_fsm: CommandLine) -> None:
    gms_element("signed").save("mine.toml")
    assert gms_fsm("diff", "gms:signed", "mine.toml").code == 0
    assert gms_fsm("diff", "gms:published", "mine.toml").code == 1


def test_scenarios_are_run_until_they_differ(gms_fsm: CommandLine) -> None:
    gms_fsm("copy", "pulled_mass", "-o", "a.toml")
    text = Path("a.toml").read_text(encoding="utf-8")
    assert "speed" in text
    lines = ["speed = 0.0011" if line.startswith("speed") else line for line in text.splitlines()]
    Path("b.toml").write_text("\n".join(lines), encoding="utf-8")
    answer = gms_fsm("diff", "a.toml", "b.toml")
    assert answer.code == 1
    assert "same chart, other numbers: first difference at transition" in answer.out
    plain = gms_fsm("diff", "a.toml", "b.toml", "--no-run")
    assert "transition" not in plain.out


def test_two_traces_are_compared(gms_fsm: CommandLine) -> None:
    for name, velocity in (("a.npz", "0.2"), ("b.npz", "0.3")):
        simulate(stick_slip("signed"), Prescribed(velocity), 3.0, engine="ifelse").save(name)
    assert gms_fsm("diff", "a.npz", "a.npz").out.splitlines()[1] == "equal"
    answer = gms_fsm("diff", "a.npz", "b.npz")
    assert answer.code == 1
    assert "first difference at transition 1" in answer.out


@pytest.mark.slow
def test_one_picture_shows_both(gms_fsm: CommandLine) -> None:
    graphviz()
    answer = gms_fsm(
        "diff", saved("a.toml", "z > c"), saved("b.toml", "z > c and v > 0"), "-o", "d.svg"
    )
    assert answer.out.splitlines()[-1] == "d.svg"
    text = Path("d.svg").read_text(encoding="utf-8")
    assert "was" in text
    assert "different" in text


RUN = """\
name = "s"
[[body]]
name = "a"
inertia = 1.0
force = "1"
[[contact]]
name = "pad"
chart = "stiction"
values = { F_c = 1.0, F_s = 1.5, b = 0.0 }
[run]
t_end = 1.0
[initial]
a.x = 0.0
"""


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("a.x = 0.0", "a.x = 0.5", "  ~ initial a.x: 0 -> 0.5"),
        ("t_end = 1.0", "t_end = 2.0", "  ~ setting t_end: 1 -> 2"),
        ("t_end = 1.0", "t_end = 1.0\nrtol = 1e-8", "  ~ setting rtol: 1e-06 -> 1e-08"),
        ("t_end = 1.0", 't_end = 1.0\nmonitors = ["coverage"]',
         "  ~ setting monitors: none -> coverage"),
    ],
)  # fmt: skip
def test_scenarios_that_are_run_differently_differ(
    gms_fsm: CommandLine, old: str, new: str, line: str
) -> None:
    Path("a.toml").write_text(RUN, encoding="utf-8")
    Path("b.toml").write_text(RUN.replace(old, new), encoding="utf-8")
    answer = gms_fsm("diff", "a.toml", "b.toml", "--no-run")
    assert answer.out.splitlines()[1] == line
    assert answer.out.splitlines()[2].startswith("different: same system, other run: ")
    assert answer.code == 1


def test_an_initial_value_that_is_the_default_is_no_difference(gms_fsm: CommandLine) -> None:
    Path("a.toml").write_text(RUN, encoding="utf-8")
    Path("b.toml").write_text(RUN.replace("a.x = 0.0", ""), encoding="utf-8")
    assert gms_fsm("diff", "a.toml", "b.toml").out.splitlines()[1] == "equal"


def test_a_system_without_a_run_is_the_same_system(gms_fsm: CommandLine) -> None:
    Path("a.toml").write_text(RUN, encoding="utf-8")
    Path("b.toml").write_text(RUN.split("[run]")[0], encoding="utf-8")
    assert gms_fsm("diff", "a.toml", "b.toml").out.splitlines()[1:] == [
        "  - run of the first",
        "equivalent: same system, only the first says how it is run",
    ]


def test_a_scenario_with_monitors_is_equal_to_itself(gms_fsm: CommandLine) -> None:
    gms_fsm("copy", "pulled_mass", "-o", "a.toml")
    text = Path("a.toml").read_text(encoding="utf-8")
    text = text.replace("[run]\n", '[run]\nmonitors = ["all", "abs(z) <= 2*s"]\n')
    Path("a.toml").write_text(text, encoding="utf-8")
    assert gms_fsm("diff", "a.toml", "a.toml").out.splitlines()[1] == "equal"
