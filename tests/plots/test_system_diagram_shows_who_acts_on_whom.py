"""The block diagram of a system has every part of it, and a line for every influence."""

from __future__ import annotations

import html
import re
from itertools import combinations

import pytest

from gms_fsm import GMS, Chart, GMSParameters, Prescribed, PulledSlider, Sampled, State
from gms_fsm.systems.system import Body, Contact, System, system_of
from plots.systems.block_diagram import block_diagram
from tests.plots.pictures import Box
from tests.plots.systems_to_draw import BLOCKS, DRY, SERVO, STICTION, systems

MODEL = GMS(GMSParameters.paper("stick-slip"), law="signed")


KINDS = {"signal", "sampled", "flow", "body", "spring", "contact"}


def nodes(system: System) -> dict[str, dict[str, str]]:
    """Return the attributes of every node, by its id."""
    found = {}
    for line in block_diagram(system).body:
        named = re.match(r'\s*"?([\w-]+)"? \[label=(<.*>|"") (.*)', line)
        if named:
            rest = dict(re.findall(r'(\w+)="?([^" \]]*)"?', named[3]))
            found[named[1]] = rest | {"label": named[2]}
    return found


def parts(system: System) -> dict[str, str]:
    """Return the texts of every part, by its id."""
    found = {}
    for name, look in nodes(system).items():
        if look.get("class") in KINDS:
            cells = re.findall(r"<TD[^>]*>(.*?)</TD>", look["label"])
            texts = [html.unescape(re.sub(r"<[^>]*>", "", cell)) for cell in cells]
            shown = " | ".join(text.replace("\xa0", " ") for text in texts)
            found[name] = re.sub(r" \|  +", " ", shown)  # lines that go on
    return found


def pieces(system: System) -> dict[str, list[tuple[str, str, str]]]:
    """Return for each wire its pieces: where they begin and end, and the line in the graph."""
    found: dict[str, list[tuple[str, str, str]]] = {}
    for line in block_diagram(system).body:
        ends = re.match(r'\s*"?([\w-]+)"? -> "?([\w-]+)"? \[(.*)', line)
        if ends and not re.search("-(hold|spring|damper)\\d?-", ends[1]):
            name = re.search(r'id="?([\w-]+)-\d+"?', ends[3])
            assert name is not None
            found.setdefault(name[1], []).append((ends[1], ends[2], ends[3]))
    return found


def lines(system: System) -> set[tuple[str, str, str]]:
    """Return tail, head, and what is written on each line; contacts have none."""
    texts = {
        name.removesuffix("-name"): re.sub(r"<[^>]*>", "", look["label"][1:-1])
        for name, look in nodes(system).items()
        if name.endswith("-name")
    }
    ids = "|".join(map(re.escape, parts(system)))
    found = set()
    for name in pieces(system):
        read = re.fullmatch(f"reads-({ids})-({ids})", name)
        if read:
            found.add((read[1], read[2], texts[name]))
        else:
            assert name.startswith("acts-")
            assert name not in texts
            bodies = "|".join(each.name for each in system.bodies)
            acting = re.fullmatch(f"acts-(.*)-({bodies})", name)
            assert acting is not None
            kind = "spring" if f"spring-{acting[1]}" in parts(system) else "contact"
            found.add((f"body-{acting[2]}", f"{kind}-{acting[1]}", ""))
    return found


def test_the_parts_and_lines_of_a_servo() -> None:
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
    assert lines(SERVO) == {
        ("signal-r", "sampled-pid", "r"),
        ("body-motor", "sampled-pid", "q_m"),
        ("sampled-pid", "flow-i", "u"),
        ("flow-i", "body-motor", "i"),
        ("body-motor", "contact-bearing", ""),
        ("body-motor", "contact-gear", ""),
        ("body-load", "contact-gear", ""),
    }
    for name, found in pieces(SERVO).items():  # what is read at ticks is dashed
        for _, _, look in found:
            assert ("style=dashed" in look) == name.endswith("-sampled-pid"), name
    held = {name.split("-hold")[0] for name in nodes(SERVO) if "-hold" in name}
    assert held == {"sampled-pid"}  # what is held has a staircase


def test_tips_of_arrows_end_before_the_frames() -> None:
    """By the corner of the outline of an arrowhead."""
    found = nodes(SERVO)
    blocks = [span(look) for look in found.values() if look.get("class") in KINDS]
    ends = {f"{name}-last": 1.5 * 1.1 for name in pieces(SERVO)}
    acts = [name for name in pieces(SERVO) if name.startswith("acts-")]
    ends |= {f"{name}-{end}": 1.5 * 2.2 for name in acts for end in ("first", "last")}
    for name, apart in ends.items():
        joint = span(found[name])
        middle = 0.5 * (joint.left + joint.right), 0.5 * (joint.top + joint.bottom)
        assert min(each.distance(middle) for each in blocks) == pytest.approx(apart, abs=0.1), name


def test_a_force_text_between_bodies_is_a_line_each_way() -> None:
    assert {("body-two", "body-one", "q2"), ("body-one", "body-two", "q1")} <= lines(BLOCKS)
    assert parts(BLOCKS)["body-belt"] == "belt  driven body | w_b = V"


