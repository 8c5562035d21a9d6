"""A run as a single web page to step, scrub and explain it, without a network.

Python stores the values of the run, its transitions, charts as pictures and guards as trees.
The page computes truths, margins and regions from these trees, with one function for all of them;
it has no switching rules of its own. The only text it parses is the condition that a user types
into its `until` box. The plot library (uPlot) is read from the installed package and written into
the page with its licence.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import html
import importlib.util
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypedDict, Unpack

from gms_fsm.charts.chart import Chart
from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind, listed, pointing, refusing, unknown
from gms_fsm.foundation.extras import missing
from gms_fsm.foundation.quantities import PREFIXES, SMALLEST, TAKES_PREFIX, UNITS
from gms_fsm.foundation.text import visible, visible_lines
from gms_fsm.language import (
    COMPARISONS,
    CONSTANTS,
    ELEMENTARY,
    FUNCTIONS,
    LEVELS,
    OPERATIONS,
    SEVERAL,
    SHORT,
)
from gms_fsm.session.explain import NOTHING, ROUNDING
from gms_fsm.traces.trace import Trace
from gms_fsm.verification.prove import Report
from integrators.machine_code.script.javascript import library_text
from plots.output import formats
from plots.page._rows import page_rows
from plots.page._run import stored_run, views_of
from plots.page.chart import chart_svg
from plots.style import CHART_THEMES, ELEMENT_STEPS, PAGE_THEMES
from plots.views.window import window_of

# In this order: later ones use what earlier ones define.
SCRIPTS = (
    "js/base.js",
    "js/trees.js",
    "js/run.js",
    "js/until.js",
    "js/panes/plane.js",
    "js/panes/chart.js",
    "js/plots.js",
    "js/views.js",
    "js/panes/phase.js",
    "js/panes/regions.js",
    "js/panes/landscape.js",
    "js/panes/microscope.js",
    "js/panes/bristles.js",
    "js/host.js",
    "js/presenting.js",
    "js/page.js",
)
START = ("js/start.js",)
HATCH_ANGLES = (None, 45, 135, 0, 90)  # of the states' ribbons, degrees
# uPlot's licence must accompany every copy, but the package's file only names it.
MIT = """\
Permission is hereby granted, free of charge, to any person obtaining a copy of this software and
associated documentation files (the "Software"), to deal in the Software without restriction,
including without limitation the rights to use, copy, modify, merge, publish, distribute,
sublicense, and/or sell copies of the Software, and to permit persons to whom the Software is
furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all copies or substantial
portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT
NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND
NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES
OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN
CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE."""


@functools.cache
def _elementary() -> str:
    """Return the elementary functions of the expression language as JavaScript."""
    return f"const ELEMENTARY = {library_text(ELEMENTARY)};\n"


@pointing({"show": "page.save('page.html') and open it; a notebook shows the page itself"})
@dataclass(frozen=True)
class Replay:
    """A replay page; a notebook shows it in an isolated frame.

    Parameters
    ----------
    html : str
        The whole page.

    Examples
    --------
    >>> Replay("<p>a page</p>")._repr_html_()[:32]
    '<iframe sandbox="allow-scripts" '
    """

    html: str

    def __repr__(self) -> str:
        return f"<Replay: a page of {len(self.html)} characters; .save(path) writes it to a file>"

    def _repr_html_(self) -> str:
        # Without allow-same-origin: the page may run its scripts but not touch the notebook.
        return (
            '<iframe sandbox="allow-scripts" title="Replay of a run" width="100%" height="900" '
            f'style="border:0" srcdoc="{html.escape(self.html)}"></iframe>'
        )

    def save(self, path: str | Path) -> Path:
        """Write the page to a file."""
        return formats.save(self, path, "page")


class PageOptions(TypedDict, total=False):
    """What is chosen for a page; see `replay`."""

    title: str
    names: Sequence[str]
    window: tuple[float, float] | None
    checks: Report | Sequence[Report]
    notes: Mapping[float | str, str]


@refusing()
def replay(
    trace: Trace,
    other: Trace | None = None,
    **options: Unpack[PageOptions],
) -> Replay:
    """Make a replay page, for a notebook.

    Parameters
    ----------
    trace : Trace
        The run.
    other : Trace, optional
        A second run, drawn in the same plots over time.
    title : str, optional
        Title of the page; by default those of the scenarios, or the names of the models.
    names : sequence of str, optional
        Names of the runs; the only distinction between two runs of one model on one rig.
    window : (float, float), optional
        Time interval to show, s; by default the whole run. A run with more transitions than a page
        can hold needs one.
    checks : Report or sequence of Report, optional
        From `gms_fsm.verification.prove.prove`; the counterexamples are pinned in the landscapes of
        their charts.
    notes : mapping of float or str to str, optional
        What a lecturer says in a presentation of the page (key ``n``): from a time on, s, or
        whenever the edge of that name fires.

    Returns
    -------
    Replay
        The page; it displays itself in a notebook, and ``save`` writes it to a file.

    Raises
    ------
    ParameterError
        If there are names, but not one per run, the window is not inside the run, or it contains
        too many transitions; if a note is for a time outside the runs or for an edge they do not
        have.
    MissingExtraError
        If uPlot is not installed.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> replay(trace).save("page.html")  # doctest: +SKIP
    """
    return Replay(replay_html(trace, other, **options))


@refusing()
def write_replay(
    path: str | Path,
    trace: Trace,
    other: Trace | None = None,
    **options: Unpack[PageOptions],
) -> Path:
    """Write a replay page: a single file that needs neither a network nor a server.

    Parameters
    ----------
    path : str or Path
        The file; its folder must exist, and its ending selects the format, such as ``.html``.
    trace, other, **options
        See `replay`.

    Returns
    -------
    Path
        The file, written atomically.

    Raises
    ------
    ParameterError
        If there are names, but not one per run, or the file ending is not supported.
    MissingExtraError
        If uPlot is not installed.
    OutputError
        If the folder cannot be written.
    """
    formats.chosen(path, "page")  # before any work
    return replay(trace, other, **options).save(path)


def replay_html(
    trace: Trace,
    other: Trace | None = None,
    **options: Unpack[PageOptions],
) -> str:
    """Return a replay page as text."""
    traces = [trace] if other is None else [trace, other]
    data, charts = page_data(traces, **options)
    for run, each in zip(data["runs"], traces, strict=True):
        run["trust"] = [str(found) for found in each.trust()]
    return page_html(data, charts)


def page_data(
    traces: Sequence[Trace],
    *,
    title: str = "",
    names: Sequence[str] = (),
    window: tuple[float, float] | None = None,
    checks: Report | Sequence[Report] = (),
    notes: Mapping[float | str, str] = MappingProxyType({}),
    draw: Callable[[Chart, int], str] = chart_svg,
) -> tuple[dict[str, Any], list[str]]:
    """Return what a page shows: the data of one or two runs, and pictures of their charts."""
    for each in traces:
        checked_kind("trace", each, Trace, "a Trace, from simulate(...) or Trace.load(path)")
        window_of(each, window)
    checked_kind("title", title, str, "a text")
    reports = [checks] if isinstance(checks, Report) else listed("checks", checks, "Reports")
    known = [view.model.chart for each in traces for view in views_of(each)]
    for report in reports:
        checked_kind("checks", report, Report, "a Report, from prove(chart)")
        if report.chart not in known:
            raise ParameterError(
                f"checks has a Report of another chart, {report.chart.name!r}",
                advice=f"these runs have {', '.join(sorted({chart.name for chart in known}))}",
            )
    names = [checked_kind("names", each, str, "texts") for each in listed("names", names, "texts")]
    if len(names) not in (0, len(traces)):
        raise ParameterError(
            f"{len(traces)} run(s) but names = {list(names)!r}", advice="give one each"
        )
    charts: list[str] = []
    runs = []
    for i, each in enumerate(traces):
        page = page_rows(each, window)
        pictures = [draw(view.model.chart, view.n) for view in views_of(each)]
        charts += [picture for picture in dict.fromkeys(pictures) if picture not in charts]
        run = stored_run(page, [charts.index(picture) for picture in pictures], reports)
        head = [*(u for u in names[i : i + 1] if not each.title.startswith(u)), each.title]
        runs.append({"title": visible(": ".join(head)), "of": len(each), **run})
    named = title or " and ".join(dict.fromkeys(map(heading, traces)))
    own = {"title": visible(named), "runs": runs, "notes": _notes(notes, traces)}
    return {**own, **common_data()}, charts


def common_data() -> dict[str, Any]:
    """Return what a page knows of any run: the language, units, words."""
    return {
        "language": _language(),
        "quantities": {
            "prefixes": PREFIXES,
            "prefixed": TAKES_PREFIX.pattern,
            "smallest": SMALLEST,
        },
        "hatches": HATCH_ANGLES,
        "rounding": ROUNDING,
        "nothing": NOTHING,
    }


def page_html(
    data: Mapping[str, Any],
    charts: Sequence[str],
    engine: tuple[str, ...] = (),
    more: Sequence[str] = START,
    styles: Sequence[str] = ("page.css",),
) -> str:
    """Return a page that shows data from `page_data`, with further scripts of its own.

    An engine, and what starts it, are read before anything else.
    """
    plot_script, plot_style = _uplot()
    script = "".join([_elementary(), *map(part_text, (*SCRIPTS, *more))])
    style = "".join([_theme(), plot_style, *map(part_text, styles)])
    scripts = " ".join(map(_hash, (*engine, plot_script, script)))
    worker = "worker-src blob:; " * bool(engine)  # which has the policy of the page
    parts = {
        # Only the scripts written here may run; text from a trace cannot, even as markup.
        "policy": f"default-src 'none'; script-src {scripts}; style-src {_hash(style)}; {worker}"
        "base-uri 'none'; form-action 'none'",
        "style": style,
        "charts": "".join(
            f'<template id="chart{i}">{picture}</template>\n' for i, picture in enumerate(charts)
        ),
        "data": _inert(data),
        "licence": f"uPlot, {_copyright(plot_script)}\n\n{MIT}",
        "uplot": plot_script,
        "engine": "".join(
            f"<script{name}>{text}</script>\n"
            for name, text in zip((' id="engine"', ""), engine, strict=False)
        ),
        "script": script,
    }
    # In one pass, so that placeholders inside the parts are left unchanged.
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], part_text("template.html"))


def _notes(notes: Mapping[Any, str], traces: Sequence[Trace]) -> list[dict[str, Any]]:
    """Return the notes, each with its time or its edge."""
    checked_kind("notes", notes, Mapping, "a mapping from times, s, or names of edges to texts")
    edges = {
        edge.name
        for each in traces
        for view in views_of(each)
        for edge in view.model.chart.transitions
    }
    start, end = (pick(each.t[at] for each in traces) for pick, at in ((min, 0), (max, -1)))
    found: list[dict[str, Any]] = []
    for when, text in notes.items():
        checked_kind(f"notes[{when!r}]", text, str, "a text")
        if isinstance(when, str):
            if when not in edges:
                raise unknown("edge", when, sorted(edges)).inside("notes")
            found.append({"edge": when, "text": visible_lines(text)})
        elif isinstance(when, int | float) and start <= when <= end:
            found.append({"at": float(when), "text": visible_lines(text)})
        else:
            raise ParameterError(
                f"a note begins at a time of the run, from {start:g} to {end:g} s, or at an edge",
                place="notes",
                value=when,
            )
    return found


def heading(trace: Trace) -> str:
    """Return the title of the scenario, or else the name of what runs."""
    return trace.heading or trace.subject.title


def _language() -> dict[str, Any]:
    """Return the parts of the language that the page needs to parse a typed condition."""
    binary = {op: LEVELS[op] for op in ("or", "and", *OPERATIONS, "**")}
    return {
        "levels": binary | dict.fromkeys([*COMPARISONS, "==", "!="], LEVELS["<"]),
        "negation": LEVELS["not"],
        "sign": LEVELS["neg"],
        "functions": dict.fromkeys(FUNCTIONS, 1) | dict.fromkeys(SEVERAL, None) | SHORT,
        "constants": dict(CONSTANTS),
        "units": {  # each with its factor, and the unit of SI for what it measures
            unit: [factor, next(name for name, one in units.items() if one == 1.0)]
            for units in UNITS.values()
            for unit, factor in units.items()
        },
    }


# --------------------------------------------------------------------------- the page's parts
def _uplot() -> tuple[str, str]:
    """Return uPlot's script and style sheet from the installed package."""
    # Not imported: its plotting functions need IPython, its files do not.
    found = importlib.util.find_spec("uplot")
    for folder in (found.submodule_search_locations or []) if found else []:
        static = Path(folder, "static")
        scripts = [*static.glob("uPlot.iife.min.js"), *static.glob("uPlot.iife.js")]
        styles = list(static.glob("uPlot.min.css"))
        if scripts and styles:
            return _text(scripts[0]), _text(styles[0])
    raise missing("uPlot", "replay")


