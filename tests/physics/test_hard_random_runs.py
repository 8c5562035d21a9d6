"""Random charts, parameters, signals and steps satisfy the invariants of every run.

Time does not go backward; rows and log agree; no guard is overdue; the signed law is mirror
symmetric; the engines agree to the bit; and a run that cannot continue raises a `GMSError` that has
the part before. GMS_FSM_EXAMPLES requests more examples, drawn at random, as tests/soak does.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, event, given, settings
from hypothesis import strategies as st

from gms_fsm import GMS, ChartModel, Prescribed, PulledSlider, Slider, Trace, simulate
from gms_fsm.errors import GMSError
from gms_fsm.session.explain import explain, explain_state, values_at
from gms_fsm.traces.failures import SimulationError
from tests.corpus import ENGINES, Run
from tests.helpers import FASTEST, other_parts
from tests.laws.test_mirrored_runs import assert_mirrored, mirror_of
from tests.strategies import banks, chart_models, options, ramps, rigs, rounded

pytestmark = pytest.mark.slow

EXAMPLES = int(os.environ.get("GMS_FSM_EXAMPLES", "0"))


def hard(examples: int, most: int = 10**9) -> Any:
    """Return settings: fixed examples, or GMS_FSM_EXAMPLES new ones, but not more than `most`."""
    return settings(
        max_examples=min(EXAMPLES, most) or examples,
        derandomize=not EXAMPLES,
        database=None,
        print_blob=True,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
    )


# --------------------------------------------------------------------------- invariants of any run
def a_message(error: GMSError) -> None:
    """Assert that an error has a text of a few lines."""
    assert 0 < len(str(error).strip()) < 2000


def attempt(model: Any, rig: Any, t_end: float, **given: Any) -> tuple[Trace, str]:
    """Run; return the trace, even of a run that stops, and how it ended."""
    try:
        # Some of these charts chatter, fast but above every tolerance.
        return simulate(model, rig, t_end, max_steps=30_000, **given), "end"
    except SimulationError as error:
        failure = error
    a_message(failure)
    return failure.trace, type(failure).__name__


def onto_or_off_a_surface(trace: Trace) -> Any:
    """Return the rows at which sliding begins or ends: at the micro-step of the previous row."""
    changes = (np.diff(trace.rows.mode[:, trace.n :], axis=0) != 0).any(axis=1)
    return np.concatenate([[False], changes])


def rows_and_log_agree(trace: Trace) -> None:
    """Every firing has its row, and between firings no state changes."""
    t, microstep, states, log = trace.t, trace.microstep, trace.states, trace.transitions
    assert np.isfinite(trace.rows.y).all()
    assert (np.diff(t) >= 0).all()
    assert microstep[0] == 0
    slid = onto_or_off_a_surface(trace)
    assert (np.diff(t)[slid[1:]] == 0.0).all()
    fired = np.flatnonzero((microstep > 0) & ~slid)
    assert len(fired) == len(log)
    chart_edges = {e.name: e for e in trace.model.chart.transitions}
    for row, record in zip(fired.tolist(), log, strict=True):
        i, edge = int(record.element), chart_edges[str(record.edge)]
        assert record.t == t[row] == t[row - 1]
        assert microstep[row] == microstep[row - 1] + 1
        assert (record.source, record.target) == (edge.source, edge.target)
        assert (states[row - 1, i], states[row, i]) == (edge.source, edge.target)
        others = np.arange(trace.n) != i
        assert (states[row, others] == states[row - 1, others]).all()
        assert (trace.z[row, others] == trace.z[row - 1, others]).all()
        assert record.z == trace.z[row - 1, i]
        assert record.v == trace.v[row - 1]
        assert record.s == trace.s[row - 1, i]
        assert record.F_before == trace.F[row - 1]
        assert record.F_after == trace.F[row]
    quiet = np.flatnonzero((microstep[1:] == 0) & ~slid[1:]) + 1
    assert (states[quiet] == states[quiet - 1]).all()
    assert (trace.rows.y[quiet] == trace.rows.y[quiet - 1])[t[quiet] == t[quiet - 1]].all()


def guards_say_so(trace: Trace) -> None:
    """A firing's guard was true, and no guard with higher priority in its state was."""
    for row in np.flatnonzero((trace.microstep > 0) & ~onto_or_off_a_surface(trace)).tolist():
        i = int(np.flatnonzero(trace.modes[row] != trace.modes[row - 1])[0])
        edges = explain(trace, row, i)
        taken = [edge.fired for edge in edges].index(True)
        assert edges[taken].holds
        assert not any(edge.holds for edge in edges[:taken])


def nothing_is_overdue(trace: Trace) -> None:
    """Where the run continued, no edge was enabled."""
    last_at_a_time = np.flatnonzero(np.diff(trace.t) > 0)
    for row in last_at_a_time.tolist():
        for i in range(trace.n):
            # The state that the element is in, not the one it has left.
            state = trace.model.chart.states[int(trace.rows.mode[row, i])].name
            asked = explain_state(trace.model.chart, state, values_at(trace, row, i))
            due = [edge.edge.name for edge in asked if edge.holds]
            assert due == [], f"row {row}, t = {trace.t[row]!r}, element {i} in {state}: {due}"


