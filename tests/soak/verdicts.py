"""Verdicts of `prove` about random systems are not contradicted by their runs.

``python -m tests.soak.verdicts --count 400 --seed 1`` prints each verdict that a run contradicts.

A trial is a pure function of (seed, index): one or two contacts on one or two bodies, of one to
three elements, some with a period, whose guards read F, a, z, v, x and the time in the state.

- What is *proved* must hold in a run: no livelock, no chattering, no impacts that pile up, no two
  edges enabled at once in any row.
- What is *refuted* must be so: an edge that is never taken is not taken, a state that is never
  entered is not entered; a run that begins at the point given switches without end.
"""

from __future__ import annotations

from argparse import Namespace
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import permutations, takewhile
from typing import Any

import numpy as np

from gms_fsm import (
    Body,
    Chart,
    ChartModel,
    Contact,
    Finding,
    Prescribed,
    Report,
    Slider,
    State,
    System,
    Trace,
    Transition,
    prove,
)
from gms_fsm.language import names_in, truths
from gms_fsm.traces.scope import guard_columns
from tests.soak.trying import Dice, Seen, examine, outcome, shaped

T_END = 2.0  # s
MOST_STEPS = 3000
FORCES = ("0", "1", "-1", "z", "k * z", "2 - z", "v", "z + v")
FLOWS = ("v", "0", "1", "-z", "1 - z", "-1", "1", "-1")
CLAUSES = (
    "F > 1", "F < 1", "F <= 0", "F >= 2", "F < -1", "abs(F) > 1.5", "a > 0", "a < 0", "z > 1",
    "z <= 0", "abs(z) < 0.5", "v > 0", "v < 0", "x >= 0.5", "after(0.2)", "after(0.5)", "True",
    "z < 1", "z >= 1", "v >= 0.1", "u > 0", "u < 0",
)  # fmt: skip
ACTIONS: tuple[dict[str, str], ...] = ({}, {}, {}, {}, {"z": "0"}, {"z": "-z"}, {"z": "1"})
IMPACTS: tuple[dict[str, str], ...] = ({"v": "-0.5 * v"}, {"v": "-v"}, {"v": "0"})
LOADS = ("1", "-1", "2 * sin(3 * t)", "3 * t", "1 - 4 * x", "-x - v")


@dataclass(frozen=True, eq=False)
class Trial:
    """A system, where it begins, and what is said of its contacts."""

    system: System
    initial: Mapping[str, Any]


# --------------------------------------------------------------------------- what is drawn
def _chart(dice: Dice, name: str, n: int) -> Chart:
    """Two or three states; one may lock the contact, if it has one element."""
    names = ("one", "two", "three")[: dice.one_of(2, 2, 3)]
    locked = dice.one_of(*names) if n == 1 and dice.one_of(True, False, False) else ""
    edges = []
    for i in range(dice.one_of(2, 3, 3, 4)):
        source = dice.one_of(*names)
        own = dice.one_of(*names, source) if dice.one_of(False, False, True) else ""
        target = own or dice.one_of(*(each for each in names if each != source))
        clauses = [dice.one_of(*CLAUSES) for _ in range(dice.one_of(1, 1, 2))]
        actions = dice.one_of(*ACTIONS)
        if target != locked and source != locked and dice.one_of(*[False] * 7, True):
            actions = dice.one_of(*IMPACTS)
        guard = dice.one_of(" and ", " and ", " or ").join(clauses)
        impulse = target == locked and dice.one_of(True, False)
        edges.append(Transition(f"e{i}", source, target, guard, actions, impulse=impulse))
    if dice.one_of(True, False):  # a surface, met from both sides
        one, other = names[:2]
        left, right = dice.one_of("z", "z", "v", "x", "F", "z + v"), dice.one_of("1", "0", "v", "x")
        more = dice.one_of("", "", " and v > 0", " and F < 2")
        edges[:2] = [
            Transition("e0", one, other, f"{left} > {right}{more}"),
            Transition("e1", other, one, f"{left} <= {right}"),
        ]
    return Chart(
        name,
        ("x", "v", "u"),
        ("z",),
        ("k",),
        [
            State(each, {"z": dice.one_of(*FLOWS)}, locked=True)
            if each == locked
            else State(each, {"z": dice.one_of(*FLOWS)}, outputs={"F": dice.one_of(*FORCES)})
            for each in names
        ],
        edges,
    )


