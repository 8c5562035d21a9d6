"""Claim: a control code or a bidirectional mark in a text of a user leaves as a visible escape.

It does so everywhere: on the terminal, in pictures, reports, pages, and programs for other tools.
The rule of the code that goes with it is in `tests/structure/test_rules_of_the_code.py`.
"""

from __future__ import annotations

import io
import warnings
import zipfile
from pathlib import Path
from unicodedata import category
from xml.etree import ElementTree

import pytest

import plots
from gms_fsm import Chart, ChartModel, ParameterError, Prescribed, State, Trace, export, simulate
from gms_fsm.app.report import run_scenario
from gms_fsm.app.scenario import load_scenario, session_of
from gms_fsm.charts.parameters import Parameter
from gms_fsm.debugger import Debugger
from gms_fsm.exporters import formats
from gms_fsm.foundation.text import visible, visible_lines
from tests.scenario_files import OPEN_LOOP

NASTY = "a\x1b]0;b\x07 c\x9b31m d\u202e e\u2066 \u2028*/ *) f\r\nint g; {\x7f"
ESCAPES = ("\\u001b", "\\u009b", "\\u202e", "\\u2066", "\\u007f")


def raw(text: str) -> list[str]:
    """Return what may not leave."""
    hidden = {c for c in {*text} - {*"\t\n"} if category(c) in ("Cc", "Cf", "Zl", "Zp")}
    return [line for line in text.split("\n") if hidden & {*line}] if hidden else []


@pytest.fixture(scope="module")
def model() -> ChartModel:
    """Return a friction whose free texts are all nasty."""
    chart = Chart(
        name=NASTY,
        reference=NASTY,
        inputs=("v",),
        variables=("z",),
        parameters=(Parameter("k", unit=NASTY, meaning=NASTY),),
        states=(State("only", flow={"z": "v - z"}),),
        outputs={"F": "k * z"},
    )
    return ChartModel(chart, {"k": 2.0}, title=NASTY)


@pytest.fixture(scope="module")
def trace(model: ChartModel) -> Trace:
    """Return a run of it."""
    return simulate(model, Prescribed("0.1*sin(t)"), 1.0)


def test_the_escape_of_a_code_is_that_of_python_and_json() -> None:
    assert visible(" é\tb\u00a0\x00\x9b\ud800\U000e0001") == r" é b \u0000\u009b\ud800\U000e0001"
    assert visible_lines("a\tb\n\u00a0c\r\n") == "a\tb\n\u00a0c\\u000d\n"


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("form", sorted({*formats()} - {"scxml"}))
def test_an_export_has_no_control_code(form: str, model: ChartModel, tmp_path: Path) -> None:
    files = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # glyphs
        made = export(model, form, tmp_path, name="friction")
    for path in made:
        if path.suffix == ".fmu":
            archive = zipfile.ZipFile(path)
            files |= {n: archive.read(n) for n in archive.namelist() if "binaries" not in n}
            ElementTree.fromstring(files["modelDescription.xml"])
        elif path.suffix not in (".png", ".pdf"):
            files[path.name] = path.read_bytes()
    for name, content in files.items():
        text = content.decode()
        assert raw(text) == [], name
        assert not [line for line in text.splitlines() if line.startswith("int g;")], name
    if form not in (".png", ".pdf"):
        assert any("u001b" in content.decode() for content in files.values())


def test_scxml_refuses_what_it_could_not_give_back(model: ChartModel, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="name"):
        export(model, "scxml", tmp_path, name="friction")


@pytest.mark.slow
def test_a_run_and_its_page_have_no_control_code(trace: Trace, tmp_path: Path) -> None:
    written = NASTY.encode("unicode_escape").decode().replace("\\x", "\\u00")
    path = tmp_path / "run.toml"
    text = OPEN_LOOP.replace('"open loop"', f'"{written}"')
    path.write_text(text.replace("figures = []", 'figures = ["svg"]'))
    loaded = load_scenario(path)
    assert loaded.title == NASTY
    run_scenario(loaded, tmp_path / "out")
    svg = (tmp_path / "out" / "overview.svg").read_text(encoding="utf-8")
    ElementTree.fromstring(svg)
    pages = [svg, (tmp_path / "out" / "summary.md").read_text(encoding="utf-8")]
    assert all(each in page for each in ESCAPES for page in pages)
    pages.append(plots.replay(trace, title=NASTY).html)
    answered = io.StringIO()
    Debugger(session_of(loaded), NASTY, io.StringIO(f"print {NASTY}\nquit\n"), answered).run()
    pages.append(answered.getvalue())
    pages.append(repr(trace))
    for page in pages:
        assert raw(page) == []
    assert ESCAPES[0] in answered.getvalue()


@pytest.mark.slow
def test_the_full_screen_has_no_control_code(model: ChartModel) -> None:
    pytest.importorskip("textual")
    from gms_fsm import Session
    from tests.app.full_screen import LARGE, drive

    async def look(app: object, _: object) -> None:
        shown = "\n".join(
            "".join(segment.text for segment in strip)
            for strip in app.screen._compositor.render_strips()  # type: ignore[attr-defined]
        )
        assert ESCAPES[0] in shown
        assert raw(shown) == []

    drive(look, LARGE, Session(model, Prescribed("0.1*sin(t)"), 1.0))
