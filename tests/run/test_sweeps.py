"""What happens to one run of a sweep is the outcome in its row, wherever it is executed.

The order is that of the parameters, and memory does not grow with the length of the runs. That each
row is the run of `simulate` is in tests/laws/test_a_sweep_is_many_runs.py.
"""

from __future__ import annotations

import copy
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import tracemalloc
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    ParameterError,
    Prescribed,
    State,
    Stribeck,
    Sweep,
    Transition,
    coverage,
    simulate,
    sweep,
)
from gms_fsm.charts import gms_element
from gms_fsm.errors import SignalError, TraceFileError
from gms_fsm.run.sweep import _interrupts_deferred
from gms_fsm.systems.models import parameter_names, with_values
from tests.corpus import ENGINES, LUGRE, RECORD
from tests.helpers import FASTEST, bank, event_sequence, matrix, pulled_mass, stick_slip
from tests.laws.test_a_sweep_is_many_runs import same
from tests.systems_cases import two_blocks

K = np.array([40.0, 30.0, 20.0, 10.0])
inside = sys.modules[sweep.__module__]  # the module; its name refers to the function


def _sets(runs: int) -> dict[str, Any]:
    k = K * np.random.default_rng(5).uniform(0.8, 1.2, (runs, 4))
    return {"k": k, "weights": 1 / (4 * k)}


# --------------------------------------------------------------------------- parameters
def test_a_charts_own_parameter_takes_precedence_over_a_shared_one() -> None:
    force = {"F": "F_c * weights * sgn(v)"}
    states = (State("slip", flow={"z": "v"}),)
    chart = Chart("own Coulomb", ("v",), ("z",), ("F_c", "weights"), states, (), force)
    model = ChartModel(chart, {"F_c": 2.0, "weights": 3.0}, n=2, stribeck=Stribeck(1.0, 1.5, 0.1))
    assert parameter_names(model) == ("F_c", "weights", "sigma_2", "F_s", "v_s", "delta")
    other = with_values(model, {"F_c": 5.0, "weights": 7.0, "F_s": 1.25})
    assert (other.values["F_c"], other.values["weights"]) == (5.0, 7.0)
    assert (other.stribeck.F_c, other.stribeck.F_s) == (1.0, 1.25)
    assert other.weights.tolist() == [1.0, 1.0]


def test_one_number_applies_to_all_elements_and_what_is_given_is_kept() -> None:
    model, rig = pulled_mass()
    level = np.array([20.0, 30.0])
    wide = np.repeat(level[:, None], 4, axis=1)
    given = wide.copy()
    one, other = (
        sweep(model, rig, 6.0, {"k": k, "F_s": [1, 2]}, engine="ifelse") for k in (level, wide)
    )
    wide[:] = -1.0
    np.testing.assert_array_equal(one.F, other.F)
    assert one.transitions.tolist() == other.transitions.tolist()
    assert one.parameters["k"].shape == (2,)
    np.testing.assert_array_equal(other.parameters["k"], given)
    assert other.parameters["F_s"].dtype == np.float64


@pytest.mark.slow
def test_a_dataframe_has_columns_of_elements() -> None:
    pandas = pytest.importorskip("pandas", reason="needs the extra pandas")
    model, rig = pulled_mass()
    sets = _sets(3) | {"F_s": np.array([1.4, 1.5, 1.6])}
    columns = {f"{name}{i + 1}": sets[name][:, i] for i in range(4) for name in ("k", "weights")}
    frame = pandas.DataFrame(columns | {"F_s": sets["F_s"]}, index=[7, 7, 9])
    one = sweep(model, rig, 3.0, frame, engine="ifelse")
    other = sweep(model, rig, 3.0, sets, engine="ifelse")
    np.testing.assert_array_equal(one.F, other.F)
    for name, values in other.parameters.items():
        np.testing.assert_array_equal(one.parameters[name], values)
    again = sweep(model, rig, 3.0, one.to_dataframe()[frame.columns], engine="ifelse")
    np.testing.assert_array_equal(again.F, one.F)
    with pytest.raises(ParameterError, match=r"'k' for some elements, but not k3"):
        sweep(model, rig, 6.0, frame.drop(columns="k3"), engine="ifelse")
    with pytest.raises(ParameterError, match=r"'k5'; did you mean 'k'"):
        sweep(model, rig, 6.0, frame.assign(k5=1.0), engine="ifelse")


