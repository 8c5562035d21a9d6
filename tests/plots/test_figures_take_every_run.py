"""Every figure takes every kind of run, stays small, leaves rcParams alone and needs no pyplot."""

from __future__ import annotations

import itertools
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from gms_fsm import LuGre, Prescribed, SimulationError, Stribeck, Trace, simulate

pytest.importorskip("matplotlib", reason="needs matplotlib (extra: plots)")

import matplotlib
from matplotlib.figure import Figure

from plots import figures, panels
from plots.mechanism import schematic_figure
from tests.helpers import FIG4_SINE, ROOT, matrix, non_drifting, open_loop, pulled_mass, stick_slip

pytestmark = pytest.mark.slow


def lugre() -> Trace:
    model = LuGre(sigma_0=1e3, sigma_1=31.6, sigma_2=4, stribeck=Stribeck(1, 1.5, 1e-3))
    return simulate(model, non_drifting("signed")[1], 30.0)


def broken_off() -> Trace:
    """A run that could not continue: its last row may have no forces."""
    rig = Prescribed(lambda t: 0.1 if t < 1.0 else float("nan"))
    with pytest.raises(SimulationError) as error:
        simulate(stick_slip("signed"), rig, 2.0)
    return error.value.trace


def from_a_file(folder: Path) -> Trace:
    """A run that cannot be resampled: its signal was a Python function."""
    rig = Prescribed(lambda t: 0.2 * np.sin(2 * np.pi * t / 20))
    return Trace.load(simulate(stick_slip("signed"), rig, 20.0).save(folder / "a.npz"))


