"""A schematic has every body, contact, spring and damper of a system once, and no texts overlap.

What is a spring or a damper is compared with what the texts of the scenarios say, by hand; what is
none stands at an arrow.
"""

from __future__ import annotations

from collections import Counter
from itertools import combinations

import pytest

from gms_fsm import PulledSlider
from gms_fsm.errors import ParameterError
from gms_fsm.language import MATLAB_LIKE, spell
from gms_fsm.systems.system import Body, Contact, System, system_of
from plots._mechanics import Mechanism, mechanism, total
from tests.plots.systems_to_draw import BLOCKS, DRY, GMS12, PULLED, STICTION, systems

A4 = 8.27  # inches


def links(found: Mechanism) -> set[tuple[str, str, str, str]]:
    return {(each.kind, spell(each.constant, MATLAB_LIKE), *each.ends) for each in found.links}


def forces(found: Mechanism) -> dict[str, str]:
    return {each.body: spell(total(each.terms), MATLAB_LIKE) for each in found.forces}


LINKS = {
    "ball_screw_table": {
        ("damper", "c_m", "screw", ""),
        ("spring", "k_n", "screw", "table"),
        ("damper", "d_n", "screw", "table"),
    },
    "belt_driven_mass": {
        ("spring", "k_b", "motor", "carriage"),
        ("damper", "d_b", "motor", "carriage"),
    },
    "brake_squeal": {
        ("spring", "k_x", "tangential", ""),
        ("damper", "c", "tangential", ""),
        ("spring", "k_y", "normal", ""),
        ("damper", "c", "normal", ""),
    },
    "drill_string": {
        ("damper", "c_r", "table", ""),
        ("damper", "c_t", "table", "bit"),
        ("spring", "k_t", "table", "bit"),
        ("damper", "c_b", "bit", ""),
    },
    "friction_damper": {("spring", "k", "structure", ""), ("damper", "c", "structure", "")},
    "servo": {("spring", "k_s", "motor", "load"), ("damper", "d_s", "motor", "load")},
    "two_blocks_on_a_belt": {
        ("spring", "k", "one", ""),
        ("spring", "k", "two", ""),
        ("spring", "k_c", "one", "two"),
    },
    "pulled_mass": {("spring", "stiffness", "body", "")},
    "pulled mass": {("spring", "K", "mass", "")},
    "a train of four": {
        ("spring", "k", "one", ""),
        ("spring", "k_c", "one", "two"),
        ("spring", "k_l", "one", "four"),
        ("damper", "0.5 * d", "two", "three"),
        ("spring", "k", "three", ""),
    },
}
FORCES = {
    "ball_screw_table": {"screw": "M"},
    "belt_driven_mass": {"motor": "k_p * (speed / r - w) + k_i * lag"},
    "brake_squeal": {"tangential": "-k_xy * y", "normal": "-k_xy * x - N_0"},
    "drill_string": {"table": "u"},
    "friction_damper": {"structure": "F_e"},
    "servo": {"motor": "u"},
    "ball": {"ball": "m * g"},
    "a train of four": {"one": "P * sin(w * t)", "four": "-k_f * x_1"},
    "two-mass servo": {"motor": "k_t * i"},
    "slider pushed by a force": {"body": "F_a"},
    "paper_fig3_non_drifting": {"body": "F_a"},
}


def test_springs_dampers_and_other_forces_are_those_of_the_texts() -> None:
    for name, system in systems().items():
        found = mechanism(system)
        assert links(found) == LINKS.get(name, links(found) if "pulled" in name else set()), name
        assert forces(found) == FORCES.get(name, {}), name


def test_a_gear_belongs_to_its_end() -> None:
    found = mechanism(systems()["ball_screw_table"])
    between = [each for each in found.links if each.ends == ("screw", "table")]
    assert [[spell(r.tree, MATLAB_LIKE) for r in each.ratios] for each in between] == [
        ["lead", "1"]
    ] * 2


def test_a_point_that_moves_is_the_end_of_a_spring() -> None:
    (spring,) = mechanism(PULLED).links
    assert spell(total(spring.drive), MATLAB_LIKE) == "V * t"


def test_a_spring_that_the_other_body_does_not_feel_is_a_force() -> None:
    bodies = (
        Body("a", inertia=1.0, force="k * (x_b - x)"),
        Body("b", inertia=1.0, x="x_b", v="v_b"),
    )
    odd = System(
        "odd", bodies=bodies, contacts=(Contact("pad", STICTION, DRY),), numbers={"k": 1.0}
    )
    found = mechanism(odd)
    assert links(found) == set()
    assert forces(found) == {"a": "k * (x_b - x)"}


