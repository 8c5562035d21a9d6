"""Two charts as one picture: the second, with what the first has beside it."""

from __future__ import annotations

import textwrap
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, replace

from gms_fsm.charts.chart import Chart, State, Transition
from gms_fsm.difference.changes import ChartPair
from gms_fsm.difference.charts import chart_diff as compared
from gms_fsm.difference.result import PartChange
from gms_fsm.foundation.arguments import checked_kind, refusing
from plots.charts.labels import warn_of_missing_glyphs
from plots.charts.statechart import ChartSheet
from plots.output.drawings import DrawnGraph

NOTE = 60  # characters of a line below the picture
LEGEND = "thick: added or changed; dashed: removed; 'was': before"


@refusing()
def chart_diff(
    a: Chart,
    b: Chart,
    *,
    notation: str = "stateflow",
    direction: str = "TB",
    theme: str = "light",
) -> DrawnGraph:
    """Draw what two charts differ in, as one chart.

    Parameters
    ----------
    a, b : Chart
        The charts. What both have is drawn as the second has it.
    notation : {"stateflow", "math"}
        As for `plots.statechart`.
    direction : {"TB", "LR"}
        States from top to bottom, or from left to right.
    theme : {"light", "dark"}
        Colours; nothing here is distinguished by a colour.

    Returns
    -------
    graphviz.Digraph
        What is added or changed is thick, what is removed dashed; a changed edge has the text of
        the first below its own. The verdict of `gms_fsm.diff` is below the picture.

    Raises
    ------
    ParameterError
        If they are no charts, or an option is not one of those above.

    Examples
    --------
    >>> from gms_fsm.charts import GMS_ELEMENT
    >>> picture = chart_diff(GMS_ELEMENT["signed"], GMS_ELEMENT["published"])
    >>> "different: the flow" in picture.source
    True
    """
    for name, chart in (("a", a), ("b", b)):
        checked_kind(name, chart, Chart, "a Chart, of a model its .chart")
    found, pair = compared(a, b, (a.name, b.name))
    merged = _merged(pair)
    said = "the charts are equal" if found.equal else found.summary
    note = [*textwrap.wrap(said, NOTE), *([LEGEND] if found.changes else [])]
    sheet = ChartSheet(
        merged.chart,
        notation,
        direction,
        theme,
        marked=merged.marked(found.changes, pair),
        removed=merged.removed,
        was=merged.was,
    )
    warn_of_missing_glyphs(sheet.write, "\n".join(note))
    return sheet.graph((0,), bare=True, foot="\n".join(note))


@dataclass(frozen=True)
class MergedChart:
    """The second of two charts, with what only the first has.

    Parameters
    ----------
    chart : Chart
        Both; what only the first has is there without its texts.
    removed : frozenset of str
        States and edges of the first only.
    was : dict of str to list of str
        By edge, what the first has there.
    """

    chart: Chart
    removed: frozenset[str]
    was: dict[str, list[str]]

    def marked(self, changes: Iterable[PartChange], pair: ChartPair) -> frozenset[str]:
        """Return the states and edges that are added or changed."""
        levels, parts = pair.found.levels, set[str]()
        for change in changes:
            if change.part.endswith("edge") and change.what in ("added", "changed"):
                parts.add(change.name if change.what == "added" else pair.edges[change.name])
            elif change.part.startswith(("flow of", "output ")):
                names = change.name.split(" ", 2)[-1].split(", ")  # "in states stick, slip"
                parts |= {levels[name] for name in names}
            elif change.part == "state" and change.what == "added":
                parts.add(change.name)
            elif change.what == "changed" and change.name in levels:
                parts.add(levels[change.name])
        known = {*self.chart.nesting.levels, *(edge.name for edge in self.chart.transitions)}
        return frozenset(parts & known)


def _merged(pair: ChartPair) -> MergedChart:
    """Return both charts as one."""
    a, b, found = pair.a, pair.b, pair.found
    taken = {*b.nesting.levels, *(edge.name for edge in b.transitions), *b.let, *b.inputs}
    taken |= {*b.variables, *b.parameter_names, *b.velocities, *b.force_names}
    inside: dict[str, list[State]] = defaultdict(list)
    paths = dict(found.levels)
    for path, level in a.nesting.levels.items():
        around = level.chain[-2] if len(level.chain) > 1 else ""
        if path in paths or (around and around not in paths):
            continue
        name = _free(level.state.name, taken)
        outer = paths[around] if around else ""
        paths[path] = f"{outer}.{name}" if outer else name
        inside[outer].append(State(name, outputs=dict.fromkeys(b.force_names, "0")))
    gone = {paths[path] for path in paths if path not in found.levels}
    edges, was = [*b.nesting.transitions], dict[str, list[str]]()
    for edge in a.nesting.transitions:
        if edge.name in pair.edges:
            continue
        ends = [paths[each] for each in (*edge.sources, edge.target) if each in paths]
        if len(ends) == len(edge.sources) + 1:
            name = _free(edge.name, taken)
            edges.append(Transition(name, ends[:-1], ends[-1], "True"))
            was[name] = [f"[{a.guard_text(edge.name)}]"]
            gone.add(name)
    chart = _with(b, _filled(b.nesting.states, "", inside), edges)
    for before, after in pair.edges.items():
        if pair.guard(before, True) != pair.guard(after, False):
            was[after] = [f"[{a.guard_text(before)}]"]
    for edge in a.nesting.transitions:
        other = pair.edges.get(edge.name)
        target = next((e.target for e in b.nesting.transitions if e.name == other), "")
        if other is not None and found.levels.get(edge.target) != target:
            was.setdefault(other, []).append(f"-> {edge.target}")
    return MergedChart(chart, frozenset(gone), was)


def _free(name: str, taken: set[str]) -> str:
    """Return a name that nothing else has, and take it."""
    while name in taken:
        name += "_removed"
    taken.add(name)
    return name


def _filled(states: Iterable[State], path: str, more: dict[str, list[State]]) -> tuple[State, ...]:
    """Return states with further states inside."""
    found = []
    for state in (*states, *more.get(path, ())):
        own = f"{path}.{state.name}" if path else state.name
        inside = _filled(state.states, own, more)
        found.append(replace(state, states=inside) if inside else state)
    return tuple(found)


def _with(chart: Chart, states: tuple[State, ...], edges: list[Transition]) -> Chart:
    """Return a chart with other states and edges."""
    return Chart(
        chart.name,
        chart.inputs,
        [name for name in chart.variables if name not in chart.hidden],
        chart.parameters,
        states,
        edges,
        chart.outputs,
        chart.reference,
        let=chart.let,
        velocities=chart.velocities,
        contact_outputs=chart.contact_outputs,
        initial=chart.initial,
    )
