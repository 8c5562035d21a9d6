"""A handout is one A4 page: chart, equations, every parameter with its unit, and a loop."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

import pytest

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
pytest.importorskip("pygraphviz", reason="charts need Graphviz, extra 'render'")

import plots
from gms_fsm.charts.registry import registered
from gms_fsm.errors import ParameterError
from gms_fsm.systems.models import Model, demonstration
from plots._handout import PAGE, SMALLEST, handout_figure
from tests.helpers import bank, stick_slip
from tests.plots.printed import drawn_texts, problems
from tests.scenario_files import CommandLine

ZOO = [
    (name, law)
    for name, each in registered().items()
    if not each.wrong and name != "planar-coulomb"  # no model: it has two velocities
    for law in each.laws or ("",)
]


def checked(model: Model) -> set[str]:
    """Check a page, and return its texts."""
    figure = handout_figure(model)
    assert tuple(72 * figure.get_size_inches()) == pytest.approx(PAGE)
    assert problems(figure, SMALLEST) == []
    texts = [text.get_text() for text, _ in drawn_texts(figure)]
    for each in model.chart.parameters:
        assert each.name in texts
        assert (each.unit or "–") in texts
    assert {"Equations", "Parameters", "Hysteresis", model.title} <= {*texts}
    return {*texts}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "law"), ZOO)
def test_charts_of_the_zoo(name: str, law: str) -> None:
    chart = registered()[name].chart(law)
    texts = checked(demonstration(registered()[name], law))
    assert chart.reference.split()[0] in " ".join(texts)


@pytest.mark.slow
@pytest.mark.parametrize("n", [1, 2, 7, 12])
def test_banks(n: int) -> None:
    texts = checked(bank(n))
    assert {"N/m", "F_s", "v_s", "sigma_2"} <= texts
    assert any("law" in text for text in texts)
    assert any(text.startswith("x(t) = A sin(2πt/T), A = ") for text in texts)


@pytest.mark.slow
def test_the_file_has_one_page_of_a4(tmp_path: Path) -> None:
    path = plots.handout(stick_slip("signed"), tmp_path / "a4.pdf")
    content = path.read_bytes()
    assert len(re.findall(rb"/Type /Page\b", content)) == 1
    (box,) = re.findall(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", content)
    assert [float(each) for each in box] == pytest.approx(PAGE, abs=0.1)
    drawn = b"".join(
        zlib.decompressobj().decompress(each)
        for each in re.findall(rb"stream\r?\n(x.*?)\r?\nendstream", content, re.DOTALL)
    )
    assert drawn.count(b" Tj") + drawn.count(b" TJ") > 60  # text, no outlines
    assert b"/Subtype /Image" not in content


@pytest.mark.slow
def test_at_the_command_line(gms_fsm: CommandLine) -> None:
    assert gms_fsm("handout", "maxwell-slip", "-o", "a.svg").out == "a.svg\n"
    assert "handout gms needs --law" in gms_fsm("handout", "gms").err
    assert "in the plane" in gms_fsm("handout", "planar-coulomb").err


@pytest.mark.slow
def test_a_motion_of_ones_own() -> None:
    model = stick_slip("signed")
    figure = handout_figure(model, velocity="0.1*cos(t)", t_end=7.0)
    assert "v(t) = 0.1*cos(t) m/s" in [text.get_text() for text, _ in drawn_texts(figure)]
    with pytest.raises(ParameterError, match="velocity and t_end belong together"):
        handout_figure(model, velocity="0.1")
