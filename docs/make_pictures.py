"""Make the pictures in docs/images; run it with ``make gallery``."""

from __future__ import annotations

from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import wrap
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

import plots
from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    Prescribed,
    PulledSlider,
    State,
    Stribeck,
    Sweep,
    Trace,
    Transition,
    coverage,
    prove,
    simulate,
    sweep,
)
from gms_fsm.app.lessons.engine.notebooks import cells_of
from gms_fsm.app.paper import FIG4_END, FORCE, VELOCITY
from gms_fsm.app.paper.experiments import experiments, run_one
from gms_fsm.app.paper.writing import held_figure
from gms_fsm.app.scenario import load_scenario, load_system
from gms_fsm.charts import GMS_ELEMENT, LUGRE
from gms_fsm.charts.broken import BROKEN
from gms_fsm.foundation.files import write_whole
from plots import figures, panels
from plots.style import INK, LINE_GREY, RC, TEXT_GREY, ramp
from plots.style.presets import Preset
from plots.systems.mechanism import schematic_figure

PAGE = Preset("page", 7.2, None, 9.0, 8.0, 1.2, 150.0)  # as wide as the text of a page
FOLDER = Path(__file__).parent / "images"
SCENARIOS = Path(__file__).parents[1] / "gms_fsm" / "scenarios"


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
    draw_systems()
    draw_figures(signed)
    draw_concepts(published)
    draw_howto()
    draw_held()


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
    write_whole(FOLDER / "chart_live.svg", lambda file: file.write(live.encode()))
    # Four elements stick and load, break away one after another, slide, and are caught at once.
    pulled = run("pulled_mass")
    plots.animate(pulled, FOLDER / "film.gif", seconds=9.5, t_start=0.21, t_end=0.346)


def draw_systems() -> None:
    """Write the block diagram and the schematic of a servo."""
    servo = load_system(SCENARIOS / "servo.toml")
    plots.render(plots.block_diagram(servo), FOLDER / "system_blocks.png")
    figures.save(plots.schematic(servo), FOLDER / "system_schematic.png")


def draw_held() -> None:
    """Write the picture of the residual of held outputs, as ``gms-fsm paper`` draws it."""
    chosen = [e for e in experiments() if e.name.startswith(("fig3_step", "fig3_held_chart"))]
    traces = {experiment.name: run_one(experiment) for experiment in chosen}
    figures.save(held_figure(traces, FORCE), FOLDER / "residual_held.png")


def draw_figures(signed: Trace) -> None:
    """Write the pictures of runs: ribbons, cascade, overview, landscape, micro-steps, and so on."""
    figures.save(figures.ribbons_figure(signed), FOLDER / "figure_ribbons.png")
    figures.save(figures.cascade_figure(signed), FOLDER / "figure_cascade.png")
    sliding = (signed.states == "slip").sum(axis=1)
    row = int((sliding == 2).nonzero()[0][-1])  # two of four elements slip
    figures.save(schematic_figure(signed, row), FOLDER / "schematic.png")
    pulled = run("pulled_mass")
    with plots.preset(PAGE):
        figures.save(figures.overview(pulled, title="Pulled mass"), FOLDER / "figure_overview.png")
    landscape = plots.landscape(pulled, 1, t=0.4, title="Pulled mass")
    figures.save(landscape, FOLDER / "figure_landscape.png")
    figures.save(plots.unfold(signed, 32.6, 32.7), FOLDER / "figure_unfold.png")
    # From stick to slip: all four elements break away.
    second = pulled.transitions.t[9]
    row = int(np.flatnonzero(pulled.t == second)[-1])
    phase = plots.phase(pulled, window=(0.262, 0.304), row=row, title="Pulled mass")
    figures.save(phase, FOLDER / "figure_phase.png")
    with rc_context(RC):
        figure = Figure(figsize=(5.4, 3.6), layout="constrained")
        ax = figure.subplots()
        panels.stribeck(ax, run("stribeck_sweep"), log=True)
        ax.set_title("Stribeck curve, and friction in a slow sweep of the velocity")
        ax.legend()
    figures.save(figure, FOLDER / "figure_stribeck.png")


# --------------------------------------------------------------------------- for the concept pages
ELEMENT = GMSParameters.from_shares(
    [1.0], [1e5], C=0.05, stribeck=Stribeck(F_c=1.0, F_s=1.5, v_s=1e-5), v_c=1e-7
)
STROKES = "1e-4*sin(2*pi*t/4)"  # m/s


