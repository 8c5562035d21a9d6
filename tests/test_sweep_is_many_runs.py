"""A sweep is many single runs: the same bits, one row each, and a bad set spoils no other."""

from __future__ import annotations

import os
import signal
import sys
import threading
import tracemalloc
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    GMS,
    LuGre,
    Prescribed,
    PulledSlider,
    Slider,
    Stribeck,
    Sweep,
    simulate,
    sweep,
)
from gms_fsm.errors import MissingExtraError, OutputError, ParameterError, TraceFileError
from gms_fsm.models import with_values
from gms_fsm.rigs import with_numbers
from tests.helpers import SINE, non_drifting, pulled_mass, stick_slip

module = sys.modules["gms_fsm.sweep"]  # the package has a function of that name
HAS_NUMBA = bool(__import__("importlib.util").util.find_spec("numba"))
ENGINES = [
    "machines",
    "ifelse",
    pytest.param("compiled", marks=pytest.mark.skipif(not HAS_NUMBA, reason="needs extra fast")),
]
FAST = "compiled" if HAS_NUMBA else "ifelse"


def varied(runs: int, spread: float = 0.2) -> dict[str, Any]:
    """The pulled mass's stiffness, each element by itself, and the weights that go with it."""
    k = pulled_mass()[0].values["k"] * np.random.default_rng(7).uniform(
        1 - spread, 1 + spread, (runs, 4)
    )
    return {"k": k, "weights": 1 / (4 * k)}


# --------------------------------------------------------------------------- equal to single runs
@pytest.mark.parametrize("engine", ENGINES)
def test_each_row_is_the_run_by_itself(engine: str) -> None:
    model, rig = pulled_mass()
    sets = varied(5) | {"speed": [0.1, 0.12, 0.08, 0.1, 0.2], "F_s": [1.5, 1.4, 1.6, 1.0, 1.5]}
    result = sweep(model, rig, 20.0, sets, engine=engine)
    for run in range(5):
        values = {name: np.asarray(array)[run] for name, array in sets.items()}
        alone = simulate(
            with_values(model, values), with_numbers(rig, values), 20.0, engine=engine, output="end"
        )
        log = alone.transitions
        assert (result.t[run], result.x[run], result.v[run], result.F[run]) == (
            alone.t[0], alone.x[0], alone.v[0], alone.F[0],
        )  # fmt: skip
        assert result.z[run].tolist() == alone.z[0].tolist()
        assert result.states[run].tolist() == alone.states[0].tolist()
        assert result.sequence(run) == list(
            zip(log.element.tolist(), log.edge.tolist(), strict=True)
        )
        mine = result.transitions[result.transitions.run == run]
        for name in ("t", "z", "v", "s", "F_before", "F_after"):
            np.testing.assert_array_equal(mine[name], log[name])
        assert result.transition_count[run] == len(log)


@pytest.mark.parametrize("engine", ENGINES)
def test_rows_at_given_times(engine: str) -> None:
    times = np.linspace(0.0, 15.0, 41)
    model, rig = pulled_mass()
    result = sweep(model, rig, 15.0, varied(3), engine=engine, output="t_eval", t_eval=times)
    assert result.times.tolist() == times.tolist()
    for run in range(3):
        values = {name: array[run] for name, array in varied(3).items()}
        alone = simulate(with_values(model, values), rig, 15.0, t_eval=times)
        for name in ("x", "v", "F", "z"):
            np.testing.assert_array_equal(result.rows[name][run], getattr(alone, name))


@pytest.mark.skipif(not HAS_NUMBA, reason="needs the extra fast")
def test_two_hundred_pulled_masses_have_the_right_sequence_of_events() -> None:
    """k varied by 20 %, w = 1/(4k): rtol 1e-6 against 1e-10."""
    model, rig = pulled_mass()
    coarse = sweep(model, rig, 60.0, varied(200))
    fine = sweep(model, rig, 60.0, varied(200), rtol=1e-10, atol=1e-13)
    assert set(coarse.outcome) == set(fine.outcome) == {"ok"}
    wrong = [run for run in range(200) if coarse.sequence(run) != fine.sequence(run)]
    assert wrong == []
    assert coarse.transition_count.min() > 30


