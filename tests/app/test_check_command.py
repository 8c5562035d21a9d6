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

EXPECTED = {
    "overlap": "livelock",
    "literal": "livelock",
    "memoryless": "chattering",
    "arms": "determinism",
}


def z3() -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")


def graphviz() -> None:
    z3()
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")


@pytest.mark.parametrize(
    ("arguments", "code", "last"),
    [
        (("gms", "--law", "signed"), 0, "19 proved, 0 settled by order, 0 refuted, 0 undecided"),
        (("gms", "--law", "published"), 1, "18 proved, 0 settled by order, 1 refuted, 0 undecided"),
        (("lugre",), 0, "7 proved, 0 settled by order, 0 refuted, 0 undecided"),
        # undecided is not a refutation
        (
            ("gms", "--law", "signed", "--domain", "s >= 0", "--domain", "v_c > 0"),
            0,
            "16 proved, 0 settled by order, 0 refuted, 3 undecided",
        ),
    ],
)
def test_the_exit_code_is_1_if_something_is_refuted(
    gms_fsm: CommandLine, arguments: tuple[str, ...], code: int, last: str
) -> None:
    z3()
    answer = gms_fsm("check", *arguments)
    assert (answer.code, answer.err) == (code, "")
    assert answer.out.splitlines()[-1] == last
    assert "over the reals, not floats" in answer.out


@pytest.mark.parametrize("name", BROKEN)
def test_every_broken_reading_is_caught(gms_fsm: CommandLine, name: str) -> None:
    z3()
    answer = gms_fsm("check", f"broken:{name}")
    word, code = ("settled by order", 0) if name == "arms" else ("refuted", 1)
    assert answer.code == code
    heading = ""
    caught = set()
    for line in answer.out.splitlines():
        heading = heading if line.startswith(" ") else line
        if line.startswith(("  refuted", "  settled by order")):
            assert line.startswith(f"  {word}  ")
            caught.add(heading)
    assert caught == {EXPECTED[name]}


def test_a_domain_replaces_the_default(gms_fsm: CommandLine) -> None:
    z3()
    answer = gms_fsm("check", "broken:arms", "--domain", "s > 0", "--domain", "C > 0")
    assert "assumed: s > 0, C > 0\n" in answer.out
    arms = "stick, break_away_forward, break_away_backward"
    assert f"proved     {arms}: never enabled at the same time" in answer.out


def test_the_list_names_all_charts_and_describes_the_faults(gms_fsm: CommandLine) -> None:
    answer = gms_fsm("check", "--list")
    assert (answer.code, answer.err) == (0, "")
    said = " ".join(answer.out.split())
    for name, broken in BROKEN.items():
        assert f"broken:{name} {broken.wrong}" in said
    assert "gms --law signed" in said
    assert "lugre" in said


def test_without_z3_the_message_names_the_extra(
    gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "z3", None)
    one_message(gms_fsm("check", "lugre"), 'pip install "gms-fsm[check]"')


# --------------------------------------------------------------------------- marked charts
def classes(path: Path) -> dict[str, set[str]]:
    """Return the classes of each named part of an SVG."""
    return {
        node.get("id", ""): set(node.get("class", "").split())
        for node in ElementTree.parse(path).iter()
        if node.get("class")
    }


def marked(path: Path) -> set[str]:
    return {name for name, found in classes(path).items() if "marked" in found}


def texts(path: Path) -> str:
    nodes = ElementTree.parse(path).iter("{http://www.w3.org/2000/svg}text")
    return " ".join(node.text or "" for node in nodes).replace("\u00a0", " ")


def test_charts_are_drawn_with_the_edges_marked(gms_fsm: CommandLine, tmp_path: Path) -> None:
    graphviz()
    folder = tmp_path / "new" / "folder"
    answer = gms_fsm("check", "broken:arms", "-o", folder)
    assert answer.code == 0  # the order of the edges settles it
    names = {"report.txt", "1-determinism.svg", "1-determinism.png"}
    assert {path.name for path in folder.iterdir()} == names | {LIST}
    for name in names:
        assert str(folder / name) in answer.out
    assert answer.out.startswith((folder / "report.txt").read_text())
    assert (folder / "1-determinism.png").read_bytes().startswith(b"\x89PNG")
    assert marked(folder / "1-determinism.svg") == {
        f"element1-{part}"
        for arm in ("break_away_forward", "break_away_backward")
        for part in (f"guard-{arm}", f"edge-{arm}-1", f"edge-{arm}-2")
    }
    said = texts(folder / "1-determinism.svg")
    assert "determinism, settled by order: both are" in said
    assert "s = 0, z = 0" in said


def test_a_faulty_state_is_marked(gms_fsm: CommandLine, tmp_path: Path) -> None:
    graphviz()
    gms_fsm("check", "gms", "--law", "published", "-o", tmp_path)
    assert marked(tmp_path / "1-stability.svg") == {"element1-state-slip"}
    said = texts(tmp_path / "1-stability.svg")
    assert "stability, z for v < 0: unstable" in said
    assert "C = 1, v = -1, s = 1, z = 1" in said


@pytest.mark.slow
def test_with_nothing_refuted_there_is_a_report_and_no_chart(
    gms_fsm: CommandLine, tmp_path: Path
) -> None:
    z3()
    assert gms_fsm("check", "gms", "--law", "signed", "-o", tmp_path).code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"report.txt", LIST}


def test_a_folder_that_cannot_be_made_is_one_message(gms_fsm: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    one_message(gms_fsm("check", "lugre", "-o", tmp_path / "file" / "out"), "another folder")


def test_a_mark_changes_no_text_and_has_to_exist(tmp_path: Path) -> None:
    graphviz()
    chart = BROKEN["arms"].chart
    names = [*(s.name for s in chart.states), *(e.name for e in chart.transitions)]
    plain = plots.render(plots.statechart(chart, 2), tmp_path / "plain.svg")
    note = "<b>a & b</b>\n]> end"
    graph = plots.statechart(chart, 2, marked=names, note=note, theme="dark", direction="LR")
    drawn = plots.render(graph, tmp_path / "marked.svg")
    assert len(marked(drawn)) == 2 * (2 + 3 * 3)  # a state; a guard with two pieces of its edge
    assert not marked(plain)
    for line in note.splitlines():
        assert line in texts(drawn)
    with pytest.raises(ParameterError, match=r"marked is 'slide'.*'stick' or 'slip' or"):
        plots.statechart(chart, marked=["slide"])
