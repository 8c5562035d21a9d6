"""The benchmark trains each method on training rows, scores the held-out ones, and anyone's JSON.

Made small: a data set of one record, and methods that are known exactly.
"""

from __future__ import annotations

import json
import runpy
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import GMSError, ParameterError, Record, RecordError
from gms_fsm.app.benchmark import datasets, make, page, write
from gms_fsm.app.benchmark.datasets import DataSet, Split, data_set
from gms_fsm.app.benchmark.methods import METHODS, Method, Predictor
from gms_fsm.identification.bank import stop_operators
from gms_fsm.identification.fit import fitted
from tests.helpers import ROOT
from tests.scenario_files import data_folder

pytest.importorskip("llvmlite", reason="fits take long without machine code")

SCORE = runpy.run_path(str(ROOT / "benchmarks" / "score.py"))
T = np.linspace(0.0, 12.0, 601)
X = 1e-3 * np.sin(2.0 * np.pi * T / 2.0)
F = stop_operators(X, [2e-4]) @ [5e3] + 0.1
RECORD = replace(Record.from_arrays(time=T, position=X, force=F, name="rig"), licence="free")


def small(_: Path) -> tuple[Split, ...]:
    early = RECORD.columns["time"] < 8.0
    return (Split((replace(RECORD, chosen=early),), (replace(RECORD, chosen=~early),)),)


SMALL = DataSet("rig", "A rig", "from 8 s on", None, small, {"other": {"rig": 0.5}})


def constant(value: float) -> Method:
    def train(records: Any, _: float | None, __: Predictor | None) -> Predictor:
        assert (records[0].columns["time"][records[0].chosen] < 8.0).all()
        return Predictor(1, lambda record: np.full(len(record), value))

    return Method(f"constant {value:g}", train, ("rig",))


def of_card(name: str) -> Method:
    found = next(method for method in METHODS if method.name == name)
    return replace(found, on=("rig",))


def test_what_was_held_out_is_scored() -> None:
    card = make(Path(), data=[SMALL], methods=[constant(0.0), constant(1.0)])
    published, zero, one = card.sections[0].rows
    assert (published.model, published.rmse, published.free) == ("other", 0.5, None)
    left = F[T >= 8.0]
    assert zero.rmse == pytest.approx(np.sqrt(np.mean(left**2)))
    assert one.r2 == pytest.approx(
        1.0 - np.sum((left - 1.0) ** 2) / np.sum((left - left.mean()) ** 2)
    )
    assert one.train_rmse == pytest.approx(np.sqrt(np.mean((F[T < 8.0] - 1.0) ** 2)))
    assert one.by_record == {"rig": one.rmse}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "worst"), [("static curve", 0.7), ("Maxwell-slip, NNLS, 15", 0.05), ("GMS 1", 0.01)]
)
def test_methods_of_the_card_learn_a_spring(name: str, worst: float) -> None:
    card = make(Path(), data=[SMALL], methods=[of_card(name)])
    row = card.sections[0].rows[-1]
    assert row.note == ""
    assert row.rmse is not None
    assert row.rmse < worst


def test_a_method_that_fails_is_a_row_with_the_reason() -> None:
    def fails(*_: Any) -> Predictor:
        raise GMSError("no spring")

    card = make(Path(), data=[SMALL], methods=[constant(0.0), Method("bad", fails, ("rig",))])
    row = card.sections[0].rows[-1]
    assert (row.model, row.rmse, row.note) == ("bad", None, "no spring")
    text = page(card)
    for words in ("A rig", "Held out: from 8 s on. free.", "| constant 0 | 1 |", "Submit yours"):
        assert words in text


def test_interrupted_it_keeps_what_is_complete(tmp_path: Path) -> None:
    def stops(*_: Any) -> Predictor:
        raise KeyboardInterrupt

    methods = [constant(0.0), Method("endless", stops, ("rig",)), constant(1.0)]
    card = make(tmp_path, data=[SMALL], methods=methods)
    assert not card.complete
    assert [row.model for row in card.sections[0].rows] == ["other", "constant 0"]
    files = write(card, tmp_path)
    assert "interrupted" in files[0].read_text()
    written = json.loads(files[1].read_text())
    assert written["sections"][0]["rows"][1]["rmse"] == card.sections[0].rows[1].rmse