# --------------------------------------------------------------------------- failures
def _fragile() -> ChartModel:
    """Livelocks if v_c is above the speed; its flow is infinite if k is 1."""
    sound = gms_element("signed")
    states = (State("stick", {"z": "v + 0 / (k - 1)"}), State("slip", {"z": "0 * v"}))
    edges = (
        Transition("break_away", "stick", "slip", guard="abs(z) >= s and abs(v) <= v_c"),
        Transition("arrest", "slip", "stick", guard="abs(v) <= v_c and abs(z) < 10 * s"),
    )
    chart = Chart(
        "fragile", sound.inputs, sound.variables, sound.parameters, states, edges, sound.outputs
    )
    values = {"k": 2.0, "sigma": 0.1, "C": 0.1, "v_c": 0.01}
    return ChartModel(chart, values, n=2, stribeck=Stribeck(1.0, 1.5, 1e-3), weights=[2, 1])


RUNS: list[tuple[dict[str, float], str, str]] = [
    ({}, "ok", ""),
    ({"F_c": -1.0}, "ParameterError", "F_c is -1.0"),
    ({}, "ok", ""),
    ({"v_c": 0.2}, "LivelockError", "element 2 at t = 6.66"),
    ({}, "ok", ""),
    ({"k": 1.0}, "NotFiniteError", "not finite"),
    ({"F_c": 9.0}, "ParameterError", "F_s is 1.5, F_c is 9.0"),
    ({"k": np.nan}, "ParameterError", "k is nan"),
    ({}, "ok", ""),
]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_failed_run_is_a_row_and_does_not_end_the_others(engine: str) -> None:
    good = {"F_c": 1.0, "v_c": 0.01, "k": 2.0}
    parameters = {name: [(good | wrong)[name] for wrong, _, _ in RUNS] for name in good}
    how = {"engine": engine, "t_eval": [0.0, 5.0, 8.0, 12.0]}
    result = sweep(_fragile(), Prescribed("0.15"), 12.0, parameters, **how)
    assert result.outcome.tolist() == [outcome for _, outcome, _ in RUNS]
    for text, (_, _, words) in zip(result.message, RUNS, strict=True):
        assert words in text
        assert (text == "") == (words == "")
    ok, never = result.outcome == "ok", result.outcome == "ParameterError"
    for name in ("t", "x", "v", "F", "z"):
        values = getattr(result, name)
        assert np.isfinite(values[ok]).all()
        np.testing.assert_array_equal(values[ok], np.resize(values[0], values[ok].shape))
        assert np.isnan(values[never]).all()
    assert result.t[3] == pytest.approx(1 / 0.15)
    assert result.t[5] == 0.0
    assert result.transition_count.tolist() == [0, 0, 0, 100, 0, 0, 0, 0, 0]
    assert result.states[[3, 1]].tolist() == [["stick", "stick"], ["", ""]]
    assert np.isnan(result.rows["F"][3]).tolist() == [False, False, True, True]
    assert np.isnan(result.rows["F"][5]).all()
    assert repr(result) == "<Sweep: 9 runs over F_c, v_c, k; 5 failed, 100 transitions>"


def test_what_no_run_can_do_is_raised_once() -> None:
    later = RECORD[0] + 3.0, RECORD[1]
    with pytest.raises(SignalError, match=r"covers 3\.0 to 38\.0 s, but the run starts"):
        sweep(stick_slip("signed"), Prescribed(later), 9.0, {"C": [0.1]}, engine="ifelse")


