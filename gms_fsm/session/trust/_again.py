"""The same run with a hundredth of the tolerances: whether its sequence holds, how far it moves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from gms_fsm.errors import GMSError, cut
from gms_fsm.foundation.quantities import in_words
from gms_fsm.run.settings import Settings
from gms_fsm.run.simulate import simulate
from gms_fsm.traces.firings import Firings
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import Doubt
from integrators import METHODS

FINER = 100.0
FINE = f"with tolerances {FINER:g} times finer"


def again(trace: Trace) -> Iterator[Doubt]:
    """Yield whether the sequence of switches holds, and how far times and the end state move."""
    if _method(str(trace.settings["method"])) is None:
        text = f"the run is not repeated: its solver {trace.settings['method']} is not in the trace"
        yield Doubt("not judged", "note", text)
        return
    try:
        finer = _repeated(trace)
    except GMSError as error:
        yield Doubt("repeat", "warning", f"{FINE} the run ends: {cut(str(error))}")
        return
    # A switch at the very end, such as one that a run waited for, may just not come in the other.
    given: Mapping[str, Any] = trace.settings
    end = given["t_end"] - given["rtol"] * (given["t_end"] - given["t_start"])
    one, other = (log.at(log.t <= end) for log in (trace.firings, finer.firings))
    moved, apart = 0.0, None
    for machine in range(trace.program.layout.n):
        mine, its = (log.at(log.machine == machine) for log in (one, other))
        count = min(len(mine), len(its))
        differ = np.flatnonzero(mine.edge[:count] != its.edge[:count])
        if differ.size or len(mine) != len(its):
            k = int(differ[0]) if differ.size else count
            t = min(float(log.t[k]) for log in (mine, its) if k < len(log))
            if apart is None or t < apart[0]:
                apart = t, _named(trace, mine, k), _named(trace, its, k)
        elif count:
            moved = max(moved, float(np.abs(mine.t - its.t).max()))
    if apart is not None:
        t, here, there = apart
        text = f"{FINE} the sequence is another one from t = {t:.9g} s on: {there}"
        yield Doubt("repeat", "warning", f"{text} in place of {here}", (t,))
        return
    text = f"there is no transition{' before the end' if len(trace.firings) else ''}"
    if len(one):
        text = f"the sequence of {len(one)} transitions holds"
        if (one.edge != other.edge).any() or (one.machine != other.machine).any():
            text += " for each element, though not their order between elements"
        text += f", and times move by at most {in_words(moved, 's', 2)}"
    yield Doubt("repeat", "note", f"{FINE} {text}; {_moved_end(trace, finer)}")


def _moved_end(one: Trace, other: Trace) -> str:
    """Say which component of the end state moves most, relative to its largest value."""
    layout, rows = one.program.layout, one.whole().rows
    a, b = rows.y[-1], other.whole().rows.y[-1]
    largest = np.abs(rows.y).max(axis=0)
    part = np.abs(a - b) / np.where(largest > 0.0, largest, 1.0)
    if not part.size or not part.any():
        return "the end state does not move"
    worst = int(part.argmax())
    name, i = [*layout.y][worst]
    called = layout.label(name) + ("" if i is None else f" of element {i + 1}")
    return (
        f"at the end {called} moves by {abs(a - b)[worst]:.2g} (SI), {part[worst]:.1g} of its "
        "largest value, and nothing else by more"
    )


def _repeated(trace: Trace) -> Trace:
    """Return the run with finer tolerances, from its first row."""
    given: Mapping[str, Any] = trace.settings
    rtol, atol = given["rtol"] / FINER, given["atol"]
    if isinstance(atol, Mapping):
        atol = {name: _part(value) for name, value in atol.items() if np.min(value) > 0.0}
    elif atol is not None:
        atol = atol / FINER
    step = given["step"]
    if step is not None and given["events"] != "held":  # then the step belongs to the model
        step /= 2.0
    chosen = Settings(
        method=_method(given["method"]),
        step=step,
        rtol=rtol,
        atol=atol,
        max_step=given["max_step"] or np.inf,
        max_steps=100 * given["max_steps"],
        events=given["events"],
        engine=given["engine"],
    )
    initial = _beginning(trace) if trace.initial is None else trace.initial
    times: dict[str, Any] = {"t_start": given["t_start"], "initial": initial}
    if trace.what.named:
        return simulate(trace.what.system, given["t_end"], settings=chosen, **times)
    return simulate(trace.what.model, trace.what.rig, given["t_end"], settings=chosen, **times)


def _beginning(trace: Trace) -> dict[str, Any]:
    """Return the initial values of a run that was read from a file, from its first row.

    Values of samplers are left out: those of the row are after the first tick.
    """
    first, layout, system = trace.whole().rows, trace.program.layout, trace.what.system
    labels = {name: key for key, name in layout.keys.items()}
    left_out = {body.v for body in system.bodies if body.driven}
    left_out |= {name for each in system.sampled for name in each.updates}
    initial: dict[str, Any] = {}
    for name in (*layout.y.shared, *layout.y.own):
        if name in labels and name not in left_out:
            values = first.y[0, layout.y.all_of(name)].tolist()
            initial[labels[name]] = values if name in layout.y.own else values[0]
    for bank in layout.banks:
        states = system.contact(bank.name).chart.states
        key = "states" if len(layout.banks) == 1 else f"{bank.name}.states"
        initial[key] = [states[int(mode)].name for mode in first.mode[0, bank.elements]]
    return initial


def _method(name: str) -> Any:
    """Return a method as `Settings` takes it; None for a solver of the user's own."""
    if name in METHODS:
        return name
    import scipy.integrate

    return getattr(scipy.integrate, name, None)


def _part(value: Any) -> Any:
    return [each / FINER for each in value] if isinstance(value, list) else value / FINER


def _named(trace: Trace, log: Firings, k: int) -> str:
    if k >= len(log):
        return "none"
    layout, machine = trace.program.layout, int(log.machine[k])
    bank = layout.bank(machine)
    edge = layout.edges[int(log.edge[k])][0]
    who = trace.what.element(bank.name, machine - bank.first)
    return f"{edge} of {who} at t = {float(log.t[k]):.9g} s"
