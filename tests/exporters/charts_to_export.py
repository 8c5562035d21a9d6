"""Charts to export and read: the included ones, with slow records; those of other tools."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from transitions import Machine

from gms_fsm import Chart, export
from gms_fsm.charts import CHARTS
from gms_fsm.charts.registry import registered
from gms_fsm.systems.models import ChartModel, demonstration

SLOW = "0.015 * sin(2 * pi * t / 5)"  # m/s: with steps of 1 ms Euler's method is stable for all
MODELS: Mapping[str, tuple[str, str]] = {
    "-".join(filter(None, (each.name, law))): (each.name, law)
    for each in registered().values()
    for law in each.laws or ("",)
    if not each.chart(law).locks and not each.wrong
}


def model(name: str) -> ChartModel:
    """Return a model by its name in MODELS."""
    entry, law = MODELS[name]
    return demonstration(registered()[entry], law)


def imported(path: Path) -> ModuleType:
    """Import an exported Python file."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def rebuilt(file: Any, machine: Any) -> Chart:
    """Return the chart of an exported file for transitions."""
    return Chart.from_transitions(
        machine,
        name=file.NAME,
        reference=file.REFERENCE,
        inputs=file.INPUTS,
        velocities=file.VELOCITIES,
        variables=file.VARIABLES,
        parameters=file.PARAMETERS,
        let=file.LET,
        flows=file.FLOWS,
        guards=file.GUARDS,
        entry=file.ENTRY,
        exit=file.EXIT,
        actions=file.ACTIONS,
        outputs=file.OUTPUTS,
        state_outputs=file.STATE_OUTPUTS,
        contact_outputs=file.CONTACT_OUTPUTS,
        initial=file.INITIAL,
    )


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
TEXTS: dict[str, Any] = {"outputs": {"F": "v"}, "guards": {"slips": "v > 1", "sticks": "v < 1"}}


def foreign(old: str = "", new: str = "", folder: Path = Path(), **texts: Any) -> Chart:
    """Return the chart of the document, changed."""
    assert old in FOREIGN
    path = folder / "own.scxml"
    path.write_text(FOREIGN.replace(old, new) if old else FOREIGN, encoding="utf-8")
    beside: Any = {"variables": ("z",), "flows": {"stick": {"z": "v"}}, "outputs": {"F": "z"}}
    return Chart.from_scxml(path, **{**beside, **texts})


def of_states(states: str, folder: Path, **texts: Any) -> Chart:
    """Return the chart of a document with these states, without a force if none is given."""
    path = folder / "own.scxml"
    text = f'<scxml xmlns="http://www.w3.org/2005/07/scxml">{states}</scxml>'
    path.write_text(text, encoding="utf-8")
    return Chart.from_scxml(path, **{"outputs": {"F": "0"}, **texts})


def edited_export(old: str, new: str, folder: Path = Path()) -> Path:
    """Return an exported document that somebody has changed."""
    path, *_ = export(CHARTS["seven-parameter"], "scxml", folder, name="file")
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


def small(**more: Any) -> Machine:
    """Return a machine of two states."""
    states, edges = ["stick", "slip"], [["slips", "stick", "slip"], ["sticks", "slip", "stick"]]
    return Machine(**{"states": states, "initial": "stick", "transitions": edges, **more})


def one_edge(**more: Any) -> Machine:
    """Return it with one edge, which has more."""
    return small(transitions=[{"trigger": "slips", "source": "stick", "dest": "slip", **more}])
