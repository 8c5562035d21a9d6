"""Drawing the run of a system with several contacts is one error, which says to choose one."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import pytest

from gms_fsm.errors import ParameterError
from plots import LiveChart, animate, live_statechart, statechart
from tests.plots.systems_to_draw import BLOCKS, STICTION, run

pytest.importorskip("matplotlib", reason="figures need the extra 'plots'")

from plots import _elements, figures, panels  # after the skip
from plots._matplotlib import Figure

AX = Figure().subplots()
ON_AXES = sorted(
    {*panels.__all__}
    - {"difference", "residual", "slip_bar"}
    - {"lag_between_ticks", "lag_over_period", "lag_over_time"}
    - {"cascade_window", "has_threshold", "lettered", "shown"}
    - {"landscape", "pins", "race"}  # of one element
    - {"Unfolded", "arrows", "unfolded", "unfolded_force", "unfolded_states"}
)
DRAWN: dict[str, Callable[..., object]] = {
    "LiveChart": LiveChart,
    "live_statechart": partial(live_statechart, row=0),
    "animate": partial(animate, path="run.gif"),
    "statechart": lambda trace: statechart(STICTION, counts=trace),
    "schematic": partial(_elements.elements_at, AX),
    "cascade_window": panels.cascade_window,
    "shown": panels.shown,
    **{name: partial(getattr(panels, name), AX) for name in ON_AXES},
    **{name: getattr(figures, name) for name in ("overview", "ribbons_figure", "cascade_figure")},
    "landscape": partial(figures.landscape, element=0),
    "landscape, panel": partial(panels.landscape, AX, element=0),
    "race": partial(panels.race, AX, element=0),
    "pins": partial(panels.pins, AX, element=0, checks=None),
    "unfold": partial(figures.unfold, t0=0.0, t1=1.0),
    "phase": figures.phase,
}


@pytest.mark.parametrize("name", DRAWN)
def test_it_says_to_choose_a_contact(name: str) -> None:
    said = (
        r"^system 'two blocks on a belt' has the contacts 'pad1', 'pad2'; "
        r"say which one: trace.contact\('pad1'\)$"
    )
    with pytest.raises(ParameterError, match=said):
        DRAWN[name](run(BLOCKS))


@pytest.mark.slow
def test_a_notebook_shows_text() -> None:
    assert run(BLOCKS)._repr_png_() is None  # type: ignore[attr-defined]
    assert run(BLOCKS).contact("pad1")._repr_png_() is not None  # type: ignore[attr-defined]


def test_another_contact_can_be_chosen() -> None:
    first, second = (run(BLOCKS).contact(name) for name in ("pad1", "pad2"))
    assert first.contact("pad2").transitions.t.tolist() == second.transitions.t.tolist()
