"""A run continued from its own last row equals the uninterrupted run.

The row by its names, positions, velocities, variables and states, is what `initial` takes.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gms_fsm import Trace
from tests.corpus import Run, each, run
from tests.helpers import FASTEST

TIGHT = {"rtol": 1e-11, "atol": 1e-13, "engine": FASTEST}
CUT = {
    "open loop": 0.31, "open loop, published": 0.5, "pulled mass": 0.77, "slider": 0.31,
    "fig. 3, slipping": 0.77, "wear": 0.5, "lugre slider": 0.3, "karnopp": 0.6,
    "maxwell-slip": 0.4, "elasto-plastic": 0.3, "system two blocks": 0.37,
    "every kind of contact": 0.45, "system pushed against a stop": 0.2, "loads": 0.7,
    "states in states": 0.43,
}  # fmt: skip


def last_row(one: Trace) -> dict[str, Any]:
    """Return the last row in the form that `initial` takes."""
    layout = one.program.layout
    row = layout.y.named(one.rows.y[-1].tolist())
    found: dict[str, Any] = {key: row[name] for key, name in layout.keys.items() if name in row}
    for contact in one.contacts if one.what.named else ("",):
        part = one.contact(contact) if contact else one
        found[f"{contact}.states" if contact else "states"] = part.states[-1].tolist()
    return found


def fired(*parts: Trace) -> list[tuple[Any, ...]]:
    """Return the switches of several runs, one after the other."""
    names = [
        name for name in ("contact", "element", "edge") if name in parts[0].transitions.dtype.names
    ]
    return [tuple(row[name] for name in names) for part in parts for row in part.transitions]


def whole_and_parts(name: str, share: float | None = None) -> tuple[Trace, Trace, Trace]:
    """Return a run, and its parts up to a time and from there; without a share cut at a switch."""
    subject, how = run(name).subject, {**run(name).how, **TIGHT}
    whole = Run(subject, run(name).t_end, how)()
    start = whole.t[0]
    cut = start + share * (run(name).t_end - start) if share else float(whole.transitions.t[8])
    first = Run(subject, cut, how)()
    second = Run(subject, run(name).t_end, {**how, "t_start": cut, "initial": last_row(first)})()
    return whole, first, second


@each(CUT)
def test_continued(name: str) -> None:
    """The end and the joined log equal those of the whole run."""
    whole, first, second = whole_and_parts(name, CUT[name])
    assert fired(first, second) == fired(whole)
    size = np.abs(whole.rows.y).max(axis=0)
    assert (np.abs(second.rows.y[-1] - whole.rows.y[-1]) <= 1e-8 * size).all()
    assert second.rows.mode[-1].tolist() == whole.rows.mode[-1].tolist()


def test_cut_on_a_switch() -> None:
    """The first part ends after the firing, and nothing fires twice."""
    whole, first, second = whole_and_parts("open loop")
    assert fired(first, second) == fired(whole)
    np.testing.assert_allclose(second.z[-1], whole.z[-1], rtol=0, atol=1e-9)


def test_without_the_states_it_is_another_run() -> None:
    """The cut carries the states too: a continuation without them takes another course."""
    subject = run("open loop").subject
    first = Run(subject, 7.0, TIGHT)()
    assert (first.states[-1] == "slip").all()
    # Table I, s = 0.4 m while sliding: in stick the elements would break away at once, so they
    # are taken where z is smaller.
    start = last_row(first) | {"z": 0.5 * first.z[-1]}
    kept, lost = (
        Run(subject, 8.0, {"t_start": 7.0, "initial": {key: start[key] for key in keys}})()
        for keys in (start, [key for key in start if key != "states"])
    )
    assert np.abs(kept.z[-1] - lost.z[-1]).max() > 0.01
