"""Write a Graphviz picture to a file.

Without Graphviz, the DOT text is written instead, with a warning that says how to get pictures: a
missing drawing program must not stop a computation.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import graphviz

from gms_fsm.errors import MissingExtraError, ParameterError
from gms_fsm.foundation.arguments import checked_path, refusing
from gms_fsm.foundation.files import write_whole
from plots.charts.statechart import ChartGraph
from plots.output import formats


@refusing()
def render(graph: graphviz.Digraph, path: str | Path) -> Path:
    """Write a picture, or the text of a graph; the file ending selects the format.

    Parameters
    ----------
    graph : graphviz.Digraph
        For example from `plots.charts.statechart.statechart`.
    path : str or Path
        Its ending must be that of a graph format in `plots.output.formats.FORMATS`; some formats
        are for state charts only. The folder must exist. An existing file is replaced atomically.

    Returns
    -------
    Path
        The file actually written: without Graphviz, a DOT file next to `path`.

    Raises
    ------
    ParameterError
        If the file ending is not supported.
    OutputError
        If the folder cannot be written, or if Graphviz cannot draw the graph.

    Warns
    -----
    UserWarning
        If there is no Graphviz, neither program nor package.

    Examples
    --------
    >>> import tempfile
    >>> from gms_fsm.charts import LUGRE
    >>> from plots.charts.statechart import statechart
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     render(statechart(LUGRE), Path(folder, "lugre.dot")).name
    'lugre.dot'
    """
    if not hasattr(graph, "source"):
        raise ParameterError(
            f"graph is {graph!r:.60}",
            advice="give first the graph, for example from statechart, then the path",
        )
    path = checked_path("path", path)
    chart: tuple[formats.Written, ...] = ("chart",) if isinstance(graph, ChartGraph) else ()
    form = formats.chosen(path, "graph", *chart)
    try:
        content = form.write(graph.chart if form.subject == "chart" else graph)
    except MissingExtraError as error:
        path = path.with_suffix(formats.INSTEAD)
        content = formats.chosen(path, "graph").write(graph)
        # The same text each time, so that Python shows it once per process, not per picture.
        warnings.warn(f"charts are written as DOT text: {error}", stacklevel=3)
    return write_whole(path, lambda file: file.write(content))