# --------------------------------------------------------------------------- executors
class Backwards(Executor):
    """Runs a task when its result is requested, the last one first."""

    def __init__(self) -> None:
        self.tasks: list[tuple[Future[Any], Callable[[], Any]]] = []

    def submit(self, function: Callable[..., Any], /, *a: Any, **b: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.tasks.append((future, lambda: function(*a, **b)))
        if len(self.tasks) == 10:
            for waiting, task in reversed(self.tasks):
                waiting.set_result(task())
        return future


@pytest.mark.slow
def test_the_order_is_that_of_the_parameters_wherever_they_ran() -> None:
    model, rig = pulled_mass()
    sets = _sets(10) | {"mass": [1.0] * 9 + [-1.0]}
    options: dict[str, Any] = {"engine": "ifelse", "output": "t_eval", "t_eval": [0.0, 2.0, 5.0]}
    usual = sweep(model, rig, 5.0, sets, **options)
    assert usual.outcome.tolist() == ["ok"] * 9 + ["ParameterError"]
    same(sweep(model, rig, 5.0, sets, executor=Backwards(), **options), usual)
    with ThreadPoolExecutor(1) as threads:
        same(sweep(model, rig, 5.0, sets, executor=threads, **options), usual)
        assert threads.submit(abs, -1).result() == 1, "it is the user's: it is not shut down"


def _die(*_: Any) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


class Deadly(Executor):
    """A process pool whose worker dies in the third task."""

    def __init__(self, pool: Executor) -> None:
        self.pool, self.count = pool, 0

    def submit(self, function: Callable[..., Any], /, *a: Any, **b: Any) -> Future[Any]:
        self.count += 1
        return self.pool.submit(_die if self.count == 3 else function, *a, **b)


@pytest.mark.slow
def test_process_pools_and_a_killed_worker() -> None:
    (model, rig), sets = pulled_mass(), _sets(8)
    usual = sweep(model, rig, 3.0, sets, engine="machines")
    spawned = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=spawned) as pool:
        same(sweep(model, rig, 3.0, sets, executor=pool, engine="machines"), usual)
        unsent = Prescribed(lambda t: 0.1)
        lost = sweep(model, unsent, 1.0, {"C": [0.1] * 2}, executor=pool, engine="machines")
        assert all("the worker failed" in text for text in lost.message)
        assert all("executor=None" in text for text in lost.message)
        hurt = sweep(model, rig, 3.0, sets, executor=Deadly(pool), engine="machines")
        assert hurt.outcome.tolist() == ["ok"] * 2 + ["BrokenProcessPool"] * 6
        for text in hurt.message[2:]:
            for word in ("the worker failed", "BrokenProcessPool", "run these again"):
                assert word in text
        np.testing.assert_array_equal(hurt.F[:2], usual.F[:2])
        assert np.isnan(hurt.F[2:]).all()
        assert hurt.transition_count[2:].sum() == 0
        # A pool that is broken from the start gives rows too.
        dead = sweep(model, rig, 3.0, sets, executor=pool, engine="machines")
        assert dead.outcome.tolist() == ["BrokenProcessPool"] * 8


@contextmanager
def _struck(runs: int, progress: bool | None) -> Iterator[Callable[[int], None]]:
    """Raise Ctrl-C in place of a progress display, after two runs."""
    done = [0]

    def shown(count: int) -> None:
        done[0] += count
        if done[0] >= 2:
            raise KeyboardInterrupt

    yield shown


