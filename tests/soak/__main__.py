"""Stress tests for minutes and hours: ``python -m tests.soak --minutes 10``, or ``make soak``.

Three fuzz bodies for the given number of minutes each, 200 kills at random moments, a run of a
million transitions, new random runs of tests/physics/test_hard_random_runs.py, new records to step
along, and new trials of the other modules of this folder. Each part runs in separate processes,
with limits on memory and time; findings are printed with the command that repeats them, and the
exit code is then 1.
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
from collections.abc import Sequence
from pathlib import Path

from tests.soak import fuzz
from tests.soak.trials import FAMILIES

ROOT = Path(__file__).resolve().parents[2]
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
    """Try inputs for a while in this process; print the findings, and return figures.

    The index of the current input is written to `watch`, in case this process dies.
    """
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
def in_a_child(
    arguments: Sequence[str], folder: str, limit: float | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a module; machine code of random charts is kept in a folder that is removed."""
    return subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=ROOT,
        env={**os.environ, "GMS_FSM_CACHE": folder},
        stdout=subprocess.PIPE,
        text=True,
        timeout=limit,
        check=False,
    )


def fuzzing(name: str, seed: int, minutes: float) -> bool:
    """Run one body in a child; return whether there were no findings."""
    with tempfile.TemporaryDirectory() as folder:
        watch = Path(folder) / "index"
        arguments = ["tests.soak", "--only", name, "--seed", str(seed)]
        arguments += ["--child", str(60 * minutes), "--watch", str(watch)]
        limit = 60 * minutes + 2 * SLOWEST + 60
        try:
            done = in_a_child(arguments, folder, limit)
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
    from tests.run.test_a_million_transitions import BYTES_A_FIRING
    from tests.run.test_a_million_transitions import in_a_child as counted

    few, many = counted("compiled", 1000), counted("compiled", transitions)
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
    with tempfile.TemporaryDirectory() as folder:
        done = in_a_child(command, folder)
    good = done.returncode == 0 and ends in done.stdout
    said = f"{'' if good else 'FINDING '}{part}, {time.monotonic() - began:.0f} s: {done.stdout}"
    print(said, end="", flush=True)
    return good


# --------------------------------------------------------------------------- all parts
PARTS = (
    *fuzz.BODIES,
    "kill",
    "million",
    "runs",
    "trials",
    "stepping",
    "systems",
    "stepped",
    "exact",
    "doubts",
    "verdicts",
    "pairs",
    "gradients",
)
COUNTS = {
    "kills": 200, "examples": 300, "transitions": 1_000_000, "trials": 2000, "records": 1000,
    "systems": 500, "stepped": 200, "exact": 1000, "doubts": 400, "verdicts": 400,
    "pairs": 1000, "gradients": 100,
}  # fmt: skip


def main() -> None:
    """Run the requested parts; exit with 1 if there were findings."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="for each of the three")
    parser.add_argument("--seed", type=int, default=random.SystemRandom().randrange(10**9))
    for name, default in COUNTS.items():
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--only", choices=PARTS, action="append")
    parser.add_argument("--input", type=int, help="repeat this input of the one part given")
    parser.add_argument("--child", type=float, help=argparse.SUPPRESS)
    parser.add_argument("--watch", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child is not None:
        print(json.dumps(fuzz_here(given.only[0], given.seed, given.child, given.watch)))
        return
    if given.input is not None:
        faulthandler.dump_traceback_later(SLOWEST, exit=True)
        data = input_bytes(given.seed, given.input)
        print(data.hex())
        print("accepted" if fuzz.BODIES[given.only[0]](data) else "refused")
        return
    print(f"seed {given.seed}", flush=True)
    os.environ["GMS_FSM_EXAMPLES"] = str(given.examples)  # of each kind of random run
    seed, hard = str(given.seed), "tests/physics/test_hard_random_runs.py"
    of_each = str(-(-given.trials // len(FAMILIES)))
    trying = {
        "trials": ("tests.soak.trials", of_each),
        "systems": ("tests.soak.random_systems", str(given.systems)),
        "stepped": ("tests.soak.stepped_systems", str(given.stepped)),
        "exact": ("tests.soak.exact_systems", str(given.exact)),
        "doubts": ("tests.soak.doubts", str(given.doubts)),
        "verdicts": ("tests.soak.verdicts", str(given.verdicts)),
        "pairs": ("tests.soak.pairs", str(given.pairs)),
        "gradients": ("tests.soak.gradients", str(given.gradients)),
    }
    none_differs = f"0 of {given.records} differ"

    def done(part: str) -> bool:
        if part in fuzz.BODIES:
            return fuzzing(part, given.seed, given.minutes)
        if part in trying:
            module, count = trying[part]
            return child(part, module, "--count", count, "--seed", seed)
        if part == "kill":
            return killing(given.seed, given.kills)
        if part == "million":
            return million(given.transitions)
        if part == "runs":
            return child("random runs", "pytest", "-q", hard, f"--hypothesis-seed={seed}")
        stepping = "tests.run.test_stepping_equals_simulate"
        return child(part, stepping, seed, str(given.records), ends=none_differs)

    good = [done(part) for part in given.only or PARTS]
    print("nothing found" if all(good) else "see FINDING above")
    sys.exit(0 if all(good) else 1)


if __name__ == "__main__":
    main()
