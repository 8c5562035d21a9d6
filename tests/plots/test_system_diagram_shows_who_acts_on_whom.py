"""The block diagram of a system has every part of it, and a line for every influence."""

from __future__ import annotations

import html
import re
import shutil
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gms_fsm import GMS, GMSParameters, Prescribed, PulledSlider
from gms_fsm.systems.system import Body, Contact, System, system_of
from plots.block_diagram import block_diagram
from plots.render import render
from tests.plots.systems_to_draw import BALL, BLOCKS, DRY, PULLED, SERVO, STICTION

SVG = "{http://www.w3.org/2000/svg}"
MODEL = GMS(GMSParameters.paper("stick-slip"), law="signed")


def parts(system: System) -> dict[str, str]:
    """Return the texts of every part, by its id."""
    found = {}
    for line in block_diagram(system).body:
        named = re.match(r'\s*"?([\w-]+)"? \[label=<(.*)> class=(\w+) id="?([\w-]+)', line)
        if named:
            cells = re.findall(r"<TD[^>]*>(.*?)</TD>", named[2])
            texts = [html.unescape(re.sub(r"<[^>]*>", "", cell)) for cell in cells]
            found[named[1]] = " | ".join(text.replace("\xa0", " ") for text in texts)
    return found


def lines(system: System) -> set[tuple[str, str, str]]:
    """Return tail, head, and what is written on each line; contacts have none."""
    found = set()
    for line in block_diagram(system).body:
        ends = re.match(r'\s*"?([\w-]+)"? -> "?([\w-]+)"? \[(.*)', line)
        if ends:
            label = re.search(r'label="? ?([\w, ]*?) ?"? ', ends[3])
            found.add((ends[1], ends[2], label[1] if label else ""))
    return found


def test_the_parts_of_a_servo() -> None:
    assert parts(SERVO) == {
        "signal-r": "r  signal | r = 0.5 * sin(2 * t)",
        "sampled-pid": "pid  every 1 ms | u = k_p * (r - q_m) + I"
        " | I = I + k_i * period * (r - q_m)",
        "flow-i": "i  state | di/dt = (u - i) / tau",
        "body-motor": "motor  body | J_m * dw_m/dt = k_t * i - bearing.F - gear.F",
        "body-load": "load  body | J_l * dw_l/dt = 3 * gear.F",
        "contact-bearing": f"bearing  contact | {STICTION.name} | velocity: w_m",
        "contact-gear": "gear  contact | Backlash with elastic flanks | velocity: w_m - 3 * w_l",
    }


def test_the_lines_of_a_servo() -> None:
    assert lines(SERVO) == {
        ("signal-r", "sampled-pid", "r"),
        ("body-motor", "sampled-pid", "q_m"),
        ("sampled-pid", "flow-i", "u"),
        ("flow-i", "body-motor", "i"),
        ("body-motor", "contact-bearing", ""),
        ("body-motor", "contact-gear", ""),
        ("contact-gear", "body-load", ""),
    }


def test_a_spring_between_bodies_is_a_line_each_way() -> None:
    assert {("body-two", "body-one", "q2"), ("body-one", "body-two", "q1")} <= lines(BLOCKS)
    assert parts(BLOCKS)["body-belt"] == "belt  driven body | w_b = V"


def test_what_is_read_at_ticks_is_dashed() -> None:
    for line in block_diagram(SERVO).body:
        if "class=reads" in line:
            assert ("style=dashed" in line) == ('-> "sampled-pid"' in line)


def test_an_input_of_a_contact_comes_from_what_its_text_reads() -> None:
    from gms_fsm.charts.chart import Chart, State

    pressed = Chart(
        "pressed",
        inputs=("v", "N"),
        parameters=("mu",),
        states=(State("on", outputs={"F": "mu * N * sgn(v)"}),),
    )
    system = System(
        "brake",
        bodies=(Body("disc", inertia=1.0),),
        contacts=(Contact("pad", pressed, {"mu": 0.3}, inputs={"N": "A * p"}, period=0.01),),
        signals={"p": "t"},
        numbers={"A": 2.0},
    )
    assert parts(system)["contact-pad"] == (
        "pad  contact, every 10 ms | pressed | velocity: v | N = A * p"
    )
    assert ("signal-p", "contact-pad", "p") in lines(system)
    assert parts(system)["body-disc"] == "disc  body | dv/dt = -pad.F"


def test_several_elements_are_counted() -> None:
    from gms_fsm.charts.chart import Chart, State

    spring = Chart("spring", parameters=("k",), states=(State("on", outputs={"F": "k * v"}),))
    contact = Contact("pad", spring, {"k": 1.0}, n=3)
    system = System("s", bodies=(Body("mass", inertia=1.0),), contacts=(contact,))
    assert "spring × 3" in parts(system)["contact-pad"]


def test_a_model_on_a_rig_is_the_picture_of_its_system() -> None:
    pulled = parts(system_of(MODEL, PulledSlider(1.0, 2.0, 0.1)))
    assert pulled["contact-friction"] == f"friction  contact | {MODEL.title} | velocity: v"
    driven = system_of(MODEL, Prescribed("0.1 * t"))
    assert ("signal-v", "body-body", "v") in lines(driven)
    assert parts(driven)["body-body"] == "body  driven body"


@pytest.mark.parametrize(
    "system", [PULLED, BALL, BLOCKS, SERVO], ids=lambda system: system.name.replace(" ", "-")
)
def test_no_two_parts_overlap(system: System, tmp_path: Path) -> None:
    if shutil.which("dot") is None:
        pytest.importorskip("pygraphviz", reason="drawing needs Graphviz, program or package")
    svg = render(block_diagram(system), tmp_path / "system.svg")
    boxes = []
    for group in ElementTree.parse(svg).iter(SVG + "g"):
        if set(group.get("class", "").split()) & {"signal", "sampled", "flow", "body", "contact"}:
            found = [shape.get("d") or shape.get("points") or "" for shape in group.iter()]
            numbers = [float(n) for text in found for n in re.findall(r"-?\d+(?:\.\d+)?", text)]
            xs, ys = numbers[::2], numbers[1::2]
            boxes.append((min(xs), min(ys), max(xs), max(ys)))
    assert len(boxes) == len(parts(system))
    for a, b in combinations(boxes, 2):
        assert a[2] < b[0] or b[2] < a[0] or a[3] < b[1] or b[3] < a[1]


def test_the_force_on_each_body_has_its_share() -> None:
    geared = System(
        "geared",
        bodies=(Body("a", inertia=2.0, x="q1", v="w1"), Body("b", inertia="J", x="q2", v="w2")),
        contacts=(Contact("dog", STICTION, DRY, v="w1 - N * w2"),),
        numbers={"N": 3.0, "J": 1.0},
    )
    assert parts(geared)["body-a"] == "a  body | 2 * dw1/dt = -dog.F"
    assert parts(geared)["body-b"] == "b  body | J * dw2/dt = N * dog.F"