def draw_concepts(published: Trace) -> None:
    """Write the pictures that only the concept pages use."""
    figures.save(element_figure(), FOLDER / "concept_element.png")
    row = int(np.flatnonzero(published.t <= 25.0)[-1])
    live = plots.live_statechart(published, row=row, elements=[0], values=True)
    write_whole(FOLDER / "concept_guard.svg", lambda file: file.write(live.encode()))
    figures.save(microstep_figure(published), FOLDER / "concept_microstep.png")
    figures.save(crossing_figure(), FOLDER / "concept_crossing.png")


def element_figure() -> Figure:
    """Draw one element moved back and forth: deflection over threshold, force, states."""
    trace = simulate(GMS(ELEMENT, law="signed"), Prescribed(STROKES), 6.0)
    with rc_context(RC):
        figure = Figure(figsize=(7.2, 4.8), layout="constrained")
        velocity, ratio, force, states = figure.subplots(4, 1, height_ratios=(1, 1.6, 1.6, 0.6))
        panels.velocity(velocity, trace)
        panels.ratio(ratio, trace)
        panels.force(force, trace)
        panels.ribbons(states, trace)
        states.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
        named = (
            (velocity, "the slider moves back and forth"),
            (ratio, "deflection over threshold"),
            (force, "force"),
            (states, "state"),
        )
        for letter, (ax, title) in zip("abcd", named, strict=True):
            panels.lettered(ax, letter, title)
            if ax is not states:
                ax.set_xlabel("")
                ax.tick_params(labelbottom=False)
    return figure


def microstep_figure(trace: Trace) -> Figure:
    """Draw the force at the micro-steps of one instant, and the edge that fires at each."""
    log = trace.transitions[:4]
    rows = np.flatnonzero(trace.t == log.t[0])
    with rc_context(RC):
        figure = Figure(figsize=(7.6, 3.2), layout="constrained")
        over_time, by_step = figure.subplots(1, 2, width_ratios=(1, 1.5), sharey=True)
        t = float(log.t[0])
        panels.force(over_time, trace, window=(t - 1.5, t + 1.5))
        panels.lettered(over_time, "a", "over time: one jump of $F$")
        panels.lettered(by_step, "b", f"at $t$ = {t:.4f} s: four firings, five rows")
        by_step.plot(trace.microstep[rows], trace.F[rows], "o--", color=INK, markersize=6)
        for record, number in zip(log, range(1, 5), strict=True):
            by_step.annotate(
                f"element {record.element + 1}\n{record.source} → {record.target}",
                (number, record.F_after),
                (4, 7),
                textcoords="offset points",
                ha="left",
                fontsize=8,
                color=TEXT_GREY,
            )
        by_step.annotate(
            "before",
            (0, log.F_before[0]),
            (0, -14),
            textcoords="offset points",
            ha="center",
            fontsize=8,
        )
        by_step.set(xlabel="micro-step", ylabel="$F$ [N]", xticks=range(5), xlim=(-0.5, 5.3))
        by_step.tick_params(labelleft=True)
        by_step.set_ylim(top=1.08 * trace.F[rows].max())  # room for the names
    return figure


def crossing_figure() -> Figure:
    """Draw a break-away inside a step: detected at the end of the step, and located."""
    step, rig = 0.13, Prescribed(0.2)
    model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    located, once = (
        simulate(model, rig, 2.5, method="rk4", step=step, events=events)
        for events in ("located", "step")
    )
    true = float(located.transitions.t[0])
    found = float(once.transitions.t[0])
    with rc_context(RC):
        figure = Figure(figsize=(7.2, 3.6), layout="constrained")
        ax = figure.subplots()
        looks = (
            (located, INK, "o-", "located"),
            (once, TEXT_GREY, "s--", "guards checked once per step"),
        )
        for trace, colour, look, name in looks:
            keep = (trace.t > true - 1.9 * step) & (trace.t < true + 2.9 * step)
            ax.plot(
                trace.t[keep],
                1e3 * (trace.z[keep, 0] - trace.s[keep, 0]),
                look,
                color=colour,
                label=name,
                markersize=10 if trace is once else 5,
                markerfacecolor="none" if trace is once else colour,
            )
        ax.axhline(0, color=LINE_GREY, linewidth=0.9, zorder=0)
        for time, text, colour, height in (
            (true, "$z \\geq s$ becomes true", INK, 0.97),
            (found, "detected", TEXT_GREY, 0.62),
        ):
            ax.axvline(time, color=LINE_GREY, linestyle=":", linewidth=0.9, zorder=0)
            ax.annotate(
                f"{text}\n$t$ = {time:.2f} s",
                (time, height),
                (-6 if time == true else 6, 0),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                ha="right" if time == true else "left",
                va="top",
                color=colour,
            )
        ax.set(xlabel="$t$ [s]", ylabel="$z - s$ of element 1 [mm]")
        ax.set_title(f"Break-away seen at the end of a step of {step:g} s, and located")
        ax.legend(loc="lower right")
    return figure


