"""Monitors: what a run is watched for.

They look at the rows and the transition log once the run has ended or failed, so a run without
monitors does nothing for them. What they see: every accepted step and both sides of every firing;
with `t_eval` the wanted rows and both sides of every stop; with ``output="end"`` the log alone,
which is enough for `Chattering` only.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gms_fsm.charts import GMS_ELEMENT
from gms_fsm.charts.parameters import FloatArray, checked_scalar
from gms_fsm.errors import ExpressionError, ParameterError, SignalError, shown
from gms_fsm.language import (
    MATLAB_LIKE,
    Binary,
    Condition,
    Name,
    clauses,
    names_in,
    parse_condition,
    spell,
    states_in,
)
from gms_fsm.language._vectors import truths
from gms_fsm.systems.models import Model
from gms_fsm.traces.failures import LivelockError
from gms_fsm.traces.trace import Rows, Trace, interpolated, slopes
from gms_fsm.traces.verdicts import (
    ChatteringVerdict,
    ClauseSeen,
    CoverageVerdict,
    Episode,
    InvariantVerdict,
    PassivityVerdict,
    Verdict,
)

__all__ = [
    "Chattering",
    "Coverage",
    "Invariant",
    "Monitor",
    "Passivity",
    "checked",
    "examine",
    "watched",
]

HALVINGS = 60  # of a stretch between two rows
OBSERVED = ("v", "F", "s", "F_elements", "dz")  # what a trace computes from its rows
Truths = NDArray[np.bool_]


# --------------------------------------------------------------------------- what to watch
@dataclass(frozen=True)
class Chattering:
    """An element that takes one edge, there and back, again and again in a short time.

    A run that ends in a livelock, switching while time stands still, is reported here too.

    Parameters
    ----------
    times : int
        How often, at least 2.
    within : float
        In how many seconds.

    Raises
    ------
    ParameterError
        If a number breaks its rule.
    """

    times: int = 20
    within: float = 0.1

    def __post_init__(self) -> None:
        if not isinstance(self.times, int) or self.times < 2:
            raise ParameterError(f"times is {shown(self.times)}; it must be a whole number >= 2")
        object.__setattr__(self, "within", checked_scalar("within", self.within, "> 0"))

    @property
    def name(self) -> str:
        """Under which it is reported."""
        return "chattering"


@dataclass(frozen=True)
class Invariant:
    """A condition that has to hold at every row.

    Parameters
    ----------
    text : str
        In the expression language. It can name t, x, v, F; of each element its variables (z), its
        threshold s and its parameters, then it has to hold for every element; single elements as
        z1, s1, F1; and ask ``state == slip`` or ``state(1) == slip``.
    """

    text: str

    @property
    def name(self) -> str:
        """Under which it is reported."""
        return self.text


@dataclass(frozen=True)
class Passivity:
    """No element makes energy out of nothing: what it took from the motion, less what it stores.

    For elements whose force is a spring's, with or without a damper: ``k * z + sigma * dz``. Heat
    is the integral of F_i v less the rise of k z**2 / 2 since the start; it must not be negative.

    Parameters
    ----------
    tolerance : float
        The share of the energy turned over that may be missing. The uncertainty of the sums is
        added to it.

    Raises
    ------
    ParameterError
        If it is negative.
    """

    tolerance: float = 1e-4

    def __post_init__(self) -> None:
        object.__setattr__(self, "tolerance", checked_scalar("tolerance", self.tolerance, ">= 0"))

    @property
    def name(self) -> str:
        """Under which it is reported."""
        return "passivity"


@dataclass(frozen=True)
class Coverage:
    """Which states, edges and clauses of the guards, true and false, the run has seen."""

    @property
    def name(self) -> str:
        """Under which it is reported."""
        return "coverage"


Monitor: TypeAlias = Chattering | Invariant | Passivity | Coverage
ALL: tuple[Monitor, ...] = (Chattering(), Passivity(), Coverage())
KNOWN: Mapping[str, Monitor] = {monitor.name: monitor for monitor in ALL}


def checked(
    monitors: str | Iterable[str | Monitor], model: Model, output: str = "all"
) -> dict[str, Monitor]:
    """Return monitors by name, after a look at every one of them.

    Parameters
    ----------
    monitors : str or iterable of str or Monitor
        ``"chattering"``, ``"passivity"``, ``"coverage"``, ``"all"`` of these three, or an
        invariant's text.
    model : Model
        What they will watch.
    output : {"all", "t_eval", "end"}
        Rows there will be.

    Returns
    -------
    dict of str to Monitor
        By name.

    Raises
    ------
    ParameterError
        If one is unknown, given twice, or needs rows where there will be none.
    ExpressionError
        If an invariant cannot be read.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters
    >>> list(checked(["all", "z <= s"], GMS(GMSParameters.paper("stick-slip"), law="signed")))
    ['chattering', 'passivity', 'coverage', 'z <= s']
    """
    given = [monitors] if isinstance(monitors, str | Monitor) else list(monitors)
    found: dict[str, Monitor] = {}
    for each in given:
        for monitor in ALL if each == "all" else (_monitor(each),):
            if monitor.name in found:
                raise ParameterError(f"monitors has {shown(monitor.name)} twice; give it once")
            if isinstance(monitor, Invariant):
                _read(monitor, model)
            if output == "end" and not isinstance(monitor, Chattering):
                raise ParameterError(
                    f"the monitor {shown(monitor.name)} looks at the rows of a run, but output is "
                    "'end'; use output='all'"
                )
            found[monitor.name] = monitor
    return found


def _monitor(given: str | Monitor) -> Monitor:
    if isinstance(given, Monitor):
        return given
    if not isinstance(given, str):
        raise ParameterError(
            f"monitors has {shown(given)}; a monitor is {', '.join(map(repr, KNOWN))}, an "
            "invariant's text, or an object of gms_fsm.traces.monitors"
        )
    word = given.strip()
    if word.isidentifier() and word not in KNOWN:
        near = difflib.get_close_matches(word[:40], KNOWN, n=1)
        raise ParameterError(
            f"no monitor {shown(word)}; {f'did you mean {near[0]!r}? ' if near else ''}there are "
            f"{', '.join(map(repr, KNOWN))}, 'all', and invariants such as 'abs(z) <= 2*s'"
        )
    return KNOWN.get(word) or Invariant(given)


def examine(
    trace: Trace,
    monitors: str | Iterable[str | Monitor],
    error: Exception | None = None,
) -> dict[str, Verdict]:
    """Let monitors look at a run.

    Parameters
    ----------
    trace : Trace
        A run, also one that was read from a file.
    monitors : str or iterable of str or Monitor
        As `checked` takes them.
    error : Exception, optional
        What ended the run.

    Returns
    -------
    dict of str to Verdict
        What each says, by its name.

    Raises
    ------
    ParameterError, ExpressionError
        As `checked`.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> found = examine(trace, ["coverage", "z <= 0.3"])
    >>> found["coverage"].never[0], round(found["z <= 0.3"].t, 9)
    ('edge break_away_backward', 1.5)
    """
    rows = trace.whole()
    found: dict[str, Verdict] = {}
    for name, monitor in checked(monitors, trace.model).items():
        match monitor:
            case Chattering():
                found[name] = _chattering(monitor, trace, error)
            case Invariant():
                found[name] = _invariant(monitor, rows)
            case Passivity():
                found[name] = _passivity(monitor, rows)
            case Coverage():
                found[name] = _coverage(rows)
    return found


def watched(trace: Trace, monitors: Iterable[Monitor], error: Exception | None = None) -> Trace:
    """Return a run with what its monitors say.

    Parameters
    ----------
    trace, monitors, error
        As in `examine`.

    Returns
    -------
    Trace
        The same, with `Trace.monitors`.
    """
    return trace.with_monitors(examine(trace, monitors, error))


# --------------------------------------------------------------------------- names and values
def _read(monitor: Invariant, model: Model) -> Condition:
    chart, numbers = model.chart, range(1, model.n + 1)
    threshold = () if model.stribeck is None else ("s",)
    names = ["t", "x", "v", "F", *threshold, *chart.variables, *chart.parameter_names]
    names += [f"{name}{i}" for name in (*chart.variables, *threshold, "F") for i in numbers]
    states = [state.name for state in chart.states]
    try:
        return parse_condition(monitor.text, names, states, model.n, own_state=True)
    except ExpressionError as error:
        raise error.at("invariant") from None


def _columns(trace: Trace, states: bool = False) -> dict[str, NDArray[Any]]:
    """Return all that conditions can name: shape (rows, n), or a 1 for what all elements share."""
    model, n = trace.model, trace.n
    own = {name: trace.variable(name) for name in model.chart.variables} | {"s": trace.s}
    found: dict[str, NDArray[Any]] = {
        f"{name}{i + 1}": block[:, i : i + 1]
        for name, block in (own | {"F": trace.F_elements}).items()
        for i in range(n)
    }
    # A chart's own name goes before a numbered one.
    found |= own | {name: np.atleast_2d(value) for name, value in model.values.items()}
    shared = {"t": trace.t, "x": trace.x, "v": trace.v, "F": trace.F}
    found |= {name: column[:, np.newaxis] for name, column in shared.items()}
    if states:
        active = trace.states
        found |= {f"state({i + 1})": active[:, i : i + 1] for i in range(n)} | {"state(0)": active}
    return found


def _shown(values: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value:.6g}" for name, value in values.items())


def _elements(numbers: Iterable[int]) -> str:
    """Name elements, counted from 1 in texts."""
    words = [str(i + 1) for i in numbers]
    return f"element{'s' if len(words) > 1 else ''} {', '.join(words)}"


# --------------------------------------------------------------------------- invariants
@dataclass(frozen=True)
class _Held:
    """An invariant read for a model."""

    tree: Condition
    of_elements: bool

    def columns(self, trace: Trace) -> dict[str, NDArray[Any]]:
        """Return the columns it names."""
        asked = states_in(self.tree)
        names = [*sorted(names_in(self.tree)), *(f"state({i})" for i in sorted(asked))]
        columns = _columns(trace, bool(asked))
        return {name: columns[name] for name in names}

    def at(self, trace: Trace) -> Truths:
        """Return where it holds, shape (rows, n), or (rows, 1) if it is not of elements."""
        width = trace.n if self.of_elements else 1
        return truths(self.tree, self.columns(trace), (len(trace), width))


def _of_elements(tree: Condition, model: Model) -> bool:
    own = {"s", *model.chart.variables}
    own |= {name for name, value in model.values.items() if np.ndim(value) > 0}
    return bool(own & names_in(tree)) or 0 in states_in(tree)


def _invariant(monitor: Invariant, trace: Trace) -> InvariantVerdict:
    tree = _read(monitor, trace.model)
    invariant, rows = _Held(tree, _of_elements(tree, trace.model)), len(trace)
    broken = np.flatnonzero(~invariant.at(trace).all(axis=1))
    if not broken.size:
        text = f"held at all {rows} rows"
        return InvariantVerdict(True, text, monitor.text, rows, 0, None, None, "", {}, None)
    place = _located(invariant, trace, int(broken[0]))
    i = int(np.argmin(invariant.at(place)[0]))
    values = {
        name: float(column[0, min(i, column.shape[1] - 1)])
        for name, column in invariant.columns(place).items()
        if column.dtype.kind == "f"
    }
    t, t_last = float(place.t[0]), float(trace.t[broken[-1]])
    who, state = "", ""
    if invariant.of_elements:
        state = str(place.states[0, i])
        who = f", {_elements([i])} in {state}"
    text = (
        f"broken first at t = {t:.9g} s{who}{f' ({_shown(values)})' if values else ''}, at "
        f"{broken.size} of {rows} rows, last at t = {t_last:.9g} s; look there with "
        f"`goto {t:.9g}` in gms-fsm debug, or widen the bound if this is meant"
    )
    return InvariantVerdict(
        False,
        text,
        monitor.text,
        rows,
        int(broken.size),
        t,
        i if who else None,
        state,
        values,
        t_last,
    )


def _located(invariant: _Held, trace: Trace, row: int) -> Trace:
    """Return as one row the place where an invariant breaks, between the row before and this."""
    rows = trace.rows
    seen = {name: getattr(trace, name)[row : row + 1] for name in OBSERVED}

    def at(t: float, y: FloatArray, stored: Mapping[str, FloatArray]) -> Trace:
        one = Rows(np.array([t]), np.zeros(1, np.int64), y[np.newaxis], rows.mode[row : row + 1])
        return replace(trace, rows=one, stops=one, stored=stored)

    place = at(float(rows.t[row]), rows.y[row], seen)
    low, high = float(rows.t[max(0, row - 1)]), float(rows.t[row])
    ends = low, rows.y[row - 1], high, rows.y[row]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        try:
            y = interpolated(trace.program, rows.mode[row].tolist(), *ends, middle)
            there = at(middle, y, {})
            holds = bool(invariant.at(there).all())
        except SignalError:  # of a trace from a file, whose signal was a Python function
            break
        if holds:
            low = middle
        else:
            high, place = middle, there
    return place


# --------------------------------------------------------------------------- chattering
def _chattering(monitor: Chattering, trace: Trace, error: Exception | None) -> ChatteringVerdict:
    livelock = isinstance(error, LivelockError)
    episodes = _episodes(monitor, trace) if len(trace.transitions) >= monitor.times else ()
    parts = [f"livelock: {error}"] if livelock else []
    for first in episodes[:1]:
        span = first.t_last - first.t_first
        others = f" ({_elements(e.element for e in episodes[1:])} too)" if episodes[1:] else ""
        back = " and ".join(first.back)
        parts.append(
            f"{_elements([first.element])}{others} took {first.edge}"
            f"{f', and back {back},' if back else ''} {first.count} times in {span:.3g} s, from "
            f"t = {first.t_first:.9g} s ({_shown(first.values)}): {_way_out(trace, first)}"
        )
    quiet = f"no element took an edge {monitor.times} times within {monitor.within:g} s"
    return ChatteringVerdict(not parts, "; ".join(parts) or quiet, episodes, livelock)


def _way_out(trace: Trace, episode: Episode) -> str:
    texts = [
        f"{edge} [{trace.model.chart.guard_text(edge)}]" for edge in (episode.edge, *episode.back)
    ]
    return (
        f"the guards {' and '.join(texts)} hold in turn; leave a gap between them, as arrest does "
        "by |v| <= v_c, or raise v_c"
        if episode.back
        else f"the guard {texts[0]} holds again at once; let the edge's target have another"
    )


def _episodes(monitor: Chattering, trace: Trace) -> tuple[Episode, ...]:
    """Return the longest episode of each element that has one."""
    log, variable = trace.transitions, trace.model.chart.variables[0]
    names, codes = np.unique(log["edge"], return_inverse=True)
    found: dict[int, tuple[int, NDArray[np.int64]]] = {}
    for i in np.flatnonzero(np.bincount(log["element"]) >= monitor.times).tolist():
        own = log["element"] == i
        for code in range(len(names)):
            taken = np.flatnonzero(own & (codes == code))
            longest = _longest(log["t"][taken], monitor)
            if longest and (i not in found or longest[1] - longest[0] > len(found[i][1])):
                found[i] = code, taken[longest[0] : longest[1]]
    episodes = []
    for i, (code, taken) in found.items():
        first = log[taken[0]]
        meanwhile = log[taken[0] : taken[-1] + 1]
        others = np.unique(meanwhile["edge"][meanwhile["element"] == i]).tolist()
        edge = str(names[code])
        seen = {variable: float(first.z), "s": float(first.s), "v": float(first.v)}
        values = {name: value for name, value in seen.items() if not math.isnan(value)}
        back, end = tuple(other for other in others if other != edge), float(log["t"][taken[-1]])
        episodes.append(Episode(i, edge, back, len(taken), float(first.t), end, values))
    return tuple(episodes)


def _longest(times: FloatArray, monitor: Chattering) -> tuple[int, int] | None:
    """Return begin and end of the longest stretch in which any `times` in a row are `within`."""
    ahead = monitor.times - 1
    if times.size <= ahead:
        return None
    close = np.zeros(times.size + 1, dtype=np.int8)
    close[1 : times.size - ahead + 1] = times[ahead:] - times[:-ahead] <= monitor.within
    turns = np.flatnonzero(np.diff(close, append=0))
    if not turns.size:
        return None
    begins, ends = turns[::2], turns[1::2]
    k = int(np.argmax(ends - begins))
    return int(begins[k]), int(ends[k]) + ahead


# --------------------------------------------------------------------------- passivity
def _passivity(monitor: Passivity, trace: Trace) -> PassivityVerdict:
    spring = _spring(trace.model)
    if spring is None:
        force = spell(trace.model.chart.forces["F"], MATLAB_LIKE)
        return PassivityVerdict(
            True, f"not applicable: F = {force} is not a spring's force k * z [+ sigma * dz]", False
        )
    k, sigma = spring
    t, z = trace.t, trace.z
    with np.errstate(all="ignore"):  # of a run that grew without bound
        lost, doubt = _lost(trace, k, sigma)
        wound = 0.5 * k * np.diff(z**2, axis=0)
        endless = np.flatnonzero(~np.isfinite(lost + wound + doubt).all(axis=1))
        end = int(endless[0]) if endless.size else len(lost)
        lost, wound, doubt = lost[:end], wound[:end], doubt[:end]
    turnover = np.abs(lost + wound).sum(axis=0)
    # The solver knows z no better than to its absolute tolerance.
    allowed: Any = trace.settings["atol"]
    allowed = allowed[trace.model.chart.variables[0]] if isinstance(allowed, Mapping) else allowed
    blur = k * np.abs(z[: end + 1]).max(axis=0, initial=0.0) * np.asarray(allowed or 0.0)
    tolerance = monitor.tolerance * turnover + doubt.sum(axis=0) + blur
    n = trace.n
    heat = np.concatenate([np.zeros((1, n)), lost.cumsum(axis=0)])
    times = t if t.size else np.array([trace.settings["t_start"]], dtype=np.float64)
    lowest, element = heat.argmin(axis=0), np.arange(n)
    deficit = heat[0] - heat[lowest, element]  # 0.0 at the start
    fall = np.maximum.accumulate(heat, axis=0) - heat
    until = fall.argmax(axis=0)
    since = [int(heat[: until[i] + 1, i].argmax()) for i in range(n)]
    made = fall[until, element]
    verdict = PassivityVerdict(
        ok=bool((deficit <= tolerance).all()),
        text="",
        applicable=True,
        taken=tuple((lost + wound).sum(axis=0).tolist()),
        stored=tuple(wound.sum(axis=0).tolist()),
        deficit=tuple(deficit.tolist()),
        t_deficit=tuple(times[lowest].tolist()),
        made=tuple(made.tolist()),
        made_from=tuple(times[since].tolist()),
        made_until=tuple(times[until].tolist()),
        tolerance=tuple(tolerance.tolist()),
    )
    parts = _told(verdict, trace, lost)
    if endless.size:
        parts.append(f"values are not finite after t = {t[end]:.6g} s")
    if (doubt.sum(axis=0) > 0.01 * turnover).any():
        parts.append(
            "the rows lie far apart for these sums: keep every step (output='all'), or take "
            "shorter ones"
        )
    return replace(verdict, text="; ".join(parts))


def _spring(model: Model) -> tuple[FloatArray, FloatArray] | None:
    """Return stiffness and damping of each element, shape (n,), if that is all its force is."""
    z, values = model.chart.variables[0], model.values
    match model.chart.forces["F"]:
        case Binary("+", Binary("*", Name(k), Name(bristle)), Binary("*", Name(sigma), Name(rate))):
            known = rate == f"d{z}" and sigma in values
        case Binary("*", Name(k), Name(bristle)):
            sigma, known = "", True
        case _:
            return None
    if not known or bristle != z or k not in values:
        return None
    return np.full(model.n, values[k]), np.full(model.n, values.get(sigma, 0.0))


# x and z run between two rows as the cubics that `Trace.sample` draws. The heat
# integral of F_i v - k z dz = k z (v - dz) + sigma dz v is then a polynomial of degree 5 in time:
# three Gauss points are exact.
GAUSS = ((0.5 - math.sqrt(0.15), 5 / 18), (0.5, 8 / 18), (0.5 + math.sqrt(0.15), 5 / 18))


def _lost(trace: Trace, k: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the heat made between neighbouring rows, shape (rows - 1, n), and its uncertainty."""
    t, x, v = trace.t[:, np.newaxis], trace.x[:, np.newaxis], trace.v[:, np.newaxis]
    h, z, dz = np.diff(t, axis=0), trace.z, trace.dz
    lost, doubt = _heat(k, sigma, h, x[:-1], x[1:], z[:-1], z[1:], v[:-1], v[1:], dz[:-1], dz[1:])
    # At a stop a row's rates may be those of the far side: where it counts, take them from inside.
    counts = (doubt > 1e-7 * np.abs(lost).sum(axis=0)).any(axis=1) & (h[:, 0] > 0.0)
    left = np.flatnonzero(counts)
    if left.size and trace.settings["events"] == "located":
        try:
            rates = np.array([_rates(trace, row) for row in left.tolist()])
        except SignalError:  # of a trace from a file, whose signal was a Python function
            return lost, doubt
        first, right = trace.program.first, left + 1
        (v0, v1), (dz0, dz1) = (
            np.moveaxis(rates[:, :, columns], 1, 0)
            for columns in (slice(0, 1), slice(first, first + trace.n))
        )
        lost[left], doubt[left] = _heat(
            k, sigma, h[left], x[left], x[right], z[left], z[right], v0, v1, dz0, dz1
        )
    return lost, doubt


