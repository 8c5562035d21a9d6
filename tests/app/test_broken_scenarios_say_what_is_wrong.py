"""A broken scenario file gives one message with file, key, value and rule; nothing is written.

Exit code 2, no traceback. Only a run that fails midway keeps its rows so far, in a complete file.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gms_fsm import Trace
from gms_fsm._files import LIST
from tests.helpers import ROOT
from tests.scenario_files import (
    OPEN_LOOP,
    CommandLine,
    changed,
    nothing_written,
    one_message,
    sine_table,
)

MODEL = OPEN_LOOP[OPEN_LOOP.index("[model]") : OPEN_LOOP.index("[rig]")]
RIG = OPEN_LOOP[OPEN_LOOP.index("[rig]") : OPEN_LOOP.index("[run]")]
SHARES = ("C = [0.1, 0.1]", "C = 2.0\nshares = [0.5, 0.5]")
PAPER = '[model]\nkind = "GMS"\nlaw = "signed"\npreset = "stick-slip"\n'

# fault -> (old text, new text), and what the message must contain besides the file
CHANGES: dict[str, tuple[tuple[str, str], tuple[str, ...]]] = {
    # keys
    "a typo of a table": (("[rig]", "[rgi]"), ("rgi", "unknown key", "'rig'")),
    "a typo of a key": (
        ("v_c = 1e-6", "vc = 1e-6"),
        ("model.vc", "1e-06", "unknown key", "did you mean 'v_c'?", "stribeck, weights, shares"),
    ),
    "a typo of a required key": (("law =", "lwa ="), ("model.lwa", "'signed'", "'law'")),
    "a typo in [run]": (("t_end", "tend"), ("run.tend", "1.0", "'t_end'")),
    "a typo two tables deep": (
        ("F_s = 1.5", "Fs = 1.5"),
        ("model.stribeck.Fs", "1.5", "'F_s'", "F_c, F_s, v_s"),
    ),
    "an unknown key": (
        ("t_end = 1.0", "t_end = 1.0\nspeed_of_light = 3e8"),
        ("run.speed_of_light", "300000000.0", "unknown key", "t_end, t_start, method"),
    ),
    "a key of another rig": (
        ('kind = "prescribed"', 'kind = "pulled"'),
        ("rig.velocity", "unknown key", "mass, stiffness, speed"),
    ),
    "a key of another model": (
        ('"GMS"', '"LuGre"'),
        ("model.law", "unknown key", "sigma_0, sigma_1, sigma_2"),
    ),
    "an unknown key with a bracket in it": (
        ("t_end = 1.0", 't_end = 1.0\n"steps[0]" = 1'),
        ("run.steps[0]", "unknown key"),
    ),
    "an unknown key that is called float": (
        ("t_end = 1.0", "t_end = 1.0\nfloat = 1"),
        ("run.float", "unknown key"),
    ),
    "a typo in a measured signal": (
        (
            '"0.1*sin(t)"',
            '{ file = "a.csv", time = { column = "t", unit = "s" }, valeu = { column = "v", '
            'unit = "m/s" } }',
        ),
        ("rig.velocity.valeu", "unknown key", "did you mean 'value'?"),
    ),
    "a record that no rig uses": (
        ("[run]", '[record]\nfile = "a.csv"\ntime = { column = "t", unit = "s" }\n[run]'),
        ("[record]", "rig.kind = 'record'"),
    ),
    "a rig that wants a record": ((RIG, '[rig]\nkind = "record"\n'), ("rig.kind", "[record]")),
    # missing
    "no model": ((MODEL, ""), ("model is missing",)),
    "no rig": ((RIG, ""), ("rig is missing",)),
    "no law": (('law = "signed"\n', ""), ("model.law is missing",)),
    "no kind": (('kind = "GMS"\n', ""), ("model.kind is missing",)),
    "no end": (("t_end = 1.0", ""), ("run.t_end is missing",)),
    "no v_s": ((", v_s = 1e-3", ""), ("model.stribeck.v_s is missing",)),
    "no stiffness": (("k = [100.0, 50.0]\n", ""), ("[model]", "missing k", "preset")),
    # kinds and types
    "an unknown model": (('"GMS"', '"GSM"'), ("model.kind", "'GSM'", "'GMS', 'LuGre'")),
    "an unknown rig": (('"prescribed"', '"perscribed"'), ("rig.kind", "'perscribed'", "'slider'")),
    "an unknown law": (('"signed"', '"singed"'), ("model.law", "'singed'", "'signed' or")),
    "an unknown column of Table I": (
        (MODEL, PAPER.replace("stick-slip", "stickslip")),
        ("model.preset", "'stickslip'", "'non-drifting' or 'stick-slip'"),
    ),
    "an unknown method": (
        ("t_end = 1.0", 't_end = 1.0\nmethod = "rk45"'),
        ("run.method", "'rk45'", "'dp45'", "'LSODA'"),
    ),
    "an unknown picture format": (
        ("figures = []", 'figures = ["jpg"]'),
        ("output.figures", "'jpg'", "'png', 'svg' or 'pdf'"),
    ),
    "text for a number": (("v_c = 1e-6", 'v_c = "1e-6"'), ("model.v_c", "'1e-6'", "number")),
    "text in a list": (("[100.0, 50.0]", '[100.0, "50"]'), ("model.k", "'50'", "number")),
    "a number for a list": (("[100.0, 50.0]", "100.0"), ("model.k", "100.0", "list")),
    "a number for a text": (('"open loop"', "3"), ("title", "3", "string")),
    "true for a number": (("t_end = 1.0", "t_end = true"), ("run.t_end", "True", "number")),
    "a value for a table": ((MODEL, "model = 3\n"), ("model", "3", "table")),
    "a list of tables for a table": (("[rig]", "[[rig]]"), ("rig", "table")),
    "a date for a signal": (('"0.1*sin(t)"', "2020-01-01"), ("rig.velocity", "2020")),
    # numbers
    "NaN": (("v_c = 1e-6", "v_c = nan"), ("model.v_c", "nan", "finite")),
    "an infinite end": (("t_end = 1.0", "t_end = inf"), ("run.t_end", "inf", "finite")),
    "an end before the start": (("t_end = 1.0", "t_end = -1.0"), ("t_end", "-1.0", "later")),
    "no time at all": (("t_end = 1.0", "t_end = 0.0"), ("t_end", "0.0", "later")),
    "a negative step": (
        ("t_end = 1.0", "t_end = 1.0\nstep = -0.1"),
        ("run.step", "-0.1", "greater than 0"),
    ),
    "a step under the clock": (
        ("t_end = 1.0", "t_end = 1.0\nmax_step = 1e-18"),
        ("max_step", "1e-18", "clock"),
    ),
    "no step for a method without error estimate": (
        ("t_end = 1.0", 't_end = 1.0\nmethod = "rk4"'),
        ("method", "'rk4'", "step"),
    ),
    "events per step without a step": (
        ("t_end = 1.0", 't_end = 1.0\nevents = "step"'),
        ("events", "'step'", "max_step"),
    ),
    "a tolerance of 0": (("t_end = 1.0", "t_end = 1.0\nrtol = 0.0"), ("run.rtol", "greater")),
    "a negative stiffness": (
        ("[100.0, 50.0]", "[100.0, -50.0]"),
        ("[model] k", "element 2", "-50.0", "> 0"),
    ),
    "less stiction than friction": (("F_s = 1.5", "F_s = 0.5"), ("F_s", "0.5", "F_s >= F_c")),
    "a mass of 0": (
        ('kind = "prescribed"\nvelocity =', 'kind = "slider"\nmass = 0.0\nforce ='),
        ("[rig] mass", "0.0", "> 0"),
    ),
    "a row a picosecond": (("figures = []", "every = 1e-12"), ("output.every", "1e-12", "rows")),
    "a negative row distance": (("figures = []", "every = -1.0"), ("output.every", "-1.0")),
    # lengths
    "too many C": (("[0.1, 0.1]", "[0.1, 0.1, 0.1]"), ("[model] C", "3 entries", "2 elements")),
    "no elements": (("[100.0, 50.0]", "[]"), ("[model] k", "empty")),
    "too few initial z": (
        ("[output]", "[initial]\nz = [0.0]\n[output]"),
        ("initial", "z", "1 entries", "2 elements"),
    ),
    "an unknown initial state": (
        ("[output]", '[initial]\nstates = ["stick", "slide"]\n[output]'),
        ("'slide'", "'stick', 'slip'"),
    ),
    "an initial velocity of a prescribed motion": (
        ("[output]", "[initial]\nv = 0.1\n[output]"),
        ("initial", "'v'", "0.1", "prescribes"),
    ),
    # forms of parameters
    "preset and parameters": ((MODEL, PAPER + "v_c = 1e-6\n"), ("[model] preset", "remove v_c")),
    "shares that are not everything": (
        (SHARES[0], "C = 2.0\nshares = [0.5, 0.4]"),
        ("[model]", "shares", "0.9", "add up to 1"),
    ),
    "too many shares": (
        (SHARES[0], "C = 2.0\nshares = [0.5, 0.3, 0.2]"),
        ("[model]", "shares", "3 entries", "2 elements"),
    ),
    "a negative share": (
        (SHARES[0], "C = 2.0\nshares = [1.5, -0.5]"),
        ("[model]", "shares", "-0.5", "> 0"),
    ),
    "shares with a list of C": (
        (SHARES[0], "C = [0.1, 0.1]\nshares = [0.5, 0.5]"),
        ("[model] shares", "C as one number"),
    ),
    "one C for all": (("C = [0.1, 0.1]", "C = 2.0"), ("[model] C", "list", "shares")),
    # signals
    "an expression that ends early": (
        ("sin(t)", "sin(t"),
        ("rig.velocity", "'0.1*sin(t'", "column"),
    ),
    "an unknown name": (("sin(t)", "sin(x)"), ("rig.velocity", "column 9", "'x'", "names t")),
    "a name that is an emoji elsewhere": (("0.1*sin(t)", ":warning:"), ("':warning:'",)),
    "a program": (
        ('"0.1*sin(t)"', """'__import__("os").mkdir("pwned")'"""),
        ("rig.velocity", "__import__", "column 1"),
    ),
    "a corner of three numbers": (
        ('"0.1*sin(t)"', "[[0.0, 0.0, 1.0], [1.0, 1.0, 2.0]]"),
        ("rig.velocity", "[0.0, 0.0, 1.0]"),
    ),
    "one corner": (('"0.1*sin(t)"', "[[0.0, 0.1]]"), ("rig.velocity", "[[0.0, 0.1]]", "at least")),
    "no corner": (('"0.1*sin(t)"', "[]"), ("rig.velocity", "[]", "(t, value)")),
    "ramps that go back in time": (
        ('"0.1*sin(t)"', "[[0.0, 0.0], [2.0, 1.0], [1.0, 1.0]]"),
        ("rig.velocity", "2.0", "1.0", "backward"),
    ),
    # sizes
    "a very long expression": (
        ("0.1*sin(t)", "t + " * 50_000 + "x"),
        ("rig.velocity", "t + t + t"),
    ),
    "a very long value of an unknown key": (
        ("t_end = 1.0", f"t_end = 1.0\nend = '{'a' * 100_000}'"),
        ("run.end", "unknown key"),
    ),
    "a deep expression": (("0.1*sin(t)", "(" * 5000 + "t" + ")" * 5000), ("rig.velocity",)),
    "a number of 5000 digits": (("t_end = 1.0", f"t_end = 1{'0' * 5000}"), ()),
    "a key 3000 tables deep": (("[run]", f"{'a.' * 3000}b = 1\n[run]"), ()),
}

# files that are not scenarios
BYTES: dict[str, tuple[bytes, tuple[str, ...]]] = {
    "an empty file": (b"", ("the file is empty",)),
    "only a comment": (b"# later\n", ("the file is empty",)),
    "half a table head": (OPEN_LOOP.replace("[run]", "[run").encode(), ("not valid TOML", "line")),
    "a key twice": ((OPEN_LOOP + "figures = []\n").encode(), ("not valid TOML", "line")),
    "binary": (bytes(range(256)) * 10, ("not UTF-8",)),
    "zeros": (bytes(1000), ("not valid TOML",)),
    "UTF-16": (OPEN_LOOP.encode("utf-16"), ("not UTF-8",)),
    "brackets without end": (b"a = " + b"[" * 5000, ("not valid TOML",)),
    "a line of 2 MB": (b"title = '" + b"a" * 2_000_000 + b"'\n", ("larger than 1000000 bytes",)),
    "YAML": (b"model:\n  kind: GMS\n", ("not valid TOML", "line 1")),
    "JSON": (b'{"model": {"kind": "GMS"}}', ("not valid TOML", "line 1")),
}


@pytest.mark.parametrize("broken", CHANGES)
def test_a_wrong_key_or_value(broken: str, gms_fsm: CommandLine, tmp_path: Path) -> None:
    (old, new), said = CHANGES[broken]
    (tmp_path / "broken.toml").write_text(changed(OPEN_LOOP, old, new), encoding="utf-8")
    answer = gms_fsm("run", tmp_path / "broken.toml", "-o", tmp_path / "out")
    one_message(answer, "broken.toml", *said)
    nothing_written(tmp_path, {"broken.toml"})


@pytest.mark.parametrize("broken", BYTES)
def test_a_file_that_is_not_a_scenario(broken: str, gms_fsm: CommandLine, tmp_path: Path) -> None:
    content, said = BYTES[broken]
    (tmp_path / "broken.toml").write_bytes(content)
    answer = gms_fsm("run", tmp_path / "broken.toml", "-o", tmp_path / "out")
    one_message(answer, "broken.toml", *said)
    nothing_written(tmp_path, {"broken.toml"})


def test_a_file_of_1_GB_is_not_read(gms_fsm: CommandLine, tmp_path: Path) -> None:
    with (tmp_path / "huge.toml").open("wb") as file:
        file.truncate(10**9)
    answer = gms_fsm("run", tmp_path / "huge.toml", "-o", tmp_path / "out")
    one_message(answer, "huge.toml", "larger than 1000000 bytes")
    nothing_written(tmp_path, {"huge.toml"})


def test_a_missing_scenario_or_a_folder(gms_fsm: CommandLine, tmp_path: Path) -> None:
    one_message(gms_fsm("run", tmp_path / "gone.toml"), "gone.toml", "no such file")
    one_message(gms_fsm("run", tmp_path), str(tmp_path), "cannot be read")
    nothing_written(tmp_path, set())


@pytest.mark.parametrize("name", ["a\\u0000b.csv", "a" * 5000 + ".csv", "", ".", "gone.csv"])
def test_a_record_that_cannot_be_found_names_the_scenario_and_the_file(
    name: str, gms_fsm: CommandLine, tmp_path: Path
) -> None:
    signal = f'{{ file = "{name}", time = {{ column = "t", unit = "s" }}, value = {{ column = "x", '
    text = changed(OPEN_LOOP, '"0.1*sin(t)"', signal + 'unit = "m/s" } }')
    (tmp_path / "broken.toml").write_text(text)
    answer = gms_fsm("run", tmp_path / "broken.toml", "-o", tmp_path / "out")
    one_message(answer, "broken.toml", "file = ")
    nothing_written(tmp_path, {"broken.toml"})


def test_an_output_folder_that_cannot_be_made(gms_fsm: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "good.toml").write_text(OPEN_LOOP)
    (tmp_path / "in_the_way").write_text("kept")
    answer = gms_fsm("run", tmp_path / "good.toml", "-o", tmp_path / "in_the_way" / "out")
    one_message(answer, "in_the_way", "choose another folder")
    answer = gms_fsm("run", tmp_path / "good.toml", "-o", tmp_path / "in_the_way")
    one_message(answer, "in_the_way", "choose another folder")
    assert (tmp_path / "in_the_way").read_text() == "kept"
    nothing_written(tmp_path, {"good.toml", "in_the_way"})


def test_an_earlier_result_survives_a_broken_file(gms_fsm: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "good.toml").write_text(OPEN_LOOP)
    (tmp_path / "broken.toml").write_text(changed(OPEN_LOOP, "t_end = 1.0", "t_end = -1.0"))
    assert gms_fsm("run", tmp_path / "good.toml", "-o", tmp_path / "out").code == 0
    before = {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()}
    assert gms_fsm("run", tmp_path / "broken.toml", "-o", tmp_path / "out").code == 2
    assert {path.name: path.read_bytes() for path in (tmp_path / "out").iterdir()} == before


@pytest.mark.parametrize(
    ("velocity", "reached", "why"),
    [
        ("0.1*sqrt(0.5 - t)", 0.4, "not finite"),
        ("exp(1000*t)", 0.6, "not finite"),
        ("9**9**9**9*t", 0.0, "not finite"),
        ("0.1/(t - 0.5)", 0.4, "step size"),
    ],
)
def test_a_run_that_fails_midway_keeps_its_part(
    velocity: str, reached: float, why: str, gms_fsm: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "fails.toml").write_text(changed(OPEN_LOOP, "0.1*sin(t)", velocity))
    answer = gms_fsm("run", tmp_path / "fails.toml", "-o", tmp_path / "out")
    one_message(answer, "fails.toml", why, "t = ", "partial.npz")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"partial.npz", LIST}
    part = Trace.load(tmp_path / "out" / "partial.npz")
    assert len(part) == 0 or reached <= part.t[-1] < 1.0


def test_a_measured_signal_that_is_too_short_keeps_its_part(
    gms_fsm: CommandLine, tmp_path: Path
) -> None:
    signal = '{ file = "own.csv", time = { column = "t", unit = "s" }, value = { column = "x", '
    text = changed(OPEN_LOOP, '"0.1*sin(t)"', signal + 'unit = "mm/s" } }')
    (tmp_path / "short.toml").write_text(text)
    (tmp_path / "own.csv").write_text(sine_table(60))
    answer = gms_fsm("run", tmp_path / "short.toml", "-o", tmp_path / "out")
    one_message(
        answer, "short.toml", "a sampled signal at t = 0.59 s", "t_end = 1.0", "partial.npz"
    )
    assert Trace.load(tmp_path / "out" / "partial.npz").t[-1] == 0.59


# --------------------------------------------------------------------------- the real program
def process(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", "from gms_fsm.app.cli import main; main()", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        check=False,
        env={**os.environ, "COLUMNS": "200", "PYTHONPATH": str(ROOT)},
    )


@pytest.mark.slow
def test_the_program_prints_one_line(tmp_path: Path) -> None:
    (tmp_path / "broken.toml").write_text(changed(OPEN_LOOP, "v_c = 1e-6", "vc = 1e-6"))
    done = process("run", "broken.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.splitlines() == [
        "error: broken.toml: model.vc = 1e-06: unknown key; did you mean 'v_c'? valid here: kind, "
        "law, preset, k, sigma, C, sigma_2, v_c, stribeck, weights, shares"
    ]
    nothing_written(tmp_path, {"broken.toml"})


@pytest.mark.parametrize("change", [("t_end = 1.0", "t_end = -1.0"), ("sin(t)", "sqrt(0.5 - t)")])
def test_the_message_begins_its_own_line_after_the_progress_bar(
    change: tuple[str, str], gms_fsm: CommandLine
) -> None:
    Path("broken.toml").write_text(changed(OPEN_LOOP, *change))
    answer = gms_fsm("run", "broken.toml", "-o", "out")
    assert answer.code == 2
    assert "Traceback" not in answer.err
    assert [line for line in answer.err.splitlines() if line.startswith("error: broken.toml")]


@pytest.mark.filterwarnings("default:published law")
def test_a_warning_of_a_scenario_is_printed_once(gms_fsm: CommandLine) -> None:
    text = changed(OPEN_LOOP, '"signed"', '"published"')
    Path("warns.toml").write_text(changed(text, "F_s = 1.5", "F_s = 1.0"))
    answer = gms_fsm("run", "warns.toml", "-o", "out")
    assert answer.code == 0, answer.err
    assert answer.err.count("never arrests") == 1
