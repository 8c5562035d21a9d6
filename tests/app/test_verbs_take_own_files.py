"""Every verb takes the user's own chart, system and scenario files, without Python."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from gms_fsm import Chart, Parameter, State, Sweep, System, Trace
from gms_fsm.app._own_files import OwnFile
from gms_fsm.app.scenario import (
    kind_of,
    load_scenario,
    load_system,
    run_debugger,
)
from gms_fsm.lowering.program import lower
from gms_fsm.systems.any_model import any_model
from tests import own_files
from tests.plots.stored import data_of
from tests.scenario_files import CommandLine, one_message


@pytest.fixture
def verb(gms_fsm: CommandLine, tmp_path: Path) -> CommandLine:
    """``gms-fsm`` in a folder with the files."""
    own_files.write(tmp_path)
    return gms_fsm


# --------------------------------------------------------------------------- charts
def test_chart_draws_a_chart_file(verb: CommandLine) -> None:
    assert verb("chart", "own.toml", "-o", "own.dot").out == "own.dot\n"
    assert "F &gt; F_s" in Path("own.dot").read_text()
    assert verb("chart", "./own.toml", "-o", "own.svg").code == 0


def test_chart_draws_the_chart_of_a_contact(verb: CommandLine) -> None:
    assert verb("chart", "pair.toml", "--contact", "gear", "-o", "gear.dot").code == 0
    assert "gap" in Path("gear.dot").read_text()
    assert verb("chart", "pulled.toml", "-o", "only.dot").code == 0


@pytest.mark.slow
def test_check_proves_the_chart_of_every_contact_once(verb: CommandLine) -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    both, one = verb("check", "pair.toml"), verb("check", "pair.toml", "--contact", "pad2")
    assert (both.code, one.code) == (0, 0)
    pads = one.out.removeprefix("contact pad2:\n")
    assert both.out.startswith(f"contact pad1, pad2:\n{pads}\ncontact gear:\nBacklash")
    assert both.out.count("0 refuted") == 2
    assert (
        "undecided  the chart: switches of other contacts at the same instant are not followed"
        in pads
    )


def test_check_refutes_a_chart_file_by_a_counterexample(verb: CommandLine) -> None:
    pytest.importorskip("z3", reason="needs z3 (extra: check)")
    text = own_files.STICTION.replace('rule = ">= F_c"\n', "")
    Path("own.toml").write_text(text)
    done = verb("check", "pulled.toml")
    assert done.code == 1
    assert "F_s = -1" in done.out


@pytest.mark.slow
def test_code_of_a_chart_file_runs(verb: CommandLine) -> None:
    done = verb("code", "own.toml", "--rig", "slider")
    assert done.code == 0, done.err
    names: dict[str, object] = {}
    exec(done.out, names)
    assert {"switch", "act", "flow", "RELEASE_FORWARD"} & set(names)


def test_code_of_a_system_is_its_program(verb: CommandLine) -> None:
    done = verb("code", "pair.toml")
    assert lower(load_system("pair.toml")).source.splitlines()[-1] in done.out
    exec(done.out, {})


def test_blocks_draws_the_system(verb: CommandLine) -> None:
    assert verb("blocks", "pair.toml", "-o", "pair.dot").code == 0
    drawn = Path("pair.dot").read_text()
    assert all(f"-{name}" in drawn for name in ("pad1", "pad2", "gear", "controller", "w", "i"))


# --------------------------------------------------------------------------- runs
def test_run_writes_what_every_contact_did(verb: CommandLine) -> None:
    sets = ("--set", "output.csv=true", "--set", "output.every=0.5")
    done = verb("run", "pair.toml", *sets, "--live", "-o", "out")
    assert done.code == 0, done.err
    assert all(f"{name}   t = " in done.err for name in ("pad1", "pad2", "gear"))
    summary = Path("out/summary.md").read_text()
    for head in ("# pair", "## Contact pad1: stiction", "## Contact pad2", "## Contact gear"):
        assert f"{head}" in summary, head
    assert "| one (x1, v1) |" in summary
    assert "| i | u |" in summary
    trace = Trace.load("out/trace.npz")
    assert trace.contacts == ("pad1", "pad2", "gear")
    assert f"{len(trace.transitions)} transitions; 4 files in out\n" in done.out
    assert trace.t.tolist() == [0.5 * k for k in range(25)]
    assert trace.body("one").x[0] == 1e-3
    assert trace.value("i")[0] == 0.01
    assert "gear.F" in Path("out/trace.csv").read_text().splitlines()[1]


def test_set_changes_a_part_by_name_or_index(verb: CommandLine) -> None:
    assert verb("run", "pulled.toml", "-o", "a").code == 0
    assert Trace.load("a/trace.npz").transitions.t[0] == pytest.approx(7.5)
    changes = ("body.mass.inertia=2.0", "contact.0.values.F_s=2.0", "numbers.K=4.0")
    options = [word for each in changes for word in ("--set", each)]
    assert verb("run", "pulled.toml", "-o", "a", *options).code == 0
    found = Trace.load("a/trace.npz")
    assert found.transitions.t[0] == pytest.approx(2.0 / (4.0 * 0.1))
    assert found.system is not None
    assert found.system.body("mass").inertia == 2.0


def test_a_bare_system_file_runs_when_it_is_told_how_long(verb: CommandLine) -> None:
    Path("bare.toml").write_text(own_files.PULLED)
    one_message(verb("run", "bare.toml"), "bare.toml: run.t_end is missing", "--set run.t_end=")
    quiet = ("--set", "output.figures=[]")
    assert verb("run", "bare.toml", "--set", "run.t_end=8", *quiet, "-o", "out").code == 0
    assert System.load("bare.toml").name == "pulled mass"


@pytest.mark.slow
def test_sweep_varies_numbers_and_contacts(verb: CommandLine) -> None:
    axes = ("--over", "numbers.K=2:4:2", "--over", "pad2.F_s=0.3:0.4:2", "--engine", "ifelse")
    assert verb("sweep", "pair.toml", *axes, "-o", "out").code == 0
    found = Sweep.load("out/sweep.npz")
    assert found.parameters["numbers.K"].tolist() == [2.0, 2.0, 4.0, 4.0]
    assert found.contacts == ("pad1", "pad2", "gear")
    assert "| numbers.K | pad2.F_s [N] |" in Path("out/summary.md").read_text()


# --------------------------------------------------------------------------- saved traces
@pytest.mark.slow
@pytest.mark.parametrize("name", ["plot", "animate"])
def test_a_picture_shows_one_contact(name: str, verb: CommandLine) -> None:
    load_scenario("pair.toml").simulate(engine="ifelse").save("run.npz")
    said = ("run.npz: it has the contacts 'pad1', 'pad2', 'gear'", "--contact pad1")
    one_message(verb(name, "run.npz"), *said)
    one_message(verb(name, "run.npz", "--contact", "pad"), "run.npz: there is no contact 'pad'")


@pytest.mark.slow
def test_replay_shows_all_contacts_or_the_chosen_one(verb: CommandLine) -> None:
    pytest.importorskip("uplot", reason="a page needs the extra 'replay'")
    load_scenario("pair.toml").simulate(engine="ifelse").save("run.npz")
    done = verb("replay", "run.npz", "-o", "all.html")
    assert done.code == 0, done.err
    (run,) = data_of(Path("all.html").read_text(encoding="utf-8"))["runs"]
    assert [each["name"] for each in run["contacts"]] == ["pad1", "pad2", "gear"]
    one_message(verb("replay", "run.npz", "--contact", "pad"), "run.npz: there is no contact 'pad'")
    done = verb("replay", "run.npz", "--contact", "gear", "-o", "page.html")
    assert done.code == 0, done.err
    assert "gear: Backlash" in Path("page.html").read_text(encoding="utf-8")


def test_debug_steps_through_a_system(verb: CommandLine) -> None:
    out = io.StringIO()
    loaded = load_scenario("pair.toml", ["run.t_end=9.0"])
    assert run_debugger(loaded, io.StringIO("next\nwhy pad1 1\nquit\n"), out) == 0
    assert "pad1 1: stuck -> forward by release_forward" in out.getvalue()
    assert "error" not in out.getvalue()


def test_monitors_of_a_system_and_a_file_without_a_run(tmp_path: Path) -> None:
    own_files.write(tmp_path)
    loaded = load_scenario(tmp_path / "pair.toml", ["run.monitors=['coverage']"])
    assert loaded.arguments["monitors"] == ("coverage",)
    assert not OwnFile(tmp_path / "own.toml").run
    assert kind_of({}) == ""


def test_a_model_with_some_numbers_keeps_the_rules_of_its_chart() -> None:
    chart = Chart(
        "ruled",
        ("v",),
        parameters=(Parameter("a", rule="> 5"), Parameter("b", rule="< 0")),
        states=(State("on"),),
        outputs={"F": "a * b * v"},
    )
    values = any_model(chart).values
    assert values["a"] > 5.0
    assert values["b"] < 0.0
