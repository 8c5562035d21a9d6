"""What fuzzing has found once is refused in words, or works, in bounded time and memory.

Each case is an input that raised something undocumented, took minutes or took all memory before it
was mended. Work is counted in calls, so that no clock decides.
"""

from __future__ import annotations

import io
import json
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Chart, ChartModel, Prescribed, State, Stribeck, Trace, Transition, simulate
from gms_fsm.app.records import Column, motion_of, read_record
from gms_fsm.app.scenario import load_scenario
from gms_fsm.app.units import convert_numbers
from gms_fsm.errors import (
    ExpressionError,
    ParameterError,
    RecordError,
    ScenarioError,
    SignalError,
    TraceFileError,
)
from gms_fsm.language import evaluate, names_in, parse_condition, parse_value, spell
from gms_fsm.systems.gms_parameters import GMSParameters
from gms_fsm.systems.signals import as_signal
from gms_fsm.traces.trace import dwell_times
from tests.helpers import stick_slip
from tests.scenario_files import MEASURED, OPEN_LOOP, changed, sine_table, table

LONG = "x" * 50_000


def calls_of(work: Callable[[], object]) -> int:
    """Return how many Python functions were called; give up at a million."""
    count = 0

    def look(_frame: Any, what: str, _argument: Any) -> None:
        nonlocal count
        count += what == "call"
        assert count < 1_000_000, "work without end"

    sys.setprofile(look)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


# --------------------------------------------------------------------------- expressions
@pytest.mark.parametrize("power", ["2", "8", "9", "0.5", "-3"])
def test_powers_of_powers_cost_no_more_than_their_length(power: str) -> None:
    """They once doubled the work with each level: 50 levels would have taken years."""
    text = "(" * 50 + "v" + f")**{power}" * 50

    def read() -> None:
        tree = parse_value(text, ["v"])
        assert names_in(tree) == {"v"}
        assert len(spell(tree)) < 100 * len(text)
        assert evaluate(tree, {"v": 1.0}) == 1.0

    assert calls_of(read) < 100_000


def test_exponents_count_as_part_of_what_is_multiplied() -> None:
    """64 copies of a power whose exponent holds 64 copies of a power ...: a line made gigabytes."""
    text = "v"
    for _ in range(9):
        text = f"((v**({text} + z))**8)**8"
    tree = parse_value(text, ["v", "z"])
    assert len(spell(tree)) < 100 * len(text)
    assert evaluate(tree, {"v": 1.0, "z": 0.0}) == 1.0


@pytest.mark.parametrize("function", ["min", "max"])
def test_many_arguments_inside_many_arguments_count_as_depth(function: str) -> None:
    """min(a, b, c) is min(min(a, b), c): 50 in 50 in 50 is too deep for every later reader."""
    text = "v"
    for _ in range(40):
        text = f"{function}({text}{', v' * 48})"
    with pytest.raises(ExpressionError, match="nested too deeply"):
        parse_value(text, ["v"])
    one = parse_value(f"{function}({', '.join('v' * 50)})", ["v"])
    assert evaluate(one, {"v": 2.0}) == 2.0


@pytest.mark.parametrize("text", [LONG[:9000], f"{LONG[:9000]}(v)", f"'{LONG[:9000]}'"])
def test_a_long_name_does_not_make_a_long_message(text: str) -> None:
    for parse in (parse_value, parse_condition):
        with pytest.raises(ExpressionError) as caught:
            parse(text, ["v"])
        assert len(str(caught.value)) < 1000


# --------------------------------------------------------------------------- numbers
@pytest.mark.parametrize("number", [10**400, -(10**400)])
def test_whole_numbers_that_no_float_holds_are_refused(number: int) -> None:
    with pytest.raises(ParameterError, match="F_s: too large a number"):
        Stribeck(1.0, number, 1.0)
    with pytest.raises(ParameterError, match=r"k.*too large a number"):
        GMSParameters([number], [0], [1], sigma_2=0, stribeck=Stribeck(1, 1, 1), v_c=1e-6)
    with pytest.raises(ParameterError, match="t_end: too large a number"):
        simulate(stick_slip("signed"), Prescribed("0"), number)
    for given in (number, [(0, number), (1, 0)], ([0, 1], [0, number])):
        with pytest.raises(SignalError):
            as_signal(given)  # type: ignore[arg-type]


