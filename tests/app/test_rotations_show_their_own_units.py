"""What turns is in rad and Nm in every output, what slides in m and N: summaries, pictures, files,
the debugger, the screen during a run, fits, exports for other programs.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from gms_fsm import (
    Body,
    Contact,
    LuGre,
    ParameterError,
    Record,
    Stribeck,
    System,
    UnitError,
    export,
    fit,
    simulate,
)
from gms_fsm.app.live import LiveView
from gms_fsm.app.report import summary_text
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts import CHARTS
from gms_fsm.formats import of
from gms_fsm.session.session import Session
from gms_fsm.systems.mounted import mounted
from gms_fsm.systems.numbers import known_in
from tests.inspection.sessions import debugger

MASS = "N|Ns|N/m|Ns/m|m/N|m|m/s|m/s\\^2|kg"
TORQUE = "Nm|Nms|Nm/rad|Nms/rad|rad/Nm|rad|rad/s|rad/s\\^2|kg m\\^2"
# Behind a number, in brackets, as an attribute, or before a meaning.
PLACES = r"(?:\d |\[|\"|/\* |% |\(\* )[pnµumkM]?({})(?![\w/^·])"


def units_in(text: str, units: str) -> set[str]:
    """Return the units of a kind that stand at a value or a name."""
    return set(re.findall(PLACES.format(units), text, re.MULTILINE))


def servo() -> System:
    """Return the shipped servo as a rotation: the same numbers mean rad, Nm and kg m^2."""
    system = load_scenario("servo").system
    assert system is not None
    return replace(system, bodies=tuple(replace(body, rotary=True) for body in system.bodies))


def system_of(name: str) -> System:
    found = servo() if name == "servo" else load_scenario(name).system
    assert found is not None
    return found


def outputs(system: System, folder: Path) -> Iterable[tuple[str, str]]:
    """Yield what exports of a system and its contacts write, by the name of the file."""
    for subject in (system, system.contacts[0]):
        for each in of("friction"):
            try:
                written = export(subject, each.name, folder / each.name / subject.name)
            except ParameterError:
                continue  # a format that cannot express it
            for path in written:
                if path.suffix == ".fmu":
                    with zipfile.ZipFile(path) as archive:
                        yield path.name, archive.read("modelDescription.xml").decode()
                elif path.suffix not in (".c", ".mjs"):  # which have variables called m
                    yield path.name, path.read_text(encoding="utf-8")


@pytest.mark.matrix
@pytest.mark.parametrize("name", ["servo", "robot_joint"])
def test_exports_of_rotations_have_units_of_rotations(name: str, tmp_path: Path) -> None:
    seen = set()
    for file, text in outputs(system_of(name), tmp_path):
        assert units_in(text, MASS) == set(), file
        seen |= units_in(text, TORQUE)
    assert {"rad", "rad/s", "Nm", "Nm/rad", "rad/Nm"} <= seen


def only_of_rotations(text: str) -> bool:
    """Return whether there are units of rotations in a text, and none of translations."""
    return units_in(text, MASS) == set() != units_in(text, TORQUE)


@pytest.mark.parametrize("name", ["servo", "robot_joint"])
def test_a_summary_of_rotations_has_units_of_rotations(name: str) -> None:
    loaded = load_scenario(name, ['notes=""', "run.t_end=0.05"])
    trace = simulate(system_of(name), 0.05)
    text = summary_text(loaded, trace, trace.trust())
    assert only_of_rotations(text), units_in(text, MASS)


def test_a_summary_of_a_ball_screw_has_of_each_contact_and_body_its_own() -> None:
    loaded = load_scenario("ball_screw_table", ['notes=""', "run.t_end=0.3"])
    trace = loaded.simulate()
    head, *parts = summary_text(loaded, trace, trace.trust()).split("\n## ")
    assert units_in(head, MASS) == {"m", "m/s"}
    assert units_in(head, TORQUE) == {"rad", "rad/s"}
    assert "lead = 0.0016 m/rad" in head
    for part in parts[:4]:
        assert only_of_rotations(part) == part.startswith("Contact bearing")
        assert units_in(part, MASS) == set() or units_in(part, TORQUE) == set()


@pytest.mark.parametrize("name", ["servo", "robot_joint"])
def test_the_debugger_shows_units_of_rotations(name: str) -> None:
    prompt = debugger(Session(system_of(name), 0.15))
    said = "\n".join(
        answer
        for command in ("until t > 0.12", "where", "why 1", "step", "back", "check 2", "log")
        for answer in prompt.reply(command).splitlines()
    )
    assert only_of_rotations(said), units_in(said, MASS)


@pytest.mark.matrix
@pytest.mark.slow
def test_the_full_screen_debugger_shows_units_of_rotations() -> None:
    pytest.importorskip("textual", reason="the full screen needs the extra 'debug'")
    from tests.app.full_screen import LARGE, drive, press, screen_text, typed

    shown = []

    async def look(app: Any, pilot: Any) -> None:
        await press(pilot, *typed("until t = 0.12"), "enter")
        shown.append(screen_text(app))

    drive(look, LARGE, Session(system_of("robot_joint"), 0.15))
    assert only_of_rotations(shown[0]), units_in(shown[0], MASS)


def test_numbers_in_conditions_have_units_of_rotations() -> None:
    session = Session(system_of("robot_joint"), 0.3)
    session.until("w_m > 60 rpm")
    assert session.here.bodies["motor"].v == pytest.approx(2 * np.pi, rel=1e-6)
    session.until("bearings.F > 70 mNm")
    with pytest.raises(UnitError, match="'mm/s' measures velocity, not angular velocity"):
        session.until("w_m > 60 mm/s")
    with pytest.raises(UnitError, match="measures force, not torque"):
        session.until("bearings.F > 70 mN")


def test_the_screen_of_a_run_shows_units_of_rotations() -> None:
    screen = Console(file=io.StringIO(), record=True, width=120)
    view = LiveView(screen, 0.0, 0.15, detail=True)
    shown: list[Any] = []

    def note(moment: Any) -> None:
        shown[:] = [view.picture(moment)]

    simulate(system_of("robot_joint"), 0.15, progress=note)
    screen.print(*shown[0])
    assert only_of_rotations(screen.export_text())


@pytest.mark.slow
def test_pictures_of_rotations_have_units_of_rotations() -> None:
    pytest.importorskip("matplotlib")
    from matplotlib.text import Text

    from plots import figures
    from plots.systems.mechanism import schematic

    trace = simulate(system_of("robot_joint"), 0.3).contact("bearings")
    drawn = [figures.overview(trace), figures.phase(trace), figures.cascade_figure(trace)]
    for figure in (*drawn, schematic(system_of("servo"))):
        texts = "\n".join(each.get_text() for each in figure.findobj(Text))
        assert units_in(texts, MASS) == set()
        assert figure not in drawn or units_in(texts, TORQUE) >= {"Nm"}


# --------------------------------------------------------------------------- fits
@pytest.mark.matrix
@pytest.mark.slow
def test_a_fit_of_a_joint_has_units_of_rotations(tmp_path: Path) -> None:
    friction = LuGre(sigma_0=100.0, sigma_1=0.5, sigma_2=0.1, stribeck=Stribeck(1.0, 1.5, 0.05))
    t = np.linspace(0.0, 2.0, 401)
    joint = System(
        "joint",
        bodies=(Body("arm", velocity="w", x="q", v="w", rotary=True),),
        contacts=(Contact("bearing", friction, v="w"),),
        signals={"w": (t, np.sin(2 * np.pi * t))},
    )
    record = Record.from_arrays(
        time=t, velocity=np.sin(2 * np.pi * t), force=simulate(joint, 2.0, t_eval=t).F
    )
    found = fit(record, joint, free=["bearing.F_c", "bearing.sigma_2"], nuisance=["offset"])
    assert {each.name: each.unit for each in found.table} == {
        "bearing.F_c": "Nm",
        "bearing.sigma_2": "Nms/rad",
        "offset": "Nm",
    }
    assert only_of_rotations(str(found))
    wide = Record.from_arrays(time=t, velocity=3.0 * np.sin(2 * np.pi * t))
    assert only_of_rotations("\n".join(found.outside(wide)))


# --------------------------------------------------------------------------- what turns
def joint_of(v: str, units: dict[str, str]) -> System:
    """Return a contact whose velocity is made of that of a motor, w, and that of a belt, u."""
    motor = Body("motor", inertia=1.0, x="q", v="w", rotary=True)
    belt = Body("belt", inertia=1.0, x="y", v="u")
    pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.0}, v=v)
    return System("one", bodies=(motor, belt), contacts=(pad,), numbers={"r": 2.0}, units=units)


@pytest.mark.parametrize(
    ("v", "units", "unit"),
    [
        ("w", {}, "Nm"),
        ("u", {}, "N"),
        ("3 * w", {}, "Nm"),  # a gear
        ("u - r * w", {}, "N"),  # r adapts
        ("w - u / r", {}, "Nm"),
        ("r * w", {}, "Nm"),  # a gear, unless it is declared
        ("r * w", {"r": "m/rad"}, "N"),
        ("r * w", {"r": "m"}, "N"),
        ("-w / r", {"r": "1"}, "Nm"),
        ("u / r", {"r": "m/rad"}, "Nm"),
    ],
)
def test_a_contact_turns_if_its_velocity_does(v: str, units: dict[str, str], unit: str) -> None:
    assert joint_of(v, units).contact("pad").chart.unit("F_c") == unit


def test_units_that_are_declared_are_shown_and_kept(tmp_path: Path) -> None:
    system = joint_of("w", {"r": "m/rad", "pad.F_s": "N"})
    known = known_in(mounted(system))
    assert (known["numbers.r"][0].unit, known["pad.F_s"][0].unit) == ("m/rad", "N")
    again = System.load(system.save(tmp_path / "one.toml"))
    assert again == system
    assert again.contact("pad").chart.unit("F_s") == "N"


def test_turning_is_the_older_word_for_rotary() -> None:
    old = Body("rotor", inertia=1.0, motion="turning")
    assert old == Body("rotor", inertia=1.0, rotary=True)
    assert old.unit == "rad"


def test_units_change_no_bit() -> None:
    system = load_scenario("servo").system
    assert system is not None
    one, other = simulate(system, 0.1), simulate(servo(), 0.1)
    assert one.rows.y.tobytes() == other.rows.y.tobytes()
    assert len(one.transitions) == len(other.transitions)
