"""A run as one web page: stepped, scrubbed and explained, without a network.

Everything the page shows is computed here and stored in it: values, active states, clause truths
and margins. The page restyles the chart and moves cursors; it evaluates no guard. The plot library
(uPlot) is read from the installed package and written into the page with its licence.
"""

from __future__ import annotations

import base64
import hashlib
import html
import importlib.util
import json
import re
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from gms_fsm._files import written_whole
from gms_fsm.charts.chart import Chart
from gms_fsm.errors import MissingExtraError, ParameterError, SignalError, TraceFileError
from gms_fsm.inspection.explain import explain_state, values_at
from gms_fsm.language.expression import MATLAB_LIKE, Relation, clauses, spell
from gms_fsm.traces.rows import Rows
from gms_fsm.traces.trace import Trace, check_trace
from plots.render import drawn
from plots.statechart import Row, Sheet, element_id, part_id
from plots.style import (
    CHART_THEMES,
    ELEMENT_COLOURS,
    INK,
    PANEL,
    STATE_EDGES,
    STATE_FILLS,
    TEXT_ORANGE,
)

__all__ = ["Replay", "replay", "replay_html", "write_replay"]

MOST_CHARTS = 6  # a larger bank is shown as one chart, that of the chosen element
MOST_ROWS, FEWEST_ROWS = 4000, 200  # rows without a transition, divided by elements + 1
HATCH_ANGLES = (None, 45, 135, 0, 90)  # of the states' ribbons, degrees
SVG = "http://www.w3.org/2000/svg"
COLOURING = ("fill", "stroke", "stroke-dasharray", "stroke-width")
# The licence of uPlot asks to go with every copy; the package's file names the licence only.
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


