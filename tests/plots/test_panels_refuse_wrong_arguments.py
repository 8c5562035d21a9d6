"""A wrong window, element, time or measurement is rejected with its value and the rule."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Trace, simulate
from gms_fsm.errors import ParameterError

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.figure import Figure

from plots import _elements, figures, panels
from plots.mechanism import schematic_figure
from tests.helpers import open_loop, stick_slip


@pytest.fixture(scope="module")
def run() -> Trace:
    return simulate(stick_slip("signed"), open_loop(), 10.0)


def panels_with(argument: str) -> list[Callable[..., object]]:
    """Return all panels that take an argument, and otherwise need only Axes and Trace."""
    found = []
    for panel in (getattr(panels, name) for name in panels.__all__):
        taken = inspect.signature(panel).parameters
        needed = [name for name, each in taken.items() if each.default is each.empty]
        if needed == ["ax", "trace"] and argument in taken:
            found.append(panel)
    return found


def test_panels_are_found() -> None:
    assert {panels.velocity, panels.cascade, panels.stribeck} <= set(panels_with("window"))
    assert {panels.force, panels.margins} <= set(panels_with("elements"))


WINDOWS = [(3.0, 1.0), (1.0, 1.0), (-1.0, 2.0), (1.0, 11.0), (1.0,), (1, 2, 3), 5.0, ("a", 2)]
WINDOWS += [(np.nan, 2.0)]


@pytest.mark.parametrize("window", WINDOWS, ids=str)
@pytest.mark.parametrize("panel", panels_with("window"), ids=lambda panel: panel.__name__)
def test_windows(run: Trace, panel: Callable[..., object], window: object) -> None:
    with pytest.raises(ParameterError, match=r"window is .* t0 < t1 inside the run, 0 to 10 s"):
        panel(Figure().subplots(), run, window=window)


@pytest.mark.parametrize("elements", [[], [4], [-1], [0, 0], [1.0], [True], "01", 2], ids=str)
@pytest.mark.parametrize("panel", panels_with("elements"), ids=lambda panel: panel.__name__)
def test_elements(run: Trace, panel: Callable[..., object], elements: object) -> None:
    with pytest.raises(ParameterError, match=r"elements is .* from 0 to 3"):
        panel(Figure().subplots(), run, elements=elements)


@pytest.mark.parametrize("around", [-1.0, 10.5, np.nan, "x"], ids=str)
def test_around(run: Trace, around: object) -> None:
    with pytest.raises(ParameterError, match=r"around is .* in the run, 0 to 10 s"):
        figures.ribbons_figure(run, around)  # type: ignore[arg-type]


@pytest.mark.parametrize("within", [0.0, -1.0, np.nan, "x"], ids=str)
def test_within(run: Trace, within: object) -> None:
    with pytest.raises(ParameterError, match=r"within is .* > 0 s"):
        panels.cascade_window(run, within=within)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "measured", [([1.0], [1.0, 2.0]), ([], []), ([1.0], [np.nan]), (["a"], [1.0]), 3.0], ids=str
)
def test_measured_points(run: Trace, measured: object) -> None:
    with pytest.raises(ParameterError, match=r"measured is .* of equal length"):
        panels.stribeck(Figure().subplots(), run, measured)  # type: ignore[arg-type]


def test_measurements(run: Trace) -> None:
    with pytest.raises(ParameterError, match="equally long"):
        figures.Measured(np.zeros(2), np.zeros(2), np.zeros(3))
    with pytest.raises(ParameterError, match="goes backward"):
        figures.Measured(np.array([1.0, 0.0]), np.zeros(2), np.zeros(2))
    late = figures.Measured(np.array([20.0, 30.0]), np.zeros(2), np.zeros(2))
    with pytest.raises(ParameterError, match=r"20 to 30 s; it must overlap 0 to 10 s"):
        panels.residual(Figure().subplots(), run, late)


def test_differences(run: Trace) -> None:
    ax = Figure().subplots()
    with pytest.raises(ParameterError, match=r"floor is 0.0; it must be a force > 0 N"):
        panels.difference(ax, np.zeros(3), np.zeros(3), 0.0)
    with pytest.raises(ParameterError, match=r"shape \(3,\), the difference \(2,\)"):
        panels.difference(ax, np.zeros(3), np.zeros(2))


def test_figure_3_needs_one_force_per_row(run: Trace) -> None:
    with pytest.raises(ParameterError, match=r"force has shape \(2,\)"):
        figures.figure_3(run, run, run, np.zeros(2), title="")


def test_formats(run: Trace, tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"a\.bmp'; it must end in \.png, \.svg or \.pdf"):
        figures.save(Figure(), tmp_path / "a.bmp")


@pytest.mark.parametrize("row", [10_000, -10_000, 1.5, True, None], ids=str)
def test_rows_of_a_schematic(run: Trace, row: object) -> None:
    with pytest.raises(ParameterError, match=r"row is .* integer from"):
        _elements.elements_at(Figure().subplots(), run, row)  # type: ignore[arg-type]


@pytest.mark.parametrize("elements", [0, 13, 2.0, True], ids=str)
def test_elements_of_a_schematic(elements: object) -> None:
    with pytest.raises(ParameterError, match=r"elements is .* 1 to 12 elements"):
        schematic_figure(elements=elements)  # type: ignore[arg-type]
