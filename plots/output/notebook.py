"""What notebooks show of charts, models, systems, runs, fits, sessions, explanations and checks.

The classes ask here when a notebook shows an object (`gms_fsm.foundation.display`). A chart, a
model or a system is a picture, or its text without Graphviz; a run is its overview, or its contacts
if there are several; results are tables.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping
from importlib.util import find_spec
from io import BytesIO
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np

from gms_fsm.charts.chart import Chart
from gms_fsm.difference.result import Diff
from gms_fsm.errors import GMSError, MissingExtraError
from gms_fsm.foundation.display import Form, Log
from gms_fsm.foundation.quantities import trimmed
from gms_fsm.session.explain import Clause, Explanation, Why
from gms_fsm.session.results import BranchComparison, Here
from gms_fsm.session.session import Session
from gms_fsm.systems.gms_parameters import GMSParameters
from gms_fsm.systems.models import GMS, ChartModel, LuGre, Model
from gms_fsm.systems.system import Contact, System
from gms_fsm.traces.coverage.total import Coverage
from gms_fsm.traces.trace import Trace
from gms_fsm.traces.verdicts import (
    ChatteringVerdict,
    CoverageVerdict,
    InvariantVerdict,
    PassivityVerdict,
)
from gms_fsm.traces.views import range_of_force
from gms_fsm.verification.findings import Finding, Report
from plots.charts.live_chart import LiveChart
from plots.charts.statechart import statechart
from plots.output.drawings import DrawnGraph, image, svg_of
from plots.output.graphviz import available
from plots.output.html import listing, paragraph, table
from plots.systems.block_diagram import block_diagram

if TYPE_CHECKING:
    from gms_fsm.identification.result import Fit


MOST_ELEMENTS = 4  # of a live chart
MOST_ROWS = 10  # of a table
DPI = 200  # of a figure: two pixels per point of a screen, crisp on dense displays


def shown(thing: object, form: Form) -> Any:
    """Return an object in one of the forms that notebooks show."""
    for kind in type(thing).__mro__:
        for key in (kind, f"{kind.__module__}.{kind.__qualname__}"):
            if (key, form) in FORMS:
                return FORMS[key, form](thing)
    return None


def figure_png(figure: Any) -> tuple[bytes, dict[str, int]]:
    """Return a matplotlib figure for IPython."""
    png = _png(figure, dpi=DPI, bbox_inches="tight")
    width, height = (int.from_bytes(png[place : place + 4]) for place in (16, 20))
    return png, {"width": width // 2, "height": height // 2}


def _png(figure: Any, **options: Any) -> bytes:
    buffer = BytesIO()
    figure.savefig(buffer, format="png", **options)
    return buffer.getvalue()


# --------------------------------------------------------------------------- drawings
@functools.singledispatch
def graph_of(subject: Any) -> DrawnGraph:
    """Return what is drawn of a chart, a model, a contact or a system."""
    return statechart(subject.chart, subject.n)


graph_of.register(System, block_diagram)
graph_of.register(Chart, statechart)


def subject_svg(subject: Chart | Model | Contact | System) -> str | None:
    """Return a chart, a model, a contact or a system as SVG, or None without Graphviz."""
    return svg_of(graph_of(subject))


def subject_html(subject: Chart | Model | Contact | System) -> str:
    """Return the same as an image in HTML, or as text where it cannot be drawn."""
    graph = graph_of(subject)
    picture = svg_of(graph)
    title = f"{subject.title}\n" if hasattr(subject, "title") else ""
    words = title + graph.text
    return listing(words) if picture is None else image(picture, words)


# --------------------------------------------------------------------------- runs
def trace_png(trace: Trace) -> bytes | None:
    """Return a run's overview as PNG, or None without matplotlib or without one contact alone."""
    if trace.subject.several or not trace.model.chart.velocities:
        return None
    try:
        from plots.figures import overview
    except MissingExtraError:
        return None
    return _png(overview(trace), dpi=100)


def trace_html(trace: Trace) -> str | None:
    """Return a table of the contacts of a run that has no overview, if it has any."""
    several = trace.subject.several
    if not several and (not trace.model.chart.velocities or find_spec("matplotlib") is not None):
        return None
    parts = [trace.contact(name) for name in trace.contacts] if several else [trace]
    if not parts:
        return None
    rows = [
        [p.model.title, p.n, len(p.transitions), *range_of_force(p), p.model.chart.force]
        for p in parts
    ]
    return table(
        ["contact", "elements", "transitions", "least F", "largest F", "unit"],
        rows,
        caption=repr(trace),
        more=f"trace.contact({trace.contacts[0]!r}) shows one of them" if several else "",
    )


def log_html(log: Log) -> str | None:
    """Return the first records of a log as a table."""
    names = log.dtype.names
    if names is None or log.ndim != 1:
        return None
    rest = len(log) - MOST_ROWS
    rows = (record.tolist() for record in log[:MOST_ROWS])
    return table(
        ["", *names],
        ([i, *row] for i, row in enumerate(rows)),
        more=f"and {rest} more" if rest > 0 else f"{len(log)} records",
    )


def verdict_html(verdict: Any) -> str:
    """Return the sentence of a monitor."""
    return paragraph(f"{'holds' if verdict.ok else 'violated'}: {verdict.text}")


