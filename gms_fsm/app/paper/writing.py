"""Runs the paper's experiments and writes figures, charts, traces, logs and the table of claims."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gms_fsm.app.paper import FORCE, VELOCITY
from gms_fsm.app.paper.claims import PAIRS, Claim, differing_numbers, force_difference, judge
from gms_fsm.app.paper.experiments import Progress, experiments, run_one
from gms_fsm.app.paper.held import OSCILLATION, PAPERS_FORCE, PAPERS_PLACE, RAMP, figure_3_lags
from gms_fsm.charts import GMS_ELEMENT, LUGRE
from gms_fsm.charts.zoo.bristles.lugre import BENCHMARK
from gms_fsm.errors import MissingExtraError
from gms_fsm.foundation.files import output_folder, write_text
from gms_fsm.language import evaluate
from gms_fsm.lowering.program import lower
from gms_fsm.systems.signals import Formula
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.trace import Trace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["claims_text", "held_figure", "write"]

CHARTS = ("fig2a", "fig2b", "chart_bank", "chart_lugre")
FIGURES = (
    "fig1",
    "fig2c",
    "fig3",
    "fig3_slipping",
    "fig4",
    "fig4_laws",
    "residual",
    "residual_held",
)
ELEMENTS = 3  # in Fig. 1 and 2a
USED = "switch", "flow"  # in Fig. 2c
LISTED = "Fig. 2c: the switching as if-else code, generated from the chart of Fig. 2b"
PARTED = 0.1  # N: runs that differ by more have parted
LINE = 1.35  # distance of its lines, in sizes of the font


def write(
    folder: str | Path,
    force: str = FORCE,
    velocity: str = VELOCITY,
    progress: Progress | None = None,
) -> list[Path]:
    """Run all experiments and write figures, charts, traces, logs and the table of claims.

    Parameters
    ----------
    folder : str or Path
        Output folder; created if it does not exist.
    force, velocity : str
        The signals that the paper does not print, in the expression language.
    progress : callable, optional
        ``progress(name, done)``, with the share of everything done.

    Returns
    -------
    list of Path
        The files written, ``claims.md`` first.

    Raises
    ------
    OutputError
        If the folder is not writable (checked before the runs).
    SimulationError
        If a run cannot continue; the run so far is written to ``partial.npz``.
    """
    from plots.output import formats

    chosen = experiments(force, velocity)
    drawn = [file for name in CHARTS for file in formats.files(name, "graph")]
    drawn += [file for name in FIGURES for file in formats.files(name, "figure")]
    folder = output_folder(folder, ["claims.md", "partial.npz", *drawn])
    output_folder(folder / "traces", [f"{experiment.name}.npz" for experiment in chosen])
    output_folder(folder / "transitions", [f"{experiment.name}.csv" for experiment in chosen])
    traces: dict[str, Trace] = {}
    files: list[Path] = []
    stages = len(chosen) + 1

    def reached(name: str, done: float) -> None:
        if progress is not None:
            progress(name, (len(traces) + done) / stages)

    for experiment in chosen:
        name = experiment.name
        try:
            traces[name] = run_one(experiment, reached)
        except SimulationError as error:
            kept = error.trace.save(folder / "partial.npz")
            raise error.replaced(kept=kept).inside(name) from error.__cause__
        files += _keep(folder, name, traces[name])
    reached("claims and figures", 0.0)
    claims = write_text(folder / "claims.md", claims_text(traces, force, velocity))
    files += _draw_charts(folder)
    try:
        files += _draw_figures(folder, traces, force)
    except MissingExtraError as error:
        warnings.warn(f"no figures were drawn: {error}", stacklevel=2)
    reached("claims and figures", 1.0)
    return [claims, *files]


def _keep(folder: Path, name: str, trace: Trace) -> list[Path]:
    """Write a run as soon as it is complete, so that a later failure cannot lose it."""
    saved = trace.save(folder / "traces" / f"{name}.npz")
    return [saved, write_text(folder / "transitions" / f"{name}.csv", trace.transitions_csv())]


def _draw_charts(folder: Path) -> list[Path]:
    import plots
    from plots.output import formats

    pictures = {
        "fig2a": plots.block_diagram(ELEMENTS),
        "fig2b": plots.statechart(GMS_ELEMENT["published"]),
        "chart_bank": plots.statechart(GMS_ELEMENT["published"], elements=4),
        "chart_lugre": plots.statechart(LUGRE),
    }
    files = [
        plots.render(graph, folder / f"{name}{ending}")
        for name, graph in pictures.items()
        for ending in formats.endings("graph", usual=True)
    ]
    return list(dict.fromkeys(files))  # without Graphviz both endings give one DOT file


def _draw_figures(folder: Path, traces: Mapping[str, Trace], force: str) -> list[Path]:
    from plots import figures
    from plots.output import formats
    from plots.systems.mechanism import schematic_figure

    def applied(trace: Trace) -> NDArray[np.float64]:
        tree = Formula(force).tree
        return np.array([evaluate(tree, {"t": t}) for t in trace.t.tolist()])

    def fig3(name: str, title: str, limit: float | None = None) -> object:
        chart, ifelse = (
            traces[f"{name}_{engine}"].refined(figures.SMOOTH) for engine in ("chart", "ifelse")
        )
        peak = int(chart.F.argmax())  # at the arrest of element 1
        more = chart.F[peak] - chart.F[min(peak + 1, len(chart) - 1)]
        return figures.figure_3(
            chart,
            ifelse,
            traces["fig3_lugre"],
            applied(chart),
            title=title,
            phases=figures.FIG3_PHASES if force == FORCE else [("", np.inf)],
            limit=limit,
            reason=r"before the arrest, as $v$ → 0, $s(v)$ rises from $F_c$ to $F_s$,"
            f"\nand $\\sigma_{{1,1}}$ d$z_1$/d$t$ adds {more:.1f} N",
        )

    pictures = {
        "fig1": schematic_figure(elements=ELEMENTS, title=f"Slider on {ELEMENTS} Maxwell elements"),
        "fig2c": _listing(traces["fig4_ifelse"]),
        "fig3": fig3("fig3", "Fig. 3, non-drifting: a force below break-away"),
        "fig3_slipping": fig3(
            "fig3_slipping",
            "Fig. 3 with weights 0.25/k (our addition): element 1 slips, and still no drift",
            limit=0.75,
        ),
        "fig4": figures.figure_4(traces["fig4_chart"], traces["fig4_ifelse"], traces["fig4_lugre"]),
        "fig4_laws": figures.compare_laws(
            {
                "published law, eq. (1) as printed": traces["fig4_chart"],
                "signed law (Al-Bender et al. 2005)": traces["fig4_signed_chart"],
            }
        ),
        "residual": figures.residuals(
            {
                f"Fig. 4 run (stick-slip, published law){_parting(traces)}": force_difference(
                    traces["fig4_step"], traces["fig4_chart"]
                ),
                "Fig. 3 run (non-drifting)": force_difference(
                    traces["fig3_step"], traces["fig3_chart"]
                ),
            },
            "Difference of $F$: guards looked at once per step (at most 1 ms, rtol $10^{-4}$), "
            "minus located",
        ),
        "residual_held": held_figure(traces, force),
    }
    return [
        figures.save(figure, folder / file)  # type: ignore[arg-type]
        for name, figure in pictures.items()
        for file in formats.files(name, "figure")
    ]


def _parting(traces: Mapping[str, Trace]) -> str:
    """Return when the two runs of Fig. 4 part, if they do: after the first arrest."""
    step, located = traces["fig4_step"], traces["fig4_chart"]
    log = located.transitions
    arrests = log.t[log.edge == "arrest"]
    times, apart = force_difference(step, located)
    if not arrests.size or not np.abs(apart[times > arrests[0]]).max(initial=0.0) > PARTED:
        return ""
    return f"; they part at the first arrest, {arrests[0]:.1f} s"


def _listing(trace: Trace) -> Figure:
    """Draw the functions of the if-else program of a run that decide and that move z."""
    from plots.style import INK, TEXT_GREY
    from plots.style.fonts import width
    from plots.style.matplotlib import Figure

    functions = lower(trace.model, trace.rig).source.split("\n\n\n")
    texts = [next(each for each in functions if f"def {name}(" in each) for name in USED]
    lines = "\n\n".join(texts).splitlines()
    tall, size = len(lines) + 3, 7.0  # lines, points
    across = width("m", size) / 72 * (max(map(len, lines)) + 3)
    figure = Figure(figsize=(across, LINE * size / 72 * tall))
    figure.suptitle(LISTED, x=0.01, y=1 - 0.6 / tall, ha="left", size=9.0, color=INK)
    look: dict[str, Any] = {"size": size, "family": "monospace", "va": "baseline"}
    # Line by line: in one text the letters of a line would decide its height.
    for number, whole in enumerate(lines):
        code = whole.partition("#")[0]
        for part, ink in ((code, INK), (" " * len(code) + whole[len(code) :], TEXT_GREY)):
            figure.text(0.01, 1 - (3 + number) / tall, part, color=ink, **look)
    return figure


def held_figure(traces: Mapping[str, Trace], force: str) -> Figure:
    """Draw the residual of held outputs in Fig. 3.

    Parameters
    ----------
    traces : mapping of str to Trace
        From `run`; the held charts of Fig. 3 and ``fig3_step`` are used.
    force : str
        The applied force of the runs; only the default one has phases.

    Returns
    -------
    Figure
        Panels a to d.
    """
    from plots import figures

    known = {"ramp": RAMP, "oscillation": OSCILLATION}
    return figures.held_residuals(
        figure_3_lags(traces),
        (PAPERS_FORCE, PAPERS_PLACE),
        phases=known if force == FORCE else {"whole run": (0.0, np.inf)},
        title="Fig. 3, outputs held between ticks, minus if-else evaluated inside the steps",
    )


def claims_text(traces: Mapping[str, Trace], force: str = FORCE, velocity: str = VELOCITY) -> str:
    """Write the table of claims.

    Parameters
    ----------
    traces : mapping of str to Trace
        From `run`.
    force, velocity : str
        The signals of the runs; the claims are assessed only for the default signals.

    Returns
    -------
    str
        Markdown.
    """
    bad, total = (
        sum(counts)
        for counts in zip(
            *(differing_numbers(traces[chart], traces[ifelse]) for chart, ifelse in PAIRS),
            strict=True,
        )
    )
    if (force, velocity) == (FORCE, VELOCITY):
        table = _table(judge(traces))
    else:
        table = [
            "Not assessed: the claims refer to the signals chosen for the reproduction, and these "
            "were changed. Run without --force and --velocity for the table."
        ]
    lugre = ", ".join(
        f"{each.name} = {BENCHMARK.values[each.name]:g} {each.unit}" for each in LUGRE.parameters
    )
    runs = [
        f"| {name} | {trace.model.title} | {_decided_by(trace)} | {len(trace)} "
        f"| {len(trace.transitions)} |"
        for name, trace in traces.items()
    ]
    return "\n".join(
        [
            "# The paper's claims, measured",
            "",
            "K. Roffi, *State Transition Block Diagram of the Generalized Maxwell Slip Friction "
            "Model*, arXiv 2512.03049 (2025).",
            "",
            *table,
            "",
            "## The sign of s(v)",
            "",
            "Eq. (1) of the paper, `dz = sgn(v) C (1 - z/s(v))`, and the signed law of Al-Bender, "
            "Lampaert and Swevers (2005), `dz = C (sgn(v) - z/s(v))`, agree for v > 0. For v < 0 "
            "the printed law is unstable about z = +s (eigenvalue +C/s): once an element slips "
            "backward, its |z| grows until v reverses. The elements then arrest late or not at all "
            "(|z| < s fails), and the later forward break-aways split. Fig. 4's several peaks and "
            "its asymmetry rest on this sign; under the signed law, with the same signal, both are "
            "gone (`fig4_laws.png`).",
            "",
            "## Machines and if-else",
            "",
            "The `transitions` machines and the generated if-else text, under the same driver: "
            f"**{bad} of {total} numbers differ** (t, x, v, z, F, F_i of six pairs of runs, "
            "two of them with outputs held between ticks).",
            "",
            "## Chosen by us, because the paper does not print it",
            "",
            f"- the applied force of Fig. 3: `F_a = {force}` N, t in s",
            f"- the velocity of Fig. 4: `v = {velocity}` m/s",
            "- the text of the guards: our reading of Section II-D (`gms-fsm code` prints them)",
            f"- LuGre: {lugre}, and the column's F_s, F_c, v_s, sigma_2",
            "- the absolute tolerances, from the models' own scales (`gms_fsm.lowering.scales`); "
            "unless stated otherwise, rtol is 1e-6 and switches are located",
            "- the run with weights w_i = 0.25/k_i, in which an element slips (`fig3_slipping`)",
            "",
            "## Runs",
            "",
            "| run | model | decided by | rows | transitions |",
            "|---|---|---|---|---|",
            *runs,
            "",
        ]
    )


def _decided_by(trace: Trace) -> str:
    """Return the engine, and when guards are evaluated."""
    engine, events, step = (trace.settings[name] for name in ("engine", "events", "step"))
    held = f" for {1e3 * step:g} ms" if events == "held" and isinstance(step, float) else ""
    return f"{engine}, {events}{held}"


def _table(claims: Sequence[Claim]) -> list[str]:
    """Return the claims as lines of a Markdown table, with their count above it."""
    rows = [
        "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"
        for cells in ((c.figure, c.text, c.measured, f"**{c.verdict}**") for c in claims)
    ]
    holds = sum(claim.verdict == "holds" for claim in claims)
    differs = sum(claim.verdict.startswith("differs") for claim in claims)
    return [
        f"{len(claims)} claims: {holds} hold, {len(claims) - holds - differs} hold under a "
        f"condition, {differs} differ. What the paper does not print and we chose is listed "
        "below the table.",
        "",
        "| | claim | measured | verdict |",
        "|---|---|---|---|",
        *rows,
    ]
