"""The runs of the lessons, each made once."""

from __future__ import annotations

import functools
from collections.abc import Callable

import pytest

from gms_fsm.app.lessons import LESSONS, Result


@functools.cache
def _made(number: int) -> Result:
    if number == 11:
        pytest.importorskip("llvmlite", reason="fits take long without machine code")
    return LESSONS[number].run()


@pytest.fixture(scope="session")
def ran() -> Callable[[int], Result]:
    """Return the result of a lesson by its number."""
    return _made
