"""Coverage files: charts and counts as JSON, validated on reading. Reading executes nothing."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.files.tables import ChartTable
from gms_fsm.errors import GMSError, TraceFileError
from gms_fsm.foundation.arguments import no_file
from gms_fsm.foundation.files import write_text
from gms_fsm.traces.coverage.counts import ChartCoverage, EdgeCoverage, StateCoverage
from gms_fsm.traces.coverage.decisions import decisions
from gms_fsm.traces.files.unreadable import unreadable

FORMAT = "gms-fsm coverage 1"
Count = Annotated[int, Field(ge=0)]
Counted = tuple[Count, ...]


class _Counts(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _StateCounts(_Counts):
    name: str
    rows: Counted
    entries: Counted


class _EdgeCounts(_Counts):
    edge: str
    source: str
    taken: Counted
    asked: dict[str, Counted]
    closest: dict[str, tuple[float | None, ...]]  # None: it has no margin


class _ChartCounts(_Counts):
    chart: ChartTable
    runs: Count
    watched: Count
    states: tuple[_StateCounts, ...]
    edges: tuple[_EdgeCounts, ...]


class _CoverageFile(_Counts):
    format: Literal["gms-fsm coverage 1"]
    parts: dict[str, _ChartCounts] = Field(min_length=1)


def write_parts(path: Path, parts: Mapping[str, ChartCoverage]) -> Path:
    """Write the counts of each contact."""
    data = {"format": FORMAT, "parts": {name: _written(part) for name, part in parts.items()}}
    return write_text(path, f"{json.dumps(data, indent=1)}\n")


def read_parts(path: Path) -> dict[str, ChartCoverage]:
    """Read them; the file must be whole, and its counts those of its charts."""
    try:
        file = _CoverageFile.model_validate_json(path.read_bytes())
        return {name: _read(part) for name, part in file.parts.items()}
    except FileNotFoundError:
        raise no_file(path, TraceFileError) from None
    except (OSError, ValueError, ValidationError, GMSError, RecursionError) as error:
        advice = "give another name, or remove it"
        raise unreadable(path, "coverage", error, advice=advice) from None


def _written(part: ChartCoverage) -> dict[str, Any]:
    edges = [
        {
            **vars(each),
            "closest": {
                vector: [margin if math.isfinite(margin) else None for margin in margins]
                for vector, margins in each.closest.items()
            },
        }
        for each in part.edges
    ]
    return {
        "chart": ChartTable.of(part.chart).model_dump(),
        "runs": part.runs,
        "watched": part.watched,
        "states": [vars(each) for each in part.states],
        "edges": edges,
    }


def _read(part: _ChartCounts) -> ChartCoverage:
    chart = part.chart.build(Chart)
    made = ChartCoverage(
        chart,
        tuple(StateCoverage(each.name, each.rows, each.entries) for each in part.states),
        tuple(
            EdgeCoverage(
                each.edge,
                each.source,
                each.taken,
                each.asked,
                {
                    vector: tuple(math.inf if u is None else u for u in margins)
                    for vector, margins in each.closest.items()
                },
            )
            for each in part.edges
        ),
        part.runs,
        part.watched,
    )
    _check(made)
    return made


def _check(part: ChartCoverage) -> None:
    """Refuse counts that are not those of the chart."""
    chart = part.chart
    states, edges = [each.name for each in part.states], [(e.edge, e.source) for e in part.edges]
    if states != [each.name for each in chart.states]:
        raise ValueError("its states are not those of its chart")
    if edges != [(each.name, each.source) for each in chart.transitions]:
        raise ValueError("its edges are not those of its chart")
    counts = [u for each in part.states for u in (each.rows, each.entries)]
    counts += [u for each in part.edges for u in (each.taken, *each.asked.values())]
    if {len(each) for each in counts} != {part.n} or not part.n:
        raise ValueError("its counts are not of so many elements")
    for each in part.edges:
        size = len(decisions(chart)[each.edge].comparisons)
        for vector in (*each.asked, *each.closest):
            if len(vector) != size or set(vector) - {"0", "1"}:
                raise ValueError(f"{vector!r} is not a truth vector of {each.edge}")
        if {len(margins) for margins in each.closest.values()} - {size}:
            raise ValueError(f"the margins of {each.edge} are not those of its guard")