@pytest.mark.parametrize("make", [lambda: ThreadPoolExecutor(1), lambda: ProcessPoolExecutor(2)])
def test_any_executor_gives_the_same(make: Callable[[], Executor]) -> None:
    model, rig = pulled_mass()
    with make() as executor:
        there = sweep(model, rig, 5.0, varied(70), executor=executor, engine="machines")
    here = sweep(model, rig, 5.0, varied(70), engine="machines")
    np.testing.assert_array_equal(there.z, here.z)
    assert there.transitions.tolist() == here.transitions.tolist()


# --------------------------------------------------------------------------- what can be varied
def test_one_number_goes_to_all_elements() -> None:
    one = sweep(stick_slip("signed"), Prescribed(SINE), 6.0, {"k": [0.7, 1.4]}, engine="ifelse")
    each = sweep(
        stick_slip("signed"), Prescribed(SINE), 6.0, {"k": [[0.7] * 4, [1.4] * 4]}, engine="ifelse"
    )
    np.testing.assert_array_equal(one.F, each.F)
    assert one.F[0] != one.F[1]


@pytest.mark.parametrize(
    ("model", "rig", "name"),
    [
        (pulled_mass()[0], pulled_mass()[1], name)
        for name in ("sigma", "C", "v_c", "sigma_2", "F_c", "F_s", "v_s", "mass", "stiffness")
    ]
    + [
        (*non_drifting("signed"), "mass"),
        (LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4.0, stribeck=Stribeck(1.0, 1.5, 1e-3)),
         Slider(1.0, "t"), "sigma_0"),
    ],
)  # fmt: skip
def test_every_number_can_be_varied(model: Any, rig: Any, name: str) -> None:
    old = {**model.values, "sigma_2": model.sigma_2, **vars(model.stribeck), **rig.numbers}[name]
    value = float(np.mean(old))
    result = sweep(model, rig, 9.0, {name: [value, 1.2 * value]}, engine="ifelse")
    assert result.outcome.tolist() == ["ok", "ok"]
    assert name == "v_c" or result.F[0] != result.F[1] or result.x[0] != result.x[1]


def test_a_data_frame_numbers_the_elements_from_one() -> None:
    pandas = pytest.importorskip("pandas", reason="needs the extra pandas")
    sets = varied(3)
    frame = pandas.DataFrame({f"k{i + 1}": sets["k"][:, i] for i in range(4)}).assign(
        **{f"weights{i + 1}": sets["weights"][:, i] for i in range(4)}, speed=[0.1, 0.2, 0.3]
    )
    model, rig = pulled_mass()
    there = sweep(model, rig, 5.0, frame, engine="ifelse")
    here = sweep(model, rig, 5.0, sets | {"speed": [0.1, 0.2, 0.3]}, engine="ifelse")
    np.testing.assert_array_equal(there.z, here.z)
    with pytest.raises(ParameterError, match="not k4"):
        sweep(model, rig, 5.0, frame.drop(columns="k4"), engine="ifelse")


WRONG: list[tuple[Any, str]] = [
    ({"K": [1.0]}, "parameters has 'K'; known here are k, sigma"),
    ({}, "empty"),
    ({"k": [[1.0, 2.0]]}, r"shape \(1, 2\)"),
    ({"F_s": [[1.5]]}, r"it must be \(runs,\)"),
    ({"F_s": 1.5}, "shape"),
    ({"F_s": []}, "at least one"),
    ({"F_s": [1.5, 1.6], "F_c": [1.0]}, "F_s: 2, F_c: 1"),
    ({"F_s": ["much"]}, "numbers"),
]


