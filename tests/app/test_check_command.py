"""``gms-fsm check`` prints its findings; the exit code tells a script whether any is refuted."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

import plots
from gms_fsm.charts.broken import BROKEN
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.files import LIST
from tests.scenario_files import CommandLine, one_message

CAUGHT = {
    "overlap": "livelock",
    "literal": "livelock",
    "memoryless": "chattering",
    "arms": "determinism",
}


@pytest.fixture
def check(gms_fsm: CommandLine) -> CommandLine:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    return lambda *arguments: gms_fsm("check", *arguments)


def graphviz() -> None:
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "code", "last"),
    [
        ("gms --law signed", 0, "19 proved, 0 settled by order, 0 refuted, 0 undecided"),
        ("gms --law published", 1, "18 proved, 0 settled by order, 1 refuted, 0 undecided"),
        # undecided is not a refutation
        (
            "gms --law signed --domain s>=0 --domain v_c>0",
            0,
            "16 proved, 0 settled by order, 0 refuted, 3 undecided",
        ),
    ],
)
def test_the_exit_code_is_1_if_something_is_refuted(
    check: CommandLine, arguments: str, code: int, last: str
) -> None:
    answer = check(*arguments.split(), "-o", "o")
    assert (answer.code, answer.err) == (code, "")
    assert last in answer.out.splitlines()
    assert "over the reals, not floats" in answer.out
    if not code:  # with nothing refuted there is a report and no chart
        assert {path.name for path in Path("o").iterdir()} == {"report.txt", LIST}


@pytest.mark.slow
@pytest.mark.parametrize("name", BROKEN)
def test_every_broken_reading_is_caught_and_listed(check: CommandLine, name: str) -> None:
    answer = check(f"broken:{name}")
    word, code = ("settled by order", 0) if name == "arms" else ("refuted", 1)
    assert answer.code == code
    heading, caught = "", set()
    for line in answer.out.splitlines():
        heading = heading if line.startswith(" ") else line
        if line.startswith(("  refuted", "  settled by order")):
            assert line.startswith(f"  {word}  ")
            caught.add(heading)
    assert caught == {CAUGHT[name]}
    said = " ".join(check("--list").out.split())
    assert f"broken:{name} {BROKEN[name].wrong}" in said
    assert "gms --law signed" in said


def test_a_domain_replaces_the_default(check: CommandLine) -> None:
    answer = check("broken:arms", "--domain", "s > 0", "--domain", "C > 0")
    assert "assumed: s > 0, C > 0\n" in answer.out
    arms = "stick, break_away_forward, break_away_backward"
    assert f"proved     {arms}: never enabled at the same time" in answer.out


def test_without_z3_the_message_names_the_extra(
    gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "z3", None)
    one_message(gms_fsm("check", "lugre"), 'pip install "gms-fsm[check]"')


# --------------------------------------------------------------------------- marked charts
def marked(path: Path) -> set[str]:
    """Return the names of the marked parts of an SVG."""
    nodes = ElementTree.parse(path).iter()
    return {node.get("id", "") for node in nodes if "marked" in node.get("class", "").split()}


def texts(path: Path) -> str:
    nodes = ElementTree.parse(path).iter("{http://www.w3.org/2000/svg}text")
    return " ".join(node.text or "" for node in nodes).replace("\u00a0", " ")


@pytest.mark.slow
def test_charts_are_drawn_with_the_faults_marked(check: CommandLine, tmp_path: Path) -> None:
    graphviz()
    folder = tmp_path / "new" / "folder"
    answer = check("broken:arms", "-o", folder)
    assert answer.code == 0  # the order of the edges settles it
    names = {"report.txt", "1-determinism.svg", "1-determinism.png"}
    assert {path.name for path in folder.iterdir()} == names | {LIST}
    for name in names:
        assert str(folder / name) in answer.out
    assert answer.out.startswith((folder / "report.txt").read_text())
    assert marked(folder / "1-determinism.svg") == {
        f"element1-{part}"
        for arm in ("break_away_forward", "break_away_backward")
        for part in (f"guard-{arm}", f"edge-{arm}")
    }
    said = texts(folder / "1-determinism.svg")
    assert "determinism, settled by order: both are" in said
    assert "s = 0, z = 0" in said
    check("gms", "--law", "published", "-o", tmp_path)
    assert marked(tmp_path / "1-stability.svg") == {"element1-state-slip"}
    said = texts(tmp_path / "1-stability.svg")
    assert "stability, z for v < 0: unstable" in said
    assert "C = 1, v = -1, s = 1, z = 1" in said


@pytest.mark.slow
def test_a_mark_changes_no_text_and_has_to_exist(tmp_path: Path) -> None:
    graphviz()
    chart = BROKEN["arms"].chart
    names = [*(s.name for s in chart.states), *(e.name for e in chart.transitions)]
    plain = plots.render(plots.statechart(chart, range(2)), tmp_path / "plain.svg")
    note = "<b>a & b</b>\n]> end"
    look = {"theme": "dark", "direction": "LR"}
    graph = plots.statechart(chart, range(2), marked=names, note=note, **look)
    drawn = plots.render(graph, tmp_path / "marked.svg")
    assert len(marked(drawn)) == 2 * (2 + 2 * 3)  # the states; the guards and their edges
    assert not marked(plain)
    for line in note.splitlines():
        assert line in texts(drawn)
    with pytest.raises(ParameterError, match=r"marked is 'slide'.*'stick', 'slip', "):
        plots.statechart(chart, marked=["slide"])
