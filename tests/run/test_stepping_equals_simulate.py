"""Stepping through a record gives the bits of `simulate` over it: forces, states, switch times.

Also where the velocity jumps, and after looking ahead and going back. `python -m
tests.run.test_stepping_equals_simulate SEED COUNT` repeats a case, or tries others.
"""

from __future__ import annotations

import sys

import numpy as np
import pytest

from gms_fsm import GMS, FrictionState, Prescribed, simulate
from gms_fsm.errors import GMSError
from tests.helpers import FASTEST
from tests.run.stepping_cases import friction, jumping, record

CASES = 28  # make soak takes 1,000
BOTH = sorted({"ifelse", FASTEST})
COMPILED = ("LuGre bristle", "Elasto", "Reset")  # of the charts; each takes seconds


def differences(
    seed: int, index: int, *, jumps: bool = False, every: bool = False
) -> tuple[str, int]:
    """Return what differs in one random case, and the number of switches.

    Of the charts that are no banks only some are compiled, or `every` one.
    """
    rng = np.random.default_rng([seed, index])
    model, speed = friction(rng)
    t, v = record(rng, speed, rows=150)
    after = jumping(rng, v, speed) if jumps else v
    both = np.stack([v, after], axis=1).ravel(), np.repeat(t, 2)
    once = np.append(True, np.diff(both[1]) > 0) | np.append(True, np.diff(both[0]) != 0)
    signal = Prescribed((both[1][once], both[0][once]))
    try:
        trace = simulate(model, signal, t[-1], t_start=t[0], engine="ifelse", t_eval=t)
    except GMSError as error:
        trace, failed = None, type(error)
    often = every or isinstance(model, GMS) or model.title.startswith(COMPILED)
    for engine in BOTH if often else ["ifelse"]:
        friction_state = FrictionState(model, t=t[0], engine=engine)
        forces, log = [friction_state.peek(v[0], v[0], 0.0)], []
        variables = [[*friction_state.variables.values()]]
        try:
            for j in range(1, len(t)):
                aside = float(speed * rng.normal())
                if rng.random() < 0.1:
                    before = friction_state.snapshot()
                    friction_state.advance(after[j - 1], aside, t[j] - t[j - 1])
                    friction_state.restore(before)
                if rng.random() < 0.1:
                    friction_state.peek(after[j - 1], aside, t[j] - t[j - 1])
                if rng.random() < 0.1:
                    friction_state.from_array(friction_state.to_array())
                force = friction_state.advance_to(after[j - 1], v[j], t[j])
                log += friction_state.switches
                if after[j] != v[j]:
                    force = friction_state.advance(after[j], after[j], 0.0)
                    log += friction_state.switches
                forces.append(force)
                variables.append([*friction_state.variables.values()])
        except GMSError as error:
            if trace is not None or type(error) is not failed:
                return f"{model.title}, {engine}: {error}", 0
            continue
        if trace is None:
            return f"{model.title}, {engine}: only simulate fails", 0
        wanted = [(float(r.t), int(r.element), str(r.edge)) for r in trace.transitions]
        if [tuple(each) for each in log] != wanted:
            return f"{model.title}, {engine}: {len(log)} switches, not {len(wanted)}, or others", 0
        wrong = np.flatnonzero(np.array(forces) != trace.F)
        if wrong.size:
            return f"{model.title}, {engine}: the force at sample {wrong[0]}", 0
        layout = trace.program.layout
        own = [layout.y.all_of(layout.banks[0].of(name)) for name in layout.banks[0].variables]
        if any((trace.rows.y[:, list(places)] != np.array([row[k] for row in variables])).any()
               for k, places in enumerate(own)):  # fmt: skip
            return f"{model.title}, {engine}: the variables", 0
    return "", 0 if trace is None else len(trace.transitions)


@pytest.mark.every(2)
@pytest.mark.slow
@pytest.mark.parametrize("jumps", [False, True])
def test_random_records(jumps: bool) -> None:
    found = {k: differences(1, k, jumps=jumps) for k in range(int(jumps), CASES, 2)}
    wrong = {k: text for k, (text, _) in found.items() if text}
    assert not wrong, f"python -m tests.run.test_stepping_equals_simulate 1 {CASES}: {wrong}"
    assert sum(count for _, count in found.values()) > 100


def main() -> None:
    seed, count = map(int, sys.argv[1:])
    found = [differences(seed, k, jumps=k % 2 == 1, every=True) for k in range(count)]
    for k, (text, _) in enumerate(found):
        if text:
            print(k, text)
    different = sum(bool(text) for text, _ in found)
    print(f"{different} of {count} differ; {sum(n for _, n in found)} switches")


if __name__ == "__main__":
    main()
