"""A run says where its result may be another one, and what was probably not meant."""

import pickle
import random
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import RK45

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    Prescribed,
    PulledSlider,
    Sampled,
    Session,
    Slider,
    State,
    Stribeck,
    Supervisor,
    System,
    Transition,
    simulate,
)
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts.registry import registered
from gms_fsm.traces.failures import NotFiniteError
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import KINDS
from tests.corpus import ENGINES
from tests.helpers import ROOT, open_loop, pulled_mass, stick_slip
from tests.soak.doubts import PLANTED, TOUCH, clean, extreme, fault_of, grazing, tie


def bank(k: float = 1.0, v_c: float = 1e-6) -> GMS:
    """Return two elements with thresholds of a few micrometres at k = 1."""
    p = GMSParameters.from_shares(
        [0.5, 0.5], [k * 4e5, k * 2e5], C=20.0, v_c=v_c, stribeck=Stribeck(2.0, 2.4, 1e-3)
    )
    return GMS(p, law="signed")


def notes_on(trace: Trace) -> tuple[str, ...]:
    meant = ("units", "unused", "window")
    return tuple(each.text for each in trace.trust() if each.kind in meant)


def notes(model: GMS, velocity: object, t_end: float = 10.0, **options: object) -> tuple[str, ...]:
    return notes_on(simulate(model, Prescribed(velocity), t_end, **options))  # type: ignore[arg-type]


def test_a_motion_that_fits_has_none():
    assert notes(bank(), "1e-5*sin(t)") == ()
    model, rig = pulled_mass()
    assert notes_on(simulate(model, rig, 20.0)) == ()
    assert notes_on(simulate(stick_slip("signed"), open_loop(), 20.0)) == ()
    assert notes_on(simulate(stick_slip("signed"), Prescribed("0.1"), 1.0)) == ()


@pytest.mark.parametrize(
    ("model", "velocity", "said"),
    [
        (
            bank(),
            "0.5*cos(t)",
            "the stroke of 1 m is 1.7e\\+05 times the largest threshold.*unit of the motion",
        ),
        (
            bank(v_c=1e-2),
            [(0.0, 0.0), (2.0, 1e-3), (4.0, -1e-3), (5.0, 0.0)],
            r"no transition: the speed stays below v_c \(largest .v. 1 mm/s, v_c",
        ),
        (  # the thresholds are millimetres, and a stroke of micrometres does not come near them
            bank(k=1e-3),
            "4e-6*sin(t)",
            r"no transition: no element comes near its threshold.*units of k \(N/m\)",
        ),
        (
            bank(),
            [(0.0, 1e-5), (5.0, 1e-5), (5.0, -1e-5), (10.0, -1e-5)],
            "arrest could not be detected .*first at t = 5 s",
        ),
    ],
)
def test_scales_that_do_not_fit(model, velocity, said):
    (note,) = notes(model, velocity)
    assert re.match(said, note)


@pytest.mark.parametrize(
    ("mass", "said"),
    [(250.0, "if the mass is in g, give 0.25"), (1e-3, "if F is in mN, give N"), (1.0, "")],
)
def test_a_mass_in_grams_or_a_force_in_millinewtons(mass: float, said: str):
    found = notes_on(simulate(pulled_mass()[0], PulledSlider(mass, 2.0, 0.1), 0.1))
    assert bool(said) == any(note.endswith(said) for note in found if "weight of" in note)


def test_weights_that_nobody_gave_are_named():
    curve = Stribeck(2.0, 2.4, 1e-3)
    p = GMSParameters([4e5, 2e5], [0, 0], [1e-3, 1e-3], sigma_2=0.0, v_c=1e-6, stribeck=curve)
    (note,) = notes(GMS(p, law="signed"), "1e-4*sin(t)")
    assert "all weights are 1 m/N" in note
    assert "give shares of the friction" in note


def test_an_event_that_nothing_emits_is_named_unless_it_came() -> None:
    lamp = Chart(
        "lamp",
        inputs=(),
        velocities=(),
        states=(State("off"), State("on")),
        transitions=(Transition("lights", "off", "on", event="dusk"),),
    )
    system = System("house", supervisors=(Supervisor("lamp", lamp),), flow={"T": "1"})
    (note,) = simulate(system, 1.0).trust().of("unused")
    assert "nothing emits the event dusk, for which lights of lamp waits" in note.text
    session = Session(system, 1.0)
    session.goto(0.5)
    session.poke({"dusk": 1})
    assert session.tree.trace(1).trust().of("unused") == ()


