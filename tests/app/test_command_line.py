"""The verbs print and draw what they name; a mistake is one message, with --debug a traceback."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from gms_fsm import GMS, GMSParameters, Prescribed, __version__, simulate
from gms_fsm.errors import ScenarioError, TraceFileError
from gms_fsm.exporters import formats
from gms_fsm.lowering.program import lower
from tests.helpers import ROOT, matrix, stick_slip
from tests.plots.stored import data_of
from tests.scenario_files import (
    MEASURED,
    OPEN_LOOP,
    Answer,
    CommandLine,
    changed,
    one_message,
    table,
)

SERVO = ROOT / "gms_fsm/scenarios" / "servo.toml"


def said(done: Answer) -> str:
    assert done.code == 0, done.err
    return done.out


# --------------------------------------------------------------------------- help and code
HEAVY = {"numpy", "scipy", "transitions", "matplotlib", "pydantic", "graphviz", "llvmlite", "plots"}
CODE = """
import contextlib, io, json, sys
sys.argv[1:] = ["--help"]
from gms_fsm.app.cli import main
said = io.StringIO()
with contextlib.suppress(SystemExit), contextlib.redirect_stdout(said):
    main()
print(json.dumps([said.getvalue(), sorted({name.partition(".")[0] for name in sys.modules})]))
"""


@pytest.mark.slow
def test_help_lists_every_verb_and_imports_nothing_heavy() -> None:
    """By module names and not by time: help takes as long as its imports."""
    done = subprocess.run(
        [sys.executable, "-c", CODE], cwd=ROOT, capture_output=True, text=True, check=True
    )
    text, names = json.loads(done.stdout)
    for verb in ("paper", "run", "phenomena", "chart", "check", "animate", "replay", "debug"):
        assert f" {verb} " in text
    assert "--debug" in text
    assert "gms_fsm" in names
    assert {*names} & HEAVY == set()


@pytest.mark.slow
@pytest.mark.parametrize("law", matrix(["signed", "published"], ["signed"]))
def test_code_prints_the_generated_program(law: str, gms_fsm: CommandLine) -> None:
    done = said(gms_fsm("code", "--law", law))
    model = GMS(GMSParameters.paper("stick-slip"), law=law)  # type: ignore[arg-type]
    head, _, body = lower(model, Prescribed("0.15*sin(2*pi*t/25)")).source.partition("\n\n")
    assert done.startswith(head)
    assert body in done
    assert done.endswith('if __name__ == "__main__":\n    _main()\n')
    for rig, text in (
        ("pulled", "stiffness * (speed * t - x)"),
        ("slider", "(F_a - F) * (1.0 / mass)"),
    ):
        assert text in said(gms_fsm("code", "--law", law, "--rig", rig))
    assert said(gms_fsm("code", "--law", law, "--debug")) == done
    assert said(gms_fsm("--version")) == f"gms-fsm {__version__}\n"


# --------------------------------------------------------------------------- mistakes
@pytest.fixture
def broken(gms_fsm: CommandLine) -> CommandLine:
    """``gms-fsm`` beside scenarios and a trace with a mistake each."""
    Path("bad.toml").write_text(changed(OPEN_LOOP, '"signed"', '"singed"'))
    Path("escape.toml").write_text(OPEN_LOOP + '\n"\\u001b[31m[bold]\\u0007" = 1\n')
    trace = simulate(stick_slip("signed"), Prescribed("0.3"), 2.0).save("good.npz")
    Path("bad.npz").write_bytes(trace.read_bytes()[:-100])
    return gms_fsm


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "error", "cause"),
    [
        (("run", "bad.toml"), ScenarioError, "singed"),
        (("plot", "bad.npz"), TraceFileError, "File is not a zip file"),  # the error of zipfile
    ],
)
def test_with_debug_the_error_comes_through_with_causes_that_the_message_omits(
    broken: CommandLine, arguments: tuple[str, ...], error: type[Exception], cause: str
) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    one_message(broken(*arguments))
    for with_debug in (("--debug", *arguments), (*arguments, "--debug")):
        with pytest.raises(error) as caught:
            broken(*with_debug)
        assert cause in str(caught.value.__context__)
        assert not caught.value.__suppress_context__


def test_usage_errors_and_terminal_codes(broken: CommandLine) -> None:
    for arguments in (("nonsense",), ("run",), ("run", "bad.toml", "--nonsense")):
        for debug in ((), ("--debug",)):
            answer = broken(*debug, *arguments)
            assert answer.code == 2
            assert "Usage" in answer.err
            assert "Traceback" not in answer.err
    one_message(broken("run", "--", "--debug"), "there is no file or scenario '--debug'")
    answer = broken("run", "escape.toml")
    one_message(answer, r"\u001b[31m[bold]\u0007")
    assert "\x1b[31m" not in answer.message


@pytest.mark.slow
@pytest.mark.parametrize("debug", matrix([False, True], [False]))
def test_in_a_shell(debug: bool, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "gms_fsm", "run", "none.toml"] + ["--debug"] * debug,
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == (1 if debug else 2)
    assert ("Traceback" in done.stderr) == debug
    assert "none.toml: no such file" in done.stderr
    assert done.stdout == ""


# --------------------------------------------------------------------------- pictures
@pytest.mark.slow
def test_chart_and_blocks(gms_fsm: CommandLine) -> None:
    pytest.importorskip("pygraphviz", reason="charts need Graphviz, extra 'render'")

    def nodes(path: str) -> list[ElementTree.Element]:
        return [*ElementTree.parse(path).iter()]

    def count(path: str, kind: str) -> int:
        return sum(kind in node.get("class", "").split() for node in nodes(path))

    said(gms_fsm("chart", "gms", "--law", "signed", "--elements", "4", "-o", "bank.svg"))
    assert count("bank.svg", "region") == 1
    said(gms_fsm("blocks", "--elements", "3", "-o", "blocks.svg"))
    assert count("blocks.svg", "integrator") == 3
    said(gms_fsm("blocks", SERVO, "-o", "servo.svg"))
    assert {"pid", "motor", "bearing"} <= {each.text for each in nodes("servo.svg")}
    said(gms_fsm("blocks", SERVO, "--schematic", "-o", "servo.svg"))
    ids = {node.get("id", "") for node in nodes("servo.svg")}
    assert {"body motor", "contact bearing", "spring k_s", "damper d_s", "force motor"} <= ids
    said(gms_fsm("chart", "lugre", "-o", "lugre.mmd"))
    assert "stateDiagram-v2" in Path("lugre.mmd").read_text()
    look = ("--notation", "math", "--theme", "dark", "--direction", "LR")
    said(gms_fsm("chart", "gms", "--law", "published", *look, "-o", "dark.png"))
    assert Path("dark.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_plot_animate_and_replay(gms_fsm: CommandLine) -> None:
    for module in ("matplotlib", "uplot"):
        pytest.importorskip(module, reason="needs the extras plots and replay")
    trace = simulate(stick_slip("signed"), Prescribed("0.2*sin(2*pi*t/20)"), 21.0).save("t.npz")
    Path("bad.npz").write_bytes(trace.read_bytes()[:3000])
    part = ("--start", "1", "--end", "2")
    names = {Path(line).name for line in said(gms_fsm("plot", "t.npz", "-o", "f", *part)).split()}
    assert names == {f"{name}.{end}" for name in ("overview", "ribbons") for end in ("png", "svg")}
    said(gms_fsm("animate", "t.npz", "-o", "film.gif", "--frames", "5"))
    assert Path("film.gif").read_bytes().startswith(b"GIF8")
    said(gms_fsm("replay", "t.npz", "t.npz", "-o", "page.html", "--title", "<b>two</b>"))
    page = Path("page.html").read_text(encoding="utf-8")
    assert "default-src 'none'" in page
    assert "<b>two</b>" not in page
    Path("notes.toml").write_text('2.5 = "then"\n"1e1" = "later"\narrest = "it sticks"\n')
    said(gms_fsm("replay", "t.npz", "-o", "told.html", "--notes", "notes.toml"))
    assert data_of(Path("told.html").read_text(encoding="utf-8"))["notes"] == [
        {"at": 2.5, "text": "then"},
        {"at": 10.0, "text": "later"},
        {"edge": "arrest", "text": "it sticks"},
    ]
    for arguments, words in (
        (("animate", "t.npz", "-o", "film.avi"), ".gif, .mp4 or .webm"),
        (("replay", "t.npz", "bad.npz"), "damaged"),
        (("replay", "t.npz", "-o", "nowhere/page.html"), "choose another folder"),
        (("replay", "t.npz", "--notes", "none.toml"), "none.toml: no such file"),
        (("replay", "t.npz", "--notes", "bad.npz"), "bad.npz: "),
    ):
        one_message(gms_fsm(*arguments), words)


# --------------------------------------------------------------------------- exports
@pytest.mark.matrix
@pytest.mark.slow
def test_an_export_begins_where_its_scenario_begins(gms_fsm: CommandLine) -> None:
    t = np.round(0.5 + 0.01 * np.arange(60), 2)
    Path("own.csv").write_text(table(["t", "x", "F"], t, 3 + np.sin(6 * t), np.cos(6 * t)))
    Path("own.toml").write_text(MEASURED)
    said(gms_fsm("export", "own.toml", "--to", "c99", "-o", "out"))
    assert "/* Begin at t = 0.5 s. */" in Path("out/own.h").read_text()
    assert Path("out/own_record.csv").read_text().splitlines()[1].startswith("0.5,")
    x = re.search(r"block->now\.y\[0\] = (\S+);", Path("out/own.c").read_text())
    assert x
    assert 1e-3 < float(x[1]) < 5e-3  # m; the record says mm


@pytest.mark.matrix
@pytest.mark.slow
def test_an_exported_contact_has_the_tolerance_of_its_scenario(gms_fsm: CommandLine) -> None:
    Path("servo.toml").write_text(SERVO.read_text().replace("[run]", "[run]\nrtol = 1e-3"))
    bearing = ("export", "servo.toml", "--contact", "bearing")
    said(gms_fsm(*bearing, "--to", "c99", "-o", "out"))
    readme = Path("out/README-bearing-c99.md").read_text()
    assert re.search(r"relative tolerance 0\.001\.", readme)
    said(gms_fsm(*bearing, "--to", "st"))  # which has no use for it


@pytest.mark.slow
def test_the_only_friction_of_a_scenario_is_exported_where_no_body_can_be(
    gms_fsm: CommandLine,
) -> None:
    Path("own.toml").write_text(OPEN_LOOP)
    done = gms_fsm("export", "own.toml", "--to", "st", "-o", "out")
    assert "note: st takes friction only: written is that of own.toml" in done.err
    assert Path("out/own.st").is_file()


def test_formats_of_export_are_listed(gms_fsm: CommandLine) -> None:
    lines = said(gms_fsm("export", "--list")).splitlines()
    assert [line.split()[0] for line in lines] == [*formats()]
