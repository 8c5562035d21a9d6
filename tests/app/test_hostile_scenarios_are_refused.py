"""Excessive keys, texts and rows in a scenario are rejected with a message in bounded time.

Each case was found by fuzzing.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gms_fsm import simulate
from gms_fsm.app.scenario import load_scenario
from gms_fsm.errors import (
    ParameterError,
    ScenarioError,
)
from tests.scenario_files import OPEN_LOOP, changed

LONG = "x" * 50_000


def load(tmp_path: Path, text: str, *overrides: str) -> Any:
    path = tmp_path / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return load_scenario(path, overrides)


@pytest.mark.parametrize(
    "line",
    [
        "a." * 300_000 + "a = 1",
        '"a".' * 200_000 + "a = 1",
        "'a' . " * 100_000 + "a = 1",
        "[" + "a." * 300_000 + "a]",
        "k = { " + "a." * 300_000 + "a = 1 }",
    ],
    ids=["bare", "quoted", "spaced", "head", "inline"],
)
def test_an_excessively_long_key_is_rejected(line: str, tmp_path: Path) -> None:
    """tomllib takes quadratic time in the parts of a key: 5,000 took 2 s and 150 MB."""
    with pytest.raises(ScenarioError, match=r"line 2: a key of more than 20 parts"):
        load(tmp_path, f"\n{line}\n")


def test_such_a_key_is_rejected_on_the_command_line_too(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="no key is nested this deeply"):
        load(tmp_path, OPEN_LOOP, "title={" + "a." * 50_000 + "a=1}")


def test_dots_in_texts_and_numbers_are_not_keys(tmp_path: Path) -> None:
    numbers = ", ".join(f"[{i}.5, 0.1]" for i in range(100))
    text = changed(OPEN_LOOP, '"0.1*sin(t)"', f"[{numbers}]")
    text = changed(text, '"open loop"', '"1. Here. And so on ... e.g. v.i.z. a.b.c/d.e.f"')
    assert load(tmp_path, text).title.startswith("1. Here.")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('kind = "GMS"', f'kind = "{LONG}"'),
        ('law = "signed"', f'law = "{LONG}"'),
        ('title = "open loop"', f'"{LONG}" = 1'),
    ],
    ids=["kind", "law", "key"],
)
def test_long_values_in_a_file_do_not_make_long_messages(
    old: str, new: str, tmp_path: Path
) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(tmp_path, changed(OPEN_LOOP, old, new))
    assert len(str(caught.value)) < 2000


@pytest.mark.parametrize("override", [LONG, f"{LONG}=1", f"model.{LONG}.a=1", f"title.{LONG}=1"])
def test_long_overrides_do_not_make_long_messages(override: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(tmp_path, OPEN_LOOP, override)
    assert len(str(caught.value)) < 2000


@pytest.mark.parametrize("every", ["5e-324", "1e-300", "1e-9"])
def test_rows_too_close_together_are_refused(every: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="use a larger value"):
        load(tmp_path, OPEN_LOOP, f"output.every={every}")


def test_rows_of_a_run_that_ends_before_it_starts(tmp_path: Path) -> None:
    """The run is rejected when it starts; the rows do not matter."""
    loaded = load(tmp_path, OPEN_LOOP, "run.t_start=1e9", "output.every=1e-9")
    with pytest.raises(ParameterError, match="t_end must be later"):
        simulate(loaded.model, loaded.rig, **loaded.arguments)