@pytest.mark.parametrize(
    ("force", "spare", "said"),
    [
        ("u", "0.1", []),
        ("0", "0.1", ["nothing reads u of pid"]),
        ("e", "u", []),
        ("u", "0", ["nothing acts on body spare"]),
        ("e", 0.0, ["nothing reads u of pid", "nothing acts on body spare"]),
    ],
)
def test_a_controller_or_a_body_that_is_connected_to_nothing(
    force: str, spare: str | float, said: list[str]
):
    bodies = (
        Body("load", inertia=1.0, force=force, x="x_l", v="v_l"),
        Body("spare", inertia=1.0, force=spare, x="x_s", v="v_s"),
    )
    pid = Sampled("pid", period=0.1, updates={"e": "-x_l", "u": "u + e"})
    pad = Contact("pad", bank(), v="v_l")
    run = simulate(System("servo", bodies=bodies, contacts=(pad,), sampled=(pid,)), 0.1)
    found = [each.text for each in run.trust().of("unused")]
    assert [note[: len(start)] for note, start in zip(found, said, strict=True)] == said


@pytest.mark.parametrize("output", [{}, {"t_eval": np.linspace(0.0, 10.0, 11)}])
def test_arrests_within_a_tick_of_the_clock(output):
    """v_c / |dv/dt| is below the clock resolution: the window is passed within one tick."""
    (note,) = notes(bank(v_c=1e-22), "1e-5*sin(t)", **output)
    assert note.startswith("arrest could not be detected ")
    assert "first at t = 3.14159" in note


def test_a_run_that_resolves_them_has_no_such_note():
    ramp = [(0.0, 1e-5), (5.0, 1e-5), (5.1, -1e-5), (10.0, -1e-5)]
    assert notes(bank(), ramp) == ()


@pytest.mark.slow
def test_the_command_line_prints_them_and_the_summary_shows_them(gms_fsm):
    path = ROOT / "gms_fsm/scenarios" / "pulled_mass.toml"
    sets = ("model.v_c=10.0", "run.t_end=2.0", "output.figures=[]")
    done = gms_fsm("run", path, "-o", "out", *(word for each in sets for word in ("--set", each)))
    assert done.code == 0
    note = "note, units: no transition: the speed stays below v_c"
    assert note in done.out
    assert f"- {note}" in Path("out/summary.md").read_text()


@pytest.mark.parametrize("how", [{}, {"method": "rk4", "step": 0.1, "events": "step"}])
def test_windows_that_depend_on_the_state_or_on_steps_are_not_searched(how: dict[str, object]):
    chart = Chart(
        "window",
        inputs=("v",),
        variables=("z",),
        states=(State("on", {"z": "v"}), State("off", {"z": "0"})),
        transitions=(Transition("rest", "on", "off", guard="abs(v) <= z - 9"),),
        outputs={"F": "z"},
    )
    found = notes(ChartModel(chart, {}), "0.1*cos(t)", **how)  # type: ignore[arg-type]
    assert "could not be detected" not in "".join(found)


# --------------------------------------------------------------------------- doubts
@pytest.mark.parametrize("kind", PLANTED)
def test_a_planted_doubt_is_found(kind: str):
    for seed in range(4):
        found = PLANTED[kind](random.Random(seed)).trust()
        assert kind in {each.kind for each in found.warnings}, f"{kind}, seed {seed}: {found}"


def test_a_clean_run_has_no_warning():
    for seed in range(8):
        found = clean(random.Random(seed)).trust()
        assert not found.warnings, f"seed {seed}: {found}"


def test_equal_elements_switch_at_one_instant_and_this_is_called_harmless():
    (found,) = simulate(stick_slip("signed"), Prescribed("0.2"), 3.0).trust()
    assert (found.kind, found.severity, found.t) == ("tie", "note", 2.0)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["machines", "ifelse", "compiled"])
def test_engines_have_the_same_findings(engine: str):
    model, rig = pulled_mass()
    assert simulate(model, rig, 20.0, engine=engine).trust() == simulate(model, rig, 20.0).trust()


def test_a_switch_that_the_tolerances_decide_is_another_one_with_finer_ones():
    """With X below b only the coarse run may switch, with X above it only the fine one."""
    for seed in range(6):
        trace = grazing(random.Random(seed))
        (found,) = trace.trust(again=True).of("repeat")
        finer = simulate(trace.model, trace.rig, trace.settings["t_end"], rtol=1e-8)
        same = len(finer.transitions) == len(trace.transitions)
        assert found.severity == ("note" if same else "warning"), f"seed {seed}: {found}"


@pytest.mark.parametrize("ending", [".npz", ".csv"])
def test_a_run_read_from_a_file_can_be_repeated(ending: str, tmp_path: Path):
    ran = simulate(stick_slip("signed"), Prescribed("0.2"), 3.0)
    read = Trace.load(ran.save(tmp_path / f"run{ending}"))
    assert read.trust(again=True).of("repeat") == ran.trust(again=True).of("repeat")


def test_a_repeated_run_says_how_far_its_times_and_its_end_move():
    model, rig = pulled_mass()
    (found,) = simulate(model, rig, 20.0).trust(again=True).of("repeat")
    assert re.match(
        r"with tolerances 100 times finer the sequence of \d+ transitions holds, and times move by "
        r"at most [\d.]+ [µn]s; at the end [\w ]+ moves by [\d.e-]+ \(SI\), [\d.e-]+ of its",
        found.text,
    )


