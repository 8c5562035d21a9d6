"""Pictures behind the sliders of docs/play.md, and the replay on the first page.

The site is static, so every position of a slider is a run made in advance. `write_all` makes them
again when their sources have changed; each picture has a light and a dark version.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np
from dark import dark_picture, dark_svg, webp
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from notebooks import common_sources
from numpy.typing import NDArray
from PIL import Image

from gms_fsm import GMS, GMSParameters, Prescribed, Stribeck, Trace, simulate
from gms_fsm.app.scenario import load_scenario
from plots import LiveChart, panels
from plots.page.replay import replay_html
from plots.style import INK, LINE_GREY, RC

DPI = 120
SETTLED = (0.4, 1.0)  # s, the part that is shown: the first cycle differs
CYCLE = (0.22, 0.37)  # s, a little more than one cycle of the pulled mass
ROWS = 60  # shown of that cycle
REPLAYED = (0.0, 0.4)  # s, on the first page
WIDEST = 2e-3  # m, the largest break-away distance of the bank that has more and more elements
STROKE = 1.5e-3  # m

T = TypeVar("T")


@dataclass(frozen=True)
class Frame:
    """What one position of a slider shows.

    Parameters
    ----------
    value : str
        The value there, with its unit.
    said : str
        What the run did, measured; also the picture's text for those who do not see it.
    pictures : tuple of bytes or str
        PNGs, or SVG documents, shown side by side or, on a narrow screen, one below the other.
    at : float
        Where the cursor is in the picture beside it, as a share of its width.
    """

    value: str
    said: str
    pictures: tuple[bytes | str, ...]
    at: float = 0.0


@dataclass(frozen=True)
class Slider:
    """A slider of the page.

    Parameters
    ----------
    label : str
        What it changes.
    start : int
        Its first position.
    frames : tuple of Frame
        All its positions.
    beside : bytes
        A PNG that stays; frames of a chart have the curve of the run there.
    """

    label: str
    start: int
    frames: tuple[Frame, ...]
    beside: bytes = b""


# --------------------------------------------------------------------------- the pulled mass
def pulled(F_s: float = 1.5, v_s: float = 5e-4) -> Trace:
    """Run the scenario with another Stribeck curve."""
    changes = f"model.stribeck={{F_c=1.0, F_s={F_s}, v_s={v_s}}}", f"run.t_end={SETTLED[1]}"
    return load_scenario("pulled_mass", changes).simulate(engine="ifelse")


def cycles(runs: dict[str, Trace]) -> Iterator[Frame]:
    """Draw runs of the pulled mass on the same axes: speed, states, limit cycle."""
    fastest = max(float(trace.v.max()) for trace in runs.values())
    stretch = [extension(trace)[settled(trace)] for trace in runs.values()]
    span = (min(map(np.min, stretch)), max(map(np.max, stretch)))
    for value, trace in runs.items():
        keep = settled(trace)
        with rc_context(RC):
            over_time = Figure(figsize=(4.4, 3.3), layout="constrained")
            speed, states = over_time.subplots(2, 1, sharex=True, height_ratios=(1.2, 1))
            panels.velocity(speed, trace, window=SETTLED)
            panels.ribbons(states, trace, window=SETTLED)
            states.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
            speed.set(xlabel="", ylim=(-80 * fastest, 1060 * fastest), ylabel="$v$ [mm/s]")
            cycle = Figure(figsize=(3.0, 3.3), layout="constrained")
            orbit = cycle.subplots()
            orbit.plot(1e6 * extension(trace)[keep], 1e3 * trace.v[keep], color=INK)
            limits(orbit, (1e6 * span[0], 1e6 * span[1]), (0.0, 1e3 * fastest))
            orbit.axhline(1.0, color=LINE_GREY, linestyle=":", linewidth=0.9, zorder=0)
            orbit.set(
                xlabel="spring extension [µm]",
                ylabel="$v$ [mm/s]",
                title="limit cycle; dotted: pulling speed",
            )
            speed.set_title("speed of the mass")
            states.set_title("active states")
        yield Frame(value, motion(trace), (png(over_time), png(cycle)))


def settled(trace: Trace) -> NDArray[np.bool_]:
    """Return which rows are shown."""
    return trace.t >= SETTLED[0]


def extension(trace: Trace) -> NDArray[np.float64]:
    """Return how far the spring of the pulled mass is stretched, m."""
    return np.asarray(1e-3 * trace.t - trace.x)


def motion(trace: Trace) -> str:
    """Say what the mass does, in numbers."""
    log = trace.transitions
    stops = log[(log.edge == "arrest") & (log.t >= SETTLED[0])]
    if not stops.size:
        return "The mass slides: no element arrests in these 0.6 s."
    late = settled(trace)
    t, v = trace.t[late], trace.v[late]
    rises = t[1:][(v[:-1] < v.max() / 2) & (v[1:] >= v.max() / 2)]
    period = float(np.diff(rises).mean())
    return (
        f"Stick-slip: one cycle in {period:.3f} s, {stops.size} arrests of elements in 0.6 s; "
        f"the mass reaches {1e3 * v.max():.1f} mm/s."
    )


# --------------------------------------------------------------------------- more and more elements
def smooth(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return F over x of infinitely many elements, loaded first: (x/D) (1 + ln(D/x)), D = 2 mm."""
    x = np.clip(x, 1e-12, WIDEST)
    return np.asarray(x / WIDEST * (1 + np.log(WIDEST / x)))


