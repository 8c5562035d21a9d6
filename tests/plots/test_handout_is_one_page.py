"""A handout is one A4 page: chart, equations, every parameter with its unit, and a loop."""

from __future__ import annotations

import re
import zlib
from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
pytest.importorskip("pygraphviz", reason="charts need Graphviz, extra 'render'")

from matplotlib import rc_context

import plots
from gms_fsm import Prescribed, simulate
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts.chart import Chart, State
from gms_fsm.charts.registry import registered
from gms_fsm.systems.models import ChartModel, Model, demonstration
from plots.handouts.excitation import excited
from plots.handouts.page import PAGE, SMALLEST, handout_figure
from plots.output.svg_artists import EXACT
from tests.helpers import bank, matrix, stick_slip
from tests.plots.charts_to_draw import every
from tests.plots.printed import drawn_texts, problems
from tests.plots.systems_to_draw import SCENARIOS
from tests.scenario_files import CommandLine

ZOO = [
    (name, law)
    for name, law in every()
    if not registered()[name].wrong and name != "planar-coulomb"  # no model: it has two velocities
]
MONO = "DejaVu Sans Mono"


def checked(model: Model) -> set[str]:
    """Check a page, and return its texts."""
    figure = handout_figure(model)
    assert tuple(72 * figure.get_size_inches()) == pytest.approx(PAGE)
    with rc_context(EXACT):
        drawn = drawn_texts(figure)
        formulas = [t for t, _ in drawn if t.axes is not None and t.get_family() == [MONO]]
        index = 0.7 * Counter(t.get_fontsize() for t in formulas).most_common(1)[0][0]
        found = problems(figure, SMALLEST)
    assert [each for each in found if not each.startswith(f"{index:.6f}"[:6])] == []
    texts = [text.get_text() for text, _ in drawn]
    for each in model.chart.parameters:
        assert each.name in texts
        assert (each.unit or "–") in texts
    assert {"Equations", "Parameters", "Hysteresis", model.title} <= {*texts}
    return {*texts}


# The chart "modelica" is too large for letters of that size, and is a matrix.
KEPT = {*ZOO[::9], ("modelica", "")}


@pytest.mark.every(6)
@pytest.mark.slow
@pytest.mark.parametrize(("name", "law"), matrix(ZOO, KEPT))
def test_charts_of_the_zoo(name: str, law: str) -> None:
    chart = registered()[name].chart(law)
    texts = checked(demonstration(registered()[name], law))
    assert chart.reference.split()[0] in " ".join(texts)
    assert name != "modelica" or any(text.startswith("from ↓") for text in texts)


@pytest.mark.matrix
@pytest.mark.slow
def test_a_bank_of_twelve() -> None:
    texts = checked(bank(12))
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


@pytest.mark.matrix
@pytest.mark.slow
def test_at_the_command_line_also_of_a_contact_of_a_system(gms_fsm: CommandLine) -> None:
    assert gms_fsm("handout", "maxwell-slip", "-o", "a.svg").out == "a.svg\n"
    assert "handout gms needs --law" in gms_fsm("handout", "gms").err
    assert "in the plane" in gms_fsm("handout", "planar-coulomb").err
    file = str(SCENARIOS / "two_blocks_on_a_belt.toml")
    assert gms_fsm("handout", file).err.endswith(
        "it has the contacts 'pad_1', 'pad_2'; give --contact pad_1\n"
    )
    assert gms_fsm("handout", file, "--contact", "pad_2", "-o", "b.svg").out == "b.svg\n"
    assert "has no contacts" in gms_fsm("handout", "karnopp", "--contact", "pad_2").err


@pytest.mark.slow
def test_a_motion_of_ones_own_and_one_that_is_seen_without_a_length() -> None:
    figure = handout_figure(simulate(stick_slip("signed"), Prescribed("0.1*cos(t)"), 7.0))
    texts = [text.get_text() for text, _ in drawn_texts(figure)]
    assert "prescribed velocity: v = 0.1*cos(t)" in texts
    clutch = demonstration(registered()["dog-clutch"], "")
    assert ", A = 100 mm, " in excited(clutch).about


@pytest.mark.slow
def test_a_run_of_a_scenario_has_its_title_and_its_rig() -> None:
    trace = load_scenario("pulled_mass").simulate()
    figure = handout_figure(trace)
    texts = [text.get_text() for text, _ in drawn_texts(figure)]
    assert "Pulled mass" in texts
    assert any(text.startswith("slider pulled through a spring: mass = 1.00 kg") for text in texts)
    loop = figure.axes[-1].lines[0]
    assert loop.get_ydata()[[0, -1]] == pytest.approx(trace.F[[0, -1]])


@pytest.mark.slow
def test_the_force_of_a_whole_contact_is_written() -> None:
    chart = Chart(
        "own",
        variables=("z",),
        states=(State("only", flow={"z": "v"}),),
        outputs={"F": "z"},
        contact_outputs={"F": "2*F"},
    )
    figure = handout_figure(simulate(ChartModel(chart, {}), Prescribed("0.1*cos(t)"), 7.0))
    texts = [text.get_text() for text, _ in drawn_texts(figure)]
    assert "contact" in texts
    assert any(r"2" in text and r"\sum_i" not in text for text in texts if "F =" in text)
