"""In every preset each figure has its width, type as large as promised, and no overlaps."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

import plots
from gms_fsm import (
    Chart,
    ChartModel,
    Prescribed,
    PulledSlider,
    State,
    Trace,
    Transition,
    measure_phenomena,
    prove,
    simulate,
)
from gms_fsm.charts.registry import entry
from gms_fsm.errors import ParameterError
from gms_fsm.systems.models import demonstration
from plots import figures, presets
from plots.presets import PRESETS, Preset
from tests.helpers import bank, matrix, stick_slip
from tests.identification.fits_made import small, with_profiles, with_table
from tests.plots.printed import problems

PRINT = [name for name in PRESETS if name != "screen"]
LOOP = Prescribed("0.15*sin(2*pi*t/25)")


@functools.cache
def run(law: str) -> Trace:
    return simulate(stick_slip(law), LOOP, 60.0)


@functools.cache
def many() -> Trace:
    return simulate(bank(12), LOOP, 60.0)


@functools.cache
def lugre() -> Trace:
    model: ChartModel = demonstration(entry("lugre"))
    return simulate(model, LOOP, 60.0)


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


def difference() -> tuple[Any, Any]:
    t = np.linspace(0.0, 60.0, 5000)
    return t, 1e-3 * np.sin(t)


@functools.cache
def sixteen() -> Trace:
    """Breaks away one by one within milliseconds, late in a long run."""
    return simulate(bank(16), PulledSlider(mass=1.0, stiffness=2.0, speed=0.1), 60.0)


@functools.cache
def cycles() -> Trace:
    """Only its last cycles are shown, and the titles say so."""
    return simulate(bank(12), Prescribed("0.9*sin(2*pi*t/4)"), 30.0)


@functools.cache
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


def columns() -> tuple[float, float]:
    """Return a window with ten instants."""
    times = np.unique(sixteen().transitions.t)
    return float(times[0]), float(times[9])


FIGURES: dict[str, Callable[[], Any]] = {
    "overview": lambda: figures.overview(run("signed"), title="Pulled mass"),
    "overview of 12": lambda: figures.overview(many()),
    "overview of the last cycles of 12": lambda: figures.overview(cycles()),
    "overview of five states": lambda: figures.overview(five()),
    "unfold of five states": lambda: figures.unfold(five(), 0.0, 6.5),
    "overview of lugre": lambda: figures.overview(lugre()),
    "ribbons": lambda: figures.ribbons_figure(run("signed")),
    "ribbons of 12": lambda: figures.ribbons_figure(many()),
    "cascade": lambda: figures.cascade_figure(run("signed")),
    "landscape": lambda: figures.landscape(
        run("published"), 0, t=30.0, checks=prove(run("published").model.chart)
    ),
    "phase": lambda: figures.phase(run("signed")),
    "unfold": lambda: figures.unfold(run("signed"), 26.0, 34.0),
    "figure 3": lambda: figures.figure_3(
        run("signed"),
        run("published"),
        lugre(),
        np.sin(run("signed").t),
        title="Fig. 3 with weights 0.25/k (our addition): element 1 slips, and still no drift",
    ),
    "figure 4": lambda: figures.figure_4(run("signed"), run("published"), lugre()),
    "laws": lambda: figures.compare_laws(
        {
            "published law, eq. (1) as printed": run("published"),
            "signed law (Al-Bender et al. 2005)": run("signed"),
        }
    ),
    "residuals": lambda: figures.residuals(
        {"Fig. 4 run (stick-slip, published law)": difference(), "Fig. 3 run": difference()},
        "Guards evaluated once per step (max step 1e-3 s, rtol 1e-4) and located switches",
    ),
    "held": lambda: figures.held_residuals(
        lags(),
        (1e-3, 1e-6),
        phases={"ramp": (0.0, 2.0), "oscillation": (2.0, 6.0)},
        title="Fig. 3, outputs held between ticks, minus if-else evaluated inside the steps",
    ),
    "fit": lambda: figures.fit_figure(small()),
    "fit of twelve parameters": lambda: figures.fit_figure(with_table(12)),
    "profiles": lambda: figures.profiles_figure(with_profiles(5)),
    "profiles of nine parameters": lambda: figures.profiles_figure(with_profiles(9)),
    "phenomenon": lambda: figures.phenomenon_figure(table(), table().phenomena[0].name),
    "matrix": lambda: figures.phenomena_matrix(table(), title="Models and phenomena"),
}


VARIANTS = {name for name in FIGURES if " of " in name}  # of a figure that is tried itself
SCARCE = {"ieee1", "slide"}  # the narrowest page, and the largest type for its width
LARGE = {"overview", "landscape", "figure 3", "fit", "matrix"}  # most text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "preset"),
    matrix(
        [(n, p) for n in FIGURES for p in PRINT if n not in VARIANTS or p in SCARCE],
        [(n, p) for n in FIGURES for p in SCARCE if p == "ieee1" or n in LARGE],
    ),
)
def test_texts_can_be_read(name: str, preset: str) -> None:
    with plots.preset(preset) as sizes:
        figure = FIGURES[name]()
    assert figure.get_figwidth() == sizes.width
    assert problems(figure, sizes.smallest) == []


def test_times_between_many_instants_stay_apart() -> None:
    for preset in ("ieee1", "ieee2", "slide"):
        with plots.preset(preset) as sizes:
            figure = figures.unfold(sixteen(), *columns())
        assert problems(figure, sizes.smallest) == []


def test_lines_have_the_width_of_the_preset() -> None:
    """Also those whose look is a constant, whenever the package was imported."""

    def widths(preset: str) -> list[float]:
        with plots.preset(preset):
            loop, portrait = figures.overview(run("signed")).axes[3:5]
        return [loop.lines[0].get_linewidth(), portrait.collections[0].get_linewidth()[0]]

    assert widths("screen") == pytest.approx([1.6, 1.6])
    assert widths("ieee1") == pytest.approx([1.2, 1.2])
    assert widths("poster") == pytest.approx([4.267, 4.267], abs=1e-3)


def test_every_figure_builder_is_tried() -> None:
    builders = {name for name in figures.__all__ if name[0].islower() and name != "save"}
    named = " ".join(name for each in FIGURES.values() for name in each.__code__.co_names)
    assert {name for name in builders if name not in named.split()} == set()


def test_sizes_are_those_of_the_journal() -> None:
    sizes = {name: (each.width, each.smallest) for name, each in PRESETS.items()}
    assert sizes["ieee1"] == (3.5, 7.0)  # 88.9 mm
    assert sizes["ieee2"] == (7.16, 7.0)  # 181.9 mm
    assert sizes["slide"] == (13.33, 18.0)
    assert sizes["poster"][1] == 24.0


@pytest.mark.slow
def test_a_column_stacks_its_panels() -> None:
    with plots.preset("ieee1"):
        column = figures.overview(run("signed"))
    column.draw_without_rendering()
    lefts = {round(ax.get_position().x0, 2) for ax in column.axes[:5]}
    screen = figures.overview(run("signed"))
    screen.draw_without_rendering()
    assert len(column.axes) == len(screen.axes)
    assert max(lefts) < 0.3


def test_the_preset_ends_with_its_context() -> None:
    with pytest.raises(ZeroDivisionError), plots.preset("poster"):
        raise ZeroDivisionError
    assert presets.current() is PRESETS["screen"]


def test_own_sizes() -> None:
    own = Preset("thesis", 5.5, None, 10.0, 8.0, 1.0, 200.0)
    with plots.preset(own):
        assert figures.overview(run("signed")).get_figwidth() == 5.5


def test_wrong_presets() -> None:
    names = "'screen', 'ieee1', 'ieee2', 'slide', 'poster'"
    with (
        pytest.raises(ParameterError, match=f"preset is 'a4'; it must be one of {names}"),
        plots.preset("a4"),
    ):
        pass
    with pytest.raises(ParameterError, match="width is -1"):
        Preset("x", -1.0, None, 9.0, 7.0, 1.0, 100.0)
    with pytest.raises(ParameterError, match="smallest is 10"):
        Preset("x", None, None, 9.0, 10.0, 1.0, 100.0)


def test_the_command_line_takes_presets(gms_fsm: Any) -> None:
    pytest.importorskip("matplotlib")
    simulate(stick_slip("signed"), PulledSlider(1.0, 2.0, 0.1), 1.0).save("t.npz")
    assert "preset is 'a4'" in gms_fsm("plot", "t.npz", "--preset", "a4").err