def _system(dice: Dice) -> System:
    """One or two contacts on one or two bodies."""
    bodies = [Body("m", inertia=dice.one_of("1", "0.5", "2"), force=dice.one_of(*LOADS))]
    motions = [("x", "v")]
    if dice.one_of(False, False, True):
        bodies.append(Body("n", inertia="1", force="x - x_n", x="x_n", v="v_n"))
        motions += [("x_n", "v_n"), ("x - x_n", "v - v_n")]
    contacts = []
    for name in ("c", "d")[: dice.one_of(1, 1, 1, 2)]:
        n = dice.one_of(1, 1, 2, 3)
        x, v = dice.one_of(*motions)
        period = dice.one_of(None, None, None, 0.05, 0.3)
        values = {"k": np.array([dice.one_of(0.5, 1.0, 2.0) for _ in range(n)])}
        chart, u = _chart(dice, name, n), dice.one_of("v", "v - 0.2", "x", "sin(5 * t)")
        contacts.append(
            Contact(name, chart, values, v=v, n=n, inputs={"x": x, "u": u}, period=period)
        )
    return System("random", bodies=bodies, contacts=contacts)


def trial(seed: int, index: int) -> Trial:
    """Return a trial; the same arguments give the same one."""
    system, dice = shaped(_system, seed, index, 10**9)
    initial: dict[str, Any] = {}
    for each in system.contacts:
        initial[f"{each.name}.z"] = [dice.one_of(0.0, 0.5, 1.0, -1.0, 2.0) for _ in range(each.n)]
    if not any(each.chart.locks for each in system.contacts):
        initial |= {body.v: dice.one_of(0.0, 0.0, 0.5, -0.5) for body in system.bodies}
    return Trial(system, initial)


# --------------------------------------------------------------------------- what a run shows
def _proved(report: Report, check: Any) -> bool:
    return all(finding.status == "proved" for finding in report.of(check))


def contradicted(report: Report, contact: Contact, trace: Trace, end: str) -> Iterator[str]:
    """Yield what a run shows of a contact against its report."""
    log = trace.transitions
    seen = {
        "its guard can never hold": log.edge,
        "never taken": log.edge,
        "no chain of edges leads to it": log.target,
        "no edge leaves it": log.source,
    }
    for finding in report.of("reachability"):
        never = seen.get(finding.text.partition(":")[0], ()) if finding.status == "refuted" else ()
        if finding.where[-1] in {str(name) for name in never}:
            yield f"{finding} but a run shows it"
    # Rows at ticks have the force that was held, those that slide a force between two states.
    if contact.period is None and not len(trace.sliding):
        yield from _both_enabled(report, trace)
    if end.startswith("LivelockError"):
        yield from (f"{check} is proved, but {end}" for check in _endless(report, log[-40:], end))
    if _proved(report, "chattering"):
        yield from _sliding(report, contact, trace)


def _endless(report: Report, last: Any, end: str) -> Iterator[str]:
    """Yield the checks that say that the last switches of a livelock do not go on."""
    times = np.asarray(last.t)
    if len(last) < 40:
        return  # another contact's
    if (times == times[-1]).all() and _proved(report, "livelock"):
        yield "livelock"
    ways = {(str(row.source), str(row.target)) for row in last}
    chatters = (np.diff(times) > 0).any() and len(ways) == 2 and "Zeno" not in end
    proved = _proved(report, "chattering") and _proved(report, "release")
    if chatters and ways == {(b, a) for a, b in ways} and proved:
        yield "chattering"
    proved = bool(report.of("zeno")) and _proved(report, "zeno")
    if "Zeno" in end and len({str(name) for name in last.edge}) == 1 and proved:
        yield "zeno"


def _sliding(report: Report, contact: Contact, trace: Trace) -> Iterator[str]:
    """Compare pairs of states between which no flows meet with those that a run slides between."""
    for finding in report.of("chattering"):
        states = [part for part in finding.where if part not in contact.chart.guards]
        pairs = [f"({', '.join(each)}) of element" for each in permutations(states, 2)]
        for each in trace.sliding:
            mine = str(each.surface).endswith(f" of {contact.name}")
            held = abs(each.sigma_start) < 1.0 and any(pair in str(each.surface) for pair in pairs)
            if mine and held:
                yield f"{finding} but it slides on {each.surface}"


