"""Lesson 10: which friction model shows what.

No friction model is the best one. Each leaves something out, and one with more state variables
costs more: more parameters to identify, more equations to integrate. So ask what a model must show.
Five models with the same friction, and the same stiffness and damping where they have any, are put
on one bench, and five phenomena are measured:

- Break-away over the force rate: a slow pull meets more friction than a fast one.
- Nonlocal memory: an inner loop of force and displacement closes where it began.
- Rest under bias and ripple: a load far below break-away must not move the contact.
- Frictional lag: friction is higher while the speed rises than while it falls.
- Passivity: a contact never gives back more energy than it has taken.

Each verdict is a number against a threshold, and its reason lies in the state of the model. A
contact that locks has no deflection: no loop in pre-sliding, no lag, and the same break-away force
at every rate. LuGre has one deflection, which yields under any load: it lags, but it drifts, and it
forgets where the force turned. The elasto-plastic model is LuGre with an elastic range: it rests,
but its single deflection still forgets. A GMS bank has one deflection per element; those that stick
remember the reversal. Its published law has the wrong sign for v < 0 (lesson 4): it makes energy.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gms_fsm import PhenomenaTable, Trace, measure_phenomena
from gms_fsm.phenomena._presliding import nested
from gms_fsm.phenomena._specimens import specimens_of
from gms_fsm.phenomena.limits import LIMITS
from gms_fsm.phenomena.measure import Bench

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Result", "figure", "run"]

TITLE = "Which model"
QUESTION = "Which friction model shows what?"

MODELS = ("stiction", "lugre", "elasto-plastic", "gms-signed", "gms-published")
PHENOMENA = ("break-away", "memory", "drift", "lag", "passivity")
NAMES = {"lugre": "LuGre", "gms-signed": "GMS, signed law", "gms-published": "GMS, published law"}
SLOW, FAST = 0.1, 50.0  # N/s: the slowest and the fastest pull
BENCH = Bench()


@dataclass(frozen=True, eq=False)
class Result:
    """The table, the runs and what is read from them.

    Parameters
    ----------
    table : PhenomenaTable
        `MODELS` against `PHENOMENA`.
    nested : dict of str to Trace
        The runs of the memory experiment, by model.
    states : dict of str to int
        Number of state variables of each model's contact.
    """

    table: PhenomenaTable
    nested: dict[str, Trace]
    states: dict[str, int]

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        names = ("gms-signed", "lugre")
        return {NAMES[name]: self.nested[name] for name in names}

    def number(self, model: str, phenomenon: str, name: str = "") -> float:
        """Return a measured number of a model.

        Parameters
        ----------
        model, phenomenon : str
            A cell of the table.
        name : str
            Name of the number; the first one if omitted.

        Returns
        -------
        float
            In its unit.
        """
        found = self.table.cell(model, phenomenon)
        return found.number(name) if name else found.numbers[0].value

    def threshold(self, model: str, phenomenon: str) -> float:
        """Return the threshold of a model's verdict in the unit of its first number.

        Parameters
        ----------
        model, phenomenon : str
            A cell of the table.

        Returns
        -------
        float
            N, %, µm, mN or mJ.
        """
        if phenomenon == "break-away":
            slowest = self.number(model, phenomenon, f"break-away force at {SLOW:g} N/s")
            return LIMITS["break-away.fall"].value * slowest
        if phenomenon == "memory":
            return 100.0 * LIMITS["memory.gap"].value
        if phenomenon == "drift":
            return 1e6 * LIMITS["drift.rate"].value * BENCH.bristle
        if phenomenon == "lag":
            return 1e3 * LIMITS["lag.width"].value * BENCH.F_s
        return LIMITS["passivity.made"].value * self.number(model, phenomenon, "energy exchanged")

    def choice(self, wanted: Iterable[str]) -> str:
        """Return the smallest model that shows what is wanted, and nothing wrongly.

        The smallest is the one with the fewest state variables.

        Parameters
        ----------
        wanted : iterable of str
            Some of `PHENOMENA`.

        Returns
        -------
        str
            Its name; empty if there is none.
        """
        wanted = set(wanted)
        for model in sorted(MODELS, key=self.states.__getitem__):
            verdicts = {name: self.table.cell(model, name).verdict for name in PHENOMENA}
            shown = {name for name, verdict in verdicts.items() if verdict == "shows"}
            if wanted <= shown and "shows wrongly" not in verdicts.values():
                return model
        return ""

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """

        def each(phenomenon: str, digits: int, name: str = "") -> str:
            values = (round(self.number(model, phenomenon, name), digits) for model in MODELS)
            return ", ".join(f"{value + 0.0:.{digits}f}" for value in values)  # no -0.0

        elements = self.states["gms-signed"]
        wanted = (["drift"], ["drift", "lag"], ["drift", "lag", "memory"])
        chosen = [f"{model} ({self.states[model]})" for model in map(self.choice, wanted)]
        exchanged = [self.number(model, "passivity", "energy exchanged") for model in MODELS]
        return (
            f"Question: {QUESTION}",
            f"Run: {', '.join(MODELS)} (GMS with {elements} elements, signed law and published "
            f"law) with F_c = {BENCH.F_c:g} N, F_s = {BENCH.F_s:g} N, sigma_0 = {BENCH.sigma_0:g} "
            "N/m on one bench (all values chosen by us). Numbers below are in this order.",
            f"Measured: a ripple below break-away moves the slider by {each('drift', 2)} µm per "
            f"period (threshold {self.threshold('lugre', 'drift'):g} µm). The inner loops miss "
            f"their beginning by {each('memory', 2)} % of their stroke (threshold "
            f"{self.threshold('lugre', 'memory'):g} %; the first and the last have no inner "
            f"loop). In three cycles the contacts make {each('passivity', 2)} mJ (threshold "
            f"{100 * LIMITS['passivity.made'].value:g} % of the {min(exchanged):.2f} to "
            f"{max(exchanged):.2f} mJ exchanged).",
            f"Measured: from {SLOW:g} to {FAST:g} N/s the break-away force falls by "
            f"{each('break-away', 2)} N (threshold {self.threshold('stiction', 'break-away'):.2f} "
            f"N). At 25 rad/s friction lags by {each('lag', 1, 'width of the loop at 25 rad/s')} "
            f"mN (threshold {self.threshold('lugre', 'lag'):g} mN).",
            "So: choose the model with the fewest state variables that shows what matters and "
            f"nothing wrongly. For a contact that rests: {chosen[0]}; that also lags: {chosen[1]}; "
            f"that also remembers reversals: {chosen[2]}.",
        )


