"""After `import plots` charts, models and traces show themselves in a notebook."""

from __future__ import annotations

import subprocess
import sys
from xml.etree import ElementTree

import pytest

import plots
from gms_fsm import ChartModel, LuGre, Prescribed, Stribeck, simulate
from gms_fsm.charts import GMS_ELEMENT
from plots import notebook
from tests.helpers import ROOT, one_element, stick_slip
from tests.plots.systems_to_draw import SERVO

CURVE = Stribeck(1.0, 1.5, 1e-3)


@pytest.fixture
def _graphviz() -> None:
    if notebook.drawn(plots.block_diagram(1), "svg") is None:
        pytest.skip("no Graphviz: neither the program dot nor pygraphviz")


@pytest.mark.usefixtures("_graphviz")
def test_charts_and_models_are_svg() -> None:
    values = {"k": 1.0, "sigma": 0.0, "C": 1.0, "v_c": 1e-6}
    regions = [
        (GMS_ELEMENT["signed"], 0),
        (stick_slip("signed"), 4),
        (one_element("signed"), 0),
        (LuGre(sigma_0=1e3, sigma_1=30.0, sigma_2=0.4, stribeck=CURVE), 0),
        (ChartModel(GMS_ELEMENT["signed"], values, n=9, stribeck=CURVE), 0),  # too many to show
    ]
    for shown, count in regions:
        root = ElementTree.fromstring(shown._repr_svg_())  # type: ignore[attr-defined]
        found = [g for g in root.iter() if "region" in g.get("class", "").split()]
        assert len(found) == count, shown


@pytest.mark.usefixtures("_graphviz")
def test_systems_and_contacts_are_svg() -> None:
    for shown, kind in ((SERVO, "body"), (SERVO.contact("gear"), "state")):
        root = ElementTree.fromstring(shown._repr_svg_())  # type: ignore[attr-defined]
        assert [g for g in root.iter() if kind in g.get("class", "").split()]


@pytest.mark.slow
def test_a_trace_is_a_png() -> None:
    pytest.importorskip("matplotlib", reason="the overview needs the extra 'plots'")
    trace = simulate(stick_slip("signed"), Prescribed("0.2"), 3.0)
    assert trace._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]


def test_without_graphviz_a_notebook_falls_back_to_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "drawn", lambda graph, form: None)
    assert notebook.chart_svg(GMS_ELEMENT["signed"]) is None
    assert notebook.model_svg(stick_slip("signed")) is None


@pytest.mark.slow
def test_gms_fsm_alone_shows_no_pictures() -> None:
    """The methods come with `plots`, not with `gms_fsm`."""
    code = (
        "import gms_fsm as g; assert not hasattr(g.Chart, '_repr_svg_'); "
        "assert not hasattr(g.Trace, '_repr_png_'); import plots; "
        "assert hasattr(g.Chart, '_repr_svg_') and hasattr(g.Trace, '_repr_png_')"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
