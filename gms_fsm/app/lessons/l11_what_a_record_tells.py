"""Lesson 11: what a record can tell about the parameters of a model.

A fit always returns numbers, and with a good model the curves lie on each other. That says nothing
about the numbers. Here the truth is known: a GMS bank of two elements makes records with noise, and
four questions are asked of each fit.

- Was the parameter in use? An element whose threshold is larger than the amplitude is a spring: any
  larger threshold gives the same force. A good R² cannot show it; the element's transitions can.
- Was the motion made for it? Strokes of growing amplitude, longer than twice the largest threshold,
  and several speeds tell all parameters apart (`excite`).
- For how many rows do the rows count? Residuals of one model follow each other. With a correlation
  of a from row to row, n rows count for n (1 - a)/(1 + a). The textbook interval, the square root
  of sigma² (JᵀJ)⁻¹ with the derivatives J of the force, takes all n for independent.
- Does the force know the parameter at all, or a product only? A threshold is w s(v). With all
  weights halved and F_c and F_s doubled it is the same: no record can tell the two factors apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gms_fsm import (
    GMS,
    Fit,
    GMSParameters,
    Prescribed,
    Record,
    Stribeck,
    Trace,
    excite,
    fit,
    simulate,
)
from gms_fsm.charts.parameters import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["QUESTION", "TITLE", "Result", "bank", "figure", "fitted", "moved", "run", "sine"]

TITLE = "What a record can tell"
QUESTION = "What can a record tell about the parameters?"

# All values are chosen by us.
NAMES = ("k1", "k2", "weights1", "weights2")
TRUTH = np.array([2e4, 5e3, 50e-6, 200e-6])  # N/m, N/m, m/N, m/N
START = np.array([1e4, 1e4, 80e-6, 300e-6])
F_c, F_s, V_S = 1.0, 1.2, 1e-3  # N, N, m/s
AMPLITUDE, PERIOD, CYCLES = 160e-6, 2.0, 4  # m, s: a sine that element 2 does not feel
STROKE, SPEEDS = 1e-3, (5e-4, 2e-3)  # m, m/s: of the designed motion
RATE, NOISE, CORRELATION = 100.0, 20e-3, 0.95  # Hz, N, from row to row
BEGINNINGS = (0.5, 2.0)  # of F_c, where two fits of the product start
REPEATED, SURE = 200, 1.96  # records, and half of a 95 % interval in standard deviations
STEP = 1e-3  # relative, of the derivatives
GAP = 165.0  # mN, between two curves of residuals


@dataclass(frozen=True, eq=False)
class Result:
    """The runs, the fits and what is read from them.

    Parameters
    ----------
    moved : dict of str to Trace
        The bank that makes the records, on both motions, without noise.
    sine, designed : Fit
        To a sine, and to the designed motion, with white noise.
    correlated : Fit
        To the designed motion, with correlated noise.
    products : tuple of Fit
        As `designed`, with F_c and F_s free too, from two starts.
    unseen : float
        Largest change of the force on the sine if the second threshold is ten times larger, N.
    slopes : ndarray, shape (rows, 5)
        Derivatives J of the force by the logarithms of `NAMES`, and by the offset, N.
    """

    moved: dict[str, Trace]
    sine: Fit
    designed: Fit
    correlated: Fit
    products: tuple[Fit, ...]
    unseen: float
    slopes: FloatArray

    @property
    def replayed(self) -> dict[str, Trace]:
        """The runs for the replay page, by name."""
        return self.moved

    @property
    def least(self) -> float:
        """The smallest second weight with which that element does not slip on the sine, m/N."""
        trace, curve = self.moved["sine"], bank(TRUTH).parameters.stribeck
        return float((np.abs(trace.z[:, 1]) / curve(trace.v)).max())

    @property
    def hits(self) -> int:
        """How many of the four intervals of `designed` contain the truth."""
        pairs = zip(NAMES, TRUTH, strict=True)
        return sum(
            self.designed[name].low <= true <= self.designed[name].high for name, true in pairs
        )

    @property
    def weakest(self) -> str:
        """What the first of `products` says of the direction that changes the force least."""
        return self.products[0].weakest.partition("direction: ")[2].partition(";")[0]

    @cached_property
    def unit(self) -> FloatArray:
        """Standard deviations of `NAMES`, relative, for independent noise of 1 N."""
        found: FloatArray = np.sqrt(np.diag(np.linalg.inv(self.slopes.T @ self.slopes)))
        return found[: len(NAMES)]

    @property
    def from_rows(self) -> FloatArray:
        """Half intervals of `correlated` as if rows were independent, relative, shape (4,)."""
        return SURE * self.correlated.training["rmse"] * self.unit

    @property
    def from_effective(self) -> FloatArray:
        """Half intervals of `correlated` as its table gives them, relative, shape (4,)."""
        every = [self.correlated[name] for name in NAMES]
        return np.array([0.5 * (each.high - each.low) / each.value for each in every])

    @property
    def too_short(self) -> float:
        """How many times shorter intervals from rows are, the median of the four."""
        return float(np.median(self.from_effective / self.from_rows))

    @cached_property
    def coverage(self) -> tuple[float, float]:
        """Share of intervals with the truth: from rows, and from effective rows.

        Of `REPEATED` records with new noise, fitted with the derivatives at the truth.
        """
        rows, p = self.slopes.shape
        inverse = np.linalg.pinv(self.slopes)
        longer = np.sqrt((1.0 + CORRELATION) / (1.0 - CORRELATION))
        inside = np.zeros(2)
        for seed in range(REPEATED):
            error = noise(rows, CORRELATION, seed)
            missed = inverse @ error
            rest = error - self.slopes @ missed
            half = SURE * np.sqrt(rest @ rest / (rows - p)) * self.unit
            distance = np.abs(missed[: len(NAMES)])
            inside += (distance <= half).mean(), (distance <= longer * half).mean()
        short, long = inside / REPEATED
        return float(short), float(long)

    def lines(self) -> tuple[str, ...]:
        """Return the lesson as five lines.

        Returns
        -------
        tuple of str
            Question, runs, two lines of measured values, conclusion.
        """
        never = ", ".join(map(str, self.sine.never_slipped)) or "none"
        second = self.designed["weights2"]
        wide = 50.0 * (second.high - second.low) / second.value
        found = [(each["F_c"].value, each["weights1"].value) for each in self.products]
        pairs = " and ".join(
            f"F_c = {F:.3g} N with weights1 = {1e6 * w:.4g} µm/N" for F, w in found
        )
        thresholds = [F * w for F, w in found]
        short, long = (100.0 * each for each in self.coverage)
        return (
            f"Question: {QUESTION}",
            f"Run: {bank(TRUTH).title}, with k = {TRUTH[0]:g}, "
            f"{TRUTH[1]:g} N/m, weights = {1e6 * TRUTH[2]:g}, {1e6 * TRUTH[3]:g} µm/N, F_c = "
            f"{F_c:g} N makes records at {RATE:g} Hz with noise of {1e3 * NOISE:g} mN: a sine of "
            f"±{1e6 * AMPLITUDE:g} µm, and a designed motion with a stroke of {1e3 * STROKE:g} mm "
            "(all values chosen by us). k and weights are fitted from other values.",
            f"Measured: on the sine R² is {self.sine.training['r2']:.4f}. Elements that never "
            f"slipped: {never}. Cannot be told: {_listed(self.sine.open)}; any value above "
            f"{1e6 * self.least:.0f} µm/N fits as well, ten times the truth changes the force by "
            f"{self.unseen:g} N. On the designed motion R² is "
            f"{self.designed.training['r2']:.4f}. Cannot be told: {_listed(self.designed.open)}; "
            f"{self.hits} of {len(NAMES)} intervals contain the truth, weights2 is known to "
            f"±{wide:.2g} %.",
            f"Measured: with noise that is correlated by {CORRELATION:g} from row to row, "
            f"{self.slopes.shape[0]} rows count for {self.correlated.effective_rows:.0f}; "
            f"intervals from rows are {self.too_short:.1f} times shorter. Of {REPEATED} such "
            f"records (linearised) they contain the truth in {short:.0f} %, those from effective "
            f"rows in {long:.3g} %. With F_c and F_s free, too, two fits find {pairs}: products of "
            f"{' and '.join(f'{1e6 * each:.2f}' for each in thresholds)} µm. They say: "
            f"{self.weakest}.",
            "So: a good fit is no evidence for its numbers. Ask which elements slipped, count "
            "effective rows, fix one factor of each product, and design the motion before "
            "measuring.",
        )


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) or "nothing"


def run() -> Result:
    """Make the records, and fit them.

    Returns
    -------
    Result
        Runs and fits.
    """
    truth = bank(TRUTH)
    waving, motion = sine(), excite(STROKE, SPEEDS, rate=RATE)
    waved, driven = moved(truth, waving), moved(truth, motion)
    beyond = TRUTH * [1.0, 1.0, 1.0, 10.0]
    unseen = float(np.abs(force(bank(beyond), waving) - force(truth, waving)).max())
    white = recorded(motion, 0.0, 2)
    products = [
        fit(
            white,
            bank(START, scale),
            free=("k", "weights", "F_c", "F_s"),
            search="local",
            begin="relaxed",
        )
        for scale in BEGINNINGS
    ]
    return Result(
        moved={"sine": waved, "designed motion": driven},
        sine=fitted(recorded(waving, 0.0, 1)),
        designed=fitted(white),
        correlated=fitted(recorded(motion, CORRELATION, 3)),
        products=tuple(products),
        unseen=unseen,
        slopes=_slopes(motion),
    )


def bank(numbers: ArrayLike, scale: float = 1.0) -> GMS:
    """Return two elements of plain springs and sliders.

    Parameters
    ----------
    numbers : array_like, shape (4,)
        Values of `NAMES`: stiffnesses, N/m, and weights, m/N.
    scale : float
        F_c and F_s times this, and weights over it: the thresholds stay the same.

    Returns
    -------
    GMS
        The model.

    Examples
    --------
    >>> bank(TRUTH, 2.0).parameters.stribeck.F_c, bank(TRUTH, 2.0).weights.tolist()
    (2.0, [2.5e-05, 0.0001])
    """
    k, weights = np.split(np.asarray(numbers, dtype=float), 2)
    curve = Stribeck(scale * F_c, scale * F_s, V_S)
    parameters = GMSParameters(
        k,
        np.zeros(2),
        np.full(2, 1e-3),
        sigma_2=0.0,
        stribeck=curve,
        v_c=1e-6,
        weights=weights / scale,
    )
    return GMS(parameters, law="signed")


def sine(amplitude: float = AMPLITUDE) -> Record:
    """Return a sine that begins in the middle.

    Parameters
    ----------
    amplitude : float
        m.

    Returns
    -------
    Record
        Time, position and velocity.

    Examples
    --------
    >>> sine()
    <Record 'sine': 801 rows, 8 s, position, velocity>
    """
    t, w = np.arange(round(CYCLES * PERIOD * RATE) + 1) / RATE, 2.0 * np.pi / PERIOD
    x, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
    return Record.from_arrays(time=t, position=x, velocity=v, name="sine")


def moved(model: GMS, motion: Record) -> Trace:
    """Return the run of a model that follows a motion.

    Parameters
    ----------
    model : GMS
        At rest, all springs relaxed.
    motion : Record
        With time and velocity.

    Returns
    -------
    Trace
        With rows at the times of the record, and at switches.
    """
    t, v = motion.columns["time"], motion.columns["velocity"]
    return simulate(model, Prescribed((t, v)), float(t[-1]), t_eval=t)


def force(model: GMS, motion: Record) -> FloatArray:
    """Return the force at the rows of a motion, N, shape (rows,)."""
    return moved(model, motion).sample(motion.columns["time"]).F


def noise(rows: int, correlation: float, seed: int) -> FloatArray:
    """Return noise of the size `NOISE`, N, with a correlation from row to row, shape (rows,).

    ``e[i] = a e[i-1] + white noise``, filtered around the end, so that it has no beginning.
    """
    white = np.random.default_rng(seed).standard_normal(rows)
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(rows))
    made = np.fft.irfft(np.fft.rfft(white) / (1.0 - correlation * turn), rows)
    return np.asarray(NOISE * np.sqrt(1.0 - correlation**2) * made)


def recorded(motion: Record, correlation: float, seed: int) -> Record:
    """Return a motion with the force of the truth, and noise."""
    measured = force(bank(TRUTH), motion)
    return Record.from_arrays(
        time=motion.columns["time"],
        position=motion.columns["position"],
        velocity=motion.columns["velocity"],
        force=measured + noise(measured.size, correlation, seed),
        name=motion.name,
    )


def fitted(record: Record, second: float = START[3]) -> Fit:
    """Fit stiffnesses and weights, from `START`.

    Parameters
    ----------
    record : Record
        Which begins relaxed.
    second : float
        The second weight to start from, m/N.

    Returns
    -------
    Fit
        With the offset of the sensor as nuisance.
    """
    start = bank([*START[:3], second])
    return fit(record, start, free=("k", "weights"), search="local", begin="relaxed")


def _slopes(motion: Record) -> FloatArray:
    """Return the derivatives of the force at the truth by the logarithms of `NAMES`, and offset."""
    columns = []
    for i in range(len(NAMES)):
        step = 1.0 + STEP * np.eye(len(NAMES))[i]
        ahead, behind = (force(bank(each), motion) for each in (TRUTH * step, TRUTH / step))
        columns.append((ahead - behind) / (2.0 * np.log1p(STEP)))
    return np.stack([*columns, np.ones_like(columns[0])], axis=1)


def figure(result: Result) -> Figure:
    """Draw both motions, what is known of the thresholds, residuals, intervals, and the product.

    Parameters
    ----------
    result : Result
        From `run`.

    Returns
    -------
    Figure
        Panels a to f.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from plots.style import RC

    with rc_context(RC):
        sheet = Figure(figsize=(8.8, 6.4), layout="constrained")
        (wave, motion, told), (rest, sure, product) = sheet.subplots(2, 3)
        _draw_loop(wave, result.sine, "a", "a sine, signed law")
        _draw_loop(motion, result.designed, "b", "a designed motion")
        _draw_thresholds(told, result)
        _draw_residuals(rest, result)
        _draw_intervals(sure, result)
        _draw_product(product, result)
        sheet.suptitle(f"Lesson 11: {QUESTION}", x=0.01, ha="left", fontsize=12)
    return sheet


