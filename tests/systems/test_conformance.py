"""The cases of `benchmarks/conformance` have the answers of their closed forms and references."""

from __future__ import annotations

import pytest

from benchmarks.conformance import run


@pytest.mark.slow
@pytest.mark.parametrize("name", run.names())
def test_a_case_has_its_answer(name: str) -> None:
    """In one engine; the script compares the bits of all."""
    right = run.expected(name)
    found, momentum = run.outcome(name, right, "ifelse")  # no minute of compilation
    assert (run.verdict(right, found), momentum) == ("right", "")


def test_each_system_file_has_its_answer_and_the_page_lists_it() -> None:
    """If this fails, run: python benchmarks/conformance/run.py --write."""
    assert {path.stem for path in run.CASES.glob("*.toml")} == set(run.names())
    page = run.PAGE.read_text(encoding="utf-8")
    assert [name for name in run.names() if f"| `{name}`: " not in page] == []


def test_a_missing_a_late_and_a_false_switch_are_seen() -> None:
    right = run.expected("dog-clutch")
    on, off = ((each["t"], "clutch", 1, each["edge"]) for each in right["switches"])
    for switches, said in (
        ([on], "1 switch instead of 2"),
        ([on, (off[0] + 1e-3, *off[1:])], "disengage at 1.501 s instead of 1.5 s"),
        ([off, on], "switch 1 is clutch disengage"),
    ):
        assert said in run.verdict(right, run.Outcome(switches, right["end"]))
    wrong = run.Outcome([on, off], {**right["end"], "b.v": 0.0})
    assert "b.v is 0 instead of" in run.verdict(right, wrong)
    assert run.verdict(right, run.Outcome([on, off], right["end"])) == "right"
