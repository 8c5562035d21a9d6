"""A live page: the replay page over a run that the page itself computes, again at every change.

Python writes the engine of the run as JavaScript (`gms_fsm.exporters.live`), where the values of
its rows are (`plots.page._sources`), and the numbers that can be changed, with units and rules.
"""

from __future__ import annotations

import contextlib
import importlib.util
import re
import tempfile
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

from gms_fsm.charts.gms import LAWS
from gms_fsm.errors import OutputError, ParameterError
from gms_fsm.exporters.live import LiveEngine, live_engine
from gms_fsm.foundation.arguments import refusing
from gms_fsm.foundation.text import visible
from gms_fsm.language import Name
from gms_fsm.run.problem import ROUNDING, Problem
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.run.simulate import simulate
from gms_fsm.session.session import Session
from gms_fsm.session.tree.branches import Tree
from gms_fsm.session.tree.export import save_scenario
from gms_fsm.systems.models import Model
from gms_fsm.systems.mounted import Mounted, arguments_of
from gms_fsm.systems.numbers import (
    NUMBERS,
    NamedNumber,
    elements_of,
    known_in,
    law_of,
    number_of,
    numbers_of,
    with_elements,
    with_law,
    with_named_constants,
)
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.system import System
from gms_fsm.traces.trace import Trace
from plots.page._sources import live_run
from plots.page.replay import Replay, heading, page_data, page_html, part_text
from plots.views.ranges import Ends, checked_ranges, is_logarithmic, usual_range

LIVE = (
    "js/live/rows.js",
    "js/live/numbers.js",
    "js/live/sweep.js",
    "js/live/dragging.js",
    "js/live/live.js",
    "js/live/matters.js",
)
ENGINE, WORKERS = "js/live/engine.js", "js/live/workers.js"
LARGE = 200_000  # characters of an engine, which has its records; of such there is only one
_TABLE = re.compile(r"\[\[?([\w.]+)\]\]?")
_LINE = re.compile(r"([\w.]+) = (-?[\d.]\S*|\[[-\d.e+, ]+\])")


@refusing(rig="play(model, rig, t_end), or play(system, t_end); plots.replay shows a trace")
def play(
    model: Model | System,
    rig: Rig | float,
    t_end: float | None = None,
    *,
    vary: Mapping[str, Ends | None] | None = None,
    title: str = "",
    t_start: float = 0.0,
    initial: Mapping[str, Any] | None = None,
    settings: Settings | None = None,
    **options: Unpack[SettingOptions],
) -> Replay:
    """Make a live page: a run that the page computes again when a slider moves.

    It is the replay page, with an engine: the run has the bits of `gms_fsm.simulate`. The run as it
    was written stays behind the present one, and their first difference is named. Numbers in guards
    can be changed, too: that of ``v > 0.3`` on the edge ``opens`` is called ``opens_at`` there.

    Parameters
    ----------
    model, rig, t_end
        As for `gms_fsm.simulate`: ``play(model, rig, t_end)``, or ``play(system, t_end)``.
    vary : mapping of str to (float, float) or None, optional
        The sliders that are shown first, by the names of the numbers, with their lowest and highest
        values: ``{"F_s": (0.5, 3.0), "k2": None}``; None is a decade around the value. In a system
        ``{"numbers.m": (0.5, 2.0), "pad.F_s": None}``. By default all numbers but those of single
        elements and those of guards.
    title : str, optional
        Of the page; by default what runs.
    t_start, initial, settings, **options
        As for `gms_fsm.simulate`. Requested times are ignored: every step is a row.

    Returns
    -------
    Replay
        The page; ``save`` writes it to a file, and a notebook shows it.

    Raises
    ------
    ParameterError
        If there is no such number, its range does not contain the value of the model, or the run
        cannot be printed: a signal is a Python function, or the method is not one of ours.
    MissingExtraError
        If uPlot is not installed.

    Examples
    --------
    >>> from gms_fsm import GMS, GMSParameters, PulledSlider
    >>> model = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> page = play(model, PulledSlider(1.0, 2.0, 0.1), 60.0, vary={"F_s": (0.5, 3.0)})
    >>> page.save("page.html")  # doctest: +SKIP
    """
    arguments_of("play", model, rig, t_end)
    given = {} if vary is None else vary
    if settings is None and "engine" not in options:
        ours = not isinstance(options.get("method"), type)
        fast = ours and importlib.util.find_spec("llvmlite") is not None
        options["engine"] = "compiled" if fast else "ifelse"
    options.pop("t_eval", None)
    more: Any = {"t_start": t_start, "initial": initial, "settings": settings}
    tree = Session(model, rig, t_end, **more, **options).tree
    start = tree.branch().start
    what, hidden = with_named_constants(start.what)
    if hidden:
        tree = Tree(what, start.t_end, start.t_start, start.initial, start.chosen)
    _ranges(what, given)  # refused before anything is printed, which takes seconds
    start, trace = tree.branch().start, tree.trace(0)
    engine = live_engine(start, trace.title)
    variants = [start, *(_variants(start) if len(engine.text) < LARGE else ())]
    traces = [trace, *(_beginning(each) for each in variants[1:])]
    data, charts = page_data(traces, title=title or heading(trace))
    engines = [engine, *(live_engine(each, trace.title) for each in variants[1:])]
    plane = {each["name"]: each["plane"] for each in data["runs"][0]["contacts"]}
    parts = zip(data["runs"], traces, variants, engines, strict=True)
    data["live"] = {
        "still": ROUNDING,
        "variants": [_variant(*each, given, hidden, plane, data["title"]) for each in parts],
    }
    data["runs"] = []
    texts = ",\n".join(each.text for each in engines)
    text = f"{part_text(ENGINE)}const ENGINES = [\n{texts},\n];\n"
    styles = ("page.css", "js/live/live.css")
    return Replay(page_html(data, charts, (text, part_text(WORKERS)), LIVE, styles))


