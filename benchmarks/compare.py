"""Compare the speed and error of gms-fsm with other tools and with C loops written for one model.

Rounds are interleaved, because the speed of a computer varies: in each round every contestant runs,
and its time is divided by that of the C loop in the same round. The error is the difference from a
run of gms-fsm at rtol 1e-12, atol 1e-15. Run it with ``make bench``, or

    python benchmarks/compare.py [--quick] [--markdown] [--rounds 15] [section ...]
    python benchmarks/compare.py --write        the tables in docs/{performance,numerics}.md
"""

from __future__ import annotations

import argparse
import ctypes
import datetime
import functools
import gc
import json
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from cases import PROBLEMS, Problem, bank, pulled, servo
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter, StrMethodFormatter
from rivals import PULLED_MASS, RIVALS, Array, Outcome

from gms_fsm import GMS, PulledSlider, Sweep, Trace, prepare, simulate, sweep
from gms_fsm.errors import MissingExtraError, ParameterError
from integrators import elementary
from integrators.machine_code.c99 import c99_text
from integrators.machine_code.front_end.translate import Translator
from integrators.machine_code.front_end.values import NumberValue
from integrators.machine_code.tree import Local
from plots import figures
from plots.style import BLUE, RC, VERMILION

ROOT = Path(__file__).resolve().parents[1]
ROWS = 6001
NONE = np.empty(0)
C_LOOP, COMPILED = "C loop, hand-written for this model", "gms-fsm, compiled"
OWN_LOOP, PREPARED = "... with the elementary functions of gms-fsm", "gms-fsm, prepared"
COMPILER = ["cc", "-O3", "-march=native", "-std=c99", "-ffp-contract=off", "-shared", "-fPIC"]


@dataclass(frozen=True)
class Table:
    """A heading, columns, rows of text, and a note below."""

    title: str
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]
    note: str = ""

    def text(self, markdown: bool) -> str:
        """Return the table as Markdown or as aligned text."""
        lines = [self.head, *self.rows]
        widths = [max(len(line[j]) for line in lines) for j in range(len(self.head))]
        padded = [
            [
                cell.rjust(w) if j else cell.ljust(w)
                for j, (cell, w) in enumerate(zip(line, widths, strict=True))
            ]
            for line in lines
        ]
        if markdown:
            padded.insert(
                1, [("-" * w if j == 0 else "-" * (w - 1) + ":") for j, w in enumerate(widths)]
            )
            body = [f"| {' | '.join(line)} |" for line in padded]
        else:
            body = ["  ".join(line) for line in padded]
        title = f"### {self.title}" if markdown else self.title.upper()
        return "\n".join([title, "", *body, *(["", self.note] if self.note else [])])


# --------------------------------------------------------------------------- contestants
# A tool or an extra that is not installed, or no compiler.
MISSING = (ImportError, MissingExtraError, ParameterError, OSError, subprocess.CalledProcessError)


def ours(problem: Problem, **how: Any) -> Outcome:
    """Build the model, run simulate(), and read the friction of every row."""
    return outcome(problem, simulate(*problem.build(), problem.t_end, **how))


def outcome(problem: Problem, trace: Trace) -> Outcome:
    """Return what is compared of a run, and read its friction."""
    kept, _ = problem.compared(trace)
    log, edges = trace.firings, trace.program.layout.edges
    return Outcome(log.t, log.machine, [edges[k][0] for k in log.edge.tolist()], kept)


def own_functions(folder: Path) -> Path:
    """Write a header that puts the elementary functions of gms-fsm in the place of libm's."""
    translator, names = Translator(), ("exp", "sin", "cos")
    for name in names:
        function = getattr(elementary, name)
        translator.entry(f"own_{name}", function, [NumberValue(Local("f", "x"))])
    lines = [c99_text(translator.module, hidden=True), "#include <math.h>"]
    header = folder / "own_functions.h"
    header.write_text("\n".join([*lines, *(f"#define {name} own_{name}" for name in names), ""]))
    return header


