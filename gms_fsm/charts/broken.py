"""Incorrect readings of the GMS element's guards, as data with an explanation of each fault.

Each differs from `gms_fsm.charts.gms` by one or two edges and looks right at first sight. They
demonstrate `gms_fsm.prove` and serve teaching; they are not models, and nothing in the package
builds on them. All use the signed slip law, so that only the guards are wrong.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from gms_fsm.charts.chart import Chart, Transition
from gms_fsm.charts.gms import TABLE_I, gms_element
from gms_fsm.charts.registry import Entry

__all__ = ["BROKEN", "CHARTS", "Broken"]


@dataclass(frozen=True)
class Broken:
    """A chart with a fault.

    Parameters
    ----------
    chart : Chart
        The chart.
    wrong : str
        What is wrong with it, in one sentence.
    domain : tuple of str, optional
        The domain in which the fault shows; None for the default one.
    """

    chart: Chart
    wrong: str
    domain: tuple[str, ...] | None = None


def _reading(name: str, *edges: Transition) -> Chart:
    return replace(gms_element("signed"), name=f"GMS element, {name}", transitions=edges)


BROKEN: Mapping[str, Broken] = {
    "overlap": Broken(
        _reading(
            "overlapping guards",
            Transition("break_away", "stick", "slip", guard="abs(z) >= s"),
            Transition("arrest", "slip", "stick", guard="abs(v) <= v_c"),
        ),
        "Break-away depends on z alone and arrest on v alone, so both hold at once and the element "
        "switches without end: livelock.",
    ),
    "literal": Broken(
        _reading(
            "the paper's prose read literally",
            Transition("break_away", "stick", "slip", guard="z >= s"),
            Transition("arrest", "slip", "stick", guard="v <= v_c"),
        ),
        "The signs of z and v are ignored as well: livelock at z = s, v = 0, and a backward "
        "motion never breaks away.",
    ),
    "memoryless": Broken(
        _reading(
            "memoryless guards",
            Transition("break_away", "stick", "slip", guard="abs(z) >= s"),
            Transition("arrest", "slip", "stick", guard="abs(z) < s"),
        ),
        "The two guards never hold at once, but each is the negation of the other: while s rises, "
        "stick pushes z above s and slip immediately lets it fall below: chattering.",
    ),
    "arms": Broken(
        _reading(
            "break-away arms without velocity, s = 0 allowed",
            Transition("break_away_forward", "stick", "slip", guard="z >= s"),
            Transition("break_away_backward", "stick", "slip", guard="z <= -s"),
            Transition("arrest", "slip", "stick", guard="abs(v) <= v_c and abs(z) < s"),
        ),
        "With s = 0 both break-away arms hold at once at z = 0, and only the order of the edges "
        "decides which one is taken.",
        domain=("s >= 0", "v_c > 0", "C > 0"),
    ),
}

CHARTS = tuple(
    Entry(
        f"broken:{name}",
        broken.chart,
        TABLE_I["stick-slip"],
        wrong=broken.wrong,
        domain=broken.domain,
    )
    for name, broken in BROKEN.items()
)
