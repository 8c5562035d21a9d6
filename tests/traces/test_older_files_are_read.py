"""A file of format 1 reads as the run that wrote it, to the last bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Trace
from tests import older_files
from tests.corpus import run
from tests.helpers import same_bits

TIMES = np.linspace(0.0, 12.0, 25)


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"t_eval": TIMES}, {"output": "end"}])
@pytest.mark.parametrize("name", ["pulled mass", "every kind of contact", "lugre slider"])
def test_it_is_the_run(name: str, options: dict[str, object], tmp_path: Path) -> None:
    """The last one has no firings; rows that were stored twice are kept once."""
    times = TIMES[run(name).t_end >= TIMES]
    one = run(name)(**options | ({"t_eval": times} if "t_eval" in options else {}))
    arrays = older_files.format_1(one, tmp_path / "run.npz")
    assert options or arrays["stops_y"].shape[0] >= arrays["rows_y"].shape[0]
    again = Trace.load(older_files.write(tmp_path / "run.npz", arrays))
    same_bits(again, one)
    assert again.transitions.dtype == one.transitions.dtype
    assert (len(one.transitions) > 4) == (name != "lugre slider")
    if "output" not in options:
        assert (again.stops is again.rows) == (not options)
        same_bits(again.sample(times), one.sample(times))