def bank(n: int) -> Trace:
    """Run a bank whose elements break away at n evenly spaced distances."""
    distance = (np.arange(n) + 0.5) / n * WIDEST
    share = np.full(n, 1 / n)
    parameters = GMSParameters.from_shares(
        share, share / distance, C=1e4, stribeck=Stribeck(1.0, 1.0, 1e-3), v_c=1e-9
    )
    motion = Prescribed(f"2*pi*{STROKE}*cos(2*pi*t)")
    return simulate(GMS(parameters, law="signed"), motion, 1.25, engine="ifelse")


def loops(counts: Sequence[int]) -> Iterator[Frame]:
    """Draw the hysteresis of several elements over that of infinitely many."""
    way = np.linspace(0.0, STROKE, 200)
    back = smooth(way[-1:]) - 2 * smooth(way)
    for n in counts:
        trace = bank(n)
        first = trace.t <= 0.25
        error = float(np.abs(trace.F - smooth(trace.x))[first].max())
        with rc_context(RC):
            figure = Figure(figsize=(4.8, 3.3), layout="constrained")
            ax = figure.subplots()
            look = {"color": LINE_GREY, "linestyle": "--", "linewidth": 1.6, "zorder": 0}
            ax.plot(1e3 * way, smooth(way), label="infinitely many", **look)
            ax.plot(1e3 * (STROKE - 2 * way), back, **look)
            ax.plot(1e3 * (2 * way - STROKE), -back, **look)
            ax.plot(1e3 * trace.x, trace.F, color=INK, label=f"n = {n}")
            limits(ax, (-1e3 * STROKE, 1e3 * STROKE), (-1.0, 1.0))
            ax.set(xlabel="$x$ [mm]", ylabel="$F$ [N]", title="pre-sliding hysteresis")
            ax.legend(loc="upper left")
        corners = "one break-away" if n == 1 else f"{n} break-away points"
        said = f"{corners}; at most {error:.3f} N from the smooth curve on the first way."
        yield Frame(f"{n}", said[0].upper() + said[1:], (png(figure),))


# --------------------------------------------------------------------------- time
def moments(_: int) -> Slider:
    """Draw one element's chart at the rows of one cycle, and the force beside it."""
    trace = pulled()
    chart = LiveChart(trace, [0], values=True)
    log = trace.transitions
    fired = np.unique(log.t[(log.t > CYCLE[0]) & (log.t < CYCLE[1]) & (log.element == 0)])
    at_edges = [int(np.flatnonzero(trace.t == t)[-1]) for t in fired]
    even = np.linspace(*CYCLE, ROWS - len(at_edges)).tolist()
    rows = sorted({*at_edges, *map(chart.at, even)})
    with rc_context(RC):
        figure = Figure(figsize=(4.6, 3.3), layout="constrained")
        force, states = figure.subplots(2, 1, sharex=True, height_ratios=(1.4, 1))
        panels.force(force, trace, window=CYCLE)
        panels.ribbons(states, trace, window=CYCLE)
        states.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
        force.set(xlabel="", title="friction of the pulled mass")
        states.set_title("active states")
        beside = png(figure)
    box = states.get_position()
    frames = []
    for row in rows:
        (look,) = chart.look(row)
        share = (trace.t[row] - CYCLE[0]) / (CYCLE[1] - CYCLE[0])
        edge = f", {look.fired} fires" if row in at_edges else ""
        said = f"Element 1 is in {look.active}{edge}; F = {trace.F[row]:.3f} N."
        at = float(box.x0 + share * (box.x1 - box.x0))
        frames.append(Frame(f"{trace.t[row]:.4f} s", said, (chart.frame(row),), at))
    return Slider("t", rows.index(at_edges[0]), tuple(frames), beside)


