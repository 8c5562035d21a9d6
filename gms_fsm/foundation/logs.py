"""Record arrays that notebooks show as tables: logs, and intervals of sliding."""

from __future__ import annotations

from typing import Any

import numpy as np

from gms_fsm.foundation.display import displayed


@displayed("html")
class Log(np.recarray[Any, Any]):
    """A record array that notebooks show as a table of its first rows.

    In every other respect it is a `numpy.recarray`.

    Examples
    --------
    >>> records = np.array([(0.5, "slip"), (0.7, "stick")], dtype=[("t", "f8"), ("to", "U5")])
    >>> log = records.view(Log)
    >>> log
    <2 records of t, to>
    >>> log.to.tolist(), log[log.t > 0.6]
    (['slip', 'stick'], <1 record of t, to>)
    """

    def __repr__(self) -> str:
        names = self.dtype.names
        if names is None or self.ndim != 1:
            return repr(self.view(np.ndarray))
        return f"<{len(self)} record{'s' * (len(self) != 1)} of {', '.join(names)}>"