def _draw_loop(ax: Axes, found: Fit, letter: str, name: str) -> None:
    """Draw the force over the position: the record, the fitted model, and R²."""
    from plots import panels
    from plots.style import INK, PALE_GREY, TEXT_GREY

    (each,) = found.residuals()
    ax.plot(1e6 * each.x, each.measured, ".", color=PALE_GREY, markersize=4, label="record")
    ax.plot(1e6 * each.x, each.modelled, color=INK, linewidth=0.8, label="fit")
    ax.set(xlabel="x [µm]", ylabel="F [N]", xlim=(-560, 560), ylim=(-3.2, 3.9))
    never = [f"element {i} never slips" for i in found.never_slipped] or ["all elements slip"]
    ax.annotate(
        "\n".join([f"R² = {found.training['r2']:.4f}", *never]),
        (0.03, 0.97),
        xycoords="axes fraction",
        va="top",
        color=TEXT_GREY,
        fontsize=8,
    )
    if letter == "a":
        ax.legend(loc="lower right")
    panels.lettered(ax, letter, name)


def _draw_thresholds(ax: Axes, result: Result) -> None:
    """Draw the intervals of the weights from both motions."""
    from plots import panels
    from plots.style import INK, LINE_GREY, TEXT_GREY

    for name, true, up in zip(NAMES[2:], TRUTH[2:], (1.0, 0.0), strict=True):
        ax.plot([1e6 * true] * 2, [up - 0.32, up + 0.32], color=LINE_GREY, linewidth=0.9)
        ax.annotate(
            f"{name}, truth {1e6 * true:g}", (1e6 * true, up + 0.36), ha="center", fontsize=8
        )
        for found, place, marker in ((result.sine, 0.13, "o"), (result.designed, -0.17, "s")):
            each, y = found[name], up + place
            if each.told:
                ends = 1e6 * np.array([each.low, each.high])
                ax.plot(ends, [y, y], color=INK, linewidth=2.4)
                ax.plot(1e6 * each.value, y, marker, color=INK, markersize=4)
                continue
            arrow = {"arrowstyle": "->", "color": TEXT_GREY}
            ax.annotate("", (500, y), (1e6 * result.least, y), arrowprops=arrow)
            note = each.note.partition(":")[0]
            ax.annotate(note, (125, y), ha="right", va="center", color=TEXT_GREY, fontsize=8)
    for marker, label in (("o", "sine"), ("s", "designed")):
        ax.plot([], [], marker, color=INK, markersize=4, label=label)
    ax.legend(loc="lower left")
    ax.set_yticks([])
    ax.set(xlabel="weight [µm/N]", xscale="log", xlim=(18, 560), ylim=(-1.0, 1.7))
    ax.set_xticks([20, 50, 100, 200, 500], ["20", "50", "100", "200", "500"])
    ax.set_xticks([], minor=True)
    panels.lettered(ax, "c", "what is known of the weights")


