"""The C99 text of a run, compiled by a C compiler without contraction, gives the engine's bits."""

from __future__ import annotations

import shutil

import pytest

from tests.corpus import each, run, trace
from tests.helpers import other_parts
from tests.soak.platforms import in_c

pytest.importorskip("llvmlite", reason="needs the extra fast")

STRICT = ("-Wall", "-Wno-unused", "-Werror")
TRANSLATED = (
    "pulled mass, rk4",
    "a function",
    "sliding",
    "functions that jump",
    "system servo",
    "system puck",
    "states in states",
    "conditions that last",
    "events at given times",
)
IN_A_MATRIX = {"system puck", "functions that jump", "events at given times"}


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
@each(TRANSLATED, {*TRANSLATED} - IN_A_MATRIX)
def test_a_run_in_c_is_the_run(name: str) -> None:
    with in_c("cc", "-O2", STRICT) as translated:
        found = run(name)(engine="compiled")
    assert translated, "nothing was compiled"
    assert other_parts(found, trace(name, "machines")) == []