# --------------------------------------------------------------------------- for the how-to pages
AGEING = Chart(  # docs/howto/own-chart.md explains it
    "ageing contact",
    inputs=("v", "s"),
    variables=("z", "r"),
    parameters=("k", "C", "v_c", "beta", "tau"),
    states=(
        State("stick", flow={"z": "v", "r": "1"}, entry={"r": "0"}),
        State("slip", flow={"z": "C * (sgn(v) - z / s)", "r": "0"}),
    ),
    transitions=(
        Transition(
            "break_away_forward",
            "stick",
            "slip",
            guard="z >= s * (1 + beta * r / (r + tau)) and v > v_c",
        ),
        Transition(
            "break_away_backward",
            "stick",
            "slip",
            guard="z <= -s * (1 + beta * r / (r + tau)) and v < -v_c",
        ),
        Transition("arrest", "slip", "stick", guard="abs(v) <= v_c"),
    ),
    outputs={"F": "k * z"},
)


def draw_howto() -> None:
    """Write the pictures of the how-to pages."""
    plots.render(plots.statechart(AGEING), FOLDER / "howto_own_chart.png")
    plots.render(plots.statechart(names_of("own-chart.md")["brake"]), FOLDER / "howto_nested.png")
    tried = coverage(run("pulled_mass")).contact()
    plots.render(plots.statechart(tried.chart, counts=tried), FOLDER / "howto_coverage.png")
    report = prove(BROKEN["memoryless"].chart)
    (finding,) = report.refuted
    note = [*wrap(f"{finding.check}: {finding.text}", 42), *wrap(finding.example, 42)]
    marked = [part for part in finding.where if part in report.chart.guards]
    graph = plots.statechart(report.chart, marked=marked, note="\n".join(note))
    plots.render(graph, FOLDER / "howto_refuted.png")
    figures.save(sweep_figure(), FOLDER / "howto_sweep.png")
    bilinear = tutorial_chart()
    plots.render(plots.statechart(bilinear), FOLDER / "howto_bilinear.png")
    figures.save(loops_figure(bilinear), FOLDER / "howto_bilinear_loop.png")
    figures.save(desk_figure(), FOLDER / "howto_desk_experiment.png")
    figures.save(mujoco_figure(), FOLDER / "howto_mujoco.png")
    figures.save(names_of("fit.md")["figure"], FOLDER / "howto_fit.png")
    figures.save(compensation_figure(), FOLDER / "howto_compensation.png")


def tutorial_chart() -> Chart:
    """Return the chart that docs/howto/add-a-model.md adds."""
    page = (Path(__file__).parent / "howto" / "add-a-model.md").read_text(encoding="utf-8")
    file = page.partition("<!-- file: bilinear.py -->\n```python\n")[2].partition("\n```\n")[0]
    names: dict[str, Any] = {"__name__": "bilinear"}
    exec(file, names)
    chart: Chart = names["BILINEAR"]
    return chart


def desk_figure() -> Figure:
    """Return the figure of docs/howto/desk-experiment.md."""
    figure: Figure = names_of("desk-experiment.md")["figure"]
    return figure


def names_of(page: str) -> dict[str, Any]:
    """Run the code of a page in docs/howto, and return its names."""
    text = (Path(__file__).parent / "howto" / page).read_text(encoding="utf-8")
    names: dict[str, Any] = {}
    with TemporaryDirectory() as folder, chdir(folder), redirect_stdout(StringIO()):
        for kind, code in cells_of(text):
            if kind == "code":
                exec(code, names)
    return names


def compensation_figure() -> Figure:
    """Draw a motion of docs/howto/compensation.md, and the errors along it."""
    names = names_of("compensation.md")
    x, t = names["motions"]["inner loops"], names["t"]
    with rc_context(RC):
        figure = Figure(figsize=(7.2, 5.4), layout="constrained")
        top, *axes = figure.subplots(5, 1, sharex=True, height_ratios=(1.2, 1, 1, 1, 1))
        top.plot(t, 1e3 * x, color=INK)
        top.set_ylabel("reference\n[mm]")
        for ax, (name, model) in zip(axes, names["models"].items(), strict=True):
            compensator = None if model is None else names["Compensator"](model, names["tick"])
            error = (names["follow"](x, compensator) - x[1:-1]) / names["count"]
            ax.axhline(0.0, color=LINE_GREY, linewidth=0.6)
            ax.plot(t[1:-1], error, color=INK)
            ax.set(ylabel=f"{name}\n[counts]", ylim=(-21, 21), yticks=(-20, 0, 20))
        axes[-1].set(xlabel="$t$ [s]", xlim=(t[0], t[-1]))
        figure.align_ylabels()
    return figure