@pytest.mark.parametrize("place", ["progress", "a run"])
def test_ctrl_c_leaves_no_threads_running(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, begun = inside._run_chunk, []

    def counted(*arguments: Any) -> Any:
        begun.append(0)
        if place == "a run" and len(begun) == 3:
            raise KeyboardInterrupt
        return whole(*arguments)

    monkeypatch.setattr(inside, "_run_chunk", counted)
    if place == "progress":
        monkeypatch.setattr(inside, "_bar", _struck)
    before = set(threading.enumerate())
    with pytest.raises(KeyboardInterrupt):
        sweep(*pulled_mass(), 10.0, _sets(60), engine="ifelse")
    assert set(threading.enumerate()) <= before
    assert 2 <= len(begun) < 40, "pending tasks are not started"


def test_progress_is_shown_on_request(capsys: pytest.CaptureFixture[str]) -> None:
    sets = {"F_s": np.linspace(1, 2, 6)}
    sweep(*pulled_mass(), 0.1, sets, engine="ifelse", progress=True)
    assert "6/6" in capsys.readouterr().err
    for progress in (False, None):
        sweep(*pulled_mass(), 0.1, sets, engine="ifelse", progress=progress)
        said = capsys.readouterr()
        assert said.out + said.err == ""


# --------------------------------------------------------------------------- tables
@pytest.fixture(scope="module")
def mixed() -> Sweep:
    """Return two runs that end and one that cannot start; rows, wide and narrow parameters."""
    sets = _sets(3) | {"F_c": [1.0, 0.9, -1.0]}
    return sweep(*pulled_mass(), 8.0, sets, engine="ifelse", t_eval=[0.0, 3.0, 8.0])


@pytest.fixture(scope="module")
def bare() -> Sweep:
    """Return a sweep without rows and without switches."""
    return sweep(LUGRE, Prescribed("0.1"), 1.0, {"F_s": [1.5]}, engine="ifelse")


def test_a_dataframe_has_one_row_per_run(mixed: Sweep) -> None:
    pytest.importorskip("pandas", reason="needs the extra pandas")
    frame = mixed.to_dataframe()
    assert frame.index.name == "run"
    assert len(frame) == 3
    for i in range(4):
        np.testing.assert_array_equal(frame[f"z{i + 1}"], mixed.z[:, i])
        assert frame[f"state{i + 1}"].tolist() == mixed.states[:, i].tolist()
        np.testing.assert_array_equal(frame[f"k{i + 1}"], mixed.parameters["k"][:, i])
    for name in ("t", "x", "v", "F"):
        np.testing.assert_array_equal(frame[name], getattr(mixed, name))
    assert frame["outcome"].tolist() == ["ok", "ok", "ParameterError"]
    assert frame["message"][2].startswith("F_c is -1.0")
    assert frame["transitions"].tolist() == mixed.transition_count.tolist()


def test_a_dataset_has_dimensions_and_units(mixed: Sweep, bare: Sweep) -> None:
    pytest.importorskip("xarray", reason="needs the extra sweep")
    data = mixed.to_xarray()
    assert dict(data.sizes) == {"run": 3, "element": 4, "time": 3}
    for name, unit in {"x": "m", "v": "m/s", "F": "N", "z": "m"}.items():
        assert data[name].attrs["units"] == data[f"{name}_end"].attrs["units"] == unit
        assert data[name].dims == ("run", "time", "element")[: data[name].ndim]
        np.testing.assert_array_equal(data[name], mixed.rows[name])
        np.testing.assert_array_equal(data[f"{name}_end"], getattr(mixed, name))
    assert data["t_end"].attrs["units"] == "s"
    assert [data[name].dims for name in ("k", "F_c")] == [("run", "element"), ("run",)]
    assert data["outcome"].values.tolist() == ["ok", "ok", "ParameterError"]
    np.testing.assert_array_equal(data["transitions"], mixed.transition_count)
    assert float(data["z"].sel(time=3.0, element=2)[0]) == mixed.rows["z"][0, 1, 1]
    assert not {"time", "F"} & {*bare.to_xarray().variables}


def test_parameters_with_names_of_results_are_kept_separate() -> None:
    names = ("transitions", "outcome", "time", "run", "element", "z1", "state1", "x_end")
    states = (State("on", {"z": "v * (" + " + ".join(names) + ")"}),)
    chart = Chart("names", ("v",), ("z",), names, states, (), {"F": "z"})
    model = ChartModel(chart, dict.fromkeys(names, 1.0))
    values = {name: [float(i), 7.0] for i, name in enumerate(names)}
    result = sweep(model, Prescribed("1"), 1.0, values, engine="ifelse", t_eval=[0.5])
    assert pytest.approx([28.0, 56.0]) == result.F
    pytest.importorskip("pandas", reason="needs the extra pandas")
    frame = result.to_dataframe()
    assert frame["transitions"].tolist() == [0, 0]
    assert frame["parameter_transitions"].tolist() == [0.0, 7.0]
    assert frame["parameter_z1"].tolist() == [5.0, 7.0]
    assert frame["z1"].tolist() == result.z[:, 0].tolist()
    pytest.importorskip("xarray", reason="needs the extra sweep")
    data = result.to_xarray()
    assert data["parameter_run"].values.tolist() == [3.0, 7.0]
    assert data["run"].values.tolist() == [0, 1]
    assert data["time"].values.tolist() == [0.5]


def test_parquet_reads_back_with_pandas(mixed: Sweep, bare: Sweep, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas", reason="needs the extra sweep")
    pytest.importorskip("pyarrow", reason="needs the extra sweep")
    path = mixed.save(tmp_path / "sweep.parquet")
    pandas.testing.assert_frame_equal(pandas.read_parquet(path), mixed.to_dataframe())
    log = pandas.read_parquet(tmp_path / "sweep.transitions.parquet")
    assert list(log.columns) == list(mixed.transitions.dtype.names)
    for name in {*log.columns} - {"edge"}:
        np.testing.assert_array_equal(log[name], mixed.transitions[name])
    assert log["edge"].tolist() == [mixed.edges[edge] for edge in mixed.transitions["edge"]]
    bare.save(tmp_path / "bare.parquet")
    assert len(pandas.read_parquet(tmp_path / "bare.transitions.parquet")) == 0


# --------------------------------------------------------------------------- systems
def test_edges_and_columns_have_the_contact_s_name(tmp_path: Path) -> None:
    case = two_blocks()
    how = {"initial": case.initial, "engine": "ifelse"}
    found = sweep(case.system, 5.0, {"pad1.F_s": [15.0, 20.0]}, **how)
    assert found.sequence(0)[0][1].startswith(("pad1.", "pad2."))
    assert {"one.x", "belt.v", "pad1.F", "pad2.state1", "pad1.F_s"} < {*found.columns()}
    with pytest.raises(ParameterError, match="there is no contact 'pat'; there are pad1, pad2"):
        found.contact("pat")
    with np.load(found.save(tmp_path / "runs.npz")) as file:
        arrays = dict(file)
    np.savez(tmp_path / "wrong.npz", **(arrays | {"owners": arrays["owners"][:1]}))
    with pytest.raises(TraceFileError, match="owners"):
        Sweep.load(tmp_path / "wrong.npz")
    pytest.importorskip("xarray", reason="needs the extra sweep")
    assert found.to_xarray()["owner"].values.tolist() == list(found.owners)
    wrong = {"numbers.m1": [0.0, 1.0], "pad1.F_s": [20.0, 0.5]}
    result = sweep(case.system, 0.1, wrong, **how)
    assert result.outcome.tolist() == ["ParameterError", "ParameterError"]
    assert "is not positive" in result.message[0]
    assert "(F_s >= F_c)" in result.message[1]
    assert np.isnan(result.ends["one.x"]).all()


# --------------------------------------------------------------------------- many
def _many(n: int = 4) -> tuple[Any, ...]:
    """A bank of 100 elements does not fit into the block that is copied between two runs."""
    return bank(n), Prescribed("2 * sin(4 * t)"), 2.0, {"F_s": np.linspace(1.1, 2.0, 130)}, None


def _one_by_one() -> tuple[Any, ...]:
    """Whether F_s is F_c is looked at."""
    F = np.linspace(1.0, 1.5, 130)
    values = {"F_s": F, "F_c": F, "sigma_2": np.linspace(0.0, 9.0, 130)}
    return *pulled_mass(), 0.3, values, None


EXPONENT = "an exponent of two among others"
# Model, rig, end, parameters, rows: with 130 and more runs a task has several, which share memory.
LONG: dict[str, Callable[[], tuple[Any, ...]]] = {
    "firings by the hundred, then few": lambda: (
        pulled_mass()[0],
        Prescribed("0.3*sin(20*t)"),
        10.0,
        {"weights": np.resize([1.0, 40.0, 2.0], 200) / 160},
        [0, 5, 10],
    ),
    "many rows": lambda: (
        *pulled_mass(),
        5.0,
        {"k": K * np.linspace(0.8, 1.2, 130)[:, None]},
        np.linspace(0.0, 5.0, 501),
    ),
    EXPONENT: lambda: (  # another text, and so other machine code
        stick_slip("signed"),
        Prescribed("0.2"),
        2.5,
        {"delta": np.where(np.arange(130) % 3, 1.5, 2.0)},
        None,
    ),
    "all at once": _many,
    "a hundred elements": lambda: _many(100),
    "one by one": _one_by_one,
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "engine"),
    matrix(
        [(name, FASTEST) for name in LONG] + [(EXPONENT, each) for each in ENGINES[:2]],
        [(name, FASTEST) for name in LONG if "hundred" not in name] + [(EXPONENT, "ifelse")],
    ),
)
def test_of_a_task_nothing_of_one_run_is_in_the_next(name: str, engine: str) -> None:
    model, rig, t_end, values, rows = LONG[name]()
    how: dict[str, Any] = {"t_eval": rows, "engine": engine}
    found = sweep(model, rig, t_end, values, **how)
    assert (found.outcome == "ok").all()
    for run in (0, 1, 2, 3, 129):
        own = with_values(model, {key: each[run] for key, each in values.items()})
        alone = simulate(own, rig, t_end, **how)
        assert found.sequence(run) == event_sequence(alone)
        for column in ("x", "v", "F", "z"):
            its = getattr(alone, column)
            np.testing.assert_array_equal(getattr(found, column)[run], its[-1], column)
            if rows is not None:
                np.testing.assert_array_equal(found.rows[column][run], its, column)
    counts = found.transition_count
    assert name == "one by one" or counts.max() > 0
    assert name != "firings by the hundred, then few" or counts[0] > 400


@pytest.mark.matrix
@pytest.mark.slow
def test_rows_are_counted_once_where_the_log_grows() -> None:
    model, rig = stick_slip("signed"), Prescribed("2 * sin(2 * pi * t)")
    values = np.linspace(1.6, 2.0, 3)
    found = sweep(model, rig, 60.0, {"F_s": values}, coverage=True, engine=FASTEST)
    assert found.transition_count.min() > 256  # so many have room at first
    alone = [
        simulate(with_values(model, {"F_s": each}), rig, 60.0, engine=FASTEST) for each in values
    ]
    assert coverage(found) == coverage(alone)


@pytest.mark.parametrize("again", [copy.deepcopy, lambda it: pickle.loads(pickle.dumps(it))])
def test_the_coverage_of_a_sweep_is_counted_when_it_is_read_or_copied(
    again: Callable[[Any], Any],
) -> None:
    model, rig = stick_slip("signed"), Prescribed("2 * sin(2 * pi * t)")
    found = sweep(model, rig, 2.0, {"F_s": [1.6, 1.8]}, engine=FASTEST)
    assert "parts" not in vars(found.coverage)
    taken = again(found).coverage.contact("").edges
    assert sum(sum(edge.taken) for edge in taken) == len(found.transitions) > 0
    assert again(found).coverage == found.coverage


def test_coverage_does_not_depend_on_what_is_done_to_the_log_before() -> None:
    model, rig = stick_slip("signed"), Prescribed("2 * sin(2 * pi * t)")
    first, second = (sweep(model, rig, 2.0, {"F_s": [1.6, 1.8]}, engine=FASTEST) for _ in "ab")
    first.transitions.sort(order="t")
    first.transitions["edge"][:] = 0
    assert first.coverage == second.coverage


@pytest.mark.slow
def test_no_sequence_of_two_hundred_depends_on_the_tolerance() -> None:
    """About 72 transitions each: the same elements by the same edges in the same order."""
    loose, tight = (
        sweep(*pulled_mass(), 60.0, _sets(200), rtol=rtol, atol=1e-3 * rtol, engine=FASTEST)
        for rtol in (1e-6, 1e-10)
    )
    for result in (loose, tight):
        assert set(result.outcome) == {"ok"}
        assert result.transition_count.min() > 40
    differ = [run for run in range(200) if loose.sequence(run) != tight.sequence(run)]
    assert differ == []
    np.testing.assert_allclose(loose.transitions["t"], tight.transitions["t"], atol=2e-3)


@pytest.mark.slow
def test_memory_grows_with_the_results_only() -> None:
    """A run's steps are not recorded: at most its firings twice, while they are assembled."""
    model, rig = pulled_mass()

    def peak(runs: int) -> tuple[int, int]:
        sets = _sets(runs)
        tracemalloc.start()
        result = sweep(model, rig, 20.0, sets, rtol=1e-9, engine=FASTEST)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        kept = ("outcome", "message", "t", "x", "v", "F", "z", "states", "transitions")
        return most, sum(getattr(result, name).nbytes for name in kept)

    peak(5)
    (few, few_rows), (many, many_rows) = peak(20), peak(200)
    steps = len(simulate(model, rig, 20.0, engine=FASTEST, rtol=1e-9))
    all_rows = 180 * steps * 8 * (2 + 6 + 4)
    allowed = 2 * (many_rows - few_rows) + 180 * 2000  # of bookkeeping, per run
    assert many - few < allowed < 0.1 * all_rows


def test_an_interrupt_waits_where_it_may_not_come() -> None:
    """In a thread nothing waits: interrupts come to the main thread only."""
    done = []

    def interrupted() -> None:
        with _interrupts_deferred():
            signal.raise_signal(signal.SIGINT)
            done.append("main thread")

    def enter() -> None:
        before = signal.getsignal(signal.SIGINT)
        with _interrupts_deferred():
            assert signal.getsignal(signal.SIGINT) is before
            done.append("thread")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert done == ["main thread", "thread"]