RUNS: dict[str, Callable[[Path], Trace]] = {
    "Fig. 4, published": lambda _: simulate(stick_slip("published"), Prescribed(FIG4_SINE), 100.0),
    "Fig. 4, signed": lambda _: simulate(stick_slip("signed"), Prescribed(FIG4_SINE), 100.0),
    "pulled mass": lambda _: simulate(*pulled_mass(), 60.0),
    "LuGre": lambda _: lugre(),
    "no transition": lambda _: simulate(stick_slip("signed"), open_loop(), 0.5),
    "standstill": lambda _: simulate(stick_slip("signed"), Prescribed("0"), 1.0),
    "broken off": lambda _: broken_off(),
    "from a file": from_a_file,
    "a few rows": lambda _: simulate(stick_slip("signed"), open_loop(), 20.0, t_eval=[0.0, 20.0]),
}
FIGURES: dict[str, Callable[[Trace], Figure]] = {
    "overview": figures.overview,
    "ribbons": figures.ribbons_figure,
    "cascade": figures.cascade_figure,
    "landscape": lambda run: figures.landscape(run, run.n - 1, row=len(run) // 2),
    "phase": figures.phase,
    "schematic": schematic_figure,
    "Fig. 4": lambda run: figures.figure_4(run, run, run),
    "Fig. 3": lambda run: figures.figure_3(run, run, run, run.F, title="Fig. 3"),
    "laws": lambda run: figures.compare_laws({"one": run, "other": run}),
    "residuals": lambda run: figures.residuals({"a": (run.t, run.F)}, "title"),
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Trace]:
    folder = tmp_path_factory.mktemp("runs")
    return {name: make(folder) for name, make in RUNS.items()}


PAIRS = list(itertools.product([name for name in RUNS if name != "Fig. 4, signed"], FIGURES))


@pytest.mark.parametrize(("name", "kind"), matrix(PAIRS, PAIRS[::3]))
def test_every_figure(runs: dict[str, Trace], name: str, kind: str, tmp_path: Path) -> None:
    before = dict(matplotlib.rcParams)
    figure = FIGURES[kind](runs[name])
    path = figures.save(figure, tmp_path / "picture.svg")
    assert dict(matplotlib.rcParams) == before
    assert 5_000 < path.stat().st_size < 1_000_000
    labels = [label for ax in figure.axes for label in (ax.get_xlabel(), ax.get_ylabel())]
    bar = "elements in slip"
    assert all("[" in label for label in labels if label and label != bar), labels


def test_the_same_run_gives_the_same_file(runs: dict[str, Trace], tmp_path: Path) -> None:
    run = runs["Fig. 4, signed"]
    files = [
        figures.save(figures.ribbons_figure(run), tmp_path / f"{n}.svg").read_bytes() for n in "ab"
    ]
    assert files[0] == files[1]


def test_ribbons_figure_has_the_columns_of_the_run(runs: dict[str, Trace]) -> None:
    def titles(run: Trace, around: float | None = None) -> list[str]:
        figure = figures.ribbons_figure(run, around)
        return [ax.get_title(loc="left") for ax in figure.axes if ax.get_title(loc="left")]

    assert len(titles(runs["Fig. 4, signed"])) == 10
    assert "margin to the threshold" in titles(runs["Fig. 4, signed"])
    assert len(titles(runs["LuGre"])) == 6
    assert len(titles(runs["LuGre"], around=2.0)) == 10


def test_window_and_elements_reach_every_panel(runs: dict[str, Trace]) -> None:
    run = runs["Fig. 4, published"]
    figure = figures.ribbons_figure(run, 20.14, window=(10.0, 30.0), elements=[0, 3])
    axes = {ax.get_title(): ax for ax in figure.axes}
    for letter in "abcd":
        assert axes[letter].get_xlim() == (10.0, 30.0)
    for letter in "dh":
        names = [label.get_text() for label in axes[letter].get_yticklabels()]
        assert names == ["E1", "E4"]
    (pieces,) = axes["i"].collections
    assert set(pieces.get_array()) == {0, 1, 2}
    figure = figures.overview(run, window=(10.0, 30.0), elements=[1])
    assert figure.axes[0].get_xlim() == (10.0, 30.0)
    figure = figures.figure_4(run, run, run, window=(10.0, 30.0), elements=[1])
    assert figure.axes[1].get_xlim() == (10.0, 30.0)
    assert len(figure.axes[1].lines) == 1


def test_a_crowded_run_is_shown_from_its_last_cycles() -> None:
    run = simulate(stick_slip("signed"), Prescribed("sin(2*pi*t/5)"), 200.0)
    figure = figures.ribbons_figure(run)
    begin, end = figure.axes[0].get_xlim()
    assert end == 200.0
    assert 12.0 < end - begin < 18.0
    assert "last" in figure.axes[0].get_title(loc="left")


def test_a_measurement_is_shown_with_the_model(runs: dict[str, Trace]) -> None:
    run = runs["Fig. 4, signed"]
    part = panels.shown(run)
    measured = figures.Measured(part.t, part.x, part.F + 0.1)
    figure = figures.overview(run, measured)
    model, data = figure.axes[1].lines[:2]
    assert [model.get_label(), data.get_label()] == ["model", "measured"]
    np.testing.assert_array_equal(data.get_ydata(), measured.F)


def test_pyplot_is_never_imported() -> None:
    code = """
import sys
from gms_fsm import GMS, GMSParameters, Prescribed, simulate
from plots import figures
from plots.mechanism import schematic_figure
run = simulate(GMS(GMSParameters.paper("stick-slip"), law="signed"), Prescribed("0.2"), 3.0)
for number, make in enumerate((figures.overview, figures.ribbons_figure, schematic_figure)):
    figures.save(make(run), f"{sys.argv[1]}/{number}.png")
print("matplotlib.pyplot" in sys.modules)
"""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", code, folder],
            capture_output=True,
            text=True,
            check=True,
            cwd=ROOT,
        )
    assert done.stdout.strip() == "False"


def test_the_zoom_is_inside_the_requested_window(runs: dict[str, Trace]) -> None:
    for window in ((3.0, 7.0), (30.0, 40.0)):
        figure = figures.ribbons_figure(runs["Fig. 4, published"], window=window)
        (margins,) = (ax for ax in figure.axes if ax.get_title() == "f")
        low, high = margins.get_xlim()
        assert window[0] <= low < high <= window[1]
