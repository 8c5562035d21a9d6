"""What the random checks share: chance, a run that may stop, and the loop over trials."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from random import Random
from typing import Any

from gms_fsm import Trace, simulate
from gms_fsm.errors import GMSError


@dataclass(frozen=True, eq=False)
class Dice:
    """Two sources of chance: one for the shape, one for the numbers."""

    shape: Random
    numbers: Random
    digits: int = 3

    def one_of(self, *options: Any) -> Any:
        """Choose a part of the shape."""
        return self.shape.choice(options)

    def spread(self, low: float, high: float) -> float:
        """Draw a number with a few digits, evenly over decades."""
        value = math.exp(self.numbers.uniform(math.log(low), math.log(high)))
        return float(f"{value:.{self.digits}g}")

    def even(self, low: float, high: float) -> float:
        """Draw a number with a few digits; it occasionally falls on a boundary."""
        return float(f"{self.numbers.uniform(low, high):.{self.digits}g}")

    def spreads(self, n: int, low: float, high: float) -> list[float]:
        """Draw several numbers."""
        return [self.spread(low, high) for _ in range(n)]


def shaped(
    draw: Callable[[Dice], Any], seed: int, index: int, shapes: int, digits: int = 3
) -> tuple[Any, Dice]:
    """Return what is drawn, and the dice; the same arguments give the same.

    The shape is one of `shapes` many, because each is compiled anew; the numbers are the trial's
    own. Shapes that are refused, such as locks that depend on each other, are skipped.
    """
    for attempt in range(50):
        which = f"{seed}:{index % shapes}:{attempt}"
        dice = Dice(Random(f"shape {which}"), Random(f"numbers {which}:{index}"), digits)
        try:
            return draw(dice), dice
        except GMSError:
            continue
    raise AssertionError(f"no system in fifty attempts: {seed}, {index}, {shapes}")


def outcome(*subject: Any, **how: Any) -> tuple[Trace | None, str]:
    """Return the trace, also of a run that stops, and its error; empty if it came to its end."""
    try:
        return simulate(*subject, **how), ""
    except (GMSError, ArithmeticError) as error:
        return getattr(error, "trace", None), f"{type(error).__name__}: {error}"


@dataclass(frozen=True)
class Seen:
    """What became of a trial: what is counted, a fault if there is one, or a note."""

    again: str  # the arguments that repeat it
    counts: Mapping[str, int]
    finding: str = ""
    note: str = ""
    shown: Iterable[Any] = field(default=())  # in full


def examine(
    module: str,
    about: str,
    look: Callable[[argparse.Namespace, int], Iterable[Seen]],
    **options: Any,
) -> None:
    """Look at the requested number of trials; exit with 1 if there is a finding."""
    parser = argparse.ArgumentParser(description=about)
    for name, default in options.items():
        parser.add_argument(f"--{name}", type=type(default), default=default)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--index", type=int, help="this one, in full")
    given = parser.parse_args()
    indices = range(given.count) if given.index is None else [given.index]
    findings, counts, notes, began = 0, Counter[str](), list[str](), time.monotonic()
    for index in indices:
        for seen in look(given, index):
            again = f"\n  python -m tests.soak.{module} --seed {given.seed} {seen.again}"
            counts.update(seen.counts)
            findings += bool(seen.finding)
            if seen.finding:
                print(f"FINDING {seen.finding}{again}", flush=True)
            elif seen.note:
                notes.append(f"{seen.note}{again}")
            if given.index is not None:
                print(*seen.shown, sep="\n")
    print(*notes, sep="\n")
    print(", ".join(f"{name} {count:,}" for name, count in sorted(counts.items())))
    seconds = time.monotonic() - began
    print(f"{findings} findings in {len(indices)} trials, seed {given.seed}, {seconds:.0f} s")
    sys.exit(1 if findings else 0)
