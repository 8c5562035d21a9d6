"""Claim: FMPy finds no fault in an FMU, and steps it to the engine's bits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate

pytest.importorskip("fmpy", reason="FMPy drives the FMUs")

from fmpy.validation import validate_fmu

from tests.exporters.fmus import FORMATS, PAPER, Slave, paper_record, written


@pytest.mark.parametrize("form", FORMATS)
def test_the_paper_s_loop(form: str, tmp_path: Path) -> None:
    path = written(PAPER, form, tmp_path, name="gms")
    assert validate_fmu(str(path)) == []
    # On a grid of powers of two the line of input derivatives ends exactly on the next sample.
    t, v = paper_record(2.0**-6)
    v = np.round(v * 2**20) / 2**20
    trace = simulate(PAPER, Prescribed((t, v)), t[-1], t_eval=t)
    slave = Slave(path)
    force = slave.run(t, ["F"], v=v)[:, 0]
    assert slave.count("switches") == len(trace.transitions) == 48
    np.testing.assert_array_equal(force[:-1], trace.F[1:-1])
