"""A schematic has every body, contact, spring and damper of a system once, and no texts overlap.

Springs and dampers are those that are declared; a force given as a text stands at an arrow.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import combinations
from typing import Any

import pytest

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

from matplotlib.patches import FancyBboxPatch, Rectangle

from gms_fsm import Body, Chart, Contact, PulledSlider, State, System
from gms_fsm.language import MATLAB_LIKE, spell
from gms_fsm.systems.system import system_of
from plots import schematic
from plots.systems.mechanical_layout import Item, arranged, force_of
from plots.systems.mechanical_symbols import formula
from tests.helpers import matrix
from tests.plots.printed import problems
from tests.plots.systems_to_draw import BLOCKS, GMS12, PLANAR, PLANE, PULLED, systems

A4 = 8.27  # inches


def items(system: System) -> list[Item]:
    layout = arranged(system)
    legs = (
        Item(column.body.name, "", links=slot.links)
        for column in layout.columns
        for slot in column.slots
        if slot.links
    )
    return [*layout.over, *(each for gap in layout.gaps.values() for each in gap), *legs]


def forces(system: System) -> dict[str, str]:
    texts = {body.name: spell(force_of(system, body), MATLAB_LIKE) for body in system.bodies}
    return {name: text for name, text in texts.items() if text != "0"}


@pytest.mark.slow
def test_springs_and_dampers_are_between_their_bodies() -> None:
    for system in (*systems().values(), BLOCKS):  # whose forces are texts, and no springs
        wanted = Counter[Any]()
        for spring in system.springs:
            ends = frozenset((spring.first, spring.second or ""))
            wanted["spring", str(spring.k), ends] += spring.k != 0.0
            wanted["damper", str(spring.d), ends] += spring.d != 0.0
        found = Counter(
            (link.kind, link.constant, frozenset((each.left, each.right)))
            for each in items(system)
            for link in each.links
        )
        assert found == +wanted, system.name


def test_gears_drives_and_lengths_at_rest_are_written_at_their_springs() -> None:
    (nut,) = (each for each in items(systems()["ball_screw_table"]) if len(each.links) == 2)
    assert (nut.left, nut.right, nut.ratios) == ("screw", "table", (r"$\mathit{lead}$", ""))
    # A point that moves is the end of a spring, and a damper stays at the wall.
    both = replace(PULLED, springs=(replace(PULLED.springs[0], d=1.0),))
    assert [(each.drive, len(each.links)) for each in items(both)] == [(r"$V\,t$", 1), ("", 1)]
    labels = [link.label for each in items(systems()["a train of four"]) for link in each.links]
    assert r"$k$, rest $0.5\,r$" in labels


def test_contacts_have_the_symbols_of_their_charts() -> None:
    def symbols(name: str) -> dict[str, str]:
        layout = arranged(systems()[name])
        touches = [each.touch for each in items(systems()[name]) if each.touch is not None]
        slots = [slot for column in layout.columns for slot in column.slots]
        touches += [slot.touch for slot in slots if slot.touch is not None]
        return {each.contact.name: each.symbol for each in touches}

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
DRAWN = ("ball_screw_table", "belt_driven_mass", "brake_squeal", "friction_damper", "ball")
DRAWN += ("two-mass servo", "a train of four", "a puck")


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", matrix(sorted(systems()), DRAWN))
def test_everything_is_drawn_once_and_nothing_overlaps(name: str) -> None:
    system = systems()[name]
    figure = schematic(system)
    ax = figure.axes[0]
    drawn = Counter(each.get_gid() for each in ax.get_children() if each.get_gid())
    wanted = Counter(f"body {each.name}" for each in system.bodies)
    wanted += Counter(f"contact {each.name}" for each in system.contacts)
    wanted += Counter(f"spring {each.k}" for each in system.springs if each.k != 0.0)
    wanted += Counter(f"damper {each.d}" for each in system.springs if each.d != 0.0)
    wanted += Counter(f"force {name}" for name in forces(system))
    own = ("body ", "contact ", "spring ", "damper ", "force ")
    assert {gid: n for gid, n in drawn.items() if gid.startswith(own)} == wanted
    assert problems(figure, 7.0) == []
    assert figure.get_size_inches()[0] <= 2 * A4
    names = [text.get_text() for text in ax.texts]
    assert {part.name for part in (*system.bodies, *system.contacts)} <= set(names)
    boxes = bodies(ax)
    assert len(boxes) == len(system.bodies)
    for (a, one), (b, other) in combinations(boxes.items(), 2):
        assert not one.get_window_extent().overlaps(other.get_window_extent()), (a, b)


def bodies(ax: Any) -> dict[str, Any]:
    return {
        each.get_gid(): each
        for each in ax.get_children()
        if (each.get_gid() or "").startswith("body ")
    }


def test_what_turns_has_round_corners_and_bent_arrows() -> None:
    screw, table = ("body screw", "position screw", "force screw"), ("body table", "position table")
    drawn = parts("ball_screw_table")
    assert isinstance(drawn["body screw"], FancyBboxPatch)
    assert isinstance(drawn["body table"], Rectangle)
    for name in (*screw[1:], table[1]):
        (x0, y0), (x1, y1), *_ = drawn[name].get_path().vertices
        assert (y1 - y0 > 0.1 * abs(x1 - x0)) == (name in screw), name


def test_a_play_between_what_turns_is_an_angle() -> None:
    texts = {
        name: " ".join(text.get_text() for text in schematic(systems()[name]).axes[0].texts)
        for name in ("two-mass servo", "friction_damper")
    }
    assert "= 0.02 rad" in texts["two-mass servo"]
    assert "= 0.002 m " in f"{texts['friction_damper']} "


def test_what_moves_normal_to_the_ground_has_upright_arrows_and_springs() -> None:
    drawn = parts("brake_squeal")
    for name in ("position normal", "force normal"):
        start, *_, end = drawn[name].get_path().vertices[:3]
        assert start[0] == pytest.approx(end[0])
        assert end[1] > start[1]
    box = drawn["body normal"]
    x, y = drawn["spring k_y"].get_data()
    assert box.get_x() < min(x)
    assert max(x) < box.get_x() + box.get_width()
    assert max(y) == pytest.approx(box.get_y())


def parts(name: str) -> dict[str, Any]:
    """Return the artists of a schematic by name."""
    children = schematic(systems()[name]).axes[0].get_children()
    return {each.get_gid(): each for each in children if each.get_gid()}


def test_twelve_elements_are_one_contact_and_belts_are_below_what_rubs_on_them() -> None:
    figure = schematic(system_of(GMS12, PulledSlider(1.0, 2.0, 0.1)))
    below = " ".join(text.get_text() for text in figure.axes[0].texts)
    assert below.count("signed law × 12") == 1  # the law and the count in one line
    boxes = bodies(schematic(BLOCKS).axes[0])
    belt = boxes["body belt"]
    for name in ("one", "two"):
        block = boxes[f"body {name}"]
        assert belt.get_y() + belt.get_height() < block.get_y()
        assert belt.get_x() < block.get_x()


def test_exponents_and_shares_are_formulas() -> None:
    assert formula("a*x^((b + 1) / 2) + c") == r"$a\,x^{(b + 1) / 2} + c$"
    values = dict.fromkeys(PLANAR.parameter_names, 1.0)
    floor = Contact("floor", PLANAR, values, v=("-(r * v)", "r * w - v"))
    layout = arranged(replace(PLANE, contacts=(floor,), numbers={"r": 1.0}))
    slots = [slot for column in layout.columns for slot in column.slots]
    touches = [slot.touch for slot in slots if slot.touch]
    touches += [each.touch for gap in layout.gaps.values() for each in gap if each.touch]
    touches += [each.touch for each in layout.over if each.touch]
    signs = [{name: sign for name, (sign, _) in touch.shares.items()} for touch in touches]
    assert signs == [{"east": -1, "north": 1}]


def test_contacts_of_ones_own_charts_are_boxes() -> None:
    loaded = Chart("loaded", ("v", "load"), states=(State("only"),), outputs={"F": "load * v"})
    system = System(
        "own",
        bodies=(
            Body("belt", velocity="V"),
            Body("one", inertia=1.0, x="y", v="w"),
            Body("two", inertia=1.0, x="y2", v="w2"),
        ),
        contacts=(Contact("pad", loaded, {}), Contact("between", loaded, {}, v="w - w2")),
        numbers={"V": 0.1, "load": 1.0},
    )
    texts = [text.get_text() for text in schematic(system).axes[0].texts]
    assert {"pad", "between", "belt"} <= {*texts}
    assert any("V" in text for text in texts)
