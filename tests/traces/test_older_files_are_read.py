"""A file of format 1 reads as the run that wrote it, to the last bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, Trace, simulate
from tests import older_files
from tests.helpers import pulled_mass, same_bits, stick_slip
from tests.traces.test_traces_of_systems_round_trip import belt, same

TIMES = np.linspace(0.0, 20.0, 41)


@pytest.mark.parametrize("options", [{}, {"t_eval": TIMES}, {"output": "end"}])
def test_a_model_on_a_rig(options: dict[str, Any], tmp_path: Path) -> None:
    trace = simulate(*pulled_mass(), 20.0, **options)
    path = tmp_path / "run.npz"
    again = Trace.load(older_files.write(path, older_files.format_1(trace, path)))
    assert len(trace.transitions) > 4
    same_bits(trace, again)
    assert trace.transitions.dtype == again.transitions.dtype
    assert trace.transitions.tolist() == again.transitions.tolist()
    for column in ("F", "s", "F_elements", "dz"):
        assert getattr(trace, column).tobytes() == getattr(again, column).tobytes(), column
    if "output" not in options:
        same_bits(trace.sample(TIMES), again.sample(TIMES))


def test_a_system(tmp_path: Path) -> None:
    trace = simulate(belt(), 8.0, initial={"q2": 0.2})
    path = tmp_path / "run.npz"
    again = Trace.load(older_files.write(path, older_files.format_1(trace, path)))
    assert set(again.transitions.contact) == {"pad", "bank"}
    same(trace, again)


def test_a_run_without_firings(tmp_path: Path) -> None:
    trace = simulate(stick_slip("signed"), Prescribed("0"), 1.0)
    path = tmp_path / "run.npz"
    again = Trace.load(older_files.write(path, older_files.format_1(trace, path)))
    assert len(again.transitions) == 0
    same_bits(trace, again)


def test_rows_that_were_stored_twice_are_kept_once(tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    whole, wanted = (simulate(*pulled_mass(), 20.0, t_eval=each) for each in (None, TIMES))
    for trace in (whole, wanted):
        arrays = older_files.format_1(trace, path)
        assert arrays["stops_y"].shape[0] >= arrays["rows_y"].shape[0]
        again = Trace.load(older_files.write(path, arrays))
        assert (again.stops is again.rows) == (trace is whole)