def test_long_values_do_not_make_long_messages() -> None:
    wrong: list[Any] = ["x"] * 100_000
    with pytest.raises(ParameterError) as refused:
        Stribeck(wrong, 1.0, 1.0)  # type: ignore[arg-type]
    with pytest.raises(ParameterError) as also_refused:
        GMSParameters(wrong, [0], [1], sigma_2=0, stribeck=Stribeck(1, 1, 1), v_c=1e-6)
    with pytest.raises(SignalError) as no_signal:
        as_signal(wrong)
    for caught in (refused, also_refused, no_signal):
        assert len(str(caught.value)) < 500


# --------------------------------------------------------------------------- records
def record(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "own.csv"
    path.write_text(text, encoding="utf-8")
    return path


COLUMNS = {"time": Column("t", "s"), "position": Column("x", "mm"), "force": Column("F", "N")}


def test_a_condition_that_cannot_be_computed_is_refused(tmp_path: Path) -> None:
    path = record(tmp_path, sine_table())
    with pytest.raises(RecordError, match="cannot be computed"):
        read_record(path, COLUMNS, where="sqrt(force) > 1 N")  # force is negative now and then


def test_a_number_with_an_exponent_is_a_number_without_a_unit() -> None:
    """2e3 was read as 2 with the unit e3."""
    assert convert_numbers("force > 2e3") == "force > 2e3"
    assert float(convert_numbers("force > 2e3 mN").rpartition(">")[2]) == 2.0
    assert float(convert_numbers("time < 1.5E-1min").rpartition("<")[2]) == 9.0


def test_a_number_of_many_digits_is_read_once(tmp_path: Path) -> None:
    """Its digits were given back one by one, and read again each time: hours for 500 kB."""
    path = record(tmp_path, sine_table())
    with pytest.raises(RecordError, match="where"):
        read_record(path, COLUMNS, where="1" * 500_000)


@pytest.mark.parametrize("scale", [1e200, 1e300, 1e308])
def test_positions_too_large_for_a_motion_are_refused(scale: float, tmp_path: Path) -> None:
    t = np.arange(50) * 0.01
    path = record(tmp_path, table(["t", "x"], t, scale * np.sin(t)))
    columns = {"time": Column("t", "s"), "position": Column("x", "m")}
    try:
        motion = motion_of(read_record(path, columns))
    except RecordError as error:
        refused: RecordError | None = error
    else:
        refused = None
        assert np.isfinite(motion.velocity).all()
    assert refused is None or "outliers" in str(refused)
    assert (refused is None) == (scale < 1e308)


@pytest.mark.parametrize("change", ["column", "unit", "cell", "head"])
def test_long_cells_do_not_make_long_messages(change: str, tmp_path: Path) -> None:
    text, columns = sine_table(), dict(COLUMNS)
    if change == "column":
        columns["force"] = Column(LONG, "N")
    elif change == "cell":
        text = text.replace("0.01,", f"{LONG},", 1)
    elif change == "head":
        text = text.replace("F", LONG, 1)
    if change == "unit":
        scenario = changed(MEASURED, 'unit = "N"', f'unit = "{LONG}"')
        (tmp_path / "rig.toml").write_text(scenario)
        record(tmp_path, text)
        with pytest.raises(ScenarioError) as caught:
            load_scenario(tmp_path / "rig.toml")
        assert len(str(caught.value)) < 2000
        return
    with pytest.raises(RecordError) as refused:
        read_record(record(tmp_path, text), columns)
    assert len(str(refused.value)) < 2000


# --------------------------------------------------------------------------- scenarios
def load(tmp_path: Path, text: str, *overrides: str) -> Any:
    path = tmp_path / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return load_scenario(path, overrides)


@pytest.mark.parametrize(
    "line",
    [
        "a." * 300_000 + "a = 1",
        '"a".' * 200_000 + "a = 1",
        "'a' . " * 100_000 + "a = 1",
        "[" + "a." * 300_000 + "a]",
        "k = { " + "a." * 300_000 + "a = 1 }",
    ],
    ids=["bare", "quoted", "spaced", "head", "inline"],
)
def test_a_key_without_end_is_refused(line: str, tmp_path: Path) -> None:
    """tomllib's work grows with the square of a key's parts: 5,000 took 2 s and 150 MB."""
    with pytest.raises(ScenarioError, match=r"line 2: a key of more than 20 parts"):
        load(tmp_path, f"\n{line}\n")


def test_such_a_key_is_refused_on_the_command_line_too(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="no key is nested this deeply"):
        load(tmp_path, OPEN_LOOP, "title={" + "a." * 50_000 + "a=1}")


def test_dots_in_texts_and_numbers_are_not_keys(tmp_path: Path) -> None:
    numbers = ", ".join(f"[{i}.5, 0.1]" for i in range(100))
    text = changed(OPEN_LOOP, '"0.1*sin(t)"', f"[{numbers}]")
    text = changed(text, '"open loop"', '"1. Here. And so on ... e.g. v.i.z. a.b.c/d.e.f"')
    assert load(tmp_path, text).title.startswith("1. Here.")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('kind = "GMS"', f'kind = "{LONG}"'),
        ('law = "signed"', f'law = "{LONG}"'),
        ('title = "open loop"', f'"{LONG}" = 1'),
    ],
    ids=["kind", "law", "key"],
)
def test_long_values_in_a_file_do_not_make_long_messages(
    old: str, new: str, tmp_path: Path
) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(tmp_path, changed(OPEN_LOOP, old, new))
    assert len(str(caught.value)) < 2000


