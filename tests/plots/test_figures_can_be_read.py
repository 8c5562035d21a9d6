"""Every figure takes every kind of run, has its texts in room, and type as large as promised.

In each preset a figure has its width, and no text is clipped, too small, or covers another. Every
colour is a role that the figure may use. The same run gives the same file, without pyplot.
"""

from __future__ import annotations

import functools
import itertools
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

import matplotlib
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import plots
from gms_fsm import (
    GMS,
    Chart,
    ChartModel,
    GMSParameters,
    LuGre,
    Prescribed,
    PulledSlider,
    SimulationError,
    State,
    Stribeck,
    Trace,
    Transition,
    measure_phenomena,
    prove,
    simulate,
)
from plots import figures, panels
from plots.style import ROLES, presets, ramp
from plots.style.presets import PRESETS, Preset
from plots.systems.mechanism import schematic_figure
from tests.helpers import (
    FIG4_SINE,
    ROOT,
    bank,
    matrix,
    non_drifting,
    open_loop,
    pulled_mass,
    stick_slip,
)
from tests.identification.fits_made import with_profiles, with_table
from tests.plots.printed import problems

pytestmark = pytest.mark.slow
LOOP = Prescribed(FIG4_SINE)


# --------------------------------------------------------------------------- runs
def broken_off() -> Trace:
    """A run that could not continue: its last row may have no forces."""
    rig = Prescribed(lambda t: 0.1 if t < 1.0 else float("nan"))
    with pytest.raises(SimulationError) as error:
        simulate(stick_slip("signed"), rig, 2.0)
    return error.value.trace


def geometric(n: int) -> Trace:
    """A run of a bank whose elements have very different stiffness."""
    shares = np.linspace(2.0, 1.0, n)
    parameters = GMSParameters.from_shares(
        shares / shares.sum(),
        np.geomspace(60.0, 6.0, n),
        C=2.0,
        stribeck=Stribeck(1.0, 1.5, 0.05),
        v_c=1e-6,
        sigma=np.full(n, 0.01),
        sigma_2=0.4,
    )
    return simulate(GMS(parameters, law="signed"), Prescribed("0.2*sin(2*pi*t/4)"), 9.0)


def five() -> Trace:
    """States with long names."""
    names = ["adhere", "creep_slowly", "slide_forward", "slide_backward", "lift_off_the_surface"]
    chart = Chart(
        "Five states",
        inputs=("v",),
        variables=("z",),
        states=tuple(State(name, flow={"z": "1"}) for name in names),
        transitions=tuple(
            Transition(f"enter_{target}", source, target, guard="z > 1", actions={"z": "0"})
            for source, target in itertools.pairwise([*names, names[0]])
        ),
        outputs={"F": "v"},
    )
    return simulate(ChartModel(chart, {}, n=2), LOOP, 7.5)


def lugre() -> Trace:
    model = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
    return simulate(model, non_drifting("signed")[1], 30.0)


KINDS: dict[str, Callable[[], Trace]] = {
    "published": lambda: simulate(stick_slip("published"), LOOP, 100.0),
    "pulled mass": lambda: simulate(*pulled_mass(), 60.0),
    "LuGre": lugre,
    "no transition": lambda: simulate(stick_slip("signed"), open_loop(), 0.5),
    "standstill": lambda: simulate(stick_slip("signed"), Prescribed("0"), 1.0),
    "broken off": broken_off,
    # It cannot be resampled: its signal was a Python function.
    "a function": lambda: simulate(
        stick_slip("signed"), Prescribed(lambda t: 0.2 * np.sin(2 * np.pi * t / 20)), 20.0
    ),
    "a few rows": lambda: simulate(stick_slip("signed"), open_loop(), 20.0, t_eval=[0.0, 20.0]),
}
RUNS: dict[str, Callable[[], Trace]] = KINDS | {
    "signed": lambda: simulate(stick_slip("signed"), LOOP, 100.0),
    # Only its last cycles are shown, and the titles say so.
    "cycles of 12": lambda: simulate(bank(12), Prescribed("0.9*sin(2*pi*t/4)"), 30.0),
    "five states": five,
    # Break away one by one within milliseconds, late in a long run.
    "16": lambda: simulate(bank(16), PulledSlider(mass=1.0, stiffness=2.0, speed=0.1), 60.0),
    **{f"bank of {n}": functools.partial(geometric, n) for n in (1, 4, 12, 20)},
}


@functools.cache
def run(name: str) -> Trace:
    return RUNS[name]()


