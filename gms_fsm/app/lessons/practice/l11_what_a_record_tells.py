"""Lesson 11: What a record can tell.

What can a record tell about the parameters?

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

## Predict

A GMS bank of two elements makes records, with noise of 20 mN in a force of about 2 N. Its weights
are 50 and 200 µm/N; with F_c = 1 N its elements slip at a deflection of 50 µm and 200 µm or more. A
fit is to find k1, k2, weights1 and weights2 again.

1. From a sine of ±160 µm the fit has R² = 0.9998. Which of the four parameters is nevertheless
   unknown?
2. The noise of a second record is correlated by a = 0.95 from one row to the next: n of its rows
   count for n (1 - a)/(1 + a). By which factor are intervals too short if all rows are taken for
   independent?
3. In a third fit F_c and F_s are free as well. A threshold is weight times s(v), and s(v) is
   proportional to F_c and F_s. Two fits begin at F_c = 0.5 N and 2 N, both with the same
   thresholds. What is the ratio of the larger to the smaller F_c that they find?

## Measure

Run: {title}, with k = {TRUTH[0]:g}, {TRUTH[1]:g} N/m, weights = {TRUTH[2]!u:g},
{TRUTH[3]!u:g} µm/N, F_c = {F_c:g} N makes records at {RATE:g} Hz with noise of {NOISE!m:g} mN: a
sine of ±{AMPLITUDE!u:g} µm, and a designed motion with a stroke of {STROKE!m:g} mm (all values
chosen by us). k and weights are fitted from other values.

Measured: on the sine R² is {on_sine.training[r2]:.4f}. Elements that never slipped:
{on_sine.never_slipped}. Cannot be told: {on_sine.open}; any value above {least!u:.0f} µm/N fits as
well, ten times the truth changes the force by {unseen:g} N. On the designed motion R² is
{designed.training[r2]:.4f}. Cannot be told: {opened}; {hits} of 4 intervals contain the truth,
weights2 is known to ±{wide!p:.2g} %.

Measured: with noise that is correlated by {CORRELATION:g} from row to row, {rows} rows count for
{correlated.effective_rows:.0f}; intervals from rows are up to {too_short:.1f} times too short. Of
{REPEATED} such records (linearised) they contain the truth in {coverage[0]!p:.0f} %, those from
effective rows in {coverage[1]!p:.3g} %. With F_c and F_s free, too, two fits find {pairs}: products
of {thresholds} µm. They say: {weakest}.

So: a good fit is no evidence for its numbers. Ask which elements slipped, count effective rows, fix
one factor of each product, and design the motion before measuring.

## Why

An element slips once it is deflected by its threshold. With ±160 µm the second element is a spring:
every threshold above 160 µm gives the same force, and the fit returns the value at which it began.

n rows count for n (1 - 0.95)/(1 + 0.95), about 1 in 39; intervals are therefore up to √39 =
6.2 times longer. A fit estimates the correlation from its residuals: its factor scatters around it.

Every threshold is w s(v). With twice the curve s(v) and half the weights w nothing changes, so that
the ratio of the two values of F_c is that of the starts: both may move by the same factor, but
nothing in the record moves them towards each other.

## What the tables say

Each fit names what cannot be told, and the direction that changes the force
least:

```python
for name, each in {"sine": result.on_sine, "F_c free": result.products[0]}.items():
    print(name)
    for line in str(each).splitlines():
        print(textwrap.fill(line, 100))
    print()
```

## Vary a parameter

The amplitude of the sine. At which amplitude can the second threshold be told? The search for the
second weight starts at the truth, so that it is not to blame.

```python
from matplotlib.figure import Figure

from gms_fsm.app.lessons.practice.l11_what_a_record_tells import (
    START,
    TRUTH,
    bank,
    fitted,
    recorded,
    sine,
)


def known(amplitude):
    record = recorded(sine(1e-6 * amplitude), 0.0, 1)
    told = fitted(record, bank([*START[:3], TRUTH[3]]))
    second = told["weights2"]
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    ax = figure.subplots()
    (each,) = told.residuals()
    ax.plot(1e6 * each.x, each.measured, ".", color="0.7", markersize=4)
    ax.plot(1e6 * each.x, each.modelled, color="0.1", linewidth=0.8)
    ax.set(xlabel="$x$ [µm]", ylabel="$F$ [N]")
    interval = f"{1e6 * second.low:.1f} to {1e6 * second.high:.1f} µm/N"
    value = interval if second.told else second.note
    ax.set_title(f"R² = {told.training['r2']:.4f}; weights2: {value}", fontsize=9)
    return figure


vary(known, 250, 40, 400, 10, "µm")
```

## Try

- `fitted(recorded(sine(3e-4), 0.0, 1))` starts with a second weight of 300 µm/N, at which the
  second element never slips: there the force does not depend on it, and a local search has no slope
  to follow. Why is the truth found all the same? (Looking for the ends of the interval meets a
  better fit, and the search goes on from there.)
- How much noise is needed until R² on the sine falls below 0.99? Is the threshold then told less?
- Double the number of rows with `RATE`. By how much do the intervals become shorter under
  independent noise, and by how much under correlated noise of the same correlation time in seconds?
- Fix F_c and free F_s and v_s instead: `fit(..., free=("k", "weights", "F_s", "v_s"))`. Are they
  told by the designed motion? And by the designed motion with its lowest speed only?
- `result.on_sine.profile("weights2")` moves the threshold and fits all others again. Where does it
  begin to rise?
- Fit a record of your own, and read `.open`, `.never_slipped` and `.weakest` before the values.
"""

