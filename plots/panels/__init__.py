"""Single panels: each takes an Axes and a Trace (or differences), draws, and returns its artists.

They share three options. ``window = (t0, t1)`` [s] zooms: the run is sampled again inside it; by
default all is shown. ``elements`` selects elements, counted from 0 (labels count from 1), by
default all. ``log`` requests a logarithmic axis where one makes sense. Times of switches and the
forces on both sides of them come from the transition log, which is complete even if the rows are
not.

`landscape`, `race` and `pins` are about one element at one row. `unfolded_force` and
`unfolded_states` take what `unfolded` returns.

A panel is defined in the module of its family and listed in ``__all__`` there.
"""

from __future__ import annotations

from plots.panels import (
    _differences,
    _many,
    _over_time,
    _portraits,
    _stribeck,
    active_states,
    held_outputs,
)
from plots.panels._differences import *  # noqa: F403
from plots.panels._many import *  # noqa: F403
from plots.panels._over_time import *  # noqa: F403
from plots.panels._portraits import *  # noqa: F403
from plots.panels._stribeck import *  # noqa: F403
from plots.panels.active_states import *  # noqa: F403
from plots.panels.guards import landscapes, racing
from plots.panels.guards.landscapes import *  # noqa: F403
from plots.panels.guards.racing import *  # noqa: F403
from plots.panels.held_outputs import *  # noqa: F403
from plots.panels.micro_steps import cascades, unfolding
from plots.panels.micro_steps.cascades import *  # noqa: F403
from plots.panels.micro_steps.unfolding import *  # noqa: F403
from plots.panels.parts import selection, titles
from plots.panels.parts.selection import *  # noqa: F403
from plots.panels.parts.titles import *  # noqa: F403

__all__: list[str] = []
__all__ += cascades.__all__
__all__ += _differences.__all__
__all__ += held_outputs.__all__
__all__ += landscapes.__all__
__all__ += _many.__all__
__all__ += _over_time.__all__
__all__ += _portraits.__all__
__all__ += racing.__all__
__all__ += selection.__all__
__all__ += active_states.__all__
__all__ += _stribeck.__all__
__all__ += titles.__all__
__all__ += unfolding.__all__