def _draw_residuals(ax: Axes, result: Result) -> None:
    """Draw residuals with white and with correlated noise."""
    from plots import panels
    from plots.style import INK, TEXT_GREY

    shown = slice(1000, 1600)  # rows, of which single ones can be seen
    for found, middle, text in (
        (result.designed, GAP, "independent"),
        (result.correlated, 0.0, f"correlated by {CORRELATION:g}"),
    ):
        (each,) = found.residuals()
        left = 1e3 * (each.measured - each.modelled)[shown]
        ax.plot(each.t[shown], middle + left, color=INK, linewidth=0.6)
        rows = f"{text}: {found.effective_rows:.0f} of {each.t.size} rows"
        ax.annotate(rows, (each.t[shown][0], middle + 74.0), color=TEXT_GREY, fontsize=8)
    ticks = (-50, 0, 50)
    places = [middle + tick for middle in (0.0, GAP) for tick in ticks]
    ax.set_yticks(places, [f"{tick}" for tick in 2 * ticks])
    ax.set(xlabel="t [s]", ylabel="residual [mN], twice", ylim=(-80, GAP + 100))
    panels.lettered(ax, "d", "how many rows count")


def _draw_intervals(ax: Axes, result: Result) -> None:
    """Draw the intervals under correlated noise around the truth: from rows, effective rows."""
    from plots import panels
    from plots.style import INK, LINE_GREY

    places = np.arange(len(NAMES))
    found = np.array([result.correlated[name].value for name in NAMES])
    off = 100.0 * (found / TRUTH - 1.0)
    for half, aside, colour, label in (
        (result.from_effective, 0.0, LINE_GREY, "from effective rows"),
        (result.from_rows, 0.25, INK, "from rows"),
    ):
        ends = off + 100.0 * np.array([-half, half])
        ax.vlines(places + aside, *ends, color=colour, linewidth=1.8, label=label)
        ax.plot(places + aside, off, "o", color=colour, markersize=3.5)
    ax.axhline(0.0, color=INK, linestyle=":", linewidth=0.9)
    ax.legend(loc="upper right")
    ax.set_xticks(places + 0.12, NAMES, fontsize=8)
    ax.set(ylabel="deviation from the truth [%]", ylim=(-2.4, 3.4))
    panels.lettered(ax, "e", "95 % intervals, correlated")