def c_loop(problem: Problem, folder: Path, *, own: bool = False) -> Callable[[Array], Outcome]:
    """Compile the C loop, with libm or with our elementary functions; ctypes calls it."""
    library = folder / f"{Path(problem.source).stem}{problem.define}{own}.so"
    more = [f"-D{problem.define}"] if problem.define else []
    more += ["-include", str(own_functions(folder))] if own else []
    source = str(Path(__file__).with_name(problem.source))
    subprocess.run([*COMPILER, *more, source, "-o", str(library), "-lm"], check=True)
    code = ctypes.CDLL(str(library))
    edges = problem.edges

    def place(array: np.ndarray) -> ctypes.c_void_p:
        return array.ctypes.data_as(ctypes.c_void_p)

    def run(times: Array) -> Outcome:
        t, what = np.empty(4096), np.empty(4096, dtype=np.int32)
        out = np.empty((max(times.size, 1), problem.columns))
        if times.size:
            count = code.run_rows(times.size, place(out), place(t), place(what))
        else:
            count = code.run_end(place(out), place(t), place(what))
        taken = [edges[i] for i in (what[:count] % len(edges)).tolist()]
        return Outcome(t[:count], what[:count] // len(edges), taken, out[:, problem.kept])

    return run


def numba_loop(problem: Problem) -> Callable[[Array], Outcome]:
    """Return the loop for numba, which need not be installed."""
    from numba_loop import numba_loop as loop

    assert problem.case is not None
    return loop(problem.case)


def contestants(
    problem: Problem, folder: Path
) -> Iterator[tuple[str, bool, Callable[[], Outcome]]]:
    """Yield name, whether rows are kept, and a callable; the C loop first."""
    times = np.linspace(0.0, problem.t_end, ROWS)
    made = {
        name: functools.cache(functools.partial(c_loop, problem, folder, own=own))
        for name, own in ((C_LOOP, False), (OWN_LOOP, True))
    }
    if problem.case is not None:
        made["the same loop, by hand for numba"] = functools.cache(
            functools.partial(numba_loop, problem)
        )
    for name, loop in made.items():
        yield name, True, lambda loop=loop: loop()(times)
        yield name, False, lambda loop=loop: loop()(NONE)
    for rows, how in ((True, {"t_eval": times}), (False, {"output": "end"})):
        prepared = prepare(*problem.build(), problem.t_end, **how)
        yield PREPARED, rows, lambda run=prepared: outcome(problem, run())
        for engine in ("compiled", "ifelse", "machines"):
            yield f"gms-fsm, {engine}", rows, functools.partial(ours, problem, engine=engine, **how)
    for name, rival in RIVALS.items() if problem.case is not None else ():
        yield name, True, functools.partial(rival, problem.case, times)
        yield name, False, functools.partial(rival, problem.case, NONE)


# --------------------------------------------------------------------------- scoring
@dataclass(frozen=True)
class Score:
    """What was measured of one contestant: seconds, relative to the C loop, and errors as text."""

    name: str
    rows: bool
    seconds: float
    ratio: float | None
    error: str
    late: str
    transitions: str

    def relative(self) -> str:
        """Return the ratio as text."""
        if self.ratio is None:
            return "-"
        digits = 2 if self.ratio < 10 else 1 if self.ratio < 100 else 0
        return f"{self.ratio:,.{digits}f}"


def errors(found: Outcome, right: Outcome) -> tuple[str, str]:
    """Return the largest errors of z (or x) and of transition times, as text."""
    z, worst = largest(found, right), 0.0
    for i in np.unique(right.element):
        mine, true = np.flatnonzero(found.element == i), np.flatnonzero(right.element == i)
        if [found.edge[m] for m in mine] != [right.edge[m] for m in true]:
            return f"{z:.1e} m", "wrong sequence"
        worst = max(worst, float(np.abs(found.t[mine] - right.t[true]).max()))
    return f"{z:.1e} m", f"{worst:.1e} s"


def largest(found: Outcome, right: Outcome) -> float:
    """Return the largest error of z (or x), m."""
    return float(np.abs(found.z - (right.z if len(found.z) > 1 else right.z[-1:])).max())


def seconds(run: Callable[[], object], calls: int = 1) -> float:
    """Return the time of one call, without looking for garbage, which others may have left."""
    gc.collect()
    gc.disable()
    try:
        start = time.perf_counter()
        for _ in range(calls):
            run()
        return (time.perf_counter() - start) / calls
    finally:
        gc.enable()


def ms(time_s: float) -> str:
    """Return a time as text."""
    value = 1e3 * time_s
    return f"{value:,.0f} ms" if value >= 100 else f"{value:.3g} ms"


def measured(problem: Problem, rounds: int) -> tuple[list[Score], str]:
    """Let all contestants run one problem; return the scores, and who was left out."""
    times = np.linspace(0.0, problem.t_end, ROWS)
    right = ours(problem, t_eval=times, engine="ifelse", rtol=1e-12, atol=1e-15)
    run_of_ours = simulate(*problem.build(), problem.t_end, t_eval=times, engine="compiled")
    assert np.isfinite(problem.compared(run_of_ours)[1]).all()  # the friction
    field, judged, cost, left_out = [], {}, {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for name, rows, run in contestants(problem, Path(folder)):
            try:
                found = run()  # also the warm-up
            except MISSING as error:
                left_out[name] = f" Skipped: {name} ({error})."
                continue
            field.append((name, rows, run))
            judged[name, rows] = (
                *errors(found, right),
                f"{found.t.size} of {problem.transitions}",
            )
            cost[name, rows] = seconds(run)
        gc.collect()
        gc.freeze()  # what is here stays, and is not looked at again
        turns: dict[tuple[str, bool], dict[int, float]] = {key: {} for key in cost}
        for turn in range(rounds):
            for name, rows, run in field:
                one = cost[name, rows]
                if one < 0.3 or turn % 3 == 0:  # slow contestants run in fewer rounds
                    turns[name, rows][turn] = seconds(run, max(1, int(0.1 / one)))
        gc.unfreeze()
    scores = []
    for (name, rows), mine in turns.items():
        base = turns.get((C_LOOP, rows))
        ratio = base and statistics.median(u / base[turn] for turn, u in mine.items())
        median = statistics.median(mine.values())
        scores.append(Score(name, rows, median, ratio or None, *judged[name, rows]))
    return scores, "".join(left_out.values())


def runs(problem: Problem, rounds: int) -> Table:
    """Compare all contestants on one problem."""
    scores, left_out = measured(problem, rounds)
    table = [
        (each.name, f"{ROWS:,} rows" if each.rows else "end", each.relative(), ms(each.seconds),
         each.error, each.late, each.transitions)
        for each in sorted(scores, key=lambda each: not each.rows)
    ]  # fmt: skip
    return Table(
        f"{problem.title}, rtol 1e-6",
        ("", "kept", "time / C", "median", "error", "of times", "transitions"),
        table,
        f"Median of {rounds} interleaved rounds (every third round for runs over 0.3 s), without "
        "garbage collection. Error: "
        "the largest over all rows, or of the end state; rows of gms-fsm and C include friction. "
        "gms-fsm has its default tolerances, the others an atol of 1e-9 (servo: 1e-12). Its time "
        f"is that of the whole call, with building the model.{left_out}",
    )


def equal_error(rounds: int) -> Table:
    """Compare the time at the tolerance from which on our error is at most that of the C loop."""
    table = []
    for problem in PROBLEMS.values():
        times = np.linspace(0.0, problem.t_end, ROWS)
        right = ours(problem, t_eval=times, engine="ifelse", rtol=1e-12, atol=1e-15)
        with tempfile.TemporaryDirectory() as folder:
            loop = c_loop(problem, Path(folder), own=True)
            allowed, rtol = largest(loop(times), right), 1e-9
            for finer in 10.0 ** -np.arange(9.0, 3.9, -0.025):
                run = prepare(*problem.build(), problem.t_end, t_eval=times, rtol=finer)
                if largest(outcome(problem, run()), right) > allowed:
                    break
                rtol = finer
            run = prepare(*problem.build(), problem.t_end, t_eval=times, rtol=rtol)
            ratios = []
            for _ in range(rounds):
                base = seconds(functools.partial(loop, times), 50)
                ratios.append(seconds(lambda: outcome(problem, run()), 50) / base)  # noqa: B023
        table.append(
            (problem.title, f"{allowed:.1e} m", f"{rtol:.1e}", f"{statistics.median(ratios):.2f}")
        )
    return Table(
        "At equal error",
        ("", "error of C", "rtol of gms-fsm", "time / C"),
        table,
        f"Prepared runs, {ROWS:,} rows with friction; C with the elementary functions of gms-fsm, "
        "rtol 1e-6. From the rtol given to 1e-9 no error is larger than that of C.",
    )


# --------------------------------------------------------------------------- how cost grows
def compiled(model: GMS, t_end: float, **how: Any) -> Any:
    """Run the pulled mass with the compiled engine."""
    return simulate(model, PulledSlider(1.0, 2.0, 0.1), t_end, engine="compiled", **how)


def cost(n: int, spread: bool) -> tuple[float, int]:
    """Return the time of a run with n elements, s, and how often an edge fires."""
    run = functools.partial(compiled, bank(n, spread), 12.0, output="end")
    count = len(run().transitions)
    times = max(1, min(20, 3000 // n))
    return min(seconds(run) for _ in range(times)), count


def size(rounds: int) -> Table:
    """Measure the cost as a function of the number of elements."""
    table = []
    for n in (1, 10, 100, 1_000, *([10_000] if rounds > 3 else [])):
        both = [cost(n, spread) for spread in (False, True)]
        cells = [cell for time_s, count in both for cell in (ms(time_s), f"{count:,}")]
        table.append((f"{n:,}", *cells))
    return Table(
        "Cost by number of elements",
        ("elements", "together", "transitions", "spread", "transitions"),
        table,
        'Pulled mass, 12 s (one break-away, one arrest), compiled, `output="end"`. Together: equal '
        "thresholds, all elements switch at one instant. Spread: each switches at its own instant.",
    )


def draw_size() -> None:
    """Write the picture of the cost as a function of the number of elements."""
    numbers = [each * 10**k for k in range(4) for each in (1, 2, 5)] + [10_000]
    with rc_context(RC):
        figure = Figure(figsize=(7.2, 3.2), layout="constrained")
        ax = figure.subplots()
        for spread, said, colour, mark in (
            (True, "elements switch one by one", VERMILION, "s-"),
            (False, "all switch together", BLUE, "o-"),
        ):
            spent = [cost(n, spread)[0] for n in numbers]
            ax.loglog(numbers, spent, mark, color=colour, markersize=4, label=said)
        ax.legend(loc="upper left")
        ax.xaxis.set_major_formatter(StrMethodFormatter("{x:,.0f}"))
        ax.yaxis.set_major_formatter(EngFormatter("s"))
        ax.set(xlabel="elements", ylabel="time of a run", title="Pulled mass, 12 s, compiled")
        ax.grid(alpha=0.3)
    figures.save(figure, ROOT / "docs/images/time_by_elements.png")


def length(rounds: int) -> Table:
    """Measure the cost as a function of the length of the run."""
    model, table = pulled()[0], []
    for t_end in (60.0, 600.0, 6000.0):
        line = [f"{t_end:,.0f} s"]
        for how in ("end", "all"):
            run = functools.partial(compiled, model, t_end, output=how)
            count = len(run().transitions)
            cost = min(seconds(run) for _ in range(min(rounds, 5)))
            line += [ms(cost), f"{1e6 * cost / t_end:.0f} us"]
        table.append((*line, f"{count:,}"))
    return Table(
        "Cost by length of the run",
        ("length", "end", "per second", "all rows", "per second", "transitions"),
        table,
        "Pulled mass, compiled.",
    )


# --------------------------------------------------------------------------- sweeps
def many(count: int, threads: int = 1, **options: Any) -> Sweep:
    """Run the pulled mass with k varied by 20 %, w = 1/(4k)."""
    k = PULLED_MASS.k * np.random.default_rng(1).uniform(0.8, 1.2, (count, 4))
    varied = {"k": k, "weights": 1 / (4 * k)}
    with ThreadPoolExecutor(threads) as executor:
        return sweep(*pulled(), 60.0, varied, executor=executor, **options)


def many_short(count: int, threads: int = 1, **options: Any) -> Sweep:
    """Run the servo with the load varied by 20 %."""
    varied = {"numbers.m_l": np.random.default_rng(1).uniform(0.8, 1.2, count)}
    with ThreadPoolExecutor(threads) as executor:
        return sweep(*servo(), 0.2, varied, executor=executor, **options)


class Rate(NamedTuple):
    """How fast a sweep is, and how many of its runs are wrong."""

    per_second: float
    relative: float  # time of a run on a core, relative to the C loop
    wrong: int
    failed: int


SWEPT = {"pulled": many, "servo": many_short}
# Short runs four times as often, too: a thousand end before a core at rest is at its full speed.
SWEEPS = (("pulled", 1), ("servo", 1), ("servo", 4))


def sweep_rates(name: str, count: int, rounds: int) -> dict[int, Rate]:
    """Return for each number of threads how fast a sweep of one case is."""
    run = SWEPT[name]
    right = run(count, rtol=1e-12, atol=1e-15)
    times: dict[int, list[tuple[float, float]]] = {1: [], 2: []}
    with tempfile.TemporaryDirectory() as folder:
        loop = c_loop(PROBLEMS[name], Path(folder), own=True)
        for _ in range(min(rounds, 5)):
            for threads, mine in times.items():
                base = seconds(lambda: loop(NONE), count)
                mine.append((seconds(lambda n=threads: run(count, n)) / count, base))
    found = {}
    for threads, mine in times.items():
        result = run(count, threads)
        wrong = sum(of_elements(result, each) != of_elements(right, each) for each in range(count))
        failed = int((result.outcome != "ok").sum())
        rate = 1.0 / statistics.median(one for one, _ in mine)
        relative = statistics.median(threads * one / base for one, base in mine)
        found[threads] = Rate(rate, relative, wrong, failed)
    return found


def of_elements(result: Sweep, run: int) -> list[tuple[int, str]]:
    """Return the edges that each element takes; equal ones switch together, in any order."""
    return sorted(result.sequence(run), key=lambda firing: firing[0])


def sweeps(rounds: int) -> Table:
    """Measure how many runs per second a sweep does, and how many of them are wrong."""
    count = runs_in_a_sweep(rounds)
    table = [
        (PROBLEMS[name].title, f"{times * count:,}", f"{n}", f"{rate.per_second:,.0f}",
         f"{rate.relative:.2f}", f"{rate.wrong}", f"{rate.failed}")
        for name, times in SWEEPS
        for n, rate in sweep_rates(name, times * count, rounds).items()
    ]  # fmt: skip
    return Table(
        "Sweeps, end states",
        (
            "",
            "runs",
            "threads",
            "runs per second",
            "time per core / C",
            "wrong sequences",
            "failed",
        ),
        table,
        "Pulled mass: k varied by 20 %, w = 1/(4k); servo: the load by 20 %. rtol 1e-6; reference: "
        "rtol 1e-12. C with the elementary functions of gms-fsm.",
    )


def runs_in_a_sweep(rounds: int) -> int:
    """Return how many runs a sweep has here."""
    return 1000 if rounds > 3 else 200


# --------------------------------------------------------------------------- in child processes
def child(task: str, **environment: str) -> dict[str, float]:
    """Run a task of `TASKS` in its own process."""
    done = subprocess.run(
        [sys.executable, __file__, "--task", task],
        env={**os.environ, **environment},
        check=True,
        capture_output=True,
        text=True,
    )
    result: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return result


def peak() -> float:
    """Return the peak memory of this process, MB; tracemalloc does not see machine code.

    On Linux getrusage's value is inherited from the parent process, so the kernel's value is read.
    """
    status = Path("/proc/self/status")
    if status.exists():
        return float(status.read_text().split("VmHWM:")[1].split()[0]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024**2


def grown(run: Callable[[], object]) -> dict[str, float]:
    """Return the time of a run, and the peak before (warm) and after it, MB."""
    compiled(pulled()[0], 1.0)
    before, took = peak(), seconds(run)
    return {"before": before, "after": peak(), "seconds": took}


def long_run() -> Trace:
    """Return a trace of 800,000 rows."""
    return compiled(pulled()[0], 23_500.0)


def saving(kind: str) -> dict[str, float]:
    """Save the long run to the folder of the measurement."""
    trace = long_run()
    return grown(lambda: trace.save(Path(os.environ["BENCHMARK_FOLDER"], f"run.{kind}")))


def loading(kind: str) -> dict[str, float]:
    """Load what `saving` saved."""
    return grown(lambda: Trace.load(Path(os.environ["BENCHMARK_FOLDER"], f"run.{kind}")))


TASKS: dict[str, tuple[str, Callable[[], dict[str, float]]]] = {
    "run_end": (
        "6,000 s, end state",
        lambda: grown(lambda: compiled(pulled()[0], 6000.0, output="end")),
    ),
    "run_all": (
        "6,000 s, all rows",
        lambda: grown(lambda: compiled(pulled()[0], 6000.0, output="all")),
    ),
    "bank_end": (
        "10,000 elements, 12 s, end state",
        lambda: grown(lambda: compiled(bank(10_000, False), 12.0, output="end")),
    ),
    "sweep_100": ("sweep of 100 runs of 60 s, end states", lambda: grown(lambda: many(100))),
    "sweep_1000": ("sweep of 1,000 runs of 60 s, end states", lambda: grown(lambda: many(1000))),
    "save_npz": ("save .npz", lambda: saving("npz")),
    "load_npz": ("load .npz", lambda: loading("npz")),
    "save_csv": ("save .csv", lambda: saving("csv")),
    "load_csv": ("load .csv", lambda: loading("csv")),
}


def memory(_: int) -> Table:
    """Measure the peak memory of processes that do one task each."""
    table = []
    for task in ("run_end", "run_all", "bank_end", "sweep_100", "sweep_1000"):
        found = child(task)
        grew = found["after"] - found["before"]
        table.append((TASKS[task][0], f"{found['before']:.0f} MB", f"{grew:.1f} MB"))
    return Table(
        "Peak memory, compiled engine",
        ("", "warm process", "increase at peak"),
        table,
        "Pulled mass; the largest resident size of a separate process.",
    )


def files(rounds: int) -> Table:
    """Measure saving and loading a long run."""
    table = []
    with tempfile.TemporaryDirectory() as folder:
        for kind, turns in (("npz", min(rounds, 3)), ("csv", 1)):
            for task in (f"save_{kind}", f"load_{kind}"):
                found = [child(task, BENCHMARK_FOLDER=folder) for _ in range(turns)]
                time_s = statistics.median(each["seconds"] for each in found)
                grew = max(each["after"] - each["before"] for each in found)
                size = sum(path.stat().st_size for path in Path(folder).glob(f"run*{kind}")) / 1e6
                table.append(
                    (TASKS[task][0], f"{time_s:.2f} s", f"{size:.0f} MB", f"{grew:.0f} MB")
                )
    return Table(
        "A long run as a file",
        ("", "time", "size", "increase of memory at peak"),
        table,
        "Pulled mass, 23,500 s: 800,000 rows and 29,000 transitions, each in a separate process.",
    )


# --------------------------------------------------------------------------- starting
NAMES = "from gms_fsm import GMS, GMSParameters, PulledSlider, Stribeck, simulate"
HELP = "import sys; sys.argv[1:] = ['--help']; from gms_fsm.app.cli import main; main()"
STARTS = {
    "Python alone": "pass",
    "import numpy": "import numpy",
    "import gms_fsm": "import gms_fsm",
    "gms-fsm --help": HELP,
    NAMES.replace("GMS, GMSParameters, PulledSlider, Stribeck", "GMS, ..."): NAMES,
}
FIRST = f"""
import sys, time
sys.path.insert(0, {str(Path(__file__).parent)!r})
from cases import pulled
from gms_fsm import simulate
began = time.process_time()
simulate(*pulled(sys.argv[1]), 1.0, engine="compiled", output="end")
print(time.process_time() - began)
"""


def start_times(rounds: int) -> dict[str, float]:
    """Return the processor time of starts and of first compiled runs, s; medians."""
    times: dict[str, list[float]] = {}
    with (
        tempfile.TemporaryDirectory() as codes
    ):  # byte code of all modules, as after an installation
        own = {**os.environ, "PYTHONPYCACHEPREFIX": codes}
        own.pop("PYTHONDONTWRITEBYTECODE", None)

        def python(code: str, cache: str, *arguments: str) -> tuple[float, str]:
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            done = subprocess.run(
                [sys.executable, "-c", code, *arguments],
                env=own | {"GMS_FSM_CACHE": cache},
                check=True,
                capture_output=True,
                text=True,
            )
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            return used, done.stdout

        for turn in range(-1, min(rounds, 7)):  # the first one writes the byte code
            with tempfile.TemporaryDirectory() as cache:
                found = {name: python(code, cache)[0] for name, code in STARTS.items()}
                for name, law in (
                    ("nothing cached", "signed"),
                    ("chart known", "signed"),
                    ("chart new", "published"),
                ):
                    found[f"first compiled run, {name}"] = float(python(FIRST, cache, law)[1])
            for name, used in found.items() if turn >= 0 else ():
                times.setdefault(name, []).append(used)
    return {name: statistics.median(mine) for name, mine in times.items()}


def starts(rounds: int) -> Table:
    """Measure how long it takes until something happens."""
    return Table(
        "Start: processor time",
        ("", "time"),
        [(name, f"{time_s:.3f} s") for name, time_s in start_times(rounds).items()],
        "Each in a fresh process, with the byte code of all modules. First compiled runs: after "
        "the imports above, with building the model and importing llvmlite. Medians of interleaved "
        "rounds.",
    )


SECTIONS: dict[str, Callable[[int], Table]] = {
    **{name: functools.partial(runs, problem) for name, problem in PROBLEMS.items()},
    "equal": equal_error,
    "size": size,
    "length": length,
    "sweeps": sweeps,
    "memory": memory,
    "files": files,
    "starts": starts,
}


# --------------------------------------------------------------------------- in the documents
WIDTH = 118
BEGIN, END = "<!-- measured table: begin", "<!-- measured table: end -->"
SHOWN = (
    *(C_LOOP, OWN_LOOP, PREPARED, COMPILED, "the same loop, by hand for numba"),
    *("gms-fsm, machines", *RIVALS),
)


def documents(rounds: int) -> dict[str, str]:
    """Return what docs/performance.md and docs/numerics.md say, measured here."""
    scores = {name: measured(problem, rounds)[0] for name, problem in PROBLEMS.items()}
    rows = {name: {each.name: each for each in mine if each.rows} for name, mine in scores.items()}
    titles = [PROBLEMS[name].title.rpartition(",")[0] for name in rows]
    loops = ", ".join(ms(mine[C_LOOP].seconds) for mine in rows.values())
    table = [
        (name, *(cell for mine in rows.values() for cell in _cells(mine.get(name))))
        for name in SHOWN
    ]
    head = ("", *(cell for title in titles for cell in (title, "error")))
    equal, many_runs = equal_error(rounds), sweeps(rounds)
    began = {name.rpartition(", ")[2]: time_s for name, time_s in start_times(rounds).items()}
    performance = [
        textwrap.fill(
            "Run time relative to C loops written and tuned by hand for each model "
            f"({ROWS:,} rows with friction, rtol 1e-6; {loops}), and the largest error relative to "
            "a run at rtol 1e-12. Building the model is included, except where it is prepared:",
            WIDTH,
        ),
        "",
        *markdown(head, table),
        "",
        textwrap.fill(
            f"{equal.title}. {equal.note}",
            WIDTH,
        ),
        "",
        *markdown(equal.head, equal.rows),
        "",
        textwrap.fill(f"{many_runs.title}. {many_runs.note}", WIDTH),
        "",
        *markdown(many_runs.head, many_runs.rows),
        "",
        textwrap.fill(
            "The first compiled run of a process takes "
            f"{began['chart known']:.2f} s for a known chart, {began['chart new']:.1f} s for a new "
            f"one, and {began['nothing cached']:.1f} s the first time on a machine. `make bench`, "
            f"{machine()}; medians of interleaved rounds, without garbage collection.",
            WIDTH,
        ),
    ]
    both = [PROBLEMS[name] for name in ("pulled", "open")]
    numerics = markdown(
        ("error of", *(cell for one in both for cell in (one.title, "times"))),
        [
            (name, *(cell for one in ("pulled", "open") for cell in _accuracy(rows[one].get(name))))
            for name in SHOWN
        ],
    )
    return {
        "docs/performance.md": "\n".join(performance),
        "docs/numerics.md": "\n".join([*numerics, "", textwrap.fill(machine(), WIDTH)]),
    }


def _cells(score: Score | None) -> tuple[str, str]:
    return ("", "") if score is None else (score.relative(), score.error)


def _accuracy(score: Score | None) -> tuple[str, str]:
    return ("", "") if score is None else (score.error, score.late)


def markdown(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    """Return the lines of a table for a document."""
    return Table("", head, rows).text(markdown=True).splitlines()[2:]


def write(rounds: int) -> None:
    """Replace what is between the marks in the documents."""
    for name, text in documents(rounds).items():
        replace(name, text)
    draw_size()


def replace(name: str, text: str) -> None:
    """Replace what is between the marks in a document."""
    path = ROOT / name
    before, begin, rest = path.read_text(encoding="utf-8").partition(BEGIN)
    mark, _, rest = rest.partition("\n")
    _, end, after = rest.partition(END)
    path.write_text(f"{before}{begin}{mark}\n\n{text}\n\n{end}{after}", encoding="utf-8")
    print(f"{name} has new tables")


def machine(*others: str) -> str:
    """Return date, processor and versions in one line; others are further packages."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        cpu = names[0].split(":")[1].strip() if names else cpu
    packages = [f"{name} {version(name)}" for name in ("numpy", "scipy")]
    for name in others or ("llvmlite", "numba", "scikit-sundae", "pathsim"):
        try:
            packages.append(f"{name} {version(name)}")
        except ModuleNotFoundError:
            packages.append(f"no {name}")
    python = f"Python {platform.python_version()}"
    today = datetime.date.today().isoformat()
    return ", ".join([today, f"{cpu} ({os.cpu_count()} cores)", python, *packages])


def main() -> None:
    """Print the requested sections, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sections", nargs="*", help=f"{', '.join(SECTIONS)}; default: all")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--quick", action="store_true", help="3 rounds, no bank of 10,000")
    parser.add_argument("--markdown", action="store_true", help="tables as Markdown")
    parser.add_argument(
        "--write",
        action="store_true",
        help="replace the tables in docs",
    )
    parser.add_argument("--task", choices=TASKS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    for name in set(options.sections) - set(SECTIONS):
        parser.error(f"no section {name!r}; there are {', '.join(SECTIONS)}")
    if options.task:
        print(json.dumps(TASKS[options.task][1]()))
        return
    rounds = 3 if options.quick else options.rounds
    if options.write:
        write(rounds)
        return
    print(machine())
    for name in options.sections or SECTIONS:
        try:
            table = SECTIONS[name](rounds)
        except MISSING as error:
            print(f"\n{name} skipped: {getattr(error, 'stderr', None) or error}")
            continue
        print("\n" + table.text(options.markdown), flush=True)


if __name__ == "__main__":
    main()
