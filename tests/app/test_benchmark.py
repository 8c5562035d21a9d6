"""The benchmark trains each method on training rows, scores the held-out ones, and anyone's JSON.

Made small: a data set of one record, and methods that are known exactly.
"""

from __future__ import annotations

import json
import runpy
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gms_fsm import GMSError, ParameterError, Record, RecordError
from gms_fsm.app.benchmark import datasets, make, methods, page, write
from gms_fsm.app.benchmark.datasets import DataSet, Split, data_set
from gms_fsm.app.benchmark.methods import METHODS, Method, Predictor
from gms_fsm.identification.bank import stop_operators
from gms_fsm.identification.fit import fitted, task_of
from gms_fsm.identification.problem.task import FitOptions
from tests.helpers import ROOT
from tests.scenario_files import CommandLine, data_folder

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


def test_progress_is_told_for_each_split_of_all_data_sets() -> None:
    told: list[tuple[str, float]] = []
    twice = replace(SMALL, name="two", splits=lambda folder: small(folder) * 2)
    both = replace(constant(1.0), on=("rig", "two"))
    make(Path(), data=[SMALL, twice], methods=[constant(0.0), both],
         progress=lambda *each: told.append(each))  # fmt: skip
    assert told == [
        ("rig: constant 0", 0.0), ("rig: constant 1", 0.25),
        ("two: constant 1, 1 of 2", 0.5), ("two: constant 1, 2 of 2", 0.75),
    ]  # fmt: skip


@pytest.mark.matrix
@pytest.mark.every(2)
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


def in_turn(records: tuple[Record, ...]) -> tuple[Split, ...]:
    """Split as the damper is split, whose files are not there."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(datasets, "damper", lambda _: iter(records))
        return data_set("damper").splits(Path())


OTHERS = tuple(
    replace(
        Record.from_arrays(time=T[::4], position=a * X[::4], force=F[::4], name=f"test{a:g}"),
        licence="free",
    )
    for a in (1.0, 1.1, 1.2)
)
TESTS = replace(SMALL, name="damper", splits=lambda _: in_turn(OTHERS), published={})


@pytest.mark.parametrize("name", ["Dahl", "LuGre", "Bouc-Wen", "choose"])
def test_fits_of_later_splits_begin_at_the_first_one(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    tasks: list[Any] = []

    def near(task: Any, **_: Any) -> Any:
        """Return the start of a fit as its result."""
        tasks.append(task)
        return SimpleNamespace(
            stopped="",
            table=task.options.free,
            predict=lambda record: np.zeros(len(record)),
            task=task,
            model=task.subject.model,
            choice=SimpleNamespace(chosen="GMS 1"),
        )

    def of_one_kind(records: Any, smoothing: float | None) -> Any:
        start = methods.gms(records, smoothing, n=1)
        options = FitOptions(free=start.free, tied=start.tied, bounds=start.bounds)
        return near(task_of(records, start.model, {}, options))

    monkeypatch.setattr(methods, "fitted", near)
    monkeypatch.setattr(methods, "choose", of_one_kind)
    card = make(Path(), data=[TESTS], methods=[replace(of_card(name), on=("damper",))])
    (row,) = card.sections[0].rows
    assert row.note == ("GMS 1" if name == "choose" else "")
    options = [task.options for task in tasks]
    assert [each.search for each in options] == ["hops", "local", "local"]
    assert [each.begin for each in options] == [None, tasks[0].begin, tasks[0].begin]
    assert len({each.free for each in options}) == 1
    assert row.free == len(options[0].free)
    assert [*row.by_record] == ["test1", "test1.1", "test1.2"]
    text = page(card)
    assert "| model | test1 | test1.1 | test1.2 |" in text
    assert "later ones are refined from it" in text


def test_the_verb_writes_what_is_complete(
    gms_fsm: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stops(*_: Any) -> Predictor:
        raise KeyboardInterrupt

    mine = [constant(0.0), Method("endless", stops, ("rig",))]
    for tried, code, said in ((mine[:1], 0, ""), (mine, 130, "interrupted; what was complete")):
        some = partial(make, data=[SMALL], methods=tried)
        monkeypatch.setattr("gms_fsm.app.benchmark.make", some)
        answer = gms_fsm("benchmark", "-o", "out")
        assert (answer.code, said in answer.err) == (code, True)
        assert answer.out.startswith("2 files in out; start with ")
    assert json.loads(Path("out/benchmark.json").read_text())["complete"] is False


def test_a_prediction_of_too_few_rows_is_refused() -> None:
    with pytest.raises(RecordError, match="1 forces for 601 held-out rows"):
        datasets.score({"rig": RECORD}, {"rig": np.zeros(1)})


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
        (GOOD | {"dataset": "rigg"}, "'rigg'.*there is only rig"),
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
