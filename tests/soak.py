"""Stress tests for minutes and hours: ``python -m tests.soak --minutes 10``, or ``make soak``.

The three fuzz bodies for the given number of minutes each, 200 kills at random moments, a run of a
million transitions, new random runs of tests/physics/test_hard_random_runs.py and of
tests/trials.py, new records to step along, new systems of tests/random_systems.py in all engines,
and of tests/exact_systems.py against an exact reference. Each part runs in separate processes, with
limits on memory and time; findings are printed with the command that repeats them, and the exit
code is then 1.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import json
import os
import random
import resource
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SIZES = (8, 32, 128, 512, 2048)  # bytes of an input
SLOWEST = 60  # s allowed for one input
MEMORY = 4 * 2**30  # bytes of address space for a process
GROWTH = 2**30  # bytes of memory that one input, or the whole run, may add
WARM = 2000  # inputs until everything is loaded


def input_bytes(seed: int, index: int) -> bytes:
    """Return one input; seed and index repeat it."""
    source = random.Random(f"{seed}:{index}")
    return source.randbytes(source.choice(SIZES))


def _used() -> int:
    """Return the peak memory use, bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


# --------------------------------------------------------------------------- a child that fuzzes
def fuzz_here(name: str, seed: int, seconds: float, watch: Path) -> dict[str, float]:
    """Try inputs for a while in this process; print the findings.

    Parameters
    ----------
    name : str
        A body in tests/fuzz.py.
    seed : int
        Seed of the inputs.
    seconds : float
        Duration.
    watch : Path
        File for the index of the current input, in case this process dies.

    Returns
    -------
    dict
        Figures: inputs, accepted, slowest [s], MB, findings.
    """
    from tests import fuzz

    body, known = fuzz.BODIES[name], set()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    index = accepted = found = 0
    slowest, warm, end = 0.0, _used(), time.monotonic() + seconds
    with watch.open("wb", buffering=0) as place:
        while time.monotonic() < end:
            os.pwrite(place.fileno(), b"%20d" % index, 0)
            faulthandler.dump_traceback_later(SLOWEST, exit=True)
            began, before = time.monotonic(), _used()
            try:
                accepted += body(input_bytes(seed, index))
            except Exception as error:
                where = traceback.extract_tb(error.__traceback__)[-1]
                if (type(error), where.lineno) not in known:
                    known.add((type(error), where.lineno))
                    print(f"FINDING {_again(name, seed, index)}", file=sys.stderr)
                    traceback.print_exc()
                found += 1
            slowest = max(slowest, time.monotonic() - began)
            index += 1
            if index == WARM:
                warm = _used()
            grown = max(_used() - before, _used() - warm if index > WARM else 0)
            if grown > GROWTH:
                print(f"FINDING memory {_again(name, seed, index - 1)}", file=sys.stderr)
                found += 1
                break
    faulthandler.cancel_dump_traceback_later()
    return {
        "inputs": index,
        "accepted": accepted,
        "slowest": slowest,
        "MB": _used() / 2**20,
        "grown": (_used() - warm) / 2**20,
        "findings": found,
    }


def _again(name: str, seed: int, index: int) -> str:
    return f"repeat with: python -m tests.soak --only {name} --seed {seed} --input {index}"


# --------------------------------------------------------------------------- the parts
def fuzzing(name: str, seed: int, minutes: float) -> bool:
    """Run one body in a child; return whether there were no findings."""
    with tempfile.TemporaryDirectory() as folder:
        watch = Path(folder) / "index"
        command = [
            *(sys.executable, "-m", "tests.soak", "--only", name, "--seed", str(seed)),
            *("--child", str(60 * minutes), "--watch", str(watch)),
        ]
        # Machine code of hostile charts should not be cached.
        surroundings = {**os.environ, "GMS_FSM_CACHE": folder}
        limit = 60 * minutes + 2 * SLOWEST + 60
        try:
            done = subprocess.run(
                command,
                cwd=ROOT,
                env=surroundings,
                stdout=subprocess.PIPE,
                text=True,
                timeout=limit,
                check=False,
            )
        except subprocess.TimeoutExpired:
            print(f"FINDING no end: {_again(name, seed, _index(watch))}")
            return False
        if done.returncode:
            print(f"FINDING died ({done.returncode}): {_again(name, seed, _index(watch))}")
            return False
    figures = json.loads(done.stdout.splitlines()[-1])
    print(
        f"fuzz {name}: {figures['inputs']:,} inputs in {minutes:g} min, "
        f"{figures['inputs'] / (60 * minutes):.0f} a second, {figures['accepted']:,} accepted, "
        f"slowest {figures['slowest']:.2f} s, {figures['MB']:.0f} MB "
        f"({figures['grown']:.0f} MB more than when warm), {figures['findings']} findings, "
        f"seed {seed}",
        flush=True,
    )
    return not figures["findings"]


def _index(watch: Path) -> int:
    with contextlib.suppress(OSError, ValueError):
        return int(watch.read_bytes())
    return 0


