"""PDF has TrueType fonts, and is the same for the same run."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

import plots
from gms_fsm import Prescribed, prove, simulate
from plots import figures
from tests.helpers import stick_slip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("pdf")
    run = simulate(stick_slip("signed"), Prescribed("0.15*sin(2*pi*t/25)"), 60.0)
    for name in "ab":
        with plots.preset("ieee1"):
            figure = figures.landscape(run, 0, t=30.0, checks=prove(run.model.chart))
        figures.save(figure, found / f"{name}.pdf")
    return found


def test_the_same_run_gives_the_same_bytes(folder: Path) -> None:
    assert (folder / "a.pdf").read_bytes() == (folder / "b.pdf").read_bytes()


def test_fonts_of_a_pdf_are_truetype(folder: Path) -> None:
    text = (folder / "a.pdf").read_bytes()
    assert b"/FontFile2" in text
    assert b"/Type3" not in text