# --------------------------------------------------------------------------- variants
def _variants(start: Problem) -> Iterator[Problem]:
    """Yield the same run with another slip law, with an element less and with one more."""
    what = start.what
    more: Any = {"t_start": start.t_start, "initial": start.initial}
    law, count = law_of(what), elements_of(what)
    if law is None or count is None:
        return
    changes: list[tuple[Any, Any]] = [(with_law, each) for each in LAWS if each != law]
    changes += [(with_elements, n) for n in (count - 1, count + 1) if n]
    for change, to in changes:
        made: Mounted | None = None
        with contextlib.suppress(ParameterError, UserWarning), warnings.catch_warnings():
            warnings.simplefilter("error")  # the published law where F_s = F_c never arrests
            made = change(what, to)
        if made is not None:
            yield Problem.on(made, start.t_end, start.chosen, **more)


def _beginning(start: Problem) -> Trace:
    """Return the first part of a run; a page has no rows of it."""
    what, t_end = start.what, start.t_start + 1e-3 * (start.t_end - start.t_start)
    settings = replace(start.chosen, engine="ifelse")
    more: Any = {"t_start": start.t_start, "initial": start.initial, "settings": settings}
    if what.named:
        return simulate(what.system, t_end, **more)
    return simulate(what.model, what.rig, t_end, **more)


def _variant(
    stored: Mapping[str, Any],
    trace: Trace,
    start: Problem,
    engine: LiveEngine,
    vary: Mapping[str, Ends | None],
    hidden: frozenset[str],
    planes: Mapping[str, Any],
    title: str,
) -> dict[str, Any]:
    """Return what a page knows of one engine."""
    what, layout = start.what, start.program.layout
    run = live_run(stored, trace, engine)
    for contact in run["contacts"]:
        contact["plane"] = planes[contact["name"]]  # as wide for all
    return {
        "run": run,
        "law": law_of(what),
        "elements": elements_of(what),
        "numbers": _numbers(what, engine, _ranges(what, vary), hidden),
        "engine": engine.numbers,
        "velocities": [layout.y.index(b.v) for b in start.system.bodies if not b.driven],
        "masses": _masses(start),
        "scenario": _scenario(start, title),
    }