def test_a_force_that_is_not_finite_is_a_finding_where_nothing_reads_it():
    chart = Chart(
        "steep", inputs=("v",), parameters=("a",), states=(State("on"),), outputs={"F": "exp(a)*v"}
    )
    found = simulate(ChartModel(chart, {"a": 750.0}), Prescribed(0.1), 1.0).trust()
    (first,) = found.of("not finite")
    assert first.severity == "warning"
    assert "look at the parameters in [exp(a)*v]" in first.text


def test_a_value_outside_the_domain_that_proofs_assume_is_named():
    entry = registered()["elasto-plastic"]
    model = ChartModel(
        entry.chart(),
        {"sigma_0": 1e4, "sigma_1": 0.0, "z_ba": 2e-4},
        stribeck=Stribeck(1.0, 1.5, 1e-3),
    )
    (found,) = simulate(model, Prescribed("0.001"), 0.1).trust().of("domain")
    assert "s > sigma_0 * z_ba does not hold" in found.text


def test_a_run_that_was_pickled_says_the_same():
    trace = tie(random.Random(1))
    assert trace.trust().findings == Trace.trust(pickle.loads(pickle.dumps(trace))).findings
    assert {each.kind for each in trace.trust()} <= {*KINDS}


@pytest.mark.matrix
def test_trust_of_one_contact_is_its_part_of_the_whole():
    trace = load_scenario("ball_screw_table").simulate()
    whole = trace.trust()
    named = {each.contact for each in whole} - {""}
    assert named >= {"left_stop", "right_stop"}
    for name in trace.contacts:
        part = trace.contact(name).trust().findings
        assert part == tuple(each for each in whole if each.contact in ("", name))


def test_what_is_found_is_kept_also_where_nothing_is_found():
    trace = simulate(stick_slip("signed"), Prescribed("0.2"), 1.0)
    assert not len(trace.trust())
    assert trace.trust() is trace.trust()


def test_a_run_by_a_solver_of_its_users_own_is_not_repeated():
    class Mine(RK45):
        pass

    model, rig = pulled_mass()
    trace = simulate(model, rig, 5.0, method=Mine, engine="ifelse")
    (found,) = trace.trust(again=True).of("not judged")
    assert found.text == "the run is not repeated: its solver Mine is not in the trace"


def test_an_output_of_a_supervisor_that_is_not_finite_is_a_finding():
    chart = Chart(
        "ratio",
        inputs=("T",),
        velocities=(),
        states=(State("off", outputs={"u": "0 * T"}), State("on", outputs={"u": "1 / (T - T)"})),
        transitions=(Transition("start", "off", "on", guard="T > 0.5"),),
    )
    ratio = Supervisor("ratio", chart, inputs={"T": "T"})
    trace = simulate(System("room", supervisors=(ratio,), flow={"T": "1 - T"}), 2.0)
    (found,) = trace.trust().of("not finite")
    assert found.text.startswith("ratio.u is not finite in ")
    assert found.text.endswith("look at the parameters in [1 / (T - T)]")
    assert found.times[0] == pytest.approx(np.log(2.0))


def test_a_switch_explains_the_doubt_about_it():
    from gms_fsm.session.explain import explain

    motion = Prescribed("1.00000001e-3*cos(t)")
    run = simulate(ChartModel(TOUCH, {"k": 1e3, "b": 1e-3}), motion, 3.0)
    (doubt,) = run.trust().of("grazing")
    assert doubt.text in str(explain(run, int(np.searchsorted(run.t, doubt.times[0])) - 1, 0))


def test_a_function_that_is_seen_often_enough_is_not_doubted():
    def force(t: float) -> float:
        return 0.5 * np.sin(3.0 * t)

    model, _ = pulled_mass()
    assert not simulate(model, Slider(1.0, force), 10.0).trust().of("sampling")


@pytest.mark.slow
def test_no_row_is_not_finite_without_an_error_or_a_finding():
    for seed in range(12):
        name, trace = extreme(random.Random(seed))
        assert trace is None or not fault_of(trace), f"seed {seed}, {name}"


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("F", ["exp(a)*v", "-exp(a)*v"])
def test_a_guard_that_reads_an_infinite_force_ends_the_run_and_names_it(engine: str, F: str):
    chart = Chart(
        "steep",
        inputs=("v",),
        parameters=("a",),
        states=(State("on"), State("off", outputs={"F": "0"})),
        transitions=(Transition("go", "on", "off", guard="F > 5"),),
        outputs={"F": F},
    )
    with pytest.raises(NotFiniteError) as caught:
        simulate(ChartModel(chart, {"a": 750.0}), Prescribed(0.1), 1.0, engine=engine)
    assert f"in state on, [{F}], is not finite (" in str(caught.value)
    assert "inf, with a = 750)" in str(caught.value)
