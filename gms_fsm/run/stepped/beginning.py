"""When what steps begins, and how it may be integrated."""

from __future__ import annotations

import dataclasses

from gms_fsm.charts.parameters import checked_scalar
from gms_fsm.errors import ParameterError
from gms_fsm.run.problem import LATEST
from gms_fsm.run.settings import Settings


def usable(settings: Settings, *events: str) -> Settings:
    """Return settings for stepping, or refuse."""
    if not isinstance(settings.method, str) or settings.events not in events:
        raise ParameterError(
            "only the methods of gms-fsm that locate switches can be handed over",
            place="settings",
            advice='leave method and events out, or choose method="dp45"',
        )
    return dataclasses.replace(settings, engine="ifelse", output="end", t_eval=None)


def begin(t: object) -> tuple[float, float]:
    """Return the time at which a friction begins, and some later time."""
    start = checked_scalar("t", t, "finite")
    if not -LATEST <= start < LATEST:
        raise ParameterError(
            "the clock would be too coarse",
            place="t",
            value=start,
            advice=f"at least {-LATEST:g} s, and less than {LATEST:g} s",
        )
    return start, min(start + 1.0, LATEST)
