"""A chart written as SCXML, and read from the document, is equal to the chart.

Documents of other tools are read with the texts given beside them; what has no counterpart in a
chart is refused by name.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings

from gms_fsm import Chart, State, Transition, export
from gms_fsm.charts import CHARTS
from gms_fsm.errors import ChartError, ExpressionError, ParameterError
from tests.exporters.charts_to_export import MODELS, model
from tests.strategies import charts

WRITTEN = [name for name in MODELS if name != "backlash"]  # its guards read F


@pytest.mark.parametrize("name", WRITTEN)
def test_every_included_chart(name: str, tmp_path: Path) -> None:
    path, *_ = export(CHARTS[name], "scxml", tmp_path, name="file")
    again = Chart.from_scxml(path)
    assert again == CHARTS[name]
    assert again.guards == CHARTS[name].guards


def test_the_documents_of_a_models_elements(tmp_path: Path) -> None:
    paths = export(model("gms-signed"), "scxml", tmp_path, name="gms")
    assert [path.name for path in paths[:4]] == [f"gms_{i}.scxml" for i in (1, 2, 3, 4)]
    assert all(Chart.from_scxml(path) == CHARTS["gms-signed"] for path in paths[:4])
    assert '<data id="sigma" expr="0.6" />' in paths[3].read_text(encoding="utf-8")


@pytest.mark.slow
@given(chart=charts(locks=False, forces=(), plain=True))
@settings(max_examples=25, deadline=None)
def test_any_chart(chart: Chart, tmp_path_factory: pytest.TempPathFactory) -> None:
    path, *_ = export(chart, "scxml", tmp_path_factory.mktemp("chart"), name="file")
    assert Chart.from_scxml(path) == chart


# --------------------------------------------------------------------------- of other tools
FOREIGN = """\
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="own" initial="stick">
  <datamodel><data id="z" expr="0"/></datamodel>
  <state id="slip">
    <onentry><assign location="z" expr="Math.min(z, 1)"/></onentry>
    <transition event="sticks" target="stick" cond="!(v &gt;= 1 || z &gt; 9)"/>
  </state>
  <state id="stick">
    <transition event="slips" target="slip" cond="z &gt; 1 &amp;&amp; Math.sign(v) &gt; 0">
      <assign location="z" expr="-Math.abs(z)"/>
    </transition>
    <transition target="slip" cond="z &lt; -1"/>
    <transition target="slip"/>
  </state>
