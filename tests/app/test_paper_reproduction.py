"""`gms-fsm paper` writes all promised files, and its claims are measured, not hard-coded."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from gms_fsm.app import paper
from gms_fsm.app.paper.claims import differing_numbers
from gms_fsm.app.paper.experiments import PaperExperiment, experiments, run
from gms_fsm.app.paper.held import lag_of
from gms_fsm.app.paper.writing import CHARTS, FIGURES, claims_text, write
from gms_fsm.errors import OutputError
from gms_fsm.traces.failures import SimulationError
from tests.helpers import FASTEST, ROOT, matrix, non_drifting, stick_slip
from tests.page_blocks import Page, agrees, blocks_of

pytestmark = pytest.mark.slow


def held_by_the_fastest(*signals: str) -> tuple[PaperExperiment, ...]:
    """Return the experiments; those with held outputs take 8 s each in the engines of Python."""
    return tuple(
        each if each.held is None else replace(each, engine=FASTEST)
        for each in experiments(*signals)
    )


def reproduced(place: Path, chosen: Any) -> Path:
    """Run the command of docs/paper.md in a folder; return the folder of the reproduction."""
    steps: list[float] = []
    files: list[Path] = []

    def watched(folder: Path, force: str, velocity: str, progress: Any) -> list[Path]:
        def both(name: str, done: float) -> None:
            steps.append(done)
            progress(name, done)

        files.extend(write(folder, force, velocity, both))
        return files

    text = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
    (block,) = blocks_of(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        patch.setattr("gms_fsm.app.paper.writing.write", watched)
        patch.setattr("gms_fsm.app.paper.writing.experiments", chosen)
        patch.setattr("warnings.showwarning", None)  # the command line sets its own
        ((_, shown, said, went_well),) = Page("docs/paper.md").console(block)
    assert went_well, said
    assert agrees(shown, said)
    place /= "paper"
    assert files[0] == Path("paper/claims.md")
    assert all((place.parent / path).is_file() for path in files)
    assert steps == sorted(steps)  # the bar does not run backward, and ends
    assert steps[-1] == 1.0
    return place


CLAIMS = [
    ("linearly elastic", r"line of 111\.\d N/m", "holds"),
    ("hysteresis when the force falls", r"\d+\.\d to \d+\.\d mN above", "holds only as"),
    ("GMS is bounded", r"between 1\.769 and 2\.732 mm", "holds only as"),
    ("where elements slip", r"between 15\.48 and 16\.44 mm", "holds"),
    ("LuGre drifts steadily", r"0\.60 mm at 2 s, 5\.63 mm at 30 s", "holds"),
    ("no GMS transition fires", r"^0 transitions", "holds"),
    ("break-away near t = 5 s", r"t = 4\.9128 s", "holds"),
    ("one break-away peak first", r"^1 peak", "holds"),
    (
        "several break-away peaks later",
        r"2 at 32\.64–35\.04",
        "holds only with s\\(v\\) unsigned",
    ),
    (
        "the force is not symmetric",
        r"-3\.08, -2\.00, -0\.68, -0\.40",
        "holds only with s\\(v\\)",
    ),
    ("LuGre is uniform", r"0\.42\d+ to 0\.42\d+", "holds"),
    ("a residual of about 1e-3 N", r"fig4: 0 of \d+", "differs: the implementations are ident"),
    (
        "spikes at the transitions",
        r"42 of 50 transitions lost",
        "holds only with guards evaluated",
    ),
    (
        "residual of about 1e-4 N",
        r"up to 1\.7e-04 N and 2\.3e-06 m on the ramp .* up to 7\.0e-04 N and 4\.8e-06 m while"
        r".* at any time is 1\.2e-03 N, just before a tick, 12 times",
        r"holds only with outputs held .* is explained by them within a factor of 7 at",
    ),
    ("proportional to the sample time", r"divides them by 1\.9\d to 2\.0\d", "holds"),
    (
        "… with outputs held between ticks",
        r"1\.3e-04 N before .*, 2\.0e-04 N .*, 3\.1e-04 N .* 0\.25 N .* 0\.08 N .* 15 of 15",
        r"holds only with outputs held .* is explained by them within a factor of 8",
    ),
]


def every_claim_has_a_measured_figure_and_a_verdict(folder: Path) -> None:
    lines = (folder / "claims.md").read_text().splitlines()
    for claim, measured, verdict in CLAIMS:
        (row,) = [line for line in lines if claim in line]
        _, _, found, judged = [cell.strip() for cell in re.split(r"(?<!\\)\|", row)[1:-1]]
        assert re.search(measured, found), found
        assert re.fullmatch(rf"\*\*{verdict}.*\*\*", judged), judged


def claims_state_our_choices_and_how_far_the_engines_agree(folder: Path) -> None:
    text = (folder / "claims.md").read_text()
    assert paper.FORCE in text
    assert paper.VELOCITY in text
    assert re.search(r"\*\*0 of \d{6} numbers differ\*\*", text)
    assert "eigenvalue +C/s" in text
    claims, holds, condition, differ = map(
        int,
        re.findall(r"(\d+) claims: (\d+) hold, (\d+) hold under a condition, (\d+) differ", text)[
            0
        ],
    )
    assert claims == holds + condition + differ == text.count("| **")
    assert (holds, condition) == (text.count("| **holds** |"), text.count("| **holds only"))


def figures_are_complete_and_small_and_have_the_panels_of_the_paper(folder: Path) -> None:
    for name in CHARTS + FIGURES:
        png = (folder / f"{name}.png").read_bytes()
        assert png.startswith(b"\x89PNG")
        assert png.endswith(b"IEND\xaeB`\x82")
        svg = folder / f"{name}.svg"
        assert svg.stat().st_size < 1_000_000
        assert ElementTree.parse(svg).getroot().tag.endswith("svg")
    for name, letters in (("fig3", "abcd"), ("fig4", "abcdef")):
        text = (folder / f"{name}.svg").read_text()  # text as paths, with itself in a comment
        for letter in letters:
            assert f"<!-- {letter} -->" in text, (name, letter)


def traces_and_logs_are_there_and_agree(folder: Path) -> None:
    for experiment in experiments():
        trace = Trace.load(folder / "traces" / f"{experiment.name}.npz")
        assert trace.t[-1] == experiment.t_end
        with (folder / "transitions" / f"{experiment.name}.csv").open() as file:
            log = list(csv.DictReader(file))
        assert [float(row["t"]) for row in log] == trace.transitions.t.tolist()
        assert [int(row["element"]) - 1 for row in log] == trace.transitions.element.tolist()
    chart, ifelse = (
        Trace.load(folder / "traces" / f"fig4_{name}.npz") for name in ("chart", "ifelse")
    )
    np.testing.assert_array_equal(chart.F, ifelse.F)


@pytest.mark.parametrize(
    "chosen", matrix([held_by_the_fastest, experiments], [held_by_the_fastest])
)
def test_the_command_writes_what_it_promises(chosen: Any, tmp_path: Path) -> None:
    """In one test, so that the command is run once, whoever runs the tests."""
    pytest.importorskip("matplotlib", reason="the figures need the extra 'plots'")
    pytest.importorskip("pygraphviz", reason="the charts need Graphviz, extra 'render'")
    folder = reproduced(tmp_path, chosen)
    every_claim_has_a_measured_figure_and_a_verdict(folder)
    claims_state_our_choices_and_how_far_the_engines_agree(folder)
    figures_are_complete_and_small_and_have_the_panels_of_the_paper(folder)
    traces_and_logs_are_there_and_agree(folder)


def test_an_unwritable_folder_is_reported_before_anything_runs(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    begun: list[str] = []
    with pytest.raises(OutputError, match="choose another folder"):
        write(tmp_path / "file" / "out", progress=lambda name, _: begun.append(name))
    assert not begun


def test_a_run_that_fails_leaves_its_part_and_the_runs_before_it(tmp_path: Path) -> None:
    with pytest.raises(SimulationError, match=r"fig4_chart.*kept in .*partial\.npz"):
        write(tmp_path, velocity="0.1*sqrt(3 - t)")
    assert 2.999 < Trace.load(tmp_path / "partial.npz").t[-1] <= 3.0
    assert Trace.load(tmp_path / "traces" / "fig3_chart.npz").t[-1] == paper.FIG3_END


@pytest.mark.matrix
def test_custom_signals_are_used_and_not_assessed(monkeypatch: pytest.MonkeyPatch) -> None:
    signals = ("0.1*t", "0.1*sin(t)")
    short = [replace(each, t_end=0.5) for each in held_by_the_fastest(*signals)]
    monkeypatch.setattr("gms_fsm.app.paper.experiments.experiments", lambda *_: short)
    text = claims_text(run(*signals), *signals)
    assert "F_a = 0.1*t" in text
    assert "Not assessed" in text
    assert "| claim |" not in text


def test_before_a_tick_the_force_is_that_of_the_tick_before() -> None:
    model, rig = non_drifting("published")
    h, end = 0.02, 0.4
    ticks = h * np.arange(20)
    held = simulate(model, rig, end, events="held", step=h, t_eval=np.append(ticks, end))
    inside = simulate(model, rig, end, rtol=1e-9)
    lag = lag_of(held, inside)
    np.testing.assert_array_equal(lag.t, ticks)
    exact = inside.sample([*ticks, end])
    np.testing.assert_array_equal(lag.force, held.F[:-1] - exact.F[:-1])
    np.testing.assert_array_equal(lag.before, held.F[:-1] - exact.F[1:])
    np.testing.assert_array_equal(lag.place, held.x[:-1] - exact.x[:-1])
    assert lag.during((0.1, 0.2)).t == pytest.approx([0.1, 0.12, 0.14, 0.16, 0.18])
    assert lag.largest_before > lag.median[0]
    with pytest.raises(TypeError, match="must have a sample time"):
        lag_of(inside, inside)


def test_of_runs_of_different_lengths_all_numbers_differ() -> None:
    short, long = (simulate(stick_slip("signed"), Prescribed("0.3"), end) for end in (0.5, 2.0))
    differ, total = differing_numbers(short, long)
    assert differ == total > 0