def test_springs_pull_their_bodies_and_have_a_symbol() -> None:
    screw = systems()["ball_screw_table"]
    shown = parts(screw)
    assert shown["spring-nut"] == (
        "nut  spring | F = k_n * (lead * phi - x) + d_n * (lead * w - v)"
    )
    assert shown["spring-windings"] == "windings  damper | F = -c_m * w"
    assert shown["body-screw"].endswith("M + windings.F - lead * nut.F - bearing.F")
    assert shown["body-table"].startswith("table  body | m * dv/dt = nut.F - guide.F")
    assert {(f"body-{each}", "spring-nut", "") for each in ("screw", "table")} <= lines(screw)
    marks = {name for name in nodes(screw) if name.endswith("-first") and name.startswith("spring")}
    assert marks == {
        "spring-nut-spring-first",
        "spring-windings-damper-first",
        "spring-windings-damper1-first",
    }


def test_inputs_of_contacts_elements_shares_and_rigs() -> None:
    pressed = Chart(
        "pressed",
        inputs=("v", "N"),
        parameters=("mu",),
        states=(State("on", outputs={"F": "mu * N * sgn(v)"}),),
    )
    system = System(
        "brake",
        bodies=(Body("disc", inertia=2.0), Body("rim", inertia="J", x="q", v="w")),
        contacts=(
            Contact("pad", pressed, {"mu": 0.3}, n=3, inputs={"N": "A * p"}, period=0.01),
            Contact("dog", STICTION, DRY, v="v - A * w"),
        ),
        signals={"p": "t"},
        numbers={"A": 2.0, "J": 1.0},
    )
    assert parts(system)["contact-pad"] == (
        "pad  contact, every 10 ms | pressed × 3 | velocity: v | N = A * p"
    )
    assert ("signal-p", "contact-pad", "p") in lines(system)
    assert parts(system)["body-disc"] == "disc  body | 2 * dv/dt = -pad.F - dog.F"
    assert parts(system)["body-rim"] == "rim  body | J * dw/dt = A * dog.F"
    pulled = parts(system_of(MODEL, PulledSlider(1.0, 2.0, 0.1)))
    assert pulled["contact-friction"] == f"friction  contact | {MODEL.title} | velocity: v"
    driven = system_of(MODEL, Prescribed("0.1 * t"))
    assert ("signal-v", "body-body", "v") in lines(driven)
    assert parts(driven)["body-body"] == "body  driven body"


# --------------------------------------------------------------------------- places
def span(look: dict[str, str]) -> Box:
    """Return what a node covers."""
    x, y = (float(part) for part in look["pos"].rstrip("!").split(","))
    wide, high = (36 * float(look[side]) for side in ("width", "height"))
    return Box(x - wide, y - high, x + wide, y + high)


@pytest.mark.parametrize("name", sorted(systems()))
def test_blocks_wires_and_texts_keep_apart_on_two_pages(name: str) -> None:
    system = systems()[name]
    found = nodes(system)
    spans = {each: span(look) for each, look in found.items()}
    wide = max(each.right for each in spans.values()) - min(each.left for each in spans.values())
    assert wide <= 2 * 8.27 * 72
    blocks = {each: spans[each] for each, look in found.items() if look.get("class") in KINDS}
    texts = {each: spans[each] for each in found if each.endswith("-name") or each == "title"}
    for (a, one), (b, other) in combinations((blocks | texts).items(), 2):
        assert not one.meets(other), (a, b)
    runs = []
    for wire, wired in pieces(system).items():
        for tail, head, _ in wired:
            (x0, y0), (x1, y1) = (
                (0.5 * (box.left + box.right), 0.5 * (box.top + box.bottom))
                for box in (spans[tail], spans[head])
            )
            assert x0 == x1 or y0 == y1, wire
            runs.append((wire, Box.around([(x0, y0), (x1, y1)])))
    for wire, run in runs:
        met = [each for each, box in blocks.items() if run.meets(box, -1.5)]
        assert not [*met, *(each for each, box in texts.items() if run.meets(box, -0.5))], wire
    for (a, one), (b, other) in combinations(runs, 2):
        if a == b:
            continue
        near = Box(other.left, other.top - 4, other.right, other.bottom + 4)
        if one.top == one.bottom and other.top == other.bottom:  # level
            assert not (one.meets(near) and min(one.right, other.right) > max(one.left, other.left))
        near = Box(other.left - 4, other.top, other.right + 4, other.bottom)
        if one.left == one.right and other.left == other.right:  # upright
            assert not (one.meets(near) and min(one.bottom, other.bottom) > max(one.top, other.top))


def test_functions_offsets_and_inputs_of_the_same_name_are_written() -> None:
    loaded = Chart("loaded", ("v", "r"), states=(State("only"),), outputs={"F": "r * v"})
    system = System(
        "own",
        bodies=(Body("mass", inertia=1.0, force="u"),),
        contacts=(Contact("pad", loaded, {}),),
        signals={"r": lambda t: 0.0 * t},
        sampled=(Sampled("pid", period=0.1, offset=0.05, updates={"u": "-x"}),),
    )
    found = parts(system)
    assert "r: a Python function" in found["signal-r"]
    assert "every 100 ms, first after 50 ms" in found["sampled-pid"]
    assert ("signal-r", "contact-pad", "r") in lines(system)