@dataclass(frozen=True)
class Replay:
    """A replay page; a notebook shows it in a frame that can reach nothing outside of itself.

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

    def _repr_html_(self) -> str:
        # Without allow-same-origin: the page may run its scripts but not touch the notebook.
        return (
            '<iframe sandbox="allow-scripts" title="Replay of a run" width="100%" height="900" '
            f'style="border:0" srcdoc="{html.escape(self.html)}"></iframe>'
        )

    def save(self, path: str | Path) -> Path:
        """Write the page to a file.

        Parameters
        ----------
        path : str or Path
            Usually ends in ``.html``.

        Returns
        -------
        Path
            The file, written whole.

        Raises
        ------
        OutputError
            If the folder cannot be written.
        """
        return written_whole(Path(path), lambda file: file.write(self.html.encode()))


def replay(
    trace: Trace, other: Trace | None = None, *, title: str = "", names: Sequence[str] = ()
) -> Replay:
    """Make a replay page, for a notebook.

    Parameters
    ----------
    trace : Trace
        The run.
    other : Trace, optional
        A second run, shown beside it on the same time.
    title : str, optional
        Of the page; the charts' names if left out.
    names : sequence of str, optional
        What each run is called; two runs of one model on one rig are told apart by nothing else.

    Returns
    -------
    Replay
        Shows itself in a notebook; ``save`` writes it to a file.

    Raises
    ------
    ParameterError
        If there are names, but not one a run.
    MissingExtraError
        If uPlot is not installed.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed, simulate
    >>> trace = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"),
    ...                  Prescribed("0.2"), 3.0)
    >>> replay(trace).save("page.html")  # doctest: +SKIP
    """
    return Replay(replay_html(trace, other, title=title, names=names))


def write_replay(
    path: str | Path,
    trace: Trace,
    other: Trace | None = None,
    *,
    title: str = "",
    names: Sequence[str] = (),
) -> Path:
    """Write a replay page: one file that needs neither a network nor a server.

    Parameters
    ----------
    path : str or Path
        The file; its folder has to exist.
    trace, other, title, names
        See `replay`.

    Returns
    -------
    Path
        The file, written whole.

    Raises
    ------
    ParameterError
        If there are names, but not one a run.
    MissingExtraError
        If uPlot is not installed.
    OutputError
        If the folder cannot be written.
    """
    return replay(trace, other, title=title, names=names).save(path)


def replay_html(
    trace: Trace, other: Trace | None = None, *, title: str = "", names: Sequence[str] = ()
) -> str:
    """Return a replay page as text.

    Parameters
    ----------
    trace, other, title, names
        See `replay`.

    Returns
    -------
    str
        HTML.

    Raises
    ------
    ParameterError
        If there are names, but not one a run.
    MissingExtraError
        If uPlot is not installed.
    """
    traces = [trace] if other is None else [trace, other]
    for each in traces:
        check_trace(each)
    plot_script, plot_style = _uplot()
    if len(names) not in (0, len(traces)):
        raise ParameterError(f"{len(traces)} run(s) but names = {list(names)!r}; give one each")
    pictures = [_chart_svg(each.model.chart, each.n) for each in traces]
    charts = list(dict.fromkeys(pictures))
    chosen = [_page_rows(each) for each in traces]
    frames = _frames([run.t.tolist() for run, _ in chosen])
    runs = [
        {
            "chart": charts.index(picture),
            "title": ": ".join([*names[i : i + 1], f"{run.model.title}; {run.rig.title}"]),
            **_run(run, between, _frame_of(frames, i)),
        }
        for i, (picture, (run, between)) in enumerate(zip(pictures, chosen, strict=True))
    ]
    data = {
        "title": title or " and ".join(dict.fromkeys(t.model.title for t in traces)),
        "runs": runs,
        "frames": frames,
        "events": sorted({entry["frame"] for run in runs for entry in run["log"]}),
        # The ink of a page depends on its theme.
        "colours": ["--ink" if colour == INK else colour for colour in ELEMENT_COLOURS],
        "fills": list(zip(STATE_FILLS, STATE_EDGES, HATCH_ANGLES, strict=True)),
    }
    script = _part("replay_until.js") + _part("replay_page.js")
    style = _theme() + plot_style + _part("replay_page.css")
    scripts = " ".join(map(_hash, (plot_script, script)))
    parts = {
        # Only what is written here may run: text from a trace could not, even as markup.
        "policy": f"default-src 'none'; script-src {scripts}; style-src {_hash(style)}; "
        "base-uri 'none'; form-action 'none'",
        "style": style,
        "charts": "".join(
            f'<template id="chart{i}">{picture}</template>\n' for i, picture in enumerate(charts)
        ),
        "data": _inert(data),
        "licence": f"uPlot, {_copyright(plot_script)}\n\n{MIT}",
        "uplot": plot_script,
        "script": script,
    }
    # In one pass: a part that happens to contain a placeholder is left as it is.
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], _part("replay_template.html"))


# --------------------------------------------------------------------------- the data of a run
def _run(trace: Trace, between: NDArray[np.bool_], frame_of: Sequence[int]) -> dict[str, Any]:
    """Return what the page stores of a run; `frame_of` its rows on the page's common time."""
    chart, n, pool = trace.model.chart, trace.n, _Pool()
    columns = {"x": trace.x, "v": trace.v, "F": trace.F}
    blocks = {name: trace.variable(name) for name in chart.variables}
    if trace.model.stribeck is not None:
        columns["s"] = trace.s[:, 0] / float(trace.model.weights[0])  # the curve itself
        blocks["s"] = trace.s
    for name, block in (blocks | {"F": trace.F_elements}).items():
        columns |= {f"{name}{i + 1}": block[:, i] for i in range(n)}
    edges = _edges(chart)
    first = chart.variables[0]
    inner, inner_title = trace.z, "z [m]" if first == "z" else first
    threshold = bool(edges) and "s" in chart.inputs  # without edges (LuGre) s is none
    if threshold:
        with np.errstate(all="ignore"):
            inner, inner_title = trace.z / trace.s, f"{first} / s(v), lines at ±1"
    sides, truth, holds = _explained(trace, edges, pool)
    log = _log(trace, edges)
    for entry in log:
        entry["frame"] = frame_of[entry["row"]]
    mode = trace.modes.T.tolist()
    return {
        "states": [state.name for state in chart.states],
        "edges": edges,
        "names": {
            "t": pool.add(trace.t, digits=17),  # 17 digits tell all numbers apart
            **{name: pool.add(column) for name, column in columns.items()},
        },
        "inner": {
            "title": inner_title,
            "bounds": [1, -1] if threshold else [],
            "columns": [pool.add(inner[:, i]) for i in range(n)],
        },
        "mode": mode,
        "pieces": [_pieces(trace.t.tolist(), mode[i]) for i in range(n)],
        "microstep": trace.microstep.tolist(),
        "between": between.astype(int).tolist(),
        "sides": sides,
        "truth": truth,
        "stops": [
            [
                [
                    frame_of[row]
                    for row in _stops(
                        mode[i],
                        holds[i][k],
                        edge["source"],
                        [
                            entry["row"]
                            for entry in log
                            if not entry["made"] and (entry["element"], entry["edge"]) == (i, k)
                        ],
                    )
                ]
                for k, edge in enumerate(edges)
            ]
            for i in range(n)
        ],
        "log": log,
        "fired": {e["row"]: [e["element"], e["edge"]] for e in log if e["made"]},
        "pool": pool.columns,
    }