def _masses(start: Problem) -> dict[str, str]:
    """Return by contact the number that is the mass of a body that it acts on."""
    what, read, found = start.what, start.program.plan.read, dict[str, str]()
    for bank in read.banks:
        for body in (body for row in bank.jacobian for body in row):
            inertia = read.inertias.get(body)
            if isinstance(inertia, Name) and inertia.id in what.rig.numbers:
                found[what.whose(bank.name)] = what.of(NUMBERS, inertia.id)
    return found


# --------------------------------------------------------------------------- numbers
def _ranges(what: Mounted, vary: Mapping[str, Ends | None]) -> dict[str, Ends]:
    usual = (
        [name for name, ends in vary.items() if ends is None] if isinstance(vary, Mapping) else []
    )
    given: Any = {name: ends for name, ends in vary.items() if name not in usual} if usual else vary
    found = checked_ranges("vary", given, lambda name: number_of(what, name))
    return found | {name: usual_range(number_of(what, name)) for name in usual}


def _numbers(
    what: Mounted, engine: LiveEngine, vary: Mapping[str, Ends], hidden: frozenset[str]
) -> list[dict[str, Any]]:
    """Return the numbers that the page can change, those to be shown first with ``first``."""
    every = {name: each for name, each in numbers_of(what).items() if name in engine.numbers}
    for name in vary:
        if name not in every:
            raise ParameterError(
                "the run has no such number: it is printed with this value",
                place=f"vary[{name!r}]",
                value=numbers_of(what)[name].value,
            )
    plain = [name for name, each in every.items() if each.element is None and name not in hidden]
    first = [*vary] or plain or [*every]
    order = [*first, *(name for name in every if name not in first)]
    made = [_number(every[name], vary.get(name), name in first) for name in order]
    if law_of(what) == "published":  # it is refused where both are equal
        for each in made:
            each["rule"] = [[">", u] if u == "F_c" else [op, u] for op, u in each["rule"]]
    return made


def _number(number: NamedNumber, ends: Ends | None, first: bool) -> dict[str, Any]:
    low, high = usual_range(number) if ends is None else ends
    parameter = number.parameter
    owner = number.whole.rpartition(".")[0]
    return {
        "name": number.name,
        "whole": number.whole,
        "owner": owner,
        "element": number.element,
        "unit": parameter.unit,
        "meaning": visible(parameter.meaning),
        "rule": [[each.op, each.limit] for each in parameter.bounds],
        "value": number.value,
        "low": low,
        "high": high,
        "log": is_logarithmic(low, high),
        "first": first,
    }


def _scenario(start: Problem, title: str) -> list[Any]:
    """Return the scenario in parts; nothing if its signals are too long for a scenario file."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            path = save_scenario(Path(folder, "scenario.toml"), start, title, "")
        except OutputError:
            return []
        return _parts(path.read_text(encoding="utf-8"), start.what)


def _parts(text: str, what: Mounted) -> list[Any]:
    """Return the text of a scenario as texts, and the numbers that stand between them."""
    known, table, owner = known_in(what), "", ""
    parts: list[Any] = [""]
    for line in text.splitlines(keepends=True):
        if found := _TABLE.match(line):
            table = found[1]
        elif table in ("contact", "supervisor") and line.startswith("name = "):
            owner = line.partition('"')[2].rpartition('"')[0]
        found = _LINE.fullmatch(line.rstrip())
        name = found[1].rpartition(".")[2] if found else ""
        number = ""
        if table == "numbers":
            number = what.of(NUMBERS, name)
        elif table.endswith((".model", ".values")) or (found and found[1].startswith("values.")):
            number = what.of(owner, name)
        if found is None or number not in known:
            parts[-1] += line
            continue
        parts[-1] += f"{found[1]} = "
        wide = found[2].startswith("[")
        parts += [{"number": number, "wide": wide, "text": found[2]}, "\n"]
    return parts
