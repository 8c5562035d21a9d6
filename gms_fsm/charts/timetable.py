"""A chart that sends events at given times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.charts.parameters import checked_array
from gms_fsm.errors import ChartError
from gms_fsm.foundation.arguments import checked_kind


def timetable(times: Mapping[str, float | Sequence[float]]) -> Chart:
    """Return the chart of a `Supervisor` that sends events at given times.

    Parameters
    ----------
    times : mapping of str to float or sequence of float
        For each event when it is sent, s; events of one time in the order listed.

    Returns
    -------
    Chart
        With one state for each sending that is still to come.

    Raises
    ------
    ChartError, ParameterError
        If there are no events, a name is no name, or a time is not finite.

    Examples
    --------
    >>> chart = timetable({"press": (0.5, 2.0), "release": 1.0})
    >>> [(edge.name, edge.guard) for edge in chart.transitions]
    [('press_1', 't >= 0.5'), ('release_2', 't >= 1.0'), ('press_3', 't >= 2.0')]
    """
    given = checked_kind("times", times, Mapping, "a mapping such as {'press': (0.5, 2.0)}")
    rows = sorted(
        (
            (time, event)
            for event, each in given.items()
            for time in checked_array(
                f"times[{event!r}]", each if hasattr(each, "__len__") else [each], None, "finite"
            ).tolist()
        ),
        key=lambda row: row[0],
    )
    if not rows:
        raise ChartError("it sends no event", place="timetable", advice="give {'press': 0.5}")
    states = [*(f"before_{i}" for i in range(1, len(rows) + 1)), "done"]
    return Chart(
        "timetable",
        inputs=("t",),
        velocities=(),
        states=[*map(State, states)],
        transitions=[
            Transition(f"{event}_{i}", states[i - 1], states[i], guard=f"t >= {time!r}", emit=event)
            for i, (time, event) in enumerate(rows, start=1)
        ],
    )