from __future__ import annotations

from functools import partial
from typing import Any

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
from gms_fsm.app.lessons.engine.lesson import DOTS, FASTEST, GUIDE, Lesson, grid, note, ticks
from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.charts.parameters import FloatArray
from plots.style import INK, LINE_GREY, PALE_GREY, TEXT_GREY

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


def run() -> dict[str, Any]:
    """Make the records, and fit them."""
    truth, waving, motion = bank(TRUTH), sine(), excite(STROKE, SPEEDS, rate=RATE)
    waved = moved(truth, waving)
    replayed = {"sine": waved, "designed motion": moved(truth, motion)}
    title = truth.title

    on_sine = fitted(recorded(waving, 0.0, 1))
    # The smallest second weight with which that element does not slip on the sine, m/N.
    least = (abs(waved.z[:, 1]) / truth.parameters.stribeck(waved.v)).max()
    beyond = bank(TRUTH * [1.0, 1.0, 1.0, 10.0])
    unseen = abs(force(beyond, waving) - force(truth, waving)).max()

    white = recorded(motion, 0.0, 2)
    designed, correlated = fitted(white), fitted(recorded(motion, CORRELATION, 3))
    unknown = ", ".join(on_sine.open)
    opened, wide = designed.open or "nothing", _half(designed, "weights2")
    ends = np.array([(designed[name].low, designed[name].high) for name in NAMES])
    hits = ((ends[:, 0] <= TRUTH) & (ends[:, 1] >= TRUTH)).sum()

    slopes = _slopes(motion)
    rows = len(slopes)
    # Standard deviations of `NAMES`, relative, for independent noise of 1 N.
    unit = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))[: len(NAMES)]
    # Half intervals, relative: as if rows were independent, and as the table gives them.
    from_rows = SURE * correlated.training["rmse"] * unit
    from_effective = np.array([_half(correlated, name) for name in NAMES])
    too_short = np.sqrt(correlated.training["rows"] / correlated.effective_rows)
    coverage = _coverage(slopes, unit)

    free = ("k", "weights", "F_c", "F_s")
    products = [fitted(white, bank(START, scale), free) for scale in BEGINNINGS]
    found = [(each["F_c"].value, each["weights1"].value) for each in products]
    ratio = max(F for F, _ in found) / min(F for F, _ in found)
    pairs = " and ".join(f"F_c = {F:.3g} N with weights1 = {1e6 * w:.4g} µm/N" for F, w in found)
    thresholds = " and ".join(f"{1e6 * F * w:.2f}" for F, w in found)
    # What the first of them says of the direction that changes the force least.
    weakest = products[0].weakest.partition("direction: ")[2].partition(";")[0]
    return locals()


def bank(numbers: ArrayLike, scale: float = 1.0) -> GMS:
    """Return two elements of plain springs and sliders, from the values of `NAMES`.

    F_c and F_s are multiplied by the scale, and weights divided by it: the thresholds stay.

    Examples
    --------
    >>> bank(TRUTH, 2.0).parameters.stribeck.F_c, bank(TRUTH, 2.0).weights.tolist()
    (2.0, [2.5e-05, 0.0001])
    """
    k, weights = np.split(np.asarray(numbers, dtype=float), 2)
    curve = Stribeck(scale * F_c, scale * F_s, V_S)
    damping: dict[str, Any] = {"sigma": np.zeros(2), "C": np.full(2, 1e-3), "sigma_2": 0.0}
    parameters = GMSParameters(k, stribeck=curve, v_c=1e-6, weights=weights / scale, **damping)
    return GMS(parameters, law="signed")