# --------------------------------------------------------------------------- figures
def fig3(trace: Trace) -> Figure:
    phases = (("rising", 2.0), ("falling", 4.0), ("oscillating", np.inf))
    title = "Fig. 3 with weights 0.25/k (our addition): element 1 slips, and still no drift"
    return figures.figure_3(trace, trace, lugre(), np.sin(trace.t), title=title, phases=phases)


def unfolded(trace: Trace) -> Figure:
    first = float(trace.transitions.t[0])
    return figures.unfold(trace, first - 1e-9, first + 0.05)


FIGURES: dict[str, Callable[[Trace], Figure]] = {
    "overview": lambda trace: figures.overview(trace, title="Pulled mass"),
    "ribbons": figures.ribbons_figure,
    "cascade": figures.cascade_figure,
    "landscape": lambda trace: figures.landscape(trace, trace.n - 1, row=len(trace) // 2),
    "phase": figures.phase,
    "schematic": schematic_figure,
    "figure 4": lambda trace: figures.figure_4(trace, trace, run("LuGre")),
    "figure 3": fig3,
    "laws": lambda trace: figures.compare_laws(
        {"published law, eq. (1) as printed": trace, "signed law (Al-Bender et al. 2005)": trace}
    ),
    "residuals": lambda trace: figures.residuals(
        {"Fig. 4 run (stick-slip, published law)": (trace.t, trace.F), "other": (trace.t, trace.v)},
        "Guards evaluated once per step (max step 1e-3 s, rtol 1e-4) and located switches",
    ),
}


@functools.cache
def table() -> Any:
    return measure_phenomena(["gms-signed", "lugre", "dahl"], phenomena=["hysteresis", "lag"])


def lags() -> list[Any]:
    found = []
    for period in (2e-2, 5e-3, 1e-3):
        t = np.arange(0.0, 6.0, period)
        force = 0.05 * period * np.sin(3 * t)
        found.append(
            SimpleNamespace(period=period, t=t, force=force, before=0.5 * force, place=1e-3 * force)
        )
    return found


def ten_instants() -> Figure:
    times = np.unique(run("16").transitions.t)
    return figures.unfold(run("16"), float(times[0]), float(times[9]))


OTHERS: dict[str, Callable[[], Figure]] = {
    "overview of the last cycles of 12": lambda: figures.overview(run("cycles of 12")),
    "unfold of five states": lambda: figures.unfold(run("five states"), 0.0, 6.5),
    "unfold of ten instants": ten_instants,
    "landscape with pins": lambda: figures.landscape(
        run("published"), 0, t=30.0, checks=prove(run("published").model.chart)
    ),
    "held": lambda: figures.held_residuals(
        lags(),
        (1e-3, 1e-6),
        phases={"ramp": (0.0, 2.0), "oscillation": (2.0, 6.0)},
        title="Fig. 3, outputs held between ticks, minus if-else evaluated inside the steps",
    ),
    "fit of twelve parameters": lambda: figures.fit_figure(with_table(12)),
    "profiles of nine parameters": lambda: figures.profiles_figure(with_profiles(9)),
    "phenomenon": lambda: figures.phenomenon_figure(table(), table().phenomena[0].name),
    "matrix": lambda: figures.phenomena_matrix(table(), title="Models and phenomena"),
}
MADE = {name: functools.partial(lambda make: make(run("signed")), FIGURES[name])
        for name in FIGURES if name != "schematic"} | OTHERS  # fmt: skip
# The largest type for those with most text; the narrowest page for all others that have panels or
# elements of their own.
LARGE = ("overview", "figure 3", "matrix")
SIMILAR = ("cascade", "residuals", "landscape", "unfold of ten instants")
SIMILAR += ("overview of the last cycles of 12", "laws", "profiles of nine parameters", "figure 4")
PRINTED = [(name, "slide" if name in LARGE else "ieee1") for name in MADE if name not in SIMILAR]
EVERY = [
    (name, preset)
    for name in MADE
    for preset in PRESETS
    if preset != "screen" and (" of " not in name or preset in ("ieee1", "slide"))
]


@pytest.mark.every(4)
@pytest.mark.parametrize(("name", "preset"), matrix(EVERY, PRINTED))
def test_texts_can_be_read_in_print(name: str, preset: str) -> None:
    with plots.preset(preset) as sizes:
        figure = MADE[name]()
    assert figure.get_figwidth() == sizes.width
    assert problems(figure, sizes.smallest) == []


@functools.cache
def on_screen(name: str, n: int) -> Figure:
    make = unfolded if name == "unfold" else FIGURES[name]
    return make(run(f"bank of {n}"))


SIZES = [(name, 20) for name in ("ribbons", "unfold")]
MANY = {*FIGURES, "unfold"} - {"schematic"}
MORE = [*itertools.product(sorted(MANY), (4, 12, 20)), ("cascade", 1)]


@pytest.mark.every(2)
@pytest.mark.parametrize(("shown", "n"), matrix(MORE, SIZES))
def test_texts_have_room_for_many_elements_and_colours_are_roles(shown: str, n: int) -> None:
    figure = on_screen(shown, n)
    assert problems(figure, 0.0) == []
    wanted = {"#000000"}  # axes, whose colour is that of text
    for name, role in ROLES.items():
        wanted |= {*role.light, *(each for count in (n, n + 1, 256) for each in ramp(name, count))}
    found = colours_of(figure)
    assert found - wanted == set()
    assert found - {"#000000", "#FFFFFF"}
    rows = [ax for ax in figure.findobj(Axes) if "E1" in labels_of(ax)]
    assert rows or shown not in ("overview", "ribbons", "cascade", "laws", "unfold")
    for ax in rows:  # no label of an element is taller than its row
        assert len(labels_of(ax)) == n
        pixels = ax.transData.transform([(0, 1), (0, 2)])[:, 1]  # type: ignore[attr-defined]
        for text in ax.get_yticklabels():  # type: ignore[attr-defined]
            assert text.get_window_extent().height <= abs(float(pixels[1] - pixels[0]))


def labels_of(ax: Any) -> list[str]:
    return [each.get_text() for each in ax.get_yticklabels()]


def colours_of(figure: Figure) -> set[str]:
    """Return the opaque colours of lines, fills and texts."""
    found: set[str] = set()
    for artist in figure.findobj():
        for getter in ("get_color", "get_facecolor", "get_edgecolor"):
            shown = artist.get_visible() and not isinstance(artist, QuadMesh)
            if not shown or not hasattr(artist, getter):
                continue
            values = getattr(artist, getter)()
            for value in [values] if isinstance(values, str) else np.atleast_2d(values):
                rgba = value if isinstance(value, str) else tuple(value)
                if rgba != "none" and not (len(rgba) == 4 and not rgba[3]):
                    found.add(to_hex(rgba).upper())
    return found


def test_every_figure_builder_is_tried() -> None:
    builders = {name for name in figures.__all__ if name[0].islower() and name != "save"}
    made = [figures.ribbons_figure, figures.cascade_figure, figures.phase]
    used = [each.__code__.co_names for each in (*FIGURES.values(), *OTHERS.values(), unfolded)]
    tried = {name for names in used for name in names} | {each.__name__ for each in made}
    assert builders - tried == set()


# --------------------------------------------------------------------------- runs of every kind
PAIRS = list(itertools.product(KINDS, FIGURES))
SOME = [*PAIRS[9::13], ("broken off", "overview")]


@pytest.mark.every(3)
@pytest.mark.parametrize(("name", "kind"), matrix(PAIRS, SOME))
def test_every_figure_takes_every_run(name: str, kind: str, tmp_path: Path) -> None:
    trace = run(name)
    if name == "a function":
        trace = Trace.load(trace.save(tmp_path / "a.npz"))
    before = dict(matplotlib.rcParams)
    figure = FIGURES[kind](trace)
    path = figures.save(figure, tmp_path / "picture.svg")
    assert dict(matplotlib.rcParams) == before
    assert 5_000 < path.stat().st_size < 1_000_000
    labels = [label for ax in figure.axes for label in (ax.get_xlabel(), ax.get_ylabel())]
    bar = "elements in slip"
    assert all("[" in label for label in labels if label and label != bar), labels


@pytest.mark.matrix
def test_the_same_run_gives_the_same_file_and_fonts_of_a_pdf_are_truetype(tmp_path: Path) -> None:
    texts = []
    for name in "ab":
        figure = figures.phase(run("signed"))
        paths = [figures.save(figure, tmp_path / f"{name}.{kind}") for kind in ("svg", "pdf")]
        texts.append([path.read_bytes() for path in paths])
    assert texts[0] == texts[1]
    assert b"/FontFile2" in texts[0][1]
    assert b"/Type3" not in texts[0][1]


def test_pyplot_is_never_imported(tmp_path: Path) -> None:
    code = """
import sys
from gms_fsm import GMS, GMSParameters, Prescribed, simulate
from plots import figures, panels
from plots.systems.mechanism import schematic_figure
run = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0)
for number, make in enumerate((figures.overview, schematic_figure)):
    figures.save(make(run), f"{sys.argv[1]}/{number}.png")
print("matplotlib.pyplot" in sys.modules)
"""
    command = [sys.executable, "-c", code, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "False"


# --------------------------------------------------------------------------- what is shown
def test_ribbons_figure_has_the_columns_of_the_run() -> None:
    def titles(trace: Trace, around: float | None = None) -> list[str]:
        figure = figures.ribbons_figure(trace, around)
        return [ax.get_title(loc="left") for ax in figure.axes if ax.get_title(loc="left")]

    found = titles(run("signed"))
    assert len(found) == 8
    assert "margin to the threshold" in found
    assert len(titles(run("LuGre"))) == 6
    assert len(titles(run("LuGre"), around=2.0)) == 8


@pytest.mark.matrix
def test_window_and_elements_reach_every_panel() -> None:
    signed = run("published")
    figure = figures.ribbons_figure(signed, 20.14, window=(10.0, 30.0), elements=[0, 3])
    axes = {ax.get_title(): ax for ax in figure.axes}
    for letter in "abcd":
        assert axes[letter].get_xlim() == (10.0, 30.0)
    for letter in "dh":
        assert labels_of(axes[letter]) == ["E1", "E4"]
    portraits = figures.ribbons_figure(run("LuGre"), window=(10.0, 30.0))
    assert portraits.axes[0].get_xlim() == (10.0, 30.0)
    figure = figures.overview(signed, window=(10.0, 30.0), elements=[1])
    assert figure.axes[0].get_xlim() == (10.0, 30.0)
    figure = figures.figure_4(signed, signed, signed)
    force = figure.axes[3]  # its axis ends below the inset
    assert max(force.get_yticks()) <= 1.05 * np.nanmax(signed.F)
    assert force.child_axes
    figure = figures.ribbons_figure(signed, window=(3.0, 7.0))  # the zoom is inside the window
    (margins,) = (ax for ax in figure.axes if ax.get_title() == "f")
    low, high = margins.get_xlim()
    assert 3.0 <= low < high <= 7.0
    crowded = simulate(stick_slip("signed"), Prescribed("sin(2*pi*t/5)"), 200.0)
    figure = figures.ribbons_figure(crowded)  # a crowded run shows its last cycles
    begin, end = figure.axes[0].get_xlim()
    assert end == 200.0
    assert 12.0 < end - begin < 18.0
    assert figure.get_suptitle().endswith(f"; last {end - begin:.3g} s of 200 s")


def test_panels_of_an_overview_share_their_time_span() -> None:
    trace = run("pulled mass")
    *time, loop, portrait, _ = figures.overview(trace).axes
    ((begin, end),) = {ax.get_xlim() for ax in time}
    assert 20.0 < begin < end == 60.0
    x = trace.sample([begin, end]).x - trace.x[0]
    shown = np.vstack(loop.collections[0].get_segments())[:, 0]
    assert [shown[0], shown[-1]] == pytest.approx(x, rel=1e-6)
    # Both panels are as dark as many elements slip.
    counts = [set(ax.collections[0].get_array()) for ax in (loop, portrait)]
    assert counts[0] == counts[1] == {0, 1, 2, 3, 4}
    F = np.vstack(portrait.collections[0].get_segments())[:, 1]
    assert F.min() > 0.5  # the run begins at 0


def test_states_are_named_once_for_all_ribbons() -> None:
    """Names in the ribbons would be missing where they do not fit."""
    trace = run("pulled mass")
    overview, laws = figures.overview(trace), figures.compare_laws({"pulled mass": trace})
    names = [
        [text.get_text() for legend in legends if legend for text in legend.get_texts()]
        for legends in ([ax.get_legend() for ax in overview.axes], laws.legends)
    ]
    assert all(said.count("stick") == said.count("slip") == 1 for said in names)
    assert not any(text.get_text() in ("stick", "slip") for ax in laws.axes for text in ax.texts)


def test_what_a_picture_cuts_off_or_covers_is_said_in_it() -> None:
    signed = run("signed")
    force = np.zeros(len(signed))
    cut = figures.figure_3(
        signed, signed, lugre(), force, title="", limit=0.1, reason="because of the damper"
    )
    assert f"peak {signed.F.max():.2f} N" in cut.axes[1].texts[-1].get_text()
    assert cut.axes[1].texts[-1].get_text().endswith("because of the damper")
    alike = simulate(stick_slip("signed"), Prescribed("0.15*sin(2*pi*t/25)"), 30.0)
    laws = figures.compare_laws({"alike": alike, "apart": run("pulled mass")})
    said = [[text.get_text() for text in ax.texts] for ax in laws.axes[:2]]
    assert "$z_{1}$ to $z_{4}$ coincide" in said[0]
    assert not any("coincide" in text for text in said[1])
    apart = figures.residuals({"": (np.arange(2000.0), np.ones(2000))}, "")
    names = [text.get_text() for text in apart.legends[0].get_texts()]
    assert names == ["lowest to highest in each 1/500 of the time", "highest in it"]


def test_a_measurement_is_shown_with_the_model() -> None:
    part = panels.shown(run("signed"))
    measured = figures.Measured(part.t, part.x, part.F + 0.1)
    model, data = figures.overview(run("signed"), measured).axes[1].lines[:2]
    assert [model.get_label(), data.get_label()] == ["model", "measured"]
    np.testing.assert_array_equal(data.get_ydata(), measured.F)


# --------------------------------------------------------------------------- presets
@pytest.mark.matrix
def test_presets_have_the_sizes_of_the_journal_or_ones_own_and_end_with_their_context() -> None:
    sizes = {name: (each.width, each.smallest) for name, each in PRESETS.items()}
    assert sizes["ieee1"] == (3.5, 7.0)  # 88.9 mm
    assert sizes["ieee2"] == (7.16, 7.0)  # 181.9 mm
    for name, width in {"screen": 1.6, "ieee1": 1.2}.items():  # also where a look is a constant
        with plots.preset(name):
            loop, portrait = figures.overview(run("signed")).axes[3:5]
        widths = [ax.collections[0].get_linewidth()[0] for ax in (loop, portrait)]
        assert widths == pytest.approx([width, width], abs=1e-3)
    with plots.preset(Preset("thesis", 5.5, None, 10.0, 8.0, 1.0, 200.0)):
        assert figures.cascade_figure(run("signed")).get_figwidth() == 5.5
    with pytest.raises(ZeroDivisionError), plots.preset("poster"):
        raise ZeroDivisionError
    assert presets.current() is PRESETS["screen"]


@pytest.mark.matrix
def test_what_is_low_or_has_many_elements_is_drawn_otherwise() -> None:
    trace = simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 20.0)
    with presets.preset(Preset("low", None, 2.2, 9.0, 7.0, 1.0, 100.0)):
        left, right = figures.cascade_figure(trace).axes[2:4]
        assert left.get_xlabel() == right.get_xlabel() != ""
        figures.landscape(trace, 0)
    many = simulate(bank(8), Prescribed("0.3"), 2.0)
    assert len(figures.overview(many).axes) > len(figures.overview(trace).axes)
    assert any(
        isinstance(each, QuadMesh) for each in figures.compare_laws({"": many}).axes[0].collections
    )
    plain = Chart("own", states=(State("only"),), outputs={"F": "v"})
    assert figures.compare_laws({"": simulate(ChartModel(plain, {}), Prescribed("0.3"), 2.0)})


def test_tables_of_phenomena_without_curves_and_with_narrow_cells() -> None:
    found = table()
    without = [
        replace(cell, measured=replace(cell.measured, verdict="does not apply", curves=()))
        for cell in found.cells
    ]
    assert figures.phenomenon_figure(replace(found, cells=tuple(without)), "lag") is None
    first = next(i for i, cell in enumerate(found.cells) if cell.phenomenon.name == "lag")
    cells = (*found.cells[:first], without[first], *found.cells[first + 1 :])
    with presets.preset("ieee1"):
        wide = replace(found, cells=cells, phenomena=found.phenomena * 3)
        assert figures.phenomena_matrix(wide).get_figwidth() == pytest.approx(3.5)
    figure = figures.phenomenon_figure(found, "lag")
    assert figure is not None
    assert len(figure.legends) == 1
    assert "width of the loop at 25 rad/s (shows it if > 0.5 %" in figure.get_supxlabel()


@pytest.mark.matrix
def test_what_slides_away_ends_on_the_scale_of_the_others() -> None:
    names = ["gms-signed", "maxwell-slip", "rate-state-slip"]
    figure = figures.phenomenon_figure(measure_phenomena(names, ["memory"]), "memory")
    assert figure is not None
    limits = {ax.get_xlim() for ax in figure.axes}
    assert len(limits) == 1
    assert max(limits)[1] < 100  # µm
    assert 0 < figure.axes[2].lines[0].get_xdata().max() < 100  # type: ignore[union-attr]
