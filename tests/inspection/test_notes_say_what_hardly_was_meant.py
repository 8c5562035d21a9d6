"""A run whose scales do not fit its model, or with arrests too fast for the clock, gets a note."""

import re
from pathlib import Path

import numpy as np
import pytest

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
    State,
    Stribeck,
    System,
    Transition,
    simulate,
)
from gms_fsm.session.notes import notes_on, notes_on_system
from tests.helpers import ROOT, open_loop, pulled_mass, stick_slip


def bank(k: float = 1.0, v_c: float = 1e-6) -> GMS:
    """Return two elements with thresholds of a few micrometres at k = 1."""
    p = GMSParameters.from_shares(
        [0.5, 0.5], [k * 4e5, k * 2e5], C=20.0, v_c=v_c, stribeck=Stribeck(2.0, 2.4, 1e-3)
    )
    return GMS(p, law="signed")


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
            "the stroke of 1 m is 2e\\+05 times the largest threshold.*unit of the motion",
        ),
        (
            bank(v_c=1e-2),
            "1e-3*sin(t)",
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
    found = notes_on_system(
        simulate(System("servo", bodies=bodies, contacts=(pad,), sampled=(pid,)), 0.1)
    )
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
    note = "note: no transition: the speed stays below v_c"
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