@pytest.mark.slow
def test_a_fit_that_was_interrupted_is_no_row(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(task: Any, **_: Any) -> Any:
        local = replace(task, options=replace(task.options, search="local"))
        return replace(fitted(local, intervals=False), stopped="interrupted")

    monkeypatch.setattr("gms_fsm.app.benchmark.methods.fitted", interrupted)
    card = make(Path(), data=[SMALL], methods=[constant(0.0), of_card("GMS 1")])
    assert not card.complete
    assert [row.model for row in card.sections[0].rows] == ["other", "constant 0"]


# --------------------------------------------------------------------------- submissions
@pytest.fixture
def submit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(datasets, "DATA_SETS", (SMALL,))

    def run(given: Any) -> Any:
        path = tmp_path / "mine.json"
        path.write_text(given if isinstance(given, str) else json.dumps(given))
        return SCORE["scored"](path, tmp_path)

    return run


def test_predictions_of_others_are_scored(submit: Any) -> None:
    held = T >= 8.0
    given = {"name": "mine", "dataset": "rig", "F": (F[held] + 0.25).tolist()}
    row = submit(given)
    assert (row.model, row.rmse) == ("mine", pytest.approx(0.25))
    assert submit(given | {"F": {"rig": F[held].tolist()}}).r2 == 1.0
    some = np.flatnonzero(held)[3:9]
    row = submit(given | {"rows": some.tolist(), "F": (F[some] - 0.5).tolist()})
    assert (row.rmse, row.note) == (pytest.approx(0.5), "6 rows")


GOOD: dict[str, Any] = {"name": "mine", "dataset": "rig", "F": [0.0] * int((T >= 8.0).sum())}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("{", "mine.json.*not JSON"),
        ("[]", "no name, dataset, F"),
        ({"name": "mine"}, "no dataset, F"),
        (GOOD | {"name": 3}, "name is 3"),
        (GOOD | {"dataset": "rigg"}, "'rigg'.*there are rig"),
        (GOOD | {"F": [1.0]}, "1 forces for 201 rows"),
        (GOOD | {"F": 3}, "a list for each record"),
        (GOOD | {"F": {"test99": []}}, "no record 'test99'.*rig"),
        (GOOD | {"F": {}}, "no forces for rig"),
        (GOOD | {"F": ["a"] * 201}, "list of numbers"),
        (GOOD | {"F": [float("nan")] * 201}, "entry 0.*not finite"),
        (GOOD | {"rows": [2], "F": [1.0]}, "entry 0.*no held-out row.*from 400 to 600"),
        (GOOD | {"rows": [500, 450], "F": [1.0, 1.0]}, "must increase"),
    ],
)
def test_a_file_that_cannot_be_scored(submit: Any, given: Any, words: str) -> None:
    with pytest.raises((RecordError, ParameterError), match=words):
        submit(given)


def score(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> None:
    monkeypatch.setattr(sys, "argv", ["score.py", *arguments])
    SCORE["main"]()


@pytest.mark.slow
def test_the_tribometer_is_scored_from_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match=r"^score: none\.json: it cannot be read"):
        score(monkeypatch, "none.json")
    (split,) = data_set("tribometer").splits(data_folder())
    (held,) = split.held
    forces = held.columns["force"][held.chosen] + 0.1
    Path("mine.json").write_text(
        json.dumps({"name": "mine", "dataset": "tribometer", "F": forces.tolist()})
    )
    score(monkeypatch, "mine.json", "--data", str(data_folder()))
    assert "| mine | – | – | 0.1 |" in capsys.readouterr().out
    assert split.training[0].columns["time"][split.training[0].chosen].max() < 100.0
    assert held.columns["time"][held.chosen].min() >= 100.0