def parameters_html(parameters: GMSParameters) -> str:
    """Return the numbers of a bank, element by element."""
    columns = [parameters.k, parameters.sigma, parameters.C, parameters.weights]
    rest = parameters.n - MOST_ROWS
    curve = f"{parameters.stribeck!r}, sigma_2 = {parameters.sigma_2:g} Ns/m, "
    return table(
        ["element", "k [N/m]", "sigma [Ns/m]", "C", "weight [m/N]"],
        ([i + 1, *row] for i, row in enumerate(np.array(columns).T[:MOST_ROWS].tolist())),
        caption=f"{curve}v_c = {parameters.v_c:g} m/s",
        more=f"and {rest} more elements" if rest > 0 else "",
    )


# --------------------------------------------------------------------------- fits
def fit_html(fit: Fit) -> str:
    """Return the parameters of a fit with what cannot be told, its scores, and its figure."""
    words = table(
        ["parameter", "value", "95 % interval", "unit", "note"],
        ([each.name, *each.shown, each.unit, each.note] for each in fit.table),
        caption=f"{fit.title}: {fit.scores_text}",
        more=fit.weakest,
    )
    picture = fit_png(fit)
    if picture is None:
        return words
    return words + image(picture, "measurement and model, residuals, parameters")


def fit_png(fit: Fit) -> bytes | None:
    """Return the figure of a fit as PNG, or None without matplotlib."""
    try:
        from plots.figures import fit_figure
    except MissingExtraError:
        return None
    return _png(fit_figure(fit), dpi=100)


# --------------------------------------------------------------------------- sessions
def session_html(session: Session) -> str:
    """Return where a session is, and its chart there if it has one contact."""
    branch = session.branch
    parts = [paragraph(session.title), listing(str(session.here))]
    if len(session.branches) > 1:
        parts.append(
            table(
                ["branch", "from", "at row", "rows"],
                (
                    [i, "" if each.parent is None else each.parent, max(each.fork, 0), len(each)]
                    for i, each in zip(session.tree.forks, session.branches, strict=True)
                ),
                caption=f"branch {session.current} of {len(session.branches)}",
            )
        )
    if len(session.system.contacts) == 1 and available():
        trace = branch.trace()
        try:
            chart = LiveChart(trace, min(trace.n, MOST_ELEMENTS), values=True)
        except GMSError:
            return "".join(parts)
        parts.append(image(chart.frame(branch.cursor), "the chart there"))
    return "".join(parts)


def text_html(result: Here | BranchComparison | Diff | Coverage) -> str:
    """Return a result as the text of the debugger."""
    return listing(str(result))


def explanation_html(edge: Explanation) -> str:
    """Return why one edge fires or not, clause by clause."""
    verdict = str(edge).partition("\n")[0]
    leads = f"{edge.priority} {edge.edge.name}: {edge.edge.source} → {edge.edge.target}"
    rows = ([c.text, "✓ true" if c.holds else "✗ false", *_sides(c)] for c in edge.clauses)
    return paragraph(verdict) + table([leads, "", "left", "right", "margin"], rows)


def _sides(clause: Clause) -> list[str]:
    """Return both sides of a clause and its margin, in one unit."""
    values = (clause.left, clause.right, clause.margin)
    return ["" if np.isnan(u) else trimmed(clause.scale.text(u, 6)) for u in values]


def why_html(why: Why) -> str:
    """Return why an element switches or not."""
    lines = str(why).splitlines()
    own = len(lines) - sum(2 + len(edge.clauses) for edge in why)  # then those of the edges
    return "".join(chain(map(paragraph, lines[:own]), map(explanation_html, why)))


# --------------------------------------------------------------------------- checks
def report_html(report: Report) -> str:
    """Return what was proved and refuted, as a table."""
    lines = str(report).splitlines()
    return table(
        ["check", "result", "where", "statement", "for example at"],
        _findings(*report.findings),
        caption=f"{report.chart.name}; assumed: {', '.join(report.domain) or 'nothing'}",
        more=lines[-1],
    )


def finding_html(finding: Finding) -> str:
    """Return one finding as a table."""
    return table(["check", "result", "where", "statement", "for example at"], _findings(finding))


def _findings(*findings: Finding) -> Iterator[list[str]]:
    signs = {"proved": "✓", "settled by order": "✓", "refuted": "✗", "undecided": "?"}
    for each in findings:
        where = ", ".join(each.where) or "the chart"
        case = f" ({each.case})" if each.case else ""
        status = f"{signs[each.status]}\N{NO-BREAK SPACE}{each.status}"
        yield [each.check, status, where + case, each.text, each.example]


# By class; by name where importing the class takes long.
FORMS: Mapping[tuple[type | str, Form], Callable[[Any], Any]] = {
    **{(kind, "svg"): subject_svg for kind in (Chart, GMS, LuGre, ChartModel, Contact, System)},
    **{(kind, "html"): subject_html for kind in (Chart, GMS, LuGre, ChartModel, Contact, System)},
    (GMSParameters, "html"): parameters_html,
    (Trace, "png"): trace_png,
    (Trace, "html"): trace_html,
    (Log, "html"): log_html,
    **{
        (kind, "html"): verdict_html
        for kind in (ChatteringVerdict, InvariantVerdict, PassivityVerdict, CoverageVerdict)
    },
    ("gms_fsm.identification.result.Fit", "html"): fit_html,
    (Session, "html"): session_html,
    (Here, "html"): text_html,
    (BranchComparison, "html"): text_html,
    (Diff, "html"): text_html,
    (Coverage, "html"): text_html,
    (Explanation, "html"): explanation_html,
    (Why, "html"): why_html,
    (Report, "html"): report_html,
    (Finding, "html"): finding_html,
}
