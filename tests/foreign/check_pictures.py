"""Claim: PlantUML and LaTeX draw every included chart, with all of its texts.

They need ``plantuml``, and ``pdflatex`` with TikZ, on PATH; ``pdftotext`` reads the pages.
"""

from __future__ import annotations

import html
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from gms_fsm import Chart
from gms_fsm.charts import CHARTS
from plots.output.plantuml import plantuml
from plots.output.tikz import tikz

Ran = Callable[..., None]
PAGE = r"""\documentclass{article}
\usepackage[a1paper,landscape,margin=1cm]{geometry}
\usepackage[T1]{fontenc} \usepackage[utf8]{inputenc} \usepackage{textcomp}
\usepackage{tikz} \usetikzlibrary{arrows.meta,shapes.multipart}
\pagestyle{empty}
\begin{document}
"""
ODD = Chart(
    "$ # % & ~ _ ^ \\ { } < > | \" ' ` -- ,, ?` !` ** // __ <b>x</b> @enduml",
    states=CHARTS["lugre"].states,
    inputs=("v", "s"),
    variables=("z",),
    parameters=("sigma_0", "sigma_1"),
    outputs={"F": "v"},
)


def words(chart: Chart) -> list[str]:
    """Return what must be in a picture: names and guards without spaces."""
    guards = [chart.guard_text(edge) for edge in chart.guards]
    return [text.replace(" ", "") for text in (*(s.name for s in chart.states), *guards)]


def ran_with(*command: str, folder: Path) -> str:
    if shutil.which(command[0]) is None:
        pytest.skip(f"needs {command[0]} on PATH")
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


def test_plantuml(ran: Ran, tmp_path: Path) -> None:
    charts = {**CHARTS, "odd": ODD}
    for name, chart in charts.items():
        (tmp_path / f"{name}.puml").write_text(plantuml(chart), encoding="utf-8")
    files = [f"{name}.puml" for name in charts]
    ran_with("plantuml", "-tsvg", "-charset", "UTF-8", *files, folder=tmp_path)
    for name, chart in charts.items():
        svg = (tmp_path / f"{name}.svg").read_text(encoding="utf-8")
        texts = re.findall(r"<text[^>]*>(.*?)</text>", svg, flags=re.DOTALL)
        said = re.sub(r"\s", "", html.unescape("".join(texts)))
        assert not [word for word in words(chart) if word not in said], name
        assert chart.name.replace(" ", "") in said
    number = ran_with("plantuml", "-version", folder=tmp_path).split()[2]
    ran("PlantUML text", f"PlantUML {number}", f"{len(charts)} charts drawn", "all texts are there")


def test_latex(ran: Ran, tmp_path: Path) -> None:
    charts = {**CHARTS, "odd": ODD}
    pages = "\\clearpage\n".join(f"\\noindent\n{tikz(chart)}" for chart in charts.values())
    (tmp_path / "all.tex").write_text(f"{PAGE}{pages}\\end{{document}}\n", encoding="utf-8")
    said = ran_with("pdflatex", "-interaction=nonstopmode", "all.tex", folder=tmp_path)
    assert "Overfull" not in said
    ran_with("pdftotext", "-raw", "all.pdf", "all.txt", folder=tmp_path)
    pdf = (tmp_path / "all.txt").read_text(encoding="utf-8").split("\f")
    for page, (name, chart) in zip(pdf, charts.items(), strict=False):
        found = re.sub(r"\s", "", page).replace("−", "-").replace("‐", "-")
        assert not [word for word in words(chart) if word not in found], name
    number = re.search(r"Version \S+ \(([^)]*)\)", said)
    assert number is not None
    what = f"{len(charts)} charts set on a page each"
    ran("TikZ text", f"pdfTeX {number[1]}", what, "all texts are there")
