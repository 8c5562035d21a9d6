"""Claim: FMPy finds no fault in an FMU, and steps it to the engine's bits."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Prescribed, simulate

pytest.importorskip("fmpy", reason="FMPy drives the FMUs")

from fmpy.validation import validate_fmu

from tests.exporters.fmus import FORMATS, PAPER, Slave, paper_record, written


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both versions, in one folder."""
    made = tmp_path_factory.mktemp("fmus")
    names = [written(PAPER, form, made, name="gms").name for form in FORMATS]
    assert names == ["gms_fmi2.fmu", "gms_fmi3.fmu"]
    return made


@pytest.mark.parametrize("form", FORMATS)
def test_the_paper_s_loop(form: str, folder: Path) -> None:
    path = folder / f"gms_fmi{form[-1]}.fmu"
    assert validate_fmu(str(path)) == []
    # On a grid of powers of two the line of input derivatives ends exactly on the next sample.
    t, v = paper_record(2.0**-6)
    v = np.round(v * 2**20) / 2**20
    trace = simulate(PAPER, Prescribed((t, v)), t[-1], t_eval=t)
    slave = Slave(path)
    force = slave.run(t, ["F"], v=v)[:, 0]
    assert slave.count("switches") == len(trace.transitions) == 48
    np.testing.assert_array_equal(force[:-1], trace.F[1:-1])


@pytest.mark.parametrize("form", FORMATS)
def test_the_loop_of_the_readme(
    form: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (folder / f"README-gms-{form}.md").read_text(encoding="utf-8")
    found = re.search(r"^(?: {4}(?:from ctypes|import fmpy)\b.*\n)(?:(?: {4}.*)?\n)+", text, re.M)
    assert found is not None, text
    monkeypatch.chdir(folder)
    names: dict[str, Any] = {}
    exec(re.sub(r"^ {4}", "", found[0], flags=re.M), names)
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    t = np.arange(4) * 0.01
    trace = simulate(PAPER, Prescribed((t, t)), t[-1], t_eval=t)
    assert [float(at) for at, _ in rows] == pytest.approx(t[1:])
    assert [float(force) for _, force in rows] == pytest.approx(trace.F[1:], rel=1e-9)
