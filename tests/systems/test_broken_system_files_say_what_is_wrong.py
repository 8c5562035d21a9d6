"""The error in a system file names file, line, key, text and column, and what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from gms_fsm.errors import GMSError
from gms_fsm.systems.system import System

TEXT = """\
name = "pair"
[numbers]
m = 1.0
[signals]
r = "m * sin(t)"
q = [[0, 0], [1, 2]]
[flow]
i = "(r - i) / 0.1"
[[body]]
name = "one"
inertia = "m"
force = "q - x1 + i"
x = "x1"
v = "v1"
[[body]]
name = "two"
inertia = 2
x = "x2"
v = "v2"
[[contact]]
name = "gear"
v = "v1 - 2 * v2"
chart = "lugre"
values = { sigma_0 = 1e3, sigma_1 = 31.6 }
inputs.s = 1
[[contact]]
name = "pad"
v = "v2"
[contact.model]
kind = "GMS"
law = "signed"
preset = "stick-slip"
[[sampled]]
name = "pid"
period = 1e-3
updates.u = "m * x1"
[[spring]]
name = "shaft"
first = "one"
second = "two"
k = "2 * m"
d = 0.5
ratio = 3
rest = "r"
"""
CASES = {
    "an inertia": ('"m"\nforce', '"mm"\nforce', 11, "body.0.inertia", "unknown name 'mm'"),
    "no inertia": ("inertia = 2\n", "", 15, "body.1", "neither an inertia nor a velocity"),
    "zero inertia": ("inertia = 2", "inertia = 0", 17, "body.1.inertia", "is not positive"),
    "a force": ("q - x1", "q - x9", 12, "body.0.force", "column 5"),
    "a velocity": ("v1 - 2 * v2", "v1 * v2", 22, "contact.0.v", "not linear"),
    "an unknown velocity": ('v = "v2"\n[contact', 'v = "v3"\n[contact', 28, "contact.1.v", "'v3'"),
    "an unread input": ("inputs.s", "inputs.q", 25, "contact.0.inputs.q", "does not read"),
    "an unbound input": ("inputs.s = 1\n", "", 20, "contact.0", "reads the input 's'"),
    "an input": ("inputs.s = 1", 'inputs.s = "z9"', 25, "contact.0.inputs.s", "'z9'"),
    "a value": ("31.6", "-31.6", 20, "contact.0", "must be >= 0"),
    "an unknown chart": (
        '"lugre"',
        '"lugree"',
        23,
        "contact.0.chart",
        "no chart 'lugree'",
    ),
    "a chart elsewhere": ('"lugre"', '"../a.toml"', 23, "contact.0.chart", "outside the folder"),
    "no chart file": ('"lugre"', '"a.toml"', 23, "contact.0.chart", "no such file"),
    "neither chart nor model": (
        'chart = "lugre"\n',
        "",
        20,
        "contact.0",
        "neither a chart nor a model",
    ),
    "a preset": ("stick-slip", "stick", 32, "contact.1.model.preset", "must be"),
    "an unknown model": ('"GMS"', '"GMs"', 30, "contact.1.model.kind", "one of 'GMS', 'LuGre'"),
    "a signal": ("m * sin", "M * sin", 5, "signals.r", "unknown name 'M'"),
    "ramps": ("[[0, 0]", "[[5, 0]", 6, "signals.q", "time goes backward"),
    "a function": ("[[0, 0], [1, 2]]", '{ kind = "function" }', 6, "signals.q", "Python function"),
    "a flow": ("(r - i) /", "(r - i /", 8, "flow.i", "column"),
    "a name used twice": ('x = "x2"', 'x = "x1"', 18, "body.1.x", "used twice"),
    "a contact's name": ('"pad"', '"gear"', 27, "contact.1.name", "used twice"),
    "a period": ("1e-3", "0", 33, "sampled.0", "must be > 0"),
    "an update": ("m * x1", "m * y1", 36, "sampled.0.updates.u", "'y1'"),
    "a number": ("m = 1.0", 'm = "1"', 3, "numbers.m", "valid number"),
    "an unknown key": ("inertia = 2", "inertia = 2\nmass = 1", 18, "body.1.mass", "valid here"),
    "an end": ('second = "two"', 'second = "tow"', 40, "spring.0.second", "no body 'tow'"),
    "the same end": ('second = "two"', 'second = "one"', 40, "spring.0.second", "both its ends"),
    "a stiffness": ('"2 * m"', '"2 * x1"', 41, "spring.0.k", "unknown name 'x1'"),
    "a negative stiffness": ('"2 * m"', '"-2 * m"', 41, "spring.0.k", "the stiffness must be >= 0"),
    "a negative damping": ("d = 0.5", "d = -0.5", 42, "spring.0.d", "the damping must be >= 0"),
    "a ratio": ("ratio = 3", 'ratio = "t"', 43, "spring.0.ratio", "unknown name 't'"),
    "a rest": ('rest = "r"', 'rest = "v1"', 44, "spring.0.rest", "unknown name 'v1'"),
    "a spring of nothing": ('k = "2 * m"\nd = 0.5\n', "", 37, "spring.0", "neither a stiffness"),
    "a spring's name": ('"shaft"', '"two"', 38, "spring.0.name", "used twice"),
    "an unknown table": ("[[sampled]]", "[[sample]]", 33, "sample", "did you mean 'sampled'?"),
}


@pytest.mark.parametrize("case", CASES)
def test_the_line_and_the_key_are_named(case: str, tmp_path: Path) -> None:
    old, new, line, key, reason = CASES[case]
    path = tmp_path / "own.toml"
    assert old in TEXT
    path.write_text(TEXT.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(GMSError, match=reason.replace("(", r"\(").replace("?", r"\?")) as caught:
        System.load(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: line {line}")
    assert key in message


def test_the_system_itself_is_sound(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(TEXT, encoding="utf-8")
    assert [each.name for each in System.load(path).contacts] == ["gear", "pad"]


def test_the_line_in_a_chart_file_is_named_too(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text('name = "a"\n[[state]]\nname = "b"\noutputs.F = "q"', "utf-8")
    path = tmp_path / "own.toml"
    path.write_text(TEXT.replace('"lugre"', '"a.toml"'), encoding="utf-8")
    with pytest.raises(GMSError, match="unknown name 'q'") as caught:
        System.load(path)
    where = f"{path}: line 23, contact.0.chart: {tmp_path / 'a.toml'}: line 4, state.0.outputs.F: "
    assert str(caught.value).startswith(where)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"force": "x9"}, ("bodies", 0, "force")),
        ({"inertia": "0"}, ("bodies", 0, "inertia")),
        ({"inertia": "1 / m"}, ("bodies", 0, "inertia")),
    ],
)
def test_a_text_is_refused_when_the_system_is_made(
    change: dict[str, str], key: tuple[str, ...]
) -> None:
    from gms_fsm import GMS, GMSParameters
    from gms_fsm.systems.system import Body, Contact

    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    with pytest.raises(GMSError) as caught:
        System(
            "one",
            bodies=(Body("mass", **{"inertia": "m + 1", **change}),),
            contacts=(Contact("pad", model),),
            numbers={"m": 0.0},
        )
    assert caught.value.key == key
