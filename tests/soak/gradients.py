"""Random runs whose sensitivities are compared with differences of much more accurate runs.

``python -m tests.soak.gradients --count 100 --seed 1``: by turns a GMS model, pulled, forced and at
a given velocity, and a chart of the zoo with other numbers. A run is well-conditioned for a number
if the differences of several steps agree and have the same switches.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from random import Random

from gms_fsm.errors import GMSError
from gms_fsm.systems.mounted import mounted
from gms_fsm.systems.numbers import numbers_of, with_numbers
from tests.corpus import Run
from tests.differences import Compared, compared, names_of
from tests.soak import trials
from tests.soak.trying import Seen, examine
from tests.zoo import zoo_cases

FAMILIES = ("pulled", "forced", "sines")
LIMIT, BANK_LIMIT = 1e-6, 1e-7
WELL = 0.1  # of the limit: how far differences of well-conditioned runs are apart
FEW = 2  # numbers of each run


def bank(seed: int, index: int) -> Run:
    """Return a run of a GMS model."""
    one = trials.trial(FAMILIES[index % len(FAMILIES)], seed, index)
    return Run((one.model, one.rig), one.t_end)


def chart(dice: Random) -> Run:
    """Return a run of a chart of the zoo with other numbers."""
    case = zoo_cases.CASES[dice.choice(sorted(zoo_cases.CASES))](10.0 ** dice.uniform(-3.0, 0.0))
    what = mounted(case.system)
    for name, number in numbers_of(what).items():
        if not name.endswith("unit"):
            try:
                what = with_numbers(what, {name: number.value * 2.0 ** dice.uniform(-0.5, 0.5)})
            except GMSError:  # such as F_s below F_c
                continue
    return Run((what.system,), 0.3 * case.t_end, {"initial": dict(case.initial)})


def is_well(each: Compared, limit: float) -> bool:
    """Return whether differences say more than the limit."""
    return each.known and each.noise < WELL * limit


def is_wrong(each: Compared, limit: float) -> bool:
    """Return whether a derivative is certainly not that of differences."""
    return is_well(each, limit) and each.error > limit + 3.0 * each.noise


def look(given: Namespace, index: int) -> Iterator[Seen]:
    """Compare the sensitivities of one run."""
    dice, again, is_bank = Random(f"{given.seed}:{index}"), f"--index {index}", index % 2 == 0
    run = bank(given.seed, index // 2) if is_bank else chart(dice)
    limit = BANK_LIMIT if is_bank else LIMIT
    kind = "GMS" if is_bank else "zoo"
    names = names_of(run, 100)
    names = [*dice.sample(names[:-1], min(FEW, len(names) - 1)), names[-1]]
    try:
        trace, found = compared(run, names)
        if any(is_wrong(each, limit) for each in found):  # what the run misses falls with it
            trace, found = compared(run, names, 1e-12)
    except GMSError as error:
        yield Seen(again, {f"{kind} stopped": 1}, note=str(error))
        return
    for each in found:
        well, wrong = is_well(each, limit), is_wrong(each, limit)
        word = "wrong" if wrong else "right" if well else "ill" if each.known else "none"
        counts = {f"{kind} {word}": 1, "switches": len(trace.firings) if well else 0}
        shown = [run.subject, each]
        shown += trace.trust().of("sensitivity") if given.index is not None else []
        yield Seen(again, counts, f"{kind}: {each}" if wrong else "", shown=shown)


if __name__ == "__main__":
    examine("gradients", "Sensitivities against differences", look, count=100)
