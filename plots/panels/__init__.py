"""Single panels: each takes an Axes and a Trace (or differences), draws, and returns its artists.

They share three arguments. ``window = (t0, t1)`` [s] zooms: the run is sampled again inside it.
``elements`` selects elements, counted from 0 (labels count from 1). ``log`` requests a logarithmic
axis where one makes sense. Times of switches and the forces on both sides of them come from the
transition log, which is complete even if the rows are not.

`landscape`, `race` and `pins` are about one element at one row. `unfolded_force` and
`unfolded_states` take what `unfolded` returns.

A panel is defined in the module of its family and listed in ``__all__`` there.
"""

from __future__ import annotations

from plots.panels import (
    _cascades,
    _differences,
    _held,
    _landscapes,
    _many,
    _over_time,
    _portraits,
    _race,
    _shown,
    _states,
    _stribeck,
    _titles,
    _unfolded,
)
from plots.panels._cascades import *  # noqa: F403
from plots.panels._differences import *  # noqa: F403
from plots.panels._held import *  # noqa: F403
from plots.panels._landscapes import *  # noqa: F403
from plots.panels._many import *  # noqa: F403
from plots.panels._over_time import *  # noqa: F403
from plots.panels._portraits import *  # noqa: F403
from plots.panels._race import *  # noqa: F403
from plots.panels._shown import *  # noqa: F403
from plots.panels._states import *  # noqa: F403
from plots.panels._stribeck import *  # noqa: F403
from plots.panels._titles import *  # noqa: F403
from plots.panels._unfolded import *  # noqa: F403

__all__: list[str] = []
__all__ += _cascades.__all__
__all__ += _differences.__all__
__all__ += _held.__all__
__all__ += _landscapes.__all__
__all__ += _many.__all__
__all__ += _over_time.__all__
__all__ += _portraits.__all__
__all__ += _race.__all__
__all__ += _shown.__all__
__all__ += _states.__all__
__all__ += _stribeck.__all__
__all__ += _titles.__all__
__all__ += _unfolded.__all__