def run() -> Result:
    """Put the models on the bench.

    Returns
    -------
    Result
        The table, and the runs of the memory experiment.
    """
    specimens = specimens_of(MODELS, BENCH)
    runs = {each.name: nested(each)[1] for each in specimens}
    return Result(
        table=measure_phenomena(MODELS, PHENOMENA, bench=BENCH),
        nested=runs,
        states={name: len(trace.places.variables) * trace.places.n for name, trace in runs.items()},
    )


def figure(result: Result) -> Figure:
    """Draw the verdicts with their numbers, and three experiments that explain them.

    Parameters
    ----------
    result : Result
        From `run`.

    Returns
    -------
    Figure
        The matrix, and panels a to c.
    """
    from matplotlib import rc_context

    from plots import figures
    from plots.style import RC

    notes = ["threshold", *_thresholds(result)]
    title = f"Lesson 10: {QUESTION}"
    sheet = figures.phenomena_matrix(result.table, title=title, notes=notes, below=2.7)
    with rc_context(RC):
        height = sheet.get_figheight()
        places = [(left, 0.5 / height, 0.235, 1.95 / height) for left in (0.085, 0.41, 0.745)]
        drift, memory, energy = (sheet.add_axes(place) for place in places)
        _draw_drift(drift, result)
        _draw_memory(memory, result)
        _draw_energy(energy, result)
    return sheet


def _thresholds(result: Result) -> list[str]:
    """Return the thresholds as short texts, in the order of the columns of the table."""
    texts = {
        "break-away": f"{result.threshold('stiction', 'break-away'):.2f} N",
        "memory": f"{result.threshold('lugre', 'memory'):g} %, and a loop",
        "drift": f"{result.threshold('lugre', 'drift'):g} µm",
        "lag": f"{result.threshold('lugre', 'lag'):g} mN at 25 rad/s",
        "passivity": f"{100 * LIMITS['passivity.made'].value:g} % of exchanged",
    }
    return [texts[each.name] for each in result.table.phenomena]


def _draw_drift(ax: Axes, result: Result) -> None:
    from plots import panels
    from plots.style import INK, LINE_GREY, TEXT_GREY

    grey = TEXT_GREY
    for model, look, colour, text, tint, place in (
        ("lugre", "-", LINE_GREY, NAMES["lugre"], TEXT_GREY, (6.5, 55.0)),
        ("gms-signed", "-", INK, NAMES["gms-signed"], INK, (10.5, 14.0)),
        ("elasto-plastic", "--", grey, "elasto-plastic", grey, (10.5, -6.5)),
    ):
        curve = result.table.cell(model, "drift").curves[0]
        ax.plot(curve.x, curve.y, look, color=colour, linewidth=0.9)
        ax.annotate(text, place, color=tint, fontsize=8)
    ax.set(xlabel="t [s]", ylabel="x [µm]", xlim=(0, 24), ylim=(-10, 95))
    panels.lettered(ax, "a", "bias and ripple: LuGre drifts")


def _draw_memory(ax: Axes, result: Result) -> None:
    from plots import panels
    from plots.style import INK, TEXT_GREY

    for model, look, colour in (("lugre", "--", TEXT_GREY), ("gms-signed", "-", INK)):
        curve = result.table.cell(model, "memory").curves[0]
        ax.plot(curve.x, curve.y, look, color=colour)
    gap, end = result.number("lugre", "memory", "gap"), result.nested["lugre"].x[-1] * 1e6
    arrow = {"arrowstyle": "<->", "color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (end, 1.55), (end - gap, 1.55), arrowprops=arrow)
    ax.annotate(f"LuGre: gap {gap:.1f} µm", (end, 1.68), color=TEXT_GREY, fontsize=8, ha="right")
    ax.annotate(NAMES["gms-signed"], (17.0, -1.38), color=INK, fontsize=8)
    ax.set(xlabel="x [µm]", ylabel="applied force [N]", xlim=(-15, 66), ylim=(-1.5, 1.95))
    panels.lettered(ax, "b", "reversals: GMS remembers")


def _draw_energy(ax: Axes, result: Result) -> None:
    from plots import panels
    from plots.style import INK, LINE_GREY, TEXT_GREY

    for model, look, colour, tint, place in (
        ("gms-published", "--", TEXT_GREY, TEXT_GREY, (10.0, -3.6)),
        ("gms-signed", "-", INK, INK, (10.0, 0.75)),
    ):
        curve = result.table.cell(model, "passivity").curves[0]
        ax.plot(curve.x, curve.y, look, color=colour)
        ax.annotate(NAMES[model], place, color=tint, fontsize=8)
    ax.axhline(0, color=LINE_GREY, linewidth=0.8, zorder=0)
    ax.set(xlabel="t [ms]", ylabel="energy taken [mJ]", xlim=(0, 450), ylim=(-4.2, 1.3))
    panels.lettered(ax, "c", "energy in three cycles")