def _edges(chart: Chart) -> list[dict[str, Any]]:
    """Return the edges in the order of the chart's picture."""
    found = []
    for state in chart.states:
        for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
            parts = clauses(chart.guards[edge.name])
            found.append(
                {
                    "name": edge.name,
                    "priority": priority,
                    "source": chart.state_index(edge.source),
                    "target": chart.state_index(edge.target),
                    "clauses": [spell(part, MATLAB_LIKE) for part in parts],
                    "compound": [not isinstance(part, Relation) for part in parts],
                }
            )
    return found


def _pieces(times: Sequence[float], mode: Sequence[int]) -> list[tuple[int, float, float]]:
    """Return the stretches of one state: which, from when, to when."""
    starts = [row for row in range(len(mode)) if row == 0 or mode[row] != mode[row - 1]]
    ends = [*(times[row] for row in starts[1:]), times[-1]]
    return [(mode[row], times[row], end) for row, end in zip(starts, ends, strict=True)]


def _stops(mode: Sequence[int], holds: str, source: int, logged: Sequence[int]) -> list[int]:
    """Return the rows where a guard becomes true while its state is active.

    Such a row comes before every firing, except where only wanted times were stored; there the
    row that shows the firing has to do.
    """
    valid = [state == source and whole == "1" for state, whole in zip(mode, holds, strict=True)]
    rows = [row for row, now in enumerate(valid) if now and not (row and valid[row - 1])]
    return sorted({*rows, *logged})


