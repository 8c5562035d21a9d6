"""Exported FMUs, driven by FMPy: as an importer does it, and step by step."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import c_double, c_int32, c_uint32
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from gms_fsm import GMS, GMSParameters, Trace, export

PAPER = GMS(GMSParameters.paper("stick-slip"), law="signed")
FORMATS = ("fmu2", "fmu3")
END = 61.0


def written(what: Any, form: str, folder: Path, **more: Any) -> Path:
    """Export and return the FMU."""
    return next(each for each in export(what, form, folder, **more) if each.suffix == ".fmu")


def paper_record(step: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocity of the paper's open loop, sampled."""
    t = np.arange(0.0, END + 1e-9, step)
    return t, 0.2 * np.sin(2 * np.pi * t / 20)


class Slave:
    """An FMU for Co-Simulation whose inputs run on straight lines."""

    def __init__(self, path: Path, start: float = 0.0, folder: str | None = None, **values: float):
        self.folder = folder or str(fmpy.extract(str(path)))
        description = fmpy.read_model_description(self.folder)
        self.two = description.fmiVersion == "2.0"
        self.references = {each.name: each.valueReference for each in description.modelVariables}
        self.fmu: Any = (FMU2Slave if self.two else FMU3Slave)(
            guid=description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="one",
        )
        self.end: dict[str, float] = {}
        if self.two:
            self.fmu.instantiate()
            self.fmu.setupExperiment(startTime=start)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.instantiate(intermediateUpdate=self._update)
            self.fmu.enterInitializationMode(startTime=start)
        for name, value in values.items():
            self.put(name, value)
        self.fmu.exitInitializationMode()

    def _update(self, _environment: Any, _time: float, wanted: bool, *_others: Any) -> None:
        for name, value in self.end.items() if wanted else ():
            self.put(name, value)

    def put(self, name: str, value: float) -> None:
        """Set a variable."""
        (self.fmu.setReal if self.two else self.fmu.setFloat64)([self.references[name]], [value])

    def get(self, name: str) -> float:
        """Return the value of a variable."""
        found = (self.fmu.getReal if self.two else self.fmu.getFloat64)([self.references[name]])
        return float(found[0])

    def count(self, name: str) -> int:
        """Return the value of an integer."""
        found = (self.fmu.getInteger if self.two else self.fmu.getInt64)([self.references[name]])
        return int(found[0])

    def step(self, t: float, h: float, **lines: tuple[float, float]) -> None:
        """Step; each input has a value at the start and at the end."""
        for name, (first, last) in lines.items():
            self.put(name, first)
            self.end[name] = last
            if self.two:
                reference, order = (c_uint32 * 1)(self.references[name]), (c_int32 * 1)(1)
                rate = (c_double * 1)((last - first) / h)
                self.fmu.fmi2SetRealInputDerivatives(self.fmu.component, reference, 1, order, rate)
        self.fmu.doStep(t, h)

    def run(self, t: np.ndarray, seen: Sequence[str], **records: np.ndarray) -> np.ndarray:
        """Step along a record and return what is seen at the ends of the steps, (steps, seen)."""
        rows = []
        for j in range(1, t.size):
            lines = {name: (float(u[j - 1]), float(u[j])) for name, u in records.items()}
            self.step(float(t[j - 1]), float(t[j] - t[j - 1]), **lines)
            rows.append([self.get(name) for name in seen])
        return np.array(rows)


def switched(result: np.ndarray, states: Sequence[str], names: Sequence[str]) -> list[Any]:
    """Return the switches in a result of FMPy: time, element, state that is entered."""
    table = np.array([result[each] for each in states]).T
    found = []
    for before, after, t in zip(table, table[1:], result["time"][1:], strict=False):
        found += [
            (float(t), int(i), names[int(after[i]) - 1]) for i in np.flatnonzero(before != after)
        ]
    return found


def taken(trace: Trace) -> list[tuple[int, str]]:
    """Return element and state entered of each switch of a run."""
    return [(int(each.element), str(each.target)) for each in trace.transitions]
