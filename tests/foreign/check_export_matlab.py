"""Claim: in Octave the function file takes the switches of `simulate`, and gives its force."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import FrictionState
from tests.exporters.frictions import NAMES, Case, case, loaded
from tests.exporters.octave import OCTAVE, lines_of, ran_in_octave

RTOL = 1e-10
CALL = 0.01  # s, the longest call; the steps in it are those of the default tolerance


@pytest.fixture(scope="module")
def octave() -> str:
    """Return its name and version."""
    if OCTAVE is None:
        pytest.skip("octave-cli is not installed")
    done = subprocess.run([OCTAVE, "--version"], capture_output=True, text=True, check=True)
    return f"Octave {done.stdout.split('version ')[1].split()[0]}"


@pytest.mark.parametrize("name", NAMES)
def test_the_switches_and_the_force(
    name: str, octave: str, ran: Callable[..., None], tmp_path: Path
) -> None:
    switches, forces, late = 0, [0.0], [0.0]
    for seed in range(3):
        given = case(name, seed, corners=5)
        one = compared(given, tmp_path / str(seed), f"repeat with case({name!r}, {seed}, 5)")
        switches += one[0]
        forces.append(one[1])
        late.append(one[2])
    assert max(forces) < 1e-9
    ran(
        "matlab",
        octave,
        f"{name}: 3 random records, calls of {CALL:g} s",
        f"all {switches} switches of simulate(rtol={RTOL:g}) in its order, at most "
        f"{max(late):.1g} s apart; F at most {max(forces):.1g} of its largest value apart",
    )


def compared(given: Case, folder: Path, repeat: str) -> tuple[int, float, float]:
    """Compare with `simulate`; return the switches, and how far the forces and times differ."""
    lines = lines_of(given.t, given.v, sample=CALL)
    forces, log = ran_in_octave(folder, given.model, lines, np.inf)
    log_of = given.simulated(rtol=RTOL).transitions
    edges = [edge.name for edge in given.model.chart.transitions]
    found = [(element - 1, edges[edge - 1]) for _, element, edge in log]
    assert found == list(zip(log_of.element.tolist(), list(log_of.edge), strict=True)), repeat
    friction = FrictionState(given.model, rtol=RTOL)
    exact = np.array([friction.advance(*map(float, line)) for line in lines])
    late = max((abs(t - s) for (t, *_), s in zip(log, log_of.t, strict=True)), default=0.0)
    return len(log), float(np.abs(forces - exact).max() / np.abs(exact).max()), float(late)


def test_a_record_that_jumps(octave: str, ran: Callable[..., None], tmp_path: Path) -> None:
    switches, worst = 0, 0.0
    for name in ("gms-4-signed", "maxwell-slip", "lugre"):
        given = case(name, 7, corners=8)
        t = np.repeat(given.t[:4], 2)[1:-1]
        jumping = Case(given.model, t, given.v[:6])
        count, force, _ = compared(jumping, tmp_path / name, f"repeat with case({name!r}, 7, 8)")
        switches, worst = switches + count, max(worst, force)
    assert switches
    assert worst < 1e-9
    result = f"all {switches} switches; F at most {worst:.1g} of its largest value apart"
    ran("matlab", octave, "records that jump", result)


def test_further_inputs_position_time_and_actions(
    octave: str, ran: Callable[..., None], tmp_path: Path
) -> None:
    t = np.linspace(0.0, 3.0, 151)
    v, load = np.cos(3.0 * t), 0.2 + 0.5 * np.sin(2.0 * t)
    lines = np.column_stack([v[:-1], v[1:], np.diff(t), load[:-1], load[1:]])
    forces, log = ran_in_octave(tmp_path, loaded(), lines, np.inf)
    friction, exact, switches = FrictionState(loaded(), rtol=RTOL), [], []
    for v0, v1, dt, *ends in lines.tolist():
        exact.append(friction.advance(v0, v1, dt, load=(ends[0], ends[1])))
        switches += [(each.t, each.edge) for each in friction.switches]
    assert [("go", "back")[edge - 1] for *_, edge in log] == [edge for _, edge in switches]
    assert [time for time, *_ in log] == pytest.approx([time for time, _ in switches], abs=1e-12)
    worst = float(np.abs(forces - exact).max() / np.abs(exact).max())
    assert worst < 1e-9
    ran(
        "matlab",
        octave,
        "a chart with x, t, a further input and actions",
        f"all {len(log)} switches; F at most {worst:.1g} of its largest value apart",
    )