def _log(trace: Trace, edges: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return each firing, the row that shows it, and whether the firing made that row."""
    times, steps = trace.t.tolist(), trace.microstep.tolist()
    made = {(t, step): row for row, (t, step) in enumerate(zip(times, steps, strict=True)) if step}
    names = [edge["name"] for edge in edges]
    firings: Counter[float] = Counter()  # of one instant
    found: list[dict[str, Any]] = []
    for record in trace.transitions:
        t, name = float(record.t), str(record.edge)
        if name not in names:
            raise TraceFileError(
                f"the transition log names an edge {name!r} that the chart has not"
            )
        firings[t] += 1
        row = made.get((t, firings[t]))
        after = min(int(np.searchsorted(trace.t, t, side="left")), len(times) - 1)
        text = f"element {int(record.element) + 1} {record.source} → {record.target} ({name})"
        found.append(
            {
                "t": t,
                "row": after if row is None else row,
                "made": row is not None,
                "element": int(record.element),
                "edge": names.index(name),
                "text": text,
            }
        )
    return found


def _frames(runs: Sequence[Sequence[float]]) -> dict[str, list[Any]]:
    """Put the rows of one or two runs on one time.

    Rows of one instant are told apart by their order, so that micro-steps stand beside micro-steps.
    """
    keys: list[list[tuple[float, int]]] = []
    for times in runs:
        own: list[tuple[float, int]] = []
        for t in times:
            own.append((t, own[-1][1] + 1 if own and own[-1][0] == t else 0))
        keys.append(own)
    common = sorted(set().union(*keys))
    return {
        "t": [t for t, _ in common],
        "rows": [[max(bisect_right(own, key) - 1, 0) for key in common] for own in keys],
        "own": [[int(key in known) for key in common] for known in map(set, keys)],
    }


def _frame_of(frames: Mapping[str, list[Any]], run: int) -> list[int]:
    """Return the frame of each row of a run."""
    return [frame for frame, own in enumerate(frames["own"][run]) if own]


class _Pool:
    """Columns of numbers, each stored once: most sides of clauses are values shown anyway."""

    def __init__(self) -> None:
        self.columns: list[list[float | str]] = []
        self._known: dict[tuple[float | str, ...], int] = {}

    def add(self, values: Iterable[float], digits: int = 7) -> int:
        """Store a column and return its number; a constant one is stored as one number."""
        column = tuple(_rounded(float(value), digits) for value in values)
        if len(set(column)) == 1:
            column = column[:1]
        if column not in self._known:
            self._known[column] = len(self.columns)
            self.columns.append(list(column))
        return self._known[column]


def _rounded(value: float, digits: int) -> float | str:
    # JSON has no words for these; the page's Number() reads them.
    if value != value:
        return "NaN"
    if value in (np.inf, -np.inf):
        return "Infinity" if value > 0 else "-Infinity"
    value = float(f"{value:.{digits}g}")
    return int(value) if value == int(value) and abs(value) < 1e6 else value


def _page_rows(trace: Trace) -> tuple[Trace, NDArray[np.bool_]]:
    """Return the run with the page's rows, and which of them lie between rows of the run.

    All rows of instants with transitions and their neighbours are kept; the others are thinned, or
    samples are put between them where they are few, so that curves look smooth.
    """
    trace = _with_microsteps(trace)
    wanted = max(FEWEST_ROWS, MOST_ROWS // (trace.n + 1))
    between = np.zeros(len(trace), dtype=bool)
    if len(trace) < wanted and trace.t[-1] > trace.t[0]:
        try:
            refined = trace.refined(wanted - len(trace) + 2)
        except (SignalError, ArithmeticError, ValueError):
            pass  # a signal that is not in the file, or a last row that cannot be computed
        else:
            new = ~np.isin(refined.t, trace.t)
            # Computed again, the rows of a file should be what it holds; if not, the file counts.
            if np.allclose(refined.F[~new], trace.F, rtol=1e-9, equal_nan=True):
                between, trace = new, refined
    instants = np.isin(trace.t, trace.t[trace.microstep > 0])
    kept = instants.copy()
    kept[1:] |= instants[:-1]
    kept[:-1] |= instants[1:]
    kept[[0, -1]] = True
    others = np.flatnonzero(~kept)
    if others.size > wanted:
        others = others[np.linspace(0, others.size - 1, wanted).astype(int)]
    kept[others] = True
    rows = Rows(*(column[kept] for column in _columns(trace.rows)))
    stored = {name: column[kept] for name, column in trace.stored.items()}
    return replace(trace, rows=rows, stops=rows, stored=stored), between[kept]


def _with_microsteps(trace: Trace) -> Trace:
    """Return the run with both sides of every stop, also where only wanted times were stored."""
    stops = trace.stops
    if (trace.microstep > 0).any() or not (stops.microstep > 0).any():
        return trace
    rows = trace.rows
    new = ~np.isin(rows.t, stops.t)  # at a stop its own rows tell more
    pairs = zip(_columns(stops), _columns(rows), strict=True)
    table = _in_time(Rows(*(np.concatenate([a, b[new]]) for a, b in pairs)))
    return Trace(table, table, trace.transitions, trace.model, trace.rig, trace.settings)


def _columns(rows: Rows) -> tuple[NDArray[Any], ...]:
    return rows.t, rows.microstep, rows.y, rows.mode


def _in_time(rows: Rows) -> Rows:
    order = np.argsort(rows.t, kind="stable")
    return Rows(*(column[order] for column in _columns(rows)))


def _explained(
    trace: Trace, edges: Sequence[Mapping[str, Any]], pool: _Pool
) -> tuple[list[Any], list[Any], list[Any]]:
    """Return sides and truth of every clause, and truth of every guard, by element and edge."""
    sides: list[Any] = [[] for _ in range(trace.n)]
    truth: list[Any] = [[] for _ in range(trace.n)]
    holds: list[Any] = [[] for _ in range(trace.n)]
    for i in range(trace.n):
        told = [
            _row_truths(trace.model.chart, values_at(trace, row, i)) for row in range(len(trace))
        ]
        for edge in edges:
            own = [line[edge["name"]] for line in told]
            parts = list(zip(*(of_clauses for _, of_clauses in own), strict=True))
            holds[i].append("".join(whole for whole, _ in own))
            truth[i].append(["".join(found[0] for found in part) for part in parts])
            sides[i].append(
                [[pool.add([found[k] for found in part]) for k in (1, 2, 3)] for part in parts]
            )
    return sides, truth, holds


def _row_truths(chart: Chart, values: Mapping[str, float]) -> dict[str, Any]:
    """Return every guard's truth, and truth, left, right and margin of its clauses."""
    found: dict[str, Any] = {}
    for state in chart.states:
        try:
            for told in explain_state(chart, state.name, values):
                parts = [("01"[c.holds], c.left, c.right, c.margin) for c in told.clauses]
                found[told.edge.name] = ("01"[told.holds], parts)
        except (ArithmeticError, ValueError):  # the last row of a run that could not go on
            for _, edge in chart.leaving(state.name):
                count = len(clauses(chart.guards[edge.name]))
                found[edge.name] = ("?", [("?", np.nan, np.nan, np.nan)] * count)
    return found


# --------------------------------------------------------------------------- the chart
def _chart_svg(chart: Chart, n: int) -> str:
    """Return the chart's SVG for restyling: its parts have roles and numbers instead of colours."""
    sheet = Sheet(chart, live=True)
    numbers = range(n if n <= MOST_CHARTS else 1)
    picture = drawn(sheet.graph(numbers, bare=len(numbers) == 1), "svg")
    if picture is None:
        return "<p>The chart is left out: no Graphviz was found when this page was written.</p>"
    root = ElementTree.fromstring(picture)
    for node in root.iter():
        node.tag = node.tag.removeprefix(f"{{{SVG}}}")
        for title in node.findall(f"{{{SVG}}}title"):
            node.remove(title)  # browsers show titles as tooltips, and these are ids
        _give_role(node)
    root.attrib = {"viewBox": root.attrib["viewBox"]}
    groups = {group.get("id", ""): group for group in root.iter("g")}
    groups["graph0"].remove(groups["graph0"][0])  # its ground; the page has one
    for number in numbers:
        element, edges = element_id(number), 0
        groups.get(element, root).attrib |= {"data-slot": str(number)}
        for k, state in enumerate(chart.states):
            group = groups[part_id(element, "state", state.name)]
            group.attrib |= {"data-slot": str(number), "data-state": str(k)}
            _name_texts(group, sheet.state_rows(state, number))
            for priority, (_, edge) in enumerate(chart.leaving(state.name), start=1):
                guard = groups[part_id(element, "guard", edge.name)]
                path = part_id(element, "edge", edge.name)
                for part in (guard, groups[f"{path}-1"], groups[f"{path}-2"]):
                    part.attrib |= {"data-slot": str(number), "data-edge": str(edges)}
                _name_texts(guard, sheet.guard_rows(edge, priority, number))
                _make_button(guard)
                edges += 1
    return ElementTree.tostring(root, encoding="unicode")


def _give_role(node: ElementTree.Element) -> None:
    """Replace the colours of a shape by what they mean; the page's style sheet knows the themes."""
    drawing = [node.attrib.pop(name, None) for name in COLOURING]
    if node.tag not in ("path", "polygon", "polyline", "ellipse"):
        return
    fill, stroke, dashes, _ = drawing
    if dashes:
        role = "frame"
    elif fill == "none":
        role = "line"
    else:
        role = "ground" if stroke in ("none", "transparent") else "solid"
    node.set("class", role)


def _name_texts(group: ElementTree.Element, rows: Iterable[Row]) -> None:
    pieces = [piece for row in rows for piece in row]
    for piece, text in zip(pieces, group.findall("text"), strict=True):
        text.set("class", piece.role)
        if piece.clause >= 0:
            text.set("data-clause", str(piece.clause))


def _make_button(guard: ElementTree.Element) -> None:
    guard.attrib |= {"role": "button", "tabindex": "0"}
    corners = [point.split(",") for point in guard[0].attrib["points"].split()]
    x, y = (min(corner, key=float) for corner in zip(*corners, strict=True))  # left, above
    ElementTree.SubElement(guard, "circle", {"class": "stop", "cx": x, "cy": y, "r": "4.5"})


# --------------------------------------------------------------------------- the page's parts
def _uplot() -> tuple[str, str]:
    """Return uPlot's script and style sheet from the package that brings them."""
    # Not imported: its own plotting functions need IPython, its files do not.
    found = importlib.util.find_spec("uplot")
    for folder in (found.submodule_search_locations or []) if found else []:
        static = Path(folder, "static")
        scripts = [*static.glob("uPlot.iife.min.js"), *static.glob("uPlot.iife.js")]
        styles = list(static.glob("uPlot.min.css"))
        if scripts and styles:
            return _text(scripts[0]), _text(styles[0])
    raise MissingExtraError(
        'a replay page needs uPlot; install it with: pip install "gms-fsm[replay]"'
    )


def _text(path: Path | Traversable) -> str:
    # The page's policy names hashes of scripts, and browsers hash them with plain line ends.
    return path.read_text(encoding="utf-8").replace("\r\n", "\n")


def _part(name: str) -> str:
    return _text(resources.files("plots").joinpath(name))


def _hash(text: str) -> str:
    digest = hashlib.sha256(text.encode()).digest()
    return f"'sha256-{base64.b64encode(digest).decode()}'"


def _copyright(script: str) -> str:
    line = re.search(r"Copyright \(c\) [^\n]*", script[:1000])
    return line[0].replace("--", "") if line else "MIT License"


def _theme() -> str:
    """Return the colours of both themes as variables of the style sheet."""
    more = {"light": (PANEL, "#E3E6EA", TEXT_ORANGE), "dark": ("#1D2127", "#2B3038", "#FF8A3D")}
    texts = {}
    for name, theme in CHART_THEMES.items():
        colours = {key.replace("_", "-"): value for key, value in vars(theme).items()}
        colours |= dict(zip(("panel", "grid", "fired-text"), more[name], strict=True))
        texts[name] = "".join(f"--{key}:{value};" for key, value in colours.items())
    return (
        f":root{{color-scheme:light dark;{texts['light']}}}\n"
        f"@media(prefers-color-scheme:dark){{:root{{{texts['dark']}}}}}\n"
    )


def _inert(data: object) -> str:
    """Write data as JSON in which nothing can end or begin markup."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