def _both_enabled(report: Report, trace: Trace) -> Iterator[str]:
    """Compare what is never enabled at once with the rows of a run."""
    guards = trace.model.chart.guards
    columns = guard_columns(trace, frozenset[str]().union(*map(names_in, guards.values())))
    mode, shape = trace.modes.T, trace.modes.T.shape

    def holds(edge: str) -> Any:
        guard = guards[edge]
        return truths(guard, {name: columns[name] for name in names_in(guard)}, shape)

    for finding in report.of("determinism"):
        if finding.status == "proved" and "same time" in finding.text:
            state, one, other = finding.where
            inside = mode == trace.model.chart.state_index(state)
            if (holds(one) & holds(other) & inside).any():
                yield f"{finding} but a run shows both"


def unconfirmed(report: Report, contact: Contact) -> Iterator[str]:
    """Yield refutations that a run from their point does not confirm."""
    for finding in report.refuted:
        point, pair = finding.counterexample, finding.check in ("chattering", "release")
        if not point or not (pair or finding.check in ("livelock", "zeno")):
            continue
        if (pair and "R" in point) or any(u for name, u in point.items() if name.startswith("age")):
            continue  # no run can begin late in a state, or beside elements that are not given
        trace, end = _run_from(finding, contact)
        confirmed = end.startswith("LivelockError")
        if finding.check == "zeno":
            confirmed = "Zeno" in end
        elif pair and trace is not None:
            taken = [str(each) for each in trace.transitions.edge]
            confirmed |= len(trace.sliding) > 0 or len(taken) > 20
            if "switching" not in finding.text:  # once only
                confirmed |= taken[:2] == [u for u in finding.where if u in contact.chart.guards]
        if not confirmed:
            yield f"{finding} but a run from there: {end or 'goes on'}, {trace!r}"


def _run_from(finding: Finding, contact: Contact) -> tuple[Trace | None, str]:
    """Run a contact of its own from a point, under the load given there."""
    chart, point = contact.chart, {"age": 0.0, **finding.counterexample}
    states = [*takewhile(lambda part: part not in chart.guards, finding.where)]
    n = len(states)
    own = [{**point, **{u: point.get(f"{u}{i}", 0.0) for u in "zk"}} for i in range(2, n + 1)]
    each = [point, *own]
    k = np.array([mine.get("k", 1.0) for mine in each])
    rate = f"{point.get('u', 0.0)!r} + {point.get('du/dt', 0.0)!r} * t"
    model = ChartModel(chart, {"k": k}, n=n, inputs={"u": rate})
    start: dict[str, Any] = {"z": [mine.get("z", 0.0) for mine in each], "states": states}
    start["x"] = point.get("x", 0.0)
    mass, v = 1.0 / point.get("W", 1.0), f"{point.get('v', 0.0)!r}"
    load = f"{point.get('H', 0.0)!r} + {point.get('dH/dt', 0.0)!r} * t"
    reads = frozenset[str]().union(*map(names_in, chart.guards.values()))
    moves = chart.locks or chart.sets_velocity or bool(reads & {"F", "a"} or {*point} & {"H", "W"})
    rig: Any = Slider(mass, load)
    if not moves:
        rig = Prescribed(f"{v} + {point.get('dv/dt', 0.0)!r} * t")
    else:
        start["v"] = float(v)
    held = {} if contact.period is None else {"events": "held", "step": contact.period}
    return outcome(model, rig, 20.0, initial=start, max_steps=20 * MOST_STEPS, **held)


# --------------------------------------------------------------------------- one trial
def look(given: Namespace, index: int) -> Iterator[Seen]:
    """Compare what is said of one system with its run, and with runs from its points."""
    one = trial(given.seed, index)
    trace, end = outcome(one.system, T_END, initial=one.initial, max_steps=MOST_STEPS)
    counts, faults, shown = Counter[str](), [], [one.system, one.initial, end]
    for contact in one.system.contacts:
        report = prove(one.system, contact=contact.name)
        counts.update(f"{each.check} {each.status}" for each in report.findings)
        shown += [contact.chart.transitions, contact.chart.states, report]
        if trace is not None:
            faults += contradicted(report, contact, trace.contact(contact.name), end)
        faults += unconfirmed(report, contact)
    counts["livelocks"] = end.startswith("LivelockError")
    counts["ended"] = not end
    yield Seen(f"--index {index}", counts, "\n".join(faults), shown=shown)


if __name__ == "__main__":
    examine("verdicts", "Are verdicts about what runs?", look, count=400)
