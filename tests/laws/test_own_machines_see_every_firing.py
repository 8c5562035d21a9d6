"""A user's own machines see every firing once, with the same values in every engine.

The machines engine fires each edge through them; the compiled one replays its log. They end in the
states of the last row, and looking on changes nothing.
"""

from __future__ import annotations

from typing import Any

import pytest

from gms_fsm import ElementMachines, System, Trace
from tests.corpus import ENGINES, FEW, each, run, trace
from tests.helpers import other_parts, same_logs

PLACES = ("prepare_event", "before_state_change", "after_state_change", "finalize_event")
Call = tuple[Any, ...]


def watched(subject: Any, calls: list[Call], contact: str = "") -> ElementMachines:
    """Return machines that record every callback at every place, with what the element shows."""
    made, chart = ElementMachines(subject), subject.chart
    shown = ("t", "x", "v", "s", *chart.variables, *chart.parameter_names)

    def note(place: str) -> Any:
        def callback(event: Any) -> None:
            e = event.model
            scene = [repr(getattr(e, name, None)) for name in shown]
            calls.append((place, contact, event.event.name, e.index, e.state, *scene))

        return callback

    for place in PLACES:
        setattr(made.machine, place, [note(place)])
    for state in chart.states:
        for kind in ("on_enter", "on_exit"):
            getattr(made.machine, f"{kind}_{state.name}")(note(kind))
    return made


def seen(name: str, engine: str, **output: Any) -> tuple[Trace, list[Call]]:
    """Run with machines of one's own for every contact; check their states at the end."""
    calls, subject = list[Call](), run(name).subject[0]
    if isinstance(subject, System):
        made = {one.name: watched(one, calls, one.name) for one in subject.contacts}
        found = run(name)(engine=engine, machines=made, **output)
        ends = [found.contact(one).states[-1] for one in made]
    else:
        made = {"": watched(subject, calls)}
        found = run(name)(engine=engine, machines=made[""], **output)
        ends = [found.states[-1]]
    for machines, states in zip(made.values(), ends, strict=True):
        assert [element.state for element in machines.elements] == states.tolist()
    return found, calls


@pytest.mark.every(2)
@each(FEW)
def test_every_callback_at_every_firing(name: str) -> None:
    found: list[list[Call]] = []
    for engine in sorted({*ENGINES} - {"ifelse"}):
        one, calls = seen(name, engine)
        assert other_parts(one, trace(name)) == []
        log = one.transitions
        contacts = log.contact.tolist() if "contact" in log.dtype.names else [""] * len(log)
        after = [call[1:6] for call in calls if call[0] == "after_state_change"]
        fired = zip(contacts, log.edge, log.element, log.target, log.t, strict=True)
        assert after == [(*firing, repr(float(t))) for *firing, t in fired]
        assert len(calls) == 6 * len(log)
        found.append(calls)
    assert all(calls == found[0] for calls in found)


@each(["pulled mass", "system two blocks"])
def test_whatever_is_recorded(name: str) -> None:
    """They run where only the end is recorded, too."""
    for engine in sorted({*ENGINES} - {"ifelse"}):
        end, calls = seen(name, engine, output="end")
        same_logs(end, trace(name))
        assert calls == seen(name, engine)[1]
