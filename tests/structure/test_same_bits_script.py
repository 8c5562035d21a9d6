"""The script that compares two commits reports runs that differ, are missing or fail, and exits 1.

The tables are invented; the runs themselves take too long for a test.
"""

from __future__ import annotations

import importlib.util
import sys
from types import ModuleType

import numpy as np
import pytest

from tests.helpers import ROOT

SCRIPT = ROOT / "benchmarks" / "same_bits.py"
OLD = {"sine": {"t": "a", "F": "b"}, "pulled": {"t": "c"}}


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("same_bits", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("new", "said"),
    [
        (OLD, {"sine": "same", "pulled": "same"}),
        (OLD | {"sine": {"t": "a", "F": "x"}}, {"sine": "DIFFERS in F", "pulled": "same"}),
        (OLD | {"sine": {"t": "a"}}, {"sine": "DIFFERS in F", "pulled": "same"}),
        ({"sine": OLD["sine"]}, {"sine": "same", "pulled": "MISSING at NEW"}),
        (OLD | {"new": {"t": "a"}}, {"sine": "same", "pulled": "same", "new": "MISSING at OLD"}),
        (OLD | {"sine": {"failed": "ValueError: no"}},
         {"sine": "FAILED: ValueError: no", "pulled": "same"}),
    ],
)  # fmt: skip
def test_the_report_and_the_exit_code(
    script: ModuleType,
    new: dict[str, dict[str, str]],
    said: dict[str, str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    lines, others = script.compared(OLD, new)
    assert len(lines) == len(said)
    for name, text in said.items():
        (line,) = (line for line in lines if line.startswith(name))
        assert line.endswith(f" {text}")
    assert others == sum(text != "same" for text in said.values())
    monkeypatch.setattr(script, "table_at", lambda commit, _: new if commit is None else OLD)
    monkeypatch.setattr(sys, "argv", ["same_bits.py", "HEAD"])
    assert script.main() == (others > 0)
    assert f"{len(said)} runs, {len(said) - others} the same" in capsys.readouterr().out


def test_a_run_that_fails_at_both_commits_is_reported(script: ModuleType) -> None:
    failed = {"sine": {"failed": "ValueError: no"}}
    assert script.compared(failed, failed)[1] == 1


def test_no_run_at_all_is_a_failure(script: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(script, "table_at", lambda *_: {})
    monkeypatch.setattr(sys, "argv", ["same_bits.py", "HEAD"])
    assert script.main() == 1


def test_the_last_bit_the_sign_of_zero_and_the_shape_count(script: ModuleType) -> None:
    one = np.array([0.0, 1.0])
    others = [np.array([-0.0, 1.0]), np.array([0.0, np.nextafter(1.0, 2.0)]), one[:, None],
              np.array([0, 1]), np.array(["0.0", "1.0"])]  # fmt: skip
    assert script.digest(one.copy()) == script.digest(one)
    assert len({script.digest(array) for array in [one, *others]}) == 6
    # The width of a text array says nothing about its texts.
    assert script.digest(np.array(["slip"], dtype="U9")) == script.digest(np.array(["slip"]))