def mujoco_figure() -> Figure:
    """Draw the hinge of docs/howto/own-loops-mujoco.md: hysteresis, and a minute under load."""
    names = names_of("own-loops-mujoco.md")
    with rc_context(RC):
        figure = Figure(figsize=(7.2, 3.2), layout="constrained")
        left, right = figure.subplots(1, 2)
        looks = (":", "--", "-")
        for (amplitude, (M, q)), look in zip(names["loops"].items(), looks, strict=True):
            left.plot(1e3 * q, M, look, color=INK, label=f"{amplitude} Nm")
        left.set(
            xlabel="angle [mrad]", ylabel="torque [Nm]", title="Loops below break-away, 1.5 Nm"
        )
        left.legend(loc="upper left", title="amplitude", title_fontsize=8)
        t = 1e-3 * np.arange(1, len(names["held"]) + 1)
        right.plot(t, 1e3 * names["native"], "--", color=TEXT_GREY, label="frictionloss of MuJoCo")
        right.plot(t, 1e3 * names["held"], color=INK, label="four elements")
        right.set(xlabel="$t$ [s]", ylabel="angle [mrad]", title="Angle under a constant 1 Nm")
        right.set_xlim(0, t[-1])
        right.legend(loc="upper left")
    return figure


def loops_figure(bilinear: Chart) -> Figure:
    """Draw one cycle of bilinear hysteresis, with and without hardening."""
    rig = Prescribed("2*pi*4e-5*cos(2*pi*t)")
    with rc_context(RC):
        figure = Figure(figsize=(5.4, 3.6), layout="constrained")
        ax = figure.subplots()
        for H, colour, look in ((1e4, INK, "-"), (0.0, TEXT_GREY, "--")):
            model = ChartModel(bilinear, {"k": 1e5, "H": H, "F_y": 1.0})
            trace = simulate(model, rig, 1.25)
            cycle = trace.t >= 0.25  # from one end of the stroke to the same
            label = f"$H$ = {1e-3 * H:g} kN/m"
            ax.plot(1e6 * trace.x[cycle], trace.F[cycle], look, color=colour, label=label)
        ax.set(xlabel="$x$ [µm]", ylabel="$F$ [N]")
        ax.set_title("Bilinear hysteresis, a cycle of ±40 µm: hardening tilts the loop")
        ax.legend(loc="upper left")
    return figure


def sweep_figure() -> Figure:
    """Draw the number of arrests of a pulled mass in 0.6 s over speed and v_s."""
    parameters = GMSParameters.from_shares(
        [0.25] * 4,
        [4e5, 3e5, 2e5, 1e5],
        C=100.0,
        stribeck=Stribeck(1.0, 1.5, 5e-4),
        v_c=1e-6,
        sigma=[25.0] * 4,
    )
    speed, v_s = np.meshgrid(np.linspace(5e-4, 5e-3, 40), np.geomspace(5e-6, 1e-3, 40))
    result: Sweep = sweep(
        GMS(parameters, law="signed"),
        PulledSlider(1.0, 1e4, 1e-3),
        0.6,
        {"speed": speed.ravel(), "v_s": v_s.ravel()},
    )
    arrests = result.transitions["run"][result.transitions["edge"] == result.edges.index("arrest")]
    counts = np.bincount(arrests, minlength=len(result)).reshape(speed.shape)
    with rc_context(RC):
        figure = Figure(figsize=(6.0, 3.8), layout="constrained")
        ax = figure.subplots()
        image = ax.pcolormesh(
            1e3 * speed, 1e3 * v_s, counts, cmap=ListedColormap(ramp("heat", 256)), rasterized=True
        )
        ax.set(yscale="log", xlabel="pulling speed [mm/s]", ylabel="$v_s$ [mm/s]")
        ax.set_title(f"Pulled mass, signed law: arrests in 0.6 s, in each of {len(result):,} runs")
        figure.colorbar(image, label="arrests")
    return figure


def run(name: str) -> Trace:
    """Run one of the scenario files."""
    loaded = load_scenario(SCENARIOS / f"{name}.toml")
    return simulate(loaded.model, loaded.rig, **loaded.arguments)


if __name__ == "__main__":
    main()
