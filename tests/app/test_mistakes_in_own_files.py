"""A mistake in a chart or system file is one message: file, line, key, text, and what to do."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import own_files
from tests.scenario_files import CommandLine, changed, nothing_written, one_message

CASES: dict[str, tuple[str, str, str, str, tuple[str, ...]]] = {
    # file, text, replacement, command, what is said
    "an unknown key": (
        "pair",
        "inertia = 0.5",
        "inertia = 0.5\nmass = 1",
        "run pair.toml",
        ("pair.toml: line 16: body.1.mass = 1: unknown key", "inertia"),
    ),
    "a guard": (
        "own",
        'guard = "F > F_s"',
        'guard = "F > F_k"',
        "run pair.toml",
        ("own.toml: line 29, edge.0.guard", "column 5: unknown name 'F_k'", "    F > F_k"),
    ),
    "a guard of a chart": (
        "own",
        'guard = "F > F_s"',
        'guard = "F >> F_s"',
        "check own.toml",
        ("own.toml: line 29, edge.0.guard", "    F >> F_s"),
    ),
    "a chart file that is missing": (
        "pulled",
        '"own.toml"',
        '"one.toml"',
        "blocks pulled.toml",
        ("pulled.toml: line 11, contact.0.chart", "one.toml: no such file"),
    ),
    "a system as its own chart": (
        "pulled",
        '"own.toml"',
        '"pulled.toml"',
        "run pulled.toml",
        ("pulled.toml: line 11, contact.0.chart", "unknown key"),
    ),
    "named expressions in a circle": (
        "own",
        'name = "stiction"\n',
        'name = "stiction"\nlet = { a1 = "2 * a2", a2 = "3 * a1" }\n',
        "chart own.toml",
        ("own.toml: line 2", "a2"),
    ),
    "an initial value": (
        "pair",
        "one.x = 1e-3",
        "one.y = 1e-3",
        "run pair.toml -o out",
        ("pair.toml", "initial has the key 'one.y'", "pad1.states"),
    ),
    "an initial value that is a text": (
        "pair",
        "one.x = 1e-3",
        'one.x = "1e-3"',
        "run pair.toml",
        ("pair.toml: line 47: initial.one.x = '1e-3'", "number"),
    ),
    "a key of the run": (
        "pair",
        "t_end = 12.0",
        "t_end = 12.0\nrtoll = 1e-8",
        "run pair.toml",
        ("pair.toml: line 45: run.rtoll", "did you mean 'rtol'?"),
    ),
    "held outputs of the whole run": (
        "pair",
        "t_end = 12.0",
        't_end = 12.0\nstep = 1e-3\nevents = "held"',
        "run pair.toml",
        ("pair.toml", "give a contact a period"),
    ),
    "rows that are too many": (
        "pair",
        "figures = []",
        "figures = []\nevery = 1e-9",
        "run pair.toml",
        ("pair.toml: output.every = 1e-09 s gives 1.2e+10 rows",),
    ),
    "a file that is not TOML": (
        "own",
        'name = "stiction"',
        "name = stiction",
        "chart own.toml",
        ("own.toml: not valid TOML", "line 1"),
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_mistake_in_a_file(case: str, gms_fsm: CommandLine, tmp_path: Path) -> None:
    name, old, new, command, said = CASES[case]
    own_files.write(tmp_path)
    path = tmp_path / f"{name}.toml"
    path.write_text(changed(path.read_text(), old, new))
    one_message(gms_fsm(*command.split()), *said)
    nothing_written(tmp_path, {"own.toml", "pulled.toml", "pair.toml"})


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("chart none.toml", ("none.toml: no such file",)),
        ("chart none", ("must be one of", "give a chart file")),
        ("chart .", ("must be one of", "give a chart file")),
        ("check ../none.toml", ("none.toml: no such file",)),
        ("chart own.toml --law signed", ("own.toml is a file", "leave --law out")),
        ("chart own.toml --contact pad", ("it is a chart file", "leave --contact out")),
        ("chart lugre --contact pad", ("--contact pad", "has no contacts")),
        ("chart pair.toml", ("pair.toml: it has the contacts", "--contact pad1")),
        ("check pair.toml --contact pad", ("has no contact 'pad'", "'pad1', 'pad2', 'gear'")),
        ("run own.toml", ("own.toml: this is a chart file", "[[contact]]", "gms-fsm check")),
        ("sweep own.toml --over F_s=1:2:2", ("own.toml: this is a chart file",)),
        ("run pair.toml --set body.tow.inertia=1", ("no 'tow'", "choose from one, two")),
        ("run pair.toml --set body.two.inertia=q", ("--set, body.1.inertia", "name 'q'", "    q")),
        ("run pair.toml --set body.two.inertia=0", ("--set, body.1.inertia", "is not positive")),
        ("run pair.toml --set body.2.inertia=1", ("no '2'", "choose from one, two")),
        ("run pair.toml --set contact.gear=1", ("--set: contact.2 = 1", "must be a table")),
        ("blocks own", ("own: it is not a file",)),
    ],
)
def test_a_mistake_on_the_command_line(
    command: str, said: tuple[str, ...], gms_fsm: CommandLine, tmp_path: Path
) -> None:
    own_files.write(tmp_path)
    one_message(gms_fsm(*command.split()), *said)
    nothing_written(tmp_path, {"own.toml", "pulled.toml", "pair.toml"})