@pytest.mark.parametrize("override", [LONG, f"{LONG}=1", f"model.{LONG}.a=1", f"title.{LONG}=1"])
def test_long_overrides_do_not_make_long_messages(override: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as caught:
        load(tmp_path, OPEN_LOOP, override)
    assert len(str(caught.value)) < 2000


@pytest.mark.parametrize("every", ["5e-324", "1e-300", "1e-9"])
def test_rows_too_close_together_are_refused(every: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="use a larger value"):
        load(tmp_path, OPEN_LOOP, f"output.every={every}")


def test_rows_of_a_run_that_ends_before_it_starts(tmp_path: Path) -> None:
    """It is the run that is refused, when it starts; the rows are no matter."""
    loaded = load(tmp_path, OPEN_LOOP, "run.t_start=1e9", "output.every=1e-9")
    with pytest.raises(ParameterError, match="t_end must be later"):
        simulate(loaded.model, loaded.rig, **loaded.arguments)


# --------------------------------------------------------------------------- trace files
@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("saved") / "run.npz"
    simulate(stick_slip("signed"), Prescribed("0.3"), 3.0).save(path)
    return path.read_bytes()


def rewritten(saved: bytes, path: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    with np.load(io.BytesIO(saved)) as file:
        arrays = dict(file)
    change(arrays)
    with path.open("wb") as out:
        np.savez(out, **arrays)
    return path


def test_a_trace_without_rows_is_refused(saved: bytes, tmp_path: Path) -> None:
    def empty(arrays: dict[str, Any]) -> None:
        for name in list(arrays):
            if name not in ("header", "transitions"):
                arrays[name] = arrays[name][:0]

    with pytest.raises(TraceFileError, match=r"run\.npz: the file has no rows"):
        Trace.load(rewritten(saved, tmp_path / "run.npz", empty))


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("edge", "nowhere"),
        ("source", "slip"),
        ("target", "x"),
        ("t", np.nan),
        ("t", 9e9),
        ("t", -1.0),
    ],
)
def test_a_log_that_the_chart_cannot_have_written_is_refused(
    column: str, value: Any, saved: bytes, tmp_path: Path
) -> None:
    """It broke the table of dwell times, and the explanation of a row."""

    def change(arrays: dict[str, Any]) -> None:
        arrays["transitions"][column][1] = value

    with pytest.raises(TraceFileError, match=r"run\.npz: the transition log|run\.npz: rows micro"):
        Trace.load(rewritten(saved, tmp_path / "run.npz", change))


@pytest.mark.parametrize("microstep", [-1, 9, 2**40])
def test_microsteps_without_firings_are_refused(
    microstep: int, saved: bytes, tmp_path: Path
) -> None:
    def change(arrays: dict[str, Any]) -> None:
        arrays["rows_microstep"][-1] = microstep

    with pytest.raises(TraceFileError, match="microstep"):
        Trace.load(rewritten(saved, tmp_path / "run.npz", change))