def _heat(
    k: FloatArray,
    sigma: FloatArray,
    h: FloatArray,
    x0: FloatArray,
    x1: FloatArray,
    z0: FloatArray,
    z1: FloatArray,
    v0: FloatArray,
    v1: FloatArray,
    dz0: FloatArray,
    dz1: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    inverse = np.divide(1.0, h, out=np.zeros_like(h), where=h > 0.0)
    rise_x, rise_z = x1 - x0, z1 - z0
    bend_x, bend_z = h * v0 - rise_x, h * dz0 - rise_z
    twist_x, twist_z = rise_x - h * v1 - bend_x, rise_z - h * dz1 - bend_z
    heat = np.zeros_like(rise_z)
    for theta, weight in GAUSS:
        a, b = 1 - 2 * theta, theta * (2 - 3 * theta)
        moved = rise_x + a * bend_x + b * twist_x
        wound = rise_z + a * bend_z + b * twist_z
        z = z0 + theta * (rise_z + (1 - theta) * (bend_z + theta * twist_z))
        heat += weight * (k * z * (moved - wound) + sigma * wound * moved * inverse)
    ends = [k * z * (v - dz) + sigma * dz * v for z, v, dz in ((z0, v0, dz0), (z1, v1, dz1))]
    # The trapezoid's error is of order h^3, its square over the heat h^5, as the error here.
    rough = np.abs(heat - 0.5 * h * (ends[0] + ends[1]))
    size = np.maximum(np.abs(heat), 0.5 * h * (np.abs(ends[0]) + np.abs(ends[1])))
    share = np.divide(rough, size, out=np.zeros_like(rough), where=size > 0.0)
    return heat, rough * np.minimum(1.0, share)


def _rates(trace: Trace, row: int) -> tuple[FloatArray, FloatArray]:
    """Return the slopes at a row and the next, as seen from between them."""
    rows = trace.rows
    return slopes(
        trace.program,
        rows.mode[row].tolist(),
        float(rows.t[row]),
        rows.y[row],
        float(rows.t[row + 1]),
        rows.y[row + 1],
    )


def _told(verdict: PassivityVerdict, trace: Trace, lost: FloatArray) -> list[str]:
    """Put the energies into words."""
    chart, tolerance = trace.model.chart, verdict.tolerance
    over = [i for i in range(trace.n) if verdict.deficit[i] > tolerance[i]]
    made = [i for i in range(trace.n) if verdict.made[i] > tolerance[i]]
    parts = [f"no element gave more than it had taken (tolerance {max(tolerance):.2g} J)"]
    if over:
        i = max(over, key=lambda i: verdict.deficit[i])
        others = f" ({_elements(j for j in over if j != i)} too)" if over[1:] else ""
        parts = [
            f"{_elements([i])}{others} had made {verdict.deficit[i]:.6g} J out of nothing by "
            f"t = {verdict.t_deficit[i]:.6g} s (tolerance {tolerance[i]:.2g} J)"
        ]
    if made:
        i = max(made, key=lambda i: verdict.made[i])
        state = chart.states[int(trace.modes[int(lost[:, i].argmin()), i])]
        z = chart.variables[0]
        parts.append(
            f"the most made between two times: {_elements([i])}, {verdict.made[i]:.6g} J from "
            f"t = {verdict.made_from[i]:.6g} to {verdict.made_until[i]:.6g} s, mostly in "
            f"{state.name}, where d{z} = {state.flow[z]} moves {z} otherwise than the motion does"
        )
    if over and chart == GMS_ELEMENT["published"]:
        parts.append(
            "the published law does so whenever an element slips backward; try law='signed'"
        )
    return parts


# --------------------------------------------------------------------------- coverage
def _coverage(trace: Trace) -> CoverageVerdict:
    chart, log, mode = trace.model.chart, trace.transitions, trace.modes
    inside = {state.name: mode == m for m, state in enumerate(chart.states)}
    states = {name: _each(places) for name, places in inside.items()}
    edges = {
        edge.name: tuple(
            np.bincount(log["element"][log["edge"] == edge.name], minlength=trace.n).tolist()
        )
        for edge in chart.transitions
    }
    columns = _columns(trace) if chart.transitions else {}
    known: dict[Condition, Truths] = {}
    seen = []
    for edge in chart.transitions:
        for part in clauses(chart.guards[edge.name]):
            if part not in known:
                values = {name: columns[name] for name in names_in(part)}
                known[part] = truths(part, values, mode.shape)
            truth, here = known[part], inside[edge.source]
            sides = _each(truth & here), _each(here & ~truth)
            seen.append(ClauseSeen(edge.name, spell(part, MATLAB_LIKE), *sides))
    never = [f"state {name}" for name, been in states.items() if not any(been)]
    never += [f"edge {name}" for name, taken in edges.items() if not any(taken)]
    for clause in seen:
        never += [
            f"{clause.text} of {clause.edge} {side}"
            for side, been in (("true", clause.true), ("false", clause.false))
            if not any(been)
        ]
    text = f"states {_count(states.values())}"
    if edges:
        text += f", edges {_count(edges.values())}"
        text += f", clauses true {_count(clause.true for clause in seen)}"
        text += f", clauses false {_count(clause.false for clause in seen)}"
    if never:
        text += (
            f"; never: {', '.join(never)}; a longer run, a motion both ways or other initial "
            "values would show more"
        )
    return CoverageVerdict(not never, text, states, edges, tuple(seen), tuple(never))


def _count(found: Iterable[Iterable[object]]) -> str:
    seen = [any(by_element) for by_element in found]
    return f"{sum(seen)} of {len(seen)}"


def _each(places: Truths) -> tuple[bool, ...]:
    """Return for each element whether it is so at any row."""
    return tuple(bool(found) for found in np.any(places, axis=0))
