"""The limits behind every verdict, each with the reason for its value."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["LIMITS", "Limit", "percent"]


@dataclass(frozen=True)
class Limit:
    """A number that separates two verdicts.

    Parameters
    ----------
    value : float
        The number.
    unit : str
        Its unit; ``"1"`` for a ratio.
    meaning : str
        What is compared with it.
    reason : str
        Why this value.
    """

    value: float
    unit: str
    meaning: str
    reason: str


LIMITS = {
    "break-away.fall": Limit(
        0.02,
        "1",
        "change of the break-away force from the slowest to the fastest rate, relative to that at "
        "the slowest: a fall above it is shown, a rise above it is shown wrongly",
        "measured break-away forces scatter by a few percent; in experiments they fall by tens of "
        "percent",
    ),
    "vibration.early": Limit(
        0.9,
        "1",
        "bias plus amplitude at the release, relative to the break-away force: below it the "
        "contact creeps away and does not break away",
        "a contact that rests until its break-away force is reached releases at 1; ten percent "
        "allow for the inertia of the slider",
    ),
    "hysteresis.width": Limit(
        0.02,
        "1",
        "width of the loop at F = 0, relative to its stroke: a wider loop is shown",
        "damping alone makes a loop of less than 0.1 % at this rate",
    ),
    "memory.gap": Limit(
        0.01,
        "1",
        "distance between the first and the second visit of a reversal point, relative to the "
        "stroke of the inner loop: a smaller one is a closed loop",
        "parallel Maxwell elements close the loop to rounding; one percent is far above the errors "
        "of a run and can be seen in a record",
    ),
    "memory.width": Limit(
        0.01,
        "1",
        "width of the inner loop, relative to its stroke: a narrower one is no loop",
        "a spring closes every loop, but it has nothing to remember",
    ),
    "drift.rate": Limit(
        1e-3,
        "1",
        "drift per period of the ripple, relative to the pre-sliding displacement F_s / sigma_0: "
        "a faster one is drift",
        "a thousand periods then move the slider by the whole pre-sliding displacement",
    ),
    "lag.width": Limit(
        0.005,
        "1",
        "width of the loop at the mean speed, relative to F_s, at the highest frequency: a wider "
        "one is lag, if it is wider than at the lowest frequency",
        "5 permille of F_s can be seen in a record; the errors of a run are below one permille",
    ),
    "stribeck.fall": Limit(
        0.05,
        "1",
        "fall of the friction from the lowest speed to its minimum, relative to that at the lowest "
        "speed",
        "a fall of less than five percent is not told from scatter in experiments",
    ),
    "stick-slip.amplitude": Limit(
        0.05,
        "1",
        "amplitude of the spring force (half of peak to peak), relative to F_s: a smaller one is "
        "steady sliding",
        "the transient of steady sliding has decayed to less than that",
    ),
    "stick-slip.stuck": Limit(
        0.1,
        "1",
        "share of the period in which the slider is slower than 2 % of the drive",
        "a sinusoidal oscillation that just touches v = 0 has a share of 6 %",
    ),
    "passivity.made": Limit(
        1e-3,
        "1",
        "energy given back beyond what was taken, relative to all that was exchanged: more is "
        "energy made",
        "the energy is summed over the rows of the run; the error of this sum is below 1e-4",
    ),
}


def percent(name: str) -> str:
    """Return a limit in percent.

    >>> percent("memory.gap"), percent("drift.rate")
    ('1 %', '0.1 %')
    """
    return f"{100 * LIMITS[name].value:g} %"
