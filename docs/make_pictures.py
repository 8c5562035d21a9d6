"""Make the pictures kept under docs/images; run it with ``make gallery``."""

from __future__ import annotations

from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

import plots
from gms_fsm import GMS, GMSParameters, Prescribed, Trace, simulate
from gms_fsm.charts import GMS_ELEMENT, LUGRE
from gms_fsm.files import written_whole
from gms_fsm.paper import FIG4_END, VELOCITY
from gms_fsm.scenario import load_scenario
from plots import figures, panels
from plots.schematic import schematic_figure
from plots.style import RC

FOLDER = Path(__file__).parent / "images"
SCENARIOS = Path(__file__).parents[1] / "scenarios"


def main() -> None:
    """Write every picture."""
    runs = {
        title: simulate(
            GMS(GMSParameters.paper("stick-slip"), law=law), Prescribed(VELOCITY), FIG4_END
        )
        for title, law in (
            ("published law, eq. (1) as printed", "published"),
            ("signed law (Al-Bender et al. 2005)", "signed"),
        )
    }
    figures.save(figures.compare_laws(runs), FOLDER / "fig4_laws.png")
    published, signed = runs.values()
    draw_charts(published, signed)
    draw_figures(signed)


def draw_charts(published: Trace, signed: Trace) -> None:
    """Write the charts: element, bank, counts, LuGre, live states, block diagram, film."""
    gms = GMS_ELEMENT["signed"]
    pictures = {
        "chart_element": plots.statechart(gms),
        "chart_math_dark": plots.statechart(gms, notation="math", theme="dark", direction="LR"),
        "chart_bank": plots.statechart(gms, 4),
        "chart_counts": plots.statechart(published.model.chart, 4, counts=published),
        "chart_lugre": plots.statechart(LUGRE),
        "block_diagram": plots.block_diagram(4),
    }
    for name, graph in pictures.items():
        plots.render(graph, FOLDER / f"{name}.png")
    first_alone = int((signed.transitions.element == 3).nonzero()[0][2])  # E4, backward
    row = int((signed.t == signed.transitions.t[first_alone]).nonzero()[0][-1])
    live = plots.live_statechart(signed, row=row, elements=4, values=True)
    written_whole(FOLDER / "chart_live.svg", lambda file: file.write(live.encode()))
    plots.animate(signed, FOLDER / "film.gif", elements=[0], frames=50, t_end=50.0, fps=10)


def draw_figures(signed: Trace) -> None:
    """Write the pictures of runs: ribbons, cascade, overview, Stribeck curve, schematic."""
    figures.save(figures.ribbons_figure(signed), FOLDER / "figure_ribbons.png")
    figures.save(figures.cascade_figure(signed), FOLDER / "figure_cascade.png")
    sliding = (signed.states == "slip").sum(axis=1)
    row = int((sliding == 2).nonzero()[0][-1])  # two of four elements slip
    figures.save(schematic_figure(signed, row), FOLDER / "schematic.png")
    pulled = run("pulled_mass")
    figures.save(figures.overview(pulled, title="Pulled mass"), FOLDER / "figure_overview.png")
    with rc_context(RC):
        figure = Figure(figsize=(5.4, 3.6), layout="constrained")
        ax = figure.subplots()
        panels.stribeck(ax, run("stribeck_sweep"))
        ax.legend()
    figures.save(figure, FOLDER / "figure_stribeck.png")


def run(name: str) -> Trace:
    """Run one of the scenarios."""
    loaded = load_scenario(SCENARIOS / f"{name}.toml")
    return simulate(loaded.model, loaded.rig, **loaded.arguments)


if __name__ == "__main__":
    main()