def _draw_product(ax: Axes, result: Result) -> None:
    """Draw what the fits of the product found, on the curve of equal thresholds."""
    from plots import panels
    from plots.style import INK, LINE_GREY, TEXT_GREY

    F = np.geomspace(0.2, 3.0, 100)
    ax.loglog(F, 1e6 * TRUTH[2] * F_c / F, color=LINE_GREY, linewidth=0.9)
    ax.annotate(
        f"weights1 · $F_c$ = {1e6 * TRUTH[2] * F_c:g} µm", (0.22, 17), color=TEXT_GREY, fontsize=8
    )
    ax.plot(F_c, 1e6 * TRUTH[2], "x", color=INK, markersize=6)
    ax.annotate("truth", (F_c, 1e6 * TRUTH[2]), (6, 3), textcoords="offset points", fontsize=8)
    for each, side, (right, up) in zip(
        result.products, ("left", "right"), ((6, 3), (-6, -9)), strict=True
    ):
        here = each["F_c"].value, 1e6 * each["weights1"].value
        ax.plot(*here, "o", color=INK, markersize=5)
        text = f"RMSE {1e3 * each.training['rmse']:.3f} mN"
        ax.annotate(
            text,
            here,
            (right, up),
            textcoords="offset points",
            color=TEXT_GREY,
            fontsize=8,
            ha=side,
        )
    ax.set_xticks([0.2, 0.5, 1, 2], ["0.2", "0.5", "1", "2"])
    ax.set_yticks([20, 50, 100, 200], ["20", "50", "100", "200"])
    ax.set_xticks([], minor=True)
    ax.set_yticks([], minor=True)
    ax.set(xlabel="$F_c$ [N]", ylabel="weights1 [µm/N]", xlim=(0.2, 4.5), ylim=(15, 260))
    panels.lettered(ax, "f", "only the product is told")