def sine(amplitude: float = AMPLITUDE) -> Record:
    """Return a sine [m] that begins in the middle.

    Examples
    --------
    >>> sine()
    <Record 'sine': 801 rows, 8 s, position, velocity>
    """
    t, w = np.arange(round(CYCLES * PERIOD * RATE) + 1) / RATE, 2.0 * np.pi / PERIOD
    x, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
    return Record.from_arrays(time=t, position=x, velocity=v, name="sine")


def moved(model: GMS, motion: Record) -> Trace:
    """Return the run of a model, relaxed at the begin, at the times of a motion and at switches."""
    t, v = motion.columns["time"], motion.columns["velocity"]
    return simulate(model, Prescribed((t, v)), float(t[-1]), t_eval=t, engine=FASTEST)


def force(model: GMS, motion: Record) -> FloatArray:
    """Return the force at the rows of a motion, N."""
    return moved(model, motion).sample(motion.columns["time"]).F


def noise(rows: int, correlation: float, seed: int) -> FloatArray:
    """Return noise of the size `NOISE`, N, with a correlation from row to row.

    ``e[i] = a e[i-1] + white noise``, filtered around the end, so that it has no beginning.
    """
    white = np.random.default_rng(seed).standard_normal(rows)
    turn = np.exp(-2j * np.pi * np.fft.rfftfreq(rows))
    made = np.fft.irfft(np.fft.rfft(white) / (1.0 - correlation * turn), rows)
    return np.asarray(NOISE * np.sqrt(1.0 - correlation**2) * made)


def recorded(motion: Record, correlation: float, seed: int) -> Record:
    """Return a motion with the force of the truth, and noise."""
    measured = force(bank(TRUTH), motion)
    columns: dict[str, Any] = {**motion.columns}
    columns["force"] = measured + noise(measured.size, correlation, seed)
    return Record.from_arrays(**columns, name=motion.name)


def fitted(
    record: Record, start: GMS | None = None, free: tuple[str, ...] = ("k", "weights")
) -> Fit:
    """Fit a record that begins relaxed, by default from `START`; an offset is a nuisance."""
    return fit(record, start or bank(START), free=free, search="local", begin="relaxed")


def _half(found: Fit, name: str) -> float:
    """Return half of an interval, relative."""
    return 0.5 * (found[name].high - found[name].low) / found[name].value


def _slopes(motion: Record) -> FloatArray:
    """Return the derivatives of the force at the truth by the logarithms of `NAMES`, and offset."""
    columns = []
    for step in 1.0 + STEP * np.eye(len(NAMES)):
        ahead, behind = (force(bank(each), motion) for each in (TRUTH * step, TRUTH / step))
        columns.append((ahead - behind) / (2.0 * np.log1p(STEP)))
    return np.stack([*columns, np.ones_like(columns[0])], axis=1)


def _coverage(slopes: FloatArray, unit: FloatArray) -> FloatArray:
    """Return the share of intervals that contain the truth: from rows, and from effective rows.

    Of `REPEATED` records with new noise, fitted with the derivatives at the truth.
    """
    rows, p = slopes.shape
    inverse = np.linalg.pinv(slopes)
    longer = np.sqrt((1.0 + CORRELATION) / (1.0 - CORRELATION))
    inside = np.zeros(2)
    for seed in range(REPEATED):
        error = noise(rows, CORRELATION, seed)
        missed = inverse @ error
        rest = error - slopes @ missed
        half = SURE * np.sqrt(rest @ rest / (rows - p)) * unit
        distance = abs(missed[: len(NAMES)])
        inside += (distance <= half).mean(), (distance <= longer * half).mean()
    return inside / REPEATED


def _loop(ax: Any, r: Any, name: str, title: str) -> str:
    found = r.values[name]
    (each,) = found.residuals()
    ax.plot(1e6 * each.x, each.measured, ".", color=PALE_GREY, markersize=4, label="record")
    ax.plot(1e6 * each.x, each.modelled, color=INK, linewidth=0.8, label="fit")
    ax.set(xlabel="$x$ [µm]", ylabel="$F$ [N]", xlim=(-560, 560), ylim=(-3.2, 3.9))
    never = [f"element {i} never slips" for i in found.never_slipped] or ["all elements slip"]
    note(ax, "\n".join([f"R² = {found.training['r2']:.4f}", *never]), (0.03, 0.97), inside=True)
    if name == "on_sine":
        ax.legend(loc="lower right")
    return title