def _text(path: Path | Traversable) -> str:
    # The page's policy contains hashes of scripts, and browsers hash them with plain line ends.
    return path.read_text(encoding="utf-8").replace("\r\n", "\n")


def part_text(name: str) -> str:
    """Return a file of the page's own."""
    return _text(resources.files("plots.page").joinpath(name))


def _hash(text: str) -> str:
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def _copyright(script: str) -> str:
    line = re.search(r"Copyright \(c\) [^\n]*", script[:1000])
    return line[0].replace("--", "") if line else "MIT License"


def _theme() -> str:
    """Return the colours of both themes as variables, and the looks of states."""
    texts = {}
    for name, theme in CHART_THEMES.items():
        page = PAGE_THEMES[name]
        colours = {key.replace("_", "-"): value for key, value in vars(theme).items()}
        colours |= {"panel": page.panel, "grid": page.grid, "chosen": page.chosen}
        colours |= {"fired-text": page.fired_text, "fired-fill": page.fired_fill}
        steps = (
            ("e", page.elements),
            ("fill", page.fills),
            ("hatch", page.hatches),
            ("slip", page.slipping),
            ("edge", page.edges),
        )
        for key, values in steps:
            colours |= {f"{key}{k}": value for k, value in enumerate(values)}
        texts[name] = "".join(f"--{key}:{value};" for key, value in colours.items())
    looks = "".join(
        f".state{k}{{background:{_hatched(k, angle)}}}\n" for k, angle in enumerate(HATCH_ANGLES)
    )
    swatches = "".join(
        f".e{k}{{border-color:var(--e{k})!important}}\n" for k in range(ELEMENT_STEPS)
    )
    dark = texts["dark"]
    return (
        f":root{{color-scheme:light dark;{texts['light']}}}\n"
        f"@media(prefers-color-scheme:dark){{:root:not([data-theme=light]){{{dark}}}}}\n"
        f":root[data-theme=light]{{color-scheme:light}}\n"
        f":root[data-theme=dark]{{color-scheme:dark;{dark}}}\n{looks}{swatches}"
    )


def _hatched(k: int, angle: int | None) -> str:
    if angle is None:
        return f"var(--fill{k})"
    return f"repeating-linear-gradient({angle}deg,var(--hatch{k}) 0 1px,var(--fill{k}) 1px 6px)"


def _inert(data: object) -> str:
    """Write data as JSON that cannot be read as markup."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