def test_a_spring_that_pushes_away_is_a_force() -> None:
    bodies = (Body("a", inertia=1.0, force="k * x"),)
    odd = System(
        "odd", bodies=bodies, contacts=(Contact("pad", STICTION, DRY),), numbers={"k": 1.0}
    )
    assert links(mechanism(odd)) == set()
    assert forces(mechanism(odd)) == {"a": "k * x"}


def test_contacts_have_the_symbols_of_their_charts() -> None:
    def symbols(name: str) -> dict[str, str]:
        return {each.contact.name: each.symbol for each in mechanism(systems()[name]).touches}

    assert symbols("ball_screw_table") == {
        "bearing": "friction",
        "guide": "friction",
        "right_stop": "stop",
        "left_stop": "stop",
    }
    assert symbols("friction_damper") == {"joint": "backlash", "pad": "friction"}
    assert symbols("brake_squeal") == {"face": "box", "pad": "friction"}
    assert symbols("a puck") == {"floor": "box"}
    assert symbols("servo") == {"bearing": "friction"}
    assert symbols("a train of four") == {
        "slip": "friction",
        "dog": "clutch",
        "pads": "friction",
        "differential": "box",
    }


# --------------------------------------------------------------------------- the picture
@pytest.mark.parametrize("name", sorted(systems()))
def test_everything_is_drawn_once_and_no_texts_overlap(name: str) -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from plots import schematic

    system = systems()[name]
    figure, found = schematic(system), mechanism(system)
    FigureCanvasAgg(figure).draw()
    ax = figure.axes[0]
    drawn = Counter(each.get_gid() for each in ax.get_children() if each.get_gid())
    wanted = Counter(f"body {each.name}" for each in system.bodies)
    wanted += Counter(f"contact {each.name}" for each in system.contacts)
    wanted += Counter(f"{kind} {constant}" for kind, constant, *_ in [*links_of(found)])
    wanted += Counter(f"force {each.body}" for each in found.forces)
    own = ("body ", "contact ", "spring ", "damper ", "force ")
    assert {gid: n for gid, n in drawn.items() if gid.startswith(own)} == wanted
    boxes = [(each.get_text(), each.get_window_extent()) for each in ax.texts]
    for (a, one), (b, other) in combinations(boxes, 2):
        assert not one.overlaps(other), (a, b)
    whole = figure.bbox
    for text, box in boxes:
        assert whole.x0 <= box.x0, text
        assert box.x1 <= whole.x1, text
        assert whole.y0 <= box.y0, text
        assert box.y1 <= whole.y1, text
    assert figure.get_size_inches()[0] <= 2 * A4
    assert min(each.get_fontsize() for each in ax.texts) >= 7
    names = [text for text, _ in boxes]
    for part in (*system.bodies, *system.contacts):
        assert part.name in names


def links_of(found: Mechanism) -> list[tuple[str, str]]:
    return [(each.kind, spell(each.constant, MATLAB_LIKE)) for each in found.links]


def test_twelve_elements_are_one_contact() -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    from plots import schematic

    figure = schematic(system_of(GMS12, PulledSlider(1.0, 2.0, 0.1)))
    below = " ".join(text.get_text() for text in figure.axes[0].texts)
    assert below.count("× 12") == 1


def test_bodies_and_symbols_do_not_overlap() -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from plots import schematic

    for name, system in systems().items():
        figure = schematic(system)
        FigureCanvasAgg(figure).draw()
        boxes = {
            each.get_gid(): each.get_window_extent()
            for each in figure.axes[0].get_children()
            if (each.get_gid() or "").startswith("body ")
        }
        assert len(boxes) == len(system.bodies)
        for (a, one), (b, other) in combinations(boxes.items(), 2):
            assert not one.overlaps(other), (name, a, b)


def test_only_systems_are_drawn() -> None:
    from plots import schematic

    with pytest.raises(ParameterError, match="it must be a System"):
        schematic("scenario.toml")  # type: ignore[arg-type]


def test_belts_are_below_what_rubs_on_them() -> None:
    pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")
    from plots import schematic

    boxes = {
        each.get_gid(): each
        for each in schematic(BLOCKS).axes[0].patches
        if (each.get_gid() or "").startswith("body ")
    }
    belt = boxes["body belt"]
    for name in ("one", "two"):
        block = boxes[f"body {name}"]
        assert belt.get_y() + belt.get_height() < block.get_y()  # type: ignore[attr-defined]
        assert belt.get_x() < block.get_x()  # type: ignore[attr-defined]