def _weights(ax: Any, r: Any) -> str:
    """Draw the intervals of the weights from both motions."""
    for name, true, up in zip(NAMES[2:], 1e6 * TRUTH[2:], (1.0, 0.0), strict=True):
        ax.vlines(true, up - 0.32, up + 0.32, **GUIDE)
        note(ax, f"{name}, truth {true:g}", (true, up + 0.36), ha="center", color=INK)
        for found, y, marker in ((r.on_sine, up + 0.13, "o"), (r.designed, up - 0.17, "s")):
            each = found[name]
            if each.told:
                ax.hlines(y, 1e6 * each.low, 1e6 * each.high, color=INK, linewidth=2.4)
                ax.plot(1e6 * each.value, y, marker, color=INK, markersize=4)
                continue
            arrow = {"arrowstyle": "->", "color": TEXT_GREY}
            ax.annotate("", (500, y), (1e6 * r.least, y), arrowprops=arrow)
            note(ax, each.note.partition(":")[0], (125, y), ha="right", va="center")
    for marker, label in (("o", "sine"), ("s", "designed")):
        ax.plot([], [], marker, color=INK, markersize=4, label=label)
    ax.legend(loc="lower left")
    ax.set(xlabel="weight [µm/N]", xscale="log", xlim=(18, 560), ylim=(-1.0, 1.7))
    ticks(ax, "x", (20, 50, 100, 200, 500))
    ticks(ax, "y", ())
    return "what is known of the weights"


def _residuals(ax: Any, r: Any) -> str:
    """Draw residuals with white and with correlated noise."""
    shown = slice(1000, 1600)  # rows, of which single ones can be seen
    kinds = ((r.designed, GAP, "independent"), (r.correlated, 0.0, f"correlated by {CORRELATION}"))
    for found, middle, text in kinds:
        (each,) = found.residuals()
        t, left = each.t[shown], 1e3 * (each.measured - each.modelled)[shown]
        ax.plot(t, middle + left, color=INK, linewidth=0.6)
        count = f"{text}: {found.effective_rows:.0f} of {each.t.size} rows"
        note(ax, count, (t[0], middle + 74.0))
    marks = (-50, 0, 50)
    places = [middle + mark for middle in (0.0, GAP) for mark in marks]
    ticks(ax, "y", places, [f"{mark}" for mark in 2 * marks])
    ax.set(xlabel="$t$ [s]", ylabel="residual [mN], twice", ylim=(-80, GAP + 100))
    return "how many rows count"


def _intervals(ax: Any, r: Any) -> str:
    """Draw the intervals under correlated noise around the truth: from rows, effective rows."""
    places = np.arange(len(NAMES))
    off = 100.0 * (np.array([r.correlated[name].value for name in NAMES]) / TRUTH - 1.0)
    for half, aside, colour, label in (
        (100.0 * r.from_effective, 0.0, LINE_GREY, "from effective rows"),
        (100.0 * r.from_rows, 0.25, INK, "from rows"),
    ):
        ax.vlines(places + aside, off - half, off + half, color=colour, linewidth=1.8, label=label)
        ax.plot(places + aside, off, "o", color=colour, markersize=3.5)
    ax.axhline(0.0, color=INK, linestyle=":", linewidth=0.9)
    ax.legend(loc="upper right")
    ticks(ax, "x", places + 0.12, NAMES)
    ax.set(ylabel="deviation from the truth [%]", ylim=(-2.4, 3.4))
    return "95 % intervals, correlated"


def _product(ax: Any, r: Any) -> str:
    """Draw what the fits of the product found, on the curve of equal thresholds."""
    F, true = np.geomspace(0.2, 3.0, 100), (F_c, 1e6 * TRUTH[2])
    ax.loglog(F, true[0] * true[1] / F, **GUIDE)
    note(ax, f"weights1 · $F_c$ = {true[0] * true[1]:g} µm", (0.22, 17))
    ax.plot(*true, "x", color=INK, markersize=6)
    note(ax, "truth", true, (6, 3), color=INK)
    for each, shift in zip(r.products, ((6, 3), (-6, -2)), strict=True):
        here = each["F_c"].value, 1e6 * each["weights1"].value
        ax.plot(*here, **DOTS)
        note(ax, f"RMSE {1e3 * each.training['rmse']:.3f} mN", here, shift)
    ticks(ax, "x", (0.2, 0.5, 1, 2))
    ticks(ax, "y", (20, 50, 100, 200))
    ax.set(xlabel="$F_c$ [N]", ylabel="weights1 [µm/N]", xlim=(0.2, 4.5), ylim=(15, 260))
    return "only the product is told"


LOOPS = {"on_sine": "a sine, signed law", "designed": "a designed motion"}
LESSON = Lesson(
    __name__,
    run,
    (
        *(partial(_loop, name=name, title=title) for name, title in LOOPS.items()),
        *(_weights, _residuals, _intervals, _product),
    ),
    grid("abc;def", (8.8, 6.4)),
    level="graduate",
    questions=(
        Question("unknown", choices=NAMES),
        Question("too_short", rtol=0.3),
        Question("ratio", rtol=0.1),
    ),
)
