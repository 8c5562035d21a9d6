"""Compare the speed and error of gms-fsm with other tools and with a C loop for one model.

Rounds are interleaved, because the speed of a computer varies: in each round every contestant runs,
and its time is divided by that of the C loop in the same round. The error is the difference from a
run of gms-fsm at rtol 1e-12, atol 1e-15. Run it with ``make bench``, or

    python benchmarks/compare.py [--quick] [--markdown] [--rounds 15] [section ...]
"""

from __future__ import annotations

import argparse
import ctypes
import datetime
import functools
import json
import os
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from rivals import EDGES, OPEN_LOOP, PULLED_MASS, RIVALS, Array, Case, Outcome

from gms_fsm import (
    GMS,
    GMSParameters,
    Prescribed,
    PulledSlider,
    Stribeck,
    Sweep,
    simulate,
    sweep,
)
from gms_fsm.errors import MissingExtraError, ParameterError
from gms_fsm.run._compiled_run import CompiledRun
from gms_fsm.run.settings import Settings
from gms_fsm.run.start import Start

ROWS = 6001
NONE = np.empty(0)
C_LOOP = "C loop, hand-written for this model"
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


def model_and_rig(case: Case) -> tuple[GMS, Any]:
    """Return a case as a gms-fsm model and rig."""
    parameters = GMSParameters(
        case.k,
        case.sigma,
        case.C,
        sigma_2=case.sigma_2,
        v_c=case.v_c,
        weights=case.w,
        stribeck=Stribeck(case.F_c, case.F_s, case.v_s),
    )
    rig = Prescribed(case.signal) if case.signal else PulledSlider(1.0, 2.0, 0.1)
    return GMS(parameters, law="signed"), rig


def ours(case: Case, **how: Any) -> Outcome:
    """Run simulate() and read the friction force of every row."""
    trace = simulate(*model_and_rig(case), case.t_end, **how)
    assert np.isfinite(trace.F).all()
    log = trace.transitions
    return Outcome(log.t, log.element, log.edge.tolist(), trace.z)


def kernel(case: Case) -> Callable[[], Outcome]:
    """Return a callable that runs only the compiled loop, without the rest of `simulate`."""
    model, rig = model_and_rig(case)
    start = Start.of(model, rig, case.t_end, Settings(engine="compiled", output="end"))
    made: list[CompiledRun] = []

    def run() -> Outcome:
        if not made:
            made.append(CompiledRun(start))
        columns = made[0].columns
        columns.empty()
        while made[0].advance():
            pass
        log, count = columns.log, columns.log.counts[0]
        edge = [EDGES[i] for i in np.asarray(log.edge[:count]).tolist()]
        z = columns.buffers.now.y[-model.n :]
        return Outcome(log.t[:count].copy(), log.machine[:count].copy(), edge, z[None].copy())

    return run


