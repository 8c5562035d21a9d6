"""Landscapes and phase portraits refuse wrong elements, rows, times and charts with advice."""

from __future__ import annotations

from typing import Any

import pytest

from gms_fsm import Trace, simulate
from gms_fsm.errors import ParameterError

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

import plots
from tests.helpers import open_loop, stick_slip
from tests.zoo.zoo_cases import prandtl_tomlinson


@pytest.fixture(scope="module")
def run() -> Trace:
    return simulate(stick_slip("signed"), open_loop(), 10.0)


@pytest.mark.parametrize("element", [4, -1, 1.0, True, None, "E1"], ids=str)
def test_elements(run: Trace, element: Any) -> None:
    with pytest.raises(ParameterError, match=r"element is .* from 0 to 3 \(labels count from 1\)"):
        plots.landscape(run, element)


@pytest.mark.parametrize("row", [10_000, -10_000, 1.5, True, None], ids=str)
def test_rows_of_a_landscape(run: Trace, row: Any) -> None:
    with pytest.raises(ParameterError, match=r"row is .* integer from"):
        plots.landscape(run, 0, row=row)


@pytest.mark.parametrize("row", [10_000, -10_000, 1.5, True], ids=str)
def test_rows_of_a_phase_portrait(run: Trace, row: Any) -> None:
    with pytest.raises(ParameterError, match=r"row is .* integer from"):
        plots.phase(run, row=row)


@pytest.mark.parametrize("t", [-1.0, 10.5, float("nan"), "1"], ids=str)
def test_times(run: Trace, t: Any) -> None:
    with pytest.raises(ParameterError, match=r"t is .* in the run, 0 to 10 s"):
        plots.landscape(run, 0, t=t)


def test_a_row_and_a_time(run: Trace) -> None:
    with pytest.raises(ParameterError, match=r"row is 3 and t is 1\.0; give one of them"):
        plots.landscape(run, 0, row=3, t=1.0)


@pytest.mark.parametrize("window", [(3.0, 1.0), (1.0, 11.0), 5.0], ids=str)
def test_windows(run: Trace, window: Any) -> None:
    for draw in (
        lambda: plots.landscape(run, 0, window=window),
        lambda: plots.phase(run, window=window),
    ):
        with pytest.raises(ParameterError, match=r"window is .* t0 < t1 inside the run"):
            draw()


@pytest.mark.parametrize("checks", ["report", 1, []], ids=str)
def test_checks(run: Trace, checks: Any) -> None:
    with pytest.raises(ParameterError, match=r"checks is .*; it must be a Report, from prove"):
        plots.landscape(run, 0, checks=checks)


def test_a_chart_without_a_plane() -> None:
    with pytest.raises(ParameterError, match=r"no variables, and its guards read nothing but") as e:
        plots.landscape(prandtl_tomlinson().run(), 0)
    assert e.value.advice == "draw the force with plots.phase, or the chart with plots.statechart"