# --------------------------------------------------------------------------- drawing and writing
def limits(ax: Axes, x: tuple[float, float], y: tuple[float, float]) -> None:
    """Give axes the same range in all frames."""
    for (low, high), set_limits in ((x, ax.set_xlim), (y, ax.set_ylim)):
        room = 0.08 * (high - low)
        set_limits(low - room, high + room)


def png(figure: Figure) -> bytes:
    """Draw a figure."""
    out = io.BytesIO()
    layout = figure.get_layout_engine()
    assert layout is not None
    layout.set(rect=(0, 0, 0.98, 1))  # room for half the last label of an axis
    figure.savefig(out, format="png", dpi=DPI)
    return out.getvalue()


def peaks(every: int) -> Slider:
    """Change F_s from F_c to 2.5 F_c."""
    start, values = spaced([each / 10 for each in range(10, 26)], 1.5, every)
    runs = {f"{F_s:.1f} N": pulled(F_s=F_s) for F_s in values}
    return Slider("F_s", start, tuple(cycles(runs)))


def velocities(every: int) -> Slider:
    """Change v_s over more than two decades."""
    tried = (1e-5, 2e-5, 3e-5, 5e-5, 1e-4, 2e-4, 5e-4, 7e-4, 1e-3, 1.5e-3, 2e-3)
    start, values = spaced(tried, 5e-4, every)
    runs = {f"{1e3 * v_s:g} mm/s": pulled(v_s=v_s) for v_s in values}
    return Slider("v_s", start, tuple(cycles(runs)))


def numbers(every: int) -> Slider:
    """Change the number of elements."""
    start, values = spaced(range(1, 17), 4, every)
    return Slider("n", start, tuple(loops(values)))


def spaced(values: Sequence[T], first: T, every: int) -> tuple[int, Sequence[T]]:
    """Return every so many of some values, and where the first position is among them."""
    kept = values[values.index(first) % every :: every]
    return kept.index(first), kept


SLIDERS: dict[str, Callable[[int], Slider]] = {
    "peak": peaks,
    "velocity": velocities,
    "elements": numbers,
    "time": moments,
}


def both(data: bytes | str) -> Iterator[tuple[str, bytes]]:
    """Yield the endings and contents of a picture's light and dark files."""
    if isinstance(data, str):
        yield ".svg", data.encode()
        yield "_dark.svg", dark_svg(data).encode()
    else:
        image = Image.open(io.BytesIO(data)).convert("RGB")
        yield ".webp", webp(image)
        yield "_dark.webp", webp(dark_picture(image))


def write(folder: Path, name: str, slider: Slider) -> None:
    """Write the pictures of a slider, and what the page must know of them."""
    pictures = {
        f"{name}_{k:02}{part}": data
        for k, frame in enumerate(slider.frames)
        for part, data in zip("ab", frame.pictures, strict=False)
    }
    if slider.beside:
        pictures[f"{name}_beside"] = slider.beside
    for stem, data in pictures.items():
        for ending, content in both(data):
            (folder / f"{stem}{ending}").write_bytes(content)
    first = slider.frames[0].pictures
    known = {
        "label": slider.label,
        "start": slider.start,
        "ending": ".svg" if isinstance(first[0], str) else ".webp",
        "parts": "ab"[: len(first)],
        "frames": [[frame.value, frame.said, round(frame.at, 4)] for frame in slider.frames],
    }
    (folder / f"{name}.json").write_text(json.dumps(known), encoding="utf-8")


def write_replay(folder: Path) -> None:
    """Write the replay of the first page, and its picture for browsers without JavaScript."""
    trace = pulled()
    page = replay_html(trace, title="Pulled mass", window=REPLAYED)
    (folder / "replay.html").write_text(page, encoding="utf-8")
    slipping = (trace.states == "slip").sum(axis=1)
    row = int(np.flatnonzero((slipping == 2) & (trace.t > 0.2))[0])
    for ending, content in both(LiveChart(trace, values=True).frame(row)):
        (folder / f"replay{ending}").write_bytes(content)


def write_all(folder: Path, every: int = 1) -> None:
    """Write all frames, unless those in the folder are of the same sources.

    Parameters
    ----------
    folder : Path
        Destination; it contains nothing else.
    every : int, optional
        Every how many positions of a slider are drawn.
    """
    own = b"".join(Path(__file__).with_name(name).read_bytes() for name in ("frames.py", "dark.py"))
    now, stamp = hashlib.sha256(common_sources() + own).hexdigest() + f" {every}", folder / "stamp"
    if stamp.exists() and stamp.read_text() == now:
        return
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    for name, make in SLIDERS.items():
        write(folder, name, make(every))
    write_replay(folder)
    stamp.write_text(now)