def lawful(trace: Trace, end: str, t_end: float, located: bool) -> None:
    """Assert all invariants of a run."""
    rows_and_log_agree(trace)
    guards_say_so(trace)
    if located:
        nothing_is_overdue(trace)
    fired(trace)
    assert trace.t[0] == 0.0
    assert trace.t[-1] <= t_end
    if end == "end":
        assert trace.t[-1] == t_end
    event(end)


def fired(trace: Trace) -> None:
    """Report the number of transitions to the statistics."""
    count = len(trace.transitions)
    event(f"transitions: {count if count < 3 else '3 or more' if count < 10 else '10 or more'}")


@hard(50)
@given(chart_models() | banks(), rigs(), options(), rounded(1, 6))
def test_the_invariants_hold(model: Any, rig: Any, given: dict[str, Any], t_end: float) -> None:
    trace, end = attempt(model, rig, t_end, **given)
    lawful(trace, end, t_end, given.get("events") != "step")


# --------------------------------------------------------------------------- engines
def engines_agree(model: Any, rig: Any, given: dict[str, Any], engines: tuple[str, ...]) -> None:
    one, end = attempt(model, rig, 3.0, **given)
    for engine in engines:
        other, end_too = attempt(model, rig, 3.0, **given, engine=engine)
        assert end == end_too
        assert other_parts(one, other) == []
    fired(one)


@hard(15)
@given(chart_models(), rigs(), options())
def test_engines_agree_on_random_charts(model: ChartModel, rig: Any, given: dict[str, Any]) -> None:
    engines_agree(model, rig, given, ("ifelse",))


@hard(5)
@given(banks(), ramps(jumps=True), options(), st.booleans())
def test_engines_agree_on_random_banks(
    model: GMS, corners: Any, given: dict[str, Any], pushed: bool
) -> None:
    """Ramps and parameters are arguments of the machine code: compiled only twice per law."""
    rig = Slider(1.0, corners) if pushed else Prescribed(corners)
    engines_agree(model, rig, given, ENGINES)


@hard(2, most=20)  # each is compiled, which takes seconds
@given(chart_models(), ramps(), options())
def test_machine_code_agrees_on_random_charts(
    model: ChartModel, corners: Any, given: dict[str, Any]
) -> None:
    engines_agree(model, Prescribed(corners), given, (FASTEST,))


# --------------------------------------------------------------------------- symmetry
@hard(20)
@given(banks("signed"), ramps(jumps=True), options(), st.integers(0, 2))
def test_under_the_signed_law_the_mirrored_signal_gives_the_mirrored_run(
    model: GMS, corners: Any, given: dict[str, Any], kind: int
) -> None:
    """For every method and step."""
    rigs = (Prescribed(corners), Slider(0.1, corners), PulledSlider(1.0, 2.0, corners[0][1]))
    one = Run((model, rigs[kind]), 3.0, {**given, "max_steps": 30_000})
    (a, said), (b, too) = one.outcome(), mirror_of(one).outcome()
    assert said.partition(":")[0] == too.partition(":")[0]
    assert a is not None
    assert b is not None
    assert_mirrored(a, b)
    fired(a)


# --------------------------------------------------------------------------- wrong arguments
ARGUMENTS = (
    "method", "step", "rtol", "atol", "max_step", "events", "engine", "t_eval", "initial", "output",
    "t_start",
)  # fmt: skip


@hard(35)
@given(
    chart_models() | banks(),
    rigs(),
    st.dictionaries(
        st.sampled_from(ARGUMENTS),
        st.none()
        | st.floats()
        | st.integers(-3, 10**400)
        | st.text(max_size=4)
        | st.lists(st.floats(), max_size=4)
        | st.dictionaries(st.sampled_from(["z", "v", "x", "states", "u"]), st.floats(), max_size=2),
        min_size=1,
        max_size=2,
    ),
    st.floats() | st.just(0.3),
)
def test_meaningless_arguments_are_refused_with_an_explanation(
    model: Any, rig: Any, nonsense: dict[str, Any], t_end: float
) -> None:
    """Whatever the argument: it runs, or a `GMSError` says what is wrong."""
    steps = [u for u in (nonsense.get("step"), nonsense.get("max_step")) if isinstance(u, float)]
    assume(not any(0 < u < 1e-3 for u in steps))  # a fine grid is not wrong, only slow
    assume(
        not any(
            isinstance(nonsense.get(u), float) and 0 < nonsense[u] < 1e-10 for u in ("rtol", "atol")
        )
    )
    t_end = t_end if not 1 < t_end < 1e9 else 1.0
    try:
        simulate(model, rig, t_end, max_steps=20_000, **nonsense)
    except GMSError as error:
        a_message(error)