def test_a_trace_that_does_not_name_its_engine_can_be_sampled(saved: bytes, tmp_path: Path) -> None:
    def change(arrays: dict[str, Any]) -> None:
        header = json.loads(str(arrays["header"]))
        header["settings"] = {}
        arrays["header"] = np.array(json.dumps(header))

    trace = Trace.load(rewritten(saved, tmp_path / "run.npz", change))
    assert len(trace.sample([0.5, 1.0]).columns()["F"]) == 2
    assert dwell_times(trace).sum() == pytest.approx(12.0)


@pytest.mark.parametrize("value", [1e308, np.inf, np.nan])
def test_beyond_the_largest_float_samples_are_not_finite(
    value: float, saved: bytes, tmp_path: Path
) -> None:
    def change(arrays: dict[str, Any]) -> None:
        for name in ("rows_y", "stops_y"):
            arrays[name][1::2] = value
            arrays[name][::2] = -value

    trace = Trace.load(rewritten(saved, tmp_path / "run.npz", change))
    sampled = trace.sample(np.linspace(0.1, 2.9, 5))
    assert not np.isfinite(sampled.z).all()


@pytest.mark.parametrize("name", ["header", "rows_t", "rows_y", "transitions", "observed_F"])
def test_an_array_that_unpacks_to_a_thousand_times_its_size_is_refused(
    name: str, saved: bytes, tmp_path: Path
) -> None:
    """Half a megabyte of file took half a gigabyte of memory."""
    path, head = tmp_path / "run.npz", io.BytesIO()
    shape, kind = ((), "<U40000000") if name == "header" else ((20_000_000,), "<f8")
    np.lib.format.write_array_header_1_0(
        head, {"descr": kind, "fortran_order": False, "shape": shape}
    )
    with (
        zipfile.ZipFile(io.BytesIO(saved)) as old,
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new,
    ):
        for member in old.namelist():
            with new.open(member, "w") as file:
                if member != f"{name}.npy":
                    file.write(old.read(member))
                    continue
                file.write(head.getvalue())
                for _ in range(160):
                    file.write(bytes(1_000_000))
    assert path.stat().st_size < 1_000_000
    with pytest.raises(TraceFileError, match=rf"run\.npz: {name} unpacks to 160"):
        Trace.load(path)


def test_a_long_run_at_rest_is_no_such_array(tmp_path: Path) -> None:
    """All but the times of such a trace packs a thousandfold, and it must load."""
    trace = simulate(stick_slip("signed"), Prescribed("0"), 1.0, t_eval=np.linspace(0, 1, 300_000))
    path = trace.save(tmp_path / "run.npz")
    assert Trace.load(path).z.shape == (300_000, 4)


@pytest.mark.parametrize("name", ["a\0b", "a\nb", "<>", '"""', "\u202e"])
def test_any_name_of_a_chart_can_be_run(name: str) -> None:
    """Python takes no null character in a file name, which the generated text is given."""
    states = State("a", {"z": "v"}), State("b", {"z": "0"})
    edge = Transition("e", "a", "b", "z >= s")
    chart = Chart(name, ("v", "s"), ("z",), (), states, (edge,), {"F": "z"})
    model = ChartModel(chart, {}, n=1, stribeck=Stribeck(1, 1.5, 1e-3))
    for engine in ("machines", "ifelse"):
        assert len(simulate(model, Prescribed("1"), 2.0, engine=engine).transitions) == 1


@pytest.mark.parametrize(
    "text",
    [
        "z >= s" + " >= v" * 1500,
        " or ".join(["z >= s"] * 600),
        " and ".join(["(" + " or ".join(["z < s"] * 20) + ")"] * 20),
    ],
    ids=["chain", "row", "groups"],
)
def test_hundreds_of_comparisons_are_refused(text: str) -> None:
    """The program that watches each of them on its own was too deep for Python to compile."""
    with pytest.raises(ExpressionError, match="too many comparisons"):
        parse_condition(text, ["z", "s", "v"])


def test_a_hundred_comparisons_run() -> None:
    guard = " or ".join(f"z >= s + {i}" for i in range(50)) + " or z" + " >= s" * 50
    states = State("a", {"z": "v"}), State("b", {"z": "0"})
    edge = Transition("e", "a", "b", guard)
    chart = Chart("long", ("v", "s"), ("z",), (), states, (edge,), {"F": "z"})
    model = ChartModel(chart, {}, n=1, stribeck=Stribeck(1, 1.5, 1e-3))
    for engine in ("machines", "ifelse"):
        assert len(simulate(model, Prescribed("1"), 2.0, engine=engine).transitions) == 1