@pytest.mark.parametrize(("sets", "words"), WRONG)
def test_a_wrong_set_is_named(sets: Any, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        sweep(*pulled_mass(), 5.0, sets, engine="ifelse")


def test_what_is_wrong_for_every_run_is_said_once() -> None:
    with pytest.raises(ParameterError, match="output is 'all'"):
        sweep(*pulled_mass(), 5.0, {"F_s": [1.5]}, output="all", engine="ifelse")
    with pytest.raises(ParameterError, match="t_end"):
        sweep(*pulled_mass(), -5.0, {"F_s": [1.5]}, engine="ifelse")
    with pytest.raises(ParameterError, match="t_eval"):
        sweep(*pulled_mass(), 5.0, {"F_s": [1.5]}, output="t_eval", engine="ifelse")


# --------------------------------------------------------------------------- failing runs
@pytest.mark.parametrize("engine", ENGINES)
def test_a_failing_set_is_a_row(engine: str) -> None:
    """A negative Coulomb force, F_s < F_c, and a sliding mode among sound sets."""
    model, rig = pulled_mass()
    sets = {"F_c": [1.0, -1.0, 1.0, 2.0, 1.0]}
    result = sweep(model, rig, 12.0, sets, engine=engine)
    assert result.outcome.tolist() == ["ok", "ParameterError", "ok", "ParameterError", "ok"]
    assert "F_c is -1.0" in result.message[1]
    assert "F_s is 1.5, F_c is 2.0" in result.message[3]
    assert np.isnan([result.t[1], result.F[3]]).all()
    assert result.states[1].tolist() == [""] * 4
    assert result.F[0] == result.F[2] == result.F[4]
    assert result.transition_count.tolist()[1::2] == [0, 0]
    assert result.message[0] == ""


@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_that_cannot_go_on_keeps_its_part(engine: str) -> None:
    """The flow blows up at t = 1/k, before the end for one of the sets."""
    from gms_fsm import Chart, ChartModel, State

    chart = Chart("steep", ("v",), ("z",), ("k",), (State("on", {"z": "k * z * z"}),), (),
                  {"F": "z"})  # fmt: skip
    model = ChartModel(chart, {"k": 1.0}, n=1, stribeck=Stribeck(1.0, 1.5, 0.1))
    result = sweep(model, Prescribed("0"), 2.0, {"k": [0.1, 1.0, 0.2]}, engine=engine,
                   initial={"z": [1.0]})  # fmt: skip
    assert result.outcome[[0, 2]].tolist() == ["ok", "ok"]
    assert result.outcome[1] in ("StepSizeError", "NotFiniteError")
    assert result.t[1] == pytest.approx(1.0, abs=1e-3)
    assert result.z[0, 0] == pytest.approx(1 / (1 - 0.2), rel=1e-5)


class LosesOne(Executor):
    """An executor of which one task is lost."""

    def __init__(self) -> None:
        self.tasks = 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.tasks += 1
        future: Future[Any] = Future()
        if self.tasks == 2:
            future.set_exception(MemoryError("worker out of memory"))
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def test_a_lost_task_makes_rows_that_say_so() -> None:
    result = sweep(*pulled_mass(), 2.0, varied(4), executor=LosesOne(), engine="ifelse")
    assert result.outcome.tolist() == ["ok", "MemoryError", "ok", "ok"]
    assert "worker out of memory" in result.message[1]
    assert "run these again" in result.message[1]


def test_a_killed_pool_loses_rows_but_not_the_sweep() -> None:
    with ProcessPoolExecutor(1) as executor:
        pid = executor.submit(os.getpid).result()
        threading.Timer(0.5, os.kill, (pid, signal.SIGKILL)).start()
        result = sweep(*pulled_mass(), 200.0, varied(64), executor=executor, engine="machines")
    assert "BrokenProcessPool" in set(result.outcome)
    assert set(result.outcome) <= {"ok", "BrokenProcessPool"}
    assert len(result) == 64


def test_ctrl_c_leaves_nothing_running(monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(module._Collected, "take", stop)
    before = threading.active_count()
    with pytest.raises(KeyboardInterrupt):
        sweep(*pulled_mass(), 3.0, varied(300), engine="ifelse")
    assert threading.active_count() == before


# --------------------------------------------------------------------------- what comes out
def test_tables_and_files(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas", reason="needs the extra sweep")
    pytest.importorskip("pyarrow", reason="needs the extra sweep")
    sets = varied(4) | {"F_c": [1.0, -1.0, 1.0, 1.0]}
    result = sweep(*pulled_mass(), 12.0, sets, engine="ifelse")
    frame = result.to_dataframe()
    assert frame.shape[0] == 4
    assert frame["k3"].tolist() == sets["k"][:, 2].tolist()
    assert frame["outcome"].tolist() == result.outcome.tolist()
    assert frame["transitions"].tolist() == result.transition_count.tolist()
    result.save(tmp_path / "sweep.parquet")
    back = pandas.read_parquet(tmp_path / "sweep.parquet")
    pandas.testing.assert_frame_equal(back, frame, check_dtype=False)
    log = pandas.read_parquet(tmp_path / "sweep.transitions.parquet")
    assert log["edge"].tolist() == [edge for run in range(4) for _, edge in result.sequence(run)]


def test_xarray_has_dimensions_and_units() -> None:
    pytest.importorskip("xarray", reason="needs the extra sweep")
    times = np.linspace(0.0, 5.0, 7)
    data = sweep(
        *pulled_mass(), 5.0, varied(3), engine="ifelse", output="t_eval", t_eval=times
    ).to_xarray()
    assert dict(data.sizes) == {"run": 3, "element": 4, "time": 7}
    assert data["F"].dims == ("run", "time")
    assert data["z"].dims == ("run", "time", "element")
    assert (data["F"].units, data["z_end"].units, data["v_end"].units) == ("N", "m", "m/s")
    assert data["element"].values.tolist() == [1, 2, 3, 4]
    assert float(data["F"][1, -1]) == float(data["F_end"][1])


@pytest.mark.parametrize("rows", [False, True])
def test_npz_reads_back_equal(rows: bool, tmp_path: Path) -> None:
    options: dict[str, Any] = {"output": "t_eval", "t_eval": [0.0, 1.0, 5.0]} if rows else {}
    result = sweep(*pulled_mass(), 5.0, varied(3) | {"F_c": [1.0, -1.0, 1.0]}, engine="ifelse",
                   **options)  # fmt: skip
    back = Sweep.load(result.save(tmp_path / "sweep.npz"))
    for name in ("outcome", "message", "t", "x", "v", "F", "z", "states", "times"):
        np.testing.assert_array_equal(getattr(back, name), getattr(result, name))
    for group in ("parameters", "rows"):
        mine, other = getattr(result, group), getattr(back, group)
        assert set(mine) == set(other)
        for name in mine:
            np.testing.assert_array_equal(mine[name], other[name])
    assert back.transitions.tolist() == result.transitions.tolist()
    assert back.edges == result.edges
    assert repr(back) == repr(result)


def test_other_files_are_refused(tmp_path: Path) -> None:
    result = sweep(*pulled_mass(), 1.0, {"F_s": [1.5]}, engine="ifelse")
    with pytest.raises(OutputError, match=r"\.npz or \.parquet"):
        result.save(tmp_path / "sweep.csv")
    with pytest.raises(TraceFileError, match="no such file"):
        Sweep.load(tmp_path / "none.npz")
    (tmp_path / "bad.npz").write_bytes(b"bad")
    with pytest.raises(TraceFileError, match="not a sweep"):
        Sweep.load(tmp_path / "bad.npz")


def test_a_missing_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    result = sweep(*pulled_mass(), 1.0, {"F_s": [1.5]}, engine="ifelse")

    def missing(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr(module.importlib, "import_module", missing)
    with pytest.raises(MissingExtraError, match=r"gms-fsm\[sweep\]"):
        result.to_xarray()


def test_memory_grows_with_the_result_rows_only() -> None:
    def peak(runs: int) -> int:
        sets = varied(runs)
        with ThreadPoolExecutor(1) as executor:
            tracemalloc.start()
            sweep(*pulled_mass(), 12.0, sets, executor=executor, engine=FAST)
            found = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
        return found

    peak(2)
    few, many = peak(40), peak(240)
    # A row: parameters, end, a log of some 16 firings of 72 bytes, three times while it is joined.
    assert many - few < 200 * 8_000


def test_the_bar_is_shown_when_asked(capsys: pytest.CaptureFixture[str]) -> None:
    sweep(*pulled_mass(), 1.0, varied(3), engine="ifelse", progress=True)
    assert "3/3" in capsys.readouterr().err
    sweep(*pulled_mass(), 1.0, varied(3), engine="ifelse")
    assert capsys.readouterr().err == ""


def test_the_model_itself_is_not_touched() -> None:
    model, rig = pulled_mass()
    before = model.values["k"].copy(), rig.speed
    sweep(model, rig, 1.0, varied(2) | {"speed": [0.1, 0.3]}, engine="ifelse")
    assert model.values["k"].tolist() == before[0].tolist()
    assert isinstance(model, GMS)
    assert isinstance(rig, PulledSlider)
    assert rig.speed == before[1]
