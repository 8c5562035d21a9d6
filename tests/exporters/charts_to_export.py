"""The included charts that can be exported alone, with slow records on which they switch."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from gms_fsm import Chart
from gms_fsm.charts.registry import registered
from gms_fsm.systems.models import ChartModel, demonstration

__all__ = ["MODELS", "SLOW", "imported", "model", "rebuilt"]

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
