"""Mechanical drawings: of a system, and of the elements of a friction model (Fig. 1 of the paper).

Importing this module needs no matplotlib; drawing does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gms_fsm.errors import ParameterError
from gms_fsm.foundation.arguments import checked_kind, refusing
from gms_fsm.systems.system import System

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gms_fsm.traces.trace import Trace

__all__ = ["schematic", "schematic_figure"]


@refusing()
def schematic(system: System) -> Figure:
    """Draw a system as a mechanism: masses, springs, dampers, and the contacts between them.

    All of it is read from the system. Springs and dampers are those that it declares, between two
    bodies, or a body and the ground or a point that moves; forces given as text are written at an
    arrow. Friction has bristles; end stops, backlash and dog clutches have symbols of
    their own; any other contact is a box. A driven body that others rub on is a belt. The number in
    a box on a line is a gear ratio.

    All bodies stand in a row, in an order in which connections are short. The `motion` of a body
    says whether it turns (round corners, bent arrows), and whether it moves normal to what it rubs
    on (upright arrows and springs).

    Parameters
    ----------
    system : System
        The system; of a model on a rig, `gms_fsm.systems.system.system_of` gives it.

    Returns
    -------
    Figure
        A matplotlib figure, as large as the drawing. Its artists have group ids such as
        ``body load``, ``contact pad``, ``spring k``, ``damper d`` and ``force load``.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    ParameterError
        If it is no system, or has no bodies.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, PulledSlider
    >>> from gms_fsm.systems.system import system_of
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> figure = schematic(system_of(model, PulledSlider(1.0, 2.0, 0.1)))
    >>> [each.get_gid() for each in figure.axes[0].lines if each.get_gid()]
    ['contact friction', 'spring stiffness']
    """
    checked_kind("system", system, System, "a System")
    if not system.bodies:
        raise ParameterError(
            f"system {system.name!r} has no bodies to draw",
            advice="plots.block_diagram draws its supervisors and signals",
        )
    from plots.systems.mechanical_drawing import mechanical_figure

    return mechanical_figure(system)


def schematic_figure(
    trace: Trace | None = None, row: int = -1, elements: int = 4, *, title: str = ""
) -> Figure:
    """Draw a slider on Maxwell elements, deflected as in one row of a run.

    A contact in the default state (stick) is plain pale blue and held by a peg; in another state
    (slip) it is hatched, with an arrow in the direction in which the slider moves.
    """
    from plots.systems.elements import elements_figure

    return elements_figure(trace, row, elements, title)
