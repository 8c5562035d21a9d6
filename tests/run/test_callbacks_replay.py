"""A user's own machines see the same in a replayed compiled run as when they run themselves.

`simulate(..., engine="compiled", machines=...)` fires every edge through `transitions` too: each
callback runs once per firing, in the log's order, with the values the machines engine shows, and
the machines end in the states of the last row. The run is the same to the last bit.
"""

from __future__ import annotations

from typing import Any

import pytest

from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    Element,
    ElementMachines,
    Prescribed,
    PulledSlider,
    State,
    Trace,
    Transition,
    simulate,
)
from gms_fsm.errors import ParameterError
from gms_fsm.systems.models import Model
from gms_fsm.systems.rigs import Rig
from gms_fsm.traces.failures import LivelockError
from tests.corpus import run
from tests.helpers import (
    CURVE,
    non_drifting,
    one_element,
    open_loop,
    pulled_mass,
    same_bits,
    stick_slip,
    wear,
)

pytest.importorskip("llvmlite", reason="needs the extra fast")

Call = tuple[Any, ...]

CASES: dict[str, tuple[Model, Rig, float]] = {
    "open loop": (stick_slip("signed"), open_loop(), 21.0),
    "published": (stick_slip("published"), Prescribed("0.15*sin(2*pi*t/25)"), 30.0),
    "pulled mass": (*pulled_mass(), 12.0),
    "fig. 3, slipping": (*non_drifting("signed", slipping=True), 20.0),
    "resets, open loop": (wear(), Prescribed("0.3*sin(2*pi*t/17)"), 20.0),
    "resets, closed loop": (wear(), PulledSlider(1, 2, 0.1), 20.0),
}
OPTIONS: dict[str, dict[str, Any]] = {
    "all rows": {},
    "rk4": {"method": "rk4", "step": 5.003e-3},
    "by step": {"events": "step", "max_step": 1e-2},
    "the end": {"output": "end"},
    "wanted rows": {"t_eval": [0.0, 3.0, 20.0]},
}
PLACES = ("prepare_event", "before_state_change", "after_state_change", "finalize_event")


def _watched(model: Model, kind: type[Element] = Element) -> tuple[ElementMachines, list[Call]]:
    """Return machines that record every callback at every place, and the records."""
    machines, calls = ElementMachines(model, kind), []
    variables, parameters = model.chart.variables, model.chart.parameter_names

    def note(place: str) -> Any:
        def callback(event: Any) -> None:
            e = event.model
            values = [getattr(e, name) for name in ("t", "x", "v", "s", *variables, *parameters)]
            calls.append((place, event.event.name, e.index, e.state, *values))

        return callback

    for place in PLACES:
        setattr(machines.machine, place, [note(place)])
    for state in model.chart.states:
        for kind_of in ("on_enter", "on_exit"):
            getattr(machines.machine, f"{kind_of}_{state.name}")(note(kind_of))
    return machines, calls


def _both(case: str, **options: Any) -> tuple[Trace, list[Call]]:
    """Run the machines engine and the compiled one with a replay; compare and return one run."""
    model, rig, t_end = CASES[case]
    own, wanted = _watched(model)
    replayed, calls = _watched(model)
    one = simulate(model, rig, t_end, engine=own, **options)
    other = simulate(model, rig, t_end, engine="compiled", machines=replayed, **options)
    same_bits(one, other)
    assert [e.state for e in replayed.elements] == [e.state for e in own.elements]
    assert calls == wanted
    return other, calls


PAIRS = [(case, [*OPTIONS][k % len(OPTIONS)]) for k, case in enumerate(CASES)]


@pytest.mark.slow
@pytest.mark.parametrize(("case", "options"), PAIRS)
def test_every_callback_sees_the_same_values(case: str, options: str) -> None:
    trace, calls = _both(case, **OPTIONS[options])
    log = trace.transitions
    assert len(log) > 0
    fired = [call for call in calls if call[0] == "after_state_change"]
    assert [call[1:3] for call in fired] == [(str(r.edge), int(r.element)) for r in log]
    assert [call[3] for call in fired] == log.target.tolist()
    assert [call[4] for call in fired] == log.t.tolist()
    assert len(calls) == 6 * len(log)


