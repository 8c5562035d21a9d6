"""Claim: the plain form in C has the bits of the engine, with every compiler and law."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.exporters.c_programs import plain_compared
from tests.exporters.frictions import NAMES


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_bits_of_the_engine(compiler: str, ran: Callable[..., None], tmp_path: Path) -> None:
    switches = steps = 0
    for name in NAMES:
        for seed in range(3):
            folder = tmp_path / f"{name}{seed}"
            folder.mkdir()
            counts = plain_compared(name, seed, compiler, folder)
            switches, steps = switches + counts[0], steps + counts[1]
    assert switches
    told = subprocess.run([compiler, "-dumpversion"], capture_output=True, text=True, check=True)
    ran(
        "c99",
        f"{compiler} {told.stdout.strip()}",
        f"plain form of {len(NAMES)} frictions, 3 random records each",
        f"no warning; bits of the engine in all {steps:,} steps, {switches} switches",
    )