</scxml>
"""
BESIDE: dict[str, Any] = {
    "variables": ("z",),
    "flows": {"stick": {"z": "v"}},
    "outputs": {"F": "z"},
}


def read(text: str, folder: Path, **texts: Any) -> Chart:
    """Return the chart of a document."""
    path = folder / "own.scxml"
    path.write_text(text, encoding="utf-8")
    return Chart.from_scxml(path, **{**BESIDE, **texts})


def test_a_document_of_another_tool(tmp_path: Path) -> None:
    chart = read(FOREIGN, tmp_path)
    assert chart == Chart(
        "own",
        variables=("z",),
        states=(State("stick", flow={"z": "v"}), State("slip", entry={"z": "min(z, 1)"})),
        transitions=(
            Transition("slips", "stick", "slip", "z > 1 and sgn(v) > 0", {"z": "-abs(z)"}),
            Transition("stick_slip", "stick", "slip", "z < -1"),
            Transition("stick_slip_2", "stick", "slip", "True"),
            Transition("sticks", "slip", "stick", "not (v >= 1 or z > 9)"),
        ),
        outputs={"F": "z"},
    )


def test_texts_beside_go_before_those_of_the_document(tmp_path: Path) -> None:
    chart = read(
        FOREIGN,
        tmp_path,
        name="mine",
        guards={"slips": "z > 3"},
        actions={"slips": {}},
        entry={"slip": {"z": "2"}},
    )
    assert chart.name == "mine"
    assert chart.guard_text("slips") == "z > 3"
    assert chart.guard_text("sticks") == "!(v >= 1 || z > 9)"
    assert not chart.transitions[0].actions
    assert chart.states[1].entry == {"z": "2"}


def test_one_event_for_one_edge_that_leaves_several_states(tmp_path: Path) -> None:
    text = FOREIGN.replace(
        '<transition target="slip"/>', '<transition event="stop" cond="v &lt; 9" target="stick"/>'
    ).replace("</onentry>", '</onentry><transition event="stop" cond="v &lt; 9" target="stick"/>')
    chart = read(text, tmp_path)
    found = {edge.name: edge.sources for edge in chart.transitions}
    assert found["stop"] == ("stick", "slip")


# --------------------------------------------------------------------------- changed documents
def changed(folder: Path, old: str, new: str) -> Path:
    """Return an exported document that somebody has changed."""
    path, *_ = export(CHARTS["seven-parameter"], "scxml", folder, name="file")
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            'cond="v &lt; 0.0"',
            'cond="v &lt; 1.0"',
            "transition arrest_forward: cond is 'v < 1.0', but",
        ),
        ('cond="v &lt; 0.0" ', "", "cond is None, but gms:guard beside it means 'v < 0.0'"),
        ('expr="-(F_c', 'expr="(F_c', "transition arrest_backward: expr of 'z' is"),
        ('expr="f / (1', 'expr="f / (2', "state 'stick', onentry: expr of 'f' is"),
        ('gms:order="1"', 'gms:order="0"', "'break_away_backward' stands after"),
    ],
)
def test_a_change_that_contradicts_the_texts_is_seen(
    old: str, new: str, said: str, tmp_path: Path
) -> None:
    path = changed(tmp_path, old, new)
    with pytest.raises(ChartError, match=re.escape(said)):
        Chart.from_scxml(path)


def test_a_change_on_purpose(tmp_path: Path) -> None:
    path = changed(tmp_path, 'cond="v &lt; 0.0"', 'cond="v &lt; -1.0"')
    text = path.read_text(encoding="utf-8")
    path.write_text(re.sub(r' gms:guard="v &lt; 0"', "", text), encoding="utf-8")
    chart = Chart.from_scxml(path)
    assert chart.guard_text("arrest_forward") == "v < -1"
    again = Chart.from_scxml(path, guards={"arrest_forward": "v < -2"})
    assert again.guard_text("arrest_forward") == "v < -2"


# --------------------------------------------------------------------------- refusals
STATE = '<state id="stick">'


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (FOREIGN, "<scxml", "it is not XML"),
        (FOREIGN, "<html/>", "its root is <html>, not <scxml"),
        ("<scxml ", '<!DOCTYPE x [<!ENTITY a "b">]><scxml ', "a document type definition"),
        *(
            (STATE, f"<{each}></{each}>{STATE}", f"<{each}> has no counterpart in a chart")
            for each in ("parallel", "final", "script")
        ),
        *(
            (STATE, f"{STATE}<{each}/>", f"state 'stick': <{each}> has no counterpart")
            for each in ("state", "history", "invoke", "initial")
        ),
        (STATE, "<state/>" + STATE, "a <state> has no id"),
        ('initial="stick"', 'initial="stuck"', "its initial state is 'stuck'"),
        ('<data id="z" expr="0"/>', '<data id="z" src="z.json"/>', "<data src=...> has no"),
        ('target="slip"/>', "/>", "transition 3: a transition without target, or internal"),
        ('target="slip"/>', 'target="slip" type="internal"/>', "without target, or internal"),
        ('target="slip"/>', 'target="slip stick"/>', "its targets are 'slip stick'"),
        ('event="slips"', 'event="*"', "its event is '*'"),
        ('event="slips"', 'event="error.x"', "its event is 'error.x'"),
        ('cond="!(v &gt;= 1 || z &gt; 9)"', "", "transition sticks: no guard is given for it"),
        ('<assign location="z" expr="-Math.abs(z)"/>', '<send event="x"/>', "<send> has no"),
        ('<assign location="z" expr="-Math.abs(z)"/>', "<if cond='1'/>", "<if> has no"),
        ('expr="-Math.abs(z)"', "", "<assign location='z'> has no expr"),
        ("</transition>", '<assign location="z" expr="0"/></transition>', "'z'> is there twice"),
        ('location="z" expr="-', 'location="q" expr="-', "'q' is not a variable"),
        ('target="slip"/>', 'target="nowhere"/>', "target 'nowhere' is not a state"),
    ],
)
def test_what_has_no_counterpart_is_named(old: str, new: str, said: str, tmp_path: Path) -> None:
    assert old in FOREIGN
    with pytest.raises(ChartError, match=re.escape(said)):
        read(FOREIGN.replace(old, new), tmp_path)


@pytest.mark.parametrize(
    "cond", ["In('slip')", "z == 1", "z != 1", "Math.cbrt(z) &gt; 1", "_event.data.z &gt; 1"]
)
def test_conditions_that_are_not_of_the_language(cond: str, tmp_path: Path) -> None:
    with pytest.raises(ExpressionError, match="edge 'stick_slip', guard"):
        read(FOREIGN.replace('cond="z &lt; -1"', f'cond="{cond}"'), tmp_path)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(ChartError, match=r"none\.scxml: it cannot be read"):
        Chart.from_scxml(tmp_path / "none.scxml")
    with pytest.raises(ParameterError, match="path is 5"):
        Chart.from_scxml(5)  # type: ignore[arg-type]
    with pytest.raises(ChartError, match="there is no argument 'flow'"):
        Chart.from_scxml(tmp_path / "none.scxml", flow={})  # type: ignore[call-arg]