def killing(seed: int, kills: int) -> bool:
    """Kill writers at random moments; return whether every file was whole."""
    from tests.run.test_killed_runs_leave_whole_files import WRITERS, end_nursery, kill_and_look

    moments, began, amid = random.Random(seed), time.monotonic(), 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(kills):
            name = list(WRITERS)[number % len(WRITERS)]
            place = Path(folder) / f"{number}"
            place.mkdir()
            try:
                amid += bool(kill_and_look(name, moments.random(), place))
            except Exception:
                print(f"FINDING kill {number} of {name}, seed {seed}")
                traceback.print_exc()
                return False
    end_nursery()
    print(
        f"kill -9: {kills} kills of {', '.join(WRITERS)} in {time.monotonic() - began:.0f} s, "
        f"{amid} of them amid writing; every file old or new, and whole; seed {seed}",
        flush=True,
    )
    return True


def million(transitions: int) -> bool:
    """Run many transitions in a child; return whether its memory stayed within bounds."""
    from tests.run.test_a_million_transitions import BYTES_A_FIRING, in_a_child

    few, many = in_a_child("compiled", 1000), in_a_child("compiled", transitions)
    each = (many.peak - few.peak) / (many.transitions - few.transitions)
    good = each < BYTES_A_FIRING and many.transitions >= transitions
    print(
        f"{'' if good else 'FINDING '}{many.transitions:,} transitions in {many.seconds:.1f} s "
        f"({many.transitions / many.seconds:,.0f} a second), at most {many.peak / 2**20:.0f} MB, "
        f"{each:.0f} bytes a transition",
        flush=True,
    )
    return good


def child(part: str, *command: str, ends: str = "") -> bool:
    """Run a part in a process of its own, which prints what it finds; see also `main`."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:  # for machine code that is not needed again
        done = subprocess.run(
            [sys.executable, "-m", *command],
            cwd=ROOT,
            env={**os.environ, "GMS_FSM_CACHE": folder},
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
    good = done.returncode == 0 and ends in done.stdout
    print(f"{'' if good else 'FINDING '}{part}, {time.monotonic() - began:.0f} s: {done.stdout}",
          end="", flush=True)  # fmt: skip
    return good


# --------------------------------------------------------------------------- all parts
def main() -> None:
    """Run the requested parts; exit with 1 if there were findings."""
    parts = ("expression", "scenario", "trace", "kill", "million", "runs", "trials")
    parts += ("stepping", "systems", "exact")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="for each of the three")
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(10**9))
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--examples", type=int, default=300, help="of each kind of random run")
    parser.add_argument("--transitions", type=int, default=1_000_000)
    parser.add_argument("--trials", type=int, default=2000, help="random runs to judge")
    parser.add_argument("--records", type=int, default=1000, help="random records to step along")
    parser.add_argument("--systems", type=int, default=500, help="random systems to compare")
    parser.add_argument("--exact", type=int, default=1000, help="random systems to judge")
    parser.add_argument("--only", choices=parts, action="append")
    parser.add_argument("--input", type=int, help="repeat this input of the one part given")
    parser.add_argument("--child", type=float, help=argparse.SUPPRESS)
    parser.add_argument("--watch", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child is not None:
        print(json.dumps(fuzz_here(given.only[0], given.seed, given.child, given.watch)))
        return
    if given.input is not None:
        from tests import fuzz

        faulthandler.dump_traceback_later(SLOWEST, exit=True)
        data = input_bytes(given.seed, given.input)
        print(data.hex())
        print("accepted" if fuzz.BODIES[given.only[0]](data) else "refused")
        return
    print(f"seed {given.seed}", flush=True)
    os.environ["GMS_FSM_EXAMPLES"] = str(given.examples)  # of each kind of random run
    seed, hard = str(given.seed), "tests/physics/test_hard_random_runs.py"
    of_each = str(-(-given.trials // 5))  # there are five families
    work: dict[str, Callable[[], bool]] = {
        "expression": lambda: fuzzing("expression", given.seed, given.minutes),
        "scenario": lambda: fuzzing("scenario", given.seed, given.minutes),
        "trace": lambda: fuzzing("trace", given.seed, given.minutes),
        "kill": lambda: killing(given.seed, given.kills),
        "million": lambda: million(given.transitions),
        "runs": lambda: child("random runs", "pytest", "-q", hard, f"--hypothesis-seed={seed}"),
        "trials": lambda: child("trials", "tests.trials", "--count", of_each, "--seed", seed),
        "stepping": lambda: child("stepping", "tests.run.test_stepping_equals_simulate", seed,
                                  str(given.records), ends=f"0 of {given.records} differ"),
        "systems": lambda: child("systems", "tests.random_systems", "--count",
                                 str(given.systems), "--seed", seed),
        "exact": lambda: child("exact systems", "tests.exact_systems", "--count",
                               str(given.exact), "--seed", seed),
    }  # fmt: skip
    good = [work[part]() for part in given.only or parts]
    print("nothing found" if all(good) else "see FINDING above")
    sys.exit(0 if all(good) else 1)


if __name__ == "__main__":
    main()