def test_the_values_equal_those_in_the_log() -> None:
    """v, s and z at the instant before the firing, at least for the first of a set."""
    trace, calls = _both("open loop")
    for r, call in zip(trace.transitions, [c for c in calls if c[0] == "on_exit"], strict=True):
        name, element, state, t, _, v, s, z = call[1:9]
        assert (name, element, state, t) == (r.edge, r.element, r.source, r.t)
        assert (v, s, z) == (r.v, r.s, r.z)


def test_the_second_firing_at_one_time_sees_what_the_first_assigned() -> None:
    chart = Chart(
        "chain",
        ("t",),
        ("z",),
        (),
        (State("a", {"z": "0"}), State("b", {"z": "0"}), State("c", {"z": "0"})),
        (
            Transition("one", "a", "b", "t >= 1", actions={"z": "10 * z"}),
            Transition("two", "b", "c", "z > 5"),
        ),
        {"F": "z"},
    )
    model = ChartModel(chart, {}, n=3, stribeck=CURVE)
    seen = []
    for engine in ("machines", "compiled"):
        machines, calls = _watched(model)
        simulate(
            model,
            Prescribed("0"),
            2.0,
            engine=engine,
            machines=machines,
            initial={"z": [1.0, 0.1, 2.0]},
        )
        exits = [call for call in calls if call[0] == "on_exit"]
        assert [call[1:3] for call in exits] == [
            ("one", 0),
            ("one", 1),
            ("one", 2),
            ("two", 0),
            ("two", 2),
        ]
        assert [call[8] for call in exits] == [1.0, 0.1, 2.0, 10.0, 20.0]
        assert [e.state for e in machines.elements] == ["c", "b", "c"]
        seen.append(calls)
    assert seen[0] == seen[1]


def test_more_firings_than_the_columns_hold_at_first() -> None:
    model, _ = pulled_mass()
    machines, calls = _watched(model)
    rig = Prescribed("0.3*sin(20*t)")
    trace = simulate(model, rig, 25.0, engine="compiled", machines=machines)
    assert len(trace.transitions) > 512
    assert len(calls) == 6 * len(trace.transitions)
    same_bits(trace, simulate(model, rig, 25.0, engine="compiled"))


# --------------------------------------------------------------------------- the chart decides
@pytest.mark.parametrize("error", [ZeroDivisionError, ValueError, KeyError, KeyboardInterrupt])
def test_an_error_in_a_callback_reaches_the_user_unchanged(error: type[BaseException]) -> None:
    model = stick_slip("signed")
    seen: dict[str, list[float]] = {}
    for engine in ("machines", "compiled"):
        machines = ElementMachines(model)
        times = seen[engine] = []

        def fail(event: Any, times: list[float] = times) -> None:
            times.append(event.model.t)
            if len(times) == 3:
                raise error("mine")

        machines.machine.on_enter_slip(fail)
        with pytest.raises(error, match="mine") as caught:
            simulate(model, open_loop(), 20.0, engine=engine, machines=machines)
        assert type(caught.value) is error
        trace = simulate(model, open_loop(), 20.0, engine=engine, machines=ElementMachines(model))
        assert len(trace.transitions) == 16, "the next run is not disturbed"
    assert seen["machines"] == seen["compiled"]


def test_callbacks_run_up_to_a_livelock_too() -> None:
    model, rig = run("livelock").subject
    seen = []
    for engine in ("machines", "compiled"):
        machines, calls = _watched(model)
        with pytest.raises(LivelockError) as caught:
            simulate(model, rig, 20.0, engine=engine, machines=machines)
        assert len(calls) == 6 * len(caught.value.trace.transitions) == 600
        seen.append((calls, str(caught.value), [e.state for e in machines.elements]))
    assert seen[0] == seen[1]


def test_machines_of_another_model_are_refused() -> None:
    machines = ElementMachines(one_element("signed"))
    for engine in ("machines", "compiled"):
        with pytest.raises(ParameterError, match="different model"):
            simulate(stick_slip("signed"), open_loop(), 20.0, engine=engine, machines=machines)


def test_unused_machines_are_refused() -> None:
    model = GMS(one_element("signed").parameters, law="signed")
    machines = ElementMachines(model)
    with pytest.raises(ParameterError, match=r"'ifelse' uses no machines.*leave machines"):
        simulate(model, open_loop(), 20.0, engine="ifelse", machines=machines)
    with pytest.raises(ParameterError, match="give only one of them"):
        simulate(model, open_loop(), 20.0, engine=machines, machines=machines)
