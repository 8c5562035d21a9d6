"""PGF needs pdfLaTeX with pgf only; PDF has TrueType fonts; both are the same for the same run."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.figure import Figure

import plots
from gms_fsm import Prescribed, prove, simulate
from gms_fsm.errors import OutputError
from plots import figures
from plots.figures._pgf import latex
from tests.helpers import stick_slip

DOCUMENT = r"""\documentclass{article}
\usepackage{pgf}
\begin{document}
\noindent\input{a.pgf}
\end{document}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("latex")
    run = simulate(stick_slip("signed"), Prescribed("0.15*sin(2*pi*t/25)"), 60.0)
    for name in "ab":
        with plots.preset("ieee1"):
            figure = figures.landscape(run, 0, t=30.0, checks=prove(run.model.chart))
        for ending in ("pgf", "pdf"):
            figures.save(figure, found / f"{name}.{ending}")
    return found


def test_the_text_is_complete_and_ascii(folder: Path) -> None:
    text = (folder / "a.pgf").read_bytes().decode("ascii")
    for name in ("group", "pgfpicture"):
        begin, end = (
            (r"\begingroup", r"\endgroup")
            if name == "group"
            else (
                rf"\begin{{{name}}}",
                rf"\end{{{name}}}",
            )
        )
        assert text.count(begin) == text.count(end) == 1
    assert text.count(r"\begin{pgfscope}") == text.count(r"\end{pgfscope}") > 50
    assert "includegraphics" not in text
    assert r"\pgfqpoint{3.500000in}" in text
    assert not re.search(r"(?<!\\)[_#&](?=[^{]*\}\}\%)", text.split("break")[1][:80])
    assert r"break\_away\_forward" in text


def test_a_compiler_reads_it(folder: Path) -> None:
    """Where one is installed; the structure is checked by the test above."""
    (folder / "doc.tex").write_text(DOCUMENT)
    compilers = [each for each in ("pdflatex", "tectonic") if shutil.which(each)]
    for compiler in compilers:
        more = ["-interaction=nonstopmode", "-halt-on-error"] if compiler == "pdflatex" else []
        done = subprocess.run([compiler, *more, "doc.tex"], cwd=folder, capture_output=True)
        assert done.returncode == 0, done.stdout.decode(errors="replace")[-2000:]
        assert (folder / "doc.pdf").read_bytes().startswith(b"%PDF")


def test_the_same_run_gives_the_same_bytes(folder: Path) -> None:
    for ending in ("pgf", "pdf"):
        assert (folder / f"a.{ending}").read_bytes() == (folder / f"b.{ending}").read_bytes()


def test_fonts_of_a_pdf_are_truetype(folder: Path) -> None:
    text = (folder / "a.pdf").read_bytes()
    assert b"/FontFile2" in text
    assert b"/Type3" not in text


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("v_c #1 & 5 %", r"v\_c \#1 \& 5 \%"),
        ("µ Σ − ≤", r"\ensuremath{\mu} \ensuremath{\Sigma} \ensuremath{-} \ensuremath{\leq}"),
        ("m/s²", r"m/s\ensuremath{^{2}}"),
        ("σ₀", r"\ensuremath{\sigma}\ensuremath{_{0}}"),
        ("ż", r"\ensuremath{\dot{z}}"),
        ("Müller", r"M\"{u}ller"),
        ("$z_{1}$ a_b", r"$z_{1}$ a\_b"),
        ("a\\b{c}", r"a\textbackslash{}b\{c\}"),
    ],
)
def test_letters_that_latex_misreads(text: str, written: str) -> None:
    assert latex(text, math=True) == written


def test_an_unknown_letter_is_reported(tmp_path: Path) -> None:
    figure = Figure()
    figure.text(0, 0, "☃")
    with pytest.raises(OutputError, match="the character '☃', which pdfLaTeX does not know"):
        figures.save(figure, tmp_path / "a.pgf")
