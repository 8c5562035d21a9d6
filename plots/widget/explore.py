"""Explore a run in a notebook; the widget itself needs the extra ``jupyter``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gms_fsm.foundation.arguments import refusing
from gms_fsm.foundation.extras import require

if TYPE_CHECKING:
    from gms_fsm.systems.models import Model
    from gms_fsm.systems.rigs import Rig
    from gms_fsm.systems.system import System
    from plots.widget.explorer import Explorer


@refusing()
def explore(
    model: Model | System,
    rig: Rig | float,
    t_end: float | None = None,
    *,
    sliders: Mapping[str, tuple[float, float]],
    height: int = 720,
    **options: Any,
) -> Explorer:
    """Explore a run in a notebook: sliders, and branches to poke and compare (extra ``jupyter``).

    The widget contains the replay page. A slider runs the model again; a poke, another slip law or
    *fork* makes a branch, and the fork strip shows the branches as a tree over time.

    Parameters
    ----------
    model, rig, t_end
        As for `gms_fsm.simulate`: ``explore(model, rig, t_end)``, or ``explore(system, t_end)``.
    sliders : mapping of str to (float, float)
        Lowest and highest value by name: ``{"F_s": (1.0, 3.0), "k2": (0.1, 10.0)}``, in a system
        ``{"numbers.m": (0.5, 2.0), "pad.F_s": (1.0, 3.0)}``. A slider is logarithmic if its range
        is positive and covers two decades.
    height : int
        Of the replay page, in pixels.
    **options
        ``t_start``, ``initial``, ``settings`` and the fields of `gms_fsm.Settings` by name. The
        engine is ``"compiled"`` if llvmlite is installed (extra ``fast``).

    Returns
    -------
    Explorer
        The widget. What its controls do can be done from Python: ``w.set(F_s=1.8)``,
        ``w.poke({"z": {0: 0.0}}, t=5.0)``, ``w.fork(law="signed")``, ``w.show(0)``,
        ``w.compare(0, 1)``, ``w.rename(1, "poked")``, ``w.delete(1)``, ``w.export("one.toml")``;
        ``w.branches``, ``w.current``, ``w.values`` and ``w.trace(1)`` say how it stands.

    Raises
    ------
    MissingExtraError
        If anywidget or uPlot is not installed.
    ParameterError
        If there is no such number, or its range does not contain the value of the model.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, Prescribed
    >>> w = explore(GMS(GMSParameters.paper("stick-slip"), law="published"),
    ...             Prescribed("0.15*sin(2*pi*t/25)"), 30.0, sliders={"F_s": (0.5, 3.0)})
    >>> w.poke({"z": {0: -1.4}}, t=25.0)
    1
    >>> print(w.compare(0, 1))
    branches 0 and 1 until t = 30 s: 15 and 16 transitions
      first different transition at t = 25 s
      largest difference: z 876 mm, F 537 mN
    """
    require("anywidget", "jupyter")
    from plots.widget.explorer import Explorer

    return Explorer(model, rig, t_end, sliders=sliders, height=height, **options)