def c_loop(case: Case, folder: Path) -> Callable[[Array], Outcome]:
    """Compile the C loop; it is called through ctypes."""
    library = folder / f"{'open' if case.signal else 'closed'}.so"
    define = ["-DOPEN_LOOP"] if case.signal else []
    source = str(Path(__file__).with_name("c_loop.c"))
    subprocess.run([*COMPILER, *define, source, "-o", str(library), "-lm"], check=True)
    code = ctypes.CDLL(str(library))

    def place(array: np.ndarray) -> ctypes.c_void_p:
        return array.ctypes.data_as(ctypes.c_void_p)

    def run(times: Array) -> Outcome:
        t, what, out = np.empty(4096), np.empty(4096, dtype=np.int32), np.empty((ROWS, 8))
        if times.size:
            count = code.run_rows(ROWS, place(out), place(t), place(what))
        else:
            out = out[:1]
            count = code.run_end(place(out), place(t), place(what))
        edge = [EDGES[i] for i in (what[:count] % 3).tolist()]
        return Outcome(t[:count], what[:count] // 3, edge, out[:, 3:7])

    return run


def contestants(case: Case, folder: Path) -> Iterator[tuple[str, bool, Callable[[], Outcome]]]:
    """Yield name, whether rows are kept, and a callable; the C loop first."""
    times = np.linspace(0.0, case.t_end, ROWS)
    loop = functools.cache(functools.partial(c_loop, case, folder))
    yield C_LOOP, True, lambda: loop()(times)
    yield C_LOOP, False, lambda: loop()(NONE)
    for engine in ("compiled", "ifelse", "machines"):
        run = functools.partial(ours, case, engine=engine)
        yield f"gms-fsm, {engine}", True, functools.partial(run, t_eval=times)
        yield f"gms-fsm, {engine}", False, functools.partial(run, output="end")
    yield "gms-fsm, compiled, kernel alone", False, kernel(case)
    for name, rival in RIVALS.items():
        yield name, True, functools.partial(rival, case, times)
        yield name, False, functools.partial(rival, case, NONE)


# --------------------------------------------------------------------------- scoring
def errors(found: Outcome, right: Outcome) -> tuple[str, str]:
    """Return the largest errors of z and of transition times, as text."""
    z = np.abs(found.z - (right.z if len(found.z) > 1 else right.z[-1:])).max()
    worst = 0.0
    for i in np.unique(right.element):
        mine, true = np.flatnonzero(found.element == i), np.flatnonzero(right.element == i)
        if [found.edge[m] for m in mine] != [right.edge[m] for m in true]:
            return f"{z:.1e} m", "wrong sequence"
        worst = max(worst, float(np.abs(found.t[mine] - right.t[true]).max()))
    return f"{z:.1e} m", f"{worst:.1e} s"


def seconds(run: Callable[[], object], calls: int = 1) -> float:
    """Return the time of one call."""
    start = time.perf_counter()
    for _ in range(calls):
        run()
    return (time.perf_counter() - start) / calls


def ms(time_s: float) -> str:
    """Return a time as text."""
    value = 1e3 * time_s
    return f"{value:,.0f} ms" if value >= 100 else f"{value:.3g} ms"


def runs(case: Case, rounds: int) -> Table:
    """Compare all contestants on one case."""
    times = np.linspace(0.0, case.t_end, ROWS)
    right = ours(case, t_eval=times, engine="ifelse", rtol=1e-12, atol=1e-15)
    field, scores, cost, left_out = [], {}, {}, {}
    with tempfile.TemporaryDirectory() as folder:
        for name, rows, run in contestants(case, Path(folder)):
            try:
                found = run()  # also the warm-up
            except MISSING as error:
                left_out[name] = f" Skipped: {name} ({error})."
                continue
            field.append((name, rows, run))
            scores[name, rows] = *errors(found, right), f"{found.t.size} of {case.transitions}"
            cost[name, rows] = seconds(run)
        measured: dict[tuple[str, bool], dict[int, float]] = {key: {} for key in cost}
        for turn in range(rounds):
            for name, rows, run in field:
                one = cost[name, rows]
                if one < 0.3 or turn % 3 == 0:  # slow contestants run in fewer rounds
                    measured[name, rows][turn] = seconds(run, max(1, int(0.02 / one)))
    table = []
    for (name, rows), mine in measured.items():
        base = measured.get((C_LOOP, rows))
        ratio = "-"
        if base:
            middle = statistics.median(u / base[turn] for turn, u in mine.items())
            ratio = f"{middle:,.1f}" if middle < 100 else f"{middle:,.0f}"
        kept = f"{ROWS:,} rows" if rows else "end"
        median = ms(statistics.median(mine.values()))
        table.append((name, kept, ratio, median, *scores[name, rows]))
    table.sort(key=lambda line: line[1])
    return Table(
        f"{case.title}, rtol 1e-6; atol 1e-9 (gms-fsm: default)",
        ("", "kept", "time / C", "median", "error of z", "of times", "transitions"),
        table,
        f"Median of {rounds} interleaved rounds (every third round for runs over 0.3 s). Error: "
        "the largest over all rows, or of the end state; rows of gms-fsm and C include friction."
        + "".join(left_out.values()),
    )


# --------------------------------------------------------------------------- how cost grows
def bank(n: int, spread: bool) -> GMS:
    """Return the pulled mass's bank with n equal shares; thresholds equal or spread 1 : 7."""
    w = np.linspace(0.0025, 0.0175, n) if spread and n > 1 else np.full(n, 0.01)
    share = np.full(n, 1 / n)
    parameters = GMSParameters(
        share / w,
        share,
        np.full(n, 0.02),
        sigma_2=0.4,
        v_c=1e-6,
        weights=w,
        stribeck=Stribeck(1.0, 1.5, 0.05),
    )
    return GMS(parameters, law="signed")


def compiled(model: GMS, t_end: float, **how: Any) -> Any:
    """Run the pulled mass with the compiled engine."""
    return simulate(model, PulledSlider(1.0, 2.0, 0.1), t_end, engine="compiled", **how)


def size(rounds: int) -> Table:
    """Measure the cost as a function of the number of elements."""
    table = []
    for n in (1, 10, 100, 1_000, *([10_000] if rounds > 3 else [])):
        line = [f"{n:,}"]
        for spread in (False, True):
            run = functools.partial(compiled, bank(n, spread), 12.0, output="end")
            count = len(run().transitions)
            cost = min(seconds(run) for _ in range(3 if n < 10_000 else 1))
            line += [ms(cost), f"{count:,}"]
        table.append(tuple(line))
    return Table(
        "Cost by number of elements",
        ("elements", "together", "transitions", "spread", "transitions"),
        table,
        'Pulled mass, 12 s (one break-away, one arrest), compiled, `output="end"`. Together: equal '
        "thresholds, all elements switch at one instant. Spread: each switches at its own instant.",
    )


def length(rounds: int) -> Table:
    """Measure the cost as a function of the length of the run."""
    model, table = model_and_rig(PULLED_MASS)[0], []
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
        return sweep(*model_and_rig(PULLED_MASS), 60.0, varied, executor=executor, **options)


def sweeps(rounds: int) -> Table:
    """Measure how many runs per second a sweep does, and how many of them are wrong."""
    count = 1000 if rounds > 3 else 200
    right = many(count, rtol=1e-12, atol=1e-15)
    table = []
    for threads in (1, 2):
        result = many(count, threads)
        rate = count / min(seconds(lambda n=threads: many(count, n)) for _ in range(3))
        wrong = sum(result.sequence(run) != right.sequence(run) for run in range(count))
        failed = int((result.outcome != "ok").sum())
        table.append((f"{threads}", f"{rate:,.0f}", f"{wrong} of {count:,}", f"{failed}"))
    return Table(
        f"Sweep: {count:,} pulled masses, 60 s each, end states",
        ("threads", "runs per second", "wrong event sequences", "failed"),
        table,
        "k varied by 20 %, w = 1/(4k), rtol 1e-6; reference: rtol 1e-12.",
    )


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
    """Return the peak before (warm) and after a run, MB."""
    compiled(model_and_rig(PULLED_MASS)[0], 1.0)
    before = peak()
    run()
    return {"before": before, "after": peak()}


def first_call(law: str) -> dict[str, float]:
    """Return the time of the first compiled run."""
    model = GMS(model_and_rig(PULLED_MASS)[0].parameters, law=law)  # type: ignore[arg-type]
    return {"seconds": seconds(lambda: compiled(model, 1.0))}


TASKS: dict[str, tuple[str, Callable[[], dict[str, float]]]] = {
    "run_end": (
        "6,000 s, end state",
        lambda: grown(lambda: compiled(model_and_rig(PULLED_MASS)[0], 6000.0, output="end")),
    ),
    "run_all": (
        "6,000 s, all rows",
        lambda: grown(lambda: compiled(model_and_rig(PULLED_MASS)[0], 6000.0, output="all")),
    ),
    "bank_end": (
        "10,000 elements, 12 s, end state",
        lambda: grown(lambda: compiled(bank(10_000, False), 12.0, output="end")),
    ),
    "sweep_100": ("sweep of 100 runs of 60 s, end states", lambda: grown(lambda: many(100))),
    "sweep_1000": ("sweep of 1,000 runs of 60 s, end states", lambda: grown(lambda: many(1000))),
    "signed": ("", lambda: first_call("signed")),
    "published": ("", lambda: first_call("published")),
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


def first(_: int) -> Table:
    """Measure the first compiled call of a process."""
    with tempfile.TemporaryDirectory() as folder:
        steps = (("cold cache", "signed"), ("known chart", "signed"), ("new chart", "published"))
        table = [
            (name, f"{child(task, GMS_FSM_CACHE=folder)['seconds']:.2f} s") for name, task in steps
        ]
    return Table(
        "First compiled run of a process",
        ("", "time"),
        table,
        "Includes importing llvmlite. Cold: nothing is cached. New chart: others are.",
    )


SECTIONS: dict[str, Callable[[int], Table]] = {
    "closed": lambda rounds: runs(PULLED_MASS, rounds),
    "open": lambda rounds: runs(OPEN_LOOP, rounds),
    "size": size,
    "length": length,
    "sweeps": sweeps,
    "memory": memory,
    "first": first,
}


def machine() -> str:
    """Return date, processor and versions in one line."""
    cpu = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        cpu = names[0].split(":")[1].strip() if names else cpu
    packages = [f"{name} {version(name)}" for name in ("numpy", "scipy")]
    for name in ("llvmlite", "scikit-sundae", "pathsim"):
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
    parser.add_argument("--markdown", action="store_true", help="for the README")
    parser.add_argument("--task", choices=TASKS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    for name in set(options.sections) - set(SECTIONS):
        parser.error(f"no section {name!r}; there are {', '.join(SECTIONS)}")
    if options.task:
        print(json.dumps(TASKS[options.task][1]()))
        return
    print(machine())
    for name in options.sections or SECTIONS:
        try:
            table = SECTIONS[name](3 if options.quick else options.rounds)
        except MISSING as error:
            print(f"\n{name} skipped: {getattr(error, 'stderr', None) or error}")
            continue
        print("\n" + table.text(options.markdown), flush=True)


if __name__ == "__main__":
    main()
