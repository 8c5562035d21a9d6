"""The coverage of runs in any order and in any groups, by way of files or not, is that of all."""

from __future__ import annotations

import functools
import json
import random
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gms_fsm import (
    Coverage,
    LuGre,
    ParameterError,
    Prescribed,
    Stribeck,
    Trace,
    TraceFileError,
    coverage,
    simulate,
)
from tests.helpers import FIG4_SINE, stick_slip

SIGNALS = ("0.2", "-0.2", "0.1*t", FIG4_SINE, "0", "0.05*sin(t)")


@functools.cache
def runs() -> tuple[Trace, ...]:
    model = stick_slip("signed")
    return (
        *(simulate(model, Prescribed(v), 3.0) for v in SIGNALS),
        simulate(model, Prescribed(FIG4_SINE), 30.0, output="end"),
    )


@functools.cache
def together() -> Coverage:
    return coverage(runs())


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 2**32), groups=st.integers(1, 4))
def test_groups_add_up_to_all(seed: int, groups: int) -> None:
    chance = random.Random(seed)
    order = list(runs())
    chance.shuffle(order)
    parts: list[list[Trace]] = [[] for _ in range(groups)]
    for each in order:
        chance.choice(parts).append(each)
    found = [coverage(part) for part in parts if part]
    assert Coverage.merged(found) == together()
    assert Coverage.merged(found).text == together().text


def test_files_add_up_to_all() -> None:
    with tempfile.TemporaryDirectory() as folder:
        path, total = Path(folder) / "counts.json", None
        for each in runs():
            now = coverage(each)
            total = now if total is None else Coverage.load(path) + now
            total.save(path)
        assert Coverage.load(path) == together()


def test_what_was_taken_in_one_run_has_no_margins_in_all() -> None:
    forward, backward = coverage(runs()[0]), coverage(runs()[1])
    edge = "break_away_forward", "stick"
    assert backward.contact().edge(*edge).closest
    assert (forward + backward).contact().edge(*edge).closest == {}
    assert (backward + forward).contact().edge(*edge).closest == {}


def test_other_charts_do_not_add_up() -> None:
    lugre = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
    other = coverage(simulate(lugre, Prescribed("0.1"), 0.01))
    with pytest.raises(ParameterError, match="of another chart"):
        together() + other
    with pytest.raises(ParameterError, match="nothing to merge"):
        Coverage.merged([])


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("runs", -1),
        ("states", []),
        ("edges", []),
        ("chart", {}),
        ("surplus", 1),
    ],
)
def test_a_file_with_other_counts_than_those_of_its_chart_is_refused(
    tmp_path: Path, key: str, value: object
) -> None:
    path = together().save(tmp_path / "counts.json")
    data = json.loads(path.read_text())
    data["parts"][""][key] = value
    path.write_text(json.dumps(data))
    with pytest.raises(TraceFileError, match="damaged coverage file"):
        Coverage.load(path)


@pytest.mark.parametrize(
    ("edge", "key", "value"),
    [
        (0, "taken", [1]),
        (0, "asked", {"2": [1, 1, 1, 1]}),
        (0, "asked", {"10": [1, 1, 1]}),
        (2, "closest", {"10": [1.0]}),
        (1, "source", "slip"),
    ],
)
def test_counts_that_do_not_fit_the_guards_are_refused(
    tmp_path: Path, edge: int, key: str, value: object
) -> None:
    path = together().save(tmp_path / "counts.json")
    data = json.loads(path.read_text())
    data["parts"][""]["edges"][edge][key] = value
    path.write_text(json.dumps(data))
    with pytest.raises(TraceFileError, match="damaged coverage file"):
        Coverage.load(path)
