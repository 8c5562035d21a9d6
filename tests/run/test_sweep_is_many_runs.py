"""A sweep is many runs: each row is, to the last bit, what simulate() gives for its parameters.

Whatever happens to one run is the outcome in its row and ends no other; the order is that of the
parameters wherever the runs were executed; and memory does not grow with the length of the runs.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import tracemalloc
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import (
    Chart,
    ChartModel,
    LuGre,
    Prescribed,
    Slider,
    State,
    Stribeck,
    Sweep,
    Transition,
    simulate,
    sweep,
)
from gms_fsm.charts import gms_element
from gms_fsm.errors import OutputError, ParameterError, SignalError, TraceFileError
from gms_fsm.systems.models import Model, parameter_names, with_values
from gms_fsm.systems.rigs import Rig, with_numbers
from gms_fsm.traces.failures import SimulationError
from tests.helpers import non_drifting, open_loop, pulled_mass, stick_slip

ENGINES = ("compiled", "machines", "ifelse")
K = np.array([40.0, 30.0, 20.0, 10.0])
RNG = np.random.default_rng(5)
inside = sys.modules[sweep.__module__]  # the module; its name refers to the function


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    """Each engine; the compiled one only if its extra is installed."""
    if request.param == "compiled":
        pytest.importorskip("llvmlite", reason="needs the extra fast")
    return str(request.param)


def _sets(runs: int) -> dict[str, Any]:
    k = K * RNG.uniform(0.8, 1.2, (runs, 4))
    return {"k": k, "weights": 1 / (4 * k)}


RESETS = Chart(
    "resets in sweeps",
    inputs=("v", "s"),
    variables=("z", "w"),
    parameters=("k", "C", "v_c"),
    states=(
        State("stick", flow={"z": "v", "w": "0"}, entry={"z": "0.5 * z"}),
        State("slip", flow={"z": "C * (sgn(v) - z / s)", "w": "abs(v)"}, exit={"w": "w + 1"}),
    ),
    transitions=(
        Transition("tear", "stick", "slip", guard="abs(z) >= s and (v > v_c or v < -v_c)"),
        Transition("arrest", "slip", "stick", guard="abs(v) <= v_c", actions={"z": "0.8 * z"}),
    ),
    outputs={"F": "k * z + 0.1 * dz"},
)
OWN = ChartModel(
    RESETS,
    {"k": np.linspace(1, 2, 3), "C": 0.3, "v_c": 1e-6},
    n=3,
    stribeck=Stribeck(F_c=1.0, F_s=1.5, v_s=0.02),
    weights=np.linspace(0.5, 1, 3),
)
BRISTLE = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4.0, stribeck=Stribeck(1.0, 1.5, 1e-3))
CASES: dict[str, tuple[Model, Rig, float, Mapping[str, Any]]] = {
    "a bank on a pulled mass": (*pulled_mass(), 12.0, _sets(7)),
    "numbers of model and rig": (
        *pulled_mass(),
        12.0,
        {
            "F_s": [1.2, 1.5, 1.8],
            "v_s": [0.05, 0.02, 0.1],
            "sigma_2": [0.4, 0.2, 0.8],
            "mass": [1.0, 2.0, 0.5],
            "stiffness": [2.0, 1.0, 3.0],
            "speed": [0.1, 0.2, 0.05],
            "v_c": [1e-6, 1e-5, 1e-7],
            "C": [0.02, 0.05, 0.1],
        },
    ),
    "open loop": (
        stick_slip("published"),
        open_loop(),
        25.0,
        {"F_c": [0.3, 0.35, 0.2], "sigma": RNG.uniform(0.1, 0.5, (3, 4))},
    ),
    "a slider": (
        *non_drifting("signed", slipping=True),
        8.0,
        {"mass": [0.5, 1.0, 2.0], "C": [0.1, 0.2, 0.3]},
    ),
    "a chart of one's own": (
        OWN,
        Prescribed("0.3*sin(2*pi*t/17)"),
        30.0,
        {"C": [0.1, 0.3, 0.5], "k": [1.0, 2.0, 3.0]},
    ),
    "LuGre": (BRISTLE, Prescribed("1e-3*sin(3*t)"), 4.0, {"sigma_0": [1e3, 2e3], "F_s": [1.5, 2]}),
}


def _one(case: str, run: int) -> tuple[Model, Rig]:
    model, rig, _, parameters = CASES[case]
    values = {name: np.asarray(array)[run] for name, array in parameters.items()}
    return with_values(model, values), with_numbers(rig, values)


TIGHT, RK4 = {"rtol": 1e-9, "atol": 1e-12}, {"method": "rk4", "step": 9.03e-3}
PAIRS = [(case, ({}, TIGHT, RK4)[k % 3]) for k, case in enumerate(CASES)]


@pytest.mark.slow
@pytest.mark.parametrize(("case", "options"), PAIRS)
def test_each_row_is_a_run(case: str, options: dict[str, Any], engine: str) -> None:
    model, rig, t_end, parameters = CASES[case]
    times = np.linspace(0.0, t_end, 7)
    ends = sweep(model, rig, t_end, parameters, engine=engine, **options)
    rows = sweep(
        model, rig, t_end, parameters, engine=engine, output="t_eval", t_eval=times, **options
    )
    assert len(ends) == len(rows) == len(next(iter(parameters.values())))
    for run in range(len(ends)):
        one = simulate(*_one(case, run), t_end, t_eval=times, **options)
        log = one.transitions
        for result in (ends, rows):
            assert result.outcome[run] == "ok"
            assert result.message[run] == ""
            assert result.t[run] == t_end
            for name in ("x", "v", "F"):
                assert getattr(result, name)[run] == getattr(one, name)[-1], name
            np.testing.assert_array_equal(result.z[run], one.z[-1])
            np.testing.assert_array_equal(result.states[run], one.states[-1])
            mine = result.transitions[result.transitions["run"] == run]
            for name in ("t", "element", "z", "v", "s", "F_before", "F_after"):
                np.testing.assert_array_equal(mine[name], log[name], err_msg=name)
            assert [result.edges[edge] for edge in mine.edge] == log.edge.tolist()
            assert result.sequence(run) == list(
                zip(log.element.tolist(), log.edge.tolist(), strict=True)
            )
            assert result.transition_count[run] == len(log)
        for name in ("x", "v", "F", "z"):
            np.testing.assert_array_equal(rows.rows[name][run], getattr(one, name), err_msg=name)
    np.testing.assert_array_equal(rows.times, times)
    assert ends.times.size == 0
    assert not ends.rows


@pytest.mark.slow
def test_more_runs_than_a_task_holds_and_more_firings_than_a_column() -> None:
    """Buffers are reused by the next run of a task; nothing of the previous run shows."""
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    model, _ = pulled_mass()
    rig = Prescribed("0.3*sin(20*t)")
    level = np.resize([1.0, 40.0, 2.0], 200)  # hundreds of firings, then few
    result = sweep(model, rig, 10.0, {"weights": level / 4 / 40}, output="t_eval", t_eval=[0, 5, 9])
    assert (result.outcome == "ok").all()
    for run in (0, 1, 2):
        alike = np.flatnonzero(level == level[run])
        one = simulate(with_values(model, {"weights": level[run] / 4 / 40}), rig, 10.0)
        assert (result.transition_count[alike] == len(one.transitions)).all()
        for name in ("F", "x", "v"):
            assert (getattr(result, name)[alike] == getattr(one, name)[-1]).all()
        for other in alike[1:]:
            np.testing.assert_array_equal(result.rows["F"][other], result.rows["F"][run])
    counts = result.transition_count
    assert counts[0] > 400
    assert 0 <= counts[1] < counts[2] < counts[0]


# --------------------------------------------------------------------------- parameters
def test_a_charts_own_parameter_takes_precedence_over_a_shared_one() -> None:
    chart = Chart(
        "own Coulomb",
        ("v",),
        ("z",),
        ("F_c", "weights"),
        (State("slip", flow={"z": "v"}),),
        (),
        {"F": "F_c * weights * sgn(v)"},
    )
    model = ChartModel(chart, {"F_c": 2.0, "weights": 3.0}, n=2, stribeck=Stribeck(1.0, 1.5, 0.1))
    assert parameter_names(model) == ("F_c", "weights", "sigma_2", "F_s", "v_s", "delta")
    other = with_values(model, {"F_c": 5.0, "weights": 7.0, "F_s": 1.25})
    assert (other.values["F_c"], other.values["weights"]) == (5.0, 7.0)
    assert (other.stribeck.F_c, other.stribeck.F_s) == (1.0, 1.25)
    assert other.weights.tolist() == [1.0, 1.0]


def test_one_number_applies_to_all_elements() -> None:
    model, rig = pulled_mass()
    level = np.array([20.0, 30.0])
    wide = np.repeat(level[:, None], 4, axis=1)
    one, other = (
        sweep(model, rig, 6.0, {"k": k, "weights": 1 / (4 * k)}, engine="ifelse")
        for k in (level, wide)
    )
    np.testing.assert_array_equal(one.F, other.F)
    np.testing.assert_array_equal(one.transitions, other.transitions)
    assert one.parameters["k"].shape == (2,)
    assert other.parameters["k"].shape == (2, 4)


def test_an_exponent_of_two_among_others_is_a_run_like_them(engine: str) -> None:
    """It gives another text than other exponents, and so other machine code."""
    delta = np.where(np.arange(130) % 3, 1.5, 2.0)  # several runs per task
    model, rig = stick_slip("signed"), Prescribed("0.2")
    result = sweep(model, rig, 2.5, {"delta": delta}, engine=engine, progress=False)
    assert set(result.outcome) == {"ok"}
    for value in (1.5, 2.0):
        alone = simulate(with_values(model, {"delta": value}), rig, 2.5, engine=engine)
        assert set(result.F[delta == value]) == {alone.F[-1]}


def test_the_parameters_given_are_not_changed_and_are_kept() -> None:
    model, rig = pulled_mass()
    k = K * np.ones((3, 4))
    given = k.copy()
    result = sweep(model, rig, 2.0, {"k": k, "F_s": [1, 2, 3]}, engine="ifelse")
    k[:] = -1.0
    np.testing.assert_array_equal(result.parameters["k"], given)
    assert result.parameters["F_s"].dtype == np.float64


def test_a_dataframe_has_columns_of_elements() -> None:
    pandas = pytest.importorskip("pandas", reason="needs the extra pandas")
    model, rig = pulled_mass()
    sets = _sets(3) | {"F_s": np.array([1.4, 1.5, 1.6])}
    columns = {f"{name}{i + 1}": sets[name][:, i] for i in range(4) for name in ("k", "weights")}
    frame = pandas.DataFrame(columns | {"F_s": sets["F_s"]}, index=[7, 7, 9])
    one = sweep(model, rig, 6.0, frame, engine="ifelse")
    other = sweep(model, rig, 6.0, sets, engine="ifelse")
    np.testing.assert_array_equal(one.F, other.F)
    np.testing.assert_array_equal(one.transitions, other.transitions)
    for name, values in other.parameters.items():
        np.testing.assert_array_equal(one.parameters[name], values)
    again = sweep(model, rig, 6.0, one.to_dataframe()[frame.columns], engine="ifelse")
    np.testing.assert_array_equal(again.F, one.F)
    with pytest.raises(ParameterError, match=r"'k' for some elements, but not k3"):
        sweep(model, rig, 6.0, frame.drop(columns="k3"), engine="ifelse")
    with pytest.raises(ParameterError, match=r"'k5'; did you mean 'k'"):
        sweep(model, rig, 6.0, frame.assign(k5=1.0), engine="ifelse")


REFUSED: dict[str, tuple[Mapping[str, Any], tuple[str, ...]]] = {
    "unknown": ({"q": [1, 2]}, ("'q'", "there are k, sigma, C, v_c, weights", "stiffness")),
    "the rig's of another kind": ({"F_a": [1, 2]}, ("'F_a'", "speed")),
    "a misspelling": ({"f_c": [1, 2]}, ("'f_c'", "F_c")),
    "empty": ({}, ("parameters is empty",)),
    "no runs": ({"F_s": []}, ("at least one", "F_s: 0")),
    "no runs, wide": ({"k": np.empty((0, 4))}, ("at least one", "k: 0")),
    "different lengths": ({"F_s": [1, 2], "k": np.ones((3, 4))}, ("F_s: 2", "k: 3")),
    "a number": ({"F_s": 1.5}, ("'F_s'", "shape ()", "(runs,)")),
    "a number, wide": ({"k": 1.5}, ("'k'", "shape ()", "(runs, 4)")),
    "too many elements": ({"k": np.ones((2, 5))}, ("'k'", "(2, 5)", "(runs, 4)")),
    "too deep": ({"k": np.ones((2, 4, 1))}, ("'k'", "(2, 4, 1)")),
    "wide where one is meant": ({"F_s": np.ones((2, 4))}, ("'F_s'", "(2, 4)", "(runs,)")),
    "v_c is one number": ({"v_c": np.ones((2, 4))}, ("'v_c'", "(2, 4)", "(runs,)")),
    "text": ({"F_s": ["much", "more"]}, ("'F_s'", "numbers")),
    "ragged": ({"k": [[1, 2], [1]]}, ("'k'", "numbers")),
    "None": ({"F_s": None}, ("'F_s'",)),
}


@pytest.mark.parametrize("case", REFUSED)
def test_wrong_names_and_shapes_are_refused_before_anything_runs(case: str) -> None:
    parameters, words = REFUSED[case]
    with pytest.raises(ParameterError) as caught:
        sweep(*pulled_mass(), 1.0, parameters, engine="machines")
    for word in words:
        assert word in str(caught.value)


def test_lugre_has_no_weights() -> None:
    with pytest.raises(ParameterError, match=r"'weights'; there are sigma_0, sigma_1"):
        sweep(BRISTLE, Prescribed("0.1"), 1.0, {"weights": [1.0]}, engine="machines")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"output": "all"}, "output is 'all'; use 'end' or 't_eval'"),
        ({"output": "t_eval"}, "needs t_eval="),
        ({"t_eval": [0.5], "output": "end"}, "output is 'end', but t_eval"),
        ({"t_evil": [0.5]}, "did you mean 't_eval'?"),
        ({"engine": "turbo"}, "engine is 'turbo'"),
        ({"rtol": -1}, "rtol is -1"),
        ({"method": "rk4"}, "give step="),
        ({"initial": {"q": 1}}, "'q'"),
    ],
)
def test_errors_common_to_all_runs_are_raised_once(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        sweep(*pulled_mass(), 1.0, {"F_s": [1.5]}, **({"engine": "machines"} | options))
    assert words in str(caught.value)


# --------------------------------------------------------------------------- failures
def _fragile() -> ChartModel:
    """Livelocks if v_c is above the speed; its flow is infinite if k is 1."""
    sound = gms_element("signed")
    chart = Chart(
        "fragile",
        sound.inputs,
        sound.variables,
        sound.parameters,
        (State("stick", {"z": "v + 0 / (k - 1)"}), State("slip", {"z": "0 * v"})),
        (
            Transition("break_away", "stick", "slip", guard="abs(z) >= s and abs(v) <= v_c"),
            Transition("arrest", "slip", "stick", guard="abs(v) <= v_c and abs(z) < 10 * s"),
        ),
        sound.outputs,
    )
    values = {"k": 2.0, "sigma": 0.1, "C": 0.1, "v_c": 0.01}
    return ChartModel(chart, values, n=2, stribeck=Stribeck(1.0, 1.5, 1e-3), weights=[2, 1])


def test_a_failed_run_is_a_row_and_does_not_end_the_others(engine: str) -> None:
    good = {"F_c": 1.0, "v_c": 0.01, "k": 2.0}
    wrong: list[dict[str, float]] = [
        {},
        {"F_c": -1.0},
        {},
        {"v_c": 0.2},
        {},
        {"k": 1.0},
        {},
        {"F_c": 9.0},
        {"k": np.nan},
        {},
        {"k": np.inf},
    ]
    parameters = {name: [(good | u)[name] for u in wrong] for name in good}
    model, rig, times = _fragile(), Prescribed("0.15"), [0.0, 5.0, 8.0, 12.0]
    result = sweep(model, rig, 12.0, parameters, engine=engine, output="t_eval", t_eval=times)
    assert result.outcome.tolist() == [
        "ok",
        "ParameterError",
        "ok",
        "LivelockError",
        "ok",
        "NotFiniteError",
        "ok",
        "ParameterError",
        "ParameterError",
        "ok",
        "ParameterError",
    ]
    words = {
        1: "F_c is -1.0",
        3: "element 2 at t = 6.66",
        5: "not finite",
        7: "F_s is 1.5, F_c is 9.0",
        8: "k is nan",
        10: "k is inf",
    }
    for run, text in enumerate(result.message):
        assert words.get(run, "") in text
        assert (text == "") == (run not in words)
    ok = result.outcome == "ok"
    for name in ("t", "x", "v", "F", "z"):
        values = getattr(result, name)
        assert np.isfinite(values[ok]).all()
        np.testing.assert_array_equal(values[ok], np.resize(values[0], values[ok].shape))
        assert np.isnan(values[result.outcome == "ParameterError"]).all()
    assert result.t[3] == pytest.approx(1 / 0.15)
    assert result.t[5] == 0.0
    assert result.transition_count.tolist() == [0, 0, 0, 100, 0, 0, 0, 0, 0, 0, 0]
    assert result.states[3].tolist() == ["stick", "stick"]
    assert result.states[1].tolist() == ["", ""]
    np.testing.assert_array_equal(np.isnan(result.rows["F"][3]), [False, False, True, True])
    assert np.isnan(result.rows["F"][5]).all()
    assert repr(result) == "<Sweep: 11 runs over F_c, v_c, k; 6 failed, 100 transitions>"


def test_a_run_that_fails_between_steps_reports_where(engine: str) -> None:
    rig = Slider(1.0, "0.1*sqrt(3 - t)")
    result = sweep(stick_slip("signed"), rig, 10.0, {"mass": [1.0, 2.0]}, engine=engine)
    assert result.outcome.tolist() == ["NotFiniteError"] * 2
    assert all("t = 2.99" in text or "t = 3.0" in text for text in result.message)
    assert result.t == pytest.approx(3.0, abs=1e-6)
    for run, mass in enumerate((1.0, 2.0)):
        with pytest.raises(SimulationError) as caught:
            simulate(stick_slip("signed"), Slider(mass, rig.force), 10.0)
        assert result.F[run] == caught.value.trace.F[-1]


def test_a_record_that_ends_ends_every_run() -> None:
    record = np.linspace(0, 5, 51), 0.2 * np.sin(np.linspace(0, 5, 51))
    result = sweep(
        stick_slip("signed"), Prescribed(record), 9.0, {"C": [0.1, 0.2]}, engine="ifelse"
    )
    assert result.outcome.tolist() == ["SignalEndError"] * 2
    assert result.t.tolist() == [5.0, 5.0]
    with pytest.raises(SignalError, match="starts at 7"):
        sweep(
            stick_slip("signed"),
            Prescribed(record),
            9.0,
            {"C": [0.1]},
            t_start=7.0,
            engine="ifelse",
        )


# --------------------------------------------------------------------------- executors
def _same(one: Sweep, other: Sweep) -> None:
    for name in ("outcome", "message", "t", "x", "v", "F", "z", "states", "times"):
        a, b = getattr(one, name), getattr(other, name)
        assert a.dtype == b.dtype, name
        np.testing.assert_array_equal(a, b, err_msg=name)
    assert one.transitions.dtype == other.transitions.dtype
    np.testing.assert_array_equal(one.transitions, other.transitions)
    assert one.edges == other.edges
    for mine, theirs in ((one.parameters, other.parameters), (one.rows, other.rows)):
        assert list(mine) == list(theirs)
        for name, values in mine.items():
            np.testing.assert_array_equal(values, theirs[name], err_msg=name)


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


def test_the_order_is_that_of_the_parameters_wherever_they_ran() -> None:
    model, rig = pulled_mass()
    sets = _sets(10) | {"mass": [1.0] * 9 + [-1.0]}
    options: dict[str, Any] = {"engine": "ifelse", "output": "t_eval", "t_eval": [0.0, 2.0, 5.0]}
    usual = sweep(model, rig, 5.0, sets, **options)
    assert usual.outcome.tolist() == ["ok"] * 9 + ["ParameterError"]
    _same(sweep(model, rig, 5.0, sets, executor=Backwards(), **options), usual)
    with ThreadPoolExecutor(1) as threads:
        _same(sweep(model, rig, 5.0, sets, executor=threads, **options), usual)
        assert threads.submit(abs, -1).result() == 1, "it is the user's: it is not shut down"


def _pool(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn"))


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
    model, rig = pulled_mass()
    sets = _sets(8)
    usual = sweep(model, rig, 3.0, sets, engine="machines")
    with _pool(1) as pool:
        _same(sweep(model, rig, 3.0, sets, executor=pool, engine="machines"), usual)
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


def test_a_run_that_cannot_be_sent_to_a_process_is_a_row_that_says_so() -> None:
    with _pool(1) as pool:
        result = sweep(
            stick_slip("signed"),
            Prescribed(lambda t: 0.1),
            1.0,
            {"C": [0.1, 0.2]},
            executor=pool,
            engine="machines",
        )
    assert len(set(result.outcome)) == 1
    for text in result.message:
        assert "the worker failed" in text
        assert "executor=None" in text


# --------------------------------------------------------------------------- Ctrl-C
def _interrupting(after: int) -> Any:
    """Return a progress display that raises Ctrl-C."""

    @contextmanager
    def bar(runs: int, progress: bool | None) -> Iterator[Callable[[int], None]]:
        done = [0]

        def shown(count: int) -> None:
            done[0] += count
            if done[0] >= after:
                raise KeyboardInterrupt

        yield shown

    return bar


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
        monkeypatch.setattr(inside, "_bar", _interrupting(2))
    before = set(threading.enumerate())
    with pytest.raises(KeyboardInterrupt):
        sweep(*pulled_mass(), 10.0, _sets(60), engine="ifelse")
    assert set(threading.enumerate()) <= before
    count = len(begun)
    assert 2 <= count < 40, "pending tasks are not started"
    assert len(begun) == count


def test_progress_is_shown_on_request(capsys: pytest.CaptureFixture[str]) -> None:
    sets = {"F_s": np.linspace(1, 2, 6)}
    sweep(*pulled_mass(), 1.0, sets, engine="ifelse", progress=True)
    assert "6/6" in capsys.readouterr().err
    for progress in (False, None):
        sweep(*pulled_mass(), 1.0, sets, engine="ifelse", progress=progress)
        said = capsys.readouterr()
        assert said.out + said.err == ""


# --------------------------------------------------------------------------- tables and files
@pytest.fixture(scope="module")
def mixed() -> Sweep:
    """Return two runs that end and one that cannot start; rows, wide and narrow parameters."""
    return sweep(
        *pulled_mass(),
        8.0,
        _sets(3) | {"F_c": [1.0, 0.9, -1.0]},
        engine="ifelse",
        output="t_eval",
        t_eval=[0.0, 3.0, 8.0],
    )


def test_a_dataframe_has_one_row_per_run(mixed: Sweep) -> None:
    pytest.importorskip("pandas", reason="needs the extra pandas")
    frame = mixed.to_dataframe()
    assert frame.index.name == "run"
    assert len(frame) == 3
    assert [c for c in frame.columns if c[0] in "kw"] == [
        f"{name}{i}" for name in ("k", "weights") for i in (1, 2, 3, 4)
    ]
    for i in range(4):
        np.testing.assert_array_equal(frame[f"z{i + 1}"], mixed.z[:, i])
        assert frame[f"state{i + 1}"].tolist() == mixed.states[:, i].tolist()
        np.testing.assert_array_equal(frame[f"k{i + 1}"], mixed.parameters["k"][:, i])
    for name in ("t", "x", "v", "F"):
        np.testing.assert_array_equal(frame[name], getattr(mixed, name))
    assert frame["outcome"].tolist() == ["ok", "ok", "ParameterError"]
    assert frame["message"][2].startswith("F_c is -1.0")
    assert frame["transitions"].tolist() == mixed.transition_count.tolist()


def test_a_dataset_has_dimensions_and_units(mixed: Sweep) -> None:
    pytest.importorskip("xarray", reason="needs the extra sweep")
    data = mixed.to_xarray()
    assert dict(data.sizes) == {"run": 3, "element": 4, "time": 3}
    assert data["element"].values.tolist() == [1, 2, 3, 4]
    units = {"x": "m", "v": "m/s", "F": "N", "z": "m"}
    for name, unit in units.items():
        assert data[name].attrs["units"] == data[f"{name}_end"].attrs["units"] == unit
        assert data[name].dims == ("run", "time", "element")[: data[name].ndim]
        np.testing.assert_array_equal(data[name], mixed.rows[name])
        np.testing.assert_array_equal(data[f"{name}_end"], getattr(mixed, name))
    assert data["t_end"].attrs["units"] == "s"
    assert data["z_end"].dims == ("run", "element")
    assert data["k"].dims == ("run", "element")
    assert data["F_c"].dims == ("run",)
    assert data["outcome"].values.tolist() == ["ok", "ok", "ParameterError"]
    np.testing.assert_array_equal(data["transitions"], mixed.transition_count)
    assert float(data["z"].sel(time=3.0, element=2)[0]) == mixed.rows["z"][0, 1, 1]
    bare = sweep(BRISTLE, Prescribed("0.1"), 1.0, {"F_s": [1.5]}, engine="ifelse").to_xarray()
    assert "time" not in bare.sizes
    assert "F" not in bare


def test_parameters_with_names_of_results_are_kept_separate() -> None:
    names = ("transitions", "outcome", "time", "run", "element", "z1", "state1", "x_end")
    chart = Chart(
        "names",
        ("v",),
        ("z",),
        names,
        (State("on", {"z": "v * (" + " + ".join(names) + ")"}),),
        (),
        {"F": "z"},
    )
    model = ChartModel(chart, dict.fromkeys(names, 1.0), n=1, stribeck=Stribeck(1, 2, 0.1))
    values = {name: [float(i), 7.0] for i, name in enumerate(names)}
    result = sweep(
        model, Prescribed("1"), 1.0, values, engine="ifelse", output="t_eval", t_eval=[0.5]
    )
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


def test_a_saved_sweep_reads_back_equal(mixed: Sweep, tmp_path: Path) -> None:
    path = mixed.save(tmp_path / "sweep.npz")
    assert path == tmp_path / "sweep.npz"
    back = Sweep.load(path)
    _same(back, mixed)
    assert back.sequence(0) == mixed.sequence(0) != []
    assert repr(back) == repr(mixed)
    bare = sweep(BRISTLE, Prescribed("0.1"), 1.0, {"F_s": [1.5]}, engine="ifelse")
    _same(Sweep.load(bare.save(str(tmp_path / "bare.npz"))), bare)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bare.npz", "sweep.npz"]


def test_parquet_reads_back_with_pandas(mixed: Sweep, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas", reason="needs the extra sweep")
    pytest.importorskip("pyarrow", reason="needs the extra sweep")
    path = mixed.save(tmp_path / "sweep.parquet")
    pandas.testing.assert_frame_equal(pandas.read_parquet(path), mixed.to_dataframe())
    log = pandas.read_parquet(tmp_path / "sweep.transitions.parquet")
    assert list(log.columns) == list(mixed.transitions.dtype.names)
    for name in log.columns:
        wanted = mixed.transitions[name]
        if name == "edge":
            assert log[name].tolist() == [mixed.edges[edge] for edge in wanted]
        else:
            np.testing.assert_array_equal(log[name], wanted)
    bare = sweep(BRISTLE, Prescribed("0.1"), 1.0, {"F_s": [1.5]}, engine="ifelse")
    bare.save(tmp_path / "bare.parquet")
    assert len(pandas.read_parquet(tmp_path / "bare.transitions.parquet")) == 0


def test_files_that_cannot_be_written_or_read_say_so(mixed: Sweep, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"saved as .npz or .parquet, not '.csv'"):
        mixed.save(tmp_path / "sweep.csv")
    with pytest.raises(OutputError, match="cannot write"):
        mixed.save(tmp_path / "nowhere" / "sweep.npz")
    with pytest.raises(TraceFileError, match="there is no such file"):
        Sweep.load(tmp_path / "none.npz")
    whole = mixed.save(tmp_path / "whole.npz").read_bytes()
    for name, content in (("half", whole[: len(whole) // 2]), ("empty", b""), ("text", b"hello")):
        damaged = tmp_path / f"{name}.npz"
        damaged.write_bytes(content)
        with pytest.raises(TraceFileError, match="not a sweep, or damaged"):
            Sweep.load(damaged)
    trace = simulate(*pulled_mass(), 1.0).save(tmp_path / "trace.npz")
    with pytest.raises(TraceFileError, match="not a sweep"):
        Sweep.load(trace)


# --------------------------------------------------------------------------- many
@pytest.mark.slow
def test_no_sequence_of_two_hundred_depends_on_the_tolerance() -> None:
    """About 72 transitions each: the same elements by the same edges in the same order."""
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    k = K * np.random.default_rng(0).uniform(0.8, 1.2, (200, 4))
    loose, tight = (
        sweep(*pulled_mass(), 60.0, {"k": k, "weights": 1 / (4 * k)}, rtol=rtol, atol=1e-3 * rtol)
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
    pytest.importorskip("llvmlite", reason="needs the extra fast")
    model, rig = pulled_mass()

    def peak(runs: int) -> tuple[int, int]:
        sets = _sets(runs)
        tracemalloc.start()
        result = sweep(model, rig, 20.0, sets, rtol=1e-9)
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        kept = ("outcome", "message", "t", "x", "v", "F", "z", "states", "transitions")
        return most, sum(getattr(result, name).nbytes for name in kept)

    peak(5)
    (few, few_rows), (many, many_rows) = peak(50), peak(500)
    steps = len(simulate(model, rig, 20.0, engine="compiled", rtol=1e-9))
    all_rows = 450 * steps * 8 * (2 + 6 + 4)
    allowed = 2 * (many_rows - few_rows) + 450 * 2000  # of bookkeeping, per run
    assert many - few < allowed < 0.1 * all_rows
