"""Claim: the plain form in C has the bits of the engine, with every compiler and law."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.exporters.c_programs import plain_compared
from tests.exporters.frictions import NAMES
from tests.exporters.plain_samples import CASES, sampled


@pytest.mark.parametrize("name", CASES)
def test_random_samples_inside_the_limits(
    name: str, ran: Callable[..., None], tmp_path: Path
) -> None:
    counts = sampled(name, 1_000_000, tmp_path, "gcc")
    assert counts.found == counts.arrests
    assert counts.arrests > 1000 or name == "LuGre"  # which has no states
    told = subprocess.run(["gcc", "-dumpversion"], capture_output=True, text=True, check=True)
    ran(
        "c99",
        f"gcc {told.stdout.strip()}",
        f"plain form of {name}, 1,000,000 random samples inside its limits",
        (f"all {counts.arrests:,} arrests found; " if counts.arrests else "no states; ")
        + f"F at most {100 * counts.largest:.1f} % of its largest value apart, "
        + f"{100 * counts.error:.1f} % where all states are equal",
    )


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_bits_of_the_engine(compiler: str, ran: Callable[..., None], tmp_path: Path) -> None:
    if not shutil.which(compiler):
        pytest.skip(f"{compiler} is not installed")
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
